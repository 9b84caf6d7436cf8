//! Phase functions: how light turns about a fibre.

use core::f64::consts::PI;
use std::sync::Arc;

use crate::frame::Vector;
use crate::parameter::ParamError;
use crate::real::{Real, Scalar};

/// How the light that a fibre scatters spreads over the azimuth of the specular cone.
///
/// All but one are densities over the azimuth difference Δφ of `wi` and `wo` about the fibre: the
/// integral over the cone is 1 at every inclination.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(transform = crate::schema::add_ranges))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
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
        /// Concentration of the forward peak, 1, in [0, 10⁶].
        beta: f64,
    },
    /// The paper's own: forward, by the angle between the directions, with an additive constant
    /// (Nelson, McEvoy & Fratarcangeli 2016, section 4.3).
    ///
    /// ```text
    /// f_c = α + exp(−β wi·wo) / (2π I₀(β))
    /// ```
    ///
    /// Its integral over a cone is more than 1 where the cone is inclined, so that only the factor
    /// of equation 2 bounds its energy.
    #[cfg_attr(feature = "serde", serde(rename = "von_mises_3d"))]
    VonMises3d {
        /// The constant, sr⁻¹, in [0, 1].
        alpha: f64,
        /// Concentration of the forward peak, 1, in [0, 10⁶].
        beta: f64,
    },
    /// `f_c = (1 − ρ²) / (2π (1 − 2ρ cos(Δφ − φ₀) + ρ²))` with φ₀ = π forward or 0 backward.
    WrappedCauchy {
        /// Concentration of the peak, 1, in [0, 1]; shaded as 0.999 where it is above.
        rho: f64,
        /// Whether the peak is on the side of the light instead of beyond the fibre.
        #[cfg_attr(feature = "serde", serde(rename = "backward", default))]
        is_backward: bool,
    },
    /// Measured or drawn.
    Tabulated(
        #[cfg_attr(
            feature = "schema",
            schemars(
                with = "Vec<f64>",
                length(min = 2, max = PhaseTable::MAX_SAMPLES),
                inner(range(min = 0.0))
            )
        )]
        PhaseTable,
    ),
}

/// Even samples of a phase function over |Δφ|, linear between them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Vec<f64>", into = "Vec<f64>"))]
pub struct PhaseTable {
    /// Densities, rad⁻¹, whose integral over the whole circle is 1.
    density: Arc<[f32]>,
    /// Integral from 0 to each sample over half the circle, from 0 to 1.
    distribution: Arc<[f32]>,
}

/// Greatest ρ with which a wrapped Cauchy is shaded.
const RHO_MAX: f64 = 0.999;

impl PhaseTable {
    /// Greatest number of samples.
    pub const MAX_SAMPLES: usize = 4096;

    /// The phase function through `samples` at |Δφ| = 0 (back to the light) to π (straight on),
    /// evenly spaced, normalised to integrate to 1 over the circle.
    ///
    /// # Errors
    ///
    /// Fewer than 2 or more than [`PhaseTable::MAX_SAMPLES`] samples, one that is negative or not
    /// finite, or none above 0.
    pub fn new(samples: &[f64]) -> Result<Self, ParamError> {
        if !(2..=Self::MAX_SAMPLES).contains(&samples.len()) {
            let count = samples.len() as f64;
            return Err(ParamError::new("tabulated samples", count, 2.0, Self::MAX_SAMPLES as f64));
        }
        for &sample in samples {
            if !(0.0..=f64::MAX).contains(&sample) {
                return Err(ParamError::new("tabulated sample", sample, 0.0, f64::MAX));
            }
        }
        // By the greatest first, so that neither sum overflows.
        let greatest = samples.iter().copied().fold(0.0, f64::max);
        if greatest == 0.0 {
            return Err(ParamError::new(
                "greatest tabulated sample",
                0.0,
                f64::MIN_POSITIVE,
                f64::MAX,
            ));
        }
        let step = PI / (samples.len() - 1) as f64;
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for pair in samples.windows(2) {
            sum += 0.5 * step * (pair[0] / greatest + pair[1] / greatest);
            sums.push(sum);
        }
        Ok(Self {
            density: samples.iter().map(|&s| (s / greatest / (2.0 * sum)) as f32).collect(),
            distribution: sums.iter().map(|&s| (s / sum) as f32).collect(),
        })
    }

