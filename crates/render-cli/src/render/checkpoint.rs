//! An unfinished picture as bytes, to go on from later.
//!
//! All numbers are little-endian:
//!
//! ```text
//! header    magic "selvedge" "exposure", version u32, key u64, width, height u32,
//!           crop 4 × u32, layers, halves u8, elapsed ns u64
//!           FNV-1a of the header u64
//! tiles     samples u32, then by pixel
//!           sum 3 × f64; with halves: of even samples 3 × f64
//!           with layers: squares 3 × f64, albedo, N, tangent, diffuse, specular 3 × f32,
//!           Z f32, uv 2 × f32, hits, yarn_id, yarn_type u32
//! end       FNV-1a of all before u64
//! ```

use std::{
    io::{self, Read, Write},
    time::Duration,
};

use glam::{DVec3, Vec2, Vec3};
use thiserror::Error;

use super::{
    accumulate::{Accumulator, Halves, LayerSums, Layers, Tile},
    film::Crop,
    hash::Hashed,
    progressive::Plan,
    sampler::MAX_SAMPLES,
};

const MAGIC: &[u8; 16] = b"selvedgeexposure";
const VERSION: u32 = 1;

/// Bytes of the header before its hash.
const HEADER: usize = 16 + 4 + 8 + 8 + 16 + 2 + 8;

/// Why no picture can be gone on with from these bytes.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// They are something else.
    #[error("found no checkpoint, expected one that selvedge has written")]
    NotACheckpoint,
    /// They are of another version.
    #[error("found version {0}, expected {VERSION}")]
    Version(u32),
    /// The picture has another size.
    #[error("found a picture of {}x{}, expected {}x{}", .found[0], .found[1], .expected[0], .expected[1])]
    Size {
        /// Its width and height.
        found: [u32; 2],
        /// Those of the plan.
        expected: [u32; 2],
    },
    /// Another part of the picture is taken.
    #[error("found the part {found:?} of the picture, expected {expected:?}")]
    Crop {
        /// Left, top, right and bottom edge of the part.
        found: [u32; 4],
        /// Those of the plan.
        expected: [u32; 4],
    },
    /// Other sums are kept.
    #[error("found a picture {found} {what}, expected one {expected}")]
    Kept {
        /// `with` or `without`.
        found: &'static str,
        /// What is kept or not.
        what: &'static str,
        /// `with` or `without`.
        expected: &'static str,
    },
    /// The picture shows something else.
    #[error("found a picture of something else, expected one of the same input, seed and version")]
    Key,
    /// The end is missing.
    #[error("found {found} bytes, expected {expected}")]
    Truncated {
        /// How many bytes there are.
        found: u64,
        /// How many there should be.
        expected: u64,
    },
    /// There is more than a picture.
    #[error("found more than {0} bytes, expected as many")]
    TooLong(u64),
    /// Bytes are not as they were written.
    #[error("found bytes that were changed, expected them as they were written")]
    Corrupt,
    /// They cannot be read.
    #[error("cannot be read")]
    Unreadable(#[source] io::Error),
}

/// Writes `accumulator`, which is of `plan`.
///
/// # Errors
///
/// Those of the writer.
pub fn write(accumulator: &Accumulator, plan: &Plan, out: &mut dyn Write) -> io::Result<()> {
    let mut out = Hashed::new(out);
    let mut bytes = header(plan, accumulator.elapsed);
    out.write_all(&bytes)?;
    out.write_all(&out.hash.finish().to_le_bytes())?;
    for tile in &accumulator.tiles {
        bytes.clear();
        put_tile(tile, &mut bytes);
        out.write_all(&bytes)?;
    }
    out.inner.write_all(&out.hash.finish().to_le_bytes())
}

/// The accumulator of `plan` that [`write()`] has written; the limits of the plan may be others, but
/// not whether there is one of noise.
///
/// # Errors
///
/// [`CheckpointError`] when it is of another plan or not whole.
pub fn read(plan: &Plan, input: &mut dyn Read) -> Result<Accumulator, CheckpointError> {
    let mut accumulator = plan.start();
    let mut input = Input { reader: Hashed::new(input), read: 0, expected: length(&accumulator) };
    accumulator.elapsed = read_header(plan, &mut input)?;
    let mut bytes = Vec::new();
    for tile in &mut accumulator.tiles {
        bytes.resize(tile_length(tile), 0);
        input.fill(&mut bytes)?;
        tile_from(tile, &mut Numbers(&bytes));
        if tile.samples > MAX_SAMPLES {
            return Err(CheckpointError::Corrupt);
        }
    }
    input.check_hash()?;
    if input.reader.read(&mut [0]).map_err(CheckpointError::Unreadable)? > 0 {
        return Err(CheckpointError::TooLong(input.expected));
    }
    Ok(accumulator)
}

