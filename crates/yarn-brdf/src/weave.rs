//! The grid of crossings, and which piece of which yarn lies at a position.
//!
//! Cell (i, j) is the crossing of end i with pick j, both from 0; u runs along the weft (end 0 at
//! the left, small u) and v along the warp (pick 0 at small v). The grid repeats in both directions.
//! A query costs the same for any weave and any distance from the origin: positions are an integer
//! cell and a fraction, and the runs of each yarn on top are counted once, at construction.

/// A grid of crossings: which of the two threads lies on top of each.
#[derive(Clone, Debug)]
pub struct Weave {
    ends: u32,
    picks: u32,
    crossings: Vec<Crossing>,
    has_uncovered: bool,
}

/// How far the thread on top of a crossing stays on top: 8 bytes.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// Twice the number of further crossings before this one, plus 1 if the warp is on top.
    before_and_top: u32,
    /// The number of further crossings after this one.
    after: u32,
}

/// Greatest number of crossings: 2 GiB at 8 bytes each.
pub const MAX_CROSSINGS: u64 = 1 << 28;

/// A visible piece of yarn, and where on it a position lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Whether the yarn is an end (warp); else it is a pick (weft).
    pub is_warp: bool,
    /// The thread's index within the repeat, from 0.
    pub thread: u32,
    /// Position across the yarn in the yarn frame, in [−1, 1].
    pub x: f64,
    /// Position along the yarn, in [−1, 1].
    pub y: f64,
    /// Length in cells.
    pub length: f64,
    /// Width in cells.
    pub width: f64,
    /// Whether the piece does not bend: a thread that is never covered, or one seen in the slit
    /// between two parallel threads.
    pub is_straight: bool,
}

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
        Ok(Self::of_size(ends, picks, warp_on_top))
    }

    /// The weave of a size that is known to be allowed.
    fn of_size(ends: u32, picks: u32, warp_on_top: impl Fn(u32, u32) -> bool) -> Self {
        let mut crossings = Vec::with_capacity(ends as usize * picks as usize);
        for pick in 0..picks {
            for end in 0..ends {
                let top = u32::from(warp_on_top(end, pick));
                crossings.push(Crossing { before_and_top: top, after: 0 });
            }
        }
        let mut weave = Self { ends, picks, crossings, has_uncovered: false };
        for end in 0..ends {
            weave.count_runs(end as usize, ends as usize, picks as usize, true);
        }
        for pick in 0..picks {
            weave.count_runs(pick as usize * ends as usize, 1, ends as usize, false);
        }
        weave
    }

    /// Counts the runs of one thread, whose crossings stand at `first + k·stride`, k < `count`.
    fn count_runs(&mut self, first: usize, stride: usize, count: usize, is_warp: bool) {
        let is_on_top = |crossings: &[Crossing], k: usize| {
            crossings[first + k * stride].warp_on_top() == is_warp
        };
        let Some(covered) = (0..count).find(|&k| !is_on_top(&self.crossings, k)) else {
            self.has_uncovered = true;
            for k in 0..count {
                let crossing = &mut self.crossings[first + k * stride];
                crossing.before_and_top |= (count as u32) << 1;
                crossing.after = count as u32;
            }
            return;
        };
        // Start behind a crossing where the thread is covered, so that no run is cut by the edge.
        let (mut before, mut after) = (0, 0);
        for step in 1..=count {
            let forward = first + ((covered + step) % count) * stride;
            let backward = first + ((covered + count - step) % count) * stride;
            if self.crossings[forward].warp_on_top() == is_warp {
                self.crossings[forward].before_and_top |= before << 1;
                before += 1;
            } else {
                before = 0;
            }
            if self.crossings[backward].warp_on_top() == is_warp {
                self.crossings[backward].after = after;
                after += 1;
            } else {
                after = 0;
            }
        }
    }

    /// Ends in the repeat.
    pub fn ends(&self) -> u32 {
        self.ends
    }

    /// Picks in the repeat.
    pub fn picks(&self) -> u32 {
        self.picks
    }

    /// Whether some thread is on top all along the repeat.
    pub(crate) fn has_uncovered(&self) -> bool {
        self.has_uncovered
    }

    /// Whether the warp is on top at the crossing of `end` and `pick`, both taken modulo the repeat.
    pub fn warp_on_top(&self, end: i64, pick: i64) -> bool {
        self.crossing([end, pick]).warp_on_top()
    }

    /// The same weave from behind, turned over about a warp line: ends in the opposite order and
    /// the other thread on top.
    #[must_use]
    pub fn back(&self) -> Self {
        let last = i64::from(self.ends) - 1;
        Self::of_size(self.ends, self.picks, |end, pick| {
            !self.warp_on_top(last - i64::from(end), pick.into())
        })
    }

    /// The piece of yarn at `fraction`, in [0, 1)², of the cell `cell` = (end, pick), both any
    /// integers; `None` in a gap. `end_size(i)` and `pick_size(j)` are the threads' diameters over
    /// their pitch, in (0, 1].
    ///
    /// Missing the yarn on top, the position may hit the one below: on the part where that yarn
    /// dips under (it belongs to the segment of the neighbouring cell) or, between two parallel
    /// yarns on top, on a short straight piece.
    pub fn segment_at(
        &self,
        cell: [i64; 2],
        fraction: [f64; 2],
        end_size: impl Fn(u32) -> f64,
        pick_size: impl Fn(u32) -> f64,
    ) -> Option<Segment> {
        let sizes = Sizes { end: end_size, pick: pick_size };
        let is_warp = self.crossing(cell).warp_on_top();
        let size = self.size(&sizes, cell, is_warp);
        // Axis 0 runs along u, 1 along v: a warp is crossed along u.
        let axis = usize::from(!is_warp);
        if (2.0 * fraction[axis] - 1.0).abs() <= size {
            return Some(self.top_segment(&sizes, cell, fraction, is_warp));
        }
        let size_below = self.size(&sizes, cell, !is_warp);
        if (2.0 * fraction[1 - axis] - 1.0).abs() > size_below {
            return None;
        }
        let step = if fraction[axis] >= 0.5 { 1 } else { -1 };
        let mut neighbour = cell;
        neighbour[axis] += step;
        if self.crossing(neighbour).warp_on_top() != is_warp {
            let mut offset = fraction;
            offset[axis] -= step as f64;
            return Some(self.top_segment(&sizes, neighbour, offset, !is_warp));
        }
        let (slit, slit_beyond) =
            (0.5 * (1.0 - size), 0.5 * (1.0 - self.size(&sizes, neighbour, is_warp)));
        let length = slit + slit_beyond;
        let start = if step > 0 { 1.0 - slit } else { -slit_beyond };
        Some(Segment {
            is_warp: !is_warp,
            thread: self.thread(cell, !is_warp),
            x: across(fraction[1 - axis], size_below, !is_warp),
            y: 2.0 * (fraction[axis] - start) / length - 1.0,
            length,
            width: size_below,
            is_straight: true,
        })
    }

    /// The segment of the yarn on top of `cell`; `offset` is the position from the cell's corner.
    fn top_segment(
        &self,
        sizes: &Sizes<impl Fn(u32) -> f64, impl Fn(u32) -> f64>,
        cell: [i64; 2],
        offset: [f64; 2],
        is_warp: bool,
    ) -> Segment {
        let axis = usize::from(is_warp);
        let crossing = self.crossing(cell);
        let (before, after) = (i64::from(crossing.before()), i64::from(crossing.after));
        let count = i64::from(if is_warp { self.picks } else { self.ends });
        let is_straight = before >= count;
        let (start, length) = if is_straight {
            // Never covered: periodic over the repeat.
            (-cell[axis].rem_euclid(count) as f64, count as f64)
        } else {
            // The yarn shows up to the middle of the slit that its coverer leaves.
            let slit = |steps: i64| {
                let mut covered = cell;
                covered[axis] += steps;
                0.5 * (1.0 - self.size(sizes, covered, !is_warp))
            };
            let (first, last) = (slit(-before - 1), slit(after + 1));
            (-(before as f64) - first, (before + after + 1) as f64 + first + last)
        };
        let width = self.size(sizes, cell, is_warp);
        Segment {
            is_warp,
            thread: self.thread(cell, is_warp),
            x: across(offset[1 - axis], width, is_warp),
            y: 2.0 * (offset[axis] - start) / length - 1.0,
            length,
            width,
            is_straight,
        }
    }

    fn crossing(&self, cell: [i64; 2]) -> Crossing {
        let end = self.thread(cell, true) as usize;
        let pick = self.thread(cell, false) as usize;
        self.crossings[pick * self.ends as usize + end]
    }

    /// The index of the end or pick of `cell` within the repeat.
    fn thread(&self, cell: [i64; 2], is_warp: bool) -> u32 {
        let (position, count) = if is_warp { (cell[0], self.ends) } else { (cell[1], self.picks) };
        position.rem_euclid(count.into()) as u32
    }

    fn size(
        &self,
        sizes: &Sizes<impl Fn(u32) -> f64, impl Fn(u32) -> f64>,
        cell: [i64; 2],
        is_warp: bool,
    ) -> f64 {
        let thread = self.thread(cell, is_warp);
        if is_warp { (sizes.end)(thread) } else { (sizes.pick)(thread) }
    }
}

