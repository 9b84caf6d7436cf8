//! How much a highlight reflects: its directional albedo by quadrature.
//!
//! Over the directions `wi` that reflect into a given `wo`, the change of variables
//! `wi → (v or u of the highlight, azimuth on the cone)` cancels the geometry factor, and what
//! remains is smooth (Nelson, McEvoy & Fratarcangeli 2016, equation 2, after that substitution):
//!
//! ```text
//! ∫ f cos θi dwi = ∫_window dv ∫ dφ (du/dy)/(2δ sin u_max) [S − (w/l) sin u_max (S − cos v)] f_c pq/(p+q) cos θi
//! ```
//!
//! Its mean over a segment depends neither on δ nor on the mapping, and is the same expression for
//! twisted and untwisted yarn. Rough fibres have one more integral, over the spread along the fibre,
//! and none over a window. All are affine in the segment's width over length w/l, so two numbers a
//! direction serve segments of every shape.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI};

use selvedge_normalize::glam::DVec3;

use crate::frame::Vector;
use crate::real::{Real, Scalar};
use crate::ring::{Rings, Turn};
use crate::rough::longitudinal;
use crate::rules::{Rules, gauss_legendre};
use crate::segment::{Mapping, Optics, Spread, normal, shaded_angles};
use crate::yarn::{Highlight, Yarn};

/// An albedo affine in w/l: `base − slope·(w/l)`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Affine<R> {
    pub(crate) base: R,
    pub(crate) slope: R,
}

impl<R: Scalar> Affine<R> {
    /// The same in as many lanes as `like` has.
    #[inline(always)]
    pub(crate) fn splat<L: Real<Scalar = R>>(self, like: L) -> Affine<L> {
        Affine { base: like.splat(self.base), slope: like.splat(self.slope) }
    }
}

impl<R: Real> Affine<R> {
    #[inline(always)]
    pub(crate) fn at(self, ratio: R) -> R {
        self.base - self.slope * ratio
    }
}

impl Affine<f64> {
    fn times(self, factor: f64) -> Self {
        Self { base: self.base * factor, slope: self.slope * factor }
    }
}

/// Numbers of nodes for one albedo.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes {
    pub(crate) arc: usize,
    pub(crate) section: usize,
    pub(crate) azimuth: usize,
    /// Along the fibre, for rough ones.
    pub(crate) spread: usize,
}

impl Nodes {
    /// Nodes that resolve the highlight of `yarn`: the sharper the phase function, the faster the
    /// integrand changes along the arc and around the section. `density` is 1 for the table and
    /// the factor, whose errors their margins cover, and more for an albedo that is asked for.
    pub(crate) fn resolving(yarn: &Yarn, density: f64) -> Self {
        let sharpness = yarn.phase.sharpness();
        let finer = (2.0 * sharpness.min(100.0).ln()).max(0.0);
        let nodes = |count: f64| (density * count).ceil() as usize;
        let (section, spread) = match yarn.highlight {
            Highlight::Window { .. } => (8.0 + 1.7 * finer, 1.0),
            Highlight::Rough { sigma } => {
                let sigma = sigma.min(0.5);
                let spread = 4.0 + 8.0 * sigma + 0.6 * finer * (8.0 * sigma).min(1.0);
                (7.0 + 1.5 * finer, spread)
            }
        };
        let (u_max, _) = shaded_angles(yarn, false);
        let arc = 6.0 + 1.2 * finer + 3.0 * u_max;
        Self {
            arc: nodes(arc),
            section: nodes(section),
            azimuth: nodes(48.0),
            spread: nodes(spread),
        }
    }
}

/// The albedo integrals of one type of yarn.
pub(crate) struct Integrals {
    pub(crate) optics: Optics<f64>,
    pub(crate) u_max: f64,
    arc: Rules,
    section: Rules,
    /// Angles around the section, rad, with their sines and cosines.
    around: Vec<(f64, (f64, f64))>,
    /// For rough fibres, the inclinations t·wi with their weights, for even steps of the angle
    /// between −t and t of the direction they are seen from.
    spread: Option<Vec<Vec<(f64, f64)>>>,
    rings: Rings,
}

