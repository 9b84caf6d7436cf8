//! `Variants`: the yarns that textures and noise make of one, and tables that bound them all.

use core::mem::discriminant;
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

/// Tables that are known, so that yarns that differ in colour alone share one: the last used at the
/// end.
#[derive(Debug, Default)]
pub(crate) struct Known(Vec<(Key, Arc<Reflectance>)>);

/// What a table depends on.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    variants: Variants,
    is_straight: bool,
    ratio_max: f64,
    mapping: Mapping,
    mode: Mode,
}

/// Most tables that are remembered, of 20 kB each.
const MAX_KNOWN: usize = 64;

impl Known {
    /// Forgets those that were not used for longest.
    pub(crate) fn forget_old(&mut self) {
        let excess = self.0.len().saturating_sub(MAX_KNOWN);
        self.0.drain(..excess);
    }

    /// How many there are.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    fn find(&mut self, key: &Key) -> Option<Arc<Reflectance>> {
        let index = self.0.iter().position(|(known, _)| known == key)?;
        let entry = self.0.remove(index);
        let table = Arc::clone(&entry.1);
        self.0.push(entry);
        Some(table)
    }

    /// The table of the most similar yarn, if there is one whose highlight is of the same kind.
    fn nearest(&self, key: &Key) -> Option<Arc<Reflectance>> {
        let distances =
            self.0.iter().filter_map(|(known, table)| Some((key.distance(known)?, table)));
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(_, table)| Arc::clone(table))
    }
}

impl Key {
    /// How unlike `other` is, as a sum of relative differences; `None` if it is of another kind.
    fn distance(&self, other: &Self) -> Option<f64> {
        let is_alike = (self.is_straight, self.mapping, self.mode)
            == (other.is_straight, other.mapping, other.mode);
        let (a, b) = (self.variants.grid.first()?, other.variants.grid.first()?);
        let is_alike = is_alike && discriminant(&a.highlight) == discriminant(&b.highlight);
        if !is_alike || discriminant(&a.phase) != discriminant(&b.phase) {
            return None;
        }
        let difference = |a: f64, b: f64| (a - b).abs() / (a.abs() + b.abs()).max(1e-9);
        let of_parameters = Yarn::parameters()
            .iter()
            .filter_map(|parameter| Some(difference(parameter.of(a)?, parameter.of(b)?)));
        Some(difference(self.ratio_max, other.ratio_max) + of_parameters.sum::<f64>())
    }
}

/// Finds tables among those that are known, or works them out.
pub(crate) struct Tables<'a> {
    pub(crate) mapping: Mapping,
    pub(crate) mode: Mode,
    pub(crate) known: &'a mut Known,
    /// Whether a similar one is good enough.
    pub(crate) is_sketch: bool,
    /// Whether somebody still wants them.
    pub(crate) goes_on: &'a dyn Fn() -> bool,
}

impl Tables<'_> {
    /// The table that bounds those of all `variants` for shapes up to `ratio_max`; `None` if nobody
    /// wants it any more.
    pub(crate) fn find(
        &mut self,
        variants: &Variants,
        is_straight: bool,
        ratio_max: f64,
    ) -> Result<Option<Arc<Reflectance>>, ScaleError> {
        let (mapping, mode) = (self.mapping, self.mode);
        let neutral = Yarn::default();
        let variants = variants.map(|yarn| Yarn {
            u_max: if is_straight { 0.0 } else { yarn.u_max },
            psi: yarn.psi,
            kappa: if is_straight { 0.0 } else { yarn.kappa },
            smoothing: yarn.smoothing,
            highlight: yarn.highlight,
            phase: yarn.phase.clone(),
            noise: Noise { intensity: yarn.noise.intensity, ..neutral.noise },
            ..neutral.clone()
        });
        let key = Key { variants, is_straight, ratio_max, mapping, mode };
        let known = self.known.find(&key);
        let known = known.or_else(|| self.known.nearest(&key).filter(|_| self.is_sketch));
        if known.is_some() {
            return Ok(known);
        }
        let Some(table) = self.work_out(&key)? else { return Ok(None) };
        let table = Arc::new(table);
        self.known.0.push((key, Arc::clone(&table)));
        Ok(Some(table))
    }

    fn work_out(&self, key: &Key) -> Result<Option<Reflectance>, ScaleError> {
        let &Key { ref variants, is_straight, ratio_max, mapping, mode } = key;
        let subject = |yarn| Subject { yarn, is_straight, mapping, ratio_max };
        let new = |yarn| Reflectance::new(&subject(yarn), mode, self.goes_on).transpose();
        let tables: Result<Vec<_>, _> = variants.grid.iter().map_while(new).collect();
        let tables = tables?;
        if tables.len() < variants.grid.len() {
            return Ok(None);
        }
        let mut table = Reflectance::envelope(tables);
        let mut excess: f64 = 0.0;
        for yarn in &variants.between {
            if !(self.goes_on)() {
                return Ok(None);
            }
            excess = excess.max(table.excess(&subject(yarn), mode));
        }
        if !variants.between.is_empty() {
            // What was not looked at may be worse.
            let margin = 1.5 * excess + 0.003;
            table.lift(margin);
            if mode != Mode::None {
                table.scale_divisors(1.0 + margin);
            }
        }
        if mode == Mode::Pointwise {
            // A grain may be that much brighter than the mean.
            let strength =
                variants.grid.iter().map(|yarn| yarn.noise.intensity).fold(0.0, f64::max);
            table.scale_divisors(1.0 - strength + strength * MAX_INTENSITY);
        }
        Ok(Some(table))
    }
}
