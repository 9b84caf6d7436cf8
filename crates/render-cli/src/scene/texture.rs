//! Pictures on a surface, filtered over what a ray stands for.

use glam::{Vec2, Vec3};
use image::DynamicImage;
use rayon::prelude::*;
use thiserror::Error;

/// A picture that repeats over the plane, with a pyramid of smaller copies.
///
/// Pictures of 8 bits per component stay in 8 bits and grey ones in one component, smaller copies
/// too, so a texel takes 1, 3, 4 or 12 bytes and the pyramid 4/3 of that. Transparency is left out.
#[derive(Clone, PartialEq)]
pub struct MipTexture {
    /// From the picture itself down to a single texel, its mean.
    levels: Vec<Level>,
    /// 1 for grey, 3 for RGB.
    components: usize,
    /// What a byte means.
    decode: Box<[f32; 256]>,
}

/// What the integers of a picture mean. Floating-point pictures are linear in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// A colour for screens (IEC 61966-2-1).
    Srgb,
    /// Numbers from 0 to 1.
    Linear,
}

/// Why a picture does not make a [`MipTexture`].
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TextureError {
    /// It has no pixels.
    #[error("texture: found {width} × {height} pixels, expected at least 1 × 1")]
    Empty {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// A pixel is infinite or not a number.
    #[error("texture pixel {x}, {y}: found {found}, expected finite numbers")]
    Pixel {
        /// From the left, from 0.
        x: usize,
        /// From the top, from 0.
        y: usize,
        /// The component found.
        found: f32,
    },
}

/// One copy of the picture, top row first.
#[derive(Clone, PartialEq)]
struct Level {
    width: usize,
    height: usize,
    texels: Texels,
}

#[derive(Clone, Debug, PartialEq)]
enum Texels {
    Bytes(Vec<u8>),
    Floats(Vec<f32>),
}

/// Lookups along a long footprint, at most.
const MAX_TAPS: f32 = 4.0;

impl MipTexture {
    /// The texture of a decoded picture.
    ///
    /// # Errors
    ///
    /// [`TextureError`] when the picture has no pixels, or one that is not finite.
    pub fn new(image: &DynamicImage, encoding: Encoding) -> Result<Self, TextureError> {
        let (width, height) = (image.width(), image.height());
        if width == 0 || height == 0 {
            return Err(TextureError::Empty { width, height });
        }
        let (components, texels) = texels(image, encoding);
        let (width, height) = (width as usize, height as usize);
        if let Texels::Floats(values) = &texels
            && let Some(index) = values.iter().position(|value| !value.is_finite())
        {
            let pixel = index / components;
            let (x, y) = (pixel % width, pixel / width);
            return Err(TextureError::Pixel { x, y, found: values[index] });
        }
        let decode = Box::new(std::array::from_fn(|byte| encoding.decode(byte as f32 / 255.0)));
        let mut texture = Self { levels: vec![], components, decode };
        let encode = Encode::new(&texture.decode);
        let mut level = Level { width, height, texels };
        while level.width.max(level.height) > 1 {
            let next = texture.halved(&level, &encode);
            texture.levels.push(std::mem::replace(&mut level, next));
        }
        texture.levels.push(level);
        Ok(texture)
    }

    /// The mean of the picture around `uv`: linear, grey in all three components.
    ///
    /// The picture covers the unit square, u to the right and v upwards from its lower left corner,
    /// and repeats. `footprint` holds the steps in uv from one ray to the next along both sides of a
    /// pixel; any two vectors with the same a aᵀ + b bᵀ give the same mean.
    ///
    /// Linear within and between two levels of the pyramid (Williams 1983); up to four such lookups
    /// lie along a footprint that is longer than wide (McCormack, Perry, Farkas & Jouppi 1999). What
    /// is not a number gives the mean of the whole picture.
    pub fn value(&self, uv: Vec2, footprint: [Vec2; 2]) -> Vec3 {
        let Level { width, height, .. } = self.levels[0];
        let size = Vec2::new(width as f32, height as f32);
        let Ellipse { axis, length, width } = Ellipse::new(footprint.map(|step| step * size));
        let taps = (length / width).round().clamp(1.0, MAX_TAPS);
        let level = if uv.is_finite() { width.max(length / taps).log2() } else { f32::INFINITY };
        if taps > 1.0 {
            let step = axis.normalize_or_zero() * (length / taps) / size;
            let first = uv - step * (0.5 * (taps - 1.0));
            let places = (0..taps as usize).map(|tap| first + step * tap as f32);
            places.map(|place| self.trilinear(place, level)).sum::<Vec3>() / taps
        } else {
            self.trilinear(uv, level)
        }
    }

    /// The least and the greatest of all components in the picture.
    pub fn extremes(&self) -> [f32; 2] {
        let of = |values: &mut dyn Iterator<Item = f32>| {
            values.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        };
        match &self.levels[0].texels {
            Texels::Bytes(bytes) => {
                of(&mut bytes.iter().map(|byte| self.decode[usize::from(*byte)]))
            }
            Texels::Floats(floats) => of(&mut floats.iter().copied()),
        }
    }

    /// Bytes of memory that it takes.
    pub fn bytes(&self) -> usize {
        let bytes = |level: &Level| match &level.texels {
            Texels::Bytes(bytes) => size_of_val(bytes.as_slice()),
            Texels::Floats(floats) => size_of_val(floats.as_slice()),
        };
        self.levels.iter().map(bytes).sum::<usize>() + size_of_val(self.decode.as_slice())
    }

    fn trilinear(&self, uv: Vec2, level: f32) -> Vec3 {
        let last = self.levels.len() - 1;
        if level >= last as f32 || level.is_nan() {
            return self.color(0, |index| self.component(&self.levels[last], index));
        }
        let uv = uv - uv.floor();
        let below = level.max(0.0) as usize;
        let value = self.bilinear(&self.levels[below], uv);
        let share = level - below as f32;
        if share <= 0.0 {
            return value;
        }
        value.lerp(self.bilinear(&self.levels[below + 1], uv), share)
    }

    /// `uv` is in [0, 1].
    fn bilinear(&self, level: &Level, uv: Vec2) -> Vec3 {
        let size = Vec2::new(level.width as f32, level.height as f32);
        let place = Vec2::new(uv.x, 1.0 - uv.y) * size - 0.5;
        let corner = place.floor();
        let share = place - corner;
        let neighbours = |corner: f32, count: usize| {
            let first = if corner < 0.0 { count - 1 } else { (corner as usize).min(count - 1) };
            [first, if first + 1 == count { 0 } else { first + 1 }]
        };
        let [left, right] = neighbours(corner.x, level.width);
        let [above, below] = neighbours(corner.y, level.height);
        let corners = [(left, above), (right, above), (left, below), (right, below)];
        let indices = corners.map(|(x, y)| (y * level.width + x) * self.components);
        let [a, b, c, d] = match &level.texels {
            Texels::Bytes(bytes) => {
                let decoded = |index: usize| self.decode[usize::from(bytes[index])];
                indices.map(|index| self.color(index, decoded))
            }
            Texels::Floats(floats) => indices.map(|index| self.color(index, |k| floats[k])),
        };
        a.lerp(b, share.x).lerp(c.lerp(d, share.x), share.y)
    }

    /// RGB from the components that begin at `index`.
    fn color(&self, index: usize, component: impl Fn(usize) -> f32) -> Vec3 {
        if self.components == 1 {
            Vec3::splat(component(index))
        } else {
            Vec3::new(component(index), component(index + 1), component(index + 2))
        }
    }

    fn component(&self, level: &Level, index: usize) -> f32 {
        match &level.texels {
            Texels::Bytes(bytes) => self.decode[usize::from(bytes[index])],
            Texels::Floats(floats) => floats[index],
        }
    }

    /// The copy of half the width and height, rounded down: each texel the mean of what it covers.
    fn halved(&self, level: &Level, encode: &Encode) -> Level {
        let (columns, rows) = (coverage(level.width), coverage(level.height));
        let mean = |row: &Covered, column: &Covered, component: usize| -> f32 {
            let texel = |y: usize, x: usize| (y * level.width + x) * self.components;
            let at = |y, x| self.component(level, texel(y, x) + component);
            row.sum(|y| column.sum(|x| at(y, x)))
        };
        let texels = match level.texels {
            Texels::Bytes(_) => Texels::Bytes(self.filled(&rows, &columns, |row, column, k| {
                encode.byte(&self.decode, mean(row, column, k))
            })),
            Texels::Floats(_) => Texels::Floats(self.filled(&rows, &columns, mean)),
        };
        Level { width: columns.len(), height: rows.len(), texels }
    }

    /// What `value` is of each component of each texel, row by row on all processors.
    fn filled<T: Clone + Default + Send>(
        &self,
        rows: &[Covered],
        columns: &[Covered],
        value: impl Fn(&Covered, &Covered, usize) -> T + Sync,
    ) -> Vec<T> {
        let width = columns.len() * self.components;
        let mut all = vec![T::default(); rows.len() * width];
        all.par_chunks_mut(width).zip(rows).for_each(|(values, row)| {
            for (texel, column) in values.chunks_mut(self.components).zip(columns) {
                for (k, component) in texel.iter_mut().enumerate() {
                    *component = value(row, column, k);
                }
            }
        });
        all
    }
}

/// Finds bytes by what they mean, numbers in rising order.
struct Encode {
    /// The first byte that means at least each of so many even steps from 0 to 1.
    first: Vec<u8>,
}

/// Steps, about as long as the shortest one between the meanings of bytes.
const STEPS: usize = 4096;

impl Encode {
    fn new(decode: &[f32; 256]) -> Self {
        let first = |step: usize| {
            let least = step as f32 / STEPS as f32;
            decode.partition_point(|&decoded| decoded < least).min(255) as u8
        };
        Self { first: (0..=STEPS).map(first).collect() }
    }

    /// The byte that means what is nearest to `value`.
    fn byte(&self, decode: &[f32; 256], value: f32) -> u8 {
        let step = (value.clamp(0.0, 1.0) * STEPS as f32) as usize;
        let mut above = usize::from(self.first[step]).max(1);
        while above > 1 && decode[above - 1] >= value {
            above -= 1;
        }
        while above < 255 && decode[above] < value {
            above += 1;
        }
        let middle = 0.5 * (decode[above - 1] + decode[above]);
        (if value < middle { above - 1 } else { above }) as u8
    }
}

/// Without the texels.
impl std::fmt::Debug for MipTexture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Level { width, height, .. } = self.levels[0];
        write!(f, "MipTexture {{ {width} × {height}, {} bytes }}", self.bytes())
    }
}

