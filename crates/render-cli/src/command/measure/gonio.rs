//! `selvedge measure gonio`: where a cloth reflects light from one direction, as a goniophotometer sees it.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use selvedge_yarn_brdf::Lobes;

use super::{
    Findings, Subject,
    albedo::{Estimate, Tier, albedo, footprint},
    map, tell_progress,
};
use crate::{
    args::{Angles, MeasureOptions},
    image,
    report::{Axis, Check, Figure, Limit, Plot, Report, Series, Table},
};

/// Angles of the light from the normal, °.
const LIGHTS: [f64; 4] = [0.0, 30.0, 60.0, 80.0];

/// Planes in which light and viewer are, by their azimuth from the weft, °.
const PLANES: [(f64, &str); 2] = [(0.0, "weft"), (90.0, "warp")];

/// Steepest angle of the viewer from the normal, °, at which slices end.
const LAST: i32 = 89;

/// Angles of the viewer from the normal for albedos, °, and points of each sum.
const THETAS: [f64; 9] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 78.0, 84.0, 88.0];
const POINTS: u64 = 1 << 16;

/// Greatest difference of the albedos of the far field and of all places, beyond the noise of both.
const APART: f64 = 0.01;
/// Standard errors that are granted to them.
const GRANTED: f64 = 5.0;

/// Pixels on a side of the pictures of all directions.
const SIDE: u32 = 192;

/// What a goniophotometer sees of all `subjects`.
pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let mut report = Report::new(
        "Goniophotometer",
        "What a cloth that is seen from afar reflects: the mean of its BRDF over the repeat, in sr⁻¹ \
         without the cosine. In slices the light comes from the left of the normal, at −θ, and the viewer \
         goes from −89° to 89°. Angles are in degrees, from the normal and from the weft towards the \
         warp.",
    );
    let columns = ["cloth", "plane", "light θ, °", "greatest f, sr⁻¹", "at θ, °", "half width, °"];
    let mut summary = Table::new("peaks", columns);
    for subject in subjects {
        tell_progress(options, subject);
        report.heading(&subject.input);
        let mut data = Table::new(
            &format!("{}-slices", subject.name),
            [
                "light θ, °",
                "light φ, °",
                "viewer θ, °",
                "viewer φ, °",
                "f red, sr⁻¹",
                "f green, sr⁻¹",
                "f blue, sr⁻¹",
                "highlight, sr⁻¹",
                "diffuse, sr⁻¹",
            ],
        );
        let mut polar = Vec::new();
        for (phi_deg, plane) in PLANES {
            let name = format!("{}-{plane}", subject.name);
            let title = format!("Light and viewer along the {plane}");
            let mut lobes = Plot::polar(&format!("{name}-polar"), &title, "luminance of f, sr⁻¹");
            let axes = (
                Axis::new("viewer, °").from_to(-90.0, 90.0),
                Axis::new("luminance of f, sr⁻¹").log(),
            );
            let mut slices = Plot::new(&format!("{name}-slice"), &title, axes.0, axes.1);
            for theta_deg in LIGHTS {
                let slice = slice(subject, theta_deg, phi_deg, &mut data);
                let (at, greatest) =
                    slice.iter().copied().fold((0.0, 0.0), |best: (f64, f64), p| {
                        if p[1] > best.1 { (p[0], p[1]) } else { best }
                    });
                let above = slice.iter().filter(|p| p[1] > 0.5 * greatest).count();
                let cells = [subject.input.as_str(), plane].map(Into::into).into_iter();
                let numbers = [theta_deg, greatest, at, above as f64].map(Into::into);
                summary.row(cells.chain(numbers));
                let name = format!("light at {theta_deg}°");
                lobes = lobes.with(Series::line(&name, slice.clone()));
                slices = slices.with(Series::line(&name, slice));
            }
            polar.extend([lobes, slices]);
        }
        report.plots(polar);
        report.data("The slices in red, green and blue, and their lobes", data);
        let plot = albedos(options, subject, &mut report);
        report.plot(plot);
        report.paragraph(
            "All directions of the viewer as seen from above, the weft to the right and the warp upwards; \
             brighter where more is reflected, by the root of the luminance.",
        );
        report.pictures(all_directions(subject)?);
    }
    report.heading("Peaks");
    report.paragraph(
        "The half width counts the degrees at which a slice is above half its greatest value.",
    );
    report.table(summary.clone());
    Ok(Findings { report, summary })
}

fn luminance(color: DVec3) -> f64 {
    image::luminance(color.as_vec3()).into()
}

