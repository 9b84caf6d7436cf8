//! Up to sixteen rays that go similar ways, traced side by side.
//!
//! The children of a node are first tested against what all rays of the packet have in common: the
//! intervals of their origins and inverse directions. That leaves out only children that each ray by
//! itself would leave out, since rounding is monotone. What is left is tested by the arithmetic of
//! single rays, so the packet finds what they find, to the bit.

use std::cmp::Ordering;

use fearless_simd::{f32x8, f32x16, prelude::*};
use glam::Vec3;

use super::{
    Hierarchy, Hit, Ray,
    triangle::{BLOCK, TriangleTest, lanes, meet},
    wide::{BoxTest, SMALLEST, Stack, WIDTH, leaf, opposite, put_off},
};

/// Most rays of a packet.
pub(super) const PACKET: usize = 16;

/// Rays below a node up to which each goes on by itself.
const FEW: u32 = 3;

/// Number of [`kind`]s.
pub(super) const KINDS: usize = 24;

/// Which rays can be in one packet with `ray`, below [`KINDS`]: those with directions of the same
/// signs and with the same greatest component. `None` where [`TriangleTest::new`] is.
pub(super) fn kind(ray: &Ray) -> Option<usize> {
    let signs = ray.direction.cmplt(Vec3::splat(-SMALLEST)).bitmask() as usize;
    let z = ray.direction.abs().max_position();
    let is_sound = ray.origin.is_finite() && ray.direction.is_finite();
    (is_sound && (1.0 / ray.direction[z]).is_finite()).then_some(z * 8 + signs)
}

/// Rays of one [`kind`].
pub(super) struct Packet<S: Simd> {
    origin: [f32x16<S>; 3],
    inverse: [f32x16<S>; 3],
    /// As in [`TriangleTest`].
    axes: [usize; 3],
    shear: [f32x16<S>; 3],
    /// Up to where each ray is interested in hits; nowhere, if it is none.
    t_max: f32x16<S>,
    /// Row of a node's bounds that they meet first.
    near: [usize; 3],
    common: [Common; 3],
}

/// What the rays of a packet have in common along an axis.
#[derive(Clone, Copy)]
struct Common {
    /// Of their origins, the one from which the near side of a box is nearest, and the far side
    /// furthest.
    near_origin: f32,
    far_origin: f32,
    /// Least and greatest inverse.
    inverse: [f32; 2],
}

impl<S: Simd> Packet<S> {
    /// Of `rays` of the same kind, at least one and at most [`PACKET`], each with its limit.
    #[inline(always)]
    pub(super) fn new(simd: S, rays: impl ExactSizeIterator<Item = (Ray, f32)>) -> Self {
        let mut t_max = [f32::NEG_INFINITY; PACKET];
        let mut origins = [[0.0; PACKET]; 3];
        let mut directions = [[0.0; PACKET]; 3];
        let count = rays.len();
        let mut first = None;
        for (lane, (ray, limit)) in rays.enumerate() {
            first = first.or(Some(ray));
            t_max[lane] = limit;
            for axis in 0..3 {
                origins[axis][lane] = ray.origin[axis];
                directions[axis][lane] = ray.direction[axis];
            }
        }
        // Lanes without a ray repeat the first.
        for axis in 0..3 {
            for lane in count..PACKET {
                origins[axis][lane] = origins[axis][0];
                directions[axis][lane] = directions[axis][0];
            }
        }

        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let [mut origin, mut direction, mut inverse] = [[zero; 3]; 3];
        let mut near = [0; 3];
        let mut common = [Common { near_origin: 0.0, far_origin: 0.0, inverse: [0.0; 2] }; 3];
        for axis in 0..3 {
            origin[axis] = f32x16::simd_from(simd, origins[axis]);
            let d = f32x16::simd_from(simd, directions[axis]);
            direction[axis] = d;
            let is_large = d.abs().simd_gt(f32x16::splat(simd, SMALLEST));
            inverse[axis] = is_large.select(one / d, f32x16::splat(simd, 1.0 / SMALLEST));
            let is_up = inverse[axis][0] > 0.0;
            near[axis] = if is_up { axis } else { axis + 3 };
            let (low, high) = (least(origin[axis]), greatest(origin[axis]));
            common[axis] = Common {
                near_origin: if is_up { high } else { low },
                far_origin: if is_up { low } else { high },
                inverse: [least(inverse[axis]), greatest(inverse[axis])],
            };
        }
        let z = first.map_or(0, |ray| ray.direction.abs().max_position());
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let shear = [
            direction[axes[0]] / direction[z],
            direction[axes[1]] / direction[z],
            one / direction[z],
        ];
        Self { origin, inverse, axes, shear, t_max: f32x16::simd_from(simd, t_max), near, common }
    }

