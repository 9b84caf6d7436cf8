use std::f32::consts::PI;

use glam::Vec2;

use super::*;
use crate::{
    render::{View, film::Size, plain},
    scene::{
        MAX_DEPTH, Material, Surface,
        drape::{BuiltIn, CameraPlacement, DEFAULT_SIDE, RectangleLight},
        light::{Light, Quad, Sky},
        mesh::Mesh,
    },
};

/// From above, with the picture's middle at the origin.
const CAMERA: CameraPlacement = CameraPlacement {
    position: Vec3::new(0.0, 0.0, 3.0),
    target: Vec3::ZERO,
    up: Vec3::Y,
    horizontal_fov: 0.01,
};

/// A square of side 2 m, 1 m above the origin, that shines downwards.
fn lamp(radiance: f32) -> Light {
    let shape = RectangleLight { centre: Vec3::Z, half_u: Vec3::Y, half_v: Vec3::X };
    Light::Quad(Quad::new(shape, Vec3::splat(radiance)))
}

fn scene(surfaces: Vec<Surface>, camera: CameraPlacement, lights: Vec<Light>) -> Scene {
    Scene::new(surfaces, camera, lights, MAX_DEPTH).unwrap()
}

fn square(centre: Vec3, half_side: f32, reflectance: f32) -> Surface {
    let corners = [Vec2::NEG_ONE, Vec2::new(1.0, -1.0), Vec2::ONE, Vec2::new(-1.0, 1.0)];
    let positions = corners.map(|corner| centre + (corner * half_side).extend(0.0));
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    let mesh = Mesh::with_smooth_normals(positions.into(), corners.into(), triangles).unwrap();
    Surface { mesh: mesh.into(), material: Material::Matte(Vec3::splat(reflectance)) }
}

/// The mean of a small picture.
fn mean(scene: &Scene, spp: u32) -> f32 {
    let size = Size::new(4, 4).unwrap();
    let film = plain(&View::new(scene, size, 1, false), size, spp);
    film.pixels().iter().sum::<Vec3>().x / film.pixels().len() as f32
}

#[test]
fn white_scene_in_a_white_sky_is_white() {
    let built_in = BuiltIn::new(DEFAULT_SIDE).unwrap();
    let white = |mesh: Mesh| Surface { mesh: mesh.into(), material: Material::Matte(Vec3::ONE) };
    let surfaces = [built_in.cloth, built_in.floor, built_in.form].map(white).into();
    let sky = Sky { zenith: Vec3::ONE, horizon: Vec3::ONE };
    let scene = scene(surfaces, built_in.camera, vec![Light::Sky(sky)]);
    let size = Size::new(60, 40).unwrap();
    let film = plain(&View::new(&scene, size, 0, false), size, 16);
    let mean = film.pixels().iter().sum::<Vec3>() / film.pixels().len() as f32;
    assert!(mean.abs_diff_eq(Vec3::ONE, 0.002), "mean {mean}, expected 1");
    // What is lost in a pixel is what would have leaked through triangles.
    let dark = film.pixels().iter().filter(|pixel| pixel.x < 0.98).count();
    assert!(dark * 50 < film.pixels().len(), "{dark} pixels are below 0.98");
    let most = film.pixels().iter().map(|pixel| pixel.max_element()).fold(0.0, f32::max);
    assert!(most <= 1.0 + 1e-5, "{most}, expected at most 1");
}

#[test]
fn floor_reflects_the_form_factor_of_the_lamp() {
    let scene = scene(vec![square(Vec3::ZERO, 5.0, 0.5)], CAMERA, vec![lamp(2.0)]);
    // As in the test of the light itself: E/L = 4/√2 · atan(1/√2).
    let root = 2.0_f32.sqrt();
    let expected = 0.5 / PI * 2.0 * 4.0 / root * (1.0 / root).atan();
    let found = mean(&scene, 256);
    assert!((found - expected).abs() < 2e-3 * expected, "{found}, expected {expected}");
}

#[test]
fn lamp_in_pieces_lights_as_the_whole() {
    let root = 2.0_f32.sqrt();
    let whole = 0.5 / PI * 2.0 * 4.0 / root * (1.0 / root).atan();
    // All are looked at, or some of them.
    for side in [2, 4_u8] {
        let half = 1.0 / f32::from(side);
        let piece = |k: u8| {
            let place = |k: u8| (2.0 * f32::from(k) + 1.0) * half - 1.0;
            let centre = Vec3::new(place(k % side), place(k / side), 1.0);
            let shape = RectangleLight { centre, half_u: half * Vec3::Y, half_v: half * Vec3::X };
            Light::Quad(Quad::new(shape, Vec3::splat(2.0)))
        };
        let lights: Vec<_> = (0..side * side).map(piece).collect();
        let floor = || square(Vec3::ZERO, 5.0, 0.5);
        let found = mean(&scene(vec![floor()], CAMERA, lights.clone()), 256);
        assert!((found - whole).abs() < 5e-3 * whole, "{found}, expected {whole}");
        // The origin is below the edge of a black screen that hides half of them.
        let surfaces = vec![floor(), square(Vec3::new(-2.0, 0.0, 0.5), 2.0, 0.0)];
        let mut camera = CAMERA;
        camera.position = Vec3::new(1.0, 0.0, 0.4);
        let found = mean(&scene(surfaces, camera, lights), 256);
        let half = 0.5 * whole;
        assert!((found - half).abs() < 2e-2 * half, "{found}, expected {half} behind the screen");
    }
}

#[test]
fn floor_reflects_the_cosine_mean_of_the_sky() {
    let sky = Sky { zenith: Vec3::splat(1.0), horizon: Vec3::splat(0.25) };
    let scene = scene(vec![square(Vec3::ZERO, 5.0, 0.5)], CAMERA, vec![Light::Sky(sky)]);
    // 1/π ∫ (h + (z − h) cos θ) cos θ dω = h + 2/3 (z − h).
    let expected = 0.5 * (0.25 + 0.75 * 2.0 / 3.0);
    let found = mean(&scene, 256);
    assert!((found - expected).abs() < 2e-3 * expected, "{found}, expected {expected}");
}

#[test]
fn screen_between_lamp_and_floor_casts_its_shadow() {
    let mut camera = CAMERA;
    // From the side, below the screen.
    camera.position = Vec3::new(0.0, -2.0, 0.2);
    let surfaces = vec![square(Vec3::ZERO, 5.0, 0.5), square(Vec3::new(0.0, 0.0, 0.5), 3.0, 0.0)];
    let scene = scene(surfaces, camera, vec![lamp(2.0)]);
    assert_eq!(mean(&scene, 16), 0.0);
}

#[test]
fn light_does_not_pass_through_a_surface() {
    let scene = scene(vec![square(Vec3::Z * 0.5, 5.0, 1.0)], CAMERA, vec![lamp(2.0)]);
    let below = Ray { origin: Vec3::ZERO, direction: Vec3::Z };
    let sampler = crate::render::sampler::PixelSampler::new([0, 0], 0);
    let below = Beam { ray: below, spread: 0.0, bundle: None };
    let exposures = expose(&scene, [(below, sampler.sample(0))], false);
    assert_eq!(exposures[0].radiance, Vec3::ZERO);
}
