//! Nothing jumps but what is drawn to jump: the edges of a window, and those of the yarn.

use core::f64::consts::{FRAC_PI_2, TAU};

use rayon::prelude::*;
use selvedge_yarn_brdf::glam::{DVec2, DVec3};
use selvedge_yarn_brdf::{
    Cloth, Highlight, Mapping, Mode, Noise, Phase, SegmentKind, Shader, Thread, Weave, Yarn,
};

mod support;
use support::{PITCH, Random, cloth, direction};

fn window(delta: f64) -> Highlight {
    Highlight::Window { delta }
}

fn rough(sigma: f64) -> Highlight {
    Highlight::Rough { sigma }
}

/// One yarn for each kind of highlight.
fn yarns() -> [Yarn; 4] {
    let d = || Yarn { size: 0.8, specular_uniform: Some([0.1, 0.2, 0.3]), ..Yarn::default() };
    [
        d(),
        Yarn { psi: 0.0, smoothing: 0.4, kappa: -0.5, ..d() },
        Yarn { highlight: rough(0.2), ..d() },
        Yarn {
            psi: -0.8,
            highlight: rough(0.1),
            phase: Phase::WrappedCauchy { rho: 0.67, is_backward: true },
            ..d()
        },
    ]
}

/// A cloth of `repeats` of a weave in which every thread is covered somewhere, with two kinds of
/// yarn; `weave(end, pick)` has 4 ends and 5 picks.
fn woven(yarn: &Yarn, repeats: [u32; 2], weave: impl Fn(u32, u32) -> bool) -> Cloth {
    let [ends, picks] = [4 * repeats[0], 5 * repeats[1]];
    let weave = Weave::new(ends, picks, |end, pick| weave(end % 4, pick % 5))
        .expect("a few threads are no more than allowed");
    let thread = |k: u32| Thread {
        color: [0.1 + 0.2 * (k % 2) as f32; 3],
        pitch: Some(PITCH),
        ..Thread::default()
    };
    let list = |count: u32, period: u32| -> Vec<Thread> {
        (0..count).map(|k| thread(k % period)).collect()
    };
    let cloth = Cloth::from_threads(weave, &list(ends, 4), &list(picks, 5), yarn);
    let mut cloth = cloth.expect("as many threads as the weave has");
    // Not the mean over more or fewer threads, whose rounding differs.
    cloth.pitch = DVec2::splat(PITCH);
    for (kind, size) in cloth.yarns.iter_mut().zip([0.7, 0.9]) {
        kind.size = size;
    }
    cloth
}

fn twill(end: u32, pick: u32) -> bool {
    (2 * end + pick) % 5 < 3 && !(end + pick).is_multiple_of(4)
}

fn prepared(cloth: &Cloth) -> Shader {
    cloth.prepare().expect("the yarns are valid")
}

#[test]
fn border_of_a_repeat_is_like_any_other() {
    let noise = Noise { intensity: 0.5, width: 0.2, offset: 0.1, color: 0.2, ..Noise::default() };
    yarns().into_par_iter().for_each(|yarn| {
        let yarn = Yarn { noise, ..yarn };
        // What is a border of the one lies inside the other.
        let (one, many) =
            (prepared(&woven(&yarn, [1, 1], twill)), prepared(&woven(&yarn, [3, 2], twill)));
        let mut random = Random(1);
        for k in 0..100_000 {
            // Half of the points within a thousandth of a cell of a border.
            let near = if k % 2 == 0 { 1e-3 } else { 1.0 };
            let mut place = |period: f64| {
                (period * (random.number() * 20.0 - 10.0).floor() + near * (random.number() - 0.5))
                    * PITCH
            };
            let uv = DVec2::new(place(4.0), place(5.0));
            let side = if k % 4 < 2 { 1.0 } else { -1.0 };
            let [wi, wo] = [random.direction(), random.direction()].map(|w| w.with_z(side * w.z));
            let (f, g) = (one.eval_reference(uv, wi, wo), many.eval_reference(uv, wi, wo));
            assert_eq!(f, g, "uv {uv} wi {wi} wo {wo} {yarn:?}");
            let [wi, wo] = [wi, wo].map(DVec3::as_vec3);
            assert_eq!(one.eval(uv, wi, wo), many.eval(uv, wi, wo), "uv {uv} {wi} {wo} {yarn:?}");
        }
    });
}

