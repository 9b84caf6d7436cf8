//! A square sheet of cloth that falls on a form and comes to rest: extended position-based
//! dynamics (Macklin, Müller & Chentanez 2016) with one iteration per small step (Macklin et al.
//! 2019).
//!
//! The sheet is a square grid of equal masses. Its energies are per area of the sheet, summed over
//! the grid, so that a finer grid behaves alike; ε is the relative extension of a spring:
//!
//! ```text
//! stretch   K/2 ε²         K in N/m, springs along both thread directions
//! shear     S/2 ε²         S in N/m, springs along both diagonals
//! bending   B/2 |∂²P|²     B in N m, |∂²P|² = |P_uu|² + 2 |P_uv|² + |P_vv|²
//! ```
//!
//! Each energy k/2 C² of a constraint C(P) moves its points, all of mass m, by the gradient of C
//! times −C / (|∇C|² + m/(k Δt²)). Constraints of one kind that share no point, a colour, follow
//! each other; the order is fixed, so the sheet comes to rest in the same bits in every run.

use std::f32::consts::SQRT_2;

use glam::{UVec3, Vec3A};

use super::{form::Form, spline::Grid};

/// What the sheet is made of and how it slides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Material {
    /// Mass per area, kg/m².
    pub density: f32,
    /// K: stiffness along the threads, N/m.
    pub stretch: f32,
    /// S: stiffness along the diagonals, N/m.
    pub shear: f32,
    /// B: bending stiffness, N m.
    pub bending: f32,
    /// Distance in metres that the sheet's points keep from form and floor.
    pub clearance: f32,
    /// Coefficient of friction with the form.
    pub friction_form: f32,
    /// Coefficient of friction with the floor.
    pub friction_floor: f32,
}

/// A stretch of simulated time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phase {
    /// Number of steps.
    pub steps: usize,
    /// Steps per second. The load that a thread bears stretches it by an amount that falls with
    /// the square of this, as a single iteration per step does not find the balance.
    pub rate: f32,
    /// Rate at which velocities decay, 1/s.
    pub damping: f32,
}

/// Metres, seconds; z up.
const GRAVITY: Vec3A = Vec3A::new(0.0, 0.0, -9.81);

/// Steps between searches for parts of the sheet that come close to each other.
const SEARCH_INTERVAL: usize = 16;

/// How near points count as close, in edge lengths: [`KEEP_APART`] and the way of a few steps.
const SEARCH_RADIUS: f32 = 1.5;

/// Distance in edge lengths that parts of the sheet keep from each other. With points this dense
/// no point slips between others, so the sheet cannot pass through itself.
const KEEP_APART: f32 = 1.0;

/// Points up to this far along the grid are neighbours, whose distance is bending's affair.
const NEIGHBOURHOOD: usize = 2;

/// The sheet in motion.
#[derive(Debug)]
pub(super) struct Sheet {
    grid: Grid,
    /// Length of an edge of the grid at rest, in metres.
    spacing: f32,
    velocities: Vec<Vec3A>,
    /// Where the points were at the beginning of the step.
    previous: Vec<Vec3A>,
    /// Pairs of points that are close in space but not on the sheet.
    close: Vec<(u32, u32)>,
}

impl Sheet {
    /// A sheet at rest whose sides are `side` metres long when not stretched.
    pub(super) fn new(grid: Grid, side: f32) -> Self {
        Self {
            spacing: side / (grid.size - 1) as f32,
            velocities: vec![Vec3A::ZERO; grid.points.len()],
            previous: grid.points.clone(),
            close: Vec::new(),
            grid,
        }
    }

    /// Where the points are, in metres.
    pub(super) fn into_grid(self) -> Grid {
        self.grid
    }

