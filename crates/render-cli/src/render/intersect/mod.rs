//! What a ray hits: a bounding volume hierarchy over all triangles of the scene and a watertight
//! ray/triangle test.
//!
//! Watertight means that a ray cannot pass between two triangles that share an edge or a vertex.
//! That takes two things: the test of Woop, Benthin & Wald 2013, whose edge functions have the
//! same bits seen from either side of an edge, and boxes larger than their triangles by more than
//! the rounding of the box test ([`Geometry::resolution`]).

use fearless_simd::{Level, Simd, dispatch};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use thiserror::Error;

use self::{
    packet::{KINDS, PACKET, Packet, kind},
    triangle::{BLOCK, Block, TriangleTest},
    wide::{Bounds, BoxTest, MAX_DEPTH, NO_BOX, Wide, lanes},
};
use crate::scene::mesh::Mesh;

mod packet;
mod triangle;
mod wide;

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

/// The limit below which hits at `t` are still looked at.
fn just_beyond(t: f32) -> f32 {
    t.next_up()
}

/// All triangles of a scene, ready for rays.
///
/// The hierarchy is built on one thread: equal meshes give equal bits. It holds its own copy of
/// the positions, so the meshes stay with the caller, who looks up shading data there.
///
/// Watertight for rays that start within four extents of the scene's origin: the rounding of the
/// box test grows with the distance and at last outgrows the padding.
pub struct Geometry {
    tree: Wide,
    /// By leaf of the tree.
    blocks: Vec<Block>,
    /// (mesh, triangle) of each triangle of a block.
    names: Vec<[(u32, u32); BLOCK]>,
    /// Greatest absolute coordinate, in metres.
    extent: f32,
    /// What the processor can do; results are the same bits at each level.
    level: Level,
}

/// Why meshes cannot be made into a [`Geometry`].
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
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
}

/// Nodes and leaves are numbered in 31 bits.
const MAX_TRIANGLES: usize = 1 << 28;

/// Far below √f32::MAX, as edge functions multiply two coordinates, and beyond any picture.
pub const MAX_COORDINATE: f32 = 1e7;

/// Padding of boxes and offset of rays, relative to the extent: 32 roundings of a coordinate. The
/// box test makes about 5 and the triangle test about 10.
const RESOLUTION: f32 = 1.0 / (1 << 19) as f32;

impl std::fmt::Debug for Geometry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Geometry")
            .field("blocks", &self.blocks.len())
            .field("extent", &self.extent)
            .finish_non_exhaustive()
    }
}

impl Geometry {
    /// The hierarchy over all triangles of `meshes`, which may be empty.
    ///
    /// # Errors
    ///
    /// [`GeometryError`] for 2²⁸ triangles and more, coordinates above 10⁷ m, or geometry so
    /// unevenly nested (some hundred equal triangles) that the hierarchy is deeper than 31 levels.
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

