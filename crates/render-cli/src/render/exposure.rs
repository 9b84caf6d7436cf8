//! What one sample of a pixel shows.

use glam::{Vec2, Vec3};

/// The light that one sample of a pixel gathers, and the surface that it sees first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exposure {
    /// Radiance, linear RGB: what the picture is the mean of.
    pub radiance: Vec3,
    /// Of it, what the first surface scatters by its diffuse lobe; what is seen without a surface
    /// between is in neither.
    pub diffuse: Vec3,
    /// And what it scatters otherwise.
    pub specular: Vec3,
    /// The surface; `None` where the sample sees none.
    pub first: Option<FirstHit>,
}

/// The surface that a sample of a pixel sees first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// The share of white light from all around that it scatters to the camera, linear RGB.
    pub albedo: Vec3,
    /// Shading normal on the side that is seen, unit, world space.
    pub normal: Vec3,
    /// Tangent, unit, world space: the fibres' on cloth, else ∂P/∂u.
    pub tangent: Vec3,
    /// Distance from the camera, m.
    pub distance: f32,
    /// Cloth coordinates, m.
    pub uv: Vec2,
    /// The piece of cloth's yarn.
    pub yarn: Option<YarnSeen>,
}

/// A yarn of a cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct YarnSeen {
    /// Its number over all repeats, modulo 2³¹, twice, plus 1 for an end.
    pub id: u32,
    /// Index of its type.
    pub kind: u16,
}

/// Something that pictures are taken of. Equal arguments give equal bits.
pub trait Expose: Sync {
    /// The sample `index` of the pixel at column and row `pixel` of the whole picture. From
    /// [`MAX_SAMPLES`](super::sampler::MAX_SAMPLES) on, the samples are independent of those before.
    fn expose(&self, pixel: [u32; 2], index: u32) -> Exposure;

    /// The samples `index` of `pixels`, the same as one by one, in what may be less time.
    fn expose_all(&self, pixels: &[[u32; 2]], index: u32) -> Vec<Exposure> {
        pixels.iter().map(|&pixel| self.expose(pixel, index)).collect()
    }
}
