//! The `selvedge` program: arguments in, exit code out; all else is in the library.

use std::{
    io::{self, Write},
    process::ExitCode,
};

use clap::Parser;
use selvedge_cli::args::Arguments;

/// 0: done. 1: failed, with one message on stderr. 2: the command line is wrong, as told by clap.
fn main() -> ExitCode {
    match selvedge_cli::run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Where nobody listens, the exit code still tells.
            let _ = writeln!(io::stderr(), "error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