/// The fibre at a place of the yarn, as seen from a direction: along it, n·wi and cos θi of a
/// direction per unit of its part along the fibre and of those across, towards `wo` and aside.
struct Fibre {
    /// t·wo.
    along: f64,
    t_z: f64,
    n: [f64; 2],
    z: [f64; 2],
    /// n·wo.
    q: f64,
}

impl Integrals {
    pub(crate) fn new(yarn: &Yarn, is_straight: bool, mapping: Mapping, nodes: Nodes) -> Self {
        // A sharp forward peak passes only where the yarn turns away from the light.
        let power = 1.0 + yarn.phase.sharpness().ln().max(0.0) / 3.0;
        Self {
            optics: Optics::new(yarn, is_straight, mapping),
            u_max: shaded_angles(yarn, is_straight).0,
            arc: Rules::new(nodes.arc, power),
            section: Rules::new(nodes.section, power),
            around: (0..=16)
                .map(|k| PI * (f64::from(k) / 16.0 - 0.5))
                .map(|v| (v, v.sin_cos()))
                .collect(),
            spread: match yarn.highlight {
                Highlight::Rough { sigma } => Some(spread_levels(sigma, nodes.spread)),
                Highlight::Window { .. } => None,
            },
            rings: Rings::new(&yarn.phase, nodes.azimuth),
        }
    }

    /// Directional albedo of the highlight for `wo` (yarn frame, unit, z ≥ 0), averaged over the
    /// segment.
    pub(crate) fn mean(&self, wo: DVec3) -> Affine<f64> {
        if self.u_max == 0.0 {
            let [value, _] = self.section(0.0, wo);
            return Affine { base: 0.5 * value, slope: 0.0 };
        }
        let sum = self.along_arc(&self.bends_along(wo), |sin_u, _| self.section(sin_u, wo));
        sum.times(0.25 / self.optics.sin_conic)
    }

