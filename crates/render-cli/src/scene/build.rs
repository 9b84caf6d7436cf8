//! From a scene's file to a scene.

use std::{
    collections::{BTreeMap, HashMap},
    f32::consts::PI,
    path::{Path, PathBuf},
    sync::Arc,
};

use ::image::{ImageReader, Limits};
use anyhow::Context;
use glam::{Affine3A, EulerRot, Quat, Vec3};
use selvedge_yarn_brdf::Color;

use super::{
    Material, Scene, Surface,
    drape::{BuiltIn, CameraPlacement, RectangleLight},
    file::{ColorSource, LightFile, MaterialFile, ObjectFile, PlaceFile, SceneFile, ShapeFile},
    light::{AreaLight, Constant, Distant, Environment, Light, Quad, Sphere},
    load,
    mesh::Mesh,
    shape::Shape,
    standard::{Input, Standard},
    texture::{Encoding, MipTexture},
    uv::UvReport,
};
use crate::{
    fabric, image,
    render::camera::{COMPOSED_ASPECT, Lens},
};

/// A scene, and what is odd about it.
#[derive(Debug)]
pub struct Built {
    /// The scene.
    pub scene: Scene,
    /// Lines that begin with what they are about.
    pub warnings: Vec<String>,
}

/// Most objects of a scene, those of its groups counted each time that they stand there.
pub const MAX_OBJECTS: usize = 1 << 16;

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
            surfaces: Vec::new(),
            warnings: Vec::new(),
        };
        for (name, material) in &self.materials {
            let material = builder.material(name, material, cloth)?;
            builder.materials.insert(name, material);
        }
        builder.place("objects", &self.objects, Affine3A::IDENTITY)?;
        let lights = self.lights.iter().enumerate();
        let lights: Vec<_> = lights
            .map(|(index, light)| light.build(folder, &format!("lights[{index}]")))
            .collect::<Result<_, _>>()?;
        let Builder { surfaces, warnings, .. } = builder;
        let mut scene = Scene::new(surfaces, self.camera(), lights, self.depth)?;
        let camera = &self.camera;
        let focus = camera.focus.unwrap_or_else(|| camera.position.distance(camera.target));
        scene.lens = (camera.aperture > 0.0).then_some(Lens { radius: camera.aperture, focus });
        scene.filter = self.film.filter;
        Ok(Built { scene, warnings })
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
    /// Those of files, read once.
    meshes: HashMap<PathBuf, Arc<Mesh>>,
    surfaces: Vec<Surface>,
    warnings: Vec<String>,
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
                let inputs = Standard {
                    base_color: input("base_color", &standard.base_color, Encoding::Srgb)?,
                    normal,
                    roughness: input("roughness", &standard.roughness, Encoding::Linear)?,
                    specular: input("specular", &standard.specular, Encoding::Linear)?,
                    anisotropy: Input::Constant(Vec3::splat(standard.anisotropy)),
                };
                let size = standard.size.into();
                Ok(Material::Standard { standard: Arc::new(inputs), size })
            }
            MaterialFile::Cloth { fabric } => {
                let path = match cloth {
                    Some(cloth) => cloth.to_owned(),
                    None if fabric.starts_with(fabric::PRESET) => fabric.into(),
                    None => self.folder.join(fabric),
                };
                let source = fabric::read(&path).map_err(|error| {
                    anyhow::Error::from(error).context(format!("materials.{name}.cloth.fabric"))
                })?;
                let drawdown = source.draft().drawdown()?;
                let shader = source.shader(&source.cloth(&drawdown)?)?;
                self.warnings.extend(source.draft().warnings().map(|warning| warning.to_string()));
                self.warnings.extend(source.warnings(&drawdown, &shader));
                Ok(Material::cloth(shader))
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
            let mut reader = ImageReader::open(&path)?.with_guessed_format()?;
            reader.limits(Limits::default());
            Ok(MipTexture::new(&reader.decode()?, encoding)?)
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
            if self.surfaces.len() >= MAX_OBJECTS {
                anyhow::bail!("{at}: found more than {MAX_OBJECTS} objects, expected fewer");
            }
            let mesh = self.mesh(&object.shape).map_err(|error| error.context(at.clone()))?;
            let mesh = mesh.with_uv_scaled(object.uv_scale * object.shape.uv_scale());
            let mesh = mesh
                .transformed(into_world)
                .map_err(|error| anyhow::Error::from(error).context(at.clone()))?;
            if matches!(material, Material::Cloth { .. }) {
                let report = UvReport::new(&mesh);
                let warnings = report.warnings();
                self.warnings.extend(
                    warnings.into_iter().map(|warning| format!("warning: {at}: {warning}")),
                );
            }
            self.surfaces.push(Surface { mesh, material });
        }
        Ok(())
    }

    fn mesh(&mut self, shape: &ShapeFile) -> anyhow::Result<Mesh> {
        let shape = match *shape {
            ShapeFile::File { ref path } => {
                let path = self.folder.join(path);
                if let Some(mesh) = self.meshes.get(&path) {
                    return Ok(Mesh::clone(mesh));
                }
                let mesh = load::read(&path)?;
                self.meshes.insert(path, Arc::new(mesh.clone()));
                return Ok(mesh);
            }
            ShapeFile::Drape { side } => return Ok(BuiltIn::new(side)?.cloth),
            ShapeFile::Plane { width, height } => Shape::Plane { width, height },
            ShapeFile::Sphere { radius } => Shape::Sphere { radius },
            ShapeFile::Cylinder { radius, height } => Shape::Cylinder { radius, height },
            ShapeFile::Sheet {} | ShapeFile::Group { .. } => Shape::Sheet,
        };
        Ok(shape.mesh()?)
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
    fn build(&self, folder: &Path, at: &str) -> anyhow::Result<Light> {
        let color = |color: Color| Vec3::from(color.0);
        Ok(match *self {
            Self::Quad { centre, toward, size, radiance } => {
                let facing = (toward - centre).normalize();
                // Its width is level.
                let level = Vec3::Z.cross(facing).normalize_or(Vec3::X);
                let (half_u, half_v) =
                    (level * (size[0] / 2.0), facing.cross(level) * (size[1] / 2.0));
                let shape = RectangleLight { centre, half_u, half_v };
                Light::Quad(Quad::new(AreaLight { shape, radiance: color(radiance) }))
            }
            Self::Sphere { centre, radius, radiance } => {
                Light::Sphere(Sphere { centre, radius, radiance: color(radiance) })
            }
            Self::Distant { from, irradiance, angle_deg } => Light::Distant(Distant::new(
                from.normalize(),
                color(irradiance),
                angle_deg.to_radians().min(PI),
            )),
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
                let context = || format!("{at}: {}", path.display());
                Light::Environment(
                    environment.map_err(|error| anyhow::Error::from(error).context(context()))?,
                )
            }
        })
    }
}
