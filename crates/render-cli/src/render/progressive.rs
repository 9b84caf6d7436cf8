//! Exposing a picture in passes, until it is good enough or time is up.
//!
//! Each pass takes every tile that is not done to the next of 1, 2, 4, 8, 16, 32, 48, 64 … samples
//! per pixel, which are all spread evenly. How many samples a tile gets depends on the subject, the
//! limits and the samples of that tile alone. So the result has the same bits for any number of
//! threads, for a crop as for that part of the whole, and with or without a break; but for a limit
//! of time, which no machine keeps twice alike.

use std::{
    fmt,
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
    time::{Duration, Instant},
};

use rayon::prelude::*;

use super::{
    accumulate::{Accumulator, Halves, Layers, Tile},
    exposure::Expose,
    film::{Exposed, Frame},
    sampler::MAX_SAMPLES,
};

/// What is exposed, and how long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// The picture and its part that is taken.
    pub frame: Frame,
    /// What is kept besides the radiance.
    pub layers: Layers,
    /// When it ends.
    pub limits: Limits,
    /// Tells this subject from others: a hash of all that its samples depend on.
    pub key: u64,
}

/// When exposing ends: at the first of these that is met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Most samples per pixel; taken into 1 to [`MAX_SAMPLES`].
    pub spp: u32,
    /// Most time, with that of earlier runs. Each pixel gets one sample whatever it takes, and two
    /// where noise is limited.
    pub time: Option<Duration>,
    /// Root mean square of the [relative error](super::accumulate::relative_error) over a tile with
    /// which it is done.
    ///
    /// The error is estimated from two independent halves of the samples, from
    /// [`FEWEST_SAMPLES`] per pixel on. Means are plain means, but when to stop is decided by the
    /// samples themselves, which biases the mean where high samples make a large estimate too, since a
    /// tile goes on until it is small. As the estimate is over 256 pixels, that is a small part of
    /// the error asked for: less than a twentieth where one sample in ten has all the light.
    pub noise: Option<f32>,
}

impl Plan {
    /// Whether samples come from two sequences: where their noise must be known.
    pub fn halves(&self) -> Halves {
        if self.limits.noise.is_some() { Halves::Two } else { Halves::None }
    }

    /// No samples as yet.
    pub fn start(&self) -> Accumulator {
        Accumulator::new(self.frame, self.layers, self.halves())
    }
}

/// How exposing is watched and ended from outside.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Ends it as soon as the tiles that are being exposed are done.
    pub interrupt: &'a AtomicBool,
    /// Is called after each tile, from any thread.
    pub watch: &'a (dyn Fn(&Progress) + Sync),
    /// Is called between tiles with all that was exposed so far.
    pub save: Option<Save<'a>>,
    /// Is called likewise and after each pass, and the time that it takes does not count: to compare
    /// what was exposed so far.
    pub study: Option<Save<'a>>,
}

impl<'a> Control<'a> {
    /// Nobody watches; it ends as soon as `interrupt` is set.
    pub fn until(interrupt: &'a AtomicBool) -> Self {
        Self { interrupt, watch: &|_| {}, save: None, study: None }
    }
}

/// When and how an unfinished picture is saved or studied.
#[derive(Clone, Copy)]
pub struct Save<'a> {
    /// Time between two calls.
    pub every: Duration,
    /// Saves or studies it.
    pub save: &'a (dyn Fn(&Accumulator) + Sync),
}

impl fmt::Debug for Control<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Control")
            .field("interrupt", self.interrupt)
            .field("save", &self.save)
            .field("study", &self.study)
            .finish_non_exhaustive()
    }
}

impl fmt::Debug for Save<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Save").field("every", &self.every).finish_non_exhaustive()
    }
}

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Time so far, with that of earlier runs.
    pub elapsed: Duration,
    /// Estimate of the time to come; `None` where nothing is known of it.
    pub left: Option<Duration>,
    /// Samples so far, with those of earlier runs.
    pub samples: u64,
    /// Mean number of samples per pixel.
    pub spp: f64,
    /// Samples per second of this run.
    pub rate: f64,
    /// The part that is done, 0 to 1.
    pub done: f64,
}

