//! A weaving draft: what a file says, typed, with what it leaves open filled in.

use crate::color::{Palette, Rgb8, default_color};
use crate::sparse::{Lists, Sparse};

/// One of the two sets of threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// The ends, which run along the cloth and hang on the shafts.
    Warp,
    /// The picks, which the weaver throws one after the other.
    Weft,
}

/// A weaving draft.
///
/// Threads, shafts and treadles are counted from 0 here: index 0 is what the file and the
/// weaver call number 1. Colours and symbols keep the number the file gives them, since those
/// numbers are names, not positions.
///
/// Lists and per-thread values are sparse, as in the file: an absent end is on no shaft, an
/// absent treadle ties none, an absent pick lifts nothing, and an absent value is that of the
/// whole [side](ThreadSet). A plan that is [empty](Lists::is_empty) is absent.
///
/// # Examples
///
/// ```
/// use selvedge_wif::{Draft, Lists};
///
/// // Plain weave on two shafts and two treadles.
/// let mut draft = Draft::new(4, 4);
/// draft.shafts = 2;
/// draft.treadles = 2;
/// let alternate = |n| (0..n).map(|i| (i, if i % 2 == 0 { &[0][..] } else { &[1] }));
/// draft.threading = alternate(4).collect();
/// draft.tieup = alternate(2).collect();
/// draft.treadling = alternate(4).collect();
/// let drawdown = draft.drawdown()?;
/// assert!(drawdown.warp_on_top(0, 0) && !drawdown.warp_on_top(1, 0));
/// # Ok::<(), selvedge_wif::DrawdownError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Draft {
    /// Who wrote the file.
    pub source: Source,
    /// Title, author and how to reach the author.
    pub text: Text,
    /// The notes, line by line.
    pub notes: Vec<String>,
    /// Number of shafts; at least one more than any that is named.
    pub shafts: u32,
    /// Number of treadles; at least one more than any that is named; 0 for a lift plan alone.
    pub treadles: u32,
    /// Whether the listed shafts rise. If not, they sink and all others rise.
    pub rising_shed: bool,
    /// The ends.
    pub warp: ThreadSet,
    /// The picks.
    pub weft: ThreadSet,
    /// The colour table.
    pub palette: Palette,
    /// Shafts by end.
    pub threading: Lists,
    /// Shafts by treadle.
    pub tieup: Lists,
    /// Treadles by pick; several are pressed together.
    pub treadling: Lists,
    /// Shafts by pick.
    pub liftplan: Lists,
    /// Private and unknown sections, in the order of the file.
    pub foreign: Vec<ForeignSection>,
}

impl Draft {
    /// A draft with this many ends and picks and nothing else: no shafts, no plan, no colours.
    pub fn new(ends: u32, picks: u32) -> Self {
        Self {
            source: Source::default(),
            text: Text::default(),
            notes: Vec::new(),
            shafts: 0,
            treadles: 0,
            rising_shed: true,
            warp: ThreadSet::new(ends),
            weft: ThreadSet::new(picks),
            palette: Palette::default(),
            threading: Lists::default(),
            tieup: Lists::default(),
            treadling: Lists::default(),
            liftplan: Lists::default(),
            foreign: Vec::new(),
        }
    }

    /// The threads of one side.
    pub fn side(&self, side: Side) -> &ThreadSet {
        match side {
            Side::Warp => &self.warp,
            Side::Weft => &self.weft,
        }
    }

    /// The plan that weaves by default: the lift plan where there is one, else tie-up and
    /// treadling, else none.
    pub fn plan(&self) -> Option<Plan> {
        [Plan::LiftPlan, Plan::TieUp].into_iter().find(|&plan| self.has(plan))
    }

    pub(crate) fn has(&self, plan: Plan) -> bool {
        match plan {
            Plan::LiftPlan => !self.liftplan.is_empty(),
            Plan::TieUp => !self.tieup.is_empty() && !self.treadling.is_empty(),
        }
    }

    /// Colour, pitch and diameter of thread `index` of a side (0 is number 1), with the
    /// defaults of the side filled in.
    pub fn thread(&self, side: Side, index: u32) -> Thread {
        let set = self.side(side);
        let color_number = self.color_number(side, index);
        Thread {
            color: self.color(side, color_number),
            color_number,
            pitch: set.metres(set.spacings.get(index), set.spacing),
            diameter: set.metres(set.thicknesses.get(index), set.thickness),
        }
    }

    /// The number of the colour of a thread; 0 means none unless the table has a colour 0.
    fn color_number(&self, side: Side, index: u32) -> Option<u32> {
        let set = self.side(side);
        let named = |number: &u32| *number > 0 || self.palette.colors.get(0).is_some();
        let own = set.colors.get(index).copied().filter(named);
        own.or_else(|| set.color.map(|color| color.number).filter(named))
    }

    /// Whether the file gives any colour.
    pub(crate) fn has_colors(&self) -> bool {
        let sides = [&self.warp, &self.weft];
        !self.palette.colors.is_empty() || sides.iter().any(|set| set.has_inline_color())
    }

    fn color(&self, side: Side, number: Option<u32>) -> Rgb8 {
        let inline = || {
            let default = self.side(side).color.filter(|color| Some(color.number) == number)?;
            default.rgb.map(|rgb| self.palette.scale(rgb))
        };
        let from_table = number.and_then(|number| self.palette.color(number));
        from_table.or_else(inline).unwrap_or_else(|| default_color(side))
    }
}

/// What says which shafts rise on each pick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Plan {
    /// Shafts by pick.
    LiftPlan,
    /// Treadles by pick, and shafts by treadle.
    TieUp,
}

