//! The highlight's albedo as a table over direction, and the factor that bounds it by 1.

use selvedge_normalize::glam::DVec2;
use selvedge_normalize::halton::Halton;
use selvedge_normalize::scale::{Mode, Normalization, Place, ScaleError};
use selvedge_normalize::warp::square_to_uniform_hemisphere;

use crate::albedo::{Affine, Integrals, Nodes};
use crate::frame::Vector;
use crate::points::{Chart, greatest_of_points};
use crate::real::{self, NODES, ROW, Real, SHORT};
use crate::segment::Mapping;
use crate::table::{COLUMNS, Map, ROWS, Table};
use crate::yarn::Yarn;

/// Shortfall of a quick quadrature, as a share of the greatest albedo, from which on more nodes are
/// taken; and the density of nodes beyond which no more are.
const QUICK_SHORTFALL: f64 = 1e-3;
const MAX_DENSITY: f64 = 2.0;

/// Shapes w/l between which 1/factor is interpolated.
pub(crate) const SHAPES: usize = 9;

/// The highlight's albedo over direction, with the factor that normalises it.
#[derive(Clone, Debug)]
pub(crate) struct Reflectance {
    /// (base, slope) of each node in turn.
    table: Box<real::Nodes>,
    map: Map,
    /// Bihemispherical albedo of the table.
    pub(crate) mean: Affine<f64>,
    /// 1/factor for even steps of w/l, [`SHAPES`] of them.
    divisors: [f32; SHORT],
    /// The greatest w/l, and how many of those steps there are to 1.
    ratio_max: f64,
    steps_per_ratio: f64,
    /// The factors of segments with w/l = 0 and of those with the greatest.
    pub(crate) normalizations: [Normalization; 2],
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
    ///
    /// `None` if `goes_on` says meanwhile that nobody wants it any more.
    pub(crate) fn new(
        subject: &Subject<'_>,
        mode: Mode,
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Option<Self>, ScaleError> {
        let &Subject { yarn, is_straight, mapping, ratio_max } = subject;
        let ends = |albedo: Affine<f64>| [0.0, ratio_max].map(|ratio| albedo.at(ratio).max(0.0));
        let map = Map { is_sharp: yarn.phase.sharpness() > SHARP };
        let mut density = 1.0;
        let (quick, mut table, between, at_nodes) = loop {
            let integrals = |density| {
                Integrals::new(yarn, is_straight, mapping, Nodes::resolving(yarn, density))
            };
            let (quick, fine) = (integrals(density), integrals(1.5 * density));
            let albedo = |wo| if goes_on() { ends(quick.mean(wo)) } else { [0.0; 2] };
            let (mut table, between) = Table::above(map, albedo);
            let at_nodes = table.shortfall(albedo, |wo| ends(fine.mean(wo)));
            if !goes_on() {
                return Ok(None);
            }
            // By which the table is raised, and the diffuse gets less.
            if at_nodes < QUICK_SHORTFALL || density > MAX_DENSITY {
                break (quick, table, between, at_nodes);
            }
            density *= 1.5;
        };
        let found = table.greatest();
        // What was not looked at may be worse.
        table.lift(2.0 * (between + at_nodes) + 1.2e-3);
        let normalizations = match mode {
            Mode::None => [Normalization::none(); 2],
            Mode::Segment => [0, 1].map(|which| {
                let (max_albedo, upper_bound) = (found[which], table.greatest()[which]);
                Normalization {
                    factor: factor_of(upper_bound),
                    max_albedo,
                    at: Place { point: None, direction: Some(table.direction_of_greatest(which)) },
                    lower_bound: 2.0 * max_albedo - upper_bound,
                    upper_bound,
                    evaluations: table.evaluations,
                }
            }),
            Mode::Pointwise => {
                [greatest_of_points(&quick, 0.0)?, greatest_of_points(&quick, ratio_max)?]
            }
        };
        let divisors = shapes().map(|s| {
            let mix = |[long, short]: [f64; 2]| long + s * (short - long);
            match mode {
                Mode::Segment => table.nodes.iter().copied().map(mix).fold(0.0, f64::max),
                Mode::Pointwise | Mode::None => mix(normalizations.map(|n| 1.0 / n.factor)),
            }
        });
        Ok(Some(Self::from_parts(&table, divisors, ratio_max, normalizations)))
    }

    /// The least table and factors that bound those of every one of `variants`, all for the same
    /// shapes; the table itself of one.
    pub(crate) fn envelope(mut variants: Vec<Self>) -> Self {
        if variants.len() == 1 {
            return variants.remove(0);
        }
        let ratio_max = variants.first().map_or(0.0, |variant| variant.ratio_max);
        let map = Map { is_sharp: variants.iter().any(|variant| variant.map.is_sharp) };
        let table = Table::new(map, |wo| {
            [0.0, ratio_max].map(|ratio| {
                let albedo = |variant: &Self| variant.at(Vector::<f64>::of(wo)).at(ratio);
                variants.iter().map(albedo).fold(0.0, f64::max)
            })
        });
        let greatest = |shape: usize| {
            variants.iter().map(|variant| f64::from(variant.divisors[shape])).fold(0.0, f64::max)
        };
        let normalizations = [0, 1].map(|which| {
            let all = variants.iter().map(|variant| variant.normalizations[which]);
            let least =
                |a: Normalization, b: Normalization| if b.factor < a.factor { b } else { a };
            all.reduce(least).unwrap_or(Normalization::none())
        });
        let divisors = core::array::from_fn(greatest);
        Self::from_parts(&table, divisors, ratio_max, normalizations)
    }

    /// By how much the albedo of another yarn exceeds this table at worst, as a share of its greatest,
    /// and that of its points 1/factor.
    pub(crate) fn excess(&self, subject: &Subject<'_>, mode: Mode) -> f64 {
        let &Subject { yarn, is_straight, mapping, ratio_max } = subject;
        let integrals = Integrals::new(yarn, is_straight, mapping, Nodes::resolving(yarn, 1.0));
        let greatest = [0, 1].map(|which| self.greatest()[which].max(1e-30));
        let mut excess: f64 = 0.0;
        for [a, b, c, d] in Halton::<4>::new().points_from(core::num::NonZeroU32::MIN).take(64) {
            let wo = square_to_uniform_hemisphere(DVec2::new(a, b));
            let (albedo, bound) = (integrals.mean(wo), self.at(Vector::<f64>::of(wo)));
            for (ratio, greatest) in [0.0, ratio_max].into_iter().zip(greatest) {
                excess = excess.max((albedo.at(ratio) - bound.at(ratio)) / greatest);
                if mode == Mode::Pointwise {
                    for chart in Chart::ALL {
                        let ([x, y], wo) = chart.at(&integrals, DVec2::new(c, d), wo);
                        let found = integrals.at_point(x, y, wo).at(ratio);
                        excess = excess.max(found / self.divisor::<f64>(ratio) - 1.0);
                    }
                }
            }
        }
        excess
    }

    /// The greatest albedos of segments with w/l = 0 and of those with the greatest.
    pub(crate) fn greatest(&self) -> [f64; 2] {
        let ends = self.table.iter().map(|&[base, slope]| {
            let (base, slope) = (f64::from(base), f64::from(slope));
            [base, base - slope * self.ratio_max]
        });
        ends.fold([0.0; 2], |[a, b], [long, short]| [long.max(a), short.max(b)])
    }

    /// 1/factor for even steps of w/l.
    pub(crate) fn divisors(&self) -> &[f32] {
        &self.divisors[..SHAPES]
    }

    /// The same with other factors.
    pub(crate) fn with_divisors(&self, divisors: [f32; SHAPES]) -> Self {
        let padded = core::array::from_fn(|shape| divisors[shape.min(SHAPES - 1)]);
        let mut reflectance = Self { divisors: padded, ..self.clone() };
        let ends = [divisors[0], divisors[SHAPES - 1]].map(f64::from);
        for (normalization, divisor) in reflectance.normalizations.iter_mut().zip(ends) {
            normalization.factor = divisor.recip();
            normalization.upper_bound = divisor;
        }
        reflectance
    }

    /// Raises the table by a `share` of its greatest albedos.
    pub(crate) fn lift(&mut self, share: f64) {
        let [long, short] = self.greatest().map(|greatest| share * greatest);
        let slope = (long - short) / self.ratio_max.max(f64::MIN_POSITIVE);
        for entry in self.table.iter_mut() {
            *entry = [entry[0] + long as f32, entry[1] + slope as f32];
        }
        self.mean.base += long;
        self.mean.slope += slope;
    }

    /// Divides the factor by `by`.
    pub(crate) fn scale_divisors(&mut self, by: f64) {
        self.divisors = self.divisors.map(|divisor| divisor * by as f32);
        for normalization in &mut self.normalizations {
            normalization.factor /= by;
            normalization.upper_bound *= by;
        }
    }

    fn from_parts(
        table: &Table,
        divisors: [f64; SHAPES],
        ratio_max: f64,
        normalizations: [Normalization; 2],
    ) -> Self {
        let step = ratio_max.max(f64::MIN_POSITIVE);
        let entry = |&[long, short]: &[f64; 2]| [long as f32, ((long - short) / step) as f32];
        let mut nodes = Box::new([[0.0; 2]; NODES + ROW]);
        for (node, albedos) in nodes.iter_mut().zip(&table.nodes) {
            *node = entry(albedos);
        }
        let mut reflectance = Self {
            table: nodes,
            map: table.map,
            mean: Affine::default(),
            divisors: core::array::from_fn(|shape| {
                (1.0 / factor_of(divisors[shape.min(SHAPES - 1)])) as f32
            }),
            ratio_max,
            steps_per_ratio: (SHAPES - 1) as f64 / ratio_max.max(1e-30),
            normalizations,
        };
        reflectance.mean = reflectance.bihemispherical();
        reflectance
    }

    /// Its memory, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.table.as_slice())
    }

