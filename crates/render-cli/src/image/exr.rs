//! OpenEXR: linear values, any number of layers, and what is said about the picture.
//!
//! Written is one part of scan lines with ZIP compression, which loses nothing. Channels are called
//! `LAYER.CHANNEL`, those of the beauty layer `R`, `G`, `B`. Equal pictures give equal bytes.
//!
//! Read is any file of scan lines or tiles, of one part or several, with or without smaller levels
//! (which are left out), except deep data and channels of a lower resolution.

use std::{collections::HashMap, io::Cursor};

use exr::{
    block::{
        UncompressedBlock,
        chunk::{Chunk, CompressedBlock},
        reader::ChunksReader,
    },
    error::Error as DecoderError,
    image::{
        AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer as Part,
        write::WritableImage,
    },
    math::Vec2,
    meta::{
        BlockDescription, MetaData,
        attribute::{AttributeValue, Compression, LineOrder, SampleType, Text},
        header::{Header, LayerAttributes},
    },
    prelude::f16,
};
use thiserror::Error;

use super::{
    Channel, EncodeError, Layer, Picture, Samples, Value,
    limit::{MAX_CHANNELS, MAX_SAMPLES, TooShort},
};
use crate::render::film::{MAX_PIXELS, Size, SizeError};

/// Why bytes are not a picture that can be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ExrError {
    /// The size of a part is not one of a picture.
    #[error("data window")]
    Size(#[from] SizeError),
    /// There are more channels than any renderer writes.
    #[error("found {found} channels, expected at most {MAX_CHANNELS}")]
    Channels {
        /// How many there are.
        found: usize,
    },
    /// There are more numbers than fit.
    #[error("found {found} numbers in all channels, expected at most {}", MAX_SAMPLES)]
    TooMany {
        /// How many there are.
        found: u64,
    },
    /// The file is too short for what it claims to hold.
    #[error(transparent)]
    TooShort(#[from] TooShort),
    /// The parts do not cover each other.
    #[error("part {part}: found {found}, expected {expected} as in part 1")]
    Parts {
        /// The part, from 1.
        part: usize,
        /// Its data window.
        found: String,
        /// That of the first.
        expected: String,
    },
    /// A channel has fewer numbers than pixels.
    #[error("channel {channel}: found a number for {x}x{y} pixels, expected one for each")]
    Subsampled {
        /// The channel.
        channel: String,
        /// Pixels to a number in a row.
        x: usize,
        /// Rows to a number.
        y: usize,
    },
    /// Two channels have one name.
    #[error("channel {channel}: found twice, expected once")]
    Twice {
        /// The channel.
        channel: String,
    },
    /// There is nothing to see.
    #[error("found a part without channels, expected at least one")]
    NoChannels,
    /// Tiles are larger than any picture.
    #[error("found tiles of {x}x{y} pixels, expected at most {MAX_PIXELS} pixels")]
    Tiles {
        /// Pixels of a tile in a row.
        x: usize,
        /// Rows of a tile.
        y: usize,
    },
    /// Pixels say they belong elsewhere.
    #[error("found pixels with a place outside the picture, expected one within")]
    Misplaced,
    /// The file ends too soon.
    #[error("found its end too soon, expected more pixels or attributes")]
    Truncated,
    /// The file is damaged or of a kind that is not read.
    #[error("cannot be decoded")]
    Decode(#[source] DecoderError),
}

impl From<DecoderError> for ExrError {
    fn from(error: DecoderError) -> Self {
        // The decoder has this text for the end of the file, and no kind.
        match error {
            DecoderError::Invalid(text) if text == "reference to missing bytes" => Self::Truncated,
            error => Self::Decode(error),
        }
    }
}

/// What is an attribute of every file, and so cannot be said about a picture.
const STRUCTURE: [&str; 12] = [
    "channels",
    "chunkCount",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "name",
    "pixelAspectRatio",
    "screenWindowCenter",
    "screenWindowWidth",
    "tiles",
    "type",
];

/// The type of an attribute that is a list of numbers.
const LIST: &str = "floatvector";

/// The bytes of a file that holds `picture`.
///
/// # Errors
///
/// [`EncodeError`] when something said about it has a name that an attribute cannot have.
pub(super) fn encode(picture: &Picture) -> Result<Vec<u8>, EncodeError> {
    let size = (picture.size().width() as usize, picture.size().height() as usize);
    let channels = picture.layers().iter().flat_map(|layer| {
        layer.channels.iter().map(move |channel| {
            let samples = match &channel.samples {
                Samples::F32(samples) => FlatSamples::F32(samples.clone()),
                Samples::U32(samples) => FlatSamples::U32(samples.clone()),
            };
            AnyChannel::new(text(&layer.full_name(channel)), samples)
        })
    });
    let channels = AnyChannels::sort(channels.collect());
    let mut attributes = LayerAttributes { other: HashMap::new(), ..Default::default() };
    for (name, value) in &picture.metadata {
        let fits = (1..256).contains(&name.len()) && !name.contains('\0');
        if !fits || STRUCTURE.contains(&name.as_str()) {
            return Err(EncodeError::Attribute { name: name.clone() });
        }
        if attributes.other.insert(text(name), attribute(value)).is_some() {
            return Err(EncodeError::Attribute { name: name.clone() });
        }
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(Part::new(size, attributes, encoding, channels))
        .write()
        // Standard names such as `owner` may come as any other.
        .skip_compatibility_checks()
        // Else it would start threads of its own, beside those of the command line.
        .non_parallel()
        .to_buffered(&mut bytes)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

fn attribute(value: &Value) -> AttributeValue {
    match value {
        Value::Text(value) => AttributeValue::Text(text(value)),
        Value::Integer(value) => AttributeValue::I32(*value),
        // In 32 bits where that is exact, as most attributes of files are.
        Value::Real(value) if f64::from(*value as f32).to_bits() == value.to_bits() => {
            AttributeValue::F32(*value as f32)
        }
        Value::Real(value) => AttributeValue::F64(*value),
        Value::List(values) => AttributeValue::Custom {
            kind: text(LIST),
            bytes: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        },
    }
}

/// Puts the attributes of a file of one part in the order of their names. The encoder, which keeps
/// ours in a hash table, writes them in an order that differs from run to run.
fn sort_attributes(file: &mut [u8]) {
    /// The number of the format, then its version.
    const START: usize = 8;
    let until_zero = |at: usize| at + file[at..].iter().take_while(|byte| **byte != 0).count();
    let mut attributes = Vec::new();
    let mut at = START;
    while file[at] != 0 {
        let kind = until_zero(at) + 1;
        let length = until_zero(kind) + 1;
        let bytes = file[length..length + 4].try_into().expect("a length has four bytes");
        let end = length + 4 + u32::from_le_bytes(bytes) as usize;
        attributes.push(file[at..end].to_vec());
        at = end;
    }
    attributes.sort();
    file[START..at].copy_from_slice(&attributes.concat());
}

/// The picture in a file of these bytes.
///
/// # Errors
///
/// [`ExrError`] when there is none, before memory is taken for one that is too large.
pub(super) fn decode(file: &[u8]) -> Result<Picture, ExrError> {
    let reader = exr::block::read(Cursor::new(file), false)?;
    let size = check(reader.headers(), file.len() as u64)?;
    let chunks = reader.filter_chunks(false, |_, tile, _| tile.level_index == FULL_LEVEL)?;
    let meta = chunks.meta_data().clone();
    let pixels = size.width() as usize * size.height() as usize;
    let mut parts: Vec<Vec<Samples>> = meta
        .headers
        .iter()
        .map(|part| part.channels.list.iter().map(|c| zeros(c.sample_type, pixels)).collect())
        .collect();
    for chunk in chunks {
        read_chunk(chunk?, &meta, &mut parts)?;
    }

    let mut channels = Vec::new();
    let mut metadata = Vec::new();
    for (part, samples) in meta.headers.iter().zip(parts) {
        let is_only = meta.headers.len() == 1;
        let prefix = part.own_attributes.layer_name.as_ref().filter(|_| !is_only).map(string);
        for (channel, samples) in part.channels.list.iter().zip(samples) {
            let name = string(&channel.name);
            let name = match &prefix {
                Some(prefix) if !name.starts_with(&format!("{prefix}.")) => {
                    format!("{prefix}.{name}")
                }
                _ => name,
            };
            channels.push((name, samples));
        }
    }
    for (name, value) in meta.headers.iter().flat_map(Header::all_named_attributes) {
        let name = String::from_utf8_lossy(name).into_owned();
        let is_new = metadata.iter().all(|(other, _)| *other != name);
        if let Some(value) = value_of(&value).filter(|_| is_new && !STRUCTURE.contains(&&*name)) {
            metadata.push((name, value));
        }
    }
    metadata.sort_by(|(a, _), (b, _)| a.cmp(b));
    let mut picture = Picture::new(size);
    for layer in layers(channels)? {
        picture.push(layer);
    }
    picture.metadata = metadata;
    Ok(picture)
}

/// How many numbers of all channels a file of these bytes claims to hold.
///
/// # Errors
///
/// As for [`decode`], as far as the head of the file tells.
pub(super) fn numbers(file: &[u8]) -> Result<u64, ExrError> {
    let reader = exr::block::read(Cursor::new(file), false)?;
    let size = check(reader.headers(), file.len() as u64)?;
    let channels: usize = reader.headers().iter().map(|part| part.channels.list.len()).sum();
    Ok(u64::from(size.width()) * u64::from(size.height()) * channels as u64)
}

/// The level that is the picture itself; others are smaller.
const FULL_LEVEL: Vec2<usize> = Vec2(0, 0);

fn zeros(kind: SampleType, count: usize) -> Samples {
    match kind {
        SampleType::U32 => Samples::U32(vec![0; count]),
        SampleType::F16 | SampleType::F32 => Samples::F32(vec![0.0; count]),
    }
}

/// Puts the numbers of a chunk in their places in `parts`.
///
/// The decoder has functions for that, which trust the place that a chunk says it has.
fn read_chunk(chunk: Chunk, meta: &MetaData, parts: &mut [Vec<Samples>]) -> Result<(), ExrError> {
    if let CompressedBlock::Tile(tile) = &chunk.compressed_block
        && tile.coordinates.level_index != FULL_LEVEL
    {
        return Err(ExrError::Misplaced);
    }
    let block = UncompressedBlock::decompress_chunk(chunk, meta, false)?;
    let at = block.index.layer;
    let (Some(part), Some(samples)) = (meta.headers.get(at), parts.get_mut(at)) else {
        return Err(ExrError::Misplaced);
    };
    let Vec2(width, height) = block.index.pixel_size;
    let end = block.index.pixel_position + block.index.pixel_size;
    if end.x() > part.layer_size.x()
        || end.y() > part.layer_size.y()
        || block.data.len() != width * height * part.channels.bytes_per_pixel
    {
        return Err(ExrError::Misplaced);
    }
    for line in block.lines(&part.channels) {
        let place = line.location.position;
        let start = place.y() * part.layer_size.width() + place.x();
        let range = start..start + width;
        match &mut samples[line.location.channel] {
            Samples::U32(samples) => fill(&mut samples[range], line.value, u32::from_ne_bytes),
            Samples::F32(samples) if line.value.len() == 2 * width => {
                fill(&mut samples[range], line.value, |half| f16::from_ne_bytes(half).to_f32());
            }
            Samples::F32(samples) => fill(&mut samples[range], line.value, f32::from_ne_bytes),
        }
    }
    Ok(())
}

/// Fills `samples` with what `number` makes of each N bytes.
fn fill<T, const N: usize>(samples: &mut [T], bytes: &[u8], number: impl Fn([u8; N]) -> T) {
    let words = bytes.as_chunks().0.iter();
    samples.iter_mut().zip(words).for_each(|(sample, word)| *sample = number(*word));
}

/// The size that all parts have, if they can be read.
fn check(parts: &[Header], file_length: u64) -> Result<Size, ExrError> {
    let found = parts.iter().map(|part| part.channels.list.len()).sum();
    if found > MAX_CHANNELS {
        return Err(ExrError::Channels { found });
    }
    let mut sizes = Vec::new();
    let [mut numbers, mut bytes] = [0_u64; 2];
    for (at, part) in parts.iter().enumerate() {
        let side = |side| u32::try_from(side).unwrap_or(u32::MAX);
        let size = Size::new(side(part.layer_size.width()), side(part.layer_size.height()))?;
        let corner = part.own_attributes.layer_position;
        let window = |(size, x, y): (Size, i32, i32)| {
            format!("{}x{} pixels at {x},{y}", size.width(), size.height())
        };
        sizes.push((size, corner.x(), corner.y()));
        if sizes[0] != sizes[at] {
            let [expected, found] = [window(sizes[0]), window(sizes[at])];
            return Err(ExrError::Parts { part: at + 1, found, expected });
        }
        if part.channels.list.is_empty() {
            return Err(ExrError::NoChannels);
        }
        if let BlockDescription::Tiles(tiles) = part.blocks {
            let Vec2(x, y) = tiles.tile_size;
            if x.saturating_mul(y) as u64 > MAX_PIXELS {
                return Err(ExrError::Tiles { x, y });
            }
        }
        let pixels = u64::from(size.width()) * u64::from(size.height());
        for channel in &part.channels.list {
            let [x, y] = [channel.sampling.x(), channel.sampling.y()];
            if [x, y] != [1, 1] {
                return Err(ExrError::Subsampled { channel: string(&channel.name), x, y });
            }
            numbers += pixels;
            bytes += pixels * channel.sample_type.bytes_per_sample() as u64;
        }
    }
    if numbers > MAX_SAMPLES {
        return Err(ExrError::TooMany { found: numbers });
    }
    TooShort::check(file_length, bytes)?;
    Ok(sizes[0].0)
}

fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.bytes()).into_owned()
}

/// What an attribute says, if it is text or numbers.
fn value_of(attribute: &AttributeValue) -> Option<Value> {
    match attribute {
        AttributeValue::Text(text) => Some(Value::Text(string(text))),
        AttributeValue::I32(value) => Some(Value::Integer(*value)),
        AttributeValue::F32(value) => Some(Value::Real((*value).into())),
        AttributeValue::F64(value) => Some(Value::Real(*value)),
        AttributeValue::Custom { kind, bytes } if string(kind) == LIST => {
            let numbers = bytes.as_chunks::<4>().0.iter();
            Some(Value::List(numbers.map(|number| f32::from_le_bytes(*number)).collect()))
        }
        _ => None,
    }
}

/// Channels that a layer without a name may have; others without a dot are layers of their own.
const BEAUTY_CHANNELS: [&str; 5] = ["R", "G", "B", "A", "Y"];

/// The layers that channels of these full names make: the beauty layer first, the others in the
/// order of the file; red, green and blue in this order.
fn layers(channels: Vec<(String, Samples)>) -> Result<Vec<Layer>, ExrError> {
    let mut layers: Vec<Layer> = Vec::new();
    for (full_name, samples) in channels {
        let [layer, name] = match full_name.rsplit_once('.') {
            Some((layer, name)) if !layer.is_empty() && !name.is_empty() => [layer, name],
            _ if BEAUTY_CHANNELS.contains(&&*full_name) => ["", &full_name],
            _ => [full_name.as_str(), ""],
        };
        let channel = Channel { name: name.to_owned(), samples };
        match layers.iter_mut().find(|other| other.name == layer) {
            Some(other) if other.channels.iter().any(|other| other.name == name) => {
                return Err(ExrError::Twice { channel: full_name });
            }
            Some(other) => other.channels.push(channel),
            None => layers.push(Layer { name: layer.to_owned(), channels: vec![channel] }),
        }
    }
    layers.sort_by_key(|layer| !layer.name.is_empty());
    for layer in &mut layers {
        let rank = |channel: &Channel| {
            ["R", "G", "B"].iter().position(|name| *name == channel.name).unwrap_or(3)
        };
        layer.channels.sort_by_key(rank);
    }
    Ok(layers)
}

#[cfg(test)]
pub(super) mod tests;
