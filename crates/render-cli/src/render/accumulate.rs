//! What samples add up to, tile by tile.
//!
//! A tile is a square of the picture's own grid, whatever part of the picture is taken, and knows of
//! nothing but its own pixels. So what it comes to depends on nothing else.
//!
//! A pixel takes 24 bytes: the sum of its radiance in `f64`. With [`Halves`] it takes 24 more, with
//! layers 112 more: what is summed there in `f32` is wrong by a part in 30 000 at most after 1024
//! samples, in 500 after [`MAX_SAMPLES`].

use std::time::Duration;

use glam::{DVec3, Vec2, Vec3};

use super::{
    exposure::{Expose, Exposure},
    film::{Crop, Exposed, Film, Frame, Plane, Values},
    sampler::MAX_SAMPLES,
};

/// Pixels along each side of a tile that the picture's edge does not cut.
pub const TILE: u32 = 16;

/// The number of a yarn, and of a type, in layers where no yarn is seen.
pub const NO_YARN: u32 = u32::MAX;

/// What is kept besides the radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layers {
    /// Nothing.
    #[default]
    None,
    /// All that [`Accumulator::exposed`] makes planes of.
    All,
}

/// Whether samples come from two sequences by turns, whose sums are kept apart.
///
/// Points of one sequence keep clear of each other, so parts of it tell little of the error of the
/// whole. Two independent sequences do: half the difference of their means has the variance of their
/// mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Halves {
    /// Sample k is point k of the sequence.
    #[default]
    None,
    /// Even samples are points 0, 1, 2 … of the sequence; odd ones are those from [`MAX_SAMPLES`] on,
    /// where another one begins.
    Two,
}

/// All that was exposed so far: sums over the samples of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Accumulator {
    frame: Frame,
    layers: Layers,
    halves: Halves,
    pub(super) tiles: Vec<Tile>,
    /// Time that the samples took, with that of earlier runs.
    pub elapsed: Duration,
}

impl Accumulator {
    /// No samples as yet.
    ///
    /// With halves, tiles are whole even where the crop cuts them: what is decided from a tile must
    /// not depend on the crop.
    pub fn new(frame: Frame, layers: Layers, halves: Halves) -> Self {
        let picture = Frame::whole(frame.size()).crop();
        let bounds = match halves {
            Halves::None => frame.crop(),
            Halves::Two => picture,
        };
        let (min, max) = (frame.crop().min(), frame.crop().max());
        let rows = min[1] / TILE..max[1].div_ceil(TILE);
        let tiles = rows.flat_map(|row| {
            let columns = min[0] / TILE..max[0].div_ceil(TILE);
            columns.filter_map(move |column| {
                let corner = [column * TILE, row * TILE];
                let square = Crop::new(corner, corner.map(|place| place + TILE)).ok()?;
                Some(Tile::new(square.intersection(bounds)?, layers, halves))
            })
        });
        Self { frame, layers, halves, tiles: tiles.collect(), elapsed: Duration::ZERO }
    }

    /// What picture it is, and which part of it.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Whether it is of this frame and keeps these sums.
    pub fn is_of(&self, frame: Frame, layers: Layers, halves: Halves) -> bool {
        (self.frame, self.layers, self.halves) == (frame, layers, halves)
    }

    /// Number of samples so far.
    pub fn samples(&self) -> u64 {
        self.tiles.iter().map(|tile| u64::from(tile.samples) * tile.pixels()).sum()
    }

    /// The means of radiance, within the crop; black where there is no sample.
    pub fn beauty(&self) -> Film {
        let mut beauty = Film::black(self.frame.crop_size());
        self.each(|tile, pixel, place| {
            if tile.samples > 0 {
                let mean = tile.sums[pixel] / f64::from(tile.samples);
                beauty.pixels_mut()[place] = mean.as_vec3();
            }
        });
        beauty
    }

    /// Fewest samples of a pixel.
    pub fn fewest(&self) -> u32 {
        self.tiles.iter().map(|tile| tile.samples).min().unwrap_or(0)
    }

