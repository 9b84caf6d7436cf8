//! What a renderer sees of a shader: precision, reciprocity, sides, repeats, gaps.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use core::f64::consts::{FRAC_PI_2, PI};

use selvedge_yarn_brdf::glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{
    Combination, Diffuse, Highlight, Mapping, Noise, Phase, PhaseTable, Shader, Thread, Weave, Yarn,
};

#[allow(dead_code, reason = "the part of a program that is no study")]
#[path = "../examples/precision.rs"]
mod precision;

use precision::support::{PITCH, Random, cloth};

fn yarns() -> Vec<Yarn> {
    let d = Yarn::default;
    let table = PhaseTable::new(&[0.1, 0.2, 0.1, 0.6]).unwrap();
    vec![
        d(),
        Yarn { psi: -0.35, u_max: 1.2, highlight: Highlight::Window { delta: 0.8 }, ..d() },
        Yarn { psi: 0.0, u_max: 0.8, smoothing: 0.4, kappa: 2.0, ..d() },
        Yarn { psi: 1.5, u_max: 0.1, phase: Phase::VonMises { alpha: 0.0, beta: 40.0 }, ..d() },
        Yarn { psi: 0.05, phase: Phase::VonMises3d { alpha: 0.1, beta: 2.0 }, ..d() },
        Yarn { highlight: Highlight::Rough { sigma: 0.1 }, diffuse: Diffuse::YarnNormal, ..d() },
        Yarn {
            phase: Phase::WrappedCauchy { rho: 0.9, is_backward: true },
            noise: Noise { intensity: 1.0, u_max: 0.2, width: 0.3, color: 0.5, ..Noise::default() },
            ..d()
        },
        Yarn { phase: Phase::Tabulated(table), psi: -FRAC_PI_2, kappa: -0.5, size: 0.7, ..d() },
    ]
}

/// Every yarn in a twill, with one mapping and combination or the other.
fn shaders() -> impl Iterator<Item = (Yarn, Shader)> {
    yarns().into_iter().enumerate().map(|(k, yarn)| {
        let mut cloth = cloth(&yarn, 3);
        cloth.mapping = if k % 2 == 0 { Mapping::Arcsine } else { Mapping::Linear };
        cloth.combination = if k % 3 == 0 { Combination::Lerp } else { Combination::Layered };
        let shader = cloth.prepare().unwrap();
        (yarn, shader)
    })
}

