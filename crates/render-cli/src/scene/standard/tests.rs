use std::f32::consts::TAU;

use image::{DynamicImage, ImageBuffer, Rgb};
use rayon::prelude::*;

use super::*;
use crate::{
    chi_square::{Cap, DRAWS, Random},
    scene::texture::Encoding,
};

/// Constant parameters.
#[derive(Clone, Copy, Debug)]
struct Case {
    ground: f32,
    normal: Vec3,
    roughness: f32,
    specular: f32,
    anisotropy: f32,
}

const PLASTIC: Case =
    Case { ground: 0.5, normal: Vec3::Z, roughness: 0.5, specular: 0.04, anisotropy: 0.0 };

impl Case {
    fn point(self) -> StandardPoint {
        let constant = |value: f32| Input::Constant(Vec3::splat(value));
        let standard = Standard {
            base_color: constant(self.ground),
            normal: Input::Constant(0.5 * (self.normal + 1.0)),
            roughness: constant(self.roughness),
            specular: constant(self.specular),
            anisotropy: constant(self.anisotropy),
        };
        standard.at(Vec2::ZERO, [Vec2::ZERO; 2])
    }
}

fn direction(cos: f32, azimuth: f32) -> Vec3 {
    (Vec2::from_angle(azimuth) * (1.0 - cos * cos).max(0.0).sqrt()).extend(cos)
}

/// ∫ f cos θi dwi where the normal is the shading normal: of the facets by the weights of samples, of
/// the ground by the midpoint rule over the cosine, where it is smooth.
fn albedo(point: &StandardPoint, wo: Vec3, n: usize) -> f32 {
    let facets = StandardPoint { ground: Vec3::ZERO, ..*point };
    let weights = (0..n * n).filter_map(|k| {
        let [x, y] = [k % n, k / n].map(|k| (k as f32 + 0.5) / n as f32);
        facets.sample(wo, [0.0, x, y])
    });
    let mirrored = weights.map(|sample| sample.weight.x).sum::<f32>() / (n * n) as f32;
    let cosines = (0..n * n).map(|k| (k as f32 + 0.5) / (n * n) as f32);
    let scattered = cosines.map(|cos| point.scattered(cos, wo.z).x * cos).sum::<f32>();
    mirrored + TAU * scattered / (n * n) as f32
}

const ROUGHNESSES: [f32; 10] = [0.0, 0.02, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0];
const COSINES: [f32; 11] = [0.01, 0.03, 0.07, 0.12, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0];

#[test]
fn white_furnace_is_never_above_one() {
    for (roughness, cos) in ROUGHNESSES.into_iter().flat_map(|r| COSINES.map(|cos| (r, cos))) {
        for specular in [0.0, 0.003, 0.01, 0.02, 0.04, 0.3, 1.0] {
            for anisotropy in [-1.0, -0.8, -0.4, 0.0, 0.2, 0.6, 0.9] {
                let case = Case { ground: 1.0, roughness, specular, anisotropy, ..PLASTIC };
                for azimuth in [0.0, 0.4, 0.9, 1.5] {
                    let albedo = albedo(&case.point(), direction(cos, azimuth), 24);
                    let told = format!("{case:?} at {cos}, {azimuth}: {albedo}");
                    assert!((0.0..=1.0002).contains(&albedo), "{told}, expected at most 1");
                }
            }
        }
    }
}

#[test]
fn white_furnace_with_a_tilted_normal_is_never_above_one() {
    let mut random = Random(5);
    for normal in [Vec3::new(0.5, -0.3, 0.8), Vec3::new(-0.9, 0.4, 0.2), Vec3::X] {
        for roughness in [0.1, 0.5, 1.0] {
            let point = Case { ground: 1.0, normal, roughness, ..PLASTIC }.point();
            for cos in COSINES {
                let wo = direction(cos, random.number() * TAU);
                let n = 20_000;
                let (mut sum, mut square) = (0.0, 0.0);
                for _ in 0..n {
                    let xi = [random.number(), random.number(), random.number()];
                    let weight = point.sample(wo, xi).map_or(0.0, |sample| sample.weight.x);
                    sum += weight / n as f32;
                    square += weight * weight / n as f32;
                }
                let error = ((square - sum * sum) / n as f32).max(0.0).sqrt();
                let told = format!("{normal} {roughness} from {wo}: {sum} ± {error}");
                assert!(sum >= 0.0 && sum <= 1.001 + 4.0 * error, "{told}, expected at most 1");
            }
        }
    }
}

