//! Light from all around, told by a picture.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use thiserror::Error;

use super::{
    LightAhead, LightSample,
    distribution::{choose, probability, running_sums},
};
use crate::image::luminance;

/// A picture of the surroundings at infinity in equal steps of longitude and latitude, z up.
///
/// The top row is around +z. The middle of the picture lies towards +x, and what is left of it
/// towards +y, so that it looks from inside as it does on a screen, as in the latitude-longitude maps
/// of OpenEXR (*Technical Introduction to OpenEXR*, environment maps). Every pixel sends one radiance
/// from all its directions.
#[derive(Clone, PartialEq)]
pub struct Environment {
    /// Top row first, before scaling.
    pixels: Vec<Vec3>,
    width: usize,
    /// rad, and what radiance is multiplied by.
    rotation: f64,
    scale: f32,
    /// Of the polar angle at the border above each row and below the last.
    cosines: Vec<f64>,
    /// Of the weights of pixels in each row, row by row.
    pixel_sums: Vec<u32>,
    /// Of the weights of rows.
    row_sums: Vec<u32>,
    /// Sum of radiance times solid angle over all pixels.
    fluence: Vec3,
}

/// Why pixels do not make an [`Environment`].
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// There are too few or too many pixels.
    #[error("environment: found {found} pixels, expected {width} × {height}, at least 1 × 1")]
    Size {
        /// Number of pixels found.
        found: usize,
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
    /// A pixel is no radiance.
    #[error("environment pixel {x}, {y}: found {found}, expected finite numbers of at least 0")]
    Pixel {
        /// From the left, from 0.
        x: usize,
        /// From the top, from 0.
        y: usize,
        /// The pixel.
        found: Vec3,
    },
    /// A setting cannot be used.
    #[error("environment {name}: found {found}, expected {expected}")]
    Setting {
        /// `rotation` or `scale`.
        name: &'static str,
        /// The value found.
        found: f32,
        /// What would be accepted.
        expected: &'static str,
    },
}

impl Environment {
    /// The environment of linear `pixels`, `width` times `height`, top row first, turned by
    /// `rotation` rad about z, anticlockwise from above, and with its radiance multiplied by `scale`.
    ///
    /// # Errors
    ///
    /// [`EnvironmentError`] when there are not as many pixels as that, a pixel is negative or not
    /// finite, `rotation` is not finite, or `scale` is negative or not finite.
    pub fn new(
        pixels: Vec<Vec3>,
        [width, height]: [usize; 2],
        rotation: f32,
        scale: f32,
    ) -> Result<Self, EnvironmentError> {
        check(&pixels, [width, height], rotation, scale)?;
        let cosines: Vec<f64> =
            (0..=height).map(|row| (PI * row as f64 / height as f64).cos()).collect();
        let mut pixel_sums = Vec::with_capacity(pixels.len());
        let mut row_weights = Vec::with_capacity(height);
        let mut fluence = DVec3::ZERO;
        for (row, borders) in pixels.chunks_exact(width).zip(cosines.windows(2)) {
            let weights = row.iter().map(|&pixel| f64::from(luminance(pixel)));
            let solid_angle = TAU / width as f64 * (borders[0] - borders[1]);
            row_weights.push(weights.clone().sum::<f64>() * solid_angle);
            pixel_sums.extend(running_sums(weights));
            fluence += row.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>() * solid_angle;
        }
        let is_dark = scale == 0.0;
        let row_sums = running_sums(row_weights.iter().map(|w| if is_dark { 0.0 } else { *w }));
        let row_sums = row_sums.collect();
        let fluence = (fluence * f64::from(scale)).as_vec3();
        let rotation = rotation.into();
        Ok(Self { pixels, width, rotation, scale, cosines, pixel_sums, row_sums, fluence })
    }

