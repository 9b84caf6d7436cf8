//! Yarns, directions and positions at the limits of what they may be, and bounds of what a yarn
//! reflects.

#![allow(dead_code, reason = "not every user needs all of it")]

use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{
    Cloth, Combination, Diffuse, FILAMENT_U_MAX, Highlight, Mapping, Mode, Noise, Phase,
    PhaseTable, Shader, Yarn,
};

use super::support::{PITCH, Random, cloth, direction};

/// Any of a list.
pub(crate) fn any<T: Copy>(random: &mut Random, list: &[T]) -> T {
    list[(random.number() * list.len() as f64) as usize]
}

/// One of `limits` mostly, else a number between the first and the last.
fn at_limits(random: &mut Random, limits: &[f64]) -> f64 {
    if random.number() < 0.7 {
        any(random, limits)
    } else {
        let (low, high) = (limits[0], limits[limits.len() - 1]);
        random.between(low, high)
    }
}

/// A yarn with every parameter at or near a limit.
pub(crate) fn yarn(random: &mut Random) -> Yarn {
    let highlight = if random.number() < 0.4 {
        Highlight::Rough { sigma: at_limits(random, &[0.005, 0.0051, 0.02, 0.99, 1.0]) }
    } else {
        Highlight::Window { delta: at_limits(random, &[0.001, 0.0011, 0.01, 0.999, 1.0]) }
    };
    let alpha = at_limits(random, &[0.0, 1e-12, 0.5, 1.0]);
    let beta = at_limits(random, &[0.0, 1e-12, 1e-3, 88.0, 90.0, 710.0, 1e4, 1e6]);
    let phase = match (random.number() * 5.0) as u32 {
        0 | 1 => Phase::VonMises { alpha, beta },
        2 => Phase::VonMises3d { alpha, beta },
        3 => Phase::WrappedCauchy {
            rho: at_limits(random, &[0.0, 1e-12, 0.5, 0.9989, 0.999, 1.0 - 1e-12, 1.0]),
            is_backward: random.number() < 0.5,
        },
        _ => {
            let tables: [&[f64]; 4] =
                [&[0.0, 1.0], &[1.0, 0.0], &[0.0, 0.0, 1e300, 0.0, 0.0], &[1e-300, 2e-300]];
            Phase::Tabulated(PhaseTable::new(any(random, &tables)).expect("one is above 0"))
        }
    };
    let half_pi = [-FRAC_PI_2, -FRAC_PI_2 + 1e-9, -0.5, -0.030001, -0.03, -1e-300];
    let mut twists: Vec<f64> = half_pi.to_vec();
    twists.push(0.0);
    twists.extend(half_pi.iter().rev().map(|psi| -psi));
    let mut color = || [(); 3].map(|()| any(random, &[0.0, 1e-38, 0.5, 1.0]));
    let (color, specular, uniform) = (color(), color(), color());
    let noise = Noise {
        intensity: any(random, &[0.0, 1e-9, 1.0]),
        fineness: at_limits(random, &[1.0, 64.0]),
        u_max: any(random, &[0.0, 0.0, 1e-9, 0.5]),
        width: any(random, &[0.0, 0.5]),
        offset: any(random, &[0.0, 0.25]),
        wavelength: at_limits(random, &[1e-4, 1.0]),
        slub_rate: at_limits(random, &[0.0, 1e-9, 200.0]),
        slub_length: at_limits(random, &[1e-4, 0.1]),
        slub_height: at_limits(random, &[0.0, 2.0]),
        color: any(random, &[0.0, 1.0]),
    };
    Yarn {
        color,
        specular,
        specular_uniform: (random.number() < 0.2).then_some(uniform),
        opacity: at_limits(random, &[0.0, 1e-12, 1.0]),
        diffuse: any(random, &[Diffuse::Flat, Diffuse::Flat, Diffuse::YarnNormal]),
        u_max: at_limits(random, &[0.0, 1e-300, 1e-12, 1e-6, 1e-3, 0.05, 1.4999, 1.5]),
        psi: at_limits(random, &twists),
        kappa: at_limits(random, &[-0.999, -0.99, -1e-9, 0.0, 1e-9, 10.0, 999.0, 1e3]),
        smoothing: at_limits(random, &[0.0, 1e-9, 0.949, 0.95]),
        highlight,
        phase,
        size: at_limits(random, &[0.01, 0.0101, 0.5, 0.999_999, 1.0]),
        noise: if random.number() < 0.4 { noise } else { Noise::default() },
    }
}

