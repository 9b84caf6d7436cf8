//! Many places of cloth at once.

use std::{ops::Range, ptr};

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Draws, Lobes, Sample, Samples, Shader};

use crate::render::{
    detail::Tier,
    footprint::{MOST_POINTS, POINTS},
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

/// What some places scatter, component by component.
pub(super) struct Scattering<'a> {
    pub(super) specular: [&'a [f32]; 3],
    pub(super) diffuse: [&'a [f32]; 3],
    pub(super) pdf: &'a [f32],
}

impl Scattering<'_> {
    /// How many places these are.
    pub(super) fn count(&self) -> usize {
        self.pdf.len()
    }

    /// Those of `range` alone.
    #[inline]
    pub(super) fn some(&self, range: Range<usize>) -> Scattering<'_> {
        Scattering {
            specular: self.specular.map(|part| &part[range.clone()]),
            diffuse: self.diffuse.map(|part| &part[range.clone()]),
            pdf: &self.pdf[range],
        }
    }

    /// The density of the direction if any of the places may have drawn it, sr⁻¹.
    #[inline]
    pub(super) fn density(&self) -> f32 {
        self.pdf.iter().sum::<f32>() / self.count() as f32
    }

    /// The sums of both lobes, diffuse and specular, each place weighed by what `weight` makes of its
    /// density.
    #[inline]
    pub(super) fn sums(&self, weight: impl Fn(f32) -> f32) -> [Vec3; 2] {
        let [mut diffuse, mut specular] = [Vec3::ZERO; 2];
        for (k, &pdf) in self.pdf.iter().enumerate() {
            let weight = weight(pdf);
            diffuse += Vec3::from_array(self.diffuse.map(|part| part[k])) * weight;
            specular += Vec3::from_array(self.specular.map(|part| part[k])) * weight;
        }
        [diffuse, specular]
    }
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

    /// Calls `each` with f at those places that were pushed for someone in turn and are not in gaps, the densities
    /// with which [`ClothPoints::samples`] draws it, and a bit for each of all places: whether it is one of them.
    ///
    /// Directions in front of the surface are drawn anywhere on cloth, so where none is, there is a gap.
    pub(super) fn scattering(&self, tier: Tier, mut each: impl FnMut(usize, &Scattering<'_>, u16)) {
        for (shader, points) in &self.cloths {
            let black = || vec![0.0; points.of.len()];
            let (mut specular, mut diffuse) =
                ([(); 3].map(|()| black()), [(); 3].map(|()| black()));
            let mut pdf = black();
            if tier == Tier::Batch {
                shader
                    .eval_lobes_pdf_batch(
                        &points.batch(),
                        specular.each_mut().map(Vec::as_mut_slice),
                        diffuse.each_mut().map(Vec::as_mut_slice),
                        &mut pdf,
                    )
                    .expect("all parts of a point are pushed together");
            } else {
                for (k, pdf) in pdf.iter_mut().enumerate() {
                    let (uv, wi, wo) =
                        (points.place(k), vector(&points.wi, k), vector(&points.wo, k));
                    let lobes = match tier {
                        Tier::Reference => {
                            let f = shader.eval_reference(uv, wi.as_dvec3(), wo.as_dvec3());
                            Lobes { specular: f.as_vec3(), ..Lobes::default() }
                        }
                        Tier::Single | Tier::Batch => shader.eval_lobes(uv, wi, wo),
                    };
                    for c in 0..3 {
                        (specular[c][k], diffuse[c][k]) = (lobes.specular[c], lobes.diffuse[c]);
                    }
                    *pdf = shader.pdf(uv, wi, wo);
                }
            }
            let mut first = 0;
            for of in points.of.chunk_by(|a, b| a == b) {
                let all = first..first + of.len();
                first = all.end;
                let (own, is_cloth) = keep_cloth(all, &mut pdf, [&mut specular, &mut diffuse]);
                let scattering = Scattering {
                    specular: specular.each_ref().map(|part| &part[own.clone()]),
                    diffuse: diffuse.each_ref().map(|part| &part[own.clone()]),
                    pdf: &pdf[own],
                };
                each(of[0], &scattering, is_cloth);
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

/// Puts those places of `all` first whose densities are not 0, as they are in gaps. Returns where they are now, and a bit
/// for each place that was there: whether it is one of them.
fn keep_cloth(
    all: Range<usize>,
    pdf: &mut [f32],
    lobes: [&mut [Vec<f32>; 3]; 2],
) -> (Range<usize>, u16) {
    if pdf[all.clone()].iter().fold(true, |are_cloth, &pdf| are_cloth & (pdf != 0.0)) {
        return (all, u16::MAX);
    }
    let [specular, diffuse] = lobes;
    let (mut is_cloth, mut end) = (0, all.start);
    for k in all.clone() {
        if pdf[k] != 0.0 {
            is_cloth |= 1 << (k - all.start);
            pdf[end] = pdf[k];
            specular.iter_mut().chain(&mut *diffuse).for_each(|part| part[end] = part[k]);
            end += 1;
        }
    }
    (all.start..end, is_cloth)
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
