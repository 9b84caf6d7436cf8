//! What a ray hits: a bounding volume hierarchy over all triangles of the scene and a watertight
//! ray/triangle test.
//!
//! Watertight means that a ray cannot pass between two triangles that share an edge or a vertex.
//! That takes two things: the test of Woop, Benthin & Wald 2013, whose edge functions have the
//! same bits seen from either side of an edge, and boxes larger than their triangles by more than
//! the rounding of the box test ([`Geometry::resolution`]).

use glam::{DVec3, Vec2, Vec3, Vec3A};
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::reinsertion::ReinsertionOptimizer,
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh},
    ploc::PlocBuilder,
    ray::RayHit,
};
use thiserror::Error;

use crate::scene::mesh::Mesh;

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

/// All triangles of a scene, ready for rays.
///
/// The hierarchy is built on one thread: equal meshes give equal bits. It holds its own copy of
/// the positions, so the meshes stay with the caller, who looks up shading data there.
///
/// Watertight for rays that start within four extents of the scene's origin: the rounding of the
/// box test grows with the distance and at last outgrows the padding.
pub struct Geometry {
    bvh: CwBvh,
    /// In the order of the hierarchy's leaves.
    corners: Vec<[Vec3; 3]>,
    /// (mesh, triangle) of each entry of `corners`.
    names: Vec<(u32, u32)>,
    /// Greatest absolute coordinate, in metres.
    extent: f32,
    /// Length in metres of the hierarchy's unit of t; a power of two.
    unit: f32,
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

/// The converter to wide nodes numbers 7 decisions for each of 2n − 1 binary nodes in 32 bits.
const MAX_TRIANGLES: usize = 1 << 28;

/// Far below √f32::MAX, as edge functions multiply two coordinates, and beyond any picture.
pub const MAX_COORDINATE: f32 = 1e7;

/// Entries of the traversal's stack less one: each level pushes at most one entry.
const MAX_DEPTH: usize = 31;

/// Padding of boxes and offset of rays, relative to the extent: 32 roundings of a coordinate. The
/// box test makes about 5 and the triangle test about 10.
const RESOLUTION: f32 = 1.0 / (1 << 19) as f32;

/// The hierarchy's box test ignores what lies before 1e-4, in units of t, so it runs in units of
/// this fraction of the extent. A power of two keeps the change of units exact.
const BVH_UNIT: f32 = 1.0 / (1 << 14) as f32;

/// Keeps the inverse of the unit far from overflow in a scene of no extent.
const SMALLEST_UNIT: f32 = 1e-18;

struct PaddedBox(Aabb);

impl Boundable for PaddedBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl std::fmt::Debug for Geometry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Geometry")
            .field("triangles", &self.corners.len())
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
        let bvh = build(&corners, extent * RESOLUTION);
        let depth = depth(&bvh);
        if depth > MAX_DEPTH {
            return Err(GeometryError::TooDeep(depth));
        }
        let order = &bvh.primitive_indices;
        Ok(Self {
            corners: order.iter().map(|&i| corners[i as usize]).collect(),
            names: order.iter().map(|&i| names[i as usize]).collect(),
            bvh,
            extent,
            unit: power_of_two_below((extent * BVH_UNIT).max(SMALLEST_UNIT)),
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
        let test = TriangleTest::new(ray)?;
        let mut nearest: Option<Hit> = None;
        self.bvh.ray_traverse(bvh_ray(ray, t_max, self.unit)?, &mut RayHit::none(), |_, leaf| {
            let t_max = nearest.map_or(t_max, |hit| hit.t);
            let hit = self.hit(&test, leaf, t_min, t_max).filter(&mut accept);
            if hit.is_some() {
                nearest = hit;
            }
            hit.map_or(f32::INFINITY, |hit| hit.t / self.unit)
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
        let Some(test) = TriangleTest::new(ray) else { return false };
        let Some(bvh_ray) = bvh_ray(ray, t_max, self.unit) else { return false };
        let mut occluded = false;
        self.bvh.ray_traverse_miss(bvh_ray, |_, leaf| {
            occluded = self.hit(&test, leaf, t_min, t_max).is_some_and(|hit| accept(&hit));
            if occluded { f32::NEG_INFINITY } else { f32::INFINITY }
        });
        occluded
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

    fn hit(&self, test: &TriangleTest, leaf: usize, t_min: f32, t_max: f32) -> Option<Hit> {
        let (t, barycentrics) = test.hit(self.corners[leaf])?;
        let (mesh, triangle) = self.names[leaf];
        (t > t_min && t < t_max).then_some(Hit { t, mesh, triangle, barycentrics })
    }
}

/// Whether no two corners coincide. Triangles collapsed to a line between two points leave no gap,
/// and a heap of them in one place would make the hierarchy a list; one whose three corners merely
/// lie on a line may seal what rounding opens between its neighbours.
fn has_three_corners([a, b, c]: [Vec3; 3]) -> bool {
    a != b && b != c && c != a
}

/// The steps of `obvhs::cwbvh::builder::build_cwbvh` without its validation, which in debug builds
/// takes longer than the build.
fn build(corners: &[[Vec3; 3]], padding: f32) -> CwBvh {
    let params = BvhBuildParams::medium_build();
    let padding = Vec3A::splat(padding);
    let boxes: Vec<_> = corners
        .iter()
        .map(|corners| {
            let tight = Aabb::from_points(&corners.map(Vec3A::from));
            PaddedBox(Aabb::new(tight.min - padding, tight.max + padding))
        })
        .collect();
    let mut bvh2 = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        &boxes,
        (0..boxes.len() as u32).collect(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut bvh2, params.reinsertion_batch_ratio, None);
    bvh2_to_cwbvh(&bvh2, params.max_prims_per_leaf.clamp(1, 3), true, false)
}

/// Levels of inner nodes. Children come after their parent in the list.
fn depth(bvh: &CwBvh) -> usize {
    let mut levels = vec![1; bvh.nodes.len()];
    for (index, node) in bvh.nodes.iter().enumerate() {
        for child in 0..node.imask.count_ones() {
            levels[(node.child_base_idx + child) as usize] = levels[index] + 1;
        }
    }
    levels.into_iter().max().unwrap_or(0)
}

/// The ray for the hierarchy, with t in units of `unit` metres; `None` when it cannot hit.
///
/// Made by hand, as the constructor of `obvhs` clamps the inverse at |d| = 1.2e-7 of whatever
/// units it is in, and for a component of −0.0 contradicts its own sign test.
fn bvh_ray(ray: &Ray, t_max: f32, unit: f32) -> Option<obvhs::ray::Ray> {
    const SMALLEST: f32 = 1e-18;
    let inverse = |d: f32| {
        let d = if d.abs() > SMALLEST { d } else { SMALLEST.copysign(d + 0.0) };
        1.0 / (unit * d)
    };
    let d = ray.direction;
    (t_max > 0.0).then(|| obvhs::ray::Ray {
        origin: ray.origin.into(),
        direction: d.into(),
        inv_direction: Vec3A::new(inverse(d.x), inverse(d.y), inverse(d.z)),
        tmin: 0.0,
        tmax: t_max / unit,
    })
}

fn power_of_two_below(x: f32) -> f32 {
    const EXPONENT: u32 = 0x7f80_0000;
    f32::from_bits(x.to_bits() & EXPONENT)
}

/// A ray in the form in which triangles are tested against it (Woop, Benthin & Wald 2013): a
/// translation and a shear after which it starts at the origin and runs along the axis `z`.
struct TriangleTest {
    origin: Vec3,
    /// Which world axes become x, y and z; z is the one along which the ray runs fastest.
    axes: [usize; 3],
    /// Shear in x and y, and scale of z.
    shear: [f32; 3],
}

impl TriangleTest {
    /// `None` for a ray that is not finite or has no direction.
    fn new(ray: &Ray) -> Option<Self> {
        let direction = ray.direction.to_array();
        let z = ray.direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let shear = [
            direction[axes[0]] / direction[z],
            direction[axes[1]] / direction[z],
            1.0 / direction[z],
        ];
        let valid = ray.origin.is_finite() && shear.iter().all(|s| s.is_finite());
        valid.then_some(Self { origin: ray.origin, axes, shear })
    }

    /// The corner in x and y of the sheared space, and its unscaled z.
    fn transform(&self, corner: Vec3) -> (Vec2, f32) {
        let corner = (corner - self.origin).to_array();
        let [x, y, z] = [corner[self.axes[0]], corner[self.axes[1]], corner[self.axes[2]]];
        (Vec2::new(x - self.shear[0] * z, y - self.shear[1] * z), z)
    }

    /// t, of any sign, and the weights of the corners.
    fn hit(&self, corners: [Vec3; 3]) -> Option<(f32, Vec3)> {
        // One by one: `corners.map` is not inlined here, which takes a fifth of the rendering time.
        let (a, za) = self.transform(corners[0]);
        let (b, zb) = self.transform(corners[1]);
        let (c, zc) = self.transform(corners[2]);
        // Twice the signed areas that the ray's axis spans with the edges. Each product is rounded
        // alike from both sides of an edge, so two neighbours cannot both find it outside.
        let mut areas = Vec3::new(c.perp_dot(b), a.perp_dot(c), b.perp_dot(a));
        if areas.cmpeq(Vec3::ZERO).any() {
            // In f64 the products of f32 are exact, and so are the signs.
            let (a, b, c) = (a.as_dvec2(), b.as_dvec2(), c.as_dvec2());
            areas = DVec3::new(c.perp_dot(b), a.perp_dot(c), b.perp_dot(a)).as_vec3();
        }
        if areas.cmplt(Vec3::ZERO).any() && areas.cmpgt(Vec3::ZERO).any() {
            return None;
        }
        let det = areas.element_sum();
        let t = areas.dot(Vec3::new(za, zb, zc)) * self.shear[2] / det;
        // det = 0 makes t infinite or NaN.
        t.is_finite().then(|| (t, areas / det))
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{PI, TAU};

    use super::*;

    /// Halton points in [0, 1), base 2, 3 and 5.
    fn points(count: u32) -> impl Iterator<Item = [f32; 3]> {
        (1..=count).map(|index| {
            [2, 3, 5].map(|base| {
                let (mut rest, mut digit, mut value) = (index, 1.0, 0.0);
                while rest > 0 {
                    digit /= base as f32;
                    value += digit * (rest % base) as f32;
                    rest /= base;
                }
                value
            })
        })
    }

    fn direction([u, v, _]: [f32; 3]) -> Vec3 {
        let z = 1.0 - 2.0 * u;
        let (sin, cos) = (TAU * v).sin_cos();
        Vec3::new(cos, sin, 0.0) * (1.0 - z * z).max(0.0).sqrt() + Vec3::Z * z
    }

    fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
        let uvs = vec![Vec2::ZERO; positions.len()];
        Mesh::with_smooth_normals(positions, uvs, triangles).unwrap()
    }

    /// A closed sphere of 4·n·(n − 1) triangles, with slivers at the poles.
    fn sphere(n: u32, radius: f32, centre: Vec3) -> Mesh {
        let (rings, sectors) = (n, 2 * n);
        let mut positions = vec![Vec3::Z, -Vec3::Z];
        for ring in 1..rings {
            for sector in 0..sectors {
                let theta = PI * ring as f32 / rings as f32;
                let phi = TAU * sector as f32 / sectors as f32;
                positions.push(Vec3::new(
                    theta.sin() * phi.cos(),
                    theta.sin() * phi.sin(),
                    theta.cos(),
                ));
            }
        }
        for position in &mut positions {
            *position = centre + radius * *position;
        }
        let vertex = |ring: u32, sector: u32| match ring {
            0 => 0,
            _ if ring == rings => 1,
            _ => 2 + (ring - 1) * sectors + sector % sectors,
        };
        let mut triangles = Vec::new();
        for ring in 0..rings {
            for sector in 0..sectors {
                let [a, b] = [vertex(ring, sector), vertex(ring, sector + 1)];
                let [c, d] = [vertex(ring + 1, sector), vertex(ring + 1, sector + 1)];
                if ring > 0 {
                    triangles.push([a, c, b]);
                }
                if ring + 1 < rings {
                    triangles.push([b, c, d]);
                }
            }
        }
        mesh(positions, triangles)
    }

    /// Small triangles strewn through the unit cube.
    fn confetti(count: u32) -> Mesh {
        let mut positions = Vec::new();
        for (i, point) in points(count).enumerate() {
            let centre = Vec3::from_array(point);
            for k in 0..3 {
                let angle = (i * 3 + k) as f32;
                positions
                    .push(centre + 0.05 * Vec3::new(angle.sin(), angle.cos(), (2.3 * angle).sin()));
            }
        }
        mesh(positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    }

    fn brute_force(meshes: &[&Mesh], ray: &Ray, t_min: f32, t_max: f32) -> Option<f32> {
        let test = TriangleTest::new(ray)?;
        let corners =
            meshes.iter().flat_map(|m| (0..m.triangles().len()).map(|t| m.corners(t as u32)));
        let hits = corners.filter_map(|corners| test.hit(corners).map(|(t, _)| t));
        hits.filter(|&t| t > t_min && t < t_max).reduce(f32::min)
    }

    #[test]
    fn closed_sphere_lets_no_ray_out() {
        // Off the origin, so that coordinates are rounded differently on each side.
        for (radius, centre) in [(1.0, Vec3::ZERO), (0.3, Vec3::new(0.7, -0.4, 0.2))] {
            let sphere = sphere(170, radius, centre);
            let count = sphere.triangles().len() as u32;
            assert!(count >= 100_000, "{count}");
            let geometry = Geometry::new(&[&sphere]).unwrap();
            let mut misses = [0; 3];
            for (index, (triangle, point)) in (0..count).zip(points(count)).enumerate() {
                let [a, b, c] = sphere.corners(triangle);
                let origin = centre + 0.5 * radius * (2.0 * Vec3::from_array(point) - Vec3::ONE);
                let weight = point[index % 3];
                let targets = [a, b + (c - b) * weight, origin + direction(point)];
                for (kind, target) in targets.into_iter().enumerate() {
                    let ray = Ray { origin, direction: (target - origin).normalize() };
                    let found = geometry.intersect(&ray, 0.0, f32::INFINITY);
                    misses[kind] += u32::from(found.is_none());
                    assert_eq!(geometry.occluded(&ray, 0.0, f32::INFINITY), found.is_some());
                }
            }
            assert_eq!(misses, [0; 3], "towards vertices, edges, anywhere: of {count} each");
        }
    }

    #[test]
    fn closed_sphere_lets_no_ray_through_from_afar() {
        let sphere = sphere(170, 1.0, Vec3::ZERO);
        let geometry = Geometry::new(&[&sphere]).unwrap();
        for distance in [2.0, 4.0] {
            let mut misses = 0;
            for (triangle, point) in (0..sphere.triangles().len() as u32).zip(points(u32::MAX)) {
                let [a, b, c] = sphere.corners(triangle);
                let origin = distance * (a + 0.5 * direction(point)).normalize();
                for target in [a, b + (c - b) * point[2]] {
                    let ray = Ray { origin, direction: (target - origin).normalize() };
                    misses += u32::from(!geometry.occluded(&ray, 0.0, f32::INFINITY));
                }
            }
            assert_eq!(misses, 0, "from a distance of {distance} radii");
        }
    }

    #[test]
    fn axis_parallel_rays_leave_no_closed_sphere() {
        let sphere = sphere(64, 1.0, Vec3::ZERO);
        let geometry = Geometry::new(&[&sphere]).unwrap();
        for direction in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            for [x, y, _] in points(1000).chain([[0.5, 0.5, 0.0]]) {
                let origin = 0.9 * Vec3::new(x - 0.5, y - 0.5, x * y - 0.25);
                let ray = Ray { origin, direction };
                assert!(geometry.intersect(&ray, 0.0, 10.0).is_some(), "{ray:?}");
            }
        }
    }

    #[test]
    fn needles_leave_no_gap() {
        // Squares cut along a needle a few roundings wide, whose corners all seem to lie on one
        // line in f32.
        let mut misses = 0;
        for [x, y, z] in points(2000) {
            let middle = Vec3::new(0.3 + 0.4 * x, 0.3 + 0.4 * x + 2e-7 * (y - 0.5), 0.0);
            let corners = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y, middle];
            let square = mesh(corners, vec![[0, 1, 4], [1, 2, 4], [0, 4, 2], [0, 2, 3]]);
            let geometry = Geometry::new(&[&square]).unwrap();
            for along in [0.25, 0.4, 0.6, 0.75, 0.9] {
                let target = Vec3::new(along, along + 1e-7 * (z - 0.5), 0.0);
                for origin in [target + Vec3::Z, Vec3::new(2.0 * y, z, 1.0)] {
                    let ray = Ray { origin, direction: (target - origin).normalize() };
                    misses += u32::from(!geometry.occluded(&ray, 0.0, f32::INFINITY));
                }
            }
        }
        assert_eq!(misses, 0, "of 20000 rays");
    }

    #[test]
    fn agrees_with_brute_force() {
        let (a, b) = (confetti(700), sphere(12, 0.4, Vec3::splat(0.5)));
        let geometry = Geometry::new(&[&a, &b]).unwrap();
        let mut hits = 0;
        for (index, point) in points(4000).enumerate() {
            let origin = Vec3::from_array(point) * 3.0 - Vec3::ONE;
            // Some towards the middle, some anywhere, some along an axis (with both zeros).
            let direction = match index % 3 {
                0 => (Vec3::splat(0.5) - origin).normalize(),
                1 => direction([point[2], point[0], 0.0]),
                _ => Vec3::new(0.0, -0.0, if index % 2 == 0 { 1.0 } else { -1.0 }),
            };
            let ray = Ray { origin, direction };
            let (t_min, t_max) = (0.3 * point[1], if index % 5 == 0 { 1.0 } else { f32::INFINITY });
            let expected = brute_force(&[&a, &b], &ray, t_min, t_max);
            let found = geometry.intersect(&ray, t_min, t_max);
            assert_eq!(found.map(|hit| hit.t), expected, "{ray:?} {t_min} {t_max}");
            assert_eq!(geometry.occluded(&ray, t_min, t_max), expected.is_some(), "{ray:?}");
            hits += usize::from(found.is_some());
        }
        assert!(hits > 1000, "{hits}");
    }

    #[test]
    fn hits_name_mesh_triangle_and_place() {
        let (far, near) = (sphere(16, 3.0, Vec3::ZERO), sphere(16, 1.0, Vec3::ZERO));
        let geometry = Geometry::new(&[&far, &near]).unwrap();
        for point in points(1000) {
            let ray = Ray { origin: Vec3::new(0.0, 0.0, 0.01), direction: direction(point) };
            let hit = geometry.intersect(&ray, 0.0, f32::INFINITY).unwrap();
            assert_eq!(hit.mesh, 1);
            let surface = near.surface(hit.triangle, hit.barycentrics);
            let position = surface.position;
            assert!(position.abs_diff_eq(ray.at(hit.t), 1e-6), "{position} {}", ray.at(hit.t));
            let outer =
                geometry.intersect_where(&ray, 0.0, f32::INFINITY, |hit| hit.mesh == 0).unwrap();
            assert!(outer.mesh == 0 && outer.t > hit.t, "{outer:?} {hit:?}");
            assert!(!geometry.occluded_where(&ray, 0.0, 2.0, |hit| hit.mesh == 0));
            assert!(geometry.intersect_where(&ray, 0.0, f32::INFINITY, |_| false).is_none());
        }
    }

    #[test]
    fn offset_rays_do_not_hit_the_surface_they_leave() {
        let sphere = sphere(100, 0.1, Vec3::new(2.0, -1.5, 0.3));
        let geometry = Geometry::new(&[&sphere]).unwrap();
        let ray = |origin, direction| Ray { origin, direction };
        for (point, other) in points(20_000).zip(points(40_000).skip(20_000)) {
            let inwards = ray(Vec3::new(2.0, -1.5, 0.3), direction(point));
            let hit = geometry.intersect(&inwards, 0.0, f32::INFINITY).unwrap();
            let surface = sphere.surface(hit.triangle, hit.barycentrics);
            let normal = surface.geometric_normal;
            let out = direction(other);
            let origin = geometry.offset(surface.position, normal, out);
            assert!((origin - surface.position).length() < 1e-5);
            let leaves = out.dot(normal) > 0.0;
            let found = geometry.intersect(&ray(origin, out), 0.0, f32::INFINITY);
            match found {
                // The sphere is convex: nothing is in front, and inside there is the far wall.
                Some(hit) if leaves => panic!("{hit:?} in front of {normal}, towards {out}"),
                Some(again) => assert!(again.triangle != hit.triangle, "{hit:?} {again:?}"),
                None => assert!(leaves, "towards {out}, normal {normal}"),
            }
        }
    }

    #[test]
    fn close_hits_count() {
        let scene = mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]);
        let geometry = Geometry::new(&[&scene]).unwrap();
        for distance in [1e-5, 1e-6, 1e-7] {
            let ray = Ray { origin: Vec3::new(0.2, 0.2, distance), direction: -Vec3::Z };
            let hit = geometry.intersect(&ray, 0.0, 1.0).unwrap();
            assert!((hit.t - distance).abs() < 1e-9, "{hit:?} {distance}");
        }
    }

    #[test]
    fn broken_rays_hit_nothing() {
        let geometry = Geometry::new(&[&sphere(20, 1.0, Vec3::ZERO)]).unwrap();
        let good = Ray { origin: Vec3::ZERO, direction: Vec3::X };
        assert!(geometry.occluded(&good, 0.0, f32::INFINITY));
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for axis in 0..3 {
                let mut ray = [good; 2];
                ray[0].origin[axis] = value;
                ray[1].direction[axis] = value;
                for ray in &ray {
                    assert_eq!(geometry.intersect(ray, 0.0, f32::INFINITY), None, "{ray:?}");
                    assert!(!geometry.occluded(ray, 0.0, f32::INFINITY), "{ray:?}");
                }
            }
        }
        let still = Ray { direction: Vec3::ZERO, ..good };
        assert_eq!(geometry.intersect(&still, 0.0, f32::INFINITY), None);
        for (t_min, t_max) in [(f32::NAN, 2.0), (0.0, f32::NAN), (2.0, 1.0), (0.0, -1.0)] {
            assert_eq!(geometry.intersect(&good, t_min, t_max), None, "{t_min} {t_max}");
            assert!(!geometry.occluded(&good, t_min, t_max), "{t_min} {t_max}");
        }
    }

