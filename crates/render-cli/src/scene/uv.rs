//! Whether the uv of a mesh make it cloth: whether 1 of u or v is 1 m on the surface.

use glam::{DVec3, Vec2, Vec3};

use super::mesh::{self, Mesh};

/// How the uv of a mesh lie on its surface.
///
/// Stretch and shear are those of the linear maps from uv to the surface of the triangles, weighted
/// with their area there. What is called least and greatest leaves a thousandth of the area out at
/// that end, so that no sliver sways it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvReport {
    /// Whether all uv are the same: the mesh has none.
    pub missing: bool,
    /// Share of the surface that has no area in uv, in [0, 1].
    pub degenerate_share: f64,
    /// Share of the surface where u, v and normal are left-handed, in [0, 1]: the weave is mirrored.
    pub mirrored_share: f64,
    /// Least, median and greatest length on the surface of 1 unit of uv, over both principal
    /// directions of each triangle (the singular values of ∂P/∂(u, v)), in metres; all 0 where
    /// there is nothing to measure.
    pub stretch: [f64; 3],
    /// Greatest departure from a right angle between warp and weft, in degrees, in [0, 90].
    pub shear_deg: f64,
}

/// How far from isometric a cloth looks right.
const STRETCH: f64 = 0.1;
/// In degrees; woven cloth shears more than it stretches.
const SHEAR_DEG: f64 = 15.0;
/// Of the surface: what lies at seams and tips is not seen.
const SHARE: f64 = 1e-3;

/// Sine between two edges in uv below which their triangle has no area there: some roundings.
const LEAST_SINE: f32 = 1e-6;

impl UvReport {
    /// Measures a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let (mut area, mut degenerate, mut mirrored) = (0.0, 0.0, 0.0);
        let (mut stretches, mut shears) = (Vec::new(), Vec::new());
        for (index, triangle) in (0..).zip(mesh.triangles()) {
            let corners = mesh.corners(index);
            let weight = mesh::area(corners);
            area += weight;
            let uvs = triangle.map(|corner| mesh.uvs()[corner as usize]);
            let Some((dp_du, dp_dv)) = tangents(corners, uvs) else {
                degenerate += weight;
                continue;
            };
            // Anticlockwise in uv and on the surface are the same on its face.
            let [n_a, n_b, n_c] = triangle.map(|corner| mesh.normals()[corner as usize]);
            let faces = dp_du.cross(dp_dv).dot((n_a + n_b + n_c).as_dvec3()) >= 0.0;
            mirrored += if faces { 0.0 } else { weight };
            stretches.extend(singular_values(dp_du, dp_dv).map(|stretch| (stretch, weight)));
            shears.push((shear(dp_du, dp_dv), weight));
        }
        let share = |part: f64| if area > 0.0 { part / area } else { 0.0 };
        Self {
            missing: mesh.uvs().iter().all(|uv| *uv == mesh.uvs()[0]),
            degenerate_share: share(degenerate),
            mirrored_share: share(mirrored),
            stretch: [SHARE, 0.5, 1.0 - SHARE].map(|part| quantile(&mut stretches, part)),
            shear_deg: quantile(&mut shears, 1.0 - SHARE).to_degrees(),
        }
    }

    /// What cloth of these uv would look like, where it would not look like itself: each a line
    /// that begins with `uv`, without the name of the mesh.
    pub fn warnings(&self) -> Vec<String> {
        if self.missing {
            let expected = "expected lengths along the cloth in metres";
            return vec![format!(
                "uv: found none, {expected}: one point of it is all that is seen"
            )];
        }
        let mut warnings = Vec::new();
        if self.degenerate_share > SHARE {
            warnings.push(format!(
                "uv: found {:.1} % of the surface without area in uv, expected none: no threads \
                 are seen there",
                self.degenerate_share * 100.0
            ));
        }
        let [least, median, most] = self.stretch;
        if median == 0.0 {
            return warnings;
        }
        if self.mirrored_share > SHARE {
            warnings.push(format!(
                "uv: found {:.1} % of the surface mirrored, expected v to the left of u: the \
                 weave is seen as from its back, with the face's colours",
                self.mirrored_share * 100.0
            ));
        }
        if (median - 1.0).abs() > STRETCH {
            let median = three_digits(median);
            warnings.push(format!(
                "uv: found 1 unit to span {median} m on the surface (median), expected 1 m: the \
                 cloth is drawn at {median} times its size; give uv_scale {median}"
            ));
        }
        let (least, most) = (least / median, most / median);
        if least < 1.0 - STRETCH || most > 1.0 + STRETCH {
            warnings.push(format!(
                "uv: found a stretch of {least:.2} to {most:.2} times the median, expected {:.1} \
                 to {:.1}: threads are drawn thinner and thicker than they are",
                1.0 - STRETCH,
                1.0 + STRETCH
            ));
        }
        if self.shear_deg > SHEAR_DEG {
            warnings.push(format!(
                "uv: found warp and weft up to {:.0}° from a right angle, expected at most \
                 {SHEAR_DEG}°: threads are drawn askew",
                self.shear_deg
            ));
        }
        warnings
    }
}

