//! `Rings`: quadrature over the azimuth about a fibre, against its phase function.
//!
//! The integrals are of one kind: light scattered by a fibre of a surface with the normal n, where
//! p = n·wi and q = n·wo,
//!
//! ```text
//! ∫ f_c(Δφ) p cos θi / (p + q) dΔφ     over the azimuths with p > 0 and cos θi > 0
//! ```
//!
//! They are summed by the million, in single precision and several at once. All that is kept of an
//! azimuth is 1 + cos Δφ and sin Δφ, and a direction is the one straight on plus multiples of these:
//! no digits are lost about a forward peak, where p and cos θi are small.

use core::f64::consts::PI;

use crate::phase::{Phase, PhaseTable, cauchy_width, von_mises_width};

/// Nodes and weights over the azimuth about a fibre.
#[derive(Clone, Debug)]
pub(crate) struct Rings {
    /// Those that are the same on every cone.
    fixed: Vec<Ring>,
    /// Those of a phase function of the angle between the directions.
    spatial: Option<Spatial>,
}

/// Directions about a fibre: p and cos θi straight on, at Δφ = π, and per unit of 1 + cos Δφ and
/// sin Δφ; and q.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    pub(crate) p: [f64; 3],
    pub(crate) z: [f64; 3],
    pub(crate) q: f64,
}

/// Some azimuths and their weights. Whole numbers of [`LANES`], the last of which may weigh nothing.
#[derive(Clone, Debug)]
struct Ring {
    /// 1 + cos Δφ.
    from_forward: Vec<f32>,
    sin: Vec<f32>,
    weight: Vec<f32>,
    /// The greatest 1 + cos Δφ and |sin Δφ| of those that weigh more than nearly nothing.
    reach: [f64; 2],
}

/// How many azimuths are summed at once.
const LANES: usize = 8;

/// The rings of the peak `exp(−b (1 + cos Δφ)) / (2π I₀e(β))`, b = β c², for concentrations b that
/// fall in even ratios from β on, and for b = 0.
#[derive(Clone, Debug)]
struct Spatial {
    beta: f64,
    levels: Vec<Ring>,
}

/// How many levels of concentration there are to a factor of 2: between them, an integral that
/// goes with the root of b is off by less than 10⁻³.
const LEVELS_PER_OCTAVE: f64 = 8.0;

/// The concentration below which a peak is nearly uniform.
const LEAST_CONCENTRATION: f64 = 0.05;

/// Width of a peak, rad, from which on its nodes serve the uniform part as well.
const WIDE: f64 = 0.25;

impl Rings {
    /// Rings for `phase` of about `count` azimuths.
    ///
    /// The uniform part takes evenly spaced nodes, exact for trigonometric polynomials, unless the
    /// peak is so wide that its nodes serve both. The peak takes nodes concentrated by the map of the
    /// wrapped Cauchy, so that any concentration is resolved by the same number of nodes. Of a narrow
    /// wrapped Cauchy itself, the tails are all that a yarn reflects forward: they have as many.
    pub(crate) fn new(phase: &Phase, count: usize) -> Self {
        let uniform = |share: f64| {
            (share > 0.0).then(|| Ring::new(even(count).map(|a| (a, share / count as f64))))
        };
        let mut spatial = None;
        let fixed = match *phase {
            Phase::VonMises { alpha, beta } => {
                let width = von_mises_width(beta);
                let is_wide = width >= WIDE;
                let raw: Vec<(f64, f64, f64)> = concentrated(width, count)
                    .map(|(angle, from_peak, slope)| {
                        (angle, (-beta * from_peak).exp() * slope, slope)
                    })
                    .collect();
                let sum: f64 = raw.iter().map(|&(_, peak, _)| peak).sum();
                let even = if is_wide { alpha / count as f64 } else { 0.0 };
                let peak = Ring::new(raw.into_iter().map(|(angle, peak, slope)| {
                    (PI + angle, (1.0 - alpha) * peak / sum + even * slope)
                }));
                core::iter::once(peak).chain(uniform(alpha).filter(|_| !is_wide)).collect()
            }
            Phase::VonMises3d { alpha, beta } => {
                spatial = Some(Spatial::new(beta, count));
                uniform(2.0 * PI * alpha).into_iter().collect()
            }
            Phase::WrappedCauchy { rho, is_backward } => {
                let peak = if is_backward { 0.0 } else { PI };
                let width = cauchy_width(rho);
                let nodes = if width < WIDE {
                    with_tails(width, count)
                } else {
                    let weight = 1.0 / count as f64;
                    concentrated(width, count).map(|(angle, ..)| (angle, weight)).collect()
                };
                vec![Ring::new(nodes.into_iter().map(|(angle, weight)| (peak + angle, weight)))]
            }
            Phase::Tabulated(ref table) => vec![Ring::of_table(table, count)],
        };
        Self { fixed, spatial }
    }

