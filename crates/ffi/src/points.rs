//! What a shader answers at many points at once.

use std::ffi::c_char;

use crate::batch::{self, BLOCK, Block, Found};
use crate::memory::{self, Handshake};
use crate::point::{YarnPoint, live};
use crate::shader::Shader;
use crate::status::{Failure, Message, Status};
use crate::stream::{Flags, Numbers, NumbersOut, Positions, Vectors, VectorsOut};
use crate::{guard, non_null};

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
    /// Width of what is seen at each point, m; values of NULL stand for 0. This version shades the
    /// points themselves, whatever it is.
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

/// Writes to `f` what `selvedge_shader_eval` finds at each point: uses `uv`, `wi`, `wo`, `lobes`.
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
        let uses = [Input::Wi, Input::Wo];
        let outputs = [Output::vectors(f, "f", 0)];
        shade(shader, points, &uses, (message, message_size), outputs, batch::eval)
    }
}

/// Writes to `specular` and `diffuse` what `selvedge_shader_eval_lobes` finds at each point: uses
/// `uv`, `wi`, `wo`. Otherwise as `selvedge_shader_eval_batch`.
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
        let uses = [Input::Wi, Input::Wo];
        let outputs =
            [Output::vectors(specular, "specular", 0), Output::vectors(diffuse, "diffuse", 1)];
        shade(shader, points, &uses, (message, message_size), outputs, batch::eval_lobes)
    }
}

/// Writes to `pdf` what `selvedge_shader_pdf` finds at each point: uses `uv`, `wi`, `wo`. Otherwise as
/// `selvedge_shader_eval_batch`.
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
        let uses = [Input::Wi, Input::Wo];
        let outputs = [Output::numbers(pdf, "pdf")];
        shade(shader, points, &uses, (message, message_size), outputs, batch::pdf)
    }
}

/// Writes to `pdf` what `selvedge_shader_reverse_pdf` finds at each point: uses `uv`, `wi`, `wo`.
/// Otherwise as `selvedge_shader_eval_batch`.
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
        let uses = [Input::Wi, Input::Wo];
        let outputs = [Output::numbers(pdf, "pdf")];
        shade(shader, points, &uses, (message, message_size), outputs, batch::reverse_pdf)
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
        let uses = [Input::Wi, Input::Wo];
        let outputs = [Output::vectors(f, "f", 0), Output::numbers(pdf, "pdf")];
        shade(shader, points, &uses, (message, message_size), outputs, batch::eval_pdf)
    }
}

/// Writes to `wi`, `weight` and `pdf` what `selvedge_shader_sample` draws at each point: uses `uv`,
/// `wo`, `xi`, `lobes`. Otherwise as `selvedge_shader_eval_batch`.
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
        let uses = [Input::Wo, Input::Xi];
        let outputs = [
            Output::vectors(wi, "wi", 0),
            Output::vectors(weight, "weight", 1),
            Output::numbers(pdf, "pdf"),
        ];
        shade(shader, points, &uses, (message, message_size), outputs, batch::sample)
    }
}

/// Writes to `albedo` what `selvedge_shader_albedo` finds at each point: uses `uv`, `wo`. Otherwise as
/// `selvedge_shader_eval_batch`.
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
        shade(shader, points, &[Input::Wo], (message, message_size), outputs, batch::albedo)
    }
}

/// Writes to `opacity` what `selvedge_shader_opacity` finds at each point: uses `uv`. Otherwise as
/// `selvedge_shader_eval_batch`.
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
        shade(shader, points, &[], (message, message_size), outputs, batch::opacity)
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
        if points.points.count == 0 {
            return Ok(());
        }
        // SAFETY: the caller vouches for at least one struct as large as it says.
        let output = unsafe { memory::output(yarn_points)? };
        // SAFETY: the caller vouches for the points.
        unsafe {
            points.each_block(|first, block| {
                for i in block.points() {
                    let point = YarnPoint::at(shader, block.uv(i));
                    output.add(first + i).write_unaligned(point);
                }
            });
        }
        Ok(())
    })
}

/// Shades `points` and writes what is found to `outputs`.
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
    find: fn(&selvedge_yarn_brdf::Shader, &Block, &mut Found),
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
        let mut found = Found::NOTHING;
        // SAFETY: the caller vouches for the points and for as many places.
        unsafe {
            points.each_block(|first, block| {
                find(shader, block, &mut found);
                for output in &checked {
                    output.scatter(first, block, &found);
                }
            });
        }
        Ok(())
    })
}

/// What a function looks at besides the positions.
#[derive(Clone, Copy, PartialEq)]
enum Input {
    Wi,
    Wo,
    Xi,
}

/// Points whose arrays are there, as far as they are needed.
struct Checked {
    points: Points,
    uses: [bool; 3],
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
        points.active.check(count, "points.active")?;
        let is_face_alone = points.sides == Sides::Face as u32;
        Ok(Self { points, uses, lobes, is_face_alone })
    }

    /// Hands on all points, block by block, each with the index of its first.
    ///
    /// # Safety
    ///
    /// The arrays have as many elements as there are points.
    unsafe fn each_block(&self, mut shade: impl FnMut(usize, &Block)) {
        let points = &self.points;
        let mut block = Block { lobes: self.lobes, ..Block::EMPTY };
        let mut first = 0;
        while first < points.count {
            block.len = BLOCK.min(points.count - first);
            let Block { len, active, uv, wi, wo, xi, .. } = &mut block;
            // SAFETY: the caller vouches for elements up to the number of points.
            unsafe {
                points.active.gather(first, &mut active[..*len]);
                points.uv.gather(first, &active[..*len], uv);
                for (used, vectors, planes) in [
                    (self.uses[0], &points.wi, wi),
                    (self.uses[1], &points.wo, &mut *wo),
                    (self.uses[2], &points.xi, xi),
                ] {
                    if used {
                        vectors.gather(first, &active[..*len], planes);
                    }
                }
            }
            if self.is_face_alone {
                // In the plane of the cloth nothing is seen.
                wo[2].iter_mut().for_each(|z| *z = z.max(0.0));
            }
            shade(first, &block);
            first += block.len;
        }
    }
}

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

    /// # Safety
    ///
    /// There are as many places as points, of which `block` has those from `first` on.
    unsafe fn scatter(&self, first: usize, block: &Block, found: &Found) {
        let active = &block.active[..block.len];
        // SAFETY: the caller vouches for the places.
        unsafe {
            match self {
                Self::Vectors(output, _, number) => {
                    output.scatter(first, active, &found.vectors[*number]);
                }
                Self::Numbers(output, _) => output.scatter(first, active, &found.numbers),
            }
        }
    }
}
