//! Triangle meshes: positions, shading normals and cloth coordinates.

use glam::{Affine3A, DAffine3, Mat3, Vec2, Vec3};
use thiserror::Error;

use super::placement::Placement;

/// An indexed triangle mesh in world space: metres, right-handed, z up.
///
/// The texture coordinates are lengths along the cloth in metres: u along the weft (the shading
/// frame's x), v along the warp (its y). On cloth that is not stretched the mapping is isometric,
/// |∂P/∂u| = |∂P/∂v| = 1, so a thread of spacing s lies every s of u or v.
///
/// Every vertex has a position, a unit normal and a uv, all finite; every index is in range.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

/// The surface at one point of a mesh, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position in metres, interpolated from the corners: more exact than `origin + t · direction`.
    pub position: Vec3,
    /// Unit normal of the flat triangle, on the side from which its corners run anticlockwise.
    pub geometric_normal: Vec3,
    /// Unit shading normal, interpolated.
    pub normal: Vec3,
    /// Position on the cloth in metres, interpolated.
    pub uv: Vec2,
    /// ∂P/∂u of the triangle: the weft's direction; its length is the stretch.
    pub dp_du: Vec3,
    /// ∂P/∂v of the triangle: the warp's direction; its length is the stretch.
    pub dp_dv: Vec3,
}

/// Why vertex and index lists do not make a [`Mesh`].
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// A list of vertex attributes is shorter or longer than the list of positions.
    #[error("mesh: found {found} {attribute}, expected {expected}, one per position")]
    AttributeCount {
        /// `normals` or `uvs`.
        attribute: &'static str,
        /// Length of the attribute's list.
        found: usize,
        /// Number of positions.
        expected: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("mesh triangle {triangle}: found vertex {index}, expected below {vertices}")]
    IndexOutOfRange {
        /// Which triangle, from 0.
        triangle: usize,
        /// The index found.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// An attribute of a vertex is infinite, not a number, or a normal of no length.
    #[error("mesh vertex {vertex}: found {attribute} {found}, expected {expected}")]
    BadAttribute {
        /// Which vertex, from 0.
        vertex: usize,
        /// `position`, `normal` or `uv`.
        attribute: &'static str,
        /// The value found.
        found: String,
        /// What would be accepted.
        expected: &'static str,
    },
    /// A transform that flattens the mesh, or has entries that are not finite.
    #[error("mesh transform: found columns {columns}, expected an invertible matrix")]
    Singular {
        /// The images of the unit vectors along x, y and z.
        columns: String,
    },
}

impl Mesh {
    /// A mesh from its lists; normals are scaled to unit length.
    ///
    /// # Errors
    ///
    /// [`MeshError`] when the lists differ in length, an index is out of range, or a value is not
    /// finite.
    pub fn new(
        positions: Vec<Vec3>,
        mut normals: Vec<Vec3>,
        uvs: Vec<Vec2>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        check_topology(&positions, &uvs, &triangles)?;
        if normals.len() != positions.len() {
            return Err(MeshError::AttributeCount {
                attribute: "normals",
                found: normals.len(),
                expected: positions.len(),
            });
        }
        for (vertex, normal) in normals.iter_mut().enumerate() {
            *normal = normal.try_normalize().ok_or_else(|| MeshError::BadAttribute {
                vertex,
                attribute: "normal",
                found: normal.to_string(),
                expected: "a finite vector that is not zero",
            })?;
        }
        Ok(Self { positions, normals, uvs, triangles })
    }

    /// A mesh whose normals are those of [`smooth_normals`].
    ///
    /// # Errors
    ///
    /// As for [`Mesh::new`].
    pub fn with_smooth_normals(
        positions: Vec<Vec3>,
        uvs: Vec<Vec2>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        check_topology(&positions, &uvs, &triangles)?;
        let normals = smooth_normals(&positions, &triangles);
        Ok(Self { positions, normals, uvs, triangles })
    }

    /// The mesh with all its points taken where `transform` takes them. Normals stay perpendicular
    /// to the surface, and both they and the order of corners on its same side, even under a
    /// reflection. The uv stay as they are: where the transform stretches, so does the cloth, and a
    /// reflection shows its weave mirrored.
    ///
    /// # Errors
    ///
    /// [`MeshError::Singular`] when the transform is not invertible, and
    /// [`MeshError::BadAttribute`] when a position comes to lie out of the range of numbers.
    pub fn transformed(&self, transform: Affine3A) -> Result<Self, MeshError> {
        let map = DAffine3::from_mat3_translation(
            transform.matrix3.as_dmat3(),
            transform.translation.as_dvec3(),
        );
        let placement = Placement::new(map).ok_or_else(|| {
            let columns = transform.matrix3.to_cols_array_2d().map(|column| format!("{column:?}"));
            MeshError::Singular { columns: columns.join(", ") }
        })?;
        Self::new(
            self.positions.iter().map(|&position| placement.position(position)).collect(),
            self.normals.iter().map(|&normal| placement.normal(normal)).collect(),
            self.uvs.clone(),
            self.triangles.iter().map(|&triangle| placement.triangle(triangle)).collect(),
        )
    }

