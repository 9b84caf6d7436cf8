//! `Shader::sample` draws from `Shader::pdf`, and weighs what it draws by f cos θ over it.

use core::f64::consts::{FRAC_PI_2, TAU};
use core::fmt;
use std::sync::{Arc, LazyLock};

use rayon::prelude::*;
use selvedge_yarn_brdf::glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{
    Combination, Diffuse, Highlight, Mapping, Mode, Noise, Phase, PhaseTable, Sample, Shader, Yarn,
};

mod support;
use support::{Random, cloth, direction};

/// A shader, and where it is looked at from where.
struct Case {
    shader: Arc<Shader>,
    yarn: Yarn,
    mapping: Mapping,
    combination: Combination,
    rotation: f64,
    uv: DVec2,
    wo: Vec3,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { yarn, mapping, combination, rotation, uv, wo, .. } = self;
        write!(f, "uv {uv} wo {wo} {mapping:?} {combination:?} rotation {rotation} {yarn:?}")
    }
}

fn window(delta: f64) -> Highlight {
    Highlight::Window { delta }
}

/// Yarns of every kind of highlight and phase function, at moderate values and at extremes.
fn yarns() -> Vec<Yarn> {
    let d = || Yarn { color: [0.4, 0.2, 0.1], specular: [0.5, 0.4, 0.3], ..Yarn::default() };
    let rough = |sigma| Highlight::Rough { sigma };
    let von_mises = |alpha, beta| Phase::VonMises { alpha, beta };
    let cauchy = |rho, is_backward| Phase::WrappedCauchy { rho, is_backward };
    let table =
        |samples: &[f64]| Phase::Tabulated(PhaseTable::new(samples).expect("samples are positive"));
    let noise = Noise { intensity: 0.7, u_max: 0.1, color: 0.2, ..Noise::default() };
    vec![
        // Twisted fibres.
        d(),
        Yarn { psi: -0.5, highlight: window(0.01), ..d() },
        Yarn { psi: 0.0301, ..d() },
        Yarn { psi: -0.035, highlight: window(0.05), phase: cauchy(0.99, false), ..d() },
        Yarn { psi: FRAC_PI_2, highlight: window(1.0), kappa: 3.0, ..d() },
        Yarn { psi: 1.2, u_max: 1.2, phase: von_mises(0.0, 200.0), ..d() },
        Yarn { phase: von_mises(0.05, 1e4), highlight: window(1.0), u_max: 0.9, ..d() },
        Yarn { phase: Phase::VonMises3d { alpha: 0.05, beta: 4.0 }, kappa: -0.7, ..d() },
        Yarn { phase: Phase::VonMises3d { alpha: 0.3, beta: 200.0 }, u_max: 1.0, ..d() },
        Yarn { phase: cauchy(0.67, false), diffuse: Diffuse::YarnNormal, ..d() },
        Yarn { phase: cauchy(0.99, true), highlight: window(0.1), psi: -1.0, ..d() },
        Yarn { phase: cauchy(1.0, true), size: 0.7, ..d() },
        Yarn { phase: table(&[0.2, 0.0, 0.0, 3.0, 1.0, 0.0]), ..d() },
        Yarn { psi: 0.8, kappa: 50.0, size: 0.8, noise, ..d() },
        Yarn { specular_uniform: Some([0.1, 0.6, 0.9]), phase: von_mises(0.6, 10.0), ..d() },
        // Untwisted fibres.
        Yarn { psi: 0.0, ..d() },
        Yarn { psi: 0.02, highlight: window(0.01), smoothing: 0.5, ..d() },
        Yarn { psi: -0.03, u_max: 0.0, phase: cauchy(0.67, true), ..d() },
        Yarn { psi: 0.0, u_max: 1.2, phase: von_mises(0.1, 200.0), kappa: -0.9, ..d() },
        Yarn { psi: 0.0, highlight: window(1.0), phase: cauchy(0.99, false), ..d() },
        Yarn { psi: 0.0, phase: von_mises(0.0, 1e4), smoothing: 0.9, kappa: 2.0, ..d() },
        Yarn { psi: 0.0, phase: table(&[1.0, 0.5]), diffuse: Diffuse::YarnNormal, ..d() },
        Yarn { psi: 0.0, noise, size: 0.9, highlight: window(0.1), ..d() },
        Yarn { psi: 0.0, phase: Phase::VonMises3d { alpha: 0.0, beta: 30.0 }, ..d() },
        // Rough fibres.
        Yarn { highlight: rough(0.15), ..d() },
        Yarn { highlight: rough(0.01), u_max: 0.9, ..d() },
        Yarn { highlight: rough(0.01), psi: 1e-3, phase: cauchy(0.99, true), ..d() },
        Yarn { highlight: rough(0.005), psi: 0.0, phase: von_mises(0.0, 1e4), ..d() },
        Yarn { highlight: rough(1.0), psi: FRAC_PI_2, phase: von_mises(0.0, 200.0), ..d() },
        Yarn { highlight: rough(0.05), phase: table(&[0.0, 1.0, 0.0, 2.0]), kappa: 4.0, ..d() },
        Yarn { highlight: rough(0.3), diffuse: Diffuse::YarnNormal, psi: -0.7, size: 0.6, ..d() },
        Yarn {
            highlight: rough(0.1),
            noise,
            phase: Phase::VonMises3d { alpha: 0.1, beta: 9.0 },
            ..d()
        },
        // No highlight at all.
        Yarn { specular: [0.0; 3], ..d() },
    ]
}

