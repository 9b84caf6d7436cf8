//! Shapes without a file.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::mesh::{self, Mesh, MeshError};

/// A shape in metres around the origin, to be placed by [`Mesh::transformed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A rectangle at z = 0 that faces +z. u runs along x and v along y, both from 0 at the lower
    /// left corner: isometric.
    Plane {
        /// Length along x in metres, within [`SIZES`].
        width: f32,
        /// Length along y in metres, within [`SIZES`].
        height: f32,
    },
    /// A sphere that faces outwards. u runs along the equator from +x over +y, v along the
    /// meridians from the south pole (0) to the north pole. No uv of a sphere is isometric: here
    /// v is, and so is u at the equator, but at latitude λ the threads along v lie cos λ as far
    /// apart as they should, and meet at the poles.
    Sphere {
        /// In metres, within [`SIZES`].
        radius: f32,
    },
    /// The mantle of a cylinder around z, without its ends, that faces outwards. u runs around it
    /// from +x over +y and v along z from the lower end, both from 0: isometric, but for u along
    /// the chords that stand for arcs, which are 2.6 × 10⁻⁵ shorter.
    Cylinder {
        /// In metres, within [`SIZES`].
        radius: f32,
        /// Length along z in metres, within [`SIZES`].
        height: f32,
    },
    /// A wavy sheet over x, y ∈ [−1, 1], of 512 × 512 vertices, that faces up: a fixed shape to
    /// compare renderers on. With r and φ the polar coordinates of (x, y):
    ///
    /// ```text
    /// z = 0.45 exp(−1.2 (r/0.55)²) + 0.05 sin(9 φ) max(r − 0.3, 0) + 0.02 sin(14 x + 3 y)
    /// ```
    ///
    /// uv = ((x + 1)/2, (y + 1)/2): unlike that of the other shapes it is not in metres, but 1 unit
    /// spans 2 m where the sheet is level, and more on its slopes.
    Sheet,
    /// A square sample of cloth around z = 0, of 256 × 256 vertices, that lies flat and faces up but
    /// for its wrinkles: creases across it, pressed when it was folded and put away. u runs along
    /// x and v along y, both from 0 at the lower left corner, in metres where it is level; on the
    /// slopes of its wrinkles, of up to 26°, threads are up to 11 % longer.
    Wrinkled {
        /// In metres, within [`SIZES`].
        side: f32,
    },
}

/// Least and greatest length of a shape, in metres.
pub const SIZES: [f32; 2] = [1e-6, 1e6];

/// Why there is no such shape.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length is out of range.
    #[error("{shape}: found a {name} of {found} m, expected {} to {}", SIZES[0], SIZES[1])]
    Size {
        /// `plane`, `sphere`, `cylinder` or `wrinkled`.
        shape: &'static str,
        /// `width`, `height`, `radius` or `side`.
        name: &'static str,
        /// The length found.
        found: f32,
    },
    /// The vertices make no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Pieces of a full turn.
const PIECES: u32 = 256;

impl Shape {
    /// The shape as triangles.
    ///
    /// # Errors
    ///
    /// [`ShapeError::Size`] when a length is not within [`SIZES`].
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        match *self {
            Self::Plane { width, height } => {
                check("plane", &[("width", width), ("height", height)])?;
                let size = DVec2::new(width.into(), height.into());
                grid([1, 1], |at| Vertex {
                    position: ((at - 0.5) * size).extend(0.0),
                    normal: DVec3::Z,
                    uv: at * size,
                })
            }
            Self::Sphere { radius } => {
                check("sphere", &[("radius", radius)])?;
                let radius = f64::from(radius);
                grid([PIECES, PIECES / 2], |at| {
                    // From the nearer pole, so that both are one point.
                    let ring = (at.y.min(1.0 - at.y) * PI).sin();
                    let normal = (around(at.x) * ring).extend(-(at.y * PI).cos());
                    let uv = at * DVec2::new(TAU, PI) * radius;
                    Vertex { position: normal * radius, normal, uv }
                })
            }
            Self::Cylinder { radius, height } => {
                check("cylinder", &[("radius", radius), ("height", height)])?;
                let (radius, height) = (f64::from(radius), f64::from(height));
                grid([PIECES, 1], |at| {
                    let normal = around(at.x).extend(0.0);
                    Vertex {
                        position: normal * radius + DVec3::Z * (at.y - 0.5) * height,
                        normal,
                        uv: at * DVec2::new(TAU * radius, height),
                    }
                })
            }
            Self::Sheet => {
                let place = |at: DVec2| at * 2.0 - 1.0;
                smooth([511, 511], |at| (place(at).extend(sheet(place(at))), at))
            }
            Self::Wrinkled { side } => {
                check("wrinkled", &[("side", side)])?;
                let side = f64::from(side);
                let place = |at: DVec2| (at - 0.5).extend(wrinkles(at - 0.5)) * side;
                smooth([255, 255], |at| (place(at), at * side))
            }
        }
    }
}

