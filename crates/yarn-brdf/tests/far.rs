//! The far field is the mean of the near field, reflects no more than it receives, and is drawn from as
//! its density tells.

use core::f64::consts::{PI, TAU};
use std::sync::Arc;

use rayon::prelude::*;
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::{square_to_cosine_hemisphere, square_to_uniform_hemisphere};
use selvedge_yarn_brdf::glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{
    Cloth, Combination, Diffuse, Footprint, Highlight, Mapping, Mode, Noise, Phase, Sample, Shader,
    Target, Texture, Textured, Thread, Weave, Yarn,
};

#[path = "support/yarns.rs"]
mod yarns;
use yarns::{USUAL, WIDEST, direction};

/// A cloth of two types of yarn in a weave of floats and slits, with gaps unless both fill their pitch.
fn cloth(warp: &Yarn, weft: &Yarn) -> Cloth {
    let weave = Weave::new(4, 6, |end, pick| (2 * pick + 3 * end + pick * end) % 4 < 2)
        .expect("a few threads");
    let thread = Thread { pitch: Some(1e-3), ..Thread::default() };
    let ends = [thread; 4];
    let picks = [Thread { pitch: Some(1.3e-3), ..thread }; 6];
    let mut cloth = Cloth::from_threads(weave, &ends, &picks, warp).expect("as many threads");
    cloth.yarns = vec![warp.clone(), weft.clone()];
    cloth.end_yarns = vec![0, 0, 1, 0];
    cloth.pick_yarns = vec![1, 1, 1, 0, 1, 1];
    // With the other map, points even over the cloth are few where the yarn turns away.
    cloth.mapping = Mapping::Linear;
    cloth
}

/// Yarns of every kind in pairs.
fn cloths() -> Vec<Cloth> {
    let d = || Yarn { color: [0.5, 0.3, 0.2], specular: [0.5, 0.4, 0.3], ..Yarn::default() };
    let rough = |sigma| Highlight::Rough { sigma };
    let pale = || Yarn { color: [0.8; 3], specular: [0.2; 3], ..d() };
    let cauchy = |rho, is_backward| Phase::WrappedCauchy { rho, is_backward };
    let both = |warp: Yarn, weft: Yarn| cloth(&warp, &weft);
    vec![
        Cloth { mapping: Mapping::Arcsine, ..both(d(), Yarn { psi: -0.4, u_max: 0.7, ..pale() }) },
        both(Yarn { size: 0.7, ..d() }, Yarn { psi: 0.0, size: 0.9, opacity: 0.5, ..pale() }),
        both(
            Yarn { highlight: rough(0.2), diffuse: Diffuse::YarnNormal, ..d() },
            Yarn { highlight: rough(0.1), kappa: 2.0, ..pale() },
        ),
        both(
            Yarn { highlight: rough(0.3), psi: -0.6, size: 0.5, ..d() },
            Yarn { diffuse: Diffuse::YarnNormal, specular: [0.0; 3], u_max: 1.0, ..pale() },
        ),
        both(
            Yarn { specular_uniform: Some([0.1, 0.6, 0.9]), psi: 0.0, smoothing: 0.5, ..d() },
            Yarn { phase: cauchy(0.67, true), ..pale() },
        ),
        Cloth { combination: Combination::Lerp, rotation: 0.7, scale: 1.5, ..both(d(), pale()) },
        Cloth {
            normalization: Mode::None,
            ..both(
                Yarn { phase: Phase::VonMises3d { alpha: 0.6, beta: 2.0 }, u_max: 1.3, ..d() },
                Yarn { phase: Phase::VonMises3d { alpha: 1.0, beta: 1.0 }, u_max: 1.4, ..pale() },
            )
        },
    ]
}

/// Pairs of directions even over the hemisphere, every fourth on the back.
fn pairs(count: usize) -> Vec<[DVec3; 2]> {
    let points = Halton::<4>::new().points_from(std::num::NonZeroU32::MIN).enumerate();
    points
        .take(count)
        .map(|(k, [a, b, c, d])| {
            let side = if k % 4 == 3 { -1.0 } else { 1.0 };
            [[a, b], [c, d]].map(|[x, y]| side * square_to_uniform_hemisphere(DVec2::new(x, y)))
        })
        .collect()
}

