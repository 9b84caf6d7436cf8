//! Tabulated albedos against closed forms, and what they are for: a layer on a diffuse base.

use std::{f64::consts::PI, num::NonZeroU32};

use selvedge_normalize::{
    Normalization, Scattering,
    albedo::{AlbedoError, bihemispherical, directional},
    estimate::{Estimate, Sampling},
    glam::{DVec2, DVec3, Vec2, Vec3},
    halton::{Halton, Scrambling},
    scale::{Mode, Options},
    table::{AlbedoTable, Resolution},
    warp::square_to_uniform_hemisphere,
};

fn count(n: u32) -> NonZeroU32 {
    NonZeroU32::new(n).expect("not 0")
}

/// A model whose albedo is known in closed form.
struct Exact<F>(F);

impl<F: Fn(DVec2, DVec3) -> f64> Scattering for Exact<F> {
    fn eval(&self, _x: Vec2, _wi: Vec3, _wo: Vec3) -> f32 {
        f32::NAN
    }

    fn albedo_exact(&self, x: DVec2, wi: DVec3) -> Option<Estimate> {
        Some(Estimate { value: (self.0)(x, wi), error: 0.0, points: 1 })
    }
}

/// Directions evenly spread over the hemisphere, others than the nodes of any table.
fn directions() -> impl Iterator<Item = DVec3> {
    let squares = Halton::scrambled(Scrambling::Owen(3)).points_from(count(1)).take(20_000);
    squares.map(|s| square_to_uniform_hemisphere(s.into()))
}

#[test]
fn the_stated_error_holds_in_every_direction() {
    type Albedo = fn(DVec2, DVec3) -> f64;
    let albedos: [(&str, Albedo); 7] = [
        ("constant", |_, _| 0.4),
        ("cosine", |_, w| w.z),
        ("rise towards grazing", |_, w| 0.04 + 0.96 * (1.0 - w.z).powi(5)),
        ("across", |_, w| 0.5 + 0.4 * w.x + 0.3 * w.y),
        ("hill", |_, w| (40.0 * (w.dot(DVec3::new(0.48, 0.36, 0.8)) - 1.0)).exp()),
        ("ridge with a bend", |_, w| 1.4 - (w.x - 0.3).abs()),
        ("root", |_, w| w.z.sqrt()),
    ];
    for (name, albedo) in albedos {
        for at_most in [8, 16, 32, 64] {
            let resolution = Resolution { tolerance: 0.0, at_most: count(at_most) };
            let table = AlbedoTable::of(
                &Exact(albedo),
                Some(DVec2::ZERO),
                &Sampling::default(),
                &resolution,
            )
            .expect("valid");
            let off = directions()
                .map(|w| (table.at(w) - albedo(DVec2::ZERO, w)).abs())
                .fold(0.0, f64::max);
            let error = table.error();
            println!("{name}, {at_most} rows: off by {off:.1e}, stated {error:.1e}");
            assert!(off <= error + 1e-12, "{name}, {at_most} rows: off by {off}, stated {error}");
            assert!(error <= 40.0 * off + 1e-12, "{name}, {at_most} rows: {error} says nothing");
        }
    }
}

#[test]
fn the_stated_error_holds_at_a_bend_wherever_it_is() {
    let resolution = Resolution { tolerance: 0.0, at_most: count(16) };
    let mut greatest = 0.0_f64;
    for z in (1..2000).map(|k| f64::from(k) / 2000.0) {
        let bent = Exact(|_, w: DVec3| 0.3 * (w.z - z).abs());
        let table = AlbedoTable::of(&bent, Some(DVec2::ZERO), &Sampling::default(), &resolution);
        let table = table.expect("valid");
        let off = table.at(DVec3::new((1.0 - z * z).sqrt(), 0.0, z));
        assert!(off <= table.error(), "bend at {z}: off by {off}, stated {}", table.error());
        greatest = greatest.max(off / table.error());
    }
    assert!(greatest > 0.5, "{greatest}: half of the error would do");
}

