//! Irregularities do not repeat with the weave, have the mean they should have, and are free when off.

use core::f64::consts::TAU;

use rayon::prelude::*;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Combination, Highlight, Mode, Noise, Shader, Yarn};

mod support;
use support::{PITCH, Random, cloth};

/// Cells of a repeat, in either direction.
const REPEAT: usize = 6;
/// Places looked at along each repeat.
const PLACES: usize = 48;
const REPEATS: usize = 64;

fn prepared(yarn: &Yarn, float: u32) -> Shader {
    cloth(yarn, float).prepare().expect("the yarn is valid")
}

/// Numbers along the ends of a cloth: of each end, that of every place at which it shows, and `None`
/// where it does not.
type Profiles = Vec<Vec<Option<f64>>>;

/// What `look` finds along the middle of 200 ends.
fn profiles(look: impl Fn(DVec2) -> Option<f64> + Sync) -> Profiles {
    (0..200)
        .into_par_iter()
        .map(|end| {
            let at = |k: usize| {
                let v = (k as f64 + 0.37) / PLACES as f64 * REPEAT as f64;
                look(PITCH * DVec2::new(f64::from(end) + 0.5, v))
            };
            (0..REPEATS * PLACES).map(at).collect()
        })
        .collect()
}

/// The diameter over pitch of the ends, where they show.
fn widths(shader: &Shader) -> Profiles {
    profiles(|uv| {
        let segment = shader.yarn_at(uv)?.segment;
        assert!(segment.x.abs() <= 1.0 && segment.y.abs() <= 1.0, "{uv}: {segment:?}");
        segment.is_warp.then_some(segment.width)
    })
}

/// The highlight of the ends over that of the same cloth without irregularities.
fn intensities(noisy: &Shader, even: &Shader) -> Profiles {
    let (wi, wo) = (Vec3::new(0.1, 0.0, 1.0).normalize(), Vec3::Z);
    profiles(|uv| {
        let is_warp = even.yarn_at(uv)?.segment.is_warp;
        let f = even.eval_lobes(uv, wi, wo).specular.x;
        (is_warp && f > 0.0).then(|| f64::from(noisy.eval_lobes(uv, wi, wo).specular.x / f))
    })
}

fn mean(profiles: &Profiles) -> f64 {
    let values = || profiles.iter().flatten().flatten();
    values().sum::<f64>() / values().count() as f64
}

/// Correlation of each value with that `steps` further along its thread.
fn correlation(profiles: &Profiles, steps: usize) -> f64 {
    let mean = mean(profiles);
    let (mut product, mut square, mut count) = (0.0, 0.0, 0.0);
    for profile in profiles {
        for (a, b) in profile.iter().zip(&profile[steps..]) {
            if let (Some(a), Some(b)) = (a, b) {
                product += (a - mean) * (b - mean);
                square += 0.5 * ((a - mean).powi(2) + (b - mean).powi(2));
                count += 1.0;
            }
        }
    }
    assert!(count > 1000.0, "{count} pairs");
    product / square
}

/// Correlation of each value with that at the same place of the thread `threads` further.
fn correlation_between(profiles: &Profiles, threads: usize) -> f64 {
    let mean = mean(profiles);
    let (mut product, mut square) = (0.0, 0.0);
    for (one, other) in profiles.iter().zip(&profiles[threads..]) {
        for (a, b) in one.iter().zip(other) {
            if let (Some(a), Some(b)) = (a, b) {
                product += (a - mean) * (b - mean);
                square += 0.5 * ((a - mean).powi(2) + (b - mean).powi(2));
            }
        }
    }
    product / square
}

/// Power of the mean over threads at `cycles` per repeat; what is hidden counts as the mean.
fn power(profiles: &Profiles, cycles: f64) -> f64 {
    let mean = mean(profiles);
    let total: f64 = profiles
        .iter()
        .map(|profile| {
            let (mut re, mut im) = (0.0, 0.0);
            for (k, value) in profile.iter().enumerate() {
                let (sin, cos) = (TAU * cycles * k as f64 / PLACES as f64).sin_cos();
                let value = value.unwrap_or(mean) - mean;
                (re, im) = (re + value * cos, im + value * sin);
            }
            re * re + im * im
        })
        .sum();
    total / profiles.len() as f64
}

