//! Pictures are the same in every run, show the draft the right way round, and say the same in
//! every format.

#![allow(clippy::unwrap_used, reason = "a test stops at what it does not expect")]

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use exr::prelude::{ReadChannels, ReadLayers};
use selvedge_cli::{glam::Vec3, image::View};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/drafts").join(name)
}

/// The bytes of the picture that the program draws.
fn render(draft: &Path, output: &str, options: &str) -> Vec<u8> {
    draw("render", draft, output, options)
}

fn draw(command: &str, draft: &Path, output: &str, options: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let result = Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .current_dir(folder.path())
        .arg(command)
        .arg(draft)
        .args(["-q", "-o", output])
        .args(options.split_whitespace())
        .output()
        .unwrap();
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    fs::read(folder.path().join(output)).unwrap()
}

#[test]
fn picture_has_the_same_bits_for_any_threads_and_run() {
    let options = "--size 60x40 --spp 4 --seed 5 --threads";
    for output in ["out.png", "out.exr"] {
        let one = render(&fixture("tartan.wif"), output, &format!("{options} 1"));
        for threads in [2, 2, 5] {
            let other = render(&fixture("tartan.wif"), output, &format!("{options} {threads}"));
            assert!(one == other, "{output}: {threads} threads give another picture than one");
        }
    }
}

#[test]
fn seed_changes_the_noise() {
    let picture = |seed: u32| {
        let options = format!("--size 30x20 --spp 1 --seed {seed}");
        render(&fixture("plain.wif"), "out.png", &options)
    };
    assert!(picture(0) != picture(1));
}

#[test]
fn png_is_the_view_of_the_exr() {
    let options = "--size 60x40 --spp 4";
    let png = render(&fixture("denim.wif"), "out.png", options);
    let exr = render(&fixture("denim.wif"), "out.exr", options);
    let png = image::load_from_memory(&png).unwrap().into_rgb8();
    assert_eq!(png.dimensions(), (60, 40));

    let radiance = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| vec![vec![Vec3::NAN; size.width()]; size.height()],
            |rows, place, (r, g, b): (f32, f32, f32)| {
                rows[place.y()][place.x()] = Vec3::new(r, g, b);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(exr))
        .unwrap()
        .layer_data
        .channel_data
        .pixels;
    assert_eq!((radiance[0].len(), radiance.len()), (60, 40));
    for (x, y, pixel) in png.enumerate_pixels() {
        let linear = radiance[y as usize][x as usize];
        assert!(linear.is_finite() && linear.min_element() >= 0.0, "({x}, {y}): {linear}");
        assert_eq!(pixel.0, View::Srgb.bytes(linear), "({x}, {y}): {linear}");
    }
}

#[test]
fn draft_can_come_from_standard_input() {
    let folder = tempfile::tempdir().unwrap();
    let draft = fs::read(fixture("plain.wif")).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_selvedge"))
        .current_dir(folder.path())
        .args(["render", "-", "-q", "-o", "out.png", "--size", "30x20", "--spp", "1"])
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(&draft).unwrap();
    assert!(child.wait().unwrap().success());
    let expected = render(&fixture("plain.wif"), "out.png", "--size 30x20 --spp 1");
    assert!(fs::read(folder.path().join("out.png")).unwrap() == expected);
}

/// Threads along each side of the drafts below, as many as the cloth has at their spacing.
const COUNT: u32 = 420;

/// Threads 1 to `THIRD` are told from the others.
const THIRD: u32 = 140;

/// A draft of `COUNT` ends and picks, 1 mm apart, on eight shafts: 1 to 4 for the first third of
/// the ends, 5 to 8 for the others. `lifts` tells the shafts of each pick, from 1.
fn draft(sections: &str, lifts: impl Fn(u32) -> Vec<u32>) -> String {
    let mut text = format!(
        "[WIF]\nVersion=1.1\n[WEAVING]\nShafts=8\nTreadles=0\nRising Shed=1\n\
         [COLOR PALETTE]\nEntries=3\nRange=0,255\n\
         [COLOR TABLE]\n1=220,30,30\n2=30,30,220\n3=110,110,110\n\
         [WARP]\nThreads={COUNT}\nUnits=Centimeters\nSpacing=0.1\nColor=1\n\
         [WEFT]\nThreads={COUNT}\nUnits=Centimeters\nSpacing=0.1\nColor=2\n{sections}[THREADING]\n"
    );
    for end in 1..=COUNT {
        let shaft = end % 4 + if end <= THIRD { 1 } else { 5 };
        text += &format!("{end}={shaft}\n");
    }
    text += "[LIFTPLAN]\n";
    for pick in 1..=COUNT {
        let shafts: Vec<_> = lifts(pick).iter().map(u32::to_string).collect();
        text += &format!("{pick}={}\n", shafts.join(","));
    }
    text
}

/// Mean red less mean blue of the cloth, 0 to 255, near its corners at the left and near, right
/// and near, left and far.
fn corners(draft: &str) -> [f32; 3] {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("draft.wif");
    fs::write(&path, draft).unwrap();
    let png = render(&path, "out.png", "--size 240x160 --spp 8");
    let picture = image::load_from_memory(&png).unwrap().into_rgb8();
    [(40, 146), (212, 117), (32, 55)].map(|(x, y)| {
        let mut sum = 0.0;
        for (dx, dy) in (0..5).flat_map(|dx| (0..5).map(move |dy| (dx, dy))) {
            let [red, _, blue] = picture.get_pixel(x + dx - 2, y + dy - 2).0.map(f32::from);
            sum += red - blue;
        }
        sum / 25.0
    })
}

