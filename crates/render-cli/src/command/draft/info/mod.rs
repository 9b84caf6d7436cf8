//! `selvedge draft info`: what a draft is, for people and for programs.

mod text;

use std::collections::BTreeMap;

use selvedge_wif::{Draft, Drawdown, Hand, Location, Plan, Rgb8, Severity, Side, Weave};
use serde::Serialize;

use crate::{
    args::InfoOptions,
    draft::{self, DraftFile},
    output::Sink,
    terminal::Terminal,
};

/// Tells what `options.draft` is: as text, or as the JSON of [`Info`].
///
/// # Errors
///
/// When the draft cannot be read, or standard output cannot be written.
pub fn run(options: &InfoOptions) -> anyhow::Result<()> {
    let file = draft::read(&options.draft)?;
    let info = Info::new(&file, file.draft()?);
    let text = if options.json {
        serde_json::to_string_pretty(&info)? + "\n"
    } else {
        text::text(&info, Terminal::from_environment())
    };
    Sink::Stdout.write(|out| out.write_all(text.as_bytes()))?;
    Ok(())
}

/// What a draft is. Lengths are in mm; `None`, null in JSON, is what the draft does not say.
#[derive(Debug, Serialize)]
pub struct Info<'a> {
    file: &'a str,
    title: Option<&'a str>,
    author: Option<&'a str>,
    program: Option<&'a str>,
    program_version: Option<&'a str>,
    ends: u32,
    picks: u32,
    shafts: u32,
    treadles: u32,
    rising_shed: bool,
    /// `liftplan` or `tieup`: what weaves.
    plan: Option<&'static str>,
    warp: Spacing,
    weft: Spacing,
    width_mm: Option<f64>,
    length_mm: Option<f64>,
    colors: Vec<Color>,
    cloth: Option<Cloth>,
    /// Why there is no cloth.
    no_drawdown: Option<String>,
    diagnostics: Diagnostics<'a>,
}

/// How the threads of one side lie, where that is said of every one.
#[derive(Debug, Serialize)]
struct Spacing {
    threads_per_cm: Option<f64>,
    threads_per_inch: Option<f64>,
    spacing_mm: Option<Range>,
    thickness_mm: Option<Range>,
}

#[derive(Debug, Serialize)]
struct Range {
    min: f64,
    mean: f64,
    max: f64,
}

/// A colour in use.
#[derive(Debug, Serialize)]
struct Color {
    /// Its number in the draft's table.
    number: Option<u32>,
    /// As in `#1a2b3c`.
    srgb: String,
    ends: usize,
    picks: usize,
}

#[derive(Debug, Serialize)]
struct Cloth {
    weave: WeaveClass,
    /// The weave in words, with all that is known of it.
    #[serde(skip)]
    weave_name: String,
    repeat: Repeat,
    /// Counting colours and lengths too.
    repeat_with_threads: Repeat,
    /// Part of the face where the warp is on top.
    balance: f64,
    longest_floats: Floats,
}

#[derive(Debug, Serialize)]
#[serde(tag = "class", rename_all = "lowercase")]
enum WeaveClass {
    Plain,
    Twill { hand: &'static str, repeat: usize },
    Satin { face: &'static str, repeat: usize, step: usize },
    Other,
}

#[derive(Debug, Serialize)]
struct Repeat {
    ends: usize,
    picks: usize,
}

/// The longest floats in crossings.
#[derive(Debug, Serialize)]
struct Floats {
    face: Float,
    back: Float,
}

#[derive(Debug, Serialize)]
struct Float {
    warp: usize,
    weft: usize,
}

#[derive(Debug, Serialize)]
struct Diagnostics<'a> {
    errors: usize,
    warnings: usize,
    notes: usize,
    list: Vec<Finding<'a>>,
}

#[derive(Debug, Serialize)]
struct Finding<'a> {
    severity: String,
    code: &'static str,
    line: Option<usize>,
    column: Option<usize>,
    section: Option<&'a str>,
    message: &'a str,
    /// For how many findings it stands.
    count: usize,
}

impl<'a> Info<'a> {
    fn new(file: &'a DraftFile, draft: &'a Draft) -> Self {
        let given = |text: &'a String| (!text.is_empty()).then_some(text.as_str());
        let drawdown = draft.drawdown();
        Self {
            file: file.name(),
            title: given(&draft.text.title),
            author: given(&draft.text.author),
            program: given(&draft.source.program),
            program_version: given(&draft.source.version),
            ends: draft.warp.count,
            picks: draft.weft.count,
            shafts: draft.shafts,
            treadles: draft.treadles,
            rising_shed: draft.rising_shed,
            plan: draft.plan().map(|plan| match plan {
                Plan::LiftPlan => "liftplan",
                Plan::TieUp => "tieup",
            }),
            warp: Spacing::new(draft, Side::Warp),
            weft: Spacing::new(draft, Side::Weft),
            width_mm: pitches(draft, Side::Warp).map(|ends| mm(ends.iter().sum())),
            length_mm: pitches(draft, Side::Weft).map(|picks| mm(picks.iter().sum())),
            colors: colors(draft),
            cloth: drawdown.as_ref().ok().map(Cloth::new),
            no_drawdown: drawdown.err().map(|error| error.to_string()),
            diagnostics: Diagnostics::new(file),
        }
    }
}

