//! Phase functions: how light turns about a fibre.

use core::f64::consts::PI;

use crate::frame::Vector;
use crate::real::Real;

/// How the light that a fibre scatters spreads over the azimuth of the specular cone.
///
/// Each is a density over the azimuth difference Δφ of `wi` and `wo` about the fibre: its integral
/// over the cone is 1 at every inclination.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Phase {
    /// A uniform part and a forward von Mises peak (Irawan & Marschner 2012, equation 6):
    ///
    /// ```text
    /// f_c = α/2π + (1 − α) exp(−β cos Δφ) / (2π I₀(β))
    /// ```
    ///
    /// Departs from the paper in the argument: the azimuth difference instead of the angle between
    /// the directions, whose integral over an inclined cone is not 1 (up to 4.8 at β = 4).
    VonMises {
        /// Share of the uniform part, 1, in [0, 1].
        alpha: f64,
        /// Concentration of the forward peak, 1, in [0, 200].
        beta: f64,
    },
}

impl Default for Phase {
    /// Von Mises with α = 0.05 and β = 4 (Nelson, McEvoy & Fratarcangeli 2016, defaults).
    fn default() -> Self {
        Phase::VonMises { alpha: 0.05, beta: 4.0 }
    }
}

/// The constants of a [`Phase`], ready for evaluation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhaseConstants<R> {
    /// α/2π, sr⁻¹ on the cone.
    uniform: R,
    /// (1 − α)/(2π e^{−β} I₀(β)): the height of the peak.
    peak: R,
    beta: R,
}

impl Phase {
    /// The constants in precision `R`.
    pub(crate) fn constants<R: Real>(self) -> PhaseConstants<R> {
        let Phase::VonMises { alpha, beta } = self;
        PhaseConstants {
            uniform: R::from_f64(alpha / (2.0 * PI)),
            // The scaled Bessel function e^{−β} I₀(β) stays finite where I₀ itself overflows.
            peak: R::from_f64((1.0 - alpha) / (2.0 * PI * pxfm::f_i0e(beta))),
            beta: R::from_f64(beta),
        }
    }

    /// How fast the phase function changes: 1 over the width of its peak, rad⁻¹, at least 1.
    pub(crate) fn sharpness(self) -> f64 {
        let Phase::VonMises { beta, .. } = self;
        (1.0 + beta).sqrt()
    }

    /// Nodes (cos Δφ, sin Δφ) and weights for integrals over the cone: `Σ weight·g ≈ ∫ f_c g dΔφ`,
    /// with weights that sum to 1.
    ///
    /// The uniform part takes evenly spaced nodes, exact for trigonometric polynomials. The peak
    /// takes nodes concentrated by the wrapped Cauchy map `Δφ = π + 2 atan(k tan(τ/2))`, with k as
    /// wide as the peak, so that any β is resolved by the same number of nodes.
    pub(crate) fn nodes(self, count: usize) -> Vec<AzimuthNode> {
        let Phase::VonMises { alpha, beta } = self;
        let even =
            |count: usize| (0..count).map(move |j| 2.0 * PI * (j as f64 + 0.5) / count as f64 - PI);
        let mut nodes = Vec::with_capacity(2 * count);
        if alpha > 0.0 {
            nodes.extend(even(count).map(|angle| AzimuthNode::new(angle, alpha / count as f64)));
        }
        if alpha < 1.0 {
            let k = 1.0 / self.sharpness();
            // With t = tan(τ/2): dφ/dτ = k (1 + t²)/(1 + k² t²) and the distance from the peak is
            // 2 atan(k t), so 1 − cos = 2 (k t)²/(1 + (k t)²), free of cancellation.
            let raw: Vec<(f64, f64)> = even(count)
                .map(|tau| {
                    let t = (0.5 * tau).tan();
                    let kt_sq = (k * t) * (k * t);
                    let density = (-beta * 2.0 * kt_sq / (1.0 + kt_sq)).exp();
                    (PI + 2.0 * (k * t).atan(), density * k * (1.0 + t * t) / (1.0 + kt_sq))
                })
                .collect();
            let sum: f64 = raw.iter().map(|&(_, weight)| weight).sum();
            nodes.extend(
                raw.iter()
                    .map(|&(angle, weight)| AzimuthNode::new(angle, (1.0 - alpha) * weight / sum)),
            );
        }
        nodes
    }
}

/// A node of [`Phase::nodes`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct AzimuthNode {
    pub(crate) cos: f64,
    pub(crate) sin: f64,
    pub(crate) weight: f64,
}

