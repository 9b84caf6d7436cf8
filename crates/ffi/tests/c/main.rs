//! C and C++ programs against the committed headers and both kinds of library.
//!
//! Cargo builds every kind of the library before the tests of its package, into the folder of
//! the test programs. Linking here follows the linkers of Unix.
#![cfg(unix)]

mod abi;
#[path = "../common/mod.rs"]
mod common;
mod programs;

use std::path::Path;

use programs::{Compiler, Linkage, Program};

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
            let program = Program::compile("eval.c", Compiler::Cc, linkage, &["-O2"]);
            let found = program.stdout(&[&common::fixture(name)]);
            let differs = expected.lines().zip(found.lines()).find(|(rust, c)| rust != c);
            assert!(found == expected, "{name}, {linkage:?}: Rust and C give {differs:?}");
        }
    }
}

#[test]
fn a_bad_draft_ends_the_c_program_with_its_reason() {
    let program = Program::compile("eval.c", Compiler::Cc, Linkage::Static, &[]);
    let output = program.run(&[], &[&common::fixture("invalid/limit.wif")]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr.contains("line 17 [WARP]: 4000000000 ends, expected at most"), "{stderr}");
}

/// The programs that check every promise themselves.
const CHECKING: [&str; 4] = ["contract.c", "wrapper.cpp", "thunderloom.c", "thunderloom.cpp"];

fn draft() -> std::path::PathBuf {
    common::fixture("drafts/plain.wif")
}

#[test]
fn promises_hold_from_c_and_from_cpp_by_either_compiler() {
    for compiler in [Compiler::Cc, Compiler::Gcc, Compiler::Clang] {
        if !compiler.is_there() {
            eprintln!("skipped: there is no {compiler:?}");
            continue;
        }
        for source in CHECKING {
            let program = Program::compile(source, compiler, Linkage::Shared, &["-O2"]);
            assert_eq!(program.stdout(&[&draft()]), "", "{compiler:?} {source}");
        }
    }
}

#[test]
fn promises_hold_under_sanitizers() {
    const SANITIZE: [&str; 4] =
        ["-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
    for source in CHECKING {
        let program = Program::compile(source, Compiler::Cc, Linkage::Static, &SANITIZE);
        assert_eq!(program.stdout(&[&draft()]), "", "{source}");
    }
}

#[test]
fn promises_hold_under_valgrind() {
    if !programs::is_there("valgrind") {
        eprintln!("skipped: there is no valgrind");
        return;
    }
    // The other program prepares nine shaders, which takes a minute there.
    let program = Program::compile("contract.c", Compiler::Cc, Linkage::Static, &["-g"]);
    let valgrind = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full"];
    let output = program.run(&valgrind, &[&draft() as &Path]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && text.is_empty(), "{text}");
}

#[test]
fn the_example_draws_a_swatch() {
    let source = programs::package("hosts/c/swatch.c");
    let lines = std::fs::read_to_string(&source).unwrap().lines().count();
    assert!(lines <= 80, "{lines} lines");
    let source = source.to_str().expect("the package has a path in UTF-8");
    let program = Program::compile(source, Compiler::Cc, Linkage::Shared, &["-O2"]);
    let folder = tempfile::TempDir::new().unwrap();
    let picture = folder.path().join("denim.ppm");
    program.stdout(&[&common::fixture("fabrics/denim.json"), &picture]);
    let bytes = std::fs::read(&picture).unwrap();
    let (header, pixels) = bytes.split_at(15);
    assert_eq!((header, pixels.len()), (&b"P6 400 400 255\n"[..], 400 * 400 * 3));
    let mean = |channel: usize| {
        let sum: u64 = pixels.iter().skip(channel).step_by(3).copied().map(u64::from).sum();
        sum / (400 * 400)
    };
    assert!(mean(2) > mean(0) + 20, "denim is blue: {} {} {}", mean(0), mean(1), mean(2));
    let failed = program.run(&[], &[Path::new("no such file"), &picture]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(
        String::from_utf8_lossy(&failed.stderr).starts_with("swatch: no such file: cannot be read")
    );
}