#[test]
fn refinement_stops_at_the_tolerance_or_at_the_greatest_number_of_rows() {
    let rows = |tolerance, at_most| {
        let resolution = Resolution { tolerance, at_most: count(at_most) };
        let schlick = Exact(|_, w: DVec3| (1.0 - w.z).powi(5));
        let table = AlbedoTable::of(&schlick, Some(DVec2::ZERO), &Sampling::default(), &resolution);
        f64::from((table.expect("valid").mean().points - 1) / 4).sqrt()
    };
    assert_eq!(rows(1.0, 1000), 8.0);
    assert_eq!([1, 8, 15, 16].map(|n| rows(0.0, n)), [8.0, 8.0, 8.0, 16.0]);
    assert_eq!(rows(f64::NAN, 70), 64.0);
    let some = rows(2e-3, 512);
    assert!(some > 8.0 && some < 512.0, "{some}");
}

#[test]
fn sampled_albedos_and_their_means_agree_with_closed_forms() {
    let f = |x: Vec2, wi: Vec3, wo: Vec3| {
        (f64::from(x.x) * (0.5 + 0.75 * f64::from(wi.z * wo.z)) / PI) as f32
    };
    let sampling = Sampling::default();
    let at_point =
        AlbedoTable::of(&f, Some(DVec2::X), &sampling, &Resolution::default()).expect("valid");
    let mean = AlbedoTable::of(&f, None, &sampling, &Resolution::default()).expect("valid");
    for w in directions() {
        let exact = 0.5 + 0.5 * w.z;
        assert!((at_point.at(w) - exact).abs() <= at_point.error(), "{w}");
        assert!((mean.at(w) - 0.5 * exact).abs() <= mean.error(), "{w}");
    }
    assert!(at_point.error() < 0.02, "{}", at_point.error());
    assert!((at_point.max() - 1.0).abs() <= at_point.error());
    let (found, exact) = (at_point.mean(), 0.5 + 1.0 / 3.0);
    assert!((found.value - exact).abs() <= found.error && found.error < 0.02, "{found:?}");
}

#[test]
fn a_function_that_is_not_a_number_is_reported() {
    let f = |_: Vec2, wi: Vec3, _: Vec3| if wi.x > 0.9 { f32::NAN } else { 0.1 };
    let error = AlbedoTable::of(&f, None, &Sampling::default(), &Resolution::default());
    assert!(matches!(error, Err(AlbedoError::Value { wi, .. }) if wi.x > 0.9), "{error:?}");
}

#[test]
fn a_coat_on_a_white_base_reflects_all_of_the_light_and_no_more() {
    let gloss = |_: Vec2, wi: Vec3, wo: Vec3| (2.0 * wi.z * Vec3::Z - wi).dot(wo).max(0.0).powi(8);
    let sampling = Sampling { at_most: count(1 << 14), ..Sampling::default() };
    let scale = Normalization::of(&gloss, Mode::Pointwise, &sampling, &Options::default());
    let factor = scale.expect("valid").factor as f32;
    let coat = |x: Vec2, wi: Vec3, wo: Vec3| factor * gloss(x, wi, wo);
    let table = AlbedoTable::of(&coat, Some(DVec2::ZERO), &sampling, &Resolution::default())
        .expect("valid");
    let left = 1.0 - table.mean().value;
    let both = |x: Vec2, wi: Vec3, wo: Vec3| {
        let through = |w: Vec3| 1.0 - table.at(w.as_dvec3());
        coat(x, wi, wo) + (through(wi) * through(wo) / (left * PI)) as f32
    };
    for wi in directions().step_by(400) {
        // E of the coat and the mean of what passes it are off by up to the table's error; so is the
        // sum, by the second over `left` for the share that passes.
        let tolerance = table.error() * (1.0 + 1.0 / left);
        let rho = directional(&both, DVec2::ZERO, wi, &sampling).expect("valid");
        assert!((rho.value - 1.0).abs() <= tolerance + rho.error, "{wi}: {rho:?}, {tolerance}");
    }
    let white = bihemispherical(&both, DVec2::ZERO, &sampling).expect("valid");
    assert!((white.value - 1.0).abs() < 5e-3, "{white:?}");
}
