//! Properties of the segments of any weave, with threads of any size.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use proptest::prelude::*;
use selvedge_yarn_brdf::glam::DVec2;
use selvedge_yarn_brdf::{
    Local, Position, Segment, SegmentKind, Side, Sizes, ThreadPoint, ThreadSizes, Touching, Weave,
};

/// Rounding in x and y: quotients of sums of numbers below 100.
const ROUNDING: f64 = 1e-12;

#[derive(Clone, Debug)]
struct Grid {
    ends: u32,
    picks: u32,
    warp_on_top: Vec<bool>,
}

impl Grid {
    fn weave(&self) -> Weave {
        Weave::new(self.ends, self.picks, |end, pick| self.warp_on_top(end, pick)).unwrap()
    }

    fn warp_on_top(&self, end: u32, pick: u32) -> bool {
        self.warp_on_top[(pick * self.ends + end) as usize]
    }

    /// The grid as seen from behind, as a face.
    fn turned(&self) -> Weave {
        Weave::new(self.ends, self.picks, |end, pick| !self.warp_on_top(self.ends - 1 - end, pick))
            .unwrap()
    }
}

fn grid() -> impl Strategy<Value = Grid> {
    (1..12_u32, 1..12_u32, 0.0..1.0).prop_flat_map(|(ends, picks, share)| {
        let crossings = prop::collection::vec(prop::bool::weighted(share), (ends * picks) as usize);
        crossings.prop_map(move |warp_on_top| Grid { ends, picks, warp_on_top })
    })
}

fn side() -> impl Strategy<Value = Side> {
    prop_oneof![Just(Side::Face), Just(Side::Back)]
}

fn cell() -> impl Strategy<Value = [i64; 2]> {
    [-40..40_i64, -40..40_i64]
}

/// The place in a cell: multiples of 2⁻³⁰ other than 0, so that it can be mirrored exactly.
fn fraction() -> impl Strategy<Value = [f64; 2]> {
    let step = 1..(1 << 30_i32);
    [step.clone(), step].prop_map(|steps| steps.map(|step| f64::from(step) / f64::from(1 << 30)))
}

fn position() -> impl Strategy<Value = Position> {
    (cell(), fraction()).prop_map(|(cell, fraction)| Position { cell, fraction })
}

fn thread_sizes() -> impl Strategy<Value = ThreadSizes> {
    let size = prop_oneof![Just(1.0), 0.05..1.0];
    let sizes = prop::collection::vec(size, 12);
    (sizes.clone(), sizes).prop_map(|(ends, picks)| ThreadSizes::new(ends, picks))
}

/// Sizes and offsets that vary smoothly along each thread.
#[derive(Clone, Copy, Debug)]
struct Wavy {
    /// Size where it is greatest.
    thickest: f64,
    /// Share of it that is lost where it is least.
    depth: f64,
    /// Radians per cell.
    frequency: f64,
    /// Share of the room for an offset that is used.
    swing: f64,
}

impl Sizes for Wavy {
    fn at(&self, point: ThreadPoint) -> Local {
        let turn = if point.is_warp { 0.3 } else { 1.9 } + 2.4 * point.line as f64;
        let phase = turn + self.frequency * (point.cell as f64 + point.fraction);
        let size = self.thickest * (1.0 - self.depth * (0.5 + 0.5 * phase.sin()));
        Local { size, offset: 0.5 * (1.0 - size) * self.swing * (1.7 * phase).cos() }
    }
}

fn wavy() -> impl Strategy<Value = Wavy> {
    (0.1..=1.0, 0.0..0.8, 0.0..2.0, 0.0..=1.0)
        .prop_map(|(thickest, depth, frequency, swing)| Wavy { thickest, depth, frequency, swing })
}

/// Checks that each point is numbered alike within the repeat and over all repeats.
struct Checked<S> {
    sizes: S,
    ends: u32,
    picks: u32,
}

impl<S: Sizes> Sizes for Checked<S> {
    fn at(&self, point: ThreadPoint) -> Local {
        let count = if point.is_warp { self.ends } else { self.picks };
        let wrapped = point.line.rem_euclid(count.into());
        assert_eq!(i64::from(point.thread), wrapped, "{point:?}");
        assert!((0.0..1.0).contains(&point.fraction), "{point:?}");
        self.sizes.at(point)
    }
}