    /// Density at the angle `delta` in [0, π], rad⁻¹.
    #[inline(always)]
    fn at<R: Real>(&self, delta: R) -> R {
        let steps = (self.density.len() - 1) as f64;
        R::linear(&self.density, delta * delta.of(steps / PI))
    }

    /// Density for two directions about a fibre, rad⁻¹.
    #[inline(always)]
    pub(crate) fn about<R: Real>(&self, azimuth: &Azimuth<R>) -> R {
        // tan²(Δφ/2) = (1 − cos Δφ)/(1 + cos Δφ).
        let half = azimuth.backward_gap.sqrt().atan2(azimuth.forward_gap.sqrt());
        self.at(half + half)
    }

    /// The share of either half of the circle that lies below |Δφ| = `angle` in [0, π].
    #[inline(always)]
    pub(crate) fn share_below<R: Real>(&self, angle: R) -> R {
        let step = PI / (self.density.len() - 1) as f64;
        let position = angle * angle.of(1.0 / step);
        let ([low, high], share) = R::entries(&self.density, position);
        let ([below, _], _) = R::entries(&self.distribution, position);
        below + share * angle.of(step) * (low + low + (high - low) * share)
    }

    /// The |Δφ| below which lies the share `xi` in [0, 1) of either half of the circle.
    pub(crate) fn inverse(&self, xi: f64) -> f64 {
        let above = self.distribution.partition_point(|&share| f64::from(share) <= xi);
        let index = above.clamp(1, self.density.len() - 1) - 1;
        let step = PI / (self.density.len() - 1) as f64;
        let (low, high) = (f64::from(self.density[index]), f64::from(self.density[index + 1]));
        // Within the step the share is a quadratic; its root in a form that does not cancel.
        let rest = 0.5 * (xi - f64::from(self.distribution[index])).max(0.0);
        let slope = (high - low) / step;
        let root = low + (low * low + 2.0 * slope * rest).max(0.0).sqrt();
        let within = if root > 0.0 { 2.0 * rest / root } else { 0.0 };
        index as f64 * step + within.min(step)
    }
}

impl TryFrom<Vec<f64>> for PhaseTable {
    type Error = ParamError;

    fn try_from(samples: Vec<f64>) -> Result<Self, ParamError> {
        Self::new(&samples)
    }
}

impl From<PhaseTable> for Vec<f64> {
    fn from(table: PhaseTable) -> Self {
        table.density.iter().map(|&density| density.into()).collect()
    }
}

impl Default for Phase {
    /// Von Mises with α = 0.05 and β = 4 (Nelson, McEvoy & Fratarcangeli 2016, defaults).
    fn default() -> Self {
        Phase::VonMises { alpha: 0.05, beta: 4.0 }
    }
}

/// The constants of a [`Phase`], ready for evaluation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhaseConstants<R> {
    /// The uniform part, rad⁻¹ on the cone.
    uniform: R,
    peak: Peak<R>,
}

/// The part of a phase function that has a direction.
#[derive(Clone, Debug, PartialEq)]
enum Peak<R> {
    /// `height · exp(−β (1 + cos Δφ))`.
    VonMises { height: R, beta: R },
    /// `height · exp(−β (1 + wi·wo))`.
    VonMises3d { height: R, beta: R },
    /// `height / ((1 − ρ)² + 2ρ (1 ± cos Δφ))`.
    WrappedCauchy { height: R, tail_sq: R, two_rho: R, is_backward: bool },
    /// A table over Δφ.
    Tabulated(PhaseTable),
}

/// Both parts of a phase function, which may differ in colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts<R> {
    pub(crate) peak: R,
    pub(crate) uniform: R,
}