    /// The integral for directions whose parts across the fibre have the product `c_sq`, and for
    /// which 1 + wi·wo is `from_cone` straight on, 0 on the specular cone.
    ///
    /// The phase function integrates to 1, but for [`Phase::VonMises3d`].
    pub(crate) fn integral(&self, turn: &Turn, c_sq: f64, from_cone: f64) -> f64 {
        let mut sum = 0.0;
        self.visit(c_sq, from_cone, |ring, weight| sum += weight * ring.sum(turn));
        sum * turn.q
    }

    /// Calls `visit` for the rings of a cone and how much each counts.
    fn visit(&self, c_sq: f64, from_cone: f64, mut visit: impl FnMut(&Ring, f64)) {
        for ring in &self.fixed {
            visit(ring, 1.0);
        }
        if let Some(spatial) = &self.spatial {
            let height = (-spatial.beta * from_cone).exp();
            let (level, share) = spatial.level(c_sq);
            visit(&spatial.levels[level], height * (1.0 - share));
            visit(&spatial.levels[level + 1], height * share);
        }
    }
}

impl Spatial {
    fn new(beta: f64, count: usize) -> Self {
        let height = 1.0 / (count as f64 * pxfm::f_i0e(beta));
        let octaves = (beta / LEAST_CONCENTRATION).max(1.0).log2();
        let last = (octaves * LEVELS_PER_OCTAVE).ceil() as u32;
        let concentrations =
            (0..=last).map(|k| beta * (-f64::from(k) / LEVELS_PER_OCTAVE).exp2()).chain([0.0]);
        let levels = concentrations.map(|b| {
            Ring::new(concentrated(von_mises_width(b), count).map(|(angle, from_peak, slope)| {
                (PI + angle, height * slope * (-b * from_peak).exp())
            }))
        });
        Self { beta, levels: levels.collect() }
    }

    /// The level before the concentration β c², and the share of the next.
    fn level(&self, c_sq: f64) -> (usize, f64) {
        let last = self.levels.len() - 2;
        let position = -c_sq.clamp(f64::MIN_POSITIVE, 1.0).log2() * LEVELS_PER_OCTAVE;
        if position < last as f64 {
            (position as usize, position.fract())
        } else {
            // From the least concentration to 0 in even steps.
            let least = (-(last as f64) / LEVELS_PER_OCTAVE).exp2();
            (last, 1.0 - c_sq / least)
        }
    }
}

impl Ring {
    /// Of azimuths Δφ (rad) and weights.
    fn new(nodes: impl Iterator<Item = (f64, f64)>) -> Self {
        let nodes: Vec<(f64, f64)> = nodes.collect();
        let total: f64 = nodes.iter().map(|&(_, weight)| weight).sum();
        let mut ring = Self { from_forward: vec![], sin: vec![], weight: vec![], reach: [0.0; 2] };
        for (angle, weight) in nodes {
            let half = (0.5 * angle).cos();
            let (from_forward, sin) = (2.0 * half * half, angle.sin());
            ring.from_forward.push(from_forward as f32);
            ring.sin.push(sin as f32);
            ring.weight.push(weight as f32);
            if weight > 1e-9 * total {
                let [c, s] = &mut ring.reach;
                (*c, *s) = (c.max(from_forward), s.max(sin.abs()));
            }
        }
        let count = ring.weight.len().next_multiple_of(LANES);
        for list in [&mut ring.from_forward, &mut ring.sin, &mut ring.weight] {
            list.resize(count, 0.0);
        }
        ring
    }

