//! Pictures of numbers: over the hemisphere seen from above, or in cells of a square.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::{
    image::{Layer, Picture, View},
    render::film::Size,
};

/// The directions above the surface as seen from far above, x to the right and y up, in a square of
/// `side` pixels: the colour of each, in linear light that is shown as it is; `ground` around them.
pub(super) fn hemisphere(
    side: u32,
    ground: Vec3,
    color: impl Fn(usize, DVec3) -> Vec3 + Sync,
) -> Picture {
    let pixels: Vec<Vec3> = (0..side as usize * side as usize)
        .into_par_iter()
        .map(|pixel| direction(side, pixel).map_or(ground, |w| color(pixel, w)))
        .collect();
    picture(side, &pixels)
}

/// The direction in the middle of a pixel of [`hemisphere`].
pub(super) fn direction(side: u32, pixel: usize) -> Option<DVec3> {
    let at = |k: usize| 2.0 * (k as f64 + 0.5) / f64::from(side) - 1.0;
    let (x, y) = (at(pixel % side as usize), -at(pixel / side as usize));
    let rest = 1.0 - x * x - y * y;
    (rest > 0.0).then(|| DVec3::new(x, y, rest.sqrt()))
}

/// A square of `side` cells on each side, each `scale` pixels wide.
pub(super) fn cells(side: usize, scale: usize, color: impl Fn(usize) -> Vec3) -> Picture {
    let width = side * scale;
    let pixels = (0..width * width).map(|pixel| {
        let (x, y) = (pixel % width / scale, pixel / width / scale);
        // The first row is the lowest.
        color((side - 1 - y) * side + x)
    });
    picture(width as u32, &pixels.collect::<Vec<_>>())
}

fn picture(side: u32, pixels: &[Vec3]) -> Picture {
    let size = Size::new(side, side).expect("a few pixels are no more than allowed");
    let mut picture = Picture::new(size);
    picture.push(Layer::colors("", pixels));
    picture.view = View::Raw;
    picture
}

/// Black to white over blue, red and yellow, for `share` from 0 to 1, evenly in what is seen.
pub(super) fn heat(share: f64) -> Vec3 {
    // Linear values of the steps.
    const STEPS: [Vec3; 5] = [
        Vec3::new(0.0, 0.0, 0.01),
        Vec3::new(0.08, 0.01, 0.25),
        Vec3::new(0.5, 0.03, 0.12),
        Vec3::new(0.95, 0.35, 0.03),
        Vec3::new(1.0, 1.0, 0.85),
    ];
    let at = 4.0 * if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let step = (at as usize).min(3);
    STEPS[step].lerp(STEPS[step + 1], at as f32 - step as f32)
}
