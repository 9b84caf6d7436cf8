//! Sixteen numbers side by side: [`Real`] for `f32x16` of any instruction set.
//!
//! Every operation rounds as that of a single `f32` does and none is fused with another, so that each
//! lane has the bits that one point at a time would have.
//!
//! A function is compiled for the instructions of the one that it is inlined into. So everything down
//! to here is always inlined, and there is no closure in which lanes are computed with: those are
//! functions of their own, which the compiler may leave where they are.

use core::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use fearless_simd::{
    Level, Simd, f32x4, f32x16, f64x8, i32x16, mask32x16, mask64x8, prelude::*, u8x64, u32x16,
    u64x8,
};

use crate::math::{self, Single};
use crate::real::{NODES, Nodes, Real, SHORT};

/// How many lanes there are.
pub(crate) const LANES: usize = 16;

/// Whether `min` and `max` return their second operand where either is NaN or both are 0, as
/// [`Real::min`] does.
const HAS_ORDERED_MIN: bool = cfg!(any(target_arch = "x86", target_arch = "x86_64"));

impl<S: Simd> Real for f32x16<S> {
    type Scalar = f32;
    type Mask = mask32x16<S>;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        SimdBase::splat(self.token(), value)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        SimdFloat::sqrt(self)
    }
    #[inline(always)]
    fn sqrt_each(of: [Self; 4]) -> [Self; 4] {
        [Real::sqrt(of[0]), Real::sqrt(of[1]), Real::sqrt(of[2]), Real::sqrt(of[3])]
    }
    #[inline(always)]
    fn abs(self) -> Self {
        SimdBase::abs(self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        SimdFloat::copysign(self, sign)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if HAS_ORDERED_MIN {
            SimdBase::min(self, other)
        } else {
            Real::select(self.lt(other), self, other)
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if HAS_ORDERED_MIN {
            SimdBase::max(self, other)
        } else {
            Real::select(other.lt(self), self, other)
        }
    }
    #[inline(always)]
    fn exp(self) -> Self {
        math::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        math::ln(self)
    }
    #[inline(always)]
    fn asin(self) -> Self {
        math::asin(self)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        math::sin_cos(self)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        math::atan2(self, x)
    }
    #[inline(always)]
    fn i0e(self) -> Self {
        math::i0e(self)
    }
    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        Self::from_fn(self.token(), |i| self[i].map(&function))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.simd_lt(other)
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        mask.any_true()
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Select::select(mask, yes, no)
    }
    #[inline(always)]
    fn entries(table: &[f32], position: Self) -> ([Self; 2], Self) {
        let last = number(position, table.len() - 1);
        let position = position.clamp_to(position.zero(), last);
        let (floor, share) = split(position, table.len());
        let at = indices(floor);
        let simd = position.token();
        let low = Self::from_fn(simd, |i| table[at[i] as usize]);
        let high = Self::from_fn(simd, |i| table[at[i] as usize + 1]);
        ([low, high], share)
    }
    #[inline(always)]
    fn short_entries(table: &[f32; SHORT], count: usize, position: Self) -> ([Self; 2], Self) {
        let last = number(position, count - 1);
        let (floor, share) = split(position.clamp_to(position.zero(), last), count);
        let simd = position.token();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Level::Avx512(_) = simd.level() {
            // One instruction takes bytes from anywhere in a register.
            let bits: u32x16<S> = (floor + ROUND).bitcast();
            let bytes = (bits - ROUND.to_bits()) * 0x0404_0404 + 0x0302_0100;
            let all = Self::simd_from(simd, *table);
            let low = all.swizzle_dyn(bytes.bitcast::<u8x64<S>>());
            let high = all.swizzle_dyn((bytes + 0x0404_0404).bitcast::<u8x64<S>>());
            return ([low, high], share);
        }
        let at = indices(floor);
        let low = Self::from_fn(simd, |i| table[at[i] as usize % SHORT]);
        let high = Self::from_fn(simd, |i| table[(at[i] as usize + 1) % SHORT]);
        ([low, high], share)
    }
    #[inline(always)]
    fn bilinear(table: &Nodes, [rows, columns]: [usize; 2], [row, column]: [Self; 2]) -> [Self; 2] {
        let (i, rest_i) = split(row, rows);
        let (j, rest_j) = split(column, columns);
        let at = indices(i * columns as f32 + j);
        let simd = row.token();
        // In turn the first and second value at a node and those at the next.
        let near = quadruples(simd, |lane| node_pair(table, at[lane] as usize % NODES));
        let far = quadruples(simd, |lane| node_pair(table, at[lane] as usize % NODES + columns));
        let a = near[0] + (far[0] - near[0]) * rest_i;
        let b = near[1] + (far[1] - near[1]) * rest_i;
        let c = near[2] + (far[2] - near[2]) * rest_i;
        let d = near[3] + (far[3] - near[3]) * rest_i;
        [a + (c - a) * rest_j, b + (d - b) * rest_j]
    }
}

