//! What the buffers of a glTF refer to (RFC 3986, as far as glTF uses them).

use std::path::{Component, Path, PathBuf};

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

#[cfg(test)]
mod tests {
    use super::*;

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