    /// Area of all triangles in square metres.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len() as u32).map(|triangle| area(self.corners(triangle))).sum()
    }

    /// The mesh with its cloth coordinates multiplied by `factor`.
    pub fn with_uv_scaled(mut self, factor: f32) -> Self {
        for uv in &mut self.uvs {
            *uv *= factor;
        }
        self
    }

    /// Vertex positions in metres.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Unit shading normals, one per vertex.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Cloth coordinates in metres, one per vertex.
    pub fn uvs(&self) -> &[Vec2] {
        &self.uvs
    }

    /// Corners of each triangle as indices into the vertex lists.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corner positions of a triangle.
    ///
    /// # Panics
    ///
    /// When `triangle` is not below the number of triangles.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// Position on the cloth in metres, as [`Mesh::surface`] has it; in a fraction of its time.
    ///
    /// # Panics
    ///
    /// When `triangle` is not below the number of triangles.
    pub fn uv(&self, triangle: u32, barycentrics: Vec3) -> Vec2 {
        let [a, b, c] = self.triangles[triangle as usize].map(|i| self.uvs[i as usize]);
        a * barycentrics.x + b * barycentrics.y + c * barycentrics.z
    }

    /// The surface at the point of `triangle` whose weights of the three corners are
    /// `barycentrics` (≥ 0, sum 1), as a [`Hit`](crate::render::intersect::Hit) reports them.
    ///
    /// Total: a triangle without area takes its shading normal for the geometric one, and one
    /// without area in uv gets two perpendicular unit tangents of arbitrary azimuth.
    ///
    /// # Panics
    ///
    /// When `triangle` is not below the number of triangles.
    pub fn surface(&self, triangle: u32, barycentrics: Vec3) -> SurfacePoint {
        let [ia, ib, ic] = self.triangles[triangle as usize].map(|i| i as usize);
        let weights = barycentrics.to_array();
        let mix =
            |list: &[Vec3]| list[ia] * weights[0] + list[ib] * weights[1] + list[ic] * weights[2];
        let (a, b, c) = (self.positions[ia], self.positions[ib], self.positions[ic]);
        let (uv_a, uv_b, uv_c) = (self.uvs[ia], self.uvs[ib], self.uvs[ic]);
        let normal = mix(&self.normals).normalize_or(self.normals[ia]);
        let (dp_du, dp_dv) = tangents([a, b, c], [uv_a, uv_b, uv_c])
            .unwrap_or_else(|| normal.any_orthonormal_pair());
        SurfacePoint {
            position: mix(&self.positions),
            geometric_normal: (b - a).cross(c - a).normalize_or(normal),
            normal,
            uv: self.uv(triangle, barycentrics),
            dp_du,
            dp_dv,
        }
    }
}

impl SurfacePoint {
    /// The shading frame as columns x, y, z in world space: orthonormal and right-handed, z the
    /// shading normal and x along the weft, ∂P/∂u made perpendicular to z.
    pub fn frame(&self) -> Mat3 {
        let z = self.normal;
        let x = self.dp_du.reject_from_normalized(z).normalize_or(z.any_orthonormal_vector());
        Mat3::from_cols(x, z.cross(x), z)
    }
}

/// Area of a triangle in square metres, in double precision.
pub fn area(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a).length() / 2.0
}

/// (∂P/∂u, ∂P/∂v) of the linear map that takes three uv points to three positions, both lists in
/// the same order; `None` when the uv points lie on a line.
///
/// ```text
/// [∂P/∂u ∂P/∂v] = [b−a c−a] · [uv_b−uv_a uv_c−uv_a]⁻¹
/// ```
pub fn tangents(corners: [Vec3; 3], uvs: [Vec2; 3]) -> Option<(Vec3, Vec3)> {
    let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let (d1, d2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let det = d1.perp_dot(d2);
    let (dp_du, dp_dv) = ((e1 * d2.y - e2 * d1.y) / det, (e2 * d1.x - e1 * d2.x) / det);
    (dp_du.is_finite() && dp_dv.is_finite()).then_some((dp_du, dp_dv))
}

/// Unit vertex normals: the mean of the normals of the triangles around a vertex, each weighted
/// with its angle at the vertex, which does not depend on how the surface is cut into triangles
/// (Thürmer & Wüthrich 1998). A vertex without triangles of any area gets +z.
///
/// # Panics
///
/// When an index is not below the number of positions.
pub fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles {
        let p = triangle.map(|i| positions[i as usize]);
        let Some(normal) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else { continue };
        for corner in 0..3 {
            let (to_next, to_last) =
                (p[(corner + 1) % 3] - p[corner], p[(corner + 2) % 3] - p[corner]);
            normals[triangle[corner] as usize] += normal * to_next.angle_between(to_last);
        }
    }
    for normal in &mut normals {
        *normal = normal.normalize_or(Vec3::Z);
    }
    normals
}

