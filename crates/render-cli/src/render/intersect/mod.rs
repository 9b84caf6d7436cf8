//! What a ray hits, among all triangles of the scene.
//!
//! Watertight means that a ray cannot pass between two triangles that share an edge or a vertex.
//! That takes two things: the test of Woop, Benthin & Wald 2013, whose edge functions have the
//! same bits seen from either side of an edge, and boxes larger than their triangles by more than
//! the rounding of the box test ([`Geometry::resolution`]).
//!
//! With the feature `embree` that library finds the hits, nearly as tightly.

use glam::Vec3;
use thiserror::Error;

#[cfg(feature = "embree")]
use self::embree::Embree as Traversal;
#[cfg(not(feature = "embree"))]
use self::hierarchy::Hierarchy as Traversal;
use crate::scene::mesh::Mesh;

#[cfg(feature = "embree")]
mod embree;
#[cfg(any(test, not(feature = "embree")))]
mod hierarchy;

/// A half-line in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, in metres.
    pub origin: Vec3,
    /// Where it goes: unit length, so that t is a distance in metres.
    pub direction: Vec3,
}

impl Ray {
    /// The point at distance `t` in metres.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin in metres.
    pub t: f32,
    /// Which mesh, in the order given to [`Geometry::new`].
    pub mesh: u32,
    /// Which triangle of that mesh.
    pub triangle: u32,
    /// Weights of the triangle's corners at the hit: ≥ 0, sum 1 up to rounding.
    pub barycentrics: Vec3,
}

impl Hit {
    /// Whether it is the one that counts of two: the nearer, or of two at the same distance, as on an
    /// edge, the one of the lower number.
    fn is_before(&self, other: &Self) -> bool {
        let place = |hit: &Self| (hit.mesh, hit.triangle);
        self.t < other.t || self.t == other.t && place(self) < place(other)
    }
}

/// All triangles of a scene, ready for rays.
///
/// The hierarchy is built on one thread: equal meshes give equal bits. It holds its own copy of
/// the positions, so the meshes stay with the caller, who looks up shading data there.
///
/// Watertight for rays that start within four extents of the scene's origin: the rounding of the
/// box test grows with the distance and at last outgrows the padding. With the feature `embree`, a ray
/// passes through one in about a hundred vertices at which it is aimed exactly.
pub struct Geometry {
    traversal: Traversal,
    /// Greatest absolute coordinate, in metres.
    extent: f32,
}

/// Why meshes cannot be made into a [`Geometry`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum GeometryError {
    /// More triangles than the hierarchy can number.
    #[error("meshes: found {0} triangles, expected at most {MAX_TRIANGLES}")]
    TooManyTriangles(usize),
    /// A coordinate so large that the arithmetic of boxes and triangles would overflow.
    #[error("mesh {0}: found a coordinate above {MAX_COORDINATE} m, expected a smaller scene")]
    TooLarge(usize),
    /// The hierarchy is deeper than the stack that traverses it.
    #[error("meshes: found a bounding volume hierarchy of depth {0}, expected at most {MAX_DEPTH}")]
    TooDeep(usize),
    /// Embree does not work; why.
    #[cfg(feature = "embree")]
    #[error("Embree: found {0}, expected that it traces rays")]
    Library(String),
}

/// Nodes and leaves are numbered in 31 bits.
const MAX_TRIANGLES: usize = 1 << 28;

/// Levels of boxes that can be traversed.
const MAX_DEPTH: usize = 31;

/// Far below √f32::MAX, as edge functions multiply two coordinates, and beyond any picture.
pub const MAX_COORDINATE: f32 = 1e7;

/// Padding of boxes and offset of rays, relative to the extent: 32 roundings of a coordinate. The
/// box test makes about 5 and the triangle test about 10.
const RESOLUTION: f32 = 1.0 / (1 << 19) as f32;

impl std::fmt::Debug for Geometry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Geometry").field("extent", &self.extent).finish_non_exhaustive()
    }
}

