//! What the C interface adds to a call of Rust: the least time of many runs, taken in turns so that a busy
//! machine is as unfair to one as to the other.
//!
//! `cargo bench -p selvedge-ffi`

use std::hint::black_box;
use std::time::Instant;
use std::{array, ptr};

use glam::{DVec2, Vec3};
use selvedge::*;
use selvedge_yarn_brdf::{Batch, Draws, Fabric as Yarns, Lobes, Samples, Thread, Weave};

const POINTS: usize = 1024;
const RUNS: usize = 400;

fn main() {
    let warp_up: Vec<u8> = (0..64).map(|i| u8::from((i / 8 + i % 8) % 4 < 2)).collect();
    let weave = Weave::new(8, 8, |end, pick| warp_up[(8 * pick + end) as usize] != 0);
    let thread = Thread { pitch: Some(5e-4), ..Thread::default() };
    let cloth = Yarns::default().cloth(weave.expect("64 crossings"), &[thread; 8], &[thread; 8]);
    let rust = cloth.and_then(|cloth| cloth.prepare()).expect("the default fabric is valid");
    let c = shader(&warp_up);
    let points: Vec<Point> = (0..POINTS).map(Point::of).collect();
    println!("ns per point, least of {RUNS} runs over {POINTS} points");
    one_by_one(&rust, c, &points);
    at_once(&rust, c, &points);
    // SAFETY: made by `shader`.
    unsafe { selvedge_shader_free(c) };
}

struct Point {
    uv: [f64; 2],
    wi: [f32; 3],
    wo: [f32; 3],
    xi: [f32; 3],
}

impl Point {
    /// Somewhere on the cloth, with directions in front of it.
    fn of(i: usize) -> Self {
        let turn = |i: usize, by: f64| (i as f64 * by).fract();
        let direction = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * turn(i, 0.569_840)).sin_cos();
            let z = 0.1 + 0.9 * turn(i, 0.819_173);
            let r = (1.0 - z * z).sqrt();
            [r * cos, r * sin, z].map(|x| x as f32)
        };
        Self {
            uv: [0.03 * turn(i, 0.618_034), 0.03 * turn(i, 0.754_878)],
            wi: direction(i),
            wo: direction(POINTS + i),
            xi: [0.671_044, 0.450_350, 0.302_233].map(|by| turn(i, by) as f32),
        }
    }
}

fn one_by_one(rust: &selvedge_yarn_brdf::Shader, c: *const Shader, points: &[Point]) {
    let (mut of_rust, mut of_c) = (f64::MAX, f64::MAX);
    let mut f = vec![[0.0_f32; 3]; POINTS];
    let mut g = f.clone();
    for _ in 0..RUNS {
        time(&mut of_rust, || {
            for (f, Point { uv, wi, wo, .. }) in f.iter_mut().zip(points) {
                let (uv, wi, wo) = (DVec2::from(*uv), Vec3::from(*wi), Vec3::from(*wo));
                let Lobes { specular, diffuse } = black_box(rust).eval_lobes(uv, wi, wo);
                *f = (specular + diffuse).into();
            }
            black_box(&mut f);
        });
        time(&mut of_c, || {
            for (g, Point { uv, wi, wo, .. }) in g.iter_mut().zip(points) {
                let (uv, wi, wo) = (uv.as_ptr(), wi.as_ptr(), wo.as_ptr());
                // SAFETY: the shader lives, and the arrays have two and three numbers.
                unsafe { selvedge_shader_eval(black_box(c), uv, 0.0, wi, wo, g.as_mut_ptr()) };
            }
            black_box(&mut g);
        });
    }
    assert_eq!(f, g, "Rust and C differ");
    println!("eval, one by one: Rust {of_rust:.1}, C {of_c:.1} ({:+.1} ns)", of_c - of_rust);
}

/// Where something lies, in `f32`s: that of the first point, and on to the next component and point.
#[derive(Clone, Copy)]
struct Place(usize, usize, usize);

/// Distance of arrays, a bit more than a page, as if each were allocated by itself.
const APART: usize = POINTS + 16;

