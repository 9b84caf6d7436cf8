//! How far [`Shader::eval`] in f32 is from [`Shader::eval_reference`], over random cloths, places and
//! directions from the whole box of parameters.
//!
//! ```text
//! cargo run --release -p selvedge-yarn-brdf --example precision [TUPLES]
//! ```
//!
//! prints a table (10⁷ tuples by default) and another one of what each tier takes, and fails where a
//! bound is missed or a batch has other bits than single points. Each yarn has a
//! specular and a diffuse channel, and one with both. Where either precision has a highlight and the
//! other has none, the edge of the highlight passes between them: such flips are counted apart.
//!
//! An error that exceeds [`FEW`] is compared with the conditioning of the value: how far the
//! reference moves, when each input in turn (the components of wi and wo, and x and y on the segment)
//! moves by one unit in the last place of f32, summed over the inputs.

use core::f64::consts::{FRAC_PI_2, TAU};
use std::time::Instant;

use rayon::prelude::*;
use selvedge_yarn_brdf::glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{
    Batch, Cloth, Combination, Diffuse, FILAMENT_PSI, Highlight, Instructions, Mapping, Mode,
    Phase, PhaseTable, Shader, Thread, Weave, Yarn,
};

#[path = "../tests/support/mod.rs"]
pub(crate) mod support;

use support::{PITCH, Random, direction};

/// Greatest median of the relative error.
pub(crate) const MEDIAN: f64 = 5e-7;
/// Greatest relative error of all but one in a thousand values.
pub(crate) const FEW: f64 = 1e-4;
/// Greatest error, in units of the conditioning, of all but [`BEYOND`] of the values.
pub(crate) const CONDITIONED: f64 = 8.0;
/// Greatest share of values beyond that.
pub(crate) const BEYOND: f64 = 1e-4;
/// Greatest share of flips.
pub(crate) const FLIPS: f64 = 1e-5;

/// Below this a value counts as 0, sr⁻¹: some of its factors may not be normal numbers of f32.
const DARK: f64 = 1e-30;

/// Tuples for each cloth.
const PER_CLOTH: u64 = 5000;

/// What the cloths are told apart by, in the table.
const KINDS: [&str; 4] = ["twisted", "filament", "rough", "diffuse"];

/// The errors of one kind of value.
#[derive(Clone, Debug, Default)]
pub(crate) struct Errors {
    /// Tuples looked at, those that reflect nothing included.
    tuples: u64,
    /// Relative errors of the values above 0.
    relative: Vec<f32>,
    flips: u64,
    /// Values whose error is above [`FEW`] and beyond [`CONDITIONED`].
    beyond: u64,
    /// The greatest error in units of the conditioning, of those above [`FEW`], and its inputs.
    worst: (f64, String),
}

impl Errors {
    fn merged(mut self, other: Self) -> Self {
        self.tuples += other.tuples;
        self.relative.extend(other.relative);
        self.flips += other.flips;
        self.beyond += other.beyond;
        if other.worst.0 > self.worst.0 {
            self.worst = other.worst;
        }
        self
    }

    /// The relative error that the share `part` of the values does not exceed; sorts them.
    fn quantile(&mut self, part: f64) -> f64 {
        let index = ((self.relative.len() - 1) as f64 * part) as usize;
        f64::from(*self.relative.select_nth_unstable_by(index, f32::total_cmp).1)
    }

    /// A row of the table, and the bounds that do not hold.
    pub(crate) fn report(&mut self, name: &str) -> (String, Vec<String>) {
        let count = self.relative.len() as f64;
        let shares = [
            ("median", self.quantile(0.5), MEDIAN),
            ("99.9 %", self.quantile(0.999), FEW),
            ("beyond the conditioning", self.beyond as f64 / count, BEYOND),
            ("flips", self.flips as f64 / self.tuples as f64, FLIPS),
        ];
        let [median, few, beyond, flips] = shares.map(|(_, found, _)| found);
        let (greatest, worst) = (self.quantile(1.0), self.worst.0);
        let row = format!(
            "{name:10} {count:10} {median:9.1e} {few:9.1e} {greatest:9.1e} {beyond:9.1e} \
             {worst:9.1e} {flips:9.1e}"
        );
        let missed = shares.into_iter().filter(|&(_, found, bound)| found > bound);
        let message =
            |(what, found, bound)| format!("{name}: {what} {found:.1e}, expected {bound:.0e}");
        (row, missed.map(message).collect())
    }
}

/// The time and the bits of one way to evaluate tuples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tier {
    seconds: f64,
    tuples: u64,
    /// Tuples whose bits differ from those of single points in f32.
    differing: u64,
}

