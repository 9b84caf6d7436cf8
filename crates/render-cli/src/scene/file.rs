//! A scene as a file: camera, film, materials, objects and lights.
//!
//! The types here are what the file says and no more: lengths in metres, angles in degrees, paths
//! relative to the file. [`SceneFile::check`] finds numbers that mean nothing.

mod check;
mod groups;
mod schema;

use std::{collections::BTreeMap, marker::PhantomData, path::PathBuf};

use glam::Vec3;
use schemars::{JsonSchema, Schema};
use selvedge_yarn_brdf::Color;
use serde::{Deserialize, Deserializer, de::Error as _};

use crate::{
    json,
    render::film::{Filter, MAX_PIXELS},
    scene::MAX_DEPTH,
};

/// A scene.
///
/// Lengths are in metres, angles in degrees, z points up; paths start at the file.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "A scene of Selvedge")]
pub struct SceneFile {
    /// Version of the format, 1.
    #[serde(deserialize_with = "version")]
    #[schemars(extend("const" = 1))]
    pub version: u64,
    /// From where it is seen.
    pub camera: CameraFile,
    /// What the camera exposes.
    #[serde(default)]
    pub film: FilmFile,
    /// Surfaces after which a path ends: 1 shows what lights alone light.
    #[serde(default = "default_depth")]
    #[schemars(range(min = 1, max = MAX_DEPTH))]
    pub depth: u32,
    /// What things are made of, by name.
    #[serde(deserialize_with = "by_name")]
    pub materials: BTreeMap<String, MaterialFile>,
    /// Things that stand together, by name, to be placed as one.
    #[serde(default, deserialize_with = "by_name")]
    pub groups: BTreeMap<String, Vec<ObjectFile>>,
    /// What stands in the scene.
    #[schemars(length(min = 1))]
    pub objects: Vec<ObjectFile>,
    /// What lights it.
    #[schemars(length(min = 1))]
    pub lights: Vec<LightFile>,
}

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// Centre of the lens, m.
    #[schemars(schema_with = "schema::point")]
    pub position: Vec3,
    /// A point in the middle of the picture, m.
    #[schemars(schema_with = "schema::point")]
    pub target: Vec3,
    /// A direction that points up in the picture.
    #[serde(default = "z_axis")]
    #[schemars(schema_with = "schema::point")]
    pub up: Vec3,
    /// Angle between the left and the right edge, degrees.
    #[schemars(range(min = 0.001, max = 170.0))]
    pub fov_deg: f32,
    /// Radius of the lens, m; 0 has everything in focus.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub aperture: f32,
    /// Distance at which a lens is in focus, m; that of the target if it is not given.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub focus: Option<f32>,
}

/// What the camera exposes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilmFile {
    /// Width and height, pixels.
    #[schemars(inner(range(min = 1, max = MAX_PIXELS)))]
    pub size: [u32; 2],
    /// Left, upper, right and lower edge of the part that is rendered, pixels.
    pub crop: Option<[u32; 4]>,
    /// How samples make a pixel.
    #[schemars(schema_with = "schema::filter")]
    pub filter: Filter,
}

/// What a thing is made of.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MaterialFile {
    /// Woven cloth.
    Cloth {
        /// A draft or a fabric: its path, or `preset:NAME`.
        fabric: String,
        /// Whether its yarns are as uneven as the fabric says, or all alike: faster.
        #[serde(default = "yes")]
        noise: bool,
    },
    /// Scatters evenly.
    Diffuse {
        /// Share of the light that is scattered, in [0, 1].
        #[schemars(schema_with = "schema::share")]
        reflectance: Color,
    },
    /// Textures on a glossy surface.
    Standard(Box<StandardFile>),
}

/// Textures on a glossy surface: an anisotropic GGX over a diffuse base.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
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
    #[schemars(range(min = -1.0, max = 1.0))]
    pub anisotropy: f32,
    /// A picture of the anisotropy in its place, halved and shifted by 0.5.
    pub anisotropy_map: Option<PathBuf>,
    /// Width and height on the surface of one repeat of the textures, m.
    #[serde(default = "one_by_one")]
    #[schemars(schema_with = "schema::lengths")]
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
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
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
    #[schemars(schema_with = "schema::length")]
    pub uv_scale: f32,
}

/// The shape of a thing, about the origin, z up.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
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
        #[schemars(schema_with = "schema::length")]
        width: f32,
        /// Along y, m.
        #[schemars(schema_with = "schema::length")]
        height: f32,
    },
    /// A sphere.
    Sphere {
        /// Its radius, m.
        #[schemars(schema_with = "schema::length")]
        radius: f32,
    },
    /// A cylinder along z without ends.
    Cylinder {
        /// Its radius, m.
        #[schemars(schema_with = "schema::length")]
        radius: f32,
        /// Along z, m.
        #[schemars(schema_with = "schema::length")]
        height: f32,
    },
    /// A wavy sheet of 2 × 2 m.
    Sheet {},
    /// A square sample that lies flat but for its wrinkles.
    Wrinkled {
        /// Its side, m.
        #[schemars(schema_with = "schema::length")]
        side: f32,
    },
    /// A cloth that has fallen over a low drum.
    Drape {
        /// Side of the cloth, m.
        #[schemars(range(min = 0.001, max = 1000.0))]
        side: f32,
    },
    /// One of the scene's groups.
    Group {
        /// Its name.
        name: String,
    },
}

