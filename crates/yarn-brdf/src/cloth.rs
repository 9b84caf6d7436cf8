//! `Cloth`: a weave, its yarns and its scale.

use core::f64::consts::TAU;

use glam::DVec2;
use selvedge_normalize::scale::{Mode, ScaleError};

use crate::fabric::Fabric;
use crate::material::Lowered;
use crate::parameter::ParamError;
use crate::partial::{PartialError, PartialYarn};
use crate::prepare::Preparer;
use crate::segment::Mapping;
use crate::shader::Shader;
use crate::texture::{Target, Textured};
use crate::weave::{Weave, WeaveError};
use crate::yarn::Yarn;

/// Pitch of a cloth whose threads name none, m: 20 threads a centimetre.
pub const DEFAULT_PITCH: f64 = 5e-4;

/// Range of the pitches that are believed, m: from the finest silk to rope. Others are placeholders.
pub const PLAUSIBLE_PITCH: core::ops::RangeInclusive<f64> = 2e-5..=5e-2;

/// Least diameter over pitch that is believed; thinner yarn would hold no cloth together.
pub const MIN_SIZE: f64 = 0.1;

/// How highlight and diffuse reflection add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Combination {
    /// The diffuse gets exactly what the highlight leaves, in and out (Kelemen & Szirmay-Kalos
    /// 2001, section 2.2):
    ///
    /// ```text
    /// f = k a T + ρ/π (1 − E(wi)) (1 − E(wo)) / (1 − Ē)
    /// ```
    ///
    /// with E the directional and Ē the bihemispherical albedo of `k a T`. Under [`Mode::Pointwise`]
    /// the only bound on E that holds at every point is k, which makes this equal to `Lerp`.
    #[default]
    Layered,
    /// `f = k a T + (1 − k) ρ/π` (Nelson, McEvoy & Fratarcangeli 2016, section 4.4).
    Lerp,
}

/// One thread of a draft. By default black, with nothing else known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thread {
    /// Linear sRGB, each in [0, 1].
    pub color: [f32; 3],
    /// Number of the colour in the palette of the draft, if it has one.
    pub color_number: Option<u32>,
    /// Distance to the next thread, m, if known.
    pub pitch: Option<f64>,
    /// Diameter, m, if known.
    pub diameter: Option<f64>,
}

/// A woven cloth: which thread lies on top where, what each is made of, and how large it is.
#[derive(Clone, Debug)]
pub struct Cloth {
    /// The crossings.
    pub weave: Weave,
    /// The types of yarn.
    pub yarns: Vec<Yarn>,
    /// Index into `yarns` for each end.
    pub end_yarns: Vec<u16>,
    /// Index into `yarns` for each pick.
    pub pick_yarns: Vec<u16>,
    /// Size of a cell, m: (pitch of the ends, along u; pitch of the picks, along v).
    pub pitch: DVec2,
    /// How segments are laid on cylinders.
    pub mapping: Mapping,
    /// What the highlight is normalised to.
    pub normalization: Mode,
    /// How highlight and diffuse add up.
    pub combination: Combination,
    /// What becomes of segments too short to bend as far as their yarn.
    pub steep: Steep,
    /// Parameters that change from place to place.
    pub textures: Vec<Textured>,
    /// Angle from the u of a position to the weft, rad: the weave turned by −`rotation` on the cloth.
    pub rotation: f64,
    /// Times how much smaller the weave is than its pitch tells, 1, above 0.
    pub scale: f64,
    /// Chooses the irregularities.
    pub seed: u64,
}

/// What becomes of segments that are too short for the u_max of their yarn: those with
/// `w sin u_max ≥ l`, which no conic spine can join.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Steep {
    /// They are shaded with the greatest u_max that fits; [`Shader::lowered`] tells.
    #[default]
    Lower,
    /// They make the cloth an error.
    Reject,
}

