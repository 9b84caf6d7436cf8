//! `selvedge draft format`: the draft in its canonical form.

use selvedge_wif::{Code, Diagnostic, Draft, Severity};

use crate::{
    args::RewriteOptions,
    draft::{self, DraftError, DraftFile},
    output::{Sink, tell},
};

/// Rewrites the draft as [`Draft::to_wif`] does.
///
/// # Errors
///
/// When the draft cannot be read or has errors, or the output cannot be written.
pub fn run(options: &RewriteOptions) -> anyhow::Result<()> {
    rewrite(options, |_, draft| Ok(draft.clone()))
}

/// Writes what `change` makes of the draft, in canonical form, and tells on stderr what of the file
/// that leaves out unless `options.quiet`. A file that is in place already is not touched.
pub(super) fn rewrite(
    options: &RewriteOptions,
    change: impl FnOnce(&DraftFile, &Draft) -> Result<Draft, DraftError>,
) -> anyhow::Result<()> {
    let sink = Sink::new(options.output.as_deref())?;
    let source = draft::read(&options.draft)?;
    let text = change(&source, source.sound_draft()?)?.to_wif();
    if !options.quiet {
        losses(&source).for_each(tell);
    }
    if options.in_place && text.as_bytes() == source.parse().document.as_bytes() {
        return Ok(());
    }
    sink.write(|out| out.write_all(text.as_bytes()))?;
    Ok(())
}

/// What stands in the file and not in its canonical form, as messages: comments, and what the
/// parser skipped.
fn losses(source: &DraftFile) -> impl Iterator<Item = String> {
    let parse = source.parse();
    let mut comments = parse.document.comments();
    let comments = comments.next().map(|first| {
        let line = first.locate(parse.document.as_bytes()).line;
        let what = match comments.count() {
            0 => "this comment is".to_owned(),
            others => format!("this comment and {others} more are"),
        };
        format!("warning: {}: line {line}: {what} left out", source.name())
    });
    let is_loss = |diagnostic: &&Diagnostic| {
        diagnostic.severity >= Severity::Warning || diagnostic.code == Code::UnknownKey
    };
    let skipped = parse.diagnostics.iter().filter(is_loss);
    comments.into_iter().chain(skipped.map(|diagnostic| source.describe(diagnostic)))
}
