//! Picture files: a film as PNG or EXR, plain pixels as PNG.

use std::{ffi::OsStr, io::Cursor, path::Path};

use exr::prelude::WritableImage;
use glam::Vec3;
use image::{ExtendedColorType, ImageEncoder, ImageError, codecs::png::PngEncoder};
use thiserror::Error;

use crate::render::film::{Film, Size};

/// A format of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG, sRGB with 8 bits per component: what [`view`] makes of the radiance.
    Png,
    /// OpenEXR, the linear radiance itself as 32-bit floats.
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

/// Why a film cannot be encoded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// It does not fit a PNG.
    #[error("PNG: cannot be written")]
    Png(#[from] ImageError),
    /// It does not fit an EXR.
    #[error("EXR: cannot be written")]
    Exr(#[from] exr::error::Error),
}

/// The bytes of a file that shows `film`.
///
/// # Errors
///
/// [`EncodeError`] when the encoder refuses the film.
pub fn encode(film: &Film, format: Format) -> Result<Vec<u8>, EncodeError> {
    match format {
        Format::Png => encode_png(film),
        Format::Exr => encode_exr(film),
    }
}

fn encode_png(film: &Film) -> Result<Vec<u8>, EncodeError> {
    let pixels: Vec<u8> = film.pixels().iter().flat_map(|&radiance| view(radiance)).collect();
    encode_pixels(film.size(), &pixels)
}

/// The bytes of a PNG of these pixels: top row first, red, green and blue of each in sRGB.
///
/// # Errors
///
/// [`EncodeError::Png`] when the encoder refuses them.
///
/// # Panics
///
/// If there are not three bytes for each pixel of `size`.
pub fn encode_pixels(size: Size, pixels: &[u8]) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    encoder.write_image(pixels, size.width(), size.height(), ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

fn encode_exr(film: &Film) -> Result<Vec<u8>, EncodeError> {
    let [width, height] = [film.size().width() as usize, film.size().height() as usize];
    let channels = exr::prelude::SpecificChannels::rgb(|place: exr::math::Vec2<usize>| {
        let radiance = film.pixels()[place.y() * width + place.x()];
        (radiance.x, radiance.y, radiance.z)
    });
    let mut bytes = Cursor::new(Vec::new());
    // With threads of its own the encoder writes blocks in the order in which they get done.
    exr::prelude::Image::from_channels((width, height), channels)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// Radiance above which [`view`] begins to compress.
const SHOULDER: f32 = 0.6;

/// The sRGB components with which a screen shows linear `radiance`.
///
/// Component by component, what is below the shoulder s = 0.6 is shown as it is; above, the curve
/// bends smoothly towards white, so that highlights keep their shape and fade to white instead of
/// ending in a flat patch:
///
/// ```text
/// x ≤ s:  x
/// else:   1 − (1 − s) exp(−(x − s)/(1 − s))
/// ```
///
/// Then follows the transfer function of sRGB (IEC 61966-2-1), rounded to 8 bits.
pub fn view(radiance: Vec3) -> [u8; 3] {
    radiance.to_array().map(|x| {
        let shown = if x <= SHOULDER {
            x.max(0.0)
        } else {
            1.0 - (1.0 - SHOULDER) * (-(x - SHOULDER) / (1.0 - SHOULDER)).exp()
        };
        let encoded = if shown <= 0.003_130_8 {
            12.92 * shown
        } else {
            1.055 * shown.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * encoded).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn view_leaves_mid_tones_alone() {
        // 0.2140 is the linear value of sRGB 127.5.
        for (linear, expected) in [(0.0, 0), (0.001, 3), (0.2122, 127), (0.5, 188)] {
            assert_eq!(view(Vec3::splat(linear)), [expected; 3], "{linear}");
        }
        assert_eq!(view(Vec3::new(0.0, 0.5, 1e9)), [0, 188, 255]);
    }

    #[test]
    fn view_rises_smoothly_to_white() {
        let shown = |x: f32| view(Vec3::splat(x))[0];
        let steps: Vec<_> = (0..400).map(|i| shown(i as f32 / 100.0)).collect();
        assert!(steps.is_sorted());
        assert!(steps.windows(2).skip(10).all(|pair| pair[1] - pair[0] <= 8), "{steps:?}");
        assert!(shown(1.0) < 240 && shown(4.0) == 255, "{} {}", shown(1.0), shown(4.0));
    }
}
