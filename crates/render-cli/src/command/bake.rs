//! `selvedge bake`: maps of a cloth that tile, and materials that refer to them.

use std::path::Path;

use anyhow::Context;
use rayon::prelude::*;

use crate::{
    Outcome,
    args::{BakeOptions, MapFormat},
    bake::{
        Tile, files,
        fit::Fits,
        gltf,
        maps::{Map, Maps},
        materialx, report, u3m,
    },
    fabric,
    folder::Folder,
    image::EncodeError,
    output::{Sink, tell},
    threads,
};

/// The file that says what is what.
const INDEX: &str = "bake.json";

/// Bakes what `options` name, and writes a table of how well the material fits to standard output.
///
/// # Errors
///
/// When the cloth cannot be read or is not sound, or the folder cannot be written: then there is none.
pub fn run(options: &BakeOptions) -> anyhow::Result<Outcome> {
    let folder = Folder::new(&options.output, INDEX)?;
    let source = fabric::read(&options.input)?;
    let drawdown = source.draft().drawdown()?;
    let cloth = source.cloth(&drawdown)?;
    let pool = threads::pool(options.threads)?;
    let name = source.name().to_owned();
    let tile = Tile::new(cloth, options.repeats.0, options.size.0).context(name.clone())?;
    if !options.quiet {
        source.draft().warnings().for_each(tell);
        source.warnings(&drawdown, &tile.shader).iter().for_each(tell);
        if tile.is_evened {
            tell(format_args!(
                "warning: {name}: irregularities along threads do not tile, left out"
            ));
        }
    }
    let hash = source.hash()?;
    let (fits, index, files) = pool.install(|| -> anyhow::Result<_> {
        let fits = Fits::new(&tile);
        let maps = Maps::new(&tile, &fits, options.points);
        let mut files = pictures(&tile, &maps, options.format)?;
        let document = materialx::document(&tile, &maps, options.format);
        files.push(("cloth.mtlx".to_owned(), document.into_bytes()));
        let (scene, buffer) = gltf::scene(&tile, &maps, &fits.sheen);
        files.push((gltf::BUFFER.to_owned(), buffer));
        files.push(("cloth.gltf".to_owned(), json(&scene)));
        let material = u3m::material(&tile, &maps, &drawdown, &title(&name), hash);
        files.push(("cloth.u3m".to_owned(), json(&material)));
        let index = report::json(&tile, &fits, &maps, &name, hash, options.format);
        Ok((fits, index, files))
    })?;
    folder.write(index, &files)?;
    if !options.quiet {
        let text = report::text(&tile, &fits);
        Sink::new(None)?.write(|out| out.write_all(text.as_bytes()))?;
    }
    Ok(Outcome::Done)
}

/// A cloth's name without folder, extension and `preset:`.
fn title(name: &str) -> String {
    let stem = Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let stem = stem.unwrap_or_else(|| name.to_owned());
    stem.rsplit(':').next().filter(|name| !name.is_empty()).unwrap_or("cloth").to_owned()
}

fn json(value: &serde_json::Value) -> Vec<u8> {
    let mut text = serde_json::to_vec_pretty(value).expect("names are texts and numbers finite");
    text.push(b'\n');
    text
}

/// The files of all maps, in their format and, beside EXR, as the PNG that other programs need.
fn pictures(
    tile: &Tile,
    maps: &Maps,
    format: MapFormat,
) -> Result<Vec<(String, Vec<u8>)>, EncodeError> {
    let mut wanted: Vec<_> = Map::ALL.map(|map| (map, format)).to_vec();
    if format == MapFormat::Exr {
        let general = Map::ALL.into_iter().filter(|map| !map.is_for_gltf());
        wanted.extend(general.map(|map| (map, MapFormat::Png)));
    }
    let file =
        |(map, format)| Ok((files::name(map, format), files::encode(tile, maps, map, format)?));
    wanted.into_par_iter().map(file).collect()
}
