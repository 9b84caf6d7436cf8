//! From a scene's file to a scene.

use std::{
    collections::{BTreeMap, HashMap},
    f32::consts::{PI, TAU},
    io, mem,
    path::Path,
    sync::Arc,
};

use ::image::{ImageError, ImageReader, Limits};
use anyhow::Context;
use glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};
use selvedge_yarn_brdf::{Color, Noise, Shader};

use super::{
    Material, Scene, Surface,
    drape::{BuiltIn, CameraPlacement, RectangleLight},
    file::{
        ColorSource, LightFile, MaterialFile, ObjectFile, PlaceFile, RIG_LIGHTS, SceneFile,
        ShapeFile,
    },
    light::{Constant, Distant, Environment, Light, Quad, Sphere},
    load,
    mesh::Mesh,
    shape::Shape,
    standard::{Input, Standard},
    texture::{Encoding, MipTexture},
    uv::UvReport,
};
use crate::{
    fabric, image,
    render::{
        camera::{COMPOSED_ASPECT, Lens},
        intersect::{GeometryError, MAX_COORDINATE},
    },
};

/// A scene, and what there is to tell of it.
#[derive(Debug)]
pub struct Built {
    /// The scene.
    pub scene: Scene,
    /// Lines that begin with what they are about.
    pub warnings: Vec<String>,
    /// [Hash](crate::fabric::FabricSource::hash) of the fabric of each cloth, in the order of
    /// [`Scene::shaders`].
    pub fabrics: Vec<u64>,
}

/// Most objects of a scene, those of its groups counted each time that they stand there.
pub const MAX_OBJECTS: usize = 1 << 16;

/// Most triangles of a scene, those of its groups counted each time that they stand there: what the
/// largest mesh that is read may have, some GB of memory.
pub const MAX_TRIANGLES: usize = 1 << 25;

impl SceneFile {
    /// The scene of this file, which stands in `folder`; `cloth`, a draft, a fabric or a preset,
    /// takes the place of all its fabrics.
    ///
    /// # Errors
    ///
    /// A line *where: what was found, expected what* when a file that it names is none, or there is
    /// more in it than a scene can hold.
    pub fn build(&self, folder: &Path, cloth: Option<&Path>) -> Result<Built, anyhow::Error> {
        let mut builder = Builder {
            file: self,
            folder,
            materials: BTreeMap::new(),
            meshes: HashMap::new(),
            placed: Vec::new(),
            triangles: 0,
            warnings: Vec::new(),
            fabrics: Vec::new(),
        };
        for (name, material) in &self.materials {
            let material = builder.material(name, material, cloth)?;
            builder.materials.insert(name, material);
        }
        builder.place("objects", &self.objects, Affine3A::IDENTITY)?;
        let (surfaces, places) = builder.surfaces()?;
        let lights = self.lights.iter().enumerate();
        let lights: Vec<_> = lights
            .map(|(index, light)| light.build(folder, &format!("lights[{index}]")))
            .collect::<Result<_, _>>()?;
        let lights = lights.into_iter().flatten().collect();
        let Builder { warnings, fabrics, .. } = builder;
        let mut scene = Scene::new(surfaces, self.camera(), lights, self.depth).map_err(
            |error| match error {
                // Its meshes are in the order of what is placed.
                GeometryError::TooLarge(mesh) => {
                    anyhow::anyhow!(
                        "{}: found a coordinate above {MAX_COORDINATE} m, expected a smaller scene",
                        places[mesh]
                    )
                }
                error => error.into(),
            },
        )?;
        let camera = &self.camera;
        let focus = camera.focus.unwrap_or_else(|| camera.position.distance(camera.target));
        scene.lens = (camera.aperture > 0.0).then_some(Lens { radius: camera.aperture, focus });
        scene.filter = self.film.filter;
        let hash = |shader: &Shader| {
            let fabric = fabrics.iter().find(|(known, _)| std::ptr::eq(&**known, shader));
            fabric.map(|(_, hash)| *hash)
        };
        let fabrics = scene.shaders().filter_map(hash).collect();
        Ok(Built { scene, warnings, fabrics })
    }

