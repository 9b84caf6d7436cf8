//! Radiance HDR, read only: the format of most photographs of a whole surrounding.
//!
//! A pixel is three mantissas and the exponent they share (Ward 1991, Real pixels). A row is plain
//! pixels, or pixels with runs, or its four components one after the other with runs.

use thiserror::Error;

use super::{Channel, Layer, Picture, Samples};
use crate::render::film::{Size, SizeError};

/// Why bytes are not a picture that can be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum HdrError {
    /// The header ends too soon.
    #[error("header: found its end too soon, expected an empty line and a size")]
    NoSize,
    /// The line of the size is not that of an upright picture.
    #[error("size: found {found:?}, expected \"-Y HEIGHT +X WIDTH\"")]
    Orientation {
        /// The line.
        found: String,
    },
    /// The size is not one of a picture.
    #[error("size")]
    Size(#[from] SizeError),
    /// The colours are not red, green and blue.
    #[error("FORMAT: found {found:?}, expected \"32-bit_rle_rgbe\"")]
    Format {
        /// What they are.
        found: String,
    },
    /// The file ends within a row.
    #[error("row {row} of {rows}: found the end of the file, expected more pixels")]
    Truncated {
        /// The row, from 1.
        row: u32,
        /// How many there are.
        rows: u32,
    },
    /// A run goes on after the end of its row.
    #[error("row {row} of {rows}: found a run of {run} pixels, expected at most {left}")]
    Run {
        /// The row, from 1.
        row: u32,
        /// How many there are.
        rows: u32,
        /// Length of the run.
        run: u64,
        /// Pixels that are left of the row.
        left: usize,
    },
}

/// How each file begins: with the name of one or the other program.
pub(super) const STARTS: [&[u8]; 2] = [b"#?RADIANCE", b"#?RGBE"];

/// The picture in a file of these bytes: linear `R`, `G` and `B`, divided by the exposures that the
/// header says they were multiplied with.
///
/// # Errors
///
/// [`HdrError`] when there is none.
pub(super) fn decode(file: &[u8]) -> Result<Picture, HdrError> {
    let (header, mut rest) = Header::read(file)?;
    // They grow with the rows that are there, whatever the header claims.
    let mut channels: [Vec<f32>; 3] = Default::default();
    let mut pixels = vec![[0; 4]; header.size.width() as usize];
    for row in 1..=header.size.height() {
        let place = |error| match error {
            RowError::End => HdrError::Truncated { row, rows: header.size.height() },
            RowError::Run { run, left } => {
                HdrError::Run { row, rows: header.size.height(), run, left }
            }
        };
        rest = read_row(rest, &mut pixels).map_err(place)?;
        for [r, g, b, exponent] in &pixels {
            let unit = (f32::from(*exponent) - 136.0).exp2();
            let unit = if *exponent == 0 { 0.0 } else { unit };
            for ((channel, mantissa), factor) in
                channels.iter_mut().zip([r, g, b]).zip(header.factors)
            {
                channel.push(f32::from(*mantissa) * unit * factor);
            }
        }
    }
    let channels = ["R", "G", "B"]
        .into_iter()
        .zip(channels)
        .map(|(name, samples)| Channel { name: name.to_owned(), samples: Samples::F32(samples) });
    let mut picture = Picture::new(header.size);
    picture.push(Layer { name: String::new(), channels: channels.collect() });
    Ok(picture)
}

/// How many numbers a file of these bytes claims to hold.
///
/// # Errors
///
/// As for [`decode`], as far as the header tells.
pub(super) fn numbers(file: &[u8]) -> Result<u64, HdrError> {
    let (Header { size, .. }, _) = Header::read(file)?;
    Ok(3 * u64::from(size.width()) * u64::from(size.height()))
}

struct Header {
    size: Size,
    /// What undoes the exposures.
    factors: [f32; 3],
}