/// The errors by [`KINDS`], and the tiers: f64, f32, and batches with each of the [`Instructions`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Study {
    errors: [Errors; KINDS.len()],
    tiers: Vec<Tier>,
}

impl Study {
    fn merged(self, other: Self) -> Self {
        let mut errors = other.errors.into_iter();
        let count = self.tiers.len().max(other.tiers.len());
        let tier = |k: usize| {
            let [a, b] = [&self.tiers, &other.tiers].map(|t| t.get(k).copied().unwrap_or_default());
            Tier {
                seconds: a.seconds + b.seconds,
                tuples: a.tuples + b.tuples,
                differing: a.differing + b.differing,
            }
        };
        Self {
            tiers: (0..count).map(tier).collect(),
            errors: self.errors.map(|all| all.merged(errors.next().unwrap_or_default())),
        }
    }
}

/// The study of at least `tuples` tuples.
pub(crate) fn study(tuples: u64) -> Study {
    let cloths = (0..tuples.div_ceil(PER_CLOTH)).into_par_iter();
    cloths.map(of_cloth).reduce(Study::default, Study::merged)
}

/// Prints the table of `study`, with the worst tuple of each kind, and returns the bounds that do
/// not hold over all kinds together.
pub(crate) fn print(study: Study) -> Vec<String> {
    println!(
        "{:10} {:>10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "kind", "values", "median", "99.9 %", "greatest", "beyond", "worst/ulp", "flips"
    );
    let (mut all, mut worst) = (Errors::default(), Vec::new());
    for (mut errors, kind) in study.errors.into_iter().zip(KINDS) {
        println!("{}", errors.report(kind).0);
        worst.push(format!("worst of {kind}: {:.1} ulp, {}", errors.worst.0, errors.worst.1));
        all = all.merged(errors);
    }
    let (row, mut missed) = all.report("all");
    println!("{row}\n{}", worst.join("\n"));
    let [median, few, greatest] = [0.5, 0.999, 1.0].map(|part| all.quantile(part));
    println!(
        "{:14} {:>9} {:>9} {:>9} {:>9} {:>9}",
        "tier", "ns", "median", "99.9 %", "greatest", "differing"
    );
    let batches = Instructions::available().into_iter().map(|known| format!("batch {known:?}"));
    let names = ["f64".into(), "f32".into()].into_iter().chain(batches);
    for (k, (name, tier)) in names.zip(study.tiers).enumerate() {
        let ns = tier.seconds * 1e9 / tier.tuples as f64;
        let [median, few, greatest] = if k == 0 { [0.0; 3] } else { [median, few, greatest] };
        let differing = tier.differing;
        println!("{name:14} {ns:9.1} {median:9.1e} {few:9.1e} {greatest:9.1e} {differing:9}");
        if differing > 0 {
            missed.push(format!("{name}: {differing} tuples differ from single points"));
        }
    }
    missed
}

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let tuples = std::env::args().nth(1).map_or(Ok(10_000_000), |count| count.parse())?;
    let missed = print(study(tuples));
    if missed.is_empty() { Ok(()) } else { Err(missed.join(", "))? }
}

