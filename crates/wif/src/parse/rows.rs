//! Numbered lines: collected as they stand, then put in order once the counts are known.

use super::field::Field;
use super::line::Line;
use super::text::lines;
use crate::diagnostic::{Code, Report};
use crate::document::Document;
use crate::span::Span;

/// The numbered lines of the sections of one name, as they stand.
#[derive(Debug)]
pub(super) struct Rows<V> {
    pub(super) rows: Vec<Row<V>>,
    /// Whether a line is numbered 0, and the largest number.
    has_zero: bool,
    pub(super) last: u32,
}

/// One numbered line. Offsets take 32 bits: longer files are not read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<V> {
    pub(super) key: u32,
    pub(super) at: u32,
    /// `None` where the line has no value.
    pub(super) value: Option<V>,
}

impl<V> Default for Rows<V> {
    fn default() -> Self {
        Self { rows: Vec::new(), has_zero: false, last: 0 }
    }
}

/// How the numbers of lines are read as indices.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbering {
    /// What the lines are for, as in "end".
    pub(super) what: &'static str,
    /// The number of the first.
    pub(super) first: u32,
    /// How many there are, where lines beyond are to be ignored.
    pub(super) count: Option<u32>,
}

impl<V> Rows<V> {
    pub(super) fn push(&mut self, key: u32, at: usize, value: Option<V>) {
        self.has_zero |= key == 0;
        self.last = self.last.max(key);
        self.rows.push(Row { key, at: u32::try_from(at).unwrap_or(u32::MAX), value });
    }

    /// How many threads the lines tell of, if they are counted from 0 where one is numbered so.
    pub(super) fn count(&self) -> u32 {
        self.last.saturating_add(u32::from(self.has_zero))
    }

    /// The number of the first line among `count`: 0 where one is numbered so and number `count`
    /// is missing, which is reported, else 1. Lines beyond do not count.
    pub(super) fn first(&self, report: &mut Report, document: &Document, count: u32) -> u32 {
        if !self.has_zero || self.rows.iter().any(|row| row.key == count) {
            return 1;
        }
        let inside = self.rows.iter().filter(|row| row.key < count);
        let last = inside.map(|row| row.key).max().unwrap_or(0);
        if let Some(zero) = self.rows.iter().find(|row| row.key == 0) {
            report.add(Code::ZeroBased, zero.span(document), || {
                format!("numbered 0 to {last}, expected 1 to {count}; read as counted from 0")
            });
        }
        0
    }

    /// The values by index, each index once and in order.
    pub(super) fn in_order(
        self,
        report: &mut Report,
        document: &Document,
        numbering: Numbering,
    ) -> Vec<(u32, V)> {
        let Numbering { what, first, count } = numbering;
        let mut rows = self.rows;
        rows.retain(|row| {
            let index = row.key.checked_sub(first);
            let inside = index.is_some_and(|index| count.is_none_or(|count| index < count));
            if !inside {
                report.add(Code::KeyBeyond, row.span(document), || match count {
                    Some(count) if index.is_some() => {
                        let most = first.saturating_add(count).saturating_sub(1);
                        format!("{what} {} is ignored, expected at most {most}", row.key)
                    }
                    _ => format!("{what} {} is ignored, expected at least {first}", row.key),
                });
            }
            inside
        });
        if !rows.is_sorted_by(|a, b| a.key < b.key) {
            rows.sort_by_key(|row| row.key);
            // Equal keys stand in the order of the file; the last of them is kept.
            rows.dedup_by(|next, kept| {
                let same = next.key == kept.key;
                if same {
                    report.add(Code::DuplicateKey, next.span(document), || {
                        format!(
                            "{what} {} is given again, expected once; the last counts",
                            next.key
                        )
                    });
                    std::mem::swap(next, kept);
                }
                same
            });
        }
        let index = |row: Row<V>| Some((row.key.saturating_sub(first), row.value?));
        rows.into_iter().filter_map(index).collect()
    }
}

impl<V> Row<V> {
    /// The line without its end.
    pub(super) fn span(&self, document: &Document) -> Span {
        let at = self.at as usize;
        let rest = document.as_bytes().get(at..).unwrap_or_default();
        Span::new(at, lines(rest, at).next().map_or(0, |line| line.bytes.len()))
    }
}

/// A line of a section that has numbered lines or fields: its key and its value.
pub(super) type Entry<'d> = (Field<'d>, Field<'d>);

/// The entry in a line; reports a line of prose.
pub(super) fn entry<'d>(
    report: &mut Report,
    at: usize,
    raw: &'d [u8],
    line: Line<'d>,
) -> Option<Entry<'d>> {
    use nom::Offset;
    let field = |bytes: &'d [u8]| Field { bytes, at: at.saturating_add(raw.offset(bytes)) };
    match line {
        Line::Entry { key, value } => Some((field(key), field(value))),
        Line::Text(text) => {
            report.add(Code::NoEquals, field(text).span(), || {
                "line without = is skipped, expected a key and a value".into()
            });
            None
        }
        Line::Blank | Line::Comment(_) => None,
    }
}
