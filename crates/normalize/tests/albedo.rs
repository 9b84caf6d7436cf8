//! Estimated albedos against closed forms.

use std::{cell::Cell, f64::consts::PI, num::NonZeroU32};

use selvedge_normalize::{
    Scattering, albedo,
    albedo::{AlbedoError, averaged, bihemispherical, directional},
    estimate::{Estimate, Sampling},
    glam::{DVec2, DVec3, Vec2, Vec3},
};

fn count(n: u32) -> NonZeroU32 {
    NonZeroU32::new(n).expect("not 0")
}

/// f(wi, wo) = scale · cosⁿ of the angle between wo and the mirror image of wi.
fn lobe(exponent: i32, scale: f64) -> impl Fn(Vec2, Vec3, Vec3) -> f32 {
    // Below this cosine the lobe is less than 1e-40 of its peak and its powers cost time.
    let negligible = 1e-40f64.powf(1.0 / f64::from(exponent));
    move |_, wi, wo| {
        if (2.0 * wi.z * Vec3::Z - wi).dot(wo) < negligible as f32 - 1e-6 {
            return 0.0;
        }
        // The directions arrive rounded to f32; without renormalising, the power would show it.
        let (wi, wo) = (wi.as_dvec3().normalize(), wo.as_dvec3().normalize());
        let cos = (2.0 * wi.z * DVec3::Z - wi).dot(wo);
        if cos > negligible { (scale * cos.powi(exponent)) as f32 } else { 0.0 }
    }
}

/// At how many of 1000 seeds the estimate from `points` is further from `exact` than the error it states.
fn misses(brdf: &impl Scattering, wi: DVec3, exact: f64, points: u32) -> usize {
    let n = count(points);
    let sampling = Sampling { tolerance: 1e-3, at_least: n, at_most: n, ..Sampling::default() };
    misses_with(brdf, wi, exact, &sampling)
}

/// As [`misses`], with any stop rule.
fn misses_with(brdf: &impl Scattering, wi: DVec3, exact: f64, sampling: &Sampling) -> usize {
    let (mut largest_error, mut points) = (0.0f64, 0u64);
    let misses = (0..1000).filter(|seed| {
        let sampling = Sampling { seed: *seed, ..*sampling };
        let rho = directional(brdf, DVec2::ZERO, wi, &sampling).expect("a valid function");
        largest_error = largest_error.max(rho.error);
        points += u64::from(rho.points);
        (rho.value - exact).abs() > rho.error
    });
    let misses = misses.count();
    let mean_points = points / 1000;
    println!(
        "{misses} of 1000 seeds miss {exact}, largest stated error {largest_error:.2e}, \
         {mean_points} points on average"
    );
    misses
}

#[test]
fn lambert_zero_and_wide_lobes_are_within_the_stated_error() {
    let oblique = DVec3::new(0.6, 0.0, 0.8);
    let lambert = |_: Vec2, _: Vec3, _: Vec3| (0.18 / PI) as f32;
    assert!(misses(&lambert, oblique, 0.18, 256) <= 10);
    assert_eq!(misses(&|_: Vec2, _: Vec3, _: Vec3| 0.0, oblique, 0.0, 256), 0);
    for (exponent, points) in [(1, 256), (10, 1024), (100, 4096)] {
        // ∫ cosⁿ⁺¹ θ dω = 2π/(n + 2) at normal incidence.
        let exact = 2.0 * PI / f64::from(exponent + 2);
        let n = misses(&lobe(exponent, 1.0), DVec3::Z, exact, points);
        assert!(n <= 10, "exponent {exponent}: {n} of 1000 seeds miss");
    }
}

#[test]
fn the_default_stop_rule_is_not_deceived_by_narrow_lobes() {
    for exponent in [1, 1000, 10_000] {
        let brdf = lobe(exponent, f64::from(exponent + 2) / (2.0 * PI));
        let n = misses_with(&brdf, DVec3::Z, 1.0, &Sampling::default());
        assert!(n <= 10, "exponent {exponent}: {n} of 1000 seeds miss");
    }
}

#[test]
fn an_oblique_mirror_like_lobe_is_within_the_stated_error() {
    // The lobe is cut off long before the horizon, so by symmetry only the component of cos θo
    // along its axis contributes: ρ = cos θi, for the scale that makes it 1 at normal incidence.
    let wi = DVec3::new(0.36, 0.48, 0.8);
    let brdf = lobe(10_000, 10_002.0 / (2.0 * PI));
    let n = misses_with(&brdf, wi, 0.8, &Sampling::default());
    assert!(n <= 10, "{n} of 1000 seeds miss");
    // With more points the error that is stated gets useful.
    let more = Sampling { at_most: count(1 << 21), ..Sampling::default() };
    let rho = directional(&brdf, DVec2::ZERO, wi, &more).expect("a valid function");
    assert!((rho.value - 0.8).abs() <= rho.error && rho.error < 0.03, "{rho:?}");
}

