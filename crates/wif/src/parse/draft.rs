//! From the sections to a draft: counts, colours, and each list in order.

use super::check;
use super::name::Name;
use super::reader::{Reader, side_name, thread_name};
use super::rows::{Numbering, Rows};
use super::section::{ListRows, SideFields, SideRows};
use crate::color::Palette;
use crate::diagnostic::Code;
use crate::draft::{Draft, Side, ThreadSet};
use crate::span::Span;
use crate::sparse::{Lists, Sparse};

impl Reader<'_, '_> {
    /// The draft, unless an error makes it impossible.
    pub(super) fn draft(mut self) -> Option<Draft> {
        if !self.has_draft() {
            return None;
        }
        let source = self.source();
        let text = self.text();
        let notes = self.notes();
        let weaving = self.weaving();
        let SideFields { set: mut warp, threads: declared_ends, units: warp_units } =
            self.side(Side::Warp);
        let SideFields { set: mut weft, threads: declared_picks, units: weft_units } =
            self.side(Side::Weft);
        let color_palette = self.color_palette();
        self.symbol_palettes();
        let table = self.color_table();
        warp.symbol_table = self.symbol_table(Name::WarpSymbolTable);
        weft.symbol_table = self.symbol_table(Name::WeftSymbolTable);
        let (ends, picks) =
            (declared_ends.map(|(ends, _)| ends), declared_picks.map(|(picks, _)| picks));
        let threading = self.threading(weaving.shafts, ends);
        let tieup = self.tieup(weaving.shafts);
        let treadling = self.treadling(weaving.treadles, picks);
        let liftplan = self.liftplan(weaving.shafts, picks);
        let ends = self.side_rows(Side::Warp);
        let picks = self.side_rows(Side::Weft);
        check::contents(&mut self);

        let told_ends = threading.rows.count().max(ends.count());
        let told_picks = treadling.rows.count().max(liftplan.rows.count()).max(picks.count());
        let counts = [
            self.threads(Side::Warp, declared_ends, told_ends),
            self.threads(Side::Weft, declared_picks, told_picks),
        ];
        let told_shafts = threading.most.max(tieup.most).max(liftplan.most);
        let shafts = self.loom("shafts", weaving.shafts, told_shafts);
        let (tied, first_treadle) = self.tied(&tieup.rows, treadling.most, weaving.treadles);
        let treadles = self.loom("treadles", weaving.treadles, treadling.most.max(tied));
        let ([Some(end_count), Some(pick_count)], Some(shafts), Some(treadles)) =
            (counts, shafts, treadles)
        else {
            return None;
        };
        (warp.count, weft.count) = (end_count, pick_count);

        let palette = self.palette(color_palette, table, [(&mut warp, &ends), (&mut weft, &picks)]);
        for (side, set, rows, units) in
            [(Side::Warp, &mut warp, ends, warp_units), (Side::Weft, &mut weft, picks, weft_units)]
        {
            check::colors(&mut self, side, set, &rows.colors, &palette);
            self.fill(side, set, rows);
            check::lengths(&mut self, side, set, units);
        }

        let draft = Draft {
            source,
            text,
            notes,
            shafts,
            treadles,
            rising_shed: weaving.rising_shed,
            threading: self.thread_lists(Name::Threading, threading, "end", end_count),
            tieup: self.treadle_lists(tieup, first_treadle),
            treadling: self.thread_lists(Name::Treadling, treadling, "pick", pick_count),
            liftplan: self.thread_lists(Name::Liftplan, liftplan, "pick", pick_count),
            warp,
            weft,
            palette,
            foreign: self.foreign_sections(),
        };
        check::draft(&mut self, &draft);
        Some(draft)
    }

    /// Whether a section other than the informational ones is there; reports if not.
    fn has_draft(&mut self) -> bool {
        let informational = [Name::Wif, Name::Contents, Name::Text, Name::Notes];
        let is_there = |name| !informational.contains(name) && !self.of(*name).is_empty();
        let has_draft = Name::ALL.iter().any(is_there);
        if !has_draft {
            self.report.leave();
            self.report.add(Code::NotWif, Span::FILE, || {
                "no section of a draft, expected [WEAVING], [WARP], [WEFT] and others".into()
            });
        }
        has_draft
    }