impl Header {
    /// The header and what follows it.
    fn read(file: &[u8]) -> Result<(Self, &[u8]), HdrError> {
        let mut factors = [1.0; 3];
        let mut rest = file;
        loop {
            let line;
            (line, rest) = read_line(rest).ok_or(HdrError::NoSize)?;
            if line.is_empty() {
                break;
            }
            let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else {
                continue;
            };
            let numbers = || value.split_whitespace().filter_map(|number| number.parse().ok());
            let by: Vec<f32> = match key.trim() {
                "EXPOSURE" => numbers().take(1).flat_map(|factor| [factor; 3]).collect(),
                "COLORCORR" => numbers().take(3).collect(),
                "FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
                    return Err(HdrError::Format { found: excerpt(value.trim()) });
                }
                _ => continue,
            };
            // What cannot be undone says nothing.
            if by.len() == 3 && by.iter().all(|by| by.is_normal() && *by > 0.0) {
                factors.iter_mut().zip(by).for_each(|(factor, by)| *factor /= by);
            }
        }
        let (line, rest) = read_line(rest).ok_or(HdrError::NoSize)?;
        let words: Vec<_> = line.split_whitespace().collect();
        let number = |text: &str| text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse());
        let (["-Y", height, "+X", width], true) = (words.as_slice(), line.len() < 64) else {
            return Err(HdrError::Orientation { found: excerpt(&line) });
        };
        let (Some(height), Some(width)) = (number(height), number(width)) else {
            return Err(HdrError::Orientation { found: excerpt(&line) });
        };
        // A number beyond u32 is too large, not unreadable.
        let size = Size::new(width.unwrap_or(u32::MAX), height.unwrap_or(u32::MAX))?;
        Ok((Self { size, factors }, rest))
    }
}

/// A line without its end, and what follows it.
fn read_line(text: &[u8]) -> Option<(String, &[u8])> {
    let end = text.iter().position(|byte| *byte == b'\n')?;
    Some((String::from_utf8_lossy(&text[..end]).into_owned(), &text[end + 1..]))
}

/// As much of a line as a message needs.
fn excerpt(text: &str) -> String {
    text.chars().take(40).collect()
}

enum RowError {
    End,
    Run { run: u64, left: usize },
}

/// Fills `row` and returns what follows it.
fn read_row<'a>(from: &'a [u8], row: &mut [[u8; 4]]) -> Result<&'a [u8], RowError> {
    match from {
        // 2, 2 and the width: no colours, as one mantissa of a pixel is at least 128.
        [2, 2, high, low, rest @ ..]
            if u16::from_be_bytes([*high, *low]) as usize == row.len() && row.len() < 1 << 15 =>
        {
            read_components(rest, row)
        }
        _ => read_pixels(from, row),
    }
}

/// The first components of all pixels, then the second and so on. A byte n above 128 says that the
/// next one stands for n − 128 pixels, another one that n single ones follow.
fn read_components<'a>(mut from: &'a [u8], row: &mut [[u8; 4]]) -> Result<&'a [u8], RowError> {
    for component in 0..4 {
        let mut at = 0;
        while at < row.len() {
            let (count, rest) = from.split_first().ok_or(RowError::End)?;
            let is_run = *count > 128;
            let run = usize::from(if is_run { *count - 128 } else { *count });
            let left = row.len() - at;
            if run > left {
                return Err(RowError::Run { run: run as u64, left });
            }
            let bytes = if is_run { 1 } else { run };
            let (values, rest) = rest.split_at_checked(bytes).ok_or(RowError::End)?;
            for (pixel, value) in row[at..at + run].iter_mut().zip(values.iter().cycle()) {
                pixel[component] = *value;
            }
            from = rest;
            at += run;
        }
    }
    Ok(from)
}

