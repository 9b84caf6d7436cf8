//! What goes wrong gives one clear message, its exit code, and leaves no file behind.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use tempfile::TempDir;

const HUGE: &str = "[WIF]\nVersion=1.1\n[WARP]\nThreads=4000000000\n[WEFT]\nThreads=1\n";
const NO_PLAN: &str =
    "[WIF]\nVersion=1.1\n[WARP]\nThreads=1\n[WEFT]\nThreads=1\n[THREADING]\n1=1\n";

/// The shortest clean draft.
const GOOD: &str = "\
[WIF]
Version=1.1
[CONTENTS]
Weaving=1
Warp=1
Weft=1
Threading=1
Liftplan=1
[WEAVING]
Shafts=2
Treadles=0
Rising Shed=1
[WARP]
Threads=2
[WEFT]
Threads=2
[THREADING]
1=1
2=2
[LIFTPLAN]
1=1
2=2
";

/// A folder with good and bad drafts, in which the program runs.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\x02\0\0\0";
    let files: [(&str, &[u8]); 5] = [
        ("good.wif", GOOD.as_bytes()),
        ("empty.wif", b""),
        ("picture.wif", png),
        ("huge.wif", HUGE.as_bytes()),
        ("no-plan.wif", NO_PLAN.as_bytes()),
    ];
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    fs::create_dir(folder.path().join("folder.png")).unwrap();
    folder
}

fn run(folder: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_selvedge"));
    command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap()
}

/// All paths below a folder.
fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn check(arguments: &str, code: i32, message: &str) {
    let folder = folder();
    let before = listing(folder.path());
    let output = run(folder.path(), arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(stderr.trim_end(), message.trim_end(), "{arguments}");
    assert_eq!(output.status.code(), Some(code), "{arguments}");
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "", "{arguments}");
    assert_eq!(listing(folder.path()), before, "{arguments}");
    assert_eq!(listing(&folder.path().join("folder.png")), [""; 0], "{arguments}");
}

fn check_usage(arguments: &str, message: &str) {
    check(arguments, 2, &format!("error: {message}\n\nFor more information, try '--help'."));
}

#[test]
fn missing_draft() {
    check("render missing.wif -o out.png", 1, "error: missing.wif: no such file");
}

#[test]
fn folder_as_draft() {
    let message = "error: folder.png: found a folder, expected a WIF file";
    check("render folder.png -o out.png", 1, message);
}

#[test]
fn ruler_without_room() {
    let message = "error: --ruler: found a picture of 240x100 pixels, expected at least 240x120";
    check("swatch good.wif -o out.png --ruler --size 240x100", 1, message);
}

#[test]
fn front_and_back() {
    let output = run(folder().path(), "swatch good.wif -o out.png --front --back");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        stderr.starts_with("error: the argument '--front' cannot be used with '--back'"),
        "{stderr}"
    );
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn empty_draft() {
    let message = "error: empty.wif: file: nothing in it, expected the sections of a draft
       = empty-file";
    check("render empty.wif -o out.png", 1, message);
}

#[test]
fn picture_as_draft() {
    let message = "error: picture.wif: file: byte 8 is zero, expected the text of a draft
       = not-text";
    check("render picture.wif -o out.png", 1, message);
}

#[test]
fn draft_of_billions_of_threads() {
    let message = "\
error: huge.wif: line 4 [WARP]: 4000000000 ends, expected at most 100000
   4:9 | Threads=4000000000
       |         ^^^^^^^^^^ limit";
    check("render huge.wif -o out.png", 1, message);
}

#[test]
fn draft_without_a_plan() {
    let message =
        "error: no-plan.wif: draft: no plan, expected a lift plan or a tie-up with a treadling";
    check("render no-plan.wif -o out.png --quiet", 1, message);
}

#[test]
fn output_in_a_missing_folder() {
    let message = "error: nowhere/out.png: found no folder nowhere, expected an existing one";
    check("render good.wif -o nowhere/out.png", 1, message);
}

#[test]
fn output_over_a_folder() {
    let message = "error: folder.png: found a folder, expected the name of a file";
    check("render good.wif -o folder.png", 1, message);
}

#[test]
fn output_below_a_file() {
    let message = "error: good.wif/out.png: found no folder good.wif, expected an existing one";
    check("render good.wif -o good.wif/out.png", 1, message);
}

