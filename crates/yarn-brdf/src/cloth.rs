//! `Cloth`: a weave, its yarns and its scale.

use glam::DVec2;
use selvedge_normalize::scale::{Mode, ScaleError};

use crate::segment::Mapping;
use crate::shader::Shader;
use crate::weave::{Weave, WeaveError};
use crate::yarn::{ParamError, Yarn};

/// Pitch of a cloth whose threads name none, m: 20 threads a centimetre.
pub const DEFAULT_PITCH: f64 = 5e-4;

/// Range of the pitches that are believed, m: from the finest silk to rope. Others are placeholders.
pub const PLAUSIBLE_PITCH: core::ops::RangeInclusive<f64> = 2e-5..=5e-2;

/// Least diameter over pitch that is believed; thinner yarn would hold no cloth together.
pub const MIN_SIZE: f64 = 0.1;

/// How highlight and diffuse reflection add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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

/// One thread of a draft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    /// Linear sRGB, each in [0, 1].
    pub color: [f32; 3],
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
    /// The cloth of `weave` whose threads are `ends` and `picks`, in their order.
    ///
    /// Threads of one colour and thickness are one type of yarn: `yarn` in that colour and size.
    /// The pitch of each direction is the mean over its threads; that of the other direction, or
    /// [`DEFAULT_PITCH`], where none is named that is [plausible](PLAUSIBLE_PITCH). A thread's size
    /// is its diameter over the pitch, at least [`MIN_SIZE`] and at most 1, or 1 if it names none.
    ///
    /// # Errors
    ///
    /// A list of threads of the wrong length, or more than 65536 types of yarn.
    pub fn from_threads(
        weave: Weave,
        ends: &[Thread],
        picks: &[Thread],
        yarn: Yarn,
    ) -> Result<Self, ClothError> {
        check_count("ends", ends.len(), weave.ends())?;
        check_count("picks", picks.len(), weave.picks())?;
        let (end_pitch, pick_pitch) = (mean_pitch(ends), mean_pitch(picks));
        let pitch = DVec2::new(
            end_pitch.or(pick_pitch).unwrap_or(DEFAULT_PITCH),
            pick_pitch.or(end_pitch).unwrap_or(DEFAULT_PITCH),
        );
        let mut types = std::collections::HashMap::new();
        let mut yarns = Vec::new();
        let mut types_of = |threads: &[Thread], pitch: f64| -> Vec<usize> {
            threads
                .iter()
                .map(|thread| {
                    let size = thread.diameter.map_or(1.0, |d| (d / pitch).clamp(MIN_SIZE, 1.0));
                    *types.entry((thread.color.map(f32::to_bits), size.to_bits())).or_insert_with(
                        || {
                            yarns.push(Yarn { color: thread.color, size, ..yarn });
                            yarns.len() - 1
                        },
                    )
                })
                .collect()
        };
        let end_types = types_of(ends, pitch.x);
        let pick_types = types_of(picks, pitch.y);
        let narrow = |types: Vec<usize>| -> Option<Vec<u16>> {
            types.into_iter().map(|index| u16::try_from(index).ok()).collect()
        };
        let (Some(end_yarns), Some(pick_yarns)) = (narrow(end_types), narrow(pick_types)) else {
            return Err(ClothError::TooManyYarns(yarns.len()));
        };
        Ok(Self {
            weave,
            yarns,
            end_yarns,
            pick_yarns,
            pitch,
            mapping: Mapping::default(),
            normalization: Mode::default(),
            combination: Combination::default(),
        })
    }

    /// Size of one repeat, m: width along u and height along v.
    pub fn size(&self) -> DVec2 {
        self.pitch * DVec2::new(self.weave.ends().into(), self.weave.picks().into())
    }

    /// The shader of this cloth: every check done, every factor found.
    ///
    /// # Errors
    ///
    /// What does not fit together or is out of range; see [`ClothError`].
    pub fn prepare(&self) -> Result<Shader, ClothError> {
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
        for (index, yarn) in self.yarns.iter().enumerate() {
            yarn.validate().map_err(|source| ClothError::Yarn { index, source })?;
        }
        Shader::new(self)
    }
}

fn check_count(what: &'static str, found: usize, expected: u32) -> Result<(), ClothError> {
    if found == expected as usize {
        Ok(())
    } else {
        Err(ClothError::Count { what, found, expected })
    }
}

/// Mean of the plausible pitches, m.
fn mean_pitch(threads: &[Thread]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for pitch in threads.iter().filter_map(|thread| thread.pitch) {
        if PLAUSIBLE_PITCH.contains(&pitch) {
            sum += pitch;
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Thread = Thread { color: [0.5, 0.0, 0.0], pitch: Some(1e-3), diameter: None };
    const BLUE: Thread = Thread { color: [0.0, 0.0, 0.5], pitch: None, diameter: Some(2.5e-4) };

    fn plain() -> Weave {
        Weave::new(2, 2, |end, pick| end == pick).unwrap()
    }

    #[test]
    fn threads_become_yarn_types_pitches_and_sizes() {
        let cloth = Cloth::from_threads(plain(), &[RED, BLUE], &[BLUE, BLUE], Yarn::default());
        let cloth = cloth.unwrap();
        assert_eq!(cloth.yarns.len(), 2);
        assert_eq!((&cloth.end_yarns[..], &cloth.pick_yarns[..]), (&[0, 1][..], &[1, 1][..]));
        assert_eq!(cloth.pitch, DVec2::splat(1e-3));
        assert_eq!(cloth.size(), DVec2::splat(2e-3));
        assert_eq!((cloth.yarns[0].size, cloth.yarns[1].size), (1.0, 0.25));
    }

    #[test]
    fn cloth_without_pitch_takes_the_default() {
        let thread = Thread { pitch: Some(1e3), ..RED };
        let cloth = Cloth::from_threads(plain(), &[thread; 2], &[thread; 2], Yarn::default());
        assert_eq!(cloth.unwrap().pitch, DVec2::splat(DEFAULT_PITCH));
    }

    #[test]
    fn what_does_not_fit_together_is_named() {
        let error = Cloth::from_threads(plain(), &[RED], &[RED; 2], Yarn::default()).unwrap_err();
        assert_eq!(error.to_string(), "ends: 1, expected 2 as in the weave");
        let good = Cloth::from_threads(plain(), &[RED; 2], &[RED; 2], Yarn::default()).unwrap();
        let prepare = |change: fn(&mut Cloth)| {
            let mut cloth = good.clone();
            change(&mut cloth);
            cloth.prepare().map(|_| ()).unwrap_err().to_string()
        };
        assert_eq!(prepare(|c| c.yarns[0].delta = 0.0), "yarn 0");
        assert_eq!(prepare(|c| c.pick_yarns[1] = 7), "pick 2: yarn 7, expected less than 1");
        let pitch = prepare(|c| c.pitch.x = f64::NAN);
        assert_eq!(pitch, "pitch: NaN m by 0.001 m, expected positive numbers");
        assert_eq!(prepare(|c| c.yarns.clear()), "yarns: 0 types, expected 1 to 65536");
    }
}
