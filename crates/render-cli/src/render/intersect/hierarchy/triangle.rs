//! The watertight test of a ray against four triangles at a time, or of many rays against one.
//!
//! Its edge functions have the same bits seen from either side of an edge (Woop, Benthin & Wald
//! 2013), so a ray cannot pass between two triangles that share one. And as [`meet`] is the same
//! arithmetic whatever lies side by side, both ways find the same hits with the same bits.

use std::ops::{Index, IndexMut};

use fearless_simd::{f32x4, prelude::*};
use glam::Vec3;

use super::Ray;

/// Triangles in a block.
pub(super) const BLOCK: usize = 4;

/// One number of each triangle of a block.
type Each = [f32; BLOCK];

/// Up to four triangles, ready for a test.
#[derive(Clone, Debug, PartialEq)]
#[repr(align(16))]
pub(super) struct Block {
    /// By corner and axis; infinite where there is no triangle, where nothing is hit.
    pub(super) corners: [[Each; 3]; 3],
}

impl Block {
    /// Of the triangles with `corners`, at most [`BLOCK`].
    pub(super) fn new(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let mut corners = [[[f32::INFINITY; BLOCK]; 3]; 3];
        for (lane, triangle) in triangles.take(BLOCK).enumerate() {
            for (axes, corner) in corners.iter_mut().zip(triangle) {
                for (axis, coordinate) in axes.iter_mut().zip(corner.to_array()) {
                    axis[lane] = coordinate;
                }
            }
        }
        Self { corners }
    }
}

/// A ray in the form in which triangles are tested against it: a translation and a shear after
/// which it starts at the origin and runs along the axis `z`.
pub(super) struct TriangleTest {
    pub(super) origin: [f32; 3],
    /// Which world axes become x, y and z; z is the one along which the ray runs fastest.
    pub(super) axes: [usize; 3],
    /// Shear in x and y, and scale of z.
    pub(super) shear: [f32; 3],
}

/// Where rays meet triangles, lane by lane.
pub(super) struct Meetings<V> {
    /// In which lanes: bit k for lane k.
    pub(super) met: u32,
    /// Distances.
    pub(super) t: V,
    areas: [V; 3],
}

impl<V: Index<usize, Output = f32>> Meetings<V> {
    /// Weights of the corners in a lane that is met: ≥ 0, sum 1 up to rounding.
    pub(super) fn barycentrics(&self, lane: usize) -> Vec3 {
        let areas = Vec3::from_array(self.areas.each_ref().map(|areas| areas[lane]));
        areas / areas.element_sum()
    }
}

impl TriangleTest {
    /// `None` for a ray that is not finite or has no direction.
    pub(super) fn new(ray: &Ray) -> Option<Self> {
        let direction = ray.direction.to_array();
        let z = ray.direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let shear = [
            direction[axes[0]] / direction[z],
            direction[axes[1]] / direction[z],
            1.0 / direction[z],
        ];
        let valid = ray.origin.is_finite() && shear.iter().all(|s| s.is_finite());
        valid.then_some(Self { origin: ray.origin.to_array(), axes, shear })
    }

    /// The triangles of `block` that the ray meets at `t_min` < t < `t_max`.
    #[inline(always)]
    pub(super) fn hits<S: Simd>(
        &self,
        simd: S,
        block: &Block,
        [t_min, t_max]: [f32; 2],
    ) -> Option<Meetings<[f32; BLOCK]>> {
        let zero = f32x4::splat(simd, 0.0);
        let mut corners = [[zero; 3]; 3];
        for (corner, from) in corners.iter_mut().zip(&block.corners) {
            for (k, axis) in self.axes.into_iter().enumerate() {
                corner[k] = f32x4::simd_from(simd, from[axis]) - self.origin[axis];
            }
        }
        let [x, y, z] = self.shear;
        let shear = [f32x4::splat(simd, x), f32x4::splat(simd, y), f32x4::splat(simd, z)];
        let Meetings { met, t, areas: [u, v, w] } = meet(
            corners,
            shear,
            #[inline(always)]
            |t| t.simd_gt(f32x4::splat(simd, t_min)) & t.simd_lt(f32x4::splat(simd, t_max)),
        )?;
        Some(Meetings { met, t: t.into(), areas: [u.into(), v.into(), w.into()] })
    }
}

