//! What the panel sets: every parameter that the shader tells of itself, and the choices around them.

use selvedge_yarn_brdf::{Diffuse, Fabric, Highlight, Parameter, Phase, Yarn};
use serde_json::{Value, json};

use super::reply::value_of;

/// The share of the highlight that takes the colour of the yarn where nothing is said.
const TINT: f64 = 0.6;

/// Range over which a parameter lies on a slider by its logarithm.
const WIDE: f64 = 100.0;

/// All that the panel sets.
///
/// # Panics
///
/// Never: choices are written in JSON, which has room for them.
pub(super) fn all() -> Value {
    let numbers = Yarn::parameters().iter().map(number);
    let tint = json!({
        "name": "tint",
        "meaning": "share of the highlight in the colour of the yarn",
        "unit": "",
        "low": 0.0,
        "high": 1.0,
        "default": TINT,
        "texturable": false,
        "scale": "linear",
        "group": "look",
        "path": ["tint"],
    });
    let yarn = Fabric::default_yarn();
    let color = |name: &str, meaning: &str, default: Value| {
        json!({
            "name": name,
            "meaning": meaning,
            "default": default,
            "texturable": name != "specular_uniform",
            "path": [name],
        })
    };
    let fabric = Fabric::default();
    json!({
        "numbers": numbers.chain([tint]).collect::<Vec<_>>(),
        "colors": [
            color("color", "diffuse reflectance", Value::Null),
            color("specular", "colour and amount of the highlight", value_of(&yarn.specular)),
            color("specular_uniform", "colour and amount of its uniform part", Value::Null),
        ],
        "choices": [
            { "name": "highlight", "meaning": "what spreads the highlight over a segment",
                "default": name_of(&json!(yarn.highlight)),
                "options": [
                    option(&json!(Highlight::Rough { sigma: default_of("sigma") })),
                    option(&json!(Highlight::default())),
                ] },
            { "name": "phase", "meaning": "scattering about the fibre",
                "default": name_of(&json!(yarn.phase)),
                "options": [
                    option(&json!(Phase::VonMises { alpha: default_of("alpha"), beta: default_of("beta") })),
                    option(&json!(Phase::VonMises3d { alpha: default_of("alpha"), beta: default_of("beta") })),
                    option(&json!(Phase::WrappedCauchy { rho: default_of("rho"), is_backward: false })),
                ] },
            { "name": "diffuse", "meaning": "how the diffuse reflection follows the surface",
                "default": name_of(&json!(yarn.diffuse)),
                "options": [option(&json!(Diffuse::Flat)), option(&json!(Diffuse::YarnNormal))] },
        ],
        "cloth": [
            { "name": "mapping", "meaning": "how segments are laid on cylinders",
                "options": ["linear", "arcsine"], "default": json!(fabric.mapping) },
            { "name": "normalization", "meaning": "what the highlight is normalised to",
                "options": ["segment", "pointwise", "none"], "default": "segment" },
            { "name": "combination", "meaning": "how highlight and diffuse add up",
                "options": ["layered", "lerp"], "default": json!(fabric.combination) },
            { "name": "steep", "meaning": "what becomes of segments too short to bend as far as their yarn",
                "options": ["lower", "reject"], "default": json!(fabric.steep) },
            { "name": "rotation", "meaning": "turn of the weave on the cloth", "unit": "rad",
                "low": -std::f64::consts::TAU, "high": std::f64::consts::TAU, "scale": "linear",
                "default": fabric.rotation },
            { "name": "scale", "meaning": "times how much smaller the weave is than its pitch tells",
                "unit": "", "low": 1e-6, "high": 1e6, "scale": "log", "default": fabric.scale },
            { "name": "seed", "meaning": "chooses the irregularities", "unit": "", "low": 0,
                "high": u32::MAX, "scale": "linear", "default": fabric.seed },
        ],
    })
}

fn number(parameter: &Parameter) -> Value {
    let &Parameter { name, meaning, unit, low, high, .. } = parameter;
    let least = low.abs().max(parameter.default.abs());
    let is_wide = high > WIDE * least.max(1e-9) && (low > 0.0 || high > WIDE);
    json!({
        "name": name,
        "meaning": meaning,
        "unit": unit,
        "low": low,
        "high": high,
        "default": default_of(name),
        "texturable": parameter.is_texturable(),
        "scale": if is_wide { "log" } else { "linear" },
        "group": group(name),
        "path": name.split('.').collect::<Vec<_>>(),
    })
}

