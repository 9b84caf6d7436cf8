//! How much a cloth reflects, by sums over places and directions, with the error of the sum.

use std::f32::consts::FRAC_1_PI;

use glam::{DVec2, DVec3, Vec3};
use selvedge_normalize::{
    halton::{Halton, Scrambling, below_one},
    warp::square_to_cosine_hemisphere,
};
use selvedge_yarn_brdf::{Cloth, Footprint, Noise};

use super::surface::{self, Surface};

/// A way to evaluate the BRDF.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Tier {
    /// One point after the other.
    Single,
    /// Many points at a time.
    Batch,
    /// The mean over the repeat.
    Far,
}

impl Tier {
    pub(super) const ALL: [Self; 3] = [Self::Single, Self::Batch, Self::Far];

    /// What people call it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Single => "single point",
            Self::Batch => "batch",
            Self::Far => "far field",
        }
    }
}

/// Independent sums whose spread tells their error.
pub(super) const REPLICATES: usize = 16;

/// Places on a cloth, and three numbers for each to draw a direction with.
#[derive(Clone, Debug)]
pub(super) struct Points {
    /// u and v, m along the cloth.
    pub(super) uv: [Vec<f64>; 2],
    /// Numbers in [0, 1).
    pub(super) xi: [Vec<f32>; 3],
    /// Where the far field is looked at.
    footprint: Footprint,
}

