//! The maximum of a function over the unit cube: Halton exploration, then local refinement.

use core::{fmt, num::NonZeroU32};

use crate::halton::Halton;

/// Steps shorter than this are not tried: the maximum is then known to about its square.
const SHORTEST_STEP: f64 = 1.0 / (1 << 16) as f64;

/// How much work [`maximize`] does.
///
/// The default, 1600 points and 8 refinements of at most 150 evaluations, is meant for a smooth
/// function of four variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Search {
    /// Number of Halton points looked at, from index 1.
    pub explore: NonZeroU32,
    /// Number of starts that are refined: the best points no two of which are neighbours.
    pub refine: u32,
    /// The most evaluations spent on refining each start.
    pub steps: u32,
}

impl Default for Search {
    fn default() -> Self {
        Self { explore: NonZeroU32::new(1600).expect("1600 is not 0"), refine: 8, steps: 150 }
    }
}

/// The largest value found and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Maximum<const D: usize> {
    /// The function's value at `at`.
    pub value: f64,
    /// Where it was found, in [0, 1]^D.
    pub at: [f64; D],
    /// Number of evaluations in the whole search; stays at `u32::MAX` if there were more.
    pub evaluations: u32,
}

/// The function to be maximised is not finite at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NotFinite<const D: usize> {
    /// The point, in [0, 1]^D.
    pub at: [f64; D],
    /// The value there: infinite or not a number.
    pub value: f64,
}

impl<const D: usize> fmt::Display for NotFinite<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:?}: {}, expected a finite value", self.at, self.value)
    }
}

impl<const D: usize> core::error::Error for NotFinite<D> {}

impl<const D: usize> NotFinite<D> {
    /// The value found at `at`, if it is finite.
    pub(crate) fn check(value: f64, at: [f64; D]) -> Result<f64, Self> {
        if value.is_finite() { Ok(value) } else { Err(Self { at, value }) }
    }
}

/// The maximum of `f` over the closed unit cube [0, 1]^D, D from 1 to 16.
///
/// First f is evaluated at Halton points in the first D prime bases, from index 1. Then the best of
/// them, no two closer than the mean spacing of the points along every axis, are refined: a step up
/// and down each axis, a stride along the sum of those that helped, and half the step when none did
/// (Hooke & Jeeves 1961), clamped to the cube. For a smooth f such a search ends at a point from
/// which no feasible direction leads up (Kolda, Lewis & Torczon 2003, section 8.1), also on a face.
///
/// The result is a lower bound of the true maximum: a peak narrower than the spacing of the points,
/// about `explore^(−1/D)`, can be missed. Nothing is random: equal functions give equal bits.
///
/// # Errors
///
/// [`NotFinite`] names the first point at which f is infinite or not a number.
///
/// # Examples
///
/// ```
/// use selvedge_normalize::search::{Search, maximize};
/// let hill = |[x, y]: [f64; 2]| 3.0 - (x - 0.25).powi(2) - (y - 1.5).powi(2);
/// let top = maximize(hill, &Search::default())?;
/// assert!((top.value - 2.75).abs() < 1e-8 && top.at[1] == 1.0);
/// # Ok::<(), selvedge_normalize::search::NotFinite<2>>(())
/// ```
pub fn maximize<const D: usize>(
    f: impl Fn([f64; D]) -> f64,
    search: &Search,
) -> Result<Maximum<D>, NotFinite<D>> {
    try_maximize(|at| NotFinite::check(f(at), at), search)
}

/// [`maximize`] for a function that can fail; the first failure is returned. `f` returns finite values.
pub(crate) fn try_maximize<const D: usize, E>(
    f: impl Fn([f64; D]) -> Result<f64, E>,
    search: &Search,
) -> Result<Maximum<D>, E> {
    let f = |at| f(at).map(|value| Sample { at, value });
    let spacing = f64::from(search.explore.get()).powf(-1.0 / D as f64);
    let points = Halton::new().points_from(NonZeroU32::MIN);
    let mut best = Sample { at: [0.5; D], value: f64::NEG_INFINITY };
    let mut starts = Starts { spacing, limit: search.refine, samples: Vec::new() };
    let mut evaluations = 0u32;
    for at in points.take(search.explore.get() as usize) {
        let sample = f(at)?;
        best = sample.or_better(best);
        starts.offer(sample);
        evaluations += 1;
    }
    for start in starts.samples {
        let mut budget = search.steps;
        best = climb(&f, start, spacing, &mut budget)?.or_better(best);
        evaluations = evaluations.saturating_add(search.steps - budget);
    }
    Ok(Maximum { value: best.value, at: best.at, evaluations })
}

/// A point and the function's value there.
#[derive(Debug, Clone, Copy)]
struct Sample<const D: usize> {
    at: [f64; D],
    value: f64,
}

impl<const D: usize> Sample<D> {
    /// The higher of two samples, `other` if they are equal.
    fn or_better(self, other: Self) -> Self {
        if self.value > other.value { self } else { other }
    }
}

/// The best samples so far, in descending order, no two of them neighbours.
#[derive(Debug)]
struct Starts<const D: usize> {
    spacing: f64,
    limit: u32,
    samples: Vec<Sample<D>>,
}