fn check(shape: &'static str, sizes: &[(&'static str, f32)]) -> Result<(), ShapeError> {
    match sizes.iter().find(|(_, size)| !(SIZES[0]..=SIZES[1]).contains(size)) {
        Some(&(name, found)) => Err(ShapeError::Size { shape, name, found }),
        None => Ok(()),
    }
}

/// The direction after a part of a full turn from x over y; after all of it, the same as at first.
fn around(part: f64) -> DVec2 {
    DVec2::from_angle(part.fract() * TAU)
}

/// A fold across the sample of side 1, about which its surface is level on both sides.
struct Crease {
    /// A point on it, of the sample's middle.
    through: [f64; 2],
    /// From x to where it runs, degrees.
    along_deg: f64,
    /// Height, below 0 for a valley, and width, where it is 1/e as high.
    height: f64,
    width: f64,
    /// How it snakes about its line: to either side, and how often along the sample.
    snake: [f64; 2],
    /// Part of the sample's side over which it fades from that point.
    length: f64,
}

#[rustfmt::skip]
const CREASES: [Crease; 7] = [
    Crease { through: [-0.18, 0.10], along_deg: 78.0, height: 0.016, width: 0.055, snake: [0.012, 1.3], length: 0.9 },
    Crease { through: [0.22, -0.05], along_deg: 101.0, height: 0.013, width: 0.046, snake: [0.009, 1.7], length: 0.7 },
    Crease { through: [0.03, 0.24], along_deg: 12.0, height: 0.011, width: 0.043, snake: [0.010, 1.1], length: 0.5 },
    Crease { through: [0.02, -0.27], along_deg: -14.0, height: 0.013, width: 0.050, snake: [0.013, 1.4], length: 0.6 },
    Crease { through: [-0.31, -0.28], along_deg: 38.0, height: 0.009, width: 0.037, snake: [0.006, 2.1], length: 0.35 },
    Crease { through: [0.34, 0.31], along_deg: -51.0, height: 0.010, width: 0.039, snake: [0.007, 1.9], length: 0.4 },
    Crease { through: [0.05, 0.02], along_deg: 55.0, height: -0.008, width: 0.060, snake: [0.011, 1.2], length: 0.45 },
];

/// Height of the wrinkled sample of side 1 at a place of it, from its middle.
fn wrinkles(place: DVec2) -> f64 {
    let creases = CREASES.iter().map(|crease| {
        let along = DVec2::from_angle(crease.along_deg.to_radians());
        let from = place - DVec2::from(crease.through);
        let (t, d) = (from.dot(along), from.perp_dot(along));
        let [swing, waves] = crease.snake;
        let d = d + swing * (TAU * waves * t).sin();
        crease.height * (-(d / crease.width).powi(2) - (t / crease.length).powi(2)).exp()
    });
    creases.sum()
}

/// Height of the sheet.
fn sheet(place: DVec2) -> f64 {
    let (r, phi) = (place.length(), place.to_angle());
    0.45 * (-1.2 * (r / 0.55).powi(2)).exp()
        + 0.05 * (9.0 * phi).sin() * (r - 0.3).max(0.0)
        + 0.02 * (14.0 * place.x + 3.0 * place.y).sin()
}

/// As [`grid`], of positions and uv, with smooth normals.
fn smooth(pieces: [u32; 2], vertex: impl Fn(DVec2) -> (DVec3, DVec2)) -> Result<Mesh, ShapeError> {
    let flat = grid(pieces, |at| {
        let (position, uv) = vertex(at);
        Vertex { position, normal: DVec3::Z, uv }
    })?;
    let (positions, uvs) = (flat.positions().to_vec(), flat.uvs().to_vec());
    Ok(Mesh::with_smooth_normals(positions, uvs, flat.triangles().to_vec())?)
}

