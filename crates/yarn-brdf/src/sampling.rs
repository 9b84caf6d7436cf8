//! Directions drawn in proportion to the BRDF, with the exact density they are drawn with.
//!
//! The diffuse lobe draws from the cosine. The highlight draws a place of the yarn whose highlight
//! covers the point (an angle v of twisted or u of untwisted fibres, evenly; for rough fibres the
//! point itself and an inclination about the fibre) and an azimuth about its fibre on the side that the
//! yarn faces; the change of variables to the direction is the geometry factor, so its density is
//!
//! ```text
//! staple    p(φ) / (Δv (p+q) |sin ψ|)      filament   p(φ) / (Δu √(H_y² + H_z²))      rough   p(φ) M
//! ```
//!
//! and f cos θ over it is bounded. A direction that leaves through the cloth is no sample: it is not
//! folded back, which would add a second branch to the density. One of the lobes is chosen at random
//! and the density is that of both (Veach 1997, section 9.2.4).

use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::{DVec2, DVec3, Vec3};
use selvedge_normalize::warp::square_to_cosine_hemisphere;

use crate::albedo::window;
use crate::azimuth::Facing;
use crate::cloth::Combination;
use crate::frame::{Vector, from_yarn, to_yarn};
use crate::phase::Azimuth;
use crate::place::Place;
use crate::rough::longitudinal;
use crate::segment::{Spread, in_window, normal};
use crate::shader::Shader;
use crate::weave::Side;
use crate::{filament, staple};

/// A direction drawn by [`Shader::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The direction, unit, in the shading frame, on the side of `wo`.
    pub wi: Vec3,
    /// f cos θi / pdf, linear RGB.
    pub weight: Vec3,
    /// The density with which it was drawn, sr⁻¹.
    pub pdf: f32,
}

/// Least share of samples for a lobe that reflects anything.
const LEAST_SHARE: f64 = 0.1;

