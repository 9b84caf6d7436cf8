//! glTF 2.0, as text and as binary (Khronos Group 2021, *glTF 2.0 Specification*).
//!
//! The crate gltf reads and validates the JSON; the tree of nodes and the bytes of accessors, which
//! it would follow and slice unchecked, are read here.

mod accessor;
mod uri;

use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Vec2, Vec3};
use gltf::{
    Accessor, Document, Error, Gltf, Node, Primitive, Semantic,
    accessor::Dimensions,
    binary::{self, ChunkType},
    buffer::{Buffer, Source},
    json::{
        Root,
        validation::{self, Checked},
    },
    mesh::Mode,
    scene::Transform,
};

use self::accessor::{numbers, whole_numbers};
use super::{MAX_BYTES, Parts, check_room, quote};
use crate::{data_uri, input, scene::placement::Placement};

/// y up to z up: (x, y, z) to (x, −z, y).
const UPRIGHT: DMat3 = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);

/// All triangles of the scene that the file shows first, in its world.
pub(super) fn read(bytes: &[u8], folder: &Path) -> Result<Parts, String> {
    check_binary_header(bytes)?;
    let Gltf { document, blob } =
        Gltf::from_slice_without_validation(bytes).map_err(|error| describe(&error))?;
    let root = document.into_json();
    check_positions(&root)?;
    let document = Document::from_json(root).map_err(|error| describe(&error))?;
    let version = &document.as_json().asset.version;
    if !version.starts_with("2.") {
        return Err(format!("asset.version: found {}, expected 2.0", quote(version)));
    }
    let buffers = read_buffers(&document, blob, folder)?;
    let mut parts = Parts::default();
    for (node, map) in placed_nodes(&document)? {
        let Some(mesh) = node.mesh() else { continue };
        let placement = Placement::new(map).ok_or_else(|| {
            let node = node.index();
            format!("nodes[{node}]: found a transform that flattens, expected an invertible one")
        })?;
        for primitive in mesh.primitives() {
            read_primitive(mesh.index(), &primitive, &buffers, &placement, &mut parts)?;
        }
    }
    Ok(parts)
}

/// That a binary file is at least as long as it says: the crate relies on it.
fn check_binary_header(bytes: &[u8]) -> Result<(), String> {
    const HEADER: usize = 12;
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let Some(length) = bytes.get(8..HEADER).and_then(|length| length.try_into().ok()) else {
        return Err("found the end of the file, expected a header of 12 bytes".to_owned());
    };
    let (length, found) = (u32::from_le_bytes(length) as usize, bytes.len());
    if !(HEADER..=found).contains(&length) {
        return Err(format!("header: found a length of {length}, expected the file's, {found}"));
    }
    Ok(())
}

/// That the accessors of positions exist: the crate's validation looks into them unasked.
fn check_positions(root: &Root) -> Result<(), String> {
    for (mesh, primitives) in root.meshes.iter().map(|mesh| &mesh.primitives).enumerate() {
        for (primitive, content) in primitives.iter().enumerate() {
            let position = content.attributes.get(&Checked::Valid(Semantic::Positions));
            if position.is_some_and(|accessor| accessor.value() >= root.accessors.len()) {
                let what = describe_invalid(validation::Error::IndexOutOfBounds);
                return Err(format!("meshes[{mesh}].primitives[{primitive}].POSITION: {what}"));
            }
        }
    }
    Ok(())
}

fn describe(error: &Error) -> String {
    match error {
        Error::Deserialize(error) => {
            let (line, column) = (error.line(), error.column());
            let text = error.to_string();
            let end = format!(" at line {line} column {column}");
            let text = text.strip_suffix(&end).unwrap_or(&text).replace('`', "\"");
            let what = if let Some(name) = text.strip_prefix("missing field ") {
                format!("found no {name}, expected one")
            } else if error.is_eof() {
                "found the end of the JSON, expected more".to_owned()
            } else if let Some((_, what)) = text.split_once("invalid ")
                && what.contains(", expected ")
            {
                let what = what.trim_start_matches("type: ").trim_start_matches("value: ");
                format!(
                    "found {}",
                    what.replace("u64", "a whole number").replace("f32", "a number")
                )
            } else {
                format!("found what is not glTF 2.0 ({text}), expected what is")
            };
            format!("line {line}, column {column}: {what}")
        }
        Error::Validation(errors) => match errors.first() {
            Some((path, error)) => format!("{path}: {}", describe_invalid(*error)),
            None => "found what is not valid, expected a valid glTF".to_owned(),
        },
        Error::Binary(error) => match error {
            binary::Error::Version(version) => {
                format!("header: found version {version}, expected 2")
            }
            binary::Error::ChunkLength { ty, length, length_read } => format!(
                "chunk {}: found {length_read} bytes, expected {length}",
                match ty {
                    ChunkType::Json => "JSON",
                    ChunkType::Bin => "BIN",
                }
            ),
            binary::Error::ChunkType(_) | binary::Error::UnknownChunkType(_) => {
                "found chunks of other kinds, expected JSON and then BIN".to_owned()
            }
            _ => "found the end of the file, expected the header of a chunk".to_owned(),
        },
        Error::Io(error) => format!("found what cannot be read ({error}), expected a glTF"),
    }
}

