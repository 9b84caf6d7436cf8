//! Directions around an axis, all equally likely.

use std::f64::consts::TAU;

use glam::{DVec3, Vec2, Vec3};
use selvedge_normalize::warp::square_to_disk;

/// The directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    /// Unit length.
    axis: DVec3,
    /// 1 − cos of the angle, which stays exact where the cosine rounds to 1.
    height: f64,
}

impl Cone {
    /// The cone around the unit vector `axis` whose border is at an angle with this sine, up to a
    /// right angle.
    pub(super) fn of_sine_squared(axis: DVec3, sine_squared: f64) -> Self {
        Self { axis, height: sine_squared / (1.0 + (1.0 - sine_squared).max(0.0).sqrt()) }
    }

    /// Of its directions, in sr: the area 2πh of a spherical cap of height h.
    pub(super) fn solid_angle(&self) -> f64 {
        TAU * self.height
    }

    /// The direction for `square` in [0, 1]².
    ///
    /// By Archimedes, heights and azimuths of evenly spread directions are even: the disk, in which
    /// the square of the radius is even, is bent onto the cap.
    pub(super) fn direction(&self, square: Vec2) -> Vec3 {
        let disk = square_to_disk(square.as_dvec2());
        let depth = self.height * disk.length_squared().min(1.0);
        let across = disk * (self.height * (2.0 - depth)).max(0.0).sqrt();
        let (x, y) = self.axis.any_orthonormal_pair();
        (x * across.x + y * across.y + self.axis * (1.0 - depth)).as_vec3()
    }

    /// Whether the unit vector `direction` is one of them.
    pub(super) fn contains(&self, direction: Vec3) -> bool {
        // Of unit vectors |a − b|² = 2 (1 − a · b), without its cancellation.
        (direction.as_dvec3() - self.axis).length_squared() <= 2.0 * self.height
    }
}
