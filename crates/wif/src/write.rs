//! `Draft` to text in one canonical order.

use std::fmt::{self, Write};

use crate::draft::{DefaultColor, Draft, Symbol, ThreadSet};
use crate::parse::name::Name;
use crate::sparse::{Lists, Sparse};

impl Draft {
    /// The draft as a WIF 1.1 file: UTF-8, lines ended by LF, `[WIF]` and `[CONTENTS]` first,
    /// then the sections that describe, then the lists; every count written out.
    ///
    /// Reading it back gives this draft, as long as the draft is one a file can express: at
    /// least one end and one pick, shafts and treadles within their numbers, lengths finite and
    /// not negative, texts without line ends or white space around them. A line end in a text
    /// is written as a space.
    ///
    /// # Examples
    ///
    /// ```
    /// let untidy = b"[weft]\nthreads=1\n[warp]\nthreads = 1";
    /// let draft = selvedge_wif::parse(untidy).draft.unwrap();
    /// let text = draft.to_wif();
    /// assert!(text.starts_with("[WIF]\nVersion=1.1\n"));
    /// assert_eq!(selvedge_wif::parse(text.as_bytes()).draft.unwrap(), draft);
    /// ```
    pub fn to_wif(&self) -> String {
        let mut body = String::new();
        let mut contents = String::new();
        for &name in Name::ALL {
            let start = body.len();
            header(&mut body, name.as_str());
            let written = body.len();
            self.section(&mut body, name);
            if body.len() == written {
                body.truncate(start);
            } else {
                line(&mut contents, name.as_str(), true);
            }
        }
        for section in &self.foreign {
            header(&mut body, &section.name);
            if !section.text.is_empty() {
                body.push_str(&section.text);
                body.push('\n');
            }
            if is_key(&section.name) {
                line(&mut contents, &section.name, true);
            }
        }

        let mut text = String::from("[WIF]\n");
        self.source(&mut text);
        header(&mut text, Name::Contents.as_str());
        text + &contents + &body
    }

    fn source(&self, out: &mut String) {
        line(out, "Version", "1.1");
        line(out, "Date", one_line(&self.source.date));
        line(out, "Developers", one_line(&self.source.developers));
        line(out, "Source Program", one_line(&self.source.program));
        text(out, "Source Version", &self.source.version);
    }

    /// The lines of one section; none for a section that says nothing.
    fn section(&self, out: &mut String, name: Name) {
        match name {
            Name::Wif | Name::Contents => {}
            Name::Text => self.text(out),
            Name::Notes => {
                for (number, note) in (1..).zip(&self.notes) {
                    line(out, number, one_line(note));
                }
            }
            Name::Weaving => {
                line(out, "Shafts", self.shafts);
                line(out, "Treadles", self.treadles);
                line(out, "Rising Shed", self.rising_shed);
            }
            Name::Warp => self.warp.settings(out),
            Name::Weft => self.weft.settings(out),
            Name::ColorPalette => self.color_palette(out),
            Name::WarpSymbolPalette => symbol_palette(out, &self.warp.symbol_table),
            Name::WeftSymbolPalette => symbol_palette(out, &self.weft.symbol_table),
            Name::ColorTable => {
                for (number, [red, green, blue]) in self.palette.colors.iter() {
                    line(out, number, format_args!("{red},{green},{blue}"));
                }
            }
            Name::WarpSymbolTable => values(out, 0, &self.warp.symbol_table),
            Name::WeftSymbolTable => values(out, 0, &self.weft.symbol_table),
            Name::Threading => lists(out, &self.threading),
            Name::Tieup => lists(out, &self.tieup),
            Name::Treadling => lists(out, &self.treadling),
            Name::Liftplan => lists(out, &self.liftplan),
            Name::WarpColors => values(out, 1, &self.warp.colors),
            Name::WeftColors => values(out, 1, &self.weft.colors),
            Name::WarpSymbols => values(out, 1, &self.warp.symbols),
            Name::WeftSymbols => values(out, 1, &self.weft.symbols),
            Name::WarpSpacing => values(out, 1, &self.warp.spacings),
            Name::WeftSpacing => values(out, 1, &self.weft.spacings),
            Name::WarpThickness => values(out, 1, &self.warp.thicknesses),
            Name::WeftThickness => values(out, 1, &self.weft.thicknesses),
            Name::WarpSpacingZoom => values(out, 1, &self.warp.spacing_zooms),
            Name::WeftSpacingZoom => values(out, 1, &self.weft.spacing_zooms),
            Name::WarpThicknessZoom => values(out, 1, &self.warp.thickness_zooms),
            Name::WeftThicknessZoom => values(out, 1, &self.weft.thickness_zooms),
        }
    }

