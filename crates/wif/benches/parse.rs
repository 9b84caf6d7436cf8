//! How fast files become drafts, and drafts drawdowns.
//!
//! Two files: one the size of the largest real drafts found (366 kB: 8,208 picks of a lift
//! plan), and one of 20 MB. Parsing is given in bytes and in threads per second. The drawdown is
//! of a lift plan of 10,000 by 10,000 threads on 32 shafts.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use selvedge_wif::{Draft, parse};

/// A draft whose lists look random but are always the same.
fn draft(ends: u32, picks: u32, shafts: u32) -> Draft {
    let mut state = 1_u32;
    let mut random = move |below: u32| {
        // Numerical Recipes' linear congruential generator; its high bits are good enough.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % below
    };
    let mut draft = Draft::new(ends, picks);
    draft.shafts = shafts;
    for end in 0..ends {
        draft.threading.set(end, &[random(shafts)]);
        draft.warp.colors.insert(end, random(8) + 1);
    }
    for pick in 0..picks {
        let lifted: Vec<u32> = (0..shafts).filter(|_| random(2) == 0).collect();
        draft.liftplan.set(pick, &lifted);
        draft.weft.colors.insert(pick, random(8) + 1);
    }
    for color in 1..=8 {
        draft.palette.colors.insert(color, [color * 30, 255 - color * 30, random(256)]);
    }
    draft
}

fn parsing(c: &mut Criterion) {
    for (name, ends, picks, shafts) in
        [("366 kB", 552, 8_208, 24), ("20 MB", 100_000, 100_000, 126)]
    {
        let text = draft(ends, picks, shafts).to_wif();
        let mut group = c.benchmark_group(format!("parse {name}"));
        group.sample_size(20);
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.bench_function("bytes", |b| b.iter(|| parse(black_box(text.as_bytes()))));
        group.throughput(Throughput::Elements(u64::from(ends + picks)));
        group.bench_function("threads", |b| b.iter(|| parse(black_box(text.as_bytes()))));
        group.finish();
    }
}

fn drawdown(c: &mut Criterion) {
    let draft = draft(10_000, 10_000, 32);
    let mut group = c.benchmark_group("drawdown 10,000 x 10,000");
    group.sample_size(20);
    group.throughput(Throughput::Elements(10_000 * 10_000));
    group.bench_function("lift plan", |b| b.iter(|| black_box(&draft).drawdown()));
    let jacquard = {
        let mut jacquard = Draft::new(10_000, 10_000);
        jacquard.shafts = 10_000;
        for thread in 0..10_000 {
            jacquard.threading.set(thread, &[thread]);
            let lifted: Vec<u32> =
                (0..10_000).filter(|end| (end * 7 + thread * 3) % 16 < 8).collect();
            jacquard.liftplan.set(thread, &lifted);
        }
        jacquard
    };
    group.sample_size(10);
    group.bench_function("a shaft for each end", |b| b.iter(|| black_box(&jacquard).drawdown()));
    let cloth = draft.drawdown().expect("the draft is complete");
    group.bench_function("repeat", |b| b.iter(|| black_box(&cloth).repeat()));
    group.finish();
}

criterion_group!(
    name = benches;
    config = Criterion::default().without_plots();
    targets = parsing, drawdown
);
criterion_main!(benches);
