//! `selvedge draft convert`: the same cloth by another plan.

use selvedge_wif::{DrawdownError, Plan};

use super::format::rewrite;
use crate::args::ConvertOptions;

/// Rewrites the draft with the plan that `options` asks for.
///
/// # Errors
///
/// When the draft cannot be read, has errors or no plan, or the output cannot be written.
pub fn run(options: &ConvertOptions) -> anyhow::Result<()> {
    rewrite(&options.rewrite, |source, draft| {
        if draft.plan().is_none() {
            return Err(source.no_drawdown(DrawdownError::NoPlan));
        }
        Ok(match options.plan() {
            Plan::LiftPlan => draft.to_liftplan(),
            Plan::TieUp => draft.to_tieup(),
        })
    })
}
