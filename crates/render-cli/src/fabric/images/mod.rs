//! Pictures in the place of values of a yarn:
//!
//! ```json
//! "psi": { "image": "twist.png", "mm": [12, 8], "range": [-0.5, 0.5] }
//! ```

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::{DVec2, Vec2};
use schemars::JsonSchema;
use selvedge_yarn_brdf::{Fabric, Target, Texture, Yarn};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json, value::RawValue};

use crate::{
    data_uri,
    image::{self, luminance},
    input, json,
    render::hash::Fnv,
    scene::texture::{Encoding, MipTexture},
};

/// Most bytes of the file of one picture.
const MAX_BYTES: u64 = 1 << 26;

/// Most numbers of all pictures of a fabric: three for each pixel of 4096 × 4096, in up to 256 MiB of
/// memory.
pub const MAX_NUMBERS: u64 = 3 << 24;

/// Sides of the cloth after which a picture repeats, mm.
const SIDES: [f64; 2] = [0.1, 1e5];

/// Repeats over which the mean is that of the whole picture.
const MANY: f64 = 1e3;

/// A picture in the place of a value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "an object, an image")]
#[schemars(rename = "Image")]
pub(super) struct Written {
    /// The path of a PNG, EXR or HDR picture, which starts at the file, or its bytes as a `data:` URI in
    /// base 64. A colour is decoded from sRGB where it is in integers; a number is linear, of a picture
    /// in colour its luminance.
    image: String,
    /// Width along the weft and height along the warp after which it repeats: mm, in [0.1, 100000]. Its
    /// lower left corner is where the draft begins.
    #[schemars(inner(range(min = SIDES[0], max = SIDES[1])))]
    mm: [f64; 2],
    /// The numbers that black and white stand for, for all but colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
}

/// Where in a fabric a picture stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    /// The override by its index; `None` for what all yarn has.
    layer: Option<usize>,
    name: &'static str,
}

/// A picture as it was found.
#[derive(Debug, PartialEq)]
pub(super) struct Found {
    place: Place,
    written: Written,
}

/// The text of a fabric with nulls in the places of its pictures, and those.
#[derive(Debug)]
pub(super) struct TakenOut {
    pub(super) rest: Vec<u8>,
    pub(super) images: Vec<Found>,
}

/// A picture of a fabric.
#[derive(Clone, Debug)]
pub(super) struct FabricImage {
    place: Place,
    /// How it is written; `image` is its path or, without one, empty.
    written: Written,
    bytes: Arc<[u8]>,
    texture: Arc<Pattern>,
}

/// Where pictures come from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Origin<'a> {
    /// Also from files, whose paths start in this folder.
    Folder(&'a Path),
    /// Only from the fabric itself; those that are known already need not be decoded again.
    Inline(&'a [FabricImage]),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.layer {
            None => write!(f, "yarn.{}", self.name),
            Some(index) => write!(f, "overrides[{index}].yarn.{}", self.name),
        }
    }
}

/// What a picture under this name determines, if one can stand there.
fn target_of(name: &str) -> Option<(&'static str, Target)> {
    match name {
        "color" => Some(("color", Target::Color)),
        "specular" => Some(("specular", Target::Specular)),
        _ => {
            let parameter = Yarn::parameter(name).filter(|parameter| parameter.is_texturable())?;
            Some((parameter.name, Target::Parameter(parameter.name)))
        }
    }
}

/// The names of all that a picture can determine.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    let numbers = Yarn::parameters().iter().map(|parameter| parameter.name);
    ["color", "specular"].into_iter().chain(numbers).filter(|name| target_of(name).is_some())
}

/// The pictures in a fabric, taken out of its text: all else is where it was. `None`
/// where there are none, or `text` is not such that they could be found.
///
/// # Errors
///
/// Where a picture is not written as it should be, what was found, and what was expected.
pub(super) fn take_out(text: &[u8]) -> Result<Option<TakenOut>, String> {
    #[derive(Deserialize)]
    struct Layer<'a> {
        #[serde(borrow, default)]
        yarn: Option<&'a RawValue>,
    }
    #[derive(Deserialize)]
    struct File<'a> {
        #[serde(borrow, default)]
        yarn: Option<&'a RawValue>,
        #[serde(borrow, default)]
        overrides: Option<&'a RawValue>,
    }
    // What is wrong elsewhere is told when it is read.
    let Ok(file) = serde_json::from_slice::<File<'_>>(text) else { return Ok(None) };
    let overrides =
        file.overrides.and_then(|raw| serde_json::from_str::<Vec<&RawValue>>(raw.get()).ok());
    let of_overrides = overrides.into_iter().flatten().enumerate().filter_map(|(index, raw)| {
        let layer = serde_json::from_str::<Layer<'_>>(raw.get()).ok()?;
        Some((Some(index), layer.yarn?))
    });
    let yarns = file.yarn.map(|yarn| (None, yarn)).into_iter().chain(of_overrides);
    let mut rest = text.to_vec();
    let mut all = Vec::new();
    for (layer, yarn) in yarns {
        let Ok(values) = serde_json::from_str::<BTreeMap<String, &RawValue>>(yarn.get()) else {
            continue;
        };
        for (name, raw) in values {
            let Some((name, _)) = target_of(&name).filter(|_| raw.get().starts_with('{')) else {
                continue;
            };
            let place = Place { layer, name };
            let written = json::parse::<Written>(raw.get().as_bytes(), &|_| &[])
                .map_err(|what| format!("{place}: {}", json::without_line(&what)))?;
            let start = raw.get().as_ptr().addr() - text.as_ptr().addr();
            put_null(&mut rest[start..start + raw.get().len()]);
            all.push(Found { place, written });
        }
    }
    Ok((!all.is_empty()).then_some(TakenOut { rest, images: all }))
}

