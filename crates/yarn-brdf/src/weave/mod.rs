//! The grid of crossings, and which piece of which yarn lies at a position.
//!
//! Cell (i, j) is the crossing of end i with pick j, both from 0; u runs along the weft (end 0 at
//! the left, small u) and v along the warp (pick 0 at small v). The grid repeats in both directions.
//! A query costs the same for any weave and any distance from the origin: positions are an integer
//! cell and a fraction, and how far each thread stays on one side is counted once, at construction.
//!
//! Axis 0 is that of u and 1 that of v: an end is crossed along axis 0 and runs along axis 1.

mod lanes;
mod position;
mod query;
mod sizes;

pub(crate) use lanes::{LaneLocals, LanePoints, LaneSizes, Positions, Segments, split_lanes};
pub use position::Position;
pub(crate) use position::split;
pub use query::{Segment, SegmentKind, Side};
pub use sizes::{Local, Sizes, ThreadPoint, ThreadSizes, Touching};

use std::sync::Arc;

use position::Period;

/// A grid of crossings: which of the two threads lies on top of each. Clones share it.
#[derive(Clone, Debug)]
pub struct Weave {
    /// Ends and picks.
    periods: [Period; 2],
    /// By pick, then by end.
    crossings: Arc<Vec<Crossing>>,
    has_uncovered: bool,
}

/// How far around a crossing the same thread stays on top, along each axis: 4 bytes.
///
/// The thread on top shows along its own axis, and the other one shows along the other axis on the
/// back of the cloth, so that one table serves both sides.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// By axis, then before and after: twice the number of further crossings up to [`FAR`], or
    /// [`ENDLESS`]; plus 1 if the pick is on top.
    runs: [[u8; 2]; 2],
}

/// Stands for this number of further crossings or more: the crossing so far away knows the rest.
const FAR: u8 = ENDLESS - 1;

/// Stands for a thread that stays on one side all along the repeat.
const ENDLESS: u8 = u8::MAX >> 1;

/// Greatest number of crossings: 1 GiB at 4 bytes each.
pub const MAX_CROSSINGS: u64 = 1 << 28;

impl Weave {
    /// The weave of `ends` × `picks` crossings; `warp_on_top(end, pick)` counts from 0.
    ///
    /// # Errors
    ///
    /// If there is no end or no pick, or there are more than [`MAX_CROSSINGS`].
    pub fn new(
        ends: u32,
        picks: u32,
        warp_on_top: impl Fn(u32, u32) -> bool,
    ) -> Result<Self, WeaveError> {
        if !(1..=MAX_CROSSINGS).contains(&(u64::from(ends) * u64::from(picks))) {
            return Err(WeaveError { ends, picks });
        }
        let mut crossings = Vec::with_capacity(ends as usize * picks as usize);
        for pick in 0..picks {
            crossings.extend((0..ends).map(|end| {
                let top = u8::from(!warp_on_top(end, pick));
                Crossing { runs: [[top; 2]; 2] }
            }));
        }
        let mut has_uncovered = false;
        for row in crossings.chunks_exact_mut(ends as usize) {
            has_uncovered |= count_runs(row);
        }
        has_uncovered |= count_runs_across(&mut crossings, ends as usize);
        let periods = [ends, picks].map(Period::new);
        Ok(Self { periods, crossings: Arc::new(crossings), has_uncovered })
    }

    /// Ends in the repeat.
    #[must_use]
    pub fn ends(&self) -> u32 {
        self.periods[0].count()
    }

    /// Picks in the repeat.
    #[must_use]
    pub fn picks(&self) -> u32 {
        self.periods[1].count()
    }

    /// Whether some thread stays on one side of the cloth all along the repeat.
    pub(crate) fn has_uncovered(&self) -> bool {
        self.has_uncovered
    }

    /// Whether the warp is on top at the crossing of `end` and `pick`, both taken modulo the repeat.
    #[must_use]
    pub fn warp_on_top(&self, end: i64, pick: i64) -> bool {
        self.crossings[self.index(self.threads([end, pick]))].top() == 0
    }

    /// The end and the pick of a cell within the repeat.
    #[inline]
    fn threads(&self, cell: [i64; 2]) -> [u32; 2] {
        [self.periods[0].wrap(cell[0]), self.periods[1].wrap(cell[1])]
    }

