//! Which section is which, and how the lines of a section become fields or rows.

use super::field::Field;
use super::line::Line;
use super::name::{Name, is_reserved, same_name};
use super::rows::{Rows, entry};
use super::value;
use crate::diagnostic::{Code, Report, quote, shortened};
use crate::document::{Document, Section};
use crate::draft::Side;
use crate::limits;
use crate::span::Span;

/// Most characters of the name of an unknown section in a diagnostic.
const SECTION_NAME: usize = 40;

/// Reads the sections of a document into a draft.
pub(super) struct Reader<'d, 'r> {
    pub(super) document: &'d Document,
    pub(super) report: &'r mut Report,
    pub(super) max_threads: u32,
    /// The sections of the format, by [`Name`].
    pub(super) known: Vec<Vec<Section<'d>>>,
    foreign: Vec<Section<'d>>,
}

impl<'d, 'r> Reader<'d, 'r> {
    pub(super) fn new(document: &'d Document, report: &'r mut Report, max_threads: u32) -> Self {
        let known = Name::ALL.iter().map(|_| Vec::new()).collect();
        let mut reader = Self { document, report, max_threads, known, foreign: Vec::new() };
        reader.note_encoding();
        reader.sort_sections();
        reader
    }

    fn note_encoding(&mut self) {
        let bytes = self.document.as_bytes();
        if let Err(error) = std::str::from_utf8(bytes) {
            self.report.add(Code::Windows1252, Span::new(error.valid_up_to(), 1), || {
                "not UTF-8, expected that; the file is read as windows-1252".into()
            });
        }
    }

    /// Sorts the sections by name, reporting headers that are not as they should be.
    fn sort_sections(&mut self) {
        let has_weft_colors = self.document.sections().any(|section| {
            section.raw_name().is_some_and(|name| Name::of(name) == Some(Name::WeftColors))
        });
        for section in self.document.sections() {
            let Some(raw_name) = section.raw_name() else {
                self.preamble(section);
                continue;
            };
            let known = Name::of(raw_name);
            match known {
                Some(name) => self.report.enter(name.as_str()),
                None => self.report.enter(shortened(raw_name, SECTION_NAME)),
            }
            self.check_header(&section);
            match known {
                Some(Name::WarpColors)
                    if !has_weft_colors && !self.of(Name::WarpColors).is_empty() =>
                {
                    self.report.add(Code::MisnamedSection, header_span(&section), || {
                        "a second one without [WEFT COLORS], which it is read as".into()
                    });
                    self.add(Name::WeftColors, section);
                }
                Some(name) => {
                    if self.of(name).iter().any(|other| other.raw_name().is_some()) {
                        self.report.add(Code::DuplicateSection, header_span(&section), || {
                            "occurs again, expected once; read as one".into()
                        });
                    }
                    self.add(name, section);
                }
                None => self.add_foreign(section, raw_name),
            }
        }
    }

    /// What stands before the first header is read as `[WIF]`.
    fn preamble(&mut self, section: Section<'d>) {
        self.report.leave();
        let first = section.raw_lines().find(|(_, line)| matches!(line, Line::Entry { .. }));
        if let Some((raw, _)) = first {
            self.report.add(Code::NoHeader, Span::new(raw.at, raw.bytes.len()), || {
                "a key before any header, expected [WIF] first; read as that".into()
            });
        }
        if section.raw_lines().any(|(_, line)| matches!(line, Line::Entry { .. } | Line::Text(_))) {
            self.add(Name::Wif, section);
        }
    }

    fn check_header(&mut self, section: &Section<'d>) {
        let Some((_, header)) = section.raw_header() else { return };
        let span = header_span(section);
        if !header.closed {
            self.report.add(Code::UnclosedHeader, span, || "header without ], expected one".into());
        } else if !header.after.is_empty() {
            self.report.add(Code::TextAfterHeader, span, || {
                format!("{} after the header is ignored, expected nothing", quote(header.after))
            });
        }
    }

