//! `Table`: albedos over direction, computed where they are needed and bounded between.

use selvedge_normalize::glam::DVec3;
use selvedge_normalize::halton::Halton;

use crate::frame::Vector;
use crate::real::Real;

/// Rows and columns, of which every other one is computed first.
pub(crate) const ROWS: usize = 49;
pub(crate) const COLUMNS: usize = 49;

/// Error of an interpolated node, as a share of the greatest albedo, from which on every node is
/// computed.
const TOLERANCE: f64 = 1.5e-3;

/// How directions are laid out in the table: as they lie to a cylinder along y. Rows go by the fourth
/// root of 1 − |y|, from the direction along the yarn to those across it; columns by the square root
/// of z/(|x| + z), around it from x = −1 over z = 1 to x = 1. So grazing directions have their own
/// rows and columns, and what changes fast around the yarn does not meet a pole. Directions with
/// y < 0 are half a turn about z from those with y > 0, under which a yarn is its own image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Map {
    /// Whether columns go by the fourth root instead of the square root.
    pub(crate) is_sharp: bool,
}

impl Map {
    /// Row and column of each of two directions, unit, z ≥ 0, whose roots are drawn side by side.
    #[inline(always)]
    pub(crate) fn coordinates<R: Real>(self, w: [Vector<R>; 2]) -> [[R; 2]; 2] {
        let [wi, wo] = w;
        let once = R::sqrt_each([beside(wi), beside(wo), rise(wi), rise(wo)]);
        let twice = R::sqrt_each(once);
        let sides = if self.is_sharp { [twice[2], twice[3]] } else { [once[2], once[3]] };
        [place(wi, twice[0], sides[0]), place(wo, twice[1], sides[1])]
    }

    /// The direction at a row and column of the table, and the solid angle there per cell, up to a
    /// constant.
    fn direction(self, row: f64, column: f64) -> (DVec3, f64) {
        let row = row / (ROWS - 1) as f64;
        let y = 1.0 - row.powi(4);
        let turn = 2.0 * column / (COLUMNS - 1) as f64 - 1.0;
        let side = 1.0 - turn.abs();
        let power = if self.is_sharp { 4 } else { 2 };
        let share = side.powi(power);
        // z : |x| = share : 1 − share, with the slope of the angle between them.
        let x = (1.0 - share).copysign(turn);
        let reach_sq = x * x + share * share;
        let slope = side.powi(power - 1) * f64::from(power) / reach_sq;
        let radius = ((1.0 - y) * (1.0 + y)).sqrt() / reach_sq.sqrt();
        (DVec3::new(radius * x, y, radius * share), row.powi(3) * slope)
    }

    /// Calls `visit(w, weight)` for `density`² directions in each cell of the table, whose
    /// interpolation has its kinks between the cells; weights are proportional to solid angle times
    /// cosine. Returns their sum.
    pub(crate) fn for_each_direction(
        self,
        density: f64,
        mut visit: impl FnMut(Vector<f64>, f64),
    ) -> f64 {
        let count = |cells: usize| (cells as f64 * density) as usize;
        let at = |k: usize| (k as f64 + 0.5) / density;
        let mut weights = 0.0;
        for i in 0..count(ROWS - 1) {
            for j in 0..count(COLUMNS - 1) {
                let (w, solid_angle) = self.direction(at(i), at(j));
                let weight = w.z * solid_angle;
                visit(Vector::new(w.x, w.y, w.z), weight);
                visit(Vector::new(-w.x, -w.y, w.z), weight);
                weights += 2.0 * weight;
            }
        }
        weights
    }
}

/// 1 − |y| of a direction.
#[inline(always)]
fn beside<R: Real>(w: Vector<R>) -> R {
    (w.y.one() - w.y.abs()).max(w.y.zero())
}

/// z/(|x| + z) of a direction.
#[inline(always)]
fn rise<R: Real>(w: Vector<R>) -> R {
    let z = w.z.max(w.z.zero());
    z / (w.x.abs() + z).max(z.of(1e-30))
}