    /// The parts into which equal shares of a table and equal angles cut either half of the circle,
    /// each in its middle.
    fn of_table(table: &PhaseTable, count: usize) -> Self {
        let half = count.div_ceil(2);
        let cut = |k: usize| k as f64 / half as f64;
        let mut cuts: Vec<f64> =
            (0..half).flat_map(|k| [cut(k), table.share_below(PI * cut(k))]).chain([1.0]).collect();
        cuts.sort_by(f64::total_cmp);
        Self::new(cuts.windows(2).filter(|pair| pair[1] > pair[0]).flat_map(|pair| {
            let (angle, weight) = (table.inverse(0.5 * (pair[0] + pair[1])), pair[1] - pair[0]);
            [(angle, 0.5 * weight), (-angle, 0.5 * weight)]
        }))
    }

    /// `Σ weight · p cos θi / (p + q)`.
    fn sum(&self, turn: &Turn) -> f64 {
        // Most of what a sharp forward peak could reach is below one of the surfaces.
        let most = |[at, c, s]: [f64; 3]| at + self.reach[0] * c.max(0.0) + self.reach[1] * s.abs();
        if most(turn.p) <= 0.0 || most(turn.z) <= 0.0 {
            return 0.0;
        }
        let single = |list: [f64; 3]| list.map(|x| x as f32);
        let (p, z) = (single(turn.p), single(turn.z));
        // Above 0, since 0/0 would follow where p is 0 too.
        let q = (turn.q as f32).max(f32::MIN_POSITIVE);
        let mut sums = [0.0f32; LANES];
        let lists = self.from_forward.chunks_exact(LANES).zip(self.sin.chunks_exact(LANES));
        for ((c, s), weight) in lists.zip(self.weight.chunks_exact(LANES)) {
            for lane in 0..LANES {
                let positive = |x: f32| if x > 0.0 { x } else { 0.0 };
                let p = positive(p[0] + c[lane] * p[1] + s[lane] * p[2]);
                let z = positive(z[0] + c[lane] * z[1] + s[lane] * z[2]);
                sums[lane] += weight[lane] * z * p / (p + q);
            }
        }
        sums.iter().sum::<f32>().into()
    }
}

/// `count` angles in (−π, π), evenly spaced.
fn even(count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |j| 2.0 * PI * (j as f64 + 0.5) / count as f64 - PI)
}

/// The `count` angles δ = 2 atan(k tan(τ/2)) for even τ, with 1 − cos δ and dδ/dτ.
fn concentrated(k: f64, count: usize) -> impl Iterator<Item = (f64, f64, f64)> {
    even(count).map(move |tau| {
        let t = (0.5 * tau).tan();
        let kt_sq = (k * t) * (k * t);
        let from_peak = 2.0 * kt_sq / (1.0 + kt_sq);
        (2.0 * (k * t).atan(), from_peak, k * (1.0 + t * t) / (1.0 + kt_sq))
    })
}

