//! `selvedge render`: a cloth in the built-in scene.

use std::time::Instant;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::ThreadPoolBuilder;

use crate::{
    args::RenderOptions,
    fabric, image,
    output::{Destination, tell},
    render::{self, Settings},
    scene::{Material, Scene, drape::DEFAULT_SIDE},
};

/// Renders `options.cloth` into `options.output`.
///
/// Warnings about the draft and the fabric, a progress bar and a summary go to stderr unless
/// `options.quiet`.
///
/// # Errors
///
/// When the draft or fabric cannot be read or woven, or the output cannot be written; that is found
/// out before the work is done, and no output is left behind.
pub fn run(options: &RenderOptions) -> anyhow::Result<()> {
    draw(options, |cloth| Ok(Scene::built_in(cloth, DEFAULT_SIDE)?))
}

/// As [`run`], in the scene that `scene` makes of the cloth.
pub(super) fn draw(
    options: &RenderOptions,
    scene: impl FnOnce(Material) -> anyhow::Result<Scene> + Send,
) -> anyhow::Result<()> {
    let started = Instant::now();
    let destination = Destination::new(&options.output.path)?;
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
    let settings = Settings { size: options.size, spp: options.spp, seed: options.seed };
    let film = pool.install(|| -> anyhow::Result<_> {
        let shader = source.shader(&cloth)?;
        if !options.quiet {
            source.warnings(&drawdown, &shader).iter().for_each(tell);
        }
        let scene = scene(Material::cloth(shader))?;
        let bar = progress_bar(options);
        let film = render::render(&scene, &settings, || bar.inc(1));
        bar.finish_and_clear();
        Ok(film)
    })?;

    let picture = image::encode(&film, options.output.format)?;
    destination.write(|file| file.write_all(&picture))?;
    if !options.quiet {
        tell(format_args!(
            "{}: {} ends x {} picks, repeat {:.1} x {:.1} mm, {} spp, {:.1} s",
            options.output.path.display(),
            drawdown.ends(),
            drawdown.picks(),
            size.x,
            size.y,
            options.spp,
            started.elapsed().as_secs_f64()
        ));
    }
    Ok(())
}

/// One step per row; draws nothing where stderr is not a terminal.
fn progress_bar(options: &RenderOptions) -> ProgressBar {
    let target =
        if options.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %, {eta} left")
        .expect("the template names fields of indicatif");
    ProgressBar::with_draw_target(Some(options.size.height().into()), target).with_style(style)
}