/// A cloth of such a yarn, which may have gaps, slits, threads that are never covered, cells that are
/// anything but square, and segments too short for their yarn.
pub(crate) fn extreme_cloth(random: &mut Random) -> Cloth {
    let yarn = yarn(random);
    let mut cloth = cloth(&yarn, any(random, &[1, 2, 5]));
    cloth.mapping = any(random, &[Mapping::Arcsine, Mapping::Linear]);
    cloth.normalization = any(random, &[Mode::Segment, Mode::Segment, Mode::Pointwise, Mode::None]);
    cloth.combination = any(random, &[Combination::Layered, Combination::Lerp]);
    cloth.rotation = any(random, &[0.0, 0.0, 1.0, TAU, -TAU]);
    cloth.scale = any(random, &[1.0, 1.0, 1e-3, 1e3]);
    cloth.pitch *= any(random, &[DVec2::ONE, DVec2::ONE, DVec2::new(1.0, 0.2)]);
    // The factors of straight pieces and of those too short for their yarn are not told.
    if !(is_whole(&cloth) && cloth.pitch.x == cloth.pitch.y) && random.number() < 0.7 {
        cloth.normalization = Mode::None;
    }
    cloth
}

/// A unit direction: anywhere, grazing, along an axis, or all but in the surface; of either side.
pub(crate) fn extreme_direction(random: &mut Random) -> Vec3 {
    let z = any(random, &[1.0, 0.7, 1e-2, 1e-4, 1e-7, 1e-12, 1e-30, 1e-38, 1e-45]);
    let z = if random.number() < 0.4 { random.number() } else { z };
    let quarter = (random.number() * 4.0).floor() * FRAC_PI_2;
    let phi = if random.number() < 0.3 { quarter } else { TAU * random.number() };
    let w = direction(z, phi).as_vec3();
    let w = match (random.number() * 20.0) as u32 {
        // What is small is 0 or denormal.
        0 => w.map(|x| if x.abs() < 1e-6 { 0.0 } else { x }),
        1 => w.map(|x| if x.abs() < 1e-6 { 1e-42f32.copysign(x) } else { x }),
        _ => w,
    };
    if random.number() < 0.2 { w * Vec3::new(1.0, 1.0, -1.0) } else { w }
}

/// A pair of directions: any two, or one the same as, the mirror image of, or opposite to the other,
/// above the surface or on the line through it.
pub(crate) fn extreme_pair(random: &mut Random) -> [Vec3; 2] {
    let wi = extreme_direction(random);
    let wo = match (random.number() * 8.0) as u32 {
        0 => wi,
        1 => Vec3::new(-wi.x, -wi.y, wi.z),
        2 => -wi,
        3 => (wi + 1e-6 * extreme_direction(random)).normalize(),
        _ => {
            let wo = extreme_direction(random);
            // On one side mostly, where there is something to see.
            if random.number() < 0.9 { wo.with_z(wo.z.copysign(wi.z)) } else { wo }
        }
    };
    [wi, wo]
}

/// A position, m: near the origin, on the edges of cells, denormal, or up to 10⁹ repeats away.
pub(crate) fn extreme_position(random: &mut Random, cloth: &Cloth) -> DVec2 {
    let repeat = cloth.size() / cloth.scale;
    let far: f64 = any(random, &[0.0, 0.0, 1.0, -1.0, 1e6, -1e6, 1e9, -1e9]);
    let near = match (random.number() * 10.0) as u32 {
        0 | 1 => DVec2::new((2.0 * random.number()).round(), random.number()),
        2 => any(random, &[0.0, -0.0, 1e-310, -1e-310, -1e-17]) * DVec2::new(1.0, random.number()),
        _ => DVec2::new(random.number(), random.number()),
    };
    repeat * (near + far)
}

/// A number that no position or direction should have.
fn invalid(random: &mut Random) -> f64 {
    any(random, &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY])
}

