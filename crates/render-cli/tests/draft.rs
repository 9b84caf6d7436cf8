//! `selvedge draft`: what each subcommand writes, where to, and with which exit code.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use serde_json::{Value, json};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

/// All sound drafts of the fixtures.
fn drafts() -> Vec<PathBuf> {
    let entries = fs::read_dir(fixtures().join("drafts")).unwrap();
    let mut drafts: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    drafts.sort();
    assert!(drafts.len() >= 16, "{drafts:?}");
    drafts
}

/// Runs `selvedge draft` in `folder`, for a terminal of 80 columns, with `input` to read.
fn draft_in(folder: &Path, arguments: &str, input: &[u8]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .current_dir(folder)
        .arg("draft")
        .args(arguments.split_whitespace())
        .env("COLUMNS", "80")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // A program that does not read closes its end.
    let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
}

/// Runs `selvedge draft` among the fixtures.
fn draft(arguments: &str) -> Output {
    draft_in(&fixtures(), arguments, b"")
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// Standard output of a run that must succeed.
#[track_caller]
fn done(output: &Output) -> &str {
    assert_eq!(code(output), 0, "{}", stderr(output));
    stdout(output)
}

/// Three ends in red, green, blue and two picks in white and black; pick 1 lifts end 1 only, pick 2
/// ends 2 and 3. Nothing in it is symmetric.
const SMALL: &str = "\
[WIF]
Version=1.1
[CONTENTS]
WEAVING=1
WARP=1
WEFT=1
COLOR PALETTE=1
COLOR TABLE=1
THREADING=1
LIFTPLAN=1
WARP COLORS=1
WEFT COLORS=1
[WEAVING]
Shafts=2
Treadles=0
Rising Shed=1
[WARP]
Threads=3
Units=Centimeters
Spacing=0.1
[WEFT]
Threads=2
Units=Inches
Spacing=0.1
[COLOR PALETTE]
Entries=5
Range=0,255
[COLOR TABLE]
1=255,0,0
2=0,255,0
3=0,0,255
4=255,255,255
5=0,0,0
[THREADING]
1=1
2=2
3=2
[LIFTPLAN]
1=1
2=2
[WARP COLORS]
1=1
2=2
3=3
[WEFT COLORS]
1=4
2=5
";

const RED: [u8; 3] = [255, 0, 0];
const GREEN: [u8; 3] = [0, 255, 0];
const BLUE: [u8; 3] = [0, 0, 255];
const WHITE: [u8; 3] = [255; 3];
const BLACK: [u8; 3] = [0; 3];
const LINE: [u8; 3] = [128; 3];

/// The rows of the picture of [`SMALL`], top first.
fn picture(options: &str) -> Vec<Vec<[u8; 3]>> {
    let folder = tempfile::tempdir().unwrap();
    let arguments = format!("drawdown - --format png {options}");
    let output = draft_in(folder.path(), &arguments, SMALL.as_bytes());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let image = image::load_from_memory(&output.stdout).unwrap().into_rgb8();
    image.rows().map(|row| row.map(|pixel| pixel.0).collect()).collect()
}

#[test]
fn plain_and_twill_are_drawn_as_by_hand() {
    let plain = draft("drawdown drafts/plain.wif --format text");
    assert_eq!(done(&plain), "10101010\n01010101\n".repeat(4));
    let twill = draft("drawdown drafts/twill-2-1.wif --format text");
    assert_eq!(done(&twill), "110110110110\n011011011011\n101101101101\n".repeat(4));
}

#[test]
fn text_has_pick_1_first_and_end_1_first() {
    let here = Path::new(".");
    let face = draft_in(here, "drawdown - --format text", SMALL.as_bytes());
    assert_eq!(done(&face), "100\n011\n");
    let back = draft_in(here, "drawdown - --format text --back", SMALL.as_bytes());
    assert_eq!(done(&back), "110\n001\n");
}

#[test]
fn picture_has_end_1_at_the_left_and_pick_1_at_the_bottom() {
    assert_eq!(picture("--scale 1"), [[BLACK, GREEN, BLUE], [RED, WHITE, WHITE]]);
    assert_eq!(picture("--scale 1 --back"), [[BLACK, BLACK, RED], [BLUE, GREEN, WHITE]]);
}

#[test]
fn scale_and_grid_make_squares_and_lines() {
    let two = picture("--scale 2");
    assert_eq!(two.len(), 4);
    assert_eq!(two[0], [BLACK, BLACK, GREEN, GREEN, BLUE, BLUE]);
    assert_eq!((&two[0], &two[2]), (&two[1], &two[3]));
    assert_eq!(two[3], [RED, RED, WHITE, WHITE, WHITE, WHITE]);

    let grid = picture("--scale 1 --grid");
    let line = vec![LINE; 7];
    let top = vec![LINE, BLACK, LINE, GREEN, LINE, BLUE, LINE];
    let bottom = vec![LINE, RED, LINE, WHITE, LINE, WHITE, LINE];
    assert_eq!(grid, [line.clone(), top, line.clone(), bottom, line]);

    let default = picture("");
    assert_eq!((default.len(), default[0].len()), (2 * 16, 3 * 16));
}

#[test]
fn pictures_of_large_drafts_fit_a_screen() {
    let folder = tempfile::tempdir().unwrap();
    for options in ["", "--grid"] {
        for draft in drafts() {
            let arguments = format!("drawdown {} -q -o out.png {options}", draft.display());
            let output = draft_in(folder.path(), &arguments, b"");
            assert_eq!(done(&output), "");
            let (width, height) = image::image_dimensions(folder.path().join("out.png")).unwrap();
            assert!(width <= 1024 && height <= 1024, "{width} x {height}: {}", draft.display());
        }
    }
}

#[test]
fn picture_over_the_limit_is_refused() {
    let output = draft("drawdown drafts/tartan.wif -o - --format png --scale 256");
    let message = "error: drafts/tartan.wif: found 1358954496 pixels, expected at most 67108864\n";
    assert_eq!((code(&output), stdout(&output), stderr(&output)), (1, "", message));
}

#[test]
fn output_tells_text_from_picture() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (arguments, name, start) in [
        ("-o a.png", "a.png", b"\x89PNG".as_slice()),
        ("-o a.TXT", "a.TXT", b"100\n"),
        ("--format text -o a.png", "a.png", b"100\n"),
        ("--format png -o a", "a", b"\x89PNG"),
    ] {
        let output = draft_in(here, &format!("drawdown - {arguments}"), SMALL.as_bytes());
        assert_eq!(done(&output), "", "{arguments}");
        assert!(fs::read(here.join(name)).unwrap().starts_with(start), "{arguments}");
    }
    let output = draft_in(here, "drawdown - -o - --format text", SMALL.as_bytes());
    assert_eq!(done(&output), "100\n011\n");
}

