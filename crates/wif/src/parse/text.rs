//! Bytes to lines: byte order mark, line ends, encoding.

use std::borrow::Cow;

use nom::Parser;
use nom::branch::alt;
use nom::bytes::complete::{tag, take_till};
use nom::combinator::opt;

/// The bytes that some programs put before UTF-8 text.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// How the bytes of a file stand for characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// UTF-8, of which ASCII is a part.
    Utf8,
    /// Windows-1252, the code page of western Windows; the five bytes it leaves undefined
    /// stand for the control characters of the same number.
    Windows1252,
}

/// The characters of Windows-1252 from 0x80 to 0x9f; all others have the number of the byte.
const WINDOWS_1252: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}',
    '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

impl Encoding {
    /// UTF-8 if the bytes are UTF-8, else Windows-1252, of which any bytes are text.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        if std::str::from_utf8(bytes).is_ok() { Self::Utf8 } else { Self::Windows1252 }
    }

    /// The characters that `bytes` stand for.
    pub(crate) fn decode(self, bytes: &[u8]) -> Cow<'_, str> {
        match self {
            Self::Utf8 => String::from_utf8_lossy(bytes),
            Self::Windows1252 => {
                bytes.iter().map(|&byte| windows_1252(byte)).collect::<String>().into()
            }
        }
    }

    /// The bytes for `text`, or its first character that has none.
    pub(crate) fn encode(self, text: &str) -> Result<Cow<'_, [u8]>, char> {
        match self {
            Self::Utf8 => Ok(text.as_bytes().into()),
            Self::Windows1252 => {
                let byte = |c| (0..=u8::MAX).find(|&byte| windows_1252(byte) == c).ok_or(c);
                text.chars().map(byte).collect::<Result<Vec<_>, _>>().map(Cow::from)
            }
        }
    }
}

fn windows_1252(byte: u8) -> char {
    let special = byte.checked_sub(0x80).and_then(|index| WINDOWS_1252.get(usize::from(index)));
    special.copied().unwrap_or(char::from(byte))
}

/// A line of a file without its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawLine<'a> {
    /// Offset of the first byte.
    pub(crate) at: usize,
    /// Offset of the line that follows.
    pub(crate) next: usize,
    pub(crate) bytes: &'a [u8],
}

/// The lines of `bytes`, whose first byte stands at offset `at` of the file.
pub(crate) fn lines(bytes: &[u8], at: usize) -> impl Iterator<Item = RawLine<'_>> {
    let (mut rest, mut at) = (bytes, at);
    std::iter::from_fn(move || {
        let (after, bytes) = if rest.is_empty() { None } else { raw_line(rest) }?;
        let next = at.saturating_add(rest.len().saturating_sub(after.len()));
        let line = RawLine { at, next, bytes };
        (rest, at) = (after, next);
        Some(line)
    })
}

/// line = { any but CR and LF } [ CR LF | LF | CR ]
fn raw_line(input: &[u8]) -> Option<(&[u8], &[u8])> {
    let content = take_till::<_, _, ()>(|byte| byte == b'\n' || byte == b'\r');
    let end = alt((tag("\n"), tag("\r\n"), tag("\r")));
    let (rest, (line, _)) = (content, opt(end)).parse(input).ok()?;
    Some((rest, line))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_line_ends_mix() {
        let found: Vec<_> = lines(b"a\nb\r\nc\rd\n\r\ne", 10).map(|l| (l.at, l.bytes)).collect();
        let expected: [(usize, &[u8]); 6] =
            [(10, b"a"), (12, b"b"), (15, b"c"), (17, b"d"), (19, b""), (21, b"e")];
        assert_eq!(found, expected);
        assert_eq!(lines(b"a\n", 0).count(), 1);
        assert_eq!(lines(b"", 0).count(), 0);
    }

    #[test]
    fn windows_1252_round_trips_every_byte() {
        let all: Vec<u8> = (0..=255).collect();
        let text = Encoding::Windows1252.decode(&all);
        assert_eq!(text.chars().nth(0x80), Some('€'));
        assert_eq!(text.chars().nth(0xe9), Some('é'));
        assert_eq!(Encoding::Windows1252.encode(&text).unwrap(), all);
        assert_eq!(Encoding::Windows1252.encode("x→").unwrap_err(), '→');
    }
}