impl Geometry {
    /// The hierarchy over all triangles of `meshes`, which may be empty.
    ///
    /// # Errors
    ///
    /// [`GeometryError`] for 2²⁸ triangles and more, coordinates above 10⁷ m, or geometry so
    /// unevenly nested (some hundred equal triangles) that the hierarchy is deeper than 31 levels; with
    /// the feature `embree`, where that library fails.
    pub fn new(meshes: &[&Mesh]) -> Result<Self, GeometryError> {
        let count = meshes.iter().map(|mesh| mesh.triangles().len()).sum();
        if count > MAX_TRIANGLES {
            return Err(GeometryError::TooManyTriangles(count));
        }
        let mut extent = 0.0_f32;
        for (index, mesh) in meshes.iter().enumerate() {
            for position in mesh.positions() {
                extent = extent.max(position.abs().max_element());
            }
            if extent > MAX_COORDINATE {
                return Err(GeometryError::TooLarge(index));
            }
        }
        Ok(Self { traversal: Traversal::new(meshes, extent * RESOLUTION)?, extent })
    }

    /// The nearest hit with `t_min` < t < `t_max`, in metres.
    ///
    /// Nothing is hit from an origin or in a direction that is not finite, nor when a limit is
    /// NaN. A triangle of which two corners coincide is never hit. Both sides of a triangle are.
    pub fn intersect(&self, ray: &Ray, t_min: f32, t_max: f32) -> Option<Hit> {
        self.intersect_where(ray, t_min, t_max, |_| true)
    }

    /// As [`Geometry::intersect`], among the hits that `accept` lets stand: a hit that it rejects
    /// (a gap in open cloth) does not exist for the ray.
    ///
    /// `accept` sees hits in no particular order, also such as turn out not to be the nearest, and
    /// each triangle at most once; its answer must depend on the hit alone.
    pub fn intersect_where(
        &self,
        ray: &Ray,
        t_min: f32,
        t_max: f32,
        accept: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        self.traversal.intersect_where(ray, [t_min, t_max], accept)
    }

    /// Whether anything lies on the ray with `t_min` < t < `t_max`, in metres.
    pub fn occluded(&self, ray: &Ray, t_min: f32, t_max: f32) -> bool {
        self.occluded_where(ray, t_min, t_max, |_| true)
    }

    /// As [`Geometry::occluded`], among the hits that `accept` lets stand.
    pub fn occluded_where(
        &self,
        ray: &Ray,
        t_min: f32,
        t_max: f32,
        accept: impl FnMut(&Hit) -> bool,
    ) -> bool {
        self.traversal.occluded_where(ray, [t_min, t_max], accept)
    }

    /// The nearest hits of `rays`, each as [`Geometry::intersect`] finds it, in less time for rays that
    /// go similar ways: those that start close to each other should stand together.
    pub fn intersect_all(&self, rays: &[Ray], t_min: f32) -> Vec<Option<Hit>> {
        self.traversal.intersect_all(rays, t_min)
    }

    /// Whether anything that `accept` lets stand lies on each of `rays` nearer than its distance in
    /// metres, as [`Geometry::occluded_where`] finds it; `accept` sees hits with the number of the ray.
    pub fn occluded_all_where(
        &self,
        rays: &[(Ray, f32)],
        t_min: f32,
        accept: impl FnMut(usize, &Hit) -> bool,
    ) -> Vec<bool> {
        self.traversal.occluded_all_where(rays, t_min, accept)
    }

    /// The greatest coordinate of all triangles, in metres.
    pub fn extent(&self) -> f32 {
        self.extent
    }

    /// The distance in metres below which positions in this scene are rounding: 2⁻¹⁹ of the
    /// greatest coordinate.
    pub fn resolution(&self) -> f32 {
        self.extent * RESOLUTION
    }

    /// `position` moved off its surface by [`Geometry::resolution`], to the side to which
    /// `direction` points: where a reflected, transmitted or shadow ray starts, so that it does
    /// not hit the triangle it leaves. `geometric_normal` is the unit normal of the flat triangle.
    pub fn offset(&self, position: Vec3, geometric_normal: Vec3, direction: Vec3) -> Vec3 {
        let side = geometric_normal.dot(direction);
        position + geometric_normal * self.resolution().copysign(side)
    }
}

#[cfg(test)]
mod tests;
