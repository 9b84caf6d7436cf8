//! `selvedge render`: a scene, or a cloth in the built-in one.

use std::{fmt::Write, path::Path, time::Instant};

use anyhow::Context;
use selvedge_yarn_brdf::{Cloth, Shader};

use super::exposing::{self, Exposing};
use crate::{
    Outcome,
    args::{RenderCommand, RenderOptions},
    fabric,
    image::{self, Format, Picture, Value},
    output::{Destination, tell},
    render::{
        View,
        accumulate::Layers,
        detail::Detail,
        film::{Crop, Exposed, Frame, Size},
        hash::Fnv,
        progressive::Stopped,
    },
    scene::{
        Material, Scene,
        file::SceneFile,
        source::{self, Source},
        stage::{Shot, Stage},
    },
    threads,
};

/// Renders what `command` names into its output, once or whenever it changes.
///
/// # Errors
///
/// As for [`run`], but that what is watched is waited for.
pub fn run_or_watch(command: &RenderCommand) -> anyhow::Result<Outcome> {
    if command.watch { super::watch::run(command) } else { run(command) }
}

/// Renders what `command` names into its output.
///
/// Warnings, progress and a summary go to stderr unless it is to be quiet. What was drawn when the
/// user interrupts it is written too.
///
/// # Errors
///
/// When the input cannot be read or is not sound, or the output cannot be written; that is found out
/// before the work is done, and no output is left behind.
pub fn run(command: &RenderCommand) -> anyhow::Result<Outcome> {
    let started = Instant::now();
    let options = &command.render;
    match source::read(&options.input, &command.settings)? {
        Source::Cloth(_) => {
            if command.cloth.is_some() {
                anyhow::bail!(
                    "{}: found a cloth, expected a scene, in which --cloth is woven",
                    options.input.display()
                );
            }
            let scene = |cloth| {
                let shot = Shot { camera: command.camera, light: command.light };
                let mut scene = Stage::new(command.form.unwrap_or_default())?.scene(cloth, &shot);
                scene.depth = command.depth.unwrap_or(scene.depth);
                Ok(scene)
            };
            draw_cloth(options, started, scene, |_, _, _| {})
        }
        Source::Scene(file, folder) => {
            if command.form.is_some() || command.camera.is_some() || command.light.is_some() {
                anyhow::bail!(
                    "{}: found a scene, expected a cloth, to which --form, --camera and --light apply",
                    options.input.display()
                );
            }
            let mut file = *file;
            let mut options = options.clone();
            match (options.size, file.film.crop) {
                // The crop is of a picture of the scene's own size.
                (Some(size), _) => file.film.size = [size.width(), size.height()],
                (None, Some([left, top, right, bottom])) => {
                    let crop = Crop::new([left, top], [right, bottom]).context("film.crop")?;
                    options.cropwindow = options.cropwindow.or(Some(crop));
                }
                (None, None) => {}
            }
            file.depth = command.depth.unwrap_or(file.depth);
            draw_scene(&options, started, &file, &folder, command.cloth.as_deref())
        }
    }
}

/// Renders the cloth that `options` name in the scene that `scene` makes of it; `adorn` changes the
/// picture of the crop of a frame before it is written.
pub(super) fn draw_cloth(
    options: &RenderOptions,
    started: Instant,
    scene: impl FnOnce(Material) -> anyhow::Result<Scene> + Send,
    adorn: impl FnOnce(&Cloth, Frame, &mut Picture),
) -> anyhow::Result<Outcome> {
    let drawing = Drawing::new(options, options.size.unwrap_or_default())?;
    let source = fabric::read(&options.input)?;
    source.draft().draft()?;
    if !options.quiet {
        source.draft().warnings().for_each(tell);
    }
    let drawdown = source.draft().drawdown()?;
    let cloth = source.cloth(&drawdown)?;
    let size = cloth.size() * 1e3;
    let what = format!(
        "{} ends x {} picks, repeat {:.1} x {:.1} mm",
        drawdown.ends(),
        drawdown.picks(),
        size.x,
        size.y
    );
    let scene = || {
        let shader = source.shader(&cloth)?;
        if !options.quiet {
            source.warnings(&drawdown, &shader).iter().for_each(tell);
        }
        Ok((scene(Material::cloth(shader))?, vec![source.hash()?]))
    };
    drawing.run(started, &what, scene, |frame, picture| adorn(&cloth, frame, picture))
}

fn draw_scene(
    options: &RenderOptions,
    started: Instant,
    file: &SceneFile,
    folder: &Path,
    cloth: Option<&Path>,
) -> anyhow::Result<Outcome> {
    let [width, height] = file.film.size;
    let drawing = Drawing::new(options, Size::new(width, height)?)?;
    let scene = || {
        let name = || options.input.display().to_string();
        let built = file.build(folder, cloth).with_context(name)?;
        if !options.quiet {
            built.warnings.iter().for_each(tell);
        }
        Ok((built.scene, built.fabrics))
    };
    drawing.run(started, &format!("{width} x {height} pixels"), scene, |_, _| {})
}

/// A picture on its way.
struct Drawing<'a> {
    options: &'a RenderOptions,
    destination: Destination,
    exposing: Exposing<'a>,
    size: Size,
    layers: Layers,
}

