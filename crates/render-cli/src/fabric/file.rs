//! The fabric as a file: `"version": 1`, a draft, and the fields of a [`Fabric`].

use std::{borrow::Cow, fmt, path::PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use selvedge_yarn_brdf::Fabric;
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{
        DeserializeSeed, Error as _, IntoDeserializer, MapAccess, Visitor,
        value::MapAccessDeserializer,
    },
};
use serde_json::json;

use super::images::{self, Found, TakenOut, Written as Image};
use crate::json;

/// What a file holds.
#[derive(Debug, PartialEq)]
pub(super) struct FabricFile {
    pub(super) draft: DraftSource,
    /// Without the pictures in the place of values.
    pub(super) fabric: Fabric,
    pub(super) images: Vec<Found>,
}

/// Where the draft of a fabric is.
#[derive(Debug, PartialEq)]
pub(super) enum DraftSource {
    /// In a file: `"draft": "PATH"`.
    Path(PathBuf),
    /// Here: `"draft": {"wif": "TEXT"}`.
    Inline(String),
}

/// A file to be written.
#[derive(Serialize)]
pub(super) struct Written<'a> {
    pub(super) version: u64,
    pub(super) draft: serde_json::Value,
    #[serde(flatten)]
    pub(super) fabric: &'a Fabric,
}

pub(super) const VERSION: u64 = 1;

/// The keys that are not those of a [`Fabric`].
const HEAD: [&str; 2] = ["version", "draft"];

/// The fabric in `text`, or where what is wrong with it, and what would not be.
pub(super) fn parse(text: &[u8]) -> Result<FabricFile, String> {
    let (rest, images) = match images::take_out(text)? {
        Some(TakenOut { rest, images }) => (Cow::Owned(rest), images),
        None => (Cow::Borrowed(text), Vec::new()),
    };
    // The keys of the head are handed on to a fabric no more than its own are to the head.
    let more: fn(&[&str]) -> &'static [&'static str] =
        |known| if known.contains(&"overrides") { &HEAD } else { &[] };
    let file: FabricFile = json::parse(&rest, &more)?;
    Ok(FabricFile { images, ..file })
}

impl<'de> Deserialize<'de> for FabricFile {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_map(FileVisitor)
    }
}

struct FileVisitor;

impl<'de> Visitor<'de> for FileVisitor {
    type Value = FabricFile;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object, a fabric")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FabricFile, A::Error> {
        let mut head = Head { version: None, draft: None };
        let body = MapAccessDeserializer::new(Body { map, head: &mut head });
        let fabric = Fabric::deserialize(body)?;
        if head.version.is_none() {
            return Err(A::Error::missing_field("version"));
        }
        let draft = head.draft.ok_or_else(|| A::Error::missing_field("draft"))?;
        Ok(FabricFile { draft, fabric, images: Vec::new() })
    }
}

struct Head {
    version: Option<()>,
    draft: Option<DraftSource>,
}

/// The entries of a file but for those of its head, which are put there on the way.
struct Body<'a, A> {
    map: A,
    head: &'a mut Head,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Body<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, A::Error> {
        while let Some(key) = self.map.next_key::<String>()? {
            let is_second = match &*key {
                "version" => {
                    let version: u64 = self.map.next_value()?;
                    if version != VERSION {
                        let message = format_args!("version {version}, expected {VERSION}");
                        return Err(A::Error::custom(message));
                    }
                    self.head.version.replace(()).is_some()
                }
                "draft" => self.head.draft.replace(self.map.next_value()?).is_some(),
                _ => return seed.deserialize(key.into_deserializer()).map(Some),
            };
            if is_second {
                return Err(A::Error::custom(format_args!("duplicate field `{key}`")));
            }
        }
        Ok(None)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

/// A draft, and the yarn that it is woven in. Paths start at the file.
#[derive(JsonSchema)]
#[schemars(title = "A fabric of Selvedge", deny_unknown_fields)]
#[expect(dead_code, reason = "its fields are there to be described")]
struct Described {
    /// Version of the format, 1.
    #[schemars(extend("const" = VERSION))]
    version: u64,
    /// What is woven.
    draft: DraftSource,
    #[schemars(flatten)]
    fabric: Fabric,
}

impl JsonSchema for FabricFile {
    fn schema_name() -> Cow<'static, str> {
        "Fabric".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let schema = Described::json_schema(generator);
        let image = generator.subschema_for::<Image>();
        let yarn = generator.definitions_mut().get_mut("PartialYarn");
        let values = yarn.and_then(|yarn| yarn.get_mut("properties")?.as_object_mut());
        for (name, value) in values.into_iter().flatten() {
            if images::names().any(|known| known == name) {
                *value = json!({ "anyOf": [value.take(), &image] });
            }
        }
        schema
    }
}

impl JsonSchema for DraftSource {
    fn schema_name() -> Cow<'static, str> {
        "DraftSource".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [
                { "description": "The path of a draft (WIF)", "type": "string" },
                {
                    "description": "The text of a draft (WIF)",
                    "type": "object",
                    "properties": { "wif": { "type": "string" } },
                    "required": ["wif"],
                    "additionalProperties": false
                }
            ]
        })
    }
}

impl<'de> Deserialize<'de> for DraftSource {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Inline {
            wif: String,
        }
        struct DraftVisitor;
        impl<'de> Visitor<'de> for DraftVisitor {
            type Value = DraftSource;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the path of a draft or {\"wif\": \"its text\"}")
            }

            fn visit_str<E>(self, path: &str) -> Result<DraftSource, E> {
                Ok(DraftSource::Path(path.into()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<DraftSource, A::Error> {
                let inline = Inline::deserialize(MapAccessDeserializer::new(map))?;
                Ok(DraftSource::Inline(inline.wif))
            }
        }
        from.deserialize_any(DraftVisitor)
    }
}

#[cfg(test)]
mod tests {
    use selvedge_yarn_brdf::{Highlight, Mapping, Mode, Override, PartialYarn, Phase};

