//! The pictures of Nelson, McEvoy & Fratarcangeli 2016, but for the photographs.

pub mod sheet;
pub mod textured;

use std::path::Path;

use anyhow::bail;
use glam::Vec3;
use selvedge_yarn_brdf::Cloth;

use super::expose;
use crate::{
    render::{
        film::{Film, Frame, Size},
        progressive::Limits,
    },
    scene::{
        Material, Scene,
        drape::DEFAULT_SIDE,
        source::{self, Source},
    },
};

/// Part of the light that a screen shows as grey, by its primaries (ITU-R BT.709-6, item 3.2).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// How bright a colour is, linear.
pub fn luminance(color: Vec3) -> f64 {
    f64::from(color.dot(LUMINANCE))
}

/// The mean brightness of all pixels, linear.
pub fn mean_luminance(film: &Film) -> f64 {
    film.pixels().iter().map(|color| luminance(*color)).sum::<f64>() / film.pixels().len() as f64
}

/// `material` in the built-in scene, draped.
///
/// # Errors
///
/// As [`Scene::built_in`].
pub fn draped(material: &Material, size: Size, spp: u32, seed: u64) -> anyhow::Result<Film> {
    let scene = Scene::built_in(material.clone(), DEFAULT_SIDE)?;
    Ok(draw(&scene, size, spp, seed))
}

/// `material` on the wrinkled sample of `scene:wrinkled`, lit from `light` of its six directions, 1 to 6,
/// `elevation` degrees above the sample.
///
/// # Errors
///
/// When the scene cannot be built.
pub fn wrinkled(
    material: &Material,
    [light, elevation]: [u32; 2],
    size: Size,
    spp: u32,
    seed: u64,
) -> anyhow::Result<Film> {
    let settings = [
        format!("lights.0.rig.only={light}"),
        format!("lights.0.rig.elevation_deg={elevation}"),
        format!("film.size=[{},{}]", size.width(), size.height()),
    ];
    let settings = settings.iter().map(|text| text.parse().map_err(anyhow::Error::msg));
    let settings: Vec<_> = settings.collect::<Result<_, _>>()?;
    let Source::Scene(file, folder) = source::read(Path::new("scene:wrinkled"), &settings)? else {
        bail!("scene:wrinkled: found a cloth, expected a scene");
    };
    let mut scene = file.build(&folder, None)?.scene;
    scene.replace_cloth(material);
    Ok(draw(&scene, size, spp, seed))
}

fn draw(scene: &Scene, size: Size, spp: u32, seed: u64) -> Film {
    let limits = Limits { spp, time: None, noise: None };
    expose(scene, Frame::whole(size), limits, seed, None).beauty()
}

/// The weave as a drawdown of `size`, `pixels` wide and high for each crossing: the colours of the threads
/// on top, end 1 at the left and pick 1 at the lower edge.
pub fn drawdown(cloth: &Cloth, size: Size, pixels: u32) -> Film {
    let mut film = Film::black(size);
    let (width, height) = (size.width(), size.height());
    for (index, color) in film.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (index as u32 % width, height - 1 - index as u32 / width);
        let [end, pick] = [x / pixels, y / pixels].map(i64::from);
        let weave = &cloth.weave;
        let thread = |index: i64, count: u32| (index % i64::from(count.max(1))) as usize;
        let yarn = if weave.warp_on_top(end, pick) {
            cloth.end_yarns.get(thread(end, weave.ends()))
        } else {
            cloth.pick_yarns.get(thread(pick, weave.picks()))
        };
        let yarn = yarn.and_then(|&yarn| cloth.yarns.get(usize::from(yarn)));
        // A line between threads.
        let is_edge = pixels > 3 && (x % pixels == 0 || y % pixels == 0);
        *color = yarn.map_or(Vec3::ZERO, |yarn| Vec3::from(yarn.color))
            * if is_edge { 0.5 } else { 1.0 };
    }
    film
}

/// The mean brightness of each pixel of a row from column `from` to `to`, over `rows` rows about the height
/// `at`, all as shares of the picture's sides; each with its place.
pub fn along_row(film: &Film, at: f64, [from, to]: [f64; 2], rows: u32) -> Vec<[f64; 2]> {
    let (width, height) = (film.size().width(), film.size().height());
    let middle = (at * f64::from(height)) as u32;
    let first = middle.saturating_sub(rows / 2).min(height - 1);
    let last = (first + rows.max(1)).min(height);
    let columns = (from * f64::from(width)) as u32..((to * f64::from(width)) as u32).min(width);
    columns
        .map(|column| {
            let pixels = (first..last).map(|row| film.pixels()[(row * width + column) as usize]);
            let sum: f64 = pixels.map(luminance).sum();
            let place = (f64::from(column) + 0.5) / f64::from(width);
            [place, sum / f64::from(last - first)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use selvedge_yarn_brdf::{Thread, Weave, Yarn};

    use super::*;

    #[test]
    fn drawdown_shows_the_thread_on_top() {
        let weave = Weave::new(2, 2, |end, pick| end == pick).unwrap();
        let thread = |grey: f32| Thread { color: [grey; 3], ..Thread::default() };
        let (ends, picks) = ([thread(0.8); 2], [thread(0.1); 2]);
        let cloth = Cloth::from_threads(weave, &ends, &picks, &Yarn::default()).unwrap();
        let film = drawdown(&cloth, Size::new(4, 2).unwrap(), 1);
        let shown: Vec<_> = film.pixels().iter().map(|color| color.x).collect();
        // Pick 1 is the lower row.
        assert_eq!(shown, [0.1, 0.8, 0.1, 0.8, 0.8, 0.1, 0.8, 0.1]);
    }

    #[test]
    fn row_is_the_mean_over_its_height() {
        let mut film = Film::black(Size::new(10, 10).unwrap());
        for (index, color) in film.pixels_mut().iter_mut().enumerate() {
            *color = Vec3::splat((index / 10) as f32);
        }
        let row = along_row(&film, 0.5, [0.2, 0.6], 3);
        assert_eq!(row.len(), 4);
        // Rows 4, 5 and 6.
        assert!(row.iter().all(|[_, value]| (value - 5.0).abs() < 1e-6), "{row:?}");
        assert!((row[0][0] - 0.25).abs() < 1e-12, "{row:?}");
    }
}
