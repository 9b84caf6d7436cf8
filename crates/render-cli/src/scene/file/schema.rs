//! What the JSON Schema of a scene says of numbers, as [`SceneFile::check`](super::SceneFile::check)
//! finds them right.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use selvedge_yarn_brdf::Color;

use super::ColorSource;

/// A length or a factor above 0.
pub(super) fn length(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": "number", "minimum": 1e-6, "maximum": 1e6 })
}

/// Width and height.
pub(super) fn lengths(generator: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": "array", "items": length(generator), "minItems": 2, "maxItems": 2 })
}

/// Three coordinates.
pub(super) fn point(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "type": "array",
        "items": { "type": "number", "minimum": -1e6, "maximum": 1e6 },
        "minItems": 3,
        "maxItems": 3
    })
}

/// Shares of light.
pub(super) fn share(_: &mut SchemaGenerator) -> Schema {
    Color::schema_within(0.0, 1.0)
}

/// Radiance or irradiance.
pub(super) fn emission(_: &mut SchemaGenerator) -> Schema {
    Color::schema_within(0.0, 1e9)
}

/// The names of [`Filter`](crate::render::film::Filter).
pub(super) fn filter(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": ["gaussian", "box"] })
}

impl JsonSchema for ColorSource {
    fn schema_name() -> Cow<'static, str> {
        "ColorSource".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [
                share(generator),
                { "description": "The path of a PNG", "type": "string", "pattern": "^([^#]|$)" }
            ]
        })
    }
}
