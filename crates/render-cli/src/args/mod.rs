//! The command line as data.

mod bake;
mod draft;
mod effort;
mod eval;
mod image;
mod measure;
mod studio;

use std::path::PathBuf;

use clap::{
    Args, Parser, Subcommand, ValueEnum,
    builder::{PathBufValueParser, TypedValueParser},
};
use thiserror::Error;

#[cfg(any(test, feature = "faults"))]
pub use self::measure::Fault;
pub use self::{
    bake::{BakeOptions, MapFormat, MapSize, Repeats},
    draft::{
        ConvertOptions, DraftCommand, DrawdownOptions, Form, InfoOptions, LintOptions,
        RewriteOptions,
    },
    effort::{Effort, ProgressForm},
    eval::{Angles, EvalOptions, ParameterSetting, Place},
    image::{DiffOptions, ImageCommand, PictureConvertOptions, PictureInfoOptions, Target},
    measure::{MeasureCommand, MeasureOptions, Table1Options},
    studio::StudioOptions,
};
use crate::{
    image::{Format, View},
    render::{
        detail::Level,
        film::{Crop, Size},
    },
    scene::{
        MAX_DEPTH,
        source::Setting,
        stage::{self, Direction, Orbit},
        swatch::Light,
    },
};

/// Renders woven cloth from a weaver's draft.
#[derive(Clone, Debug, Parser)]
#[command(name = "selvedge", version, about, arg_required_else_help = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Clone, Debug, Subcommand)]
pub enum Command {
    /// Draws the cloth of a draft or a fabric, draped over a rounded form
    ///
    /// The face of the cloth is up. End 1 is at the left edge of the cloth and pick 1 at its near
    /// edge, as in a drawdown that starts at the bottom left; from there the draft repeats to the
    /// right and away from the camera. The cloth is 42 cm square, and the draft's own spacing
    /// gives the size of the weave.
    ///
    /// A scene (JSON, or scene:NAME) stands for itself: camera, lights and all.
    ///
    /// Exit codes: 0 done, 1 failed, 2 wrong command line, 130 interrupted: then the output shows what
    /// was drawn so far. What fails leaves no output behind.
    Render(RenderCommand),

    /// Draws a small piece of the cloth, flat and from above, so that its threads can be seen
    ///
    /// End 1 is at the left edge and pick 1 at the lower one. The light comes from the upper left,
    /// and a grey card lies below the cloth.
    ///
    /// Exit codes as for selvedge render.
    Swatch(SwatchOptions),

    /// Makes pictures of the cloth that tile, and materials for other programs
    ///
    /// The folder gets maps of one repeat or several: base colour, normal (+Y up), height, roughness,
    /// anisotropy and its direction, reflectance, opacity and type of yarn, with their size in
    /// millimetres; cloth.mtlx (MaterialX, OpenPBR), cloth.gltf and cloth.u3m, which refer to them; and
    /// bake.json, which says what is what.
    ///
    /// Roughness, anisotropy and reflectances are fitted: for each type of yarn as warp and as weft, a
    /// glossy coat on a diffuse ground reflects as nearly as it can what the pieces of that yarn reflect
    /// on average. Errors are told: root mean squares over pairs of directions, relative to what is
    /// fitted, of specular, diffuse, and of all of it seen from afar. A coat mirrors about a normal and not
    /// into the cones of fibres: for the presets that leaves 33 to 73 % of the highlight, 16 to 43 % of the
    /// diffuse and 26 to 45 % of all of it from afar.
    ///
    /// Exit codes: 0 done, 1 failed, 2 wrong command line. What fails leaves no folder behind; one that is
    /// there is replaced only if it is empty or was written so.
    Bake(BakeOptions),
    /// Opens a page in the browser that shows the cloth, and draws it anew while its yarns are changed
    ///
    /// The page is served by this program, to this machine alone, at the address that it prints; whoever
    /// knows the address can use it. Nothing else is asked of a network. Ctrl-C ends it.
    Studio(StudioOptions),

    /// Lists the fabrics that are compiled in, which render and swatch draw as preset:NAME
    Presets,

    /// Tells what a cloth takes to be shaded at each point, what is left out, and why
    ///
    /// And its memory, and how long a point takes on this machine, one after the other and many at a
    /// time.
    Plan(PlanOptions),

