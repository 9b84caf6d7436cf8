//! The factor of Eq. 2: by what a scattering function must be scaled to reflect no more than it receives.
//!
//! ```text
//! a⁻¹ = max over x, wi of  ∫ f(x, wi, wo) cos θo dwo
//! ```
//!
//! (Nelson, McEvoy & Fratarcangeli 2016, equation 2; the integral is the directional albedo.) The
//! maximum is searched with [`maximize`](crate::search::maximize). A sampled maximum is biased low,
//! so the factor is not its reciprocal but that of an upper bound: the maximum times a stated
//! margin, or an analytic bound where that is tighter. A [`Mode`] says over what the maximum is.

use core::fmt;

use glam::{DVec2, DVec3};

use crate::{
    albedo::{AlbedoError, Scattering, averaged, directional},
    estimate::{Estimate, Sampling},
    search::{Search, try_maximize},
    warp::square_to_uniform_hemisphere,
};

/// The most grazing direction that is looked at. At cos θ = 0 itself nothing is received, and many
/// scattering functions are undefined or cut off there.
pub(crate) const SMALLEST_COS_THETA: f64 = 1e-6;

/// What must not reflect more than it receives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Every point, from every direction: the equation as it stands.
    Pointwise,
    /// A piece of surface as a whole, from every direction: the albedo is first averaged over its
    /// points. A point in it may reflect more than it receives, at the expense of its neighbours.
    /// Never darker than pointwise, because a mean is at most a maximum.
    #[default]
    Segment,
    /// Nothing: the function stays as it is, for comparisons.
    None,
}

/// How carefully the greatest albedo is sought and how far above it the factor aims.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Work done to find the maximum.
    pub search: Search,
    /// The found maximum times this is taken as an upper bound; at least 1. The default is 1.02.
    pub margin: f64,
    /// Absolute error of every albedo that the caller's function returns; at least 0. The default
    /// is 0, an exact albedo.
    pub albedo_error: f64,
    /// An upper bound of the albedo known by analysis; at least 0. The default is none.
    pub bound: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self { search: Search::default(), margin: 1.02, albedo_error: 0.0, bound: None }
    }
}

/// Where the greatest albedo was found.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Place {
    /// The surface point in [0, 1]²; `None` if the albedo was averaged over points.
    pub point: Option<DVec2>,
    /// The direction, a unit vector in the shading frame with z > 0; `None` if nothing was searched.
    pub direction: Option<DVec3>,
}

/// The factor of Eq. 2 and what it rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normalization {
    /// What to multiply the scattering function by: `1 / upper_bound`. Above 1 for a function that
    /// reflects little. It is 1 if that is not finite, in particular if nothing is reflected.
    pub factor: f64,
    /// The greatest albedo found, before scaling.
    pub max_albedo: f64,
    /// Where it was found.
    pub at: Place,
    /// The true maximum is at least this: `max_albedo` less the error of the albedo, or 0.
    pub lower_bound: f64,
    /// The true maximum is taken to be at most this: `max_albedo · margin` plus the error of the
    /// albedo, or the analytic bound if that is lower, but never below `max_albedo`.
    pub upper_bound: f64,
    /// Number of albedos evaluated.
    pub evaluations: u32,
}

