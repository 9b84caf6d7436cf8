//! Sixteen pieces of yarn at a time: [`Weave::segment_at`] side by side.
//!
//! Everything is a number here, also what is an integer or a choice there: cells and threads are whole
//! `f64`, which are exact up to [`FARTHEST`]. Each step rounds as that for one position does.

use fearless_simd::{Simd, mask32x16, prelude::*, u32x16};

use super::{ENDLESS, FAR, Touching, Weave};
use crate::lanes::{LANES, ROUND_F64, Wide, WideMask};

/// Least coordinate, in cells, that is left to [`super::Position`]: products with numbers up to 2²⁰ are
/// exact below it.
const FARTHEST: f64 = (1_u64 << 30) as f64;

/// Sixteen positions on the cloth.
#[derive(Clone, Copy)]
pub(crate) struct Positions<S: Simd> {
    /// End and pick over all repeats.
    pub(crate) cell: [Wide<S>; 2],
    /// Distance along u and v from the cell's corner, in cells, in [0, 1).
    pub(crate) fraction: [Wide<S>; 2],
    /// End and pick within the repeat.
    thread: [Wide<S>; 2],
}

/// What shows at sixteen positions; see [`super::Segment`].
#[derive(Clone, Copy)]
pub(crate) struct Segments<S: Simd> {
    /// Lanes in which a yarn shows.
    pub(crate) is_hit: mask32x16<S>,
    pub(crate) is_warp: mask32x16<S>,
    pub(crate) is_straight: mask32x16<S>,
    pub(crate) thread: u32x16<S>,
    /// The coordinates, up to their signs.
    pub(crate) x: Wide<S>,
    pub(crate) y: Wide<S>,
    /// Whether x and y have the other sign.
    pub(crate) is_mirrored: [mask32x16<S>; 2],
    /// 1 over the length.
    pub(crate) inv_length: Wide<S>,
    pub(crate) width: Wide<S>,
}

/// The sizes of threads, sixteen at a time; see [`super::Sizes`].
pub(crate) trait LaneSizes {
    /// Whether every thread fills its pitch everywhere.
    const ARE_TOUCHING: bool = false;
    /// Whether threads may lie off the middle of their cells.
    const ARE_SHIFTED: bool = false;

    /// The size of each thread at a point of it.
    fn at<S: Simd>(&self, points: &LanePoints<S>) -> LaneLocals<S>;
}

/// Points along sixteen threads; see [`super::ThreadPoint`]. All but the fractions are whole numbers.
#[derive(Clone, Copy)]
pub(crate) struct LanePoints<S: Simd> {
    pub(crate) is_warp: WideMask<S>,
    pub(crate) thread: Wide<S>,
    pub(crate) line: Wide<S>,
    pub(crate) cell: Wide<S>,
    pub(crate) fraction: Wide<S>,
}

/// The extents of threads; see [`super::Local`].
#[derive(Clone, Copy)]
pub(crate) struct LaneLocals<S: Simd> {
    pub(crate) size: Wide<S>,
    /// Not read unless [`LaneSizes::ARE_SHIFTED`].
    pub(crate) offset: Wide<S>,
}

impl LaneSizes for Touching {
    const ARE_TOUCHING: bool = true;

    #[inline(always)]
    fn at<S: Simd>(&self, points: &LanePoints<S>) -> LaneLocals<S> {
        LaneLocals { size: points.thread.of(1.0), offset: points.thread.of(0.0) }
    }
}

impl<S: Simd> LaneLocals<S> {
    /// Those where `mask` holds, else `other`.
    #[inline(always)]
    fn or(self, mask: WideMask<S>, other: Self) -> Self {
        Self { size: self.size.or(mask, other.size), offset: self.offset.or(mask, other.offset) }
    }

    /// Twice the distance of a position from the middle of the thread, in cells.
    #[inline(always)]
    fn across<T: LaneSizes>(self, fraction: Wide<S>) -> Wide<S> {
        let fraction = if T::ARE_SHIFTED { fraction - self.offset } else { fraction };
        fraction * 2.0 - 1.0
    }

    /// The space that the thread leaves in its cell on the `side` of greater (+1) or smaller (−1) coordinates.
    #[inline(always)]
    fn slit<T: LaneSizes>(self, side: Wide<S>) -> Wide<S> {
        let slit = (-self.size + 1.0) * 0.5;
        if T::ARE_SHIFTED { slit - side * self.offset } else { slit }
    }
}

