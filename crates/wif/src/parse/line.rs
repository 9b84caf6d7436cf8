//! Grammar of one line: header, entry, comment.

use nom::bytes::complete::take_till;
use nom::character::complete::char;
use nom::combinator::{opt, rest};
use nom::sequence::{preceded, separated_pair};
use nom::{IResult, Parser};

/// A line below a header, without white space around it and around its parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Line<'a> {
    Blank,
    Comment(&'a [u8]),
    Entry {
        key: &'a [u8],
        value: &'a [u8],
    },
    /// None of these: a line of prose.
    Text(&'a [u8]),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Header<'a> {
    pub(crate) name: &'a [u8],
    /// Whether the name ends with a bracket.
    pub(crate) closed: bool,
    /// What follows the bracket.
    pub(crate) after: &'a [u8],
}

/// line = space ( comment | entry | text | nothing )
#[inline]
pub(crate) fn line(input: &[u8]) -> Line<'_> {
    let input = trim(input);
    match input.first() {
        None => Line::Blank,
        Some(b';') => Line::Comment(input),
        Some(_) => match entry(input) {
            Ok((_, (key, value))) => Line::Entry { key: trim(key), value: trim(value) },
            Err(_) => Line::Text(input),
        },
    }
}

/// entry = key "=" value
fn entry(input: &[u8]) -> IResult<&[u8], (&[u8], &[u8]), ()> {
    separated_pair(take_till(|byte| byte == b'='), char('='), rest).parse(input)
}

/// Whether the line is a header, without reading the rest of it.
pub(crate) fn is_header(input: &[u8]) -> bool {
    input.iter().find(|&&byte| !is_space(byte)) == Some(&b'[')
}

/// header = space "[" name [ "]" text ]
pub(crate) fn header(input: &[u8]) -> Option<Header<'_>> {
    let name = preceded(char::<_, ()>('['), take_till(|byte| byte == b']'));
    let after = opt(preceded(char(']'), rest));
    let (_, (name, after)) = (name, after).parse(trim(input)).ok()?;
    let closed = after.is_some();
    Some(Header { name: trim(name), closed, after: after.map_or(&[], trim) })
}

/// White space within a line; the end-of-file mark of DOS is some too.
pub(crate) fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\x0b' | b'\x0c' | b'\x1a')
}

/// `input` without white space at both ends.
pub(crate) fn trim(mut input: &[u8]) -> &[u8] {
    while let [first, inner @ ..] = input
        && is_space(*first)
    {
        input = inner;
    }
    while let [inner @ .., last] = input
        && is_space(*last)
    {
        input = inner;
    }
    input
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_told_apart() {
        assert_eq!(line(b" \t\x1a"), Line::Blank);
        assert_eq!(line(b" ; x=1"), Line::Comment(b"; x=1"));
        assert_eq!(line(b"Rising Shed = yes "), Line::Entry { key: b"Rising Shed", value: b"yes" });
        assert_eq!(line(b"1="), Line::Entry { key: b"1", value: b"" });
        assert_eq!(line(b"=="), Line::Entry { key: b"", value: b"=" });
        assert_eq!(line(b"prose"), Line::Text(b"prose"));
    }

    #[test]
    fn headers_may_be_untidy() {
        let cases: [(&[u8], Header<'_>); 4] = [
            (b"  [ WARP ]", Header { name: b"WARP", closed: true, after: b"" }),
            (b"[A=B] (text) ", Header { name: b"A=B", closed: true, after: b"(text)" }),
            (b"[WARP", Header { name: b"WARP", closed: false, after: b"" }),
            (b"[[]]", Header { name: b"[", closed: true, after: b"]" }),
        ];
        for (input, expected) in cases {
            assert_eq!(header(input), Some(expected), "{}", input.escape_ascii());
        }
        assert!(is_header(b"\t[x") && !is_header(b"x[") && !is_header(b""));
        assert_eq!(header(b"WARP]"), None);
    }
}
