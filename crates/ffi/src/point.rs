//! What a shader answers at one point.

use std::ptr::NonNull;

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Footprint, Lobes, SegmentKind};

use crate::memory::{self, Handshake};
use crate::shader::Shader;
use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// A place of the cloth's face, as a renderer may want to show it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct YarnPoint {
    /// `sizeof(selvedge_yarn_point)`, set by the caller.
    pub struct_size: usize,
    /// A `selvedge_yarn_kind`. In a gap all else is 0.
    pub kind: u32,
    /// 1 if the yarn is an end, 0 if it is a pick.
    pub is_warp: u32,
    /// Index of its type.
    pub yarn: u32,
    /// The thread's index within the repeat, from 0.
    pub thread: u32,
    /// Number of crossings that the piece is on top of; 0 between two threads, those of one repeat on
    /// an endless thread.
    pub crossings: u32,
    /// 0.
    pub reserved: u32,
    /// The thread's index over all repeats.
    pub line: i64,
    /// Index over all repeats of the thread at the first of these crossings.
    pub first: i64,
    /// Position across the yarn, in [-1, 1], in the yarn frame.
    pub x: f64,
    /// Position along the piece, in [-1, 1], in the yarn frame.
    pub y: f64,
    /// Length of the piece, in cells.
    pub length: f64,
    /// Width of the yarn, in cells.
    pub width: f64,
    /// Inclination along the arc, rad.
    pub u: f64,
    /// Angle around the section, rad.
    pub v: f64,
    /// Normal of the yarn, unit, in the shading frame.
    pub normal: [f64; 3],
    /// Tangent of the fibres, unit, in the shading frame.
    pub tangent: [f64; 3],
}

// SAFETY: `repr(C)`, begins with `struct_size`, and any bits are numbers.
unsafe impl Handshake for YarnPoint {
    const NAME: &'static str = "yarn_point";
}

/// How a piece of yarn comes to be seen. The numbers never change their meaning.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum YarnKind {
    /// There is no yarn.
    Gap = 0,
    /// It is on top of the crossing.
    Top = 1,
    /// It dips here under the one on top of the crossing.
    Extension = 2,
    /// It shows in the slit between two parallel yarns that cover it: straight.
    Between = 3,
    /// It is never covered: straight, one repeat long.
    Endless = 4,
}

/// Writes to `f` the BRDF at `uv` for light from `wi` seen from `wo`, in sr^-1, *without* the
/// cosine: linear red, green and blue, each finite and at least 0.
///
/// Both directions above the surface show the face of the cloth, both below it the back. The
/// value is 0 in a gap between yarns, for one direction on each side or in the plane of the
/// cloth, and where a number is not finite. `f` may be the array of a direction.
///
/// `footprint` is the width, m, of what a pixel sees there. Where it spans a few threads, so that they can
/// no longer be told apart, the mean over the repeat gradually takes over: it costs some microseconds and
/// saves the samples that would find it, and the mean over the cloth stays the same. 0 shades the point
/// itself, as does what is below 0 or no number. All calls for one sample get the same.
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
    footprint: f32,
    wi: *const f32,
    wo: *const f32,
    f: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at, wi, wo) =
            unsafe { (live(shader)?, seen(uv, footprint)?, vector(wi, "wi")?, vector(wo, "wo")?) };
        let output = place(f, "f")?;
        let value = shader.mixed_eval(&at, wi, wo);
        // SAFETY: not NULL, so the caller vouches for three numbers there.
        unsafe { output.write_unaligned(value.to_array()) };
        Ok(())
    })
}

