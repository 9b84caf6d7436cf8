//! Batches have the bits of single points.

use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{
    Batch, Cloth, Combination, Diffuse, Draws, Guides, Highlight, Instructions, Mapping, Mode,
    Noise, Phase, PhaseTable, Sample, Samples, Shader, Thread, Weave, Yarn, YarnPoints,
};

mod support;
use support::{PITCH, Random, direction};

/// A point and its directions.
#[derive(Clone, Copy, Debug)]
struct Point {
    uv: DVec2,
    wi: Vec3,
    wo: Vec3,
}

/// Points component by component.
#[derive(Default)]
struct Columns {
    uv: [Vec<f64>; 2],
    wi: [Vec<f32>; 3],
    wo: [Vec<f32>; 3],
}

impl Columns {
    fn of(points: &[Point]) -> Self {
        let mut columns = Self::default();
        for point in points {
            for axis in 0..2 {
                columns.uv[axis].push(point.uv[axis]);
            }
            for axis in 0..3 {
                columns.wi[axis].push(point.wi[axis]);
                columns.wo[axis].push(point.wo[axis]);
            }
        }
        columns
    }

    fn batch<'a>(&'a self, active: Option<&'a [bool]>) -> Batch<'a> {
        let Self { uv: [u, v], wi: [a, b, c], wo: [d, e, f] } = self;
        Batch { uv: [u, v], wi: [a, b, c], wo: [d, e, f], active }
    }
}

fn cloths() -> Vec<(String, Cloth)> {
    let d = Yarn::default;
    let rough = |sigma| Highlight::Rough { sigma };
    let window = |delta| Highlight::Window { delta };
    let table = PhaseTable::new(&[0.5, 0.2, 0.1, 0.2, 1.0]).expect("samples are above 0");
    let shifting = Noise {
        width: 0.1,
        offset: 0.2,
        wavelength: 2e-3,
        slub_rate: 200.0,
        slub_length: 4e-3,
        slub_height: 0.5,
        ..Noise::default()
    };
    let yarns = [
        ("staple", d()),
        ("filament", Yarn { psi: 0.0, ..d() }),
        ("fading", Yarn { psi: 0.0, smoothing: 0.4, kappa: -0.7, ..d() }),
        ("rough", Yarn { highlight: rough(0.15), ..d() }),
        ("table", Yarn { highlight: rough(0.6), phase: Phase::Tabulated(table), ..d() }),
        ("steep", Yarn { u_max: 1.4, psi: -1.2, kappa: 2.0, highlight: window(0.7), ..d() }),
        ("spatial", Yarn { phase: Phase::VonMises3d { alpha: 0.05, beta: 4.0 }, ..d() }),
        ("cauchy", Yarn { phase: Phase::WrappedCauchy { rho: 0.67, is_backward: true }, ..d() }),
        ("normal", Yarn { diffuse: Diffuse::YarnNormal, ..d() }),
        ("diffuse", Yarn { specular: [0.0; 3], ..d() }),
        ("noise", Yarn { noise: Noise { intensity: 0.8, ..Noise::default() }, ..d() }),
        ("lightness", Yarn { noise: Noise { color: 0.6, ..Noise::default() }, ..d() }),
        ("moving", Yarn { noise: Noise { width: 0.3, ..Noise::default() }, size: 0.8, ..d() }),
        ("shifting", Yarn { noise: shifting, size: 0.7, ..d() }),
    ];
    let mut cloths = Vec::new();
    for (name, yarn) in &yarns {
        let cloth = cloth(std::slice::from_ref(yarn));
        cloths.push((name.to_string(), cloth.clone()));
        let thin = Yarn { size: 0.7, ..yarn.clone() };
        let mut gaps = Cloth { mapping: Mapping::Linear, rotation: 0.3, ..self::cloth(&[thin]) };
        gaps.pitch.y *= 3.0;
        cloths.push((format!("{name}, gaps"), gaps));
        cloths.push((
            format!("{name}, lerp"),
            Cloth { combination: Combination::Lerp, normalization: Mode::None, ..cloth },
        ));
    }
    let mixed: Vec<Yarn> = yarns
        .iter()
        .enumerate()
        .map(|(k, (_, yarn))| Yarn { color: [0.07 * k as f32, 0.5, 0.2], ..yarn.clone() })
        .collect();
    cloths.push(("mixed".into(), cloth(&mixed)));
    let still: Vec<Yarn> = mixed[..8]
        .iter()
        .enumerate()
        .map(|(k, yarn)| Yarn { size: 0.5 + 0.06 * k as f64, ..yarn.clone() })
        .collect();
    cloths.push(("mixed, gaps".into(), cloth(&still)));
    let mut hidden = still;
    (hidden[0].opacity, hidden[3].opacity) = (0.0, 0.5);
    cloths.push(("mixed, hidden".into(), cloth(&hidden)));
    cloths
}

