//! What the buffers of a glTF refer to (RFC 2397 and 3986, as far as glTF uses them).

use std::path::{Component, Path, PathBuf};

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};

/// The bytes of a `data:` URI; `None` if it is another URI.
///
/// # Errors
///
/// What was found, and what was expected, when the data is not in base 64.
pub(super) fn data(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let (kind, text) = uri.strip_prefix("data:")?.split_once(',').unwrap_or_default();
    let bytes = if kind.ends_with(";base64") { decode_base64(text) } else { None };
    Some(bytes.ok_or_else(|| "found data that is not in base 64, expected data that is".to_owned()))
}

/// The path of a URI that stays in the folder where it is found.
///
/// # Errors
///
/// What was found, and what was expected, for another URI.
pub(super) fn beside(uri: &str) -> Result<PathBuf, String> {
    let path = decode_percent(uri).map(PathBuf::from);
    let is_plain = |component| matches!(component, Component::Normal(_) | Component::CurDir);
    match path {
        Some(path)
            if !uri.contains([':', '\\'])
                && path.file_name().is_some()
                && path.components().all(is_plain) =>
        {
            Ok(path)
        }
        _ => Err(format!("found {}, expected a file in the same folder", super::super::quote(uri))),
    }
}

/// That the file at `path`, links followed, is in `folder`.
pub(super) fn is_in(path: &Path, folder: &Path) -> bool {
    let folder = if folder == Path::new("") { Path::new(".") } else { folder };
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) => path.starts_with(folder),
        _ => false,
    }
}

fn decode_percent(text: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(if byte == b'%' {
            let mut digit = || (rest.next()? as char).to_digit(16);
            (digit()? * 16 + digit()?) as u8
        } else {
            byte
        });
    }
    String::from_utf8(bytes).ok().filter(|text| !text.contains('\0'))
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
        assert_eq!(data("cloth.bin"), None);
        let found = data("data:application/octet-stream;base64,Zm9v").unwrap();
        assert_eq!(found.unwrap(), b"foo");
        for uri in ["data:", "data:text/plain,foo", "data:;base64,Z", "data:;base64"] {
            assert!(data(uri).unwrap().is_err(), "{uri}");
        }
    }

    #[test]
    fn paths_stay_in_the_folder() {
        assert_eq!(beside("a%20%C3%A9.bin").unwrap(), Path::new("a é.bin"));
        assert_eq!(beside("./sub/a.bin").unwrap(), Path::new("./sub/a.bin"));
        for uri in [
            "",
            ".",
            "..",
            "../a",
            "a/../../b",
            "/etc/a",
            "%2e%2e/a",
            "..%2Fa",
            "%2Fa",
            "%00",
            "file:///a",
            "http://a/b",
            "c:\\a",
            "a\\..\\b",
            "%",
            "%G0",
            "%ff",
        ] {
            let message = format!("found {uri:?}, expected a file in the same folder");
            assert_eq!(beside(uri), Err(message), "{uri}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn links_do_not_lead_out_of_the_folder() {
        let outer = tempfile::tempdir().unwrap();
        let folder = outer.path().join("folder");
        std::fs::create_dir(&folder).unwrap();
        for path in [outer.path().join("secret"), folder.join("own")] {
            std::fs::write(path, "").unwrap();
        }
        std::os::unix::fs::symlink(outer.path().join("secret"), folder.join("link")).unwrap();
        assert!(is_in(&folder.join("own"), &folder));
        assert!(!is_in(&folder.join("link"), &folder));
        assert!(!is_in(&folder.join("missing"), &folder));
        assert!(is_in(Path::new("Cargo.toml"), Path::new("")), "tests run where the crate is");
    }
}