    /// `∫ [S − (w/l) sin u_max (S − cos v)] g du` between `bounds`, the integrand fading towards the ends of
    /// the segment, for `g(sin u, cos u)` and its product with cos v.
    ///
    /// What is weighted by S has nodes that are even along the spine, where its bend is no peak, unless
    /// there is hardly one in angle.
    fn along_arc(&self, bounds: &[f64], g: impl Fn(f64, f64) -> [f64; 2]) -> Affine<f64> {
        let optics = &self.optics;
        let (mut bent, mut level) = (0.0, 0.0);
        let length = optics.spine_of_u(self.u_max);
        for pair in bounds.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let half = 0.5 * (to - from);
            for &(node, weight) in self.arc.of(half / self.u_max) {
                let (sin_u, cos_u) = (0.5 * (from + to) + half * node).sin_cos();
                let weight = weight * half * optics.fade(sin_u);
                let [value, of_level] = g(sin_u, cos_u);
                level += weight * of_level;
                if optics.is_round() {
                    bent += weight * optics.bend(sin_u) * value;
                }
            }
            if optics.is_round() {
                continue;
            }
            let cuts = [from, -optics.sharp_below(), optics.sharp_below(), to];
            let cuts = cuts.map(|u| optics.spine_of_u(u.clamp(from, to)));
            for pair in cuts.windows(2) {
                let (from, to) = (pair[0], pair[1]);
                let half = 0.5 * (to - from);
                // What is short along the spine may bend a lot.
                let share = if half > 0.0 { (half / length).max(0.4) } else { 0.0 };
                for &(node, weight) in self.arc.of(share) {
                    let (u, du) = optics.u_of_spine(0.5 * (from + to) + half * node);
                    let (sin_u, cos_u) = u.sin_cos();
                    let weight = weight * half * du * optics.fade(sin_u);
                    bent += weight * optics.bend(sin_u) * g(sin_u, cos_u)[0];
                }
            }
        }
        Affine { base: bent, slope: optics.sin_conic * (bent - level) }
    }

    /// The inclinations between which the integral over the section is smooth, in order, rad.
    fn bends_along(&self, wo: DVec3) -> [f64; 7] {
        let optics = &self.optics;
        // Up to the inclination at which the middle of the yarn turns away from `wo`, and beyond: for
        // grazing directions almost nothing of one part is seen.
        let edge = wo.z.atan2(wo.y.abs()) * -wo.y.signum();
        // Where the highlight of filaments begins to fade.
        let fading = optics.fades_from();
        // Where the cone of directions that untwisted fibres reflect sinks below the surface.
        let sinks = [wo.y - 1.0, wo.y + 1.0]
            .map(|y| if optics.sin_psi.abs() < 0.2 { y.atan2(wo.z) } else { edge });
        let bounds = [-self.u_max, -fading, edge, sinks[0], sinks[1], fading, self.u_max];
        let mut bounds = bounds.map(|u| u.clamp(-self.u_max, self.u_max));
        bounds.sort_by(f64::total_cmp);
        bounds
    }

    /// The integral over the section at an inclination, and that of the product with cos v.
    fn section(&self, sin_u: f64, wo: DVec3) -> [f64; 2] {
        let cos_u = (1.0 - sin_u * sin_u).sqrt();
        self.across_section([-FRAC_PI_2, FRAC_PI_2], sin_u, cos_u, wo)
    }

    /// [`Integrals::section`] from one angle v to another.
    fn across_section(&self, [from, to]: [f64; 2], sin_u: f64, cos_u: f64, wo: DVec3) -> [f64; 2] {
        // The part that faces `wo`, at whose edge the integrand has a kink.
        let centre = wo.x.atan2(sin_u * wo.y + cos_u * wo.z);
        let mut start = from.max(centre - FRAC_PI_2);
        let last = to.min(centre + FRAC_PI_2);
        let mut sum = [0.0; 2];
        for end in self.sinks_around(sin_u, cos_u, wo).into_iter().flatten().chain([last]) {
            let end = end.min(last);
            let half = 0.5 * (end - start);
            for &(node, weight) in self.section.of(half * FRAC_2_PI) {
                let (sin_v, cos_v) = (0.5 * (start + end) + half * node).sin_cos();
                let value = weight * half * self.reflected([sin_u, cos_u], [sin_v, cos_v], wo);
                sum[0] += value;
                sum[1] += value * cos_v;
            }
            start = start.max(end);
        }
        sum
    }

    /// The angles around the section, in order, at which the cone of directions that the fibres
    /// reflect sinks below the surface: `(t·wo)² + t_z² = 1`. There the integrand bends.
    fn sinks_around(&self, sin_u: f64, cos_u: f64, wo: DVec3) -> [Option<f64>; 4] {
        let mut found = [None; 4];
        if self.optics.sin_psi == 0.0 {
            return found;
        }
        // t is linear in cos v and sin v.
        let t = |sin_v, cos_v| {
            let t = vector(self.optics.tangent(sin_u, cos_u, sin_v, cos_v));
            (t.dot(wo), t.z)
        };
        let (base, cosine, sine) = (t(0.0, 0.0), t(0.0, 1.0), t(1.0, 0.0));
        let (cosine, sine) =
            ((cosine.0 - base.0, cosine.1 - base.1), (sine.0 - base.0, sine.1 - base.1));
        let depth = |(sin, cos): (f64, f64)| {
            let along = base.0 + cos * cosine.0 + sin * sine.0;
            let z = base.1 + cos * cosine.1 + sin * sine.1;
            let d_along = cos * sine.0 - sin * cosine.0;
            let d_z = cos * sine.1 - sin * cosine.1;
            (along * along + z * z - 1.0, 2.0 * (along * d_along + z * d_z))
        };
        let mut count = 0;
        let mut last = depth(self.around[0].1).0;
        for pair in self.around.windows(2) {
            let next = depth(pair[1].1).0;
            if (last < 0.0) != (next < 0.0) && count < found.len() {
                let (low, high) = (pair[0].0, pair[1].0);
                let v = low + (high - low) * last / (last - next);
                let (value, slope) = depth(v.sin_cos());
                let newton = v - value / slope;
                found[count] = Some(if newton >= low && newton <= high { newton } else { v });
                count += 1;
            }
            last = next;
        }
        found
    }

    /// Directional albedo of the highlight for `wo` at the point (`x`, `y`) of the segment.
    pub(crate) fn at_point(&self, x: f64, y: f64, wo: DVec3) -> Affine<f64> {
        let optics = &self.optics;
        let (sin_u, cos_u, du_dy) = optics.along(y);
        let (sin_v, cos_v, dv_dx) = optics.across(x);
        let affine = |[value, level]: [f64; 2]| {
            let base = value * optics.bend(sin_u);
            Affine { base, slope: optics.sin_conic * (base - level) }
        };
        match optics.spread {
            Spread::Rough { .. } => {
                let value = self.reflected([sin_u, cos_u], [sin_v, cos_v], wo);
                affine([value, value * cos_v]).times(du_dy * dv_dx)
            }
            Spread::Staple { delta, .. } => {
                let (low, high) = window(x, delta);
                let part = [optics.v_of_x(low), optics.v_of_x(high)];
                affine(self.across_section(part, sin_u, cos_u, wo)).times(0.5 * du_dy / delta)
            }
            Spread::Filament { delta, .. } => {
                let (low, high) = window(y, delta);
                let (from, to) = (optics.u_of_y(low), optics.u_of_y(high));
                let bounds = self.bends_along(wo).map(|u| u.clamp(from, to));
                let sum = self.along_arc(&bounds, |sin_u, cos_u| {
                    let value = self.reflected([sin_u, cos_u], [sin_v, cos_v], wo);
                    [value, value * cos_v]
                });
                sum.times(0.5 * dv_dx / (delta * optics.sin_conic))
            }
        }
    }

    /// `∫ f_c pq/(p+q) cos θi dφ` at an inclination and an angle, given by sine and cosine, over the
    /// cone of directions that the fibre reflects into `wo` or, for rough fibres, all about it.
    fn reflected(&self, [sin_u, cos_u]: [f64; 2], [sin_v, cos_v]: [f64; 2], wo: DVec3) -> f64 {
        let n = vector(normal(sin_u, cos_u, sin_v, cos_v));
        let q = n.dot(wo);
        if q <= 0.0 {
            return 0.0;
        }
        let t = vector(self.optics.tangent(sin_u, cos_u, sin_v, cos_v));
        let along = t.dot(wo);
        let e1 = (wo - along * t).try_normalize().unwrap_or_else(|| t.any_orthonormal_vector());
        let e2 = t.cross(e1);
        let fibre = Fibre { along, t_z: t.z, n: [e1, e2].map(|e| n.dot(e)), z: [e1.z, e2.z], q };
        match &self.spread {
            None => self.cone(&fibre, -along),
            Some(levels) => self.cones(&fibre, levels),
        }
    }

    /// The integral over all cones about a rough fibre.
    fn cones(&self, fibre: &Fibre, levels: &[Vec<(f64, f64)>]) -> f64 {
        let so = fibre.along.clamp(-1.0, 1.0);
        let position = (so.asin() + FRAC_PI_2) / PI * (levels.len() - 1) as f64;
        let level = (position as usize).min(levels.len() - 2);
        let share = position - level as f64;
        let pairs = levels[level].iter().zip(&levels[level + 1]);
        pairs
            .map(|(low, high)| {
                let weight = low.1 + share * (high.1 - low.1);
                weight * self.cone(fibre, low.0 + share * (high.0 - low.0))
            })
            .sum()
    }

    /// `∫ f_c pq/(p+q) cos θi dφ` over the cone of directions with `t·wi` = `along`.
    fn cone(&self, fibre: &Fibre, along: f64) -> f64 {
        let radius = (1.0 - along * along).max(0.0).sqrt();
        let radius_o = (1.0 - fibre.along * fibre.along).max(0.0).sqrt();
        let [n1, n2] = fibre.n.map(|n| n * radius);
        let [z1, z2] = fibre.z.map(|z| z * radius);
        let turn = Turn { p: [-n1, n1, n2], z: [along * fibre.t_z - z1, z1, z2], q: fibre.q };
        let from_cone = 1.0 + along * fibre.along - radius * radius_o;
        self.rings.integral(&turn, radius * radius_o, from_cone)
    }
}