/// The part of the header that follows the version and precedes the time.
fn identity(plan: &Plan) -> Vec<u8> {
    let (size, crop) = (plan.frame.size(), plan.frame.crop());
    let mut bytes = plan.key.to_le_bytes().to_vec();
    let places = [size.width(), size.height()].into_iter().chain(edges(crop));
    bytes.extend(places.flat_map(u32::to_le_bytes));
    bytes.push((plan.layers == Layers::All).into());
    bytes.push((plan.halves() == Halves::Two).into());
    bytes
}

fn edges(crop: Crop) -> [u32; 4] {
    let (min, max) = (crop.min(), crop.max());
    [min[0], min[1], max[0], max[1]]
}

fn header(plan: &Plan, elapsed: Duration) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(identity(plan));
    let elapsed = u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX);
    bytes.extend(elapsed.to_le_bytes());
    bytes
}

/// Checks the header against `plan` and returns the time.
fn read_header(plan: &Plan, input: &mut Input<'_>) -> Result<Duration, CheckpointError> {
    let mut magic = [0; MAGIC.len()];
    match input.fill(&mut magic) {
        Err(CheckpointError::Truncated { found, .. }) if !is_magic(&magic[..found as usize]) => {
            return Err(CheckpointError::NotACheckpoint);
        }
        result => result?,
    }
    if !is_magic(&magic) {
        return Err(CheckpointError::NotACheckpoint);
    }
    let mut version = [0; 4];
    input.fill(&mut version)?;
    let version = u32::from_le_bytes(version);
    if version != VERSION {
        return Err(CheckpointError::Version(version));
    }
    let expected = identity(plan);
    let mut bytes = vec![0; expected.len() + 8];
    input.fill(&mut bytes)?;
    input.check_hash()?;
    let (found, elapsed) = bytes.split_at(expected.len());
    check_identity(plan, found)?;
    Ok(Duration::from_nanos(Numbers(elapsed).u64()))
}

/// Whether it begins like [`MAGIC`] and is not empty.
fn is_magic(bytes: &[u8]) -> bool {
    !bytes.is_empty() && MAGIC.starts_with(bytes)
}

/// Compares what makes a picture another one, the plainest first.
fn check_identity(plan: &Plan, found: &[u8]) -> Result<(), CheckpointError> {
    let mut found = Numbers(found);
    let key = found.u64();
    let found_size: [u32; 2] = std::array::from_fn(|_| found.u32());
    let size = plan.frame.size();
    if found_size != [size.width(), size.height()] {
        let expected = [size.width(), size.height()];
        return Err(CheckpointError::Size { found: found_size, expected });
    }
    let found_crop: [u32; 4] = std::array::from_fn(|_| found.u32());
    let expected = edges(plan.frame.crop());
    if found_crop != expected {
        return Err(CheckpointError::Crop { found: found_crop, expected });
    }
    let is_kept = [plan.layers == Layers::All, plan.halves() == Halves::Two];
    for (what, expected) in ["layers", "a limit of noise"].into_iter().zip(is_kept) {
        let [is_found] = found.take();
        if is_found != u8::from(expected) {
            let word = |is_with| if is_with { "with" } else { "without" };
            let (found, expected) = (word(!expected), word(expected));
            return Err(CheckpointError::Kept { found, what, expected });
        }
    }
    if key != plan.key {
        return Err(CheckpointError::Key);
    }
    Ok(())
}

/// Number of bytes of a checkpoint.
fn length(accumulator: &Accumulator) -> u64 {
    let tiles: u64 = accumulator.tiles.iter().map(|tile| tile_length(tile) as u64).sum();
    HEADER as u64 + 8 + tiles + 8
}

fn tile_length(tile: &Tile) -> usize {
    4 + 24 * (tile.sums.len() + tile.evens.len()) + LAYERS * tile.layers.len()
}

/// Bytes of the layers of a pixel.
const LAYERS: usize = 3 * 8 + 18 * 4 + 3 * 4;

