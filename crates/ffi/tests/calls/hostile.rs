//! A host that does all wrong that can be told from right.

use std::ffi::CStr;
use std::{array, ptr, thread};

use selvedge::*;

use crate::{Loaded, common};

/// Points that are nowhere, all arrays of one stride.
fn nowhere(count: usize, stride: isize, start: usize) -> Points {
    let vectors = Vectors { component: [ptr::without_provenance(start); 3], stride };
    Points {
        struct_size: size_of::<Points>(),
        count,
        uv: Positions { component: [ptr::without_provenance(start); 2], stride: 2 * stride },
        wi: vectors,
        wo: vectors,
        xi: vectors,
        footprint: Numbers { values: ptr::null(), stride },
        active: Flags { values: ptr::null(), stride },
        lobes: 0,
        sides: 0,
    }
}

/// What all calls for many points answer, the outputs being where the inputs are.
fn batches(shader: *const Shader, points: &Points, start: usize) -> [Status; 9] {
    let stride = points.wi.stride;
    let vectors = VectorsOut { component: [ptr::without_provenance_mut(start); 3], stride };
    let numbers = NumbersOut { values: ptr::without_provenance_mut(start), stride };
    let mut yarn_point = YarnPoint { struct_size: size_of::<YarnPoint>(), ..nothing() };
    let (p, v, n) = (&raw const *points, &raw const vectors, &raw const numbers);
    let (none, to) = (ptr::null_mut(), &raw mut yarn_point);
    // SAFETY: there is not a point, or more than memory can hold.
    unsafe {
        [
            selvedge_shader_eval_batch(shader, p, none, 0, v),
            selvedge_shader_eval_lobes_batch(shader, p, none, 0, v, v),
            selvedge_shader_pdf_batch(shader, p, none, 0, n),
            selvedge_shader_reverse_pdf_batch(shader, p, none, 0, n),
            selvedge_shader_eval_pdf_batch(shader, p, none, 0, v, n),
            selvedge_shader_sample_batch(shader, p, none, 0, v, v, n),
            selvedge_shader_albedo_batch(shader, p, none, 0, v),
            selvedge_shader_opacity_batch(shader, p, none, 0, n),
            selvedge_shader_yarn_at_batch(shader, p, none, 0, to),
        ]
    }
}

fn nothing() -> YarnPoint {
    // SAFETY: any bits are a struct of numbers.
    unsafe { std::mem::zeroed() }
}

#[test]
fn no_points_are_no_failure_wherever_they_are() {
    let loaded = Loaded::new("drafts/plain.wif");
    for start in [0, 4, 1, usize::MAX, usize::MAX - 3] {
        for stride in [4, 0, 12, -4, isize::MAX / 2, isize::MIN / 2] {
            let found = batches(loaded.shader, &nowhere(0, stride, start), start);
            assert_eq!(found, [Status::Ok; 9], "{start} {stride}");
        }
    }
}

#[test]
fn more_points_than_memory_can_hold_are_refused() {
    let loaded = Loaded::new("drafts/plain.wif");
    for (count, stride) in [
        (usize::MAX, 4),
        (usize::MAX, 0),
        (isize::MAX as usize, 4),
        (isize::MAX as usize / 4 + 1, 4),
        (2, isize::MIN / 2),
        (3, isize::MAX / 4 + 1),
    ] {
        let found = batches(loaded.shader, &nowhere(count, stride, 4), 4);
        assert_eq!(found, [Status::InvalidArgument; 9], "{count} {stride}");
    }
    // What lies one after the other whatever the strides.
    let points = nowhere(isize::MAX as usize / size_of::<YarnPoint>() + 1, 0, 8);
    let mut to = YarnPoint { struct_size: size_of::<YarnPoint>(), ..nothing() };
    // SAFETY: more points than memory can hold are not looked at.
    let status = unsafe {
        let (points, none) = (&raw const points, ptr::null_mut());
        selvedge_shader_yarn_at_batch(loaded.shader, points, none, 0, &raw mut to)
    };
    assert_eq!(status, Status::InvalidArgument);
}

