//! The functions that the shading kernel calls, in single precision.
//!
//! They are made of the basic operations that IEEE 754 rounds correctly, and of selections and
//! shifts of bits: no fused multiply-add, table, branch or library. So a lane of several returns
//! the bits that a single `f32` does, on every machine. The polynomials are near-minimax in
//! relative error, and their coefficients were rounded one by one, the rest fitted again each time.
//! An ulp is the distance between neighbouring `f32` at the exact value.

use crate::real::Real;

/// `f32`, or several side by side.
pub(crate) trait Single: Real<Scalar = f32> {
    /// 2 to the power `self`, an integer in [−126, 127].
    fn exp2_int(self) -> Self;
    /// (m, e) with `self` = m 2ᵉ and m in [√½, √2), for a normal number above 0.
    fn split_exponent(self) -> (Self, Self);
}

impl Single for f32 {
    #[inline(always)]
    fn exp2_int(self) -> Self {
        Self::from_bits((self + BIASED).to_bits() << 23)
    }

    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let exponent = (self.to_bits() as i32 - SQRT_HALF) >> 23;
        (Self::from_bits((self.to_bits() as i32 - (exponent << 23)) as u32), exponent as f32)
    }
}

/// Added to an exponent, this has the biased exponent as its last bits.
pub(crate) const BIASED: f32 = 8_388_608.0 + 127.0;

/// The bits of √½.
pub(crate) const SQRT_HALF: i32 = 0x3f35_04f3;

/// The integer nearest to `x`, for |`x`| < 2²².
#[inline(always)]
fn round<R: Single>(x: R) -> R {
    let shift = 1.5 * 8_388_608.0;
    (x + shift) - shift
}

/// The polynomial in `x` with these `coefficients`, the constant first.
#[inline(always)]
fn polynomial<R: Single, const N: usize>(x: R, coefficients: [f32; N]) -> R {
    let mut sum = x.splat(coefficients[N - 1]);
    for i in (0..N - 1).rev() {
        sum = sum * x + coefficients[i];
    }
    sum
}

/// The same of six, odd and even powers by themselves, which rounds less often in a row.
#[inline(always)]
fn quintic<R: Single>(x: R, [a, b, c, d, e, f]: [R; 6]) -> R {
    let square = x * x;
    a + (x * (b + square * (d + square * f)) + square * (c + square * e))
}

/// e to the power `x` ≤ 88: 0 below −87.33, NaN of a NaN.
///
/// With n = round(x / ln 2) and r = x − n ln 2 in two parts, 2ⁿ (1 + r + r² Q(r)), Q of degree 4
/// fitted to 3.1e-9: within 1.00 ulp.
#[inline(always)]
pub(crate) fn exp<R: Single>(x: R) -> R {
    // The first part has 16 bits, so that its multiples are exact.
    const LN_2: [f32; 2] = [0.693_145_75, 1.428_606_8e-6];
    const Q: [f32; 5] = [0.499_999_94, 0.166_665_21, 0.041_668_266, 0.008_368_677, 0.001_382_073_4];
    let n = round(x * core::f32::consts::LOG2_E);
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let square = r * r;
    let (low, high) = (polynomial(r, [Q[0], Q[1]]), polynomial(r, [Q[2], Q[3]]));
    let q = low + square * (high + square * Q[4]);
    let result = (r + square * q + 1.0) * n.exp2_int();
    R::select(x.lt(x.splat(-87.33)), x.zero(), result)
}

/// The natural logarithm of a normal number `x` > 0.
///
/// With x = m 2ᵉ and f = m − 1, e ln 2 + f − f²/2 + f³ P(f), P of degree 7 fitted to 5.9e-9: within
/// 0.9 ulp.
#[inline(always)]
pub(crate) fn ln<R: Single>(x: R) -> R {
    // The first part has 9 bits, so that its multiples are exact.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    const P: [f32; 8] = [
        0.333_333_3,
        -0.250_008_2,
        0.200_012_42,
        -0.166_234_09,
        0.142_015_8,
        -0.131_596_1,
        0.127_622_17,
        -0.076_364_39,
    ];
    let (m, e) = x.split_exponent();
    let f = m - 1.0;
    let square = f * f;
    let [a, b] = [polynomial(f, [P[0], P[1]]), polynomial(f, [P[2], P[3]])];
    let [c, d] = [polynomial(f, [P[4], P[5]]), polynomial(f, [P[6], P[7]])];
    let p = (a + square * b) + (square * square) * (c + square * d);
    let rest = (f * square * p + e * LN_2[1]) - square * 0.5;
    (f + rest) + e * LN_2[0]
}

/// π/2 in two parts.
const QUARTER_TURN: [f32; 2] = [core::f32::consts::FRAC_PI_2, -4.371_139e-8];

