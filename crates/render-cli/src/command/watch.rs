//! `selvedge render --watch`: again whenever what is drawn changes.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::Ordering,
    thread,
    time::{Duration, SystemTime},
};

use super::render;
use crate::{Outcome, args::RenderCommand, fabric, interrupt, output::tell};

/// Time between two looks at the files.
const TICK: Duration = Duration::from_millis(200);

/// What a file looked like: when it was written, and how long it was. `None` where there is none.
type Stamp = Option<(SystemTime, u64)>;

/// Renders what `command` names, and again whenever its file or one that it names changes, until
/// Ctrl-C.
///
/// Files are drawn once they have stayed as they are from one look to the next. One that is not sound
/// all the same, as it may be while it is written, is told and waited for.
///
/// # Errors
///
/// When there is nothing to watch.
pub(super) fn run(command: &RenderCommand) -> anyhow::Result<Outcome> {
    let input = &command.render.input;
    if !input.is_file() {
        anyhow::bail!("{}: found no file, expected one that can change", input.display());
    }
    let stop = interrupt::flag();
    loop {
        let files = files(input);
        let before = stamps(&files);
        if let Err(error) = render::run(command) {
            tell(format_args!("error: {error:#}"));
        }
        let mut last = before.clone();
        loop {
            if stop.load(Ordering::Relaxed) {
                return Ok(Outcome::Interrupted);
            }
            thread::sleep(TICK);
            let now = stamps(&files);
            if now != before && now == last {
                break;
            }
            last = now;
        }
    }
}

/// The files that `input` is made of, as far as it can be read.
fn files(input: &Path) -> Vec<PathBuf> {
    let others = fabric::read(input).map_or_else(|_| Vec::new(), |source| source.files(input));
    [input.to_owned()].into_iter().chain(others).collect()
}

fn stamps(files: &[PathBuf]) -> Vec<Stamp> {
    let stamp = |path: &PathBuf| {
        let metadata = fs::metadata(path).ok()?;
        Some((metadata.modified().ok()?, metadata.len()))
    };
    files.iter().map(stamp).collect()
}
