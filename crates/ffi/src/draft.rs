//! `selvedge_draft`: how threads interlace, from a WIF file or from a pattern in memory.

use std::ffi::{CStr, c_char};
use std::fs::File;
use std::io::Read;

use selvedge_wif::{Drawdown, Severity};
use selvedge_yarn_brdf::{MAX_CROSSINGS, Thread, Weave};

use crate::memory::{self, Handshake};
use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// A weaving draft: how threads interlace, with their colours and sizes.
///
/// Never changes; any number of threads may use one at the same time.
#[derive(Debug)]
pub struct Draft {
    pub(crate) weave: Weave,
    pub(crate) ends: Vec<Thread>,
    pub(crate) picks: Vec<Thread>,
    warnings: String,
}

/// A weave and its threads, for those who have no WIF file. Numbering is that of the cloth: end 0 at
/// u = 0, pick 0 at v = 0. Every pointer but `warp_up` may be NULL, which leaves open what it tells.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Pattern {
    /// `sizeof(selvedge_pattern)`.
    pub struct_size: usize,
    /// Ends, the threads of the warp; at least 1.
    pub ends: u32,
    /// Picks, the threads of the weft; at least 1.
    pub picks: u32,
    /// For each pick, for each end: 0 if the pick is on top of their crossing, else the end.
    pub warp_up: *const u8,
    /// Number of each end's type, which a fabric can give yarn of its own (`"color"` in its
    /// overrides), or `SELVEDGE_NO_TYPE`.
    pub end_types: *const u32,
    /// As `end_types`, of the picks.
    pub pick_types: *const u32,
    /// Colour of each end, three numbers for each: linear red, green and blue with the primaries of
    /// sRGB, each in [0, 1]. Open, all is black.
    pub end_colors: *const f32,
    /// As `end_colors`, of the picks.
    pub pick_colors: *const f32,
    /// Distance between the middles of neighbouring ends, m; 0 leaves it open.
    pub end_pitch: f64,
    /// As `end_pitch`, of the picks.
    pub pick_pitch: f64,
    /// Diameter of each end, m; 0 leaves that of one thread open.
    pub end_diameters: *const f64,
    /// As `end_diameters`, of the picks.
    pub pick_diameters: *const f64,
}

/// The type of a thread that has none.
pub const SELVEDGE_NO_TYPE: u32 = u32::MAX;

/// Greatest size of a draft or fabric in a file, bytes: over a hundred times the largest in use.
const MAX_BYTES: u64 = 1 << 28;

// SAFETY: `repr(C)`, begins with `struct_size`, and any bits are numbers or pointers.
unsafe impl Handshake for Pattern {
    const NAME: &'static str = "pattern";
}

/// Reads the `length` bytes of a WIF file into `*draft`, which the caller frees with
/// `selvedge_draft_free`.
///
/// What departs from the format is read past where it can be, and told by
/// `selvedge_draft_warnings`. Fails with `SELVEDGE_STATUS_INVALID_DRAFT` where no draft is left, or
/// it does not say how its threads interlace; `message` then says where in the file and why, in
/// three lines for each reason. Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if `length` is more
/// than any object in memory can have, such as -1 from a file that could not be read.
///
/// # Safety
///
/// `bytes` is NULL or points to `length` bytes; `message` is NULL or points to `message_size`
/// bytes; `draft` is NULL or points to a pointer. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_draft_new(
    bytes: *const u8,
    length: usize,
    message: *mut c_char,
    message_size: usize,
    draft: *mut *mut Draft,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (bytes, output) = (non_null(bytes, "bytes")?, non_null(draft, "draft")?);
        // SAFETY: not NULL, so the caller vouches for `length` bytes.
        let bytes = unsafe { memory::slice(bytes, length, "length")? };
        let draft = Draft::from_wif(bytes)?;
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write_unaligned(Box::into_raw(Box::new(draft))) };
        Ok(())
    })
}