struct Sizes<E, P> {
    end: E,
    pick: P,
}

impl Crossing {
    fn warp_on_top(self) -> bool {
        self.before_and_top & 1 == 1
    }

    fn before(self) -> u32 {
        self.before_and_top >> 1
    }
}

/// The coordinate x across a yarn of `width` at `offset` across its cell. The x of a weft's frame
/// runs against v.
fn across(offset: f64, width: f64, is_warp: bool) -> f64 {
    let x = (2.0 * offset - 1.0) / width;
    if is_warp { x } else { -x }
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
    use super::*;

    /// 2/1 twill: end i is up on picks i and i + 1.
    fn twill() -> Weave {
        Weave::new(3, 3, |end, pick| (pick + 3 - end) % 3 < 2).unwrap()
    }

    fn at(weave: &Weave, u: f64, v: f64, size: f64) -> Option<Segment> {
        let cell = [u.floor() as i64, v.floor() as i64];
        weave.segment_at(cell, [u - u.floor(), v - v.floor()], |_| size, |_| size)
    }

    #[test]
    fn segment_of_a_float_spans_it_and_its_coordinates_are_continuous() {
        let weave = twill();
        for (v, y) in [(0.0, -1.0), (0.5, -0.5), (1.0, 0.0), (1.75, 0.75)] {
            let segment = at(&weave, 0.25, v, 1.0).unwrap();
            assert!(segment.is_warp && segment.thread == 0 && !segment.is_straight);
            assert_eq!((segment.length, segment.width), (2.0, 1.0), "v = {v}");
            assert_eq!((segment.x, segment.y), (-0.5, y), "v = {v}");
        }
        // The weft on top at end 0, pick 2: one cell long, its x against v.
        let weft = at(&weave, 0.25, 2.75, 1.0).unwrap();
        assert_eq!((weft.is_warp, weft.thread, weft.length), (false, 2, 1.0));
        assert_eq!((weft.x, weft.y), (-0.5, -0.5));
    }

    #[test]
    fn segments_repeat_with_the_tile_at_any_distance() {
        let weave = twill();
        let far = 3 * 1_000_000_000i64;
        for (i, j) in [(0, 0), (1, 2), (2, 1), (-1, -5)] {
            for fraction in [[0.1, 0.2], [0.99, 0.5], [0.5, 0.01]] {
                let here = weave.segment_at([i, j], fraction, |_| 0.7, |_| 0.8);
                let there = weave.segment_at([i + far, j - far], fraction, |_| 0.7, |_| 0.8);
                assert_eq!(here, there, "cell {i}, {j} at {fraction:?}");
            }
        }
    }

    #[test]
    fn thin_yarns_show_the_one_below_gaps_and_slits() {
        // Two ends side by side over the same picks: a slit between them.
        let weave = Weave::new(3, 2, |end, pick| (end < 2) ^ (pick == 1)).unwrap();
        let slit = at(&weave, 0.95, 0.5, 0.6).unwrap();
        assert!(!slit.is_warp && slit.is_straight && slit.thread == 0);
        assert!((slit.length - 0.4).abs() < 1e-12, "{slit:?}");
        assert!((slit.y - 0.5 * (0.95 - 0.8) / 0.1 + 1.0).abs() < 1e-9, "{slit:?}");
        // The weft of pick 0 is on top at end 2 and dips under end 1 at its right edge.
        let dip = at(&weave, 1.9, 0.5, 0.6).unwrap();
        assert!(!dip.is_warp && !dip.is_straight && dip.y < -0.8, "{dip:?}");
        assert!((dip.length - 1.4).abs() < 1e-12, "{dip:?}");
        // A corner between four thin yarns.
        assert_eq!(at(&weave, 0.05, 0.05, 0.6), None);
    }

    #[test]
    fn coordinates_stay_within_the_segment() {
        let weave = Weave::new(5, 5, |end, pick| (pick * 2 + end) % 5 != 0).unwrap();
        for size in [1.0, 0.8, 0.3] {
            for step in 0..40_000 {
                let u = f64::from(step % 200) * 0.0251;
                let v = f64::from(step / 200) * 0.0253;
                if let Some(s) = at(&weave, u, v, size) {
                    let is_in = s.x.abs() <= 1.0 + 1e-9 && s.y.abs() <= 1.0 + 1e-9;
                    assert!(is_in, "{u}, {v}, size {size}: {s:?}");
                }
            }
        }
    }

    #[test]
    fn thread_that_is_never_covered_is_straight_and_periodic() {
        let weave = Weave::new(2, 4, |end, _| end == 0).unwrap();
        let a = at(&weave, 0.5, 3.999_999, 1.0).unwrap();
        let b = at(&weave, 0.5, -0.000_001, 1.0).unwrap();
        assert!(a.is_straight && a.length == 4.0);
        assert!((a.y - b.y).abs() < 1e-9, "{a:?} {b:?}");
        let middle = at(&weave, 0.5, 1.0, 1.0).unwrap();
        assert!((middle.y + 0.5).abs() < 1e-12, "{middle:?}");
    }

    #[test]
    fn back_shows_the_other_thread_mirrored() {
        let weave = twill();
        let back = weave.back();
        for end in 0..3 {
            for pick in 0..3 {
                assert_ne!(weave.warp_on_top(end, pick), back.warp_on_top(2 - end, pick));
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
