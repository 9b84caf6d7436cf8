//! From the name of a draft or a fabric to a cloth.

mod file;
pub mod presets;

use std::path::{Path, PathBuf};

use schemars::Schema;
use selvedge_wif::Drawdown;
use selvedge_yarn_brdf::{Cloth, ClothError, Fabric, Shader, Thread, Weave};
use thiserror::Error;

use self::{
    file::{DraftSource, FabricFile},
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
    draft: DraftFile,
    fabric: Fabric,
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
        let draft = DraftFile::new(name.clone(), &bytes);
        return Ok(FabricSource { name, draft, fabric: Fabric::default() });
    }
    let wrong = |what| FabricError::NotAFabric { name: name.clone(), what };
    if is_scene(text) {
        return Err(wrong("found a scene, expected a draft or a fabric".to_owned()));
    }
    let FabricFile { draft, fabric } = file::parse(text).map_err(wrong)?;
    let draft = match draft {
        DraftSource::Inline(wif) => DraftFile::new(format!("{name}: draft"), wif.as_bytes()),
        DraftSource::Path(relative) => {
            let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
            draft::read(&folder.join(relative))
                .map_err(|source| FabricError::DraftOf { name: name.clone(), source })?
        }
    };
    Ok(FabricSource { name, draft, fabric })
}

/// The fabric that is compiled in as `name`.
fn preset(name: &str) -> Result<FabricSource, FabricError> {
    let full_name = format!("{PRESET}{name}");
    let wrong = |what| FabricError::NotAFabric { name: full_name.clone(), what };
    let preset = presets::find(name).ok_or_else(|| {
        let known: Vec<_> = PRESETS.iter().map(|preset| preset.name).collect();
        wrong(format!("found no such preset, expected {}", json::nearest(name, &known)))
    })?;
    let FabricFile { draft, fabric } = file::parse(preset.fabric.as_bytes()).map_err(wrong)?;
    let wif = match &draft {
        DraftSource::Inline(wif) => wif,
        DraftSource::Path(_) => preset.draft.unwrap_or_default(),
    };
    let draft = DraftFile::new(format!("{full_name}: draft"), wif.as_bytes());
    Ok(FabricSource { name: full_name, draft, fabric })
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
    /// after a zero byte, of the fabric in JSON. Whatever else stands in the files, their names and
    /// comments, changes nothing.
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
        Ok(hash.finish())
    }

    /// What the fabric says in vain, each as a line that begins with severity and file.
    pub fn warnings(&self, drawdown: &Drawdown, shader: &Shader) -> Vec<String> {
        let [ends, picks] = threads(drawdown);
        let name = &self.name;
        let unused = self.fabric.unused(&ends, &picks);
        let unused = unused.into_iter().map(|index| {
            format!("warning: {name}: override {}: found no such threads in the draft", index + 1)
        });
        let lowered = shader.lowered().iter().map(|lowered| format!("warning: {name}: {lowered}"));
        unused.chain(lowered).collect()
    }

    fn no_cloth(&self, source: ClothError) -> FabricError {
        FabricError::NoCloth { name: self.name.clone(), source }
    }
}

/// The ends and the picks.
fn threads(drawdown: &Drawdown) -> [Vec<Thread>; 2] {
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