    /// The memory of the table, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.crossings.as_slice())
    }

    /// The index of the crossing of an end and a pick.
    #[inline]
    fn index(&self, [end, pick]: [u32; 2]) -> usize {
        pick as usize * self.stride(1) + end as usize
    }

    /// The step in the index from a crossing to the next along `axis`.
    #[inline]
    fn stride(&self, axis: usize) -> usize {
        if axis == 0 { 1 } else { self.ends() as usize }
    }

    /// The numbers of further crossings before and after the one at `index`, along `axis`, that have
    /// the same thread on top; `None` if all have.
    #[inline(always)]
    fn run(&self, index: usize, axis: usize) -> Option<[u32; 2]> {
        let [before, after] = self.crossings[index].runs[axis].map(|run| run >> 1);
        if before < FAR && after < FAR {
            Some([before.into(), after.into()])
        } else if before == ENDLESS {
            None
        } else {
            Some(self.long_run(index, axis))
        }
    }

    /// [`Weave::run`] of any length that ends.
    #[cold]
    fn long_run(&self, index: usize, axis: usize) -> [u32; 2] {
        let (stride, period) = (self.stride(axis), self.periods[axis]);
        let thread = (index / stride) as u32 % period.count();
        [-i64::from(FAR), FAR.into()].map(|leap| {
            let side = usize::from(leap > 0);
            let (mut here, mut total) = (thread, 0);
            loop {
                let index = index + here as usize * stride - thread as usize * stride;
                let steps = self.crossings[index].runs[axis][side] >> 1;
                total += u32::from(steps);
                if steps < FAR {
                    return total;
                }
                here = period.shift(here, leap);
            }
        })
    }
}

impl Crossing {
    /// 0 if the end is on top, 1 if the pick is.
    fn top(self) -> usize {
        usize::from(self.runs[0][0] & 1)
    }
}

/// Counts the runs along a row of crossings, and returns whether one of them is endless.
fn count_runs(row: &mut [Crossing]) -> bool {
    // In the first lap no run is known that began before it.
    let mut steps = [ENDLESS; 2];
    for is_counted in [false, true] {
        for k in 0..row.len() {
            let previous = row[if k == 0 { row.len() - 1 } else { k - 1 }].top();
            steps[0] = stepped(steps[0], row[k].top() == previous);
            row[k].runs[0][0] |= if is_counted { steps[0] << 1 } else { 0 };
        }
        for k in (0..row.len()).rev() {
            let next = row[if k + 1 == row.len() { 0 } else { k + 1 }].top();
            steps[1] = stepped(steps[1], row[k].top() == next);
            row[k].runs[0][1] |= if is_counted { steps[1] << 1 } else { 0 };
        }
    }
    steps[0] == ENDLESS
}

/// Counts the runs across the rows of `count` crossings, side by side, since a walk along each would
/// jump about in memory; returns whether one of them is endless.
fn count_runs_across(crossings: &mut [Crossing], count: usize) -> bool {
    let rows = crossings.len() / count;
    let mut has_endless = false;
    for side in 0..2 {
        let mut steps = vec![ENDLESS; count];
        for is_counted in [false, true] {
            for k in 0..rows {
                let (row, previous) = match side {
                    0 => (k, if k == 0 { rows - 1 } else { k - 1 }),
                    _ => (rows - 1 - k, if k == 0 { 0 } else { rows - k }),
                };
                for (column, steps) in steps.iter_mut().enumerate() {
                    let previous = crossings[previous * count + column].top();
                    let crossing = &mut crossings[row * count + column];
                    *steps = stepped(*steps, crossing.top() == previous);
                    crossing.runs[1][side] |= if is_counted { *steps << 1 } else { 0 };
                }
            }
        }
        has_endless |= steps.contains(&ENDLESS);
    }
    has_endless
}

/// The number of steps since the thread on top changed, one crossing further.
fn stepped(steps: u8, is_same: bool) -> u8 {
    if !is_same {
        0
    } else if steps < FAR {
        steps + 1
    } else {
        steps
    }
}

/// A weave of a size that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("weave: {ends} ends and {picks} picks, expected 1 to {MAX_CROSSINGS} crossings")]
pub struct WeaveError {
    ends: u32,
    picks: u32,
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    /// 2/1 twill: end i is up on picks i and i + 1.
    fn twill() -> Weave {
        Weave::new(3, 3, |end, pick| (pick + 3 - end) % 3 < 2).unwrap()
    }

    /// What the face shows at (u, v) where all threads have one size.
    fn at(weave: &Weave, u: f64, v: f64, size: f64) -> Option<Segment> {
        let sizes = |count: u32| vec![size; count as usize];
        let sizes = ThreadSizes::new(sizes(weave.ends()), sizes(weave.picks()));
        weave.segment_at(Side::Face, Position::new(DVec2::new(u, v)), &sizes)
    }

