//! What holds for every draft, every edit and every sequence of bytes.

use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;
use selvedge_wif::{
    Code, DefaultColor, Document, Draft, ForeignSection, Lists, Palette, Source, Sparse, Symbol,
    Text, ThreadSet, Units, parse,
};

/// Text as a line of a file can hold it: without white space around it.
fn text() -> impl Strategy<Value = String> {
    "[A-Za-zäß€0-9;=,.'% \\[\\]-]{0,12}".prop_map(|text| text.trim().to_owned())
}

fn sparse<T: std::fmt::Debug + Clone>(
    count: u32,
    value: impl Strategy<Value = T>,
) -> impl Strategy<Value = Sparse<T>> {
    btree_map(0..count, value, 0..6).prop_map(|map| map.into_iter().collect())
}

fn lists(keys: u32, items: u32) -> impl Strategy<Value = Lists> {
    btree_map(0..keys, vec(0..items, 0..4), 0..12)
        .prop_map(|map| map.iter().map(|(&index, items)| (index, items.as_slice())).collect())
}

fn length() -> impl Strategy<Value = f64> {
    prop_oneof![0.0..10.0, Just(0.0), Just(1e-300), Just(f64::MAX)]
}

fn symbol() -> impl Strategy<Value = Symbol> {
    prop_oneof![
        "[ -~é€]".prop_map(|text| Symbol::Char(text.chars().next().expect("one character"))),
        any::<u8>().prop_map(Symbol::Code),
    ]
}

fn threads(range: (u32, u32)) -> impl Strategy<Value = ThreadSet> {
    let rgb = [range.0..=range.1, range.0..=range.1, range.0..=range.1];
    let color = (0..9_u32, option::of(rgb)).prop_map(|(number, rgb)| DefaultColor { number, rgb });
    let units = prop_oneof![Just(Units::Decipoints), Just(Units::Inches), Just(Units::Centimeters)];
    let all = (
        (option::of(color), option::of(symbol()), option::of(0..9_u32), units),
        (option::of(length()), option::of(length()), option::of(0..9_u32), option::of(0..9_u32)),
        (1..200_u32, btree_map(1..9_u32, symbol(), 0..3)),
    );
    all.prop_flat_map(
        |((color, symbol, symbol_number, units), (spacing, thickness, a, b), (count, table))| {
            let fixed = ThreadSet {
                color,
                symbol,
                symbol_number,
                units,
                spacing,
                thickness,
                spacing_zoom: a,
                thickness_zoom: b,
                symbol_table: table.into_iter().collect(),
                ..ThreadSet::new(count)
            };
            let numbers = || sparse(count, 0..9_u32);
            let lengths = || sparse(count, length());
            let single = (numbers(), numbers(), lengths(), lengths(), numbers(), numbers());
            single.prop_map(move |(colors, symbols, spacings, thicknesses, zooms, more)| {
                ThreadSet {
                    colors,
                    symbols,
                    spacings,
                    thicknesses,
                    spacing_zooms: zooms,
                    thickness_zooms: more,
                    ..fixed.clone()
                }
            })
        },
    )
}

fn palette() -> impl Strategy<Value = Palette> {
    let range = prop_oneof![Just((0, 255)), Just((0, 999)), Just((20, 1200)), Just((0, u32::MAX))];
    range.prop_flat_map(|range| {
        let component = || range.0..=range.1;
        let colors = btree_map(0..9_u32, [component(), component(), component()], 1..6);
        colors.prop_map(move |colors| Palette { range, colors: colors.into_iter().collect() })
    })
}

fn foreign() -> impl Strategy<Value = ForeignSection> {
    let lines = vec("[a-z;= ]{0,6}", 0..4);
    ("(PRIVATE|TW) [a-z]{1,4}", lines).prop_map(|(name, lines)| {
        let text = lines.join("\n");
        ForeignSection { name, text: text.trim_end_matches(['\n', ' ']).to_owned() }
    })
}

fn drafts() -> impl Strategy<Value = Draft> {
    let describe = (text(), text(), vec(text(), 0..4), vec(foreign(), 0..3));
    let sides = palette()
        .prop_flat_map(|palette| (threads(palette.range), threads(palette.range), Just(palette)));
    let loom = (1..9_u32, 0..9_u32, any::<bool>());
    (describe, sides, loom).prop_flat_map(
        |(describe, (warp, weft, palette), (shafts, treadles, rising_shed))| {
            let treadling = lists(weft.count, treadles.max(1))
                .prop_map(move |lists| if treadles == 0 { Lists::default() } else { lists });
            let tieup = lists(treadles.max(1), shafts)
                .prop_map(move |lists| if treadles == 0 { Lists::default() } else { lists });
            let plans = (lists(warp.count, shafts), tieup, treadling, lists(weft.count, shafts));
            plans.prop_map(move |(threading, tieup, treadling, liftplan)| {
                let (title, program, notes, foreign) = describe.clone();
                Draft {
                    source: Source { program, ..Source::default() },
                    text: Text { title, ..Text::default() },
                    notes,
                    shafts,
                    treadles,
                    rising_shed,
                    warp: warp.clone(),
                    weft: weft.clone(),
                    palette: palette.clone(),
                    threading,
                    tieup,
                    treadling,
                    liftplan,
                    foreign,
                }
            })
        },
    )
}

