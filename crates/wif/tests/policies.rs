//! Each choice of `docs/dialects.md`, shown on the smallest file that needs it.

use selvedge_wif::{
    Code, DEFAULT_WARP_COLOR, DEFAULT_WEFT_COLOR, Draft, Drawdown, DrawdownError, DrawdownOptions,
    Encoding, Options, Parse, Plan, Rgb8, Severity, Side, Units, parse, parse_with,
};

/// A complete draft of four ends and two picks on two shafts, to which `more` is added.
fn with(more: &str) -> String {
    format!(
        "[WIF]\nVersion=1.1\n[CONTENTS]\nWEAVING=yes\nWARP=yes\nWEFT=yes\nTHREADING=yes\n\
         [WEAVING]\nShafts=2\nTreadles=2\nRising Shed=yes\n[WARP]\nThreads=4\n[WEFT]\nThreads=2\n\
         [THREADING]\n1=1\n2=2\n3=1\n4=2\n{more}"
    )
}

fn codes(parse: &Parse) -> Vec<Code> {
    let mut codes: Vec<_> = parse.diagnostics.iter().map(|found| found.code).collect();
    codes.sort_unstable();
    codes.dedup();
    codes
}

/// The draft, which the file must give with this code among its diagnostics.
#[track_caller]
fn draft_with(text: &str, code: Code) -> Draft {
    let parse = parse(text.as_bytes());
    assert!(codes(&parse).contains(&code), "no {code} in {:?} of:\n{text}", parse.diagnostics);
    parse.draft.unwrap_or_else(|| panic!("no draft: {:?}", parse.diagnostics))
}

#[track_caller]
fn draft(text: &str) -> Draft {
    let parse = parse(text.as_bytes());
    parse.draft.unwrap_or_else(|| panic!("no draft: {:?}", parse.diagnostics))
}

/// One line per pick, one character per end: `1` where the warp is on top.
fn grid(drawdown: &Drawdown) -> Vec<String> {
    let row = |pick| {
        (0..drawdown.ends())
            .map(|end| if drawdown.warp_on_top(end, pick) { '1' } else { '0' })
            .collect()
    };
    (0..drawdown.picks()).map(row).collect()
}

#[track_caller]
fn woven(text: &str) -> Vec<String> {
    grid(&draft(text).drawdown().expect("the draft has a plan"))
}

#[test]
fn lift_plan_lifts_shafts() {
    assert_eq!(woven(&with("[LIFTPLAN]\n1=1\n2=2\n")), ["1010", "0101"]);
}

#[test]
fn treadles_lift_what_they_tie_and_several_are_pressed_together() {
    let tied = "[TIEUP]\n1=1\n2=2\n[TREADLING]\n1=2\n2=1,2\n";
    assert_eq!(woven(&with(tied)), ["0101", "1111"]);
}

#[test]
fn on_a_sinking_shed_the_others_rise() {
    let text = with("[LIFTPLAN]\n1=1\n2=0\n").replace("Shed=yes", "Shed=no");
    assert_eq!(woven(&text), ["0101", "1111"]);
}

#[test]
fn an_end_on_no_shaft_never_rises_and_one_on_several_rises_with_any() {
    let text = with("[LIFTPLAN]\n1=1\n2=2\n").replace("1=1\n2=2\n3=1\n4=2\n", "2=0\n3=1,2\n4=2\n");
    assert_eq!(woven(&text), ["0010", "0011"]);
    assert_eq!(woven(&text.replace("Shed=yes", "Shed=no")), ["0011", "0010"]);
}

#[test]
fn lines_and_sections_come_in_any_order_and_case() {
    let text = "[liftplan]\r\n2 = 2 ; up\r1=1\n[  weft ]\nTHREADS=2\n[threading]\n4=2\n3=1\n1=1\n2=2\n\
                [Warp]\nthreads = 4\n";
    assert_eq!(woven(text), ["1010", "0101"]);
}