fn put_tile(tile: &Tile, bytes: &mut Vec<u8>) {
    bytes.extend(tile.samples.to_le_bytes());
    for sum in tile.sums.iter().chain(&tile.evens) {
        put_f64(bytes, *sum);
    }
    for sums in &tile.layers {
        let LayerSums { albedo, normal, tangent, diffuse, specular, distance, uv, .. } = *sums;
        put_f64(bytes, sums.squares);
        let colors = [albedo, normal, tangent, diffuse, specular].map(|sum| sum.to_array());
        let others = [distance, uv.x, uv.y];
        let numbers = colors.as_flattened().iter().chain(&others);
        bytes.extend(numbers.copied().flat_map(f32::to_le_bytes));
        let counts = [sums.hits, sums.yarn_id, sums.yarn_type];
        bytes.extend(counts.into_iter().flat_map(u32::to_le_bytes));
    }
}

fn put_f64(bytes: &mut Vec<u8>, sum: DVec3) {
    bytes.extend(sum.to_array().into_iter().flat_map(f64::to_le_bytes));
}

/// The inverse of [`put_tile`].
fn tile_from(tile: &mut Tile, numbers: &mut Numbers<'_>) {
    tile.samples = numbers.u32();
    for sum in tile.sums.iter_mut().chain(&mut tile.evens) {
        *sum = numbers.f64x3();
    }
    for sums in &mut tile.layers {
        *sums = LayerSums {
            squares: numbers.f64x3(),
            albedo: numbers.f32x3(),
            normal: numbers.f32x3(),
            tangent: numbers.f32x3(),
            diffuse: numbers.f32x3(),
            specular: numbers.f32x3(),
            distance: numbers.f32(),
            uv: Vec2::new(numbers.f32(), numbers.f32()),
            hits: numbers.u32(),
            yarn_id: numbers.u32(),
            yarn_type: numbers.u32(),
        };
    }
}

/// Numbers of bytes that are known to be there.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (number, rest) = self.0.split_first_chunk().expect("the buffer has the length of all");
        self.0 = rest;
        *number
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }

    fn f32x3(&mut self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| self.f32()))
    }

    fn f64x3(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| f64::from_le_bytes(self.take())))
    }
}

/// Bytes to be read, counted and hashed.
struct Input<'a> {
    reader: Hashed<&'a mut dyn Read>,
    read: u64,
    /// How many there should be.
    expected: u64,
}

