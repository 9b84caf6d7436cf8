//! The highlight of a segment, averaged over it, by a quadrature that sixteen lanes share.
//!
//! The mean depends neither on δ nor on the mapping and is affine in w/l, as that of its albedo is. With
//! S = S(u), S_e = sin u_e at the ends of the conic and the shares of the phase function apart, it is
//!
//! ```text
//! staple    1/4S_e ∫ du [S − (w/l) S_e (S − cos v)] f_c pq / ((p+q)² |sin ψ|)     v at the root
//! filament  1/4S_e ∫ dv [S − (w/l) S_e (S − cos v)] f_c pq / ((p+q) m)            u at the root
//! rough     1/4S_e ∫∫ du dv [S − (w/l) S_e (S − cos v)] M f_c pq / (p+q)
//! ```
//!
//! What is integrated is smooth between bounds that are known: those of the segment, those at which the
//! yarn turns away from a direction, and those at which what reflects sinks below the middle of the yarn
//! or, for rough fibres, is too far from the cone to matter. Between them lie Gauss–Legendre nodes.

use core::f32::consts::{FRAC_PI_2, PI};

use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};

use crate::frame::Vector;
use crate::lanes::LANES;
use crate::phase::{Azimuth, Parts};
use crate::real::Real;
use crate::rough::longitudinal;
use crate::segment::{Optics, Spread};
use crate::staple;

use super::rule::{Row, Rule};

/// Both parts of the mean: of what is independent of w/l, and of what −w/l is multiplied with.
pub(super) type Mean<R> = [Parts<R>; 2];

/// How many standard deviations of the spread along a fibre matter: beyond, even of a sharp peak there is
/// next to nothing.
const REACH: f32 = 4.6;

/// The mean over the segment, before colour and scale, as a sum over lanes; `wi` and `wo` are in the yarn
/// frame, above the surface.
#[inline(always)]
pub(super) fn mean<S: Simd>(
    simd: S,
    optics: &Optics<f32>,
    rule: &Rule,
    wi: Vector<f32>,
    wo: Vector<f32>,
) -> Mean<f32x16<S>> {
    let load = |row: &Row| f32x16::simd_from(simd, *row);
    let like = load(&[0.0; LANES]);
    let splat = |w: Vector<f32>| {
        let part = |x: f32| Real::splat(like, x);
        Vector::new(part(w.x), part(w.y), part(w.z))
    };
    let (wi, wo, h) = (splat(wi), splat(wo), wi.plus(wo));
    match optics.spread {
        Spread::Staple { .. } => {
            let bounds = lit_inclinations(
                optics,
                inclinations(optics, h, 0.0),
                load,
                #[inline(always)]
                |sin_u, cos_u| staple::root(optics, sin_u, cos_u, wi, wo).is_lit,
            );
            of_staple(optics, rule, load, [wi, wo], bounds)
        }
        Spread::Filament { .. } => of_filament(optics, rule, load, [wi, wo], h),
        Spread::Rough { inv_variance, scale } => {
            let reach = REACH / inv_variance.sqrt();
            let bounds = lit_inclinations(
                optics,
                inclinations(optics, h, reach),
                load,
                #[inline(always)]
                |sin_u, cos_u| {
                    let rises = [rise(wi, sin_u, cos_u), rise(wo, sin_u, cos_u)];
                    let [from, to] = near_cone(optics, h, reach, [sin_u, cos_u], [wi, wo], rises);
                    from.lt(to)
                },
            );
            of_rough(optics, rule, load, [inv_variance, scale], [wi, wo], h, (reach, bounds))
        }
    }
}

/// Adds what `parts` are per area of yarn, on a piece of it with `bend` S and `cos_v`.
#[inline(always)]
fn add<R: Real<Scalar = f32>>(
    sum: &mut Mean<R>,
    parts: Parts<R>,
    optics: &Optics<f32>,
    bend: R,
    cos_v: R,
) {
    let slope = (bend - cos_v) * optics.sin_conic;
    for (sum, area) in sum.iter_mut().zip([bend, slope]) {
        sum.peak = sum.peak + parts.peak * area;
        sum.uniform = sum.uniform + parts.uniform * area;
    }
}

#[inline(always)]
fn none<R: Real>(like: R) -> Mean<R> {
    [Parts::none(like); 2]
}

