//! The highlight of a yarn of twisted (staple) fibres.

use crate::frame::Vector;
use crate::phase::{Azimuth, Parts};
use crate::real::Real;
use crate::segment::{Optics, Root, in_window, normal};

/// Where twisted fibres at inclination u reflect `wi` into `wo`.
///
/// Fibres reflect where `t(u, v)·(wi + wo) = 0`. At the point's u that is solved for v (Irawan &
/// Marschner 2012, equation 3): with H = wi + wo, C = H·∂P/∂u, B = H·n(u, 0) and r² = H_x² + B²,
///
/// ```text
/// H_x cos v − B sin v = C / tan ψ        exists iff |C cos ψ| < r |sin ψ|
/// ```
///
/// Of its two roots the one with n·H > 0 reflects; its sine and cosine follow from the sum formulas
/// without an inverse function, so that a root beyond ±π needs no wrapping.
#[inline(always)]
pub(crate) fn root<R: Real>(
    optics: &Optics<R::Scalar>,
    sin_u: R,
    cos_u: R,
    wi: Vector<R>,
    wo: Vector<R>,
) -> Root<R> {
    let h = wi.plus(wo);
    let c = h.y * cos_u - h.z * sin_u;
    let b = h.y * sin_u + h.z * cos_u;
    let r_sq = h.x * h.x + b * b;
    let abs_sin_psi = optics.sin_psi.abs();

    // r cos(v + φ₀) and r sin(v + φ₀) times |sin ψ|, where φ₀ = atan2(B, H_x).
    let positive = optics.sin_psi.is_positive();
    let r_cos = c * R::Scalar::select(positive, optics.cos_psi, -optics.cos_psi);
    let r_sin_sq = r_sq * (abs_sin_psi * abs_sin_psi) - r_cos * r_cos;
    let r_sin = r_sin_sq.max(c.zero()).sqrt();
    let scale = c.one() / (r_sq.max(c.of(1e-30)) * abs_sin_psi);
    let sin_v = (r_sin * h.x - r_cos * b) * scale;
    let cos_v = (r_cos * h.x + r_sin * b) * scale;

    let n = normal(sin_u, cos_u, sin_v, cos_v);
    let (p, q) = (n.dot(wi), n.dot(wo));
    let is_lit = r_sin_sq.is_positive() & cos_v.is_positive() & p.is_positive() & q.is_positive();
    Root { sin_u, cos_u, sin_v, cos_v, p, q, is_lit }
}

/// f of the highlight, sr⁻¹, before colour and scale, at (`x`, `y`) in [−1, 1]² of a segment whose
/// width over length is `ratio`; `wi` and `wo` are in the yarn frame. Finite and ≥ 0.
///
/// ```text
/// f = (du/dy)/(2δ sin u_max) · χ · [S − (w/l) sin u_max (S − cos v)] · f_c · pq / ((p+q)² |sin ψ|)
/// ```
///
/// with v at the [`root`], p = n·wi and q = n·wo: geometry factor, attenuation and division by the
/// segment's area in one product, in which every singularity has cancelled. `strength` is 1/(2δ |sin ψ|).
#[inline(always)]
pub(crate) fn highlight<R: Real>(
    optics: &Optics<R::Scalar>,
    [delta, strength]: [R::Scalar; 2],
    [x, y, ratio]: [R; 3],
    wi: Vector<R>,
    wo: Vector<R>,
) -> Parts<R> {
    let (sin_u, cos_u, du_dy) = optics.along(y);
    let root = root(optics, sin_u, cos_u, wi, wo);
    let is_lit = root.is_lit & in_window(x, optics.x_of_v(root.sin_v), delta);
    if !R::any(is_lit) {
        return Parts::none(x);
    }
    let inv_sum = x.one() / (root.p + root.q).max(x.of(1e-30));
    let scale = du_dy
        * strength
        * optics.area(ratio, optics.bend(sin_u), root.cos_v)
        * ((root.p * inv_sum) * (root.q * inv_sum));
    let t = root.tangent(optics);
    optics.phase.eval(&Azimuth::on_cone(t, wi, wo)).scaled(scale, is_lit)
}
