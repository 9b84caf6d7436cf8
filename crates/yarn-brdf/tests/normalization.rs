//! The factor of equation 2 against a search without tables.

use rayon::prelude::*;

#[path = "../examples/factors/brute_force.rs"]
mod brute_force;
#[path = "support/yarns.rs"]
mod yarns;

use brute_force::greatest_albedo;
use selvedge_yarn_brdf::Mode;
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
