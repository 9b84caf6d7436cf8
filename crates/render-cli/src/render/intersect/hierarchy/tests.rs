use super::*;
use crate::render::intersect::tests::{confetti, points, sphere};

fn hierarchy(meshes: &[&Mesh]) -> Hierarchy {
    Hierarchy::new(meshes, 1e-5).unwrap()
}

/// The distance of the nearest hit, by a test of each triangle.
pub(in crate::render::intersect) fn brute_force(
    meshes: &[&Mesh],
    ray: &Ray,
    t_min: f32,
    t_max: f32,
) -> Option<f32> {
    let test = TriangleTest::new(ray)?;
    let level = Level::baseline();
    let corners = meshes.iter().flat_map(|m| (0..m.triangles().len()).map(|t| m.corners(t as u32)));
    let hits = corners.filter_map(|corners| {
        let block = Block::new([corners].into_iter());
        dispatch!(level, simd => {
            test.hits(simd, &block, [t_min, t_max]).map(|hits| hits.t[0])
        })
    });
    hits.reduce(f32::min)
}

#[test]
fn equal_meshes_give_equal_hierarchies() {
    let build = || hierarchy(&[&sphere(40, 1.0, Vec3::ZERO), &confetti(500)]);
    let (a, b) = (build(), build());
    assert!(a.tree == b.tree && a.blocks == b.blocks && a.names == b.names);
}

#[test]
fn each_level_of_the_processor_gives_the_same_bits() {
    let build = || hierarchy(&[&confetti(3000), &sphere(20, 0.4, Vec3::splat(0.5))]);
    let (best, mut plain) = (build(), build());
    plain.level = Level::baseline();
    for point in points(4000) {
        let origin = Vec3::from_array(point) * 3.0 - Vec3::ONE;
        let direction = (Vec3::from_array([point[1], point[2], point[0]]) - origin).normalize();
        let ray = Ray { origin, direction };
        let found = [&best, &plain]
            .map(|hierarchy| hierarchy.intersect_where(&ray, [0.0, f32::INFINITY], |_| true));
        assert_eq!(found[0], found[1], "{ray:?}");
    }
}
