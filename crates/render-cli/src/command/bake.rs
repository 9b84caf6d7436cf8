//! `selvedge bake`: maps of a cloth that tile, and materials that refer to them.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use anyhow::Context;
use rayon::{ThreadPoolBuilder, prelude::*};
use tempfile::TempDir;

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
    output::{Sink, tell},
};

/// Bakes what `options` name, and writes a table of how well the material fits to standard output.
///
/// # Errors
///
/// When the cloth cannot be read or is not sound, or the folder cannot be written: then there is none.
pub fn run(options: &BakeOptions) -> anyhow::Result<Outcome> {
    let folder = Folder::new(&options.output)?;
    let source = fabric::read(&options.input)?;
    let drawdown = source.draft().drawdown()?;
    let cloth = source.cloth(&drawdown)?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(options.threads.map_or(0, usize::from))
        .build()
        .context("threads: cannot be started")?;
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
    let fits = pool.install(|| -> anyhow::Result<_> {
        let fits = Fits::new(&tile);
        let maps = Maps::new(&tile, &fits, options.points);
        folder.write_maps(&tile, &maps, options.format)?;
        let report = report::json(&tile, &fits, &maps, &name, hash, options.format);
        folder.write("bake.json", &json(&report))?;
        let document = materialx::document(&tile, &maps, options.format);
        folder.write("cloth.mtlx", document.as_bytes())?;
        let (scene, buffer) = gltf::scene(&tile, &maps, &fits.sheen);
        folder.write(gltf::BUFFER, &buffer)?;
        folder.write("cloth.gltf", &json(&scene))?;
        folder.write(
            "cloth.u3m",
            &json(&u3m::material(&tile, &maps, &drawdown, &title(&name), hash)),
        )?;
        Ok(fits)
    })?;
    folder.keep()?;
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

/// A folder that is there as a whole or not at all.
struct Folder {
    path: PathBuf,
    /// Beside it, until all is written.
    temporary: TempDir,
}

impl Folder {
    /// The folder at `path`, which is made when all is written.
    fn new(path: &Path) -> anyhow::Result<Self> {
        let name = path.display();
        match fs::read_dir(path).map(Iterator::count) {
            Ok(1..) => {
                anyhow::bail!(
                    "{name}: found a folder with files in it, expected a new or an empty one"
                )
            }
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => {
                anyhow::bail!("{name}: found a file, expected a new or an empty folder")
            }
            _ => {}
        }
        let parent = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !parent.is_dir() {
            anyhow::bail!("{name}: found no folder {}, expected an existing one", parent.display());
        }
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let temporary = builder.prefix(".selvedge-").tempdir_in(parent);
        let temporary = temporary.with_context(|| format!("{name}: cannot be written"))?;
        Ok(Self { path: path.to_owned(), temporary })
    }

    fn write(&self, file: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let write = || File::create(self.temporary.path().join(file))?.write_all(bytes);
        write().with_context(|| format!("{}: cannot be written", self.path.join(file).display()))
    }

    /// All maps in their format, and those that only PNG serves.
    fn write_maps(&self, tile: &Tile, maps: &Maps, format: MapFormat) -> anyhow::Result<()> {
        let mut wanted: Vec<_> = Map::ALL.map(|map| (map, format)).to_vec();
        if format == MapFormat::Exr {
            let general = Map::ALL.into_iter().filter(|map| !map.is_for_gltf());
            wanted.extend(general.map(|map| (map, MapFormat::Png)));
        }
        wanted.into_par_iter().try_for_each(|(map, format)| {
            let bytes = files::encode(tile, maps, map, format)?;
            self.write(&files::name(map, format), &bytes)
        })
    }

    /// Gives the folder its name.
    fn keep(self) -> anyhow::Result<()> {
        let Self { path, temporary } = self;
        let name = path.display().to_string();
        // Onto an empty folder as well, where the system does that.
        fs::rename(temporary.path(), &path)
            .or_else(|_| fs::remove_dir(&path).and_then(|()| fs::rename(temporary.path(), &path)))
            .with_context(|| format!("{name}: cannot be written"))?;
        // What it was called is gone.
        let _ = temporary.keep();
        Ok(())
    }
}