/// Where uv (two `f32`s each), wi, wo and xi lie, and where wi, weight or f, and pdf go.
const LAYOUTS: [(&str, [Place; 7]); 3] = [
    (
        "structures of arrays",
        [
            Place(0, 2 * APART, 2),
            Place(4 * APART, APART, 1),
            Place(7 * APART, APART, 1),
            Place(10 * APART, APART, 1),
            Place(13 * APART, APART, 1),
            Place(16 * APART, APART, 1),
            Place(19 * APART, APART, 1),
        ],
    ),
    (
        "arrays of vectors",
        [
            Place(0, 2, 4),
            Place(4 * APART, 1, 3),
            Place(7 * APART, 1, 3),
            Place(10 * APART, 1, 3),
            Place(13 * APART, 1, 3),
            Place(16 * APART, 1, 3),
            Place(19 * APART, 1, 1),
        ],
    ),
    (
        "arrays of structures",
        [
            Place(0, 2, 14),
            Place(4, 1, 14),
            Place(7, 1, 14),
            Place(10, 1, 14),
            Place(14 * APART, 1, 7),
            Place(14 * APART + 3, 1, 7),
            Place(14 * APART + 6, 1, 7),
        ],
    ),
];

/// Memory in which points lie in one of these layouts.
struct Memory {
    of: [Place; 7],
    words: Vec<f32>,
}

impl Memory {
    fn new(of: [Place; 7], points: &[Point]) -> Self {
        let mut words = vec![0.0; 21 * APART];
        for (i, point) in points.iter().enumerate() {
            for (k, uv) in point.uv.iter().enumerate() {
                let bits = uv.to_ne_bytes();
                let at = of[0].0 + of[0].1 * k + of[0].2 * i;
                for (word, bytes) in words[at..].iter_mut().zip(bits.as_chunks::<4>().0) {
                    *word = f32::from_ne_bytes(*bytes);
                }
            }
            for (Place(first, next, step), w) in of[1..].iter().zip([point.wi, point.wo, point.xi])
            {
                for (k, x) in w.into_iter().enumerate() {
                    words[first + next * k + step * i] = x;
                }
            }
        }
        Self { of, words }
    }

    fn points(&self) -> Points {
        let [uv, wi, wo, xi, ..] = self.of;
        let start = self.words.as_ptr();
        let vectors = |Place(first, next, step): Place| Vectors {
            component: [0, 1, 2].map(|k| start.wrapping_add(first + next * k)),
            stride: 4 * step as isize,
        };
        Points {
            struct_size: size_of::<Points>(),
            count: POINTS,
            uv: Positions {
                component: [0, 1].map(|k| start.wrapping_add(uv.0 + uv.1 * k).cast()),
                stride: 4 * uv.2 as isize,
            },
            wi: vectors(wi),
            wo: vectors(wo),
            xi: vectors(xi),
            footprint: Numbers { values: ptr::null(), stride: 0 },
            active: Flags { values: ptr::null(), stride: 0 },
            lobes: 0,
            sides: 0,
        }
    }

    /// Where wi and weight go, and the density.
    fn outputs(&mut self) -> ([VectorsOut; 2], NumbersOut) {
        let [.., wi, weight, pdf] = self.of;
        let start = self.words.as_mut_ptr();
        let vectors = |Place(first, next, step): Place| VectorsOut {
            component: [0, 1, 2].map(|k| start.wrapping_add(first + next * k)),
            stride: 4 * step as isize,
        };
        let pdf = NumbersOut { values: start.wrapping_add(pdf.0), stride: 4 * pdf.2 as isize };
        ([wi, weight].map(vectors), pdf)
    }

    /// What has been found at point `i`.
    fn found(&self, i: usize) -> [f32; 7] {
        let [.., wi, weight, pdf] = self.of;
        array::from_fn(|k| {
            let Place(first, next, step) = [wi, weight, pdf][k / 3];
            self.words[first + next * (k % 3) + step * i]
        })
    }
}

