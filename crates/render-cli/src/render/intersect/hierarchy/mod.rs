//! Our own traversal: a bounding volume hierarchy of triangles in blocks, and packets of rays.

use fearless_simd::{Level, Simd, dispatch};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;

use self::{
    packet::{KINDS, PACKET, Packet, kind},
    triangle::{BLOCK, Block, TriangleTest, lanes},
    wide::{Bounds, BoxTest, NO_BOX, Wide},
};
use super::{GeometryError, Hit, MAX_DEPTH, Ray};
use crate::scene::mesh::Mesh;

mod packet;
mod triangle;
mod wide;

/// The limit below which hits at `t` are still looked at.
fn just_beyond(t: f32) -> f32 {
    t.next_up()
}

/// The triangles of some meshes, and the boxes around them.
pub(super) struct Hierarchy {
    tree: Wide,
    /// By leaf of the tree.
    blocks: Vec<Block>,
    /// (mesh, triangle) of each triangle of a block.
    names: Vec<[(u32, u32); BLOCK]>,
    /// What the processor can do; results are the same bits at each level.
    pub(super) level: Level,
}

impl Hierarchy {
    /// Over all triangles of `meshes`, with boxes larger than them by `padding` metres. It is built on
    /// one thread: equal meshes give equal bits.
    pub(super) fn new(meshes: &[&Mesh], padding: f32) -> Result<Self, GeometryError> {
        let count = meshes.iter().map(|mesh| mesh.triangles().len()).sum();
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
        let padding = Vec3A::splat(padding);
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
            level: Level::new(),
        })
    }

    /// See [`super::Geometry::intersect_where`].
    pub(super) fn intersect_where(
        &self,
        ray: &Ray,
        [t_min, t_max]: [f32; 2],
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

    /// See [`super::Geometry::occluded_where`].
    pub(super) fn occluded_where(
        &self,
        ray: &Ray,
        [t_min, t_max]: [f32; 2],
        mut accept: impl FnMut(&Hit) -> bool,
    ) -> bool {
        let mut occluded = false;
        self.visit(ray, [t_min, t_max], false, |hit| {
            occluded = occluded || accept(hit);
            if occluded { f32::NEG_INFINITY } else { t_max }
        });
        occluded
    }

    /// See [`super::Geometry::intersect_all`].
    pub(super) fn intersect_all(&self, rays: &[Ray], t_min: f32) -> Vec<Option<Hit>> {
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

    /// See [`super::Geometry::occluded_all_where`].
    pub(super) fn occluded_all_where(
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

    /// As [`Hierarchy::visit`] for each of `rays`, up to a distance of its own; `see` is told which.
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
}

/// Whether no two corners coincide. Triangles collapsed to a line between two points leave no gap,
/// and a heap of them in one place would make the hierarchy a list; one whose three corners merely
/// lie on a line may seal what rounding opens between its neighbours.
fn has_three_corners([a, b, c]: [Vec3; 3]) -> bool {
    a != b && b != c && c != a
}

#[cfg(test)]
pub(super) mod tests;
