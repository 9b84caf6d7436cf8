//! How near `--noise` comes to the noise that it is given, and what it saves against the same number
//! of samples everywhere: on five scenes, a table for `docs/adaptive.md`.
//!
//! ```text
//! cargo bench -p selvedge --bench adaptive                                   all scenes, as in the document
//! cargo bench -p selvedge --bench adaptive -- --noise 0.1 --reference 1024   a quick look
//! cargo bench -p selvedge --bench adaptive -- --halves                       what estimating costs
//! ```

use std::{num::NonZeroU32, path::Path, sync::atomic::AtomicBool};

use anyhow::Context;
use clap::Parser;
use selvedge_cli::{
    fabric,
    image::Picture,
    render::{
        View,
        accumulate::{Accumulator, Layers, TILE, relative_error},
        film::{Frame, Size},
        progressive::{self, Control, Limits, Outcome, Plan},
    },
    scene::{
        Material, Scene,
        drape::DEFAULT_SIDE,
        source::{self, Source},
    },
};

/// What is drawn, seen from the folder of the workspace.
const SUBJECTS: [&str; 5] = [
    "scene:sheet",
    "fixtures/scenes/studio.json",
    "preset:denim",
    "preset:silk-charmeuse",
    "fixtures/drafts/tartan.wif",
];

/// Measures adaptive sampling.
#[derive(Parser)]
struct Arguments {
    /// What is drawn [default: five scenes]
    subjects: Vec<String>,
    /// What `--noise` is given
    #[arg(long, default_value_t = 0.05)]
    noise: f32,
    /// Samples per pixel of the picture that is taken for the true one
    #[arg(long, default_value = "4096")]
    reference: NonZeroU32,
    /// Width and height of the pictures
    #[arg(long, default_value = "128x80")]
    size: Size,
    /// Compares pictures of two independent sequences of samples, as noise is estimated by, with those
    /// of one
    #[arg(long)]
    halves: bool,
    /// What cargo passes
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let subjects = match &arguments.subjects[..] {
        [] => SUBJECTS.map(str::to_owned).to_vec(),
        subjects => subjects.to_vec(),
    };
    if arguments.halves {
        println!("| scene | error of one | of two | samples that make up for it |");
        println!("| --- | ---: | ---: | ---: |");
        for subject in &subjects {
            println!("{}", halves(subject, &arguments).with_context(|| subject.clone())?);
        }
        return Ok(());
    }
    println!(
        "| scene | error / n | worst tile / n | tiles above 1.2 n | spp | s | spp of the same mean | s \
         | spp of the same tiles | s | saved |"
    );
    println!("| --- |{}", " ---: |".repeat(10));
    for subject in &subjects {
        println!("{}", row(subject, &arguments).with_context(|| subject.clone())?);
    }
    Ok(())
}

/// One row of the table.
fn row(subject: &str, arguments: &Arguments) -> anyhow::Result<String> {
    let scene = scene(subject)?;
    let size = arguments.size;
    let truth = Truth::of(&scene, arguments);
    let view = View::new(&scene, size, 0, false);
    let noise = f64::from(arguments.noise);
    let most = arguments.reference.get();
    let adaptive = Accumulated::new(&view, size, most, Some(arguments.noise), None);
    let reached = truth.errors(&adaptive.picture());
    let missed = reached.above(1.2 * noise);

    let mut fixed: Option<Accumulated> = None;
    let (mut equal_mean, mut equal_tiles) = (None, None);
    let mut before = None;
    for spp in levels(most) {
        let picture = Accumulated::new(&view, size, spp, None, fixed.take());
        let errors = truth.errors(&picture.picture());
        let point = Point { mean: errors.mean, spp: f64::from(spp), seconds: picture.seconds() };
        if equal_mean.is_none() && errors.mean <= reached.mean {
            equal_mean = Some(before.map_or(point, |before| point.at(before, reached.mean)));
        }
        if equal_tiles.is_none() && errors.above(1.2 * noise) <= missed {
            equal_tiles = Some(point);
        }
        if equal_mean.is_some() && equal_tiles.is_some() {
            break;
        }
        (before, fixed) = (Some(point), Some(picture));
    }
    let spp = adaptive.0.spp_mean;
    let cells = |point: Option<Point>| {
        let cells = point.map(|Point { spp, seconds, .. }| format!("{spp:.0} | {seconds:.1}"));
        cells.unwrap_or_else(|| format!("above {most} | "))
    };
    let saved = equal_tiles.map_or(f64::INFINITY, |point| point.spp / spp);
    Ok(format!(
        "| `{subject}` | {:.2} | {:.2} | {:.1} % | {spp:.0} | {:.1} | {} | {} | {saved:.1} × |",
        reached.mean / noise,
        reached.greatest() / noise,
        100.0 * missed,
        adaptive.seconds(),
        cells(equal_mean),
        cells(equal_tiles),
    ))
}

