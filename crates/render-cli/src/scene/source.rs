//! From the name of what is to be rendered to a cloth or a scene, with what the command line sets.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::{Value, map::Map};

use super::file::{self, SceneFile};
use crate::json;

/// What is to be rendered.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A cloth alone: a draft, a fabric or a preset.
    Cloth(PathBuf),
    /// A scene, and the folder that its paths start from.
    Scene(Box<SceneFile>, PathBuf),
}

/// What the names of scenes that are compiled in begin with.
pub const SCENE: &str = "scene:";

/// The scenes that are compiled in.
const SCENES: [(&str, &str); 2] = [
    ("sheet", include_str!("../../../../fixtures/scenes/sheet.json")),
    ("wrinkled", include_str!("../../../../fixtures/scenes/wrinkled.json")),
];

/// The text of the scene that is compiled in under `name`.
pub(crate) fn built_in(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// Most bytes of a scene's file.
const MAX_BYTES: u64 = 1 << 26;

/// A number of a scene that the command line sets: `film.size=[640, 480]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    path: String,
    value: Value,
}

impl std::str::FromStr for Setting {
    type Err = String;

    /// `PATH=VALUE`, the value in JSON or, where it is none, a string.
    fn from_str(text: &str) -> Result<Self, String> {
        let (path, value) = text
            .split_once('=')
            .filter(|(path, _)| !path.is_empty())
            .ok_or("expected PATH=VALUE, as in film.size=[640,480]")?;
        let value = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.to_owned()));
        Ok(Self { path: path.to_owned(), value })
    }
}

/// Reads what `path` names: a scene is a file of JSON with a camera, or `scene:NAME`; all else is a
/// cloth.
///
/// # Errors
///
/// A line *where: what was found, expected what* for what looks like a scene and is none, and for
/// settings of a cloth, which has nothing to set.
pub fn read(path: &Path, settings: &[Setting]) -> anyhow::Result<Source> {
    let name = path.display().to_string();
    let text = match path.to_str().and_then(|path| path.strip_prefix(SCENE)) {
        Some(wanted) => {
            let found = SCENES.iter().find(|(name, _)| *name == wanted);
            let known = SCENES.map(|(name, _)| name);
            let unknown = || {
                let expected = json::nearest(wanted, &known);
                anyhow::anyhow!("{name}: found no such scene, expected {expected}")
            };
            found.ok_or_else(unknown)?.1.as_bytes().to_owned()
        }
        None => match scene_text(path) {
            Some(text) => text,
            None if settings.is_empty() => return Ok(Source::Cloth(path.to_owned())),
            None => {
                anyhow::bail!("{name}: found a cloth, expected a scene, of which --set sets parts")
            }
        },
    };
    let file = file::parse(&text).map_err(|what| anyhow::anyhow!("{name}: {what}"))?;
    let file = if settings.is_empty() { file } else { set(&text, settings)? };
    let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
    Ok(Source::Scene(Box::new(file), folder))
}

/// The text of the file at `path` if it looks like a scene.
fn scene_text(path: &Path) -> Option<Vec<u8>> {
    if fs::metadata(path).ok()?.len() > MAX_BYTES {
        return None;
    }
    let text = fs::read(path).ok()?;
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    is_scene(text).then(|| text.to_owned())
}

/// Whether `text` looks like a scene.
pub(crate) fn is_scene(text: &[u8]) -> bool {
    let starts = text.trim_ascii_start().starts_with(b"{");
    // Before it is known to be JSON: a scene with a slip in it, or without one of its parts, shall be
    // told as a scene. A fabric has none of these.
    let names = |key: &[u8]| text.windows(key.len()).any(|window| window == key);
    let parts: [&[u8]; 4] = [b"\"camera\"", b"\"materials\"", b"\"objects\"", b"\"lights\""];
    starts && parts.into_iter().any(names)
}