/// The sizes as seen from behind, as a face.
struct Turned<S> {
    sizes: S,
    ends: u32,
}

impl<S: Sizes> Sizes for Turned<S> {
    fn at(&self, point: ThreadPoint) -> Local {
        if point.is_warp {
            let (thread, line) = (self.ends - 1 - point.thread, -1 - point.line);
            let local = self.sizes.at(ThreadPoint { thread, line, ..point });
            Local { offset: -local.offset, ..local }
        } else {
            let (cell, fraction) = (-1 - point.cell, 1.0 - point.fraction);
            self.sizes.at(ThreadPoint { cell, fraction, ..point })
        }
    }
}

/// The segment of the back, numbered as on the face, from that of the turned face.
fn turned_back(segment: Segment, ends: u32) -> Segment {
    if segment.is_warp {
        Segment { thread: ends - 1 - segment.thread, line: -1 - segment.line, ..segment }
    } else {
        let last = segment.first + i64::from(segment.crossings.max(1)) - 1;
        Segment { first: -1 - last, ..segment }
    }
}

/// Whether the thread of `segment` is seen at the crossing `cell` cells along it.
fn is_seen(weave: &Weave, side: Side, segment: &Segment, cell: i64) -> bool {
    let (end, pick) = if segment.is_warp { (segment.line, cell) } else { (cell, segment.line) };
    weave.warp_on_top(end, pick) == (segment.is_warp == (side == Side::Face))
}

/// Whether the two points lie on one piece; pieces in slits are of the cell and the slit's side.
fn are_one_piece(a: &Segment, b: &Segment) -> bool {
    (a.is_warp, a.line, a.first) == (b.is_warp, b.line, b.first)
        && a.is_straight() == b.is_straight()
        && a.kind != SegmentKind::Between
}

fn check_range(weave: &Weave, side: Side, position: Position, sizes: &impl Sizes) {
    let Some(segment) = weave.segment_at(side, position, sizes) else { return };
    assert!(segment.x.abs() <= 1.0 && segment.y.abs() <= 1.0, "{segment:?}");
    assert!(segment.width > 0.0 && segment.width <= 1.0, "{segment:?}");
    assert!(segment.length > 0.0 && segment.length.is_finite(), "{segment:?}");
    assert!(f64::from(segment.crossings) <= segment.length, "{segment:?}");
}

