//! Maps that tile, and materials that other programs accept.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use clap::Parser;
use glam::Vec3;
use selvedge_cli::{
    Outcome,
    args::Arguments,
    bake::{
        Tile,
        fit::Fits,
        maps::{Map, Maps},
        u3m,
    },
    fabric,
    image::{self, Samples, Value},
    render::film::Size,
};
use selvedge_yarn_brdf::Noise;
use serde_json::Value as Json;

fn tile(name: &str, repeats: u32, size: u32) -> Tile {
    let source = fabric::read(format!("preset:{name}").as_ref()).unwrap();
    let drawdown = source.draft().drawdown().unwrap();
    let mut cloth = source.cloth(&drawdown).unwrap();
    cloth.yarns.iter_mut().for_each(|yarn| yarn.noise = Noise::default());
    Tile::new(cloth, [repeats; 2], Size::new(size, size).unwrap()).unwrap()
}

/// Bakes into `folder`, which is made anew.
fn bake(folder: &Path, cloth: &str, more: &[&str]) -> anyhow::Result<Outcome> {
    let output = folder.display().to_string();
    let words = ["selvedge", "bake", cloth, "-q", "-o", &output];
    selvedge_cli::run(&Arguments::try_parse_from(words.iter().chain(more)).unwrap())
}

fn fresh(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bake").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.parent().unwrap()).unwrap();
    folder
}

#[test]
fn maps_tile_without_a_seam() {
    for name in ["silk-charmeuse", "cotton-twill", "cotton-gauze"] {
        let (one, two) = (tile(name, 1, 40), tile(name, 2, 80));
        let fits = Fits::new(&one);
        let (single, double) = (Maps::new(&one, &fits, 2), Maps::new(&two, &fits, 2));
        for map in Map::ALL {
            let at = |maps: &Maps, x: usize, y: usize| {
                Vec3::from_slice(&maps.value(map, &maps.texels[y * maps.width + x])[..3])
            };
            // The second repeat is the first once more.
            let differs = |&[x, y]: &[usize; 2]| {
                (at(&double, x, y) - at(&single, x % 40, y % 40)).abs().max_element() > 2e-3
            };
            let places = (0..80 * 80).map(|k| [k % 80, k / 80]);
            let wrong = places.filter(differs).count();
            // Some points lie on an edge to the last bit.
            assert!(wrong <= 80, "{name}, {map:?}: {wrong} texels of 6400");
            // From the last column to the first is no further than between some columns within.
            let step = |x: usize| -> f32 {
                (0..40).map(|y| (at(&single, x, y) - at(&single, (x + 1) % 40, y)).length()).sum()
            };
            let within = (0..39).map(step).fold(0.0, f32::max);
            assert!(
                step(39) <= 1.05 * within + 1e-3,
                "{name}, {map:?}: {} over {within}",
                step(39)
            );
        }
    }
}

#[test]
fn what_does_not_tile_is_left_out() {
    let source = fabric::read("preset:cotton-twill".as_ref()).unwrap();
    let cloth = source.cloth(&source.draft().drawdown().unwrap()).unwrap();
    assert!(cloth.yarns[0].noise.width > 0.0 && cloth.yarns[0].noise.color > 0.0);
    let color = cloth.yarns[0].noise.color;
    let tile = Tile::new(cloth, [1, 1], Size::new(8, 8).unwrap()).unwrap();
    assert!(tile.is_evened);
    assert_eq!((tile.cloth.yarns[0].noise.width, tile.cloth.yarns[0].noise.color), (0.0, color));
}

#[test]
fn normals_are_unit_and_gaps_are_open() {
    let gauze = tile("cotton-gauze", 1, 48);
    let fits = Fits::new(&gauze);
    let maps = Maps::new(&gauze, &fits, 3);
    for texel in &maps.texels {
        assert!((texel.normal.length() - 1.0).abs() < 1e-5 && texel.normal.z > 0.0, "{texel:?}");
        assert!((0.0..=1.0).contains(&texel.opacity), "{texel:?}");
        assert_eq!(texel.coverage == 0.0, texel.opacity == 0.0, "{texel:?}");
    }
    let open = maps.texels.iter().filter(|texel| texel.opacity == 0.0).count();
    let mean = maps.mean.opacity;
    let expected = gauze.shader.far_opacity(&selvedge_yarn_brdf::Footprint::default());
    assert!(open > 100, "{open} texels of gaps");
    assert!((mean - expected).abs() < 0.02, "opacity {mean}, far field {expected}");

    let satin = tile("silk-charmeuse", 1, 24);
    let maps = Maps::new(&satin, &Fits::new(&satin), 1);
    assert!(maps.texels.iter().all(|texel| texel.opacity == 1.0));
}

