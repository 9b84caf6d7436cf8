//! `selvedge_fabric`: a draft and the yarn it is woven of, which a host may change.

use std::collections::BTreeMap;
use std::ffi::{CStr, c_char};

use selvedge_yarn_brdf::Cloth;

use crate::draft::{self, Draft};
use crate::entry::no_yarn;
use crate::json::FabricText;
use crate::memory::{self, Handshake};
use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// A draft woven of yarn whose parameters can be read and set, until shaders are made of it.
///
/// Any number of threads may read one at the same time; while one changes it, no other may use it.
#[derive(Debug)]
pub struct Fabric {
    pub(crate) cloth: Cloth,
    /// What the highlight of a type of yarn is divided by, where that is not to be found.
    pub(crate) divisors: BTreeMap<u16, Vec<f32>>,
    /// What its text says in vain, a line for each.
    pub(crate) warnings: String,
}

/// The size of a fabric.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct FabricInfo {
    /// `sizeof(selvedge_fabric_info)`, set by the caller.
    pub struct_size: usize,
    /// Ends in the repeat, the threads of the warp.
    pub ends: u32,
    /// Picks in the repeat, the threads of the weft.
    pub picks: u32,
    /// Types of yarn, counted from 0.
    pub yarns: u32,
    /// 0.
    pub reserved: u32,
    /// Extent of one repeat along the weft, m, before rotation and scale.
    pub width: f64,
    /// Extent of one repeat along the warp, m, before rotation and scale.
    pub height: f64,
}

// SAFETY: `repr(C)`, begins with `struct_size`, and any bits are numbers.
unsafe impl Handshake for FabricInfo {
    const NAME: &'static str = "info";
}

/// Weaves `draft` of the yarn that `json` describes into `*fabric`, which the caller frees with
/// `selvedge_fabric_free`. A `json` of NULL is the default fabric.
///
/// Colours, distances and diameters of the threads are those of the draft where the fabric leaves
/// them open. The text is that of a fabric file, `{"yarn": {"psi": 0.5}, "overrides": [...]}`; its
/// `version` may be missing, its `draft` is not looked at. Fails with
/// `SELVEDGE_STATUS_INVALID_FABRIC` if it is none, with `SELVEDGE_STATUS_INVALID_CLOTH` if a
/// parameter is out of its range.
///
/// # Safety
///
/// `draft` is NULL or a draft not freed; `json` is NULL or points to `json_length` bytes; `message` is
/// NULL or points to `message_size` bytes; `fabric` is NULL or points to a pointer. Safe from any
/// thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_new(
    draft: *const Draft,
    json: *const c_char,
    json_length: usize,
    message: *mut c_char,
    message_size: usize,
    fabric: *mut *mut Fabric,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (draft, output) = (non_null(draft, "draft")?, non_null(fabric, "fabric")?);
        let text = if json.is_null() {
            FabricText::default()
        } else {
            let json = non_null(json.cast::<u8>(), "json")?;
            // SAFETY: not NULL, so the caller vouches for `json_length` bytes.
            FabricText::parse(unsafe { memory::slice(json, json_length, "json_length") }?)?
        };
        // SAFETY: not NULL, so the caller vouches for a live draft, which nothing changes.
        let fabric = Fabric::new(unsafe { draft.as_ref() }, &text)?;
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write_unaligned(Box::into_raw(Box::new(fabric))) };
        Ok(())
    })
}

/// As `selvedge_fabric_new`, of the file at `path`, which ends with a NUL and is UTF-8: a fabric with
/// its draft, or a draft alone, which is woven of the default yarn.
///
/// The path of a fabric's draft starts where the fabric is. Fails with `SELVEDGE_STATUS_UNREADABLE`
/// if either file cannot be read, and as `selvedge_draft_new`.
///
/// # Safety
///
/// `path` is NULL or points to bytes that end with a NUL; `message` is NULL or points to
/// `message_size` bytes; `fabric` is NULL or points to a pointer. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_load(
    path: *const c_char,
    message: *mut c_char,
    message_size: usize,
    fabric: *mut *mut Fabric,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (path, output) = (non_null(path, "path")?, non_null(fabric, "fabric")?);
        // SAFETY: not NULL, so the caller vouches for bytes that end with a NUL.
        let fabric = Fabric::load(draft::path_of(unsafe { CStr::from_ptr(path.as_ptr()) })?)?;
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write_unaligned(Box::into_raw(Box::new(fabric))) };
        Ok(())
    })
}

/// Writes to `*info`, whose `struct_size` the caller has set, how large the fabric is.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
/// `message_size` bytes; `info` is NULL or points to a struct that is as large as it says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_describe(
    fabric: *const Fabric,
    message: *mut c_char,
    message_size: usize,
    info: *mut FabricInfo,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let fabric = non_null(fabric, "fabric")?;
        // SAFETY: the caller vouches for a struct as large as it says.
        let output = unsafe { memory::output(info)? };
        // SAFETY: not NULL, so the caller vouches for a live fabric that nobody changes.
        let cloth = unsafe { &fabric.as_ref().cloth };
        let size = cloth.size();
        let info = FabricInfo {
            struct_size: size_of::<FabricInfo>(),
            ends: cloth.weave.ends(),
            picks: cloth.weave.picks(),
            yarns: cloth.yarns.len() as u32,
            reserved: 0,
            width: size.x,
            height: size.y,
        };
        // SAFETY: as above.
        unsafe { output.write_unaligned(info) };
        Ok(())
    })
}