    fn camera(&self) -> CameraPlacement {
        let camera = &self.camera;
        let [width, height] = self.film.size.map(|side| side as f32);
        // A placement names the angle that a picture with sides of 3 to 2 shows.
        let composed = (width / height / COMPOSED_ASPECT).max(1.0);
        let tan = (camera.fov_deg.to_radians() / 2.0).tan() / composed;
        CameraPlacement {
            position: camera.position,
            target: camera.target,
            up: camera.up,
            horizontal_fov: 2.0 * tan.atan(),
        }
    }
}

struct Builder<'a> {
    file: &'a SceneFile,
    folder: &'a Path,
    materials: BTreeMap<&'a str, Material>,
    /// Of each shape, as it is written, once.
    meshes: HashMap<String, Arc<Mesh>>,
    placed: Vec<Placed<'a>>,
    /// Of all that is placed.
    triangles: usize,
    warnings: Vec<String>,
    /// Each cloth with the hash of its fabric.
    fabrics: Vec<(Arc<Shader>, u64)>,
}

/// An object where it stands. It shares its mesh, so that too many are told before they take memory.
struct Placed<'a> {
    at: String,
    object: &'a ObjectFile,
    mesh: Arc<Mesh>,
    material: Material,
    into_world: Affine3A,
}

impl<'a> Builder<'a> {
    fn material(
        &mut self,
        name: &str,
        material: &MaterialFile,
        cloth: Option<&Path>,
    ) -> anyhow::Result<Material> {
        match material {
            MaterialFile::Diffuse { reflectance } => Ok(Material::Matte(reflectance.0.into())),
            MaterialFile::Standard(standard) => {
                let at = format!("materials.{name}.standard");
                let input = |part: &str, source: &ColorSource, encoding| {
                    self.input(&format!("{at}.{part}"), source, encoding)
                };
                let normal = match &standard.normal {
                    Some(path) => self.texture(&format!("{at}.normal"), path, Encoding::Linear)?,
                    None => Standard::default().normal,
                };
                let anisotropy = match &standard.anisotropy_map {
                    Some(path) => {
                        self.texture(&format!("{at}.anisotropy_map"), path, Encoding::Linear)?
                    }
                    None => Input::Constant(Vec3::splat(standard.anisotropy)),
                };
                let inputs = Standard {
                    base_color: input("base_color", &standard.base_color, Encoding::Srgb)?,
                    normal,
                    roughness: input("roughness", &standard.roughness, Encoding::Linear)?,
                    specular: input("specular", &standard.specular, Encoding::Linear)?,
                    anisotropy,
                };
                let size = standard.size.into();
                Ok(Material::Standard { standard: Arc::new(inputs), size })
            }
            MaterialFile::Cloth { fabric, noise } => {
                let at = format!("materials.{name}.cloth.fabric");
                let (at, path) = match cloth {
                    Some(cloth) => ("--cloth".to_owned(), cloth.to_owned()),
                    None if fabric.starts_with(fabric::PRESET) => (at, fabric.into()),
                    None => (at, self.folder.join(fabric)),
                };
                let woven = || -> anyhow::Result<_> {
                    let source = fabric::read(&path)?;
                    let drawdown = source.draft().drawdown()?;
                    let mut cloth = source.cloth(&drawdown)?;
                    if !noise {
                        cloth.yarns.iter_mut().for_each(|yarn| yarn.noise = Noise::default());
                    }
                    let shader = source.shader(&cloth)?;
                    Ok((source, drawdown, shader))
                };
                let (source, drawdown, shader) = woven().context(at)?;
                self.warnings.extend(source.draft().warnings().map(|warning| warning.to_string()));
                self.warnings.extend(source.warnings(&drawdown, &shader));
                let shader = Arc::new(shader);
                let is_open = shader.has_gaps();
                self.fabrics.push((Arc::clone(&shader), source.hash()?));
                Ok(Material::Cloth { shader, is_open })
            }
        }
    }

