//! A material of the Unified 3D Material format, version 1.1.

use std::{collections::HashSet, time::SystemTime};

use glam::Vec3;
use humantime::format_rfc3339_seconds;
use selvedge_wif::{Drawdown, Hand, Weave};
use serde_json::{Value, json};

use super::{
    Tile,
    maps::{Map, Maps},
};
use crate::render::sampler::mix;

/// Most shafts of a dobby loom; what needs more is woven on a jacquard.
const SHAFTS: usize = 32;

/// F₀ that the format calls 1.
const SPECULAR_UNIT: f32 = 0.08;

/// The material called `name` of a cloth whose hash is `hash`; it refers to the PNGs beside it.
///
/// Constants are the means of the maps. The identifier is the same for the same cloth and tile.
pub fn material(tile: &Tile, maps: &Maps, drawdown: &Drawdown, name: &str, hash: u64) -> Value {
    let size = tile.size() * 1e3;
    let dpi = |pixels: u32, mm: f64| f64::from(pixels) / (mm / 25.4);
    let image = |map: Map| {
        json!({
            "path": format!("{}.png", map.name()),
            "width": size.x,
            "height": size.y,
            "dpi": {
                "x": dpi(tile.pixels.width(), size.x),
                "y": dpi(tile.pixels.height(), size.y),
            },
            "repeat": { "mode": "normal", "rotation": 0.0 },
        })
    };
    let color = |c: Vec3| json!({ "r": c.x, "g": c.y, "b": c.z });
    let number = |constant: f32, map: Map, factor: f32, offset: f32| {
        let texture = json!({ "factor": factor, "offset": offset, "image": image(map) });
        json!({ "constant": constant, "texture": texture })
    };
    let even = |constant: f32| json!({ "constant": constant, "texture": null });
    let flat = json!({ "x": 0.0, "y": 0.0, "z": 1.0 });
    let mean = &maps.mean;
    let [low, high] = maps.height.map(|height| height * 1e3);
    let grey = mean.specular.element_sum() / 3.0;
    let front = json!({
        "shader": "principled",
        "preview": null,
        "basecolor": {
            "constant": color(mean.base.clamp(Vec3::ZERO, Vec3::ONE)),
            "texture": { "mode": "multiply", "factor": color(Vec3::ONE), "image": image(Map::BaseColor) },
        },
        "normal": { "constant": flat, "texture": { "scale": 1.0, "image": image(Map::Normal) } },
        "displacement": number(mean.height * 1e3, Map::Height, high - low, low),
        "roughness": number(mean.roughness, Map::Roughness, 1.0, 0.0),
        "anisotropy_value": number(mean.anisotropy.length(), Map::Anisotropy, 1.0, 0.0),
        "anisotropy_rotation":
            number(mean.rotation() / std::f32::consts::TAU, Map::Rotation, 1.0, 0.0),
        "specular_value": number(grey / SPECULAR_UNIT, Map::Specular, 1.0 / SPECULAR_UNIT, 0.0),
        "alpha": number(mean.opacity.clamp(0.0, 1.0), Map::Opacity, 1.0, 0.0),
        "specular_tint": even(0.0),
        "metalness": even(0.0),
        "ior": even(1.5),
        "clearcoat_value": even(0.0),
        "clearcoat_roughness": even(0.0),
        "clearcoat_normal": { "constant": flat, "texture": null },
        "sheen_value": even(0.0),
        "sheen_tint": even(0.0),
        "subsurface_value": even(0.0),
        "subsurface_radius": even(0.0),
        "subsurface_color": { "constant": color(Vec3::ONE), "texture": null },
        "transmission": even(0.0),
    });
    let now = format_rfc3339_seconds(SystemTime::now()).to_string();
    json!({
        "schema": "1.1",
        "material": {
            "id": identifier(tile, hash),
            "name": name,
            "description": format!("{} of {} ends and {} picks", drawdown.weave(), tile.threads()[0], tile.threads()[1]),
            "created": now,
            "modified": now,
            "front": front,
            "back": null,
            "side": null,
            "physics": {
                "thickness": null,
                "weight": null,
                "composition": null,
                "devices": { "fab": "null" },
                "material_type": { "type": "Woven", "name": null },
                "construction": { "type": construction(drawdown), "name": null },
            },
            "metadata": null,
        },
        "custom": null,
    })
}

/// The format's word for the weave.
pub fn construction(drawdown: &Drawdown) -> &'static str {
    match drawdown.weave() {
        Weave::Plain => "Plain weave",
        Weave::Twill { hand: Hand::S, .. } => "Twill - left hand (S)",
        Weave::Twill { hand: Hand::Z, .. } => "Twill - right hand (Z)",
        Weave::Satin { .. } => "Satin",
        _ => {
            let column = |end: usize| -> Vec<bool> {
                (0..drawdown.picks()).map(|pick| drawdown.warp_on_top(end, pick)).collect()
            };
            let mut different = HashSet::new();
            let needs_jacquard = (0..drawdown.ends()).any(|end| {
                different.insert(column(end));
                different.len() > SHAFTS
            });
            if needs_jacquard { "Jacquard" } else { "Dobby" }
        }
    }
}

/// A UUID of version 4 by its form, whose bits are hashes.
fn identifier(tile: &Tile, hash: u64) -> String {
    let [x, y] = tile.repeats.map(u64::from);
    let size = (u64::from(tile.pixels.width()) << 32) | u64::from(tile.pixels.height());
    // Not of 0, which stays 0.
    let mixed = |seed: u64| mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    let (a, b) = (mixed(hash ^ mixed(size)), mixed(hash.rotate_left(32) ^ mixed((x << 32) | y)));
    format!(
        "{:08x}-{:04x}-4{:03x}-{:04x}-{:012x}",
        a >> 32,
        (a >> 16) & 0xffff,
        a & 0xfff,
        0x8000 | ((b >> 48) & 0x3fff),
        b & 0xffff_ffff_ffff
    )
}