    /// Lets time pass.
    pub(super) fn run(&mut self, material: &Material, form: &Form, phase: &Phase) {
        let (h, dt) = (self.spacing, 1.0 / phase.rate);
        // m/(k Δt²) of each constraint: C is a length for springs, k = K; and a second difference
        // h² ∂²P for bending, k = B/h².
        let inertia = material.density * h * h / (dt * dt);
        let stretch = inertia / material.stretch;
        let shear = inertia / material.shear;
        let bending = inertia * h * h / material.bending;
        let decay = 1.0 / (1.0 + phase.damping * dt);
        for step in 0..phase.steps {
            if step % SEARCH_INTERVAL == 0 {
                self.find_close();
            }
            let points = self.grid.points.iter_mut().zip(&mut self.velocities);
            for ((x, v), previous) in points.zip(&mut self.previous) {
                *v = (*v + GRAVITY * dt) * decay;
                *previous = *x;
                *x += *v * dt;
            }
            self.bend(bending);
            self.twist(bending);
            self.spring(1, 1, h * SQRT_2, shear);
            self.spring(-1, 1, h * SQRT_2, shear);
            self.spring(1, 0, h, stretch);
            self.spring(0, 1, h, stretch);
            self.keep_apart();
            self.keep_out(material, form);
            let points = self.grid.points.iter().zip(&mut self.velocities);
            for ((x, v), previous) in points.zip(&self.previous) {
                *v = (*x - *previous) / dt;
            }
        }
    }

    /// Springs from each point to the one `columns` and `rows` further.
    fn spring(&mut self, columns: isize, rows: usize, rest: f32, compliance: f32) {
        let n = self.grid.size;
        let points = &mut self.grid.points;
        let weight = 1.0 / (2.0 + compliance);
        let mut pull = |a: usize, b: usize| {
            let difference = points[b] - points[a];
            let length = difference.length();
            let shift = difference * (weight * (1.0 - rest / length.max(f32::MIN_POSITIVE)));
            points[a] += shift;
            points[b] -= shift;
        };
        let first = if columns < 0 { 1 } else { 0 };
        let last = if columns > 0 { n - 1 } else { n };
        for colour in 0..2 {
            if rows == 0 {
                for j in 0..n {
                    for i in (first + colour..last).step_by(2) {
                        pull(j * n + i, j * n + i + 1);
                    }
                }
            } else {
                for j in (colour..n - 1).step_by(2) {
                    for i in first..last {
                        pull(j * n + i, (j + 1) * n + i.wrapping_add_signed(columns));
                    }
                }
            }
        }
    }

    /// Second differences along rows and columns, h² P_uu and h² P_vv, towards zero.
    fn bend(&mut self, compliance: f32) {
        let n = self.grid.size;
        let points = &mut self.grid.points;
        let weight = 1.0 / (6.0 + compliance);
        let mut straighten = |a: usize, b: usize, c: usize| {
            let shift = (points[a] - 2.0 * points[b] + points[c]) * weight;
            points[a] -= shift;
            points[b] += 2.0 * shift;
            points[c] -= shift;
        };
        for colour in 0..3 {
            for j in 0..n {
                for i in (colour..n - 2).step_by(3) {
                    straighten(j * n + i, j * n + i + 1, j * n + i + 2);
                }
            }
        }
        for colour in 0..3 {
            for j in (colour..n - 2).step_by(3) {
                for i in 0..n {
                    straighten(j * n + i, (j + 1) * n + i, (j + 2) * n + i);
                }
            }
        }
    }

    /// Second differences around squares, h² P_uv, towards zero. They count twice in the energy.
    fn twist(&mut self, compliance: f32) {
        let n = self.grid.size;
        let points = &mut self.grid.points;
        let weight = 1.0 / (4.0 + compliance / 2.0);
        for (first_row, first_column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            for j in (first_row..n - 1).step_by(2) {
                for a in (j * n + first_column..(j + 1) * n - 1).step_by(2) {
                    let [b, c, d] = [a + 1, a + n, a + n + 1];
                    let shift = (points[a] - points[b] - points[c] + points[d]) * weight;
                    points[a] -= shift;
                    points[b] += shift;
                    points[c] += shift;
                    points[d] -= shift;
                }
            }
        }
    }

