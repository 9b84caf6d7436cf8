//! The way on from a surface.

use std::{array, f32::consts::FRAC_1_PI, iter};

use glam::{DVec2, Vec3};
use selvedge_normalize::warp::square_to_cosine_hemisphere;

use super::{ClothPoints, Drawing, Lobes, MOST_DIRECTIONS, Scatterer, Vertex};
use crate::{
    render::{
        integrator::{
            choice::{pick, weight},
            lights_ahead,
        },
        intersect::Ray,
        sampler::Sample,
    },
    scene::Scene,
};

/// The way on from a surface.
pub(in super::super) struct Bounce {
    /// Unit length, world space.
    pub(in super::super) direction: Vec3,
    /// f cos θ over the density.
    pub(in super::super) weight: Vec3,
    /// With which the direction was chosen, sr⁻¹.
    pub(in super::super) density: f32,
    /// Of the weight, by the diffuse lobe; 0 if nobody asked.
    pub(in super::super) diffuse_share: Vec3,
    /// Radiance along the direction of lights, if nothing is in their way.
    pub(in super::super) promised: Vec3,
    /// What all directions that were drawn bring if they keep what they promise, the one that is followed among them.
    pub(in super::super) all_promised: Vec3,
}

/// Steps between the numbers by which directions are drawn: those of the generalised golden ratio,
/// by which few points are spread evenly in three dimensions (Roberts 2018).
const STEPS: Vec3 = Vec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5);

/// The light from surfaces, which nobody knows before a ray has met them, as a share of the mean light that is
/// expected along all directions that were drawn.
const FROM_SURFACES: f32 = 0.25;

/// One of the directions that a vertex has drawn.
struct Candidate {
    /// Of the vertex.
    vertex: usize,
    /// Where it was drawn, uv in metres.
    place: DVec2,
    /// Unit, in the shading frame.
    wi: Vec3,
    /// As if it were the only one.
    bounce: Bounce,
}

impl Vertex<'_> {
    /// The way on in the direction `wi`, if that is in front.
    fn way_on(&self, wi: Vec3, weight: Vec3, density: f32, diffuse_share: Vec3) -> Option<Bounce> {
        let direction = (self.frame * wi).normalize();
        let goes_on = self.is_in_front(wi, direction);
        let promised = Vec3::ZERO;
        let all_promised = promised;
        let bounce = Bounce { direction, weight, density, diffuse_share, promised, all_promised };
        goes_on.then_some(bounce)
    }
}

/// A way on from each vertex, chosen by the numbers of its path; with the share of the diffuse lobe in
/// it if `has_share`.
///
/// Cloth draws as many directions as [`Drawing`] has it, and one of them is followed, most likely the one that brings most
/// if nothing is in its way. What all of them would bring then counts at once, and of what the path finds, what differs.
pub(in super::super) fn bounces<'a>(
    vertices: &[Vertex<'_>],
    samples: impl Iterator<Item = &'a mut Sample>,
    scene: &Scene,
    has_share: bool,
) -> Vec<Option<Bounce>> {
    let mut draws = ClothPoints::new(vertices.len() * Drawing::directions(scene));
    let mut choices = vec![0.0; vertices.len()];
    let mut bounces: Vec<_> = vertices
        .iter()
        .zip(samples)
        .enumerate()
        .map(|(index, (vertex, sample))| match &vertex.scatterer {
            Scatterer::Matte(reflectance) => {
                let wi = square_to_cosine_hemisphere(sample.next_2d().as_dvec2()).as_vec3();
                let density = wi.z * FRAC_1_PI;
                let wi = wi.with_z(wi.z * vertex.wo.z.signum());
                vertex.way_on(wi, *reflectance, density, Vec3::ONE)
            }
            Scatterer::Cloth(shader, footprint) => {
                let turned = sample.next_1d() * footprint.count() as f32;
                // Uniform whichever the first place is.
                choices[index] = turned.fract();
                let places = Drawing::of(scene, footprint).places(footprint, turned as usize);
                let mut numbers = Vec3::from_array(sample.next_3d());
                for (k, place) in places.enumerate() {
                    let of = index * MOST_DIRECTIONS + k;
                    draws.push(of, shader, iter::once(place), [numbers, vertex.wo]);
                    numbers = (numbers + STEPS).fract();
                }
                None
            }
            Scatterer::FarCloth(shader, footprint, cover) => {
                let choice = sample.next_1d();
                let square = sample.next_2d();
                let numbers = [choice, square.x, square.y];
                let drawn = shader.far_sample(footprint, vertex.wo, numbers)?;
                let share = if has_share {
                    let f = shader.far_eval_lobes(footprint, drawn.wi, vertex.wo);
                    Lobes { diffuse: f.diffuse, other: f.specular }.diffuse_share()
                } else {
                    Vec3::ZERO
                };
                vertex.way_on(drawn.wi, drawn.weight / *cover, drawn.pdf, share)
            }
            Scatterer::Standard(point) => {
                let choice = sample.next_1d();
                let square = sample.next_2d();
                let drawn = point.sample(vertex.wo, [choice, square.x, square.y])?;
                let [diffuse, other] = point.eval_lobes(drawn.wi, vertex.wo);
                let share = Lobes { diffuse, other }.diffuse_share();
                vertex.way_on(drawn.wi, drawn.weight, drawn.pdf, share)
            }
        })
        .collect();
    for own in candidates(vertices, &draws, scene).chunk_by(|a, b| a.vertex == b.vertex) {
        let index = own[0].vertex;
        bounces[index] = follow(&vertices[index], own, choices[index], scene, has_share);
    }
    for bounce in &mut bounces {
        bounce.take_if(|bounce| bounce.weight == Vec3::ZERO);
    }
    bounces
}

