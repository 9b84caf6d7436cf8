//! `PartialYarn`: the parameters of a yarn, any of which may be left open.

use crate::parameter::ParamError;
use crate::phase::Phase;
use crate::texture::{Target, Textures};
use crate::yarn::{Diffuse, Highlight, Yarn};

/// A struct of optional numbers, which can list them by the names that [`Yarn::parameters`] has for
/// them. Choices, which are not numbers, stand first.
macro_rules! partial {
    (
        $(#[$meta:meta])* $name:ident, named $prefix:literal, described by $describe:ident
        choices { $($(#[$choice_meta:meta])* $choice:ident: $type:ty,)* }
        numbers { $($(#[$number_meta:meta])* $number:ident,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[cfg_attr(feature = "schema", schemars(transform = crate::schema::$describe))]
        #[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
        #[cfg_attr(feature = "serde", serde(expecting = "an object of parameters"))]
        pub struct $name {
            $(
                $(#[$choice_meta])*
                #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_open"))]
                pub $choice: $type,
            )*
            $(
                $(#[$number_meta])*
                #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
                pub $number: Option<f64>,
            )*
        }

        impl $name {
            fn own_numbers(&self) -> impl Iterator<Item = (&'static str, f64)> {
                [$((concat!($prefix, stringify!($number)), self.$number)),*]
                    .into_iter()
                    .filter_map(|(name, value)| Some((name, value?)))
            }
        }
    };
}

partial! {
    /// Parameters of a yarn; one that is open stays as it is. Names, units and ranges are those of
    /// [`Yarn`].
    ///
    /// In files a colour is three linear numbers, one number for a grey, or `"#rrggbb"` in sRGB.
    PartialYarn, named "", described by describe_yarn
    choices {
        /// Diffuse reflectance, [`Yarn::color`]; as in the draft if open.
        #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::color::optional"))]
        #[cfg_attr(feature = "schema", schemars(with = "Option<crate::Color>"))]
        color: Option<[f32; 3]>,
        /// Colour and amount of the highlight, [`Yarn::specular`], before [`tint`](PartialYarn::tint).
        #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::color::optional"))]
        #[cfg_attr(feature = "schema", schemars(with = "Option<crate::Color>"))]
        specular: Option<[f32; 3]>,
        /// Colour and amount of its uniform part, [`Yarn::specular_uniform`], which no tint changes.
        #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::color::optional"))]
        #[cfg_attr(feature = "schema", schemars(with = "Option<crate::Color>"))]
        specular_uniform: Option<[f32; 3]>,
        /// How the diffuse reflection follows the surface, [`Yarn::diffuse`].
        diffuse: Option<Diffuse>,
        /// What spreads the highlight over the segment, [`Yarn::highlight`].
        highlight: Option<Highlight>,
        /// Scattering about the fibre, [`Yarn::phase`].
        phase: Option<Phase>,
        /// Irregularities, [`Yarn::noise`].
        noise: PartialNoise,
        /// Pictures in the place of values: where both are given, the picture holds. A value that is
        /// given on top of it ends it. The serde form has none.
        #[cfg_attr(feature = "serde", serde(skip))]
        textures: Textures,
    }
    numbers {
        /// Share of the highlight that takes the colour of the yarn, which is light that has been inside
        /// a fibre; the rest is from its surface: 1, in [0, 1].
        ///
        /// ```text
        /// specular · (1 − tint + tint · color)
        /// ```
        #[cfg_attr(feature = "schema", schemars(range(min = 0.0, max = 1.0)))]
        tint,
        /// [`Yarn::opacity`].
        opacity,
        /// [`Yarn::u_max`], rad.
        u_max,
        /// [`Yarn::psi`], rad.
        psi,
        /// [`Yarn::kappa`].
        kappa,
        /// [`Yarn::smoothing`].
        smoothing,
        /// [`Yarn::size`]; by the thickness in the draft if open.
        size,
        /// δ alone, of a drawn highlight.
        delta,
        /// σ alone, of a highlight of rough fibres, rad.
        sigma,
        /// α alone, of a von Mises phase function.
        alpha,
        /// β alone, of a von Mises phase function.
        beta,
        /// ρ alone, of a wrapped Cauchy phase function.
        rho,
    }
}

partial! {
    /// Irregularities of a yarn; one that is open stays as it is. Units and ranges are those of
    /// [`Noise`](crate::Noise).
    PartialNoise, named "noise.", described by describe_noise
    choices {}
    numbers {
        /// [`Noise::intensity`](crate::Noise::intensity).
        intensity,
        /// [`Noise::fineness`](crate::Noise::fineness).
        fineness,
        /// [`Noise::u_max`](crate::Noise::u_max), rad.
        u_max,
        /// [`Noise::width`](crate::Noise::width).
        width,
        /// [`Noise::offset`](crate::Noise::offset).
        offset,
        /// [`Noise::wavelength`](crate::Noise::wavelength), m.
        wavelength,
        /// [`Noise::slub_rate`](crate::Noise::slub_rate), m⁻¹.
        slub_rate,
        /// [`Noise::slub_length`](crate::Noise::slub_length), m.
        slub_length,
        /// [`Noise::slub_height`](crate::Noise::slub_height).
        slub_height,
        /// [`Noise::color`](crate::Noise::color).
        color,
    }
}

/// Why a [`PartialYarn`] cannot be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PartialError {
    /// A parameter is out of range.
    #[error(transparent)]
    Range(#[from] ParamError),
    /// A number of another kind of highlight or phase function than the yarn has.
    #[error("{name}: found a yarn with another kind of {what}, expected {kind}")]
    Absent {
        /// The number.
        name: &'static str,
        /// `highlight` or `phase`.
        what: &'static str,
        /// The kind that has such a number.
        kind: &'static str,
    },
}

impl PartialYarn {
    /// Whether everything given is in its range.
    ///
    /// # Errors
    ///
    /// The first parameter that is not; NaN is in no range.
    pub fn validate(&self) -> Result<(), ParamError> {
        for (name, value) in self.numbers() {
            match Yarn::parameter(name) {
                Some(parameter) => parameter.check(value)?,
                // The one number that a yarn does not have.
                None if (0.0..=1.0).contains(&value) => {}
                None => return Err(ParamError::new(name, value, 0.0, 1.0)),
            }
        }
        let mut yarn = Yarn::default();
        self.apply_choices(&mut yarn);
        yarn.validate()
    }

    /// Changes what is given in `yarn` and in the tint of its highlight.
    pub(crate) fn apply(&self, yarn: &mut Yarn, tint: &mut f64) -> Result<(), PartialError> {
        self.apply_choices(yarn);
        for (name, value) in self.numbers() {
            let Some(parameter) = Yarn::parameter(name) else {
                *tint = value;
                continue;
            };
            if !parameter.set(yarn, value) {
                return Err(absent(name));
            }
        }
        Ok(())
    }

    /// Changes what is given in the `textures` of `yarn`, to which this has been applied.
    pub(crate) fn apply_textures(
        &self,
        yarn: &Yarn,
        textures: &mut Textures,
    ) -> Result<(), PartialError> {
        textures.retain(|target| !self.has_value(target));
        for (target, texture) in self.textures.iter() {
            if let Target::Parameter(name) = target
                && Yarn::parameter(name).is_some_and(|parameter| parameter.of(yarn).is_none())
            {
                return Err(absent(name));
            }
            textures.set(target, texture.clone());
        }
        Ok(())
    }

    /// Whether a value is given for `target`, alone or with the choice that has it.
    fn has_value(&self, target: Target) -> bool {
        match target {
            Target::Color => self.color.is_some(),
            Target::Specular => self.specular.is_some(),
            Target::Parameter("delta" | "sigma") if self.highlight.is_some() => true,
            Target::Parameter("alpha" | "beta" | "rho") if self.phase.is_some() => true,
            Target::Parameter(name) => self.numbers().any(|(given, _)| given == name),
        }
    }

    /// What is given apart from numbers.
    fn apply_choices(&self, yarn: &mut Yarn) {
        fn set<T: Clone>(place: &mut T, value: &Option<T>) {
            if let Some(value) = value {
                place.clone_from(value);
            }
        }
        set(&mut yarn.color, &self.color);
        set(&mut yarn.specular, &self.specular);
        yarn.specular_uniform = self.specular_uniform.or(yarn.specular_uniform);
        set(&mut yarn.diffuse, &self.diffuse);
        set(&mut yarn.highlight, &self.highlight);
        set(&mut yarn.phase, &self.phase);
    }

    /// The numbers given, by name.
    fn numbers(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.own_numbers().chain(self.noise.own_numbers())
    }
}

/// The error of a number that belongs to another kind of highlight or phase function.
fn absent(name: &'static str) -> PartialError {
    let (what, kind) = match name {
        "delta" => ("highlight", "window"),
        "sigma" => ("highlight", "rough"),
        "rho" => ("phase", "wrapped_cauchy"),
        _ => ("phase", "von_mises or von_mises_3d"),
    };
    PartialError::Absent { name, what, kind }
}

impl From<&Yarn> for PartialYarn {
    /// All of a yarn, with a highlight of exactly its colour.
    fn from(yarn: &Yarn) -> Self {
        let noise = &yarn.noise;
        Self {
            color: Some(yarn.color),
            specular: Some(yarn.specular),
            specular_uniform: yarn.specular_uniform,
            diffuse: Some(yarn.diffuse),
            highlight: Some(yarn.highlight),
            phase: Some(yarn.phase.clone()),
            noise: PartialNoise {
                intensity: Some(noise.intensity),
                fineness: Some(noise.fineness),
                u_max: Some(noise.u_max),
                width: Some(noise.width),
                offset: Some(noise.offset),
                wavelength: Some(noise.wavelength),
                slub_rate: Some(noise.slub_rate),
                slub_length: Some(noise.slub_length),
                slub_height: Some(noise.slub_height),
                color: Some(noise.color),
            },
            tint: Some(0.0),
            opacity: Some(yarn.opacity),
            u_max: Some(yarn.u_max),
            psi: Some(yarn.psi),
            kappa: Some(yarn.kappa),
            smoothing: Some(yarn.smoothing),
            size: Some(yarn.size),
            ..Self::default()
        }
    }
}

#[cfg(feature = "serde")]
fn is_open<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_can_be_given_alone() {
        for parameter in Yarn::parameters() {
            let value = parameter.high;
            let mut partial = PartialYarn::default();
            let place = match parameter.name.strip_prefix("noise.") {
                None => match parameter.name {
                    "size" => &mut partial.size,
                    "opacity" => &mut partial.opacity,
                    "u_max" => &mut partial.u_max,
                    "psi" => &mut partial.psi,
                    "kappa" => &mut partial.kappa,
                    "smoothing" => &mut partial.smoothing,
                    "delta" => &mut partial.delta,
                    "sigma" => &mut partial.sigma,
                    "alpha" => &mut partial.alpha,
                    "beta" => &mut partial.beta,
                    "rho" => &mut partial.rho,
                    name => panic!("{name} cannot be left open"),
                },
                Some("intensity") => &mut partial.noise.intensity,
                Some("fineness") => &mut partial.noise.fineness,
                Some("u_max") => &mut partial.noise.u_max,
                Some("width") => &mut partial.noise.width,
                Some("offset") => &mut partial.noise.offset,
                Some("wavelength") => &mut partial.noise.wavelength,
                Some("slub_rate") => &mut partial.noise.slub_rate,
                Some("slub_length") => &mut partial.noise.slub_length,
                Some("slub_height") => &mut partial.noise.slub_height,
                Some("color") => &mut partial.noise.color,
                Some(name) => panic!("noise.{name} cannot be left open"),
            };
            *place = Some(value);
            assert_eq!(partial.validate(), Ok(()), "{}", parameter.name);

            let mut yarn = Yarn::default();
            if parameter.of(&yarn).is_none() {
                let error = partial.apply(&mut yarn, &mut 0.0).unwrap_err();
                assert!(matches!(error, PartialError::Absent { .. }), "{error}");
                yarn.highlight = Highlight::Rough { sigma: 0.1 };
                yarn.phase = Phase::WrappedCauchy { rho: 0.5, is_backward: true };
            }
            let before = yarn.clone();
            assert_eq!(partial.apply(&mut yarn, &mut 0.0), Ok(()), "{}", parameter.name);
            assert_eq!(parameter.of(&yarn), Some(value), "{}", parameter.name);
            if let Some(old) = parameter.of(&before) {
                parameter.set(&mut yarn, old);
            }
            assert_eq!(yarn, before, "{} changed something else", parameter.name);
        }
    }

    #[test]
    fn all_of_a_yarn_makes_that_yarn() {
        let yarn = Yarn {
            color: [0.1, 0.2, 0.3],
            specular: [0.5; 3],
            specular_uniform: Some([0.6; 3]),
            opacity: 0.9,
            diffuse: Diffuse::YarnNormal,
            u_max: 0.1,
            psi: -0.2,
            kappa: 3.0,
            smoothing: 0.4,
            highlight: Highlight::Rough { sigma: 0.3 },
            phase: Phase::WrappedCauchy { rho: 0.5, is_backward: true },
            size: 0.6,
            noise: crate::yarn::Noise {
                intensity: 0.1,
                fineness: 2.0,
                u_max: 0.11,
                width: 0.12,
                offset: 0.13,
                wavelength: 0.14,
                slub_rate: 15.0,
                slub_length: 0.016,
                slub_height: 0.17,
                color: 0.18,
            },
        };
        let (mut made, mut tint) = (Yarn::default(), 0.5);
        assert_eq!(PartialYarn::from(&yarn).apply(&mut made, &mut tint), Ok(()));
        assert_eq!((made, tint), (yarn, 0.0));
    }

    #[test]
    fn what_is_out_of_range_is_named() {
        let d = PartialYarn::default;
        let cases = [
            ("tint", PartialYarn { tint: Some(1.5), ..d() }),
            ("psi", PartialYarn { psi: Some(f64::NAN), ..d() }),
            ("specular", PartialYarn { specular: Some([2.0, 0.0, 0.0]), ..d() }),
            ("sigma", PartialYarn { highlight: Some(Highlight::Rough { sigma: 9.0 }), ..d() }),
            ("rho", PartialYarn { rho: Some(-1.0), ..d() }),
            (
                "noise.width",
                PartialYarn {
                    noise: PartialNoise { width: Some(2.0), ..PartialNoise::default() },
                    ..d()
                },
            ),
        ];
        for (name, partial) in cases {
            assert_eq!(partial.validate().map_err(|e| e.name), Err(name), "{partial:?}");
        }
    }
}
