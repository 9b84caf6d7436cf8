//! Quadrature over an interval and its parts: Gauss–Legendre, and rules that crowd towards the ends.

use core::f64::consts::PI;

/// Nodes and weights on [−1, 1], crowded towards both ends by `s^power / (s^power + (1−s)^power)`.
fn crowded(n: usize, power: f64) -> Vec<(f64, f64)> {
    gauss_legendre(n)
        .into_iter()
        .map(|(node, weight)| {
            let s = 0.5 * (1.0 + node);
            let (a, b) = (s.powf(power), (1.0 - s).powf(power));
            let slope = power * a * b / (s * (1.0 - s) * (a + b) * (a + b));
            ((a - b) / (a + b), weight * slope)
        })
        .collect()
}

/// Rules for the parts of an interval.
pub(crate) struct Rules(Vec<Vec<(f64, f64)>>);

impl Rules {
    /// Rules of 1 to `count` nodes, the last of which crowds by `power`.
    ///
    /// The shorter a part, the less: over what is short nothing peaks, and few nodes that crowd would
    /// not even sum up to its length.
    pub(crate) fn new(count: usize, power: f64) -> Self {
        let share = |n: usize| (n as f64 / count as f64).powi(2);
        Self((1..=count).map(|n| crowded(n, 1.0 + (power - 1.0) * share(n))).collect())
    }

    /// The rule for a part that is `share` of the interval.
    pub(crate) fn of(&self, share: f64) -> &[(f64, f64)] {
        let count = self.0.len();
        let n = (count as f64 * share.clamp(0.0, 1.0).sqrt()).ceil() as usize;
        // Nothing to integrate takes no node.
        if share < 1e-9 { &[] } else { &self.0[n.min(count) - 1] }
    }
}

/// Nodes and weights of the Gauss–Legendre rule of `n` points on [−1, 1].
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let degree = n as f64;
    (0..n)
        .map(|i| {
            // Newton's method from the Chebyshev-like guess (Abramowitz & Stegun 1964, 22.16.6).
            let mut x = (PI * (i as f64 + 0.75) / (degree + 0.5)).cos();
            let mut derivative = 1.0;
            for _ in 0..4 {
                let (mut p, mut previous) = (1.0, 0.0);
                for k in 1..=n {
                    let k = k as f64;
                    (p, previous) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k, p);
                }
                derivative = degree * (x * p - previous) / (x * x - 1.0);
                x -= p / derivative;
            }
            (x, 2.0 / ((1.0 - x * x) * derivative * derivative))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_legendre_is_exact_for_polynomials() {
        for n in [1, 2, 10, 16, 48] {
            let rule = gauss_legendre(n);
            for power in 0..2 * n.min(12) {
                let sum: f64 = rule.iter().map(|&(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-13, "{n} points, x^{power}: {sum}");
            }
        }
    }

    #[test]
    fn crowded_nodes_integrate_smooth_functions() {
        for (power, count) in [(1.0, 32), (1.5, 32), (3.0, 32)] {
            let sum: f64 = crowded(count, power).iter().map(|&(x, w)| w * (x + x * x).exp()).sum();
            let exact: f64 = gauss_legendre(40).iter().map(|&(x, w)| w * (x + x * x).exp()).sum();
            assert!((sum / exact - 1.0).abs() < 1e-4, "{power}: {sum}, expected {exact}");
        }
    }

    #[test]
    fn rules_sum_up_to_the_length_of_a_part() {
        for (count, power) in [(8, 1.0), (12, 1.3), (19, 2.0), (24, 2.5), (80, 3.0)] {
            let rules = Rules::new(count, power);
            for share in [1e-6, 1e-3, 0.01, 0.1, 0.3, 1.0] {
                let sum: f64 = rules.of(share).iter().map(|&(_, weight)| weight).sum();
                assert!(
                    (sum - 2.0).abs() < 0.01,
                    "{count} nodes, power {power}, share {share}: {sum}, expected 2 within 0.01"
                );
            }
        }
    }
}
