//! The values of one cloth, of which all are looked at.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use selvedge_yarn_brdf::Instructions;

use super::{
    super::{
        albedo::{Tier, albedo, footprint},
        histogram::Differences,
        random::Random,
        surface::Surface,
        tuple::{Tuple, Tuples},
    },
    variant::Variant,
};
use crate::args::{Angles, MeasureOptions};

/// Greatest median of the relative error of f in f32.
pub(super) const MEDIAN: f64 = 5e-7;
/// Greatest relative error of all but one in a thousand values.
pub(super) const FEW: f64 = 1e-4;
/// Greatest share of values whose highlight only one precision has.
pub(super) const FLIPS: f64 = 1e-4;

/// Below this a value counts as 0, sr⁻¹: some of its factors may not be normal numbers of f32.
const DARK: f64 = 1e-30;

/// Directions in which the energy is looked at, points of each sum, standard errors that are granted, and
/// what the sums themselves may be off by.
const DIRECTIONS: u64 = 8;
const POINTS: u64 = 1 << 13;
const GRANTED: f64 = 6.0;
const TOLERANCE: f64 = 5e-3;

/// Tuples of one piece of work.
const BLOCK: u64 = 4096;

/// What was found of the values of a cloth.
#[derive(Clone, Debug, Default)]
pub(super) struct Examination {
    /// Numbers looked at.
    pub(super) values: u64,
    pub(super) not_a_number: u64,
    pub(super) infinite: u64,
    pub(super) negative: u64,
    /// Directions to which more is reflected or let through than there is.
    pub(super) too_bright: u64,
    /// Tuples whose batch has other bits than a single point.
    pub(super) differing: u64,
    /// Values whose highlight only one precision has.
    pub(super) flips: u64,
    /// Relative errors of f in f32, flips aside.
    pub(super) errors: Differences<Tuple>,
    /// The first fault, flip and difference.
    first: [Option<(f64, Tuple)>; 3],
}

/// What [`Examination::examples`] are of.
const KINDS: [&str; 3] = ["not finite or negative", "flip", "batch differs"];

impl Examination {
    /// That of `variant`, whose surface this is, from `count` tuples.
    pub(super) fn new(
        options: &MeasureOptions,
        stream: u64,
        variant: &Variant,
        mut surface: Box<dyn Surface>,
        count: u64,
    ) -> Self {
        let blocks = count.div_ceil(BLOCK);
        let tuples: Vec<Vec<Tuple>> = (0..blocks)
            .map(|block| {
                let mut random = Random::new(options.seed, stream << 32 | block);
                let tuples = (0..BLOCK.min(count)).map(|_| {
                    let tuple = Tuple::random(&mut random, &variant.cloth);
                    Tuple { uv: variant.origin + tuple.uv / variant.cloth.scale, ..tuple }
                });
                tuples.collect()
            })
            .collect();
        let all = tuples.par_iter().map(|tuples| single_points(&*surface, variant, tuples));
        let (singles, found): (Vec<Vec<Vec3>>, Vec<Self>) = all.unzip();
        let mut found = found.into_iter().fold(Self::default(), |mut all, own| {
            all.merge(own);
            all
        });
        for instructions in Instructions::available() {
            surface.use_instructions(instructions);
            let batches = tuples.par_iter().zip(&singles).map(|(tuples, singles)| {
                let mut found = Self::default();
                let values = Tuples::new(tuples).eval(&*surface);
                for ((tuple, single), value) in tuples.iter().zip(singles).zip(values) {
                    found.look_at(value.as_dvec3(), tuple);
                    if value.to_array().map(f32::to_bits) != single.to_array().map(f32::to_bits) {
                        found.differing += 1;
                        found.first[2].get_or_insert((value.max_element().into(), *tuple));
                    }
                }
                found
            });
            found.merge(batches.reduce(Self::default, |mut a, b| {
                a.merge(b);
                a
            }));
        }
        found.too_bright = too_bright(options, stream, variant, &*surface);
        found
    }

    /// Values that are not finite or are negative.
    pub(super) fn faults(&self) -> u64 {
        self.not_a_number + self.infinite + self.negative
    }

    /// Takes in another.
    pub(super) fn merge(&mut self, other: Self) {
        self.values += other.values;
        self.not_a_number += other.not_a_number;
        self.infinite += other.infinite;
        self.negative += other.negative;
        self.too_bright += other.too_bright;
        self.differing += other.differing;
        self.flips += other.flips;
        self.errors = std::mem::take(&mut self.errors).merged(other.errors);
        for (own, other) in self.first.iter_mut().zip(other.first) {
            *own = own.or(other);
        }
    }