impl<const D: usize> Starts<D> {
    /// Takes `sample` in unless a neighbour is at least as high or the list is full of higher ones.
    fn offer(&mut self, sample: Sample<D>) {
        let neighbours = |other: &Sample<D>| {
            core::iter::zip(other.at, sample.at).all(|(a, b)| (a - b).abs() < self.spacing)
        };
        let rank = self.samples.partition_point(|other| other.value >= sample.value);
        if rank >= self.limit as usize || self.samples[..rank].iter().any(neighbours) {
            return;
        }
        self.samples.retain(|other| other.value >= sample.value || !neighbours(other));
        self.samples.insert(rank, sample);
        self.samples.truncate(self.limit as usize);
    }
}

/// The top of the hill on which `best` lies, in steps of at first `step`, with `budget` evaluations.
fn climb<const D: usize, E>(
    f: &impl Fn([f64; D]) -> Result<Sample<D>, E>,
    mut best: Sample<D>,
    mut step: f64,
    budget: &mut u32,
) -> Result<Sample<D>, E> {
    // The sample at `at` if it is in the budget, a new point, and higher than `best`.
    let mut higher = |at: [f64; D], best: Sample<D>| {
        let at = at.map(|x| x.clamp(0.0, 1.0));
        if *budget == 0 || at == best.at {
            return Ok(None);
        }
        *budget -= 1;
        f(at).map(|sample| (sample.value > best.value).then_some(sample))
    };
    while step >= SHORTEST_STEP {
        let before = best;
        for axis in 0..D {
            for signed in [step, -step] {
                let mut at = best.at;
                at[axis] += signed;
                if let Some(sample) = higher(at, best)? {
                    best = sample;
                    break;
                }
            }
        }
        if best.at == before.at {
            step *= 0.5;
        } else {
            let stride = core::array::from_fn(|axis| 2.0 * best.at[axis] - before.at[axis]);
            best = higher(stride, best)?.unwrap_or(best);
        }
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(explore: u32, refine: u32, steps: u32) -> Search {
        Search { explore: NonZeroU32::new(explore).expect("not 0"), refine, steps }
    }

    #[test]
    fn the_higher_of_two_peaks_is_found() {
        let peak = |p: [f64; 3], at: [f64; 3], width: f64| {
            let r_sq: f64 = core::iter::zip(p, at).map(|(a, b)| (a - b).powi(2)).sum();
            (-r_sq / (width * width)).exp()
        };
        let (wide, narrow) = ([0.2, 0.3, 0.8], [0.7, 0.9, 0.1]);
        let f = |p| peak(p, wide, 0.4) + 1.5 * peak(p, narrow, 0.1);
        let top = maximize(f, &Search::default()).expect("finite");
        for (x, expected) in core::iter::zip(top.at, narrow) {
            assert!((x - expected).abs() < 3e-3, "{top:?}");
        }
        assert!(top.value >= 1.5, "{top:?}");
    }

    #[test]
    fn a_corner_is_reached_exactly() {
        let top = maximize(|p: [f64; 4]| p.iter().sum(), &search(100, 2, 200)).expect("finite");
        assert_eq!((top.at, top.value), ([1.0; 4], 4.0));
    }

    #[test]
    fn a_supremum_on_a_missing_face_is_approached() {
        let f = |[x]: [f64; 1]| if x < 1.0 { x } else { 0.0 };
        let top = maximize(f, &search(10, 1, 100)).expect("finite");
        assert!(top.value > 1.0 - 1e-4 && top.value < 1.0, "{top:?}");
    }

    #[test]
    fn a_rotated_ridge_is_climbed() {
        let f = |[x, y]: [f64; 2]| -(x + y - 1.0).powi(2) - 1e-3 * (x - y - 0.6).powi(2);
        let top = maximize(f, &search(64, 4, 300)).expect("finite");
        assert!(top.value > -1e-6, "{top:?}");
    }

    #[test]
    fn a_constant_costs_no_more_than_the_budget() {
        let s = search(50, 3, 20);
        let top = maximize(|_: [f64; 2]| -7.0, &s).expect("finite");
        assert_eq!(top.value, -7.0);
        assert!(top.evaluations <= 50 + 3 * 20, "{top:?}");
        assert_eq!(
            maximize(|_: [f64; 2]| -7.0, &search(50, 0, 20)).expect("finite").evaluations,
            50
        );
    }

    #[test]
    fn starts_are_the_best_and_apart() {
        let mut starts = Starts { spacing: 0.1, limit: 3, samples: Vec::new() };
        for (x, value) in [(0.5, 1.0), (0.55, 2.0), (0.9, 0.5), (0.1, 3.0), (0.56, 1.5)] {
            starts.offer(Sample { at: [x], value });
        }
        let kept: Vec<f64> = starts.samples.iter().map(|s| s.at[0]).collect();
        assert_eq!(kept, [0.1, 0.55, 0.9]);
        starts.offer(Sample { at: [0.3], value: 2.5 });
        let kept: Vec<f64> = starts.samples.iter().map(|s| s.at[0]).collect();
        assert_eq!(kept, [0.1, 0.3, 0.55]);
    }

    #[test]
    fn a_value_that_is_not_finite_is_reported_with_its_point() {
        let error =
            maximize(|[x]: [f64; 1]| if x == 0.25 { f64::NAN } else { x }, &search(9, 1, 9))
                .expect_err("the second Halton point is a quarter");
        assert_eq!(error.to_string(), "at [0.25]: NaN, expected a finite value");
        let error = maximize(|[x]: [f64; 1]| 1.0 / (x - 1.0).abs(), &search(9, 1, 99))
            .expect_err("pole at 1");
        assert_eq!((error.at, error.value), ([1.0], f64::INFINITY));
    }
}
