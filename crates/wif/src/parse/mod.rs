//! `parse`: bytes to [`Document`] and [`Draft`], with every [`Diagnostic`].

#![deny(clippy::unwrap_used, clippy::indexing_slicing, clippy::arithmetic_side_effects)]

mod check;
mod draft;
mod field;
pub(crate) mod line;
pub(crate) mod name;
mod reader;
mod rows;
mod section;
pub(crate) mod text;
pub(crate) mod value;

use crate::diagnostic::{Code, Diagnostic, Report, Severity};
use crate::document::Document;
use crate::draft::Draft;
use crate::limits;
use crate::span::Span;

/// What a file says.
#[derive(Debug, Clone, PartialEq)]
pub struct Parse {
    /// The file as written.
    pub document: Document,
    /// The draft; `None` only where an error makes it impossible, or by
    /// [`Options::with_strict`].
    pub draft: Option<Draft>,
    /// All there is to say about the file, in the order of the file.
    pub diagnostics: Vec<Diagnostic>,
}

impl Parse {
    /// The greatest severity among the diagnostics, if there are any.
    pub fn severity(&self) -> Option<Severity> {
        self.diagnostics.iter().map(|diagnostic| diagnostic.severity).max()
    }
}

/// How to parse.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    strict: bool,
    max_threads: u32,
}

impl Default for Options {
    /// Lenient, with the bound [`limits::THREADS`].
    fn default() -> Self {
        Self { strict: false, max_threads: limits::THREADS }
    }
}

impl Options {
    /// Whether a warning, like an error, means that there is no draft.
    #[must_use]
    pub fn with_strict(self, strict: bool) -> Self {
        Self { strict, ..self }
    }

    /// Most ends, picks, shafts and treadles to read.
    #[must_use]
    pub fn with_max_threads(self, max_threads: u32) -> Self {
        Self { max_threads, ..self }
    }
}

/// Reads a WIF file leniently.
///
/// Never fails: what cannot be read is told in the diagnostics. Takes time in proportion to
/// the bytes (with a logarithmic factor where lines are out of order) and memory in proportion
/// to them, whatever counts they claim.
///
/// # Examples
///
/// ```
/// use selvedge_wif::{Code, parse};
///
/// let file = b"[WARP]\nThreads=4000000000\n[WEFT]\nThreads=4\n";
/// let parse = parse(file);
/// assert!(parse.draft.is_none());
/// let limit = parse.diagnostics.iter().find(|diagnostic| diagnostic.code == Code::Limit).unwrap();
/// assert!(limit.display(file).to_string().starts_with("error: line 2 [WARP]: 4000000000 ends"));
/// ```
pub fn parse(bytes: &[u8]) -> Parse {
    parse_with(bytes, &Options::default())
}

/// As [`parse()`], with options.
pub fn parse_with(bytes: &[u8], options: &Options) -> Parse {
    let document = Document::new(bytes);
    let mut report = Report::default();
    let draft = if is_text(&document, &mut report) {
        reader::Reader::new(&document, &mut report, options.max_threads).draft()
    } else {
        None
    };
    let diagnostics = report.finish();
    let refused =
        options.strict && diagnostics.iter().any(|found| found.severity >= Severity::Warning);
    Parse { document, draft: draft.filter(|_| !refused), diagnostics }
}

/// Whether the document can be a draft at all; reports why not.
fn is_text(document: &Document, report: &mut Report) -> bool {
    let bytes = document.as_bytes();
    let mut refuse = |code, message: String| {
        report.add(code, Span::FILE, || message);
        false
    };
    if u32::try_from(bytes.len()).is_err() {
        let most = u32::MAX;
        return refuse(Code::Limit, format!("{} bytes, expected at most {most}", bytes.len()));
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        let message = "text in UTF-16, expected UTF-8 or windows-1252";
        return refuse(Code::NotText, message.into());
    }
    if let Some(at) = bytes.iter().position(|&byte| byte == 0) {
        let message = format!("byte {at} is zero, expected the text of a draft");
        return refuse(Code::NotText, message);
    }
    let is_empty = |bytes| matches!(line::line(bytes), line::Line::Blank | line::Line::Comment(_));
    let text = bytes.strip_prefix(text::BYTE_ORDER_MARK).unwrap_or(bytes);
    if text::lines(text, 0).all(|line| is_empty(line.bytes)) {
        return refuse(Code::EmptyFile, "nothing in it, expected the sections of a draft".into());
    }
    true
}
