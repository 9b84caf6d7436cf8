//! Variance of `Shader::sample` against drawing from the cosine, for eight fabrics under an even sky.
//!
//! Prints, by fabric: the mean reflected, the variance of one draw of either kind for a given position
//! and direction, averaged over those, their ratio, the share of draws that are samples, and the
//! greatest weight. Run with `cargo run --release -p selvedge-yarn-brdf --example variance`.

use core::f64::consts::PI;

use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::DVec2;
use selvedge_yarn_brdf::{Cloth, ClothError, Highlight, Phase, Thread, Weave, Yarn};

/// A fabric: which crossings have the warp on top, by the threads of its repeat, and its yarns.
struct Fabric {
    name: &'static str,
    size: u32,
    warp_is_on_top: fn(u32, u32) -> bool,
    warp: Yarn,
    weft: Yarn,
}

fn fabrics() -> Vec<Fabric> {
    let window = |delta| Highlight::Window { delta };
    let rough = |sigma| Highlight::Rough { sigma };
    let peak = |beta| Phase::VonMises { alpha: 0.05, beta };
    let yarn = |color: f32, specular: f32| Yarn {
        color: [color; 3],
        specular: [specular; 3],
        ..Yarn::default()
    };
    let silk = Yarn { psi: 0.0, u_max: 0.4, highlight: rough(0.05), ..yarn(0.3, 0.7) };
    let lining =
        Yarn { psi: 0.0, u_max: 0.38, highlight: window(0.5), smoothing: 0.5, ..yarn(0.2, 0.5) };
    let cotton = Yarn { psi: -0.52, u_max: 0.42, highlight: window(0.5), ..yarn(0.4, 0.3) };
    let wool = Yarn { psi: 0.52, u_max: 0.52, highlight: rough(0.25), ..yarn(0.25, 0.2) };
    let denim = Yarn { u_max: 0.21, color: [0.03, 0.06, 0.2], ..cotton.clone() };
    vec![
        Fabric {
            name: "silk satin",
            size: 8,
            warp_is_on_top: |end, pick| (5 * end + pick) % 8 != 0,
            warp: Yarn { u_max: 0.2, phase: peak(7.3), ..silk.clone() },
            weft: silk.clone(),
        },
        Fabric {
            name: "silk shantung",
            size: 2,
            warp_is_on_top: |end, pick| (end + pick) % 2 == 0,
            warp: Yarn { phase: peak(1.5), kappa: -0.5, u_max: 0.6, ..silk.clone() },
            weft: Yarn { phase: peak(1.5), kappa: -0.3, ..silk.clone() },
        },
        Fabric {
            name: "polyester lining",
            size: 2,
            warp_is_on_top: |end, pick| (end + pick) % 2 == 0,
            warp: Yarn { kappa: -0.7, ..lining.clone() },
            weft: Yarn { kappa: -0.7, u_max: 0.28, ..lining.clone() },
        },
        Fabric {
            name: "rayon damask",
            size: 5,
            warp_is_on_top: |end, pick| (2 * end + pick) % 5 != 0,
            warp: Yarn { highlight: window(0.1), phase: peak(20.0), ..lining.clone() },
            weft: Yarn {
                highlight: window(0.1),
                phase: Phase::WrappedCauchy { rho: 0.8, is_backward: true },
                ..lining
            },
        },
        Fabric {
            name: "cotton shirting",
            size: 2,
            warp_is_on_top: |end, pick| (end + pick) % 2 == 0,
            warp: Yarn { u_max: 0.6, ..cotton.clone() },
            weft: cotton.clone(),
        },
        Fabric {
            name: "wool gabardine",
            size: 3,
            warp_is_on_top: |end, pick| (end + pick) % 3 != 0,
            warp: wool.clone(),
            weft: wool.clone(),
        },
        Fabric {
            name: "tweed",
            size: 4,
            warp_is_on_top: |end, pick| (end + pick) % 4 < 2,
            warp: Yarn {
                phase: Phase::WrappedCauchy { rho: 0.67, is_backward: true },
                ..wool.clone()
            },
            weft: wool,
        },
        Fabric {
            name: "denim",
            size: 4,
            warp_is_on_top: |end, pick| (end + 3 * pick) % 4 != 0,
            warp: denim,
            weft: Yarn { u_max: 0.66, ..cotton },
        },
    ]
}

impl Fabric {
    fn cloth(&self) -> Result<Cloth, ClothError> {
        let weave = Weave::new(self.size, self.size, self.warp_is_on_top)?;
        let threads = vec![Thread::default(); self.size as usize];
        let mut cloth = Cloth::from_threads(weave, &threads, &threads, &self.warp)?;
        cloth.yarns = vec![self.warp.clone(), self.weft.clone()];
        cloth.end_yarns.fill(0);
        cloth.pick_yarns.fill(1);
        Ok(cloth)
    }
}

/// Number of draws, their sum, and that of their squares.
#[derive(Default)]
struct Sums {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    fn variance(&self) -> f64 {
        self.squares / self.count - self.mean() * self.mean()
    }
}

const PLACES: u32 = 500;
const DRAWS: u32 = 2000;

fn main() -> Result<(), ClothError> {
    println!("fabric               mean   drawn   cosine  cosine/drawn  samples  greatest weight");
    for fabric in fabrics() {
        let cloth = fabric.cloth()?;
        let (shader, size) = (cloth.prepare()?, cloth.size());
        let (mut mean, mut greatest, mut samples) = (0.0, 0.0f64, 0.0);
        let mut variance = [0.0; 2];
        for place in 1..=PLACES {
            let index = |k: u32| core::num::NonZeroU32::new(k).expect("counted from 1");
            let [u, v, a, b] = Halton::<4>::new().point(index(place));
            // Off the borders between threads, on which points of the sequence lie.
            let uv = size * (DVec2::new(u, v) + DVec2::new(0.0123, 0.0456));
            let wo = square_to_cosine_hemisphere(DVec2::new(a, b)).as_vec3();
            let (mut drawn, mut cosine) = (Sums::default(), Sums::default());
            for draw in 1..=DRAWS {
                // Every place its own part of the sequence.
                let point = Halton::<3>::new().point(index(place * DRAWS + draw));
                let sample = shader.sample(uv, wo, point.map(|x| x as f32));
                let weight = sample.map_or(0.0, |s| f64::from(s.weight.element_sum()) / 3.0);
                samples += f64::from(u8::from(sample.is_some()));
                greatest = greatest.max(weight);
                drawn.add(weight);
                let wi = square_to_cosine_hemisphere(DVec2::new(point[1], point[2])).as_vec3();
                cosine.add(PI * f64::from(shader.eval(uv, wi, wo).element_sum()) / 3.0);
            }
            mean += drawn.mean() / f64::from(PLACES);
            variance[0] += drawn.variance() / f64::from(PLACES);
            variance[1] += cosine.variance() / f64::from(PLACES);
        }
        let samples = samples / f64::from(PLACES * DRAWS);
        let [drawn, cosine] = variance;
        println!(
            "{:18} {mean:6.3} {drawn:7.3} {cosine:8.3} {:13.2} {:7.1} % {greatest:16.1}",
            fabric.name,
            cosine / drawn,
            100.0 * samples
        );
    }
    Ok(())
}
