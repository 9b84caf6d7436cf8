//! Light that arrives along rays: unidirectional path tracing.
//!
//! At each surface lights are sampled, one of them is looked for behind what is in the way, and the
//! path goes on in a direction drawn by the cosine or, at cloth, nearly in proportion to what it
//! reflects. Lights are found both ways, and each counts as much as it is likely to find them (Veach 1997,
//! section 9.2.3), so that neither a narrow highlight nor a near light is noisy; but lights that are narrow themselves
//! are drawn alone where a surface is rough. Paths end by chance
//! (Russian roulette), which biases nothing, or at the scene's depth.
//!
//! Many paths go on side by side, from surface to surface, so that cloth is asked about many places at
//! once: that takes a fraction of the time of one place after the other. No path depends on its
//! neighbours.

mod choice;
mod cloth;
mod shaded;
mod vertex;

use glam::Vec3;

use self::vertex::Vertex;
use super::{
    exposure::Exposure,
    footprint::Beam,
    intersect::{Hit, Ray},
    sampler::{self, Sample},
    stages::Stage,
};
use crate::scene::Scene;

/// Surfaces that a path meets before it may end by chance. Ending after two instead of four gives
/// twice the noise on the floor and saves a tenth of the time.
const SURE_VERTICES: u32 = 4;

/// Numbers that a path most likely takes at a surface: for the footprint, the lights, the choice of one of them
/// and the way on.
const VERTEX: u32 = 10;

/// Numbers that it takes from the film through its first surface.
pub(super) const CAMERA_AND_VERTEX: u32 = 2 + VERTEX;

/// Spread of the beams between surfaces, in rad. A bounce goes anywhere and does not see single
/// threads; this blurs what it sees by a fifth of the distance.
const BOUNCE_SPREAD: f32 = 0.2;

/// Estimates of the light that arrives at the origins of `beams` along them, each with the numbers
/// that choose its path, and with `has_layers` of what is seen there.
///
/// Cloth is shaded as the mean over the [`Footprint`](super::footprint::Footprint) of the beam.
///
/// Unbiased but for what is scattered from one side of the shading normal to the other side of the
/// triangle: that is absorbed, since it would shine through.
pub fn expose(
    scene: &Scene,
    beams: impl IntoIterator<Item = (Beam, Sample)>,
    has_layers: bool,
) -> Vec<Exposure> {
    let start = |(index, (beam, sample))| Path {
        index,
        beam,
        sample,
        throughput: Vec3::ONE,
        diffuse_share: Vec3::ZERO,
        choice: None,
        promised: Vec3::ZERO,
    };
    let mut clock = scene.stages.clock();
    let mut paths: Vec<_> = beams.into_iter().enumerate().map(start).collect();
    clock.lap(Stage::Camera);
    let mut exposures = vec![Exposure::default(); paths.len()];
    let mut vertices = 1;
    while !paths.is_empty() {
        paths = advance(scene, paths, vertices, has_layers, &mut exposures);
        vertices += 1;
    }
    for exposure in exposures.iter_mut().filter(|exposure| exposure.first.is_some()) {
        exposure.specular = exposure.radiance - exposure.diffuse;
    }
    exposures
}

/// A path that has come to some surface, or to the camera.
struct Path {
    /// Of its exposure.
    index: usize,
    /// Along which it goes on.
    beam: Beam,
    sample: Sample,
    /// What it brings of the light that arrives along the beam.
    throughput: Vec3,
    /// Of that, by the diffuse lobe of the first surface.
    diffuse_share: Vec3,
    /// How the last surface chose the direction.
    choice: Option<Choice>,
    /// Radiance of the lights along the beam that has counted, since the last surface took it for granted.
    promised: Vec3,
}

/// How a surface chose a direction.
#[derive(Clone, Copy, Debug)]
struct Choice {
    /// Its density, sr⁻¹, by the times that the surface draws each light.
    density: f32,
    /// Whether the surface is so rough that it leaves [narrow](crate::scene::light::Light::is_narrow) lights to those
    /// who draw them.
    is_rough: bool,
}