    fn text(&self, out: &mut String) {
        text(out, "Title", &self.text.title);
        text(out, "Author", &self.text.author);
        text(out, "Address", &self.text.address);
        text(out, "EMail", &self.text.email);
        text(out, "Telephone", &self.text.telephone);
        text(out, "FAX", &self.text.fax);
    }

    fn color_palette(&self, out: &mut String) {
        if !self.has_colors() {
            return;
        }
        // The format wants at least one entry even where the only colours are those of the sides.
        line(out, "Entries", self.palette.colors.last_index().unwrap_or(1));
        let (low, high) = self.palette.range;
        line(out, "Range", format_args!("{low},{high}"));
    }
}

impl ThreadSet {
    fn settings(&self, out: &mut String) {
        line(out, "Threads", self.count);
        match self.color {
            Some(DefaultColor { number, rgb: Some([red, green, blue]) }) => {
                line(out, "Color", format_args!("{number},{red},{green},{blue}"));
            }
            color => option(out, "Color", color.map(|color| color.number)),
        }
        option(out, "Symbol", self.symbol);
        option(out, "Symbol Number", self.symbol_number);
        line(out, "Units", self.units.as_str());
        option(out, "Spacing", self.spacing);
        option(out, "Thickness", self.thickness);
        option(out, "Spacing Zoom", self.spacing_zoom);
        option(out, "Thickness Zoom", self.thickness_zoom);
    }
}

impl fmt::Display for Symbol {
    /// As the format writes it: a character in quotes, a code behind `#`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Char(character) => write!(f, "'{character}'"),
            Self::Code(code) => write!(f, "#{code}"),
        }
    }
}

/// Whether a name can stand before `=` without being read as something else.
fn is_key(name: &str) -> bool {
    !name.is_empty() && !name.starts_with([';', '[']) && !name.contains('=')
}

fn header(out: &mut String, name: &str) {
    out.push_str("\n[");
    out.push_str(name);
    out.push_str("]\n");
}

fn line(out: &mut String, key: impl fmt::Display, value: impl fmt::Display) {
    writeln!(out, "{key}={value}").expect("writing to a string does not fail");
}

fn option(out: &mut String, key: &str, value: Option<impl fmt::Display>) {
    if let Some(value) = value {
        line(out, key, value);
    }
}

/// A line of text, unless it is empty.
fn text(out: &mut String, key: &str, text: &str) {
    if !text.is_empty() {
        line(out, key, one_line(text));
    }
}

fn one_line(text: &str) -> String {
    text.replace(['\r', '\n', '\0'], " ")
}

fn symbol_palette(out: &mut String, table: &Sparse<Symbol>) {
    option(out, "Entries", table.last_index());
}

/// A line per value; `first` is the number of index 0.
fn values(out: &mut String, first: u64, values: &Sparse<impl fmt::Display>) {
    for (index, value) in values.iter() {
        line(out, u64::from(index) + first, value);
    }
}

/// A line per list; an empty list is written as 0.
fn lists(out: &mut String, lists: &Lists) {
    for (index, items) in lists.iter() {
        let number = |index: u32| u64::from(index) + 1;
        write!(out, "{}=", number(index)).expect("writing to a string does not fail");
        let (first, others) =
            items.split_first().map_or((0, items), |(&item, others)| (number(item), others));
        write!(out, "{first}").expect("writing to a string does not fail");
        for &item in others {
            write!(out, ",{}", number(item)).expect("writing to a string does not fail");
        }
        out.push('\n');
    }
}
