//! `selvedge_shader`: a cloth that answers how it reflects light.

use std::ffi::c_char;
use std::sync::Arc;

use selvedge_yarn_brdf::Normalization as Factor;

use crate::entry::no_yarn;
use crate::fabric::Fabric;
use crate::memory::{self, Handshake};
use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// Cloth ready to be shaded, counted by references.
///
/// Never changes; any number of threads may use one at the same time.
#[derive(Debug)]
pub struct Shader {
    pub(crate) shader: selvedge_yarn_brdf::Shader,
    yarns: u32,
    warnings: String,
}

/// What a shader is like.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ShaderInfo {
    /// `sizeof(selvedge_shader_info)`, set by the caller.
    pub struct_size: usize,
    /// The memory it takes, bytes.
    pub bytes: u64,
    /// Types of yarn, counted from 0.
    pub yarns: u32,
    /// 1 if something may show between the yarns; if 0, no place has an opacity of 0 for that reason.
    pub has_gaps: u32,
}

// SAFETY: `repr(C)`, begins with `struct_size`, and any bits are numbers.
unsafe impl Handshake for ShaderInfo {
    const NAME: &'static str = "info";
}

/// By what the highlight of a type of yarn is scaled, so that it reflects no more than it receives, and
/// what that rests on.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Normalization {
    /// `sizeof(selvedge_normalization)`, set by the caller.
    pub struct_size: usize,
    /// For pieces of yarn of endless length and for the shortest that bend as far as their yarn.
    pub factor: [f64; 2],
    /// The greatest albedos found, before scaling.
    pub max_albedo: [f64; 2],
    /// What the true ones are taken to be at most: 1 / `factor`.
    pub upper_bound: [f64; 2],
}

// SAFETY: `repr(C)`, begins with `struct_size`, and any bits are numbers.
unsafe impl Handshake for Normalization {
    const NAME: &'static str = "normalization";
}

/// Prepares `fabric` as it is now into `*shader`, which the caller frees with `selvedge_shader_free`.
///
/// All work that does not depend on a position or a direction is done here, once: a tenth of a second
/// for most fabrics, more for many types of yarn and where noise or textures change its shape. Fails with
/// `SELVEDGE_STATUS_INVALID_CLOTH` if the result cannot be shaded.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
/// `message_size` bytes; `shader` is NULL or points to a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_new(
    fabric: *const Fabric,
    message: *mut c_char,
    message_size: usize,
    shader: *mut *const Shader,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (fabric, output) = (non_null(fabric, "fabric")?, non_null(shader, "shader")?);
        // SAFETY: not NULL, so the caller vouches for a live fabric, which nobody changes.
        let fabric = unsafe { fabric.as_ref() };
        let shader = fabric.cloth.prepare();
        let mut shader =
            shader.map_err(|error| Failure::from_error(Status::InvalidCloth, &error))?;
        for (&yarn, divisors) in &fabric.divisors {
            let set = shader.set_divisors(yarn, divisors);
            set.map_err(|error| Failure::from_error(Status::InvalidCloth, &error))?;
        }
        let lowered = shader.lowered().iter().map(ToString::to_string);
        let unused = Some(fabric.warnings.clone()).filter(|text| !text.is_empty());
        let warnings = unused.into_iter().chain(lowered).collect::<Vec<_>>().join("\n");
        let yarns = fabric.cloth.yarns.len() as u32;
        let shader = Arc::new(Shader { shader, yarns, warnings });
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write_unaligned(Arc::into_raw(shader)) };
        Ok(())
    })
}

/// Counts one more owner of a shader, each of whom frees it once.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_share(shader: *const Shader) -> Status {
    guard(Message::NONE, || {
        let shader = non_null(shader, "shader")?;
        // SAFETY: made by `Arc::into_raw`, and the caller is an owner.
        unsafe { Arc::increment_strong_count(shader.as_ptr()) };
        Ok(())
    })
}

/// Frees a shader once its last owner has; NULL is nothing to free.
///
/// # Safety
///
/// `shader` is NULL or comes from `selvedge_shader_new`, and is freed once for that and once for each
/// `selvedge_shader_share`; who frees it uses it no more. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_free(shader: *const Shader) {
    guard(Message::NONE, || {
        if !shader.is_null() {
            // SAFETY: made by `Arc::into_raw`, and freed once by each owner.
            drop(unsafe { Arc::from_raw(shader) });
        }
        Ok(())
    });
}

