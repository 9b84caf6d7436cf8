//! How much a highlight reflects: its directional albedo by quadrature, as a table, and the factor
//! that bounds it by 1.
//!
//! Over the directions `wi` that reflect into a given `wo`, the change of variables
//! `wi → (v or u of the highlight, azimuth on the cone)` cancels the geometry factor, and what
//! remains is smooth (Nelson, McEvoy & Fratarcangeli 2016, equation 2, after that substitution):
//!
//! ```text
//! ∫ f cos θi dwi = ∫_window dv ∫ dφ (du/dy)/(2δ sin u_max) [1 − (w/l) sin u_max (1 − cos v)] f_c pq/(p+q) cos θi
//! ```
//!
//! Its mean over a segment depends neither on δ nor on the mapping, and is the same expression for
//! twisted and untwisted yarn. Both are affine in the segment's width over length w/l, so two
//! numbers a direction serve segments of every shape.

use core::f64::consts::{FRAC_PI_2, PI};

use selvedge_normalize::glam::{DVec2, DVec3};
use selvedge_normalize::scale::{Mode, Normalization, Options, ScaleError};
use selvedge_normalize::search::Search;

use crate::frame::Vector;
use crate::phase::AzimuthNode;
use crate::real::Real;
use crate::segment::{COS_V_MIN, Mapping, Optics, normal, shaded_angles};
use crate::yarn::Yarn;

/// An albedo affine in w/l: `base − slope·(w/l)`, with `slope` ≥ 0.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Affine<R> {
    pub(crate) base: R,
    pub(crate) slope: R,
}

impl<R: Real> Affine<R> {
    #[inline]
    pub(crate) fn at(self, ratio: R) -> R {
        self.base - self.slope * ratio
    }
}

/// Numbers of nodes for one albedo.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes {
    pub(crate) arc: usize,
    pub(crate) section: usize,
    pub(crate) azimuth: usize,
}

impl Nodes {
    /// Nodes that resolve the highlight of `yarn`: the sharper the phase function, the faster the
    /// integrand changes along the arc and around the section. `density` is 1 for the table and
    /// the factor, whose errors their margins cover, and more for an albedo that is asked for.
    pub(crate) fn resolving(yarn: &Yarn, density: f64) -> Self {
        let sharpness = yarn.phase.sharpness();
        let nodes = |range: f64| (density * (8.0 + 2.0 * sharpness * range)).ceil() as usize;
        Self {
            arc: nodes(shaded_angles(yarn, false).0),
            section: nodes(FRAC_PI_2),
            azimuth: (density * 32.0).ceil() as usize,
        }
    }
}

/// The albedo integrals of one type of yarn.
pub(crate) struct Integrals {
    optics: Optics<f64>,
    is_filament: bool,
    u_max: f64,
    /// Gauss–Legendre nodes on [−1, 1].
    arc: Vec<(f64, f64)>,
    section: Vec<(f64, f64)>,
    azimuths: Vec<AzimuthNode>,
}

impl Integrals {
    pub(crate) fn new(yarn: &Yarn, is_straight: bool, mapping: Mapping, nodes: Nodes) -> Self {
        Self {
            optics: Optics::new(yarn, is_straight, mapping),
            is_filament: yarn.is_filament(),
            u_max: shaded_angles(yarn, is_straight).0,
            arc: gauss_legendre(nodes.arc),
            section: gauss_legendre(nodes.section),
            azimuths: yarn.phase.nodes(nodes.azimuth),
        }
    }

