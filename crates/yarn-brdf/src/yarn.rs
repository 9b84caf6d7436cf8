//! `Yarn`: the parameters of one type of yarn, and their ranges.

use crate::phase::Phase;

/// Greatest |ψ| at which a yarn is shaded as untwisted, rad.
///
/// The highlight of a twisted yarn narrows to a strip of width ψ and height 1/ψ; below this twist
/// (1.7°) the limit ψ = 0 is evaluated instead, which carries the same energy without the spike.
pub const FILAMENT_PSI: f64 = 0.03;

/// Least inclination at which an untwisted yarn is shaded, rad.
///
/// The highlight of a straight untwisted yarn is a delta in direction. No thread in a cloth is
/// straight to better than a few degrees, so u_max is raised to this value.
pub const FILAMENT_U_MAX: f64 = 0.05;

/// The parameters of one type of yarn (Nelson, McEvoy & Fratarcangeli 2016, section 4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yarn {
    /// Diffuse reflectance, linear RGB, each in [0, 1].
    pub color: [f32; 3],
    /// Colour and amount of the highlight, linear RGB, each in [0, 1].
    pub specular: [f32; 3],
    /// Greatest inclination of the yarn, u_max: rad, in [0, 1.5].
    pub u_max: f64,
    /// Twist of the fibres about the yarn, ψ: rad, in (−π/2, π/2]; the sign is S or Z, and
    /// 0 is a yarn of filaments.
    pub psi: f64,
    /// Half width of the drawn highlight as a fraction of the segment's half width (of its half
    /// length for filaments), δ: 1, in [0.001, 1].
    pub delta: f64,
    /// Scattering about the fibre.
    pub phase: Phase,
    /// Diameter over pitch: 1, in [0.01, 1]; below 1 the cloth has gaps.
    pub size: f64,
}

impl Default for Yarn {
    /// A grey, moderately twisted yarn that touches its neighbours (Nelson, McEvoy & Fratarcangeli
    /// 2016, the defaults of the authors' program).
    fn default() -> Self {
        Self {
            color: [0.3; 3],
            specular: [0.4; 3],
            u_max: 0.5,
            psi: 0.5,
            delta: 0.3,
            phase: Phase::default(),
            size: 1.0,
        }
    }
}

/// A parameter outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name}: {value}, expected {range}")]
pub struct ParamError {
    /// The parameter's name.
    pub name: &'static str,
    /// The value found.
    pub value: f64,
    /// The range allowed, in words.
    pub range: &'static str,
}

impl Yarn {
    /// Whether every parameter is in its range.
    ///
    /// # Errors
    ///
    /// The first parameter that is not; NaN is in no range.
    pub fn validate(&self) -> Result<(), ParamError> {
        fn check(
            name: &'static str,
            value: f64,
            range: &'static str,
            is_in: bool,
        ) -> Result<(), ParamError> {
            if is_in { Ok(()) } else { Err(ParamError { name, value, range }) }
        }
        let within = |value: f64, low: f64, high: f64| value >= low && value <= high;
        for &value in &self.color {
            check("color", value.into(), "0 to 1", within(value.into(), 0.0, 1.0))?;
        }
        for &value in &self.specular {
            check("specular", value.into(), "0 to 1", within(value.into(), 0.0, 1.0))?;
        }
        check("u_max", self.u_max, "0 to 1.5 rad", within(self.u_max, 0.0, 1.5))?;
        let half_pi = core::f64::consts::FRAC_PI_2;
        check(
            "psi",
            self.psi,
            "−π/2 to π/2 rad, without −π/2",
            self.psi > -half_pi && self.psi <= half_pi,
        )?;
        check("delta", self.delta, "0.001 to 1", within(self.delta, 1e-3, 1.0))?;
        check("size", self.size, "0.01 to 1", within(self.size, 0.01, 1.0))?;
        let Phase::VonMises { alpha, beta } = self.phase;
        check("alpha", alpha, "0 to 1", within(alpha, 0.0, 1.0))?;
        check("beta", beta, "0 to 200", within(beta, 0.0, 200.0))
    }

    /// Whether the yarn is shaded as untwisted: |ψ| ≤ [`FILAMENT_PSI`].
    pub fn is_filament(&self) -> bool {
        self.psi.abs() <= FILAMENT_PSI
    }

    /// The share of the light that meets fibres of the highlight: its greatest component.
    pub(crate) fn specular_amount(&self) -> f32 {
        self.specular.iter().copied().fold(0.0, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_yarn_is_valid() {
        assert_eq!(Yarn::default().validate(), Ok(()));
    }

    #[test]
    fn each_parameter_out_of_range_is_named() {
        let d = Yarn::default();
        let cases = [
            ("color", Yarn { color: [0.0, 1.1, 0.0], ..d }),
            ("specular", Yarn { specular: [-0.1, 0.0, 0.0], ..d }),
            ("u_max", Yarn { u_max: 1.6, ..d }),
            ("psi", Yarn { psi: -2.0, ..d }),
            ("delta", Yarn { delta: 0.0, ..d }),
            ("size", Yarn { size: f64::NAN, ..d }),
            ("alpha", Yarn { phase: Phase::VonMises { alpha: 2.0, beta: 1.0 }, ..d }),
            ("beta", Yarn { phase: Phase::VonMises { alpha: 0.0, beta: f64::INFINITY }, ..d }),
        ];
        for (name, yarn) in cases {
            assert_eq!(yarn.validate().map_err(|e| e.name), Err(name), "{yarn:?}");
        }
        let error = cases_error(&Yarn { delta: 0.0, ..d });
        assert_eq!(error, "delta: 0, expected 0.001 to 1");
    }

    fn cases_error(yarn: &Yarn) -> String {
        yarn.validate().unwrap_err().to_string()
    }
}
