//! Footprints, at single points and in batches of any layout: the mixture of near and far field that Rust gives.

use std::ptr;

use glam::{DVec2, Vec3};
use selvedge::*;
use selvedge_yarn_brdf::Footprint;

use crate::{Loaded, common};

const COUNT: usize = 600;

/// A point of a batch, as an array of structures holds it.
#[repr(C)]
#[derive(Clone, Copy)]
struct Point {
    uv: [f64; 2],
    wi: [f32; 3],
    wo: [f32; 3],
    xi: [f32; 3],
    footprint: f32,
    active: u8,
}

/// Points on and below the cloth, some of which are seen as such, some as part of something wider.
fn points() -> Vec<Point> {
    let turn = |i: usize, by: f32| (i as f32 * by).fract();
    let widths = [0.0, 1e-4, 1.5e-3, 2e-3, 3e-3, 1.0, f32::INFINITY, f32::NAN, -1.0];
    (0..COUNT)
        .map(|i| {
            let [wi, wo] = common::DIRECTIONS[i % 5];
            let xi = [0.618, 0.755, 0.570].map(|by| turn(i, by));
            let uv = [1.3e-5 * i as f64, 3.1e-5 * i as f64];
            let footprint = widths[i % widths.len()];
            let (wi, wo) = (wi.into(), wo.into());
            Point { uv, wi, wo, xi, footprint, active: u8::from(i % 7 != 0) }
        })
        .collect()
}

/// What is found at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    specular: [f32; 3],
    diffuse: [f32; 3],
    f: [f32; 3],
    pdf: f32,
    reverse_pdf: f32,
    opacity: f32,
    albedo: [f32; 3],
    /// Direction, weight and density of a draw.
    drawn: ([f32; 3], [f32; 3], f32),
}

const NOTHING: Found = Found {
    specular: [7.0; 3],
    diffuse: [7.0; 3],
    f: [7.0; 3],
    pdf: 7.0,
    reverse_pdf: 7.0,
    opacity: 7.0,
    albedo: [7.0; 3],
    drawn: ([7.0; 3], [7.0; 3], 7.0),
};

fn of_rust(shader: &selvedge_yarn_brdf::Shader, point: &Point) -> Found {
    let at = Footprint::square(DVec2::from(point.uv), point.footprint.into());
    let (wi, wo) = (Vec3::from(point.wi), Vec3::from(point.wo));
    let lobes = shader.mixed_eval_lobes(&at, wi, wo);
    let drawn = shader.mixed_sample(&at, wo, point.xi);
    Found {
        specular: lobes.specular.into(),
        diffuse: lobes.diffuse.into(),
        f: (lobes.specular + lobes.diffuse).into(),
        pdf: shader.mixed_pdf(&at, wi, wo),
        reverse_pdf: shader.mixed_pdf(&at, wo, wi),
        opacity: shader.mixed_opacity(&at),
        albedo: shader.mixed_albedo(&at, wo).into(),
        drawn: drawn.map_or(([0.0, 0.0, 1.0], [0.0; 3], 0.0), |drawn| {
            (drawn.wi.into(), drawn.weight.into(), drawn.pdf)
        }),
    }
}

fn one_by_one(shader: *const Shader, point: &Point) -> Found {
    let (uv, at, xi) = (point.uv.as_ptr(), point.footprint, point.xi.as_ptr());
    let (wi, wo) = (point.wi.as_ptr(), point.wo.as_ptr());
    let mut found = NOTHING;
    let Found { specular, diffuse, f, pdf, reverse_pdf, opacity, albedo, drawn } = &mut found;
    let (specular, diffuse) = (specular.as_mut_ptr(), diffuse.as_mut_ptr());
    let (f, albedo) = (f.as_mut_ptr(), albedo.as_mut_ptr());
    let (to, weight) = (drawn.0.as_mut_ptr(), drawn.1.as_mut_ptr());
    // SAFETY: the shader lives, and the arrays have the lengths asked for.
    let statuses = unsafe {
        [
            selvedge_shader_eval_lobes(shader, uv, at, wi, wo, specular, diffuse),
            selvedge_shader_eval(shader, uv, at, wi, wo, f),
            selvedge_shader_pdf(shader, uv, at, wi, wo, pdf),
            selvedge_shader_reverse_pdf(shader, uv, at, wi, wo, reverse_pdf),
            selvedge_shader_eval_pdf(shader, uv, at, wi, wo, f, pdf),
            selvedge_shader_opacity(shader, uv, at, opacity),
            selvedge_shader_albedo(shader, uv, at, wo, albedo),
            selvedge_shader_sample(shader, uv, at, wo, xi, to, weight, &raw mut drawn.2),
        ]
    };
    assert_eq!(statuses, [Status::Ok; 8]);
    found
}

/// Where vectors go that lie in records of this type.
fn vectors<T>(first: *mut [f32; 3]) -> VectorsOut {
    let first = first.cast::<f32>();
    VectorsOut {
        component: [0, 1, 2].map(|k| first.wrapping_add(k)),
        stride: size_of::<T>() as isize,
    }
}

fn numbers<T>(values: *mut f32) -> NumbersOut {
    NumbersOut { values, stride: size_of::<T>() as isize }
}

