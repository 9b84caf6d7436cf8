//! Every function with arguments good and bad: a status, a reason, and no output on failure.

mod common;

use std::ffi::{CStr, c_char};
use std::{ptr, thread};

use selvedge::*;

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

/// A draft of the fixtures that loads; freed when dropped, as is the shader.
struct Loaded {
    draft: *mut Draft,
    shader: *mut Shader,
}

impl Loaded {
    fn new(name: &str) -> Self {
        let (status, draft, text) = load(&common::read(name));
        assert_eq!((status, text.as_str()), (Status::Ok, ""));
        let mut shader = untouched();
        // SAFETY: the draft has just been made.
        let status = unsafe { selvedge_shader_new(draft, ptr::null_mut(), 0, &raw mut shader) };
        assert_eq!(status, Status::Ok);
        Self { draft, shader }
    }

    /// The status and the value, which starts as `[7.0; 3]`.
    fn eval(&self, uv: [f64; 2], wi: [f32; 3], wo: [f32; 3]) -> (Status, [f32; 3]) {
        let mut f = [7.0; 3];
        // SAFETY: the shader is freed on drop only, the arrays have the lengths asked for.
        let status = unsafe {
            selvedge_shader_eval(self.shader, uv.as_ptr(), wi.as_ptr(), wo.as_ptr(), f.as_mut_ptr())
        };
        (status, f)
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        // SAFETY: both were made in `new`; the shader does not need its draft.
        unsafe {
            selvedge_draft_free(self.draft);
            selvedge_shader_free(self.shader);
        }
    }
}

// SAFETY: the header allows any thread to use a draft and a shader.
unsafe impl Sync for Loaded {}

#[test]
fn null_is_answered_everywhere() {
    let loaded = Loaded::new("drafts/plain.wif");
    let mut message: [c_char; 64];
    let mut draft: *mut Draft = untouched();
    let mut shader: *mut Shader = untouched();
    let byte = b'x';

    // SAFETY: all pointers that are not NULL are what the functions ask for.
    unsafe {
        for (bytes, output, name) in [
            (ptr::null(), &raw mut draft, "bytes"),
            (&raw const byte, ptr::null_mut(), "draft"),
            (ptr::null(), ptr::null_mut(), "bytes"),
        ] {
            for length in [0, 1] {
                message = [0x7f; 64];
                let text = message.as_mut_ptr();
                let status = selvedge_draft_new(bytes, length, text, 64, output);
                let text = CStr::from_ptr(text).to_str().unwrap();
                let expected = format!("{name}: null, expected a pointer");
                assert_eq!((status, text), (Status::NullPointer, expected.as_str()));
            }
        }
        for (input, output, name) in [
            (ptr::null(), &raw mut shader, "draft"),
            (loaded.draft.cast_const(), ptr::null_mut(), "shader"),
        ] {
            message = [0x7f; 64];
            let status = selvedge_shader_new(input, message.as_mut_ptr(), 64, output);
            let text = CStr::from_ptr(message.as_ptr()).to_str().unwrap();
            let expected = format!("{name}: null, expected a pointer");
            assert_eq!((status, text), (Status::NullPointer, expected.as_str()));
        }
        assert_eq!((draft, shader), (untouched(), untouched()));

        let (uv, direction) = ([0.0; 2], [0.0, 0.0, 1.0]);
        let mut f = [7.0; 3];
        for absent in 0..5 {
            let status = selvedge_shader_eval(
                if absent == 0 { ptr::null() } else { loaded.shader },
                if absent == 1 { ptr::null() } else { uv.as_ptr() },
                if absent == 2 { ptr::null() } else { direction.as_ptr() },
                if absent == 3 { ptr::null() } else { direction.as_ptr() },
                if absent == 4 { ptr::null_mut() } else { f.as_mut_ptr() },
            );
            assert_eq!((status, f), (Status::NullPointer, [7.0; 3]), "argument {absent}");
        }
        selvedge_draft_free(ptr::null_mut());
        selvedge_shader_free(ptr::null_mut());
    }
}

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

/// The status and the reason of preparing a draft that loads, but has no shader.
fn refused_shader(bytes: &[u8]) -> (Status, String) {
    let (status, draft, text) = load(bytes);
    assert_eq!((status, text.as_str()), (Status::Ok, ""));
    let mut message: [c_char; 128] = [0x7f; 128];
    let mut shader = untouched();
    // SAFETY: the draft has just been made, and is used no more once freed.
    let (status, text) = unsafe {
        let text = message.as_mut_ptr();
        let status = selvedge_shader_new(draft, text, 128, &raw mut shader);
        selvedge_draft_free(draft);
        (status, CStr::from_ptr(text))
    };
    assert_eq!(shader, untouched());
    (status, text.to_str().expect("a reason is UTF-8").to_owned())
}

#[test]
fn a_draft_without_a_weave_has_no_shader() {
    let (status, text) = refused_shader(&common::read("invalid/no-weave.wif"));
    assert_eq!(status, Status::InvalidDraft);
    assert_eq!(text, "draft: no plan, expected a lift plan or a tie-up with a treadling");
}

#[test]
fn a_draft_of_too_many_yarns_has_no_shader() {
    let each = |line: &dyn Fn(u32) -> String| (1..=65537).map(line).collect::<String>();
    let colors = each(&|n| format!("{n}={},{},{}\n", n >> 16, n >> 8 & 255, n & 255));
    let ends = each(&|n| format!("{n}={n}\n"));
    let threading = each(&|n| format!("{n}=1\n"));
    let draft = format!(
        "[WEAVING]\nShafts=1\n[WARP]\nThreads=65537\n[WEFT]\nThreads=1\n[COLOR PALETTE]\n\
         Range=0,255\n[COLOR TABLE]\n{colors}[WARP COLORS]\n{ends}[THREADING]\n{threading}\
         [LIFTPLAN]\n1=1\n"
    );
    let (status, text) = refused_shader(draft.as_bytes());
    assert_eq!(status, Status::InvalidCloth, "{text}");
    assert!(text.starts_with("yarns: "), "{text}");
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
        selvedge_shader_eval(loaded.shader, uv.as_ptr(), f, wo.as_ptr(), f)
    };
    assert_eq!((status, both), loaded.eval(uv, wi, wo));
}

#[test]
fn threads_share_a_draft_and_a_shader() {
    let loaded = Loaded::new("drafts/plain.wif");
    let expected = common::shader("drafts/plain.wif");
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let mut own = untouched();
                // SAFETY: the draft outlives the scope; the shader made here is freed here.
                unsafe {
                    let text = ptr::null_mut();
                    let status = selvedge_shader_new(loaded.draft, text, 0, &raw mut own);
                    assert_eq!(status, Status::Ok);
                    selvedge_shader_free(own);
                }
                for uv in common::positions() {
                    for [wi, wo] in common::DIRECTIONS {
                        let found = loaded.eval(uv.into(), wi.into(), wo.into());
                        assert_eq!(found, (Status::Ok, expected.eval(uv, wi, wo).into()));
                    }
                }
            });
        }
    });
}

#[test]
fn versions_are_those_of_the_build() {
    // SAFETY: neither function takes anything; the string is static.
    let (abi, text) =
        unsafe { (selvedge_abi_version(), CStr::from_ptr(selvedge_version_string())) };
    assert_eq!(abi, SELVEDGE_ABI_VERSION);
    assert_eq!(text.to_str(), Ok(env!("CARGO_PKG_VERSION")));
}
