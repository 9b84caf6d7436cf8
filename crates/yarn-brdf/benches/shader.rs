//! Time of one scalar call of the shader, look-up included, over random positions and directions, and
//! the instructions that it takes, which are the same on a busy machine.
//!
//! Where there is no valgrind, the instructions are left out.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion};
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Cloth, Highlight, Noise, Shader, Thread, Weave, Yarn};

#[path = "support/count.rs"]
mod count;

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
const FABRICS: [&str; 5] = ["staple", "filament", "rough", "noise", "gaps"];

fn shader(fabric: &str) -> Shader {
    let yarn = Yarn::default();
    let yarn = match fabric {
        "filament" => Yarn { psi: 0.0, ..yarn },
        "rough" => Yarn { highlight: Highlight::Rough { sigma: 0.15 }, ..yarn },
        "noise" => Yarn { noise: Noise { intensity: 1.0, ..Noise::default() }, ..yarn },
        "gaps" => Yarn { size: 0.8, ..yarn },
        _ => yarn,
    };
    let weave = Weave::new(60, 60, |end, pick| (3 * pick + end) % 8 != 0).expect("60 by 60");
    let diameter = Some(5e-4 * yarn.size);
    let thread = Thread { color: [0.4; 3], pitch: Some(5e-4), diameter, ..Thread::default() };
    let cloth = Cloth::from_threads(weave, &[thread; 60], &[thread; 60], &yarn);
    cloth.and_then(|cloth| cloth.prepare()).expect("valid")
}

type Call = fn(&Shader, &Query) -> f32;

const CALLS: [(&str, Call); 4] = [
    ("eval", |shader, &(uv, wi, wo, _)| shader.eval(uv, wi, wo).x),
    ("sample", |shader, &(uv, _, wo, xi)| shader.sample(uv, wo, xi).map_or(0.0, |s| s.pdf)),
    ("pdf", |shader, &(uv, wi, wo, _)| shader.pdf(uv, wi, wo)),
    ("yarn_at", |shader, &(uv, ..)| shader.yarn_at(uv).map_or(0.0, |point| point.u as f32)),
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

/// Calls to count the instructions of.
const COUNTED: usize = 10_000;

/// Makes the calls that `task` tells of.
fn run(task: &str) {
    let mut parts = task.split(' ');
    let mut next = || parts.next().expect("fabric, call and number");
    let (shader, name, number) = (shader(next()), next(), next());
    let (_, call) = CALLS.into_iter().find(|(known, _)| *known == name).expect("a known call");
    let number: usize = number.parse().expect("a number");
    for query in queries().iter().take(number) {
        black_box(call(&shader, black_box(query)));
    }
}

fn main() {
    if let Some(task) = count::task() {
        return run(&task);
    }
    let mut criterion = Criterion::default().configure_from_args();
    time(&mut criterion);
    criterion.final_summary();
    for fabric in FABRICS {
        let Some(before) = count::instructions(&format!("{fabric} eval 0"), None) else {
            return eprintln!("no valgrind: instructions are not counted");
        };
        for (name, _) in CALLS {
            if let Some(all) = count::instructions(&format!("{fabric} {name} {COUNTED}"), None) {
                println!("{name}/{fabric}: {} instructions", (all - before) / COUNTED as u64);
            }
        }
    }
}