/// Takes `paths` to the next surface, their vertex number `vertices`; returns those that go on from
/// there.
fn advance(
    scene: &Scene,
    mut paths: Vec<Path>,
    vertices: u32,
    has_layers: bool,
    exposures: &mut [Exposure],
) -> Vec<Path> {
    let mut clock = scene.stages.clock();
    let is_first = vertices == 1;
    let has_layers = has_layers && is_first;
    let Ahead { hits, lights } = Ahead::new(scene, &paths, vertices > scene.depth);
    for (path, light) in paths.iter().zip(lights) {
        let exposure = &mut exposures[path.index];
        exposure.radiance += path.throughput * (light - path.promised);
        exposure.diffuse += path.throughput * light * path.diffuse_share;
    }
    clock.lap(if is_first { Stage::FirstHit } else { Stage::NextHit });

    sampler::prepare(paths.iter_mut().map(|path| &mut path.sample), VERTEX);
    let mut met = Vec::with_capacity(paths.len());
    let mut hits = hits.into_iter();
    paths.retain_mut(|path| {
        let Some(hit) = hits.next().flatten() else { return false };
        met.push(Vertex::new(scene, hit, &path.beam, &mut path.sample));
        true
    });
    let [near, far] = vertex::shades(&met);
    scene.shades.add(near, far);
    clock.lap(Stage::Surface);

    let samples = paths.iter_mut().map(|path| &mut path.sample);
    let lit = vertex::lights(&met, samples, scene);
    clock.lap(Stage::Light);
    let lobes = vertex::scattering(&mut met, &lit, scene);
    clock.lap(Stage::Scattering);
    let mut chosen = Vec::with_capacity(paths.len());
    let mut rest = lobes.as_slice();
    for lit in lit.chunk_by(|a, b| a.vertex == b.vertex) {
        let (lobes, others) = rest.split_at(lit.len());
        rest = others;
        chosen.extend(choice::choose(lit, lobes, paths[lit[0].vertex].sample.next_1d()));
    }
    // Rays to one light go similar ways.
    chosen.sort_by_key(|(lit, _)| lit.light);
    let shadows: Vec<_> =
        chosen.iter().map(|(lit, _)| met[lit.vertex].shadow(scene, lit)).collect();
    for ((lit, lobes), is_shadowed) in chosen.into_iter().zip(scene.occluded_all(&shadows)) {
        if is_shadowed {
            continue;
        }
        let path = &paths[lit.vertex];
        let share = if is_first { lobes.diffuse_share() } else { path.diffuse_share };
        let exposure = &mut exposures[path.index];
        let light = path.throughput * (lobes.diffuse + lobes.other);
        exposure.radiance += light;
        exposure.diffuse += light * share;
    }
    clock.lap(Stage::Shadow);
    if has_layers {
        for (path, vertex) in paths.iter().zip(&met) {
            exposures[path.index].first = Some(vertex.seen());
        }
    }

    let samples = paths.iter_mut().map(|path| &mut path.sample);
    let bounces = vertex::bounces(&met, samples, scene, has_layers);
    let mut ways = met.iter().zip(bounces);
    paths.retain_mut(|path| {
        let Some((vertex, Some(bounce))) = ways.next() else { return false };
        if is_first {
            path.diffuse_share = bounce.diffuse_share;
        }
        exposures[path.index].radiance += path.throughput * bounce.all_promised;
        path.promised = bounce.promised;
        path.throughput *= bounce.weight;
        path.choice = Some(vertex.choice(scene, bounce.density));
        if vertices >= SURE_VERTICES {
            let survival = path.throughput.max_element().min(1.0);
            if path.sample.next_1d() >= survival {
                return false;
            }
            path.throughput /= survival;
        }
        let direction = bounce.direction;
        let origin = vertex.leave(scene, direction);
        path.beam = Beam { ray: Ray { origin, direction }, spread: BOUNCE_SPREAD, bundle: None };
        true
    });
    clock.lap(Stage::Bounce);
    paths
}

