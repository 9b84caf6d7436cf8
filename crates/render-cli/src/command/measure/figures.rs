//! `selvedge measure figures`.

use std::path::Path;

use serde_json::json;

use super::{Findings, Subject, tell_progress};
use crate::{
    args::MeasureOptions,
    fabric,
    image::Picture,
    measure::figures::{Setup, along_row, drawdown, mean_luminance, sheet::sheet, textured},
    render::film::{Film, Size},
    report::{Axis, Figure, Plot, Report, Series, Table},
    scene::Material,
};

/// Sides of the pictures of draped cloth, of drawdowns beside them and their crossings, and of the wrinkled
/// sample, in pixels.
const DRAPED: [u32; 2] = [360, 240];
const WEAVE: [u32; 2] = [120, 240];
const CROSSING: u32 = 6;
const SAMPLE: u32 = 240;
/// Where only the mean is asked for.
const SMALL_SAMPLE: u32 = 75;

/// Samples per pixel.
const SPP: u32 = 16;

/// The fabrics of figures 9 and 10; the first is also that of figure 11.
const FABRICS: [(&str, &str); 2] = [("a", "preset:fabric-a"), ("b", "preset:fabric-b")];

/// The row across the left flank of the drape, as shares of the picture's sides, and its height in
/// pixels.
const ROW: f64 = 0.5;
const FLANK: [f64; 2] = [0.14, 0.45];
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
    let scale = options.budget.sqrt().min(1.0);
    let size = |[width, height]: [u32; 2]| {
        let scaled = |side: u32| ((f64::from(side) * scale).round() as u32).max(16);
        Size::new(scaled(width), scaled(height))
    };
    let mut fabrics = Vec::new();
    for (name, input) in FABRICS {
        let source = fabric::read(Path::new(input))?;
        let cloth = source.cloth(&source.draft().drawdown()?)?;
        fabrics.push((name, [Material::cloth(cloth.prepare()?), textured::material(&cloth)?]));
    }
    let Some((_, [fabric_a, _])) = fabrics.first() else { anyhow::bail!("no fabric A") };
    let mut draped = Setup::draped(fabric_a, spp, options.seed)?;
    rows.push(first(&mut report, options, subjects, &mut draped, [size(DRAPED)?, size(WEAVE)?])?);
    let mut both = Vec::new();
    for (name, materials) in &fabrics {
        let size = size(DRAPED)?;
        let pictures = materials.each_ref().map(|material| draped.picture(material, size));
        both.extend(flank(&mut report, &mut summary, name, pictures)?);
    }
    rows.push(both);
    let sizes = [size([SAMPLE; 2])?, size([SMALL_SAMPLE; 2])?];
    let mut wrinkled = Setup::wrinkled(spp, options.seed)?;
    rows.extend(six_lights(&mut report, &mut summary, &mut wrinkled, &fabrics[0].1, sizes)?);

    report.heading("All on one sheet");
    report.paragraph(
        "From the top: the fabrics of figure 1 with their weaves; figures 9 and 10, draped fabrics A and B, \
         texture-based and cloth of each; figure 11, fabric A lit from six directions, above cloth and below \
         texture-based.",
    );
    let rows: Vec<Vec<&Film>> = rows.iter().map(|row| row.iter().collect()).collect();
    let picture = sheet(&rows)?;
    report.pictures(vec![Figure::new("contact-sheet", "all pictures", &picture)?]);
    report.table(summary.clone());
    Ok(Findings { report, summary })
}

/// Figure 1: each cloth draped, and its weave.
fn first(
    report: &mut Report,
    options: &MeasureOptions,
    subjects: &[Subject],
    setup: &mut Setup,
    [size, weave_size]: [Size; 2],
) -> anyhow::Result<Vec<Film>> {
    report.heading("Figure 1: fabrics and their weaves");
    let mut films = Vec::new();
    for subject in subjects {
        tell_progress(options, subject);
        let draped = setup.picture(&Material::cloth(subject.cloth.prepare()?), size);
        let weave = drawdown(&subject.cloth, weave_size, CROSSING);
        let (name, input) = (&subject.name, &subject.input);
        report.pictures(vec![
            figure(&format!("{name}-draped"), input, &draped)?,
            figure(&format!("{name}-weave"), &format!("{input}: its weave"), &weave)?,
        ]);
        films.extend([draped, weave]);
    }
    Ok(films)
}