/// Why it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// All samples were taken.
    Spp,
    /// The time is up.
    Time,
    /// The noise is as low as asked for.
    Noise,
    /// [`Control::interrupt`] was set.
    Interrupted,
}

/// How it ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// All that was exposed.
    pub accumulator: Accumulator,
    /// Why it ended.
    pub stopped: Stopped,
    /// Fewest samples of a pixel.
    pub spp_min: u32,
    /// Mean number of samples of a pixel.
    pub spp_mean: f64,
    /// Most samples of a pixel.
    pub spp_max: u32,
    /// Samples in all.
    pub samples: u64,
    /// Samples of this run.
    pub new_samples: u64,
    /// Time of this run; that of all is [`Accumulator::elapsed`].
    pub new_elapsed: Duration,
}

impl Outcome {
    /// The picture and its layers.
    pub fn exposed(&self) -> Exposed {
        self.accumulator.exposed()
    }
}

/// Samples per pixel below which no noise is estimated: a few could miss all of a small light.
pub const FEWEST_SAMPLES: u32 = 8;

/// Exposes `subject` on the threads of the current rayon pool.
pub fn expose(subject: &impl Expose, plan: &Plan, control: &Control<'_>) -> Outcome {
    resume(subject, plan, plan.start(), control)
}

/// Goes on from where `accumulator` is, which [`Plan::start`] began for a plan that was the same but
/// for its limits. What is limited may be changed at a break, but not whether noise is.
///
/// # Panics
///
/// If the accumulator is of another frame, or keeps other sums.
pub fn resume(
    subject: &impl Expose,
    plan: &Plan,
    mut accumulator: Accumulator,
    control: &Control<'_>,
) -> Outcome {
    assert!(accumulator.is_of(plan.frame, plan.layers, plan.halves()), "they belong together");
    let mut run = Run::new(subject, plan, control, &accumulator);
    let stopped = loop {
        run.ahead = Ahead::of(&accumulator.tiles, &run.limits);
        if run.ahead.pixels == 0 {
            break if run.ahead.is_noise_met { Stopped::Noise } else { Stopped::Spp };
        }
        if control.interrupt.load(Ordering::Relaxed) {
            break Stopped::Interrupted;
        }
        let Some(level) = run.level() else { break Stopped::Time };
        run.pass(&mut accumulator.tiles, level);
        accumulator.elapsed = run.elapsed();
        if let Some(save) = control.save.filter(|_| run.is_save_due()) {
            (save.save)(&accumulator);
            run.saved = run.clock();
        }
        if let Some(study) = control.study {
            let begun = Instant::now();
            (study.save)(&accumulator);
            run.paused += begun.elapsed();
            run.studied = run.clock();
        }
    };
    accumulator.elapsed = run.elapsed();
    (control.watch)(&run.progress());
    Outcome::new(accumulator, stopped, &run)
}

impl Outcome {
    fn new<S: Expose>(accumulator: Accumulator, stopped: Stopped, run: &Run<'_, S>) -> Self {
        let counts = accumulator.tiles.iter().map(|tile| tile.samples);
        let samples = accumulator.samples();
        Self {
            stopped,
            spp_min: counts.clone().min().unwrap_or(0),
            spp_mean: samples as f64 / run.pixels as f64,
            spp_max: counts.max().unwrap_or(0),
            samples,
            new_samples: run.new_samples.load(Ordering::Relaxed),
            new_elapsed: run.clock(),
            accumulator,
        }
    }
}

impl Limits {
    /// Samples per pixel after which a tile with `samples` is looked at next.
    fn next(&self, samples: u32) -> u32 {
        let fewest = if self.noise.is_some() { 2 } else { 1 };
        // Beyond 16, steps of an eighth: short enough for tiles to take turns, few enough for noise not
        // to find many occasions to look small by chance.
        let next = match samples {
            0..16 => (samples + 1).next_power_of_two().max(fewest),
            _ => (samples + (samples / 8).clamp(16, 256)) / 16 * 16,
        };
        next.min(self.spp)
    }

