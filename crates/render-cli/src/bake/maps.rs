//! The texels of a tile, and what each map says of them.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    Tile, along_fibers,
    fit::{self, Class, Fits},
    upward,
};

/// What is seen in a texel: means over the yarn that covers it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Texel {
    /// Reflectance of the ground, linear.
    pub base: Vec3,
    /// Unit, tangent space, above the surface: x along u, y along v, z out of the cloth.
    pub normal: Vec3,
    /// Over the middle plane, m.
    pub height: f32,
    /// Square root of α, in [0, 1].
    pub roughness: f32,
    /// Twice the angle from u to the direction in which it is rougher, as a vector whose length is how
    /// much rougher it is there than across, in [0, 1].
    pub anisotropy: Vec2,
    /// F₀, linear.
    pub specular: Vec3,
    /// Part of light that does not go straight on, in [0, 1].
    pub opacity: f32,
    /// Part of the texel that yarn covers, in [0, 1].
    pub coverage: f32,
    /// Index of the type of yarn in its middle plus 1; 0 in a gap.
    pub yarn: u32,
    /// Whether that is an end.
    pub is_warp: bool,
}

/// What a map says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// Reflectance of the ground.
    BaseColor,
    /// Normal, +Y up (OpenGL).
    Normal,
    /// Height, from the lowest to the highest place.
    Height,
    /// Square root of α (Burley 2012).
    Roughness,
    /// Anisotropy (Burley 2012).
    Anisotropy,
    /// Angle from u to the direction in which it is rougher, counter-clockwise, in turns.
    Rotation,
    /// How much rougher along u than along v, for shaders that cannot turn: 0.5 is as much.
    AnisotropyUv,
    /// F₀.
    Specular,
    /// What does not go straight on.
    Opacity,
    /// Index of the type of yarn plus 1, as a whole number; 0 in a gap.
    YarnId,
    /// Base colour and opacity, as glTF has them in one.
    GltfBaseColor,
    /// Roughness in green, no metal in blue.
    GltfRoughness,
    /// Direction in red and green, strength in blue.
    GltfAnisotropy,
    /// F₀ as a colour, over the greatest of the tile.
    GltfSpecular,
}

impl Map {
    /// The maps that are for anyone, then those for glTF.
    pub const ALL: [Self; 14] = [
        Self::BaseColor,
        Self::Normal,
        Self::Height,
        Self::Roughness,
        Self::Anisotropy,
        Self::Rotation,
        Self::AnisotropyUv,
        Self::Specular,
        Self::Opacity,
        Self::YarnId,
        Self::GltfBaseColor,
        Self::GltfRoughness,
        Self::GltfAnisotropy,
        Self::GltfSpecular,
    ];

    /// Its file's name, without an extension.
    pub fn name(self) -> &'static str {
        match self {
            Self::BaseColor => "base_color",
            Self::Normal => "normal",
            Self::Height => "height",
            Self::Roughness => "roughness",
            Self::Anisotropy => "anisotropy",
            Self::Rotation => "anisotropy_rotation",
            Self::AnisotropyUv => "anisotropy_uv",
            Self::Specular => "specular",
            Self::Opacity => "opacity",
            Self::YarnId => "yarn_id",
            Self::GltfBaseColor => "gltf_base_color",
            Self::GltfRoughness => "gltf_roughness",
            Self::GltfAnisotropy => "gltf_anisotropy",
            Self::GltfSpecular => "gltf_specular",
        }
    }

    /// Whether it is for glTF alone, which has nothing but PNG.
    pub fn is_for_gltf(self) -> bool {
        matches!(
            self,
            Self::GltfBaseColor | Self::GltfRoughness | Self::GltfAnisotropy | Self::GltfSpecular
        )
    }

    /// Whether integers of it are colours for screens, sRGB, and not numbers.
    pub fn is_color(self) -> bool {
        matches!(self, Self::BaseColor | Self::GltfBaseColor | Self::GltfSpecular)
    }

    /// Components: 4 with an opacity, 1 for what is an index, 3 for all else, as some formats know no
    /// other pictures.
    pub fn components(self) -> usize {
        match self {
            Self::GltfBaseColor => 4,
            Self::YarnId => 1,
            _ => 3,
        }
    }
}

