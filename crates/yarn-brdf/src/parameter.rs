//! The parameters of a yarn as data: names, units, ranges and defaults, for panels and checks.

use core::f64::consts::FRAC_PI_2;

use crate::phase::Phase;
use crate::yarn::{Highlight, Noise, Yarn};

/// A number of a [`Yarn`].
///
/// Colours are not among them: they are three numbers in [0, 1], and always there.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its name, as in files and errors.
    pub name: &'static str,
    /// What it is, in a few words.
    pub meaning: &'static str,
    /// Its unit; empty for a pure number.
    pub unit: &'static str,
    /// The least value allowed.
    pub low: f64,
    /// The greatest value allowed.
    pub high: f64,
    /// The value of a default yarn, or of a default highlight or phase function of the kind that
    /// has this parameter.
    pub default: f64,
    place: fn(&mut Yarn) -> Option<&mut f64>,
}

/// A parameter outside its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name}: {value}, expected {low} to {high}")]
pub struct ParamError {
    /// The parameter's name.
    pub name: &'static str,
    /// The value found.
    pub value: f64,
    /// The least value allowed.
    pub low: f64,
    /// The greatest value allowed.
    pub high: f64,
}

impl ParamError {
    pub(crate) fn new(name: &'static str, value: f64, low: f64, high: f64) -> Self {
        Self { name, value, low, high }
    }
}

impl Parameter {
    /// Its value in `yarn`; `None` where the yarn's highlight or phase function has none.
    pub fn of(&self, yarn: &Yarn) -> Option<f64> {
        (self.place)(&mut yarn.clone()).copied()
    }

    /// Whether `value` is in range; NaN is not.
    ///
    /// # Errors
    ///
    /// If it is not.
    pub fn check(&self, value: f64) -> Result<(), ParamError> {
        if (self.low..=self.high).contains(&value) {
            Ok(())
        } else {
            Err(ParamError::new(self.name, value, self.low, self.high))
        }
    }

    /// Whether a [texture](crate::Texture) can determine it: not the size of threads or their
    /// irregularities, which are those of whole threads.
    pub fn is_texturable(&self) -> bool {
        self.name != "size" && !self.name.starts_with("noise.")
    }

    /// Sets it in `yarn` to `value`, unchecked; false where the yarn has no such parameter.
    pub fn set(&self, yarn: &mut Yarn, value: f64) -> bool {
        (self.place)(yarn).is_some_and(|place| {
            *place = value;
            true
        })
    }
}

impl Yarn {
    /// Every number of a yarn, in the order in which a panel would show them.
    ///
    /// ```
    /// use selvedge_yarn_brdf::Yarn;
    /// let twist = Yarn::parameter("psi").unwrap();
    /// assert_eq!((twist.unit, twist.of(&Yarn::default())), ("rad", Some(twist.default)));
    /// ```
    pub fn parameters() -> &'static [Parameter] {
        PARAMETERS
    }

    /// The parameter called `name`.
    pub fn parameter(name: &str) -> Option<&'static Parameter> {
        PARAMETERS.iter().find(|parameter| parameter.name == name)
    }
}

macro_rules! parameter {
    ($name:literal, $meaning:literal, $unit:literal, $range:expr, $default:expr, $place:expr) => {
        Parameter {
            name: $name,
            meaning: $meaning,
            unit: $unit,
            low: $range.0,
            high: $range.1,
            default: $default,
            place: $place,
        }
    };
}

/// Least κ: above −1, where the spine would have no radius at its ends.
pub(crate) const KAPPA_MIN: f64 = -0.999;

