//! The `selvedge` program: arguments in, exit code out; all else is in the library.

use std::process::ExitCode;

use clap::Parser;
use selvedge_cli::{Outcome, args::Arguments, interrupt::INTERRUPTED, output::tell};

/// 0: done. 1: failed, with one message on stderr, or errors found. 2: the command line is wrong, as
/// told by clap. 3: only a threshold that the command line sets is missed. 130: interrupted, as shells
/// say it of a program that SIGINT ends.
fn main() -> ExitCode {
    match selvedge_cli::run(&Arguments::parse()) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Faulty) => ExitCode::FAILURE,
        Ok(Outcome::BelowThreshold) => ExitCode::from(3),
        Ok(Outcome::Interrupted) => ExitCode::from(INTERRUPTED),
        Err(error) => {
            tell(format_args!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}
