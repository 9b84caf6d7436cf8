//! Choices among many, each as likely as its weight.
//!
//! Weights are kept as running sums of whole units: what is told of the probability of a choice is
//! then exactly how it is drawn, and what weighs anything is drawn sometimes.

/// A choice that was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice {
    pub(super) index: usize,
    pub(super) probability: f64,
    /// Where in the choice's share the number was: even in [0, 1].
    pub(super) rest: f64,
}

/// The running sums, in units, of weights that are finite and at least 0. All are 0 when nothing
/// weighs anything.
pub(super) fn running_sums(
    weights: impl ExactSizeIterator<Item = f64> + Clone,
) -> impl Iterator<Item = u32> {
    // Each weight is rounded up, which adds less than a unit to each.
    let units = (f64::from(u32::MAX) - weights.len() as f64).max(0.0);
    let total: f64 = weights.clone().sum();
    let mut sum = 0_u32;
    weights.map(move |weight| {
        if weight > 0.0 {
            sum = sum.saturating_add((weight / total * units).ceil().max(1.0) as u32);
        }
        sum
    })
}

/// The choice that `xi` in [0, 1) names. `None` when nothing weighs anything.
pub(super) fn choose(sums: &[u32], xi: f32) -> Option<Choice> {
    let total = *sums.last().filter(|&&total| total > 0)?;
    let place = f64::from(xi) * f64::from(total);
    let unit = (place as u32).min(total - 1);
    let index = find(sums, unit);
    let [before, share] = share(sums, index).map(f64::from);
    let rest = ((place - before) / share).clamp(0.0, 1.0);
    Some(Choice { index, probability: share / f64::from(total), rest })
}

/// The first sum above `unit`, which is below the last. Searched for from where it is when all weigh
/// the same, in growing steps: mostly in the memory that is near by.
fn find(sums: &[u32], unit: u32) -> usize {
    let count = sums.len() as u64;
    let guess = (u64::from(unit) * count / u64::from(sums[sums.len() - 1])) as usize;
    let (mut low, mut high, mut step) = (guess, guess, 1);
    while low > 0 && sums[low - 1] > unit {
        high = low - 1;
        low = low.saturating_sub(step);
        step *= 2;
    }
    while sums[high] <= unit {
        low = high + 1;
        high = (high + step).min(sums.len() - 1);
        step *= 2;
    }
    low + sums[low..high].partition_point(|&sum| sum <= unit)
}

/// With which [`choose`] names the choice `index`.
pub(super) fn probability(sums: &[u32], index: usize) -> f64 {
    let total = sums.last().copied().unwrap_or(0).max(1);
    let [_, share] = share(sums, index);
    f64::from(share) / f64::from(total)
}

/// Units before a choice and its own.
fn share(sums: &[u32], index: usize) -> [u32; 2] {
    let before = if index == 0 { 0 } else { sums[index - 1] };
    [before, sums[index] - before]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_as_likely_as_their_weights() {
        let weights = [0.0, 1.0, 0.0, 5.0, 2.0, 0.0];
        let sums: Vec<u32> = running_sums(weights.into_iter()).collect();
        for (index, weight) in weights.into_iter().enumerate() {
            let found = probability(&sums, index);
            assert!((found - weight / 8.0).abs() < 1e-8, "{index}: {found}, expected {weight}/8");
        }
        let n = 8000;
        let mut counts = [0; 6];
        for k in 0..n {
            let choice = choose(&sums, (k as f32 + 0.5) / n as f32).unwrap();
            assert_eq!(choice.probability, probability(&sums, choice.index));
            assert!((0.0..=1.0).contains(&choice.rest), "{choice:?}");
            counts[choice.index] += 1;
        }
        assert_eq!(counts, [0, 1000, 0, 5000, 2000, 0]);
    }

    #[test]
    fn rest_runs_through_each_share() {
        let sums: Vec<u32> = running_sums([1.0, 3.0].into_iter()).collect();
        for (xi, index, rest) in [(0.0, 0, 0.0), (0.125, 0, 0.5), (0.4375, 1, 0.25)] {
            let choice = choose(&sums, xi).unwrap();
            let is_there = choice.index == index && (choice.rest - rest).abs() < 1e-8;
            assert!(is_there, "{xi}: {choice:?}, expected {index} and {rest}");
        }
    }

    #[test]
    fn border_of_every_share_is_found() {
        let even = [1.0; 100].to_vec();
        let steep: Vec<f64> = (0..100).map(|k| 1.2_f64.powi(k)).collect();
        let falling: Vec<f64> = steep.iter().rev().copied().collect();
        let rare: Vec<f64> = (0..100).map(|k| f64::from(u8::from(k % 37 == 5))).collect();
        for weights in [even, steep, falling, rare, vec![3.0], vec![0.0, 2.0]] {
            let sums: Vec<u32> = running_sums(weights.iter().copied()).collect();
            let last = sums[sums.len() - 1];
            for unit in sums.iter().flat_map(|sum| [sum.saturating_sub(1), *sum, sum / 2]) {
                let unit = unit.min(last - 1);
                let expected = sums.iter().position(|&sum| sum > unit).unwrap();
                assert_eq!(find(&sums, unit), expected, "{unit} of {weights:?}");
            }
        }
    }

    #[test]
    fn weights_of_every_magnitude_have_a_share() {
        let weights = [1e-300, f64::from(f32::MAX), 0.0, 1.0];
        let sums: Vec<u32> = running_sums(weights.into_iter()).collect();
        let probabilities = [0, 1, 2, 3].map(|index| probability(&sums, index));
        assert!(probabilities[0] > 0.0 && probabilities[3] > 0.0, "{probabilities:?}");
        assert_eq!(probabilities[2], 0.0);
        assert!((probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{probabilities:?}");
    }

    #[test]
    fn numbers_at_the_border_and_beyond_name_a_choice_that_weighs() {
        let sums: Vec<u32> = running_sums([0.0, 1.0, 0.0].into_iter()).collect();
        for xi in [-1.0, 0.0, 1.0 - f32::EPSILON / 2.0, 1.0, 2.0, f32::NAN] {
            assert_eq!(choose(&sums, xi).unwrap().index, 1, "{xi}");
        }
        assert_eq!(choose(&[], 0.5), None);
        let nothing: Vec<u32> = running_sums([0.0, 0.0].into_iter()).collect();
        assert_eq!(choose(&nothing, 0.5), None);
        assert_eq!(probability(&nothing, 1), 0.0);
    }
}
