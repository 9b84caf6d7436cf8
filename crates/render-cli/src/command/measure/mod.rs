//! `selvedge measure`: what is measured, and reported in a folder.
//!
//! Each subcommand makes a [`Report`] of its subjects and a summary for the terminal; what they have in
//! common is here.

mod albedo;
mod chi2;
#[cfg(any(test, feature = "faults"))]
mod faulty;
mod figures;
mod filaments;
mod furnace;
mod gonio;
mod histogram;
mod map;
mod random;
mod reciprocity;
mod stability;
mod surface;
mod table1;
mod three_way;
mod trade;
mod tuple;

use std::{collections::BTreeSet, path::Path};

use anyhow::Context;
use selvedge_yarn_brdf::{Cloth, Target};
use serde_json::json;

use self::surface::Surface;
use crate::{
    Outcome,
    args::{MeasureCommand, MeasureOptions},
    fabric::{self, PRESET},
    folder::Folder,
    output::tell,
    report::{INDEX, Report, Table},
    threads,
};

/// Measures what `command` says, and reports it.
///
/// # Errors
///
/// When a cloth cannot be read or is not sound, or the folder or standard output cannot be written.
pub fn run(command: &MeasureCommand) -> anyhow::Result<Outcome> {
    match command {
        MeasureCommand::Figures(options) => measure(options, figures::measure),
        MeasureCommand::Filaments(options) => measure(options, filaments::measure),
        MeasureCommand::Furnace(options) => measure(options, furnace::measure),
        MeasureCommand::Reciprocity(options) => measure(options, reciprocity::measure),
        MeasureCommand::Chi2(options) => measure(options, chi2::measure),
        MeasureCommand::Stability(options) => measure(options, stability::measure),
        MeasureCommand::Gonio(options) => measure(options, gonio::measure),
        MeasureCommand::Table1(options) => measure(&options.measure, |measured, subjects| {
            table1::measure(options, measured, subjects)
        }),
        MeasureCommand::Trade(options) => measure(options, trade::measure),
    }
}

/// A cloth to be measured.
struct Subject {
    /// As the user calls it.
    input: String,
    /// What files of it are called: short, and another one for each subject.
    name: String,
    cloth: Cloth,
    surface: Box<dyn Surface>,
}

impl Subject {
    /// What is measured of another cloth that was made of this one.
    fn prepare(&self, options: &MeasureOptions, cloth: &Cloth) -> anyhow::Result<Box<dyn Surface>> {
        let shader = cloth.prepare().with_context(|| self.input.clone())?;
        Ok(surface::surface(options, shader))
    }
}

/// `cloth` with yarns that take no light away: white ones, and highlights of one colour that are as bright as
/// their brightest component.
fn whitened(cloth: &Cloth) -> Cloth {
    let mut white = cloth.clone();
    white.textures.retain(|textured| matches!(textured.target, Target::Parameter(_)));
    for yarn in &mut white.yarns {
        let amount = yarn.specular.into_iter().chain(yarn.specular_uniform.into_iter().flatten());
        let amount = amount.fold(0.0, f32::max);
        (yarn.color, yarn.specular, yarn.specular_uniform) = ([1.0; 3], [amount; 3], None);
        // Threads that are darker than others are not white.
        yarn.noise.color = 0.0;
    }
    white
}

/// What to report, and what to print.
struct Findings {
    report: Report,
    summary: Table,
}

/// Lets `work` measure what `options` name, on the threads that they allow, and writes its findings.
fn measure(
    options: &MeasureOptions,
    work: impl FnOnce(&MeasureOptions, &[Subject]) -> anyhow::Result<Findings> + Send,
) -> anyhow::Result<Outcome> {
    let folder = Folder::new(&options.output, INDEX)?;
    let pool = threads::pool(options.threads)?;
    let (findings, names) = pool.install(|| -> anyhow::Result<_> {
        let subjects = subjects(options)?;
        let names = subjects.iter().map(|subject| subject.input.clone()).collect::<Vec<_>>();
        Ok((work(options, &subjects)?, names))
    })?;
    let Findings { mut report, summary } = findings;
    report.fact("cloths", json!(names));
    report.fact("budget", json!(options.budget));
    report.fact("seed", json!(options.seed));
    report.finish(&folder, &summary)
}

/// Tells which subject is looked at.
fn tell_progress(options: &MeasureOptions, subject: &Subject) {
    if !options.quiet {
        tell(&subject.input);
    }
}

fn subjects(options: &MeasureOptions) -> anyhow::Result<Vec<Subject>> {
    let mut taken = BTreeSet::new();
    let subjects = options.inputs.iter().map(|input| {
        let source = fabric::read(input)?;
        let drawdown = source.draft().drawdown()?;
        let cloth = source.cloth(&drawdown)?;
        let shader = source.shader(&cloth)?;
        let short = short_name(input);
        let name = (1..)
            .map(|k| if k == 1 { short.clone() } else { format!("{short}-{k}") })
            .find(|name| taken.insert(name.clone()))
            .expect("some number is free");
        Ok(Subject {
            input: source.name().to_owned(),
            name,
            cloth,
            surface: surface::surface(options, shader),
        })
    });
    subjects.collect()
}

/// What files of `input` are called: `denim` for `preset:denim` and `x/denim.json`.
fn short_name(input: &Path) -> String {
    let name = input.to_string_lossy();
    let stem = match name.strip_prefix(PRESET) {
        Some(preset) => preset.into(),
        None => input.file_stem().unwrap_or_default().to_string_lossy(),
    };
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let name: String = stem.chars().map(plain).collect();
    let name = name.trim_matches('-');
    if name.is_empty() { "cloth".to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_plain() {
        let cases = [
            ("preset:denim", "denim"),
            ("a/b/My Cloth.v2.json", "my-cloth-v2"),
            ("-", "cloth"),
            ("../..", "cloth"),
        ];
        for (input, expected) in cases {
            assert_eq!(short_name(input.as_ref()), expected, "{input}");
        }
    }
}
