//! Irregularities: hashes and noise on absolute thread and position, which never repeat with the tile.

mod lanes;

pub(crate) use lanes::Lines;

use crate::real::{Real, Scalar};

/// What a random number is for, so that no two uses of one thread are alike.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Use {
    Intensity,
    Inclination,
    Lightness,
    Width,
    Offset,
    Slub,
}

/// A thread of an endless cloth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) seed: u64,
    pub(crate) is_warp: bool,
    /// Its index, counted over all repeats.
    pub(crate) index: i64,
}

impl Line {
    /// A hash of `place` on the thread: 64 even bits (Steele, Lea & Flood 2014, the mixing function
    /// of SplitMix).
    fn hash(self, usage: Use, place: i64) -> u64 {
        let start = start(self.seed, usage, self.is_warp);
        mix(mix(start.wrapping_add(self.index as u64)).wrapping_add(place as u64))
    }

    /// An even number in [0, 1) for `place`.
    pub(crate) fn uniform(self, usage: Use, place: i64) -> f64 {
        // The upper 53 bits fill the digits of an f64.
        (self.hash(usage, place) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// An even number in [−1, 1) for `place`.
    pub(crate) fn signed(self, usage: Use, place: i64) -> f64 {
        2.0 * self.uniform(usage, place) - 1.0
    }

    /// A factor for the highlight of the grain (`along`, `across`) of the thread: exponentially
    /// distributed with mean 1 − e⁻¹⁰, at most 10 (Irawan & Marschner 2012, section 6.2).
    pub(crate) fn intensity<R: Scalar>(self, along: i64, across: i64) -> R {
        let grain = along.wrapping_mul(GRAINS).wrapping_add(across);
        intensity(R::from_f64((self.hash(Use::Intensity, grain) >> 40) as f64))
    }

    /// The mean of [`Line::intensity`], 1 − e⁻¹⁰.
    pub(crate) fn mean_intensity() -> f64 {
        -(-MAX_INTENSITY).exp_m1()
    }

    /// Gradient noise at `cell + fraction`, 0 at every whole number: continuous with its first
    /// derivative, in [−1, 1] (Perlin 2002).
    pub(crate) fn gradient(self, usage: Use, cell: i64, fraction: f64) -> f64 {
        let slope = |step: i64| self.signed(usage, cell.wrapping_add(step));
        let t = fraction;
        let fade = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        let (left, right) = (slope(0) * t, slope(1) * (t - 1.0));
        // In one dimension its extremes are ±1/2.
        2.0 * (left + (right - left) * fade)
    }

    /// How much thicker the thread is at `cell + fraction`, in units of one length of a thick place:
    /// 0 mostly, and a smooth bump of height 0 to 1 around places that occur with the probability
    /// `rate` per cell.
    pub(crate) fn slub(self, rate: f64, cell: i64, fraction: f64) -> f64 {
        let mut height: f64 = 0.0;
        for step in -1..=1 {
            let place = cell.wrapping_add(step);
            let chance = self.uniform(Use::Slub, place);
            if chance < rate {
                // What is left of the number, once it is known to be small, is even again.
                let centre = chance / rate;
                let distance = (fraction - step as f64 - centre).abs();
                if distance < 1.0 {
                    let bump = 1.0 - distance * distance;
                    height =
                        height.max(bump * bump * (0.5 + 0.5 * self.uniform(Use::Slub, !place)));
                }
            }
        }
        height
    }
}

/// The greatest factor of [`Line::intensity`].
pub(crate) const MAX_INTENSITY: f64 = 10.0;

/// More than the grains that lie across a thread.
const GRAINS: i64 = 128;

/// The factor of the highlight for 24 even bits, as a number.
#[inline(always)]
fn intensity<R: Real>(bits: R) -> R {
    // So many that their share, and what is left of 1, are exact also in f32.
    let share = bits.one() - bits * bits.of(1.0 / (1 << 24) as f64);
    (-share.ln()).min(bits.of(MAX_INTENSITY))
}

/// Where the hashes of a thread start, but for its index.
fn start(seed: u64, usage: Use, is_warp: bool) -> u64 {
    mix(seed ^ ((usage as u64) << 1 | u64::from(is_warp)))
}

const INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;
const FACTORS: [u64; 2] = [0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb];

fn mix(state: u64) -> u64 {
    let mut z = state.wrapping_add(INCREMENT);
    z = (z ^ (z >> 30)).wrapping_mul(FACTORS[0]);
    z = (z ^ (z >> 27)).wrapping_mul(FACTORS[1]);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(index: i64) -> Line {
        Line { seed: 7, is_warp: true, index }
    }

    #[test]
    fn uniform_numbers_are_even_and_independent() {
        let n = 200_000;
        let numbers: Vec<f64> =
            (0..n).map(|k| line(k % 7).uniform(Use::Width, k / 7 - 9)).collect();
        let mean = |f: &dyn Fn(f64) -> f64| numbers.iter().map(|&x| f(x)).sum::<f64>() / n as f64;
        assert!((mean(&|x| x) - 0.5).abs() < 3e-3);
        assert!((mean(&|x| x * x) - 1.0 / 3.0).abs() < 3e-3);
        let product: f64 = numbers.windows(2).map(|p| (p[0] - 0.5) * (p[1] - 0.5)).sum();
        assert!((product / n as f64).abs() < 1e-3, "{product}");
        assert_ne!(line(1).uniform(Use::Width, 3), line(1).uniform(Use::Offset, 3));
    }

    #[test]
    fn intensity_has_mean_one_and_is_bounded() {
        let n = 100_000;
        let values: Vec<f64> = (0..n).map(|k| line(k % 11).intensity(k / 11, k % 3)).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        assert!(values.iter().all(|v| (0.0..=MAX_INTENSITY).contains(v)));
    }

    #[test]
    fn gradient_noise_is_smooth_and_bounded() {
        let at = |x: f64| line(3).gradient(Use::Offset, x.floor() as i64, x - x.floor());
        let mut last = at(-50.0);
        let (mut low, mut high): (f64, f64) = (0.0, 0.0);
        for k in 1..100_000 {
            let value = at(-50.0 + f64::from(k) * 1e-3);
            assert!((value - last).abs() < 6e-3, "{k}: {last} to {value}");
            (low, high, last) = (low.min(value), high.max(value), value);
        }
        assert!(low > -1.0 && high < 1.0 && high - low > 1.0, "{low} to {high}");
    }

    #[test]
    fn slubs_are_as_frequent_as_asked_and_continuous() {
        let rate = 0.05;
        let mut count = 0;
        let mut last = 0.0;
        for k in 0..2_000_000 {
            let x = f64::from(k) * 1e-2;
            let height = line(5).slub(rate, x.floor() as i64, x - x.floor());
            assert!((height - last).abs() < 0.02, "{x}: {last} to {height}");
            count += u32::from(last == 0.0 && height > 0.0);
            last = height;
        }
        // Some overlap.
        assert!((850..=1050).contains(&count), "{count}, expected about 1000");
    }
}