#[test]
fn back_is_the_face_of_the_cloth_turned_over() {
    yarns().into_par_iter().enumerate().for_each(|(i, yarn)| {
        let mut cloth = woven(&yarn, [1, 1], twill);
        // Seen from behind, the ends run the other way and what was below is above.
        let mut turned = woven(&yarn, [1, 1], |end, pick| !twill(3 - end, pick));
        turned.end_yarns.reverse();
        for cloth in [&mut cloth, &mut turned] {
            cloth.mapping = [Mapping::Arcsine, Mapping::Linear][i % 2];
        }
        let (cloth, turned) = (prepared(&cloth), prepared(&turned));
        let mut random = Random(2);
        for _ in 0..50_000 {
            let uv = random.position(20.0);
            let (wi, wo) = (random.direction(), random.direction());
            let over = |w: DVec3| DVec3::new(-w.x, w.y, -w.z);
            let f = cloth.eval_reference(uv, wi, wo);
            let g = turned.eval_reference(DVec2::new(-uv.x, uv.y), over(wi), over(wo));
            let tolerance = 1e-9 * f.max_element() + 1e-12;
            // A position within rounding of an edge may be told to either side of it.
            let is_at_edge = (f - g).abs().max_element() > tolerance && {
                let beside = |d: DVec2| cloth.eval_reference(uv + d, wi, wo);
                let d = 1e-12 * PITCH;
                let steps =
                    [DVec2::new(d, d), DVec2::new(-d, d), DVec2::new(d, -d), DVec2::new(-d, -d)];
                steps.into_iter().any(|d| (beside(d) - g).abs().max_element() < 1e3 * tolerance)
            };
            let difference = (f - g).abs().max_element();
            assert!(
                difference <= tolerance || is_at_edge,
                "{f} and {g}, allowed {tolerance:e}: uv {uv} wi {wi} wo {wo} {yarn:?}"
            );
        }
    });
}

/// The greatest step of `f` over [0, 1] in `count` steps, and the greatest value.
fn greatest_step(count: u32, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let (mut step, mut greatest) = (0.0f64, 0.0f64);
    let mut last = f(0.0);
    for k in 1..=count {
        let value = f(f64::from(k) / f64::from(count));
        step = step.max((value - last).abs());
        greatest = greatest.max(value.abs());
        last = value;
    }
    (step, greatest)
}

/// Asserts that `f` has no jump on [0, 1]: with 16 times as many steps, the greatest is at most a
/// sixth.
fn assert_continuous(what: &str, f: impl Fn(f64) -> f64) {
    let (coarse, greatest) = greatest_step(4000, &f);
    let (fine, _) = greatest_step(64_000, &f);
    assert!(
        fine <= coarse / 6.0 + 1e-9 * greatest,
        "{what}: steps up to {coarse:e}, of a sixteenth up to {fine:e}, values up to {greatest:e}"
    );
}

/// A cloth of rough fibres whose end 0 floats over picks 1 to 3, with slits between the threads.
fn floats(sigma: f64, psi: f64, mode: Mode, mapping: Mapping) -> Shader {
    let yarn = Yarn { psi, highlight: rough(sigma), size: 0.8, kappa: 1.0, ..Yarn::default() };
    let mut cloth = cloth(&yarn, 3);
    (cloth.normalization, cloth.mapping) = (mode, mapping);
    prepared(&cloth)
}

#[test]
fn rough_highlight_is_continuous_in_position_and_directions() {
    for (sigma, psi, mapping) in
        [(0.1, 0.5, Mapping::Arcsine), (0.2, 0.0, Mapping::Linear), (0.05, -1.2, Mapping::Linear)]
    {
        let shader = floats(sigma, psi, Mode::Segment, mapping);
        let mut random = Random(5);
        for _ in 0..6 {
            let (wi, wo, other) = (random.direction(), random.direction(), random.direction());
            let f = |uv: DVec2, wi: DVec3| shader.eval_reference(uv, wi, wo).x;
            let what =
                |along: &str| format!("σ {sigma} ψ {psi} {mapping:?} wi {wi} wo {wo} {along}");
            // Across the yarn up to its edges.
            let width = 0.78;
            let at = |t: f64| PITCH * DVec2::new(0.5 + width * (t - 0.5), 1.9);
            assert_continuous(&what("across"), |t| f(at(t), wi));
            // Along the whole segment: over borders of cells, and to where it shows in the slit
            // before the yarn that covers it.
            let at = |t: f64| PITCH * DVec2::new(0.6, 0.91 + 3.18 * t);
            let ends = [0.0, 1.0].map(|t| shader.yarn_at(at(t)).expect("the yarn is hit").segment);
            assert!(
                ends.iter().all(|s| s.kind == SegmentKind::Extension && s.first == 1),
                "{ends:?}"
            );
            assert_continuous(&what("along"), |t| f(at(t), wi));
            // From one direction to another, and down to the surface.
            let uv = PITCH * DVec2::new(0.6, 2.3);
            assert_continuous(&what("to another direction"), |t| {
                f(uv, wi.lerp(other, t).normalize())
            });
            assert_continuous(&what("to the surface"), |t| {
                let wi = (wi.with_z(wi.z * (1.0 - t))).normalize();
                // Radiance for a light of even brightness: nothing appears at the horizon.
                f(uv, wi) * wi.z
            });
        }
    }
}

