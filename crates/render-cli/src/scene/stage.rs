//! What a cloth alone is laid over, from where it is seen, and from where it is lit.

use std::{str::FromStr, sync::Arc};

use clap::ValueEnum;
use glam::{Affine3A, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    FLOOR, KEY, MAX_DEPTH, Material, SKY, Scene, SceneError, Surface,
    drape::{self, BuiltIn, CameraPlacement, DEFAULT_SIDE, RectangleLight},
    light::{Light, Quad},
    mesh::Mesh,
    shape::Shape,
};
use crate::render::intersect::Geometry;

/// What a cloth is laid over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// A low drum, over which it has fallen in folds
    #[default]
    Drape,
    /// A ball, which it covers; threads along the meridians meet at the poles
    Sphere,
}

/// Where a camera stands around what it looks at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// From the near side clockwise seen from above: degrees, in [−360, 360].
    pub azimuth: f32,
    /// Above the horizon: degrees, in [1, 89].
    pub elevation: f32,
    /// 1 for the distance that pictures are composed for, in [0.1, 4].
    pub distance: f32,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Direction {
    /// From +x, the right of the picture, anticlockwise seen from above: degrees, in [−360, 360].
    pub azimuth: f32,
    /// Above the horizon: degrees, in [1, 89].
    pub elevation: f32,
}

/// From where a cloth on a [`Stage`] is seen and lit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shot {
    /// Where the camera stands; `None` for [`Form::orbit`].
    pub camera: Option<Orbit>,
    /// Where the key light stands; `None` for [`KEY_DIRECTION`].
    pub light: Option<Direction>,
}

/// The shapes that a cloth is shown with, ready for rays. Clones share them.
#[derive(Clone, Debug)]
pub struct Stage {
    form: Form,
    /// Of lengths to those of [`DEFAULT_SIDE`].
    scale: f32,
    cloth: Arc<Mesh>,
    others: Vec<Arc<Mesh>>,
    geometry: Arc<Geometry>,
}

/// From the left, 45° high: across most folds of the drape.
pub const KEY_DIRECTION: Direction = Direction { azimuth: 190.0, elevation: 45.0 };

/// Range of azimuths, elevations and distances.
const AZIMUTHS: [f32; 2] = [-360.0, 360.0];
const ELEVATIONS: [f32; 2] = [1.0, 89.0];
const DISTANCES: [f32; 2] = [0.1, 4.0];

/// Radius of the ball, m: it fills most of the picture's height.
const BALL: f32 = 0.11;

impl Form {
    /// Where its camera stands if nothing else is said.
    pub fn orbit(self) -> Orbit {
        match self {
            // A little from the left, so that folds are seen along and across.
            Self::Drape => Orbit { azimuth: 18.0, elevation: 37.0, distance: 1.0 },
            Self::Sphere => Orbit { azimuth: 0.0, elevation: 15.0, distance: 1.0 },
        }
    }
}

impl Orbit {
    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// The first number out of range: what was found, and what was expected.
    pub fn check(&self) -> Result<(), String> {
        check("azimuth", self.azimuth, AZIMUTHS)?;
        check("elevation", self.elevation, ELEVATIONS)?;
        check("distance", self.distance, DISTANCES)
    }

    /// The camera around `target`, m, in a scene whose lengths are `scale` times those it is composed
    /// for.
    pub(super) fn placement(&self, target: Vec3, scale: f32) -> CameraPlacement {
        /// Pictures are composed for this distance, m.
        const DISTANCE: f32 = 0.95;
        let [azimuth, elevation] = [self.azimuth, self.elevation].map(f32::to_radians);
        let horizontal = Vec3::new(-azimuth.sin(), -azimuth.cos(), 0.0) * elevation.cos();
        let offset = DISTANCE * self.distance * (horizontal + Vec3::Z * elevation.sin());
        CameraPlacement {
            position: (target + offset) * scale,
            target: target * scale,
            up: Vec3::Z,
            horizontal_fov: 27.0_f32.to_radians(),
        }
    }
}

impl Direction {
    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// The first number out of range: what was found, and what was expected.
    pub fn check(&self) -> Result<(), String> {
        check("azimuth", self.azimuth, AZIMUTHS)?;
        check("elevation", self.elevation, ELEVATIONS)
    }

    /// A unit vector to the light.
    pub(super) fn unit(&self) -> Vec3 {
        let (sin, cos) = self.elevation.to_radians().sin_cos();
        (Vec2::from_angle(self.azimuth.to_radians()) * cos).extend(sin)
    }

    /// The key light of a scene whose lengths are `scale` times those it is composed for, facing the
    /// origin.
    pub(super) fn key_light(&self, scale: f32) -> RectangleLight {
        let (distance, half_side) = (1.1 * scale, 0.2 * scale);
        let to_light = self.unit();
        let along = Vec3::Z.cross(to_light).normalize();
        RectangleLight {
            centre: to_light * distance,
            half_u: along * half_side,
            half_v: along.cross(to_light) * half_side,
        }
    }
}

impl FromStr for Orbit {
    type Err = String;

