//! `Variants`: the yarns that textures and noise make of one, and tables that bound them all.

use std::sync::Arc;

use selvedge_normalize::halton::Halton;
use selvedge_normalize::scale::{Mode, ScaleError};

use crate::noise::MAX_INTENSITY;
use crate::parameter::Parameter;
use crate::reflectance::{Reflectance, Subject};
use crate::segment::{Mapping, shaded_angles};
use crate::texture::{Target, Texture};
use crate::yarn::{Noise, Yarn};

/// How many yarns between those of the grid are looked at.
const BETWEEN: usize = 24;

/// The yarns that textures and noise make of one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Variants {
    /// Those at even steps of the parameters that change; the yarn itself if none do.
    pub(crate) grid: Vec<Yarn>,
    /// Some of those between, to see how far they are from the grid.
    between: Vec<Yarn>,
}

impl Variants {
    /// The variants of `yarn` over the ranges of `textures` and of its noise.
    pub(crate) fn of(yarn: &Yarn, textures: &[(Target, Arc<dyn Texture>)]) -> Self {
        let ranges = ranges(yarn, textures);
        let steps = match ranges.len() {
            0 | 1 => 9,
            2 => 4,
            3 => 3,
            _ => 2,
        };
        let mut grid = vec![yarn.clone()];
        for (parameter, [low, high]) in &ranges {
            let values: Vec<f64> = (0..steps)
                .map(|step| low + f64::from(step) / f64::from(steps - 1) * (high - low))
                .collect();
            grid = grid
                .into_iter()
                .flat_map(|variant| {
                    values.iter().map(move |&value| with(&variant, parameter, value))
                })
                .collect();
        }
        let count = if ranges.is_empty() { 0 } else { BETWEEN };
        // More ranges than dimensions share some; any yarn within them will do.
        let between =
            Halton::<16>::new().points_from(core::num::NonZeroU32::MIN).take(count).map(|at| {
                ranges.iter().zip(at.into_iter().cycle()).fold(
                    yarn.clone(),
                    |variant, ((parameter, [low, high]), share)| {
                        with(&variant, parameter, low + share * (high - low))
                    },
                )
            });
        Self { between: between.collect(), grid }
    }

    /// The greatest inclination with which one of them is shaded, rad.
    pub(crate) fn steepest(&self) -> f64 {
        self.grid.iter().map(|variant| shaded_angles(variant, false).0).fold(0.0, f64::max)
    }

    /// Each with the inclination `u_max`, rad, if it has a greater one.
    pub(crate) fn lowered_to(&self, u_max: f64) -> Self {
        self.map(|variant| Yarn { u_max: variant.u_max.min(u_max), ..variant.clone() })
    }

    fn map(&self, change: impl Fn(&Yarn) -> Yarn) -> Self {
        Self {
            grid: self.grid.iter().map(&change).collect(),
            between: self.between.iter().map(&change).collect(),
        }
    }
}

/// The parameters that shape the highlight and change, with their ranges.
fn ranges(
    yarn: &Yarn,
    textures: &[(Target, Arc<dyn Texture>)],
) -> Vec<(&'static Parameter, [f64; 2])> {
    let mut ranges: Vec<(&'static Parameter, [f64; 2])> = textures
        .iter()
        .filter_map(|(target, texture)| match target {
            Target::Parameter(name) if *name != "opacity" => {
                Some((Yarn::parameter(name)?, texture.range().map(f64::from)))
            }
            _ => None,
        })
        .collect();
    let amplitude = yarn.noise.u_max;
    if let Some(u_max) = Yarn::parameter("u_max").filter(|_| amplitude > 0.0) {
        let textured = ranges.iter().position(|(parameter, _)| parameter.name == u_max.name);
        let [low, high] = textured.map_or([yarn.u_max; 2], |i| ranges.swap_remove(i).1);
        ranges.push((u_max, [low - amplitude, high + amplitude]));
    }
    for (parameter, range) in &mut ranges {
        *range = range.map(|limit| limit.clamp(parameter.low, parameter.high));
    }
    ranges
}

fn with(yarn: &Yarn, parameter: &Parameter, value: f64) -> Yarn {
    let mut yarn = yarn.clone();
    parameter.set(&mut yarn, value);
    yarn
}

/// The tables found so far, so that yarns that differ in colour alone share one.
pub(crate) struct Tables {
    mapping: Mapping,
    mode: Mode,
    known: Vec<(Variants, bool, f64, Arc<Reflectance>)>,
}

impl Tables {
    pub(crate) fn new(mapping: Mapping, mode: Mode) -> Self {
        Self { mapping, mode, known: vec![] }
    }

    /// The table that bounds those of all `variants` for shapes up to `ratio_max`.
    pub(crate) fn find(
        &mut self,
        variants: &Variants,
        is_straight: bool,
        ratio_max: f64,
    ) -> Result<Arc<Reflectance>, ScaleError> {
        let neutral = Yarn::default();
        let key = variants.map(|yarn| Yarn {
            u_max: if is_straight { 0.0 } else { yarn.u_max },
            psi: yarn.psi,
            kappa: if is_straight { 0.0 } else { yarn.kappa },
            smoothing: yarn.smoothing,
            highlight: yarn.highlight,
            phase: yarn.phase.clone(),
            noise: Noise { intensity: yarn.noise.intensity, ..neutral.noise },
            ..neutral.clone()
        });
        let is_same = |known: &&(Variants, bool, f64, Arc<Reflectance>)| {
            known.0 == key && known.1 == is_straight && known.2 == ratio_max
        };
        if let Some((.., table)) = self.known.iter().find(is_same) {
            return Ok(table.clone());
        }
        let (mapping, mode) = (self.mapping, self.mode);
        let subject = |yarn| Subject { yarn, is_straight, mapping, ratio_max };
        let tables: Result<Vec<_>, _> =
            key.grid.iter().map(|yarn| Reflectance::new(&subject(yarn), mode)).collect();
        let mut table = Reflectance::envelope(tables?);
        let excess = |yarn| table.excess(&subject(yarn), mode);
        let excess = key.between.iter().map(excess).fold(0.0, f64::max);
        if !key.between.is_empty() {
            // What was not looked at may be worse.
            let margin = 1.5 * excess + 0.003;
            table.lift(margin);
            if mode != Mode::None {
                table.scale_divisors(1.0 + margin);
            }
        }
        if mode == Mode::Pointwise {
            // A grain may be that much brighter than the mean.
            let strength = key.grid.iter().map(|yarn| yarn.noise.intensity).fold(0.0, f64::max);
            table.scale_divisors(1.0 - strength + strength * MAX_INTENSITY);
        }
        let table = Arc::new(table);
        self.known.push((key, is_straight, ratio_max, table.clone()));
        Ok(table)
    }
}