/// Row and column by the roots that tell them.
#[inline(always)]
fn place<R: Real>(w: Vector<R>, row: R, side: R) -> [R; 2] {
    // The x of (x, y) or (−x, −y), whichever has y ≥ 0, tells the side of the middle.
    let turn = (side.one() - side).copysign(w.x * w.y);
    let half_column = turn.of(0.5 * (COLUMNS - 1) as f64);
    [row * row.of((ROWS - 1) as f64), (turn.one() + turn) * half_column]
}

/// Two albedos at each node of the map, bilinear between them.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) map: Map,
    pub(crate) nodes: Vec<[f64; 2]>,
    /// How many albedos were computed for it.
    pub(crate) evaluations: u32,
}

impl Table {
    /// Every node computed.
    pub(crate) fn new(map: Map, albedo: impl Fn(DVec3) -> [f64; 2]) -> Self {
        let mut table = Self { map, nodes: vec![[0.0; 2]; ROWS * COLUMNS], evaluations: 0 };
        table.compute(&albedo, |_, _| true);
        table
    }

    /// As many nodes computed as it takes, the others interpolated, and all of them raised so that
    /// what lies between them is not below `albedo` by more than the share that is told of the
    /// greatest.
    pub(crate) fn above(map: Map, albedo: impl Fn(DVec3) -> [f64; 2]) -> (Self, f64) {
        let mut table = Self { map, nodes: vec![[0.0; 2]; ROWS * COLUMNS], evaluations: 0 };
        table.compute(&albedo, |row, column| row % 2 == 0 && column % 2 == 0);
        table.interpolate();
        if table.deviation(&albedo).greatest() > TOLERANCE {
            table.compute(&albedo, |row, column| row % 2 != 0 || column % 2 != 0);
        }
        table.raise();
        let missing = table.deviation(&albedo).below;
        (table, missing)
    }

    /// Adds a share of the greatest albedo to all.
    pub(crate) fn lift(&mut self, share: f64) {
        let greatest = self.greatest();
        for node in &mut self.nodes {
            for (value, greatest) in node.iter_mut().zip(greatest) {
                *value += share * greatest;
            }
        }
    }

    /// The greatest albedos.
    pub(crate) fn greatest(&self) -> [f64; 2] {
        self.nodes.iter().fold([0.0; 2], |[a, b], node| [node[0].max(a), node[1].max(b)])
    }

    /// The direction in which one of the albedos is greatest.
    pub(crate) fn direction_of_greatest(&self, which: usize) -> DVec3 {
        let better = |best: usize, node: usize| {
            if self.nodes[node][which] > self.nodes[best][which] { node } else { best }
        };
        let node = (0..self.nodes.len()).fold(0, better);
        self.map.direction((node / COLUMNS) as f64, (node % COLUMNS) as f64).0
    }

    /// By how much `albedo` is below `exact` at worst, as a share of the greatest albedo.
    pub(crate) fn shortfall(
        &mut self,
        albedo: impl Fn(DVec3) -> [f64; 2],
        exact: impl Fn(DVec3) -> [f64; 2],
    ) -> f64 {
        let mut deviation = Deviation::new(self);
        let points = Halton::<2>::new().points_from(core::num::NonZeroU32::MIN);
        for [a, b] in points.take(16) {
            let (wo, _) = self.map.direction(a * (ROWS - 1) as f64, b * (COLUMNS - 1) as f64);
            deviation.note(albedo(wo), exact(wo));
            self.evaluations += 2;
        }
        deviation.below
    }

    /// Sets the nodes for which `is_wanted(row, column)` to the albedos there.
    fn compute(
        &mut self,
        albedo: impl Fn(DVec3) -> [f64; 2],
        is_wanted: impl Fn(usize, usize) -> bool,
    ) {
        // In the first row all directions are one.
        let along = albedo(DVec3::Y);
        self.evaluations += 1;
        for (row, nodes) in self.nodes.chunks_exact_mut(COLUMNS).enumerate() {
            for (column, node) in nodes.iter_mut().enumerate() {
                if row == 0 {
                    *node = along;
                } else if is_wanted(row, column) {
                    *node = albedo(self.map.direction(row as f64, column as f64).0);
                    self.evaluations += 1;
                }
            }
        }
    }