/// The inclinations on the segment at which something of the yarn is within `reach` of the cone of
/// directions that it reflects, given H = wi + wo.
///
/// With Δ = u − atan2(H_y, H_z) and m² = H_y² + H_z², fibres have |t·H| ≤ `reach` somewhere around the
/// section up to `m sin Δ = reach cos ψ + |sin ψ| √(|H|² − reach²)`. On the side of H_x that is below the
/// middle of the yarn from `m sin(Δ − |ψ|) = reach` on.
#[inline(always)]
fn inclinations(optics: &Optics<f32>, h: Vector<f32>, reach: f32) -> [f32; 2] {
    let m = (h.y * h.y + h.z * h.z).max(1e-30).sqrt();
    let sin_psi = optics.sin_psi.abs();
    let far =
        reach * optics.cos_psi + sin_psi * (h.x * h.x + m * m - reach * reach).max(0.0).sqrt();
    let angle = |sine: f32| if sine < m { Real::asin(sine / m) } else { PI };
    let far = angle(far);
    let near = far.min(Real::asin(sin_psi.min(1.0)) + angle(reach));
    let centre = Real::atan2(h.y, h.z);
    let [below, above] = if optics.sin_psi * h.x > 0.0 { [far, near] } else { [near, far] };
    let u_max = optics.u_max;
    [(centre - below).clamp(-u_max, u_max), (centre + above).clamp(-u_max, u_max)]
}

/// The part of the inclinations between `bounds` on which some point of the yarn `is_lit`, to a hundredth of it: where
/// the yarn turns away in between, what is integrated has a kink.
#[inline(always)]
fn lit_inclinations<S: Simd>(
    optics: &Optics<f32>,
    bounds: [f32; 2],
    load: impl Fn(&Row) -> f32x16<S>,
    is_lit: impl Fn(f32x16<S>, f32x16<S>) -> mask32x16<S>,
) -> [f32; 2] {
    #[inline(always)]
    fn lit_lanes<S: Simd>(
        tried: f32x16<S>,
        is_lit: &impl Fn(f32x16<S>, f32x16<S>) -> mask32x16<S>,
    ) -> u16 {
        let (sin_u, cos_u) = Real::sin_cos(tried);
        is_lit(sin_u, cos_u).to_bitmask() as u16
    }
    const HALF: usize = LANES / 2;
    if optics.u_max == 0.0 {
        return bounds;
    }
    let inside = |[from, to]: [f32; 2], k: usize, count: usize| {
        from + (to - from) * ((k + 1) as f32 / (count + 1) as f32)
    };
    let tried: Row = core::array::from_fn(|lane| inside(bounds, lane, LANES));
    let lit = lit_lanes(load(&tried), &is_lit);
    if lit == 0 {
        return bounds;
    }
    let [first, last] = [lit.trailing_zeros(), lit.ilog2()].map(|lane| lane as usize);
    let before = [if first == 0 { bounds[0] } else { tried[first - 1] }, tried[first]];
    let after = [tried[last], if last == LANES - 1 { bounds[1] } else { tried[last + 1] }];
    let tried: Row = core::array::from_fn(|lane| {
        if lane < HALF { inside(before, lane, HALF) } else { inside(after, lane - HALF, HALF) }
    });
    let [at_first, at_last] = lit_lanes(load(&tried), &is_lit).to_le_bytes();
    let dark = at_first.trailing_zeros() as usize;
    let lit = HALF - at_last.leading_zeros() as usize;
    let from = if dark == 0 { before[0] } else { tried[dark - 1] };
    let to = if lit == HALF { after[1] } else { tried[HALF + lit] };
    [from, to]
}

/// Sine and cosine of inclinations between two bounds, with the du of each node.
#[inline(always)]
fn arc<R: Real<Scalar = f32>>(
    optics: &Optics<f32>,
    [from, to]: [f32; 2],
    node: R,
    weight: R,
) -> (R, R, R) {
    let Some((_, top)) = optics.conic else {
        let half = 0.5 * (to - from);
        let (sin_u, cos_u) = (node * half + 0.5 * (from + to)).sin_cos();
        return (sin_u, cos_u, weight * half);
    };
    // Even along the spine of a conic that is halfway to a circle: one part of what is integrated is even
    // along the spine, the other in angle.
    let (c, top) = (top - 1.0, top.sqrt());
    let eta = |u: f32| {
        let sin_u = Real::sin_cos(u).0;
        let t = sin_u * optics.inv_sin_conic;
        Real::asin((sin_u * top / (1.0 + c * t * t).max(1e-12).sqrt()).clamp(-1.0, 1.0))
    };
    let (from, to) = (eta(from), eta(to));
    let half = 0.5 * (to - from);
    let (sin, cos) = (node * half + 0.5 * (from + to)).sin_cos();
    let w = sin * optics.inv_sin_conic;
    let rest = (-(w * w * c) + top * top).max(node.of(1e-12)).sqrt();
    let sin_u = (sin / rest).clamp_to(-node.one(), node.one());
    let cos_u = ((node.one() - sin_u) * (node.one() + sin_u)).max(node.of(1e-12)).sqrt();
    let t = sin_u * optics.inv_sin_conic;
    let d = t * t * c + 1.0;
    (sin_u, cos_u, weight * (d * d.max(node.zero()).sqrt() * cos / cos_u) * (half / top))
}

