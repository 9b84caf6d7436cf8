//! Light from all around that no picture tells.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use selvedge_normalize::warp::{square_to_uniform_sphere, uniform_sphere_density};

use super::{LightAhead, LightSample};

/// A dome at infinity, brightest above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Radiance straight from above.
    pub zenith: Vec3,
    /// Radiance from the horizon and from below it.
    pub horizon: Vec3,
}

impl Sky {
    /// Radiance from the unit vector `direction`, linear in its z above the horizon.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.horizon.lerp(self.zenith, direction.z.max(0.0))
    }

    /// See [`Light::ahead`](super::Light::ahead): it is never sampled.
    pub(super) fn ahead(&self, direction: Vec3) -> LightAhead {
        let radiance = self.radiance(direction);
        LightAhead { distance: f32::INFINITY, density: 0.0, radiance }
    }
}

/// The same light from all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Radiance from each direction.
    pub radiance: Vec3,
}

impl Constant {
    /// See [`Light::sample`](super::Light::sample): all directions are equally likely.
    pub(super) fn sample(&self, square: Vec2) -> LightSample {
        let direction = square_to_uniform_sphere(square.as_dvec2());
        let density = uniform_sphere_density(direction) as f32;
        LightSample {
            direction: direction.as_vec3(),
            distance: f32::INFINITY,
            irradiance: self.radiance / density,
            density,
        }
    }

    /// See [`Light::ahead`](super::Light::ahead).
    pub(super) fn ahead(&self) -> LightAhead {
        let density = 1.0 / (4.0 * PI);
        LightAhead { distance: f32::INFINITY, density, radiance: self.radiance }
    }

    /// 4π · πR² · L.
    pub(super) fn power(&self, scene_radius: f32) -> Vec3 {
        self.radiance * (2.0 * PI * scene_radius).powi(2)
    }
}
