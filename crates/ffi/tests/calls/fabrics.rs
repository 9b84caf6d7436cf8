//! Drafts and fabrics without a shader: all that Miri gets through, which sees each byte that is misread.

use std::ffi::{CStr, c_char, c_void};
use std::ptr;

use selvedge::*;

/// A texture that is the same everywhere.
unsafe extern "C" fn red(user: *mut c_void, _uv: *const f64, _footprint: f64, rgb: *mut f32) {
    // SAFETY: `user` is a number, and there is room for three.
    unsafe { rgb.write(user.cast::<f32>().read()) };
}

/// `numbers` in bytes that begin at an odd address.
fn odd<const N: usize>(numbers: impl IntoIterator<Item = [u8; N]>) -> Vec<u64> {
    let mut bytes: Vec<u8> = [0].into_iter().chain(numbers.into_iter().flatten()).collect();
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes.as_chunks().0.iter().map(|&bytes| u64::from_ne_bytes(bytes)).collect()
}

fn start<T>(words: &[u64]) -> *const T {
    words.as_ptr().cast::<u8>().wrapping_add(1).cast()
}

#[test]
fn arrays_may_lie_anywhere() {
    let types = odd([3_u32, SELVEDGE_NO_TYPE].map(u32::to_ne_bytes));
    let colors = odd([0.5_f32, 0.25, 0.125, 1.0, 0.0, 0.75].map(f32::to_ne_bytes));
    let diameters = odd([4e-4_f64, 0.0, 3e-4].map(f64::to_ne_bytes));
    let pattern = Pattern {
        struct_size: size_of::<Pattern>(),
        ends: 2,
        picks: 3,
        warp_up: [1, 0, 0, 1, 2, 0].as_ptr(),
        end_types: start(&types),
        pick_types: ptr::null(),
        end_colors: start(&colors),
        pick_colors: ptr::null(),
        end_pitch: 5e-4,
        pick_pitch: 0.0,
        end_diameters: ptr::null(),
        pick_diameters: start(&diameters),
    };
    let mut text: [c_char; 64] = [0x7f; 64];
    let (message, size) = (text.as_mut_ptr(), text.len());
    let (mut draft, mut fabric) = (ptr::null_mut(), ptr::null_mut());
    let (mut up, mut yarns, mut length) = ([7; 6], [0_u64; 2], 7);
    let json =
        c"{\"yarn\": {\"psi\": 0.25}, \"overrides\": [{\"color\": 3, \"yarn\": {\"size\": 0.5}}]}";
    // SAFETY: sizes are those of the arrays; what is made here is freed here.
    unsafe {
        let status = selvedge_draft_from_pattern(&raw const pattern, message, size, &raw mut draft);
        assert_eq!(status, Status::Ok, "{:?}", CStr::from_ptr(message));
        let (from, bytes) = (json.as_ptr(), json.count_bytes());
        let status = selvedge_fabric_new(draft, from, bytes, message, size, &raw mut fabric);
        assert_eq!(status, Status::Ok, "{:?}", CStr::from_ptr(message));
        let status = selvedge_draft_warnings(draft, message, size, &raw mut length);
        assert_eq!((status, length), (Status::Ok, 0));
        selvedge_draft_free(draft);

        let to = up.as_mut_ptr();
        assert_eq!(selvedge_fabric_warp_up(fabric, 6, message, size, to), Status::Ok);
        assert_eq!(up, [1, 0, 0, 1, 1, 0]);
        let to = yarns.as_mut_ptr().cast::<u8>().wrapping_add(1).cast::<u32>();
        assert_eq!(selvedge_fabric_yarns(fabric, 0, 2, message, size, to), Status::Ok);
        assert_ne!(to.read_unaligned(), to.wrapping_add(1).read_unaligned(), "an override");

        for index in 0..selvedge_parameter_count() {
            let mut value = odd([[0; 8]; 3]);
            let to = value.as_mut_ptr().cast::<u8>().wrapping_add(1).cast::<f64>();
            let found = selvedge_fabric_value(fabric, 1, index, message, size, to);
            assert!(found == Status::Ok || found == Status::Absent, "{index}");
            if found == Status::Ok {
                let status = selvedge_fabric_set_value(fabric, 1, index, to, message, size);
                assert_eq!(status, Status::Ok, "{index}");
            }
        }
        let mut user = 0.5_f32;
        for index in [0, 0] {
            let (value, user): (TextureValue, _) = (Some(red), (&raw mut user).cast());
            let status =
                selvedge_fabric_set_texture(fabric, 0, index, value, user, 0.0, 1.0, message, size);
            assert_eq!(status, Status::Ok);
        }
        let divisors = odd([1.5_f32, 2.5].map(f32::to_ne_bytes));
        for length in [2, 0] {
            let from = start(&divisors);
            let status = selvedge_fabric_set_divisors(fabric, 1, from, length, message, size);
            assert_eq!(status, Status::Ok);
        }
        selvedge_fabric_free(fabric);
    }
}