/// Every yarn under both maps, seen from upright to grazing and from the back.
static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let jobs: Vec<(usize, Yarn, usize)> = yarns()
        .into_iter()
        .enumerate()
        .flat_map(|(i, yarn)| (0..2).map(move |half| (i, yarn.clone(), half)))
        .collect();
    jobs.into_par_iter()
        .flat_map_iter(|(i, yarn, half)| {
            let mut random = Random((2 * i + half) as u64);
            let mut cloth = cloth(&yarn, 1 + (i % 3) as u32);
            cloth.mapping = [Mapping::Arcsine, Mapping::Linear][half];
            cloth.combination = [Combination::Layered, Combination::Lerp][(i + half) % 2];
            cloth.rotation = if i % 4 == 1 { random.between(-3.0, 3.0) } else { 0.0 };
            cloth.normalization = if i % 5 == 4 { Mode::Pointwise } else { Mode::Segment };
            let shader = Arc::new(cloth.prepare().expect("the yarns are valid"));
            [0.9, 0.5, 0.02, -0.7]
                .map(|z: f64| {
                    let shader = shader.clone();
                    // Where there is yarn on either side.
                    let uv = loop {
                        let uv = random.position(4.0);
                        if shader.yarn_at(uv).is_some() {
                            break uv;
                        }
                    };
                    let wo = direction(z, TAU * random.number()).as_vec3();
                    let (mapping, combination) = (cloth.mapping, cloth.combination);
                    let rotation = cloth.rotation;
                    Case { shader, yarn: yarn.clone(), mapping, combination, rotation, uv, wo }
                })
                .into_iter()
        })
        .collect()
});

/// A part of the hemisphere that `wo` is in: ranges of |z| and of the azimuth, in which solid angle is
/// even.
#[derive(Clone, Copy, Debug)]
struct Cell {
    low: DVec2,
    high: DVec2,
}

impl Cell {
    fn halves(self, axis: usize, at: f64) -> [Self; 2] {
        let (mut below, mut above) = (self, self);
        below.high[axis] = at;
        above.low[axis] = at;
        [below, above]
    }

    fn quarters(self) -> [Self; 4] {
        let middle = 0.5 * (self.low + self.high);
        let [left, right] = self.halves(0, middle.x);
        let [a, b] = left.halves(1, middle.y);
        let [c, d] = right.halves(1, middle.y);
        [a, b, c, d]
    }

    fn holds(self, at: DVec2) -> bool {
        at.cmpge(self.low).all() && at.cmplt(self.high).all()
    }