/// The luminance of f over the signed angle of the viewer, whose numbers go to `data`.
fn slice(subject: &Subject, theta_deg: f64, phi_deg: f64, data: &mut Table) -> Vec<[f64; 2]> {
    let footprint = footprint(&subject.cloth);
    let light = Angles { theta_deg, phi_deg: phi_deg + 180.0 };
    let points = (-LAST..=LAST).map(|signed| {
        let phi_deg = if signed < 0 { phi_deg + 180.0 } else { phi_deg };
        let viewer = Angles { theta_deg: f64::from(signed.abs()), phi_deg };
        let (wi, wo) = (light.single(), viewer.single());
        let f = subject.surface.far_eval(&footprint, wi, wo).as_dvec3();
        let Lobes { specular, diffuse } =
            subject.surface.shader().far_eval_lobes(&footprint, wi, wo);
        let lobes = [specular, diffuse].map(|lobe| luminance(lobe.as_dvec3()));
        let angles = [light.theta_deg, light.phi_deg, viewer.theta_deg, viewer.phi_deg];
        data.row(angles.into_iter().chain([f.x, f.y, f.z]).chain(lobes).map(Into::into));
        [f64::from(signed), luminance(f)]
    });
    points.collect()
}

/// The albedo over the angle of the viewer, of the far field and of all places.
fn albedos(options: &MeasureOptions, subject: &Subject, report: &mut Report) -> Plot {
    let Subject { cloth, surface, .. } = subject;
    let mut plot = Plot::new(
        &format!("{}-albedo", subject.name),
        "Albedo over the angle of the viewer",
        Axis::new("viewer θ, °").from_to(0.0, 90.0),
        Axis::new("albedo, luminance"),
    );
    let sums = (options.seed, options.count(POINTS));
    let mut apart: f64 = 0.0;
    for (phi_deg, plane) in PLANES {
        let both: Vec<[Estimate; 2]> = THETAS
            .into_par_iter()
            .map(|theta_deg| {
                let wo = Angles { theta_deg, phi_deg }.single();
                let (seed, count) = sums;
                [(Tier::Batch, count), (Tier::Far, count / 4)]
                    .map(|(tier, count)| albedo(&**surface, cloth, tier, wo, (seed, count)))
            })
            .collect();
        for [near, far] in &both {
            let noise = GRANTED * luminance(near.error).hypot(luminance(far.error));
            let difference = (luminance(near.mean) - luminance(far.mean)).abs() - noise;
            apart = if difference.is_nan() { f64::NAN } else { apart.max(difference) };
        }
        for (which, tier) in [(0, "all places"), (1, "far field")] {
            let found = THETAS.iter().zip(&both).map(|(theta, both)| (*theta, both[which]));
            let points = found.clone().map(|(theta, of)| [theta, luminance(of.mean)]).collect();
            let intervals = found.map(|(_, of)| {
                let (mean, error) = (luminance(of.mean), 2.0 * luminance(of.error));
                [mean - error, mean + error]
            });
            let series = Series::line(&format!("{tier}, {plane}"), points);
            plot = plot.with(series.with_intervals(intervals.collect()));
        }
    }
    let what = format!("{}: albedo of the far field against all places", subject.input);
    report.check(Check::new(what, apart, Limit::AtMost(APART)));
    plot
}

/// Pictures of what is reflected to all directions, of light from the weft's and from the warp's side.
fn all_directions(subject: &Subject) -> anyhow::Result<Vec<Figure>> {
    let footprint = footprint(&subject.cloth);
    let mut figures = Vec::new();
    for (phi_deg, plane) in PLANES {
        let wi = Angles { theta_deg: 45.0, phi_deg: phi_deg + 180.0 }.single();
        let f =
            |w: DVec3| luminance(subject.surface.far_eval(&footprint, wi, w.as_vec3()).as_dvec3());
        let pixels = 0..SIDE as usize * SIDE as usize;
        let values = pixels.into_par_iter().filter_map(|pixel| map::direction(SIDE, pixel).map(f));
        let greatest = values.reduce(|| f64::MIN_POSITIVE, f64::max);
        let picture =
            map::hemisphere(SIDE, Vec3::splat(0.2), |_, w| map::heat((f(w) / greatest).sqrt()));
        let caption = format!("Light at 45° along the {plane}; white is {greatest:.3} sr⁻¹");
        figures.push(Figure::new(&format!("{}-{plane}-all", subject.name), &caption, &picture)?);
    }
    Ok(figures)
}