    /// Sets the nodes in odd rows or columns to what lies between the others.
    fn interpolate(&mut self) {
        for row in (0..ROWS).step_by(2) {
            // Each side on its own, since the coordinate bends between them.
            for first in [0, COLUMNS / 2] {
                self.fill_between(row * COLUMNS + first, 1, COLUMNS / 4, None);
            }
        }
        for column in 0..COLUMNS {
            // Beyond the last row lies the image of the one before.
            let beyond = (ROWS - 3) * COLUMNS + (COLUMNS - 1 - column);
            self.fill_between(column, COLUMNS, ROWS / 2, Some(beyond));
        }
    }

    /// Fills every other one of `2·steps + 1` nodes, `stride` apart from `first` on, by the cubic
    /// through the four around it. At the ends it is the parabola through three, unless there is a
    /// node `beyond` the last.
    fn fill_between(&mut self, first: usize, stride: usize, steps: usize, beyond: Option<usize>) {
        for k in 0..steps {
            let node = |k: usize| self.nodes[first + 2 * k * stride];
            let (near, far) = (node(k), node(k + 1));
            let before = (k > 0).then(|| node(k - 1));
            let after =
                if k + 1 < steps { Some(node(k + 2)) } else { beyond.map(|n| self.nodes[n]) };
            let middle = |which: usize| {
                let (a, b) = (near[which], far[which]);
                let value = match (before, after) {
                    (Some(before), Some(after)) => {
                        (9.0 * (a + b) - before[which] - after[which]) / 16.0
                    }
                    (None, Some(after)) => (3.0 * a + 6.0 * b - after[which]) / 8.0,
                    (Some(before), None) => (3.0 * b + 6.0 * a - before[which]) / 8.0,
                    (None, None) => 0.5 * (a + b),
                };
                value.max(0.0)
            };
            let values = [middle(0), middle(1)];
            self.nodes[first + (2 * k + 1) * stride] = values;
        }
    }

    /// Raises nodes about which the albedo bends down, so that what is linear between them is not
    /// below it: by an eighth of the second differences.
    fn raise(&mut self) {
        let old = self.nodes.clone();
        for row in 1..ROWS {
            for column in 1..COLUMNS - 1 {
                let node = row * COLUMNS + column;
                let next_row = if row + 1 < ROWS {
                    node + COLUMNS
                } else {
                    (ROWS - 2) * COLUMNS + (COLUMNS - 1 - column)
                };
                for (which, value) in self.nodes[node].iter_mut().enumerate() {
                    let at = |node: usize| old[node][which];
                    let bend = |before: usize, after: usize| {
                        (at(before) + at(after) - 2.0 * at(node)).min(0.0)
                    };
                    let bend = bend(node - 1, node + 1) + bend(node - COLUMNS, next_row);
                    *value -= 0.125 * bend;
                }
            }
        }
    }

    /// The error between the nodes that are computed first.
    fn deviation(&mut self, albedo: impl Fn(DVec3) -> [f64; 2]) -> Deviation {
        let mut deviation = Deviation::new(self);
        let points = Halton::<2>::new().points_from(core::num::NonZeroU32::MIN);
        for (k, [a, b]) in points.take(90).enumerate() {
            // In the middles between nodes and at nodes that may be interpolated.
            let [down, right] = [[0.5, 0.5], [1.0, 0.0], [0.0, 1.0], [1.5, 1.0], [1.0, 1.5]][k % 5];
            let place = |share: f64, count: usize| 2.0 * (share * (count / 2) as f64).floor();
            let (row, column) = (place(a, ROWS) + down, place(b, COLUMNS) + right);
            let expected = albedo(self.map.direction(row, column).0);
            deviation.note(self.between(row, column), expected);
            self.evaluations += 1;
        }
        deviation
    }

    /// The albedos at whole or half rows and columns.
    fn between(&self, row: f64, column: f64) -> [f64; 2] {
        let (up, down) = (row.floor() as usize, row.ceil() as usize);
        let (left, right) = (column.floor() as usize, column.ceil() as usize);
        let corners = [(up, left), (up, right), (down, left), (down, right)];
        let sum = |which: usize| -> f64 {
            corners.iter().map(|&(i, j)| self.nodes[i * COLUMNS + j][which]).sum()
        };
        [0.25 * sum(0), 0.25 * sum(1)]
    }
}

