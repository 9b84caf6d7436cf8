//! A cache as a file: JSON, replaced as a whole, and believed only if its checksum holds.

use core::fmt;
use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    sync::Mutex,
};

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::{Cache, Key};
use crate::scale::{Normalization, Place};

/// Who wrote a file: another version of this crate may find other factors.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What every version of the file has.
#[derive(Deserialize)]
struct Header {
    version: String,
}

/// The whole file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    version: String,
    /// Of the entries, so that a damaged digit is found out.
    checksum: String,
    entries: BTreeMap<Key, Entry>,
}

/// A [`Normalization`]. Its numbers are written so that they are read back to the bit.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    factor: f64,
    max_albedo: f64,
    point: Option<[f64; 2]>,
    direction: Option<[f64; 3]>,
    lower_bound: f64,
    /// JSON has no ∞: `None` is no bound.
    upper_bound: Option<f64>,
    evaluations: u32,
}

impl Cache {
    /// The cache that [`Cache::save`] wrote to `path`; an empty one if there is no such file.
    ///
    /// # Errors
    ///
    /// [`CacheError`] if the file cannot be read, is of another version of this crate, or is damaged. A
    /// caller then does well to go on with [`Cache::new`]; saving replaces the file.
    ///
    /// # Examples
    ///
    /// ```
    /// use selvedge_normalize::cache::Cache;
    /// let cache = Cache::load("no such folder/factors.json".as_ref()).unwrap_or_else(|error| {
    ///     eprintln!("{error}; starting afresh");
    ///     Cache::new()
    /// });
    /// # let _ = cache;
    /// ```
    pub fn load(path: &Path) -> Result<Self, CacheError> {
        let text = match fs::read(path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::new()),
            Err(source) => return Err(CacheError::Io { path: path.into(), source }),
        };
        let damaged = |source| CacheError::Damaged { path: path.into(), source };
        let Header { version } = serde_json::from_slice(&text).map_err(damaged)?;
        if version != VERSION {
            return Err(CacheError::Version { path: path.into(), found: version });
        }
        let document: Document = serde_json::from_slice(&text).map_err(damaged)?;
        if document.checksum != checksum(&document.entries) {
            return Err(CacheError::Checksum { path: path.into(), found: document.checksum });
        }
        let entries = document.entries.into_iter().map(|(key, entry)| (key, entry.into()));
        Ok(Self { entries: Mutex::new(entries.collect()) })
    }

    /// Writes the cache to `path`, with the entries that a readable file there holds already.
    ///
    /// The file is written under a temporary name in the same folder and renamed: who reads it at the
    /// same time finds the old file or the new one. Of two processes that save at the same time one
    /// may lose its new entries, never an entry its value. An entry whose numbers are not those of any
    /// albedo, which only [`Cache::get_or`] can make, is left out.
    ///
    /// # Errors
    ///
    /// [`CacheError::Io`] if the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), CacheError> {
        let mut all = Self::load(path).map_or_else(|_| BTreeMap::new(), |old| old.lock().clone());
        all.extend(self.lock().iter());
        let entry = |(key, n): (&Key, &Normalization)| Some((*key, Entry::new(n)?));
        let entries: BTreeMap<_, _> = all.iter().filter_map(entry).collect();
        let document = Document { version: VERSION.into(), checksum: checksum(&entries), entries };
        write_whole(path, &document).map_err(|source| CacheError::Io { path: path.into(), source })
    }
}

/// Replaces the file at `path` in one step.
fn write_whole(path: &Path, document: &Document) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let mut builder = tempfile::Builder::new();
    // As an ordinary new file; temporary ones are readable by their owner only.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.prefix(".selvedge-").tempfile_in(folder.unwrap_or(Path::new(".")))?;
    file.write_all(&serde_json::to_vec_pretty(document)?)?;
    file.write_all(b"\n")?;
    // Else a crash could leave the new name on a file that has not reached the disk.
    file.as_file().sync_all()?;
    file.persist(path).map(|_: File| ()).map_err(|error| error.error)
}

/// A hash of all entries.
fn checksum(entries: &BTreeMap<Key, Entry>) -> String {
    let text =
        serde_json::to_vec(entries).expect("keys are strings and no number is without a form");
    Key::new("entries").with_bytes(&text).to_string()
}

impl Entry {
    /// The entry for `n` if its numbers can be told in JSON.
    fn new(n: &Normalization) -> Option<Self> {
        let Normalization { factor, max_albedo, at, lower_bound, upper_bound, evaluations } = *n;
        let (point, direction) = (at.point.map(Into::into), at.direction.map(Into::into));
        let coordinates = point.iter().flatten().chain(direction.iter().flatten());
        let mut numbers = [&factor, &max_albedo, &lower_bound].into_iter().chain(coordinates);
        let is_bound = upper_bound.is_finite() || upper_bound == f64::INFINITY;
        (is_bound && numbers.all(|number: &f64| number.is_finite())).then_some(Self {
            factor,
            max_albedo,
            point,
            direction,
            lower_bound,
            upper_bound: upper_bound.is_finite().then_some(upper_bound),
            evaluations,
        })
    }
}

impl From<Entry> for Normalization {
    fn from(entry: Entry) -> Self {
        Self {
            factor: entry.factor,
            max_albedo: entry.max_albedo,
            at: Place {
                point: entry.point.map(DVec2::from),
                direction: entry.direction.map(DVec3::from),
            },
            lower_bound: entry.lower_bound,
            upper_bound: entry.upper_bound.unwrap_or(f64::INFINITY),
            evaluations: entry.evaluations,
        }
    }
}

/// Why a file is not taken as a cache, or not written.
#[derive(Debug)]
#[non_exhaustive]
pub enum CacheError {
    /// The file cannot be read or written.
    Io {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The file is not what [`Cache::save`] writes.
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where and how it differs.
        source: serde_json::Error,
    },
    /// Another version of this crate, which may find other factors, wrote the file.
    Version {
        /// The file.
        path: PathBuf,
        /// The version that wrote it.
        found: String,
    },
    /// The entries are not those that were written.
    Checksum {
        /// The file.
        path: PathBuf,
        /// The checksum in the file.
        found: String,
    },
}

impl fmt::Display for CacheError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { path, .. } => {
                write!(f, "cache {}: cannot be read or written", path.display())
            }
            Self::Damaged { path, .. } => {
                write!(f, "cache {}: damaged, expected a file as it was saved", path.display())
            }
            Self::Version { path, found } => {
                write!(f, "cache {}: version {found:?}, expected {VERSION:?}", path.display())
            }
            Self::Checksum { path, found } => {
                let path = path.display();
                write!(f, "cache {path}: checksum {found:?}, expected that of its entries")
            }
        }
    }
}

impl core::error::Error for CacheError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            Self::Damaged { source, .. } => Some(source),
            Self::Version { .. } | Self::Checksum { .. } => None,
        }
    }
}