#[test]
fn fitted_material_is_about_as_bright_as_the_cloth() {
    for name in ["silk-charmeuse", "wool-gabardine", "cotton-gauze"] {
        let fits = Fits::new(&tile(name, 1, 8));
        let far = fits.far;
        assert!((0.8..1.25).contains(&far.brightness), "{name}: {far:?}");
        assert!(far.relative < 0.6 && far.relative_with_sheen <= far.relative, "{name}: {far:?}");
        for class in &fits.classes {
            let fit = class.fit;
            assert!(fit.specular_error < 1.0 && fit.diffuse_error < 1.0, "{name}: {class:?}");
        }
        let shares: f32 = fits.classes.iter().map(|class| class.share).sum();
        assert!(shares <= 1.0 + 1e-4 && shares > 0.5, "{name}: {shares}");
    }
}

#[test]
fn files_say_how_large_they_are_and_refer_to_each_other() {
    let folder = fresh("files");
    bake(&folder, "preset:silk-charmeuse", &["--size", "32x16", "--repeats", "2x1"]).unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(
        fs::File::open(folder.join("height.png")).unwrap(),
    ));
    let reader = decoder.read_info().unwrap();
    let info = reader.info();
    assert_eq!((info.width, info.height, info.bit_depth), (32, 16, png::BitDepth::Sixteen));
    // 2 × 0.5 mm and 1 mm.
    let dims = info.pixel_dims.unwrap();
    assert_eq!((dims.xppu, dims.yppu, dims.unit), (32_000, 16_000, png::Unit::Meter));
    let text = |name: &str| -> f64 {
        let chunks = &info.uncompressed_latin1_text;
        chunks.iter().find(|chunk| chunk.keyword == name).unwrap().text.parse().unwrap()
    };
    assert!((text("width_mm") - 1.0).abs() < 1e-9 && (text("height_mm") - 1.0).abs() < 1e-9);
    assert!(text("black_mm") < text("white_mm"));

    let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let mut named = Vec::new();
    for text in ["cloth.mtlx", "cloth.gltf", "cloth.u3m", "bake.json"].map(read) {
        let words = text.split('"').filter(|word| word.ends_with(".png") || word.ends_with(".bin"));
        named.extend(words.map(str::to_owned).collect::<Vec<_>>());
    }
    assert!(named.len() > 20, "{named:?}");
    for name in named {
        assert!(folder.join(&name).is_file(), "{name}");
    }
    let report: Json = serde_json::from_str(&read("bake.json")).unwrap();
    assert_eq!(report["threads"], serde_json::json!([10, 5]));
    assert!(report["fits"]["far"]["relative"].as_f64().unwrap() > 0.0, "{report}");

    // What it has written itself it replaces, but nothing else.
    bake(&folder, "preset:silk-charmeuse", &["--size", "8"]).unwrap();
    fs::write(folder.join("notes.txt"), "mine").unwrap();
    let error = bake(&folder, "preset:silk-charmeuse", &["--size", "8"]).unwrap_err();
    assert!(error.to_string().contains("notes.txt"), "{error}");
}

#[test]
fn exr_maps_hold_the_same_as_png() {
    let folder = fresh("exr");
    fs::create_dir(&folder).unwrap();
    bake(&folder, "preset:wool-gabardine", &["--size", "16", "--format", "exr"]).unwrap();
    let read = |name: &str| image::read(&folder.join(name)).unwrap();
    let (exr, png) = (read("base_color.exr"), read("base_color.png"));
    for (a, b) in exr.to_colors().into_iter().zip(png.to_colors()) {
        assert!((a - b).abs().max_element() < 5e-3, "{a} {b}");
    }
    let width = exr.metadata.iter().find(|(name, _)| name == "width_mm");
    assert!(matches!(width, Some((_, Value::Real(mm))) if (mm - 0.831).abs() < 0.01), "{width:?}");
    let layer = read("yarn_id.exr");
    let Samples::F32(ids) = &layer.layers()[0].channels[0].samples else { panic!("{layer:?}") };
    assert!(ids.iter().all(|id| id.fract() == 0.0 && *id >= 1.0), "{ids:?}");
}

