//! The highlight of a yarn of untwisted fibres (filaments).

use crate::frame::Vector;
use crate::phase::{Azimuth, Parts};
use crate::real::Real;
use crate::segment::{Optics, Root, in_window, normal};

/// Where untwisted fibres at the angle v reflect `wi` into `wo`, and m.
///
/// Without twist the condition `t·(wi + wo) = 0` does not depend on v: the highlight lies at
/// `tan u = H_y / H_z`, H = wi + wo, across the whole yarn (Irawan & Marschner 2012, equation 4).
/// m² = H_y² + H_z².
#[inline(always)]
pub(crate) fn root<R: Real>(
    optics: &Optics<R::Scalar>,
    sin_v: R,
    cos_v: R,
    wi: Vector<R>,
    wo: Vector<R>,
) -> (Root<R>, R) {
    let (m, sin_u, cos_u) = inclination(wi, wo);
    let n = normal(sin_u, cos_u, sin_v, cos_v);
    let (p, q) = (n.dot(wi), n.dot(wo));
    let is_lit = sin_u.abs().lt(sin_u.splat(optics.sin_u_max)) & p.is_positive() & q.is_positive();
    (Root { sin_u, cos_u, sin_v, cos_v, p, q, is_lit }, m)
}

/// m, sin u and cos u of the [`root`].
#[inline(always)]
fn inclination<R: Real>(wi: Vector<R>, wo: Vector<R>) -> (R, R, R) {
    let h = wi.plus(wo);
    // Both directions are above the cloth, so H_z > 0 and the angle lies in (−π/2, π/2).
    let m = (h.y * h.y + h.z * h.z).max(h.z.of(1e-30)).sqrt();
    let inv_m = m.one() / m;
    (m, h.y * inv_m, h.z * inv_m)
}

/// f of the highlight, sr⁻¹, before colour and scale, at (`x`, `y`) in [−1, 1]² of a segment whose
/// width over length is `ratio`; `wi` and `wo` are in the yarn frame. Finite and ≥ 0.
///
/// ```text
/// f = (dv/dx) strength · χ · [S − (w/l) sin u_max (S − cos v)] · f_c · pq / ((p+q) m)
/// ```
///
/// with u at the [`root`], p = n·wi and q = n·wo, fading out towards the ends of the segment. `strength` is
/// 1/(2δ sin u_e), u_e the inclination at which that begins.
#[inline(always)]
pub(crate) fn highlight<R: Real>(
    optics: &Optics<R::Scalar>,
    [delta, strength]: [R::Scalar; 2],
    [x, y, ratio]: [R; 3],
    wi: Vector<R>,
    wo: Vector<R>,
) -> Parts<R> {
    let (m, sin_u, cos_u) = inclination(wi, wo);
    let is_near = in_window(y, optics.y_of_u(sin_u), delta);
    // Before anything that depends on x, since most of the yarn is dark.
    if !R::any(is_near) {
        return Parts::none(x);
    }
    let (sin_v, cos_v, dv_dx) = optics.across(x);
    // Along n(u, 0); across lies x, the other axis of the plane about the fibre.
    let (rise_i, rise_o) = (wi.y * sin_u + wi.z * cos_u, wo.y * sin_u + wo.z * cos_u);
    let (p, q) = (wi.x * sin_v + rise_i * cos_v, wo.x * sin_v + rise_o * cos_v);
    let is_lit =
        is_near & sin_u.abs().lt(sin_u.splat(optics.sin_u_max)) & p.is_positive() & q.is_positive();
    let scale = dv_dx
        * strength
        * optics.area(ratio, optics.bend(sin_u), cos_v)
        * optics.fade(sin_u)
        // Not by one division: the product of both may be too small for a number.
        * (p * (q / (p + q)) / m);
    let azimuth = Azimuth::in_plane([wi.x, rise_i], [wo.x, rise_o]);
    optics.phase.eval(&azimuth).scaled(scale, is_lit)
}
