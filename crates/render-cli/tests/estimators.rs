//! Light is found by drawing lamps, by following bounces, and by both: all find the same.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use selvedge_cli::{
    fabric,
    render::{View, detail::Level, exposure::Expose, film::Size, integrator::Estimator},
    scene::{
        Material, Scene, Surface,
        drape::{CameraPlacement, RectangleLight},
        light::{Constant, Distant, Light, Lights, Quad, Sky, Sphere},
        mesh::Mesh,
        shape::Shape,
    },
};
use selvedge_normalize::scale::Mode;

/// A cloth of 4 cm at z = 0 under a lamp, a small ball and an even sky.
fn scene(material: Material) -> Scene {
    let ball = Light::Sphere(Sphere {
        centre: Vec3::new(-0.05, 0.05, 0.05),
        radius: 0.01,
        radiance: Vec3::new(9.0, 6.0, 3.0),
    });
    let sky = Light::Constant(Constant { radiance: Vec3::splat(0.2) });
    scene_of(vec![cloth(material)], vec![lamp(), ball, sky])
}

fn lamp() -> Light {
    let shape = RectangleLight {
        centre: Vec3::new(0.05, 0.02, 0.08),
        half_u: 0.02 * Vec3::Y,
        half_v: 0.02 * Vec3::X,
    };
    Light::Quad(Quad::new(shape, Vec3::splat(4.0)))
}

fn cloth(material: Material) -> Surface {
    let corners = [Vec2::NEG_ONE, Vec2::new(1.0, -1.0), Vec2::ONE, Vec2::new(-1.0, 1.0)];
    let corners = corners.map(|corner| corner * 0.02);
    let mesh = Mesh::new(
        corners.map(|corner| corner.extend(0.0)).into(),
        vec![Vec3::Z; 4],
        corners.map(|corner| corner + 0.02).into(),
        vec![[0, 1, 2], [0, 2, 3]],
    );
    Surface { mesh: Arc::new(mesh.unwrap()), material }
}

fn scene_of(surfaces: Vec<Surface>, lights: Vec<Light>) -> Scene {
    let camera = CameraPlacement {
        position: Vec3::new(0.0, -0.1, 0.1),
        target: Vec3::ZERO,
        up: Vec3::Z,
        horizontal_fov: 0.1,
    };
    Scene::new(surfaces, camera, lights, 4).unwrap()
}

/// Mean of a picture of `spp` samples of a pixel, and the deviation of that.
fn mean(scene: &Scene, spp: u32) -> (DVec3, DVec3) {
    const SIDE: u32 = 8;
    let view = View::new(scene, Size::new(SIDE, SIDE).unwrap(), 5, false);
    let (mut mean, mut variance) = (DVec3::ZERO, DVec3::ZERO);
    let pixels = f64::from(SIDE * SIDE);
    for pixel in 0..SIDE * SIDE {
        let at = |index| view.expose([pixel % SIDE, pixel / SIDE], index).radiance.as_dvec3();
        let samples: Vec<DVec3> = (0..spp).map(at).collect();
        let of_pixel = samples.iter().sum::<DVec3>() / f64::from(spp);
        let squares: DVec3 = samples.iter().map(|sample| (sample - of_pixel).powf(2.0)).sum();
        mean += of_pixel / pixels;
        // As of independent samples, of which these are evener.
        variance += squares / f64::from(spp * (spp - 1)) / (pixels * pixels);
    }
    (mean, variance.map(f64::sqrt))
}

#[test]
fn white_ball_in_a_white_sky_is_white() {
    let mesh = Shape::Sphere { radius: 0.02 }.mesh().unwrap();
    let surfaces = vec![Surface { mesh: Arc::new(mesh), material: Material::Matte(Vec3::ONE) }];
    let camera = CameraPlacement {
        position: Vec3::new(0.0, -0.1, 0.1),
        target: Vec3::ZERO,
        up: Vec3::Z,
        horizontal_fov: 0.2,
    };
    let lights = vec![Light::Constant(Constant { radiance: Vec3::ONE })];
    let mut scene = Scene::new(surfaces, camera, lights, 4).unwrap();
    for estimator in [Estimator::Both, Estimator::Lights, Estimator::Directions] {
        scene.estimator = estimator;
        let (found, deviation) = mean(&scene, 1024);
        assert!(found.abs_diff_eq(DVec3::ONE, 2e-3), "{estimator:?}: {found} ± {deviation}");
    }
}