/// A cloth with floats of several lengths and threads that are never covered.
fn cloth(yarns: &[Yarn]) -> Cloth {
    let weave = Weave::new(13, 11, |end, pick| match (end, pick) {
        (4, _) => true,
        (_, 7) => false,
        _ => (end * end + 3 * pick) % 5 < 3,
    });
    let thread = Thread { color: [0.4, 0.3, 0.2], pitch: Some(PITCH), ..Thread::default() };
    let weave = weave.expect("13 by 11");
    let mut cloth = Cloth::from_threads(weave, &[thread; 13], &[thread; 11], &yarns[0])
        .expect("as many threads as the weave has");
    let of_thread = |k: usize| (k * 5 % yarns.len()) as u16;
    cloth.yarns = yarns.to_vec();
    cloth.end_yarns = (0..13).map(of_thread).collect();
    cloth.pick_yarns = (13..24).map(of_thread).collect();
    cloth
}

/// Points all over the cloth and far from it, on both sides and on none.
fn points(random: &mut Random, count: usize) -> Vec<Point> {
    let mut special = 0;
    (0..count)
        .map(|_| {
            let mut number = || random.number();
            let reach = [1.0, 1.0, 1.0, 1e3, 1e9][(5.0 * number()) as usize];
            let cells = DVec2::new(number() - 0.5, number() - 0.5) * 40.0 * reach;
            let mut w = || direction(number(), core::f64::consts::TAU * number()).as_vec3();
            let mut point = Point { uv: cells * PITCH, wi: w(), wo: w() };
            special += 1;
            match special % 40 {
                3 => (point.wi, point.wo) = (-point.wi, -point.wo),
                5 | 8 => (point.wi.z, point.wo.z) = (-point.wi.z, -point.wo.z),
                13 => point.wi.z = -point.wi.z,
                17 => point.uv.x = f64::NAN,
                19 => point.uv.y = f64::INFINITY,
                21 => point.wo.y = f32::NAN,
                23 => point.wi.x = f32::INFINITY,
                29 => point.uv = (point.uv / PITCH).round() * PITCH,
                31 => point.uv = -0.0 * point.uv,
                37 => point.wi = Vec3::Z,
                _ => {}
            }
            point
        })
        .collect()
}

fn shaders() -> Vec<(String, Shader)> {
    let prepare = |(name, cloth): (String, Cloth)| (name, cloth.prepare().expect("valid"));
    cloths().into_iter().map(prepare).collect()
}

fn bits(colors: &[Vec<f32>; 3], k: usize) -> [u32; 3] {
    [0, 1, 2].map(|c| colors[c][k].to_bits())
}