/// Points that are even over `repeats` of the repeat along u and v.
fn places(cloth: &Cloth, repeats: f64, count: u32) -> impl Iterator<Item = DVec2> {
    // The powers of the plastic number, whose multiples are even on the unit square.
    let step = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_3);
    let size = cloth.size() * repeats / cloth.scale;
    let (sin, cos) = cloth.rotation.sin_cos();
    (0..count).map(move |k| {
        let DVec2 { x, y } = (step * f64::from(k) + 0.5).fract() * size;
        DVec2::new(x * cos + y * sin, y * cos - x * sin)
    })
}

const AT: Footprint = Footprint { uv: DVec2::ZERO, deviation: DVec2::ZERO };

/// The errors of the far field, smallest first, relative to the mean of the near field over `repeats` of
/// the repeat or to 5 % of its mean over all pairs of directions, whichever is greater.
fn errors(cloth: &Cloth, pairs: &[[DVec3; 2]], repeats: f64, count: u32) -> Vec<f64> {
    let shader = cloth.prepare().expect("valid");
    let of_pair = |&[wi, wo]: &[DVec3; 2]| {
        let all = places(cloth, repeats, count).map(|uv| shader.eval_reference(uv, wi, wo));
        all.sum::<DVec3>() / f64::from(count)
    };
    let near: Vec<DVec3> = pairs.par_iter().map(of_pair).collect();
    let least = 0.05 * near.iter().map(|f| f.element_sum()).sum::<f64>() / (3 * near.len()) as f64;
    let error = |(&[wi, wo], &near): (&[DVec3; 2], &DVec3)| {
        let far = shader.far_eval(&AT, wi.as_vec3(), wo.as_vec3()).as_dvec3();
        ((far - near) / near.max(DVec3::splat(least))).abs().max_element()
    };
    let mut errors: Vec<f64> = pairs.iter().zip(&near).map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn far_field_is_the_mean_of_the_near_field() {
    let pairs = pairs(40);
    for (index, cloth) in cloths().iter().enumerate() {
        let errors = errors(cloth, &pairs, 1.0, 60_000);
        let (median, most, worst) = (errors[20], errors[36], errors[39]);
        println!("cloth {index}: median {median:.5}, 90 % {most:.5}, worst {worst:.5}");
        assert!(
            median < 1e-3 && worst < 5e-3,
            "cloth {index}: {errors:?}, expected a median of 0.001, all of 0.005"
        );
    }
}

#[test]
fn irregularities_become_their_mean() {
    let pairs = pairs(12);
    let base = Yarn {
        color: [0.9, 0.5, 0.2],
        highlight: Highlight::Rough { sigma: 0.2 },
        ..Yarn::default()
    };
    let none = Noise::default();
    let noises = [
        Noise { intensity: 1.0, color: 0.5, ..none },
        Noise { width: 0.3, wavelength: 0.002, ..none },
        Noise { offset: 0.2, width: 0.1, wavelength: 0.002, ..none },
        Noise { slub_rate: 40.0, slub_length: 0.01, slub_height: 1.0, ..none },
        Noise { u_max: 0.1, ..none },
    ];
    for noise in noises {
        let warp = Yarn { noise, size: 0.8, ..base.clone() };
        let weft = Yarn { size: 1.0, color: [0.2, 0.4, 0.9], ..warp.clone() };
        let errors = errors(&cloth(&warp, &weft), &pairs, 400.0, 100_000);
        println!("{noise:?}: {errors:.5?}");
        assert!(errors[6] < 0.01 && errors[11] < 0.03, "{noise:?}: {errors:?}");
    }
}

#[test]
fn opacity_is_the_mean_of_the_opacities() {
    for (index, cloth) in cloths().iter().enumerate() {
        let shader = cloth.prepare().expect("valid");
        let count = 100_000;
        let sum: f64 = places(cloth, 1.0, count).map(|uv| f64::from(shader.opacity(uv))).sum();
        let (near, far) = (sum / f64::from(count), f64::from(shader.far_opacity(&AT)));
        assert!((far - near).abs() < 1e-3, "cloth {index}: {far}, expected {near} within 0.001");
    }
}

/// A shader of the `i`-th yarn of many as the warp, and of another as the weft.
fn random_shader(i: u32, range: &yarns::Range) -> Shader {
    cloth(&yarns::yarn(i, range), &yarns::yarn(i + 7, range)).prepare().expect("valid")
}

#[test]
fn far_field_is_reciprocal_finite_and_not_negative() {
    (0..24u32).into_par_iter().for_each(|i| {
        let shader = random_shader(11 * i, &WIDEST);
        for j in 0..200 {
            let side = if j % 3 == 2 { -1.0 } else { 1.0 };
            let [wi, wo] = [2 * j, 2 * j + 1].map(|j| (side * direction(j)).as_vec3());
            let (f, g) = (shader.far_eval(&AT, wi, wo), shader.far_eval(&AT, wo, wi));
            assert!(f.is_finite() && f.min_element() >= 0.0, "yarn {i}, {wi} {wo}: {f}");
            let difference = (f - g).abs().max_element();
            let tolerance = 2e-3 * f.max_element() + 1e-6;
            assert!(difference <= tolerance, "yarn {i}, {wi} {wo}: {f} and {g}");
            let albedo = shader.far_albedo(&AT, wo);
            assert!(albedo.is_finite() && albedo.min_element() >= 0.0, "yarn {i}, {wo}: {albedo}");
        }
    });
}

#[test]
fn nothing_is_reflected_through_the_cloth_or_where_numbers_are_none() {
    let shader = random_shader(3, &USUAL);
    let (up, down) = (Vec3::new(0.0, 0.6, 0.8), Vec3::new(0.6, 0.0, -0.8));
    for (wi, wo) in [(up, down), (down, up), (up, Vec3::NAN), (Vec3::X, up), (Vec3::ZERO, up)] {
        assert_eq!(shader.far_eval(&AT, wi, wo), Vec3::ZERO, "{wi} {wo}");
        assert_eq!(shader.far_pdf(&AT, wi, wo), 0.0, "{wi} {wo}");
    }
    assert!(shader.far_sample(&AT, Vec3::NAN, [0.5; 3]).is_none());
}

#[test]
fn no_cloth_reflects_more_than_it_receives_and_draws_weigh_the_albedo() {
    (0..24u32).into_par_iter().for_each(|i| {
        let shader = random_shader(5 * i, &USUAL);
        for wo in [0.95, 0.5, 0.1].map(|z: f64| {
            let (y, x) = (TAU * f64::from(i) / 24.0).sin_cos();
            DVec3::new((1.0 - z * z).sqrt() * x, (1.0 - z * z).sqrt() * y, z).as_vec3()
        }) {
            let count = 32_000;
            let points = Halton::<3>::new().points_from(std::num::NonZeroU32::MIN).take(count);
            let (mut drawn, mut even) = (0.0, 0.0);
            for [a, b, c] in points {
                let xi = [a, b, c].map(|x| x as f32);
                let sample = shader.far_sample(&AT, wo, xi);
                drawn += sample.map_or(0.0, |sample| f64::from(sample.weight.x));
                let wi = square_to_cosine_hemisphere(DVec2::new(b, c)).as_vec3();
                even += PI * f64::from(shader.far_eval(&AT, wi, wo).x);
            }
            let (drawn, even) = (drawn / count as f64, even / count as f64);
            let table = f64::from(shader.far_albedo(&AT, wo).x);
            println!("yarn {i}, {wo}: drawn {drawn:.4}, even {even:.4}, table {table:.4}");
            assert!(drawn < 1.003, "yarn {i}, {wo}: {drawn}, expected at most 1");
            assert!((drawn - even).abs() < 0.02, "yarn {i}, {wo}: {drawn}, expected {even}");
            assert!((table - drawn).abs() < 0.05, "yarn {i}, {wo}: {table}, expected {drawn}");
        }
    });
}

#[test]
fn draws_follow_their_density() {
    (0..16u32).into_par_iter().for_each(|i| {
        let shader = random_shader(9 * i + 1, &USUAL);
        follow_their_density(
            i,
            |wo, xi| shader.far_sample(&AT, wo, xi),
            |wi, wo| shader.far_pdf(&AT, wi, wo),
        );
    });
}

/// A footprint of `shader` at which near and far field count about as much.
fn between(shader: &Shader, uv: DVec2) -> Footprint {
    let footprints = (1..2000).map(|k| Footprint::square(uv, 5e-6 * f64::from(k)));
    let mut between = footprints.filter(|at| (0.4..0.6).contains(&shader.far_weight(at.deviation)));
    between.next().expect("the weight is smooth")
}

#[test]
fn draws_of_the_mixture_follow_its_density_and_weigh_its_value() {
    [0, 3].into_par_iter().for_each(|i| {
        // Fibres so rough that the density of a point is smooth, as the rule over each part takes it to be.
        let highlight = Highlight::Rough { sigma: 0.3 };
        let [warp, weft] =
            [9 * i + 1, 9 * i + 8].map(|i| Yarn { highlight, ..yarns::yarn(i, &USUAL) });
        let shader = cloth(&warp, &weft).prepare().expect("valid");
        // On yarn and in gaps.
        let at = between(&shader, DVec2::new(3.1e-4, 1.7e-4) * f64::from(i));
        follow_their_density(
            i,
            |wo, xi| {
                let sample = shader.mixed_sample(&at, wo, xi)?;
                if xi[2] < 0.05 {
                    let expected = shader.mixed_eval(&at, sample.wi, wo) * sample.wi.z.abs();
                    let found = sample.weight * sample.pdf;
                    assert!(found.abs_diff_eq(expected, 1e-5 * expected.max_element()), "yarn {i}");
                }
                Some(sample)
            },
            |wi, wo| shader.mixed_pdf(&at, wi, wo),
        );
    });
}

/// Where one field counts alone, the mixture is that field; between, its mean over the cloth is that of both.
#[test]
fn mixtures_have_the_mean_of_both_fields() {
    for (index, cloth) in cloths().iter().enumerate() {
        let shader = cloth.prepare().expect("valid");
        let [wi, wo] = [Vec3::new(0.3, -0.2, 0.9), Vec3::new(-0.5, 0.1, 0.8)].map(Vec3::normalize);
        let uv = DVec2::new(1.1e-4, 2.3e-4);
        for width in [0.0, -1.0, f64::NAN, 1e-5] {
            let point = Footprint::square(uv, width);
            assert_eq!(shader.mixed_eval_lobes(&point, wi, wo), shader.eval_lobes(uv, wi, wo));
            assert_eq!(shader.mixed_pdf(&point, wi, wo), shader.pdf(uv, wi, wo));
            assert_eq!(shader.mixed_sample(&point, wo, [0.3; 3]), shader.sample(uv, wo, [0.3; 3]));
            assert_eq!(shader.mixed_albedo(&point, wo), shader.albedo(uv, wo));
            assert_eq!(shader.mixed_opacity(&point), shader.opacity(uv));
        }
        for width in [1.0, f64::INFINITY] {
            let wide = Footprint::square(uv, width);
            assert_eq!(shader.mixed_eval(&wide, wi, wo), shader.far_eval(&wide, wi, wo));
            assert_eq!(shader.mixed_pdf(&wide, wi, wo), shader.far_pdf(&wide, wi, wo));
            assert_eq!(shader.mixed_opacity(&wide), shader.far_opacity(&wide));
        }
        let count = 20_000;
        let (mut value, mut opacity, mut albedo) = (DVec3::ZERO, 0.0, [DVec3::ZERO; 2]);
        let halfway = between(&shader, uv);
        for uv in places(cloth, 1.0, count) {
            let at = Footprint { uv, ..halfway };
            value += shader.mixed_eval(&at, wi, wo).as_dvec3() / f64::from(count);
            opacity += f64::from(shader.mixed_opacity(&at)) / f64::from(count);
            albedo[0] += shader.mixed_albedo(&at, wo).as_dvec3() / f64::from(count);
            albedo[1] += shader.albedo(uv, wo).as_dvec3() / f64::from(count);
        }
        let wide = Footprint::square(uv, 1.0);
        let far = shader.far_eval(&wide, wi, wo).as_dvec3();
        assert!(value.abs_diff_eq(far, 0.01 * far.max_element()), "cloth {index}: {value}, {far}");
        let far = f64::from(shader.far_opacity(&wide));
        assert!((opacity - far).abs() < 2e-3, "cloth {index}: {opacity}, {far}");
        let weight = f64::from(shader.far_weight(halfway.deviation));
        let both = albedo[1].lerp(shader.far_albedo(&wide, wo).as_dvec3(), weight);
        assert!(albedo[0].abs_diff_eq(both, 1e-3), "cloth {index}: {}, {both}", albedo[0]);
    }
}

/// Whether as many draws fall into each part of the hemisphere as their density tells, by Pearson's test.
fn follow_their_density(
    i: u32,
    draw: impl Fn(Vec3, [f32; 3]) -> Option<Sample>,
    density_of: impl Fn(Vec3, Vec3) -> f32,
) {
    const SIDE: usize = 12;
    let wo = (if i % 4 == 3 { -1.0 } else { 1.0 }) * direction(3 * i);
    let wo = wo.as_vec3();
    let draws = 40_000;
    let mut counts = [0u32; SIDE * SIDE];
    let points = Halton::<3>::new().points_from(std::num::NonZeroU32::MIN).take(draws);
    let mut rejected = 0;
    // Random, not even, numbers: shifted by those of a hash.
    let mut state = u64::from(i) + 1;
    for _ in points {
        let xi = [(); 3].map(|()| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u32 << 24) as f32
        });
        match draw(wo, xi) {
            None => rejected += 1,
            Some(sample) => {
                let pdf = density_of(sample.wi, wo);
                assert!((sample.pdf / pdf - 1.0).abs() < 1e-3, "{} and {pdf}", sample.pdf);
                let turn = f64::from(sample.wi.y.atan2(sample.wi.x)).rem_euclid(TAU) / TAU;
                let row = (f64::from(sample.wi.z.abs()) * SIDE as f64) as usize;
                let column = (turn * SIDE as f64) as usize;
                counts[row.min(SIDE - 1) * SIDE + column.min(SIDE - 1)] += 1;
            }
        }
    }
    let (mut statistic, mut freedom, mut total) = (0.0, 0, 0.0);
    for (cell, &count) in counts.iter().enumerate() {
        const FINE: usize = 24;
        let mut density = 0.0;
        for k in 0..FINE * FINE {
            let part = |index: usize, k: usize| {
                (index as f64 + (k as f64 + 0.5) / FINE as f64) / SIDE as f64
            };
            let z = part(cell / SIDE, k / FINE);
            let (y, x) = (TAU * part(cell % SIDE, k % FINE)).sin_cos();
            let sine = (1.0 - z * z).sqrt();
            let wi = Vec3::new((sine * x) as f32, (sine * y) as f32, z as f32 * wo.z.signum());
            density += f64::from(density_of(wi, wo));
        }
        let expected = draws as f64 * density * TAU / ((SIDE * SIDE * FINE * FINE) as f64);
        total += expected;
        if expected >= 20.0 {
            statistic += (f64::from(count) - expected).powi(2) / expected;
            freedom += 1;
        }
    }
    let kept = (draws - rejected) as f64;
    println!("yarn {i}, {wo}: {statistic:.0} of {freedom}, kept {kept}, density {total:.0}");
    // The distribution of Pearson's statistic is nearly normal; the rule over each part is not exact.
    let limit = f64::from(freedom) + 6.0 * (2.0 * f64::from(freedom)).sqrt() + 20.0;
    assert!(statistic < limit, "yarn {i}, {wo}: {statistic}, expected less than {limit}");
    assert!((kept - total).abs() < 0.02 * draws as f64, "yarn {i}: {kept}, expected {total}");
}