/// The study of the `index`-th cloth.
fn of_cloth(index: u64) -> Study {
    let mut random = Random(index << 32);
    let cloth = random_cloth(&mut random);
    let mut shader = cloth.prepare().expect("every parameter is in its range");
    let kind = match cloth.yarns[0].highlight {
        Highlight::Rough { .. } => 2,
        Highlight::Window { .. } => usize::from(cloth.yarns[0].is_filament()),
    };
    let mut errors: [Errors; KINDS.len()] = core::array::from_fn(|_| Errors::default());
    let tuples: Vec<Tuple> = (0..PER_CLOTH).map(|_| Tuple::new(&mut random, &cloth)).collect();
    let mut tiers = Vec::new();
    let doubles: Vec<DVec3> =
        timed(&mut tiers, || tuples.iter().map(|tuple| tuple.reference(&shader)).collect());
    let singles: Vec<Vec3> = timed(&mut tiers, || {
        tuples.iter().map(|tuple| shader.eval(tuple.uv, tuple.wi, tuple.wo)).collect()
    });
    let uv = [0, 1].map(|axis| tuples.iter().map(|tuple| tuple.uv[axis]).collect::<Vec<_>>());
    let parts = |of: fn(&Tuple) -> Vec3| {
        [0, 1, 2].map(|axis| tuples.iter().map(|tuple| of(tuple)[axis]).collect::<Vec<_>>())
    };
    let (wi, wo) = (parts(|tuple| tuple.wi), parts(|tuple| tuple.wo));
    let points = Batch {
        uv: uv.each_ref().map(Vec::as_slice),
        wi: wi.each_ref().map(Vec::as_slice),
        wo: wo.each_ref().map(Vec::as_slice),
        active: None,
    };
    for instructions in Instructions::available() {
        shader.use_instructions(instructions);
        let mut f = [(); 3].map(|()| vec![0.0; tuples.len()]);
        timed(&mut tiers, || shader.eval_batch(&points, f.each_mut().map(Vec::as_mut_slice)))
            .expect("equal lengths");
        let differs = |&(k, single): &(usize, &Vec3)| {
            (0..3).any(|c| f[c][k].to_bits() != single[c].to_bits())
        };
        let differing = singles.iter().enumerate().filter(differs).count() as u64;
        tiers.last_mut().expect("one was timed").differing = differing;
    }
    for ((tuple, single), double) in tuples.iter().zip(singles).zip(doubles) {
        let single = single.as_dvec3();
        // The specular channel, the diffuse one, and the one with both.
        for channel in 0..3 {
            let of_kind = &mut errors[if channel == 1 { KINDS.len() - 1 } else { kind }];
            let (single, double) = (single[channel], double[channel]);
            of_kind.tuples += 1;
            if single.max(double) < DARK {
                continue;
            }
            if channel == 0 && (single == 0.0 || double == 0.0) {
                of_kind.flips += 1;
                break;
            }
            let error = (single - double).abs();
            of_kind.relative.push((error / double) as f32);
            if error <= FEW * double {
                continue;
            }
            let in_units = error / tuple.conditioning(&cloth, &shader, channel);
            of_kind.beyond += u64::from(in_units > CONDITIONED);
            if in_units > of_kind.worst.0 {
                let what = ["specular", "diffuse", "both"][channel];
                let inputs = tuple.described(&cloth);
                of_kind.worst =
                    (in_units, format!("{what} {single:e}, in f64 {double:e}\n  {inputs}"));
            }
        }
    }
    Study { errors, tiers }
}

/// The result of `evaluate`, whose time makes another tier.
fn timed<T>(tiers: &mut Vec<Tier>, evaluate: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = evaluate();
    let seconds = start.elapsed().as_secs_f64();
    tiers.push(Tier { seconds, tuples: PER_CLOTH, differing: 0 });
    result
}

/// The inputs of one evaluation.
#[derive(Clone, Copy, Debug)]
struct Tuple {
    uv: DVec2,
    wi: Vec3,
    wo: Vec3,
}

impl Tuple {
    /// Directions anywhere, near the mirror image of each other, or near each other.
    fn new(random: &mut Random, cloth: &Cloth) -> Self {
        let mut anywhere = || direction(random.number(), TAU * random.number());
        let (wo, free) = (anywhere(), anywhere());
        let spread = log(random, 1e-3, 1.0);
        let wi = match (10.0 * random.number()) as u32 {
            0..6 => free,
            6..8 => DVec3::new(-wo.x, -wo.y, wo.z) + spread * free,
            _ => wo + spread * free,
        };
        let uv = cloth.size() * DVec2::new(random.number(), random.number());
        Self { uv, wi: wi.normalize().as_vec3(), wo: wo.normalize().as_vec3() }
    }

    fn described(&self, cloth: &Cloth) -> String {
        let Self { uv, wi, wo } = self;
        let Yarn { u_max, psi, kappa, smoothing, highlight, phase, diffuse, size, .. } =
            &cloth.yarns[0];
        let Cloth { mapping, normalization, combination, pitch, rotation, .. } = cloth;
        format!(
            "uv {uv} m, wi {wi}, wo {wo}\n  u_max {u_max}, psi {psi}, kappa {kappa}, smoothing \
             {smoothing}, size {size}, {highlight:?}, {phase:?}, {diffuse:?}\n  {mapping:?}, \
             {normalization:?}, {combination:?}, pitch {pitch} m, rotation {rotation}"
        )
    }

    fn reference(&self, shader: &Shader) -> DVec3 {
        shader.eval_reference(self.uv, self.wi.as_dvec3(), self.wo.as_dvec3())
    }

