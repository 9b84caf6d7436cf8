//! From a draft to the grid of crossings: which thread lies on top.

use std::fmt;

use crate::color::Rgb8;
use crate::draft::{Draft, Plan, Side, Thread};
use crate::limits;
use crate::sparse::Lists;

/// Why a draft has no drawdown.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum DrawdownError {
    /// It has no ends or no picks.
    NoThreads,
    /// It does not say on which shafts the ends are.
    NoThreading,
    /// It has neither a lift plan nor a tie-up with a treadling.
    NoPlan,
    /// The grid, or what is known of its threads, would take more memory than allowed.
    TooLarge {
        /// Bytes the larger of the two would take.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
}

impl fmt::Display for DrawdownError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoThreads => {
                f.write_str("draft: no ends or no picks, expected at least one each")
            }
            Self::NoThreading => {
                f.write_str("draft: no threading, expected the shafts of each end")
            }
            Self::NoPlan => {
                f.write_str("draft: no plan, expected a lift plan or a tie-up with a treadling")
            }
            Self::TooLarge { bytes, limit } => {
                write!(f, "drawdown: takes {bytes} bytes, expected at most {limit}")
            }
        }
    }
}

impl std::error::Error for DrawdownError {}

/// How to compute a drawdown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DrawdownOptions {
    /// The plan to prefer where the draft has two; by default the lift plan, as [`Draft::plan`]
    /// does.
    pub plan: Option<Plan>,
    /// Most bytes the grid may take, and the list of its threads; by default
    /// [`limits::DRAWDOWN_BYTES`].
    pub max_bytes: u64,
}

impl Default for DrawdownOptions {
    fn default() -> Self {
        Self { plan: None, max_bytes: limits::DRAWDOWN_BYTES }
    }
}

/// The grid of crossings of a cloth, with its threads.
///
/// End 0 and pick 0 are those the file calls number 1. The format does not say on which side
/// end 1 is, nor whether pick 1 is at the top or the bottom; nor does this type.
///
/// One bit per crossing, in rows of one pick each.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawdown {
    pub(crate) grid: Grid,
    pub(crate) ends: Vec<Thread>,
    pub(crate) picks: Vec<Thread>,
}

impl Draft {
    /// The drawdown by the plan that weaves: see [`Draft::plan`].
    ///
    /// An end is on top where one of its shafts is raised. An end on no shaft never is. On a
    /// sinking shed the raised shafts are those not listed.
    ///
    /// Takes time in proportion to the crossings, and to the shafts listed for each pick.
    ///
    /// # Errors
    ///
    /// If the draft lacks what it takes, or the grid takes more than [`limits::DRAWDOWN_BYTES`].
    pub fn drawdown(&self) -> Result<Drawdown, DrawdownError> {
        self.drawdown_with(&DrawdownOptions::default())
    }

    /// As [`Draft::drawdown`], with another plan preferred or another bound on memory.
    ///
    /// # Errors
    ///
    /// If the draft lacks what it takes, or the grid takes more than `options.max_bytes`.
    pub fn drawdown_with(&self, options: &DrawdownOptions) -> Result<Drawdown, DrawdownError> {
        let (ends, picks) = (self.warp.count, self.weft.count);
        if ends == 0 || picks == 0 {
            return Err(DrawdownError::NoThreads);
        }
        if self.threading.is_empty() {
            return Err(DrawdownError::NoThreading);
        }
        let preferred = options.plan.filter(|&plan| self.has(plan));
        let plan = preferred.or_else(|| self.plan()).ok_or(DrawdownError::NoPlan)?;
        let threads = (u64::from(ends) + u64::from(picks)) * size_of::<Thread>() as u64;
        let bytes = Grid::bytes(ends, picks).max(threads);
        if bytes > options.max_bytes {
            return Err(DrawdownError::TooLarge { bytes, limit: options.max_bytes });
        }
        Ok(Drawdown {
            grid: self.weave(plan),
            ends: (0..ends).map(|end| self.thread(Side::Warp, end)).collect(),
            picks: (0..picks).map(|pick| self.thread(Side::Weft, pick)).collect(),
        })
    }

