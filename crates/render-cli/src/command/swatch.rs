//! `selvedge swatch`: a small piece of a cloth, flat and from above.

use std::time::Instant;

use super::render::draw_cloth;
use crate::{
    Outcome,
    args::SwatchOptions,
    scene::{Scene, swatch::Swatch},
};

/// Renders a swatch of `options.render.input` into `options.render.output`.
///
/// # Errors
///
/// As for [`render::run`](super::render::run).
pub fn run(options: &SwatchOptions) -> anyhow::Result<Outcome> {
    let swatch = Swatch { width: options.mm * 1e-3, light: options.light, is_back: options.back };
    draw_cloth(&options.render, Instant::now(), |cloth| Ok(Scene::swatch(cloth, &swatch)?))
}
