//! `selvedge measure filaments`.

use std::collections::BTreeSet;

use glam::{DVec3, Vec3};
use selvedge_yarn_brdf::{Highlight, Phase, Yarn};
use serde_json::json;

use super::{Findings, Subject, tell_progress};
use crate::{
    args::MeasureOptions,
    image::{Layer, Picture},
    measure::filaments::{
        Detail, Likeness, Setting, fibre::Fibre, patch::Patch, strand::Shape, trace::Interior,
    },
    render::film::Size,
    report::{Axis, Cell, Check, Figure, Limit, Plot, Report, Series, Table},
};

/// Twists and greatest inclinations that are tried, rad.
const PSI: [f64; 3] = [0.25, 0.5, 0.75];
const U_MAX: [f64; 3] = [0.3, 0.5, 0.7];

/// Length over width of the float, and others to see how that matters.
const ASPECT: f64 = 3.0;
const ASPECTS: [f64; 5] = [1.5, 2.0, 3.0, 6.0, 12.0];

/// Elevation of the light from the normal and its azimuth from across the yarn, in degrees.
const LIGHTS: [[f64; 2]; 5] =
    [[40.0, 45.0], [40.0, 0.0], [40.0, -45.0], [20.0, 90.0], [65.0, 180.0]];

/// Filaments around the yarn; the pairs must be alike from [`MANY`] on.
const COUNTS: [u32; 8] = [8, 16, 32, 64, 128, 256, 512, 1024];
const MANY: u32 = 64;

/// Silk to cotton.
const FIBRE: Fibre = Fibre { sigma: 0.1, alpha: 0.05, beta: 4.0 };

/// Half width of the drawn highlight, as in the paper's program.
const DELTA: f64 = 0.3;

/// Parts of the light that a filament takes, and filaments around the yarn, of which all rings are
/// traced.
const TAKEN: [f64; 4] = [0.6, 0.3, 0.15, 0.075];
const TRACED: u32 = 1024;
/// Mean free paths down to which they are.
const DEPTH: f64 = 5.0;

/// Greatest differences with which two streaks are alike, and how many of the pairs must be.
const ANGLE: f64 = 3.0;
const PROFILE: f64 = 0.1;
const ALIKE: f64 = 8.0;

pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let detail = Detail {
        across: 32,
        side: (3.0 * options.budget.sqrt()).round().clamp(1.0, 32.0) as usize,
        seed: options.seed,
    };
    let mut report = Report::new(
        "Yarn of filaments",
        "The streak of a yarn that is made of filaments, traced one by one, beside that of the shader's \
         piece of yarn; both are seen from above.",
    );
    report.paragraph(
        "The filaments are helices about a yarn that is bent, and know the shader's yarn only by its \
         parameters: ψ is their angle to the yarn at its crown, u_max the yarn's inclination at both \
         ends, and fibres have σ = 0.1 rad and a von Mises phase function. Both pictures are radiance \
         for an irradiance of 1; nothing is scaled to fit. The profile is the mean along the streak, \
         over the distance from it; its error is the root mean square over places where either is above \
         a twentieth of the peak, over the peak.",
    );
    let pairs = pairs(detail)?;
    let summary = nine_pairs(&mut report, &pairs);
    convergence(&mut report, &pairs);
    pictures(&mut report, detail)?;
    lights(&mut report, detail)?;
    outlier(&mut report, &pairs, detail)?;
    interior(&mut report, detail)?;
    yarns(&mut report, options, subjects, detail)?;
    Ok(Findings { report, summary })
}

fn to_light([theta, phi]: [f64; 2]) -> DVec3 {
    let (sin, cos) = theta.to_radians().sin_cos();
    let (y, x) = phi.to_radians().sin_cos();
    DVec3::new(sin * x, sin * y, cos)
}

fn setting([psi, u_max]: [f64; 2], aspect: f64, light: [f64; 2]) -> Setting {
    let shape = Shape { u_max, psi, aspect };
    Setting { shape, fibre: FIBRE, wi: to_light(light) }
}

