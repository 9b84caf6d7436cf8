//! Files made to be expensive: memory stays in proportion to their bytes, and so does time.

use std::fmt::Write;
use std::fs;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use selvedge_wif::{limits, parse};

/// Most bytes of memory for each byte of a file, and beside that.
const PER_BYTE: usize = 64;
const BESIDE: usize = 1 << 20;

/// Held while memory is measured, which is that of the whole process.
static MEASURING: Mutex<()> = Mutex::new(());

/// The peak of resident memory since the last call, and what is resident now, in bytes; `None`
/// where the system does not tell.
fn peak_and_now() -> Option<(usize, usize)> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let field = |name: &str| {
        let line = status.lines().find(|line| line.starts_with(name))?;
        let kilobytes: usize = line.split_whitespace().nth(1)?.parse().ok()?;
        Some(kilobytes * 1024)
    };
    let found = (field("VmHWM:")?, field("VmRSS:")?);
    // Sets the peak to what is resident now.
    fs::write("/proc/self/clear_refs", "5").ok()?;
    Some(found)
}

/// `count` pieces, made one by one.
fn pieces(count: usize, piece: impl Fn(usize) -> String) -> Vec<u8> {
    (0..count).map(piece).collect::<String>().into_bytes()
}

/// Files of about this many bytes, by what is bad about them.
fn files(bytes: usize) -> Vec<(&'static str, Vec<u8>)> {
    let plan = "[WARP]\nThreads=9\n[WEFT]\nThreads=9\n[THREADING]\n1=1\n";
    let with = |section: &str, rest: Vec<u8>| [plan.as_bytes(), section.as_bytes(), &rest].concat();
    let many = |piece: &'static str| pieces(bytes / piece.len(), move |_| piece.into());
    vec![
        ("one line", many("x")),
        ("one key", with("[TEXT]\nTitle=", many("x"))),
        ("empty lines", many("\n")),
        ("empty lines in a section", with("[PRIVATE A]\n", many("\n"))),
        ("lines of one character", with("[NOTES]\n", many("a\n"))),
        ("brackets in one line", many("[")),
        ("headers of nothing", many("[\n")),
        ("equal headers", many("[WARP]\n")),
        ("foreign sections", pieces(bytes / 9, |n| format!("[{n:06x}]\n"))),
        ("sections with a line", pieces(bytes / 13, |n| format!("[{n:06x}]\n1=1\n"))),
        (
            "contents of nothing",
            with("[CONTENTS]\n", pieces(bytes / 9, |n| format!("{n:06x}=1\n"))),
        ),
        ("equal keys", with("[THREADING]\n", many("1=1\n"))),
        (
            "keys from the last",
            with("[LIFTPLAN]\n", pieces(bytes / 11, |n| format!("{}=1,1\n", 99_999_999 - n))),
        ),
        (
            "blank values",
            with("[WARP COLORS]\n", pieces(bytes / 7, |n| format!("{}=\n", n % 99_999))),
        ),
        ("one long list", with("[LIFTPLAN]\n1=", many("1,"))),
        ("bad items", with("[LIFTPLAN]\n1=", many("x,"))),
        ("lines of prose", with("[LIFTPLAN]\n", many("x\n"))),
        ("unknown keys", with("[WEAVING]\n", many("a=\n"))),
        ("colors", with("[COLOR TABLE]\n", pieces(bytes / 14, |n| format!("{n}=1,2,3\n")))),
        ("not utf-8", with("[TEXT]\nTitle=\u{e9}\n[PRIVATE A]\n", vec![0x93; bytes])),
        (
            "plans whose comparison is a product",
            [
                b"[WARP]\nThreads=9\n[WEFT]\n[TIEUP]\n1=".to_vec(),
                pieces(bytes / 24, |n| format!("{n},")),
                b"\n[LIFTPLAN]\n1=1\n[TREADLING]\n2=1\n".to_vec(),
                pieces(bytes / 24, |n| format!("{}=1\n", n + 3)),
            ]
            .concat(),
        ),
        ("a claim without data", b"[WARP]\nThreads=100000\n[WEFT]\nThreads=100000\n".to_vec()),
    ]
}

#[test]
fn no_file_takes_more_than_its_share() {
    let _alone = MEASURING.lock();
    let mut measured = false;
    for bytes in [1 << 20, 4 << 20] {
        for (name, file) in files(bytes) {
            let before = peak_and_now();
            let start = Instant::now();
            let parsed = parse(&file);
            let elapsed = start.elapsed();
            if let (Some((_, before)), Some((peak, _))) = (before, peak_and_now()) {
                measured = true;
                let taken = peak.saturating_sub(before);
                let most = PER_BYTE * file.len() + BESIDE;
                assert!(taken <= most, "{name}, {} bytes: {taken} of {most} bytes", file.len());
            }
            // A hundred times what it takes; what is quadratic takes minutes.
            let most =
                Duration::from_millis(200) + Duration::from_micros(1) * (file.len() / 2) as u32;
            assert!(elapsed < most, "{name}, {} bytes: {elapsed:?}, allowed {most:?}", file.len());
            assert!(parsed.diagnostics.len() < 20 * (limits::DIAGNOSTICS_PER_CODE + 1), "{name}");
            assert_eq!(parsed.document.as_bytes(), file, "{name}");
            for diagnostic in &parsed.diagnostics {
                let shown = diagnostic.display(&file).to_string();
                assert!(shown.len() < 1000, "{name}: {} bytes of {}", shown.len(), diagnostic.code);
            }
        }
    }
    if !measured {
        println!("memory not measured: /proc/self/clear_refs cannot be written");
    }
}

#[test]
fn ten_thousand_by_ten_thousand_threads_weave_in_forty_megabytes() {
    let _alone = MEASURING.lock();
    let mut file = String::from("[WARP]\nThreads=10000\n[WEFT]\nThreads=10000\n[THREADING]\n");
    (1..=10_000)
        .for_each(|end| writeln!(file, "{end}={}", end % 32 + 1).expect("a string takes it"));
    file.push_str("[LIFTPLAN]\n");
    for pick in 1..=10_000 {
        write!(file, "{pick}=1").expect("a string takes it");
        let shafts = (2..=32).filter(|shaft| (pick * 7 + shaft * shaft) % 3 > 0);
        shafts.for_each(|shaft| write!(file, ",{shaft}").expect("a string takes it"));
        file.push('\n');
    }
    let before = peak_and_now();
    let start = Instant::now();
    let drawdown = parse(file.as_bytes()).draft.and_then(|draft| draft.drawdown().ok());
    let elapsed = start.elapsed();
    let after = peak_and_now();
    assert_eq!(drawdown.map(|cloth| (cloth.ends(), cloth.picks())), Some((10_000, 10_000)));
    assert!(elapsed < Duration::from_secs(1), "took {elapsed:?}");
    match (before, after) {
        (Some((_, before)), Some((peak, _))) => {
            let taken = peak.saturating_sub(before);
            assert!(taken < 40_000_000, "took {taken} bytes");
        }
        _ => println!("memory not measured: /proc/self/clear_refs cannot be written"),
    }
}
