//! How fast the error falls with the number of points. `--nocapture` prints the table.

use std::num::NonZeroU32;

use selvedge_normalize::halton::{Halton, Scrambling};

const SEEDS: u64 = 64;

/// A smooth function of four variables whose mean over the unit cube is 1.
fn smooth(p: [f64; 4]) -> f64 {
    p.iter().map(|x| x.exp() / (1f64.exp() - 1.0)).product()
}

/// Equally likely numbers in [0, 1): hashes of a counter.
fn uniform(seed: u64, counter: u64) -> f64 {
    let mut z = counter.wrapping_add(seed << 40).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Root-mean-square error over the seeds after each power of two from 2⁶ to 2¹⁴ points.
fn errors<I: Iterator<Item = [f64; 4]>>(points: impl Fn(u64) -> I) -> Vec<f64> {
    let sizes: Vec<u32> = (6..=14).map(|k| 1 << k).collect();
    let mut squares = vec![0.0; sizes.len()];
    for seed in 0..SEEDS {
        let mut sum = 0.0;
        for (n, point) in (1u32..=1 << 14).zip(points(seed)) {
            sum += smooth(point);
            if let Some(row) = sizes.iter().position(|size| *size == n) {
                squares[row] += (sum / f64::from(n) - 1.0).powi(2);
            }
        }
    }
    squares.iter().map(|sq| (sq / SEEDS as f64).sqrt()).collect()
}

/// Least-squares slope of log₂(error) against log₂(points), which rise by 1.
fn slope(errors: &[f64]) -> f64 {
    let middle = (errors.len() - 1) as f64 / 2.0;
    let centred = |i: usize| i as f64 - middle;
    let covariance: f64 = errors.iter().enumerate().map(|(i, e)| centred(i) * e.log2()).sum();
    covariance / (0..errors.len()).map(|i| centred(i).powi(2)).sum::<f64>()
}

#[test]
fn the_error_falls_with_the_points_and_not_with_their_root() {
    let first = NonZeroU32::MIN;
    let random =
        errors(|seed| (0..).map(move |i| std::array::from_fn(|d| uniform(seed, 4 * i + d as u64))));
    // The plain sequence has no seed: runs at different places of it stand for one.
    let plain = errors(|seed| {
        let start = NonZeroU32::new(1 + 1_000_003 * u32::try_from(seed).expect("few seeds"));
        Halton::<4>::new().points_from(start.expect("not 0"))
    });
    let digits = errors(|seed| Halton::<4>::scrambled(Scrambling::Digits(seed)).points_from(first));
    let owen = errors(|seed| Halton::<4>::scrambled(Scrambling::Owen(seed)).points_from(first));
    println!("{:>8} {:>10} {:>10} {:>10} {:>10}", "points", "random", "Halton", "digits", "Owen");
    for row in 0..random.len() {
        let n = 1 << (6 + row);
        println!(
            "{n:>8} {:>10.2e} {:>10.2e} {:>10.2e} {:>10.2e}",
            random[row], plain[row], digits[row], owen[row]
        );
    }
    let slopes = [&random, &plain, &digits, &owen].map(|e| slope(e));
    println!(
        "{:>8} {:>10.2} {:>10.2} {:>10.2} {:>10.2}",
        "slope", slopes[0], slopes[1], slopes[2], slopes[3]
    );
    assert!((slopes[0] + 0.5).abs() < 0.1, "random: slope {}", slopes[0]);
    for (name, slope) in ["Halton", "digits", "Owen"].iter().zip(&slopes[1..]) {
        assert!(*slope < -0.85 && *slope > -1.3, "{name}: slope {slope}");
    }
}
