//! A scene as a file: camera, film, materials, objects and lights.
//!
//! The types here are what the file says and no more: lengths in metres, angles in degrees, paths
//! relative to the file. [`SceneFile::check`] finds numbers that mean nothing.

use std::{collections::BTreeMap, path::PathBuf};

use glam::Vec3;
use selvedge_yarn_brdf::Color;
use serde::{Deserialize, Deserializer, de::Error as _};

use super::MAX_DEPTH;
use crate::{
    json,
    render::film::{Filter, Size},
};

/// What a file holds.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Version of the format, 1.
    #[serde(deserialize_with = "version")]
    pub version: u64,
    /// From where it is seen.
    pub camera: CameraFile,
    /// What the camera exposes.
    #[serde(default)]
    pub film: FilmFile,
    /// Surfaces after which a path ends: 1 shows what lights alone light.
    #[serde(default = "default_depth")]
    pub depth: u32,
    /// What things are made of, by name.
    pub materials: BTreeMap<String, MaterialFile>,
    /// Things that stand together, by name, to be placed as one.
    #[serde(default)]
    pub groups: BTreeMap<String, Vec<ObjectFile>>,
    /// What stands in the scene.
    pub objects: Vec<ObjectFile>,
    /// What lights it.
    pub lights: Vec<LightFile>,
}

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// Centre of the lens, m.
    pub position: Vec3,
    /// A point in the middle of the picture, m.
    pub target: Vec3,
    /// A direction that points up in the picture.
    #[serde(default = "z_axis")]
    pub up: Vec3,
    /// Angle between the left and the right edge, degrees.
    pub fov_deg: f32,
    /// Radius of the lens, m; 0 has everything in focus.
    #[serde(default)]
    pub aperture: f32,
    /// Distance at which a lens is in focus, m; that of the target if it is not given.
    pub focus: Option<f32>,
}

/// What the camera exposes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FilmFile {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Left, upper, right and lower edge of the part that is rendered, pixels.
    pub crop: Option<[u32; 4]>,
    /// How samples make a pixel.
    pub filter: Filter,
}

/// What a thing is made of.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MaterialFile {
    /// Woven cloth.
    Cloth {
        /// A draft or a fabric: its path, or `preset:NAME`.
        fabric: String,
    },
    /// Scatters evenly.
    Diffuse {
        /// Share of the light that is scattered, in [0, 1].
        reflectance: Color,
    },
    /// Textures on a glossy surface.
    Standard(Box<StandardFile>),
}

/// Textures on a glossy surface: an anisotropic GGX over a diffuse base.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandardFile {
    /// Reflectance of the base.
    pub base_color: ColorSource,
    /// Tangent-space normals, OpenGL (+Y up).
    pub normal: Option<PathBuf>,
    /// Roughness, in [0, 1].
    #[serde(default = "half")]
    pub roughness: ColorSource,
    /// Reflectance at normal incidence.
    #[serde(default = "dielectric")]
    pub specular: ColorSource,
    /// From −1 (along v) to 1 (along u).
    #[serde(default)]
    pub anisotropy: f32,
    /// Width and height on the surface of one repeat of the textures, m.
    #[serde(default = "one_by_one")]
    pub size: [f32; 2],
}

/// A colour, or a picture of it.
#[derive(Clone, Debug, PartialEq)]
pub enum ColorSource {
    /// The same everywhere.
    Constant(Vec3),
    /// A picture.
    Texture(PathBuf),
}

/// A thing.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectFile {
    /// Its shape.
    pub shape: ShapeFile,
    /// The name of what it is made of; a group has its own.
    pub material: Option<String>,
    /// Where it stands.
    #[serde(default)]
    pub place: PlaceFile,
    /// What its uv are multiplied by to be metres along the cloth.
    #[serde(default = "one")]
    pub uv_scale: f32,
}

/// The shape of a thing, about the origin, z up.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeFile {
    /// A mesh in a file: OBJ, PLY, glTF.
    File {
        /// The file.
        path: PathBuf,
    },
    /// A rectangle at z = 0.
    Plane {
        /// Along x, m.
        width: f32,
        /// Along y, m.
        height: f32,
    },
    /// A sphere.
    Sphere {
        /// m.
        radius: f32,
    },
    /// A cylinder along z without ends.
    Cylinder {
        /// m.
        radius: f32,
        /// m.
        height: f32,
    },
    /// A wavy sheet of 2 × 2 m.
    Sheet {},
    /// A cloth that has fallen over a low drum.
    Drape {
        /// Side of the cloth, m.
        side: f32,
    },
    /// One of the scene's groups.
    Group {
        /// Its name.
        name: String,
    },
}

