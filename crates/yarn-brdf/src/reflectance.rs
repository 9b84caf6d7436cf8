//! The highlight's albedo as a table over direction, and the factor that bounds it by 1.

use selvedge_normalize::glam::{DVec2, DVec3};
use selvedge_normalize::halton::Halton;
use selvedge_normalize::scale::{Mode, Normalization, Options, ScaleError};
use selvedge_normalize::search::Search;

use crate::albedo::{Affine, Integrals, Nodes};
use crate::frame::Vector;
use crate::real::Real;
use crate::segment::Mapping;
use crate::yarn::Yarn;

/// Rows and columns at which the albedo is computed; between them it is interpolated to twice as many.
const ROWS: usize = 25;
const COLUMNS: usize = 24;

/// Rows and columns of the table, whose last column is the first again.
const TABLE_ROWS: usize = 2 * ROWS - 1;
const TABLE_COLUMNS: usize = 2 * COLUMNS + 1;

/// Shapes w/l between which 1/factor is interpolated.
const SHAPES: usize = 9;

/// The highlight's albedo over direction, with the factor that normalises it.
#[derive(Clone, Debug)]
pub(crate) struct Reflectance {
    /// (base, slope) of each node in turn.
    table: Vec<[f32; 2]>,
    map: Map,
    /// Bihemispherical albedo of the table.
    pub(crate) mean: Affine<f64>,
    /// 1/factor for even steps of w/l.
    divisors: [f32; SHAPES],
    /// The greatest w/l, and how many of those steps there are to 1.
    ratio_max: f64,
    steps_per_ratio: f64,
}

/// A highlight whose albedo is tabulated.
pub(crate) struct Subject<'a> {
    pub(crate) yarn: &'a Yarn,
    pub(crate) is_straight: bool,
    pub(crate) mapping: Mapping,
    /// The greatest w/l that occurs.
    pub(crate) ratio_max: f64,
}

impl Reflectance {
    /// The table and the factor of Eq. 2 for one type of yarn.
    ///
    /// The maximum over directions of an expression affine in w/l is convex in w/l, so the chord
    /// between two shapes is an upper bound for those between them.
    pub(crate) fn new(subject: &Subject<'_>, mode: Mode) -> Result<Self, ScaleError> {
        let &Subject { yarn, is_straight, mapping, ratio_max } = subject;
        let integrals =
            |density| Integrals::new(yarn, is_straight, mapping, Nodes::resolving(yarn, density));
        let quick = integrals(1.0);
        let map = Map { is_sharp: yarn.phase.sharpness() > SHARP };
        let ends = |albedo: Affine<f64>| [0.0, ratio_max].map(|ratio| albedo.at(ratio).max(0.0));
        let mut table = map.table(|wo| ends(quick.mean(wo)));
        let fine = integrals(1.7);
        let margin = 1.0 + map.shortfall(&table, |wo| ends(fine.mean(wo)));
        for value in table.iter_mut().flatten() {
            *value *= margin;
        }
        let divisors = match mode {
            Mode::None => [1.0; SHAPES],
            Mode::Segment => shapes().map(|s| {
                let albedo = |[long, short]: [f64; 2]| long + s * (short - long);
                table.iter().copied().map(albedo).fold(0.0, f64::max)
            }),
            Mode::Pointwise => {
                let divisor = |ratio: f64| {
                    let albedo = |point: DVec2, wo| {
                        let (x, y) = quick.point(point);
                        quick.at_point(x, y, wo).at(ratio).max(0.0)
                    };
                    Normalization::pointwise(albedo, &options()).map(|n| 1.0 / n.factor)
                };
                let (long, short) = (divisor(0.0)?, divisor(ratio_max)?);
                shapes().map(|s| long + s * (short - long))
            }
        };
        Ok(Self::from_parts(map, &table, divisors, ratio_max))
    }

    /// The least table and factors that bound those of every one of `variants`, of which there is at
    /// least one, all for the same shapes.
    pub(crate) fn envelope(variants: &[Self]) -> Self {
        let ratio_max = variants[0].ratio_max;
        let map = Map { is_sharp: variants.iter().any(|variant| variant.map.is_sharp) };
        let mut table = map.table(|wo| {
            [0.0, ratio_max].map(|ratio| {
                let albedo = |variant: &Self| variant.at(Vector::<f64>::of(wo)).at(ratio);
                variants.iter().map(albedo).fold(0.0, f64::max)
            })
        });
        // For what lies between the variants, and between tables of different maps.
        for value in table.iter_mut().flatten() {
            *value *= 1.01;
        }
        let greatest = |shape: usize| {
            variants.iter().map(|variant| f64::from(variant.divisors[shape])).fold(0.0, f64::max)
        };
        Self::from_parts(map, &table, core::array::from_fn(greatest), ratio_max)
    }

    /// Divides the factor by `by`.
    pub(crate) fn scale_divisors(&mut self, by: f64) {
        self.divisors = self.divisors.map(|divisor| divisor * by as f32);
    }