/// By how much albedos err downwards and upwards at worst, as shares of the greatest.
#[derive(Clone, Copy, Debug)]
struct Deviation {
    unit: [f64; 2],
    below: f64,
    above: f64,
}

impl Deviation {
    fn new(table: &Table) -> Self {
        // A yarn that reflects nothing has no error.
        let unit = table.greatest().map(|greatest| 1.0 / greatest.max(1e-30));
        Self { unit, below: 0.0, above: 0.0 }
    }

    fn note(&mut self, found: [f64; 2], expected: [f64; 2]) {
        for (which, unit) in self.unit.into_iter().enumerate() {
            let error = (found[which] - expected[which]) * unit;
            self.below = self.below.max(-error);
            self.above = self.above.max(error);
        }
    }

    fn greatest(self) -> f64 {
        self.below.max(self.above)
    }
}

/// `1/π ∫ g(w) cos θ dw` over the hemisphere, by the midpoint rule over the cells of the table,
/// `density`² in each.
pub(crate) fn cosine_mean(density: f64, g: impl Fn(Vector<f64>) -> f64) -> f64 {
    let mut sum = 0.0;
    let map = Map { is_sharp: false };
    let weights = map.for_each_direction(density, |w, weight| sum += weight * g(w));
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_the_inverse_of_the_direction() {
        for is_sharp in [false, true] {
            let map = Map { is_sharp };
            for (row, column) in
                [(3.2, 17.9), (16.0, 16.0), (30.5, 36.25), (15.9, 0.4), (48.0, 24.0)]
            {
                let (w, _) = map.direction(row, column);
                assert!(w.is_normalized() && w.z > 0.0, "{row} {column}: {w}");
                for w in [w, DVec3::new(-w.x, -w.y, w.z)] {
                    let [[s, t], _] = map.coordinates([Vector::<f64>::of(w); 2]);
                    // In the last row, y = 0, either half turn is as good.
                    let t = if row == 48.0 && w.y <= 0.0 { 48.0 - t } else { t };
                    let error = (s - row).abs().max((t - column).abs());
                    assert!(error < 1e-7, "{row} {column}: {w} is at {s} {t}");
                }
            }
        }
    }

    #[test]
    fn cosine_mean_of_powers_of_the_cosine_is_exact() {
        for power in 0..6 {
            let found = cosine_mean(2.0, |w| w.z.powi(power));
            let exact = 2.0 / (f64::from(power) + 2.0);
            assert!((found - exact).abs() < 3e-4, "cos^{power}: {found}, expected {exact}");
        }
        for (what, found) in
            [("x²", cosine_mean(2.0, |w| w.x * w.x)), ("y²", cosine_mean(2.0, |w| w.y * w.y))]
        {
            assert!((found - 0.25).abs() < 3e-4, "{what}: {found}, expected 0.25");
        }
    }

    #[test]
    fn a_smooth_albedo_is_interpolated_and_a_sharp_one_computed() {
        let map = Map { is_sharp: false };
        let smooth = |w: DVec3| [0.5 + 0.3 * w.x * w.y + 0.1 * w.z, 0.4 - 0.2 * w.y * w.y];
        let sharp = |w: DVec3| {
            let hill = (-(w.x - 0.3 * w.y).powi(2) * 10.0).exp();
            [0.1 + 0.4 * hill, 0.2 * hill]
        };
        let (few, missing) = Table::above(map, smooth);
        assert!(few.evaluations < 800 && missing < 1e-3, "{} {missing}", few.evaluations);
        let (many, missing) = Table::above(map, sharp);
        assert!(many.evaluations > 2400 && missing < 2e-2, "{} {missing}", many.evaluations);
        for (table, albedo) in [(&few, &smooth as &dyn Fn(DVec3) -> [f64; 2]), (&many, &sharp)] {
            assert_eq!(table.nodes[0], albedo(DVec3::Y));
            let top = table.direction_of_greatest(0);
            let (found, greatest) = (albedo(top)[0], table.greatest()[0]);
            assert!((found / greatest - 1.0).abs() < 0.03, "{top}: {found}, table {greatest}");
        }
    }
}
