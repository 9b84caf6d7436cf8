//! Smooth surfaces through square grids of points: interpolating bicubic splines, twice
//! continuously differentiable, so that a highlight on them has no creases.

use glam::Vec3A;

/// A square grid of points, rows one after the other.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Points along one side, at least 3.
    pub size: usize,
    /// `size`² points: the one in column i (along u) and row j (along v) is at `j * size + i`.
    pub points: Vec<Vec3A>,
}

/// A finer grid on the spline surface through a [`Grid`].
#[derive(Debug)]
pub(super) struct Surface {
    /// Points of the surface.
    pub grid: Grid,
    /// Derivative with respect to the column of the grid that was refined.
    pub along_columns: Vec<Vec3A>,
    /// Derivative with respect to the row of the grid that was refined.
    pub along_rows: Vec<Vec3A>,
}

impl Grid {
    /// The spline surface through this grid, with `factor` steps from point to point.
    pub(super) fn refine(&self, factor: usize) -> Surface {
        let coarse = self.size;
        let fine = (coarse - 1) * factor + 1;
        // Along the rows, leaving `coarse` rows of `fine` points; then along the columns.
        let mut points = vec![Vec3A::ZERO; coarse * fine];
        let mut slopes = points.clone();
        for (row, values) in self.points.chunks_exact(coarse).enumerate() {
            for (i, (value, slope)) in spline(values, factor).enumerate() {
                points[row * fine + i] = value;
                slopes[row * fine + i] = slope;
            }
        }
        let mut grid = Self { size: fine, points: vec![Vec3A::ZERO; fine * fine] };
        let (mut along_columns, mut along_rows) = (grid.points.clone(), grid.points.clone());
        for i in 0..fine {
            let column =
                |list: &[Vec3A]| -> Vec<_> { list[i..].iter().step_by(fine).copied().collect() };
            for (j, (value, slope)) in spline(&column(&points), factor).enumerate() {
                grid.points[j * fine + i] = value;
                along_rows[j * fine + i] = slope;
            }
            for (j, (value, _)) in spline(&column(&slopes), factor).enumerate() {
                along_columns[j * fine + i] = value;
            }
        }
        Surface { grid, along_columns, along_rows }
    }
}

/// Values and derivatives, with respect to the index, of the uniform cubic spline through
/// `values`, at each of them and at `factor` − 1 points between neighbours.
fn spline(values: &[Vec3A], factor: usize) -> impl Iterator<Item = (Vec3A, Vec3A)> {
    let slopes = knot_slopes(values);
    let last = values.len() - 1;
    (0..=last * factor).map(move |step| {
        let knot = (step / factor).min(last - 1);
        let x = (step - knot * factor) as f32 / factor as f32;
        // Cubic Hermite interpolation.
        let (p, q, dp, dq) = (values[knot], values[knot + 1], slopes[knot], slopes[knot + 1]);
        let (a, b) = (3.0 * (q - p) - 2.0 * dp - dq, 2.0 * (p - q) + dp + dq);
        (p + x * (dp + x * (a + x * b)), dp + x * (2.0 * a + 3.0 * x * b))
    })
}