#[test]
fn white_ground_under_a_coat_loses_little() {
    let mut worst = f32::INFINITY;
    for (roughness, most) in [(0.02, 0.007), (0.3, 0.012), (0.5, 0.026), (0.7, 0.037), (1.0, 0.049)]
    {
        let point = Case { ground: 1.0, roughness, ..PLASTIC }.point();
        let n = 40;
        let mut lost = 0.0;
        for k in 0..n {
            let cos = (k as f32 + 0.5) / n as f32;
            let albedo = albedo(&point, direction(cos, 0.3), 32);
            lost += 2.0 * cos * (1.0 - albedo) / n as f32;
            worst = worst.min(albedo);
        }
        assert!((0.0..most).contains(&lost), "{roughness}: {lost}, expected at most {most}");
    }
    assert!(worst > 0.8, "{worst}");
}

#[test]
fn mirrors_lose_what_goes_to_and_fro() {
    for (roughness, cos, expected) in [
        (0.02, 1.0, 1.0),
        (0.02, 0.1, 1.0),
        // From a quadrature of its own, over visible normals.
        (0.5_f32.sqrt(), 1.0, 0.688),
        (0.5_f32.sqrt(), 0.3, 0.745),
        (1.0, 1.0, 0.307),
        (1.0, 0.1, 0.760),
    ] {
        let mirror = Case { ground: 0.0, specular: 1.0, roughness, ..PLASTIC }.point();
        let found = albedo(&mirror, direction(cos, 0.0), 64);
        assert!((found - expected).abs() < 2e-3, "{roughness} {cos}: {found}, expected {expected}");
    }
}

#[test]
fn ground_without_coat_is_lambertian() {
    let point = Case { specular: 0.0, ..PLASTIC }.point();
    for (wi, wo) in [(Vec3::Z, Vec3::Z), (direction(0.1, 0.3), direction(0.5, 2.0))] {
        for (wi, wo) in [(wi, wo), (-wi, -wo)] {
            assert!(point.eval(wi, wo).abs_diff_eq(Vec3::splat(0.5 * FRAC_1_PI), 1e-7));
            assert!((point.pdf(wi, wo) - wi.z.abs() * FRAC_1_PI).abs() < 1e-6);
        }
        assert_eq!(point.eval(-wi, wo), Vec3::ZERO);
        assert_eq!(point.pdf(wi, -wo), 0.0);
    }
}

