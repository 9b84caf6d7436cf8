//! Meshes from files: OBJ, PLY and glTF.
//!
//! A file becomes one [`Mesh`], in the coordinates of the file, taken for metres. OBJ and PLY say
//! nothing of directions and are taken as they are, z up; glTF, whose y is up, is turned upright.
//! Texture coordinates become the cloth's: what the file calls 1 is 1 m of cloth. Where a file
//! has none they are 0, which a [`UvReport`](super::uv::UvReport) tells as missing; where it has
//! no normals they are those of a smooth surface.

mod gltf;
mod obj;
mod ply;
mod polygon;

use std::{collections::HashMap, path::Path};

use glam::{Vec2, Vec3};
use thiserror::Error;

use super::mesh::{self, Mesh};
use crate::input::{self, InputError};

/// Most bytes that are read of a mesh, its buffers included.
pub const MAX_BYTES: u64 = 1 << 30;

/// Most vertices of a mesh, and most triangles.
pub const MAX_COUNT: usize = 1 << 26;

/// Most corners of a polygon.
pub const MAX_CORNERS: usize = 1024;

/// In which way a file holds a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ: polygons; materials, curves and free-form surfaces are not read.
    Obj,
    /// PLY, as text or binary of either byte order.
    Ply,
    /// glTF 2.0, as text or binary (GLB).
    Gltf,
}

/// Why a file gives no mesh.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// There is no readable file.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The name does not tell the format.
    #[error("{name}: found a name that ends in {ending:?}, expected .obj, .ply, .gltf or .glb")]
    UnknownFormat {
        /// The file.
        name: String,
        /// What its name ends in.
        ending: String,
    },
    /// The file is not a mesh of its format.
    #[error("{name}: {what}")]
    NotAMesh {
        /// The file.
        name: String,
        /// Where, what was found, and what was expected.
        what: String,
    },
}

impl Format {
    /// The format of files with names like that of `path`, in capitals or not.
    pub fn of(path: &Path) -> Option<Self> {
        match &*path.extension()?.to_str()?.to_ascii_lowercase() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "gltf" | "glb" => Some(Self::Gltf),
            _ => None,
        }
    }
}

/// Reads the mesh at `path`, in the format that its name ends in.
///
/// # Errors
///
/// [`LoadError`] when there is no readable file, or no mesh with an area in it, or more than
/// [`MAX_BYTES`], [`MAX_COUNT`] or [`MAX_CORNERS`] allow.
pub fn read(path: &Path) -> Result<Mesh, LoadError> {
    let name = path.display().to_string();
    let Some(format) = Format::of(path) else {
        let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        return Err(LoadError::UnknownFormat { name, ending });
    };
    let bytes = input::read(path, "mesh", MAX_BYTES)?;
    parse(name, &bytes, format, path.parent().unwrap_or(Path::new("")))
}

/// The mesh in these bytes of a file that messages call `name`; `folder` holds the buffers that
/// a glTF may name.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(name: String, bytes: &[u8], format: Format, folder: &Path) -> Result<Mesh, LoadError> {
    let parts = match format {
        Format::Obj => obj::read(bytes),
        Format::Ply => ply::read(bytes),
        Format::Gltf => gltf::read(bytes, folder),
    };
    parts.and_then(Parts::into_mesh).map_err(|what| LoadError::NotAMesh { name, what })
}

/// What a reader has read of a mesh, all of it finite and all indices in range.
#[derive(Debug, Default)]
struct Parts {
    positions: Vec<Vec3>,
    /// One per position; zero where the file has none.
    normals: Vec<Vec3>,
    /// One per position; zero where the file has none.
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

impl Parts {
    fn push_vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> Result<(), String> {
        check_room("vertices", self.positions.len(), 1)?;
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        Ok(())
    }

    fn push_polygon(&mut self, corners: &[u32]) -> Result<(), String> {
        check_room("triangles", self.triangles.len(), corners.len().saturating_sub(2))?;
        polygon::triangulate(&self.positions, corners, &mut self.triangles);
        Ok(())
    }

