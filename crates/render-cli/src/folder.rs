//! Folders of results, written as a whole or not at all.

use std::{
    collections::BTreeSet,
    ffi::OsStr,
    fs, io,
    path::{Path, PathBuf},
};

use serde_json::{Map, Value, json};
use tempfile::TempDir;
use thiserror::Error;

/// What a folder's index says of the program that has written it, so that it is known again.
const GENERATOR: &str = "selvedge";

/// A folder to be written as a whole or not at all.
///
/// One of its files is the index: an object in JSON that names all of them, under `"files"`. A folder
/// that is there already is replaced only if it is empty, or has nothing in it but what its index names.
///
/// # Examples
///
/// ```
/// use selvedge_cli::folder::Folder;
/// use serde_json::{Map, json};
///
/// let place = tempfile::tempdir()?;
/// let folder = Folder::new(&place.path().join("maps"), "maps.json")?;
/// let index = Map::from_iter([("size".to_owned(), json!(4096))]);
/// folder.write(index, &[("height.png".to_owned(), vec![0; 8])])?;
/// assert!(place.path().join("maps/height.png").is_file());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    /// As the user calls it.
    name: String,
    path: PathBuf,
    parent: PathBuf,
    index: &'static str,
}

/// Why a folder cannot be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FolderError {
    /// There is no folder that it could be in.
    #[error("{name}: found no folder {parent}, expected an existing one")]
    NoParent {
        /// The folder.
        name: String,
        /// The one that it would be in.
        parent: String,
    },
    /// The name is that of something else.
    #[error("{name}: found a file, expected a folder or nothing")]
    NotAFolder {
        /// What is there.
        name: String,
    },
    /// Something else is in it.
    #[error(
        "{name}: found {found:?} in it, expected an empty folder or one that this command has written"
    )]
    Foreign {
        /// The folder.
        name: String,
        /// The first of what is in it.
        found: String,
    },
    /// The system does not let us.
    #[error("{name}: cannot be written")]
    Unwritable {
        /// The folder.
        name: String,
        /// What the system says.
        source: io::Error,
    },
}

impl Folder {
    /// The folder at `path` with the file `index`, after a test that it can be written, of which nothing is
    /// left.
    ///
    /// # Errors
    ///
    /// [`FolderError`] when it cannot, or something else is in it.
    pub fn new(path: &Path, index: &'static str) -> Result<Self, FolderError> {
        let name = path.display().to_string();
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let parent = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        if path.exists() && !path.is_dir() {
            return Err(FolderError::NotAFolder { name });
        }
        if !parent.is_dir() {
            let parent = parent.display().to_string();
            return Err(FolderError::NoParent { name, parent });
        }
        let folder = Self { name, path, parent, index };
        folder.check()?;
        folder.temporary().and_then(TempDir::close).map_err(|source| folder.unwritable(source))?;
        Ok(folder)
    }

    /// As the user calls it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Writes `files`, each a name and its bytes, and the index with them: `index`, and what makes the
    /// folder known again. What an earlier run has left there goes.
    ///
    /// # Errors
    ///
    /// [`FolderError`]; then the folder is as it was.
    ///
    /// # Panics
    ///
    /// If a name occurs twice, or is not that of a file in the folder itself.
    pub fn write(
        &self,
        mut index: Map<String, Value>,
        files: &[(String, Vec<u8>)],
    ) -> Result<(), FolderError> {
        let mut names = BTreeSet::from([self.index]);
        for (name, _) in files {
            assert_eq!(Path::new(name).file_name(), Some(OsStr::new(name)), "a plain name");
            assert!(names.insert(name), "{name}: there are two files of this name");
        }
        index.insert("generator".to_owned(), json!(GENERATOR));
        index.insert("files".to_owned(), json!(names));
        let text = format!("{:#}\n", Value::Object(index));
        self.check()?;
        let replace = || -> io::Result<()> {
            let folder = self.temporary()?;
            fs::write(folder.path().join(self.index), text)?;
            for (name, bytes) in files {
                fs::write(folder.path().join(name), bytes)?;
            }
            if !self.path.exists() {
                return fs::rename(folder.keep(), &self.path);
            }
            let aside = self.temporary()?;
            let before = aside.path().join("before");
            fs::rename(&self.path, &before)?;
            fs::rename(folder.path(), &self.path).inspect_err(|_| {
                // Nothing else can be done where the system refuses this, too.
                let _ = fs::rename(&before, &self.path);
            })?;
            // It has another name now.
            let _ = folder.keep();
            Ok(())
        };
        replace().map_err(|source| self.unwritable(source))
    }