#[test]
fn wrong_command_lines() {
    for (arguments, expected) in [
        ("drawdown x.wif", "the following required arguments were not provided:"),
        ("drawdown x.wif -o a.gif", "invalid value 'a.gif' for '--output <OUT>'"),
        ("drawdown x.wif -o -", "invalid value '-' for '--output <OUT>'"),
        (
            "drawdown x.wif -o a.txt --grid",
            "the argument '--grid' cannot be used with '--format text'",
        ),
        (
            "drawdown x.wif --format text --scale 2",
            "the argument '--scale <N>' cannot be used with '--format text'",
        ),
        ("drawdown x.wif -o a.png --scale 0", "invalid value '0' for '--scale <N>'"),
        ("format - -i", "the argument '--in-place' cannot be used with 'standard input'"),
        ("format x.wif -i -o y", "the argument '--in-place' cannot be used with '--output <OUT>'"),
        ("convert x.wif", "the following required arguments were not provided:"),
        (
            "convert x.wif --liftplan --tieup",
            "the argument '--liftplan' cannot be used with '--tieup'",
        ),
        ("lint", "the following required arguments were not provided:"),
    ] {
        let output = draft(arguments);
        assert_eq!((code(&output), stdout(&output)), (2, ""), "{arguments}");
        let found = stderr(&output);
        assert!(found.starts_with(&format!("error: {expected}")), "{arguments}: {found}");
    }
}

