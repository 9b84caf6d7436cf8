//! What the C interface adds to a call of Rust: the least time of many runs, taken in turns so that a busy
//! machine is as unfair to one as to the other.
//!
//! `cargo bench -p selvedge-ffi`

use std::hint::black_box;
use std::ptr;
use std::time::Instant;

use glam::{DVec2, Vec3};
use selvedge::*;
use selvedge_yarn_brdf::{Batch, Fabric as Yarns, Lobes, Thread, Weave};

const POINTS: usize = 1024;
const RUNS: usize = 400;

fn main() {
    let warp_up: Vec<u8> = (0..64).map(|i| u8::from((i / 8 + i % 8) % 4 < 2)).collect();
    let weave = Weave::new(8, 8, |end, pick| warp_up[(8 * pick + end) as usize] != 0);
    let thread = Thread { pitch: Some(5e-4), ..Thread::default() };
    let cloth = Yarns::default().cloth(weave.expect("64 crossings"), &[thread; 8], &[thread; 8]);
    let rust = cloth.and_then(|cloth| cloth.prepare()).expect("the default fabric is valid");
    let c = shader(&warp_up);

    let turn = |i: usize, by: f64| (i as f64 * by).fract();
    let uv: Vec<[f64; 2]> =
        (0..POINTS).map(|i| [0.03 * turn(i, 0.618_034), 0.03 * turn(i, 0.754_878)]).collect();
    let directions: Vec<[f32; 3]> = (0..2 * POINTS)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * turn(i, 0.569_840)).sin_cos();
            let z = 0.1 + 0.9 * turn(i, 0.819_173);
            let r = (1.0 - z * z).sqrt();
            [r * cos, r * sin, z].map(|x| x as f32)
        })
        .collect();
    let (wi, wo) = directions.split_at(POINTS);
    let mut f = vec![[0.0_f32; 3]; POINTS];
    let mut g = f.clone();
    let each = |component: &[[f32; 3]]| Vectors {
        component: [0, 1, 2].map(|k| component.as_ptr().cast::<f32>().wrapping_add(k)),
        stride: 12,
    };
    let nothing = Vectors { component: [ptr::null(); 3], stride: 0 };
    let points = Points {
        struct_size: size_of::<Points>(),
        count: POINTS,
        uv: Positions {
            component: [0, 1].map(|k| uv.as_ptr().cast::<f64>().wrapping_add(k)),
            stride: 16,
        },
        wi: each(wi),
        wo: each(wo),
        xi: nothing,
        footprint: Numbers { values: ptr::null(), stride: 0 },
        active: Flags { values: ptr::null(), stride: 0 },
        lobes: 0,
        sides: 0,
    };
    let to = VectorsOut {
        component: [0, 1, 2].map(|k| g.as_mut_ptr().cast::<f32>().wrapping_add(k)),
        stride: 12,
    };

    // The same points, component by component.
    let plane = |of: &[[f32; 3]], k: usize| of.iter().map(|w| w[k]).collect::<Vec<_>>();
    let [u, v] = [0, 1].map(|k| uv.iter().map(|uv| uv[k]).collect::<Vec<_>>());
    let (wi_planes, wo_planes) = ([0, 1, 2].map(|k| plane(wi, k)), [0, 1, 2].map(|k| plane(wo, k)));
    let mut planes = [(); 3].map(|()| vec![0.0_f32; POINTS]);
    let in_planes = |planes: &[Vec<f32>; 3]| Vectors {
        component: planes.each_ref().map(Vec::as_ptr),
        stride: 4,
    };
    let apart = Points {
        uv: Positions { component: [u.as_ptr(), v.as_ptr()], stride: 8 },
        wi: in_planes(&wi_planes),
        wo: in_planes(&wo_planes),
        ..points
    };
    let to_apart = VectorsOut { component: planes.each_mut().map(Vec::as_mut_ptr), stride: 4 };
    let batch = Batch {
        uv: [&u, &v],
        wi: wi_planes.each_ref().map(Vec::as_slice),
        wo: wo_planes.each_ref().map(Vec::as_slice),
        active: None,
    };
    let mut of_planes = [(); 3].map(|()| vec![0.0_f32; POINTS]);

    let (mut of_rust, mut of_batch, mut of_single) = (f64::MAX, f64::MAX, f64::MAX);
    let (mut of_rust_batch, mut of_apart) = (f64::MAX, f64::MAX);
    for _ in 0..RUNS {
        time(&mut of_rust, || {
            for i in 0..POINTS {
                let Lobes { specular, diffuse } = black_box(&rust).eval_lobes(
                    DVec2::from(uv[i]),
                    Vec3::from(wi[i]),
                    Vec3::from(wo[i]),
                );
                f[i] = (specular + diffuse).into();
            }
            black_box(&mut f);
        });
        time(&mut of_batch, || {
            // SAFETY: the arrays have as many points.
            let status = unsafe {
                selvedge_shader_eval_batch(c, &raw const points, ptr::null_mut(), 0, &raw const to)
            };
            assert_eq!(black_box(status), Status::Ok);
        });
        time(&mut of_apart, || {
            let (points, to) = (&raw const apart, &raw const to_apart);
            // SAFETY: the arrays have as many points.
            let status = unsafe { selvedge_shader_eval_batch(c, points, ptr::null_mut(), 0, to) };
            assert_eq!(black_box(status), Status::Ok);
        });
        time(&mut of_rust_batch, || {
            let to = of_planes.each_mut().map(Vec::as_mut_slice);
            black_box(&rust).eval_batch(&batch, to).expect("all are equally long");
        });
        time(&mut of_single, || {
            for i in 0..POINTS {
                // SAFETY: the shader lives, and the arrays have two and three numbers.
                unsafe {
                    let (uv, wi, wo) = (uv[i].as_ptr(), wi[i].as_ptr(), wo[i].as_ptr());
                    selvedge_shader_eval(black_box(c), uv, 0.0, wi, wo, f[i].as_mut_ptr());
                }
            }
            black_box(&mut f);
        });
    }
    assert_eq!(f, g, "one by one and all at once differ");
    println!("eval, ns per point, least of {RUNS} runs over {POINTS} points:");
    println!("one by one: Rust {of_rust:.1}, C {of_single:.1} ({:+.1} ns)", of_single - of_rust);
    for (layout, time) in [("structures of arrays", of_apart), ("arrays of structures", of_batch)] {
        let more = 100.0 * (time / of_rust_batch - 1.0);
        println!("at once: Rust {of_rust_batch:.2}, C from {layout} {time:.2} ({more:+.1} %)");
    }
    // SAFETY: made by `shader`.
    unsafe { selvedge_shader_free(c) };
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
