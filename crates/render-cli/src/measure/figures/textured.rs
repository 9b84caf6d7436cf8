//! The same cloth as pictures on a glossy surface: what the paper compares with.

use std::sync::Arc;

use ::image::{DynamicImage, GrayImage, RgbImage};
use selvedge_yarn_brdf::Cloth;

use crate::{
    bake::{
        Tile,
        fit::Fits,
        maps::{Map, Maps},
    },
    image::View,
    render::film::Size,
    scene::{
        Material,
        standard::{Input, Standard},
        texture::{Encoding, MipTexture},
    },
};

/// Texels to a thread at least, and along each side of a map at least.
const TEXELS: u32 = 10;
const SIDE: u32 = 512;

/// The texture-based material that looks most like `cloth`: its maps of 8 bits, with at least ten texels to
/// a thread.
///
/// # Errors
///
/// When the cloth cannot be shaded or its repeat is too large for a picture.
pub fn material(cloth: &Cloth) -> anyhow::Result<Material> {
    let threads = [cloth.weave.ends(), cloth.weave.picks()];
    let repeats = threads.map(|threads| (SIDE / (TEXELS * threads)).max(1));
    let side = |axis: usize| (TEXELS * threads[axis] * repeats[axis]).max(SIDE);
    let tile = Tile::new(cloth.clone(), repeats, Size::new(side(0), side(1))?)?;
    let fits = Fits::new(&tile);
    let maps = Maps::new(&tile, &fits, 2);
    let input = |map, is_grey| -> anyhow::Result<Input> {
        Ok(Input::Texture(Arc::new(texture(&maps, map, is_grey)?)))
    };
    let standard = Standard {
        base_color: input(Map::BaseColor, false)?,
        normal: input(Map::Normal, false)?,
        roughness: input(Map::Roughness, true)?,
        specular: input(Map::Specular, false)?,
        anisotropy: input(Map::AnisotropyUv, true)?,
    };
    let size = tile.size().as_vec2();
    Ok(Material::Standard { standard: Arc::new(standard), size })
}

fn texture(maps: &Maps, map: Map, is_grey: bool) -> anyhow::Result<MipTexture> {
    let (width, height) = (maps.width as u32, (maps.texels.len() / maps.width) as u32);
    // Colours are coded as screens have them, all else evenly.
    let is_color = map == Map::BaseColor;
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
    let components = if is_grey { 1 } else { 3 };
    let bytes = maps.texels.iter().flat_map(|texel| {
        let [r, g, b, _] = maps.value(map, texel);
        let coded = match is_color {
            true => View::Raw.bytes(glam::Vec3::new(r, g, b)),
            false => [r, g, b].map(byte),
        };
        coded.into_iter().take(components)
    });
    let bytes: Vec<u8> = bytes.collect();
    const FITS: &str = "there is a byte for each component of each texel";
    let image = match is_grey {
        true => DynamicImage::ImageLuma8(GrayImage::from_raw(width, height, bytes).expect(FITS)),
        false => DynamicImage::ImageRgb8(RgbImage::from_raw(width, height, bytes).expect(FITS)),
    };
    let encoding = if is_color { Encoding::Srgb } else { Encoding::Linear };
    Ok(MipTexture::new(&image, encoding)?)
}