    /// 1/factor for the shape `ratio` = w/l.
    #[inline(always)]
    pub(crate) fn divisor<R: Real>(&self, ratio: R) -> R {
        let position = ratio * ratio.of(self.steps_per_ratio);
        let ([low, high], share) = R::short_entries(&self.divisors, SHAPES, position);
        low + (high - low) * share
    }

    /// Directional albedo of the unnormalised highlight for `w` (yarn frame, unit, z ≥ 0), averaged
    /// over a segment: bilinear in the table.
    #[inline(always)]
    pub(crate) fn at<R: Real>(&self, w: Vector<R>) -> Affine<R> {
        self.of_both([w, w])[0]
    }

    /// [`Reflectance::at`] for two directions, in less time than one after the other.
    #[inline(always)]
    pub(crate) fn of_both<R: Real>(&self, w: [Vector<R>; 2]) -> [Affine<R>; 2] {
        let [at_0, at_1] = self.map.coordinates(w);
        [self.between(at_0), self.between(at_1)]
    }

    /// Directional albedo at a row and column of the table.
    #[inline(always)]
    fn between<R: Real>(&self, at: [R; 2]) -> Affine<R> {
        let [base, slope] = R::bilinear(&self.table, [ROWS, COLUMNS], at);
        Affine { base, slope }
    }