    /// `AZIMUTH,ELEVATION,DISTANCE`
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = "expected azimuth and elevation in degrees and a distance, as in 18,37,1";
        let [azimuth, elevation, distance] = numbers(text).ok_or(expected)?;
        let orbit = Self { azimuth, elevation, distance };
        orbit.check().map(|()| orbit)
    }
}

impl FromStr for Direction {
    type Err = String;

    /// `AZIMUTH,ELEVATION`
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = "expected azimuth and elevation in degrees, as in 190,45";
        let [azimuth, elevation] = numbers(text).ok_or(expected)?;
        let direction = Self { azimuth, elevation };
        direction.check().map(|()| direction)
    }
}

impl Stage {
    /// The stage of `form`, with the cloth of [`DEFAULT_SIDE`] if it is draped.
    ///
    /// # Errors
    ///
    /// [`SceneError`] never, as the shapes are known; it is that of the functions that make them.
    pub fn new(form: Form) -> Result<Self, SceneError> {
        match form {
            Form::Drape => Self::drape(DEFAULT_SIDE),
            Form::Sphere => {
                let ball = Shape::Sphere { radius: BALL }.mesh()?;
                let ball = ball.transformed(Affine3A::from_translation(Vec3::Z * BALL))?;
                Self::of(form, 1.0, ball, vec![drape::sweep()])
            }
        }
    }

    /// A cloth of `side` metres, draped.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when the side is outside the range of [`BuiltIn::new`].
    pub fn drape(side: f32) -> Result<Self, SceneError> {
        let BuiltIn { cloth, floor, form, .. } = BuiltIn::new(side)?;
        Self::of(Form::Drape, side / DEFAULT_SIDE, cloth, vec![floor, form])
    }

    fn of(form: Form, scale: f32, cloth: Mesh, others: Vec<Mesh>) -> Result<Self, SceneError> {
        let meshes: Vec<_> = [&cloth].into_iter().chain(&others).collect();
        let geometry = Arc::new(Geometry::new(&meshes)?);
        let others = others.into_iter().map(Arc::new).collect();
        Ok(Self { form, scale, cloth: cloth.into(), others, geometry })
    }

    /// `cloth` on this stage, lit like a product in a studio. A white card on the floor has radiance 1,
    /// more or less, where the light stands as it does if nothing else is said.
    pub fn scene(&self, cloth: Material, shot: &Shot) -> Scene {
        let matte = |mesh: &Arc<Mesh>| {
            let material = Material::Matte(FLOOR);
            Surface { mesh: Arc::clone(mesh), material }
        };
        let cloth = Surface { mesh: Arc::clone(&self.cloth), material: cloth };
        let surfaces = [cloth].into_iter().chain(self.others.iter().map(matte)).collect();
        let target = match self.form {
            Form::Drape => drape::TARGET,
            Form::Sphere => Vec3::Z * BALL,
        };
        let orbit = shot.camera.unwrap_or(self.form.orbit());
        let key_light = shot.light.unwrap_or(KEY_DIRECTION).key_light(self.scale);
        let lights = vec![Light::Quad(Quad::new(key_light, KEY)), Light::Sky(SKY)];
        let camera = orbit.placement(target, self.scale);
        Scene::with_geometry(surfaces, Arc::clone(&self.geometry), camera, lights, MAX_DEPTH)
    }
}

fn check(name: &str, value: f32, [low, high]: [f32; 2]) -> Result<(), String> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(format!("{name}: found {value}, expected {low} to {high}"))
    }
}

/// So many numbers between commas.
fn numbers<const N: usize>(text: &str) -> Option<[f32; N]> {
    let numbers: Vec<f32> =
        text.split(',').map(|number| number.trim().parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_tells_where_camera_and_light_stand() {
        let orbit = Orbit { azimuth: -20.5, elevation: 30.0, distance: 0.5 };
        assert_eq!("-20.5,30,0.5".parse(), Ok(orbit));
        assert_eq!("190, 45".parse(), Ok(KEY_DIRECTION));
        for (text, expected) in [
            ("1,2", "expected azimuth and elevation in degrees and a distance, as in 18,37,1"),
            ("0,90,1", "elevation: found 90, expected 1 to 89"),
            ("0,NaN,1", "elevation: found NaN, expected 1 to 89"),
            ("0,45,0", "distance: found 0, expected 0.1 to 4"),
        ] {
            assert_eq!(text.parse::<Orbit>().unwrap_err(), expected, "{text}");
        }
        assert_eq!(
            "500,45".parse::<Direction>().unwrap_err(),
            "azimuth: found 500, expected -360 to 360"
        );
    }

    #[test]
    fn camera_goes_around_its_target() {
        let target = Vec3::new(0.1, 0.2, 0.3);
        let at = |azimuth, elevation| {
            let orbit = Orbit { azimuth, elevation, distance: 2.0 };
            (orbit.placement(target, 1.0).position - target) / 1.9
        };
        assert!(at(0.0, 1.0).abs_diff_eq(Vec3::new(0.0, -1.0, 0.0), 0.02));
        assert!(at(90.0, 1.0).abs_diff_eq(Vec3::NEG_X, 0.02));
        assert!(at(90.0, 89.0).abs_diff_eq(Vec3::Z, 0.02));
    }
}
