//! The density with which [`Shader::sample`] draws a direction.
//!
//! In the precision of the BRDF and by the same functions, so that both tell the same edges of the
//! drawn highlight.

use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use crate::azimuth::Facing;
use crate::cloth::Combination;
use crate::frame::Vector;
use crate::material::Piece;
use crate::phase::Azimuth;
use crate::real::Real;
use crate::rough::longitudinal;
use crate::segment::{Optics, Spread, cosine, in_window, normal};
use crate::shader::{Shader, left};
use crate::{filament, staple};

/// Least share of samples for a lobe that reflects anything.
pub(crate) const LEAST_SHARE: f64 = 0.1;

/// What the density for all directions of a place and a direction to the viewer rests on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawing<R> {
    /// The angles of the yarn, v or u, rad, from which the highlight may come; empty if there are
    /// none. [0, 1] for rough fibres, which reflect from the point itself.
    pub(crate) span: [R; 2],
    /// The share of samples drawn from the highlight.
    pub(crate) share: R,
}

impl Shader {
    /// How samples are drawn at `at` = (x, y, w/l) on `piece` for `wo` in the yarn frame; `bright` are
    /// the greatest components of the colours of the highlight and of the diffuse.
    #[inline(always)]
    pub(crate) fn drawing<R: Real>(
        &self,
        piece: &Piece<R::Scalar>,
        at: [R; 3],
        wo: Vector<R>,
        bright: [R; 2],
    ) -> Drawing<R> {
        let (zero, one) = (wo.x.zero(), wo.x.one());
        let span = span(&piece.optics, at, wo);
        if !piece.has_highlight {
            return Drawing { span, share: zero };
        }
        let [specular, diffuse] = self.lobe_albedos(piece, at, wo);
        let (specular, diffuse) = (bright[0] * specular, bright[1] * diffuse);
        let share = specular / (specular + diffuse).max(one.of(f32::MIN_POSITIVE.into()));
        let share = share.clamp_to(one.of(LEAST_SHARE), one.of(1.0 - LEAST_SHARE));
        Drawing { span, share: R::select(span[0].lt(span[1]), share, zero) }
    }

    /// How much highlight and diffuse of an opaque place reflect to `wo` of white light, for colours
    /// of 1.
    #[inline(always)]
    pub(crate) fn lobe_albedos<R: Real>(
        &self,
        piece: &Piece<R::Scalar>,
        [x, y, ratio]: [R; 3],
        wo: Vector<R>,
    ) -> [R; 2] {
        let (zero, one) = (x.zero(), x.one());
        let inv_divisor = one / piece.reflectance.divisor(ratio);
        let scale = inv_divisor * piece.amount;
        let table = piece.reflectance.at(wo).at(ratio);
        // Over all wi, what the highlight leaves of the light averages to what it leaves of it all, by
        // which the flat diffuse is divided.
        let (share, of_all) = if !piece.has_highlight {
            (one, one)
        } else if self.combination == Combination::Lerp {
            (one - piece.amount, one)
        } else {
            (left(scale * table), left(scale * piece.mean.splat(ratio).at(ratio)))
        };
        let diffuse = if let Some(diffuse_scale) = piece.diffuse_scale {
            let (sin_u, cos_u, _) = piece.optics.along(y);
            let (sin_v, cos_v, _) = piece.optics.across(x);
            let n = normal(sin_u, cos_u, sin_v, cos_v);
            // 1/π ∫ (n·wi) cos θi dwi, both at least 0, with n at the angle γ from the normal.
            let cos = n.z.clamp_to(-one, one);
            let rest = cos.asin() + cos.of(FRAC_PI_2);
            let lit = (cosine(cos) + rest * cos) * cos.of(2.0 / (3.0 * PI));
            share * of_all * diffuse_scale * lit * n.dot(wo).max(zero)
        } else {
            share
        };
        let specular = if piece.has_highlight { table * inv_divisor } else { zero };
        [specular, diffuse]
    }
}

/// The density of both lobes at `wi`, sr⁻¹; directions in the yarn frame, above the surface.
#[inline(always)]
pub(crate) fn density<R: Real>(
    piece: &Piece<R::Scalar>,
    at: [R; 3],
    drawing: &Drawing<R>,
    wi: Vector<R>,
    wo: Vector<R>,
) -> R {
    let &Drawing { span: [from, to], share } = drawing;
    let diffuse = (share.one() - share) * wi.z * share.of(FRAC_1_PI);
    if !R::any(share.is_positive()) {
        return diffuse;
    }
    let highlight = highlight_density(piece, at, to - from, wi, wo);
    let highlight = R::select(share.is_positive(), share * highlight, share.zero());
    // No more than an f32 holds.
    (highlight + diffuse).min(share.of(f32::MAX.into()))
}

