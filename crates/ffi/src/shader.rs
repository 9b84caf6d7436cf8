//! `selvedge_shader`: a cloth that answers how it reflects light.

use std::ffi::c_char;

use glam::{DVec2, Vec3};
use selvedge_wif::Drawdown;
use selvedge_yarn_brdf::{Cloth, ClothError, Fabric, Thread, Weave};

use crate::draft::Draft;
use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// Cloth ready to be shaded.
///
/// Never changes; any number of threads may use one at the same time.
#[derive(Debug)]
pub struct Shader(selvedge_yarn_brdf::Shader);

/// Prepares the cloth of `draft`, woven from the yarn of a default fabric, into `*shader`,
/// which the caller frees with `selvedge_shader_free`.
///
/// Colours, spacing and thickness of the threads are those of the draft. All work that does not
/// depend on a position or a direction is done here, once. Fails with
/// `SELVEDGE_STATUS_INVALID_DRAFT` if the draft does not say how its threads interlace, with
/// `SELVEDGE_STATUS_INVALID_CLOTH` if the result cannot be shaded.
///
/// # Safety
///
/// `draft` is NULL or a draft not freed; `message` is NULL or points to `message_size` bytes;
/// `shader` is NULL or points to a pointer. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_new(
    draft: *const Draft,
    message: *mut c_char,
    message_size: usize,
    shader: *mut *mut Shader,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (draft, output) = (non_null(draft, "draft")?, non_null(shader, "shader")?);
        // SAFETY: not NULL, so the caller vouches for a live draft, which nothing changes.
        let draft = unsafe { draft.as_ref() };
        let drawdown = draft.0.drawdown();
        let drawdown =
            drawdown.map_err(|error| Failure::from_error(Status::InvalidDraft, &error))?;
        let shader = cloth(&drawdown).and_then(|cloth| cloth.prepare());
        let shader = shader.map_err(|error| Failure::from_error(Status::InvalidCloth, &error))?;
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write(Box::into_raw(Box::new(Shader(shader)))) };
        Ok(())
    })
}

/// The cloth of a drawdown: end for end and pick for pick, in the default fabric.
fn cloth(drawdown: &Drawdown) -> Result<Cloth, ClothError> {
    // A draft counts its threads in `u32`.
    let (ends, picks) = (drawdown.ends() as u32, drawdown.picks() as u32);
    let weave =
        Weave::new(ends, picks, |end, pick| drawdown.warp_on_top(end as usize, pick as usize))?;
    let thread = |thread: &selvedge_wif::Thread| Thread {
        color: thread.color.linear(),
        color_number: thread.color_number,
        pitch: thread.pitch,
        diameter: thread.diameter,
    };
    let ends: Vec<_> = (0..drawdown.ends()).map(|end| thread(drawdown.end(end))).collect();
    let picks: Vec<_> = (0..drawdown.picks()).map(|pick| thread(drawdown.pick(pick))).collect();
    Fabric::default().cloth(weave, &ends, &picks)
}

/// Frees a shader; NULL is nothing to free.
///
/// # Safety
///
/// `shader` is NULL or comes from `selvedge_shader_new`, has not been freed, and is not used by
/// another thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_free(shader: *mut Shader) {
    guard(Message::NONE, || {
        if !shader.is_null() {
            // SAFETY: made by `Box::into_raw` in `selvedge_shader_new`, and freed only here.
            drop(unsafe { Box::from_raw(shader) });
        }
        Ok(())
    });
}

/// Writes to `f` the BRDF at `uv` for light from `wi` seen from `wo`, in sr^-1, *without* the
/// cosine: linear red, green and blue, each finite and at least 0.
///
/// Both directions above the surface show the face of the cloth, both below it the back. The
/// value is 0 in a gap between yarns, for one direction on each side or in the plane of the
/// cloth, and where a number is not finite. `f` may be the array of a direction.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers, `wi`, `wo` and
/// `f` are NULL or point to three. Safe from any thread.
///
/// cbindgen:ptrs-as-arrays=[[uv;2], [wi;3], [wo;3], [f;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_eval(
    shader: *const Shader,
    uv: *const f64,
    wi: *const f32,
    wo: *const f32,
    f: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        let shader = non_null(shader, "shader")?;
        let uv = non_null(uv, "uv")?.cast::<[f64; 2]>();
        let wi = non_null(wi, "wi")?.cast::<[f32; 3]>();
        let wo = non_null(wo, "wo")?.cast::<[f32; 3]>();
        let output = non_null(f, "f")?.cast::<[f32; 3]>();
        // SAFETY: not NULL, so the caller vouches for a live shader, which nothing changes, and
        // for as many numbers as are read.
        let (shader, uv, wi, wo) = unsafe { (shader.as_ref(), uv.read(), wi.read(), wo.read()) };
        let value = shader.0.eval(DVec2::from(uv), Vec3::from(wi), Vec3::from(wo));
        // SAFETY: not NULL, so the caller vouches for three numbers there.
        unsafe { output.write(value.to_array()) };
        Ok(())
    })
}