#[test]
fn batches_have_the_bits_of_single_points_with_any_instructions() {
    let mut random = Random(1);
    for (name, mut shader) in shaders() {
        let points = points(&mut random, 3000);
        let columns = Columns::of(&points);
        let single: Vec<_> =
            points.iter().map(|point| shader.eval_lobes(point.uv, point.wi, point.wo)).collect();
        assert!(single.iter().filter(|lobes| lobes.diffuse.x > 0.0).count() > 1000, "{name}");
        for instructions in Instructions::available() {
            assert!(shader.use_instructions(instructions));
            let new = || [(); 3].map(|()| vec![f32::NAN; points.len()]);
            let (mut f, mut specular, mut diffuse) = (new(), new(), new());
            let batch = columns.batch(None);
            shader.eval_batch(&batch, f.each_mut().map(Vec::as_mut_slice)).expect("equal lengths");
            let [specular_out, diffuse_out] =
                [&mut specular, &mut diffuse].map(|c| c.each_mut().map(Vec::as_mut_slice));
            shader.eval_lobes_batch(&batch, specular_out, diffuse_out).expect("equal lengths");
            let mut pdf = vec![f32::NAN; points.len()];
            shader.pdf_batch(&batch, &mut pdf).expect("equal lengths");
            for (k, (point, lobes)) in points.iter().zip(&single).enumerate() {
                let of = |color: Vec3| color.to_array().map(f32::to_bits);
                let found = [bits(&specular, k), bits(&diffuse, k), bits(&f, k)];
                let expected =
                    [of(lobes.specular), of(lobes.diffuse), of(lobes.specular + lobes.diffuse)];
                assert_eq!(
                    found,
                    expected,
                    "{name} with {instructions:?} at {point:?}: {:?} {:?}, expected {lobes:?}",
                    specular.each_ref().map(|c| c[k]),
                    diffuse.each_ref().map(|c| c[k]),
                );
                let expected = shader.pdf(point.uv, point.wi, point.wo);
                assert_eq!(
                    pdf[k].to_bits(),
                    expected.to_bits(),
                    "{name} with {instructions:?} at {point:?}: {}, expected {expected}",
                    pdf[k]
                );
            }
        }
    }
}

#[test]
fn lobes_with_densities_and_opacities_are_those_of_single_points() {
    let mut random = Random(2);
    for (name, mut shader) in shaders() {
        let points = points(&mut random, 600);
        for instructions in Instructions::available() {
            assert!(shader.use_instructions(instructions));
            for count in [0, 1, 4, 16, 17, 40, 600] {
                let points = &points[..count];
                let columns = Columns::of(points);
                let new = || [(); 3].map(|()| vec![f32::NAN; count]);
                let (mut specular, mut diffuse) = (new(), new());
                let (mut pdf, mut opacity) = (vec![f32::NAN; count], vec![f32::NAN; count]);
                let batch = columns.batch(None);
                let [specular_out, diffuse_out] =
                    [&mut specular, &mut diffuse].map(|c| c.each_mut().map(Vec::as_mut_slice));
                shader
                    .eval_lobes_pdf_batch(&batch, specular_out, diffuse_out, &mut pdf)
                    .expect("equal lengths");
                shader.opacity_batch(batch.uv, &mut opacity).expect("equal lengths");
                for (k, &Point { uv, wi, wo, .. }) in points.iter().enumerate() {
                    let lobes = shader.eval_lobes(uv, wi, wo);
                    let of = |color: Vec3| color.to_array().map(f32::to_bits);
                    let found = (bits(&specular, k), bits(&diffuse, k), pdf[k], opacity[k]);
                    let pdf = shader.pdf(uv, wi, wo);
                    let expected = (of(lobes.specular), of(lobes.diffuse), pdf, shader.opacity(uv));
                    assert_eq!(found, expected, "{name} with {instructions:?} at {uv}");
                }
            }
        }
    }
}

