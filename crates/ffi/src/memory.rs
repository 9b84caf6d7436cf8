//! The caller's memory: arrays with a length, structs that tell their size, arrays with strides.

use std::ptr::NonNull;
use std::slice;

use crate::non_null;
use crate::status::Failure;

/// A struct of the header that begins with its size as the caller was compiled with it.
///
/// # Safety
///
/// The type is `repr(C)`, its first field is `struct_size: usize`, and it is valid for any bits.
pub(crate) unsafe trait Handshake: Copy {
    /// What its argument is called.
    const NAME: &'static str;
}

/// The struct at `pointer`.
///
/// Its size must be the one that this library knows: a caller whose struct is larger was compiled
/// with a later header, and what more it asks for is not known here.
///
/// # Safety
///
/// `pointer` is NULL or points to a `T`, or at least to as much as the caller says that it has.
pub(crate) unsafe fn read<T: Handshake>(pointer: *const T) -> Result<T, Failure> {
    let pointer = non_null(pointer, T::NAME)?;
    // SAFETY: not NULL, so the caller vouches for a struct that begins with its size.
    check_size::<T>(unsafe { pointer.cast::<usize>().read_unaligned() })?;
    // SAFETY: the caller has told that a whole `T` is there.
    Ok(unsafe { pointer.read_unaligned() })
}

/// Where to write a struct whose caller says how large it is there.
///
/// # Safety
///
/// As for [`read`].
pub(crate) unsafe fn output<T: Handshake>(pointer: *mut T) -> Result<NonNull<T>, Failure> {
    let pointer = non_null(pointer, T::NAME)?;
    // SAFETY: not NULL, so the caller vouches for a struct that begins with its size.
    check_size::<T>(unsafe { pointer.cast::<usize>().read_unaligned() })?;
    Ok(pointer)
}

fn check_size<T: Handshake>(found: usize) -> Result<(), Failure> {
    if found == size_of::<T>() {
        return Ok(());
    }
    Err(Failure::argument(&format!("{}.struct_size", T::NAME), found, size_of::<T>()))
}

/// The `length` elements at `start`; `name` is what the caller knows the length by.
///
/// # Safety
///
/// `start` is aligned and points to `length` elements that nothing changes during `'a`, unless no
/// object has so many.
pub(crate) unsafe fn slice<'a, T>(
    start: NonNull<T>,
    length: usize,
    name: &str,
) -> Result<&'a [T], Failure> {
    let most = isize::MAX as usize / size_of::<T>();
    if length > most {
        return Err(Failure::argument(name, length, format_args!("at most {most}")));
    }
    // SAFETY: the caller vouches for the elements, and they are not more than an object has.
    Ok(unsafe { slice::from_raw_parts(start.as_ptr(), length) })
}