/// Three shafts of four, or one, by turns.
fn twill(first: u32, pick: u32, most: bool) -> Vec<u32> {
    (0..4).filter(|shaft| (*shaft == pick % 4) != most).map(|shaft| first + shaft).collect()
}

#[test]
fn first_end_and_pick_lie_left_and_near() {
    // Red warp is on top where the first ends cross the first picks, blue weft elsewhere.
    let found =
        corners(&draft("", |pick| [twill(1, pick, pick <= THIRD), twill(5, pick, false)].concat()));
    assert!(found[0] > 30.0 && found[1] < -30.0 && found[2] < -30.0, "{found:?}");
}

#[test]
fn colours_of_ends_go_from_left_to_right() {
    // All ends are on top, the first third of them red and the others blue.
    let mut colors = "[WARP COLORS]\n".to_owned();
    for end in THIRD + 1..=COUNT {
        colors += &format!("{end}=2\n");
    }
    let found =
        corners(&draft(&colors, |pick| [twill(1, pick, true), twill(5, pick, true)].concat()));
    assert!(found[0] > 30.0 && found[1] < -30.0 && found[2] > 30.0, "{found:?}");
}

#[test]
fn colours_of_picks_go_from_near_to_far() {
    // All picks are on top, the first third of them blue and the others red.
    let mut colors = "[WEFT COLORS]\n".to_owned();
    for pick in THIRD + 1..=COUNT {
        colors += &format!("{pick}=1\n");
    }
    let found =
        corners(&draft(&colors, |pick| [twill(1, pick, false), twill(5, pick, false)].concat()));
    assert!(found[0] < -30.0 && found[1] < -30.0 && found[2] > 30.0, "{found:?}");
}

/// Mean red less mean blue of the lower left, lower right and upper left quarter of a swatch that
/// shows the whole of a draft.
fn quarters(draft: &str, options: &str) -> [f32; 3] {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("draft.wif");
    fs::write(&path, draft).unwrap();
    let options = format!("--mm {COUNT} --size 40x40 --spp 8 {options}");
    let png = draw("swatch", &path, "out.png", &options);
    let picture = image::load_from_memory(&png).unwrap().into_rgb8();
    // u = v = 0 is a sixth of the width above the lower edge of a square picture.
    [(2, 25), (30, 25), (2, 8)].map(|(x, y)| {
        let mut sum = 0.0;
        for (dx, dy) in (0..8).flat_map(|dx| (0..8).map(move |dy| (dx, dy))) {
            let [red, _, blue] = picture.get_pixel(x + dx, y + dy).0.map(f32::from);
            sum += red - blue;
        }
        sum / 64.0
    })
}

#[test]
fn swatch_shows_first_end_and_pick_at_the_lower_left_and_its_back_turned_over() {
    // Red warp is on top where the first ends cross the first picks, blue weft elsewhere.
    let lifts = |pick| [twill(1, pick, pick <= THIRD), twill(5, pick, false)].concat();
    for light in ["raking", "top"] {
        let found = quarters(&draft("", lifts), &format!("--light {light}"));
        assert!(found[0] > 30.0 && found[1] < -30.0 && found[2] < -30.0, "{found:?}");
    }
    // On the back the weft shows there, now at the right, and the warp elsewhere.
    let found = quarters(&draft("", lifts), "--back");
    assert!(found[0] > 30.0 && found[1] < -30.0 && found[2] > 30.0, "{found:?}");
}

#[test]
fn swatch_has_a_ruler() {
    let draft = fixture("denim.wif");
    let options = "--size 240x160 --spp 1 --mm 10";
    let picture = |options: &str| {
        let bytes = draw("swatch", &draft, "out.exr", options);
        selvedge_cli::image::decode(&bytes).unwrap()
    };
    let [bare, front, ruled] =
        ["", " --front", " --ruler"].map(|more| picture(&format!("{options}{more}")));
    assert!(bare == front, "the face is drawn if nothing else is said");
    let [bare, ruled] = [bare, ruled].map(|picture| picture.to_colors());
    // 39 rows of it: a mark every 24 pixels, each a millimetre.
    let (above, below) = (240 * 121, 240 * 122);
    assert!(bare[..above] == ruled[..above], "cloth above it stays");
    let marks: Vec<_> = (0..240).filter(|x| ruled[below + x].x < 0.1).collect();
    assert_eq!(marks, (0..10).map(|mm| mm * 24).collect::<Vec<_>>());
    let eight = draw("swatch", &draft, "out.png", "--size 24x16 --spp 8");
    assert!(draw("swatch", &draft, "out.png", "--size 24x16") == eight, "eight samples suffice");
    // A crop has its part of it.
    let crop = picture(&format!("{options} --ruler --cropwindow 24,110,100,150")).to_colors();
    let rows = (110..150).map(|y| y * 240 + 24);
    let expected: Vec<_> = rows.flat_map(|start| ruled[start..start + 76].to_vec()).collect();
    assert!(crop == expected);
}
