//! Grammar of one value: number, list, colour, boolean, symbol, unit.
//!
//! Values come without white space around them. Except in text, `;` ends a value.

use nom::branch::alt;
use nom::bytes::complete::{tag_no_case, take, take_till};
use nom::character::complete::{char, digit0, digit1, one_of};
use nom::combinator::{all_consuming, opt, recognize, value as constant};
use nom::sequence::delimited;
use nom::{IResult, Parser};

use super::line::{is_space, trim};
use super::text::Encoding;
use crate::draft::{Symbol, Units};

/// The value before the comment, if one follows.
pub(crate) fn without_comment(input: &[u8]) -> &[u8] {
    match take_till::<_, _, ()>(|byte| byte == b';')(input) {
        Ok((_, value)) => trim(value),
        Err(_) => input,
    }
}

/// number = digit { digit }; `u32::MAX` where it is more than that
pub(crate) fn number(input: &[u8]) -> Option<u32> {
    match leading_number(input) {
        Some((number, [])) => Some(number),
        _ => None,
    }
}

/// The number at the start of `input`, and what follows it.
///
/// By hand, not with nom: reading numbers is most of the work of reading a draft.
fn leading_number(input: &[u8]) -> Option<(u32, &[u8])> {
    let (mut number, mut rest) = (0_u32, input);
    while let [digit @ b'0'..=b'9', after @ ..] = rest {
        number = number.saturating_mul(10).saturating_add(u32::from(digit & 0x0f));
        rest = after;
    }
    (rest.len() < input.len()).then_some((number, rest))
}

/// One item of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Item<'a> {
    /// With the digits it is written in.
    Number(u32, &'a [u8]),
    /// A number with text after white space: a comment that lacks its `;`.
    Annotated(u32, &'a [u8]),
    Bad(&'a [u8]),
}

/// list = item { "," item } [ ";" comment ]; items between two commas may be missing
pub(crate) fn list(input: &[u8]) -> impl Iterator<Item = Item<'_>> {
    let mut rest = Some(input);
    let next = move || {
        let input = rest?;
        // Most lists are numbers and commas only, which takes one look at each byte.
        if let Some((number, after @ ([] | [b',', ..]))) = leading_number(input) {
            rest = after.split_first().map(|(_comma, after)| after);
            let length = input.len().saturating_sub(after.len());
            return Some(Item::Number(number, input.get(..length)?));
        }
        let mut until = take_till::<_, _, ()>(|byte| matches!(byte, b',' | b';'));
        let (after, part) = until(input).ok()?;
        rest = after.strip_prefix(b",");
        Some(item(trim(part)))
    };
    std::iter::from_fn(next).filter(|item| *item != Item::Bad(b""))
}

/// item = number [ space text ]
fn item(input: &[u8]) -> Item<'_> {
    match leading_number(input) {
        Some((number, [])) => Item::Number(number, input),
        Some((number, text @ [space, ..])) if is_space(*space) => {
            Item::Annotated(number, trim(text))
        }
        _ => Item::Bad(input),
    }
}

/// The value before white space, and the text behind that, if there is any.
pub(crate) fn word(input: &[u8]) -> Option<(&[u8], &[u8])> {
    let (text, word) = take_till::<_, _, ()>(is_space)(input).ok()?;
    (!text.is_empty()).then(|| (word, trim(text)))
}

/// `real = digits [ ( "." | "," ) digits ] [ exponent ]`, at least 0 and finite; with it whether
/// the fraction is written with a comma
pub(crate) fn real(input: &[u8]) -> Option<(f64, bool)> {
    let exponent = (one_of("eE"), opt(one_of("+-")), digit1);
    let (_, (_, fraction, _)) =
        all_consuming((digit0::<&[u8], ()>, opt((one_of(".,"), digit0)), opt(exponent)))
            .parse(input)
            .ok()?;
    let comma = matches!(fraction, Some((',', _)));
    let text = std::str::from_utf8(input).ok()?;
    let real: f64 = if comma { text.replacen(',', ".", 1).parse() } else { text.parse() }.ok()?;
    real.is_finite().then_some((real, comma))
}

/// boolean = "true" | "on" | "yes" | "1" | "false" | "off" | "no" | "0"
pub(crate) fn boolean(input: &[u8]) -> Option<bool> {
    let word = |words: [&'static str; 4]| {
        let [a, b, c, d] = words.map(tag_no_case::<_, _, ()>);
        alt((a, b, c, d))
    };
    let yes = constant(true, word(["true", "on", "yes", "1"]));
    let no = constant(false, word(["false", "off", "no", "0"]));
    all_consuming(alt((yes, no))).parse(input).ok().map(|(_, value)| value)
}

/// units = "decipoints" | "inches" | "centimeters", in any case
pub(crate) fn units(input: &[u8]) -> Option<Units> {
    let all = [Units::Decipoints, Units::Inches, Units::Centimeters];
    all.into_iter().find(|units| input.eq_ignore_ascii_case(units.as_str().as_bytes()))
}