#[test]
fn single_precision_agrees_with_the_reference() {
    let missed = precision::print(precision::study(200_000));
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn eval_is_reciprocal() {
    let mut random = Random(1);
    for (yarn, shader) in shaders() {
        for _ in 0..4000 {
            let (uv, wi, wo) = (random.position(4.0), random.direction(), random.direction());
            let there = shader.eval_reference(uv, wi, wo);
            let back = shader.eval_reference(uv, wo, wi);
            let tolerance = 1e-12 * there.max_element();
            assert!(
                (there - back).abs().max_element() <= tolerance,
                "{yarn:?} at {uv}, {wi} to {wo}: {there}, reversed {back}, tolerance {tolerance:e}"
            );
            let (wi, wo) = (wi.as_vec3(), wo.as_vec3());
            let there = shader.eval(uv, wi, wo);
            let back = shader.eval(uv, wo, wi);
            let tolerance = 1e-5 * there.max_element();
            assert!(
                (there - back).abs().max_element() <= tolerance,
                "{yarn:?} at {uv}, {wi} to {wo}: {there}, reversed {back}, tolerance {tolerance:e}"
            );
        }
    }
}

#[test]
fn lobes_add_up_and_are_finite() {
    let mut random = Random(2);
    for (yarn, shader) in shaders() {
        for _ in 0..4000 {
            let uv = random.position(4.0);
            let (wi, wo) = (random.direction().as_vec3(), random.direction().as_vec3());
            let (f, lobes) = (shader.eval(uv, wi, wo), shader.eval_lobes(uv, wi, wo));
            assert_eq!(f, lobes.specular + lobes.diffuse, "{yarn:?} at {uv}, {wi} to {wo}");
            let least = lobes.specular.min(lobes.diffuse).min_element();
            assert!(f.is_finite() && least >= 0.0, "{yarn:?} at {uv}, {wi} to {wo}: {lobes:?}");
        }
    }
}

#[test]
fn cloth_without_noise_repeats_at_any_distance() {
    // A pitch that is a power of two scales positions without rounding.
    let pitch = 1.0 / 128.0;
    let yarn = Yarn { size: 0.8, ..Yarn::default() };
    let mut cloth = cloth(&yarn, 3);
    cloth.pitch = DVec2::splat(pitch);
    let shader = cloth.prepare().unwrap();
    let mut random = Random(3);
    for _ in 0..2000 {
        let cells = 4.0 * DVec2::new(random.number(), random.number());
        // Eighths of a cell are exact in f64 at this distance.
        let uv = pitch * ((cells * 4.0).floor() / 4.0 + 0.125);
        let far = uv + pitch * DVec2::new(4.0 * 1e9, -4.0 * 1e9);
        let (wi, wo) = (random.direction().as_vec3(), random.direction().as_vec3());
        assert_eq!(shader.eval(uv, wi, wo), shader.eval(far, wi, wo), "{uv}");
        assert_eq!(shader.opacity(uv), shader.opacity(far), "{uv}");
    }
}

#[test]
fn back_shows_the_other_thread_of_each_crossing() {
    let red = Thread { color: [1.0, 0.0, 0.0], pitch: Some(PITCH), ..Thread::default() };
    let blue = Thread { color: [0.0, 0.0, 1.0], ..red };
    let weave = Weave::new(3, 2, |end, pick| end == 0 && pick == 0).unwrap();
    let yarn = Yarn::default();
    let cloth = selvedge_yarn_brdf::Cloth::from_threads(weave, &[red; 3], &[blue; 2], &yarn);
    let shader = cloth.unwrap().prepare().unwrap();
    for end in 0..3 {
        for pick in 0..2 {
            let uv = PITCH * DVec2::new(f64::from(end) + 0.5, f64::from(pick) + 0.5);
            let front = shader.eval(uv, Vec3::Z, Vec3::Z);
            let back = shader.eval(uv, -Vec3::Z, -Vec3::Z);
            assert_eq!(front.x > front.z, end == 0 && pick == 0, "end {end}, pick {pick}");
            assert_eq!(back.x > back.z, front.x < front.z, "end {end}, pick {pick}");
        }
    }
}

#[test]
fn turned_cloth_is_the_cloth_seen_from_another_side() {
    let mut cloth = cloth(&Yarn::default(), 3);
    let straight = cloth.prepare().unwrap();
    let mut random = Random(4);
    for angle in [0.3, -2.0, FRAC_PI_2, PI] {
        cloth.rotation = angle;
        let turned = cloth.prepare().unwrap();
        // From the weave to the turned surface.
        let turn = DVec2::from_angle(-angle);
        for _ in 0..500 {
            let (uv, wi, wo) = (random.position(4.0), random.direction(), random.direction());
            let there = |w: DVec3| turn.rotate(w.truncate()).extend(w.z);
            let expected = straight.eval_reference(uv, wi, wo);
            let found = turned.eval_reference(turn.rotate(uv), there(wi), there(wo));
            let tolerance = 1e-9 * expected.max_element();
            assert!(
                (found - expected).abs().max_element() <= tolerance,
                "{angle} at {uv}, {wi} to {wo}: {found}, expected {expected}, tolerance {tolerance:e}"
            );
        }
    }
}

#[test]
fn no_light_passes_through_or_comes_from_nowhere() {
    let shader = cloth(&Yarn { size: 0.5, ..Yarn::default() }, 3).prepare().unwrap();
    let up = Vec3::new(0.1, 0.2, 0.97).normalize();
    let on_yarn = PITCH * DVec2::new(1.5, 0.5);
    assert!(shader.eval(on_yarn, up, Vec3::Z).min_element() > 0.0);
    assert_eq!(shader.eval(on_yarn, up, -Vec3::Z), Vec3::ZERO);
    assert_eq!(shader.eval(on_yarn, Vec3::X, Vec3::Z), Vec3::ZERO);
    let corner = PITCH * DVec2::new(1.01, 1.01);
    assert_eq!((shader.opacity(corner), shader.opacity(on_yarn)), (0.0, 1.0));
    assert_eq!(shader.eval(corner, up, Vec3::Z), Vec3::ZERO);
    for bad in [f32::NAN, f32::INFINITY, f32::MAX] {
        let bad = Vec3::new(bad, 0.0, 1.0);
        assert_eq!(shader.eval(on_yarn, bad, up), Vec3::ZERO, "{bad}");
        assert_eq!(shader.eval(on_yarn, up, bad), Vec3::ZERO, "{bad}");
    }
    assert_eq!(shader.eval(DVec2::new(f64::NAN, 0.0), up, up), Vec3::ZERO);
    assert!(shader.eval(DVec2::splat(1e300), up, up).is_finite());
}

#[test]
fn shader_is_shared_between_threads() {
    fn assert_shared<T: Send + Sync>() {}
    assert_shared::<Shader>();
}
