//! The built-in scene: a square cloth draped over a low drum on a photographer's sweep, with a
//! camera and a key light that suit it. The drape is simulated, from a flat sheet to rest, each
//! time it is asked for: that takes under a second and gives the same bits every time.

mod form;
mod simulation;
mod spline;

use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3, Vec3A};
use thiserror::Error;

use self::{
    form::Form,
    simulation::{Material, Phase, Sheet},
    spline::Grid,
};
use super::{
    mesh::Mesh,
    stage::{self, KEY_DIRECTION},
};

/// The built-in scene, in world space: metres, right-handed, z up, the floor at z = 0, the cloth's
/// middle above the origin before it falls, the camera on the side of −y.
///
/// All lengths are proportional to the side of the cloth, so its picture is the same for every
/// side but for the size of the weave.
#[derive(Clone, Debug)]
pub struct BuiltIn {
    /// The cloth, face up. u runs along +x (left to right in the picture) and v along +y (away
    /// from the camera) before it falls, both from 0 to the side, with the origin at the corner
    /// that lies to the left and near the camera. The face is the side of ∂P/∂u × ∂P/∂v, of the
    /// shading normals, and of anticlockwise triangles.
    pub cloth: Mesh,
    /// The floor and, behind, its smooth rise into a wall. Faces up and towards the camera.
    pub floor: Mesh,
    /// The drum, which is seen only through open cloth. Faces outwards.
    pub form: Mesh,
    /// Where the camera stands.
    pub camera: CameraPlacement,
    /// The light that models the folds.
    pub key_light: RectangleLight,
}

/// A perspective camera in world space. Composed for pictures with sides of 3 to 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPlacement {
    /// Centre of projection, in metres.
    pub position: Vec3,
    /// A point in the middle of the picture, in metres.
    pub target: Vec3,
    /// A direction that points up in the picture; unit length, not perpendicular to the view.
    pub up: Vec3,
    /// Angle between the left and the right edge, in radians. The vertical one is
    /// 2 atan(tan(`horizontal_fov`/2) · height/width).
    pub horizontal_fov: f32,
}

/// A rectangular area light in world space, of centre ± `half_u` ± `half_v`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RectangleLight {
    /// Middle of the rectangle, in metres.
    pub centre: Vec3,
    /// From the middle to the middle of one edge, in metres.
    pub half_u: Vec3,
    /// From the middle to the middle of a neighbouring edge, perpendicular to `half_u`, in metres.
    /// Light leaves to the side of `half_u` × `half_v`.
    pub half_v: Vec3,
}

/// A side that no cloth of the built-in scene can have.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("built-in cloth: found a side of {side} m, expected {MIN_SIDE} to {MAX_SIDE}")]
pub struct SideError {
    /// The side found, in metres.
    pub side: f32,
}

/// Side of the cloth that the scene is composed for, in metres: a handkerchief.
pub const DEFAULT_SIDE: f32 = 0.42;

/// What the camera looks at, for a cloth of that side, in metres.
pub(super) const TARGET: Vec3 = Vec3::new(0.008, -0.022, 0.035);

/// Range of the side of the cloth, in metres.
pub(super) const MIN_SIDE: f32 = 0.001;
pub(super) const MAX_SIDE: f32 = 1000.0;

/// Medium-weight cotton on polished wood.
const MATERIAL: Material = Material {
    density: 0.2,
    stretch: 1000.0,
    shear: 40.0,
    bending: 1.2e-5,
    clearance: 0.0008,
    friction_form: 0.1,
    friction_floor: 0.2,
};

/// Off the middle of the cloth, so that no two folds are alike.
const FORM: Form =
    Form { centre: Vec2::new(0.01, 0.02), radius: 0.09, height: 0.13, shoulder: 0.04, dome: 0.3 };

/// Points along the side of the coarsest grid.
const COARSEST: usize = 33;

/// From coarse to fine; each level has twice as many edges along the side as the one before. The
/// fall and the folds are decided on the first, the last phase takes the stretch out.
const LEVELS: [&[Phase]; 3] = [
    &[Phase { steps: 3000, rate: 1500.0, damping: 4.0 }],
    &[Phase { steps: 1200, rate: 2500.0, damping: 5.0 }],
    &[
        Phase { steps: 200, rate: 5000.0, damping: 10.0 },
        Phase { steps: 400, rate: 12000.0, damping: 20.0 },
    ],
];

