//! `selvedge render`: a cloth in the built-in scene.

use std::{fmt::Write, time::Instant};

use anyhow::Context;
use rayon::ThreadPoolBuilder;

use super::exposing::{self, Exposing};
use crate::{
    Outcome,
    args::RenderOptions,
    fabric, image,
    output::{Destination, tell},
    render::{View, accumulate::Layers, hash::Fnv, progressive::Stopped},
    scene::{Material, Scene, drape::DEFAULT_SIDE},
};

/// Renders `options.cloth` into `options.output`.
///
/// Warnings about the draft and the fabric, progress and a summary go to stderr unless
/// `options.quiet`. What was drawn when the user interrupts it is written too.
///
/// # Errors
///
/// When the draft or fabric cannot be read or woven, or the output cannot be written; that is found
/// out before the work is done, and no output is left behind.
pub fn run(options: &RenderOptions) -> anyhow::Result<Outcome> {
    draw(options, |cloth| Ok(Scene::built_in(cloth, DEFAULT_SIDE)?))
}

/// As [`run`], in the scene that `scene` makes of the cloth.
pub(super) fn draw(
    options: &RenderOptions,
    scene: impl FnOnce(Material) -> anyhow::Result<Scene> + Send,
) -> anyhow::Result<Outcome> {
    let started = Instant::now();
    let destination = Destination::new(&options.output.path)?;
    let exposing = Exposing::new(options, Layers::None)?;
    let source = fabric::read(&options.cloth)?;
    source.draft().draft()?;
    if !options.quiet {
        source.draft().warnings().for_each(tell);
    }
    let drawdown = source.draft().drawdown()?;
    let cloth = source.cloth(&drawdown)?;
    let size = cloth.size() * 1e3;

    let pool = ThreadPoolBuilder::new()
        .num_threads(options.threads.map_or(0, usize::from))
        .build()
        .context("threads: cannot be started")?;
    let outcome = pool.install(|| -> anyhow::Result<_> {
        let shader = source.shader(&cloth)?;
        if !options.quiet {
            source.warnings(&drawdown, &shader).iter().for_each(tell);
        }
        let scene = scene(Material::cloth(shader))?;
        let key = if exposing.needs_key() { key(&scene, options.seed) } else { 0 };
        exposing.run(&View::new(&scene, options.size, options.seed, false), key)
    })?;

    let picture = image::encode(&outcome.exposed().beauty, options.output.format)?;
    destination.write(|file| file.write_all(&picture))?;
    if !options.quiet {
        tell(format_args!(
            "{}: {} ends x {} picks, repeat {:.1} x {:.1} mm, {}, {:.1} s",
            options.output.path.display(),
            drawdown.ends(),
            drawdown.picks(),
            size.x,
            size.y,
            exposing::samples_in_words(&outcome),
            started.elapsed().as_secs_f64()
        ));
    }
    if options.effort.stats {
        tell(exposing::stats(&outcome));
    }
    let is_interrupted = outcome.stopped == Stopped::Interrupted;
    Ok(if is_interrupted { Outcome::Interrupted } else { Outcome::Done })
}

/// A hash of all that samples depend on.
fn key(scene: &Scene, seed: u64) -> u64 {
    let mut hash = Fnv::default();
    write!(hash, "{} {seed} {scene:?}", env!("CARGO_PKG_VERSION")).expect("a hash takes all");
    hash.finish()
}