/// Which threads are ends.
#[derive(Clone, Copy)]
struct Ends<S: Simd> {
    mask: mask32x16<S>,
    wide: WideMask<S>,
}

impl<S: Simd> Ends<S> {
    #[inline(always)]
    fn new(mask: mask32x16<S>) -> Self {
        Self { mask, wide: WideMask::of(mask) }
    }
}

/// Threads that are hit.
#[derive(Clone, Copy)]
struct Strands<S: Simd> {
    is_end: Ends<S>,
    /// Twice the distance of the position from the middle of the thread, in cells.
    across: Wide<S>,
    size: Wide<S>,
}

/// Crossings on which a strand is on top.
#[derive(Clone, Copy)]
struct Crossings<S: Simd> {
    index: Wide<S>,
    /// The thread crossed there, within the repeat.
    thread: Wide<S>,
    /// And over all repeats.
    line: Wide<S>,
    /// Where along the strand the position is, from the edge of that thread's cell, in cells.
    offset: Wide<S>,
    /// The bytes of [`super::Crossing`].
    bits: u32x16<S>,
}

/// How far pieces reach.
#[derive(Clone, Copy)]
struct Extents<S: Simd> {
    is_straight: mask32x16<S>,
    inv_length: Wide<S>,
    /// The fraction of the length at which the position is.
    along: Wide<S>,
}

impl Weave {
    /// The positions at (u, v) = `cells`, in cells, and whether all of them are near enough to be told.
    #[inline(always)]
    pub(crate) fn positions<S: Simd>(&self, cells: [Wide<S>; 2]) -> (Positions<S>, bool) {
        let far = cells[0].of(FARTHEST);
        let is_near = cells[0].abs().lt(far) & cells[1].abs().lt(far);
        let ((end, u), (pick, v)) = (split_lanes(cells[0]), split_lanes(cells[1]));
        let thread = [self.wrapped(0, end), self.wrapped(1, pick)];
        (Positions { cell: [end, pick], fraction: [u, v], thread }, is_near.narrow().all_true())
    }

    /// `cell` modulo the period along `axis`.
    #[inline(always)]
    fn wrapped<S: Simd>(&self, axis: usize, cell: Wide<S>) -> Wide<S> {
        let period = self.periods[axis];
        let count = f64::from(period.count());
        // The quotient is off by less than a half.
        let repeats = (cell * period.inverse() + ROUND_F64) - ROUND_F64;
        let rest = cell - repeats * count;
        (rest + count).or(rest.lt(rest.of(0.0)), rest)
    }

