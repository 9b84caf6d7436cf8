//! Every function with arguments good and bad: a status, a reason, and no output on failure.

#[path = "../common/mod.rs"]
mod common;
mod fabrics;
mod footprints;
mod hostile;
mod sequences;

use std::ffi::{CStr, CString, c_char};
use std::{ptr, thread};

use selvedge::*;
use selvedge_yarn_brdf::{Highlight, Mode, Phase};

/// What a dangling but aligned pointer stands for in outputs that must stay as they are.
fn untouched<T>() -> *mut T {
    ptr::dangling_mut()
}

/// Loads a draft; the status, the draft or what stood in its place, and the reason.
fn load(bytes: &[u8]) -> (Status, *mut Draft, String) {
    let mut message = [0x7f as c_char; 512];
    let mut draft = untouched();
    // SAFETY: all sizes are those of the arrays.
    let status = unsafe {
        selvedge_draft_new(
            bytes.as_ptr(),
            bytes.len(),
            message.as_mut_ptr(),
            message.len(),
            &raw mut draft,
        )
    };
    // SAFETY: the function ends the text with a NUL.
    let text = unsafe { CStr::from_ptr(message.as_ptr()) };
    (status, draft, text.to_str().expect("a reason is UTF-8").to_owned())
}

/// A draft of the fixtures in the default fabric; all is freed when dropped.
struct Loaded {
    draft: *mut Draft,
    fabric: *mut Fabric,
    shader: *const Shader,
}

impl Loaded {
    fn new(name: &str) -> Self {
        let (status, draft, text) = load(&common::read(name));
        assert_eq!((status, text.as_str()), (Status::Ok, ""));
        let (mut fabric, mut shader) = (untouched(), untouched::<Shader>().cast_const());
        let (none, text) = (ptr::null(), ptr::null_mut());
        // SAFETY: the draft and the fabric have just been made.
        unsafe {
            let status = selvedge_fabric_new(draft, none, 0, text, 0, &raw mut fabric);
            assert_eq!(status, Status::Ok);
            assert_eq!(selvedge_shader_new(fabric, text, 0, &raw mut shader), Status::Ok);
        }
        Self { draft, fabric, shader }
    }

    /// The status and the value, which starts as `[7.0; 3]`.
    fn eval(&self, uv: [f64; 2], wi: [f32; 3], wo: [f32; 3]) -> (Status, [f32; 3]) {
        let mut f = [7.0; 3];
        // SAFETY: the shader is freed on drop only, the arrays have the lengths asked for.
        let status = unsafe {
            selvedge_shader_eval(
                self.shader,
                uv.as_ptr(),
                0.0,
                wi.as_ptr(),
                wo.as_ptr(),
                f.as_mut_ptr(),
            )
        };
        (status, f)
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        // SAFETY: all were made in `new`; none needs the one before.
        unsafe {
            selvedge_draft_free(self.draft);
            selvedge_fabric_free(self.fabric);
            selvedge_shader_free(self.shader);
        }
    }
}

// SAFETY: the header allows any thread to use what no thread changes.
unsafe impl Sync for Loaded {}

#[test]
fn bytes_that_are_no_draft_are_refused_with_the_reason() {
    let limit = common::read("invalid/limit.wif");
    let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\x06\0\0\0\x1f\x15\xc4\x89";
    for (bytes, reason) in [
        (&b""[..], "error: file: nothing in it, expected the sections of a draft"),
        (png, "error: file: byte 8 is zero, expected the text of a draft"),
        (b"Dear reader,\n", "error: file: no section of a draft, expected [WEAVING]"),
        (&limit, "error: line 17 [WARP]: 4000000000 ends, expected at most 100000"),
    ] {
        let (status, draft, text) = load(bytes);
        assert_eq!((status, draft), (Status::InvalidDraft, untouched()), "{text}");
        assert!(text.starts_with(reason), "{text}\nexpected\n{reason}");
    }
}

#[test]
fn a_length_no_object_has_is_refused() {
    for length in [usize::MAX, isize::MAX as usize + 1] {
        let mut message: [c_char; 64] = [0x7f; 64];
        let mut draft = untouched();
        let text = message.as_mut_ptr();
        // SAFETY: the function reads no byte for such a length.
        let status = unsafe { selvedge_draft_new(&b'x', length, text, 64, &raw mut draft) };
        assert_eq!((status, draft), (Status::InvalidArgument, untouched()));
    }
}

#[test]
fn a_draft_without_a_weave_is_refused() {
    let (status, draft, text) = load(&common::read("invalid/no-weave.wif"));
    assert_eq!((status, draft), (Status::InvalidDraft, untouched()));
    assert_eq!(text, "draft: no plan, expected a lift plan or a tie-up with a treadling");
}

