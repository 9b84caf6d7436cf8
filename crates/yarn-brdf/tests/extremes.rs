//! At the limits of every parameter, and for any input, values are finite, not negative and bounded.

use proptest::prelude::*;
use rayon::prelude::*;
use selvedge_yarn_brdf::glam::DVec2;
use selvedge_yarn_brdf::{Combination, Highlight, Mode, Noise, Phase, Yarn};

#[path = "support/extremes.rs"]
mod extremes;
#[path = "support/mod.rs"]
mod support;
use extremes::{Tally, examine, examine_invalid, extreme_cloth};
use support::{PITCH, Random, cloth};

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn values_at_the_limits_are_within_their_bounds(seed: u64) {
        let mut random = Random(seed);
        let cloth = extreme_cloth(&mut random);
        let shader = cloth.prepare().expect("every parameter is in range");
        let found = examine(&mut random, &cloth, &shader, 10_000);
        prop_assert_eq!(found.faults(), 0, "{:#?}", found);
    }
}

#[test]
fn what_is_no_number_reflects_nothing() {
    let rough = Highlight::Rough { sigma: 0.2 };
    let yarns = [(Highlight::default(), 0.4), (Highlight::default(), 0.0), (rough, 0.4)];
    for (highlight, psi) in yarns {
        let yarn = Yarn { highlight, psi, size: 0.8, ..Yarn::default() };
        let shader = cloth(&yarn, 2).prepare().expect("every parameter is in range");
        let mut random = Random(3);
        let found = (0..200).map(|_| examine_invalid(&mut random, &shader));
        let found = found.fold(Tally::default(), Tally::merged);
        assert_eq!(found.faults(), 0, "{yarn:?}: {found:#?}");
    }
}

#[test]
fn more_yarns_without_a_factor_are_within_their_bounds() {
    let found = (0..64u64).into_par_iter().map(|seed| {
        let mut random = Random(seed);
        let yarn = Yarn { noise: Noise::default(), ..extremes::yarn(&mut random) };
        let mut cloth = cloth(&yarn, 2);
        cloth.normalization = Mode::None;
        let shader = cloth.prepare().expect("every parameter is in range");
        examine(&mut random, &cloth, &shader, 4000)
    });
    let found = found.reduce(Tally::default, Tally::merged);
    assert_eq!(found.faults(), 0, "{found:#?}");
}

/// Values of the highlight of a yarn at many positions and pairs of directions.
fn values(yarn: &Yarn) -> Vec<f64> {
    let mut cloth = cloth(&Yarn { color: [0.0; 3], ..yarn.clone() }, 3);
    // Without the table of albedos, which is only as exact as it need be.
    (cloth.normalization, cloth.combination) = (Mode::None, Combination::Lerp);
    let shader = cloth.prepare().expect("every parameter is in range");
    let mut random = Random(9);
    let value = |_| {
        let uv = random.position(4.0);
        let [wi, wo] = [random.direction(), random.direction()];
        shader.eval_reference(uv, wi, wo).x
    };
    (0..4000).map(value).collect()
}

#[test]
fn values_tend_to_those_at_the_limits() {
    let rough = Yarn { highlight: Highlight::Rough { sigma: 0.15 }, ..Yarn::default() };
    let base = Yarn::default();
    type Change = fn(&Yarn, f64) -> Yarn;
    let cases: [(&str, &Yarn, Change); 8] = [
        ("psi to 0+", &rough, |yarn, psi| Yarn { psi, ..yarn.clone() }),
        ("psi to 0-", &rough, |yarn, x| Yarn { psi: -x, ..yarn.clone() }),
        ("psi to pi/2", &base, |yarn, x| Yarn {
            psi: core::f64::consts::FRAC_PI_2 - x,
            ..yarn.clone()
        }),
        ("u_max", &rough, |yarn, u_max| Yarn { u_max, ..yarn.clone() }),
        ("kappa", &rough, |yarn, kappa| Yarn { kappa, ..yarn.clone() }),
        ("smoothing", &rough, |yarn, smoothing| Yarn { smoothing, ..yarn.clone() }),
        ("rho", &rough, |yarn, rho| Yarn {
            phase: Phase::WrappedCauchy { rho, is_backward: false },
            ..yarn.clone()
        }),
        ("beta", &rough, |yarn, beta| Yarn {
            phase: Phase::VonMises { alpha: 0.05, beta },
            ..yarn.clone()
        }),
    ];
    cases.into_par_iter().for_each(|(name, yarn, change)| {
        let limit = values(&change(yarn, 0.0));
        let sum: f64 = limit.iter().sum();
        for x in [1e-2, 1e-4, 1e-8, 1e-300] {
            let near = values(&change(yarn, x));
            let apart: f64 = limit.iter().zip(&near).map(|(a, b)| (a - b).abs()).sum();
            let found = apart / sum;
            assert!(found <= 5.0 * x + 1e-12, "{name} = {x}: {found}, expected at most 5 x");
        }
    });
}

#[test]
fn the_mean_over_a_segment_of_rough_fibres_tends_to_that_of_smooth_ones() {
    let albedo = |highlight| {
        let yarn = Yarn { highlight, color: [0.0; 3], ..Yarn::default() };
        let mut cloth = cloth(&yarn, 3);
        cloth.normalization = Mode::None;
        let shader = cloth.prepare().expect("every parameter is in range");
        let mut random = Random(4);
        let sum: f64 = (0..40)
            .map(|_| shader.albedo_of_segment(DVec2::splat(0.5 * PITCH), random.direction()).x)
            .sum();
        sum / 40.0
    };
    let smooth = albedo(Highlight::default());
    for (sigma, tolerance) in [(0.1, 1e-2), (0.05, 3e-3), (0.02, 6e-4), (0.005, 3e-4)] {
        let found = albedo(Highlight::Rough { sigma }) / smooth - 1.0;
        assert!(found.abs() < tolerance, "sigma {sigma}: {found}, expected 0 within {tolerance}");
    }
}
