//! `selvedge measure` and `selvedge eval`: what they write and print, and that one can be put into the other.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

fn selvedge(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_selvedge"));
    command.current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn report_is_a_folder_that_is_replaced_only_by_a_report() {
    let place = tempfile::tempdir().unwrap();
    let arguments = [
        "measure",
        "reciprocity",
        "preset:wool-gabardine",
        "preset:silk-charmeuse",
        "-o",
        "report",
        "--budget",
        "0.002",
    ];
    let output = selvedge(place.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "preset:wool-gabardine\npreset:silk-charmeuse\n");
    let printed = text(&output.stdout);
    assert!(printed.contains("far, f32") && printed.ends_with("report/report.html\n"), "{printed}");

    let read = |name: &str| fs::read_to_string(place.path().join("report").join(name)).unwrap();
    let json: Value = serde_json::from_str(&read("report.json")).unwrap();
    assert_eq!(json["passes"], true);
    assert_eq!(json["checks"].as_array().unwrap().len(), 8);
    assert_eq!(json["tables"]["reciprocity"].as_array().unwrap().len(), 8);
    for name in json["files"].as_array().unwrap() {
        assert!(!read(name.as_str().unwrap()).is_empty(), "{name}");
    }
    assert!(read("report.html").contains("preset:silk-charmeuse"));

    // The same again gives the same, and what is not ours stays.
    let before = read("report.json");
    assert_eq!(selvedge(place.path(), &arguments).status.code(), Some(0));
    assert_eq!(read("report.json"), before);
    fs::write(place.path().join("report/notes.txt"), "mine").unwrap();
    let output = selvedge(place.path(), &arguments);
    let expected = "error: report: found \"notes.txt\" in it, expected an empty folder or one that this \
        command has written";
    assert_eq!(text(&output.stderr).trim_end(), expected);
    assert_eq!((output.status.code(), read("notes.txt")), (Some(1), "mine".to_owned()));
}

/// What `selvedge eval --json` tells of an input.
fn eval(folder: &Path, arguments: &str) -> Value {
    let words: Vec<_> = ["eval", "--json"].into_iter().chain(arguments.split(' ')).collect();
    let output = selvedge(folder, &words);
    assert!(output.status.success(), "{arguments}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn goniophotometer_tells_what_eval_tells_from_afar() {
    let place = tempfile::tempdir().unwrap();
    let cloth = "preset:duchesse-satin";
    let arguments = ["measure", "gonio", cloth, "-o", "report", "-q", "--budget", "0.01"];
    assert_eq!(selvedge(place.path(), &arguments).status.code(), Some(0));
    let slices = fs::read_to_string(place.path().join("report/duchesse-satin-slices.csv")).unwrap();
    let row = slices.lines().nth(700).unwrap();
    let numbers: Vec<f64> = row.split(',').map(|number| number.parse().unwrap()).collect();
    let [light, light_phi, viewer, viewer_phi] = [0, 1, 2, 3].map(|k| numbers[k]);
    let found = eval(
        place.path(),
        &format!("{cloth} --at 0,0 --wi {light},{light_phi} --wo {viewer},{viewer_phi}"),
    );
    for (k, expected) in numbers[4..7].iter().enumerate() {
        assert_eq!(found["f"]["far"][k], *expected, "{row}");
    }
}

#[test]
fn worst_inputs_can_be_looked_at() {
    let place = tempfile::tempdir().unwrap();
    let arguments = [
        "measure",
        "stability",
        "preset:wool-gabardine",
        "-o",
        "report",
        "-q",
        "--budget",
        "0.005",
    ];
    let output = selvedge(place.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
    let report = fs::read_to_string(place.path().join("report/report.json")).unwrap();
    let report: Value = serde_json::from_str(&report).unwrap();
    let worst = report["tables"]["worst"].as_array().unwrap();
    assert!(worst.len() > 3, "{worst:?}");
    for row in worst.iter().filter(|row| row["what"] == "greatest error") {
        let found = eval(place.path(), row["see it with selvedge eval"].as_str().unwrap());
        let f = |tier: &str| [0, 1, 2].map(|k| found["f"][tier][k].as_f64().unwrap());
        let (single, double) = (f("f32"), f("f64"));
        let greatest = double.into_iter().fold(0.0, f64::max);
        let off =
            single.iter().zip(double).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / greatest;
        let expected = row["value"].as_f64().unwrap();
        assert!((off - expected).abs() <= 1e-9 * expected, "{off}, expected {expected}: {row}");
        assert_eq!(f("batch"), single, "{row}");
    }
}

#[test]
fn eval_tells_every_factor_and_what_is_wrong() {
    let place = tempfile::tempdir().unwrap();
    let words = |text: &str| -> Vec<String> { text.split(' ').map(str::to_owned).collect() };
    let run = |text: &str| {
        let words = words(text);
        selvedge(place.path(), &words.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let at = "--at 0.00012,0.00034 --wi 30,0 --wo 20,180";
    let output = run(&format!("eval preset:silk-charmeuse {at}"));
    let told = text(&output.stdout);
    for part in [
        "yarn ",
        "segment ",
        "rough fibres, lit",
        "attenuation A",
        "normalisation a",
        "phase, peak",
        "left by the highlight of wi",
        "opacity",
        "from afar",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    // A drawn highlight has a geometry factor, and rough fibres a spread in its place.
    assert!(!told.contains("geometry"), "{told}");
    let output = run(&format!("eval preset:wool-gabardine {at} --set delta=1 --set scale=2"));
    assert!(text(&output.stdout).contains("geometry G"), "{}", text(&output.stdout));
    let json = eval(place.path(), &format!("preset:silk-charmeuse {at}"));
    assert_eq!(json["side"], "face");
    let json = eval(place.path(), "preset:silk-charmeuse --at 0,0 --wi 30,0 --wo 120,0");
    assert_eq!((&json["side"], &json["f"]["f64"][0]), (&Value::Null, &0.0.into()));

    let output = run(&format!("eval preset:silk-charmeuse {at} --set rho=0.5"));
    let expected = "error: preset:silk-charmeuse: --set rho: found no yarn that has one";
    assert_eq!((output.status.code(), text(&output.stderr).trim_end()), (Some(1), expected));
    let output = run(&format!("eval preset:silk-charmeuse {at} --set psi=7"));
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}
