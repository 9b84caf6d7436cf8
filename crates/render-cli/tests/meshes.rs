//! Meshes are read from files of every format, and what is wrong with one is told in one line.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use glam::{Affine3A, Vec2, Vec3};
use proptest::prelude::*;
use selvedge_cli::{
    glam,
    scene::{
        load::{self, Format},
        mesh::Mesh,
        uv::UvReport,
    },
};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

fn read(name: &str) -> Mesh {
    load::read(&fixtures().join("meshes").join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// All meshes of a folder, in the order of their names.
fn meshes(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| Format::of(path).is_some())
        .collect();
    paths.sort();
    paths
}

/// What is at each corner of each triangle.
fn corners(mesh: &Mesh) -> Vec<(Vec3, Vec3, Vec2)> {
    let at = |&index: &u32| {
        let index = index as usize;
        (mesh.positions()[index], mesh.normals()[index], mesh.uvs()[index])
    };
    mesh.triangles().as_flattened().iter().map(at).collect()
}

#[test]
fn one_sheet_is_the_same_from_every_format() {
    let expected = read("fold.obj");
    assert_eq!(expected.triangles().len(), 4);
    assert!((expected.area() - 0.02).abs() < 1e-8, "{}", expected.area());
    let report = UvReport::new(&expected);
    assert_eq!(report.warnings(), [""; 0], "{report:?}");
    let others = ["fold.ply", "fold-little.ply", "fold-big.ply", "fold.gltf", "fold-beside.gltf"];
    for name in others.into_iter().chain(["fold.glb"]) {
        let mesh = read(name);
        let (found, expected) = (corners(&mesh), corners(&expected));
        assert_eq!(found.len(), expected.len(), "{name}");
        for (a, b) in found.iter().zip(&expected) {
            let is_same = a.0.abs_diff_eq(b.0, 1e-6)
                && a.1.abs_diff_eq(b.1, 1e-6)
                && a.2.abs_diff_eq(b.2, 1e-6);
            assert!(is_same, "{name}: {a:?}, expected {b:?}");
        }
        let report = UvReport::new(&mesh);
        assert_eq!(report.warnings(), [""; 0], "{name}: {report:?}");
    }
}

#[test]
fn mirrored_strip_faces_outwards() {
    // Of the same shape, without normals, under a reflection that undoes that of its positions.
    let (strip, fold) = (read("strip.glb"), read("fold.obj"));
    assert!((strip.area() / fold.area() - 1.0).abs() < 1e-6, "{}", strip.area());
    for (triangle, _) in (0..).zip(strip.triangles()) {
        let point = strip.surface(triangle, Vec3::splat(1.0 / 3.0));
        assert!(point.geometric_normal.z > 0.5 && point.normal.z > 0.5, "{point:?}");
        assert!((point.dp_du.length() - 1.0).abs() < 1e-3, "{point:?}");
    }
    assert_eq!(UvReport::new(&strip).warnings(), [""; 0]);
}

#[test]
fn turned_fan_faces_down() {
    // A square of diagonal 2 that faces up, turned over and stretched by its node.
    let fan = read("fan.gltf");
    assert_eq!(fan.triangles().len(), 4);
    assert!((fan.area() - 4.0).abs() < 1e-6, "{}", fan.area());
    assert_eq!(fan.normals(), [Vec3::NEG_Z; 5]);
    for triangle in 0..4 {
        let point = fan.surface(triangle, Vec3::splat(1.0 / 3.0));
        assert_eq!(point.geometric_normal, Vec3::NEG_Z, "{point:?}");
        // In uv its diagonals are 1, and v runs along the world's y.
        assert!(point.dp_du.abs_diff_eq(Vec3::X * 2.0, 0.02), "{point:?}");
        assert!(point.dp_dv.abs_diff_eq(Vec3::Y * 4.0, 0.04), "{point:?}");
    }
    assert_eq!(UvReport::new(&fan).mirrored_share, 1.0);
}

#[test]
fn bare_polygon_is_cut_smoothed_and_told_to_have_no_uv() {
    let mesh = read("angle.obj");
    assert_eq!(mesh.triangles().len(), 4);
    assert_eq!(mesh.area(), 5.0);
    assert_eq!(mesh.normals(), [Vec3::Z; 6]);
    assert_eq!(mesh.uvs(), [Vec2::ZERO; 6]);
    assert!(UvReport::new(&mesh).missing);
}

#[test]
fn placed_meshes_keep_their_faces() {
    let mesh = read("fold.obj");
    let mirrored = mesh.transformed(Affine3A::from_scale(Vec3::new(-2.0, 2.0, 2.0))).unwrap();
    assert!((mirrored.area() / mesh.area() - 4.0).abs() < 1e-5);
    for triangle in 0..4 {
        let point = mirrored.surface(triangle, Vec3::splat(1.0 / 3.0));
        assert!(point.geometric_normal.dot(point.normal) > 0.7, "{point:?}");
    }
    let report = UvReport::new(&mirrored);
    assert_eq!(report.mirrored_share, 1.0);
    assert!((report.stretch[1] - 2.0).abs() < 1e-5, "{report:?}");
}

#[test]
fn what_is_wrong_with_a_mesh_is_told_to_the_letter() {
    let folder = fixtures().join("invalid/meshes");
    let bless = env::var_os("BLESS").is_some();
    let paths = meshes(&folder);
    assert!(paths.len() >= 60, "{}", paths.len());
    for path in paths {
        let name = path.file_name().unwrap().to_str().unwrap();
        let error = load::read(&path).expect_err(name).to_string();
        let message = error.strip_prefix(folder.to_str().unwrap()).unwrap();
        let message = message.trim_start_matches(['/', '\\']);
        let expected = path.with_extension("txt");
        if bless {
            fs::write(&expected, format!("{message}\n")).unwrap();
        }
        let expected = fs::read_to_string(&expected).unwrap();
        assert_eq!(message, expected.trim_end(), "{name}");
    }
}

#[test]
fn files_that_cannot_be_read_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let check = |name: &str, expected: &str| {
        let path = folder.path().join(name);
        let error = load::read(&path).unwrap_err().to_string();
        assert_eq!(error, format!("{}: {expected}", path.display()));
    };
    check("missing.obj", "no such file");
    fs::create_dir(folder.path().join("folder.PLY")).unwrap();
    check("folder.PLY", "found a folder, expected a mesh");
    check("cloth.stl", "found a name that ends in \"stl\", expected .obj, .ply, .gltf or .glb");
    check("cloth", "found a name that ends in \"\", expected .obj, .ply, .gltf or .glb");
    // Without a byte on disk.
    let large = fs::File::create(folder.path().join("large.glb")).unwrap();
    large.set_len(load::MAX_BYTES + 1).unwrap();
    check("large.glb", "found more than 1073741824 bytes, expected a smaller mesh");
}