impl Normalization {
    /// The factor for `albedo(point, direction)`, the directional albedo at a surface point in
    /// [0, 1]² for a unit vector of the hemisphere with z ≥ 10⁻⁶.
    ///
    /// By reciprocity it does not matter which of the two directions of the scattering function is
    /// held fixed. The search runs over the point and a uniform map of the hemisphere, in which
    /// grazing directions are the border.
    ///
    /// # Errors
    ///
    /// [`ScaleError`] if an albedo is not a number, infinite or negative, or an option is out of range.
    ///
    /// # Examples
    ///
    /// ```
    /// use selvedge_normalize::scale::{Normalization, Options};
    /// // A surface that brightens to the right and towards grazing directions, to 4 at most.
    /// let n = Normalization::pointwise(|x, w| 4.0 * x.x * (1.0 - w.z), &Options::default())?;
    /// assert!((n.max_albedo - 4.0).abs() < 1e-4 && n.factor <= 0.25);
    /// # Ok::<(), selvedge_normalize::scale::ScaleError>(())
    /// ```
    pub fn pointwise(
        albedo: impl Fn(DVec2, DVec3) -> f64,
        options: &Options,
    ) -> Result<Self, ScaleError> {
        let albedo = |(x, wi)| options.checked(albedo(x, wi), Place::at(x, wi));
        Self::over(albedo, point_and_direction, |(x, wi)| Place::at(x, wi), options)
    }

    /// The factor for `mean_albedo(direction)`, the directional albedo averaged over the points of
    /// one piece of surface, for a unit vector of the hemisphere with z ≥ 10⁻⁶.
    ///
    /// # Errors
    ///
    /// As [`Normalization::pointwise`].
    pub fn segment(
        mean_albedo: impl Fn(DVec3) -> f64,
        options: &Options,
    ) -> Result<Self, ScaleError> {
        let albedo = |wi| options.checked(mean_albedo(wi), Place::averaged(wi));
        Self::over(albedo, direction, Place::averaged, options)
    }

    /// The factor for `brdf`, whose albedos are estimated with `sampling`.
    ///
    /// The stated error of the albedo at the maximum is added to [`Options::albedo_error`].
    ///
    /// # Errors
    ///
    /// As [`Normalization::pointwise`], and [`ScaleError::Scattering`] if a value of `brdf` is not a
    /// number, infinite or negative.
    ///
    /// # Examples
    ///
    /// ```
    /// use selvedge_normalize::{Normalization, estimate::Sampling, scale::{Mode, Options}};
    /// use selvedge_normalize::glam::{Vec2, Vec3};
    /// let lambert = |_: Vec2, _: Vec3, _: Vec3| 2.0 / std::f32::consts::PI;
    /// let options = Options { margin: 1.0, ..Options::default() };
    /// let n = Normalization::of(&lambert, Mode::Pointwise, &Sampling::default(), &options)?;
    /// assert!((n.factor - 0.5).abs() < 1e-6);
    /// # Ok::<(), selvedge_normalize::scale::ScaleError>(())
    /// ```
    pub fn of(
        brdf: &(impl Scattering + ?Sized),
        mode: Mode,
        sampling: &Sampling,
        options: &Options,
    ) -> Result<Self, ScaleError> {
        match mode {
            Mode::Pointwise => Self::over(
                |(x, wi)| options.widened(directional(brdf, x, wi, sampling)),
                point_and_direction,
                |(x, wi)| Place::at(x, wi),
                options,
            ),
            Mode::Segment => Self::over(
                |wi| options.widened(averaged(brdf, wi, sampling)),
                direction,
                Place::averaged,
                options,
            ),
            Mode::None => Ok(Self::none()),
        }
    }

    /// No scaling: the factor 1. Nothing is searched, so the bounds are those of any albedo, 0 and ∞.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            factor: 1.0,
            max_albedo: 0.0,
            at: Place { point: None, direction: None },
            lower_bound: 0.0,
            upper_bound: f64::INFINITY,
            evaluations: 0,
        }
    }

    /// The factor for `albedo` over the image of the unit cube under `map`.
    fn over<const D: usize, T: Copy>(
        albedo: impl Fn(T) -> Result<Estimate, ScaleError>,
        map: impl Fn([f64; D]) -> T,
        place: impl Fn(T) -> Place,
        options: &Options,
    ) -> Result<Self, ScaleError> {
        options.check()?;
        let found = try_maximize(|at| albedo(map(at)).map(|rho| rho.value), &options.search)?;
        let at = map(found.at);
        let max_albedo = found.value;
        let error = albedo(at)?.error;
        let with_margin = max_albedo * options.margin + error;
        let upper_bound = with_margin.min(options.bound.unwrap_or(f64::INFINITY)).max(max_albedo);
        let reciprocal = upper_bound.recip();
        Ok(Self {
            factor: if reciprocal.is_finite() { reciprocal } else { 1.0 },
            max_albedo,
            at: place(at),
            lower_bound: (max_albedo - error).max(0.0),
            upper_bound,
            evaluations: found.evaluations.saturating_add(1),
        })
    }
}

