//! Azimuths about a fibre, drawn nearly in proportion to its phase function, on the half of the circle
//! that the surface of the yarn faces.
//!
//! The normal n of the surface is perpendicular to the fibre, so that the directions about the fibre
//! with n·wi > 0 are those within a right angle of n, whatever their inclination. Drawing from that
//! half alone matters: most of a forward peak passes into the yarn.

use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, SQRT_2};

use crate::phase::{Azimuth, Phase, PhaseTable, cauchy_width};
use crate::real::Real;
use crate::segment::cosine;

/// Draws azimuths about a fibre: `even_share` of them evenly, the others about the peak.
#[derive(Clone, Debug)]
pub(crate) struct AzimuthSampler {
    even_share: f64,
    peak: Peak,
}

#[derive(Clone, Debug)]
enum Peak {
    Cauchy {
        width: f64,
        is_backward: bool,
    },
    /// A von Mises peak by the angle between the directions: by the azimuth its concentration is
    /// `beta` times the product of the sines of both inclinations.
    Spatial {
        beta: f64,
    },
    Tabulated(PhaseTable),
}

/// How a surface lies about a fibre in it, as seen from `wo`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing<R> {
    /// Cosine of the azimuth from `wo` to the normal, in [0, 1].
    pub(crate) cos: R,
    /// Product of the sines of the angles from the fibre to `wi` and `wo`.
    pub(crate) sines: R,
}

impl<R: Real> Facing<R> {
    /// Of a surface on which `wo` has the cosine `q` > 0, at the sines `si` and `so` of the
    /// inclinations `t·wi` and `t·wo`.
    #[inline(always)]
    pub(crate) fn new(q: R, si: R, so: R) -> Self {
        let (ri, ro) = (cosine(si), cosine(so));
        let cos = (q / ro.max(q.of(f32::MIN_POSITIVE.into()))).min(q.one());
        Self { cos, sines: ri * ro }
    }
}

impl AzimuthSampler {
    /// For `phase`.
    pub(crate) fn new(phase: &Phase) -> Self {
        let (even_share, peak) = match *phase {
            Phase::VonMises { alpha, beta } => {
                (alpha, Peak::Cauchy { width: bounding_width(beta), is_backward: false })
            }
            // Its uniform part has the density α all around.
            Phase::VonMises3d { alpha, beta } => {
                let uniform = 2.0 * PI * alpha;
                (uniform / (1.0 + uniform), Peak::Spatial { beta })
            }
            Phase::WrappedCauchy { rho, is_backward } => {
                (0.0, Peak::Cauchy { width: cauchy_width(rho), is_backward })
            }
            Phase::Tabulated(ref table) => (0.0, Peak::Tabulated(table.clone())),
        };
        Self { even_share, peak }
    }

    /// The shares of the even part and of the peak that lie on the half of the circle.
    #[inline(always)]
    fn shares<R: Real>(&self, facing: Facing<R>) -> [R; 2] {
        let cos = facing.cos;
        let peak = match self.peak.kind(facing) {
            Kind::Cauchy { width, is_backward } => {
                cauchy_share(width, if is_backward { cos } else { -cos })
            }
            Kind::Tabulated(table) => {
                let [near, far] = table_shares(table, cos);
                near + far
            }
        };
        [cos.of(0.5 * self.even_share), peak * cos.of(1.0 - self.even_share)]
    }

    /// (cos Δφ, sin Δφ) for `xi` in [0, 1); `sin` is the sine of the azimuth whose cosine is in
    /// `facing`.
    #[inline(always)]
    pub(crate) fn sample<R: Real>(&self, xi: R, facing: Facing<R>, sin: R) -> (R, R) {
        let [even, peak] = self.shares(facing);
        let place = xi * (even + peak);
        let rest = (place - even) / xi.of(1.0 - self.even_share);
        let (cos_peak, sin_peak) = self.about_peak(rest, facing, sin);
        let is_even = place.lt(even);
        if !R::any(is_even) {
            return (cos_peak, sin_peak);
        }
        // From the normal on.
        let (s, c) = ((place / even - xi.of(0.5)) * xi.of(PI)).sin_cos();
        let (cos_even, sin_even) = (c * facing.cos - s * sin, s * facing.cos + c * sin);
        (R::select(is_even, cos_even, cos_peak), R::select(is_even, sin_even, sin_peak))
    }