/// Whether the warp is on top, straight from the definition.
fn on_top(draft: &Draft, end: u32, pick: u32) -> bool {
    let listed: Vec<u32> = if draft.liftplan.is_empty() {
        let treadles = draft.treadling.get(pick);
        treadles.iter().flat_map(|&treadle| draft.tieup.get(treadle)).copied().collect()
    } else {
        draft.liftplan.get(pick).to_vec()
    };
    draft.threading.get(end).iter().any(|shaft| listed.contains(shaft) == draft.rising_shed)
}

/// A file with most of the format in it, to be damaged.
const FILE: &str = "[WIF]\r\nVersion=1.1\r\nSource Program=Test\r\n\r\n[CONTENTS]\r\nWEAVING=true\r\n\
    [WEFT COLORS]\n1=2\n[THREADING]\n1=1\n2=2;x\n3=1,2\n[TIEUP]\n1=1\n2=2\n[TREADLING]\n1=1\n2=2\n\
    [WEAVING]\nRising Shed=1\nTreadles=2\nShafts=2\n[WARP]\nThreads=3\nColor=1\nUnits=inches\n\
    Spacing=0.04\nSymbol='X'\n[WEFT]\nThreads=2\nColor=1,0,0,0\n[LIFTPLAN]\n1=1\n2=2\n[COLOR TABLE]\n\
    1=255,0,999\n2=0,0,0\n[COLOR PALETTE]\nEntries=2\nRange=0,999\n[NOTES]\n1=a\n[PRIVATE X Y]\nfree\n\
    [WARP SPACING]\n2=0.08\n[WARP SYMBOL TABLE]\n1=#65\n";