#[test]
fn a_draft_of_too_many_yarns_has_no_fabric() {
    let each = |line: &dyn Fn(u32) -> String| (1..=65537).map(line).collect::<String>();
    let colors = each(&|n| format!("{n}={},{},{}\n", n >> 16, n >> 8 & 255, n & 255));
    let ends = each(&|n| format!("{n}={n}\n"));
    let threading = each(&|n| format!("{n}=1\n"));
    let text = format!(
        "[WEAVING]\nShafts=1\n[WARP]\nThreads=65537\n[WEFT]\nThreads=1\n[COLOR PALETTE]\n\
         Range=0,255\n[COLOR TABLE]\n{colors}[WARP COLORS]\n{ends}[THREADING]\n{threading}\
         [LIFTPLAN]\n1=1\n"
    );
    let (status, draft, text) = load(text.as_bytes());
    assert_eq!((status, text.as_str()), (Status::Ok, ""));
    let mut message: [c_char; 128] = [0x7f; 128];
    let mut fabric = untouched();
    // SAFETY: the draft has just been made, and is used no more once freed.
    let (status, text) = unsafe {
        let (none, text) = (ptr::null(), message.as_mut_ptr());
        let status = selvedge_fabric_new(draft, none, 0, text, 128, &raw mut fabric);
        selvedge_draft_free(draft);
        (status, CStr::from_ptr(text))
    };
    assert_eq!((status, fabric), (Status::InvalidCloth, untouched()), "{text:?}");
    assert!(text.to_bytes().starts_with(b"yarns: "), "{text:?}");
}

#[test]
fn parameters_set_in_c_are_those_set_in_rust() {
    let loaded = Loaded::new("drafts/plain.wif");
    let mut cloth = common::cloth("drafts/plain.wif");
    let yarn = &mut cloth.yarns[0];
    yarn.psi = -0.4;
    yarn.color = [0.1, 0.2, 0.25];
    yarn.phase = Phase::WrappedCauchy { rho: 0.8, is_backward: true };
    yarn.highlight = Highlight::Window { delta: 0.3 };
    yarn.noise.intensity = 0.5;
    cloth.rotation = 0.25;
    cloth.normalization = Mode::None;
    let expected = cloth.prepare().unwrap();
    let mut shader = ptr::null();
    // SAFETY: the fabric is freed on drop only, names end with a NUL, and three numbers are there.
    unsafe {
        for (name, value) in [
            (c"psi", [-0.4, 0.0, 0.0]),
            (c"color", [0.1_f32, 0.2, 0.25].map(f64::from)),
            (c"phase", [2.0, 0.0, 0.0]),
            (c"backward", [1.0, 0.0, 0.0]),
            (c"rho", [0.8, 0.0, 0.0]),
            (c"highlight", [0.0; 3]),
            (c"noise.intensity", [0.5, 0.0, 0.0]),
            (c"rotation", [0.25, 0.0, 0.0]),
            (c"normalization", [2.0, 0.0, 0.0]),
        ] {
            let (mut index, mut found, none) = (u32::MAX, [7.0; 3], ptr::null_mut());
            let status = selvedge_parameter_find(name.as_ptr(), none, 0, &raw mut index);
            assert_eq!(status, Status::Ok, "{name:?}");
            let status =
                selvedge_fabric_set_value(loaded.fabric, 0, index, value.as_ptr(), none, 0);
            assert_eq!(status, Status::Ok, "{name:?}");
            let to = found.as_mut_ptr();
            assert_eq!(selvedge_fabric_value(loaded.fabric, 0, index, none, 0, to), Status::Ok);
            assert_eq!(found, value, "{name:?}");
        }
        let none = ptr::null_mut();
        assert_eq!(selvedge_shader_new(loaded.fabric, none, 0, &raw mut shader), Status::Ok);
        for uv in common::positions() {
            for [wi, wo] in common::DIRECTIONS {
                let (uv_c, wi_c, wo_c) = (uv.to_array(), wi.to_array(), wo.to_array());
                let mut f = [7.0; 3];
                let (uv_c, wi_c, wo_c) = (uv_c.as_ptr(), wi_c.as_ptr(), wo_c.as_ptr());
                selvedge_shader_eval(shader, uv_c, 0.0, wi_c, wo_c, f.as_mut_ptr());
                assert_eq!(f, expected.eval(uv, wi, wo).to_array());
            }
        }
        selvedge_shader_free(shader);
    }
}