/// Writes a null over a value with a key, whose lines stay as they are.
fn put_null(value: &mut [u8]) {
    const NULL: &[u8] = b"null";
    let is_line = |place: &[u8]| place.iter().all(|byte| !matches!(byte, b'\r' | b'\n'));
    let at = value.windows(NULL.len()).position(is_line).expect("keys do not span lines");
    value.iter_mut().filter(|byte| !matches!(byte, b'\r' | b'\n')).for_each(|byte| *byte = b' ');
    value[at..at + NULL.len()].copy_from_slice(NULL);
}

/// Reads the pictures that were found.
///
/// # Errors
///
/// Where there is none, what was found, and what was expected.
pub(super) fn load(all: Vec<Found>, origin: Origin<'_>) -> Result<Vec<FabricImage>, String> {
    let mut room = MAX_NUMBERS;
    let mut images: Vec<FabricImage> = Vec::new();
    for Found { place, written } in all {
        let wrong = |part: &str, what: String| format!("{place}.{part}: {what}");
        let meaning = Meaning::new(place, &written)?;
        let (bytes, path) = read(&written.image, origin).map_err(|what| wrong("image", what))?;
        let numbers = image::numbers(&bytes).map_err(|error| wrong("image", chain(error)))?;
        room = room.checked_sub(numbers).ok_or_else(|| {
            let most = format_args!("at most {MAX_NUMBERS} in all pictures of a fabric");
            wrong("image", format!("found {numbers} numbers, expected {most}"))
        })?;
        let written = Written { image: path.unwrap_or_default(), ..written };
        let before = match origin {
            Origin::Inline(before) => before,
            Origin::Folder(_) => &[],
        };
        let known = || before.iter().chain(&images).filter(|known| *known.bytes == *bytes);
        let is_same = |known: &&FabricImage| {
            known.texture.meaning == meaning && known.written.mm == written.mm
        };
        // Where it was before it keeps its file.
        let same = known().filter(is_same).find(|known| known.place == place);
        let same = same.or_else(|| known().find(is_same));
        let (bytes, written, texture) = match same {
            Some(same) => {
                let path =
                    if written.image.is_empty() { &same.written.image } else { &written.image };
                let written = Written { image: path.clone(), ..written };
                (Arc::clone(&same.bytes), written, Arc::clone(&same.texture))
            }
            None => {
                let alike =
                    known().find(|known| known.texture.meaning.encoding() == meaning.encoding());
                let picture = match alike {
                    Some(alike) => Arc::clone(&alike.texture.picture),
                    None => {
                        let texels = image::texels(&bytes).map_err(|e| wrong("image", chain(e)))?;
                        let picture = MipTexture::new(&texels, meaning.encoding());
                        Arc::new(picture.map_err(|error| wrong("image", chain(error)))?)
                    }
                };
                let size = DVec2::from(written.mm) * 1e-3;
                (bytes.into(), written, Arc::new(Pattern::new(picture, size, meaning)))
            }
        };
        images.push(FabricImage { place, written, bytes, texture });
    }
    images.sort_by_key(|image| image.place);
    Ok(images)
}

/// The bytes of a picture, and its path if it has one.
fn read(image: &str, origin: Origin<'_>) -> Result<(Vec<u8>, Option<String>), String> {
    if let Some(bytes) = data_uri::decode(image) {
        return Ok((bytes?, None));
    }
    match origin {
        Origin::Inline(_) => Err("found a path, expected a data: URI".to_owned()),
        Origin::Folder(folder) => {
            let bytes = input::read(&folder.join(image), "picture", MAX_BYTES).map_err(chain)?;
            Ok((bytes, Some(image.to_owned())))
        }
    }
}

fn chain(error: impl Into<anyhow::Error>) -> String {
    format!("{:#}", error.into())
}