/// As `selvedge_shader_eval`, with the two lobes apart, whose sum it is: the highlight, which the
/// fibres mirror, and the diffuse reflection.
///
/// # Safety
///
/// As for `selvedge_shader_eval`; `specular` and `diffuse` are NULL or point to three numbers.
///
/// cbindgen:ptrs-as-arrays=[[uv;2], [wi;3], [wo;3], [specular;3], [diffuse;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_eval_lobes(
    shader: *const Shader,
    uv: *const f64,
    footprint: f32,
    wi: *const f32,
    wo: *const f32,
    specular: *mut f32,
    diffuse: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at, wi, wo) =
            unsafe { (live(shader)?, seen(uv, footprint)?, vector(wi, "wi")?, vector(wo, "wo")?) };
        let outputs = (place(specular, "specular")?, place(diffuse, "diffuse")?);
        let Lobes { specular, diffuse } = shader.mixed_eval_lobes(&at, wi, wo);
        // SAFETY: not NULL, so the caller vouches for three numbers there.
        unsafe {
            outputs.0.write_unaligned(specular.to_array());
            outputs.1.write_unaligned(diffuse.to_array());
        }
        Ok(())
    })
}

/// Writes to `*pdf` the density, sr^-1, with which `selvedge_shader_sample` draws `wi` for `wo` at
/// `uv`: finite and at least 0.
///
/// # Safety
///
/// As for `selvedge_shader_eval`; `pdf` is NULL or points to a number.
///
/// cbindgen:ptrs-as-arrays=[[uv;2], [wi;3], [wo;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_pdf(
    shader: *const Shader,
    uv: *const f64,
    footprint: f32,
    wi: *const f32,
    wo: *const f32,
    pdf: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at, wi, wo) =
            unsafe { (live(shader)?, seen(uv, footprint)?, vector(wi, "wi")?, vector(wo, "wo")?) };
        let output = non_null(pdf, "pdf")?;
        let value = shader.mixed_pdf(&at, wi, wo);
        // SAFETY: not NULL, so the caller vouches for a number there.
        unsafe { output.write_unaligned(value) };
        Ok(())
    })
}

/// Writes to `*pdf` the density, sr^-1, with which `selvedge_shader_sample` would draw `wo` for `wi`,
/// as bidirectional methods ask for it.
///
/// # Safety
///
/// As for `selvedge_shader_pdf`.
///
/// cbindgen:ptrs-as-arrays=[[uv;2], [wi;3], [wo;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_reverse_pdf(
    shader: *const Shader,
    uv: *const f64,
    footprint: f32,
    wi: *const f32,
    wo: *const f32,
    pdf: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at, wi, wo) =
            unsafe { (live(shader)?, seen(uv, footprint)?, vector(wi, "wi")?, vector(wo, "wo")?) };
        let output = non_null(pdf, "pdf")?;
        let value = shader.mixed_pdf(&at, wo, wi);
        // SAFETY: not NULL, so the caller vouches for a number there.
        unsafe { output.write_unaligned(value) };
        Ok(())
    })
}

/// Both `selvedge_shader_eval` and `selvedge_shader_pdf`.
///
/// # Safety
///
/// As for these.
///
/// cbindgen:ptrs-as-arrays=[[uv;2], [wi;3], [wo;3], [f;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_eval_pdf(
    shader: *const Shader,
    uv: *const f64,
    footprint: f32,
    wi: *const f32,
    wo: *const f32,
    f: *mut f32,
    pdf: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at, wi, wo) =
            unsafe { (live(shader)?, seen(uv, footprint)?, vector(wi, "wi")?, vector(wo, "wo")?) };
        let outputs = (place(f, "f")?, non_null(pdf, "pdf")?);
        let values = (shader.mixed_eval(&at, wi, wo), shader.mixed_pdf(&at, wi, wo));
        // SAFETY: not NULL, so the caller vouches for three numbers and for one.
        unsafe {
            outputs.0.write_unaligned(values.0.to_array());
            outputs.1.write_unaligned(values.1);
        }
        Ok(())
    })
}

