//! Yarns, directions and positions at the limits of what they may be, and bounds of what a yarn
//! reflects.

#![allow(dead_code, reason = "not every user needs all of it")]

use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use selvedge_yarn_brdf::glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{
    Cloth, Combination, Diffuse, FILAMENT_U_MAX, Highlight, Mapping, Mode, Noise, Phase, PhaseTable,
    Shader, Yarn,
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
    cloth
}

/// A unit direction: anywhere, grazing, along an axis, or all but in the surface; of either side.
pub(crate) fn extreme_direction(random: &mut Random) -> Vec3 {
    let z = any(random, &[1.0, 0.7, 1e-2, 1e-4, 1e-7, 1e-12, 1e-30, 1e-38, 1e-45]);
    let z = if random.number() < 0.4 { random.number() } else { z };
    let quarter = (random.number() * 4.0).floor() * FRAC_PI_2;
    let phi = if random.number() < 0.3 { quarter } else { TAU * random.number() };
    let w = direction(z, phi).as_vec3();
    if random.number() < 0.2 { w * Vec3::new(1.0, 1.0, -1.0) } else { w }
}

/// A pair of directions: any two, or one the same as, the mirror image of, or opposite to the other.
pub(crate) fn extreme_pair(random: &mut Random) -> [Vec3; 2] {
    let wi = extreme_direction(random);
    let wo = match (random.number() * 8.0) as u32 {
        0 => wi,
        1 => Vec3::new(-wi.x, -wi.y, wi.z),
        2 => -wi,
        3 => (wi + 1e-6 * extreme_direction(random)).normalize(),
        _ => extreme_direction(random),
    };
    [wi, wo]
}

/// A position, m: near the origin, on the edges of cells, or very far.
pub(crate) fn extreme_position(random: &mut Random, cloth: &Cloth) -> DVec2 {
    let repeat = cloth.size() / cloth.scale;
    let far = any(random, &[0.0, 0.0, 1.0, -1.0, 1e6, -1e6, 1e9, -1e9]);
    let near = if random.number() < 0.2 {
        DVec2::new((2.0 * random.number()).round(), random.number())
    } else {
        DVec2::new(random.number(), random.number())
    };
    repeat * (near + far.trunc())
}

/// A number that no position or direction should have, or hardly.
pub(crate) fn invalid(random: &mut Random) -> f64 {
    any(random, &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY])
}

/// The greatest that the two lobes of a cloth of one kind of yarn may be for a pair of directions on
/// one side, sr⁻¹, in exact arithmetic; `factor` bounds the factor of equation 2.
///
/// Area. The spine's S is at most its value at the middle or at the ends. With r = sin u_e + κ (sin u_e +
/// cos u_e), 1 + c = cos² u_e + r|r| is at most 1 + (1 + 2κ)² for κ ≥ 0 and 1 below; it is at least 1 for
/// κ ≥ 0, and for κ < 0 at least (1 − κ²) cos² u_e, since r ≥ κ cos u_e. So S is at most
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
/// The diffuse is at most 1/π, 6/π by the yarn's normal (whose mean of (n·wi)(n·wo) is at least 1/6 straight
/// on), and 10³ times that under a highlight that leaves nothing.
pub(crate) fn bounds(yarn: &Yarn, mapping: Mapping, factor: f64, pair: [Vec3; 2]) -> [f64; 2] {
    let is_filament = yarn.is_filament();
    let steepest = (yarn.u_max + yarn.noise.u_max).min(1.5);
    let steepest = if is_filament { steepest.max(FILAMENT_U_MAX) } else { steepest };
    // Noise and short segments may make a yarn flatter; what falls with u_max has its value there.
    let flattest = if is_filament { FILAMENT_U_MAX } else { 0.0 };
    let over_sin = |u: f64| if u < 1e-6 { 1.0 } else { u / u.sin() };
    let (along, across) = match mapping {
        Mapping::Arcsine => (1.0 / steepest.cos(), 1e4),
        Mapping::Linear => (over_sin(steepest), FRAC_PI_2),
    };
    let kappa = yarn.kappa;
    let bend = if kappa >= 0.0 {
        (1.0 + (1.0 + 2.0 * kappa).powi(2)).sqrt()
    } else {
        1.0 / ((1.0 - kappa * kappa) * steepest.cos().powi(2))
    };
    let cosines = f64::from(pair[0].z.abs()) + f64::from(pair[1].z.abs());
    let highlight = match yarn.highlight {
        Highlight::Rough { sigma } => {
            let variance = sigma * sigma;
            0.5 * along * across * bend / (variance * -(-2.0 / variance).exp_m1())
        }
        Highlight::Window { delta } if is_filament => {
            let start = ((1.0 - yarn.smoothing) * flattest).sin();
            across * bend / (2.0 * delta * start) * 0.25 * (1.0 + 2.0 / cosines)
        }
        Highlight::Window { delta } => along * bend / (8.0 * delta * yarn.psi.sin().abs()),
    };
    let intensity = 1.0 + 9.0 * yarn.noise.intensity;
    let of_normal = if yarn.diffuse == Diffuse::YarnNormal { 6.0 } else { 1.0 };
    [
        highlight * greatest_phase(&yarn.phase) * intensity * factor,
        1e3 * of_normal * FRAC_1_PI,
    ]
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
pub(crate) fn greatest_factor(shader: &Shader) -> f64 {
    let ends = shader.normalization(0).expect("every cloth has a yarn");
    ends.iter().map(|end| end.factor).sum()
}

/// Whether every component is finite and from 0 to `most`, with room for rounding.
pub(crate) fn is_within(value: Vec3, most: f64) -> bool {
    let all = value.to_array();
    all.iter().all(|&x| x.is_finite() && x >= 0.0 && f64::from(x) <= most * 1.001)
}

/// A direction with components as far from a unit vector's as they can be, one of them not finite.
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

/// `w` as the reference takes it.
pub(crate) fn double(w: Vec3) -> DVec3 {
    w.as_dvec3()
}
