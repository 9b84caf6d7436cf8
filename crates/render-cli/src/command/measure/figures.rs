//! `selvedge measure figures`.

use std::path::Path;

use selvedge_yarn_brdf::Cloth;
use serde_json::json;

use super::{Findings, Subject, tell_progress};
use crate::{
    args::MeasureOptions,
    fabric,
    image::Picture,
    measure::figures::{
        along_row, draped, drawdown, mean_luminance, sheet::sheet, textured, wrinkled,
    },
    render::film::{Film, Size},
    report::{Axis, Figure, Plot, Report, Series, Table},
    scene::Material,
};

/// Sides of the pictures of draped cloth, of drawdowns as high as those, and of the wrinkled sample.
const DRAPED: [u32; 2] = [360, 240];
const CROSSING: u32 = 6;
const SAMPLE: u32 = 150;

/// Samples per pixel.
const SPP: u32 = 16;

/// The fabrics of figures 9 and 10; the first is also that of figure 11.
const FABRICS: [(&str, &str); 2] = [("a", "preset:fabric-a"), ("b", "preset:fabric-b")];

/// The row across the left flank of the drape, as shares of the picture's sides, and its height in
/// pixels.
const ROW: f64 = 0.5;
const FLANK: [f64; 2] = [0.1, 0.45];
const ROWS: u32 = 5;

/// Elevation of the lights of figure 11, degrees, and others for the first of them.
const ELEVATION: u32 = 30;
const ELEVATIONS: [u32; 6] = [8, 15, 30, 45, 60, 80];

/// The two shaders, as the legend calls them.
const SHADERS: [&str; 2] = ["cloth", "texture-based"];

pub(super) fn measure(options: &MeasureOptions, subjects: &[Subject]) -> anyhow::Result<Findings> {
    let spp = (f64::from(SPP) * options.budget) as u32;
    let spp = spp.clamp(1, 1 << 15).next_power_of_two();
    let mut report = Report::new(
        "Figures of the paper",
        "The figures of Nelson, McEvoy & Fratarcangeli 2016, but for the photographs: cloth, and the same \
         cloth as pictures on a glossy surface.",
    );
    report.paragraph(&format!(
        "The texture-based shader stands for the production shader of the paper: base colour, normal, \
         roughness, reflectance and anisotropy are maps of 8 bits with at least ten texels to a thread, \
         baked from the same cloth and fitted to what it reflects. All pictures have {spp} samples per pixel."
    ));
    let columns = ["figure", "what", "cloth", "texture-based"];
    let mut summary = Table::new("summary", columns);
    let mut rows = Vec::new();
    let drawing = Drawing { spp, seed: options.seed };

    rows.push(drawing.first(&mut report, options, subjects)?);
    let mut fabric_a = None;
    for (name, input) in FABRICS {
        let source = fabric::read(Path::new(input))?;
        let cloth = source.cloth(&source.draft().drawdown()?)?;
        let materials = [Material::cloth(cloth.prepare()?), textured::material(&cloth)?];
        rows.push(drawing.flank(&mut report, &mut summary, name, &materials)?);
        fabric_a.get_or_insert(materials);
    }
    if let Some(materials) = fabric_a {
        rows.extend(drawing.six_lights(&mut report, &mut summary, &materials)?);
    }

    report.heading("All on one sheet");
    report.paragraph(
        "From the top: the fabrics of figure 1 with their weaves; figures 9 and 10, draped fabric A and B, \
         texture-based on the left and cloth on the right; figure 11, fabric A lit from six directions, \
         above cloth and below texture-based.",
    );
    let rows: Vec<Vec<&Film>> = rows.iter().map(|row| row.iter().collect()).collect();
    let picture = sheet(&rows)?;
    report.pictures(vec![Figure::new("contact-sheet", "all pictures", &picture)?]);
    report.table(summary.clone());
    Ok(Findings { report, summary })
}