#[test]
fn null_is_answered_wherever_it_stands() {
    let mut number = 7_usize;
    let mut index = 7_u32;
    let [mut draft, mut fabric] = [ptr::dangling_mut::<c_void>(); 2];
    let (none, length) = (ptr::null_mut(), &raw mut number);
    let (draft_at, fabric_at) = ((&raw mut draft).cast(), (&raw mut fabric).cast());
    let mut shader = ptr::dangling();
    // SAFETY: whatever is NULL, nothing else is looked at.
    let found = unsafe {
        selvedge_draft_free(ptr::null_mut());
        selvedge_fabric_free(ptr::null_mut());
        selvedge_shader_free(ptr::null());
        [
            selvedge_draft_new(ptr::null(), 1, none, 0, draft_at),
            selvedge_draft_new(&0, 1, none, 0, ptr::null_mut()),
            selvedge_draft_load(ptr::null(), none, 0, draft_at),
            selvedge_draft_from_pattern(ptr::null(), none, 0, draft_at),
            selvedge_draft_warnings(ptr::null(), none, 0, length),
            selvedge_fabric_new(ptr::null(), ptr::null(), 0, none, 0, fabric_at),
            selvedge_fabric_load(ptr::null(), none, 0, fabric_at),
            selvedge_fabric_load(c"".as_ptr(), none, 0, ptr::null_mut()),
            selvedge_fabric_describe(ptr::null(), none, 0, ptr::null_mut()),
            selvedge_fabric_warp_up(ptr::null(), 0, none, 0, ptr::null_mut()),
            selvedge_fabric_yarns(ptr::null(), 0, 0, none, 0, ptr::null_mut()),
            selvedge_fabric_value(ptr::null(), 0, 0, none, 0, ptr::null_mut()),
            selvedge_fabric_set_value(ptr::null_mut(), 0, 0, ptr::null(), none, 0),
            selvedge_fabric_set_texture(
                ptr::null_mut(),
                0,
                0,
                None,
                ptr::null_mut(),
                0.0,
                1.0,
                none,
                0,
            ),
            selvedge_fabric_set_divisors(ptr::null_mut(), 0, ptr::null(), 0, none, 0),
            selvedge_parameter_describe(0, none, 0, ptr::null_mut()),
            selvedge_parameter_find(ptr::null(), none, 0, &raw mut index),
            selvedge_parameter_find(c"psi".as_ptr(), none, 0, ptr::null_mut()),
            selvedge_shader_new(ptr::null(), none, 0, &raw mut shader),
            selvedge_shader_share(ptr::null()),
            selvedge_shader_describe(ptr::null(), none, 0, ptr::null_mut()),
            selvedge_shader_warnings(ptr::null(), none, 0, length),
            selvedge_shader_divisors(ptr::null(), 0, 0, none, 0, ptr::null_mut(), length),
            selvedge_shader_normalization(ptr::null(), 0, none, 0, ptr::null_mut()),
            selvedge_shader_yarn_at(ptr::null(), ptr::null(), ptr::null_mut()),
        ]
    };
    assert_eq!(found, [Status::NullPointer; 25]);
    assert_eq!((number, index, draft, fabric), (7, 7, ptr::dangling_mut(), ptr::dangling_mut()));
    assert_eq!(shader, ptr::dangling());
}
