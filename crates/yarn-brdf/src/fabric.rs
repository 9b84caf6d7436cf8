//! `Fabric`: what a draft leaves open, above all the yarns.

#[cfg(feature = "schema")]
use core::f64::consts::TAU;
use std::{collections::HashMap, sync::Arc};

use glam::DVec2;
use selvedge_normalize::scale::Mode;

use crate::cloth::{
    Cloth, ClothError, Combination, DEFAULT_PITCH, MIN_SIZE, PLAUSIBLE_PITCH, Steep, Thread,
    check_count,
};
use crate::parameter::ParamError;
use crate::partial::{PartialError, PartialYarn};
use crate::segment::Mapping;
use crate::texture::{Reflected, Target, Textured, Textures, Tinted, tinted};
use crate::weave::Weave;
use crate::yarn::{Highlight, Yarn};

/// What makes a weave and its threads a cloth: the yarns, and how they are shaded.
///
/// With serde this is an object of these fields, each optional, where any other key is an error:
///
/// ```json
/// {
///   "yarn": { "psi": -0.52, "highlight": { "rough": { "sigma": 0.2 } } },
///   "overrides": [
///     { "warp": true, "yarn": { "u_max": 0.21, "kappa": 0.4 } },
///     { "color": 3, "threads": [1, 8], "yarn": { "color": "#202c4a", "specular": 0.4 } }
///   ],
///   "scale": 1.5
/// }
/// ```
///
/// # Examples
///
/// ```
/// use selvedge_yarn_brdf::{Fabric, Override, PartialYarn, Thread, Weave};
///
/// let fabric = Fabric {
///     yarn: PartialYarn { psi: Some(-0.52), ..PartialYarn::default() },
///     overrides: vec![Override {
///         is_warp: Some(true),
///         yarn: PartialYarn { u_max: Some(0.21), ..PartialYarn::default() },
///         ..Override::default()
///     }],
///     ..Fabric::default()
/// };
/// let twill = Weave::new(4, 4, |end, pick| (end + 4 - pick) % 4 != 0)?;
/// let indigo = Thread { color: [0.02, 0.03, 0.1], ..Thread::default() };
/// let white = Thread { color: [0.7; 3], ..indigo };
/// let cloth = fabric.cloth(twill, &[indigo; 4], &[white; 4])?;
/// assert_eq!(cloth.yarns.len(), 2);
/// assert_eq!((cloth.yarns[0].u_max, cloth.yarns[0].psi), (0.21, -0.52));
/// assert_eq!(cloth.yarns[1].u_max, Fabric::default_yarn().u_max);
/// # Ok::<(), selvedge_yarn_brdf::ClothError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Fabric {
    /// What all yarn has in common. Colour and size are those of the threads where this leaves them
    /// open, all else is then that of [`Fabric::default_yarn`].
    pub yarn: PartialYarn,
    /// Yarn that differs, each for the threads that it names; later ones win.
    pub overrides: Vec<Override>,
    /// How segments are laid on cylinders: linear by default. Seen close, that shows each yarn as the
    /// round thing it is, and with rough fibres the highlight stays bounded at the yarn's edges.
    pub mapping: Mapping,
    /// What the highlight is normalised to.
    #[cfg_attr(feature = "serde", serde(with = "ModeName"))]
    #[cfg_attr(feature = "schema", schemars(with = "ModeName"))]
    pub normalization: Mode,
    /// How highlight and diffuse add up.
    pub combination: Combination,
    /// What becomes of segments too short to bend as far as their yarn.
    pub steep: Steep,
    /// As [`Cloth::rotation`]: rad, in [−2π, 2π].
    #[cfg_attr(feature = "schema", schemars(range(min = -TAU, max = TAU)))]
    pub rotation: f64,
    /// Times how much smaller the weave is than its pitch tells: 1, in [10⁻⁶, 10⁶].
    #[cfg_attr(feature = "schema", schemars(range(min = 1e-6, max = 1e6)))]
    pub scale: f64,
    /// Chooses the irregularities.
    pub seed: u64,
}