#[test]
fn keys_before_any_header_are_those_of_wif() {
    let text = format!("; made by hand\nSource Program=Loom\n{}", with(""));
    assert_eq!(draft_with(&text, Code::NoHeader).source.program, "Loom");
}

#[test]
fn text_after_a_header_is_ignored() {
    let text = with("[LIFTPLAN] (by hand)\n1=1\n2=2\n");
    assert_eq!(draft_with(&text, Code::TextAfterHeader).liftplan.get(0), [0]);
    let text = with("[LIFTPLAN\n1=1\n2=2\n");
    assert_eq!(draft_with(&text, Code::UnclosedHeader).liftplan.get(0), [0]);
}

#[test]
fn the_last_of_equal_keys_counts() {
    let draft = draft_with(&with("[LIFTPLAN]\n2=2\n1=2\n1=1\n"), Code::DuplicateKey);
    assert_eq!((draft.liftplan.get(0), draft.liftplan.get(1)), (&[0][..], &[1][..]));
    let text = with("").replace("Threads=4", "Threads=3\nThreads=4");
    assert_eq!(draft_with(&text, Code::DuplicateKey).warp.count, 4);
}

#[test]
fn equal_sections_are_merged() {
    let draft = draft_with(&with("[LIFTPLAN]\n1=1\n[LIFTPLAN]\n2=2\n"), Code::DuplicateSection);
    assert_eq!((draft.liftplan.get(0), draft.liftplan.get(1)), (&[0][..], &[1][..]));
}

#[test]
fn a_second_warp_colors_is_that_of_the_weft_if_there_is_none() {
    let table = "[COLOR PALETTE]\nRange=0,255\n[COLOR TABLE]\n1=1,1,1\n2=2,2,2\n";
    let twice = "[WARP COLORS]\n1=1\n[WARP COLORS]\n1=2\n";
    let draft = draft_with(&with(&format!("{table}{twice}")), Code::MisnamedSection);
    assert_eq!((draft.warp.colors.get(0), draft.weft.colors.get(0)), (Some(&1), Some(&2)));
    let merged = with(&format!("{table}{twice}[WEFT COLORS]\n2=1\n"));
    let draft = draft_with(&merged, Code::DuplicateSection);
    assert_eq!((draft.warp.colors.get(0), draft.weft.colors.get(0)), (Some(&2), None));
}

#[test]
fn lines_without_equals_and_items_without_digits_are_skipped() {
    let draft = draft_with(&with("[LIFTPLAN]\nby hand\n1=1,x,2\n2=2\n"), Code::NoEquals);
    assert_eq!(draft.liftplan.get(0), [0, 1]);
    assert_eq!(draft_with(&with("[LIFTPLAN]\n1=1,x,2\n"), Code::BadNumber).liftplan.get(0), [0, 1]);
    assert_eq!(
        draft_with(&with("[LIFTPLAN]\n1=2 up\n"), Code::TextAfterNumber).liftplan.get(0),
        [1]
    );
    assert_eq!(draft_with(&with("[LIFTPLAN]\nx=2\n1=2\n"), Code::BadKey).liftplan.get(0), [1]);
}

#[test]
fn zero_and_blank_mean_unused() {
    let draft = draft(&with("[LIFTPLAN]\n1=0,2\n2=\n"));
    assert_eq!((draft.liftplan.get(0), draft.liftplan.get(1)), (&[1][..], &[][..]));
}

#[test]
fn a_plan_without_a_value_is_absent() {
    let both = "[LIFTPLAN]\n1=\n2= ; none\n[TIEUP]\n1=2\n[TREADLING]\n1=1\n";
    let draft = draft(&with(both));
    assert_eq!(draft.plan(), Some(Plan::TieUp));
    assert_eq!(grid(&draft.drawdown().unwrap()), ["0101", "0000"]);
}

