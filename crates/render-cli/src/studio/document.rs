//! What is shown: a fabric and a view of it, checked.

use std::{sync::Arc, time::Instant};

use selvedge_wif::Drawdown;
use selvedge_yarn_brdf::Cloth;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use super::{reply::Refusal, view::View};
use crate::{
    draft::DraftFile,
    fabric::{self, FabricSource},
};

/// A fabric and how it is shown.
#[derive(Debug)]
pub(super) struct Document {
    /// Which one, from 1.
    pub(super) revision: u64,
    /// The fabric with its draft.
    pub(super) source: FabricSource,
    /// Which thread lies on top where.
    pub(super) drawdown: Arc<Drawdown>,
    /// What both make: the same as of the document before where nothing of it has changed.
    pub(super) cloth: Arc<Cloth>,
    /// How it is shown.
    pub(super) view: View,
    /// When it was asked for.
    pub(super) accepted: Instant,
}

/// What a client sends.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object of a fabric and a view")]
pub(super) struct Posted {
    /// The fabric, without a draft if that stays.
    pub(super) fabric: Map<String, Value>,
    /// How it is shown.
    #[serde(default)]
    pub(super) view: View,
    /// What messages and pages call it, without a name what they do already.
    #[serde(default)]
    pub(super) name: Option<String>,
    /// Whether it is drawn to be looked at once, beside what is shown: other pages are not told.
    #[serde(default)]
    pub(super) aside: bool,
}

/// Most bytes of the name of a fabric.
const MAX_NAME: usize = 1024;

impl Posted {
    /// What `body` says.
    ///
    /// # Errors
    ///
    /// When it is something else.
    pub(super) fn read(body: &[u8]) -> Result<Self, Refusal> {
        let posted: Self = crate::json::parse(body, &|_| &[]).map_err(Refusal::wrong)?;
        posted.view.check().map_err(Refusal::wrong)?;
        let length = posted.name.as_ref().map_or(0, String::len);
        if length > MAX_NAME {
            let what = format_args!("name: found {length} bytes, expected at most {MAX_NAME}");
            return Err(Refusal::wrong(what));
        }
        Ok(posted)
    }
}

impl Document {
    /// The document of `source`.
    ///
    /// # Errors
    ///
    /// When it makes no cloth.
    pub(super) fn new(source: FabricSource, view: View, revision: u64) -> anyhow::Result<Self> {
        source.draft().draft()?;
        let drawdown = Arc::new(source.draft().drawdown()?);
        let cloth = Arc::new(source.cloth(&drawdown)?);
        Ok(Self { revision, source, drawdown, cloth, view, accepted: Instant::now() })
    }

    /// The document that `posted` makes of this one; its revision is the session's to give.
    ///
    /// # Errors
    ///
    /// When it makes no cloth.
    pub(super) fn changed(&self, posted: Posted, accepted: Instant) -> Result<Self, Refusal> {
        let Posted { fabric, view, name, .. } = posted;
        let name = name.as_deref().unwrap_or(self.source.name());
        let source = fabric::from_json(name, fabric, &self.source);
        let source = source.map_err(|error| Refusal::wrong(chain(&error)))?;
        let (drawdown, cloth) = if source.is_like(&self.source) {
            (Arc::clone(&self.drawdown), Arc::clone(&self.cloth))
        } else {
            let refuse = |error: anyhow::Error| {
                let diagnostics = diagnostics(source.draft());
                Refusal::wrong(format_args!("{error:#}")).with_diagnostics(diagnostics)
            };
            let drawdown = if std::ptr::eq(source.draft(), self.source.draft()) {
                Arc::clone(&self.drawdown)
            } else {
                let drawdown = source.draft().draft().and_then(|_| source.draft().drawdown());
                Arc::new(drawdown.map_err(|error| refuse(error.into()))?)
            };
            let cloth = source.cloth(&drawdown).map_err(|error| refuse(error.into()))?;
            (drawdown, Arc::new(cloth))
        };
        Ok(Self { revision: 0, source, drawdown, cloth, view, accepted })
    }

    /// What is told of it at once.
    pub(super) fn summary(&self) -> Value {
        let size = self.cloth.size() * 1e3 / self.cloth.scale;
        let title = self.source.draft().draft().map_or("", |draft| &draft.text.title);
        let is_swatch = self.view.kind.form().is_none();
        json!({
            "revision": self.revision,
            "name": self.source.name(),
            "title": title,
            "ends": self.drawdown.ends(),
            "picks": self.drawdown.picks(),
            "repeat_mm": [size.x, size.y],
            "pixels_per_mm": is_swatch.then(|| self.view.swatch().pixels_per_mm(self.view.size())),
            "warnings": self.source.unused(&self.drawdown),
            "diagnostics": diagnostics(self.source.draft()),
        })
    }
}

/// An error and its causes in a line.
pub(super) fn chain(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |error| error.source());
    causes.fold(error.to_string(), |line, cause| format!("{line}: {cause}"))
}

/// Most diagnostics that are told: whoever has more has no draft.
const MAX_DIAGNOSTICS: usize = 200;

/// What is odd about a draft, each with its place and its text of three lines.
pub(super) fn diagnostics(draft: &DraftFile) -> Vec<Value> {
    let located = draft.located().take(MAX_DIAGNOSTICS);
    located
        .map(|(diagnostic, place)| {
            json!({
                "severity": diagnostic.severity.to_string(),
                "code": diagnostic.code.as_str(),
                "line": place.map(|place| place.line),
                "column": place.map(|place| place.column),
                "text": draft.describe(diagnostic),
            })
        })
        .collect()
}
