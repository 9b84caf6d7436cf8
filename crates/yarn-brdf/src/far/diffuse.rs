//! The diffuse reflection by the yarn's normal, averaged over a segment.

use crate::frame::Vector;
use crate::lanes::LANES;
use crate::real::Real;
use crate::rules::gauss_legendre;
use crate::segment::{Mapping, Optics};

use super::highlight::facing;
use super::rule::Row;

/// Nodes along a segment.
#[derive(Clone, Debug)]
pub(super) struct Along {
    node: Row,
    weight: Row,
}

impl Default for Along {
    fn default() -> Self {
        let nodes = gauss_legendre(LANES);
        Self {
            node: core::array::from_fn(|lane| nodes[lane].0 as f32),
            weight: core::array::from_fn(|lane| (0.5 * nodes[lane].1) as f32),
        }
    }
}

/// The mean of (n·wi)⁺ (n·wo)⁺ over the points (x, y) of a segment, as a sum over lanes; directions are
/// in the yarn frame.
///
/// Around the section both are of the form a sin v + b cos v, so that the integral is closed between
/// the angles at which the yarn turns away; along the segment it is a Gauss–Legendre rule.
#[inline(always)]
pub(super) fn mean<R: Real<Scalar = f32>>(
    optics: &Optics<f32>,
    along: &Along,
    load: impl Fn(&Row) -> R,
    wi: Vector<f32>,
    wo: Vector<f32>,
) -> R {
    let (sin_u, cos_u, _) = optics.along(load(&along.node));
    let (x_i, x_o) = (sin_u.splat(wi.x), sin_u.splat(wo.x));
    let (rise_i, rise_o) = (sin_u * wi.y + cos_u * wi.z, sin_u * wo.y + cos_u * wo.z);
    let [from, to] = facing(x_i, rise_i, x_o, rise_o);
    let to = to.max(from);
    // (n·wi)(n·wo) = s sin² v + c cos² v + m sin v cos v.
    let (s, c) = (x_i * x_o, rise_i * rise_o);
    let m = x_i * rise_o + x_o * rise_i;
    let up_to = [up_to(optics.mapping, [s, c, m], from), up_to(optics.mapping, [s, c, m], to)];
    (up_to[1] - up_to[0]).max(s.zero()) * load(&along.weight)
}

/// Half the mean over the section of s sin² v + c cos² v + m sin v cos v, up to the angle `v`.
///
/// Not a closure, which would be compiled on its own, without the instructions of its caller.
#[inline(always)]
fn up_to<R: Real<Scalar = f32>>(mapping: Mapping, [s, c, m]: [R; 3], v: R) -> R {
    let (sin, cos) = v.sin_cos();
    match mapping {
        // dx = 2 dv/π.
        Mapping::Linear => {
            let turned = sin * cos * (c - s) + sin * sin * m;
            ((s + c) * v + turned) * (0.5 * core::f32::consts::FRAC_1_PI)
        }
        // dx = cos v dv.
        Mapping::Arcsine => {
            let cubed = sin * sin * sin;
            (s * cubed + c * (sin * 3.0 - cubed) - m * (cos * cos * cos)) * (1.0 / 6.0)
        }
    }
}
