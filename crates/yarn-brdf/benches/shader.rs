//! Time of one scalar call of the shader, look-up included, over random positions and directions.

#![allow(missing_docs, reason = "criterion's macros make public functions")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Cloth, Highlight, Noise, Shader, Thread, Weave, Yarn};
use std::hint::black_box;

/// A place, two directions and three numbers to draw a third with.
type Query = (DVec2, Vec3, Vec3, [f32; 3]);

fn queries() -> Vec<Query> {
    Halton::<9>::new()
        .points_from(std::num::NonZeroU32::MIN)
        .take(1024)
        .map(|[a, b, c, d, e, f, g, h, i]| {
            let direction = |x, y| square_to_cosine_hemisphere(DVec2::new(x, y)).as_vec3();
            let xi = [g, h, i].map(|x| x as f32);
            (0.03 * DVec2::new(a, b), direction(c, d), direction(e, f), xi)
        })
        .collect()
}

fn shaders() -> Vec<(&'static str, Shader)> {
    let yarn = Yarn::default;
    let noise = Noise { intensity: 1.0, ..Noise::default() };
    let yarns = [
        ("staple", yarn()),
        ("filament", Yarn { psi: 0.0, ..yarn() }),
        ("rough", Yarn { highlight: Highlight::Rough { sigma: 0.15 }, ..yarn() }),
        ("noise", Yarn { noise, ..yarn() }),
        ("gaps", Yarn { size: 0.8, ..yarn() }),
    ];
    yarns
        .into_iter()
        .map(|(name, yarn)| {
            let weave =
                Weave::new(60, 60, |end, pick| (3 * pick + end) % 8 != 0).expect("60 by 60");
            let diameter = Some(5e-4 * yarn.size);
            let thread =
                Thread { color: [0.4; 3], pitch: Some(5e-4), diameter, ..Thread::default() };
            let cloth = Cloth::from_threads(weave, &[thread; 60], &[thread; 60], &yarn);
            (name, cloth.and_then(|cloth| cloth.prepare()).expect("valid"))
        })
        .collect()
}

fn bench(c: &mut Criterion) {
    let queries = queries();
    let shaders = shaders();
    let mut measure = |name: &str, call: &dyn Fn(&Shader, &Query) -> f32| {
        let mut group = c.benchmark_group(name);
        for (yarn, shader) in &shaders {
            let mut next = queries.iter().cycle();
            group.bench_function(BenchmarkId::from_parameter(yarn), |bencher| {
                bencher.iter(|| {
                    let query = next.next().expect("the cycle never ends");
                    call(shader, black_box(query))
                });
            });
        }
    };
    measure("eval", &|shader, &(uv, wi, wo, _)| shader.eval(uv, wi, wo).x);
    measure("sample", &|shader, &(uv, _, wo, xi)| {
        shader.sample(uv, wo, xi).map_or(0.0, |sample| sample.pdf)
    });
    measure("pdf", &|shader, &(uv, wi, wo, _)| shader.pdf(uv, wi, wo));
    measure("yarn_at", &|shader, &(uv, ..)| shader.yarn_at(uv).map_or(0.0, |point| point.u as f32));
}

criterion_group!(benches, bench);
criterion_main!(benches);
