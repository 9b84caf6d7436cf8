//! What a renderer sees of a shader: precision, reciprocity, sides, repeats, gaps.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use rayon::prelude::*;
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_uniform_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{Cloth, Mapping, Phase, Shader, Thread, Weave, Yarn};

/// m, a power of two so that positions scale without rounding.
const PITCH: f64 = 1.0 / 128.0;

const GREY: Thread = Thread { color: [0.4, 0.3, 0.2], pitch: Some(PITCH), diameter: None };

fn yarns() -> Vec<Yarn> {
    let d = Yarn::default();
    vec![
        d,
        Yarn { psi: -0.35, u_max: 1.2, delta: 0.8, ..d },
        Yarn { psi: 0.0, u_max: 0.8, ..d },
        Yarn { psi: 1.5, u_max: 0.1, phase: Phase::VonMises { alpha: 0.0, beta: 40.0 }, ..d },
        Yarn { psi: 0.05, phase: Phase::VonMises { alpha: 0.5, beta: 0.0 }, ..d },
    ]
}

fn shader(yarn: Yarn, mapping: Mapping, size: f64) -> Shader {
    let weave = Weave::new(5, 5, |end, pick| (2 * pick + end) % 5 != 0).unwrap();
    let thread = Thread { diameter: Some(size * PITCH), ..GREY };
    let mut cloth = Cloth::from_threads(weave, &[thread; 5], &[thread; 5], yarn).unwrap();
    cloth.mapping = mapping;
    cloth.prepare().unwrap()
}

/// Position and two directions, the i-th of many.
fn tuple(i: u32) -> (DVec2, Vec3, Vec3) {
    let [a, b, c, d, e, f] = Halton::<6>::new().point((i + 1).try_into().unwrap());
    let wi = square_to_uniform_hemisphere(DVec2::new(c, d)).as_vec3();
    let wo = square_to_uniform_hemisphere(DVec2::new(e, f)).as_vec3();
    (5.0 * PITCH * DVec2::new(a, b), wi, wo)
}

/// 10⁵ random inputs over five yarns and both mappings, f32 against f64 of the same inputs.
#[test]
fn single_precision_agrees_with_the_reference() {
    let mut errors = Vec::new();
    let mut flips = 0;
    for (k, yarn) in yarns().into_iter().enumerate() {
        for (m, mapping) in [Mapping::Arcsine, Mapping::Linear].into_iter().enumerate() {
            let shader = shader(yarn, mapping, 0.9);
            let found: Vec<(f64, bool)> = (0..10_000)
                .into_par_iter()
                .filter_map(|i| {
                    let (uv, wi, wo) = tuple(i + 10_000 * (2 * k as u32 + m as u32));
                    let single = shader.eval(uv, wi, wo).as_dvec3();
                    let double = shader.eval_reference(uv, wi.as_dvec3(), wo.as_dvec3());
                    assert!(single.is_finite() && double.is_finite(), "{yarn:?} {uv} {wi} {wo}");
                    assert!(single.min_element() >= 0.0, "{yarn:?} {uv} {wi} {wo}: {single}");
                    if double.x == 0.0 {
                        assert_eq!(single, DVec3::ZERO, "{yarn:?} {uv} {wi} {wo}");
                        return None;
                    }
                    let error = (single.x / double.x - 1.0).abs();
                    // At the edge of the window or of the yarn the highlight switches on and off:
                    // an input moved by rounding falls on the other side.
                    let is_flip = error > 1e-3 && is_at_an_edge(&shader, uv, wi, wo);
                    Some((error, is_flip))
                })
                .collect();
            flips += found.iter().filter(|&&(_, is_flip)| is_flip).count();
            errors.extend(found.iter().filter(|&&(_, is_flip)| !is_flip).map(|&(error, _)| error));
        }
    }
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
    let (median, p999, worst) = (at(0.5), at(0.999), at(1.0));
    println!(
        "f32 against f64, {} values: median {median:.2e}, 99.9 % {p999:.2e}, worst {worst:.2e}, \
         {flips} at an edge",
        errors.len()
    );
    assert!(errors.len() > 70_000, "{} values", errors.len());
    assert!(median <= 2e-7 && p999 <= 1e-5 && worst <= 1e-3, "{median:e} {p999:e} {worst:e}");
    assert!(flips <= 5, "{flips} flips");
}

