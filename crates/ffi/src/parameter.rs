//! The parameters of a fabric as data, so that a host can build panels for them.

use std::ffi::{CStr, c_char};

use crate::entry::{Entry, entries, entry};
use crate::fabric::Fabric;
use crate::memory::{self, Handshake};
use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// What a parameter is, for a panel. Texts are ASCII and end with a NUL.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// `sizeof(selvedge_parameter)`, set by the caller.
    pub struct_size: usize,
    /// As in files and messages; it never changes, where the index may with a later library.
    pub name: [c_char; 32],
    /// What it is, in a few words.
    pub meaning: [c_char; 96],
    /// Its unit; empty for a pure number.
    pub unit: [c_char; 8],
    /// The names of a choice's values 0, 1, ..., with a `|` between two; empty if it is none.
    pub choices: [c_char; 64],
    /// A `selvedge_parameter_kind`: whether it is one number, a colour of three, or a choice.
    pub kind: u32,
    /// 1 if it is one of the cloth as a whole, 0 if each type of yarn has its own.
    pub is_of_cloth: u32,
    /// The least value of each number.
    pub low: f64,
    /// The greatest value of each number.
    pub high: f64,
    /// The value where nothing is said.
    pub default_value: [f64; 3],
}

// SAFETY: `repr(C)`, begins with `struct_size`, and any bits are numbers.
unsafe impl Handshake for Parameter {
    const NAME: &'static str = "parameter";
}

/// What the value of a parameter is. The numbers never change their meaning.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ParameterKind {
    /// One number.
    Number = 0,
    /// Three numbers: linear red, green and blue with the primaries of sRGB.
    Color = 1,
    /// The index of one of its choices.
    Choice = 2,
}

/// The number of parameters.
///
/// # Safety
///
/// Takes no pointer; there is nothing to keep. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_parameter_count() -> u32 {
    entries().count() as u32
}

/// Writes to `*parameter`, whose `struct_size` the caller has set, what the parameter `index` is:
/// those of yarn in the order in which a panel would show them, then those of the cloth.
///
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there are not that many.
///
/// # Safety
///
/// `parameter` is NULL or points to a struct that is as large as it says; `message` is NULL or points
/// to `message_size` bytes. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_parameter_describe(
    index: u32,
    message: *mut c_char,
    message_size: usize,
    parameter: *mut Parameter,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        // SAFETY: the caller vouches for a struct as large as it says.
        let output = unsafe { memory::output(parameter)? };
        let described = Parameter::of(&entry(index)?);
        // SAFETY: as above.
        unsafe { output.write_unaligned(described) };
        Ok(())
    })
}

/// Writes to `*index` which parameter is called `name`, which ends with a NUL.
///
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if none is.
///
/// # Safety
///
/// `name` is NULL or points to bytes that end with a NUL; `index` is NULL or points to a number;
/// `message` is NULL or points to `message_size` bytes. Safe from any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_parameter_find(
    name: *const c_char,
    message: *mut c_char,
    message_size: usize,
    index: *mut u32,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let (name, output) = (non_null(name, "name")?, non_null(index, "index")?);
        // SAFETY: not NULL, so the caller vouches for bytes that end with a NUL.
        let name = unsafe { CStr::from_ptr(name.as_ptr()) }.to_string_lossy();
        let found = entries().position(|entry| entry.name() == name);
        let found = found.ok_or_else(|| {
            Failure::argument("name", format_args!("\"{name}\""), "the name of a parameter")
        })?;
        // SAFETY: not NULL, so the caller vouches for a number there.
        unsafe { output.write_unaligned(found as u32) };
        Ok(())
    })
}

/// Writes to `value` the parameter `index` of the type `yarn`, or of the cloth, where `yarn` is not
/// looked at: one number, or three of a colour, where all else is 0.
///
/// Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if there is no such parameter or type, with
/// `SELVEDGE_STATUS_ABSENT` if the type's highlight or phase function has no such parameter.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no thread changes; `value` is NULL or points to three
/// numbers; `message` is NULL or points to `message_size` bytes.
///
/// cbindgen:ptrs-as-arrays=[[value;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_value(
    fabric: *const Fabric,
    yarn: u32,
    index: u32,
    message: *mut c_char,
    message_size: usize,
    value: *mut f64,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let fabric = non_null(fabric, "fabric")?;
        let output = non_null(value, "value")?.cast::<[f64; 3]>();
        // SAFETY: not NULL, so the caller vouches for a live fabric that nobody changes.
        let cloth = unsafe { &fabric.as_ref().cloth };
        let found = entry(index)?.of(cloth, yarn)?;
        // SAFETY: not NULL, so the caller vouches for three numbers there.
        unsafe { output.write_unaligned(found) };
        Ok(())
    })
}

/// Sets the parameter `index` of the type `yarn`, or of the cloth, where `yarn` is not looked at, to
/// `value`: one number, or three of a colour.
///
/// A choice of another highlight or phase function gives it its default numbers. Shaders made before
/// stay as they are. Fails as `selvedge_fabric_value`, and with `SELVEDGE_STATUS_INVALID_ARGUMENT` if
/// a number is not in the parameter's range.
///
/// # Safety
///
/// `fabric` is NULL or a fabric not freed, which no other thread uses; `value` is NULL or points to
/// three numbers; `message` is NULL or points to `message_size` bytes.
///
/// cbindgen:ptrs-as-arrays=[[value;3]]
#[allow(rustdoc::broken_intra_doc_links, reason = "what cbindgen reads above is not a link")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_fabric_set_value(
    fabric: *mut Fabric,
    yarn: u32,
    index: u32,
    value: *const f64,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    // SAFETY: the caller vouches for `message_size` bytes.
    let message = unsafe { Message::new(message, message_size) };
    guard(message, || {
        let mut fabric = non_null(fabric, "fabric")?;
        let value = non_null(value, "value")?.cast::<[f64; 3]>();
        // SAFETY: not NULL, so the caller vouches for a live fabric that nobody else uses, and for
        // three numbers.
        let (cloth, value) = unsafe { (&mut fabric.as_mut().cloth, value.read_unaligned()) };
        entry(index)?.set(cloth, yarn, value)
    })
}

impl Parameter {
    fn of(entry: &Entry) -> Self {
        let (kind, meaning, unit, [low, high], is_of_cloth) = entry.facts();
        Self {
            struct_size: size_of::<Self>(),
            name: text(entry.name()),
            meaning: text(meaning),
            unit: text(unit),
            choices: text(&entry.choices().join("|")),
            kind: kind as u32,
            is_of_cloth: is_of_cloth.into(),
            low,
            high,
            default_value: entry.default_value(),
        }
    }
}

/// `text` with a NUL, cut where there is no room for it.
fn text<const N: usize>(text: &str) -> [c_char; N] {
    let mut chars = [0; N];
    for (to, from) in chars[..N - 1].iter_mut().zip(text.bytes()) {
        *to = from as c_char;
    }
    chars
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_every_text_has_room() {
        let mut names: Vec<_> = entries().map(|entry| entry.name()).collect();
        for entry in entries() {
            let described = Parameter::of(&entry);
            for (chars, room) in [
                (&described.name[..], "name"),
                (&described.meaning, "meaning"),
                (&described.unit, "unit"),
                (&described.choices, "choices"),
            ] {
                let is_cut = chars[chars.len() - 2] != 0;
                assert!(!is_cut, "{}: {room} fills all of its room", entry.name());
            }
            assert!(described.low <= described.high, "{}", entry.name());
        }
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