/// What the rays of paths meet.
struct Ahead {
    /// The surface from which each path may go on.
    hits: Vec<Option<Hit>>,
    /// Radiance of the lights along each ray, as [`lights_ahead`] weighs it.
    lights: Vec<Vec3>,
}

impl Ahead {
    /// `is_last` if no path goes on: then nobody asks which surface it is, but where there is a light
    /// ahead, and tests whether there is any surface before it take half the time.
    fn new(scene: &Scene, paths: &[Path], is_last: bool) -> Self {
        let found: Vec<_> = paths
            .iter()
            .enumerate()
            .flat_map(|(index, path)| {
                let lights = lights_ahead(scene, &path.beam.ray, path.choice);
                lights.map(move |(distance, light)| (index, distance, light))
            })
            .collect();
        let (hits, is_hidden): (_, Vec<_>) = if is_last {
            let segments: Vec<_> = found
                .iter()
                .map(|&(index, distance, _)| (paths[index].beam.ray, distance))
                .collect();
            (vec![None; paths.len()], scene.occluded_all(&segments))
        } else {
            let rays: Vec<_> = paths.iter().map(|path| path.beam.ray).collect();
            let hits = scene.intersect_all(&rays);
            // A light beyond nothing at all is seen, though rounding may put a far lamp there.
            let is_hidden = |&(index, distance, _): &(usize, f32, Vec3)| {
                hits[index].is_some_and(|hit| distance >= hit.t)
            };
            let is_hidden = found.iter().map(is_hidden).collect();
            (hits, is_hidden)
        };
        let mut lights = vec![Vec3::ZERO; paths.len()];
        for ((index, _, light), is_hidden) in found.into_iter().zip(is_hidden) {
            if !is_hidden {
                lights[index] += light;
            }
        }
        Self { hits, lights }
    }
}

/// Lights along a ray: their distances, and of their radiance the share of this way to find them in what both find,
/// given its `choice`. A ray of the camera, without one, sees all that is infinitely far, and no lamps.
fn lights_ahead(
    scene: &Scene,
    ray: &Ray,
    choice: Option<Choice>,
) -> impl Iterator<Item = (f32, Vec3)> {
    let lights = scene.lights.as_slice().iter().enumerate();
    let skips_narrow = scene.estimator == Estimator::Both && choice.is_some_and(|c| c.is_rough);
    lights.filter_map(move |(index, light)| {
        // One that is too weak to be drawn ever is found along rays alone.
        if skips_narrow && light.is_narrow() && scene.lights.expected(index) > 0.0 {
            return None;
        }
        let found = light.ahead(ray.origin, ray.direction)?;
        let Some(Choice { density, .. }) = choice else {
            return (found.distance == f32::INFINITY).then_some((found.distance, found.radiance));
        };
        let other = found.density * scene.lights.expected(index);
        let weight = match scene.estimator {
            Estimator::Both => balance(density, other),
            Estimator::Directions => 1.0,
            Estimator::Lights => f32::from(u8::from(other == 0.0)),
        };
        (weight > 0.0).then_some((found.distance, found.radiance * weight))
    })
}

/// How the lights are found that light surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// By drawing some of them and by following bounces, each as much as it is likely to find them.
    #[default]
    Both,
    /// By drawing some of them; those that cannot be drawn by following bounces.
    Lights,
    /// By following bounces, which never find a light that comes from a single direction.
    Directions,
}

/// The share of a direction that was found with the density `own` and might have been found with
/// `other`.
///
/// By the squares of both (Veach 1997, section 9.2.3, the power heuristic): where a lamp is small, drawing
/// directions to it leaves almost no noise, and the few paths that run into it would bring most of it if they
/// counted in proportion to their density: on cloth over a ball a quarter to a third of all variance.
#[inline(always)]
fn balance(own: f32, other: f32) -> f32 {
    // Not of both at once, which could overflow.
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests;
