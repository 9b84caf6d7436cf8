//! `selvedge image convert`: the same picture in another format, one layer of it, or brighter.

use std::io::{self, IsTerminal};

use anyhow::{Context, anyhow, bail};

use crate::{
    args::PictureConvertOptions,
    image::{self, Layer, View},
    input,
    output::Sink,
};

/// Writes what `options` asks for of `options.picture`.
///
/// # Errors
///
/// When the picture cannot be read, has no such layer, or the output cannot be written.
pub fn run(options: &PictureConvertOptions) -> anyhow::Result<()> {
    let sink = Sink::new(options.output.path.as_deref())?;
    if sink == Sink::Stdout && io::stdout().is_terminal() {
        bail!("standard output: found a terminal, expected a file or a pipe for a picture");
    }
    let mut picture = image::read(&options.picture)?;
    if let Some(name) = &options.layer {
        let names: Vec<_> = picture.layers().iter().map(Layer::title).collect();
        let names = names.join(", ");
        picture = picture.into_layer(name).ok_or_else(|| {
            let file = input::name(&options.picture);
            anyhow!("{file}: found no layer {name:?}, expected one of {names}")
        })?;
    }
    if let Some(stops) = options.exposure {
        picture = picture.into_main_layer();
        picture.scale(stops.exp2());
    }
    picture.view = options.view.unwrap_or(match picture.main_layer() {
        Some(layer) if !layer.name.is_empty() => View::Raw,
        _ => picture.view,
    });
    let encoded = picture.encode(options.output.format);
    let encoded = encoded.with_context(|| input::name(&options.picture))?;
    sink.write(|out| out.write_all(&encoded))?;
    Ok(())
}