fn check_topology(
    positions: &[Vec3],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
) -> Result<(), MeshError> {
    if uvs.len() != positions.len() {
        return Err(MeshError::AttributeCount {
            attribute: "uvs",
            found: uvs.len(),
            expected: positions.len(),
        });
    }
    let bad = |vertex, attribute, found| {
        Err(MeshError::BadAttribute { vertex, attribute, found, expected: "finite numbers" })
    };
    for (vertex, (position, uv)) in positions.iter().zip(uvs).enumerate() {
        if !position.is_finite() {
            return bad(vertex, "position", position.to_string());
        }
        if !uv.is_finite() {
            return bad(vertex, "uv", uv.to_string());
        }
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= positions.len()) {
            let vertices = positions.len();
            return Err(MeshError::IndexOutOfRange { triangle, index, vertices });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    /// Two triangles that lie on a plane through `origin` spanned by `du` and `dv`, uv in [0, 1]².
    fn patch(origin: Vec3, du: Vec3, dv: Vec3) -> Mesh {
        let uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        let positions = uvs.iter().map(|uv| origin + du * uv.x + dv * uv.y).collect();
        Mesh::with_smooth_normals(positions, uvs, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    #[test]
    fn tangents_invert_the_uv_map() {
        let (du, dv) = (Vec3::new(0.8, 0.1, 0.3), Vec3::new(-0.2, 1.1, 0.4));
        let mesh = patch(Vec3::new(3.0, -1.0, 2.0), du, dv);
        for triangle in 0..2 {
            let point = mesh.surface(triangle, Vec3::new(0.2, 0.3, 0.5));
            assert!(point.dp_du.abs_diff_eq(du, 2e-6), "{:?} {du:?}", point.dp_du);
            assert!(point.dp_dv.abs_diff_eq(dv, 2e-6), "{:?} {dv:?}", point.dp_dv);
            let expected = mesh.positions()[0] + du * point.uv.x + dv * point.uv.y;
            assert!(point.position.abs_diff_eq(expected, 1e-6), "{point:?} {expected:?}");
            assert!(point.normal.abs_diff_eq(du.cross(dv).normalize(), 1e-6), "{point:?}");
        }
    }

    #[test]
    fn frame_is_orthonormal_and_right_handed() {
        let mesh = patch(Vec3::ZERO, Vec3::new(1.0, 0.2, 0.1), Vec3::new(0.3, 0.9, -0.2));
        let frame = mesh.surface(1, Vec3::splat(1.0 / 3.0)).frame();
        let product = frame.transpose() * frame;
        assert!(product.abs_diff_eq(Mat3::IDENTITY, 1e-6), "{product}");
        assert!((frame.determinant() - 1.0).abs() < 1e-6, "{frame}");
    }

    #[test]
    fn degenerate_triangles_still_have_a_frame() {
        let positions = vec![Vec3::X; 3];
        let mesh =
            Mesh::with_smooth_normals(positions, vec![Vec2::ONE; 3], vec![[0, 1, 2]]).unwrap();
        let point = mesh.surface(0, Vec3::new(0.5, 0.25, 0.25));
        assert_eq!(point.geometric_normal, Vec3::Z);
        assert!((point.frame().determinant() - 1.0).abs() < 1e-6, "{point:?}");
    }

    #[test]
    fn smooth_normals_of_a_cube_corner_do_not_depend_on_the_diagonals() {
        // Three unit squares meet at the origin; each is cut so that one or two triangles touch it.
        let positions =
            [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]
                .map(|(x, y, z)| Vec3::new(x as f32, y as f32, z as f32));
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5], [0, 5, 6], [0, 6, 1]];
        let normal = smooth_normals(&positions, &triangles)[0];
        let expected = Vec3::ONE.normalize();
        assert!(normal.abs_diff_eq(expected, 1e-6), "{normal:?} {expected:?}");
    }

    #[test]
    fn transforms_keep_normals_upright_and_faces_consistent() {
        let mesh = patch(Vec3::ONE, Vec3::new(1.0, 0.2, 0.1), Vec3::new(0.3, 0.9, -0.2));
        let rotation = Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.1);
        let moved = Vec3::new(5.0, -3.0, 2.0);
        // Plain, skewing and mirroring, all away from uniform scales, and a thousandth in size.
        for scale in [Vec3::new(1.0, 2.0, 0.5), Vec3::new(-1.0, 2.0, 0.5), Vec3::splat(-1e-3)] {
            let transform = Affine3A::from_scale_rotation_translation(scale, rotation, moved);
            let image = mesh.transformed(transform).unwrap();
            for triangle in 0..2 {
                let (before, after) =
                    (mesh.surface(triangle, Vec3::X), image.surface(triangle, Vec3::X));
                let expected = transform.transform_point3(before.position);
                assert!(after.position.abs_diff_eq(expected, 1e-5), "{after:?} {expected:?}");
                // Perpendicular to the image of the surface, and on the side of what lay above.
                for tangent in [before.dp_du, before.dp_dv] {
                    let tangent = transform.transform_vector3(tangent).normalize();
                    assert!(after.normal.dot(tangent).abs() < 1e-5, "{scale} {after:?}");
                }
                let above = transform.transform_vector3(before.normal);
                assert!(after.normal.dot(above) > 0.0, "{scale} {after:?}");
                assert!(after.geometric_normal.dot(after.normal) > 0.999, "{scale} {after:?}");
            }
            // A plane's area grows by the length of the image of its normal's cofactor.
            let cofactor = transform.matrix3.determinant()
                * transform.matrix3.inverse().transpose().mul_vec3(mesh.normals()[0]).length();
            let expected = mesh.area() * f64::from(cofactor.abs());
            // Some metres away, positions round to a few 10⁻⁷ m, of sides of a millimetre.
            assert!((image.area() / expected - 1.0).abs() < 1e-3, "{} {expected}", image.area());
        }
        let same = mesh.transformed(Affine3A::IDENTITY).unwrap();
        assert_eq!((same.positions(), same.triangles()), (mesh.positions(), mesh.triangles()));
    }

    #[test]
    fn transforms_that_flatten_are_refused() {
        let mesh = patch(Vec3::ZERO, Vec3::X, Vec3::Y);
        let flat = Affine3A::from_scale(Vec3::new(2.0, 3.0, 0.0));
        assert_eq!(
            mesh.transformed(flat).unwrap_err().to_string(),
            "mesh transform: found columns [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 0.0], \
             expected an invertible matrix"
        );
        let onto_a_plane = Affine3A::from_mat3(Mat3::from_cols(
            Vec3::new(0.1, 0.2, 0.3),
            Vec3::new(0.3, 0.3, 0.1),
            Vec3::new(0.4, 0.5, 0.4),
        ));
        let broken = [
            onto_a_plane,
            Affine3A::from_scale(Vec3::new(1.0, f32::NAN, 1.0)),
            Affine3A::from_translation(Vec3::new(f32::INFINITY, 0.0, 0.0)),
        ];
        for transform in broken {
            let error = mesh.transformed(transform).unwrap_err();
            assert!(matches!(error, MeshError::Singular { .. }), "{transform:?} {error}");
        }
        let tiny = mesh.transformed(Affine3A::from_scale(Vec3::splat(1e-30))).unwrap();
        assert_eq!(tiny.normals(), mesh.normals());
        let mut far = Affine3A::from_scale(Vec3::splat(f32::MAX));
        far.translation.x = f32::MAX;
        assert_eq!(
            mesh.transformed(far).unwrap_err().to_string(),
            "mesh vertex 1: found position [inf, 0, 0], expected finite numbers"
        );
    }

    #[test]
    fn lists_that_do_not_fit_are_refused() {
        let triangle = || vec![[0, 1, 2]];
        let positions = || vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let uvs = || vec![Vec2::ZERO; 3];
        let message = |result: Result<Mesh, MeshError>| result.unwrap_err().to_string();
        assert_eq!(
            message(Mesh::new(positions(), vec![Vec3::Z; 2], uvs(), triangle())),
            "mesh: found 2 normals, expected 3, one per position"
        );
        assert_eq!(
            message(Mesh::new(positions(), vec![Vec3::Z, Vec3::ZERO, Vec3::Z], uvs(), triangle())),
            "mesh vertex 1: found normal [0, 0, 0], expected a finite vector that is not zero"
        );
        assert_eq!(
            message(Mesh::with_smooth_normals(positions(), vec![], triangle())),
            "mesh: found 0 uvs, expected 3, one per position"
        );
        assert_eq!(
            message(Mesh::with_smooth_normals(positions(), uvs(), vec![[0, 1, 3]])),
            "mesh triangle 0: found vertex 3, expected below 3"
        );
        let broken = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, f32::NAN, 0.0)];
        assert_eq!(
            message(Mesh::with_smooth_normals(broken, uvs(), triangle())),
            "mesh vertex 2: found position [0, NaN, 0], expected finite numbers"
        );
    }
}
