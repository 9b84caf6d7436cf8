//! Two blocks of lanes at a time.
//!
//! Most of the kernel is long chains of operations that wait for each other. A register of AVX-512 holds a
//! whole block, and with one chain at a time its units stand idle most of the time; the other
//! instruction sets have several registers to a block, and with them several chains.

use core::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use fearless_simd::{Level, Simd, f32x16, mask32x16, prelude::*};

use crate::lanes::LANES;
use crate::math::{self, Single};
use crate::real::{Nodes, Real, SHORT};

/// Whether two blocks at a time are faster than one after the other.
#[inline(always)]
pub(crate) fn is_paired<S: Simd>(simd: S) -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Level::Avx512(_) = simd.level() {
        return true;
    }
    let _: Level = simd.level();
    false
}

/// The lanes of one block or more, as they lie in memory.
pub(crate) trait Blocks<S: Simd>: Real<Scalar = f32> {
    /// How many blocks.
    const COUNT: usize;

    /// Those that `of` tells of the blocks from the numbers `firsts` on.
    fn of_blocks(firsts: [usize; 2], of: impl Fn(usize) -> f32x16<S>) -> Self;

    /// Sets the numbers of `to` in the blocks from `firsts` on.
    fn put(self, to: &mut [f32], firsts: [usize; 2]);

    /// The numbers of `from` in those blocks.
    #[inline(always)]
    fn load(simd: S, from: &[f32], firsts: [usize; 2]) -> Self {
        Self::of_blocks(firsts, |first| f32x16::from_slice(simd, &from[first..first + LANES]))
    }
}

impl<S: Simd> Blocks<S> for f32x16<S> {
    const COUNT: usize = 1;

    #[inline(always)]
    fn of_blocks([first, _]: [usize; 2], of: impl Fn(usize) -> Self) -> Self {
        of(first)
    }
    #[inline(always)]
    fn put(self, to: &mut [f32], [first, _]: [usize; 2]) {
        self.store_slice(&mut to[first..first + LANES]);
    }
}

/// Two blocks of lanes.
#[derive(Clone, Copy)]
pub(crate) struct Pair<S: Simd>([f32x16<S>; 2]);

/// Which lanes of two blocks.
#[derive(Clone, Copy)]
pub(crate) struct PairMask<S: Simd>([mask32x16<S>; 2]);

impl<S: Simd> Blocks<S> for Pair<S> {
    const COUNT: usize = 2;

    #[inline(always)]
    fn of_blocks([first, second]: [usize; 2], of: impl Fn(usize) -> f32x16<S>) -> Self {
        Self([of(first), of(second)])
    }
    #[inline(always)]
    fn put(self, to: &mut [f32], [first, second]: [usize; 2]) {
        self.0[0].store_slice(&mut to[first..first + LANES]);
        self.0[1].store_slice(&mut to[second..second + LANES]);
    }
}

impl<S: Simd> BitAnd for PairMask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self([self.0[0] & other.0[0], self.0[1] & other.0[1]])
    }
}

impl<S: Simd> Neg for Pair<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1]])
    }
}

macro_rules! impl_operators {
    ($($Operator:ident, $operator:ident $(, $with_number:ident)?;)*) => { $(
        impl<S: Simd> $Operator for Pair<S> {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, other: Self) -> Self {
                let ([a, b], [c, d]) = (self.0, other.0);
                Self([$Operator::$operator(a, c), $Operator::$operator(b, d)])
            }
        }
        $(
            impl<S: Simd> $Operator<$with_number> for Pair<S> {
                type Output = Self;

                #[inline(always)]
                fn $operator(self, other: $with_number) -> Self {
                    let [a, b] = self.0;
                    Self([$Operator::$operator(a, other), $Operator::$operator(b, other)])
                }
            }
        )?
    )* };
}

impl_operators! {
    Add, add, f32;
    Sub, sub, f32;
    Mul, mul, f32;
    Div, div;
}

impl<S: Simd> Real for Pair<S> {
    type Scalar = f32;
    type Mask = PairMask<S>;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        let all = Real::splat(self.0[0], value);
        Self([all, all])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self([Real::sqrt(self.0[0]), Real::sqrt(self.0[1])])
    }
    #[inline(always)]
    fn sqrt_each(of: [Self; 4]) -> [Self; 4] {
        [of[0].sqrt(), of[1].sqrt(), of[2].sqrt(), of[3].sqrt()]
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self([Real::abs(self.0[0]), Real::abs(self.0[1])])
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self([Real::copysign(self.0[0], sign.0[0]), Real::copysign(self.0[1], sign.0[1])])
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self([Real::min(self.0[0], other.0[0]), Real::min(self.0[1], other.0[1])])
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self([Real::max(self.0[0], other.0[0]), Real::max(self.0[1], other.0[1])])
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
        Self([self.0[0].map(&function), self.0[1].map(&function)])
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        PairMask([self.0[0].lt(other.0[0]), self.0[1].lt(other.0[1])])
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        (mask.0[0] | mask.0[1]).any_true()
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        let ([a, b], [c, d]) = (yes.0, no.0);
        Self([Real::select(mask.0[0], a, c), Real::select(mask.0[1], b, d)])
    }
    #[inline(always)]
    fn entries(table: &[f32], position: Self) -> ([Self; 2], Self) {
        let [a, b] = position.0;
        joined(Real::entries(table, a), Real::entries(table, b))
    }
    #[inline(always)]
    fn short_entries(table: &[f32; SHORT], count: usize, position: Self) -> ([Self; 2], Self) {
        let [a, b] = position.0;
        joined(Real::short_entries(table, count, a), Real::short_entries(table, count, b))
    }
    #[inline(always)]
    fn bilinear(table: &Nodes, shape: [usize; 2], [row, column]: [Self; 2]) -> [Self; 2] {
        let [a, b] = Real::bilinear(table, shape, [row.0[0], column.0[0]]);
        let [c, d] = Real::bilinear(table, shape, [row.0[1], column.0[1]]);
        [Self([a, c]), Self([b, d])]
    }
}

/// What [`Real::entries`] tells of two blocks.
#[inline(always)]
fn joined<S: Simd>(
    ([a, b], c): ([f32x16<S>; 2], f32x16<S>),
    ([d, e], f): ([f32x16<S>; 2], f32x16<S>),
) -> ([Pair<S>; 2], Pair<S>) {
    ([Pair([a, d]), Pair([b, e])], Pair([c, f]))
}

impl<S: Simd> Single for Pair<S> {
    #[inline(always)]
    fn exp2_int(self) -> Self {
        Self([self.0[0].exp2_int(), self.0[1].exp2_int()])
    }

    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let ((a, b), (c, d)) = (self.0[0].split_exponent(), self.0[1].split_exponent());
        (Self([a, c]), Self([b, d]))
    }
}
