//! The white furnace as a picture, summed in three ways.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::Cloth;

use super::{
    albedo::{Estimate, Points, Tier},
    map,
    surface::Surface,
};
use crate::{args::MeasureOptions, image::Picture};

/// How much white cloth reflects to each direction above it, or lets through.
///
/// Red is the mean weight of what the sampler draws; green is f cos θ over the density, both evaluated again
/// for the directions that it drew; blue is π f for directions drawn from the cosine. If the sampler, its
/// density and the BRDF belong to each other, all three are the same.
#[derive(Clone, Debug)]
pub(super) struct ThreeWay {
    side: u32,
    /// By pixel; `None` beside the hemisphere.
    pixels: Vec<Option<DVec3>>,
}

/// Standard errors that are granted to each difference of two sums.
const GRANTED: f64 = 5.0;

/// Sets of points, which differ between neighbours, so that what is left of the noise is seen as such.
const SETS: usize = 64;

/// The set of a pixel: another one for each of a square of 8 by 8.
fn set(side: u32, pixel: usize) -> usize {
    (pixel % side as usize) % 8 + 8 * ((pixel / side as usize) % 8)
}

impl ThreeWay {
    /// That of `cloth`, which is white, in a square of `side` pixels with `count` points for each pixel.
    pub(super) fn new(
        options: &MeasureOptions,
        cloth: &Cloth,
        surface: &dyn Surface,
        tier: Tier,
        (side, count): (u32, u64),
    ) -> Self {
        let shader = surface.shader();
        let through = |points: &Points| match tier {
            Tier::Far => 1.0 - f64::from(shader.far_opacity(&super::albedo::footprint(cloth))),
            Tier::Single | Tier::Batch => {
                let covered = (0..points.len()).map(|k| f64::from(shader.opacity(points.place(k))));
                1.0 - covered.sum::<f64>() / points.len() as f64
            }
        };
        let sets: Vec<(Points, f64)> = (0..SETS)
            .into_par_iter()
            .map(|set| {
                let points = Points::new(cloth, options.seed, set, count);
                let through = through(&points);
                (points, through)
            })
            .collect();
        let pixels = (0..side as usize * side as usize).into_par_iter().map(|pixel| {
            let wo = map::direction(side, pixel)?.as_vec3();
            let (points, through) = &sets[set(side, pixel)];
            Some(three(surface, tier, points, wo) + *through)
        });
        Self { side, pixels: pixels.collect() }
    }

    /// Means of red, green and blue.
    pub(super) fn mean(&self) -> DVec3 {
        let count = self.pixels.iter().flatten().count();
        self.pixels.iter().flatten().sum::<DVec3>() / count as f64
    }

    /// How far red, green and blue are apart, less what the noise of the sums may have added; NaN if one is.
    pub(super) fn apart(&self) -> f64 {
        let mut sums = vec![(DVec3::ZERO, 0u32); SETS];
        for (pixel, share) in self.pixels.iter().enumerate() {
            if let Some(DVec3 { x, y, z }) = *share {
                let (sum, count) = &mut sums[set(self.side, pixel)];
                *sum += DVec3::new(x - y, y - z, z - x);
                *count += 1;
            }
        }
        let means = sums.into_iter().filter(|(_, count)| *count > 0);
        let means: Vec<DVec3> = means.map(|(sum, count)| sum / f64::from(count)).collect();
        let Estimate { mean, error } = Estimate::of(&means);
        let apart = mean.abs() - GRANTED * error;
        if apart.is_nan() { f64::NAN } else { apart.max_element() }
    }

    /// As it is, on grey.
    pub(super) fn picture(&self) -> Picture {
        self.shown(|share| share)
    }

    /// Grey where it is 1, and what is missing or too much ten times as strong.
    pub(super) fn deviation(&self) -> Picture {
        self.shown(|share| 0.5 + 10.0 * (share - 1.0))
    }

    fn shown(&self, show: impl Fn(DVec3) -> DVec3 + Sync) -> Picture {
        map::hemisphere(self.side, Vec3::splat(0.2), |pixel, _| {
            self.pixels[pixel].map_or(Vec3::ZERO, |share| show(share).as_vec3())
        })
    }
}

/// The means of red, green and blue for one direction.
fn three(surface: &dyn Surface, tier: Tier, points: &Points, wo: Vec3) -> DVec3 {
    let count = points.len();
    let samples = points.samples(surface, tier, wo, count);
    let sampled: f64 = samples.iter().map(|[_, weight]| f64::from(weight.x)).sum();
    let wi: Vec<Vec3> = samples.iter().map(|[wi, _]| *wi).collect();
    let [f, pdf] = points.evaluated(surface, tier, &wi, wo);
    let again = wi.iter().zip(f.iter().zip(&pdf)).filter(|(wi, _)| **wi != Vec3::ZERO);
    let again: f64 = again.map(|(wi, (f, pdf))| f64::from(f.x * wi.z.abs() / pdf.x)).sum();
    let even = points.xi[0].iter().zip(&points.xi[1]);
    let wi: Vec<Vec3> = even
        .map(|(&a, &b)| square_to_cosine_hemisphere(DVec2::new(a.into(), b.into())).as_vec3())
        .collect();
    let [f, _] = points.evaluated(surface, tier, &wi, wo);
    let cosine: f64 = f.iter().map(|f| std::f64::consts::PI * f64::from(f.x)).sum();
    DVec3::new(sampled, again, cosine) / count as f64
}