/// Whether the reference itself switches when the inputs move by a few units of f32 rounding.
fn is_at_an_edge(shader: &Shader, uv: DVec2, wi: Vec3, wo: Vec3) -> bool {
    let value = |delta: DVec3, wi: Vec3| {
        shader.eval_reference(uv, (wi.as_dvec3() + delta).normalize(), wo.as_dvec3()).x
    };
    let nudge = 1e-6;
    let values: Vec<f64> = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z]
        .into_iter()
        .map(|axis| value(nudge * axis, wi))
        .collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(0.0, f64::max);
    greatest > 1.001 * least
}

#[test]
fn eval_is_reciprocal() {
    for yarn in yarns() {
        let shader = shader(yarn, Mapping::Arcsine, 1.0);
        for i in 0..4000 {
            let (uv, wi, wo) = tuple(i);
            let (wi, wo) = (wi.as_dvec3(), wo.as_dvec3());
            let there = shader.eval_reference(uv, wi, wo);
            let back = shader.eval_reference(uv, wo, wi);
            assert!(
                (there - back).abs().max_element() <= 1e-12 * there.max_element(),
                "{yarn:?} at {uv}, {wi} to {wo}: {there}, reversed {back}"
            );
        }
    }
}

#[test]
fn cloth_repeats_and_shows_its_other_side_mirrored() {
    let shader = shader(Yarn::default(), Mapping::Arcsine, 0.8);
    for i in 0..2000 {
        let (uv, wi, wo) = tuple(i);
        // Quarters of a cell are exact in f64 at this distance.
        let uv = PITCH * ((uv / PITCH * 4.0).floor() / 4.0 + 0.125);
        let far = uv + PITCH * DVec2::new(5.0 * 1e9, -5.0 * 1e9);
        assert_eq!(shader.eval(uv, wi, wo), shader.eval(far, wi, wo), "{uv}");
        assert_eq!(shader.opacity(uv), shader.opacity(far), "{uv}");
    }
    // Where the face shows the pick, the back shows the end, and the other way round.
    let red = Thread { color: [1.0, 0.0, 0.0], ..GREY };
    let blue = Thread { color: [0.0, 0.0, 1.0], ..GREY };
    let weave = Weave::new(3, 2, |end, pick| end == 0 && pick == 0).unwrap();
    let cloth = Cloth::from_threads(weave, &[red; 3], &[blue; 2], Yarn::default()).unwrap();
    let shader = cloth.prepare().unwrap();
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
fn no_light_passes_through_or_comes_from_nowhere() {
    let shader = shader(Yarn::default(), Mapping::Arcsine, 0.5);
    let up = Vec3::new(0.1, 0.2, 0.97).normalize();
    let on_yarn = PITCH * DVec2::new(1.5, 0.5);
    assert!(shader.eval(on_yarn, up, Vec3::Z).min_element() > 0.0);
    assert_eq!(shader.eval(on_yarn, up, -Vec3::Z), Vec3::ZERO);
    assert_eq!(shader.eval(on_yarn, Vec3::X, Vec3::Z), Vec3::ZERO);
    let corner = PITCH * DVec2::new(1.01, 1.01);
    assert_eq!((shader.opacity(corner), shader.opacity(on_yarn)), (0.0, 1.0));
    assert_eq!(shader.eval(corner, up, Vec3::Z), Vec3::ZERO);
    for bad in [f32::NAN, f32::INFINITY] {
        let bad = Vec3::new(bad, 0.0, 1.0);
        assert_eq!(shader.eval(on_yarn, bad, up), Vec3::ZERO);
        assert_eq!(shader.eval(on_yarn, up, bad), Vec3::ZERO);
    }
    assert_eq!(shader.eval(DVec2::new(f64::NAN, 0.0), up, up), Vec3::ZERO);
    assert!(shader.eval(DVec2::splat(1e300), up, up).is_finite());
}

#[test]
fn shader_is_shared_between_threads() {
    fn assert_shared<T: Send + Sync>() {}
    assert_shared::<Shader>();
}
