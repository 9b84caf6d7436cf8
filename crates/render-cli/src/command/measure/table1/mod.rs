//! `selvedge measure table1`: a cloth beside pictures of it and beside plain diffuse, in time, memory and
//! noise (Nelson, McEvoy & Fratarcangeli 2016, table 1).

mod median;
mod run;
mod scenes;

use std::{array, collections::BTreeMap, path::Path};

use serde_json::json;

use self::{
    median::Median,
    run::{Effort, Job, Run},
    scenes::{Scenes, Shader, TEXELS, Variant},
};
use super::{Findings, Subject, tell_progress};
use crate::{
    args::{MeasureOptions, Table1Options},
    image::compare::Pair,
    report::{Axis, Cell, Check, Figure, Limit, Plot, Report, Series, Table},
};

/// Greatest part of the time of pictures, with equal samples and to equal noise (Nelson, McEvoy &
/// Fratarcangeli 2016, table 1).
const FIXED: f64 = 0.61;
const ADAPTIVE: f64 = 0.57;

/// Greatest memory of a cloth and least memory of its pictures, bytes, and greatest part of all memory.
const CLOTH_BYTES: f64 = 1e6;
const TEXTURE_BYTES: f64 = 100e6;
const MEMORY: f64 = 0.215;

/// Rounds in which all shaders take turns, and those in bad cases.
const ROUNDS: u64 = 3;
const FEWER: u64 = 1;

/// Samples per pixel, those of references, the noise of adaptive runs and what ends them at the latest.
const SPP: u64 = 16;
const REFERENCE_SPP: u64 = 64;
const NOISE: f64 = 0.05;
const MOST_SPP: u64 = 128;

/// The runs of a shader in one mode, in rounds.
type Runs = [Vec<Run>; Shader::ALL.len()];

