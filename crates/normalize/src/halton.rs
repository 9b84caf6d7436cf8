//! The Halton sequence: radical inverses in prime bases, exact in integer digits.
//!
//! Write an index in base b, `n = Σ d_k b^k`, and mirror the digits at the radix point:
//!
//! ```text
//! φ_b(n) = Σ d_k b^(−k−1)
//! ```
//!
//! (Halton 1960, section 3.) Point n of the D-dimensional sequence has the coordinates
//! `φ_2(n), φ_3(n), φ_5(n) …`. Indices start at 1: point 0 is the origin, a corner where integrands
//! like to be singular. The digits are mirrored in integers, and one correctly rounded division makes
//! the number, so every coordinate lies in exactly the box of b-adic digits that theory puts it in.
//!
//! Scrambling permutes the digits and keeps that property. It breaks the correlation of
//! neighbouring large bases, and a second seed gives a second, independent estimate.

use core::num::NonZeroU32;

/// The most dimensions that a point can have.
///
/// Beyond the first few bases the sequence needs very many points to fill pairs of coordinates
/// evenly; [`Base::ALL`] goes further for a caller who chooses bases by hand.
pub const MAX_DIMENSIONS: usize = 16;

/// The largest f32 below 1, `1 − 2⁻²⁴`.
const LARGEST_BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Integers up to here are exact in f64, so this bounds the denominators.
const FINEST: u64 = 1 << 53;

/// A base of a radical inverse: one of the first 64 primes, 2 to 311.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Base(u32);

impl Base {
    /// The first 64 primes in ascending order.
    pub const ALL: [Self; 64] = {
        let mut bases = [Self(2); 64];
        let mut found = 1;
        let mut candidate = 3;
        while found < bases.len() {
            let mut k = 0;
            while k < found && candidate % bases[k].0 != 0 {
                k += 1;
            }
            if k == found {
                bases[found] = Self(candidate);
                found += 1;
            }
            candidate += 2;
        }
        bases
    };

    /// The base `prime`, or `None` if it is not one of the first 64 primes.
    #[must_use]
    pub fn new(prime: u32) -> Option<Self> {
        Self::ALL.binary_search(&Self(prime)).ok().map(|k| Self::ALL[k])
    }

    /// The prime itself.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0
    }
}

/// A coordinate as the exact fraction `numerator / denominator`, in [0, 1).
///
/// The denominator is a power of the base, at most 2⁵³.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Fraction {
    /// The mirrored digits read as an integer, below `denominator`.
    pub numerator: u64,
    /// The base to the power of the number of digits.
    pub denominator: u64,
}

impl Fraction {
    /// The nearest f64, strictly below 1 because the denominator is at most 2⁵³.
    #[must_use]
    pub fn value(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }
}

/// How the digits of a point are permuted; equal values give equal bits.
///
/// A digit d becomes `(a·d + c) mod b` with a ≠ 0. Over the seeds, two different digits go to every
/// ordered pair of different digits equally often, which is all that the variance of a scrambled
/// estimate depends on (Matoušek 1998, section 2), so such affine permutations do the work of
/// arbitrary ones. The pairs (a, c) are hashes of the seed, the base and the position.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Scrambling {
    /// The digits as they are.
    #[default]
    None,
    /// One permutation for each base and digit position (random-digit scrambling).
    Digits(u64),
    /// One permutation for each base, digit position and value of the digits before it
    /// (nested scrambling, Owen 1995).
    Owen(u64),
}

/// The radical inverse `φ_base(index)` as an exact fraction, with as many digits as the index has.
///
/// ```
/// use selvedge_normalize::halton::{Base, Fraction, fraction};
/// let three = Base::new(3).expect("3 is a prime");
/// assert_eq!(fraction(three, 5), Fraction { numerator: 7, denominator: 9 }); // 12 → 0.21
/// ```
#[must_use]
pub const fn fraction(base: Base, index: u32) -> Fraction {
    let mut rest = index;
    let mut numerator = 0;
    let mut denominator = 1;
    while rest > 0 {
        numerator = numerator * base.0 as u64 + (rest % base.0) as u64;
        denominator *= base.0 as u64;
        rest /= base.0;
    }
    Fraction { numerator, denominator }
}

