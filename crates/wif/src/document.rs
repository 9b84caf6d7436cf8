//! The file as written: sections, keys, comments, order; lossless.

use std::borrow::Cow;
use std::fmt;

use nom::Offset;

use crate::parse::line::{self, Header, header, is_header, line, trim};
use crate::parse::name::{Name, same_name, words};
use crate::parse::text::{BYTE_ORDER_MARK, Encoding, RawLine, lines};
use crate::parse::value::without_comment;
use crate::span::Span;

/// A WIF file as it stands, byte for byte, with a view of its sections and lines.
///
/// Any bytes are a document. What is not edited stays as it is: line ends, encoding, case,
/// white space, comments, sections nobody knows. Sections and keys are named without regard to
/// case and to the amount of white space between words.
///
/// # Examples
///
/// ```
/// use selvedge_wif::Document;
///
/// let mut document = Document::new("[warp]\r\nThreads = 8 ; narrow\r\nUnits=inches\r\n");
/// document.set("WARP", "threads", "12")?;
/// assert_eq!(document.as_bytes(), b"[warp]\r\nThreads = 12 ; narrow\r\nUnits=inches\r\n");
/// # Ok::<(), selvedge_wif::EditError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Document {
    bytes: Vec<u8>,
    encoding: Encoding,
    /// What stands before the first header comes first, then the sections.
    places: Vec<Place>,
}

/// Where a section starts; it ends where the next one starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    header: usize,
    body: usize,
}

impl Document {
    /// The document with these bytes.
    pub fn new(bytes: impl Into<Vec<u8>>) -> Self {
        let mut document =
            Self { bytes: bytes.into(), encoding: Encoding::Utf8, places: Vec::new() };
        document.index();
        document
    }

    fn index(&mut self) {
        self.encoding = Encoding::of(&self.bytes);
        let mark = if self.bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
        self.places.clear();
        self.places.push(Place { header: mark, body: mark });
        let headers = lines(&self.bytes[mark..], mark).filter(|line| is_header(line.bytes));
        self.places.extend(headers.map(|line| Place { header: line.at, body: line.next }));
    }

