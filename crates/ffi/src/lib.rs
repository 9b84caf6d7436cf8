//! Woven-cloth shading for any renderer: the C interface of Selvedge.
//!
//! A WIF file or a pattern in memory is a `selvedge_draft`; woven of yarn it is a `selvedge_fabric`,
//! whose parameters can be listed, read and set; and prepared, a `selvedge_shader`, which answers how
//! the cloth reflects light, at one point or at many:
//!
//! ```c
//! char message[256];
//! selvedge_fabric *fabric = NULL;
//! const selvedge_shader *shader = NULL;
//! if (selvedge_fabric_load("denim.json", message, sizeof message, &fabric) ||
//!     selvedge_shader_new(fabric, message, sizeof message, &shader)) {
//!     fprintf(stderr, "%s\n", message);
//! } else {
//!     const double uv[2] = {0.0010, 0.0025};
//!     const float wi[3] = {0.6f, 0.0f, 0.8f}, wo[3] = {0.0f, 0.0f, 1.0f};
//!     float f[3];
//!     selvedge_shader_eval(shader, uv, 0.0f, wi, wo, f);
//! }
//! selvedge_shader_free(shader);
//! selvedge_fabric_free(fabric);
//! ```
//!
//! `cargo build --release -p selvedge-ffi` makes the libraries, to be linked, on Linux, with
//!
//! ```text
//! cc program.c -Icrates/ffi/include target/release/libselvedge.a -lpthread -ldl -lm
//! cc program.c -Icrates/ffi/include -Ltarget/release -lselvedge
//! ```
//!
//! # Ownership
//!
//! - What a `_new` function returns belongs to the caller, who passes it once to the `_free`
//!   function of its type, and to no other deallocator. Freeing NULL does nothing.
//! - A shader has as many owners as `selvedge_shader_new` and `selvedge_shader_share` have made;
//!   each frees it once.
//! - Every other pointer is lent for the call: nothing of the caller's is kept, changed or
//!   freed, but the function and the `user` of a texture. A fabric keeps nothing of its draft and a
//!   shader nothing of its fabric, which may be freed before it.
//! - A returned string is static and belongs to the library.
//! - A struct begins with `struct_size`, which the caller sets to its `sizeof`, also where the
//!   library writes it. Another size is a failure: such a caller was compiled with another header.
//!
//! # Failure
//!
//! - Functions that can fail return a `selvedge_status`; everything but `SELVEDGE_STATUS_OK`,
//!   which is 0, is a failure, also a code that this header does not know yet.
//! - Outputs are the last arguments; on failure they are as they were, but for those of many points
//!   after `SELVEDGE_STATUS_PANIC`.
//! - `message` is a buffer of `message_size` bytes, its terminating NUL included. A failure
//!   writes its reason there, UTF-8, cut between two characters where the buffer is too short;
//!   a success writes the empty string. 256 bytes suffice for most reasons. NULL, or a size of 0,
//!   asks for no text.
//! - NULL for any other pointer is a failure, never a crash. Pointers that are neither NULL nor
//!   what the function asks for cannot be recognised.
//! - A defect of the library becomes `SELVEDGE_STATUS_PANIC` and does not unwind into the
//!   caller; the Rust run time names it on standard error, where nothing else is ever printed.
//!   Running out of memory ends the process.
//!
//! # Threads
//!
//! There is no global state. Drafts and shaders never change once made: any number of threads may use
//! one at the same time, without a lock. A fabric may be read by many threads, or changed by one while
//! no other uses it. Freeing must come after every use.
//!
//! # Frame and units
//!
//! Positions `uv` are metres along the cloth from the outer edge of end 1 and pick 1: `u` along
//! the weft, `v` along the warp; any values, since the draft repeats. Directions are unit
//! vectors pointing away from the surface, `wi` to the light and `wo` to the viewer, in the
//! shading frame: x = dP/du along the weft, y = dP/dv along the warp, z the normal of the face.
//! Colours are linear, with the primaries of sRGB.
//!
//! No value contains a cosine but the weight of a sample, which contains that of `wi`: light that
//! arrives from `wi` with the radiance L adds f L |wi.z| to what is seen from `wo`.

mod batch;
mod checked;
mod draft;
mod entry;
mod fabric;
mod json;
mod memory;
mod parameter;
mod point;
mod points;
mod shader;
mod status;
mod stream;
mod texture;
mod version;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::NonNull;

pub use draft::*;
pub use fabric::*;
pub use parameter::*;
pub use point::*;
pub use points::*;
pub use shader::*;
pub use status::Status;
pub use stream::{Flags, Numbers, NumbersOut, Positions, Vectors, VectorsOut};
pub use texture::*;
pub use version::*;

use status::{Failure, Message};

/// The status of `call`; the reason of a failure goes to `message`, a panic becomes
/// [`Status::Panic`].
///
/// A `call` writes to the caller's memory only once nothing can fail any more, and one that changes a
/// fabric does so in one step. That makes it safe to go on after an unwind.
fn guard(message: Message, call: impl FnOnce() -> Result<(), Failure>) -> Status {
    let result = catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| {
        let text = format!("selvedge: defect: {}", panic_text(&*payload));
        Err(Failure::new(Status::Panic, text))
    });
    match result {
        Ok(()) => {
            message.write("");
            Status::Ok
        }
        Err(failure) => {
            message.write(&failure.text);
            failure.status
        }
    }
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    let owned = payload.downcast_ref::<String>().map(String::as_str);
    owned.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("panic without a text")
}

/// `pointer`, unless it is NULL; `name` is what the caller knows it by.
fn non_null<T>(pointer: *const T, name: &str) -> Result<NonNull<T>, Failure> {
    NonNull::new(pointer.cast_mut()).ok_or_else(|| Failure::null(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_status_with_its_text() {
        for (call, text) in [
            ((|| panic!("fixed")) as fn(), "selvedge: defect: fixed"),
            (|| panic!("{}", 1 + 1), "selvedge: defect: 2"),
            (|| std::panic::panic_any(7), "selvedge: defect: panic without a text"),
        ] {
            let mut buffer = [0xffu8; 64];
            // SAFETY: the buffer has the size given.
            let message = unsafe { Message::new(buffer.as_mut_ptr().cast(), buffer.len()) };
            let status = guard(message, || {
                call();
                Ok(())
            });
            assert_eq!(status, Status::Panic);
            let nul = buffer.iter().position(|&byte| byte == 0).unwrap();
            assert_eq!(str::from_utf8(&buffer[..nul]).unwrap(), text);
        }
    }
}
