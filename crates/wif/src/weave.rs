//! What kind of cloth a drawdown is: its repeat, its floats, its balance, its weave.

use std::collections::HashMap;
use std::fmt;
use std::hash::Hash;

use crate::draft::Side;
use crate::drawdown::{Drawdown, Grid};

/// The weave of a cloth, where it can be told from the repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Weave {
    /// Warp and weft alternate in both directions.
    Plain,
    /// Each pick is the one before, moved by one end; the repeat is square.
    Twill {
        /// Which way the diagonals run.
        hand: Hand,
        /// Ends, and picks, of the repeat; at least 3.
        repeat: usize,
    },
    /// Each pick has one point where the sides change places, moved by more than one end at a
    /// time so that no two touch; the repeat is square.
    Satin {
        /// The side that shows on the face.
        face: Side,
        /// Ends, and picks, of the repeat; at least 5.
        repeat: usize,
        /// By how many ends the point moves from pick to pick.
        step: usize,
    },
    /// None of these.
    Other,
}

/// Which way the diagonals of a twill run, with end 1 at the left and pick 1 at the bottom, or
/// with end 1 at the right and pick 1 at the top, which is the same turned by half a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Hand {
    /// From the lower right to the upper left, like the middle of the letter S.
    S,
    /// From the lower left to the upper right, like the middle of the letter Z.
    Z,
}

impl fmt::Display for Weave {
    /// `plain`, `twill Z of 4`, `satin of 8, step 3, warp face`, `other`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plain => f.write_str("plain"),
            Self::Twill { hand, repeat } => write!(f, "twill {hand:?} of {repeat}"),
            Self::Satin { face, repeat, step } => {
                let face = if *face == Side::Warp { "warp" } else { "weft" };
                write!(f, "satin of {repeat}, step {step}, {face} face")
            }
            Self::Other => f.write_str("other"),
        }
    }
}

impl Drawdown {
    /// The smallest repeat of the weave, in ends and picks.
    ///
    /// The least numbers e and p for which crossing (end, pick) is as (end + e, pick) and as
    /// (end, pick + p) wherever both are in the drawdown. It may end within a repeat. Colours
    /// and lengths do not count; see [`Drawdown::repeat_with_threads`].
    ///
    /// Takes time in proportion to the crossings, and as much memory as the drawdown.
    pub fn repeat(&self) -> (usize, usize) {
        let columns = self.grid.transposed(self.ends());
        let ends = period(&ids((0..self.ends()).map(|end| columns.row(end))));
        let picks = period(&ids((0..self.picks()).map(|pick| self.grid.row(pick))));
        (ends, picks)
    }

    /// As [`Drawdown::repeat`], counting the colours and lengths of the threads too.
    pub fn repeat_with_threads(&self) -> (usize, usize) {
        let columns = self.grid.transposed(self.ends());
        let end = |end: usize| (columns.row(end), self.end(end).key());
        let pick = |pick: usize| (self.grid.row(pick), self.pick(pick).key());
        (period(&ids((0..self.ends()).map(end))), period(&ids((0..self.picks()).map(pick))))
    }

    /// The part of crossings where the warp is on top, in [0, 1]; 0.5 is balanced.
    pub fn balance(&self) -> f64 {
        let rows = (0..self.picks()).flat_map(|pick| self.row(pick));
        let on_top: u64 = rows.map(|word| u64::from(word.count_ones())).sum();
        on_top as f64 / (self.ends() as f64 * self.picks() as f64)
    }

    /// The most crossings in a row that a thread of this side passes over, on the face. The
    /// floats of the back are those of the [`Drawdown::back`].
    pub fn longest_float(&self, side: Side) -> usize {
        match side {
            Side::Warp => {
                let columns = self.grid.transposed(self.ends());
                (0..self.ends()).map(|end| longest_run(columns.row(end), self.picks(), 0)).max()
            }
            Side::Weft => (0..self.picks())
                .map(|pick| longest_run(self.row(pick), self.ends(), u64::MAX))
                .max(),
        }
        .unwrap_or(0)
    }