    fn weave(&self, plan: Plan) -> Grid {
        let harness = Harness::new(&self.threading, self.warp.count);
        let mut grid = Grid::new(self.warp.count as usize, self.weft.count as usize);
        let mut listed = vec![false; harness.shafts.len()];
        for pick in 0..self.weft.count {
            let lists = match plan {
                Plan::LiftPlan => &[pick],
                Plan::TieUp => self.treadling.get(pick),
            };
            let table = if plan == Plan::LiftPlan { &self.liftplan } else { &self.tieup };
            listed.fill(false);
            for shaft in lists.iter().flat_map(|&list| table.get(list)) {
                if let Some(at) = harness.position(*shaft) {
                    listed[at] = true;
                }
            }
            let row = grid.row_mut(pick as usize);
            for (shaft, &listed) in harness.shafts.iter().zip(&listed) {
                if listed == self.rising_shed {
                    shaft.raise(row);
                }
            }
        }
        grid
    }
}

/// The ends on each shaft that has some.
struct Harness {
    /// Which shafts these are, in ascending order: memory grows with them, not with their numbers.
    numbers: Vec<u32>,
    shafts: Vec<Shaft>,
}

enum Shaft {
    /// A bit per end.
    Mask(Vec<u64>),
    /// The ends one by one, where they are fewer than the words of a mask.
    Ends(Vec<u32>),
}

impl Harness {
    fn new(threading: &Lists, ends: u32) -> Self {
        let words = (ends as usize).div_ceil(64);
        let threaded = || threading.iter().filter(|&(end, _)| end < ends);
        let mut numbers: Vec<u32> = threaded().flat_map(|(_, shafts)| shafts).copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        let mut by_shaft = vec![Vec::new(); numbers.len()];
        for (end, shafts) in threaded() {
            for at in shafts.iter().filter_map(|&shaft| position(&numbers, shaft)) {
                by_shaft[at].push(end);
            }
        }
        let shafts = by_shaft.into_iter().map(|ends: Vec<u32>| {
            if ends.len() < words {
                return Shaft::Ends(ends);
            }
            let mut mask = vec![0; words];
            for end in ends {
                set_bit(&mut mask, end as usize);
            }
            Shaft::Mask(mask)
        });
        Self { shafts: shafts.collect(), numbers }
    }

    fn position(&self, shaft: u32) -> Option<usize> {
        position(&self.numbers, shaft)
    }
}

/// Where `shaft` stands among `numbers`, which ascend.
fn position(numbers: &[u32], shaft: u32) -> Option<usize> {
    // Without gaps, the usual case, a shaft is found without a search.
    match numbers.get(shaft as usize) {
        Some(&number) if number == shaft => Some(shaft as usize),
        _ => numbers.binary_search(&shaft).ok(),
    }
}

impl Shaft {
    fn raise(&self, row: &mut [u64]) {
        match self {
            Self::Mask(mask) => row.iter_mut().zip(mask).for_each(|(word, mask)| *word |= mask),
            Self::Ends(ends) => ends.iter().for_each(|&end| set_bit(row, end as usize)),
        }
    }
}

fn set_bit(row: &mut [u64], at: usize) {
    row[at / 64] |= 1 << (at % 64);
}

impl Drawdown {
    /// Number of ends.
    pub fn ends(&self) -> usize {
        self.ends.len()
    }

    /// Number of picks.
    pub fn picks(&self) -> usize {
        self.picks.len()
    }

    /// Whether the end lies over the pick where they cross, seen from the face of the cloth.
    ///
    /// # Panics
    ///
    /// If there is no such end or pick.
    pub fn warp_on_top(&self, end: usize, pick: usize) -> bool {
        assert!(
            end < self.ends() && pick < self.picks(),
            "no crossing of end {end} and pick {pick}"
        );
        self.grid.get(end, pick)
    }

    /// The crossings of one pick, 64 to a word: bit `end % 64` of word `end / 64` is 1 where the
    /// end is on top; the bits past the last end are 0.
    ///
    /// # Panics
    ///
    /// If there is no such pick.
    pub fn row(&self, pick: usize) -> &[u64] {
        self.grid.row(pick)
    }

    /// An end.
    ///
    /// # Panics
    ///
    /// If there is no such end.
    pub fn end(&self, end: usize) -> &Thread {
        &self.ends[end]
    }

    /// A pick.
    ///
    /// # Panics
    ///
    /// If there is no such pick.
    pub fn pick(&self, pick: usize) -> &Thread {
        &self.picks[pick]
    }