/// Asserts that the values repeat neither with the weave nor with a multiple of it, along the thread
/// or from thread to thread.
fn assert_aperiodic(what: &str, profiles: &Profiles) {
    for repeats in [1, 2, 5] {
        let along = correlation(profiles, repeats * PLACES);
        let across = correlation_between(profiles, repeats * REPEAT);
        println!("{what}: correlation {along:.3} along and {across:.3} across {repeats} repeats");
        // Noise swings back after a wavelength, which is the opposite of a repeat.
        assert!(along < 0.2 && across.abs() < 0.2, "{what}: {along} and {across}, allowed 0.2");
    }
    for harmonic in [1.0, 2.0] {
        let at = power(profiles, harmonic);
        // Around it, by steps of the finest frequency that the length of the profile tells apart.
        let beside: Vec<f64> = (2..12)
            .flat_map(|k| [-1.0, 1.0].map(|sign| harmonic + sign * f64::from(k) / REPEATS as f64))
            .map(|cycles| power(profiles, cycles))
            .collect();
        let around = beside.iter().sum::<f64>() / beside.len() as f64;
        println!("{what}: power at {harmonic} per repeat {:.2} of that around", at / around);
        // Over 200 threads its mean scatters by a fourteenth.
        assert!(at < 1.4 * around, "{what}: {at} at {harmonic} per repeat, {around} around it");
    }
}

#[test]
fn widths_do_not_repeat_and_have_the_mean_they_should() {
    // A wavelength below and one above the repeat.
    for wavelength in [2.7e-3, 11e-3] {
        let noise = Noise { width: 0.3, offset: 0.1, wavelength, ..Noise::default() };
        let yarn = Yarn { size: 0.7, noise, ..Yarn::default() };
        let widths = widths(&prepared(&yarn, REPEAT as u32 - 1));
        assert_aperiodic(&format!("width, wavelength {wavelength}"), &widths);
        let mean = mean(&widths);
        assert!((mean / 0.7 - 1.0).abs() < 0.01, "mean width {mean}, expected 0.7");
        let values = || widths.iter().flatten().flatten();
        let (least, greatest) = values().fold((1.0f64, 0.0f64), |(l, g), &w| (l.min(w), g.max(w)));
        println!("widths {least:.3} to {greatest:.3}, mean {mean:.4}");
        assert!(least > 0.7 * 0.7 && greatest < 0.7 * 1.3 && greatest - least > 0.2);
        // No place along the threads at which all are alike.
        let spread = |k: usize| {
            let values = widths.iter().filter_map(|profile| profile[k]);
            let (count, sum) =
                values.fold((0.0, 0.0), |(n, s), w| (n + 1.0, s + (w - 0.7).powi(2)));
            sum / f64::max(count, 1.0)
        };
        let spreads: Vec<f64> = (0..REPEATS * PLACES).map(spread).collect();
        let all = spreads.iter().sum::<f64>() / spreads.len() as f64;
        let least = spreads.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(
            least > 0.3 * all,
            "variance {least} somewhere along the threads, {all} on average"
        );
    }
}

#[test]
fn thick_places_are_as_frequent_as_told_and_do_not_repeat() {
    let noise = Noise { slub_rate: 40.0, slub_length: 6e-3, slub_height: 0.5, ..Noise::default() };
    let yarn = Yarn { size: 0.6, noise, ..Yarn::default() };
    let widths = widths(&prepared(&yarn, REPEAT as u32 - 1));
    assert_aperiodic("thick places", &widths);
    let values = || widths.iter().flatten().flatten();
    assert!(values().all(|&width| (0.6..=0.9).contains(&width)));
    // Each is 6 mm long, and in every 3 mm one starts with the probability p = 0.12. A place has none
    // with (1 − p)(1 − p f)(1 − p (1 − f)), on average over its fraction f of those 3 mm.
    let share = values().filter(|&&width| width > 0.6).count() as f64 / values().count() as f64;
    let p = 0.12;
    let expected = 1.0 - (1.0 - p) * (1.0 - p + p * p / 6.0);
    println!("thick places cover {share:.4} of a thread, expected {expected:.4}");
    assert!((share / expected - 1.0).abs() < 0.03, "{share} of a thread, expected {expected}");
}