/// symbol = "'" character "'" | "#" number | number of two digits or more | character
pub(crate) fn symbol(input: &[u8], encoding: Encoding) -> Option<Symbol> {
    let one = |bytes| {
        let text = encoding.decode(bytes);
        let mut characters = text.chars();
        characters.next().filter(|_| characters.next().is_none()).map(Symbol::Char)
    };
    let code = |digits| {
        let number = number(trim(without_comment(digits)))?;
        u8::try_from(number).ok().map(Symbol::Code)
    };
    if let Ok((after, quoted)) = quoted(input)
        && without_comment(trim(after)).is_empty()
    {
        return one(quoted);
    }
    match input {
        [b'#', digits @ ..] if !digits.is_empty() => code(digits),
        [b'0'..=b'9', _, ..] => code(input),
        _ => one(input).or_else(|| one(without_comment(input))),
    }
}

/// quoted = "'" any { any but "'" } "'"
fn quoted(input: &[u8]) -> IResult<&[u8], &[u8], ()> {
    let inner = recognize((take(1_usize), take_till(|byte| byte == b'\'')));
    delimited(char('\''), inner, char('\'')).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_digits_only_and_saturate() {
        let cases: [(&[u8], _); 8] = [
            (b"0", Some(0)),
            (b"007", Some(7)),
            (b"4294967295", Some(u32::MAX)),
            (b"99999999999999999999", Some(u32::MAX)),
            (b"", None),
            (b"-1", None),
            (b"1.0", None),
            (b"1 2", None),
        ];
        for (input, expected) in cases {
            assert_eq!(number(input), expected, "{}", input.escape_ascii());
        }
    }

    fn items(input: &[u8]) -> Vec<Item<'_>> {
        list(input).collect()
    }

    #[test]
    fn lists_skip_what_is_missing_and_stop_at_a_comment() {
        use Item::{Annotated, Bad, Number};
        assert_eq!(items(b"1, 22 ,,3,"), [Number(1, b"1"), Number(22, b"22"), Number(3, b"3")]);
        assert_eq!(items(b"1,2;3,4"), [Number(1, b"1"), Number(2, b"2")]);
        assert_eq!(items(b"; 1"), []);
        assert_eq!(items(b"3 my note"), [Annotated(3, b"my note")]);
        assert_eq!(items(b"x,4=4,-1,5"), [Bad(b"x"), Bad(b"4=4"), Bad(b"-1"), Number(5, b"5")]);
    }

    #[test]
    fn reals_may_have_a_decimal_comma() {
        let cases: [(&[u8], _); 12] = [
            (b"0.212", Some((0.212, false))),
            (b"0,212", Some((0.212, true))),
            (b".5", Some((0.5, false))),
            (b"5.", Some((5.0, false))),
            (b"1e-3", Some((1e-3, false))),
            (b"80", Some((80.0, false))),
            (b"1e999", None),
            (b".", None),
            (b"", None),
            (b"-1", None),
            (b"nan", None),
            (b"1.2.3", None),
        ];
        for (input, expected) in cases {
            assert_eq!(real(input), expected, "{}", input.escape_ascii());
        }
    }

    #[test]
    fn words_end_at_white_space() {
        assert_eq!(word(b"0.1 \tor so"), Some((&b"0.1"[..], &b"or so"[..])));
        assert_eq!((word(b"0.1"), word(b"")), (None, None));
    }

    #[test]
    fn booleans_have_four_spellings_each() {
        let spellings = [(["True", "on", "YES", "1"], true), (["false", "Off", "no", "0"], false)];
        for (words, expected) in spellings {
            for word in words {
                assert_eq!(boolean(word.as_bytes()), Some(expected), "{word}");
            }
        }
        for word in ["", "yess", "onx", "10", "2"] {
            assert_eq!(boolean(word.as_bytes()), None, "{word}");
        }
    }

    #[test]
    fn symbols_are_characters_or_codes() {
        let cases: [(&str, _); 13] = [
            ("X", Some(Symbol::Char('X'))),
            ("'X'", Some(Symbol::Char('X'))),
            ("' '", Some(Symbol::Char(' '))),
            ("'''", Some(Symbol::Char('\''))),
            ("';' ; x", Some(Symbol::Char(';'))),
            ("é", Some(Symbol::Char('é'))),
            ("7", Some(Symbol::Char('7'))),
            ("219", Some(Symbol::Code(219))),
            ("#35 ; hash", Some(Symbol::Code(35))),
            ("X ; x", Some(Symbol::Char('X'))),
            ("#256", None),
            ("XY", None),
            ("", None),
        ];
        for (input, expected) in cases {
            assert_eq!(symbol(input.as_bytes(), Encoding::Utf8), expected, "{input}");
        }
    }
}