#[test]
fn lint_tells_by_its_exit_code() {
    for (arguments, expected) in [
        ("drafts/plain.wif", 0),
        ("--strict drafts/plain.wif", 0),
        ("--strict invalid/windows-1252.wif", 0),
        ("invalid/key-beyond.wif", 0),
        ("--strict invalid/key-beyond.wif", 3),
        ("--strict drafts/plain.wif invalid/key-beyond.wif", 3),
        ("invalid/bad-key.wif", 1),
        ("--strict invalid/key-beyond.wif invalid/bad-key.wif", 1),
        ("invalid/not-text.wif", 1),
        ("missing.wif", 1),
        ("--strict invalid/key-beyond.wif missing.wif", 1),
    ] {
        assert_eq!(code(&draft(&format!("lint {arguments}"))), expected, "{arguments}");
    }
}

#[test]
fn lint_shows_findings_in_their_lines() {
    let output = draft("lint --strict invalid/windows-1252.wif invalid/key-beyond.wif");
    let expected = "\
note[windows-1252]: not UTF-8, expected that; the file is read as windows-1252
  --> invalid/windows-1252.wif:43:8
43 | Title=Köper
   |        ^

warning[key-beyond]: end 5 is ignored, expected at most 4
  --> invalid/key-beyond.wif:33:1 in [THREADING]
33 | 5=1
   | ^^^

warning[key-beyond]: pick 0 is ignored, expected at least 1
  --> invalid/key-beyond.wif:38:1 in [TREADLING]
38 | 0=2
   | ^^^

2 files: 2 warnings, 1 note; --strict allows no warnings
";
    assert_eq!((stdout(&output), stderr(&output), code(&output)), (expected, "", 3));
}

#[test]
fn lint_goes_on_after_a_file_that_cannot_be_read() {
    let output = draft("lint missing.wif drafts/plain.wif drafts");
    assert_eq!(stdout(&output), "3 files: 2 unreadable\n");
    let expected =
        "error: missing.wif: no such file\nerror: drafts: found a folder, expected a WIF file\n";
    assert_eq!((stderr(&output), code(&output)), (expected, 1));
    let output = draft("lint drafts/plain.wif");
    assert_eq!(done(&output), "drafts/plain.wif: nothing found\n");
}

/// Carets stand below what is meant whatever stands before it, and no line is wider than 80.
#[test]
fn lint_fits_long_and_foreign_lines() {
    let numbers = vec!["1"; 500].join(",");
    let rows = [
        (format!("1={numbers},hier,{numbers}"), "hier"),
        ("2=\t\t1,\thier\t".to_owned(), "hier"),
        ("3=ä€ö 1,hier".to_owned(), "hier"),
        (format!("4={numbers},u\u{308}ber\u{301},日本語,hier,{numbers}"), "hier"),
    ];
    let rows: Vec<_> = rows.iter().collect();
    let text: String = rows.iter().map(|(row, _)| format!("{row}\n")).collect();
    let file = SMALL.replace("[THREADING]\n1=1\n2=2\n3=2\n", &format!("[THREADING]\n{text}"));
    let output = draft_in(Path::new("."), "lint -", file.as_bytes());
    let shown = done(&output);
    let mut marked = 0;
    let lines: Vec<_> = shown.lines().collect();
    for pair in lines.windows(2) {
        assert!(columns(pair[0]) <= 80, "{}", pair[0]);
        if let Some(at) = pair[0].find("hier").filter(|_| pair[0].contains(" | "))
            && pair[1].ends_with("^^^^")
        {
            let caret = pair[1].find('^').unwrap();
            if pair[1].trim_start_matches([' ', '|']) == "^^^^" && caret == columns(&pair[0][..at])
            {
                marked += 1;
            }
        }
    }
    assert_eq!(marked, 4, "{shown}");
}

