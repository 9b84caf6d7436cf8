//! What the parser has to say about a file.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

use crate::excerpt::{Excerpt, head};
use crate::parse::text::Encoding;
use crate::span::Span;

/// How much a [`Diagnostic`] matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing: something the file leaves open was assumed, as most programs do.
    Note,
    /// The file departs from the format; it could be read past, as the message says.
    Warning,
    /// Something could not be read. Where it leaves no draft at all, there is none.
    Error,
}

impl fmt::Display for Severity {
    /// `note`, `warning` or `error`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

macro_rules! codes {
    ($($(#[doc = $doc:expr])+ $name:ident = $text:literal, $severity:ident;)+) => {
        /// The kind of a [`Diagnostic`]: stable, one for each thing a file can have wrong.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum Code {
            $(
                $(#[doc = $doc])+
                #[doc = ""]
                #[doc = concat!("`", $text, "`, ", stringify!($severity), ".")]
                $name,
            )+
        }

        impl Code {
            /// Every code.
            pub const ALL: &'static [Self] = &[$(Self::$name),+];

            /// The code as text, as in `duplicate-key`.
            pub const fn as_str(self) -> &'static str {
                match self { $(Self::$name => $text),+ }
            }

            /// The severity of every diagnostic with this code.
            pub const fn severity(self) -> Severity {
                match self { $(Self::$name => Severity::$severity),+ }
            }
        }
    };
}

codes! {
    /// The file holds nothing but white space and comments.
    EmptyFile = "empty-file", Error;
    /// The bytes are not text: they contain NUL, or are UTF-16.
    NotText = "not-text", Error;
    /// The text has no section of a draft.
    NotWif = "not-wif", Error;
    /// A number is beyond a [limit](crate::limits) of this crate.
    Limit = "limit", Error;
    /// The number of ends or of picks is not given, and no data tells it.
    NoThreads = "no-threads", Error;
    /// The key in a list of numbered lines is not a number.
    BadKey = "bad-key", Error;

    /// The text is not UTF-8 and was read as Windows-1252.
    Windows1252 = "windows-1252", Note;
    /// Lines with a key stand before any header and were read as `[WIF]`.
    NoHeader = "no-header", Warning;
    /// The `]` of a header is missing.
    UnclosedHeader = "unclosed-header", Warning;
    /// Text follows the `]` of a header.
    TextAfterHeader = "text-after-header", Warning;
    /// A line has no `=`.
    NoEquals = "no-equals", Warning;
    /// A section occurs again; both were merged.
    DuplicateSection = "duplicate-section", Warning;
    /// A second `[WARP COLORS]` was read as the missing `[WEFT COLORS]`.
    MisnamedSection = "misnamed-section", Warning;
    /// A section is none of the format's.
    UnknownSection = "unknown-section", Note;
    /// A key occurs again in its section; the last one counts.
    DuplicateKey = "duplicate-key", Warning;
    /// A key is none of its section's.
    UnknownKey = "unknown-key", Note;

    /// The required `[WIF]` or `[CONTENTS]` is missing.
    MissingSection = "missing-section", Warning;
    /// `[CONTENTS]` lists a section that is not there.
    ContentsListsAbsent = "contents-lists-absent", Warning;
    /// `[CONTENTS]` does not list a section that is there.
    ContentsOmits = "contents-omits", Warning;
    /// The version is not 1.1.
    Version = "version", Note;

    /// A number is unreadable and was skipped.
    BadNumber = "bad-number", Warning;
    /// Unmarked text follows a number or a boolean and was read as a comment.
    TextAfterNumber = "text-after-number", Warning;
    /// A fraction is written with a comma.
    DecimalComma = "decimal-comma", Warning;
    /// A value is neither true nor false.
    BadBoolean = "bad-boolean", Warning;
    /// A colour does not have three components.
    BadColor = "bad-color", Warning;
    /// A component of a colour is outside the range and was brought into it.
    ColorRange = "color-range", Warning;
    /// A symbol is unreadable.
    BadSymbol = "bad-symbol", Warning;
    /// The unit of lengths is unknown; centimetres were assumed.
    BadUnits = "bad-units", Warning;
    /// The range of the palette is unreadable.
    BadRange = "bad-range", Warning;

    /// The number of threads, shafts or treadles is not given and was taken from the data.
    CountMissing = "count-missing", Warning;
    /// A shaft is beyond the declared number, which was raised.
    ShaftsRaised = "shafts-raised", Warning;
    /// A treadle is beyond the declared number, which was raised.
    TreadlesRaised = "treadles-raised", Warning;
    /// A line is for a thread that does not exist.
    KeyBeyond = "key-beyond", Warning;
    /// A section counts its threads from 0.
    ZeroBased = "zero-based", Warning;
    /// A thread has a colour that is not in the table.
    ColorOutside = "color-outside", Warning;
    /// Lift plan and tie-up with treadling disagree; the lift plan weaves.
    PlansDiffer = "plans-differ", Warning;

    /// The kind of shed is not given; rising was assumed.
    ShedAssumed = "shed-assumed", Note;
    /// The unit of lengths is not given; centimetres were assumed.
    UnitsAssumed = "units-assumed", Note;
    /// The range of the palette is not given.
    RangeAssumed = "range-assumed", Note;
    /// There is no colour table; two default colours were assumed.
    ColorsAssumed = "colors-assumed", Note;
    /// The file lacks what a drawdown needs.
    NoWeave = "no-weave", Note;
    /// The yarn is thicker than the space it has.
    ThickYarn = "thick-yarn", Note;
    /// Spacing and thickness are the constants that archives write when they do not know.
    DummySpacing = "dummy-spacing", Note;
}

impl fmt::Display for Code {
    /// The code as text, as in `duplicate-key`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// One thing the parser has to say about a file: what was found where, and what was expected
/// or assumed instead.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Diagnostic {
    /// How much it matters; a function of the code.
    pub severity: Severity,
    /// What kind of thing it is.
    pub code: Code,
    /// Where it is; [`Span::FILE`] where it concerns the file as a whole.
    pub span: Span,
    section: Option<Cow<'static, str>>,
    message: Box<str>,
    count: usize,
}

impl Diagnostic {
    /// How many findings it stands for: one, or for the last of a code that came too often
    /// all those that are not listed.
    pub fn count(&self) -> usize {
        self.count
    }

    /// What was found, and what was expected or assumed: lower case, without a full stop.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The name of the section it is in, where it is in one, fit for a terminal; a long name is
    /// cut.
    pub fn section(&self) -> Option<&str> {
        self.section.as_deref()
    }

    /// The diagnostic with its line in `source`, the bytes that were parsed.
    ///
    /// Three lines: place and message; line, column and the text there; a caret and the code.
    ///
    /// ```text
    /// warning: line 14 [TIEUP]: treadle 9 ties shaft 12, expected at most 8
    ///   14:5 | 9=1,12
    ///        |     ^^ shafts-raised
    /// ```
    pub fn display<'a>(&'a self, source: &'a [u8]) -> impl fmt::Display + 'a {
        Display { diagnostic: self, source }
    }
}

impl fmt::Display for Diagnostic {
    /// `[TIEUP]: treadle 9 ties shaft 12, expected at most 8`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.section {
            Some(section) => write!(f, "[{section}]: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}

/// Most characters of a source line that an excerpt shows.
const EXCERPT_WIDTH: usize = 64;

struct Display<'a> {
    diagnostic: &'a Diagnostic,
    source: &'a [u8],
}

impl fmt::Display for Display<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Diagnostic { severity, code, span, section, message, .. } = self.diagnostic;
        if *span == Span::FILE {
            return write!(f, "{severity}: file: {message}\n       = {code}");
        }
        let place = span.locate(self.source);
        write!(f, "{severity}: line {}", place.line)?;
        if let Some(section) = section {
            write!(f, " [{section}]")?;
        }
        writeln!(f, ": {message}")?;

        let excerpt = Excerpt::new(self.source, *span, EXCERPT_WIDTH);
        let characters = |range: Range<usize>| excerpt.text[range].chars().count();
        let gutter = format!("{}:{}", place.line, place.column);
        writeln!(f, "{gutter:>6} | {}", excerpt.text)?;
        let indent = characters(0..excerpt.mark.start);
        let carets = characters(excerpt.mark.clone()).max(1);
        let width = gutter.len().max(6);
        write!(f, "{:width$} | {:indent$}{} {code}", "", "", "^".repeat(carets))
    }
}

/// Text of a file as it appears in a message: quoted, short, on one line.
pub(crate) fn quote(bytes: &[u8]) -> String {
    format!("\"{}\"", shortened(bytes, 24))
}

/// The first `most` characters of text of a file, on one line.
pub(crate) fn shortened(bytes: &[u8], most: usize) -> String {
    let (text, cut) = head(bytes, Encoding::of(bytes), most);
    if cut { text + "…" } else { text }
}

/// Collects diagnostics while a file is read; keeps a bounded number of each code.
#[derive(Debug, Default)]
pub(crate) struct Report {
    section: Option<Cow<'static, str>>,
    kept: Vec<Diagnostic>,
    // Per code: how often it came, and where it came first beyond the bound.
    seen: Vec<(usize, Span)>,
}

impl Report {
    /// Names the section that the following diagnostics are in.
    pub(crate) fn enter(&mut self, section: impl Into<Cow<'static, str>>) {
        self.section = Some(section.into());
    }

