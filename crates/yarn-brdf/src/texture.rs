//! `Texture`: parameters that change from place to place.

use core::fmt;
use std::sync::Arc;

use glam::DVec2;

use crate::yarn::Yarn;

/// A picture that gives a parameter of a yarn its value at a place of the cloth.
pub trait Texture: fmt::Debug + Send + Sync {
    /// Linear RGB, or a number in all three components, at `uv` (m along the cloth; u along the
    /// weft, v along the warp), averaged over about `footprint` (m), infinite for the mean of all.
    ///
    /// Equal arguments give equal values. What is out of range is moved to its limit.
    fn value(&self, uv: DVec2, footprint: f64) -> [f32; 3];

    /// The least and the greatest value of any component: what the normalization must hold for.
    fn range(&self) -> [f32; 2];
}

/// What a texture determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Target {
    /// [`Yarn::color`](crate::Yarn::color), looked up at the point.
    Color,
    /// [`Yarn::specular`](crate::Yarn::specular), looked up at the point.
    Specular,
    /// The parameter of this name in [`Yarn::parameters`](crate::Yarn::parameters), looked up in the
    /// middle of the segment, so that it does not change within one. `size` and `noise.…` stay as
    /// they are.
    Parameter(&'static str),
}

/// A texture in use.
#[derive(Clone, Debug)]
pub struct Textured {
    /// Index of the type of yarn.
    pub yarn: u16,
    /// What it determines.
    pub target: Target,
    /// The texture.
    pub texture: Arc<dyn Texture>,
}

/// The textures of a [partial yarn](crate::PartialYarn), at most one for each target.
///
/// Equal are those of the same targets that share their pictures.
#[derive(Clone, Debug, Default)]
pub struct Textures(Vec<(Target, Arc<dyn Texture>)>);

impl PartialEq for Textures {
    fn eq(&self, other: &Self) -> bool {
        let same =
            |((a, x), (b, y)): (&(Target, Arc<_>), &(Target, Arc<_>))| a == b && Arc::ptr_eq(x, y);
        self.0.len() == other.0.len() && self.0.iter().zip(&other.0).all(same)
    }
}

impl Textures {
    /// Lets `texture` determine `target`, in place of what did.
    pub fn set(&mut self, target: Target, texture: Arc<dyn Texture>) {
        self.retain(|found| found != target);
        self.0.push((target, texture));
    }

    /// What determines `target`, if something does.
    pub fn of(&self, target: Target) -> Option<&Arc<dyn Texture>> {
        self.iter().find(|(found, _)| *found == target).map(|(_, texture)| texture)
    }

    /// All of them, in the order in which they were set.
    pub fn iter(&self) -> impl Iterator<Item = (Target, &Arc<dyn Texture>)> {
        self.0.iter().map(|(target, texture)| (*target, texture))
    }

    pub(crate) fn retain(&mut self, keeps: impl Fn(Target) -> bool) {
        self.0.retain(|(target, _)| keeps(*target));
    }

    /// Gives `yarn` the mean of each: what it is where nobody looks up a place.
    pub(crate) fn set_means(&self, yarn: &mut Yarn) {
        for (target, texture) in self.iter() {
            let mean = texture.value(DVec2::ZERO, f64::INFINITY);
            match target {
                Target::Color => yarn.color = mean.map(|value| value.clamp(0.0, 1.0)),
                Target::Specular => yarn.specular = mean.map(|value| value.clamp(0.0, 1.0)),
                Target::Parameter(name) => {
                    if let Some(parameter) = Yarn::parameter(name) {
                        let value = f64::from(mean[0]).clamp(parameter.low, parameter.high);
                        parameter.set(yarn, value);
                    }
                }
            }
        }
    }
}

/// A highlight that takes the colour of its yarn in part, where one of them is a picture:
///
/// ```text
/// specular · (1 − tint + tint · color)
/// ```
#[derive(Debug)]
pub(crate) struct Tinted {
    pub(crate) specular: Reflected,
    pub(crate) color: Reflected,
    pub(crate) tint: f64,
}

/// A reflectance, the same everywhere or not.
#[derive(Debug)]
pub(crate) enum Reflected {
    Even([f32; 3]),
    Picture(Arc<dyn Texture>),
}

impl Reflected {
    /// What `texture` tells, or `even` if there is none.
    pub(crate) fn new(texture: Option<&Arc<dyn Texture>>, even: [f32; 3]) -> Self {
        texture.map_or(Self::Even(even), |texture| Self::Picture(Arc::clone(texture)))
    }

    fn value(&self, uv: DVec2, footprint: f64) -> [f32; 3] {
        let value = match self {
            Self::Even(value) => *value,
            Self::Picture(texture) => texture.value(uv, footprint),
        };
        value.map(|value| value.clamp(0.0, 1.0))
    }

    fn range(&self) -> [f32; 2] {
        let range = match self {
            Self::Even([r, g, b]) => [r.min(*g).min(*b), r.max(*g).max(*b)],
            Self::Picture(texture) => texture.range(),
        };
        range.map(|limit| limit.clamp(0.0, 1.0))
    }
}

/// What a `tint` makes of one component.
pub(crate) fn tinted(specular: f32, color: f32, tint: f64) -> f32 {
    specular * (1.0 - tint + tint * f64::from(color)) as f32
}

impl Texture for Tinted {
    fn value(&self, uv: DVec2, footprint: f64) -> [f32; 3] {
        let specular = self.specular.value(uv, footprint);
        let color = self.color.value(uv, footprint);
        core::array::from_fn(|k| tinted(specular[k], color[k], self.tint))
    }

    fn range(&self) -> [f32; 2] {
        let (specular, color) = (self.specular.range(), self.color.range());
        // It grows with both.
        [0, 1].map(|k| tinted(specular[k], color[k], self.tint))
    }
}