    /// The weave, by the smallest repeat.
    pub fn weave(&self) -> Weave {
        let (width, height) = self.repeat();
        if width != height || width < 2 || width > self.ends() || height > self.picks() {
            return Weave::Other;
        }
        let repeat = width;
        let first: Vec<bool> = (0..repeat).map(|end| self.warp_on_top(end, 0)).collect();
        let moves_by = |step: usize| {
            (0..repeat).all(|pick| {
                let moved = |end| first[(end + (repeat - step) * pick) % repeat];
                (0..repeat).all(|end| self.warp_on_top(end, pick) == moved(end))
            })
        };
        let on_top = first.iter().filter(|&&on_top| on_top).count();
        let is_satin = repeat >= 5 && (on_top == 1 || on_top == repeat - 1);
        let face = if on_top == 1 { Side::Weft } else { Side::Warp };
        if repeat == 2 {
            return if on_top == 1 && moves_by(1) { Weave::Plain } else { Weave::Other };
        }
        if moves_by(1) {
            return Weave::Twill { hand: Hand::Z, repeat };
        }
        if moves_by(repeat - 1) {
            return Weave::Twill { hand: Hand::S, repeat };
        }
        let step = || (2..repeat - 1).find(|&step| moves_by(step));
        match is_satin.then(step).flatten() {
            Some(step) => Weave::Satin { face, repeat, step },
            None => Weave::Other,
        }
    }
}

/// A number for each value, the same for equal ones.
fn ids<T: Hash + Eq>(values: impl Iterator<Item = T>) -> Vec<usize> {
    let mut known = HashMap::new();
    values
        .map(|value| {
            let next = known.len();
            *known.entry(value).or_insert(next)
        })
        .collect()
}

/// The least p ≥ 1 with `values[i] == values[i + p]` for all i (Knuth, Morris & Pratt 1977,
/// section 3: the length less that of the longest border).
fn period(values: &[usize]) -> usize {
    let mut borders = vec![0; values.len()];
    for at in 1..values.len() {
        let mut border: usize = borders[at - 1];
        while border > 0 && values[at] != values[border] {
            border = borders[border - 1];
        }
        borders[at] = border + usize::from(values[at] == values[border]);
    }
    values.len() - borders.last().copied().unwrap_or(0)
}

/// The longest run of ones among the first `length` bits of `row`, each flipped by `flip`.
fn longest_run(row: &[u64], length: usize, flip: u64) -> usize {
    let (mut longest, mut run) = (0, 0);
    for (at, &word) in row.iter().enumerate() {
        let bits = (length - at * 64).min(64);
        let mut rest = (word ^ flip) & (u64::MAX >> (64 - bits));
        let mut left = bits;
        while left > 0 {
            let ones = (rest.trailing_ones() as usize).min(left);
            run += ones;
            longest = longest.max(run);
            left -= ones;
            if left == 0 {
                break;
            }
            rest = rest.checked_shr(ones as u32).unwrap_or(0);
            let zeros = (rest.trailing_zeros() as usize).min(left);
            rest = rest.checked_shr(zeros as u32).unwrap_or(0);
            left -= zeros;
            run = 0;
        }
    }
    longest
}

impl Grid {
    /// The grid of `width` columns with rows and columns exchanged.
    pub(crate) fn transposed(&self, width: usize) -> Self {
        let height = self.height();
        let mut transposed = Self::new(height, width);
        let mut block = [0; 64];
        for top in (0..height).step_by(64) {
            for word in 0..width.div_ceil(64) {
                let rows = 64.min(height - top);
                block.fill(0);
                for (y, bits) in block.iter_mut().enumerate().take(rows) {
                    *bits = self.row(top + y)[word];
                }
                transpose_block(&mut block);
                for (x, &bits) in block.iter().enumerate().take(64.min(width - word * 64)) {
                    transposed.row_mut(word * 64 + x)[top / 64] = bits;
                }
            }
        }
        transposed
    }
}