impl Place {
    /// A surface point and a direction.
    const fn at(point: DVec2, direction: DVec3) -> Self {
        Self { point: Some(point), direction: Some(direction) }
    }

    /// All surface points and a direction.
    const fn averaged(direction: DVec3) -> Self {
        Self { point: None, direction: Some(direction) }
    }
}

/// A surface point and a direction for a point of the unit cube.
fn point_and_direction([x, y, u, v]: [f64; 4]) -> (DVec2, DVec3) {
    (DVec2::new(x, y), direction([u, v]))
}

/// A direction in the open hemisphere for a point of the unit square.
fn direction(square: [f64; 2]) -> DVec3 {
    let w = square_to_uniform_hemisphere(square.into());
    if w.z < SMALLEST_COS_THETA { w.with_z(SMALLEST_COS_THETA).normalize() } else { w }
}

impl Options {
    /// The first option that is out of range, if any.
    fn check(&self) -> Result<(), ScaleError> {
        let in_range = |name, value: f64, at_least| match value {
            v if v >= at_least && v.is_finite() => Ok(()),
            value => Err(ScaleError::Option { name, value, at_least }),
        };
        in_range("margin", self.margin, 1.0)?;
        in_range("albedo_error", self.albedo_error, 0.0)?;
        in_range("bound", self.bound.unwrap_or(0.0), 0.0)
    }

    /// An estimated albedo with `albedo_error` added to its own error.
    fn widened(&self, albedo: Result<Estimate, AlbedoError>) -> Result<Estimate, ScaleError> {
        let rho = albedo.map_err(ScaleError::Scattering)?;
        Ok(Estimate { error: rho.error + self.albedo_error, ..rho })
    }

    /// The albedo that the caller's function returned `at` a place, if it is one.
    fn checked(&self, value: f64, at: Place) -> Result<Estimate, ScaleError> {
        if value.is_finite() && value >= 0.0 {
            Ok(Estimate { value, error: self.albedo_error, points: 1 })
        } else {
            Err(ScaleError::Albedo { at, value })
        }
    }
}

/// Why no factor could be found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ScaleError {
    /// An albedo is not a number, infinite or negative.
    Albedo {
        /// Where.
        at: Place,
        /// What was found.
        value: f64,
    },
    /// The scattering function returned what no scattering function may.
    Scattering(AlbedoError),
    /// An option is out of range.
    Option {
        /// The field of [`Options`].
        name: &'static str,
        /// What was found.
        value: f64,
        /// The smallest value that is allowed; every finite value from it on is.
        at_least: f64,
    },
}

impl fmt::Display for ScaleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Albedo { at, value } => {
                f.write_str("albedo")?;
                if let Some(point) = at.point {
                    write!(f, " at point {point}")?;
                }
                if let Some(direction) = at.direction {
                    write!(f, " for direction {direction}")?;
                }
                write!(f, ": {value}, expected a finite number of at least 0")
            }
            Self::Scattering(_) => f.write_str("no factor: the scattering function is invalid"),
            Self::Option { name, value, at_least } => {
                write!(f, "option {name}: {value}, expected a finite number of at least {at_least}")
            }
        }
    }
}