/// Where a thing stands: scaled, then turned about x, y and z in turn, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlaceFile {
    /// Factor of all lengths.
    pub scale: f32,
    /// Degrees.
    pub rotate_deg: Vec3,
    /// m.
    pub translate: Vec3,
}

/// What lights a scene. Radiances are linear, in W/(m² sr) or any unit.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum LightFile {
    /// A rectangle that shines from one side.
    Quad {
        /// Its middle, m.
        centre: Vec3,
        /// A point that it faces, m.
        toward: Vec3,
        /// Width and height, m.
        size: [f32; 2],
        /// What leaves it.
        radiance: Color,
    },
    /// A ball that shines.
    Sphere {
        /// Its middle, m.
        centre: Vec3,
        /// m.
        radius: f32,
        /// What leaves it.
        radiance: Color,
    },
    /// Light from far away.
    Distant {
        /// Where it comes from.
        from: Vec3,
        /// On a surface that faces it.
        irradiance: Color,
        /// Diameter in degrees; 0 is a point.
        #[serde(default)]
        angle_deg: f32,
    },
    /// The same from everywhere.
    Constant {
        /// From each direction.
        radiance: Color,
    },
    /// A picture of all directions, latitude by longitude, z up: EXR or HDR.
    Environment {
        /// The picture.
        path: PathBuf,
        /// Turned about z, degrees.
        #[serde(default)]
        rotation_deg: f32,
        /// Factor of its radiance.
        #[serde(default = "one")]
        scale: f32,
    },
}

impl Default for FilmFile {
    fn default() -> Self {
        Self { size: [960, 640], crop: None, filter: Filter::Gaussian }
    }
}

impl Default for PlaceFile {
    fn default() -> Self {
        Self { scale: 1.0, rotate_deg: Vec3::ZERO, translate: Vec3::ZERO }
    }
}

impl<'de> Deserialize<'de> for ColorSource {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct SourceVisitor;
        impl<'de> serde::de::Visitor<'de> for SourceVisitor {
            type Value = ColorSource;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number, [red, green, blue], \"#rrggbb\" or the path of a picture")
            }

            fn visit_f64<E: serde::de::Error>(self, grey: f64) -> Result<ColorSource, E> {
                Ok(ColorSource::Constant(Vec3::splat(grey as f32)))
            }

            fn visit_i64<E: serde::de::Error>(self, grey: i64) -> Result<ColorSource, E> {
                self.visit_f64(grey as f64)
            }

            fn visit_u64<E: serde::de::Error>(self, grey: u64) -> Result<ColorSource, E> {
                self.visit_f64(grey as f64)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<ColorSource, E> {
                if text.starts_with('#') {
                    let color = Color::deserialize(serde::de::value::StrDeserializer::new(text))?;
                    return Ok(ColorSource::Constant(color.0.into()));
                }
                Ok(ColorSource::Texture(text.into()))
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(
                self,
                numbers: A,
            ) -> Result<ColorSource, A::Error> {
                let color =
                    Color::deserialize(serde::de::value::SeqAccessDeserializer::new(numbers))?;
                Ok(ColorSource::Constant(color.0.into()))
            }
        }
        from.deserialize_any(SourceVisitor)
    }
}

fn version<'de, D: Deserializer<'de>>(from: D) -> Result<u64, D::Error> {
    let version = u64::deserialize(from)?;
    if version == 1 {
        Ok(version)
    } else {
        Err(D::Error::custom(format_args!("version {version}, expected 1")))
    }
}

fn default_depth() -> u32 {
    8
}

fn z_axis() -> Vec3 {
    Vec3::Z
}

fn one() -> f32 {
    1.0
}

fn one_by_one() -> [f32; 2] {
    [1.0; 2]
}

fn half() -> ColorSource {
    ColorSource::Constant(Vec3::splat(0.5))
}

fn dielectric() -> ColorSource {
    ColorSource::Constant(Vec3::splat(0.04))
}

/// The scene in `text`, or where what is wrong with it, and what would not be.
///
/// # Errors
///
/// A line *where: what was found, expected what*, where the text is no scene or a number in it
/// means nothing.
pub fn parse(text: &[u8]) -> Result<SceneFile, String> {
    let file: SceneFile = json::parse(text, &|_| &[])?;
    file.check()?;
    Ok(file)
}

/// Greatest coordinate, m.
const FARTHEST: f32 = 1e6;