    /// The noise, as [`Limits::noise`](super::progressive::Limits::noise) limits it: over the whole
    /// picture and of the worst tile. `None` without halves or with fewer than two samples of a pixel.
    pub fn noise(&self) -> Option<[f64; 2]> {
        if self.halves == Halves::None || self.fewest() < 2 {
            return None;
        }
        let [mut sum, mut pixels, mut worst] = [0.0, 0.0, 0.0_f64];
        for tile in &self.tiles {
            let error = tile.error();
            sum += error * error * tile.pixels() as f64;
            pixels += tile.pixels() as f64;
            worst = worst.max(error);
        }
        Some([(sum / pixels).sqrt(), worst])
    }

    /// The means, within the crop; black where there is no sample.
    ///
    /// Planes, if layers are kept: `albedo`, `diffuse` and `specular`, means over all samples; `N`
    /// and `tangent`, `Z` and `uv`, means over the samples that see a surface, zero if none does,
    /// not normalised; `yarn_id` and `yarn_type` of the first sample, [`NO_YARN`] if it sees none;
    /// `samples`; `variance`, the variance of the radiance's mean as it would be of independent
    /// samples (those of a sequence are better), 0 for less than two.
    pub fn exposed(&self) -> Exposed {
        let beauty = self.beauty();
        let planes = match self.layers {
            Layers::None => Vec::new(),
            Layers::All => self.planes(),
        };
        Exposed { frame: self.frame, beauty, planes }
    }

    fn planes(&self) -> Vec<Plane> {
        let mean = |count: u32, sum: f32| if count == 0 { 0.0 } else { sum / count as f32 };
        let over_all = |of: fn(&LayerSums) -> f32| {
            self.reals(move |tile, sums, _| mean(tile.samples, of(sums)))
        };
        let over_hits =
            |of: fn(&LayerSums) -> f32| self.reals(move |_, sums, _| mean(sums.hits, of(sums)));
        let variance = |axis: usize| {
            self.reals(move |tile, sums, sum| {
                let n = f64::from(tile.samples);
                let squares = (sums.squares[axis] - sum[axis] * sum[axis] / n).max(0.0);
                if tile.samples < 2 { 0.0 } else { (squares / (n * (n - 1.0))) as f32 }
            })
        };
        let plane = |layer, channel, values| Plane { layer, channel, values };
        vec![
            plane("albedo", "R", over_all(|sums| sums.albedo.x)),
            plane("albedo", "G", over_all(|sums| sums.albedo.y)),
            plane("albedo", "B", over_all(|sums| sums.albedo.z)),
            plane("N", "X", over_hits(|sums| sums.normal.x)),
            plane("N", "Y", over_hits(|sums| sums.normal.y)),
            plane("N", "Z", over_hits(|sums| sums.normal.z)),
            plane("Z", "", over_hits(|sums| sums.distance)),
            plane("uv", "U", over_hits(|sums| sums.uv.x)),
            plane("uv", "V", over_hits(|sums| sums.uv.y)),
            plane("diffuse", "R", over_all(|sums| sums.diffuse.x)),
            plane("diffuse", "G", over_all(|sums| sums.diffuse.y)),
            plane("diffuse", "B", over_all(|sums| sums.diffuse.z)),
            plane("specular", "R", over_all(|sums| sums.specular.x)),
            plane("specular", "G", over_all(|sums| sums.specular.y)),
            plane("specular", "B", over_all(|sums| sums.specular.z)),
            plane("tangent", "X", over_hits(|sums| sums.tangent.x)),
            plane("tangent", "Y", over_hits(|sums| sums.tangent.y)),
            plane("tangent", "Z", over_hits(|sums| sums.tangent.z)),
            plane("yarn_id", "", self.numbers(|_, sums| sums.yarn_id)),
            plane("yarn_type", "", self.numbers(|_, sums| sums.yarn_type)),
            plane("samples", "", self.numbers(|tile, _| tile.samples)),
            plane("variance", "R", variance(0)),
            plane("variance", "G", variance(1)),
            plane("variance", "B", variance(2)),
        ]
    }

