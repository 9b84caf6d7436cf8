//! One visible piece of yarn: a bent cylinder, and the maps between it and the cloth.
//!
//! The surface of a yarn that rises over its crossings is a bent cylinder of radius a about a spine
//! with radius of curvature R(u) (Irawan & Marschner 2012, section 4). `u` is the inclination along
//! its arc, in [−u_max, u_max], and `v` the angle around its section, in [−π/2, π/2]. In the yarn
//! frame (x across, y along, z the normal):
//!
//! ```text
//! n(u, v) = (sin v, sin u cos v, cos u cos v)
//! t(u, v) = cos ψ ∂P/∂u − sin ψ ∂n/∂v
//!         = (−cos v sin ψ,  cos u cos ψ + sin u sin v sin ψ,  −sin u cos ψ + cos u sin v sin ψ)
//! dS      = a (R(u) + a cos v) du dv
//! ```
//!
//! with t the fibre tangent. The rectangle that the segment covers on the cloth has coordinates x
//! (across) and y (along), both in [−1, 1].
//!
//! The spine is a conic whose ends have the inclination ±u_max and lie l/2 − a sin u_max from the
//! middle, with a = w/2 (Irawan 2008, section 5.3; κ is its curvature). Circle, ellipse, parabola
//! and hyperbola have one rational form: with r = 1 + κ (1 + cot u_max) and c = (r|r| − 1) sin² u_max,
//!
//! ```text
//! R(u) sin u_max / (l/2 − a sin u_max) = S(u) = √(1 + c) (1 + c t²)^(−3/2),   t = sin u / sin u_max
//! ```
//!
//! c > −1 exactly when κ > −1, and c is finite for u_max → 0. So the area of yarn per area of cloth,
//! of which every highlight is a multiple, is
//!
//! ```text
//! 4 sin u_max · a (R + a cos v)/(w l) = S − (w/l) sin u_max (S − cos v)
//! ```

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use crate::frame::Vector;
use crate::parameter::KAPPA_MIN;
use crate::phase::PhaseConstants;
use crate::real::{Real, Scalar};
use crate::yarn::{FILAMENT_U_MAX, Highlight, Yarn};

/// How the rectangle of a segment is laid on the cylinder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Mapping {
    /// The orthographic view of the bent cylinder, `x = sin v`, `y = sin u / sin u_max` (Nelson,
    /// McEvoy & Fratarcangeli 2016, section 4.2).
    ///
    /// Its Jacobian dv/dx grows without bound at the edges of the yarn; it is cut at 1e-4 rad from
    /// them. Filaments normalised pointwise are therefore nearly black: choose `Linear` for those.
    #[default]
    Arcsine,
    /// Uniform in angle, `x = 2v/π`, `y = u/u_max` (Irawan & Marschner 2012).
    Linear,
}

/// Greatest |v|, as its cosine: π/2 − 1e-4.
pub(crate) const COS_V_MIN: f64 = 1e-4;

/// What spreads the highlight, ready for evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Spread<R> {
    /// Twisted fibres under a window of half width δ; `strength` is 1/(2δ |sin ψ|).
    Staple { delta: R, strength: R },
    /// Untwisted fibres under a window of half width δ; `strength` is 1/(2δ sin u_e), and `fade`
    /// 1/(ss u_max), over the length in rad over which the highlight fades out at either end.
    Filament { delta: R, strength: R, fade: Option<R> },
    /// Rough fibres; `inv_variance` is 1/σ² and `scale` 1/(σ² (1 − e^{−2/σ²})).
    Rough { inv_variance: R, scale: R },
}

/// The constants of one type of yarn, ready for evaluation in precision `R`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Optics<R> {
    pub(crate) mapping: Mapping,
    /// u_max, rad.
    pub(crate) u_max: R,
    pub(crate) sin_u_max: R,
    inv_sin_u_max: R,
    /// u_max / sin u_max, 1 in the limit of a straight yarn.
    u_max_over_sin: R,
    pub(crate) sin_psi: R,
    pub(crate) cos_psi: R,
    /// The inclination at the ends of the conic, whose outer parts are straight: its sine, and one
    /// over that.
    pub(crate) sin_conic: R,
    pub(crate) inv_sin_conic: R,
    /// (c, √(1 + c)) of a spine that is not a circle.
    pub(crate) conic: Option<(R, R)>,
    pub(crate) spread: Spread<R>,
    pub(crate) phase: PhaseConstants<R>,
}