/// The comparison of all `subjects`.
pub(super) fn measure(
    options: &Table1Options,
    measured: &MeasureOptions,
    subjects: &[Subject],
) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "Cloth beside pictures of it",
        "A wrinkled sample under six lights, its threads as many pixels wide as in `scene:wrinkled`: woven, \
         with five maps baked from the same cloth, and plainly diffuse. Every run is a process of its own; the \
         shaders take turns, and a ratio is that of neighbours. Given are medians, with the least and the \
         greatest.",
    );
    let mut table = Table::new(
        "table1",
        [
            "cloth",
            "mode",
            "shader",
            "seconds",
            "samples per pixel",
            "peak memory, MB",
            "shader, MB",
            "relMSE",
            "seconds at equal error",
            "mean radiance",
        ],
    );
    let columns = ["cloth", "mode", "time", "time at equal error", "peak memory"];
    let mut ratios = Table::new("ratios", columns);
    let mut parts = Table::new(
        "parts",
        ["cloth", "mode", "shader", "seconds", "of it traversal and lights", "of it shading"],
    );
    let columns = ["cloth", "case", "cloth, s", "texture, s", "time", "peak memory"];
    let mut bad = Table::new("bad-cases", columns);
    let mut fits = Table::new(
        "maps",
        [
            "cloth",
            "texels per end",
            "texels per pick",
            "far field off by",
            "times as bright",
            "reflectances times",
        ],
    );
    let mut plots: BTreeMap<&str, Vec<([f64; 2], String)>> = BTreeMap::new();
    let mut figures = Vec::new();

    for (subject, input) in subjects.iter().zip(&measured.inputs) {
        tell_progress(measured, subject);
        let name = || Cell::from(subject.input.as_str());
        let size = options.size;
        let brightness = |scene: &Path| {
            let job =
                Job { scene, size, effort: Effort::Spp(SPP), seed: 0, threads: measured.threads };
            job.run().map(|run| mean(&run))
        };
        let scenes = Scenes::new(input, options.map, size, brightness)?;
        fits.row([
            name(),
            scenes.texels[0].into(),
            scenes.texels[1].into(),
            f64::from(scenes.far.relative).into(),
            f64::from(scenes.far.brightness).into(),
            f64::from(scenes.gain).into(),
        ]);
        let usual = Sample { options, measured, scenes: &scenes, variant: Variant::Usual };
        let reference = Effort::Spp(measured.count(REFERENCE_SPP).max(4 * SPP));
        let references = Shader::ALL.iter().map(|&shader| usual.run(shader, reference, u64::MAX));
        let references = references.collect::<anyhow::Result<Vec<_>>>()?;
        for (shader, run) in Shader::ALL.iter().zip(&references) {
            let caption = format!("{}, {}", subject.input, shader.name());
            let file = format!("{}-{}", subject.name, shader.name());
            figures.push(Figure::new(&file, &caption, &run.picture)?);
        }
        for (mode, effort) in [
            ("fixed", Effort::Spp(measured.count(SPP))),
            ("adaptive", Effort::Noise(NOISE, MOST_SPP)),
        ] {
            let runs = usual.rounds(effort, measured.count(ROUNDS), &[0, 1, 2])?;
            let errors: [Vec<f64>; 3] = array::from_fn(|k| {
                let to_reference = |run: &Run| {
                    let pair = Pair::new(&run.picture, &references[k].picture);
                    pair.map_or(f64::NAN, |pair| pair.comparison().relmse)
                };
                runs[k].iter().map(to_reference).collect()
            });
            // The error falls as one over the time.
            let at_equal: [Vec<f64>; 3] = array::from_fn(|k| {
                runs[k].iter().zip(&errors[k]).map(|(run, error)| run.seconds * error).collect()
            });
            let traversal = Median::new(runs[2].iter().map(|run| run.seconds)).median;
            for (k, shader) in Shader::ALL.iter().enumerate() {
                let of =
                    |value: &dyn Fn(&Run) -> f64| Median::new(runs[k].iter().map(value)).median;
                let seconds = of(&|run| run.seconds);
                let error = Median::new(errors[k].iter().copied()).median;
                let texture_error = Median::new(errors[1].iter().copied()).median;
                table.row([
                    name(),
                    mode.into(),
                    shader.name().into(),
                    seconds.into(),
                    of(&|run| run.spp).into(),
                    (of(&|run| run.memory) * 1e-6).into(),
                    (of(&|run| run.shader) * 1e-6).into(),
                    error.into(),
                    (seconds * error / texture_error).into(),
                    f64::from(mean(&references[k])).into(),
                ]);
                parts.row([
                    name(),
                    mode.into(),
                    shader.name().into(),
                    seconds.into(),
                    (traversal / seconds).min(1.0).into(),
                    (1.0 - traversal / seconds).max(0.0).into(),
                ]);
                let points = plots.entry(shader.name()).or_default();
                points.push(([seconds, error], format!("{}, {mode}", subject.name)));
            }
            let ratio = |value: &dyn Fn(&Run) -> f64| {
                Median::new(runs[0].iter().zip(&runs[1]).map(|(a, b)| value(a) / value(b)))
            };
            let time = ratio(&|run| run.seconds);
            let memory = ratio(&|run| run.memory);
            let equal = Median::new(at_equal[0].iter().zip(&at_equal[1]).map(|(a, b)| a / b));
            ratios.row([
                name(),
                mode.into(),
                time.in_words().into(),
                equal.in_words().into(),
                memory.in_words().into(),
            ]);
            let most = if mode == "fixed" { FIXED } else { ADAPTIVE };
            let what = |what: &str| format!("{}: {what}", subject.input);
            let words = format!("time over that of texture, {mode}");
            report.check(Check::new(what(&words), time.median, Limit::AtMost(most)));
            if mode == "fixed" {
                let bytes = |k: usize| Median::new(runs[k].iter().map(|run| run.shader)).median;
                let [cloth, texture] = [bytes(0), bytes(1)];
                report.check(Check::new(what("bytes of cloth"), cloth, Limit::AtMost(CLOTH_BYTES)));
                let limit = Limit::AtLeast(TEXTURE_BYTES);
                report.check(Check::new(what("bytes of pictures"), texture, limit));
                let words = "peak memory over that of texture";
                report.check(Check::new(what(words), memory.median, Limit::AtMost(MEMORY)));
            }
        }
        for variant in Variant::BAD {
            let sample = Sample { variant, ..usual };
            let effort = Effort::Spp(measured.count(SPP));
            let runs = sample.rounds(effort, measured.count(FEWER), &[0, 1])?;
            let seconds = |k: usize| Median::new(runs[k].iter().map(|run| run.seconds)).median;
            let ratio = |value: &dyn Fn(&Run) -> f64| {
                Median::new(runs[0].iter().zip(&runs[1]).map(|(a, b)| value(a) / value(b)))
            };
            bad.row([
                name(),
                variant.name().into(),
                seconds(0).into(),
                seconds(1).into(),
                ratio(&|run| run.seconds).in_words().into(),
                ratio(&|run| run.memory).in_words().into(),
            ]);
        }
    }

    report.heading("Table 1");
    report.table(table);
    report.paragraph(
        "`relMSE` is that to a picture of many samples by the same shader, so it is noise alone. The seconds at \
         equal error are those in which it would fall to that of the texture: it goes as one over the time.",
    );
    report.heading("Cloth over texture");
    report.table(ratios.clone());
    report.heading("Where the time goes");
    report.paragraph(
        "The diffuse sample has the same triangles, lights and rays, but next to nothing to shade: its time is \
         taken for that of all but shading. Adaptive runs differ in samples as well.",
    );
    report.table(parts);
    report.heading("What is bad for cloth");
    report.paragraph(
        "As above with equal numbers of samples, but: maps of a quarter of the side, which tell less of each \
         thread; the sample eight times as large and as far away, so that threads cannot be told apart; yarns as \
         irregular as the fabric says, of which the maps know nothing; yarns twisted by 30° with the drawn \
         highlight, beside the maps of the yarns as they are.",
    );
    report.table(bad);
    report.heading("What was drawn");
    report.paragraph(&format!(
        "Maps of {0} × {0} pixels, with at least {TEXELS} to a thread where one repeat allows it. The far field is \
         that of the fitted material against that of the cloth, a root mean square over pairs of directions. A \
         glossy coat on a diffuse ground is not as dark as yarn where light grazes it: reflectances were \
         multiplied until the mean of the picture was that of the cloth. Where the cloth has gaps, the glossy sample has \
         none.",
        options.map
    ));
    report.table(fits);
    report.pictures(figures);
    let axes = (Axis::new("seconds").log(), Axis::new("relMSE").log());
    let plot = Plot::new("noise-over-time", "Noise over time", axes.0, axes.1);
    report.plot(plots.into_iter().fold(plot, |plot, (name, points)| {
        let (points, labels) = points.into_iter().unzip();
        plot.with(Series::marks(name, points).with_labels(labels))
    }));
    report.fact("map", json!(options.map));
    report.fact("size", json!(options.size));
    Ok(Findings { report, summary: ratios })
}

