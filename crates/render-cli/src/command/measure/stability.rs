//! `selvedge measure stability`: a cloth at the limits of its parameters, its directions and its scale.

mod examine;
mod variant;

use selvedge_yarn_brdf::Instructions;

use self::{
    examine::{Examination, FEW, FLIPS, MEDIAN},
    variant::{Group, variants},
};
use super::{Findings, Subject, tell_progress};
use crate::{
    args::MeasureOptions,
    report::{Axis, Check, Limit, Plot, Report, Table},
};

/// Tuples for each variant of a cloth.
const TUPLES: u64 = 1 << 15;

/// Least budget for all variants: each has to be prepared, which takes longer than so few tuples. With less,
/// only every so many are looked at.
const BUDGET_OF_ALL: f64 = 0.05;

/// The stability of all `subjects`.
pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "Stability",
        "Each cloth as it is, with each parameter of its yarns at either limit, at scales from 10⁻⁶ to \
         10⁶ and far from its origin; seen from anywhere, much of it grazing or near the mirror image. \
         No value may be infinite, negative or no number, no cloth may reflect more than it receives, \
         and f in f32, of single points and of batches with any instructions, is held against f64.",
    );
    let instructions: Vec<String> =
        Instructions::available().iter().map(|known| format!("{known:?}")).collect();
    let columns = [
        "cloth",
        "values",
        "not a number",
        "infinite",
        "negative",
        "too bright",
        "batch differs",
        "median error",
        "99.9 %",
        "flips",
    ];
    let mut summary = Table::new("stability", columns);
    let columns = [
        "cloth",
        "variant",
        "values",
        "faults",
        "too bright",
        "batch differs",
        "median error",
        "99.9 %",
        "greatest",
        "flips",
    ];
    let mut by_variant = Table::new("variants", columns);
    let mut worst = Table::new("worst", ["what", "value", "see it with selvedge eval"]);
    let every = (BUDGET_OF_ALL / options.budget).ceil() as usize;
    for subject in subjects {
        tell_progress(options, subject);
        report.heading(&subject.input);
        let mut plot = Plot::new(
            &format!("{}-errors", subject.name),
            &format!("{}: relative errors of f in f32 against f64", subject.input),
            Axis::new("relative error").log(),
            Axis::new("share of values").log(),
        );
        let mut groups: Vec<(Group, Examination)> = Vec::new();
        for (index, variant) in variants(&subject.cloth).into_iter().enumerate() {
            if index % every != 0 {
                continue;
            }
            let surface = subject.prepare(options, &variant.cloth)?;
            let count = options.count(TUPLES);
            let found = Examination::new(options, index as u64, &variant, surface, count);
            by_variant.row([
                subject.input.as_str().into(),
                variant.name.as_str().into(),
                found.values.into(),
                found.faults().into(),
                found.too_bright.into(),
                found.differing.into(),
                found.errors.quantile(0.5).into(),
                found.errors.quantile(0.999).into(),
                found.errors.greatest().into(),
                found.flips.into(),
            ]);
            for (what, value, tuple) in found.examples() {
                let set =
                    variant.setting.as_ref().map_or(String::new(), |set| format!(" --set {set}"));
                let replay = format!("{}{set} {tuple}", subject.input);
                worst.row([what.into(), value.into(), replay.into()]);
            }
            match groups.iter_mut().find(|(group, _)| *group == variant.group) {
                Some((_, all)) => all.merge(found),
                None => groups.push((variant.group, found)),
            }
        }
        let mut all = Examination::default();
        for (group, found) in groups {
            plot = plot.with(found.errors.series(group.name()));
            let values = found.errors.count.max(1) as f64;
            let of = format!("{}, {}", subject.input, group.name());
            let mut check = |what: &str, found: f64, most: f64| {
                report.check(Check::new(format!("{of}: {what}"), found, Limit::AtMost(most)));
            };
            check("values that are not finite or negative", found.faults() as f64, 0.0);
            check("directions that get more than there is", found.too_bright as f64, 0.0);
            check("batches of other bits than single points", found.differing as f64, 0.0);
            if group == Group::Own {
                check("median error", found.errors.quantile(0.5), MEDIAN);
                check("99.9 % of errors", found.errors.quantile(0.999), FEW);
                check("share of flips", found.flips as f64 / values, FLIPS);
            }
            all.merge(found);
        }
        summary.row([
            subject.input.as_str().into(),
            all.values.into(),
            all.not_a_number.into(),
            all.infinite.into(),
            all.negative.into(),
            all.too_bright.into(),
            all.differing.into(),
            all.errors.quantile(0.5).into(),
            all.errors.quantile(0.999).into(),
            all.flips.into(),
        ]);
        report.plot(plot);
    }
    report.heading("All values");
    report.table(summary.clone());
    report.paragraph(&format!(
        "Batches were evaluated with {}. A flip is a value whose highlight only one precision has: the \
         edge of a drawn highlight passes between them.",
        instructions.join(", ")
    ));
    report.heading("Variants");
    report.table(by_variant);
    report.heading("The worst inputs");
    report.paragraph(
        "Each line is to be put after `selvedge eval`, which tells every factor of the value.",
    );
    report.table(worst);
    Ok(Findings { report, summary })
}