impl Spacing {
    fn new(draft: &Draft, side: Side) -> Self {
        let pitches = pitches(draft, side);
        let per = |length: f64| {
            let pitches = pitches.as_deref()?;
            Some(rounded(length * pitches.len() as f64 / pitches.iter().sum::<f64>()))
        };
        let threads = 0..draft.side(side).count;
        let diameters: Option<Vec<_>> =
            threads.map(|index| draft.thread(side, index).diameter).collect();
        Self {
            threads_per_cm: per(0.01),
            threads_per_inch: per(0.0254),
            spacing_mm: pitches.as_deref().and_then(Range::new),
            thickness_mm: diameters.as_deref().and_then(Range::new),
        }
    }
}

/// The pitch of each thread of a side in metres, if the draft says it of all.
fn pitches(draft: &Draft, side: Side) -> Option<Vec<f64>> {
    (0..draft.side(side).count).map(|index| draft.thread(side, index).pitch).collect()
}

impl Range {
    /// Of lengths in metres; `None` if there are none.
    fn new(lengths: &[f64]) -> Option<Self> {
        let min = lengths.iter().copied().reduce(f64::min)?;
        let max = lengths.iter().copied().reduce(f64::max)?;
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        Some(Self { min: mm(min), mean: mm(mean), max: mm(max) })
    }
}

/// Metres as millimetres.
fn mm(metres: f64) -> f64 {
    rounded(metres * 1e3)
}

/// To six decimals, which leaves out what the conversion of units adds.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// The colours in use, by their number.
fn colors(draft: &Draft) -> Vec<Color> {
    let mut counts: BTreeMap<(Option<u32>, Rgb8), [usize; 2]> = BTreeMap::new();
    for (at, side) in [Side::Warp, Side::Weft].into_iter().enumerate() {
        for index in 0..draft.side(side).count {
            let thread = draft.thread(side, index);
            counts.entry((thread.color_number, thread.color)).or_default()[at] += 1;
        }
    }
    let counts = counts.into_iter();
    let colors = counts.map(|((number, Rgb8([red, green, blue])), [ends, picks])| {
        let srgb = format!("#{red:02x}{green:02x}{blue:02x}");
        Color { number, srgb, ends, picks }
    });
    colors.collect()
}

impl Cloth {
    fn new(drawdown: &Drawdown) -> Self {
        let repeat = |(ends, picks)| Repeat { ends, picks };
        let floats = |drawdown: &Drawdown| Float {
            warp: drawdown.longest_float(Side::Warp),
            weft: drawdown.longest_float(Side::Weft),
        };
        let weave = drawdown.weave();
        Self {
            weave: weave.into(),
            weave_name: weave.to_string(),
            repeat: repeat(drawdown.repeat()),
            repeat_with_threads: repeat(drawdown.repeat_with_threads()),
            balance: drawdown.balance(),
            longest_floats: Floats { face: floats(drawdown), back: floats(&drawdown.back()) },
        }
    }
}

impl From<Weave> for WeaveClass {
    fn from(weave: Weave) -> Self {
        match weave {
            Weave::Plain => Self::Plain,
            Weave::Twill { hand, repeat } => {
                let hand = if hand == Hand::S { "S" } else { "Z" };
                Self::Twill { hand, repeat }
            }
            Weave::Satin { face, repeat, step } => {
                let face = if face == Side::Warp { "warp" } else { "weft" };
                Self::Satin { face, repeat, step }
            }
            _ => Self::Other,
        }
    }
}

impl<'a> Diagnostics<'a> {
    fn new(file: &'a DraftFile) -> Self {
        let finding =
            |(diagnostic, place): (&'a selvedge_wif::Diagnostic, Option<Location>)| Finding {
                severity: diagnostic.severity.to_string(),
                code: diagnostic.code.as_str(),
                line: place.map(|place| place.line),
                column: place.map(|place| place.column),
                section: diagnostic.section(),
                message: diagnostic.message(),
                count: diagnostic.count(),
            };
        Self {
            errors: file.count(Severity::Error),
            warnings: file.count(Severity::Warning),
            notes: file.count(Severity::Note),
            list: file.located().map(finding).collect(),
        }
    }
}