impl Shader {
    /// A direction for light to `wo` at `uv` (m), drawn nearly in proportion to f cos θ by the three
    /// numbers `xi` in [0, 1).
    ///
    /// `None` where nothing is reflected, or the drawn direction is below the surface: such a draw
    /// counts as a sample that reflects nothing.
    #[must_use]
    pub fn sample(&self, uv: DVec2, wo: Vec3, xi: [f32; 3]) -> Option<Sample> {
        self.with_seen(uv, wo, |seen| {
            let [choice, a, b] = xi.map(|x| f64::from(x).clamp(0.0, 1.0 - f64::EPSILON));
            let wi = if choice < seen.share {
                draw_highlight(seen, [choice / seen.share, a, b])?
            } else {
                square_to_cosine_hemisphere(DVec2::new(a, b))
            };
            let wi = self.to_surface(seen, wi);
            let wi_yarn = self.to_yarn(seen, wi)?;
            let pdf = density(seen, wi_yarn) as f32;
            let [specular, diffuse] = self.lobes_at(seen.place, wi_yarn, seen.wo).map(Vec3::from);
            let weight = (specular + diffuse) * wi.z.abs() / pdf;
            (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf })
        })?
    }

    /// The density, sr⁻¹, with which [`Shader::sample`] draws `wi` for `wo` at `uv` (m).
    ///
    /// Its integral over `wi` is at most 1, and less by the draws that are not samples.
    #[must_use]
    pub fn pdf(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> f32 {
        let pdf =
            self.with_seen(uv, wo, |seen| Some(density(seen, self.to_yarn(seen, wi)?) as f32));
        pdf.flatten().unwrap_or(0.0)
    }

    /// Directional albedo for `wo`, linear RGB: the share of the light to `wo` that [`Shader::eval`]
    /// reflects, from tables and closed forms, for little more than a look-up.
    ///
    /// That of the highlight is averaged over the segment that shows at `uv` (m), an upper bound that is
    /// good to a few hundredths, with the brighter of both its colours. That of the diffuse is exact if
    /// it is [`Diffuse::Flat`](crate::Diffuse::Flat); by the yarn's normal it is that of the point.
    /// [`Shader::albedo_of_segment`] takes longer and is a yardstick.
    #[must_use]
    pub fn albedo(&self, uv: DVec2, wo: Vec3) -> Vec3 {
        let albedo = self.with_seen(uv, wo, |seen| {
            let (specular, diffuse) = self.lobe_albedos(seen);
            let [of_peak, of_uniform] = seen.place.look.specular.map(Vec3::from);
            of_peak.max(of_uniform) * specular + Vec3::from(seen.place.look.color) * diffuse
        });
        albedo.unwrap_or(Vec3::ZERO)
    }

    /// What `use_it` makes of what `wo` sees at `uv`; `None` if that is nothing.
    fn with_seen<T>(&self, uv: DVec2, wo: Vec3, use_it: impl FnOnce(&Seen<'_>) -> T) -> Option<T> {
        let wo = Vector::<f32>::of(wo);
        let (side, wo, _) = self.oriented(wo, wo)?;
        self.with_place(&self.materials.single, uv, side, |place| {
            let wo = to_yarn(wo, place.segment.is_warp);
            let mut seen = Seen { side, place, wo, span: [0.0; 2], share: 0.0 };
            seen.span = seen.span();
            if place.has_highlight && seen.span[1] > seen.span[0] {
                let (specular, diffuse) = self.lobe_albedos(&seen);
                let bright = |color: [f32; 3]| color.into_iter().fold(0.0, f32::max);
                let amount = bright(place.look.specular[0]).max(bright(place.look.specular[1]));
                let (specular, diffuse) = (amount * specular, bright(place.look.color) * diffuse);
                let share = f64::from(specular / (specular + diffuse).max(f32::MIN_POSITIVE));
                seen.share = share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
            }
            use_it(&seen)
        })
    }

    /// How much the highlight and the diffuse lobe reflect to `wo` of white light, for colours of 1.
    fn lobe_albedos(&self, seen: &Seen<'_>) -> (f32, f32) {
        let place = seen.place;
        let (piece, ratio) = (place.piece, place.at[2]);
        let divisor = piece.reflectance.divisor(ratio);
        let table = piece.reflectance.at(seen.wo).at(ratio);
        let specular = if place.has_highlight { table / divisor } else { 0.0 };
        let left = |albedo: f32| (1.0 - place.amount / divisor * albedo).max(0.0);
        // Over all wi, what the highlight leaves of the light averages to what it leaves of it all, by
        // which the flat diffuse is divided.
        let [share, of_all] = match self.combination {
            _ if !place.has_highlight => [1.0; 2],
            Combination::Lerp => [1.0 - place.amount, 1.0],
            Combination::Layered => [left(table), left(piece.mean.at(ratio))],
        };
        let shape = piece.diffuse_scale.map_or(1.0, |scale| {
            let (sin_u, cos_u, _) = piece.optics.along(place.at[1]);
            let (sin_v, cos_v, _) = piece.optics.across(place.at[0]);
            let n = normal(sin_u, cos_u, sin_v, cos_v);
            // 1/π ∫ (n·wi) cos θi dwi, both at least 0, with n at the angle γ from the normal.
            let angle = n.z.clamp(-1.0, 1.0).acos();
            let lit = (angle.sin() + (PI as f32 - angle) * angle.cos()) * (2.0 / (3.0 * PI)) as f32;
            of_all * scale * lit * n.dot(seen.wo).max(0.0)
        });
        (specular * place.look.opacity, share * shape * place.look.opacity)
    }

    /// A direction of the yarn frame in the shading frame.
    fn to_surface(&self, seen: &Seen<'_>, w: DVec3) -> Vec3 {
        let w = from_yarn(Vector::<f64>::of(w), seen.place.segment.is_warp);
        let w = if seen.side == Side::Back { w.turned_over() } else { w };
        let w = self.frame.turned_back(w);
        DVec3::new(w.x, w.y, w.z).as_vec3()
    }

    /// A direction of the shading frame in the yarn frame, if it is on the side of `wo`.
    fn to_yarn(&self, seen: &Seen<'_>, w: Vec3) -> Option<Vector<f32>> {
        let w = Vector::<f32>::of(w);
        let (side, w, _) = self.oriented(w, w)?;
        (side == seen.side).then(|| to_yarn(w, seen.place.segment.is_warp))
    }
}

/// A direction of the yarn frame drawn from the highlight.
fn draw_highlight(seen: &Seen<'_>, [a, b, c]: [f64; 3]) -> Option<DVec3> {
    let Place { piece, at: [x, y, _], .. } = *seen.place;
    let optics = &piece.optics;
    let [from, to] = seen.span;
    let (sin, cos) = (from + (to - from) * a).sin_cos();
    let drawn = (sin as f32, cos as f32);
    let (along, across) = (optics.along(y), optics.across(x));
    let (along, across) = ((along.0, along.1), (across.0, across.1));
    let ((sin_u, cos_u), (sin_v, cos_v)) = match optics.spread {
        Spread::Staple { .. } => (along, drawn),
        Spread::Filament { .. } => (drawn, across),
        Spread::Rough { .. } => (along, across),
    };
    let n = vector(normal(sin_u, cos_u, sin_v, cos_v));
    let t = vector(optics.tangent(sin_u, cos_u, sin_v, cos_v));
    let wo = vector(seen.wo);
    let so = t.dot(wo);
    let si = match optics.spread {
        Spread::Rough { inv_variance, .. } => draw_inclination(so, inv_variance.into(), a, c),
        Spread::Staple { .. } | Spread::Filament { .. } => -so,
    };
    let e1 = (wo - so * t).try_normalize().unwrap_or_else(|| t.any_orthonormal_vector());
    let e2 = t.cross(e1);
    let q = n.dot(wo);
    let (cos_phi, sin_phi) = piece.sampler.sample(b, Facing::new(q, si, so), n.dot(e2));
    let radius = (1.0 - si * si).max(0.0).sqrt();
    let wi = (si * t + radius * (cos_phi * e1 + sin_phi * e2)).normalize();
    (wi.z > 0.0 && q > 0.0).then_some(wi)
}

/// The density of both lobes at `wi`, in the yarn frame.
fn density(seen: &Seen<'_>, wi: Vector<f32>) -> f64 {
    let diffuse = (1.0 - seen.share) * FRAC_1_PI * f64::from(wi.z);
    if seen.share == 0.0 {
        return diffuse;
    }
    // No more than the f32 holds that it is told in.
    (seen.share * highlight_density(seen, wi) + diffuse).min(f32::MAX.into())
}

/// In the precision of the BRDF and by the same functions, so that both tell the same edges of the
/// drawn highlight.
fn highlight_density(seen: &Seen<'_>, wi: Vector<f32>) -> f64 {
    let Place { piece, at: [x, y, _], .. } = *seen.place;
    let (optics, wo) = (&piece.optics, seen.wo);
    let [from, to] = seen.span;
    let azimuth_density = |azimuth: &Azimuth<f32>, t: Vector<f32>, q: f32| {
        let facing = Facing::new(q.into(), t.dot(wi).into(), t.dot(wo).into());
        piece.sampler.density(azimuth, facing)
    };
    match optics.spread {
        Spread::Staple { delta, .. } => {
            let (sin_u, cos_u, _) = optics.along(y);
            let root = staple::root(optics, sin_u, cos_u, wi, wo);
            if !(root.is_lit && in_window(x, optics.x_of_v(root.sin_v), delta)) {
                return 0.0;
            }
            let t = root.tangent(optics);
            // Not in f32, where the product of a grazing direction's would be 0.
            let sum = f64::from(root.p) + f64::from(root.q);
            let spread = (to - from) * sum * f64::from(optics.sin_psi.abs());
            azimuth_density(&Azimuth::on_cone(t, wi, wo), t, root.q) / spread
        }
        Spread::Filament { delta, .. } => {
            let (sin_v, cos_v, _) = optics.across(x);
            let (root, m) = filament::root(optics, sin_v, cos_v, wi, wo);
            if !(root.is_lit && in_window(y, optics.y_of_u(root.sin_u), delta)) {
                return 0.0;
            }
            let t = root.tangent(optics);
            let spread = (to - from) * f64::from(m);
            azimuth_density(&Azimuth::on_cone(t, wi, wo), t, root.q) / spread
        }
        Spread::Rough { inv_variance, scale } => {
            let (sin_u, cos_u, _) = optics.along(y);
            let (sin_v, cos_v, _) = optics.across(x);
            let n = normal(sin_u, cos_u, sin_v, cos_v);
            let q = n.dot(wo);
            if n.dot(wi) <= 0.0 || q <= 0.0 {
                return 0.0;
            }
            let t = optics.tangent(sin_u, cos_u, sin_v, cos_v);
            let spread = longitudinal([inv_variance, scale], t, wi, wo);
            azimuth_density(&Azimuth::about(t, wi, wo), t, q) * f64::from(spread)
        }
    }
}

/// What a direction sees at a position.
struct Seen<'a> {
    side: Side,
    place: &'a Place<'a, f32>,
    /// In the yarn frame.
    wo: Vector<f32>,
    /// The angles of the yarn, v or u, rad, from which the highlight may come; empty if there are
    /// none. [0, 1] for rough fibres, which reflect from the point itself.
    span: [f64; 2],
    /// The share of samples drawn from the highlight.
    share: f64,
}

