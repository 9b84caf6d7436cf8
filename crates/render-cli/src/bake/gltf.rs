//! A glTF scene of a piece of the cloth: a square in metres that wears the maps.

use glam::DVec2;
use serde_json::{Value, json};

use super::{
    Tile, files,
    fit::Sheen,
    maps::{Map, Maps},
};
use crate::args::MapFormat;

/// The file of the square, beside the scene.
pub const BUFFER: &str = "quad.bin";

/// Least side of the square, m: large enough to be seen.
const SIDE: f64 = 0.1;

/// F₀ of the index of refraction that glTF assumes, 1.5.
const PLASTIC: f32 = 0.04;

/// Bytes of the corners' positions, normals, tangents, places and of the triangles' corners.
const PARTS: [usize; 5] = [4 * 12, 4 * 12, 4 * 16, 4 * 8, 6 * 2];

/// The scene, and the bytes of [`BUFFER`].
///
/// The square shows a whole number of repeats and lies in the plane z = 0, its face to +z.
pub fn scene(tile: &Tile, maps: &Maps, sheen: &Sheen) -> (Value, Vec<u8>) {
    let size = tile.size();
    let repeats = (DVec2::splat(SIDE) / size).ceil();
    let (side, repeats) = ((size * repeats).as_vec2(), repeats.as_vec2());
    let corners = [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut buffer = Vec::new();
    let mut push = |numbers: &[f32]| {
        numbers.iter().for_each(|number| buffer.extend_from_slice(&number.to_le_bytes()));
    };
    corners.iter().for_each(|[x, y]| push(&[(x - 0.5) * side.x, (y - 0.5) * side.y, 0.0]));
    corners.iter().for_each(|_| push(&[0.0, 0.0, 1.0]));
    corners.iter().for_each(|_| push(&[1.0, 0.0, 0.0, 1.0]));
    // From the top.
    corners.iter().for_each(|[x, y]| push(&[x * repeats.x, (1.0 - y) * repeats.y]));
    for index in [0_u16, 1, 2, 0, 2, 3] {
        buffer.extend_from_slice(&index.to_le_bytes());
    }

    let start = |part: usize| PARTS[..part].iter().sum::<usize>();
    let views: Vec<_> = (0..PARTS.len())
        .map(|part| {
            let target = if part == 4 { 34963 } else { 34962 };
            json!({ "buffer": 0, "byteOffset": start(part), "byteLength": PARTS[part], "target": target })
        })
        .collect();
    let half = 0.5 * side;
    let accessor = |view: usize, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": 4, "type": kind });
    let mut positions = accessor(0, "VEC3");
    positions["min"] = json!([-half.x, -half.y, 0.0]);
    positions["max"] = json!([half.x, half.y, 0.0]);
    let indices = json!({ "bufferView": 4, "componentType": 5123, "count": 6, "type": "SCALAR" });

    let pictures = [
        Map::GltfBaseColor,
        Map::Normal,
        Map::GltfRoughness,
        Map::GltfAnisotropy,
        Map::GltfSpecular,
    ];
    let images = pictures.map(|map| {
        let uri = if map.is_for_gltf() {
            files::name(map, MapFormat::Png)
        } else {
            format!("{}.png", map.name())
        };
        json!({ "uri": uri, "name": map.name() })
    });
    let textures: Vec<_> =
        (0..pictures.len()).map(|source| json!({ "sampler": 0, "source": source })).collect();
    let texture = |map: Map| {
        let index = pictures.iter().position(|other| *other == map);
        json!({ "index": index })
    };
    let is_open = maps.texels.iter().any(|texel| texel.opacity < 1.0);
    let factor = maps.specular / PLASTIC;
    let material = json!({
        "name": "cloth",
        "doubleSided": true,
        "alphaMode": if is_open { "BLEND" } else { "OPAQUE" },
        "pbrMetallicRoughness": {
            "baseColorTexture": texture(Map::GltfBaseColor),
            "metallicRoughnessTexture": texture(Map::GltfRoughness),
            "metallicFactor": 0.0,
        },
        "normalTexture": texture(Map::Normal),
        "extensions": {
            "KHR_materials_anisotropy": {
                "anisotropyStrength": 1.0,
                "anisotropyTexture": texture(Map::GltfAnisotropy),
            },
            "KHR_materials_specular": {
                "specularColorFactor": [factor, factor, factor],
                "specularColorTexture": texture(Map::GltfSpecular),
            },
            "KHR_materials_sheen": {
                "sheenColorFactor": sheen.color,
                "sheenRoughnessFactor": sheen.roughness,
            },
        },
    });
    let scene = json!({
        "asset": { "version": "2.0", "generator": format!("selvedge {}", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed":
            ["KHR_materials_anisotropy", "KHR_materials_specular", "KHR_materials_sheen"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "cloth" }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TANGENT": 2, "TEXCOORD_0": 3 },
            "indices": 4,
            "material": 0,
        }] }],
        "materials": [material],
        "textures": textures,
        "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 }],
        "images": images,
        "accessors": [
            positions, accessor(1, "VEC3"), accessor(2, "VEC4"), accessor(3, "VEC2"), indices
        ],
        "bufferViews": views,
        "buffers": [{ "uri": BUFFER, "byteLength": buffer.len() }],
        "extras": { "repeat_mm": [size.x * 1e3, size.y * 1e3] },
    });
    (scene, buffer)
}
