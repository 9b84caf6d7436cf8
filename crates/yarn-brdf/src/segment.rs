//! One visible piece of yarn: a bent cylinder, and the maps between it and the cloth.
//!
//! The surface of a yarn that rises over its crossings is a piece of a torus (Irawan & Marschner
//! 2012, section 4). `u` is the inclination along its arc, in [−u_max, u_max], and `v` the angle
//! around its section, in [−π/2, π/2]. In the yarn frame (x across, y along, z the normal):
//!
//! ```text
//! n(u, v) = (sin v, sin u cos v, cos u cos v)
//! t(u, v) = cos ψ ∂P/∂u − sin ψ ∂n/∂v
//!         = (−cos v sin ψ,  cos u cos ψ + sin u sin v sin ψ,  −sin u cos ψ + cos u sin v sin ψ)
//! ```
//!
//! with t the fibre tangent. The rectangle that the segment covers on the cloth has coordinates x
//! (across) and y (along), both in [−1, 1].

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use crate::frame::Vector;
use crate::phase::PhaseConstants;
use crate::real::Real;
use crate::yarn::{FILAMENT_U_MAX, Yarn};

/// How the rectangle of a segment is laid on the cylinder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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

/// The constants of one type of yarn, ready for evaluation in precision `R`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Optics<R> {
    pub(crate) mapping: Mapping,
    /// u_max, rad.
    u_max: R,
    pub(crate) sin_u_max: R,
    /// u_max / sin u_max, 1 in the limit of a straight yarn.
    u_max_over_sin: R,
    pub(crate) sin_psi: R,
    pub(crate) cos_psi: R,
    pub(crate) delta: R,
    /// 1/(2δ).
    pub(crate) half_inv_delta: R,
    pub(crate) phase: PhaseConstants<R>,
}

/// The inclination and twist with which `yarn` is shaded, in rad, and whether as filaments.
///
/// A straight piece has u_max = 0; filaments have ψ = 0 and u_max ≥ [`FILAMENT_U_MAX`].
pub(crate) fn shaded_angles(yarn: &Yarn, is_straight: bool) -> (f64, f64) {
    let u_max = if is_straight { 0.0 } else { yarn.u_max };
    if yarn.is_filament() { (u_max.max(FILAMENT_U_MAX), 0.0) } else { (u_max, yarn.psi) }
}

impl<R: Real> Optics<R> {
    pub(crate) fn new(yarn: &Yarn, is_straight: bool, mapping: Mapping) -> Self {
        let (u_max, psi) = shaded_angles(yarn, is_straight);
        let over_sin = if u_max < 1e-4 { 1.0 + u_max * u_max / 6.0 } else { u_max / u_max.sin() };
        Self {
            mapping,
            u_max: R::from_f64(u_max),
            sin_u_max: R::from_f64(u_max.sin()),
            u_max_over_sin: R::from_f64(over_sin),
            sin_psi: R::from_f64(psi.sin()),
            cos_psi: R::from_f64(psi.cos()),
            delta: R::from_f64(yarn.delta),
            half_inv_delta: R::from_f64(0.5 / yarn.delta),
            phase: yarn.phase.constants(),
        }
    }

    /// Along the yarn: (sin u, cos u, (du/dy)/sin u_max) at `y` in [−1, 1].
    #[inline]
    pub(crate) fn along(&self, y: R) -> (R, R, R) {
        match self.mapping {
            Mapping::Arcsine => {
                let sin_u = y * self.sin_u_max;
                let cos_u = cosine(sin_u);
                (sin_u, cos_u, R::one() / cos_u)
            }
            Mapping::Linear => {
                let (sin_u, cos_u) = (y * self.u_max).sin_cos();
                (sin_u, cos_u, self.u_max_over_sin)
            }
        }
    }

