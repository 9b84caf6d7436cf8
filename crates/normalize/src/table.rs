//! The directional albedo as a table over direction, with its error.
//!
//! A layered material gives the layer below what the layer above leaves, `1 − E(w)`, for two
//! directions at every evaluation (Kelemen & Szirmay-Kalos 2001). That needs the
//! directional albedo E as a quick lookup, and its mean; this table is both for any function.

use core::{f64::consts::TAU, num::NonZeroU32};

use glam::{DVec2, DVec3};

use crate::{
    albedo::{AlbedoError, Scattering, averaged, directional},
    estimate::{Estimate, Sampling},
    scale::SMALLEST_COS_THETA,
};

/// Rows of the coarsest grid; a table is finer by one step at least.
const COARSEST: u32 = 4;

/// The most rows: 8 MB of values.
const FINEST: u32 = 512;

/// Columns per row, so that the cells half-way down are about square.
const COLUMNS_PER_ROW: u32 = 4;

/// The most that a bend of the albedo may be off after a halving, over what the halving corrected.
///
/// At the share s of the way from an old node to the next, which is less than half, a bend by one is left off by 2s (½ − s)
/// and was off by s/2 at the new node: at most twice as much. Where the albedo also curves, that may hide a part of the bend
/// from the node: of 20 000 bends of |cos θ − z|, on 8 to 32 rows, the worst is left off by 2.63 times the correction.
const BEND: f64 = 3.0;

/// When to stop refining an [`AlbedoTable`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Stop as soon as the error of the table is at most this; 0 or NaN goes on to `at_most`.
    pub tolerance: f64,
    /// The most rows from the normal to the horizon, rounded down to a power of two from 8 to 512.
    /// n rows have 4n² + 1 directions.
    pub at_most: NonZeroU32,
}

impl Default for Resolution {
    /// An absolute error of 10⁻², with at most 32 rows: 4097 directions.
    fn default() -> Self {
        Self { tolerance: 1e-2, at_most: NonZeroU32::new(32).expect("32 is not 0") }
    }
}

/// The directional albedo of a scattering function over the hemisphere of directions.
///
/// The rows are even in t where `cos θ = (1 − t²)²`: even in θ near the normal, and close together
/// towards the horizon, where albedos change fast. The last has cos θ = 10⁻⁶ and stands for what lies
/// below it. The columns are even in φ. Between its nodes the table is bilinear in t and φ, and so
/// continuous.
#[derive(Debug, Clone, PartialEq)]
pub struct AlbedoTable {
    rows: u32,
    /// Row by row from the normal to the horizon, each with one node per column.
    nodes: Vec<f64>,
    error: f64,
}

impl AlbedoTable {
    /// The table of [`directional`] at the surface point `x` in [0, 1]², or of [`averaged`] if `x` is
    /// `None`.
    ///
    /// The grid is halved until the error is within the tolerance. What the halving corrects at the
    /// new nodes, half-way between the old ones, is the interpolation error of the grid before: for an
    /// albedo with two derivatives about four times that of the grid after, but as little as a third of it where
    /// the albedo bends close to an old node. The error allows for the bend.
    ///
    /// # Errors
    ///
    /// As [`directional`].
    ///
    /// # Examples
    ///
    /// ```
    /// use selvedge_normalize::{estimate::Sampling, table::{AlbedoTable, Resolution}};
    /// use selvedge_normalize::glam::{DVec3, Vec2, Vec3};
    /// // f falls off towards grazing light: E = cos θ, its mean 2/3.
    /// let brdf = |_: Vec2, wi: Vec3, _: Vec3| wi.z / std::f32::consts::PI;
    /// let resolution = Resolution { tolerance: 0.01, at_most: 64.try_into().expect("not 0") };
    /// let table = AlbedoTable::of(&brdf, None, &Sampling::default(), &resolution)?;
    /// assert!((table.at(DVec3::new(0.6, 0.0, 0.8)) - 0.8).abs() <= table.error());
    /// let mean = table.mean();
    /// assert!((mean.value - 2.0 / 3.0).abs() <= mean.error && mean.error <= 0.01);
    /// # Ok::<(), selvedge_normalize::albedo::AlbedoError>(())
    /// ```
    pub fn of(
        brdf: &(impl Scattering + ?Sized),
        x: Option<DVec2>,
        sampling: &Sampling,
        resolution: &Resolution,
    ) -> Result<Self, AlbedoError> {
        let mut largest_error = 0.0f64;
        let mut albedo = |w: DVec3| {
            let rho = match x {
                Some(x) => directional(brdf, x, w, sampling),
                None => averaged(brdf, w, sampling),
            }?;
            largest_error = largest_error.max(rho.error);
            Ok(rho.value)
        };
        let finest = resolution.at_most.get().clamp(2 * COARSEST, FINEST);
        let mut table = Self::filled(COARSEST, |_, _, w| albedo(w))?;
        loop {
            let corrected;
            (table, corrected) = table.halved(&mut albedo)?;
            let left = BEND * corrected;
            if left <= resolution.tolerance || table.rows > finest / 2 {
                return Ok(Self { error: left + largest_error, ..table });
            }
        }
    }