/// Least inclination with which a yarn whose spine is no circle is shaded, rad.
const CONIC_U_MAX: f64 = 1e-6;

/// The inclination and twist with which `yarn` is shaded, in rad.
///
/// A straight piece has u_max = 0; filaments have ψ = 0 and u_max ≥ [`FILAMENT_U_MAX`].
pub(crate) fn shaded_angles(yarn: &Yarn, is_straight: bool) -> (f64, f64) {
    let u_max = if is_straight { 0.0 } else { yarn.u_max };
    // At 0 there would be no telling where on the conic a point lies.
    let u_max = if yarn.kappa == 0.0 || is_straight { u_max } else { u_max.max(CONIC_U_MAX) };
    if yarn.is_filament() { (u_max.max(FILAMENT_U_MAX), 0.0) } else { (u_max, yarn.psi) }
}

impl<R: Scalar> Optics<R> {
    pub(crate) fn new(yarn: &Yarn, is_straight: bool, mapping: Mapping) -> Self {
        let (u_max, psi) = shaded_angles(yarn, is_straight);
        let over_sin = if u_max < 1e-4 { 1.0 + u_max * u_max / 6.0 } else { u_max / u_max.sin() };
        let (spread, conic_end) = match yarn.highlight {
            Highlight::Rough { sigma } => {
                let variance = sigma * sigma;
                let scale = 1.0 / (variance * -(-2.0 / variance).exp_m1());
                let inv_variance = R::from_f64(1.0 / variance);
                (Spread::Rough { inv_variance, scale: R::from_f64(scale) }, u_max)
            }
            Highlight::Window { delta } => {
                let strength = |sine: f64| R::from_f64(0.5 / (delta * sine));
                let delta = R::from_f64(delta);
                if yarn.is_filament() {
                    let (start, length) = ((1.0 - yarn.smoothing) * u_max, yarn.smoothing * u_max);
                    let fade = (length > 0.0).then(|| R::from_f64(1.0 / length));
                    (Spread::Filament { delta, strength: strength(start.sin()), fade }, start)
                } else {
                    (Spread::Staple { delta, strength: strength(psi.sin().abs()) }, u_max)
                }
            }
        };
        let (sin_conic, cos_conic) = conic_end.sin_cos();
        let conic = (yarn.kappa != 0.0 && !is_straight).then(|| {
            // r sin u_max, and the square of that with its sign.
            let kappa = yarn.kappa.max(KAPPA_MIN);
            let r = sin_conic + kappa * (sin_conic + cos_conic);
            let c = r * r.abs() - sin_conic * sin_conic;
            (R::from_f64(c), R::from_f64((1.0 + c).sqrt()))
        });
        Self {
            mapping,
            u_max: R::from_f64(u_max),
            sin_u_max: R::from_f64(u_max.sin()),
            inv_sin_u_max: R::from_f64(1.0 / u_max.sin().max(1e-12)),
            u_max_over_sin: R::from_f64(over_sin),
            sin_psi: R::from_f64(psi.sin()),
            cos_psi: R::from_f64(psi.cos()),
            sin_conic: R::from_f64(sin_conic),
            // Finite for a straight yarn, whose sin u is 0.
            inv_sin_conic: R::from_f64(1.0 / sin_conic.max(1e-12)),
            conic,
            spread,
            phase: yarn.phase.constants(),
        }
    }

    /// Along the yarn: (sin u, cos u, (du/dy)/sin u_max) at `y` in [−1, 1].
    #[inline(always)]
    pub(crate) fn along<L: Real<Scalar = R>>(&self, y: L) -> (L, L, L) {
        match self.mapping {
            Mapping::Arcsine => {
                let sin_u = y * self.sin_u_max;
                let cos_u = cosine(sin_u);
                (sin_u, cos_u, y.one() / cos_u)
            }
            Mapping::Linear => {
                let (sin_u, cos_u) = (y * self.u_max).sin_cos();
                (sin_u, cos_u, y.splat(self.u_max_over_sin))
            }
        }
    }

    /// Across the yarn: (sin v, cos v, dv/dx) at `x` in [−1, 1].
    #[inline(always)]
    pub(crate) fn across<L: Real<Scalar = R>>(&self, x: L) -> (L, L, L) {
        match self.mapping {
            Mapping::Arcsine => {
                let cos_v = cosine(x).max(x.of(COS_V_MIN));
                (x, cos_v, x.one() / cos_v)
            }
            Mapping::Linear => {
                let (sin_v, cos_v) = (x * x.of(FRAC_PI_2)).sin_cos();
                (sin_v, cos_v, x.of(FRAC_PI_2))
            }
        }
    }

