//! The `selvedge` program: arguments in, exit code out; all else is in the library.

use std::{hint::black_box, process::ExitCode};

use clap::Parser;
use selvedge_cli::{Outcome, args::Arguments, interrupt::INTERRUPTED, output::tell};

/// 0: done. 1: failed, with one message on stderr, or errors found. 2: the command line is wrong, as
/// told by clap. 3: only a threshold that the command line sets is missed. 130: interrupted, as shells
/// say it of a program that SIGINT ends.
fn main() -> ExitCode {
    keep_memory();
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

/// Has the allocator of the GNU C library keep up to twice this memory that is free, in bytes.
///
/// Batches of points come and go at every surface, on every thread. Whenever more than 128 KiB are free it gives them
/// back to the system, which took a fifth of the time of a swatch; but once a larger block has come and gone, it keeps
/// twice as much (mallopt(3), `M_MMAP_THRESHOLD`). Other allocators make nothing of this.
fn keep_memory() {
    const BLOCK: usize = 8 << 20;
    drop(black_box(Vec::<u8>::with_capacity(BLOCK)));
}