/// Why a cloth cannot be prepared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClothError {
    /// The weave has no threads, or too many.
    #[error(transparent)]
    Weave(#[from] WeaveError),
    /// A list of threads does not match the weave.
    #[error("{what}: {found}, expected {expected} as in the weave")]
    Count {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The weave's number.
        expected: u32,
    },
    /// More types of yarn than an index can name.
    #[error("yarns: {0} types, expected 1 to 65536")]
    TooManyYarns(usize),
    /// A thread names a type that does not exist.
    #[error("{what} {thread}: yarn {yarn}, expected less than {yarns}")]
    NoSuchYarn {
        /// `end` or `pick`.
        what: &'static str,
        /// The thread, from 1.
        thread: usize,
        /// The index found.
        yarn: u16,
        /// How many types there are.
        yarns: usize,
    },
    /// A cell has no positive, finite size.
    #[error("pitch: {0} m by {1} m, expected positive numbers")]
    Pitch(f64, f64),
    /// A parameter of a yarn is out of range.
    #[error("yarn {index}")]
    Yarn {
        /// Index into the types.
        index: usize,
        /// The parameter.
        source: ParamError,
    },
    /// A parameter of a fabric is out of range, or is none of the yarn that it is for.
    #[error("{place}")]
    Fabric {
        /// `yarn`, or `override` and its number from 1.
        place: String,
        /// The parameter.
        source: PartialError,
    },
    /// A segment is too short for the u_max of its yarn.
    #[error("{0}")]
    Steep(Lowered),
    /// A number of the cloth itself is out of range.
    #[error("cloth")]
    Cloth(#[source] ParamError),
    /// A texture is for a type that does not exist, or for a parameter that the type does not have.
    #[error("texture {index}: {what}")]
    Texture {
        /// Index of the texture.
        index: usize,
        /// What is wrong.
        what: String,
    },
    /// The factor of a yarn could not be found.
    #[error("yarn {index}: normalization failed")]
    Normalization {
        /// Index into the types.
        index: usize,
        /// Why.
        source: ScaleError,
    },
}

impl Cloth {
    /// The cloth of `weave` whose threads are `ends` and `picks`, in their order: each of them `yarn`
    /// in its own colour and size. Pitch and sizes are those of [`Fabric::cloth`].
    ///
    /// # Errors
    ///
    /// As for [`Fabric::cloth`].
    pub fn from_threads(
        weave: Weave,
        ends: &[Thread],
        picks: &[Thread],
        yarn: &Yarn,
    ) -> Result<Self, ClothError> {
        let yarn = PartialYarn { color: None, size: None, ..PartialYarn::from(yarn) };
        let mapping = Mapping::default();
        Fabric { yarn, mapping, ..Fabric::default() }.cloth(weave, ends, picks)
    }

    /// Size of one repeat, m: width along u and height along v.
    pub fn size(&self) -> DVec2 {
        self.pitch * DVec2::new(self.weave.ends().into(), self.weave.picks().into())
    }

    /// The shader of this cloth: every check done, every factor found. [`Preparer`] prepares one cloth
    /// after the other in less time.
    ///
    /// # Errors
    ///
    /// What does not fit together or is out of range; see [`ClothError`].
    #[expect(clippy::missing_panics_doc, reason = "nothing stops it")]
    pub fn prepare(&self) -> Result<Shader, ClothError> {
        let shader = Preparer::default().prepare(self, &|| true)?;
        Ok(shader.expect("it goes on to the end"))
    }

    /// Whether everything fits together and is in range.
    pub(crate) fn check(&self) -> Result<(), ClothError> {
        check_count("ends", self.end_yarns.len(), self.weave.ends())?;
        check_count("picks", self.pick_yarns.len(), self.weave.picks())?;
        if !(1..=1 << 16).contains(&self.yarns.len()) {
            return Err(ClothError::TooManyYarns(self.yarns.len()));
        }
        for (what, list) in [("end", &self.end_yarns), ("pick", &self.pick_yarns)] {
            let beyond = list.iter().position(|&yarn| usize::from(yarn) >= self.yarns.len());
            if let Some(thread) = beyond {
                let (yarn, yarns) = (list[thread], self.yarns.len());
                return Err(ClothError::NoSuchYarn { what, thread: thread + 1, yarn, yarns });
            }
        }
        let DVec2 { x, y } = self.pitch;
        if !(x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite()) {
            return Err(ClothError::Pitch(x, y));
        }
        for (name, value, low, high) in
            [("rotation", self.rotation, -TAU, TAU), ("scale", self.scale, 1e-6, 1e6)]
        {
            if !(low..=high).contains(&value) {
                return Err(ClothError::Cloth(ParamError::new(name, value, low, high)));
            }
        }
        for (index, yarn) in self.yarns.iter().enumerate() {
            yarn.validate().map_err(|source| ClothError::Yarn { index, source })?;
        }
        for (index, textured) in self.textures.iter().enumerate() {
            self.check_texture(textured).map_err(|what| ClothError::Texture { index, what })?;
        }
        Ok(())
    }

    /// Whether a texture determines something that a type of yarn has, and tells a range.
    fn check_texture(&self, textured: &Textured) -> Result<(), String> {
        let Some(yarn) = self.yarns.get(usize::from(textured.yarn)) else {
            let count = self.yarns.len();
            return Err(format!("yarn {}, expected less than {count}", textured.yarn));
        };
        if let Target::Parameter(name) = textured.target {
            let parameter = Yarn::parameter(name).filter(|parameter| parameter.is_texturable());
            if parameter.is_none_or(|parameter| parameter.of(yarn).is_none()) {
                return Err(format!("parameter {name}, expected one that the yarn has"));
            }
        }
        let [low, high] = textured.texture.range();
        if low <= high && low.is_finite() && high.is_finite() {
            Ok(())
        } else {
            Err(format!("range {low} to {high}, expected two finite numbers in order"))
        }
    }
}

pub(crate) fn check_count(
    what: &'static str,
    found: usize,
    expected: u32,
) -> Result<(), ClothError> {
    if found == expected as usize {
        Ok(())
    } else {
        Err(ClothError::Count { what, found, expected })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Thread =
        Thread { color: [0.5, 0.0, 0.0], color_number: None, pitch: Some(1e-3), diameter: None };

    fn plain() -> Weave {
        Weave::new(2, 2, |end, pick| end == pick).unwrap()
    }

    #[test]
    fn what_does_not_fit_together_is_named() {
        let error = Cloth::from_threads(plain(), &[RED], &[RED; 2], &Yarn::default()).unwrap_err();
        assert_eq!(error.to_string(), "ends: 1, expected 2 as in the weave");
        let good = Cloth::from_threads(plain(), &[RED; 2], &[RED; 2], &Yarn::default()).unwrap();
        let prepare = |change: fn(&mut Cloth)| {
            let mut cloth = good.clone();
            change(&mut cloth);
            cloth.prepare().map(|_| ()).unwrap_err().to_string()
        };
        assert_eq!(prepare(|c| c.yarns[0].psi = 4.0), "yarn 0");
        assert_eq!(prepare(|c| c.pick_yarns[1] = 7), "pick 2: yarn 7, expected less than 1");
        let pitch = prepare(|c| c.pitch.x = f64::NAN);
        assert_eq!(pitch, "pitch: NaN m by 0.001 m, expected positive numbers");
        assert_eq!(prepare(|c| c.yarns.clear()), "yarns: 0 types, expected 1 to 65536");
    }
}
