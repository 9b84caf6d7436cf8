//! What the level of detail does while a camera goes away from a flat cloth, from a millimetre to ten metres of
//! it across the frame: a table for `docs/renderer.md`, and what is said there about it.
//!
//! ```text
//! cargo bench -p selvedge --bench zoom                                             as in the document
//! cargo bench -p selvedge --bench zoom -- preset:silk-charmeuse --reference 256    a quick look
//! ```

use std::{num::NonZeroU32, path::Path, sync::atomic::AtomicBool, time::Instant};

use anyhow::Context;
use clap::Parser;
use glam::Vec2;
use selvedge_cli::{
    fabric,
    image::{Picture, compare::Pair},
    render::{
        View,
        accumulate::Layers,
        detail::Level,
        film::{Frame, Size},
        progressive::{self, Control, Limits, Plan},
    },
    scene::{
        Material, Scene,
        swatch::{Light, Swatch},
    },
};

/// Width of the cloth across the first frame and the last, m.
const WIDTHS: [f64; 2] = [1e-3, 10.0];

/// Measures a zoom.
#[derive(Parser)]
struct Arguments {
    /// Fabric that is looked at
    #[arg(default_value = "preset:denim")]
    fabric: String,
    /// Frames of the zoom
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    /// Width and height of the frames
    #[arg(long, default_value = "32x32")]
    size: Size,
    /// Samples per pixel of what is compared
    #[arg(long, default_value = "16")]
    spp: NonZeroU32,
    /// Samples per pixel of the picture of single threads that is taken for the true one
    #[arg(long, default_value = "4096")]
    reference: NonZeroU32,
    /// What cargo passes
    #[arg(long, hide = true)]
    bench: bool,
}

/// A frame, drawn at one level of detail.
struct Drawn {
    picture: Picture,
    seconds: f64,
    /// Of the shades of cloth, by the far field.
    far: f64,
}

/// What is found of a frame.
struct Found {
    /// Mean radiance over that of the reference.
    mean: f64,
    flip: f64,
    /// Squared error times time.
    cost: f64,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let source = fabric::read(Path::new(&arguments.fabric))?;
    let cloth = source.cloth(&source.draft().drawdown()?)?;
    let cloth = Material::cloth(source.shader(&cloth)?);
    println!("| width, m | far | mean, auto | near | FLIP, auto | near | near takes as long × |");
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let mut rows = Vec::new();
    for frame in 0..arguments.frames {
        let share = f64::from(frame) / f64::from(arguments.frames - 1);
        let width = WIDTHS[0] * (WIDTHS[1] / WIDTHS[0]).powf(share);
        let draw = |level: Level, seed: u64, spp: NonZeroU32| {
            draw(&cloth, width as f32, level, seed, (arguments.size, spp))
                .with_context(|| format!("{width} m"))
        };
        let reference = draw(Level::Near, 1, arguments.reference)?;
        let auto = draw(Level::Auto, 0, arguments.spp)?;
        let near = draw(Level::Near, 0, arguments.spp)?;
        let far = auto.far;
        let [auto, near] = [auto, near].map(|drawn| Found::of(&drawn, &reference.picture));
        let (auto, near) = (auto?, near?);
        println!(
            "| {width:.4} | {:.0} % | {:.4} | {:.4} | {:.4} | {:.4} | {:.2} |",
            100.0 * far,
            auto.mean,
            near.mean,
            auto.flip,
            near.flip,
            near.cost / auto.cost,
        );
        rows.push((auto, near));
    }
    let most = |of: &dyn Fn(&(Found, Found)) -> f64| rows.iter().map(of).fold(0.0, f64::max);
    let steps = rows.windows(2).map(|two| (two[1].0.mean - two[0].0.mean).abs());
    println!();
    println!("mean of auto off by at most {:.2} %", 100.0 * most(&|row| (row.0.mean - 1.0).abs()));
    println!("mean of near off by at most {:.2} %", 100.0 * most(&|row| (row.1.mean - 1.0).abs()));
    println!("between two frames at most {:.2} %", 100.0 * steps.fold(0.0, f64::max));
    println!("FLIP of auto over near at most {:.3}", most(&|row| row.0.flip / row.1.flip));
    Ok(())
}

/// Draws a piece of `cloth` that is `width` m wide.
fn draw(
    cloth: &Material,
    width: f32,
    level: Level,
    seed: u64,
    (size, spp): (Size, NonZeroU32),
) -> anyhow::Result<Drawn> {
    let swatch = Swatch { width, at: Vec2::ZERO, light: Light::Raking, is_back: false };
    let mut scene = Scene::swatch(cloth.clone(), &swatch)?;
    scene.detail.level = level;
    let view = View::new(&scene, size, seed, false);
    let limits = Limits { spp: spp.get(), time: None, noise: None };
    let plan = Plan { frame: Frame::whole(size), layers: Layers::None, limits, key: 0 };
    let interrupt = AtomicBool::new(false);
    let start = Instant::now();
    let outcome = progressive::expose(&view, &plan, &Control::until(&interrupt));
    Ok(Drawn {
        seconds: start.elapsed().as_secs_f64(),
        picture: Picture::from_exposed(&outcome.exposed()),
        far: scene.shades.far_share().unwrap_or(0.0),
    })
}

impl Found {
    fn of(drawn: &Drawn, reference: &Picture) -> anyhow::Result<Self> {
        let mean = |picture: &Picture| -> f64 {
            let colors = picture.to_colors();
            colors.iter().map(|color| f64::from(color.element_sum())).sum()
        };
        let comparison = Pair::new(&drawn.picture, reference)?.comparison();
        Ok(Self {
            mean: mean(&drawn.picture) / mean(reference),
            flip: comparison.flip,
            cost: comparison.relmse * drawn.seconds,
        })
    }
}