    fn from_parts(map: Map, table: &[[f64; 2]], divisors: [f64; SHAPES], ratio_max: f64) -> Self {
        let step = ratio_max.max(f64::MIN_POSITIVE);
        let entries =
            table.iter().map(|&[long, short]| [long as f32, ((long - short) / step) as f32]);
        let mut reflectance = Self {
            table: entries.collect(),
            map,
            mean: Affine::default(),
            // A yarn that reflects nothing needs no factor.
            divisors: divisors.map(|d| if d > 1e-30 { d as f32 } else { 1.0 }),
            ratio_max,
            steps_per_ratio: (SHAPES - 1) as f64 / ratio_max.max(1e-30),
        };
        reflectance.mean = reflectance.bihemispherical();
        reflectance
    }

    /// 1/factor for the shape `ratio` = w/l.
    #[inline(always)]
    pub(crate) fn divisor<R: Real>(&self, ratio: R) -> R {
        R::linear(&self.divisors, ratio * R::from_f64(self.steps_per_ratio))
    }

    /// Directional albedo of the unnormalised highlight for `w` (yarn frame, unit, z ≥ 0), averaged
    /// over a segment: bilinear in the table.
    #[inline(always)]
    pub(crate) fn at<R: Real>(&self, w: Vector<R>) -> Affine<R> {
        let (row, column) = self.map.coordinates(w);
        let [base, slope] = R::bilinear(&self.table, TABLE_COLUMNS, row, column);
        Affine { base, slope }
    }

    /// Mean of the table over the cosine-weighted hemisphere, less a thousandth: more than the error
    /// of its quadrature, so that the diffuse, which is divided by what it leaves, errs downwards.
    fn bihemispherical(&self) -> Affine<f64> {
        // Both are linear in the table, so one pass is enough.
        let mut sum = Affine::<f64>::default();
        let weights = self.map.for_each_direction(1.0, |w, weight| {
            let albedo = self.at(w);
            sum.base += weight * albedo.base;
            sum.slope += weight * albedo.slope;
        });
        Affine { base: 0.999 * sum.base / weights, slope: 0.999 * sum.slope / weights }
    }
}

/// The work put into the greatest albedo of a point.
fn options() -> Options {
    let explore = 2048.try_into().expect("counts are not zero");
    Options { search: Search { explore, refine: 8, steps: 200 }, ..Options::default() }
}

/// The shapes at which 1/factor is kept, as shares of the greatest w/l.
fn shapes() -> [f64; SHAPES] {
    core::array::from_fn(|shape| shape as f64 / (SHAPES - 1) as f64)
}

/// Sharpness from which on the nodes of the table crowd more at grazing directions: there, a sharp
/// forward peak passes.
const SHARP: f64 = 20.0;

/// How directions are laid out in the table: rows by a root of z, so that grazing directions have
/// their own, and columns by the angle about z over half a turn, under which a yarn is its own image.
/// The angle is that on a square, |x| + |y| = 1, whose corners fall on columns.
#[derive(Clone, Copy, Debug)]
struct Map {
    /// Whether rows go by the fourth root instead of the square root.
    is_sharp: bool,
}

impl Map {
    /// Row and column of a direction, unit, z ≥ 0.
    #[inline(always)]
    fn coordinates<R: Real>(self, w: Vector<R>) -> (R, R) {
        let (zero, one) = (R::zero(), R::one());
        let root = w.z.max(zero).sqrt();
        let root = if self.is_sharp { root.sqrt() } else { root };
        let reach = (w.x.abs() + w.y.abs()).max(R::from_f64(1e-30));
        let turn = w.y.abs() / reach;
        // The angle of (x, y) or (−x, −y), whichever has y ≥ 0.
        let is_right = zero.lt(R::select(w.y.lt(zero), -w.x, w.x));
        let turn = R::select(is_right, turn, R::from_f64(2.0) - turn);
        (
            root.min(one) * R::from_f64((TABLE_ROWS - 1) as f64),
            turn * R::from_f64(0.5 * (TABLE_COLUMNS - 1) as f64),
        )
    }

    /// The direction at a row and column of the table, and the solid angle there per cell, up to a
    /// constant.
    fn direction(self, row: f64, column: f64) -> (DVec3, f64) {
        let root = row / (TABLE_ROWS - 1) as f64;
        let (z, slope) = if self.is_sharp {
            (root.powi(4), 4.0 * root.powi(3))
        } else {
            (root * root, 2.0 * root)
        };
        let turn = 2.0 * column / (TABLE_COLUMNS - 1) as f64;
        let (x, y) = (1.0 - turn, 1.0 - (1.0 - turn).abs());
        let reach_sq = x * x + y * y;
        let sine = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt() / reach_sq.sqrt();
        (DVec3::new(sine * x, sine * y, z), slope / reach_sq)
    }

