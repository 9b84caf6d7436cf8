//! From the name of a draft to its drawdown, with messages that name the file.

use std::path::Path;

use selvedge_wif::{Diagnostic, Draft, Drawdown, DrawdownError, Location, Parse, Severity, Span};
use thiserror::Error;

use crate::input::{self, InputError};

/// A file as the parser read it, whether or not it is a draft.
#[derive(Clone, Debug)]
pub struct DraftFile {
    name: String,
    parse: Parse,
}

/// Why a file gives no drawdown.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DraftError {
    /// There is no readable file.
    #[error(transparent)]
    Input(#[from] InputError),
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

/// Reads the file at `path`, or standard input for `-`.
///
/// # Errors
///
/// [`DraftError`] when there is no readable file.
pub fn read(path: &Path) -> Result<DraftFile, DraftError> {
    Ok(DraftFile::new(input::name(path), &read_bytes(path)?))
}

/// The bytes of the file at `path`, or of standard input for `-`.
///
/// # Errors
///
/// As for [`read`].
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, DraftError> {
    Ok(input::read(path, "WIF file", MAX_BYTES)?)
}

impl DraftFile {
    /// The file of these bytes, which messages call `name`.
    pub fn new(name: String, bytes: &[u8]) -> Self {
        Self { name, parse: selvedge_wif::parse(bytes) }
    }

    /// The file's name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the parser made of it.
    pub fn parse(&self) -> &Parse {
        &self.parse
    }

    /// The draft, which may have errors that could be read past.
    ///
    /// # Errors
    ///
    /// [`DraftError::NotADraft`] when there is none.
    pub fn draft(&self) -> Result<&Draft, DraftError> {
        self.parse.draft.as_ref().ok_or_else(|| self.not_a_draft())
    }

    /// The draft, if it has no errors.
    ///
    /// # Errors
    ///
    /// [`DraftError::NotADraft`] when it has.
    pub fn sound_draft(&self) -> Result<&Draft, DraftError> {
        let draft = self.draft()?;
        if self.parse.severity() == Some(Severity::Error) {
            return Err(self.not_a_draft());
        }
        Ok(draft)
    }

    /// What departs from the format or was lost in reading, each as text of three lines that
    /// begins with severity, file and line.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        self.parse
            .diagnostics
            .iter()
            .filter(|diagnostic| diagnostic.severity >= Severity::Warning)
            .map(|diagnostic| self.describe(diagnostic))
    }

    /// How many findings of this severity there are, with those that are counted but not listed.
    pub fn count(&self, severity: Severity) -> usize {
        let of_severity = |diagnostic: &&Diagnostic| diagnostic.severity == severity;
        self.parse.diagnostics.iter().filter(of_severity).map(Diagnostic::count).sum()
    }

    /// The diagnostic with file, line and caret.
    pub fn describe(&self, diagnostic: &Diagnostic) -> String {
        format!("{}: {}", diagnostic.severity, self.unlabelled(diagnostic))
    }

    /// All diagnostics in the order of the file, each with its place unless it concerns the
    /// file as a whole.
    pub fn located(&self) -> impl Iterator<Item = (&Diagnostic, Option<Location>)> {
        let source = self.parse.document.as_bytes();
        let mut last = Location { line: 1, column: 1, line_start: 0 };
        self.parse.diagnostics.iter().map(move |diagnostic| {
            let span = diagnostic.span;
            if span == Span::FILE {
                return (diagnostic, None);
            }
            // From the line of the one before, so that all together read the source once.
            let start = if span.start < last.line_start { 0 } else { last.line_start };
            let lines = if start == 0 { 0 } else { last.line - 1 };
            let place = Span { start: span.start - start, end: span.end - start };
            let place = place.locate(&source[start..]);
            let (line, line_start) = (place.line + lines, place.line_start + start);
            last = Location { line, line_start, ..place };
            (diagnostic, Some(last))
        })
    }

    /// Which thread lies on top at each crossing.
    ///
    /// # Errors
    ///
    /// [`DraftError`] when there is no draft, or it lacks threads, threading or plan, or is too
    /// large.
    pub fn drawdown(&self) -> Result<Drawdown, DraftError> {
        self.draft()?.drawdown().map_err(|source| self.no_drawdown(source))
    }

    /// The error of a draft that cannot be woven.
    pub fn no_drawdown(&self, source: DrawdownError) -> DraftError {
        DraftError::NoDrawdown { name: self.name.clone(), source }
    }

    fn not_a_draft(&self) -> DraftError {
        let diagnostics = self.parse.diagnostics.iter();
        let errors: Vec<_> = diagnostics
            .filter(|diagnostic| diagnostic.severity == Severity::Error)
            .map(|error| self.unlabelled(error))
            .collect();
        DraftError::NotADraft { report: errors.join("\nerror: ") }
    }

    /// As [`DraftFile::describe`], without the severity.
    fn unlabelled(&self, diagnostic: &Diagnostic) -> String {
        let text = diagnostic.display(self.parse.document.as_bytes()).to_string();
        let label = format!("{}: ", diagnostic.severity);
        format!("{}: {}", self.name, text.strip_prefix(&label).unwrap_or(&text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_of_a_search_from_the_start() {
        let bytes = "\u{feff}ä=1\r\n[WARP]\rThreads=x\n\nThreads=y\r\n[WEFT]z\nThreads=ä\n\tHue";
        let file = DraftFile { name: String::new(), parse: selvedge_wif::parse(bytes.as_bytes()) };
        let found: Vec<_> = file.located().map(|(_, place)| place).collect();
        let expected: Vec<_> = file
            .parse
            .diagnostics
            .iter()
            .map(|diagnostic| diagnostic.span)
            .map(|span| (span != Span::FILE).then(|| span.locate(bytes.as_bytes())))
            .collect();
        assert_eq!(found, expected);
        let lines: Vec<_> = found.iter().flatten().map(|place| place.line).collect();
        assert!(lines.contains(&6) && lines.contains(&8), "{lines:?}");
    }
}
