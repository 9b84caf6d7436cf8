//! `selvedge measure trade`.

use std::sync::Arc;

use selvedge_yarn_brdf::Instructions;

use super::{Findings, Subject, tell_progress};
use crate::{
    args::MeasureOptions,
    image::Picture,
    measure::trade::{
        Point, Run, Way, draw,
        normalization::{Search, Yarns},
        prepare,
        reference::{self, Reference},
        statistics::{Estimate, at_time, front, time_of},
    },
    render::{
        detail::{Level, Tier},
        film::{Crop, Frame, Size},
    },
    report::{Axis, Check, Figure, Limit, Plot, Report, Series, Table},
};

/// Runs of each way, each with a seed of its own.
const SEEDS: u64 = 5;

/// The picture of which the middle is drawn, as large as those of `selvedge render`; pixels of that part,
/// which has sides of 3 to 2; and samples of a pixel in each half of the reference and in the longest run.
const WHOLE: [u32; 2] = [960, 640];
const PIXELS: f64 = 96.0 * 64.0;
const REFERENCE_SPP: u32 = 512;
const MOST_SPP: u32 = 64;

/// What way is advised for, FLIP.
const GOALS: [f64; 4] = [0.1, 0.05, 0.03, 0.02];

/// The way that others are held against, at this many samples per pixel.
const USUAL: &str = "usual";
const USUAL_SPP: u32 = 16;

pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "Speed against accuracy",
        "Each cloth, draped in the built-in scene, is drawn in many ways, and each picture on its way is \
         compared with one that is taken for the true one.",
    );
    let (frame, ways) = (frame(options)?, ways(options));
    let size = frame.crop_size();
    report.paragraph(&format!(
        "Pictures are the middle {}x{} pixels of {}x{}. Each way is run {SEEDS} times with other noise, in turns with all \
         others; numbers are means with intervals that hold the true mean with 95 %. Seconds are those of \
         drawing on {} threads; preparing the cloth and comparing pictures do not count. The worst pixel \
         is the greatest difference of a component, in linear values.",
        size.width(),
        size.height(),
        frame.size().width(),
        frame.size().height(),
        rayon::current_num_threads()
    ));
    let list = ways_table(&ways);
    report.table(list);
    let mut advice =
        Table::new("advice", ["cloth", "FLIP at most", "choose", "spp", "seconds", "relMSE"]);
    let mut fronts = Plot::new(
        "fronts",
        "What nothing beats, of each cloth",
        Axis::new("seconds").log(),
        Axis::new("FLIP").log(),
    );
    for subject in subjects {
        tell_progress(options, subject);
        let trade = Trade::new(options, subject, frame, &ways)?;
        report.heading(&subject.input);
        trade.report(&mut report, &mut advice)?;
        fronts = fronts.with(trade.front_series(&subject.name));
    }
    report.heading("Advice");
    report.table(advice.clone());
    report.plot(fronts);
    Ok(Findings { report, summary: advice })
}

/// The middle of the picture, as large as the budget allows.
fn frame(options: &MeasureOptions) -> anyhow::Result<Frame> {
    let [width, height] = WHOLE;
    let side = (PIXELS * options.budget.sqrt() / 1.5).sqrt() / 2.0;
    let half_height = (side.round() as u32).clamp(8, height / 2);
    let half_width = (half_height * 3 / 2).min(width / 2);
    let [x, y] = [width / 2, height / 2];
    let crop = Crop::new([x - half_width, y - half_height], [x + half_width, y + half_height])?;
    Ok(Frame::cropped(Size::new(width, height)?, crop)?)
}

/// Samples per pixel within the budget: a power of two, at least 4.
fn spp(options: &MeasureOptions, most: u32) -> u32 {
    let most = f64::from(most) * options.budget.sqrt();
    (most as u32).clamp(4, 1 << 15).next_power_of_two()
}

