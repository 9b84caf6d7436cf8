//! From the name of a draft or a fabric to a cloth.

mod file;
mod images;
pub mod presets;

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
    sync::Arc,
};

use schemars::Schema;
use selvedge_wif::Drawdown;
use selvedge_yarn_brdf::{Cloth, ClothError, Fabric, Shader, Thread, Weave, Yarn};
use serde_json::{Map, Value, json};
use thiserror::Error;

pub use self::images::MAX_NUMBERS;
use self::{
    file::{DraftSource, FabricFile},
    images::{FabricImage, Found, Origin},
    presets::PRESETS,
};
use crate::{
    draft::{self, DraftError, DraftFile},
    input, json,
    render::hash::Fnv,
    scene::source::is_scene,
};

/// A draft, and in what yarn it is woven.
#[derive(Clone, Debug)]
pub struct FabricSource {
    name: String,
    draft: Arc<DraftFile>,
    /// Where the draft is, if the file names one.
    draft_path: Option<PathBuf>,
    fabric: Fabric,
    /// Those in the fabric, in the order of their places.
    images: Vec<FabricImage>,
}

/// Why a file gives no cloth.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FabricError {
    /// The file is no draft.
    #[error(transparent)]
    Draft(#[from] DraftError),
    /// The file is no fabric.
    #[error("{name}: {what}")]
    NotAFabric {
        /// The file.
        name: String,
        /// Where, what was found, and what was expected.
        what: String,
    },
    /// The draft of the fabric is none.
    #[error("{name}: draft")]
    DraftOf {
        /// The file of the fabric.
        name: String,
        /// What is wrong with the draft.
        source: DraftError,
    },
    /// Draft and fabric make no cloth.
    #[error("{name}")]
    NoCloth {
        /// The file.
        name: String,
        /// What does not fit.
        source: ClothError,
    },
}

/// What the names of fabrics that are compiled in begin with.
pub const PRESET: &str = "preset:";

/// Reads the draft or fabric at `path`, or from standard input for `-`, or takes the fabric that is
/// compiled in as `preset:NAME`.
///
/// A fabric is an object in JSON, whatever its name, and any file called `.json`. The path of its
/// draft starts where the fabric is.
///
/// # Errors
///
/// [`FabricError`] when there is no readable file, or no fabric in it, or it names no such file.
pub fn read(path: &Path) -> Result<FabricSource, FabricError> {
    if let Some(name) = path.to_str().and_then(|path| path.strip_prefix(PRESET)) {
        return preset(name);
    }
    let name = input::name(path);
    let bytes = draft::read_bytes(path)?;
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let is_json = text.trim_ascii_start().starts_with(b"{")
        || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"));
    if !is_json {
        return Ok(of_draft(name, &bytes));
    }
    let wrong = |what| FabricError::NotAFabric { name: name.clone(), what };
    if is_scene(text) {
        return Err(wrong("found a scene, expected a draft or a fabric".to_owned()));
    }
    let FabricFile { draft, fabric, images } = file::parse(text).map_err(&wrong)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (draft, draft_path) = match draft {
        DraftSource::Inline(wif) => (inline(&name, &wif), None),
        DraftSource::Path(relative) => {
            let draft = draft::read(&folder.join(&relative))
                .map_err(|source| FabricError::DraftOf { name: name.clone(), source })?;
            (draft, Some(relative))
        }
    };
    let (fabric, images) = pictured(fabric, images, Origin::Folder(folder)).map_err(wrong)?;
    Ok(FabricSource { name, draft: Arc::new(draft), draft_path, fabric, images })
}

/// `fabric` with the pictures that were found in it.
fn pictured(
    mut fabric: Fabric,
    found: Vec<Found>,
    origin: Origin<'_>,
) -> Result<(Fabric, Vec<FabricImage>), String> {
    let images = images::load(found, origin)?;
    images::install(&mut fabric, &images);
    Ok((fabric, images))
}

/// The draft that is text in the fabric `name`.
fn inline(name: &str, wif: &str) -> DraftFile {
    DraftFile::new(format!("{name}: draft"), wif.as_bytes())
}

/// The draft of these bytes, which messages call `name`, and nothing else.
pub fn of_draft(name: String, bytes: &[u8]) -> FabricSource {
    let draft = Arc::new(DraftFile::new(name.clone(), bytes));
    FabricSource { name, draft, draft_path: None, fabric: Fabric::default(), images: Vec::new() }
}

