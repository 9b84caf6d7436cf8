//! The highlight of a segment, averaged over it, is the integral along the line where its fibres
//! mirror, which is written out here once more from the papers; and so is that of rough fibres, the
//! smoother they are.

use core::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

use rayon::prelude::*;
use selvedge_yarn_brdf::glam::{DVec2, DVec3};
use selvedge_yarn_brdf::{
    Combination, FILAMENT_PSI, Highlight, Mapping, Mode, Phase, Shader, Yarn,
};

mod support;
use support::{PITCH, Random, cloth, direction};

const ALPHA: f64 = 0.05;
const BETA: f64 = 4.0;

/// Integral of exp(−β cos Δφ) over a turn, by even nodes.
static PEAK: LazyLock<f64> = LazyLock::new(|| {
    let value = |k: i32| (-BETA * (TAU * f64::from(k) / 64.0).cos()).exp();
    (0..64).map(value).sum::<f64>() * TAU / 64.0
});

/// A segment of width w and length l, in cells.
#[derive(Clone, Copy, Debug)]
struct Line {
    psi: f64,
    u_max: f64,
    kappa: f64,
    smoothing: f64,
    w: f64,
    l: f64,
}

impl Line {
    fn normal(u: f64, v: f64) -> DVec3 {
        DVec3::new(v.sin(), u.sin() * v.cos(), u.cos() * v.cos())
    }

    fn tangent(&self, u: f64, v: f64) -> DVec3 {
        let along = DVec3::new(0.0, u.cos(), -u.sin());
        let around = DVec3::new(v.cos(), -u.sin() * v.sin(), -u.cos() * v.sin());
        self.psi.cos() * along - self.psi.sin() * around
    }

    /// Radius of the spine (Irawan 2008, section 5.3), a conic of curvature κ that ends at u_e.
    fn radius(&self, u: f64) -> f64 {
        let end = (1.0 - self.smoothing) * self.u_max;
        let u = u.abs().min(end);
        let half = 0.5 * self.l - 0.5 * self.w * end.sin();
        let r = 1.0 + self.kappa * (1.0 + 1.0 / end.tan());
        let (s, s_end) = (u.tan(), end.tan());
        let sign = r.signum();
        let b = half * (1.0 + sign * r * r * s_end * s_end).sqrt() / (r.abs() * s_end);
        b * r.abs() * (1.0 + sign * r * r * s * s).powf(-1.5) / u.cos().powi(3)
    }

    /// f_c A times the area a (R + a cos v) at (u, v), with p and q.
    fn scattered(&self, u: f64, v: f64, wi: DVec3, wo: DVec3) -> Option<(f64, f64)> {
        let n = Self::normal(u, v);
        let (p, q) = (n.dot(wi), n.dot(wo));
        if p <= 0.0 || q <= 0.0 {
            return None;
        }
        let t = self.tangent(u, v);
        let (a, b) = ((wi - wi.dot(t) * t).normalize(), (wo - wo.dot(t) * t).normalize());
        let peak = (-BETA * a.dot(b)).exp() / *PEAK;
        let phase = ALPHA / TAU + (1.0 - ALPHA) * peak;
        let radius = 0.5 * self.w;
        let area = radius * (self.radius(u) + radius * v.cos());
        Some((area * phase * p * q / (p + q), p + q))
    }

    /// The far field: ∫ G f_c A over the line, over the area of the segment (Irawan & Marschner 2012,
    /// equations 3 to 9), by `nodes` points between the inclinations `range`.
    fn far_field(&self, wi: DVec3, wo: DVec3, range: [f64; 2], nodes: u32) -> f64 {
        let h = wi + wo;
        let even = |k: u32| (f64::from(k) + 0.5) / f64::from(nodes);
        let sum: f64 = if self.psi == 0.0 {
            let u = h.y.atan2(h.z);
            if u.abs() >= self.u_max {
                return 0.0;
            }
            let start = (1.0 - self.smoothing) * self.u_max;
            let step = ((u.abs() - start) / (self.u_max - start).max(1e-30)).clamp(0.0, 1.0);
            let fade = 1.0 - step * step * (3.0 - 2.0 * step);
            let m = (h.y * h.y + h.z * h.z).sqrt();
            (0..nodes)
                .map(|k| PI * (even(k) - 0.5))
                .filter_map(|v| self.scattered(u, v, wi, wo))
                .map(|(scattered, _)| fade * scattered / m * PI / f64::from(nodes))
                .sum()
        } else {
            let [low, high] = range.map(|u| u.clamp(-self.u_max, self.u_max));
            let h = h.normalize();
            (0..nodes)
                .map(|k| low + (high - low) * even(k))
                .filter_map(|u| {
                    let c = h.y * u.cos() - h.z * u.sin();
                    let b = h.y * u.sin() + h.z * u.cos();
                    let d = c / ((h.x * h.x + b * b).sqrt() * self.psi.tan());
                    if d.abs() >= 1.0 {
                        return None;
                    }
                    let v = (-b).atan2(h.x) + d.acos();
                    let v = (v + PI).rem_euclid(TAU) - PI;
                    if v.abs() >= FRAC_PI_2 {
                        return None;
                    }
                    let (scattered, sum) = self.scattered(u, v, wi, wo)?;
                    Some(scattered / (sum * self.psi.sin().abs()))
                })
                .sum::<f64>()
                * (high - low)
                / f64::from(nodes)
        };
        sum / (self.w * self.l)
    }

