//! Time of one `Weave::segment_at`, `Position::new` included, over random positions.

#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;
use std::num::NonZeroU32;

use criterion::{Criterion, criterion_group, criterion_main};
use selvedge_normalize::halton::Halton;
use selvedge_yarn_brdf::glam::DVec2;
use selvedge_yarn_brdf::{Local, Position, Side, Sizes, ThreadPoint, ThreadSizes, Touching, Weave};

const THREADS: u32 = 64;

/// Sizes from 0.6 to 1 that vary smoothly along each thread.
struct Varying;

impl Sizes for Varying {
    fn at(&self, point: ThreadPoint) -> Local {
        let thinnest = 0.1 * ((point.line * 7 + point.cell) & 3) as f64;
        let bump = point.fraction * (1.0 - point.fraction);
        Local { size: 0.9 - thinnest * bump * 4.0, offset: 0.1 * bump }
    }
}

fn scrambled(index: u32) -> u32 {
    (index.wrapping_add(1).wrapping_mul(0x9e37_79b9) >> 7).wrapping_mul(0x85eb_ca6b) >> 16
}

fn segment_at(c: &mut Criterion) {
    let weave = Weave::new(THREADS, THREADS, |end, pick| scrambled(end * THREADS + pick) & 1 == 0)
        .expect("64 by 64");
    let sizes = |first: u32| {
        (first..first + THREADS).map(|thread| 1.0 - f64::from(scrambled(thread) % 5) / 10.0)
    };
    let sizes = ThreadSizes::new(sizes(0).collect(), sizes(THREADS).collect());
    let in_tile: Vec<DVec2> = Halton::<2>::new()
        .points_from(NonZeroU32::MIN)
        .take(1 << 16)
        .map(|point| DVec2::from(point) * f64::from(THREADS))
        .collect();
    let far: Vec<DVec2> = in_tile.iter().map(|p| (p - 32.0) * 12_345.0).collect();

    for (place, positions) in [("in the first tile", &in_tile), ("in 10^8 tiles", &far)] {
        bench(c, &format!("touching, {place}"), positions, &weave, &Touching);
        bench(c, &format!("by thread, {place}"), positions, &weave, &sizes);
        bench(c, &format!("varying, {place}"), positions, &weave, &Varying);
    }
}

fn bench(c: &mut Criterion, name: &str, positions: &[DVec2], weave: &Weave, sizes: &impl Sizes) {
    let mut next = positions.iter().cycle();
    c.bench_function(name, |bencher| {
        bencher.iter(|| {
            let &cells = black_box(next.next().expect("the cycle never ends"));
            black_box(&weave.segment_at(black_box(Side::Face), Position::new(cells), sizes));
        });
    });
}

criterion_group!(benches, segment_at);
criterion_main!(benches);