    /// How far the reference moves when each input moves by one unit in the last place of f32.
    fn conditioning(&self, cloth: &Cloth, shader: &Shader, channel: usize) -> f64 {
        let value = self.reference(shader)[channel];
        let change = |[up, down]: [Self; 2]| {
            let change = |moved: Self| (moved.reference(shader)[channel] - value).abs();
            change(up).max(change(down))
        };
        let mut sum = 0.0;
        for axis in 0..3 {
            let moved = |w: Vec3| {
                [w[axis].next_up(), w[axis].next_down()].map(|value| {
                    let mut w = w;
                    w[axis] = value;
                    w
                })
            };
            sum += change(moved(self.wi).map(|wi| Self { wi, ..*self }));
            sum += change(moved(self.wo).map(|wo| Self { wo, ..*self }));
        }
        if let Some(at) = shader.yarn_at(self.uv) {
            let segment = at.segment;
            let unit = |x: f64| f64::from((x as f32).abs().next_up() - (x as f32).abs());
            let across = 0.5 * segment.width * unit(segment.x);
            let along = 0.5 * segment.length * unit(segment.y);
            let (u, v) = if segment.is_warp { (across, along) } else { (along, across) };
            for cells in [DVec2::new(u, 0.0), DVec2::new(0.0, v)] {
                let step =
                    DVec2::from_angle(-cloth.rotation).rotate(cells * cloth.pitch / cloth.scale);
                sum += change([step, -step].map(|step| Self { uv: self.uv + step, ..*self }));
            }
        }
        sum
    }
}

/// Evenly over the logarithm.
fn log(random: &mut Random, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.number())
}

/// A cloth of one yarn, from the whole box of parameters.
fn random_cloth(random: &mut Random) -> Cloth {
    let weave = Weave::new(5, 5, |end, pick| (2 * pick + end) % 5 != 0)
        .expect("a few threads are no more than allowed");
    let yarn = random_yarn(random);
    let thread =
        Thread { color: yarn.color, pitch: Some(PITCH), diameter: None, ..Thread::default() };
    let cloth = Cloth::from_threads(weave, &[thread; 5], &[thread; 5], &yarn);
    let mut cloth = cloth.expect("as many threads as the weave has");
    let chance = |random: &mut Random, of: f64| random.number() < of;
    cloth.yarns[0].size = if chance(random, 0.5) { 1.0 } else { log(random, 0.01, 1.0) };
    cloth.pitch.y = log(random, 0.2, 5.0) * cloth.pitch.x;
    cloth.mapping = if chance(random, 0.5) { Mapping::Linear } else { Mapping::Arcsine };
    cloth.normalization = if chance(random, 0.5) { Mode::Segment } else { Mode::None };
    cloth.combination = if chance(random, 0.7) { Combination::Layered } else { Combination::Lerp };
    cloth.rotation = if chance(random, 0.5) { 0.0 } else { random.between(-TAU, TAU) };
    cloth
}

fn random_yarn(random: &mut Random) -> Yarn {
    let sign = if random.number() < 0.5 { -1.0 } else { 1.0 };
    let psi = match (20.0 * random.number()) as u32 {
        0..5 => 0.0,
        5..8 => sign * log(random, FILAMENT_PSI, FRAC_PI_2),
        8 => sign * FRAC_PI_2,
        _ => sign * random.between(0.0, FRAC_PI_2),
    };
    let highlight = if random.number() < 0.65 {
        Highlight::Window { delta: log(random, 1e-3, 1.0) }
    } else {
        Highlight::Rough { sigma: log(random, 5e-3, 1.0) }
    };
    let kappa = match (4.0 * random.number()) as u32 {
        0 => 0.0,
        1 => -random.between(0.0, 0.999),
        _ => log(random, 1e-3, 1e3),
    };
    let alpha = if random.number() < 0.3 { 0.0 } else { random.number() };
    let beta = if random.number() < 0.1 { 0.0 } else { log(random, 1e-2, 1e6) };
    let rho = if random.number() < 0.5 { random.number() } else { 1.0 - log(random, 1e-4, 1.0) };
    let phase = match (20.0 * random.number()) as u32 {
        0..8 => Phase::VonMises { alpha, beta },
        8..12 => Phase::VonMises3d { alpha, beta },
        12..18 => Phase::WrappedCauchy { rho, is_backward: random.number() < 0.5 },
        _ => {
            let samples = [(); 12].map(|()| random.number());
            Phase::Tabulated(PhaseTable::new(&samples).expect("samples are above 0"))
        }
    };
    Yarn {
        color: [0.0, 0.6, 0.6],
        specular: [0.9, 0.0, 0.9],
        specular_uniform: (random.number() < 0.2).then_some([0.4, 0.0, 0.4]),
        diffuse: if random.number() < 0.7 { Diffuse::Flat } else { Diffuse::YarnNormal },
        u_max: if random.number() < 0.05 { 0.0 } else { random.between(0.0, 1.5) },
        psi,
        kappa,
        smoothing: if random.number() < 0.3 { 0.0 } else { random.between(0.0, 0.95) },
        highlight,
        phase,
        ..Yarn::default()
    }
}
