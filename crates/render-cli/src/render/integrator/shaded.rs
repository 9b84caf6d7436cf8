//! What places of cloth scatter.

use std::{array, ops::Range};

use glam::Vec3;

use crate::scene::light::MOST_DRAWN;

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

    /// The density of the direction if any of the places may have drawn it, sr⁻¹.
    #[inline]
    pub(super) fn density(&self) -> f32 {
        self.pdf.iter().sum::<f32>() / self.count() as f32
    }

    /// The sums of both lobes, diffuse and specular.
    #[inline]
    pub(super) fn sums(&self) -> [Vec3; 2] {
        [self.diffuse, self.specular]
            .map(|lobe| Vec3::from_array(lobe.map(|part| part.iter().sum())))
    }

    /// The sums of both lobes, diffuse and specular, each place weighed by what `weight` makes of its density.
    #[inline]
    pub(super) fn weighed(&self, weight: impl Fn(f32) -> f32) -> [Vec3; 2] {
        let mut sums = [Vec3::ZERO; 2];
        for (k, &pdf) in self.pdf.iter().enumerate() {
            let weight = weight(pdf);
            for (sum, lobe) in sums.iter_mut().zip([self.diffuse, self.specular]) {
                *sum += Vec3::from_array(lobe.map(|part| part[k])) * weight;
            }
        }
        sums
    }
}

/// Something of each of the lights that a vertex looks at.
pub(super) type Eight = [f32; MOST_DRAWN];

/// What places of a cloth scatter, component by component.
pub(super) struct Shaded<'a> {
    /// Whose they are.
    pub(super) of: &'a [usize],
    /// With room for as many numbers behind the last place as there are in [`Eight`].
    pub(super) specular: [Vec<f32>; 3],
    pub(super) diffuse: [Vec<f32>; 3],
    pub(super) pdf: Vec<f32>,
    pub(super) guides: Option<Guides>,
}

/// [`Guide`](selvedge_yarn_brdf::Guide)s of places, component by component; 0 in gaps.
pub(super) struct Guides {
    pub(super) color: [Vec<f32>; 3],
    pub(super) facing: [Vec<f32>; 3],
}

/// Lights that share places, side by side.
pub(super) struct Sharing {
    /// How many they are.
    pub(super) count: usize,
    /// Components of the directions to them.
    pub(super) wi: [Eight; 3],
    /// The densities with which they were found, sr⁻¹.
    pub(super) density: Eight,
}

/// What each of several lights finds, side by side: sums over places.
#[derive(Debug, Default)]
pub(super) struct Sums {
    /// At those that it looks at, each weighed.
    pub(super) diffuse: [Eight; 3],
    pub(super) specular: [Eight; 3],
    /// What the guides there tell of its diffuse, and what those of all places do.
    pub(super) own: [Eight; 3],
    pub(super) all: [Eight; 3],
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

    /// A bit for each of `all` places: whether it is in no gap. There, and there alone, the density is 0: directions in
    /// front of the surface are drawn anywhere on cloth.
    pub(super) fn cloth(&self, all: Range<usize>) -> u16 {
        let bits = self.pdf[all].iter().rev();
        bits.fold(0, |bits, &pdf| bits << 1 | u16::from(pdf != 0.0))
    }

    /// Puts those of `all` places first that are in no gap, and returns what they scatter.
    pub(super) fn keep_cloth(&mut self, all: Range<usize>) -> Scattering<'_> {
        let Self { specular, diffuse, pdf, .. } = self;
        let mut end = all.end;
        if pdf[all.clone()].iter().fold(false, |has_gaps, &pdf| has_gaps | (pdf == 0.0)) {
            end = all.start;
            for k in all.clone() {
                if pdf[k] != 0.0 {
                    pdf[end] = pdf[k];
                    specular.iter_mut().chain(&mut *diffuse).for_each(|part| part[end] = part[k]);
                    end += 1;
                }
            }
        }
        let own = all.start..end;
        Scattering {
            specular: specular.each_ref().map(|part| &part[own.clone()]),
            diffuse: diffuse.each_ref().map(|part| &part[own.clone()]),
            pdf: &pdf[own],
        }
    }

    /// What the `lights` find at `all` places, which they look at in turn: each weighed by what `weight` makes of the
    /// density with which the light was found and that of the place.
    #[inline(always)]
    pub(super) fn sums(
        &self,
        all: Range<usize>,
        lights: &Sharing,
        weight: impl Fn(f32, f32) -> f32,
    ) -> Sums {
        let mut sums = Sums::default();
        for first in all.clone().step_by(lights.count) {
            // Beyond the last light, numbers that nobody asks for.
            let pdf = eight(&self.pdf, first);
            let weights: Eight = array::from_fn(|k| weight(lights.density[k], pdf[k]));
            for c in 0..3 {
                add(&mut sums.diffuse[c], &weights, eight(&self.diffuse[c], first));
                add(&mut sums.specular[c], &weights, eight(&self.specular[c], first));
            }
            if let Some(Guides { color, facing }) = &self.guides {
                let facing = facing.each_ref().map(|part| eight(part, first));
                let cos = cosines(facing, &lights.wi);
                for (sums, color) in sums.own.iter_mut().zip(color) {
                    add(sums, &cos, eight(color, first));
                }
            }
        }
        if let Some(guides) = &self.guides {
            guides.add(all, &lights.wi, &mut sums.all);
        }
        sums
    }
}

