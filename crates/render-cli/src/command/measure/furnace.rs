//! `selvedge measure furnace`: how much of the light from all around is reflected or let through.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use selvedge_yarn_brdf::Cloth;

use super::{
    Findings, Subject,
    albedo::{Estimate, Points, REPLICATES, Tier},
    surface::Surface,
    tell_progress, whitened,
};
use crate::{
    args::{Angles, MeasureOptions},
    report::{Axis, Check, Limit, Plot, Report, Series, Table},
};

/// Angles from the normal, and azimuths from the weft, in degrees.
const THETAS: [f64; 10] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 78.0, 84.0, 88.0, 89.5];
const PHIS: [(f64, &str); 3] =
    [(0.0, "along the weft"), (45.0, "between"), (90.0, "along the warp")];

/// Points of each sum over a cloth in batches; the other tiers get a part of it, as they take longer.
const POINTS: u64 = 1 << 16;

/// What the sums themselves may be off by, beside their noise.
const TOLERANCE: f64 = 2e-3;

/// Standard errors that are granted to each sum: there are thousands of them, of 16 replicates each.
const GRANTED: f64 = 6.0;

/// The furnace of all `subjects`.
pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "White furnace",
        "Light of 1 comes from everywhere. No cloth, no yarn and no kind of segment may reflect more of \
         it than it receives; what falls into a gap or through a yarn that is not opaque goes on and \
         counts as well. White is the same cloth with yarns of 1 and colourless highlights: whatever it \
         does not send back is missing.",
    );
    let columns =
        ["cloth", "yarns", "tier", "part", "least", "greatest", "±", "at θ, °", "at φ, °"];
    let mut summary = Table::new("furnace", columns);
    let mut parts = Table::new("parts", columns);
    for subject in subjects {
        tell_progress(options, subject);
        report.heading(&subject.input);
        let white = whitened(&subject.cloth);
        let surface = subject.prepare(options, &white)?;
        let cloths = [("white", &white, &*surface), ("own", &subject.cloth, &*subject.surface)];
        for (yarns, cloth, surface) in cloths {
            let mut plots = Vec::new();
            let whole = Plot::new(
                &format!("{}-{yarns}", subject.name),
                &format!("{}, {yarns} yarns: the whole cloth", subject.input),
                Axis::new("θ of the viewer, °").from_to(0.0, 90.0),
                Axis::new("reflected or let through"),
            );
            let mut whole = whole;
            for tier in Tier::ALL {
                let furnace = Furnace::new(options, cloth, surface, tier);
                for (index, part) in furnace.parts.iter().enumerate() {
                    let [least, greatest] = furnace.extremes(index);
                    let Angles { theta_deg, phi_deg } = greatest.wo;
                    let row = [subject.input.as_str(), yarns, tier.name(), part].map(Into::into);
                    let numbers = [least.value, greatest.value, greatest.error, theta_deg, phi_deg];
                    let row = row.into_iter().chain(numbers.map(Into::into));
                    if index == 0 { &mut summary } else { &mut parts }.row(row);
                }
                let excess = furnace.excess();
                let what = format!(
                    "{}, {yarns} yarns, {}: greatest share, less {GRANTED} standard errors",
                    subject.input,
                    tier.name()
                );
                report.check(Check::new(what, excess, Limit::AtMost(1.0 + TOLERANCE)));
                for (phi, words) in [PHIS[0], PHIS[2]] {
                    if tier != Tier::Single {
                        whole = whole.with(furnace.series(
                            0,
                            phi,
                            &format!("{}, {words}", tier.name()),
                        ));
                    }
                }
                if tier == Tier::Batch {
                    plots.push(furnace.plot_of_parts(subject, yarns));
                }
            }
            plots.insert(0, whole);
            report.plots(plots);
        }
    }
    report.heading("The whole cloth");
    report.table(summary.clone());
    report.heading("By type of yarn and kind of segment");
    report.paragraph(
        "Segments are told apart by their yarn, whether it is warp or weft, and over how many crossings \
         they float; 0 stands for what is seen in slits.",
    );
    report.table(parts);
    Ok(Findings { report, summary })
}

/// What was found for one direction.
#[derive(Clone, Copy, Debug)]
struct Share {
    wo: Angles,
    /// The greatest component of the albedo, and what is let through.
    value: f64,
    error: f64,
}