/// A scene in all shaders.
#[derive(Clone, Copy)]
struct Sample<'a> {
    options: &'a Table1Options,
    measured: &'a MeasureOptions,
    scenes: &'a Scenes,
    variant: Variant,
}

impl Sample<'_> {
    fn run(&self, shader: Shader, effort: Effort, round: u64) -> anyhow::Result<Run> {
        let scene = self.scenes.scene(shader, self.variant)?;
        let seed = self.measured.seed.wrapping_add(round);
        let (size, threads) = (self.options.size, self.measured.threads);
        Job { scene: &scene, size, effort, seed, threads }.run()
    }

    /// Some shaders in turn, every other round in the other order.
    fn rounds(&self, effort: Effort, rounds: u64, shaders: &[usize]) -> anyhow::Result<Runs> {
        let mut runs = Runs::default();
        for round in 0..rounds {
            let mut order = shaders.to_vec();
            if round % 2 == 1 {
                order.reverse();
            }
            for k in order {
                runs[k].push(self.run(Shader::ALL[k], effort, round)?);
            }
        }
        Ok(runs)
    }
}

/// The mean of all components of a picture.
fn mean(run: &Run) -> f32 {
    let colors = run.picture.to_colors();
    colors.iter().map(|color| color.element_sum()).sum::<f32>() / (3 * colors.len()).max(1) as f32
}
