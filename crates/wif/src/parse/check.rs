//! What only the whole file shows: contents that do not match, colours that are missing,
//! lengths that cannot be, plans that disagree.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::field;
use super::line::Line;
use super::name::{Name, folded};
use super::reader::{Reader, header_span, side_name};
use super::rows::{Rows, entry};
use crate::color::Palette;
use crate::diagnostic::{Code, quote};
use crate::document::Section;
use crate::draft::{Draft, Side, ThreadSet, Units};
use crate::span::Span;

/// Checks that `[WIF]` and `[CONTENTS]` are there, and the latter against the sections.
pub(super) fn contents(reader: &mut Reader<'_, '_>) {
    for name in [Name::Wif, Name::Contents] {
        if reader.of(name).is_empty() {
            reader.report.leave();
            reader.report.add(Code::MissingSection, Span::FILE, || {
                format!("no [{}], expected one", name.as_str())
            });
        }
    }
    let Some(&first) = reader.of(Name::Contents).first() else { return };
    // What the last line about each section that is there says.
    let mut known: Vec<Option<bool>> = vec![None; Name::ALL.len()];
    let mut foreign: BTreeMap<Vec<u8>, Option<bool>> = BTreeMap::new();
    for section in reader.foreign() {
        foreign.insert(folded(section.raw_name().unwrap_or_default()), None);
    }

    reader.report.enter(Name::Contents.as_str());
    for section in reader.of(Name::Contents).to_vec() {
        for (raw, line) in section.raw_lines() {
            let Some((name, value)) = entry(reader.report, raw.at, raw.bytes, line) else {
                continue;
            };
            let is_there = match Name::of(name.bytes) {
                Some(name) => !reader.of(name).is_empty(),
                None => foreign.contains_key(&folded(name.bytes)),
            };
            // An absent boolean is false, by the format.
            let is_listed = !value.without_comment().bytes.is_empty()
                && field::boolean(reader.report, value, true);
            if is_listed && !is_there {
                reader.report.add(Code::ContentsListsAbsent, name.span(), || {
                    format!("{} is listed, but there is no such section", quote(name.bytes))
                });
            }
            let listed = match Name::of(name.bytes) {
                Some(name) => known.get_mut(name as usize),
                None => foreign.get_mut(&folded(name.bytes)),
            };
            if let Some(listed) = listed {
                if listed.is_some() {
                    reader.report.add(Code::DuplicateKey, name.span(), || {
                        format!("{} is listed again, expected once", quote(name.bytes))
                    });
                }
                *listed = Some(is_listed);
            }
        }
    }

    let mut omitted: Vec<Cow<'_, str>> = Vec::new();
    for (&name, _) in Name::ALL.iter().zip(&known).filter(|(_, listed)| **listed != Some(true)) {
        if !matches!(name, Name::Wif | Name::Contents) && reader.of(name).iter().any(has_lines) {
            omitted.push(name.as_str().into());
        }
    }
    let unlisted = reader.foreign().iter().filter(|section| {
        let name = section.raw_name().unwrap_or_default();
        foreign.get(&folded(name)) != Some(&Some(true)) && has_lines(section)
    });
    omitted.extend(unlisted.filter_map(Section::name));
    for name in omitted {
        reader.report.add(Code::ContentsOmits, header_span(&first), || {
            format!("{} is not listed, but there is such a section", quote(name.as_bytes()))
        });
    }
}

fn has_lines(section: &Section<'_>) -> bool {
    section.raw_lines().any(|(_, line)| !matches!(line, Line::Blank | Line::Comment(_)))
}

/// Checks that the colours of a side are in the table.
pub(super) fn colors(
    reader: &mut Reader<'_, '_>,
    side: Side,
    set: &ThreadSet,
    rows: &Rows<u32>,
    palette: &Palette,
) {
    if palette.colors.is_empty() {
        return;
    }
    let is_missing = |number: u32| {
        let inline =
            set.has_inline_color() && set.color.is_some_and(|color| color.number == number);
        number > 0 && palette.colors.get(number).is_none() && !inline
    };
    let (name, what) = match side {
        Side::Warp => (Name::WarpColors, "end"),
        Side::Weft => (Name::WeftColors, "pick"),
    };
    reader.report.enter(name.as_str());
    for row in &rows.rows {
        if let Some(number) = row.value.filter(|&number| is_missing(number)) {
            reader.report.add(Code::ColorOutside, row.span(reader.document), || {
                format!(
                    "{what} {} has color {number}, expected one of the table; default assumed",
                    row.key
                )
            });
        }
    }
    let is_used = rows.rows.len() < set.count as usize;
    if let Some(color) = set.color.filter(|color| is_used && is_missing(color.number)) {
        let header = reader.enter(side_name(side));
        reader.report.add(Code::ColorOutside, header, || {
            format!("Color is {}, expected one of the table; default assumed", color.number)
        });
    }
}