/// A direction one of whose components is not finite.
pub(crate) fn invalid_direction(random: &mut Random) -> Vec3 {
    let mut w = extreme_direction(random);
    w[(random.number() * 3.0) as usize] = invalid(random) as f32;
    w
}

/// A position one of whose coordinates is not finite.
pub(crate) fn invalid_position(random: &mut Random) -> DVec2 {
    let mut uv = DVec2::new(random.number(), random.number()) * PITCH;
    uv[(random.number() * 2.0) as usize] = invalid(random);
    uv
}

/// Whether the threads of a cloth touch everywhere.
fn is_whole(cloth: &Cloth) -> bool {
    let Yarn { size, noise, .. } = cloth.yarns[0];
    let has_slubs = noise.slub_rate > 0.0 && noise.slub_height > 0.0;
    size == 1.0 && noise.width == 0.0 && noise.offset == 0.0 && !has_slubs
}

/// The greatest values that a cloth of one kind of yarn may have, in exact arithmetic.
///
/// Area. The spine's S is at most its value at the middle or at the ends. With r = sin u_e + κ (sin u_e +
/// cos u_e), 1 + c = cos² u_e + r|r|. For κ ≥ 0, r ≥ sin u_e, so that c ≥ 0 and S ≤ √(1 + c), where r ≤
/// 1 + 2κ. For κ < 0, r ≤ sin u_e, so that c ≤ 0 and S ≤ 1/(1 + c), where r ≥ κ cos u_e:
///
/// ```text
/// S ≤ √(1 + (1 + 2κ)²)  for κ ≥ 0,        S ≤ 1/((1 − κ²) cos² u_e)  for κ < 0
/// ```
///
/// and `S − (w/l) sin u_e (S − cos v)`, a mean of S and cos v for (w/l) sin u_e ≤ 1, is at most that or 1.
///
/// Twisted, under a window. `pq/(p+q)² ≤ 1/4`, so with D = 1/cos u_max for the arcsine map and
/// u_max/sin u_max for the linear one
///
/// ```text
/// f ≤ D S f_c,max / (8 δ |sin ψ|)
/// ```
///
/// Untwisted, under a window. `pq/(p+q) ≤ (p+q)/4`, and p + q = n·H with n = (sin v, cos v (sin u, cos u)) at
/// the u of H = wi + wo is H_x sin v + m cos v ≤ 2 + m, where m ≥ H_z. With D = 10⁴ or π/2
///
/// ```text
/// f ≤ D S f_c,max / (2 δ sin u_e) · (1 + 2/(cos θi + cos θo)) / 4
/// ```
///
/// Rough. I₀e ≤ 1 and the exponential of M is at most 1, and `pq/(p+q) ≤ 1/2` as p and q are at most 1. With
/// the D of both directions
///
/// ```text
/// f ≤ D_u D_v S f_c,max / (σ² (1 − e^{−2/σ²})) / 2
/// ```
///
/// Each of them times the factor, and 1 + 9 times the noise of the intensity, which is at most 10.
///
/// Diffuse. What a highlight leaves is at most 1, and is divided by at least 10⁻³; colours stay within 1.
/// By the yarn's normal nothing is
/// divided, and its scale is at most 6: straight on, the mean albedo of `(n·wi)(n·wo)/π` is that of
/// n_z times at least 2/3π + 0.45 n_z, and the means of n_z and n_z² are at least 0.42 and 0.26.
///
/// Weight. Where there are two lobes, at least a tenth of the samples are of the cosine, so the density
/// is at least cos θ/10π and f cos θ over it at most 10π f.
///
/// Albedo. Normalised, each lobe reflects at most all, and the diffuse by the yarn's normal at a point 6
/// times that. Not normalised, the mean over a segment of `∫ f_c pq/(p+q) cos θi dφ ≤ 2π f_c,max` times
/// S over angles π by 2 u_max,
///
/// ```text
/// E ≤ π u_max S / (2 sin u_e) · 2π f_c,max
/// ```
///
/// and the table lies above that by a hundredth or two of its greatest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// Of the highlight, sr⁻¹; for untwisted fibres under a window less the part that depends on the
    /// directions.
    highlight: f64,
    is_filament: bool,
    pub(crate) diffuse: f64,
    pub(crate) albedo: f64,
}

