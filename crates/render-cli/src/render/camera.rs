//! From a place on the film to a beam.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::{
    film::{BEAM_SIGMA, PIXEL_SIGMA, Size},
    footprint::{Beam, Bundle},
    intersect::Ray,
};
use crate::scene::drape::CameraPlacement;

/// A perspective camera with a film of a given size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    origin: Vec3,
    /// From the origin to the top left corner of the film, in a plane at distance 1.
    corner: Vec3,
    /// From one pixel to the next, to the right and down.
    step_x: Vec3,
    step_y: Vec3,
    lens: Option<Lens>,
}

/// A thin lens in place of a pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// m.
    pub radius: f32,
    /// Distance along the axis at which it is in focus, m.
    pub focus: f32,
}

/// Width to height of the pictures that placements are composed for.
pub const COMPOSED_ASPECT: f32 = 1.5;

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
            lens: None,
        }
    }

    /// The camera with `lens`, or with a pinhole.
    pub fn with_lens(self, lens: Option<Lens>) -> Self {
        Self { lens, ..self }
    }

    /// The beam through `place` on the film, in pixels: (0, 0) is the top left corner of the picture, x
    /// runs to the right and y down; and through the point of the lens that `square` in [0, 1)² names,
    /// all alike. It is [`BEAM_SIGMA`] pixels wide, and one of those that the pixel with its middle at `middle`
    /// has, [`PIXEL_SIGMA`] pixels wide.
    pub fn beam(&self, place: Vec2, middle: Vec2, square: Vec2) -> Beam {
        let towards = |place: Vec2| self.corner + self.step_x * place.x + self.step_y * place.y;
        let (direction, middle) = (towards(place), towards(middle));
        let (unit, length) = direction.normalize_and_length();
        let pixel = self.step_x.length() / length;
        let beam = |origin, direction, middle| Beam {
            ray: Ray { origin, direction },
            spread: BEAM_SIGMA * pixel,
            bundle: Some(Bundle { middle, spread: PIXEL_SIGMA * pixel }),
        };
        let Some(Lens { radius, focus }) = self.lens else {
            return beam(self.origin, unit, middle.normalize());
        };
        let point = Vec2::from_angle(TAU * square.y) * (radius * square.x.sqrt());
        let (right, down) = (self.step_x.normalize(), self.step_y.normalize());
        let offset = right * point.x + down * point.y;
        // Where all rays through the place meet: the direction is 1 along the axis.
        let [direction, middle] =
            [direction, middle].map(|d| (d * focus - offset).normalize_or(unit));
        beam(self.origin + offset, direction, middle)
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
        let d = Camera::new(&PLACEMENT, size).beam(place, place, Vec2::ZERO).ray.direction;
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

    #[test]
    fn rays_through_a_lens_meet_where_it_is_in_focus() {
        let size = Size::new(60, 40).unwrap();
        let lens = Lens { radius: 0.1, focus: 1.5 };
        let pinhole = Camera::new(&PLACEMENT, size);
        let place = Vec2::new(50.0, 10.0);
        let expected = pinhole.beam(place, place, Vec2::ZERO).ray;
        // The plane in focus lies across the axis.
        let expected = expected.at(1.5 / expected.direction.y);
        for square in [Vec2::ZERO, Vec2::new(0.3, 0.1), Vec2::new(0.9, 0.7)] {
            let ray = pinhole.with_lens(Some(lens)).beam(place, place, square).ray;
            assert!(ray.origin.distance(PLACEMENT.position) <= 0.1, "{square}");
            let found = ray.at(1.5 / ray.direction.y);
            assert!(found.abs_diff_eq(expected, 1e-5), "{square}: {found}, expected {expected}");
        }
    }
}
