//! What is rendered: meshes, their materials, lights and a camera.

pub mod build;
pub mod drape;
pub mod file;
pub mod light;
pub mod load;
pub mod mesh;
mod placement;
pub mod shape;
pub mod source;
pub mod stage;
pub mod standard;
pub mod swatch;
pub mod texture;
pub mod uv;

use std::{collections::HashSet, sync::Arc};

use glam::{Vec2, Vec3};
use selvedge_yarn_brdf::Shader;
use thiserror::Error;

use self::{
    drape::{CameraPlacement, SideError},
    light::{Light, Lights, Sky},
    mesh::{Mesh, MeshError},
    shape::ShapeError,
    stage::{Shot, Stage},
    standard::Standard,
};
use crate::render::{
    camera::Lens,
    detail::{Detail, Shades, Tier},
    film::Filter,
    integrator::Estimator,
    intersect::{Geometry, GeometryError, Hit, Ray},
    stages::Stages,
};

/// A scene ready for rays.
#[derive(Debug)]
pub struct Scene {
    /// Where the camera stands.
    pub camera: CameraPlacement,
    /// The lens of the camera; `None` for a pinhole.
    pub lens: Option<Lens>,
    /// How samples make a pixel.
    pub filter: Filter,
    /// What lights it.
    pub lights: Lights,
    /// Surfaces after which a path ends, at least 1.
    pub depth: u32,
    /// How its lights are found.
    pub estimator: Estimator,
    /// At which level of detail cloth is shaded.
    pub detail: Detail,
    /// How its places are shaded.
    pub tier: Tier,
    /// How often it was, at either level.
    pub shades: Shades,
    /// Where the time goes that its pictures take.
    pub stages: Stages,
    surfaces: Vec<Surface>,
    geometry: Arc<Geometry>,
}

/// A mesh and what it is made of.
#[derive(Debug)]
pub struct Surface {
    /// Its shape; for cloth, its uv tell the place on the cloth.
    pub mesh: Arc<Mesh>,
    /// Of both its sides.
    pub material: Material,
}

/// What a surface does with light.
#[derive(Clone, Debug)]
pub enum Material {
    /// Scatters evenly: the reflectance, linear, each component in [0, 1].
    Matte(Vec3),
    /// Woven cloth.
    Cloth {
        /// How it scatters.
        shader: Arc<Shader>,
        /// Whether it has gaps, through which rays pass; if not, nobody needs to look for them.
        is_open: bool,
    },
    /// Pictures on a glossy surface.
    Standard {
        /// What the pictures mean.
        standard: Arc<Standard>,
        /// Width and height on the surface of one repeat of the pictures, m.
        size: Vec2,
    },
}

impl Material {
    /// Woven cloth that `shader` shades.
    pub fn cloth(shader: Shader) -> Self {
        let is_open = shader.has_gaps();
        Self::Cloth { shader: Arc::new(shader), is_open }
    }
}