fn describe_invalid(error: validation::Error) -> &'static str {
    match error {
        validation::Error::IndexOutOfBounds => "found an index beyond the last, expected one below",
        validation::Error::Invalid => "found a value without a meaning, expected one of glTF 2.0",
        validation::Error::Missing => "found none, expected one",
        validation::Error::Oversize => "found more than memory, expected less",
        validation::Error::Unsupported => "found an extension that is not read, expected none",
    }
}

/// The bytes of all buffers, each as long as it says.
fn read_buffers(
    document: &Document,
    mut blob: Option<Vec<u8>>,
    folder: &Path,
) -> Result<Vec<Vec<u8>>, String> {
    let mut room = MAX_BYTES;
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let bytes = match buffer.source() {
            Source::Bin => blob.take().ok_or_else(|| "found no BIN chunk, expected one".to_owned()),
            Source::Uri(text) => match data_uri::decode(text) {
                Some(data) => data,
                None => read_beside(text, folder, room),
            },
        };
        let bytes = bytes.and_then(|bytes| fit(bytes, &buffer));
        let bytes = bytes.map_err(|what| format!("buffers[{}]: {what}", buffer.index()))?;
        room = room.saturating_sub(bytes.len() as u64);
        buffers.push(bytes);
    }
    Ok(buffers)
}

fn fit(mut bytes: Vec<u8>, buffer: &Buffer<'_>) -> Result<Vec<u8>, String> {
    let (found, expected) = (bytes.len(), buffer.length());
    if found < expected {
        return Err(format!("found {found} bytes, expected {expected}"));
    }
    bytes.truncate(expected);
    Ok(bytes)
}

/// The bytes of a file in the folder, at most so many.
fn read_beside(text: &str, folder: &Path, most: u64) -> Result<Vec<u8>, String> {
    let path = folder.join(uri::beside(text)?);
    let name = quote(text);
    if !path.is_file() {
        return Err(format!("found no file {name}, expected one"));
    }
    if !uri::is_in(&path, folder) {
        return Err(format!("found {name}, expected a file in the same folder"));
    }
    match input::read_file(&path, most) {
        Ok(Some(bytes)) => Ok(bytes),
        Ok(None) => Err(format!("found more than {MAX_BYTES} bytes, expected a smaller mesh")),
        Err(error) => Err(format!("found {name} ({error}), expected a file that can be read")),
    }
}

/// All nodes of the scene that is shown first, or where there is no scene of all trees, each with
/// the map from its coordinates to the world.
fn placed_nodes(document: &Document) -> Result<Vec<(Node<'_>, DAffine3)>, String> {
    let upright = DAffine3::from_mat3(UPRIGHT);
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let mut left: Vec<_> = match scene {
        Some(scene) => scene.nodes().map(|node| (node, upright)).collect(),
        None => {
            let mut is_child = vec![false; document.nodes().len()];
            for child in document.nodes().flat_map(|node| node.children()) {
                is_child[child.index()] = true;
            }
            let roots = document.nodes().filter(|node| !is_child[node.index()]);
            roots.map(|node| (node, upright)).collect()
        }
    };
    // In the order of the file, though taken from the end.
    left.reverse();
    let mut is_met = vec![false; document.nodes().len()];
    let mut nodes = Vec::new();
    while let Some((node, parent)) = left.pop() {
        let index = node.index();
        if std::mem::replace(&mut is_met[index], true) {
            return Err(format!("nodes[{index}]: found a second way to it, expected a tree"));
        }
        let map = parent * local(&node).map_err(|what| format!("nodes[{index}]: {what}"))?;
        let children = left.len();
        left.extend(node.children().map(|child| (child, map)));
        left[children..].reverse();
        nodes.push((node, map));
    }
    Ok(nodes)
}