/// Sine and cosine of `x` in rad; the sine of −0 is 0.
///
/// With n = round(x / π) and r = x − n π in two parts, (−1)ⁿ times the sines of r and π/2 − |r| as
/// polynomials of degree 9 fitted to 6.2e-9: within 2.1 ulp, or 10⁻⁷ where |x| > π/2, for
/// |x| ≤ 8, and 1.3 × 10⁻⁷, and at most 1, for |x| ≤ 10⁴.
#[inline(always)]
pub(crate) fn sin_cos<R: Single>(x: R) -> (R, R) {
    // The first part has 12 bits, so that its multiples are exact.
    const PI: [f32; 2] = [3.141_601_6, -8.908_91e-6];
    let n = round(x * core::f32::consts::FRAC_1_PI);
    let r = (x - n * PI[0]) - n * PI[1];
    let half = n * 0.5;
    // 0 or 1/2.
    let odd = (half - round(half)).abs();
    let sign = x.one() - odd * 4.0;
    let rest = (x.splat(QUARTER_TURN[0]) - r.abs()) + QUARTER_TURN[1];
    (sign * sin_to_quarter(r), sign * sin_to_quarter(rest))
}

/// The sine of |`x`| ≤ π/2.
#[inline(always)]
fn sin_to_quarter<R: Single>(x: R) -> R {
    let z = x * x;
    let p = polynomial(z, [-0.166_666_6, 0.008_333_069, -0.000_198_097_78, 2.606_103e-6]);
    x + x * z * p
}

/// Arcsine of |`x`| ≤ 1 in rad, with the sign of `x`.
///
/// s + s z P(z) with z = s², P of degree 4 fitted to 4.9e-9: s = |x| up to 1/2, and beyond it
/// π/2 − 2 asin(s) with z = (1 − |x|)/2, π/2 in two parts. Within 1.7 ulp.
#[inline(always)]
pub(crate) fn asin<R: Single>(x: R) -> R {
    let a = x.abs();
    let steep = x.splat(0.5).lt(a);
    let z = R::select(steep, (x.one() - a) * 0.5, a * a);
    let s = R::select(steep, z.sqrt() * -2.0, a);
    let p =
        polynomial(z, [0.166_667_52, 0.074_953_094, 0.045_469_15, 0.024_184_778, 0.042_158_306]);
    let rest = s * z * p;
    let complement = (s + (rest + QUARTER_TURN[1])) + QUARTER_TURN[0];
    R::select(steep, complement, s + rest).copysign(x)
}

/// The angle of the point (`x`, `y`), of finite coordinates, in rad, in [−π, π]; at the origin
/// that of the signs of its zeros, like `f32::atan2`.
///
/// t = min(|x|, |y|)/max(|x|, |y|) in t + t³ P(t²), P of degree 7 fitted to 1.7e-8, then
/// reflection at the diagonals and axes. Within 2.2 ulp.
#[inline(always)]
pub(crate) fn atan2<R: Single>(y: R, x: R) -> R {
    let (across, along) = (x.abs(), y.abs());
    // The least positive number makes 0/0 a 0.
    let t = across.min(along) / across.max(along).max(x.splat(f32::from_bits(1)));
    let z = t * t;
    let p = polynomial(
        z,
        [
            -0.333_331_53,
            0.199_937_67,
            -0.142_110_03,
            0.106_657_87,
            -0.075_517_29,
            0.043_205_976,
            -0.016_364_245,
            0.002_919_76,
        ],
    );
    let angle = t + t * z * p;
    let angle = R::select(across.lt(along), x.splat(QUARTER_TURN[0]) - angle, angle);
    let behind = x.one().copysign(x).lt(x.zero());
    R::select(behind, x.splat(core::f32::consts::PI) - angle, angle).copysign(y)
}

/// The scaled Bessel function e^{−x} I₀(x) of `x` in [0, 10¹²].
///
/// Below 7 N(x)/D(x), both of degree 5, fitted to 2.7e-8; from there P(1/x)/√x, P of degree 5
/// fitted to 4.7e-8. Within 4.7 ulp.
#[inline(always)]
pub(crate) fn i0e<R: Single>(x: R) -> R {
    const N: [f32; 6] =
        [1.0, 0.088_091_98, 0.212_055_18, 0.016_288_303, 0.006_899_909, 0.000_132_243_64];
    const D: [f32; 6] = [1.0, 1.088_093, 0.550_132_5, 0.167_100_7, 0.032_251_99, 0.003_946_809_6];
    const P: [f32; 6] =
        [0.398_942_26, 0.049_874_526, 0.027_619_6, 0.039_575_905, -0.064_103, 0.542_73];
    let low = x.lt(x.splat(7.0));
    let d = quintic(x, D.map(|d| x.splat(d)));
    let r = x.one() / R::select(low, d, x);
    // Not `array::from_fn`, which is compiled on its own, without the instructions of the caller.
    let mut coefficients = N.map(|n| x.splat(n));
    for (coefficient, p) in coefficients.iter_mut().zip(P) {
        *coefficient = R::select(low, *coefficient, x.splat(p));
    }
    let p = quintic(R::select(low, x, r), coefficients);
    p * R::select(low, r, r.sqrt())
}
