//! Reports: what a command has measured, as a page for people and as numbers for programs.
//!
//! ```text
//!             ┌──▶ report.html   one page that needs no other file: tables, plots, pictures, light or dark
//! Report ─────┼──▶ report.json   checks, facts and tables
//!             ├──▶ NAME.csv      each table and each plot
//!             └──▶ NAME.svg, NAME.png
//! ```

mod check;
mod html;
mod number;
mod plot;
mod table;

use std::env;

use serde_json::{Map, Value, json};

use crate::{
    Outcome,
    folder::{Folder, FolderError},
    image::{EncodeError, Format, Picture},
    output::Sink,
};

pub use self::{
    check::{Check, Limit},
    number::significant,
    plot::{Axis, Plot, Series},
    table::{Cell, Table},
};

/// The file of a report's folder that names all others.
pub const INDEX: &str = "report.json";

/// What a command has measured, in the order in which it is told.
///
/// Names of tables, plots and pictures are those of their files, without an extension, and differ.
///
/// # Examples
///
/// ```
/// use selvedge_cli::{
///     Outcome,
///     folder::Folder,
///     report::{Axis, Check, INDEX, Limit, Plot, Report, Series, Table},
/// };
///
/// let place = tempfile::tempdir()?;
/// let folder = Folder::new(&place.path().join("furnace"), INDEX)?;
///
/// let mut report = Report::new("White furnace", "How much white cloth reflects.");
/// let mut table = Table::new("albedo", ["fabric", "albedo"]);
/// table.row(["denim".into(), 0.97.into()]);
/// report.table(table);
/// let plot = Plot::new("over-angle", "Albedo over angle", Axis::new("θ, °"), Axis::new("albedo"));
/// report.plot(plot.with(Series::line("denim", vec![[0.0, 0.97], [80.0, 0.98]])));
/// report.check(Check::new("denim: greatest albedo", 0.98, Limit::AtMost(1.001)));
///
/// assert_eq!(report.write(&folder)?, Outcome::Done);
/// for name in ["report.html", "report.json", "albedo.csv", "over-angle.csv", "over-angle.svg"] {
///     assert!(place.path().join("furnace").join(name).is_file(), "{name}");
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Report {
    title: String,
    lead: String,
    command: String,
    blocks: Vec<Block>,
    checks: Vec<Check>,
    facts: Map<String, Value>,
}

/// A part of a report.
#[derive(Clone, Debug)]
enum Block {
    Heading(String),
    Paragraph(String),
    Table(Table),
    /// A table of which the page only says what it is.
    Data(String, Table),
    Plots(Vec<Plot>),
    Pictures(Vec<Figure>),
}

/// A picture of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    name: String,
    caption: String,
    size: [u32; 2],
    png: Vec<u8>,
}

impl Figure {
    /// `picture` as its [`Picture::view`] shows it; the caption is what one sees on it.
    ///
    /// # Errors
    ///
    /// When it does not fit a PNG.
    pub fn new(name: &str, caption: &str, picture: &Picture) -> Result<Self, EncodeError> {
        let size = picture.size();
        Ok(Self {
            name: name.to_owned(),
            caption: caption.to_owned(),
            size: [size.width(), size.height()],
            png: picture.encode(Format::Png)?,
        })
    }
}

impl Report {
    /// A report that begins with `title` and `lead`, a sentence that says what was measured. The command
    /// line that it tells is that of this process.
    pub fn new(title: &str, lead: &str) -> Self {
        let quoted = |word: String| {
            let is_plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
            let is_plain = !word.is_empty() && word.chars().all(is_plain);
            if is_plain { word } else { format!("'{}'", word.replace('\'', r"'\''")) }
        };
        let words = env::args_os().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
        let command =
            ["selvedge".to_owned()].into_iter().chain(words).collect::<Vec<_>>().join(" ");
        let facts = Map::from_iter([("version".to_owned(), json!(env!("CARGO_PKG_VERSION")))]);
        Self {
            title: title.to_owned(),
            lead: lead.to_owned(),
            command,
            blocks: Vec::new(),
            checks: Vec::new(),
            facts,
        }
    }