#[test]
fn white_cloth_in_a_white_sky_returns_no_more_than_it_receives() {
    for (name, mode) in [
        ("denim", Mode::Pointwise),
        ("silk-charmeuse", Mode::Pointwise),
        ("duchesse-satin", Mode::Segment),
        ("tartan-wool", Mode::Segment),
    ] {
        let source = fabric::read(format!("preset:{name}").as_ref()).unwrap();
        let mut cloth = source.cloth(&source.draft().drawdown().unwrap()).unwrap();
        cloth.normalization = mode;
        for yarn in &mut cloth.yarns {
            yarn.color = [1.0; 3];
            yarn.specular = [0.5, 0.3, 0.1];
            yarn.specular_uniform = None;
        }
        let mut scene = scene(Material::cloth(source.shader(&cloth).unwrap()));
        scene.lights = Lights::new(vec![Light::Constant(Constant { radiance: Vec3::ONE })], 0.02);
        // A few threads across the picture, so that a pixel is a small part of one.
        scene.camera.horizontal_fov = 0.01;
        const SIDE: u32 = 24;
        const SPP: u32 = 512;
        let view = View::new(&scene, Size::new(SIDE, SIDE).unwrap(), 5, false);
        let mut mean = Vec3::ZERO;
        for pixel in 0..SIDE * SIDE {
            let at = |index| view.expose([pixel % SIDE, pixel / SIDE], index).radiance;
            let samples: Vec<Vec3> = (0..SPP).map(at).collect();
            let of_pixel = samples.iter().sum::<Vec3>() / SPP as f32;
            let squares: Vec3 = samples.iter().map(|s| (s - of_pixel) * (s - of_pixel)).sum();
            let deviation = squares.map(f32::sqrt) / SPP as f32;
            mean += of_pixel / (SIDE * SIDE) as f32;
            if mode == Mode::Pointwise {
                let bound = Vec3::splat(1.0 + 1e-4) + 4.0 * deviation;
                assert!(of_pixel.cmple(bound).all(), "{name}, {pixel}: {of_pixel} ± {deviation}");
            }
        }
        assert!(mean.cmple(Vec3::splat(1.001)).all(), "{name}: {mean}");
        assert!(mean.cmpge(Vec3::splat(0.1)).all(), "{name}: {mean}");
    }
}

#[test]
fn estimators_agree_on_every_kind_of_cloth() {
    let fabrics = [
        "cotton-gauze",
        "denim",
        "duchesse-satin",
        "jacquard-damask",
        "polyester-lining",
        "silk-charmeuse",
        "tartan-wool",
        "wool-gabardine",
    ];
    for name in fabrics {
        let source = fabric::read(format!("preset:{name}").as_ref()).unwrap();
        let cloth = source.cloth(&source.draft().drawdown().unwrap()).unwrap();
        let mut scene = scene(Material::cloth(source.shader(&cloth).unwrap()));
        let (expected, deviation) = mean(&scene, 256);
        for estimator in [Estimator::Lights, Estimator::Directions] {
            scene.estimator = estimator;
            let (found, other) = mean(&scene, 256);
            let difference = (found - expected).abs();
            let bound = 4.0 * (deviation.powf(2.0) + other.powf(2.0)).map(f64::sqrt);
            assert!(
                difference.cmple(bound).all(),
                "{name}, {estimator:?}: {found}, expected {expected} within {bound}"
            );
        }
    }
}

