//! What rays expose: the size of a picture, its pixels, and the filter that makes them.

use std::{f32::consts::TAU, fmt, str::FromStr};

use glam::{Vec2, Vec3};
use serde::Deserialize;
use thiserror::Error;

/// Width and height of a picture: at least 1 each, and at most [`MAX_PIXELS`] in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    width: u32,
    height: u32,
}

/// Most pixels of a picture, 2²⁶: 8192 × 8192, which take 2.4 GB of memory.
pub const MAX_PIXELS: u64 = 1 << 26;

/// What is not a size.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum SizeError {
    /// The text is not two numbers.
    #[error("expected width and height in pixels, as in 960x640")]
    Syntax,
    /// There are no pixels.
    #[error("found no pixels, expected at least 1x1")]
    Empty,
    /// There are too many pixels.
    #[error("found {0} pixels, expected at most {MAX_PIXELS}")]
    TooLarge(u64),
}

impl Size {
    /// A size of `width` × `height` pixels.
    ///
    /// # Errors
    ///
    /// [`SizeError`] when there is no pixel, or are more than [`MAX_PIXELS`].
    pub fn new(width: u32, height: u32) -> Result<Self, SizeError> {
        match u64::from(width) * u64::from(height) {
            0 => Err(SizeError::Empty),
            pixels if pixels > MAX_PIXELS => Err(SizeError::TooLarge(pixels)),
            _ => Ok(Self { width, height }),
        }
    }

    /// Pixels in a row.
    pub fn width(self) -> u32 {
        self.width
    }

    /// Number of rows.
    pub fn height(self) -> u32 {
        self.height
    }
}

impl Default for Size {
    /// 960 × 640.
    fn default() -> Self {
        Self { width: 960, height: 640 }
    }
}

impl FromStr for Size {
    type Err = SizeError;

    /// `WIDTHxHEIGHT`
    fn from_str(text: &str) -> Result<Self, SizeError> {
        let number = |text: &str| {
            let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
            // A number beyond u32 is too large, not unreadable.
            if digits { Ok(text.parse().unwrap_or(u32::MAX)) } else { Err(SizeError::Syntax) }
        };
        let (width, height) = text.split_once(['x', 'X']).ok_or(SizeError::Syntax)?;
        Self::new(number(width)?, number(height)?)
    }
}

/// A rectangle of pixels with at least one in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    min: [u32; 2],
    max: [u32; 2],
}

/// What is not a crop.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum CropError {
    /// The text is not four numbers.
    #[error("expected left, top, right and bottom edge in pixels, as in 0,0,960,640")]
    Syntax,
    /// There are no pixels.
    #[error("found no pixels, expected a right and a bottom edge beyond the left and the top one")]
    Empty,
    /// It is not within the picture.
    #[error("found {crop}, expected a rectangle within 0,0,{width},{height}")]
    Outside {
        /// The crop.
        crop: Crop,
        /// Width of the picture.
        width: u32,
        /// Height of the picture.
        height: u32,
    },
}

impl Crop {
    /// The pixels from column and row `min` up to and without column and row `max`.
    ///
    /// # Errors
    ///
    /// [`CropError::Empty`] when there are none.
    pub fn new(min: [u32; 2], max: [u32; 2]) -> Result<Self, CropError> {
        let is_filled = min[0] < max[0] && min[1] < max[1];
        if is_filled { Ok(Self { min, max }) } else { Err(CropError::Empty) }
    }

    /// Column and row of the first pixel.
    pub fn min(self) -> [u32; 2] {
        self.min
    }

    /// Column and row after the last pixel.
    pub fn max(self) -> [u32; 2] {
        self.max
    }

    /// Pixels in a row.
    pub fn width(self) -> u32 {
        self.max[0] - self.min[0]
    }

    /// Number of rows.
    pub fn height(self) -> u32 {
        self.max[1] - self.min[1]
    }

    /// The pixels that are in `other` too.
    pub fn intersection(self, other: Self) -> Option<Self> {
        let max_of = |axis: usize| self.max[axis].min(other.max[axis]);
        let min_of = |axis: usize| self.min[axis].max(other.min[axis]);
        Self::new([min_of(0), min_of(1)], [max_of(0), max_of(1)]).ok()
    }

    /// Columns and rows of all pixels, row after row.
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let columns = self.min[0]..self.max[0];
        (self.min[1]..self.max[1]).flat_map(move |y| columns.clone().map(move |x| [x, y]))
    }
}

