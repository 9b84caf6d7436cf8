//! Wavefront OBJ.
//!
//! tobj reads the file once each statement of it is checked here: it tells of no line, takes curves
//! of three points for faces, and counts on every corner having the same kinds of indices.

use std::{borrow::Cow, fmt::Write};

use glam::{Vec2, Vec3};
use tobj::LoadOptions;

use super::{MAX_CORNERS, Parts, quote};

/// Statements that say nothing of polygons: grouping, shading, materials, points and curves.
const PASSED_OVER: [&str; 17] = [
    "g",
    "o",
    "s",
    "mg",
    "usemtl",
    "mtllib",
    "usemap",
    "maplib",
    "shadow_obj",
    "trace_obj",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "p",
    "l",
    "vp",
];

/// One mesh of all groups in the file.
pub(super) fn read(bytes: &[u8]) -> Result<Parts, String> {
    const OPTIONS: LoadOptions = LoadOptions {
        single_index: true,
        triangulate: false,
        ignore_points: true,
        ignore_lines: true,
    };
    let text = checked(bytes)?;
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &OPTIONS, no_materials)
        .map_err(|error| format!("found what cannot be read ({error}), expected an OBJ file"))?;
    let mut parts = Parts::default();
    for tobj::Model { mesh, .. } in models {
        let first = parts.positions.len() as u32;
        let (positions, _) = mesh.positions.as_chunks();
        let (normals, _) = mesh.normals.as_chunks();
        let (uvs, _) = mesh.texcoords.as_chunks();
        for ((position, normal), uv) in positions.iter().zip(normals).zip(uvs) {
            parts.push_vertex(
                Vec3::from_array(*position),
                Vec3::from_array(*normal),
                Vec2::from_array(*uv),
            )?;
        }
        let mut corners: Vec<_> = mesh.indices.iter().map(|index| first + index).collect();
        // Without arities, all are triangles.
        let arities = match mesh.face_arities.len() {
            0 => vec![3; corners.len() / 3],
            _ => mesh.face_arities,
        };
        let mut rest = corners.as_mut_slice();
        for arity in arities {
            let (face, after) = rest.split_at_mut(arity as usize);
            parts.push_polygon(face)?;
            rest = after;
        }
    }
    Ok(parts)
}

/// The statements that make polygons, so that nothing in them can be read amiss: of vertices the
/// coordinates that count, of faces three indices for each corner, in which the first uv and the
/// first normal stand for those that a corner does not have.
fn checked(bytes: &[u8]) -> Result<String, String> {
    let mut text = String::from("vt 0 0\nvn 0 0 0\n");
    // How many there are of v, vt and vn up to here.
    let mut counts = [0, 1, 1];
    for (line, statement) in statements(bytes) {
        let mut words = statement.split_whitespace();
        let Some(keyword) = words.next() else { continue };
        let outcome = match keyword {
            "v" => copy_numbers(&mut text, "v", words, 3, 3).map(|()| counts[0] += 1),
            "vt" => copy_numbers(&mut text, "vt", words, 1, 2).map(|()| counts[1] += 1),
            "vn" => copy_numbers(&mut text, "vn", words, 3, 3).map(|()| counts[2] += 1),
            "f" | "fo" => copy_face(&mut text, words, counts),
            _ if PASSED_OVER.contains(&keyword) => Ok(()),
            _ => Err(format!("found {}, expected v, vt, vn, f, g or o", quote(keyword))),
        };
        outcome.map_err(|what| format!("line {line}: {what}"))?;
    }
    Ok(text)
}

/// Each statement without its comment, joined where a backslash ends a line, and the number of its
/// first line.
fn statements(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = bytes.split(|&byte| byte == b'\n').zip(1..);
    std::iter::from_fn(move || {
        let (line, number) = lines.next()?;
        // Names may be in any encoding, but nothing that is read here is.
        let mut statement = String::from_utf8_lossy(line);
        while let Some(start) = statement.trim_end().strip_suffix('\\') {
            let start = start.to_owned();
            let Some((next, _)) = lines.next() else { break };
            statement = Cow::Owned(start + " " + &String::from_utf8_lossy(next));
        }
        if let Some(comment) = statement.find('#') {
            statement = Cow::Owned(statement[..comment].to_owned());
        }
        Some((number, statement))
    })
}

/// Writes a statement of `count` numbers, those after the `least`th 0 if they are not given.
fn copy_numbers<'a>(
    text: &mut String,
    keyword: &str,
    words: impl Iterator<Item = &'a str>,
    least: usize,
    count: usize,
) -> Result<(), String> {
    text.push_str(keyword);
    let mut found = 0;
    for word in words.take(count) {
        if !word.parse::<f32>().is_ok_and(f32::is_finite) {
            return Err(format!("found {}, expected a finite number", quote(word)));
        }
        text.push(' ');
        text.push_str(word);
        found += 1;
    }
    if found < least {
        return Err(format!("found {found} numbers after {keyword}, expected {least}"));
    }
    text.push_str(&" 0".repeat(count - found));
    text.push('\n');
    Ok(())
}