#[test]
fn guides_are_those_of_single_points_and_tell_the_diffuse_nearly() {
    let mut random = Random(8);
    for (name, mut shader) in shaders() {
        let points = points(&mut random, 600);
        let columns = Columns::of(&points);
        let batch = columns.batch(None);
        for instructions in Instructions::available() {
            assert!(shader.use_instructions(instructions));
            let new = || [(); 3].map(|()| vec![f32::NAN; points.len()]);
            let (mut lobes, mut color, mut facing) = ([new(), new()], new(), new());
            let mut pdf = vec![f32::NAN; points.len()];
            let [specular, diffuse] =
                lobes.each_mut().map(|lobe| lobe.each_mut().map(Vec::as_mut_slice));
            let guides = Guides {
                color: color.each_mut().map(Vec::as_mut_slice),
                facing: facing.each_mut().map(Vec::as_mut_slice),
            };
            shader
                .eval_lobes_pdf_guide_batch(&batch, specular, diffuse, &mut pdf, guides)
                .expect("equal lengths");
            // Without densities.
            let mut again = [(); 4].map(|()| new());
            let mut is_lit = vec![f32::NAN; points.len()];
            let [specular, diffuse, color_again, facing_again] =
                again.each_mut().map(|part| part.each_mut().map(Vec::as_mut_slice));
            let guides = Guides { color: color_again, facing: facing_again };
            shader
                .eval_lobes_guide_batch(&batch, specular, diffuse, &mut is_lit, guides)
                .expect("equal lengths");
            let mut count = 0;
            for (k, &Point { uv, wi, wo, .. }) in points.iter().enumerate() {
                let with = [&lobes[0], &lobes[1], &color, &facing].map(|part| bits(part, k));
                let without = (again.each_ref().map(|part| bits(part, k)), is_lit[k] == 1.0);
                assert_eq!(without, (with, pdf[k] > 0.0), "{name} with {instructions:?} at {uv}");
                assert!(is_lit[k] == 1.0 || is_lit[k] == 0.0);
                let of = |color: Vec3| color.to_array().map(f32::to_bits);
                let single = shader.eval_lobes(uv, wi, wo);
                let found = (bits(&lobes[0], k), bits(&lobes[1], k), pdf[k]);
                let expected = (of(single.specular), of(single.diffuse), shader.pdf(uv, wi, wo));
                assert_eq!(found, expected, "{name} with {instructions:?} at {uv}");
                if pdf[k] == 0.0 {
                    let found = [bits(&color, k), bits(&facing, k)];
                    assert_eq!(found, [[0; 3]; 2], "{name} with {instructions:?} at {uv}");
                    continue;
                }
                let guide = shader.guide(uv, wo);
                let found = [bits(&color, k), bits(&facing, k)];
                assert_eq!(found, [of(guide.color), of(guide.facing)], "{name} at {uv}");
                let near = guide.diffuse(wi);
                let is_black = single.diffuse.max_element() < 1e-6;
                assert!(is_black || near.max_element() > 0.0, "{name} at {uv}: {near}");
                count += u32::from(!is_black);
                // Where no highlight takes any: that of flat yarn, times cos θi.
                if name == "diffuse" {
                    let off = (near / wi.z.abs() - single.diffuse).abs().max_element();
                    assert!(off <= 1e-6, "at {uv}: {near}, {}", single.diffuse);
                }
            }
            assert!(count > 200, "{name}: {count}");
        }
    }
}

#[test]
fn directions_are_drawn_wherever_there_is_opacity() {
    let mut random = Random(7);
    for (name, shader) in shaders() {
        let mut found = [0; 2];
        for Point { uv, wi, wo } in points(&mut random, 2000) {
            let are_finite = uv.is_finite() && wi.is_finite() && wo.is_finite();
            // The opacity is that of the face: where yarn there is hidden, the back may show another.
            let is_told = wi.z > 0.0 || !name.contains("hidden");
            if are_finite && is_told && wi.z * wo.z > 0.0 {
                let is_opaque = shader.opacity(uv) > 0.0;
                assert_eq!(shader.pdf(uv, wi, wo) > 0.0, is_opaque, "{name} at {uv}: {wi} {wo}");
                found[usize::from(is_opaque)] += 1;
            }
        }
        let has_gaps = name.contains("gaps") || name.contains("hidden");
        assert!(found[1] > 800 && (found[0] > 20 || !has_gaps), "{name}: {found:?}");
    }
}

#[test]
fn inactive_points_are_black_and_change_no_others() {
    let mut random = Random(3);
    let (_, shader) = shaders().into_iter().last().expect("there are some");
    for count in 0..40 {
        let points = points(&mut random, count);
        let active: Vec<bool> = (0..count).map(|_| random.number() < 0.5).collect();
        let columns = Columns::of(&points);
        let mut f = [(); 3].map(|()| vec![f32::NAN; count]);
        let mut pdf = vec![f32::NAN; count];
        let batch = columns.batch(Some(&active));
        shader.eval_batch(&batch, f.each_mut().map(Vec::as_mut_slice)).expect("equal lengths");
        shader.pdf_batch(&batch, &mut pdf).expect("equal lengths");
        for (k, Point { uv, wi, wo }) in points.into_iter().enumerate() {
            let expected = if active[k] {
                (shader.eval(uv, wi, wo), shader.pdf(uv, wi, wo))
            } else {
                (Vec3::ZERO, 0.0)
            };
            let found = (Vec3::from_array([0, 1, 2].map(|c| f[c][k])), pdf[k]);
            assert_eq!(found, expected, "point {k} of {count}, active: {}", active[k]);
        }
    }
}

