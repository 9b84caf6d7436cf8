//! `selvedge measure reciprocity`: whether swapping light and viewer changes anything.

use rayon::prelude::*;
use selvedge_yarn_brdf::Footprint;

use super::{
    Findings, Subject,
    histogram::Differences,
    random::Random,
    tell_progress,
    tuple::{Tuple, Tuples},
};
use crate::{
    args::MeasureOptions,
    report::{Axis, Check, Limit, Plot, Report, Table},
};

/// Pairs of directions for each cloth, and for each piece of work.
const PAIRS: u64 = 1 << 19;
const BLOCK: u64 = 4096;

/// Ways to evaluate, and the greatest relative difference of each: rounding, amplified where a highlight is
/// steep.
const TIERS: [(&str, f64); 4] = [
    ("reference, f64", 1e-12),
    ("single point, f32", 1e-5),
    ("batch, f32", 1e-5),
    ("far, f32", 1e-4),
];

type All = [Differences<Tuple>; TIERS.len()];

/// The reciprocity of all `subjects`.
pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "Reciprocity",
        "A BRDF is the same when light and viewer change places: f(wi, wo) = f(wo, wi). Here both are \
         evaluated for random places and pairs of directions, and their difference is told as a share of \
         the greater.",
    );
    let columns = ["cloth", "tier", "pairs", "median", "99.9 %", "greatest"];
    let mut summary = Table::new("reciprocity", columns);
    let mut worst =
        Table::new("worst", ["cloth", "tier", "difference", "see it with selvedge eval CLOTH"]);
    let mut plots = Vec::new();
    for subject in subjects {
        tell_progress(options, subject);
        let blocks = (0..options.count(PAIRS / BLOCK)).into_par_iter();
        let all = blocks.map(|block| of_block(subject, &mut Random::new(options.seed, block)));
        let all = all.reduce(All::default, merged);
        let title = format!("{}: how many pairs differ by how much", subject.input);
        let axes = (Axis::new("relative difference").log(), Axis::new("share of pairs").log());
        let mut plot = Plot::new(&format!("{}-differences", subject.name), &title, axes.0, axes.1);
        for (found, (tier, most)) in all.iter().zip(TIERS) {
            summary.row([
                subject.input.as_str().into(),
                tier.into(),
                found.count.into(),
                found.quantile(0.5).into(),
                found.quantile(0.999).into(),
                found.greatest().into(),
            ]);
            if let Some((difference, tuple)) = &found.worst {
                let cells = [subject.input.as_str().into(), tier.into(), (*difference).into()];
                worst.row(cells.into_iter().chain([tuple.to_string().into()]));
            }
            let what = format!("{}: {tier}, greatest relative difference", subject.input);
            report.check(Check::new(what, found.greatest(), Limit::AtMost(most)));
            plot = plot.with(found.series(tier));
        }
        plots.push(plot);
    }
    report.table(summary.clone());
    report.plots(plots);
    report.heading("The greatest differences");
    report.table(worst);
    Ok(Findings { report, summary })
}

fn of_block(subject: &Subject, random: &mut Random) -> All {
    let Subject { surface, cloth, .. } = subject;
    let tuples: Vec<Tuple> = (0..BLOCK).map(|_| Tuple::random(random, cloth)).collect();
    let swapped: Vec<Tuple> = tuples.iter().map(|tuple| tuple.swapped()).collect();
    let batches = [&tuples, &swapped].map(|all| Tuples::new(all).eval(surface.as_ref()));
    let footprint = Footprint { uv: 0.5 * cloth.size(), deviation: 100.0 * cloth.size() };
    let mut all = All::default();
    for (k, (there, back)) in tuples.iter().zip(&swapped).enumerate() {
        let values = [there, back].map(|Tuple { uv, wi, wo }| {
            let (i, o) = (wi.single(), wo.single());
            [
                surface.reference(*uv, wi.direction(), wo.direction()),
                surface.eval(*uv, i, o).as_dvec3(),
                glam::DVec3::ZERO,
                surface.far_eval(&footprint, i, o).as_dvec3(),
            ]
        });
        for (tier, found) in all.iter_mut().enumerate() {
            let [f, g] = match tier {
                2 => [batches[0][k].as_dvec3(), batches[1][k].as_dvec3()],
                _ => [values[0][tier], values[1][tier]],
            };
            let scale = f.max_element().max(g.max_element()).max(1e-30);
            found.add((f - g).abs().max_element() / scale, *there);
        }
    }
    all
}

fn merged(a: All, b: All) -> All {
    let mut others = b.into_iter();
    a.map(|own| own.merged(others.next().expect("both have as many")))
}
