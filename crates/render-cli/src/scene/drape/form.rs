//! What the cloth falls on: a low drum with a slightly domed top.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3A};

use crate::scene::mesh::Mesh;

/// A solid of revolution about a vertical axis, standing on the floor z = 0: a cylinder under a
/// spherical cap, with a rounded shoulder between them. Lengths in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Form {
    /// Where the axis meets the floor.
    pub centre: Vec2,
    /// Radius of the wall.
    pub radius: f32,
    /// Height at the axis.
    pub height: f32,
    /// Radius of the rounding between top and wall.
    pub shoulder: f32,
    /// Radius of curvature of the top.
    pub dome: f32,
}

impl Form {
    /// Distance to the surface without its base, negative inside, and the unit normal at the
    /// nearest point of the surface. Exact outside, and inside to the depth of the shoulder's
    /// radius.
    pub(super) fn distance(&self, point: Vec3A) -> (f32, Vec3A) {
        let offset = Vec2::new(point.x, point.y) - self.centre;
        let radius = offset.length();
        let (dome, shoulder) = self.arc_centres();
        let profile = Vec2::new(radius, point.z);
        let (distance, normal) = if (profile - dome).perp_dot(shoulder - dome) <= 0.0 {
            from_circle(profile, dome, self.dome)
        } else if point.z <= shoulder.y {
            (radius - self.radius, Vec2::X)
        } else {
            from_circle(profile, shoulder, self.shoulder)
        };
        let outwards = offset.normalize_or(Vec2::X) * normal.x;
        (distance, Vec3A::new(outwards.x, outwards.y, normal.y))
    }

    /// The surface without its base, as a mesh in metres whose uv are (radius · azimuth, length
    /// along the profile).
    pub(super) fn mesh(&self) -> Mesh {
        const SECTORS: usize = 128;
        const STEPS: usize = 16;
        let (dome, shoulder) = self.arc_centres();
        // Angles of normals from the axis, whose sine is exactly 0 there.
        let arc = |centre: Vec2, radius: f32, from: f32, to: f32| {
            (0..=STEPS).map(move |step| {
                let (sin, cos) = (from + (to - from) * step as f32 / STEPS as f32).sin_cos();
                (centre + Vec2::new(sin, cos) * radius, Vec2::new(sin, cos))
            })
        };
        let rim = (shoulder - dome).angle_to(Vec2::Y);
        // From the floor to the axis, as (radius, z) and normal.
        let profile: Vec<_> = [(Vec2::new(self.radius, 0.0), Vec2::X)]
            .into_iter()
            .chain(arc(shoulder, self.shoulder, FRAC_PI_2, rim))
            .chain(arc(dome, self.dome, rim, 0.0).skip(1))
            .collect();

        let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
        let mut length = 0.0;
        for (row, &(point, normal)) in profile.iter().enumerate() {
            length += point.distance(profile[row.saturating_sub(1)].0);
            for sector in 0..=SECTORS {
                let azimuth = TAU * sector as f32 / SECTORS as f32;
                let outwards = Vec2::from_angle(azimuth);
                positions.push((self.centre + outwards * point.x).extend(point.y));
                normals.push((outwards * normal.x).extend(normal.y));
                uvs.push(Vec2::new(self.radius * azimuth, length));
            }
        }
        let triangles = super::grid_triangles(SECTORS + 1, profile.len());
        Mesh::new(positions, normals, uvs, triangles).expect("the profile is finite")
    }

    /// Centres of the top's and the shoulder's arc in the half-plane (radius, z). The shoulder's
    /// lies where both arcs have the same normal.
    fn arc_centres(&self) -> (Vec2, Vec2) {
        let dome = Vec2::new(0.0, self.height - self.dome);
        let reach = self.radius - self.shoulder;
        let rise = ((self.dome - self.shoulder).powi(2) - reach * reach).sqrt();
        (dome, dome + Vec2::new(reach, rise))
    }
}

fn from_circle(point: Vec2, centre: Vec2, radius: f32) -> (f32, Vec2) {
    let offset = point - centre;
    (offset.length() - radius, offset.normalize_or(Vec2::Y))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    const FORM: Form = Form {
        centre: Vec2::new(0.1, -0.2),
        radius: 0.09,
        height: 0.13,
        shoulder: 0.04,
        dome: 0.3,
    };

    #[test]
    fn distance_is_zero_on_the_mesh_and_its_normal_the_mesh_s() {
        let mesh = FORM.mesh();
        for (&position, &normal) in mesh.positions().iter().zip(mesh.normals()) {
            let (distance, gradient) = FORM.distance(position.into());
            assert!(distance.abs() < 1e-6, "{position} {distance}");
            let on_axis = normal.z > 0.9999;
            assert!(
                on_axis || normal.abs_diff_eq(gradient.into(), 1e-4),
                "{position} {normal} {gradient}"
            );
        }
    }

    #[test]
    fn distance_grows_along_the_normal_and_is_negative_inside() {
        for &position in FORM.mesh().positions() {
            let (_, normal) = FORM.distance(position.into());
            for offset in [-0.03, -0.001, 0.002, 0.05] {
                let (distance, again) = FORM.distance(Vec3A::from(position) + normal * offset);
                assert!((distance - offset).abs() < 1e-5, "{position} {offset} {distance}");
                assert!(normal.abs_diff_eq(again, 2e-3), "{position} {offset} {normal} {again}");
            }
        }
    }

    #[test]
    fn mesh_faces_outwards() {
        let mesh = FORM.mesh();
        for triangle in 0..mesh.triangles().len() as u32 {
            let point = mesh.surface(triangle, Vec3::splat(1.0 / 3.0));
            assert!(point.geometric_normal.dot(point.normal) > 0.99, "{triangle} {point:?}");
        }
    }
}
