//! Where results and messages go.

use std::{
    fmt,
    fs::OpenOptions,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use tempfile::NamedTempFile;
use thiserror::Error;

/// Writes a message to stderr; where nobody listens, that is no reason to fail.
pub fn tell(message: impl fmt::Display) {
    let _ = writeln!(io::stderr(), "{message}");
}

/// Where a result goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sink {
    /// Standard output.
    Stdout,
    /// A file.
    File(Destination),
}

impl Sink {
    /// The file at `path`, else standard output.
    ///
    /// # Errors
    ///
    /// As [`Destination::new`].
    pub fn new(path: Option<&Path>) -> Result<Self, OutputError> {
        path.map_or(Ok(Self::Stdout), |path| Destination::new(path).map(Self::File))
    }

    /// Lets `write` write the result. A reader of standard output that has gone away has had
    /// enough, which is no failure.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unwritable`]; a file is then as it was.
    pub fn write(
        &self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        let Self::File(destination) = self else {
            let mut stdout = BufWriter::new(io::stdout().lock());
            let written = write(&mut stdout).and_then(|()| stdout.flush());
            return match written {
                Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
                    Err(OutputError::Unwritable { name: "standard output".to_owned(), source })
                }
                _ => Ok(()),
            };
        };
        destination.write(write)
    }
}

/// A file to be written as a whole or not at all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Destination {
    /// As the user calls it.
    name: String,
    /// With symbolic links followed, as a link would be replaced.
    path: PathBuf,
    folder: PathBuf,
}

/// Why an output cannot be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// Its folder does not exist.
    #[error("{name}: found no folder {folder}, expected an existing one")]
    NoFolder {
        /// The output.
        name: String,
        /// The folder.
        folder: String,
    },
    /// The name is that of something else than a file.
    #[error("{name}: found {found}, expected the name of a file")]
    NotAFile {
        /// The output.
        name: String,
        /// What it is.
        found: &'static str,
    },
    /// The system does not let us.
    #[error("{name}: cannot be written")]
    Unwritable {
        /// The output.
        name: String,
        /// What the system says.
        source: io::Error,
    },
}

impl Destination {
    /// The file at `path`, after a test that it can be written, of which nothing is left.
    ///
    /// # Errors
    ///
    /// [`OutputError`] when it cannot.
    pub fn new(path: &Path) -> Result<Self, OutputError> {
        let name = path.display().to_string();
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        if path.exists() && !path.is_file() {
            let found = if path.is_dir() { "a folder" } else { "a device or pipe" };
            return Err(OutputError::NotAFile { name, found });
        }
        if !folder.is_dir() {
            let folder = folder.display().to_string();
            return Err(OutputError::NoFolder { name, folder });
        }
        let destination = Self { name, path, folder };
        destination.test().map_err(|source| destination.unwritable(source))?;
        Ok(destination)
    }

    /// Lets `write` fill a temporary file beside the destination, then gives it its name. What
    /// was there before is replaced and leaves its permissions.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unwritable`]; then the destination is as it was.
    pub fn write(
        &self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        let replace = || -> io::Result<()> {
            let mut file = BufWriter::new(self.temporary()?);
            write(&mut file)?;
            let file = file.into_inner()?;
            if let Ok(before) = self.path.metadata() {
                file.as_file().set_permissions(before.permissions())?;
            }
            file.persist(&self.path)?;
            Ok(())
        };
        replace().map_err(|source| self.unwritable(source))
    }

    /// Fails where writing would. The temporary file goes at once: one kept until the picture is
    /// done would stay behind when the program is interrupted.
    fn test(&self) -> io::Result<()> {
        match OpenOptions::new().write(true).open(&self.path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => self.temporary()?.close(),
        }
    }

    fn temporary(&self) -> io::Result<NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        // As an ordinary new file; temporary ones are readable by their owner only.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.prefix(".selvedge-").tempfile_in(&self.folder)
    }

    fn unwritable(&self, source: io::Error) -> OutputError {
        // The name of a temporary file, which errors of its making carry, helps nobody.
        let from_system = source.raw_os_error().is_some();
        let source = if from_system { source } else { source.kind().into() };
        OutputError::Unwritable { name: self.name.clone(), source }
    }
}
