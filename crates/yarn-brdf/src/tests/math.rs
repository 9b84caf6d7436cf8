//! The functions of [`crate::math`] against those of the library in double precision.

use core::f32::consts::FRAC_PI_2;

use rayon::prelude::*;

use crate::math::{Single, asin, atan2, exp, i0e, ln, sin_cos};

/// Of how many neighbouring numbers the quick tests take one.
const SAMPLED: u32 = 1009;

/// The distance between neighbouring `f32` at `exact`.
fn ulp(exact: f64) -> f64 {
    let binade = exact.abs().max(f32::MIN_POSITIVE.into()).to_bits() & (0x7ff << 52);
    f64::from_bits(binade) * f64::from(f32::EPSILON)
}

/// The error of `found` in ulp.
fn ulps(found: f32, exact: f64) -> f64 {
    absolute(found, exact) / ulp(exact)
}

/// Takes every `step`-th number of `from..=to`, both ≥ 0, but fewer below 10⁻⁸, where none of the
/// functions bends, and asserts that `error` is at most `bound` at each.
fn check(
    name: &str,
    step: u32,
    [from, to]: [f32; 2],
    bound: f64,
    error: impl Fn(f32) -> f64 + Sync,
) {
    let bends = from.max(1e-8);
    sweep(name, step.max(SAMPLED), [from, bends], bound, &error);
    sweep(name, step, [bends, to], bound, &error);
}

fn sweep(
    name: &str,
    step: u32,
    [from, to]: [f32; 2],
    bound: f64,
    error: &(impl Fn(f32) -> f64 + Sync),
) {
    let (first, last) = (from.to_bits(), to.to_bits());
    let block = 1 << 16;
    let blocks = (last - first) / step / block + 1;
    let (worst, x) = (0..blocks)
        .into_par_iter()
        .map(|i| {
            let start = first + i * block * step;
            (0..block)
                .map(|j| (start + j * step).min(last))
                .map(|bits| (error(f32::from_bits(bits)), f32::from_bits(bits)))
                .fold((0.0, from), worse)
        })
        .reduce(|| (0.0, from), worse);
    println!("{name} in [{from:e}, {to:e}]: {worst:.4e} at {x:e}");
    assert!(worst <= bound, "{name} at {x:e} ({:#x}): {worst} > {bound}", x.to_bits());
}

/// That of the greater error, which a NaN is.
fn worse(a: (f64, f32), b: (f64, f32)) -> (f64, f32) {
    if a.0 >= b.0 || a.0.is_nan() { a } else { b }
}

/// The error of `found`.
fn absolute(found: f32, exact: f64) -> f64 {
    (f64::from(found) - exact).abs()
}

fn check_exp(step: u32) {
    let error = |x: f32| ulps(exp(x), f64::from(x).exp());
    check("exp", step, [0.0, 88.0], 1.5, error);
    check("exp of the negative", step, [0.0, 87.33], 1.5, |x| error(-x));
}

fn check_ln(step: u32) {
    check("ln", step, [f32::MIN_POSITIVE, f32::MAX], 1.0, |x| ulps(ln(x), f64::from(x).ln()));
}

fn check_sin_cos(step: u32) {
    // An odd and an even function, in each bit; at most 1; and as far off as `measure` says.
    let error = |x: f32, measure: fn(f32, f64) -> f64| {
        let ((sin, cos), mirrored) = (sin_cos(x), sin_cos(-x));
        if mirrored != (-sin, cos) || sin.abs() > 1.0 || cos.abs() > 1.0 {
            return f64::NAN;
        }
        let exact = f64::from(x).sin_cos();
        measure(sin, exact.0).max(measure(cos, exact.1))
    };
    check("sin and cos", step, [0.0, FRAC_PI_2], 2.5, |x| error(x, ulps));
    let nearby = |found, exact| ulps(found, exact).min(absolute(found, exact) / 1e-7 * 2.5);
    check("sin and cos", step, [FRAC_PI_2, 8.0], 2.5, |x| error(x, nearby));
    check("sin and cos, absolute", step, [8.0, 1e4], 2.5e-7, |x| error(x, absolute));
}

fn check_asin(step: u32) {
    check("asin", step, [0.0, 1.0], 2.0, |x| {
        if asin(-x) == -asin(x) { ulps(asin(x), f64::from(x).asin()) } else { f64::NAN }
    });
}

