//! Light that arrives along a ray: unidirectional path tracing.
//!
//! At each surface the key light is sampled and the path goes on in a direction drawn by the
//! cosine or, at cloth, nearly in proportion to what it reflects. The key light is found both ways,
//! and each counts as much as it is likely to find it (Veach 1997, section 9.2.2), so that neither a
//! narrow highlight nor a near light is noisy. A path that leaves the scene finds the sky. Paths end
//! by chance (Russian roulette), which biases nothing.

use std::f32::consts::FRAC_1_PI;

use glam::{Mat3, Vec3};
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::Shader;

use super::{
    footprint::{self, Beam, Footprint},
    intersect::{Hit, Ray},
    sampler::Sample,
};
use crate::scene::{
    Material, Scene, Surface,
    mesh::{Mesh, SurfacePoint},
};

/// Surfaces that a path meets before it may end by chance. Ending after two instead of four gives
/// twice the noise on the floor and saves a tenth of the time.
const SURE_VERTICES: u32 = 4;

/// Surfaces after which a path ends for good: among white surfaces only does one come that far.
const MAX_VERTICES: u32 = 256;

/// Points at which cloth is shaded for each ray, where the camera sees it and where light bounces.
const CAMERA_POINTS: usize = 4;
const BOUNCE_POINTS: usize = 4;

/// Spread of the beams between surfaces, in rad. A bounce goes anywhere and does not see single
/// threads; this blurs what it sees by a fifth of the distance.
const BOUNCE_SPREAD: f32 = 0.2;

/// An estimate of the radiance that arrives at the beam's origin along it, linear RGB.
///
/// Cloth is shaded as the mean over the [`Footprint`] of the beam.
///
/// Unbiased but for what is scattered from one side of the shading normal to the other side of the
/// triangle: that is absorbed, since it would shine through.
pub fn radiance(scene: &Scene, mut beam: Beam, sample: &mut Sample) -> Vec3 {
    let mut radiance = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    // With which the last surface chose the direction; the camera does not see the key light.
    let mut density = None;
    for vertices in 1..=MAX_VERTICES {
        let hit = scene.intersect(&beam.ray);
        if let Some(density) = density {
            let reach = hit.map_or(f32::INFINITY, |hit| hit.t);
            radiance += throughput * key_light_ahead(scene, &beam.ray, reach, density);
        }
        let Some(hit) = hit else {
            return radiance + throughput * scene.sky.radiance(beam.ray.direction);
        };
        let points = if vertices == 1 { CAMERA_POINTS } else { BOUNCE_POINTS };
        let vertex = Vertex::new(scene.surface(&hit), &hit, &beam, points, sample);
        radiance += throughput * vertex.direct_light(scene, sample);

        let Some(bounce) = vertex.bounce(sample) else { break };
        throughput *= bounce.weight;
        density = Some(bounce.density);
        if vertices >= SURE_VERTICES {
            let survival = throughput.max_element().min(1.0);
            if sample.next_1d() >= survival {
                break;
            }
            throughput /= survival;
        }
        let direction = bounce.direction;
        let origin = vertex.leave(scene, direction);
        beam = Beam { ray: Ray { origin, direction }, spread: BOUNCE_SPREAD };
    }
    radiance
}

/// Radiance of the key light along a ray that was chosen with `density`, sr⁻¹, and meets nothing
/// before `reach`: its share in what both ways to find the light find.
fn key_light_ahead(scene: &Scene, ray: &Ray, reach: f32, density: f32) -> Vec3 {
    match scene.key_light.ahead(ray.origin, ray.direction) {
        Some(seen) if seen.distance < reach => {
            scene.key_light.radiance * balance(density, seen.density)
        }
        _ => Vec3::ZERO,
    }
}

/// The share of a direction that was found with the density `own` and might have been found with
/// `other` (Veach 1997, section 9.2.2, the balance heuristic).
fn balance(own: f32, other: f32) -> f32 {
    // Not of both at once, which could overflow.
    1.0 / (1.0 + other / own)
}

/// The way on from a surface.
struct Bounce {
    /// Unit length, world space.
    direction: Vec3,
    /// f cos θ over the density.
    weight: Vec3,
    /// With which the direction was chosen, sr⁻¹.
    density: f32,
}

/// A point where a path meets a surface.
struct Vertex<'a> {
    scatterer: Scatterer<'a>,
    point: SurfacePoint,
    /// Shading frame to world space.
    frame: Mat3,
    /// To where the path comes from.
    wo: Vec3,
}

/// A material at a point.
enum Scatterer<'a> {
    Matte(Vec3),
    Cloth(&'a Shader, Footprint),
}

