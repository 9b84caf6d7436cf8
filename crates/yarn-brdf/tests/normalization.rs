//! The factor of equation 2 against a search without tables.

use rayon::prelude::*;

#[path = "../examples/factors/brute_force.rs"]
mod brute_force;
#[path = "support/yarns.rs"]
mod yarns;

use brute_force::greatest_albedo;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Mode, Shader, Yarn};
use yarns::{USUAL, cloth, yarn};

/// What the quadrature of the search may be off by.
const CHECK: f64 = 5e-4;

#[test]
fn factor_is_the_greatest_that_conserves_energy_but_for_three_hundredths() {
    let found: Vec<(f64, String)> = (0..36u32)
        .into_par_iter()
        .map(|i| {
            let yarn = yarn(8 * i, &USUAL);
            (greatest_albedo(&yarn, 1 + i as usize % 4), format!("{yarn:?}"))
        })
        .collect();
    for (albedo, yarn) in found {
        assert!(
            (0.97..=1.0 + CHECK).contains(&albedo),
            "scaled albedo {albedo}, expected 0.97 to 1 + {CHECK}: {yarn}"
        );
    }
}

#[test]
fn factor_is_the_same_to_the_bit_every_time() {
    let yarn = yarn(5, &USUAL);
    let cloth = cloth(&vec![yarn; 3]);
    let factors = || {
        let shader = cloth.prepare().expect("every parameter is in range");
        shader.normalization(0).expect("there is a yarn").map(|n| n.factor.to_bits())
    };
    let first = factors();
    // Twenty-four frames, prepared by one thread and by two.
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("starts");
        let all: Vec<_> = pool.install(|| (0..24).into_par_iter().map(|_| factors()).collect());
        assert!(all.iter().all(|&factors| factors == first), "{threads} threads");
    }
    assert_eq!(cloth.normalization, Mode::Segment);
}

#[test]
fn divisors_of_another_shader_scale_the_highlight_as_there() {
    let of = |psi| Yarn { psi, ..yarn(5, &USUAL) };
    let prepared = |yarn: Yarn| cloth(&[yarn]).prepare().expect("every parameter is in range");
    let (mut shader, other) = (prepared(of(0.3)), prepared(of(0.4)));
    let specular = |shader: &Shader| {
        let [wi, wo] = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, 0.8)];
        (0..200_u16)
            .map(|i| 1e-5 * f64::from(i))
            .map(|u| shader.eval_lobes(DVec2::new(u, 1.7 * u), wi, wo).specular.x)
            .collect::<Vec<_>>()
    };
    let (own, before) = (shader.divisors(0).expect("there is a yarn"), specular(&shader));
    assert!(before.iter().any(|&value| value > 0.0));

    let doubled: Vec<_> = own.iter().map(|divisor| 2.0 * divisor).collect();
    assert_eq!(shader.set_divisors(0, &doubled), Ok(()));
    let after = specular(&shader);
    for (before, after) in before.iter().zip(&after) {
        assert!((before - 2.0 * after).abs() <= 1e-6 * before, "{before}, then {after}");
    }
    let factors = shader.normalization(0).expect("there is a yarn").map(|n| n.factor);
    assert!((factors[0] * f64::from(doubled[0]) - 1.0).abs() < 1e-7, "{factors:?}");

    assert_eq!(shader.set_divisors(0, &own), Ok(()));
    assert_eq!(specular(&shader), before);
    let theirs = other.divisors(0).expect("there is a yarn");
    assert_eq!(shader.set_divisors(0, &theirs), Ok(()));
    assert_eq!(shader.divisors(0), Some(theirs));

    for (divisors, name) in [
        (vec![], "divisors"),
        (vec![1.0; own.len() + 1], "divisors"),
        (vec![0.0; own.len()], "divisor"),
        (vec![f32::NAN; own.len()], "divisor"),
    ] {
        let error = shader.set_divisors(0, &divisors).expect_err("wrong");
        assert_eq!(error.name, name, "{divisors:?}");
    }
    assert!(shader.set_divisors(9, &own).is_err() && shader.divisors(9).is_none());
}
