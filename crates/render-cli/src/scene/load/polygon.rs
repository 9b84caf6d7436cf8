//! Polygons as triangles.

use glam::{DVec2, DVec3, Vec3};

/// Cuts the polygon of these `corners`, indices into `positions` that run around it, into
/// triangles of the same sense, two fewer than corners: along diagonals inside it where it lies
/// more or less in a plane and does not cross itself (by ears, Meisters 1975), and somehow where
/// it does not. Fewer than three corners make none.
///
/// # Panics
///
/// When a corner is not below the number of positions.
pub(super) fn triangulate(positions: &[Vec3], corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let &[a, b, c] = corners {
        triangles.push([a, b, c]);
        return;
    }
    let outline = flatten(corners.iter().map(|&corner| positions[corner as usize].as_dvec3()));
    // What is left of the polygon, as indices into the corners.
    let mut left: Vec<usize> = (0..corners.len()).collect();
    while left.len() > 2 {
        // From the second corner on, convex polygons become the fan around their first.
        let mut order = (1..left.len()).chain([0]);
        let ear = order.find(|&at| is_ear(&outline, &left, at)).unwrap_or(1);
        let (before, after) = neighbours(&left, ear);
        triangles.push([before, left[ear], after].map(|index| corners[index]));
        left.remove(ear);
    }
}

/// The points in the plane that faces the way the polygon does on the whole (Newell's normal), so
/// that they run anticlockwise.
fn flatten(points: impl Iterator<Item = DVec3>) -> Vec<DVec2> {
    let points: Vec<_> = points.collect();
    let Some(&origin) = points.first() else { return Vec::new() };
    let normal: DVec3 = points
        .windows(2)
        .map(|pair| (pair[0] - origin).cross(pair[1] - origin))
        .sum::<DVec3>()
        .normalize_or(DVec3::Z);
    let (x, y) = normal.any_orthonormal_pair();
    points
        .iter()
        .map(|point| DVec2::new((point - origin).dot(x), (point - origin).dot(y)))
        .collect()
}

fn neighbours(left: &[usize], at: usize) -> (usize, usize) {
    (left[(at + left.len() - 1) % left.len()], left[(at + 1) % left.len()])
}

/// Whether the corner at `at` of what is `left` juts out, with no other corner in its triangle.
fn is_ear(outline: &[DVec2], left: &[usize], at: usize) -> bool {
    let (before, after) = neighbours(left, at);
    let [a, b, c] = [before, left[at], after].map(|index| outline[index]);
    if (b - a).perp_dot(c - b) <= 0.0 {
        return false;
    }
    !left.iter().map(|&index| outline[index]).any(|point| {
        // A corner at the place of one of the ear's touches it, but is not in the way.
        ![a, b, c].contains(&point)
            && (b - a).perp_dot(point - a) >= 0.0
            && (c - b).perp_dot(point - b) >= 0.0
            && (a - c).perp_dot(point - c) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh;

    fn cut(outline: &[(f32, f32)]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        // In a plane of no special direction.
        let (x, y) = (Vec3::new(0.8, 0.0, 0.6), Vec3::new(0.36, 0.8, -0.48));
        let points: Vec<_> = outline.iter().map(|&(u, v)| x * u + y * v + Vec3::ONE).collect();
        let corners: Vec<_> = (0..points.len() as u32).collect();
        let mut triangles = Vec::new();
        triangulate(&points, &corners, &mut triangles);
        (points, triangles)
    }

    /// That the triangles cover the outline once: they face its way, and their areas sum to its.
    fn check(outline: &[(f32, f32)], area: f64) {
        for turn in 0..outline.len() {
            let mut outline = outline.to_vec();
            outline.rotate_left(turn);
            let (points, triangles) = cut(&outline);
            assert_eq!(triangles.len(), outline.len() - 2);
            let facing = Vec3::new(0.8, 0.0, 0.6).cross(Vec3::new(0.36, 0.8, -0.48));
            let mut sum = 0.0;
            for triangle in &triangles {
                let [a, b, c] = triangle.map(|index| points[index as usize]);
                assert!((b - a).cross(c - a).dot(facing) > -1e-6, "{outline:?}: {triangle:?}");
                sum += mesh::area([a, b, c]);
            }
            assert!((sum - area).abs() < 1e-5, "{outline:?}: {sum}, expected {area}");
        }
    }

    #[test]
    fn polygons_are_covered_once_whatever_their_first_corner() {
        check(&[(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)], 2.0);
        // Concave: an arrow, an L, a comb.
        check(&[(0.0, 0.0), (1.0, 1.0), (0.0, 3.0), (-1.0, 1.0)], 3.0);
        check(&[(0.0, 0.0), (2.0, 0.5), (0.0, 3.0), (0.5, 0.5)], 2.25);
        check(&[(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)], 5.0);
        let comb =
            [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (3.0, 2.0), (2.5, 1.0), (2.0, 2.0), (0.0, 2.0)];
        check(&comb, 7.5);
        // With a corner amid a side.
        check(&[(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], 1.0);
    }

    #[test]
    fn what_is_no_polygon_is_cut_somehow() {
        assert!(cut(&[]).1.is_empty());
        assert!(cut(&[(0.0, 0.0), (1.0, 0.0)]).1.is_empty());
        assert_eq!(cut(&[(0.0, 0.0); 5]).1.len(), 3);
        assert_eq!(cut(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]).1.len(), 2);
    }
}