    /// The bytes of the file.
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The bytes of the file, without a copy.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// How the bytes stand for characters: UTF-8 if they can, else Windows-1252.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// What stands before the first header, then every section, in the order of the file.
    ///
    /// The first has no name and may be empty.
    pub fn sections(&self) -> impl Iterator<Item = Section<'_>> {
        let ends = self.places.iter().skip(1).map(|place| place.header).chain([self.bytes.len()]);
        let section = |(place, end): (&Place, usize)| Section {
            header: &self.bytes[place.header..place.body],
            body: &self.bytes[place.body..end],
            start: place.header,
            encoding: self.encoding,
        };
        self.places.iter().zip(ends).map(section)
    }

    /// The comments, lines of their own and those behind values, in the order of the file.
    ///
    /// Those in private and unknown sections are content, and are not among them.
    pub fn comments(&self) -> impl Iterator<Item = Span> {
        self.sections().flat_map(Section::comments)
    }

    /// The value of `key` in the sections called `section`, the last one if there are several.
    ///
    /// Without the comment behind it in a section whose values may have one. Keys before the
    /// first header are those of `WIF`.
    pub fn get(&self, section: &str, key: &str) -> Option<Cow<'_, str>> {
        self.find(section, key).map(|(_, value)| self.encoding.decode(value.of(&self.bytes)))
    }

    /// The line and the value of the last entry `key` in the sections called `section`.
    fn find(&self, section: &str, key: &str) -> Option<(Span, Span)> {
        let mut found = None;
        for part in self.sections().filter(|part| part.is_called(section.as_bytes())) {
            let comments = Name::of(section.as_bytes()).is_some_and(|name| !name.has_text());
            for (raw, line) in part.raw_lines() {
                if let line::Line::Entry { key: found_key, value } = line
                    && same_name(found_key, key.as_bytes())
                {
                    let value = if comments { without_comment(value) } else { value };
                    let start = raw.at + raw.bytes.offset(value);
                    let line = Span { start: raw.at, end: raw.next };
                    found = Some((line, Span::new(start, value.len())));
                }
            }
        }
        found
    }

    /// Sets the value of `key` in `section`.
    ///
    /// Replaces the value of the last such entry and nothing else of its line; without one, adds
    /// a line to the end of the section; without a section, adds that to the end of the file.
    ///
    /// # Errors
    ///
    /// If a name or the value cannot stand in such a line, or has a character that the
    /// encoding of the file lacks; the document is then unchanged.
    pub fn set(&mut self, section: &str, key: &str, value: &str) -> Result<(), EditError> {
        check(section, key, value)?;
        let encoding = self.encoding;
        let encode = |text: &str| {
            let encoded = encoding.encode(text).map(Cow::into_owned);
            encoded.map_err(|character| EditError::Unencodable { character })
        };
        if let Some((_, old)) = self.find(section, key) {
            let value = encode(value)?;
            self.bytes.splice(old.start..old.end, value);
        } else {
            let entry = encode(&format!("{key}={value}"))?;
            let header = encode(&format!("[{section}]"))?;
            self.add(section, &header, &entry);
        }
        self.index();
        Ok(())
    }

    fn add(&mut self, section: &str, header: &[u8], entry: &[u8]) {
        let line_end = self.line_end();
        let last = self.sections().filter(|part| part.is_called(section.as_bytes())).last();
        let (at, new_lines) = match last {
            Some(part) => {
                let used = |&(_, line): &(RawLine<'_>, line::Line<'_>)| line != line::Line::Blank;
                let body = part.start + part.header.len();
                (
                    part.raw_lines().filter(used).last().map_or(body, |(raw, _)| raw.next),
                    vec![entry],
                )
            }
            None if self.bytes.is_empty() => (0, vec![header, entry]),
            None => (self.bytes.len(), vec![b"", header, entry]),
        };
        let mut text = Vec::new();
        if !matches!(self.bytes[..at].last(), None | Some(b'\n' | b'\r')) {
            text.extend_from_slice(line_end);
        }
        for line in new_lines {
            text.extend_from_slice(line);
            text.extend_from_slice(line_end);
        }
        self.bytes.splice(at..at, text);
    }

    /// The line end that the first line has; LF if none has one.
    fn line_end(&self) -> &'static [u8] {
        let first = lines(&self.bytes, 0).next();
        match first.and_then(|line| self.bytes.get(line.at + line.bytes.len()..line.next)) {
            Some(b"\r\n") => b"\r\n",
            Some(b"\r") => b"\r",
            _ => b"\n",
        }
    }

    /// Removes the line of the last entry `key` in the sections called `section`; returns
    /// whether there was one.
    pub fn remove(&mut self, section: &str, key: &str) -> bool {
        let Some((line, _)) = self.find(section, key) else { return false };
        self.bytes.drain(line.start..line.end);
        self.index();
        true
    }
}

/// One section of a [`Document`], or what stands before the first.
#[derive(Debug, Clone, Copy)]
pub struct Section<'a> {
    header: &'a [u8],
    body: &'a [u8],
    start: usize,
    encoding: Encoding,
}