    /// Lists the pairs that [`Sheet::keep_apart`] watches, with the points sorted into cells.
    fn find_close(&mut self) {
        let n = self.grid.size;
        let points = &self.grid.points;
        let reach = SEARCH_RADIUS * self.spacing;
        let low = points.iter().copied().fold(Vec3A::INFINITY, Vec3A::min);
        let high = points.iter().copied().fold(Vec3A::NEG_INFINITY, Vec3A::max);
        // One empty cell around all others, so that each point's cell has all its neighbours.
        let cell = |x: Vec3A| ((x - low) / reach).as_uvec3() + UVec3::ONE;
        let size = cell(high) + UVec3::splat(2);
        let index = |cell: UVec3| (cell.x + size.x * (cell.y + size.y * cell.z)) as usize;

        // Counting sort: the points of cell k become sorted[starts[k]..starts[k + 1]]. Counted two
        // entries up and filled one entry up, each start moves to its place.
        let cells: Vec<_> = points.iter().map(|&x| index(cell(x))).collect();
        let mut starts = vec![0_u32; size.element_product() as usize + 2];
        for &k in &cells {
            starts[k + 2] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut sorted = vec![0_u32; points.len()];
        for (point, &k) in cells.iter().enumerate() {
            sorted[starts[k + 1] as usize] = point as u32;
            starts[k + 1] += 1;
        }

        self.close.clear();
        let (layer, row) = ((size.x * size.y) as usize, size.x as usize);
        for (a, &k) in cells.iter().enumerate() {
            for middle in [k - layer, k, k + layer].map(|k| [k - row, k, k + row]).as_flattened() {
                // Three cells side by side, whose points follow each other.
                let (from, to) = (starts[middle - 1], starts[middle + 2]);
                for &b in &sorted[from as usize..to as usize] {
                    let b = b as usize;
                    let apart = (a % n).abs_diff(b % n).max((a / n).abs_diff(b / n));
                    let close = points[a].distance_squared(points[b]) < reach * reach;
                    if a < b && close && apart > NEIGHBOURHOOD {
                        self.close.push((a as u32, b as u32));
                    }
                }
            }
        }
    }

    fn keep_apart(&mut self) {
        let points = &mut self.grid.points;
        let distance = KEEP_APART * self.spacing;
        for &(a, b) in &self.close {
            let (a, b) = (a as usize, b as usize);
            let difference = points[b] - points[a];
            let length = difference.length();
            if length < distance && length > 0.0 {
                let shift = difference * (0.5 * (distance / length - 1.0));
                points[a] -= shift;
                points[b] += shift;
            }
        }
    }

    fn keep_out(&mut self, material: &Material, form: &Form) {
        let top = form.height + material.clearance;
        for (x, &previous) in self.grid.points.iter_mut().zip(&self.previous) {
            let depth = material.clearance - x.z;
            if depth > 0.0 {
                *x = push_out(*x, previous, depth, Vec3A::Z, material.friction_floor);
            }
            if x.z < top {
                let (distance, normal) = form.distance(*x);
                let depth = material.clearance - distance;
                if depth > 0.0 {
                    *x = push_out(*x, previous, depth, normal, material.friction_form);
                }
            }
        }
    }
}

/// `x` out of the obstacle by `depth`, and back along the way it slid by at most `friction` times
/// `depth`: Coulomb friction, as the depth stands for the force of the obstacle.
fn push_out(x: Vec3A, previous: Vec3A, depth: f32, normal: Vec3A, friction: f32) -> Vec3A {
    let out = x + normal * depth;
    let slide = (out - previous).reject_from_normalized(normal);
    let (length, most) = (slide.length(), friction * depth);
    out - if length > most { slide * (most / length) } else { slide }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    const SIDE: f32 = 0.2;

    /// Far below the floor's reach.
    const NO_FORM: Form =
        Form { centre: Vec2::splat(50.0), radius: 0.1, height: 0.1, shoulder: 0.02, dome: 0.3 };

    const MATERIAL: Material = Material {
        density: 0.2,
        stretch: 1000.0,
        shear: 100.0,
        bending: 1e-5,
        clearance: 0.001,
        friction_form: 0.2,
        friction_floor: 0.2,
    };

    fn flat(size: usize, z: f32) -> Sheet {
        let step = SIDE / (size - 1) as f32;
        let points = (0..size * size)
            .map(|k| Vec3A::new((k % size) as f32 * step, (k / size) as f32 * step, z))
            .collect();
        Sheet::new(Grid { size, points }, SIDE)
    }

    #[test]
    fn free_fall_is_that_of_a_body() {
        let mut sheet = flat(9, 0.3);
        sheet.run(&MATERIAL, &NO_FORM, &Phase { steps: 200, rate: 1000.0, damping: 0.0 });
        // Semi-implicit steps: g Δt² (1 + 2 + … + n).
        let expected = 0.3 - 9.81e-6 * 0.5 * 200.0 * 201.0;
        for (found, start) in sheet.grid.points.iter().zip(&flat(9, expected).grid.points) {
            assert!(found.abs_diff_eq(*start, 1e-3), "{found} {start}");
        }
    }

    #[test]
    fn sheet_comes_to_rest_flat_on_the_floor() {
        let mut sheet = flat(17, 0.02);
        sheet.run(&MATERIAL, &NO_FORM, &Phase { steps: 2000, rate: 2000.0, damping: 4.0 });
        for (found, start) in
            sheet.grid.points.iter().zip(&flat(17, MATERIAL.clearance).grid.points)
        {
            assert!(found.abs_diff_eq(*start, 1e-4), "{found} {start}");
        }
    }

    #[test]
    fn forces_inside_the_sheet_neither_push_nor_turn_it() {
        let mut sheet = flat(13, 0.0);
        for (k, x) in sheet.grid.points.iter_mut().enumerate() {
            *x +=
                0.004 * Vec3A::new((7 * k) as f32, (13 * k) as f32, (29 * k) as f32).map(f32::sin);
        }
        let sums = |sheet: &Sheet| {
            let moment = |x: &Vec3A| x.cross(Vec3A::ONE);
            let points = &sheet.grid.points;
            (points.iter().sum::<Vec3A>(), points.iter().map(moment).sum::<Vec3A>())
        };
        let before = sums(&sheet);
        let h = sheet.spacing;
        sheet.bend(3.0);
        sheet.twist(3.0);
        sheet.spring(1, 1, h * SQRT_2, 0.1);
        sheet.spring(-1, 1, h * SQRT_2, 0.1);
        sheet.spring(1, 0, h, 0.1);
        sheet.spring(0, 1, h, 0.1);
        sheet.find_close();
        sheet.keep_apart();
        let after = sums(&sheet);
        assert!(before.0.abs_diff_eq(after.0, 1e-4), "{before:?} {after:?}");
        assert!(before.1.abs_diff_eq(after.1, 1e-4), "{before:?} {after:?}");
    }

    #[test]
    fn springs_of_every_kind_reach_their_length() {
        for (columns, rows, length) in [(1, 0, 1.0), (0, 1, 1.0), (1, 1, SQRT_2), (-1, 1, SQRT_2)] {
            let mut sheet = flat(8, 0.0);
            let h = sheet.spacing;
            for x in &mut sheet.grid.points {
                *x *= 1.3;
            }
            for _ in 0..2000 {
                sheet.spring(columns, rows, h * length, 0.0);
            }
            for j in 0..8 - rows {
                for i in usize::from(columns < 0)..8 - usize::from(columns > 0) {
                    let other = (j + rows) * 8 + i.wrapping_add_signed(columns);
                    let found = sheet.grid.points[j * 8 + i].distance(sheet.grid.points[other]);
                    assert!((found / (h * length) - 1.0).abs() < 1e-3, "{columns} {rows}: {i} {j}");
                }
            }
        }
    }

    #[test]
    fn bending_flattens_a_rough_sheet() {
        let roughness = |sheet: &Sheet| {
            let n = sheet.grid.size;
            let p = &sheet.grid.points;
            let inner = (1..n - 1).flat_map(|j| (1..n - 1).map(move |i| j * n + i));
            inner
                .map(|k| {
                    (p[k - 1] - 2.0 * p[k] + p[k + 1]).length_squared()
                        + (p[k - n] - 2.0 * p[k] + p[k + n]).length_squared()
                })
                .sum::<f32>()
        };
        let mut sheet = flat(13, 0.0);
        for (k, x) in sheet.grid.points.iter_mut().enumerate() {
            x.z = 0.01 * ((k * k) as f32).sin();
        }
        let before = roughness(&sheet);
        for _ in 0..50 {
            sheet.bend(1.0);
            sheet.twist(1.0);
        }
        let after = roughness(&sheet);
        assert!(after < 1e-3 * before, "{before} {after}");
    }

    #[test]
    fn close_pairs_are_those_of_an_exhaustive_search() {
        let mut sheet = flat(15, 0.0);
        for (k, x) in sheet.grid.points.iter_mut().enumerate() {
            // A crumpled ball.
            *x = 0.03 * Vec3A::new((5 * k) as f32, (11 * k) as f32, (17 * k) as f32).map(f32::sin);
        }
        sheet.find_close();
        let mut found = sheet.close.clone();
        found.sort_unstable();
        let reach = SEARCH_RADIUS * sheet.spacing;
        let mut expected = Vec::new();
        for b in 0..225_usize {
            for a in 0..b {
                let apart = (a % 15).abs_diff(b % 15).max((a / 15).abs_diff(b / 15));
                let distance = sheet.grid.points[a].distance(sheet.grid.points[b]);
                if apart > NEIGHBOURHOOD && distance < reach {
                    expected.push((a as u32, b as u32));
                }
            }
        }
        expected.sort_unstable();
        assert!(expected.len() > 100, "{}", expected.len());
        assert_eq!(found, expected);
    }

    #[test]
    fn folded_sheet_keeps_apart() {
        // Folded double with nothing between the halves.
        let mut sheet = flat(17, 0.5);
        let spacing = sheet.spacing;
        for (k, x) in sheet.grid.points.iter_mut().enumerate() {
            let i = (k % 17) as f32 - 8.0;
            x.x = i.abs() * spacing;
            x.z += if i < 0.0 { -0.3 } else { 0.3 } * spacing * i.abs().min(1.0);
        }
        sheet.run(&MATERIAL, &NO_FORM, &Phase { steps: 100, rate: 2000.0, damping: 50.0 });
        for j in 0..17 {
            for i in 0..6 {
                let [a, b] = [j * 17 + i, j * 17 + 16 - i].map(|k| sheet.grid.points[k]);
                assert!(a.distance(b) > 0.9 * spacing && a.z < b.z, "row {j}, column {i}: {a} {b}");
            }
        }
    }

    #[test]
    fn friction_holds_up_to_its_coefficient() {
        let depth = 0.001;
        let from = Vec3A::new(0.0, 0.0, 0.0);
        for slide in [0.0001, 0.0002, 0.0004] {
            let x = Vec3A::new(slide, 0.0, -depth);
            let found = push_out(x, from, depth, Vec3A::Z, 0.25);
            let expected = Vec3A::new((slide - 0.25 * depth).max(0.0), 0.0, 0.0);
            assert!(found.abs_diff_eq(expected, 1e-8), "{slide}: {found} {expected}");
        }
    }
}
