//! From the name of a file to its bytes, with messages that name it.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use thiserror::Error;

/// Why a file cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum InputError {
    /// There is no file of that name.
    #[error("{name}: no such file")]
    NotFound {
        /// The file.
        name: String,
    },
    /// The name is that of a folder.
    #[error("{name}: found a folder, expected a {kind}")]
    Folder {
        /// The file.
        name: String,
        /// What it should be.
        kind: &'static str,
    },
    /// The system does not let us.
    #[error("{name}: cannot be read")]
    Unreadable {
        /// The file.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// The file is larger than any that is read.
    #[error("{name}: found more than {most} bytes, expected a smaller {kind}")]
    TooLarge {
        /// The file.
        name: String,
        /// Most bytes that are read.
        most: u64,
        /// What it should be.
        kind: &'static str,
    },
}

/// What messages call the file at `path`, where `-` is standard input.
pub fn name(path: &Path) -> String {
    if is_stdin(path) { "standard input".to_owned() } else { path.display().to_string() }
}

/// The file at `path`, open; messages say that a `kind` was expected.
///
/// # Errors
///
/// [`InputError`] when there is no file that can be opened.
pub fn open(path: &Path, kind: &'static str) -> Result<File, InputError> {
    open_file(path).map_err(|error| InputError::new(path, kind, error))
}

/// The bytes of the file at `path`, or of standard input for `-`; messages say that a `kind` was
/// expected.
///
/// # Errors
///
/// [`InputError`] when there is no readable file of at most `most` bytes.
pub fn read(path: &Path, kind: &'static str, most: u64) -> Result<Vec<u8>, InputError> {
    let bytes =
        if is_stdin(path) { read_some(io::stdin().lock(), 0, most) } else { read_file(path, most) };
    match bytes {
        Ok(Some(bytes)) => Ok(bytes),
        Ok(None) => Err(InputError::TooLarge { name: name(path), most, kind }),
        Err(error) => Err(InputError::new(path, kind, error)),
    }
}

/// The bytes of the file at `path`; `None` if there are more than `most`.
pub(crate) fn read_file(path: &Path, most: u64) -> io::Result<Option<Vec<u8>>> {
    let file = open_file(path)?;
    let claimed = file.metadata()?.len();
    if claimed > most { Ok(None) } else { read_some(file, claimed, most) }
}

impl InputError {
    fn new(path: &Path, kind: &'static str, source: io::Error) -> Self {
        let name = name(path);
        match source.kind() {
            io::ErrorKind::NotFound => Self::NotFound { name },
            io::ErrorKind::IsADirectory => Self::Folder { name, kind },
            _ => Self::Unreadable { name, source },
        }
    }
}

fn is_stdin(path: &Path) -> bool {
    path == Path::new("-")
}

fn open_file(path: &Path) -> io::Result<File> {
    let file = File::open(path)?;
    // Opening a folder succeeds.
    if file.metadata()?.is_dir() { Err(io::ErrorKind::IsADirectory.into()) } else { Ok(file) }
}

/// No more than it takes to see that it is too much. What is `claimed` spares copies and need not be
/// true.
fn read_some(reader: impl Read, claimed: u64, most: u64) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::with_capacity(claimed.min(1 << 24) as usize);
    reader.take(most + 1).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= most).then_some(bytes))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

    use super::*;

    #[test]
    fn each_failure_has_its_message() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "12345").unwrap();
        assert_eq!(read(&file, "mesh", 5).unwrap(), b"12345");
        assert_eq!(read_file(&file, 4).unwrap(), None);
        let message = |path: &Path, most| {
            let message = read(path, "mesh", most).unwrap_err().to_string();
            message.replace(folder.path().to_str().unwrap(), "at")
        };
        let other = folder.path().join("other");
        let expected = "at/file: found more than 4 bytes, expected a smaller mesh";
        assert_eq!(message(&file, 4), expected);
        assert_eq!(message(&other, 4), "at/other: no such file");
        assert_eq!(message(folder.path(), 4), "at: found a folder, expected a mesh");
        assert!(matches!(open(&other, "mesh"), Err(InputError::NotFound { .. })));
    }
}
