//! The part of a source line that shows a span, fit for a terminal.

use std::ops::Range;

use crate::parse::text::{BYTE_ORDER_MARK, Encoding};
use crate::span::Span;

/// One line of a source, or so much of it around a span as a terminal has room for.
///
/// # Examples
///
/// ```
/// use selvedge_wif::{Excerpt, Span};
///
/// let source = b"[TEXT]\r\nTitle=K\xf6per\r\n";
/// let excerpt = Excerpt::new(source, Span { start: 14, end: 19 }, 64);
/// assert_eq!(excerpt.text, "Title=Köper");
/// assert_eq!(&excerpt.text[excerpt.mark], "Köper");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// The line as characters, without its end. Tabs are spaces, other control characters are
    /// `·`, and `…` stands for what is left out.
    pub text: String,
    /// The bytes of `text` that the span covers; empty where the span is, or is past the line.
    pub mark: Range<usize>,
}

impl Excerpt {
    /// The line of `source` in which `span` starts, cut to `width` characters besides the `…` at
    /// its ends; at most half of them go to what stands before the span.
    ///
    /// Takes time in proportion to the length of the line.
    pub fn new(source: &[u8], span: Span, width: usize) -> Self {
        let ends_line = |&byte: &u8| byte == b'\n' || byte == b'\r';
        let at = span.start.min(source.len());
        let (before, after) = source.split_at(at);
        let before = before.rsplit(ends_line).next().unwrap_or_default();
        let before = before.strip_prefix(BYTE_ORDER_MARK).unwrap_or(before);
        let after = after.split(ends_line).next().unwrap_or_default();
        let marked = &after[..span.end.saturating_sub(span.start).min(after.len())];
        let encoding = Encoding::of(&source[at - before.len()..at + after.len()]);

        let (lead, lead_cut) = tail(before, encoding, width / 2);
        let rest = width - lead.chars().count();
        let (text, text_cut) = head(after, encoding, rest);
        let (marked, _) = head(marked, encoding, rest);
        let ellipsis = |cut| if cut { "…" } else { "" };
        let start = ellipsis(lead_cut).len() + lead.len();
        Self {
            text: format!("{}{lead}{text}{}", ellipsis(lead_cut), ellipsis(text_cut)),
            mark: start..start + marked.len(),
        }
    }
}

/// The first `most` characters of `bytes` fit for a terminal, and whether any are left out.
pub(crate) fn head(bytes: &[u8], encoding: Encoding, most: usize) -> (String, bool) {
    // No character takes more than four bytes.
    let window = &bytes[..bytes.len().min(most * 4 + 4)];
    let text = encoding.decode(window);
    let shown: String = text.chars().take(most).map(printable).collect();
    let cut = window.len() < bytes.len() || text.chars().count() > most;
    (shown, cut)
}

/// The last `most` characters of `bytes` fit for a terminal, and whether any are left out.
fn tail(bytes: &[u8], encoding: Encoding, most: usize) -> (String, bool) {
    let window = &bytes[bytes.len() - bytes.len().min(most * 4 + 4)..];
    let text = encoding.decode(window);
    let skip = text.chars().count().saturating_sub(most);
    let shown: String = text.chars().skip(skip).map(printable).collect();
    (shown, skip > 0 || window.len() < bytes.len())
}

/// The character as a terminal may have it: no tab, no control character.
fn printable(c: char) -> char {
    match c {
        '\t' => ' ',
        c if c.is_control() => '\u{b7}',
        c => c,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn excerpt(source: &[u8], start: usize, end: usize) -> (String, String) {
        let Excerpt { text, mark } = Excerpt::new(source, Span { start, end }, 8);
        let marked = text[mark].to_owned();
        (text, marked)
    }

    #[test]
    fn a_short_line_is_shown_whole() {
        let of = |text: &str, marked: &str| (text.to_owned(), marked.to_owned());
        assert_eq!(excerpt("\u{feff}ä=1\r\n".as_bytes(), 3, 5), of("ä=1", "ä"));
        assert_eq!(excerpt(b"a\rb\tc\x1b\nd", 4, 6), of("b c\u{b7}", "c\u{b7}"));
        assert_eq!(excerpt(b"a\nb", 2, 9), of("b", "b"));
        assert_eq!(excerpt(b"a\nb", 9, 12), of("b", ""));
    }

    #[test]
    fn a_long_line_is_cut_on_both_sides() {
        let source = "äöü".repeat(100);
        let (text, marked) = excerpt(source.as_bytes(), 300, 304);
        assert_eq!((text.as_str(), marked.as_str()), ("…üäöüäöüä…", "äö"));
        let (text, marked) = excerpt(source.as_bytes(), 300, 600);
        assert_eq!((text.as_str(), marked.as_str()), ("…üäöüäöüä…", "äöüä"));
    }
}