    /// Colour of an end.
    ///
    /// # Panics
    ///
    /// If there is no such end.
    pub fn end_color(&self, end: usize) -> Rgb8 {
        self.end(end).color
    }

    /// Colour of a pick.
    ///
    /// # Panics
    ///
    /// If there is no such pick.
    pub fn pick_color(&self, pick: usize) -> Rgb8 {
        self.pick(pick).color
    }

    /// Number of the colour of an end as in the file, if it has one.
    ///
    /// # Panics
    ///
    /// If there is no such end.
    pub fn end_color_number(&self, end: usize) -> Option<u32> {
        self.end(end).color_number
    }

    /// Number of the colour of a pick as in the file, if it has one.
    ///
    /// # Panics
    ///
    /// If there is no such pick.
    pub fn pick_color_number(&self, pick: usize) -> Option<u32> {
        self.pick(pick).color_number
    }

    /// Space an end takes from its centre to that of the next, in metres, if the file says.
    ///
    /// # Panics
    ///
    /// If there is no such end.
    pub fn end_pitch(&self, end: usize) -> Option<f64> {
        self.end(end).pitch
    }

    /// Space a pick takes from its centre to that of the next, in metres, if the file says.
    ///
    /// # Panics
    ///
    /// If there is no such pick.
    pub fn pick_pitch(&self, pick: usize) -> Option<f64> {
        self.pick(pick).pitch
    }

    /// Diameter of the yarn of an end in metres, if the file says.
    ///
    /// # Panics
    ///
    /// If there is no such end.
    pub fn end_diameter(&self, end: usize) -> Option<f64> {
        self.end(end).diameter
    }

    /// Diameter of the yarn of a pick in metres, if the file says.
    ///
    /// # Panics
    ///
    /// If there is no such pick.
    pub fn pick_diameter(&self, pick: usize) -> Option<f64> {
        self.pick(pick).diameter
    }

    /// The other face: the cloth turned over like a page, so that the last end comes first and
    /// the picks keep their order. What was on top is below.
    #[must_use]
    pub fn back(&self) -> Self {
        let mut grid = Grid::new(self.ends(), self.picks());
        for pick in 0..self.picks() {
            let row = grid.row_mut(pick);
            for (back, front) in (0..self.ends.len()).rev().enumerate() {
                if !self.grid.get(front, pick) {
                    set_bit(row, back);
                }
            }
        }
        let ends = self.ends.iter().rev().copied().collect();
        Self { grid, ends, picks: self.picks.clone() }
    }
}

/// Bits in rows, each row of whole words; the bits past the width are 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Grid {
    words: usize,
    bits: Vec<u64>,
}

impl Grid {
    /// Bytes that a grid takes.
    fn bytes(width: u32, height: u32) -> u64 {
        u64::from(width).div_ceil(64) * 8 * u64::from(height)
    }

    pub(crate) fn new(width: usize, height: usize) -> Self {
        let words = width.div_ceil(64);
        Self { words, bits: vec![0; words * height] }
    }

    pub(crate) fn height(&self) -> usize {
        self.bits.len() / self.words
    }

    pub(crate) fn get(&self, x: usize, y: usize) -> bool {
        self.row(y)[x / 64] >> (x % 64) & 1 == 1
    }

    pub(crate) fn row(&self, y: usize) -> &[u64] {
        &self.bits[y * self.words..][..self.words]
    }

    pub(crate) fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.bits[y * self.words..][..self.words]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_cloth_of_too_many_threads_is_refused() {
        let mut draft = Draft::new(u32::MAX / 2, 1);
        draft.threading.set(0, &[0]);
        draft.liftplan.set(0, &[0]);
        let error = draft.drawdown().unwrap_err();
        assert!(
            matches!(error, DrawdownError::TooLarge { bytes, .. } if bytes > 1 << 32),
            "{error}"
        );
    }

    #[test]
    fn shafts_with_large_numbers_take_no_memory() {
        let mut draft = Draft::new(2, 3);
        draft.threading.set(0, &[u32::MAX, 7]);
        draft.threading.set(1, &[7]);
        draft.liftplan.set(0, &[7]);
        draft.liftplan.set(1, &[u32::MAX, 3]);
        let cloth = draft.drawdown().unwrap();
        let rows: Vec<u64> = (0..3).map(|pick| cloth.row(pick)[0]).collect();
        assert_eq!(rows, [0b11, 0b01, 0]);
    }
}
