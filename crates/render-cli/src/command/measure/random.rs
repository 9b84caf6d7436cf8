//! Random numbers, and places and directions that can be named again.

use glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::Cloth;

/// Random numbers from a seed, the same on every platform (Steele, Lea & Flood 2014, SplitMix).
#[derive(Clone, Debug)]
pub(super) struct Random(u64);

impl Random {
    /// The `stream`-th sequence of a seed.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut mixed = Self(seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        Self(mixed.next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    pub(super) fn number(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
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

/// A direction as it is named on the command line, so that it can be named again to the last bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Angles {
    /// From the normal, above 90° on the back.
    pub(crate) theta_deg: f64,
    /// From the weft towards the warp.
    pub(crate) phi_deg: f64,
}

impl Angles {
    /// The unit vector, in the shading frame.
    pub(crate) fn direction(self) -> DVec3 {
        let (sin, cos) = self.theta_deg.to_radians().sin_cos();
        let (y, x) = self.phi_deg.to_radians().sin_cos();
        DVec3::new(sin * x, sin * y, cos)
    }

    /// The same in single precision.
    pub(crate) fn single(self) -> Vec3 {
        self.direction().as_vec3()
    }
}
