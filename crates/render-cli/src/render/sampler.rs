//! The numbers that choose paths: a scrambled Sobol sequence of its own for each pixel.
//!
//! A number is a function of seed, pixel, sample and dimension; there is no generator to share.

use std::{array, sync::LazyLock};

use glam::Vec2;
use sobol_burley::parts::{
    Int4, hash, hash_int4, owen_scramble_int4_rev, owen_scramble_rev, sobol_int4_rev,
};

/// Most samples of a pixel: the length of the sequence.
pub const MAX_SAMPLES: u32 = 1 << 16;

/// The sequence of one pixel: Sobol points with the hashed Owen scrambling of Burley 2020.
///
/// Each set of four coordinates is the first four dimensions of the sequence in another scrambling
/// (section 5 there): the first dimensions are the most even in pairs.
#[derive(Clone, Copy, Debug)]
pub struct PixelSampler {
    scramble: u32,
}

/// One point of a sequence, read coordinate by coordinate.
#[derive(Clone, Debug)]
pub struct Sample {
    scramble: u32,
    index: u32,
    /// Sets of four coordinates begun.
    sets: u32,
    /// The last of them, and how much of it is used up.
    set: [f32; 4],
    used: usize,
}

impl PixelSampler {
    /// The sequence of the pixel at column and row `pixel`; another for another `seed`.
    pub fn new(pixel: [u32; 2], seed: u64) -> Self {
        let place = u64::from(pixel[0]) << 32 | u64::from(pixel[1]);
        Self { scramble: (mix(place ^ mix(seed)) >> 32) as u32 }
    }

    /// Point `index` of the sequence. Any 2ᵏ points from a multiple of 2ᵏ are spread evenly.
    ///
    /// From [`MAX_SAMPLES`] on, and from each multiple of it, there follows another scrambling of the
    /// sequence, independent of those before.
    pub fn sample(&self, index: u32) -> Sample {
        let scramble = self.scramble ^ (mix((index / MAX_SAMPLES).into()) >> 32) as u32;
        Sample { scramble, index: index % MAX_SAMPLES, sets: 0, set: [0.0; 4], used: 4 }
    }
}

impl Sample {
    /// The next coordinate, in [0, 1).
    pub fn next_1d(&mut self) -> f32 {
        if self.used == self.set.len() {
            let scramble = self.scramble ^ mix(self.sets.into()) as u32;
            self.set = four(self.index, scramble);
            self.sets += 1;
            self.used = 0;
        }
        self.used += 1;
        self.set[self.used - 1]
    }

    /// The next two coordinates, in [0, 1)².
    pub fn next_2d(&mut self) -> Vec2 {
        Vec2::new(self.next_1d(), self.next_1d())
    }
}

/// [`sobol_burley::sample_4d`] of the first four dimensions, from its parts: the integers of the
/// sequence, which it sums bit by bit, are looked up by four bits at once.
fn four(index: u32, scramble: u32) -> [f32; 4] {
    static OF_BITS: LazyLock<[[Int4; 16]; 4]> = LazyLock::new(|| {
        let of = |place: usize, bits: usize| sobol_int4_rev((bits << (28 - 4 * place)) as u32, 0);
        array::from_fn(|place| array::from_fn(|bits| of(place, bits)))
    });
    let shuffled = owen_scramble_rev(index.reverse_bits(), hash(scramble ^ 0x79c6_8e4a));
    let of_bits = &*OF_BITS;
    let part = |place: usize| of_bits[place][(shuffled >> (28 - 4 * place)) as usize % 16];
    let sobol = part(0) ^ part(1) ^ part(2) ^ part(3);
    let by_dimension: Int4 = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8].into();
    let of_seed: Int4 = [scramble.wrapping_mul(0x9c8f_2d3b); 4].into();
    owen_scramble_int4_rev(sobol, hash_int4(of_seed ^ by_dimension)).reverse_bits().to_f32_norm()
}

/// A bijection that sends 0 to 0 and spreads every input bit over the output: the finalizer of
/// SplitMix64 (Steele, Lea & Flood 2014, variant 13).
pub(crate) fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_samples_fill_a_four_by_four_grid_in_each_pair() {
        for pixel in [[0, 0], [1, 0], [959, 639]] {
            let sampler = PixelSampler::new(pixel, 7);
            let mut seen = [[0; 16]; 2];
            for index in 0..16 {
                let mut sample = sampler.sample(index);
                for pair in &mut seen {
                    let cell = (sample.next_2d() * 4.0).as_uvec2();
                    pair[(cell.y * 4 + cell.x) as usize] += 1;
                }
            }
            assert_eq!(seen[0], [1; 16], "{pixel:?}");
            assert_eq!(seen[1], [1; 16], "{pixel:?}");
        }
    }

    #[test]
    fn pixels_and_seeds_have_sequences_of_their_own() {
        let first = |pixel, seed| PixelSampler::new(pixel, seed).sample(0).next_2d();
        let base = first([3, 5], 0);
        for other in [first([5, 3], 0), first([3, 6], 0), first([3, 5], 1)] {
            assert_ne!(base, other);
        }
        assert_eq!(base, first([3, 5], 0));
    }

    #[test]
    fn four_numbers_at_once_are_those_of_the_crate() {
        for index in (0..MAX_SAMPLES).step_by(7).chain([MAX_SAMPLES - 1]) {
            for scramble in [0, 1, 0xdead_beef, u32::MAX] {
                assert_eq!(four(index, scramble), sobol_burley::sample_4d(index, 0, scramble));
            }
        }
    }

    #[test]
    fn sequence_is_followed_by_an_independent_one() {
        // The first 16 points fill each of 16 columns once, in another order in each sequence. So
        // the k-th points of two are in one column as often as chance has it, once in each pixel.
        let mut meetings = 0;
        for x in 0..400 {
            let sampler = PixelSampler::new([x, 0], 0);
            let column = |index| (sampler.sample(index).next_1d() * 16.0) as u32;
            let meet = |index: &u32| column(*index) == column(MAX_SAMPLES + index);
            meetings += (0..16).filter(meet).count();
        }
        let (expected, sigma) = (400.0, 20.0);
        assert!((meetings as f64 - expected).abs() < 4.0 * sigma, "{meetings}");
    }

    #[test]
    fn coordinates_go_on_without_repeating() {
        let mut sample = PixelSampler::new([0, 0], 0).sample(1);
        let mut coordinates: Vec<_> = (0..1000).map(|_| sample.next_1d()).collect();
        assert!(coordinates.iter().all(|x| (0.0..1.0).contains(x)));
        coordinates.sort_by(f32::total_cmp);
        coordinates.dedup();
        assert!(coordinates.len() > 990, "{} of 1000 are different", coordinates.len());
    }
}
