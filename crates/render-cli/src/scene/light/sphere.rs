//! A ball that shines outwards.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{LightAhead, LightSample, Square, cone::Cone};

/// A ball that shines evenly from its outside. Nothing of it arrives inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its middle, world space, metres.
    pub centre: Vec3,
    /// In metres, at least 0.
    pub radius: f32,
    /// Radiance that leaves it.
    pub radiance: Vec3,
}

/// A ball as it looks from a point outside.
struct View {
    /// From the point to the centre.
    offset: DVec3,
    radius_squared: f64,
    cone: Cone,
}

impl Sphere {
    /// See [`Light::sample`](super::Light::sample): all directions to the ball are equally likely
    /// (Shirley, Wang & Zimmerman 1996).
    pub(super) fn sample(&self, position: Vec3, square: &Square) -> Option<LightSample> {
        let view = self.view(position)?;
        let direction = view.cone.direction(square);
        let solid_angle = view.cone.solid_angle();
        Some(LightSample {
            direction,
            distance: view.distance(direction),
            irradiance: self.radiance * solid_angle as f32,
            density: solid_angle.recip() as f32,
        })
    }

    /// See [`Light::ahead`](super::Light::ahead).
    pub(super) fn ahead(&self, origin: Vec3, direction: Vec3) -> Option<LightAhead> {
        let view = self.view(origin)?;
        view.cone.contains(direction).then(|| LightAhead {
            distance: view.distance(direction),
            density: view.cone.solid_angle().recip() as f32,
            radiance: self.radiance,
        })
    }

    /// 4πr² · πL.
    pub(super) fn power(&self) -> Vec3 {
        self.radiance * (2.0 * PI * self.radius).powi(2)
    }

    /// `None` from inside and for a ball too small to be seen.
    fn view(&self, position: Vec3) -> Option<View> {
        let offset = self.centre.as_dvec3() - position.as_dvec3();
        let (axis, distance) = offset.normalize_and_length();
        let radius = f64::from(self.radius);
        let cone = Cone::of_sine_squared(axis, (radius / distance).powi(2));
        let is_seen = distance > radius && cone.solid_angle() > 0.0;
        is_seen.then_some(View { offset, radius_squared: radius * radius, cone })
    }
}

impl View {
    /// To the near side in a direction within the cone.
    fn distance(&self, direction: Vec3) -> f32 {
        let along = self.offset.dot(direction.as_dvec3());
        let across_squared = self.offset.cross(direction.as_dvec3()).length_squared();
        let half_chord = (self.radius_squared - across_squared).max(0.0).sqrt();
        (along - half_chord) as f32
    }
}