    /// Calls `see` with hits of the rays, by their lane, between `t_min` and their limits, which
    /// answers up to where that ray is interested in more. Returns when none is.
    #[inline(always)]
    pub(super) fn visit(
        &mut self,
        simd: S,
        hierarchy: &Hierarchy,
        t_min: f32,
        is_ordered: bool,
        mut see: impl FnMut(usize, &Hit) -> f32,
    ) {
        let tree = &hierarchy.tree;
        let Some((_, mut node)) = tree.root() else { return };
        let mut stack = Stack::<(u32, u32)>::new();
        let mut limit = greatest(self.t_max);
        'nodes: loop {
            let bounds = &tree.nodes[node as usize];
            let (entries, met) = self.any_meets(simd, &bounds.bounds, [t_min, limit]);
            let children = lanes(met).map(
                #[inline(always)]
                |slot| {
                    let place = node * WIDTH as u32 + slot as u32;
                    (entries[slot % WIDTH], (bounds.children[slot % WIDTH], place))
                },
            );
            let mut next = put_off(&mut stack, children, is_ordered);
            loop {
                let Some((entry, (child, place))) = next.take().or_else(|| stack.pop()) else {
                    return;
                };
                if entry > limit {
                    continue;
                }
                let place = place as usize;
                let (entries, met) =
                    self.meets(simd, &tree.nodes[place / WIDTH].bounds, place % WIDTH, t_min);
                if met == 0 {
                    continue;
                }
                if met.count_ones() <= FEW {
                    for lane in lanes(met) {
                        let lane = lane % PACKET;
                        let triangles = self.triangle_test(lane);
                        self.t_max[lane] = tree.traverse(
                            simd,
                            &self.box_test(lane),
                            (entries[lane], child),
                            [t_min, self.t_max[lane]],
                            is_ordered,
                            #[inline(always)]
                            |leaf, entry, t_max| {
                                let limits = [t_min, t_max];
                                hierarchy.visit_leaf(
                                    simd,
                                    &triangles,
                                    leaf,
                                    entry,
                                    limits,
                                    #[inline(always)]
                                    |hit| see(lane, hit),
                                )
                            },
                        );
                    }
                } else if let Some(leaf) = leaf(child) {
                    self.visit_leaf(simd, hierarchy, leaf, entries, t_min, &mut see);
                } else {
                    node = child;
                    continue 'nodes;
                }
                limit = greatest(self.t_max);
                if limit.partial_cmp(&t_min) != Some(Ordering::Greater) {
                    return;
                }
            }
        }
    }

    /// A ray by itself.
    #[inline(always)]
    fn box_test(&self, lane: usize) -> BoxTest {
        let [x, y, z] = &self.origin;
        let [u, v, w] = &self.inverse;
        let origin = [x[lane], y[lane], z[lane]];
        BoxTest { origin, inverse: [u[lane], v[lane], w[lane]], near: self.near }
    }

    /// A ray by itself.
    #[inline(always)]
    fn triangle_test(&self, lane: usize) -> TriangleTest {
        let [x, y, z] = &self.origin;
        let [u, v, w] = &self.shear;
        let origin = [x[lane], y[lane], z[lane]];
        TriangleTest { origin, shear: [u[lane], v[lane], w[lane]], axes: self.axes }
    }

    /// Where each ray enters the box of a child, and which meet it: the arithmetic of [`BoxTest`].
    #[inline(always)]
    fn meets(
        &self,
        simd: S,
        bounds: &[[f32; WIDTH]; 6],
        child: usize,
        t_min: f32,
    ) -> (f32x16<S>, u32) {
        let [mut entry, mut exit] = [[f32x16::splat(simd, 0.0); 3]; 2];
        for axis in 0..3 {
            let (near, far) = (self.near[axis], opposite(self.near[axis]));
            let (origin, inverse) = (self.origin[axis], self.inverse[axis]);
            entry[axis] = (f32x16::splat(simd, bounds[near][child]) - origin) * inverse;
            exit[axis] = (f32x16::splat(simd, bounds[far][child]) - origin) * inverse;
        }
        let [x, y, z] = entry;
        let entry = x.max(y).max(z.max(f32x16::splat(simd, t_min)));
        let [x, y, z] = exit;
        let exit = x.min(y).min(z.min(self.t_max));
        (entry, entry.simd_le(exit).to_bitmask() as u32)
    }

    /// Bounds of where rays enter each child's box, and which any of them may meet.
    #[inline(always)]
    fn any_meets(
        &self,
        simd: S,
        bounds: &[[f32; WIDTH]; 6],
        [t_min, t_max]: [f32; 2],
    ) -> ([f32; WIDTH], u32) {
        let [mut entry, mut exit] = [[f32x8::splat(simd, 0.0); 3]; 2];
        for axis in 0..3 {
            let (near, far) = (self.near[axis], opposite(self.near[axis]));
            let Common { near_origin, far_origin, inverse: [low, high] } = self.common[axis];
            let near = f32x8::simd_from(simd, bounds[near]) - near_origin;
            let far = f32x8::simd_from(simd, bounds[far]) - far_origin;
            entry[axis] = (near * low).min(near * high);
            exit[axis] = (far * low).max(far * high);
        }
        let [x, y, z] = entry;
        let entry = x.max(y).max(z.max(f32x8::splat(simd, t_min)));
        let [x, y, z] = exit;
        let exit = x.min(y).min(z.min(f32x8::splat(simd, t_max)));
        (entry.into(), entry.simd_le(exit).to_bitmask() as u32)
    }

    /// As [`Hierarchy::visit_leaf`] for all rays, with the triangles one after the other.
    #[inline(always)]
    fn visit_leaf(
        &mut self,
        simd: S,
        hierarchy: &Hierarchy,
        leaf: usize,
        entries: f32x16<S>,
        t_min: f32,
        see: &mut impl FnMut(usize, &Hit) -> f32,
    ) {
        let block = &hierarchy.blocks[leaf];
        let zero = f32x16::splat(simd, 0.0);
        for triangle in 0..BLOCK {
            let mut corners = [[zero; 3]; 3];
            for (corner, from) in corners.iter_mut().zip(&block.corners) {
                for (k, axis) in self.axes.into_iter().enumerate() {
                    corner[k] = f32x16::splat(simd, from[axis][triangle]) - self.origin[axis];
                }
            }
            let t_max = self.t_max;
            let hits = meet(
                corners,
                self.shear,
                #[inline(always)]
                |t| t.simd_ge(entries) & t.simd_gt(f32x16::splat(simd, t_min)) & t.simd_lt(t_max),
            );
            let Some(hits) = hits else { continue };
            let (mesh, triangle) = hierarchy.names[leaf][triangle];
            for lane in lanes(hits.met) {
                let (t, barycentrics) = (hits.t[lane], hits.barycentrics(lane));
                self.t_max[lane] = see(lane, &Hit { t, mesh, triangle, barycentrics });
            }
        }
    }
}

/// The least number of all lanes.
#[inline(always)]
fn least<S: Simd>(x: f32x16<S>) -> f32 {
    let (a, b) = x.split();
    let (a, b) = a.min(b).split();
    let [a, b, c, d]: [f32; 4] = a.min(b).into();
    a.min(b).min(c.min(d))
}

/// The greatest number of all lanes.
#[inline(always)]
fn greatest<S: Simd>(x: f32x16<S>) -> f32 {
    let (a, b) = x.split();
    let (a, b) = a.max(b).split();
    let [a, b, c, d]: [f32; 4] = a.max(b).into();
    a.max(b).max(c.max(d))
}
