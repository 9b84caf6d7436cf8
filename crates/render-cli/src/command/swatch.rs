//! `selvedge swatch`: a small piece of a cloth, flat and from above.

use std::time::Instant;

use glam::Vec2;
use selvedge_yarn_brdf::Cloth;

use super::render::draw_cloth;
use crate::{
    Outcome,
    args::{RenderOptions, SwatchOptions},
    image::ruler::{LEAST_SIZE, Ruler},
    render::film::Size,
    scene::{Scene, swatch::Swatch},
};

/// Width and height of the picture of a swatch where nothing else is said: what is drawn at once.
const DEFAULT_SIZE: [u32; 2] = [480, 320];

/// Samples per pixel likewise.
const DEFAULT_SPP: u32 = 8;

/// Renders a swatch of `options.render.input` into `options.render.output`.
///
/// # Errors
///
/// As for [`render::run`](super::render::run), and when the picture has no room for the ruler that it
/// is to have.
pub fn run(options: &SwatchOptions) -> anyhow::Result<Outcome> {
    let swatch = Swatch {
        width: options.mm * 1e-3,
        at: Vec2::from(options.at) * 1e-3,
        light: options.light,
        is_back: options.back,
    };
    let size = match options.render.size {
        Some(size) => size,
        None => Size::new(DEFAULT_SIZE[0], DEFAULT_SIZE[1])?,
    };
    let (found, least) = ([size.width(), size.height()], LEAST_SIZE);
    if options.ruler && (found[0] < least[0] || found[1] < least[1]) {
        anyhow::bail!(
            "--ruler: found a picture of {}x{} pixels, expected at least {}x{}",
            found[0],
            found[1],
            least[0],
            least[1]
        );
    }
    let mut render = RenderOptions { size: Some(size), ..options.render.clone() };
    let effort = &mut render.effort;
    if effort.time.is_none() && effort.noise.is_none() {
        effort.spp.get_or_insert(DEFAULT_SPP);
    }
    let scene = |cloth| Ok(Scene::swatch(cloth, &swatch)?);
    draw_cloth(&render, Instant::now(), scene, |cloth, frame, picture| {
        if options.ruler {
            let note = threads_per_inch(cloth);
            Ruler { pixels_per_mm: swatch.pixels_per_mm(size), note }.draw(frame, picture);
        }
    })
}

/// `67 ends x 53 picks per inch`
fn threads_per_inch(cloth: &Cloth) -> String {
    const INCH: f64 = 0.0254;
    let per_inch = |count: u32, length: f64| {
        let number = f64::from(count) * INCH / length;
        if number < 10.0 { format!("{number:.1}") } else { format!("{number:.0}") }
    };
    let size = cloth.size();
    let ends = per_inch(cloth.weave.ends(), size.x);
    let picks = per_inch(cloth.weave.picks(), size.y);
    format!("{ends} ends x {picks} picks per inch")
}
