//! What the tests share: random numbers, directions, and small cloths.

#![allow(dead_code, reason = "no test uses all of it")]

use core::f64::consts::TAU;

use selvedge_yarn_brdf::glam::{DVec2, DVec3};
use selvedge_yarn_brdf::{Cloth, Thread, Weave, Yarn};

/// Pitch of the cloths, m.
pub(crate) const PITCH: f64 = 1e-3;

/// Random numbers from a seed (Steele, Lea & Flood 2014, SplitMix).
#[derive(Clone, Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    pub(crate) fn number(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Three numbers in [0, 1).
    pub(crate) fn xi(&mut self) -> [f32; 3] {
        [(); 3].map(|()| (self.next() >> 40) as f32 / (1u32 << 24) as f32)
    }

    /// A number in [`low`, `high`).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.number() * (high - low)
    }

    /// A direction above the surface, even in solid angle.
    pub(crate) fn direction(&mut self) -> DVec3 {
        direction(self.number().max(1e-3), TAU * self.number())
    }

    /// A position in the square of `cells` cells from the origin on, m.
    pub(crate) fn position(&mut self, cells: f64) -> DVec2 {
        cells * PITCH * DVec2::new(self.number(), self.number())
    }
}

/// The direction with the cosine `z` and the azimuth `phi` (rad).
pub(crate) fn direction(z: f64, phi: f64) -> DVec3 {
    let sine = ((1.0 - z) * (1.0 + z)).sqrt();
    DVec3::new(sine * phi.cos(), sine * phi.sin(), z)
}

/// A cloth of `yarn` in which every end floats over `float` picks and every pick over one end: a
/// plain weave for 1.
pub(crate) fn cloth(yarn: &Yarn, float: u32) -> Cloth {
    let count = float + 1;
    let weave = Weave::new(count, count, |end, pick| (pick + end) % count != 0)
        .expect("a few threads are no more than allowed");
    let thread = Thread { color: yarn.color, pitch: Some(PITCH), ..Thread::default() };
    let threads = vec![thread; count as usize];
    let cloth = Cloth::from_threads(weave, &threads, &threads, yarn);
    let mut cloth = cloth.expect("as many threads as the weave has");
    // A thread that names no diameter touches its neighbours.
    for kind in &mut cloth.yarns {
        kind.size = yarn.size;
    }
    cloth
}
