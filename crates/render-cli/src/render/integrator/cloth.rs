//! Many places of cloth at once.

use std::{ops::Range, ptr};

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Draws, Lobes, Sample, Samples, Shader};

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

    /// f at all places and the densities with which [`ClothPoints::samples`] draws it, cloth by cloth; and guides to
    /// the diffuse, if they are `guided`.
    pub(super) fn shade(&self, tier: Tier, guided: bool) -> impl Iterator<Item = Shaded<'_>> {
        self.cloths.iter().map(move |(shader, points)| points.shade(shader, tier, guided))
    }

    /// Calls `each` with f at those places that were pushed for someone in turn and are not in gaps.
    pub(super) fn scattering(&self, tier: Tier, mut each: impl FnMut(usize, &Scattering<'_>)) {
        for mut shaded in self.shade(tier, false) {
            for (of, all) in shaded.owners() {
                each(of, &shaded.keep_cloth(all).0);
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

    fn shade(&self, shader: &Shader, tier: Tier, guided: bool) -> Shaded<'_> {
        let count = self.of.len();
        let black = || [(); 3].map(|()| vec![0.0; count]);
        let (mut specular, mut diffuse, mut pdf) = (black(), black(), vec![0.0; count]);
        let mut guides = guided.then(|| Guides { color: black(), facing: black() });
        if tier == Tier::Batch {
            let [specular, diffuse] = [&mut specular, &mut diffuse].map(slices);
            let shaded = match &mut guides {
                None => shader.eval_lobes_pdf_batch(&self.batch(), specular, diffuse, &mut pdf),
                Some(Guides { color, facing }) => shader.eval_lobes_pdf_guide_batch(
                    &self.batch(),
                    specular,
                    diffuse,
                    &mut pdf,
                    selvedge_yarn_brdf::Guides { color: slices(color), facing: slices(facing) },
                ),
            };
            shaded.expect("all parts of a point are pushed together");
        } else {
            for (k, pdf) in pdf.iter_mut().enumerate() {
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

/// Something of each of the lights that a vertex looks at.
pub(super) type Eight = [f32; MOST_DRAWN];

/// What places of a cloth scatter, component by component.
pub(super) struct Shaded<'a> {
    of: &'a [usize],
    specular: [Vec<f32>; 3],
    diffuse: [Vec<f32>; 3],
    pdf: Vec<f32>,
    guides: Option<Guides>,
}

/// [`Guide`](selvedge_yarn_brdf::Guide)s of places, component by component; 0 in gaps.
struct Guides {
    color: [Vec<f32>; 3],
    facing: [Vec<f32>; 3],
}

impl<'a> Shaded<'a> {
    /// Whoever places were pushed for in turn, and where theirs are.
    pub(super) fn owners(&self) -> impl Iterator<Item = (usize, Range<usize>)> + use<'a> {
        let mut first = 0;
        self.of.chunk_by(|a, b| a == b).map(move |of| {
            let all = first..first + of.len();
            first = all.end;
            (of[0], all)
        })
    }

    /// Puts those places of `all` first whose densities are not 0, as they are in gaps: directions in front of the
    /// surface are drawn anywhere on cloth. Returns what they scatter, and a bit for each place that was there: whether
    /// it is one of them. Guides stay.
    pub(super) fn keep_cloth(&mut self, all: Range<usize>) -> (Scattering<'_>, u16) {
        let Self { specular, diffuse, pdf, .. } = self;
        let (mut is_cloth, mut end) = (u16::MAX >> (MOST_POINTS - all.len()), all.end);
        if pdf[all.clone()].iter().fold(false, |has_gaps, &pdf| has_gaps | (pdf == 0.0)) {
            (is_cloth, end) = (0, all.start);
            for k in all.clone() {
                if pdf[k] != 0.0 {
                    is_cloth |= 1 << (k - all.start);
                    pdf[end] = pdf[k];
                    specular.iter_mut().chain(&mut *diffuse).for_each(|part| part[end] = part[k]);
                    end += 1;
                }
            }
        }
        let own = all.start..end;
        let scattering = Scattering {
            specular: specular.each_ref().map(|part| &part[own.clone()]),
            diffuse: diffuse.each_ref().map(|part| &part[own.clone()]),
            pdf: &pdf[own],
        };
        (scattering, is_cloth)
    }

    /// The sums of what the guides of `places` tell of the diffuse for each of the directions `wi` to lights, whose
    /// components these are; 0 without guides.
    pub(super) fn guided(&self, places: Range<usize>, [x, y, z]: &[Eight; 3]) -> [Eight; 3] {
        let mut sums = [[0.0; MOST_DRAWN]; 3];
        let Some(Guides { color, facing }) = &self.guides else { return sums };
        for k in places {
            let [towards_x, towards_y, towards_z] = facing.each_ref().map(|part| part[k]);
            // All directions side by side.
            let mut cos = [0.0; MOST_DRAWN];
            for (light, cos) in cos.iter_mut().enumerate() {
                let product = towards_x * x[light] + towards_y * y[light] + towards_z * z[light];
                *cos = product.max(0.0);
            }
            for (sums, color) in sums.iter_mut().zip(color) {
                let color = color[k];
                for (sum, cos) in sums.iter_mut().zip(cos) {
                    *sum += color * cos;
                }
            }
        }
        sums
    }
}

fn slices(parts: &mut [Vec<f32>; 3]) -> [&mut [f32]; 3] {
    parts.each_mut().map(Vec::as_mut_slice)
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

#[cfg(test)]
mod tests {
    use std::array;

    use selvedge_yarn_brdf::Guide;

    use super::*;
    use crate::chi_square::Random;

    /// Places of two owners, of which every third is in a gap.
    fn shaded(of: &[usize]) -> (Shaded<'_>, Vec<Guide>) {
        let mut random = Random(1);
        let mut number = || random.number();
        let black = || [(); 3].map(|()| vec![0.0; of.len()]);
        let (mut color, mut facing) = (black(), black());
        let mut guides = Vec::new();
        for k in 0..of.len() {
            let mut vector = || Vec3::new(number(), number(), number());
            let guide = if k % 3 == 1 {
                Guide::default()
            } else {
                Guide { color: vector(), facing: vector() - 0.5 }
            };
            put(guide.color, &mut color, k);
            put(guide.facing, &mut facing, k);
            guides.push(guide);
        }
        let pdf = (0..of.len()).map(|k| if k % 3 == 1 { 0.0 } else { 1.0 + k as f32 }).collect();
        let values = [(); 3].map(|()| (0..of.len()).map(|k| k as f32).collect());
        let (specular, diffuse) = (values.clone(), values);
        (Shaded { of, specular, diffuse, pdf, guides: Some(Guides { color, facing }) }, guides)
    }

    #[test]
    fn guides_add_up() {
        let of = [0; MOST_POINTS];
        let (shaded, guides) = shaded(&of);
        let wi = |k: usize| Vec3::new(0.1 * k as f32, -0.2, 0.77).normalize();
        let parts = [0, 1, 2].map(|c| array::from_fn(|k| wi(k)[c]));
        for (first, end) in [(0, 0), (0, MOST_POINTS), (3, 6)] {
            let sums = shaded.guided(first..end, &parts);
            for k in 0..MOST_DRAWN {
                let expected: Vec3 =
                    guides[first..end].iter().map(|guide| guide.diffuse(wi(k))).sum();
                let found = Vec3::from_array(sums.map(|sum| sum[k]));
                assert!(found.abs_diff_eq(expected, 1e-5), "{first} to {end}: {found}, {expected}");
            }
        }
    }

    #[test]
    fn what_is_in_gaps_does_not_count() {
        let of = [3, 3, 3, 3, 8, 8];
        let (mut shaded, _) = shaded(&of);
        let owners: Vec<_> = shaded.owners().collect();
        assert_eq!(owners, [(3, 0..4), (8, 4..6)]);
        let (places, is_cloth) = shaded.keep_cloth(0..4);
        assert_eq!(
            (places.pdf, places.specular[0], is_cloth),
            (&[1.0, 3.0, 4.0][..], &[0.0, 2.0, 3.0][..], 0b1101)
        );
        let (places, is_cloth) = shaded.keep_cloth(4..6);
        assert_eq!((places.pdf, places.diffuse[2], is_cloth), (&[6.0][..], &[5.0][..], 0b10));
    }
}