#[test]
fn keys_beyond_the_threads_are_ignored() {
    let draft = draft_with(&with("[LIFTPLAN]\n1=1\n2=1\n3=9\n0=1\n"), Code::KeyBeyond);
    assert_eq!((draft.liftplan.len(), draft.shafts), (2, 2));
    // A plan of which nothing is left is still one: it lifts nothing.
    let text = with("[LIFTPLAN]\n3=1\n[TIEUP]\n1=1\n[TREADLING]\n1=1\n");
    assert_eq!(woven(&text), ["0000", "0000"]);
}

#[test]
fn a_section_from_zero_is_shifted() {
    let text = with("[LIFTPLAN]\n0=1\n1=2\n");
    assert_eq!(grid(&draft_with(&text, Code::ZeroBased).drawdown().unwrap()), ["1010", "0101"]);
    let tied = with("[TIEUP]\n0=2\n1=1\n[TREADLING]\n1=1\n2=2\n");
    assert_eq!(grid(&draft_with(&tied, Code::ZeroBased).drawdown().unwrap()), ["0101", "1010"]);
    // Without a number of treadles, the last is the largest pressed.
    let unknown = |treadling: &str| {
        let text = format!("[TIEUP]\n0=2\n1=1\n2=2\n[TREADLING]\n{treadling}");
        woven(&with(&text).replace("Treadles=2\n", ""))
    };
    assert_eq!(unknown("1=3\n2=1\n"), ["0101", "0101"]);
    assert_eq!(unknown("1=1\n2=2\n"), ["1010", "0101"]);
    let one = with("[TIEUP]\n0=2\n").replace("Treadles=2\n", "");
    assert_eq!((draft(&one).treadles, draft(&one).tieup.get(0)), (1, &[1][..]));
    // Whether there are lines beyond the last does not matter.
    assert_eq!(woven(&with("[LIFTPLAN]\n0=1\n1=2\n7=1,2\n")), ["1010", "0101"]);
    assert_eq!(woven(&with("[LIFTPLAN]\n0=1\n1=2\n2=1\n")), ["0101", "1010"]);
}

#[test]
fn shafts_and_treadles_beyond_raise_their_number() {
    let draft = draft_with(&with("[LIFTPLAN]\n1=5\n"), Code::ShaftsRaised);
    assert_eq!(draft.shafts, 5);
    let draft = draft_with(&with("[TIEUP]\n4=1\n[TREADLING]\n1=3\n"), Code::TreadlesRaised);
    assert_eq!(draft.treadles, 4);
    let none = with("[TIEUP]\n1=1\n").replace("Treadles=2", "Treadles=0");
    assert_eq!(draft_with(&none, Code::TreadlesRaised).treadles, 1);
}

#[test]
fn missing_counts_are_those_of_the_data() {
    let text =
        "[THREADING]\n1=1\n5=3\n[TREADLING]\n1=2\n2=1\n[TIEUP]\n1=1\n4=2\n[WEAVING]\nShafts=\n";
    let draft = draft_with(text, Code::CountMissing);
    assert_eq!((draft.warp.count, draft.weft.count, draft.shafts, draft.treadles), (5, 2, 3, 4));
}

#[test]
fn no_threads_and_no_data_is_an_error() {
    let parse = parse(b"[WARP]\n[WEFT]\nThreads=2\n[WEAVING]\nShafts=2\n");
    assert!(parse.draft.is_none() && codes(&parse).contains(&Code::NoThreads));
    assert_eq!(parse.severity(), Some(Severity::Error));
}

#[test]
fn the_shed_rises_unless_told_otherwise() {
    for shed in ["", "Rising Shed=\n"] {
        let text = with("[LIFTPLAN]\n1=1\n2=2\n").replace("Rising Shed=yes\n", shed);
        let draft = draft_with(&text, Code::ShedAssumed);
        assert_eq!(grid(&draft.drawdown().unwrap()), ["1010", "0101"]);
    }
    assert!(draft_with(&with("").replace("Shed=yes", "Shed=up"), Code::BadBoolean).rising_shed);
    let remarked = with("").replace("Shed=yes", "Shed=no sinking");
    assert!(!draft_with(&remarked, Code::TextAfterNumber).rising_shed);
}