impl Bounds {
    pub(crate) fn new(cloth: &Cloth, shader: &Shader) -> Self {
        let yarn = &cloth.yarns[0];
        let is_filament = yarn.is_filament();
        let steepest = (yarn.u_max + yarn.noise.u_max).min(1.5);
        let steepest = steepest.max(if is_filament { FILAMENT_U_MAX } else { 1e-6 });
        // Noise and short segments may make a yarn flatter; what falls with u_max has its value there.
        let start = ((1.0 - yarn.smoothing) * FILAMENT_U_MAX).sin();
        let (along, across) = match cloth.mapping {
            Mapping::Arcsine => (1.0 / steepest.cos(), 1e4),
            Mapping::Linear => (steepest / steepest.sin(), FRAC_PI_2),
        };
        let kappa = yarn.kappa;
        let bend = if kappa >= 0.0 {
            (1.0 + (1.0 + 2.0 * kappa).powi(2)).sqrt()
        } else {
            1.0 / ((1.0 - kappa * kappa) * steepest.cos().powi(2))
        };
        let shape = match yarn.highlight {
            Highlight::Rough { sigma } => {
                let variance = sigma * sigma;
                0.5 * along * across / (variance * -(-2.0 / variance).exp_m1())
            }
            Highlight::Window { delta } if is_filament => across / (8.0 * delta * start),
            Highlight::Window { delta } => along / (8.0 * delta * yarn.psi.sin().abs()),
        };
        let factor = match cloth.normalization {
            Mode::None => 1.0,
            _ if is_whole(cloth) && cloth.pitch.x == cloth.pitch.y => greatest_factor(shader),
            _ => f64::INFINITY,
        };
        let phase = greatest_phase(&yarn.phase);
        let is_flat = yarn.diffuse == Diffuse::Flat;
        let end = if is_filament { 1.0 - yarn.smoothing } else { 1.0 };
        let unnormalised = PI * PI * bend * phase * steepest / (end * steepest).sin();
        Self {
            highlight: shape * bend * phase * (1.0 + 9.0 * yarn.noise.intensity) * factor,
            is_filament,
            diffuse: if is_flat { 1e3 } else { 6.0 } * FRAC_1_PI,
            albedo: if is_flat { 1.0 } else { 6.0 }
                + if cloth.normalization == Mode::None { 1.1 * unnormalised + 0.01 } else { 1.0 },
        }
    }

    pub(crate) fn highlight(&self, wi: Vec3, wo: Vec3) -> f64 {
        let cosines = f64::from(wi.z.abs()) + f64::from(wo.z.abs());
        self.highlight * if self.is_filament { 1.0 + 2.0 / cosines } else { 1.0 }
    }
}

/// The greatest value of a phase function, rad⁻¹.
fn greatest_phase(phase: &Phase) -> f64 {
    // 1/I₀e(β) ≤ √(2πβ) + 1 (Abramowitz & Stegun 1964, 9.7.1, with what it lacks for small β).
    let peak = |beta: f64| ((2.0 * PI * beta).sqrt() + 1.0) / TAU;
    match phase {
        Phase::VonMises { alpha, beta } => alpha / TAU + (1.0 - alpha) * peak(*beta),
        Phase::VonMises3d { alpha, beta } => alpha + peak(*beta),
        Phase::WrappedCauchy { rho, .. } => {
            let rho = rho.min(0.999);
            (1.0 + rho) / (1.0 - rho) / TAU
        }
        // The samples of a table are densities.
        Phase::Tabulated(table) => Vec::<f64>::from(table.clone()).into_iter().fold(0.0, f64::max),
        _ => f64::INFINITY,
    }
}

/// A bound of the factor for every shape: 1/factor at w/l is at least the mean, in proportion, of what the
/// albedos that are greatest at either end are there, and these are at least 0.
fn greatest_factor(shader: &Shader) -> f64 {
    let ends = shader.normalization(0).expect("every cloth has a yarn");
    ends.iter().map(|end| end.factor).sum()
}

