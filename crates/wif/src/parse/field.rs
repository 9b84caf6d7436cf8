//! Values at their place in the file, read with a diagnostic where they are unreadable.

use nom::Offset;

use super::value::{self, Item};
use crate::diagnostic::{Code, Report, quote};
use crate::span::Span;

/// A value without the white space around it, and where it stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Field<'d> {
    pub(super) bytes: &'d [u8],
    pub(super) at: usize,
}

impl<'d> Field<'d> {
    pub(super) fn span(self) -> Span {
        Span::new(self.at, self.bytes.len())
    }

    /// The place of `part`, which is a part of the value.
    fn span_of(self, part: &[u8]) -> Span {
        Span::new(self.at.saturating_add(self.bytes.offset(part)), part.len())
    }

    pub(super) fn without_comment(self) -> Self {
        let bytes = value::without_comment(self.bytes);
        Self { bytes, at: self.span_of(bytes).start }
    }
}

/// Calls `each` with the numbers of a list and where they stand.
pub(super) fn numbers(
    report: &mut Report,
    field: Field<'_>,
    mut each: impl FnMut(&mut Report, u32, Span),
) {
    for item in value::list(field.bytes) {
        match item {
            Item::Number(number, digits) => each(report, number, field.span_of(digits)),
            Item::Annotated(number, text) => {
                annotated(report, field, text);
                each(report, number, field.span());
            }
            Item::Bad(text) => report.add(Code::BadNumber, field.span_of(text), || {
                format!("{} is skipped, expected a whole number", quote(text))
            }),
        }
    }
}

/// Reports text behind a value, which is read as a comment.
fn annotated(report: &mut Report, field: Field<'_>, text: &[u8]) {
    report.add(Code::TextAfterNumber, field.span_of(text), || {
        format!("{} follows the value, expected ; before a comment", quote(text))
    });
}

/// A value of `grammar`, which a comment may follow, even one that lacks its `;`.
fn single<V>(
    report: &mut Report,
    field: Field<'_>,
    grammar: impl Fn(&[u8]) -> Option<V>,
) -> Option<V> {
    grammar(field.bytes).or_else(|| {
        let (word, text) = value::word(field.bytes)?;
        let value = grammar(word)?;
        annotated(report, field, text);
        Some(value)
    })
}

/// The first number of a list.
pub(super) fn number(report: &mut Report, field: Field<'_>) -> Option<u32> {
    let mut first = None;
    numbers(report, field, |_, number, _| first = first.or(Some(number)));
    first
}

pub(super) fn real(report: &mut Report, field: Field<'_>) -> Option<f64> {
    let field = field.without_comment();
    let Some((real, comma)) = single(report, field, value::real) else {
        report.add(Code::BadNumber, field.span(), || {
            format!("{} is skipped, expected a length of 0 or more", quote(field.bytes))
        });
        return None;
    };
    if comma {
        report.add(Code::DecimalComma, field.span(), || {
            format!("{} is read as {real}, expected a decimal point", quote(field.bytes))
        });
    }
    Some(real)
}

/// Three components of a colour; of more numbers the first three.
pub(super) fn color(report: &mut Report, field: Field<'_>) -> Option<[u32; 3]> {
    let mut found = Vec::with_capacity(3);
    numbers(report, field, |_, number, _| {
        if found.len() < 3 {
            found.push(number);
        }
    });
    let color = <[u32; 3]>::try_from(found).ok();
    if color.is_none() {
        report.add(Code::BadColor, field.span(), || {
            format!("{} is skipped, expected red, green and blue", quote(field.bytes))
        });
    }
    color
}

/// `assumed` where the value is neither true nor false.
pub(super) fn boolean(report: &mut Report, field: Field<'_>, assumed: bool) -> bool {
    let field = field.without_comment();
    single(report, field, value::boolean).unwrap_or_else(|| {
        report.add(Code::BadBoolean, field.span(), || {
            format!("{} is read as {assumed}, expected true or false", quote(field.bytes))
        });
        assumed
    })
}