fn both() -> impl Iterator<Item = [f64; 2]> {
    PSI.into_iter().flat_map(|psi| U_MAX.map(|u_max| [psi, u_max]))
}

/// ψ and u_max, and how alike filaments are to the rough highlight for each number of them, and how
/// alike the drawn highlight is to that.
struct Pair {
    at: [f64; 2],
    likeness: Vec<(u32, Likeness)>,
    drawn: Likeness,
}

impl Pair {
    /// The worst of what `of` tells from [`MANY`] filaments on.
    fn worst(&self, of: impl Fn(&Likeness) -> f64) -> f64 {
        let many = self.likeness.iter().filter(|(count, _)| *count >= MANY);
        many.map(|(_, likeness)| of(likeness)).fold(0.0, f64::max)
    }

    fn is_alike(&self) -> bool {
        self.worst(degrees) <= ANGLE && self.worst(|likeness| likeness.across) <= PROFILE
    }

    fn last(&self) -> &Likeness {
        &self.likeness[self.likeness.len() - 1].1
    }

    fn name(&self) -> String {
        name(self.at)
    }
}

fn name([psi, u_max]: [f64; 2]) -> String {
    format!("ψ {psi}, u_max {u_max}")
}

fn degrees(likeness: &Likeness) -> f64 {
    likeness.angle.to_degrees()
}

fn rough(setting: &Setting) -> Highlight {
    Highlight::Rough { sigma: setting.fibre.sigma }
}

fn alike(found: &Patch, expected: &Patch) -> anyhow::Result<Likeness> {
    Likeness::new(found, expected)
        .ok_or_else(|| anyhow::anyhow!("a piece of yarn: found no light, expected a streak"))
}

fn pairs(detail: Detail) -> anyhow::Result<Vec<Pair>> {
    both()
        .map(|at| {
            let setting = setting(at, ASPECT, LIGHTS[0]);
            let shaded = setting.shaded(rough(&setting), detail)?;
            let drawn = setting.shaded(Highlight::Window { delta: DELTA }, detail)?;
            let of_count = |count| {
                let traced = setting.traced(count, 1, Interior::Mean, detail);
                Ok((count, alike(&traced, &shaded)?))
            };
            let likeness = COUNTS.into_iter().map(of_count).collect::<anyhow::Result<_>>()?;
            Ok(Pair { at, likeness, drawn: alike(&drawn, &shaded)? })
        })
        .collect()
}

/// The table of all pairs and the threshold; returns the short one.
fn nine_pairs(report: &mut Report, pairs: &[Pair]) -> Table {
    let mut table = Table::new(
        "pairs",
        [
            "ψ, rad",
            "u_max, rad",
            "angle of the shader, °",
            "of filaments, °",
            "greatest difference, °",
            "greatest RMSE across",
            "RMSE along the yarn",
            "light, ratio",
            "angle of the drawn highlight, °",
            "",
        ],
    );
    for pair in pairs {
        let last = pair.last();
        table.row([
            pair.at[0].into(),
            pair.at[1].into(),
            last.expected.angle.to_degrees().into(),
            last.found.angle.to_degrees().into(),
            pair.worst(degrees).into(),
            pair.worst(|likeness| likeness.across).into(),
            last.along.into(),
            last.light.into(),
            pair.drawn.found.angle.to_degrees().into(),
            if pair.is_alike() { "kept" } else { "missed" }.into(),
        ]);
    }
    let count = pairs.iter().filter(|pair| pair.is_alike()).count();
    report.heading("Nine pairs of twist and inclination");
    report.paragraph(&format!(
        "A float {ASPECT} times as long as wide, under a light {}° from the normal and {}° from across \
         the yarn. Angles are from the yarn towards +x, of the axis about which the light has least \
         inertia. The greatest differences are over {MANY} to {} filaments, all else is of the most. \
         The last angle is that of the highlight drawn by a window of δ = {DELTA}.",
        LIGHTS[0][0],
        LIGHTS[0][1],
        COUNTS[COUNTS.len() - 1]
    ));
    report.table(table.clone());
    let what = format!(
        "pairs of ψ and u_max within {ANGLE}° and {PROFILE} of the peak from {MANY} filaments on"
    );
    report.check(Check::new(what, count as f64, Limit::AtLeast(ALIKE)));
    report.fact("light_deg", json!(LIGHTS[0]));
    report.fact("aspect", json!(ASPECT));
    table
}