impl fmt::Display for Crop {
    /// `left,top,right,bottom`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { min, max } = self;
        write!(f, "{},{},{},{}", min[0], min[1], max[0], max[1])
    }
}

impl FromStr for Crop {
    type Err = CropError;

    /// `left,top,right,bottom`
    fn from_str(text: &str) -> Result<Self, CropError> {
        let number = |text: &str| {
            let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
            // A number beyond u32 is outside of all pictures, not unreadable.
            digits.then(|| text.parse().unwrap_or(u32::MAX)).ok_or(CropError::Syntax)
        };
        let numbers: Vec<u32> = text.split(',').map(number).collect::<Result<_, _>>()?;
        let [left, top, right, bottom] = numbers[..] else { return Err(CropError::Syntax) };
        Self::new([left, top], [right, bottom])
    }
}

/// A picture, and the part of it that is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    size: Size,
    crop: Crop,
}

impl Frame {
    /// All of a picture.
    pub fn whole(size: Size) -> Self {
        Self { size, crop: Crop { min: [0, 0], max: [size.width, size.height] } }
    }

    /// A part of a picture.
    ///
    /// # Errors
    ///
    /// [`CropError::Outside`] when not all of `crop` is within the picture.
    pub fn cropped(size: Size, crop: Crop) -> Result<Self, CropError> {
        let Size { width, height } = size;
        if crop.max[0] > width || crop.max[1] > height {
            return Err(CropError::Outside { crop, width, height });
        }
        Ok(Self { size, crop })
    }

    /// Size of the picture, of which the crop may be a part.
    pub fn size(self) -> Size {
        self.size
    }

    /// The part that is taken.
    pub fn crop(self) -> Crop {
        self.crop
    }

    /// Size of that part.
    pub fn crop_size(self) -> Size {
        Size { width: self.crop.width(), height: self.crop.height() }
    }
}

/// What was exposed: the picture within the crop of its frame, and its layers.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposed {
    /// What picture it is, and which part of it.
    pub frame: Frame,
    /// The radiance.
    pub beauty: Film,
    /// All else, by name; none if no layers were asked for.
    pub planes: Vec<Plane>,
}

/// A number for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Name of the layer, as in `albedo`.
    pub layer: &'static str,
    /// Name of the channel within it, as in `R`; empty where it is all there is of the layer.
    pub channel: &'static str,
    /// The numbers, row after row from the top, each from left to right.
    pub values: Values,
}

/// Numbers of one type.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Quantities.
    F32(Vec<f32>),
    /// Numbers of things.
    U32(Vec<u32>),
}

/// The pixels of a picture: linear radiance, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: Size,
    pixels: Vec<Vec3>,
}

impl Film {
    /// A film on which no light has fallen.
    pub fn black(size: Size) -> Self {
        let count = size.width as usize * size.height as usize;
        Self { size, pixels: vec![Vec3::ZERO; count] }
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// All pixels, row after row from the top, each from left to right.
    pub fn pixels(&self) -> &[Vec3] {
        &self.pixels
    }

    /// All pixels, to be written.
    pub fn pixels_mut(&mut self) -> &mut [Vec3] {
        &mut self.pixels
    }
}

/// Standard deviation of the places of a pixel's samples, in pixels.
const PLACE_SIGMA: f32 = 0.3;

/// Standard deviation of the beam from one place, in pixels.
///
/// With that of the places it makes the pixel filter for cloth, a Gaussian of 0.5 = √(0.3² + 0.4²).
/// What has a period of one pixel is damped to exp(−2π²σ²) = 0.7 %, so threads finer than pixels
/// become an even tone and not a moiré. Edges, which beams do not see, stay as sharp as with a box
/// of one pixel, whose deviation is 0.29.
pub const BEAM_SIGMA: f32 = 0.4;

/// And of all beams of a pixel together, whose middles have [`PLACE_SIGMA`]: √(0.3² + 0.4²).
pub const PIXEL_SIGMA: f32 = 0.5;

/// Where the samples of a pixel lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    /// Around the pixel's middle with the density of a Gaussian, so that the plain mean of their
    /// radiance is the filtered pixel (Ernst, Stamminger & Greiner 2006).
    #[default]
    Gaussian,
    /// Evenly over the pixel.
    Box,
}