/// Writes to `warp_up` for each pick, for each end of the repeat 1 if the end is on top of their
/// crossing, else 0.
///
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` unless `length` is the number of crossings.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
/// `message_size` bytes; `warp_up` is NULL or points to `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_warp_up(
    fabric: *const Fabric,
    length: usize,
    message: *mut c_char,
    message_size: usize,
    warp_up: *mut u8,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (fabric, output) = (non_null(fabric, "fabric")?, non_null(warp_up, "warp_up")?);
        // SAFETY: not NULL, so the caller vouches for a live fabric that nobody changes.
        let weave = unsafe { &fabric.as_ref().cloth.weave };
        let (ends, picks) = (weave.ends() as usize, weave.picks() as usize);
        check_length(length, ends * picks)?;
        for index in 0..length {
            let is_up = weave.warp_on_top((index % ends) as i64, (index / ends) as i64);
            // SAFETY: the caller vouches for `length` bytes.
            unsafe { output.add(index).write(u8::from(is_up)) };
        }
        Ok(())
    })
}

/// Writes to `yarns` the type of yarn of each end, or of each pick if `is_weft` is 1.
///
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` unless `length` is the number of these threads and
/// `is_weft` is 0 or 1.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no thread changes; `message` is NULL or points to
/// `message_size` bytes; `yarns` is NULL or points to `length` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_yarns(
    fabric: *const Fabric,
    is_weft: u32,
    length: usize,
    message: *mut c_char,
    message_size: usize,
    yarns: *mut u32,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (fabric, output) = (non_null(fabric, "fabric")?, non_null(yarns, "yarns")?);
        // SAFETY: not NULL, so the caller vouches for a live fabric that nobody changes.
        let cloth = unsafe { &fabric.as_ref().cloth };
        let found = match is_weft {
            0 => &cloth.end_yarns,
            1 => &cloth.pick_yarns,
            _ => return Err(Failure::argument("is_weft", is_weft, "0 or 1")),
        };
        check_length(length, found.len())?;
        for (index, &yarn) in found.iter().enumerate() {
            // SAFETY: the caller vouches for `length` numbers.
            unsafe { output.add(index).write_unaligned(yarn.into()) };
        }
        Ok(())
    })
}

/// Has shaders made of the fabric from now on scale the highlight of the type `yarn` as another shader of
/// the same fabric does, whose `selvedge_shader_divisors` these are, wherever it was made. A `length` of 0
/// has them find their own again.
///
/// Whether there are as many as such a shader has, and all are positive and finite, is checked when one is
/// made.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no other thread uses; `divisors` is NULL or points to
/// `length` numbers; `message` is NULL or points to `message_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_set_divisors(
    fabric: *mut Fabric,
    yarn: u32,
    divisors: *const f32,
    length: usize,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (mut fabric, divisors) = (non_null(fabric, "fabric")?, non_null(divisors, "divisors")?);
        // SAFETY: not NULL, so the caller vouches for a live fabric that nobody else uses.
        let fabric = unsafe { fabric.as_mut() };
        let yarn = fabric.check_yarn(yarn)?;
        // SAFETY: not NULL, so the caller vouches for `length` numbers.
        let divisors = unsafe { memory::slice(divisors.cast::<[u8; 4]>(), length, "length") }?;
        let divisors: Vec<_> = divisors.iter().map(|&bytes| f32::from_ne_bytes(bytes)).collect();
        if divisors.is_empty() {
            fabric.divisors.remove(&yarn);
        } else {
            fabric.divisors.insert(yarn, divisors);
        }
        Ok(())
    })
}

/// Frees a fabric; NULL is nothing to free. Shaders made of it stay.
///
/// # Safety
///
/// `fabric` is NULL or comes from a function that makes a fabric, has not been freed, and is not used
/// by another thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_free(fabric: *mut Fabric) {
    guard(Message::NONE, || {
        if !fabric.is_null() {
            // SAFETY: made by `Box::into_raw`, and freed only here.
            drop(unsafe { Box::from_raw(fabric) });
        }
        Ok(())
    });
}

impl Fabric {
    fn new(draft: &Draft, text: &FabricText) -> Result<Self, Failure> {
        let Draft { weave, ends, picks, .. } = draft;
        let cloth = text.fabric.cloth(weave.clone(), ends, picks);
        let cloth = cloth.map_err(|error| Failure::from_error(Status::InvalidCloth, &error))?;
        let unused = text.fabric.unused(ends, picks).into_iter();
        let unused = unused
            .map(|index| format!("override {}: found no such threads in the draft", index + 1));
        Ok(Self {
            cloth,
            divisors: BTreeMap::new(),
            warnings: unused.collect::<Vec<_>>().join("\n"),
        })
    }

    /// The fabric in a file, whose text begins with a brace unless it is that of a draft.
    fn load(path: &str) -> Result<Self, Failure> {
        let bytes = draft::read(path)?;
        let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes).trim_ascii_start();
        if !start.starts_with(b"{") {
            return Self::new(&Draft::from_wif(&bytes)?, &FabricText::default());
        }
        let text = FabricText::parse(&bytes)?;
        let Some(source) = &text.draft else {
            let what = format!("{path}: found no \"draft\", expected one");
            return Err(Failure::new(Status::InvalidFabric, what));
        };
        Self::new(&source.draft(path)?, &text)
    }

    /// Whether there is a type `yarn`.
    pub(crate) fn check_yarn(&self, yarn: u32) -> Result<u16, Failure> {
        let count = self.cloth.yarns.len();
        let index = u16::try_from(yarn).ok().filter(|&index| usize::from(index) < count);
        index.ok_or_else(|| no_yarn(yarn, count))
    }
}

fn check_length(found: usize, expected: usize) -> Result<(), Failure> {
    if found == expected { Ok(()) } else { Err(Failure::argument("length", found, expected)) }
}