fn convergence(report: &mut Report, pairs: &[Pair]) {
    let plot = |name: &str, title: &str, unit: &str, of: &dyn Fn(&Likeness) -> f64| {
        let axes = [Axis::new("filaments around the yarn").log(), Axis::new(unit).log()];
        let [x, y] = axes;
        pairs.iter().fold(Plot::new(name, title, x, y), |plot, pair| {
            let points = pair.likeness.iter();
            let points = points.map(|(count, likeness)| [f64::from(*count), of(likeness)]);
            plot.with(Series::line(&pair.name(), points.collect()).with_marks())
        })
    };
    report.heading("Convergence");
    report.paragraph(
        "More filaments come closer to the shader, until what is left is the difference between a \
         yarn that is bent and the rectangle that the shader lays it on.",
    );
    report.plots(vec![
        plot("profile-over-count", "Error of the profile across the streak", "RMSE / peak", &|l| {
            l.across
        }),
        plot("angle-over-count", "Difference of the streaks' angles", "°", &degrees),
    ]);
}

/// The pictures side by side, a row for each pair.
fn pictures(report: &mut Report, detail: Detail) -> anyhow::Result<()> {
    let detail = Detail { across: 72, ..detail };
    report.heading("Side by side");
    report.paragraph(
        "From left to right: yarn of 16, 64 and 1024 filaments, the shader's rough fibres, and its drawn \
         highlight at a third of the brightness. White is 1.2 times the greatest radiance of the rough \
         fibres.",
    );
    let mut figures = Vec::new();
    for at in both() {
        let setting = setting(at, ASPECT, LIGHTS[0]);
        let shaded = setting.shaded(rough(&setting), detail)?;
        let drawn = setting.shaded(Highlight::Window { delta: DELTA }, detail)?;
        let mut patches: Vec<_> = [16, 64, 1024]
            .map(|count| (setting.traced(count, 1, Interior::Mean, detail), 1.0))
            .into();
        let white = 1.2 * shaded.peak();
        patches.push((shaded, 1.0));
        patches.push((drawn, 1.0 / 3.0));
        let stem = format!("streak-psi-{}-u-{}", at[0], at[1]).replace('.', "");
        figures.push(Figure::new(&stem, &name(at), &row(&patches, white)?)?);
    }
    report.pictures(figures);
    Ok(())
}

/// Patches of one size beside each other, +y up, each with what its brightness is multiplied by.
fn row(patches: &[(Patch, f64)], white: f64) -> anyhow::Result<Picture> {
    const GAP: usize = 4;
    let [across, along] = patches[0].0.size;
    let width = patches.len() * (across + GAP) - GAP;
    let mut colors = vec![Vec3::ONE; width * along];
    for (index, (patch, factor)) in patches.iter().enumerate() {
        for (row, light) in patch.pixels.chunks(across).rev().enumerate() {
            let start = row * width + index * (across + GAP);
            for (color, light) in colors[start..start + across].iter_mut().zip(light) {
                *color = Vec3::splat((light * factor / white) as f32);
            }
        }
    }
    let mut picture = Picture::new(Size::new(width as u32, along as u32)?);
    picture.push(Layer::colors("", &colors));
    Ok(picture)
}