/// How pictures are drawn.
struct Drawing {
    spp: u32,
    seed: u64,
}

impl Drawing {
    /// Figure 1: each cloth draped, and its weave.
    fn first(
        &self,
        report: &mut Report,
        options: &MeasureOptions,
        subjects: &[Subject],
    ) -> anyhow::Result<Vec<Film>> {
        report.heading("Figure 1: fabrics and their weaves");
        let mut films = Vec::new();
        for subject in subjects {
            tell_progress(options, subject);
            let material = Material::cloth(subject.cloth.prepare()?);
            let [draped, weave] = [self.draped(&material)?, weave(&subject.cloth)?];
            let name = &subject.name;
            report.pictures(vec![
                figure(&format!("{name}-draped"), &subject.input, &draped)?,
                figure(&format!("{name}-weave"), &format!("{}: its weave", subject.input), &weave)?,
            ]);
            films.extend([draped, weave]);
        }
        Ok(films)
    }

    /// Figure 9 or 10: a fabric draped, by both shaders, and its brightness across the left flank.
    fn flank(
        &self,
        report: &mut Report,
        summary: &mut Table,
        name: &str,
        materials: &[Material; 2],
    ) -> anyhow::Result<Vec<Film>> {
        let number = if name == "a" { 9 } else { 10 };
        let title = name.to_uppercase();
        report.heading(&format!("Figure {number}: fabric {title}, draped"));
        let films = [self.draped(&materials[0])?, self.draped(&materials[1])?];
        let lines = films.each_ref().map(|film| along_row(film, ROW, FLANK, ROWS));
        let [cloth, texture] = &films;
        report.pictures(vec![
            figure(&format!("fabric-{name}-texture"), "texture-based", texture)?,
            figure(&format!("fabric-{name}-cloth"), "cloth", cloth)?,
        ]);
        let plot = Plot::new(
            &format!("flank-{name}"),
            "Brightness along a line across the left flank",
            Axis::new("place, part of the picture's width"),
            Axis::new("luminance").from_to(0.0, 1.1 * greatest(&lines)),
        );
        report.plot(
            SHADERS
                .iter()
                .zip(&lines)
                .fold(plot, |plot, (shader, line)| plot.with(Series::line(shader, line.clone()))),
        );
        let figure = format!("{number}");
        let contrast = lines.each_ref().map(|line| contrast(line));
        let peak = lines.each_ref().map(|line| greatest(std::slice::from_ref(line)));
        for (what, [cloth, texture]) in
            [("greatest luminance on the flank", peak), ("greatest over median there", contrast)]
        {
            summary.row([figure.as_str().into(), what.into(), cloth.into(), texture.into()]);
        }
        let [cloth, texture] = films;
        Ok(vec![texture, cloth])
    }

