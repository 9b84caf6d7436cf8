//! Affine maps that place shapes in a scene.

use glam::{DAffine3, DMat3, Vec3};

/// An invertible affine map of positions, and what it does to normals and to the order of corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    map: DAffine3,
    normals: DMat3,
}

/// Least volume of the image of the unit cube, relative to the box of its edges' lengths: below it,
/// rounding of the entries to single precision cannot be told from a flat image.
const LEAST_VOLUME: f64 = 4.0 * f32::EPSILON as f64;

impl Placement {
    /// The placement by `map`; `None` if it is not finite, or flattens volumes.
    pub(super) fn new(map: DAffine3) -> Option<Self> {
        let DMat3 { x_axis, y_axis, z_axis } = map.matrix3;
        let volume = map.matrix3.determinant();
        let box_volume = x_axis.length() * y_axis.length() * z_axis.length();
        // The cofactors: the inverse transposed, times the determinant. Of its sign nothing is left
        // here, so that a normal stays on its side of the surface.
        let normals = DMat3::from_cols(
            y_axis.cross(z_axis) / volume,
            z_axis.cross(x_axis) / volume,
            x_axis.cross(y_axis) / volume,
        );
        let is_sound = map.is_finite()
            && normals.is_finite()
            && volume.is_finite()
            && volume.abs() > LEAST_VOLUME * box_volume;
        is_sound.then_some(Self { map, normals })
    }

    /// Where the map takes a position.
    pub(super) fn position(&self, position: Vec3) -> Vec3 {
        self.map.transform_point3(position.as_dvec3()).as_vec3()
    }

    /// A unit normal on the same side of the surface as before; zero for zero.
    pub(super) fn normal(&self, normal: Vec3) -> Vec3 {
        (self.normals * normal.as_dvec3()).normalize_or_zero().as_vec3()
    }

    /// The corners, in the order that has them run anticlockwise seen from the same side of the
    /// surface as before.
    pub(super) fn triangle(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if self.map.matrix3.determinant() < 0.0 { [a, c, b] } else { [a, b, c] }
    }
}
