//! `Yarn`: what one type of yarn is made of.

use crate::parameter::ParamError;
use crate::phase::Phase;

/// Greatest |ψ| at which a yarn with a drawn highlight is shaded as untwisted, rad.
///
/// The drawn highlight of a twisted yarn narrows to a strip of width ψ and height 1/ψ; below this
/// twist (1.7°) the limit ψ = 0 is evaluated instead, which carries the same energy without the
/// spike. As the mean over a segment shows, the step at the switch is small in energy: at most 2.5 % of
/// the greatest directional albedo. In single directions it is that of an edge which sharpens, where the
/// highlight ends with the segment: on average over directions, 0.02 + 0.0125/u_max of the mean far
/// field (14 % at u_max = 0.1, 4 % at 0.5). [`Highlight::Rough`] knows no switch.
pub const FILAMENT_PSI: f64 = 0.03;

/// Least inclination at which an untwisted yarn with a drawn highlight is shaded, rad.
///
/// The highlight of a straight untwisted yarn is a delta in direction. No thread in a cloth is
/// straight to better than a few degrees, so u_max is raised to this value.
pub const FILAMENT_U_MAX: f64 = 0.05;

/// One type of yarn (Nelson, McEvoy & Fratarcangeli 2016, section 4).
///
/// Every number has a name, a unit, a range and a default that [`Yarn::parameters`] tells.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Yarn {
    /// Diffuse reflectance, linear RGB, each in [0, 1].
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::color::required"))]
    pub color: [f32; 3],
    /// Colour and amount of the highlight, linear RGB, each in [0, 1]; of its peak alone where
    /// `specular_uniform` is given.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::color::required"))]
    pub specular: [f32; 3],
    /// Colour and amount of the uniform part of the highlight, if it differs from `specular`:
    /// linear RGB, each in [0, 1].
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::color::optional"))]
    pub specular_uniform: Option<[f32; 3]>,
    /// Share of the surface that the yarn hides, 1, in [0, 1]; the rest lets light pass straight.
    pub opacity: f64,
    /// How the diffuse reflection follows the surface.
    pub diffuse: Diffuse,
    /// Greatest inclination of the yarn, u_max: rad, in [0, 1.5].
    pub u_max: f64,
    /// Twist of the fibres about the yarn, ψ: rad, in [−π/2, π/2]; the sign is S or Z, and
    /// 0 is a yarn of filaments.
    pub psi: f64,
    /// Curvature of the spine, κ: 1, in [−0.999, 1000]; 0 is a circle, above it an ellipse that is flat
    /// on top, below it a parabola or hyperbola that is sharper there.
    pub kappa: f64,
    /// Share of the length of a filament's segment over which the highlight fades out at either end,
    /// ss: 1, in [0, 0.95].
    pub smoothing: f64,
    /// What spreads the highlight over the segment.
    pub highlight: Highlight,
    /// Scattering about the fibre.
    pub phase: Phase,
    /// Diameter over pitch: 1, in [0.01, 1]; below 1 the cloth has gaps.
    pub size: f64,
    /// Irregularities, all 0 by default.
    pub noise: Noise,
}

/// What spreads the highlight of a segment, which for ideal fibres is a line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(transform = crate::schema::add_ranges))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum Highlight {
    /// A band drawn along the line (Irawan & Marschner 2012, equations 12 and 13).
    Window {
        /// Half width of the band as a fraction of the segment's half width (of its half length for
        /// filaments), δ: 1, in [0.001, 1].
        delta: f64,
    },
    /// Rough fibres: each reflects into a cone that is blurred along the fibre, with a density that
    /// conserves energy (d'Eon et al. 2011, section 4).
    Rough {
        /// Standard deviation of the blur, σ: rad, in [0.005, 1]; silk has about 0.05, cotton 0.2.
        sigma: f64,
    },
}

/// How the diffuse reflection follows the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Diffuse {
    /// By the normal of the cloth, as in the paper.
    #[default]
    Flat,
    /// By the normal n of the yarn: proportional to `(n·wi)(n·wo)`, which is reciprocal, and as
    /// bright on average over a segment as it can be without reflecting more than it receives.
    YarnNormal,
}

/// Irregularities of a yarn. They depend on the thread and the position along it, counted without
/// end, so that they do not repeat with the weave.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Noise {
    /// Variation of the highlight's intensity: 1, in [0, 1]. At 1 it is distributed exponentially,
    /// with mean 1 (Irawan & Marschner 2012, section 6.2).
    pub intensity: f64,
    /// Grains of the intensity along and across a cell: 1, in [1, 64].
    pub fineness: f64,
    /// Greatest change of u_max from segment to segment: rad, in [0, 0.5].
    pub u_max: f64,
    /// Greatest relative change of the diameter along the thread: 1, in [0, 0.5]. No thread grows
    /// beyond its pitch: where threads touch, they can only become thinner.
    pub width: f64,
    /// Greatest sideways shift of the thread, in diameters: 1, in [0, 0.25].
    pub offset: f64,
    /// Length over which diameter and shift change: m, in [10⁻⁴, 1].
    pub wavelength: f64,
    /// Thick places per length of thread: m⁻¹, in [0, 200].
    pub slub_rate: f64,
    /// Length of a thick place: m, in [10⁻⁴, 0.1].
    pub slub_length: f64,
    /// Greatest relative increase of the diameter in a thick place: 1, in [0, 2].
    pub slub_height: f64,
    /// Greatest relative change of lightness from thread to thread: 1, in [0, 1].
    pub color: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            intensity: 0.0,
            fineness: 3.0,
            u_max: 0.0,
            width: 0.0,
            offset: 0.0,
            wavelength: 0.01,
            slub_rate: 0.0,
            slub_length: 0.005,
            slub_height: 0.0,
            color: 0.0,
        }
    }
}

