//! From a drawdown to a cloth: weave, colours and sizes of the threads, and what yarn they are.

use selvedge_wif::{Drawdown, Thread};
use selvedge_yarn_brdf::{Cloth, ClothError, Weave, Yarn};

/// Shape of the yarn, of which drafts say nothing: slightly twisted and lying flat, between the
/// staple of wool and the filament of silk, so that floats shine across their direction.
const U_MAX: f64 = 0.3;
const PSI: f64 = 0.2;
const DELTA: f64 = 0.5;

/// Amount of the highlight.
const SPECULAR: f32 = 0.3;

/// Share of the highlight that has the colour of the yarn: light that has been inside a fibre. The
/// rest, from its surface, is white.
const TINT: f32 = 0.6;

/// The cloth that `drawdown` describes, of one kind of yarn in the colours of its threads.
///
/// End and pick 0 of the drawdown are those at u = 0 and v = 0; an end on top is on top of the
/// face. Colours are decoded to linear light, pitch and diameter are handed on in metres where the
/// draft gives them.
///
/// # Errors
///
/// [`ClothError`] when the grid is larger than a cloth can be.
pub fn cloth(drawdown: &Drawdown) -> Result<Cloth, ClothError> {
    let (ends, picks) = (drawdown.ends(), drawdown.picks());
    let weave = Weave::new(ends as u32, picks as u32, |end, pick| {
        drawdown.warp_on_top(end as usize, pick as usize)
    })?;
    let warp: Vec<_> = (0..ends).map(|end| thread(drawdown.end(end))).collect();
    let weft: Vec<_> = (0..picks).map(|pick| thread(drawdown.pick(pick))).collect();
    let yarn = Yarn { u_max: U_MAX, psi: PSI, delta: DELTA, ..Yarn::default() };
    let mut cloth = Cloth::from_threads(weave, &warp, &weft, yarn)?;
    for yarn in &mut cloth.yarns {
        yarn.specular = yarn.color.map(|color| SPECULAR * (1.0 - TINT + TINT * color));
    }
    Ok(cloth)
}

fn thread(thread: &Thread) -> selvedge_yarn_brdf::Thread {
    selvedge_yarn_brdf::Thread {
        color: thread.color.linear(),
        pitch: thread.pitch,
        diameter: thread.diameter,
    }
}