impl core::error::Error for ScaleError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Scattering(error) => Some(error),
            Self::Albedo { .. } | Self::Option { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_albedo_gives_its_reciprocal_less_the_margin() {
        let n = Normalization::segment(|_| 0.5, &Options::default()).expect("valid");
        assert_eq!((n.max_albedo, n.lower_bound, n.upper_bound), (0.5, 0.5, 0.5 * 1.02));
        assert!((n.factor * 0.51 - 1.0).abs() < 1e-15, "{n:?}");
    }

    #[test]
    fn the_analytic_bound_caps_the_margin_but_not_what_was_found() {
        let with = |bound| {
            let options = Options { bound: Some(bound), ..Options::default() };
            Normalization::segment(|_| 0.5, &options).expect("valid").upper_bound
        };
        assert_eq!([with(0.505), with(0.9), with(0.4)], [0.505, 0.51, 0.5]);
    }

    #[test]
    fn the_error_of_the_albedo_widens_both_bounds() {
        let options = Options { margin: 1.0, albedo_error: 0.125, ..Options::default() };
        let n = Normalization::pointwise(|_, _| 0.5, &options).expect("valid");
        assert_eq!((n.lower_bound, n.upper_bound, n.factor), (0.375, 0.625, 1.6));
    }

    #[test]
    fn no_reflection_leaves_the_function_alone() {
        for tiny in [0.0, f64::from_bits(1)] {
            let n = Normalization::segment(|_| tiny, &Options::default()).expect("valid");
            assert_eq!((n.factor, n.max_albedo), (1.0, tiny));
        }
        assert_eq!(Normalization::none().factor, 1.0);
    }

    #[test]
    fn the_maximum_is_found_at_grazing_and_at_the_normal() {
        let options = Options { margin: 1.0, ..Options::default() };
        let grazing = Normalization::segment(|w| 1.0 - w.z, &options).expect("valid");
        assert!(grazing.max_albedo > 1.0 - 1e-5, "{grazing:?}");
        let normal = Normalization::segment(|w| w.z * w.z, &options).expect("valid");
        assert!(normal.max_albedo > 1.0 - 1e-8, "{normal:?}");
    }

    #[test]
    fn directions_are_unit_vectors_of_the_open_hemisphere() {
        for [u, v] in [[0.0, 0.0], [1.0, 0.3], [0.5, 0.5], [0.2, 1.0], [1.0, 1.0]] {
            let w = direction([u, v]);
            assert!(w.is_normalized() && w.z >= 0.99 * SMALLEST_COS_THETA, "({u}, {v}): {w}");
        }
    }

    #[test]
    fn an_invalid_albedo_is_reported_with_its_place() {
        for bad in [-0.25, f64::NAN, f64::INFINITY] {
            let at_right = |x: DVec2, _| if x.x > 0.5 { bad } else { 0.1 };
            match Normalization::pointwise(at_right, &Options::default()) {
                Err(ScaleError::Albedo {
                    at: Place { point: Some(point), direction: Some(_) },
                    value,
                }) => {
                    assert!(point.x > 0.5 && value.to_bits() == bad.to_bits(), "{point} {value}");
                }
                other => panic!("{bad}: {other:?}"),
            }
        }
        let error = Normalization::segment(|_| -1.0, &Options::default()).expect_err("negative");
        let text = error.to_string();
        assert!(
            text.starts_with("albedo for direction [")
                && text.ends_with(": -1, expected a finite number of at least 0"),
            "{text}"
        );
    }

    #[test]
    fn options_out_of_range_are_reported() {
        let base = Options::default();
        for (options, text) in [
            (
                Options { margin: 0.99, ..base },
                "option margin: 0.99, expected a finite number of at least 1",
            ),
            (
                Options { albedo_error: f64::NAN, ..base },
                "option albedo_error: NaN, expected a finite number of at least 0",
            ),
            (
                Options { bound: Some(-1.0), ..base },
                "option bound: -1, expected a finite number of at least 0",
            ),
        ] {
            let error = Normalization::segment(|_| 0.5, &options).expect_err(text);
            assert_eq!(error.to_string(), text);
        }
    }
}