/// The scene of `text` with `settings`.
fn set(text: &[u8], settings: &[Setting]) -> anyhow::Result<SceneFile> {
    let mut root: Value = serde_json::from_slice(text)?;
    for Setting { path, value } in settings {
        let place =
            place_of(&mut root, path).map_err(|what| anyhow::anyhow!("--set {path}: {what}"))?;
        *place = value.clone();
        // One by one, to tell which of them is wrong.
        let text = serde_json::to_vec(&root)?;
        file::parse(&text)
            .map_err(|what| anyhow::anyhow!("--set {path}: {}", json::without_line(&what)))?;
    }
    let text = serde_json::to_vec(&root)?;
    file::parse(&text).map_err(|what| anyhow::anyhow!("--set: {what}"))
}

/// The place that `path` names: keys, and numbers of entries from 0, between dots. A key at its
/// end need not exist.
fn place_of<'a>(root: &'a mut Value, path: &str) -> Result<&'a mut Value, String> {
    let mut place = root;
    let mut steps = path.split('.').peekable();
    while let Some(step) = steps.next() {
        if place.is_null() {
            *place = Value::Object(Map::new());
        }
        place = match place {
            Value::Object(map) => {
                let is_known = map.contains_key(step);
                if !is_known && steps.peek().is_some() && map.is_empty() {
                    return Err(format!("found nothing at {step:?}, expected a key"));
                }
                map.entry(step).or_insert(Value::Null)
            }
            Value::Array(list) => {
                let count = list.len();
                let entry = step.parse::<usize>().ok().and_then(|index| list.get_mut(index));
                entry.ok_or_else(|| format!("found {step:?}, expected a number below {count}"))?
            }
            _ => return Err(format!("found {step:?} in a value without parts, expected the end")),
        };
    }
    Ok(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(settings: &[&str]) -> anyhow::Result<SceneFile> {
        let settings: Vec<Setting> = settings
            .iter()
            .map(|text| text.parse().map_err(anyhow::Error::msg))
            .collect::<Result<_, _>>()?;
        match read(Path::new("scene:sheet"), &settings)? {
            Source::Scene(file, _) => Ok(*file),
            Source::Cloth(path) => anyhow::bail!("{}: no scene", path.display()),
        }
    }

    #[test]
    fn every_compiled_scene_is_one() {
        for (name, _) in SCENES {
            assert!(matches!(read(format!("scene:{name}").as_ref(), &[]), Ok(Source::Scene(..))));
        }
    }

    #[test]
    fn settings_change_a_scene() {
        let file =
            sheet(&["film.size=[64,48]", "depth=1", "lights.1.constant.radiance=2"]).unwrap();
        assert_eq!(file.film.size, [64, 48]);
        assert_eq!(file.depth, 1);
        let file = sheet(&["materials.cloth={\"diffuse\": {\"reflectance\": 0.5}}"]).unwrap();
        assert_eq!(file.materials.len(), 1);
        let file = sheet(&["materials.cloth.cloth.fabric=a b.wif"]).unwrap();
        let expected =
            super::file::MaterialFile::Cloth { fabric: "a b.wif".to_owned(), noise: false };
        assert_eq!(file.materials["cloth"], expected);
    }

    #[test]
    fn settings_that_mean_nothing_are_told() {
        for (settings, expected) in [
            ("depth", "expected PATH=VALUE, as in film.size=[640,480]"),
            ("=3", "expected PATH=VALUE, as in film.size=[640,480]"),
            ("depth=0", "--set depth: depth: found 0, expected 1 to 256"),
            ("depht=2", "--set depht: unknown key \"depht\", expected \"depth\""),
            ("lights.7=1", "--set lights.7: found \"7\", expected a number below 2"),
            ("depth.x=1", "--set depth.x: found \"x\" in a value without parts, expected the end"),
            ("film.size=3", "--set film.size: found integer 3, expected a list of 2 numbers"),
        ] {
            assert_eq!(sheet(&[settings]).unwrap_err().to_string(), expected, "{settings}");
        }
        let missing = read(Path::new("scene:sheep"), &[]).unwrap_err().to_string();
        assert_eq!(missing, "scene:sheep: found no such scene, expected \"sheet\"");
    }
}