/// A file and what is done to it.
fn mutated() -> impl Strategy<Value = (PathBuf, Vec<u8>)> {
    let mut paths = meshes(&fixtures().join("meshes"));
    paths.extend(meshes(&fixtures().join("invalid/meshes")));
    let edit = (any::<prop::sample::Index>(), any::<u8>(), 0..5_usize);
    (prop::sample::select(paths), prop::collection::vec(edit, 1..6)).prop_map(|(path, edits)| {
        let mut bytes = fs::read(&path).unwrap();
        for (place, byte, what) in edits {
            let place = place.index(bytes.len().max(1));
            match what {
                _ if bytes.is_empty() => bytes.push(byte),
                0 => bytes[place] = byte,
                // Digits are what counts and indices are made of.
                1 => bytes[place] = b'0' + byte % 10,
                2 => bytes.insert(place, b"0123456789-./eE\n \"[]{}"[byte as usize % 22]),
                3 => bytes.truncate(place.max(1)),
                _ => {
                    let end = (place + byte as usize).min(bytes.len());
                    let copy = bytes[place..end].to_vec();
                    bytes.splice(place..place, copy);
                }
            }
        }
        (path, bytes)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    /// Whatever comes of damaged files, it is a mesh or one line of text, and little memory.
    #[test]
    fn damaged_files_do_no_harm((path, bytes) in mutated()) {
        let format = Format::of(&path).unwrap();
        let name = "cloth".to_owned();
        match load::parse(name, &bytes, format, path.parent().unwrap()) {
            Ok(mesh) => prop_assert!(mesh.area() > 0.0),
            Err(error) => {
                let text = error.to_string();
                let (_, what) = text.split_once("cloth: ").unwrap();
                prop_assert!(what.contains("found") && what.contains("expected"), "{}", text);
                prop_assert!(!text.contains(['\n', '\t']) && text.len() < 300, "{}", text);
            }
        }
        if let Some(peak) = peak_memory() {
            prop_assert!(peak < 100 << 20, "{} bytes", peak);
        }
    }
}

/// Most bytes of memory that this process ever had; `None` where the system does not tell.
fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<u64>().ok()? << 10)
}
