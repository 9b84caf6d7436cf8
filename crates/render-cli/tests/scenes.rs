//! Scenes of every kind are rendered, and what is wrong with one is told in one line.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use proptest::prelude::*;
use selvedge_cli::scene::file;
use tempfile::TempDir;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

/// All scenes of a folder, in the order of their names.
fn scenes(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .collect();
    paths.sort();
    paths
}

/// Runs the program in `folder`.
fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_selvedge"));
    command.current_dir(folder).args(arguments).output().unwrap()
}

/// What the program says of `arguments`, which it refuses with exit code `code`, leaving nothing.
fn refusal(arguments: &[&str], code: i32) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = run(&folder, arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert_eq!(output.stdout, b"", "{arguments:?}");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0, "{arguments:?}");
    let message = stderr.strip_prefix("error: ").unwrap_or_else(|| panic!("{stderr}"));
    message.trim_end().to_owned()
}

#[test]
fn every_scene_is_rendered() {
    let paths = scenes(&fixtures().join("scenes"));
    assert!(paths.len() >= 2, "{paths:?}");
    for path in paths {
        let folder = tempfile::tempdir().unwrap();
        let path = path.to_str().unwrap();
        let output = run(&folder, &["render", path, "-o", "out.png", "--size=16x12", "--spp=1"]);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        let picture = fs::read(folder.path().join("out.png")).unwrap();
        assert_eq!(picture[16..24], [0, 0, 0, 16, 0, 0, 0, 12], "{path}");
    }
}

#[test]
fn crop_of_a_scene_is_all_that_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let size = |options: &str| {
        let crop = "--set film.size=[16,12] --set film.crop=[2,1,10,7] --spp 1";
        let arguments = format!("render scene:sheet -o out.png {crop} {options}");
        let output = run(&folder, &arguments.split_whitespace().collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let picture = fs::read(folder.path().join("out.png")).unwrap();
        [picture[19], picture[23]]
    };
    assert_eq!(size(""), [8, 6]);
    assert_eq!(size("--cropwindow 0,0,3,2"), [3, 2]);
    // A crop is of the scene's own size.
    assert_eq!(size("--size 5x4"), [5, 4]);
}

#[test]
fn summary_tells_the_crop() {
    let folder = tempfile::tempdir().unwrap();
    let summary = |arguments: &str| {
        let output = run(&folder, &arguments.split_whitespace().collect::<Vec<_>>());
        String::from_utf8(output.stderr).unwrap().lines().last().unwrap().to_owned()
    };
    let scene = "render scene:sheet -o out.png --size 16x12 --spp 1";
    let told = summary(&format!("{scene} --cropwindow 2,1,10,7"));
    assert!(told.starts_with("out.png: 16 x 12 pixels, crop 2,1,10,7, 1 spp, "), "{told}");
    for whole in [scene.to_owned(), format!("{scene} --cropwindow 0,0,16,12")] {
        let told = summary(&whole);
        assert!(told.starts_with("out.png: 16 x 12 pixels, 1 spp, "), "{told}");
    }
    let cloth = "swatch preset:denim -o out.png --size 16x12 --spp 1 --cropwindow 2,1,10,7";
    let told = summary(cloth);
    assert!(told.contains(" mm, crop 2,1,10,7, 1 spp, "), "{told}");
}

#[test]
fn what_is_wrong_with_a_scene_is_told_to_the_letter() {
    let folder = fixtures().join("invalid/scenes");
    let bless = env::var_os("BLESS").is_some();
    let paths = scenes(&folder);
    assert!(paths.len() >= 80, "{}", paths.len());
    for path in paths {
        let name = path.file_name().unwrap().to_str().unwrap();
        let message = refusal(&["render", path.to_str().unwrap(), "-o", "out.png"], 1);
        // As if it were called where the file is; no separator but `/` is in a message.
        let inside = format!("{}{}", folder.to_str().unwrap(), std::path::MAIN_SEPARATOR);
        let message = message.replace(&inside, "");
        assert_eq!(message.lines().count(), 1, "{name}: {message}");
        let expected = path.with_extension("txt");
        if bless {
            fs::write(&expected, format!("{message}\n")).unwrap();
        }
        let expected = fs::read_to_string(&expected).unwrap();
        assert_eq!(message, expected.trim_end(), "{name}");
    }
}

/// Groups that would be 4³⁰ balls, 2⁶⁰ looks into an empty group, or 10⁸ triangles.
#[cfg(target_os = "linux")]
#[test]
fn explosions_are_refused_in_little_memory() {
    for name in ["group-explosion", "group-explosion-empty", "group-triangles"] {
        let path = fixtures().join(format!("invalid/scenes/{name}.json"));
        let folder = tempfile::tempdir().unwrap();
        // Not in 1 GB of addresses, of which stacks of threads and the program take their part.
        let script = "ulimit -v 1000000; exec \"$0\" render \"$1\" -o out.png --threads 1";
        let output = Command::new("sh")
            .current_dir(&folder)
            .args(["-c", script, env!("CARGO_BIN_EXE_selvedge"), path.to_str().unwrap()])
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{name}: {stderr}");
        assert!(stderr.contains(": found more than "), "{name}: {stderr}");
    }
}

