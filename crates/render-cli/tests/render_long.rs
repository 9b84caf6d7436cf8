//! Long work can be limited, watched, interrupted and gone on with.
//!
//! Mostly with swatches, which begin sooner than the draped cloth.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    collections::BTreeSet,
    fs,
    path::Path,
    process::{Command, Output},
};

use tempfile::TempDir;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/drafts");
    for name in ["plain.wif", "denim.wif"] {
        fs::copy(fixtures.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

fn command(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_selvedge"));
    command.current_dir(folder).args(arguments.split_whitespace());
    command
}

fn run(folder: &Path, arguments: &str) -> Output {
    command(folder, arguments).output().unwrap()
}

/// What is told of a run that succeeds.
fn told(folder: &Path, arguments: &str) -> String {
    let output = run(folder, arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments}: {stderr}");
    stderr
}

fn error(folder: &Path, arguments: &str) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments}");
    String::from_utf8(output.stderr).unwrap().trim_end().to_owned()
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap()
}

#[test]
fn more_samples_later_give_the_picture_of_all_at_once() {
    let folder = folder();
    let folder = folder.path();
    let options = "--size 60x40 -q";
    told(folder, &format!("swatch plain.wif -o whole.exr --spp 8 {options}"));
    let save = "--checkpoint 1h --checkpoint-file state";
    told(folder, &format!("swatch plain.wif -o part.exr --spp 3 {options} {save}"));
    assert!(bytes(folder, "part.exr") != bytes(folder, "whole.exr"));
    told(folder, &format!("swatch plain.wif -o whole2.exr --spp 8 {options} --resume state"));
    assert!(bytes(folder, "whole2.exr") == bytes(folder, "whole.exr"));
}

#[test]
fn checkpoint_is_beside_the_output() {
    let folder = folder();
    let folder = folder.path();
    told(folder, "swatch plain.wif -o out.png --size 6x4 --spp 1 --checkpoint 1h -q");
    let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["denim.wif", "out.png", "out.png.checkpoint", "plain.wif"]);
}

#[test]
fn wrong_checkpoints_are_told() {
    let folder = folder();
    let folder = folder.path();
    let options = "--spp 1 -q --size";
    told(folder, &format!("swatch plain.wif -o out.png {options} 60x40 --checkpoint 1h"));
    let resume = "--resume out.png.checkpoint";
    let prefix = "error: out.png.checkpoint: found ";
    for (arguments, message) in [
        (
            format!("plain.wif -o b.png {options} 30x20 {resume}"),
            "a picture of 60x40, expected 30x20",
        ),
        (
            format!("denim.wif -o b.png {options} 60x40 {resume}"),
            "a picture of something else, expected one of the same input, seed and version",
        ),
        (
            format!("plain.wif -o b.png {options} 60x40 {resume} --seed 1"),
            "a picture of something else, expected one of the same input, seed and version",
        ),
        (
            format!("plain.wif -o b.png {options} 60x40 {resume} --noise 0.1"),
            "a picture without a limit of noise, expected one with",
        ),
        (
            format!("plain.wif -o b.png {options} 60x40 {resume} --cropwindow 0,0,9,9"),
            "the part [0, 0, 60, 40] of the picture, expected [0, 0, 9, 9]",
        ),
    ] {
        assert_eq!(error(folder, &format!("swatch {arguments}")), format!("{prefix}{message}"));
    }
    let render = "swatch plain.wif -o b.png --size 60x40 --spp 1 -q --resume";
    assert_eq!(error(folder, &format!("{render} none")), "error: none: no such file");
    let message = "error: .: found a folder, expected a checkpoint";
    assert_eq!(error(folder, &format!("{render} .")), message);
    let message = "error: out.png: found no checkpoint, expected one that selvedge has written";
    assert_eq!(error(folder, &format!("{render} out.png")), message);
    let state = bytes(folder, "out.png.checkpoint");
    fs::write(folder.join("short"), &state[..state.len() - 5]).unwrap();
    let (found, expected) = (state.len() - 5, state.len());
    let message = format!("error: short: found {found} bytes, expected {expected}");
    assert_eq!(error(folder, &format!("{render} short")), message);
    assert!(!folder.join("b.png").exists());
}