#[test]
fn far_field_takes_over_where_the_pattern_blurs() {
    let thread = |grey| Thread { color: [grey; 3], pitch: Some(1e-3), ..Thread::default() };
    let twill = Weave::new(16, 16, |end, pick| (pick + end) % 4 < 2).expect("16 by 16");
    let shader = |ends: &[Thread]| {
        let cloth = Cloth::from_threads(twill.clone(), ends, &[thread(0.5); 16], &Yarn::default());
        cloth.and_then(|cloth| cloth.prepare()).expect("valid")
    };
    let plain = shader(&[thread(0.5); 16]);
    let striped: Vec<Thread> = (0..16).map(|end| thread(if end < 8 { 0.1 } else { 0.9 })).collect();
    let striped = shader(&striped);
    let weights = |shader: &Shader| -> Vec<f32> {
        (0..200).map(|k| shader.far_weight(DVec2::splat(1e-4 * f64::from(k)))).collect()
    };
    for shader in [&plain, &striped] {
        let weights = weights(shader);
        assert_eq!((weights[0], weights[5], weights[199]), (0.0, 0.0, 1.0), "{weights:?}");
        assert!(weights.windows(2).all(|pair| (0.0..0.3).contains(&(pair[1] - pair[0]))));
    }
    // A narrow footprint is as good as none.
    assert_eq!(plain.far_weight(DVec2::new(1.0, 0.0)), 0.0);
    assert_eq!(plain.far_weight(DVec2::NAN), 0.0);
    let first = |weights: Vec<f32>| weights.iter().position(|&weight| weight == 1.0);
    let [plain, striped] = [&plain, &striped].map(|shader| first(weights(shader)).expect("1"));
    println!("twill from {plain}, stripes from {striped} tenths of a cell");
    assert!(2 * plain < striped, "twill from {plain}, stripes from {striped}");
}

