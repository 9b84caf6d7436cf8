//! The defining property of the sequence: even filling of every grid of its bases.

use std::num::NonZeroU32;

use selvedge_normalize::halton::{Fraction, Halton, Scrambling};

fn index(n: u32) -> NonZeroU32 {
    NonZeroU32::new(n).expect("indices start at 1")
}

/// Which of `boxes` equal parts of [0, 1) holds the fraction, in integers.
fn part(fraction: Fraction, boxes: u32) -> usize {
    let product = u128::from(fraction.numerator) * u128::from(boxes);
    usize::try_from(product / u128::from(fraction.denominator)).expect("below the number of boxes")
}

#[test]
fn each_elementary_interval_holds_one_of_each_run() {
    let scramblings =
        [Scrambling::None, Scrambling::Digits(5), Scrambling::Owen(5), Scrambling::Owen(u64::MAX)];
    let mut grids = 0;
    for scrambling in scramblings {
        let sequence = Halton::<3>::scrambled(scrambling);
        for (i, j, k) in
            (0..8).flat_map(|i| (0..5).flat_map(move |j| (0..4).map(move |k| (i, j, k))))
        {
            let grid = [2u32.pow(i), 3u32.pow(j), 5u32.pow(k)];
            let boxes = grid.iter().product::<u32>();
            if boxes > 20_000 {
                continue;
            }
            grids += 1;
            for start in [1, 2, 17, boxes, 123_456, u32::MAX - boxes + 1] {
                let mut hits = vec![0u8; boxes as usize];
                for n in start..=start + (boxes - 1) {
                    let [x, y, z] = sequence.fractions(index(n));
                    let at = (part(x, grid[0]) * grid[1] as usize + part(y, grid[1]))
                        * grid[2] as usize
                        + part(z, grid[2]);
                    hits[at] += 1;
                }
                assert!(
                    hits.iter().all(|h| *h == 1),
                    "{scrambling:?}, grid {grid:?}, from {start}"
                );
            }
        }
    }
    assert!(grids > 400, "{grids} grids are too few to say anything");
}

#[test]
fn an_elementary_interval_of_16_bases_is_filled_coordinate_by_coordinate() {
    for scrambling in [Scrambling::None, Scrambling::Digits(1), Scrambling::Owen(1)] {
        let sequence = Halton::<16>::scrambled(scrambling);
        for (d, prime) in
            [2u32, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53].into_iter().enumerate()
        {
            let boxes = prime * prime;
            let mut hits = vec![0u8; boxes as usize];
            for n in 1000..1000 + boxes {
                hits[part(sequence.fractions(index(n))[d], boxes)] += 1;
            }
            assert!(hits.iter().all(|h| *h == 1), "{scrambling:?}, base {prime}");
        }
    }
}

#[test]
fn owen_scrambling_is_nested_and_digit_scrambling_is_not() {
    // Two indices whose second binary digits are equal, in different halves: 01 and 00 mirrored are
    // 10 and 00. With one permutation per position their second digits stay equal for every seed;
    // nested, they differ for half of the seeds.
    let second_digit = |scrambling, n: u32| {
        let [f] = Halton::<1>::scrambled(scrambling).fractions(index(n));
        part(f, 4) % 2
    };
    let differ = |make: fn(u64) -> Scrambling| {
        (0..1000)
            .filter(|seed| second_digit(make(*seed), 4) != second_digit(make(*seed), 5))
            .count()
    };
    assert_eq!(differ(Scrambling::Digits), 0);
    let nested = differ(Scrambling::Owen);
    assert!((430..570).contains(&nested), "{nested} of 1000");
}

#[test]
fn scrambled_coordinates_are_uniform_over_the_seeds() {
    // χ² of 20 equal boxes for a fixed index; 43.8 is the 99.9 % quantile at 19 degrees of freedom.
    for make in [Scrambling::Digits as fn(u64) -> Scrambling, Scrambling::Owen] {
        for n in [1, 6, 1_000_003] {
            let mut hits = [[0.0f64; 20]; 5];
            for seed in 0..10_000 {
                for (d, f) in
                    Halton::<5>::scrambled(make(seed)).fractions(index(n)).into_iter().enumerate()
                {
                    hits[d][part(f, 20)] += 1.0;
                }
            }
            for (d, counts) in hits.iter().enumerate() {
                let chi_sq: f64 = counts.iter().map(|h| (h - 500.0).powi(2) / 500.0).sum();
                assert!(chi_sq < 43.8, "dimension {d}, index {n}: chi squared {chi_sq}");
            }
        }
    }
}