/// The shares of all directions, for each part of a cloth.
struct Furnace {
    /// The whole cloth, its types of yarn, and its kinds of segment.
    parts: Vec<String>,
    /// By direction and part.
    shares: Vec<Vec<Share>>,
    /// How many of the parts are the cloth or types of yarn.
    yarns: usize,
}

/// Points, and which parts of the cloth each belongs to.
struct Replicate {
    points: Points,
    parts: Vec<[Option<usize>; 3]>,
    opacity: Vec<f64>,
}

impl Furnace {
    fn new(options: &MeasureOptions, cloth: &Cloth, surface: &dyn Surface, tier: Tier) -> Self {
        let count = options.count(match tier {
            Tier::Batch => POINTS,
            Tier::Single | Tier::Far => POINTS / 8,
        });
        let count = count.div_ceil(REPLICATES as u64).max(64);
        let numbers = 0..REPLICATES;
        let points = numbers.map(|replicate| Points::new(cloth, options.seed, replicate, count));
        let points: Vec<Points> = points.collect();
        let (mut parts, kinds) = if tier == Tier::Far {
            (vec!["cloth".to_owned()], BTreeMap::new())
        } else {
            kinds(cloth, surface, &points)
        };
        let yarns = 1 + if tier == Tier::Far { 0 } else { cloth.yarns.len() };
        let replicates: Vec<Replicate> = points
            .into_par_iter()
            .map(|points| replicate(points, surface, tier, cloth, &kinds, yarns))
            .collect();
        let directions: Vec<Angles> = THETAS
            .iter()
            .flat_map(|&theta_deg| PHIS.map(|(phi_deg, _)| Angles { theta_deg, phi_deg }))
            .collect();
        let count = parts.len();
        let shares: Vec<Vec<Share>> = directions
            .into_par_iter()
            .map(|wo| shares(surface, tier, wo, &replicates, count))
            .collect();
        // What no point has hit cannot be told.
        let is_hit = |part: usize| shares.iter().all(|of| of[part].value.is_finite() || part == 0);
        let kept: Vec<usize> = (0..count).filter(|&part| is_hit(part)).collect();
        let shares =
            shares.into_iter().map(|of| kept.iter().map(|&part| of[part]).collect()).collect();
        parts = kept.iter().map(|&part| parts[part].clone()).collect();
        let yarns = kept.iter().filter(|&&part| part < yarns).count();
        Self { parts, shares, yarns }
    }

    /// The least and the greatest share of a part.
    fn extremes(&self, part: usize) -> [Share; 2] {
        let all = || self.shares.iter().map(|of| of[part]);
        let by_value = |a: &Share, b: &Share| a.value.total_cmp(&b.value);
        [all().min_by(by_value), all().max_by(by_value)]
            .map(|share| share.expect("directions are many"))
    }

    /// The greatest share of any part, less what noise may have added; NaN if one is.
    fn excess(&self) -> f64 {
        let all = self.shares.iter().flatten();
        let excesses = all.map(|share| share.value - GRANTED * share.error);
        excesses.max_by(f64::total_cmp).unwrap_or(f64::NAN)
    }

    /// The shares of a part over θ.
    fn series(&self, part: usize, phi_deg: f64, name: &str) -> Series {
        let shares = self.shares.iter().map(|of| of[part]).filter(|of| of.wo.phi_deg == phi_deg);
        let shares: Vec<Share> = shares.collect();
        let intervals = shares.iter().map(|s| [s.value - 2.0 * s.error, s.value + 2.0 * s.error]);
        let points = shares.iter().map(|share| [share.wo.theta_deg, share.value]);
        Series::line(name, points.collect()).with_intervals(intervals.collect())
    }

    /// The shares of the first types of yarn.
    fn plot_of_parts(&self, subject: &Subject, yarns: &str) -> Plot {
        const MOST: usize = 6;
        let plot = Plot::new(
            &format!("{}-{yarns}-yarns", subject.name),
            &format!("{}, {yarns} yarns: types of yarn, seen along the weft", subject.input),
            Axis::new("θ of the viewer, °").from_to(0.0, 90.0),
            Axis::new("reflected or let through"),
        );
        let parts = 1..self.yarns.min(1 + MOST);
        parts.fold(plot, |plot, part| plot.with(self.series(part, 0.0, &self.parts[part])))
    }
}