/// The map from a node's coordinates to its parent's.
fn local(node: &Node<'_>) -> Result<DAffine3, String> {
    match node.transform() {
        Transform::Matrix { matrix } => {
            if matrix.map(|column| column[3]) != [0.0, 0.0, 0.0, 1.0] {
                return Err("found a matrix with another last row, expected 0 0 0 1".to_owned());
            }
            let columns = matrix.map(|column| column.map(f64::from));
            Ok(DAffine3::from_mat4(DMat4::from_cols_array_2d(&columns)))
        }
        Transform::Decomposed { translation, rotation, scale } => {
            let rotation = DQuat::from_array(rotation.map(f64::from));
            if !(rotation.length() > 0.0 && rotation.is_finite()) {
                return Err("found a rotation of no length, expected a unit quaternion".to_owned());
            }
            Ok(DAffine3::from_scale_rotation_translation(
                DVec3::from_array(scale.map(f64::from)),
                rotation.normalize(),
                DVec3::from_array(translation.map(f64::from)),
            ))
        }
    }
}

/// Adds the triangles of a primitive of this mesh, if it has any.
fn read_primitive(
    mesh: usize,
    primitive: &Primitive<'_>,
    buffers: &[Vec<u8>],
    placement: &Placement,
    parts: &mut Parts,
) -> Result<(), String> {
    let here = |what| format!("meshes[{mesh}].primitives[{}]: {what}", primitive.index());
    let triangle_of: fn(u32) -> [u32; 3] = match primitive.mode() {
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(()),
        Mode::Triangles => |k| [3 * k, 3 * k + 1, 3 * k + 2],
        // Every other one the other way round (section 3.7.2.1).
        Mode::TriangleStrip => |k| [k, k + 1 + k % 2, k + 2 - k % 2],
        Mode::TriangleFan => |k| [k + 1, k + 2, 0],
    };
    let position = primitive
        .get(&Semantic::Positions)
        .ok_or_else(|| here("found no POSITION, expected one".to_owned()))?;
    let vertices = position.count();
    let attribute = |semantic: Semantic| {
        let accessor = primitive.get(&semantic);
        let found = accessor.as_ref().map_or(vertices, Accessor::count);
        if found != vertices {
            let name = semantic.to_string();
            return Err(here(format!("found {found} of {name}, expected {vertices}")));
        }
        Ok(accessor)
    };
    let (normal, uv) = (attribute(Semantic::Normals)?, attribute(Semantic::TexCoords(0))?);
    let corners = match primitive.indices() {
        Some(accessor) => accessor.count(),
        None => vertices,
    };
    let triangles = match primitive.mode() {
        Mode::Triangles if !corners.is_multiple_of(3) => {
            return Err(here(format!("found {corners} corners, expected a multiple of 3")));
        }
        Mode::Triangles => corners / 3,
        _ => corners.saturating_sub(2),
    };
    check_room("vertices", parts.positions.len(), vertices).map_err(here)?;
    check_room("triangles", parts.triangles.len(), triangles).map_err(here)?;

    let first = parts.positions.len() as u32;
    let positions = numbers(&position, Dimensions::Vec3, buffers)?;
    let normals =
        normal.map(|accessor| numbers(&accessor, Dimensions::Vec3, buffers)).transpose()?;
    let uvs = uv.map(|accessor| numbers(&accessor, Dimensions::Vec2, buffers)).transpose()?;
    let vector = |xyz: &[f32]| Vec3::from_slice(xyz);
    for (index, position) in positions.chunks_exact(3).enumerate() {
        let normal = normals.as_ref().map_or(Vec3::ZERO, |list| vector(&list[3 * index..]));
        // v runs down from the picture's upper edge in glTF, and up the cloth here.
        let uv = uvs
            .as_ref()
            .map_or(Vec2::ZERO, |list| Vec2::new(list[2 * index], 1.0 - list[2 * index + 1]));
        let position = placement.position(vector(position));
        parts.push_vertex(position, placement.normal(normal), uv).map_err(here)?;
    }
    let indices = primitive
        .indices()
        .map(|accessor| read_indices(&accessor, vertices, buffers))
        .transpose()?;
    for triangle in (0..triangles as u32).map(triangle_of) {
        let corners = triangle.map(|corner| {
            first + indices.as_ref().map_or(corner, |indices| indices[corner as usize])
        });
        parts.push_polygon(&placement.triangle(corners)).map_err(here)?;
    }
    Ok(())
}

/// Indices of vertices, of which there are so many.
fn read_indices(
    accessor: &Accessor<'_>,
    vertices: usize,
    buffers: &[Vec<u8>],
) -> Result<Vec<u32>, String> {
    let indices = whole_numbers(accessor, buffers)?;
    match indices.iter().position(|&index| index as usize >= vertices) {
        None => Ok(indices),
        Some(at) => Err(format!(
            "accessors[{}]: element {at}: found vertex {}, expected below {vertices}",
            accessor.index(),
            indices[at]
        )),
    }
}
