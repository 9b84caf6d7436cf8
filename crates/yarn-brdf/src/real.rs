//! `Real`: the arithmetic the shading kernel needs.
//!
//! The kernel is written once, over this trait: for `f64`, the reference; for `f32`, one point at a
//! time; and for lanes of `f32` side by side, with a mask per lane instead of a `bool`. Constants of
//! a cloth are single numbers. Since only lanes know the instructions that they are made for, a
//! constant comes from a number at hand: `x.of(0.5)`.

use core::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{Level, f32x4};

use crate::math;

/// A real number, or several side by side, with the functions that the shading kernel calls.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<Self::Scalar, Output = Self>
    + Sub<Self::Scalar, Output = Self>
    + Mul<Self::Scalar, Output = Self>
{
    /// One of them.
    type Scalar: Scalar;
    /// The outcome of a comparison: `bool`, or one `bool` per lane.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// `value`, in as many lanes as `self` has.
    fn splat(self, value: Self::Scalar) -> Self;
    /// √`self`, for `self` ≥ 0.
    fn sqrt(self) -> Self;
    /// √ of each of four.
    fn sqrt_each(of: [Self; 4]) -> [Self; 4];
    /// |`self`|.
    fn abs(self) -> Self;
    /// |`self`| with the sign of `sign`, which that of a zero is.
    fn copysign(self, sign: Self) -> Self;
    /// The smaller of two; `other` if `self` is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater of two; `other` if `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// e to the power `self` ≤ 88.
    fn exp(self) -> Self;
    /// The natural logarithm of `self`, a normal number above 0.
    fn ln(self) -> Self;
    /// Arcsine in rad, for |`self`| ≤ 1.
    fn asin(self) -> Self;
    /// Sine and cosine of `self` in rad.
    fn sin_cos(self) -> (Self, Self);
    /// The angle of the point (`x`, `self`) in rad, in [−π, π].
    fn atan2(self, x: Self) -> Self;
    /// The scaled Bessel function e^{−x} I₀(x), for x = `self` ≥ 0.
    fn i0e(self) -> Self;
    /// What `function` makes of it, one after the other: where there is nothing better.
    fn map(self, function: impl Fn(f64) -> f64) -> Self;
    /// `self` < `other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// Whether `mask` holds in any lane: if not, what only those lanes need is left out.
    fn any(mask: Self::Mask) -> bool;
    /// `yes` where `mask` holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The entries of a table of n ≥ 2 before and after `position` in [0, n − 1], or the nearest end
    /// where it is outside, and the share of the way from the one to the other.
    fn entries(table: &[f32], position: Self) -> ([Self; 2], Self);
    /// The two values at (row, column) `at`, ≥ 0 and at most that of the last entry, of a table of
    /// `shape` rows and columns, at least 2 of each, fewer than [`ROW`] columns and [`NODES`] entries
    /// together, bilinear between them.
    fn bilinear(table: &Nodes, shape: [usize; 2], at: [Self; 2]) -> [Self; 2];

    /// The same of the first `count` entries of a short table.
    #[inline(always)]
    fn short_entries(table: &[f32; SHORT], count: usize, position: Self) -> ([Self; 2], Self) {
        Self::entries(&table[..count], position)
    }

    /// The value at `position` in [0, n − 1] of a table of n ≥ 2 entries, linear between them; at
    /// the nearest end where it is outside.
    #[inline(always)]
    fn linear(table: &[f32], position: Self) -> Self {
        let ([low, high], share) = Self::entries(table, position);
        low + (high - low) * share
    }

    /// The nearest number to `value`, in as many lanes as `self` has.
    #[must_use]
    #[inline(always)]
    fn of(self, value: f64) -> Self {
        self.splat(Self::Scalar::from_f64(value))
    }

    /// 1, in as many lanes as `self` has.
    #[must_use]
    #[inline(always)]
    fn one(self) -> Self {
        self.of(1.0)
    }

    /// 0, in as many lanes as `self` has.
    #[must_use]
    #[inline(always)]
    fn zero(self) -> Self {
        self.of(0.0)
    }

    /// Whether `self` > 0.
    #[inline(always)]
    fn is_positive(self) -> Self::Mask {
        self.zero().lt(self)
    }

    /// `self` between `low` and `high`.
    #[must_use]
    #[inline(always)]
    fn clamp_to(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
}

/// A single number, in which the constants of a cloth are held.
pub(crate) trait Scalar: Real<Scalar = Self, Mask = bool> {
    /// The nearest number to `value`.
    fn from_f64(value: f64) -> Self;
}

/// Entries of a short table, which lanes may hold in one register.
pub(crate) const SHORT: usize = 16;

/// Pairs of values at the entries of a table of two dimensions, and what is beyond its last.
pub(crate) type Nodes = [[f32; 2]; NODES + ROW];

/// A power of 2, so that an index is within a table of two dimensions when it is taken modulo this, as
/// are the entries next to it and those of the next row.
pub(crate) const NODES: usize = 4096;

/// More than a row of such a table, and its next entry.
pub(crate) const ROW: usize = 64;

macro_rules! impl_real {
    ($float:ty, $vec4:ty, $sqrt_each:path, $exp:path, $ln:path, $asin:path, $sin_cos:path, $atan2:path, $i0e:path) => {
        const _: () = {
            /// Added to a number, this leaves its nearest integer in the last bits: a conversion
            /// that saturates, as `as` does, takes longer.
            const ROUND: $float = 1.0 / <$float>::EPSILON;
            /// The entry at or before `position` in a table of `count` ≥ 2, that is not the last, and
            /// the rest.
            #[inline(always)]
            fn split(position: $float, count: usize) -> (usize, $float) {
                // At an entry, where the half is a tie, the one before it does as well. A NaN becomes 0.
                let rounded = (position - 0.5).clamp_to(0.0, (count - 2) as $float) + ROUND;
                let index = rounded.to_bits() - ROUND.to_bits();
                (index as usize, position - (rounded - ROUND))
            }
            impl Scalar for $float {
                #[inline(always)]
                fn from_f64(value: f64) -> Self {
                    value as $float
                }
            }
            impl Real for $float {
                type Scalar = Self;
                type Mask = bool;

                #[inline(always)]
                fn splat(self, value: Self) -> Self {
                    value
                }
                #[inline(always)]
                fn sqrt(self) -> Self {
                    self.sqrt()
                }
                #[inline(always)]
                fn sqrt_each(of: [Self; 4]) -> [Self; 4] {
                    $sqrt_each(of)
                }
                #[inline(always)]
                fn abs(self) -> Self {
                    self.abs()
                }
                #[inline(always)]
                fn copysign(self, sign: Self) -> Self {
                    self.copysign(sign)
                }
                #[inline(always)]
                fn min(self, other: Self) -> Self {
                    // One instruction; `f32::min`, which may return either of NaN, takes five.
                    if self < other { self } else { other }
                }
                #[inline(always)]
                fn max(self, other: Self) -> Self {
                    if self > other { self } else { other }
                }
                #[inline(always)]
                fn exp(self) -> Self {
                    $exp(self)
                }
                #[inline(always)]
                fn ln(self) -> Self {
                    $ln(self)
                }
                #[inline(always)]
                fn asin(self) -> Self {
                    $asin(self)
                }
                #[inline(always)]
                fn sin_cos(self) -> (Self, Self) {
                    $sin_cos(self)
                }
                #[inline(always)]
                fn atan2(self, x: Self) -> Self {
                    $atan2(self, x)
                }
                #[inline(always)]
                fn i0e(self) -> Self {
                    $i0e(self)
                }
                #[inline(always)]
                fn map(self, function: impl Fn(f64) -> f64) -> Self {
                    function(self.into()) as $float
                }
                #[inline(always)]
                fn lt(self, other: Self) -> bool {
                    self < other
                }
                #[inline(always)]
                fn any(mask: bool) -> bool {
                    mask
                }
                #[inline(always)]
                fn select(mask: bool, yes: Self, no: Self) -> Self {
                    if mask { yes } else { no }
                }
                #[inline(always)]
                fn entries(table: &[f32], position: Self) -> ([Self; 2], Self) {
                    let position = position.clamp_to(0.0, (table.len() - 1) as $float);
                    let (index, share) = split(position, table.len());
                    ([table[index].into(), table[index + 1].into()], share)
                }
                #[inline(always)]
                fn bilinear(
                    table: &Nodes,
                    [rows, columns]: [usize; 2],
                    [row, column]: [Self; 2],
                ) -> [Self; 2] {
                    let (i, rest_i) = split(row, rows);
                    let (j, rest_j) = split(column, columns);
                    let first = (i * columns + j) % NODES;
                    let pairs = |at: usize| {
                        let [[a, b], [c, d]] = [table[at], table[at + 1]];
                        <$vec4>::new(a.into(), b.into(), c.into(), d.into())
                    };
                    let (near, far) = (pairs(first), pairs(first + columns));
                    let [a, b, c, d] = (near + (far - near) * rest_i).to_array();
                    [a + (c - a) * rest_j, b + (d - b) * rest_j]
                }
            }
        };
    };
}

/// √ of each, in one instruction where the processor has one.
#[inline(always)]
fn sqrt_each(of: [f32; 4]) -> [f32; 4] {
    fearless_simd::dispatch!(Level::baseline(), simd => f32x4::simd_from(simd, of).sqrt().into())
}

#[inline(always)]
fn sqrt_each_f64(of: [f64; 4]) -> [f64; 4] {
    of.map(f64::sqrt)
}

impl_real!(
    f32,
    glam::Vec4,
    sqrt_each,
    math::exp,
    math::ln,
    math::asin,
    math::sin_cos,
    math::atan2,
    math::i0e
);
impl_real!(
    f64,
    glam::DVec4,
    sqrt_each_f64,
    f64::exp,
    f64::ln,
    f64::asin,
    f64::sin_cos,
    f64::atan2,
    pxfm::f_i0e
);