/// Edges of the mesh per edge of the finest grid: 385 × 385 vertices.
const MESH_FACTOR: usize = 3;

impl BuiltIn {
    /// The scene with a cloth of `side` metres, 0.001 to 1000.
    ///
    /// # Errors
    ///
    /// [`SideError`] when the side is outside that range or not a number.
    pub fn new(side: f32) -> Result<Self, SideError> {
        if !(MIN_SIDE..=MAX_SIDE).contains(&side) {
            return Err(SideError { side });
        }
        let scale = side / DEFAULT_SIDE;
        let (cloth, form) = (drape(), FORM.mesh());
        Ok(Self {
            cloth: scaled(&cloth, scale),
            floor: scaled(&sweep(), scale),
            form: scaled(&form, scale),
            camera: stage::Form::Drape.orbit().placement(TARGET, scale),
            key_light: KEY_DIRECTION.key_light(scale),
        })
    }
}

/// The cloth of [`DEFAULT_SIDE`] at rest.
fn drape() -> Mesh {
    let mut grid = flat_sheet();
    for (level, phases) in LEVELS.iter().enumerate() {
        if level > 0 {
            grid = grid.refine(2).grid;
        }
        let mut sheet = Sheet::new(grid, DEFAULT_SIDE);
        for phase in *phases {
            sheet.run(&MATERIAL, &FORM, phase);
        }
        grid = sheet.into_grid();
    }
    let surface = grid.refine(MESH_FACTOR);
    let size = surface.grid.size;
    let normals = surface.along_columns.iter().zip(&surface.along_rows);
    let spacing = DEFAULT_SIDE / (size - 1) as f32;
    Mesh::new(
        surface.grid.points.iter().map(|&point| point.into()).collect(),
        normals.map(|(&along_u, &along_v)| along_u.cross(along_v).into()).collect(),
        (0..size * size)
            .map(|k| Vec2::new((k % size) as f32, (k / size) as f32) * spacing)
            .collect(),
        grid_triangles(size, size),
    )
    .expect("the simulation is damped and ends in a regular surface")
}

/// The sheet just above the form, with shallow waves around it that decide where folds begin:
/// left to itself, the sheet first buckles where its grid and rounding happen to let it.
fn flat_sheet() -> Grid {
    const WAVES: f32 = 8.0;
    const PHASE: f32 = 0.5;
    const SLOPE: f32 = 0.1;
    const GAP: f32 = 0.003;
    let spacing = DEFAULT_SIDE / (COARSEST - 1) as f32;
    let points = (0..COARSEST * COARSEST).map(|k| {
        let corner = Vec2::new((k % COARSEST) as f32, (k / COARSEST) as f32) * spacing;
        let place = corner - Vec2::splat(DEFAULT_SIDE / 2.0);
        let offset = place - FORM.centre;
        let rise = SLOPE * (offset.length() - 0.6 * FORM.radius).max(0.0);
        let wave = rise * (WAVES * offset.y.atan2(offset.x) + PHASE).cos();
        Vec3A::new(place.x, place.y, FORM.height + MATERIAL.clearance + GAP + wave)
    });
    Grid { size: COARSEST, points: points.collect() }
}

/// The floor, its circular rise and the wall, extruded along x; uv are lengths along x and along
/// the profile.
pub(super) fn sweep() -> Mesh {
    const HALF_WIDTH: f32 = 3.0;
    const FRONT: f32 = -3.0;
    const BACK: f32 = 0.8;
    const RISE: f32 = 0.8;
    const TOP: f32 = 2.5;
    const STEPS: usize = 48;
    let arc = (0..=STEPS).map(|step| {
        let (sin, cos) = (FRAC_PI_2 * step as f32 / STEPS as f32).sin_cos();
        (Vec2::new(BACK + RISE * sin, RISE * (1.0 - cos)), Vec2::new(-sin, cos))
    });
    let floor = [(Vec2::new(FRONT, 0.0), Vec2::Y)];
    let wall = [(Vec2::new(BACK + RISE, TOP), Vec2::NEG_X)];
    let profile: Vec<_> = floor.into_iter().chain(arc).chain(wall).collect();

    let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    let mut length = 0.0;
    for (row, &(point, normal)) in profile.iter().enumerate() {
        length += point.distance(profile[row.saturating_sub(1)].0);
        for x in [-HALF_WIDTH, HALF_WIDTH] {
            positions.push(Vec3::new(x, point.x, point.y));
            normals.push(Vec3::new(0.0, normal.x, normal.y));
            uvs.push(Vec2::new(x, length));
        }
    }
    let triangles = grid_triangles(2, profile.len());
    Mesh::new(positions, normals, uvs, triangles).expect("the profile is finite")
}

