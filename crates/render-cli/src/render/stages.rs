//! Where the time of a picture goes.

use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};

/// What is done in turn for all paths of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Numbers that choose a path, and a beam of the camera.
    Camera,
    /// The nearest surface along a ray of the camera.
    FirstHit,
    /// That along the ray of a bounce or, where the path ends, whether there is one.
    NextHit,
    /// The surface there, its material and the beam's footprint on it.
    Surface,
    /// A direction to each of the lights that a point looks at.
    Light,
    /// What the surface scatters of the light of each.
    Scattering,
    /// Whether something shades the one that is chosen.
    Shadow,
    /// The way on.
    Bounce,
}

impl Stage {
    /// All of them, in their order.
    pub const ALL: [Self; 8] = [
        Self::Camera,
        Self::FirstHit,
        Self::NextHit,
        Self::Surface,
        Self::Light,
        Self::Scattering,
        Self::Shadow,
        Self::Bounce,
    ];

    /// Its name in a table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::FirstHit => "first hits",
            Self::NextHit => "next hits",
            Self::Surface => "surfaces",
            Self::Light => "lights",
            Self::Scattering => "scattering",
            Self::Shadow => "shadow rays",
            Self::Bounce => "bounces",
        }
    }
}

/// The time of all threads by stage.
#[derive(Debug, Default)]
pub struct Stages([AtomicU64; Stage::ALL.len()]);

impl Stages {
    /// A clock that starts now.
    pub fn clock(&self) -> Clock<'_> {
        Clock { stages: self, last: Instant::now() }
    }

    /// Nanoseconds spent with `stage`, by the clock on the wall.
    pub fn nanoseconds(&self, stage: Stage) -> u64 {
        self.0[stage as usize].load(Ordering::Relaxed)
    }
}

/// Measures one stage after the other.
#[derive(Debug)]
pub struct Clock<'a> {
    stages: &'a Stages,
    last: Instant,
}

impl Clock<'_> {
    /// All time since the last stage, or the start, was spent with `stage`.
    pub fn lap(&mut self, stage: Stage) {
        let now = Instant::now();
        let nanoseconds = (now - self.last).as_nanos() as u64;
        self.stages.0[stage as usize].fetch_add(nanoseconds, Ordering::Relaxed);
        self.last = now;
    }
}