#[test]
fn parameters_may_be_at_their_limits_and_no_further() {
    let none = ptr::null_mut();
    for at_high in [false, true] {
        let loaded = Loaded::new("drafts/plain.wif");
        // SAFETY: the fabric is freed on drop only; structs tell their size, arrays have three numbers.
        unsafe {
            for index in 0..selvedge_parameter_count() {
                let mut parameter: Parameter = std::mem::zeroed();
                parameter.struct_size = size_of::<Parameter>();
                let status = selvedge_parameter_describe(index, none, 0, &raw mut parameter);
                assert_eq!(status, Status::Ok);
                let Parameter { name, low, high, .. } = &parameter;
                let (name, limit) =
                    (CStr::from_ptr(name.as_ptr()), if at_high { high } else { low });
                let set_to = |value: [f64; 3]| {
                    selvedge_fabric_set_value(loaded.fabric, 0, index, value.as_ptr(), none, 0)
                };
                let set = |value| set_to([value; 3]);
                for bad in [low.next_down(), high.next_up(), f64::NAN, f64::INFINITY, f64::MIN] {
                    assert!(set(bad) != Status::Ok, "{name:?} {bad}");
                }
                let status = set(*limit);
                // A tabulated phase function takes a table; other yarn has other parameters.
                let is_absent = status == Status::Absent;
                assert!(status == Status::Ok || is_absent, "{name:?} {limit}: {status:?}");
                // With these at their greatest a shader takes a minute to prepare.
                if at_high && [c"kappa", c"beta", c"noise.u_max"].contains(&name) && !is_absent {
                    assert_eq!(set_to(parameter.default_value), Status::Ok, "{name:?}");
                }
            }
            let mut shader = ptr::dangling();
            let status = selvedge_shader_new(loaded.fabric, none, 0, &raw mut shader);
            if status == Status::Ok {
                shades_finitely(shader, at_high);
                selvedge_shader_free(shader);
            } else {
                assert_eq!((status, shader), (Status::InvalidCloth, ptr::dangling()));
            }
        }
    }
}

/// Whether all that is found at some points is a number, of points and of what is wider.
///
/// # Safety
///
/// The shader lives.
unsafe fn shades_finitely(shader: *const Shader, at_high: bool) {
    for (uv, footprint) in common::positions().step_by(5).zip([0.0, 1e-4, 0.1].into_iter().cycle())
    {
        for [wi, wo] in common::DIRECTIONS {
            let (uv, wi, wo) = (uv.to_array(), wi.to_array(), wo.to_array());
            let (uv, wi, wo) = (uv.as_ptr(), wi.as_ptr(), wo.as_ptr());
            let xi = [0.3, 0.6, 0.9_f32];
            let mut found = [f32::NAN; 14];
            let [f, drawn, weight, albedo] = array::from_fn(|k| found[3 * k..].as_mut_ptr());
            let [pdf, opacity] = array::from_fn(|k| found[12 + k..].as_mut_ptr());
            // SAFETY: the caller vouches for the shader, the arrays have as many numbers.
            let statuses = unsafe {
                [
                    selvedge_shader_eval(shader, uv, footprint, wi, wo, f),
                    selvedge_shader_albedo(shader, uv, footprint, wo, albedo),
                    selvedge_shader_opacity(shader, uv, footprint, opacity),
                    selvedge_shader_sample(
                        shader,
                        uv,
                        footprint,
                        wo,
                        xi.as_ptr(),
                        drawn,
                        weight,
                        pdf,
                    ),
                ]
            };
            assert_eq!(statuses, [Status::Ok; 4]);
            assert!(
                found.iter().all(|x| x.is_finite()),
                "{at_high}, footprint {footprint}: {found:?}"
            );
        }
    }
}