    /// The same for a place `xi` in the share of the peak.
    #[inline(always)]
    fn about_peak<R: Real>(&self, xi: R, facing: Facing<R>, sin: R) -> (R, R) {
        match self.peak.kind(facing) {
            Kind::Cauchy { width, is_backward } => {
                let sign = if is_backward { xi.one() } else { -xi.one() };
                let (cos, sin) = (sign * facing.cos, sign * sin);
                // tan(Δφ/2) = k tan(τ/2) about the peak, τ even; from a right angle before the normal.
                let half = (-cos).atan2(width * (sin + xi.one())) + xi * xi.of(PI);
                let (s, c) = half.sin_cos();
                let s = width * s;
                let scale = sign / (s * s + c * c);
                ((c * c - s * s) * scale, (s + s) * c * scale)
            }
            Kind::Tabulated(table) => {
                let [near, _] = table_shares(table, facing.cos);
                let is_near = xi.lt(near);
                let share = R::select(is_near, xi, xi - near);
                let angle = (share + share).map(|share| table.inverse(share));
                let (s, c) = angle.sin_cos();
                (c, R::select(is_near, s, -s) * xi.one().copysign(sin))
            }
        }
    }

    /// The density of [`AzimuthSampler::sample`] on its half of the circle, rad⁻¹.
    #[inline(always)]
    pub(crate) fn density<R: Real>(&self, azimuth: &Azimuth<R>, facing: Facing<R>) -> R {
        let peak = match self.peak.kind(facing) {
            Kind::Cauchy { width, is_backward } => {
                // With ρ = (1 − k)/(1 + k): k / (π (k² (1 + cos) + (1 − cos))) about the peak.
                let gaps = [azimuth.forward_gap, azimuth.backward_gap];
                let (from_peak, beyond) =
                    if is_backward { (gaps[1], gaps[0]) } else { (gaps[0], gaps[1]) };
                width / ((width * width * beyond + from_peak) * width.of(PI))
            }
            Kind::Tabulated(table) => table.about(azimuth),
        };
        let [even_share, peak_share] = self.shares(facing);
        let density = peak * peak.of(1.0 - self.even_share) + peak.of(self.even_share / (2.0 * PI));
        // A table may have nothing there.
        density / (even_share + peak_share).max(peak.of(f32::MIN_POSITIVE.into()))
    }
}

/// A [`Peak`] for given inclinations.
enum Kind<'a, R> {
    Cauchy { width: R, is_backward: bool },
    Tabulated(&'a PhaseTable),
}

impl Peak {
    #[inline(always)]
    fn kind<R: Real>(&self, facing: Facing<R>) -> Kind<'_, R> {
        match *self {
            Self::Cauchy { width, is_backward } => {
                Kind::Cauchy { width: facing.cos.of(width), is_backward }
            }
            Self::Spatial { beta } => {
                let width = bounding_width(facing.sines * facing.sines.of(beta));
                Kind::Cauchy { width, is_backward: false }
            }
            Self::Tabulated(ref table) => Kind::Tabulated(table),
        }
    }
}

/// Half width of the wrapped Cauchy that bounds a von Mises peak best, rad (Best & Fisher 1979): their
/// ratio is at most 1.52 at any concentration.
///
/// Theirs is ρ = (s² − s√2)/2β with s² = 1 + √(1 + 4β²); that is 2β/(s (s + √2)), of which no digits
/// cancel, and (1 − ρ)/(1 + ρ) = 2√2/((s + √2)(1 + ρ)²).
#[inline(always)]
fn bounding_width<R: Real>(beta: R) -> R {
    let one = beta.one();
    let s = (one + (one + beta * beta * beta.of(4.0)).sqrt()).sqrt();
    let sum = s + beta.of(SQRT_2);
    let beyond = one + (beta + beta) / (s * sum);
    beta.of(2.0 * SQRT_2) / (sum * beyond * beyond)
}

/// The share of a wrapped Cauchy of half width `k` that lies within a right angle of the azimuth with
/// the cosine `cos` from its peak: of its distribution ½ + atan(tan(Δφ/2)/k)/π, the difference between
/// two places half a turn apart, by the tangent of a difference.
#[inline(always)]
fn cauchy_share<R: Real>(k: R, cos: R) -> R {
    let one = k.one();
    (k + k).atan2(-((one - k) * (one + k) * cos)) * k.of(FRAC_1_PI)
}

