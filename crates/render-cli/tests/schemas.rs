//! The JSON Schemas take what is read and refuse what is not, as far as they can tell.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use jsonschema::Validator;
use selvedge_cli::{fabric, scene::file};
use selvedge_yarn_brdf::{Fabric, Thread, Weave};
use serde_json::{Value, json};

fn manifest() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The JSON files of a folder of the fixtures, in the order of their names.
fn files(folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(manifest().join("../../fixtures").join(folder)).unwrap();
    let mut paths: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "{folder}");
    paths
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn scenes() -> Validator {
    jsonschema::draft202012::new(file::schema().as_value()).unwrap()
}

fn fabrics() -> Validator {
    jsonschema::draft202012::new(fabric::schema().as_value()).unwrap()
}

#[test]
fn committed_copies_are_what_the_program_prints() {
    for name in ["scene", "fabric"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_selvedge"));
        let output = command.args(["schema", name]).output().unwrap();
        assert_eq!((output.status.code(), &*output.stderr), (Some(0), &b""[..]), "{name}");
        let printed = String::from_utf8(output.stdout).unwrap();
        let path = manifest().join(format!("docs/{name}.schema.json"));
        if env::var_os("BLESS").is_some() {
            fs::write(&path, &printed).unwrap();
        }
        let committed = fs::read_to_string(&path).unwrap();
        assert!(printed == committed, "{name}: other than {}", path.display());
        jsonschema::meta::validate(&read(&path)).unwrap();
    }
}

#[test]
fn fixtures_are_valid() {
    for (folder, schema) in [("scenes", scenes()), ("fabrics", fabrics())] {
        for path in files(folder) {
            if let Err(error) = schema.validate(&read(&path)) {
                panic!("{}: {}: {error}", path.display(), error.instance_path());
            }
        }
    }
}

#[test]
fn broken_scenes_are_invalid_where_that_can_be_seen() {
    let schema = scenes();
    let mut seen = 0;
    for path in files("invalid/scenes") {
        let text = fs::read(&path).unwrap();
        let (Ok(value), Err(message)) = (serde_json::from_slice(&text), file::parse(&text)) else {
            continue;
        };
        if is_visible(&message) {
            assert!(!schema.is_valid(&value), "{}: {message}", path.display());
            seen += 1;
        }
    }
    assert!(seen >= 40, "{seen}");
}

/// Whether a scene is refused for a key, a type or a range. Keys that are given twice are so no more
/// in what JSON is parsed to.
fn is_visible(message: &str) -> bool {
    let is_of_place = message.starts_with("line ") && !message.contains(" a second time");
    let expected = message.rsplit_once("expected ").map_or("", |(_, expected)| expected);
    let expected = expected.strip_prefix("numbers from ").unwrap_or(expected);
    let expected = expected.strip_prefix("lengths from ").unwrap_or(expected);
    let is_of_range = expected
        .split_once(" to ")
        .is_some_and(|(low, high)| low.parse::<f64>().is_ok() && high.parse::<f64>().is_ok());
    is_of_place || is_of_range
}