#[test]
fn the_lift_plan_weaves_where_plans_differ() {
    let both = "[LIFTPLAN]\n1=1\n2=2\n[TIEUP]\n1=1\n2=2\n[TREADLING]\n1=1\n2=1\n";
    let draft = draft_with(&with(both), Code::PlansDiffer);
    assert_eq!(grid(&draft.drawdown().unwrap()), ["1010", "0101"]);
    let options = DrawdownOptions { plan: Some(Plan::TieUp), ..DrawdownOptions::default() };
    assert_eq!(grid(&draft.drawdown_with(&options).unwrap()), ["1010", "1010"]);
    let alone = self::draft(&with("[LIFTPLAN]\n1=2\n"));
    assert_eq!(grid(&alone.drawdown_with(&options).unwrap()), ["0101", "0000"]);
    let parse = parse(with(both).as_bytes());
    let differ = parse.diagnostics.iter().find(|found| found.code == Code::PlansDiffer).unwrap();
    assert!(differ.message().contains("pick 2"), "{differ}");

    let agree = parse_with(with(&both.replace("2=1", "2=2")).as_bytes(), &Options::default());
    assert!(!codes(&agree).contains(&Code::PlansDiffer), "{:?}", agree.diagnostics);
}

#[test]
fn without_a_plan_only_the_drawdown_fails() {
    let draft = draft_with(&with(""), Code::NoWeave);
    assert_eq!(draft.drawdown().unwrap_err(), DrawdownError::NoPlan);
    let draft = draft_with("[WARP]\nThreads=1\n[LIFTPLAN]\n1=1\n", Code::NoWeave);
    assert_eq!(draft.drawdown().unwrap_err(), DrawdownError::NoThreading);
}

#[test]
fn colors_scale_from_their_range() {
    let table = |range: &str| {
        let palette =
            format!("[COLOR PALETTE]\n{range}\n[COLOR TABLE]\n7=0,999,500\n[WARP COLORS]\n2=7\n");
        draft(&with(&palette)).thread(Side::Warp, 1).color
    };
    assert_eq!(table("Range=0,999"), Rgb8([0, 255, 128]));
    assert_eq!(table("Range=999"), Rgb8([0, 255, 128]));
    assert_eq!(table(""), Rgb8([0, 255, 128]));
    assert_eq!(table("Range=0,1998"), Rgb8([0, 128, 64]));
    assert_eq!(table("Range=0,255"), Rgb8([0, 255, 255]));
    assert_eq!(table("Range=9,3"), Rgb8([0, 255, 128]));
    let wide = with("[COLOR TABLE]\n1=5000,999,0\n[WARP COLORS]\n1=1\n");
    let color = draft_with(&wide, Code::ColorRange).thread(Side::Warp, 0).color;
    assert_eq!(color, Rgb8([255, 255, 0]));
}

#[test]
fn threads_without_a_usable_color_have_a_default() {
    let assumed = draft_with(&with(""), Code::ColorsAssumed);
    assert_eq!(assumed.thread(Side::Warp, 0).color, DEFAULT_WARP_COLOR);
    assert_eq!(assumed.thread(Side::Weft, 0).color, DEFAULT_WEFT_COLOR);

    let table =
        "[COLOR PALETTE]\nRange=0,255\n[COLOR TABLE]\n1=9,9,9\n[WARP COLORS]\n1=1\n2=4\n3=0\n";
    let outside = draft_with(&with(table), Code::ColorOutside);
    let colors = [0, 1, 2].map(|end| outside.thread(Side::Warp, end).color);
    assert_eq!(colors, [Rgb8([9, 9, 9]), DEFAULT_WARP_COLOR, DEFAULT_WARP_COLOR]);

    let inline = draft(&with("").replace("Threads=4", "Threads=4\nColor=3,1,2,3"));
    assert_eq!(inline.thread(Side::Warp, 0).color, Rgb8([1, 2, 3]));
    assert_eq!(inline.thread(Side::Warp, 0).color_number, Some(3));
}