    /// The coordinate x at which the section has the angle v.
    #[inline(always)]
    pub(crate) fn x_of_v<L: Real<Scalar = R>>(&self, sin_v: L) -> L {
        match self.mapping {
            Mapping::Arcsine => sin_v,
            Mapping::Linear => asin(sin_v) * sin_v.of(FRAC_2_PI),
        }
    }

    /// The coordinate y at which the arc has the inclination u, for u_max > 0.
    #[inline(always)]
    pub(crate) fn y_of_u<L: Real<Scalar = R>>(&self, sin_u: L) -> L {
        match self.mapping {
            Mapping::Arcsine => sin_u * self.inv_sin_u_max,
            Mapping::Linear => asin(sin_u) / sin_u.splat(self.u_max),
        }
    }

    /// The angle v at coordinate `x`, rad.
    #[inline(always)]
    pub(crate) fn v_of_x<L: Real<Scalar = R>>(&self, x: L) -> L {
        match self.mapping {
            Mapping::Arcsine => asin(x),
            Mapping::Linear => x * x.of(FRAC_PI_2),
        }
    }

    /// The inclination u at coordinate `y`, rad.
    #[inline(always)]
    pub(crate) fn u_of_y<L: Real<Scalar = R>>(&self, y: L) -> L {
        match self.mapping {
            Mapping::Arcsine => asin(y * self.sin_u_max),
            Mapping::Linear => y * self.u_max,
        }
    }

    /// The fibre tangent t(u, v).
    #[inline(always)]
    pub(crate) fn tangent<L: Real<Scalar = R>>(
        &self,
        sin_u: L,
        cos_u: L,
        sin_v: L,
        cos_v: L,
    ) -> Vector<L> {
        let (sin_psi, cos_psi) = (self.sin_psi, self.cos_psi);
        Vector::new(
            -cos_v * sin_psi,
            cos_u * cos_psi + sin_u * sin_v * sin_psi,
            -sin_u * cos_psi + cos_u * sin_v * sin_psi,
        )
    }

    /// S(u), 1 for a circular spine.
    #[inline(always)]
    pub(crate) fn bend<L: Real<Scalar = R>>(&self, sin_u: L) -> L {
        match self.conic {
            None => sin_u.one(),
            Some((c, top)) => {
                let t = (sin_u * self.inv_sin_conic).abs().min(sin_u.one());
                let d = t * c * t + t.one();
                t.splat(top) / (d * d.sqrt())
            }
        }
    }

    /// 4 sin u_max · a (R + a cos v)/(w l), the area of yarn per area of cloth: it neither grows
    /// with the length of a float nor diverges for a straight yarn. `ratio` is w/l, and `bend` S(u).
    #[inline(always)]
    pub(crate) fn area<L: Real<Scalar = R>>(&self, ratio: L, bend: L, cos_v: L) -> L {
        bend - ratio * self.sin_conic * (bend - cos_v)
    }

    /// How much of the highlight of filaments is left at the inclination u (Irawan & Marschner 2012,
    /// equation 9): 1, and over the last share of the segment a smooth step to 0.
    #[inline(always)]
    pub(crate) fn fade<L: Real<Scalar = R>>(&self, sin_u: L) -> L {
        let Spread::Filament { fade: Some(inv_length), .. } = self.spread else {
            return sin_u.one();
        };
        // From the end, where it vanishes, so that it does so without cancelling.
        let rest = sin_u.splat(self.u_max) - asin(sin_u).abs();
        let t = (rest * inv_length).clamp_to(sin_u.zero(), sin_u.one());
        t * t * (t.of(3.0) - t.of(2.0) * t)
    }
}

impl Optics<f64> {
    /// The inclination from which on the highlight of filaments fades out, rad; u_max if it does not.
    pub(crate) fn fades_from(&self) -> f64 {
        match self.spread {
            Spread::Filament { fade: Some(inv_length), .. } => self.u_max - 1.0 / inv_length,
            _ => self.u_max,
        }
    }

    /// Whether the spine is an arc of a circle.
    pub(crate) fn is_circle(&self) -> bool {
        self.conic.is_none()
    }

