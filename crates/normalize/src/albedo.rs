//! Albedo: the fraction of the incoming light that a scattering function reflects.
//!
//! The *directional* albedo is the fraction reflected of light from one direction,
//!
//! ```text
//! ρ(x, wi) = ∫ f(x, wi, wo) cos θo dwo ,
//! ```
//!
//! its mean over surface points is the *averaged*, its cosine-weighted mean over wi the
//! *bihemispherical* albedo (Nicodemus et al. 1977, section V). Energy is conserved if ρ ≤ 1
//! everywhere. Each function returns an [`Estimate`] with its error and the number of points it took.

use core::{cell::Cell, f64::consts::PI, fmt, num::NonZeroU32};

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::{
    estimate::{Estimate, Sampling, try_mean},
    halton::Halton,
    warp::square_to_cosine_hemisphere,
};

/// A function that says how much light a surface scatters from one direction into another.
///
/// Directions are unit vectors in the shading frame, z the normal, both pointing away from the
/// surface and on its upper side. Closures `Fn(Vec2, Vec3, Vec3) -> f32` are scattering functions.
pub trait Scattering {
    /// f in sr⁻¹, *without* the cosine, at the surface point `x` in [0, 1]²: finite and at least 0.
    fn eval(&self, x: Vec2, wi: Vec3, wo: Vec3) -> f32;

    /// The directional albedo at `x` for `wi`, from a model that knows a better way than sampling
    /// directions, such as a quadrature in variables in which it is smooth. By default there is none.
    ///
    /// Where it returns an estimate, [`directional`] is that estimate, and the other albedos are
    /// means of it.
    fn albedo_exact(&self, x: DVec2, wi: DVec3) -> Option<Estimate> {
        let _ = (x, wi);
        None
    }
}

impl<F: Fn(Vec2, Vec3, Vec3) -> f32> Scattering for F {
    fn eval(&self, x: Vec2, wi: Vec3, wo: Vec3) -> f32 {
        self(x, wi, wo)
    }
}

/// Bihemispherical albedo of `brdf`: the fraction of uniform diffuse
/// illumination that it reflects, over all directions.
///
/// ```text
/// ρ = 1/π ∫∫ f(wi, wo) cos θi cos θo dwi dwo
/// ```
///
/// (Pharr, Jakob & Humphreys 2023, section 4.3.1.) Both directions are drawn from
/// cosine-weighted densities, which cancel both cosines and leave `ρ = π · mean(f)`.
///
/// `brdf(wi, wo)` is called in the shading frame and returns f in sr⁻¹, *without* the
/// cosine. Uses Halton points 1 to `n`; the error falls roughly as 1/n for a smooth f.
/// A value of f that is not finite makes the result not finite; [`bihemispherical`] reports it,
/// and the error of its estimate.
///
/// # Examples
///
/// A Lambertian surface reflects its own reflectance:
///
/// ```
/// use core::{f32::consts::PI, num::NonZeroU32};
/// let n = NonZeroU32::new(64).unwrap();
/// let rho = selvedge_normalize::albedo(|_wi, _wo| 0.18 / PI, n);
/// assert!((rho - 0.18).abs() < 1e-6);
/// ```
pub fn albedo(brdf: impl Fn(Vec3, Vec3) -> f32, n: NonZeroU32) -> f32 {
    let points = Halton::<4>::new().points_from(NonZeroU32::MIN).take(n.get() as usize);
    let values = points
        .map(|[a, b, c, d]| f64::from(brdf(cosine([a, b]).as_vec3(), cosine([c, d]).as_vec3())));
    (PI * values.sum::<f64>() / f64::from(n.get())) as f32
}

/// Directional albedo at the surface point `x` in [0, 1]² for the unit vector `wi` with z > 0.
///
/// wo is drawn with a density proportional to its cosine, which leaves `ρ = π · mean(f)`. A lobe
/// narrower than the spacing of the points is missed, see [`Sampling::at_least`]. The error includes
/// the rounding of f to f32.
///
/// # Errors
///
/// [`AlbedoError`] if f is not a number, infinite or negative.
pub fn directional(
    brdf: &(impl Scattering + ?Sized),
    x: DVec2,
    wi: DVec3,
    sampling: &Sampling,
) -> Result<Estimate, AlbedoError> {
    match exact(brdf, x, wi) {
        Some(estimate) => estimate,
        None => try_mean(|wo| sample(brdf, x, wi, cosine(wo)), sampling).map(with_rounding),
    }
}

/// Directional albedo for the unit vector `wi` with z > 0, averaged over the points of [0, 1]².
///
/// # Errors
///
/// As [`directional`].
pub fn averaged(
    brdf: &(impl Scattering + ?Sized),
    wi: DVec3,
    sampling: &Sampling,
) -> Result<Estimate, AlbedoError> {
    if exact(brdf, DVec2::splat(0.5), wi).is_some() {
        return mean_of_exact(brdf, |point| (point.into(), wi), sampling);
    }
    let f = |[x, y, a, b]: [f64; 4]| sample(brdf, DVec2::new(x, y), wi, cosine([a, b]));
    try_mean(f, sampling).map(with_rounding)
}

