//! White furnace: no yarn reflects more than it receives, and white cloth all of it.

use core::f64::consts::PI;
use std::sync::Arc;

use rayon::prelude::*;
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, DVec3};
use selvedge_yarn_brdf::{
    Combination, Diffuse, Highlight, Mode, Noise, Phase, Target, Texture, Textured, Yarn,
};

#[path = "support/furnace.rs"]
mod furnace;
#[path = "support/yarns.rs"]
mod yarns;
use furnace::{CHECK, furnished, greatest, reflected_by_white};
use yarns::{PITCH, USUAL, cloth, direction, on_end, yarn};

/// The greatest of some numbers, with what it belongs to.
fn worst(numbers: impl ParallelIterator<Item = (f64, String)>) -> (f64, String) {
    numbers.max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are some")
}

#[test]
fn no_segment_reflects_more_than_it_receives() {
    let cases = (0..60).map(|i| (7 * i, Combination::Layered));
    let cases = cases.chain((0..30).map(|i| (14 * i + 3, Combination::Lerp)));
    let cases: Vec<_> = cases.collect();
    let found = worst(cases.into_par_iter().map(|(i, how)| greatest(i, Mode::Segment, how)));
    println!("{}", found.1);
    assert!(found.0 <= 1.0 + CHECK, "{}, expected at most 1 + {CHECK}", found.1);
}

#[test]
fn no_point_reflects_more_than_it_receives() {
    let cases = (0..90u32).into_par_iter();
    let found = worst(cases.map(|i| greatest(7 * i + 1, Mode::Pointwise, Combination::Lerp)));
    println!("{}", found.1);
    assert!(found.0 <= 1.0 + CHECK, "{}, expected at most 1 + {CHECK}", found.1);
}

/// A ramp along the weft, of a period that no cloth has.
#[derive(Debug)]
struct Ramp(f32, f32);

impl Texture for Ramp {
    fn value(&self, uv: DVec2, _footprint: f64) -> [f32; 3] {
        [self.0 + (self.1 - self.0) * (uv.x / (7.3 * PITCH)).fract() as f32; 3]
    }

    fn range(&self) -> [f32; 2] {
        [self.0, self.1]
    }
}

#[test]
fn no_texture_or_noise_makes_a_yarn_reflect_more_than_it_receives() {
    let base = Yarn { color: [1.0; 3], specular: [1.0; 3], ..Yarn::default() };
    let rough = Highlight::Rough { sigma: 0.1 };
    let noise = |u_max, intensity| Noise { u_max, intensity, ..Noise::default() };
    let ramp = |name, low, high| (Target::Parameter(name), Ramp(low, high));
    let cases = vec![
        (Yarn { noise: noise(0.3, 0.0), ..base.clone() }, vec![]),
        (Yarn { noise: noise(0.5, 1.0), psi: 0.0, highlight: rough, ..base.clone() }, vec![]),
        (Yarn { noise: noise(0.2, 0.0), psi: 0.0, u_max: 0.2, ..base.clone() }, vec![]),
        (base.clone(), vec![ramp("psi", -1.0, 1.5)]),
        (base.clone(), vec![ramp("delta", 0.05, 0.9), ramp("beta", 0.5, 60.0)]),
        (Yarn { highlight: rough, ..base.clone() }, vec![ramp("sigma", 0.02, 0.6)]),
        (
            Yarn { diffuse: Diffuse::YarnNormal, ..base.clone() },
            vec![ramp("u_max", 0.1, 1.3), ramp("kappa", -0.6, 3.0)],
        ),
    ];
    for mode in [Mode::Segment, Mode::Pointwise] {
        let found = worst(cases.par_iter().map(|(yarn, ramps)| {
            let mut cloth = cloth(&vec![yarn.clone(); 3]);
            cloth.normalization = mode;
            for end in 0..3 {
                cloth.textures.extend(ramps.iter().map(|(target, Ramp(low, high))| Textured {
                    yarn: end,
                    target: *target,
                    texture: Arc::new(Ramp(*low, *high)),
                }));
            }
            let shader = cloth.prepare().expect("every parameter is in range");
            let shares = (0..120u32).map(|j| {
                let [x, y] = Halton::<2>::new().point((j + 1).try_into().expect("not 0"));
                let (uv, wo) = (30.0 * PITCH * DVec2::new(x, y), direction(j));
                let albedo = match mode {
                    Mode::Pointwise => shader.albedo_at(uv, wo),
                    Mode::Segment | Mode::None => shader.albedo_of_segment(uv, wo),
                };
                (albedo.max_element(), format!("{mode:?} {ramps:?} at {uv} for {wo}, {yarn:?}"))
            });
            shares.max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are some")
        }));
        println!("{}: {}", found.0, found.1);
        assert!(found.0 <= 1.0 + CHECK, "{}: {}, at most 1 + {CHECK}", found.1, found.0);
    }
}

