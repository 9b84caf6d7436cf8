//! What was baked and how well it fits: as JSON, and in a few lines.

use std::fmt::Write as _;

use serde_json::{Map as Object, Value, json};

use super::{
    Tile, files,
    fit::Fits,
    maps::{Map, Maps},
};
use crate::args::MapFormat;

/// What each map says, for `bake.json`.
fn meaning(map: Map) -> &'static str {
    match map {
        Map::BaseColor => "reflectance of the ground; integers in sRGB",
        Map::Normal => "normal in tangent space, +Y up, halved and shifted by 0.5",
        Map::Height => "height from black_mm to white_mm",
        Map::Roughness => {
            "square root of alpha; alpha is that across over aspect, along times aspect"
        }
        Map::Anisotropy => "a in [0, 1] with aspect = sqrt(1 - 0.9 a)",
        Map::Rotation => "counter-clockwise from u to where it is rougher, in turns",
        Map::AnisotropyUv => "how much rougher along u than along v, halved and shifted by 0.5",
        Map::Specular => "reflectance of the facets seen upright, linear",
        Map::Opacity => "part of the light that does not go straight on",
        Map::YarnId => "index of the type of yarn, from 1; 0 in a gap",
        Map::GltfBaseColor => "base colour in sRGB, opacity as alpha",
        Map::GltfRoughness => "roughness along the fibres in green, metalness in blue",
        Map::GltfAnisotropy => {
            "direction in which it is rougher in red and green, strength in blue"
        }
        Map::GltfSpecular => "reflectance upright over the greatest, as a colour in sRGB",
    }
}

/// The content of `bake.json`.
pub fn json(
    tile: &Tile,
    fits: &Fits,
    maps: &Maps,
    name: &str,
    hash: u64,
    format: MapFormat,
) -> Object<String, Value> {
    let size = tile.size() * 1e3;
    let [low, high] = maps.height.map(|height| f64::from(height) * 1e3);
    let files = Map::ALL.map(|map| json!({ "file": files::name(map, format), "is": meaning(map) }));
    let Value::Object(index) = json!({
        "software": format!("selvedge {}", env!("CARGO_PKG_VERSION")),
        "cloth": name,
        "cloth_fnv1a_64": format!("{hash:016x}"),
        "size_mm": [size.x, size.y],
        "pixels": [tile.pixels.width(), tile.pixels.height()],
        "repeats": tile.repeats,
        "threads": tile.threads(),
        "height_mm": { "black": low, "white": high },
        "left_out": if tile.is_evened { vec!["irregularities along threads, which do not tile"] } else { vec![] },
        "maps": files,
        "fits": fits,
    }) else {
        unreachable!("braces make an object")
    };
    index
}

/// The fits in a few lines, each class in one.
pub fn text(tile: &Tile, fits: &Fits) -> String {
    let mut text = String::new();
    let size = tile.size() * 1e3;
    let [ends, picks] = tile.threads();
    let _ = writeln!(
        text,
        "tile         {:.3} x {:.3} mm, {ends} ends x {picks} picks",
        size.x, size.y
    );
    let _ = writeln!(
        text,
        "{:<6}{:<6}{:<10}{:>7}{:>11}{:>12}{:>8}{:>8}{:>12}{:>11}",
        "yarn",
        "side",
        "pieces",
        "share",
        "roughness",
        "anisotropy",
        "F0",
        "ground",
        "of specular",
        "of diffuse"
    );
    for class in &fits.classes {
        let (of, fit) = (&class.class, &class.fit);
        let _ = writeln!(
            text,
            "{:<6}{:<6}{:<10}{:>5.1} %{:>11.3}{:>12.3}{:>8.4}{:>8.3}{:>10.1} %{:>9.1} %",
            of.yarn,
            if of.is_warp { "warp" } else { "weft" },
            if of.is_straight { "straight" } else { "bent" },
            100.0 * class.share,
            fit.roughness,
            fit.anisotropy,
            fit.reflectance,
            fit.ground,
            100.0 * fit.specular_error,
            100.0 * fit.diffuse_error,
        );
    }
    let far = &fits.far;
    let _ = writeln!(
        text,
        "far field    off by {:.1} % (root mean square), by {:.1} % with sheen; {:.3} times as bright",
        100.0 * far.relative,
        100.0 * far.relative_with_sheen,
        far.brightness
    );
    text
}