    /// The integral of `pdf` by one point in each of `side`² parts, at the place in it that `at` tells.
    fn sum(
        self,
        side: u32,
        pdf: &impl Fn(DVec2) -> f64,
        mut at: impl FnMut() -> DVec2,
    ) -> Integral {
        let step = (self.high - self.low) / f64::from(side);
        let area = step.x * step.y;
        let mut integral = Integral::default();
        let mut last = 0.0;
        for i in 0..side * side {
            let part = DVec2::new(f64::from(i / side), f64::from(i % side));
            let density = pdf(self.low + step * (part + at()));
            integral.value += area * density;
            integral.greatest = integral.greatest.max(density);
            if i % 2 == 1 {
                // Of points at random the square of a difference is the variance of a sum.
                integral.variance += (area * (density - last)).powi(2);
            }
            last = density;
        }
        integral
    }

    /// The integral of `pdf`: split until halving the step changes it little and no draw has found a
    /// density above those of the rule, and then by points at random, which miss nothing on average.
    fn integral(
        self,
        pdf: &impl Fn(DVec2) -> f64,
        draws: &[Draw],
        random: &mut Random,
    ) -> Integral {
        let coarse = self.sum(4, pdf, || DVec2::splat(0.5)).value;
        self.refined(coarse, pdf, draws, random, 12)
    }

    fn refined(
        self,
        coarse: f64,
        pdf: &impl Fn(DVec2) -> f64,
        draws: &[Draw],
        random: &mut Random,
        depth: u32,
    ) -> Integral {
        let parts = self.quarters().map(|part| (part, part.sum(4, pdf, || DVec2::splat(0.5))));
        let fine: f64 = parts.iter().map(|(_, integral)| integral.value).sum();
        let greatest = parts.iter().map(|(_, integral)| integral.greatest).fold(0.0, f64::max);
        let is_known = draws.iter().all(|draw| draw.pdf < 1.2 * greatest);
        let is_even = (fine - coarse).abs() < 1e-6 + 1e-2 * fine;
        if depth == 0 || (is_known && is_even) {
            return self.sum(8, pdf, || DVec2::new(random.number(), random.number()));
        }
        let mut sum = Integral::default();
        for (part, coarse) in parts {
            let draws: Vec<Draw> =
                draws.iter().filter(|draw| part.holds(draw.at)).copied().collect();
            sum.add(part.refined(coarse.value, pdf, &draws, random, depth - 1));
        }
        sum
    }
}

/// An estimate of an integral.
#[derive(Clone, Copy, Debug, Default)]
struct Integral {
    value: f64,
    variance: f64,
    /// The greatest density found.
    greatest: f64,
}

impl Integral {
    fn add(&mut self, other: Self) {
        self.value += other.value;
        self.variance += other.variance;
        self.greatest = self.greatest.max(other.greatest);
    }
}

/// A drawn direction and the density that was told with it.
#[derive(Clone, Copy, Debug)]
struct Draw {
    at: DVec2,
    pdf: f64,
}

/// Calls `visit` with 2^`depth` parts of `cell` that each hold about as many of the `pilot` draws,
/// however narrow the lobes they come from, and with the draws of either kind in each.
fn split(
    cell: Cell,
    pilot: &mut [Draw],
    draws: &mut [Draw],
    depth: u32,
    visit: &mut impl FnMut(Cell, &mut [Draw], &[Draw]),
) {
    if depth == 0 || pilot.len() < 2 {
        return visit(cell, pilot, draws);
    }
    let axis = usize::from(depth % 2 == 1);
    let middle = pilot.len() / 2;
    pilot.select_nth_unstable_by(middle, |a, b| a.at[axis].total_cmp(&b.at[axis]));
    let at = pilot[middle].at[axis];
    let [below, above] = cell.halves(axis, at);
    let (first, rest) = pilot.split_at_mut(middle);
    draws.sort_unstable_by(|a, b| a.at[axis].total_cmp(&b.at[axis]));
    let (low, high) = draws.split_at_mut(draws.partition_point(|draw| draw.at[axis] < at));
    split(below, first, low, depth - 1, visit);
    split(above, rest, high, depth - 1, visit);
}

/// |z| and azimuth of a direction.
fn place(w: Vec3) -> DVec2 {
    let w = w.as_dvec3();
    DVec2::new(w.z.abs(), w.y.atan2(w.x).rem_euclid(TAU))
}

/// What many draws of one case came to.
struct Outcome {
    /// Chance of counts as far from the density as these.
    p_value: f64,
    /// Share of draws that are samples, and the integral of the density.
    accepted: f64,
    integral: Integral,
    greatest_weight: f32,
    /// Mean of the weight, its standard error, and the albedo that it should be, if that is known.
    mean: DVec3,
    error: DVec3,
    albedo: Option<DVec3>,
    description: String,
}

