//! Arguments of `selvedge bake`.

use std::{path::PathBuf, str::FromStr};

use clap::{Args, ValueEnum};

use crate::render::film::Size;

/// Arguments of `selvedge bake`.
#[derive(Clone, Debug, Args)]
pub struct BakeOptions {
    /// What is baked: a draft (WIF), a fabric (JSON, which names a draft) or preset:NAME
    #[arg(value_name = "CLOTH")]
    pub input: PathBuf,

    /// The folder for the maps and materials
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,

    /// Width and height of each map in pixels, at most 8192 each: one number for a square
    #[arg(long, value_name = "N|WxH", default_value = "4096")]
    pub size: MapSize,

    /// Whole repeats along the weft and the warp, 1 to 1000 each: one number for both
    #[arg(long, value_name = "N|NxM", default_value = "1")]
    pub repeats: Repeats,

    /// What the maps are
    #[arg(long, value_enum, default_value_t = MapFormat::Png)]
    pub format: MapFormat,

    /// Points along each side of a texel over which it is the mean, 1 to 16
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub points: u32,

    /// Threads to use [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// No warnings and no table of fits; errors are still told
    #[arg(short, long)]
    pub quiet: bool,
}

/// What maps are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MapFormat {
    /// PNG of 8 bits, heights of 16
    Png,
    /// PNG of 16 bits
    Png16,
    /// EXR of 32 bits, all linear, beside the PNG of 8 bits that glTF and U3M need
    Exr,
}

/// Greatest side of a map, pixels.
const LARGEST: u32 = 8192;

/// Most repeats along a side.
const MOST_REPEATS: u32 = 1000;

/// Width and height of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapSize(pub Size);

/// Repeats along the weft and the warp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repeats(pub [u32; 2]);

impl FromStr for MapSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let [width, height] = pair(text, LARGEST)?;
        Size::new(width, height).map(Self).map_err(|error| error.to_string())
    }
}

impl FromStr for Repeats {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        pair(text, MOST_REPEATS).map(Self)
    }
}

/// One number for both, or two with an x between, each from 1 to `most`.
fn pair(text: &str, most: u32) -> Result<[u32; 2], String> {
    let (x, y) = text.split_once('x').unwrap_or((text, text));
    let number = |text: &str| text.parse().ok().filter(|number| (1..=most).contains(number));
    number(x)
        .zip(number(y))
        .map(|(x, y)| [x, y])
        .ok_or_else(|| format!("expected a number from 1 to {most}, or two as in 2x3"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_is_for_both_sides() {
        assert_eq!("3".parse(), Ok(Repeats([3, 3])));
        assert_eq!("2x5".parse(), Ok(Repeats([2, 5])));
        for text in ["", "0", "x", "2x", "2x0", "1001", "-1", "2x3x4", "1.5"] {
            assert!(text.parse::<Repeats>().is_err(), "{text}");
        }
        assert!("8193".parse::<MapSize>().is_err());
    }
}
