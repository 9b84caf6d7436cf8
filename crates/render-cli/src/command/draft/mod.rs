//! `selvedge draft`: what a draft says, without cloth.

pub mod convert;
pub mod drawdown;
pub mod format;
pub mod info;
pub mod lint;

use crate::{Outcome, args::DraftCommand};

/// Does what the command line says about a draft.
///
/// # Errors
///
/// When a draft cannot be read or used, or the output cannot be written; then no output is left
/// behind.
pub fn run(command: &DraftCommand) -> anyhow::Result<Outcome> {
    match command {
        DraftCommand::Info(options) => info::run(options).map(|()| Outcome::Done),
        DraftCommand::Lint(options) => lint::run(options),
        DraftCommand::Drawdown(options) => drawdown::run(options).map(|()| Outcome::Done),
        DraftCommand::Format(options) => format::run(options).map(|()| Outcome::Done),
        DraftCommand::Convert(options) => convert::run(options).map(|()| Outcome::Done),
    }
}
