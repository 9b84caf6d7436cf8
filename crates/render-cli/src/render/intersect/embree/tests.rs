use glam::{Affine3A, Vec3Swizzles};

use super::*;
use crate::{
    render::intersect::{
        hierarchy::Hierarchy,
        tests::{confetti, points, sphere},
    },
    scene::shape::Shape,
};

/// Rays that start in a box around the origin: through a pinhole, towards a lamp, and anywhere.
fn rays(count: u32, size: f32) -> Vec<Ray> {
    let ray = |(index, point): (usize, [f32; 3])| {
        let point = (Vec3::from_array(point) * 2.0 - 1.0) * size;
        let (origin, target) = match index / 64 % 3 {
            0 => (Vec3::new(0.0, -3.2, 2.2) * size, point.with_z(0.1)),
            1 => (point, Vec3::new(1.5, -1.5, 3.0) * size + 0.2 * point.zxy()),
            _ => (point, point + point.zxy().cross(point + 0.1)),
        };
        Ray { origin, direction: (target - origin).normalize() }
    };
    points(count).enumerate().map(ray).collect()
}

#[test]
fn both_traversals_find_the_same() {
    let one = sphere(12, 0.2, Vec3::ZERO);
    let placed = |k: u32| {
        let angle = k as f32;
        let place = Vec3::new(angle.sin(), angle.cos(), 0.1 * angle - 0.5);
        let squeeze = Vec3::new(1.0, 0.3 + 0.1 * angle, 1.0);
        let rotation = glam::Quat::from_rotation_x(angle);
        one.transformed(Affine3A::from_scale_rotation_translation(squeeze, rotation, place))
    };
    let instances: Vec<_> = (0..9).map(|k| placed(k).unwrap()).chain([confetti(500)]).collect();
    for meshes in [vec![Shape::Sheet.mesh().unwrap()], instances] {
        let meshes: Vec<_> = meshes.iter().collect();
        let ours = Hierarchy::new(&meshes, 1e-5).unwrap();
        let embree = Embree::new(&meshes, 1e-5).unwrap();
        let rays = rays(200_000, 1.0);
        let limits = [0.0, f32::INFINITY];
        let (mut hits, mut others) = (0, 0);
        let both = ours.intersect_all(&rays, 0.0).into_iter().zip(embree.intersect_all(&rays, 0.0));
        for (ray, (expected, found)) in rays.iter().zip(both) {
            assert_eq!(embree.intersect_where(ray, limits, |_| true), found, "{ray:?}");
            let occluded = ours.occluded_where(ray, limits, |_| true);
            assert_eq!(embree.occluded_where(ray, limits, |_| true), occluded, "{ray:?}");
            assert_eq!(found.is_some(), expected.is_some(), "{ray:?} {found:?} {expected:?}");
            let Some((expected, found)) = expected.zip(found) else { continue };
            hits += 1;
            // Along an edge either of its triangles is right.
            if (expected.mesh, expected.triangle) != (found.mesh, found.triangle) {
                others += 1;
                continue;
            }
            let difference = (expected.barycentrics - found.barycentrics).abs().max_element();
            assert!(difference < 1e-2, "{ray:?} {found:?} {expected:?}");
            assert!((expected.t - found.t).abs() < 1e-4, "{ray:?} {found:?} {expected:?}");
        }
        assert!(hits > 20_000 && others < hits / 10_000, "{others} of {hits}");

        // Up to what is hit, and somewhat beyond it or short of it.
        let segments: Vec<_> = rays
            .iter()
            .zip(ours.intersect_all(&rays, 0.0))
            .enumerate()
            .map(|(index, (&ray, hit))| {
                let t = hit.map_or(1.0, |hit| hit.t);
                (ray, [f32::INFINITY, t * 1.01, t * 0.99][index % 3])
            })
            .collect();
        let accept = |_: usize, hit: &Hit| !hit.triangle.is_multiple_of(3);
        let expected = ours.occluded_all_where(&segments, 0.0, accept);
        let found = embree.occluded_all_where(&segments, 0.0, accept);
        let others = expected.iter().zip(&found).filter(|(a, b)| a != b).count();
        let occluded = found.iter().filter(|&&occluded| occluded).count();
        assert!(occluded > 10_000 && others < 5, "{others} of {occluded}");
    }
}