    /// The number of threads: as declared, else as the lines tell.
    fn threads(&mut self, side: Side, declared: Option<(u32, Span)>, told: u32) -> Option<u32> {
        let what = thread_name(side);
        let header = self.enter(side_name(side));
        let limit = self.max_threads;
        let (count, span) = match declared {
            Some(declared) => declared,
            None if told > 0 => {
                self.report.add(Code::CountMissing, header, || {
                    format!("number of {what}s is not given; read as {told}, as the data tells")
                });
                (told, header)
            }
            None => {
                self.report.add(Code::NoThreads, header, || {
                    format!("no {what}s, expected their number or data for each")
                });
                return None;
            }
        };
        self.within_limit(&format!("{what}s"), count, limit, span)
    }

    /// The number of shafts or treadles: as declared, else as the lists tell, and at least that.
    fn loom(&mut self, what: &str, declared: Option<u32>, told: u32) -> Option<u32> {
        let header = self.enter(Name::Weaving);
        if declared.is_none() {
            self.report.add(Code::CountMissing, header, || {
                format!("number of {what} is not given; read as {told}, as the data tells")
            });
        }
        let limit = self.max_threads;
        self.within_limit(what, declared.unwrap_or(0).max(told), limit, header)
    }

    fn within_limit(&mut self, what: &str, count: u32, limit: u32, span: Span) -> Option<u32> {
        if count <= limit {
            return Some(count);
        }
        self.report.add(Code::Limit, span, || format!("{count} {what}, expected at most {limit}"));
        None
    }

    /// How many treadles the tie-up tells of, and the number of the first.
    fn tied(&mut self, rows: &Rows<(u32, u32)>, pressed: u32, declared: Option<u32>) -> (u32, u32) {
        self.report.enter(Name::Tieup.as_str());
        let told = rows.last.max(pressed).max(1);
        let count = declared.filter(|&declared| declared > 0).unwrap_or(told);
        let first = rows.first(self.report, self.document, count);
        // From 1, whatever the first line is numbered.
        let number = |key: u32| key.saturating_add(1).saturating_sub(first);
        let most = declared.unwrap_or(u32::MAX);
        for row in rows.rows.iter().filter(|row| number(row.key) > most) {
            self.report.add(Code::TreadlesRaised, row.span(self.document), || {
                format!("treadle {} is tied, expected at most {most}", number(row.key))
            });
        }
        let tied = if rows.rows.is_empty() { 0 } else { rows.last };
        (number(tied), first)
    }

    /// The palette; colours of the table and of the sides are brought into its range.
    fn palette(
        &mut self,
        (range, entries): (Option<(u32, u32)>, Option<u32>),
        mut table: Rows<[u32; 3]>,
        sides: [(&mut ThreadSet, &SideRows); 2],
    ) -> Palette {
        let has_inline = sides.iter().any(|(set, _)| set.has_inline_color());
        let names = sides.iter().flat_map(|(set, rows)| {
            let numbers = rows.colors.rows.iter().filter_map(|row| row.value);
            numbers.chain(set.color.map(|color| color.number))
        });
        let (least_name, last_name) =
            names.fold((u32::MAX, 0), |(least, last), name| (least.min(name), last.max(name)));
        let range = range.unwrap_or_else(|| {
            let defaults = sides.iter().filter_map(|(set, _)| set.color?.rgb);
            let colors = table.rows.iter().filter_map(|row| row.value).chain(defaults);
            self.assumed_range(colors.flatten().max())
        });
        self.report.enter(Name::ColorTable.as_str());
        for row in &mut table.rows {
            let span = row.span(self.document);
            if let Some(color) = &mut row.value {
                self.clamp(color, range, span);
            }
        }
        for (side, (set, _)) in [Side::Warp, Side::Weft].into_iter().zip(sides) {
            let header = self.enter(side_name(side));
            if let Some(color) = set.color.as_mut().and_then(|color| color.rgb.as_mut()) {
                self.clamp(color, range, header);
            }
        }
        // Numbers of colours are names, so a table from 0 is only shifted where no thread has
        // a colour 0.
        self.report.enter(Name::ColorTable.as_str());
        let count = entries.unwrap_or(table.last.max(last_name));
        let first =
            if least_name == 0 { 1 } else { table.first(self.report, self.document, count) };
        let shift = 1_u32.saturating_sub(first);
        for row in &mut table.rows {
            row.key = row.key.saturating_add(shift);
        }
        let colors = self.by_number(table, "color");
        // A range without colours says nothing.
        if colors.is_empty() && !has_inline {
            Palette::default()
        } else {
            Palette { range, colors }
        }
    }