/// The shares of a table on either side of |Δφ| = 0, as far as they lie within a right angle of the
/// azimuth with the cosine `cos`.
#[inline(always)]
fn table_shares<R: Real>(table: &PhaseTable, cos: R) -> [R; 2] {
    let quarter = cos.of(FRAC_PI_2);
    let angle = quarter - cos.clamp_to(cos.zero(), cos.one()).asin();
    let half = cos.of(0.5);
    [table.share_below(quarter + angle) * half, table.share_below(quarter - angle) * half]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vector;

    /// The fibre.
    const T: Vector<f64> = Vector { x: 0.0, y: 0.0, z: 1.0 };

    fn phases() -> Vec<Phase> {
        let table = |samples: &[f64]| PhaseTable::new(samples).unwrap();
        let mut phases: Vec<Phase> = [0.0, 1e-5, 4.0, 200.0, 1e6]
            .into_iter()
            .flat_map(|beta| {
                [Phase::VonMises { alpha: 0.05, beta }, Phase::VonMises3d { alpha: 0.02, beta }]
            })
            .collect();
        phases.extend([0.0, 0.67, 0.999].into_iter().flat_map(|rho| {
            [false, true].map(|is_backward| Phase::WrappedCauchy { rho, is_backward })
        }));
        phases.push(Phase::Tabulated(table(&[1.0, 0.2, 3.0, 0.0, 0.0, 2.0])));
        phases.push(Phase::Tabulated(table(&[0.0, 1.0])));
        phases
    }

    /// The azimuth of a direction at right angles to the fibre with `phi` from `wo`.
    fn azimuth(phi: f64) -> Azimuth<f64> {
        let wi = Vector::new(phi.cos(), phi.sin(), 0.0);
        Azimuth::on_cone(T, wi, Vector::new(1.0, 0.0, 0.0))
    }

    #[test]
    fn azimuths_lie_on_the_half_circle_and_have_the_density_that_is_told() {
        for phase in phases() {
            let sampler = AzimuthSampler::new(&phase);
            for (normal, sines) in [(0.0, 1.0), (0.4, 0.3), (-1.2, 1.0), (1.569, 0.9)] {
                let facing = Facing { cos: f64::cos(normal), sines };
                // The means over the draws are integrals against the density.
                let moments = |phi: f64| {
                    let (sin, cos) = (phi - normal).sin_cos();
                    [1.0, sin, cos, sin * cos]
                };
                let mut drawn = [0.0; 4];
                let n = 20_000;
                for j in 0..n {
                    let xi = (f64::from(j) + 0.5) / f64::from(n);
                    let (cos, sin) = sampler.sample(xi, facing, normal.sin());
                    assert!((cos * cos + sin * sin - 1.0).abs() < 1e-12, "{phase:?} {xi}");
                    let from_normal = cos * normal.cos() + sin * normal.sin();
                    assert!(from_normal > -1e-6, "{phase:?} {normal} {xi}: {from_normal}");
                    let moments = moments(sin.atan2(cos));
                    drawn = core::array::from_fn(|k| drawn[k] + moments[k] / f64::from(n));
                }
                let mut told = [0.0; 4];
                let n = 200_000;
                let step = PI / f64::from(n);
                for j in 0..n {
                    let phi = normal - FRAC_PI_2 + (f64::from(j) + 0.5) * step;
                    let density = step * sampler.density(&azimuth(phi), facing);
                    let moments = moments(phi);
                    told = core::array::from_fn(|k| told[k] + moments[k] * density);
                }
                for (drawn, told) in drawn.into_iter().zip(told) {
                    assert!(
                        (drawn - told).abs() < 1e-3,
                        "{phase:?} normal {normal} sines {sines}: {drawn}, told {told}"
                    );
                }
            }
        }
    }

    #[test]
    fn whole_density_is_near_the_von_mises_peak() {
        for beta in [0.0, 1e-6, 0.5, 4.0, 200.0, 1e6] {
            let phase = Phase::VonMises { alpha: 0.0, beta };
            let (constants, sampler) = (phase.constants::<f64>(), AzimuthSampler::new(&phase));
            for normal in [0.0, 1.0, 1.5] {
                let facing = Facing { cos: f64::cos(normal), sines: 1.0 };
                for k in 0..2000 {
                    let azimuth = azimuth(PI - PI * (f64::from(k) / 2000.0).powi(3));
                    let ratio = constants.eval(&azimuth).peak / sampler.density(&azimuth, facing);
                    assert!(ratio < 1.53, "{beta} at {k}: {ratio}");
                }
            }
        }
    }
}