/// Nodes s_i and weights, for even steps of asin s_o, of integrals against the spread M along a rough
/// fibre.
fn spread_levels(sigma: f64, count: usize) -> Vec<Vec<(f64, f64)>> {
    const STEPS: usize = 128;
    let rule = gauss_legendre(count.div_ceil(2));
    let variance = sigma * sigma;
    let spread = [1.0 / variance, 1.0 / (variance * -(-2.0 / variance).exp_m1())];
    // M depends on the two inclinations alone.
    let axis = Vector::new(0.0, 0.0, 1.0);
    let at = |angle: f64| Vector::new(angle.cos(), 0.0, angle.sin());
    (0..=STEPS)
        .map(|step| {
            let seen_from = PI * (step as f64 / STEPS as f64 - 0.5);
            // Beyond 3½ standard deviations there is less than 10⁻³. Each side has its own rule: for
            // grazing directions, one of them is below the surface.
            let from = (-seen_from - 3.5 * sigma).max(-FRAC_PI_2);
            let to = (-seen_from + 3.5 * sigma).min(FRAC_PI_2);
            let sides = [[from, -seen_from], [-seen_from, to]];
            let mut nodes: Vec<(f64, f64)> = sides
                .into_iter()
                .flat_map(|[from, to]| {
                    rule.iter().map(move |&(node, weight)| {
                        let angle = 0.5 * (from + to) + 0.5 * (to - from) * node;
                        let density = longitudinal(spread, axis, at(angle), at(seen_from));
                        (angle.sin(), 0.5 * (to - from) * weight * angle.cos() * density)
                    })
                })
                .collect();
            let sum: f64 = nodes.iter().map(|&(_, weight)| weight).sum();
            for (_, weight) in &mut nodes {
                *weight /= sum;
            }
            nodes
        })
        .collect()
}

