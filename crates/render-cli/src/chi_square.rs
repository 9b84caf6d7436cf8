//! Whether drawn directions follow the density that is told of them, by Pearson's χ² test.

use glam::{DVec2, DVec3, Vec2, Vec3};
use selvedge_normalize::warp::{disk_to_square, square_to_disk};

use crate::render::sampler::mix;

/// Random numbers from a seed (Steele, Lea & Flood 2014, SplitMix).
#[derive(Clone, Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// 64 bits.
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// A number in [0, 1) of 24 bits.
    pub(crate) fn number(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    /// A point of [0, 1)².
    pub(crate) fn square(&mut self) -> Vec2 {
        Vec2::new(self.number(), self.number())
    }
}

/// The directions that are tested: those around an axis, up to a height 1 − cos.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cap {
    axis: DVec3,
    height: f64,
}

/// How well draws and density agree.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    /// Chance of counts as far from the density as these.
    pub(crate) p_value: f64,
    /// Of the density over the cap.
    pub(crate) integral: f64,
    /// Standard error of the integral.
    pub(crate) error: f64,
    /// Share of draws in the cap.
    pub(crate) share: f64,
    /// Shares of the draws in each cell of the cap, row after row: found, and expected by the density.
    pub(crate) cells: Vec<[f64; 2]>,
}

/// Cells along each side of the square that the cap is mapped to.
pub(crate) const CELLS: usize = 16;
/// Points along each side of a cell at which the density is evaluated.
const POINTS: usize = 32;

/// Draws of each test.
pub(crate) const DRAWS: usize = 100_000;

impl Cap {
    #[cfg(test)]
    pub(crate) const SPHERE: Self = Self { axis: DVec3::Z, height: 2.0 };

    /// The hemisphere about `axis`, unit.
    pub(crate) fn hemisphere(axis: DVec3) -> Self {
        Self { axis, height: 1.0 }
    }

    /// Around the middle of directions, so wide that a `share` of them is inside.
    #[cfg(test)]
    pub(crate) fn around(directions: &[Vec3], share: f64) -> Self {
        let sum: Vec3 = directions.iter().sum();
        let axis = sum.as_dvec3().normalize_or(DVec3::Z);
        let mut cap = Self { axis, height: 0.0 };
        let mut heights: Vec<f64> = directions.iter().map(|w| cap.height_of(*w)).collect();
        heights.sort_by(f64::total_cmp);
        let last = ((share * heights.len() as f64) as usize).min(heights.len() - 1);
        cap.height = (1.2 * heights[last]).min(2.0);
        cap
    }

    fn height_of(&self, w: Vec3) -> f64 {
        0.5 * (w.as_dvec3() - self.axis).length_squared()
    }

    fn direction(&self, square: DVec2) -> Vec3 {
        let disk = square_to_disk(square);
        let depth = self.height * disk.length_squared().min(1.0);
        let across = disk * (self.height * (2.0 - depth)).sqrt();
        let (x, y) = self.axis.any_orthonormal_pair();
        (x * across.x + y * across.y + self.axis * (1.0 - depth)).normalize().as_vec3()
    }

    /// The cell that a direction is in.
    fn cell(&self, w: Vec3) -> Option<usize> {
        let (x, y) = self.axis.any_orthonormal_pair();
        let across = DVec2::new(x.dot(w.as_dvec3()), y.dot(w.as_dvec3()));
        let radius = (self.height_of(w) / self.height).sqrt();
        let square = disk_to_square(across.normalize_or_zero() * radius);
        let index = (square * CELLS as f64).as_usizevec2().min(glam::USizeVec2::splat(CELLS - 1));
        (radius <= 1.0).then_some(index.y * CELLS + index.x)
    }

