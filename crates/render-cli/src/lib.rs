//! Renders woven cloth from a WIF draft or a fabric: the library behind the program `selvedge`.
//!
//! ```text
//! DRAFT.wif ──draft──▶ Drawdown ─┬─▶ Cloth ──▶ Shader ─┐
//! FABRIC.json ──fabric──▶ Fabric ┘                      │
//!         scene::drape, scene::swatch, scene::light ────┴▶ Scene ──render──▶ Film ──image──▶ PNG, EXR
//! ```
//!
//! [`command::draft`] looks at drafts alone, without cloth, and [`command::image`] at pictures. What
//! [`command::measure`] finds becomes a [`report::Report`].
//! [`bake`] makes pictures of a cloth for other programs. [`command::draft`] looks at drafts alone, without cloth, and [`command::image`] at pictures.
//!
//! World space is in metres, right-handed, z up. Cloth coordinates are lengths in metres, u along
//! the weft and v along the warp. Radiance is linear, with the primaries of sRGB, in units in which
//! a white card on the floor of the built-in scene is about 1.
//!
//! Equal input gives equal bits, for any number of threads.

#![cfg_attr(not(feature = "embree"), forbid(unsafe_code))]

pub mod args;
pub mod bake;
mod chi_square;
pub mod command;
mod data_uri;
pub mod draft;
pub mod fabric;
pub mod folder;
pub mod image;
pub mod input;
pub mod interrupt;
mod json;
pub mod measure;
mod memory;
pub mod output;
pub mod render;
pub mod report;
pub mod scene;
pub mod studio;
pub mod terminal;
mod threads;

pub use glam;

use args::{Arguments, Command};

/// How it went, where nothing failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Done, or what was looked at is fine.
    Done,
    /// What was looked at has errors.
    Faulty,
    /// What was looked at misses a threshold that the command line sets.
    BelowThreshold,
    /// The user interrupted it; what was done so far is written.
    Interrupted,
}

/// Does what the command line says.
///
/// # Errors
///
/// What was asked for could not be done; then no output was left behind. The messages of the chain,
/// outermost first, make one line: *where: what was found, expected what*.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    match &arguments.command {
        Command::Render(options) => command::render::run_or_watch(options),
        Command::Swatch(options) => command::swatch::run(options),
        Command::Bake(options) => command::bake::run(options),
        Command::Studio(options) => command::studio::run(options).map(|()| Outcome::Done),
        Command::Presets => command::presets::run().map(|()| Outcome::Done),
        Command::Plan(options) => command::plan::run(options).map(|()| Outcome::Done),
        Command::Eval(options) => command::eval::run(options).map(|()| Outcome::Done),
        Command::Measure(command) => command::measure::run(command),
        Command::Schema(options) => command::schema::run(*options).map(|()| Outcome::Done),
        Command::Draft(command) => command::draft::run(command),
        Command::Image(command) => command::image::run(command),
    }
}