/// The radical inverse of `index` with scrambled digits, as an exact fraction.
///
/// Without scrambling this is [`fraction`]. With it, also the infinitely many zeros in front of the
/// index are permuted, up to the precision of an f64: the denominator is the largest power of the
/// base that is at most 2⁵³.
#[must_use]
pub fn scrambled_fraction(base: Base, index: u32, scrambling: Scrambling) -> Fraction {
    let (seed, nested) = match scrambling {
        Scrambling::None => return fraction(base, index),
        Scrambling::Digits(seed) => (seed, 0),
        Scrambling::Owen(seed) => (seed, u64::MAX),
    };
    let mut key = mix(seed ^ mix(u64::from(base.0)));
    let mut rest = index;
    let mut numerator = 0;
    let mut denominator = 1;
    // Digits beyond those of any u32 too: b^k > 2⁵³ / b is more than 2³², as b is at most 311.
    while denominator <= FINEST / u64::from(base.0) {
        let digit = rest % base.0;
        rest /= base.0;
        numerator = numerator * u64::from(base.0) + u64::from(permute(digit, base.0, key));
        denominator *= u64::from(base.0);
        key = mix(key.wrapping_add(u64::from(digit + 1) & nested));
    }
    Fraction { numerator, denominator }
}

/// Image of `digit` under the affine permutation modulo `base` that `key` chooses.
const fn permute(digit: u32, base: u32, key: u64) -> u32 {
    let a = 1 + (((key >> 32) * (base - 1) as u64) >> 32) as u32;
    let c = (((key & 0xffff_ffff) * base as u64) >> 32) as u32;
    (a * digit + c) % base
}

/// A bijective hash of 64 bits (the finaliser of SplitMix64, Steele, Lea & Flood 2014, figure 15).
pub(crate) const fn mix(key: u64) -> u64 {
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The radical inverse `φ_base(index)`, correctly rounded, in [0, 1).
///
/// Index 0 gives 0; the sequence proper starts at 1.
///
/// ```
/// use selvedge_normalize::halton::{Base, radical_inverse};
/// assert_eq!(radical_inverse(Base::ALL[0], 6), 0.375); // 110 → 0.011
/// ```
#[must_use]
pub fn radical_inverse(base: Base, index: u32) -> f64 {
    fraction(base, index).value()
}

/// [`radical_inverse`] in f32, in [0, 1): never 1, see [`below_one`].
#[must_use]
pub fn radical_inverse_f32(base: Base, index: u32) -> f32 {
    below_one(radical_inverse(base, index))
}

/// The f32 nearest to `x`, but at most `1 − 2⁻²⁴`.
///
/// Rounding to nearest takes an f64 just below 1 to 1, where maps of [0, 1) have their singularities.
#[must_use]
pub fn below_one(x: f64) -> f32 {
    (x as f32).min(LARGEST_BELOW_ONE)
}

/// The Halton sequence in D dimensions, 1 to [`MAX_DIMENSIONS`] (checked when compiled), on the
/// first D primes.
///
/// ```
/// use core::num::NonZeroU32;
/// use selvedge_normalize::halton::Halton;
/// let first = Halton::<2>::new().point(NonZeroU32::MIN);
/// assert_eq!(first, [1.0 / 2.0, 1.0 / 3.0]);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Halton<const D: usize> {
    scrambling: Scrambling,
}

impl<const D: usize> Halton<D> {
    /// The sequence with its digits as they are.
    #[must_use]
    pub const fn new() -> Self {
        Self::scrambled(Scrambling::None)
    }

    /// The sequence with its digits permuted.
    #[must_use]
    pub const fn scrambled(scrambling: Scrambling) -> Self {
        const { assert!(D >= 1 && D <= MAX_DIMENSIONS, "a Halton point has 1 to 16 dimensions") };
        Self { scrambling }
    }

    /// The coordinates of point `index` as exact fractions.
    #[must_use]
    pub fn fractions(&self, index: NonZeroU32) -> [Fraction; D] {
        core::array::from_fn(|d| scrambled_fraction(Base::ALL[d], index.get(), self.scrambling))
    }

    /// Point `index`, in [0, 1)^D.
    #[must_use]
    pub fn point(&self, index: NonZeroU32) -> [f64; D] {
        self.fractions(index).map(Fraction::value)
    }