impl AzimuthNode {
    fn new(angle: f64, weight: f64) -> Self {
        Self { cos: angle.cos(), sin: angle.sin(), weight }
    }
}

impl<R: Real> PhaseConstants<R> {
    /// f_c for the directions `wi` and `wo` about the fibre tangent `t`, all unit, one frame.
    ///
    /// Where a direction lies along the fibre its azimuth is undefined; the value is then finite
    /// and arbitrary.
    #[inline]
    pub(crate) fn eval(&self, t: Vector<R>, wi: Vector<R>, wo: Vector<R>) -> R {
        let a = perpendicular(wi, t);
        let b = perpendicular(wo, t);
        // 1 + cos Δφ = |a + b|²/2 for unit a and b: no cancellation at the peak, a = −b.
        let sum = a.plus(b);
        let from_peak = sum.dot(sum) * R::from_f64(0.5);
        self.uniform + self.peak * (-(self.beta * from_peak)).exp()
    }
}

/// The unit vector of the part of `w` perpendicular to the unit vector `t`; 0 if there is none.
#[inline]
fn perpendicular<R: Real>(w: Vector<R>, t: Vector<R>) -> Vector<R> {
    let across = w.plus(t.times(-w.dot(t)));
    // The smallest square that is a normal number in f32.
    let length_sq = across.dot(across).max(R::from_f64(1e-37));
    across.times(R::one() / length_sq.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases() -> Vec<Phase> {
        let mut list = Vec::new();
        for alpha in [0.0, 0.05, 0.5, 1.0] {
            for beta in [0.0, 0.3, 4.0, 60.0, 2000.0] {
                list.push(Phase::VonMises { alpha, beta });
            }
        }
        list
    }

    #[test]
    fn phase_integrates_to_one_on_every_cone() {
        for phase in phases() {
            for inclination in [0.0f64, 0.7, 1.3] {
                let constants = phase.constants::<f64>();
                let t = Vector::new(0.0, 0.0, 1.0);
                let (s, c) = inclination.sin_cos();
                let wo = Vector::new(c, 0.0, -s);
                let n = 20_000;
                let sum: f64 = (0..n)
                    .map(|j| 2.0 * PI * (f64::from(j) + 0.5) / f64::from(n))
                    .map(|phi| constants.eval(t, Vector::new(c * phi.cos(), c * phi.sin(), s), wo))
                    .sum();
                let integral = sum * 2.0 * PI / f64::from(n);
                assert!((integral - 1.0).abs() < 1e-9, "{phase:?} at {inclination}: {integral}");
            }
        }
    }

    #[test]
    fn nodes_integrate_a_smooth_function_against_the_phase() {
        let g =
            |phi: f64| 1.0 + 0.5 * phi.cos() + 0.2 * (2.0 * phi).sin() + 0.1 * (3.0 * phi).cos();
        for phase in phases() {
            let constants = phase.constants::<f64>();
            let t = Vector::new(0.0, 0.0, 1.0);
            let wo = Vector::new(1.0, 0.0, 0.0);
            let n = 100_000;
            let expected: f64 = (0..n)
                .map(|j| 2.0 * PI * (f64::from(j) + 0.5) / f64::from(n))
                .map(|phi| g(phi) * constants.eval(t, Vector::new(phi.cos(), phi.sin(), 0.0), wo))
                .sum::<f64>()
                * 2.0
                * PI
                / f64::from(n);
            let found: f64 =
                phase.nodes(32).iter().map(|node| node.weight * g(node.sin.atan2(node.cos))).sum();
            assert!((found - expected).abs() < 2e-4, "{phase:?}: {found}, expected {expected}");
        }
    }

    #[test]
    fn phase_is_finite_at_any_concentration() {
        for beta in [0.0, 1e3, 1e6] {
            let phase = Phase::VonMises { alpha: 0.0, beta }.constants::<f32>();
            let t = Vector::new(0.0, 1.0, 0.0);
            let forward = phase.eval(t, Vector::new(1.0, 0.0, 0.0), Vector::new(-1.0, 0.0, 0.0));
            let expected = (beta.max(0.5) / (2.0 * PI)).sqrt() as f32;
            assert!(forward.is_finite() && forward > 0.3 * expected, "{beta}: {forward}");
            let along = phase.eval(t, t, t);
            assert!(along.is_finite(), "{beta}: {along}");
        }
    }
}