const DRAWS: usize = 20_000;

fn outcome(case: &Case, seed: u64) -> Outcome {
    let Case { shader, uv, wo, .. } = case;
    let (uv, wo) = (*uv, *wo);
    let mut random = Random(seed ^ 0x5eed);
    let mut draw = |count: usize| -> Vec<Sample> {
        (0..count).filter_map(|_| shader.sample(uv, wo, random.xi())).collect()
    };
    let told = |sample: &Sample| Draw { at: place(sample.wi), pdf: sample.pdf.into() };
    // From draws of their own, since cells chosen by the draws they count would fit too well.
    let mut pilot: Vec<Draw> = draw(4096).iter().map(told).collect();
    let samples = draw(DRAWS);
    let mut draws: Vec<Draw> = samples.iter().map(told).collect();
    let pdf = |at: DVec2| {
        let w = direction(at.x, at.y);
        let w = w.with_z(w.z.copysign(wo.z.into())).as_vec3();
        f64::from(shader.pdf(uv, w, wo))
    };
    let mut counts = Vec::new();
    let mut integral = Integral::default();
    let whole = Cell { low: DVec2::ZERO, high: DVec2::new(1.0, TAU) };
    split(whole, &mut pilot, &mut draws, 6, &mut |cell, pilot, draws| {
        let mut share = Integral::default();
        split(cell, pilot, &mut [], 1, &mut |part, pilot, _| {
            share.add(part.integral(&pdf, pilot, &mut random));
        });
        counts.push(Count::new(draws.len(), share));
        integral.add(share);
    });
    let accepted = samples.len() as f64 / DRAWS as f64;
    let rejected = Integral { value: (1.0 - integral.value).max(0.0), ..integral };
    counts.push(Count::new(DRAWS - samples.len(), rejected));
    let weights = || samples.iter().map(|sample| sample.weight.as_dvec3());
    let mean = weights().sum::<DVec3>() / DRAWS as f64;
    let square = weights().map(|weight| weight * weight).sum::<DVec3>() / DRAWS as f64;
    Outcome {
        p_value: pearson(&counts),
        accepted,
        integral,
        greatest_weight: samples.iter().map(|s| s.weight.max_element()).fold(0.0, f32::max),
        mean,
        error: ((square - mean * mean) / DRAWS as f64).map(f64::sqrt),
        // The quadrature knows neither irregularities nor the back.
        albedo: (wo.z > 0.0 && case.yarn.noise == Noise::default())
            .then(|| shader.albedo_at(uv, wo.as_dvec3())),
        description: case.to_string(),
    }
}

/// Draws found in a cell, and how many were expected with which variance.
#[derive(Clone, Copy, Debug)]
struct Count {
    found: f64,
    expected: f64,
    variance: f64,
}

impl Count {
    fn new(found: usize, share: Integral) -> Self {
        let draws = DRAWS as f64;
        let expected = draws * share.value;
        Self { found: found as f64, expected, variance: expected + draws * draws * share.variance }
    }

    fn and(self, other: Self) -> Self {
        Self {
            found: self.found + other.found,
            expected: self.expected + other.expected,
            variance: self.variance + other.variance,
        }
    }
}

/// The chance of counts at least as far from the expected ones, by Pearson's χ² with the cells that
/// expect fewer than 5 in one.
fn pearson(counts: &[Count]) -> f64 {
    let (mut pooled, small): (Vec<Count>, Vec<Count>) =
        counts.iter().partition(|count| count.expected >= 5.0);
    if let Some(rest) = small.into_iter().reduce(Count::and) {
        // A pool that is still small joins one of the others.
        match pooled.last_mut().filter(|_| rest.expected < 5.0) {
            Some(last) => *last = last.and(rest),
            None => pooled.push(rest),
        }
    }
    let statistic: f64 =
        pooled.iter().map(|count| (count.found - count.expected).powi(2) / count.variance).sum();
    let (a, x) = (0.5 * (pooled.len() as f64 - 1.0), 0.5 * statistic);
    // At most Chernoff's bound, since far from what is expected the function is no longer to be trusted.
    let bound = if x > a && a > 0.0 { (a - x + a * (x / a).ln()).exp() } else { 1.0 };
    pxfm::f_gamma_q(a, x).min(bound)
}

