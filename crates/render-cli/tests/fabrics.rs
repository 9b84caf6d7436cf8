//! The fabrics of the repository make sound cloths, and a fabric is read wherever it is named from.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use glam::{DVec2, Vec3};
use selvedge_cli::{
    fabric,
    image::{self, Value},
};
use serde_json::json;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

fn fabrics() -> Vec<PathBuf> {
    let entries = fs::read_dir(fixtures().join("fabrics")).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// The cloth shows the ground through its gaps.
const OPEN: [&str; 1] = ["cotton-gauze.json"];

#[test]
fn every_fabric_is_a_sound_cloth() {
    let paths = fabrics();
    assert!(paths.len() >= 13, "{paths:?}");
    for path in paths {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let source = fabric::read(&path).unwrap();
        assert_eq!(source.draft().warnings().next(), None, "{name}");
        let drawdown = source.draft().drawdown().unwrap();
        let cloth = source.cloth(&drawdown).unwrap();
        let shader = source.shader(&cloth).unwrap();
        assert_eq!(source.warnings(&drawdown, &shader), [""; 0], "{name}");

        // Over the repeat, seen from above under a light from the side.
        let size = cloth.size();
        let (light, eye) = (Vec3::new(0.48, 0.36, 0.8), Vec3::Z);
        let (n, mut covered, mut sum) = (64, 0, Vec3::ZERO);
        for k in 0..n * n {
            let uv = size * DVec2::new((k % n) as f64 + 0.37, (k / n) as f64 + 0.61) / n as f64;
            covered += u32::from(shader.opacity(uv) > 0.0);
            let f = shader.eval(uv, light, eye);
            assert!(f.is_finite() && f.min_element() >= 0.0, "{name}: {f} at {uv}");
            sum += f;
        }
        let covered = f64::from(covered) / f64::from(n * n);
        let expected = if OPEN.contains(&&*name) { 0.3..=0.7 } else { 0.9..=1.0 };
        assert!(expected.contains(&covered), "{name}: covers {covered}, expected {expected:?}");
        let mean = sum / (n * n) as f32 * std::f32::consts::PI;
        assert!((0.01..1.0).contains(&mean.max_element()), "{name}: reflects {mean}");
    }
}

#[test]
fn every_fabric_has_a_row_in_the_table() {
    let table = fs::read_to_string(fixtures().join("README.md")).unwrap();
    for path in fabrics() {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        assert!(table.contains(&format!("| `{name}` |")), "{name} has no row");
    }
}

const DRAFT: &str = "[WIF]\nVersion=1.1\n[CONTENTS]\nWeaving=1\nWarp=1\nWeft=1\nThreading=1\n\
    Liftplan=1\n[WEAVING]\nShafts=2\nTreadles=0\nRising Shed=1\n[WARP]\nThreads=2\n[WEFT]\n\
    Threads=2\n[THREADING]\n1=1\n2=2\n[LIFTPLAN]\n1=1\n2=2\n";

/// Renders `cloth` in a folder with `drafts/plain.wif` and `fabrics/a.json`.
fn render(fabric: &str, cloth: &str) -> (Output, Option<Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    for name in ["drafts", "fabrics"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("drafts/plain.wif"), DRAFT).unwrap();
    fs::write(folder.path().join("fabrics/a.json"), fabric).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .current_dir(folder.path())
        .args(["swatch", cloth, "-o", "out.png", "--size", "30x20", "--spp", "1", "--mm", "3"])
        .output()
        .unwrap();
    (output, fs::read(folder.path().join("out.png")).ok())
}

fn picture(fabric: &str, cloth: &str) -> Vec<u8> {
    let (output, picture) = render(fabric, cloth);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    picture.unwrap()
}

#[test]
fn fabric_of_nothing_but_a_draft_is_that_draft() {
    let fabric = r#"{"version": 1, "draft": "../drafts/plain.wif"}"#;
    let bare = picture(fabric, "drafts/plain.wif");
    assert!(picture(fabric, "fabrics/a.json") == bare);
    let inline = json!({"version": 1, "draft": {"wif": DRAFT}}).to_string();
    assert!(picture(&inline, "fabrics/a.json") == bare);
    let twisted = fabric.replace('}', r#", "yarn": {"psi": -0.7}}"#);
    assert!(picture(&twisted, "fabrics/a.json") != bare);
}

#[test]
fn what_is_wrong_with_a_fabric_is_told_in_one_line() {
    let with = |text: &str| format!("{{\"version\": 1, \"draft\": \"../drafts/plain.wif\"{text}}}");
    let cases = [
        (
            with(",\n\"yarns\": {}"),
            "fabrics/a.json: line 2, column 7: unknown key \"yarns\", expected \"yarn\"",
        ),
        (
            with(", \"yarn\": {\"psi\": 3}"),
            "fabrics/a.json: yarn: psi: 3, expected -1.5707963267948966 to 1.5707963267948966",
        ),
        (
            with(", \"overrides\": [{\"yarn\": {\"rho\": 0.1}}]"),
            "fabrics/a.json: override 1: rho: found a yarn with another kind of phase, \
             expected wrapped_cauchy",
        ),
        (
            with("").replace("plain", "plane"),
            "fabrics/a.json: draft: fabrics/../drafts/plane.wif: no such file",
        ),
        (
            with("").replace("1,", "2,"),
            "fabrics/a.json: line 1, column 13: found version 2, expected 1",
        ),
        (
            "{\"version\": 1, \"draft\": {\"wif\": \"\"}}".to_owned(),
            "fabrics/a.json: draft: file: nothing in it, expected the sections of a draft\n       \
             = empty-file",
        ),
    ];
    for (fabric, message) in cases {
        let (output, picture) = render(&fabric, "fabrics/a.json");
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(stderr.trim_end(), format!("error: {message}"), "{fabric}");
        assert_eq!((output.status.code(), picture), (Some(1), None), "{fabric}");
    }
}

#[test]
fn overrides_in_vain_are_warned_of() {
    let fabric = r#"{"version": 1, "draft": "../drafts/plain.wif", "overrides": [{"color": 9}]}"#;
    let (output, _) = render(fabric, "fabrics/a.json");
    let stderr = String::from_utf8(output.stderr).unwrap();
    let expected = "warning: fabrics/a.json: override 1: found no such threads in the draft";
    assert!(stderr.lines().any(|line| line == expected), "{stderr}");
}

/// What a picture of this scene or cloth says of itself.
fn metadata(what: &Path) -> Vec<(String, Value)> {
    let folder = tempfile::tempdir().unwrap();
    let status = Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .current_dir(folder.path())
        .arg("render")
        .arg(what)
        .args(["-q", "-o", "out.exr", "--size", "6x4", "--spp", "2", "--seed", "7"])
        .status();
    assert!(status.unwrap().success(), "{}", what.display());
    image::read(&folder.path().join("out.exr")).unwrap().metadata
}

#[test]
fn picture_tells_its_fabric_and_how_it_was_made() {
    let of_preset = metadata("preset:denim".as_ref());
    let find = |metadata: &[(String, Value)], name: &str| {
        let found = metadata.iter().find(|(known, _)| known == name);
        found.unwrap_or_else(|| panic!("no {name:?} in {metadata:?}")).1.clone()
    };
    assert_eq!(find(&of_preset, "seed"), "7".into());
    assert_eq!(find(&of_preset, "spp"), Value::Real(2.0));
    let hash = fabric::read("preset:denim".as_ref()).unwrap().hash().unwrap();
    let name = "fabric 0, FNV-1a 64";
    assert_eq!(find(&of_preset, name), Value::Text(format!("{hash:016x}")));
    assert!(
        matches!(find(&of_preset, "normalization 0"), Value::List(factors) if !factors.is_empty())
    );
    // The scene is woven of it.
    let of_scene = metadata("scene:sheet".as_ref());
    assert_eq!(find(&of_scene, name), find(&of_preset, name));
    // The file that is compiled in.
    let of_file = metadata(&fixtures().join("fabrics/denim.json"));
    assert_eq!(of_file, of_preset);
}

#[test]
fn hash_is_that_of_what_is_woven() {
    let folder = tempfile::tempdir().unwrap();
    let hash = |draft: &str, fabric: &str| {
        let path = folder.path().join("a.json");
        let json = format!("{{\"version\": 1, \"draft\": {}{fabric}}}", json!({ "wif": draft }));
        fs::write(&path, json).unwrap();
        fabric::read(&path).unwrap().hash().unwrap()
    };
    let base = hash(DRAFT, "");
    assert_eq!(hash(&DRAFT.replace('\n', "\r\n"), ",  \"seed\": 0"), base, "the same, otherwise");
    let other = DRAFT.replace("[LIFTPLAN]\n1=1\n2=2", "[LIFTPLAN]\n1=2\n2=1");
    let changed = [hash(&other, ""), hash(DRAFT, ", \"seed\": 1")];
    assert!(changed.iter().all(|hash| *hash != base) && changed[0] != changed[1], "{changed:?}");
    // What is published is to stay.
    assert_eq!(base, 0x10cc_408a_8b00_b979, "{base:#018x}");
}
