//! Positions on the cloth, as exact at any distance as near the origin.

use glam::DVec2;

/// A position on the cloth: a cell and the place in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// End and pick, any integers: the weave repeats.
    pub cell: [i64; 2],
    /// Distance along u and v from the cell's corner, in cells, in [0, 1).
    pub fraction: [f64; 2],
}

impl Position {
    /// The position at (u, v) = `cells`, in cells.
    ///
    /// A coordinate that is not finite or beyond ±2⁵¹ gives some position, as good as any other.
    #[must_use]
    pub fn new(cells: DVec2) -> Self {
        let ((end, u), (pick, v)) = (split(cells.x), split(cells.y));
        Self { cell: [end, pick], fraction: [u, v] }
    }
}

/// The largest integer up to `x`, and the rest in [0, 1).
///
/// Not by `f64::floor`, which is a function call on processors without SSE 4.1, nor by a conversion,
/// which is several instructions where it has to saturate.
pub(crate) fn split(x: f64) -> (i64, f64) {
    /// Added to a number up to 2⁵¹, this leaves its nearest integer in the last bits. There are no
    /// fractions beyond.
    const ROUND: f64 = 1.5 / f64::EPSILON;
    let rounded = x + ROUND;
    // Without the sign of −0, which is in the cell 0.
    let rest = x - (rounded - ROUND) + 0.0;
    // As a number, not a condition: that would be a branch which half of all positions mispredict.
    let is_above = rest.to_bits() >> 63;
    let cell = rounded.to_bits().wrapping_sub(is_above).wrapping_sub(ROUND.to_bits());
    // A rest that was rounded up to 1 stays below it, as does that of a number out of range.
    let rest = rest + is_above as i32 as f64;
    (cell as i64, if (0.0..1.0).contains(&rest) { rest } else { 1.0 - 0.5 * f64::EPSILON })
}

/// A number of threads after which the weave repeats.
///
/// Divides by multiplying (Lemire, Kaser & Kurz 2019, *Faster remainder by direct computation*),
/// exact for 32-bit integers; a 64-bit division would take longer than the rest of a query.
#[derive(Clone, Copy, Debug)]
pub(super) struct Period {
    count: u32,
    /// 1 / `count`.
    inverse: f64,
    /// A multiple of `count` near 2³¹, which makes cells above −2³¹ positive.
    shift: i64,
    /// 2⁶⁴ / `count`, rounded up, modulo 2⁶⁴.
    reciprocal: u64,
}

impl Period {
    /// The period of `count` ≥ 1 threads.
    pub(super) fn new(count: u32) -> Self {
        let shift = (1 << 31) / i64::from(count) * i64::from(count);
        let reciprocal = (u64::MAX / u64::from(count)).wrapping_add(1);
        Self { count, inverse: 1.0 / f64::from(count), shift, reciprocal }
    }

    pub(super) fn count(self) -> u32 {
        self.count
    }

    /// 1 over the number of threads.
    pub(super) fn inverse(self) -> f64 {
        self.inverse
    }

    /// `cell` modulo the period.
    pub(super) fn wrap(self, cell: i64) -> u32 {
        let Ok(shifted) = u32::try_from(cell.wrapping_add(self.shift)) else {
            return cell.rem_euclid(self.count.into()) as u32;
        };
        let fraction = self.reciprocal.wrapping_mul(shifted.into());
        ((u128::from(fraction) * u128::from(self.count)) >> 64) as u32
    }

    /// The thread `steps` after `thread`, within one period of it.
    pub(super) fn shift(self, thread: u32, steps: i64) -> u32 {
        let (count, shifted) = (i64::from(self.count), i64::from(thread) + steps);
        let wrapped = if shifted < 0 {
            shifted + count
        } else if shifted >= count {
            shifted - count
        } else {
            shifted
        };
        wrapped as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn period_wraps_every_cell() {
        let edges = [0, 1 << 31, -(1 << 31), 1 << 32, 1 << 53, i64::MAX, i64::MIN];
        for count in [1, 2, 3, 7, 64, 299, 65_537, (1 << 28) - 1, 1 << 28, u32::MAX] {
            let period = Period::new(count);
            for edge in edges {
                for step in [-1_000_003, -2, -1, 0, 1, 2, 299, 1_000_003] {
                    let cell = i64::wrapping_add(edge, step);
                    let expected = cell.rem_euclid(count.into());
                    assert_eq!(i64::from(period.wrap(cell)), expected, "{cell} modulo {count}");
                }
            }
        }
    }

    #[test]
    fn position_just_below_a_cell_is_not_in_the_next() {
        let position = Position::new(DVec2::new(-1e-20, 3.0));
        assert_eq!(position.cell, [-1, 3]);
        assert!(position.fraction[0] < 1.0, "{position:?}");
        assert_eq!(position.fraction[1], 0.0);
    }
}