impl SceneFile {
    /// Whether every number means something.
    ///
    /// # Errors
    ///
    /// A line `lights[2].quad.size: found [0, 1], expected lengths from 1e-6 to 1e6`.
    pub fn check(&self) -> Result<(), String> {
        let camera = &self.camera;
        point("camera.position", camera.position)?;
        point("camera.target", camera.target)?;
        direction("camera.up", camera.up)?;
        let view = camera.target - camera.position;
        if view.length() < 1e-9 {
            return Err(format!(
                "camera.target: found {}, expected another point than its position",
                camera.target
            ));
        }
        if view.normalize().cross(camera.up.normalize()).length() < 1e-4 {
            return Err(format!(
                "camera.up: found {}, expected a direction across the view",
                camera.up
            ));
        }
        range("camera.fov_deg", camera.fov_deg, 1e-3, 170.0)?;
        range("camera.aperture", camera.aperture, 0.0, FARTHEST)?;
        if let Some(focus) = camera.focus {
            range("camera.focus", focus, 1e-6, FARTHEST)?;
        }
        self.check_film()?;
        if !(1..=MAX_DEPTH).contains(&self.depth) {
            return Err(format!("depth: found {}, expected 1 to {MAX_DEPTH}", self.depth));
        }
        for (name, material) in &self.materials {
            check_material(&format!("materials.{name}"), material)?;
        }
        for (name, objects) in &self.groups {
            self.check_objects(&format!("groups.{name}"), objects)?;
        }
        self.check_objects("objects", &self.objects)?;
        self.check_groups()?;
        if self.lights.is_empty() {
            return Err("lights: found none, expected at least one".to_owned());
        }
        for (index, light) in self.lights.iter().enumerate() {
            check_light(&format!("lights[{index}]"), light)?;
        }
        Ok(())
    }

    fn check_film(&self) -> Result<(), String> {
        let [width, height] = self.film.size;
        Size::new(width, height).map_err(|error| format!("film.size: {error}"))?;
        match self.film.crop {
            Some([left, top, right, bottom])
                if left >= right || top >= bottom || right > width || bottom > height =>
            {
                Err(format!(
                    "film.crop: found [{left}, {top}, {right}, {bottom}], expected left, upper, right and lower \
                     edge within {width}x{height}"
                ))
            }
            _ => Ok(()),
        }
    }

    fn check_objects(&self, list: &str, objects: &[ObjectFile]) -> Result<(), String> {
        for (index, object) in objects.iter().enumerate() {
            let at = format!("{list}[{index}]");
            let length =
                |name: &str, value| range(&format!("{at}.shape.{name}"), value, 1e-6, FARTHEST);
            match object.shape {
                ShapeFile::Plane { width, height } => {
                    length("plane.width", width)?;
                    length("plane.height", height)?;
                }
                ShapeFile::Sphere { radius } => length("sphere.radius", radius)?,
                ShapeFile::Cylinder { radius, height } => {
                    length("cylinder.radius", radius)?;
                    length("cylinder.height", height)?;
                }
                ShapeFile::Drape { side } => length("drape.side", side)?,
                ShapeFile::File { .. } | ShapeFile::Sheet {} | ShapeFile::Group { .. } => {}
            }
            match (&object.shape, &object.material) {
                (ShapeFile::Group { name }, None) if self.groups.contains_key(name) => {}
                (ShapeFile::Group { .. }, Some(_)) => {
                    return Err(format!("{at}.material: found one, expected none for a group"));
                }
                (ShapeFile::Group { name }, None) => {
                    let known: Vec<_> = self.groups.keys().map(String::as_str).collect();
                    return Err(unknown(&format!("{at}.shape.group.name"), name, &known));
                }
                (_, Some(name)) if self.materials.contains_key(name) => {}
                (_, Some(name)) => {
                    let known: Vec<_> = self.materials.keys().map(String::as_str).collect();
                    return Err(unknown(&format!("{at}.material"), name, &known));
                }
                (_, None) => return Err(format!("{at}: found no \"material\", expected one")),
            }
            range(&format!("{at}.place.scale"), object.place.scale, 1e-6, 1e6)?;
            point(&format!("{at}.place.rotate_deg"), object.place.rotate_deg)?;
            point(&format!("{at}.place.translate"), object.place.translate)?;
            range(&format!("{at}.uv_scale"), object.uv_scale, 1e-6, 1e6)?;
        }
        Ok(())
    }