/// Bihemispherical albedo at the surface point `x` in [0, 1]²: the fraction of uniform diffuse
/// illumination that is reflected.
///
/// ```
/// use selvedge_normalize::{albedo::bihemispherical, estimate::Sampling, glam::{DVec2, Vec2, Vec3}};
/// use std::f32::consts::PI;
/// // f falls off towards grazing light: ρ = 2 ∫ cos² θ sin θ dθ.
/// let brdf = |_: Vec2, wi: Vec3, _: Vec3| wi.z / PI;
/// let rho = bihemispherical(&brdf, DVec2::ZERO, &Sampling::default())?;
/// assert!((rho.value - 2.0 / 3.0).abs() <= rho.error && rho.error <= 2e-3);
/// # Ok::<(), selvedge_normalize::albedo::AlbedoError>(())
/// ```
///
/// # Errors
///
/// As [`directional`].
pub fn bihemispherical(
    brdf: &(impl Scattering + ?Sized),
    x: DVec2,
    sampling: &Sampling,
) -> Result<Estimate, AlbedoError> {
    if exact(brdf, x, DVec3::Z).is_some() {
        return mean_of_exact(brdf, |wi| (x, cosine(wi)), sampling);
    }
    let f = |[a, b, c, d]: [f64; 4]| sample(brdf, x, cosine([a, b]), cosine([c, d]));
    try_mean(f, sampling).map(with_rounding)
}

/// A direction with a density proportional to its cosine.
fn cosine(square: [f64; 2]) -> DVec3 {
    square_to_cosine_hemisphere(square.into())
}

/// π f, the albedo that one cosine-distributed wo stands for.
fn sample(
    brdf: &(impl Scattering + ?Sized),
    x: DVec2,
    wi: DVec3,
    wo: DVec3,
) -> Result<f64, AlbedoError> {
    let (x, wi, wo) = (x.as_vec2(), wi.as_vec3(), wo.as_vec3());
    match brdf.eval(x, wi, wo) {
        f if f.is_finite() && f >= 0.0 => Ok(PI * f64::from(f)),
        value => Err(AlbedoError::Value { x, wi, wo, value }),
    }
}

/// Adds the error of an f that was rounded to f32 before it was averaged.
fn with_rounding(estimate: Estimate) -> Estimate {
    Estimate { error: estimate.error + estimate.value * f64::from(f32::EPSILON), ..estimate }
}

/// The model's own albedo, checked.
fn exact(
    brdf: &(impl Scattering + ?Sized),
    x: DVec2,
    wi: DVec3,
) -> Option<Result<Estimate, AlbedoError>> {
    brdf.albedo_exact(x, wi).map(|estimate| {
        let valid = |number: f64| number.is_finite() && number >= 0.0;
        if valid(estimate.value) && valid(estimate.error) {
            Ok(estimate)
        } else {
            Err(AlbedoError::Exact { x, wi, value: estimate.value, error: estimate.error })
        }
    })
}

/// Mean of the model's own albedo over the places that `map` gives; its largest error is added.
fn mean_of_exact(
    brdf: &(impl Scattering + ?Sized),
    map: impl Fn([f64; 2]) -> (DVec2, DVec3),
    sampling: &Sampling,
) -> Result<Estimate, AlbedoError> {
    let largest_error = Cell::new(0.0f64);
    let value = |at| {
        let (x, wi) = map(at);
        let estimate = exact(brdf, x, wi).unwrap_or_else(|| directional(brdf, x, wi, sampling))?;
        largest_error.set(largest_error.get().max(estimate.error));
        Ok(estimate.value)
    };
    let mean = try_mean(value, sampling)?;
    Ok(Estimate { error: mean.error + largest_error.get(), ..mean })
}

/// A scattering function returned what no scattering function may.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum AlbedoError {
    /// A value of f is not a number, infinite or negative.
    Value {
        /// The surface point.
        x: Vec2,
        /// The first direction.
        wi: Vec3,
        /// The second direction.
        wo: Vec3,
        /// What was returned, in sr⁻¹.
        value: f32,
    },
    /// The model's own albedo or its error is not a number, infinite or negative.
    Exact {
        /// The surface point.
        x: DVec2,
        /// The direction.
        wi: DVec3,
        /// The albedo that was returned.
        value: f64,
        /// The error that was returned with it.
        error: f64,
    },
}

impl fmt::Display for AlbedoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let expected = "expected finite and at least 0";
        match self {
            Self::Value { x, wi, wo, value } => {
                write!(f, "scattering at x {x}, wi {wi}, wo {wo}: {value} sr⁻¹, {expected}")
            }
            Self::Exact { x, wi, value, error } => {
                write!(f, "exact albedo at x {x}, wi {wi}: {value} ± {error}, {expected}")
            }
        }
    }
}

impl core::error::Error for AlbedoError {}