    /// Point `index` in f32, in [0, 1)^D.
    #[must_use]
    pub fn point_f32(&self, index: NonZeroU32) -> [f32; D] {
        self.point(index).map(below_one)
    }

    /// The points `start, start + 1, …` up to index 2³² − 1.
    #[must_use]
    pub const fn points_from(&self, start: NonZeroU32) -> Points<D> {
        self.leaped(start, NonZeroU32::MIN)
    }

    /// The points `start, start + leap, start + 2·leap, …` up to index 2³² − 1.
    ///
    /// The points stay evenly spread only if `leap` shares no factor with the first D primes; a
    /// prime beyond them, such as 409, is usual (Kocis & Whiten 1997). Interleaved ranges, for
    /// example one for each of `leap` workers, divide the sequence without that condition.
    #[must_use]
    pub const fn leaped(&self, start: NonZeroU32, leap: NonZeroU32) -> Points<D> {
        Points { sequence: *self, next: Some(start), leap }
    }
}

/// Iterator over points of a [`Halton`] sequence; skipping with `nth` costs nothing.
#[derive(Debug, Clone)]
pub struct Points<const D: usize> {
    sequence: Halton<D>,
    next: Option<NonZeroU32>,
    leap: NonZeroU32,
}

impl<const D: usize> Iterator for Points<D> {
    type Item = [f64; D];

    fn next(&mut self) -> Option<[f64; D]> {
        self.nth(0)
    }

    fn nth(&mut self, skipped: usize) -> Option<[f64; D]> {
        let ahead = u32::try_from(skipped).ok().and_then(|k| k.checked_mul(self.leap.get()));
        let index = self.next.zip(ahead).and_then(|(next, ahead)| next.checked_add(ahead));
        self.next = index.and_then(|index| index.checked_add(self.leap.get()));
        index.map(|index| self.sequence.point(index))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left =
            self.next.map_or(0, |next| u64::from((u32::MAX - next.get()) / self.leap.get()) + 1);
        usize::try_from(left).map_or((usize::MAX, None), |left| (left, Some(left)))
    }
}

impl<const D: usize> core::iter::FusedIterator for Points<D> {}

