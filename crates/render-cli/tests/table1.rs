//! A cloth beside pictures of it, in small.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{fs, path::Path, process::Command};

use serde_json::Value;

#[test]
fn cloth_and_pictures_take_turns_and_what_is_missed_is_told() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("table1");
    let _ = fs::remove_dir_all(&folder);
    let mut command = Command::new(env!("CARGO_BIN_EXE_selvedge"));
    command.args(["measure", "table1", "preset:wool-gabardine", "-q", "--budget", "0.001"]);
    let ended = command.args(["--map", "64", "--size", "24", "-o"]).arg(&folder).output().unwrap();
    // Pictures that small are no 100 MB.
    assert_eq!(ended.status.code(), Some(3), "{}", String::from_utf8_lossy(&ended.stderr));
    let report = fs::read(folder.join("report.json")).unwrap();
    let report: Value = serde_json::from_slice(&report).unwrap();
    let rows = |name: &str| report["tables"][name].as_array().unwrap().clone();
    let table = rows("table1");
    assert_eq!(table.len(), 6, "{table:?}");
    assert_eq!((rows("ratios").len(), rows("bad-cases").len()), (2, 4));
    // Both show the same: reflectances are adjusted until they do.
    let [cloth, texture] = [0, 1].map(|row| table[row]["mean radiance"].as_f64().unwrap());
    assert!((cloth / texture - 1.0).abs() < 0.1, "{cloth} {texture}");
    // 64 × 64 texels of 3 + 3 + 1 + 3 + 1 bytes, 4/3 of that with smaller copies, and 1 kB each of what bytes
    // mean.
    let bytes = table[1]["shader, MB"].as_f64().unwrap();
    assert!((bytes - 0.0652).abs() < 0.001, "{bytes} MB");
}
