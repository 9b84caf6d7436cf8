//! The committed header says what the sources say.

use std::path::Path;
use std::{env, fs};

use cbindgen::{Builder, Config};

/// The header that the sources make: the page at the head of `lib.rs`, then every item.
fn generate(root: &Path) -> String {
    let mut config = Config::from_file(root.join("cbindgen.toml")).expect("cbindgen.toml is right");
    let lib = fs::read_to_string(root.join("src/lib.rs")).expect("the sources are there");
    let page = lib.lines().map_while(|line| line.strip_prefix("//!"));
    let page: String = page.map(|line| format!(" *{line}\n")).collect();
    config.header = Some(format!(
        "/*\n{page} */\n\n/* Generated from the Rust sources by `BLESS=1 cargo test -p selvedge-ffi`. */"
    ));
    let bindings =
        Builder::new().with_config(config).with_crate(root).generate().expect("the sources parse");
    let mut header = Vec::new();
    bindings.write(&mut header);
    String::from_utf8(header).expect("the sources are UTF-8")
}

#[test]
fn the_header_is_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("include/selvedge.h");
    let expected = generate(root);
    if env::var_os("BLESS").is_some() {
        fs::write(&path, &expected).unwrap();
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    let differs = expected.lines().zip(committed.lines()).position(|(new, old)| new != old);
    assert!(
        committed == expected,
        "{}: differs from the sources at line {:?} of {} and {}; BLESS=1 rewrites it",
        path.display(),
        differs.map(|line| line + 1),
        committed.lines().count(),
        expected.lines().count()
    );
}