/// Puts the pictures where they stand in `fabric`, in which they were found.
pub(super) fn install(fabric: &mut Fabric, images: &[FabricImage]) {
    for FabricImage { place, texture, .. } in images {
        let yarn = match place.layer {
            None => Some(&mut fabric.yarn),
            Some(index) => fabric.overrides.get_mut(index).map(|rule| &mut rule.yarn),
        };
        if let (Some(yarn), Some((_, target))) = (yarn, target_of(place.name)) {
            yarn.textures.set(target, Arc::clone(texture) as Arc<dyn Texture>);
        }
    }
}

impl FabricImage {
    /// The parameter that it determines, by its name in files.
    pub(super) fn name(&self) -> &'static str {
        self.place.name
    }

    /// Its file, if it was read from one and the fabric is in `folder`.
    pub(super) fn file(&self, folder: &Path) -> Option<PathBuf> {
        (!self.written.image.is_empty()).then(|| folder.join(&self.written.image))
    }

    /// Puts it into the JSON of its fabric: as the path that it was read from, or else as a `data:` URI.
    pub(super) fn write(&self, fabric: &mut Value, is_inline: bool) {
        let mut written = self.written.clone();
        if is_inline || written.image.is_empty() {
            written.image = data_uri::encode(image::media_type(&self.bytes), &self.bytes);
        }
        let yarn = match self.place.layer {
            None => &mut fabric["yarn"],
            Some(index) => &mut fabric["overrides"][index]["yarn"],
        };
        yarn[self.place.name] = json!(written);
    }

    /// Adds all that the cloth has of it to a hash.
    pub(super) fn hash(&self, hash: &mut Fnv) {
        let Written { mm, range, .. } = self.written;
        hash.add(format!("\0{} {mm:?} {range:?}\0", self.place).as_bytes());
        hash.add(&self.bytes);
    }
}

/// What the numbers of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    Color,
    /// From the first at black to the second at white.
    Number([f32; 2]),
}

impl Meaning {
    fn new(place: Place, written: &Written) -> Result<Self, String> {
        let [least, most] = SIDES;
        if !written.mm.iter().all(|side| (least..=most).contains(side)) {
            let [width, height] = written.mm;
            return Err(format!(
                "{place}.mm: found {width} by {height}, expected {least} to {most} each"
            ));
        }
        let parameter = Yarn::parameter(place.name);
        match (parameter, written.range) {
            (None, None) => Ok(Self::Color),
            (None, Some(_)) => Err(format!("{place}.range: found one, expected none for a colour")),
            (Some(_), None) => {
                Err(format!("{place}: found no \"range\", expected the numbers of black and white"))
            }
            (Some(parameter), Some(range)) => {
                for limit in range {
                    parameter.check(limit).map_err(|error| format!("{place}.range: {error}"))?;
                }
                Ok(Self::Number(range.map(|limit| limit as f32)))
            }
        }
    }

    fn encoding(self) -> Encoding {
        match self {
            Self::Color => Encoding::Srgb,
            Self::Number(_) => Encoding::Linear,
        }
    }
}

/// A picture that repeats over the cloth.
#[derive(Debug)]
struct Pattern {
    picture: Arc<MipTexture>,
    /// Of one repeat, m.
    size: DVec2,
    meaning: Meaning,
    /// Of its values.
    range: [f32; 2],
}

impl Pattern {
    fn new(picture: Arc<MipTexture>, size: DVec2, meaning: Meaning) -> Self {
        let range = match meaning {
            Meaning::Color => [0.0, 1.0],
            Meaning::Number([black, white]) => {
                let shares = picture.extremes().map(|extreme| extreme.clamp(0.0, 1.0));
                let [a, b] = shares.map(|share| black + (white - black) * share);
                [a.min(b), a.max(b)]
            }
        };
        Self { picture, size, meaning, range }
    }
}

impl Texture for Pattern {
    fn value(&self, uv: DVec2, footprint: f64) -> [f32; 3] {
        let at = uv / self.size;
        // Far from the origin single precision would lose it.
        let at = (at - at.floor()).as_vec2();
        let [width, height] = self.size.to_array().map(|side| (footprint / side).min(MANY) as f32);
        let steps = [Vec2::new(width, 0.0), Vec2::new(0.0, height)];
        let value = self.picture.value(at, steps).clamp(glam::Vec3::ZERO, glam::Vec3::ONE);
        match self.meaning {
            Meaning::Color => value.to_array(),
            Meaning::Number([black, white]) => {
                let [low, high] = self.range;
                [(black + (white - black) * luminance(value)).clamp(low, high); 3]
            }
        }
    }

    fn range(&self) -> [f32; 2] {
        self.range
    }
}

#[cfg(test)]
mod tests;
