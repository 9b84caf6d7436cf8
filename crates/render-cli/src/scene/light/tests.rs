use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec2;

use super::*;
use crate::{
    chi_square::{Cap, Random},
    scene::drape::RectangleLight,
};

fn quad(centre: Vec3, half_u: Vec3, half_v: Vec3) -> Light {
    let shape = RectangleLight { centre, half_u, half_v };
    Light::Quad(Quad::new(shape, Vec3::new(2.0, 1.0, 0.5)))
}

fn sphere(centre: Vec3, radius: f32) -> Light {
    Light::Sphere(Sphere { centre, radius, radiance: Vec3::new(2.0, 1.0, 0.5) })
}

fn distant(angular_diameter: f32) -> Light {
    let towards = Vec3::new(1.0, -2.0, 2.0) / 3.0;
    Light::Distant(Distant::new(towards, Vec3::new(2.0, 1.0, 0.5), angular_diameter))
}

/// A dim gradient with a bright spot that is dark in its middle.
fn environment() -> Light {
    let [width, height] = [24, 12];
    let pixels = (0..width * height).map(|k| match [k % width, k / width] {
        [8, 3] | [8, 5] | [7, 4] | [9, 4] => Vec3::new(30.0, 25.0, 20.0),
        [8, 4] => Vec3::ZERO,
        [x, y] => Vec3::new(0.1 + 0.02 * x as f32, 0.5, 0.05 * y as f32),
    });
    let pixels = pixels.collect();
    Light::Environment(Environment::new(pixels, [width, height], 0.7, 1.5).unwrap())
}

/// Lights seen from the origin: near and far, flat, grazing, tiny and around.
fn lights() -> Vec<Light> {
    let (x, y) = (Vec3::X, Vec3::Y);
    vec![
        quad(Vec3::Z, y, x),
        quad(0.01 * Vec3::Z, y, x),
        quad(Vec3::new(1.5, -1.5, 3.0), Vec3::new(0.3, 0.3, 0.0), Vec3::new(0.3, -0.3, -0.3)),
        quad(Vec3::new(1.2, 0.3, 0.05), y, x),
        quad(Vec3::new(0.0, 0.0, 0.5), 0.05 * y, 1.5 * x),
        quad(Vec3::new(0.4, 0.2, -0.5), 0.5 * x, Vec3::new(0.0, 0.3, 0.4)),
        quad(Vec3::new(30.0, 0.0, 40.0), 0.1 * y, 0.2 * x),
        sphere(Vec3::new(0.0, 0.0, 2.0), 0.5),
        sphere(Vec3::new(0.6, 0.0, 0.8), 0.999),
        sphere(Vec3::new(30.0, 0.0, 40.0), 0.1),
        distant(0.00925),
        distant(1.0),
        distant(PI),
        Light::Constant(Constant { radiance: Vec3::ONE }),
        environment(),
    ]
}

fn direction(light: &Light, random: &mut Random) -> Option<Vec3> {
    light.sample(Vec3::ZERO, &random.square().into()).map(|sample| sample.direction)
}

#[test]
fn directions_follow_their_density() {
    let lights = lights();
    // Šidák: as unlikely as 1 % over all lights together.
    let level = 1.0 - 0.99_f64.powf(1.0 / lights.len() as f64);
    for (seed, light) in lights.iter().enumerate() {
        let mut random = Random(seed as u64);
        let pilot: Vec<_> = (0..4000).map(|_| direction(light, &mut random).unwrap()).collect();
        let cap = Cap::around(&pilot, 1.0);
        let density = |w| light.ahead(Vec3::ZERO, w).map_or(0.0, |ahead| ahead.density);
        let densities = |all: &[Vec3]| all.iter().copied().map(density).collect();
        let fit = cap.fit(&mut random, |random| direction(light, random), densities);
        assert!(fit.p_value > level, "{light:?}: {fit:?}, expected p above {level:.1e}");
        let tolerance = 1e-5 + 4.0 * fit.error;
        assert!(fit.error < 2e-3 && fit.share == 1.0, "{light:?}: {fit:?}");
        assert!((fit.integral - 1.0).abs() < tolerance, "{light:?}: {fit:?}, expected 1");
    }
}