#[test]
fn directions_follow_their_density() {
    let tilted = Vec3::new(0.4, -0.3, 0.8).normalize();
    let mut cases = vec![];
    for wo in [direction(1.0, 0.0), direction(0.7, 0.4), direction(0.1, 2.0), direction(0.01, -1.0)]
    {
        for (roughness, anisotropy) in
            [(0.02, 0.0), (0.2, 0.8), (0.5, -1.0), (0.8, 0.0), (1.0, 0.5)]
        {
            for normal in [Vec3::Z, tilted] {
                let specular = if roughness == 0.5 { 1.0 } else { 0.04 };
                cases.push((Case { normal, roughness, anisotropy, specular, ..PLASTIC }, wo));
            }
        }
    }
    cases.push((PLASTIC, direction(-0.5, 1.0)));
    cases.push((Case { normal: tilted, ..PLASTIC }, direction(-0.1, 4.0)));
    // Šidák: as unlikely as 1 % over all tests together.
    let level = 1.0 - 0.99_f64.powf(0.5 / cases.len() as f64);
    cases.into_par_iter().enumerate().for_each(|(seed, (case, wo))| {
        let point = case.point();
        let mut random = Random(seed as u64);
        let mut mirrored = |_| point.sample(wo, [0.0, random.number(), random.number()]);
        let pilot: Vec<_> = (0..4000).filter_map(&mut mirrored).map(|sample| sample.wi).collect();
        let draw = |random: &mut Random| {
            let xi = [random.number(), random.number(), random.number()];
            point.sample(wo, xi).map(|sample| sample.wi)
        };
        // Around the mirror image; all around, where cells resolve the lobe.
        let mut caps = vec![];
        caps.extend((case.roughness >= 0.5).then_some(Cap::SPHERE));
        // Of a place seen from behind its normal, none is above the surface.
        caps.extend((pilot.len() > 1000).then(|| Cap::around(&pilot, 0.9)));
        for cap in caps {
            let densities = |all: &[Vec3]| all.iter().map(|wi| point.pdf(*wi, wo)).collect();
            let fit = cap.fit(&mut random, draw, densities);
            let told = format!("{case:?} from {wo}, {cap:?}: {fit:?}");
            assert!(fit.p_value > level, "{told}, expected p above {level:.1e}");
            assert!(fit.integral < 1.0 + 1e-4 + 4.0 * fit.error && fit.error < 2e-2, "{told}");
            let deviation = (0.25 / DRAWS as f64).sqrt() + fit.error;
            assert!((fit.integral - fit.share).abs() < 5.0 * deviation, "{told}");
            assert!(fit.share > 0.01, "{told}");
        }
    });
}

#[test]
fn samples_weigh_what_they_reflect() {
    let mut random = Random(7);
    for roughness in ROUGHNESSES {
        let normal = Vec3::new(0.2, 0.1, 1.0).normalize();
        let point = Case { normal, roughness, anisotropy: 0.5, ..PLASTIC }.point();
        for wo in [direction(0.9, 1.0), direction(0.05, 2.0), direction(-0.4, 3.0)] {
            for _ in 0..500 {
                let xi = [random.number(), random.number(), random.number()];
                let Some(sample) = point.sample(wo, xi) else { continue };
                let Sample { wi, weight, pdf } = sample;
                let told = format!("{roughness} {wo} {sample:?}");
                assert!((wi.length() - 1.0).abs() < 1e-5 && wi.z * wo.z > 0.0, "{told}");
                assert!(weight.max_element() < 4.0, "{told}");
                assert!((point.pdf(wi, wo) / pdf - 1.0).abs() < 2e-3, "{told}");
                let expected = point.eval(wi, wo) * wi.z.abs() / pdf;
                assert!(weight.abs_diff_eq(expected, 2e-3 * weight.max_element()), "{told}");
            }
        }
    }
}

#[test]
fn light_may_go_either_way() {
    let mut random = Random(3);
    for roughness in ROUGHNESSES {
        for normal in [Vec3::Z, Vec3::new(0.2, 0.1, 1.0).normalize()] {
            let case = Case { normal, roughness, specular: 0.2, anisotropy: -0.7, ..PLASTIC };
            let point = case.point();
            for _ in 0..500 {
                let mut any = || direction(random.number().max(1e-3), TAU * random.number());
                let (a, b) = (any(), any());
                // Seen from behind its normal, the surface leans towards the viewer.
                let [cos_a, cos_b] = [a, b].map(|w| w.dot(normal));
                if cos_a < LEAST_COSINE || cos_b < LEAST_COSINE {
                    continue;
                }
                let there = point.eval(a, b) * (a.z / cos_a);
                let back = point.eval(b, a) * (b.z / cos_b);
                let tolerance = 1e-4 * there.max_element();
                assert!(there.abs_diff_eq(back, tolerance), "{case:?} {a} {b}: {there}, {back}");
            }
        }
    }
}

