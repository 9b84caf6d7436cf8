//! Light that arrives along a ray: unidirectional path tracing.
//!
//! At each surface one light is sampled and the path goes on in a direction drawn by the cosine or,
//! at cloth, nearly in proportion to what it reflects. Lights are found both ways, and each counts
//! as much as it is likely to find them (Veach 1997, section 9.2.2), so that neither a narrow
//! highlight nor a near light is noisy. Paths end by chance (Russian roulette), which biases
//! nothing, or at the scene's depth.

use std::f32::consts::FRAC_1_PI;

use glam::{DVec2, Mat3, Vec3};
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::Shader;

use super::{
    exposure::{Exposure, FirstHit, YarnSeen},
    footprint::{self, Beam, Footprint},
    intersect::{Hit, Ray},
    sampler::Sample,
};
use crate::scene::{
    Material, Scene, Surface,
    mesh::{Mesh, SurfacePoint},
    standard::StandardPoint,
};

/// Surfaces that a path meets before it may end by chance. Ending after two instead of four gives
/// twice the noise on the floor and saves a tenth of the time.
const SURE_VERTICES: u32 = 4;

/// Points at which cloth is shaded for each ray, where the camera sees it and where light bounces.
const CAMERA_POINTS: usize = 4;
const BOUNCE_POINTS: usize = 4;

/// Spread of the beams between surfaces, in rad. A bounce goes anywhere and does not see single
/// threads; this blurs what it sees by a fifth of the distance.
const BOUNCE_SPREAD: f32 = 0.2;

/// An estimate of the light that arrives at the beam's origin along it, and with `has_layers` of
/// what is seen there.
///
/// Cloth is shaded as the mean over the [`Footprint`] of the beam.
///
/// Unbiased but for what is scattered from one side of the shading normal to the other side of the
/// triangle: that is absorbed, since it would shine through.
pub fn expose(scene: &Scene, mut beam: Beam, sample: &mut Sample, has_layers: bool) -> Exposure {
    let mut exposure = Exposure::default();
    let mut throughput = Vec3::ONE;
    // Of the light that the first surface scatters, by its diffuse lobe.
    let mut diffuse_share = Vec3::ZERO;
    // With which the last surface chose the direction.
    let mut density = None;
    for vertices in 1.. {
        let ahead = Ahead::new(scene, &beam.ray, vertices > scene.depth);
        let mut arriving = throughput * lights_ahead(scene, &beam.ray, &ahead, density);
        let mut arriving_diffuse = diffuse_share * arriving;
        let vertex = ahead.nearest().map(|hit| {
            let points = if vertices == 1 { CAMERA_POINTS } else { BOUNCE_POINTS };
            let vertex = Vertex::new(scene.surface(&hit), &hit, &beam, points, sample);
            let lobes = vertex.direct_light(scene, sample).map(|light| throughput * light);
            arriving += lobes.diffuse + lobes.other;
            let is_first = vertices == 1;
            arriving_diffuse += if is_first {
                lobes.diffuse
            } else {
                diffuse_share * (lobes.diffuse + lobes.other)
            };
            if is_first && has_layers {
                exposure.first = Some(vertex.seen(&hit));
            }
            vertex
        });
        exposure.radiance += arriving;
        exposure.diffuse += arriving_diffuse;
        if exposure.first.is_some() {
            exposure.specular = exposure.radiance - exposure.diffuse;
        }

        let Some(vertex) = vertex else { break };
        let Some(bounce) = vertex.bounce(sample, vertices == 1 && has_layers) else { break };
        if vertices == 1 {
            diffuse_share = bounce.diffuse_share;
        }
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
    exposure
}

/// What a ray meets.
enum Ahead<'a> {
    /// The nearest surface, if there is one.
    Nearest(Option<Hit>),
    /// Nobody asks which: it is the last ray of a path. Tests whether there is any take half the time.
    Any(&'a Scene, &'a Ray),
}

impl<'a> Ahead<'a> {
    fn new(scene: &'a Scene, ray: &'a Ray, is_last: bool) -> Self {
        if is_last { Self::Any(scene, ray) } else { Self::Nearest(scene.intersect(ray)) }
    }

    /// The surface from which the path may go on.
    fn nearest(&self) -> Option<Hit> {
        match self {
            Self::Nearest(hit) => *hit,
            Self::Any(..) => None,
        }
    }