/// A type of yarn, whether it is the warp, and over how many crossings it floats.
type Kind = (u16, bool, u32);

/// Names of the cloth, its yarns and its kinds of segment, and the numbers of these.
fn kinds(
    cloth: &Cloth,
    surface: &dyn Surface,
    points: &[Points],
) -> (Vec<String>, BTreeMap<Kind, usize>) {
    let found: BTreeMap<Kind, usize> = points
        .par_iter()
        .flat_map_iter(|points| (0..points.len()).filter_map(|k| kind(surface, points, k)))
        .fold(BTreeMap::new, |mut all, kind| {
            *all.entry(kind).or_insert(0) += 1;
            all
        })
        .reduce(BTreeMap::new, |mut a, b| {
            b.into_iter().for_each(|(kind, count)| *a.entry(kind).or_insert(0) += count);
            a
        });
    let mut names = vec!["cloth".to_owned()];
    names.extend((0..cloth.yarns.len()).map(|yarn| format!("yarn {yarn}")));
    // Of those that are seldom seen, no sum is worth its name.
    let all: usize = found.values().sum();
    let common = found.into_iter().filter(|(_, count)| 500 * count > all);
    let numbered = common.map(|(kind, _)| {
        let (yarn, is_warp, crossings) = kind;
        let way = if is_warp { "warp" } else { "weft" };
        names.push(format!("yarn {yarn}, {way} over {crossings}"));
        (kind, names.len() - 1)
    });
    let numbered = numbered.collect();
    (names, numbered)
}

fn kind(surface: &dyn Surface, points: &Points, k: usize) -> Option<Kind> {
    let found = surface.shader().yarn_at(points.place(k))?;
    let crossings = if found.segment.is_straight() { 0 } else { found.segment.crossings };
    Some((found.yarn, found.segment.is_warp, crossings))
}

fn replicate(
    points: Points,
    surface: &dyn Surface,
    tier: Tier,
    cloth: &Cloth,
    kinds: &BTreeMap<Kind, usize>,
    yarns: usize,
) -> Replicate {
    let shader = surface.shader();
    if tier == Tier::Far {
        let opacity = f64::from(shader.far_opacity(&super::albedo::footprint(cloth)));
        let parts = vec![[Some(0), None, None]; points.len()];
        return Replicate { opacity: vec![opacity; points.len()], parts, points };
    }
    let parts = (0..points.len()).map(|k| {
        let kind = kind(surface, &points, k);
        let yarn = kind.map(|kind| 1 + usize::from(kind.0)).filter(|&part| part < yarns);
        [Some(0), yarn, kind.and_then(|kind| kinds.get(&kind).copied())]
    });
    let parts = parts.collect();
    let opacity = (0..points.len()).map(|k| f64::from(shader.opacity(points.place(k)))).collect();
    Replicate { points, parts, opacity }
}

/// The share of each of so many parts.
fn shares(
    surface: &dyn Surface,
    tier: Tier,
    wo: Angles,
    replicates: &[Replicate],
    count: usize,
) -> Vec<Share> {
    let mut means = vec![Vec::new(); count];
    for Replicate { points, parts, opacity } in replicates {
        let mut sums = vec![(DVec3::ZERO, 0u32); count];
        let weights = points.reflected(surface, tier, wo.single());
        for ((weight, parts), opacity) in weights.iter().zip(parts).zip(opacity) {
            for &part in parts.iter().flatten() {
                sums[part].0 += weight.as_dvec3() + (1.0 - opacity);
                sums[part].1 += 1;
            }
        }
        for (means, (sum, count)) in means.iter_mut().zip(sums) {
            if count > 0 {
                means.push(sum / f64::from(count));
            }
        }
    }
    let share = |means: &Vec<DVec3>| {
        let Estimate { mean, error } = Estimate::of(means);
        // Too few say nothing of their error.
        let is_known = means.len() > REPLICATES / 2;
        let value = if is_known { mean.max_element() } else { f64::NAN };
        Share { wo, value, error: error.max_element() }
    };
    means.iter().map(share).collect()
}
