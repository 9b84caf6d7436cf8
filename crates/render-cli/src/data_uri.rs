//! Files within files: `data:` URIs (RFC 2397), in base 64.

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
    prelude::BASE64_STANDARD,
};

/// The bytes of a `data:` URI; `None` if it is another URI.
///
/// # Errors
///
/// What was found, and what was expected, when the data is not in base 64.
pub(crate) fn decode(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let (kind, text) = uri.strip_prefix("data:")?.split_once(',').unwrap_or_default();
    let bytes = if kind.ends_with(";base64") { decode_base64(text) } else { None };
    Some(bytes.ok_or_else(|| "found data that is not in base 64, expected data that is".to_owned()))
}

/// The URI of `bytes` of the media type `kind`.
pub(crate) fn encode(kind: &str, bytes: &[u8]) -> String {
    format!("data:{kind};base64,{}", BASE64_STANDARD.encode(bytes))
}

/// RFC 4648, section 4; padding may be missing.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    const LENIENT: GeneralPurposeConfig = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    GeneralPurpose::new(&STANDARD, LENIENT).decode(text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_gives_the_bytes_of_its_specification() {
        // RFC 4648, section 10.
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE", "fooba"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(decode_base64(text).unwrap(), bytes.as_bytes(), "{text}");
        }
        assert_eq!(decode_base64("+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        for text in ["Z", "Zm9vY", "Zm 9", "Zm=9", "Zm9_"] {
            assert_eq!(decode_base64(text), None, "{text}");
        }
    }

    #[test]
    fn data_is_in_the_uri() {
        assert_eq!(decode("cloth.bin"), None);
        let found = decode("data:application/octet-stream;base64,Zm9v").unwrap();
        assert_eq!(found.unwrap(), b"foo");
        assert_eq!(encode("image/png", b"foo"), "data:image/png;base64,Zm9v");
        for uri in ["data:", "data:text/plain,foo", "data:;base64,Z", "data:;base64"] {
            assert!(decode(uri).unwrap().is_err(), "{uri}");
        }
    }
}