/// All pairs under other lights.
fn lights(report: &mut Report, detail: Detail) -> anyhow::Result<()> {
    let columns =
        ["from the normal, °", "from across the yarn, °", "pairs alike", "worst angle, °"];
    let mut table =
        Table::new("lights", [columns[0], columns[1], columns[2], columns[3], "worst RMSE"]);
    for light in LIGHTS {
        let (mut count, mut angle, mut across) = (0u64, 0.0f64, 0.0f64);
        for at in both() {
            let setting = setting(at, ASPECT, light);
            let shaded = setting.shaded(rough(&setting), detail)?;
            let traced = setting.traced(4 * MANY, 1, Interior::Mean, detail);
            let likeness = alike(&traced, &shaded)?;
            count += u64::from(degrees(&likeness) <= ANGLE && likeness.across <= PROFILE);
            angle = angle.max(degrees(&likeness));
            across = across.max(likeness.across);
        }
        table.row([light[0].into(), light[1].into(), count.into(), angle.into(), across.into()]);
    }
    report.heading("Other lights");
    report.paragraph(&format!("The nine pairs with {} filaments.", 4 * MANY));
    report.table(table);
    Ok(())
}

/// The worst pair on floats of other lengths.
fn outlier(report: &mut Report, pairs: &[Pair], detail: Detail) -> anyhow::Result<()> {
    let across = |pair: &Pair| pair.worst(|likeness| likeness.across);
    let worst = pairs.iter().max_by(|a, b| across(a).total_cmp(&across(b)));
    let at = worst.map_or([PSI[0], U_MAX[0]], |pair| pair.at);
    let mut table = Table::new(
        "length",
        ["length / width", "radii of the arc", "angle apart, °", "RMSE across", "RMSE along"],
    );
    let mut points = Vec::new();
    for aspect in ASPECTS {
        let setting = setting(at, aspect, LIGHTS[0]);
        let shaded = setting.shaded(rough(&setting), detail)?;
        let traced = setting.traced(COUNTS[COUNTS.len() - 1], 1, Interior::Mean, detail);
        let likeness = alike(&traced, &shaded)?;
        let arc = setting.shape.bend_radius();
        table.row(
            [aspect, arc, degrees(&likeness), likeness.across, likeness.along].map(Cell::from),
        );
        points.push([1.0 / arc, likeness.across]);
    }
    report.heading("What is left, and the worst pair");
    report.paragraph(&format!(
        "The worst pair is {}. Its yarn is bent so steeply that the arc of its axis has no more than {:.1} \
         times the yarn's own radius. Two things of the shader are right for R → ∞ only. It gives fibres \
         one angle to the yarn all around it, where those of a yarn that was twisted before it was bent \
         have tan ψ (R + 1)/(R + cos v), more at its sides than at its crown. And it lays the yarn on a \
         rectangle, where the surface of the bent yarn recedes towards its sides by \
         (R + cos v)/(R + 1), and leaves the corners of the rectangle dark: that is most of the error along \
         the yarn. Both are of the order 1/R, and so is the error on floats of other lengths:",
        name(at),
        setting(at, ASPECT, LIGHTS[0]).shape.bend_radius()
    ));
    report.table(table);
    let greatest = points.iter().map(|point| point[1]).fold(PROFILE, f64::max);
    report.plot(
        Plot::new(
            "profile-over-bend",
            "Error of the profile over the yarn's bend",
            Axis::new("radius of the yarn / radius of its arc"),
            Axis::new("RMSE / peak").from_to(0.0, 1.1 * greatest),
        )
        .with(Series::line(&name(at), points).with_marks()),
    );
    Ok(())
}