    /// A number for each pixel, of its tile, its layers and the sum of its radiance.
    fn reals(&self, of: impl Fn(&Tile, &LayerSums, DVec3) -> f32) -> Values {
        let size = self.frame.crop_size();
        let mut values = vec![0.0; size.width() as usize * size.height() as usize];
        self.each(|tile, pixel, place| {
            values[place] = of(tile, &tile.layers[pixel], tile.sums[pixel]);
        });
        Values::F32(values)
    }

    fn numbers(&self, of: impl Fn(&Tile, &LayerSums) -> u32) -> Values {
        let size = self.frame.crop_size();
        let mut values = vec![0; size.width() as usize * size.height() as usize];
        self.each(|tile, pixel, place| values[place] = of(tile, &tile.layers[pixel]));
        Values::U32(values)
    }

    /// Calls `visit` with each pixel of the crop: its tile, its index there and in the crop.
    fn each(&self, mut visit: impl FnMut(&Tile, usize, usize)) {
        let crop = self.frame.crop();
        let (min, max) = (crop.min(), crop.max());
        for tile in &self.tiles {
            for (pixel, [x, y]) in tile.rectangle.pixels().enumerate() {
                if x >= min[0] && y >= min[1] && x < max[0] && y < max[1] {
                    let row = (y - min[1]) as usize * crop.width() as usize;
                    visit(tile, pixel, row + (x - min[0]) as usize);
                }
            }
        }
    }
}

/// The sums of a tile.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tile {
    pub(super) rectangle: Crop,
    /// Samples of each pixel.
    pub(super) samples: u32,
    /// Of the radiance, pixel by pixel as [`Crop::pixels`]: in the order of the samples.
    pub(super) sums: Vec<DVec3>,
    /// Of the radiance of even samples; empty without halves.
    pub(super) evens: Vec<DVec3>,
    /// Empty without layers.
    pub(super) layers: Vec<LayerSums>,
}

/// The sums of what is kept of a pixel besides its radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LayerSums {
    /// Of the squares of the radiance; in f64, as most of it cancels in the variance.
    pub(super) squares: DVec3,
    pub(super) albedo: Vec3,
    pub(super) normal: Vec3,
    pub(super) tangent: Vec3,
    pub(super) diffuse: Vec3,
    pub(super) specular: Vec3,
    pub(super) distance: f32,
    pub(super) uv: Vec2,
    /// Samples that see a surface.
    pub(super) hits: u32,
    /// Of the first sample.
    pub(super) yarn_id: u32,
    pub(super) yarn_type: u32,
}

impl Tile {
    fn new(rectangle: Crop, layers: Layers, halves: Halves) -> Self {
        let pixels = rectangle.width() as usize * rectangle.height() as usize;
        let evens = if halves == Halves::Two { pixels } else { 0 };
        let layers = if layers == Layers::All { pixels } else { 0 };
        Self {
            rectangle,
            samples: 0,
            sums: vec![DVec3::ZERO; pixels],
            evens: vec![DVec3::ZERO; evens],
            layers: vec![LayerSums::ZERO; layers],
        }
    }

    /// Number of pixels.
    pub(super) fn pixels(&self) -> u64 {
        self.sums.len() as u64
    }

    /// Adds samples to each pixel until there are `samples`. In which portions they are added
    /// changes no bit.
    pub(super) fn expose(&mut self, subject: &impl Expose, samples: u32) {
        let (places, pixels) = self.by_blocks();
        for sample in self.samples..samples {
            let is_even = sample % 2 == 0;
            let index = match &self.evens[..] {
                [] => sample,
                _ => sample / 2 + if is_even { 0 } else { MAX_SAMPLES },
            };
            for (&pixel, exposure) in places.iter().zip(&subject.expose_all(&pixels, index)) {
                let radiance = exposure.radiance.as_dvec3();
                self.sums[pixel] += radiance;
                if let Some(even) = self.evens.get_mut(pixel).filter(|_| is_even) {
                    *even += radiance;
                }
                if let Some(sums) = self.layers.get_mut(pixel) {
                    sums.add(exposure, sample == 0);
                }
            }
        }
        self.samples = self.samples.max(samples);
    }