    /// Whether the spine is nearly an arc of a circle: S changes by less than a factor of 2.2.
    pub(crate) fn is_round(&self) -> bool {
        self.conic.is_none_or(|(c, _)| (-0.4..=0.7).contains(&c))
    }

    /// The inclination up to which a spine bends that is nearly straight further out, rad: that at
    /// 1½ radii from its middle; u_max if the spine is rounder.
    pub(crate) fn sharp_below(&self) -> f64 {
        match self.conic {
            // t = w/√(1 + c − c w²) at w = 1.5 √(1 + c).
            Some((c, _)) if c < -0.5 => (1.5 / (1.0 - 2.25 * c).sqrt() * self.sin_conic).asin(),
            _ => self.u_max,
        }
    }

    /// Position along the spine at the inclination u, as the inclination, rad, at which a circle of
    /// the same ends is there: on the conic `sin η = sin u √((1 + c)/(1 + c t²))`, and beyond it as fast
    /// as at its end.
    pub(crate) fn spine_of_u(&self, u: f64) -> f64 {
        let Some((c, top)) = self.conic else { return u };
        let end = self.fades_from();
        if u.abs() < end {
            let t = u.sin() * self.inv_sin_conic;
            (u.sin() * top / (1.0 + c * t * t).sqrt()).clamp(-1.0, 1.0).asin()
        } else {
            (end + (u.abs() - end) / (1.0 + c)).copysign(u)
        }
    }

    /// The inverse of [`Optics::spine_of_u`], and du per step along the spine.
    pub(crate) fn u_of_spine(&self, eta: f64) -> (f64, f64) {
        let Some((c, top)) = self.conic else { return (eta, 1.0) };
        let end = self.fades_from();
        if eta.abs() < end {
            let (sin, cos) = eta.sin_cos();
            let w = sin * self.inv_sin_conic;
            let sin_u = (sin / (top * top - c * w * w).sqrt()).clamp(-1.0, 1.0);
            let t = sin_u * self.inv_sin_conic;
            let d = 1.0 + c * t * t;
            let u = sin_u.asin();
            // dη/du is S cos u / cos η.
            (u, d * d.sqrt() / top * cos / u.cos())
        } else {
            ((end + (eta.abs() - end) * (1.0 + c)).copysign(eta), 1.0 + c)
        }
    }
}

/// The surface normal n(u, v).
#[inline(always)]
pub(crate) fn normal<R: Real>(sin_u: R, cos_u: R, sin_v: R, cos_v: R) -> Vector<R> {
    Vector::new(sin_v, sin_u * cos_v, cos_u * cos_v)
}

/// A place on the yarn where fibres reflect `wi` into `wo`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Root<R: Real> {
    pub(crate) sin_u: R,
    pub(crate) cos_u: R,
    pub(crate) sin_v: R,
    pub(crate) cos_v: R,
    /// n·wi.
    pub(crate) p: R,
    /// n·wo.
    pub(crate) q: R,
    /// Whether it exists, lies on the upper half of the yarn and sees both directions; if not, the
    /// numbers mean nothing.
    pub(crate) is_lit: R::Mask,
}

impl<R: Real> Root<R> {
    /// The fibre tangent there.
    #[inline(always)]
    pub(crate) fn tangent(&self, optics: &Optics<R::Scalar>) -> Vector<R> {
        optics.tangent(self.sin_u, self.cos_u, self.sin_v, self.cos_v)
    }
}

/// 1 where the coordinate `c` lies in the drawn highlight whose centre is at `centre`, both in
/// [−1, 1] (Irawan & Marschner 2012, equation 12): the centre is moved inwards so that the window
/// of half width `delta` stays on the segment and its mean over the segment is always `delta`.
#[inline(always)]
pub(crate) fn in_window<R: Real>(c: R, centre: R, delta: R::Scalar) -> R::Mask {
    let delta = c.splat(delta);
    let room = c.one() - delta;
    (centre.clamp_to(-room, room) - c).abs().lt(delta)
}

/// The cosine, ≥ 0, that belongs to the sine `s`.
#[inline(always)]
pub(crate) fn cosine<R: Real>(s: R) -> R {
    ((s.one() - s) * (s.one() + s)).max(s.zero()).sqrt()
}

/// Arcsine of a sine that rounding may have pushed beyond ±1.
#[inline(always)]
fn asin<R: Real>(s: R) -> R {
    s.clamp_to(-s.one(), s.one()).asin()
}
