//! What a shader answers at many points at once.

use std::array;
use std::ffi::c_char;

use crate::batch::{self, BLOCK, Inputs, Outputs, Split};
use crate::checked::{Checked, Input, Output, SECOND};
use crate::memory::{self, Handshake};
use crate::point::{YarnPoint, live};
use crate::shader::Shader;
use crate::status::{Failure, Message, Status};
use crate::stream::{
    Flags, NOWHERE, Numbers, NumbersOut, Positions, Vectors, VectorsOut, overlap, room, zeros,
};
use crate::{guard, stream};

/// Points to shade. What a function has no use for is not looked at; zero it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Points {
    /// `sizeof(selvedge_points)`.
    pub struct_size: usize,
    /// How many points there are.
    pub count: usize,
    /// Positions, m.
    pub uv: Positions,
    /// Directions to the light.
    pub wi: Vectors,
    /// Directions to the viewer.
    pub wo: Vectors,
    /// The caller's random numbers in [0, 1), of which a sample takes three.
    pub xi: Vectors,
    /// Width of what is seen at each point, m, as for `selvedge_shader_eval`; values of NULL stand for 0.
    pub footprint: Numbers,
    /// Points whose flag is 0 are neither read nor written; values of NULL leave none out.
    pub active: Flags,
    /// A `selvedge_lobes`: of which lobes f and the weights of samples are. Densities and albedos are
    /// those of both.
    pub lobes: u32,
    /// A `selvedge_sides`: which sides of the cloth reflect.
    pub sides: u32,
}

// SAFETY: `repr(C)`, begins with `struct_size`, and any bits are numbers or pointers.
unsafe impl Handshake for Points {
    const NAME: &'static str = "points";
}

/// The lobes of the BRDF. The numbers never change their meaning.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Lobes {
    /// Both, whose sum is the BRDF.
    Both = 0,
    /// The highlight, which the fibres mirror.
    Specular = 1,
    /// The diffuse reflection.
    Diffuse = 2,
}

/// The sides of the cloth. The numbers never change their meaning.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sides {
    /// Both reflect: behind, each crossing shows its other thread.
    Both = 0,
    /// The face alone; the back is black.
    Face = 1,
}

/// Writes to `f` what `selvedge_shader_eval` finds at each point: uses `uv`, `footprint`, `wi`, `wo`,
/// `lobes`.
///
/// An output may be an input if both have the same components and stride. Fails with
/// `SELVEDGE_STATUS_INVALID_ARGUMENT` if there are more points than memory can hold, a code is not
/// known, or the stride of an output is 0 and there is more than one point. No points are no failure,
/// whatever their arrays are.
///
/// # Safety
///
/// `shader` is NULL or a shader not freed; `points` and the output are NULL or point to structs whose
/// pointers are NULL or point, with their strides and whatever their alignment, to as many elements
/// as there are points; `message` is NULL or points to `message_size` bytes. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_eval_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    f: *const VectorsOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let uses = [Input::Footprint, Input::Wi, Input::Wo];
        let outputs = [Output::vectors(f, "f", 0)];
        shade(shader, points, &uses, (message, message_size), outputs, batch::eval, false)
    }
}

/// Writes to `specular` and `diffuse` what `selvedge_shader_eval_lobes` finds at each point: uses
/// `uv`, `footprint`, `wi`, `wo`. Otherwise as `selvedge_shader_eval_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_eval_lobes_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    specular: *const VectorsOut,
    diffuse: *const VectorsOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let uses = [Input::Footprint, Input::Wi, Input::Wo];
        let outputs =
            [Output::vectors(specular, "specular", 0), Output::vectors(diffuse, "diffuse", 1)];
        shade(shader, points, &uses, (message, message_size), outputs, batch::eval_lobes, false)
    }
}

/// Writes to `pdf` what `selvedge_shader_pdf` finds at each point: uses `uv`, `footprint`, `wi`,
/// `wo`. Otherwise as `selvedge_shader_eval_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_pdf_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    pdf: *const NumbersOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let uses = [Input::Footprint, Input::Wi, Input::Wo];
        let outputs = [Output::numbers(pdf, "pdf")];
        shade(shader, points, &uses, (message, message_size), outputs, batch::pdf, false)
    }
}

/// Writes to `pdf` what `selvedge_shader_reverse_pdf` finds at each point: uses `uv`, `footprint`,
/// `wi`, `wo`. Otherwise as `selvedge_shader_eval_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_reverse_pdf_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    pdf: *const NumbersOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let uses = [Input::Footprint, Input::Wi, Input::Wo];
        let outputs = [Output::numbers(pdf, "pdf")];
        shade(shader, points, &uses, (message, message_size), outputs, batch::reverse_pdf, false)
    }
}

/// Both `selvedge_shader_eval_batch` and `selvedge_shader_pdf_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_eval_pdf_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    f: *const VectorsOut,
    pdf: *const NumbersOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let uses = [Input::Footprint, Input::Wi, Input::Wo];
        let outputs = [Output::vectors(f, "f", 0), Output::numbers(pdf, "pdf")];
        shade(shader, points, &uses, (message, message_size), outputs, batch::eval_pdf, true)
    }
}

/// Writes to `wi`, `weight` and `pdf` what `selvedge_shader_sample` draws at each point: uses `uv`,
/// `footprint`, `wo`, `xi`, `lobes`. Otherwise as `selvedge_shader_eval_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_sample_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    wi: *const VectorsOut,
    weight: *const VectorsOut,
    pdf: *const NumbersOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let uses = [Input::Footprint, Input::Wo, Input::Xi];
        let outputs = [
            Output::vectors(wi, "wi", 0),
            Output::vectors(weight, "weight", 1),
            Output::numbers(pdf, "pdf"),
        ];
        shade(shader, points, &uses, (message, message_size), outputs, batch::sample, false)
    }
}