/// The highlight centres whose drawn window covers the coordinate `c`, all in [−1, 1].
pub(crate) fn window(c: f64, delta: f64) -> (f64, f64) {
    let low = if c < 2.0 * delta - 1.0 { -1.0 } else { c - delta };
    let high = if c > 1.0 - 2.0 * delta { 1.0 } else { c + delta };
    (low, high)
}

fn vector(v: Vector<f64>) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vector;
    use crate::phase::{Phase, PhaseTable};
    use crate::reflectance::{Reflectance, Subject};
    use crate::shader::highlight;
    use selvedge_normalize::glam::DVec2;
    use selvedge_normalize::scale::Mode;
    use selvedge_normalize::warp::square_to_cosine_hemisphere;

    fn yarns() -> Vec<Yarn> {
        let d = Yarn::default;
        let soft = Phase::VonMises { alpha: 0.3, beta: 1.0 };
        let window = |delta| Highlight::Window { delta };
        let rough = |sigma| Highlight::Rough { sigma };
        let cauchy = |rho, is_backward| Phase::WrappedCauchy { rho, is_backward };
        let table = PhaseTable::new(&[0.5, 0.2, 0.1, 0.2, 1.0]).unwrap();
        vec![
            d(),
            Yarn { psi: 0.0, ..d() },
            Yarn { psi: -1.2, u_max: 1.1, highlight: window(0.7), ..d() },
            Yarn { psi: 0.0, u_max: 0.9, highlight: window(1.0), phase: soft.clone(), ..d() },
            Yarn { psi: 0.4, u_max: 0.02, phase: soft, ..d() },
            Yarn { kappa: 2.0, phase: cauchy(0.67, true), ..d() },
            Yarn { psi: 0.0, kappa: -0.7, smoothing: 0.4, phase: cauchy(0.5, false), ..d() },
            Yarn { phase: Phase::VonMises3d { alpha: 0.05, beta: 4.0 }, u_max: 0.8, ..d() },
            Yarn { highlight: rough(0.2), ..d() },
            Yarn { highlight: rough(0.05), psi: 0.0, kappa: 0.5, ..d() },
            Yarn { highlight: rough(0.6), phase: Phase::Tabulated(table), ..d() },
            Yarn {
                highlight: rough(0.1),
                phase: Phase::VonMises3d { alpha: 0.0, beta: 8.0 },
                psi: -0.4,
                ..d()
            },
        ]
    }

    /// The mean of the highlight over the segment and all `wi`, from the highlight itself.
    fn brute_force(yarn: &Yarn, mapping: Mapping, ratio: f64, wo: DVec3) -> f64 {
        let optics = Optics::<f64>::new(yarn, false, mapping);
        let wo = Vector::<f64>::of(wo);
        let points = selvedge_normalize::halton::Halton::<4>::new();
        let n = 4_000_000;
        let sum: f64 = points
            .points_from(core::num::NonZeroU32::MIN)
            .take(n)
            .map(|[a, b, c, d]| {
                let wi = Vector::<f64>::of(square_to_cosine_hemisphere(DVec2::new(a, b)));
                // Even in v, so that the edges of the arcsine map add no noise.
                let v = core::f64::consts::PI * (c - 0.5);
                let (x, weight) = match mapping {
                    Mapping::Arcsine => (v.sin(), 0.5 * core::f64::consts::PI * v.cos()),
                    Mapping::Linear => (2.0 * c - 1.0, 1.0),
                };
                let parts = highlight(&optics, [x, 2.0 * d - 1.0, ratio], wi, wo);
                weight * (parts.peak + parts.uniform)
            })
            .sum();
        PI * sum / n as f64
    }

    #[test]
    fn mean_albedo_is_the_integral_of_the_highlight_in_both_mappings() {
        for yarn in yarns() {
            for wo in [DVec3::new(0.3, -0.2, 0.9), DVec3::new(-0.6, 0.5, 0.3)] {
                let wo = wo.normalize();
                for mapping in [Mapping::Arcsine, Mapping::Linear] {
                    let expected = brute_force(&yarn, mapping, 0.5, wo);
                    let nodes = Nodes::resolving(&yarn, 2.0);
                    let found = Integrals::new(&yarn, false, mapping, nodes).mean(wo).at(0.5);
                    assert!(
                        (found - expected).abs() < 0.008 * expected + 2e-5,
                        "{yarn:?} {mapping:?} at {wo}: {found}, expected {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn mean_over_points_is_the_mean_albedo() {
        let wo = DVec3::new(0.5, 0.3, 0.6).normalize();
        for yarn in yarns() {
            let nodes = Nodes::resolving(&yarn, 2.0);
            let integrals = Integrals::new(&yarn, false, Mapping::Linear, nodes);
            let n = 60;
            let at = |k: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0;
            let sum: f64 =
                (0..n * n).map(|i| integrals.at_point(at(i % n), at(i / n), wo).at(0.5)).sum();
            let (found, expected) = (sum / f64::from(n * n), integrals.mean(wo).at(0.5));
            assert!(
                (found / expected - 1.0).abs() < 5e-3,
                "{yarn:?}: {found}, expected {expected}"
            );
        }
    }

    #[test]
    fn table_is_above_the_albedo_and_close_to_it() {
        for yarn in yarns() {
            let subject = Subject {
                yarn: &yarn,
                is_straight: false,
                mapping: Mapping::Arcsine,
                ratio_max: 1.0,
            };
            let table = Reflectance::new(&subject, Mode::Segment, &|| true).unwrap().unwrap();
            let exact =
                Integrals::new(&yarn, false, Mapping::Arcsine, Nodes::resolving(&yarn, 3.0));
            let mut worst: (f64, f64) = (0.0, 0.0);
            for i in 0..400 {
                let w = square_to_cosine_hemisphere(DVec2::new(
                    (f64::from(i % 20) + 0.37) / 20.0,
                    (f64::from(i / 20) + 0.71) / 20.0,
                ));
                let found = table.at(Vector::<f64>::of(w)).at(0.7) / table.divisor(0.7);
                let expected = exact.mean(w).at(0.7) / table.divisor(0.7);
                worst = (worst.0.min(found - expected), worst.1.max(found - expected));
            }
            println!("table minus albedo: {:.5} to {:.5}, {yarn:?}", worst.0, worst.1);
            assert!(worst.0 > -1e-3 && worst.1 < 0.011, "{yarn:?}: {worst:?}");
        }
    }
}