impl Input<'_> {
    fn fill(&mut self, mut bytes: &mut [u8]) -> Result<(), CheckpointError> {
        while !bytes.is_empty() {
            match self.reader.read(bytes) {
                Ok(0) => {
                    let Self { read: found, expected, .. } = *self;
                    return Err(CheckpointError::Truncated { found, expected });
                }
                Ok(read) => {
                    self.read += read as u64;
                    bytes = &mut bytes[read..];
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(CheckpointError::Unreadable(error)),
            }
        }
        Ok(())
    }

    /// Reads a hash, which must be that of all before.
    fn check_hash(&mut self) -> Result<(), CheckpointError> {
        let expected = self.reader.hash.finish();
        let mut found = [0; 8];
        self.fill(&mut found)?;
        if u64::from_le_bytes(found) == expected { Ok(()) } else { Err(CheckpointError::Corrupt) }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use proptest::prelude::*;

    use super::*;
    use crate::render::{
        exposure::{Expose, Exposure, FirstHit},
        film::{Frame, Size},
        progressive::{Control, Limits, expose},
    };

    struct Subject;

    impl Expose for Subject {
        fn expose(&self, [x, y]: [u32; 2], index: u32) -> Exposure {
            let radiance = Vec3::new(x as f32, y as f32, index as f32 + 0.1);
            let first = FirstHit {
                albedo: radiance * 0.1,
                normal: Vec3::Z,
                tangent: Vec3::X,
                distance: 0.3 * x as f32,
                uv: Vec2::new(y as f32, 0.7),
                yarn: None,
            };
            Exposure { radiance, diffuse: radiance, specular: Vec3::ONE, first: Some(first) }
        }
    }

    fn plan(layers: Layers, noise: Option<f32>) -> Plan {
        let limits = Limits { spp: 3, time: None, noise };
        let frame = Frame::cropped(Size::new(40, 20).unwrap(), "3,0,30,19".parse().unwrap());
        Plan { frame: frame.unwrap(), layers, limits, key: 5 }
    }

    fn exposed(plan: &Plan) -> Accumulator {
        let interrupt = AtomicBool::new(false);
        let control = Control::until(&interrupt);
        expose(&Subject, plan, &control).accumulator
    }

    fn bytes(plan: &Plan) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&exposed(plan), plan, &mut bytes).unwrap();
        bytes
    }

    fn message(plan: &Plan, bytes: &[u8]) -> String {
        read(plan, &mut &bytes[..]).unwrap_err().to_string()
    }

    #[test]
    fn what_is_written_is_read() {
        for layers in [Layers::None, Layers::All] {
            for noise in [None, Some(0.1)] {
                let plan = plan(layers, noise);
                let accumulator = exposed(&plan);
                let mut bytes = Vec::new();
                write(&accumulator, &plan, &mut bytes).unwrap();
                assert_eq!(bytes.len() as u64, length(&accumulator));
                assert_eq!(read(&plan, &mut &bytes[..]).unwrap(), accumulator);
            }
        }
    }

    #[test]
    fn each_difference_is_told() {
        let plan = plan(Layers::None, None);
        let bytes = bytes(&plan);
        let size = Size::new(41, 20).unwrap();
        let crop = plan.frame.crop();
        let frame = Frame::cropped(size, crop).unwrap();
        assert_eq!(
            message(&Plan { frame, ..plan }, &bytes),
            "found a picture of 40x20, expected 41x20"
        );
        let frame = Frame::whole(plan.frame.size());
        assert_eq!(
            message(&Plan { frame, ..plan }, &bytes),
            "found the part [3, 0, 30, 19] of the picture, expected [0, 0, 40, 20]"
        );
        assert_eq!(
            message(&Plan { layers: Layers::All, ..plan }, &bytes),
            "found a picture without layers, expected one with"
        );
        let limits = Limits { noise: Some(0.1), ..plan.limits };
        assert_eq!(
            message(&Plan { limits, ..plan }, &bytes),
            "found a picture without a limit of noise, expected one with"
        );
        assert_eq!(
            message(&Plan { key: 6, ..plan }, &bytes),
            "found a picture of something else, expected one of the same input, seed and version"
        );
        let limits = Limits { spp: 9, time: Some(Duration::from_secs(1)), noise: None };
        assert!(read(&Plan { limits, ..plan }, &mut &bytes[..]).is_ok());
    }

    #[test]
    fn other_files_are_told() {
        let plan = plan(Layers::None, None);
        let expected = "found no checkpoint, expected one that selvedge has written";
        for other in
            [&b""[..], b"x", b"selvedgf", b"\x89PNG\r\n\x1a\n0123456789 more than a header"]
        {
            assert_eq!(message(&plan, other), expected, "{other:?}");
        }
        let mut newer = bytes(&plan);
        newer[16] = 2;
        assert_eq!(message(&plan, &newer), "found version 2, expected 1");
    }

    #[test]
    fn each_missing_end_is_told() {
        let plan = plan(Layers::None, None);
        let mut bytes = bytes(&plan);
        let expected = bytes.len();
        for found in (1..100).chain([expected / 2, expected - 9, expected - 1]) {
            let message = message(&plan, &bytes[..found]);
            assert_eq!(message, format!("found {found} bytes, expected {expected}"));
        }
        bytes.push(0);
        let message = message(&plan, &bytes);
        assert_eq!(message, format!("found more than {expected} bytes, expected as many"));
    }

    proptest! {
        #[test]
        fn changed_bytes_are_not_taken(
            changes in prop::collection::vec((any::<prop::sample::Index>(), 1..=u8::MAX), 1..4),
        ) {
            let plan = plan(Layers::All, Some(0.1));
            let whole = bytes(&plan);
            let mut changed = whole.clone();
            for (at, change) in changes {
                changed[at.index(whole.len())] ^= change;
            }
            prop_assume!(changed != whole);
            prop_assert!(read(&plan, &mut &changed[..]).is_err());
        }

        #[test]
        fn any_bytes_behind_a_good_header_are_refused(
            tail in prop::collection::vec(any::<u8>(), 0..2000),
        ) {
            let plan = plan(Layers::None, None);
            let mut bytes = bytes(&plan);
            bytes.truncate(HEADER + 8);
            bytes.extend(tail);
            prop_assert!(read(&plan, &mut &bytes[..]).is_err());
        }
    }
}
