use std::fs;

use ::image::{DynamicImage, GrayImage, ImageFormat, Luma, Rgb, RgbImage};
use proptest::{prelude::*, sample::Index};

use super::*;
use crate::fabric::{self, FabricSource};

/// A PNG of bytes that rise from left to right.
fn ramp(width: u32, height: u32) -> Vec<u8> {
    let byte = |x, _| Luma([(255 * x / (width - 1).max(1)) as u8]);
    png(&GrayImage::from_fn(width, height, byte).into())
}

fn png(image: &DynamicImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const DRAFT: &str = "[WIF]\nVersion=1.1\n[CONTENTS]\nWeaving=1\nWarp=1\nWeft=1\nThreading=1\n\
    Liftplan=1\n[WEAVING]\nShafts=2\nTreadles=0\nRising Shed=1\n[WARP]\nThreads=2\n[WEFT]\n\
    Threads=2\n[THREADING]\n1=1\n2=2\n[LIFTPLAN]\n1=1\n2=2\n";

fn with(yarn: &str) -> String {
    format!("{{\"version\": 1, \"draft\": {}, \"yarn\": {yarn}}}", json!({ "wif": DRAFT }))
}

/// The fabric of these files, of which one is `a.json`.
fn read(files: &[(&str, &[u8])]) -> Result<FabricSource, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let error = |error| chain(error).replace(&format!("{}/", folder.path().display()), "");
    fabric::read(&folder.path().join("a.json")).map_err(error)
}

fn cloth(source: &FabricSource) -> selvedge_yarn_brdf::Cloth {
    source.cloth(&source.draft().drawdown().unwrap()).unwrap()
}

const PSI: &str =
    r#"{"psi": {"image": "a.png", "mm": [10, 5], "range": [-0.5, 0.5]}, "u_max": 0.4}"#;

#[test]
fn picture_is_where_the_cloth_is_and_means_what_its_range_says() {
    let source = read(&[("a.json", with(PSI).as_bytes()), ("a.png", &ramp(256, 1))]).unwrap();
    let cloth = cloth(&source);
    assert_eq!((cloth.yarns[0].u_max, cloth.textures.len()), (0.4, cloth.yarns.len()));
    // Means of bytes are bytes.
    assert!(cloth.yarns[0].psi.abs() < 1.0 / 255.0, "the mean: {}", cloth.yarns[0].psi);
    let texture = &cloth.textures[0].texture;
    assert_eq!(texture.range(), [-0.5, 0.5]);
    for (u, expected) in [(0.5e-3, -0.4502), (5e-3, 0.0), (9.5e-3, 0.4502), (1e3 + 7.5e-3, 0.2503)]
    {
        let found = texture.value(DVec2::new(u, 0.3), 0.0)[0];
        assert!((found - expected).abs() < 1.0 / 255.0, "{found} at {u}, expected {expected}");
    }
    let wide = texture.value(DVec2::new(9.5e-3, 0.0), 1.0)[0];
    assert!(wide.abs() < 1.0 / 255.0, "{wide}, expected the mean");
    assert!(cloth.prepare().is_ok());
}

#[test]
fn range_is_that_of_the_numbers_in_the_picture() {
    let grey = png(&GrayImage::from_fn(2, 1, |x, _| Luma([51 + 102 * x as u8])).into());
    let source = read(&[("a.json", with(PSI).as_bytes()), ("a.png", &grey)]).unwrap();
    let [low, high] = cloth(&source).textures[0].texture.range();
    assert!((low + 0.3).abs() < 1e-6 && (high - 0.1).abs() < 1e-6, "{low} to {high}");
}

#[test]
fn colours_are_decoded_and_numbers_are_not() {
    let yarn = r#"{"color": {"image": "a.png", "mm": [1, 1]}, "opacity": {"image": "a.png", "mm": [1, 1], "range": [0, 1]}}"#;
    let image = png(&RgbImage::from_pixel(1, 1, Rgb([188; 3])).into());
    let source = read(&[("a.json", with(yarn).as_bytes()), ("a.png", &image)]).unwrap();
    let cloth = cloth(&source);
    assert!((cloth.yarns[0].color[1] - 0.5).abs() < 5e-3, "{:?}", cloth.yarns[0].color);
    assert!((cloth.yarns[0].opacity - 188.0 / 255.0).abs() < 1e-6, "{}", cloth.yarns[0].opacity);
    // The highlight takes the colour of the picture.
    assert_eq!(cloth.textures.len(), 3);
}