/// The Hammersley set of `n` points in D dimensions, 2 to [`MAX_DIMENSIONS`] (checked when compiled).
///
/// Point i, counted from 1, is `((i − ½)/n, φ_2(i), φ_3(i), …)` (Hammersley 1960). One coordinate is
/// perfectly even, in exchange for knowing the number of points beforehand.
///
/// ```
/// use core::num::NonZeroU32;
/// use selvedge_normalize::halton::hammersley;
/// let points: Vec<[f64; 2]> = hammersley(NonZeroU32::new(2).expect("2 is not 0")).collect();
/// assert_eq!(points, [[0.25, 0.5], [0.75, 0.25]]);
/// ```
pub fn hammersley<const D: usize>(n: NonZeroU32) -> impl Iterator<Item = [f64; D]> + Clone {
    const { assert!(D >= 2 && D <= MAX_DIMENSIONS, "a Hammersley point has 2 to 16 dimensions") };
    (1..=n.get()).map(move |index| {
        core::array::from_fn(|d| match d.checked_sub(1) {
            None => (f64::from(index) - 0.5) / f64::from(n.get()),
            Some(d) => radical_inverse(Base::ALL[d], index),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first 20 values as numerators over the denominator of the last, from the definition.
    fn by_definition(base: u32) -> Vec<f64> {
        (1..=20u32)
            .map(|n| {
                let (mut rest, mut weight, mut sum) = (n, 1.0 / f64::from(base), 0.0);
                while rest > 0 {
                    sum += f64::from(rest % base) * weight;
                    rest /= base;
                    weight /= f64::from(base);
                }
                sum
            })
            .collect()
    }

    #[test]
    fn bases_are_the_first_64_primes() {
        let sieve: Vec<u32> = (2..=311).filter(|n| (2..*n).all(|d| n % d != 0)).collect();
        assert_eq!(Base::ALL.map(Base::get).to_vec(), sieve);
        assert_eq!(Base::new(311), Some(Base::ALL[63]));
        for not_a_base in [0, 1, 4, 309, 312, 313, u32::MAX] {
            assert_eq!(Base::new(not_a_base), None, "{not_a_base}");
        }
    }

    #[test]
    fn first_20_values_are_exact() {
        let numerators: [(u32, u64, [u64; 20]); 4] = [
            (2, 32, [16, 8, 24, 4, 20, 12, 28, 2, 18, 10, 26, 6, 22, 14, 30, 1, 17, 9, 25, 5]),
            (3, 27, [9, 18, 3, 12, 21, 6, 15, 24, 1, 10, 19, 4, 13, 22, 7, 16, 25, 2, 11, 20]),
            (5, 25, [5, 10, 15, 20, 1, 6, 11, 16, 21, 2, 7, 12, 17, 22, 3, 8, 13, 18, 23, 4]),
            (7, 49, [7, 14, 21, 28, 35, 42, 1, 8, 15, 22, 29, 36, 43, 2, 9, 16, 23, 30, 37, 44]),
        ];
        for (prime, denominator, expected) in numerators {
            let base = Base::new(prime).expect("a prime");
            let naive = by_definition(prime);
            for (n, numerator) in (1u32..).zip(expected) {
                let f = fraction(base, n);
                assert_eq!(
                    f.numerator * (denominator / f.denominator),
                    numerator,
                    "base {prime}, index {n}"
                );
                let value = radical_inverse(base, n);
                assert!(
                    (value - naive[n as usize - 1]).abs() < 1e-15,
                    "base {prime}, index {n}: {value}"
                );
            }
        }
    }

    #[test]
    fn no_value_reaches_one() {
        let mut rounded_up = 0u32;
        for base in Base::ALL {
            // 1 − φ ≤ 2⁻²⁵, which rounds to 1 in f32, takes at least as many leading digits b − 1 as b
            // has powers up to 2²⁵. These are all the indices that have so many.
            let b = u64::from(base.get());
            let mut run = b;
            while run * b <= 1 << 25 {
                run *= b;
            }
            let dangerous = (1..=(1u64 << 32) / run).map(|k| u32::try_from(k * run - 1));
            let sampled = (1..=u32::MAX).step_by(7_654_321);
            for index in dangerous.map(|n| n.expect("below 2^32")).chain(sampled).chain([u32::MAX])
            {
                let (x, y) = (radical_inverse(base, index), radical_inverse_f32(base, index));
                assert!(x < 1.0 && y < 1.0, "base {b}, index {index}: {x} {y}");
                rounded_up += u32::from(x as f32 == 1.0);
                for scrambling in [Scrambling::Digits(u64::from(index)), Scrambling::Owen(1)] {
                    let x = scrambled_fraction(base, index, scrambling).value();
                    assert!(x < 1.0 && below_one(x) < 1.0, "base {b}, index {index}: {x}");
                }
            }
        }
        assert!(rounded_up > 1000, "only {rounded_up} of these values would round to 1 in f32");
        assert_eq!(radical_inverse(Base::ALL[0], u32::MAX), 1.0 - 2f64.powi(-32));
        // The largest scrambled coordinate: all digits b − 1 down to the finest denominator.
        for base in Base::ALL {
            let denominator = scrambled_fraction(base, 1, Scrambling::Digits(0)).denominator;
            let x = Fraction { numerator: denominator - 1, denominator }.value();
            assert!(x < 1.0 && below_one(x) < 1.0, "base {}: {x}", base.get());
        }
    }

    #[test]
    fn scrambled_denominators_hold_every_index_and_are_exact() {
        for base in Base::ALL {
            let finest = scrambled_fraction(base, 1, Scrambling::Owen(1)).denominator;
            let longest = fraction(base, u32::MAX).denominator;
            assert!(finest <= FINEST && finest.is_multiple_of(longest), "base {}", base.get());
            assert!(finest > FINEST / u64::from(base.get()), "base {}", base.get());
        }
    }

    #[test]
    fn iteration_ends_at_the_last_index() {
        let sequence = Halton::<3>::new();
        let last = NonZeroU32::MAX;
        let before = NonZeroU32::new(u32::MAX - 2).expect("not 0");
        let mut points = sequence.points_from(before);
        assert_eq!(points.size_hint(), (3, Some(3)));
        assert_eq!(points.nth(2), Some(sequence.point(last)));
        assert_eq!((points.next(), points.size_hint()), (None, (0, Some(0))));
        assert_eq!(sequence.leaped(last, last).count(), 1);
        assert_eq!(sequence.points_from(before).nth(usize::MAX), None);
    }
}
