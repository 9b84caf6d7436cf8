//! Picture files: layers of channels as EXR, colours as PNG; EXR, PNG and HDR read.
//!
//! ```text
//! EXR, PNG, HDR ──read──▶ Picture ──encode──▶ EXR, PNG
//!                Film ──────┘  └──compare──▶ metrics, Picture
//! ```
//!
//! Colours are linear, with the primaries of sRGB. [`View`] makes of them what a screen
//! shows, and nothing else does.

mod exr;
mod hdr;
mod layers;
pub mod limit;
mod png;
mod read;
pub mod ruler;
mod view;

pub mod compare;

use std::{ffi::OsStr, path::Path};

use ::image::ImageError;
use thiserror::Error;

pub use self::{
    exr::ExrError,
    hdr::HdrError,
    layers::{BEAUTY, Channel, Layer, Picture, Samples, Value},
    png::{PngError, encode_pixels},
    read::{DecodeError, ReadError, decode, read},
    view::{View, linear_from_srgb, luminance, srgb_from_linear},
};

pub(crate) use self::read::{media_type, numbers, texels};

/// A format of pictures that are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG, sRGB with 8 bits per component: what [`View`] makes of linear colours.
    Png,
    /// OpenEXR, linear values as 32-bit floats.
    Exr,
}

impl Format {
    /// The format of files whose name ends like that of `path`, in upper or lower case.
    pub fn of_extension(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(OsStr::to_str)?;
        let is = |name| extension.eq_ignore_ascii_case(name);
        if is("png") { Some(Self::Png) } else { is("exr").then_some(Self::Exr) }
    }
}

/// Why a picture cannot be encoded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// It does not fit a PNG.
    #[error("PNG: cannot be written")]
    Png(#[from] ImageError),
    /// It does not fit a PNG with what is said of it.
    #[error("PNG: cannot be written")]
    Map(#[from] ::png::EncodingError),
    /// It does not fit an EXR.
    #[error("EXR: cannot be written")]
    Exr(#[from] ::exr::error::Error),
    /// There is nothing to write.
    #[error("found a picture without channels, expected at least one")]
    Empty,
    /// An EXR has no room for what is said of the picture.
    #[error(
        "EXR: attribute {name:?}: found a name that is in use or not of 1 to 255 bytes, expected \
         a free one"
    )]
    Attribute {
        /// What it is called.
        name: String,
    },
}

impl Picture {
    /// The bytes of a file of this picture: an EXR has all its layers and what is said about it, a
    /// PNG the colours of its main layer in [`Picture::view`].
    ///
    /// # Errors
    ///
    /// [`EncodeError`] when the main layer has no channels or the encoder refuses it.
    pub fn encode(&self, format: Format) -> Result<Vec<u8>, EncodeError> {
        if self.main_layer().is_none_or(|layer| layer.channels.is_empty()) {
            return Err(EncodeError::Empty);
        }
        match format {
            Format::Png => png::encode(self.size(), self.to_colors().into_iter(), self.view),
            Format::Exr => exr::encode(self),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::film::Size;

    #[test]
    fn a_picture_without_channels_is_refused() {
        let mut picture = Picture::new(Size::new(2, 1).expect("it has pixels"));
        for _ in 0..2 {
            for format in [Format::Png, Format::Exr] {
                assert!(matches!(picture.encode(format), Err(EncodeError::Empty)), "{format:?}");
            }
            picture.push(Layer { name: String::new(), channels: Vec::new() });
        }
    }
}
