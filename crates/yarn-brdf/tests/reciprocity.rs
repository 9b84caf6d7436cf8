//! Swapping light and viewer changes nothing, whatever the yarn is and however irregular.

use std::sync::Arc;

use rayon::prelude::*;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{
    Combination, Diffuse, Highlight, Mapping, Mode, Noise, Phase, PhaseTable, Target, Texture,
    Textured, Yarn,
};

mod support;
use support::{PITCH, Random, cloth};

/// A texture that changes everywhere, between two limits.
#[derive(Debug)]
struct Waves([f32; 2]);

impl Texture for Waves {
    fn value(&self, uv: DVec2, _footprint: f64) -> [f32; 3] {
        let [low, high] = self.0;
        [1.0, 1.7, 2.3].map(|k| {
            let wave = (k * uv.x / PITCH).sin() * (0.7 * k * uv.y / PITCH).cos();
            low + (high - low) * (0.5 + 0.5 * wave as f32)
        })
    }

    fn range(&self) -> [f32; 2] {
        self.0
    }
}

/// Every highlight and every phase function, both kinds of diffuse and all irregularities.
fn yarns() -> Vec<Yarn> {
    let samples = PhaseTable::new(&[0.5, 0.1, 0.0, 0.7, 2.0]).expect("samples are positive");
    let phases = [
        Phase::VonMises { alpha: 0.05, beta: 4.0 },
        Phase::VonMises { alpha: 0.0, beta: 100.0 },
        Phase::VonMises3d { alpha: 0.1, beta: 30.0 },
        Phase::WrappedCauchy { rho: 0.67, is_backward: false },
        Phase::WrappedCauchy { rho: 0.99, is_backward: true },
        Phase::Tabulated(samples),
    ];
    let window = |delta| Highlight::Window { delta };
    let rough = |sigma| Highlight::Rough { sigma };
    let noise = Noise {
        intensity: 0.8,
        width: 0.3,
        offset: 0.2,
        wavelength: 3e-3,
        slub_rate: 50.0,
        slub_height: 0.5,
        color: 0.3,
        ..Noise::default()
    };
    let base = Yarn {
        color: [0.5, 0.3, 0.2],
        specular: [0.6, 0.7, 0.8],
        specular_uniform: Some([0.2, 0.3, 0.1]),
        kappa: -0.4,
        size: 0.8,
        noise,
        ..Yarn::default()
    };
    let highlights = [
        (window(0.3), 0.5),
        (window(0.05), -0.031),
        (window(1.0), core::f64::consts::FRAC_PI_2),
        (window(0.2), 0.0),
        (rough(0.15), 0.5),
        (rough(0.005), 0.0),
        (rough(1.0), -1.0),
    ];
    let mut yarns = Vec::new();
    for (i, (highlight, psi)) in highlights.into_iter().enumerate() {
        // A third of all pairs: each phase function with at least two highlights.
        for (j, phase) in phases.iter().enumerate().filter(|(j, _)| (i + j) % 3 == 0) {
            let diffuse = [Diffuse::Flat, Diffuse::YarnNormal][i % 2];
            let smoothing = [0.0, 0.5][j / 3];
            let phase = phase.clone();
            yarns.push(Yarn { highlight, psi, phase, diffuse, smoothing, ..base.clone() });
        }
    }
    yarns
}

#[test]
fn brdf_is_reciprocal_with_every_irregularity_on_both_sides() {
    let texture =
        |yarn, target, low, high| Textured { yarn, target, texture: Arc::new(Waves([low, high])) };
    let worst = yarns()
        .into_par_iter()
        .enumerate()
        .map(|(i, yarn)| {
            let mut cloth = cloth(&yarn, 1 + (i % 3) as u32);
            cloth.mapping = [Mapping::Arcsine, Mapping::Linear][i % 2];
            cloth.combination = [Combination::Layered, Combination::Lerp][i / 2 % 2];
            cloth.normalization = [Mode::Segment, Mode::None, Mode::Pointwise][i % 3];
            cloth.rotation = 0.3;
            cloth.textures = vec![
                texture(0, Target::Color, 0.1, 0.9),
                texture(0, Target::Specular, 0.0, 1.0),
                texture(0, Target::Parameter("opacity"), 0.5, 1.0),
            ];
            // What reshapes the highlight is normalised over a range, which takes long.
            if i % 3 == 0 {
                cloth.textures.push(texture(0, Target::Parameter("u_max"), 0.1, 0.8));
                cloth.yarns[0].noise.u_max = 0.2;
            }
            let shader = cloth.prepare().expect("the yarns and textures are valid");
            let mut random = Random(i as u64);
            let mut worst = [0.0f64; 2];
            let mut lit = 0;
            for k in 0..20_000 {
                // Once in a while, grazing.
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let flat = if k % 10 == 0 { 1e-2 } else { 1.0 };
                let mut direction = || {
                    let w = random.direction();
                    w.with_z(w.z * flat).normalize().with_z(sign * w.z * flat).normalize()
                };
                let (wi, wo) = (direction(), direction());
                let uv = random.position(1000.0);
                let (there, back) =
                    (shader.eval_reference(uv, wi, wo), shader.eval_reference(uv, wo, wi));
                let scale = there.max_element().max(back.max_element()).max(1e-30);
                let error = (there - back).abs().max_element() / scale;
                assert!(
                    error <= 1e-12,
                    "f64: {there} and {back} differ by {error:e}, allowed 1e-12: uv {uv} wi {wi} \
                     wo {wo} {yarn:?}"
                );
                let (wi, wo): (Vec3, Vec3) = (wi.as_vec3(), wo.as_vec3());
                let (f, g) = (shader.eval(uv, wi, wo), shader.eval(uv, wo, wi));
                let scale = f.max_element().max(g.max_element()).max(1e-30);
                let error_single = (f - g).abs().max_element() / scale;
                assert!(
                    error_single <= 1e-5,
                    "f32: {f} and {g} differ by {error_single:e}, allowed 1e-5: uv {uv} wi {wi} \
                     wo {wo} {yarn:?}"
                );
                lit += u32::from(shader.eval_lobes(uv, wi, wo).specular != Vec3::ZERO);
                worst = [worst[0].max(error), worst[1].max(error_single.into())];
            }
            // The sharpest highlights are seen in few directions.
            assert!(lit > 0, "no highlight was seen: {yarn:?}");
            worst
        })
        .reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
    println!("greatest relative difference: f64 {:.1e}, f32 {:.1e}", worst[0], worst[1]);
}