#[test]
fn options_that_do_not_fit_are_told() {
    let fixture = |name: &str| fixtures().join(name).to_str().unwrap().to_owned();
    let (sheet, studio) = (fixture("scenes/sheet.json"), fixture("scenes/studio.json"));
    let (draft, fabric) = (fixture("drafts/plain.wif"), fixture("fabrics/denim.json"));
    let tiles = fixture("scenes/tiles.png");
    let check = |arguments: &[&str], expected: &str| {
        let arguments = [&["render"], arguments, &["-o", "out.png"]].concat();
        assert_eq!(refusal(&arguments, 1), expected, "{arguments:?}");
    };
    check(
        &[&sheet, "--cloth", "missing.wif"],
        &format!("{sheet}: --cloth: missing.wif: no such file"),
    );
    check(
        &[&sheet, "--cloth", &studio],
        &format!("{sheet}: --cloth: {studio}: found a scene, expected a draft or a fabric"),
    );
    check(
        &[&sheet, "--cloth", &tiles],
        &format!(
            "{sheet}: --cloth: {tiles}: file: byte 8 is zero, expected the text of a draft\n       \
             = not-text"
        ),
    );
    check(
        &[&draft, "--cloth", &fabric],
        &format!("{draft}: found a cloth, expected a scene, in which --cloth is woven"),
    );
    check(
        &[&fabric, "--set", "depth=2"],
        &format!("{fabric}: found a cloth, expected a scene, of which --set sets parts"),
    );
    for (setting, expected) in [
        ("depth=0", "depth: found 0, expected 1 to 256"),
        ("depht=2", "unknown key \"depht\", expected \"depth\""),
        ("lights.2.constant.radiance=2", "found \"2\", expected a number below 2"),
        ("lights.x=2", "found \"x\", expected a number below 2"),
        ("camera.fov_deg.x=2", "found \"x\" in a value without parts, expected the end"),
        (
            "camera..fov_deg=2",
            "unknown key \"\", expected one of position, target, up, fov_deg, aperture, focus",
        ),
        ("camera=", "found string \"\", expected an object"),
        ("film.size=[1e9,1e9]", "found number 1000000000.0, expected a whole number, 0 or greater"),
        ("objects.0.material=clot", "objects[0].material: found \"clot\", expected \"cloth\""),
        ("materials.cloth.diffuse.reflectance=1", "found a second key, expected one alone"),
    ] {
        let path = setting.split_once('=').unwrap().0;
        check(&[&sheet, "--set", setting], &format!("--set {path}: {expected}"));
    }
    for (arguments, expected) in [
        (["--depth", "0"], "invalid value '0' for '--depth <N>': 0 is not in 1..=256"),
        (
            ["--set", "depth"],
            "invalid value 'depth' for '--set <PATH=VALUE>': expected PATH=VALUE, as in \
             film.size=[640,480]",
        ),
    ] {
        let message = refusal(&[&["render", &sheet, "-o", "out.png"], &arguments[..]].concat(), 2);
        assert_eq!(message, format!("{expected}\n\nFor more information, try '--help'."));
    }
    let message = refusal(&["swatch", &sheet, "-o", "out.png"], 1);
    assert_eq!(message, format!("{sheet}: found a scene, expected a draft or a fabric"));
}

/// Text of a scene, damaged in a few places.
fn mutated() -> impl Strategy<Value = Vec<u8>> {
    const TOKENS: [&str; 24] = [
        "0",
        "-1",
        "1e39",
        "1e999",
        "1e-50",
        "null",
        "true",
        "\"\"",
        "\"sheet\"",
        "[]",
        "{}",
        "[",
        "]",
        "{",
        "}",
        ",",
        ":",
        "\\n",
        "\\u0000",
        "\"group\"",
        "4294967296",
        "\"display\"",
        "#",
        "\u{e9}",
    ];
    let texts: Vec<_> = ["sheet.json", "studio.json"]
        .map(|name| fs::read(fixtures().join("scenes").join(name)).unwrap())
        .into();
    let edit = (any::<prop::sample::Index>(), any::<u8>(), 0..6_usize);
    (prop::sample::select(texts), prop::collection::vec(edit, 1..5)).prop_map(
        |(mut text, edits)| {
            for (place, byte, what) in edits {
                let place = place.index(text.len().max(1));
                match what {
                    _ if text.is_empty() => text.push(byte),
                    0 => text[place] = byte,
                    1 => text[place] = b'0' + byte % 10,
                    2 => text.insert(place, b"0123456789-./eE\n \"[]{},:"[byte as usize % 24]),
                    3 => {
                        // What is between two marks gives way to something else.
                        let is_mark = |byte: &u8| b" ,:[]{}\n".contains(byte);
                        let end = text[place..]
                            .iter()
                            .position(is_mark)
                            .map_or(text.len(), |n| place + n);
                        let start = text[..place].iter().rposition(is_mark).map_or(0, |n| n + 1);
                        text.splice(start..end, TOKENS[byte as usize % TOKENS.len()].bytes());
                    }
                    4 => {
                        let end = (place + byte as usize).min(text.len());
                        let copy = text[place..end].to_vec();
                        text.splice(place..place, copy);
                    }
                    _ => {
                        let end = (place + byte as usize / 8).min(text.len());
                        text.drain(place..end);
                    }
                }
            }
            text
        },
    )
}

fn cases() -> u32 {
    env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(2_000)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever comes of damaged text, it is a scene of numbers that mean something or one line.
    #[test]
    fn damaged_text_does_no_harm(text in mutated()) {
        match file::parse(&text) {
            Ok(file) => prop_assert_eq!(file.check(), Ok(())),
            Err(message) => {
                prop_assert!(message.contains("expected"), "{}", message);
                prop_assert!(!message.contains(char::is_control), "{:?}", message);
                // In words of JSON, not of Rust.
                let is_clean = !["struct", "f32", "f64", "u32", "u64", "a sequence", "an array", "enum"]
                    .iter()
                    .any(|word| message.contains(&format!("expected {word}")));
                prop_assert!(is_clean, "{}", message);
            }
        }
    }
}
