//! The scenes of a cloth: woven, as pictures of it, and plainly diffuse.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use glam::Vec3;
use selvedge_yarn_brdf::{Highlight, Noise, Yarn};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::{
    bake::{
        Tile, files,
        fit::{FarError, Fits},
        maps::{Map, Maps},
    },
    fabric::{self, PRESET},
    render::film::Size,
    scene::source,
};

/// Texels to a thread, at least.
pub(super) const TEXELS: u32 = 10;

/// What the wrinkled sample is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shader {
    Cloth,
    Texture,
    Diffuse,
}

impl Shader {
    pub(super) const ALL: [Self; 3] = [Self::Cloth, Self::Texture, Self::Diffuse];

    /// As reports call it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Cloth => "cloth",
            Self::Texture => "texture",
            Self::Diffuse => "diffuse",
        }
    }
}

/// How a scene departs from the usual one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variant {
    /// Even yarns, maps of full size.
    Usual,
    /// Maps of a quarter of the width and height.
    SmallMaps,
    /// A sample eight times as large, from eight times as far.
    Far,
    /// Irregular yarns, as in the fabric.
    Noise,
    /// Yarns twisted by 30° whose highlight is drawn.
    Twisted,
}

impl Variant {
    /// The cases that are bad for cloth.
    pub(super) const BAD: [Self; 4] = [Self::SmallMaps, Self::Far, Self::Noise, Self::Twisted];

    /// As reports call it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Usual => "usual",
            Self::SmallMaps => "maps of a quarter of the side",
            Self::Far => "camera 8 times as far",
            Self::Noise => "irregular yarns",
            Self::Twisted => "twisted yarns",
        }
    }
}

/// Files of maps and scenes, gone with this.
#[derive(Debug)]
pub(super) struct Scenes {
    folder: TempDir,
    /// The cloth as scenes name it.
    fabric: String,
    /// Width and height of the pictures.
    size: u32,
    tile_size: [f64; 2],
    mean: [f32; 3],
    /// Texels to a thread, along u and v.
    pub(super) texels: [f64; 2],
    /// What is wrong with the material, seen from afar.
    pub(super) far: FarError,
    /// What the reflectances were multiplied by to be as bright here as the cloth.
    pub(super) gain: f32,
}

/// The maps, their components and names.
const MAPS: [(Map, usize, &str); 5] = [
    (Map::BaseColor, 3, "base_color"),
    (Map::Normal, 3, "normal"),
    (Map::Roughness, 1, "roughness"),
    (Map::Specular, 3, "specular"),
    (Map::AnisotropyUv, 1, "anisotropy_map"),
];

/// Rounds in which the reflectances are adjusted.
const ROUNDS: usize = 3;

impl Scenes {
    /// Bakes the maps of `input`, `side` pixels wide and high, and writes what scenes of pictures of `size`
    /// pixels need. `mean` draws a scene's file and returns how bright it is.
    ///
    /// # Errors
    ///
    /// When the cloth cannot be read or baked, or files cannot be written.
    pub(super) fn new(
        input: &Path,
        side: u32,
        size: u32,
        mean: impl Fn(&Path) -> anyhow::Result<f32>,
    ) -> anyhow::Result<Self> {
        let source = fabric::read(input)?;
        let drawdown = source.draft().drawdown()?;
        let mut cloth = source.cloth(&drawdown)?;
        cloth.yarns.iter_mut().for_each(|yarn| yarn.noise = Noise::default());
        let repeats =
            [cloth.weave.ends(), cloth.weave.picks()].map(|n| (side / (TEXELS * n)).max(1));
        let folder = tempfile::tempdir().context("temporary folder: cannot be made")?;
        let is_preset = input.to_str().is_some_and(|input| input.starts_with(PRESET));
        let fabric = if is_preset {
            input.display().to_string()
        } else {
            let path = input.canonicalize();
            let path = path.with_context(|| format!("{}: cannot be found", input.display()))?;
            path.display().to_string()
        };
        let twist = 30_f64.to_radians();
        let yarn = Yarn { psi: twist, highlight: Highlight::default(), ..Yarn::default() };
        fs::write(folder.path().join("twisted.json"), source.twisted(&yarn)?)?;

        let small = (side / 4).max(1);
        let mut tile = Tile::new(cloth, repeats, Size::new(small, small)?)?;
        let fits = Fits::new(&tile);
        // Four points to a texel: the edges of yarns are far apart.
        let mut maps = Maps::new(&tile, &fits, 2);
        let threads = tile.threads();
        let mut scenes = Self {
            fabric,
            size,
            tile_size: tile.size().to_array(),
            mean: [0.0; 3],
            texels: threads.map(|threads| f64::from(side) / f64::from(threads)),
            far: fits.far,
            gain: 1.0,
            folder,
        };
        let woven = mean(&scenes.scene(Shader::Cloth, Variant::Usual)?)?;
        let pictured = scenes.scene(Shader::Texture, Variant::SmallMaps)?;
        for _ in 0..ROUNDS {
            scenes.write(&tile, &maps, "small-")?;
            let ratio = woven / mean(&pictured)?.max(f32::MIN_POSITIVE);
            scenes.gain *= ratio;
            brighten(&mut maps, ratio);
        }
        scenes.write(&tile, &maps, "small-")?;
        tile.pixels = Size::new(side, side)?;
        let mut maps = Maps::new(&tile, &fits, 2);
        brighten(&mut maps, scenes.gain);
        scenes.write(&tile, &maps, "")?;
        scenes.mean = (maps.mean.base * maps.mean.opacity).to_array();
        Ok(scenes)
    }