impl<R: Real> Parts<R> {
    /// Nothing, in as many lanes as `like`.
    #[inline(always)]
    pub(crate) fn none(like: R) -> Self {
        Self { peak: like.zero(), uniform: like.zero() }
    }

    /// Both times `factor` where `mask` holds; 0 where it does not, whatever the numbers.
    #[inline(always)]
    pub(crate) fn scaled(self, factor: R, mask: R::Mask) -> Self {
        let zero = factor.zero();
        let peak = R::select(mask, self.peak * factor, zero);
        Self { peak, uniform: R::select(mask, self.uniform * factor, zero) }
    }
}

/// Where two directions are about a fibre, in terms that lose no digits at either peak.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Azimuth<R> {
    /// 1 + cos Δφ.
    pub(crate) forward_gap: R,
    /// 1 − cos Δφ.
    pub(crate) backward_gap: R,
    /// 1 + wi·wo.
    opposite_gap: R,
}

impl Phase {
    /// The constants in precision `R`.
    pub(crate) fn constants<R: Scalar>(&self) -> PhaseConstants<R> {
        // The scaled Bessel function e^{−β} I₀(β) stays finite where I₀ itself overflows.
        let height = |share: f64, beta: f64| R::from_f64(share / (2.0 * PI * pxfm::f_i0e(beta)));
        let (uniform, peak) = match *self {
            Phase::VonMises { alpha, beta } => {
                let beta_real = R::from_f64(beta);
                let height = height(1.0 - alpha, beta);
                (alpha / (2.0 * PI), Peak::VonMises { height, beta: beta_real })
            }
            Phase::VonMises3d { alpha, beta } => {
                let beta_real = R::from_f64(beta);
                (alpha, Peak::VonMises3d { height: height(1.0, beta), beta: beta_real })
            }
            Phase::WrappedCauchy { rho, is_backward } => {
                let rho = rho.min(RHO_MAX);
                let peak = Peak::WrappedCauchy {
                    height: R::from_f64((1.0 - rho) * (1.0 + rho) / (2.0 * PI)),
                    tail_sq: R::from_f64((1.0 - rho) * (1.0 - rho)),
                    two_rho: R::from_f64(2.0 * rho),
                    is_backward,
                };
                (0.0, peak)
            }
            Phase::Tabulated(ref table) => (0.0, Peak::Tabulated(table.clone())),
        };
        PhaseConstants { uniform: R::from_f64(uniform), peak }
    }

    /// Integral of the uniform part over the cone, 1.
    pub(crate) fn uniform_integral(&self) -> f64 {
        match *self {
            Phase::VonMises { alpha, .. } => alpha,
            Phase::VonMises3d { alpha, .. } => 2.0 * PI * alpha,
            Phase::WrappedCauchy { .. } | Phase::Tabulated(_) => 0.0,
        }
    }

    /// How fast the phase function changes: 1 over the width of its peak, rad⁻¹, at least 1.
    pub(crate) fn sharpness(&self) -> f64 {
        match *self {
            Phase::VonMises { beta, .. } | Phase::VonMises3d { beta, .. } => {
                1.0 / von_mises_width(beta)
            }
            Phase::WrappedCauchy { rho, .. } => 1.0 / cauchy_width(rho),
            // Half a step is the finest detail of a table.
            Phase::Tabulated(ref table) => (table.density.len() - 1) as f64 / PI,
        }
    }
}

/// Half width k of a wrapped Cauchy, rad: `tan(Δφ/2) = k tan(τ/2)` turns an even τ into its Δφ.
pub(crate) fn cauchy_width(rho: f64) -> f64 {
    let rho = rho.min(RHO_MAX);
    (1.0 - rho) / (1.0 + rho)
}