/// A sky is met along one of several directions that the places of cloth draw together; a constant light along a single
/// one, or drawn.
#[test]
fn sky_is_as_bright_as_a_light_that_is_drawn() {
    let wall = Mesh::with_smooth_normals(
        [[1.0, -4.0, 0.0], [1.0, 4.0, 0.0], [1.0, 4.0, 4.0], [1.0, -4.0, 4.0]]
            .map(|corner| Vec3::from_array(corner) * 0.005)
            .into(),
        vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let wall = Arc::new(wall.unwrap());
    for name in ["cotton-gauze", "denim", "silk-charmeuse"] {
        let source = fabric::read(format!("preset:{name}").as_ref()).unwrap();
        let material = source.cloth(&source.draft().drawdown().unwrap()).unwrap();
        let material = Material::cloth(source.shader(&material).unwrap());
        let surfaces = || {
            let matte = Material::Matte(Vec3::splat(0.7));
            vec![cloth(material.clone()), Surface { mesh: Arc::clone(&wall), material: matte }]
        };
        // As narrow as a thread, and some threads wide.
        for fov in [0.005, 0.04] {
            let radiance = Vec3::new(0.2, 0.3, 0.5);
            let constant = Light::Constant(Constant { radiance });
            let sky = Light::Sky(Sky { zenith: radiance, horizon: radiance });
            let mean_under = |light: &Light, estimator| {
                let mut scene = scene_of(surfaces(), vec![lamp(), light.clone()]);
                scene.camera.horizontal_fov = fov;
                scene.detail.level = Level::Near;
                scene.estimator = estimator;
                mean(&scene, 256)
            };
            let (expected, deviation) = mean_under(&constant, Estimator::Lights);
            for (how, light, estimator) in [
                ("drawn or met", constant, Estimator::Both),
                ("met", sky.clone(), Estimator::Both),
                ("met, as the lamp", sky, Estimator::Directions),
            ] {
                let (found, other) = mean_under(&light, estimator);
                let difference = (found - expected).abs();
                let bound = 4.0 * (deviation.powf(2.0) + other.powf(2.0)).map(f64::sqrt);
                assert!(
                    difference.cmple(bound).all(),
                    "{name}, {fov} rad, {how}: {found}, expected {expected} within {bound}"
                );
            }
        }
    }
}

/// Lights so narrow that ways on from cloth leave them to those who draw them, alone and beside others.
#[test]
fn narrow_lights_are_found_as_wide_ones_are() {
    let narrow = |x: f32, wide: f32| {
        let towards = Vec3::new(x, 0.3, 0.8).normalize();
        Light::Distant(Distant::new(towards, Vec3::new(1.0, 2.0, 3.0), wide))
    };
    let narrow = [-0.5, 0.1, 0.6].map(|x| narrow(x, 0.11));
    let sky = Light::Constant(Constant { radiance: Vec3::splat(0.2) });
    for name in ["cotton-gauze", "denim"] {
        let source = fabric::read(format!("preset:{name}").as_ref()).unwrap();
        let material = source.cloth(&source.draft().drawdown().unwrap()).unwrap();
        let material = Material::cloth(source.shader(&material).unwrap());
        for (lights, level) in [
            (narrow.to_vec(), Level::Near),
            ([narrow.as_slice(), &[lamp(), sky.clone()]].concat(), Level::Near),
            (narrow[..1].to_vec(), Level::Near),
            (narrow.to_vec(), Level::Far),
        ] {
            assert!(lights[0].is_narrow());
            let mut scene = scene_of(vec![cloth(material.clone())], lights);
            scene.detail.level = level;
            let (expected, deviation) = mean(&scene, 256);
            for (estimator, spp) in [(Estimator::Lights, 256), (Estimator::Directions, 1024)] {
                scene.estimator = estimator;
                let (found, other) = mean(&scene, spp);
                let difference = (found - expected).abs();
                let bound = 4.0 * (deviation.powf(2.0) + other.powf(2.0)).map(f64::sqrt);
                assert!(
                    difference.cmple(bound).all() && bound.cmplt(0.7 * expected).all(),
                    "{name}, {level:?}, {estimator:?}: {found}, expected {expected} within {bound}"
                );
            }
        }
    }
}

/// The only light, which is drawn several times where a pixel hardly sees more than one thread.
#[test]
fn lamp_alone_is_found_by_every_way() {
    for name in ["cotton-gauze", "denim", "silk-charmeuse"] {
        let source = fabric::read(format!("preset:{name}").as_ref()).unwrap();
        let material = source.cloth(&source.draft().drawdown().unwrap()).unwrap();
        let mut scene =
            scene_of(vec![cloth(Material::cloth(source.shader(&material).unwrap()))], vec![lamp()]);
        scene.detail.level = Level::Near;
        for fov in [0.005, 0.04] {
            scene.camera.horizontal_fov = fov;
            scene.estimator = Estimator::Directions;
            let (expected, deviation) = mean(&scene, 1024);
            for estimator in [Estimator::Both, Estimator::Lights] {
                scene.estimator = estimator;
                let (found, other) = mean(&scene, 256);
                let difference = (found - expected).abs();
                let bound = 4.0 * (deviation.powf(2.0) + other.powf(2.0)).map(f64::sqrt);
                assert!(
                    difference.cmple(bound).all() && bound.cmplt(0.4 * expected).all(),
                    "{name}, {fov} rad, {estimator:?}: {found}, expected {expected} within {bound}"
                );
            }
        }
    }
}
