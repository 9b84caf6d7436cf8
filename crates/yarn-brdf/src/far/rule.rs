//! Nodes for the highlight of a yarn, as few as it needs.

use core::num::NonZeroU32;

use fearless_simd::Level;
use glam::{DVec2, Vec3Swizzles};
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

/// What finds rules for a yarn: for pairs of directions that are both steep, and for those that are not.
pub(super) type Rules = fn(Level, &Optics<f32>) -> [Rule; 2];

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

    /// The rules of the fewest nodes of which the mean highlight of `optics` is as good as it is said to
    /// be, for pairs of directions that are both steeper than [`GRAZING`] and for those that are not: for
    /// most to [`TYPICAL`] and for all to [`WORST`], relative to what it is or a tenth of its mean
    /// over them, whichever is greater.
    ///
    /// The yardstick is a rule of many nodes.
    pub(super) fn resolving(level: Level, optics: &Optics<f32>) -> [Self; 2] {
        let (&[arc, section], rest) = tried(optics).split_last().expect("there are some rules");
        let finest = Self::new(arc, section);
        let rest: Vec<Self> = rest.iter().map(|&[arc, section]| Self::new(arc, section)).collect();
        let pairs = Halton::<4>::new().points_from(NonZeroU32::MIN).flat_map(|[a, b, c, d]| {
            let pair = [[a, b], [c, d]]
                .map(|[x, y]| square_to_uniform_hemisphere(DVec2::new(x, y)).as_vec3());
            // As an end has them, and as a pick.
            [pair, pair.map(Vec3Swizzles::yxz)].map(|pair| pair.map(Vector::<f32>::of))
        });
        [false, true].map(|is_grazing| {
            let of_kind = pairs.clone().filter(|&[wi, wo]| grazes(wi, wo) == is_grazing);
            let pairs: Vec<[Vector<f32>; 2]> = of_kind.take(PAIRS).collect();
            let all = |rule: &Self| -> Vec<f32> {
                pairs.iter().map(|&pair| rule.of_pair(level, optics, pair)).collect()
            };
            let yardstick = all(&finest);
            let least = 0.1 * yardstick.iter().sum::<f32>() / PAIRS as f32;
            let is_good = |rule: &&Self| {
                let found = all(rule).into_iter().zip(&yardstick);
                let mut errors: Vec<f32> = found
                    .map(|(found, &exact)| (found - exact).abs() / exact.max(least).max(1e-30))
                    .collect();
                errors.sort_by(f32::total_cmp);
                errors[PAIRS * 9 / 10] <= TYPICAL && errors[PAIRS - 1] <= WORST
            };
            rest.iter().find(is_good).unwrap_or(&finest).clone()
        })
    }

    /// Rules of as many nodes as most yarns like that of `optics` need, untried: in a hundredth of the time.
    pub(super) fn usual(_: Level, optics: &Optics<f32>) -> [Self; 2] {
        let rules = tried(optics);
        let [arc, section] = rules[rules.len() / 2];
        [(); 2].map(|()| Self::new(arc, section))
    }

    /// The mean highlight of long white segments for a pair of directions.
    fn of_pair(&self, level: Level, optics: &Optics<f32>, [wi, wo]: [Vector<f32>; 2]) -> f32 {
        dispatch!(level, simd => {
            let [base, _] = highlight::mean(simd, optics, self, wi, wo);
            sum(base.peak + base.uniform)
        })
    }
}

/// Whether a pair of directions takes the second of the rules.
#[inline(always)]
pub(super) fn grazes(wi: Vector<f32>, wo: Vector<f32>) -> bool {
    wi.z.min(wo.z) < GRAZING
}

/// The cosine below which a direction is grazing: there the yarn turns away soon, and a forward peak is
/// seen.
const GRAZING: f32 = 0.2;

/// How many pairs of directions a rule is tried with.
const PAIRS: usize = 400;

/// The errors that nine tenths of the pairs and all of them have at most.
const TYPICAL: f32 = 1e-3;
const WORST: f32 = 3e-3;

/// The numbers of nodes that are tried for `optics`, from few to many.
fn tried(optics: &Optics<f32>) -> &'static [[usize; 2]] {
    match optics.spread {
        Spread::Staple { .. } | Spread::Filament { .. } => &DRAWN,
        // A straight yarn has one inclination.
        Spread::Rough { .. } if optics.u_max == 0.0 => &STRAIGHT,
        Spread::Rough { .. } => &ROUGH,
    }
}

/// Nodes along the arc (around the section of filaments), and around the section, by their number.
const DRAWN: [[usize; 2]; 6] = [[16, 1], [32, 1], [48, 1], [64, 1], [96, 1], [512, 1]];
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
    [48, 32],
    [64, 48],
];