        let mut corners = Vec::with_capacity(count);
        let mut names = Vec::with_capacity(count);
        for (m, mesh) in meshes.iter().enumerate() {
            for t in 0..mesh.triangles().len() as u32 {
                let triangle = mesh.corners(t);
                if has_three_corners(triangle) {
                    corners.push(triangle);
                    names.push((m as u32, t));
                }
            }
        }
        let padding = Vec3A::splat(extent * RESOLUTION);
        let boxes: Vec<_> = corners
            .iter()
            .map(|corners| {
                let tight = Aabb::from_points(&corners.map(Vec3A::from));
                Bounds(Aabb::new(tight.min - padding, tight.max + padding))
            })
            .collect();
        let (tree, leaves) = Wide::new(&boxes);
        if tree.depth() > MAX_DEPTH {
            return Err(GeometryError::TooDeep(tree.depth()));
        }
        let present = |leaf: &[u32; BLOCK]| leaf.iter().filter(|&&i| i != NO_BOX).count();
        let block = |leaf: &[u32; BLOCK]| {
            Block::new(leaf[..present(leaf)].iter().map(|&i| corners[i as usize]))
        };
        let name = |&i: &u32| names.get(i as usize).copied().unwrap_or_default();
        Ok(Self {
            blocks: leaves.iter().map(block).collect(),
            names: leaves.iter().map(|leaf| leaf.each_ref().map(name)).collect(),
            tree,
            extent,
            level: Level::new(),
        })
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
        mut accept: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        self.visit(ray, [t_min, t_max], true, |hit| {
            if nearest.is_none_or(|nearest| hit.is_before(&nearest)) && accept(hit) {
                nearest = Some(*hit);
            }
            nearest.map_or(t_max, |hit| just_beyond(hit.t))
        });
        nearest
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
        mut accept: impl FnMut(&Hit) -> bool,
    ) -> bool {
        let mut occluded = false;
        self.visit(ray, [t_min, t_max], false, |hit| {
            occluded = occluded || accept(hit);
            if occluded { f32::NEG_INFINITY } else { t_max }
        });
        occluded
    }

    /// Calls `see` with hits between the limits, which answers up to where more are of interest.
    ///
    /// Which hits there are does not depend on the order in which boxes are looked at: those of a
    /// leaf whose box the ray meets, not before it enters the box. As rounding is monotone, whoever
    /// meets a box meets all that are around it.
    fn visit(
        &self,
        ray: &Ray,
        [t_min, t_max]: [f32; 2],
        is_ordered: bool,
        mut see: impl FnMut(&Hit) -> f32,
    ) {
        let Some(test) = TriangleTest::new(ray).filter(|_| t_min < t_max) else { return };
        let Some(root) = self.tree.root() else { return };
        let boxes = BoxTest::new(ray);
        dispatch!(self.level, simd => self.tree.traverse(
            simd,
            &boxes,
            root,
            [t_min, t_max],
            is_ordered,
            #[inline(always)]
            |leaf, entry, t_max| {
                self.visit_leaf(simd, &test, leaf, entry, [t_min, t_max], &mut see)
            },
        ));
    }

    /// The nearest hits of `rays`, each as [`Geometry::intersect`] finds it, in less time for rays that
    /// go similar ways: those that start close to each other should stand together.
    pub fn intersect_all(&self, rays: &[Ray], t_min: f32) -> Vec<Option<Hit>> {
        let mut nearest = vec![None; rays.len()];
        let rays: Vec<_> = rays.iter().map(|&ray| (ray, f32::INFINITY)).collect();
        self.visit_all(&rays, t_min, true, |ray, hit| {
            let nearest: &mut Option<Hit> = &mut nearest[ray];
            if nearest.is_none_or(|nearest| hit.is_before(&nearest)) {
                *nearest = Some(*hit);
            }
            nearest.map_or(f32::INFINITY, |hit| just_beyond(hit.t))
        });
        nearest
    }

    /// Whether anything that `accept` lets stand lies on each of `rays` nearer than its distance in
    /// metres, as [`Geometry::occluded_where`] finds it; `accept` sees hits with the number of the ray.
    pub fn occluded_all_where(
        &self,
        rays: &[(Ray, f32)],
        t_min: f32,
        mut accept: impl FnMut(usize, &Hit) -> bool,
    ) -> Vec<bool> {
        let mut occluded = vec![false; rays.len()];
        self.visit_all(rays, t_min, false, |ray, hit| {
            occluded[ray] = occluded[ray] || accept(ray, hit);
            if occluded[ray] { f32::NEG_INFINITY } else { rays[ray].1 }
        });
        occluded
    }

    /// As [`Geometry::visit`] for each of `rays`, up to a distance of its own; `see` is told which.
    fn visit_all(
        &self,
        rays: &[(Ray, f32)],
        t_min: f32,
        is_ordered: bool,
        mut see: impl FnMut(usize, &Hit) -> f32,
    ) {
        // Numbers of rays, by kind and then in their order.
        let kinds: Vec<_> = rays
            .iter()
            .map(|(ray, t_max)| kind(ray).filter(|_| t_min < *t_max).unwrap_or(KINDS))
            .collect();
        let mut ends = [0; KINDS + 1];
        kinds.iter().for_each(|&kind| ends[kind] += 1);
        let mut end = 0;
        for count in &mut ends {
            end += *count;
            *count = end;
        }
        let mut order = vec![0; rays.len()];
        for (number, &kind) in kinds.iter().enumerate().rev() {
            ends[kind] -= 1;
            order[ends[kind]] = number;
        }
        let sound = &order[..ends[KINDS]];
        let kinds = sound.chunk_by(|&a, &b| kinds[a] == kinds[b]);
        for numbers in kinds.flat_map(|kind| kind.chunks(PACKET)) {
            dispatch!(self.level, simd => {
                let packet = numbers.iter().map(#[inline(always)] |&number| rays[number]);
                Packet::new(simd, packet).visit(
                    simd,
                    self,
                    t_min,
                    is_ordered,
                    #[inline(always)]
                    |lane, hit| see(numbers[lane], hit),
                );
            });
        }
    }

    /// Calls `see` with the hits of one ray in a leaf whose box it enters at `entry`; returns its last
    /// answer, or `t_max`.
    #[inline(always)]
    fn visit_leaf<S: Simd>(
        &self,
        simd: S,
        test: &TriangleTest,
        leaf: usize,
        entry: f32,
        [t_min, mut t_max]: [f32; 2],
        mut see: impl FnMut(&Hit) -> f32,
    ) -> f32 {
        // Not before the box: t ≥ entry.
        let limits = [t_min.max(entry.next_down()), t_max];
        let Some(hits) = test.hits(simd, &self.blocks[leaf], limits) else { return t_max };
        for lane in lanes(hits.met) {
            let (mesh, triangle) = self.names[leaf][lane];
            let (t, barycentrics) = (hits.t[lane], hits.barycentrics(lane));
            t_max = see(&Hit { t, mesh, triangle, barycentrics });
        }
        t_max
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

/// Whether no two corners coincide. Triangles collapsed to a line between two points leave no gap,
/// and a heap of them in one place would make the hierarchy a list; one whose three corners merely
/// lie on a line may seal what rounding opens between its neighbours.
fn has_three_corners([a, b, c]: [Vec3; 3]) -> bool {
    a != b && b != c && c != a
}

#[cfg(test)]
mod tests;
