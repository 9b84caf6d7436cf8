use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3Swizzles};

use super::{hierarchy::tests::brute_force, *};

/// Halton points in [0, 1), base 2, 3 and 5.
pub(super) fn points(count: u32) -> impl Iterator<Item = [f32; 3]> {
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
pub(super) fn sphere(n: u32, radius: f32, centre: Vec3) -> Mesh {
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
pub(super) fn confetti(count: u32) -> Mesh {
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
        // Of rays aimed at vertices, Embree lets 1.3 % through.
        let most = [if cfg!(feature = "embree") { count / 50 } else { 0 }, 0, 0];
        let is_tight = (0..3).all(|kind| misses[kind] <= most[kind]);
        assert!(is_tight, "{misses:?} towards vertices, edges, anywhere: of {count} each");
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

/// Of distances: brute force has the arithmetic of our own traversal, to the bit.
const ROUNDING: f32 = if cfg!(feature = "embree") { 2e-6 } else { 0.0 };

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
        let difference = found.map_or(0.0, |hit| (hit.t - expected.unwrap_or(f32::NAN)).abs());
        assert_eq!(found.is_some(), expected.is_some(), "{ray:?} {t_min} {t_max}");
        assert!(difference <= ROUNDING, "{ray:?} {t_min} {t_max} {found:?} {expected:?}");
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
    let hits = |triangle| geometry.occluded_where(&ray, 0.0, 2.0, |hit| hit.triangle == triangle);
    let hits = [hits(0), hits(1)];
    // Embree takes both for hit.
    let is_right = hits == [false, true] || cfg!(feature = "embree") && hits[1];
    assert!(is_right, "{hits:?}");
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
    let heap = |triangle, count| mesh(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![triangle; count]);
    let geometry = Geometry::new(&[&heap([0, 1, 1], 5000), &heap([0, 1, 2], 150)]).unwrap();
    let ray = Ray { origin: Vec3::new(0.2, 0.2, 1.0), direction: -Vec3::Z };
    // Embree rounds as its instructions do.
    let is_hit = |geometry: &Geometry| {
        let t = geometry.intersect(&ray, 0.0, 2.0).unwrap().t;
        (t - 1.0).abs() < f32::EPSILON
    };
    assert!(is_hit(&geometry));
    let mut seen = 0;
    assert!(!geometry.occluded_where(&ray, 0.0, 2.0, |_| {
        seen += 1;
        false
    }));
    assert_eq!(seen, 150);
    match Geometry::new(&[&heap([0, 1, 2], 5000)]) {
        Ok(geometry) => assert!(is_hit(&geometry)),
        Err(error) => assert!(matches!(error, GeometryError::TooDeep(_)), "{error}"),
    }
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

/// The geometry as the least processor has it. Embree knows by itself which it has.
fn at_baseline(geometry: Geometry) -> Geometry {
    #[cfg(not(feature = "embree"))]
    let geometry = {
        let mut geometry = geometry;
        geometry.traversal.level = fearless_simd::Level::baseline();
        geometry
    };
    geometry
}

#[test]
fn many_rays_at_once_find_what_each_finds() {
    let meshes = [&confetti(3000), &sphere(20, 0.4, Vec3::splat(0.5))];
    let geometry = Geometry::new(&meshes).unwrap();
    let plain = at_baseline(Geometry::new(&meshes).unwrap());
    // From one place into similar directions, from similar places, anywhere, and towards vertices.
    let vertices = meshes[1].positions();
    let rays: Vec<_> = points(4000)
        .enumerate()
        .map(|(index, point)| {
            let point = Vec3::from_array(point);
            let (origin, target) = match index / 64 % 4 {
                0 => (Vec3::new(-1.5, 0.4, 0.7), point * 0.3 + 0.3),
                1 => (point * 0.1 + Vec3::new(0.5, 0.2, -0.5), point.yzx()),
                2 => (point, point.zxy() + 1e-3),
                _ => (Vec3::new(0.5, 0.5, 2.0), vertices[index % vertices.len()]),
            };
            let mut direction = (target - origin).normalize();
            match index % 97 {
                0 => direction[index % 3] = 0.0,
                1 => direction = Vec3::NEG_Z,
                2 => direction[index % 3] = f32::NAN,
                _ => {}
            }
            Ray { origin, direction }
        })
        .collect();
    let alone: Vec<_> =
        rays.iter().map(|ray| geometry.intersect(ray, 0.0, f32::INFINITY)).collect();
    let hits = alone.iter().flatten().count();
    assert!((1000..3900).contains(&hits), "{hits}");
    for at_once in [1, 5, 16, 64, 4000] {
        for geometry in [&geometry, &plain] {
            let found: Vec<_> =
                rays.chunks(at_once).flat_map(|rays| geometry.intersect_all(rays, 0.0)).collect();
            for ((ray, alone), found) in rays.iter().zip(&alone).zip(&found) {
                assert_eq!(found, alone, "{at_once}: {ray:?}");
            }
            // Past, at and before the first hit.
            let segments: Vec<_> = rays
                .iter()
                .zip(&alone)
                .enumerate()
                .map(|(index, (&ray, hit))| {
                    let t = hit.map_or(1.0, |hit| hit.t);
                    (ray, [f32::INFINITY, t.next_up(), t, f32::NAN][index % 4])
                })
                .collect();
            let accept = |hit: &Hit| !hit.triangle.is_multiple_of(3);
            let found = segments.chunks(at_once).flat_map(|segments| {
                geometry.occluded_all_where(segments, 0.0, |_, hit| accept(hit))
            });
            for ((ray, distance), found) in segments.iter().zip(found) {
                let alone = geometry.occluded_where(ray, 0.0, *distance, accept);
                assert_eq!(found, alone, "{at_once}: {ray:?} {distance}");
            }
        }
    }
}

#[test]
fn of_two_hits_at_one_distance_the_first_triangle_counts() {
    let square = |order: [[u32; 3]; 2]| {
        mesh(vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y], order.to_vec())
    };
    // Along the diagonal that both triangles share.
    let rays: Vec<_> = (1..8)
        .map(|k| Ray {
            origin: Vec3::new(k as f32 / 8.0, k as f32 / 8.0, 1.0),
            direction: -Vec3::Z,
        })
        .collect();
    for order in [[[0, 1, 2], [0, 2, 3]], [[0, 2, 3], [0, 1, 2]]] {
        let geometry = Geometry::new(&[&square(order), &square(order)]).unwrap();
        for (ray, hit) in rays.iter().zip(geometry.intersect_all(&rays, 0.0)) {
            assert_eq!(hit.map(|hit| (hit.mesh, hit.triangle)), Some((0, 0)), "{ray:?}");
            assert_eq!(geometry.intersect(ray, 0.0, 2.0), hit, "{ray:?}");
        }
    }
}