    /// What stands out, each with its value and where it is.
    pub(super) fn examples(&self) -> Vec<(&'static str, f64, Tuple)> {
        let worst = self.errors.worst.map(|(error, tuple)| ("greatest error", error, tuple));
        let first = self.first.iter().zip(KINDS);
        let first =
            first.filter_map(|(first, kind)| first.map(|(value, tuple)| (kind, value, tuple)));
        worst.into_iter().chain(first).collect()
    }

    /// Takes in one value.
    fn look_at(&mut self, value: DVec3, tuple: &Tuple) {
        self.values += 1;
        let fault = if value.is_nan() {
            &mut self.not_a_number
        } else if !value.is_finite() {
            &mut self.infinite
        } else if value.min_element() < 0.0 {
            &mut self.negative
        } else {
            return;
        };
        *fault += 1;
        self.first[0].get_or_insert((value.min_element(), *tuple));
    }

    /// Takes in the error of f in f32.
    fn compare(&mut self, surface: &dyn Surface, single: Vec3, double: DVec3, tuple: &Tuple) {
        let single = single.as_dvec3();
        let scale = double.max_element();
        if scale.max(single.max_element()) < DARK {
            return;
        }
        let error = (single - double).abs().max_element() / scale;
        // Only where it matters: telling takes longer than evaluating.
        let is_close = error < 1e-3;
        let is_flip = !is_close && {
            let Tuple { uv, wi, wo } = *tuple;
            let shader = surface.shader();
            let lobes = shader.explain(uv, wi.single().as_dvec3(), wo.single().as_dvec3());
            let of_double = lobes.is_some_and(|of| of.lobes[0] != DVec3::ZERO);
            let of_single = shader.eval_lobes(uv, wi.single(), wo.single()).specular != Vec3::ZERO;
            of_double != of_single
        };
        if is_flip {
            self.flips += 1;
            self.first[1].get_or_insert((error, *tuple));
        } else {
            self.errors.add(error, *tuple);
        }
    }
}

/// The values of single points and of the reference, of samples and of the far field.
fn single_points(
    surface: &dyn Surface,
    variant: &Variant,
    tuples: &[Tuple],
) -> (Vec<Vec3>, Examination) {
    let footprint = footprint(&variant.cloth);
    let mut found = Examination::default();
    let mut random = Random::new(0, tuples.len() as u64);
    let values = tuples.iter().map(|tuple| {
        let Tuple { uv, wi, wo } = *tuple;
        let (i, o) = (wi.single(), wo.single());
        let single = surface.eval(uv, i, o);
        let double = surface.reference(uv, i.as_dvec3(), o.as_dvec3());
        for value in [single.as_dvec3(), double, surface.far_eval(&footprint, i, o).as_dvec3()] {
            found.look_at(value, tuple);
        }
        for pdf in [surface.pdf(uv, i, o), surface.far_pdf(&footprint, i, o)] {
            found.look_at(DVec3::splat(pdf.into()), tuple);
        }
        let xi = random.xi();
        for sample in [surface.sample(uv, o, xi), surface.far_sample(&footprint, o, xi)] {
            let Some(sample) = sample else { continue };
            found.look_at(sample.weight.as_dvec3(), tuple);
            found.look_at(DVec3::splat(sample.pdf.into()), tuple);
        }
        found.compare(surface, single, double, tuple);
        single
    });
    let values = values.collect();
    (values, found)
}

/// How many of some directions are sent more than there is.
fn too_bright(
    options: &MeasureOptions,
    stream: u64,
    variant: &Variant,
    surface: &dyn Surface,
) -> u64 {
    let cloth = &variant.cloth;
    let through = 1.0 - f64::from(surface.shader().far_opacity(&footprint(cloth)));
    let directions = (0..DIRECTIONS).into_par_iter().filter(|&index| {
        let mut random = Random::new(options.seed ^ 0xe4e5, stream << 32 | index);
        let wo =
            Angles { theta_deg: random.between(0.0, 89.0), phi_deg: random.between(0.0, 360.0) };
        let sums = (options.seed, options.count(POINTS));
        let found = albedo(surface, cloth, Tier::Batch, wo.single(), sums);
        let excess = found.mean + through - GRANTED * found.error;
        let is_kept = excess.max_element() <= 1.0 + TOLERANCE;
        !is_kept
    });
    directions.count() as u64
}
