//! White furnace: no yarn reflects more than it receives.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use core::f64::consts::{FRAC_PI_2, PI};

use rayon::prelude::*;
use selvedge_normalize::halton::Halton;
use selvedge_yarn_brdf::glam::{DVec2, DVec3};
use selvedge_yarn_brdf::{Cloth, Combination, Mapping, Mode, Phase, Thread, Weave, Yarn};

/// m.
const PITCH: f64 = 0.01;

const WHITE: Thread = Thread { color: [1.0; 3], pitch: Some(PITCH), diameter: None };

/// Whole-cell floats of the lengths 1, 2 and 5: each is a repeat of its own.
fn cloth(yarn: Yarn, float: u32) -> Cloth {
    let picks = float + 1;
    let weave = Weave::new(picks, picks, |end, pick| (pick + end) % picks != 0).unwrap();
    let threads = vec![WHITE; picks as usize];
    Cloth::from_threads(weave, &threads, &threads, yarn).unwrap()
}

/// The i-th of many yarns spread over the whole box of parameters, white in both lobes at k = 1.
fn yarn(i: u32) -> Yarn {
    let [a, b, c, d, e] = Halton::<5>::new().point((i + 1).try_into().unwrap());
    // A third of the yarns are filaments, some at the limits of their ranges.
    let psi = if i.is_multiple_of(3) { 0.0 } else { PI * (a - 0.5) + 1e-9 };
    let u_max = match i % 11 {
        0 => 0.0,
        1 => 1.5,
        _ => 1.5 * b,
    };
    let beta = if i.is_multiple_of(7) { 0.0 } else { (201f64).powf(e) - 1.0 };
    Yarn {
        color: [1.0; 3],
        specular: [1.0; 3],
        psi,
        u_max,
        delta: 0.05 + 0.95 * c,
        phase: Phase::VonMises { alpha: d * d, beta },
        size: 1.0,
    }
}

fn direction(cos_theta: f64, turn: f64) -> DVec3 {
    let sin = (1.0 - cos_theta * cos_theta).sqrt();
    let phi = 2.0 * PI * turn;
    DVec3::new(sin * phi.cos(), sin * phi.sin(), cos_theta)
}

/// Directional albedo of the shader at `wo` from its own quadrature, at each point or averaged.
fn check(mode: Mode, combination: Combination, yarns: u32) -> (f64, String) {
    (0..yarns)
        .into_par_iter()
        .map(|i| {
            let yarn = yarn(i);
            let float = [1, 2, 5][i as usize % 3];
            let mapping = if i.is_multiple_of(2) { Mapping::Arcsine } else { Mapping::Linear };
            let mut cloth = cloth(yarn, float);
            (cloth.mapping, cloth.normalization, cloth.combination) = (mapping, mode, combination);
            let shader = cloth.prepare().unwrap();
            let points = Halton::<4>::new();
            (1..=8u32)
                .map(|j| {
                    let [a, b, c, d] = points.point((j + 10 * i).try_into().unwrap());
                    // Grazing directions more often: there the maxima lie.
                    let wo = direction(a * a + 1e-4, b);
                    let uv = PITCH * DVec2::new(0.5 + f64::from(j % 2), c + d);
                    let albedo = match mode {
                        Mode::Pointwise => shader.albedo_at(uv, wo),
                        _ => shader.albedo_of_segment(uv, wo),
                    }
                    .max_element();
                    (albedo, format!("{yarn:?} {mapping:?} wo {wo} uv {uv}: {albedo}"))
                })
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap()
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap()
}

#[test]
fn segment_of_white_yarn_reflects_at_most_what_it_receives() {
    for (combination, yarns) in [(Combination::Layered, 1000), (Combination::Lerp, 100)] {
        let (worst, report) = check(Mode::Segment, combination, yarns);
        println!("segment, {combination:?}: {report}");
        assert!(worst <= 1.0, "{report}");
    }
}

#[test]
fn point_of_white_yarn_reflects_at_most_what_it_receives() {
    let (worst, report) = check(Mode::Pointwise, Combination::Lerp, 1000);
    println!("pointwise: {report}");
    assert!(worst <= 1.0, "{report}");
}

/// The quadrature against a plain sum over directions of `eval` itself.
#[test]
fn albedo_is_the_integral_of_eval() {
    for i in [1, 2, 3, 4, 6, 13] {
        let mut yarn = yarn(i);
        yarn.delta = 0.5;
        yarn.phase = Phase::VonMises { alpha: 0.2, beta: 3.0 };
        let cloth = cloth(yarn, 2);
        let shader = cloth.prepare().unwrap();
        let wo = direction(0.6, 0.13);
        let (uv, n) = (PITCH * DVec2::new(0.4, 1.2), 900);
        let at = |k: usize| (k as f64 + 0.5) / n as f64;
        // Uniform in (sin²θ, φ), whose area is π times that of the unit square.
        let sum: f64 = (0..n * n)
            .into_par_iter()
            .map(|k| {
                let wi = direction((1.0 - at(k % n)).sqrt(), at(k / n));
                shader.eval_reference(uv, wi, wo).x
            })
            .sum();
        let (found, expected) = (shader.albedo_at(uv, wo).x, PI * sum / (n * n) as f64);
        assert!((found / expected - 1.0).abs() < 5e-3, "{yarn:?}: {found}, expected {expected}");
    }
}

/// With white highlight and white diffuse nothing is lost, whatever the share of the highlight.
#[test]
fn white_cloth_reflects_nearly_all_at_every_k() {
    let mut extremes: (f64, f64) = (2.0, 0.0);
    for i in 0..40 {
        for k in [0.0, 0.3, 1.0] {
            let full = yarn(i);
            let Phase::VonMises { alpha, beta } = full.phase else { unreachable!() };
            let phase = Phase::VonMises { alpha, beta: beta.min(10.0) };
            let u_max = full.u_max.min(1.2);
            let yarn = Yarn { specular: [k; 3], phase, u_max, ..full };
            let shader = cloth(yarn, 2).prepare().unwrap();
            for j in 0..40 {
                let wo = direction((f64::from(j) + 0.5) / 40.0, f64::from(j) * 0.618);
                let albedo = shader.albedo_of_segment(PITCH * DVec2::new(0.5, 1.2), wo).x;
                extremes = (extremes.0.min(albedo), extremes.1.max(albedo));
            }
        }
    }
    println!("white cloth reflects {:.4} to {:.4}", extremes.0, extremes.1);
    assert!(extremes.0 >= 0.95 && extremes.1 <= 1.0, "{extremes:?}");
}

#[test]
fn grazing_light_on_the_steepest_yarn_stays_bounded() {
    let yarn = Yarn { u_max: 1.5, psi: FRAC_PI_2, color: [1.0; 3], ..Yarn::default() };
    let shader = cloth(yarn, 1).prepare().unwrap();
    for cos in [1e-12, 1e-6, 1e-3] {
        let albedo = shader.albedo_of_segment(PITCH * DVec2::new(0.5, 1.5), direction(cos, 0.3));
        assert!(albedo.max_element() <= 1.0, "cos θ = {cos}: {albedo}");
    }
}