/// Columns of a terminal that `text` takes, for the characters of the test above.
fn columns(text: &str) -> usize {
    let width = |c| match c {
        '\u{300}'..='\u{36f}' => 0,
        '\u{3000}'..='\u{9fff}' => 2,
        _ => 1,
    };
    text.chars().map(width).sum()
}

#[test]
fn lint_counts_what_it_does_not_list() {
    let lines = "no equals sign\n".repeat(100);
    let file = SMALL.replace("[WARP]\n", &format!("[WARP]\n{lines}"));
    let output = draft_in(Path::new("."), "lint -", file.as_bytes());
    let shown = done(&output);
    assert!(shown.ends_with("\nstandard input: 100 warnings\n"), "{shown}");
    assert!(shown.contains("warning[no-equals]: 80 more of the kind no-equals"), "{shown}");
}

#[test]
fn a_file_cannot_command_the_terminal() {
    let file = SMALL.replace("[WARP]\n", "[WARP]\n\x1b[2J no equals\n[\x1b[31mRED]\nx=\x1b[1m\n");
    let file = file.replace("[CONTENTS]\n", "Source Program=\x1b[2J\n[CONTENTS]\n");
    for command in ["lint -", "info -", "drawdown - --format text"] {
        let output = draft_in(Path::new("."), command, file.as_bytes());
        assert!(!done(&output).contains('\x1b'), "{}", stdout(&output));
        assert!(!stderr(&output).contains('\x1b'), "{}", stderr(&output));
    }
}

fn json_of(file: &str) -> Value {
    serde_json::from_str(done(&draft(&format!("info --json {file}")))).unwrap()
}

#[test]
fn info_as_json_says_what_the_draft_is() {
    let twill = json_of("drafts/twill-2-1.wif");
    assert_eq!(twill["title"], "Twill 2/1, cotton drill");
    assert_eq!(twill["author"], Value::Null);
    assert_eq!(twill["ends"], 12);
    assert_eq!(twill["plan"], "tieup");
    assert_eq!(twill["warp"]["spacing_mm"], json!({"min": 0.42, "mean": 0.42, "max": 0.42}));
    assert_eq!(twill["warp"]["threads_per_cm"], 23.809524);
    assert_eq!(twill["warp"]["threads_per_inch"], 60.47619);
    assert_eq!(twill["warp"]["thickness_mm"], Value::Null);
    assert_eq!((&twill["width_mm"], &twill["length_mm"]), (&json!(5.04), &json!(6.0)));
    let colors = json!([
        {"number": 1, "srgb": "#a89368", "ends": 12, "picks": 0},
        {"number": 2, "srgb": "#bdaa81", "ends": 0, "picks": 12},
    ]);
    assert_eq!(twill["colors"], colors);
    let cloth = &twill["cloth"];
    assert_eq!(cloth["weave"], json!({"class": "twill", "hand": "Z", "repeat": 3}));
    assert_eq!(cloth["repeat"], json!({"ends": 3, "picks": 3}));
    assert!((cloth["balance"].as_f64().unwrap() - 2.0 / 3.0).abs() < 1e-12, "{cloth}");
    let floats = json!({"face": {"warp": 2, "weft": 1}, "back": {"warp": 1, "weft": 2}});
    assert_eq!(cloth["longest_floats"], floats);
    assert_eq!(twill["diagnostics"], json!({"errors": 0, "warnings": 0, "notes": 0, "list": []}));

    let satin = json!({"class": "satin", "face": "warp", "repeat": 8, "step": 3});
    assert_eq!(json_of("drafts/satin-8.wif")["cloth"]["weave"], satin);
    assert_eq!(json_of("drafts/plain.wif")["cloth"]["weave"], json!({"class": "plain"}));
    assert_eq!(json_of("drafts/waffle.wif")["cloth"]["weave"], json!({"class": "other"}));
}