    /// The range of components where none is given, `most` being the largest.
    fn assumed_range(&mut self, most: Option<u32>) -> (u32, u32) {
        let Some(most) = most else { return Palette::default().range };
        let high = if most > 255 { 999 } else { 255 };
        let palette = self.enter(Name::ColorPalette);
        let span = if palette == Span::FILE { self.enter(Name::ColorTable) } else { palette };
        self.report.add(Code::RangeAssumed, span, || {
            format!("no usable Range; read as 0,{high}, as the colors tell")
        });
        (0, high)
    }

    fn clamp(&mut self, color: &mut [u32; 3], (low, high): (u32, u32), span: Span) {
        let written = *color;
        *color = written.map(|component| component.clamp(low, high));
        if *color != written {
            self.report.add(Code::ColorRange, span, || {
                let [red, green, blue] = written;
                format!(
                    "color {red},{green},{blue} is clamped, expected components in {low},{high}"
                )
            });
        }
    }

    fn fill(&mut self, side: Side, set: &mut ThreadSet, rows: SideRows) {
        let names = match side {
            Side::Warp => [
                Name::WarpColors,
                Name::WarpSymbols,
                Name::WarpSpacing,
                Name::WarpThickness,
                Name::WarpSpacingZoom,
                Name::WarpThicknessZoom,
            ],
            Side::Weft => [
                Name::WeftColors,
                Name::WeftSymbols,
                Name::WeftSpacing,
                Name::WeftThickness,
                Name::WeftSpacingZoom,
                Name::WeftThicknessZoom,
            ],
        };
        let [colors, symbols, spacing, thickness, spacing_zoom, thickness_zoom] = names;
        let what = thread_name(side);
        set.colors = self.values(colors, rows.colors, what, set.count);
        set.symbols = self.values(symbols, rows.symbols, what, set.count);
        set.spacings = self.values(spacing, rows.spacings, what, set.count);
        set.thicknesses = self.values(thickness, rows.thicknesses, what, set.count);
        set.spacing_zooms = self.values(spacing_zoom, rows.spacing_zooms, what, set.count);
        set.thickness_zooms = self.values(thickness_zoom, rows.thickness_zooms, what, set.count);
    }

    fn values<V>(
        &mut self,
        name: Name,
        rows: Rows<V>,
        what: &'static str,
        count: u32,
    ) -> Sparse<V> {
        self.report.enter(name.as_str());
        let first = rows.first(self.report, self.document, count);
        let numbering = Numbering { what, first, count: Some(count) };
        Sparse::from_sorted(rows.in_order(self.report, self.document, numbering))
    }

    /// The values of a table by the numbers that the file gives them.
    pub(super) fn by_number<V>(&mut self, rows: Rows<V>, what: &'static str) -> Sparse<V> {
        let numbering = Numbering { what, first: 0, count: None };
        Sparse::from_sorted(rows.in_order(self.report, self.document, numbering))
    }

    fn thread_lists(
        &mut self,
        name: Name,
        rows: ListRows,
        what: &'static str,
        count: u32,
    ) -> Lists {
        self.report.enter(name.as_str());
        let first = rows.rows.first(self.report, self.document, count);
        self.lists(rows, Numbering { what, first, count: Some(count) })
    }

    fn treadle_lists(&mut self, rows: ListRows, first: u32) -> Lists {
        self.report.enter(Name::Tieup.as_str());
        self.lists(rows, Numbering { what: "treadle", first, count: None })
    }

    fn lists(&mut self, ListRows { rows, items, .. }: ListRows, numbering: Numbering) -> Lists {
        let has_value = rows.rows.iter().any(|row| row.value.is_some());
        let mut ranges = rows.in_order(self.report, self.document, numbering);
        if has_value && ranges.is_empty() {
            // Every line was ignored, but the section is there: no list at all would mean it is not.
            ranges.push((0, (0, 0)));
        }
        let list = |&(index, (start, end)): &(u32, (u32, u32))| {
            (index, items.get(start as usize..end as usize).unwrap_or_default())
        };
        ranges.iter().map(list).collect()
    }
}
