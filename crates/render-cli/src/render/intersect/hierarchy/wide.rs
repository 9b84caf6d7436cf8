//! A bounding volume hierarchy of eight children a node, whose boxes are tested at once.
//!
//! The tree is a binary one, built by `obvhs`, of which each node has swallowed the largest of its
//! descendants (Wald, Benthin & Boulos 2008). Its boxes are kept in full precision: they take more
//! memory than compressed ones, and less time.

use std::cmp::Ordering;

use arrayvec::ArrayVec;
use fearless_simd::{f32x8, prelude::*};
use glam::Vec3A;
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::PlocBuilder,
};

use super::{
    MAX_DEPTH, Ray,
    triangle::{BLOCK, lanes},
};

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Each level leaves at most all children but one for later.
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + 1;

/// Marks a child that is a leaf.
const LEAF: u32 = 1 << 31;

/// The hierarchy over boxes, and which of them are in each leaf.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wide {
    pub(super) nodes: Vec<Node>,
    /// Levels of nodes.
    depth: usize,
}

#[derive(Clone, Debug, PartialEq)]
#[repr(align(32))]
pub(super) struct Node {
    /// Lower bounds of the children in x, y and z, then their upper bounds; where there is no child,
    /// infinite ones that no ray meets.
    pub(super) bounds: [[f32; WIDTH]; 6],
    /// Index of a node, or with [`LEAF`] that of a leaf.
    pub(super) children: [u32; WIDTH],
}

impl Node {
    fn new() -> Self {
        let bounds = [f32::INFINITY, f32::NEG_INFINITY].map(|bound| [[bound; WIDTH]; 3]);
        let [[a, b, c], [d, e, f]] = bounds;
        Self { bounds: [a, b, c, d, e, f], children: [LEAF; WIDTH] }
    }
}

