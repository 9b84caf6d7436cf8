//! Random numbers, and random places and directions.

use glam::DVec2;
use selvedge_yarn_brdf::Cloth;

use crate::{args::Angles, chi_square};

/// Random numbers from a seed, the same on every platform.
#[derive(Clone, Debug)]
pub(super) struct Random(chi_square::Random);

impl Random {
    /// The `stream`-th sequence of a seed.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut mixed = chi_square::Random(seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        Self(chi_square::Random(mixed.next()))
    }

    /// A number in [0, 1).
    pub(super) fn number(&mut self) -> f64 {
        (self.0.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Three numbers in [0, 1).
    pub(super) fn xi(&mut self) -> [f32; 3] {
        [(); 3].map(|()| self.0.number())
    }

    /// A number in [`low`, `high`).
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.number() * (high - low)
    }

    /// A place on the face of `cloth`, within so many repeats from the origin, m.
    pub(super) fn place(&mut self, cloth: &Cloth, repeats: f64) -> DVec2 {
        repeats * cloth.size() * DVec2::new(self.number(), self.number())
    }

    /// A direction above the surface, even in solid angle.
    pub(super) fn direction(&mut self) -> Angles {
        let z = 1.0 - self.number();
        Angles { theta_deg: z.acos().to_degrees(), phi_deg: self.between(0.0, 360.0) }
    }
}