impl<'a> Vertex<'a> {
    fn new(
        surface: &'a Surface,
        hit: &Hit,
        beam: &Beam,
        points: usize,
        sample: &mut Sample,
    ) -> Self {
        let wo_world = -beam.ray.direction;
        let point = facing_alike(&surface.mesh, hit, wo_world);
        let frame = point.frame();
        let scatterer = match &surface.material {
            Material::Matte(reflectance) => Scatterer::Matte(*reflectance),
            Material::Cloth { shader, is_open } => {
                let offsets = footprint::offsets(&point, beam, hit.t, points, sample.next_2d());
                let exists = |uv| !is_open || shader.opacity(uv) > 0.0;
                let footprint = Footprint::new(point.uv, offsets, exists);
                Scatterer::Cloth(shader, footprint)
            }
        };
        Self { scatterer, point, frame, wo: frame.transpose() * wo_world }
    }

    /// f without the cosine for light from `wi` in the shading frame, that was found with the density
    /// `found`: its share in what the light and [`Vertex::bounce`] find.
    fn scattering(&self, wi: Vec3, found: f32) -> Vec3 {
        match &self.scatterer {
            Scatterer::Matte(reflectance) => {
                reflectance * FRAC_1_PI * balance(found, wi.z.abs() * FRAC_1_PI)
            }
            Scatterer::Cloth(shader, footprint) => footprint.mean(|uv| {
                let f = shader.eval(uv, wi, self.wo);
                if f == Vec3::ZERO { f } else { f * balance(found, shader.pdf(uv, wi, self.wo)) }
            }),
        }
    }

    /// Whether a direction is on the side seen from `wo`, of the shading normal and the triangle.
    fn is_in_front(&self, wi: Vec3, wi_world: Vec3) -> bool {
        let side = self.wo.z.signum();
        side * wi.z > 0.0 && side * self.point.geometric_normal.dot(wi_world) > 0.0
    }

    /// Radiance that the key light makes leave towards `wo`.
    fn direct_light(&self, scene: &Scene, sample: &mut Sample) -> Vec3 {
        let square = sample.next_2d();
        let Some(light) = scene.key_light.sample(self.point.position, square) else {
            return Vec3::ZERO;
        };
        let wi = self.frame.transpose() * light.direction;
        if !self.is_in_front(wi, light.direction) {
            return Vec3::ZERO;
        }
        let ray = Ray { origin: self.leave(scene, light.direction), direction: light.direction };
        if scene.occluded(&ray, light.distance) {
            return Vec3::ZERO;
        }
        self.scattering(wi, light.density) * wi.z.abs() * light.irradiance
    }

    /// A way on.
    fn bounce(&self, sample: &mut Sample) -> Option<Bounce> {
        let (wi, weight, density) = match &self.scatterer {
            Scatterer::Matte(reflectance) => {
                let wi = square_to_cosine_hemisphere(sample.next_2d().as_dvec2()).as_vec3();
                (wi.with_z(wi.z * self.wo.z.signum()), *reflectance, wi.z * FRAC_1_PI)
            }
            Scatterer::Cloth(shader, footprint) => {
                // One point stands for all: its own density follows it more closely than theirs.
                let place = footprint.pick(sample.next_1d());
                let choice = sample.next_1d();
                let square = sample.next_2d();
                let drawn = shader.sample(place, self.wo, [choice, square.x, square.y])?;
                (drawn.wi, drawn.weight, drawn.pdf)
            }
        };
        let direction = (self.frame * wi).normalize();
        let goes_on = weight != Vec3::ZERO && self.is_in_front(wi, direction);
        goes_on.then_some(Bounce { direction, weight, density })
    }

    /// Where a ray in `direction` starts.
    fn leave(&self, scene: &Scene, direction: Vec3) -> Vec3 {
        scene.geometry().offset(self.point.position, self.point.geometric_normal, direction)
    }
}