impl Seen<'_> {
    fn span(&self) -> [f64; 2] {
        let Place { piece, at: [x, y, _], .. } = *self.place;
        let (optics, wo) = (&piece.optics, self.wo);
        match optics.spread {
            Spread::Staple { delta, .. } => {
                let (low, high) = window(x.into(), delta.into());
                let (sin_u, cos_u, _) = optics.along(y);
                // The half of the section that faces `wo`.
                let centre = f64::from(wo.x.atan2(sin_u * wo.y + cos_u * wo.z));
                let v_of_x = |x: f64| f64::from(optics.v_of_x(x as f32));
                [v_of_x(low).max(centre - FRAC_PI_2), v_of_x(high).min(centre + FRAC_PI_2)]
            }
            Spread::Filament { delta, .. } => {
                let (low, high) = window(y.into(), delta.into());
                [low, high].map(|y| optics.u_of_y(y as f32).into())
            }
            Spread::Rough { .. } => {
                let (sin_u, cos_u, _) = optics.along(y);
                let (sin_v, cos_v, _) = optics.across(x);
                [0.0, f64::from(u8::from(normal(sin_u, cos_u, sin_v, cos_v).dot(wo) > 0.0))]
            }
        }
    }
}

/// The sine of an inclination about a rough fibre, drawn from M(s_i, s_o) for fixed s_o = `so` by
/// two numbers in [0, 1) (d'Eon, Marschner & Hanika 2013, section 4: a direction about the cone,
/// from a von Mises–Fisher lobe).
fn draw_inclination(so: f64, inv_variance: f64, a: f64, b: f64) -> f64 {
    // 1 + v ln(1 − a (1 − e^{−2/v})).
    let cosine = 1.0 + (a * (-2.0 * inv_variance).exp_m1()).ln_1p() / inv_variance;
    let cosine = cosine.clamp(-1.0, 1.0);
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    let co = ((1.0 - so) * (1.0 + so)).max(0.0).sqrt();
    (-so * cosine + co * sine * (2.0 * PI * b).cos()).clamp(-1.0, 1.0)
}

fn vector(v: Vector<f32>) -> DVec3 {
    Vec3::new(v.x, v.y, v.z).as_dvec3()
}
