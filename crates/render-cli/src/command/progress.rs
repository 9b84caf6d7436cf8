//! Telling how far it is.

use std::{
    io::{self, IsTerminal},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::{args::ProgressForm, output::tell, render::progressive::Progress};

/// Tells on stderr how far it is.
#[derive(Debug)]
pub(super) struct Reporter {
    form: Form,
    state: Mutex<State>,
}

#[derive(Debug)]
enum Form {
    Bar(ProgressBar),
    Plain,
    Json,
    None,
}

#[derive(Debug)]
struct State {
    /// When something was told.
    told: Instant,
    latest: Option<Progress>,
}

/// Steps of a bar.
const STEPS: u64 = 1000;

/// Time between two lines.
const PLAIN: Duration = Duration::from_secs(5);
const JSON: Duration = Duration::from_millis(500);

impl Reporter {
    pub(super) fn new(form: ProgressForm) -> Self {
        let form = match form {
            ProgressForm::Auto if io::stderr().is_terminal() => Form::Bar(bar()),
            ProgressForm::Auto | ProgressForm::Plain => Form::Plain,
            ProgressForm::Json => Form::Json,
            ProgressForm::None => Form::None,
        };
        Self { form, state: Mutex::new(State { told: Instant::now(), latest: None }) }
    }

    /// Tells it if the time has come. Threads may overtake each other; what is told only grows.
    pub(super) fn watch(&self, progress: &Progress) {
        if matches!(self.form, Form::None) {
            return;
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.latest.is_some_and(|latest| latest.samples > progress.samples) {
            return;
        }
        let is_first = state.latest.replace(*progress).is_none();
        let is_due = |period| state.told.elapsed() >= period;
        match &self.form {
            Form::Bar(bar) => {
                bar.set_position((progress.done * STEPS as f64) as u64);
                bar.set_message(in_words(progress));
                return;
            }
            Form::Plain if is_due(PLAIN) => tell(plain(progress)),
            Form::Json if is_first || is_due(JSON) => tell(json(progress)),
            _ => return,
        }
        state.told = Instant::now();
    }

    /// Takes the bar away, or writes the last object.
    pub(super) fn finish(&self) {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        match (&self.form, &state.latest) {
            (Form::Bar(bar), _) => bar.finish_and_clear(),
            (Form::Json, Some(latest)) => tell(json(latest)),
            _ => {}
        }
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {percent:>3} %, {msg}")
        .expect("the template names fields of indicatif");
    ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr()).with_style(style)
}

/// `0:12, 0:40 left, 7.5 spp, 0.812 Msamples/s`
fn in_words(progress: &Progress) -> String {
    let left = progress.left.map_or_else(String::new, |left| format!(", {} left", clock(left)));
    let Progress { spp, rate, .. } = progress;
    format!("{}{left}, {spp:.1} spp, {:.3} Msamples/s", clock(progress.elapsed), rate * 1e-6)
}

fn plain(progress: &Progress) -> String {
    format!("{:.0} %, {}", progress.done * 100.0, in_words(progress))
}

/// `1:02:03`, without the hours where there are none.
fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes}:{seconds:02}")
    }
}

/// An object on a line.
#[derive(Serialize)]
struct Line {
    elapsed_s: f64,
    eta_s: Option<f64>,
    spp: f64,
    samples: u64,
    msamples_per_s: f64,
    /// The part that is done, 0 to 1.
    done: f64,
}

fn json(progress: &Progress) -> String {
    let rounded = |number: f64| (number * 1e3).round() * 1e-3;
    let line = Line {
        elapsed_s: rounded(progress.elapsed.as_secs_f64()),
        eta_s: progress.left.map(|left| rounded(left.as_secs_f64())),
        spp: rounded(progress.spp),
        samples: progress.samples,
        msamples_per_s: progress.rate * 1e-6,
        done: progress.done,
    };
    serde_json::to_string(&line).expect("numbers under fixed names are JSON")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRESS: Progress = Progress {
        elapsed: Duration::from_millis(12_345),
        left: Some(Duration::from_secs(3723)),
        samples: 1_000_000,
        spp: 7.5,
        rate: 812_345.0,
        done: 0.25,
    };

    #[test]
    fn words_have_time_samples_and_speed() {
        assert_eq!(plain(&PROGRESS), "25 %, 0:12, 1:02:03 left, 7.5 spp, 0.812 Msamples/s");
        let unknown = Progress { left: None, ..PROGRESS };
        assert_eq!(plain(&unknown), "25 %, 0:12, 7.5 spp, 0.812 Msamples/s");
    }

    #[test]
    fn object_has_the_same_as_numbers() {
        let object: serde_json::Value = serde_json::from_str(&json(&PROGRESS)).unwrap();
        let number = |key: &str| object[key].as_f64().unwrap();
        assert_eq!(object.as_object().unwrap().len(), 6);
        for (key, expected) in [
            ("elapsed_s", 12.345),
            ("eta_s", 3723.0),
            ("spp", 7.5),
            ("samples", 1e6),
            ("msamples_per_s", 0.812_345),
            ("done", 0.25),
        ] {
            assert!((number(key) - expected).abs() < 1e-9, "{key}: {object}");
        }
    }
}