/// A colour of 0.2 or 0.8 by the half of the cloth.
#[derive(Debug)]
struct Halves;

impl Texture for Halves {
    fn value(&self, uv: DVec2, _footprint: f64) -> [f32; 3] {
        [if uv.x < 0.0 { 0.2 } else { 0.8 }; 3]
    }

    fn range(&self) -> [f32; 2] {
        [0.2, 0.8]
    }
}

#[test]
fn textures_are_read_at_the_footprint() {
    let yarn = Yarn { color: [0.4; 3], specular: [0.3; 3], ..Yarn::default() };
    let plain = cloth(&yarn, &yarn);
    for target in
        [Target::Color, Target::Specular, Target::Parameter("opacity"), Target::Parameter("psi")]
    {
        let texture: Arc<dyn Texture> = Arc::new(Halves);
        let of = |yarn| Textured { yarn, target, texture: texture.clone() };
        let textured = Cloth { textures: vec![of(0), of(1)], ..plain.clone() };
        let shader = textured.prepare().expect("valid");
        for (x, value) in [(-1.0, 0.2), (1.0, 0.8)] {
            // All of the repeat about a place far from the seam.
            let middle = DVec2::new(x, 0.0);
            let footprint = Footprint { uv: middle, deviation: DVec2::splat(1e-3) };
            for [wi, wo] in pairs(6) {
                let count = 40_000;
                let sum: DVec3 = places(&textured, 1.0, count)
                    .map(|uv| shader.eval_reference(uv + x * 100.0 * textured.size(), wi, wo))
                    .sum();
                let near = sum / f64::from(count);
                let far = shader.far_eval(&footprint, wi.as_vec3(), wo.as_vec3()).as_dvec3();
                let error = (far - near).abs().max_element();
                assert!(
                    error < 0.01 * near.max_element() + 2e-4,
                    "{target:?} of {value}, {wi} {wo}: {far}, expected {near}"
                );
            }
        }
    }
}