/// Derivatives at the knots of the natural spline, whose second derivative is continuous and
/// vanishes at both ends:
///
/// ```text
/// 2 d₀ + d₁ = 3 (p₁ − p₀),   dᵢ₋₁ + 4 dᵢ + dᵢ₊₁ = 3 (pᵢ₊₁ − pᵢ₋₁),   dₙ₋₁ + 2 dₙ = 3 (pₙ − pₙ₋₁)
/// ```
fn knot_slopes(values: &[Vec3A]) -> Vec<Vec3A> {
    let last = values.len() - 1;
    let mut slopes = Vec::with_capacity(values.len());
    // Elimination downwards keeps 1/pivot, as each row's upper coefficient after division.
    let mut upper = Vec::with_capacity(values.len());
    let (mut slope, mut factor) = (Vec3A::ZERO, 0.0);
    for i in 0..=last {
        let diagonal = if i == 0 || i == last { 2.0 } else { 4.0 };
        let (before, after) = (values[i.saturating_sub(1)], values[(i + 1).min(last)]);
        let pivot = 1.0 / (diagonal - factor);
        slope = (3.0 * (after - before) - slope) * pivot;
        factor = pivot;
        slopes.push(slope);
        upper.push(factor);
    }
    for i in (0..last).rev() {
        let next = slopes[i + 1];
        slopes[i] -= upper[i] * next;
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(size: usize, point: impl Fn(f32, f32) -> Vec3A) -> Grid {
        let points =
            (0..size * size).map(|k| point((k % size) as f32, (k / size) as f32)).collect();
        Grid { size, points }
    }

    fn wavy(x: f32, y: f32) -> Vec3A {
        Vec3A::new(x + (0.7 * y).sin(), y, (0.9 * x).cos() * (0.4 * y).sin())
    }

    #[test]
    fn surface_passes_through_the_grid() {
        let coarse = grid(9, wavy);
        let fine = coarse.refine(4).grid;
        assert_eq!(fine.size, 33);
        for j in 0..9 {
            for i in 0..9 {
                let (a, b) = (coarse.points[j * 9 + i], fine.points[4 * (j * 33 + i)]);
                assert!(a.abs_diff_eq(b, 1e-5), "{i} {j}: {a} {b}");
            }
        }
    }

    #[test]
    fn bilinear_grids_stay_bilinear() {
        let point = |x: f32, y: f32| Vec3A::new(2.0 * x - y, 0.5 * y, x * y + 1.0);
        let surface = grid(6, point).refine(3);
        for (k, &found) in surface.grid.points.iter().enumerate() {
            let (x, y) = ((k % 16) as f32 / 3.0, (k / 16) as f32 / 3.0);
            assert!(found.abs_diff_eq(point(x, y), 1e-5), "{x} {y}: {found}");
            let along_x = surface.along_columns[k];
            assert!(along_x.abs_diff_eq(Vec3A::new(2.0, 0.0, y), 1e-5), "{x} {y}: {along_x}");
            let along_y = surface.along_rows[k];
            assert!(along_y.abs_diff_eq(Vec3A::new(-1.0, 0.5, x), 1e-5), "{x} {y}: {along_y}");
        }
    }

    #[test]
    fn error_falls_with_the_fourth_power_of_the_spacing() {
        // In the middle, where the natural ends are no longer felt.
        let error = |scale: usize| {
            let step = 1.0 / scale as f32;
            let values: Vec<_> =
                (0..=16 * scale).map(|i| Vec3A::splat((0.5 * i as f32 * step).sin())).collect();
            let fine = spline(&values, 2).enumerate().skip(14 * scale).take(4 * scale);
            fine.map(|(k, (value, _))| (value.x - (0.25 * k as f32 * step).sin()).abs())
                .fold(0.0, f32::max)
        };
        let ratio = error(1) / error(2);
        assert!((12.0..20.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn derivatives_are_those_of_the_surface() {
        let surface = grid(9, wavy).refine(64);
        let n = surface.grid.size;
        for (j, i) in
            (1..n - 1).step_by(37).flat_map(|j| (1..n - 1).step_by(29).map(move |i| (j, i)))
        {
            let k = j * n + i;
            let difference = |step: usize| {
                (surface.grid.points[k + step] - surface.grid.points[k - step]) * 32.0
            };
            let (found, expected) = (surface.along_columns[k], difference(1));
            assert!(found.abs_diff_eq(expected, 2e-3), "{i} {j}: {found} {expected}");
            let (found, expected) = (surface.along_rows[k], difference(n));
            assert!(found.abs_diff_eq(expected, 2e-3), "{i} {j}: {found} {expected}");
        }
    }
}
