//! `selvedge presets`: the fabrics that are compiled in.

use crate::{
    fabric::{self, PRESET, presets::PRESETS},
    output::Sink,
};

/// Writes a line for each preset: its name, its weave, and what it is.
///
/// # Errors
///
/// When standard output cannot be written.
pub fn run() -> anyhow::Result<()> {
    let mut lines = Vec::new();
    for preset in PRESETS {
        let name = format!("{PRESET}{}", preset.name);
        let source = fabric::read(name.as_ref())?;
        let drawdown = source.draft().drawdown()?;
        let size = source.cloth(&drawdown)?.size() * 1e3;
        let title = &source.draft().draft()?.text.title;
        lines.push(format!(
            "{name:<26}{:>4} x {:<4}{:>7.2} x {:<7.2} mm  {title}\n",
            drawdown.ends(),
            drawdown.picks(),
            size.x,
            size.y
        ));
    }
    Sink::new(None)?
        .write(|out| lines.iter().try_for_each(|line| out.write_all(line.as_bytes())))?;
    Ok(())
}
