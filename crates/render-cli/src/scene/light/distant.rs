//! Light from afar.

use std::f32::consts::PI;

use glam::Vec3;

use super::{LightAhead, LightSample, Square, cone::Cone};

/// A light at infinity that looks like an even disc, or comes from a single direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distant {
    towards: Vec3,
    irradiance: Vec3,
    disc: Option<Disc>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Disc {
    cone: Cone,
    radiance: Vec3,
    /// That it gives, as far as directions in the disc are alike.
    irradiance: Vec3,
    /// Of each of its directions, sr⁻¹.
    density: f32,
}

/// Least density of a light that is narrow, sr⁻¹: one that looks less than 6.5° wide.
const NARROW: f32 = 100.0;

impl Distant {
    /// The light that gives a surface facing it `irradiance` and looks `angular_diameter` rad wide: up
    /// to π; when 0 it comes from a single direction. `towards` is the unit vector to its middle,
    /// world space.
    ///
    /// An even disc of radiance L and angular radius α gives a surface that faces it π L sin²α, the
    /// integral of L cos θ, so a wider one is no brighter on the scene.
    pub fn new(towards: Vec3, irradiance: Vec3, angular_diameter: f32) -> Self {
        let sine = (0.5 * f64::from(angular_diameter).clamp(0.0, PI.into())).sin();
        let cone = Cone::of_sine_squared(towards.as_dvec3().normalize_or_zero(), sine * sine);
        let radiance = irradiance / (PI * (sine * sine) as f32);
        let density = cone.solid_angle().recip();
        let is_wide = density <= f32::MAX.into() && radiance.is_finite();
        let disc = Disc {
            cone,
            radiance,
            irradiance: radiance * cone.solid_angle() as f32,
            density: density as f32,
        };
        Self { towards, irradiance, disc: is_wide.then_some(disc) }
    }

    /// See [`Light::sample`](super::Light::sample): all directions of the disc are equally likely.
    #[inline]
    pub(super) fn sample(&self, square: &Square) -> Option<LightSample> {
        let single = LightSample {
            direction: self.towards,
            distance: f32::INFINITY,
            irradiance: self.irradiance,
            density: f32::INFINITY,
        };
        Some(self.disc.map_or(single, |Disc { cone, irradiance, density, .. }| LightSample {
            direction: cone.direction(square),
            distance: f32::INFINITY,
            irradiance,
            density,
        }))
    }

    /// See [`Light::is_narrow`](super::Light::is_narrow).
    pub(super) fn is_narrow(&self) -> bool {
        self.disc.is_none_or(|disc| disc.density >= NARROW)
    }

    /// See [`Light::ahead`](super::Light::ahead).
    pub(super) fn ahead(&self, direction: Vec3) -> Option<LightAhead> {
        let Disc { cone, radiance, density, .. } = self.disc?;
        let ahead = LightAhead { distance: f32::INFINITY, density, radiance };
        cone.contains(direction).then_some(ahead)
    }

    /// π R² E.
    pub(super) fn power(&self, scene_radius: f32) -> Vec3 {
        self.irradiance * (PI * scene_radius * scene_radius)
    }
}
