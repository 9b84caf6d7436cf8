//! What a program can ask before it calls anything else.

use std::ffi::{CStr, c_char};

/// The version of the interface that this header describes: the generation in the upper 16
/// bits, the number of additions since its start in the lower 16.
pub const SELVEDGE_ABI_VERSION: u32 = 1 << 16;

/// The version of the interface that the library implements.
///
/// A program fits if the generations are equal and the library has at least the additions that
/// the program was compiled with:
///
/// ```c
/// const uint32_t abi = selvedge_abi_version();
/// const int fits = abi >> 16 == SELVEDGE_ABI_VERSION >> 16 && abi >= SELVEDGE_ABI_VERSION;
/// ```
///
/// # Safety
///
/// Takes no pointer; there is nothing to keep. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_abi_version() -> u32 {
    SELVEDGE_ABI_VERSION
}

const VERSION: &CStr =
    match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => panic!("a package version has no NUL"),
    };

/// The version of the library, as in `0.1.0`, for people to read: a static string, never freed.
///
/// # Safety
///
/// Takes no pointer; there is nothing to keep. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_version_string() -> *const c_char {
    VERSION.as_ptr()
}
