//! Irregularities of sixteen places at a time, with the bits of [`Line`](super::Line).

use fearless_simd::{Simd, f32x16, prelude::*, u32x16, u64x8};

use super::{FACTORS, GRAINS, INCREMENT, Use, intensity, start};
use crate::lanes::{Wide, WideMask};

/// Sixteen threads of an endless cloth.
#[derive(Clone, Copy)]
pub(crate) struct Lines<S: Simd> {
    pub(crate) seed: u64,
    pub(crate) is_warp: WideMask<S>,
    /// Their indices, counted over all repeats: whole numbers.
    pub(crate) index: Wide<S>,
}

/// The 64 bits of each of sixteen places.
type Bits<S> = [u64x8<S>; 2];

impl<S: Simd> Lines<S> {
    /// What the hashes of places on the threads start with.
    #[inline(always)]
    fn starts(self, usage: Use) -> Bits<S> {
        let simd = self.index.token();
        let weft = u64x8::splat(simd, start(self.seed, usage, false));
        let warp = u64x8::splat(simd, start(self.seed, usage, true));
        let [low, high] = self.index.to_u64();
        let [is_warp_low, is_warp_high] = self.is_warp.halves();
        [
            mix_lanes(is_warp_low.select(warp, weft) + low),
            mix_lanes(is_warp_high.select(warp, weft) + high),
        ]
    }

    /// A factor for the highlight of the grain (`along`, `across`) of each thread; the numbers are whole.
    #[inline(always)]
    pub(crate) fn intensity(self, along: Wide<S>, across: Wide<S>) -> f32x16<S> {
        let place = (along * GRAINS as f64 + across).to_u64();
        let [low, high] = hashes(self.starts(Use::Intensity), place);
        // The upper 24 bits of each, as a number.
        let bits: u32x16<S> = low.bitcast::<u32x16<S>>().unzip_high(high.bitcast::<u32x16<S>>());
        intensity((bits >> 8).to_float())
    }

    /// An even number in [−1, 1) for each thread, of its place 0.
    #[inline(always)]
    pub(crate) fn signed(self, usage: Use) -> Wide<S> {
        let none = u64x8::splat(self.index.token(), 0);
        signed(self.starts(usage), [none; 2])
    }

    /// Gradient noise at `cell + fraction`, 0 at every whole number.
    #[inline(always)]
    pub(crate) fn gradient(self, usage: Use, cell: Wide<S>, fraction: Wide<S>) -> Wide<S> {
        let (starts, cell) = (self.starts(usage), cell.to_u64());
        let t = fraction;
        let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let left = signed(starts, cell) * t;
        let right = signed(starts, [cell[0] + 1, cell[1] + 1]) * (t - 1.0);
        (left + (right - left) * fade) * 2.0
    }

    /// How much thicker each thread is at `cell + fraction`, in units of one length of a thick place.
    #[inline(always)]
    pub(crate) fn slub(self, rate: Wide<S>, cell: Wide<S>, fraction: Wide<S>) -> Wide<S> {
        let (starts, cell) = (self.starts(Use::Slub), cell.to_u64());
        let mut height = fraction.of(0.0);
        for step in [-1, 0, 1_i64] {
            let place = [cell[0] + step as u64, cell[1] + step as u64];
            let chance = uniform(starts, place);
            let is_thick = chance.lt(rate);
            if !is_thick.narrow().any_true() {
                continue;
            }
            let centre = chance / rate;
            let distance = (fraction - step as f64 - centre).abs();
            let bump = -(distance * distance) + 1.0;
            let bump = bump * bump * (uniform(starts, [!place[0], !place[1]]) * 0.5 + 0.5);
            let is_near = is_thick & distance.lt(fraction.of(1.0));
            height = height.max(bump.or(is_near, fraction.of(0.0)));
        }
        height
    }
}

/// An even number in [0, 1) for each place.
#[inline(always)]
fn uniform<S: Simd>(starts: Bits<S>, place: Bits<S>) -> Wide<S> {
    let [low, high] = hashes(starts, place);
    Wide::from_u53([low >> 11, high >> 11]) * (1.0 / (1_u64 << 53) as f64)
}

/// An even number in [−1, 1) for each place.
#[inline(always)]
fn signed<S: Simd>(starts: Bits<S>, place: Bits<S>) -> Wide<S> {
    uniform(starts, place) * 2.0 - 1.0
}

#[inline(always)]
fn hashes<S: Simd>(starts: Bits<S>, place: Bits<S>) -> Bits<S> {
    [mix_lanes(starts[0] + place[0]), mix_lanes(starts[1] + place[1])]
}

/// [`super::mix`] side by side.
#[inline(always)]
fn mix_lanes<S: Simd>(state: u64x8<S>) -> u64x8<S> {
    let z = state + INCREMENT;
    let z = (z ^ (z >> 30)) * FACTORS[0];
    let z = (z ^ (z >> 27)) * FACTORS[1];
    z ^ (z >> 31)
}