#[test]
fn intensities_do_not_repeat_and_have_the_mean_they_should() {
    let yarn = |intensity| Yarn {
        color: [0.0; 3],
        highlight: Highlight::Rough { sigma: 0.5 },
        noise: Noise { intensity, fineness: 2.0, ..Noise::default() },
        ..Yarn::default()
    };
    let even = prepared(&yarn(0.0), REPEAT as u32 - 1);
    for intensity in [1.0, 0.4] {
        let values = intensities(&prepared(&yarn(intensity), REPEAT as u32 - 1), &even);
        assert_aperiodic(&format!("intensity {intensity}"), &values);
        let mean = mean(&values);
        assert!((mean - 1.0).abs() < 0.02, "mean intensity {mean}, expected 1");
    }
}

#[test]
fn lightness_changes_from_thread_to_thread_alone() {
    let noise = Noise { color: 0.3, ..Noise::default() };
    let yarn = Yarn { color: [0.5, 0.4, 0.3], specular: [0.0; 3], noise, ..Yarn::default() };
    let shader = prepared(&yarn, 1);
    // The factors of ends and of picks, by any crossing that shows them.
    let mut factors: [Vec<f64>; 2] = [vec![], vec![]];
    for thread in 0..2000i32 {
        for is_warp in [true, false] {
            // In this plain weave the end is on top where the sum is odd.
            let crossings = [0, 2, 40, 600].map(|k| thread + i32::from(is_warp) + k);
            let values = crossings.map(|crossing| {
                let (end, pick) = if is_warp { (thread, crossing) } else { (crossing, thread) };
                let uv = PITCH * (DVec2::new(end.into(), pick.into()) + 0.5);
                let segment = shader.yarn_at(uv).expect("threads touch").segment;
                assert_eq!((segment.is_warp, segment.line), (is_warp, i64::from(thread)));
                shader.eval(uv, Vec3::Z, Vec3::Z) * core::f32::consts::PI
            });
            assert!(values.iter().all(|v| *v == values[0]), "{is_warp} {thread}: {values:?}");
            let factor = values[0] / Vec3::from(yarn.color);
            assert!((factor - factor.x).abs().max_element() < 1e-5, "{factor} changes the hue");
            factors[usize::from(is_warp)].push(factor.x.into());
        }
    }
    let moment = |values: &[f64], other: &[f64]| {
        values.iter().zip(other).map(|(a, b)| (a - 1.0) * (b - 1.0)).sum::<f64>()
            / values.len().min(other.len()) as f64
    };
    for factors in &factors {
        let mean = factors.iter().sum::<f64>() / factors.len() as f64;
        assert!((mean - 1.0).abs() < 0.015, "mean lightness {mean}, expected 1");
        assert!(factors.iter().all(|f| (0.7..=1.3).contains(f)), "{factors:?}");
        // Even over ±0.3, and independent of the next and of the next repeat.
        let variance = moment(factors, factors);
        assert!((variance / 0.03 - 1.0).abs() < 0.1, "variance {variance}, expected 0.03");
        for shift in [1, 2, 4] {
            let correlation = moment(factors, &factors[shift..]) / variance;
            assert!(correlation.abs() < 0.1, "{correlation} over {shift} threads");
        }
    }
    let between = moment(&factors[0], &factors[1]) / 0.03;
    assert!(between.abs() < 0.1, "ends and picks correlate by {between}");
}

