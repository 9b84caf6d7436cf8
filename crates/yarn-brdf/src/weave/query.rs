//! The piece of yarn at a position.

use super::{Local, Position, Sizes, ThreadPoint, Weave};

/// The side from which the cloth is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side that the draft describes.
    Face,
    /// The other side, turned over about a warp line: the thread below each crossing is on top, and
    /// u runs the other way in the yarn frames. Positions and threads keep the numbers they have on
    /// the face.
    Back,
}

/// A visible piece of yarn, and where on it a position lies.
///
/// `is_warp`, `line` and `first` identify the piece on its side of the cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Whether the yarn is an end (warp); else it is a pick (weft).
    pub is_warp: bool,
    /// How the piece comes to be seen.
    pub kind: SegmentKind,
    /// The thread's index within the repeat, from 0.
    pub thread: u32,
    /// Number of crossings that the piece is on top of; 0 in a slit, and those of one repeat on an
    /// endless thread.
    pub crossings: u32,
    /// The thread's index over all repeats.
    pub line: i64,
    /// Index over all repeats of the thread at the first of these crossings; that of the thread on
    /// top of the position in a slit, and the first of the repeat on an endless thread.
    pub first: i64,
    /// Position across the yarn in the yarn frame, in [−1, 1].
    pub x: f64,
    /// Position along the yarn in the yarn frame, in [−1, 1].
    pub y: f64,
    /// Length in cells: the same all over the piece, but in a slit that of the slit at the position.
    pub length: f64,
    /// Width in cells at the position.
    pub width: f64,
}

/// How a piece of yarn comes to be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// On top of the crossing at the position.
    Top,
    /// Where the yarn on top of the neighbouring crossing dips under the one that is on top here.
    Extension,
    /// In the slit between two parallel yarns, both on top: straight.
    Between,
    /// On a yarn that is never covered: straight, one repeat long.
    Endless,
}

impl Segment {
    /// Whether the piece does not bend: a thread that is never covered, or one seen in the slit
    /// between two parallel threads.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        matches!(self.kind, SegmentKind::Between | SegmentKind::Endless)
    }
}

impl Weave {
    /// The piece of yarn that `side` shows at `position`; `None` in a gap.
    ///
    /// Missing the yarn on top, the position may hit the one below: on the part where that yarn
    /// dips under (it belongs to the segment of the neighbouring crossing) or, between two parallel
    /// yarns on top, on a short straight piece.
    ///
    /// Whether a yarn is hit, and x, go by its size at the position. A segment ends at the edges of
    /// the yarns that cover it, as wide as they are in the middle of the crossing, so that its length
    /// is one all over; where more of it shows, y remains ±1.
    #[must_use]
    #[inline(always)]
    pub fn segment_at(
        &self,
        side: Side,
        position: Position,
        sizes: &impl Sizes,
    ) -> Option<Segment> {
        let threads = self.threads(position.cell);
        let index = self.index(threads);
        Query { weave: self, side, position, threads, index, sizes }.segment()
    }
}

/// A position with all that is needed to tell what shows there.
///
/// Whether a thread is an end or a pick is an index here, not a `bool`: the compiler turns a choice
/// between two floating-point numbers by a `bool` into a branch, which half of all positions
/// mispredict.
struct Query<'a, S> {
    weave: &'a Weave,
    side: Side,
    position: Position,
    /// The end and the pick of the position's cell within the repeat.
    threads: [u32; 2],
    /// The index of their crossing.
    index: usize,
    sizes: &'a S,
}

/// A thread through the position's cell.
#[derive(Clone, Copy)]
struct Strand {
    /// The axis along which the thread is crossed: 0 for an end, 1 for a pick.
    axis: usize,
    local: Local,
    /// Twice the distance of the position from the middle of the thread, in cells.
    across: f64,
}

/// A crossing next to the position's cell, or that of the cell.
#[derive(Clone, Copy)]
struct Neighbor {
    /// How many cells further along the axis: −1, 0 or 1.
    steps: i64,
    /// The thread crossed there, within the repeat.
    thread: u32,
    /// The index of the crossing.
    index: usize,
}

