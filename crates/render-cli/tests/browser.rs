//! The page of `selvedge studio` in a browser, with `SELVEDGE_BROWSER_TESTS=1`: installs what drives the browser
//! from the npm registry into a folder of its own, which takes seconds, and opens, moves and drops things as an
//! artist would, which takes a minute or two. Needs Node.js and Chromium.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Where Debian has it; `SELVEDGE_CHROMIUM` names another.
const CHROMIUM: &str = "/usr/bin/chromium";

/// What the command prints, if it ends well.
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    out.into_owned()
}

/// A copy of the tests in the target folder, with what they need.
fn installed() -> PathBuf {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("browser");
    fs::create_dir_all(&folder).unwrap();
    for file in fs::read_dir(sources).unwrap() {
        let file = file.unwrap();
        if file.file_type().unwrap().is_file() {
            fs::copy(file.path(), folder.join(file.file_name())).unwrap();
        }
    }
    run(Command::new("npm").args(["ci", "--no-audit", "--no-fund"]).current_dir(&folder));
    folder
}

#[test]
fn studio_does_in_a_browser_what_it_should() {
    if env::var_os("SELVEDGE_BROWSER_TESTS").is_none() {
        eprintln!("skipped: SELVEDGE_BROWSER_TESTS is not set");
        return;
    }
    let chromium = env::var_os("SELVEDGE_CHROMIUM").unwrap_or_else(|| CHROMIUM.into());
    assert!(Path::new(&chromium).exists(), "{}: expected Chromium", Path::new(&chromium).display());
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let mut tests = Command::new("node");
    tests.args(["--test", "--test-reporter=spec", "studio.test.js"]).current_dir(installed());
    tests.env("SELVEDGE_PROGRAM", env!("CARGO_BIN_EXE_selvedge"));
    tests.env("SELVEDGE_FIXTURES", fixtures).env("SELVEDGE_CHROMIUM", chromium);
    println!("{}", run(&mut tests));
}