/// A box around something.
pub(super) struct Bounds(pub(super) Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// What a leaf holds: indices into the boxes, and then [`NO_BOX`].
pub(super) type Leaf = [u32; BLOCK];

/// In a place of a leaf that is empty.
pub(super) const NO_BOX: u32 = u32::MAX;

impl Wide {
    /// The hierarchy over `boxes` and its leaves. It is built on one thread: equal boxes give equal
    /// bits.
    pub(super) fn new(boxes: &[Bounds]) -> (Self, Vec<Leaf>) {
        if boxes.is_empty() {
            return (Self { nodes: vec![], depth: 0 }, vec![]);
        }
        let binary = binary(boxes);
        let sizes = sizes(&binary);
        let (mut nodes, mut leaves) = (vec![], vec![]);
        let mut depth = 0;
        // Nodes of the binary tree that become nodes, with their level and whose child they are.
        let mut open = vec![(0, 1, None)];
        while let Some((root, level, place)) = open.pop() {
            let index = nodes.len();
            if let Some((parent, slot)) = place {
                let parent: &mut Node = &mut nodes[parent];
                parent.children[slot] = index as u32;
            }
            depth = depth.max(level);
            let mut node = Node::new();
            let children = children(&binary, &sizes, root);
            for (slot, &child) in children.iter().enumerate() {
                let bounds = binary.nodes[child].aabb();
                for (axis, rows) in [bounds.min, bounds.max].into_iter().zip([0, 3]) {
                    for (row, bound) in axis.to_array().into_iter().enumerate() {
                        node.bounds[rows + row][slot] = bound;
                    }
                }
                if sizes[child] <= BLOCK {
                    node.children[slot] = LEAF | leaves.len() as u32;
                    leaves.push(members(&binary, child));
                }
            }
            nodes.push(node);
            // The first is taken up next, so that it lies close by.
            let inner = children.iter().enumerate().rev().filter(|&(_, &c)| sizes[c] > BLOCK);
            open.extend(inner.map(|(slot, &child)| (child, level + 1, Some((index, slot)))));
        }
        (Self { nodes, depth }, leaves)
    }

    /// Levels of nodes.
    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    /// Where a traversal starts; `None` in a tree without boxes.
    pub(super) fn root(&self) -> Option<Child> {
        (!self.nodes.is_empty()).then_some((f32::NEG_INFINITY, 0))
    }

    /// Calls `visit` with the index of each leaf below `start` whose box `ray` meets between `t_min`
    /// and `t_max`, with where it enters the box, and with `t_max`, which becomes what `visit`
    /// answers. Ends when that is not above `t_min`. Returns `t_max`.
    ///
    /// The nearer of two children of a node comes first if `is_ordered`.
    ///
    /// At most [`MAX_DEPTH`] levels are looked at.
    #[inline(always)]
    pub(super) fn traverse<S: Simd>(
        &self,
        simd: S,
        ray: &BoxTest,
        start: Child,
        [t_min, mut t_max]: [f32; 2],
        is_ordered: bool,
        mut visit: impl FnMut(usize, f32, f32) -> f32,
    ) -> f32 {
        let mut stack = Stack::new();
        let (mut entry, mut child) = start;
        loop {
            if let Some(leaf) = leaf(child) {
                t_max = visit(leaf, entry, t_max);
                if t_max.partial_cmp(&t_min) != Some(Ordering::Greater) {
                    return t_max;
                }
            } else {
                let node = &self.nodes[child as usize];
                let (entries, met) = ray.meets(simd, node, [t_min, t_max]);
                let children = lanes(met).map(
                    #[inline(always)]
                    |slot| (entries[slot % WIDTH], node.children[slot % WIDTH]),
                );
                if let Some(nearest) = put_off(&mut stack, children, is_ordered) {
                    (entry, child) = nearest;
                    continue;
                }
            }
            (entry, child) = loop {
                match stack.pop() {
                    Some(next) if next.0 <= t_max => break next,
                    Some(_) => {}
                    None => return t_max,
                }
            };
        }
    }
}

/// A child of a node, after where a ray enters its box.
pub(super) type Child = (f32, u32);

/// What is left for later in a traversal, the next one last.
pub(super) type Stack<T> = ArrayVec<(f32, T), STACK>;

/// The leaf that `child` is, if it is one.
#[inline(always)]
pub(super) fn leaf(child: u32) -> Option<usize> {
    (child & LEAF != 0).then_some((child & !LEAF) as usize)
}

/// Leaves `children` for later, but for the one that comes next: the nearest, if that matters.
#[inline(always)]
pub(super) fn put_off<T: Copy>(
    stack: &mut Stack<T>,
    mut children: impl Iterator<Item = (f32, T)>,
    is_ordered: bool,
) -> Option<(f32, T)> {
    let mut nearest = children.next()?;
    let base = stack.len();
    for mut other in children {
        if is_ordered && other.0 < nearest.0 {
            (nearest, other) = (other, nearest);
        }
        let mut place = stack.len();
        if stack.try_push(other).is_err() {
            break;
        }
        while is_ordered && place > base && stack[place - 1].0 < other.0 {
            stack.swap(place - 1, place);
            place -= 1;
        }
    }
    Some(nearest)
}

/// Keeps components of 0 of a direction from infinite inverses, of which a multiple is NaN.
pub(super) const SMALLEST: f32 = 1e-18;

/// A ray in the form in which boxes are tested against it.
pub(super) struct BoxTest {
    pub(super) origin: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// Row of [`Node::bounds`] that the ray meets first, by axis; three rows on is the other.
    pub(super) near: [usize; 3],
}

impl BoxTest {
    pub(super) fn new(ray: &Ray) -> Self {
        let direction = ray.direction.to_array();
        let inverse = direction.map(|d| if d.abs() > SMALLEST { 1.0 / d } else { 1.0 / SMALLEST });
        let near = std::array::from_fn(|axis| if inverse[axis] > 0.0 { axis } else { axis + 3 });
        Self { origin: ray.origin.to_array(), inverse, near }
    }

    /// Where the ray enters each child's box, and which it meets: bit k for child k.
    #[inline(always)]
    fn meets<S: Simd>(
        &self,
        simd: S,
        node: &Node,
        [t_min, t_max]: [f32; 2],
    ) -> ([f32; WIDTH], u32) {
        let at = |axis: usize, row: usize| {
            (f32x8::simd_from(simd, node.bounds[row]) - self.origin[axis]) * self.inverse[axis]
        };
        let [x, y, z] = self.near;
        let entry = at(0, x).max(at(1, y)).max(at(2, z).max(f32x8::splat(simd, t_min)));
        let [x, y, z] = self.near;
        let [x, y, z] = [opposite(x), opposite(y), opposite(z)];
        let exit = at(0, x).min(at(1, y)).min(at(2, z).min(f32x8::splat(simd, t_max)));
        (entry.into(), entry.simd_le(exit).to_bitmask() as u32)
    }
}

/// The row of [`Node::bounds`] of the other side of a box.
#[inline(always)]
pub(super) fn opposite(row: usize) -> usize {
    if row < 3 { row + 3 } else { row - 3 }
}

/// The steps of `obvhs::bvh2::builder::build_bvh2` on one thread.
fn binary(boxes: &[Bounds]) -> Bvh2 {
    let params = BvhBuildParams::medium_build();
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut binary, params.reinsertion_batch_ratio, None);
    binary
}

