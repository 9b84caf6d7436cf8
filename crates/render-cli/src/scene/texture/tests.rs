use image::{ImageBuffer, Luma, LumaA, Rgb, RgbaImage};

use super::*;

const POINT: [Vec2; 2] = [Vec2::ZERO; 2];

fn floats(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> MipTexture {
    let image = ImageBuffer::from_fn(width, height, |x, y| Rgb([value(x, y), 0.5, 1.0]));
    MipTexture::new(&DynamicImage::ImageRgb32F(image), Encoding::Linear).unwrap()
}

fn bytes(width: u32, height: u32, value: impl Fn(u32, u32) -> u8) -> MipTexture {
    let image = ImageBuffer::from_fn(width, height, |x, y| Luma([value(x, y)]));
    MipTexture::new(&DynamicImage::ImageLuma8(image), Encoding::Srgb).unwrap()
}

/// Evenly spread numbers in [0, 1).
fn noise(x: u32, y: u32) -> f32 {
    let hash =
        (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77)).wrapping_mul(0xc2b2_ae3d);
    ((hash ^ (hash >> 15)).wrapping_mul(0x27d4_eb2f) >> 8) as f32 / (1 << 24) as f32
}

#[test]
fn every_level_has_the_mean_of_the_picture() {
    for (width, height) in [(1, 1), (2, 1), (3, 5), (7, 7), (16, 16), (31, 100), (100, 3)] {
        let texture = floats(width, height, noise);
        let mut mean = 0.0;
        for k in 0..width * height {
            mean += noise(k % width, k / width) / (width * height) as f32;
        }
        for level in &texture.levels {
            let Level { width, height, .. } = *level;
            let texels = (0..width * height)
                .map(|k| texture.color(3 * k, |index| texture.component(level, index)));
            let found = texels.sum::<Vec3>() / (width * height) as f32;
            let expected = Vec3::new(mean, 0.5, 1.0);
            assert!(found.abs_diff_eq(expected, 1e-5), "{texture:?} {width} × {height}: {found}");
        }
        let last = texture.levels.last().unwrap();
        assert_eq!([last.width, last.height], [1, 1]);
    }
}

#[test]
fn bytes_lose_no_light_to_rounding() {
    // A step of sRGB is at most 0.009 wide in linear light, near white.
    let decode = |byte: u8| Encoding::Srgb.decode(f32::from(byte) / 255.0);
    let value = |x, y| (255.0 * noise(x, y)) as u8;
    let texture = bytes(64, 48, value);
    let mean = (0..64 * 48).map(|k| decode(value(k % 64, k / 64))).sum::<f32>() / (64.0 * 48.0);
    let found = texture.value(Vec2::ZERO, [Vec2::X, Vec2::Y]).x;
    assert!((found - mean).abs() < 0.005, "{found}, expected {mean}");
    for byte in 0..=255 {
        let even = bytes(6, 5, |_, _| byte);
        for width in [0.0, 0.1, 0.5, 10.0] {
            let found = even.value(Vec2::new(0.3, 0.8), [width * Vec2::X, width * Vec2::Y]).x;
            assert!((found - decode(byte)).abs() < 1e-6, "{byte}: {found}");
        }
    }
}

#[test]
fn checks_fade_to_the_grey_that_reflects_as_much() {
    let checks = bytes(32, 32, |x, y| if (x + y) % 2 == 0 { 255 } else { 0 });
    let step = 2.0 / 32.0;
    let found = checks.value(Vec2::splat(0.37), [step * Vec2::X, step * Vec2::Y]).x;
    // sRGB 188 is 0.5029.
    assert!((found - 0.5029).abs() < 1e-4, "{found}");
    assert_eq!(checks.levels[1].texels, Texels::Bytes(vec![188; 256]));
}

#[test]
fn u_runs_right_and_v_up_and_both_repeat() {
    let texture = floats(4, 2, |x, y| (x + 10 * y) as f32);
    let centre = |x: f32, row: f32| Vec2::new((x + 0.5) / 4.0, 1.0 - (row + 0.5) / 2.0);
    for (x, row, expected) in [(0.0, 0.0, 0.0), (3.0, 0.0, 3.0), (1.0, 1.0, 11.0)] {
        for turn in [Vec2::ZERO, Vec2::new(-2.0, 1.0), Vec2::new(1000.0, -1000.0)] {
            let found = texture.value(centre(x, row) + turn, POINT).x;
            assert!((found - expected).abs() < 1e-2, "{x} {row} {turn}: {found}");
        }
    }
    // Between texels, and over the seam.
    let middle = texture.value(Vec2::new(0.25, 0.75), POINT).x;
    assert!((middle - 0.5).abs() < 1e-5, "{middle}");
    for seam in [0.0, 1.0, -1e-9, 1.0 - 1e-7] {
        let found = texture.value(Vec2::new(seam, 0.75), POINT).x;
        assert!((found - 1.5).abs() < 1e-4, "{seam}: {found}");
        let found = texture.value(Vec2::new(0.125, seam), POINT).x;
        assert!((found - 5.0).abs() < 1e-4, "{seam}: {found}");
    }
}

#[test]
fn levels_blend_without_a_jump() {
    let texture = floats(64, 64, noise);
    let uv = Vec2::new(0.31, 0.62);
    let at = |exponent: f32| {
        let width = (0.01 * exponent).exp2() / 64.0;
        texture.value(uv, [width * Vec2::X, width * Vec2::Y]).x
    };
    for exponent in -100..700 {
        let (a, b) = (at(exponent as f32), at(exponent as f32 + 1.0));
        assert!((a - b).abs() < 0.012, "2^{exponent}/100: {a}, then {b}");
    }
}