    fn input(&self, at: &str, source: &ColorSource, encoding: Encoding) -> anyhow::Result<Input> {
        match source {
            ColorSource::Constant(color) => Ok(Input::Constant(*color)),
            ColorSource::Texture(path) => self.texture(at, path, encoding),
        }
    }

    /// The picture at `path`, PNG.
    fn texture(&self, at: &str, path: &Path, encoding: Encoding) -> anyhow::Result<Input> {
        let path = self.folder.join(path);
        let texture = || -> anyhow::Result<MipTexture> {
            let reader = ImageReader::open(&path).and_then(ImageReader::with_guessed_format);
            let mut reader = reader.map_err(|error| match error.kind() {
                io::ErrorKind::NotFound => anyhow::anyhow!("no such file"),
                io::ErrorKind::IsADirectory => {
                    anyhow::anyhow!("found a folder, expected a picture")
                }
                _ => anyhow::anyhow!("cannot be read: {error}"),
            })?;
            reader.limits(Limits::default());
            let picture = reader.decode().map_err(|error| match error {
                ImageError::Unsupported(_) => anyhow::anyhow!("found no PNG, expected one"),
                error => anyhow::anyhow!("found a broken picture ({error}), expected a PNG"),
            })?;
            Ok(MipTexture::new(&picture, encoding)?)
        };
        let context = || format!("{at}: {}", path.display());
        Ok(Input::Texture(Arc::new(texture().with_context(context)?)))
    }

    fn place(
        &mut self,
        list: &str,
        objects: &'a [ObjectFile],
        into_world: Affine3A,
    ) -> anyhow::Result<()> {
        for (index, object) in objects.iter().enumerate() {
            let at = format!("{list}[{index}]");
            let into_world = into_world * object.place.map();
            if let ShapeFile::Group { name } = &object.shape {
                // Checked to exist, and not to hold itself.
                let members = &self.file.groups[name];
                self.place(&format!("groups.{name}"), members, into_world)?;
                continue;
            }
            let material = object.material.as_deref().and_then(|name| self.materials.get(name));
            let Some(material) = material.cloned() else { continue };
            let mesh = self.mesh(&object.shape).with_context(|| match object.shape {
                ShapeFile::File { .. } => format!("{at}.shape.file.path"),
                _ => format!("{at}.shape"),
            })?;
            self.triangles += mesh.triangles().len();
            if self.triangles > MAX_TRIANGLES {
                anyhow::bail!(
                    "{at}: found more than {MAX_TRIANGLES} triangles up to here, expected fewer"
                );
            }
            self.placed.push(Placed { at, object, mesh, material, into_world });
        }
        Ok(())
    }

    fn mesh(&mut self, shape: &ShapeFile) -> anyhow::Result<Arc<Mesh>> {
        let key = format!("{shape:?}");
        if let Some(mesh) = self.meshes.get(&key) {
            return Ok(Arc::clone(mesh));
        }
        let mesh = match *shape {
            ShapeFile::File { ref path } => load::read(&self.folder.join(path))?,
            ShapeFile::Drape { side } => BuiltIn::new(side)?.cloth,
            ShapeFile::Plane { width, height } => Shape::Plane { width, height }.mesh()?,
            ShapeFile::Sphere { radius } => Shape::Sphere { radius }.mesh()?,
            ShapeFile::Cylinder { radius, height } => Shape::Cylinder { radius, height }.mesh()?,
            ShapeFile::Sheet {} => Shape::Sheet.mesh()?,
            ShapeFile::Wrinkled { side } => Shape::Wrinkled { side }.mesh()?,
            ShapeFile::Group { ref name } => {
                anyhow::bail!("group {name:?}: found a group, expected a shape of its own")
            }
        };
        let mesh = Arc::new(mesh);
        self.meshes.insert(key, Arc::clone(&mesh));
        Ok(mesh)
    }

