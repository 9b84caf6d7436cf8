//! The command line of `selvedge image`.

use std::path::{Path, PathBuf};

use clap::{
    Args, Subcommand,
    builder::{PathBufValueParser, TypedValueParser},
};

use super::{Output, UnknownExtension};
use crate::image::{Format, View, compare::Metric};

/// What to do with pictures.
#[derive(Clone, Debug, Subcommand)]
pub enum ImageCommand {
    /// Tells how far two pictures of one size are apart
    ///
    /// Compares red, green and blue of the beauty layer, or of the first layer, in linear values;
    /// B is the true picture. Prints
    ///
    /// rmse: root of the mean of (a - b)².
    ///
    /// relmse: mean of (a - b)² / (b² + 0.01).
    ///
    /// max: greatest |a - b|, and where: pixels from the left and from the top, from 0.
    ///
    /// flip: mean of FLIP, 0 to 1, what an observer sees who turns from one to the other, at 67
    /// pixels per degree; EXR and HDR as --view srgb shows them.
    ///
    /// Two NaN are equal, and so are two infinities of one sign; any other value that is not finite
    /// is infinitely far from all, and FLIP is 1 there.
    ///
    /// With --json one object: rmse, relmse, flip (numbers, null for infinite), max (an object with
    /// difference, x, y), unlike (pixels with a value that is not finite in one picture only),
    /// metric, threshold (or null), above (true or false). Keys are only ever added.
    ///
    /// Exit codes: 0 done, 1 failed, as when sizes differ, 2 wrong command line, 3 the metric is
    /// above the threshold.
    Diff(DiffOptions),

    /// Tells size, layers, ranges and metadata of a picture
    ///
    /// With --json one object: file, width, height; layers, a list of objects with name ("beauty"
    /// for the one without a name) and channels, each with name, type ("f32" or "u32"), min, max,
    /// mean (of finite values, null if there are none), non_finite (how many there are); metadata,
    /// an object. Keys are only ever added.
    Info(PictureInfoOptions),

    /// Writes a picture in another format, one of its layers, or brighter
    ///
    /// From EXR to EXR all layers are kept, unless --layer or --exposure takes one of them. A PNG
    /// shows R, G and B of a layer, or its one channel as a grey, or its first three channels.
    Convert(PictureConvertOptions),
}

/// Arguments of `selvedge image diff`.
#[derive(Clone, Debug, Args)]
pub struct DiffOptions {
    /// A picture: PNG, EXR or Radiance HDR, by what is in it; - reads standard input
    #[arg(value_name = "A")]
    pub a: PathBuf,

    /// The picture that is taken for the true one
    #[arg(value_name = "B")]
    pub b: PathBuf,

    /// What --threshold and --output are about
    #[arg(long, value_enum, default_value_t = Metric::Rmse)]
    pub metric: Metric,

    /// Exit with 3 when the metric is greater
    #[arg(long, value_name = "X", value_parser = threshold)]
    pub threshold: Option<f64>,

    /// Where a picture of the differences goes, black where there are none: .png or .exr
    #[arg(short, long, value_name = "DIFF", value_parser = PathBufValueParser::new().try_map(Output::new))]
    pub output: Option<Output>,

    /// One JSON object, see --help for its keys
    #[arg(long)]
    pub json: bool,
}

fn threshold(text: &str) -> Result<f64, String> {
    let threshold = text.parse().ok().filter(|threshold| *threshold >= 0.0);
    threshold.ok_or_else(|| "expected a number, 0 or greater".to_owned())
}

/// Arguments of `selvedge image info`.
#[derive(Clone, Debug, Args)]
pub struct PictureInfoOptions {
    /// The picture: PNG, EXR or Radiance HDR, by what is in it; - reads standard input
    #[arg(value_name = "FILE")]
    pub picture: PathBuf,

    /// One JSON object, see --help for its keys
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `selvedge image convert`.
#[derive(Clone, Debug, Args)]
pub struct PictureConvertOptions {
    /// The picture: PNG, EXR or Radiance HDR, by what is in it; - reads standard input
    #[arg(value_name = "IN")]
    pub picture: PathBuf,

    /// Where it goes: .png (sRGB) or .exr (linear values); - is standard output, as PNG
    #[arg(short, long, value_name = "OUT", value_parser = PathBufValueParser::new().try_map(Target::new))]
    pub output: Target,

    /// The layer to take, as selvedge image info names it
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,

    /// Brightness in stops: each doubles the linear values, -1 halves them
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = stops)]
    pub exposure: Option<f32>,

    /// What a PNG shows [default: srgb for radiance, raw for a picture that was a PNG and for layers
    /// other than the beauty]
    #[arg(long, value_enum)]
    pub view: Option<View>,
}

fn stops(text: &str) -> Result<f32, String> {
    let stops = text.parse().ok().filter(|stops| (-100.0..=100.0).contains(stops));
    stops.ok_or_else(|| "expected a number from -100 to 100".to_owned())
}

/// Where a picture goes, and in which format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// The file; `None` for standard output.
    pub path: Option<PathBuf>,
    /// The format.
    pub format: Format,
}

impl Target {
    /// The file at `path` in the format of its extension; standard output, as PNG, for `-`.
    ///
    /// # Errors
    ///
    /// [`UnknownExtension`] when there is no format for it.
    pub fn new(path: PathBuf) -> Result<Self, UnknownExtension> {
        if path == Path::new("-") {
            return Ok(Self { path: None, format: Format::Png });
        }
        let Output { path, format } = Output::new(path)?;
        Ok(Self { path: Some(path), format })
    }
}