/// Exchanges rows and columns of 64 by 64 bits, bit x of word y being column x of row y, by
/// exchanging ever smaller quadrants (Warren 2013, section 7-3).
fn transpose_block(block: &mut [u64; 64]) {
    let (mut size, mut mask) = (32, 0x0000_0000_ffff_ffff_u64);
    while size > 0 {
        for low in (0..64).filter(|row| row & size == 0) {
            let high = low + size;
            let exchanged = (block[low] >> size ^ block[high]) & mask;
            block[high] ^= exchanged;
            block[low] ^= exchanged << size;
        }
        size /= 2;
        mask ^= mask << size;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Draft;
    use crate::sparse::Lists;

    /// A drawdown of this many ends and picks, from the first of which `rows` is repeated.
    fn cloth(rows: &[&str], ends: u32, picks: u32) -> Drawdown {
        let width = rows[0].len() as u32;
        let mut draft = Draft::new(ends, picks);
        draft.shafts = width;
        let straight: Vec<[u32; 1]> = (0..ends).map(|end| [end % width]).collect();
        draft.threading = (0..).zip(straight.iter().map(|shafts| &shafts[..])).collect();
        draft.liftplan = Lists::default();
        for pick in 0..picks {
            let row = rows[pick as usize % rows.len()].bytes();
            let lifted: Vec<u32> =
                (0..).zip(row).filter(|&(_, c)| c == b'1').map(|(i, _)| i).collect();
            draft.liftplan.set(pick, &lifted);
        }
        draft.drawdown().unwrap()
    }

    #[test]
    fn weaves_are_told_by_their_repeat() {
        let twill = Weave::Twill { hand: Hand::Z, repeat: 4 };
        assert_eq!(cloth(&["10", "01"], 2, 2).weave(), Weave::Plain);
        assert_eq!(cloth(&["10", "01"], 9, 7).weave(), Weave::Plain);
        assert_eq!(cloth(&["1100", "0110", "0011", "1001"], 4, 4).weave(), twill);
        assert_eq!(cloth(&["1100", "0110", "0011", "1001"], 131, 67).weave(), twill);
        let mirrored = cloth(&["1100", "1001", "0011", "0110"], 8, 8).weave();
        assert_eq!(mirrored, Weave::Twill { hand: Hand::S, repeat: 4 });
        let satin = ["10000", "00100", "00001", "01000", "00010"];
        let expected = Weave::Satin { face: Side::Weft, repeat: 5, step: 2 };
        assert_eq!(cloth(&satin, 10, 10).weave(), expected);
        assert_eq!(cloth(&["1100", "1100", "0011", "0011"], 8, 8).weave(), Weave::Other);
        assert_eq!(cloth(&["1"], 8, 8).weave(), Weave::Other);
    }

    #[test]
    fn the_repeat_may_be_cut() {
        assert_eq!(cloth(&["110", "011"], 100, 71).repeat(), (3, 2));
        assert_eq!(cloth(&["110", "011"], 4, 3).repeat(), (3, 2));
        assert_eq!(cloth(&["1"], 100, 100).repeat(), (1, 1));
    }

    #[test]
    fn the_repeat_with_threads_is_a_multiple() {
        let mut cloth = cloth(&["10", "01"], 12, 8);
        for end in (0..12).step_by(3) {
            cloth.ends[end].color = crate::Rgb8([1, 2, 3]);
        }
        assert_eq!((cloth.repeat(), cloth.repeat_with_threads()), ((2, 2), (6, 2)));
    }

    #[test]
    fn floats_cross_words() {
        let row = "1".repeat(70) + "0" + &"1".repeat(3);
        let cloth = cloth(&[&row, "0".repeat(74).as_str()], 74, 5);
        assert_eq!(cloth.longest_float(Side::Weft), 74);
        assert_eq!(cloth.longest_float(Side::Warp), 1);
        assert_eq!(longest_run(cloth.row(0), 74, 0), 70);
        assert!((cloth.balance() - 73.0 * 3.0 / (74.0 * 5.0)).abs() < 1e-12, "{}", cloth.balance());
    }

    #[test]
    fn the_back_is_the_face_turned_over() {
        let cloth = cloth(&["110", "100"], 5, 3);
        let back = cloth.back();
        for end in 0..5 {
            for pick in 0..3 {
                assert_eq!(
                    back.warp_on_top(4 - end, pick),
                    !cloth.warp_on_top(end, pick),
                    "{end} {pick}"
                );
            }
        }
        assert_eq!(back.back(), cloth);
    }

    #[test]
    fn transposing_exchanges_ends_and_picks() {
        let cloth = cloth(&["11010001", "0110101", "1000"], 130, 70);
        let columns = cloth.grid.transposed(130);
        for end in 0..130 {
            for pick in 0..70 {
                assert_eq!(columns.get(pick, end), cloth.warp_on_top(end, pick), "{end} {pick}");
            }
        }
    }

    #[test]
    fn periods_are_least() {
        assert_eq!(period(&[1, 2, 1, 2, 1]), 2);
        assert_eq!(period(&[1, 2, 3]), 3);
        assert_eq!(period(&[7, 7]), 1);
        assert_eq!(period(&[]), 0);
    }
}