/// Where a thing stands: scaled, then turned about x, y and z in turn, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlaceFile {
    /// Factor of all lengths.
    #[schemars(schema_with = "schema::length")]
    pub scale: f32,
    /// Turns about x, y and z, degrees.
    #[schemars(schema_with = "schema::point")]
    pub rotate_deg: Vec3,
    /// Where its origin goes, m.
    #[schemars(schema_with = "schema::point")]
    pub translate: Vec3,
}

/// What lights a scene. Radiances are linear, in W/(m² sr) or any unit.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum LightFile {
    /// A rectangle that shines from one side.
    Quad {
        /// Its middle, m.
        #[schemars(schema_with = "schema::point")]
        centre: Vec3,
        /// A point that it faces, m.
        #[schemars(schema_with = "schema::point")]
        toward: Vec3,
        /// Width and height, m.
        #[schemars(schema_with = "schema::lengths")]
        size: [f32; 2],
        /// What leaves it.
        #[schemars(schema_with = "schema::emission")]
        radiance: Color,
    },
    /// A ball that shines.
    Sphere {
        /// Its middle, m.
        #[schemars(schema_with = "schema::point")]
        centre: Vec3,
        /// Its radius, m.
        #[schemars(schema_with = "schema::length")]
        radius: f32,
        /// What leaves it.
        #[schemars(schema_with = "schema::emission")]
        radiance: Color,
    },
    /// Light from far away.
    Distant {
        /// Where it comes from.
        #[schemars(schema_with = "schema::point")]
        from: Vec3,
        /// On a surface that faces it.
        #[schemars(schema_with = "schema::emission")]
        irradiance: Color,
        /// Diameter in degrees; 0 is a point.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 180.0))]
        angle_deg: f32,
    },
    /// Six lights from afar, all around at one height.
    Rig {
        /// Of each, on a surface that faces it.
        #[schemars(schema_with = "schema::emission")]
        irradiance: Color,
        /// Above the horizon, degrees.
        #[serde(default = "low")]
        #[schemars(range(min = -90.0, max = 90.0))]
        elevation_deg: f32,
        /// Diameter of each in degrees; 0 is a point.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 180.0))]
        angle_deg: f32,
        /// Which one alone shines, 1 to 6; all if absent.
        #[serde(default)]
        #[schemars(range(min = 1, max = RIG_LIGHTS))]
        only: Option<u32>,
    },
    /// The same from everywhere.
    Constant {
        /// From each direction.
        #[schemars(schema_with = "schema::emission")]
        radiance: Color,
    },
    /// A picture of all directions, latitude by longitude, z up: EXR or HDR.
    Environment {
        /// The picture.
        path: PathBuf,
        /// Turned about z, degrees.
        #[serde(default)]
        #[schemars(range(min = -1e6, max = 1e6))]
        rotation_deg: f32,
        /// Factor of its radiance.
        #[serde(default = "one")]
        #[schemars(range(min = 0.0, max = 1e6))]
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
        Err(D::Error::custom(format_args!("found version {version}, expected 1")))
    }
}

/// A map of which no name is given twice.
fn by_name<'de, D, T>(from: D) -> Result<BTreeMap<String, T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    struct MapVisitor<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> serde::de::Visitor<'de> for MapVisitor<T> {
        type Value = BTreeMap<String, T>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("an object of names and what they mean")
        }

        fn visit_map<A: serde::de::MapAccess<'de>>(
            self,
            mut from: A,
        ) -> Result<Self::Value, A::Error> {
            let mut map = BTreeMap::new();
            while let Some(name) = from.next_key::<String>()? {
                if name.chars().any(char::is_control) {
                    let what =
                        format!("found {name:?}, expected a name without control characters");
                    return Err(A::Error::custom(what));
                }
                if map.contains_key(&name) {
                    let what = format!("found {name:?} a second time, expected it once");
                    return Err(A::Error::custom(what));
                }
                let value = from.next_value()?;
                map.insert(name, value);
            }
            Ok(map)
        }
    }
    from.deserialize_map(MapVisitor(PhantomData))
}

fn default_depth() -> u32 {
    8
}

fn z_axis() -> Vec3 {
    Vec3::Z
}

/// Lights of a rig.
pub const RIG_LIGHTS: u32 = 6;

/// Elevation at which raking light shows the weave, degrees.
fn low() -> f32 {
    30.0
}

fn yes() -> bool {
    true
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

/// The JSON Schema of scenes in files.
///
/// What it refuses, [`parse`] refuses too. It cannot say that names are those of something, that
/// a direction is none, or what depends on several numbers.
pub fn schema() -> Schema {
    json::schema::<SceneFile>()
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