    /// Whether nothing is there but what may be replaced.
    fn check(&self) -> Result<(), FolderError> {
        let entries = match fs::read_dir(&self.path) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(source) => return Err(self.unwritable(source)),
        };
        let index = fs::read(self.path.join(self.index)).unwrap_or_default();
        let index: Value = serde_json::from_slice(&index).unwrap_or_default();
        let files = index["files"].as_array().filter(|_| index["generator"] == GENERATOR);
        let known: BTreeSet<&str> = files.into_iter().flatten().filter_map(Value::as_str).collect();
        for entry in entries {
            let entry = entry.map_err(|source| self.unwritable(source))?;
            let found = entry.file_name().to_string_lossy().into_owned();
            if !known.contains(&*found) {
                return Err(FolderError::Foreign { name: self.name.clone(), found });
            }
        }
        Ok(())
    }

    fn temporary(&self) -> io::Result<TempDir> {
        let mut builder = tempfile::Builder::new();
        // As an ordinary new folder; temporary ones are for their owner only.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        builder.prefix(".selvedge-").tempdir_in(&self.parent)
    }

    fn unwritable(&self, source: io::Error) -> FolderError {
        // The name of a temporary folder, which errors of its making carry, helps nobody.
        let from_system = source.raw_os_error().is_some();
        let source = if from_system { source } else { source.kind().into() };
        FolderError::Unwritable { name: self.name.clone(), source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(path: &Path) -> Vec<String> {
        let entries = fs::read_dir(path).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn files(names: &[&str]) -> Vec<(String, Vec<u8>)> {
        names.iter().map(|name| ((*name).to_owned(), name.as_bytes().to_vec())).collect()
    }

    #[test]
    fn a_folder_is_replaced_as_a_whole() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out");
        let folder = || Folder::new(&path, "index.json").unwrap();
        folder().write(Map::new(), &files(&["a.csv", "b.csv"])).unwrap();
        assert_eq!(names(&path), ["a.csv", "b.csv", "index.json"]);
        folder().write(Map::new(), &files(&["c.csv"])).unwrap();
        assert_eq!(names(&path), ["c.csv", "index.json"]);
        assert_eq!(fs::read(path.join("c.csv")).unwrap(), b"c.csv");
        assert_eq!(names(place.path()), ["out"], "nothing is left beside it");
    }

    #[test]
    fn what_others_have_put_there_stays() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out");
        fs::create_dir(&path).unwrap();
        let folder = Folder::new(&path, "index.json").unwrap();
        fs::write(path.join("thesis.txt"), "").unwrap();
        let foreign = |result| matches!(result, Err(FolderError::Foreign { found, .. }) if found == "thesis.txt");
        assert!(foreign(folder.write(Map::new(), &files(&["a.csv"]))));
        assert!(foreign(Folder::new(&path, "index.json").map(|_| ())));
        fs::remove_file(path.join("thesis.txt")).unwrap();
        folder.write(Map::new(), &files(&["a.csv"])).unwrap();
        fs::write(path.join("thesis.txt"), "").unwrap();
        assert!(foreign(Folder::new(&path, "index.json").map(|_| ())), "one's own, and another's");
        assert_eq!(names(&path), ["a.csv", "index.json", "thesis.txt"]);
    }

    #[test]
    fn places_that_cannot_be_written_are_told_before_the_work() {
        let place = tempfile::tempdir().unwrap();
        let new = |name: &str| Folder::new(&place.path().join(name), "index.json");
        fs::write(place.path().join("file"), "").unwrap();
        assert!(matches!(new("file"), Err(FolderError::NotAFolder { .. })));
        assert!(matches!(new("none/out"), Err(FolderError::NoParent { .. })));
        assert!(new("out").is_ok());
        assert_eq!(names(place.path()), ["file"]);
    }
}