impl<S: Simd> Single for f32x16<S> {
    #[inline(always)]
    fn exp2_int(self) -> Self {
        let bits: u32x16<S> = (self + math::BIASED).bitcast();
        (bits << 23).bitcast()
    }

    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let bits: i32x16<S> = self.bitcast();
        let exponent = (bits - math::SQRT_HALF) >> 23;
        ((bits - (exponent << 23)).bitcast(), exponent.to_float())
    }
}

/// Both values of the node at `index` and of the next.
#[inline(always)]
fn node_pair(table: &Nodes, index: usize) -> &[f32] {
    table[index..index + 2].as_flattened()
}

/// Sets the [`LANES`] numbers from `first` on in each part of `to`.
#[inline(always)]
pub(crate) fn put<S: Simd, const N: usize>(
    [a, b, c]: [f32x16<S>; 3],
    to: &mut [[f32; N]; 3],
    first: usize,
) {
    // Not in a loop: an iterator would move the numbers about in memory, which stalls.
    a.store_slice(&mut to[0][first..first + LANES]);
    b.store_slice(&mut to[1][first..first + LANES]);
    c.store_slice(&mut to[2][first..first + LANES]);
}

/// Four numbers of each lane, from the slice of as many that `of` tells for it.
#[inline(always)]
pub(crate) fn quadruples<'a, S: Simd>(simd: S, of: impl Fn(usize) -> &'a [f32]) -> [f32x16<S>; 4] {
    let a = four(simd, [of(0), of(1), of(2), of(3)]);
    let b = four(simd, [of(4), of(5), of(6), of(7)]);
    let c = four(simd, [of(8), of(9), of(10), of(11)]);
    let d = four(simd, [of(12), of(13), of(14), of(15)]);
    let (even_low, odd_low) = a.deinterleave(b);
    let (even_high, odd_high) = c.deinterleave(d);
    let (first, third) = even_low.deinterleave(even_high);
    let (second, fourth) = odd_low.deinterleave(odd_high);
    [first, second, third, fourth]
}

/// Four slices of four, one after the other.
#[inline(always)]
fn four<S: Simd>(simd: S, [a, b, c, d]: [&[f32]; 4]) -> f32x16<S> {
    let low = f32x4::from_slice(simd, a).combine(f32x4::from_slice(simd, b));
    low.combine(f32x4::from_slice(simd, c).combine(f32x4::from_slice(simd, d)))
}

/// Added to a number up to 2²², this leaves its nearest integer in the last bits.
const ROUND: f32 = 1.0 / f32::EPSILON;

/// The entry at or before `position` in a table of `count` ≥ 2, that is not the last, and the rest:
/// as for a single number.
#[inline(always)]
fn split<S: Simd>(position: f32x16<S>, count: usize) -> (f32x16<S>, f32x16<S>) {
    let last = number(position, count - 2);
    let floor = ((position - 0.5).clamp_to(position.zero(), last) + ROUND) - ROUND;
    (floor, position - floor)
}

/// `floor`, integers below 2²², as such.
#[inline(always)]
fn indices<S: Simd>(floor: f32x16<S>) -> [u32; LANES] {
    let bits: u32x16<S> = (floor + ROUND).bitcast();
    (bits - ROUND.to_bits()).into()
}

#[inline(always)]
fn number<S: Simd>(like: f32x16<S>, count: usize) -> f32x16<S> {
    Real::splat(like, count as f32)
}