/// Angles and weights of a wrapped Cauchy of the half width `k`, even in the logarithm of the angle
/// beyond k: tan(δ/2) = k sinh τ for even τ, whose density is 1/(π cosh τ), and the rest at π.
fn with_tails(k: f64, count: usize) -> Vec<(f64, f64)> {
    /// tan(δ/2) up to where the tails go.
    const REACH: f64 = 30.0;
    let end = (REACH / k).asinh();
    // As close as those of a wide peak.
    let n = (count as f64 * end / 5.0).ceil();
    let step = 2.0 * end / n;
    let taus = (0..n as usize).map(|j| (j as f64 + 0.5) * step - end);
    let mut nodes: Vec<(f64, f64)> =
        taus.map(|tau| (2.0 * (k * tau.sinh()).atan(), step / (PI * tau.cosh()))).collect();
    let sum: f64 = nodes.iter().map(|&(_, weight)| weight).sum();
    nodes.push((PI, 1.0 - sum));
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vector;
    use crate::phase::Azimuth;

    fn phases() -> Vec<Phase> {
        let table = PhaseTable::new(&[0.3, 0.1, 0.05, 0.0, 0.2, 0.9, 1.5]).unwrap();
        let mut list = vec![Phase::Tabulated(table)];
        for (alpha, beta) in [(0.0, 0.0), (0.05, 4.0), (0.5, 60.0), (0.1, 2000.0), (1.0, 9.0)] {
            list.push(Phase::VonMises { alpha, beta });
            list.push(Phase::VonMises3d { alpha, beta });
        }
        for rho in [0.0, 0.4, 0.9, 0.999] {
            let cauchy = |is_backward| Phase::WrappedCauchy { rho, is_backward };
            list.extend([cauchy(true), cauchy(false)]);
        }
        list
    }

    /// The weighted sum over the nodes of g(Δφ).
    fn sum(rings: &Rings, c_sq: f64, from_cone: f64, g: impl Fn(f64) -> f64) -> f64 {
        let mut sum = 0.0;
        rings.visit(c_sq, from_cone, |ring, share| {
            for ((&c, &sin), &weight) in ring.from_forward.iter().zip(&ring.sin).zip(&ring.weight) {
                sum += share * f64::from(weight) * g(f64::from(sin).atan2(f64::from(c) - 1.0));
            }
        });
        sum
    }

    /// The integral of f_c g over the azimuths at which `wi` has the inclination a and `wo` b.
    fn integral(phase: &Phase, [a, b]: [f64; 2], g: impl Fn(f64) -> f64) -> f64 {
        let constants = phase.constants::<f64>();
        let n = 400_000;
        let t = Vector::new(0.0, 0.0, 1.0);
        let wo = Vector::new(b.cos(), 0.0, b.sin());
        let sum: f64 = (0..n)
            .map(|j| 2.0 * PI * (f64::from(j) + 0.5) / f64::from(n))
            .map(|phi| {
                let wi = Vector::new(a.cos() * phi.cos(), a.cos() * phi.sin(), a.sin());
                let parts = constants.eval(&Azimuth::about(t, wi, wo));
                (parts.peak + parts.uniform) * g(phi)
            })
            .sum();
        2.0 * PI * sum / f64::from(n)
    }

    #[test]
    fn rings_integrate_a_smooth_function_against_the_phase() {
        let g =
            |phi: f64| 1.0 + 0.5 * phi.cos() + 0.2 * (2.0 * phi).sin() + 0.1 * (3.0 * phi).cos();
        for phase in phases() {
            let rings = Rings::new(&phase, 48);
            for [a, b] in [[0.0f64, 0.0], [1.2, -1.2], [-0.4, 0.9], [1.5, -1.56]] {
                let expected = integral(&phase, [a, b], g);
                let (c_sq, s_sq) = (a.cos() * b.cos(), a.sin() * b.sin());
                let found = sum(&rings, c_sq, 1.0 + s_sq - c_sq, g);
                // A table has kinks.
                let tolerance = if let Phase::Tabulated(_) = phase { 4e-3 } else { 1e-3 };
                assert!(
                    (found - expected).abs() < tolerance * (1.0 + expected),
                    "{phase:?} at {a}, {b}: {found}, expected {expected} within {tolerance}"
                );
            }
        }
    }

    #[test]
    fn light_that_grazes_loses_no_digits() {
        // Straight on, a forward peak is just below the surface.
        let phase = Phase::VonMises { alpha: 0.0, beta: 1e6 };
        let rings = Rings::new(&phase, 48);
        for height in [1e-3, 1e-5] {
            let turn = Turn { p: [-height, height, 1.0], z: [-height, height, 1.0], q: height };
            let found = rings.integral(&turn, 1.0, 0.0);
            let constants = phase.constants::<f64>();
            let n = 2_000_000;
            let t = Vector::new(0.0, 0.0, 1.0);
            let sum: f64 = (0..n)
                .map(|j| 0.01 * ((f64::from(j) + 0.5) / f64::from(n) - 0.5))
                .map(|delta| {
                    let wi = Vector::new(-delta.cos(), -delta.sin(), 0.0);
                    let azimuth = Azimuth::on_cone(t, wi, Vector::new(1.0, 0.0, 0.0));
                    let half = (0.5 * delta).sin();
                    let p = (-height + 2.0 * half * half * height - delta.sin()).max(0.0);
                    constants.eval(&azimuth).peak * p * p / (p + height)
                })
                .sum();
            let expected = height * 0.01 * sum / f64::from(n);
            assert!(
                (found / expected - 1.0).abs() < 0.02,
                "{height}: {found}, expected {expected}"
            );
        }
    }
}