#[test]
fn info_as_json_has_the_same_keys_for_every_draft() {
    let keys =
        |value: &Value| -> Vec<String> { value.as_object().unwrap().keys().cloned().collect() };
    let expected = keys(&json_of("drafts/plain.wif"));
    for draft in drafts() {
        let info = json_of(draft.to_str().unwrap());
        assert_eq!(keys(&info), expected, "{}", draft.display());
        let (ends, picks) = info["colors"].as_array().unwrap().iter().fold((0, 0), |sum, color| {
            let count = |key: &str| color[key].as_u64().unwrap();
            (sum.0 + count("ends"), sum.1 + count("picks"))
        });
        assert_eq!((&info["ends"], &info["picks"]), (&json!(ends), &json!(picks)), "{info}");
    }
    let none = json_of("invalid/no-weave.wif");
    assert_eq!(keys(&none), expected);
    assert_eq!(none["cloth"], Value::Null);
    assert!(none["no_drawdown"].as_str().unwrap().contains("no plan"), "{none}");
    let found = &none["diagnostics"]["list"][0];
    assert_eq!((&found["code"], &found["line"]), (&json!("no-weave"), &Value::Null));
}

#[test]
fn info_is_readable() {
    let output = draft("info drafts/overshot.wif");
    let shown = done(&output);
    for row in [
        "  title     Overshot coverlet, indigo on natural\n",
        "  size      132 ends, 264 picks; 105.6 x 105.6 mm\n",
        "  warp      12.5 per cm, 31.8 per inch, spacing 0.8 mm, thickness 0.6 mm\n",
        "            2  #2a3e6e  0 ends, 132 picks\n",
        "  findings  1 note\n",
    ] {
        assert!(shown.contains(row), "{row}{shown}");
    }
    assert!(shown.lines().all(|line| line.chars().count() <= 80), "{shown}");
}

#[test]
fn info_of_what_is_no_draft_fails() {
    for options in ["", "--json"] {
        let output = draft(&format!("info invalid/not-text.wif {options}"));
        let message = "error: invalid/not-text.wif: file: byte 8 is zero, ";
        assert!(stderr(&output).starts_with(message), "{}", stderr(&output));
        assert_eq!((stdout(&output), code(&output)), ("", 1));
    }
}

#[test]
fn format_is_idempotent_and_keeps_the_drawdown() {
    let here = Path::new(".");
    for path in drafts() {
        let path = path.display();
        let output = draft(&format!("format -q {path}"));
        let canonical = done(&output);
        let again = draft_in(here, "format -", canonical.as_bytes());
        assert_eq!((done(&again), stderr(&again)), (canonical, ""), "{path}");
        let before = draft(&format!("drawdown --format text {path}"));
        let after = draft_in(here, "drawdown --format text -", canonical.as_bytes());
        assert_eq!(done(&after), done(&before), "{path}");
        let lint = draft_in(here, "lint --strict -", canonical.as_bytes());
        assert_eq!(code(&lint), 0, "{path}: {}", stdout(&lint));
    }
}

#[test]
fn format_says_what_is_left_out() {
    let file = SMALL.replace("[WARP]\n", "[WARP]\n; wool\n; from home\nnonsense\nHue=3 ; dull\n");
    let output = draft_in(Path::new("."), "format -", file.as_bytes());
    let expected = "\
warning: standard input: line 18: this comment and 2 more are left out
warning: standard input: line 20 [WARP]: line without = is skipped, expected a key and a value
  20:1 | nonsense
       | ^^^^^^^^ no-equals
note: standard input: line 21 [WARP]: \"Hue\" is not a key of this section; ignored
  21:1 | Hue=3 ; dull
       | ^^^ unknown-key
";
    assert_eq!(stderr(&output), expected);
    assert!(done(&output).starts_with("[WIF]\nVersion=1.1\n"));
    let quiet = draft_in(Path::new("."), "format -q -", file.as_bytes());
    assert_eq!((stdout(&quiet), stderr(&quiet)), (stdout(&output), ""));
}

