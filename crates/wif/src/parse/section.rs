//! One function per section, in the order of the specification.

use nom::Offset;

use super::field::{self, Field};
use super::line::{Line, trim};
use super::name::Name;
use super::reader::{Reader, side_name};
use super::rows::Rows;
use super::value;
use crate::diagnostic::{Code, Report, quote};
use crate::draft::{DefaultColor, ForeignSection, Side, Source, Symbol, Text, ThreadSet, Units};
use crate::span::Span;
use crate::sparse::Sparse;

/// The section `[WEAVING]`, as far as it is there.
pub(super) struct Weaving {
    pub(super) shafts: Option<u32>,
    pub(super) treadles: Option<u32>,
    pub(super) rising_shed: bool,
}

/// The section `[WARP]` or `[WEFT]`.
pub(super) struct SideFields {
    /// The threads, without their number.
    pub(super) set: ThreadSet,
    /// Their number and where it stands, if it is given.
    pub(super) threads: Option<(u32, Span)>,
    /// Whether the unit is given.
    pub(super) units: bool,
}

/// Numbered lines that are lists, with the largest number in them.
#[derive(Default)]
pub(super) struct ListRows {
    /// Each list a range of `items`.
    pub(super) rows: Rows<(u32, u32)>,
    /// Shafts or treadles, counted from 0.
    pub(super) items: Vec<u32>,
    /// The largest number of a shaft or treadle, counted from 1, but for lines that are ignored.
    pub(super) most: u32,
}

/// What a section of lists is about, as in "treadle 9 ties shaft 12".
struct ListKind {
    name: Name,
    subject: &'static str,
    verb: &'static str,
    object: &'static str,
    /// The number of subjects, if lines beyond it are to be ignored.
    subjects: Option<u32>,
    /// The number of objects, if it is given, and the code for one beyond.
    declared: Option<u32>,
    beyond: Code,
}

/// The numbered lines about one side.
pub(super) struct SideRows {
    pub(super) colors: Rows<u32>,
    pub(super) symbols: Rows<u32>,
    pub(super) spacings: Rows<f64>,
    pub(super) thicknesses: Rows<f64>,
    pub(super) spacing_zooms: Rows<u32>,
    pub(super) thickness_zooms: Rows<u32>,
}

impl SideRows {
    /// How many threads the lines tell of.
    pub(super) fn count(&self) -> u32 {
        let of_numbers = [&self.colors, &self.symbols, &self.spacing_zooms, &self.thickness_zooms];
        let of_lengths = [&self.spacings, &self.thicknesses];
        let counts = of_numbers.map(Rows::count).into_iter().chain(of_lengths.map(Rows::count));
        counts.max().unwrap_or(0)
    }
}

