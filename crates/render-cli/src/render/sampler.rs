//! The numbers that choose paths: a scrambled Sobol sequence of its own for each pixel.
//!
//! A number is a function of seed, pixel, sample and dimension; there is no generator to share.

use std::{array, sync::LazyLock};

use fearless_simd::{Level, Simd, dispatch};
use glam::Vec2;
use sobol_burley::parts::{
    Int4, hash, hash_int4, owen_scramble_int4_rev, owen_scramble_rev, sobol_int4_rev,
    u32_to_f32_norm,
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
    /// Coordinates read.
    read: u32,
    /// Sets of four coordinates begun.
    sets: u32,
    /// The last of them, in turn.
    kept: [[f32; 4]; KEPT],
}

/// Sets of coordinates that a sample keeps: a power of two.
const KEPT: usize = 4;

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
        Sample { scramble, index: index % MAX_SAMPLES, read: 0, sets: 0, kept: [[0.0; 4]; KEPT] }
    }
}

impl Sample {
    /// The next coordinate, in [0, 1).
    pub fn next_1d(&mut self) -> f32 {
        if self.read == 4 * self.sets {
            let set = four(self.index, self.next_scramble());
            self.keep(set);
        }
        let place = self.read as usize;
        self.read += 1;
        self.kept[place / 4 % KEPT][place % 4]
    }

    /// The next three coordinates that are of one set, in [0, 1)³: those that are left of another one before are skipped,
    /// since three of two sets are not even together.
    pub fn next_3d(&mut self) -> [f32; 3] {
        if self.read % 4 > 1 {
            self.read = self.read.next_multiple_of(4);
        }
        array::from_fn(|_| self.next_1d())
    }

    /// Where a pattern starts that the samples of a pixel turn and shift, so that what all of them together put
    /// on a surface is spread as evenly as by each: point by point of a lattice (Kronecker 1884) that is shifted
    /// anew for each pixel. In units of 2⁻³²; uniform for each sample by itself.
    pub fn start(&self) -> [u32; 2] {
        let shift = mix(u64::from(self.scramble) << 32 | u64::from(OF_START));
        let [x, y] = STEP.map(|step| self.index.wrapping_mul(step));
        [((shift >> 32) as u32).wrapping_add(x), (shift as u32).wrapping_add(y)]
    }

    /// Of the next set.
    fn next_scramble(&self) -> u32 {
        self.scramble ^ mix(self.sets.into()) as u32
    }

    fn keep(&mut self, set: [f32; 4]) {
        self.kept[self.sets as usize % KEPT] = set;
        self.sets += 1;
    }

    /// The next two coordinates, in [0, 1)².
    pub fn next_2d(&mut self) -> Vec2 {
        Vec2::new(self.next_1d(), self.next_1d())
    }
}

/// Makes the next `count` coordinates of all `samples`, at most 13, ready to be read: sixteen samples
/// at a time, which takes a fraction of the time. Their bits are the same without.
pub fn prepare<'a>(samples: impl Iterator<Item = &'a mut Sample>, count: u32) {
    let level = Level::new();
    let is_short = |sample: &Sample| 4 * sample.sets < sample.read + count.min(4 * KEPT as u32 - 3);
    let mut short: Vec<_> = samples.filter(|sample| is_short(sample)).collect();
    while !short.is_empty() {
        for samples in short.chunks_mut(LANES) {
            let (mut index, mut scramble) = ([0; LANES], [0; LANES]);
            for ((index, scramble), sample) in index.iter_mut().zip(&mut scramble).zip(&*samples) {
                (*index, *scramble) = (sample.index, sample.next_scramble());
            }
            let sets = dispatch!(level, simd => fours(simd, &index, &scramble));
            for (lane, sample) in samples.iter_mut().enumerate() {
                sample.keep(array::from_fn(|dimension| sets[dimension][lane]));
            }
        }
        short.retain(|sample| is_short(sample));
    }
}

/// Of the index, and of each dimension: keeps them independent where they get equal scramblings.
const OF_INDEX: u32 = 0x79c6_8e4a;
const BY_DIMENSION: [u32; 4] = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];

/// Keeps the scrambling of a set from cancelling those of dimensions.
const OF_SET: u32 = 0x9c8f_2d3b;

/// The integers of the sequence, which it sums bit by bit, for four bits of the index at once.
static OF_BITS: LazyLock<[[Int4; 16]; 4]> = LazyLock::new(|| {
    let of = |place: usize, bits: usize| sobol_int4_rev((bits << (28 - 4 * place)) as u32, 0);
    array::from_fn(|place| array::from_fn(|bits| of(place, bits)))
});

/// The sum of those of an index that is shuffled and reversed.
#[inline(always)]
fn sobol(of_bits: &[[Int4; 16]; 4], shuffled: u32) -> Int4 {
    let part = |place: usize| of_bits[place][(shuffled >> (28 - 4 * place)) as usize % 16];
    part(0) ^ part(1) ^ part(2) ^ part(3)
}