/// Writes to `*info`, whose `struct_size` the caller has set, what the shader is like.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `message` is NULL or points to `message_size` bytes;
/// `info` is NULL or points to a struct that is as large as it says. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_describe(
    shader: *const Shader,
    message: *mut c_char,
    message_size: usize,
    info: *mut ShaderInfo,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let shader = non_null(shader, "shader")?;
        // SAFETY: the caller vouches for a struct as large as it says.
        let output = unsafe { memory::output(info)? };
        // SAFETY: not NULL, so the caller vouches for a live shader, which nothing changes.
        let shader = unsafe { shader.as_ref() };
        let info = ShaderInfo {
            struct_size: size_of::<ShaderInfo>(),
            bytes: shader.shader.bytes() as u64,
            yarns: shader.yarns,
            has_gaps: shader.shader.has_gaps().into(),
        };
        // SAFETY: as above.
        unsafe { output.write_unaligned(info) };
        Ok(())
    })
}

/// Writes to `*length` the bytes of what the fabric said in vain or could not be shaded as it said,
/// without the NUL, and to `text` as much of it as fits: UTF-8, a line for each warning; empty if
/// there is none.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `text` is NULL or points to `text_size` bytes; `length` is
/// NULL or points to a number. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_warnings(
    shader: *const Shader,
    text: *mut c_char,
    text_size: usize,
    length: *mut usize,
) -> Status {
    guard(Message::NONE, || {
        let (shader, output) = (non_null(shader, "shader")?, non_null(length, "length")?);
        // SAFETY: not NULL, so the caller vouches for a live shader, which nothing changes, for
        // `text_size` bytes and for a number.
        unsafe {
            let warnings = &shader.as_ref().warnings;
            Message::new(text, text_size).write(warnings);
            output.write_unaligned(warnings.len());
        }
        Ok(())
    })
}

/// Writes to `*count` how many numbers it takes to scale the highlight of the type `yarn`, and these to
/// `divisors` if its `length` is at least that.
///
/// They are 1 / factor for each kind of piece of yarn and each shape in turn, the result of a search when the
/// shader was made. `selvedge_fabric_set_divisors` has another machine, or a later library, scale as this one.
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such type.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `message` is NULL or points to `message_size` bytes; `divisors`
/// points to `length` numbers, or is NULL for a `length` of 0; `count` is NULL or points to a number. Safe
/// from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_divisors(
    shader: *const Shader,
    yarn: u32,
    length: usize,
    message: *mut c_char,
    message_size: usize,
    divisors: *mut f32,
    count: *mut usize,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (shader, output) = (non_null(shader, "shader")?, non_null(count, "count")?);
        // SAFETY: not NULL, so the caller vouches for a live shader, which nothing changes.
        let shader = unsafe { shader.as_ref() };
        let found = u16::try_from(yarn).ok().and_then(|yarn| shader.shader.divisors(yarn));
        let found = found.ok_or_else(|| no_yarn(yarn, shader.yarns as usize))?;
        if length >= found.len() {
            let start = non_null(divisors, "divisors")?;
            for (index, &divisor) in found.iter().enumerate() {
                // SAFETY: not NULL, so the caller vouches for `length` numbers.
                unsafe { start.add(index).write_unaligned(divisor) };
            }
        }
        // SAFETY: not NULL, so the caller vouches for a number there.
        unsafe { output.write_unaligned(found.len()) };
        Ok(())
    })
}

/// Writes to `*normalization`, whose `struct_size` the caller has set, by what the highlight of the
/// type `yarn` is scaled.
///
/// Equal fabrics have equal factors, bit for bit, on machines of one kind. Fails with
/// `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such type.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `message` is NULL or points to `message_size` bytes;
/// `normalization` is NULL or points to a struct that is as large as it says. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_normalization(
    shader: *const Shader,
    yarn: u32,
    message: *mut c_char,
    message_size: usize,
    normalization: *mut Normalization,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let shader = non_null(shader, "shader")?;
        // SAFETY: the caller vouches for a struct as large as it says.
        let output = unsafe { memory::output(normalization)? };
        // SAFETY: not NULL, so the caller vouches for a live shader, which nothing changes.
        let shader = unsafe { shader.as_ref() };
        let found = u16::try_from(yarn).ok().and_then(|yarn| shader.shader.normalization(yarn));
        let found = found.ok_or_else(|| no_yarn(yarn, shader.yarns as usize))?;
        let each = |of: fn(&Factor) -> f64| [of(&found[0]), of(&found[1])];
        let normalization = Normalization {
            struct_size: size_of::<Normalization>(),
            factor: each(|n| n.factor),
            max_albedo: each(|n| n.max_albedo),
            upper_bound: each(|n| n.upper_bound),
        };
        // SAFETY: as above.
        unsafe { output.write_unaligned(normalization) };
        Ok(())
    })
}
