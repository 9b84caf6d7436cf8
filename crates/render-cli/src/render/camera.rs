//! From a place on the film to a beam.

use glam::{Vec2, Vec3};

use super::{
    film::{BEAM_SIGMA, Size},
    footprint::Beam,
    intersect::Ray,
};
use crate::scene::drape::CameraPlacement;

/// A pinhole camera with a film of a given size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    origin: Vec3,
    /// From the origin to the top left corner of the film, in a plane at distance 1.
    corner: Vec3,
    /// From one pixel to the next, to the right and down.
    step_x: Vec3,
    step_y: Vec3,
}

/// Width to height of the pictures that placements are composed for.
const COMPOSED_ASPECT: f32 = 1.5;

impl Camera {
    /// The camera at `placement`. A picture of other proportions than 3 to 2 shows more of the
    /// scene at two of its sides, never less: a wider one to the left and right, a taller one above
    /// and below.
    pub fn new(placement: &CameraPlacement, size: Size) -> Self {
        let forward = (placement.target - placement.position).normalize();
        let right = forward.cross(placement.up).normalize();
        let down = forward.cross(right);
        let [width, height] = [size.width() as f32, size.height() as f32];
        let tan = (placement.horizontal_fov / 2.0).tan();
        let half_width = tan * (width / height / COMPOSED_ASPECT).max(1.0);
        let pixel = 2.0 * half_width / width;
        Self {
            origin: placement.position,
            corner: forward - (right * width + down * height) * (pixel / 2.0),
            step_x: right * pixel,
            step_y: down * pixel,
        }
    }

    /// The beam through `place` on the film: in pixels, (0, 0) the top left corner of the picture, x
    /// to the right and y down. It is [`BEAM_SIGMA`] pixels wide.
    pub fn beam(&self, place: Vec2) -> Beam {
        let direction = self.corner + self.step_x * place.x + self.step_y * place.y;
        let (direction, length) = direction.normalize_and_length();
        let spread = BEAM_SIGMA * self.step_x.length() / length;
        Beam { ray: Ray { origin: self.origin, direction }, spread }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACEMENT: CameraPlacement = CameraPlacement {
        position: Vec3::new(0.0, -1.0, 0.0),
        target: Vec3::ZERO,
        up: Vec3::Z,
        horizontal_fov: std::f32::consts::FRAC_PI_2,
    };

    fn slopes(size: [u32; 2], place: Vec2) -> Vec2 {
        let size = Size::new(size[0], size[1]).unwrap();
        let d = Camera::new(&PLACEMENT, size).beam(place).ray.direction;
        Vec2::new(d.x, d.z) / d.y
    }

    #[test]
    fn corners_of_the_film_are_corners_of_the_view() {
        for (place, expected) in [
            (Vec2::new(0.0, 0.0), Vec2::new(-1.0, 2.0 / 3.0)),
            (Vec2::new(60.0, 0.0), Vec2::new(1.0, 2.0 / 3.0)),
            (Vec2::new(0.0, 40.0), Vec2::new(-1.0, -2.0 / 3.0)),
            (Vec2::new(30.0, 20.0), Vec2::ZERO),
        ] {
            let found = slopes([60, 40], place);
            assert!(found.abs_diff_eq(expected, 1e-6), "{place}: {found}, expected {expected}");
        }
    }

    #[test]
    fn other_proportions_show_more_and_pixels_stay_square() {
        let tall = slopes([40, 40], Vec2::ZERO);
        assert!(tall.abs_diff_eq(Vec2::new(-1.0, 1.0), 1e-6), "{tall}");
        let wide = slopes([120, 40], Vec2::ZERO);
        assert!(wide.abs_diff_eq(Vec2::new(-2.0, 2.0 / 3.0), 1e-6), "{wide}");
    }
}
