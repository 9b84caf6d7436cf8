//! Reads and writes WIF 1.1 weaving drafts and computes their drawdown.
//!
//! WIF, the Weaving Information File, is the text format in which weaving programs exchange
//! drafts. A draft says on which shafts each end (warp thread) hangs and which shafts rise for
//! each pick (weft thread): directly, in a lift plan, or through a tie-up of shafts to treadles
//! and the order in which the treadles are pressed. From that follows the drawdown: which
//! thread lies on top at each crossing.
//!
//! The data goes one way:
//!
//! ```text
//! bytes ──▶ lines ──▶ sections (Document) ──▶ Draft ──▶ Drawdown
//! ```
//!
//! # Examples
//!
//! ```
//! let file = "\
//! [WEAVING]
//! Shafts=2
//! [WARP]
//! Threads=4
//! [WEFT]
//! Threads=2
//! [THREADING]
//! 1=1
//! 2=2
//! 3=1
//! 4=2
//! [LIFTPLAN]
//! 1=1
//! 2=2
//! ";
//! let parse = selvedge_wif::parse(file.as_bytes());
//! for diagnostic in &parse.diagnostics {
//!     eprintln!("{}", diagnostic.display(file.as_bytes()));
//! }
//! let drawdown = parse.draft.expect("has threads and a plan").drawdown()?;
//! let first: Vec<bool> = (0..4).map(|end| drawdown.warp_on_top(end, 0)).collect();
//! assert_eq!(first, [true, false, true, false]);
//! # Ok::<(), selvedge_wif::DrawdownError>(())
//! ```
//!
//! # Numbering
//!
//! Files and weavers count threads, shafts and treadles from 1; this crate counts them from 0.
//! Index 0 is number 1. Messages of [`Diagnostic`]s use the numbers of the file. Colours and
//! symbols keep their numbers, which are names.
//!
//! # Leniency
//!
//! Most WIF files break the letter of the format. [`parse()`] reads all it can and says in a
//! [`Diagnostic`] what it assumed; [`Options::with_strict`] makes it refuse instead. Each choice
//! is explained in `docs/dialects.md`.

mod color;
mod convert;
mod diagnostic;
mod document;
mod draft;
mod drawdown;
mod excerpt;
pub mod limits;
mod parse;
mod span;
mod sparse;
mod weave;
mod write;

/// The README, whose example is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use color::{DEFAULT_WARP_COLOR, DEFAULT_WEFT_COLOR, Palette, Rgb8};
pub use diagnostic::{Code, Diagnostic, Severity};
pub use document::{Content, Document, EditError, Line, Section};
pub use draft::{
    DefaultColor, Draft, ForeignSection, Plan, Side, Source, Symbol, Text, Thread, ThreadSet, Units,
};
pub use drawdown::{Drawdown, DrawdownError, DrawdownOptions};
pub use excerpt::Excerpt;
pub use parse::text::Encoding;
pub use parse::{Options, Parse, parse, parse_with};
pub use span::{Location, Span};
pub use sparse::{Lists, Sparse};
pub use weave::{Hand, Weave};
