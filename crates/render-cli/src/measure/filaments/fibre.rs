//! What one fibre does with light, written down once more from the papers and not taken from the
//! shader that is to be measured.

use core::f64::consts::TAU;

use glam::DVec3;

/// A rough fibre with a forward von Mises peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fibre {
    /// Standard deviation σ of the blur along the fibre, rad.
    pub sigma: f64,
    /// Share α of light that leaves evenly about the fibre.
    pub alpha: f64,
    /// Concentration β of the rest about straight on.
    pub beta: f64,
}

impl Fibre {
    /// The share of light from `wi` that a fibre along `tangent` sends to `wo`, sr⁻¹: of all that it
    /// takes from the one it sends as much somewhere.
    ///
    /// ```text
    /// M(t·wi, t·wo) f_c(Δφ)        ∫ M f_c dwi = 1
    /// ```
    ///
    /// with M of d'Eon et al. 2011, equation 7, and f_c of Irawan & Marschner 2012, equation 6, about
    /// the fibre.
    pub fn scatter(&self, tangent: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        let (si, so) = (tangent.dot(wi), tangent.dot(wo));
        let (ai, ao) = (wi - tangent * si, wo - tangent * so);
        let (ci, co) = (ai.length(), ao.length());
        let variance = self.sigma * self.sigma;
        // exp and I₀ in one, as either is beyond all numbers alone.
        let exponent = (ci * co - si * so - 1.0) / variance;
        let along = exponent.exp() * pxfm::f_i0e(ci * co / variance)
            / (variance * -(-2.0 / variance).exp_m1());
        let cos_azimuth = if ci * co > 0.0 { ai.dot(ao) / (ci * co) } else { -1.0 };
        let peak = (-self.beta * (1.0 + cos_azimuth)).exp() / (TAU * pxfm::f_i0e(self.beta));
        along * (self.alpha / TAU + (1.0 - self.alpha) * peak)
    }
}

/// The share of what the fibres of a half space with this normal scatter once that gets in and out
/// again (Seeliger; Irawan & Marschner 2012, equation 7): p/(p + q) with p = n·wi and q = n·wo; 0 from
/// below.
pub fn seeliger(normal: DVec3, wi: DVec3, wo: DVec3) -> f64 {
    let (p, q) = (normal.dot(wi), normal.dot(wo));
    if p > 0.0 && q > 0.0 { p / (p + q) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use super::*;

    #[test]
    fn fibre_sends_on_all_that_it_takes() {
        let wo = DVec3::new(0.3, 0.4, 0.75f64.sqrt());
        for (sigma, beta) in [(0.1, 4.0), (0.4, 0.0), (1.0, 10.0)] {
            let fibre = Fibre { sigma, alpha: 0.05, beta };
            let n = 400;
            let mut sum = 0.0;
            for i in 0..n {
                for j in 0..n {
                    let z = 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
                    let phi = TAU * (f64::from(j) + 0.5) / f64::from(n);
                    let c = (1.0 - z * z).sqrt();
                    let wi = DVec3::new(c * phi.cos(), c * phi.sin(), z);
                    sum += fibre.scatter(DVec3::Z, wi, wo);
                }
            }
            let found = sum * 4.0 * PI / f64::from(n * n);
            assert!((found - 1.0).abs() < 2e-3, "{fibre:?}: {found}");
        }
    }
}