/// A positive number to three digits or more.
fn three_digits(number: f64) -> String {
    let digits = (2.0 - number.log10().floor()).max(0.0) as usize;
    format!("{number:.digits$}")
}

/// [`mesh::tangents`], unless the triangle has no area in uv but for rounding.
fn tangents(corners: [Vec3; 3], uvs: [Vec2; 3]) -> Option<(DVec3, DVec3)> {
    let (d1, d2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    if d1.perp_dot(d2).abs() <= LEAST_SINE * d1.length() * d2.length() {
        return None;
    }
    let (dp_du, dp_dv) = mesh::tangents(corners, uvs)?;
    Some((dp_du.as_dvec3(), dp_dv.as_dvec3()))
}

/// The singular values of the matrix of two columns, the smaller first: half the sum and half the
/// difference of √(|u|² + |v|² ± 2 |u × v|), as their squares sum to |u|² + |v|² and their product
/// is |u × v|.
fn singular_values(u: DVec3, v: DVec3) -> [f64; 2] {
    let (squares, area) = (u.length_squared() + v.length_squared(), u.cross(v).length());
    let sum = (squares + 2.0 * area).sqrt();
    let difference = (squares - 2.0 * area).max(0.0).sqrt();
    [(sum - difference) / 2.0, (sum + difference) / 2.0]
}

/// Departure of the angle between two vectors from a right one, in radians.
fn shear(u: DVec3, v: DVec3) -> f64 {
    u.dot(v).abs().atan2(u.cross(v).length())
}

/// The value below which `part` of the weight lies; 0 of nothing.
fn quantile(values: &mut [(f64, f64)], part: f64) -> f64 {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut sum = 0.0;
    let found = values.iter().find(|(_, weight)| {
        sum += weight;
        sum >= part * total
    });
    found.or(values.last()).map_or(0.0, |(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use glam::Mat2;

    use super::*;
    use crate::scene::{drape::BuiltIn, drape::DEFAULT_SIDE, shape::Shape};

    /// The unit square with uv = `matrix` · (x, y).
    fn square(matrix: Mat2) -> Mesh {
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        Mesh::new(
            corners.map(|corner| corner.extend(2.0)).into(),
            vec![Vec3::Z; 4],
            corners.map(|corner| matrix * corner + Vec2::new(3.0, -5.0)).into(),
            vec![[0, 1, 2], [0, 2, 3]],
        )
        .unwrap()
    }

    fn warnings(matrix: Mat2) -> Vec<String> {
        UvReport::new(&square(matrix)).warnings()
    }

    #[test]
    fn isometric_uv_need_no_warning() {
        for angle in [0.0, 0.3, 2.0] {
            let report = UvReport::new(&square(Mat2::from_angle(angle)));
            assert!(report.stretch.iter().all(|s| (s - 1.0).abs() < 1e-5), "{report:?}");
            assert!(report.shear_deg < 1e-4, "{report:?}");
            assert_eq!((report.degenerate_share, report.mirrored_share), (0.0, 0.0));
            assert_eq!(report.warnings(), [""; 0]);
        }
        // The drape is as near to isometric as its simulation makes it.
        let drape = UvReport::new(&BuiltIn::new(DEFAULT_SIDE).unwrap().cloth);
        assert_eq!(drape.warnings(), [""; 0], "{drape:?}");
    }

    #[test]
    fn missing_uv_are_told() {
        let message = "uv: found none, expected lengths along the cloth in metres: one point of \
                       it is all that is seen";
        assert_eq!(warnings(Mat2::ZERO), [message]);
        let report = UvReport::new(&square(Mat2::ZERO));
        assert_eq!(report.stretch, [0.0; 3]);
        assert_eq!(report.degenerate_share, 1.0);
    }

    #[test]
    fn scale_is_told_with_what_mends_it() {
        let message = "uv: found 1 unit to span 0.250 m on the surface (median), expected 1 m: \
                       the cloth is drawn at 0.250 times its size; give uv_scale 0.250";
        assert_eq!(warnings(Mat2::from_diagonal(Vec2::splat(4.0))), [message]);
        let found = warnings(Mat2::from_diagonal(Vec2::splat(32768.0)));
        assert!(found[0].ends_with("give uv_scale 0.0000305"), "{found:?}");
        let found = warnings(Mat2::from_diagonal(Vec2::splat(1.0 / 64.0)));
        assert!(found[0].ends_with("give uv_scale 64.0"), "{found:?}");
        assert_eq!(warnings(Mat2::from_diagonal(Vec2::splat(4.0)) * 0.25), [""; 0]);
        assert_eq!(warnings(Mat2::from_diagonal(Vec2::splat(1.05))), [""; 0]);
    }

    #[test]
    fn stretch_is_that_of_the_singular_values() {
        // A rotation after a stretch, of singular values 2 and 1/2 from uv to the surface.
        let report = UvReport::new(&square(
            Mat2::from_angle(0.4) * Mat2::from_diagonal(Vec2::new(0.5, 2.0)),
        ));
        let [least, median, most] = report.stretch;
        assert!((least - 0.5).abs() < 1e-6 && (most - 2.0).abs() < 1e-5, "{report:?}");
        assert!((0.5 - 1e-6..=2.0 + 1e-5).contains(&median), "{report:?}");
        let found = report.warnings();
        assert!(found.iter().any(|text| text.starts_with("uv: found a stretch of ")), "{found:?}");
    }

    #[test]
    fn shear_is_told_in_degrees() {
        // u along x, v 30° from y, of lengths that keep both threads as they are.
        let (sin, cos) = 30.0_f32.to_radians().sin_cos();
        let surface = Mat2::from_cols(Vec2::X, Vec2::new(sin, cos));
        let report = UvReport::new(&square(surface.inverse()));
        assert!((report.shear_deg - 30.0).abs() < 1e-4, "{report:?}");
        let message = "uv: found warp and weft up to 30° from a right angle, expected at most 15°: \
                       threads are drawn askew";
        assert_eq!(report.warnings().last().unwrap(), message);
    }

    #[test]
    fn mirrored_and_degenerate_shares_are_told() {
        let message = "uv: found 100.0 % of the surface mirrored, expected v to the left of u: \
                       the weave is seen as from its back, with the face's colours";
        assert_eq!(warnings(Mat2::from_diagonal(Vec2::new(-1.0, 1.0))), [message]);
        let mut uvs = square(Mat2::IDENTITY).uvs().to_vec();
        uvs[3] = uvs[0].midpoint(uvs[2]);
        let square = square(Mat2::IDENTITY);
        let (positions, normals) = (square.positions().to_vec(), square.normals().to_vec());
        let mesh = Mesh::new(positions, normals, uvs, square.triangles().to_vec()).unwrap();
        let message = "uv: found 50.0 % of the surface without area in uv, expected none: no \
                       threads are seen there";
        assert_eq!(UvReport::new(&mesh).warnings(), [message]);
    }

    #[test]
    fn slivers_do_not_sway_the_extremes() {
        let square = square(Mat2::IDENTITY);
        let (mut positions, mut uvs) = (square.positions().to_vec(), square.uvs().to_vec());
        positions.push(Vec3::new(0.5, -1e-4, 2.0));
        uvs.push(Vec2::new(9.0, -9.0));
        let mut triangles = square.triangles().to_vec();
        triangles.push([0, 4, 1]);
        let mesh = Mesh::new(positions, vec![Vec3::Z; 5], uvs, triangles).unwrap();
        assert_eq!(UvReport::new(&mesh).warnings(), [""; 0]);
    }

    #[test]
    fn sphere_is_told_to_crowd_its_threads() {
        let found = UvReport::new(&Shape::Sphere { radius: 0.3 }.mesh().unwrap()).warnings();
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with("uv: found a stretch of 0.0"), "{found:?}");
    }
}
