//! How much is read and decoded, whatever a file claims. How many pixels a picture has is limited
//! by [`MAX_PIXELS`](crate::render::film::MAX_PIXELS).

use thiserror::Error;

/// Most bytes of a file, 8 GiB.
pub const MAX_FILE_BYTES: u64 = 1 << 33;

/// Most channels of a picture.
pub const MAX_CHANNELS: usize = 1024;

/// Most numbers of all channels of a picture, 2³¹: 32 for each pixel of the largest, 8 GiB.
pub const MAX_SAMPLES: u64 = 1 << 31;

/// Most bytes of pixels to a byte of a PNG or EXR. Deflate, which packs tightest of what they use,
/// makes at most 1032 of one, so no sound file has more.
pub const MAX_EXPANSION: u64 = 2048;

/// A file that is too short for what it claims to hold.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("found {found} bytes, expected at least {expected} for {claimed} bytes of pixels")]
pub struct TooShort {
    /// Bytes of the file.
    pub found: u64,
    /// Bytes that its pixels take.
    pub claimed: u64,
    /// Least bytes of a file with so many.
    pub expected: u64,
}

impl TooShort {
    /// Whether a file of `found` bytes can hold `claimed` bytes of pixels.
    ///
    /// # Errors
    ///
    /// [`TooShort`] when it cannot, by [`MAX_EXPANSION`].
    pub fn check(found: u64, claimed: u64) -> Result<(), Self> {
        let expected = claimed / MAX_EXPANSION;
        if found < expected { Err(Self { found, claimed, expected }) } else { Ok(()) }
    }
}