#[test]
fn samples_follow_the_density_and_weigh_the_albedo() {
    assert!(CASES.len() >= 200, "{}", CASES.len());
    let outcomes: Vec<Outcome> =
        CASES.par_iter().enumerate().map(|(i, case)| outcome(case, i as u64)).collect();
    // Šidák: as unlikely as 1 % over all cases together.
    let level = 1.0 - 0.99f64.powf(1.0 / CASES.len() as f64);
    let mut failures = Vec::new();
    let (mut p_sum, mut z_sum) = (0.0, 0.0);
    for outcome in &outcomes {
        let &Outcome { p_value, accepted, integral, mean, error, ref description, .. } = outcome;
        if p_value < level {
            failures.push(format!("p {p_value:.1e}, expected {level:.1e}: {description}"));
        }
        let integral_error = integral.variance.sqrt();
        let difference = (integral.value - accepted).abs();
        let deviation = (accepted * (1.0 - accepted) / DRAWS as f64 + integral.variance).sqrt();
        p_sum += p_value;
        z_sum += (integral.value - accepted) / deviation.max(1e-6);
        if integral.value > 1.0 + 5.0 * integral_error + 1e-3 || difference > 5.0 * deviation + 1e-3
        {
            let integral = integral.value;
            failures.push(format!(
                "∫pdf {integral} ± {integral_error}, accepted {accepted}: {description}"
            ));
        }
        if let Some(albedo) = outcome.albedo {
            // The quadrature is good to 10⁻³ of what may be brighter than 1.
            let tolerance = 5.0 * error + 2e-3 * albedo.max(DVec3::ONE);
            if (mean - albedo).abs().cmpgt(tolerance).any() {
                failures.push(format!("mean {mean} ± {error}, albedo {albedo}: {description}"));
            }
        }
        if outcome.greatest_weight > 20.0 {
            let weight = outcome.greatest_weight;
            failures.push(format!("weight {weight} where the mean is {mean}: {description}"));
        }
    }
    // What is wrong by less than one case can tell is seen in all together: the mean of even numbers
    // in [0, 1) and that of normal ones.
    let (p_mean, z_mean) = (p_sum / CASES.len() as f64, z_sum / CASES.len() as f64);
    let spread = 1.0 / (CASES.len() as f64).sqrt();
    if (p_mean - 0.5).abs() > 4.0 * spread / 12f64.sqrt() || z_mean.abs() > 3.0 * spread {
        failures.push(format!("mean p {p_mean}, mean deviation of ∫pdf {z_mean}, ± {spread}"));
    }
    println!("mean p {p_mean:.3}, mean deviation of ∫pdf {z_mean:.3} ± {spread:.3}");
    let least = outcomes.iter().map(|o| o.p_value).fold(1.0, f64::min);
    let greatest = outcomes.iter().map(|o| o.greatest_weight).fold(0.0, f32::max);
    let compared = outcomes.iter().filter(|o| o.albedo.is_some()).count();
    println!(
        "{} cases, least p {least:.1e} (level {level:.1e}), greatest weight {greatest}, \
         {compared} means against the albedo",
        CASES.len()
    );
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn weight_is_f_cos_over_pdf_and_nothing_is_drawn_below_the_surface() {
    let greatest = CASES
        .par_iter()
        .enumerate()
        .map(|(i, case)| {
            let Case { shader, uv, wo, .. } = case;
            let (uv, wo) = (*uv, *wo);
            let mut random = Random(i as u64);
            let mut greatest = 0.0f32;
            for _ in 0..10_000 {
                let xi = random.xi();
                let Some(Sample { wi, weight, pdf }) = shader.sample(uv, wo, xi) else { continue };
                assert!(wi.z * wo.z > 0.0, "{xi:?} gave {wi}: {case}");
                assert!((wi.length() - 1.0).abs() < 1e-6, "{xi:?} gave {wi}: {case}");
                assert!(pdf > 0.0 && pdf == shader.pdf(uv, wi, wo), "{xi:?}, pdf {pdf}: {case}");
                let expected = shader.eval(uv, wi, wo) * wi.z.abs() / pdf;
                let error = (weight - expected).abs().max_element();
                let tolerance = 1e-4 * expected.max_element();
                assert!(error <= tolerance, "{xi:?}: weight {weight}, expected {expected}: {case}");
                greatest = greatest.max(error / expected.max_element().max(1e-30));
            }
            greatest
        })
        .reduce(|| 0.0, f32::max);
    println!("weights within {greatest:.1e}");
}

#[test]
fn every_number_is_a_safe_argument() {
    let below_one = 1.0 - 0.5 * f32::EPSILON;
    let numbers = [0.0, f32::MIN_POSITIVE, 0.5, below_one, 1.0, -1.0, f32::NAN, f32::INFINITY];
    let bad = [f64::NAN, f64::INFINITY, -1e300];
    let uvs = bad.iter().flat_map(|&u| [DVec2::new(u, 0.0), DVec2::new(1e-3, u)]);
    let uvs: Vec<DVec2> = uvs.collect();
    let wos = [
        Vec3::NAN,
        Vec3::ZERO,
        Vec3::X,
        Vec3::INFINITY,
        Vec3::new(1.0, 0.0, f32::MIN_POSITIVE),
        Vec3::new(0.0, 1.0, -1e-40),
        Vec3::Z,
        -Vec3::Z,
    ];
    CASES.par_iter().for_each(|case| {
        let Case { shader, uv, wo, .. } = case;
        let check = |uv: DVec2, wo: Vec3, xi: [f32; 3]| {
            if let Some(Sample { wi, weight, pdf }) = shader.sample(uv, wo, xi) {
                let is_above = wi.z != 0.0 && (wi.z > 0.0) == (wo.z > 0.0);
                let is_sound = is_above && wi.is_finite() && weight.is_finite();
                let is_sound = is_sound && weight.min_element() >= 0.0 && pdf > 0.0;
                let is_sound = is_sound && pdf.is_finite();
                assert!(is_sound, "{uv} {wo} {xi:?}: {wi} {weight} {pdf}: {case}");
            }
        };
        for a in numbers {
            for b in numbers {
                for c in numbers {
                    check(*uv, *wo, [a, b, c]);
                    for &wo in &wos {
                        check(*uv, wo, [a, b, c]);
                    }
                }
                for &uv in &uvs {
                    check(uv, *wo, [a, b, 0.5]);
                }
            }
        }
        for &wi in &wos {
            for &wo in &wos {
                for &uv in uvs.iter().chain([uv]) {
                    let pdf = shader.pdf(uv, wi, wo);
                    assert!(pdf >= 0.0 && pdf.is_finite(), "{uv} {wi} {wo}: {pdf}: {case}");
                }
            }
        }
        for &uv in &uvs {
            if !uv.is_finite() {
                assert_eq!(shader.sample(uv, *wo, [0.5; 3]), None, "{uv}: {case}");
                assert_eq!(shader.pdf(uv, *wo, *wo), 0.0, "{uv}: {case}");
            }
        }
        assert_eq!(shader.sample(*uv, Vec3::NAN, [0.5; 3]), None, "{case}");
        assert_eq!(shader.sample(*uv, Vec3::X, [0.5; 3]), None, "{case}");
    });
}

#[test]
fn tabulated_albedo_bounds_that_of_the_segment_closely() {
    let differences: Vec<f64> = CASES
        .par_iter()
        .filter(|case| case.wo.z > 0.0 && case.yarn.noise == Noise::default())
        .filter(|case| case.yarn.diffuse == Diffuse::Flat && case.yarn.specular_uniform.is_none())
        .map(|case| {
            let Case { shader, uv, wo, .. } = case;
            let found = shader.albedo(*uv, *wo).as_dvec3();
            let expected = shader.albedo_of_segment(*uv, wo.as_dvec3());
            let difference = found - expected;
            assert!(
                difference.min_element() > -3e-3 && difference.max_element() < 0.03,
                "{found}, expected {expected} to 0.03 more: {case}"
            );
            difference.max_element()
        })
        .collect();
    let greatest = differences.iter().copied().fold(0.0, f64::max);
    println!("{} albedos at most {greatest:.4} above the yardstick", differences.len());
}
