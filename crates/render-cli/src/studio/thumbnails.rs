//! Small pictures of the presets.

use std::sync::atomic::{AtomicBool, Ordering};

use hyper::body::Bytes;
use selvedge_yarn_brdf::Preparer;

use crate::{
    command::render::develop,
    fabric::{self, PRESET},
    image::{self, Format},
    render::{
        View,
        accumulate::Layers,
        film::{Frame, Size},
        progressive::{self, Control, Limits, Plan, Stopped},
    },
    scene::{Material, Scene, swatch},
};

/// Width and height, pixels; samples per pixel; and the width of cloth, m.
const SIZE: [u32; 2] = [192, 128];
const SPP: u32 = 4;
const WIDTH: f32 = 0.012;

/// A PNG of the preset `name`; `None` if `interrupt` was set meanwhile.
///
/// # Panics
///
/// If there is no such preset: those that are compiled in are sound.
pub(super) fn draw(name: &str, preparer: &mut Preparer, interrupt: &AtomicBool) -> Option<Bytes> {
    let goes_on = || !interrupt.load(Ordering::Relaxed);
    let mut scene = || -> anyhow::Result<Option<Scene>> {
        let source = fabric::read(format!("{PRESET}{name}").as_ref())?;
        let cloth = source.cloth(&source.draft().drawdown()?)?;
        let Some(shader) = preparer.prepare(&cloth, &goes_on)? else { return Ok(None) };
        let light = swatch::Light::Raking;
        let swatch = swatch::Swatch { width: WIDTH, at: glam::Vec2::ZERO, light, is_back: false };
        Ok(Some(Scene::swatch(Material::cloth(shader), &swatch)?))
    };
    let scene = scene().expect("a preset is sound")?;
    let size = Size::new(SIZE[0], SIZE[1]).expect("a thumbnail has pixels");
    let limits = Limits { spp: SPP, time: None, noise: None };
    let plan = Plan { frame: Frame::whole(size), layers: Layers::None, limits, key: 0 };
    let control = Control::until(interrupt);
    let outcome = progressive::expose(&View::new(&scene, size, 0, false), &plan, &control);
    if outcome.stopped == Stopped::Interrupted {
        return None;
    }
    let picture = develop(&outcome.exposed(), 0.0, image::View::Srgb);
    Some(picture.encode(Format::Png).expect("a small picture fits a PNG").into())
}