/// Who wrote a file: the section `[WIF]`.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Source {
    /// The program; empty if not given.
    pub program: String,
    /// Its version; empty if not given.
    pub version: String,
    /// By the format the date of its specification, in practice often that of saving.
    pub date: String,
    /// By the format the address of its authors.
    pub developers: String,
}

impl Default for Source {
    /// No program; the date and developers that the format prescribes.
    fn default() -> Self {
        Self {
            program: String::new(),
            version: String::new(),
            date: "April 20, 1997".into(),
            developers: "wif@mhsoft.com".into(),
        }
    }
}

/// The section `[TEXT]`; a field that is not given is empty.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Text {
    /// Name of the draft.
    pub title: String,
    /// Who designed it.
    pub author: String,
    /// Postal address.
    pub address: String,
    /// Electronic mail.
    pub email: String,
    /// Telephone.
    pub telephone: String,
    /// Fax.
    pub fax: String,
}

/// The ends or the picks: their number, what holds for all, and what holds for single ones.
///
/// Lengths are in `units`; see [`Draft::thread`] for metres.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ThreadSet {
    /// How many threads there are.
    pub count: u32,
    /// Colour of the threads that have none of their own.
    pub color: Option<DefaultColor>,
    /// Symbol of the threads that have none of their own.
    pub symbol: Option<Symbol>,
    /// Number in `symbol_table` for the threads that have none of their own.
    pub symbol_number: Option<u32>,
    /// Unit of the lengths below.
    pub units: Units,
    /// Space a thread takes, from its centre to that of the next; the width of the cloth is
    /// the sum of these.
    pub spacing: Option<f64>,
    /// Diameter of the yarn.
    pub thickness: Option<f64>,
    /// Magnification of the spacing on a screen.
    pub spacing_zoom: Option<u32>,
    /// Magnification of the thickness on a screen.
    pub thickness_zoom: Option<u32>,
    /// Number of the colour by thread.
    pub colors: Sparse<u32>,
    /// Number of the symbol by thread.
    pub symbols: Sparse<u32>,
    /// Spacing by thread.
    pub spacings: Sparse<f64>,
    /// Thickness by thread.
    pub thicknesses: Sparse<f64>,
    /// Magnification of the spacing by thread.
    pub spacing_zooms: Sparse<u32>,
    /// Magnification of the thickness by thread.
    pub thickness_zooms: Sparse<u32>,
    /// Symbols by their number.
    pub symbol_table: Sparse<Symbol>,
}

impl ThreadSet {
    /// This many threads about which nothing else is said.
    pub fn new(count: u32) -> Self {
        Self {
            count,
            color: None,
            symbol: None,
            symbol_number: None,
            units: Units::Centimeters,
            spacing: None,
            thickness: None,
            spacing_zoom: None,
            thickness_zoom: None,
            colors: Sparse::default(),
            symbols: Sparse::default(),
            spacings: Sparse::default(),
            thicknesses: Sparse::default(),
            spacing_zooms: Sparse::default(),
            thickness_zooms: Sparse::default(),
            symbol_table: Sparse::default(),
        }
    }

    /// Whether the colour of all threads is given in place rather than by its number alone.
    pub(crate) fn has_inline_color(&self) -> bool {
        self.color.is_some_and(|color| color.rgb.is_some())
    }

    /// The length of one thread in metres: its own, else that of all; 0 counts as not given.
    fn metres(&self, own: Option<&f64>, all: Option<f64>) -> Option<f64> {
        let given = |length: &f64| *length > 0.0;
        let length = own.copied().filter(given).or(all.filter(given))?;
        Some(length * self.units.metres())
    }
}

/// The colour of threads that have none of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DefaultColor {
    /// Its number in the colour table.
    pub number: u32,
    /// Its components in the range of the palette, for a file without a table.
    pub rgb: Option<[u32; 3]>,
}

/// Unit of lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Units {
    /// A tenth of a point: 1/720 in.
    Decipoints,
    /// 25.4 mm.
    Inches,
    /// 10 mm.
    Centimeters,
}

impl Units {
    /// The unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Decipoints => 0.0254 / 720.0,
            Self::Inches => 0.0254,
            Self::Centimeters => 0.01,
        }
    }

    /// The unit as the format writes it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Decipoints => "Decipoints",
            Self::Inches => "Inches",
            Self::Centimeters => "Centimeters",
        }
    }
}

/// A symbol that stands for a thread in a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Symbol {
    /// A character.
    Char(char),
    /// The code of a character in the writer's code page.
    Code(u8),
}

/// A section whose content is not the format's: `[PRIVATE …]`, or one a program made up.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ForeignSection {
    /// Its name, with inner white space folded to one space.
    pub name: String,
    /// Its lines as they stand, joined by `\n`, without blank lines at the end.
    pub text: String,
}

/// What a renderer needs to know about one thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thread {
    /// Its colour; a default where the file gives none.
    pub color: Rgb8,
    /// The number of the colour, as in the file.
    pub color_number: Option<u32>,
    /// The space it takes from its centre to that of the next, in metres, if the file says.
    pub pitch: Option<f64>,
    /// The diameter of its yarn in metres, if the file says.
    pub diameter: Option<f64>,
}

impl Thread {
    /// Equal for equal threads; a length is told by its bits.
    pub(crate) fn key(&self) -> impl std::hash::Hash + Eq + use<> {
        (
            self.color,
            self.color_number,
            self.pitch.map(f64::to_bits),
            self.diameter.map(f64::to_bits),
        )
    }
}
