//! The kernel in f64 against values of an independent program, fixtures/brdf/highlights.py, which
//! tells how the inputs of a row follow from its number.

use core::f64::consts::FRAC_PI_2;
use core::ops::RangeInclusive;
use std::path::Path;

use crate::frame::Vector;
use crate::phase::{Parts, Phase};
use crate::segment::{Mapping, Optics};
use crate::shader::highlight;
use crate::yarn::{Highlight, Yarn};

const TOLERANCE: f64 = 1e-10;

/// The numbers in [0, 1) of one row: splitmix64 of the seed, from the 64 `row`-th on.
struct Uniform(u64);

impl Uniform {
    const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

    fn new(seed: u64, row: u64) -> Self {
        Self(seed.wrapping_add((64 * row).wrapping_mul(Self::STEP)))
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(Self::STEP);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// `low` to `low` 2^`count`, even over the octaves and within each.
    fn octaves(&mut self, low: f64, count: u32) -> f64 {
        let at = self.next() * f64::from(count);
        let whole = at as u32;
        low * f64::from(1u32 << whole) * (1.0 + (at - f64::from(whole)))
    }

    /// `low` to 1, and 1 itself in `share` of the cases.
    fn up_to_one(&mut self, low: f64, share: f64) -> f64 {
        low + (1.0 - low) * (self.next() / (1.0 - share)).min(1.0)
    }

    fn kappa(&mut self) -> f64 {
        let which = self.next();
        if which < 0.25 {
            0.0
        } else if which < 0.5 {
            -self.octaves(0.95 / 64.0, 6)
        } else {
            self.octaves(100.0 / 16384.0, 14)
        }
    }

    /// In [−1, 1).
    fn signed(&mut self) -> f64 {
        2.0 * self.next() - 1.0
    }
}

fn unit(x: f64, y: f64, z: f64) -> Vector<f64> {
    let length = (x * x + y * y + z * z).sqrt();
    Vector::new(x / length, y / length, (z / length).abs())
}

/// One tuple of inputs.
#[derive(Debug)]
struct Inputs {
    mapping: Mapping,
    yarn: Yarn,
    /// x, y and w/l.
    at: [f64; 3],
    wi: Vector<f64>,
    wo: Vector<f64>,
}

impl Inputs {
    fn new(highlight: &str, phase: &str, seed: u64, row: u64) -> Self {
        let (is_filament, is_rough) = (highlight == "filament", highlight == "rough");
        let mut r = Uniform::new(seed, row);
        let mapping = if r.next() < 0.5 { Mapping::Linear } else { Mapping::Arcsine };
        let u_max = if is_filament { 0.05 + 1.45 * r.next() } else { 0.01 + 1.49 * r.next() };
        let sign = if r.next() < 0.5 { -1.0 } else { 1.0 };
        let twist = sign * r.up_to_one(0.0192, 0.02) * FRAC_PI_2;
        let psi = if is_filament || (is_rough && r.next() < 0.1) { 0.0 } else { twist };
        let delta = r.up_to_one(0.02, 0.05);
        let sigma = r.octaves(1.0 / 192.0, 7);
        let kappa = r.kappa();
        let smoothing = if r.next() < 0.25 { 0.0 } else { 0.9 * r.next() };
        let alpha = if r.next() < 0.25 { 0.0 } else { r.next() };
        let beta = r.octaves(1e4 / 131_072.0, 17);
        let rho = if r.next() < 0.5 { 0.999 * r.next() } else { 1.0 - r.octaves(0.001, 9) };
        let length = 0.5 + 15.5 * r.next();
        let width = length * (0.05 + 0.95 * r.next());
        let at = [r.signed(), r.signed(), width / length];
        let wo = unit(r.signed(), r.signed(), r.next());
        let (which, s) = (r.next(), r.octaves(1.0 / 256.0, 8));
        let jitter = [s * r.signed(), s * r.signed(), s * r.signed()];
        let wi = if which < 0.4 {
            unit(r.signed(), r.signed(), r.next())
        } else if which < 0.8 {
            unit(jitter[0] - wo.x, jitter[1] - wo.y, wo.z + jitter[2])
        } else {
            unit(wo.x + jitter[0], wo.y + jitter[1], wo.z + jitter[2])
        };
        let phase = match phase {
            "von-mises" => Phase::VonMises { alpha, beta },
            "von-mises-3d" => Phase::VonMises3d { alpha, beta },
            "cauchy" => Phase::WrappedCauchy { rho, is_backward: false },
            _ => Phase::WrappedCauchy { rho, is_backward: true },
        };
        let highlight =
            if is_rough { Highlight::Rough { sigma } } else { Highlight::Window { delta } };
        let yarn = Yarn { u_max, psi, kappa, smoothing, highlight, phase, ..Yarn::default() };
        Self { mapping, yarn, at, wi, wo }
    }