    /// The pieces of yarn at `position`, seen from the back where `is_back` holds.
    #[inline(always)]
    pub(crate) fn segments_at<S: Simd, T: LaneSizes>(
        &self,
        is_back: mask32x16<S>,
        position: &Positions<S>,
        sizes: &T,
    ) -> Segments<S> {
        let Positions { cell: [end_line, pick_line], fraction: [u, v], thread: [end, pick] } =
            *position;
        let index = pick * f64::from(self.ends()) + end;
        let bits = self.bits(index);
        let top_is_end = Ends::new(!(pick_is_top(bits) ^ is_back));
        let on_top = Crossings {
            index,
            thread: pick.or(top_is_end.wide, end),
            line: pick_line.or(top_is_end.wide, end_line),
            offset: v.or(top_is_end.wide, u),
            bits,
        };
        let all = mask32x16::splat(is_back.token(), true);
        if T::ARE_TOUCHING {
            let across = (u * 2.0 - 1.0).or(top_is_end.wide, v * 2.0 - 1.0);
            let top = Strands { is_end: top_is_end, across, size: u.of(1.0) };
            let extents = self.extents(top_is_end, on_top, position, sizes);
            return self.pieces(is_back, position, top, extents, all);
        }
        let of_end = sizes.at(&LanePoints {
            is_warp: WideMask::of(all),
            thread: end,
            line: end_line,
            cell: pick_line,
            fraction: v,
        });
        let of_pick = sizes.at(&LanePoints {
            is_warp: WideMask::of(!all),
            thread: pick,
            line: pick_line,
            cell: end_line,
            fraction: u,
        });
        let (across_end, across_pick) = (of_end.across::<T>(u), of_pick.across::<T>(v));
        let end_is_hit = across_end.abs().le(of_end.size);
        let pick_is_hit = across_pick.abs().le(of_pick.size);
        let top = of_end.or(top_is_end.wide, of_pick);
        let across = across_end.or(top_is_end.wide, across_pick);
        let top_is_hit = across.abs().le(top.size);
        // Past the edge of the thread on top the one below may show: as a part of the segment that
        // begins at the next crossing along the axis on which that thread is crossed.
        let step = u.of(1.0).copysign(across);
        let thread = end.or(top_is_end.wide, pick);
        let next = self.shifted(top_is_end.wide, thread, step);
        let next_line = end_line.or(top_is_end.wide, pick_line) + step;
        let stride = u.of(1.0).or(top_is_end.wide, u.of(self.ends().into()));
        let next_index = index + (next - thread) * stride;
        let next_bits = self.bits(next_index);
        let is_on = top_is_hit.narrow();
        let is_between = !is_on & !(pick_is_top(bits) ^ pick_is_top(next_bits));
        let aside = u.or(top_is_end.wide, v);
        let on = Crossings {
            index: index.or(top_is_hit, next_index),
            thread: on_top.thread.or(top_is_hit, next),
            line: on_top.line.or(top_is_hit, next_line),
            offset: on_top.offset.or(top_is_hit, aside - step),
            bits: is_on.select(bits, next_bits),
        };
        let is_end = Ends::new(!(top_is_end.mask ^ is_on));
        let mut extents = self.extents(is_end, on, position, sizes);
        if is_between.any_true() {
            let beyond = sizes.at(&LanePoints {
                is_warp: top_is_end.wide,
                thread: next,
                line: next_line,
                cell: on_top.line,
                fraction: on_top.offset,
            });
            let (near, far) = (top.slit::<T>(step), beyond.slit::<T>(-step));
            let length = (near + far).max(u.of(f64::MIN_POSITIVE));
            let start = (-far).or(step.lt(u.of(0.0)), -near + 1.0);
            let inv_length = u.of(1.0) / length;
            let along = (aside - start) * inv_length;
            extents = Extents { is_straight: all, inv_length, along }.or(is_between, extents);
        }
        let strand = Strands {
            is_end,
            across: across_end.or(is_end.wide, across_pick),
            size: of_end.or(is_end.wide, of_pick).size,
        };
        let is_hit = end_is_hit.narrow() | pick_is_hit.narrow();
        self.pieces(is_back, position, strand, extents, is_hit)
    }

    /// How far the threads reach, through the cells of `position`, that are on top at the crossings `on`; ends where
    /// `is_end` holds.
    #[inline(always)]
    fn extents<S: Simd, T: LaneSizes>(
        &self,
        is_end: Ends<S>,
        on: Crossings<S>,
        position: &Positions<S>,
        sizes: &T,
    ) -> Extents<S> {
        let Crossings { index, thread, line, offset, bits } = on;
        // An end runs along axis 1, whose bytes are the upper ones.
        let runs = is_end.mask.select(bits >> 16, bits);
        let (mut before, mut after) = (runs >> 1 & 0x7f, runs >> 9 & 0x7f);
        let is_endless = before.simd_eq(u32::from(ENDLESS));
        let is_far = before.simd_eq(u32::from(FAR)) | after.simd_eq(u32::from(FAR));
        if is_far.any_true() {
            (before, after) = self.long_runs(is_end.mask, index, [before, after]);
        }
        if self.has_uncovered {
            // On an endless thread there is nothing beyond.
            let none = u32x16::splat(bits.token(), 0);
            before = is_endless.select(none, before);
            after = is_endless.select(none, after);
        }
        let (mut from_start, mut length) =
            (Wide::from_u32(before) + offset, Wide::from_u32(before + after + 1));
        if !T::ARE_TOUCHING {
            let crossed = WideMask::of(!is_end.mask);
            let (before, after) = (Wide::from_u32(before), Wide::from_u32(after));
            let [end_line, pick_line] = position.cell;
            // The threads that cover this one, in the middle of their crossings with it.
            let cell = end_line.or(is_end.wide, pick_line);
            let (to_start, to_end) = (-before - 1.0, after + 1.0);
            let at_start = sizes.at(&LanePoints {
                is_warp: crossed,
                thread: self.shifted(crossed, thread, to_start),
                line: line + to_start,
                cell,
                fraction: cell.of(0.5),
            });
            let at_end = sizes.at(&LanePoints {
                is_warp: crossed,
                thread: self.shifted(crossed, thread, to_end),
                line: line + to_end,
                cell,
                fraction: cell.of(0.5),
            });
            let start = at_start.slit::<T>(cell.of(1.0));
            length = length + start + at_end.slit::<T>(cell.of(-1.0));
            from_start = from_start + start;
        }
        if self.has_uncovered {
            let is_endless = WideMask::of(is_endless);
            let count = self.counts(WideMask::of(!is_end.mask), offset);
            length = count.or(is_endless, length);
            from_start = (thread + offset).or(is_endless, from_start);
        }
        let inv_length = offset.of(1.0) / length;
        Extents { is_straight: is_endless, inv_length, along: from_start * inv_length }
    }