/// All ways that are tried, the usual one first.
fn ways(options: &MeasureOptions) -> Vec<Way> {
    let most = spp(options, MOST_SPP);
    let some = most / 4;
    let mut ways = vec![Way::usual(USUAL, most)];
    for (name, level) in [("near", Level::Near), ("far", Level::Far)] {
        ways.push(Way { level, ..Way::usual(name, most) });
    }
    ways.push(Way { is_other_highlight: true, ..Way::usual("other highlight", most) });
    for noise in [0.2, 0.1, 0.05] {
        let mut way = Way::usual(&format!("noise {noise}"), 4 * most);
        way.limits.noise = Some(noise);
        ways.push(way);
    }
    for (directions, samples) in [(8, 16), (32, 128), (128, 1024)] {
        let search = Some(Search { directions, samples });
        let name = format!("{directions} x {samples} samples");
        ways.push(Way { search, ..Way::usual(&name, some) });
    }
    // What is far is not shaded by batches, so tiers are told apart near.
    let near = |name: &str, spp| Way { level: Level::Near, ..Way::usual(name, spp) };
    ways.push(Way { tier: Tier::Single, ..near("near, single points", some) });
    ways.push(Way { tier: Tier::Reference, ..near("near, single points, f64", some / 2) });
    let available = Instructions::available();
    for &instructions in &available[..available.len().saturating_sub(1)] {
        let name = format!("near, batches, {instructions:?}").to_lowercase();
        ways.push(Way { instructions: Some(instructions), ..near(&name, some) });
    }
    ways
}

fn ways_table(ways: &[Way]) -> Table {
    let mut table = Table::new("ways", ["way", "what differs from the usual one"]);
    for way in ways {
        let best = Instructions::available().last().map(|best| format!("{best:?}").to_lowercase());
        let what = match (way.search, way.limits.noise) {
            (Some(Search { directions, samples }), _) => format!(
                "the factor of the highlight is sought among {directions} directions with {samples} \
                 samples each, not by quadrature"
            ),
            (_, Some(noise)) => format!("adaptive: until the noise of each tile is {noise}"),
            _ if way.is_other_highlight => {
                "a window of δ = 0.3 where the cloth has rough fibres, and rough fibres of σ = 0.15 where \
                 it has a window: another look, whose error is no noise"
                    .to_owned()
            }
            _ if way.tier == Tier::Single => "as near, one place after the other".to_owned(),
            _ if way.tier == Tier::Reference => {
                "as near, one place after the other, in f64".to_owned()
            }
            _ if way.instructions.is_some() => "as near, with older instructions".to_owned(),
            _ if way.level == Level::Near => "each thread is shaded, however small".to_owned(),
            _ if way.level == Level::Far => {
                "all threads together are shaded, however large".to_owned()
            }
            _ => format!(
                "batches, {}, f32; threads as far as they can be seen; quadrature",
                best.unwrap_or_default()
            ),
        };
        table.row([way.name.as_str().into(), what.into()]);
    }
    table
}

/// All runs of a cloth.
struct Trade<'a> {
    subject: &'a Subject,
    ways: &'a [Way],
    /// Runs of each way, one for each seed.
    runs: Vec<Vec<Run>>,
    reference: Reference,
    /// Memory of the cloth as each way has it.
    cloth_bytes: Vec<usize>,
}

/// Of each way and number of passes, the mean over all seeds.
struct Mean {
    /// Index of the way.
    way: usize,
    spp: f64,
    seconds: Estimate,
    relmse: Estimate,
    flip: Estimate,
    max: Estimate,
}