    /// Directional albedo of the highlight for `wo` (yarn frame, unit, z ≥ 0), averaged over the
    /// segment.
    pub(crate) fn mean(&self, wo: DVec3) -> Affine<f64> {
        // Up to the inclination at which the middle of the yarn turns away from `wo`, and beyond:
        // for grazing directions almost nothing of one part is seen.
        let limit = wo.z.atan2(wo.y.abs()) * -wo.y.signum();
        let edge = limit.clamp(-self.u_max, self.u_max);
        let mut sum = Affine { base: 0.0, slope: 0.0 };
        for (from, to) in [(-self.u_max, edge), (edge, self.u_max)] {
            let half = 0.5 * (to - from);
            for &(node, weight) in self.arc.iter().filter(|_| half > 0.0) {
                let section = self.section(0.5 * (from + to) + half * node, wo);
                sum.base += weight * half * section.base;
                sum.slope += weight * half * section.slope;
            }
        }
        if self.u_max == 0.0 {
            let section = self.section(0.0, wo);
            return Affine { base: 0.5 * section.base, slope: 0.0 };
        }
        let scale = 0.25 / self.optics.sin_u_max;
        Affine { base: sum.base * scale, slope: sum.slope * scale }
    }

    /// The integral over the section at inclination `u`, rad, and its part in w/l.
    fn section(&self, u: f64, wo: DVec3) -> Affine<f64> {
        let (sin_u, cos_u) = u.sin_cos();
        // The part of the section that faces `wo`, at whose edge the integrand has a kink.
        let centre = wo.x.atan2(sin_u * wo.y + cos_u * wo.z);
        let from = (centre - FRAC_PI_2).max(-FRAC_PI_2);
        let to = (centre + FRAC_PI_2).min(FRAC_PI_2);
        let half = 0.5 * (to - from);
        let mut sum = Affine { base: 0.0, slope: 0.0 };
        for &(node, weight) in self.section.iter().filter(|_| half > 0.0) {
            let (sin_v, cos_v) = (0.5 * (from + to) + half * node).sin_cos();
            let value = weight * half * self.cone(sin_u, cos_u, sin_v, cos_v, wo);
            sum.base += value;
            sum.slope += value * self.optics.sin_u_max * (1.0 - cos_v);
        }
        sum
    }

    /// Directional albedo of the highlight for `wo` at the point (`x`, `y`) of the segment.
    pub(crate) fn at_point(&self, x: f64, y: f64, wo: DVec3) -> Affine<f64> {
        let optics = &self.optics;
        let (low, high) = window(if self.is_filament { y } else { x }, optics.delta);
        let (from, to) = if self.is_filament {
            (optics.u_of_y(low), optics.u_of_y(high))
        } else {
            (optics.v_of_x(low), optics.v_of_x(high))
        };
        let mut sum = Affine { base: 0.0, slope: 0.0 };
        for &(node, weight) in &self.section {
            let (sin, cos) = (0.5 * (from + to) + 0.5 * (to - from) * node).sin_cos();
            let (sin_u, cos_u, sin_v, cos_v, jacobian) = if self.is_filament {
                let (sin_v, cos_v, dv_dx) = optics.across(x);
                (sin, cos, sin_v, cos_v, dv_dx / optics.sin_u_max)
            } else {
                let (sin_u, cos_u, du_dy) = optics.along(y);
                (sin_u, cos_u, sin, cos, du_dy)
            };
            let value = weight * jacobian * self.cone(sin_u, cos_u, sin_v, cos_v, wo);
            sum.base += value;
            sum.slope += value * optics.sin_u_max * (1.0 - cos_v);
        }
        let scale = 0.5 * (to - from) * optics.half_inv_delta;
        Affine { base: sum.base * scale, slope: sum.slope * scale }
    }

    /// The point (x, y) of the segment for a point of the unit square, so spread that a search over
    /// the square finds the edges of filaments, where the arcsine map's dv/dx = 1/cos v is steep:
    /// there, cos v is even in its logarithm.
    fn point(&self, square: DVec2) -> (f64, f64) {
        let centred = 2.0 * square - 1.0;
        let x = if self.is_filament && self.optics.mapping == Mapping::Arcsine {
            let cos_v = COS_V_MIN.powf(centred.x.abs());
            (1.0 - cos_v * cos_v).sqrt().copysign(centred.x)
        } else {
            centred.x
        };
        (x, centred.y)
    }