#[test]
fn what_fails_leaves_no_folder() {
    let folder = fresh("fails");
    fs::create_dir(&folder).unwrap();
    assert!(bake(&folder.join("maps"), "no such file", &[]).is_err());
    let left = fs::read_dir(&folder).unwrap().count();
    assert_eq!(left, 0, "something is left in {}", folder.display());
    let error = bake(&fresh("no").join("such/folder"), "preset:denim", &[]).unwrap_err();
    assert!(error.to_string().contains("found no folder"), "{error}");
}

#[test]
fn weaves_have_the_names_of_u3m() {
    for (name, expected) in [
        ("cotton-gauze", "Plain weave"),
        ("wool-gabardine", "Twill - right hand (Z)"),
        ("silk-charmeuse", "Satin"),
        ("herringbone-tweed", "Dobby"),
        ("jacquard-damask", "Jacquard"),
    ] {
        let source = fabric::read(format!("preset:{name}").as_ref()).unwrap();
        assert_eq!(u3m::construction(&source.draft().drawdown().unwrap()), expected, "{name}");
    }
}

/// What the command prints, if it ends well.
fn output(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    out.into_owned()
}

/// Prints whether a document is valid, and makes a shader of it.
const MATERIALX: &str = "
import sys, MaterialX as mx
from MaterialX import PyMaterialXGenShader as shader, PyMaterialXGenGlsl as glsl
document = mx.createDocument()
mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), document)
mx.readFromXmlFile(document, sys.argv[1])
valid, message = document.validate()
generator = glsl.GlslShaderGenerator.create()
context = shader.GenContext(generator)
context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
made = generator.generate('cloth', document.getMaterialNodes()[0], context)
print(valid, message, len(made.getSourceCode('pixel')) > 1000)
";

/// Prints the errors of a scene.
const GLTF: &str = "
const fs = require('fs'), path = require('path'), scene = process.argv[1];
const read = name => new Uint8Array(fs.readFileSync(name));
const beside = name => Promise.resolve(read(path.join(path.dirname(scene), name)));
require('gltf-validator').validateBytes(read(scene), { externalResourceFunction: beside })
  .then(found => console.log(found.issues.numErrors,
    found.issues.messages.filter(message => message.severity === 0)));
";

/// With `SELVEDGE_HOST_TESTS=1`: MaterialX from the Python registry and the validator of glTF from that of
/// Node; and the JSON Schema of U3M 1.1, where `SELVEDGE_U3M_SCHEMA` names its file (`u3m_schema.json` of
/// its authors).
#[test]
fn other_programs_accept_the_materials() {
    if env::var_os("SELVEDGE_HOST_TESTS").is_none() {
        eprintln!("skipped: SELVEDGE_HOST_TESTS is not set");
        return;
    }
    let tools = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bake-tools");
    fs::create_dir_all(&tools).unwrap();
    output(Command::new("python3").args(["-m", "venv"]).arg(&tools));
    let python = tools.join("bin/python");
    output(Command::new(&python).args(["-m", "pip", "install", "--quiet", "MaterialX"]));
    output(Command::new("npm").args(["install", "--silent", "gltf-validator"]).current_dir(&tools));
    let schema = env::var_os("SELVEDGE_U3M_SCHEMA").map(|path| {
        let schema = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
        jsonschema::draft7::new(&schema).unwrap()
    });
    if schema.is_none() {
        eprintln!("skipped the schema of U3M: SELVEDGE_U3M_SCHEMA is not set");
    }
    for (name, format) in [("cotton-gauze", "png"), ("denim", "png16"), ("silk-charmeuse", "exr")] {
        let folder = fresh(&format!("hosts-{name}"));
        bake(&folder, &format!("preset:{name}"), &["--size", "64", "--format", format]).unwrap();
        let document = folder.join("cloth.mtlx");
        let valid = output(Command::new(&python).args(["-c", MATERIALX]).arg(document));
        assert_eq!(valid.trim(), "True  True", "{name}");
        let scene = folder.join("cloth.gltf");
        let errors = output(Command::new("node").current_dir(&tools).args(["-e", GLTF]).arg(scene));
        assert_eq!(errors.trim(), "0 []", "{name}");
        if let Some(schema) = &schema {
            let text = fs::read(folder.join("cloth.u3m")).unwrap();
            let material = serde_json::from_slice(&text).unwrap();
            let errors: Vec<_> = schema.iter_errors(&material).map(|e| e.to_string()).collect();
            assert!(errors.is_empty(), "{name}: {errors:?}");
        }
    }
}
