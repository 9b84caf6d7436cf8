//! `selvedge render --watch` draws again when a file changes, and survives one that is not sound.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    path::Path,
    process::{Child, Command},
    thread,
    time::{Duration, Instant},
};

/// Waits until the file at `path` is there and is not `before`.
fn next(path: &Path, before: &[u8]) -> Vec<u8> {
    let started = Instant::now();
    loop {
        match fs::read(path) {
            Ok(bytes) if bytes != before => return bytes,
            _ if started.elapsed() > Duration::from_secs(120) => panic!("nothing new is drawn"),
            _ => thread::sleep(Duration::from_millis(50)),
        }
    }
}

/// What runs, until this goes.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn pictures_follow_the_fabric_and_its_draft() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/drafts");
    fs::copy(fixtures.join("tartan.wif"), at("draft.wif")).unwrap();
    let fabric = |color: &str| {
        let yarn = format!("{{\"color\": \"{color}\"}}");
        format!("{{\"version\": 1, \"draft\": \"draft.wif\", \"yarn\": {yarn}}}")
    };
    fs::write(at("fabric.json"), fabric("#ff0000")).unwrap();
    let output = at("out.png");
    let mut running = Running(
        Command::new(env!("CARGO_BIN_EXE_selvedge"))
            .args(["render", "--watch", "--quiet", "--size", "24x16", "--spp", "1", "-o"])
            .args([&output, &at("fabric.json")])
            .spawn()
            .unwrap(),
    );
    let red = next(&output, b"");
    // Half of it, as where somebody is writing: what was drawn stays.
    fs::write(at("fabric.json"), &fabric("#0000ff")[..30]).unwrap();
    thread::sleep(Duration::from_millis(600));
    assert!(fs::read(&output).unwrap() == red);
    fs::write(at("fabric.json"), fabric("#0000ff")).unwrap();
    let blue = next(&output, &red);
    fs::copy(fixtures.join("gauze.wif"), at("draft.wif")).unwrap();
    next(&output, &blue);

    let pid = running.0.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    assert_eq!(running.0.wait().unwrap().code(), Some(130));
}
