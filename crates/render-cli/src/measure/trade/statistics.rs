//! Means with intervals, curves of error over time, and the points that nothing beats.

use super::Point;

/// A mean and half the width of an interval that holds the true one with 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Half the width, ≥ 0.
    pub half: f64,
}

/// Student's t at 97.5 % for 1 to 30 degrees of freedom (Abramowitz & Stegun 1964, table 26.10).
const T: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
];

impl Estimate {
    /// Of the mean of what `values` are drawn from; without width where there is only one, NaN where
    /// there is none.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let half = match values.len() {
            0 | 1 => 0.0,
            count => T[(count - 2).min(T.len() - 1)] * (squares / (n - 1.0) / n).sqrt(),
        };
        Self { mean, half }
    }

    /// Both ends.
    pub fn interval(&self) -> [f64; 2] {
        [self.mean - self.half, self.mean + self.half]
    }
}

/// `of` at `seconds` on the curve through `points`, on logarithmic scales; `None` where that is outside.
pub fn at_time(points: &[Point], seconds: f64, of: impl Fn(&Point) -> f64) -> Option<f64> {
    let pair =
        points.windows(2).find(|pair| (pair[0].seconds..=pair[1].seconds).contains(&seconds))?;
    Some(between([pair[0].seconds, pair[1].seconds], [of(&pair[0]), of(&pair[1])], seconds))
}

/// The first time at which `of` has fallen to `value` on the curve through `points`, on logarithmic
/// scales; the first point's where it has from the beginning, `None` where it never has.
pub fn time_of(points: &[Point], value: f64, of: impl Fn(&Point) -> f64) -> Option<f64> {
    let first = points.first()?;
    if of(first) <= value {
        return Some(first.seconds);
    }
    let pair = points.windows(2).find(|pair| of(&pair[1]) <= value)?;
    Some(between([of(&pair[0]), of(&pair[1])], [pair[0].seconds, pair[1].seconds], value))
}

/// The value at `at` between two, both on logarithmic scales; exactly theirs at both ends.
fn between(x: [f64; 2], y: [f64; 2], at: f64) -> f64 {
    if let Some(end) = [1, 0].into_iter().find(|&end| x[end] == at) {
        return y[end];
    }
    let [x0, x1, at] = [x[0], x[1], at].map(|x| x.max(1e-30).ln());
    let [y0, y1] = y.map(|y| y.max(1e-30).ln());
    (y0 + (at - x0) / (x1 - x0) * (y1 - y0)).exp()
}

/// Indices of those of `points`, [cost, error], that no other is at least as good as in both and better in
/// one: the Pareto front, by cost.
pub fn front(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1]))
    });
    let mut least = f64::INFINITY;
    order.retain(|&index| {
        let is_better = points[index][1] < least;
        least = least.min(points[index][1]);
        is_better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(seconds: f64, flip: f64) -> Point {
        Point { spp: 1.0, seconds, relmse: flip * flip, flip, max: 1.0 }
    }

    #[test]
    fn interval_is_that_of_the_textbook() {
        // Mean 3, variance 2.5, t of 4 degrees of freedom.
        let estimate = Estimate::of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(estimate.mean, 3.0);
        assert!((estimate.half - 2.776 * 0.5f64.sqrt()).abs() < 1e-12, "{estimate:?}");
        assert_eq!(Estimate::of(&[2.0]).interval(), [2.0, 2.0]);
        assert!(Estimate::of(&[]).mean.is_nan());
    }

    #[test]
    fn curves_are_straight_on_logarithmic_scales() {
        let points = [point(1.0, 0.4), point(4.0, 0.2), point(16.0, 0.1)];
        let flip = |point: &Point| point.flip;
        assert!((at_time(&points, 2.0, flip).unwrap() - 0.4 / 2f64.sqrt()).abs() < 1e-12);
        assert_eq!(at_time(&points, 0.5, flip), None);
        assert!((time_of(&points, 0.1, flip).unwrap() - 16.0).abs() < 1e-9);
        assert!((time_of(&points, 0.2 / 2f64.sqrt(), flip).unwrap() - 8.0).abs() < 1e-9);
        assert_eq!(time_of(&points, 0.5, flip), Some(1.0));
        assert_eq!(time_of(&points, 0.05, flip), None);
    }

    #[test]
    fn front_has_what_nothing_beats() {
        let points = [[1.0, 5.0], [2.0, 5.0], [2.0, 4.0], [3.0, 4.5], [0.5, 9.0], [4.0, 1.0]];
        assert_eq!(front(&points), [4, 0, 2, 5]);
        assert!(front(&[]).is_empty());
    }
}
