//! Random yarns over the whole range of their parameters, and cloths of them.

#![allow(dead_code, reason = "no test uses all of it")]

use core::f64::consts::{FRAC_PI_2, TAU};

use selvedge_normalize::halton::{Halton, Scrambling};
use selvedge_yarn_brdf::glam::{DVec2, DVec3};
use selvedge_yarn_brdf::{Cloth, Highlight, Mapping, Phase, PhaseTable, Thread, Weave, Yarn};

/// Pitch of the cloths, m.
pub(crate) const PITCH: f64 = 1e-3;

/// How far the parameters of random yarns go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Range {
    /// Greatest concentration of von Mises peaks.
    pub(crate) beta: f64,
    /// Greatest ρ of wrapped Cauchy peaks.
    pub(crate) rho: f64,
    /// Least roughness, rad.
    pub(crate) sigma: f64,
    /// Least half width of the window.
    pub(crate) delta: f64,
    /// Least and greatest curvature of the spine.
    pub(crate) kappa: [f64; 2],
}

/// Everything that a yarn may be, but peaks so sharp that nothing of them is seen.
pub(crate) const WIDEST: Range =
    Range { beta: 1e4, rho: 1.0, sigma: 0.005, delta: 0.001, kappa: [-0.999, 1000.0] };

/// What cloth is made of, and a good deal more.
pub(crate) const USUAL: Range =
    Range { beta: 200.0, rho: 0.95, sigma: 0.02, delta: 0.05, kappa: [-0.9, 10.0] };

/// The `i`-th of many white yarns spread over `range`; all inclinations and twists, a third of them
/// rough, and a third of filaments.
pub(crate) fn yarn(i: u32, range: &Range) -> Yarn {
    let numbers = Halton::<10>::scrambled(Scrambling::Owen(5));
    let x = numbers.point((i + 1).try_into().expect("one more is not 0"));
    let even_in_log = |t: f64, low: f64, high: f64| low * (high / low).powf(t);
    let beta = even_in_log(x[1], 0.1, range.beta);
    let phase = match i % 6 {
        0 | 1 => Phase::VonMises { alpha: x[0] * x[0], beta },
        2 => Phase::VonMises3d { alpha: x[0] * x[0], beta },
        3 | 4 => Phase::WrappedCauchy { rho: range.rho * x[1], is_backward: i % 6 == 4 },
        _ => Phase::Tabulated(table(i, 3 + (x[0] * 30.0) as u32)),
    };
    let kind = i / 6 % 3;
    let highlight = if kind == 0 {
        Highlight::Rough { sigma: even_in_log(x[2], range.sigma, 1.0) }
    } else {
        Highlight::Window { delta: even_in_log(x[2], range.delta, 1.0) }
    };
    let u_max = match i % 11 {
        0 => 0.0,
        1 => 1.5,
        _ => 1.5 * x[4],
    };
    let [sharpest, flattest] = range.kappa;
    let kappa = match i % 4 {
        1 => sharpest * x[5],
        3 => even_in_log(x[5], 0.1, flattest),
        _ => 0.0,
    };
    Yarn {
        color: [1.0; 3],
        specular: [1.0; 3],
        psi: if kind == 1 { 0.0 } else { FRAC_PI_2 * (2.0 * x[3] - 1.0) },
        u_max,
        kappa,
        smoothing: if i.is_multiple_of(5) { 0.95 * x[6] } else { 0.0 },
        highlight,
        phase,
        ..Yarn::default()
    }
}

/// A random phase function of `count` samples.
fn table(i: u32, count: u32) -> PhaseTable {
    let numbers = Halton::<1>::scrambled(Scrambling::Owen(i.into()));
    let sample = |k: u32| numbers.point((k + 1).try_into().expect("one more is not 0"))[0].powi(2);
    PhaseTable::new(&(0..count).map(sample).collect::<Vec<f64>>()).expect("some are above 0")
}

/// The `j`-th direction above the surface of many: a third even in cos θ, the others grazing.
pub(crate) fn direction(j: u32) -> DVec3 {
    let numbers = Halton::<2>::scrambled(Scrambling::Owen(77));
    let [a, b] = numbers.point((j + 1).try_into().expect("one more is not 0"));
    let z = match j % 3 {
        0 => a,
        1 => a * a * a,
        _ => 10f64.powf(-5.0 * a),
    };
    let z = z.clamp(1e-6, 1.0);
    let (y, x) = (TAU * b).sin_cos();
    let sine = ((1.0 - z) * (1.0 + z)).sqrt();
    DVec3::new(sine * x, sine * y, z)
}

/// A cloth of `yarns`, whose k-th is the k-th end; every end floats over as many picks as there are
/// ends less one, every pick over one. The picks are of the first yarn.
pub(crate) fn cloth(yarns: &[Yarn]) -> Cloth {
    let count = yarns.len() as u32;
    let weave = Weave::new(count, count, |end, pick| (pick + end) % count != 0)
        .expect("a few threads are no more than allowed");
    let thread = Thread { pitch: Some(PITCH), ..Thread::default() };
    let threads = vec![thread; yarns.len()];
    let cloth = Cloth::from_threads(weave, &threads, &threads, &yarns[0]);
    let mut cloth = cloth.expect("as many threads as the weave has");
    cloth.yarns = yarns.to_vec();
    cloth.end_yarns = (0..count as u16).collect();
    cloth.mapping = Mapping::Linear;
    cloth
}

/// A place, m, on top of an end of [`cloth`], at (`x`, `y`) in [0, 1]² of its cell in the middle of the
/// float.
pub(crate) fn on_end(end: usize, ends: usize, x: f64, y: f64) -> DVec2 {
    // The end is below where pick + end is a multiple of their number.
    let covered = (ends - end) % ends;
    let pick = (covered + ends / 2) % ends;
    PITCH * DVec2::new(end as f64 + x, pick as f64 + y)
}