/// Spacing and thickness in centimetres that archives of drafts write for lack of any.
const DUMMY: (f64, f64) = (0.0185, 0.0213);

/// Checks that lengths have a unit and are plausible.
pub(super) fn lengths(reader: &mut Reader<'_, '_>, side: Side, set: &ThreadSet, has_units: bool) {
    let header = reader.enter(side_name(side));
    let has_lengths = set.spacing.is_some()
        || set.thickness.is_some()
        || !set.spacings.is_empty()
        || !set.thicknesses.is_empty();
    if has_lengths && !has_units {
        reader
            .report
            .add(Code::UnitsAssumed, header, || "Units is not given; read as centimeters".into());
    }
    let is_dummy = (set.spacing == Some(DUMMY.0), set.thickness == Some(DUMMY.1));
    if set.units == Units::Centimeters && is_dummy != (false, false) {
        reader.report.add(Code::DummySpacing, header, || {
            let (spacing, thickness) = DUMMY;
            match is_dummy {
                (true, false) => format!("spacing {spacing} is what archives write unknowing"),
                (false, _) => format!("thickness {thickness} is what archives write unknowing"),
                (true, true) => format!(
                    "spacing {spacing} and thickness {thickness} are what archives write unknowing"
                ),
            }
        });
        if is_dummy == (true, true) {
            return;
        }
    }
    let given = |length: &f64| *length > 0.0;
    let touches = |index: Option<u32>| {
        let length = |own: &crate::sparse::Sparse<f64>, all: Option<f64>| {
            let own = index.and_then(|index| own.get(index).copied()).filter(given);
            own.or(all.filter(given))
        };
        let spacing = length(&set.spacings, set.spacing)?;
        let thickness = length(&set.thicknesses, set.thickness)?;
        (thickness > spacing).then_some((index, thickness, spacing))
    };
    let indices = set.spacings.iter().chain(set.thicknesses.iter()).map(|(index, _)| Some(index));
    if let Some((index, thickness, spacing)) = [None].into_iter().chain(indices).find_map(touches) {
        reader.report.add(Code::ThickYarn, header, || {
            let what = index
                .map_or("the yarn".into(), |index| format!("yarn {}", index.saturating_add(1)));
            format!("{what} is {thickness} thick, expected at most its spacing {spacing}")
        });
    }
}

/// Checks the draft as a whole: what it lacks for a drawdown, and plans that disagree.
pub(super) fn draft(reader: &mut Reader<'_, '_>, draft: &Draft) {
    reader.report.leave();
    if !draft.has_colors() {
        reader.report.add(Code::ColorsAssumed, Span::FILE, || {
            "no colors; a dark warp and a light weft are assumed".into()
        });
    }
    let missing = if draft.threading.is_empty() {
        "no threading, expected the shafts of each end for a drawdown"
    } else if draft.plan().is_none() {
        "no plan, expected a lift plan or a tie-up with a treadling for a drawdown"
    } else {
        return plans(reader, draft);
    };
    reader.report.add(Code::NoWeave, Span::FILE, || missing.into());
}

/// Reports the first pick for which the lift plan and the treadling differ, if both are there.
fn plans(reader: &mut Reader<'_, '_>, draft: &Draft) {
    if draft.liftplan.is_empty() || draft.tieup.is_empty() || draft.treadling.is_empty() {
        return;
    }
    let mut picks: Vec<u32> =
        draft.liftplan.iter().chain(draft.treadling.iter()).map(|(pick, _)| pick).collect();
    picks.sort_unstable();
    picks.dedup();
    // Picks that press many treadles with many shafts could take longer than reading the file.
    let mut budget = reader.document.as_bytes().len().saturating_mul(8);
    for pick in picks {
        let as_set = |mut shafts: Vec<u32>| {
            shafts.sort_unstable();
            shafts.dedup();
            shafts
        };
        let lifted = as_set(draft.liftplan.get(pick).to_vec());
        let pressed = as_set(draft.treadling.get(pick).to_vec());
        let tied: usize = pressed.iter().map(|&treadle| draft.tieup.get(treadle).len()).sum();
        match budget.checked_sub(tied) {
            Some(rest) => budget = rest,
            None => return,
        }
        let tied =
            as_set(pressed.iter().flat_map(|&treadle| draft.tieup.get(treadle)).copied().collect());
        if tied != lifted {
            let header = reader.enter(Name::Liftplan);
            reader.report.add(Code::PlansDiffer, header, || {
                let pick = pick.saturating_add(1);
                format!("differs from the treadling, first at pick {pick}; the lift plan weaves")
            });
            return;
        }
    }
}
