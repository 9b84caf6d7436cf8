//! Nodes for the highlight of a yarn, as few as it needs.

use core::num::NonZeroU32;

use fearless_simd::{Level, f32x16, prelude::*};
use glam::DVec2;
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_uniform_hemisphere;

use crate::frame::Vector;
use crate::lanes::LANES;
use crate::lanes::dispatch;
use crate::rules::gauss_legendre;
use crate::segment::{Optics, Spread};

use super::{highlight, sum};

/// A number for each lane.
pub(super) type Row = [f32; LANES];

/// Nodes and weights on [−1, 1].
#[derive(Clone, Debug)]
pub(super) struct Rule {
    /// Along the arc, or around the section of filaments.
    pub(super) arc: Vec<[Row; 2]>,
    /// Around the section, for rough fibres.
    pub(super) section: Vec<[Row; 2]>,
}

impl Rule {
    /// `arc` nodes, a multiple of the lanes or a part of them, and for each as many around the section
    /// as `section` tells at least.
    pub(super) fn new(arc: usize, section: usize) -> Self {
        let nodes = gauss_legendre(arc);
        let per_row = LANES / arc.min(LANES);
        let around = gauss_legendre(section.next_multiple_of(per_row));
        let row = |of: &dyn Fn(usize) -> (f64, f64)| {
            [
                core::array::from_fn(|lane| of(lane).0 as f32),
                core::array::from_fn(|lane| of(lane).1 as f32),
            ]
        };
        Self {
            arc: (0..arc.div_ceil(LANES))
                .map(|block| row(&|lane| nodes[LANES * block + lane % arc.min(LANES)]))
                .collect(),
            section: around
                .chunks(per_row)
                .map(|some| row(&|lane| some[lane / arc.min(LANES)]))
                .collect(),
        }
    }

    /// How many nodes there are.
    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        LANES * self.arc.len() * self.section.len()
    }

    /// Their memory, in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.arc.as_slice()) + size_of_val(self.section.as_slice())
    }

    /// The rule of the fewest nodes of which the mean highlight of `optics` is as good as it is said to
    /// be: for most pairs of directions to [`TYPICAL`] and for all but one to [`WORST`], relative to what it
    /// is or a tenth of its mean over them, whichever is greater.
    ///
    /// The yardstick is a rule of many nodes.
    pub(super) fn resolving(level: Level, optics: &Optics<f32>) -> Self {
        let rules = match optics.spread {
            Spread::Staple { .. } | Spread::Filament { .. } => DRAWN.as_slice(),
            // A straight yarn has one inclination.
            Spread::Rough { .. } if optics.u_max == 0.0 => STRAIGHT.as_slice(),
            Spread::Rough { .. } => ROUGH.as_slice(),
        };
        let (&[arc, section], rest) = rules.split_last().expect("there are some rules");
        let finest = Self::new(arc, section);
        let pairs: Vec<[Vector<f32>; 2]> = Halton::<4>::new()
            .points_from(NonZeroU32::MIN)
            .take(PAIRS)
            .map(|[a, b, c, d]| {
                [[a, b], [c, d]].map(|[x, y]| {
                    Vector::<f32>::of(square_to_uniform_hemisphere(DVec2::new(x, y)).as_vec3())
                })
            })
            .collect();
        let all = |rule: &Self| -> Vec<f32> {
            pairs.iter().map(|&pair| rule.of_pair(level, optics, pair)).collect()
        };
        let yardstick = all(&finest);
        let least = 0.1 * yardstick.iter().sum::<f32>() / PAIRS as f32;
        let is_good = |rule: &Self| {
            let found = all(rule);
            let mut errors: Vec<f32> = found
                .into_iter()
                .zip(&yardstick)
                .map(|(found, &exact)| (found - exact).abs() / exact.max(least).max(1e-30))
                .collect();
            errors.sort_by(f32::total_cmp);
            errors[PAIRS * 9 / 10] <= TYPICAL && errors[PAIRS - 2] <= WORST
        };
        let mut coarser = rest.iter().map(|&[arc, section]| Self::new(arc, section));
        coarser.find(is_good).unwrap_or(finest)
    }

    /// The mean highlight of long white segments for a pair of directions.
    fn of_pair(&self, level: Level, optics: &Optics<f32>, [wi, wo]: [Vector<f32>; 2]) -> f32 {
        dispatch!(level, simd => {
            let load = |row: &Row| f32x16::simd_from(simd, *row);
            let [base, _] = highlight::mean(optics, self, load, wi, wo);
            sum(base.peak + base.uniform)
        })
    }
}

/// How many pairs of directions a rule is tried with.
const PAIRS: usize = 200;

/// The errors that nine tenths of the pairs and all but one have at most.
const TYPICAL: f32 = 1.5e-3;
const WORST: f32 = 1e-2;

/// Nodes along the arc (around the section of filaments), and around the section, by their number.
const DRAWN: [[usize; 2]; 6] = [[16, 1], [32, 1], [48, 1], [64, 1], [128, 1], [512, 1]];
const STRAIGHT: [[usize; 2]; 5] = [[1, 16], [1, 32], [1, 48], [1, 64], [1, 512]];
const ROUGH: [[usize; 2]; 13] = [
    [8, 6],
    [8, 8],
    [16, 6],
    [8, 12],
    [16, 8],
    [8, 16],
    [16, 12],
    [32, 8],
    [16, 16],
    [32, 12],
    [32, 24],
    [64, 32],
    [128, 64],
];