    fn whole(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.far_field(wi, wo, [-self.u_max, self.u_max], 4000)
    }

    /// The shader of a cloth whose ends float over two picks as this line, without a factor.
    fn shader(&self, highlight: Highlight, mapping: Mapping) -> Shader {
        let yarn = Yarn {
            color: [0.0; 3],
            specular: [1.0; 3],
            psi: self.psi,
            u_max: self.u_max,
            kappa: self.kappa,
            smoothing: self.smoothing,
            highlight,
            phase: Phase::VonMises { alpha: ALPHA, beta: BETA },
            ..Yarn::default()
        };
        let mut cloth = cloth(&yarn, 2);
        cloth.mapping = mapping;
        cloth.normalization = Mode::None;
        cloth.combination = Combination::Lerp;
        cloth.prepare().expect("the yarn is valid")
    }
}

/// The mean of f over the float of end 0 over picks 1 and 2, by `side`² points that are even in y and
/// in the angle v.
fn mean(shader: &Shader, side: u32, mapping: Mapping, wi: DVec3, wo: DVec3) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let mut sum = 0.0;
    for j in 0..side {
        for i in 0..side {
            // Rows are shifted against each other, so that no edge falls on a column.
            let shift = |k: u32| (golden * f64::from(k)).fract();
            let across = (f64::from(i) + shift(j)) / f64::from(side);
            let along = (f64::from(j) + shift(i)) / f64::from(side);
            // Under the arcsine map the values grow as 1/cos v, but x moves as sin v.
            let (x, weight) = match mapping {
                Mapping::Linear => (2.0 * across - 1.0, 1.0),
                Mapping::Arcsine => {
                    let (sin, cos) = (PI * (across - 0.5)).sin_cos();
                    (sin, FRAC_PI_2 * cos)
                }
            };
            let uv = PITCH * DVec2::new(0.5 * (x + 1.0), 1.0 + 2.0 * along);
            sum += weight * shader.eval_reference(uv, wi, wo).x;
        }
    }
    sum / (f64::from(side) * f64::from(side))
}

fn line(psi: f64) -> Line {
    Line { psi, u_max: 0.6, kappa: 0.0, smoothing: 0.0, w: 1.0, l: 2.0 }
}

#[test]
fn mean_over_a_segment_is_the_line_integral() {
    let window = |delta| Highlight::Window { delta };
    let lines = [
        (line(0.5), 0.3),
        (Line { kappa: 2.0, ..line(-0.5) }, 0.1),
        (Line { kappa: -0.8, u_max: 1.0, ..line(1.2) }, 1.0),
        (Line { u_max: 0.2, ..line(0.1) }, 0.3),
        (line(0.0), 0.3),
        (Line { kappa: 2.0, smoothing: 0.5, ..line(0.0) }, 0.2),
        (Line { kappa: -0.8, u_max: 1.0, smoothing: 0.9, ..line(0.0) }, 1.0),
        (Line { u_max: 0.2, smoothing: 0.3, ..line(0.0) }, 0.1),
    ];
    let jobs: Vec<_> = lines
        .into_iter()
        .flat_map(|(line, delta)| {
            [Mapping::Arcsine, Mapping::Linear].map(|mapping| (line, delta, mapping))
        })
        .collect();
    let worst = jobs
        .into_par_iter()
        .map(|(line, delta, mapping)| {
            let shader = line.shader(window(delta), mapping);
            let mut random = Random(3);
            let mut worst = 0.0f64;
            let mut seen = 0;
            while seen < 6 {
                let (wi, wo) = (random.direction(), random.direction());
                let expected = line.whole(wi, wo);
                // Where the line is almost nowhere on the segment the sum itself is not that good.
                if expected < 1e-2 {
                    continue;
                }
                seen += 1;
                let found = mean(&shader, 600, mapping, wi, wo);
                let error = (found / expected - 1.0).abs();
                assert!(
                    error <= 1e-3,
                    "{line:?} δ {delta} {mapping:?} wi {wi} wo {wo}: mean {found}, line integral \
                     {expected}, differ by {error:.1e}, allowed 1e-3"
                );
                worst = worst.max(error);
            }
            worst
        })
        .reduce(|| 0.0, f64::max);
    println!("greatest relative difference {worst:.1e}");
}