    #[test]
    fn crossing_takes_four_bytes_for_both_sides() {
        assert_eq!(size_of::<Crossing>(), 4);
    }

    #[test]
    fn segment_of_a_float_spans_it_and_its_coordinates_are_continuous() {
        let weave = twill();
        for (v, y) in [(0.0, -1.0), (0.5, -0.5), (1.0, 0.0), (1.75, 0.75)] {
            let segment = at(&weave, 0.25, v, 1.0).unwrap();
            assert!(segment.is_warp && segment.thread == 0 && !segment.is_straight());
            assert_eq!((segment.length, segment.width), (2.0, 1.0), "v = {v}");
            assert_eq!((segment.x, segment.y), (-0.5, y), "v = {v}");
        }
        // The weft on top at end 0, pick 2: one cell long, its x against v.
        let weft = at(&weave, 0.25, 2.75, 1.0).unwrap();
        assert_eq!((weft.is_warp, weft.thread, weft.length), (false, 2, 1.0));
        assert_eq!((weft.x, weft.y), (-0.5, -0.5));
    }

    #[test]
    fn segment_knows_its_thread_and_first_crossing_over_all_repeats() {
        // End 1 is up on picks 1 and 2, and 30 repeats above the origin on picks 91 and 92.
        for (repeats, v) in [(0, 1.5), (30, 92.5), (-2, -4.0)] {
            let float = at(&twill(), 7.5, v, 0.8).unwrap();
            assert_eq!((float.is_warp, float.thread, float.line), (true, 1, 7), "{float:?}");
            assert_eq!((float.first, float.crossings), (1 + 3 * repeats, 2), "{float:?}");
            assert_eq!(float.kind, SegmentKind::Top);
        }
        let dip = at(&twill(), 7.5, 3.05, 0.8).unwrap();
        assert_eq!(dip.kind, SegmentKind::Extension);
        assert_eq!((dip.line, dip.first, dip.crossings), (7, 1, 2), "{dip:?}");
    }

    #[test]
    fn thin_yarns_show_the_one_below_gaps_and_slits() {
        // Two ends side by side over the same picks: a slit between them.
        let weave = Weave::new(3, 2, |end, pick| (end < 2) ^ (pick == 1)).unwrap();
        let slit = at(&weave, 0.95, 0.5, 0.6).unwrap();
        assert!(!slit.is_warp && slit.is_straight() && slit.thread == 0);
        assert_eq!((slit.kind, slit.first, slit.crossings), (SegmentKind::Between, 0, 0));
        assert!((slit.length - 0.4).abs() < 1e-12, "{slit:?}");
        assert!((slit.y - 0.5 * (0.95 - 0.8) / 0.1 + 1.0).abs() < 1e-9, "{slit:?}");
        // The weft of pick 0 is on top at end 2 and dips under end 1 at its right edge.
        let dip = at(&weave, 1.9, 0.5, 0.6).unwrap();
        assert!(!dip.is_warp && !dip.is_straight() && dip.y < -0.8, "{dip:?}");
        assert!((dip.length - 1.4).abs() < 1e-12, "{dip:?}");
        // A corner between four thin yarns.
        assert_eq!(at(&weave, 0.05, 0.05, 0.6), None);
    }

    #[test]
    fn ends_of_a_segment_lie_at_the_edges_of_its_coverers() {
        /// Picks −1 and 2 are thin and off the middle.
        struct Thin;
        impl Sizes for Thin {
            fn at(&self, point: ThreadPoint) -> Local {
                if point.is_warp {
                    return Local { size: 1.0, offset: 0.0 };
                }
                assert_eq!((point.thread, point.cell, point.fraction), (2, 3, 0.5), "{point:?}");
                match point.line {
                    -1 => Local { size: 0.6, offset: -0.1 },
                    2 => Local { size: 0.8, offset: 0.1 },
                    line => panic!("pick {line} does not cover the segment"),
                }
            }
        }
        // Picks −1 and 2 cover end 3, which shows from −0.3 to 2.2.
        let position = Position { cell: [3, 1], fraction: [0.5, 0.5] };
        let segment = twill().segment_at(Side::Face, position, &Thin).unwrap();
        assert!((segment.length - 2.5).abs() < 1e-12, "{segment:?}");
        assert!((segment.y - 0.44).abs() < 1e-12, "{segment:?}");
    }