impl<S: Sizes> Query<'_, S> {
    #[inline(always)]
    fn segment(&self) -> Option<Segment> {
        let crossings = &self.weave.crossings;
        let top_on_face = crossings[self.index].top();
        let top = self.strand(top_on_face ^ self.side as usize);
        if S::ARE_TOUCHING || top.is_hit() {
            let thread = self.threads[1 - top.axis];
            return Some(self.on_top(top, Neighbor { steps: 0, thread, index: self.index }));
        }
        let below = self.strand(1 - top.axis);
        if !below.is_hit() {
            return None;
        }
        // Past the upper or the lower edge of the thread on top.
        let neighbor = self.neighbor(top.axis, if top.across > 0.0 { 1 } else { -1 });
        Some(if crossings[neighbor.index].top() == top_on_face {
            self.between(top, below, neighbor)
        } else {
            self.on_top(below, neighbor)
        })
    }

    #[inline(always)]
    fn strand(&self, axis: usize) -> Strand {
        let local = self.size_here(axis, 0, self.threads[axis]);
        Strand { axis, local, across: 2.0 * (self.position.fraction[axis] - local.offset) - 1.0 }
    }

    /// The size, abreast of the position, of the `thread` that lies `steps` cells along `axis`, which
    /// crosses it.
    fn size_here(&self, axis: usize, steps: i64, thread: u32) -> Local {
        let Position { cell, fraction } = &self.position;
        self.sizes.at(ThreadPoint {
            is_warp: axis == 0,
            thread,
            line: cell[axis].wrapping_add(steps),
            cell: cell[1 - axis],
            fraction: fraction[1 - axis],
        })
    }

    #[inline(always)]
    fn neighbor(&self, axis: usize, steps: i64) -> Neighbor {
        let here = self.threads[axis];
        let thread = self.weave.periods[axis].shift(here, steps);
        let stride = self.weave.stride(axis);
        let index = self.index + thread as usize * stride - here as usize * stride;
        Neighbor { steps, thread, index }
    }

    /// The segment of a thread that is on top at the crossing `on`.
    #[inline(always)]
    fn on_top(&self, strand: Strand, on: Neighbor) -> Segment {
        let axis = 1 - strand.axis;
        let period = self.weave.periods[axis];
        let cell = self.position.cell[axis].wrapping_add(on.steps);
        let offset = self.position.fraction[axis] - on.steps as f64;
        let Some([before, after]) = self.weave.run(on.index, axis) else {
            let length = f64::from(period.count());
            let along = (f64::from(on.thread) + offset) * (1.0 / length);
            let first = cell.wrapping_sub(on.thread.into());
            let extent = Extent { first, crossings: period.count(), length };
            return self.piece(strand, SegmentKind::Endless, extent, along);
        };
        // The space that a thread which covers this one leaves it, in the middle of their crossing.
        let slit = |steps: i64, side: f64| {
            if S::ARE_TOUCHING {
                return 0.0;
            }
            let coverer = ThreadPoint {
                is_warp: axis == 0,
                thread: period.shift(on.thread, steps),
                line: cell.wrapping_add(steps),
                cell: self.position.cell[strand.axis],
                fraction: 0.5,
            };
            self.sizes.at(coverer).slit(side)
        };
        let start = slit(-i64::from(before) - 1, 1.0);
        let end = slit(i64::from(after) + 1, -1.0);
        let crossings = before + after + 1;
        let length = f64::from(crossings) + start + end;
        let along = (f64::from(before) + offset + start) * (1.0 / length);
        let extent = Extent { first: cell.wrapping_sub(before.into()), crossings, length };
        let kind = if on.steps == 0 { SegmentKind::Top } else { SegmentKind::Extension };
        self.piece(strand, kind, extent, along)
    }

    /// The piece of the thread `below` between `top` and its neighbour.
    fn between(&self, top: Strand, below: Strand, neighbor: Neighbor) -> Segment {
        let axis = top.axis;
        let beyond = self.size_here(axis, neighbor.steps, neighbor.thread);
        let side = neighbor.steps as f64;
        let (near, far) = (top.local.slit(side), beyond.slit(-side));
        // Not 0 even where rounding closes the slit.
        let length = (near + far).max(f64::MIN_POSITIVE);
        let start = if side > 0.0 { 1.0 - near } else { -far };
        let along = (self.position.fraction[axis] - start) * (1.0 / length);
        let extent = Extent { first: self.position.cell[axis], crossings: 0, length };
        self.piece(below, SegmentKind::Between, extent, along)
    }

    /// The piece that the position hits at the fraction `along` of its length.
    #[inline(always)]
    fn piece(&self, strand: Strand, kind: SegmentKind, extent: Extent, along: f64) -> Segment {
        let Strand { axis, local, across } = strand;
        let Extent { first, crossings, length } = extent;
        let [x_sign, y_sign] = SIGNS[self.side as usize][axis];
        Segment {
            is_warp: axis == 0,
            kind,
            thread: self.threads[axis],
            crossings,
            line: self.position.cell[axis],
            first,
            x: x_sign * across / local.size,
            y: y_sign * (2.0 * along - 1.0).clamp(-1.0, 1.0),
            length,
            width: local.size,
        }
    }
}

impl Strand {
    fn is_hit(&self) -> bool {
        self.across.abs() <= self.local.size
    }
}

/// How far a piece reaches; see [`Segment`].
#[derive(Clone, Copy)]
struct Extent {
    first: i64,
    crossings: u32,
    length: f64,
}

/// Which way x and y of a yarn frame run against u and v: on the face and the back, of an end and a
/// pick. Picks have x against v; turning the cloth over about a warp line turns u round.
const SIGNS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.0], [-1.0, 1.0]], [[-1.0, 1.0], [-1.0, -1.0]]];

impl Local {
    /// The space that the thread leaves in its cell on the side of greater (+1) or smaller (−1)
    /// coordinates.
    #[inline(always)]
    fn slit(self, side: f64) -> f64 {
        0.5 * (1.0 - self.size) - side * self.offset
    }
}
