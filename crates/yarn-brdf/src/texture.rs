//! `Texture`: parameters that change from place to place.

use core::fmt;
use std::sync::Arc;

use glam::DVec2;

/// A picture that gives a parameter of a yarn its value at a place of the cloth.
pub trait Texture: fmt::Debug + Send + Sync {
    /// Linear RGB, or a number in all three components, at `uv` (m along the cloth; u along the
    /// weft, v along the warp), averaged over about `footprint` (m).
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