/// Two triangles for each square of a grid of vertices, row after row, anticlockwise when rows
/// run to the left of columns. The diagonals alternate, so that they favour no direction.
fn grid_triangles(columns: usize, rows: usize) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(2 * (columns - 1) * (rows - 1));
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let corner = j * columns + i;
            let [a, b, c, d] =
                [corner, corner + 1, corner + columns, corner + columns + 1].map(|k| k as u32);
            if (i + j) % 2 == 0 {
                triangles.extend([[a, b, d], [a, d, c]]);
            } else {
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
    }
    triangles
}

fn scaled(mesh: &Mesh, scale: f32) -> Mesh {
    Mesh::new(
        mesh.positions().iter().map(|&position| position * scale).collect(),
        mesh.normals().to_vec(),
        mesh.uvs().iter().map(|&uv| uv * scale).collect(),
        mesh.triangles().to_vec(),
    )
    .expect("the scale is positive and finite")
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;
    use crate::{
        render::intersect::{Geometry, Ray},
        scene::mesh::tangents,
    };

    static SCENE: LazyLock<BuiltIn> = LazyLock::new(|| BuiltIn::new(DEFAULT_SIDE).unwrap());

    /// The value below which a fraction `q` of `values` lies.
    fn quantile(values: &mut [f32], q: f32) -> f32 {
        values.sort_by(f32::total_cmp);
        values[((values.len() - 1) as f32 * q) as usize]
    }

    /// Vertex pairs of all edges, inner ones once from either side.
    fn edges(mesh: &Mesh) -> impl Iterator<Item = [usize; 2]> {
        mesh.triangles().iter().flat_map(|t| {
            [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|edge| edge.map(|i| i as usize))
        })
    }

    /// Where a point falls in the picture: (−1, −1) bottom left, (1, 1) top right, sides 3 to 2.
    fn project(camera: &CameraPlacement, point: Vec3) -> Vec2 {
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let offset = point - camera.position;
        let tan = (camera.horizontal_fov / 2.0).tan();
        let plane = Vec2::new(offset.dot(right), offset.dot(right.cross(forward)));
        plane / offset.dot(forward) / Vec2::new(tan, tan / 1.5)
    }

    #[test]
    fn cloth_is_hardly_stretched() {
        let cloth = &SCENE.cloth;
        let (p, uv) = (cloth.positions(), cloth.uvs());
        let mut strains: Vec<_> = edges(cloth)
            .map(|[a, b]| (p[a].distance(p[b]) / uv[a].distance(uv[b]) - 1.0).abs())
            .collect();
        let (most, worst) = (quantile(&mut strains, 0.99), quantile(&mut strains, 1.0));
        assert!(most < 0.02, "99 % of edges: {most}, expected below 0.02");
        assert!(worst < 0.06, "worst edge: {worst}, expected below 0.06");
    }

    #[test]
    fn threads_stay_almost_perpendicular() {
        let cloth = &SCENE.cloth;
        let mut cosines: Vec<_> = (0..cloth.triangles().len() as u32)
            .map(|triangle| {
                let corners = cloth.triangles()[triangle as usize].map(|i| cloth.uvs()[i as usize]);
                let (u, v) = tangents(cloth.corners(triangle), corners).unwrap();
                u.normalize().dot(v.normalize()).abs()
            })
            .collect();
        let (most, worst) = (quantile(&mut cosines, 0.99), quantile(&mut cosines, 1.0));
        assert!(most < 0.04, "99 % of triangles: {most}, expected below 0.04");
        assert!(worst < 0.1, "worst triangle: {worst}, expected below 0.1");
    }

    #[test]
    fn cloth_lies_on_form_and_floor_and_not_in_them() {
        let (mut on_form, mut on_floor) = (0, 0);
        let cloth = &SCENE.cloth;
        for triangle in 0..cloth.triangles().len() as u32 {
            let middle = cloth.corners(triangle).iter().sum::<Vec3>() / 3.0;
            let (to_form, _) = FORM.distance(middle.into());
            let near = MATERIAL.clearance * 0.5;
            assert!(to_form > near && middle.z > near, "{middle}: {to_form} from the form");
            on_form += u32::from(to_form < 2.0 * MATERIAL.clearance);
            on_floor += u32::from(middle.z < 2.0 * MATERIAL.clearance);
        }
        let count = cloth.triangles().len() as u32;
        assert!(on_form > count / 10, "{on_form} of {count} triangles lie on the form");
        assert!(on_floor > count / 10, "{on_floor} of {count} triangles lie on the floor");
    }

    #[test]
    fn cloth_does_not_pass_through_itself() {
        let cloth = &SCENE.cloth;
        let geometry = Geometry::new(&[cloth]).unwrap();
        for edge in edges(cloth) {
            let [a, b] = edge.map(|i| cloth.positions()[i]);
            let ray = Ray { origin: a, direction: (b - a).normalize() };
            let crossed = geometry.intersect_where(&ray, 0.0, a.distance(b), |hit| {
                let corners = cloth.triangles()[hit.triangle as usize];
                !corners.iter().any(|&i| edge.contains(&(i as usize)))
            });
            assert_eq!(crossed, None, "edge from {a} to {b}");
        }
    }

    #[test]
    fn cloth_is_smooth() {
        let cloth = &SCENE.cloth;
        let n = cloth.normals();
        // Edges are 1.1 mm long or the diagonals of such squares, so 0.4 rad is a radius of 3 mm.
        let mut turns: Vec<_> = edges(cloth).map(|[a, b]| n[a].distance(n[b])).collect();
        let (most, worst) = (quantile(&mut turns, 0.99), quantile(&mut turns, 1.0));
        assert!(most < 0.15 && worst < 0.4, "normals turn by {most} (99 %), {worst} (worst)");
        // Where normals jitter they turn back and forth from vertex to vertex, which their fourth
        // difference shows sixteenfold.
        let size = 385;
        assert_eq!(n.len(), size * size);
        let mut jitter = Vec::new();
        for j in 2..size - 2 {
            for i in 2..size - 2 {
                for step in [1, size] {
                    let k = j * size + i;
                    let fourth = n[k - 2 * step] - 4.0 * n[k - step] + 6.0 * n[k]
                        - 4.0 * n[k + step]
                        + n[k + 2 * step];
                    jitter.push(fourth.length());
                }
            }
        }
        let (most, worst) = (quantile(&mut jitter, 0.999), quantile(&mut jitter, 1.0));
        assert!(most < 0.03 && worst < 0.1, "jitter of normals {most} (99.9 %), {worst} (worst)");
    }

    #[test]
    fn cloth_faces_up_and_lies_as_documented() {
        let BuiltIn { cloth, camera, .. } = &*SCENE;
        for triangle in 0..cloth.triangles().len() as u32 {
            let point = cloth.surface(triangle, Vec3::splat(1.0 / 3.0));
            assert!(point.geometric_normal.dot(point.normal) > 0.9, "{point:?}");
            assert!(point.dp_du.cross(point.dp_dv).dot(point.normal) > 0.9, "{point:?}");
        }
        let up = cloth.normals().iter().filter(|normal| normal.z > 0.0).count();
        assert!(up * 10 > cloth.normals().len() * 8, "{up}");

        let at = |u: f32, v: f32| {
            let near = |uv: &&Vec2| uv.abs_diff_eq(Vec2::new(u, v) * DEFAULT_SIDE, 1e-6);
            let vertex = cloth.uvs().iter().position(|uv| near(&uv)).unwrap();
            project(camera, cloth.positions()[vertex])
        };
        let corners = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)];
        assert!(corners[0].x < corners[1].x && corners[2].x < corners[3].x, "{corners:?}");
        assert!(corners[0].y < corners[2].y && corners[1].y < corners[3].y, "{corners:?}");
    }

    #[test]
    fn cloth_fills_the_picture_without_leaving_it() {
        let BuiltIn { cloth, floor, camera, .. } = &*SCENE;
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for &position in cloth.positions() {
            let place = project(camera, position);
            (low, high) = (low.min(place), high.max(place));
        }
        assert!(low.min_element() > -0.97 && high.max_element() < 0.97, "{low} {high}");
        assert!((high - low).min_element() > 1.5, "{low} {high}");

        let geometry = Geometry::new(&[cloth, floor]).unwrap();
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let tan = (camera.horizontal_fov / 2.0).tan();
        let mut seen = [0; 2];
        for (x, y) in (0..60).flat_map(|x| (0..40).map(move |y| (x as f32, y as f32))) {
            let across = right * ((x + 0.5) / 30.0 - 1.0) * tan;
            let upwards = right.cross(forward) * ((y + 0.5) / 20.0 - 1.0) * (tan / 1.5);
            let direction = (forward + across + upwards).normalize();
            let ray = Ray { origin: camera.position, direction };
            let hit = geometry.intersect(&ray, 0.0, f32::INFINITY).expect("the sweep is behind");
            seen[hit.mesh as usize] += 1;
        }
        assert!(seen[0] > 2400 / 2, "of 2400 rays, {seen:?} see cloth and floor");
    }

    #[test]
    fn key_light_faces_the_cloth_from_outside_the_picture() {
        let BuiltIn { key_light, camera, cloth, floor, form } = &*SCENE;
        let RectangleLight { centre, half_u, half_v } = *key_light;
        let normal = half_u.cross(half_v).normalize();
        assert!(normal.dot(-centre.normalize()) > 0.999, "{key_light:?}");
        assert!(half_u.dot(half_v).abs() < 1e-6, "{key_light:?}");
        let forward = (camera.target - camera.position).normalize();
        let beside = (centre - camera.position).normalize().angle_between(forward);
        assert!(beside > camera.horizontal_fov, "{beside}");
        let geometry = Geometry::new(&[cloth, floor, form]).unwrap();
        let reaches = |target: Vec3| {
            let direction = (centre - target).normalize();
            let ray = Ray { origin: geometry.offset(target, Vec3::Z, direction), direction };
            !geometry.occluded(&ray, 0.0, target.distance(centre))
        };
        let faces = cloth.positions().iter().zip(cloth.normals());
        let lit = faces.filter(|&(&p, &n)| (centre - p).dot(n) > 0.0 && reaches(p)).count();
        assert!(2 * lit > cloth.positions().len(), "{lit} vertices are lit");
    }

    #[test]
    fn drape_is_the_same_in_every_run() {
        assert!(BuiltIn::new(DEFAULT_SIDE).unwrap().cloth == SCENE.cloth);
    }

    #[test]
    fn scene_grows_with_the_cloth() {
        let large = BuiltIn::new(2.0 * DEFAULT_SIDE).unwrap();
        for (a, b) in large.cloth.positions().iter().zip(SCENE.cloth.positions()) {
            assert_eq!(*a, *b * 2.0);
        }
        assert_eq!(large.cloth.normals(), SCENE.cloth.normals());
        assert_eq!(large.camera.position, SCENE.camera.position * 2.0);
        assert_eq!(large.camera.horizontal_fov, SCENE.camera.horizontal_fov);
        assert_eq!(large.key_light.half_u, SCENE.key_light.half_u * 2.0);
    }

    #[test]
    fn impossible_sides_are_refused() {
        for side in [0.0, -1.0, 1e-4, 2000.0, f32::INFINITY, f32::NAN] {
            assert!(BuiltIn::new(side).is_err(), "{side}");
        }
        let message = BuiltIn::new(-1.0).unwrap_err().to_string();
        assert_eq!(message, "built-in cloth: found a side of -1 m, expected 0.001 to 1000");
    }

    #[test]
    fn sweep_is_smooth_and_faces_the_camera() {
        let floor = &SCENE.floor;
        for triangle in 0..floor.triangles().len() as u32 {
            let point = floor.surface(triangle, Vec3::splat(1.0 / 3.0));
            assert!(point.geometric_normal.dot(point.normal) > 0.999, "{point:?}");
            assert!(point.dp_du.abs_diff_eq(Vec3::X, 1e-4), "{point:?}");
            assert!((point.dp_dv.length() - 1.0).abs() < 1e-3, "{point:?}");
            assert!((SCENE.camera.position - point.position).dot(point.normal) > 0.0, "{point:?}");
        }
    }
}