#[test]
fn divisors_may_lie_anywhere() {
    let loaded = Loaded::new("drafts/plain.wif");
    let (mut divisors, mut count, none) = (vec![0.0_f32; 4096], 0, ptr::null_mut());
    let mut shader = ptr::null();
    // SAFETY: the fabric and the shader are freed on drop only, the arrays are as long as told.
    unsafe {
        let (to, length) = (divisors.as_mut_ptr(), divisors.len());
        let status =
            selvedge_shader_divisors(loaded.shader, 0, length, none, 0, to, &raw mut count);
        assert!(status == Status::Ok && count > 0 && count <= length);
        let mut bytes = vec![0; 1];
        bytes.extend(divisors[..count].iter().flat_map(|divisor| divisor.to_ne_bytes()));
        let odd = bytes[1..].as_ptr().cast();
        assert_eq!(selvedge_fabric_set_divisors(loaded.fabric, 0, odd, count, none, 0), Status::Ok);
        assert_eq!(selvedge_shader_new(loaded.fabric, none, 0, &raw mut shader), Status::Ok);
        selvedge_shader_free(shader);
        for bad in [f32::NAN, 0.0] {
            divisors[count / 2] = bad;
            let (from, mut none_made) = (divisors.as_ptr(), ptr::dangling::<Shader>());
            selvedge_fabric_set_divisors(loaded.fabric, 0, from, count, none, 0);
            let status = selvedge_shader_new(loaded.fabric, none, 0, &raw mut none_made);
            assert_eq!((status, none_made), (Status::InvalidCloth, ptr::dangling()));
        }
        let mut seed = 0;
        selvedge_parameter_find(c"seed".as_ptr(), none, 0, &raw mut seed);
        let half = [0.5; 3];
        let status = selvedge_fabric_set_value(loaded.fabric, 0, seed, half.as_ptr(), none, 0);
        assert_eq!(status, Status::InvalidArgument, "a seed of a half");
    }
}

#[test]
fn owners_free_a_shader_in_any_order_on_little_stack() {
    const COUNT: usize = 1500;
    let loaded = Loaded::new("drafts/plain.wif");
    let owners = (0..8).map(|owner| {
        // SAFETY: the shader lives as long as one of its owners.
        assert_eq!(unsafe { selvedge_shader_share(loaded.shader) }, Status::Ok);
        let shader = loaded.shader.expose_provenance();
        let shade = move || {
            let shader: *const Shader = ptr::with_exposed_provenance(shader);
            let numbers = vec![0.5_f32; 4 * COUNT];
            let uv = vec![1e-4; 2 * COUNT];
            let mut found = vec![f32::NAN; 7 * COUNT];
            let start = numbers.as_ptr();
            let vectors =
                Vectors { component: [0, 1, 2].map(|k| start.wrapping_add(k)), stride: 16 };
            let points = Points {
                count: COUNT,
                uv: Positions { component: [uv.as_ptr(), uv[1..].as_ptr()], stride: 16 },
                wi: vectors,
                wo: vectors,
                xi: vectors,
                footprint: Numbers { values: start, stride: 4 },
                ..nowhere(COUNT, 4, 0)
            };
            let to = found.as_mut_ptr();
            let each = |first: usize| VectorsOut {
                component: [0, 1, 2].map(|k| to.wrapping_add(first + k)),
                stride: 28,
            };
            let (wi, weight) = (each(0), each(3));
            let pdf = NumbersOut { values: to.wrapping_add(6), stride: 28 };
            let (points, none) = (&raw const points, ptr::null_mut());
            let (wi, weight, pdf) = (&raw const wi, &raw const weight, &raw const pdf);
            // SAFETY: one owner of eight; the arrays have as many points.
            unsafe {
                let status = selvedge_shader_sample_batch(shader, points, none, 0, wi, weight, pdf);
                assert_eq!(status, Status::Ok);
                let status = selvedge_shader_eval_pdf_batch(shader, points, none, 0, weight, pdf);
                assert_eq!(status, Status::Ok);
                selvedge_shader_free(shader);
            }
            assert!(found.iter().all(|x| x.is_finite()), "owner {owner}");
        };
        thread::Builder::new().stack_size(256 << 10).spawn(shade).expect("there is room")
    });
    let owners: Vec<_> = owners.collect();
    drop(loaded);
    for owner in owners {
        owner.join().unwrap();
    }
}
