//! From one plan to the other: lift plan, or tie-up with treadling.

use std::collections::HashMap;

use crate::draft::{Draft, Plan};
use crate::sparse::Lists;

impl Draft {
    /// The same draft with a lift plan in place of tie-up and treadling; the drawdown is the
    /// same. A draft that weaves by a lift plan only loses a tie-up and treadling it may have.
    ///
    /// Shafts are in ascending order, without repetition. Takes memory in proportion to the
    /// shafts lifted over all picks, which can be as many as picks times shafts.
    #[must_use]
    pub fn to_liftplan(&self) -> Self {
        let mut draft = self.clone();
        if self.plan() == Some(Plan::TieUp) {
            draft.liftplan = Lists::default();
            for (pick, treadles) in self.treadling.iter() {
                let lifted = treadles.iter().flat_map(|&treadle| self.tieup.get(treadle));
                draft.liftplan.set(pick, &as_set(lifted));
            }
        }
        draft.tieup = Lists::default();
        draft.treadling = Lists::default();
        draft.treadles = 0;
        draft
    }

    /// The same draft with a tie-up and a treadling in place of the lift plan; the drawdown is
    /// the same. A draft without a lift plan stays as it is.
    ///
    /// The tie-up is the smallest with one treadle to a pick: a treadle for each distinct set
    /// of shafts, in the order of first use. (Pressing several treadles together may do with
    /// fewer; to find the least is a hard problem, NP-complete as set basis.)
    #[must_use]
    pub fn to_tieup(&self) -> Self {
        let mut draft = self.clone();
        if self.plan() != Some(Plan::LiftPlan) {
            return draft;
        }
        draft.liftplan = Lists::default();
        draft.tieup = Lists::default();
        draft.treadling = Lists::default();
        draft.treadles = 0;
        let mut treadle_of: HashMap<Vec<u32>, u32> = HashMap::new();
        for (pick, shafts) in self.liftplan.iter() {
            let lifted = as_set(shafts);
            // On a sinking shed no treadle means that every shaft rises, as an empty lift does.
            if lifted.is_empty() {
                continue;
            }
            let treadle = *treadle_of.entry(lifted).or_insert_with_key(|lifted| {
                draft.tieup.set(draft.treadles, lifted);
                draft.treadles += 1;
                draft.treadles - 1
            });
            draft.treadling.set(pick, &[treadle]);
        }
        if draft.treadling.is_empty() {
            // A plan that lifts nothing is still a plan.
            draft.treadles = 1;
            draft.tieup.set(0, &[]);
            draft.treadling.set(0, &[]);
        }
        draft
    }
}

fn as_set<'a>(shafts: impl IntoIterator<Item = &'a u32>) -> Vec<u32> {
    let mut shafts: Vec<u32> = shafts.into_iter().copied().collect();
    shafts.sort_unstable();
    shafts.dedup();
    shafts
}
