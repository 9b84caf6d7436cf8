//! Time of one `Shader::eval`, look-up included, over random positions and directions.

#![allow(missing_docs, reason = "criterion's macros make public functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Cloth, Thread, Weave, Yarn};
use std::hint::black_box;

fn eval(c: &mut Criterion) {
    let places: Vec<(DVec2, Vec3, Vec3)> = Halton::<6>::new()
        .points_from(std::num::NonZeroU32::MIN)
        .take(1024)
        .map(|[a, b, c, d, e, f]| {
            let direction = |x, y| square_to_cosine_hemisphere(DVec2::new(x, y)).as_vec3();
            (DVec2::new(a, b), direction(c, d), direction(e, f))
        })
        .collect();
    let thread = Thread { color: [0.4; 3], pitch: Some(5e-4), diameter: None };
    for (name, psi, size) in [("staple", 0.5, 1.0), ("filament", 0.0, 1.0), ("gaps", 0.5, 0.8)] {
        let weave = Weave::new(8, 8, |end, pick| (3 * pick + end) % 8 != 0).expect("8 by 8");
        let thread = Thread { diameter: Some(5e-4 * size), ..thread };
        let yarn = Yarn { psi, ..Yarn::default() };
        let shader = Cloth::from_threads(weave, &[thread; 8], &[thread; 8], yarn)
            .and_then(|cloth| cloth.prepare())
            .expect("valid");
        let mut next = places.iter().cycle();
        c.bench_function(name, |bencher| {
            bencher.iter(|| {
                let &(uv, wi, wo) = next.next().expect("the cycle never ends");
                shader.eval(black_box(uv), black_box(wi), black_box(wo))
            });
        });
    }
}

criterion_group!(benches, eval);
criterion_main!(benches);