#[test]
fn limits_that_are_none_are_told() {
    let folder = folder();
    for (option, message) in [
        ("--time 60", "expected a time above 0, as in 90s, 2m or 1.5h"),
        ("--noise 0", "expected a number from 0.0001 to 1"),
        (
            "--cropwindow 1,2,3",
            "expected left, top, right and bottom edge in pixels, as in 0,0,960,640",
        ),
    ] {
        let output = run(folder.path(), &format!("swatch plain.wif -o out.png {option}"));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr.contains(message), "{stderr}");
    }
    let message = "error: --cropwindow: found 0,0,2000,9, expected a rectangle within 0,0,480,320";
    assert_eq!(error(folder.path(), "swatch plain.wif -o o.png --cropwindow 0,0,2000,9"), message);
    let same = "swatch plain.wif -o o.png --checkpoint 1h --checkpoint-file o.png";
    let message = "error: --checkpoint-file: found the name of the output, expected another";
    assert_eq!(error(folder.path(), same), message);
}

#[test]
fn crop_shows_that_part_of_the_whole() {
    let folder = folder();
    let folder = folder.path();
    let options = "--size 60x40 -q --noise 0.2 --spp 64";
    told(folder, &format!("swatch plain.wif -o whole.png {options}"));
    told(folder, &format!("swatch plain.wif -o part.png {options} --cropwindow 7,9,50,33"));
    let picture = |name| image::load_from_memory(&bytes(folder, name)).unwrap().into_rgb8();
    let (whole, part) = (picture("whole.png"), picture("part.png"));
    assert_eq!(part.dimensions(), (43, 24));
    for (x, y, pixel) in part.enumerate_pixels() {
        assert_eq!(pixel, whole.get_pixel(x + 7, y + 9), "({x}, {y})");
    }
}

#[test]
fn reason_of_the_end_and_statistics_are_told() {
    let folder = folder();
    let options = "swatch plain.wif -o out.png --size 30x20";
    let stderr = told(folder.path(), &format!("{options} --noise 0.5 --stats"));
    let summary = stderr.lines().find(|line| line.starts_with("out.png: ")).unwrap();
    assert!(summary.contains("spp") && summary.contains(", noise is met, "), "{stderr}");
    let row = |name: &str| {
        let line = stderr.lines().find_map(|line| line.strip_prefix(name));
        line.unwrap_or_else(|| panic!("no {name} in {stderr}")).trim().to_owned()
    };
    assert_eq!(row("stopped"), "noise is met");
    assert!(row("samples").parse::<u64>().unwrap() >= 8 * 600);
    assert!(row("Msamples/s").parse::<f64>().unwrap() > 0.0);
    for stage in ["camera", "first hits", "scattering", "shadow rays", "rest"] {
        let time = row(stage);
        assert!(time.strip_suffix(" ns/sample").unwrap().parse::<f64>().unwrap() >= 0.0, "{time}");
    }
    if cfg!(target_os = "linux") {
        assert!(row("peak memory").ends_with(" MB"), "{stderr}");
    }
    let stderr = told(folder.path(), &format!("{options} --time 200ms"));
    assert!(stderr.contains(", time is up, "), "{stderr}");
}

