//! How exact the factor of equation 2 is, and at what price: 300 random yarns against brute force, the
//! time of one, and a figure of the error of Monte Carlo, Halton points and the quadrature.
//!
//! `cargo run --release -p selvedge-yarn-brdf --example factors -- FIGURE.svg`

use std::error::Error;
use std::num::NonZeroU32;
use std::time::Instant;

use plotters::prelude::*;
use rayon::prelude::*;
use selvedge_normalize::estimate::Sampling;
use selvedge_normalize::glam::{DVec2, DVec3, Vec2, Vec3};
use selvedge_normalize::halton::{Halton, Scrambling};
use selvedge_normalize::scale::{Mode, Normalization, Options};
use selvedge_normalize::search::Search;
use selvedge_normalize::warp::{square_to_cosine_hemisphere, square_to_uniform_hemisphere};
use selvedge_yarn_brdf::{Cloth, Highlight, Shader, Thread, Weave, Yarn};

mod brute_force;
#[path = "../../tests/support/yarns.rs"]
mod yarns;

use brute_force::greatest_albedo;
use yarns::{USUAL, yarn};

fn main() -> Result<(), Box<dyn Error>> {
    let figure = std::env::args().nth(1).ok_or("expected the name of an SVG file")?;
    against_brute_force();
    time_of_a_yarn();
    draw(&figure, &errors())?;
    Ok(())
}

/// Prints the range of the greatest albedo after scaling, which would be 1 for the exact factor.
fn against_brute_force() {
    let mut albedos: Vec<(f64, u32)> = (0..300u32)
        .into_par_iter()
        .map(|i| (greatest_albedo(&yarn(i, &USUAL), 1 + i as usize % 4), i))
        .collect();
    albedos.sort_by(|a, b| a.0.total_cmp(&b.0));
    for &(albedo, i) in albedos.iter().filter(|a| !(0.97..=1.0005).contains(&a.0)) {
        println!("yarn {i}: {albedo:.4} {:?}", yarn(i, &USUAL));
    }
    let mean = albedos.iter().map(|&(albedo, _)| albedo).sum::<f64>() / albedos.len() as f64;
    let (least, greatest) = (albedos[0], albedos[albedos.len() - 1]);
    println!(
        "300 yarns, greatest albedo after scaling: {:.4} (yarn {}) to {:.4} (yarn {}), mean {mean:.4}",
        least.0, least.1, greatest.0, greatest.1
    );
}

/// Prints how long one thread takes for a yarn: the table and the factors for every shape.
fn time_of_a_yarn() {
    let rough = Yarn { highlight: Highlight::Rough { sigma: 0.15 }, ..Yarn::default() };
    for (name, yarn) in [("window", Yarn::default()), ("rough", rough)] {
        let least = (0..10)
            .map(|_| {
                let begun = Instant::now();
                std::hint::black_box(brute_force::shader(&yarn, 2));
                begun.elapsed()
            })
            .min()
            .expect("ten runs");
        println!("{name}: {:.1} ms, the least of 10", 1e3 * least.as_secs_f64());
    }
}