    #[test]
    fn a_ray_close_to_an_edge_hits_one_side_only() {
        // The edge passes the ray at a distance of about 2⁻²⁷, which the products lose in f32.
        let d = 1.0 / 8192.0;
        let (a, b) = (Vec3::new(1.0 + d, 1.0, 0.0), Vec3::new(-1.0, d - 1.0, 0.0));
        let (left, right) = (Vec3::new(-0.5, 0.5, 0.0), Vec3::new(0.5, -0.5, 0.0));
        let pair = mesh(vec![a, b, left, right], vec![[0, 1, 2], [0, 3, 1]]);
        let geometry = Geometry::new(&[&pair]).unwrap();
        let ray = Ray { origin: Vec3::Z, direction: -Vec3::Z };
        let hits =
            |triangle| geometry.occluded_where(&ray, 0.0, 2.0, |hit| hit.triangle == triangle);
        assert_eq!([hits(0), hits(1)], [false, true]);
    }

    #[test]
    fn degenerate_triangles_do_no_harm() {
        let points = vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::ZERO];
        let scene = mesh(points, vec![[0, 1, 2], [0, 0, 0], [0, 1, 3], [2, 0, 2]]);
        let geometry = Geometry::new(&[&scene]).unwrap();
        for target in [Vec3::ZERO, Vec3::X, Vec3::X * 0.3, Vec3::Y] {
            let origin = Vec3::new(0.1, -1.0, 2.0);
            let ray = Ray { origin, direction: (target - origin).normalize() };
            let hit = geometry.intersect(&ray, 0.0, f32::INFINITY);
            // Rounding may give the line through three corners a width.
            assert!(hit.is_none_or(|hit| hit.triangle == 0 && target.y == 0.0), "{target} {hit:?}");
        }
    }

    #[test]
    fn heaps_of_equal_triangles_are_all_hit_or_refused() {
        let heap =
            |triangle, count| mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![triangle; count]);
        let geometry = Geometry::new(&[&heap([0, 1, 1], 5000), &heap([0, 1, 2], 150)]).unwrap();
        let ray = Ray { origin: Vec3::new(0.2, 0.2, 1.0), direction: -Vec3::Z };
        assert_eq!(geometry.intersect(&ray, 0.0, 2.0).unwrap().t, 1.0);
        let mut seen = 0;
        assert!(!geometry.occluded_where(&ray, 0.0, 2.0, |_| {
            seen += 1;
            false
        }));
        assert_eq!(seen, 150);
        let error = Geometry::new(&[&heap([0, 1, 2], 5000)]).unwrap_err();
        assert!(matches!(error, GeometryError::TooDeep(_)), "{error}");
    }

    #[test]
    fn empty_scene_is_empty() {
        for meshes in [&[][..], &[&mesh(vec![], vec![])], &[&mesh(vec![Vec3::ONE], vec![])]] {
            let geometry = Geometry::new(meshes).unwrap();
            let ray = Ray { origin: Vec3::ZERO, direction: Vec3::X };
            assert_eq!(geometry.intersect(&ray, 0.0, f32::INFINITY), None);
        }
    }

    #[test]
    fn too_large_a_scene_is_refused() {
        let scene = mesh(vec![Vec3::ZERO, Vec3::X * 2e7, Vec3::Y], vec![[0, 1, 2]]);
        let small = mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]);
        let error = Geometry::new(&[&small, &scene]).unwrap_err();
        assert_eq!(error, GeometryError::TooLarge(1));
        let expected = "mesh 1: found a coordinate above 10000000 m, expected a smaller scene";
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn extreme_scales_are_hit() {
        for exponent in [-12, -6, 0, 6] {
            let scale = 10.0_f32.powi(exponent);
            let scene = sphere(24, scale, Vec3::ZERO);
            let geometry = Geometry::new(&[&scene]).unwrap();
            for point in points(500) {
                let ray = Ray { origin: Vec3::ZERO, direction: direction(point) };
                let t = geometry.intersect(&ray, 0.0, f32::INFINITY).map(|hit| hit.t / scale);
                assert!(t.is_some_and(|t| (0.98..1.001).contains(&t)), "{scale} {t:?}");
            }
        }
    }

    #[test]
    fn equal_meshes_give_equal_hierarchies() {
        let build = || Geometry::new(&[&sphere(40, 1.0, Vec3::ZERO), &confetti(500)]).unwrap();
        let (a, b) = (build(), build());
        assert!(a.bvh == b.bvh && a.names == b.names);
    }
}