    /// Bytes of memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.pixels.as_slice())
            + size_of_val(self.pixel_sums.as_slice())
            + size_of_val(self.row_sums.as_slice())
            + size_of_val(self.cosines.as_slice())
    }

    /// See [`Light::sample`](super::Light::sample): pixels are as likely as their luminance times
    /// their solid angle, directions of a pixel equally likely (Pharr, Jakob & Humphreys 2023, section
    /// 12.5.2, with exact solid angles in place of sin θ).
    pub(super) fn sample(&self, square: Vec2) -> Option<LightSample> {
        let row = choose(&self.row_sums, square.y)?;
        let column = choose(self.sums_of_row(row.index), square.x)?;
        let (above, below) = (self.cosines[row.index], self.cosines[row.index + 1]);
        let z = above + row.rest * (below - above);
        let u = (column.index as f64 + column.rest) / self.width as f64;
        let (sin, cos) = (self.rotation + PI - TAU * u).sin_cos();
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let density = row.probability * column.probability / self.solid_angle(row.index);
        let radiance = self.radiance(row.index, column.index);
        Some(LightSample {
            direction: DVec3::new(r * cos, r * sin, z).as_vec3(),
            distance: f32::INFINITY,
            irradiance: (radiance.as_dvec3() / density).as_vec3(),
            density: density as f32,
        })
    }

    /// See [`Light::ahead`](super::Light::ahead).
    pub(super) fn ahead(&self, direction: Vec3) -> Option<LightAhead> {
        let [row, column] = self.pixel(direction.as_dvec3());
        let in_row = probability(self.sums_of_row(row), column);
        let density = probability(&self.row_sums, row) * in_row / self.solid_angle(row);
        let radiance = self.radiance(row, column);
        let ahead = LightAhead { distance: f32::INFINITY, density: density as f32, radiance };
        (density > 0.0).then_some(ahead)
    }

    /// πR² · ∫ L dω.
    pub(super) fn power(&self, scene_radius: f32) -> Vec3 {
        self.fluence * (std::f32::consts::PI * scene_radius * scene_radius)
    }

    /// Row and column of the pixel in a direction.
    fn pixel(&self, direction: DVec3) -> [usize; 2] {
        let height = self.row_sums.len();
        let theta = direction.truncate().length().atan2(direction.z);
        let u = 0.5 - (direction.y.atan2(direction.x) - self.rotation) / TAU;
        let index = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        [index(theta / PI, height), index(u - u.floor(), self.width)]
    }

    fn radiance(&self, row: usize, column: usize) -> Vec3 {
        self.pixels[row * self.width + column] * self.scale
    }

    fn sums_of_row(&self, row: usize) -> &[u32] {
        &self.pixel_sums[row * self.width..][..self.width]
    }

    /// Of each pixel of a row, sr.
    fn solid_angle(&self, row: usize) -> f64 {
        TAU / self.width as f64 * (self.cosines[row] - self.cosines[row + 1])
    }
}

/// Without the pixels.
impl std::fmt::Debug for Environment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { width, rotation, scale, row_sums, .. } = self;
        let height = row_sums.len();
        write!(f, "Environment {{ {width} × {height}, rotation {rotation}, scale {scale} }}")
    }
}

