//! `selvedge image`: what each subcommand writes, where to, and with which exit code.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    io::Write,
    path::Path,
    process::{Command, Output, Stdio},
};

use selvedge_cli::{
    glam::Vec3,
    image::{Format, Layer, Picture, Value, decode},
    render::film::Size,
};
use serde_json::{Value as Json, json};
use tempfile::TempDir;

const SIZE: [u32; 2] = [6, 4];

fn colors(color: impl Fn(u32, u32) -> Vec3) -> Vec<Vec3> {
    let [width, height] = SIZE;
    (0..width * height).map(|k| color(k % width, k / width)).collect()
}

/// A picture with the layers and the metadata of a rendering.
fn rendering() -> Picture {
    let mut picture = Picture::new(Size::new(SIZE[0], SIZE[1]).unwrap());
    picture.push(Layer::colors("", &colors(|x, y| Vec3::new(x as f32, y as f32, 0.25) / 4.0)));
    picture.push(Layer::colors("albedo", &colors(|_, _| Vec3::new(0.5, 0.25, 0.125))));
    picture.push(Layer::vectors("N", &colors(|_, _| Vec3::Z)));
    let mut depths = vec![2.0; 24];
    depths[3] = f32::INFINITY;
    depths[4] = f32::NAN;
    picture.push(Layer::quantity("Z", depths));
    picture.push(Layer::numbers("yarn_id", (0..24).collect()));
    picture.metadata = vec![
        ("normalization".to_owned(), Value::List(vec![0.5, 0.25])),
        ("seed".to_owned(), "5".into()),
        ("spp".to_owned(), Value::Integer(16)),
    ];
    picture
}

/// A folder with pictures, in which the program runs.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let picture = rendering();
    let exr = picture.encode(Format::Exr).unwrap();
    let mut brighter = Picture::new(picture.size());
    let color = |x, y| Vec3::new(x as f32, y as f32, 0.25) / 4.0 + Vec3::splat(0.5);
    brighter.push(Layer::colors("", &colors(color)));
    let mut small = Picture::new(Size::new(2, 1).unwrap());
    small.push(Layer::colors("", &[Vec3::ONE; 2]));
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 6\n".to_vec();
    hdr.extend([128, 64, 32, 129].repeat(24));
    let files: [(&str, &[u8]); 9] = [
        ("a.exr", &exr),
        ("a.png", &picture.encode(Format::Png).unwrap()),
        ("b.exr", &brighter.encode(Format::Exr).unwrap()),
        ("small.exr", &small.encode(Format::Exr).unwrap()),
        ("a.hdr", &hdr),
        ("cut.exr", &exr[..exr.len() / 2]),
        ("cut.hdr", &hdr[..hdr.len() - 5]),
        ("empty.png", b""),
        ("text.png", b"no picture at all"),
    ];
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let png = fs::read(folder.path().join("a.png")).unwrap();
    fs::write(folder.path().join("cut.png"), &png[..40]).unwrap();
    folder
}

/// Runs `selvedge image` in `folder`, with `input` to read.
fn run_with(folder: &Path, arguments: &str, input: &[u8]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .current_dir(folder)
        .arg("image")
        .args(arguments.split_whitespace())
        .env("COLUMNS", "80")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // A program that does not read closes its end.
    let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
}