impl<'a> Trade<'a> {
    fn new(
        options: &MeasureOptions,
        subject: &'a Subject,
        frame: Frame,
        ways: &'a [Way],
    ) -> anyhow::Result<Self> {
        let folder = reference::folder();
        let spp = spp(options, REFERENCE_SPP);
        let cloth = &subject.cloth;
        let mut reference = Reference::new(cloth, frame, spp, folder.as_deref())?;
        let usual = Arc::new(prepare(cloth, &ways[0])?);
        let yarns = Yarns::new(&usual, cloth);
        let shaders: Vec<_> = ways
            .iter()
            .map(|way| match way.is_other_highlight || way.instructions.is_some() {
                true => Ok(Arc::new(prepare(cloth, way)?)),
                false => Ok(usual.clone()),
            })
            .collect::<anyhow::Result<_>>()?;
        let mut runs = vec![Vec::new(); ways.len()];
        for seed in (0..SEEDS).map(|seed| options.seed.wrapping_add(seed)) {
            for (index, way) in ways.iter().enumerate() {
                let run = match way.search {
                    None => draw(&mut reference, &shaders[index], way, seed),
                    Some(search) => {
                        let mut shader = prepare(cloth, way)?;
                        yarns.rescale(&mut shader, &usual, search, seed)?;
                        draw(&mut reference, &Arc::new(shader), way, seed)
                    }
                };
                runs[index].push(run);
            }
        }
        let cloth_bytes = shaders.iter().map(|shader| shader.bytes()).collect();
        Ok(Self { subject, ways, runs, reference, cloth_bytes })
    }

    /// The means of all points.
    fn means(&self) -> Vec<Mean> {
        let mut means = Vec::new();
        for (way, runs) in self.runs.iter().enumerate() {
            let passes = runs.iter().map(|run| run.points.len()).min().unwrap_or(0);
            for pass in 0..passes {
                let of = |of: fn(&Point) -> f64| {
                    let values: Vec<_> = runs.iter().map(|run| of(&run.points[pass])).collect();
                    Estimate::of(&values)
                };
                means.push(Mean {
                    way,
                    spp: of(|point| point.spp).mean,
                    seconds: of(|point| point.seconds),
                    relmse: of(|point| point.relmse),
                    flip: of(|point| point.flip),
                    max: of(|point| point.max),
                });
            }
        }
        means
    }

