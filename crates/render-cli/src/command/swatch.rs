//! `selvedge swatch`: a small piece of a cloth, flat and from above.

use super::render::draw;
use crate::{
    Outcome,
    args::SwatchOptions,
    scene::{Scene, swatch::Swatch},
};

/// Renders a swatch of `options.render.cloth` into `options.render.output`.
///
/// # Errors
///
/// As for [`render::run`](super::render::run).
pub fn run(options: &SwatchOptions) -> anyhow::Result<Outcome> {
    let swatch = Swatch { width: options.mm * 1e-3, light: options.light, is_back: options.back };
    draw(&options.render, |cloth| Ok(Scene::swatch(cloth, &swatch)?))
}