/// One row of the table of `--halves`.
fn halves(subject: &str, arguments: &Arguments) -> anyhow::Result<String> {
    const SPP: u32 = 64;
    let scene = scene(subject)?;
    let truth = Truth::of(&scene, arguments);
    let view = View::new(&scene, arguments.size, 0, false);
    // So little noise is never met.
    let [one, two] = [None, Some(1e-9)].map(|noise| {
        let picture = Accumulated::new(&view, arguments.size, SPP, noise, None);
        truth.errors(&picture.picture()).mean
    });
    let more = 100.0 * ((two / one).powi(2) - 1.0);
    Ok(format!("| `{subject}` | {one:.4} | {two:.4} | {more:.0} % |"))
}

/// Samples per pixel at which fixed pictures are looked at: four in each octave.
fn levels(most: u32) -> impl Iterator<Item = u32> {
    (0..)
        .map(|step| (8.0 * 2.0_f64.powf(f64::from(step) / 4.0)) as u32)
        .take_while(move |&spp| spp <= most)
}

/// A fixed picture.
#[derive(Clone, Copy)]
struct Point {
    /// Its error.
    mean: f64,
    spp: f64,
    seconds: f64,
}

impl Point {
    /// Where between `before` and this the error is `mean`: all fall as powers of each other.
    fn at(self, before: Self, mean: f64) -> Self {
        let share = ((before.mean / mean).ln() / (before.mean / self.mean).ln()).clamp(0.0, 1.0);
        let between = |from: f64, to: f64| from * (to / from).powf(share);
        Self {
            mean,
            spp: between(before.spp, self.spp),
            seconds: between(before.seconds, self.seconds),
        }
    }
}

/// A picture that was exposed, and how.
struct Accumulated(Outcome);

impl Accumulated {
    /// The picture with `spp` samples per pixel, or fewer where `noise` is met; `start` is one of
    /// fewer of these samples to go on from.
    fn new(view: &View<'_>, size: Size, spp: u32, noise: Option<f32>, start: Option<Self>) -> Self {
        let limits = Limits { spp, time: None, noise };
        let plan = Plan { frame: Frame::whole(size), layers: Layers::None, limits, key: 0 };
        let interrupt = AtomicBool::new(false);
        let control = Control::until(&interrupt);
        let start: Accumulator = start.map_or_else(|| plan.start(), |start| start.0.accumulator);
        Self(progressive::resume(view, &plan, start, &control))
    }

    fn picture(&self) -> Picture {
        Picture::from_exposed(&self.0.exposed())
    }

    fn seconds(&self) -> f64 {
        self.0.accumulator.elapsed.as_secs_f64()
    }
}

/// A picture without noise worth mentioning.
struct Truth(Picture);

/// The errors of a picture.
struct Errors {
    /// Root of their mean square.
    mean: f64,
    /// That over each tile.
    tiles: Vec<f64>,
}

impl Truth {
    /// Of other samples than the pictures that are compared with it.
    fn of(scene: &Scene, arguments: &Arguments) -> Self {
        let view = View::new(scene, arguments.size, 1, false);
        Self(
            Accumulated::new(&view, arguments.size, arguments.reference.get(), None, None)
                .picture(),
        )
    }

    fn errors(&self, picture: &Picture) -> Errors {
        let width = self.0.size().width();
        let columns = width.div_ceil(TILE);
        let rows = self.0.size().height().div_ceil(TILE);
        let mut sums = vec![(0.0, 0); (columns * rows) as usize];
        let pixels = self.0.to_colors().into_iter().zip(picture.to_colors());
        for (index, (truth, found)) in (0..).zip(pixels) {
            let (truth, found) = (truth.as_dvec3(), found.as_dvec3());
            let tile = index % width / TILE + index / width / TILE * columns;
            let (sum, count) = &mut sums[tile as usize];
            *sum += relative_error(truth, found - truth).length_squared();
            *count += 3;
        }
        let root = |sum: f64, count: u32| (sum / f64::from(count)).sqrt();
        let (sum, count) = sums.iter().fold((0.0, 0), |all, of| (all.0 + of.0, all.1 + of.1));
        Errors {
            mean: root(sum, count),
            tiles: sums.into_iter().map(|(sum, count)| root(sum, count)).collect(),
        }
    }
}

impl Errors {
    /// The share of tiles with an error above `limit`.
    fn above(&self, limit: f64) -> f64 {
        let count = self.tiles.iter().filter(|&&error| error > limit).count();
        count as f64 / self.tiles.len() as f64
    }

    fn greatest(&self) -> f64 {
        self.tiles.iter().copied().fold(0.0, f64::max)
    }
}

/// The scene that `selvedge render` draws of `subject`.
fn scene(subject: &str) -> anyhow::Result<Scene> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let is_file = !subject.contains(':');
    let path = if is_file { workspace.join(subject) } else { subject.into() };
    match source::read(&path, &[])? {
        Source::Scene(file, folder) => Ok(file.build(&folder, None)?.scene),
        Source::Cloth(path) => {
            let source = fabric::read(&path)?;
            let cloth = source.cloth(&source.draft().drawdown()?)?;
            Ok(Scene::built_in(Material::cloth(source.shader(&cloth)?), DEFAULT_SIDE)?)
        }
    }
}
