//! Relative differences of many values: how they spread, and the greatest with what it belongs to.

use crate::report::Series;

/// Tenths of decades, from 10⁻¹⁸ on; what is below is counted with the first.
const BINS: usize = 200;
const PER_DECADE: f64 = 10.0;
const LEAST: f64 = -18.0;

/// As many of them are one step of a plot.
const STEP: usize = 5;

/// Relative differences of values.
#[derive(Clone, Debug)]
pub(super) struct Differences<T> {
    bins: [u64; BINS],
    /// How many there are.
    pub(super) count: u64,
    /// The greatest, and what it belongs to.
    pub(super) worst: Option<(f64, T)>,
}

impl<T> Default for Differences<T> {
    fn default() -> Self {
        Self { bins: [0; BINS], count: 0, worst: None }
    }
}

impl<T> Differences<T> {
    /// Takes in one, which belongs to `what`; NaN counts as infinite.
    pub(super) fn add(&mut self, difference: f64, what: T) {
        let difference = if difference.is_nan() { f64::INFINITY } else { difference };
        let bin = (PER_DECADE * (difference.log10() - LEAST)).clamp(0.0, (BINS - 1) as f64);
        self.bins[bin as usize] += 1;
        self.count += 1;
        if self.worst.as_ref().is_none_or(|(greatest, _)| difference > *greatest) {
            self.worst = Some((difference, what));
        }
    }

    pub(super) fn merged(mut self, other: Self) -> Self {
        for (bin, count) in self.bins.iter_mut().zip(other.bins) {
            *bin += count;
        }
        self.count += other.count;
        let greatest = |of: &Self| of.worst.as_ref().map_or(-1.0, |(greatest, _)| *greatest);
        if greatest(&other) > greatest(&self) {
            self.worst = other.worst;
        }
        self
    }

    /// The greatest; 0 if there is none.
    pub(super) fn greatest(&self) -> f64 {
        self.worst.as_ref().map_or(0.0, |(greatest, _)| *greatest)
    }

    /// The upper end of the tenth of a decade that the share `part` of the differences does not exceed; 0 for the
    /// first.
    pub(super) fn quantile(&self, part: f64) -> f64 {
        let wanted = (part * self.count as f64).ceil() as u64;
        let mut seen = 0;
        for (bin, count) in self.bins.iter().enumerate() {
            seen += count;
            if seen >= wanted {
                return if bin == 0 { 0.0 } else { edge(bin + 1).min(self.greatest()) };
            }
        }
        self.greatest()
    }

    /// The share of differences in each half decade.
    pub(super) fn series(&self, name: &str) -> Series {
        let edges: Vec<f64> = (0..=BINS).step_by(STEP).map(edge).collect();
        let share = |bins: &[u64]| bins.iter().sum::<u64>() as f64 / self.count.max(1) as f64;
        let shares: Vec<f64> = self.bins.chunks(STEP).map(share).collect();
        Series::steps(name, &edges, &shares)
    }
}

fn edge(bin: usize) -> f64 {
    10f64.powf(LEAST + bin as f64 / PER_DECADE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greatest_and_quantiles_are_those_of_the_differences() {
        let mut differences = Differences::default();
        for k in 1..=1000 {
            differences.add(1e-6 * f64::from(k), k);
        }
        let mut others = Differences::default();
        others.add(f64::NAN, 0);
        assert_eq!(differences.worst, Some((1e-3, 1000)));
        let [median, all] = [0.5, 1.0].map(|part| differences.quantile(part));
        assert!((5e-4..=6.4e-4).contains(&median) && all == 1e-3, "{median} {all}");
        let all = differences.merged(others);
        assert_eq!((all.count, all.greatest()), (1001, f64::INFINITY));
    }
}
