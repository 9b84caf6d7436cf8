//! The command line of `selvedge measure`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// What to measure.
#[derive(Clone, Debug, Subcommand)]
pub enum MeasureCommand {
    /// The figures of the paper, but for its photographs
    ///
    /// Each cloth draped, with its weave (figure 1); fabrics A and B draped, and the same as maps on a
    /// glossy surface (figures 9 and 10); fabric A, wrinkled, under six lights (figure 11).
    Figures(MeasureOptions),

    /// How the streak of a yarn compares with that of one of single filaments
    ///
    /// Traces yarns of 8 to 1024 twisted filaments and sets them beside the piece of yarn that the
    /// shader shows, for nine pairs of twist and inclination and for the yarns of each cloth.
    Filaments(MeasureOptions),
    /// How much of the light from all around is reflected, by cloth, yarn and kind of segment
    ///
    /// White yarns and the cloth's own, over the angle of the viewer: single points, batches and the far
    /// field. Nothing may reflect more than it receives.
    Furnace(MeasureOptions),

    /// Whether swapping light and viewer changes what is reflected
    ///
    /// Compares f(wi, wo) with f(wo, wi) of random pairs of directions: of the reference in f64, of
    /// single points, of batches and of the far field.
    Reciprocity(MeasureOptions),

    /// Whether directions are drawn with the density that is told of them
    ///
    /// Pearson's χ² of many places and viewers, of single points, of batches and of the far field; and
    /// a white furnace that is summed in three ways as red, green and blue, and must be white.
    Chi2(MeasureOptions),

    /// What becomes of a cloth at the limits of its parameters, directions and scale
    ///
    /// Counts values that are no number, infinite, negative or too bright, and tells the errors of f in
    /// f32, of single points and of batches with all instructions, against f64. The worst inputs are named
    /// as arguments of selvedge eval.
    Stability(MeasureOptions),

    /// Slices through the BRDF as a goniophotometer sees them, and the albedo over the angle
    Gonio(MeasureOptions),
    /// What a cloth costs beside pictures of it: time, memory and noise
    ///
    /// Draws a wrinkled sample under six lights woven, with the glossy material and five maps of 8 bits
    /// that selvedge bake makes of the same cloth, and plainly diffuse: with equal numbers of samples,
    /// and adaptively to equal noise. Each run is a process of its own, so that its memory is; the
    /// shaders take turns, and ratios are those of neighbours. Then what is bad for cloth: small maps,
    /// a camera far away, irregular yarns, twisted yarns.
    ///
    /// The sizes are those of Nelson, McEvoy & Fratarcangeli 2016, table 1: maps of 4096 pixels, at least
    /// ten of them to a thread.
    Table1(Table1Options),
    /// What speed costs in accuracy, and what to choose for how much
    ///
    /// Draws each cloth draped, with other tiers, levels of detail, highlights, normalizations, numbers of
    /// samples and thresholds of noise, against a picture that is taken for the true one. That one is kept
    /// in the user's folder for caches, under selvedge/references.
    Trade(MeasureOptions),
}

/// Arguments of all that measures.
#[derive(Clone, Debug, Args)]
pub struct MeasureOptions {
    /// What is measured: drafts (WIF), fabrics (JSON) or preset:NAME
    #[arg(value_name = "CLOTH", required = true)]
    pub inputs: Vec<PathBuf>,

    /// The folder for the report
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// How much is measured, 0.001 to 1000: with 2 it takes twice as long
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = budget)]
    pub budget: f64,

    /// Chooses the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Threads to use [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// No progress; errors are still told
    #[arg(short, long)]
    pub quiet: bool,

    /// Breaks the shader on purpose
    #[cfg(any(test, feature = "faults"))]
    #[arg(long, value_enum, hide = true)]
    pub fault: Option<Fault>,
}

/// What may be wrong with a shader that is broken on purpose.
#[cfg(any(test, feature = "faults"))]
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Fault {
    /// The phase function integrates to 2
    Phase,
    /// The density is told twice as high as it is
    Pdf,
    /// f is no number at grazing directions
    Grazing,
}

impl MeasureOptions {
    /// `count` within the budget, at least 1.
    pub fn count(&self, count: u64) -> u64 {
        (count as f64 * self.budget).ceil().max(1.0) as u64
    }
}

/// Arguments of `selvedge measure table1`.
#[derive(Clone, Debug, Args)]
pub struct Table1Options {
    /// What is measured how well.
    #[command(flatten)]
    pub measure: MeasureOptions,

    /// Width and height of each map in pixels, 16 to 8192
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub map: u32,

    /// Width and height of the pictures in pixels, 16 to 4096
    #[arg(long, value_name = "N", default_value_t = 240, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub size: u32,
}

fn budget(text: &str) -> Result<f64, String> {
    let budget = text.parse().ok().filter(|budget| (0.001..=1000.0).contains(budget));
    budget.ok_or_else(|| "expected a number from 0.001 to 1000".to_owned())
}