impl<'a> Drawing<'a> {
    fn new(options: &'a RenderOptions, size: Size) -> anyhow::Result<Self> {
        let layers = match options.output.format {
            Format::Exr => Layers::All,
            Format::Png => Layers::None,
        };
        Ok(Self {
            options,
            destination: Destination::new(&options.output.path)?,
            exposing: Exposing::new(options, size, layers)?,
            size,
            layers,
        })
    }

    /// Draws the scene that `scene` builds, of fabrics with these hashes, on the threads that are asked
    /// for. `adorn` changes the picture before it is written.
    fn run(
        self,
        started: Instant,
        what: &str,
        scene: impl FnOnce() -> anyhow::Result<(Scene, Vec<u64>)> + Send,
        adorn: impl FnOnce(Frame, &mut Picture),
    ) -> anyhow::Result<Outcome> {
        let Self { options, destination, exposing, size, layers } = self;
        let pool = threads::pool(options.threads)?;
        let (outcome, metadata, cloth_bytes, texture_bytes, far_share, stages) =
            pool.install(|| -> anyhow::Result<_> {
                let (mut scene, fabrics) = scene()?;
                scene.detail = Detail { level: options.lod, bias: options.lod_bias };
                let key = if exposing.needs_key() { key(&scene, options.seed) } else { 0 };
                let view = View::new(&scene, size, options.seed, layers == Layers::All);
                let cloths = scene.shaders().map(Shader::bytes);
                let cloths = cloths.collect::<Vec<_>>();
                let outcome = exposing.run(&view, key)?;
                let metadata = metadata(&scene, &fabrics, options.seed, outcome.spp_mean);
                let textures = scene.texture_bytes();
                let threads = rayon::current_num_threads();
                let stages = exposing::time_by_stage(&scene.stages, threads, &outcome);
                Ok((outcome, metadata, cloths, textures, scene.shades.far_share(), stages))
            })?;

        let mut picture = develop(&outcome.exposed(), options.exposure, options.view);
        picture.metadata = metadata;
        let frame = outcome.accumulator.frame();
        adorn(frame, &mut picture);
        let bytes = picture.encode(options.output.format)?;
        destination.write(|file| file.write_all(&bytes))?;
        if !options.quiet {
            let is_part = frame != Frame::whole(frame.size());
            let crop = if is_part { format!(", crop {}", frame.crop()) } else { String::new() };
            tell(format_args!(
                "{}: {what}{crop}, {}, {:.1} s",
                options.output.path.display(),
                exposing::samples_in_words(&outcome),
                started.elapsed().as_secs_f64()
            ));
        }
        if options.effort.stats {
            tell(exposing::stats(&outcome));
            tell(stages);
            if let Some(share) = far_share {
                tell(format_args!("{:<12}{:.1} % of the shades of cloth", "far", 100.0 * share));
            }
            for bytes in cloth_bytes {
                tell(format_args!("{:<12}{:.1} kB", "cloth", bytes as f64 * 1e-3));
            }
            if texture_bytes > 0 {
                tell(format_args!("{:<12}{:.1} kB", "textures", texture_bytes as f64 * 1e-3));
            }
        }
        let is_interrupted = outcome.stopped == Stopped::Interrupted;
        Ok(if is_interrupted { Outcome::Interrupted } else { Outcome::Done })
    }
}

/// The picture of what was exposed, by so many stops brighter.
pub(crate) fn develop(exposed: &Exposed, exposure: f32, view: image::View) -> Picture {
    let mut picture = Picture::from_exposed(exposed);
    if exposure != 0.0 {
        picture.scale(exposure.exp2());
    }
    picture.view = view;
    picture
}

/// What a picture tells of how it was made, so that it can be made again.
///
/// `fabrics` are hashes of the fabrics of its cloths, `spp` the mean number of samples of a pixel. Time has
/// no place here: it is never the same twice.
pub(crate) fn metadata(
    scene: &Scene,
    fabrics: &[u64],
    seed: u64,
    spp: f64,
) -> Vec<(String, Value)> {
    let mut metadata = vec![
        ("software".to_owned(), Value::Text(format!("selvedge {}", env!("CARGO_PKG_VERSION")))),
        ("seed".to_owned(), Value::Text(seed.to_string())),
    ];
    for (index, fabric) in fabrics.iter().enumerate() {
        let hash = Value::Text(format!("{fabric:016x}"));
        metadata.push((format!("fabric {index}, FNV-1a 64"), hash));
    }
    for (index, shader) in scene.shaders().enumerate() {
        let factors = (0..).map_while(|yarn| shader.normalization(yarn));
        let factors = factors.flat_map(|both| both.map(|of_shape| of_shape.factor as f32));
        metadata.push((format!("normalization {index}"), Value::List(factors.collect())));
    }
    metadata.push(("spp".to_owned(), Value::Real(spp)));
    metadata
}

/// A hash of all that samples depend on.
fn key(scene: &Scene, seed: u64) -> u64 {
    let mut hash = Fnv::default();
    write!(hash, "{} {seed} {scene:?}", env!("CARGO_PKG_VERSION")).expect("a hash takes all");
    hash.finish()
}
