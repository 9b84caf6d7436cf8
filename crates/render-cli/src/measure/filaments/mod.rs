//! A yarn of filaments, one by one, beside the piece of yarn that the shader shows (Nelson, McEvoy &
//! Fratarcangeli 2016, figures 7 and 8).
//!
//! # The filaments
//!
//! A [`Strand`] is a yarn that was twisted evenly and then bent along an arc. Each [filament](strand) is
//! a thin cylinder about a true curve: with R the radius of the arc of the yarn's axis, in radii of the
//! yarn, ρ the distance of the filament from that axis and τ the twist,
//!
//! ```text
//! c(u) = ((ρ sin v), (R + ρ cos v) sin u, (R + ρ cos v) cos u),   v = v₀ − τ u,   τ = (R + 1) tan ψ
//! ```
//!
//! so that ψ is the angle that filaments make with the yarn at its crown. Rays from above are
//! [traced](trace) to the first filament that they meet; it scatters light as a rough [fibre] along its
//! own tangent c′. Nothing of this comes from the shader.
//!
//! # What it must converge to
//!
//! With N filaments around the yarn, which touch, their radius is about π cos ψ/N. As N grows:
//!
//! 1. *Place.* Axes lie within a radius of the surface of the yarn, so what a ray meets tends to where it
//!    meets that surface, and the normal of the yarn at the filament to the normal n(u, v) there.
//! 2. *Tangent.* c′ is (R + ρ cos v) ∂P/∂u − ρ τ ∂n/∂v. At ρ = 1 its angle to the yarn is
//!    `tan ψ′ = tan ψ (R + 1)/(R + cos v)`: the shader's t(u, v) at the crown, and at its sides for a yarn
//!    that is bent little, R → ∞. The filaments are a surface of tangents, which mirrors where
//!    `t·(wi + wo) = 0`; that line over the yarn is the streak.
//! 3. *Light.* Below the surface there are more fibres. Of light from `wi` that is scattered at a depth s
//!    below the surface, e^(−s/p) has come there and e^(−s/q) gets out again, p = n·wi, q = n·wo, with
//!    depths measured in mean free paths along t's cone, where both directions make the same angle with
//!    the fibres. An irradiance of 1 across `wi` so gives the radiance
//!
//!    ```text
//!    L = M f_c ∫ e^(−s/p − s/q) ds/q = M f_c p/(p + q)
//!    ```
//!
//!    with M f_c what a fibre scatters. That is Seeliger's law. [`Interior::Mean`] uses the result;
//!    [`Interior::Traced`] knows nothing of it and follows rays through many rings of filaments that
//!    each take a part of the light. As that part goes to 0, depths are crossed in many small steps,
//!    which one by one no longer matter to both ways, and L tends to the same.
//! 4. *The shader.* Its f is the highlight of the piece's area: with dS the yarn's surface and dA that of
//!    the rectangle that the piece takes, f = (dS/dA) M f_c pq/(p + q). Seen from above, q is the share
//!    of dS that is seen, and with [`Mapping::Arcsine`](selvedge_yarn_brdf::Mapping::Arcsine)
//!
//!    ```text
//!    (dS/dA) q = (R + cos v)/(R + 1),     f = L (R + cos v)/(R + 1)
//!    ```
//!
//!    The factor is there because the rectangle has y = (R + 1) sin u all over, where the yarn's surface
//!    is at (R + cos v) sin u: towards its sides the shader moves light away from the middle, and
//!    dims it by as much as it spreads it.
//!
//! So pictures of the two in units of radiance need no factor to be compared, and what is left between
//! them for N → ∞ is of the order 1/R = sin u_max / (l/w − sin u_max), by 2. and 4.: it is greatest for
//! yarn that is bent steeply over a short float, and goes to 0 for long ones.

pub mod fibre;
pub mod patch;
pub mod segment;
pub mod strand;
pub mod trace;

use glam::DVec3;
use selvedge_yarn_brdf::Highlight;

use self::{
    fibre::Fibre,
    patch::{Patch, Streak, angle_between, profile_error},
    segment::Segment,
    strand::{Shape, Strand},
    trace::Interior,
};
use crate::render::sampler::PixelSampler;

/// A yarn under a light, seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The yarn.
    pub shape: Shape,
    /// What it is made of.
    pub fibre: Fibre,
    /// To the light, unit, above the cloth, in the frame of the yarn: x across, y along, z up.
    pub wi: DVec3,
}

/// How large pictures are and from how many points they are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// Pixels across the yarn.
    pub across: usize,
    /// Points of a pixel in either direction.
    pub side: usize,
    /// Chooses the random numbers.
    pub seed: u64,
}