/// Where rays meet triangles at distances that are `within`: given the corners in the axes of the
/// rays, seen from their origins, and their shears.
#[inline(always)]
pub(super) fn meet<S: Simd, V: SimdFloat<S, Element = f32>>(
    corners: [[V; 3]; 3],
    shear: [V; 3],
    within: impl FnOnce(V) -> V::Mask,
) -> Option<Meetings<V>> {
    let simd = shear[0].token();
    let zero = V::simd_from(simd, 0.0);
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners;
    let [ax, ay] = [ax - az * shear[0], ay - az * shear[1]];
    let [bx, by] = [bx - bz * shear[0], by - bz * shear[1]];
    let [cx, cy] = [cx - cz * shear[0], cy - cz * shear[1]];
    // Twice the signed areas that the ray's axis spans with the edges. Each product is rounded
    // alike from both sides of an edge, so two neighbours cannot both find it outside.
    let (u, is_u_close) = area([cx, cy], [bx, by]);
    let (v, is_v_close) = area([ax, ay], [cx, cy]);
    let (w, is_w_close) = area([bx, by], [ax, ay]);
    let mut areas = [u, v, w];
    let is_close = is_u_close | is_v_close | is_w_close;
    if is_close.any_true() {
        take_exact_areas(&mut areas, is_close.to_bitmask() as u32, [[ax, ay], [bx, by], [cx, cy]]);
    }
    let [u, v, w] = areas;
    let is_out = (u.simd_lt(zero) | v.simd_lt(zero) | w.simd_lt(zero))
        & (u.simd_gt(zero) | v.simd_gt(zero) | w.simd_gt(zero));
    if is_out.all_true() {
        return None;
    }
    // det = 0 makes t infinite or NaN.
    let det = u + v + w;
    let t = (u * az + v * bz + w * cz) * shear[2] / det;
    let is_finite = t.simd_lt(V::simd_from(simd, f32::INFINITY));
    let met = (within(t) & is_finite & !is_out).to_bitmask() as u32;
    (met != 0).then_some(Meetings { met, t, areas })
}

/// Twice the signed area between the origin and an edge, and where it is so small that rounding may
/// have changed its sign.
#[inline(always)]
fn area<S: Simd, V: SimdFloat<S, Element = f32>>(
    [px, py]: [V; 2],
    [qx, qy]: [V; 2],
) -> (V, V::Mask) {
    /// Four roundings of a product; the two products and their difference make three halves of one.
    const ROUNDING: f32 = 2.0 * f32::EPSILON;
    let (a, b) = (px * qy, py * qx);
    let area = a - b;
    // The last is for products that underflow. What is infinite, as in empty lanes, is not close.
    let bound = (a.abs() + b.abs()) * ROUNDING + f32::MIN_POSITIVE;
    (area, area.abs().simd_lt(bound))
}

/// Bits that are set in `mask`, from the lowest.
#[inline(always)]
pub(super) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let lane = mask.trailing_zeros() as usize;
            let is_there = mask != 0;
            mask &= mask.wrapping_sub(1);
            is_there.then_some(lane)
        },
    )
}

/// Puts twice the signed areas between the origin and the edges of triangles, given by the x and y
/// of their corners, into the lanes of `mask`: with exact signs, as products of f32 are exact in f64.
#[cold]
fn take_exact_areas<V>(areas: &mut [V; 3], mask: u32, corners: [[V; 2]; 3])
where
    V: IndexMut<usize, Output = f32>,
{
    let [a, b, c] = corners;
    for (area, [p, q]) in areas.iter_mut().zip([[&c, &b], [&a, &c], [&b, &a]]) {
        for lane in lanes(mask) {
            let [px, py, qx, qy] = [p[0][lane], p[1][lane], q[0][lane], q[1][lane]].map(f64::from);
            area[lane] = (px * qy - py * qx) as f32;
        }
    }
}