/// Writes to `albedo` what `selvedge_shader_albedo` finds at each point: uses `uv`, `footprint`,
/// `wo`. Otherwise as `selvedge_shader_eval_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_albedo_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    albedo: *const VectorsOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let outputs = [Output::vectors(albedo, "albedo", 0)];
        let uses = [Input::Footprint, Input::Wo];
        shade(shader, points, &uses, (message, message_size), outputs, batch::albedo, false)
    }
}

/// Writes to `opacity` what `selvedge_shader_opacity` finds at each point: uses `uv`,
/// `footprint`. Otherwise as `selvedge_shader_eval_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_opacity_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    opacity: *const NumbersOut,
) -> Status {
    // SAFETY: the caller vouches for what the functions ask for.
    unsafe {
        let outputs = [Output::numbers(opacity, "opacity")];
        let uses = [Input::Footprint];
        shade(shader, points, &uses, (message, message_size), outputs, batch::opacity, false)
    }
}

/// Writes to `yarn_points`, one after the other, what `selvedge_shader_yarn_at` finds at each point:
/// uses `uv`. The caller has set the `struct_size` of the first. Otherwise as
/// `selvedge_shader_eval_batch`.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`; `yarn_points` is NULL or points to as many structs as there are
/// points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_shader_yarn_at_batch(
    shader: *const Shader,
    points: *const Points,
    message: *mut c_char,
    message_size: usize,
    yarn_points: *mut YarnPoint,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, points) = unsafe { (live(shader)?, Checked::new(points, &[])?) };
        let count = points.points.count;
        if count == 0 {
            return Ok(());
        }
        // SAFETY: the caller vouches for at least one struct as large as it says.
        let output = unsafe { memory::output(yarn_points)? };
        stream::check(count, size_of::<YarnPoint>() as isize, false, "yarn_points")?;
        // SAFETY: the caller vouches for the points.
        unsafe {
            points.each_block(BLOCK, |first, block| {
                for i in block.points() {
                    let point = YarnPoint::at(shader, block.uv(i));
                    output.add(first + i).write_unaligned(point);
                }
            });
        }
        Ok(())
    })
}

/// Shades `points` and writes what is found to `outputs`; whether that takes room for a second vector which
/// is no output.
///
/// # Safety
///
/// As for `selvedge_shader_eval_batch`.
unsafe fn shade<const N: usize>(
    shader: *const Shader,
    points: *const Points,
    uses: &[Input],
    message: (*mut c_char, usize),
    outputs: [Result<Output, Failure>; N],
    find: fn(&selvedge_yarn_brdf::Shader, &Inputs<'_>, Outputs<'_>),
    needs_second: bool,
) -> Status {
    // SAFETY: the caller vouches for as many bytes.
    let message = unsafe { Message::new(message.0, message.1) };
    guard(message, || {
        // SAFETY: the caller vouches for what is not NULL.
        let (shader, points) = unsafe { (live(shader)?, Checked::new(points, uses)?) };
        let count = points.points.count;
        let mut checked = Vec::with_capacity(N);
        for output in outputs {
            let output = output?;
            output.check(count)?;
            checked.push(output);
        }
        if count == 0 {
            return Ok(());
        }
        // Slices are written where they lie, but for those that something else may lie in.
        let mut reaches = [NOWHERE; 7];
        for output in &checked {
            output.set_reaches(count, &mut reaches[output.planes()]);
        }
        let (inputs, is_whole) = (points.reaches(), points.is_whole());
        let is_alone: [bool; 7] = array::from_fn(|k| {
            let own = reaches[k];
            let others = reaches.iter().enumerate().filter(|(other, _)| *other != k);
            let mut all = inputs.iter().chain(others.map(|(_, reach)| reach));
            is_whole && own != NOWHERE && !all.any(|reach| overlap(own, *reach))
        });
        let is_direct = |output: &&Output| is_alone[output.planes()].iter().all(|&is| is);
        let is_scratch_free = points.lobes == Lobes::Both && !needs_second;
        let is_all_direct = checked.iter().all(|output| is_direct(&output)) && points.are_slices();
        let step = if is_scratch_free && is_all_direct { count } else { BLOCK };
        // Only what is used of it is filled: that takes as long as shading a few points.
        let mut lengths = [0; 7];
        for output in checked.iter().filter(|output| !is_direct(output)) {
            lengths[output.planes()].fill(count.min(BLOCK));
        }
        if !is_scratch_free {
            lengths[SECOND].fill(count.min(BLOCK));
        }
        let mut places = room();
        let mut scratch = zeros(&mut places, lengths);
        let mut split = Split::new();
        // SAFETY: the caller vouches for the points and for as many places.
        unsafe {
            points.each_block(step, |first, inputs| {
                let range = first..first + inputs.uv[0].len();
                let [a, b, c, d, e, f, numbers] = scratch.each_mut().map(|plane| {
                    let length = range.len().min(plane.len());
                    &mut plane[..length]
                });
                let mut to = Outputs { vectors: [[a, b, c], [d, e, f]], numbers };
                for output in checked.iter().filter(is_direct) {
                    output.give(&range, &mut to);
                }
                find(shader, &split.of(shader, inputs), to);
                for output in checked.iter().filter(|output| !is_direct(output)) {
                    output.scatter(first, inputs, &scratch[output.planes()]);
                }
            });
        }
        Ok(())
    })
}
