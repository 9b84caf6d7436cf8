//! Files with something wrong, one for each code, beside the exact text of their diagnostics.
//!
//! `BLESS=1 cargo test -p selvedge-wif --test invalid` rewrites the texts.

use std::fmt::Write;
use std::path::PathBuf;
use std::{env, fs};

use selvedge_wif::{Code, parse};

#[test]
fn diagnostics_are_as_recorded() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/invalid");
    if !folder.is_dir() {
        println!("skipped: {} is not part of the packed crate", folder.display());
        return;
    }
    let bless = env::var_os("BLESS").is_some();
    for code in Code::ALL {
        let file = folder.join(format!("{code}.wif"));
        let bytes = fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let parse = parse(&bytes);
        assert!(
            parse.diagnostics.iter().any(|found| found.code == *code),
            "{}: no such diagnostic in {:#?}",
            file.display(),
            parse.diagnostics
        );
        let mut found = String::new();
        for diagnostic in &parse.diagnostics {
            writeln!(found, "{}", diagnostic.display(&bytes)).unwrap();
        }
        let text = file.with_extension("txt");
        if bless {
            fs::write(&text, &found).unwrap();
        }
        let recorded = fs::read_to_string(&text).unwrap_or_default();
        assert_eq!(found, recorded, "{} differs; BLESS=1 rewrites it", text.display());
        let wide = found.lines().find(|line| line.chars().count() > 100);
        assert_eq!(wide, None, "{}: too wide to read", text.display());
    }
}