/// The texels of a tile, top row first.
#[derive(Clone, Debug)]
pub struct Maps {
    /// Of `width` columns.
    pub texels: Vec<Texel>,
    /// Columns.
    pub width: usize,
    /// Least and greatest height, m.
    pub height: [f32; 2],
    /// The greatest F₀ of any texel, at least that of plastics, 0.04.
    pub specular: f32,
    /// The mean of all texels, normal and heights included.
    pub mean: Texel,
}

impl Maps {
    /// What `tile` looks like with `points` by `points` points in each texel.
    pub fn new(tile: &Tile, fits: &Fits, points: u32) -> Self {
        let (width, height) = (tile.pixels.width() as usize, tile.pixels.height() as usize);
        let mut texels = vec![Texel::default(); width * height];
        let step = tile.size() / DVec2::new(width as f64, height as f64);
        texels.par_chunks_mut(width).enumerate().for_each(|(row, texels)| {
            for (column, texel) in texels.iter_mut().enumerate() {
                // From the lower left corner.
                let corner = DVec2::new(column as f64, (height - 1 - row) as f64);
                *texel = Texel::new(tile, fits, corner * step, step, points);
            }
        });
        let mean = mean(&texels);
        texels.par_iter_mut().filter(|texel| texel.coverage == 0.0).for_each(|texel| {
            // What filters mix into the edges of gaps.
            let Texel { base, specular, roughness, .. } = mean;
            *texel = Texel { base, specular, roughness, normal: Vec3::Z, ..*texel };
        });
        let covered = || texels.iter().filter(|texel| texel.coverage > 0.0);
        let low = covered().map(|texel| texel.height).fold(f32::INFINITY, f32::min);
        let high = covered().map(|texel| texel.height).fold(f32::NEG_INFINITY, f32::max);
        let range = if low <= high { [low, high] } else { [0.0; 2] };
        texels.iter_mut().filter(|texel| texel.coverage == 0.0).for_each(|texel| {
            texel.height = range[0];
        });
        let specular = texels.iter().map(|texel| texel.specular.max_element()).fold(0.04, f32::max);
        Self { texels, width, height: range, specular, mean }
    }

    /// What `map` says of `texel`: colours linear, all in [0, 1] but indices.
    pub fn value(&self, map: Map, texel: &Texel) -> [f32; 4] {
        let of = |v: Vec3, last: f32| [v.x, v.y, v.z, last];
        let even = |value: f32| [value, value, value, 1.0];
        let Texel { base, normal, anisotropy, opacity, .. } = *texel;
        match map {
            Map::BaseColor => of(base, 1.0),
            Map::GltfBaseColor => of(base, opacity),
            Map::Normal => of(0.5 * normal + 0.5, 1.0),
            Map::Height => {
                let [low, high] = self.height;
                even((texel.height - low) / (high - low).max(f32::MIN_POSITIVE))
            }
            Map::Roughness => even(texel.roughness),
            Map::Anisotropy => even(anisotropy.length()),
            Map::Rotation => even(texel.rotation() / TAU),
            Map::AnisotropyUv => even(0.5 + 0.5 * anisotropy.x),
            Map::Specular => of(texel.specular, 1.0),
            Map::Opacity => even(opacity),
            Map::YarnId => even(texel.yarn as f32),
            Map::GltfRoughness => of(Vec3::new(1.0, texel.alphas()[0].sqrt(), 0.0), 1.0),
            Map::GltfAnisotropy => {
                let [along, across] = texel.alphas();
                // α in the direction is 1 where the strength is, whose square counts.
                let strength = ((across - along) / (1.0 - along).max(1e-6)).clamp(0.0, 1.0).sqrt();
                let direction = Vec2::from_angle(texel.rotation());
                of((0.5 * direction + 0.5).extend(strength), 1.0)
            }
            Map::GltfSpecular => of(texel.specular / self.specular, 1.0),
        }
    }
}