    /// The albedo for `w`, a unit vector with z ≥ 0, within [`AlbedoTable::error`].
    #[must_use]
    pub fn at(&self, w: DVec3) -> f64 {
        let z = w.z.max(0.0);
        // 1 − √z without cancellation next to the normal.
        let t = w.truncate().length() / ((1.0 + z) * (1.0 + z.sqrt())).sqrt();
        let turn = w.y.atan2(w.x) / TAU;
        let columns = f64::from(COLUMNS_PER_ROW * self.rows);
        let row = t / last_t() * f64::from(self.rows);
        self.interpolated(row, turn.rem_euclid(1.0) * columns)
    }

    /// The albedo is expected within [`AlbedoTable::at`] ± this in every direction: three times the largest
    /// correction that the last halving made, plus the largest error stated for a node. A feature that
    /// fits between the nodes can be missed.
    #[must_use]
    pub const fn error(&self) -> f64 {
        self.error
    }

    /// The greatest value of the table, which is that of a node.
    #[must_use]
    pub fn max(&self) -> f64 {
        self.nodes.iter().copied().fold(0.0, f64::max)
    }

    /// The bihemispherical albedo; its `points` are the directions of the table.
    ///
    /// ```text
    /// Ē = 1/π ∫ E(w) cos θ dw = 8 ∫ E(t) t (1 − t²)³ dt ,  E(t) the mean of E over φ
    /// ```
    ///
    /// E(t) is linear between the rows, so the integral adds nothing to the table's error, and the part
    /// below the last row has a weight of 10⁻¹².
    #[must_use]
    pub fn mean(&self) -> Estimate {
        let columns = (COLUMNS_PER_ROW * self.rows) as usize;
        let over_phi: Vec<f64> = self
            .nodes
            .chunks(columns)
            .map(|row| row.iter().sum::<f64>() / columns as f64)
            .collect();
        // Integrals from 0 of the weight 8 t (1 − t²)³ and of t times it.
        let weight = |t: f64| 1.0 - (1.0 - t * t).powi(4);
        let moment = |t: f64| {
            let s = t * t;
            8.0 * t * s * (1.0 / 3.0 + s * (-3.0 / 5.0 + s * (3.0 / 7.0 - s / 9.0)))
        };
        let n = f64::from(self.rows);
        let strip = |(k, pair): (u32, &[f64])| {
            let (t, next) = (last_t() * f64::from(k) / n, last_t() * f64::from(k + 1) / n);
            let slope = (pair[1] - pair[0]) / (next - t);
            let at_zero = pair[0] - slope * t;
            at_zero * (weight(next) - weight(t)) + slope * (moment(next) - moment(t))
        };
        let value = (0..).zip(over_phi.windows(2)).map(strip).sum();
        let points = COLUMNS_PER_ROW * self.rows.pow(2) + 1;
        Estimate { value, error: self.error, points }
    }

    /// The table with `rows` rows whose nodes are `node(row, column, direction)`; its error is not known.
    fn filled<E>(
        rows: u32,
        mut node: impl FnMut(usize, usize, DVec3) -> Result<f64, E>,
    ) -> Result<Self, E> {
        let columns = COLUMNS_PER_ROW * rows;
        // At the normal all columns are one direction.
        let mut nodes = vec![node(0, 0, DVec3::Z)?; columns as usize];
        for row in 1..=rows {
            let t = last_t() * f64::from(row) / f64::from(rows);
            let z = (1.0 - t * t).powi(2);
            let sin = ((1.0 - z) * (1.0 + z)).sqrt();
            for column in 0..columns {
                let across = DVec2::from_angle(TAU * f64::from(column) / f64::from(columns));
                nodes.push(node(row as usize, column as usize, (across * sin).extend(z))?);
            }
        }
        Ok(Self { rows, nodes, error: f64::INFINITY })
    }