#[inline(always)]
fn highlight_density<R: Real>(
    piece: &Piece<R::Scalar>,
    [x, y, _]: [R; 3],
    extent: R,
    wi: Vector<R>,
    wo: Vector<R>,
) -> R {
    let optics = &piece.optics;
    let zero = x.zero();
    match optics.spread {
        Spread::Staple { delta, .. } => {
            let (sin_u, cos_u, _) = optics.along(y);
            let root = staple::root(optics, sin_u, cos_u, wi, wo);
            let is_lit = root.is_lit & in_window(x, optics.x_of_v(root.sin_v), delta);
            let t = root.tangent(optics);
            let facing = Facing::new(root.q, t.dot(wi), t.dot(wo));
            let azimuth = piece.sampler.density(&Azimuth::on_cone(t, wi, wo), facing);
            // One after the other: the product of a grazing direction's may be too small for a number.
            let sum = (root.p + root.q).max(x.of(1e-30));
            let found = azimuth / (extent * optics.sin_psi.abs()) / sum;
            R::select(is_lit, found, zero)
        }
        Spread::Filament { delta, .. } => {
            let (sin_v, cos_v, _) = optics.across(x);
            let (root, m) = filament::root(optics, sin_v, cos_v, wi, wo);
            let is_lit = root.is_lit & in_window(y, optics.y_of_u(root.sin_u), delta);
            let t = root.tangent(optics);
            let facing = Facing::new(root.q, t.dot(wi), t.dot(wo));
            let azimuth = piece.sampler.density(&Azimuth::on_cone(t, wi, wo), facing);
            R::select(is_lit, azimuth / extent / m, zero)
        }
        Spread::Rough { inv_variance, scale } => {
            let (sin_u, cos_u, _) = optics.along(y);
            let (sin_v, cos_v, _) = optics.across(x);
            let n = normal(sin_u, cos_u, sin_v, cos_v);
            let q = n.dot(wo);
            let is_lit = n.dot(wi).is_positive() & q.is_positive();
            let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
            let spread = longitudinal([inv_variance, scale], t, wi, wo);
            let facing = Facing::new(q, t.dot(wi), t.dot(wo));
            let azimuth = piece.sampler.density(&Azimuth::about(t, wi, wo), facing);
            R::select(is_lit, azimuth * spread, zero)
        }
    }
}

/// The angles of the yarn from which the highlight may come.
#[inline(always)]
fn span<R: Real>(optics: &Optics<R::Scalar>, [x, y, _]: [R; 3], wo: Vector<R>) -> [R; 2] {
    match optics.spread {
        Spread::Staple { delta, .. } => {
            let [low, high] = window(x, delta);
            let (sin_u, cos_u, _) = optics.along(y);
            // The half of the section that faces `wo`.
            let centre = wo.x.atan2(sin_u * wo.y + cos_u * wo.z);
            let quarter = centre.of(FRAC_PI_2);
            let (low, high) = (optics.v_of_x(low), optics.v_of_x(high));
            [low.max(centre - quarter), high.min(centre + quarter)]
        }
        Spread::Filament { delta, .. } => {
            let [low, high] = window(y, delta);
            [optics.u_of_y(low), optics.u_of_y(high)]
        }
        Spread::Rough { .. } => {
            let (sin_u, cos_u, _) = optics.along(y);
            let (sin_v, cos_v, _) = optics.across(x);
            let is_seen = normal(sin_u, cos_u, sin_v, cos_v).dot(wo).is_positive();
            [x.zero(), R::select(is_seen, x.one(), x.zero())]
        }
    }
}

/// The highlight centres whose drawn window covers the coordinate `c`, all in [−1, 1].
#[inline(always)]
fn window<R: Real>(c: R, delta: R::Scalar) -> [R; 2] {
    let (delta, one) = (c.splat(delta), c.one());
    let edge = one - delta - delta;
    let low = R::select(c.lt(-edge), -one, c - delta);
    [low, R::select(edge.lt(c), one, c + delta)]
}
