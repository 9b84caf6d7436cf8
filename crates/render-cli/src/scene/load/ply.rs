//! PLY, as text and as binary of either byte order.
//!
//! ply-rs-bw reads header and elements; where they are, what must follow and how much can is
//! checked here.

use std::io::ErrorKind;

use glam::{DVec2, DVec3};
use ply_rs_bw::{
    parser::{ParseError, Parser, Reader},
    ply::{
        ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
        ScalarType,
    },
};

use super::{MAX_CORNERS, Parts, quote};

/// Names of the list of a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The mesh of elements `vertex` and `face`; other elements are passed over.
pub(super) fn read(bytes: &[u8]) -> Result<Parts, String> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Passed>::new()
        .read_header(&mut reader)
        .map_err(|_| wrong_header(bytes, reader.line()))?;
    let mut payload =
        Payload { line: reader.line(), encoding: header.encoding, rest: reader.into_inner() };
    check_names(&header, &bytes[..bytes.len() - payload.rest.len()])?;
    check_sizes(&header, payload.rest.len())?;
    let vertices = header.elements["vertex"].count;
    let (mut parts, mut faces) = (Parts::default(), Vec::new());
    for element in header.elements.values() {
        match &*element.name {
            "vertex" => payload.read(element, |vertex| push_vertex(&mut parts, &vertex))?,
            // Faces may come before the vertices that they name, hence are kept.
            "face" => payload.read(element, |face: Face| {
                faces.push(check_corners(&face, vertices)?);
                Ok(())
            })?,
            _ => payload.read(element, |_: Passed| Ok(()))?,
        }
    }
    payload.check_end()?;
    for corners in faces {
        parts.push_polygon(&corners)?;
    }
    Ok(parts)
}

fn push_vertex(parts: &mut Parts, vertex: &Vertex) -> Result<(), String> {
    let (position, normal) = (vertex.position.as_vec3(), vertex.normal.as_vec3());
    let uv = vertex.uv.as_vec2();
    let (name, value) = if !position.is_finite() {
        ("position", position.to_string())
    } else if !normal.is_finite() {
        ("normal", normal.to_string())
    } else if !uv.is_finite() {
        ("uv", uv.to_string())
    } else {
        return parts.push_vertex(position, normal, uv);
    };
    Err(format!("found {name} {value}, expected finite numbers"))
}

/// The corners of a face, as indices of vertices, of which there are so many.
fn check_corners(face: &Face, vertices: usize) -> Result<Vec<u32>, String> {
    let count = face.corners.len();
    if !(3..=MAX_CORNERS).contains(&count) {
        return Err(format!("found {count} corners, expected 3 to {MAX_CORNERS}"));
    }
    let check = |&corner: &i64| match u32::try_from(corner) {
        Ok(index) if (index as usize) < vertices => Ok(index),
        _ => Err(format!("found vertex {corner}, expected below {vertices}")),
    };
    face.corners.iter().map(check).collect()
}

/// What is wrong with the header, of which this line cannot be read.
fn wrong_header(bytes: &[u8], line: usize) -> String {
    if !bytes.starts_with(b"ply") {
        return "line 1: found no \"ply\", expected a PLY file".to_owned();
    }
    match bytes.split(|&byte| byte == b'\n').nth(line.saturating_sub(1)) {
        Some(text) if !text.is_empty() => {
            let text = String::from_utf8_lossy(text);
            format!("line {line}: found {}, expected a line of the header", quote(&text))
        }
        _ => format!("line {line}: found no more text, expected a line of the header"),
    }
}