    /// How [`DRAWS`] draws, of which some may give nothing, fit the density in sr⁻¹, which is asked for
    /// many directions at a time.
    pub(crate) fn fit(
        &self,
        random: &mut Random,
        mut draw: impl FnMut(&mut Random) -> Option<Vec3>,
        density: impl Fn(&[Vec3]) -> Vec<f32>,
    ) -> Fit {
        let mut found = [0.0; CELLS * CELLS];
        for _ in 0..DRAWS {
            if let Some(cell) = draw(random).and_then(|w| self.cell(w)) {
                found[cell] += 1.0;
            }
        }
        let expected: Vec<_> =
            (0..found.len()).map(|cell| self.integral(cell, random, &density)).collect();
        let draws = DRAWS as f64;
        let integral: f64 = expected.iter().map(|part| part.0).sum();
        let share = found.iter().sum::<f64>() / draws;
        let variance: f64 = expected.iter().map(|part| part.1).sum();
        let cells = found.iter().zip(&expected).map(|(found, part)| [found / draws, part.0]);
        let cells = cells.collect();
        let outside = (draws * (1.0 - share), ((1.0 - integral).max(0.0), variance));
        let counts = found.into_iter().zip(expected).chain([outside]).map(|(found, expected)| {
            let (share, variance) = expected;
            Count { found, expected: draws * share, variance: draws * (share + draws * variance) }
        });
        Fit { p_value: p_value(counts), integral, error: variance.sqrt(), share, cells }
    }

    /// Of the density over a cell, and the variance of that estimate: one point in each part of the
    /// cell, at random.
    fn integral(
        &self,
        cell: usize,
        random: &mut Random,
        density: impl Fn(&[Vec3]) -> Vec<f32>,
    ) -> (f64, f64) {
        let place = |index, side| DVec2::new((index % side) as f64, (index / side) as f64);
        let part = std::f64::consts::TAU * self.height / (CELLS * POINTS).pow(2) as f64;
        let (mut sum, mut variance, mut last) = (0.0, 0.0, 0.0);
        let directions = (0..POINTS * POINTS).map(|point| {
            let within = (place(point, POINTS) + random.square().as_dvec2()) / POINTS as f64;
            self.direction((place(cell, CELLS) + within) / CELLS as f64)
        });
        for (point, density) in density(&directions.collect::<Vec<_>>()).into_iter().enumerate() {
            let share = part * f64::from(density);
            sum += share;
            if point % 2 == 1 {
                // Of points at random the square of a difference is the variance of a sum.
                variance += (share - last).powi(2);
            }
            last = share;
        }
        (sum, variance)
    }
}

/// Draws found in a cell, and how many were expected with which variance.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    found: f64,
    expected: f64,
    variance: f64,
}

impl Count {
    fn and(self, other: Self) -> Self {
        Self {
            found: self.found + other.found,
            expected: self.expected + other.expected,
            variance: self.variance + other.variance,
        }
    }
}

/// The chance of counts at least as far from the expected ones, with cells that expect few in one.
fn p_value(counts: impl Iterator<Item = Count>) -> f64 {
    let (mut pooled, small): (Vec<_>, Vec<_>) = counts.partition(|count| count.expected >= 10.0);
    pooled.push(small.into_iter().fold(Count::default(), Count::and));
    let statistic: f64 = pooled
        .iter()
        .map(|count| (count.found - count.expected).powi(2) / count.variance.max(1.0))
        .sum();
    let (a, x) = (0.5 * (pooled.len() - 1).max(1) as f64, 0.5 * statistic);
    // At most Chernoff's bound, since far from what is expected the function is no longer to be trusted.
    let bound = if x > a { (a - x + a * (x / a).ln()).exp() } else { 1.0 };
    pxfm::f_gamma_q(a, x).min(bound)
}

#[test]
fn test_tells_a_density_from_one_that_is_slightly_off() {
    let mut random = Random(1);
    let uniform = |random: &mut Random| Some(Cap::SPHERE.direction(random.square().as_dvec2()));
    let density = |slope: f32| {
        let at = move |w: &Vec3| (1.0 + slope * w.x) / (4.0 * std::f32::consts::PI);
        move |w: &[Vec3]| w.iter().map(at).collect()
    };
    let fit = Cap::SPHERE.fit(&mut random, uniform, density(0.0));
    assert!(fit.p_value > 0.01 && (fit.integral - 1.0).abs() < 1e-6, "{fit:?}");
    let fit = Cap::SPHERE.fit(&mut random, uniform, density(0.1));
    assert!(fit.p_value < 1e-6, "{fit:?}");
    let twice = |w: &[Vec3]| vec![0.5 / std::f32::consts::PI; w.len()];
    let fit = Cap::SPHERE.fit(&mut random, uniform, twice);
    assert!(fit.p_value < 1e-6, "{fit:?}");
}
