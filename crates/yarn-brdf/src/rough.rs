//! The highlight of a yarn of rough fibres.

use crate::frame::Vector;
use crate::phase::{Azimuth, Parts};
use crate::real::Real;
use crate::segment::{Optics, cosine, normal};

/// f of the highlight, sr⁻¹, before colour and scale, at (`x`, `y`) in [−1, 1]² of a segment whose
/// width over length is `ratio`; `wi` and `wo` are in the yarn frame. Finite and ≥ 0.
///
/// ```text
/// f = (du/dy)(dv/dx)/sin u_max · [S − (w/l) sin u_max (S − cos v)] · M(t·wi, t·wo) f_c · pq/(p+q)
/// ```
///
/// with n and t at the point itself, p = n·wi and q = n·wo. There is no root to solve and nothing
/// to switch: the value is continuous in the point, the directions and every parameter, for any
/// twist. As σ → 0, M tends to the delta whose Jacobian is the geometry factor of the drawn
/// highlight, and the mean over the segment to the same far field.
#[inline(always)]
pub(crate) fn highlight<R: Real>(
    optics: &Optics<R::Scalar>,
    spread: [R::Scalar; 2],
    [x, y, ratio]: [R; 3],
    wi: Vector<R>,
    wo: Vector<R>,
) -> Parts<R> {
    let (sin_u, cos_u, du_dy) = optics.along(y);
    let (sin_v, cos_v, dv_dx) = optics.across(x);
    let n = normal(sin_u, cos_u, sin_v, cos_v);
    let (p, q) = (n.dot(wi), n.dot(wo));
    let is_lit = p.is_positive() & q.is_positive();
    if !R::any(is_lit) {
        return Parts::none(x);
    }
    let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
    let scale = du_dy
        * dv_dx
        * optics.area(ratio, optics.bend(sin_u), cos_v)
        * longitudinal(spread, t, wi, wo)
        * (p * (q / (p + q)));
    optics.phase.eval(&Azimuth::about(t, wi, wo)).scaled(scale, is_lit)
}

/// The spread M along the fibre t, a density over s = t·wi for fixed t·wo, that is symmetric in
/// both (d'Eon et al. 2011, equation 7):
///
/// ```text
/// M = exp(−s_i s_o / v) I₀(c_i c_o / v) / (2 v sinh(1/v)),   v = σ²,  c = √(1 − s²)
///   = I₀e(c_i c_o / v) exp(−((s_i + s_o)² + (c_i − c_o)²) / 2v) / (v (1 − e^{−2/v}))
/// ```
///
/// The second form overflows for no σ. `spread` is (1/v, 1/(v (1 − e^{−2/v}))).
#[inline(always)]
pub(crate) fn longitudinal<R: Real>(
    [inv_variance, scale]: [R::Scalar; 2],
    t: Vector<R>,
    wi: Vector<R>,
    wo: Vector<R>,
) -> R {
    let (si, so) = (t.dot(wi), t.dot(wo));
    let one = si.one();
    let (ci, co) = (cosine(si), cosine(so));
    let sum = t.dot(wi.plus(wo));
    // c_i − c_o = (s_o² − s_i²)/(c_i + c_o), which does not cancel.
    let difference = (so - si) * sum / (ci + co).max(sum.of(1e-18));
    // Where both lie along the fibre the quotient is not to be trusted, but is at most this.
    let difference = difference.clamp_to(-one, one);
    let exponent = (sum * sum + difference * difference) * sum.of(0.5) * inv_variance;
    (ci * co * inv_variance).i0e() * (-exponent).exp() * scale
}