#[inline(always)]
fn of_staple<R: Real<Scalar = f32>>(
    optics: &Optics<f32>,
    rule: &Rule,
    load: impl Fn(&Row) -> R,
    [wi, wo]: [Vector<R>; 2],
    bounds: [f32; 2],
) -> Mean<R> {
    let mut sum = none(wi.x);
    // Of a straight yarn du/sin u is even.
    let scale = if optics.u_max > 0.0 { 0.25 * optics.inv_sin_conic } else { 0.25 };
    let strength = scale / optics.sin_psi.abs();
    for [node, weight] in &rule.arc {
        let (sin_u, cos_u, du) = if optics.u_max > 0.0 {
            arc(optics, bounds, load(node), load(weight))
        } else {
            (wi.x.zero(), wi.x.one(), load(weight))
        };
        let root = staple::root(optics, sin_u, cos_u, wi, wo);
        if !R::any(root.is_lit) {
            continue;
        }
        let inv_sum = wi.x.one() / (root.p + root.q).max(wi.x.of(1e-30));
        let factor = du * strength * ((root.p * inv_sum) * (root.q * inv_sum));
        let azimuth = Azimuth::on_cone(root.tangent(optics), wi, wo);
        let parts = optics.phase.eval(&azimuth).scaled(factor, root.is_lit);
        add(&mut sum, parts, optics, optics.bend(sin_u), root.cos_v);
    }
    sum
}

#[inline(always)]
fn of_filament<R: Real<Scalar = f32>>(
    optics: &Optics<f32>,
    rule: &Rule,
    load: impl Fn(&Row) -> R,
    [wi, wo]: [Vector<R>; 2],
    h: Vector<f32>,
) -> Mean<R> {
    let mut sum = none(wi.x);
    let m = (h.y * h.y + h.z * h.z).max(1e-30).sqrt();
    let (sin_u, cos_u) = (h.y / m, h.z / m);
    if sin_u.abs() >= optics.sin_u_max {
        return sum;
    }
    let strength = 0.25 * optics.inv_sin_conic * optics.fade(sin_u) / m;
    let bend = wi.x.splat(optics.bend(sin_u));
    let rises = [wi.y * sin_u + wi.z * cos_u, wo.y * sin_u + wo.z * cos_u];
    let [from, to] = facing(wi.x, rises[0], wo.x, rises[1]);
    let half = (to - from).max(from.zero()) * 0.5;
    let azimuth = Azimuth::in_plane([wi.x, rises[0]], [wo.x, rises[1]]);
    let phase = optics.phase.eval(&azimuth);
    for [node, weight] in &rule.arc {
        let (sin_v, cos_v) = (load(node) * half + (from + to) * 0.5).sin_cos();
        let (p, q) = (wi.x * sin_v + rises[0] * cos_v, wo.x * sin_v + rises[1] * cos_v);
        let is_lit = p.is_positive() & q.is_positive();
        let factor = load(weight) * half * strength * (p * (q / (p + q)));
        add(&mut sum, phase.scaled(factor, is_lit), optics, bend, cos_v);
    }
    sum
}