/// That the header, of this text, describes a mesh, and each thing once.
fn check_names(header: &Header, text: &[u8]) -> Result<(), String> {
    // What is declared twice is listed once.
    let is_declaration =
        |line: &&[u8]| line.starts_with(b"element") || line.starts_with(b"property");
    let declared = text.split(|&byte| byte == b'\n').filter(is_declaration).count();
    let listed: usize = header.elements.values().map(|element| 1 + element.properties.len()).sum();
    if declared != listed {
        return Err("header: found an element or a property twice, expected each once".to_owned());
    }
    let find = |name| match header.elements.get(name) {
        Some(element) => Ok(element),
        None => Err(format!("header: found no element {name:?}, expected one")),
    };
    let has = |element: &ElementDef, name: &str, is_list| {
        let property = element.properties.get(name);
        property.is_some_and(|p| matches!(p.data_type, PropertyType::List(..)) == is_list)
    };
    let (vertex, face) = (find("vertex")?, find("face")?);
    if let Some(name) = ["x", "y", "z"].into_iter().find(|name| !has(vertex, name, false)) {
        return Err(format!("header: found no number {name:?} of vertex, expected one"));
    }
    if !CORNERS.into_iter().any(|name| has(face, name, true)) {
        return Err(format!("header: found no list {:?} of face, expected one", CORNERS[0]));
    }
    Ok(())
}

/// That what is counted is whole, and no more than fits into the `left` bytes after the header.
fn check_sizes(header: &Header, left: usize) -> Result<(), String> {
    let is_float = |scalar: &ScalarType| matches!(scalar, ScalarType::Float | ScalarType::Double);
    for element in header.elements.values() {
        let ElementDef { name, count, properties } = element;
        let mut size = 0;
        for property in properties.values() {
            let (first, is_wrong) = match &property.data_type {
                PropertyType::Scalar(scalar) => (scalar, false),
                PropertyType::List(count, of) => {
                    let is_corners = CORNERS.contains(&&*property.name);
                    (count, is_float(count) || (is_corners && is_float(of)))
                }
            };
            if is_wrong {
                return Err(format!(
                    "header: found fractions in {:?} of {name}, expected whole numbers",
                    property.name
                ));
            }
            size += if header.encoding == Encoding::Ascii { 2 } else { bytes_of(first) };
        }
        // No blank need end the last number. An element without properties has no size at all.
        let most = (left + 1).checked_div(size).unwrap_or(0);
        if *count > most {
            return Err(format!(
                "header: found {count} of element {name:?}, expected at most {most} in the {left} \
                 bytes after it"
            ));
        }
    }
    Ok(())
}

fn bytes_of(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// Whether a line has no more numbers than an element, which ply-rs-bw would pass over.
fn is_counted(text: &str, element: &ElementDef) -> bool {
    let mut properties = element.properties.values();
    properties.any(|property| matches!(property.data_type, PropertyType::List(..)))
        || text.split_whitespace().count() == element.properties.len()
}

/// What a line of an element holds, in words.
fn numbers_of(element: &ElementDef) -> String {
    let mut text = "the numbers".to_owned();
    for property in element.properties.values() {
        text.push(' ');
        text.push_str(&property.name);
        if matches!(property.data_type, PropertyType::List(..)) {
            text.push_str(" (a count and as many)");
        }
    }
    text
}

/// What is wrong with an element in binary.
fn describe(error: &ParseError) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => "found the end of the file, expected a whole element",
        _ => "found a list of a negative length, expected none or more",
    }
    .to_owned()
}

/// What follows the header.
struct Payload<'a> {
    rest: &'a [u8],
    encoding: Encoding,
    /// The number, from 1, of the line at the start of `rest`, if it is text; it is above 1.
    line: usize,
}

