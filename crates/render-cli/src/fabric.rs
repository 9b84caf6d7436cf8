//! From a drawdown to a cloth: weave, colours and sizes of the threads.

use selvedge_wif::{Drawdown, Thread};
use selvedge_yarn_brdf::{Cloth, ClothError, Weave, Yarn};

/// The cloth that `drawdown` describes, of the default yarn in the colours of its threads.
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
    Cloth::from_threads(weave, &warp, &weft, Yarn::default())
}

fn thread(thread: &Thread) -> selvedge_yarn_brdf::Thread {
    selvedge_yarn_brdf::Thread {
        color: thread.color.linear(),
        pitch: thread.pitch,
        diameter: thread.diameter,
    }
}
