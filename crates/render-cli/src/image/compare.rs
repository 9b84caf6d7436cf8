//! How far two pictures are apart.

use clap::ValueEnum;
use glam::Vec3;
use nv_flip::FlipImageRgb8;
use rayon::prelude::*;
use thiserror::Error;

use super::{Layer, Picture, View};
use crate::render::film::Size;

/// A measure of how far two pictures are apart, 0 if they are equal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lowercase")]
pub enum Metric {
    /// Root of the mean squared difference, in linear values
    Rmse,
    /// Mean squared difference, each divided by the square of the second picture's value + 0.01
    RelMse,
    /// Greatest difference, in linear values
    Max,
    /// What an observer sees who turns from one to the other (FLIP), 0 to 1
    Flip,
}

/// How far two pictures are apart, by all metrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// √mean((a − b)²) over pixels and components.
    pub rmse: f64,
    /// mean((a − b)² / (b² + 0.01)) over pixels and components.
    pub relmse: f64,
    /// max |a − b| over pixels and components.
    pub max: f64,
    /// The first pixel with that difference: from the left and from the top, from 0.
    pub max_at: [u32; 2],
    /// Mean of LDR-FLIP (Andersson et al. 2020) at 67 pixels per degree.
    pub flip: f64,
    /// Pixels where one picture has a finite value and the other has none. Metrics other than FLIP
    /// are infinite if there are such.
    pub unlike: usize,
}

/// Pictures that cannot be compared.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("found {}x{} pixels, expected {}x{}", .found.width(), .found.height(), .expected.width(), .expected.height())]
pub struct SizesDiffer {
    /// Size of the first.
    pub found: Size,
    /// Size of the second.
    pub expected: Size,
}

impl Metric {
    /// Its name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rmse => "rmse",
            Self::RelMse => "relmse",
            Self::Max => "max",
            Self::Flip => "flip",
        }
    }
}

impl Comparison {
    /// What this metric says.
    pub fn value(&self, metric: Metric) -> f64 {
        match metric {
            Metric::Rmse => self.rmse,
            Metric::RelMse => self.relmse,
            Metric::Max => self.max,
            Metric::Flip => self.flip,
        }
    }
}

/// Two pictures of one size: the colours of their main layers, and how each differs.
#[derive(Debug)]
pub struct Pair {
    size: Size,
    a: Vec<Vec3>,
    b: Vec<Vec3>,
    flip: Vec<f32>,
}

/// What the relative error adds to the squared value, so that black does not count infinitely.
const DARK: f64 = 0.01;

impl Pair {
    /// Compares the main layer of `a` with that of `b`, which is taken for the true one.
    ///
    /// Where neither has a finite value, of the same kind, they are equal; where only one has, FLIP
    /// is 1 and the difference is infinite.
    ///
    /// # Errors
    ///
    /// [`SizesDiffer`] when they do.
    pub fn new(a: &Picture, b: &Picture) -> Result<Self, SizesDiffer> {
        let size = b.size();
        if a.size() != size {
            return Err(SizesDiffer { found: a.size(), expected: size });
        }
        let [view_a, view_b] = [a.view, b.view];
        let [a, b] = [a.to_colors(), b.to_colors()];
        let mut flip = flip(size, (&a, view_a), (&b, view_b));
        for ((error, a), b) in flip.iter_mut().zip(&a).zip(&b) {
            if differences(*a, *b).any(f64::is_infinite) {
                *error = 1.0;
            }
        }
        Ok(Self { size, a, b, flip })
    }

    fn pixels(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        self.a.iter().copied().zip(self.b.iter().copied())
    }

    /// All metrics.
    pub fn comparison(&self) -> Comparison {
        let [mut squares, mut relative, mut max] = [0.0_f64; 3];
        let [mut max_index, mut unlike] = [0; 2];
        for (index, (a, b)) in self.pixels().enumerate() {
            for (difference, b) in differences(a, b).zip(b.to_array()) {
                squares += difference * difference;
                relative += relative_square(difference, b);
                if difference > max {
                    (max, max_index) = (difference, index);
                }
            }
            unlike += usize::from(differences(a, b).any(f64::is_infinite));
        }
        let pixels = self.a.len() as f64;
        let width = self.size.width();
        Comparison {
            rmse: (squares / (3.0 * pixels)).sqrt(),
            relmse: relative / (3.0 * pixels),
            max,
            max_at: [max_index as u32 % width, max_index as u32 / width],
            flip: self.flip.iter().copied().map(f64::from).sum::<f64>() / pixels,
            unlike,
        }
    }