/// [`sobol_burley::sample_4d`] of the first four dimensions, from its parts.
fn four(index: u32, scramble: u32) -> [f32; 4] {
    let shuffled = owen_scramble_rev(index.reverse_bits(), hash(scramble ^ OF_INDEX));
    let of_set: Int4 = [scramble.wrapping_mul(OF_SET); 4].into();
    let scramble = hash_int4(of_set ^ BY_DIMENSION.into());
    owen_scramble_int4_rev(sobol(&OF_BITS, shuffled), scramble).reverse_bits().to_f32_norm()
}

/// Keeps the shift of the lattice from being a scrambling.
const OF_START: u32 = 0x5bd1_e995;

/// The steps of the lattice, 0.150470 and 0.590189: of 60 000 pairs the ones by which 2 to 64 samples, of 1, 4, 8 and
/// 16 points each, are spread with the least diaphony (Zinterhof 1976).
const STEP: [u32; 2] = [0x2685_33b1, 0x9716_a055];

/// Samples side by side.
const LANES: usize = 16;

/// [`four`] of each index and scrambling, by dimension: plain loops over what the compiler finds to be
/// lanes.
#[inline(always)]
fn fours<S: Simd>(_: S, index: &[u32; LANES], scramble: &[u32; LANES]) -> [[f32; LANES]; 4] {
    let mut shuffled = [0; LANES];
    for lane in 0..LANES {
        let scramble = hash(scramble[lane] ^ OF_INDEX);
        shuffled[lane] = owen_scramble_rev(index[lane].reverse_bits(), scramble);
    }
    let of_bits = &*OF_BITS;
    let mut sums = [[0; LANES]; 4];
    for lane in 0..LANES {
        let sum: [u32; 4] = sobol(of_bits, shuffled[lane]).into();
        for dimension in 0..4 {
            sums[dimension][lane] = sum[dimension];
        }
    }
    let mut sets = [[0.0; LANES]; 4];
    for dimension in 0..4 {
        for lane in 0..LANES {
            let scramble = scramble[lane].wrapping_mul(OF_SET) ^ BY_DIMENSION[dimension];
            let scrambled = owen_scramble_rev(sums[dimension][lane], hash(scramble));
            sets[dimension][lane] = u32_to_f32_norm(scrambled.reverse_bits());
        }
    }
    sets
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
    fn three_coordinates_are_even_together_whatever_was_read_before() {
        for pixel in 0..20 {
            let sampler = PixelSampler::new([pixel, 0], 7);
            for read in [0, 2, 3, 4, 6] {
                let mut seen = [0; 8];
                for index in 0..16 {
                    let mut sample = sampler.sample(index);
                    (0..read).for_each(|_| {
                        sample.next_1d();
                    });
                    let [x, y, z] = sample.next_3d().map(|x| (2.0 * x) as usize);
                    seen[4 * z + 2 * y + x] += 1;
                }
                assert_eq!(seen, [2; 8], "{pixel} {read}");
            }
        }
    }

    #[test]
    fn starts_of_a_pixel_fill_a_grid_evenly() {
        for pixel in 0..100 {
            let sampler = PixelSampler::new([pixel, 0], 7);
            let mut filled = [0; 16];
            for index in 0..64 {
                let [x, y] = sampler.sample(index).start();
                filled[(x >> 30 << 2 | y >> 30) as usize] += 1;
            }
            // Of 64 drawn at random, each of the 16 cells would hold 2 to 6 in one of 30 pixels.
            assert!(filled.iter().all(|count| (2..=6).contains(count)), "{pixel}: {filled:?}");
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
        let start = |pixel, seed| PixelSampler::new(pixel, seed).sample(0).start();
        for other in [start([5, 3], 0), start([3, 6], 0), start([3, 5], 1)] {
            assert_ne!(start([3, 5], 0), other);
        }
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
    fn prepared_coordinates_are_those_that_follow() {
        let start = |pixel: u32| PixelSampler::new([pixel, 7], 3).sample(pixel % 5);
        let mut prepared: Vec<_> = (0..37).map(start).collect();
        let mut plain = prepared.clone();
        for (round, count) in [3, 13, 9, 5, 13].into_iter().enumerate() {
            prepare(prepared.iter_mut(), count);
            for (pixel, (prepared, plain)) in prepared.iter_mut().zip(&mut plain).enumerate() {
                assert!(prepared.sets * 4 >= prepared.read + count, "{prepared:?} {count}");
                // Less than is prepared and more, by turns.
                for _ in 0..count + pixel as u32 % 7 - 3 * (round as u32 % 2) {
                    assert_eq!(prepared.next_1d(), plain.next_1d(), "{pixel} {round}");
                }
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