#[test]
fn a_color_table_from_zero_is_shifted_unless_its_numbers_are_used() {
    let color = |entries: &str, number: u32| {
        let table = "[COLOR TABLE]\n0=10,10,10\n1=11,11,11\n2=12,12,12\n";
        let text =
            format!("[COLOR PALETTE]\n{entries}Range=0,255\n{table}[WARP COLORS]\n1={number}\n");
        draft(&with(&text)).thread(Side::Warp, 0).color.0[0]
    };
    let found = [1, 2, 3].map(|number| color("Entries=3\n", number));
    assert_eq!(found, [10, 11, 12]);
    assert_eq!([0, 1, 2, 3].map(|number| color("", number)), [10, 11, 12, 12]);
    assert_eq!(color("Entries=3\n", 0), 10);
}

#[test]
fn lengths_come_in_three_units() {
    let lengths = "Threads=4\nUnits= inches\nSpacing=0.1\nThickness=0.05";
    let text = with("[WARP SPACING]\n2=0.2\n3=0\n").replace("Threads=4", lengths);
    let inches = draft(&text);
    let pitches = [0, 1, 2].map(|end| inches.thread(Side::Warp, end).pitch.unwrap());
    assert_eq!(pitches, [0.1 * 0.0254, 0.2 * 0.0254, 0.1 * 0.0254]);
    assert_eq!(inches.thread(Side::Warp, 3).diameter, Some(0.05 * 0.0254));
    assert_eq!(inches.thread(Side::Weft, 0).pitch, None);

    let pitch = |text: &str| draft(text).thread(Side::Warp, 0).pitch.unwrap();
    assert!((pitch(&text.replace("inches", "Decipoints")) - 0.1 * 0.0254 / 720.0).abs() < 1e-12);
    let bare = text.replace("Units= inches\n", "");
    assert_eq!(draft_with(&bare, Code::UnitsAssumed).warp.units, Units::Centimeters);
    assert!((pitch(&bare) - 0.001).abs() < 1e-12);
    draft_with(&text.replace("inches", "furlongs"), Code::BadUnits);
    draft_with(&text.replace("Spacing=0.1", "Spacing=0,1"), Code::DecimalComma);
    draft_with(&text.replace("Thickness=0.05", "Thickness=0.5"), Code::ThickYarn);
    let remarked = text.replace("Spacing=0.1", "Spacing=0.1 or so");
    assert_eq!(draft_with(&remarked, Code::TextAfterNumber).warp.spacing, Some(0.1));
}

#[test]
fn lengths_that_archives_make_up_are_told() {
    let text = |lengths: &str| with("").replace("Threads=4", &format!("Threads=4\n{lengths}"));
    for lengths in ["Spacing=0.0185\nThickness=0.0213", "Spacing=.0185", "Thickness=0.0213"] {
        draft_with(&text(lengths), Code::DummySpacing);
    }
    let inches = parse(text("Units=inches\nSpacing=0.0185").as_bytes());
    assert!(!codes(&inches).contains(&Code::DummySpacing), "{:?}", inches.diagnostics);
}

#[test]
fn text_is_utf_8_or_windows_1252() {
    let text = with("[TEXT]\nTitle=Köper; blau\n");
    assert_eq!(draft(&text).text.title, "Köper; blau");
    let marked = format!("\u{feff}{text}");
    assert_eq!(draft(&marked), draft(&text));
    let bytes: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let old = parse(&bytes);
    assert_eq!(old.document.encoding(), Encoding::Windows1252);
    assert!(codes(&old).contains(&Code::Windows1252), "{:?}", old.diagnostics);
    assert_eq!(old.draft.unwrap(), draft(&text));
}