impl Encoding {
    /// The linear number for an encoded one in [0, 1].
    fn decode(self, value: f32) -> f32 {
        match self {
            Self::Linear => value,
            Self::Srgb if value <= 0.04045 => value / 12.92,
            Self::Srgb => ((value + 0.055) / 1.055).powf(2.4),
        }
    }
}

/// The number of components of a picture, and their values.
fn texels(image: &DynamicImage, encoding: Encoding) -> (usize, Texels) {
    use DynamicImage as Image;
    let decoded = |values: Vec<u16>| {
        let decode = |value: u16| encoding.decode(f32::from(value) / f32::from(u16::MAX));
        Texels::Floats(values.into_iter().map(decode).collect())
    };
    match image {
        Image::ImageLuma8(_) | Image::ImageLumaA8(_) => {
            (1, Texels::Bytes(image.to_luma8().into_raw()))
        }
        Image::ImageRgb8(_) | Image::ImageRgba8(_) => {
            (3, Texels::Bytes(image.to_rgb8().into_raw()))
        }
        Image::ImageLuma16(_) | Image::ImageLumaA16(_) => {
            (1, decoded(image.to_luma16().into_raw()))
        }
        Image::ImageRgb16(_) | Image::ImageRgba16(_) => (3, decoded(image.to_rgb16().into_raw())),
        _ => (3, Texels::Floats(image.to_rgb32f().into_raw())),
    }
}