#[test]
fn rough_highlight_is_continuous_in_the_twist_through_zero() {
    for mode in [Mode::None, Mode::Segment] {
        for (sigma, mapping) in [(0.1, Mapping::Arcsine), (0.02, Mapping::Linear)] {
            let shader = |psi| floats(sigma, psi, mode, mapping);
            let straight = shader(0.0);
            let differences = [1e-2, 1e-4, 1e-6].map(|psi| {
                let (left, right) = (shader(-psi), shader(psi));
                let mut random = Random(6);
                let (mut greatest, mut value) = (0.0f64, 0.0f64);
                for _ in 0..3000 {
                    let uv = random.position(20.0);
                    let (wi, wo) = (random.direction(), random.direction());
                    let [l, s, r] =
                        [&left, &straight, &right].map(|s| s.eval_reference(uv, wi, wo).x);
                    greatest = greatest.max((l - s).abs()).max((r - s).abs());
                    value = value.max(s);
                }
                greatest / value
            });
            println!("σ {sigma} {mode:?}: ψ = ±10⁻², ±10⁻⁴, ±10⁻⁶ differ by {differences:?}");
            let [first, second, third] = differences;
            // In proportion to ψ, down to the tables, which are in f32.
            assert!(
                second < 0.03 * first && third < 0.03 * second + 1e-6,
                "σ {sigma} {mode:?}: {differences:?} of the greatest value"
            );
        }
    }
}