/// As `selvedge_draft_new`, of the WIF file at `path`, which ends with a NUL and is UTF-8.
///
/// Fails with `SELVEDGE_STATUS_UNREADABLE` if there is no file that can be read, or it is larger than
/// 256 MiB.
///
/// # Safety
///
/// `path` is NULL or points to bytes that end with a NUL; `message` is NULL or points to
/// `message_size` bytes; `draft` is NULL or points to a pointer. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_draft_load(
    path: *const c_char,
    message: *mut c_char,
    message_size: usize,
    draft: *mut *mut Draft,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (path, output) = (non_null(path, "path")?, non_null(draft, "draft")?);
        // SAFETY: not NULL, so the caller vouches for bytes that end with a NUL.
        let path = path_of(unsafe { CStr::from_ptr(path.as_ptr()) })?;
        let draft = Draft::from_wif(&read(path)?)?;
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write_unaligned(Box::into_raw(Box::new(draft))) };
        Ok(())
    })
}

/// Copies a weave and its threads into `*draft`, which the caller frees with `selvedge_draft_free`.
///
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` where a number is out of its range or not finite,
/// with `SELVEDGE_STATUS_INVALID_DRAFT` if there are no or more than 2^28 crossings.
///
/// # Safety
///
/// `pattern` is NULL or points to a pattern whose pointers are NULL or point to as many elements as
/// it tells; `message` is NULL or points to `message_size` bytes; `draft` is NULL or points to a
/// pointer. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_draft_from_pattern(
    pattern: *const Pattern,
    message: *mut c_char,
    message_size: usize,
    draft: *mut *mut Draft,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        // SAFETY: the caller vouches for NULL or a pattern.
        let pattern = unsafe { memory::read(pattern)? };
        let output = non_null(draft, "draft")?;
        let warp_up = non_null(pattern.warp_up, "warp_up")?;
        let count = u64::from(pattern.ends) * u64::from(pattern.picks);
        // Too many are not looked at: the weave refuses them.
        let count = if count <= MAX_CROSSINGS { count as usize } else { 0 };
        // SAFETY: not NULL, so the caller vouches for as many bytes as there are crossings.
        let warp_up = unsafe { memory::slice(warp_up, count, "warp_up")? };
        let is_up = |end, pick| warp_up[pick as usize * pattern.ends as usize + end as usize] != 0;
        let weave = Weave::new(pattern.ends, pattern.picks, is_up);
        let weave = weave.map_err(|error| Failure::from_error(Status::InvalidDraft, &error))?;
        let Pattern { end_types, end_colors, end_pitch, end_diameters, .. } = pattern;
        let Pattern { pick_types, pick_colors, pick_pitch, pick_diameters, .. } = pattern;
        // SAFETY: the caller vouches for as many elements as there are ends and picks.
        let (ends, picks) = unsafe {
            (
                threads("end", pattern.ends, end_types, end_colors, end_pitch, end_diameters)?,
                threads(
                    "pick",
                    pattern.picks,
                    pick_types,
                    pick_colors,
                    pick_pitch,
                    pick_diameters,
                )?,
            )
        };
        let draft = Draft { weave, ends, picks, warnings: String::new() };
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write_unaligned(Box::into_raw(Box::new(draft))) };
        Ok(())
    })
}

/// Writes to `*length` the bytes of what was odd about the draft's file, without the NUL, and to
/// `text` as much of it as fits: UTF-8, three lines for each warning; empty if nothing was.
///
/// # Safety
///
/// `draft` is NULL or a draft not freed; `text` is NULL or points to `text_size` bytes; `length` is
/// NULL or points to a number. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_draft_warnings(
    draft: *const Draft,
    text: *mut c_char,
    text_size: usize,
    length: *mut usize,
) -> Status {
    guard(Message::NONE, || {
        let (draft, output) = (non_null(draft, "draft")?, non_null(length, "length")?);
        // SAFETY: not NULL, so the caller vouches for a live draft, which nothing changes, for
        // `text_size` bytes and for a number.
        unsafe {
            let warnings = &draft.as_ref().warnings;
            Message::new(text, text_size).write(warnings);
            output.write_unaligned(warnings.len());
        }
        Ok(())
    })
}

/// Frees a draft; NULL is nothing to free.
///
/// # Safety
///
/// `draft` is NULL or comes from a function that makes a draft, has not been freed, and is not used
/// by another thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_draft_free(draft: *mut Draft) {
    guard(Message::NONE, || {
        if !draft.is_null() {
            // SAFETY: made by `Box::into_raw`, and freed only here.
            drop(unsafe { Box::from_raw(draft) });
        }
        Ok(())
    });
}

impl Draft {
    /// The draft in the bytes of a WIF file.
    pub(crate) fn from_wif(bytes: &[u8]) -> Result<Self, Failure> {
        let parse = selvedge_wif::parse(bytes);
        let lines = |severity| {
            let diagnostics = parse.diagnostics.iter().filter(|d| d.severity == severity);
            let texts: Vec<_> = diagnostics.map(|d| d.display(bytes).to_string()).collect();
            texts.join("\n")
        };
        let Some(draft) = &parse.draft else {
            return Err(Failure::new(Status::InvalidDraft, lines(Severity::Error)));
        };
        let invalid =
            |error: &dyn std::error::Error| Failure::from_error(Status::InvalidDraft, error);
        let drawdown = draft.drawdown().map_err(|error| invalid(&error))?;
        let weave = weave(&drawdown).map_err(|error| invalid(&error))?;
        let thread = |thread: &selvedge_wif::Thread| Thread {
            color: thread.color.linear(),
            color_number: thread.color_number,
            pitch: thread.pitch,
            diameter: thread.diameter,
        };
        let ends = (0..drawdown.ends()).map(|end| thread(drawdown.end(end))).collect();
        let picks = (0..drawdown.picks()).map(|pick| thread(drawdown.pick(pick))).collect();
        Ok(Self { weave, ends, picks, warnings: lines(Severity::Warning) })
    }
}

/// The weave of a drawdown, end for end and pick for pick.
fn weave(drawdown: &Drawdown) -> Result<Weave, selvedge_yarn_brdf::WeaveError> {
    // A draft counts its threads in `u32`.
    let (ends, picks) = (drawdown.ends() as u32, drawdown.picks() as u32);
    Weave::new(ends, picks, |end, pick| drawdown.warp_on_top(end as usize, pick as usize))
}

/// The threads of one side of a pattern.
///
/// # Safety
///
/// Each pointer is NULL or points to `count` elements, of three numbers for colours.
unsafe fn threads(
    name: &str,
    count: u32,
    types: *const u32,
    colors: *const f32,
    pitch: f64,
    diameters: *const f64,
) -> Result<Vec<Thread>, Failure> {
    let known = |value: f64, what: &str| match value {
        0.0 => Ok(None),
        value if value > 0.0 && value.is_finite() => Ok(Some(value)),
        value => Err(Failure::argument(&format!("{name}_{what}"), value, "0 or a positive number")),
    };
    let pitch = known(pitch, "pitch")?;
    let mut threads = Vec::with_capacity(count as usize);
    for index in 0..count as usize {
        // SAFETY: what is not NULL has `count` elements, and `index` is below that.
        let (number, color, diameter) = unsafe {
            (
                element(types, index),
                element(colors.cast::<[f32; 3]>(), index),
                element(diameters, index),
            )
        };
        let color = color.unwrap_or_default();
        if !color.iter().all(|value| (0.0..=1.0).contains(value)) {
            let place = format!("{name}_colors {index}");
            return Err(Failure::argument(&place, format_args!("{color:?}"), "0 to 1 each"));
        }
        threads.push(Thread {
            color,
            color_number: number.filter(|&number| number != SELVEDGE_NO_TYPE),
            pitch,
            diameter: known(diameter.unwrap_or(0.0), "diameters")?,
        });
    }
    Ok(threads)
}

/// An element of an array, whatever its alignment; `None` if there is no array.
///
/// # Safety
///
/// `start` is NULL or points to more than `index` elements.
unsafe fn element<T: Copy>(start: *const T, index: usize) -> Option<T> {
    // SAFETY: the caller vouches for the element.
    (!start.is_null()).then(|| unsafe { start.add(index).read_unaligned() })
}

/// The path that a C string names.
pub(crate) fn path_of(path: &CStr) -> Result<&str, Failure> {
    path.to_str().map_err(|_| Failure::argument("path", "not UTF-8", "a path in UTF-8"))
}

/// The bytes of the file at `path`.
pub(crate) fn read(path: &str) -> Result<Vec<u8>, Failure> {
    let unreadable = |what: String| Failure::new(Status::Unreadable, format!("{path}: {what}"));
    let mut bytes = Vec::new();
    let file = File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes));
    file.map_err(|error| unreadable(format!("cannot be read: {error}")))?;
    if bytes.len() as u64 > MAX_BYTES {
        let what = format!("more than {MAX_BYTES} bytes, expected a draft or a fabric");
        return Err(unreadable(what));
    }
    Ok(bytes)
}