    /// Begins a section.
    pub fn heading(&mut self, text: &str) {
        self.blocks.push(Block::Heading(text.to_owned()));
    }

    /// Adds plain text, in which what stands between backticks is code.
    pub fn paragraph(&mut self, text: &str) {
        self.blocks.push(Block::Paragraph(text.to_owned()));
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) {
        self.blocks.push(Block::Table(table));
    }

    /// Adds a table that is too long for the page, which only names its file; `what` says what is in it.
    pub fn data(&mut self, what: &str, table: Table) {
        self.blocks.push(Block::Data(what.to_owned(), table));
    }

    /// Adds a plot.
    pub fn plot(&mut self, plot: Plot) {
        self.plots(vec![plot]);
    }

    /// Adds plots side by side, as far as there is room.
    pub fn plots(&mut self, plots: Vec<Plot>) {
        self.blocks.push(Block::Plots(plots));
    }

    /// Adds pictures side by side, as far as there is room.
    pub fn pictures(&mut self, figures: Vec<Figure>) {
        self.blocks.push(Block::Pictures(figures));
    }

    /// Adds a threshold and whether it is kept. All of them are told at the top of the page.
    pub fn check(&mut self, check: Check) {
        self.checks.push(check);
    }

    /// Adds something for programs alone, at the top of the JSON.
    pub fn fact(&mut self, name: &str, value: Value) {
        self.facts.insert(name.to_owned(), value);
    }

    /// Done, or [`Outcome::BelowThreshold`] if a check is missed.
    pub fn outcome(&self) -> Outcome {
        let is_kept = self.checks.iter().all(Check::is_kept);
        if is_kept { Outcome::Done } else { Outcome::BelowThreshold }
    }

    /// Writes the folder and returns [`Report::outcome`].
    ///
    /// # Errors
    ///
    /// As [`Folder::write`].
    pub fn write(&self, folder: &Folder) -> Result<Outcome, FolderError> {
        let mut files = vec![("report.html".to_owned(), html::page(self).into_bytes())];
        let mut tables = Map::new();
        for block in &self.blocks {
            match block {
                Block::Heading(_) | Block::Paragraph(_) => {}
                Block::Table(table) => {
                    files.push((format!("{}.csv", table.name()), table.to_csv().into_bytes()));
                    tables.insert(table.name().to_owned(), table.to_json());
                }
                Block::Data(_, table) => {
                    files.push((format!("{}.csv", table.name()), table.to_csv().into_bytes()));
                }
                Block::Plots(plots) => {
                    for plot in plots {
                        files.push((format!("{}.csv", plot.name()), plot.to_csv().into_bytes()));
                        files.push((format!("{}.svg", plot.name()), plot.to_svg().into_bytes()));
                    }
                }
                Block::Pictures(figures) => {
                    for figure in figures {
                        files.push((format!("{}.png", figure.name), figure.png.clone()));
                    }
                }
            }
        }
        let mut index = Map::from_iter([
            ("title".to_owned(), json!(self.title)),
            ("command".to_owned(), json!(self.command)),
            ("passes".to_owned(), json!(self.outcome() == Outcome::Done)),
        ]);
        index.extend(self.facts.clone());
        let checks: Vec<_> = self.checks.iter().map(Check::to_json).collect();
        index.insert("checks".to_owned(), json!(checks));
        index.insert("tables".to_owned(), Value::Object(tables));
        folder.write(index, &files)?;
        Ok(self.outcome())
    }

    /// Writes the folder, and to standard output a short table: the checks and, above them, `summary`.
    ///
    /// # Errors
    ///
    /// When either cannot be written.
    pub fn finish(&self, folder: &Folder, summary: &Table) -> anyhow::Result<Outcome> {
        let outcome = self.write(folder)?;
        let mut text = summary.to_text();
        if !self.checks.is_empty() {
            text.push('\n');
            text.push_str(&Check::table(&self.checks).to_text());
        }
        text.push_str(&format!("\n{}/report.html\n", folder.name().trim_end_matches('/')));
        Sink::Stdout.write(|out| out.write_all(text.as_bytes()))?;
        Ok(outcome)
    }
}
