//! What a shader answers at many points at once.

use std::array;
use std::ffi::c_char;
use std::ops::Range;

use crate::batch::{self, BLOCK, Inputs, Outputs, Split};
use crate::memory::{self, Handshake};
use crate::point::{YarnPoint, live};
use crate::shader::Shader;
use crate::status::{Failure, Message, Status};
use crate::stream::{
    Chosen, Flags, NOWHERE, Numbers, NumbersOut, Positions, Reach, Vectors, VectorsOut, overlap,
    room, zeros,
};
use crate::{guard, non_null, stream};

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

/// What a function looks at besides the positions.
#[derive(Clone, Copy, PartialEq)]
enum Input {
    Footprint,
    Wi,
    Wo,
    Xi,
}

/// Points whose arrays are there, as far as they are needed.
struct Checked {
    points: Points,
    /// Whether directions to the light, to the viewer and random numbers are looked at.
    uses: [bool; 3],
    has_footprint: bool,
    lobes: Lobes,
    is_face_alone: bool,
}

impl Checked {
    /// # Safety
    ///
    /// `points` is NULL or points to a struct that is as large as it says.
    unsafe fn new(points: *const Points, uses: &[Input]) -> Result<Self, Failure> {
        // SAFETY: the caller vouches for the struct.
        let points = unsafe { memory::read(points)? };
        let lobes = match points.lobes {
            0 => Lobes::Both,
            1 => Lobes::Specular,
            2 => Lobes::Diffuse,
            lobes => return Err(Failure::argument("points.lobes", lobes, "0 to 2")),
        };
        if points.sides > 1 {
            return Err(Failure::argument("points.sides", points.sides, "0 or 1"));
        }
        let has_footprint = uses.contains(&Input::Footprint) && !points.footprint.values.is_null();
        let uses = [Input::Wi, Input::Wo, Input::Xi].map(|input| uses.contains(&input));
        let count = points.count;
        points.uv.check(count, "points.uv")?;
        let names = ["points.wi", "points.wo", "points.xi"];
        for ((used, vectors), name) in uses.iter().zip([points.wi, points.wo, points.xi]).zip(names)
        {
            if *used {
                vectors.check(count, name)?;
            }
        }
        if has_footprint {
            points.footprint.check(count, "points.footprint")?;
        }
        points.active.check(count, "points.active")?;
        let is_face_alone = points.sides == Sides::Face as u32;
        Ok(Self { points, uses, has_footprint, lobes, is_face_alone })
    }

    /// Whether each point counts, on both sides.
    fn is_whole(&self) -> bool {
        self.points.active.values.is_null() && !self.is_face_alone
    }

    /// What the arrays that are looked at reach.
    fn reaches(&self) -> [Reach; 12] {
        let Points { count, uv, wi, wo, xi, footprint, .. } = self.points;
        let mut reaches = [NOWHERE; 12];
        let (of_uv, rest) = reaches.split_at_mut(2);
        of_uv.copy_from_slice(&uv.reach(count));
        let (of_vectors, of_widths) = rest.as_chunks_mut();
        for ((to, vectors), used) in of_vectors.iter_mut().zip([wi, wo, xi]).zip(self.uses) {
            if used {
                *to = vectors.reach(count);
            }
        }
        if self.has_footprint {
            of_widths[0] = footprint.reach(count);
        }
        reaches
    }

    /// Whether all that is looked at lies as in slices, without footprints, and each point counts.
    fn are_slices(&self) -> bool {
        let Points { uv, wi, wo, xi, .. } = &self.points;
        let mut used = self.uses.into_iter().zip([wi, wo, xi]).filter(|(used, _)| *used);
        self.is_whole()
            && !self.has_footprint
            && uv.are_slices()
            && used.all(|(_, vectors)| vectors.are_slices())
    }