/// Which of sixteen `f64`: as a mask of sixteen `f32` it would be taken apart again for each use.
#[derive(Clone, Copy)]
pub(crate) struct WideMask<S: Simd>([mask64x8<S>; 2]);

impl<S: Simd> WideMask<S> {
    /// That of sixteen `f32`.
    #[inline(always)]
    pub(crate) fn of(mask: mask32x16<S>) -> Self {
        let (low, high) = mask.widen();
        Self([low, high])
    }

    /// That of the first eight and that of the others.
    #[inline(always)]
    pub(crate) fn halves(self) -> [mask64x8<S>; 2] {
        self.0
    }

    /// As one of sixteen `f32`.
    #[inline(always)]
    pub(crate) fn narrow(self) -> mask32x16<S> {
        self.0[0].narrow(self.0[1])
    }
}

impl<S: Simd> BitAnd for WideMask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self([self.0[0] & other.0[0], self.0[1] & other.0[1]])
    }
}

/// Sixteen `f64`: positions need more digits than an `f32` has.
#[derive(Clone, Copy)]
pub(crate) struct Wide<S: Simd>([f64x8<S>; 2]);

impl<S: Simd> Wide<S> {
    /// `value` in every lane.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self([f64x8::splat(simd, value); 2])
    }

    /// Those that `of` tells for each lane.
    #[inline(always)]
    pub(crate) fn from_fn(simd: S, of: impl Fn(usize) -> f64) -> Self {
        Self([f64x8::from_fn(simd, &of), f64x8::from_fn(simd, |lane| of(8 + lane))])
    }

    /// Those of a slice of [`LANES`].
    #[inline(always)]
    pub(crate) fn load(simd: S, values: &[f64]) -> Self {
        Self([f64x8::from_slice(simd, &values[..8]), f64x8::from_slice(simd, &values[8..16])])
    }

    /// Integers as numbers.
    #[inline(always)]
    pub(crate) fn from_u32(integers: u32x16<S>) -> Self {
        // The bits of 2⁵² have room for an integer at their end.
        let (low, high) = integers.interleave((TWO_52.to_bits() >> 32) as u32);
        Self([low.bitcast(), high.bitcast()]) - TWO_52
    }

    /// Integers below 2⁵³ as numbers.
    #[inline(always)]
    pub(crate) fn from_u53(integers: [u64x8<S>; 2]) -> Self {
        // The bits of 2⁸⁴ and of 2⁵² have room for the upper and the lower half at their ends.
        let [a, b] = integers;
        let (high_a, high_b) = (a >> 32 | TWO_84.to_bits(), b >> 32 | TWO_84.to_bits());
        let half = u64::from(u32::MAX);
        let (low_a, low_b) = (a & half | TWO_52.to_bits(), b & half | TWO_52.to_bits());
        let high = Self([high_a.bitcast(), high_b.bitcast()]);
        high - (TWO_84 + TWO_52) + Self([low_a.bitcast(), low_b.bitcast()])
    }

    /// Numbers that are integers in [0, 2³²) as such.
    #[inline(always)]
    pub(crate) fn to_u32(self) -> u32x16<S> {
        let [low, high] = (self + TWO_52).0;
        low.bitcast::<u32x16<S>>().unzip_low(high.bitcast::<u32x16<S>>())
    }

    /// Whole numbers, up to ±2⁵⁰, as integers modulo 2⁶⁴.
    #[inline(always)]
    pub(crate) fn to_u64(self) -> [u64x8<S>; 2] {
        let [low, high] = (self + ROUND_F64).0;
        let (low, high): (u64x8<S>, u64x8<S>) = (low.bitcast(), high.bitcast());
        [low - ROUND_F64.to_bits(), high - ROUND_F64.to_bits()]
    }

    /// The largest whole numbers up to these, within ±2⁵⁰.
    #[inline(always)]
    pub(crate) fn floor(self) -> Self {
        let [a, b] = self.0;
        match a.token().level() {
            // One at a time, by a function.
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Sse2(_) => {
                let nearest = (self + ROUND_F64) - ROUND_F64;
                (nearest - 1.0).or(self.lt(nearest), nearest)
            }
            _ => Self([a.floor(), b.floor()]),
        }
    }

    /// One after the other.
    #[inline(always)]
    pub(crate) fn to_array(self) -> [f64; LANES] {
        core::array::from_fn(|lane| self.0[lane / 8][lane % 8])
    }

    /// The nearest `f32`.
    #[inline(always)]
    pub(crate) fn narrow(self) -> f32x16<S> {
        self.0[0].narrow(self.0[1])
    }

    /// Each lane where `mask` holds, else that of `other`.
    #[inline(always)]
    pub(crate) fn or(self, mask: WideMask<S>, other: Self) -> Self {
        let [low, high] = mask.0;
        Self([low.select(self.0[0], other.0[0]), high.select(self.0[1], other.0[1])])
    }

    /// |`self`|.
    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        let [a, b] = self.0;
        Self([SimdBase::abs(a), SimdBase::abs(b)])
    }

    /// |`self`| with the sign of `sign`, which that of a zero is.
    #[inline(always)]
    pub(crate) fn copysign(self, sign: Self) -> Self {
        Self([SimdFloat::copysign(self.0[0], sign.0[0]), SimdFloat::copysign(self.0[1], sign.0[1])])
    }

    /// The smaller of two numbers.
    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        Self([SimdBase::min(self.0[0], other.0[0]), SimdBase::min(self.0[1], other.0[1])])
    }

    /// The greater of two numbers.
    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        Self([SimdBase::max(self.0[0], other.0[0]), SimdBase::max(self.0[1], other.0[1])])
    }

    /// `self` ≤ `other`; false where either is NaN.
    #[inline(always)]
    pub(crate) fn le(self, other: Self) -> WideMask<S> {
        WideMask([self.0[0].simd_le(other.0[0]), self.0[1].simd_le(other.0[1])])
    }

    /// `self` < `other`; false where either is NaN.
    #[inline(always)]
    pub(crate) fn lt(self, other: Self) -> WideMask<S> {
        WideMask([self.0[0].simd_lt(other.0[0]), self.0[1].simd_lt(other.0[1])])
    }

    /// The same number in every lane.
    #[inline(always)]
    pub(crate) fn of(self, value: f64) -> Self {
        Self::splat(self.token(), value)
    }

    /// The instructions that these lanes are made for.
    #[inline(always)]
    pub(crate) fn token(self) -> S {
        self.0[0].token()
    }
}

