//! The direction that [`Shader::sample`](crate::Shader::sample) draws, over any [`Real`].

use core::f64::consts::{FRAC_PI_4, PI};

use crate::azimuth::Facing;
use crate::density::Drawing;
use crate::frame::Vector;
use crate::material::Piece;
use crate::real::Real;
use crate::segment::{Optics, Spread, cosine, normal};

/// The direction drawn at `at` = (x, y, w/l) on `piece` for `wo` by the numbers `xi` in [0, 1): a unit
/// vector of the yarn frame, as `wo` is. Its z is not above 0 where there is none.
#[inline(always)]
pub(crate) fn draw<R: Real>(
    piece: &Piece<R::Scalar>,
    at: [R; 3],
    drawing: &Drawing<R>,
    wo: Vector<R>,
    xi: [R; 3],
) -> Vector<R> {
    let below_one = wo.x.of(1.0 - f64::from(f32::EPSILON) / 2.0);
    // Not by closures, which would be compiled on their own, without the instructions of lanes.
    let zero = wo.x.zero();
    let [choice, a, b] = xi;
    let choice = choice.clamp_to(zero, below_one);
    let (a, b) = (a.clamp_to(zero, below_one), b.clamp_to(zero, below_one));
    let even = cosine_hemisphere([a, b]);
    let is_highlight = choice.lt(drawing.share);
    if !R::any(is_highlight) {
        return even;
    }
    let choice = (choice / drawing.share).min(below_one);
    let found = draw_highlight(piece, at, drawing.span, wo, [choice, a, b]);
    Vector::new(
        R::select(is_highlight, found.x, even.x),
        R::select(is_highlight, found.y, even.y),
        R::select(is_highlight, found.z, even.z),
    )
}

/// The same from the highlight alone, whose drawn angles are in `span`.
#[inline(always)]
fn draw_highlight<R: Real>(
    piece: &Piece<R::Scalar>,
    [x, y, _]: [R; 3],
    [from, to]: [R; 2],
    wo: Vector<R>,
    [a, b, c]: [R; 3],
) -> Vector<R> {
    let optics: &Optics<R::Scalar> = &piece.optics;
    let (along, across) = (optics.along(y), optics.across(x));
    let (along, across) = ((along.0, along.1), (across.0, across.1));
    let drawn = from + (to - from) * a;
    let ((sin_u, cos_u), (sin_v, cos_v)) = match optics.spread {
        Spread::Staple { .. } => (along, drawn.sin_cos()),
        Spread::Filament { .. } => (drawn.sin_cos(), across),
        Spread::Rough { .. } => (along, across),
    };
    let n = normal(sin_u, cos_u, sin_v, cos_v);
    let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
    let so = t.dot(wo);
    let si = match optics.spread {
        Spread::Rough { inv_variance, scale } => {
            draw_inclination(so, [so.splat(inv_variance), so.splat(scale)], [a, c])
        }
        Spread::Staple { .. } | Spread::Filament { .. } => -so,
    };
    // At right angles to the fibre, towards `wo` or, where that is along the fibre, anywhere.
    let off = wo.minus(t.times(so));
    let square = off.dot(off);
    let has_azimuth = square.of(1e-12).lt(square);
    let inverse = square.one() / R::select(has_azimuth, square, square.one()).sqrt();
    let e1 = Vector::new(
        R::select(has_azimuth, off.x * inverse, n.x),
        R::select(has_azimuth, off.y * inverse, n.y),
        R::select(has_azimuth, off.z * inverse, n.z),
    );
    let e2 = t.cross(e1);
    let q = n.dot(wo);
    let (cos_phi, sin_phi) = piece.sampler.sample(b, Facing::new(q, si, so), n.dot(e2));
    let about = e1.times(cos_phi).plus(e2.times(sin_phi));
    let wi = t.times(si).plus(about.times(cosine(si)));
    let wi = wi.times(si.one() / wi.dot(wi).sqrt());
    Vector { z: R::select(q.is_positive(), wi.z, -q.one()), ..wi }
}

/// The sine of an inclination about a rough fibre, drawn from M(s_i, s_o) for fixed s_o = `so` by
/// two numbers in [0, 1) (d'Eon, Marschner & Hanika 2013, section 4: a direction about the cone,
/// from a von Mises–Fisher lobe).
#[inline(always)]
fn draw_inclination<R: Real>(so: R, [inv_variance, scale]: [R; 2], [a, b]: [R; 2]) -> R {
    // 1 − cosine = −v ln(1 − a (1 − e^{−2/v})); the `scale` is 1/v over what is in brackets.
    let gap = -(so.one() - a * (inv_variance / scale)).ln() / inv_variance;
    let gap = gap.clamp_to(so.zero(), so.of(2.0));
    let sine = (gap * (so.of(2.0) - gap)).sqrt();
    let (_, cos) = (b * so.of(2.0 * PI)).sin_cos();
    let si = cosine(so) * sine * cos - so * (so.one() - gap);
    si.clamp_to(-so.one(), so.one())
}

/// A direction with a density proportional to its cosine:
/// [`square_to_cosine_hemisphere`](selvedge_normalize::warp::square_to_cosine_hemisphere).
#[inline(always)]
fn cosine_hemisphere<R: Real>(square: [R; 2]) -> Vector<R> {
    let [x, y] = square;
    let (x, y) = (x + x - x.one(), y + y - y.one());
    let is_wide = y.abs().lt(x.abs());
    let (radius, across) = (R::select(is_wide, x, y), R::select(is_wide, y, x));
    let is_off = x.zero().lt(radius.abs());
    let slope = across / R::select(is_off, radius, x.one());
    let (sin, cos) = (slope * x.of(FRAC_PI_4)).sin_cos();
    let (near, far) = (radius * cos, radius * sin);
    let z = ((x.one() - radius) * (x.one() + radius)).max(x.zero()).sqrt();
    Vector::new(R::select(is_wide, near, far), R::select(is_wide, far, near), z)
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use selvedge_normalize::warp::square_to_cosine_hemisphere;

    use super::*;

    #[test]
    fn hemisphere_is_that_of_the_normalization() {
        for k in 0..=40 * 40 {
            let square = [f64::from(k % 41) / 40.0, f64::from(k / 41) / 40.0];
            let found = cosine_hemisphere(square);
            let expected = square_to_cosine_hemisphere(DVec2::from_array(square));
            // At the border, where that one's cancels, z is better known by its square.
            let errors =
                [found.x - expected.x, found.y - expected.y, found.z.powi(2) - expected.z.powi(2)];
            let is_near = errors.iter().all(|error| error.abs() < 1e-14);
            assert!(is_near, "{square:?}: {found:?}, expected {expected}");
        }
    }

    #[test]
    fn inclinations_have_the_mean_of_their_lobe() {
        // Of a von Mises–Fisher lobe about −s_o, the mean cosine is coth κ − 1/κ.
        for kappa in [1.0_f64, 30.0, 4e4] {
            let scale = kappa / -(-2.0 * kappa).exp_m1();
            for so in [-0.99, -0.3, 0.0, 0.8] {
                let n = 200;
                let mut sum = 0.0;
                for k in 0..n * n {
                    let numbers = [k % n, k / n].map(|part| (f64::from(part) + 0.5) / f64::from(n));
                    sum += draw_inclination(so, [kappa, scale], numbers);
                }
                let mean = sum / f64::from(n * n);
                let expected = -so * (1.0 / kappa.tanh() - 1.0 / kappa);
                assert!((mean - expected).abs() < 1e-3, "{kappa} {so}: {mean}, not {expected}");
            }
        }
    }
}