impl Filter {
    /// Where a sample lies, in pixels from the pixel's top left corner, for `square` in [0, 1)².
    ///
    /// The Gaussian's places follow from the square by the map of Box & Muller 1958.
    pub fn offset(self, square: Vec2) -> Vec2 {
        match self {
            Self::Gaussian => {
                let radius = PLACE_SIGMA * (-2.0 * (1.0 - square.x).ln()).sqrt();
                Vec2::splat(0.5) + radius * Vec2::from_angle(TAU * square.y)
            }
            Self::Box => square,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_bounded() {
        assert_eq!("960x640".parse(), Size::new(960, 640));
        assert_eq!("1X1".parse(), Size::new(1, 1));
        for text in ["", "x", "960", "960x", "x640", "-1x5", "+1x5", "1.5x2", "9 x 9", "1x2x3"] {
            assert_eq!(text.parse::<Size>(), Err(SizeError::Syntax), "{text}");
        }
        assert_eq!("0x640".parse::<Size>(), Err(SizeError::Empty));
        assert!("8192x8192".parse::<Size>().is_ok());
        assert_eq!("8192x8193".parse::<Size>(), Err(SizeError::TooLarge(8192 * 8193)));
        let huge = "99999999999999999999x2".parse::<Size>();
        assert_eq!(huge, Err(SizeError::TooLarge(2 * u64::from(u32::MAX))));
    }

    #[test]
    fn crops_are_read_and_lie_within_the_picture() {
        let crop: Crop = "1,2,30,40".parse().unwrap();
        assert_eq!((crop.min(), crop.max()), ([1, 2], [30, 40]));
        assert_eq!((crop.width(), crop.height()), (29, 38));
        assert_eq!(crop.to_string(), "1,2,30,40");
        for text in
            ["", "1,2,3", "1,2,3,4,5", "1,2,3,", "a,2,3,4", "-1,2,3,4", "1.5,2,3,4", "1 ,2,3,4"]
        {
            assert_eq!(text.parse::<Crop>(), Err(CropError::Syntax), "{text}");
        }
        for text in ["1,2,1,4", "1,2,3,2", "3,2,1,4"] {
            assert_eq!(text.parse::<Crop>(), Err(CropError::Empty), "{text}");
        }
        let size = Size::new(30, 40).unwrap();
        assert_eq!(Frame::cropped(size, crop).unwrap().crop_size(), Size::new(29, 38).unwrap());
        for text in ["0,0,31,40", "0,0,30,41", "0,0,99999999999,1"] {
            let error = Frame::cropped(size, text.parse().unwrap()).unwrap_err();
            let text = error.to_string();
            assert!(text.ends_with("expected a rectangle within 0,0,30,40"), "{text}");
        }
    }

    #[test]
    fn crops_meet_where_both_have_pixels() {
        let crop = |text: &str| text.parse::<Crop>().unwrap();
        let common = crop("0,0,4,4").intersection(crop("2,1,9,3"));
        assert_eq!(common, Some(crop("2,1,4,3")));
        assert_eq!(crop("0,0,4,4").intersection(crop("4,0,5,4")), None);
        let pixels: Vec<_> = crop("2,1,4,3").pixels().collect();
        assert_eq!(pixels, [[2, 1], [3, 1], [2, 2], [3, 2]]);
    }

    #[test]
    fn filter_has_its_mean_and_variance() {
        let n = 256;
        let places = (0..n * n).map(|k| {
            let cell = Vec2::new((k % n) as f32, (k / n) as f32);
            Filter::Gaussian.offset((cell + 0.5) / n as f32) - 0.5
        });
        let (mut mean, mut variance) = (Vec2::ZERO, Vec2::ZERO);
        for place in places {
            mean += place / (n * n) as f32;
            variance += place * place / (n * n) as f32;
        }
        assert!(mean.length() < 1e-4, "{mean}");
        let expected = Vec2::splat(PLACE_SIGMA * PLACE_SIGMA);
        // The midpoint rule cuts the tail off: 0.3 % of the variance at n = 256.
        assert!(variance.abs_diff_eq(expected, 2e-3), "{variance}, expected {expected}");
    }

    #[test]
    fn filter_is_finite_at_the_ends_of_the_square() {
        for square in [Vec2::ZERO, Vec2::splat(1.0 - f32::EPSILON / 2.0)] {
            let offset = Filter::Gaussian.offset(square);
            assert!(offset.is_finite() && offset.length() < 4.0, "{square}: {offset}");
        }
    }
}