    fn value(&self) -> f64 {
        let optics = Optics::<f64>::new(&self.yarn, false, self.mapping);
        let Parts { peak, uniform } = highlight(&optics, self.at, self.wi, self.wo);
        peak + uniform
    }
}

/// The numbers of each row of a table: its own first.
fn rows(name: &str) -> Vec<(u64, Vec<f64>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/brdf");
    let text = std::fs::read_to_string(folder.join(name).with_extension("csv")).unwrap();
    let row = |line: &str| {
        let (row, values) = line.split_once(',').unwrap();
        (row.parse().unwrap(), values.split(',').map(|value| value.parse().unwrap()).collect())
    };
    text.lines().skip(1).map(row).collect()
}

/// |found − expected| over the greater of the two; 0 where both are.
fn difference(found: f64, expected: f64) -> f64 {
    (found - expected).abs() / found.abs().max(expected.abs()).max(f64::MIN_POSITIVE)
}

/// Every row of the four tables of `highlight`, whose seeds start at `first_seed`.
fn assert_equal_to_oracle(highlight: &str, first_seed: u64, counts: RangeInclusive<usize>) {
    let (mut failures, mut lit, mut worst) = (Vec::new(), 0, 0.0f64);
    let phases = ["von-mises", "von-mises-3d", "cauchy", "cauchy-backward"];
    for (seed, phase) in (first_seed..).zip(phases) {
        for (row, values) in rows(&format!("{highlight}-{phase}")) {
            let (inputs, expected) = (Inputs::new(highlight, phase, seed, row), values[0]);
            let found = inputs.value();
            let error = difference(found, expected);
            worst = worst.max(error);
            lit += usize::from(expected > 0.0);
            if error > TOLERANCE || (expected == 0.0) != (found == 0.0) {
                failures.push(format!(
                    "{highlight}-{phase} {row}: {found:e}, expected {expected:e}, difference \
                     {error:.1e}, tolerance {TOLERANCE:e}: {inputs:?}"
                ));
            }
        }
    }
    println!("{highlight}: {lit} values above 0, greatest difference {worst:.1e}");
    assert!(failures.is_empty(), "{} differ:\n{}", failures.len(), failures.join("\n"));
    assert!(counts.contains(&lit), "{lit} values above 0");
}

#[test]
fn twisted_fibres_agree_with_the_oracle() {
    assert_equal_to_oracle("staple", 0, 10_000..=12_000);
}

#[test]
fn filaments_agree_with_the_oracle() {
    assert_equal_to_oracle("filament", 4, 7_200..=9_000);
}

#[test]
fn rough_fibres_agree_with_the_oracle() {
    assert_equal_to_oracle("rough", 8, 5_200..=6_000);
}

#[test]
fn spine_agrees_with_the_oracle() {
    let rows = rows("spine");
    assert_eq!(rows.len(), 1500);
    for (row, expected) in rows {
        let mut r = Uniform::new(99, row);
        let (u_max, kappa, y) = (0.01 + 1.49 * r.next(), r.kappa(), r.signed());
        let yarn = Yarn { u_max, kappa, ..Yarn::default() };
        let optics = Optics::<f64>::new(&yarn, false, Mapping::Linear);
        let u = y * u_max;
        // The circle of the same ends is at sin η / sin u_max of its half length.
        let position = optics.spine_of_u(u).sin() / u_max.sin();
        for (found, expected) in [(optics.bend(u.sin()), expected[0]), (position, expected[1])] {
            let error = difference(found, expected);
            assert!(
                error <= TOLERANCE,
                "row {row}, u_max {u_max}, kappa {kappa}, y {y}: {found:e}, expected \
                 {expected:e}, difference {error:.1e}, tolerance {TOLERANCE:e}"
            );
        }
    }
}