    /// The table with twice the rows and columns, and the most that a new node corrected.
    fn halved<E>(&self, mut albedo: impl FnMut(DVec3) -> Result<f64, E>) -> Result<(Self, f64), E> {
        let columns = (COLUMNS_PER_ROW * self.rows) as usize;
        let mut corrected = 0.0f64;
        let table = Self::filled(2 * self.rows, |row, column, w| {
            if row % 2 == 0 && column % 2 == 0 {
                return Ok(self.nodes[row / 2 * columns + column / 2]);
            }
            let value = albedo(w)?;
            let before = self.interpolated(0.5 * row as f64, 0.5 * column as f64);
            corrected = corrected.max((value - before).abs());
            Ok(value)
        })?;
        Ok((table, corrected))
    }

    /// The bilinear value at a row, that of the last beyond it, and a column that wraps around.
    fn interpolated(&self, row: f64, column: f64) -> f64 {
        let columns = (COLUMNS_PER_ROW * self.rows) as usize;
        let last = f64::from(self.rows);
        let row = if row > last { last } else { row };
        // A coordinate that is not a number becomes 0 here and shows in the shares below.
        let (r, c) = ((row as usize).min(self.rows as usize - 1), column as usize);
        let (down, across) = (row - r as f64, column - c as f64);
        let node = |r: usize, c: usize| self.nodes[r * columns + c % columns];
        let at_row = |r: usize| node(r, c) * (1.0 - across) + node(r, c + 1) * across;
        at_row(r) * (1.0 - down) + at_row(r + 1) * down
    }
}

/// t of the last row, `√(1 − √10⁻⁶)`.
fn last_t() -> f64 {
    (1.0 - SMALLEST_COS_THETA.sqrt()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: u32, albedo: impl Fn(DVec3) -> f64) -> AlbedoTable {
        let filled: Result<_, ()> = AlbedoTable::filled(rows, |_, _, w| Ok(albedo(w)));
        filled.expect("no direction fails")
    }

    #[test]
    fn nodes_are_looked_up_where_they_were_made() {
        let f = |w: DVec3| 1.0 + 0.2 * w.x - 0.3 * w.y + 0.4 * w.z;
        let table = table(8, f);
        let mut nodes = table.nodes.iter();
        AlbedoTable::filled(8, |row, column, w| {
            let found = table.at(w);
            assert!((found - f(w)).abs() < 1e-12, "row {row}, column {column}: {found}, {}", f(w));
            nodes.next().copied().ok_or(())
        })
        .map_or_else(|()| panic!("as many nodes"), |again| assert_eq!(again.nodes.len(), 9 * 32));
        assert!((table.at(DVec3::X) - f(DVec3::X)).abs() < 1e-3 && table.at(DVec3::NAN).is_nan());
    }

    #[test]
    fn the_table_is_continuous_across_its_seam_and_at_its_pole() {
        let table = table(8, |w| 0.5 + 0.3 * w.x + 0.2 * w.y);
        for z in [0.0, 0.3, 0.9] {
            let side = |y: f64| DVec3::new((1.0f64 - z * z).sqrt(), y, z);
            let (left, right) = (table.at(side(-1e-12)), table.at(side(1e-12)));
            assert!((left - right).abs() < 1e-10, "z {z}: {left}, {right}");
        }
        for k in 0..8 {
            let near = (1e-9 * DVec2::from_angle(f64::from(k))).extend(1.0);
            assert!((table.at(near) - 0.5).abs() < 1e-8, "{near}: {}", table.at(near));
        }
    }

    #[test]
    fn the_mean_adds_no_error_to_that_of_the_table() {
        // t, in which the table is exact: Ē = 8 ∫ t² (1 − t²)³ dt = 128/315.
        let linear = table(8, |w| (1.0 - w.z.sqrt()).sqrt()).mean().value;
        assert!((linear - 128.0 / 315.0).abs() < 1e-5, "{linear}");
        for rows in [4, 8, 256] {
            assert!((table(rows, |_| 0.25).mean().value - 0.25).abs() < 1e-11);
        }
        for (rows, tolerance) in [(16, 3e-3), (32, 8e-4), (64, 2e-4)] {
            let cos = table(rows, |w| w.z).mean().value;
            assert!((cos - 2.0 / 3.0).abs() < tolerance, "{rows} rows: {cos}");
        }
    }
}
