//! From the name of a draft to its drawdown, with messages that name the file.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use selvedge_wif::{Diagnostic, Draft, Drawdown, DrawdownError, Severity};
use thiserror::Error;

/// A draft as read from a file.
#[derive(Clone, Debug)]
pub struct DraftFile {
    name: String,
    /// Text of the diagnostics from [`Severity::Warning`] on.
    warnings: Vec<String>,
    draft: Draft,
}

/// Why a file gives no drawdown.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DraftError {
    /// There is no file of that name.
    #[error("{name}: no such file")]
    NotFound {
        /// The file.
        name: String,
    },
    /// The name is that of a folder.
    #[error("{name}: found a folder, expected a WIF file")]
    Folder {
        /// The file.
        name: String,
    },
    /// The file cannot be read.
    #[error("{name}: cannot be read")]
    Unreadable {
        /// The file.
        name: String,
        /// What the system says.
        source: io::Error,
    },
    /// The file is larger than any draft.
    #[error("{name}: found more than {MAX_BYTES} bytes, expected a WIF file")]
    TooLarge {
        /// The file.
        name: String,
    },
    /// The file is not a draft.
    #[error("{report}")]
    NotADraft {
        /// What is wrong, with name of the file, line and column.
        report: String,
    },
    /// The draft says too little to be woven.
    #[error("{name}")]
    NoDrawdown {
        /// The file.
        name: String,
        /// What is missing.
        source: DrawdownError,
    },
}

/// Over a hundred times the largest drafts in use.
const MAX_BYTES: u64 = 1 << 28;

/// Reads the draft at `path`, or from standard input for `-`.
///
/// # Errors
///
/// [`DraftError`] when there is no readable file, or no draft in it.
pub fn read(path: &Path) -> Result<DraftFile, DraftError> {
    let from_stdin = path == Path::new("-");
    let name = if from_stdin { "standard input".to_owned() } else { path.display().to_string() };
    let bytes = if from_stdin { read_bytes(io::stdin()) } else { read_file(path) };
    let bytes = match bytes {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(DraftError::NotFound { name });
        }
        Err(error) if error.kind() == io::ErrorKind::IsADirectory => {
            return Err(DraftError::Folder { name });
        }
        Err(source) => return Err(DraftError::Unreadable { name, source }),
    };
    if bytes.len() as u64 > MAX_BYTES {
        return Err(DraftError::TooLarge { name });
    }
    let parse = selvedge_wif::parse(&bytes);
    let of_severity = |least: Severity| {
        parse.diagnostics.iter().filter(move |diagnostic| diagnostic.severity >= least)
    };
    let Some(draft) = parse.draft else {
        let errors: Vec<_> =
            of_severity(Severity::Error).map(|error| describe(error, &name, &bytes)).collect();
        return Err(DraftError::NotADraft { report: errors.join("\nerror: ") });
    };
    let warnings = of_severity(Severity::Warning)
        .map(|warning| format!("{}: {}", warning.severity, describe(warning, &name, &bytes)))
        .collect();
    Ok(DraftFile { name, warnings, draft })
}

impl DraftFile {
    /// The file's name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What departs from the format or was lost in reading, each as text of three lines that
    /// begins with severity, file and line.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Which thread lies on top at each crossing.
    ///
    /// # Errors
    ///
    /// [`DraftError::NoDrawdown`] when the draft lacks threads, threading or plan, or is too large.
    pub fn drawdown(&self) -> Result<Drawdown, DraftError> {
        let no_drawdown = |source| DraftError::NoDrawdown { name: self.name.clone(), source };
        self.draft.drawdown().map_err(no_drawdown)
    }
}

/// The diagnostic with line and caret, the name of the file in place of its severity.
fn describe(diagnostic: &Diagnostic, name: &str, source: &[u8]) -> String {
    let text = diagnostic.display(source).to_string();
    let label = format!("{}: ", diagnostic.severity);
    format!("{name}: {}", text.strip_prefix(&label).unwrap_or(&text))
}

fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    read_bytes(file)
}

/// No more than it takes to see that it is too much.
fn read_bytes(reader: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}
