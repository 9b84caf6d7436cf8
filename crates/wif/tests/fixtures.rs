//! Every file of the repository's fixtures, whole or broken.

use std::fs;
use std::path::{Path, PathBuf};

use selvedge_wif::{Severity, parse};

/// The files of a folder of fixtures; none where the crate stands alone.
fn files(folder: &str) -> Vec<PathBuf> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    if !fixtures.is_dir() {
        println!("skipped: {} is not part of the packed crate", fixtures.display());
        return Vec::new();
    }
    let entries = fs::read_dir(fixtures.join(folder)).expect("the folder is there");
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    let found: Vec<_> =
        paths.filter(|path| path.extension().is_some_and(|is| is == "wif")).collect();
    assert!(!found.is_empty(), "no files in {folder}");
    found
}

#[test]
fn files_are_kept_byte_for_byte_and_rewritten_to_the_same_draft() {
    for path in files("drafts").into_iter().chain(files("invalid")) {
        let bytes = fs::read(&path).unwrap();
        let first = parse(&bytes);
        assert_eq!(first.document.as_bytes(), bytes, "{}", path.display());
        if let Some(draft) = first.draft {
            let text = draft.to_wif();
            let again = parse(text.as_bytes());
            assert_eq!(again.draft, Some(draft), "{}:\n{text}", path.display());
        }
    }
}

#[test]
fn drafts_have_no_warnings_and_weave() {
    for path in files("drafts") {
        let bytes = fs::read(&path).unwrap();
        let parse = parse(&bytes);
        let warned = parse.diagnostics.iter().find(|found| found.severity > Severity::Note);
        assert!(warned.is_none(), "{}: {}", path.display(), warned.unwrap().display(&bytes));
        let draft = parse.draft.unwrap();
        let drawdown =
            draft.drawdown().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(drawdown.ends(), draft.warp.count as usize, "{}", path.display());
    }
}