#[test]
fn output_with_an_endless_name() {
    let name = format!("{}.png", "long".repeat(80));
    let folder = folder();
    let output = run(folder.path(), &format!("render good.wif -o {name}"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.starts_with(&format!("error: {name}: cannot be written: ")), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert_eq!(output.status.code(), Some(1));
}

#[cfg(unix)]
#[test]
fn output_in_a_folder_that_may_not_be_written() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(closed.join("probe"), "").is_ok() {
        eprintln!("skipped: this user may write anywhere");
        return;
    }
    let output = run(folder.path(), "render good.wif -o closed/out.png");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(stderr, "error: closed/out.png: cannot be written: permission denied\n");
    assert_eq!(output.status.code(), Some(1));
}

#[cfg(target_os = "linux")]
#[test]
fn output_where_nobody_may_write() {
    let message = "error: /proc/out.png: cannot be written: entity not found";
    check("render good.wif -o /proc/out.png", 1, message);
}

#[test]
fn failure_leaves_an_older_output_alone() {
    let folder = folder();
    fs::write(folder.path().join("out.png"), "older").unwrap();
    let output = run(folder.path(), "render empty.wif -o out.png");
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(fs::read_to_string(folder.path().join("out.png")).unwrap(), "older");
}

#[test]
fn no_samples() {
    let message = "invalid value '0' for '--spp <N>': 0 is not in 1..=65536";
    check_usage("render good.wif -o out.png --spp 0", message);
}

#[test]
fn no_threads() {
    let message = "invalid value '0' for '--threads <N>': 0 is not in 1..=1024";
    check_usage("render good.wif -o out.png --threads 0", message);
}

#[test]
fn sizes_that_are_none() {
    let arguments = "render good.wif -o out.png --size";
    let value = |text: &str| format!("invalid value '{text}' for '--size <WxH>': ");
    let expected = "expected width and height in pixels, as in 960x640";
    check_usage(&format!("{arguments} 960"), &(value("960") + expected));
    let expected = "found no pixels, expected at least 1x1";
    check_usage(&format!("{arguments} 0x640"), &(value("0x640") + expected));
    let expected = "found 10000000000 pixels, expected at most 67108864";
    check_usage(&format!("{arguments} 100000x100000"), &(value("100000x100000") + expected));
}

#[test]
fn output_of_an_unknown_format() {
    let message =
        "invalid value 'out.jpg' for '--output <FILE>': expected a name that ends in .png or .exr";
    check_usage("render good.wif -o out.jpg", message);
}

#[test]
fn unknown_option() {
    check_usage(
        "render good.wif -o out.png --frobnicate",
        "unexpected argument '--frobnicate' found\n\n  \
         tip: to pass '--frobnicate' as a value, use '-- --frobnicate'\n\n\
         Usage: selvedge render --output <FILE> <CLOTH>",
    );
}

#[test]
fn help_says_where_end_and_pick_1_are() {
    let folder = folder();
    let output = run(folder.path(), "render --help");
    assert_eq!(output.status.code(), Some(0));
    let help = String::from_utf8(output.stdout).unwrap();
    let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let expected = "End 1 is at the left edge of the cloth and pick 1 at its near edge";
    assert!(words.contains(expected), "{help}");
}

#[test]
fn good_draft_gives_a_picture_and_a_summary() {
    let folder = folder();
    let output = run(folder.path(), "render good.wif -o out.png --size 6x4 --spp 1");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let expected = "out.png: 2 ends x 2 picks, repeat 1.0 x 1.0 mm, 1 spp, ";
    assert!(stderr.starts_with(expected) && stderr.ends_with(" s\n"), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    let mut expected = listing(self::folder().path());
    expected.push("out.png".to_owned());
    expected.sort();
    assert_eq!(listing(folder.path()), expected);

    let quiet = run(folder.path(), "render good.wif -o out.exr --size 6x4 --spp 1 -q");
    assert_eq!((quiet.status.code(), quiet.stderr.len()), (Some(0), 0));
}

#[test]
fn warnings_name_file_line_and_column() {
    let folder = folder();
    fs::write(folder.path().join("odd.wif"), GOOD.replace("2=2\n[LIFT", "2=two\n[LIFT")).unwrap();
    let output = run(folder.path(), "render odd.wif -o out.png --size 6x4 --spp 1");
    let stderr = String::from_utf8(output.stderr).unwrap();
    let expected = "\
warning: odd.wif: line 19 [THREADING]: \"two\" is skipped, expected a whole number
  19:3 | 2=two
       |   ^^^ bad-number
out.png: ";
    assert!(stderr.starts_with(expected), "{stderr}");
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn killed_program_leaves_no_file() {
    let folder = folder();
    let before = listing(folder.path());
    let mut child = Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .current_dir(folder.path())
        .args(["render", "good.wif", "-q", "-o", "out.png", "--spp", "65536"])
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_secs(1));
    assert_eq!(child.try_wait().unwrap(), None, "it was done too soon");
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(listing(folder.path()), before);
}

#[test]
fn swatch_of_no_width() {
    let message = "invalid value '0' for '--mm <WIDTH>': expected a number from 0.1 to 1000";
    check_usage("swatch good.wif -o out.png --mm 0", message);
}