    /// Tells what a cloth reflects at one place from one direction to another, and every factor of it
    ///
    /// In f64 the piece of yarn, where on it the highlight comes from, and the factors of highlight and
    /// diffuse; and the value in f32, of a batch and from afar, its density and the opacity. The lines
    /// that selvedge measure stability calls the worst inputs are arguments for it.
    ///
    /// With --json one object: place, side, yarn, segment, fibre (or null), highlight, phase, diffuse,
    /// colors, f (f64, f32, batch, far), lobes, pdf, far_pdf, albedo, opacity. In a gap, or with
    /// directions on two sides, side is null. Keys are only ever added.
    Eval(EvalOptions),

    /// Measures how right cloths are shaded, and reports it
    ///
    /// Each subcommand prints a short table and writes a folder: report.html, one page with tables, plots
    /// and pictures that needs nothing else; report.json, the same for programs, with the thresholds
    /// ("checks"); and CSV files. A folder that is there is replaced only if it is empty or was written so.
    ///
    /// Exit codes: 0 done, 1 failed, 2 wrong command line, 3 a threshold is missed.
    #[command(subcommand)]
    Measure(MeasureCommand),

    /// Prints the JSON Schema of scenes or fabrics, for editors and programs that write them
    Schema(SchemaOptions),

    /// Tells about, checks, draws and rewrites a draft
    #[command(subcommand)]
    Draft(DraftCommand),

    /// Compares pictures, tells about them and converts them
    #[command(subcommand)]
    Image(ImageCommand),
}

/// Arguments of `selvedge render`.
#[derive(Clone, Debug, Args)]
pub struct RenderCommand {
    /// What is drawn how well.
    #[command(flatten)]
    pub render: RenderOptions,

    /// What is woven in a scene in place of its own cloths: a draft, a fabric or preset:NAME
    #[arg(long, value_name = "CLOTH")]
    pub cloth: Option<PathBuf>,

    /// Sets a part of a scene, as in depth=2 or lights.0.quad.radiance=20
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<Setting>,

    /// Surfaces after which a path ends, 1 to 256: 1 shows what lamps light alone [default: the
    /// scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_DEPTH)))]
    pub depth: Option<u32>,

    /// Draws anew whenever the file or that of its draft changes, until Ctrl-C
    #[arg(long)]
    pub watch: bool,

    /// What a cloth is laid over [default: drape]
    #[arg(long, value_enum)]
    pub form: Option<stage::Form>,

    /// Where the camera stands before a cloth: azimuth clockwise from the near side and elevation,
    /// degrees, and distance in units of that of --form [default: 18,37,1 for a drape]
    #[arg(long, value_name = "AZ,EL,DIST", allow_hyphen_values = true)]
    pub camera: Option<Orbit>,

    /// Where the light on a cloth stands: azimuth anticlockwise from the right and elevation, degrees
    /// [default: 190,45]
    #[arg(long, value_name = "AZ,EL", allow_hyphen_values = true)]
    pub light: Option<Direction>,
}

/// Arguments of whatever renders.
#[derive(Clone, Debug, Args)]
pub struct RenderOptions {
    /// What is drawn: a draft (WIF), a fabric (JSON, which names a draft) or preset:NAME; - reads
    /// standard input
    #[arg(value_name = "CLOTH")]
    pub input: PathBuf,

    /// Where the picture goes: .png (sRGB) or .exr (linear radiance, and layers of what is seen)
    #[arg(short, long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(Output::new))]
    pub output: Output,

    /// Width and height in pixels, at most 67108864 pixels [default: the scene's, else
    /// 960x640, or 480x320 for a swatch]
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// Stops by which the picture is brighter
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = exposure)]
    pub exposure: f32,

    /// How a PNG shows radiance
    #[arg(long, value_enum, default_value_t = View::Srgb)]
    pub view: View,

    /// How much of cloth is looked at
    #[arg(long, value_enum, default_value_t = Level::Auto)]
    pub lod: Level,

    /// Octaves by which --lod auto takes places to be larger, -20 to 20: above 0 it gives threads up
    /// sooner
    #[arg(long, value_name = "OCTAVES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = lod_bias)]
    pub lod_bias: f32,

    /// Draws only the pixels from column X0 and row Y0 up to and without column X1 and row Y1, as they
    /// are in the whole picture
    #[arg(long, value_name = "X0,Y0,X1,Y1")]
    pub cropwindow: Option<Crop>,

    /// How long to draw.
    #[command(flatten)]
    pub effort: Effort,

    /// Chooses the noise: equal seeds give equal pictures
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Threads to use [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// No warnings, progress or summary; errors are still told
    #[arg(short, long)]
    pub quiet: bool,
}