    /// Its pixels, after their places in the sums, so that those that stand close to each other in the
    /// list do so in the picture: what they see is close by too, and is dealt with together.
    fn by_blocks(&self) -> (Vec<usize>, Vec<[u32; 2]>) {
        /// Pixels along each side of a block.
        const BLOCK: u32 = 4;
        let mut pixels: Vec<_> = self.rectangle.pixels().enumerate().collect();
        pixels.sort_by_key(|(_, [x, y])| [y / BLOCK, x / BLOCK]);
        pixels.into_iter().unzip()
    }

    /// An estimate of the error of the tile's means, see [`relative_error`]; infinite for less than
    /// two samples or without halves.
    ///
    /// The means of the halves are independent. Those of m and n samples differ by a variance of
    /// σ²(1/m + 1/n), of which that of the mean of all, σ²/(m + n), is the part mn/(m + n)².
    pub(super) fn error(&self) -> f64 {
        if self.samples < 2 || self.evens.is_empty() {
            return f64::INFINITY;
        }
        let all = f64::from(self.samples);
        let even = f64::from(self.samples.div_ceil(2));
        let odd = all - even;
        let part = (even * odd).sqrt() / all;
        let squares = self.sums.iter().zip(&self.evens).map(|(&sum, &even_sum)| {
            let difference = even_sum / even - (sum - even_sum) / odd;
            relative_error(sum / all, difference * part).length_squared()
        });
        (squares.sum::<f64>() / (3 * self.sums.len()) as f64).sqrt()
    }
}

/// What is added to squares of values under which errors no longer count in proportion.
const DARK_SQ: f64 = 0.01;

/// What an `error` of a mean `radiance` amounts to, by component:
///
/// ```text
/// |t′(x)| ε / √(t(x)² + 0.01),  t(x) = x up to 1, else 1 + ln x
/// ```
///
/// Up to white, the square is that of relMSE, as pictures are compared by; beyond, where screens
/// compress, errors count as little as they show.
pub fn relative_error(radiance: DVec3, error: DVec3) -> DVec3 {
    let of = |x: f64, error: f64| {
        let (shown, slope) = if x <= 1.0 { (x, 1.0) } else { (1.0 + x.ln(), 1.0 / x) };
        slope * error.abs() / (shown * shown + DARK_SQ).sqrt()
    };
    DVec3::new(of(radiance.x, error.x), of(radiance.y, error.y), of(radiance.z, error.z))
}

impl LayerSums {
    pub(super) const ZERO: Self = Self {
        squares: DVec3::ZERO,
        albedo: Vec3::ZERO,
        normal: Vec3::ZERO,
        tangent: Vec3::ZERO,
        diffuse: Vec3::ZERO,
        specular: Vec3::ZERO,
        distance: 0.0,
        uv: Vec2::ZERO,
        hits: 0,
        yarn_id: NO_YARN,
        yarn_type: NO_YARN,
    };