impl<T: Scalar> PhaseConstants<T> {
    /// f_c for two directions about a fibre, rad⁻¹.
    #[inline(always)]
    pub(crate) fn eval<R: Real<Scalar = T>>(&self, azimuth: &Azimuth<R>) -> Parts<R> {
        let peak = match &self.peak {
            Peak::VonMises { height, beta } => (-(azimuth.forward_gap * *beta)).exp() * *height,
            Peak::VonMises3d { height, beta } => (-(azimuth.opposite_gap * *beta)).exp() * *height,
            Peak::WrappedCauchy { height, tail_sq, two_rho, is_backward } => {
                let from_peak =
                    if *is_backward { azimuth.backward_gap } else { azimuth.forward_gap };
                from_peak.splat(*height) / (from_peak * *two_rho + *tail_sq)
            }
            Peak::Tabulated(table) => table.about(azimuth),
        };
        Parts { peak, uniform: peak.splat(self.uniform) }
    }
}

impl<R: Real> Azimuth<R> {
    /// Of two unit vectors that lie on the specular cone of the fibre tangent `t`, `t·wi = −t·wo`.
    ///
    /// There both are equally far from the fibre, so no root is taken: with a and b their parts across
    /// it, a + b = wi + wo, and `1 ± cos Δφ` are to each other as the squares of a + b and a − b.
    #[inline(always)]
    pub(crate) fn on_cone(t: Vector<R>, wi: Vector<R>, wo: Vector<R>) -> Self {
        let (sum, difference) = (wi.plus(wo), across(wi.minus(wo), t));
        Self::of_squares(sum.dot(sum), difference.dot(difference))
    }

    /// The same by their parts in the plane across the fibre.
    #[inline(always)]
    pub(crate) fn in_plane(a: [R; 2], b: [R; 2]) -> Self {
        let square = |x: R, y: R| x * x + y * y;
        Self::of_squares(square(a[0] + b[0], a[1] + b[1]), square(a[0] - b[0], a[1] - b[1]))
    }

    /// The same by the squares of sum and difference of those parts.
    #[inline(always)]
    fn of_squares(sum: R, difference: R) -> Self {
        let scale = sum.of(2.0) / (sum + difference).max(sum.of(1e-37));
        Self {
            forward_gap: sum * scale,
            backward_gap: difference * scale,
            opposite_gap: sum * sum.of(0.5),
        }
    }

    /// Of two unit vectors about the fibre tangent `t`. Where one lies along the fibre its azimuth
    /// is undefined; the values are then finite and arbitrary.
    #[inline(always)]
    pub(crate) fn about(t: Vector<R>, wi: Vector<R>, wo: Vector<R>) -> Self {
        let (a, b) = (unit_across(wi, t), unit_across(wo, t));
        let (sum, difference, whole) = (a.plus(b), a.minus(b), wi.plus(wo));
        let half = t.x.of(0.5);
        Self {
            forward_gap: sum.dot(sum) * half,
            backward_gap: difference.dot(difference) * half,
            opposite_gap: whole.dot(whole) * half,
        }
    }
}

/// The part of `w` perpendicular to the unit vector `t`.
#[inline(always)]
fn across<R: Real>(w: Vector<R>, t: Vector<R>) -> Vector<R> {
    w.plus(t.times(-w.dot(t)))
}

/// Its direction; 0 where there is none.
#[inline(always)]
fn unit_across<R: Real>(w: Vector<R>, t: Vector<R>) -> Vector<R> {
    let w = across(w, t);
    // The smallest square that is a normal number in f32.
    w.times(t.x.one() / w.dot(w).max(t.x.of(1e-37)).sqrt())
}