#[test]
fn averaged_and_bihemispherical_agree_with_closed_forms() {
    // f = x·(a + b cos θi cos θo)/π, whose albedos are polynomials.
    let f = |x: Vec2, wi: Vec3, wo: Vec3| {
        (f64::from(x.x) * (0.5 + 0.75 * f64::from(wi.z * wo.z)) / PI) as f32
    };
    let wi = DVec3::new(0.0, 0.6, 0.8);
    let directional_at_one = 0.5 + 0.75 * 0.8 * (2.0 / 3.0);
    let s = Sampling { tolerance: 1e-4, at_most: count(1 << 20), ..Sampling::default() };
    let check = |estimate: Result<Estimate, AlbedoError>, exact: f64| {
        let e = estimate.expect("a valid function");
        assert!((e.value - exact).abs() <= e.error && e.error <= 1e-4, "{e:?}, exact {exact}");
    };
    check(directional(&f, DVec2::X, wi, &s), directional_at_one);
    check(averaged(&f, wi, &s), 0.5 * directional_at_one);
    check(bihemispherical(&f, DVec2::X, &s), 0.5 + 0.75 * (2.0f64 / 3.0).powi(2));
    check(bihemispherical(&f, DVec2::ZERO, &s), 0.0);
    let quick = albedo(|wi, wo| f(Vec2::X, wi, wo), count(1 << 14));
    let exact = 0.5 + 0.75 * 4.0 / 9.0;
    assert!((f64::from(quick) - exact).abs() < 1e-3, "{quick}, exact {exact}");
}

/// A lobe with its closed-form albedo at every point and direction, and a counter of plain values.
struct Quadrature {
    evaluations: Cell<u32>,
    error: f64,
}

impl Scattering for Quadrature {
    fn eval(&self, _x: Vec2, _wi: Vec3, _wo: Vec3) -> f32 {
        self.evaluations.set(self.evaluations.get() + 1);
        f32::NAN
    }

    fn albedo_exact(&self, x: DVec2, wi: DVec3) -> Option<Estimate> {
        Some(Estimate { value: x.x * wi.z, error: self.error, points: 1 })
    }
}

#[test]
fn the_exact_hook_replaces_sampling() {
    let model = Quadrature { evaluations: Cell::new(0), error: 1e-6 };
    let s = Sampling { tolerance: 1e-4, at_most: count(1 << 20), ..Sampling::default() };
    let wi = DVec3::new(0.0, 0.6, 0.8);
    let at = directional(&model, DVec2::splat(0.5), wi, &s).expect("valid");
    assert_eq!(at, Estimate { value: 0.4, error: 1e-6, points: 1 });
    let mean = averaged(&model, wi, &s).expect("valid");
    assert!((mean.value - 0.4).abs() <= mean.error && mean.error > 1e-6, "{mean:?}");
    let diffuse = bihemispherical(&model, DVec2::X, &s).expect("valid");
    assert!((diffuse.value - 2.0 / 3.0).abs() <= diffuse.error, "{diffuse:?}");
    assert_eq!(model.evaluations.get(), 0);
    let rough = Quadrature { error: 0.5, ..model };
    let mean = averaged(&rough, wi, &s).expect("valid");
    assert!(mean.error > 0.5 && mean.error < 0.5 + 1e-4, "{mean:?}");
}

#[test]
fn what_no_scattering_function_may_return_is_an_error() {
    for bad in [f32::NAN, f32::INFINITY, -0.5] {
        let f = |_: Vec2, _: Vec3, wo: Vec3| if wo.z > 0.9 { bad } else { 0.1 };
        let s = Sampling::default();
        for result in [
            directional(&f, DVec2::X, DVec3::Z, &s),
            averaged(&f, DVec3::Z, &s),
            bihemispherical(&f, DVec2::X, &s),
        ] {
            match result {
                Err(AlbedoError::Value { wo, value, .. }) => {
                    assert!(wo.z > 0.9 && value.to_bits() == bad.to_bits(), "{wo} {value}");
                }
                other => panic!("{bad}: {other:?}"),
            }
        }
    }
    let f = |_: Vec2, _: Vec3, _: Vec3| f32::NAN;
    let error = directional(&f, DVec2::X, DVec3::Z, &Sampling::default()).expect_err("NaN");
    let text = error.to_string();
    assert!(text.starts_with("scattering at x [1, 0], wi [0, 0, 1], wo ["), "{text}");
    assert!(text.ends_with(": NaN sr⁻¹, expected finite and at least 0"), "{text}");
    let model = Quadrature { evaluations: Cell::new(0), error: f64::NAN };
    let error = directional(&model, DVec2::X, DVec3::Z, &Sampling::default()).expect_err("NaN");
    assert_eq!(
        error.to_string(),
        "exact albedo at x [1, 0], wi [0, 0, 1]: 1 ± NaN, expected finite and at least 0"
    );
}
