//! The command line of `selvedge eval`.

use std::path::PathBuf;

use clap::Args;
use glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{Parameter, Yarn};

/// Arguments of `selvedge eval`.
#[derive(Clone, Debug, Args)]
pub struct EvalOptions {
    /// A draft (WIF), a fabric (JSON) or preset:NAME
    #[arg(value_name = "CLOTH")]
    pub input: PathBuf,

    /// The place: metres along the weft and along the warp
    #[arg(long, value_name = "U,V", allow_negative_numbers = true, value_parser = place)]
    pub at: Place,

    /// The direction to the light: degrees from the normal, and from the weft towards the warp
    #[arg(long, value_name = "THETA,PHI", allow_negative_numbers = true, value_parser = angles)]
    pub wi: Angles,

    /// The direction to the viewer
    #[arg(long, value_name = "THETA,PHI", allow_negative_numbers = true, value_parser = angles)]
    pub wo: Angles,

    /// Sets a parameter of all yarns, as in psi=0.5, or the scale of the cloth
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    pub settings: Vec<ParameterSetting>,

    /// One JSON object, see --help for its keys
    #[arg(long)]
    pub json: bool,
}

/// A place on the cloth, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place(pub DVec2);

/// A direction, named so that it can be named again to the last bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// From the normal, above 90° on the back.
    pub theta_deg: f64,
    /// From the weft towards the warp.
    pub phi_deg: f64,
}

impl Angles {
    /// The unit vector, in the shading frame.
    pub fn direction(self) -> DVec3 {
        let (sin, cos) = self.theta_deg.to_radians().sin_cos();
        let (y, x) = self.phi_deg.to_radians().sin_cos();
        DVec3::new(sin * x, sin * y, cos)
    }

    /// The same in single precision.
    pub fn single(self) -> Vec3 {
        self.direction().as_vec3()
    }
}

/// A number of the cloth that is changed.
#[derive(Clone, Copy, Debug)]
pub enum ParameterSetting {
    /// Of all its yarns that have it.
    Yarns(&'static Parameter, f64),
    /// [`Cloth::scale`](selvedge_yarn_brdf::Cloth::scale).
    Scale(f64),
}

fn pair(text: &str) -> Option<[f64; 2]> {
    let (first, second) = text.split_once(',')?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    Some([number(first)?, number(second)?])
}

fn place(text: &str) -> Result<Place, String> {
    let place = pair(text).map(|[u, v]| Place(DVec2::new(u, v)));
    place.ok_or_else(|| "expected two numbers, as in 0.0012,0.004".to_owned())
}

fn angles(text: &str) -> Result<Angles, String> {
    let angles = pair(text).filter(|[theta, _]| (0.0..=180.0).contains(theta));
    let angles = angles.map(|[theta_deg, phi_deg]| Angles { theta_deg, phi_deg });
    angles.ok_or_else(|| "expected two numbers, the first from 0 to 180, as in 30,90".to_owned())
}

fn setting(text: &str) -> Result<ParameterSetting, String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let number = value.parse::<f64>().map_err(|_| format!("{name}: {value}, expected a number"))?;
    if name == "scale" {
        return Ok(ParameterSetting::Scale(number));
    }
    let parameter = Yarn::parameter(name).ok_or_else(|| {
        let names = Yarn::parameters().iter().map(|parameter| parameter.name);
        let known: Vec<_> = names.chain(["scale"]).collect();
        format!("found no {name:?}, expected one of {}", known.join(", "))
    })?;
    parameter.check(number).map_err(|error| error.to_string())?;
    Ok(ParameterSetting::Yarns(parameter, number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_shading_frame() {
        let direction = |text| angles(text).map(Angles::direction);
        let close = |found: Result<DVec3, String>, expected: DVec3| {
            found.is_ok_and(|found| (found - expected).length() < 1e-15)
        };
        assert!(close(direction("0,0"), DVec3::Z));
        assert!(close(direction("90,90"), DVec3::Y));
        assert!(close(direction("180, -30"), -DVec3::Z));
        for text in ["", "1", "a,b", "181,0", "-1,0", "1,nan", "1,2,3"] {
            assert!(angles(text).is_err(), "{text}");
        }
    }

    #[test]
    fn settings_are_parameters_within_their_range() {
        assert!(
            matches!(setting("psi=0.5"), Ok(ParameterSetting::Yarns(p, 0.5)) if p.name == "psi")
        );
        assert!(matches!(setting("scale=1e6"), Ok(ParameterSetting::Scale(1e6))));
        for text in ["psi", "psi=", "psi=9", "psy=0.5", "psi=nan"] {
            assert!(setting(text).is_err(), "{text}");
        }
    }
}
