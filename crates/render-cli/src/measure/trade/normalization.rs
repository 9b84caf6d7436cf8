//! The factor of the highlight by a search over samples, as the paper has it, in the place of the
//! shader's own quadrature.

use std::f64::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;
use selvedge_normalize::warp::square_to_uniform_hemisphere;
use selvedge_yarn_brdf::{Cloth, ParamError, Shader};

use crate::render::sampler::PixelSampler;

/// How many samples are taken in a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// Directions among which that of the greatest albedo is sought.
    pub directions: u32,
    /// Places and directions from which each albedo is estimated.
    pub samples: u32,
}

/// What a search is held against: more than any that is tried.
const EXHAUSTIVE: Search = Search { directions: 256, samples: 2048 };

/// The types of yarn of a cloth, ready for searches.
#[derive(Debug)]
pub struct Yarns {
    /// Of each: its divisors, places where it shows and the greatest albedo of its highlight that an
    /// [exhaustive](EXHAUSTIVE) search finds there, which is taken to be what its factor rests on.
    yarns: Vec<(Vec<f32>, Vec<DVec2>, f64)>,
}

impl Yarns {
    /// Those of `cloth`, whose shader is `shader`.
    pub fn new(shader: &Shader, cloth: &Cloth) -> Self {
        let yarns = (0..cloth.yarns.len() as u16).map(|yarn| {
            let places = places(shader, cloth, yarn);
            let expected = greatest(shader, &places, EXHAUSTIVE, u64::MAX);
            (shader.divisors(yarn).unwrap_or_default(), places, expected)
        });
        Self { yarns: yarns.collect() }
    }

    /// Scales each type of yarn of `other`, a shader of the same cloth as that of [`Yarns::new`], which is
    /// `shader`, by what a search finds in the place of its own factor: the greatest of so many estimated
    /// albedos of its highlight. `seed` chooses the samples.
    ///
    /// # Errors
    ///
    /// When what is found is no factor, as of samples that see no highlight at all.
    pub fn rescale(
        &self,
        other: &mut Shader,
        shader: &Shader,
        search: Search,
        seed: u64,
    ) -> Result<(), ParamError> {
        for (yarn, (divisors, places, expected)) in self.yarns.iter().enumerate() {
            if *expected > 0.0 {
                let factor = (greatest(shader, places, search, seed) / expected) as f32;
                let divisors: Vec<f32> = divisors.iter().map(|divisor| divisor * factor).collect();
                other.set_divisors(yarn as u16, &divisors)?;
            }
        }
        Ok(())
    }
}

/// Places of a repeat where the type of yarn shows, m: at most as many as an exhaustive search asks for.
fn places(shader: &Shader, cloth: &Cloth, yarn: u16) -> Vec<DVec2> {
    let sampler = PixelSampler::new([yarn.into(), 0], 0);
    let places = (0..1 << 15).map(|index| {
        let at = sampler.sample(index).next_2d().as_dvec2();
        at * cloth.size()
    });
    let shows = |place: &DVec2| shader.yarn_at(*place).is_some_and(|point| point.yarn == yarn);
    places.filter(shows).take(EXHAUSTIVE.samples as usize).collect()
}

/// The greatest of the albedos of the highlight, 0 without places.
fn greatest(shader: &Shader, places: &[DVec2], search: Search, seed: u64) -> f64 {
    if places.is_empty() {
        return 0.0;
    }
    let albedo = |direction: u32| {
        let mut chosen = PixelSampler::new([0, 1], seed).sample(direction);
        let wo = square_to_uniform_hemisphere(chosen.next_2d().as_dvec2()).as_vec3();
        let sampler = PixelSampler::new([direction, 2], seed);
        let sum: f64 = (0..search.samples)
            .map(|index| {
                let mut sample = sampler.sample(index);
                let place = (f64::from(sample.next_1d()) * places.len() as f64) as usize;
                let wi = square_to_uniform_hemisphere(sample.next_2d().as_dvec2()).as_vec3();
                let f = shader.eval_lobes(places[place.min(places.len() - 1)], wi, wo).specular;
                f64::from(f.max_element() * wi.z)
            })
            .sum();
        sum * TAU / f64::from(search.samples)
    };
    let albedos = (0..search.directions).into_par_iter().map(albedo);
    albedos.reduce(|| 0.0, f64::max)
}
