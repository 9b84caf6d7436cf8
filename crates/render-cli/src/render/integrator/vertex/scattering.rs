//! What a surface scatters of each light.

use std::{f32::consts::FRAC_1_PI, ops::Range};

use fearless_simd::{Level, Simd, dispatch};
use glam::Vec3;

use super::{
    super::{
        Estimator, balance,
        cloth::{ClothPoints, Wanted},
        shaded::{Eight, Shaded, Sharing},
    },
    Drawing, Lit, Lobes, Scatterer, Vertex,
};
use crate::{
    render::footprint::MOST_POINTS,
    scene::{Scene, light::MOST_DRAWN},
};

/// f without the cosine for each light: its share in what the light and [`bounces`](super::bounces) find, as the estimator
/// of the scene has it. Takes points in gaps out of the footprints.
pub(in super::super) fn scattering(
    vertices: &mut [Vertex<'_>],
    lit: &[Lit],
    scene: &Scene,
) -> Vec<Lobes> {
    let mut lobes: Vec<_> = lit
        .iter()
        .map(|lit| {
            let vertex = &vertices[lit.vertex];
            let balance = |pdf| weight_of_light(scene.estimator, lit.density, pdf);
            match &vertex.scatterer {
                Scatterer::Matte(reflectance) => {
                    let balance = balance(lit.wi.z.abs() * FRAC_1_PI);
                    Lobes { diffuse: reflectance * FRAC_1_PI * balance, other: Vec3::ZERO }
                }
                Scatterer::Cloth(..) => Lobes::default(),
                Scatterer::FarCloth(shader, footprint, cover) => {
                    let f = shader.far_eval_lobes(footprint, lit.wi, vertex.wo);
                    // What nothing else finds is not weighed.
                    let weight = if lit.density < f32::INFINITY {
                        balance(shader.far_pdf(footprint, lit.wi, vertex.wo))
                    } else {
                        1.0
                    };
                    let weight = weight / cover;
                    Lobes { diffuse: f.diffuse, other: f.specular }.scaled(Vec3::splat(weight))
                }
                Scatterer::Standard(point) => {
                    let [diffuse, other] = point.eval_lobes(lit.wi, vertex.wo);
                    let weight = balance(point.pdf(lit.wi, vertex.wo));
                    Lobes { diffuse, other }.scaled(Vec3::splat(weight))
                }
            }
        })
        .collect();
    let mut is_cloth = vec![0; vertices.len()];
    let firsts = lit.chunk_by(|a, b| a.vertex == b.vertex).scan(0, |first, lit| {
        *first += lit.len();
        Some(*first - lit.len())
    });
    let missed = cloth_scattering(vertices, lit, firsts, scene, &mut lobes, |vertex, bits| {
        is_cloth[vertex] = bits;
    });
    close_gaps(vertices, is_cloth);
    cloth_scattering(vertices, lit, missed, scene, &mut lobes, |_, _| {});
    lobes
}

/// Those of the lights that shine on the same vertex as light `first` does, the first of them.
fn of_vertex(lit: &[Lit], first: usize) -> &[Lit] {
    lit[first..].chunk_by(|a, b| a.vertex == b.vertex).next().unwrap_or_default()
}

/// Sets the lobes that those lights find on cloth that shine on one vertex, given the `firsts` of them. They look at its
/// places in turn; those in gaps do not count. Calls `each` with each vertex and a bit for each of its places: whether it
/// is in no gap. Returns the firsts of those that shine on nothing but gaps.
fn cloth_scattering(
    vertices: &[Vertex<'_>],
    lit: &[Lit],
    firsts: impl IntoIterator<Item = usize>,
    scene: &Scene,
    lobes: &mut [Lobes],
    mut each: impl FnMut(usize, u16),
) -> Vec<usize> {
    // Of single draws, and of several that share the places of a footprint.
    let mut cloth = [0, 1].map(|_| ClothPoints::new(vertices.len() * MOST_POINTS));
    let mut asked = Vec::with_capacity(vertices.len());
    for first in firsts {
        let lit = of_vertex(lit, first);
        let Vertex { scatterer, wo, .. } = &vertices[lit[0].vertex];
        if let Scatterer::Cloth(shader, footprint) = scatterer {
            let places = footprint.in_turn(lit.len());
            let lights = sharing(lit);
            let cloth = &mut cloth[usize::from(footprint.draws() > 1)];
            cloth.push_in_turn(asked.len(), shader, places, &lights, *wo);
            asked.push((first, lights));
        }
    }
    let mut missed = Vec::new();
    let level = Level::new();
    let [single, several] = cloth;
    let guided = if scene.lights.are_narrow() { Wanted::Lit } else { Wanted::Guided };
    let single = single.shade(scene.tier, Wanted::Density);
    for mut shaded in single.chain(several.shade(scene.tier, guided)) {
        for (index, places) in shaded.owners() {
            let (first, ref lights) = asked[index];
            let lit = of_vertex(lit, first);
            let is_cloth = shaded.cloth(places.clone());
            if is_cloth == 0 {
                missed.push(first);
                continue;
            }
            let vertex = lit[0].vertex;
            let Scatterer::Cloth(_, footprint) = &vertices[vertex].scatterer else { continue };
            each(vertex, footprint.bits(is_cloth));
            let lobes = &mut lobes[first..][..lit.len()];
            if footprint.draws() > 1 {
                let count = is_cloth.count_ones();
                let estimator = scene.estimator;
                let [diffuse, other] = dispatch!(
                    level, simd => share(simd, &shaded, places, lights, count, estimator)
                );
                for (k, lobes) in lobes.iter_mut().enumerate() {
                    let of = |lobe: &[Eight; 3]| Vec3::from_array(lobe.each_ref().map(|c| c[k]));
                    *lobes = Lobes { diffuse: of(&diffuse), other: of(&other) };
                }
            } else {
                let density = lit[0].density;
                let weight = |pdf| weight_of_light(scene.estimator, density, pdf);
                let drawing = Drawing::of(scene, footprint);
                lobes[0] = drawing.lobes(&shaded.keep_cloth(places), weight);
            }
        }
    }
    missed
}

/// Those lights side by side.
fn sharing(lit: &[Lit]) -> Sharing {
    let mut sharing =
        Sharing { count: lit.len(), wi: [[0.0; MOST_DRAWN]; 3], density: [1.0; MOST_DRAWN] };
    for (k, lit) in lit.iter().enumerate() {
        sharing.density[k] = lit.density;
        for (part, component) in sharing.wi.iter_mut().zip(lit.wi.to_array()) {
            part[k] = component;
        }
    }
    sharing
}

/// The lobes, diffuse and other, that each of the `lights` of a vertex would have found at all its `places`, estimated from
/// what it finds at its own share of them. `count` of them are in no gap.
///
/// What it would find of the diffuse at the places of the others their guides tell nearly: the mean of that over all
/// places less that over its own share takes off what the choice of the share adds to the noise, and nothing on average:
/// a control variate (Hammersley & Handscomb 1964, section 5.5).
///
/// Light beside light: plain loops over what the compiler finds to be lanes.
#[inline(always)]
fn share<S: Simd>(
    _: S,
    shaded: &Shaded<'_>,
    places: Range<usize>,
    lights: &Sharing,
    count: u32,
    estimator: Estimator,
) -> [[Eight; 3]; 2] {
    let sums = shaded.sums(
        places,
        lights,
        #[inline(always)]
        |found, pdf| weight_of_light(estimator, found, pdf),
    );
    // Not by what is cloth in one share: places beside gaps would count for more than others.
    let (part, whole) = (lights.count as f32 / count as f32, (count as f32).recip());
    let [mut diffuse, mut other] = [[[0.0; MOST_DRAWN]; 3]; 2];
    for k in 0..MOST_DRAWN {
        // By a weight that does not depend on the places, which would make it more than noise.
        let cosine = lights.wi[2][k].abs();
        let weight = weight_of_light(estimator, lights.density[k], cosine * FRAC_1_PI);
        for c in 0..3 {
            other[c][k] = sums.specular[c][k] * part;
            diffuse[c][k] = (sums.diffuse[c][k] - sums.own[c][k] * weight) * part
                + sums.all[c][k] * (weight * whole);
        }
    }
    [diffuse, other]
}

/// The share of a light that was found with the density `found` where directions are drawn with `pdf`.
#[inline(always)]
fn weight_of_light(estimator: Estimator, found: f32, pdf: f32) -> f32 {
    match estimator {
        Estimator::Both => balance(found, pdf),
        Estimator::Lights | Estimator::Directions => 1.0,
    }
}

/// Takes points in gaps out of the footprints: of those of the vertices whose bits of `is_cloth` are 0, where none was
/// looked at or none was found, all are asked for.
fn close_gaps(vertices: &mut [Vertex<'_>], mut is_cloth: Vec<u16>) {
    let mut cloth = ClothPoints::new(0);
    for (index, vertex) in vertices.iter().enumerate() {
        if let Scatterer::Cloth(shader, footprint) = &vertex.scatterer
            && is_cloth[index] == 0
        {
            if shader.has_gaps() {
                cloth.push_places(index, shader, footprint.places());
            } else {
                is_cloth[index] = u16::MAX;
            }
        }
    }
    cloth.opacities(|index, opacities| {
        let bits = opacities.iter().rev();
        is_cloth[index] = bits.fold(0, |bits, &opacity| bits << 1 | u16::from(opacity > 0.0));
    });
    for (vertex, is_cloth) in vertices.iter_mut().zip(is_cloth) {
        if let Scatterer::Cloth(_, footprint) = &mut vertex.scatterer {
            footprint.keep(vertex.point.uv, is_cloth);
        }
    }
}
