//! The drafts that the tests read, and the values that Rust gives for them.

use std::fs;
use std::path::PathBuf;

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Cloth, Fabric, Shader, Thread, Weave};

/// Path of a file among the fixtures of the workspace.
pub(crate) fn fixture(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "../../fixtures", name].iter().collect()
}

/// The bytes of a file among the fixtures.
pub(crate) fn read(name: &str) -> Vec<u8> {
    fs::read(fixture(name)).expect("the fixture is there")
}

/// The cloth of a draft in the default fabric, made without the C interface.
pub(crate) fn cloth(name: &str) -> Cloth {
    let draft = selvedge_wif::parse(&read(name)).draft.expect("the fixture is a draft");
    let drawdown = draft.drawdown().expect("the fixture has a weave");
    let (ends, picks) = (drawdown.ends(), drawdown.picks());
    let weave = Weave::new(ends as u32, picks as u32, |end, pick| {
        drawdown.warp_on_top(end as usize, pick as usize)
    });
    let end = |end| Thread {
        color: drawdown.end_color(end).linear(),
        color_number: drawdown.end_color_number(end),
        pitch: drawdown.end_pitch(end),
        diameter: drawdown.end_diameter(end),
    };
    let pick = |pick| Thread {
        color: drawdown.pick_color(pick).linear(),
        color_number: drawdown.pick_color_number(pick),
        pitch: drawdown.pick_pitch(pick),
        diameter: drawdown.pick_diameter(pick),
    };
    let ends: Vec<_> = (0..ends).map(end).collect();
    let picks: Vec<_> = (0..picks).map(pick).collect();
    let weave = weave.expect("the fixture is a weave");
    Fabric::default().cloth(weave, &ends, &picks).expect("the fixture is a cloth")
}

/// The shader of a draft, prepared without the C interface.
pub(crate) fn shader(name: &str) -> Shader {
    cloth(name).prepare().expect("the fixture can be shaded")
}

/// Pairs of directions, `wi` and `wo`, as in `c/eval.c`: three above the surface, one below it,
/// one through it.
pub(crate) const DIRECTIONS: [[Vec3; 2]; 5] = [
    [Vec3::Z, Vec3::Z],
    [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, 0.8)],
    [Vec3::new(-0.48, 0.64, 0.6), Vec3::new(0.28, 0.0, 0.96)],
    [Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.0, -0.6, -0.8)],
    [Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.0, 0.6, 0.8)],
];

/// Positions as in `c/eval.c`: a slanted line over several threads, in metres.
pub(crate) fn positions() -> impl Iterator<Item = DVec2> {
    (0..40).map(f64::from).map(|step| DVec2::new(1.1e-4 * step, 2.3e-4 * step - 1.0e-3))
}