    /// Across the yarn: (sin v, cos v, dv/dx) at `x` in [−1, 1].
    #[inline]
    pub(crate) fn across(&self, x: R) -> (R, R, R) {
        match self.mapping {
            Mapping::Arcsine => {
                let cos_v = cosine(x).max(R::from_f64(COS_V_MIN));
                (x, cos_v, R::one() / cos_v)
            }
            Mapping::Linear => {
                let (sin_v, cos_v) = (x * R::from_f64(FRAC_PI_2)).sin_cos();
                (sin_v, cos_v, R::from_f64(FRAC_PI_2))
            }
        }
    }

    /// The coordinate x at which the section has the angle v.
    #[inline]
    pub(crate) fn x_of_v(&self, sin_v: R) -> R {
        match self.mapping {
            Mapping::Arcsine => sin_v,
            Mapping::Linear => asin(sin_v) * R::from_f64(FRAC_2_PI),
        }
    }

    /// The coordinate y at which the arc has the inclination u, for u_max > 0.
    #[inline]
    pub(crate) fn y_of_u(&self, sin_u: R) -> R {
        match self.mapping {
            Mapping::Arcsine => sin_u / self.sin_u_max,
            Mapping::Linear => asin(sin_u) / self.u_max,
        }
    }

    /// The angle v at coordinate `x`, rad.
    pub(crate) fn v_of_x(&self, x: R) -> R {
        match self.mapping {
            Mapping::Arcsine => asin(x),
            Mapping::Linear => x * R::from_f64(FRAC_PI_2),
        }
    }

    /// The inclination u at coordinate `y`, rad.
    pub(crate) fn u_of_y(&self, y: R) -> R {
        match self.mapping {
            Mapping::Arcsine => asin(y * self.sin_u_max),
            Mapping::Linear => y * self.u_max,
        }
    }

    /// The fibre tangent t(u, v).
    #[inline]
    pub(crate) fn tangent(&self, sin_u: R, cos_u: R, sin_v: R, cos_v: R) -> Vector<R> {
        let (sin_psi, cos_psi) = (self.sin_psi, self.cos_psi);
        Vector::new(
            -cos_v * sin_psi,
            cos_u * cos_psi + sin_u * sin_v * sin_psi,
            -sin_u * cos_psi + cos_u * sin_v * sin_psi,
        )
    }

    /// 4 sin u_max · a (R + a cos v)/(w l) for the circular spine that joins the segment's ends.
    ///
    /// With a = w/2 and R sin u_max = l/2 − a sin u_max it is `1 − (w/l) sin u_max (1 − cos v)`:
    /// the area of the cylinder per area of cloth, which neither grows with the length of a float
    /// nor diverges for a straight yarn. `ratio` is w/l.
    #[inline]
    pub(crate) fn area(&self, ratio: R, cos_v: R) -> R {
        R::one() - ratio * self.sin_u_max * (R::one() - cos_v)
    }
}

/// The surface normal n(u, v).
#[inline]
pub(crate) fn normal<R: Real>(sin_u: R, cos_u: R, sin_v: R, cos_v: R) -> Vector<R> {
    Vector::new(sin_v, sin_u * cos_v, cos_u * cos_v)
}

/// 1 where the coordinate `c` lies in the drawn highlight whose centre is at `centre`, both in
/// [−1, 1] (Irawan & Marschner 2012, equation 12): the centre is moved inwards so that the window
/// of half width `delta` stays on the segment and its mean over the segment is always `delta`.
#[inline]
pub(crate) fn in_window<R: Real>(c: R, centre: R, delta: R) -> R::Mask {
    let room = R::one() - delta;
    (centre.clamp_to(-room, room) - c).abs().lt(delta)
}

/// The cosine, ≥ 0, that belongs to the sine `s`.
#[inline]
fn cosine<R: Real>(s: R) -> R {
    ((R::one() - s) * (R::one() + s)).max(R::zero()).sqrt()
}

/// Arcsine of a sine that rounding may have pushed beyond ±1.
#[inline]
fn asin<R: Real>(s: R) -> R {
    s.clamp_to(-R::one(), R::one()).asin()
}