/// A row or column of texels that a texel of the next level covers, in part.
#[derive(Clone, Copy)]
struct Covered {
    first: usize,
    shares: [f32; 3],
}

impl Covered {
    /// The mean of `value` over what is covered.
    fn sum(&self, value: impl Fn(usize) -> f32) -> f32 {
        let [a, b, c] = self.shares;
        let mut sum = a * value(self.first);
        // What has no share may not exist.
        if b > 0.0 {
            sum += b * value(self.first + 1);
        }
        if c > 0.0 {
            sum += c * value(self.first + 2);
        }
        sum
    }
}

/// What each of half as many texels, rounded down, covers of `count`: all the same length, between
/// 2 and 3 unless there is but one.
fn coverage(count: usize) -> Vec<Covered> {
    let parts = (count / 2).max(1);
    // In units of 1/parts of a texel all borders are whole.
    let covered = |part: usize| {
        let (start, end) = (part * count, (part + 1) * count);
        let first = start / parts;
        let shares = [0, 1, 2].map(|k| {
            let (from, to) = ((first + k) * parts, (first + k + 1) * parts);
            to.min(end).saturating_sub(from.max(start)) as f32 / count as f32
        });
        Covered { first, shares }
    };
    (0..parts).map(covered).collect()
}

/// The ellipse over which a pixel averages.
struct Ellipse {
    /// Along which it is long, of any length.
    axis: Vec2,
    length: f32,
    width: f32,
}

impl Ellipse {
    /// With the axes of a aᵀ + b bᵀ.
    fn new([a, b]: [Vec2; 2]) -> Self {
        let difference = 0.5 * (a.x * a.x + b.x * b.x - a.y * a.y - b.y * b.y);
        let product = a.x * a.y + b.x * b.y;
        let root = (difference * difference + product * product).sqrt();
        let length = (0.5 * (a.length_squared() + b.length_squared()) + root).sqrt();
        let axis = if difference > 0.0 {
            Vec2::new(difference + root, product)
        } else {
            Vec2::new(product, root - difference)
        };
        // The product of both is the area. A width of 0 would ask for lookups without end.
        let width = (a.perp_dot(b).abs() / length).max(f32::MIN_POSITIVE);
        Self { axis, length, width }
    }
}

#[cfg(test)]
mod tests;