/// The value of a number where a fabric says nothing, or that of a kind of yarn that has it.
fn default_of(name: &str) -> f64 {
    let parameter = Yarn::parameter(name);
    let of_default = parameter.and_then(|parameter| parameter.of(&Fabric::default_yarn()));
    of_default.or(parameter.map(|parameter| parameter.default)).unwrap_or_default()
}

fn group(name: &str) -> &'static str {
    match name {
        "opacity" => "look",
        "delta" | "sigma" | "smoothing" => "highlight",
        "alpha" | "beta" | "rho" => "phase",
        _ if name.starts_with("noise.") => "noise",
        _ => "shape",
    }
}

/// The name of a value of a choice: `"flat"`, or `{"rough": {...}}`.
pub(super) fn name_of(value: &Value) -> String {
    let key = value.as_object().and_then(|object| object.keys().next());
    key.map(String::as_str).or(value.as_str()).unwrap_or_default().to_owned()
}

/// What is so where a flag of a choice is set.
fn meaning_of_flag(name: &str) -> &str {
    match name {
        "backward" => "peak on the side of the light",
        name => name,
    }
}

/// A value of a choice with its name and those of its numbers and flags.
fn option(value: &Value) -> Value {
    let name = name_of(value);
    let numbers = value.get(&name).and_then(Value::as_object).map(|numbers| {
        let known = numbers.keys().filter(|name| Yarn::parameter(name).is_some());
        known.cloned().collect::<Vec<_>>()
    });
    let flags = value.get(&name).and_then(Value::as_object).map(|fields| {
        let flags = fields.iter().filter(|(_, value)| value.is_boolean());
        let flags =
            flags.map(|(name, _)| json!({ "name": name, "meaning": meaning_of_flag(name) }));
        flags.collect::<Vec<_>>()
    });
    json!({
        "name": name,
        "value": value,
        "numbers": numbers.unwrap_or_default(),
        "flags": flags.unwrap_or_default(),
    })
}

#[cfg(test)]
mod tests {
    use selvedge_yarn_brdf::PartialYarn;

    use super::*;

    #[test]
    fn every_number_can_be_set_where_it_is_said_to_stand() {
        let all = all();
        for number in all["numbers"].as_array().unwrap() {
            let path = number["path"].as_array().unwrap();
            let value = number["default"].clone();
            let yarn =
                path.iter().rev().fold(value, |value, key| json!({ key.as_str().unwrap(): value }));
            let yarn: PartialYarn = serde_json::from_value(yarn).unwrap();
            assert_eq!(yarn.validate(), Ok(()), "{number}");
        }
        for choice in all["choices"].as_array().unwrap() {
            for option in choice["options"].as_array().unwrap() {
                let yarn = json!({ choice["name"].as_str().unwrap(): option["value"] });
                let yarn: PartialYarn = serde_json::from_value(yarn).unwrap();
                assert_eq!(yarn.validate(), Ok(()), "{option}");
                for flag in option["flags"].as_array().unwrap() {
                    let name = flag["name"].as_str().unwrap();
                    assert_ne!(flag["meaning"], name, "{option}: tells nothing of it");
                }
            }
        }
        for field in all["cloth"].as_array().unwrap() {
            let values = field["options"].as_array().cloned();
            for value in values.unwrap_or_else(|| vec![field["default"].clone()]) {
                let fabric = json!({ field["name"].as_str().unwrap(): value });
                assert!(serde_json::from_value::<Fabric>(fabric.clone()).is_ok(), "{fabric}");
            }
        }
    }

    #[test]
    fn defaults_are_those_of_a_fabric_that_says_nothing() {
        assert_eq!(default_of("psi"), Fabric::default_yarn().psi);
        assert_eq!(default_of("delta"), 0.3);
        let thread = selvedge_yarn_brdf::Thread { color: [0.5; 3], ..Default::default() };
        let weave = selvedge_yarn_brdf::Weave::new(1, 1, |_, _| true).unwrap();
        let cloth = Fabric::default().cloth(weave, &[thread], &[thread]).unwrap();
        let expected = 0.3 * (1.0 - TINT + 0.5 * TINT);
        assert!((f64::from(cloth.yarns[0].specular[0]) - expected).abs() < 1e-6);
    }
}