/// What was found of many values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    /// Calls of a function of the shader, and those of them whose values have a bound.
    pub(crate) calls: u64,
    pub(crate) bounded: u64,
    pub(crate) nan: u64,
    pub(crate) infinite: u64,
    pub(crate) negative: u64,
    pub(crate) above: u64,
    /// Other values that they should not have.
    pub(crate) wrong: u64,
    /// The greatest value as a share of its bound, and what it belongs to.
    pub(crate) greatest: (f64, String),
    /// The first faults.
    pub(crate) examples: Vec<String>,
}

impl Tally {
    pub(crate) fn faults(&self) -> u64 {
        self.nan + self.infinite + self.negative + self.above + self.wrong
    }

    pub(crate) fn merged(mut self, other: Self) -> Self {
        self.calls += other.calls;
        self.bounded += other.bounded;
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
        self.above += other.above;
        self.wrong += other.wrong;
        if other.greatest.0 > self.greatest.0 {
            self.greatest = other.greatest;
        }
        self.examples.extend(other.examples);
        self.examples.truncate(10);
        self
    }

    /// Takes in the `value` of one call, which may be at most `most`; `what` describes it.
    fn check(&mut self, value: [f64; 3], most: f64, what: impl Fn() -> String) {
        self.calls += 1;
        self.bounded += u64::from(most.is_finite());
        let greatest = value.into_iter().fold(0.0, f64::max);
        let fault = if value.iter().any(|x| x.is_nan()) {
            &mut self.nan
        } else if value.iter().any(|x| x.is_infinite()) {
            &mut self.infinite
        } else if value.iter().any(|&x| x < 0.0) {
            &mut self.negative
        // Rounding in f32.
        } else if greatest > most * 1.001 {
            &mut self.above
        } else {
            if greatest > self.greatest.0 * most {
                self.greatest = (greatest / most, format!("{value:?} of {most}: {}", what()));
            }
            return;
        };
        *fault += 1;
        if self.examples.len() < 10 {
            self.examples.push(format!("{value:?}, expected 0 to {most}: {}", what()));
        }
    }

    /// Takes in whether something holds.
    fn expect(&mut self, holds: bool, what: impl Fn() -> String) {
        if !holds {
            self.wrong += 1;
            if self.examples.len() < 10 {
                self.examples.push(what());
            }
        }
    }
}

/// What `count` positions and pairs of directions show of the values of a cloth, eight calls for each.
pub(crate) fn examine(random: &mut Random, cloth: &Cloth, shader: &Shader, count: u64) -> Tally {
    let bounds = Bounds::new(cloth, shader);
    let all = |x: f32| [f64::from(x); 3];
    let rgb = |x: Vec3| x.as_dvec3().to_array();
    let mut tally = Tally::default();
    for _ in 0..count {
        let uv = extreme_position(random, cloth);
        let [wi, wo] = extreme_pair(random);
        let xi = random.xi().map(|x| any(random, &[x, x, x, 0.0, 1.0 - f32::EPSILON / 2.0, 1.0]));
        let what = |name: &str| {
            format!(
                "{name} at {uv:?} for wi {wi:?}, wo {wo:?}, ξ {xi:?}, {:?} {:?} {:?}, {:?}",
                cloth.mapping, cloth.normalization, cloth.combination, cloth.yarns[0]
            )
        };
        let most = bounds.highlight(wi, wo);
        let lobes = shader.eval_lobes(uv, wi, wo);
        tally.check(rgb(lobes.specular), most, || what("highlight"));
        tally.expect(
            rgb(lobes.diffuse).iter().all(|x| (0.0..=bounds.diffuse * 1.001).contains(x)),
            || format!("{lobes:?}, diffuse at most {}: {}", bounds.diffuse, what("diffuse")),
        );
        let f = shader.eval(uv, wi, wo);
        tally.check(rgb(f), most + bounds.diffuse, || what("eval"));
        tally.expect(f == lobes.specular + lobes.diffuse, || {
            format!("{f}, expected the sum of {lobes:?}: {}", what("eval"))
        });
        let reference = shader.eval_reference(uv, wi.as_dvec3(), wo.as_dvec3());
        tally.check(reference.to_array(), most + bounds.diffuse, || what("eval_reference"));
        tally.check(all(shader.pdf(uv, wi, wo)), f64::INFINITY, || what("pdf"));
        match shader.sample(uv, wo, xi) {
            None => tally.calls += 1,
            Some(sample) => {
                let most = 10.0 * PI * (bounds.highlight(sample.wi, wo) + bounds.diffuse);
                tally.check(rgb(sample.weight), most, || what("weight"));
                let is_valid = sample.wi.is_normalized()
                    && (sample.wi.z > 0.0) == (wo.z > 0.0)
                    && sample.wi.z != 0.0
                    && sample.pdf.is_finite()
                    && sample.pdf > 0.0;
                tally.expect(is_valid, || format!("{sample:?}: {}", what("sample")));
            }
        }
        tally.check(rgb(shader.albedo(uv, wo)), bounds.albedo, || what("albedo"));
        let opacity = shader.opacity(uv);
        tally.expect((0.0..=1.0).contains(&opacity), || format!("{opacity}: {}", what("opacity")));
        tally.calls += 2;
        if let Some(point) = shader.yarn_at(uv) {
            let is_valid = point.normal.is_normalized()
                && point.tangent.is_normalized()
                && point.normal.dot(point.tangent).abs() < 1e-9
                && point.normal.z >= -1e-9
                && point.u.abs() <= 1.5 + 1e-12
                && point.v.abs() <= FRAC_PI_2
                && point.segment.x.abs() <= 1.0
                && point.segment.y.abs() <= 1.0;
            tally.expect(is_valid, || format!("{point:?}: {}", what("yarn_at")));
        }
    }
    tally
}