    /// Mean of the table over the cosine-weighted hemisphere, less 10⁻⁵ of it: more than the error of its
    /// quadrature, so that the diffuse, which is divided by what it leaves, errs downwards.
    fn bihemispherical(&self) -> Affine<f64> {
        // Both are linear in the table, so one pass is enough.
        let mean = |density: f64| {
            let mut sum = Affine::<f64>::default();
            let weights = self.map.for_each_direction(density, |w, weight| {
                let albedo = self.at(w);
                sum.base += weight * albedo.base;
                sum.slope += weight * albedo.slope;
            });
            [sum.base / weights, sum.slope / weights]
        };
        // The errors of the midpoint rule are as the squares of the steps.
        let (coarse, fine) = (mean(1.0), mean(3.0));
        let mean = |part: usize| 0.99999 * (9.0 * fine[part] - coarse[part]) / 8.0;
        Affine { base: mean(0), slope: mean(1) }
    }
}

/// What scales an albedo that is at most `greatest`; 1 where nothing is reflected.
fn factor_of(greatest: f64) -> f64 {
    if greatest > 1e-30 { 1.0 / greatest } else { 1.0 }
}

/// The shapes at which 1/factor is kept, as shares of the greatest w/l.
fn shapes() -> [f64; SHAPES] {
    core::array::from_fn(|shape| shape as f64 / (SHAPES - 1) as f64)
}

/// Sharpness of a phase function from which on the columns of the table crowd more at grazing
/// directions: there, a sharp forward peak passes.
const SHARP: f64 = 20.0;