    /// Whether a light at `distance` is seen. One beyond nothing at all is, though rounding may put a
    /// far lamp there.
    fn is_clear(&self, distance: f32) -> bool {
        match self {
            Self::Nearest(hit) => hit.is_none_or(|hit| distance < hit.t),
            Self::Any(scene, ray) => !scene.occluded(ray, distance),
        }
    }
}

/// Radiance of the lights along a ray that meets what is `ahead`, which was chosen with
/// `density`, sr⁻¹: the share of this way to find them in what both find. A ray of the camera, without
/// a density, sees all that is infinitely far, and no lamps.
fn lights_ahead(scene: &Scene, ray: &Ray, ahead: &Ahead<'_>, density: Option<f32>) -> Vec3 {
    let lights = scene.lights.as_slice().iter().enumerate();
    let seen = lights.filter_map(|(index, light)| {
        let found = light.ahead(ray.origin, ray.direction)?;
        let Some(density) = density else {
            return (found.distance == f32::INFINITY && ahead.is_clear(found.distance))
                .then_some(found.radiance);
        };
        let other = found.density * scene.lights.probability(index);
        let weight = match scene.estimator {
            Estimator::Both => balance(density, other),
            Estimator::Directions => 1.0,
            Estimator::Lights => f32::from(u8::from(other == 0.0)),
        };
        (weight > 0.0 && ahead.is_clear(found.distance)).then(|| found.radiance * weight)
    });
    seen.sum()
}

/// How the lights are found that light surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// By drawing one of them and by following bounces, each as much as it is likely to find them.
    #[default]
    Both,
    /// By drawing one of them; those that cannot be drawn by following bounces.
    Lights,
    /// By following bounces, which never find a light that comes from a single direction.
    Directions,
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
    /// Of the weight, by the diffuse lobe; 0 if nobody asked.
    diffuse_share: Vec3,
}

/// Something of each lobe of a surface.
#[derive(Clone, Copy, Debug, Default)]
struct Lobes {
    diffuse: Vec3,
    other: Vec3,
}

impl Lobes {
    fn map(self, of: impl Fn(Vec3) -> Vec3) -> Self {
        Self { diffuse: of(self.diffuse), other: of(self.other) }
    }

    fn plus(self, other: Self) -> Self {
        Self { diffuse: self.diffuse + other.diffuse, other: self.other + other.other }
    }

