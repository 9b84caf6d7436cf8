//! Every parameter at its limits, and every kind of direction and position: counts values that are not
//! finite, negative or above the bounds derived in `tests/support/extremes.rs`, and prints how values tend
//! to those at the limits.
//!
//! Run with `cargo run --release -p selvedge-yarn-brdf --example extremes -- [evaluations]`, 10⁸ by default.
//! It fails if there is any such value.

use core::f64::consts::FRAC_PI_2;
use std::process::ExitCode;
use std::time::Instant;

use rayon::prelude::*;
use selvedge_yarn_brdf::{Combination, Highlight, Mode, Phase, Yarn};

#[path = "../tests/support/extremes.rs"]
mod extremes;
#[path = "../tests/support/mod.rs"]
mod support;
use extremes::{Tally, examine, examine_invalid, extreme_cloth};
use support::{Random, cloth};

/// Cloths to look at.
const CLOTHS: u64 = 400;
/// Functions called for each position and pair of directions.
const CALLS: u64 = 8;

fn main() -> ExitCode {
    let evaluations: u64 =
        std::env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(100_000_000);
    let count = evaluations.div_ceil(CLOTHS * CALLS);
    let start = Instant::now();
    let found = (0..CLOTHS).into_par_iter().map(|seed| {
        let mut random = Random(seed);
        let cloth = extreme_cloth(&mut random);
        let shader = cloth.prepare().expect("every parameter is in range");
        let valid = examine(&mut random, &cloth, &shader, count);
        (0..100).map(|_| examine_invalid(&mut random, &shader)).fold(valid, Tally::merged)
    });
    let found = found.reduce(Tally::default, Tally::merged);
    println!("{} evaluations of {CLOTHS} cloths in {:.1?}", found.calls, start.elapsed());
    println!("  not a number    {}", found.nan);
    println!("  infinite        {}", found.infinite);
    println!("  negative        {}", found.negative);
    println!("  above the bound {} of {} with one", found.above, found.bounded);
    println!("  otherwise wrong {}", found.wrong);
    println!("greatest share of a bound {:.4}: {}", found.greatest.0, found.greatest.1);
    for fault in &found.examples {
        println!("  {fault}");
    }
    print_limits();
    print_far_field();
    if found.faults() == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The mean value of a yarn over many positions and directions, and the mean difference of another to it,
/// as a share of that.
fn compare(limit: &Yarn, near: &Yarn) -> [f64; 2] {
    let [limit, near] = [limit, near].map(|yarn| {
        // The highlight alone.
        let mut cloth = cloth(&Yarn { color: [0.0; 3], ..yarn.clone() }, 3);
        (cloth.normalization, cloth.combination) = (Mode::None, Combination::Lerp);
        cloth.prepare().expect("every parameter is in range")
    });
    let mut random = Random(9);
    let (mut sums, mut apart) = ([0.0; 2], 0.0);
    let count = 100_000;
    for _ in 0..count {
        let uv = random.position(4.0);
        let [wi, wo] = [random.direction(), random.direction()];
        let values = [&limit, &near].map(|shader| shader.eval_reference(uv, wi, wo).x);
        sums = [sums[0] + values[0], sums[1] + values[1]];
        apart += (values[0] - values[1]).abs();
    }
    [sums[1] / f64::from(count), apart / sums[0]]
}

/// Values near limits, and how far they are from those at the limits.
fn print_limits() {
    let rough = Yarn { highlight: Highlight::Rough { sigma: 0.15 }, ..Yarn::default() };
    let least_rough = Yarn { highlight: Highlight::Rough { sigma: 0.005 }, ..Yarn::default() };
    let window = Yarn::default();
    let filament = Yarn { psi: 0.0, ..Yarn::default() };
    type Change = fn(&Yarn, f64) -> Yarn;
    let psi: Change = |yarn, psi| Yarn { psi, ..yarn.clone() };
    let negative_psi: Change = |yarn, x| Yarn { psi: -x, ..yarn.clone() };
    let across: Change = |yarn, x| Yarn { psi: FRAC_PI_2 - x, ..yarn.clone() };
    let u_max: Change = |yarn, u_max| Yarn { u_max, ..yarn.clone() };
    let steep: Change = |yarn, x| Yarn { u_max: 1.5 - x, ..yarn.clone() };
    let kappa: Change = |yarn, kappa| Yarn { kappa, ..yarn.clone() };
    let hyperbola: Change = |yarn, x| Yarn { kappa: -0.999 + x, ..yarn.clone() };
    let smoothing: Change = |yarn, smoothing| Yarn { smoothing, ..yarn.clone() };
    let size: Change = |yarn, x| Yarn { size: 1.0 - x, ..yarn.clone() };
    let delta: Change = |yarn, x| Yarn {
        highlight: Highlight::Window { delta: 0.001 * (1.0 + x) },
        ..yarn.clone()
    };
    let wide: Change =
        |yarn, x| Yarn { highlight: Highlight::Window { delta: 1.0 - x }, ..yarn.clone() };
    let sigma: Change =
        |yarn, x| Yarn { highlight: Highlight::Rough { sigma: 0.005 * (1.0 + x) }, ..yarn.clone() };
    let beta: Change =
        |yarn, beta| Yarn { phase: Phase::VonMises { alpha: 0.05, beta }, ..yarn.clone() };
    let sharp: Change = |yarn, x| Yarn {
        phase: Phase::VonMises { alpha: 0.05, beta: 1e6 * (1.0 - x) },
        ..yarn.clone()
    };
    let rho: Change =
        |yarn, rho| Yarn { phase: Phase::WrappedCauchy { rho, is_backward: true }, ..yarn.clone() };
    let all_rho: Change = |yarn, x| Yarn {
        phase: Phase::WrappedCauchy { rho: 1.0 - x, is_backward: true },
        ..yarn.clone()
    };
    let cases: [(&str, &Yarn, Change); 25] = [
        ("psi = x, rough", &rough, psi),
        ("psi = -x, rough", &rough, negative_psi),
        ("psi = x, window", &window, psi),
        ("psi = -x, window", &window, negative_psi),
        ("psi = pi/2 - x, rough", &rough, across),
        ("psi = pi/2 - x, window", &window, across),
        ("u_max = x, rough", &rough, u_max),
        ("u_max = x, window", &window, u_max),
        ("u_max = x, filament", &filament, u_max),
        ("u_max = 1.5 - x, window", &window, steep),
        ("sigma = 0.005 (1 + x)", &least_rough, sigma),
        ("delta = 0.001 (1 + x)", &window, delta),
        ("the same, filament", &filament, delta),
        ("delta = 1 - x", &window, wide),
        ("kappa = x, rough", &rough, kappa),
        ("kappa = x, window", &window, kappa),
        ("kappa = x, filament", &filament, kappa),
        ("kappa = -0.999 + x", &rough, hyperbola),
        ("smoothing = x, filament", &filament, smoothing),
        ("beta = x, window", &window, beta),
        ("beta = 1e6 (1 - x)", &rough, sharp),
        ("rho = x, window", &window, rho),
        ("rho = 1 - x, rough", &rough, all_rho),
        ("size = 1 - x, rough", &rough, size),
        ("size = 1 - x, window", &window, size),
    ];
    let steps = [0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-9];
    println!("\nmean value at x, and below it the mean difference to that at 0 as a share");
    println!("{:24} {:>9} {}", "x", 0, steps.map(|x| format!("{x:>9.0e}")).join(" "));
    for (name, yarn, change) in cases {
        let limit = change(yarn, 0.0);
        let found: Vec<[f64; 2]> =
            steps.par_iter().map(|&x| compare(&limit, &change(yarn, x))).collect();
        let [at_limit, _] = compare(&limit, &limit);
        let row = |part: usize| {
            let cells = found.iter().map(|both| match part {
                0 => format!("{:>9.6}", both[0]),
                _ => format!("{:>9.1e}", both[1]),
            });
            cells.collect::<Vec<String>>().join(" ")
        };
        println!("{name:24} {at_limit:>9.6} {}", row(0));
        println!("{:24} {:>9} {}", "", "", row(1));
    }
}

/// How the mean over a segment of rough fibres tends to that of a drawn highlight.
fn print_far_field() {
    println!(
        "\nmean albedo of a segment of rough fibres as a share of that of a window: least and greatest"
    );
    for psi in [0.5, 0.0] {
        let albedos = |highlight| -> Vec<f64> {
            let yarn = Yarn { highlight, psi, color: [0.0; 3], ..Yarn::default() };
            let mut cloth = cloth(&yarn, 3);
            cloth.normalization = Mode::None;
            let shader = cloth.prepare().expect("every parameter is in range");
            let mut random = Random(4);
            let uv = 0.5 * cloth.pitch;
            (0..200).map(|_| shader.albedo_of_segment(uv, random.direction()).x).collect()
        };
        let smooth = albedos(Highlight::default());
        for sigma in [0.2, 0.1, 0.05, 0.02, 0.01, 0.005] {
            let rough = albedos(Highlight::Rough { sigma });
            let ratios = rough.iter().zip(&smooth).map(|(rough, smooth)| rough / smooth);
            let (least, greatest) = ratios
                .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), x| (low.min(x), high.max(x)));
            println!("psi {psi:<4} sigma {sigma:<6} {least:.4} to {greatest:.4}");
        }
    }
}