fn check(
    pixels: &[Vec3],
    [width, height]: [usize; 2],
    rotation: f32,
    scale: f32,
) -> Result<(), EnvironmentError> {
    if pixels.is_empty() || width.checked_mul(height) != Some(pixels.len()) {
        return Err(EnvironmentError::Size { found: pixels.len(), width, height });
    }
    let is_radiance = |pixel: &Vec3| pixel.is_finite() && pixel.cmpge(Vec3::ZERO).all();
    if let Some(index) = pixels.iter().position(|pixel| !is_radiance(pixel)) {
        let (x, y) = (index % width, index / width);
        return Err(EnvironmentError::Pixel { x, y, found: pixels[index] });
    }
    let settings = [
        ("rotation", rotation, rotation.is_finite(), "a finite number"),
        ("scale", scale, scale.is_finite() && scale >= 0.0, "a finite number of at least 0"),
    ];
    match settings.into_iter().find(|&(_, _, is_valid, _)| !is_valid) {
        Some((name, found, _, expected)) => {
            Err(EnvironmentError::Setting { name, found, expected })
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uniform(size: [usize; 2]) -> Environment {
        Environment::new(vec![Vec3::ONE; size[0] * size[1]], size, 0.3, 2.0).unwrap()
    }

    #[test]
    fn even_environment_is_drawn_evenly() {
        for size in [[1, 1], [5, 3], [512, 256]] {
            let environment = uniform(size);
            for k in 0..1000 {
                let square = Vec2::new((k % 31) as f32 / 31.0, (k % 37) as f32 / 37.0);
                let sample = environment.sample(square).unwrap();
                let even = 4.0 * std::f32::consts::PI * sample.density;
                assert!((even - 1.0).abs() < 1e-4, "{size:?} {square}: {even}, expected 1");
                assert!((sample.direction.z - (1.0 - 2.0 * square.y)).abs() < 1e-4, "{square}");
            }
        }
    }

    #[test]
    fn middle_looks_along_x_and_left_along_y() {
        // Red, green, blue and white from left to right; dark above and below.
        let mut pixels = vec![Vec3::ZERO; 12];
        pixels[4..8].copy_from_slice(&[Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]);
        let look = |rotation: f32, direction: Vec3| {
            let environment = Environment::new(pixels.clone(), [4, 3], rotation, 1.0).unwrap();
            environment.ahead(direction).map(|ahead| ahead.radiance)
        };
        let level = |azimuth: f32| Vec2::from_angle(azimuth).extend(0.1).normalize();
        // The middle is between green and blue.
        for (azimuth, expected) in
            [(0.1, Vec3::Y), (-0.1, Vec3::Z), (1.7, Vec3::X), (-1.7, Vec3::ONE)]
        {
            assert_eq!(look(0.0, level(azimuth)), Some(expected), "{azimuth}");
            // Turned with the surroundings, the same is seen.
            assert_eq!(look(2.0, level(azimuth + 2.0)), Some(expected), "{azimuth}");
        }
        for dark in [Vec3::Z, Vec3::NEG_Z, Vec3::new(0.1, 0.0, 1.0).normalize()] {
            assert_eq!(look(0.0, dark), None);
        }
    }

    #[test]
    fn single_bright_pixel_is_all_that_is_drawn() {
        let mut pixels = vec![Vec3::ZERO; 64 * 32];
        pixels[10 * 64 + 20] = Vec3::new(1e6, 0.0, 0.0);
        let environment = Environment::new(pixels, [64, 32], -1.0, 1.0).unwrap();
        let sample = environment.sample(Vec2::new(0.3, 0.8)).unwrap();
        let solid_angle = environment.solid_angle(10) as f32;
        assert!((sample.density * solid_angle - 1.0).abs() < 1e-6, "{sample:?}");
        assert!((sample.irradiance.x / (1e6 * solid_angle) - 1.0).abs() < 1e-6, "{sample:?}");
        assert!(environment.ahead(-sample.direction).is_none());
    }

    #[test]
    fn black_environment_gives_nothing() {
        let black = Environment::new(vec![Vec3::ZERO; 8], [4, 2], 0.0, 1.0).unwrap();
        let off = Environment::new(vec![Vec3::ONE; 8], [4, 2], 0.0, 0.0).unwrap();
        for environment in [black, off] {
            assert_eq!(environment.sample(Vec2::splat(0.5)), None);
            assert_eq!(environment.ahead(Vec3::X), None);
            assert_eq!(environment.power(1.0), Vec3::ZERO);
        }
    }

    #[test]
    fn pixel_takes_sixteen_bytes() {
        let bytes = uniform([512, 256]).bytes();
        assert!((512 * 256 * 16..512 * 256 * 16 + 4096).contains(&bytes), "{bytes}");
    }

    #[test]
    fn bad_environments_are_refused() {
        let error = |pixels: &[Vec3], size, rotation, scale| {
            Environment::new(pixels.to_vec(), size, rotation, scale).unwrap_err().to_string()
        };
        let white = [Vec3::ONE; 2];
        assert_eq!(
            error(&white, [3, 1], 0.0, 1.0),
            "environment: found 2 pixels, expected 3 × 1, at least 1 × 1"
        );
        assert!(error(&[], [0, 0], 0.0, 1.0).contains("found 0 pixels"));
        assert!(error(&white, [usize::MAX, 2], 0.0, 1.0).contains("found 2 pixels"));
        assert_eq!(
            error(&[Vec3::ONE, Vec3::new(0.0, -1.0, 0.0)], [1, 2], 0.0, 1.0),
            "environment pixel 0, 1: found [0, -1, 0], expected finite numbers of at least 0"
        );
        assert_eq!(
            error(&white, [2, 1], f32::INFINITY, 1.0),
            "environment rotation: found inf, expected a finite number"
        );
        assert_eq!(
            error(&white, [2, 1], 0.0, f32::NAN),
            "environment scale: found NaN, expected a finite number of at least 0"
        );
    }
}
