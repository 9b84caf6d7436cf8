//! Time of a point in a batch of 1024 that is in the cache, look-up included, for each kind of
//! instructions that the processor has.
//!
//! Callgrind, which knows no AVX-512, counts the instructions of the others.

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{
    Batch, Cloth, Highlight, Instructions, Noise, Shader, Thread, Weave, Yarn,
};

#[path = "support/count.rs"]
mod count;

/// Points of a batch.
const POINTS: usize = 1024;

/// What the fabrics are called that are shaded.
const FABRICS: [&str; 6] = ["staple", "filament", "rough", "noise", "gaps", "mixed"];

/// The last one has yarns of both kinds, gaps and noise.
fn shader(fabric: &str) -> Shader {
    let yarn = Yarn::default();
    let noise = Noise { intensity: 1.0, ..Noise::default() };
    let yarn = match fabric {
        "filament" => Yarn { psi: 0.0, ..yarn },
        "rough" => Yarn { highlight: Highlight::Rough { sigma: 0.15 }, ..yarn },
        "noise" => Yarn { noise, ..yarn },
        "gaps" => Yarn { size: 0.8, ..yarn },
        "mixed" => Yarn { size: 0.8, noise, ..yarn },
        _ => yarn,
    };
    let weave = Weave::new(60, 60, |end, pick| (3 * pick + end) % 8 != 0).expect("60 by 60");
    let diameter = Some(5e-4 * yarn.size);
    let thread = Thread { color: [0.4; 3], pitch: Some(5e-4), diameter, ..Thread::default() };
    let mut cloth =
        Cloth::from_threads(weave, &[thread; 60], &[thread; 60], &yarn).expect("60 threads each");
    if fabric == "mixed" {
        let filament = Yarn { psi: 0.0, ..cloth.yarns[0].clone() };
        cloth.yarns.push(filament);
        let second = (cloth.yarns.len() - 1) as u16;
        cloth.pick_yarns.fill(second);
    }
    cloth.prepare().expect("valid")
}

/// Points and what is made of them.
struct Data {
    uv: [Vec<f64>; 2],
    wi: [Vec<f32>; 3],
    wo: [Vec<f32>; 3],
    out: [Vec<f32>; 3],
    /// Groups of four that lie close together.
    lobes: [Vec<f32>; 3],
    pdf: Vec<f32>,
}

impl Data {
    fn new() -> Self {
        let empty = || [(); 3].map(|()| Vec::new());
        let mut data = Self {
            uv: [Vec::new(), Vec::new()],
            wi: empty(),
            wo: empty(),
            out: empty().map(|_: Vec<f32>| vec![0.0; POINTS]),
            lobes: empty().map(|_: Vec<f32>| vec![0.0; POINTS]),
            pdf: vec![0.0; POINTS],
        };
        for [a, b, c, d, e, f] in
            Halton::<6>::new().points_from(std::num::NonZeroU32::MIN).take(POINTS)
        {
            let direction = |x, y| square_to_cosine_hemisphere(DVec2::new(x, y)).as_vec3();
            let (wi, wo) = (direction(c, d), direction(e, f));
            data.uv[0].push(0.03 * a);
            data.uv[1].push(0.03 * b);
            for axis in 0..3 {
                data.wi[axis].push(wi[axis]);
                data.wo[axis].push(wo[axis]);
            }
        }
        data
    }
}

type Call = fn(&Shader, &mut Data);

const CALLS: [(&str, Call); 4] = [
    ("eval", |shader, data| {
        let Data { uv: [u, v], wi: [a, b, c], wo: [d, e, f], out, .. } = data;
        let batch = Batch { uv: [u, v], wi: [a, b, c], wo: [d, e, f], active: None };
        let out = out.each_mut().map(Vec::as_mut_slice);
        shader.eval_batch(black_box(&batch), out).expect("equal lengths");
    }),
    ("pdf", |shader, data| {
        let Data { uv: [u, v], wi: [a, b, c], wo: [d, e, f], out, .. } = data;
        let batch = Batch { uv: [u, v], wi: [a, b, c], wo: [d, e, f], active: None };
        shader.pdf_batch(black_box(&batch), &mut out[0]).expect("equal lengths");
    }),
    ("lobes and pdf", |shader, data| {
        let Data { uv: [u, v], wi: [a, b, c], wo: [d, e, f], out, lobes, pdf } = data;
        let batch = Batch { uv: [u, v], wi: [a, b, c], wo: [d, e, f], active: None };
        let [out, lobes] = [out, lobes].map(|part| part.each_mut().map(Vec::as_mut_slice));
        shader.eval_lobes_pdf_batch(black_box(&batch), out, lobes, pdf).expect("equal lengths");
    }),
    ("lobes and pdf one by one", |shader, data| {
        for k in 0..POINTS {
            let [wi, wo] =
                [&data.wi, &data.wo].map(|w| Vec3::from_array([0, 1, 2].map(|c| w[c][k])));
            let uv = black_box(DVec2::new(data.uv[0][k], data.uv[1][k]));
            black_box(shader.eval_lobes(uv, wi, wo));
            data.pdf[k] = shader.pdf(uv, wi, wo);
        }
    }),
];

fn time(c: &mut Criterion) {
    let mut data = Data::new();
    for fabric in FABRICS {
        let mut shader = shader(fabric);
        for instructions in Instructions::available() {
            assert!(shader.use_instructions(instructions));
            let mut group = c.benchmark_group(format!("{instructions:?}"));
            group.throughput(Throughput::Elements(POINTS as u64));
            for (name, call) in CALLS {
                group.bench_function(format!("{name}/{fabric}"), |bencher| {
                    bencher.iter(|| call(&shader, &mut data));
                });
            }
        }
    }
}

/// Makes the calls that `task` tells of: fabric, instructions, number and name.
fn run(task: &str) {
    // The name, which may be several words, last.
    let mut parts = task.splitn(4, ' ');
    let mut next = || parts.next().expect("fabric, instructions, number and call");
    let (mut shader, instructions, number, name) = (shader(next()), next(), next(), next());
    let wanted = |known: &Instructions| format!("{known:?}") == instructions;
    let instructions = Instructions::available().into_iter().find(wanted).expect("available");
    assert!(shader.use_instructions(instructions));
    let (_, call) = CALLS.into_iter().find(|(known, _)| *known == name).expect("a known call");
    let mut data = Data::new();
    for _ in 0..number.parse().expect("a number") {
        call(&shader, black_box(&mut data));
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
        for instructions in Instructions::available() {
            for (name, _) in CALLS {
                let count = |number: u32| {
                    count::instructions(&format!("{fabric} {instructions:?} {number} {name}"), None)
                };
                if let (Some(before), Some(all)) = (count(1), count(11)) {
                    let each = (all - before) as f64 / (10 * POINTS) as f64;
                    println!("{instructions:?}/{name}/{fabric}: {each:.0} instructions a point");
                }
            }
        }
    }
}