/// Draws a direction to light `wi` for `wo` at `uv`, nearly in proportion to f cos theta, by the
/// three numbers `xi` of the caller in [0, 1): its `weight`, f cos theta / pdf, linear, and its
/// density `*pdf`, sr^-1.
///
/// Where nothing is reflected, or the drawn direction is below the surface, `wi` is (0, 0, 1), and
/// `weight` and `*pdf` are 0: such a draw counts as a sample that reflects nothing.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `wo`, `xi`, `wi` and
/// `weight` are NULL or point to three; `pdf` is NULL or points to a number. Safe from any thread.
///
/// cbindgen:ptrs-as-arrays=[[uv;2], [wo;3], [xi;3], [wi;3], [weight;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_sample(
    shader: *const Shader,
    uv: *const f64,
    footprint: f32,
    wo: *const f32,
    xi: *const f32,
    wi: *mut f32,
    weight: *mut f32,
    pdf: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at, wo, xi) =
            unsafe { (live(shader)?, seen(uv, footprint)?, vector(wo, "wo")?, vector(xi, "xi")?) };
        let outputs = (place(wi, "wi")?, place(weight, "weight")?, non_null(pdf, "pdf")?);
        let (wi, weight, pdf) = drawn(shader.mixed_sample(&at, wo, xi.to_array()));
        // SAFETY: not NULL, so the caller vouches for three numbers, three and one.
        unsafe {
            outputs.0.write_unaligned(wi.to_array());
            outputs.1.write_unaligned(weight.to_array());
            outputs.2.write_unaligned(pdf);
        }
        Ok(())
    })
}

/// Writes to `albedo` the share of the light from all sides that is reflected to `wo` at `uv`: linear
/// red, green and blue, good to some hundredths, that of the highlight averaged over its piece of yarn.
/// Where the diffuse reflection follows the yarn's normal it is that of the point, which may be above 1
/// at the expense of its neighbours.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `wo` and `albedo` are
/// NULL or point to three. Safe from any thread.
///
/// cbindgen:ptrs-as-arrays=[[uv;2], [wo;3], [albedo;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_albedo(
    shader: *const Shader,
    uv: *const f64,
    footprint: f32,
    wo: *const f32,
    albedo: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at, wo) = unsafe { (live(shader)?, seen(uv, footprint)?, vector(wo, "wo")?) };
        let output = place(albedo, "albedo")?;
        let value = shader.mixed_albedo(&at, wo);
        // SAFETY: not NULL, so the caller vouches for three numbers there.
        unsafe { output.write_unaligned(value.to_array()) };
        Ok(())
    })
}

/// Writes to `*opacity` the share of the light that does not pass straight through the cloth at `uv`:
/// 0 in a gap. One less it is what is transmitted; nothing is scattered to the other side.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `opacity` is NULL or
/// points to one. Safe from any thread.
///
/// cbindgen:ptrs-as-arrays=[[uv;2]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_opacity(
    shader: *const Shader,
    uv: *const f64,
    footprint: f32,
    opacity: *mut f32,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, at) = unsafe { (live(shader)?, seen(uv, footprint)?) };
        let output = non_null(opacity, "opacity")?;
        let value = shader.mixed_opacity(&at);
        // SAFETY: not NULL, so the caller vouches for a number there.
        unsafe { output.write_unaligned(value) };
        Ok(())
    })
}

/// Writes to `*yarn_point`, whose `struct_size` the caller has set, which piece of yarn the face shows
/// at `uv`, and where on it that is.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `uv` is NULL or points to two numbers; `yarn_point` is NULL
/// or points to a struct that is as large as it says. Safe from any thread.
///
/// cbindgen:ptrs-as-arrays=[[uv;2]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_yarn_at(
    shader: *const Shader,
    uv: *const f64,
    yarn_point: *mut YarnPoint,
) -> Status {
    guard(Message::NONE, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, uv, output) =
            unsafe { (live(shader)?, position(uv)?, memory::output(yarn_point)?) };
        let value = YarnPoint::at(shader, uv);
        // SAFETY: the caller vouches for a struct as large as it says.
        unsafe { output.write_unaligned(value) };
        Ok(())
    })
}

