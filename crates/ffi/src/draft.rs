//! `selvedge_draft`: what a WIF file says.

use std::ffi::c_char;
use std::slice;

use selvedge_wif::Severity;

use crate::status::{Failure, Message, Status};
use crate::{guard, non_null};

/// A weaving draft: how threads interlace, with their colours and sizes.
///
/// Never changes; any number of threads may use one at the same time.
#[derive(Debug)]
pub struct Draft(pub(crate) selvedge_wif::Draft);

/// Reads the `length` bytes of a WIF file into `*draft`, which the caller frees with
/// `selvedge_draft_free`.
///
/// What departs from the format is read past where it can be. Fails with
/// `SELVEDGE_STATUS_INVALID_DRAFT` where no draft is left; `message` then says where in the file
/// and why, in three lines for each reason. Fails with `SELVEDGE_STATUS_INVALID_ARGUMENT` if
/// `length` is more than any object in memory can have, such as -1 from a file that could not
/// be read.
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
        if isize::try_from(length).is_err() {
            let text = format!("length: {length} bytes, expected at most {}", isize::MAX);
            return Err(Failure::new(Status::InvalidArgument, text));
        }
        // SAFETY: not NULL, so the caller vouches for `length` bytes; no object is longer than
        // `isize::MAX`.
        let bytes = unsafe { slice::from_raw_parts(bytes.as_ptr(), length) };
        let parse = selvedge_wif::parse(bytes);
        let Some(draft) = parse.draft else {
            let errors = parse.diagnostics.iter().filter(|d| d.severity == Severity::Error);
            let texts: Vec<_> = errors.map(|error| error.display(bytes).to_string()).collect();
            return Err(Failure::new(Status::InvalidDraft, texts.join("\n")));
        };
        // SAFETY: not NULL, so the caller vouches for a pointer there.
        unsafe { output.write(Box::into_raw(Box::new(Draft(draft)))) };
        Ok(())
    })
}

/// Frees a draft; NULL is nothing to free.
///
/// # Safety
///
/// `draft` is NULL or comes from `selvedge_draft_new`, has not been freed, and is not used by
/// another thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn selvedge_draft_free(draft: *mut Draft) {
    guard(Message::NONE, || {
        if !draft.is_null() {
            // SAFETY: made by `Box::into_raw` in `selvedge_draft_new`, and freed only here.
            drop(unsafe { Box::from_raw(draft) });
        }
        Ok(())
    });
}
