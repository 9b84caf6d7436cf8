//! From a file to a picture, by what is in the file and not by its name.

use std::path::Path;

use ::image::{DynamicImage, ImageBuffer, Rgb};
use glam::Vec3;
use thiserror::Error;

use super::{Picture, exr, exr::ExrError, hdr, hdr::HdrError, limit, png, png::PngError};
use crate::input::{self, InputError};

/// Why a file gives no picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// There is no readable file.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The file is no picture.
    #[error("{name}")]
    NotAPicture {
        /// The file.
        name: String,
        /// What is wrong.
        source: DecodeError,
    },
}

/// Why bytes give no picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// There are none.
    #[error("found an empty file, expected a PNG, EXR or HDR picture")]
    Empty,
    /// They begin like no picture that is read.
    #[error("found a file that begins with {start}, expected a PNG, EXR or HDR picture")]
    UnknownFormat {
        /// The first bytes, in hexadecimal digits.
        start: String,
    },
    /// It begins like a PNG.
    #[error("PNG")]
    Png(#[from] PngError),
    /// It begins like an EXR.
    #[error("EXR")]
    Exr(#[from] ExrError),
    /// It begins like a Radiance HDR.
    #[error("HDR")]
    Hdr(#[from] HdrError),
}

/// How a PNG begins.
const PNG_START: &[u8] = b"\x89PNG\r\n\x1a\n";

/// How an EXR begins.
const EXR_START: &[u8] = b"\x76\x2f\x31\x01";

/// The picture in the file at `path`, or in standard input for `-`.
///
/// # Errors
///
/// [`ReadError`] when there is none.
pub fn read(path: &Path) -> Result<Picture, ReadError> {
    let bytes = input::read(path, "picture", limit::MAX_FILE_BYTES)?;
    decode(&bytes).map_err(|source| ReadError::NotAPicture { name: input::name(path), source })
}

/// The picture in a file of these bytes.
///
/// # Errors
///
/// [`DecodeError`] when there is none, or one above the limits.
pub fn decode(bytes: &[u8]) -> Result<Picture, DecodeError> {
    match Kind::of(bytes)? {
        Kind::Png => Ok(png::decode(bytes)?),
        Kind::Exr => Ok(exr::decode(bytes)?),
        Kind::Hdr => Ok(hdr::decode(bytes)?),
    }
}

/// The picture in a file of these bytes as it is stored: of a PNG the integers, which are what they are
/// taken for; else linear colours.
///
/// # Errors
///
/// As for [`decode`].
pub(crate) fn texels(bytes: &[u8]) -> Result<DynamicImage, DecodeError> {
    if let Kind::Png = Kind::of(bytes)? {
        return Ok(png::texels(bytes)?);
    }
    let picture = decode(bytes)?;
    let size = picture.size();
    let colors: Vec<f32> = picture.to_colors().iter().flat_map(Vec3::to_array).collect();
    let colors = ImageBuffer::<Rgb<f32>, _>::from_raw(size.width(), size.height(), colors);
    Ok(colors.expect("a picture has as many colours as pixels").into())
}

/// How many numbers a file of these bytes claims to hold, for which decoding takes memory.
///
/// # Errors
///
/// As for [`decode`], as far as the head of the file tells.
pub(crate) fn numbers(bytes: &[u8]) -> Result<u64, DecodeError> {
    match Kind::of(bytes)? {
        Kind::Png => Ok(png::numbers(bytes)?),
        Kind::Exr => Ok(exr::numbers(bytes)?),
        Kind::Hdr => Ok(hdr::numbers(bytes)?),
    }
}

/// The media type of a file of these bytes.
pub(crate) fn media_type(bytes: &[u8]) -> &'static str {
    match Kind::of(bytes) {
        Ok(Kind::Png) => "image/png",
        Ok(Kind::Exr) => "image/x-exr",
        Ok(Kind::Hdr) => "image/vnd.radiance",
        Err(_) => "application/octet-stream",
    }
}

/// How a picture is stored.
enum Kind {
    Png,
    Exr,
    Hdr,
}

impl Kind {
    fn of(bytes: &[u8]) -> Result<Self, DecodeError> {
        if bytes.is_empty() {
            return Err(DecodeError::Empty);
        }
        if bytes.starts_with(PNG_START) {
            return Ok(Self::Png);
        }
        if bytes.starts_with(EXR_START) {
            return Ok(Self::Exr);
        }
        if hdr::STARTS.iter().any(|start| bytes.starts_with(start)) {
            return Ok(Self::Hdr);
        }
        let start: Vec<_> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        Err(DecodeError::UnknownFormat { start: start.join(" ") })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

    use ::exr::prelude::{Blocks, Compression, Vec2};
    use proptest::{prelude::*, sample::Index};

    use super::*;
    use crate::{
        image::{Format, Layer, Value, exr::tests::halves},
        render::film::Size,
    };

    /// Files of all formats.
    fn files() -> [Vec<u8>; 6] {
        let mut picture = Picture::new(Size::new(9, 4).unwrap());
        let colors: Vec<_> = (0..36).map(|k| Vec3::splat(k as f32 / 9.0)).collect();
        picture.push(Layer::colors("", &colors));
        picture.push(Layer::numbers("yarn_id", (0..36).collect()));
        picture.metadata = vec![("seed".to_owned(), Value::Integer(5))];
        let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 9\n".to_vec();
        hdr.extend([[2, 2, 0, 9, 137, 128, 9], [1, 2, 3, 4, 5, 6, 7]].concat());
        hdr.extend([8, 9, 137, 5, 137, 129].into_iter().chain([128, 1, 2, 129].repeat(9)));
        hdr.extend([[128, 1, 2, 129], [1, 1, 1, 8]].concat().repeat(2));
        let encode = |format| picture.encode(format).unwrap();
        let tiles = Blocks::Tiles(Vec2(2, 2));
        [
            encode(Format::Png),
            encode(Format::Exr),
            hdr,
            halves(Compression::PIZ, Blocks::ScanLines),
            halves(Compression::RLE, Blocks::ScanLines),
            halves(Compression::Uncompressed, tiles),
        ]
    }

    #[test]
    fn each_format_is_read_by_what_is_in_it() {
        for file in &files()[..3] {
            let picture = decode(file).unwrap();
            assert_eq!((picture.size().width(), picture.size().height()), (9, 4));
        }
    }

    #[test]
    fn other_files_are_told_by_their_first_bytes() {
        let message = |bytes: &[u8]| decode(bytes).unwrap_err().to_string();
        let expected = "found an empty file, expected a PNG, EXR or HDR picture";
        assert_eq!(message(b""), expected);
        let expected =
            "found a file that begins with 47 49 46 38, expected a PNG, EXR or HDR picture";
        assert_eq!(message(b"GIF8"), expected);
    }

    const CASES: u32 = 4000;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(CASES))]

        /// What comes of it is a picture or an error, and no panic.
        #[test]
        fn damaged_files_are_read_or_refused(
            file in 0..6_usize,
            changes in prop::collection::vec((any::<Index>(), any::<u8>()), 0..6),
            cut in prop::option::weighted(0.2, any::<Index>()),
            words in prop::collection::vec((any::<Index>(), any::<u32>()), 0..2),
        ) {
            let mut bytes = files()[file].clone();
            for (at, byte) in changes {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            for (at, word) in words {
                let at = at.index(bytes.len() - 3);
                bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            }
            if let Some(cut) = cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            if let Ok(picture) = decode(&bytes) {
                prop_assert!(picture.layers().iter().all(|layer| !layer.channels.is_empty()));
                let _ = picture.to_colors();
            }
        }
    }
}
