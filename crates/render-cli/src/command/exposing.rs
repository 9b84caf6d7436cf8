//! Exposing a picture with all that the command line asks for meanwhile: progress, checkpoints, an
//! end by Ctrl-C, statistics.

use std::{
    ffi::OsString,
    io::BufReader,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};

use super::{
    error_log::{self, ErrorLog},
    progress::Reporter,
};
use crate::{
    args::{ProgressForm, RenderOptions},
    input, interrupt, memory,
    output::{Destination, tell},
    render::{
        accumulate::{Accumulator, Layers},
        checkpoint,
        exposure::Expose,
        film::{Frame, Size},
        progressive::{self, Control, Outcome, Plan, Save, Stopped},
        stages::{Stage, Stages},
    },
};

/// What is to be exposed, and where it is saved.
#[derive(Debug)]
pub(super) struct Exposing<'a> {
    options: &'a RenderOptions,
    frame: Frame,
    layers: Layers,
    checkpoint: Option<Destination>,
    error_log: Option<ErrorLog>,
}

impl<'a> Exposing<'a> {
    /// # Errors
    ///
    /// When the crop is not within the picture, checkpoints or the log of errors cannot be written, or
    /// there is no picture to compare with.
    pub(super) fn new(
        options: &'a RenderOptions,
        size: Size,
        layers: Layers,
    ) -> anyhow::Result<Self> {
        let frame = match options.cropwindow {
            Some(crop) => Frame::cropped(size, crop).context("--cropwindow")?,
            None => Frame::whole(size),
        };
        let effort = &options.effort;
        let output = &options.output.path;
        let checkpoint = effort.checkpoint.map(|_| {
            let file = effort.checkpoint_file.clone().unwrap_or_else(|| beside(output));
            if file == *output {
                bail!("--checkpoint-file: found the name of the output, expected another");
            }
            Ok(Destination::new(&file)?)
        });
        let checkpoint = checkpoint.transpose()?;
        let error_log = ErrorLog::new(options, frame.crop_size())?;
        Ok(Self { options, frame, layers, checkpoint, error_log })
    }

    /// Whether somebody needs the key of the subject.
    pub(super) fn needs_key(&self) -> bool {
        self.checkpoint.is_some() || self.options.effort.resume.is_some()
    }

    /// Exposes `subject` on the threads of the current rayon pool; `key` tells it from others.
    ///
    /// # Errors
    ///
    /// When it cannot be gone on with what `--resume` names, or the log of errors cannot be written.
    pub(super) fn run(&self, subject: &impl Expose, key: u64) -> anyhow::Result<Outcome> {
        let effort = &self.options.effort;
        let limits = effort.limits();
        let plan = Plan { frame: self.frame, layers: self.layers, limits, key };
        let start = match &effort.resume {
            Some(path) => load(&plan, path)?,
            None => plan.start(),
        };
        let quiet = if self.options.quiet { ProgressForm::None } else { ProgressForm::Auto };
        let reporter = Reporter::new(effort.progress.unwrap_or(quiet));
        let save = |accumulator: &Accumulator| {
            if let Err(error) = self.save(accumulator, &plan) {
                // Later ones may succeed, and the picture is worth more.
                tell(format_args!("warning: {error:#}"));
            }
        };
        let log = self.error_log.as_ref();
        let study = log.map(|log| move |accumulator: &Accumulator| log.add(accumulator));
        let control = Control {
            interrupt: interrupt::flag(),
            watch: &|progress| reporter.watch(progress),
            save: effort.checkpoint.map(|every| Save { every, save: &save }),
            study: study.as_ref().map(|study| Save { every: error_log::EVERY, save: study }),
        };
        let outcome = progressive::resume(subject, &plan, start, &control);
        reporter.finish();
        if self.checkpoint.is_some() {
            save(&outcome.accumulator);
        }
        if let Some(log) = &self.error_log {
            log.write()?;
        }
        Ok(outcome)
    }

    fn save(&self, accumulator: &Accumulator, plan: &Plan) -> anyhow::Result<()> {
        if let Some(destination) = &self.checkpoint {
            destination.write(|file| checkpoint::write(accumulator, plan, file))?;
        }
        Ok(())
    }
}

/// `out.png.checkpoint` for `out.png`.
fn beside(output: &Path) -> PathBuf {
    let mut name = OsString::from(output);
    name.push(".checkpoint");
    name.into()
}

fn load(plan: &Plan, path: &Path) -> anyhow::Result<Accumulator> {
    let name = path.display();
    let file = input::open(path, "checkpoint")?;
    checkpoint::read(plan, &mut BufReader::new(file)).with_context(|| name.to_string())
}

/// `16 spp`, and why there are not more where that was not settled in advance.
pub(super) fn samples_in_words(outcome: &Outcome) -> String {
    let Outcome { spp_min, spp_mean, spp_max, .. } = outcome;
    let spp = if spp_min == spp_max {
        format!("{spp_max} spp")
    } else {
        format!("{spp_min} to {spp_max} spp, mean {spp_mean:.1}")
    };
    match outcome.stopped {
        Stopped::Spp => spp,
        other => format!("{spp}, {}", reason(other)),
    }
}

fn reason(stopped: Stopped) -> &'static str {
    match stopped {
        Stopped::Spp => "all samples taken",
        Stopped::Time => "time is up",
        Stopped::Noise => "noise is met",
        Stopped::Interrupted => "interrupted",
    }
}

/// The numbers that `--stats` asks for, a line each.
pub(super) fn stats(outcome: &Outcome) -> String {
    let Outcome { spp_min, spp_mean, spp_max, samples, new_samples, .. } = outcome;
    let seconds = outcome.accumulator.elapsed.as_secs_f64();
    let new_seconds = outcome.new_elapsed.as_secs_f64();
    let speed = *new_samples as f64 * 1e-6 / new_seconds.max(1e-9);
    let mut rows = vec![
        ("samples", samples.to_string()),
        ("spp min", spp_min.to_string()),
        ("spp mean", format!("{spp_mean:.2}")),
        ("spp max", spp_max.to_string()),
        ("seconds", format!("{seconds:.3}")),
        ("Msamples/s", format!("{speed:.3}")),
    ];
    if let Some(bytes) = memory::peak() {
        rows.push(("peak memory", format!("{:.1} MB", bytes as f64 * 1e-6)));
    }
    rows.push(("stopped", reason(outcome.stopped).to_owned()));
    let lines = rows.iter().map(|(name, value)| format!("{name:<12}{value}"));
    lines.collect::<Vec<_>>().join("\n")
}

/// Where the time of a sample went, a line for each stage: nanoseconds of one of so many threads. What
/// is left is for the film, for what is done once for all, and for waiting.
pub(super) fn time_by_stage(stages: &Stages, threads: usize, outcome: &Outcome) -> String {
    let all = outcome.new_elapsed.as_nanos() as f64 * threads as f64;
    let mut rows: Vec<_> =
        Stage::ALL.iter().map(|&stage| (stage.name(), stages.nanoseconds(stage) as f64)).collect();
    let rest = all - rows.iter().map(|(_, nanoseconds)| nanoseconds).sum::<f64>();
    rows.push(("rest", rest.max(0.0)));
    let samples = outcome.new_samples.max(1) as f64;
    let line = |(name, nanoseconds): &(&str, f64)| {
        format!("{name:<12}{:.1} ns/sample", nanoseconds / samples)
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}