/// The fabric of `json`, which messages call `name`. Its draft is text in it, or that of `before` where
/// it names none, and its pictures are in it too; nothing is read from anywhere.
///
/// # Errors
///
/// [`FabricError::NotAFabric`] when `json` is no fabric, or its draft or a picture is in a file.
pub fn from_json(
    name: &str,
    mut json: Map<String, Value>,
    before: &FabricSource,
) -> Result<FabricSource, FabricError> {
    let wrong = |what| FabricError::NotAFabric { name: name.to_owned(), what };
    let has_draft = json.contains_key("draft");
    if !has_draft {
        json.insert("draft".to_owned(), json!({ "wif": "" }));
    }
    let text = Value::Object(json).to_string();
    let FabricFile { draft, fabric, images } =
        file::parse(text.as_bytes()).map_err(|what| wrong(json::without_line(&what).to_owned()))?;
    let origin = Origin::Inline(&before.images);
    let (fabric, images) = pictured(fabric, images, origin).map_err(wrong)?;
    let (draft, draft_path) = match draft {
        _ if !has_draft => (Arc::clone(&before.draft), before.draft_path.clone()),
        DraftSource::Path(_) => {
            return Err(wrong("draft: found a path, expected {\"wif\": \"its text\"}".to_owned()));
        }
        DraftSource::Inline(wif) if before.wif() == wif => {
            (Arc::clone(&before.draft), before.draft_path.clone())
        }
        DraftSource::Inline(wif) => (Arc::new(inline(name, &wif)), None),
    };
    Ok(FabricSource { name: name.to_owned(), draft, draft_path, fabric, images })
}

/// The fabric that is compiled in as `name`.
fn preset(name: &str) -> Result<FabricSource, FabricError> {
    let full_name = format!("{PRESET}{name}");
    let wrong = |what| FabricError::NotAFabric { name: full_name.clone(), what };
    let preset = presets::find(name).ok_or_else(|| {
        let known: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
        wrong(format!("found no such preset, expected {}", json::nearest(name, &known)))
    })?;
    let FabricFile { draft, fabric, images } =
        file::parse(preset.fabric.as_bytes()).map_err(wrong)?;
    let wif = match &draft {
        DraftSource::Inline(wif) => wif,
        DraftSource::Path(_) => preset.draft.unwrap_or_default(),
    };
    let draft = Arc::new(inline(&full_name, wif));
    let (fabric, images) = pictured(fabric, images, Origin::Inline(&[])).map_err(wrong)?;
    Ok(FabricSource { name: full_name, draft, draft_path: None, fabric, images })
}

/// The JSON Schema of fabrics in files.
pub fn schema() -> Schema {
    json::schema::<FabricFile>()
}

impl FabricSource {
    /// The file's name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The draft.
    pub fn draft(&self) -> &DraftFile {
        &self.draft
    }