    /// All that is placed, in the world, and where in the file each is said to stand.
    fn surfaces(&mut self) -> anyhow::Result<(Vec<Surface>, Vec<String>)> {
        let placed = mem::take(&mut self.placed);
        let surface = |Placed { at, object, mesh, material, into_world }: Placed<'_>| {
            let mesh = Mesh::clone(&mesh).with_uv_scaled(object.uv_scale * object.shape.uv_scale());
            let mesh = mesh.transformed(into_world).with_context(|| at.clone())?;
            if matches!(material, Material::Cloth { .. }) {
                let warnings = UvReport::new(&mesh).warnings().into_iter();
                self.warnings.extend(warnings.map(|warning| format!("warning: {at}: {warning}")));
            }
            Ok((Surface { mesh: mesh.into(), material }, at))
        };
        placed.into_iter().map(surface).collect()
    }
}

impl ShapeFile {
    /// What makes metres of the uv of the shape.
    fn uv_scale(&self) -> f32 {
        // The sheet has the uv of the scene that it was made for: 1 for 2 m.
        if matches!(self, Self::Sheet {}) { 2.0 } else { 1.0 }
    }
}

impl PlaceFile {
    fn map(&self) -> Affine3A {
        let [x, y, z] = self.rotate_deg.to_array().map(f32::to_radians);
        let rotation = Quat::from_euler(EulerRot::ZYX, z, y, x);
        Affine3A::from_scale_rotation_translation(Vec3::splat(self.scale), rotation, self.translate)
    }
}

impl LightFile {
    /// The lights that it stands for; paths start at `folder`, and `at` is where it stands.
    pub(crate) fn build(&self, folder: &Path, at: &str) -> anyhow::Result<Vec<Light>> {
        let color = |color: Color| Vec3::from(color.0);
        Ok(vec![match *self {
            Self::Quad { centre, toward, size, radiance } => {
                let facing = (toward - centre).normalize();
                // Its width is level.
                let level = Vec3::Z.cross(facing).normalize_or(Vec3::X);
                let (half_u, half_v) =
                    (level * (size[0] / 2.0), facing.cross(level) * (size[1] / 2.0));
                let shape = RectangleLight { centre, half_u, half_v };
                Light::Quad(Quad::new(shape, color(radiance)))
            }
            Self::Sphere { centre, radius, radiance } => {
                Light::Sphere(Sphere { centre, radius, radiance: color(radiance) })
            }
            Self::Distant { from, irradiance, angle_deg } => Light::Distant(Distant::new(
                from.normalize(),
                color(irradiance),
                angle_deg.to_radians().min(PI),
            )),
            Self::Rig { irradiance, elevation_deg, angle_deg, only } => {
                let lit = (1..=RIG_LIGHTS).filter(|&light| only.is_none_or(|only| only == light));
                let (sin, cos) = elevation_deg.to_radians().sin_cos();
                let lights = lit.map(|light| {
                    let around = TAU * (light - 1) as f32 / RIG_LIGHTS as f32;
                    let towards = (Vec2::from_angle(around) * cos).extend(sin).normalize();
                    let angle = angle_deg.to_radians().min(PI);
                    Light::Distant(Distant::new(towards, color(irradiance), angle))
                });
                return Ok(lights.collect());
            }
            Self::Constant { radiance } => Light::Constant(Constant { radiance: color(radiance) }),
            Self::Environment { ref path, rotation_deg, scale } => {
                let path = folder.join(path);
                let context = || format!("{at}.environment.path");
                let picture = image::read(&path)
                    .map_err(|error| anyhow::Error::from(error).context(context()))?;
                let size = picture.size();
                let environment = Environment::new(
                    picture.to_colors(),
                    [size.width() as usize, size.height() as usize],
                    rotation_deg.to_radians(),
                    scale,
                );
                let context = || format!("{}: {}", context(), path.display());
                Light::Environment(
                    environment.map_err(|error| anyhow::Error::from(error).context(context()))?,
                )
            }
        }])
    }
}