struct Vertex {
    position: DVec3,
    normal: DVec3,
    uv: DVec2,
}

/// The mesh of a grid of so many rectangles over [0, 1]², each cut along its diagonal from the lower
/// left, without the triangles that vertices at one place leave without area.
fn grid(pieces: [u32; 2], vertex: impl Fn(DVec2) -> Vertex) -> Result<Mesh, ShapeError> {
    let [columns, rows] = pieces;
    let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..=rows {
        for column in 0..=columns {
            let at = DVec2::new(
                f64::from(column) / f64::from(columns),
                f64::from(row) / f64::from(rows),
            );
            let vertex = vertex(at);
            positions.push(vertex.position.as_vec3());
            normals.push(vertex.normal.as_vec3());
            uvs.push(vertex.uv.as_vec2());
        }
    }
    let mut triangles = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let a = row * (columns + 1) + column;
        let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
        let area = |corners: &[u32; 3]| mesh::area(corners.map(|index| positions[index as usize]));
        triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|corners| area(corners) > 0.0));
    }
    Ok(Mesh::new(positions, normals, uvs, triangles)?)
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::scene::uv::UvReport;

    /// That triangles and normals face `outwards` of their middle.
    fn check_faces(mesh: &Mesh, outwards: impl Fn(Vec3) -> Vec3) {
        for triangle in 0..mesh.triangles().len() as u32 {
            let point = mesh.surface(triangle, Vec3::splat(1.0 / 3.0));
            let expected = outwards(point.position);
            assert!(point.geometric_normal.dot(expected) > 0.999, "{point:?} {expected:?}");
            assert!(point.normal.dot(expected) > 0.999, "{point:?} {expected:?}");
        }
    }

    #[test]
    fn plane_is_isometric() {
        let mesh = Shape::Plane { width: 3.0, height: 0.5 }.mesh().unwrap();
        check_faces(&mesh, |_| Vec3::Z);
        assert_eq!(mesh.area(), 1.5);
        assert_eq!(mesh.positions()[0], Vec3::new(-1.5, -0.25, 0.0));
        assert_eq!((mesh.uvs()[0], mesh.uvs()[3]), (Vec2::ZERO, Vec2::new(3.0, 0.5)));
        let report = UvReport::new(&mesh);
        assert!(report.stretch.iter().all(|s| (s - 1.0).abs() < 1e-6), "{report:?}");
        assert!(report.shear_deg < 1e-4, "{report:?}");
        assert_eq!(report.warnings(), [""; 0]);
    }

    #[test]
    fn cylinder_is_isometric_but_for_its_chords() {
        let mesh = Shape::Cylinder { radius: 0.2, height: 3.0 }.mesh().unwrap();
        check_faces(&mesh, |point| point.with_z(0.0).normalize());
        let area = TAU * 0.2 * 3.0;
        assert!((mesh.area() / area - 1.0).abs() < 3e-5, "{} {area}", mesh.area());
        let report = UvReport::new(&mesh);
        let [least, _, most] = report.stretch;
        // The chords, and the rounding of u by 10⁻⁷ m in pieces of 5 mm.
        assert!(least > 1.0 - 6e-5 && most < 1.0 + 3e-5, "{report:?}");
        assert!(report.shear_deg < 1e-3, "{report:?}");
        assert_eq!(report.warnings(), [""; 0]);
    }

    #[test]
    fn sphere_is_round_closed_and_isometric_along_meridians() {
        let mesh = Shape::Sphere { radius: 2.0 }.mesh().unwrap();
        check_faces(&mesh, Vec3::normalize);
        for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
            assert!((position.length() - 2.0).abs() < 1e-6, "{position}");
            assert!(position.normalize().abs_diff_eq(*normal, 1e-6), "{position} {normal}");
        }
        let area = 4.0 * PI * 4.0;
        assert!((mesh.area() / area - 1.0).abs() < 3e-4, "{} {area}", mesh.area());
        // Each edge is that of two triangles, of opposite sense.
        let mut edges = std::collections::HashMap::new();
        for triangle in mesh.triangles() {
            let place = triangle
                .map(|i| (mesh.positions()[i as usize] + Vec3::ZERO).to_array().map(f32::to_bits));
            for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (place[a], place[b])) {
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&sum| sum == 0), "an edge is open");
        for triangle in 0..mesh.triangles().len() as u32 {
            let point = mesh.surface(triangle, Vec3::splat(1.0 / 3.0));
            let cos_latitude = point.position.normalize().truncate().length();
            let (u, v) = (point.dp_du.length(), point.dp_dv.length());
            assert!((u - cos_latitude).abs() < 0.02, "{point:?}: {u}, expected {cos_latitude}");
            // Not at the poles, where triangles lean.
            assert!(cos_latitude < 0.05 || (v - 1.0).abs() < 1e-3, "{point:?}: {v}, expected 1");
        }
    }

    #[test]
    fn sheet_is_that_of_its_formula() {
        let mesh = Shape::Sheet.mesh().unwrap();
        assert_eq!(mesh.positions().len(), 512 * 512);
        assert_eq!(mesh.triangles().len(), 522_242);
        assert_eq!(mesh.positions()[0].truncate(), Vec2::NEG_ONE);
        assert_eq!(mesh.positions()[512 * 512 - 1].truncate(), Vec2::ONE);
        for index in [0, 511, 130_901, 131_000, 200_000, 262_143] {
            let (p, uv) = (mesh.positions()[index].as_dvec3(), mesh.uvs()[index].as_dvec2());
            assert!(uv.abs_diff_eq((p.truncate() + 1.0) / 2.0, 1e-7), "{p} {uv}");
            let (r, phi) = ((p.x * p.x + p.y * p.y).sqrt(), p.y.atan2(p.x));
            let z = 0.45 * (-1.2 * (r / 0.55) * (r / 0.55)).exp()
                + 0.05 * (9.0 * phi).sin() * f64::max(r - 0.3, 0.0)
                + 0.02 * (14.0 * p.x + 3.0 * p.y).sin();
            assert!((p.z - z).abs() < 1e-6, "{p}, expected {z}");
        }
        assert!(mesh.normals().iter().all(|normal| normal.z > 0.2));
        let triangles = 0..mesh.triangles().len() as u32;
        assert!(triangles.into_iter().all(|k| {
            let point = mesh.surface(k, Vec3::splat(1.0 / 3.0));
            point.geometric_normal.dot(point.normal) > 0.999
        }));
    }

    #[test]
    fn wrinkled_sample_is_nearly_level_and_isometric() {
        let mesh = Shape::Wrinkled { side: 0.2 }.mesh().unwrap();
        let heights = mesh.positions().iter().map(|position| position.z);
        let [low, high] = [heights.clone().reduce(f32::min), heights.reduce(f32::max)];
        let [low, high] = [low.unwrap(), high.unwrap()];
        assert!(low < -1e-3 && high > 6e-3 && high - low < 9e-3, "{low} {high}");
        let slopes = mesh.normals().iter().map(|normal| normal.z.acos().to_degrees());
        let steepest = slopes.fold(0.0, f32::max);
        assert!((20.0..26.0).contains(&steepest), "{steepest}");
        let report = UvReport::new(&mesh);
        assert!(report.stretch.iter().all(|s| (s - 1.0).abs() < 0.11), "{report:?}");
        assert_eq!(report.warnings(), [""; 0]);
    }

    #[test]
    fn sizes_have_a_range() {
        for (shape, message) in [
            (
                Shape::Plane { width: 1.0, height: 0.0 },
                "plane: found a height of 0 m, expected 0.000001 to 1000000",
            ),
            (
                Shape::Sphere { radius: -1.0 },
                "sphere: found a radius of -1 m, expected 0.000001 to 1000000",
            ),
            (
                Shape::Cylinder { radius: f32::NAN, height: 1.0 },
                "cylinder: found a radius of NaN m, expected 0.000001 to 1000000",
            ),
            (
                Shape::Wrinkled { side: 0.0 },
                "wrinkled: found a side of 0 m, expected 0.000001 to 1000000",
            ),
        ] {
            assert_eq!(shape.mesh().unwrap_err().to_string(), message);
        }
        for size in SIZES {
            let shape = Shape::Cylinder { radius: size, height: size };
            assert!(shape.mesh().unwrap().area() > 0.0, "{shape:?}");
            assert!(Shape::Sphere { radius: size }.mesh().unwrap().area() > 0.0, "{size}");
        }
    }
}