impl<'d> Reader<'d, '_> {
    fn decode(&self, field: Field<'_>) -> String {
        self.document.encoding().decode(field.bytes).into_owned()
    }

    /// `[WIF]`
    pub(super) fn source(&mut self) -> Source {
        let keys = ["Version", "Date", "Developers", "Source Program", "Source Version"];
        let [format, date, developers, program, version] = self.fields(Name::Wif, keys);
        if let Some(format) = format
            && value::real(format.without_comment().bytes) != Some((1.1, false))
        {
            self.report.add(Code::Version, format.span(), || {
                format!("version {} is read as 1.1", quote(format.bytes))
            });
        }
        let default = Source::default();
        let decode =
            |field: Option<Field<'_>>, default| field.map_or(default, |field| self.decode(field));
        Source {
            program: decode(program, default.program),
            version: decode(version, default.version),
            date: decode(date, default.date),
            developers: decode(developers, default.developers),
        }
    }

    /// `[TEXT]`
    pub(super) fn text(&mut self) -> Text {
        let keys = ["Title", "Author", "Address", "EMail", "Telephone", "FAX"];
        let fields = self.fields(Name::Text, keys);
        let [title, author, address, email, telephone, fax] =
            fields.map(|field| field.map(|field| self.decode(field)).unwrap_or_default());
        Text { title, author, address, email, telephone, fax }
    }

    /// `[NOTES]`: numbered lines in the order of their numbers; a line that is not numbered
    /// follows the line above it.
    pub(super) fn notes(&mut self) -> Vec<String> {
        self.report.enter(Name::Notes.as_str());
        let mut rows: Rows<u32> = Rows::default();
        let mut previous = 0;
        for section in self.known.get(Name::Notes as usize).into_iter().flatten() {
            for (raw, line) in section.raw_lines() {
                let text = match line {
                    Line::Blank | Line::Comment(_) => continue,
                    Line::Text(text) => text,
                    Line::Entry { key, value } => match value::number(key) {
                        Some(number) => {
                            previous = number;
                            value
                        }
                        None => trim(raw.bytes),
                    },
                };
                let at = raw.at.saturating_add(raw.bytes.offset(text));
                rows.push(previous, at, u32::try_from(text.len()).ok());
            }
        }
        // Stable: lines of one number keep their order, and none is lost.
        rows.rows.sort_by_key(|row| row.key);
        let text = |row: &super::rows::Row<u32>| {
            let span = Span::new(row.at as usize, row.value.unwrap_or(0) as usize);
            self.document.encoding().decode(span.of(self.document.as_bytes())).into_owned()
        };
        rows.rows.iter().map(text).collect()
    }

    /// `[WEAVING]`
    pub(super) fn weaving(&mut self) -> Weaving {
        let keys = ["Shafts", "Treadles", "Rising Shed"];
        let [shafts, treadles, rising_shed] = self.fields(Name::Weaving, keys);
        let mut count =
            |field: Option<Field<'_>>| field.and_then(|field| field::number(self.report, field));
        let (shafts, treadles) = (count(shafts), count(treadles));
        let rising_shed = match rising_shed {
            Some(shed) => field::boolean(self.report, shed, true),
            None => {
                let span = self.enter(Name::Weaving);
                self.report.add(Code::ShedAssumed, span, || {
                    "Rising Shed is not given; read as true".into()
                });
                true
            }
        };
        Weaving { shafts: shafts.filter(|&count| count > 0), treadles, rising_shed }
    }

    /// `[WARP]` or `[WEFT]`
    pub(super) fn side(&mut self, side: Side) -> SideFields {
        let name = side_name(side);
        let [
            threads,
            color,
            symbol,
            symbol_number,
            units,
            spacing,
            thickness,
            spacing_zoom,
            thickness_zoom,
        ] = self.fields(
            name,
            [
                "Threads",
                "Color",
                "Symbol",
                "Symbol Number",
                "Units",
                "Spacing",
                "Thickness",
                "Spacing Zoom",
                "Thickness Zoom",
            ],
        );
        let threads = threads.and_then(|field| {
            let number = field::number(self.report, field).filter(|&number| number > 0)?;
            Some((number, field.span()))
        });
        let set = ThreadSet {
            color: color.and_then(|field| self.default_color(field)),
            symbol: symbol.and_then(|field| self.symbol(field)),
            symbol_number: symbol_number.and_then(|field| field::number(self.report, field)),
            units: units.map_or(Units::Centimeters, |field| self.units(field)),
            spacing: spacing.and_then(|field| field::real(self.report, field)),
            thickness: thickness.and_then(|field| field::real(self.report, field)),
            spacing_zoom: spacing_zoom.and_then(|field| field::number(self.report, field)),
            thickness_zoom: thickness_zoom.and_then(|field| field::number(self.report, field)),
            ..ThreadSet::new(0)
        };
        SideFields { set, threads, units: units.is_some() }
    }

    /// color = number [ "," red "," green "," blue ]
    fn default_color(&mut self, field: Field<'_>) -> Option<DefaultColor> {
        let mut numbers = Vec::with_capacity(4);
        field::numbers(self.report, field, |_, number, _| {
            if numbers.len() < 4 {
                numbers.push(number);
            }
        });
        match numbers[..] {
            [number, red, green, blue] => {
                Some(DefaultColor { number, rgb: Some([red, green, blue]) })
            }
            [number, ..] => Some(DefaultColor { number, rgb: None }),
            [] => None,
        }
    }

    fn symbol(&mut self, field: Field<'_>) -> Option<Symbol> {
        read_symbol(self.report, self.document.encoding(), field)
    }

    fn units(&mut self, field: Field<'_>) -> Units {
        let field = field.without_comment();
        value::units(field.bytes).unwrap_or_else(|| {
            self.report.add(Code::BadUnits, field.span(), || {
                let found = quote(field.bytes);
                format!("{found} is read as centimeters, expected that, inches or decipoints")
            });
            Units::Centimeters
        })
    }

    /// `[COLOR PALETTE]`: the range of components, if it is given, and the number of colours.
    pub(super) fn color_palette(&mut self) -> (Option<(u32, u32)>, Option<u32>) {
        let [entries, range] = self.fields(Name::ColorPalette, ["Entries", "Range"]);
        let entries = entries.and_then(|field| field::number(self.report, field));
        let range = range.and_then(|field| {
            let mut numbers = Vec::with_capacity(2);
            field::numbers(self.report, field, |_, number, _| {
                if numbers.len() < 3 {
                    numbers.push(number);
                }
            });
            match numbers[..] {
                [high] if high > 0 => Some((0, high)),
                [low, high] if low < high => Some((low, high)),
                _ => {
                    self.report.add(Code::BadRange, field.span(), || {
                        format!(
                            "{} is ignored, expected a smaller and a greater number",
                            quote(field.bytes)
                        )
                    });
                    None
                }
            }
        });
        (range, entries)
    }

    /// `[WARP SYMBOL PALETTE]` and `[WEFT SYMBOL PALETTE]`, which only count their tables.
    pub(super) fn symbol_palettes(&mut self) {
        for name in [Name::WarpSymbolPalette, Name::WeftSymbolPalette] {
            let [_entries] = self.fields(name, ["Entries"]);
        }
    }

    /// `[COLOR TABLE]`
    pub(super) fn color_table(&mut self) -> Rows<[u32; 3]> {
        self.rows(Name::ColorTable, |report, _, field| field::color(report, field))
    }

    /// `[WARP SYMBOL TABLE]` or `[WEFT SYMBOL TABLE]`
    pub(super) fn symbol_table(&mut self, name: Name) -> Sparse<Symbol> {
        let encoding = self.document.encoding();
        let rows = self.rows(name, |report, _, field| read_symbol(report, encoding, field));
        self.by_number(rows, "symbol")
    }

    /// `[THREADING]`: shafts by end.
    pub(super) fn threading(&mut self, shafts: Option<u32>, ends: Option<u32>) -> ListRows {
        self.list_rows(&ListKind {
            name: Name::Threading,
            subject: "end",
            verb: "is on",
            object: "shaft",
            subjects: ends,
            declared: shafts,
            beyond: Code::ShaftsRaised,
        })
    }

    /// `[TIEUP]`: shafts by treadle.
    pub(super) fn tieup(&mut self, shafts: Option<u32>) -> ListRows {
        self.list_rows(&ListKind {
            name: Name::Tieup,
            subject: "treadle",
            verb: "ties",
            object: "shaft",
            subjects: None,
            declared: shafts,
            beyond: Code::ShaftsRaised,
        })
    }

    /// `[TREADLING]`: treadles by pick.
    pub(super) fn treadling(&mut self, treadles: Option<u32>, picks: Option<u32>) -> ListRows {
        self.list_rows(&ListKind {
            name: Name::Treadling,
            subject: "pick",
            verb: "presses",
            object: "treadle",
            subjects: picks,
            declared: treadles,
            beyond: Code::TreadlesRaised,
        })
    }

    /// `[LIFTPLAN]`: shafts by pick.
    pub(super) fn liftplan(&mut self, shafts: Option<u32>, picks: Option<u32>) -> ListRows {
        self.list_rows(&ListKind {
            name: Name::Liftplan,
            subject: "pick",
            verb: "lifts",
            object: "shaft",
            subjects: picks,
            declared: shafts,
            beyond: Code::ShaftsRaised,
        })
    }

    fn list_rows(&mut self, kind: &ListKind) -> ListRows {
        let limit = self.max_threads;
        let ListKind { subject, verb, object, .. } = *kind;
        let mut items = Vec::new();
        let mut most = 0;
        let place = |items: &Vec<u32>| u32::try_from(items.len()).unwrap_or(u32::MAX);
        let rows = self.rows(kind.name, |report, key, field| {
            let start = place(&items);
            let is_ignored = kind.subjects.is_some_and(|subjects| key > subjects);
            field::numbers(report, field, |report, number, span| {
                let (code, bound) = if number > limit {
                    (Code::Limit, limit)
                } else {
                    (kind.beyond, kind.declared.unwrap_or(u32::MAX))
                };
                if number > bound && !is_ignored {
                    report.add(code, span, || {
                        format!(
                            "{subject} {key} {verb} {object} {number}, expected at most {bound}"
                        )
                    });
                }
                // 0 means none.
                if let Some(index) = number.checked_sub(1)
                    && number <= limit
                {
                    items.push(index);
                    most = if is_ignored { most } else { most.max(number) };
                }
            });
            Some((start, place(&items)))
        });
        ListRows { rows, items, most }
    }

    /// The sections with a value per thread of one side.
    pub(super) fn side_rows(&mut self, side: Side) -> SideRows {
        let by_side = |warp, weft| if side == Side::Warp { warp } else { weft };
        let number = |report: &mut Report, _, field| field::number(report, field);
        let real = |report: &mut Report, _, field| field::real(report, field);
        SideRows {
            colors: self.rows(by_side(Name::WarpColors, Name::WeftColors), number),
            symbols: self.rows(by_side(Name::WarpSymbols, Name::WeftSymbols), number),
            spacings: self.rows(by_side(Name::WarpSpacing, Name::WeftSpacing), real),
            thicknesses: self.rows(by_side(Name::WarpThickness, Name::WeftThickness), real),
            spacing_zooms: self.rows(by_side(Name::WarpSpacingZoom, Name::WeftSpacingZoom), number),
            thickness_zooms: self
                .rows(by_side(Name::WarpThicknessZoom, Name::WeftThicknessZoom), number),
        }
    }

    /// Private and unknown sections, as they stand.
    pub(super) fn foreign_sections(&self) -> Vec<ForeignSection> {
        let encoding = self.document.encoding();
        let foreign = self.foreign().iter().map(|section| {
            let mut text = String::new();
            let mut length = 0;
            for (raw, line) in section.raw_lines() {
                text.push_str(&encoding.decode(raw.bytes));
                if line != Line::Blank {
                    length = text.len();
                }
                text.push('\n');
            }
            text.truncate(length);
            text.shrink_to_fit();
            ForeignSection { name: section.name().unwrap_or_default().into_owned(), text }
        });
        foreign.collect()
    }
}

fn read_symbol(
    report: &mut Report,
    encoding: super::text::Encoding,
    field: Field<'_>,
) -> Option<Symbol> {
    let symbol = value::symbol(field.bytes, encoding);
    if symbol.is_none() {
        report.add(Code::BadSymbol, field.span(), || {
            format!("{} is skipped, expected one character or the code of one", quote(field.bytes))
        });
    }
    symbol
}