/// The two children of an inner node.
fn pair(binary: &Bvh2, node: usize) -> Option<[usize; 2]> {
    let node = &binary.nodes[node];
    let first = node.first_index as usize;
    (!node.is_leaf()).then_some([first, first + 1])
}

/// All nodes, each after its parent.
fn downwards(binary: &Bvh2) -> Vec<usize> {
    let mut order = vec![0];
    let mut next = 0;
    while next < order.len() {
        order.extend(pair(binary, order[next]).into_iter().flatten());
        next += 1;
    }
    order
}

/// How many boxes are below each node.
fn sizes(binary: &Bvh2) -> Vec<usize> {
    let mut sizes = vec![0; binary.nodes.len()];
    for node in downwards(binary).into_iter().rev() {
        sizes[node] = match pair(binary, node) {
            Some([a, b]) => sizes[a] + sizes[b],
            None => binary.nodes[node].prim_count as usize,
        };
    }
    sizes
}

/// Descendants of `root` that a wide node has as its children: at most [`WIDTH`], got by opening
/// the one with the greatest surface again and again, but none that fits into a leaf.
fn children(binary: &Bvh2, sizes: &[usize], root: usize) -> Vec<usize> {
    let mut children = vec![root];
    while children.len() < WIDTH {
        let area = |&slot: &usize| half_area(binary.nodes[children[slot]].aabb());
        let inner = (0..children.len()).filter(|&slot| sizes[children[slot]] > BLOCK);
        let Some(slot) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
        let Some([a, b]) = pair(binary, children[slot]) else { break };
        children[slot] = a;
        children.push(b);
    }
    children
}

fn half_area(bounds: &Aabb) -> f32 {
    let size = Vec3A::max(bounds.max - bounds.min, Vec3A::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// The boxes below a node that has no more than [`BLOCK`].
fn members(binary: &Bvh2, root: usize) -> Leaf {
    let mut open = vec![root];
    let mut members = [NO_BOX; BLOCK];
    let mut places = members.iter_mut();
    while let Some(node) = open.pop() {
        if let Some([a, b]) = pair(binary, node) {
            open.extend([b, a]);
        } else {
            let node = &binary.nodes[node];
            let first = node.first_index as usize;
            let boxes = &binary.primitive_indices[first..first + node.prim_count as usize];
            places.by_ref().zip(boxes).for_each(|(place, &index)| *place = index);
        }
    }
    members
}
