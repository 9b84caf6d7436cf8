//! Directions around an axis, all equally likely.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::Square;

/// The directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    /// Unit length.
    axis: DVec3,
    /// Two more to which it is perpendicular, as they are to each other.
    across: [DVec3; 2],
    /// 1 − cos of the angle, which stays exact where the cosine rounds to 1.
    height: f64,
}

impl Cone {
    /// The cone around the unit vector `axis` whose border is at an angle with this sine, up to a
    /// right angle.
    pub(super) fn of_sine_squared(axis: DVec3, sine_squared: f64) -> Self {
        let height = sine_squared / (1.0 + (1.0 - sine_squared).max(0.0).sqrt());
        Self { axis, across: axis.any_orthonormal_pair().into(), height }
    }

    /// Of its directions, in sr: the area 2πh of a spherical cap of height h.
    pub(super) fn solid_angle(&self) -> f64 {
        TAU * self.height
    }

    /// The direction for `square`.
    ///
    /// By Archimedes, heights and azimuths of evenly spread directions are even: the disk, in which
    /// the square of the radius is even, is bent onto the cap.
    #[inline]
    pub(super) fn direction(&self, square: &Square) -> Vec3 {
        let disk = square.on_disk();
        let depth = self.height * disk.length_squared().min(1.0);
        let across = disk * (self.height * (2.0 - depth)).max(0.0).sqrt();
        let [x, y] = self.across;
        (x * across.x + y * across.y + self.axis * (1.0 - depth)).as_vec3()
    }

    /// Whether the unit vector `direction` is one of them.
    pub(super) fn contains(&self, direction: Vec3) -> bool {
        // Of unit vectors |a − b|² = 2 (1 − a · b), without its cancellation.
        (direction.as_dvec3() - self.axis).length_squared() <= 2.0 * self.height
    }
}