fn at_once(rust: &selvedge_yarn_brdf::Shader, c: *const Shader, points: &[Point]) {
    let uv = [0, 1].map(|k| points.iter().map(|p| p.uv[k]).collect::<Vec<_>>());
    let [wi, wo, xi] = [|p: &Point| p.wi, |p: &Point| p.wo, |p: &Point| p.xi]
        .map(|of| [0, 1, 2].map(|k| points.iter().map(|p| of(p)[k]).collect::<Vec<_>>()));
    let uv = uv.each_ref().map(Vec::as_slice);
    let [wi, wo, xi] = [&wi, &wo, &xi].map(|of| of.each_ref().map(Vec::as_slice));
    let batch = Batch { uv, wi, wo, active: None };
    let draws = Draws { uv, wo, xi, active: None };
    let mut planes: [Vec<f32>; 7] = array::from_fn(|_| vec![0.0; POINTS]);
    let mut turned = Turned::new(points);
    let mut memories = LAYOUTS.map(|(_, of)| Memory::new(of, points));

    for call in ["eval", "pdf", "sample"] {
        let mut of_rust = f64::MAX;
        let mut of_c = [f64::MAX; LAYOUTS.len()];
        let mut of_turning = [f64::MAX; LAYOUTS.len()];
        for _ in 0..RUNS {
            time(&mut of_turning[1], || turned.vectors(black_box(rust), call));
            time(&mut of_turning[2], || turned.structures(black_box(rust), call, points));
            let [x, y, z, r, g, b, pdf] = planes.each_mut().map(Vec::as_mut_slice);
            time(&mut of_rust, || {
                let (wi, weight) = ([x, y, z], [r, g, b]);
                match call {
                    "eval" => black_box(rust).eval_batch(&batch, weight),
                    "pdf" => black_box(rust).pdf_batch(&batch, pdf),
                    _ => black_box(rust).sample_batch(&draws, Samples { wi, weight, pdf }),
                }
                .expect("all are equally long");
            });
            for (memory, of_c) in memories.iter_mut().zip(&mut of_c) {
                let points = memory.points();
                let ([wi, weight], pdf) = memory.outputs();
                let (points, wi, weight) = (&raw const points, &raw const wi, &raw const weight);
                let (pdf, none) = (&raw const pdf, ptr::null_mut());
                // SAFETY: there are as many points and places in the memory.
                time(of_c, || unsafe {
                    let status = match call {
                        "eval" => selvedge_shader_eval_batch(c, points, none, 0, weight),
                        "pdf" => selvedge_shader_pdf_batch(c, points, none, 0, pdf),
                        _ => selvedge_shader_sample_batch(c, points, none, 0, wi, weight, pdf),
                    };
                    assert_eq!(black_box(status), Status::Ok);
                });
            }
        }
        for (memory, (name, _)) in memories.iter().zip(LAYOUTS) {
            for i in 0..POINTS {
                let expected = planes.each_ref().map(|plane| plane[i]);
                // Where there is no sample, C has a unit vector.
                let skipped = if expected[6] == 0.0 { 3 } else { 0 };
                assert_eq!(memory.found(i)[skipped..], expected[skipped..], "{call}, {name}, {i}");
            }
        }
        of_turning[0] = of_rust;
        for (((name, _), of_c), of_rust) in LAYOUTS.iter().zip(of_c).zip(of_turning) {
            let more = 100.0 * (of_c / of_rust - 1.0);
            println!("{call}, {name}: Rust {of_rust:.2}, C {of_c:.2} ({more:+.1} %)");
        }
    }
}

/// What a caller of Rust does whose points do not lie in slices of components: turns them round for the batch,
/// and what it returns back.
struct Turned {
    /// The points as arrays of vectors, and what is found there.
    uv: Vec<[f64; 2]>,
    vectors: [Vec<[f32; 3]>; 3],
    found: [Vec<[f32; 3]>; 2],
    pdf: Vec<f32>,
    /// What is found as an array of structures: wi, weight or f, and pdf.
    structures: Vec<[f32; 7]>,
    /// Slices of components.
    places: [Vec<f64>; 2],
    parts: [[Vec<f32>; 3]; 2],
    planes: [Vec<f32>; 7],
}

impl Turned {
    fn new(points: &[Point]) -> Self {
        let vectors = [|p: &Point| p.wi, |p: &Point| p.wo, |p: &Point| p.xi]
            .map(|of| points.iter().map(of).collect());
        let plane = || vec![0.0; POINTS];
        Self {
            uv: points.iter().map(|point| point.uv).collect(),
            vectors,
            found: [(); 2].map(|()| vec![[0.0; 3]; POINTS]),
            pdf: plane(),
            structures: vec![[0.0; 7]; POINTS],
            places: [(); 2].map(|()| vec![0.0; POINTS]),
            parts: [(); 2].map(|()| [(); 3].map(|()| plane())),
            planes: [(); 7].map(|()| plane()),
        }
    }