    /// Samples per pixel that a tile needs, by what is known of it; those that it has, if it is done.
    fn needed(&self, tile: &Tile) -> u32 {
        let Some(noise) = self.noise.filter(|_| tile.samples < self.spp) else {
            return self.spp.max(tile.samples);
        };
        if tile.samples < FEWEST_SAMPLES {
            return FEWEST_SAMPLES.min(self.spp);
        }
        let excess = tile.error() / f64::from(noise);
        if excess <= 1.0 {
            return tile.samples;
        }
        // Errors fall with the root of the number of samples. Both halves get as many. What is not
        // finite ends up at the limit.
        let needed = (f64::from(tile.samples) * excess * excess).min(self.spp.into());
        (needed as u32 + 1).next_multiple_of(2).min(self.spp)
    }
}

/// What is still to be done.
#[derive(Clone, Copy)]
struct Ahead {
    /// Pixels of the tiles that are not done.
    pixels: u64,
    /// Fewest samples of such a pixel.
    fewest: u32,
    /// Samples that are missing, by what is known.
    samples: u64,
    /// Whether the noise of all tiles that are done is as low as asked for.
    is_noise_met: bool,
}

impl Ahead {
    const NOTHING: Self = Self { pixels: 0, fewest: u32::MAX, samples: 0, is_noise_met: true };

    fn of(tiles: &[Tile], limits: &Limits) -> Self {
        tiles.par_iter().map(|tile| Self::of_tile(tile, limits)).reduce(|| Self::NOTHING, Self::and)
    }

    fn of_tile(tile: &Tile, limits: &Limits) -> Self {
        let missing = limits.needed(tile) - tile.samples;
        if missing == 0 {
            let is_noise_met = limits.noise.is_some_and(|noise| tile.error() <= noise.into());
            return Self { is_noise_met, ..Self::NOTHING };
        }
        let pixels = tile.pixels();
        let samples = u64::from(missing) * pixels;
        Self { pixels, fewest: tile.samples, samples, is_noise_met: true }
    }

    fn and(self, other: Self) -> Self {
        Self {
            pixels: self.pixels + other.pixels,
            fewest: self.fewest.min(other.fewest),
            samples: self.samples + other.samples,
            is_noise_met: self.is_noise_met && other.is_noise_met,
        }
    }
}

/// A run and its clock.
struct Run<'a, S> {
    subject: &'a S,
    limits: Limits,
    control: &'a Control<'a>,
    started: Instant,
    /// What earlier runs took and gave.
    old_elapsed: Duration,
    old_samples: u64,
    /// Pixels of all tiles.
    pixels: u64,
    new_samples: AtomicU64,
    /// What was ahead when the pass began, and the samples of this run then.
    ahead: Ahead,
    samples_at_pass: u64,
    /// When the last picture was saved and studied, on the clock of this run.
    saved: Duration,
    studied: Duration,
    /// Time that does not count.
    paused: Duration,
}

impl<'a, S: Expose> Run<'a, S> {
    fn new(
        subject: &'a S,
        plan: &Plan,
        control: &'a Control<'a>,
        accumulator: &Accumulator,
    ) -> Self {
        let spp = plan.limits.spp.clamp(1, MAX_SAMPLES);
        Self {
            subject,
            limits: Limits { spp, ..plan.limits },
            control,
            started: Instant::now(),
            old_elapsed: accumulator.elapsed,
            old_samples: accumulator.samples(),
            pixels: accumulator.tiles.iter().map(Tile::pixels).sum(),
            new_samples: AtomicU64::new(0),
            ahead: Ahead::NOTHING,
            samples_at_pass: 0,
            saved: Duration::ZERO,
            studied: Duration::ZERO,
            paused: Duration::ZERO,
        }
    }