impl Texel {
    fn new(tile: &Tile, fits: &Fits, corner: DVec2, step: DVec2, points: u32) -> Self {
        let mut sum = Self::default();
        let mut covered = 0.0;
        for index in 0..points * points {
            let within = DVec2::new((index % points).into(), (index / points).into()) + 0.5;
            let uv = corner + step * (within / f64::from(points));
            let point = tile.shader.yarn_at(uv);
            if index == (points * points) / 2 {
                sum.yarn = point.map_or(0, |point| u32::from(point.yarn) + 1);
                sum.is_warp = point.is_some_and(|point| point.segment.is_warp);
            }
            let Some(point) = point else { continue };
            let fit = fits.of(Class::of(&point));
            let (base, specular) = fit::colors(tile, &point, uv, &fit);
            // Rougher across the fibres.
            let along = along_fibers(&point);
            let across = along.perp();
            covered += 1.0;
            sum.base += base;
            sum.specular += specular;
            sum.normal += upward(point.normal.as_vec3());
            sum.height += tile.height(&point) as f32;
            sum.roughness += fit.roughness;
            // Not quite 0, so that the direction is known.
            sum.anisotropy += fit.anisotropy.max(1e-6) * across.rotate(across);
            sum.opacity += tile.cloth.yarns[usize::from(point.yarn)].opacity as f32;
        }
        let all = (points * points) as f32;
        let share = 1.0 / f32::max(covered, 1.0);
        Self {
            base: sum.base * share,
            specular: sum.specular * share,
            normal: upward(sum.normal),
            height: sum.height * share,
            roughness: sum.roughness * share,
            anisotropy: sum.anisotropy * share,
            opacity: sum.opacity / all,
            coverage: covered / all,
            yarn: sum.yarn,
            is_warp: sum.is_warp,
        }
    }

    /// The angle from u to the direction in which it is rougher, rad, in [0, 3π/2]: of all that say the
    /// same the one nearest to half a turn for the warp and to a quarter for the weft, so that it does
    /// not jump within a yarn.
    pub fn rotation(&self) -> f32 {
        let angle = 0.5 * self.anisotropy.y.atan2(self.anisotropy.x);
        let middle = if self.is_warp { PI } else { FRAC_PI_2 };
        angle + PI * ((middle - angle) / PI).round()
    }

    /// α where it is less and where it is more, as the anisotropy has it (Burley 2012).
    pub fn alphas(&self) -> [f32; 2] {
        let alpha = self.roughness * self.roughness;
        let aspect = (1.0 - 0.9 * self.anisotropy.length().min(1.0)).sqrt();
        [(alpha * aspect).min(1.0), (alpha / aspect).min(1.0)]
    }
}

/// The mean of all that is covered; opacity and coverage of all.
fn mean(texels: &[Texel]) -> Texel {
    let sum = |a: Texel, b: &Texel, share: f32| Texel {
        base: a.base + share * b.base,
        normal: a.normal + share * b.normal,
        height: a.height + share * b.height,
        roughness: a.roughness + share * b.roughness,
        anisotropy: a.anisotropy + share * b.anisotropy,
        specular: a.specular + share * b.specular,
        opacity: a.opacity + b.opacity,
        coverage: a.coverage + b.coverage,
        ..Texel::default()
    };
    // In parts, as a long sum of f32 loses its last terms.
    let parts = texels
        .chunks(4096)
        .map(|part| part.iter().fold(Texel::default(), |a, b| sum(a, b, b.coverage)));
    let sums = parts.fold(Texel::default(), |a, b| sum(a, &b, 1.0));
    let count = texels.len() as f32;
    let mean = sum(Texel::default(), &sums, 1.0 / sums.coverage.max(f32::MIN_POSITIVE));
    Texel { opacity: sums.opacity / count, coverage: sums.coverage / count, ..mean }
}
