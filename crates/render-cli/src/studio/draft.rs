//! A draft as weavers draw it, for the page.

use selvedge_wif::{Lists, Plan};
use serde_json::{Value, json};

use super::{cloth::srgb, document::Document};

/// Most crossings of a drawdown that is drawn.
const MAX_CROSSINGS: usize = 1 << 22;

/// Threading, tie-up, treadling and drawdown; threads, shafts and treadles count from 1.
pub(super) fn describe(document: &Document) -> Value {
    let Document { cloth, drawdown, source, .. } = document;
    let Ok(draft) = source.draft().draft() else { return Value::Null };
    let plan = draft.plan().map(|plan| match plan {
        Plan::LiftPlan => "liftplan",
        Plan::TieUp => "tieup",
    });
    let lists = |lists: &Lists, count: u32| {
        let numbers = |index| lists.get(index).iter().map(|item| item + 1).collect::<Vec<_>>();
        (!lists.is_empty()).then(|| (0..count).map(numbers).collect::<Vec<_>>())
    };
    let (ends, picks) = (drawdown.ends(), drawdown.picks());
    let row = |pick: usize| -> String {
        (0..ends).map(|end| if drawdown.warp_on_top(end, pick) { '1' } else { '0' }).collect()
    };
    let rows = (ends.saturating_mul(picks) <= MAX_CROSSINGS).then(|| (0..picks).map(row));
    let colors = |yarns: &[u16]| -> Vec<_> {
        yarns.iter().map(|&yarn| srgb(cloth.yarns[usize::from(yarn)].color)).collect()
    };
    json!({
        "revision": document.revision,
        "title": draft.text.title,
        "author": draft.text.author,
        "ends": ends,
        "picks": picks,
        "shafts": draft.shafts,
        "treadles": draft.treadles,
        "rising_shed": draft.rising_shed,
        "plan": plan,
        "threading": lists(&draft.threading, draft.warp.count),
        "tieup": lists(&draft.tieup, draft.treadles),
        "treadling": lists(&draft.treadling, draft.weft.count),
        "liftplan": lists(&draft.liftplan, draft.weft.count),
        "end_colors": colors(&cloth.end_yarns),
        "pick_colors": colors(&cloth.pick_yarns),
        "end_yarns": cloth.end_yarns,
        "pick_yarns": cloth.pick_yarns,
        "drawdown": rows.map(Iterator::collect::<Vec<_>>),
    })
}