    /// The following diagnostics concern the file as a whole.
    pub(crate) fn leave(&mut self) {
        self.section = None;
    }

    /// Records one diagnostic; its message is only made if it is kept.
    pub(crate) fn add(&mut self, code: Code, span: Span, message: impl FnOnce() -> String) {
        self.seen.resize(Code::ALL.len(), (0, Span::FILE));
        let Some(seen) = self.seen.get_mut(code as usize) else { return };
        seen.0 = seen.0.saturating_add(1);
        if seen.0 <= crate::limits::DIAGNOSTICS_PER_CODE {
            let message = message().into_boxed_str();
            let section = self.section.clone();
            let severity = code.severity();
            self.kept.push(Diagnostic { severity, code, span, section, message, count: 1 });
        } else if seen.1 == Span::FILE {
            seen.1 = span;
        }
    }

    /// All that was recorded, in the order of the file.
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        for (&code, &(count, span)) in Code::ALL.iter().zip(&self.seen) {
            let more = count.saturating_sub(crate::limits::DIAGNOSTICS_PER_CODE);
            if more > 0 {
                let message = format!("{more} more of the kind {code} are not listed");
                let message = message.into_boxed_str();
                self.kept.push(Diagnostic {
                    severity: code.severity(),
                    code,
                    span,
                    section: None,
                    message,
                    count: more,
                });
            }
        }
        self.kept.sort_by_key(|diagnostic| diagnostic.span.start);
        self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(source: &[u8], span: Span) -> String {
        let mut report = Report::default();
        report.enter("TIEUP");
        report.add(Code::ShaftsRaised, span, || "something".into());
        report.finish()[0].display(source).to_string()
    }