    /// Hands on all points, `step` by `step`, each time with the index of the first: where they lie, if they
    /// lie as in slices and all count, else gathered.
    ///
    /// # Safety
    ///
    /// The arrays have as many elements as there are points, and lie as in slices if `step` is more than
    /// [`BLOCK`].
    unsafe fn each_block(&self, step: usize, mut shade: impl FnMut(usize, &Inputs<'_>)) {
        let Points { count, uv, wi, wo, xi, footprint, active, .. } = &self.points;
        let mut flags = [true; BLOCK];
        let mut widths = room();
        let mut places = room();
        let mut planes = [room(), room(), room()];
        let none: [&[f32]; 3] = [&[]; 3];
        for first in (0..*count).step_by(step) {
            let range = first..(*count).min(first + step);
            let flags = &mut flags[..range.len().min(BLOCK)];
            // SAFETY: the caller vouches for elements up to the number of points.
            unsafe {
                let is_full = active.gather(first, flags);
                let active = (!is_full).then_some(&*flags);
                let chosen = Chosen { first, count: range.len(), active };
                let uv_slices = self.is_whole().then(|| uv.direct(&range)).flatten();
                let uv = uv_slices
                    .unwrap_or_else(|| uv.gather(&chosen, &mut places).map(|plane| &*plane));
                let mut vectors = [none; 3];
                let streams = [wi, wo, xi].into_iter().zip(&mut planes).zip(self.uses);
                for (to, ((stream, planes), used)) in vectors.iter_mut().zip(streams) {
                    if !used {
                        continue;
                    }
                    let slices = self.is_whole().then(|| stream.direct(&range)).flatten();
                    *to = slices.unwrap_or_else(|| {
                        let [x, y, z] = stream.gather(&chosen, planes);
                        if self.is_face_alone {
                            // In the plane of the cloth nothing is seen.
                            z.iter_mut().for_each(|z| *z = z.max(0.0));
                        }
                        [x, y, z].map(|plane| &*plane)
                    });
                }
                let [wi, wo, xi] = vectors;
                let footprint =
                    self.has_footprint.then(|| &*footprint.gather(&chosen, &mut widths));
                let (lobes, wide) = (self.lobes, &[][..]);
                shade(first, &Inputs { uv, wi, wo, xi, footprint, active, wide, lobes });
            }
        }
    }
}

/// The planes of what can be found at once: two vectors, and numbers.
const FIRST: Range<usize> = 0..3;
const SECOND: Range<usize> = 3..6;
const NUMBERS: Range<usize> = 6..7;

/// Where something found goes.
enum Output {
    /// The vector of this number.
    Vectors(VectorsOut, &'static str, usize),
    Numbers(NumbersOut, &'static str),
}

impl Output {
    /// # Safety
    ///
    /// `output` is NULL or points to a struct.
    unsafe fn vectors(
        output: *const VectorsOut,
        name: &'static str,
        number: usize,
    ) -> Result<Self, Failure> {
        // SAFETY: not NULL, so the caller vouches for a struct.
        let output = unsafe { non_null(output, name)?.read_unaligned() };
        Ok(Self::Vectors(output, name, number))
    }

    /// # Safety
    ///
    /// `output` is NULL or points to a struct.
    unsafe fn numbers(output: *const NumbersOut, name: &'static str) -> Result<Self, Failure> {
        // SAFETY: not NULL, so the caller vouches for a struct.
        let output = unsafe { non_null(output, name)?.read_unaligned() };
        Ok(Self::Numbers(output, name))
    }

    fn check(&self, count: usize) -> Result<(), Failure> {
        match self {
            Self::Vectors(output, name, _) => output.check(count, name),
            Self::Numbers(output, name) => output.check(count, name),
        }
    }

    /// Its planes among all that can be found.
    fn planes(&self) -> Range<usize> {
        match self {
            Self::Vectors(_, _, 0) => FIRST,
            Self::Vectors(..) => SECOND,
            Self::Numbers(..) => NUMBERS,
        }
    }

    /// Sets what its planes reach, if they are as slices.
    fn set_reaches(&self, count: usize, reaches: &mut [Reach]) {
        match self {
            Self::Vectors(output, ..) => {
                if let Some(slices) = output.slices(count) {
                    reaches.copy_from_slice(&slices);
                }
            }
            Self::Numbers(output, _) => {
                if let Some(slice) = output.slice(count) {
                    reaches[0] = slice;
                }
            }
        }
    }

    /// Has what is found in `range` written where it goes.
    ///
    /// # Safety
    ///
    /// It is as slices, there are as many places as points, and nobody else uses them meanwhile.
    unsafe fn give(&self, range: &Range<usize>, to: &mut Outputs<'_>) {
        // SAFETY: the caller vouches for the places.
        unsafe {
            match self {
                Self::Vectors(output, _, number) => to.vectors[*number] = output.direct(range),
                Self::Numbers(output, _) => to.numbers = output.direct(range),
            }
        }
    }

    /// # Safety
    ///
    /// There are as many places as points, of which `inputs` has those from `first` on, with what has been
    /// `found` there.
    unsafe fn scatter(&self, first: usize, inputs: &Inputs<'_>, found: &[&mut [f32]]) {
        let chosen = Chosen { first, count: inputs.uv[0].len(), active: inputs.active };
        // SAFETY: the caller vouches for the places.
        unsafe {
            match self {
                Self::Vectors(output, ..) => {
                    output.scatter(&chosen, [&*found[0], &*found[1], &*found[2]]);
                }
                Self::Numbers(output, _) => output.scatter(&chosen, &*found[0]),
            }
        }
    }
}