#[test]
fn value_is_near_the_mean_over_the_footprint() {
    // A wave along an oblique direction under a footprint that is as oblique: sharp across, blurred
    // along.
    let (cycles, side) = (16.0, 256);
    let wave = |x: f32, y: f32| 0.5 + 0.5 * (std::f32::consts::TAU * cycles * (x + y)).sin();
    let coordinate = |k: u32| (k as f32 + 0.5) / side as f32;
    let texture = floats(side, side, |x, y| wave(coordinate(x), 1.0 - coordinate(y)));
    let along = Vec2::new(1.0, -1.0) * (8.0 / 256.0);
    let across = Vec2::new(1.0, 1.0) * (2.0 / 256.0);
    let contrast = |footprint: [Vec2; 2]| {
        let values = (0..64).map(|k| texture.value(Vec2::new(k as f32 / 256.0, 0.4), footprint).x);
        let (low, high) = values.fold((1.0_f32, 0.0_f32), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    let long = contrast([along, across]);
    assert!(long > 0.6, "{long}: blurred across the wave");
    // The same ellipse from other vectors.
    let turned = Vec2::from_angle(0.7);
    let mixed = [along * turned.x + across * turned.y, across * turned.x - along * turned.y];
    let same = contrast(mixed);
    assert!((same - long).abs() < 1e-3, "{same}, expected {long}");
    // Long across the wave.
    let wide = contrast([along.perp(), across.perp()]);
    assert!(wide < 0.2, "{wide}");
}

#[test]
fn texels_take_the_bytes_of_their_picture() {
    let full = 64 * 64 * 4 / 3;
    let image = |image: DynamicImage| MipTexture::new(&image, Encoding::Linear).unwrap().bytes();
    let grey_alpha = ImageBuffer::from_pixel(64, 64, LumaA([7, 0]));
    for (found, size) in [
        (bytes(64, 64, |_, _| 0).bytes(), 1),
        (image(DynamicImage::ImageLumaA8(grey_alpha)), 1),
        (image(DynamicImage::ImageRgba8(RgbaImage::new(64, 64))), 3),
        (image(DynamicImage::ImageLuma16(ImageBuffer::new(64, 64))), 4),
        (floats(64, 64, |_, _| 0.0).bytes(), 12),
    ] {
        let expected = size * full + 1024;
        assert!(found.abs_diff(expected) < 16, "{found}, expected {expected}");
    }
}

#[test]
fn sixteen_bits_mean_the_same_as_eight() {
    for encoding in [Encoding::Srgb, Encoding::Linear] {
        for byte in [0_u8, 5, 100, 255] {
            let eight = DynamicImage::ImageRgb8(ImageBuffer::from_pixel(2, 2, Rgb([byte; 3])));
            let wide = ImageBuffer::from_pixel(2, 2, Rgb([u16::from(byte) * 257; 3]));
            let sixteen = DynamicImage::ImageRgb16(wide);
            let [a, b] = [eight, sixteen]
                .map(|image| MipTexture::new(&image, encoding).unwrap().value(Vec2::ZERO, POINT));
            assert!(a.abs_diff_eq(b, 1e-6), "{encoding:?} {byte}: {a}, {b}");
        }
    }
}

#[test]
fn lookups_are_finite_whatever_is_asked() {
    let texture = floats(9, 4, noise);
    let values = [0.0, -0.0, 1e-40, 0.3, -7.5, 1e10, -1e38, f32::INFINITY, f32::NAN];
    for u in values {
        for v in values {
            for step in values {
                for other in values {
                    let footprint = [Vec2::new(step, other), Vec2::new(other, u)];
                    let found = texture.value(Vec2::new(u, v), footprint);
                    let is_sound = found.x >= 0.0 && found.x <= 1.0 && found.is_finite();
                    assert!(is_sound, "{u} {v} {footprint:?}: {found}");
                }
            }
        }
    }
}

#[test]
fn bad_pictures_are_refused() {
    let error = |image| MipTexture::new(&image, Encoding::Linear).unwrap_err().to_string();
    assert_eq!(
        error(DynamicImage::new_rgb8(0, 3)),
        "texture: found 0 × 3 pixels, expected at least 1 × 1"
    );
    let pixel = |x, y| if (x, y) == (1, 2) { f32::NAN } else { 0.0 };
    let image = ImageBuffer::from_fn(2, 3, |x, y| Rgb([0.0, 0.0, pixel(x, y)]));
    assert_eq!(
        error(DynamicImage::ImageRgb32F(image)),
        "texture pixel 1, 2: found NaN, expected finite numbers"
    );
}

#[test]
fn bytes_mean_what_is_nearest() {
    for encoding in [Encoding::Srgb, Encoding::Linear] {
        let decode = std::array::from_fn(|byte| encoding.decode(byte as f32 / 255.0));
        let encode = Encode::new(&decode);
        for byte in 0..=255_u8 {
            let value = decode[usize::from(byte)];
            assert_eq!(encode.byte(&decode, value), byte);
            if byte < 255 {
                let step = decode[usize::from(byte) + 1] - value;
                let near = [0.49, 0.51].map(|share| encode.byte(&decode, value + share * step));
                assert_eq!(near, [byte, byte + 1], "{encoding:?}");
            }
        }
        assert_eq!([-0.1, 1.1].map(|value| encode.byte(&decode, value)), [0, 255]);
    }
}
