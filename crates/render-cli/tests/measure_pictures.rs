//! What `selvedge measure` finds out by drawing pictures.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

/// Measures `what` of gauze, with the folder for caches in `folder` too.
fn measure(folder: &Path, what: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .current_dir(folder)
        .args(["measure", what, "preset:cotton-gauze", "-q", "--budget", "0.001", "-o", what])
        .output()
        .unwrap()
}

fn report(folder: &Path, what: &str) -> Value {
    let text = fs::read_to_string(folder.join(what).join("report.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn trade_keeps_its_reference_and_tells_what_nothing_beats() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut tables = Vec::new();
    for run in 0..2 {
        let output = measure(folder, "trade");
        // So few samples need not keep the thresholds.
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(matches!(output.status.code(), Some(0 | 3)), "{run}: {stderr}");
        let report = report(folder, "trade");
        let ways = report["tables"]["cotton-gauze-ways"].as_array().unwrap().clone();
        let points = report["tables"]["cotton-gauze-points"].as_array().unwrap();
        assert!(points.iter().any(|point| point["front"] == "●"), "{points:?}");
        let errors: Vec<_> = ways.iter().map(|way| way["relMSE"].as_f64().unwrap()).collect();
        assert!(errors.iter().all(|error| (0.0..10.0).contains(error)), "{errors:?}");
        tables.push(errors);
        let known = fs::read_dir(folder.join("cache/selvedge/references")).unwrap();
        assert_eq!(known.count(), 2, "{run}");
        // Batches and single points draw the same picture.
        let check = report["checks"]
            .as_array()
            .unwrap()
            .iter()
            .find(|check| check["what"].as_str().unwrap().contains("single points"));
        assert_eq!(check.unwrap()["found"], 0.0, "{report}");
    }
    // The same reference and the same noise, but for the ways that look at the clock: none does.
    assert_eq!(tables[0], tables[1]);
    let page = fs::read_to_string(folder.join("trade/report.html")).unwrap();
    assert!(page.contains("was made by an earlier run"));
}

#[test]
fn figures_are_on_one_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let output = measure(folder.path(), "figures");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let tables = &report(folder.path(), "figures")["tables"];
    assert_eq!(tables["directions"].as_array().unwrap().len(), 6, "{tables}");
    let names: Vec<_> = tables["summary"].as_array().unwrap().iter().collect();
    assert!(names.iter().all(|row| row["cloth"].as_f64().unwrap() > 0.0), "{tables}");
    let sheet = folder.path().join("figures/contact-sheet.png");
    assert!(fs::metadata(sheet).unwrap().len() > 1000);
}