    fn add_foreign(&mut self, section: Section<'d>, raw_name: &[u8]) {
        if !is_reserved(raw_name) {
            self.report.add(Code::UnknownSection, header_span(&section), || {
                "not a section of the format; kept as it is".into()
            });
        }
        if self.foreign.len() < limits::FOREIGN_SECTIONS {
            self.foreign.push(section);
        } else {
            self.report.add(Code::Limit, header_span(&section), || {
                let most = limits::FOREIGN_SECTIONS;
                format!("the draft leaves it out, expected at most {most} sections of others")
            });
        }
    }

    fn add(&mut self, name: Name, section: Section<'d>) {
        if let Some(sections) = self.known.get_mut(name as usize) {
            sections.push(section);
        }
    }

    pub(super) fn of(&self, name: Name) -> &[Section<'d>] {
        self.known.get(name as usize).map_or(&[], Vec::as_slice)
    }

    pub(super) fn foreign(&self) -> &[Section<'d>] {
        &self.foreign
    }

    /// Reports as being in a section, and returns where: its first header, else the file.
    pub(super) fn enter(&mut self, name: Name) -> Span {
        self.report.enter(name.as_str());
        self.of(name).first().map_or(Span::FILE, header_span)
    }

    /// The values of these keys in the sections called `name`, without blank ones.
    pub(super) fn fields<const N: usize>(
        &mut self,
        name: Name,
        keys: [&str; N],
    ) -> [Option<Field<'d>>; N] {
        /// Keys the format has dropped; programs still write them.
        const OBSOLETE: [&str; 5] = ["Form", "Profile", "Colors", "Palette", "ColorMix"];
        self.report.enter(name.as_str());
        let mut found: [Option<Field<'d>>; N] = [None; N];
        for section in self.known.get(name as usize).into_iter().flatten() {
            for (raw, line) in section.raw_lines() {
                let Some((key, value)) = entry(self.report, raw.at, raw.bytes, line) else {
                    continue;
                };
                let is_key = |known: &&str| same_name(key.bytes, known.as_bytes());
                let mut slots = keys.iter().zip(&mut found);
                match slots.find(|(known, _)| is_key(known)) {
                    Some((known, slot)) => {
                        if slot.is_some() {
                            self.report.add(Code::DuplicateKey, key.span(), || {
                                format!("{known} is given again, expected once; the last counts")
                            });
                        }
                        *slot = Some(value);
                    }
                    None if OBSOLETE.iter().any(is_key) => {}
                    None => self.report.add(Code::UnknownKey, key.span(), || {
                        format!("{} is not a key of this section; ignored", quote(key.bytes))
                    }),
                }
            }
        }
        found.map(|field| {
            field.filter(|field| match field.bytes.first() {
                None => false,
                Some(b';') => name.has_text(),
                Some(_) => true,
            })
        })
    }

    /// The numbered lines of the sections called `name`; `read` reads one value.
    pub(super) fn rows<V>(
        &mut self,
        name: Name,
        mut read: impl FnMut(&mut Report, u32, Field<'d>) -> Option<V>,
    ) -> Rows<V> {
        self.report.enter(name.as_str());
        let mut rows = Rows::default();
        for section in self.known.get(name as usize).into_iter().flatten() {
            for (raw, line) in section.raw_lines() {
                let Some((key, value)) = entry(self.report, raw.at, raw.bytes, line) else {
                    continue;
                };
                let Some(number) = value::number(key.bytes) else {
                    self.report.add(Code::BadKey, key.span(), || {
                        format!("line of {} is skipped, expected a number", quote(key.bytes))
                    });
                    continue;
                };
                let is_blank = matches!(value.bytes.first(), None | Some(b';'));
                let value = if is_blank { None } else { read(self.report, number, value) };
                rows.push(number, key.at, value);
            }
        }
        rows
    }
}

pub(super) fn side_name(side: Side) -> Name {
    match side {
        Side::Warp => Name::Warp,
        Side::Weft => Name::Weft,
    }
}

/// What weavers call a thread of this side.
pub(super) fn thread_name(side: Side) -> &'static str {
    match side {
        Side::Warp => "end",
        Side::Weft => "pick",
    }
}

/// The line of the header of a section.
pub(super) fn header_span(section: &Section<'_>) -> Span {
    section.raw_header().map_or(Span::FILE, |(raw, _)| Span::new(raw.at, raw.bytes.len()))
}