fn check_atan2(step: u32) {
    // A number that has nothing to do with `bits`, in [1, 2).
    let other = |bits: u32| f32::from_bits(bits.wrapping_mul(0x9e37_79b1) >> 9 | 0x3f80_0000);
    // Every quotient there is, as t over 1 and of other pairs.
    check("atan2", step, [0.0, 1.0], 2.5, |t| {
        let x = other(t.to_bits());
        let error = |(y, x): (f32, f32)| ulps(atan2(y, x), f64::from(y).atan2(x.into()));
        let pairs = [(t, 1.0), (1.0, -t), (t * x, -x), (-x, t * x)];
        pairs.map(error).into_iter().fold(0.0, |a, b| if a >= b || a.is_nan() { a } else { b })
    });
}

fn check_i0e(step: u32) {
    check("i0e", step, [0.0, 1e12], 4.7, |x| ulps(i0e(x), pxfm::f_i0e(x.into())));
}

#[test]
fn sampled_numbers_are_within_the_bounds() {
    check_exp(SAMPLED);
    check_ln(SAMPLED);
    check_sin_cos(SAMPLED);
    check_asin(SAMPLED);
    check_atan2(SAMPLED);
    check_i0e(SAMPLED);
}

#[test]
#[ignore = "exhaustive: a minute"]
fn all_numbers_of_exp() {
    check_exp(1);
}

#[test]
#[ignore = "exhaustive: a minute"]
fn all_numbers_of_ln() {
    check_ln(1);
}

#[test]
#[ignore = "exhaustive: a minute"]
fn all_numbers_of_sin_cos() {
    check_sin_cos(1);
}

#[test]
#[ignore = "exhaustive: a minute"]
fn all_numbers_of_asin() {
    check_asin(1);
}

#[test]
#[ignore = "exhaustive: a minute"]
fn all_numbers_of_atan2() {
    check_atan2(1);
}

#[test]
#[ignore = "exhaustive: a minute"]
fn all_numbers_of_i0e() {
    check_i0e(1);
}

#[test]
fn powers_of_2_are_exact() {
    for n in -126_i16..=127 {
        let power = f32::from(n).exp2_int();
        assert_eq!(power, 2_f32.powi(n.into()), "2^{n}");
    }
}

#[test]
fn special_values_are_those_of_the_library() {
    let tiny = f32::from_bits(1);
    for x in [0.0, -0.0, tiny, -tiny, f32::MIN_POSITIVE, f32::NEG_INFINITY] {
        assert_eq!(exp(x), x.exp(), "exp({x:e})");
    }
    for x in [-87.34, -88.0, -1e4, -1e30, f32::MIN] {
        assert_eq!(exp(x), 0.0, "exp({x:e})");
    }
    for x in [0.0, -0.0, tiny, -tiny, f32::MIN_POSITIVE, 1.0, -1.0] {
        assert_eq!(asin(x).to_bits(), x.asin().to_bits(), "asin({x:e})");
    }
    for x in [0.0, -0.0, tiny, -tiny, f32::MIN_POSITIVE, FRAC_PI_2] {
        let (found, std) = (sin_cos(x), x.sin_cos());
        assert_eq!(found.0, std.0, "sin({x:e})");
        assert_eq!(found.1, std.1, "cos({x:e})");
    }
    let axes = [0.0, -0.0, tiny, -tiny, 1.0, -1.0, f32::MAX, f32::MIN];
    for (y, x) in axes.iter().flat_map(|&y| axes.map(|x| (y, x))) {
        let (found, std) = (atan2(y, x), y.atan2(x));
        assert_eq!(
            found.is_sign_negative(),
            std.is_sign_negative(),
            "atan2({y:e}, {x:e}) = {found} or {std}"
        );
        assert!(
            ulps(found, f64::from(y).atan2(x.into())) <= 2.5,
            "atan2({y:e}, {x:e}) = {found} or {std}"
        );
    }
    for x in [0.0, -0.0, tiny] {
        assert_eq!(i0e(x), 1.0, "i0e({x:e})");
    }
    assert!(i0e(1e12_f32) > 0.0);
}

#[test]
fn nan_and_infinity_do_not_panic() {
    for x in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN] {
        let (sin, cos) = sin_cos(x);
        let values = [exp(x), asin(x), sin, cos, i0e(x), atan2(x, 1.0), atan2(1.0, x), atan2(x, x)];
        println!("{x:e}: {values:?}");
    }
    assert!(exp(f32::NAN).is_nan() && i0e(f32::NAN).is_nan());
}