    /// Figure 11: the wrinkled sample under each of six lights, and under one at other elevations.
    fn six_lights(
        &self,
        report: &mut Report,
        summary: &mut Table,
        materials: &[Material; 2],
    ) -> anyhow::Result<[Vec<Film>; 2]> {
        report.heading("Figure 11: a wrinkled sample lit from six directions");
        report.paragraph(&format!(
            "Fabric A, wrinkled but level, seen from above; one light at a time, {ELEVATION}° above it, \
             from +x on counter-clockwise."
        ));
        let size = Size::new(SAMPLE, SAMPLE)?;
        let under = |material: &Material, light: [u32; 2]| {
            wrinkled(material, light, size, self.spp, self.seed)
        };
        let rows = materials.each_ref().map(|material| -> anyhow::Result<Vec<Film>> {
            (1..=6).map(|light| under(material, [light, ELEVATION])).collect()
        });
        let [cloth, texture] = rows;
        let rows = [cloth?, texture?];
        let columns = ["direction, °", "mean luminance, cloth", "texture-based"];
        let mut table = Table::new("directions", columns);
        let means = rows.each_ref().map(|row| row.iter().map(mean_luminance).collect::<Vec<_>>());
        for light in 0..6 {
            let direction = 60.0 * light as f64;
            table.row([direction.into(), means[0][light].into(), means[1][light].into()]);
        }
        for (shader, row) in SHADERS.iter().zip(&rows) {
            let films = sheet(&[row.iter().collect()])?;
            let name = format!("wrinkled-{}", if *shader == "cloth" { "cloth" } else { "texture" });
            report.pictures(vec![Figure::new(&name, shader, &films)?]);
        }
        report.table(table);
        let over_direction = |means: &Vec<f64>| {
            let points = means.iter().enumerate();
            points.map(|(light, mean)| [60.0 * light as f64, *mean]).collect::<Vec<_>>()
        };
        let lines = means.each_ref().map(over_direction);
        let mut plots = vec![plot(
            "mean-over-direction",
            "Mean luminance over the direction of the light",
            "direction, °",
            &lines,
        )];

        // Against the cosine, which a diffuse sheet would follow.
        let over_elevation =
            materials.each_ref().map(|material| -> anyhow::Result<Vec<[f64; 2]>> {
                let points = ELEVATIONS.iter().map(|&elevation| {
                    let sine = f64::from(elevation).to_radians().sin();
                    Ok([
                        f64::from(elevation),
                        mean_luminance(&under(material, [1, elevation])?) / sine,
                    ])
                });
                points.collect()
            });
        let [cloth, texture] = over_elevation;
        let lines = [cloth?, texture?];
        plots.push(plot(
            "mean-over-elevation",
            "Mean luminance of the first light, over the sine of its elevation",
            "elevation, °",
            &lines,
        ));
        report.plots(plots);

        let spread = means.each_ref().map(|means| {
            means.iter().copied().fold(0.0, f64::max)
                / means.iter().copied().fold(f64::INFINITY, f64::min)
        });
        let grazing = lines.each_ref().map(|line| line[0][1] / line[line.len() - 1][1]);
        for (what, [cloth, texture]) in [
            ("brightest over darkest of six directions", spread),
            ("brightness per irradiance, light at 8° over at 80°", grazing),
        ] {
            summary.row(["11".into(), what.into(), cloth.into(), texture.into()]);
        }
        report.fact("elevation_deg", json!(ELEVATION));
        Ok(rows)
    }

    fn draped(&self, material: &Material) -> anyhow::Result<Film> {
        draped(material, Size::new(DRAPED[0], DRAPED[1])?, self.spp, self.seed)
    }
}

fn weave(cloth: &Cloth) -> anyhow::Result<Film> {
    Ok(drawdown(cloth, Size::new(DRAPED[1], DRAPED[1])?, CROSSING))
}

fn figure(name: &str, caption: &str, film: &Film) -> anyhow::Result<Figure> {
    Ok(Figure::new(name, caption, &Picture::from_film(film))?)
}

/// Both shaders' values over `x`, from 0 on.
fn plot(name: &str, title: &str, x: &str, lines: &[Vec<[f64; 2]>; 2]) -> Plot {
    let y = Axis::new("luminance").from_to(0.0, 1.1 * greatest(lines));
    SHADERS
        .iter()
        .zip(lines)
        .fold(Plot::new(name, title, Axis::new(x), y), |plot, (shader, line)| {
            plot.with(Series::line(shader, line.clone()).with_marks())
        })
}

fn greatest(lines: &[Vec<[f64; 2]>]) -> f64 {
    lines.iter().flatten().map(|point| point[1]).fold(0.0, f64::max)
}

/// The greatest value over the median.
fn contrast(line: &[[f64; 2]]) -> f64 {
    let mut values: Vec<_> = line.iter().map(|point| point[1]).collect();
    values.sort_by(f64::total_cmp);
    match (values.get(values.len() / 2), values.last()) {
        (Some(median), Some(greatest)) => greatest / median,
        _ => 1.0,
    }
}