impl Points {
    /// `count` places all over the repeats of `cloth`, of the `replicate`-th sum.
    pub(super) fn new(cloth: &Cloth, seed: u64, replicate: usize, count: u64) -> Self {
        // Where repeats differ, one of them is not the cloth.
        let is_irregular = cloth.yarns.iter().any(|yarn| yarn.noise != Noise::default());
        let size = cloth.size() * if is_irregular { 16.0 } else { 1.0 };
        let scrambling =
            Scrambling::Digits(seed.wrapping_mul(0x9e37_79b9).wrapping_add(replicate as u64));
        let points: Vec<_> = Halton::<5>::scrambled(scrambling)
            .points_from(std::num::NonZeroU32::MIN)
            .take(count as usize)
            .collect();
        let turn = DVec2::from_angle(-cloth.rotation) / cloth.scale;
        let place = |p: &[f64; 5]| turn.rotate(size * DVec2::new(p[0], p[1]));
        Self {
            uv: [0, 1].map(|axis| points.iter().map(|p| place(p)[axis]).collect()),
            xi: [2, 3, 4].map(|axis| points.iter().map(|p| below_one(p[axis])).collect()),
            footprint: footprint(cloth),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.uv[0].len()
    }

    pub(super) fn place(&self, k: usize) -> DVec2 {
        DVec2::new(self.uv[0][k], self.uv[1][k])
    }

    fn xi(&self, k: usize) -> [f32; 3] {
        self.xi.each_ref().map(|xi| xi[k])
    }

    /// For each point an estimate of what is reflected to `wo`, whose mean is the albedo: f cos θ over the
    /// density of `wi`, which the first half of the points draws from the BRDF and the other from the
    /// cosine, each weighed by the mean density of both (Veach 1997, section 9.2.2). So nothing that the
    /// BRDF's sampler misses is missed here.
    pub(super) fn reflected(&self, surface: &dyn Surface, tier: Tier, wo: Vec3) -> Vec<Vec3> {
        let count = self.len();
        let half = count / 2;
        let mut wi = self.drawn(surface, tier, wo, half);
        wi.extend((half..count).map(|k| {
            let [a, b, _] = self.xi(k).map(f64::from);
            let w = square_to_cosine_hemisphere(DVec2::new(a, b)).as_vec3();
            w.with_z(w.z.copysign(wo.z))
        }));
        let [f, pdf] = self.evaluated(surface, tier, &wi, wo);
        let weights = (0..count).map(|k| {
            let cos = wi[k].z.abs();
            // Half of the points each; where none was drawn, f is 0.
            let density = 0.5 * (pdf[k].x + cos * FRAC_1_PI);
            if cos > 0.0 && density > 0.0 { f[k] * cos / density } else { Vec3::ZERO }
        });
        weights.collect()
    }

    /// The directions that the BRDF draws for the first `count` points; 0 where it draws none.
    fn drawn(&self, surface: &dyn Surface, tier: Tier, wo: Vec3, count: usize) -> Vec<Vec3> {
        self.samples(surface, tier, wo, count).into_iter().map(|[wi, _]| wi).collect()
    }

    /// The directions and weights that the BRDF draws for the first `count` points; 0 where it draws none.
    pub(super) fn samples(
        &self,
        surface: &dyn Surface,
        tier: Tier,
        wo: Vec3,
        count: usize,
    ) -> Vec<[Vec3; 2]> {
        let own = |sample: Option<selvedge_yarn_brdf::Sample>| {
            sample.map_or([Vec3::ZERO; 2], |sample| [sample.wi, sample.weight])
        };
        match tier {
            Tier::Single => {
                let draw = |k| own(surface.sample(self.place(k), wo, self.xi(k)));
                (0..count).map(draw).collect()
            }
            Tier::Far => {
                let draw = |k| own(surface.far_sample(&self.footprint, wo, self.xi(k)));
                (0..count).map(draw).collect()
            }
            Tier::Batch => {
                let uv = self.uv.each_ref().map(|part| &part[..count]);
                let xi = self.xi.each_ref().map(|part| &part[..count]);
                surface::samples(surface, uv, wo, xi).into_iter().map(own).collect()
            }
        }
    }

    /// f at each of the first points for its own `wi`, and the density of `wi` in all components.
    pub(super) fn evaluated(
        &self,
        surface: &dyn Surface,
        tier: Tier,
        wi: &[Vec3],
        wo: Vec3,
    ) -> [Vec<Vec3>; 2] {
        let count = wi.len();
        match tier {
            Tier::Single => {
                let f = |k| surface.eval(self.place(k), wi[k], wo);
                let pdf = |k| Vec3::splat(surface.pdf(self.place(k), wi[k], wo));
                [(0..count).map(f).collect(), (0..count).map(pdf).collect()]
            }
            Tier::Far => {
                let f = |wi: &Vec3| surface.far_eval(&self.footprint, *wi, wo);
                let pdf = |wi: &Vec3| Vec3::splat(surface.far_pdf(&self.footprint, *wi, wo));
                [wi.iter().map(f).collect(), wi.iter().map(pdf).collect()]
            }
            Tier::Batch => {
                let uv = self.uv.each_ref().map(|part| &part[..count]);
                let mut f = [(); 3].map(|()| vec![0.0; count]);
                surface::with_batch(uv, wi, wo, |points| {
                    surface.eval_batch(points, f.each_mut().map(Vec::as_mut_slice));
                });
                let pdf = surface::densities(surface, uv, wi, wo);
                let f = (0..count).map(|k| Vec3::from_array(f.each_ref().map(|c| c[k])));
                [f.collect(), pdf.into_iter().map(Vec3::splat).collect()]
            }
        }
    }
}

/// A footprint as wide as many repeats.
pub(super) fn footprint(cloth: &Cloth) -> Footprint {
    Footprint { uv: 0.5 * cloth.size(), deviation: 100.0 * cloth.size() }
}

/// A mean, and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Estimate {
    pub(super) mean: DVec3,
    pub(super) error: DVec3,
}

impl Estimate {
    /// That of independent `means`.
    pub(super) fn of(means: &[DVec3]) -> Self {
        let count = means.len() as f64;
        let mean = means.iter().sum::<DVec3>() / count;
        let squares = means.iter().map(|own| (own - mean) * (own - mean)).sum::<DVec3>();
        Self { mean, error: (squares / (count * (count - 1.0).max(1.0))).map(f64::sqrt) }
    }
}

/// The directional albedo of a whole cloth for `wo`, from about `count` points in all.
pub(super) fn albedo(
    surface: &dyn Surface,
    cloth: &Cloth,
    tier: Tier,
    wo: Vec3,
    (seed, count): (u64, u64),
) -> Estimate {
    let means: Vec<DVec3> = (0..REPLICATES)
        .map(|replicate| {
            let points = Points::new(cloth, seed, replicate, count.div_ceil(REPLICATES as u64));
            let weights = points.reflected(surface, tier, wo);
            weights.iter().map(|weight| weight.as_dvec3()).sum::<DVec3>() / points.len() as f64
        })
        .collect();
    Estimate::of(&means)
}
