//! The highlight of a yarn of untwisted fibres (filaments).

use crate::frame::Vector;
use crate::real::Real;
use crate::segment::{Optics, in_window, normal};

/// f of the highlight, sr⁻¹, before colour and scale, at (`x`, `y`) in [−1, 1]² of a segment whose
/// width over length is `ratio`; `wi` and `wo` are in the yarn frame. Finite and ≥ 0.
///
/// Without twist the condition `t·(wi + wo) = 0` does not depend on v: the highlight lies at
/// `tan u = H_y / H_z`, H = wi + wo, across the whole yarn (Irawan & Marschner 2012, equation 4).
///
/// ```text
/// f = (dv/dx)/(2δ sin u_max) · χ · [1 − (w/l) sin u_max (1 − cos v)] · f_c · pq / ((p+q) m)
/// ```
///
/// with p = n·wi, q = n·wo and m² = H_y² + H_z².
#[inline]
pub(crate) fn highlight<R: Real>(
    optics: &Optics<R>,
    x: R,
    y: R,
    ratio: R,
    wi: Vector<R>,
    wo: Vector<R>,
) -> R {
    let zero = R::zero();
    let (sin_v, cos_v, dv_dx) = optics.across(x);
    let h = wi.plus(wo);
    // Both directions are above the cloth, so H_z > 0 and the angle lies in (−π/2, π/2).
    let m = (h.y * h.y + h.z * h.z).max(R::from_f64(1e-30)).sqrt();
    let (sin_u, cos_u) = (h.y / m, h.z / m);

    let n = normal(sin_u, cos_u, sin_v, cos_v);
    let (p, q) = (n.dot(wi), n.dot(wo));
    let is_lit = sin_u.abs().lt(optics.sin_u_max)
        & zero.lt(p)
        & zero.lt(q)
        & in_window(y, optics.y_of_u(sin_u), optics.delta);

    let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
    let value = dv_dx * optics.half_inv_delta / optics.sin_u_max
        * optics.area(ratio, cos_v)
        * optics.phase.eval(t, wi, wo)
        * (p / (p + q))
        * q
        / m;
    R::select(is_lit, value, zero)
}