    fn vectors(&mut self, rust: &selvedge_yarn_brdf::Shader, call: &str) {
        let [wi, wo, xi] = &self.vectors;
        let first = if call == "sample" { xi } else { wi };
        turn(&mut self.places, self.uv.iter().copied());
        turn(&mut self.parts[0], first.iter().copied());
        turn(&mut self.parts[1], wo.iter().copied());
        self.shade(rust, call);
        let [x, y, z, r, g, b, pdf] = &self.planes;
        let [wi, weight] = &mut self.found;
        if call == "sample" {
            turn_back(wi, [x, y, z]);
        }
        if call != "pdf" {
            turn_back(weight, [r, g, b]);
        }
        if call != "eval" {
            self.pdf.copy_from_slice(pdf);
        }
        black_box((&mut self.found, &mut self.pdf));
    }

    fn structures(&mut self, rust: &selvedge_yarn_brdf::Shader, call: &str, points: &[Point]) {
        let first = |p: &Point| if call == "sample" { p.xi } else { p.wi };
        turn(&mut self.places, points.iter().map(|p| p.uv));
        turn(&mut self.parts[0], points.iter().map(first));
        turn(&mut self.parts[1], points.iter().map(|p| p.wo));
        self.shade(rust, call);
        let first = match call {
            "sample" => 0,
            "eval" => 3,
            _ => 6,
        };
        let last = if call == "eval" { 6 } else { 7 };
        for (k, plane) in self.planes.iter().enumerate().take(last).skip(first) {
            for (structure, &x) in self.structures.iter_mut().zip(plane) {
                structure[k] = x;
            }
        }
        black_box(&mut self.structures);
    }

    fn shade(&mut self, rust: &selvedge_yarn_brdf::Shader, call: &str) {
        let uv = self.places.each_ref().map(Vec::as_slice);
        let [first, wo] = self.parts.each_ref().map(|of| of.each_ref().map(Vec::as_slice));
        let [x, y, z, r, g, b, pdf] = self.planes.each_mut().map(Vec::as_mut_slice);
        let (wi, weight) = ([x, y, z], [r, g, b]);
        let batch = Batch { uv, wi: first, wo, active: None };
        match call {
            "eval" => rust.eval_batch(&batch, weight),
            "pdf" => rust.pdf_batch(&batch, pdf),
            _ => {
                let draws = Draws { uv, wo, xi: first, active: None };
                rust.sample_batch(&draws, Samples { wi, weight, pdf })
            }
        }
        .expect("all are equally long");
    }
}

/// Sets `parts` to the components of as many `vectors`.
fn turn<T: Copy, const N: usize>(
    parts: &mut [Vec<T>; N],
    vectors: impl ExactSizeIterator<Item = [T; N]>,
) {
    let mut parts = parts.each_mut().map(|part| &mut part[..vectors.len()]);
    for (i, vector) in vectors.enumerate() {
        for (part, x) in parts.iter_mut().zip(vector) {
            part[i] = x;
        }
    }
}

fn turn_back(vectors: &mut [[f32; 3]], [x, y, z]: [&Vec<f32>; 3]) {
    for (vector, ((&x, &y), &z)) in vectors.iter_mut().zip(x.iter().zip(y).zip(z)) {
        *vector = [x, y, z];
    }
}

/// Keeps the least time of a point, ns.
fn time(least: &mut f64, run: impl FnOnce()) {
    let start = Instant::now();
    run();
    *least = least.min(start.elapsed().as_secs_f64() * 1e9 / POINTS as f64);
}

/// A shader of the default fabric, made through the C interface.
fn shader(warp_up: &[u8]) -> *const Shader {
    let pattern = Pattern {
        struct_size: size_of::<Pattern>(),
        ends: 8,
        picks: 8,
        warp_up: warp_up.as_ptr(),
        end_types: ptr::null(),
        pick_types: ptr::null(),
        end_colors: ptr::null(),
        pick_colors: ptr::null(),
        end_pitch: 5e-4,
        pick_pitch: 5e-4,
        end_diameters: ptr::null(),
        pick_diameters: ptr::null(),
    };
    let (mut draft, mut fabric, mut shader) = (ptr::null_mut(), ptr::null_mut(), ptr::null());
    let (none, json) = (ptr::null_mut(), ptr::null());
    // SAFETY: the pattern has 64 crossings; what is made is freed but for the shader.
    unsafe {
        selvedge_draft_from_pattern(&raw const pattern, none, 0, &raw mut draft);
        selvedge_fabric_new(draft, json, 0, none, 0, &raw mut fabric);
        assert_eq!(selvedge_shader_new(fabric, none, 0, &raw mut shader), Status::Ok);
        selvedge_fabric_free(fabric);
        selvedge_draft_free(draft);
    }
    shader
}