    fn front<'m>(&self, means: &'m [Mean]) -> Vec<&'m Mean> {
        let points: Vec<_> = means.iter().map(|mean| [mean.seconds.mean, mean.flip.mean]).collect();
        front(&points).into_iter().map(|index| &means[index]).collect()
    }

    fn label(&self, mean: &Mean) -> String {
        format!("{}, {:.0} spp", self.ways[mean.way].name, mean.spp)
    }

    fn front_series(&self, name: &str) -> Series {
        let means = self.means();
        let front = self.front(&means);
        let points = front.iter().map(|mean| [mean.seconds.mean, mean.flip.mean]).collect();
        Series::line(name, points).with_marks()
    }

    fn report(&self, report: &mut Report, advice: &mut Table) -> anyhow::Result<()> {
        let means = self.means();
        let front = self.front(&means);
        let input = &self.subject.input;
        let Reference { relmse, flip, is_old, .. } = &self.reference;
        let how = if *is_old { "was made by an earlier run" } else { "was made now" };
        report.paragraph(&format!(
            "The picture that is taken for the true one shades each thread near. By the difference of its \
             halves, its own noise amounts to a relMSE of {relmse:.1e} and a FLIP of about {flip:.3}; it \
             {how}."
        ));
        let words = self.advise(&means, advice);
        report.paragraph(&words);
        report.table(self.ways_measured(&means));
        report.plots(vec![
            self.plot(&means, &front, "flip", "FLIP", |mean| mean.flip),
            self.plot(&means, &front, "relmse", "relMSE", |mean| mean.relmse),
        ]);
        report.table(self.equal());
        self.pictures(report)?;
        report.table(self.all_points(&means, &front));

        let last = |way: usize| self.runs[way].iter().filter_map(|run| run.points.last());
        let least = (0..self.ways.len())
            .flat_map(last)
            .map(|point| point.relmse)
            .fold(f64::INFINITY, f64::min);
        report.check(Check::new(
            format!("{input}: relMSE of the reference over the least that was found"),
            relmse / least,
            Limit::AtMost(0.75),
        ));
        report.check(Check::new(
            format!("{input}: relMSE between single points and batches of equal samples"),
            self.apart(Tier::Single),
            Limit::AtMost(0.0),
        ));
        Ok(())
    }

    /// The greatest difference in relMSE of the runs of a tier and of batches near by, over the latter.
    fn apart(&self, tier: Tier) -> f64 {
        let near = |way: &Way| way.level == Level::Near;
        let Some(batches) = self.ways.iter().position(near) else { return 0.0 };
        let ways = self.ways.iter().zip(&self.runs);
        let ways = ways.filter(|(way, _)| near(way) && way.tier == tier);
        let pairs = ways.flat_map(|(_, runs)| runs.iter().zip(&self.runs[batches]));
        let points = pairs.flat_map(|(run, usual)| run.points.iter().zip(&usual.points));
        points.map(|(a, b)| (a.relmse - b.relmse).abs() / b.relmse).fold(0.0, f64::max)
    }

    /// The least dear way to each goal, as a sentence and as rows.
    fn advise(&self, means: &[Mean], advice: &mut Table) -> String {
        let mut words = Vec::new();
        for goal in GOALS {
            let good = means.iter().filter(|mean| mean.flip.interval()[1] <= goal);
            let best = good.min_by(|a, b| a.seconds.mean.total_cmp(&b.seconds.mean));
            let Some(best) = best else {
                words.push(format!("No way that was tried comes to FLIP ≤ {goal}."));
                continue;
            };
            words.push(format!(
                "For FLIP ≤ {goal} choose {} ({:.2} s).",
                self.label(best),
                best.seconds.mean
            ));
            advice.row([
                self.subject.name.as_str().into(),
                goal.into(),
                self.ways[best.way].name.as_str().into(),
                best.spp.into(),
                best.seconds.mean.into(),
                best.relmse.mean.into(),
            ]);
        }
        words.join(" ")
    }

    /// Speed and memory of each way, and the error of its last point.
    fn ways_measured(&self, means: &[Mean]) -> Table {
        let columns = [
            "way",
            "Msamples/s",
            "±",
            "spp",
            "seconds",
            "relMSE",
            "±",
            "FLIP",
            "±",
            "worst pixel",
            "cloth, kB",
            "process, MB",
        ];
        let mut table = Table::new(&format!("{}-ways", self.subject.name), columns);
        for (index, (way, runs)) in self.ways.iter().zip(&self.runs).enumerate() {
            let Some(last) = means.iter().rfind(|mean| mean.way == index) else { continue };
            let speeds: Vec<_> = runs
                .iter()
                .filter_map(|run| {
                    Some(run.samples as f64 * 1e-6 / run.points.last()?.seconds.max(1e-9))
                })
                .collect();
            let speed = Estimate::of(&speeds);
            let peak = runs.iter().filter_map(|run| run.peak_bytes).max();
            table.row([
                way.name.as_str().into(),
                speed.mean.into(),
                speed.half.into(),
                last.spp.into(),
                last.seconds.mean.into(),
                last.relmse.mean.into(),
                last.relmse.half.into(),
                last.flip.mean.into(),
                last.flip.half.into(),
                last.max.mean.into(),
                (self.cloth_bytes[index] as f64 * 1e-3).into(),
                peak.map(|bytes| bytes as f64 * 1e-6).into(),
            ]);
        }
        table
    }

    fn plot(
        &self,
        means: &[Mean],
        front: &[&Mean],
        name: &str,
        label: &str,
        of: impl Fn(&Mean) -> Estimate,
    ) -> Plot {
        let title = format!("{}: {label} over time", self.subject.input);
        let name = format!("{}-{name}", self.subject.name);
        let mut plot = Plot::new(&name, &title, Axis::new("seconds").log(), Axis::new(label).log());
        for (index, way) in self.ways.iter().enumerate() {
            let own = || means.iter().filter(|mean| mean.way == index);
            let points = own().map(|mean| [mean.seconds.mean, of(mean).mean]).collect();
            let intervals = own().map(|mean| of(mean).interval()).collect();
            plot =
                plot.with(Series::line(&way.name, points).with_marks().with_intervals(intervals));
        }
        let points = front.iter().map(|mean| [mean.seconds.mean, of(mean).mean]).collect();
        plot.with(Series::line("what nothing beats in FLIP", points))
    }

    /// Errors at the time, and times at the error, of the usual way.
    fn equal(&self) -> Table {
        let columns = [
            "way",
            "FLIP in equal time, ratio",
            "±",
            "relMSE in equal time, ratio",
            "±",
            "time to equal FLIP, ratio",
            "±",
            "time to equal relMSE, ratio",
            "±",
        ];
        let mut table = Table::new(&format!("{}-equal", self.subject.name), columns);
        for (way, runs) in self.ways.iter().zip(&self.runs) {
            let ratios = |ratio: &dyn Fn(&Run, &Point, &[Point]) -> Option<f64>| {
                let ratios: Option<Vec<f64>> = runs
                    .iter()
                    .zip(&self.runs[0])
                    .map(|(run, usual)| {
                        let at =
                            usual.points.iter().find(|point| point.spp >= f64::from(USUAL_SPP));
                        ratio(run, at.or(usual.points.last())?, &usual.points)
                    })
                    .collect();
                ratios.map(|ratios| Estimate::of(&ratios))
            };
            // An adaptive run has one point: the usual way is then read at its time and its error.
            let is_adaptive = way.limits.noise.is_some();
            let error = |of: fn(&Point) -> f64| {
                ratios(&|run, at, usual| match is_adaptive {
                    true => {
                        let own = run.points.last()?;
                        Some(of(own) / at_time(usual, own.seconds, of)?)
                    }
                    false => Some(at_time(&run.points, at.seconds, of)? / of(at)),
                })
            };
            let time = |of: fn(&Point) -> f64| {
                ratios(&|run, at, usual| match is_adaptive {
                    true => {
                        let own = run.points.last()?;
                        Some(own.seconds / time_of(usual, of(own), of)?)
                    }
                    false => Some(time_of(&run.points, of(at), of)? / at.seconds),
                })
            };
            let (flip, relmse) = (|point: &Point| point.flip, |point: &Point| point.relmse);
            let all = [error(flip), error(relmse), time(flip), time(relmse)];
            let cells = all.into_iter().flat_map(|estimate| {
                [estimate.map(|estimate| estimate.mean), estimate.map(|estimate| estimate.half)]
            });
            let name = [way.name.as_str().into()];
            table.row(name.into_iter().chain(cells.map(Into::into)));
        }
        table
    }

    fn pictures(&self, report: &mut Report) -> anyhow::Result<()> {
        let name = format!("{}-reference", self.subject.name);
        let picture: &Picture = &self.reference.picture;
        let caption = format!("{}: what is taken for true", self.subject.input);
        report.pictures(vec![Figure::new(&name, &caption, picture)?]);
        Ok(())
    }

    fn all_points(&self, means: &[Mean], front: &[&Mean]) -> Table {
        let columns =
            ["way", "spp", "seconds", "±", "relMSE", "±", "FLIP", "±", "worst pixel", "±", "front"];
        let mut table = Table::new(&format!("{}-points", self.subject.name), columns);
        for mean in means {
            let is_front = front.iter().any(|other| std::ptr::eq(*other, mean));
            table.row([
                self.ways[mean.way].name.as_str().into(),
                mean.spp.into(),
                mean.seconds.mean.into(),
                mean.seconds.half.into(),
                mean.relmse.mean.into(),
                mean.relmse.half.into(),
                mean.flip.mean.into(),
                mean.flip.half.into(),
                mean.max.mean.into(),
                mean.max.half.into(),
                if is_front { "●" } else { "" }.into(),
            ]);
        }
        table
    }
}
