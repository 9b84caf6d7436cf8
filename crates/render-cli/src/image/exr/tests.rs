#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use exr::{
    image::{Layers, Levels, write::layers::WritableLayers},
    math::RoundingMode,
    meta::{
        attribute::{IntegerBounds, LevelMode},
        header::ImageAttributes,
    },
    prelude::SmallVec,
};
use glam::Vec3;

use super::*;

const SIZE: (usize, usize) = (5, 3);

fn ramp() -> Vec<f32> {
    (0..SIZE.0 * SIZE.1).map(|k| k as f32 - 4.5).collect()
}

fn picture() -> Picture {
    let mut picture = Picture::new(Size::new(SIZE.0 as u32, SIZE.1 as u32).unwrap());
    let vectors: Vec<_> = ramp().iter().map(|&x| Vec3::new(x, x * x, 1.0 / x)).collect();
    picture.push(Layer::colors("", &vectors));
    picture.push(Layer::vectors("N", &vectors));
    picture.push(Layer::quantity("Z", ramp()));
    picture.push(Layer::colors("albedo", &vectors));
    let places: Vec<_> = vectors.iter().map(|v| v.truncate()).collect();
    picture.push(Layer::places("uv", &places));
    picture.push(Layer::numbers("yarn_id", (0..15).map(|k| u32::MAX - k).collect()));
    picture.metadata = [
        ("normalization", Value::List(vec![0.25, f32::MIN_POSITIVE])),
        ("owner", "Wéber & Söhne".into()),
        ("seed", "18446744073709551615".into()),
        ("spp", Value::Integer(64)),
        ("time", Value::Real(0.1)),
        ("version of a very long name indeed", Value::Real(0.5)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into();
    picture
}

#[test]
fn what_is_written_is_read_back() {
    let picture = picture();
    assert_eq!(decode(&encode(&picture).unwrap()).unwrap(), picture);
}

#[test]
fn numbers_that_are_not_finite_are_kept() {
    let mut picture = Picture::new(Size::new(2, 1).unwrap());
    picture.push(Layer::quantity("Z", vec![f32::NAN, f32::NEG_INFINITY]));
    let layer = decode(&encode(&picture).unwrap()).unwrap().into_layer("Z").unwrap();
    let Samples::F32(found) = &layer.layers()[0].channels[0].samples else { panic!() };
    assert!(found[0].is_nan() && found[1] == f32::NEG_INFINITY, "{found:?}");
}

#[test]
fn equal_pictures_give_equal_bytes() {
    // A hash table has another order in each of these.
    let first = encode(&picture()).unwrap();
    for _ in 0..20 {
        assert!(encode(&picture()).unwrap() == first);
    }
}

#[test]
fn names_that_no_attribute_can_have_are_refused() {
    for name in ["", "dataWindow", "a\0b", &"n".repeat(256)] {
        let mut picture = picture();
        picture.metadata.push((name.to_owned(), Value::Integer(1)));
        let error = encode(&picture).unwrap_err();
        assert!(matches!(error, EncodeError::Attribute { .. }), "{name}: {error}");
    }
    let mut picture = picture();
    picture.metadata.push(("spp".to_owned(), Value::Integer(1)));
    assert!(encode(&picture).is_err());
}

fn channel<T>(name: &str, samples: T) -> AnyChannel<T>
where
    AnyChannel<T>: Sized,
{
    AnyChannel {
        name: text(name),
        sample_data: samples,
        quantize_linearly: false,
        sampling: Vec2(1, 1),
    }
}

/// The bytes of a file that a program other than ours might write.
fn file<T>(image: &Image<T>) -> Vec<u8>
where
    for<'a> T: WritableLayers<'a>,
{
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn encoding(compression: Compression, blocks: Blocks) -> Encoding {
    Encoding { compression, blocks, line_order: LineOrder::Increasing }
}

/// A file of halves, by [`ramp`].
pub(in crate::image) fn halves(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let halves = ramp().into_iter().map(f16::from_f32).collect();
    let list = SmallVec::from_vec(vec![channel("G", FlatSamples::F16(halves))]);
    let encoding = encoding(compression, blocks);
    file(&Image::from_encoded_channels(SIZE, encoding, AnyChannels { list }))
}

#[test]
fn every_compression_in_lines_or_tiles_is_read() {
    use Compression::{PIZ, RLE, Uncompressed, ZIP1, ZIP16};
    for compression in [Uncompressed, RLE, ZIP1, ZIP16, PIZ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(2, 2))] {
            let found = decode(&halves(compression, blocks)).unwrap();
            let samples = &found.layer("").unwrap().channels[0].samples;
            assert_eq!(samples, &Samples::F32(ramp()), "{compression:?} {blocks:?}");
        }
    }
}

#[test]
fn of_smaller_levels_the_full_one_is_read() {
    let level = |[w, h]: [usize; 2]| FlatSamples::F32(vec![w as f32; w * h]);
    let levels = Levels::Mip {
        rounding_mode: RoundingMode::Down,
        level_data: [[5, 3], [2, 1], [1, 1]].map(level).into(),
    };
    let channels = AnyChannels { list: SmallVec::from_vec(vec![channel("Z", levels)]) };
    let tiles = encoding(Compression::ZIP16, Blocks::Tiles(Vec2(2, 2)));
    let bytes = file(&Image::from_encoded_channels(SIZE, tiles, channels));
    let meta = MetaData::read_from_buffered(bytes.as_slice(), false).unwrap();
    let exr::meta::BlockDescription::Tiles(tiles) = meta.headers[0].blocks else { panic!() };
    assert_eq!(tiles.level_mode, LevelMode::MipMap);
    let found = decode(&bytes).unwrap();
    assert_eq!(found.layers(), [Layer::quantity("Z", vec![5.0; 15])]);
}

/// Name, channel, corner and size of a part.
type PartOf<'a> = (&'a str, &'a str, [i32; 2], (usize, usize));

fn parts(parts: &[PartOf<'_>]) -> Vec<u8> {
    let parts: Layers<AnyChannels<FlatSamples>> = parts
        .iter()
        .map(|(part, name, [x, y], size)| {
            let attributes = LayerAttributes::named(*part).with_position(Vec2(*x, *y));
            let samples = FlatSamples::F32(vec![1.0; size.0 * size.1]);
            let list = SmallVec::from_vec(vec![channel(name, samples)]);
            let encoding = encoding(Compression::ZIP16, Blocks::ScanLines);
            Part::new(*size, attributes, encoding, AnyChannels { list })
        })
        .collect();
    let window = IntegerBounds::from_dimensions(Vec2(9, 9));
    file(&Image::from_layers(ImageAttributes::new(window), parts))
}

#[test]
fn parts_are_layers() {
    let bytes =
        parts(&[("left", "R", [2, 1], SIZE), ("N", "N.X", [2, 1], SIZE), ("Z", "Z", [2, 1], SIZE)]);
    let found = decode(&bytes).unwrap();
    let names: Vec<_> = found
        .layers()
        .iter()
        .flat_map(|layer| layer.channels.iter().map(|channel| layer.full_name(channel)))
        .collect();
    assert_eq!(names, ["left.R", "N.X", "Z.Z"]);
}

#[test]
fn parts_that_do_not_cover_each_other_are_refused() {
    for (corner, size, expected) in [
        ([0, 1], SIZE, "part 2: found 5x3 pixels at 0,1, expected 5x3 pixels at 0,0"),
        ([0, 0], (4, 3), "part 2: found 4x3 pixels at 0,0, expected 5x3 pixels at 0,0"),
    ] {
        let bytes = parts(&[("a", "R", [0, 0], SIZE), ("b", "R", corner, size)]);
        let error = decode(&bytes).unwrap_err().to_string();
        assert_eq!(error, format!("{expected} as in part 1"));
    }
}

#[test]
fn truncated_files_are_told_as_such() {
    let bytes = encode(&picture()).unwrap();
    for length in 4..bytes.len() {
        let error = decode(&bytes[..length]).unwrap_err();
        assert!(matches!(error, ExrError::Truncated), "{length}: {error:?}");
    }
}

#[test]
fn tiles_of_a_level_that_is_not_there_are_refused() {
    let mut bytes = halves(Compression::Uncompressed, Blocks::Tiles(Vec2(2, 2)));
    // The last tile: two numbers of its place and two of its level, its length, one half.
    let level = bytes.len() - 2 - 4 - 8;
    for (x, y) in [(1_i32, 0_i32), (0, 1), (64, 0), (-1, 0)] {
        bytes[level..level + 4].copy_from_slice(&x.to_le_bytes());
        bytes[level + 4..level + 8].copy_from_slice(&y.to_le_bytes());
        let error = decode(&bytes).unwrap_err();
        let is_told = matches!(error, ExrError::Misplaced | ExrError::Decode(_));
        assert!(is_told, "{x},{y}: {error:?}");
    }
}

/// The file with the size in its header that `width` and `height` say.
fn claiming(width: i32, height: i32) -> Vec<u8> {
    let mut bytes = encode(&picture()).unwrap();
    let mut set = |key: &[u8], at: usize, value: i32| {
        let found = bytes.windows(key.len()).position(|window| window == key).unwrap();
        let at = found + key.len() + at;
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    };
    set(b"chunkCount\0int\0\x04\0\0\0", 0, (height + 15) / 16);
    set(b"dataWindow\0box2i\0\x10\0\0\0", 8, width - 1);
    set(b"dataWindow\0box2i\0\x10\0\0\0", 12, height - 1);
    bytes
}

#[test]
fn claims_are_checked_before_memory_is_taken() {
    let claim = |width, height| decode(&claiming(width, height)).unwrap_err();
    let error = claim(1 << 20, 1 << 20);
    assert!(matches!(error, ExrError::Size(SizeError::TooLarge(_))), "{error:?}");
    let error = claim(8192, 8192);
    assert!(matches!(error, ExrError::TooShort(_)), "{error:?}");
    let meta = MetaData::read_from_buffered(claiming(8192, 8192).as_slice(), false).unwrap();
    let error = check(&vec![meta.headers[0].clone(); 3], u64::MAX).unwrap_err().to_string();
    // Thirteen channels in each of three parts.
    let expected = "found 2617245696 numbers in all channels, expected at most 2147483648";
    assert_eq!(error, expected);
    let error = check(&vec![meta.headers[0].clone(); 100], u64::MAX).unwrap_err().to_string();
    assert_eq!(error, "found 1300 channels, expected at most 1024");
    let error = claim(0, 3);
    assert!(matches!(error, ExrError::Decode(_) | ExrError::Size(_)), "{error:?}");
}
