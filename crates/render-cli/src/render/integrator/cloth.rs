//! Many places of cloth at once.

use std::ptr;

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Draws, Lobes, Sample, Samples, Shader};

use super::shaded::{Guides, Scattering, Shaded, Sharing};
use crate::{
    render::{
        detail::Tier,
        footprint::{MOST_POINTS, POINTS},
    },
    scene::light::MOST_DRAWN,
};

/// Places of cloth, with two directions or with numbers that choose one, and with the index of whom
/// they are of.
pub(super) struct ClothPoints<'a> {
    cloths: Vec<(&'a Shader, Points)>,
    /// Places to make room for.
    capacity: usize,
}

/// Places of one cloth.
struct Points {
    of: Vec<usize>,
    uv: [Vec<f64>; 2],
    wi: [Vec<f32>; 3],
    wo: [Vec<f32>; 3],
}

/// What is wanted of places beside f.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The densities with which [`ClothPoints::samples`] draws the directions.
    Density,
    /// And guides to the diffuse.
    Guided,
    /// Guides, and in place of densities anything above 0 where there is cloth.
    Lit,
}

impl<'a> ClothPoints<'a> {
    /// None as yet, of most likely `capacity`.
    pub(super) fn new(capacity: usize) -> Self {
        Self { cloths: Vec::new(), capacity }
    }

    /// Places of `shader`'s cloth, uv in metres, alone: all that opacities depend on.
    pub(super) fn push_places(
        &mut self,
        of: usize,
        shader: &'a Shader,
        places: impl ExactSizeIterator<Item = DVec2>,
    ) {
        self.of(shader).push_places(of, places);
    }

    /// Places of `shader`'s cloth, uv in metres, all seen along the same directions. `wi` is one of the
    /// shading frame, or three numbers in [0, 1).
    pub(super) fn push(
        &mut self,
        of: usize,
        shader: &'a Shader,
        places: impl ExactSizeIterator<Item = DVec2>,
        [wi, wo]: [Vec3; 2],
    ) {
        let (points, count) = (self.of(shader), places.len());
        points.push_places(of, places);
        for (parts, vector) in [(&mut points.wi, wi), (&mut points.wo, wo)] {
            for (part, component) in parts.iter_mut().zip(vector.to_array()) {
                repeat(part, component, count);
            }
        }
    }

    /// Places of `shader`'s cloth, uv in metres, seen along `wo` and each in one of the `lights` in turn.
    pub(super) fn push_in_turn(
        &mut self,
        of: usize,
        shader: &'a Shader,
        places: impl ExactSizeIterator<Item = DVec2>,
        lights: &Sharing,
        wo: Vec3,
    ) {
        let (points, count) = (self.of(shader), places.len());
        points.push_places(of, places);
        for (part, component) in points.wo.iter_mut().zip(wo.to_array()) {
            repeat(part, component, count);
        }
        for (part, components) in points.wi.iter_mut().zip(&lights.wi) {
            for _ in 0..count / lights.count {
                // To copy a known number of them and take the rest back is quickest.
                let end = part.len() + lights.count;
                part.extend_from_slice(components);
                part.truncate(end);
            }
        }
    }

    /// The places of that cloth.
    fn of(&mut self, shader: &'a Shader) -> &mut Points {
        let known = self.cloths.iter().position(|(cloth, _)| ptr::eq(*cloth, shader));
        let cloth = known.unwrap_or_else(|| {
            self.cloths.push((shader, Points::new(self.capacity)));
            self.cloths.len() - 1
        });
        &mut self.cloths[cloth].1
    }

    /// Calls `each` with the opacities of all places that were pushed for someone in turn.
    pub(super) fn opacities(&self, mut each: impl FnMut(usize, &[f32])) {
        for (shader, points) in &self.cloths {
            let mut opacities = vec![0.0; points.of.len()];
            shader
                .opacity_batch(points.uv.each_ref().map(Vec::as_slice), &mut opacities)
                .expect("all parts of a point are pushed together");
            let mut rest = opacities.as_slice();
            for of in points.of.chunk_by(|a, b| a == b) {
                let (own, others) = rest.split_at(of.len());
                each(of[0], own);
                rest = others;
            }
        }
    }

    /// f at all places and what else is `wanted`, cloth by cloth.
    pub(super) fn shade(&self, tier: Tier, wanted: Wanted) -> impl Iterator<Item = Shaded<'_>> {
        self.cloths.iter().map(move |(shader, points)| points.shade(shader, tier, wanted))
    }

    /// Calls `each` with f at those places that were pushed for someone in turn and are not in gaps.
    pub(super) fn scattering(&self, tier: Tier, mut each: impl FnMut(usize, &Scattering<'_>)) {
        for mut shaded in self.shade(tier, Wanted::Density) {
            for (of, all) in shaded.owners() {
                each(of, &shaded.keep_cloth(all));
            }
        }
    }

    /// Calls `each` with each place and a direction drawn there, if there is one.
    pub(super) fn samples(&self, tier: Tier, mut each: impl FnMut(usize, DVec2, Sample)) {
        for (shader, points) in &self.cloths {
            if tier != Tier::Batch {
                for (k, &of) in points.of.iter().enumerate() {
                    let (place, xi) = (points.place(k), vector(&points.wi, k).to_array());
                    if let Some(sample) = shader.sample(place, vector(&points.wo, k), xi) {
                        each(of, place, sample);
                    }
                }
                continue;
            }
            let black = || vec![0.0; points.of.len()];
            let (mut wi, mut weight) = ([(); 3].map(|()| black()), [(); 3].map(|()| black()));
            let mut pdf = black();
            let Batch { uv, wi: xi, wo, active } = points.batch();
            let samples = Samples {
                wi: wi.each_mut().map(Vec::as_mut_slice),
                weight: weight.each_mut().map(Vec::as_mut_slice),
                pdf: &mut pdf,
            };
            shader
                .sample_batch(&Draws { uv, wo, xi, active }, samples)
                .expect("all parts of a point are pushed together");
            for (k, &of) in points.of.iter().enumerate().filter(|&(k, _)| pdf[k] > 0.0) {
                let sample = Sample { wi: vector(&wi, k), weight: vector(&weight, k), pdf: pdf[k] };
                each(of, points.place(k), sample);
            }
        }
    }
}