proptest! {
    #[test]
    fn coordinates_stay_within_the_segment(
        grid in grid(),
        side in side(),
        position in position(),
        constant in thread_sizes(),
        wavy in wavy(),
    ) {
        let weave = grid.weave();
        check_range(&weave, side, position, &Touching);
        check_range(&weave, side, position, &constant);
        check_range(&weave, side, position, &wavy);
    }

    #[test]
    fn touching_threads_are_those_of_size_one(
        grid in grid(),
        side in side(),
        position in position(),
    ) {
        let ones = || vec![1.0; 12];
        let weave = grid.weave();
        let touching = weave.segment_at(side, position, &Touching);
        prop_assert!(touching.is_some());
        prop_assert_eq!(touching, weave.segment_at(side, position, &ThreadSizes::new(ones(), ones())));
    }

    #[test]
    fn position_that_misses_both_threads_is_a_gap(
        grid in grid(),
        side in side(),
        position in position(),
        sizes in wavy(),
    ) {
        let hits = [0, 1].map(|axis| {
            let local = sizes.at(ThreadPoint {
                is_warp: axis == 0,
                thread: 0,
                line: position.cell[axis],
                cell: position.cell[1 - axis],
                fraction: position.fraction[1 - axis],
            });
            (position.fraction[axis] - 0.5 - local.offset).abs() <= 0.5 * local.size
        });
        let found = grid.weave().segment_at(side, position, &sizes);
        prop_assert_eq!(found.is_some(), hits[0] || hits[1]);
    }

    #[test]
    fn segments_repeat_with_the_tile_at_any_distance(
        grid in grid(),
        side in side(),
        position in position(),
        sizes in thread_sizes(),
        tiles in [-1_000_000_000..1_000_000_000_i64, -1_000_000_000..1_000_000_000_i64],
    ) {
        let shift = [tiles[0] * i64::from(grid.ends), tiles[1] * i64::from(grid.picks)];
        let cell = [position.cell[0] + shift[0], position.cell[1] + shift[1]];
        let weave = grid.weave();
        let here = weave.segment_at(side, position, &sizes);
        let there = weave.segment_at(side, Position { cell, ..position }, &sizes);
        let moved = here.map(|segment| {
            let axis = usize::from(!segment.is_warp);
            let (line, first) = (segment.line + shift[axis], segment.first + shift[1 - axis]);
            Segment { line, first, ..segment }
        });
        prop_assert_eq!(there, moved);
    }

    #[test]
    fn segment_is_on_top_of_its_crossings_and_of_no_more(
        grid in grid(),
        side in side(),
        position in position(),
        sizes in wavy(),
    ) {
        let weave = grid.weave();
        let sizes = Checked { sizes, ends: grid.ends, picks: grid.picks };
        let found = weave.segment_at(side, position, &sizes);
        let Some(segment) = found else { return Ok(()) };
        let axis = usize::from(!segment.is_warp);
        let count = [grid.ends, grid.picks];
        prop_assert_eq!(segment.line, position.cell[axis]);
        let wrapped = segment.line.rem_euclid(count[axis].into());
        prop_assert_eq!(i64::from(segment.thread), wrapped);

        let cell = position.cell[1 - axis];
        let last = segment.first + i64::from(segment.crossings) - 1;
        let is_seen = |cell| is_seen(&weave, side, &segment, cell);
        let is_inside = (segment.first..=last).contains(&cell);
        prop_assert!((segment.first..=last).all(is_seen), "{segment:?}");
        match segment.kind {
            SegmentKind::Top => prop_assert!(is_inside, "{segment:?}"),
            SegmentKind::Extension => {
                prop_assert!(cell == segment.first - 1 || cell == last + 1, "{segment:?}");
            }
            SegmentKind::Between => {
                prop_assert!(segment.first == cell && segment.crossings == 0, "{segment:?}");
                prop_assert!(!is_seen(cell), "{segment:?}");
            }
            SegmentKind::Endless => {
                prop_assert!(is_inside && segment.crossings == count[1 - axis], "{segment:?}");
                prop_assert_eq!(segment.first.rem_euclid(count[1 - axis].into()), 0);
            }
        }
        if matches!(segment.kind, SegmentKind::Top | SegmentKind::Extension) {
            prop_assert!(!is_seen(segment.first - 1) && !is_seen(last + 1), "{segment:?}");
        }
    }

    #[test]
    fn y_runs_evenly_along_a_segment_of_one_length(
        grid in grid(),
        side in side(),
        from in position(),
        fraction in fraction(),
        step in 0..2_i64,
        sizes in thread_sizes(),
    ) {
        let weave = grid.weave();
        let Some(first) = weave.segment_at(side, from, &sizes) else { return Ok(()) };
        let axis = usize::from(first.is_warp);
        let mut to = Position { cell: from.cell, fraction };
        to.cell[axis] += step;
        let second = weave.segment_at(side, to, &sizes);
        let Some(second) = second.filter(|second| are_one_piece(&first, second)) else {
            return Ok(());
        };
        prop_assert_eq!(first.length, second.length);
        prop_assert_eq!(first.crossings, second.crossings);
        let sense = if side == Side::Back && !first.is_warp { -2.0 } else { 2.0 };
        let moved = step as f64 + to.fraction[axis] - from.fraction[axis];
        let turns = sense * moved / first.length - (second.y - first.y);
        // An endless thread begins anew with each repeat.
        let whole = if first.kind == SegmentKind::Endless { 2.0 * (turns / 2.0).round() } else { 0.0 };
        prop_assert!((turns - whole).abs() <= ROUNDING, "{first:?} {second:?} {moved}");
    }

    #[test]
    fn coordinates_are_continuous_on_a_segment(
        grid in grid(),
        side in side(),
        from in position(),
        step in [-1.0..1.0, -1.0..1.0],
        sizes in wavy(),
    ) {
        let step = DVec2::from(step) * 1e-6;
        let cells = DVec2::new(from.cell[0] as f64, from.cell[1] as f64) + DVec2::from(from.fraction);
        let weave = grid.weave();
        let a = weave.segment_at(side, Position::new(cells), &sizes);
        let b = weave.segment_at(side, Position::new(cells + step), &sizes);
        let (Some(a), Some(b)) = (a, b) else { return Ok(()) };
        if !are_one_piece(&a, &b) {
            return Ok(());
        }
        prop_assert_eq!(a.length, b.length);
        // x moves by 2/size per cell across and, the sizes being at least 0.02 and changing by less
        // than 4 per cell, by less than 400 per cell along; y by 2/length per cell.
        prop_assert!((a.x - b.x).abs() <= 500.0 * step.length() + ROUNDING, "{a:?} {b:?}");
        prop_assert!((a.y - b.y).abs() <= 2.0 * step.length() + ROUNDING, "{a:?} {b:?}");
    }

    #[test]
    fn back_is_the_face_of_the_turned_weave(
        grid in grid(),
        position in position(),
        constant in thread_sizes(),
        wavy in wavy(),
    ) {
        let (weave, turned, ends) = (grid.weave(), grid.turned(), grid.ends);
        let [end, pick] = position.cell;
        let [u, v] = position.fraction;
        let behind = Position { cell: [-1 - end, pick], fraction: [1.0 - u, v] };

        let back = weave.segment_at(Side::Back, position, &constant);
        let face = turned.segment_at(Side::Face, behind, &Turned { sizes: constant, ends });
        check_equal(back, face.map(|segment| turned_back(segment, ends)));

        let back = weave.segment_at(Side::Back, position, &wavy);
        let face = turned.segment_at(Side::Face, behind, &Turned { sizes: wavy, ends });
        check_equal(back, face.map(|segment| turned_back(segment, ends)));
    }

    #[test]
    fn position_is_a_cell_and_the_rest(u in -1e9..1e9, v in -1e-3..1e-3) {
        let Position { cell, fraction } = Position::new(DVec2::new(u, v));
        prop_assert_eq!(cell, [u.floor() as i64, v.floor() as i64]);
        prop_assert!(fraction.iter().all(|f| (0.0..1.0).contains(f)), "{fraction:?}");
        prop_assert_eq!(fraction[0], u - u.floor());
        prop_assert!((fraction[1] - (v - v.floor())).abs() <= f64::EPSILON);
    }
}