#[test]
fn fabrics_of_files_and_of_text_are_those_of_rust() {
    let path = common::fixture("fabrics/denim.json");
    let path = CString::new(path.to_str().unwrap()).unwrap();
    let json = common::read("fabrics/denim.json");
    let (_, draft, _) = load(&common::read("drafts/denim.wif"));
    let (mut of_file, mut of_text) = (ptr::null_mut(), ptr::null_mut());
    // SAFETY: all sizes are those of the arrays; what is made here is freed here.
    unsafe {
        let none = ptr::null_mut();
        assert_eq!(selvedge_fabric_load(path.as_ptr(), none, 0, &raw mut of_file), Status::Ok);
        let text = json.as_ptr().cast();
        let status = selvedge_fabric_new(draft, text, json.len(), none, 0, &raw mut of_text);
        assert_eq!(status, Status::Ok);
        for index in 0..selvedge_parameter_count() {
            let values = [of_file, of_text].map(|fabric| {
                let mut value = [7.0; 3];
                let status = selvedge_fabric_value(fabric, 0, index, none, 0, value.as_mut_ptr());
                (status, value)
            });
            assert_eq!(values[0], values[1], "parameter {index}");
        }
        selvedge_draft_free(draft);
        selvedge_fabric_free(of_file);
        selvedge_fabric_free(of_text);
    }
}

#[test]
fn draws_are_those_of_rust() {
    let loaded = Loaded::new("drafts/plain.wif");
    let expected = common::shader("drafts/plain.wif");
    let (mut drawn, mut lost) = (0, 0);
    for (step, uv) in (0_u8..).zip(common::positions()) {
        let xi = [0.1, 0.37, 0.73].map(|x| (x + f32::from(step) * 0.618).fract());
        let wo = common::DIRECTIONS[1][1];
        let (mut wi, mut weight, mut pdf) = ([7.0; 3], [7.0; 3], 7.0);
        // SAFETY: the shader is freed on drop only, the arrays have the lengths asked for.
        let status = unsafe {
            let (uv, wo) = (uv.to_array(), wo.to_array());
            let (uv, wo, xi) = (uv.as_ptr(), wo.as_ptr(), xi.as_ptr());
            let (wi, weight) = (wi.as_mut_ptr(), weight.as_mut_ptr());
            selvedge_shader_sample(loaded.shader, uv, 0.0, wo, xi, wi, weight, &raw mut pdf)
        };
        assert_eq!(status, Status::Ok);
        match expected.sample(uv, wo, xi) {
            Some(sample) => {
                drawn += 1;
                let found = (wi, weight, pdf);
                assert_eq!(found, (sample.wi.into(), sample.weight.into(), sample.pdf));
            }
            None => {
                lost += 1;
                assert_eq!((wi, weight, pdf), ([0.0, 0.0, 1.0], [0.0; 3], 0.0));
            }
        }
    }
    assert!(drawn > 10 && lost > 0, "{drawn} draws and {lost} that are none");
}

#[test]
fn a_reason_is_cut_to_its_buffer() {
    let bytes = "[WARP]\nThreads=4000000000 ; Fäden für Käthe\n".as_bytes();
    let (_, _, whole) = load(bytes);
    assert!(!whole.is_ascii(), "{whole}");
    for size in 0..=whole.len() + 2 {
        let mut message = vec![0x7fu8; size + 1];
        let mut draft = untouched();
        // SAFETY: the buffer is larger than the size says.
        let status = unsafe {
            let text = message.as_mut_ptr().cast();
            selvedge_draft_new(bytes.as_ptr(), bytes.len(), text, size, &raw mut draft)
        };
        assert_eq!((status, draft), (Status::InvalidDraft, untouched()));
        assert_eq!(message[size], 0x7f, "size {size}: written past the end");
        if size > 0 {
            let text = CStr::from_bytes_until_nul(&message).unwrap().to_str().unwrap();
            assert_eq!(text, &whole[..whole.floor_char_boundary(size - 1)], "size {size}");
        }
    }
}

#[test]
fn light_through_or_along_the_cloth_is_none() {
    let loaded = Loaded::new("drafts/plain.wif");
    let (up, down, along) = ([0.0, 0.6, 0.8], [0.0, 0.6, -0.8], [1.0, 0.0, 0.0]);
    let mut light = 0.0;
    for uv in common::positions() {
        for (wi, wo) in [(up, down), (down, up), (along, up), (up, along), (along, down)] {
            assert_eq!(loaded.eval(uv.into(), wi, wo), (Status::Ok, [0.0; 3]), "{uv} {wi:?}");
        }
        let (status, f) = loaded.eval(uv.into(), up, up);
        assert!(status == Status::Ok && f.iter().all(|&f| f.is_finite() && f >= 0.0), "{f:?}");
        light += f.iter().sum::<f32>();
    }
    assert!(light > 0.0, "no light above the surface either");
}

#[test]
fn numbers_that_are_not_finite_give_none() {
    let loaded = Loaded::new("drafts/plain.wif");
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for at in 0..8 {
            let mut uv = [1e-4; 2];
            let (mut wi, mut wo) = ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
            match at {
                0..2 => uv[at] = f64::from(bad),
                2..5 => wi[at - 2] = bad,
                _ => wo[at - 5] = bad,
            }
            let found = loaded.eval(uv, wi, wo);
            assert_eq!(found, (Status::Ok, [0.0; 3]), "{bad} as number {at}");
        }
    }
}