/// Figure 9 or 10: a fabric draped, as cloth and as texture, and its brightness across the left flank.
fn flank(
    report: &mut Report,
    summary: &mut Table,
    name: &str,
    [cloth, texture]: [Film; 2],
) -> anyhow::Result<[Film; 2]> {
    let number = if name == "a" { "9" } else { "10" };
    report.heading(&format!("Figure {number}: fabric {}, draped", name.to_uppercase()));
    report.pictures(vec![
        figure(&format!("fabric-{name}-texture"), "texture-based", &texture)?,
        figure(&format!("fabric-{name}-cloth"), "cloth", &cloth)?,
    ]);
    let lines = [&cloth, &texture].map(|film| along_row(film, ROW, FLANK, ROWS));
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
    let peak = lines.each_ref().map(|line| greatest(std::slice::from_ref(line)));
    let contrast = lines.each_ref().map(|line| contrast(line));
    for (what, [cloth, texture]) in
        [("greatest luminance on the flank", peak), ("greatest over median there", contrast)]
    {
        summary.row([number.into(), what.into(), cloth.into(), texture.into()]);
    }
    Ok([texture, cloth])
}

/// Figure 11: the wrinkled sample under each of six lights, and under one at other elevations.
fn six_lights(
    report: &mut Report,
    summary: &mut Table,
    setup: &mut Setup,
    materials: &[Material; 2],
    [size, small]: [Size; 2],
) -> anyhow::Result<[Vec<Film>; 2]> {
    report.heading("Figure 11: a wrinkled sample lit from six directions");
    report.paragraph(&format!(
        "Fabric A, wrinkled but level, seen from above; one light at a time, {ELEVATION}° above it, from +x \
         on counter-clockwise."
    ));
    let mut rows = [Vec::new(), Vec::new()];
    for light in 1..=6 {
        setup.light(light, ELEVATION)?;
        for (row, material) in rows.iter_mut().zip(materials) {
            row.push(setup.picture(material, size));
        }
    }
    let columns = ["direction, °", "mean luminance, cloth", "texture-based"];
    let mut table = Table::new("directions", columns);
    let means = rows.each_ref().map(|row| {
        let means = row.iter().enumerate();
        means.map(|(light, film)| [60.0 * light as f64, mean_luminance(film)]).collect::<Vec<_>>()
    });
    for (cloth, texture) in means[0].iter().zip(&means[1]) {
        table.row([cloth[0].into(), cloth[1].into(), texture[1].into()]);
    }
    for ((shader, name), row) in SHADERS.iter().zip(["cloth", "texture"]).zip(&rows) {
        let films = sheet(&[row.iter().collect()])?;
        report.pictures(vec![Figure::new(&format!("wrinkled-{name}"), shader, &films)?]);
    }
    report.table(table);

    // Against the sine, which a diffuse sheet would follow.
    let mut lines = [Vec::new(), Vec::new()];
    for elevation in ELEVATIONS {
        setup.light(1, elevation)?;
        let sine = f64::from(elevation).to_radians().sin();
        for (line, material) in lines.iter_mut().zip(materials) {
            let mean = mean_luminance(&setup.picture(material, small));
            line.push([f64::from(elevation), mean / sine]);
        }
    }
    report.plots(vec![
        plot(
            "mean-over-direction",
            "Mean luminance over the direction of the light",
            "direction, °",
            &means,
        ),
        plot(
            "mean-over-elevation",
            "Mean luminance of the first light, over the sine of its elevation",
            "elevation, °",
            &lines,
        ),
    ]);
    let spread = means.each_ref().map(|line| {
        let least = line.iter().map(|point| point[1]).fold(f64::INFINITY, f64::min);
        greatest(std::slice::from_ref(line)) / least
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