/// The place (u, v) of the highlight of a yarn in its frame, if there is one (model of Irawan &
/// Marschner 2012, equations 3 and 4), and how close it is to not existing.
fn root(psi: f64, u_max: f64, at: [f64; 2], wi: DVec3, wo: DVec3) -> Option<([f64; 2], f64)> {
    let h = (wi + wo).normalize();
    let [u, v] = at;
    let (u, v, margin) = if psi == 0.0 {
        let u = h.y.atan2(h.z);
        (u, v, u_max - u.abs())
    } else {
        let c = h.y * u.cos() - h.z * u.sin();
        let b = h.y * u.sin() + h.z * u.cos();
        let d = c / ((h.x * h.x + b * b).sqrt() * psi.tan());
        let v = (-b).atan2(h.x) + d.clamp(-1.0, 1.0).acos();
        let v = (v + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        (u, v, (1.0 - d.abs()).min(FRAC_PI_2 - v.abs()))
    };
    let n = DVec3::new(v.sin(), u.sin() * v.cos(), u.cos() * v.cos());
    let margin = margin.min(n.dot(wi)).min(n.dot(wo));
    Some(([u, v], margin)).filter(|_| margin > 0.0)
}

#[test]
fn drawn_highlight_jumps_only_at_the_edges_of_its_window() {
    let (u_max, delta) = (0.6, 0.3);
    for (psi, mapping) in [
        (0.5, Mapping::Linear),
        (-0.9, Mapping::Arcsine),
        (0.0, Mapping::Linear),
        (0.0, Mapping::Arcsine),
    ] {
        let yarn =
            Yarn { color: [0.0; 3], psi, u_max, highlight: window(delta), ..Yarn::default() };
        let mut cloth = cloth(&yarn, 3);
        cloth.mapping = mapping;
        let shader = prepared(&cloth);
        let mut random = Random(7);
        let (mut jumps, mut lit_lines) = (0, 0);
        for _ in 0..400 {
            let (wi, wo, other) = (random.direction(), random.direction(), random.direction());
            let [a, b] = [random.between(-0.95, 0.95), random.between(-0.95, 0.95)];
            // On the float of end 0 over picks 1 to 3.
            let f = |x: f64, y: f64, wi: DVec3| {
                let uv = PITCH * DVec2::new(0.5 + 0.5 * x, 1.0 + 1.5 * (y + 1.0));
                shader.eval_reference(uv, wi, wo).x
            };
            let angles = |x: f64, y: f64| match mapping {
                Mapping::Linear => [y * u_max, x * FRAC_PI_2],
                Mapping::Arcsine => [(y * u_max.sin()).asin(), x.asin()],
            };
            let highlight = |[u, v]: [f64; 2]| match (psi == 0.0, mapping) {
                (false, Mapping::Linear) => v / FRAC_PI_2,
                (false, Mapping::Arcsine) => v.sin(),
                (true, Mapping::Linear) => u / u_max,
                (true, Mapping::Arcsine) => u.sin() / u_max.sin(),
            };
            // In the direction across the line the window is 2δ wide, all of one brightness.
            let count = 4000;
            let at = |k: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(count) - 1.0;
            let profile: Vec<f64> = (0..count)
                .map(|k| if psi == 0.0 { f(a, at(k), wi) } else { f(at(k), b, wi) })
                .collect();
            let lit: Vec<usize> = (0..profile.len()).filter(|&k| profile[k] > 0.0).collect();
            if let [first, .., last] = lit[..] {
                lit_lines += 1;
                let width = lit.len() as f64 * 2.0 / f64::from(count);
                assert_eq!(
                    last - first + 1,
                    lit.len(),
                    "ψ {psi} {mapping:?} wi {wi} wo {wo}: gaps"
                );
                assert!(
                    (width - 2.0 * delta).abs() < 3.0 / f64::from(count),
                    "ψ {psi} {mapping:?} at {a} {b} wi {wi} wo {wo}: width {width}, expected {}",
                    2.0 * delta
                );
                let spread = profile[first] / profile[(first + last) / 2] - 1.0;
                assert!(spread.abs() < 1e-9, "ψ {psi} {mapping:?} wi {wi} wo {wo}: {spread}");
            }
            // From one direction to another: wherever it jumps, the window has an edge, or the
            // highlight comes to the edge of the yarn.
            let towards = |t: f64| wi.lerp(other, t).normalize();
            let steps = 2000;
            for k in 0..steps {
                let [from, to] = [k, k + 1].map(|k| towards(f64::from(k) / f64::from(steps)));
                let (before, after) = (f(a, b, from), f(a, b, to));
                if (before > 0.0) == (after > 0.0) {
                    // A tenth is more than it changes smoothly in so short a step.
                    let change = (before - after).abs() / before.max(1e-12);
                    let is_near_end = [from, to].iter().any(|&w| {
                        root(psi, u_max, angles(a, b), w, wo)
                            .is_none_or(|(_, margin)| margin < 0.05)
                    });
                    assert!(
                        change < 0.1 || before < 1e-9 || is_near_end,
                        "ψ {psi} {mapping:?} at {a} {b} wi {from} to {to} wo {wo}: {before} to {after}"
                    );
                    continue;
                }
                jumps += 1;
                let is_edge = [from, to].iter().any(|&w| {
                    let Some((place, margin)) = root(psi, u_max, angles(a, b), w, wo) else {
                        return true;
                    };
                    let centre = highlight(place).clamp(-1.0 + delta, 1.0 - delta);
                    let own = if psi == 0.0 { b } else { a };
                    margin < 0.05 || ((centre - own).abs() - delta).abs() < 0.05
                });
                assert!(
                    is_edge,
                    "ψ {psi} {mapping:?} at {a} {b} wi {from} to {to} wo {wo}: {before} to {after}"
                );
            }
        }
        println!("ψ {psi} {mapping:?}: {lit_lines} windows, {jumps} edges crossed");
        assert!(lit_lines > 50 && jumps > 50, "ψ {psi}: {lit_lines} windows, {jumps} jumps");
    }
}

#[test]
fn nothing_appears_at_the_horizon() {
    for yarn in yarns() {
        let shader = prepared(&woven(&yarn, [1, 1], twill));
        let mut random = Random(8);
        let mut greatest = [0.0f64; 2];
        for _ in 0..20_000 {
            let uv = random.position(20.0);
            let wo = random.direction();
            let phi = random.between(0.0, TAU);
            for side in [1.0, -1.0] {
                let radiance = [1e-2, 1e-7].map(|z| {
                    let [wi, wo] = [direction(z, phi), wo].map(|w| w.with_z(side * w.z));
                    shader.eval_reference(uv, wi, wo).max_element() * z
                });
                greatest = [greatest[0].max(radiance[0]), greatest[1].max(radiance[1])];
            }
        }
        println!("reflected from 0.6° and 6e-6° above the horizon: at most {greatest:?}");
        assert!(greatest[1] < 1e-4 * greatest[0], "{greatest:?}: {yarn:?}");
    }
}
