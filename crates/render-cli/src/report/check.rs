//! Thresholds, and whether they are kept.

use serde_json::{Value, json};

use super::{Cell, Table, number::significant};

/// A threshold, and what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    what: String,
    found: f64,
    limit: Limit,
}

/// What a number is held against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// The greatest that is good.
    AtMost(f64),
    /// The least that is good.
    AtLeast(f64),
}

impl Check {
    /// Holds `found` against `limit`; `what` says what it is, and of which fabric.
    pub fn new(what: impl Into<String>, found: f64, limit: Limit) -> Self {
        Self { what: what.into(), found, limit }
    }

    /// Whether it is within its limit, which NaN is not.
    pub fn is_kept(&self) -> bool {
        match self.limit {
            Limit::AtMost(most) => self.found <= most,
            Limit::AtLeast(least) => self.found >= least,
        }
    }

    pub(super) fn to_json(&self) -> Value {
        let (key, bound) = match self.limit {
            Limit::AtMost(most) => ("at_most", most),
            Limit::AtLeast(least) => ("at_least", least),
        };
        // JSON has no number for what is not finite.
        let found = if self.found.is_finite() { json!(self.found) } else { Value::Null };
        json!({ "what": self.what, "found": found, key: bound, "kept": self.is_kept() })
    }

    /// A row for each of `checks`.
    pub(super) fn table(checks: &[Self]) -> Table {
        let mut table = Table::new("checks", ["check", "found", "expected", ""]);
        for check in checks {
            let (words, bound) = match check.limit {
                Limit::AtMost(most) => ("at most", most),
                Limit::AtLeast(least) => ("at least", least),
            };
            table.row([
                check.what.as_str().into(),
                check.found.into(),
                Cell::from(format!("{words} {}", significant(bound, 4))),
                if check.is_kept() { "kept" } else { "missed" }.into(),
            ]);
        }
        table
    }
}