    /// `∫ f_c pq/(p+q) cos θi dφ` over the cone of directions that the fibre at (u, v) reflects
    /// into `wo`.
    fn cone(&self, sin_u: f64, cos_u: f64, sin_v: f64, cos_v: f64, wo: DVec3) -> f64 {
        let n = vector(normal(sin_u, cos_u, sin_v, cos_v));
        let q = n.dot(wo);
        if q <= 0.0 {
            return 0.0;
        }
        let t = vector(self.optics.tangent(sin_u, cos_u, sin_v, cos_v));
        let along = t.dot(wo);
        let e1 = (wo - along * t).try_normalize().unwrap_or_else(|| t.any_orthonormal_vector());
        let e2 = t.cross(e1);
        let radius = (1.0 - along * along).max(0.0).sqrt();
        let (n1, n2) = (radius * n.dot(e1), radius * n.dot(e2));
        let (z0, z1, z2) = (-along * t.z, radius * e1.z, radius * e2.z);
        // Four sums side by side, since the order of a single one would keep the processor from
        // adding lanes at once.
        let mut sums = [0.0; 4];
        for nodes in self.azimuths.chunks(4) {
            for (sum, node) in sums.iter_mut().zip(nodes) {
                let p = (node.cos * n1 + node.sin * n2).max(0.0);
                let z = (z0 + node.cos * z1 + node.sin * z2).max(0.0);
                *sum += node.weight * z * p / (p + q);
            }
        }
        sums.iter().sum::<f64>() * q
    }
}

/// The highlight centres whose drawn window covers the coordinate `c`, all in [−1, 1].
fn window(c: f64, delta: f64) -> (f64, f64) {
    let low = if c < 2.0 * delta - 1.0 { -1.0 } else { c - delta };
    let high = if c > 1.0 - 2.0 * delta { 1.0 } else { c + delta };
    (low, high)
}

/// Nodes a side of the albedo table; odd, so that cells and nodes pair up under half a turn.
const SIDE: usize = 33;

/// Added to the tabulated albedo, relative, for the error of quadrature and what is left of that of
/// interpolation, which grow with the sharpness of the phase function: the diffuse must never get
/// more than the highlight leaves. `tests/furnace.rs` would show it.
fn table_margin(yarn: &Yarn) -> f64 {
    0.010 + 0.008 * yarn.phase.sharpness()
}

/// The highlight's albedo over direction, with the factor that normalises it.
#[derive(Clone, Debug)]
pub(crate) struct Reflectance {
    base: Vec<f32>,
    slope: Vec<f32>,
    /// Bihemispherical albedo of the table.
    pub(crate) mean: Affine<f64>,
    /// 1/factor for w/l = 0, and how much less it is for w/l = 1.
    pub(crate) divisor: Affine<f64>,
}

impl Reflectance {
    /// The table and the factor of Eq. 2 for one type of yarn.
    ///
    /// The maximum over directions of an expression affine in w/l is convex in w/l, so the chord
    /// between its values at 0 and 1 is an upper bound for every segment.
    pub(crate) fn new(
        yarn: &Yarn,
        is_straight: bool,
        mapping: Mapping,
        mode: Mode,
    ) -> Result<Self, ScaleError> {
        let nodes = Nodes::resolving(yarn, 1.0);
        let integrals = Integrals::new(yarn, is_straight, mapping, nodes);
        let margin = 1.0 + table_margin(yarn);
        let table = upper_table(|wo| {
            let albedo = integrals.mean(wo);
            [albedo.at(0.0), albedo.at(1.0)].map(|value| value.max(0.0) * margin)
        });
        let greatest =
            table.iter().fold([0.0; 2], |[a, b]: [f64; 2], &[c, d]| [a.max(c), b.max(d)]);
        let divisor = |ratio: f64| -> Result<f64, ScaleError> {
            let found = match mode {
                Mode::Segment => Normalization::segment(
                    |wo| integrals.mean(wo).at(ratio).max(0.0),
                    &Options { search: search(96, 2, 50), ..Options::default() },
                ),
                Mode::Pointwise => Normalization::pointwise(
                    |point: DVec2, wo| {
                        let (x, y) = integrals.point(point);
                        integrals.at_point(x, y, wo).at(ratio).max(0.0)
                    },
                    &Options { search: search(2048, 8, 200), ..Options::default() },
                ),
                Mode::None => Ok(Normalization::none()),
            };
            found.map(|normalization| 1.0 / normalization.factor)
        };
        let [mut longest, mut shortest] = [divisor(0.0)?, divisor(1.0)?];
        if mode == Mode::Segment {
            // The table must stay below 1 too.
            (longest, shortest) = (longest.max(greatest[0]), shortest.max(greatest[1]));
        }
        let mut reflectance = Self {
            base: table.iter().map(|&[long, _]| long as f32).collect(),
            slope: table.iter().map(|&[long, short]| (long - short) as f32).collect(),
            mean: Affine::default(),
            divisor: Affine { base: longest, slope: longest - shortest },
        };
        reflectance.mean = reflectance.bihemispherical();
        Ok(reflectance)
    }

