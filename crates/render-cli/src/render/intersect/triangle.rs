//! The watertight test of a ray against four triangles at a time.
//!
//! Its edge functions have the same bits seen from either side of an edge (Woop, Benthin & Wald
//! 2013), so a ray cannot pass between two triangles that share one.

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
    corners: [[Each; 3]; 3],
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
    origin: [f32; 3],
    /// Which world axes become x, y and z; z is the one along which the ray runs fastest.
    axes: [usize; 3],
    /// Shear in x and y, and scale of z.
    shear: [f32; 3],
}

/// Where a ray meets the triangles of a block.
pub(super) struct BlockHits {
    /// Which are met: bit k for triangle k.
    pub(super) met: u32,
    /// Distances.
    pub(super) t: Each,
    areas: [Each; 3],
}

impl BlockHits {
    /// Weights of the corners of triangle `lane`, which is met: ≥ 0, sum 1 up to rounding.
    pub(super) fn barycentrics(&self, lane: usize) -> Vec3 {
        let areas = Vec3::from_array(self.areas.map(|areas| areas[lane]));
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

    /// x and y in the sheared space of one corner of each triangle, and its z before it is scaled.
    #[inline(always)]
    fn corner<S: Simd>(&self, simd: S, corner: &[Each; 3]) -> (f32x4<S>, f32x4<S>, f32x4<S>) {
        let [x, y, z] = self.axes;
        let x = f32x4::simd_from(simd, corner[x]) - self.origin[x];
        let y = f32x4::simd_from(simd, corner[y]) - self.origin[y];
        let z = f32x4::simd_from(simd, corner[z]) - self.origin[z];
        (x - z * self.shear[0], y - z * self.shear[1], z)
    }

    /// The triangles of `block` that the ray meets at `t_min` < t < `t_max`.
    #[inline(always)]
    pub(super) fn hits<S: Simd>(
        &self,
        simd: S,
        block: &Block,
        [t_min, t_max]: [f32; 2],
    ) -> Option<BlockHits> {
        let (ax, ay, az) = self.corner(simd, &block.corners[0]);
        let (bx, by, bz) = self.corner(simd, &block.corners[1]);
        let (cx, cy, cz) = self.corner(simd, &block.corners[2]);
        // Twice the signed areas that the ray's axis spans with the edges. Each product is rounded
        // alike from both sides of an edge, so two neighbours cannot both find it outside.
        let mut areas = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        let zero = f32x4::splat(simd, 0.0);
        let [u, v, w] = areas;
        let on_edge = u.simd_eq(zero) | v.simd_eq(zero) | w.simd_eq(zero);
        if on_edge.any_true() {
            let exact = exact_areas([
                [ax.into(), ay.into()],
                [bx.into(), by.into()],
                [cx.into(), cy.into()],
            ]);
            let [u, v, w] = exact;
            areas =
                [f32x4::simd_from(simd, u), f32x4::simd_from(simd, v), f32x4::simd_from(simd, w)];
        }
        let [u, v, w] = areas;
        let is_out = (u.simd_lt(zero) | v.simd_lt(zero) | w.simd_lt(zero))
            & (u.simd_gt(zero) | v.simd_gt(zero) | w.simd_gt(zero));
        if is_out.all_true() {
            return None;
        }
        // det = 0 makes t infinite or NaN.
        let det = u + v + w;
        let t = (u * az + v * bz + w * cz) * self.shear[2] / det;
        let is_within = t.simd_gt(f32x4::splat(simd, t_min)) & t.simd_lt(f32x4::splat(simd, t_max));
        let is_finite = t.simd_lt(f32x4::splat(simd, f32::INFINITY));
        let met = (is_within & is_finite & !is_out).to_bitmask() as u32;
        (met != 0).then(|| BlockHits { met, t: t.into(), areas: [u.into(), v.into(), w.into()] })
    }
}

/// Twice the signed areas between the origin and the edges of triangles given by the x and y of
/// their corners: with exact signs, as products of f32 are exact in f64.
#[cold]
fn exact_areas(corners: [[Each; 2]; 3]) -> [Each; 3] {
    let [a, b, c] = corners;
    let area = |[px, py]: [Each; 2], [qx, qy]: [Each; 2]| {
        std::array::from_fn(|k| {
            let [px, py, qx, qy] = [px[k], py[k], qx[k], qy[k]].map(f64::from);
            (px * qy - py * qx) as f32
        })
    };
    [area(c, b), area(a, c), area(b, a)]
}