    /// The table of two albedos over direction.
    fn table(self, albedo: impl Fn(DVec3) -> [f64; 2]) -> Vec<[f64; 2]> {
        let mut table = vec![[0.0; 2]; TABLE_ROWS * TABLE_COLUMNS];
        for row in (0..TABLE_ROWS).step_by(2) {
            let (z, _) = self.direction(row as f64, 0.0);
            // Straight on there is one direction.
            let only = (z.z == 1.0).then(|| albedo(DVec3::Z));
            for column in (0..TABLE_COLUMNS - 1).step_by(2) {
                table[row * TABLE_COLUMNS + column] =
                    only.unwrap_or_else(|| albedo(self.direction(row as f64, column as f64).0));
            }
            table[(row + 1) * TABLE_COLUMNS - 1] = table[row * TABLE_COLUMNS];
            // Each side of a square on its own, since the angle bends at its corners.
            for corner in [0, COLUMNS] {
                fill_between(&mut table, row * TABLE_COLUMNS + corner, 1, COLUMNS / 2);
            }
        }
        for column in 0..TABLE_COLUMNS {
            fill_between(&mut table, column, TABLE_COLUMNS, ROWS - 1);
        }
        table
    }

    /// By how much `table` is below `albedo` at worst, as a share of the greatest albedo, with half
    /// as much again.
    fn shortfall(self, table: &[[f64; 2]], albedo: impl Fn(DVec3) -> [f64; 2]) -> f64 {
        let (mut greatest, mut missing): (f64, f64) = (0.0, 0.0);
        let points = Halton::<2>::new().points_from(core::num::NonZeroU32::MIN);
        for (k, [a, b]) in points.take(40).enumerate() {
            // In and beside the middle between nodes that were computed, where the error is greatest.
            let offset = [0.5, 1.0][k % 2];
            let place =
                |share: f64, count: usize| 2.0 * (share * (count - 1) as f64).floor() + offset;
            let (row, column) = (place(a, ROWS), place(b, COLUMNS));
            let expected = albedo(self.direction(row, column).0);
            let first = row.floor() as usize * TABLE_COLUMNS + column.floor() as usize;
            for (which, expected) in expected.into_iter().enumerate() {
                let entry = |offset: usize| table[first + offset][which];
                let found = if offset == 1.0 {
                    entry(0)
                } else {
                    let corners = [0, 1, TABLE_COLUMNS, TABLE_COLUMNS + 1];
                    0.25 * corners.into_iter().map(entry).sum::<f64>()
                };
                greatest = greatest.max(expected);
                missing = missing.max(expected - found);
            }
        }
        if greatest > 0.0 { 1.5 * missing / greatest + 1e-3 } else { 0.0 }
    }

    /// Calls `visit(w, weight)` for `density`² directions in each cell of the table, whose
    /// interpolation has its kinks between the cells; weights are proportional to solid angle times
    /// cosine. Returns their sum.
    fn for_each_direction(self, density: f64, mut visit: impl FnMut(Vector<f64>, f64)) -> f64 {
        let count = |cells: usize| (cells as f64 * density) as usize;
        let at = |k: usize| (k as f64 + 0.5) / density;
        let mut weights = 0.0;
        for i in 0..count(TABLE_ROWS - 1) {
            for j in 0..count(TABLE_COLUMNS - 1) {
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

/// Fills every other one of `2·steps + 1` entries, `stride` apart from `first` on, by the cubic
/// through the four around it (at the ends the parabola through three).
fn fill_between(table: &mut [[f64; 2]], first: usize, stride: usize, steps: usize) {
    for k in 0..steps {
        let at = |node: usize, which: usize| table[first + 2 * node * stride][which];
        let middle = |which: usize| {
            let (a, b) = (at(k, which), at(k + 1, which));
            let value = if k == 0 {
                (3.0 * a + 6.0 * b - at(2, which)) / 8.0
            } else if k + 1 == steps {
                (3.0 * b + 6.0 * a - at(k - 1, which)) / 8.0
            } else {
                (9.0 * (a + b) - at(k - 1, which) - at(k + 2, which)) / 16.0
            };
            value.max(0.0)
        };
        let values = [middle(0), middle(1)];
        table[first + (2 * k + 1) * stride] = values;
    }
}

/// `1/π ∫ g(w) cos θ dw` over the hemisphere, by the midpoint rule over the cells of the albedo
/// table, `density`² in each.
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
            for (row, column) in [(3.2, 17.9), (16.0, 16.0), (30.5, 36.25), (15.9, 0.4)] {
                let (w, _) = map.direction(row, column);
                let (s, t) = map.coordinates(Vector::new(w.x, w.y, w.z));
                assert!((s - row).abs() < 1e-9 && (t - column).abs() < 1e-9, "{row} {column}");
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
        let found = cosine_mean(2.0, |w| w.x * w.x);
        assert!((found - 0.25).abs() < 3e-4, "x²: {found}");
    }
}