    /// Where they differ by how much: for [`Metric::Rmse`] and [`Metric::Max`] |a − b|, for
    /// [`Metric::RelMse`] (a − b)² / (b² + 0.01), for each component; for [`Metric::Flip`] its
    /// values as a grey. Black is no difference.
    pub fn difference(&self, metric: Metric) -> Picture {
        let colors: Vec<_> = match metric {
            Metric::Flip => self.flip.iter().copied().map(Vec3::splat).collect(),
            _ => self.pixels().map(|(a, b)| difference(a, b, metric == Metric::RelMse)).collect(),
        };
        let mut picture = Picture::new(self.size);
        picture.push(Layer::colors("", &colors));
        picture.view = View::Raw;
        picture
    }
}

/// |a − b| of each component: 0 where both are not finite in the same way, infinite where they are
/// not finite in different ways.
fn differences(a: Vec3, b: Vec3) -> impl Iterator<Item = f64> {
    a.to_array().into_iter().zip(b.to_array()).map(|(a, b)| {
        if a == b || a.is_nan() && b.is_nan() {
            0.0
        } else if a.is_finite() && b.is_finite() {
            (f64::from(a) - f64::from(b)).abs()
        } else {
            f64::INFINITY
        }
    })
}

fn relative_square(difference: f64, b: f32) -> f64 {
    // Without this case ∞ / ∞ where b is infinite.
    if difference.is_infinite() || difference == 0.0 {
        return difference;
    }
    difference * difference / (f64::from(b) * f64::from(b) + DARK)
}

fn difference(a: Vec3, b: Vec3, relative: bool) -> Vec3 {
    let mut color = [0.0; 3];
    for ((shown, difference), b) in color.iter_mut().zip(differences(a, b)).zip(b.to_array()) {
        *shown = if relative { relative_square(difference, b) } else { difference } as f32;
    }
    Vec3::from_array(color)
}

/// Rows that FLIP is computed of at a time, which bounds the memory it takes: 120 bytes a pixel.
const BAND: usize = 256;

/// Rows on either side that a pixel's FLIP may depend on: more than the radius of its widest
/// filter, 10 at 67 pixels per degree.
const MARGIN: usize = 16;

/// LDR-FLIP of each pixel, as a screen shows the pictures in 8 bits.
fn flip(size: Size, a: (&[Vec3], View), b: (&[Vec3], View)) -> Vec<f32> {
    let [width, height] = [size.width() as usize, size.height() as usize];
    let bands: Vec<_> = (0..height.div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let [start, end] = [band * BAND, height.min((band + 1) * BAND)];
            let [from, to] = [start.saturating_sub(MARGIN), height.min(end + MARGIN)];
            let [a, b] = [a, b].map(|(colors, view)| (&colors[from * width..to * width], view));
            let errors = flip_whole(size.width(), a, b);
            errors[(start - from) * width..(end - from) * width].to_vec()
        })
        .collect();
    bands.concat()
}