#[test]
fn the_output_may_be_an_input() {
    let loaded = Loaded::new("drafts/plain.wif");
    let (uv, wi, wo) = ([1e-4, 2e-4], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]);
    let mut both = wi;
    // SAFETY: the function reads `wi` before it writes `f`.
    let status = unsafe {
        let f = both.as_mut_ptr();
        selvedge_shader_eval(loaded.shader, uv.as_ptr(), 0.0, f, wo.as_ptr(), f)
    };
    assert_eq!((status, both), loaded.eval(uv, wi, wo));
}

#[test]
fn eight_threads_share_a_draft_a_fabric_and_a_shader() {
    let loaded = Loaded::new("drafts/plain.wif");
    let expected = common::shader("drafts/plain.wif");
    thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                let (mut fabric, mut own) = (untouched(), ptr::null());
                // SAFETY: the draft outlives the scope; what is made here is freed here.
                unsafe {
                    let text = ptr::null_mut();
                    let none = ptr::null();
                    selvedge_fabric_new(loaded.draft, none, 0, text, 0, &raw mut fabric);
                    assert_eq!(selvedge_shader_new(fabric, text, 0, &raw mut own), Status::Ok);
                    selvedge_fabric_free(fabric);
                    selvedge_shader_free(own);
                    assert_eq!(selvedge_shader_share(loaded.shader), Status::Ok);
                }
                for uv in common::positions() {
                    for [wi, wo] in common::DIRECTIONS {
                        let found = loaded.eval(uv.into(), wi.into(), wo.into());
                        assert_eq!(found, (Status::Ok, expected.eval(uv, wi, wo).into()));
                    }
                }
                // SAFETY: shared above.
                unsafe { selvedge_shader_free(loaded.shader) };
            });
        }
    });
}

#[test]
fn slices_have_the_bits_of_points_also_where_they_lie_in_one_another() {
    const COUNT: usize = 2500;
    let loaded = Loaded::new("drafts/plain.wif");
    let uv = [0, 1].map(|k| (0..COUNT).map(|i| 1.3e-5 * (i * (k + 1)) as f64).collect::<Vec<_>>());
    let planes = |w: [f32; 3]| w.map(|c| vec![c; COUNT]);
    let (mut wi, wo) = (planes([0.6, 0.0, 0.8]), planes([0.0, 0.6, 0.8]));
    let expected: Vec<_> = (0..COUNT)
        .map(|i| loaded.eval([uv[0][i], uv[1][i]], [0.6, 0.0, 0.8], [0.0, 0.6, 0.8]).1)
        .collect();
    assert!(expected.iter().any(|f| f[0] > 0.0));
    let mut apart = planes([7.0; 3]);
    let own = wi.each_mut().map(Vec::as_mut_ptr);
    let points = Points {
        struct_size: size_of::<Points>(),
        count: COUNT,
        uv: Positions { component: uv.each_ref().map(Vec::as_ptr), stride: 8 },
        wi: Vectors { component: own.map(<*mut f32>::cast_const), stride: 4 },
        wo: Vectors { component: wo.each_ref().map(Vec::as_ptr), stride: 4 },
        xi: Vectors { component: [ptr::null(); 3], stride: 0 },
        footprint: Numbers { values: ptr::null(), stride: 0 },
        active: Flags { values: ptr::null(), stride: 0 },
        lobes: 0,
        sides: 0,
    };
    let outputs = [apart.each_mut().map(Vec::as_mut_ptr), own];
    for component in outputs {
        let (to, none) = (VectorsOut { component, stride: 4 }, ptr::null_mut());
        // SAFETY: all arrays have as many points; the last output is an input, as it may be.
        let status = unsafe {
            let (points, to) = (&raw const points, &raw const to);
            selvedge_shader_eval_batch(loaded.shader, points, none, 0, to)
        };
        assert_eq!(status, Status::Ok);
        for (i, expected) in expected.iter().enumerate() {
            // SAFETY: within the arrays, which live.
            let found = component.map(|plane| unsafe { plane.add(i).read() });
            assert_eq!(found, *expected, "point {i}");
        }
    }
}

#[test]
fn versions_are_those_of_the_build() {
    // SAFETY: neither function takes anything; the string is static.
    let (abi, text) =
        unsafe { (selvedge_abi_version(), CStr::from_ptr(selvedge_version_string())) };
    assert_eq!(abi, SELVEDGE_ABI_VERSION);
    assert_eq!(text.to_str(), Ok(env!("CARGO_PKG_VERSION")));
}
