//! `selvedge measure chi2`: whether directions are drawn with the density that is told of them.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use selvedge_yarn_brdf::{Combination, Diffuse};

use super::{
    Findings, Subject,
    albedo::{Tier, footprint},
    map,
    random::Random,
    surface, tell_progress,
    three_way::ThreeWay,
    whitened,
};
use crate::{
    args::{Angles, MeasureOptions},
    chi_square::{self, CELLS, Cap, DRAWS, Fit},
    report::{Axis, Check, Figure, Limit, Plot, Report, Series, Table},
};

/// Places and directions for each cloth, and for its far field, whose density takes longer.
const CASES: u64 = 20;
const FAR_CASES: u64 = 10;

/// How seldom chance alone may make the whole report miss.
const LEVEL: f64 = 1e-3;

/// Pixels on a side, and points for each pixel, of the pictures of near and of far.
const NEAR: (u32, u64) = (96, 2048);
const FAR: (u32, u64) = (48, 1024);

/// What white may miss where the highlight and the diffuse share the light exactly: the table that tells how
/// much the highlight reflects is an upper bound.
const MISSING: f64 = 0.03;
/// And what it may have too much: the error of the sums.
const BEYOND: f64 = 3e-3;

/// A place and a direction to the viewer.
#[derive(Clone, Copy, Debug)]
struct Case {
    tier: Tier,
    uv: DVec2,
    wo: Angles,
}

/// The samplers of all `subjects`.
pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "Samplers against their densities",
        "Of 100 000 directions drawn for one place and one viewer, as many should fall into each of 256 \
         cells of the hemisphere as the integral of the density over the cell tells. Pearson's χ² says \
         how likely counts as far from that are; over many cases, such chances are spread evenly from 0 \
         to 1. And the picture of a white cloth in a white furnace must be white in whichever way it is \
         summed.",
    );
    let columns =
        ["cloth", "tier", "cases", "least chance", "greatest |∫pdf − share drawn|", "± σ"];
    let mut summary = Table::new("samplers", columns);
    let columns =
        ["cloth", "tier", "u, m", "v, m", "θ, °", "φ, °", "chance", "∫ pdf", "±", "share drawn"];
    let mut all = Table::new("cases", columns);
    let cases = |tier| options.count(if tier == Tier::Far { FAR_CASES } else { CASES });
    let tests = Tier::ALL.map(cases).iter().sum::<u64>() as f64 * subjects.len() as f64;
    // Šidák: as unlikely as the level over all tests together.
    let least = 1.0 - (1.0 - LEVEL).powf(1.0 / tests);
    for subject in subjects {
        tell_progress(options, subject);
        report.heading(&subject.input);
        let mut plot = Plot::new(
            &format!("{}-chances", subject.name),
            &format!("{}: chances in order, expected along the diagonal", subject.input),
            Axis::new("share of cases").from_to(0.0, 1.0),
            Axis::new("chance").from_to(0.0, 1.0),
        )
        .with(Series::line("expected", vec![[0.0, 0.0], [1.0, 1.0]]));
        let mut figures = Vec::new();
        for tier in Tier::ALL {
            let fits: Vec<(Case, Fit)> = (0..cases(tier))
                .into_par_iter()
                .map(|index| {
                    let case = case(options, subject, tier, index);
                    (case, fit(options, subject, &case, index))
                })
                .collect();
            for (case, fit) in &fits {
                let Case { uv, wo, .. } = case;
                let numbers = [uv.x, uv.y, wo.theta_deg, wo.phi_deg, fit.p_value, fit.integral];
                let numbers = numbers.into_iter().chain([fit.error, fit.share]).map(Into::into);
                let row = [subject.input.as_str(), tier.name()].map(Into::into);
                all.row(row.into_iter().chain(numbers));
            }
            let mut chances: Vec<f64> = fits.iter().map(|(_, fit)| fit.p_value).collect();
            chances.sort_by(f64::total_cmp);
            let found = chances[0];
            let what = format!("{}, {}: least chance", subject.input, tier.name());
            report.check(Check::new(what, found, Limit::AtLeast(least)));
            let off = fits.iter().map(|(_, fit)| {
                let chance = fit.share * (1.0 - fit.share) / DRAWS as f64;
                let deviation = (chance + fit.error * fit.error).sqrt();
                ((fit.integral - fit.share).abs(), deviation)
            });
            let (off, deviation) = off.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
            let row = [subject.input.as_str().into(), tier.name().into(), cases(tier).into()];
            let numbers = [found, off, deviation].map(Into::into);
            summary.row(row.into_iter().chain(numbers));
            let count = chances.len() as f64;
            let points = chances.iter().enumerate().map(|(k, p)| [(k as f64 + 0.5) / count, *p]);
            plot = plot.with(Series::line(tier.name(), points.collect()).with_marks());
            if let Some((case, fit)) = fits.first().filter(|_| tier != Tier::Single) {
                figures.extend(cells(subject, case, fit)?);
            }
        }
        report.plot(plot);
        report.pictures(figures);
        three_ways(options, subject, &mut report)?;
    }
    report.heading("All tests");
    report.table(summary.clone());
    report.table(all);
    Ok(Findings { report, summary })
}

