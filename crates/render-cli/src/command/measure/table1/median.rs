//! Medians of few numbers.

/// The median of some numbers, and the least and the greatest of them.
///
/// The interval holds the median of what they are drawn from with a probability of 1 − 2^(1−n), whatever
/// their distribution: it does not only if all n lie on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Median {
    pub(super) median: f64,
    pub(super) least: f64,
    pub(super) greatest: f64,
}

impl Median {
    /// That of `values`; NaN of none.
    pub(super) fn new(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let at = |index: usize| values.get(index).copied().unwrap_or(f64::NAN);
        let count = values.len();
        let middle = [count.saturating_sub(1) / 2, count / 2].map(at);
        Self {
            median: 0.5 * (middle[0] + middle[1]),
            least: at(0),
            greatest: at(count.saturating_sub(1)),
        }
    }

    /// As in `0.52 (0.48 to 0.57)`.
    pub(super) fn in_words(self) -> String {
        format!("{:.3} ({:.3} to {:.3})", self.median, self.least, self.greatest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_numbers_are_below() {
        let odd = Median::new([3.0, 1.0, 2.0]);
        assert_eq!(odd, Median { median: 2.0, least: 1.0, greatest: 3.0 });
        assert_eq!(Median::new([4.0, 1.0, 2.0, 3.0]).median, 2.5);
        assert_eq!(Median::new([7.0]).median, 7.0);
        assert!(Median::new([]).median.is_nan());
    }
}