impl Noise {
    /// Whether the diameter or position of a thread changes along it.
    pub(crate) fn moves_threads(&self) -> bool {
        self.width > 0.0 || self.offset > 0.0 || (self.slub_rate > 0.0 && self.slub_height > 0.0)
    }
}

impl Default for Highlight {
    /// A window of δ = 0.3 (Nelson, McEvoy & Fratarcangeli 2016, the defaults of the authors'
    /// program).
    fn default() -> Self {
        Self::Window { delta: 0.3 }
    }
}

impl Default for Yarn {
    /// A grey, moderately twisted yarn that touches its neighbours (Nelson, McEvoy & Fratarcangeli
    /// 2016, the defaults of the authors' program).
    fn default() -> Self {
        Self {
            color: [0.3; 3],
            specular: [0.4; 3],
            specular_uniform: None,
            opacity: 1.0,
            diffuse: Diffuse::Flat,
            u_max: 0.5,
            psi: 0.5,
            kappa: 0.0,
            smoothing: 0.0,
            highlight: Highlight::default(),
            phase: Phase::default(),
            size: 1.0,
            noise: Noise::default(),
        }
    }
}

impl Yarn {
    /// Whether every parameter is in its range.
    ///
    /// # Errors
    ///
    /// The first parameter that is not; NaN is in no range.
    pub fn validate(&self) -> Result<(), ParamError> {
        let colors = [("color", Some(self.color)), ("specular", Some(self.specular))]
            .into_iter()
            .chain([("specular_uniform", self.specular_uniform)]);
        for (name, color) in colors {
            for value in color.into_iter().flatten() {
                if !(0.0..=1.0).contains(&value) {
                    return Err(ParamError::new(name, value.into(), 0.0, 1.0));
                }
            }
        }
        Self::parameters().iter().try_for_each(|parameter| match parameter.of(self) {
            Some(value) => parameter.check(value),
            None => Ok(()),
        })
    }

    /// Whether the yarn is shaded as untwisted: a drawn highlight and |ψ| ≤ [`FILAMENT_PSI`].
    pub fn is_filament(&self) -> bool {
        matches!(self.highlight, Highlight::Window { .. }) && self.psi.abs() <= FILAMENT_PSI
    }

    /// The colours of the highlight's peak and of its uniform part.
    pub(crate) fn specular_colors(&self) -> [[f32; 3]; 2] {
        [self.specular, self.specular_uniform.unwrap_or(self.specular)]
    }

    /// The share of the light that meets fibres of the highlight: the greatest component of its
    /// colours.
    pub(crate) fn specular_amount(&self) -> f32 {
        self.specular_colors().into_iter().flatten().fold(0.0, f32::max)
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
        let d = Yarn::default;
        let cases = [
            ("color", Yarn { color: [0.0, 1.1, 0.0], ..d() }),
            ("specular", Yarn { specular: [-0.1, 0.0, 0.0], ..d() }),
            ("specular_uniform", Yarn { specular_uniform: Some([f32::NAN; 3]), ..d() }),
            ("opacity", Yarn { opacity: 1.5, ..d() }),
            ("u_max", Yarn { u_max: 1.6, ..d() }),
            ("psi", Yarn { psi: -2.0, ..d() }),
            ("kappa", Yarn { kappa: -1.0, ..d() }),
            ("smoothing", Yarn { smoothing: 1.0, ..d() }),
            ("delta", Yarn { highlight: Highlight::Window { delta: 0.0 }, ..d() }),
            ("sigma", Yarn { highlight: Highlight::Rough { sigma: 0.0 }, ..d() }),
            ("size", Yarn { size: f64::NAN, ..d() }),
            ("alpha", Yarn { phase: Phase::VonMises { alpha: 2.0, beta: 1.0 }, ..d() }),
            ("beta", Yarn { phase: Phase::VonMises { alpha: 0.0, beta: f64::INFINITY }, ..d() }),
            ("rho", Yarn { phase: Phase::WrappedCauchy { rho: 1.01, is_backward: true }, ..d() }),
            ("noise.width", Yarn { noise: Noise { width: 0.7, ..Noise::default() }, ..d() }),
        ];
        for (name, yarn) in cases {
            assert_eq!(yarn.validate().map_err(|e| e.name), Err(name), "{yarn:?}");
        }
        let error = Yarn { highlight: Highlight::Window { delta: 0.0 }, ..d() }.validate();
        assert_eq!(error.unwrap_err().to_string(), "delta: 0, expected 0.001 to 1");
    }
}