#[test]
fn light_ahead_of_a_sample_is_the_sample() {
    let mut random = Random(1);
    for light in lights() {
        // Borders of what a light looks like belong to neither side.
        let squares = (0..200).map(|_| 0.001 + 0.998 * random.square());
        for square in squares {
            let sample = light.sample(Vec3::ZERO, &square.into()).unwrap();
            let ahead = light.ahead(Vec3::ZERO, sample.direction).unwrap();
            let close = |a: f32, b: f32| a == b || (a / b - 1.0).abs() < 1e-4;
            let told = format!("{light:?} at {square}: {sample:?}, {ahead:?}");
            assert!(close(ahead.density, sample.density), "{told}");
            assert!(close(ahead.distance, sample.distance), "{told}");
            assert!((sample.direction.length() - 1.0).abs() < 1e-6, "{told}");
            let radiance = sample.irradiance * sample.density;
            let tolerance = 1e-4 * radiance.max_element();
            assert!(radiance.abs_diff_eq(ahead.radiance, tolerance), "{told}");
        }
    }
}

/// Irradiance at the origin on a surface with this normal.
fn irradiance(light: &Light, normal: Vec3) -> Vec3 {
    let n = 256;
    let squares = (0..n * n).map(|k| (Vec2::new((k % n) as f32, (k / n) as f32) + 0.5) / n as f32);
    let samples = squares.filter_map(|square| light.sample(Vec3::ZERO, &square.into()));
    let sum: Vec3 =
        samples.map(|sample| sample.irradiance * sample.direction.dot(normal).max(0.0)).sum();
    sum / (n * n) as f32
}

#[test]
fn irradiance_has_its_closed_form() {
    // A rectangle x by y at height h over its corner: E/L = ½ (x/√(x² + h²) atan(y/√(x² + h²)) and
    // the same with x and y changed) (the configuration factor times π).
    let corner = |x: f32, y: f32, h: f32| {
        let term = |x: f32, y: f32| x / x.hypot(h) * (y / x.hypot(h)).atan();
        0.5 * (term(x, y) + term(y, x))
    };
    let rectangle = |x: f32, y: f32, h: f32| {
        let (half_u, half_v) = (Vec3::Y * (0.5 * y), Vec3::X * (0.5 * x));
        (quad(Vec3::new(0.5 * x, 0.5 * y, h), half_u, half_v), Vec3::Z, corner(x, y, h))
    };
    let towards = Vec3::new(1.0, -2.0, 2.0) / 3.0;
    let cases = [
        rectangle(2.0, 1.0, 1.0),
        rectangle(1.0, 1.0, 0.01),
        rectangle(0.01, 3.0, 0.5),
        rectangle(1.0, 1.0, 20.0),
        // Above the horizon wholly: π sin² cos.
        (sphere(Vec3::new(0.0, 1.2, 1.6), 0.5), Vec3::Z, PI / 16.0 * 0.8),
        (sphere(Vec3::new(0.0, 0.0, 1.001), 1.0), Vec3::Z, PI / (1.001 * 1.001)),
        (distant(0.0), Vec3::Z, towards.z),
        (distant(0.01), Vec3::Z, towards.z),
        (distant(PI), towards, 1.0),
        (Light::Constant(Constant { radiance: Vec3::ONE }), Vec3::Z, PI),
    ];
    for (light, normal, expected) in cases {
        let found = irradiance(&light, normal).y;
        assert!((found / expected - 1.0).abs() < 1e-3, "{light:?}: {found}, expected {expected}");
    }
}

#[test]
fn power_is_what_the_lights_send() {
    let square = quad(Vec3::Z, Vec3::Y, Vec3::X);
    let constant = Light::Constant(Constant { radiance: Vec3::ONE });
    let white = Environment::new(vec![Vec3::ONE; 8], [4, 2], 0.0, 1.0).unwrap();
    let luminance = crate::image::luminance(Vec3::new(2.0, 1.0, 0.5));
    for (light, expected) in [
        (square, 4.0 * PI * luminance),
        (sphere(Vec3::ZERO, 0.5), PI * PI * luminance),
        (distant(0.0), 9.0 * PI * luminance),
        (constant, 36.0 * PI * PI),
        (Light::Environment(white), 36.0 * PI * PI),
    ] {
        let found = light.power(3.0);
        assert!((found / expected - 1.0).abs() < 1e-5, "{light:?}: {found}, expected {expected}");
    }
}

