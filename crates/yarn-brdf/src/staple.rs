//! The highlight of a yarn of twisted (staple) fibres.

use crate::frame::Vector;
use crate::real::Real;
use crate::segment::{Optics, in_window, normal};

/// f of the highlight, sr⁻¹, before colour and scale, at (`x`, `y`) in [−1, 1]² of a segment whose
/// width over length is `ratio`; `wi` and `wo` are in the yarn frame. Finite and ≥ 0.
///
/// Fibres reflect `wi` into `wo` where `t(u, v)·(wi + wo) = 0`. At the point's u that is solved for
/// v (Irawan & Marschner 2012, equation 3): with H = wi + wo, C = H·∂P/∂u, B = H·n(u, 0) and
/// r² = H_x² + B²,
///
/// ```text
/// H_x cos v − B sin v = C / tan ψ        exists iff |C cos ψ| < r |sin ψ|
/// ```
///
/// Of its two roots the one with n·H > 0 reflects; its sine and cosine follow from the sum formulas
/// without an inverse function, so that a root beyond ±π needs no wrapping. The value is
///
/// ```text
/// f = (du/dy)/(2δ sin u_max) · χ · [1 − (w/l) sin u_max (1 − cos v)] · f_c · pq / ((p+q)² |sin ψ|)
/// ```
///
/// with p = n·wi and q = n·wo: geometry factor, attenuation and division by the segment's area in
/// one product, in which every singularity has cancelled.
#[inline]
pub(crate) fn highlight<R: Real>(
    optics: &Optics<R>,
    x: R,
    y: R,
    ratio: R,
    wi: Vector<R>,
    wo: Vector<R>,
) -> R {
    let (zero, one) = (R::zero(), R::one());
    let (sin_u, cos_u, du_dy) = optics.along(y);
    let h = wi.plus(wo);
    let c = h.y * cos_u - h.z * sin_u;
    let b = h.y * sin_u + h.z * cos_u;
    let r_sq = h.x * h.x + b * b;
    let sin_psi_abs = optics.sin_psi.abs();
    let reach = r_sq.sqrt() * sin_psi_abs;
    let need = (c * optics.cos_psi).abs();
    let exists = need.lt(reach);

    // r cos(v + φ₀) and r sin(v + φ₀), where φ₀ = atan2(B, H_x).
    let r_cos = c * optics.cos_psi / optics.sin_psi;
    let r_sin = ((reach - need) * (reach + need)).max(zero).sqrt() / sin_psi_abs;
    let inv_r_sq = one / r_sq.max(R::from_f64(1e-30));
    let sin_v = (r_sin * h.x - r_cos * b) * inv_r_sq;
    let cos_v = (r_cos * h.x + r_sin * b) * inv_r_sq;

    let n = normal(sin_u, cos_u, sin_v, cos_v);
    let (p, q) = (n.dot(wi), n.dot(wo));
    let sum = p + q;
    let is_lit = exists
        & zero.lt(cos_v)
        & zero.lt(p)
        & zero.lt(q)
        & in_window(x, optics.x_of_v(sin_v), optics.delta);

    let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
    let value = du_dy
        * optics.half_inv_delta
        * optics.area(ratio, cos_v)
        * optics.phase.eval(t, wi, wo)
        * (p / sum)
        * (q / sum)
        / sin_psi_abs;
    R::select(is_lit, value, zero)
}
