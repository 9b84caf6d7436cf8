//! What speed costs in accuracy: one cloth, drawn in many ways, against one picture that is taken for
//! the true one.

pub mod normalization;
pub mod reference;
pub mod statistics;

use std::sync::{Arc, Mutex, PoisonError};

use selvedge_yarn_brdf::{Cloth, ClothError, Highlight, Instructions, Shader};

use self::{normalization::Search, reference::Reference};
use super::expose;
use crate::{
    image::{Picture, compare::Pair},
    memory,
    render::{
        accumulate::Accumulator,
        detail::{Level, Tier},
        progressive::Limits,
    },
    scene::{Material, Scene, SceneError, drape::DEFAULT_SIDE},
};

/// A way to draw a cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// What it is called.
    pub name: String,
    /// How places are shaded.
    pub tier: Tier,
    /// With which instructions, if not the best ones.
    pub instructions: Option<Instructions>,
    /// Whether a highlight that the cloth draws by a window is one of rough fibres instead, and the other
    /// way round.
    pub is_other_highlight: bool,
    /// At which level of detail.
    pub level: Level,
    /// How the factor of the highlight is sought, if not by quadrature.
    pub search: Option<Search>,
    /// When drawing ends.
    pub limits: Limits,
}

impl Way {
    /// As `selvedge render` draws it, with so many samples per pixel.
    pub fn usual(name: &str, spp: u32) -> Self {
        Self {
            name: name.to_owned(),
            tier: Tier::default(),
            instructions: None,
            is_other_highlight: false,
            level: Level::default(),
            search: None,
            limits: Limits { spp, time: None, noise: None },
        }
    }
}

/// What a picture has cost, and how far it is from the true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples per pixel, mean over the picture.
    pub spp: f64,
    /// Time, s.
    pub seconds: f64,
    /// mean((a − b)² / (b² + 0.01)).
    pub relmse: f64,
    /// Mean of FLIP.
    pub flip: f64,
    /// Greatest difference of a component.
    pub max: f64,
}

/// The points of one run in the order of their samples, and its memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// After each pass; of adaptive ones only the last.
    pub points: Vec<Point>,
    /// Samples of all pixels.
    pub samples: u64,
    /// Most bytes of memory that the process held meanwhile, where the system tells.
    pub peak_bytes: Option<u64>,
}

/// Half width of the window that takes the place of rough fibres (Nelson, McEvoy & Fratarcangeli 2016,
/// the authors' program), and the roughness that takes the place of a window.
const DELTA: f64 = 0.3;
const SIGMA: f64 = 0.15;

/// The shader of `cloth` as `way` has it, but for the search of its factors.
///
/// # Errors
///
/// When the cloth is not sound.
pub fn prepare(cloth: &Cloth, way: &Way) -> Result<Shader, ClothError> {
    let mut cloth = cloth.clone();
    if way.is_other_highlight {
        for yarn in &mut cloth.yarns {
            yarn.highlight = match yarn.highlight {
                Highlight::Rough { .. } => Highlight::Window { delta: DELTA },
                Highlight::Window { .. } => Highlight::Rough { sigma: SIGMA },
            };
        }
    }
    let mut shader = cloth.prepare()?;
    if let Some(instructions) = way.instructions {
        shader.use_instructions(instructions);
    }
    Ok(shader)
}

/// The built-in scene, whose cloth is `shader`'s until [`draw`] replaces it.
///
/// # Errors
///
/// As [`Scene::built_in`].
pub fn scene(shader: Shader) -> Result<Scene, SceneError> {
    Scene::built_in(Material::cloth(shader), DEFAULT_SIDE)
}

/// The cloth of a shader that others hold too.
pub fn woven(shader: &Arc<Shader>) -> Material {
    Material::Cloth { shader: shader.clone(), is_open: shader.has_gaps() }
}

/// Draws `shader`'s cloth in the place of the reference's as `way` has it, and compares it with the
/// reference after each pass. The time of comparing does not count.
pub fn draw(reference: &mut Reference, shader: &Arc<Shader>, way: &Way, seed: u64) -> Run {
    let Reference { scene, picture: truth, frame, .. } = reference;
    scene.dress(&woven(shader));
    scene.tier = way.tier;
    scene.detail.level = way.level;
    let points = Mutex::new(Vec::new());
    let study = |accumulator: &Accumulator| {
        let point = compare(accumulator, truth);
        points.lock().unwrap_or_else(PoisonError::into_inner).push(point);
    };
    memory::reset_peak();
    let accumulator = expose(scene, *frame, way.limits, seed, Some(&study));
    let peak_bytes = memory::peak();
    let mut points = points.into_inner().unwrap_or_else(PoisonError::into_inner);
    if way.limits.noise.is_some() {
        points = points.split_off(points.len().saturating_sub(1));
    }
    Run { points, samples: accumulator.samples(), peak_bytes }
}

fn compare(accumulator: &Accumulator, truth: &Picture) -> Point {
    let size = truth.size();
    let picture = Picture::from_film(&accumulator.beauty());
    let pair = Pair::new(&picture, truth).expect("both have the size of the true one");
    let comparison = pair.comparison();
    let pixels = f64::from(size.width()) * f64::from(size.height());
    Point {
        spp: accumulator.samples() as f64 / pixels,
        seconds: accumulator.elapsed.as_secs_f64(),
        relmse: comparison.relmse,
        flip: comparison.flip,
        max: comparison.max,
    }
}