/// Both sides, mostly the face, from upright to grazing, where there is yarn.
fn case(options: &MeasureOptions, subject: &Subject, tier: Tier, index: u64) -> Case {
    let mut random = Random::new(options.seed, 3 * index + tier as u64);
    let mut uv = random.place(&subject.cloth, 4.0);
    for _ in 0..1000 {
        if subject.surface.shader().yarn_at(uv).is_some() {
            break;
        }
        uv = random.place(&subject.cloth, 4.0);
    }
    let mut wo = random.direction();
    if index % 6 == 5 {
        wo.theta_deg = random.between(85.0, 89.5);
    }
    // The far field has the same of both, and gaps show the other side of both.
    if index % 8 == 7 {
        wo.theta_deg = 180.0 - wo.theta_deg;
    }
    Case { tier, uv, wo }
}

fn fit(options: &MeasureOptions, subject: &Subject, case: &Case, index: u64) -> Fit {
    let &Case { tier, uv, wo } = case;
    let surface = &*subject.surface;
    let footprint = footprint(&subject.cloth);
    let wo = wo.single();
    let cap = Cap::hemisphere(DVec3::Z * f64::from(wo.z.signum()));
    let mut random =
        chi_square::Random(options.seed ^ (index << 8 | tier as u64).wrapping_mul(0x9e37_79b9));
    let mut drawn = if tier == Tier::Batch {
        let mut own = Random::new(options.seed ^ 0x5eed, index);
        let mut xi = [(); 3].map(|()| Vec::with_capacity(DRAWS));
        for _ in 0..DRAWS {
            xi.iter_mut().zip(own.xi()).for_each(|(part, number)| part.push(number));
        }
        let place = uv.to_array().map(|part| vec![part; DRAWS]);
        let (place, xi) = (place.each_ref().map(Vec::as_slice), xi.each_ref().map(Vec::as_slice));
        surface::samples(surface, place, wo, xi)
    } else {
        vec![]
    }
    .into_iter();
    let draw = |random: &mut chi_square::Random| {
        let mut xi = || [random.number(), random.number(), random.number()];
        match tier {
            Tier::Single => surface.sample(uv, wo, xi()).map(|sample| sample.wi),
            Tier::Far => surface.far_sample(&footprint, wo, xi()).map(|sample| sample.wi),
            Tier::Batch => drawn.next().flatten().map(|sample| sample.wi),
        }
    };
    cap.fit(&mut random, draw, |all| match tier {
        Tier::Single => all.iter().map(|wi| surface.pdf(uv, *wi, wo)).collect(),
        Tier::Far => all.iter().map(|wi| surface.far_pdf(&footprint, *wi, wo)).collect(),
        Tier::Batch => {
            let place = uv.to_array().map(|part| vec![part; all.len()]);
            surface::densities(surface, place.each_ref().map(Vec::as_slice), all, wo)
        }
    })
}

/// The shares of draws in the cells, as found and as expected.
fn cells(subject: &Subject, case: &Case, fit: &Fit) -> anyhow::Result<[Figure; 2]> {
    let greatest = fit.cells.iter().flatten().copied().fold(f64::MIN_POSITIVE, f64::max);
    let Case { tier, wo, .. } = case;
    let figure = |which: usize, what: &str| {
        let picture =
            map::cells(CELLS, 12, |cell| map::heat((fit.cells[cell][which] / greatest).sqrt()));
        let short = ["single", "batch", "far"][*tier as usize];
        let name = format!("{}-{short}-{what}", subject.name);
        let caption =
            format!("{}, seen from {:.0}°: {what} in each cell", tier.name(), wo.theta_deg);
        Figure::new(&name, &caption, &picture)
    };
    Ok([figure(0, "drawn")?, figure(1, "expected")?])
}

/// The picture of the white furnace, and what is held against it.
fn three_ways(
    options: &MeasureOptions,
    subject: &Subject,
    report: &mut Report,
) -> anyhow::Result<()> {
    let mut white = whitened(&subject.cloth);
    white.yarns.iter_mut().for_each(|yarn| yarn.diffuse = Diffuse::Flat);
    let surface = subject.prepare(options, &white)?;
    let mut figures = Vec::new();
    for (tier, (side, count), short) in [(Tier::Batch, NEAR, "near"), (Tier::Far, FAR, "far")] {
        let found =
            ThreeWay::new(options, &white, &*surface, tier, (side, options.count(count).max(16)));
        let mean = found.mean();
        let of = format!("{}, white, {}", subject.input, tier.name());
        let what = format!("{of}: red, green and blue apart, beyond their noise");
        report.check(Check::new(what, found.apart(), Limit::AtMost(BEYOND)));
        let greatest = Limit::AtMost(1.0 + BEYOND);
        report.check(Check::new(format!("{of}: mean, greatest"), mean.max_element(), greatest));
        if white.combination == Combination::Layered {
            let least = Limit::AtLeast(1.0 - MISSING);
            report.check(Check::new(format!("{of}: mean, least"), mean.min_element(), least));
        }
        let rgb = format!("mean {:.4}, {:.4}, {:.4}", mean.x, mean.y, mean.z);
        let caption = format!("{}: {rgb}", tier.name());
        let name = format!("{}-three-ways-{short}", subject.name);
        figures.push(Figure::new(&name, &caption, &found.picture())?);
        let caption = "What differs from 1, ten times as strong, on grey";
        figures.push(Figure::new(&format!("{name}-off"), caption, &found.deviation())?);
    }
    report.paragraph(
        "White cloth of a diffuse that does not follow its yarns, in a white furnace, over all \
         directions of the viewer. Red: sampled. Green: sampled, \
         and both f and its density evaluated again. Blue: directions drawn from the cosine.",
    );
    report.pictures(figures);
    Ok(())
}