impl Payload<'_> {
    /// Hands each element of a kind to `take`, whose errors get their place.
    fn read<E: PropertyAccess>(
        &mut self,
        element: &ElementDef,
        mut take: impl FnMut(E) -> Result<(), String>,
    ) -> Result<(), String> {
        let parser = Parser::<E>::new();
        for index in 0..element.count {
            let read = match self.encoding {
                Encoding::Ascii => self.read_line(&parser, element),
                Encoding::BinaryBigEndian => parser
                    .read_big_endian_element(&mut self.rest, element)
                    .map_err(|error| describe(&error)),
                Encoding::BinaryLittleEndian => parser
                    .read_little_endian_element(&mut self.rest, element)
                    .map_err(|error| describe(&error)),
            };
            read.and_then(&mut take).map_err(|what| match self.encoding {
                Encoding::Ascii => format!("line {}: {what}", self.line - 1),
                _ => format!("{} {index}: {what}", element.name),
            })?;
        }
        Ok(())
    }

    /// The element of the next line.
    fn read_line<E: PropertyAccess>(
        &mut self,
        parser: &Parser<E>,
        element: &ElementDef,
    ) -> Result<E, String> {
        let Some(text) = self.next_line() else {
            let ElementDef { name, count, .. } = element;
            return Err(format!("found the end of the file, expected {count} of element {name:?}"));
        };
        let read = parser.read_ascii_element(&text, element).ok();
        read.filter(|_| is_counted(&text, element))
            .ok_or_else(|| format!("found {}, expected {}", quote(&text), numbers_of(element)))
    }

    /// The next line that is not blank.
    fn next_line(&mut self) -> Option<String> {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|&byte| byte == b'\n');
            let (line, rest) = self.rest.split_at(end.map_or(self.rest.len(), |end| end + 1));
            self.rest = rest;
            self.line += 1;
            if !line.trim_ascii().is_empty() {
                return Some(String::from_utf8_lossy(line.trim_ascii()).into_owned());
            }
        }
        None
    }

    /// That nothing is left.
    fn check_end(mut self) -> Result<(), String> {
        let count = self.rest.len();
        let found = match self.encoding {
            Encoding::Ascii => self
                .next_line()
                .map(|text| format!("line {}: found {}", self.line - 1, quote(&text))),
            _ => (count > 0).then(|| format!("found {count} bytes after the last element")),
        };
        found.map_or(Ok(()), |found| {
            Err(format!("{found}, expected no more than the elements that the header counts"))
        })
    }
}

/// An element that is not read.
struct Passed;

impl PropertyAccess for Passed {
    fn new() -> Self {
        Self
    }
}

/// What is read of a vertex; properties that it does not have are 0.
#[derive(Default)]
struct Vertex {
    position: DVec3,
    normal: DVec3,
    uv: DVec2,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let slot = match name {
            "x" => &mut self.position.x,
            "y" => &mut self.position.y,
            "z" => &mut self.position.z,
            "nx" => &mut self.normal.x,
            "ny" => &mut self.normal.y,
            "nz" => &mut self.normal.z,
            "u" | "s" | "texture_u" => &mut self.uv.x,
            "v" | "t" | "texture_v" => &mut self.uv.y,
            _ => return PropertyAccessResult::Ignored,
        };
        *slot = match property {
            Property::Char(x) => x.into(),
            Property::UChar(x) => x.into(),
            Property::Short(x) => x.into(),
            Property::UShort(x) => x.into(),
            Property::Int(x) => x.into(),
            Property::UInt(x) => x.into(),
            Property::Float(x) => x.into(),
            Property::Double(x) => x,
            _ => return PropertyAccessResult::Ignored,
        };
        PropertyAccessResult::Set
    }
}

/// What is read of a face.
#[derive(Default)]
struct Face {
    corners: Vec<i64>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match property {
            Property::ListChar(list) => wide(list),
            Property::ListUChar(list) => wide(list),
            Property::ListShort(list) => wide(list),
            Property::ListUShort(list) => wide(list),
            Property::ListInt(list) => wide(list),
            Property::ListUInt(list) => wide(list),
            _ => return PropertyAccessResult::Ignored,
        };
        PropertyAccessResult::Set
    }
}

fn wide<T: Into<i64>>(list: Vec<T>) -> Vec<i64> {
    list.into_iter().map(Into::into).collect()
}
