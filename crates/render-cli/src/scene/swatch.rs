//! A flat piece of cloth seen from above, large enough to show its threads.

use std::{f32::consts::PI, str::FromStr};

use glam::{Vec2, Vec3};

use super::{
    FLOOR, MAX_DEPTH, Material, SKY, Scene, SceneError, Surface,
    drape::{CameraPlacement, RectangleLight},
    light::{Light as Lamp, Quad},
    mesh::{Mesh, MeshError},
    stage::Direction,
};
use crate::render::{camera::COMPOSED_ASPECT, film::Size};

/// How a swatch is laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swatch {
    /// Width of the view, in metres, in pictures no wider than 3 to 2.
    pub width: f32,
    /// The place of the cloth in the corner where u = 0 and v = 0 would be: m, along weft and warp.
    pub at: Vec2,
    /// Where the light stands.
    pub light: Light,
    /// Whether the back of the cloth is up.
    pub is_back: bool,
}

/// Where the light of a swatch stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// 25° above the cloth, from the upper left.
    Raking,
    /// 70° above the cloth, from the upper left.
    Top,
    /// Anywhere else.
    From(Direction),
}

impl Light {
    /// Where that is.
    pub fn direction(self) -> Direction {
        match self {
            Self::Raking => Direction { azimuth: LIGHT_AZIMUTH, elevation: 25.0 },
            Self::Top => Direction { azimuth: LIGHT_AZIMUTH, elevation: 70.0 },
            Self::From(direction) => direction,
        }
    }
}

impl FromStr for Light {
    type Err = String;

    /// `raking`, `top`, or azimuth and elevation.
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "raking" => Ok(Self::Raking),
            "top" => Ok(Self::Top),
            _ if text.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                Err("expected raking, top, or azimuth and elevation in degrees".to_owned())
            }
            _ => text.parse().map(Self::From),
        }
    }
}

/// Half the side of the cloth and of the card, in widths of the view: beyond any picture's edges.
const HALF_SIDE: f32 = 40.0;

/// Distance of the camera in widths: almost without perspective.
const CAMERA_DISTANCE: f32 = 20.0;

/// Distance and half side of the light in widths: the edges of its shadows are soft.
const LIGHT_DISTANCE: f32 = 10.0;
const LIGHT_HALF_SIDE: f32 = 1.5;

/// Azimuth of the light from +x: from the upper left, along neither thread.
const LIGHT_AZIMUTH: f32 = 125.0;

/// What a white card in the place of the cloth reflects of the light, slightly warm.
const WHITE: Vec3 = Vec3::new(0.73, 0.7, 0.65);

/// Depth of the card below the cloth in widths.
const CARD_DEPTH: f32 = 0.1;

impl Swatch {
    /// Pixels of a picture of `size` to a millimetre of the cloth.
    pub fn pixels_per_mm(&self, size: Size) -> f64 {
        let [width, height] = [size.width(), size.height()].map(f64::from);
        let composed = width.min(height * f64::from(COMPOSED_ASPECT));
        composed / (1e3 * f64::from(self.width))
    }
}

impl Scene {
    /// A piece of `cloth` in the plane z = 0, its middle in the picture's at the origin, x to the
    /// right: u = 0 and v = 0, or `swatch.at`, are at the lower left corner of a picture with sides of
    /// 3 to 2, or at the lower right one of its back.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when `swatch.width` is not a positive number.
    pub fn swatch(cloth: Material, swatch: &Swatch) -> Result<Self, SceneError> {
        let width = swatch.width;
        let to_light = swatch.light.direction().unit();
        let along = Vec3::Z.cross(to_light).normalize() * LIGHT_HALF_SIDE;
        let shape = RectangleLight {
            centre: to_light * LIGHT_DISTANCE * width,
            half_u: along * width,
            half_v: along.cross(to_light) * width,
        };
        // From E = L · A · sin(elevation) / d², where all of the light is about as far.
        let solid_angle = (2.0 * LIGHT_HALF_SIDE / LIGHT_DISTANCE).powi(2);
        let radiance = WHITE * (PI / (solid_angle * to_light.z));
        let key_light = Lamp::Quad(Quad::new(shape, radiance));
        let camera = CameraPlacement {
            position: Vec3::Z * (CAMERA_DISTANCE * width),
            target: Vec3::ZERO,
            up: Vec3::Y,
            horizontal_fov: 2.0 * (0.5 / CAMERA_DISTANCE).atan(),
        };
        let surfaces = vec![
            Surface {
                mesh: square(width, 0.0, swatch.at, swatch.is_back)?.into(),
                material: cloth,
            },
            Surface {
                mesh: square(width, -CARD_DEPTH, Vec2::ZERO, false)?.into(),
                material: Material::Matte(FLOOR),
            },
        ];
        Ok(Self::new(surfaces, camera, vec![key_light, Lamp::Sky(SKY)], MAX_DEPTH)?)
    }
}

/// A square at `height` widths, `at` in its corner; turned over, its face looks down and u runs to the left.
fn square(width: f32, height: f32, at: Vec2, is_turned: bool) -> Result<Mesh, MeshError> {
    let side = if is_turned { -1.0 } else { 1.0 };
    let corners = [Vec2::NEG_ONE, Vec2::new(1.0, -1.0), Vec2::ONE, Vec2::new(-1.0, 1.0)];
    let corners = corners.map(|corner| corner * HALF_SIDE);
    let place = |corner: Vec2| (corner * Vec2::new(side, 1.0)).extend(height) * width;
    let uv = |corner: Vec2| (corner + Vec2::new(0.5, 1.0 / 3.0)) * width + at;
    Mesh::new(
        corners.map(place).into(),
        vec![Vec3::Z * side; 4],
        corners.map(uv).into(),
        vec![[0, 1, 2], [0, 2, 3]],
    )
}