/// The surface at `hit`. Where the shading normal says that `wo_world` looks at the other side than
/// the triangle does, as happens at silhouettes, the triangle is right.
fn facing_alike(mesh: &Mesh, hit: &Hit, wo_world: Vec3) -> SurfacePoint {
    let point = mesh.surface(hit.triangle, hit.barycentrics);
    if point.normal.dot(wo_world) * point.geometric_normal.dot(wo_world) > 0.0 {
        point
    } else {
        SurfacePoint { normal: point.geometric_normal, ..point }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use glam::Vec2;

    use super::*;
    use crate::{
        render::{Settings, film::Size, render},
        scene::{
            drape::{BuiltIn, CameraPlacement, DEFAULT_SIDE, RectangleLight},
            light::{AreaLight, Sky},
        },
    };

    const DARK: Sky = Sky { zenith: Vec3::ZERO, horizon: Vec3::ZERO };

    /// From above, with the picture's middle at the origin.
    const CAMERA: CameraPlacement = CameraPlacement {
        position: Vec3::new(0.0, 0.0, 3.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        horizontal_fov: 0.01,
    };

    /// A square of side 2 m, 1 m above the origin, that shines downwards.
    fn lamp(radiance: f32) -> AreaLight {
        let shape = RectangleLight { centre: Vec3::Z, half_u: Vec3::Y, half_v: Vec3::X };
        AreaLight { shape, radiance: Vec3::splat(radiance) }
    }

    fn square(centre: Vec3, half_side: f32, reflectance: f32) -> Surface {
        let corners = [Vec2::NEG_ONE, Vec2::new(1.0, -1.0), Vec2::ONE, Vec2::new(-1.0, 1.0)];
        let positions = corners.map(|corner| centre + (corner * half_side).extend(0.0));
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let mesh = Mesh::with_smooth_normals(positions.into(), corners.into(), triangles).unwrap();
        Surface { mesh, material: Material::Matte(Vec3::splat(reflectance)) }
    }

    /// The mean of a small picture.
    fn mean(scene: &Scene, spp: u32) -> f32 {
        let settings = Settings { size: Size::new(4, 4).unwrap(), spp, seed: 1 };
        let film = render(scene, &settings, || {});
        film.pixels().iter().sum::<Vec3>().x / film.pixels().len() as f32
    }

    #[test]
    fn white_scene_in_a_white_sky_is_white() {
        let built_in = BuiltIn::new(DEFAULT_SIDE).unwrap();
        let white = |mesh| Surface { mesh, material: Material::Matte(Vec3::ONE) };
        let surfaces = [built_in.cloth, built_in.floor, built_in.form].map(white).into();
        let sky = Sky { zenith: Vec3::ONE, horizon: Vec3::ONE };
        let scene = Scene::new(surfaces, built_in.camera, lamp(0.0), sky).unwrap();
        let settings = Settings { size: Size::new(60, 40).unwrap(), spp: 16, seed: 0 };
        let film = render(&scene, &settings, || {});
        let mean = film.pixels().iter().sum::<Vec3>() / film.pixels().len() as f32;
        assert!(mean.abs_diff_eq(Vec3::ONE, 0.002), "mean {mean}, expected 1");
        // What is lost in a pixel is what would have leaked through triangles.
        let dark = film.pixels().iter().filter(|pixel| pixel.x < 0.98).count();
        assert!(dark * 50 < film.pixels().len(), "{dark} pixels are below 0.98");
        let most = film.pixels().iter().map(|pixel| pixel.max_element()).fold(0.0, f32::max);
        assert!(most <= 1.0 + 1e-5, "{most}, expected at most 1");
    }

    #[test]
    fn floor_reflects_the_form_factor_of_the_lamp() {
        let scene =
            Scene::new(vec![square(Vec3::ZERO, 5.0, 0.5)], CAMERA, lamp(2.0), DARK).unwrap();
        // As in the test of the light itself: E/L = 4/√2 · atan(1/√2).
        let root = 2.0_f32.sqrt();
        let expected = 0.5 / PI * 2.0 * 4.0 / root * (1.0 / root).atan();
        let found = mean(&scene, 256);
        assert!((found - expected).abs() < 2e-3 * expected, "{found}, expected {expected}");
    }

    #[test]
    fn floor_reflects_the_cosine_mean_of_the_sky() {
        let sky = Sky { zenith: Vec3::splat(1.0), horizon: Vec3::splat(0.25) };
        let scene = Scene::new(vec![square(Vec3::ZERO, 5.0, 0.5)], CAMERA, lamp(0.0), sky).unwrap();
        // 1/π ∫ (h + (z − h) cos θ) cos θ dω = h + 2/3 (z − h).
        let expected = 0.5 * (0.25 + 0.75 * 2.0 / 3.0);
        let found = mean(&scene, 256);
        assert!((found - expected).abs() < 2e-3 * expected, "{found}, expected {expected}");
    }

    #[test]
    fn screen_between_lamp_and_floor_casts_its_shadow() {
        let mut camera = CAMERA;
        // From the side, below the screen.
        camera.position = Vec3::new(0.0, -2.0, 0.2);
        let surfaces =
            vec![square(Vec3::ZERO, 5.0, 0.5), square(Vec3::new(0.0, 0.0, 0.5), 3.0, 0.0)];
        let scene = Scene::new(surfaces, camera, lamp(2.0), DARK).unwrap();
        assert_eq!(mean(&scene, 16), 0.0);
    }

    #[test]
    fn light_does_not_pass_through_a_surface() {
        let scene =
            Scene::new(vec![square(Vec3::Z * 0.5, 5.0, 1.0)], CAMERA, lamp(2.0), DARK).unwrap();
        let below = Ray { origin: Vec3::ZERO, direction: Vec3::Z };
        let sampler = crate::render::sampler::PixelSampler::new([0, 0], 0);
        let below = Beam { ray: below, spread: 0.0 };
        assert_eq!(radiance(&scene, below, &mut sampler.sample(0)), Vec3::ZERO);
    }
}