#[test]
fn progress_is_an_object_a_line() {
    let folder = folder();
    let options = "swatch plain.wif -o out.png --size 30x20 --spp 8 -q --progress json";
    let stderr = told(folder.path(), options);
    let objects: Vec<serde_json::Value> =
        stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(objects.len() >= 2, "{stderr}");
    for object in &objects {
        let keys = object.as_object().unwrap().keys().map(String::as_str);
        let keys: BTreeSet<_> = keys.collect();
        let expected = ["done", "elapsed_s", "eta_s", "msamples_per_s", "samples", "spp"];
        assert_eq!(keys, expected.into(), "{stderr}");
    }
    let last = objects.last().unwrap();
    assert_eq!((last["done"].as_f64(), last["samples"].as_u64()), (Some(1.0), Some(8 * 600)));
}

#[cfg(unix)]
#[test]
fn interrupted_work_is_written_and_can_be_gone_on_with() {
    use std::{
        io::{BufRead, BufReader},
        process::Stdio,
    };
    let folder = folder();
    let folder = folder.path();
    let options = "--size 160x100 -q --noise 0.02 --spp 24";
    told(folder, &format!("render plain.wif -o straight.exr {options}"));
    let mut child =
        command(folder, &format!("render plain.wif -o out.exr {options} --progress json"))
            .args(["--checkpoint", "1h", "--checkpoint-file", "state"])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
    // Only once it draws does it listen.
    let mut line = String::new();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    stderr.read_line(&mut line).unwrap();
    assert!(line.starts_with('{'), "{line}");
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    while stderr.read_line(&mut line).unwrap() > 0 {}
    assert_eq!(child.wait().unwrap().code(), Some(130), "{line}");
    let picture = selvedge_cli::image::decode(&bytes(folder, "out.exr")).unwrap();
    assert_eq!([picture.size().width(), picture.size().height()], [160, 100]);
    assert!(picture.to_colors().iter().any(|color| color.x > 0.0), "nothing was drawn");
    told(folder, &format!("render plain.wif -o resumed.exr {options} --resume state"));
    assert!(bytes(folder, "resumed.exr") == bytes(folder, "straight.exr"));
}

#[test]
fn error_against_a_reference_falls_and_ends_as_the_pictures_differ() {
    let folder = folder();
    let folder = folder.path();
    let options = "--size 60x40 --exposure 0.5 -q";
    told(folder, &format!("swatch plain.wif -o true.exr --spp 256 --seed 1 {options}"));
    let log = "--reference true.exr --error-log log.csv";
    told(folder, &format!("swatch plain.wif -o part.exr --spp 32 {options} {log}"));
    let text = fs::read_to_string(folder.join("log.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("seconds,spp,relmse,flip"));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    // 1, 2, 4, 8, 16 and 32 samples per pixel, or more rows where that takes long.
    assert!(rows.len() >= 6, "{text}");
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert!(rows.is_sorted_by(|a, b| a[0] <= b[0] && a[1] < b[1]), "{text}");
    assert_eq!(last[1], 32.0, "{text}");
    assert!(last[2] < 0.3 * first[2] && last[3] < first[3], "{text}");

    let diff = run(folder, "image diff part.exr true.exr --json");
    let diff: serde_json::Value = serde_json::from_slice(&diff.stdout).unwrap();
    for (metric, found) in [("relmse", last[2]), ("flip", last[3])] {
        let expected = diff[metric].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-6 * expected, "{metric}: {found}, {expected}");
    }
}

#[test]
fn reference_must_be_a_picture_of_the_same_size() {
    let folder = folder();
    let folder = folder.path();
    told(folder, "swatch plain.wif -o small.exr --size 6x4 --spp 1 -q");
    let swatch = "swatch plain.wif -o out.png --size 60x40 --error-log log.csv --reference";
    let found = error(folder, &format!("{swatch} small.exr"));
    assert_eq!(found, "error: small.exr: found 6x4 pixels, expected 60x40");
    assert!(error(folder, &format!("{swatch} none.exr")).starts_with("error: none.exr: "));
    assert!(!folder.join("log.csv").exists());
    let alone = run(folder, "swatch plain.wif -o out.png --error-log log.csv");
    assert_eq!(alone.status.code(), Some(2));
}