#[test]
fn notes_keep_every_line() {
    let notes = "[NOTES]\n2=second; with semicolon\n1=first\nunnumbered, a=b\n";
    assert_eq!(draft(&with(notes)).notes, ["first", "unnumbered, a=b", "second; with semicolon"]);
}

#[test]
fn what_is_not_of_the_format_is_kept() {
    let foreign = "[PRIVATE  Loom  Data]\n free = text \n==\n\n[TW THING]\nx\n";
    let draft = draft_with(&with(foreign), Code::UnknownSection);
    let found: Vec<_> = draft.foreign.iter().map(|s| (s.name.as_str(), s.text.as_str())).collect();
    assert_eq!(found, [("PRIVATE Loom Data", " free = text \n=="), ("TW THING", "x")]);
}

#[test]
fn contents_are_checked_and_never_trusted() {
    let text = with("[LIFTPLAN]\n1=1\n");
    assert_eq!(draft_with(&text, Code::ContentsOmits).liftplan.get(0), [0]);
    draft_with(&text.replace("WARP=yes", "WARP=yes\nTIEUP=true"), Code::ContentsListsAbsent);
    let listed = |lines: &str| {
        let found = parse(text.replace("WARP=yes", &format!("WARP=yes\n{lines}")).as_bytes());
        codes(&found)
    };
    let twice = listed("LIFTPLAN=no\nLIFTPLAN=yes");
    assert!(twice.contains(&Code::DuplicateKey) && !twice.contains(&Code::ContentsOmits));
    assert!(listed("LIFTPLAN=yes\nLIFTPLAN=no").contains(&Code::ContentsOmits));
    draft_with("[WARP]\nThreads=1\n[WEFT]\nThreads=1\n", Code::MissingSection);
}

#[test]
fn strict_refuses_what_lenient_warns_of() {
    let strict = Options::default().with_strict(true);
    let clean =
        with("[LIFTPLAN]\n1=1\n2=2\n").replace("THREADING=yes", "THREADING=yes\nLIFTPLAN=1");
    assert!(parse_with(clean.as_bytes(), &strict).draft.is_some());
    let warned = with("[LIFTPLAN]\n1=1\n2=2\n");
    assert!(parse_with(warned.as_bytes(), &strict).draft.is_none());
}

#[test]
fn what_is_no_draft_says_so() {
    let cases: [(&[u8], Code); 7] = [
        (b"", Code::EmptyFile),
        (b"\xef\xbb\xbf \r\n; nothing\n", Code::EmptyFile),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", Code::NotText),
        (b"\xff\xfe[\0W\0", Code::NotText),
        (b"dear diary\n[today]\nx=1\n", Code::NotWif),
        (b"[WARP]\nThreads=4000000000\n[WEFT]\nThreads=1", Code::Limit),
        (b"[WARP]\nThreads=9999999999999999999\n[WEFT]\nThreads=1", Code::Limit),
    ];
    for (bytes, code) in cases {
        let parse = parse(bytes);
        assert!(parse.draft.is_none(), "{}", bytes.escape_ascii());
        assert!(codes(&parse).contains(&code), "{code}: {:?}", parse.diagnostics);
        assert_eq!(code.severity(), Severity::Error);
    }
}

#[test]
fn the_limit_on_threads_can_be_set() {
    let text =
        "[WARP]\nThreads=200000\n[WEFT]\nThreads=200000\n[THREADING]\n200000=1\n[LIFTPLAN]\n1=1\n";
    assert!(parse(text.as_bytes()).draft.is_none());
    let options = Options::default().with_max_threads(200_000);
    let draft = parse_with(text.as_bytes(), &options).draft.unwrap();
    let bytes = 200_000 / 64 * 8 * 200_000;
    let error = draft.drawdown().unwrap_err();
    assert_eq!(error, DrawdownError::TooLarge { bytes, limit: 256 << 20 });
    assert_eq!(error.to_string(), "drawdown: takes 5000000000 bytes, expected at most 268435456");
}