/// For ψ from −π/2 to π/2, u_max to 1.5, κ from −0.9 to 10, all phase functions with β to 200 and ρ to
/// 0.95, windows and roughness from 0.02 to 1.
#[test]
fn white_cloth_reflects_all_whatever_the_share_of_the_highlight() {
    let found: Vec<_> =
        (0..48u32).into_par_iter().map(|i| reflected_by_white(11 * i + 2, 6)).collect();
    for [least, greatest] in found {
        assert!(least.0 >= 0.99, "{}, expected 0.99 to 1.01", least.1);
        assert!(greatest.0 <= 1.0 + CHECK, "{}, expected at most 1 + {CHECK}", greatest.1);
    }
}

/// The quadratures against plain sums of `eval_reference` itself over directions, and over the segment.
#[test]
fn albedo_is_the_integral_of_eval() {
    let mild = |i: u32| {
        let phase = match yarn(i, &USUAL).phase {
            Phase::VonMises { alpha, .. } => Phase::VonMises { alpha, beta: 3.0 },
            Phase::VonMises3d { .. } => Phase::VonMises3d { alpha: 0.1, beta: 2.0 },
            Phase::WrappedCauchy { is_backward, .. } => {
                Phase::WrappedCauchy { rho: 0.4, is_backward }
            }
            other => other,
        };
        let highlight = match yarn(i, &USUAL).highlight {
            Highlight::Window { .. } => Highlight::Window { delta: 0.5 },
            Highlight::Rough { sigma } => Highlight::Rough { sigma: sigma.max(0.2) },
        };
        Yarn { phase, highlight, ..furnished(i) }
    };
    let cases: Vec<(u32, bool)> =
        (0..9).flat_map(|k| [(5 * k + 2, false), (5 * k + 2, true)]).collect();
    cases.into_par_iter().for_each(|(i, is_mean)| {
        let yarn = Yarn { size: 1.0, ..mild(i) };
        let shader = cloth(&vec![yarn.clone(); 3]).prepare().expect("every parameter is in range");
        let (uv, wo) = (on_end(1, 3, 0.4, 0.2), direction(3 * i));
        let n = 2_000_000;
        let sum: DVec3 = Halton::<4>::new()
            .points_from(1.try_into().expect("not 0"))
            .take(n)
            .map(|[a, b, c, d]| {
                let wi = square_to_cosine_hemisphere(DVec2::new(a, b));
                // The float of the end 1 of 3 begins at the pick 0 and is two cells long.
                let mean = PITCH * DVec2::new(1.0 + c, 2.0 * d);
                shader.eval_reference(if is_mean { mean } else { uv }, wi, wo)
            })
            .sum();
        let expected = PI * sum / n as f64;
        let found =
            if is_mean { shader.albedo_of_segment(uv, wo) } else { shader.albedo_at(uv, wo) };
        let error = (found - expected).abs().max_element();
        assert!(
            error < 2e-3,
            "{yarn:?} for {wo}, mean {is_mean}: {found}, expected {expected} within 2e-3"
        );
    });
}