/// Arguments of `selvedge swatch`.
#[derive(Clone, Debug, Args)]
pub struct SwatchOptions {
    /// What is drawn how well.
    #[command(flatten)]
    pub render: RenderOptions,

    /// Width of the piece in millimetres, 0.1 to 1000
    #[arg(long, value_name = "WIDTH", default_value_t = 20.0, value_parser = width_mm)]
    pub mm: f32,

    /// What is in the lower left corner (of the back, the lower right one): millimetres along weft and
    /// warp from the corner of the draft, each from -2000 to 2000
    #[arg(long, value_name = "U,V", default_value = "0,0", allow_hyphen_values = true, value_parser = place_mm)]
    pub at: [f32; 2],

    /// Where the light stands: raking (25° high) or top (70°), from the upper left, or its azimuth
    /// anticlockwise from the right and its elevation, degrees
    #[arg(long, value_name = "LIGHT", default_value = "raking", allow_hyphen_values = true)]
    pub light: Light,

    /// The face, as without --back
    #[arg(long, conflicts_with = "back")]
    pub front: bool,

    /// The other face, turned over like a page: end 1 is at the right
    #[arg(long)]
    pub back: bool,

    /// Lays a ruler along the lower edge: millimetres, and ends and picks per inch
    #[arg(long)]
    pub ruler: bool,
}

/// Arguments of `selvedge plan`.
#[derive(Clone, Debug, Args)]
pub struct PlanOptions {
    /// A draft (WIF), a fabric (JSON) or preset:NAME
    pub input: PathBuf,
}

/// Arguments of `selvedge schema`.
#[derive(Clone, Copy, Debug, Args)]
pub struct SchemaOptions {
    /// What it describes
    #[arg(value_enum)]
    pub of: Described,
}

/// What has a JSON Schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Described {
    /// What selvedge render draws: camera, film, materials, objects and lights
    Scene,
    /// What a cloth is: a draft and its yarns
    Fabric,
}

fn exposure(text: &str) -> Result<f32, String> {
    let stops = text.parse().ok().filter(|stops| (-20.0..=20.0).contains(stops));
    stops.ok_or_else(|| "expected a number from -20 to 20".to_owned())
}

fn lod_bias(text: &str) -> Result<f32, String> {
    let octaves = text.parse().ok().filter(|octaves| (-20.0..=20.0).contains(octaves));
    octaves.ok_or_else(|| "expected a number from -20 to 20".to_owned())
}

fn width_mm(text: &str) -> Result<f32, String> {
    let width = text.parse().ok().filter(|width| (0.1..=1000.0).contains(width));
    width.ok_or_else(|| "expected a number from 0.1 to 1000".to_owned())
}

/// Farthest place of a cloth that is looked at, mm along each thread: single precision tells 0.1 µm
/// there.
pub const FARTHEST_MM: f32 = 2000.0;

fn place_mm(text: &str) -> Result<[f32; 2], String> {
    let (u, v) = text.split_once(',').ok_or("expected two numbers, as in 10,20")?;
    let number = |text: &str| {
        let mm = text.trim().parse().ok().filter(|mm: &f32| mm.abs() <= FARTHEST_MM);
        mm.ok_or_else(|| format!("expected numbers from -{FARTHEST_MM} to {FARTHEST_MM}"))
    };
    Ok([number(u)?, number(v)?])
}

/// A file for a picture, of a format that its extension tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// The file.
    pub path: PathBuf,
    /// Its format.
    pub format: Format,
}

/// A name for an output that ends in neither `.png` nor `.exr`.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("expected a name that ends in .png or .exr")]
pub struct UnknownExtension;

impl Output {
    /// The file at `path`, in the format of its extension in upper or lower case.
    ///
    /// # Errors
    ///
    /// [`UnknownExtension`] when there is no format for it.
    pub fn new(path: PathBuf) -> Result<Self, UnknownExtension> {
        let format = Format::of_extension(&path).ok_or(UnknownExtension)?;
        Ok(Self { path, format })
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn extension_tells_the_format_in_any_case() {
        let format = |text: &str| Output::new(text.into()).map(|output| output.format);
        assert_eq!(format("a.png"), Ok(Format::Png));
        assert_eq!(format("b.c/a.EXR"), Ok(Format::Exr));
        for text in ["a.jpg", "a", "png", ".png", ""] {
            assert_eq!(format(text), Err(UnknownExtension), "{text}");
        }
    }
}
