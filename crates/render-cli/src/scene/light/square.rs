//! Numbers that choose among the directions to a light.

use std::cell::OnceCell;

use glam::{DVec2, Vec2};
use selvedge_normalize::warp::square_to_disk;

/// A point of the unit square, and the one of the unit disk that it stands for: lights that look round share it.
#[derive(Clone, Debug)]
pub struct Square {
    point: Vec2,
    disk: OnceCell<DVec2>,
}

impl Square {
    /// In [0, 1]².
    pub(super) fn point(&self) -> Vec2 {
        self.point
    }

    /// Where that is on the disk.
    #[inline]
    pub(super) fn on_disk(&self) -> DVec2 {
        *self.disk.get_or_init(|| square_to_disk(self.point.as_dvec2()))
    }
}

impl From<Vec2> for Square {
    fn from(point: Vec2) -> Self {
        Self { point, disk: OnceCell::new() }
    }
}
