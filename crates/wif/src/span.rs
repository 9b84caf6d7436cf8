//! Places in a file: ranges of bytes, and the line and column they stand for.

use std::fmt;

use crate::parse::text::BYTE_ORDER_MARK;

/// A range of bytes of the source, `start` included and `end` excluded.
///
/// The empty span at byte 0, [`Span::FILE`], stands for the file as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Span {
    /// Offset of the first byte.
    pub start: usize,
    /// Offset of the byte after the last.
    pub end: usize,
}

impl Span {
    /// The file as a whole, for what cannot be pinned to a line.
    pub const FILE: Self = Self { start: 0, end: 0 };

    pub(crate) fn new(start: usize, len: usize) -> Self {
        Self { start, end: start.saturating_add(len) }
    }

    /// The bytes of `source` that the span covers; fewer where it reaches past the end.
    pub fn of(self, source: &[u8]) -> &[u8] {
        let end = self.end.min(source.len());
        source.get(self.start.min(end)..end).unwrap_or_default()
    }

    /// Line and column of the first byte, found by reading `source` up to there. A byte order
    /// mark takes no column.
    pub fn locate(self, source: &[u8]) -> Location {
        let before = source.get(..self.start).unwrap_or(source);
        let mut line = 1;
        let mut line_start =
            if before.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
        for (at, &byte) in before.iter().enumerate() {
            let ends_line = byte == b'\n' || (byte == b'\r' && source.get(at + 1) != Some(&b'\n'));
            if ends_line {
                line += 1;
                line_start = at + 1;
            }
        }
        Location { line, column: characters(&before[line_start..]) + 1, line_start }
    }
}

/// Number of characters in `bytes`: of code points where they are UTF-8, else of bytes.
pub(crate) fn characters(bytes: &[u8]) -> usize {
    std::str::from_utf8(bytes).map_or(bytes.len(), |text| text.chars().count())
}

/// A line and a column, both counted from 1.
///
/// Lines end at LF, CR LF or CR, as the parser reads them; columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Location {
    /// The line, from 1.
    pub line: usize,
    /// The character within the line, from 1.
    pub column: usize,
    /// Offset of the first byte of the line.
    pub line_start: usize,
}

impl fmt::Display for Location {
    /// `line 14, column 5`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, column {}", self.line, self.column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(source: &[u8], start: usize) -> (usize, usize) {
        let location = Span::new(start, 0).locate(source);
        (location.line, location.column)
    }

    #[test]
    fn every_kind_of_line_end_counts_once() {
        let source = b"a\nb\r\nc\rd";
        assert_eq!([0, 2, 5, 7].map(|start| at(source, start)), [(1, 1), (2, 1), (3, 1), (4, 1)]);
    }

    #[test]
    fn columns_count_characters() {
        assert_eq!(at("é=x".as_bytes(), 3), (1, 3));
        assert_eq!(at(b"\xe9=x", 2), (1, 3));
        assert_eq!(at("\u{feff}é=x".as_bytes(), 6), (1, 3));
        assert_eq!(at("\u{feff}x".as_bytes(), 0), (1, 1));
    }

    #[test]
    fn a_span_past_the_end_is_cut() {
        assert_eq!(Span { start: 2, end: 9 }.of(b"abc"), b"c");
        assert_eq!(Span { start: 7, end: 9 }.of(b"abc"), b"");
    }
}