    #[test]
    fn the_caret_stands_under_the_span() {
        let text = shown(b"[TIEUP]\r\n9=1,12\r\n", Span { start: 13, end: 15 });
        let expected =
            "warning: line 2 [TIEUP]: something\n   2:5 | 9=1,12\n       |     ^^ shafts-raised";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_long_line_is_cut_around_the_caret() {
        let source = "x".repeat(1000) + "HERE" + &"y".repeat(1000);
        let text = shown(source.as_bytes(), Span { start: 1000, end: 1004 });
        let lines: Vec<_> = text.lines().collect();
        assert!(lines.iter().all(|line| line.chars().count() <= 80), "{text}");
        let (x, caret) = (lines[1].find("HERE").unwrap(), lines[2].find('^').unwrap());
        assert_eq!(lines[1][..x].chars().count(), caret, "{text}");
        assert!(lines[1].contains("…x") && lines[1].ends_with("y…"), "{text}");
    }

    #[test]
    fn spans_at_and_past_the_end_are_shown() {
        assert!(shown(b"abc", Span { start: 3, end: 3 }).contains("1:4 | abc\n"));
        assert!(shown(b"abc", Span { start: 9, end: 12 }).contains("warning: line 1"));
    }

    #[test]
    fn what_comes_too_often_is_counted() {
        let mut report = Report::default();
        for at in 1..=1000 {
            report.add(Code::NoEquals, Span::new(at, 1), || "x".into());
        }
        let all = report.finish();
        assert_eq!(all.len(), crate::limits::DIAGNOSTICS_PER_CODE + 1);
        assert_eq!(all.last().unwrap().message(), "980 more of the kind no-equals are not listed");
        assert_eq!(all.iter().map(Diagnostic::count).sum::<usize>(), 1000);
    }

    #[test]
    fn codes_have_distinct_text() {
        let mut texts: Vec<_> = Code::ALL.iter().map(|code| code.as_str()).collect();
        texts.sort_unstable();
        texts.dedup();
        assert_eq!(texts.len(), Code::ALL.len());
    }
}