/// How alike two streaks are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// The streak that is compared.
    pub found: Streak,
    /// The streak that it should be.
    pub expected: Streak,
    /// Of their angles, rad, in [0, π/2].
    pub angle: f64,
    /// Of the profiles across the streak: root mean square over the peak.
    pub across: f64,
    /// Of the profiles along the yarn likewise.
    pub along: f64,
    /// All light of the found one over all light of the other.
    pub light: f64,
}

impl Setting {
    /// The piece of yarn as the shader shows it, with this highlight.
    ///
    /// # Errors
    ///
    /// When a parameter is out of the shader's range.
    pub fn shaded(&self, highlight: Highlight, detail: Detail) -> anyhow::Result<Patch> {
        let segment = Segment::new(&self.shape, &self.fibre, highlight)?;
        let length = self.shape.aspect;
        let shade = |[x, y]: [f64; 2], _| segment.brightness([x, y / length], self.wi);
        Ok(Patch::new(detail.across, length, detail.side, shade))
    }

    /// The same as `count` filaments around the yarn, in so many rings, show it.
    pub fn traced(&self, count: u32, rings: usize, interior: Interior, detail: Detail) -> Patch {
        let mut phases = PixelSampler::new([u32::MAX; 2], detail.seed).sample(0);
        let strand = Strand::new(self.shape, count, rings, || phases.next_1d().into());
        Patch::new(detail.across, self.shape.aspect, detail.side, |place, index| {
            let pixel = [index as u32, (index >> 32) as u32];
            let mut sample = PixelSampler::new(pixel, detail.seed).sample(0);
            let random = || sample.next_1d().into();
            trace::radiance(&strand, &self.fibre, interior, place, self.wi, random)
        })
    }
}

impl Likeness {
    /// How alike `found` is to `expected`; `None` if either is dark.
    pub fn new(found: &Patch, expected: &Patch) -> Option<Self> {
        let streak = expected.streak()?;
        let found_streak = found.streak()?;
        let profile = |patch: &Patch| patch.profile(&streak, 1.0, patch.size[0]);
        Some(Self {
            found: found_streak,
            expected: streak,
            angle: angle_between(found_streak.angle, streak.angle),
            across: profile_error(&profile(found), &profile(expected)),
            along: profile_error(&found.rows(), &expected.rows()),
            light: found.mean() / expected.mean(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIBRE: Fibre = Fibre { sigma: 0.1, alpha: 0.05, beta: 4.0 };
    const ROUGH: Highlight = Highlight::Rough { sigma: FIBRE.sigma };
    const DETAIL: Detail = Detail { across: 16, side: 2, seed: 0 };

    fn setting(psi: f64, aspect: f64) -> Setting {
        let (sin, cos) = 0.7f64.sin_cos();
        let shape = Shape { u_max: 0.5, psi, aspect };
        Setting { shape, fibre: FIBRE, wi: DVec3::new(sin, 0.0, cos) }
    }

    fn likeness(setting: &Setting, count: u32) -> Likeness {
        let traced = setting.traced(count, 1, Interior::Mean, DETAIL);
        Likeness::new(&traced, &setting.shaded(ROUGH, DETAIL).unwrap()).unwrap()
    }

    #[test]
    fn filaments_converge_to_the_shaded_piece() {
        for psi in [0.3, -0.5] {
            let setting = setting(psi, 4.0);
            let [few, many] = [16, 512].map(|count| likeness(&setting, count));
            assert!(many.angle < 0.01 && many.across < 0.03, "{psi}: {many:?}");
            assert!((many.light - 1.0).abs() < 0.03, "{psi}: {many:?}");
            assert!(few.across > 2.0 * many.across, "{psi}: {few:?}, {many:?}");
            assert!((many.found.angle > 0.0) == (psi > 0.0), "{psi}: {many:?}");
        }
    }

    #[test]
    fn what_is_left_falls_with_the_length_of_the_float() {
        let [short, long] = [2.0, 8.0].map(|aspect| {
            let setting = setting(0.5, aspect);
            let edge = |likeness: Likeness| likeness.across;
            edge(likeness(&setting, 1024))
        });
        assert!(long < 0.6 * short, "{short} {long}");
    }

    #[test]
    fn attenuation_of_traced_filaments_is_seeligers() {
        let setting = setting(0.5, 3.0);
        let detail = Detail { side: 6, ..DETAIL };
        let shaded = setting.shaded(ROUGH, detail).unwrap();
        let light = |taken: f64| {
            let rings = (5.0 / taken) as usize;
            let traced = setting.traced(1024, rings, Interior::Traced(taken), detail);
            Likeness::new(&traced, &shaded).unwrap().light
        };
        let [opaque, half, clear] = [1.0, 0.5, 0.1].map(light);
        // Light that enters where it is seen to leave is the less hindered the fewer filaments take it.
        assert!(opaque > 1.5 && half < opaque && half > 1.15, "{opaque} {half}");
        assert!((clear - 1.0).abs() < 0.08, "{clear}");
    }
}
