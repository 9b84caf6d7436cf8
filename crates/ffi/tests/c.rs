//! C programs against the committed header and both kinds of library.
//!
//! Cargo builds every kind of the library before the tests of its package, into the folder of
//! the test programs. Linking here follows the linkers of Unix.
#![cfg(unix)]

mod common;

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use selvedge::Status;
use tempfile::TempDir;

#[derive(Debug, Clone, Copy)]
enum Linkage {
    Static,
    Shared,
}

/// A file of this package.
fn package(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Compiles `tests/c/NAME.c` without a warning and runs it; its folder is gone afterwards.
fn run(name: &str, linkage: Linkage, arguments: &[&Path]) -> Output {
    let folder = TempDir::new().expect("there is room for a file");
    let program = folder.path().join(name);
    let this = env::current_exe().expect("this program has a path");
    let libraries = this.parent().expect("a program is in a folder");

    // Rust itself links with `cc`, so it is there.
    let mut cc = Command::new(env::var_os("CC").unwrap_or_else(|| "cc".into()));
    cc.args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "-I"]);
    cc.arg(package("include")).arg(package(&format!("tests/c/{name}.c")));
    match linkage {
        Linkage::Static => cc.arg(libraries.join("libselvedge.a")),
        Linkage::Shared => cc
            .arg(libraries.join(format!("libselvedge{}", env::consts::DLL_SUFFIX)))
            .arg(format!("-Wl,-rpath,{}", libraries.display())),
    };
    cc.args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program);
    let compiled = cc.output().expect("a C compiler starts");
    assert!(compiled.status.success(), "{cc:?}\n{}", String::from_utf8_lossy(&compiled.stderr));
    Command::new(&program).args(arguments).output().expect("what was compiled starts")
}

/// What a program printed, if it ended well and had nothing to say on standard error.
fn stdout(output: Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.is_empty(), "{}: {stderr}", output.status);
    String::from_utf8(output.stdout).expect("the program prints ASCII")
}

#[test]
fn c_and_rust_give_the_same_bits() {
    for name in ["drafts/plain.wif", "drafts/houndstooth.wif"] {
        let shader = common::shader(name);
        let mut expected = String::new();
        for uv in common::positions() {
            for [wi, wo] in common::DIRECTIONS {
                let [r, g, b] = shader.eval(uv, wi, wo).to_array().map(f32::to_bits);
                expected += &format!("{r:08x} {g:08x} {b:08x}\n");
            }
        }
        assert!(!expected.split_whitespace().all(|bits| bits == "00000000"), "{name}: no light");
        for linkage in [Linkage::Static, Linkage::Shared] {
            let found = stdout(run("eval", linkage, &[&common::fixture(name)]));
            let differs = expected.lines().zip(found.lines()).find(|(rust, c)| rust != c);
            assert!(found == expected, "{name}, {linkage:?}: Rust and C give {differs:?}");
        }
    }
}

#[test]
fn a_bad_draft_ends_the_c_program_with_its_reason() {
    let output = run("eval", Linkage::Static, &[&common::fixture("invalid/limit.wif")]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr.contains("line 17 [WARP]: 4000000000 ends, expected at most"), "{stderr}");
}

#[test]
fn the_header_has_the_numbers_of_the_library() {
    let expected = [
        format!("SELVEDGE_ABI_VERSION {}", selvedge::SELVEDGE_ABI_VERSION),
        format!("sizeof(selvedge_status) {}", size_of::<Status>()),
        format!("SELVEDGE_STATUS_OK {}", Status::Ok as u32),
        format!("SELVEDGE_STATUS_NULL_POINTER {}", Status::NullPointer as u32),
        format!("SELVEDGE_STATUS_INVALID_ARGUMENT {}", Status::InvalidArgument as u32),
        format!("SELVEDGE_STATUS_INVALID_DRAFT {}", Status::InvalidDraft as u32),
        format!("SELVEDGE_STATUS_INVALID_CLOTH {}", Status::InvalidCloth as u32),
        format!("SELVEDGE_STATUS_PANIC {}", Status::Panic as u32),
        format!("version {}", env!("CARGO_PKG_VERSION")),
    ];
    for linkage in [Linkage::Static, Linkage::Shared] {
        let found = stdout(run("contract", linkage, &[]));
        let found: Vec<_> = found.lines().collect();
        assert_eq!(found, expected, "{linkage:?}");
    }
}