    /// [`Weave::run`] where it is far.
    #[cold]
    fn long_runs<S: Simd>(
        &self,
        is_end: mask32x16<S>,
        index: Wide<S>,
        runs: [u32x16<S>; 2],
    ) -> (u32x16<S>, u32x16<S>) {
        let index: [u32; LANES] = index.to_u32().into();
        let [mut before, mut after] = runs;
        for (lane, index) in index.into_iter().enumerate() {
            let axis = usize::from(is_end.test(lane));
            if let Some([to_start, to_end]) = self.run(index as usize, axis) {
                (before[lane], after[lane]) = (to_start, to_end);
            }
        }
        (before, after)
    }

    /// The pieces that the positions hit.
    #[inline(always)]
    fn pieces<S: Simd>(
        &self,
        is_back: mask32x16<S>,
        position: &Positions<S>,
        strand: Strands<S>,
        extents: Extents<S>,
        is_hit: mask32x16<S>,
    ) -> Segments<S> {
        let Strands { is_end, across, size } = strand;
        let Extents { is_straight, inv_length, along } = extents;
        let x = across / size;
        let y = (along * 2.0 - 1.0).max(along.of(-1.0)).min(along.of(1.0));
        let [end, pick] = position.thread;
        Segments {
            is_hit,
            is_warp: is_end.mask,
            is_straight,
            thread: end.or(is_end.wide, pick).to_u32(),
            x,
            y,
            is_mirrored: [is_back | !is_end.mask, is_back & !is_end.mask],
            inv_length,
            width: size,
        }
    }

    /// The thread `steps` after `thread`, within one period of it, among ends where `is_end` holds.
    #[inline(always)]
    fn shifted<S: Simd>(&self, is_end: WideMask<S>, thread: Wide<S>, steps: Wide<S>) -> Wide<S> {
        let count = self.counts(is_end, thread);
        let shifted = thread + steps;
        let shifted = (shifted + count).or(shifted.lt(thread.of(0.0)), shifted);
        (shifted - count).or(count.le(shifted), shifted)
    }

    /// How many ends there are where `are_ends` holds, and how many picks where not.
    #[inline(always)]
    fn counts<S: Simd>(&self, are_ends: WideMask<S>, like: Wide<S>) -> Wide<S> {
        let [ends, picks] = self.periods.map(|period| f64::from(period.count()));
        like.of(ends).or(are_ends, like.of(picks))
    }

    /// The bytes of the crossings at `index`, the first as the lowest.
    #[inline(always)]
    fn bits<S: Simd>(&self, index: Wide<S>) -> u32x16<S> {
        let index = index.to_u32();
        let at: [u32; LANES] = index.into();
        u32x16::from_fn(index.token(), |lane| {
            let [[a, b], [c, d]] = self.crossings[at[lane] as usize].runs;
            u32::from_le_bytes([a, b, c, d])
        })
    }
}

impl<S: Simd> Extents<S> {
    /// These where `mask` holds, else `other`.
    #[inline(always)]
    fn or(self, mask: mask32x16<S>, other: Self) -> Self {
        let wide = WideMask::of(mask);
        Self {
            is_straight: mask.select(self.is_straight, other.is_straight),
            inv_length: self.inv_length.or(wide, other.inv_length),
            along: self.along.or(wide, other.along),
        }
    }
}

/// Whether the pick is on top of crossings with these `bits`.
#[inline(always)]
fn pick_is_top<S: Simd>(bits: u32x16<S>) -> mask32x16<S> {
    (bits & 1).simd_eq(1)
}

/// The largest integers up to `x`, and the rests in [0, 1).
#[inline(always)]
pub(crate) fn split_lanes<S: Simd>(x: Wide<S>) -> (Wide<S>, Wide<S>) {
    let floor = x.floor();
    (floor, (x - floor).min(x.of(1.0 - 0.5 * f64::EPSILON)))
}