/// What a shader says where a position or direction is no number: nothing.
pub(crate) fn examine_invalid(random: &mut Random, shader: &Shader) -> Tally {
    let (uv, wi, wo) =
        (DVec2::splat(0.3 * PITCH), extreme_direction(random), extreme_direction(random));
    let (bad_uv, bad) = (invalid_position(random), invalid_direction(random));
    let bad_xi = [(); 3].map(|()| any(random, &[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.5]));
    let mut tally = Tally::default();
    let values = [
        shader.eval(bad_uv, wi, wo),
        shader.eval(uv, bad, wo),
        shader.eval(uv, wi, bad),
        shader.eval_lobes(uv, bad, bad).specular,
        shader.eval_lobes(bad_uv, wi, wo).diffuse,
        shader.eval_reference(bad_uv, wi.as_dvec3(), wo.as_dvec3()).as_vec3(),
        shader.eval_reference(uv, bad.as_dvec3(), wo.as_dvec3()).as_vec3(),
        shader.eval_reference(uv, wi.as_dvec3(), bad.as_dvec3()).as_vec3(),
        shader.albedo(bad_uv, wo),
        shader.albedo(uv, bad),
        shader.albedo_at(bad_uv, wo.as_dvec3()).as_vec3(),
        shader.albedo_of_segment(uv, bad.as_dvec3()).as_vec3(),
        Vec3::splat(shader.pdf(bad_uv, wi, wo)),
        Vec3::splat(shader.pdf(uv, bad, wo)),
        Vec3::splat(shader.pdf(uv, wi, bad)),
    ];
    let what = || format!("for {uv} or {bad_uv}, {wi}, {wo} or {bad}, ξ {bad_xi:?}");
    for (place, value) in values.into_iter().enumerate() {
        tally.calls += 1;
        tally.expect(value == Vec3::ZERO, || {
            format!("value {place}: {value}, expected 0 {}", what())
        });
    }
    let samples = [shader.sample(bad_uv, wo, [0.5; 3]), shader.sample(uv, bad, [0.5; 3])];
    tally.expect(samples == [None; 2], || format!("{samples:?}, expected none {}", what()));
    let sample = shader.sample(uv, wo, bad_xi);
    let is_finite =
        sample.is_none_or(|s| s.wi.is_finite() && s.pdf.is_finite() && s.weight.is_finite());
    tally.expect(is_finite, || format!("{sample:?}, expected finite {}", what()));
    let opacity = shader.opacity(bad_uv);
    let is_valid = (0.0..=1.0).contains(&opacity) && shader.yarn_at(bad_uv).is_none();
    tally.expect(is_valid, || format!("opacity {opacity} or a yarn {}", what()));
    tally.calls += 5;
    tally
}