impl YarnPoint {
    /// What the face shows at `uv`.
    pub(crate) fn at(shader: &selvedge_yarn_brdf::Shader, uv: DVec2) -> Self {
        let gap = Self {
            struct_size: size_of::<Self>(),
            kind: YarnKind::Gap as u32,
            is_warp: 0,
            yarn: 0,
            thread: 0,
            crossings: 0,
            reserved: 0,
            line: 0,
            first: 0,
            x: 0.0,
            y: 0.0,
            length: 0.0,
            width: 0.0,
            u: 0.0,
            v: 0.0,
            normal: [0.0; 3],
            tangent: [0.0; 3],
        };
        let Some(point) = shader.yarn_at(uv) else { return gap };
        let segment = point.segment;
        let kind = match segment.kind {
            SegmentKind::Top => YarnKind::Top,
            SegmentKind::Extension => YarnKind::Extension,
            SegmentKind::Between => YarnKind::Between,
            SegmentKind::Endless => YarnKind::Endless,
        };
        Self {
            kind: kind as u32,
            is_warp: segment.is_warp.into(),
            yarn: point.yarn.into(),
            thread: segment.thread,
            crossings: segment.crossings,
            line: segment.line,
            first: segment.first,
            x: segment.x,
            y: segment.y,
            length: segment.length,
            width: segment.width,
            u: point.u,
            v: point.v,
            normal: point.normal.to_array(),
            tangent: point.tangent.to_array(),
            ..gap
        }
    }
}

/// The direction, weight and density of a draw.
pub(crate) fn drawn(sample: Option<selvedge_yarn_brdf::Sample>) -> (Vec3, Vec3, f32) {
    sample.map_or((Vec3::Z, Vec3::ZERO, 0.0), |sample| (sample.wi, sample.weight, sample.pdf))
}

/// # Safety
///
/// `shader` is NULL or a shader that lives as long as what is returned is used.
#[inline(always)]
pub(crate) unsafe fn live<'a>(
    shader: *const Shader,
) -> Result<&'a selvedge_yarn_brdf::Shader, Failure> {
    let shader = non_null(shader, "shader")?;
    // SAFETY: not NULL, so the caller vouches for a live shader, which nothing changes.
    Ok(unsafe { &(*shader.as_ptr()).shader })
}

/// # Safety
///
/// `uv` is NULL or points to two numbers.
#[inline(always)]
unsafe fn position(uv: *const f64) -> Result<DVec2, Failure> {
    let uv = non_null(uv, "uv")?.cast::<[f64; 2]>();
    // SAFETY: not NULL, so the caller vouches for two numbers.
    Ok(DVec2::from(unsafe { uv.read_unaligned() }))
}

/// What is seen at `uv` if it is `footprint` metres wide.
///
/// # Safety
///
/// `uv` is NULL or points to two numbers.
#[inline(always)]
unsafe fn seen(uv: *const f64, footprint: f32) -> Result<Footprint, Failure> {
    // SAFETY: the caller vouches for two numbers.
    let uv = unsafe { position(uv)? };
    Ok(Footprint::square(uv, footprint.into()))
}

/// # Safety
///
/// `vector` is NULL or points to three numbers.
#[inline(always)]
unsafe fn vector(vector: *const f32, name: &str) -> Result<Vec3, Failure> {
    let vector = non_null(vector, name)?.cast::<[f32; 3]>();
    // SAFETY: not NULL, so the caller vouches for three numbers.
    Ok(Vec3::from(unsafe { vector.read_unaligned() }))
}

/// Where three numbers go.
#[inline(always)]
fn place(output: *mut f32, name: &str) -> Result<NonNull<[f32; 3]>, Failure> {
    Ok(non_null(output, name)?.cast())
}