/// Why there is no scene.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SceneError {
    /// The built-in cloth cannot be that large.
    #[error(transparent)]
    Side(#[from] SideError),
    /// The meshes are too much for the hierarchy.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A swatch cannot be that large.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A form cannot be that large.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

/// Surfaces after which a path ends for good: among white surfaces only does one come that far.
pub const MAX_DEPTH: u32 = 256;

/// Neutral grey of the floor, as of backdrop paper.
const FLOOR: Vec3 = Vec3::splat(0.5);

/// Radiance of the key light, slightly warm: lets a white card on the floor reflect 0.7.
const KEY: Vec3 = Vec3::new(24.4, 23.5, 21.8);

/// Slightly cool: lets a white card under the open sky reflect 0.3.
const SKY: Sky =
    Sky { zenith: Vec3::new(0.35, 0.38, 0.43), horizon: Vec3::new(0.15, 0.155, 0.165) };

impl Scene {
    /// The scene of `surfaces`, seen through a pinhole and a Gaussian filter, its lights
    /// found both ways.
    ///
    /// # Errors
    ///
    /// [`GeometryError`] when the meshes are too much for the hierarchy.
    pub fn new(
        surfaces: Vec<Surface>,
        camera: CameraPlacement,
        lights: Vec<Light>,
        depth: u32,
    ) -> Result<Self, GeometryError> {
        let meshes: Vec<_> = surfaces.iter().map(|surface| &*surface.mesh).collect();
        let geometry = Arc::new(Geometry::new(&meshes)?);
        Ok(Self::with_geometry(surfaces, geometry, camera, lights, depth))
    }

    /// As [`Scene::new`], where the hierarchy of the meshes of `surfaces` is known.
    fn with_geometry(
        surfaces: Vec<Surface>,
        geometry: Arc<Geometry>,
        camera: CameraPlacement,
        lights: Vec<Light>,
        depth: u32,
    ) -> Self {
        let lights = Lights::new(lights, geometry.extent());
        Self {
            camera,
            lens: None,
            filter: Filter::default(),
            lights,
            depth: depth.max(1),
            estimator: Estimator::default(),
            detail: Detail::default(),
            tier: Tier::default(),
            shades: Shades::default(),
            stages: Stages::default(),
            surfaces,
            geometry,
        }
    }

    /// The built-in scene: a square of cloth of `side` metres over a rounded form, lit like a
    /// product in a studio. A white card on its floor has radiance 1, more or less, whatever the
    /// side.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when the side is outside what [`SideError`] tells.
    pub fn built_in(cloth: Material, side: f32) -> Result<Self, SceneError> {
        Ok(Stage::drape(side)?.scene(cloth, &Shot::default()))
    }

    /// The surface that a hit of this scene is on.
    pub fn surface(&self, hit: &Hit) -> &Surface {
        &self.surfaces[hit.mesh as usize]
    }

    /// The cloths that are woven in it, each once.
    pub fn shaders(&self) -> impl Iterator<Item = &Shader> {
        let mut seen = HashSet::new();
        let shaders = self.surfaces.iter().filter_map(|surface| match &surface.material {
            Material::Cloth { shader, .. } => Some(shader),
            Material::Matte(_) | Material::Standard { .. } => None,
        });
        shaders.filter(move |shader| seen.insert(Arc::as_ptr(shader))).map(|shader| &**shader)
    }

    /// Bytes of memory that its pictures take.
    pub fn texture_bytes(&self) -> usize {
        let mut seen = HashSet::new();
        let standards = self.surfaces.iter().filter_map(|surface| match &surface.material {
            Material::Standard { standard, .. } => Some(standard),
            Material::Matte(_) | Material::Cloth { .. } => None,
        });
        let each = standards.filter(move |standard| seen.insert(Arc::as_ptr(standard)));
        each.map(|standard| standard.bytes()).sum()
    }

    /// Puts `material` in the place of all that is not [`Material::Matte`].
    pub fn dress(&mut self, material: &Material) {
        for surface in &mut self.surfaces {
            if !matches!(surface.material, Material::Matte(_)) {
                surface.material = material.clone();
            }
        }
    }

    /// Shapes of all surfaces, without their gaps.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The nearest hit on the ray that is not a gap in cloth.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.geometry.intersect_where(ray, 0.0, f32::INFINITY, |hit| self.is_solid(hit))
    }

    /// The nearest hits on `rays`, each as [`Scene::intersect`] finds it.
    pub fn intersect_all(&self, rays: &[Ray]) -> Vec<Option<Hit>> {
        let mut hits = self.geometry.intersect_all(rays, 0.0);
        let is_solid = self.are_solid(&hits);
        for ((hit, is_solid), ray) in hits.iter_mut().zip(is_solid).zip(rays) {
            if !is_solid {
                *hit = self.intersect(ray);
            }
        }
        hits
    }

    /// [`Scene::is_solid`] of each hit; true where there is none.
    fn are_solid(&self, hits: &[Option<Hit>]) -> Vec<bool> {
        /// From so many on, it takes less time to ask for all opacities at once.
        const MANY: usize = 8;
        let mesh = |hit: &Option<Hit>| hit.map(|hit| hit.mesh);
        let mut are_solid = Vec::with_capacity(hits.len());
        for run in hits.chunk_by(|a, b| mesh(a) == mesh(b)) {
            let surface = run[0].map(|hit| self.surface(&hit));
            let Some(Surface { mesh, material: Material::Cloth { shader, is_open: true } }) =
                surface
            else {
                are_solid.resize(are_solid.len() + run.len(), true);
                continue;
            };
            let run = run.iter().flatten();
            if run.clone().count() < MANY {
                are_solid.extend(run.map(|hit| self.is_solid(hit)));
                continue;
            }
            let (u, v): (Vec<_>, Vec<_>) = run
                .map(|hit| mesh.uv(hit.triangle, hit.barycentrics).as_dvec2())
                .map(|uv| (uv.x, uv.y))
                .unzip();
            let mut opacities = vec![0.0; u.len()];
            shader.opacity_batch([&u, &v], &mut opacities).expect("there is a v for each u");
            are_solid.extend(opacities.iter().map(|&opacity| opacity > 0.0));
        }
        are_solid
    }

    /// Whether anything but gaps lies on each of `rays` nearer than its distance in metres.
    pub fn occluded_all(&self, rays: &[(Ray, f32)]) -> Vec<bool> {
        self.geometry.occluded_all_where(rays, 0.0, |_, hit| self.is_solid(hit))
    }

    /// Whether anything but gaps lies on the ray nearer than `distance` metres.
    pub fn occluded(&self, ray: &Ray, distance: f32) -> bool {
        self.geometry.occluded_where(ray, 0.0, distance, |hit| self.is_solid(hit))
    }

    fn is_solid(&self, hit: &Hit) -> bool {
        let Surface { mesh, material } = self.surface(hit);
        match material {
            Material::Matte(_)
            | Material::Standard { .. }
            | Material::Cloth { is_open: false, .. } => true,
            Material::Cloth { shader, is_open: true } => {
                let uv = mesh.uv(hit.triangle, hit.barycentrics);
                shader.opacity(uv.as_dvec2()) > 0.0
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use selvedge_yarn_brdf::{Cloth, Thread, Weave, Yarn};

    use super::*;
    use crate::scene::{drape::RectangleLight, light::Quad};

    /// A square of plain-woven cloth of side 10 mm at z = 0: threads every 0.5 mm.
    fn cloth(diameter: f64) -> Scene {
        let threads = [0.4, 0.6].map(|grey| Thread {
            color: [grey; 3],
            pitch: Some(5e-4),
            diameter: Some(diameter),
            ..Thread::default()
        });
        let weave = Weave::new(2, 2, |end, pick| (end + pick) % 2 == 0).unwrap();
        let cloth = Cloth::from_threads(weave, &threads, &threads, &Yarn::default()).unwrap();
        let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|corner| corner * 0.01);
        let mesh = Mesh::with_smooth_normals(
            uvs.map(|uv| uv.extend(0.0)).into(),
            uvs.into(),
            vec![[0, 1, 2], [0, 2, 3]],
        );
        let material = Material::cloth(cloth.prepare().unwrap());
        let shape = RectangleLight { centre: Vec3::Z, half_u: Vec3::Y, half_v: Vec3::X };
        let camera = CameraPlacement {
            position: Vec3::Z,
            target: Vec3::ZERO,
            up: Vec3::Y,
            horizontal_fov: 1.0,
        };
        let light = Light::Quad(Quad::new(shape, Vec3::ONE));
        let lights = vec![light, Light::Sky(SKY)];
        Scene::new(
            vec![Surface { mesh: mesh.unwrap().into(), material }],
            camera,
            lights,
            MAX_DEPTH,
        )
        .unwrap()
    }

    /// The share of rays from above that pass through.
    fn gaps(scene: &Scene) -> f64 {
        let n = 101;
        let mut passed = 0;
        for k in 0..n * n {
            let place = (Vec2::new((k % n) as f32, (k / n) as f32) + 0.5) * (0.01 / n as f32);
            let ray = Ray { origin: place.extend(1.0), direction: Vec3::NEG_Z };
            let passes = scene.intersect(&ray).is_none();
            assert_eq!(scene.occluded(&ray, 2.0), !passes, "{place}");
            passed += u32::from(passes);
        }
        f64::from(passed) / f64::from(n * n)
    }

    #[test]
    fn rays_pass_through_the_gaps_of_open_cloth_only() {
        assert_eq!(gaps(&cloth(5e-4)), 0.0);
        // Threads of half the pitch leave half the width both ways.
        let open = gaps(&cloth(2.5e-4));
        assert!((open - 0.25).abs() < 0.02, "{open}, expected 0.25");
    }
}
