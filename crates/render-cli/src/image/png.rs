//! PNG: sRGB in 8 bits written, in 8 or 16 bits read.

use std::{
    error::Error as _,
    io::{self, Cursor},
};

use glam::Vec3;
use image::{
    ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, Limits,
    codecs::png::{PngDecoder, PngEncoder},
};
use thiserror::Error;

use super::{
    Channel, EncodeError, Layer, Picture, Samples, View, limit::TooShort, view::linear_from_srgb,
};
use crate::render::film::{Size, SizeError};

/// Why bytes are not a picture that can be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PngError {
    /// The size is not one of a picture.
    #[error("header")]
    Size(#[from] SizeError),
    /// The file is too short for what it claims to hold.
    #[error(transparent)]
    TooShort(#[from] TooShort),
    /// The file ends too soon.
    #[error("found its end too soon, expected more pixels")]
    Truncated,
    /// The file is damaged.
    #[error("cannot be decoded")]
    Decode(#[source] ImageError),
}

impl From<ImageError> for PngError {
    fn from(error: ImageError) -> Self {
        let is_end = |error: &io::Error| error.kind() == io::ErrorKind::UnexpectedEof;
        let mut cause = error.source();
        let mut ends = matches!(&error, ImageError::IoError(error) if is_end(error));
        while let Some(error) = cause {
            ends |= error.downcast_ref::<io::Error>().is_some_and(is_end);
            cause = error.source();
        }
        if ends { Self::Truncated } else { Self::Decode(error) }
    }
}

/// The bytes of a PNG of these colours, top row first, in `view`.
///
/// # Errors
///
/// [`EncodeError::Png`] when the encoder refuses them.
pub(super) fn encode(
    size: Size,
    colors: impl Iterator<Item = Vec3>,
    view: View,
) -> Result<Vec<u8>, EncodeError> {
    encode_pixels(size, &colors.flat_map(|color| view.bytes(color)).collect::<Vec<u8>>())
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

/// The integers in a file of these bytes.
///
/// # Errors
///
/// As for [`decode`].
pub(super) fn texels(file: &[u8]) -> Result<DynamicImage, PngError> {
    let mut decoder = PngDecoder::with_limits(Cursor::new(file), Limits::no_limits())?;
    let (width, height) = decoder.dimensions();
    Size::new(width, height)?;
    let claimed = decoder.total_bytes();
    TooShort::check(file.len() as u64, claimed)?;
    let mut limits = Limits::no_limits();
    // What the pixels take, twice, and some for the chunks around them.
    limits.max_alloc = Some(2 * claimed + (1 << 20));
    decoder.set_limits(limits)?;
    Ok(DynamicImage::from_decoder(decoder)?)
}

/// How many of them a file claims to hold.
///
/// # Errors
///
/// [`PngError`] when it does not say.
pub(super) fn numbers(file: &[u8]) -> Result<u64, PngError> {
    let decoder = PngDecoder::with_limits(Cursor::new(file), Limits::no_limits())?;
    let (width, height) = decoder.dimensions();
    Ok(u64::from(width) * u64::from(height) * u64::from(decoder.color_type().channel_count()))
}

/// The picture in a file of these bytes: linear `R`, `G`, `B` of colours that are taken for sRGB
/// whatever the file says of them, as seen before black; and `A` if it has opacities.
///
/// # Errors
///
/// [`PngError`] when there is none, before memory is taken for one that is too large.
pub(super) fn decode(file: &[u8]) -> Result<Picture, PngError> {
    let image = texels(file)?;
    let size = Size::new(image.width(), image.height())?;
    let color = image.color();

    let mut channels: [Vec<f32>; 4] = Default::default();
    let pixels = size.width() as usize * size.height() as usize;
    let count = if color.has_alpha() { 4 } else { 3 };
    channels[..count].iter_mut().for_each(|channel| channel.reserve_exact(pixels));
    let mut push = |[red, green, blue, alpha]: [f32; 4]| {
        for (channel, value) in channels.iter_mut().zip([red, green, blue]) {
            channel.push(alpha * value);
        }
        if count == 4 {
            channels[3].push(alpha);
        }
    };
    if matches!(color, ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16) {
        for pixel in image.into_rgba16().pixels() {
            let [r, g, b, a] = pixel.0.map(|word| f32::from(word) / 65535.0);
            push([linear_from_srgb(r), linear_from_srgb(g), linear_from_srgb(b), a]);
        }
    } else {
        let linear: [f32; 256] = std::array::from_fn(|byte| linear_from_srgb(byte as f32 / 255.0));
        for pixel in image.into_rgba8().pixels() {
            let [r, g, b, a] = pixel.0;
            let color = [r, g, b].map(|byte| linear[usize::from(byte)]);
            push([color[0], color[1], color[2], f32::from(a) / 255.0]);
        }
    }
    let channels = ["R", "G", "B", "A"].iter().zip(channels).take(count).map(|(name, samples)| {
        Channel { name: (*name).to_owned(), samples: Samples::F32(samples) }
    });
    let mut picture = Picture::new(size);
    picture.push(Layer { name: String::new(), channels: channels.collect() });
    picture.view = View::Raw;
    Ok(picture)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

    use super::*;

    fn file(kind: ExtendedColorType, bytes: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        PngEncoder::new(&mut file).write_image(bytes, 2, 1, kind).unwrap();
        file
    }

    fn channels(file: &[u8]) -> Vec<(String, Vec<f32>)> {
        let picture = decode(file).unwrap();
        let channels = picture.layer("").unwrap().channels.iter();
        let samples = |channel: &Channel| (0..2).map(|k| channel.samples.get(k)).collect();
        channels.map(|channel| (channel.name.clone(), samples(channel))).collect()
    }

    #[test]
    fn any_kind_of_pixel_is_read_as_linear_colors() {
        // Of sRGB: 188 is 0.5029 and 48059 / 65535, which is 0.73333, is 0.4969.
        let close = |found: f32, expected: f32| (found - expected).abs() < 1e-4;
        let grey = channels(&file(ExtendedColorType::L8, &[188, 255]));
        assert_eq!(grey.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["R", "G", "B"]);
        for (name, samples) in &grey {
            assert!(close(samples[0], 0.5029) && samples[1] == 1.0, "{name}: {samples:?}");
        }
        let words: Vec<_> =
            [48059_u16, 0, 65535, 0, 48059, 0].iter().flat_map(|word| word.to_ne_bytes()).collect();
        let found = channels(&file(ExtendedColorType::Rgb16, &words));
        let expected = [[0.4969, 0.0], [0.0, 0.4969], [1.0, 0.0]];
        for ((name, samples), expected) in found.iter().zip(expected) {
            assert!(samples.iter().zip(expected).all(|(a, b)| close(*a, b)), "{name}: {samples:?}");
        }
    }

    #[test]
    fn colors_are_seen_before_black() {
        let found = channels(&file(ExtendedColorType::Rgba8, &[255, 255, 0, 51, 255, 0, 0, 0]));
        let expected = [("R", [0.2, 0.0]), ("G", [0.2, 0.0]), ("B", [0.0, 0.0]), ("A", [0.2, 0.0])];
        assert_eq!(found, expected.map(|(name, values)| (name.to_owned(), values.to_vec())));
    }

    #[test]
    fn truncated_files_are_told_as_such() {
        let bytes = file(ExtendedColorType::Rgb8, &[1, 2, 3, 4, 5, 6]);
        let data = bytes.windows(4).position(|window| window == b"IDAT").unwrap();
        for length in 8..data + 4 {
            let error = decode(&bytes[..length]).unwrap_err();
            assert!(matches!(error, PngError::Truncated), "{length}: {error:?}");
        }
    }

    #[test]
    fn claims_are_checked_before_memory_is_taken() {
        let mut bytes = file(ExtendedColorType::Rgb8, &[1, 2, 3, 4, 5, 6]);
        let mut claim = |width: u32, height: u32| {
            bytes[16..20].copy_from_slice(&width.to_be_bytes());
            bytes[20..24].copy_from_slice(&height.to_be_bytes());
            let crc = crc(&bytes[12..29]);
            bytes[29..33].copy_from_slice(&crc.to_be_bytes());
            decode(&bytes).unwrap_err()
        };
        let error = claim(1 << 20, 1 << 20);
        assert!(matches!(error, PngError::Size(SizeError::TooLarge(_))), "{error:?}");
        let error = claim(8192, 8192);
        assert!(matches!(error, PngError::TooShort(_)), "{error:?}");
    }

    /// CRC-32 of ISO 3309.
    fn crc(bytes: &[u8]) -> u32 {
        let bit = |crc: u32, _| (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
        !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), bit))
    }
}