    /// Whether no group stands in itself.
    fn check_groups(&self) -> Result<(), String> {
        for start in self.groups.keys() {
            // Every group once: a second visit of the start is a way back to it.
            let (mut seen, mut ahead) = (vec![start], vec![start]);
            while let Some(name) = ahead.pop() {
                for object in &self.groups[name] {
                    let ShapeFile::Group { name } = &object.shape else { continue };
                    if name == start {
                        return Err(format!(
                            "groups.{start}: found itself within, expected no cycle"
                        ));
                    }
                    if !seen.contains(&name) {
                        seen.push(name);
                        ahead.push(name);
                    }
                }
            }
        }
        Ok(())
    }
}

fn check_material(at: &str, material: &MaterialFile) -> Result<(), String> {
    match material {
        MaterialFile::Cloth { .. } => Ok(()),
        MaterialFile::Diffuse { reflectance } => {
            share(&format!("{at}.diffuse.reflectance"), reflectance.0.into())
        }
        MaterialFile::Standard(standard) => {
            for (name, source) in [
                ("base_color", &standard.base_color),
                ("roughness", &standard.roughness),
                ("specular", &standard.specular),
            ] {
                if let ColorSource::Constant(color) = source {
                    share(&format!("{at}.standard.{name}"), *color)?;
                }
            }
            range(&format!("{at}.standard.anisotropy"), standard.anisotropy, -1.0, 1.0)?;
            standard
                .size
                .iter()
                .try_for_each(|&side| range(&format!("{at}.standard.size"), side, 1e-6, FARTHEST))
        }
    }
}

fn check_light(at: &str, light: &LightFile) -> Result<(), String> {
    match *light {
        LightFile::Quad { centre, toward, size, radiance } => {
            let at = format!("{at}.quad");
            point(&format!("{at}.centre"), centre)?;
            point(&format!("{at}.toward"), toward)?;
            if centre.distance(toward) < 1e-9 {
                return Err(format!(
                    "{at}.toward: found {toward}, expected another point than its centre"
                ));
            }
            for side in size {
                range(&format!("{at}.size"), side, 1e-6, FARTHEST)?;
            }
            emission(&format!("{at}.radiance"), radiance)
        }
        LightFile::Sphere { centre, radius, radiance } => {
            let at = format!("{at}.sphere");
            point(&format!("{at}.centre"), centre)?;
            range(&format!("{at}.radius"), radius, 1e-6, FARTHEST)?;
            emission(&format!("{at}.radiance"), radiance)
        }
        LightFile::Distant { from, irradiance, angle_deg } => {
            let at = format!("{at}.distant");
            direction(&format!("{at}.from"), from)?;
            range(&format!("{at}.angle_deg"), angle_deg, 0.0, 180.0)?;
            emission(&format!("{at}.irradiance"), irradiance)
        }
        LightFile::Constant { radiance } => emission(&format!("{at}.constant.radiance"), radiance),
        LightFile::Environment { rotation_deg, scale, .. } => {
            let at = format!("{at}.environment");
            range(&format!("{at}.rotation_deg"), rotation_deg, -1e6, 1e6)?;
            range(&format!("{at}.scale"), scale, 0.0, 1e6)
        }
    }
}

fn range(at: &str, found: f32, low: f32, high: f32) -> Result<(), String> {
    if (low..=high).contains(&found) {
        Ok(())
    } else {
        Err(format!("{at}: found {found}, expected {low} to {high}"))
    }
}

fn point(at: &str, found: Vec3) -> Result<(), String> {
    if found.abs().max_element() <= FARTHEST && found.is_finite() {
        Ok(())
    } else {
        Err(format!("{at}: found {found}, expected numbers up to {FARTHEST}"))
    }
}

fn direction(at: &str, found: Vec3) -> Result<(), String> {
    point(at, found)?;
    match found.try_normalize() {
        Some(_) => Ok(()),
        None => Err(format!("{at}: found {found}, expected a direction")),
    }
}

/// A colour of which every part is a share of light.
fn share(at: &str, found: Vec3) -> Result<(), String> {
    found.to_array().into_iter().try_for_each(|part| range(at, part, 0.0, 1.0))
}

fn emission(at: &str, found: Color) -> Result<(), String> {
    found.0.into_iter().try_for_each(|part| range(at, part, 0.0, 1e9))
}

fn unknown(at: &str, found: &str, known: &[&str]) -> String {
    let expected =
        if known.is_empty() { "one to exist".to_owned() } else { json::nearest(found, known) };
    format!("{at}: found {found:?}, expected {expected}")
}
