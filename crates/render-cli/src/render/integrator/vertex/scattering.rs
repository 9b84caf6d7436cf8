//! What a surface scatters of each light.

use std::{f32::consts::FRAC_1_PI, ops::Range};

use arrayvec::ArrayVec;
use glam::Vec3;

use super::{
    super::{
        Estimator, balance,
        cloth::{ClothPoints, Eight, Shaded},
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
            let balance = |pdf| weight_of_light(scene, lit.density, pdf);
            match &vertex.scatterer {
                Scatterer::Matte(reflectance) => {
                    let balance = balance(lit.wi.z.abs() * FRAC_1_PI);
                    Lobes { diffuse: reflectance * FRAC_1_PI * balance, other: Vec3::ZERO }
                }
                Scatterer::Cloth(..) => Lobes::default(),
                Scatterer::FarCloth(shader, footprint, cover) => {
                    let f = shader.far_eval_lobes(footprint, lit.wi, vertex.wo);
                    let weight = balance(shader.far_pdf(footprint, lit.wi, vertex.wo)) / cover;
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
    let missed = cloth_scattering(vertices, lit, 0..lit.len(), scene, |index, found, bits| {
        let Lit { vertex, share: [which, among], .. } = lit[index];
        if let Scatterer::Cloth(_, footprint) = &vertices[vertex].scatterer {
            lobes[index] = found;
            is_cloth[vertex] |= footprint.bits(which, among, bits);
        }
    });
    close_gaps(vertices, is_cloth);
    cloth_scattering(vertices, lit, missed, scene, |index, found, _| lobes[index] = found);
    lobes
}

/// Calls `each` with the lobes that those lights find that are `wanted` and shine on cloth, each at its share of the
/// places there, and with a bit for each place: whether it is in no gap. The places in gaps do not count. Returns those
/// lights that shine on nothing but gaps.
fn cloth_scattering(
    vertices: &[Vertex<'_>],
    lit: &[Lit],
    wanted: impl IntoIterator<Item = usize>,
    scene: &Scene,
    mut each: impl FnMut(usize, Lobes, u16),
) -> Vec<usize> {
    let drawing = Drawing::of(scene);
    let mut cloth = ClothPoints::new(lit.len() * MOST_POINTS);
    for index in wanted {
        let Lit { vertex, share: [which, among], wi, .. } = lit[index];
        let Vertex { scatterer, wo, .. } = &vertices[vertex];
        if let Scatterer::Cloth(shader, footprint) = scatterer {
            cloth.push(index, shader, footprint.share(which, among), [wi, *wo]);
        }
    }
    let mut missed = Vec::new();
    for mut shaded in cloth.shade(scene.tier, drawing.is_alone) {
        let owners: Vec<_> = shaded.owners().collect();
        for of_vertex in owners.chunk_by(|(a, _), (b, _)| lit[*a].vertex == lit[*b].vertex) {
            let mut found = ArrayVec::<_, MOST_DRAWN>::new();
            for (index, places) in of_vertex {
                let (own, is_cloth) = shaded.keep_cloth(places.clone());
                let density = lit[*index].density;
                let lobes = drawing.lobes(&own, |pdf| weight_of_light(scene, density, pdf));
                found.push(Found { index: *index, places: places.clone(), lobes, is_cloth });
            }
            if found.iter().all(|found| found.is_cloth == 0) {
                missed.extend(found.iter().map(|found| found.index));
                continue;
            }
            if found.len() > 1 {
                guide(&mut found, &shaded, lit, scene);
            }
            for Found { index, lobes, is_cloth, .. } in found {
                each(index, lobes, is_cloth);
            }
        }
    }
    missed
}

/// What a light finds at its share of the places of a vertex.
struct Found {
    /// Of the light.
    index: usize,
    /// Where its share is.
    places: Range<usize>,
    /// The mean over those places that are in no gap.
    lobes: Lobes,
    /// Which they are.
    is_cloth: u16,
}

/// Makes of what each light has `found` at its share of a vertex an estimate of what it would have found at all places.
///
/// What it would find of the diffuse at the places of the others their guides tell nearly: the mean of that over all
/// places less that over its own share takes off what the choice of the share adds to the noise, and nothing on average:
/// a control variate (Hammersley & Handscomb 1964, section 5.5).
fn guide(found: &mut [Found], shaded: &Shaded<'_>, lit: &[Lit], scene: &Scene) {
    let mut wi = [[0.0; MOST_DRAWN]; 3];
    for (which, found) in found.iter().enumerate() {
        for (part, component) in wi.iter_mut().zip(lit[found.index].wi.to_array()) {
            part[which] = component;
        }
    }
    let of_shares: ArrayVec<_, MOST_DRAWN> =
        found.iter().map(|found| shaded.guided(found.places.clone(), &wi)).collect();
    let count: u32 = found.iter().map(|found| found.is_cloth.count_ones()).sum();
    // Not by what is cloth in one share: places beside gaps would count for more than others.
    let part = found.len() as f32 / count as f32;
    for (which, Found { index, lobes, is_cloth, .. }) in found.iter_mut().enumerate() {
        let Lit { wi: towards, density, .. } = lit[*index];
        let guided = |sums: &[Eight; 3]| Vec3::from_array(sums.each_ref().map(|sum| sum[which]));
        let (all, own) = (of_shares.iter().map(guided).sum::<Vec3>(), guided(&of_shares[which]));
        // By a weight that does not depend on the places, which would make it more than noise.
        let weight = weight_of_light(scene, density, towards.z.abs() * FRAC_1_PI);
        *lobes = lobes.scaled(Vec3::splat(is_cloth.count_ones() as f32 * part));
        lobes.diffuse += (all / count as f32 - own * part) * weight;
    }
}

/// The share of a light that was found with the density `found` where directions are drawn with `pdf`.
fn weight_of_light(scene: &Scene, found: f32, pdf: f32) -> f32 {
    match scene.estimator {
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
                cloth.push_places(index, shader, footprint.places().iter().copied());
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
