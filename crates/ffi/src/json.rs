//! A fabric as JSON: `"version": 1`, a draft, and the fields of a [`Fabric`].

use std::path::Path;

use selvedge_yarn_brdf::Fabric;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Error as _, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;

use crate::draft::{self, Draft};
use crate::status::{Failure, Status};

/// What the text of a fabric holds.
#[derive(Debug, Default)]
pub(crate) struct FabricText {
    pub(crate) draft: Option<Source>,
    pub(crate) fabric: Fabric,
}

/// Where the draft of a fabric is.
#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected the path of a draft or {\"wif\": \"its text\"}")]
pub(crate) enum Source {
    /// In a file, whose path starts where the fabric is.
    Path(String),
    /// In the fabric.
    Inline(Inline),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Inline {
    wif: String,
}

const VERSION: u64 = 1;

impl FabricText {
    /// The fabric in `text`.
    pub(crate) fn parse(text: &[u8]) -> Result<Self, Failure> {
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        serde_json::from_slice(text).map_err(|error| {
            let (line, column) = (error.line(), error.column());
            let what = error.to_string();
            let what = what.split(" at line ").next().unwrap_or_default();
            // As fabrics in files may have pictures.
            let is_image = [", expected f64", ", expected a color"].iter().any(|end| {
                what.strip_prefix("invalid type: map").is_some_and(|rest| rest.starts_with(end))
            });
            let hint =
                if is_image { "; pictures are set by selvedge_fabric_set_texture" } else { "" };
            let text = format!("fabric: line {line}, column {column}: {what}{hint}");
            Failure::new(Status::InvalidFabric, text)
        })
    }
}

impl Source {
    /// The draft of the fabric in the file at `path`.
    pub(crate) fn draft(&self, path: &str) -> Result<Draft, Failure> {
        match self {
            Self::Inline(Inline { wif }) => Draft::from_wif(wif.as_bytes()),
            Self::Path(relative) => {
                let folder = Path::new(path).parent().unwrap_or(Path::new(""));
                Draft::from_wif(&draft::read(&folder.join(relative).to_string_lossy())?)
            }
        }
    }
}

impl<'de> Deserialize<'de> for FabricText {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_map(FabricVisitor)
    }
}

struct FabricVisitor;

impl<'de> Visitor<'de> for FabricVisitor {
    type Value = FabricText;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object, a fabric")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FabricText, A::Error> {
        let mut draft = None;
        let body = MapAccessDeserializer::new(Body { map, draft: &mut draft });
        let fabric = Fabric::deserialize(body)?;
        Ok(FabricText { draft, fabric })
    }
}

/// The entries of a fabric but for its version and draft, which are taken out on the way.
struct Body<'a, A> {
    map: A,
    draft: &'a mut Option<Source>,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Body<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, A::Error> {
        while let Some(key) = self.map.next_key::<String>()? {
            match &*key {
                "version" => {
                    let version: u64 = self.map.next_value()?;
                    if version != VERSION {
                        let what = format_args!("version {version}, expected {VERSION}");
                        return Err(A::Error::custom(what));
                    }
                }
                "draft" => *self.draft = Some(self.map.next_value()?),
                _ => return seed.deserialize(key.into_deserializer()).map(Some),
            }
        }
        Ok(None)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fabric_may_name_a_version_and_a_draft() {
        for text in [
            "{}",
            "{\"version\": 1}",
            "\u{feff}{\"draft\": \"a.wif\", \"version\": 1}",
            "{\"draft\": {\"wif\": \"[WIF]\"}}",
        ] {
            let found = FabricText::parse(text.as_bytes()).unwrap();
            assert_eq!(found.fabric, Fabric::default(), "{text}");
            assert_eq!(found.draft.is_some(), text.contains("draft"), "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, expected) in [
            ("", "fabric: line 1, column 0: EOF while parsing a value"),
            (
                "[]",
                "fabric: line 1, column 0: invalid type: sequence, expected an object, a fabric",
            ),
            ("{\n\"version\": 2}", "fabric: line 2, column 13: version 2, expected 1"),
            (
                "{\"yarn\": {\n\"sigm\": 1}}",
                "fabric: line 2, column 6: unknown field `sigm`, expected one of `color`",
            ),
        ] {
            let failure = FabricText::parse(text.as_bytes()).unwrap_err();
            assert_eq!(failure.status, Status::InvalidFabric);
            assert!(failure.text.starts_with(expected), "{}\nexpected\n{expected}", failure.text);
        }
    }

    #[test]
    fn pictures_are_left_to_the_host() {
        for name in ["psi", "color"] {
            let text = format!("{{\"yarn\": {{\"{name}\": {{\"image\": \"a.png\"}}}}}}");
            let failure = FabricText::parse(text.as_bytes()).unwrap_err();
            let expected = "; pictures are set by selvedge_fabric_set_texture";
            assert!(failure.text.ends_with(expected), "{}", failure.text);
        }
    }
}
