//! Directions drawn nearly in proportion to the far field, with the exact density they are drawn with.
//!
//! The mean of the densities of all places would be a quadrature. Instead a highlight is drawn as that
//! of one yarn of untwisted fibres that bends further: whatever reflects, there is one inclination
//! u₀ = atan2(H_y, H_z), H = wi + wo, at which such fibres would, so that the map from u₀ and the azimuth
//! about them to `wi` is one to one. u₀ is drawn from a trapezium, that of the sum of two even numbers:
//! within u_max, and within the twist and the roughness. The density is
//!
//! ```text
//! p(u₀) p(φ) / √(H_y² + H_z²)
//! ```
//!
//! A group is chosen by how much it reflects to `wo`, or the cosine for the diffuse.

use core::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3, Vec3};
use selvedge_normalize::warp::square_to_cosine_hemisphere;

use crate::azimuth::Facing;
use crate::density::LEAST_SHARE;
use crate::frame::{Vector, from_yarn, to_yarn};
use crate::phase::Azimuth;
use crate::sampling::Sample;
use crate::segment::{Optics, Spread, normal};
use crate::shader::Shader;
use crate::weave::Side;

use super::Footprint;
use super::group::{Group, Tinted};

/// The symmetric density of the sum of two even numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trapezium {
    /// The greater and the smaller half width, rad.
    wide: f64,
    narrow: f64,
}

/// Greatest inclination that is drawn, rad.
const STEEPEST: f64 = 1.5;

impl Trapezium {
    /// The inclinations at which yarn of these `optics` reflects.
    pub(super) fn of(optics: &Optics<f32>) -> Self {
        let roughness = match optics.spread {
            // An even number of this half width has the standard deviation σ.
            Spread::Rough { inv_variance, .. } => (3.0 / f64::from(inv_variance)).sqrt(),
            Spread::Staple { .. } | Spread::Filament { .. } => 0.0,
        };
        let u_max = f64::from(optics.u_max);
        let spread = f64::from(optics.sin_psi.abs()).min(1.0).asin() + roughness;
        let (wide, narrow) = (u_max.max(spread), u_max.min(spread).max(0.02));
        let scale = (STEEPEST / (wide + narrow)).min(1.0);
        Self { wide: scale * wide.max(narrow), narrow: scale * narrow }
    }

    fn sample(&self, xi: f64) -> f64 {
        let signed = 2.0 * xi - 1.0;
        let level = (self.wide - self.narrow) / self.wide;
        let magnitude = if signed.abs() < level {
            signed.abs() * self.wide
        } else {
            let beyond = 4.0 * self.wide * self.narrow * (1.0 - signed.abs());
            self.wide + self.narrow - beyond.sqrt()
        };
        magnitude.copysign(signed)
    }

    fn density(&self, u: f64) -> f64 {
        let ramp = (self.wide + self.narrow - u.abs()) / (2.0 * self.narrow);
        ramp.clamp(0.0, 1.0) / (2.0 * self.wide)
    }
}

/// How much `wo` sees of the highlight of all groups, and the share of samples for it.
struct Shares {
    highlight: f32,
    share: f64,
}

