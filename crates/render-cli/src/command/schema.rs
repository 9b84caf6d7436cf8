//! `selvedge schema`: what a scene or a fabric may say.

use crate::{
    args::{Described, SchemaOptions},
    fabric,
    output::Sink,
    scene::file,
};

/// Writes the JSON Schema that `options` name to standard output.
///
/// # Errors
///
/// When standard output cannot be written.
pub fn run(options: SchemaOptions) -> anyhow::Result<()> {
    let schema = match options.of {
        Described::Scene => file::schema(),
        Described::Fabric => fabric::schema(),
    };
    let mut text = serde_json::to_string_pretty(&schema)?;
    text.push('\n');
    Sink::new(None)?.write(|out| out.write_all(text.as_bytes()))?;
    Ok(())
}