/// A scene that says all that one can.
fn full_scene() -> Value {
    let place = json!({"scale": 2, "rotate_deg": [1, 2, 3], "translate": [0, 0, 1]});
    json!({
        "version": 1,
        "camera": {
            "position": [0, -1, 1], "target": [0, 0, 0], "up": [0, 0, 1], "fov_deg": 40,
            "aperture": 0.01, "focus": 2
        },
        "film": {"size": [64, 48], "crop": [1, 2, 30, 40], "filter": "box"},
        "depth": 3,
        "materials": {
            "a": {"cloth": {"fabric": "preset:denim"}},
            "b": {"diffuse": {"reflectance": [0.1, 0.2, 0.3]}},
            "c": {"standard": {
                "base_color": "#ff8040", "normal": "n.png", "roughness": 0.5, "specular": [0, 0.5, 1],
                "anisotropy": 0.5, "anisotropy_map": "a.png", "size": [2, 3]
            }}
        },
        "groups": {"g": [{"shape": {"sheet": {}}, "material": "a"}]},
        "objects": [
            {"shape": {"file": {"path": "a.obj"}}, "material": "b", "place": place, "uv_scale": 2},
            {"shape": {"plane": {"width": 1, "height": 2}}, "material": "a"},
            {"shape": {"sphere": {"radius": 1}}, "material": "c"},
            {"shape": {"cylinder": {"radius": 1, "height": 2}}, "material": "c"},
            {"shape": {"drape": {"side": 1}}, "material": "a"},
            {"shape": {"group": {"name": "g"}}}
        ],
        "lights": [
            {"quad": {"centre": [0, 0, 2], "toward": [0, 0, 0], "size": [1, 2], "radiance": 3}},
            {"sphere": {"centre": [0, 0, 2], "radius": 0.5, "radiance": [1, 2, 3]}},
            {"distant": {"from": [1, 1, 1], "irradiance": "#ffffff", "angle_deg": 1}},
            {"constant": {"radiance": 1}},
            {"environment": {"path": "sky.exr", "rotation_deg": 10, "scale": 2}}
        ]
    })
}

/// A fabric, without the head of its file, that says all that one can.
fn full_fabric() -> Value {
    let noise = json!({
        "intensity": 0.1, "fineness": 2, "u_max": 0.1, "width": 0.1, "offset": 0.1,
        "wavelength": 0.01, "slub_rate": 1, "slub_length": 0.01, "slub_height": 1, "color": 0.1
    });
    json!({
        "yarn": {
            "color": [0.1, 0.2, 0.3], "specular": 0.4, "specular_uniform": "#808080",
            "diffuse": "yarn_normal", "highlight": {"window": {"delta": 0.5}},
            "phase": {"von_mises": {"alpha": 0.1, "beta": 3}}, "noise": noise, "tint": 0.5,
            "opacity": 0.9, "u_max": 0.4, "psi": -0.3, "kappa": 0.2, "smoothing": 0.1, "size": 0.9
        },
        "overrides": [
            {"warp": true, "color": 3, "threads": [1, 8], "yarn": {
                "highlight": {"rough": {"sigma": 0.2}},
                "phase": {"wrapped_cauchy": {"rho": 0.6, "backward": true}}
            }},
            {"yarn": {"phase": {"von_mises_3d": {"alpha": 0.1, "beta": 3}}}},
            {"yarn": {"phase": {"tabulated": [0.5, 1, 2]}}}
        ],
        "mapping": "arcsine", "normalization": "none", "combination": "lerp", "steep": "reject",
        "rotation": 0.5, "scale": 2, "seed": 7
    })
}

/// `value` with one change, in every place of it: another number, another type, a key less, a key
/// more.
fn changes(value: &Value) -> Vec<Value> {
    let mut others = vec![json!(null), json!(true), json!("text"), json!({})];
    // Serde takes a list of what belongs to an object, in the order of its fields, for the object.
    if !value.is_object() {
        others.extend([json!([]), json!([1])]);
    }
    let whole = [-1_100_000_000, -11_000_000, -2, -1, 0, 1, 2, 4, 65, 171, 257, 1001, 1_100_000];
    others.extend(whole.map(|number| json!(number)));
    others.extend([1_100_000_000, 67_108_865].map(|number: u32| json!(number)));
    others.extend([-1.6, -0.1, 5e-7, 1e-6, 5e-4, 2e-3, 0.55, 0.97, 1.1, 1.55].map(|x| json!(x)));
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                let with = |value: Option<Value>| {
                    let mut map = map.clone();
                    match value {
                        Some(value) => map.insert(key.clone(), value),
                        None => map.remove(key),
                    };
                    Value::Object(map)
                };
                others.push(with(None));
                others.extend(changes(value).into_iter().map(|value| with(Some(value))));
            }
            let mut map = map.clone();
            map.insert("unknown".to_owned(), json!(1));
            others.push(Value::Object(map));
        }
        Value::Array(list) => {
            for (index, value) in list.iter().enumerate() {
                let with = |value: Value| {
                    let mut list = list.clone();
                    list[index] = value;
                    Value::Array(list)
                };
                others.extend(changes(value).into_iter().map(with));
            }
            let last = list.last().cloned();
            others.push(Value::Array(list.iter().cloned().chain(last).collect()));
            others.push(Value::Array(list.iter().skip(1).cloned().collect()));
        }
        _ => {}
    }
    others
}