#[test]
fn rough_fibres_tend_to_the_same_mean() {
    let sigmas = [0.3, 0.1, 0.03, 0.01, 0.005];
    println!("mean over the segment against the line integral, by σ:");
    println!("ψ     mapping  {sigmas:?}");
    let lines = [line(0.0), line(0.01), Line { kappa: -0.5, ..line(0.3) }, line(-0.9)];
    let jobs: Vec<_> = lines
        .into_iter()
        .flat_map(|line| [Mapping::Arcsine, Mapping::Linear].map(|mapping| (line, mapping)))
        .collect();
    // Directions whose line is well inside the segment: at its ends, half of a blurred line is lost.
    let pairs: Vec<(DVec3, DVec3)> = [(0.9, 2.5, 0.3), (0.7, 4.0, -0.2), (0.5, 0.6, 0.1)]
        .into_iter()
        .map(|(z, phi, tilt)| {
            let wo = direction(z, phi);
            // The mirror image in a plane across the yarn that is tilted along it.
            let n = Line::normal(tilt, 0.4);
            (2.0 * wo.dot(n) * n - wo, wo)
        })
        .collect();
    let rows: Vec<(Line, Mapping, Vec<f64>)> = jobs
        .into_par_iter()
        .map(|(line, mapping)| {
            let errors = sigmas.map(|sigma| {
                let shader = line.shader(Highlight::Rough { sigma }, mapping);
                let side = (3.0 / sigma).max(100.0) as u32;
                let error = |&(wi, wo): &(DVec3, DVec3)| {
                    let found = mean(&shader, side, mapping, wi, wo);
                    (found / line.whole(wi, wo) - 1.0).abs()
                };
                pairs.iter().map(error).fold(0.0, f64::max)
            });
            (line, mapping, errors.to_vec())
        })
        .collect();
    for (line, mapping, errors) in &rows {
        println!("{:5} {mapping:?} {errors:.5?}", line.psi);
        let [.., tenth, _, hundredth, finest] = errors[..] else { unreachable!("five values") };
        assert!(
            hundredth < 2e-3 && finest < 2e-3 && tenth < 0.05 && hundredth < 0.2 * tenth + 5e-4,
            "{line:?} {mapping:?}: errors {errors:?} at σ {sigmas:?}, expected to vanish with σ"
        );
    }
}

#[test]
fn switch_to_filaments_changes_no_more_than_is_told() {
    println!("change from ψ = 0 to the switch, of");
    println!("u_max  the far field: greatest  mean  the albedo");
    for u_max in [0.1, 0.25, 0.5, 1.0] {
        let [filament, staple] = [0.0, FILAMENT_PSI].map(|psi| Line { u_max, ..line(psi) });
        let mut random = Random(11);
        let pairs: Vec<_> = (0..20_000).map(|_| (random.direction(), random.direction())).collect();
        let fields: Vec<[f64; 2]> = pairs
            .par_iter()
            .map(|&(wi, wo)| {
                let h = wi + wo;
                let u = h.y.atan2(h.z);
                // The line of so little twist runs nearly across.
                let reach = 1.2 * FILAMENT_PSI * (h.x.abs() / h.z).max(1.0);
                let range = [u - reach, u + reach];
                [filament.far_field(wi, wo, range, 100), staple.far_field(wi, wo, range, 300)]
            })
            .collect();
        // As shares of the greatest value and of the mean.
        let peak = fields.iter().map(|f| f[0]).fold(0.0, f64::max);
        let greatest = fields.iter().map(|f| (f[1] - f[0]).abs()).fold(0.0, f64::max) / peak;
        let mean = fields.iter().map(|f| (f[1] - f[0]).abs()).sum::<f64>()
            / fields.iter().map(|f| f[0]).sum::<f64>();
        // What the shader itself makes of yarns on either side.
        let shaders = [FILAMENT_PSI, FILAMENT_PSI + 1e-9].map(|psi| {
            let line = Line { psi, ..filament };
            line.shader(Highlight::Window { delta: 0.3 }, Mapping::Linear)
        });
        let albedos: Vec<[f64; 2]> = pairs[..200]
            .par_iter()
            .map(|&(_, wo)| {
                let uv = PITCH * DVec2::new(0.5, 1.5);
                shaders.each_ref().map(|shader| shader.albedo_of_segment(uv, wo).x)
            })
            .collect();
        let peak = albedos.iter().map(|a| a[0]).fold(0.0, f64::max);
        let albedo = albedos.iter().map(|a| (a[1] - a[0]).abs()).fold(0.0, f64::max) / peak;
        println!("{u_max:5} {greatest:21.3} {mean:8.3} {albedo:9.4}");
        // What `FILAMENT_PSI` tells.
        assert!(
            albedo < 0.025 && mean < 0.02 + 0.0125 / u_max && greatest < 0.9,
            "u_max {u_max}: the albedo changes by {albedo}, the far field by {mean} on average and \
             {greatest} at most"
        );
    }
}