/// Equal up to rounding: seen from behind, distances are taken from the other edge of the cell.
fn check_equal(a: Option<Segment>, b: Option<Segment>) {
    let (Some(a), Some(b)) = (a, b) else {
        assert_eq!(a, b);
        return;
    };
    let is_near = |a: f64, b: f64| (a - b).abs() <= ROUNDING;
    let is_y_near = (a.y - b.y).abs() <= ROUNDING / a.length.min(1.0);
    assert!(is_near(a.x, b.x) && is_y_near, "{a:?} {b:?}");
    assert!(is_near(a.length, b.length) && is_near(a.width, b.width), "{a:?} {b:?}");
    let Segment { x, y, length, width, .. } = b;
    assert_eq!(Segment { x, y, length, width, ..a }, b);
}

#[test]
fn query_never_panics() {
    let weave = Weave::new(3, 5, |end, pick| (end + pick) % 3 == 0).unwrap();
    let sizes = ThreadSizes::new(vec![0.5; 3], vec![0.6]);
    let coordinates =
        [f64::NAN, f64::INFINITY, -f64::INFINITY, f64::MAX, -1e19, 1e19, -1e-300, 0.0, 4e15];
    let cells = [i64::MIN, i64::MIN + 1, i64::MAX, i64::MAX - 1, 1 << 31, -(1 << 31), 1 << 53];
    for side in [Side::Face, Side::Back] {
        for u in coordinates {
            for v in coordinates {
                let position = Position::new(DVec2::new(u, v));
                let is_in = position.fraction.iter().all(|f| (0.0..1.0).contains(f));
                assert!(is_in, "{u}, {v}: {position:?}");
                check_range(&weave, side, position, &sizes);
                check_range(&weave, side, position, &Touching);
            }
        }
        for end in cells {
            for pick in cells {
                for fraction in [[0.0, 0.99], [0.3, 0.1], [0.99, 0.01], [0.6, 0.5]] {
                    let position = Position { cell: [end, pick], fraction };
                    check_range(&weave, side, position, &sizes);
                }
            }
        }
    }
}