/// A way to find the factor: its name, and (evaluations, mean relative error) for more and more work.
type Curve = (&'static str, Vec<(f64, f64)>);

/// The error of the greatest mean albedo of the default yarn with an unscaled highlight.
fn errors() -> Vec<Curve> {
    let float = 2;
    let unscaled = unscaled(float);
    let weave = f64::from(float) + 1.0;
    // A float along the warp: end 0 from pick 1 to pick `float`.
    let f = move |x: DVec2, wi: DVec3, wo: DVec3| {
        let uv = DVec2::new(x.x, 1.0 + x.y * (weave - 1.0)) * 1e-3;
        f64::from(unscaled.eval(uv, wi.as_vec3(), wo.as_vec3()).x)
    };
    let scaled = brute_force::shader(&Yarn::default(), float as usize);
    let [_, shortest] = scaled.normalization(0).expect("there is a yarn");
    // 1/factor is close to linear in w/l, and the search tells how far from exact it is.
    let [longest, _] = scaled.normalization(0).expect("there is a yarn");
    let chord = |n: fn(&Normalization) -> f64| {
        n(&longest) + (n(&shortest) - n(&longest)) / f64::from(float)
    };
    let exact = greatest_albedo(&Yarn::default(), float as usize) * chord(|n| 1.0 / n.factor);
    let error = |albedo: f64| (albedo / exact - 1.0).abs();

    let budgets = [1e3, 4e3, 1.6e4, 6.4e4, 2.56e5, 1.024e6];
    let random = |budget: f64| {
        let errors = (0..8u64).map(|seed| {
            // Hashes instead of points: independent, as random numbers are.
            let mut state = 0x9e37_79b9_7f4a_7c15u64.wrapping_mul(seed + 1);
            let mut next = || {
                state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
                let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
                ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
            };
            sampled(&f, budget, |_| [next(), next(), next(), next(), next(), next()], error)
        });
        errors.sum::<f64>() / 8.0
    };
    let halton = |budget: f64| {
        let errors = (0..8u64).map(|seed| {
            let points = Halton::<6>::scrambled(Scrambling::Owen(seed));
            let at = |k: u32| points.point(NonZeroU32::MIN.saturating_add(k));
            sampled(&f, budget, at, error)
        });
        errors.sum::<f64>() / 8.0
    };
    let curve = |method: &(dyn Fn(f64) -> f64 + Sync)| {
        budgets.iter().map(|&budget| (budget, method(budget))).collect()
    };
    let search = |budget: f64| {
        let sampling = Sampling {
            at_least: NonZeroU32::new((budget / 300.0) as u32).unwrap_or(NonZeroU32::MIN),
            at_most: NonZeroU32::new((budget / 300.0) as u32).unwrap_or(NonZeroU32::MIN),
            ..Sampling::default()
        };
        let brdf =
            |x: Vec2, wi: Vec3, wo: Vec3| f(x.as_dvec2(), wi.as_dvec3(), wo.as_dvec3()) as f32;
        let search = Search { explore: NonZeroU32::new(200).expect("not 0"), refine: 2, steps: 50 };
        let options = Options { margin: 1.0, search, ..Options::default() };
        let found = Normalization::of(&brdf, Mode::Segment, &sampling, &options);
        found.map_or(1.0, |n| error(n.max_albedo))
    };
    // An integral over directions, whose azimuths are in closed form or few, takes about a hundred
    // places of the yarn.
    let quadrature = (100.0 * f64::from(longest.evaluations), error(chord(|n| 1.0 / n.factor)));
    vec![
        ("Monte Carlo", curve(&random)),
        ("Halton points", curve(&halton)),
        ("Halton points, refined", curve(&search)),
        ("quadrature (all shapes, diffuse table included)", vec![quadrature]),
    ]
}

/// The error of the greatest of √budget mean albedos of as many points each, at directions and points
/// from `next`.
fn sampled(
    f: &impl Fn(DVec2, DVec3, DVec3) -> f64,
    budget: f64,
    mut next: impl FnMut(u32) -> [f64; 6],
    error: impl Fn(f64) -> f64,
) -> f64 {
    let count = budget.sqrt() as u32;
    let greatest = (0..count).map(|i| {
        let [a, b, ..] = next(i);
        let wi = square_to_uniform_hemisphere(DVec2::new(a, b));
        let sum: f64 = (0..count)
            .map(|j| {
                let [_, _, c, d, x, y] = next(j);
                f(DVec2::new(x, y), wi, square_to_cosine_hemisphere(DVec2::new(c, d)))
            })
            .sum();
        core::f64::consts::PI * sum / f64::from(count)
    });
    error(greatest.fold(0.0, f64::max))
}

/// The default yarn, white and without a factor, in floats of `float` cells.
fn unscaled(float: u32) -> Shader {
    let count = float + 1;
    let weave = Weave::new(count, count, |end, pick| (pick + end) % count != 0).expect("small");
    let thread = Thread { color: [0.0; 3], pitch: Some(1e-3), ..Thread::default() };
    let threads = vec![thread; count as usize];
    let white = Yarn { specular: [1.0; 3], ..Yarn::default() };
    let mut cloth = Cloth::from_threads(weave, &threads, &threads, &white).expect("valid");
    cloth.normalization = Mode::None;
    cloth.prepare().expect("valid")
}

fn draw(path: &str, curves: &[Curve]) -> Result<(), Box<dyn Error>> {
    let area = SVGBackend::new(path, (720, 440)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d((5e2..2e7).log_scale(), (1e-3..30.0).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("evaluations")
        .y_desc("relative error of the factor")
        .draw()?;
    for (index, (name, points)) in curves.iter().enumerate() {
        let color = Palette99::pick(index).to_rgba();
        let points: Vec<_> = points.iter().map(|&(x, y)| (x, y.max(1e-3))).collect();
        let line = LineSeries::new(points.iter().copied(), color.stroke_width(2));
        chart
            .draw_series(line)?
            .label(*name)
            .legend(move |(x, y)| Circle::new((x + 10, y), 4, color.filled()));
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 4, color.filled())))?;
        for (x, y) in points {
            println!("{name}: {x:.0} evaluations, error {y:.4}");
        }
    }
    chart.configure_series_labels().background_style(WHITE).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}
