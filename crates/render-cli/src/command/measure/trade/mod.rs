//! `selvedge measure trade`.

mod equal;
mod ways;

use std::sync::Arc;

use super::{Findings, Subject, tell_progress};
use crate::{
    args::MeasureOptions,
    image::Picture,
    measure::trade::{
        Point, Run, Way, draw,
        normalization::Yarns,
        prepare,
        reference::{self, Reference},
        statistics::{Estimate, front},
        woven,
    },
    render::{
        detail::{Level, Tier},
        film::{Crop, Frame, Size},
    },
    report::{Axis, Check, Figure, Limit, Plot, Report, Series, Table},
};

/// Runs of each way, each with a seed of its own.
const SEEDS: u64 = 5;

/// The picture of which the middle is drawn, so small that threads are about as wide as pixels; pixels of
/// that part, which has sides of 3 to 2; and samples of a pixel in each half of the reference.
const WHOLE: [u32; 2] = [480, 320];
const PIXELS: f64 = 96.0 * 64.0;
const REFERENCE_SPP: u32 = 512;

/// What way is advised for, FLIP.
const GOALS: [f64; 4] = [0.1, 0.07, 0.05, 0.03];

pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "Speed against accuracy",
        "Each cloth, draped in the built-in scene, is drawn in many ways, and each picture on its way is \
         compared with one that is taken for the true one.",
    );
    let (frame, ways) = (frame(options)?, ways::all(options));
    let size = frame.crop_size();
    report.paragraph(&format!(
        "Pictures are the middle {}x{} pixels of {}x{}. Each way is run {SEEDS} times with other noise, \
         in turns with all others; numbers are means with intervals that hold the true mean with 95 %. Seconds are those of \
         drawing on {} threads; preparing the cloth and comparing pictures do not count. The worst pixel \
         is the greatest difference of a component, in linear values.",
        size.width(),
        size.height(),
        frame.size().width(),
        frame.size().height(),
        rayon::current_num_threads()
    ));
    report.table(ways::table(&ways));
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
        let spp = ways::spp(options, REFERENCE_SPP);
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
        // Factors change from run to run, the rest of the cloth does not.
        let mut searched = None;
        let mut runs = vec![Vec::new(); ways.len()];
        for seed in (0..SEEDS).map(|seed| options.seed.wrapping_add(seed)) {
            for (index, way) in ways.iter().enumerate() {
                let run = match way.search {
                    None => draw(&mut reference, &shaders[index], way, seed),
                    Some(search) => {
                        let mut shader = searched.take().map_or_else(|| prepare(cloth, way), Ok)?;
                        yarns.rescale(&mut shader, &usual, search, seed)?;
                        let shader = Arc::new(shader);
                        let run = draw(&mut reference, &shader, way, seed);
                        // The scene lets go of it.
                        reference.scene.dress(&woven(&usual));
                        searched = Arc::into_inner(shader);
                        run
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
        report.table(equal::table(&format!("{}-equal", self.subject.name), self.ways, &self.runs));
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