/// The directions of `draws`, whose numbers are those of vertices times [`MOST_DIRECTIONS`], and of their directions.
fn candidates(vertices: &[Vertex<'_>], draws: &ClothPoints<'_>, scene: &Scene) -> Vec<Candidate> {
    let mut candidates = Vec::with_capacity(vertices.len() * Drawing::directions(scene));
    let mut others = ClothPoints::new(0);
    draws.samples(scene.tier, |of, place, sample| {
        let (of, wi) = (of / MOST_DIRECTIONS, sample.wi);
        let vertex = &vertices[of];
        let Scatterer::Cloth(shader, footprint) = &vertex.scatterer else { return };
        // Even if it is black: not all places need be.
        let Some(bounce) = vertex.way_on(wi, sample.weight, sample.pdf, Vec3::ZERO) else { return };
        if footprint.count() > 1 && !Drawing::of(scene, footprint).is_alone {
            others.push(candidates.len(), shader, footprint.places(), [wi, vertex.wo]);
        }
        candidates.push(Candidate { vertex: of, place, wi, bounce });
    });
    // Any of the places might have drawn the direction, so all of them are asked what they scatter there:
    // that takes up to half the noise off what is found along it.
    others.scattering(scene.tier, |which, places| {
        let Candidate { wi, bounce, .. } = &mut candidates[which];
        let density = places.density();
        let scale = wi.z.abs() / (density * places.count() as f32);
        let [diffuse, other] = places.sums().map(|sum| sum * scale);
        // Rounding may set apart what is drawn from what is told of it, at the edge of a highlight.
        let weight = if density > 0.0 { diffuse + other } else { Vec3::ZERO };
        *bounce = Bounce { weight, density, ..*bounce };
    });
    candidates
}

/// One of the directions that `vertex` has drawn, chosen by `xi` in [0, 1).
fn follow(
    vertex: &Vertex<'_>,
    own: &[Candidate],
    xi: f32,
    scene: &Scene,
    has_share: bool,
) -> Option<Bounce> {
    let Scatterer::Cloth(shader, footprint) = &vertex.scatterer else { return None };
    let part = (Drawing::of(scene, footprint).places(footprint, 0).len() as f32).recip();
    let mut lights = [Vec3::ZERO; MOST_DIRECTIONS];
    let (k, probability) = match own {
        [_] => (0, 1.0),
        _ => {
            lights = promised(vertex, own, scene);
            pick(promises(own, &lights).into_iter().take(own.len()), 0.0, xi)?
        }
    };
    let brought = own.iter().zip(lights).map(|(own, light)| own.bounce.weight * light * part);
    let all_promised = brought.sum();
    let Candidate { place, wi, bounce, .. } = &own[k];
    let diffuse_share = if has_share {
        let f = shader.eval_lobes(*place, *wi, vertex.wo);
        Lobes { diffuse: f.diffuse, other: f.specular }.diffuse_share()
    } else {
        Vec3::ZERO
    };
    let weight = bounce.weight * (part / probability);
    Some(Bounce { weight, diffuse_share, promised: lights[k], all_promised, ..*bounce })
}

/// The light of lights along each of the directions that `vertex` has drawn, if nothing is in its way.
fn promised(vertex: &Vertex<'_>, own: &[Candidate], scene: &Scene) -> [Vec3; MOST_DIRECTIONS] {
    array::from_fn(|k| {
        let Some(Candidate { bounce, .. }) = own.get(k) else { return Vec3::ZERO };
        // Only a guess: just where the ray starts matters little.
        let ray = Ray { origin: vertex.point.position, direction: bounce.direction };
        let choice = vertex.choice(scene, bounce.density);
        lights_ahead(scene, &ray, Some(choice)).map(|(_, light)| light).sum()
    })
}

/// What each of a vertex's directions most likely brings, of the `lights` along it and of surfaces.
fn promises(own: &[Candidate], lights: &[Vec3; MOST_DIRECTIONS]) -> [f32; MOST_DIRECTIONS] {
    let all: Vec3 = lights.iter().sum();
    let surfaces =
        if all == Vec3::ZERO { Vec3::ONE } else { all * (FROM_SURFACES / own.len() as f32) };
    array::from_fn(|k| {
        own.get(k).map_or(0.0, |own| weight(own.bounce.weight * (lights[k] + surfaces)))
    })
}