    /// Writes all maps, their names after `prefix`.
    fn write(&self, tile: &Tile, maps: &Maps, prefix: &str) -> anyhow::Result<()> {
        for (map, components, name) in MAPS {
            let bytes = files::encode_bytes(tile, maps, map, components)?;
            fs::write(self.folder.path().join(format!("{prefix}{name}.png")), bytes)?;
        }
        Ok(())
    }

    /// Writes the scene of a shader, and returns its file.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub(super) fn scene(&self, shader: Shader, variant: Variant) -> anyhow::Result<PathBuf> {
        let text = source::built_in("wrinkled").expect("the scene is compiled in");
        let mut scene: Value = serde_json::from_str(text).expect("the scene is JSON");
        let prefix = if variant == Variant::SmallMaps { "small-" } else { "" };
        scene["materials"]["cloth"] = match shader {
            Shader::Cloth => {
                let fabric =
                    if variant == Variant::Twisted { "twisted.json" } else { &self.fabric };
                json!({ "cloth": { "fabric": fabric, "noise": variant == Variant::Noise } })
            }
            Shader::Texture => {
                let map = |(.., name): &(Map, usize, &str)| {
                    ((*name).to_owned(), json!(format!("{prefix}{name}.png")))
                };
                let mut standard: serde_json::Map<_, _> = MAPS.iter().map(map).collect();
                standard.insert("size".to_owned(), json!(self.tile_size));
                json!({ "standard": standard })
            }
            Shader::Diffuse => json!({ "diffuse": { "reflectance": self.mean } }),
        };
        // Threads are as many pixels wide as in the scene's own picture.
        let usual = scene["film"]["size"][0].as_f64().expect("the scene has a size");
        let nearer = f64::from(self.size) / usual;
        let factor = if variant == Variant::Far { FAR * nearer } else { nearer };
        scale(&mut scene["objects"][0]["shape"]["wrinkled"]["side"], factor);
        scale(&mut scene["camera"]["position"][2], factor);
        let path = self.folder.path().join(format!("{}-{variant:?}.json", shader.name()));
        fs::write(&path, serde_json::to_vec(&scene).expect("a value is JSON"))?;
        Ok(path)
    }
}

/// How much larger and farther away the sample is that is far.
const FAR: f64 = 8.0;

fn scale(number: &mut Value, factor: f64) {
    *number = json!(factor * number.as_f64().expect("the scene has a number there"));
}

/// Multiplies the reflectances of ground and coat, which stay such.
fn brighten(maps: &mut Maps, factor: f32) {
    let Maps { texels, mean, .. } = maps;
    for texel in texels.iter_mut().chain([mean]) {
        texel.base = (texel.base * factor).min(Vec3::ONE);
        texel.specular = (texel.specular * factor).min(Vec3::ONE);
    }
}