fn run(folder: &Path, arguments: &str) -> Output {
    run_with(folder, arguments, b"")
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

#[track_caller]
fn check_failure(arguments: &str, message: &str) {
    let folder = folder();
    let output = run(folder.path(), arguments);
    assert_eq!(stderr(&output), format!("error: {message}\n"), "{arguments}");
    assert_eq!((code(&output), stdout(&output)), (1, ""), "{arguments}");
    assert!(!folder.path().join("out.png").exists(), "{arguments}");
}

#[test]
fn equal_pictures_differ_by_nothing() {
    let folder = folder();
    for metric in ["rmse", "relmse", "max", "flip"] {
        let arguments = format!("diff a.exr a.exr --metric {metric} --threshold 0");
        let output = run(folder.path(), &arguments);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let expected = "rmse    0\nrelmse  0\nmax     0 at 0,0\nflip    0\n";
        assert_eq!((stdout(&output), stderr(&output)), (expected, ""));
    }
}

#[test]
fn differences_are_measured_and_compared_with_the_threshold() {
    let folder = folder();
    let output = run(folder.path(), "diff b.exr a.exr --json --metric max --threshold 0.6");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let found: Json = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(found["rmse"], 0.5);
    assert_eq!(found["max"], json!({ "difference": 0.5, "x": 0, "y": 0 }));
    // Twenty-four pixels of red x / 4, green y / 4 and blue 1 / 16.
    let relative: f64 = colors(|x, y| Vec3::new(x as f32, y as f32, 0.25) / 4.0)
        .iter()
        .flat_map(Vec3::to_array)
        .map(|b| 0.25 / (f64::from(b).powi(2) + 0.01))
        .sum();
    let relmse = found["relmse"].as_f64().unwrap();
    assert!((relmse - relative / 72.0).abs() < 1e-9, "{relmse}, expected {}", relative / 72.0);
    let flip = found["flip"].as_f64().unwrap();
    assert!(flip > 0.1 && flip < 1.0, "{flip}");
    let keys = ["unlike", "metric", "threshold", "above"].map(|key| found[key].clone());
    assert_eq!(keys, [json!(0), json!("max"), json!(0.6), json!(false)]);

    for (threshold, expected) in [("0.5", 0), ("0.4999", 3)] {
        let arguments = format!("diff b.exr a.exr --threshold {threshold}");
        assert_eq!(code(&run(folder.path(), &arguments)), expected, "{threshold}");
    }
    let arguments = "diff b.exr a.exr --metric flip --threshold 0.01 -o out.png";
    assert_eq!(code(&run(folder.path(), arguments)), 3);
    let shown = decode(&fs::read(folder.path().join("out.png")).unwrap()).unwrap();
    assert!(shown.to_colors().iter().all(|color| color.x > 0.0 && color.x == color.y));
    run(folder.path(), "diff b.exr a.exr --metric max -o out.exr");
    let shown = decode(&fs::read(folder.path().join("out.exr")).unwrap()).unwrap();
    assert_eq!(shown.to_colors(), [Vec3::splat(0.5); 24]);
}

#[test]
fn values_that_are_not_finite_are_above_every_threshold() {
    let folder = folder();
    let mut spoilt = Picture::new(rendering().size());
    spoilt.push(Layer::colors("", &[Vec3::NAN; 24]));
    fs::write(folder.path().join("nan.exr"), spoilt.encode(Format::Exr).unwrap()).unwrap();
    let output = run(folder.path(), "diff nan.exr a.exr --json --threshold 1e300");
    assert_eq!(code(&output), 3);
    let found: Json = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!((&found["rmse"], &found["flip"]), (&Json::Null, &json!(1.0)));
    let expected = "warning: nan.exr, against a.exr: found 24 pixels that are finite in one only\n";
    assert_eq!(stderr(&output), expected);
    let same = run(folder.path(), "diff nan.exr nan.exr --threshold 0");
    assert_eq!((code(&same), stderr(&same)), (0, ""));
}

#[test]
fn what_cannot_be_read_or_compared_is_told() {
    let formats = "expected a PNG, EXR or HDR picture";
    check_failure(
        "diff small.exr a.exr -o out.png",
        "small.exr, against a.exr: found 2x1 pixels, expected 6x4",
    );
    check_failure("diff - -", "standard input: found it as both pictures, expected it as one");
    check_failure("info none.exr", "none.exr: no such file");
    check_failure("info .", ".: found a folder, expected a picture");
    check_failure("info empty.png", &format!("empty.png: found an empty file, {formats}"));
    check_failure(
        "info text.png",
        &format!("text.png: found a file that begins with 6e 6f 20 70 69 63 74 75, {formats}"),
    );
    check_failure(
        "convert cut.exr -o out.png",
        "cut.exr: EXR: found its end too soon, expected more pixels or attributes",
    );
    check_failure(
        "convert cut.png -o out.png",
        "cut.png: PNG: found its end too soon, expected more pixels",
    );
    check_failure(
        "convert cut.hdr -o out.png",
        "cut.hdr: HDR: row 4 of 4: found the end of the file, expected more pixels",
    );
    check_failure(
        "convert a.exr -o out.png --layer depth",
        "a.exr: found no layer \"depth\", expected one of beauty, N, Z, albedo, yarn_id",
    );
    check_failure(
        "convert a.exr -o nowhere/out.png",
        "nowhere/out.png: found no folder nowhere, expected an existing one",
    );
}

#[test]
fn a_wrong_command_line_is_told_by_code_2() {
    let folder = folder();
    for (arguments, message) in [
        ("diff a.exr", "error: the following required arguments were not provided"),
        ("diff a.exr b.exr --metric psnr", "error: invalid value 'psnr'"),
        (
            "diff a.exr b.exr --threshold nan",
            "error: invalid value 'nan' for '--threshold <X>': expected a number, 0 or greater",
        ),
        ("diff a.exr b.exr -o out.jpg", "error: invalid value 'out.jpg'"),
        (
            "convert a.exr -o out.hdr",
            "error: invalid value 'out.hdr' for '--output <OUT>': expected a name that ends in .png or .exr",
        ),
        ("convert a.exr -o out.png --exposure inf", "error: invalid value 'inf'"),
        ("convert a.exr -o out.png --view film", "error: invalid value 'film'"),
    ] {
        let output = run(folder.path(), arguments);
        assert_eq!(code(&output), 2, "{arguments}");
        assert!(stderr(&output).starts_with(message), "{arguments}: {}", stderr(&output));
    }
}

#[test]
fn info_tells_layers_ranges_and_metadata() {
    let folder = folder();
    let output = run(folder.path(), "info a.exr");
    let expected = "\
a.exr: 6x4 pixels

layer    channel  type  min     max     mean    non-finite
beauty   R        f32   0       1.25    0.625   0
beauty   G        f32   0       0.75    0.375   0
beauty   B        f32   0.0625  0.0625  0.0625  0
N        X        f32   0       0       0       0
N        Y        f32   0       0       0       0
N        Z        f32   1       1       1       0
Z                 f32   2       2       2       2
albedo   R        f32   0.5     0.5     0.5     0
albedo   G        f32   0.25    0.25    0.25    0
albedo   B        f32   0.125   0.125   0.125   0
yarn_id           u32   0       23      11.5    0

normalization: [0.5,0.25]
seed: 5
spp: 16
";
    assert_eq!((stdout(&output), stderr(&output)), (expected, ""));
    let exr = fs::read(folder.path().join("a.exr")).unwrap();
    let output = run_with(folder.path(), "info - --json", &exr);
    let found: Json = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(
        (&found["file"], &found["width"], &found["height"]),
        (&json!("standard input"), &json!(6), &json!(4))
    );
    let expected = json!({
        "name": "Z",
        "channels": [{
            "name": "", "type": "f32", "min": 2.0, "max": 2.0, "mean": 2.0, "non_finite": 2
        }],
    });
    assert_eq!(found["layers"][2], expected);
    let expected = json!({ "normalization": [0.5, 0.25], "seed": "5", "spp": 16 });
    assert_eq!(found["metadata"], expected);
}

/// The picture that `selvedge image convert` writes.
fn convert(folder: &Path, arguments: &str, output: &str) -> Picture {
    let found = run(folder, &format!("convert {arguments} -o {output}"));
    assert_eq!((code(&found), stderr(&found)), (0, ""), "{arguments}");
    decode(&fs::read(folder.join(output)).unwrap()).unwrap()
}

#[test]
fn conversion_to_exr_keeps_everything() {
    let folder = folder();
    let found = convert(folder.path(), "a.exr", "out.exr");
    assert_eq!(found.metadata, rendering().metadata);
    assert_eq!(found.layers().len(), 5);
    let bytes = |name| fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("a.exr") == bytes("out.exr"));
    let found = convert(folder.path(), "a.hdr", "out.exr");
    assert_eq!(found.to_colors(), [Vec3::new(1.0, 0.5, 0.25); 24]);
}