#[rustfmt::skip]
const PARAMETERS: &[Parameter] = &[
    parameter!("size", "diameter over pitch", "", (0.01, 1.0), 1.0, |y| Some(&mut y.size)),
    parameter!("opacity", "share of the surface that the yarn hides", "", (0.0, 1.0), 1.0, |y| Some(&mut y.opacity)),
    parameter!("u_max", "greatest inclination", "rad", (0.0, 1.5), 0.5, |y| Some(&mut y.u_max)),
    parameter!("psi", "twist of the fibres", "rad", (-FRAC_PI_2, FRAC_PI_2), 0.5, |y| Some(&mut y.psi)),
    parameter!("kappa", "curvature of the spine", "", (KAPPA_MIN, 1000.0), 0.0, |y| Some(&mut y.kappa)),
    parameter!("smoothing", "share of a filament's ends over which the highlight fades", "", (0.0, 0.95), 0.0, |y| Some(&mut y.smoothing)),
    parameter!("delta", "half width of the drawn highlight", "", (1e-3, 1.0), 0.3, |y| match &mut y.highlight {
        Highlight::Window { delta } => Some(delta),
        Highlight::Rough { .. } => None,
    }),
    parameter!("sigma", "roughness of the fibres", "rad", (5e-3, 1.0), 0.15, |y| match &mut y.highlight {
        Highlight::Rough { sigma } => Some(sigma),
        Highlight::Window { .. } => None,
    }),
    parameter!("alpha", "uniform part of the scattering about the fibre", "", (0.0, 1.0), 0.05, |y| match &mut y.phase {
        Phase::VonMises { alpha, .. } | Phase::VonMises3d { alpha, .. } => Some(alpha),
        Phase::WrappedCauchy { .. } | Phase::Tabulated(_) => None,
    }),
    parameter!("beta", "concentration of the forward peak", "", (0.0, 1e6), 4.0, |y| match &mut y.phase {
        Phase::VonMises { beta, .. } | Phase::VonMises3d { beta, .. } => Some(beta),
        Phase::WrappedCauchy { .. } | Phase::Tabulated(_) => None,
    }),
    parameter!("rho", "concentration of the peak", "", (0.0, 1.0), 0.67, |y| match &mut y.phase {
        Phase::WrappedCauchy { rho, .. } => Some(rho),
        Phase::VonMises { .. } | Phase::VonMises3d { .. } | Phase::Tabulated(_) => None,
    }),
    parameter!("noise.intensity", "variation of the highlight", "", (0.0, 1.0), 0.0, |y| noise(y, |n| &mut n.intensity)),
    parameter!("noise.fineness", "grains of the highlight per cell", "", (1.0, 64.0), 3.0, |y| noise(y, |n| &mut n.fineness)),
    parameter!("noise.u_max", "greatest change of u_max between segments", "rad", (0.0, 0.5), 0.0, |y| noise(y, |n| &mut n.u_max)),
    parameter!("noise.width", "greatest relative change of the diameter", "", (0.0, 0.5), 0.0, |y| noise(y, |n| &mut n.width)),
    parameter!("noise.offset", "greatest sideways shift in diameters", "", (0.0, 0.25), 0.0, |y| noise(y, |n| &mut n.offset)),
    parameter!("noise.wavelength", "length over which diameter and shift change", "m", (1e-4, 1.0), 0.01, |y| noise(y, |n| &mut n.wavelength)),
    parameter!("noise.slub_rate", "thick places per length", "1/m", (0.0, 200.0), 0.0, |y| noise(y, |n| &mut n.slub_rate)),
    parameter!("noise.slub_length", "length of a thick place", "m", (1e-4, 0.1), 0.005, |y| noise(y, |n| &mut n.slub_length)),
    parameter!("noise.slub_height", "greatest relative increase of the diameter in a thick place", "", (0.0, 2.0), 0.0, |y| noise(y, |n| &mut n.slub_height)),
    parameter!("noise.color", "greatest relative change of lightness between threads", "", (0.0, 1.0), 0.0, |y| noise(y, |n| &mut n.color)),
];

fn noise(yarn: &mut Yarn, place: fn(&mut Noise) -> &mut f64) -> Option<&mut f64> {
    Some(place(&mut yarn.noise))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_those_of_the_default_yarn_and_in_range() {
        let rough = Yarn {
            highlight: Highlight::Rough { sigma: 0.15 },
            phase: Phase::WrappedCauchy { rho: 0.67, is_backward: false },
            ..Yarn::default()
        };
        for parameter in Yarn::parameters() {
            let value = parameter.of(&Yarn::default()).or_else(|| parameter.of(&rough));
            assert_eq!(value, Some(parameter.default), "{}", parameter.name);
            assert_eq!(parameter.check(parameter.default), Ok(()), "{}", parameter.name);
        }
    }

    #[test]
    fn what_is_set_is_what_is_found() {
        for parameter in Yarn::parameters() {
            let mut yarn = Yarn::default();
            let has = parameter.of(&yarn).is_some();
            assert_eq!(parameter.set(&mut yarn, parameter.high), has, "{}", parameter.name);
            assert_eq!(parameter.of(&yarn), has.then_some(parameter.high), "{}", parameter.name);
        }
    }
}
