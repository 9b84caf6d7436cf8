//! What lights a scene. Radiance is linear, with the primaries of sRGB.
//!
//! A light is found in two ways: [`Light::sample`] draws a direction to it, and [`Light::ahead`]
//! tells what it adds along a direction that was chosen for another reason, with the density that
//! `sample` has for that direction. Both agree, so the two ways can be weighed against each other
//! (Veach 1997, section 9.2). No light casts a shadow.

mod cone;
mod distant;
mod distribution;
mod dome;
mod environment;
mod lights;
mod quad;
mod sphere;
mod square;

use glam::Vec3;

pub use self::{
    distant::Distant,
    dome::{Constant, Sky},
    environment::{Environment, EnvironmentError},
    lights::{Lights, MOST_DRAWN},
    quad::Quad,
    sphere::Sphere,
    square::Square,
};
use crate::image::luminance;

/// A light of a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A rectangle that shines from one side.
    Quad(Quad),
    /// A ball that shines outwards.
    Sphere(Sphere),
    /// So far away that it comes from the same directions everywhere, like the sun.
    Distant(Distant),
    /// The same from all directions.
    Constant(Constant),
    /// From all directions, as a picture tells.
    Environment(Environment),
    /// A dome, brightest above: nearly even, so that it is found along rays alone and never sampled.
    Sky(Sky),
}

/// The light that arrives from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Towards the light: unit length, world space.
    pub direction: Vec3,
    /// To the light, in metres; infinite for what is at infinity.
    pub distance: f32,
    /// Irradiance on a surface that faces the direction, as if the whole light were there: the
    /// radiance over the density.
    pub irradiance: Vec3,
    /// The density with which the direction was drawn, sr⁻¹; infinite when the light comes from a
    /// single direction, which nothing else can find.
    pub density: f32,
}

/// What a light adds along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightAhead {
    /// To the light, in metres; infinite for what is at infinity.
    pub distance: f32,
    /// The density with which the light is sampled in this direction, sr⁻¹.
    pub density: f32,
    /// Radiance that arrives along the ray.
    pub radiance: Vec3,
}

impl Light {
    /// The light that reaches `position` (world space, metres) from the direction that `square`
    /// names; the mean over the square is the irradiance. `None` where none arrives, and for
    /// what is not a number.
    #[inline]
    pub fn sample(&self, position: Vec3, square: &Square) -> Option<LightSample> {
        let point = square.point();
        if !(position.is_finite() && point.is_finite()) {
            return None;
        }
        let sample = match self {
            Self::Quad(quad) => quad.sample(position, point),
            Self::Sphere(sphere) => sphere.sample(position, square),
            Self::Distant(distant) => distant.sample(square),
            Self::Constant(constant) => Some(constant.sample(point)),
            Self::Environment(environment) => environment.sample(point),
            Self::Sky(_) => None,
        }?;
        let LightSample { direction, irradiance, density, .. } = sample;
        let is_sound = direction.is_finite() && irradiance.is_finite() && density > 0.0;
        is_sound.then_some(sample)
    }

    /// What the light adds along the ray from `origin` (world space, metres) in the unit
    /// `direction`, if the ray meets nothing nearer than [`LightAhead::distance`]. `None` where it
    /// adds nothing, for a light that comes from a single direction, and for what is not a number.
    pub fn ahead(&self, origin: Vec3, direction: Vec3) -> Option<LightAhead> {
        if !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        let ahead = match self {
            Self::Quad(quad) => quad.ahead(origin, direction),
            Self::Sphere(sphere) => sphere.ahead(origin, direction),
            Self::Distant(distant) => distant.ahead(direction),
            Self::Constant(constant) => Some(constant.ahead()),
            Self::Environment(environment) => environment.ahead(direction),
            Self::Sky(sky) => Some(sky.ahead(direction)),
        }?;
        let is_sound = ahead.distance > 0.0 && ahead.density >= 0.0;
        is_sound.then_some(ahead)
    }

    /// Whether it looks so narrow from everywhere that of the directions which a rough surface chooses for another
    /// reason hardly any finds it, and no more would come of them than of those that are drawn.
    pub fn is_narrow(&self) -> bool {
        matches!(self, Self::Distant(distant) if distant.is_narrow())
    }

    /// The power that the light sends into a scene within `scene_radius` metres of its middle: the
    /// luminance of watts per metre² times metres². For choosing among lights.
    ///
    /// Lights at infinity send the power that passes through the disc of that radius (Pharr, Jakob &
    /// Humphreys 2023, section 12.5).
    pub fn power(&self, scene_radius: f32) -> f32 {
        luminance(match self {
            Self::Quad(quad) => quad.power(),
            Self::Sphere(sphere) => sphere.power(),
            Self::Distant(distant) => distant.power(scene_radius),
            Self::Constant(constant) => constant.power(scene_radius),
            Self::Environment(environment) => environment.power(scene_radius),
            Self::Sky(_) => Vec3::ZERO,
        })
    }
}

#[cfg(test)]
mod tests;