    /// The share of the diffuse lobe in each component.
    fn diffuse_share(self) -> Vec3 {
        let all = self.diffuse + self.other;
        Vec3::select(all.cmpgt(Vec3::ZERO), self.diffuse / all, Vec3::ZERO)
    }
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
    Standard(StandardPoint),
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
            Material::Standard { standard, size } => {
                // Of even width, with the beam's deviation.
                let width = 12.0_f32.sqrt();
                let axes = footprint::axes(&point, beam, hit.t);
                let footprint = axes.map(|axis| axis * width / *size);
                Scatterer::Standard(standard.at(point.uv / *size, footprint))
            }
        };
        Self { scatterer, point, frame, wo: frame.transpose() * wo_world }
    }

    /// f without the cosine for light from `wi` in the shading frame, that was found with the density
    /// `found`: its share in what the light and [`Vertex::bounce`] find, as `estimator` has it.
    fn scattering(&self, wi: Vec3, found: f32, estimator: Estimator) -> Lobes {
        let balance = |found, pdf| match estimator {
            Estimator::Both => balance(found, pdf),
            Estimator::Lights | Estimator::Directions => 1.0,
        };
        match &self.scatterer {
            Scatterer::Matte(reflectance) => Lobes {
                diffuse: reflectance * FRAC_1_PI * balance(found, wi.z.abs() * FRAC_1_PI),
                other: Vec3::ZERO,
            },
            Scatterer::Cloth(shader, footprint) => {
                let places = footprint.places();
                let at = |place: &DVec2| {
                    let f = shader.eval_lobes(*place, wi, self.wo);
                    let lobes = Lobes { diffuse: f.diffuse, other: f.specular };
                    if f.diffuse == Vec3::ZERO && f.specular == Vec3::ZERO {
                        return lobes;
                    }
                    let weight = balance(found, shader.pdf(*place, wi, self.wo));
                    lobes.map(|lobe| lobe * weight)
                };
                let sum = places.iter().map(at).fold(Lobes::default(), Lobes::plus);
                sum.map(|lobe| lobe / places.len() as f32)
            }
            Scatterer::Standard(point) => {
                let [diffuse, other] = point.eval_lobes(wi, self.wo);
                let weight = balance(found, point.pdf(wi, self.wo));
                Lobes { diffuse, other }.map(|lobe| lobe * weight)
            }
        }
    }

    /// Whether a direction is on the side seen from `wo`, of the shading normal and the triangle.
    fn is_in_front(&self, wi: Vec3, wi_world: Vec3) -> bool {
        let side = self.wo.z.signum();
        side * wi.z > 0.0 && side * self.point.geometric_normal.dot(wi_world) > 0.0
    }

    /// Radiance that one light, drawn at random, makes leave towards `wo`.
    fn direct_light(&self, scene: &Scene, sample: &mut Sample) -> Lobes {
        let choice = sample.next_1d();
        let square = sample.next_2d();
        let chosen = scene.lights.choose(choice);
        let chosen = chosen.filter(|_| scene.estimator != Estimator::Directions);
        let Some((index, probability)) = chosen else { return Lobes::default() };
        let light = &scene.lights.as_slice()[index];
        let Some(light) = light.sample(self.point.position, square) else {
            return Lobes::default();
        };
        let wi = self.frame.transpose() * light.direction;
        if !self.is_in_front(wi, light.direction) {
            return Lobes::default();
        }
        let lobes = self.scattering(wi, light.density * probability, scene.estimator);
        // The shadow is dearer than the surface, and where that is dark there is none.
        if lobes.diffuse == Vec3::ZERO && lobes.other == Vec3::ZERO {
            return lobes;
        }
        let ray = Ray { origin: self.leave(scene, light.direction), direction: light.direction };
        if scene.occluded(&ray, light.distance) {
            return Lobes::default();
        }
        lobes.map(|lobe| lobe * wi.z.abs() * light.irradiance / probability)
    }

    /// A way on; with the share of the diffuse lobe in it if `has_share`.
    fn bounce(&self, sample: &mut Sample, has_share: bool) -> Option<Bounce> {
        let (wi, weight, density, diffuse_share) = match &self.scatterer {
            Scatterer::Matte(reflectance) => {
                let wi = square_to_cosine_hemisphere(sample.next_2d().as_dvec2()).as_vec3();
                let density = wi.z * FRAC_1_PI;
                (wi.with_z(wi.z * self.wo.z.signum()), *reflectance, density, Vec3::ONE)
            }
            Scatterer::Cloth(shader, footprint) => {
                // One point stands for all: its own density follows it more closely than theirs.
                let place = footprint.pick(sample.next_1d());
                let choice = sample.next_1d();
                let square = sample.next_2d();
                let drawn = shader.sample(place, self.wo, [choice, square.x, square.y])?;
                let share = if has_share {
                    let f = shader.eval_lobes(place, drawn.wi, self.wo);
                    Lobes { diffuse: f.diffuse, other: f.specular }.diffuse_share()
                } else {
                    Vec3::ZERO
                };
                (drawn.wi, drawn.weight, drawn.pdf, share)
            }
            Scatterer::Standard(point) => {
                let choice = sample.next_1d();
                let square = sample.next_2d();
                let drawn = point.sample(self.wo, [choice, square.x, square.y])?;
                let [diffuse, other] = point.eval_lobes(drawn.wi, self.wo);
                let share = Lobes { diffuse, other }.diffuse_share();
                (drawn.wi, drawn.weight, drawn.pdf, share)
            }
        };
        let direction = (self.frame * wi).normalize();
        let goes_on = weight != Vec3::ZERO && self.is_in_front(wi, direction);
        goes_on.then_some(Bounce { direction, weight, density, diffuse_share })
    }

    /// What shows here.
    fn seen(&self, hit: &Hit) -> FirstHit {
        let side = self.wo.z.signum();
        let (albedo, tangent, yarn) = match &self.scatterer {
            Scatterer::Matte(reflectance) => (*reflectance, self.frame.x_axis, None),
            Scatterer::Cloth(shader, footprint) => {
                let places = footprint.places();
                let albedo: Vec3 = places.iter().map(|&place| shader.albedo(place, self.wo)).sum();
                let yarn = shader.yarn_at(places[0]);
                let tangent = yarn.map_or(Vec3::X, |yarn| yarn.tangent.as_vec3());
                let yarn = yarn.map(|yarn| YarnSeen {
                    id: (yarn.segment.line as u32) << 1 | u32::from(yarn.segment.is_warp),
                    kind: yarn.yarn,
                });
                (albedo / places.len() as f32, (self.frame * tangent).normalize(), yarn)
            }
            Scatterer::Standard(point) => (point.albedo(self.wo), self.frame.x_axis, None),
        };
        FirstHit {
            albedo,
            normal: self.frame.z_axis * side,
            tangent,
            distance: hit.t,
            uv: self.point.uv,
            yarn,
        }
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
        render::{View, film::Size, plain},
        scene::{
            MAX_DEPTH,
            drape::{BuiltIn, CameraPlacement, DEFAULT_SIDE, RectangleLight},
            light::{Light, Quad, Sky},
        },
    };

    /// From above, with the picture's middle at the origin.
    const CAMERA: CameraPlacement = CameraPlacement {
        position: Vec3::new(0.0, 0.0, 3.0),
        target: Vec3::ZERO,
        up: Vec3::Y,
        horizontal_fov: 0.01,
    };

    /// A square of side 2 m, 1 m above the origin, that shines downwards.
    fn lamp(radiance: f32) -> Light {
        let shape = RectangleLight { centre: Vec3::Z, half_u: Vec3::Y, half_v: Vec3::X };
        Light::Quad(Quad::new(shape, Vec3::splat(radiance)))
    }

    fn scene(surfaces: Vec<Surface>, camera: CameraPlacement, lights: Vec<Light>) -> Scene {
        Scene::new(surfaces, camera, lights, MAX_DEPTH).unwrap()
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
        let size = Size::new(4, 4).unwrap();
        let film = plain(&View::new(scene, size, 1, false), size, spp);
        film.pixels().iter().sum::<Vec3>().x / film.pixels().len() as f32
    }

    #[test]
    fn white_scene_in_a_white_sky_is_white() {
        let built_in = BuiltIn::new(DEFAULT_SIDE).unwrap();
        let white = |mesh| Surface { mesh, material: Material::Matte(Vec3::ONE) };
        let surfaces = [built_in.cloth, built_in.floor, built_in.form].map(white).into();
        let sky = Sky { zenith: Vec3::ONE, horizon: Vec3::ONE };
        let scene = scene(surfaces, built_in.camera, vec![Light::Sky(sky)]);
        let size = Size::new(60, 40).unwrap();
        let film = plain(&View::new(&scene, size, 0, false), size, 16);
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
        let scene = scene(vec![square(Vec3::ZERO, 5.0, 0.5)], CAMERA, vec![lamp(2.0)]);
        // As in the test of the light itself: E/L = 4/√2 · atan(1/√2).
        let root = 2.0_f32.sqrt();
        let expected = 0.5 / PI * 2.0 * 4.0 / root * (1.0 / root).atan();
        let found = mean(&scene, 256);
        assert!((found - expected).abs() < 2e-3 * expected, "{found}, expected {expected}");
    }

    #[test]
    fn floor_reflects_the_cosine_mean_of_the_sky() {
        let sky = Sky { zenith: Vec3::splat(1.0), horizon: Vec3::splat(0.25) };
        let scene = scene(vec![square(Vec3::ZERO, 5.0, 0.5)], CAMERA, vec![Light::Sky(sky)]);
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
        let scene = scene(surfaces, camera, vec![lamp(2.0)]);
        assert_eq!(mean(&scene, 16), 0.0);
    }

    #[test]
    fn light_does_not_pass_through_a_surface() {
        let scene = scene(vec![square(Vec3::Z * 0.5, 5.0, 1.0)], CAMERA, vec![lamp(2.0)]);
        let below = Ray { origin: Vec3::ZERO, direction: Vec3::Z };
        let sampler = crate::render::sampler::PixelSampler::new([0, 0], 0);
        let below = Beam { ray: below, spread: 0.0 };
        let exposure = expose(&scene, below, &mut sampler.sample(0), false);
        assert_eq!(exposure.radiance, Vec3::ZERO);
    }
}