/// Yarn that differs from the others: parameters, and for which threads.
///
/// A thread must be all of what is given.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[cfg_attr(feature = "serde", serde(expecting = "an object, an override"))]
pub struct Override {
    /// Whether it is for ends alone, or else for picks alone. In files `warp`.
    #[cfg_attr(feature = "serde", serde(rename = "warp", skip_serializing_if = "Option::is_none"))]
    pub is_warp: Option<bool>,
    /// Of the colour with this number in the palette of the draft.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub color: Option<u32>,
    /// Between these two, both included, where the first end or pick of the draft is 1.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = 1))))]
    pub threads: Option<[u32; 2]>,
    /// The parameters that differ.
    pub yarn: PartialYarn,
}

/// The names of modes in files.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(remote = "Mode", rename_all = "snake_case")]
enum ModeName {
    /// No point reflects more than it receives.
    Pointwise,
    /// No segment of yarn reflects more than it receives, all its points together.
    Segment,
    /// Nothing bounds it, for comparisons.
    None,
}

impl Default for Fabric {
    /// A draft and nothing else: the colours, pitches and sizes that it tells, in
    /// [`Fabric::default_yarn`].
    fn default() -> Self {
        Self {
            yarn: PartialYarn::default(),
            overrides: Vec::new(),
            mapping: Mapping::Linear,
            normalization: Mode::default(),
            combination: Combination::default(),
            steep: Steep::default(),
            rotation: 0.0,
            scale: 1.0,
            seed: 0,
        }
    }
}

/// [`PartialYarn::tint`] where it is open: most of a highlight is light that has been inside a fibre.
const DEFAULT_TINT: f64 = 0.6;

impl Fabric {
    /// The yarn of threads of which nothing but colour and size is known: slightly twisted and lying
    /// flat, of rough fibres between the staple of wool and the filament of silk, so that floats shine
    /// across their direction. Where the [tint](PartialYarn::tint) of the highlight is open too, it is 0.6.
    pub fn default_yarn() -> Yarn {
        Yarn {
            u_max: 0.3,
            psi: 0.2,
            specular: [0.3; 3],
            highlight: Highlight::Rough { sigma: 0.15 },
            ..Yarn::default()
        }
    }

    /// The cloth of `weave` whose threads are `ends` and `picks`, in their order.
    ///
    /// Threads that are alike in all that the fabric does not override are one type of yarn. The
    /// pitch of each direction is the mean over its threads; that of the other direction, or
    /// [`DEFAULT_PITCH`], where none is named that is [plausible](PLAUSIBLE_PITCH). The size of a
    /// thread is its diameter over the pitch, at least [`MIN_SIZE`] and at most 1, or 1 if it names
    /// none.
    ///
    /// # Errors
    ///
    /// A list of threads of the wrong length, a parameter out of range or of another kind of yarn, or
    /// more than 65536 types of yarn.
    pub fn cloth(
        &self,
        weave: Weave,
        ends: &[Thread],
        picks: &[Thread],
    ) -> Result<Cloth, ClothError> {
        check_count("ends", ends.len(), weave.ends())?;
        check_count("picks", picks.len(), weave.picks())?;
        self.check()?;
        let (end_pitch, pick_pitch) = (mean_pitch(ends), mean_pitch(picks));
        let pitch = DVec2::new(
            end_pitch.or(pick_pitch).unwrap_or(DEFAULT_PITCH),
            pick_pitch.or(end_pitch).unwrap_or(DEFAULT_PITCH),
        );
        let mut types =
            Types { fabric: self, known: HashMap::new(), yarns: Vec::new(), textures: Vec::new() };
        let end_yarns = types.of_threads(true, ends, pitch.x)?;
        let pick_yarns = types.of_threads(false, picks, pitch.y)?;
        Ok(Cloth {
            weave,
            yarns: types.yarns,
            end_yarns,
            pick_yarns,
            pitch,
            mapping: self.mapping,
            normalization: self.normalization,
            combination: self.combination,
            steep: self.steep,
            textures: types.textures,
            rotation: self.rotation,
            scale: self.scale,
            seed: self.seed,
        })
    }

    /// The overrides that no thread answers to, by their index: likely errors of whoever wrote them.
    pub fn unused(&self, ends: &[Thread], picks: &[Thread]) -> Vec<usize> {
        let is_used = |rule: &Override| {
            [(true, ends), (false, picks)].into_iter().any(|(is_warp, threads)| {
                threads
                    .iter()
                    .zip(1..)
                    .any(|(thread, number)| rule.matches(is_warp, number, thread))
            })
        };
        (0..self.overrides.len()).filter(|&index| !is_used(&self.overrides[index])).collect()
    }

