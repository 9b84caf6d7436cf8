//! A MaterialX document of an OpenPBR surface.

use super::{
    Tile, files,
    maps::{Map, Maps},
};
use crate::args::MapFormat;

/// The text of a `.mtlx` file that refers to the maps beside it.
///
/// Roughness and anisotropy are those of Burley 2012, of which OpenPBR's follow: with q = 1 − 0.9 a the
/// anisotropy is 1 − q and the roughness r ((1 + q²)/(2 q))^¼. The tangent is turned by the rotation. Lengths
/// are in metres.
pub fn document(tile: &Tile, maps: &Maps, format: MapFormat) -> String {
    let size = tile.size() * 1e3;
    let image = |map: Map, kind: &str| {
        let space = match (format, map.is_color()) {
            (MapFormat::Exr, _) | (_, false) => "",
            (_, true) => " colorspace=\"srgb_texture\"",
        };
        format!(
            "    <image name=\"{name}\" type=\"{kind}\">\n      \
             <input name=\"file\" type=\"filename\" value=\"{file}\"{space} />\n    </image>\n",
            name = map.name(),
            file = files::name(map, format),
        )
    };
    let images = [
        image(Map::BaseColor, "color3"),
        image(Map::Normal, "vector3"),
        image(Map::Height, "float"),
        image(Map::Roughness, "float"),
        image(Map::Anisotropy, "float"),
        image(Map::Rotation, "float"),
        image(Map::Specular, "color3"),
        image(Map::Opacity, "float"),
    ]
    .concat();
    // Of two inputs, each a number or the name of a node.
    let node = |kind: &str, name: &str, of: &str, inputs: &[(&str, &str, &str)]| {
        let inputs: String = inputs
            .iter()
            .map(|(input, kind, value)| {
                let is_number = value.starts_with(|c: char| c.is_ascii_digit());
                let from = if is_number { "value" } else { "nodename" };
                format!("      <input name=\"{input}\" type=\"{kind}\" {from}=\"{value}\" />\n")
            })
            .collect();
        format!("    <{kind} name=\"{name}\" type=\"{of}\">\n{inputs}    </{kind}>\n")
    };
    let float = |kind: &str, name: &str, a: &str, b: &str| {
        node(kind, name, "float", &[("in1", "float", a), ("in2", "float", b)])
    };
    let turned = |axis: &str, name: &str, by: &str| {
        node("multiply", name, "vector3", &[("in1", "vector3", axis), ("in2", "float", by)])
    };
    let one = |kind: &str, name: &str, of: &str| node(kind, name, "float", &[("in", "float", of)]);
    let world = |kind: &str| {
        format!(
            "    <{kind} name=\"world_{kind}\" type=\"vector3\">\n      \
             <input name=\"space\" type=\"string\" value=\"world\" />\n    </{kind}>\n"
        )
    };
    let reciprocal = (1.0 / maps.specular).to_string();
    let nodes = [
        float("multiply", "openpbr_anisotropy", Map::Anisotropy.name(), "0.9"),
        float("subtract", "aspect", "1.0", "openpbr_anisotropy"),
        float("multiply", "aspect_squared", "aspect", "aspect"),
        float("add", "sum_of_squares", "aspect_squared", "1.0"),
        float("multiply", "twice_aspect", "aspect", "2.0"),
        float("divide", "mean_square", "sum_of_squares", "twice_aspect"),
        float("power", "stretch", "mean_square", "0.25"),
        float("multiply", "openpbr_roughness", Map::Roughness.name(), "stretch"),
        float("multiply", "angle", Map::Rotation.name(), "6.283185307"),
        one("cos", "cosine", "angle"),
        one("sin", "sine", "angle"),
        world("tangent"),
        world("bitangent"),
        turned("world_tangent", "part_of_tangent", "cosine"),
        turned("world_bitangent", "part_of_bitangent", "sine"),
        node(
            "add",
            "rough_direction",
            "vector3",
            &[("in1", "vector3", "part_of_tangent"), ("in2", "vector3", "part_of_bitangent")],
        ),
        node("normalmap", "bent_normal", "vector3", &[("in", "vector3", Map::Normal.name())]),
        node(
            "multiply",
            "specular_color",
            "color3",
            &[("in1", "color3", Map::Specular.name()), ("in2", "float", &reciprocal)],
        ),
    ]
    .concat();
    let outputs: String = [
        ("base_color", "color3", Map::BaseColor.name()),
        ("specular_color", "color3", "specular_color"),
        ("specular_roughness", "float", "openpbr_roughness"),
        ("specular_roughness_anisotropy", "float", "openpbr_anisotropy"),
        ("geometry_opacity", "float", Map::Opacity.name()),
        ("geometry_normal", "vector3", "bent_normal"),
        ("geometry_tangent", "vector3", "rough_direction"),
        ("displacement", "float", Map::Height.name()),
    ]
    .iter()
    .map(|(name, kind, node)| {
        format!("    <output name=\"out_{name}\" type=\"{kind}\" nodename=\"{node}\" />\n")
    })
    .collect();
    let surface: String = [
        ("base_color", "color3"),
        ("specular_color", "color3"),
        ("specular_roughness", "float"),
        ("specular_roughness_anisotropy", "float"),
        ("geometry_opacity", "float"),
        ("geometry_normal", "vector3"),
        ("geometry_tangent", "vector3"),
    ]
    .iter()
    .map(|(name, kind)| {
        format!(
            "    <input name=\"{name}\" type=\"{kind}\" nodegraph=\"cloth_maps\" output=\"out_{name}\" />\n"
        )
    })
    .collect();
    let root = maps.specular.min(0.99).sqrt();
    let ior = (1.0 + root) / (1.0 - root);
    let [low, high] = maps.height;
    format!(
        "<?xml version=\"1.0\"?>\n\
         <materialx version=\"1.39\" colorspace=\"lin_rec709\" doc=\"One repeat is {x} x {y} mm\">\n  \
         <nodegraph name=\"cloth_maps\">\n{images}{nodes}{outputs}  </nodegraph>\n  \
         <open_pbr_surface name=\"cloth_surface\" type=\"surfaceshader\">\n{surface}    \
         <input name=\"specular_ior\" type=\"float\" value=\"{ior}\" />\n    \
         <input name=\"geometry_thin_walled\" type=\"boolean\" value=\"true\" />\n  \
         </open_pbr_surface>\n  \
         <displacement name=\"cloth_displacement\" type=\"displacementshader\">\n    \
         <input name=\"displacement\" type=\"float\" nodegraph=\"cloth_maps\" output=\"out_displacement\" />\n    \
         <input name=\"scale\" type=\"float\" value=\"{scale}\" />\n  </displacement>\n  \
         <surfacematerial name=\"cloth\" type=\"material\">\n    \
         <input name=\"surfaceshader\" type=\"surfaceshader\" nodename=\"cloth_surface\" />\n    \
         <input name=\"displacementshader\" type=\"displacementshader\" nodename=\"cloth_displacement\" />\n  \
         </surfacematerial>\n</materialx>\n",
        x = size.x,
        y = size.y,
        scale = high - low,
    )
}