/// Writes the face of these corners, each `v`, `v/vt`, `v//vn` or `v/vt/vn`, with indices from the
/// start of the file.
fn copy_face<'a>(
    text: &mut String,
    words: impl Iterator<Item = &'a str>,
    counts: [usize; 3],
) -> Result<(), String> {
    text.push('f');
    let mut corners = 0;
    for word in words {
        let mut fields = word.split('/');
        let [position, uv, normal] = [(); 3].map(|()| fields.next().unwrap_or_default());
        if fields.next().is_some() {
            return Err(format!("found corner {}, expected vertex/uv/normal", quote(word)));
        }
        let position = resolve(position, counts[0], 0, "vertex")?;
        let uv = if uv.is_empty() { 1 } else { resolve(uv, counts[1], 1, "uv")? };
        let normal = if normal.is_empty() { 1 } else { resolve(normal, counts[2], 1, "normal")? };
        write!(text, " {position}/{uv}/{normal}").expect("writing to a String never fails");
        corners += 1;
    }
    if !(3..=MAX_CORNERS).contains(&corners) {
        return Err(format!("found a face of {corners} corners, expected 3 to {MAX_CORNERS}"));
    }
    text.push('\n');
    Ok(())
}

/// The number, from 1, of the object that `word` refers to: from 1 up from the start of the file or
/// from -1 down from here, where there are `count`, the first `ours` of which are not the file's.
fn resolve(word: &str, count: usize, ours: usize, kind: &str) -> Result<usize, String> {
    let count_above = count - ours;
    let index: i64 = word
        .parse()
        .map_err(|_| format!("found {kind} {}, expected a whole number", quote(word)))?;
    let magnitude = usize::try_from(index.unsigned_abs()).unwrap_or(usize::MAX);
    if magnitude == 0 || magnitude > count_above {
        return Err(format!("found {kind} {index}, expected one of the {count_above} above"));
    }
    Ok(ours + if index > 0 { magnitude } else { count_above + 1 - magnitude })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_polygons_and_comments_make_one_mesh() {
        let text = "\u{feff}# a strip\r
v 0 0 0 1 # weighted\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 # and coloured\nv 0 1 0\r
vt 0\nvt 1 0 0\nvt 1 1\nvt 0 1\nvn 0 0 2\ng left
f 1/1/1 2/2/1 3/3/1 4/4/1
g \u{e9}\nusemtl none\nv 2 0 0
f -1 -3 \\
  -4#closed\nl 1 2 3\np 1\n";
        // Also in an encoding that is not UTF-8.
        let bytes: Vec<_> = text.bytes().filter(|&byte| byte != 0xc3).collect();
        let parts = read(&bytes).unwrap();
        let places: Vec<_> = parts.positions.iter().map(|p| (p.x, p.y)).collect();
        let (a, b, c, d, e) = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (2.0, 0.0));
        assert_eq!(places, [a, b, c, d, e, c, b]);
        let uvs: Vec<_> = parts.uvs.iter().map(|uv| (uv.x, uv.y)).collect();
        assert_eq!(uvs, [a, b, c, d, a, a, a]);
        assert_eq!(parts.normals[..4], [Vec3::Z * 2.0; 4]);
        assert_eq!(parts.normals[4..], [Vec3::ZERO; 3]);
        assert_eq!(parts.triangles.len(), 3);
        assert_eq!(parts.triangles[2], [4, 5, 6]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let cases = [
            ("v 1 2", "line 1: found 2 numbers after v, expected 3"),
            ("\n\nv 1 2 nan", "line 3: found \"nan\", expected a finite number"),
            ("v 1 2 1e39", "line 1: found \"1e39\", expected a finite number"),
            ("v 1 x 1", "line 1: found \"x\", expected a finite number"),
            ("vt", "line 1: found 0 numbers after vt, expected 1"),
            ("vertex 1 2 3", "line 1: found \"vertex\", expected v, vt, vn, f, g or o"),
            ("v 0 0 0\nf 1 1", "line 2: found a face of 2 corners, expected 3 to 1024"),
            ("v 0 0 0\nf 1 1 2", "line 2: found vertex 2, expected one of the 1 above"),
            ("v 0 0 0\nf 1 \\\n1 -2", "line 2: found vertex -2, expected one of the 1 above"),
            ("v 0 0 0\nf 1 1 0", "line 2: found vertex 0, expected one of the 1 above"),
            ("v 0 0 0\nf 1/1 1 1", "line 2: found uv 1, expected one of the 0 above"),
            ("v 0 0 0\nvt 0\nf 1/-2 1 1", "line 3: found uv -2, expected one of the 1 above"),
            ("v 0 0 0\nf 1//1 1 1", "line 2: found normal 1, expected one of the 0 above"),
            (
                "v 0 0 0\nf 1 1 1/1/1/1",
                "line 2: found corner \"1/1/1/1\", expected vertex/uv/normal",
            ),
            ("v 0 0 0\nf 1 1 1////", "line 2: found corner \"1////\", expected vertex/uv/normal"),
            ("v 0 0 0\nf 1 1 one", "line 2: found vertex \"one\", expected a whole number"),
            ("v 0 0 0\nf 1 1 /", "line 2: found vertex \"\", expected a whole number"),
            (
                "v 0 0 0\nf 1/-9223372036854775808 1 1",
                "line 2: found uv -9223372036854775808, expected one of the 0 above",
            ),
        ];
        for (text, expected) in cases {
            assert_eq!(read(text.as_bytes()).unwrap_err(), expected, "{text:?}");
        }
        let many = format!("v 0 0 0\nf{}", " 1".repeat(MAX_CORNERS + 1));
        let message = "line 2: found a face of 1025 corners, expected 3 to 1024";
        assert_eq!(read(many.as_bytes()).unwrap_err(), message);
    }
}