    /// Whether every parameter is in its range, used or not.
    fn check(&self) -> Result<(), ClothError> {
        let out_of_range =
            |layer| move |source: ParamError| fabric_error(layer, PartialError::Range(source));
        self.yarn.validate().map_err(out_of_range(None))?;
        for (index, rule) in self.overrides.iter().enumerate() {
            let layer = Some(index);
            rule.yarn.validate().map_err(out_of_range(layer))?;
            let [first, last] = rule.threads.unwrap_or([1, 1]);
            if !(1..=last).contains(&first) {
                let [value, high] = [first, last].map(f64::from);
                let error = ParamError::new("threads", value, 1.0, high.max(1.0));
                return Err(out_of_range(layer)(error));
            }
        }
        Ok(())
    }
}

fn fabric_error(layer: Option<usize>, source: PartialError) -> ClothError {
    let place = match layer {
        None => "yarn".to_owned(),
        Some(index) => format!("override {}", index + 1),
    };
    ClothError::Fabric { place, source }
}

impl Override {
    /// Whether it is for this thread; `number` is 1 for the first of its side.
    pub fn matches(&self, is_warp: bool, number: u32, thread: &Thread) -> bool {
        self.is_warp.is_none_or(|expected| expected == is_warp)
            && self.color.is_none_or(|expected| thread.color_number == Some(expected))
            && self.threads.is_none_or(|[first, last]| (first..=last).contains(&number))
    }
}

/// The types of yarn found so far.
struct Types<'a> {
    fabric: &'a Fabric,
    known: HashMap<Key, u16>,
    yarns: Vec<Yarn>,
    textures: Vec<Textured>,
}

/// What tells types apart: the overrides, and the bits of what these leave to the thread, its colour
/// and its size.
type Key = (Vec<usize>, Option<[u32; 3]>, Option<u64>);

impl Types<'_> {
    /// The index of the type of each thread.
    fn of_threads(
        &mut self,
        is_warp: bool,
        threads: &[Thread],
        pitch: f64,
    ) -> Result<Vec<u16>, ClothError> {
        let index = |(thread, number): (&Thread, u32)| {
            let size = thread.diameter.map_or(1.0, |d| (d / pitch).clamp(MIN_SIZE, 1.0));
            // The mean of equal pitches differs from them by rounding.
            let size = if size > 1.0 - 1e-9 { 1.0 } else { size };
            let overrides = self.fabric.overrides.iter().enumerate();
            let rules: Vec<_> = overrides
                .filter(|(_, rule)| rule.matches(is_warp, number, thread))
                .map(|(index, _)| index)
                .collect();
            self.find(&rules, thread.color, size)
        };
        threads.iter().zip(1..).map(index).collect()
    }

    fn find(&mut self, rules: &[usize], color: [f32; 3], size: f64) -> Result<u16, ClothError> {
        let overrides = &self.fabric.overrides;
        let layers = || {
            let of_rules = rules.iter().map(|&index| (Some(index), &overrides[index].yarn));
            [(None, &self.fabric.yarn)].into_iter().chain(of_rules)
        };
        let key = (
            rules.to_vec(),
            layers().all(|(_, layer)| is_color_open(layer)).then(|| color.map(f32::to_bits)),
            layers().all(|(_, layer)| layer.size.is_none()).then(|| size.to_bits()),
        );
        if let Some(&index) = self.known.get(&key) {
            return Ok(index);
        }
        let mut yarn = Yarn { color, size, ..Fabric::default_yarn() };
        let mut tint = DEFAULT_TINT;
        let mut textures = Textures::default();
        for (layer, partial) in layers() {
            let failed = |source| fabric_error(layer, source);
            partial.apply(&mut yarn, &mut tint).map_err(failed)?;
            partial.apply_textures(&yarn, &mut textures).map_err(failed)?;
        }
        textures.set_means(&mut yarn);
        let pictures = [Target::Specular, Target::Color].map(|target| textures.of(target));
        if tint > 0.0 && pictures.iter().any(Option::is_some) {
            let specular = Reflected::new(pictures[0], yarn.specular);
            let color = Reflected::new(pictures[1], yarn.color);
            textures.set(Target::Specular, Arc::new(Tinted { specular, color, tint }));
        }
        for (specular, color) in yarn.specular.iter_mut().zip(yarn.color) {
            *specular = tinted(*specular, color, tint);
        }
        let index = u16::try_from(self.yarns.len())
            .map_err(|_| ClothError::TooManyYarns(self.yarns.len() + 1))?;
        self.yarns.push(yarn);
        self.textures.extend(textures.iter().map(|(target, texture)| Textured {
            yarn: index,
            target,
            texture: texture.clone(),
        }));
        self.known.insert(key, index);
        Ok(index)
    }
}

