//! What lights a scene. Radiance is linear, with the primaries of sRGB.

use glam::{Vec2, Vec3};

use super::drape::RectangleLight;

/// A rectangle that shines evenly from one side. It is found by sampling it, never by a ray, and
/// casts no shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    /// The rectangle.
    pub shape: RectangleLight,
    /// Radiance that leaves it.
    pub radiance: Vec3,
}

/// The light that one point of an area light sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Towards the point: unit length, world space.
    pub direction: Vec3,
    /// To the point, in metres.
    pub distance: f32,
    /// Irradiance on a surface that faces the point, as if the whole light were there.
    pub irradiance: Vec3,
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
        let irradiance = self.radiance * projected / (distance * distance);
        (projected > 0.0).then_some(LightSample { direction, distance, irradiance })
    }
}

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
}