    use super::*;

    #[test]
    fn file_reads_as_it_is_written() {
        let text = r##"{
            "version": 1,
            "draft": "../drafts/tartan.wif",
            "yarn": {
                "u_max": 0.4, "tint": 0.5, "specular": 0.25, "color": "#ffffff",
                "highlight": { "rough": { "sigma": 0.2 } },
                "phase": { "von_mises": { "alpha": 0.05, "beta": 4 } },
                "noise": { "width": 0.1 }
            },
            "overrides": [
                { "warp": true, "color": 3, "yarn": { "psi": -0.5, "specular": [0.5, 0.4, 0] } },
                { "threads": [1, 8], "yarn": { "highlight": { "window": { "delta": 1 } } } }
            ],
            "mapping": "linear", "normalization": "none", "rotation": 0.5, "scale": 2, "seed": 7
        }"##;
        let file = parse(text.as_bytes()).unwrap();
        assert_eq!(file.draft, DraftSource::Path("../drafts/tartan.wif".into()));
        let yarn = PartialYarn {
            u_max: Some(0.4),
            tint: Some(0.5),
            specular: Some([0.25; 3]),
            color: Some([1.0; 3]),
            highlight: Some(Highlight::Rough { sigma: 0.2 }),
            phase: Some(Phase::VonMises { alpha: 0.05, beta: 4.0 }),
            noise: selvedge_yarn_brdf::PartialNoise { width: Some(0.1), ..Default::default() },
            ..PartialYarn::default()
        };
        let first = PartialYarn {
            psi: Some(-0.5),
            specular: Some([0.5, 0.4, 0.0]),
            ..PartialYarn::default()
        };
        let second = PartialYarn {
            highlight: Some(Highlight::Window { delta: 1.0 }),
            ..PartialYarn::default()
        };
        let expected = Fabric {
            yarn,
            overrides: vec![
                Override { is_warp: Some(true), color: Some(3), threads: None, yarn: first },
                Override { threads: Some([1, 8]), yarn: second, ..Override::default() },
            ],
            mapping: Mapping::Linear,
            normalization: Mode::None,
            rotation: 0.5,
            scale: 2.0,
            seed: 7,
            ..Fabric::default()
        };
        assert_eq!(file.fabric, expected);

        // And back, without what is open.
        let json = serde_json::to_string(&expected).unwrap();
        assert!(!json.contains("null"), "{json}");
        assert_eq!(serde_json::from_str::<Fabric>(&json).unwrap(), expected);
    }

    #[test]
    fn draft_can_be_text_in_the_file() {
        let file = parse(br#"{"draft": {"wif": "[WIF]\n"}, "version": 1}"#).unwrap();
        assert_eq!(file.draft, DraftSource::Inline("[WIF]\n".to_owned()));
        assert_eq!(file.fabric, Fabric::default());
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let cases = [
            ("", "line 1, column 1: found the end of the file, expected more"),
            ("[]", "line 1, column 1: found a list, expected an object, a fabric"),
            ("{\n}", "line 2, column 1: found no \"version\", expected one"),
            ("{\"version\": 1}", "line 1, column 14: found no \"draft\", expected one"),
            ("{\"version\": 2", "line 1, column 13: found version 2, expected 1"),
            (
                "{\"version\": \"1\"",
                "line 1, column 15: found string \"1\", expected a whole number, 0 or greater",
            ),
            (
                "{\"version\": 1, \"version\": 1",
                "line 1, column 27: found \"version\" a second time, expected it once",
            ),
            ("{\"verison\": 1", "line 1, column 10: unknown key \"verison\", expected \"version\""),
            (
                "{\n\"yarn\": {\n\"sigm\": 1}}",
                "line 3, column 6: unknown key \"sigm\", expected \"sigma\"",
            ),
            (
                "{\"yarn\": {\"noise\": {\"slubs\": 1",
                "line 1, column 27: unknown key \"slubs\", expected \"slub_rate\"",
            ),
            (
                "{\"yarn\": {\"highlight\": {\"glossy\": {}}}}",
                "line 1, column 32: unknown name \"glossy\", expected one of window, rough",
            ),
            (
                "{\"overrides\": [{\"weft\": true",
                "line 1, column 22: unknown key \"weft\", expected one of warp, color, threads, yarn",
            ),
            (
                "{\"yarn\": {\"psi\": \"Z\"",
                "line 1, column 20: found string \"Z\", expected a number",
            ),
            (
                "{\"yarn\": {\"color\": \"red\"",
                "line 1, column 24: found color \"red\", expected \"#rrggbb\"",
            ),
            (
                "{\"yarn\": {\"color\": [1, 2]",
                "line 1, column 25: found a list of 2, expected a color: [red, green, blue], a number or \"#rrggbb\"",
            ),
            (
                "{\"draft\": 3",
                "line 1, column 11: found integer 3, expected the path of a draft or {\"wif\": \"its text\"}",
            ),
            (
                "{\"yarn\": 3",
                "line 1, column 10: found integer 3, expected an object of parameters",
            ),
            (
                "{\"scale\": 1e999",
                "line 1, column 15: found a number out of range, expected a smaller one",
            ),
        ];
        for (text, expected) in cases {
            assert_eq!(parse(text.as_bytes()).unwrap_err(), expected, "{text}");
        }
    }

    #[test]
    fn depth_does_not_overflow() {
        let text = "{\"yarn\":".to_owned() + &"[".repeat(100_000);
        assert!(parse(text.as_bytes()).is_err());
    }
}