    /// Directional albedo of the unnormalised highlight for `w` (yarn frame, unit, z ≥ 0), averaged
    /// over the segment: bilinear in the table.
    #[inline]
    pub(crate) fn at<R: Real>(&self, w: Vector<R>) -> Affine<R> {
        let half_cells = R::from_f64(0.5 * (SIDE - 1) as f64);
        let side = R::from_f64(SIDE as f64);
        // Onto the octahedron |x| + |y| + z = 1, seen from above: a square on its corner, whose
        // distance from the rim grows with √z so that grazing directions have their own nodes.
        let inv_norm = R::one() / (w.x.abs() + w.y.abs() + w.z);
        let scale = half_cells * inv_norm / (R::one() + (w.z * inv_norm).max(R::zero()).sqrt());
        let (s, t) = ((w.x + w.y) * scale + half_cells, (w.x - w.y) * scale + half_cells);
        let greatest = R::from_f64((SIDE - 2) as f64);
        let row = s.floor().clamp_to(R::zero(), greatest);
        let column = t.floor().clamp_to(R::zero(), greatest);
        let (fs, ft) = (s - row, t - column);
        let index = row * side + column;
        let bilinear = |table: &[f32]| {
            let near = mix(R::gather(table, index), R::gather(table, index + R::one()), ft);
            let far = index + side;
            mix(near, mix(R::gather(table, far), R::gather(table, far + R::one()), ft), fs)
        };
        Affine { base: bilinear(&self.base), slope: bilinear(&self.slope) }
    }

    /// Mean of the table over the cosine-weighted hemisphere, less a thousandth: more than the error
    /// of its quadrature, so that the diffuse, which is divided by what it leaves, errs downwards.
    fn bihemispherical(&self) -> Affine<f64> {
        Affine {
            base: 0.999 * cosine_mean(4, |w| self.at(w).base),
            slope: 0.999 * cosine_mean(4, |w| self.at(w).slope),
        }
    }
}

/// The table of two albedos over direction whose bilinear interpolation is, at its nodes and at the
/// centres of its cells, not below `albedo`: where it was, the corners have been raised.
fn upper_table(albedo: impl Fn(DVec3) -> [f64; 2]) -> Vec<[f64; 2]> {
    let half_turn = SIDE * SIDE - 1;
    let mut table = vec![[0.0; 2]; SIDE * SIDE];
    for index in 0..=half_turn / 2 {
        // Half a turn about z maps the yarn onto itself, and the table onto its reverse.
        table[index] = albedo(direction((index / SIDE) as f64, (index % SIDE) as f64));
        table[half_turn - index] = table[index];
    }
    let mut raised = table.clone();
    let cells = SIDE - 1;
    for cell in 0..cells * cells / 2 {
        let (row, column) = (cell / cells, cell % cells);
        let first = row * SIDE + column;
        let corners = [first, first + 1, first + SIDE, first + SIDE + 1];
        let exact = albedo(direction(row as f64 + 0.5, column as f64 + 0.5));
        for (which, exact) in exact.into_iter().enumerate() {
            let mean = 0.25 * corners.iter().map(|&corner| table[corner][which]).sum::<f64>();
            let missing = (exact - mean).max(0.0);
            for corner in corners {
                for index in [corner, half_turn - corner] {
                    let least = table[index][which] + missing;
                    raised[index][which] = raised[index][which].max(least);
                }
            }
        }
    }
    raised
}

