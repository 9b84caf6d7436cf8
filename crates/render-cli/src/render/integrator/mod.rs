//! Light that arrives along rays: unidirectional path tracing.
//!
//! At each surface every light is sampled, one of them is looked for behind what is in the way, and the
//! path goes on in a direction drawn by the cosine or, at cloth, nearly in proportion to what it
//! reflects. Lights are found both ways, and each counts as much as it is likely to find them (Veach 1997,
//! section 9.2.2), so that neither a narrow highlight nor a near light is noisy. Paths end by chance (Russian roulette), which biases
//! nothing, or at the scene's depth.
//!
//! Many paths go on side by side, from surface to surface, so that cloth is asked about many places at
//! once: that takes a fraction of the time of one place after the other. No path depends on its
//! neighbours.

mod cloth;
mod vertex;

use glam::Vec3;

use self::vertex::{Lit, Lobes, Vertex};
use super::{
    exposure::Exposure,
    footprint::Beam,
    intersect::{Hit, Ray},
    sampler::Sample,
};
use crate::scene::Scene;

/// Surfaces that a path meets before it may end by chance. Ending after two instead of four gives
/// twice the noise on the floor and saves a tenth of the time.
const SURE_VERTICES: u32 = 4;

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
        density: None,
    };
    let mut paths: Vec<_> = beams.into_iter().enumerate().map(start).collect();
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
    /// With which the last surface chose the direction, sr⁻¹.
    density: Option<f32>,
}

/// Takes `paths` to the next surface, their vertex number `vertices`; returns those that go on from
/// there.
fn advance(
    scene: &Scene,
    paths: Vec<Path>,
    vertices: u32,
    has_layers: bool,
    exposures: &mut [Exposure],
) -> Vec<Path> {
    let is_first = vertices == 1;
    let has_layers = has_layers && is_first;
    let mut add = |path: &Path, light: Vec3, diffuse_share: Vec3| {
        exposures[path.index].radiance += path.throughput * light;
        exposures[path.index].diffuse += path.throughput * light * diffuse_share;
    };

    let (mut arrived, mut met) = (Vec::with_capacity(paths.len()), Vec::with_capacity(paths.len()));
    for mut path in paths {
        let ahead = Ahead::new(scene, &path.beam.ray, vertices > scene.depth);
        let light = lights_ahead(scene, &path.beam.ray, &ahead, path.density);
        add(&path, light, path.diffuse_share);
        if let Some(hit) = ahead.nearest() {
            met.push(Vertex::new(scene, hit, &path.beam, &mut path.sample));
            arrived.push(path);
        }
    }

    vertex::close_gaps(&mut met);
    let [near, far] = vertex::shades(&met);
    scene.shades.add(near, far);

    let samples = arrived.iter_mut().map(|path| &mut path.sample);
    let lit = vertex::lights(&met, samples, scene);
    let lobes = vertex::scattering(&met, &lit, scene);
    let mut rest = lobes.as_slice();
    for lit in lit.chunk_by(|a, b| a.vertex == b.vertex) {
        let (lobes, others) = rest.split_at(lit.len());
        rest = others;
        let (path, vertex) = (&mut arrived[lit[0].vertex], &met[lit[0].vertex]);
        let Some((lit, lobes)) = choose(lit, lobes, path.sample.next_1d()) else { continue };
        // The shadow is dearer than the surface, and where that is dark there is none.
        if vertex.is_shadowed(scene, lit) {
            continue;
        }
        let share = if is_first { lobes.diffuse_share() } else { path.diffuse_share };
        add(path, lobes.diffuse + lobes.other, share);
    }
    if has_layers {
        for (path, vertex) in arrived.iter().zip(&met) {
            exposures[path.index].first = Some(vertex.seen());
        }
    }

    let samples = arrived.iter_mut().map(|path| &mut path.sample);
    let bounces = vertex::bounces(&met, samples, scene.tier, has_layers);
    let on =
        arrived.into_iter().zip(&met).zip(bounces).filter_map(|((mut path, vertex), bounce)| {
            let bounce = bounce?;
            if is_first {
                path.diffuse_share = bounce.diffuse_share;
            }
            path.throughput *= bounce.weight;
            path.density = Some(bounce.density);
            if vertices >= SURE_VERTICES {
                let survival = path.throughput.max_element().min(1.0);
                if path.sample.next_1d() >= survival {
                    return None;
                }
                path.throughput /= survival;
            }
            let direction = bounce.direction;
            let origin = vertex.leave(scene, direction);
            path.beam = Beam { ray: Ray { origin, direction }, spread: BOUNCE_SPREAD };
            Some(path)
        });
    on.collect()
}

/// The share of the choice among lights that is even, whatever they bring: where the one that brings most
/// is in the shadow, another one has to be looked at. Of six equal lights in sight, a tenth of it would take
/// 6 % off the noise; none at all makes a shadow that a faint light fills ten times as noisy.
const EVEN: f32 = 0.25;

/// One of the lights `lit` of a vertex, chosen by `xi` in [0, 1) mostly in proportion to what it brings if
/// nothing is in its way, and what stands for all of them if so, given f of each. `None` if none brings
/// anything.
///
/// The choice is what a sum of all lights costs that looks for one of them alone (Talbot, Cline & Egbert
/// 2005).
fn choose<'a>(lit: &'a [Lit], f: &[Lobes], xi: f32) -> Option<(&'a Lit, Lobes)> {
    let brought = || lit.iter().zip(f).map(|(lit, lobes)| lobes.scaled(lit.weight));
    let weight = |lobes: Lobes| (lobes.diffuse + lobes.other).element_sum().min(HUGE);
    let (sum, count) = brought()
        .map(weight)
        .filter(|&weight| weight > 0.0)
        .fold((0.0, 0), |(sum, count), weight| (sum + weight, count + 1));
    let mut rest = xi;
    let mut chosen = None;
    for (lit, lobes) in lit.iter().zip(brought()) {
        let weight = weight(lobes);
        if weight > 0.0 {
            let probability = (1.0 - EVEN) * (weight / sum) + EVEN / count as f32;
            chosen = Some((lit, lobes.scaled(Vec3::splat(1.0 / probability))));
            rest -= probability;
            if rest < 0.0 {
                break;
            }
        }
    }
    chosen
}

/// What weighs more is as good as this: the sum of a few is a number.
const HUGE: f32 = 1e37;

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
        let other = found.density * scene.lights.expected(index);
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

#[cfg(test)]
mod tests;
