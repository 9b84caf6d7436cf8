//! `Real`: the arithmetic the shading kernel needs.
//!
//! The kernel is written once, without branches, over this trait. `f64` is the reference and `f32`
//! what a renderer calls; lanes of `f32` fit in the same way, with a mask per lane instead of a
//! `bool`.

use core::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

/// A real number, or several side by side, with the functions that the shading kernel calls.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The outcome of a comparison: `bool`, or one `bool` per lane.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// The nearest number to `value`, in every lane.
    fn from_f64(value: f64) -> Self;
    /// √`self`, for `self` ≥ 0.
    fn sqrt(self) -> Self;
    /// |`self`|.
    fn abs(self) -> Self;
    /// The smaller of two; `other` if `self` is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater of two; `other` if `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// The greatest integer not above `self`.
    fn floor(self) -> Self;
    /// e to the power `self`.
    fn exp(self) -> Self;
    /// Arcsine in rad, for |`self`| ≤ 1.
    fn asin(self) -> Self;
    /// Sine and cosine of `self` in rad.
    fn sin_cos(self) -> (Self, Self);
    /// `self` < `other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `yes` where `mask` holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// `table[index]`, with `index` an integer ≥ 0; the last entry where it is beyond the table.
    fn gather(table: &[f32], index: Self) -> Self;

    /// 1.
    #[must_use]
    fn one() -> Self {
        Self::from_f64(1.0)
    }

    /// 0.
    #[must_use]
    fn zero() -> Self {
        Self::from_f64(0.0)
    }

    /// `self` between `low` and `high`.
    #[must_use]
    fn clamp_to(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
}

macro_rules! impl_real {
    ($float:ty) => {
        impl Real for $float {
            type Mask = bool;

            #[inline]
            fn from_f64(value: f64) -> Self {
                value as $float
            }
            #[inline]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline]
            fn min(self, other: Self) -> Self {
                self.min(other)
            }
            #[inline]
            fn max(self, other: Self) -> Self {
                self.max(other)
            }
            #[inline]
            fn floor(self) -> Self {
                self.floor()
            }
            #[inline]
            fn exp(self) -> Self {
                self.exp()
            }
            #[inline]
            fn asin(self) -> Self {
                self.asin()
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                self.sin_cos()
            }
            #[inline]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
            #[inline]
            fn gather(table: &[f32], index: Self) -> Self {
                // A float-to-integer cast saturates, so a NaN or a negative index reads the first.
                table[(index as usize).min(table.len() - 1)].into()
            }
        }
    };
}
impl_real!(f32);
impl_real!(f64);