/// About the standard deviation of a von Mises peak, rad, at most 1.
pub(crate) fn von_mises_width(beta: f64) -> f64 {
    1.0 / (1.0 + beta).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> PhaseTable {
        PhaseTable::new(&[0.3, 0.1, 0.05, 0.0, 0.2, 0.9, 1.5]).unwrap()
    }

    fn phases() -> Vec<Phase> {
        let mut list = vec![Phase::Tabulated(table())];
        for alpha in [0.0, 0.05, 0.5, 1.0] {
            for beta in [0.0, 0.3, 4.0, 60.0, 2000.0] {
                list.push(Phase::VonMises { alpha, beta });
            }
        }
        for rho in [0.0, 0.4, 0.9] {
            list.extend([true, false].map(|is_backward| Phase::WrappedCauchy { rho, is_backward }));
        }
        list
    }

    const T: Vector<f64> = Vector { x: 0.0, y: 0.0, z: 1.0 };

    /// f_c at the azimuth difference `phi` on the cone of the given inclination.
    fn on_cone(constants: &PhaseConstants<f64>, inclination: f64, phi: f64) -> f64 {
        let (s, c) = inclination.sin_cos();
        let azimuth = Azimuth::on_cone(
            T,
            Vector::new(c * phi.cos(), c * phi.sin(), s),
            Vector::new(c, 0.0, -s),
        );
        let parts = constants.eval(&azimuth);
        parts.peak + parts.uniform
    }

    fn integral(f: impl Fn(f64) -> f64) -> f64 {
        let n = 100_000;
        let sum: f64 = (0..n).map(|j| f(2.0 * PI * (f64::from(j) + 0.5) / f64::from(n))).sum();
        sum * 2.0 * PI / f64::from(n)
    }

    #[test]
    fn phase_integrates_to_one_on_every_cone() {
        for phase in phases() {
            for inclination in [0.0f64, 0.7, 1.3] {
                let constants = phase.constants::<f64>();
                let integral = integral(|phi| on_cone(&constants, inclination, phi));
                // The table is held in f32 and has kinks.
                let tolerance = if let Phase::Tabulated(_) = phase { 1e-6 } else { 1e-9 };
                assert!(
                    (integral - 1.0).abs() < tolerance,
                    "{phase:?} at {inclination}: {integral}"
                );
            }
        }
    }

    #[test]
    fn phase_by_the_angle_between_directions_overcounts_inclined_cones() {
        let phase = Phase::VonMises3d { alpha: 0.0, beta: 4.0 };
        for (degrees, expected) in [(0.0f64, 1.0), (60.0, 2.25), (80.0, 4.30), (89.0, 4.83)] {
            let constants = phase.constants::<f64>();
            let found = integral(|phi| on_cone(&constants, degrees.to_radians(), phi));
            assert!((found - expected).abs() < 6e-3, "{degrees}: {found}, expected {expected}");
        }
    }

    #[test]
    fn phase_is_finite_at_any_concentration() {
        let t = Vector::new(0.0f32, 1.0, 0.0);
        for beta in [0.0, 1e3, 1e6] {
            let phase = Phase::VonMises { alpha: 0.0, beta }.constants::<f32>();
            let forward =
                Azimuth::about(t, Vector::new(1.0, 0.0, 0.0), Vector::new(-1.0, 0.0, 0.0));
            let expected = (beta.max(0.5) / (2.0 * PI)).sqrt() as f32;
            let found = phase.eval(&forward).peak;
            assert!(found.is_finite() && found > 0.3 * expected, "{beta}: {found}");
            for azimuth in [Azimuth::about(t, t, t), Azimuth::on_cone(t, t, t)] {
                assert!(phase.eval(&azimuth).peak.is_finite(), "{beta}");
            }
        }
        let delta = Phase::WrappedCauchy { rho: 1.0, is_backward: true }.constants::<f32>();
        let back = Azimuth::about(t, Vector::new(1.0, 0.0, 0.0), Vector::new(1.0, 0.0, 0.0));
        assert!((delta.eval(&back).peak - 318.2).abs() < 0.5);
    }

    #[test]
    fn table_of_samples_that_cannot_be_is_an_error() {
        for (samples, name) in [
            (&[1.0][..], "tabulated samples"),
            (&[1.0, -1.0], "tabulated sample"),
            (&[1.0, f64::NAN], "tabulated sample"),
            (&[0.0, 0.0], "greatest tabulated sample"),
        ] {
            assert_eq!(PhaseTable::new(samples).map_err(|e| e.name), Err(name), "{samples:?}");
        }
        assert!(PhaseTable::new(&[f64::MAX, f64::MAX, 1.0]).is_ok());
    }
}