#[inline(always)]
fn of_rough<R: Real<Scalar = f32>>(
    optics: &Optics<f32>,
    rule: &Rule,
    load: impl Fn(&Row) -> R,
    spread: [f32; 2],
    [wi, wo]: [Vector<R>; 2],
    h: Vector<f32>,
    (reach, bounds): (f32, [f32; 2]),
) -> Mean<R> {
    let mut sum = none(wi.x);
    let (zero, one) = (wi.x.zero(), wi.x.one());
    let scale = if optics.u_max > 0.0 { 0.25 * optics.inv_sin_conic } else { 0.25 };
    for [node, weight] in &rule.arc {
        let (sin_u, cos_u, du) = if optics.u_max > 0.0 {
            arc(optics, bounds, load(node), load(weight))
        } else {
            (zero, one, load(weight))
        };
        let rises = [rise(wi, sin_u, cos_u), rise(wo, sin_u, cos_u)];
        let [from, to] = near_cone(optics, h, reach, [sin_u, cos_u], [wi, wo], rises);
        let half = (to - from).max(zero) * 0.5;
        let centre = (from + to) * 0.5;
        let bend = optics.bend(sin_u);
        let du = du * half * scale;
        for [node, weight] in &rule.section {
            let (sin_v, cos_v) = (load(node) * half + centre).sin_cos();
            let (p, q) = (wi.x * sin_v + rises[0] * cos_v, wo.x * sin_v + rises[1] * cos_v);
            let is_lit = p.is_positive() & q.is_positive();
            let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
            let factor = du * load(weight) * longitudinal(spread, t, wi, wo) * (p * (q / (p + q)));
            let parts = optics.phase.eval(&Azimuth::about(t, wi, wo)).scaled(factor, is_lit);
            add(&mut sum, parts, optics, bend, cos_v);
        }
    }
    sum
}

/// The part of a direction along n(u, 0).
#[inline(always)]
fn rise<R: Real<Scalar = f32>>(w: Vector<R>, sin_u: R, cos_u: R) -> R {
    w.y * sin_u + w.z * cos_u
}

/// The angles around the section at which the yarn of inclination u faces both directions and its fibres are within
/// `reach` of the cone of directions that they reflect; empty if the second is less. `rises` are the parts of the
/// directions along n(u, 0).
#[inline(always)]
fn near_cone<R: Real<Scalar = f32>>(
    optics: &Optics<f32>,
    h: Vector<f32>,
    reach: f32,
    [sin_u, cos_u]: [R; 2],
    [wi, wo]: [Vector<R>; 2],
    rises: [R; 2],
) -> [R; 2] {
    let one = sin_u.one();
    let abs_sin_psi = optics.sin_psi.abs();
    let [from, to] = facing(wi.x, rises[0], wo.x, rises[1]);
    // t·H = C cos ψ − r sin ψ cos(v + φ₀), with n·H = r sin(v + φ₀) > 0.
    let c = cos_u * h.y - sin_u * h.z;
    let b = rises[0] + rises[1];
    let r = (b * b + h.x * h.x).max(one.of(1e-30)).sqrt();
    let phi = b.atan2(one.splat(h.x));
    let phi = R::select(phi.lt(one.splat(-FRAC_PI_2)), phi + 2.0 * PI, phi);
    let across = one / (r * abs_sin_psi).max(one.of(1e-6));
    let middle =
        c * R::Scalar::select(optics.sin_psi.is_positive(), optics.cos_psi, -optics.cos_psi);
    [
        from.max(arc_cosine((middle + reach) * across) - phi),
        to.min(arc_cosine((middle - reach) * across) - phi),
    ]
}

/// The angle whose cosine is nearest to `cos`, in [0, π].
#[inline(always)]
fn arc_cosine<R: Real<Scalar = f32>>(cos: R) -> R {
    -cos.clamp_to(-cos.one(), cos.one()).asin() + FRAC_PI_2
}