#[test]
fn conversion_from_png_and_back_changes_no_pixel() {
    let folder = folder();
    let before = decode(&fs::read(folder.path().join("a.png")).unwrap()).unwrap();
    assert_eq!(convert(folder.path(), "a.png", "b.png"), before);
    assert_eq!(convert(folder.path(), "a.png", "c.exr").to_colors(), before.to_colors());
    assert_eq!(convert(folder.path(), "c.exr --view raw", "c.png"), before);
    // The view that makes a picture of radiance would make it darker once more.
    assert_ne!(convert(folder.path(), "c.exr", "d.png"), before);
}

#[test]
fn layer_exposure_and_view_are_chosen() {
    let folder = folder();
    let albedo = convert(folder.path(), "a.exr --layer albedo --exposure 1", "out.exr");
    assert_eq!(albedo.layers().len(), 1);
    assert_eq!(albedo.layers()[0].name, "albedo");
    assert_eq!(albedo.to_colors(), [Vec3::new(1.0, 0.5, 0.25); 24]);
    let darker = convert(folder.path(), "a.exr --exposure -2", "out.exr");
    assert_eq!(darker.layers().len(), 1);
    assert_eq!(darker.to_colors()[9], Vec3::new(0.75, 0.25, 0.0625) / 4.0);
    // Values above 0.6 are compressed by the view and others are not.
    let shown = convert(folder.path(), "a.exr", "srgb.png").to_colors();
    let raw = convert(folder.path(), "a.exr --view raw", "raw.png").to_colors();
    assert!(shown[4].x < 0.9 && raw[4].x == 1.0, "{} {}", shown[4], raw[4]);
    assert!((raw[2].x - 0.5).abs() < 0.005 && shown[2] == raw[2], "{} {}", shown[2], raw[2]);
    // A direction is no light.
    let normals = convert(folder.path(), "a.exr --layer N", "n.png").to_colors();
    assert_eq!(normals, [Vec3::Z; 24]);
    let beauty = convert(folder.path(), "a.exr --layer beauty", "beauty.png").to_colors();
    assert_eq!(beauty, shown);
}

#[test]
fn dash_is_standard_input_and_output() {
    let folder = folder();
    let file = |name| fs::read(folder.path().join(name)).unwrap();
    let output = run_with(folder.path(), "convert - -o -", &file("a.exr"));
    assert_eq!((code(&output), stderr(&output)), (0, ""));
    assert!(output.stdout == file("a.png"));
    let output = run_with(folder.path(), "diff - b.exr --threshold 0", &file("b.exr"));
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}

#[test]
fn a_file_is_read_by_what_is_in_it() {
    let folder = folder();
    fs::copy(folder.path().join("a.exr"), folder.path().join("misnamed.png")).unwrap();
    let output = run(folder.path(), "diff misnamed.png a.exr --threshold 0");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}