impl Points {
    fn new(capacity: usize) -> Self {
        let room = || Vec::with_capacity(capacity);
        Self {
            of: Vec::with_capacity(capacity),
            uv: [(); 2].map(|()| Vec::with_capacity(capacity)),
            wi: [(); 3].map(|()| room()),
            wo: [(); 3].map(|()| room()),
        }
    }

    fn shade(&self, shader: &Shader, tier: Tier, wanted: Wanted) -> Shaded<'_> {
        let count = self.of.len();
        let room = || vec![0.0; count + MOST_DRAWN];
        let black = || [(); 3].map(|()| room());
        let (mut specular, mut diffuse, mut pdf) = (black(), black(), room());
        let mut guides =
            (wanted != Wanted::Density).then(|| Guides { color: black(), facing: black() });
        if tier == Tier::Batch {
            let [specular, diffuse] = [&mut specular, &mut diffuse].map(|lobe| slices(lobe, count));
            let pdf = &mut pdf[..count];
            let batch = self.batch();
            let shaded = match &mut guides {
                None => shader.eval_lobes_pdf_batch(&batch, specular, diffuse, pdf),
                Some(Guides { color, facing }) => {
                    let guides = selvedge_yarn_brdf::Guides {
                        color: slices(color, count),
                        facing: slices(facing, count),
                    };
                    if wanted == Wanted::Lit {
                        shader.eval_lobes_guide_batch(&batch, specular, diffuse, pdf, guides)
                    } else {
                        shader.eval_lobes_pdf_guide_batch(&batch, specular, diffuse, pdf, guides)
                    }
                }
            };
            shaded.expect("all parts of a point are pushed together");
        } else {
            for (k, pdf) in pdf[..count].iter_mut().enumerate() {
                let (uv, wi, wo) = (self.place(k), vector(&self.wi, k), vector(&self.wo, k));
                let lobes = match tier {
                    Tier::Reference => {
                        let f = shader.eval_reference(uv, wi.as_dvec3(), wo.as_dvec3());
                        Lobes { specular: f.as_vec3(), ..Lobes::default() }
                    }
                    Tier::Single | Tier::Batch => shader.eval_lobes(uv, wi, wo),
                };
                put(lobes.specular, &mut specular, k);
                put(lobes.diffuse, &mut diffuse, k);
                *pdf = shader.pdf(uv, wi, wo);
                if let (Some(guides), true) = (&mut guides, *pdf > 0.0) {
                    let guide = shader.guide(uv, wo);
                    put(guide.color, &mut guides.color, k);
                    put(guide.facing, &mut guides.facing, k);
                }
            }
        }
        Shaded { of: &self.of, specular, diffuse, pdf, guides }
    }

    fn push_places(&mut self, of: usize, places: impl ExactSizeIterator<Item = DVec2>) {
        repeat(&mut self.of, of, places.len());
        for place in places {
            self.uv[0].push(place.x);
            self.uv[1].push(place.y);
        }
    }

    /// Position of place `k`, m.
    fn place(&self, k: usize) -> DVec2 {
        DVec2::new(self.uv[0][k], self.uv[1][k])
    }

    fn batch(&self) -> Batch<'_> {
        Batch {
            uv: self.uv.each_ref().map(Vec::as_slice),
            wi: self.wi.each_ref().map(Vec::as_slice),
            wo: self.wo.each_ref().map(Vec::as_slice),
            active: None,
        }
    }
}

/// The first `count` numbers of each.
fn slices(parts: &mut [Vec<f32>; 3], count: usize) -> [&mut [f32]; 3] {
    parts.each_mut().map(|part| &mut part[..count])
}

/// Sets vector `k` of those whose components `parts` are.
fn put(vector: Vec3, parts: &mut [Vec<f32>; 3], k: usize) {
    for (part, value) in parts.iter_mut().zip(vector.to_array()) {
        part[k] = value;
    }
}

/// Appends so many of `value`, at most as many as a footprint has: to copy a known number of them and take the rest back
/// is quickest.
#[inline]
fn repeat<T: Copy>(values: &mut Vec<T>, value: T, count: usize) {
    let end = values.len() + count;
    if count <= POINTS {
        values.extend_from_slice(&[value; POINTS]);
    } else {
        values.extend_from_slice(&[value; MOST_POINTS]);
    }
    values.truncate(end);
}

/// Vector `k` of those whose components these are.
fn vector(parts: &[Vec<f32>; 3], k: usize) -> Vec3 {
    Vec3::new(parts[0][k], parts[1][k], parts[2][k])
}