/// Pixel after pixel. Mantissas of 1, 1, 1 say that the pixel before repeats as often as the
/// exponent; if several such follow each other, the later ones count 256 times as much.
fn read_pixels<'a>(mut from: &'a [u8], row: &mut [[u8; 4]]) -> Result<&'a [u8], RowError> {
    let (mut at, mut shift) = (0, 0_u32);
    while at < row.len() {
        let (pixel, rest) = from.split_first_chunk::<4>().ok_or(RowError::End)?;
        from = rest;
        let [1, 1, 1, count] = *pixel else {
            row[at] = *pixel;
            (at, shift) = (at + 1, 0);
            continue;
        };
        let left = row.len() - at;
        // Beyond 32 bits it is too long for any row.
        let run = u64::from(count) << shift.min(32);
        if run > left as u64 {
            return Err(RowError::Run { run, left });
        }
        let before = if at == 0 { [0; 4] } else { row[at - 1] };
        row[at..at + run as usize].fill(before);
        at += run as usize;
        shift += 8;
    }
    Ok(from)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

    use super::*;

    fn file(header: &str, pixels: &[u8]) -> Vec<u8> {
        [format!("#?RADIANCE\n{header}").as_bytes(), pixels].concat()
    }

    fn red(file: &[u8]) -> Vec<f32> {
        let picture = decode(file).unwrap();
        let channel = &picture.layer("").unwrap().channels[0];
        assert_eq!(channel.name, "R");
        (0..picture.pixels()).map(|k| channel.samples.get(k)).collect()
    }

    #[test]
    fn plain_pixels_are_mantissas_times_a_power_of_two() {
        let bytes = file("\n-Y 1 +X 3\n", &[128, 64, 0, 129, 128, 0, 0, 128, 255, 255, 255, 0]);
        let colors = decode(&bytes).unwrap().to_colors();
        let expected = [glam::Vec3::new(1.0, 0.5, 0.0), glam::Vec3::X / 2.0, glam::Vec3::ZERO];
        assert_eq!(colors, expected);
    }

    #[test]
    fn runs_of_pixels_are_read() {
        // One pixel, 3 more of it; one other, 256 + 2 more of it.
        let pixels = [[128, 0, 0, 129], [1, 1, 1, 3], [128, 0, 0, 130], [1, 1, 1, 2], [1, 1, 1, 1]];
        let found = red(&file("\n-Y 1 +X 263\n", pixels.as_flattened()));
        assert!(found[..4] == [1.0; 4] && found[4..] == [2.0; 259], "{found:?}");
    }

    #[test]
    fn runs_of_components_are_read() {
        let row = |red: &[u8]| [&[2, 2, 0, 8], red, &[136, 0], &[136, 0], &[128 + 8, 129]].concat();
        let pixels = [row(&[131, 128, 5, 64, 64, 64, 64, 32]), row(&[136, 255])].concat();
        let found = red(&file("\n-Y 2 +X 8\n", &pixels));
        assert_eq!(found[..8], [1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.5, 0.25]);
        assert_eq!(found[8..], [255.0 / 128.0; 8]);
    }

    #[test]
    fn exposures_are_undone() {
        let header = "EXPOSURE=2\n# EXPOSURE=9\nEXPOSURE = 0.25 \nEXPOSURE=0\nCOLORCORR=4 1 1\n";
        let bytes = file(&format!("{header}\n-Y 1 +X 1\n"), &[128, 128, 128, 129]);
        assert_eq!(decode(&bytes).unwrap().to_colors(), [glam::Vec3::new(0.5, 2.0, 2.0)]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_row() {
        let size = "\n-Y 2 +X 8\n";
        let pixel = [128, 0, 0, 129];
        let run = |end: [u8; 4]| [pixel, end].concat();
        let cases = [
            ("", vec![], "header: found its end too soon, expected an empty line and a size"),
            ("\n", vec![], "header: found its end too soon, expected an empty line and a size"),
            ("\n+X 8 -Y 2\n", vec![], "size: found \"+X 8 -Y 2\", expected \"-Y HEIGHT +X WIDTH\""),
            (
                "\n-Y -2 +X 8\n",
                vec![],
                "size: found \"-Y -2 +X 8\", expected \"-Y HEIGHT +X WIDTH\"",
            ),
            (
                "FORMAT=32-bit_rle_xyze\n\n-Y 2 +X 8\n",
                vec![],
                "FORMAT: found \"32-bit_rle_xyze\", expected \"32-bit_rle_rgbe\"",
            ),
            (size, pixel.repeat(15), "row 2 of 2: found the end of the file, expected more pixels"),
            (size, run([1, 1, 1, 8]), "row 1 of 2: found a run of 8 pixels, expected at most 7"),
            (
                size,
                vec![2, 2, 0, 8, 137, 1],
                "row 1 of 2: found a run of 9 pixels, expected at most 8",
            ),
            (
                size,
                vec![2, 2, 0, 8, 4, 1],
                "row 1 of 2: found the end of the file, expected more pixels",
            ),
        ];
        for (header, pixels, expected) in cases {
            let error = decode(&file(header, &pixels)).unwrap_err();
            assert_eq!(error.to_string(), expected, "{header}");
        }
        let error = decode(&file("\n-Y 99999999999 +X 2\n", &[])).unwrap_err();
        assert!(matches!(error, HdrError::Size(SizeError::TooLarge(_))), "{error:?}");
    }

    #[test]
    fn endless_run_markers_do_not_overflow() {
        let pixels = [[1, 1, 1, 0]; 20].concat();
        let error = decode(&file("\n-Y 1 +X 2\n", &pixels)).unwrap_err();
        assert_eq!(error, HdrError::Truncated { row: 1, rows: 1 });
        let pixels = [[[1, 1, 1, 0]; 20].concat(), vec![1, 1, 1, 255]].concat();
        let error = decode(&file("\n-Y 1 +X 2\n", &pixels)).unwrap_err();
        assert_eq!(error, HdrError::Run { row: 1, rows: 1, run: 255 << 32, left: 2 });
    }
}