#[test]
fn inclination_changes_from_segment_to_segment_alone() {
    let noise = Noise { u_max: 0.2, ..Noise::default() };
    let yarn = Yarn { noise, ..Yarn::default() };
    let shader = prepared(&yarn, 3);
    // End 0 floats over picks 1 to 3, 5 to 7 and so on: u at a place is y times u_max, asin aside.
    let mut found = Vec::new();
    for float in 0..2000 {
        let values = [0.3, 1.2, 2.9].map(|v| {
            let uv = PITCH * DVec2::new(0.5, 1.0 + 4.0 * f64::from(float) + v);
            let point = shader.yarn_at(uv).expect("threads touch");
            (point.u.sin() / point.segment.y).asin()
        });
        assert!((values[0] - values[2]).abs() < 1e-9 && (values[1] - values[2]).abs() < 1e-9);
        found.push(values[0]);
    }
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    assert!(found.iter().all(|u| (0.3..=0.7).contains(u)) && (mean - 0.5).abs() < 0.01, "{mean}");
    let shifted = found.iter().zip(&found[1..]).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    let square = found.iter().map(|a| (a - mean) * (a - mean)).sum::<f64>();
    assert!((shifted / square).abs() < 0.1, "neighbours correlate by {}", shifted / square);
}

#[test]
fn irregularities_of_no_height_change_no_bit() {
    // All that is left when the heights are 0.
    let off = Noise {
        fineness: 17.0,
        wavelength: 3e-3,
        slub_rate: 100.0,
        slub_length: 0.02,
        ..Noise::default()
    };
    for mode in [Mode::Segment, Mode::Pointwise] {
        for yarn in [
            Yarn::default(),
            Yarn { psi: 0.0, size: 0.8, ..Yarn::default() },
            Yarn { highlight: Highlight::Rough { sigma: 0.2 }, size: 0.5, ..Yarn::default() },
        ] {
            let shader = |noise: Noise, seed: u64| {
                let mut cloth = cloth(&Yarn { noise, ..yarn.clone() }, 2);
                (cloth.normalization, cloth.seed) = (mode, seed);
                cloth.combination = Combination::Layered;
                cloth.prepare().expect("the yarn is valid")
            };
            let (plain, other) = (shader(Noise::default(), 0), shader(off, 12345));
            let mut random = Random(9);
            for _ in 0..20_000 {
                let uv = random.position(50.0);
                let (wi, wo) = (random.direction(), random.direction());
                let f = [&plain, &other].map(|s| s.eval_reference(uv, wi, wo).to_array());
                assert_eq!(
                    f[0].map(f64::to_bits),
                    f[1].map(f64::to_bits),
                    "{uv} {wi} {wo} {yarn:?}"
                );
                let (wi, wo, xi) = (wi.as_vec3(), wo.as_vec3(), random.xi());
                let f = [&plain, &other].map(|s| s.eval(uv, wi, wo).to_array());
                assert_eq!(
                    f[0].map(f32::to_bits),
                    f[1].map(f32::to_bits),
                    "{uv} {wi} {wo} {yarn:?}"
                );
                assert_eq!(
                    plain.sample(uv, wo, xi),
                    other.sample(uv, wo, xi),
                    "{uv} {wo} {yarn:?}"
                );
                assert_eq!(plain.opacity(uv), other.opacity(uv), "{uv} {yarn:?}");
            }
        }
    }
}

#[test]
fn another_seed_is_another_cloth() {
    let noise = Noise { width: 0.3, intensity: 0.5, color: 0.2, ..Noise::default() };
    let yarn = Yarn { size: 0.7, noise, ..Yarn::default() };
    let widths = [0, 1].map(|seed| {
        let mut cloth = cloth(&yarn, REPEAT as u32 - 1);
        cloth.seed = seed;
        widths(&cloth.prepare().expect("the yarn is valid"))
    });
    let (mut product, mut square) = (0.0, 0.0);
    let [one, other] = &widths;
    for (a, b) in one.iter().flatten().zip(other.iter().flatten()) {
        if let (Some(a), Some(b)) = (a, b) {
            product += (a - 0.7) * (b - 0.7);
            square += (a - 0.7) * (a - 0.7);
        }
    }
    assert!((product / square).abs() < 0.05, "widths correlate by {}", product / square);
}
