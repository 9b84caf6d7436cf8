//! What a reference implementation finds at random positions of random weaves on either side, up to
//! 10⁶ repeats away, against `Weave::segment_at`: the table `fixtures/brdf/segments.csv`, written by
//! `segments.py` beside it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use selvedge_yarn_brdf::glam::DVec2;
use selvedge_yarn_brdf::{Position, Segment, SegmentKind, Side, ThreadSizes, Touching, Weave};

/// Repeats that a position may be away, each way.
const REACH: u64 = 1_000_000;

/// Positions and sizes are multiples of 1/2048, so that both sides round only the quotients that
/// are x and y, each at most three times; the table has 13 digits of them.
const TOLERANCE: f64 = 1e-12;

/// Number `index` of the generator `SplitMix64` begun with `seed` (Steele, Lea & Flood 2014).
fn splitmix64(seed: u64, index: u64) -> u64 {
    let mut z = seed.wrapping_add((index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn draw(seed: u64, stream: u64, index: u64, below: u64) -> u64 {
    splitmix64(splitmix64(seed, stream), index) % below
}

/// A weave of the table with its yarns.
struct Cloth {
    seed: u64,
    side: Side,
    weave: Weave,
    /// Types of yarn of the ends and of the picks.
    types: [Vec<u64>; 2],
    sizes: ThreadSizes,
    is_touching: bool,
}

impl Cloth {
    /// The cloth of a row `weave,seed,side,ends,picks,share,types,thinnest`.
    fn parse(fields: &[&str]) -> Self {
        let number = |index: usize| fields[index].parse::<u64>().unwrap();
        let (seed, ends, picks) = (number(1), number(3), number(4));
        let (share, types, thinnest) = (number(5), number(6), number(7));
        let side = if fields[2] == "face" { Side::Face } else { Side::Back };
        let weave = Weave::new(ends as u32, picks as u32, |end, pick| {
            draw(seed, 0, u64::from(pick) * ends + u64::from(end), 256) < share
        });
        let types = [(1, ends), (2, picks)].map(|(stream, count)| -> Vec<u64> {
            (0..count).map(|thread| draw(seed, stream, thread, types)).collect()
        });
        let [end_sizes, pick_sizes] = types.each_ref().map(|types| -> Vec<f64> {
            let size = |&kind: &u64| 1024 - draw(seed, 3, kind, 1025 - thinnest);
            types.iter().map(|kind| size(kind) as f64 / 1024.0).collect()
        });
        Self {
            seed,
            side,
            weave: weave.unwrap(),
            types,
            sizes: ThreadSizes::new(end_sizes, pick_sizes),
            is_touching: thinnest == 1024,
        }
    }

    /// Position number `query`, in cells.
    fn position(&self, query: u64) -> DVec2 {
        let coordinate = |first: u64, count: u64| {
            let tile = draw(self.seed, 4, 4 * query + first, 2 * REACH + 1) as i64 - REACH as i64;
            let step = draw(self.seed, 4, 4 * query + first + 1, 1024 * count);
            (tile * count as i64) as f64 + (2 * step + 1) as f64 / 2048.0
        };
        DVec2::new(
            coordinate(0, self.weave.ends().into()),
            coordinate(2, self.weave.picks().into()),
        )
    }
}

/// The first field in which `found` differs from a row of the table.
fn difference(cloth: &Cloth, found: Option<Segment>, fields: &[&str]) -> Option<&'static str> {
    let Some(found) = found else {
        return (fields != ["g"]).then_some("a gap");
    };
    let kind = match fields[0] {
        "t" => SegmentKind::Top,
        "e" => SegmentKind::Extension,
        "b" => SegmentKind::Between,
        "n" => SegmentKind::Endless,
        _ => return Some("no gap"),
    };
    let number = |index: usize| fields[index].parse::<f64>().unwrap();
    let is_near = |index: usize, value: f64| (value - number(index)).abs() <= TOLERANCE;
    let types = &cloth.types[usize::from(!found.is_warp)];
    let checks = [
        ("kind", found.kind == kind),
        ("straightness", found.is_straight() == matches!(fields[0], "b" | "n")),
        ("direction", found.is_warp == (fields[1] == "1")),
        ("thread", f64::from(found.thread) == number(2)),
        ("type", types[found.thread as usize] as f64 == number(3)),
        ("length", found.length * 2048.0 == number(4)),
        ("width", found.width * 1024.0 == number(5)),
        ("x", is_near(6, found.x)),
        ("y", is_near(7, found.y)),
    ];
    checks.iter().find(|(_, is_equal)| !is_equal).map(|&(name, _)| name)
}

#[test]
fn segments_are_those_of_the_reference() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/brdf/segments.csv");
    let table = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let (mut cloth, mut query) = (None, 0);
    let mut rows = 0;
    for (index, line) in table.lines().enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        if fields[0] == "weave" {
            (cloth, query) = (Some(Cloth::parse(&fields)), 0);
            continue;
        }
        let cloth = cloth.as_ref().expect("the table begins with a weave");
        let cells = cloth.position(query);
        let position = Position::new(cells);
        let found = cloth.weave.segment_at(cloth.side, position, &cloth.sizes);
        let difference = difference(cloth, found, &fields);
        assert_eq!(difference, None, "line {}: {line}, at {cells}: {found:?}", index + 1);
        if cloth.is_touching {
            let touching = cloth.weave.segment_at(cloth.side, position, &Touching);
            assert_eq!(touching, found, "line {}, at {cells}", index + 1);
        }
        (query, rows) = (query + 1, rows + 1);
    }
    assert!(rows > 4000, "{rows} rows");
}