    #[test]
    fn position_below_a_thread_off_the_middle_is_in_the_slit_below_it() {
        /// Ends lie from 0.7 to 0.9 in their cells.
        struct Aside;
        impl Sizes for Aside {
            fn at(&self, point: ThreadPoint) -> Local {
                if point.is_warp {
                    Local { size: 0.2, offset: 0.3 }
                } else {
                    Local { size: 1.0, offset: 0.0 }
                }
            }
        }
        let weave = Weave::new(2, 2, |_, pick| pick == 0).unwrap();
        let y_at = |u: f64| {
            let position = Position { cell: [0, 0], fraction: [u, 0.5] };
            let slit = weave.segment_at(Side::Face, position, &Aside).unwrap();
            assert!((slit.length - 0.8).abs() < 1e-12, "{slit:?}");
            slit.y
        };
        // The slits reach from −0.1 to 0.7 and from 0.9 to 1.7.
        assert!((y_at(0.6) - 0.75).abs() < 1e-12);
        assert!((y_at(0.94) + 0.9).abs() < 1e-12);
    }

    #[test]
    fn slit_that_closes_in_the_middle_of_the_crossing_shows_where_it_is_open() {
        /// Ends touch in the middle of each crossing.
        struct Waisted;
        impl Sizes for Waisted {
            fn at(&self, point: ThreadPoint) -> Local {
                let size = if point.is_warp { 1.0 - (point.fraction - 0.5).abs() } else { 1.0 };
                Local { size, offset: 0.0 }
            }
        }
        let weave = Weave::new(2, 2, |_, pick| pick == 0).unwrap();
        let position = Position { cell: [0, 0], fraction: [0.95, 0.75] };
        let slit = weave.segment_at(Side::Face, position, &Waisted).unwrap();
        assert_eq!((slit.kind, slit.length), (SegmentKind::Between, 0.25));
        assert!((slit.y + 0.4).abs() < 1e-12, "{slit:?}");
    }

    #[test]
    fn thread_that_is_never_covered_is_straight_and_periodic() {
        let weave = Weave::new(2, 4, |end, _| end == 0).unwrap();
        let a = at(&weave, 0.5, 3.999_999, 1.0).unwrap();
        let b = at(&weave, 0.5, -0.000_001, 1.0).unwrap();
        assert!(a.is_straight() && a.length == 4.0);
        assert_eq!((a.kind, a.first, b.first), (SegmentKind::Endless, 0, -4));
        assert!((a.y - b.y).abs() < 1e-9, "{a:?} {b:?}");
        let middle = at(&weave, 0.5, 1.0, 1.0).unwrap();
        assert!((middle.y + 0.5).abs() < 1e-12, "{middle:?}");
    }

    #[test]
    fn back_shows_the_thread_below_with_u_turned_round() {
        // On pick 0 the weft lies below ends −1 and 0, on pick 2 end 0 lies below.
        let position = Position { cell: [0, 0], fraction: [0.25, 0.125] };
        let weft = twill().segment_at(Side::Back, position, &Touching).unwrap();
        assert_eq!((weft.is_warp, weft.line, weft.first, weft.crossings), (false, 0, -1, 2));
        assert_eq!((weft.x, weft.y), (0.75, -0.25));
        let position = Position { cell: [0, 2], fraction: [0.25, 0.125] };
        let warp = twill().segment_at(Side::Back, position, &Touching).unwrap();
        assert_eq!((warp.is_warp, warp.line, warp.first, warp.crossings), (true, 0, 2, 1));
        assert_eq!((warp.x, warp.y), (0.5, -0.75));
    }

    #[test]
    fn runs_of_any_length_are_counted() {
        let far = u32::from(FAR);
        for length in [1, far - 1, far, far + 1, far + 2, 2 * far, 2 * far + 1, 5 * far + 7] {
            // Thread 0 is covered once, thread 1 always.
            let weft = Weave::new(length + 1, 2, |end, pick| end == 0 || pick == 1).unwrap();
            let warp = Weave::new(2, length + 1, |end, pick| end == 0 && pick != 0).unwrap();
            for k in [1, length / 3 + 1, length / 2 + 1, length] {
                let k = i64::from(k);
                let in_run = |weave: &Weave, cell: [i64; 2]| {
                    let position = Position { cell, fraction: [0.5; 2] };
                    let segment = weave.segment_at(Side::Face, position, &Touching).unwrap();
                    (segment.thread, segment.first, segment.crossings)
                };
                assert_eq!(in_run(&weft, [k, 0]), (0, 1, length), "crossing {k}");
                assert_eq!(in_run(&warp, [0, k]), (0, 1, length), "crossing {k}");
            }
        }
    }

    #[test]
    fn weave_without_threads_is_an_error() {
        let error = Weave::new(0, 4, |_, _| true).unwrap_err();
        assert_eq!(
            error.to_string(),
            "weave: 0 ends and 4 picks, expected 1 to 268435456 crossings"
        );
    }
}