#[test]
fn format_in_place_replaces_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("small.wif");
    fs::write(&file, SMALL).unwrap();
    #[cfg(unix)]
    fs::set_permissions(&file, std::os::unix::fs::PermissionsExt::from_mode(0o640)).unwrap();
    let canonical = draft_in(folder.path(), "format small.wif", b"");
    assert_eq!(fs::read_to_string(&file).unwrap(), SMALL);

    let output = draft_in(folder.path(), "format -i small.wif", b"");
    assert_eq!((done(&output), stderr(&output)), ("", ""));
    assert_eq!(fs::read_to_string(&file).unwrap(), stdout(&canonical));
    #[cfg(unix)]
    {
        let mode = std::os::unix::fs::PermissionsExt::mode(&file.metadata().unwrap().permissions());
        assert_eq!(mode & 0o777, 0o640, "the permissions are not those of before");
    }
    let before = file.metadata().unwrap().modified().unwrap();
    assert_eq!(done(&draft_in(folder.path(), "format -i small.wif", b"")), "");
    assert_eq!(file.metadata().unwrap().modified().unwrap(), before, "it was canonical already");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something was left behind");
}

#[test]
fn rewriting_refuses_drafts_with_errors() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("bad.wif");
    let bytes = fs::read(fixtures().join("invalid/bad-key.wif")).unwrap();
    fs::write(&file, &bytes).unwrap();
    for arguments in ["format bad.wif", "format -i bad.wif", "convert --liftplan -i bad.wif"] {
        let output = draft_in(folder.path(), arguments, b"");
        assert_eq!((code(&output), stdout(&output)), (1, ""), "{arguments}");
        let found = stderr(&output);
        assert!(found.starts_with("error: bad.wif: line "), "{arguments}: {found}");
        assert!(found.contains("bad-key"), "{arguments}: {found}");
        assert_eq!(fs::read(&file).unwrap(), bytes, "{arguments}");
    }
    let output = draft("convert --tieup invalid/no-weave.wif");
    let message = "error: invalid/no-weave.wif: draft: no plan, expected a lift plan or a tie-up with a treadling\n";
    assert_eq!((code(&output), stdout(&output), stderr(&output)), (1, "", message));
}

#[test]
fn convert_keeps_the_drawdown() {
    let here = Path::new(".");
    for path in drafts() {
        let path = path.display();
        let before = draft(&format!("drawdown --format text {path}"));
        for (plan, section, gone) in
            [("--liftplan", "[LIFTPLAN]", "[TIEUP]"), ("--tieup", "[TIEUP]", "[LIFTPLAN]")]
        {
            let output = draft(&format!("convert -q {plan} {path}"));
            let text = done(&output);
            assert!(text.contains(section) && !text.contains(gone), "{path} {plan}");
            let after = draft_in(here, "drawdown --format text -", text.as_bytes());
            assert_eq!(done(&after), done(&before), "{path} {plan}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let output = draft_in(folder.path(), "convert --tieup - -o out.wif", SMALL.as_bytes());
    assert_eq!(done(&output), "");
    let text = fs::read_to_string(folder.path().join("out.wif")).unwrap();
    assert!(text.contains("[TIEUP]\n1=1\n2=2\n\n[TREADLING]\n1=1\n2=2\n"), "{text}");
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let damask = fixtures().join("drafts/damask.wif");
    for arguments in ["drawdown --format text", "drawdown --format png", "format", "info", "lint"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_selvedge"))
            .arg("draft")
            .args(arguments.split_whitespace())
            .arg(&damask)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((code(&output), stderr(&output)), (0, ""), "{arguments}");
    }
}