/// As [`flip`], of all rows at once.
fn flip_whole(width: u32, a: (&[Vec3], View), b: (&[Vec3], View)) -> Vec<f32> {
    let [a, b] = [a, b].map(|(colors, view)| {
        let bytes: Vec<u8> = colors.iter().flat_map(|color| view.bytes(*color)).collect();
        let height = colors.len() / width as usize;
        FlipImageRgb8::with_data(width, height as u32, &bytes)
    });
    nv_flip::flip(b, a, nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

    use super::*;

    const SIZE: [u32; 2] = [24, 16];

    fn picture(color: impl Fn(u32, u32) -> Vec3) -> Picture {
        let [width, height] = SIZE;
        let pixels = (0..width * height).map(|k| color(k % width, k / width));
        let mut picture = Picture::new(Size::new(width, height).unwrap());
        picture.push(Layer::colors("", &pixels.collect::<Vec<_>>()));
        picture
    }

    fn compare(a: &Picture, b: &Picture) -> Comparison {
        Pair::new(a, b).unwrap().comparison()
    }

    fn weave(x: u32, y: u32) -> Vec3 {
        Vec3::new(0.1 + 0.5 * ((x + y) % 4 / 2) as f32, 0.3, 0.2 + 0.01 * x as f32)
    }

    #[test]
    fn equal_pictures_are_no_distance_apart() {
        let nan = |x, y| if x == 3 { Vec3::new(f32::NAN, f32::INFINITY, 1.0) } else { weave(x, y) };
        for picture in [picture(weave), picture(|_, _| Vec3::ZERO), picture(nan)] {
            let found = compare(&picture, &picture);
            let [rmse, relmse, max, flip] = [found.rmse, found.relmse, found.max, found.flip];
            assert_eq!(([rmse, relmse, max, flip], found.unlike), ([0.0; 4], 0));
        }
    }

    #[test]
    fn one_pixel_gives_known_errors() {
        let a = picture(
            |x, y| if (x, y) == (7, 5) { Vec3::new(0.8, 0.5, 0.5) } else { Vec3::splat(0.5) },
        );
        let b = picture(|_, _| Vec3::splat(0.5));
        let found = compare(&a, &b);
        let n = f64::from(3 * SIZE[0] * SIZE[1]);
        for (found, expected) in
            [(found.rmse, (0.09 / n).sqrt()), (found.relmse, 0.09 / 0.26 / n), (found.max, 0.3)]
        {
            assert!((found - expected).abs() < 1e-7, "{found}, expected {expected}");
        }
        assert_eq!(found.max_at, [7, 5]);
        let shown = Pair::new(&a, &b).unwrap().difference(Metric::Max).to_colors();
        for (k, color) in shown.iter().enumerate() {
            let expected = if k == 5 * 24 + 7 { 0.3 } else { 0.0 };
            assert!((color.x - expected).abs() < 1e-6 && color.y == 0.0, "{k}: {color}");
        }
    }

    #[test]
    fn flip_is_symmetric() {
        let (a, b) = (picture(weave), picture(|x, y| weave(x + 1, y) * 0.7));
        let [there, back] = [compare(&a, &b).flip, compare(&b, &a).flip];
        assert!(there > 0.01 && (there - back).abs() < 1e-6, "{there} {back}");
    }

    #[test]
    fn flip_grows_with_the_difference() {
        let grey = picture(|_, _| Vec3::splat(0.1));
        let apart =
            |k: u8| compare(&picture(|_, _| Vec3::splat(0.1 + 0.05 * f32::from(k))), &grey).flip;
        let steps: Vec<_> = (0..9).map(apart).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
    }

    #[test]
    fn flip_in_bands_is_flip_of_the_whole() {
        let size = Size::new(9, 700).unwrap();
        let noise = |seed: u32| -> Vec<Vec3> {
            let hash = |k: u32| (k.wrapping_mul(0x9e37_79b1) ^ seed).wrapping_mul(0x85eb_ca6b) >> 8;
            let value = |k| hash(k) as f32 / (1 << 24) as f32;
            (0..9 * 700).map(|k| Vec3::new(value(k), value(k + 7000), value(k + 14000))).collect()
        };
        let (a, b) = (noise(1), noise(2));
        let [a, b] = [(a.as_slice(), View::Raw), (b.as_slice(), View::Raw)];
        assert!(flip(size, a, b) == flip_whole(9, a, b));
    }

    #[test]
    fn flip_knows_extremes_of_lightness_and_hue() {
        // As the authors' program says of black and white, and of green and blue, which it calls 1.
        let plain = |color: Vec3| {
            let mut picture = picture(|_, _| color);
            picture.view = View::Raw;
            picture
        };
        let found = compare(&plain(Vec3::ZERO), &plain(Vec3::ONE)).flip;
        assert!((found - 0.967).abs() < 1e-3, "{found}");
        let found = compare(&plain(Vec3::Y), &plain(Vec3::Z)).flip;
        assert!((found - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn flip_sees_coarse_patterns_and_not_finer_ones() {
        let flat = picture(|_, _| Vec3::splat(0.5));
        let board = |side: u32| {
            let tile = |x: u32, y: u32| (x / side + y / side) % 2;
            compare(&picture(|x, y| Vec3::splat(0.45 + 0.1 * tile(x, y) as f32)), &flat).flip
        };
        assert!(board(8) > 1.5 * board(1), "{} {}", board(8), board(1));
    }

    #[test]
    fn values_of_one_picture_that_are_not_finite_are_infinitely_far() {
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let spoilt = |x, y| if (x, y) == (2, 1) { Vec3::splat(odd) } else { weave(x, y) };
            let [a, b] = [picture(spoilt), picture(weave)];
            for found in [compare(&a, &b), compare(&b, &a)] {
                let errors = [found.rmse, found.relmse, found.max];
                assert_eq!((errors, found.unlike), ([f64::INFINITY; 3], 1), "{odd}");
                assert_eq!(found.max_at, [2, 1]);
                assert!(found.flip >= 1.0 / 384.0 && found.flip < 0.1, "{odd}: {}", found.flip);
            }
        }
    }

    #[test]
    fn sizes_must_agree() {
        let small = Picture::new(Size::new(3, 2).unwrap());
        let error = Pair::new(&small, &picture(weave)).unwrap_err();
        assert_eq!(error.to_string(), "found 3x2 pixels, expected 24x16");
    }
}
