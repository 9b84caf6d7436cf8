//! The mean of a function over the unit cube, with an estimate of its error and a stop rule.

use core::num::NonZeroU32;

use crate::halton::{Halton, mix};
use crate::search::NotFinite;

/// Number of independent estimates whose spread gives the error.
const REPLICATES: usize = 16;

/// The share of [`Sampling::at_least`] that must carry weight before the error is believed.
const CONTRIBUTING: f64 = 1.0 / 16.0;

/// Two-sided 99.9 % quantile of Student's t with `REPLICATES − 1` = 15 degrees of freedom.
const STUDENT_T: f64 = 4.0728;

/// When to stop adding points, and which of the equally good sets of points to use.
///
/// Counts are totals over all replicates and are rounded up to a multiple of 16.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Stop as soon as the absolute error is estimated to be at most this; 0 or NaN spends all points.
    pub tolerance: f64,
    /// Points taken before the error is believed. A feature of the integrand that covers less than
    /// about `1 / at_least` of the cube can be missed altogether, and then the error does not show it;
    /// if there is little besides that feature, this is noticed (see [`mean`]), and `1 / at_most` counts.
    pub at_least: NonZeroU32,
    /// The most points taken, also if the tolerance is not reached; overrides `at_least`.
    pub at_most: NonZeroU32,
    /// Equal seeds give equal bits; different seeds give independent estimates.
    pub seed: u64,
}

impl Default for Sampling {
    /// An absolute error of 2·10⁻³, a tenth of the default margin of a factor, with 1024 to 65,536 points.
    fn default() -> Self {
        let count = |n| NonZeroU32::new(n).expect("the default counts are not 0");
        Self { tolerance: 2e-3, at_least: count(1 << 10), at_most: count(1 << 16), seed: 0 }
    }
}

/// A value with an estimate of its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The estimated value.
    pub value: f64,
    /// The true value is expected within `value ± error` in 99.9 % of all seeds.
    pub error: f64,
    /// Number of points used.
    pub points: u32,
}

/// The mean of `f` over the unit cube [0, 1)^D, D from 1 to 16.
///
/// Sixteen copies of the Halton sequence, each shifted modulo 1 by its own hash of the seed (Cranley
/// & Patterson 1976), give sixteen independent unbiased estimates. Their mean is the value; the
/// error is 4.07 of their standard errors, 99.9 % of Student's distribution. For a smooth f it falls
/// roughly as 1/n.
///
/// The number of points doubles until the error is within the tolerance and can be believed. n values
/// v of which few are large say no more than `(Σ|v|)² / Σv²` equal ones (Owen 2013, chapter 9): this
/// effective number must reach a sixteenth of [`Sampling::at_least`]. An f that is 0 wherever it is
/// looked at has none, so all points are spent on it.
///
/// # Errors
///
/// [`NotFinite`] names the first point at which f is infinite or not a number.
///
/// # Examples
///
/// ```
/// use selvedge_normalize::estimate::{Sampling, mean};
/// let third = mean(|[x]: [f64; 1]| x * x, &Sampling::default())?;
/// assert!((third.value - 1.0 / 3.0).abs() <= third.error && third.error <= 2e-3);
/// # Ok::<(), selvedge_normalize::search::NotFinite<1>>(())
/// ```
pub fn mean<const D: usize>(
    f: impl Fn([f64; D]) -> f64,
    sampling: &Sampling,
) -> Result<Estimate, NotFinite<D>> {
    try_mean(|at| NotFinite::check(f(at), at), sampling)
}

/// [`mean`] of a function that can fail; the first failure is returned. `f` returns finite values.
pub(crate) fn try_mean<const D: usize, E>(
    f: impl Fn([f64; D]) -> Result<f64, E>,
    sampling: &Sampling,
) -> Result<Estimate, E> {
    let per_replicate = |total: NonZeroU32| total.get().div_ceil(REPLICATES as u32);
    let last = per_replicate(sampling.at_most);
    let mut target = per_replicate(sampling.at_least).min(last);
    let shifts = shifts(sampling.seed);
    let mut points = Halton::<D>::new().points_from(NonZeroU32::MIN);
    let mut sums = [0.0; REPLICATES];
    let mut weights = Weights::default();
    let mut done = 0;
    loop {
        for point in points.by_ref().take((target - done) as usize) {
            for (sum, shift) in sums.iter_mut().zip(&shifts) {
                let value = f(shifted(point, shift))?;
                *sum += value;
                weights.add(value);
            }
        }
        done = target;
        let (value, error) = student(sums.map(|sum| sum / f64::from(done)));
        let is_believed = weights.effective() >= CONTRIBUTING * f64::from(sampling.at_least.get());
        if (error <= sampling.tolerance && is_believed) || done == last {
            return Ok(Estimate { value, error, points: done.saturating_mul(REPLICATES as u32) });
        }
        target = done.saturating_mul(2).min(last);
    }
}