/// Whether a layer leaves the colour to the thread.
fn is_color_open(layer: &PartialYarn) -> bool {
    layer.color.is_none() && layer.textures.of(Target::Color).is_none()
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
    use crate::phase::Phase;

    const RED: Thread =
        Thread { color: [0.5, 0.0, 0.0], color_number: Some(1), pitch: Some(1e-3), diameter: None };
    const BLUE: Thread = Thread {
        color: [0.0, 0.0, 0.5],
        color_number: Some(2),
        pitch: None,
        diameter: Some(2.5e-4),
    };

    fn plain() -> Weave {
        Weave::new(2, 2, |end, pick| end == pick).unwrap()
    }

    fn open() -> PartialYarn {
        PartialYarn::default()
    }

    /// The yarns of both ends and both picks.
    fn woven(fabric: &Fabric) -> Result<[Yarn; 4], ClothError> {
        let cloth = fabric.cloth(plain(), &[RED, BLUE], &[BLUE, BLUE])?;
        let yarns = cloth.end_yarns.iter().chain(&cloth.pick_yarns);
        let yarns: Vec<_> = yarns.map(|&index| cloth.yarns[usize::from(index)].clone()).collect();
        Ok(yarns.try_into().unwrap())
    }

    #[test]
    fn threads_become_yarn_types_pitches_and_sizes() {
        let cloth = Fabric::default().cloth(plain(), &[RED, BLUE], &[BLUE, BLUE]).unwrap();
        assert_eq!(cloth.yarns.len(), 2);
        assert_eq!((&cloth.end_yarns[..], &cloth.pick_yarns[..]), (&[0, 1][..], &[1, 1][..]));
        assert_eq!(cloth.pitch, DVec2::splat(1e-3));
        assert_eq!(cloth.size(), DVec2::splat(2e-3));
        assert_eq!((cloth.yarns[0].size, cloth.yarns[1].size), (1.0, 0.25));
        assert_eq!(cloth.yarns[0].color, RED.color);
        for (found, expected) in cloth.yarns[0].specular.into_iter().zip([0.21, 0.12, 0.12]) {
            assert!((found - expected).abs() < 1e-6, "{found}, expected {expected}");
        }
    }

    #[test]
    fn cloth_without_pitch_takes_the_default() {
        let thread = Thread { pitch: Some(1e3), ..RED };
        let cloth = Fabric::default().cloth(plain(), &[thread; 2], &[thread; 2]);
        assert_eq!(cloth.unwrap().pitch, DVec2::splat(DEFAULT_PITCH));
    }

    #[test]
    fn yarn_as_a_whole_is_taken_over_but_for_colour_and_size() {
        let yarn = Yarn { psi: -0.7, specular: [0.1, 0.2, 0.3], ..Yarn::default() };
        let cloth = Cloth::from_threads(plain(), &[RED; 2], &[BLUE; 2], &yarn).unwrap();
        assert_eq!(cloth.yarns[0], Yarn { color: RED.color, ..yarn.clone() });
        assert_eq!(cloth.yarns[1], Yarn { color: BLUE.color, size: 0.25, ..yarn });
    }

    #[test]
    fn overrides_are_for_sides_colours_and_threads() {
        let psi = |fabric: &Fabric| woven(fabric).unwrap().map(|yarn| yarn.psi);
        let rule = |is_warp, color, threads, psi| Override {
            is_warp,
            color,
            threads,
            yarn: PartialYarn { psi: Some(psi), ..open() },
        };
        let with = |overrides: Vec<Override>| Fabric {
            yarn: PartialYarn { psi: Some(0.1), ..open() },
            overrides,
            ..Fabric::default()
        };
        assert_eq!(psi(&with(vec![])), [0.1; 4]);
        assert_eq!(psi(&with(vec![rule(Some(true), None, None, 0.2)])), [0.2, 0.2, 0.1, 0.1]);
        assert_eq!(psi(&with(vec![rule(Some(false), None, None, 0.2)])), [0.1, 0.1, 0.2, 0.2]);
        assert_eq!(psi(&with(vec![rule(None, Some(2), None, 0.2)])), [0.1, 0.2, 0.2, 0.2]);
        assert_eq!(psi(&with(vec![rule(None, None, Some([2, 9]), 0.2)])), [0.1, 0.2, 0.1, 0.2]);
        assert_eq!(psi(&with(vec![rule(Some(true), Some(2), Some([1, 1]), 0.2)])), [0.1; 4]);
        let both = vec![rule(None, None, None, 0.2), rule(None, Some(1), None, 0.3)];
        assert_eq!(psi(&with(both.clone())), [0.3, 0.2, 0.2, 0.2]);
        let reversed = both.into_iter().rev().collect();
        assert_eq!(psi(&with(reversed)), [0.2; 4]);
    }

    #[test]
    fn overrides_without_threads_are_told() {
        let rule = |color| Override { color, ..Override::default() };
        let overrides = vec![rule(Some(1)), rule(Some(3)), rule(None)];
        let fabric = Fabric { overrides, ..Fabric::default() };
        assert_eq!(fabric.unused(&[RED; 2], &[BLUE; 2]), [1]);
    }

    #[test]
    fn one_number_of_a_choice_can_be_overridden() {
        let phase = Phase::WrappedCauchy { rho: 0.3, is_backward: true };
        let fabric = Fabric {
            yarn: PartialYarn { beta: Some(9.0), sigma: Some(0.7), ..open() },
            overrides: vec![
                Override {
                    is_warp: Some(true),
                    yarn: PartialYarn { alpha: Some(0.2), ..open() },
                    ..Override::default()
                },
                Override {
                    color: Some(1),
                    yarn: PartialYarn { phase: Some(phase), rho: Some(0.4), ..open() },
                    ..Override::default()
                },
            ],
            ..Fabric::default()
        };
        let [red, blue, pick, _] = woven(&fabric).unwrap();
        assert_eq!(red.phase, Phase::WrappedCauchy { rho: 0.4, is_backward: true });
        assert_eq!(blue.phase, Phase::VonMises { alpha: 0.2, beta: 9.0 });
        assert_eq!(pick.phase, Phase::VonMises { alpha: 0.05, beta: 9.0 });
        assert_eq!(pick.highlight, Highlight::Rough { sigma: 0.7 });
    }

    /// From 0 to 1 within a metre of weft.
    #[derive(Debug)]
    struct Ramp;

    impl crate::texture::Texture for Ramp {
        fn value(&self, uv: DVec2, footprint: f64) -> [f32; 3] {
            [if footprint.is_finite() { uv.x.fract() as f32 } else { 0.5 }; 3]
        }

        fn range(&self) -> [f32; 2] {
            [0.0, 1.0]
        }
    }

    fn pictured(targets: &[Target]) -> PartialYarn {
        let mut yarn = open();
        for &target in targets {
            yarn.textures.set(target, Arc::new(Ramp));
        }
        yarn
    }

    #[test]
    fn pictures_and_values_take_the_place_of_each_other() {
        let psi = Target::Parameter("psi");
        let on_ends = |yarn| Override { is_warp: Some(true), yarn, ..Override::default() };
        let fabric = Fabric {
            yarn: pictured(&[psi, Target::Parameter("sigma")]),
            overrides: vec![
                on_ends(PartialYarn {
                    psi: Some(0.2),
                    highlight: Some(Highlight::Rough { sigma: 0.3 }),
                    ..open()
                }),
                on_ends(pictured(&[Target::Parameter("u_max")])),
            ],
            ..Fabric::default()
        };
        let cloth = fabric.cloth(plain(), &[RED; 2], &[RED; 2]).unwrap();
        let found: Vec<_> = cloth.textures.iter().map(|t| (t.yarn, t.target)).collect();
        let u_max = Target::Parameter("u_max");
        assert_eq!(found, [(0, u_max), (1, psi), (1, Target::Parameter("sigma"))]);
        assert_eq!((cloth.yarns[0].psi, cloth.yarns[0].u_max), (0.2, 0.5));
        assert_eq!(
            (cloth.yarns[1].psi, cloth.yarns[1].highlight),
            (0.5, Highlight::Rough { sigma: 0.5 })
        );
        assert!(cloth.prepare().is_ok());
        let strange = Fabric { yarn: pictured(&[Target::Parameter("delta")]), ..Fabric::default() };
        assert!(strange.cloth(plain(), &[RED; 2], &[RED; 2]).is_err());
    }

    #[test]
    fn highlight_takes_the_colour_of_a_picture_too() {
        let yarn =
            PartialYarn { specular: Some([0.4; 3]), tint: Some(0.5), ..pictured(&[Target::Color]) };
        let fabric = Fabric { yarn, ..Fabric::default() };
        let cloth = fabric.cloth(plain(), &[RED, BLUE], &[RED; 2]).unwrap();
        assert_eq!(cloth.yarns[0].color, [0.5; 3], "not that of the thread");
        let texture = |target| {
            let found = cloth.textures.iter().find(|t| (t.yarn, t.target) == (0, target)).unwrap();
            (found.texture.value(DVec2::new(0.25, 0.0), 0.0), found.texture.range())
        };
        assert_eq!(texture(Target::Color), ([0.25; 3], [0.0, 1.0]));
        assert_eq!(texture(Target::Specular), ([0.25; 3], [0.2, 0.4]));
        let untinted = PartialYarn { tint: Some(0.0), ..pictured(&[Target::Color]) };
        let fabric = Fabric { yarn: untinted, ..Fabric::default() };
        let cloth = fabric.cloth(plain(), &[RED; 2], &[RED; 2]).unwrap();
        assert_eq!(cloth.textures.len(), 1);
    }

    #[test]
    fn colour_and_size_come_from_the_draft_unless_set() {
        let fabric = Fabric {
            yarn: PartialYarn { size: Some(0.5), tint: Some(1.0), ..open() },
            overrides: vec![Override {
                is_warp: Some(false),
                yarn: PartialYarn { color: Some([0.2; 3]), size: Some(0.9), ..open() },
                ..Override::default()
            }],
            ..Fabric::default()
        };
        let yarns = woven(&fabric).unwrap();
        let colors = [RED.color, BLUE.color, [0.2; 3], [0.2; 3]];
        assert_eq!(yarns.clone().map(|yarn| yarn.color), colors);
        assert_eq!(yarns.clone().map(|yarn| yarn.size), [0.5, 0.5, 0.9, 0.9]);
        assert_eq!(yarns[0].specular[1..], [0.0, 0.0]);
        let cloth = fabric.cloth(plain(), &[RED, BLUE], &[RED, BLUE]).unwrap();
        assert_eq!(cloth.yarns.len(), 3, "picks differ in what is overridden only");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let text = |fabric: Fabric| {
            let error = woven(&fabric).unwrap_err();
            let source = std::error::Error::source(&error).map(ToString::to_string);
            format!("{error}: {}", source.unwrap_or_default())
        };
        let of_yarn = |yarn| Fabric { yarn, ..Fabric::default() };
        let of_rule =
            |rule| Fabric { overrides: vec![Override::default(), rule], ..Fabric::default() };
        let d = Override::default;
        assert_eq!(
            text(of_yarn(PartialYarn { tint: Some(2.0), ..open() })),
            "yarn: tint: 2, expected 0 to 1"
        );
        let yarn = PartialYarn { kappa: Some(-1.0), ..open() };
        assert_eq!(
            text(of_rule(Override { color: Some(77), yarn, ..d() })),
            "override 2: kappa: -1, expected -0.999 to 1000"
        );
        assert_eq!(
            text(of_rule(Override { yarn: PartialYarn { delta: Some(0.1), ..open() }, ..d() })),
            "override 2: delta: found a yarn with another kind of highlight, expected window"
        );
        assert_eq!(
            text(of_rule(Override { threads: Some([0, 4]), ..d() })),
            "override 2: threads: 0, expected 1 to 4"
        );
        assert_eq!(
            text(of_rule(Override { threads: Some([9, 4]), ..d() })),
            "override 2: threads: 9, expected 1 to 4"
        );
    }
}
