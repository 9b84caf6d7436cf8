//! How a call ended, and where the reason goes when it failed.

use std::borrow::Cow;
use std::error::Error;
use std::ffi::c_char;
use std::fmt::Display;
use std::iter::successors;
use std::ptr;

/// How a call ended. The numbers never change their meaning.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Status {
    /// The call did what was asked.
    Ok = 0,
    /// A pointer that must not be NULL is.
    NullPointer = 1,
    /// A number is outside the range that the function names.
    InvalidArgument = 2,
    /// The bytes are not a draft that can be read, or the draft lacks what weaving takes.
    InvalidDraft = 3,
    /// The draft weaves, but not into a cloth that can be shaded.
    InvalidCloth = 4,
    /// A defect of the library.
    Panic = 5,
    /// A file cannot be read.
    Unreadable = 6,
    /// The text is not a fabric.
    InvalidFabric = 7,
    /// The yarn has no such parameter: its highlight or phase function is of another kind.
    Absent = 8,
}

/// Why a call failed.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) text: Cow<'static, str>,
}

impl Failure {
    pub(crate) fn new(status: Status, text: impl Into<Cow<'static, str>>) -> Self {
        Self { status, text: text.into() }
    }

    /// The argument `name` is NULL.
    pub(crate) fn null(name: &str) -> Self {
        Self::new(Status::NullPointer, format!("{name}: null, expected a pointer"))
    }

    /// `name` is what was `found`, in words, where `expected` should be.
    pub(crate) fn argument(name: &str, found: impl Display, expected: impl Display) -> Self {
        Self::new(Status::InvalidArgument, format!("{name}: {found}, expected {expected}"))
    }

    /// `error` with its causes.
    pub(crate) fn from_error(status: Status, error: &dyn Error) -> Self {
        let chain = successors(Some(error), |&error| error.source());
        let texts: Vec<_> = chain.map(ToString::to_string).collect();
        Self::new(status, texts.join(": "))
    }
}

/// The caller's buffer for the reason of a failure.
pub(crate) struct Message {
    start: *mut c_char,
    size: usize,
}

impl Message {
    /// No buffer.
    pub(crate) const NONE: Self = Self { start: ptr::null_mut(), size: 0 };

    /// # Safety
    ///
    /// `start` is NULL or valid for writes of `size` bytes, which nobody else uses as long as
    /// the message lives.
    pub(crate) unsafe fn new(start: *mut c_char, size: usize) -> Self {
        Self { start, size }
    }

    /// Writes as much of `text` as fits before the NUL, whole characters only.
    pub(crate) fn write(self, text: &str) {
        if self.start.is_null() || self.size == 0 {
            return;
        }
        let text = &text[..text.floor_char_boundary(self.size - 1)];
        let start = self.start.cast::<u8>();
        // SAFETY: `new` demands `size` bytes at `start`; the text with its NUL takes no more.
        unsafe {
            ptr::copy_nonoverlapping(text.as_ptr(), start, text.len());
            start.add(text.len()).write(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_cut_between_characters() {
        for (size, expected) in
            [(0, ""), (1, "\0"), (2, "a\0"), (3, "a\0"), (4, "aé\0"), (5, "aéb\0"), (9, "aéb\0")]
        {
            let mut buffer = [0xff_u8; 9];
            // SAFETY: the buffer has at least the size given.
            unsafe { Message::new(buffer.as_mut_ptr().cast(), size) }.write("aéb");
            let (written, rest) = buffer.split_at(expected.len());
            assert_eq!(written, expected.as_bytes(), "size {size}");
            assert!(rest.iter().all(|&byte| byte == 0xff), "size {size}: {buffer:?}");
        }
    }

    #[derive(Debug)]
    struct Outer(std::fmt::Error);

    impl std::fmt::Display for Outer {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("outer")
        }
    }

    impl Error for Outer {
        fn source(&self) -> Option<&(dyn Error + 'static)> {
            Some(&self.0)
        }
    }

    #[test]
    fn causes_follow_their_error() {
        let inner = std::fmt::Error;
        let failure = Failure::from_error(Status::InvalidCloth, &Outer(inner));
        assert_eq!(failure.text, format!("outer: {inner}"));
    }
}