#[test]
fn what_is_written_is_what_was_read() {
    let image = ramp(3, 2);
    let overrides = PSI.replace("a.png", "b.png");
    let text = with(PSI);
    let text = format!(
        "{}, \"overrides\": [{{\"warp\": true, \"yarn\": {overrides}}}]}}",
        &text[..text.len() - 1]
    );
    let source =
        read(&[("a.json", text.as_bytes()), ("a.png", &image), ("b.png", &image)]).unwrap();
    let by_path: Value = serde_json::from_str(&source.to_json(false)).unwrap();
    assert_eq!(by_path["yarn"]["psi"]["image"], "a.png");
    assert_eq!(by_path["overrides"][0]["yarn"]["psi"]["image"], "b.png");
    let inline = source.to_json(true);
    let again = read(&[("a.json", inline.as_bytes())]).unwrap();
    assert_eq!(again.to_json(true), inline);
    assert_eq!(again.hash().unwrap(), source.hash().unwrap());
    // What comes back from elsewhere is still what it was, in its file.
    let Value::Object(inline) = serde_json::from_str(&inline).unwrap() else { panic!() };
    let back = fabric::from_json("b", inline.clone(), &source).unwrap();
    assert!(back.is_like(&source));
    assert_eq!(back.to_json(false), source.to_json(false));
    let mut moved = inline;
    moved["yarn"]["psi"]["mm"] = json!([10, 6]);
    assert!(!fabric::from_json("b", moved, &source).unwrap().is_like(&source));
    let other =
        read(&[("a.json", text.as_bytes()), ("a.png", &ramp(4, 2)), ("b.png", &image)]).unwrap();
    assert_ne!(other.hash().unwrap(), source.hash().unwrap());
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let error = |yarn: &str, image: &[u8]| {
        read(&[("a.json", with(yarn).as_bytes()), ("a.png", image)]).unwrap_err()
    };
    let good = ramp(2, 2);
    let psi = |what: &str| format!("{{\"psi\": {{{what}}}}}");
    for (yarn, expected) in [
        (
            psi(r#""image": "b.png", "mm": [1, 1], "range": [0, 1]"#),
            "a.json: yarn.psi.image: b.png: no such file",
        ),
        (
            psi(r#""image": "a.png", "mm": [1, 1], "range": [0, 3]"#),
            "a.json: yarn.psi.range: psi: 3, expected -1.5707963267948966 to 1.5707963267948966",
        ),
        (
            psi(r#""image": "a.png", "mm": [1, 0], "range": [0, 1]"#),
            "a.json: yarn.psi.mm: found 1 by 0, expected 0.1 to 100000 each",
        ),
        (
            psi(r#""image": "a.png", "mm": [1, 1]"#),
            "a.json: yarn.psi: found no \"range\", expected the numbers of black and white",
        ),
        (
            psi(r#""image": "a.png", "size": 3"#),
            "a.json: yarn.psi: unknown key \"size\", expected one of image, mm, range",
        ),
        (
            psi(r#""image": "data:image/png;base64,&", "mm": [1, 1], "range": [0, 1]"#),
            "a.json: yarn.psi.image: found data that is not in base 64, expected data that is",
        ),
        (
            psi(r#""image": "data:,", "mm": [1, 1], "range": [0, 1]"#),
            "a.json: yarn.psi.image: found data that is not in base 64, expected data that is",
        ),
        (
            r#"{"color": {"image": "a.png", "mm": [1, 1], "range": [0, 1]}}"#.to_owned(),
            "a.json: yarn.color.range: found one, expected none for a colour",
        ),
    ] {
        assert_eq!(error(&yarn, &good), expected, "{yarn}");
    }
    // Where it cannot stand, and what stands beside it.
    let size = error(r#"{"size": {"image": "a.png", "mm": [1, 1], "range": [0, 1]}}"#, &good);
    assert!(size.contains("found an object, expected a number"), "{size}");
    let beside = format!("{{{},\n\"psy\": 1}}", &PSI[1..PSI.len() - 1]);
    assert_eq!(
        error(&beside, &good),
        "a.json: line 2, column 5: unknown key \"psy\", expected \"psi\""
    );
    let empty = "a.json: yarn.psi.image: found an empty file, expected a PNG, EXR or HDR picture";
    assert_eq!(error(PSI, b""), empty);
    let cut = error(PSI, &good[..good.len() - 20]);
    assert!(cut.starts_with("a.json: yarn.psi.image: PNG: "), "{cut}");
    // Told before memory is taken for it.
    let mut huge = good;
    huge[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    let huge = error(PSI, &huge);
    assert!(
        huge.contains("found 4294836225 numbers, expected at most") || huge.contains("PNG"),
        "{huge}"
    );
}

#[test]
fn clients_name_no_files() {
    let source = read(&[("a.json", with("{}").as_bytes()), ("a.png", &ramp(2, 2))]).unwrap();
    let Value::Object(json) = serde_json::from_str(&with(PSI)).unwrap() else { panic!() };
    let error = fabric::from_json("a", json, &source).unwrap_err().to_string();
    assert_eq!(error, "a: yarn.psi.image: found a path, expected a data: URI");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// What comes of it is a fabric or an error, and no panic; and what is not the picture is told as if
    /// there were none.
    #[test]
    fn damaged_fabrics_are_read_or_refused(
        changes in prop::collection::vec((any::<Index>(), any::<u8>()), 1..4),
        cut in prop::option::weighted(0.2, any::<Index>()),
    ) {
        let image = data_uri::encode("image/png", &ramp(3, 2));
        let mut bytes = with(&PSI.replace("a.png", &image)).into_bytes();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let _ = read(&[("a.json", &bytes)]);
        if let Ok(Some(TakenOut { rest, .. })) = take_out(&bytes) {
            prop_assert_eq!(rest.len(), bytes.len());
            let lines = |text: &[u8]| text.iter().filter(|byte| **byte == b'\n').count();
            prop_assert_eq!(lines(&rest), lines(&bytes));
        }
    }
}