    fn add(&mut self, exposure: &Exposure, is_first: bool) {
        let radiance = exposure.radiance.as_dvec3();
        self.squares += radiance * radiance;
        self.diffuse += exposure.diffuse;
        self.specular += exposure.specular;
        let Some(seen) = &exposure.first else { return };
        self.hits += 1;
        self.albedo += seen.albedo;
        self.normal += seen.normal;
        self.tangent += seen.tangent;
        self.distance += seen.distance;
        self.uv += seen.uv;
        if let Some(yarn) = seen.yarn.filter(|_| is_first) {
            self.yarn_id = yarn.id;
            self.yarn_type = yarn.kind.into();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{
        exposure::{FirstHit, YarnSeen},
        film::Size,
    };

    /// Sees a surface but in sample 3, and a yarn in one; the radiance is the index of the sample.
    struct Subject {
        yarn_at: u32,
    }

    impl Expose for Subject {
        fn expose(&self, _: [u32; 2], index: u32) -> Exposure {
            let yarn = (index == self.yarn_at).then_some(YarnSeen { id: 9, kind: 2 });
            let first = FirstHit {
                albedo: Vec3::splat(0.5),
                normal: Vec3::Z,
                tangent: Vec3::X,
                distance: index as f32 + 1.0,
                uv: Vec2::new(index as f32, 3.0),
                yarn,
            };
            let radiance = Vec3::splat(index as f32);
            let first = (index != 3).then_some(first);
            Exposure { radiance, diffuse: radiance * 0.25, specular: radiance * 0.75, first }
        }
    }

    fn exposed(yarn_at: u32) -> Exposed {
        let frame = Frame::whole(Size::new(2, 1).unwrap());
        let mut accumulator = Accumulator::new(frame, Layers::All, Halves::None);
        accumulator.tiles[0].expose(&Subject { yarn_at }, 4);
        accumulator.exposed()
    }

    fn values<'a>(exposed: &'a Exposed, layer: &str, channel: &str) -> &'a Values {
        let is = |plane: &&Plane| plane.layer == layer && plane.channel == channel;
        &exposed.planes.iter().find(is).unwrap().values
    }

    #[test]
    fn planes_are_means_over_what_they_are_of() {
        let exposed = exposed(0);
        assert_eq!(exposed.beauty.pixels(), [Vec3::splat(1.5); 2]);
        // Variance 5/3 of 0, 1, 2, 3, of the mean a quarter of it.
        for (layer, channel, expected) in [
            ("albedo", "G", 0.375),
            ("N", "Z", 1.0),
            ("tangent", "X", 1.0),
            ("Z", "", 2.0),
            ("uv", "U", 1.0),
            ("uv", "V", 3.0),
            ("diffuse", "R", 0.375),
            ("specular", "B", 1.125),
            ("variance", "R", 5.0 / 12.0),
        ] {
            let found = values(&exposed, layer, channel);
            assert_eq!(*found, Values::F32(vec![expected; 2]), "{layer}.{channel}");
        }
        assert_eq!(*values(&exposed, "samples", ""), Values::U32(vec![4; 2]));
    }

    #[test]
    fn yarn_is_that_of_the_first_sample() {
        let (first, later) = (exposed(0), exposed(1));
        assert_eq!(*values(&first, "yarn_id", ""), Values::U32(vec![9; 2]));
        assert_eq!(*values(&first, "yarn_type", ""), Values::U32(vec![2; 2]));
        assert_eq!(*values(&later, "yarn_id", ""), Values::U32(vec![NO_YARN; 2]));
        assert_eq!(*values(&later, "yarn_type", ""), Values::U32(vec![NO_YARN; 2]));
    }

    #[test]
    fn nothing_exposed_is_black() {
        let frame = Frame::whole(Size::new(17, 2).unwrap());
        let exposed = Accumulator::new(frame, Layers::All, Halves::Two).exposed();
        assert!(exposed.beauty == Film::black(frame.size()));
        for plane in &exposed.planes {
            if let Values::F32(values) = &plane.values {
                assert!(values.iter().all(|value| *value == 0.0), "{plane:?}");
            }
        }
    }

    #[test]
    fn memory_is_as_stated() {
        assert_eq!(size_of::<DVec3>(), 24);
        assert_eq!(size_of::<LayerSums>(), 112);
    }

    #[test]
    fn error_is_relative_up_to_white_and_as_it_shows_beyond() {
        let at = |x: f64| relative_error(DVec3::splat(x), DVec3::splat(-0.1)).x;
        assert!((at(0.0) - 1.0).abs() < 1e-12);
        assert!((at(0.5) - 0.1 / 0.26_f64.sqrt()).abs() < 1e-12);
        assert!((at(1.0) - at(1.0 + 1e-9)).abs() < 1e-9, "no step at white");
        let e = std::f64::consts::E;
        assert!((at(e) - 0.1 / e / 4.01_f64.sqrt()).abs() < 1e-12);
    }
}