impl Guides {
    /// Adds what those of `places` tell of the directions `wi`, whose components these are.
    #[inline(always)]
    fn add(&self, places: Range<usize>, wi: &[Eight; 3], sums: &mut [Eight; 3]) {
        for k in places {
            let facing = self.facing.each_ref().map(|part| [part[k]; MOST_DRAWN]);
            let cos = cosines(facing.each_ref(), wi);
            for (sums, color) in sums.iter_mut().zip(&self.color) {
                add(sums, &cos, &[color[k]; MOST_DRAWN]);
            }
        }
    }
}

/// The numbers from `first` on.
#[inline(always)]
fn eight(values: &[f32], first: usize) -> &Eight {
    values[first..].first_chunk().expect("there is room behind the last place")
}

/// Adds the products of `a` and `b`.
#[inline(always)]
fn add(sums: &mut Eight, a: &Eight, b: &Eight) {
    for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
        *sum += a * b;
    }
}

/// The products of vectors, 0 where they are less.
#[inline(always)]
fn cosines([ax, ay, az]: [&Eight; 3], [bx, by, bz]: &[Eight; 3]) -> Eight {
    array::from_fn(|k| (ax[k] * bx[k] + ay[k] * by[k] + az[k] * bz[k]).max(0.0))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use selvedge_yarn_brdf::Guide;

    use super::*;
    use crate::chi_square::Random;

    /// Places of owners, of which every third is in a gap: their guides are random, and they scatter their number.
    fn shaded(of: &[usize]) -> (Shaded<'_>, Vec<Guide>) {
        let mut random = Random(1);
        let mut number = || random.number();
        let room = || vec![0.0; of.len() + MOST_DRAWN];
        let black = || [(); 3].map(|()| room());
        let (mut color, mut facing) = (black(), black());
        let (mut specular, mut pdf) = (black(), room());
        let mut guides = Vec::new();
        for k in 0..of.len() {
            let mut vector = || Vec3::new(number(), number(), number());
            let mut guide = Guide::default();
            if k % 3 != 1 {
                guide = Guide { color: vector(), facing: vector() - 0.5 };
                pdf[k] = 1.0 + k as f32;
                specular.iter_mut().for_each(|part| part[k] = k as f32);
            }
            for c in 0..3 {
                (color[c][k], facing[c][k]) = (guide.color[c], guide.facing[c]);
            }
            guides.push(guide);
        }
        let (diffuse, guides_of) = (specular.clone(), Some(Guides { color, facing }));
        (Shaded { of, specular, diffuse, pdf, guides: guides_of }, guides)
    }

    #[test]
    fn lights_find_the_sums_of_their_shares() {
        let of = [0; 16];
        let (shaded, guides) = shaded(&of);
        let towards = |k: usize| Vec3::new(0.1 * k as f32, -0.2, 0.77).normalize();
        let wi = [0, 1, 2].map(|c| array::from_fn(|k| towards(k)[c]));
        for (count, all) in [(1, 0..5), (3, 3..9), (6, 0..12), (8, 0..8), (8, 0..16)] {
            let lights = Sharing { count, wi, density: array::from_fn(|k| k as f32) };
            let sums = shaded.sums(all.clone(), &lights, |found, pdf| 2.0 * found + pdf);
            for k in 0..count {
                let own = || all.clone().skip(k).step_by(count);
                let weight = |place: usize| 2.0 * k as f32 + shaded.pdf[place];
                let diffuse: f32 =
                    own().map(|place| weight(place) * shaded.diffuse[1][place]).sum();
                let guided = |places: &mut dyn Iterator<Item = usize>| {
                    places.map(|place| guides[place].diffuse(towards(k))).sum::<Vec3>()
                };
                let (own, all) = (guided(&mut own()), guided(&mut all.clone()));
                let of = |sums: &[Eight; 3]| Vec3::from_array(sums.each_ref().map(|sum| sum[k]));
                assert_eq!([sums.diffuse[1][k], sums.specular[2][k]], [diffuse; 2], "{count} {k}");
                assert!(of(&sums.own).abs_diff_eq(own, 1e-5), "{count} {k}: {own}");
                assert!(of(&sums.all).abs_diff_eq(all, 1e-5), "{count} {k}: {all}");
            }
        }
    }

    #[test]
    fn what_is_in_gaps_does_not_count() {
        let of = [3, 3, 3, 3, 8, 8];
        let (mut shaded, _) = shaded(&of);
        let owners: Vec<_> = shaded.owners().collect();
        assert_eq!(owners, [(3, 0..4), (8, 4..6)]);
        assert_eq!([0..4, 4..6].map(|all| shaded.cloth(all)), [0b1101, 0b10]);
        let places = shaded.keep_cloth(0..4);
        assert_eq!((places.pdf, places.specular[0]), (&[1.0, 3.0, 4.0][..], &[0.0, 2.0, 3.0][..]));
        let places = shaded.keep_cloth(4..6);
        assert_eq!((places.pdf, places.diffuse[2]), (&[6.0][..], &[5.0][..]));
    }
}