impl<'a> Section<'a> {
    /// Its name as written, with white space folded; `None` before the first header.
    pub fn name(&self) -> Option<Cow<'a, str>> {
        let name = self.raw_name()?;
        let mut words = words(name).map(|word| self.encoding.decode(word));
        let first = words.next().unwrap_or_default();
        Some(words.fold(first, |name, word| name + " " + word))
    }

    /// The bytes it takes, header included.
    pub fn span(&self) -> Span {
        Span::new(self.start, self.header.len() + self.body.len())
    }

    /// The lines below the header.
    pub fn lines(&self) -> impl Iterator<Item = Line<'a>> + use<'a> {
        let encoding = self.encoding;
        self.raw_lines().map(move |(raw, line)| {
            let content = match line {
                line::Line::Blank => Content::Blank,
                line::Line::Comment(text) => Content::Comment(encoding.decode(text)),
                line::Line::Entry { key, value } => {
                    Content::Entry { key: encoding.decode(key), value: encoding.decode(value) }
                }
                line::Line::Text(text) => Content::Text(encoding.decode(text)),
            };
            Line { span: Span::new(raw.at, raw.bytes.len()), content }
        })
    }

    pub(crate) fn raw_name(&self) -> Option<&'a [u8]> {
        self.raw_header().map(|(_, header)| header.name)
    }

    /// The line of the header and its parts.
    pub(crate) fn raw_header(&self) -> Option<(RawLine<'a>, Header<'a>)> {
        let raw = lines(self.header, self.start).next()?;
        header(raw.bytes).map(|header| (raw, header))
    }

    pub(crate) fn raw_lines(
        &self,
    ) -> impl Iterator<Item = (RawLine<'a>, line::Line<'a>)> + use<'a> {
        let lines = lines(self.body, self.start.saturating_add(self.header.len()));
        lines.map(|raw| (raw, line(raw.bytes)))
    }

    /// As [`Document::comments`], for this section.
    fn comments(self) -> impl Iterator<Item = Span> + use<'a> {
        let name = Name::of(self.raw_name().unwrap_or(b"WIF"));
        let lines = name.map(|name| self.raw_lines().map(move |line| (name, line)));
        lines.into_iter().flatten().filter_map(|(name, (raw, line))| {
            let text = match line {
                line::Line::Comment(text) => text,
                line::Line::Entry { value, .. } if !name.has_text() => {
                    value.get(value.iter().position(|&byte| byte == b';')?..)?
                }
                _ => return None,
            };
            Some(Span::new(raw.at + raw.bytes.offset(text), text.len()))
        })
    }

    fn is_called(&self, name: &[u8]) -> bool {
        match self.raw_name() {
            Some(own) => same_name(own, name),
            None => same_name(b"WIF", name) && !self.body.is_empty(),
        }
    }
}

/// One line of a [`Section`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line<'a> {
    /// Its bytes, without the line end.
    pub span: Span,
    /// What stands in it.
    pub content: Content<'a>,
}

/// What stands in a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Content<'a> {
    /// Nothing but white space.
    Blank,
    /// A comment, from its `;` on.
    Comment(Cow<'a, str>),
    /// A key and its value, which may have a comment behind it.
    Entry {
        /// The key as written.
        key: Cow<'a, str>,
        /// All that stands behind the `=`.
        value: Cow<'a, str>,
    },
    /// Text without `=`.
    Text(Cow<'a, str>),
}

/// Why a [`Document`] cannot be edited as asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EditError {
    /// The name of the section is empty or has a bracket or a line end.
    SectionName,
    /// The key is empty, has `=` or a line end, or begins as a comment or a header does.
    Key,
    /// The value has a line end.
    Value,
    /// The encoding of the file lacks a character.
    Unencodable {
        /// The first such character.
        character: char,
    },
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SectionName => {
                f.write_str("section name: empty, or with a bracket or line end, expected one line")
            }
            Self::Key => f.write_str("key: empty, or read as something else, expected plain text"),
            Self::Value => f.write_str("value: with a line end, expected one line"),
            Self::Unencodable { character } => {
                write!(f, "text: character {character:?}, expected one of windows-1252")
            }
        }
    }
}

impl std::error::Error for EditError {}

fn check(section: &str, key: &str, value: &str) -> Result<(), EditError> {
    let spans_lines = |text: &str| text.contains(['\r', '\n']);
    if trim(section.as_bytes()).is_empty() || section.contains(']') || spans_lines(section) {
        return Err(EditError::SectionName);
    }
    let starts_badly = matches!(trim(key.as_bytes()).first(), None | Some(b';' | b'['));
    if starts_badly || key.contains('=') || spans_lines(key) {
        return Err(EditError::Key);
    }
    if spans_lines(value) { Err(EditError::Value) } else { Ok(()) }
}