    fn elapsed(&self) -> Duration {
        self.old_elapsed + self.clock()
    }

    /// Time of this run.
    fn clock(&self) -> Duration {
        self.started.elapsed().saturating_sub(self.paused)
    }

    /// Samples per second of this run.
    fn rate(&self) -> f64 {
        let seconds = self.clock().as_secs_f64().max(1e-9);
        self.new_samples.load(Ordering::Relaxed) as f64 / seconds
    }

    /// To how many samples per pixel the next pass goes; `None` if there is no time for any.
    fn level(&self) -> Option<u32> {
        let fewest = self.ahead.fewest;
        let next = self.limits.next(fewest);
        let Some(time) = self.limits.time.filter(|_| fewest > 0) else { return Some(next) };
        let left = time.saturating_sub(self.elapsed()).as_secs_f64();
        let step = if self.limits.noise.is_some() { 2 } else { 1 };
        // A run that goes on does not know its speed until it has made a step.
        let fitting = match self.new_samples.load(Ordering::Relaxed) {
            0 if left > 0.0 => step,
            _ => (left * self.rate() / self.ahead.pixels as f64) as u32 / step * step,
        };
        (fitting > 0).then(|| next.min(fewest.saturating_add(fitting)))
    }

    /// Takes tiles that are not done to `level` samples per pixel, or ends early.
    fn pass(&mut self, tiles: &mut [Tile], level: u32) {
        self.samples_at_pass = self.new_samples.load(Ordering::Relaxed);
        let run = &*self;
        tiles.par_iter_mut().with_max_len(1).for_each(|tile| {
            // A break may take longer than the time between two: something must have been done
            // meanwhile.
            let has_begun = || run.new_samples.load(Ordering::Relaxed) > run.samples_at_pass;
            let is_over = || {
                run.control.interrupt.load(Ordering::Relaxed) || (run.is_break_due() && has_begun())
            };
            while tile.samples < level && !is_over() {
                let next = run.limits.next(tile.samples).min(run.limits.needed(tile)).min(level);
                if next == tile.samples {
                    break;
                }
                let added = u64::from(next - tile.samples) * tile.pixels();
                tile.expose(run.subject, next);
                run.new_samples.fetch_add(added, Ordering::Relaxed);
                (run.control.watch)(&run.progress());
            }
        });
    }

    fn is_save_due(&self) -> bool {
        self.control.save.is_some_and(|save| self.clock() - self.saved >= save.every)
    }

    /// Whether it is time to save or to study what there is.
    fn is_break_due(&self) -> bool {
        let study = self.control.study;
        self.is_save_due() || study.is_some_and(|study| self.clock() - self.studied >= study.every)
    }

    fn progress(&self) -> Progress {
        let elapsed = self.elapsed();
        let new_samples = self.new_samples.load(Ordering::Relaxed);
        let samples = self.old_samples + new_samples;
        let missing = self.ahead.samples.saturating_sub(new_samples - self.samples_at_pass);
        let rate = self.rate();
        // As long as tiles are too young for an estimate, nothing is known of what they need.
        let is_young = self.limits.noise.is_some() && self.ahead.fewest < FEWEST_SAMPLES;
        let by_samples = (!is_young && rate > 0.0).then(|| missing as f64 / rate);
        let by_time = self.limits.time.map(|time| time.saturating_sub(elapsed).as_secs_f64());
        let left = by_samples.into_iter().chain(by_time).reduce(f64::min);
        let done = left.map_or(0.0, |left| elapsed.as_secs_f64() / (elapsed.as_secs_f64() + left));
        Progress {
            elapsed,
            left: left.and_then(|left| Duration::try_from_secs_f64(left).ok()),
            samples,
            spp: samples as f64 / self.pixels as f64,
            rate,
            done: if self.ahead.pixels == 0 { 1.0 } else { done },
        }
    }
}

#[cfg(test)]
mod tests;
