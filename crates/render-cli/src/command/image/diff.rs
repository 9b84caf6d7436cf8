//! `selvedge image diff`: how far two pictures are apart.

use std::path::Path;

use anyhow::{Context, bail};
use serde_json::json;

use super::significant;
use crate::{
    Outcome,
    args::DiffOptions,
    image::{
        self,
        compare::{Comparison, Pair},
    },
    input,
    output::{Destination, Sink, tell},
};

/// Compares `options.a` with `options.b`: the metrics go to standard output, and a picture of the
/// differences to `options.output`.
///
/// # Errors
///
/// When a picture cannot be read, their sizes differ, or an output cannot be written.
pub fn run(options: &DiffOptions) -> anyhow::Result<Outcome> {
    if [&options.a, &options.b].iter().all(|path| *path == Path::new("-")) {
        bail!("standard input: found it as both pictures, expected it as one");
    }
    let output = options.output.as_ref();
    let destination = output.map(|output| Destination::new(&output.path)).transpose()?;
    let [a, b] = [image::read(&options.a)?, image::read(&options.b)?];
    let names = [input::name(&options.a), input::name(&options.b)];
    let pair = Pair::new(&a, &b).with_context(|| format!("{}, against {}", names[0], names[1]))?;
    let comparison = pair.comparison();
    let value = comparison.value(options.metric);
    let is_above = options.threshold.is_some_and(|threshold| value > threshold);
    if let (Some(destination), Some(output)) = (destination, output) {
        let picture = pair.difference(options.metric).encode(output.format)?;
        destination.write(|file| file.write_all(&picture))?;
    }
    let text = if options.json { json(&comparison, options, is_above) } else { text(&comparison) };
    Sink::Stdout.write(|out| out.write_all(text.as_bytes()))?;
    if comparison.unlike > 0 {
        tell(format_args!(
            "warning: {}, against {}: found {} pixels that are finite in one only",
            names[0], names[1], comparison.unlike
        ));
    }
    Ok(if is_above { Outcome::BelowThreshold } else { Outcome::Done })
}

fn text(comparison: &Comparison) -> String {
    let Comparison { rmse, relmse, max, max_at: [x, y], flip, .. } = *comparison;
    let [rmse, relmse, max, flip] = [rmse, relmse, max, flip].map(significant);
    format!("rmse    {rmse}\nrelmse  {relmse}\nmax     {max} at {x},{y}\nflip    {flip}\n")
}

fn json(comparison: &Comparison, options: &DiffOptions, is_above: bool) -> String {
    let Comparison { rmse, relmse, max, max_at: [x, y], flip, unlike } = *comparison;
    let json = json!({
        "rmse": rmse,
        "relmse": relmse,
        "max": { "difference": max, "x": x, "y": y },
        "flip": flip,
        "unlike": unlike,
        "metric": options.metric.name(),
        "threshold": options.threshold,
        "above": is_above,
    });
    format!("{json:#}\n")
}
