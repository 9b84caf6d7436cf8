//! What a draft is, for people.

use super::{Cloth, Color, Finding, Float, Info, Range, Spacing};
use crate::terminal::{Terminal, printable};

/// `info` in lines of a name and what there is to say.
pub(super) fn text(info: &Info<'_>, terminal: Terminal) -> String {
    let mut rows: Vec<(&str, String)> = Vec::new();
    rows.extend(info.title.map(|title| ("title", title.to_owned())));
    rows.extend(info.author.map(|author| ("author", author.to_owned())));
    rows.extend(info.program.map(|program| {
        (
            "program",
            [Some(program), info.program_version]
                .into_iter()
                .flatten()
                .collect::<Vec<_>>()
                .join(" "),
        )
    }));
    rows.push(("size", size(info)));
    rows.push(("loom", loom(info)));
    rows.push(("warp", spacing(&info.warp)));
    rows.push(("weft", spacing(&info.weft)));
    match &info.cloth {
        Some(cloth) => rows.extend(cloth_rows(cloth)),
        None => rows.extend(info.no_drawdown.iter().map(|why| ("weave", format!("none; {why}")))),
    }
    let width = info.colors.iter().map(|color| number(color).len()).max().unwrap_or(0);
    rows.extend(named("colors", info.colors.iter().map(|color| color_row(color, width))));
    rows.push(("findings", findings(info)));
    rows.extend(named("", info.diagnostics.list.iter().map(finding)));

    let mut text = printable(info.file) + "\n";
    for (name, value) in rows {
        let line = format!("  {name:NAME_WIDTH$}{}", printable(&value));
        text += &terminal.wrap(&line, 2 + NAME_WIDTH + 2);
        text.push('\n');
    }
    text
}

const NAME_WIDTH: usize = 10;

/// The first of the rows under this name, the others under none.
fn named(
    name: &'static str,
    rows: impl Iterator<Item = String>,
) -> impl Iterator<Item = (&'static str, String)> {
    rows.enumerate().map(move |(at, row)| (if at == 0 { name } else { "" }, row))
}

fn size(info: &Info<'_>) -> String {
    let threads =
        format!("{}, {}", count(info.ends as usize, "end"), count(info.picks as usize, "pick"));
    match (info.width_mm, info.length_mm) {
        (Some(width), Some(length)) => {
            format!("{threads}; {} x {} mm", length_text(width), length_text(length))
        }
        _ => threads,
    }
}

fn loom(info: &Info<'_>) -> String {
    let shed = if info.rising_shed { "rising shed" } else { "sinking shed" };
    let plan = match info.plan {
        Some("tieup") => "tie-up and treadling",
        Some(_) => "lift plan",
        None => "no plan",
    };
    let shafts = count(info.shafts as usize, "shaft");
    let treadles = count(info.treadles as usize, "treadle");
    format!("{shafts}, {treadles}, {shed}, {plan}")
}

fn spacing(spacing: &Spacing) -> String {
    let told = [
        spacing.threads_per_cm.map(|threads| format!("{threads:.1} per cm")),
        spacing.threads_per_inch.map(|threads| format!("{threads:.1} per inch")),
        spacing.spacing_mm.as_ref().map(|range| format!("spacing {}", range_text(range))),
        spacing.thickness_mm.as_ref().map(|range| format!("thickness {}", range_text(range))),
    ];
    let told: Vec<_> = told.into_iter().flatten().collect();
    if told.is_empty() { "spacing not given".to_owned() } else { told.join(", ") }
}

fn range_text(range: &Range) -> String {
    let [min, mean, max] = [range.min, range.mean, range.max].map(length_text);
    if min == max { format!("{min} mm") } else { format!("{min} to {max}, mean {mean} mm") }
}

/// A length in mm to the micrometre.
fn length_text(mm: f64) -> String {
    let text = format!("{mm:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn cloth_rows(cloth: &Cloth) -> [(&'static str, String); 3] {
    let float = |float: &Float| format!("warp {}, weft {}", float.warp, float.weft);
    let (weave, all) = (&cloth.repeat, &cloth.repeat_with_threads);
    let mut repeat = format!("{}, {}", count(weave.ends, "end"), count(weave.picks, "pick"));
    if (weave.ends, weave.picks) != (all.ends, all.picks) {
        let all = format!("{}, {}", count(all.ends, "end"), count(all.picks, "pick"));
        repeat += &format!("; with colors and lengths {all}");
    }
    let floats = &cloth.longest_floats;
    [
        (
            "weave",
            format!("{}; warp on {:.1} % of the face", cloth.weave_name, cloth.balance * 1e2),
        ),
        ("repeat", repeat),
        ("floats", format!("face: {}; back: {}", float(&floats.face), float(&floats.back))),
    ]
}

fn number(color: &Color) -> String {
    color.number.map_or_else(|| "-".to_owned(), |number| number.to_string())
}

fn color_row(color: &Color, width: usize) -> String {
    let threads = format!("{}, {}", count(color.ends, "end"), count(color.picks, "pick"));
    format!("{:>width$}  {}  {threads}", number(color), color.srgb)
}

fn findings(info: &Info<'_>) -> String {
    let found = &info.diagnostics;
    let counts = [(found.errors, "error"), (found.warnings, "warning"), (found.notes, "note")];
    let told: Vec<_> = counts
        .into_iter()
        .filter(|&(found, _)| found > 0)
        .map(|(found, what)| count(found, what))
        .collect();
    if told.is_empty() { "none".to_owned() } else { told.join(", ") }
}

fn finding(finding: &Finding<'_>) -> String {
    let line = finding.line.map(|line| format!("line {line}"));
    let section = finding.section.map(|section| format!("[{section}]"));
    let place: Vec<_> = [line, section].into_iter().flatten().collect();
    let place = if place.is_empty() { "file".to_owned() } else { place.join(" ") };
    format!("{}: {place}: {} ({})", finding.severity, finding.message, finding.code)
}

/// A number of things, as in `1 end` and `2 ends`.
fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}