#[test]
fn samples_and_yarns_are_those_of_single_points() {
    let mut random = Random(5);
    for (name, shader) in shaders() {
        let points = points(&mut random, 600);
        let columns = Columns::of(&points);
        let Columns { uv: [u, v], wo: [a, b, c], .. } = &columns;
        let xi =
            [(); 3].map(|()| points.iter().map(|_| random.number() as f32).collect::<Vec<_>>());
        let new = || [(); 3].map(|()| vec![f32::NAN; points.len()]);
        let (mut wi, mut weight, mut pdf) = (new(), new(), vec![f32::NAN; points.len()]);
        let draws =
            Draws { uv: [u, v], wo: [a, b, c], xi: xi.each_ref().map(Vec::as_slice), active: None };
        let samples = Samples {
            wi: wi.each_mut().map(Vec::as_mut_slice),
            weight: weight.each_mut().map(Vec::as_mut_slice),
            pdf: &mut pdf,
        };
        shader.sample_batch(&draws, samples).expect("equal lengths");
        for (k, point) in points.iter().enumerate() {
            let at = |of: &[Vec<f32>; 3]| Vec3::from_array(of.each_ref().map(|c| c[k]));
            let expected = shader.sample(point.uv, point.wo, xi.each_ref().map(|x| x[k]));
            let found =
                (pdf[k] > 0.0).then(|| Sample { wi: at(&wi), weight: at(&weight), pdf: pdf[k] });
            assert_eq!(found, expected, "{name} at {point:?}");
        }
        let (mut normal, mut tangent) = (new(), new());
        let [mut at_u, mut at_v] = [(); 2].map(|()| vec![f32::NAN; points.len()]);
        let (mut is_hit, mut yarn) = (vec![false; points.len()], vec![0; points.len()]);
        let yarns = YarnPoints {
            is_hit: &mut is_hit,
            yarn: &mut yarn,
            u: &mut at_u,
            v: &mut at_v,
            normal: normal.each_mut().map(Vec::as_mut_slice),
            tangent: tangent.each_mut().map(Vec::as_mut_slice),
        };
        shader.yarn_at_batch([u, v], yarns).expect("equal lengths");
        for (k, point) in points.iter().enumerate() {
            let expected = shader.yarn_at(point.uv);
            assert_eq!(is_hit[k], expected.is_some(), "{name} at {}", point.uv);
            let Some(expected) = expected else { continue };
            let at = |of: &[Vec<f32>; 3]| Vec3::from_array(of.each_ref().map(|c| c[k])).as_dvec3();
            assert_eq!(yarn[k], expected.yarn, "{name} at {}", point.uv);
            let angles = DVec2::new(at_u[k].into(), at_v[k].into());
            let errors = [
                (angles - DVec2::new(expected.u, expected.v)).length(),
                (at(&normal) - expected.normal).length(),
                (at(&tangent) - expected.tangent).length(),
            ];
            assert!(errors.into_iter().all(|e| e < 3e-7), "{name} at {}: {errors:?}", point.uv);
        }
    }
}

#[test]
fn slices_of_different_lengths_are_an_error() {
    let mut random = Random(4);
    let (_, shader) = shaders().into_iter().next().expect("there are some");
    let columns = Columns::of(&points(&mut random, 5));
    let mut pdf = [0.0; 4];
    let error = shader.pdf_batch(&columns.batch(None), &mut pdf).unwrap_err();
    assert_eq!(error.to_string(), "pdf: 4 values, expected 5 as in u");
    let active = [true; 6];
    let error = shader.pdf_batch(&columns.batch(Some(&active)), &mut [0.0; 5]).unwrap_err();
    assert_eq!(error.to_string(), "active: 6 values, expected 5 as in u");
}