#[test]
fn lights_shine_to_one_side() {
    let square = quad(Vec3::Z, Vec3::Y, Vec3::X);
    let ball = sphere(Vec3::Z, 0.5);
    let middle = Vec2::splat(0.5);
    for (light, position) in [
        (&square, 2.0 * Vec3::Z),
        (&square, Vec3::Z),
        (&square, Vec3::new(3.0, 0.0, 1.0)),
        (&ball, Vec3::Z),
        (&ball, Vec3::new(0.1, 0.0, 1.3)),
        (&ball, 1.5 * Vec3::Z),
    ] {
        assert_eq!(light.sample(position, &middle.into()), None, "{light:?} from {position}");
        for direction in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_Z] {
            assert_eq!(light.ahead(position, direction), None, "{light:?} from {position}");
        }
    }
    assert!(square.ahead(Vec3::ZERO, Vec3::NEG_Z).is_none());
    assert!(ball.ahead(Vec3::ZERO, Vec3::NEG_Z).is_none());
}

#[test]
fn single_direction_is_found_by_sampling_alone() {
    // The second is narrower than a density that f32 can tell.
    for light in [distant(0.0), distant(1e-25)] {
        let sample = light.sample(Vec3::ONE, &Vec2::splat(0.3).into()).unwrap();
        assert_eq!(sample.density, f32::INFINITY);
        assert_eq!(sample.irradiance, Vec3::new(2.0, 1.0, 0.5));
        assert_eq!(light.ahead(Vec3::ONE, sample.direction), None);
    }
}

#[test]
fn extremes_are_finite_or_nothing() {
    let (x, y) = (Vec3::X, Vec3::Y);
    let mut lights = lights();
    for size in [0.0, 1e-30, 1e-10, 1e10, 1e18] {
        for distance in [1e-30, 1e-6, 1.0, 1e6, 1e18] {
            lights.push(quad(distance * Vec3::Z, size * y, size * x));
            lights.push(quad(Vec3::new(1.5, 0.0, distance), y, x * size));
            lights.push(sphere(distance * Vec3::Z, size));
        }
    }
    lights.push(distant(f32::NAN));
    lights.push(Light::Distant(Distant::new(Vec3::ZERO, Vec3::ONE, 0.1)));
    let values = [0.0, 1e-7, 0.5, 1.0 - 1e-7, 1.0];
    for light in &lights {
        for position in [Vec3::ZERO, Vec3::new(0.3, 1.0, 1e-20), Vec3::splat(-1e15)] {
            for square in values.into_iter().flat_map(|x| values.map(|y| Vec2::new(x, y))) {
                let Some(sample) = light.sample(position, &square.into()) else { continue };
                let told = format!("{light:?} from {position}: {sample:?}");
                assert!(sample.direction.is_finite() && sample.irradiance.is_finite(), "{told}");
                assert!(sample.density > 0.0 && sample.distance > 0.0, "{told}");
                if let Some(ahead) = light.ahead(position, sample.direction) {
                    assert!(ahead.density > 0.0 && ahead.distance > 0.0, "{told}, {ahead:?}");
                }
            }
        }
        let nan = Vec3::new(0.0, f32::NAN, 0.0);
        assert_eq!(light.sample(nan, &Vec2::splat(0.5).into()), None);
        assert_eq!(light.sample(Vec3::ZERO, &Vec2::new(f32::NAN, 0.5).into()), None);
        assert_eq!(light.ahead(nan, Vec3::Z), None);
        assert_eq!(light.ahead(Vec3::ZERO, nan), None);
    }
}

#[test]
fn distance_to_a_grazed_ball_is_that_of_its_rim() {
    let ball = sphere(Vec3::new(0.0, 0.0, 2.0), 1.0);
    let rim = Vec3::new(0.5, 0.0, 0.75_f32.sqrt());
    let inside = (rim - 1e-4 * Vec3::X).normalize();
    let ahead = ball.ahead(Vec3::ZERO, inside).unwrap();
    // The tangent has the length √(2² − 1).
    assert!((ahead.distance - 3.0_f32.sqrt()).abs() < 0.03, "{ahead:?}");
    assert_eq!(ball.ahead(Vec3::ZERO, (rim + 1e-4 * Vec3::X).normalize()), None);
    let straight = ball.ahead(Vec3::ZERO, Vec3::Z).unwrap();
    assert!((straight.distance - 1.0).abs() < 1e-6, "{straight:?}");
    assert!((straight.density * 2.0 * PI * (1.0 - (FRAC_PI_2 / 3.0).cos()) - 1.0).abs() < 1e-5);
}
