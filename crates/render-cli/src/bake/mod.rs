//! Maps of a cloth for programs that know no cloth: pictures that tile, and a material for each format.
//!
//! ```text
//! Cloth ──▶ Tile ─┬─ fit ──▶ Fits ─┐
//!                 └────────────────┴─ maps ──▶ Maps ──files──▶ PNG, EXR
//!                                   └──▶ materialx, gltf, u3m, report ──▶ text
//! ```
//!
//! A tile is a whole number of repeats, its lower left corner where end 1 and pick 1 begin. What is
//! irregular along a thread would not meet itself at the other edge of the tile: it is left out, grains
//! of the highlight and differences between threads stay.

pub mod files;
pub mod fit;
pub mod gltf;
pub mod maps;
pub mod materialx;
pub mod report;
pub mod u3m;

use glam::{DVec2, Vec2, Vec3};
use selvedge_yarn_brdf::{Cloth, ClothError, Noise, Shader, YarnPoint};

use crate::render::film::Size;

/// A piece of cloth that repeats over the plane, and the pictures that are made of it.
#[derive(Debug)]
pub struct Tile {
    /// The cloth, without what does not repeat and without rotation.
    pub cloth: Cloth,
    /// The same, ready to be shaded.
    pub shader: Shader,
    /// Whole repeats along u and v.
    pub repeats: [u32; 2],
    /// Of the pictures.
    pub pixels: Size,
    /// Whether irregularities had to be left out.
    pub is_evened: bool,
}

impl Tile {
    /// The tile of so many repeats of `cloth`.
    ///
    /// # Errors
    ///
    /// As for [`Cloth::prepare`].
    pub fn new(mut cloth: Cloth, repeats: [u32; 2], pixels: Size) -> Result<Self, ClothError> {
        let mut is_evened = false;
        for yarn in &mut cloth.yarns {
            let noise = yarn.noise;
            let Noise { intensity, fineness, color, .. } = noise;
            yarn.noise = Noise { intensity, fineness, color, ..Noise::default() };
            is_evened |= noise.u_max > 0.0
                || noise.width > 0.0
                || noise.offset > 0.0
                || (noise.slub_rate > 0.0 && noise.slub_height > 0.0);
        }
        cloth.rotation = 0.0;
        let shader = cloth.prepare()?;
        Ok(Self { cloth, shader, repeats, pixels, is_evened })
    }

    /// Width along u and height along v, m.
    pub fn size(&self) -> DVec2 {
        let repeats = DVec2::from(self.repeats.map(f64::from));
        self.cloth.size() / self.cloth.scale * repeats
    }

    /// Threads along u and v.
    pub fn threads(&self) -> [u32; 2] {
        [self.cloth.weave.ends() * self.repeats[0], self.cloth.weave.picks() * self.repeats[1]]
    }

    /// Width, m, of the thread on which `point` is.
    fn diameter(&self, point: &YarnPoint) -> f64 {
        let pitch = self.cloth.pitch / self.cloth.scale;
        point.segment.width * if point.segment.is_warp { pitch.x } else { pitch.y }
    }

    /// Height of the yarn at `point` over the middle plane of the cloth, m.
    ///
    /// That of the bent cylinder of radius a about an arc of radius R = (l/2 − a sin u_max)/sin u_max,
    /// whose normals the shading has (Irawan & Marschner 2012, section 4), taken for a circle:
    ///
    /// ```text
    /// z = R (cos u − cos u_max) + a cos u cos v
    /// ```
    ///
    /// A thread in a slit lies lower by its own radius.
    fn height(&self, point: &YarnPoint) -> f64 {
        let segment = &point.segment;
        let pitch = self.cloth.pitch / self.cloth.scale;
        let half = 0.5 * segment.length * if segment.is_warp { pitch.y } else { pitch.x };
        let radius = 0.5 * self.diameter(point);
        let (cos_u, cos_v) = (point.u.cos(), point.v.cos());
        if segment.is_straight() {
            return radius * (cos_v - 1.0);
        }
        let yarn = &self.cloth.yarns[usize::from(point.yarn)];
        // Never steeper than the arc has room for, as the shading has it.
        let sin_max = yarn.u_max.sin().min(half / radius).max(1e-9);
        let cos_max = (1.0 - sin_max * sin_max).max(0.0).sqrt();
        let arc = (half / sin_max - radius).max(0.0);
        arc * (cos_u - cos_max).max(0.0) + radius * cos_u * cos_v
    }
}

/// Least z of a normal whose axes are looked for, as the maps of 8 bits tell little below.
const LEAST_Z: f32 = 0.01;

/// The direction along the fibres as a surface without the normal map has it: the unit vector of the
/// plane that becomes the tangent of the fibres when it is made orthogonal to the normal.
///
/// So do renderers: they turn the tangent in the plane, then make it orthogonal to what the normal map
/// says.
fn along_fibers(point: &YarnPoint) -> Vec2 {
    let (normal, tangent) = (point.normal.as_vec3(), point.tangent.as_vec3());
    let level = tangent - normal * (tangent.z / normal.z.max(LEAST_Z));
    let fallback = if point.segment.is_warp { Vec2::Y } else { Vec2::X };
    level.truncate().normalize_or(fallback)
}

/// Above the surface and of unit length.
fn upward(normal: Vec3) -> Vec3 {
    let normal = normal.normalize_or(Vec3::Z);
    normal.with_z(normal.z.max(LEAST_Z)).normalize()
}