    /// The files that the fabric in the file `path` names.
    pub fn files(&self, path: &Path) -> Vec<PathBuf> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let draft = self.draft_path.iter().map(|draft| folder.join(draft));
        draft.chain(self.images.iter().filter_map(|image| image.file(folder))).collect()
    }

    /// What the draft leaves open.
    pub fn fabric(&self) -> &Fabric {
        &self.fabric
    }

    /// Whether `other` makes the same cloth, whatever it is called.
    pub fn is_like(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.draft, &other.draft) && self.fabric == other.fabric
    }

    /// The text of the draft: the file's own where that is UTF-8, else its canonical form; empty if
    /// there is neither.
    pub fn wif(&self) -> Cow<'_, str> {
        let bytes = self.draft.parse().document.as_bytes();
        let canonical = || self.draft.parse().draft.as_ref().map(selvedge_wif::Draft::to_wif);
        match str::from_utf8(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)) {
            Ok(text) => Cow::Borrowed(text),
            Err(_) => Cow::Owned(canonical().unwrap_or_default()),
        }
    }

    /// The fabric as a file: with its draft as text in it and its pictures as data or, if not
    /// `is_inline`, as the paths that they were read with, if they were.
    #[expect(clippy::missing_panics_doc, reason = "JSON holds any fabric")]
    pub fn to_json(&self, is_inline: bool) -> String {
        let draft = match &self.draft_path {
            Some(path) if !is_inline => json!(path),
            _ => json!({ "wif": self.wif() }),
        };
        let written = written(draft, &self.fabric, self.images.iter(), is_inline);
        serde_json::to_string_pretty(&written).expect("a fabric has names for keys")
    }

    /// A fabric as a file, with its draft in it, in which every yarn has the twist and the highlight of
    /// `yarn`.
    ///
    /// # Errors
    ///
    /// [`FabricError::Draft`] when there is no draft.
    #[expect(clippy::missing_panics_doc, reason = "JSON holds any fabric")]
    pub fn twisted(&self, yarn: &Yarn) -> Result<Vec<u8>, FabricError> {
        let mut fabric = self.fabric.clone();
        let overrides = fabric.overrides.iter_mut().map(|of| &mut of.yarn);
        for partial in overrides {
            partial.psi = None;
            partial.highlight = None;
        }
        fabric.yarn.psi = Some(yarn.psi);
        fabric.yarn.highlight = Some(yarn.highlight);
        let draft = json!({ "wif": self.draft.draft()?.to_wif() });
        let others = |image: &&FabricImage| !["psi", "delta", "sigma"].contains(&image.name());
        let written = written(draft, &fabric, self.images.iter().filter(others), true);
        Ok(serde_json::to_vec(&written).expect("a fabric has names for keys"))
    }

    /// The cloth, woven by `drawdown`, which is that of the draft.
    ///
    /// End and pick 0 of the drawdown are those at u = 0 and v = 0; an end on top is on top of the
    /// face. Colours are decoded to linear light; pitch and diameter are handed on in metres where
    /// the draft gives them.
    ///
    /// # Errors
    ///
    /// [`FabricError::NoCloth`] when the grid is larger than a cloth can be, or a parameter of the
    /// fabric is out of range.
    pub fn cloth(&self, drawdown: &Drawdown) -> Result<Cloth, FabricError> {
        let weave = Weave::new(drawdown.ends() as u32, drawdown.picks() as u32, |end, pick| {
            drawdown.warp_on_top(end as usize, pick as usize)
        });
        let [ends, picks] = threads(drawdown);
        let cloth = weave
            .map_err(ClothError::from)
            .and_then(|weave| self.fabric.cloth(weave, &ends, &picks));
        cloth.map_err(|source| self.no_cloth(source))
    }

    /// The cloth, ready to be shaded.
    ///
    /// # Errors
    ///
    /// As for [`Cloth::prepare`].
    pub fn shader(&self, cloth: &Cloth) -> Result<Shader, FabricError> {
        cloth.prepare().map_err(|source| self.no_cloth(source))
    }

    /// A hash of all that makes the cloth, FNV-1a with 64 bits: of the draft in its canonical form and,
    /// after a zero byte, of the fabric in JSON and of the bytes of its pictures. Whatever else stands in
    /// the files, their names and comments, changes nothing.
    ///
    /// # Errors
    ///
    /// [`FabricError::Draft`] when there is no draft.
    #[expect(clippy::missing_panics_doc, reason = "JSON holds any fabric")]
    pub fn hash(&self) -> Result<u64, FabricError> {
        let fabric = serde_json::to_vec(&self.fabric).expect("a fabric has names for keys");
        let mut hash = Fnv::default();
        hash.add(self.draft.draft()?.to_wif().as_bytes());
        hash.add(b"\0");
        hash.add(&fabric);
        self.images.iter().for_each(|image| image.hash(&mut hash));
        Ok(hash.finish())
    }

    /// What the fabric says in vain, each as a line that begins with severity and file.
    pub fn warnings(&self, drawdown: &Drawdown, shader: &Shader) -> Vec<String> {
        let lowered = shader.lowered().iter().map(ToString::to_string);
        let all = self.unused(drawdown).into_iter().chain(lowered);
        all.map(|what| format!("warning: {}: {what}", self.name)).collect()
    }

    /// Which overrides are for no thread, each as *where: what was found*.
    pub fn unused(&self, drawdown: &Drawdown) -> Vec<String> {
        let [ends, picks] = threads(drawdown);
        let line = |index| format!("override {}: found no such threads in the draft", index + 1);
        self.fabric.unused(&ends, &picks).into_iter().map(line).collect()
    }

    /// The error of a fabric that makes no cloth.
    pub fn no_cloth(&self, source: ClothError) -> FabricError {
        FabricError::NoCloth { name: self.name.clone(), source }
    }
}

/// The file of `fabric` with `images`, as JSON.
fn written<'a>(
    draft: Value,
    fabric: &Fabric,
    images: impl Iterator<Item = &'a FabricImage>,
    is_inline: bool,
) -> Value {
    let file = file::Written { version: file::VERSION, draft, fabric };
    // By way of text, in which single precision has its few digits.
    let text = serde_json::to_string(&file).expect("a fabric has names for keys");
    let mut value = serde_json::from_str(&text).expect("it has just been written");
    images.for_each(|image| image.write(&mut value, is_inline));
    value
}

/// The ends and the picks.
pub(crate) fn threads(drawdown: &Drawdown) -> [Vec<Thread>; 2] {
    let thread = |thread: &selvedge_wif::Thread| Thread {
        color: thread.color.linear(),
        color_number: thread.color_number,
        pitch: thread.pitch,
        diameter: thread.diameter,
    };
    [
        (0..drawdown.ends()).map(|end| thread(drawdown.end(end))).collect(),
        (0..drawdown.picks()).map(|pick| thread(drawdown.pick(pick))).collect(),
    ]
}