#[derive(Debug, Clone)]
enum Damage {
    Replace(usize, u8),
    Remove(usize),
    Insert(usize, &'static str),
    DoubleLine(usize),
    SwapLines(usize, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let at = 0..FILE.len();
    let piece = prop::sample::select(vec![
        "0=1\n",
        "=",
        "\n",
        "[",
        "]",
        ",",
        ";",
        "99999999999",
        "4",
        "\r",
        " ",
        "\u{e9}",
        "-1",
        "1=\n",
        "[WARP COLORS]\n",
        "[TIEUP]\n0=1\n",
        "Entries=0\n",
        "[COLOR TABLE]\n0=1,2,3\n",
        "Range=9\n",
    ]);
    prop_oneof![
        (at.clone(), any::<u8>()).prop_map(|(at, byte)| Damage::Replace(at, byte)),
        at.clone().prop_map(Damage::Remove),
        (at.clone(), piece).prop_map(|(at, piece)| Damage::Insert(at, piece)),
        at.clone().prop_map(Damage::DoubleLine),
        (at.clone(), at).prop_map(|(a, b)| Damage::SwapLines(a, b)),
    ]
}

fn damaged(damages: &[Damage]) -> Vec<u8> {
    let mut bytes = FILE.as_bytes().to_vec();
    for damage in damages {
        let length = bytes.len().max(1);
        let mut lines: Vec<Vec<u8>> =
            bytes.split_inclusive(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
        let count = lines.len().max(1);
        match *damage {
            _ if bytes.is_empty() => {}
            Damage::Replace(at, byte) => bytes[at % length] = byte,
            Damage::Remove(at) => drop(bytes.remove(at % length)),
            Damage::Insert(at, piece) => {
                drop(bytes.splice(at % length..at % length, piece.bytes()));
            }
            Damage::DoubleLine(at) => {
                lines.insert(at % count, lines[at % count].clone());
                bytes = lines.concat();
            }
            Damage::SwapLines(a, b) => {
                lines.swap(a % count, b % count);
                bytes = lines.concat();
            }
        }
    }
    bytes
}

/// What must hold for any bytes; `Err` tells what does not.
fn check_bytes(bytes: &[u8]) -> Result<(), TestCaseError> {
    let first = parse(bytes);
    prop_assert_eq!(first.document.as_bytes(), bytes);
    let whole: usize =
        first.document.sections().map(|section| section.span().end - section.span().start).sum();
    prop_assert!(
        whole == bytes.len() || whole + 3 == bytes.len(),
        "sections take {} of {}",
        whole,
        bytes.len()
    );
    for diagnostic in &first.diagnostics {
        let shown = diagnostic.display(bytes).to_string();
        prop_assert!(shown.contains(diagnostic.code.as_str()), "{}", shown);
        prop_assert!(!diagnostic.message().is_empty() && !diagnostic.message().ends_with('.'));
    }
    if let Some(draft) = first.draft {
        let text = draft.to_wif();
        let again = parse(text.as_bytes());
        prop_assert_eq!(again.draft.as_ref(), Some(&draft), "by way of\n{}", text);
        prop_assert_eq!(again.draft.map(|draft| draft.to_wif()), Some(text));
    }
    Ok(())
}

proptest! {
    #[test]
    fn written_drafts_read_back(draft in drafts()) {
        let text = draft.to_wif();
        let parse = parse(text.as_bytes());
        prop_assert_eq!(parse.draft.as_ref(), Some(&draft), "{}", text);
        let untrue = [
            Code::MissingSection, Code::ContentsListsAbsent, Code::DuplicateSection, Code::NoEquals,
            Code::CountMissing, Code::ShedAssumed, Code::UnitsAssumed, Code::RangeAssumed, Code::BadKey,
            Code::BadNumber, Code::KeyBeyond, Code::ZeroBased,
        ];
        let found = parse.diagnostics.iter().find(|found| untrue.contains(&found.code));
        prop_assert!(found.is_none(), "{:?} in\n{}", found, text);
    }

    #[test]
    fn drawdowns_are_threading_by_tieup_by_treadling(draft in drafts()) {
        if let Ok(drawdown) = draft.drawdown() {
            for pick in 0..draft.weft.count {
                for end in 0..draft.warp.count {
                    let woven = drawdown.warp_on_top(end as usize, pick as usize);
                    prop_assert_eq!(woven, on_top(&draft, end, pick), "end {} pick {}", end, pick);
                }
            }
        } else {
            prop_assert!(draft.threading.is_empty() || draft.plan().is_none());
        }
    }

    #[test]
    fn conversions_keep_the_drawdown(draft in drafts()) {
        if let Ok(drawdown) = draft.drawdown() {
            let lifted = draft.to_liftplan();
            prop_assert_eq!(lifted.drawdown(), Ok(drawdown.clone()));
            prop_assert_eq!(lifted.to_tieup().drawdown(), Ok(drawdown));
        }
    }

    #[test]
    fn any_bytes_are_read(bytes in vec(any::<u8>(), 0..300)) {
        check_bytes(&bytes)?;
    }

    #[test]
    fn any_text_of_the_format_is_read(
        bytes in "(\\[(WARP|WEFT|TIEUP|THREADING|COLOR TABLE|NOTES|WARP COLORS|X)\\]?[\n\r ]|[0-3]{0,2}=[0-3,; x.]{0,5}\n|Threads=[0-3]\n){0,30}"
    ) {
        check_bytes(bytes.as_bytes())?;
    }

    #[test]
    fn damaged_files_are_read(damages in vec(damage(), 1..12)) {
        check_bytes(&damaged(&damages))?;
    }

    #[test]
    fn an_edit_changes_its_line_only(
        damages in vec(damage(), 0..4),
        section in prop::sample::select(vec!["WARP", "TEXT", "weaving", "LIFTPLAN", "PRIVATE X Y"]),
        key in prop::sample::select(vec!["Threads", "1", "Title", "rising shed"]),
        value in "[a-z0-9,]{1,6}",
    ) {
        let before = Document::new(damaged(&damages));
        let mut after = before.clone();
        prop_assume!(after.set(section, key, &value).is_ok());
        let found = after.get(section, key);
        prop_assert_eq!(found.as_deref(), Some(value.as_str()));
        let lines = |document: &Document| -> Vec<Vec<u8>> {
            document.as_bytes().split(|&b| b == b'\n' || b == b'\r').map(<[u8]>::to_vec).collect()
        };
        let (old, new) = (lines(&before), lines(&after));
        let same = old.iter().zip(&new).take_while(|(a, b)| a == b).count();
        let same_end = old.iter().rev().zip(new.iter().rev()).take_while(|(a, b)| a == b).count();
        if before.get(section, key).is_some() {
            prop_assert_eq!(old.len(), new.len());
            prop_assert!(same + same_end + 1 >= old.len(), "more than a line changed");
        } else {
            prop_assert!(same + same_end >= old.len(), "a line changed");
        }
    }
}
