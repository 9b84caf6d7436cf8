//! How long to draw, and what is told and kept meanwhile.

use std::{path::PathBuf, time::Duration};

use clap::{Args, ValueEnum};

use crate::render::{progressive::Limits, sampler::MAX_SAMPLES};

/// Samples per pixel where nothing else is said.
const DEFAULT_SPP: u32 = 16;

/// How long to draw, and what is told and kept meanwhile.
#[derive(Clone, Debug, Default, Args)]
pub struct Effort {
    /// Samples per pixel, best a power of two; four times as many halve the noise [default: 16, 8
    /// for a swatch, or 65536 with --time or --noise]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    pub spp: Option<u32>,

    /// Draws for so long, as in 90s, 2m or 1h, unless --spp or --noise ends it before
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub time: Option<Duration>,

    /// Draws until the noise is so low, 0.0001 to 1: the root of relMSE, over squares of 16 pixels
    #[arg(long, value_name = "N", value_parser = noise)]
    pub noise: Option<f32>,

    /// Saves what was drawn every so often and at the end, to go on from with --resume
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub checkpoint: Option<Duration>,

    /// Where it is saved [default: the output with .checkpoint after its name]
    #[arg(long, value_name = "FILE", requires = "checkpoint")]
    pub checkpoint_file: Option<PathBuf>,

    /// Goes on from what --checkpoint has saved of the same picture; limits may be others
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,

    /// Compares the picture on its way with this one, into --error-log
    #[arg(long, value_name = "FILE", requires = "error_log")]
    pub reference: Option<PathBuf>,

    /// Writes a table of time, samples per pixel, relMSE and FLIP, a few rows a second (CSV); the time
    /// of comparing does not count
    #[arg(long, value_name = "FILE", requires = "reference")]
    pub error_log: Option<PathBuf>,

    /// How to tell how far it is [default: auto, or none with --quiet]
    #[arg(long, value_enum, value_name = "FORM")]
    pub progress: Option<ProgressForm>,

    /// Tells numbers of samples, time, speed and memory at the end
    #[arg(long)]
    pub stats: bool,
}

/// How to tell how far it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProgressForm {
    /// A bar on a terminal, else plain
    Auto,
    /// A line every five seconds
    Plain,
    /// An object on a line, twice a second and at the end
    Json,
    /// Not at all
    None,
}

impl Effort {
    /// When drawing ends.
    pub fn limits(&self) -> Limits {
        let is_open = self.time.is_none() && self.noise.is_none();
        let spp = self.spp.unwrap_or(if is_open { DEFAULT_SPP } else { MAX_SAMPLES });
        Limits { spp, time: self.time, noise: self.noise }
    }
}

/// Longest time, a year.
const LONGEST: f64 = 366.0 * 24.0 * 3600.0;

pub(super) fn time(text: &str) -> Result<Duration, String> {
    let end = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let unit = match unit {
        "ms" => Some(1e-3),
        "s" => Some(1.0),
        "m" => Some(60.0),
        "h" => Some(3600.0),
        _ => None,
    };
    let seconds = number.parse::<f64>().ok().zip(unit).map(|(number, unit)| number * unit);
    let seconds = seconds.filter(|seconds| *seconds > 0.0 && *seconds <= LONGEST);
    seconds
        .map(Duration::from_secs_f64)
        .ok_or_else(|| "expected a time above 0, as in 90s, 2m or 1.5h".to_owned())
}

fn noise(text: &str) -> Result<f32, String> {
    let noise = text.parse().ok().filter(|noise| (1e-4..=1.0).contains(noise));
    noise.ok_or_else(|| "expected a number from 0.0001 to 1".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_unit() {
        let ms = |text| time(text).map(|time| time.as_millis());
        assert_eq!(ms("60s"), Ok(60_000));
        assert_eq!(ms("2m"), Ok(120_000));
        assert_eq!(ms("1.5h"), Ok(5_400_000));
        assert_eq!(ms("250ms"), Ok(250));
        for text in ["", "60", "s", "0s", "-1s", "1 s", "1d", "1e3s", "nans", "infs", "9999999h"] {
            assert!(ms(text).is_err(), "{text}");
        }
    }

    #[test]
    fn samples_are_the_limit_where_nothing_else_is() {
        let time = Some(Duration::from_secs(1));
        let spp = |effort: Effort| effort.limits().spp;
        assert_eq!(spp(Effort::default()), 16);
        assert_eq!(spp(Effort { time, ..Effort::default() }), MAX_SAMPLES);
        assert_eq!(spp(Effort { noise: Some(0.1), ..Effort::default() }), MAX_SAMPLES);
        assert_eq!(spp(Effort { spp: Some(4), time, ..Effort::default() }), 4);
    }
}
