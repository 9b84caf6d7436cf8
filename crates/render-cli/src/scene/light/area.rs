//! A rectangle drawn evenly by area.

use glam::{Vec2, Vec3};

use super::{LightAhead, LightSample};
use crate::scene::drape::RectangleLight;

/// A rectangle that shines evenly from one side. It casts no shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    /// The rectangle.
    pub shape: RectangleLight,
    /// Radiance that leaves it.
    pub radiance: Vec3,
}

impl AreaLight {
    /// The light that reaches `position` from the point of the rectangle at `square` in [0, 1]²;
    /// the mean over the square is the irradiance. `None` from behind.
    ///
    /// ```text
    /// E = L · A · cos θ / d²
    /// ```
    ///
    /// with θ the angle at the light: uniform by area (Pharr, Jakob & Humphreys 2023, section
    /// 12.4).
    pub fn sample(&self, position: Vec3, square: Vec2) -> Option<LightSample> {
        let RectangleLight { centre, half_u, half_v } = self.shape;
        let place = 2.0 * square - Vec2::ONE;
        let offset = centre + half_u * place.x + half_v * place.y - position;
        let (direction, distance) = offset.normalize_and_length();
        // The length is a quarter of the area.
        let projected = -4.0 * half_u.cross(half_v).dot(direction);
        let density = distance * distance / projected;
        let irradiance = self.radiance / density;
        (projected > 0.0).then_some(LightSample { direction, distance, irradiance, density })
    }

    /// Where the ray from `origin` along the unit vector `direction` meets the shining side.
    pub fn ahead(&self, origin: Vec3, direction: Vec3) -> Option<LightAhead> {
        let RectangleLight { centre, half_u, half_v } = self.shape;
        let quarter = half_u.cross(half_v);
        let projected = -4.0 * quarter.dot(direction);
        let distance = (centre - origin).dot(quarter) / direction.dot(quarter);
        let offset = origin + direction * distance - centre;
        let is_within = |half: Vec3| offset.dot(half).abs() <= half.length_squared();
        let is_met = projected > 0.0 && distance > 0.0 && is_within(half_u) && is_within(half_v);
        let density = distance * distance / projected;
        is_met.then_some(LightAhead { distance, density, radiance: self.radiance })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn irradiance_of_a_square_overhead_is_its_form_factor() {
        // A square of side 2 at height 1 seen from below its middle, in Cartesian form: E/(πL) =
        // (2/π) · 4 · [x/√(1+x²) · atan(y/√(1+x²))]/2 at x = y = 1, both terms equal.
        let shape = RectangleLight { centre: Vec3::Z, half_u: Vec3::Y, half_v: Vec3::X };
        let light = AreaLight { shape, radiance: Vec3::ONE };
        let n = 200;
        let mut irradiance = 0.0;
        for k in 0..n * n {
            let square = (Vec2::new((k % n) as f32, (k / n) as f32) + 0.5) / n as f32;
            let sample = light.sample(Vec3::ZERO, square).unwrap();
            irradiance += sample.irradiance.x * sample.direction.z / (n * n) as f32;
        }
        let root = 2.0_f32.sqrt();
        let expected = 4.0 * (1.0 / root) * (1.0 / root).atan();
        assert!((irradiance - expected).abs() < 1e-3, "{irradiance}, expected {expected}");
        assert_eq!(light.sample(2.0 * Vec3::Z, Vec2::splat(0.5)), None);
    }

    #[test]
    fn ray_to_a_sampled_point_meets_the_light_there() {
        let shape = RectangleLight {
            centre: Vec3::new(0.3, 0.2, 1.5),
            half_u: Vec3::new(0.0, 0.5, 0.1),
            half_v: Vec3::new(0.4, 0.0, 0.0),
        };
        let light = AreaLight { shape, radiance: Vec3::ONE };
        let origin = Vec3::new(-0.2, 0.1, 0.0);
        for square in [Vec2::splat(0.5), Vec2::new(0.01, 0.99), Vec2::new(0.9, 0.2)] {
            let sample = light.sample(origin, square).unwrap();
            let ahead = light.ahead(origin, sample.direction).unwrap();
            assert!((ahead.distance - sample.distance).abs() < 1e-5, "{square}");
            assert!((ahead.density / sample.density - 1.0).abs() < 1e-4, "{square}");
            assert_eq!(light.ahead(origin, -sample.direction), None);
        }
        assert_eq!(light.ahead(origin, Vec3::X), None);
        let beyond = light.sample(origin, Vec2::new(1.01, 0.5)).unwrap();
        assert_eq!(light.ahead(origin, beyond.direction), None);
    }
}