impl Shader {
    /// A direction for light to `wo` at `footprint`, drawn nearly in proportion to the far field times
    /// cos θ by the three numbers `xi` in [0, 1).
    ///
    /// `None` where nothing is reflected, or the drawn direction is below the surface: such a draw
    /// counts as a sample that reflects nothing.
    #[must_use]
    pub fn far_sample(&self, footprint: &Footprint, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        let toward = Vector::<f32>::of(wo);
        let (side, seen, _) = self.oriented(toward, toward)?;
        let [choice, a, b] = xi.map(|x| f64::from(x).clamp(0.0, 1.0 - f64::EPSILON));
        let shares = self.far_shares(side, footprint, seen);
        let wi = if choice < shares.share {
            let at = (choice / shares.share) as f32 * shares.highlight;
            let group = self.far_choice(side, footprint, seen, at)?;
            let wi = draw(group, to_yarn(seen, group.is_warp), [a, b])?;
            from_yarn(Vector::<f64>::of(wi), group.is_warp)
        } else {
            Vector::<f64>::of(square_to_cosine_hemisphere(DVec2::new(a, b)))
        };
        let wi = if side == Side::Back { wi.turned_over() } else { wi };
        let wi = self.frame.turned_back(wi);
        let wi = DVec3::new(wi.x, wi.y, wi.z).as_vec3();
        let pdf = self.far_pdf(footprint, wi, wo);
        let weight = self.far_eval(footprint, wi, wo) * wi.z.abs() / pdf;
        (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf })
    }

    /// The density, sr⁻¹, with which [`Shader::far_sample`] draws `wi` for `wo` at `footprint`.
    ///
    /// Its integral over `wi` is at most 1, and less by the draws that are not samples.
    #[must_use]
    pub fn far_pdf(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> f32 {
        let (wi, wo) = (Vector::<f32>::of(wi), Vector::<f32>::of(wo));
        let Some((side, wi, wo)) = self.oriented(wi, wo) else { return 0.0 };
        let shares = self.far_shares(side, footprint, wo);
        let diffuse = (1.0 - shares.share) * FRAC_1_PI * f64::from(wi.z);
        let mut highlight = 0.0;
        if shares.share > 0.0 {
            for group in &self.far.sides[side as usize] {
                let seen = self.highlight_albedo(group, footprint, wo);
                if seen > 0.0 {
                    let (wi, wo) = (to_yarn(wi, group.is_warp), to_yarn(wo, group.is_warp));
                    highlight += f64::from(seen / shares.highlight) * density(group, wi, wo);
                }
            }
        }
        (shares.share * highlight + diffuse).min(f32::MAX.into()) as f32
    }

    /// Directional albedo of the far field for `wo`, linear RGB, from tables: that of the highlight is an
    /// upper bound that is good to a few hundredths, with the brighter of both its colours.
    #[must_use]
    pub fn far_albedo(&self, footprint: &Footprint, wo: Vec3) -> Vec3 {
        let wo = Vector::<f32>::of(wo);
        let Some((side, wo, _)) = self.oriented(wo, wo) else { return Vec3::ZERO };
        let groups = self.far.sides[side as usize].iter();
        groups
            .map(|group| {
                let wo = to_yarn(wo, group.is_warp);
                self.with_tinted(group, footprint, |tinted| {
                    group.highlight_albedo(tinted, wo) + group.diffuse_albedo(tinted, wo)
                })
            })
            .sum()
    }

    /// The greatest component of the albedo of a group's highlight, for `wo` in the frame of the cloth.
    fn highlight_albedo(&self, group: &Group, footprint: &Footprint, wo: Vector<f32>) -> f32 {
        let wo = to_yarn(wo, group.is_warp);
        self.with_tinted(group, footprint, |tinted| {
            group.highlight_albedo(tinted, wo).max_element()
        })
    }

    fn far_shares(&self, side: Side, footprint: &Footprint, wo: Vector<f32>) -> Shares {
        let (mut highlight, mut diffuse) = (0.0, 0.0);
        for group in &self.far.sides[side as usize] {
            highlight += self.highlight_albedo(group, footprint, wo);
            let wo = to_yarn(wo, group.is_warp);
            diffuse += self.with_tinted(group, footprint, |tinted| {
                group.diffuse_albedo(tinted, wo).max_element()
            });
        }
        let share = f64::from(highlight / (highlight + diffuse).max(f32::MIN_POSITIVE));
        let is_there = highlight > 0.0;
        Shares {
            highlight,
            share: if is_there { share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE) } else { 0.0 },
        }
    }

    /// The group up to which the highlights' albedos sum up to more than `at`.
    fn far_choice(
        &self,
        side: Side,
        footprint: &Footprint,
        wo: Vector<f32>,
        at: f32,
    ) -> Option<&Group> {
        let (mut sum, mut last) = (0.0, None);
        for group in &self.far.sides[side as usize] {
            let seen = self.highlight_albedo(group, footprint, wo);
            if seen > 0.0 {
                sum += seen;
                last = Some(group);
                if at < sum {
                    break;
                }
            }
        }
        last
    }

    /// What `use_it` makes of the sums of a group, with what textures tell.
    fn with_tinted<T>(
        &self,
        group: &Group,
        footprint: &Footprint,
        use_it: impl FnOnce(&Tinted) -> T,
    ) -> T {
        if group.textured.is_empty() {
            use_it(&group.plain)
        } else {
            use_it(&self.retinted(group, footprint))
        }
    }
}

/// A direction of the yarn frame drawn from the highlight of a group.
fn draw(group: &Group, wo: Vector<f32>, [a, b]: [f64; 2]) -> Option<DVec3> {
    let (sin_u, cos_u) = group.inclinations.sample(a).sin_cos();
    let wo = Vec3::new(wo.x, wo.y, wo.z).as_dvec3();
    let n = DVec3::new(0.0, sin_u, cos_u);
    let t = DVec3::new(0.0, cos_u, -sin_u);
    let (so, q) = (t.dot(wo), n.dot(wo));
    let e1 = (wo - so * t).try_normalize()?;
    let e2 = t.cross(e1);
    let (cos_phi, sin_phi) = group.piece.sampler.sample(b, Facing::new(q, -so, so), n.dot(e2));
    let radius = (1.0 - so * so).max(0.0).sqrt();
    let wi = (radius * (cos_phi * e1 + sin_phi * e2) - so * t).normalize();
    (wi.z > 0.0 && q > 0.0).then_some(wi)
}

/// Its density at `wi`.
fn density(group: &Group, wi: Vector<f32>, wo: Vector<f32>) -> f64 {
    let h = wi.plus(wo);
    let m = f64::from(h.y).hypot(f64::from(h.z));
    let spread = group.inclinations.density(f64::from(h.y).atan2(f64::from(h.z)));
    let (sin_u, cos_u) = ((f64::from(h.y) / m) as f32, (f64::from(h.z) / m) as f32);
    let n = normal(sin_u, cos_u, 0.0, 1.0);
    let (p, q) = (n.dot(wi), n.dot(wo));
    if spread == 0.0 || p <= 0.0 || q <= 0.0 {
        return 0.0;
    }
    let t = Vector::new(0.0, cos_u, -sin_u);
    let facing = Facing::new(q, t.dot(wi), t.dot(wo));
    let density = group.piece.sampler.density(&Azimuth::on_cone(t, wi, wo), facing);
    spread * f64::from(density) / m
}

/// 1/π ∫ (n·wi)⁺ cos θi dwi for a normal with n·z = `z`.
pub(super) fn lit(z: f64) -> f64 {
    let angle = z.clamp(-1.0, 1.0).acos();
    2.0 / (3.0 * PI) * (angle.sin() + (PI - angle) * angle.cos())
}