/// What all batch calls find, `f` and weights of these `lobes`.
fn batch(shader: *const Shader, of: &[Point], is_masked: bool, lobes: u32) -> Vec<Found> {
    let first = of.as_ptr();
    let stride = size_of::<Point>() as isize;
    // SAFETY: within the first point, as are all that follow.
    let (uv, footprint, active, directions) = unsafe {
        let (uv, footprint) = (&raw const (*first).uv, &raw const (*first).footprint);
        let directions = [&raw const (*first).wi, &raw const (*first).wo, &raw const (*first).xi];
        (uv.cast::<f64>(), footprint, &raw const (*first).active, directions)
    };
    let [wi, wo, xi] = directions.map(|vector| Vectors {
        component: [0, 1, 2].map(|k| vector.cast::<f32>().wrapping_add(k)),
        stride,
    });
    let points = Points {
        struct_size: size_of::<Points>(),
        count: of.len(),
        uv: Positions { component: [uv, uv.wrapping_add(1)], stride },
        wi,
        wo,
        xi,
        footprint: Numbers { values: footprint, stride },
        active: Flags { values: if is_masked { active } else { ptr::null() }, stride },
        lobes,
        sides: 0,
    };
    let mut found = vec![NOTHING; of.len()];
    let to = found.as_mut_ptr();
    let (points, text, size) = (&raw const points, ptr::null_mut(), 0);
    // SAFETY: there are as many records as points, and the outputs are parts of the first of them.
    unsafe {
        let vector = |field: *mut [f32; 3]| vectors::<Found>(field);
        let number = |field: *mut f32| numbers::<Found>(field);
        let (specular, diffuse) = (vector(&raw mut (*to).specular), vector(&raw mut (*to).diffuse));
        let (f, albedo) = (vector(&raw mut (*to).f), vector(&raw mut (*to).albedo));
        let (pdf, reverse) = (number(&raw mut (*to).pdf), number(&raw mut (*to).reverse_pdf));
        let opacity = number(&raw mut (*to).opacity);
        let (wi, weight) = (vector(&raw mut (*to).drawn.0), vector(&raw mut (*to).drawn.1));
        let density = number(&raw mut (*to).drawn.2);
        let (specular, diffuse, f) = (&raw const specular, &raw const diffuse, &raw const f);
        let (pdf, reverse) = (&raw const pdf, &raw const reverse);
        let (albedo, opacity) = (&raw const albedo, &raw const opacity);
        let (wi, weight, density) = (&raw const wi, &raw const weight, &raw const density);
        let statuses = [
            selvedge_shader_eval_lobes_batch(shader, points, text, size, specular, diffuse),
            selvedge_shader_eval_batch(shader, points, text, size, f),
            selvedge_shader_pdf_batch(shader, points, text, size, pdf),
            selvedge_shader_reverse_pdf_batch(shader, points, text, size, reverse),
            selvedge_shader_eval_pdf_batch(shader, points, text, size, f, pdf),
            selvedge_shader_opacity_batch(shader, points, text, size, opacity),
            selvedge_shader_albedo_batch(shader, points, text, size, albedo),
            selvedge_shader_sample_batch(shader, points, text, size, wi, weight, density),
        ];
        assert_eq!(statuses, [Status::Ok; 8]);
    }
    found
}

#[test]
fn footprints_give_the_mixture_of_rust_one_by_one_and_in_batches() {
    let loaded = Loaded::new("drafts/plain.wif");
    let rust = common::shader("drafts/plain.wif");
    let points = points();
    let mixed = points.iter().filter(|point| {
        let at = Footprint::square(DVec2::ZERO, point.footprint.into());
        let weight = rust.far_weight(at.deviation);
        weight > 0.0 && weight < 1.0
    });
    assert!(mixed.count() > 50, "hardly any footprint is between near and far");
    let expected: Vec<_> = points.iter().map(|point| of_rust(&rust, point)).collect();
    for (point, expected) in points.iter().zip(&expected) {
        let found = one_by_one(loaded.shader, point);
        assert_eq!(found, *expected, "{:?}, {} m", point.uv, point.footprint);
    }
    for is_masked in [false, true] {
        let found = batch(loaded.shader, &points, is_masked, 0);
        for ((point, expected), found) in points.iter().zip(&expected).zip(found) {
            let is_there = !is_masked || point.active != 0;
            let expected = if is_there { *expected } else { NOTHING };
            assert_eq!(found, expected, "{:?}, {} m", point.uv, point.footprint);
        }
    }
    for (lobes, of) in [(1, 0), (2, 1)] {
        let found = batch(loaded.shader, &points, false, lobes);
        for ((point, expected), found) in points.iter().zip(&expected).zip(found) {
            assert_eq!(found.f, [expected.specular, expected.diffuse][of], "{lobes}");
            let (wi, _, pdf) = expected.drawn;
            assert_eq!((found.drawn.0, found.drawn.2), (wi, pdf), "{lobes}");
            if pdf > 0.0 {
                let drawn = of_rust(&rust, &Point { wi, ..*point });
                let f = Vec3::from([drawn.specular, drawn.diffuse][of]);
                assert_eq!(Vec3::from(found.drawn.1), f * (wi[2].abs() / pdf), "{lobes}");
            }
        }
    }
}