/// Attenuation by the filaments themselves.
fn interior(report: &mut Report, detail: Detail) -> anyhow::Result<()> {
    let detail = Detail { across: 24, side: 2 * detail.side, ..detail };
    let setting = setting([0.5, 0.5], ASPECT, [40.0, 0.0]);
    let shaded = setting.shaded(rough(&setting), detail)?;
    let mut table = Table::new(
        "interior",
        ["taken by a filament", "rings", "light, ratio", "angle apart, °", "RMSE across"],
    );
    let mut points = Vec::new();
    for taken in TAKEN {
        let rings = (DEPTH / taken).ceil() as usize;
        let traced = setting.traced(TRACED, rings, Interior::Traced(taken), detail);
        let likeness = alike(&traced, &shaded)?;
        table.row([
            taken.into(),
            (rings as u64).into(),
            likeness.light.into(),
            degrees(&likeness).into(),
            likeness.across.into(),
        ]);
        points.push([taken, likeness.light - 1.0]);
    }
    report.heading("Attenuation by the filaments themselves");
    report.paragraph(&format!(
        "Above, Seeliger's law stands for the fibres below those that are seen. Here it is left out: \
         {TRACED} filaments lie around the yarn, and as many side by side in each ring below, down to \
         {DEPTH} mean free paths. Each takes a part of the light that crosses it; rays go through all of \
         them to where they scatter, and on to the light. If filaments take much, light leaves mostly by \
         the gap through which it came, and there is more of it than the law says; the less they take, the \
         more of them share the work, and the law comes out."
    ));
    report.table(table);
    report.plot(
        Plot::new(
            "light-over-taken",
            "Light beyond Seeliger's law",
            Axis::new("part of the light that a filament takes").from_to(0.0, 1.1 * TAKEN[0]),
            Axis::new("share").from_to(0.0, 1.1 * points[0][1].max(0.1)),
        )
        .with(Series::line("light", points).with_marks()),
    );
    Ok(())
}

/// The yarns of the cloths.
fn yarns(
    report: &mut Report,
    options: &MeasureOptions,
    subjects: &[Subject],
    detail: Detail,
) -> anyhow::Result<()> {
    let mut table = Table::new(
        "yarns",
        [
            "cloth",
            "yarn",
            "ψ, rad",
            "u_max, rad",
            "σ, rad",
            "angle of the shader, °",
            "of filaments, °",
            "apart, °",
            "RMSE across",
        ],
    );
    let mut left_out = BTreeSet::new();
    for subject in subjects {
        tell_progress(options, subject);
        let mut known: Vec<&Yarn> = Vec::new();
        for (index, yarn) in subject.cloth.yarns.iter().enumerate() {
            let is_known = known.iter().any(|other| {
                (other.psi, other.u_max, &other.phase) == (yarn.psi, yarn.u_max, &yarn.phase)
                    && other.highlight == yarn.highlight
            });
            if is_known {
                continue;
            }
            known.push(yarn);
            let (Phase::VonMises { alpha, beta }, true) = (&yarn.phase, yarn.u_max >= 0.02) else {
                left_out.insert(format!("{} {}", subject.name, index + 1));
                continue;
            };
            let sigma = match yarn.highlight {
                Highlight::Rough { sigma } => sigma,
                Highlight::Window { .. } => FIBRE.sigma,
            };
            let fibre = Fibre { sigma, alpha: *alpha, beta: *beta };
            let shape = Shape { u_max: yarn.u_max, psi: yarn.psi, aspect: ASPECT };
            let setting = Setting { shape, fibre, wi: to_light(LIGHTS[0]) };
            let shaded = setting.shaded(rough(&setting), detail)?;
            let traced = setting.traced(4 * MANY, 1, Interior::Mean, detail);
            let likeness = alike(&traced, &shaded)?;
            table.row([
                subject.name.as_str().into(),
                ((index + 1) as u64).into(),
                yarn.psi.into(),
                yarn.u_max.into(),
                sigma.into(),
                likeness.expected.angle.to_degrees().into(),
                likeness.found.angle.to_degrees().into(),
                degrees(&likeness).into(),
                likeness.across.into(),
            ]);
        }
    }
    report.heading("The yarns of the cloths");
    report.paragraph(&format!(
        "Each type of yarn as a circular float {ASPECT} times as long as wide, of {} filaments. Yarns that \
         differ in colour alone are listed once; where the cloth draws its highlight, fibres have σ = {}. The \
         streak of untwisted yarn, ψ = 0, lies across it: there it shows most how the surface of a bent yarn \
         recedes towards its sides.",
        4 * MANY,
        FIBRE.sigma
    ));
    report.table(table);
    if !left_out.is_empty() {
        let names: Vec<_> = left_out.into_iter().collect();
        report.paragraph(&format!(
            "Left out, as they are straight or scatter by another phase function than von Mises: {}.",
            names.join(", ")
        ));
    }
    Ok(())
}