/// `1/π ∫ g(w) cos θ dw` over the hemisphere, by the midpoint rule with `density`² nodes in each
/// cell of the table, whose interpolation has its kinks between the cells.
pub(crate) fn cosine_mean(density: usize, g: impl Fn(Vector<f64>) -> f64) -> f64 {
    let count = (SIDE - 1) * density;
    let row = |k: usize| (k as f64 + 0.5) / density as f64;
    let (mut sum, mut weights) = (0.0, 0.0);
    for i in 0..count {
        for j in 0..count {
            let w = direction(row(i), row(j));
            // On the octahedron dw = dx dy (|x| + |y| + z)³ for a unit vector; the distance r from
            // its rim is stretched from √r, whose area grows with √r (1 + √r).
            let norm = w.x.abs() + w.y.abs() + w.z;
            let from_rim = (w.z / norm).sqrt();
            let weight = w.z * norm.powi(3) * from_rim * (1.0 + from_rim);
            sum += weight * g(Vector::new(w.x, w.y, w.z));
            weights += weight;
        }
    }
    sum / weights
}

/// The direction at a row and column of the table.
fn direction(row: f64, column: f64) -> DVec3 {
    let coordinate = |k: f64| 2.0 * k / (SIDE - 1) as f64 - 1.0;
    let (s, t) = (coordinate(row), coordinate(column));
    let (x, y) = (0.5 * (s + t), 0.5 * (s - t));
    let from_rim = (1.0 - x.abs() - y.abs()).max(0.0);
    let scale = 1.0 + from_rim;
    DVec3::new(scale * x, scale * y, from_rim * from_rim).normalize()
}

fn search(explore: u32, refine: u32, steps: u32) -> Search {
    Search { explore: explore.try_into().expect("counts are not zero"), refine, steps }
}

fn mix<R: Real>(a: R, b: R, t: R) -> R {
    a + (b - a) * t
}

fn vector(v: Vector<f64>) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

