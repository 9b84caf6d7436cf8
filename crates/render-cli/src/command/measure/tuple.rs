//! One place and two directions: what a value of the BRDF belongs to, and how to see it again.

use std::fmt;

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Cloth};

use super::{random::Random, surface::Surface};
use crate::args::Angles;

/// A place, and the directions to the light and to the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tuple {
    /// u and v, m along the cloth.
    pub(crate) uv: DVec2,
    pub(crate) wi: Angles,
    pub(crate) wo: Angles,
}

impl fmt::Display for Tuple {
    /// As arguments of `selvedge eval`, to the last bit.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { uv, wi, wo } = self;
        write!(
            f,
            "--at {:?},{:?} --wi {:?},{:?} --wo {:?},{:?}",
            uv.x, uv.y, wi.theta_deg, wi.phi_deg, wo.theta_deg, wo.phi_deg
        )
    }
}

impl Tuple {
    /// Both directions on one side, mostly the face: anywhere, grazing, near the mirror image of each other
    /// or near each other.
    pub(super) fn random(random: &mut Random, cloth: &Cloth) -> Self {
        let uv = random.place(cloth, 16.0);
        let [mut wi, wo] = [random.direction(), random.direction()];
        let spread = 30.0 * random.number().powi(4);
        let mut near = |turn: f64| Angles {
            theta_deg: (wo.theta_deg + random.between(-spread, spread)).clamp(0.0, 89.9),
            phi_deg: (wo.phi_deg + turn + random.between(-spread, spread)).rem_euclid(360.0),
        };
        match (near(180.0), near(0.0)) {
            (mirrored, _) if spread < 1.0 => wi = mirrored,
            (_, close) if spread > 20.0 => wi = close,
            _ => {}
        }
        let mut tuple = Self { uv, wi, wo };
        let kind = random.number();
        if kind < 0.1 {
            tuple.wo.theta_deg = random.between(88.0, 90.0);
        }
        if kind < 0.05 {
            tuple.wi.theta_deg = random.between(88.0, 90.0);
        }
        if kind > 0.9 {
            for w in [&mut tuple.wi, &mut tuple.wo] {
                w.theta_deg = 180.0 - w.theta_deg;
            }
        }
        tuple
    }

    /// The same with light and viewer swapped.
    pub(super) fn swapped(self) -> Self {
        Self { wi: self.wo, wo: self.wi, ..self }
    }
}

/// Tuples as a batch has them.
pub(super) struct Tuples {
    uv: [Vec<f64>; 2],
    wi: [Vec<f32>; 3],
    wo: [Vec<f32>; 3],
}

impl Tuples {
    pub(super) fn new(tuples: &[Tuple]) -> Self {
        let parts = |of: fn(&Tuple) -> Vec3| {
            let all: Vec<Vec3> = tuples.iter().map(of).collect();
            [0, 1, 2].map(|axis| all.iter().map(|w| w[axis]).collect())
        };
        Self {
            uv: [0, 1].map(|axis| tuples.iter().map(|tuple| tuple.uv[axis]).collect()),
            wi: parts(|tuple| tuple.wi.single()),
            wo: parts(|tuple| tuple.wo.single()),
        }
    }

    fn batch(&self) -> Batch<'_> {
        Batch {
            uv: self.uv.each_ref().map(Vec::as_slice),
            wi: self.wi.each_ref().map(Vec::as_slice),
            wo: self.wo.each_ref().map(Vec::as_slice),
            active: None,
        }
    }

    /// f of each, as a batch evaluates it.
    pub(super) fn eval(&self, surface: &dyn Surface) -> Vec<Vec3> {
        let mut f = [(); 3].map(|()| vec![0.0; self.uv[0].len()]);
        surface.eval_batch(&self.batch(), f.each_mut().map(Vec::as_mut_slice));
        let [r, g, b] = f;
        r.into_iter().zip(g).zip(b).map(|((r, g), b)| Vec3::new(r, g, b)).collect()
    }
}