    /// The mesh, if it has an area.
    fn into_mesh(self) -> Result<Mesh, String> {
        let Self { positions, normals, uvs, triangles } = self;
        if triangles.is_empty() {
            return Err("found no faces, expected at least one".to_owned());
        }
        let corner = |extreme: fn(Vec3, Vec3) -> Vec3| {
            let points = positions.iter().copied();
            points.reduce(extreme).unwrap_or_default().as_dvec3()
        };
        let size = corner(Vec3::max).distance(corner(Vec3::min));
        let area: f64 = triangles
            .iter()
            .map(|triangle| mesh::area(triangle.map(|index| positions[index as usize])))
            .sum();
        // Rounding of coordinates to single precision makes as much of none.
        if area <= f64::from(f32::EPSILON) * size * size {
            return Err("found no triangle with an area, expected a surface".to_owned());
        }
        let normals = complete(&normals, &positions, &triangles);
        Mesh::new(positions, normals, uvs, triangles).map_err(|error| error.to_string())
    }
}

/// That `more` fit behind `count` of what is counted in `plural`.
fn check_room(plural: &str, count: usize, more: usize) -> Result<(), String> {
    if count.saturating_add(more) > MAX_COUNT {
        return Err(format!("found more than {MAX_COUNT} {plural}, expected a smaller mesh"));
    }
    Ok(())
}

/// Unit normals: those given, and where they have no length those of the smooth surface. It goes
/// on across vertices at one place, since files part vertices at the seams of their uv.
fn complete(normals: &[Vec3], positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let unit = |normal: &Vec3| normal.as_dvec3().normalize_or_zero().as_vec3();
    let mut normals: Vec<_> = normals.iter().map(unit).collect();
    if normals.iter().all(|normal| *normal != Vec3::ZERO) {
        return normals;
    }
    let mut first_at = HashMap::new();
    let first: Vec<u32> = (0..)
        .zip(positions)
        // A zero of either sign is the same place.
        .map(|(index, place)| {
            let key = (*place + Vec3::ZERO).to_array().map(f32::to_bits);
            *first_at.entry(key).or_insert(index)
        })
        .collect();
    let joined: Vec<_> = triangles.iter().map(|t| t.map(|index| first[index as usize])).collect();
    let smooth = mesh::smooth_normals(positions, &joined);
    for (normal, &index) in normals.iter_mut().zip(&first) {
        if *normal == Vec3::ZERO {
            *normal = smooth[index as usize];
        }
    }
    normals
}

/// Text of a file for a message, in quotes and not too long.
fn quote(text: &str) -> String {
    const MOST: usize = 40;
    let text = text.trim();
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{:?}…", &text[..end]),
        None => format!("{text:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_of_uv_do_not_show_in_smooth_normals() {
        // A roof of two triangles that meet along y in vertices of their own.
        let mut parts = Parts::default();
        for (x, y, z) in [(-1, 0, 0), (0, 0, 1), (0, 1, 1), (0, 0, 1), (1, 0, 0), (0, 1, 1)] {
            let place = Vec3::new(x as f32, y as f32, z as f32);
            parts.push_vertex(place, Vec3::ZERO, Vec2::ZERO).unwrap();
        }
        parts.normals[0] = Vec3::new(0.0, 0.0, 1e-30);
        parts.push_polygon(&[0, 1, 2]).unwrap();
        parts.push_polygon(&[3, 4, 5]).unwrap();
        let mesh = parts.into_mesh().unwrap();
        let normals = mesh.normals();
        assert_eq!(normals[0], Vec3::Z, "given, if tiny");
        assert_eq!((normals[1], normals[2]), (normals[3], normals[5]));
        assert!(normals[1].x.abs() < 1e-6 && normals[1].z.abs() > 0.5, "{normals:?}");
        assert!(normals[4].x.abs() > 0.5, "{normals:?}");
    }

    #[test]
    fn nothing_but_a_surface_is_a_mesh() {
        assert_eq!(
            Parts::default().into_mesh().unwrap_err(),
            "found no faces, expected at least one"
        );
        let mut line = Parts::default();
        for x in [0.1, 0.2, 0.3] {
            line.push_vertex(Vec3::splat(x), Vec3::Z, Vec2::ZERO).unwrap();
        }
        line.push_polygon(&[0, 1, 2]).unwrap();
        assert_eq!(
            line.into_mesh().unwrap_err(),
            "found no triangle with an area, expected a surface"
        );
    }

    #[test]
    fn counts_have_a_limit() {
        assert_eq!(check_room("triangles", MAX_COUNT - 2, 2), Ok(()));
        let message = "found more than 67108864 triangles, expected a smaller mesh";
        assert_eq!(check_room("triangles", MAX_COUNT - 1, 2).unwrap_err(), message);
        assert_eq!(check_room("triangles", 1, usize::MAX).unwrap_err(), message);
    }

    #[test]
    fn quotes_are_short_and_printable() {
        assert_eq!(quote(" f 1\u{7}\r\n"), r#""f 1\u{7}""#);
        assert_eq!(quote(&"é".repeat(41)), format!("\"{}\"…", "é".repeat(40)));
    }
}
