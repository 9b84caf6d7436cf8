//! The pictures of Nelson, McEvoy & Fratarcangeli 2016, but for the photographs.

pub mod sheet;
pub mod textured;

use std::path::{Path, PathBuf};

use anyhow::bail;
use glam::Vec3;
use selvedge_yarn_brdf::Cloth;

use super::expose;
use crate::{
    image::luminance,
    render::{
        film::{Film, Frame, Size},
        progressive::Limits,
    },
    scene::{
        Material, Scene, SceneError,
        drape::DEFAULT_SIDE,
        file::SceneFile,
        light::Lights,
        source::{self, Source},
    },
};

/// The mean [`luminance`] of all pixels.
pub fn mean_luminance(film: &Film) -> f64 {
    let sum: f64 = film.pixels().iter().map(|color| f64::from(luminance(*color))).sum();
    sum / film.pixels().len() as f64
}

/// A scene of which materials and lights are changed from picture to picture.
#[derive(Debug)]
pub struct Setup {
    scene: Scene,
    /// Samples per pixel.
    spp: u32,
    /// Chooses the noise.
    seed: u64,
}

impl Setup {
    /// The built-in scene, draped with `material`.
    ///
    /// # Errors
    ///
    /// As [`Scene::built_in`].
    pub fn draped(material: &Material, spp: u32, seed: u64) -> Result<Self, SceneError> {
        let scene = Scene::built_in(material.clone(), DEFAULT_SIDE)?;
        Ok(Self { scene, spp, seed })
    }

    /// The wrinkled sample of `scene:wrinkled`.
    ///
    /// # Errors
    ///
    /// When the scene cannot be built.
    pub fn wrinkled(spp: u32, seed: u64) -> anyhow::Result<Self> {
        let (file, folder) = wrinkled(&[])?;
        let scene = file.build(&folder, None)?.scene;
        Ok(Self { scene, spp, seed })
    }

    /// Lets one light of the six alone shine, 1 to 6, so many degrees above the sample.
    ///
    /// # Errors
    ///
    /// When there is no such light.
    pub fn light(&mut self, which: u32, elevation: u32) -> anyhow::Result<()> {
        let settings = [
            format!("lights.0.rig.only={which}"),
            format!("lights.0.rig.elevation_deg={elevation}"),
        ];
        let (file, folder) = wrinkled(&settings)?;
        let lights = file.lights.iter().map(|light| light.build(&folder, "lights"));
        let lights = lights.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        self.scene.lights = Lights::new(lights, self.scene.geometry().extent());
        Ok(())
    }

    /// A picture of it with `material` in the place of what is shown.
    pub fn picture(&mut self, material: &Material, size: Size) -> Film {
        self.scene.dress(material);
        let limits = Limits { spp: self.spp, time: None, noise: None };
        expose(&self.scene, Frame::whole(size), limits, self.seed, None).beauty()
    }
}

/// The file of `scene:wrinkled` with these settings, and the folder of its paths.
fn wrinkled(settings: &[String]) -> anyhow::Result<(SceneFile, PathBuf)> {
    let settings = settings.iter().map(|text| text.parse().map_err(anyhow::Error::msg));
    let settings: Vec<_> = settings.collect::<Result<_, _>>()?;
    match source::read(Path::new("scene:wrinkled"), &settings)? {
        Source::Scene(file, folder) => Ok((*file, folder)),
        Source::Cloth(_) => bail!("scene:wrinkled: found a cloth, expected a scene"),
    }
}

/// The weave as a drawdown of `size`, `pixels` wide and high for each crossing: the colours of the threads
/// on top, end 1 at the left and pick 1 at the lower edge, with a line along either side of each thread
/// where that is not too narrow.
pub fn drawdown(cloth: &Cloth, size: Size, pixels: u32) -> Film {
    let mut film = Film::black(size);
    let (width, height) = (size.width(), size.height());
    let pixels = pixels.max(1);
    for (index, color) in film.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (index as u32 % width, height - 1 - index as u32 / width);
        let [end, pick] = [x / pixels, y / pixels];
        let weave = &cloth.weave;
        let (yarn, across) = if weave.warp_on_top(end.into(), pick.into()) {
            (cloth.end_yarns.get((end % weave.ends()) as usize), x)
        } else {
            (cloth.pick_yarns.get((pick % weave.picks()) as usize), y)
        };
        let is_edge = pixels > 3 && across % pixels == 0;
        let yarn = yarn.and_then(|&yarn| cloth.yarns.get(usize::from(yarn)));
        let shade = if is_edge { 0.3 } else { 1.0 };
        *color = yarn.map_or(Vec3::ZERO, |yarn| Vec3::from(yarn.color)) * shade;
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
            let sum: f64 = pixels.map(|color| f64::from(luminance(color))).sum();
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
