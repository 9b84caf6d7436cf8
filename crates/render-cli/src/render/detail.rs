//! How much of a cloth is looked at: each of its threads, or what they reflect together.

use std::sync::atomic::{AtomicU64, Ordering};

use clap::ValueEnum;
use glam::DVec2;
use selvedge_yarn_brdf::Shader;
use serde::{Deserialize, Serialize};

/// Which level of detail cloth is shaded at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Each thread where it can be seen, else what all reflect together
    #[default]
    Auto,
    /// Each thread, however small
    Near,
    /// What all threads reflect together, however large
    Far,
}

/// The level of detail of the cloths of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Detail {
    /// Which level.
    pub level: Level,
    /// Octaves by which [`Level::Auto`] takes places to be larger than they are: above 0, it gives
    /// threads up sooner.
    pub bias: f32,
}

impl Detail {
    /// How likely a place of cloth is to be shaded as what all its threads reflect, if it has these
    /// standard deviations along u and v, m. Near and far have the same mean, and so has any mixture.
    pub fn far_weight(&self, shader: &Shader, deviation: DVec2) -> f32 {
        match self.level {
            Level::Auto => shader.far_weight(deviation * f64::from(self.bias).exp2()),
            Level::Near => 0.0,
            Level::Far => 1.0,
        }
    }
}

/// How places of cloth are shaded one beside the other. Pictures differ by rounding at most, time does a
/// lot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tier {
    /// Many at a time, with the instructions that the shader was told to use.
    #[default]
    Batch,
    /// One after the other: the bits of batches.
    Single,
    /// One after the other in f64, both lobes as one.
    Reference,
}

/// How often cloth was shaded at either level.
#[derive(Debug, Default)]
pub struct Shades {
    near: AtomicU64,
    far: AtomicU64,
}

impl Shades {
    /// Adds so many.
    pub fn add(&self, near: u64, far: u64) {
        self.near.fetch_add(near, Ordering::Relaxed);
        self.far.fetch_add(far, Ordering::Relaxed);
    }

    /// The share of the far level; `None` if no cloth was shaded.
    pub fn far_share(&self) -> Option<f64> {
        let [near, far] = [&self.near, &self.far].map(|count| count.load(Ordering::Relaxed) as f64);
        (near + far > 0.0).then(|| far / (near + far))
    }
}
