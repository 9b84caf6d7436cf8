//! Maps as files: PNG of 8 or 16 bits, EXR of 32.

use png::{BitDepth, ColorType, Compression, Encoder, PixelDimensions, Unit};
use rayon::prelude::*;

use super::{
    Tile,
    maps::{Map, Maps, Texel},
};
use crate::{
    args::MapFormat,
    image::{self, Channel, EncodeError, Layer, Picture, Samples, Value, srgb_from_linear},
};

/// What a map says of itself besides its pixels, names and values: size and repeats of the tile.
fn metadata(tile: &Tile, maps: &Maps, map: Map) -> Vec<(&'static str, Value)> {
    let size = tile.size() * 1e3;
    let mut metadata = vec![
        ("software", Value::Text(format!("selvedge {}", env!("CARGO_PKG_VERSION")))),
        ("width_mm", Value::Real(size.x)),
        ("height_mm", Value::Real(size.y)),
    ];
    if map == Map::Height {
        let [low, high] = maps.height.map(|height| f64::from(height) * 1e3);
        metadata.push(("black_mm", Value::Real(low)));
        metadata.push(("white_mm", Value::Real(high)));
    }
    metadata
}

/// The bytes of a file of `map`.
///
/// Heights have 16 bits in any PNG.
///
/// # Errors
///
/// [`EncodeError`] when the encoder refuses it.
pub fn encode(
    tile: &Tile,
    maps: &Maps,
    map: Map,
    format: MapFormat,
) -> Result<Vec<u8>, EncodeError> {
    match format {
        MapFormat::Exr if !map.is_for_gltf() => exr(tile, maps, map),
        MapFormat::Png16 => png(tile, maps, map, BitDepth::Sixteen, map.components()),
        _ if map == Map::Height => png(tile, maps, map, BitDepth::Sixteen, map.components()),
        _ if map == Map::YarnId && tile.cloth.yarns.len() > 255 => {
            png(tile, maps, map, BitDepth::Sixteen, map.components())
        }
        _ => png(tile, maps, map, BitDepth::Eight, map.components()),
    }
}

/// The bytes of a PNG of 8 bits of the first `components` of `map`, 1 or 3.
///
/// # Errors
///
/// [`EncodeError`] when the encoder refuses it.
pub(crate) fn encode_bytes(
    tile: &Tile,
    maps: &Maps,
    map: Map,
    components: usize,
) -> Result<Vec<u8>, EncodeError> {
    png(tile, maps, map, BitDepth::Eight, components)
}

/// Its file's name.
pub fn name(map: Map, format: MapFormat) -> String {
    let extension = if format == MapFormat::Exr && !map.is_for_gltf() { "exr" } else { "png" };
    format!("{}.{extension}", map.name())
}

fn exr(tile: &Tile, maps: &Maps, map: Map) -> Result<Vec<u8>, EncodeError> {
    let names = if map.components() == 1 { &["Y"][..] } else { &["R", "G", "B"] };
    let channels = names.iter().enumerate().map(|(k, name)| {
        let samples = maps.texels.par_iter().map(|texel| maps.value(map, texel)[k]).collect();
        Channel { name: (*name).to_owned(), samples: Samples::F32(samples) }
    });
    let mut picture = Picture::new(tile.pixels);
    picture.push(Layer { name: String::new(), channels: channels.collect() });
    let named = metadata(tile, maps, map).into_iter();
    picture.metadata = named.map(|(name, value)| (name.to_owned(), value)).collect();
    picture.encode(image::Format::Exr)
}

fn png(
    tile: &Tile,
    maps: &Maps,
    map: Map,
    depth: BitDepth,
    components: usize,
) -> Result<Vec<u8>, EncodeError> {
    let is_index = map == Map::YarnId;
    let component = |texel: &Texel, k: usize, greatest: f32| {
        let value = maps.value(map, texel)[k];
        let shown =
            if map.is_color() && k < 3 { srgb_from_linear(value.clamp(0.0, 1.0)) } else { value };
        let scaled = if is_index { shown } else { greatest * shown };
        scaled.clamp(0.0, greatest).round()
    };
    let width = maps.width;
    let pixels: Vec<u8> = if depth == BitDepth::Eight {
        let row = |row: &[Texel]| -> Vec<u8> {
            let each = |texel| (0..components).map(move |k| component(texel, k, 255.0) as u8);
            row.iter().flat_map(each).collect()
        };
        maps.texels.par_chunks(width).flat_map_iter(row).collect()
    } else {
        let row = |row: &[Texel]| -> Vec<u8> {
            let word = |texel, k| (component(texel, k, 65535.0) as u16).to_be_bytes();
            let each = |texel| (0..components).flat_map(move |k| word(texel, k));
            row.iter().flat_map(each).collect()
        };
        maps.texels.par_chunks(width).flat_map_iter(row).collect()
    };

    let mut bytes = Vec::new();
    let (columns, rows) = (tile.pixels.width(), tile.pixels.height());
    let mut encoder = Encoder::new(&mut bytes, columns, rows);
    encoder.set_color(match components {
        1 => ColorType::Grayscale,
        3 => ColorType::Rgb,
        _ => ColorType::Rgba,
    });
    encoder.set_depth(depth);
    // What is fast hardly makes words of smooth heights any smaller.
    let is_wide = depth == BitDepth::Sixteen;
    encoder.set_compression(if is_wide { Compression::Balanced } else { Compression::Fast });
    if map.is_color() {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    }
    // glTF knows no size of a picture, and its validator complains of pixels that are not square.
    let has_size = !map.is_for_gltf();
    let per_meter = |pixels: u32, meters: f64| (f64::from(pixels) / meters).round() as u32;
    encoder.set_pixel_dims(has_size.then(|| PixelDimensions {
        xppu: per_meter(columns, tile.size().x),
        yppu: per_meter(rows, tile.size().y),
        unit: Unit::Meter,
    }));
    for (name, value) in metadata(tile, maps, map) {
        let text = match value {
            Value::Text(text) => text,
            Value::Real(number) => number.to_string(),
            _ => continue,
        };
        encoder.add_text_chunk(name.to_owned(), text)?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}
