//! `selvedge draft lint`: what is odd about drafts, each finding in its line.

use annotate_snippets::{
    AnnotationKind, Group, Level, Renderer, Snippet,
    renderer::{AnsiColor, Style},
};
use selvedge_wif::{Diagnostic, Excerpt, Location, Severity};

use crate::{
    Outcome,
    args::LintOptions,
    draft::{self, DraftFile},
    input,
    output::{Sink, tell},
    terminal::{Terminal, printable},
};

/// Shows the diagnostics of all drafts, then counts them.
///
/// The outcome is [`Outcome::Faulty`] when a draft has errors or cannot be read, which is told on
/// stderr, else [`Outcome::BelowThreshold`] when there are warnings and `options.strict` is set.
///
/// # Errors
///
/// When standard output cannot be written.
pub fn run(options: &LintOptions) -> anyhow::Result<Outcome> {
    let terminal = Terminal::from_environment();
    let mut tally = Tally::default();
    for path in &options.drafts {
        match draft::read(path) {
            Ok(file) => {
                tally.add(&file);
                Sink::Stdout.write(|out| {
                    let mut findings = file.located();
                    findings.try_for_each(|(diagnostic, place)| {
                        writeln!(out, "{}\n", finding(&file, diagnostic, place, terminal))
                    })
                })?;
            }
            Err(error) => {
                tally.unreadable += 1;
                tell(format_args!("error: {:#}", anyhow::Error::from(error)));
            }
        }
    }
    let what = match &options.drafts[..] {
        [path] => printable(&input::name(path)),
        paths => format!("{} files", paths.len()),
    };
    let outcome = tally.outcome(options.strict);
    let reason =
        if outcome == Outcome::BelowThreshold { "; --strict allows no warnings" } else { "" };
    Sink::Stdout.write(|out| writeln!(out, "{what}: {}{reason}", tally.summary()))?;
    Ok(outcome)
}

/// The diagnostic with its code, its place, and the line with the place marked:
///
/// ```text
/// warning[shafts-raised]: treadle 9 ties shaft 12, expected at most 8
///   --> tweed.wif:14:5 in [TIEUP]
/// 14 | 9=1,12
///    |     ^^
/// ```
///
/// annotate-snippets draws the line, as it knows the width of characters; it gets as much of it as
/// fits, and no message, as it would run over the edge with either.
fn finding(
    file: &DraftFile,
    diagnostic: &Diagnostic,
    place: Option<Location>,
    terminal: Terminal,
) -> String {
    let (level, color) = match diagnostic.severity {
        Severity::Error => (Level::ERROR, AnsiColor::BrightRed),
        Severity::Warning => (Level::WARNING, AnsiColor::Yellow),
        Severity::Note => (Level::NOTE, AnsiColor::BrightGreen),
    };
    let paint = |style: Style| if terminal.colors { style } else { Style::new() };
    let label = paint(color.on_default().bold());
    let bold = paint(Style::new().bold());
    let frame = paint(AnsiColor::BrightBlue.on_default().bold());

    let name = printable(file.name());
    let code = format!("{}[{}]", diagnostic.severity, diagnostic.code);
    let title = format!("{code}: {}", printable(diagnostic.message()));
    let title = terminal.wrap(&title, 4);
    let message = title.strip_prefix(&code).unwrap_or_default();
    let title = format!("{label}{code}{label:#}{bold}{message}{bold:#}");
    let Some(Location { line, column, .. }) = place else {
        return format!("{title}\n {frame}-->{frame:#} {name}");
    };
    let gutter = line.to_string().len();
    let mut place = format!("{name}:{line}:{column}");
    if let Some(section) = diagnostic.section() {
        let section = format!("in [{}]", printable(section));
        let width = gutter + 4 + place.chars().count() + 1 + section.chars().count();
        let fits = width <= terminal.columns;
        place += &if fits { format!(" {section}") } else { format!("\n    {section}") };
    }

    // Besides the text there are a bar with blanks around it, and a mark at each cut.
    let width = terminal.columns.saturating_sub(gutter + 3 + 2);
    let Excerpt { text, mark } =
        Excerpt::new(file.parse().document.as_bytes(), diagnostic.span, width);
    let marked = AnnotationKind::Primary.span(mark);
    let snippet = Snippet::source(text).line_start(line).annotation(marked);
    let renderer = if terminal.colors { Renderer::styled() } else { Renderer::plain() };
    let renderer = renderer.term_width(terminal.columns);
    let shown = renderer.render(&[Group::with_level(level).element(snippet)]);
    // The first line has nothing but the bar.
    let (_, shown) = shown.split_once('\n').unwrap_or(("", &shown));
    format!("{title}\n{:gutter$}{frame}-->{frame:#} {place}\n{shown}", "")
}

/// How much was found.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    errors: usize,
    warnings: usize,
    notes: usize,
    unreadable: usize,
}

impl Tally {
    fn add(&mut self, file: &DraftFile) {
        self.errors += file.count(Severity::Error);
        self.warnings += file.count(Severity::Warning);
        self.notes += file.count(Severity::Note);
    }

    fn outcome(self, strict: bool) -> Outcome {
        if self.errors + self.unreadable > 0 {
            Outcome::Faulty
        } else if strict && self.warnings > 0 {
            Outcome::BelowThreshold
        } else {
            Outcome::Done
        }
    }

    /// As in `1 error, 2 warnings`.
    fn summary(self) -> String {
        let counts = [
            (self.unreadable, "unreadable", "unreadable"),
            (self.errors, "error", "errors"),
            (self.warnings, "warning", "warnings"),
            (self.notes, "note", "notes"),
        ];
        let told: Vec<_> = counts
            .into_iter()
            .filter(|&(count, ..)| count > 0)
            .map(|(count, one, many)| format!("{count} {}", if count == 1 { one } else { many }))
            .collect();
        if told.is_empty() { "nothing found".to_owned() } else { told.join(", ") }
    }
}