/// Nodes and weights of the Gauss–Legendre rule of `n` points on [−1, 1].
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let degree = n as f64;
    (0..n)
        .map(|i| {
            // Newton's method from the Chebyshev-like guess (Abramowitz & Stegun 1964, 22.16.6).
            let mut x = (PI * (i as f64 + 0.75) / (degree + 0.5)).cos();
            let mut derivative = 1.0;
            for _ in 0..8 {
                let (mut p, mut previous) = (1.0, 0.0);
                for k in 1..=n {
                    let k = k as f64;
                    (p, previous) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k, p);
                }
                derivative = degree * (x * p - previous) / (x * x - 1.0);
                x -= p / derivative;
            }
            (x, 2.0 / ((1.0 - x * x) * derivative * derivative))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phase::Phase;
    use crate::{filament, staple};
    use selvedge_normalize::warp::square_to_cosine_hemisphere;

    #[test]
    fn cosine_mean_of_powers_of_the_cosine_is_exact() {
        for power in 0..6 {
            let found = cosine_mean(2, |w| w.z.powi(power));
            let exact = 2.0 / (f64::from(power) + 2.0);
            assert!((found - exact).abs() < 3e-4, "cos^{power}: {found}, expected {exact}");
        }
        let found = cosine_mean(2, |w| w.x * w.x);
        assert!((found - 0.25).abs() < 3e-4, "x²: {found}");
    }

    #[test]
    fn gauss_legendre_is_exact_for_polynomials() {
        for n in [1, 2, 10, 16, 48] {
            let rule = gauss_legendre(n);
            for power in 0..2 * n.min(12) {
                let sum: f64 = rule.iter().map(|&(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-13, "{n} points, x^{power}: {sum}");
            }
        }
    }

    fn yarns() -> Vec<Yarn> {
        let d = Yarn::default();
        let soft = Phase::VonMises { alpha: 0.3, beta: 1.0 };
        vec![
            d,
            Yarn { psi: 0.0, ..d },
            Yarn { psi: -1.2, u_max: 1.1, delta: 0.7, ..d },
            Yarn { psi: 0.0, u_max: 0.9, delta: 1.0, phase: soft, ..d },
            Yarn { psi: 0.4, u_max: 0.02, phase: soft, ..d },
        ]
    }

    /// The mean of the highlight over the segment and all `wi`, from `highlight` itself.
    fn brute_force(yarn: &Yarn, mapping: Mapping, ratio: f64, wo: DVec3) -> f64 {
        let optics = Optics::<f64>::new(yarn, false, mapping);
        let wo = Vector::new(wo.x, wo.y, wo.z);
        let points = selvedge_normalize::halton::Halton::<4>::new();
        let n = 4_000_000;
        let sum: f64 = points
            .points_from(core::num::NonZeroU32::MIN)
            .take(n)
            .map(|[a, b, c, d]| {
                let wi = square_to_cosine_hemisphere(DVec2::new(a, b));
                let wi = Vector::new(wi.x, wi.y, wi.z);
                let (x, y) = (2.0 * c - 1.0, 2.0 * d - 1.0);
                if yarn.is_filament() {
                    filament::highlight(&optics, x, y, ratio, wi, wo)
                } else {
                    staple::highlight(&optics, x, y, ratio, wi, wo)
                }
            })
            .sum();
        PI * sum / n as f64
    }

    #[test]
    fn mean_albedo_is_the_integral_of_the_highlight_in_both_mappings() {
        let fine = Nodes { arc: 32, section: 32, azimuth: 128 };
        for yarn in yarns() {
            for wo in [DVec3::new(0.3, -0.2, 0.9), DVec3::new(-0.6, 0.5, 0.3)] {
                let wo = wo.normalize();
                for mapping in [Mapping::Arcsine, Mapping::Linear] {
                    let expected = brute_force(&yarn, mapping, 0.5, wo);
                    let found = Integrals::new(&yarn, false, mapping, fine).mean(wo).at(0.5);
                    assert!(
                        (found / expected - 1.0).abs() < 0.01,
                        "{yarn:?} {mapping:?} at {wo}: {found}, expected {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn mean_over_points_is_the_mean_albedo() {
        let fine = Nodes { arc: 32, section: 32, azimuth: 64 };
        let wo = DVec3::new(0.5, 0.3, 0.6).normalize();
        for yarn in yarns() {
            let integrals = Integrals::new(&yarn, false, Mapping::Linear, fine);
            let n = 60;
            let at = |k: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0;
            let sum: f64 =
                (0..n * n).map(|i| integrals.at_point(at(i % n), at(i / n), wo).at(0.5)).sum();
            let (found, expected) = (sum / f64::from(n * n), integrals.mean(wo).at(0.5));
            assert!(
                (found / expected - 1.0).abs() < 5e-3,
                "{yarn:?}: {found}, expected {expected}"
            );
        }
    }

    #[test]
    fn table_is_above_the_albedo_and_close_to_it() {
        let fine = Nodes { arc: 32, section: 48, azimuth: 128 };
        let mut worst: (f64, f64) = (0.0, 0.0);
        for yarn in yarns() {
            let table = Reflectance::new(&yarn, false, Mapping::Arcsine, Mode::None).unwrap();
            let exact = Integrals::new(&yarn, false, Mapping::Arcsine, fine);
            for i in 0..400 {
                let w = square_to_cosine_hemisphere(DVec2::new(
                    (f64::from(i % 20) + 0.37) / 20.0,
                    (f64::from(i / 20) + 0.71) / 20.0,
                ));
                let found = table.at(Vector::new(w.x, w.y, w.z)).at(0.7);
                let error = found - exact.mean(w).at(0.7);
                worst = (worst.0.min(error), worst.1.max(error));
            }
        }
        println!("table minus albedo: {:.5} to {:.5}", worst.0, worst.1);
        assert!(worst.0 > -0.002 && worst.1 < 0.02, "{worst:?}");
    }
}