/// How evenly a sum is spread over its terms.
#[derive(Debug, Default)]
struct Weights {
    sum: f64,
    squares: f64,
}

impl Weights {
    fn add(&mut self, value: f64) {
        self.sum += value.abs();
        self.squares += value * value;
    }

    /// How many terms of equal size would say as much; 0 if the squares of all of them are 0.
    fn effective(&self) -> f64 {
        if self.squares > 0.0 { self.sum * (self.sum / self.squares) } else { 0.0 }
    }
}

/// One shift in [0, 1)^D for each replicate: the leading 53 bits of a hash.
fn shifts<const D: usize>(seed: u64) -> [[f64; D]; REPLICATES] {
    let key = mix(seed);
    core::array::from_fn(|r| {
        core::array::from_fn(|d| {
            let hash = mix(key.wrapping_add((r * D + d) as u64));
            (hash >> 11) as f64 / (1u64 << 53) as f64
        })
    })
}

/// The point moved by `shift` on the torus, in [0, 1)^D.
fn shifted<const D: usize>(point: [f64; D], shift: &[f64; D]) -> [f64; D] {
    core::array::from_fn(|d| {
        let sum = point[d] + shift[d];
        if sum < 1.0 { sum } else { sum - 1.0 }
    })
}

/// Mean of independent estimates and the half width of its 99.9 % interval.
fn student(means: [f64; REPLICATES]) -> (f64, f64) {
    let n = REPLICATES as f64;
    let mean = means.iter().sum::<f64>() / n;
    let squares: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
    (mean, STUDENT_T * (squares / (n * (n - 1.0))).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampling(tolerance: f64, at_least: u32, at_most: u32) -> Sampling {
        let count = |n| NonZeroU32::new(n).expect("not 0");
        Sampling { tolerance, at_least: count(at_least), at_most: count(at_most), seed: 3 }
    }

    #[test]
    fn the_stop_rule_ends_at_the_tolerance_or_at_the_budget() {
        let f = |[x, y]: [f64; 2]| x * y;
        let points = |s: Sampling| mean(f, &s).expect("finite").points;
        assert_eq!(points(sampling(1.0, 1, 1 << 20)), 16);
        assert_eq!(points(sampling(1.0, 100, 1 << 20)), 112);
        assert_eq!(points(sampling(0.0, 100, 1000)), 1008);
        assert_eq!(points(sampling(f64::NAN, 1000, 10)), 16);
        let some = mean(f, &sampling(1e-4, 16, 1 << 20)).expect("finite");
        assert!(some.error <= 1e-4 && some.points < 1 << 20, "{some:?}");
        assert!((some.value - 0.25).abs() <= some.error, "{some:?}");
    }

    #[test]
    fn a_sum_that_stands_on_few_points_is_not_believed() {
        let peak = |[x, y]: [f64; 2]| {
            let r_sq = (x - 0.3).powi(2) + (y - 0.6).powi(2);
            (-r_sq / 2e-4).exp() / (2e-4 * core::f64::consts::PI)
        };
        // The tails that most of 256 points see are within any such tolerance; the peak is not.
        let narrow = mean(peak, &sampling(1e-2, 256, 1 << 18)).expect("finite");
        assert!(
            narrow.points > 1 << 12 && (narrow.value - 1.0).abs() <= narrow.error,
            "{narrow:?}"
        );
        let zero = mean(|_: [f64; 2]| 0.0, &sampling(1e-2, 256, 4096)).expect("finite");
        assert_eq!(zero, Estimate { value: 0.0, error: 0.0, points: 4096 });
        let constant = mean(|_: [f64; 2]| -2.0, &sampling(1e-2, 256, 4096)).expect("finite");
        assert_eq!(constant, Estimate { value: -2.0, error: 0.0, points: 256 });
    }

    #[test]
    fn the_stated_error_holds_in_99_of_100_seeds() {
        let misses = (0..1000).filter(|seed| {
            let s = Sampling { seed: *seed, ..sampling(1e-3, 64, 4096) };
            let e = mean(|[x, y, z]: [f64; 3]| (x + y * z).exp(), &s).expect("finite");
            // (e − 1) · Σ 1/(k! (k+1)²), the series of ∫∫ exp(yz).
            let exact = (1f64.exp() - 1.0) * 1.317_902_151_454_404;
            (e.value - exact).abs() > e.error
        });
        let misses = misses.count();
        assert!(misses <= 10, "{misses} of 1000 seeds miss");
    }

    #[test]
    fn shifts_are_in_the_unit_interval_and_differ() {
        let mut all: Vec<f64> =
            (0..50).flat_map(|seed| shifts::<3>(seed).into_iter().flatten()).collect();
        assert!(all.iter().all(|s| (0.0..1.0).contains(s)));
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        assert!((mean - 0.5).abs() < 0.03, "{mean}");
        all.sort_by(f64::total_cmp);
        assert!(all.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
