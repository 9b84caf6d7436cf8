//! What points, maps, albedos and the search for the factor cost.

use std::{hint::black_box, num::NonZeroU32};

use criterion::{Criterion, criterion_group, criterion_main};
use selvedge_normalize::{
    Normalization, Search,
    albedo::directional,
    estimate::Sampling,
    glam::{DVec2, DVec3, Vec2, Vec3},
    halton::{Halton, Scrambling},
    maximize,
    scale::{Mode, Options},
    table::{AlbedoTable, Resolution},
    warp::square_to_cosine_hemisphere,
};

fn phong(_: Vec2, wi: Vec3, wo: Vec3) -> f32 {
    (2.0 * wi.z * Vec3::Z - wi).dot(wo).max(0.0).powi(20)
}

fn points(c: &mut Criterion) {
    let variants = [
        ("plain", Scrambling::None),
        ("digits", Scrambling::Digits(1)),
        ("owen", Scrambling::Owen(1)),
    ];
    for (name, scrambling) in variants {
        let sequence = Halton::<4>::scrambled(scrambling);
        let start = NonZeroU32::new(1_000_000).expect("not 0");
        c.bench_function(&format!("1000 points in 4 dimensions, {name}"), |b| {
            b.iter(|| sequence.points_from(black_box(start)).take(1000).flatten().sum::<f64>());
        });
    }
    c.bench_function("1000 directions, cosine hemisphere", |b| {
        let squares: Vec<[f64; 2]> =
            Halton::new().points_from(NonZeroU32::MIN).take(1000).collect();
        b.iter(|| squares.iter().map(|s| square_to_cosine_hemisphere((*s).into())).sum::<DVec3>());
    });
}

fn albedo(c: &mut Criterion) {
    let exactly = |n| NonZeroU32::new(n).expect("not 0");
    let sampling = Sampling { tolerance: 0.0, at_most: exactly(1 << 14), ..Sampling::default() };
    c.bench_function("directional albedo of a Phong lobe, 16384 points", |b| {
        b.iter(|| directional(&phong, DVec2::ZERO, black_box(DVec3::Z), &sampling));
    });
}

fn table(c: &mut Criterion) {
    let (sampling, resolution) = (Sampling::default(), Resolution::default());
    c.bench_function("table of a Phong lobe, default settings", |b| {
        b.iter(|| AlbedoTable::of(&phong, Some(DVec2::ZERO), &sampling, &resolution));
    });
    let table = AlbedoTable::of(&phong, Some(DVec2::ZERO), &sampling, &resolution).expect("valid");
    let squares = Halton::new().points_from(NonZeroU32::MIN).take(1000);
    let directions: Vec<DVec3> =
        squares.map(|s| square_to_cosine_hemisphere(DVec2::from_array(s))).collect();
    c.bench_function("1000 lookups in a table", |b| {
        b.iter(|| directions.iter().map(|w| table.at(black_box(*w))).sum::<f64>());
    });
}

fn factor(c: &mut Criterion) {
    let hill = |p: [f64; 4]| -p.iter().map(|x| (x - 0.4).powi(2)).sum::<f64>();
    c.bench_function("default search in 4 dimensions", |b| {
        b.iter(|| maximize(hill, black_box(&Search::default())));
    });
    c.bench_function("pointwise factor of a Phong lobe, default settings", |b| {
        b.iter(|| {
            Normalization::of(&phong, Mode::Pointwise, &Sampling::default(), &Options::default())
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = points, albedo, table, factor
}
criterion_main!(benches);