/// The angles around the section, of at most a quarter turn from the middle, within which the yarn faces
/// both of two directions, given their parts across it and along n(u, 0); empty if the second is less.
#[inline(always)]
pub(super) fn facing<R: Real<Scalar = f32>>(x_i: R, rise_i: R, x_o: R, rise_o: R) -> [R; 2] {
    let (a, b) = (x_i.atan2(rise_i), x_o.atan2(rise_o));
    let quarter = a.splat(FRAC_PI_2);
    [(a.max(b) - quarter).max(-quarter), (a.min(b) + quarter).min(quarter)]
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};
    use glam::{DVec2, DVec3};
    use selvedge_normalize::halton::Halton;
    use selvedge_normalize::warp::square_to_uniform_hemisphere;

    use super::*;
    use crate::far::rule::grazes;
    use crate::far::sum;
    use crate::phase::Phase;
    use crate::segment::Mapping;
    use crate::shader;
    use crate::yarn::{Highlight, Yarn};

    /// Yarns of every kind, as steep, sharp and bent as cloth has them.
    fn yarns() -> Vec<Yarn> {
        let d = Yarn::default;
        let rough = |sigma| Highlight::Rough { sigma };
        let cauchy = |rho, is_backward| Phase::WrappedCauchy { rho, is_backward };
        vec![
            Yarn { psi: -0.52, u_max: 0.21, ..d() },
            Yarn { psi: -0.52, u_max: 0.66, ..d() },
            Yarn { psi: 1.2, u_max: 0.4, phase: cauchy(0.67, true), ..d() },
            Yarn { psi: 0.4, u_max: 0.3, kappa: 2.0, ..d() },
            Yarn { psi: 0.0, u_max: 0.9, kappa: -0.7, smoothing: 0.4, ..d() },
            Yarn { psi: 0.0, phase: cauchy(0.9, false), ..d() },
            Yarn { psi: 0.6, u_max: 0.3, highlight: rough(0.25), ..d() },
            Yarn { psi: 0.1, u_max: 0.7, kappa: 2.0, highlight: rough(0.1), ..d() },
            Yarn { psi: 0.0, u_max: 0.87, kappa: -0.5, highlight: rough(0.15), ..d() },
            Yarn { psi: -1.2, u_max: 0.4, highlight: rough(0.05), ..d() },
            Yarn { phase: Phase::VonMises { alpha: 0.01, beta: 100.0 }, ..d() },
        ]
    }

    /// The mean over points of the segment of the highlight itself, in f64.
    fn of_points(yarn: &Yarn, is_straight: bool, [wi, wo]: [DVec3; 2], ratio: f64) -> f64 {
        // A window of half the segment on either side shows the highlight everywhere.
        let highlight = match yarn.highlight {
            Highlight::Window { .. } => Highlight::Window { delta: 1.0 },
            rough @ Highlight::Rough { .. } => rough,
        };
        let yarn = Yarn { highlight, ..yarn.clone() };
        let optics = Optics::<f64>::new(&yarn, is_straight, Mapping::Linear);
        let (wi, wo) = (Vector::<f64>::of(wi), Vector::<f64>::of(wo));
        let [across, along] = match optics.spread {
            Spread::Staple { .. } => [1, 20_000],
            Spread::Filament { .. } => [4000, 1],
            Spread::Rough { .. } => [500, 300],
        };
        let even = |k: i32, n: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0;
        let sum: f64 = (0..across * along)
            .map(|k| {
                let at = [even(k % across, across), even(k / across, along), ratio];
                let parts = shader::highlight(&optics, at, wi, wo);
                parts.peak + parts.uniform
            })
            .sum();
        sum / f64::from(across * along)
    }

    #[test]
    fn mean_is_that_of_the_points_of_a_segment() {
        let pairs: Vec<[DVec3; 2]> = Halton::<4>::new()
            .points_from(core::num::NonZeroU32::MIN)
            .take(60)
            .map(|[a, b, c, d]| {
                [[a, b], [c, d]].map(|[x, y]| square_to_uniform_hemisphere(DVec2::new(x, y)))
            })
            .collect();
        for (yarn, is_straight) in
            yarns().into_iter().flat_map(|yarn| [(yarn.clone(), false), (yarn, true)])
        {
            let ratio = if is_straight { 0.0 } else { 0.5 };
            let optics = Optics::<f32>::new(&yarn, is_straight, Mapping::Arcsine);
            let rules = Rule::resolving(Level::new(), &optics);
            let exact: Vec<f64> =
                pairs.iter().map(|&pair| of_points(&yarn, is_straight, pair, ratio)).collect();
            let least = 0.1 * exact.iter().sum::<f64>() / pairs.len() as f64;
            let mut errors: Vec<f64> = pairs
                .iter()
                .zip(&exact)
                .map(|(pair, exact)| {
                    let [wi, wo] = pair.map(|w| Vector::<f32>::of(w.as_vec3()));
                    let rule = &rules[usize::from(grazes(wi, wo))];
                    let found = dispatch!(Level::new(), simd => {
                        let [base, slope] = mean(simd, &optics, rule, wi, wo);
                        let at = |part: fn(&Parts<f32x16<_>>) -> f32x16<_>| {
                            sum(part(&base)) - ratio as f32 * sum(part(&slope))
                        };
                        at(|parts| parts.peak) + at(|parts| parts.uniform)
                    });
                    (f64::from(found) - exact).abs() / exact.max(least)
                })
                .collect();
            errors.sort_by(f64::total_cmp);
            let (most, worst) = (errors[pairs.len() * 9 / 10], errors[pairs.len() - 1]);
            println!(
                "{:?} nodes: 90 % {most:.5}, worst {worst:.5}, {yarn:?}",
                rules.each_ref().map(Rule::count)
            );
            assert!(
                most < 1e-3 && worst < 4e-3,
                "{yarn:?} straight {is_straight}: errors {most} and {worst}, expected 0.001 and 0.004"
            );
        }
    }
}