#[test]
fn scenes_are_valid_if_they_are_read() {
    let schema = scenes();
    let full = full_scene();
    file::parse(full.to_string().as_bytes()).unwrap();
    let (mut read, mut refused) = (0, 0);
    for scene in changes(&full) {
        let is_valid = schema.is_valid(&scene);
        match file::parse(scene.to_string().as_bytes()) {
            Ok(_) => {
                assert!(is_valid, "refused, but read: {scene}");
                read += 1;
            }
            Err(message) if is_visible(&message) => {
                assert!(!is_valid, "valid, but {message}: {scene}");
                refused += 1;
            }
            Err(_) => {}
        }
    }
    assert!(read > 500 && refused > 2000, "{read} read, {refused} refused");
}

#[test]
fn fabrics_are_valid_if_they_make_a_cloth() {
    let schema = fabrics();
    let weave = Weave::new(2, 2, |end, pick| (end + pick) % 2 == 0).unwrap();
    let is_cloth = |fabric: &Value| {
        let fabric: Fabric = serde_json::from_value(fabric.clone()).map_err(|e| e.to_string())?;
        let threads = [Thread::default(); 2];
        let cloth = fabric.cloth(weave.clone(), &threads, &threads);
        cloth.map(|_| fabric).map_err(|error| format!("{:#}", anyhow::Error::from(error)))
    };
    let full = full_fabric();
    is_cloth(&full).unwrap();
    let (mut read, mut refused) = (0, 0);
    for fabric in changes(&full) {
        let mut file = fabric.clone();
        let Some(map) = file.as_object_mut() else { continue };
        map.insert("version".to_owned(), json!(1));
        map.insert("draft".to_owned(), json!({"wif": ""}));
        let is_valid = schema.is_valid(&file);
        match is_cloth(&fabric) {
            // Cloths of any rotation and scale can be made, but not prepared.
            Ok(fabric) if fabric.rotation.abs() > 7.0 || !(1e-6..=1e6).contains(&fabric.scale) => {
                assert!(!is_valid, "valid: {file}");
                refused += 1;
            }
            Ok(_) => {
                assert!(is_valid, "refused, but a cloth: {file}");
                read += 1;
            }
            Err(message) if is_between_parameters(&message) => {}
            Err(message) => {
                assert!(!is_valid, "valid, but {message}: {file}");
                refused += 1;
            }
        }
    }
    assert!(read > 300 && refused > 1000, "{read} read, {refused} refused");
}

/// Whether a fabric is refused for what depends on two of its parts.
fn is_between_parameters(message: &str) -> bool {
    message.contains("another kind of") || message.contains("threads")
}

#[test]
fn heads_of_fabrics_are_checked() {
    let schema = fabrics();
    for valid in [
        json!({"version": 1, "draft": "a.wif"}),
        json!({"version": 1, "draft": {"wif": "[WIF]"}, "seed": 3}),
    ] {
        assert!(schema.is_valid(&valid), "{valid}");
    }
    for invalid in [
        json!({"draft": "a.wif"}),
        json!({"version": 1}),
        json!({"version": 2, "draft": "a.wif"}),
        json!({"version": "1", "draft": "a.wif"}),
        json!({"version": 1, "draft": 3}),
        json!({"version": 1, "draft": {"wif": "", "name": ""}}),
        json!({"version": 1, "draft": "a.wif", "yarns": {}}),
    ] {
        assert!(!schema.is_valid(&invalid), "{invalid}");
    }
}
