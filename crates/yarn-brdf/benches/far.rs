//! Time of one evaluation of the far field beside one of the near field, and of drawing from it, over
//! random directions.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Cloth, Diffuse, Footprint, Highlight, Shader, Thread, Weave, Yarn};

/// A place, two directions and three numbers to draw a third with.
type Query = (DVec2, Vec3, Vec3, [f32; 3]);

/// So many that no branch predictor learns them by heart.
const QUERIES: usize = 1 << 14;

fn queries() -> Vec<Query> {
    Halton::<9>::new()
        .points_from(std::num::NonZeroU32::MIN)
        .take(QUERIES)
        .map(|[a, b, c, d, e, f, g, h, i]| {
            let direction = |x, y| square_to_cosine_hemisphere(DVec2::new(x, y)).as_vec3();
            let xi = [g, h, i].map(|x| x as f32);
            (0.03 * DVec2::new(a, b), direction(c, d), direction(e, f), xi)
        })
        .collect()
}

/// What the fabrics are called that are shaded.
const FABRICS: [&str; 5] = ["staple", "filament", "rough", "yarn_normal", "gaps"];

/// A twill of threads in eight colours.
fn shader(fabric: &str) -> Shader {
    let rough = Highlight::Rough { sigma: 0.2 };
    let yarn = Yarn::default();
    let yarn = match fabric {
        "filament" => Yarn { psi: 0.0, ..yarn },
        "rough" => Yarn { highlight: rough, ..yarn },
        "yarn_normal" => Yarn { highlight: rough, diffuse: Diffuse::YarnNormal, ..yarn },
        "gaps" => Yarn { size: 0.8, highlight: rough, diffuse: Diffuse::YarnNormal, ..yarn },
        _ => yarn,
    };
    let weave = Weave::new(32, 32, |end, pick| (pick + end) % 4 < 2).expect("32 by 32");
    let diameter = Some(5e-4 * yarn.size);
    let threads: Vec<Thread> = (0..32)
        .map(|k| {
            let grey = 0.1 * (k / 4 + 1) as f32;
            Thread { color: [grey; 3], pitch: Some(5e-4), diameter, ..Thread::default() }
        })
        .collect();
    let cloth = Cloth::from_threads(weave, &threads, &threads, &yarn);
    cloth.and_then(|cloth| cloth.prepare()).expect("valid")
}

type Call = fn(&Shader, &Query) -> f32;

const CALLS: [(&str, Call); 5] = [
    ("near", |shader, &(uv, wi, wo, _)| shader.eval(uv, wi, wo).x),
    ("far", |shader, &(_, wi, wo, _)| shader.far_eval(&Footprint::default(), wi, wo).x),
    ("near_sample", |shader, &(uv, _, wo, xi)| shader.sample(uv, wo, xi).map_or(0.0, |s| s.pdf)),
    ("far_sample", |shader, &(_, _, wo, xi)| {
        shader.far_sample(&Footprint::default(), wo, xi).map_or(0.0, |s| s.pdf)
    }),
    ("far_pdf", |shader, &(_, wi, wo, _)| shader.far_pdf(&Footprint::default(), wi, wo)),
];

fn time(c: &mut Criterion) {
    let queries = queries();
    let shaders = FABRICS.map(|fabric| (fabric, shader(fabric)));
    for (name, call) in CALLS {
        let mut group = c.benchmark_group(name);
        for (fabric, shader) in &shaders {
            let mut next = queries.iter().cycle();
            group.bench_function(BenchmarkId::from_parameter(fabric), |bencher| {
                bencher.iter(|| {
                    let query = next.next().expect("the cycle never ends");
                    call(shader, black_box(query))
                });
            });
        }
    }
}

criterion_group!(benches, time);
criterion_main!(benches);