/// Added to a number up to ±2⁵⁰, this leaves its nearest integer in the last bits.
pub(crate) const ROUND_F64: f64 = 1.5 / f64::EPSILON;

/// Added to a number in [0, 2³²), this leaves its nearest integer in the last bits.
const TWO_52: f64 = 1.0 / f64::EPSILON;

/// 2³² times that.
const TWO_84: f64 = TWO_52 * (1_u64 << 32) as f64;

macro_rules! impl_operators {
    ($($Operator:ident, $operator:ident;)*) => { $(
        impl<S: Simd> $Operator for Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, other: Self) -> Self {
                let ([a, b], [c, d]) = (self.0, other.0);
                Self([$Operator::$operator(a, c), $Operator::$operator(b, d)])
            }
        }
        impl<S: Simd> $Operator<f64> for Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, other: f64) -> Self {
                let [a, b] = self.0;
                Self([$Operator::$operator(a, other), $Operator::$operator(b, other)])
            }
        }
    )* };
}

impl_operators! {
    Add, add;
    Sub, sub;
    Mul, mul;
    Div, div;
}

impl<S: Simd> Neg for Wide<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let [a, b] = self.0;
        Self([-a, -b])
    }
}

/// The value of `$op`, which is compiled for each set of instructions that is worth it and run with those
/// of `$level`. Those between SSE2 and AVX2 have nothing that the kernel would gain by.
macro_rules! dispatch {
    ($level:expr, $simd:ident => $op:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        {
            use fearless_simd::Simd as _;
            if let Some($simd) = level.as_avx512() {
                $simd.vectorize(
                    #[inline(always)]
                    || $op,
                )
            } else if let Some($simd) = level.as_avx2() {
                $simd.vectorize(
                    #[inline(always)]
                    || $op,
                )
            } else {
                let $simd = level.as_sse2().expect("every x86-64 processor has SSE2");
                $simd.vectorize(
                    #[inline(always)]
                    || $op,
                )
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            fearless_simd::dispatch!(level, $simd => $op)
        }
    }};
}

pub(crate) use dispatch;
