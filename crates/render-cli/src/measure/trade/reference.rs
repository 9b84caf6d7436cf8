//! The picture that is taken for the true one: made once, and kept.

use std::{
    env,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use selvedge_yarn_brdf::{Cloth, Shader};

use super::{super::expose, Way, scene};
use crate::{
    image::{self, Format, Layer, Picture, compare::Pair},
    output::Destination,
    render::{detail::Level, film::Frame, hash::Fnv},
    scene::Scene,
};

/// A picture that is taken for the true one, and the scene that it shows.
#[derive(Debug)]
pub struct Reference {
    /// The picture.
    pub picture: Picture,
    /// What it shows.
    pub scene: Scene,
    /// The part of a picture of it.
    pub frame: Frame,
    /// Its own error: relMSE and FLIP that pictures have against it by its noise alone.
    pub relmse: f64,
    /// See `relmse`.
    pub flip: f64,
    /// Whether it was made earlier.
    pub is_old: bool,
}

/// Seeds of its halves, which no seed of a measurement is likely to be.
const SEEDS: [u64; 2] = [0x5e1f_ed6e_0000_0001, 0x5e1f_ed6e_0000_0002];

impl Reference {
    /// The cloth in the built-in scene with each thread shaded near, from two independent halves of `spp`
    /// samples per pixel each. Halves that were made before of all the same are read from `folder`, and
    /// new ones are left there if it can be written.
    ///
    /// # Errors
    ///
    /// When the cloth is not sound.
    pub fn new(
        cloth: &Cloth,
        frame: Frame,
        spp: u32,
        folder: Option<&Path>,
    ) -> anyhow::Result<Self> {
        let mut scene = scene(cloth.prepare()?)?;
        scene.detail.level = Level::Near;
        let (key, size) = (key(&scene, frame, spp), frame.crop_size());
        let mut is_old = true;
        let halves = SEEDS.map(|seed| {
            let file = folder.map(|folder| folder.join(format!("{key:016x}-{seed:016x}.exr")));
            let known = file.as_deref().and_then(|file| image::read(file).ok());
            if let Some(known) = known.filter(|known| known.size() == size) {
                return known;
            }
            is_old = false;
            let limits = Way::usual("", spp).limits;
            let picture = Picture::from_film(&expose(&scene, frame, limits, seed, None).beauty());
            if let Some(file) = file {
                keep(&picture, &file);
            }
            picture
        });
        let [a, b] = halves.each_ref().map(Picture::to_colors);
        let mean: Vec<_> = a.iter().zip(&b).map(|(a, b)| 0.5 * (*a + *b)).collect();
        let mut picture = Picture::new(size);
        picture.push(Layer::colors("", &mean));
        // The halves differ from each other by twice the variance of one, and their mean has half of it.
        let pair = Pair::new(&halves[0], &halves[1]).context("halves of a reference")?;
        let between = pair.comparison();
        let (relmse, flip) = (0.25 * between.relmse, 0.5 * between.flip);
        Ok(Self { picture, scene, frame, relmse, flip, is_old })
    }
}

/// A hash of all that the picture depends on.
fn key(scene: &Scene, frame: Frame, spp: u32) -> u64 {
    let mut hash = Fnv::default();
    let version = env!("CARGO_PKG_VERSION");
    write!(hash, "{version} {frame:?} {spp} {scene:?}").expect("a hash takes all");
    // What shaders are made of shows in what they do.
    for shader in scene.shaders() {
        write!(hash, "{:?}", divisors(shader)).expect("a hash takes all");
    }
    hash.finish()
}

fn divisors(shader: &Shader) -> Vec<Vec<f32>> {
    (0..).map_while(|yarn| shader.divisors(yarn)).collect()
}

/// Writes a half; where that is not possible, it is made again next time.
fn keep(picture: &Picture, file: &Path) {
    let Ok(bytes) = picture.encode(Format::Exr) else { return };
    if let Ok(destination) = Destination::new(file) {
        let _ = destination.write(|out| out.write_all(&bytes));
    }
}

/// The folder for such pictures, made if it is not there: `selvedge/references` in the user's folder for
/// what can be made again; `None` where there is none.
pub fn folder() -> Option<PathBuf> {
    let named = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let caches = named("XDG_CACHE_HOME")
        .or_else(|| named("LOCALAPPDATA"))
        .or_else(|| Some(named("HOME")?.join(".cache")))?;
    let folder = caches.join("selvedge").join("references");
    fs::create_dir_all(&folder).ok()?;
    Some(folder)
}