#[test]
fn pictures_give_the_parameters_at_a_place() {
    let texture = |left: [u8; 3], right: [u8; 3], encoding| {
        let pixel = |x, _| Rgb(if x == 0 { left } else { right });
        let image = DynamicImage::ImageRgb8(ImageBuffer::from_fn(2, 1, pixel));
        Input::Texture(Arc::new(MipTexture::new(&image, encoding).unwrap()))
    };
    let standard = Standard {
        base_color: texture([255, 0, 0], [0, 0, 188], Encoding::Srgb),
        normal: texture([128, 128, 255], [255, 128, 128], Encoding::Linear),
        roughness: texture([255; 3], [51; 3], Encoding::Linear),
        specular: texture([0; 3], [255; 3], Encoding::Linear),
        anisotropy: texture([0; 3], [255; 3], Encoding::Linear),
    };
    let [left, right] = [0.25, 0.75].map(|u| standard.at(Vec2::new(u, 0.5), [Vec2::ZERO; 2]));
    assert!(left.ground.abs_diff_eq(Vec3::X, 1e-6), "{left:?}");
    assert!(right.ground.abs_diff_eq(0.5029 * Vec3::Z, 1e-4), "{right:?}");
    assert!(left.normal.abs_diff_eq(Vec3::Z, 0.006), "{left:?}");
    // On its side, and so kept above the surface.
    assert!(right.normal.x > 0.99 && right.normal.z >= 0.0039, "{right:?}");
    // Black is −1.
    assert_eq!(left.facets, Ggx::new(1.0, -1.0));
    assert_eq!(right.facets, Ggx::new(0.2, 1.0));
    assert_eq!((left.specular, left.grazing), (Vec3::ZERO, Vec3::ZERO));
    assert_eq!((right.specular, right.grazing), (Vec3::ONE, Vec3::ZERO));
}

#[test]
fn brushed_metal_shines_across_its_grooves() {
    let point = Case { ground: 0.0, specular: 1.0, anisotropy: 1.0, ..PLASTIC }.point();
    let wo = direction(1.0, 0.0);
    let along_u = point.eval(direction(0.9, 0.0), wo).x;
    let along_v = point.eval(direction(0.9, 0.25 * TAU), wo).x;
    assert!(along_u > 3.0 * along_v, "{along_u}, {along_v}: rougher along u");
}

#[test]
fn values_are_finite_whatever_is_asked() {
    let values = [0.0, 1e-30, 1e-4, 0.5, 1.0, 5.0, -3.0, f32::INFINITY, f32::NAN];
    let mut directions = vec![Vec3::NAN, Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::NEG_Z];
    directions.extend([1e-38, 1e-20, 1e-6, 1e-3, -1e-3].map(|z| Vec3::new(0.6, -0.8, z)));
    directions.extend([1e-38, 1e-6, 0.3].map(|z| Vec3::new(-0.6, 0.8, z).normalize()));
    for (roughness, specular) in values.into_iter().flat_map(|r| values.map(|s| (r, s))) {
        for normal in [Vec3::Z, Vec3::X, Vec3::NEG_Z, Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            let case = Case { normal, roughness, specular, anisotropy: specular, ..PLASTIC };
            let point = case.point();
            for &wo in &directions {
                for &wi in &directions {
                    let (f, pdf) = (point.eval(wi, wo), point.pdf(wi, wo));
                    let told = format!("{case:?} {wi} {wo}: {f}, {pdf}");
                    assert!(f.is_finite() && f.cmpge(Vec3::ZERO).all(), "{told}");
                    assert!(pdf.is_finite() && pdf >= 0.0, "{told}");
                }
                for xi in [[0.0; 3], [0.99; 3], [0.0, 0.5, 1.0], [0.0, 1.0, 0.0]] {
                    let Some(sample) = point.sample(wo, xi) else { continue };
                    let Sample { wi, weight, pdf } = sample;
                    let told = format!("{case:?} {wo} {xi:?}: {sample:?}");
                    assert!(wi.is_finite() && weight.is_finite() && pdf > 0.0, "{told}");
                    assert!(
                        weight.cmpge(Vec3::ZERO).all() && weight.max_element() < 20.0,
                        "{told}"
                    );
                }
            }
        }
    }
}
