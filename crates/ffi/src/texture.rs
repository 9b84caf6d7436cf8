//! Textures that a host computes: parameters of yarn that change from place to place.

use std::ffi::{c_char, c_void};
use std::sync::Arc;

use glam::DVec2;
use selvedge_yarn_brdf::Textured;

use crate::entry::target;
use crate::fabric::Fabric;
use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// Writes to `rgb` what a texture is at `uv`, metres along the weft and the warp, averaged over about
/// `footprint` metres: linear red, green and blue, or a number in the first.
///
/// Equal arguments must give equal values. What is not in the texture's range is moved into it. It is
/// called by every thread that shades, at the same time, with the `user` that it was set with, and
/// must neither throw nor jump out.
pub type TextureValue =
    Option<unsafe extern "C" fn(user: *mut c_void, uv: *const f64, footprint: f64, rgb: *mut f32)>;

/// Lets `value` determine the parameter `index` of the type `yarn`: a colour at each point, a number
/// in the middle of each piece of yarn, which it does not change within. It stands for the value that
/// the type has. Later textures of the same parameter win.
///
/// `low` and `high` are the least and the greatest that any component may be: the highlight is
/// normalised for all between them. Not every parameter can have one: `size` and those of noise, of
/// the cloth, `specular_uniform` and choices cannot. `footprint` is 0 where a shader looks at points.
///
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such type or parameter, or no such
/// range.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no other thread uses; `value` is NULL or a function
/// that may be called with `user`, from any thread, until the fabric and all shaders made of it are
/// freed; `message` is NULL or points to `message_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_set_texture(
    fabric: *mut Fabric,
    yarn: u32,
    index: u32,
    value: TextureValue,
    user: *mut c_void,
    low: f32,
    high: f32,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let mut fabric = non_null(fabric, "fabric")?;
        value.ok_or_else(|| Failure::null("value"))?;
        // SAFETY: not NULL, so the caller vouches for a live fabric that nobody else uses.
        let fabric = unsafe { fabric.as_mut() };
        let (yarn, target) = (fabric.check_yarn(yarn)?, target(index)?);
        if !(low <= high && low.is_finite() && high.is_finite()) {
            let found = format_args!("{low} to {high}").to_string();
            return Err(Failure::argument("range", found, "two finite numbers in order"));
        }
        let texture = Arc::new(Callback { value, user, range: [low, high] });
        fabric.cloth.textures.retain(|t| (t.yarn, t.target) != (yarn, target));
        fabric.cloth.textures.push(Textured { yarn, target, texture });
        Ok(())
    })
}

#[derive(Debug)]
struct Callback {
    value: TextureValue,
    user: *mut c_void,
    range: [f32; 2],
}

// SAFETY: the caller of `selvedge_fabric_set_texture` vouches for calls from any thread.
unsafe impl Send for Callback {}
// SAFETY: as above, at the same time.
unsafe impl Sync for Callback {}

impl selvedge_yarn_brdf::Texture for Callback {
    fn value(&self, uv: DVec2, footprint: f64) -> [f32; 3] {
        let uv = uv.to_array();
        let [low, high] = self.range;
        let mut rgb = [low; 3];
        if let Some(value) = self.value {
            // SAFETY: the caller of `selvedge_fabric_set_texture` vouches for both.
            unsafe { value(self.user, uv.as_ptr(), footprint, rgb.as_mut_ptr()) };
        }
        // What is no number is the least.
        rgb.map(|value| value.max(low).min(high))
    }

    fn range(&self) -> [f32; 2] {
        self.range
    }
}
