//! `selvedge plan`: what a cloth takes to be shaded.

use std::{fmt::Write as _, time::Instant};

use glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{Batch, Shader};

use crate::{args::PlanOptions, fabric, output::Sink};

/// Points that are shaded to see how long one takes, and how often: the fastest time counts, which
/// others on the machine disturb least.
const POINTS: usize = 4096;
const ROUNDS: usize = 20;

/// Writes what the cloth of `options` takes to standard output.
///
/// # Errors
///
/// As for the cloth of [`render`](super::render::run), and when standard output cannot be written.
pub fn run(options: &PlanOptions) -> anyhow::Result<()> {
    let source = fabric::read(&options.input)?;
    let drawdown = source.draft().drawdown()?;
    let cloth = source.cloth(&drawdown)?;
    let begun = Instant::now();
    let shader = source.shader(&cloth)?;
    let prepared = begun.elapsed().as_secs_f64();
    let plan = shader.plan();

    let mut text = String::new();
    for is_done in [true, false] {
        for step in plan.steps.iter().filter(|step| step.is_done == is_done) {
            let done = if is_done { "yes" } else { "no" };
            let of = step.yarn.map_or("cloth".to_owned(), |yarn| format!("yarn {yarn}"));
            writeln!(text, "{done:<4} {of:<8} {:<30} {}", step.what, step.why)?;
        }
    }
    let weave = plan.bytes_of_weave as f64;
    let [kilobytes, of_weave] = [plan.bytes as f64, weave].map(|bytes| bytes / 1e3);
    let crossings = (drawdown.ends() * drawdown.picks()) as f64;
    let per_crossing = weave / crossings;
    let yarns = cloth.yarns.len();
    let per_yarn = (kilobytes - of_weave) / yarns as f64;
    let [single, batch] = nanoseconds(&shader, cloth.size());
    writeln!(text)?;
    writeln!(text, "memory       {kilobytes:.1} kB")?;
    writeln!(
        text,
        "  weave      {of_weave:.1} kB, {per_crossing:.1} B for each of {crossings} crossings"
    )?;
    writeln!(text, "  yarns      {per_yarn:.1} kB for each of {yarns} types")?;
    writeln!(text, "prepared in  {:.0} ms", prepared * 1e3)?;
    writeln!(text, "a point      {single:.1} ns, or {batch:.1} ns of many at a time")?;
    Sink::new(None)?.write(|out| out.write_all(text.as_bytes()))?;
    Ok(())
}

/// The least time that a point takes one after the other, and many at a time: ns.
fn nanoseconds(shader: &Shader, size: DVec2) -> [f64; 2] {
    // Additive recurrences of irrational steps (Roberts 2018) cover places and directions evenly.
    let at = |k: usize, step: f64| (k as f64 * step).fract();
    let [u, v]: [Vec<f64>; 2] = [(size.x, 0.754_877_666), (size.y, 0.569_840_291)]
        .map(|(side, step)| (0..POINTS).map(|k| 8.0 * side * at(k, step)).collect());
    let direction = |steps: [f64; 2]| {
        let parts = (0..POINTS).map(|k| {
            let [x, y] = steps.map(|step| 1.4 * at(k, step) - 0.7);
            Vec3::new(x as f32, y as f32, 1.0).normalize().to_array()
        });
        let all: Vec<_> = parts.collect();
        [0, 1, 2].map(|axis| all.iter().map(|w| w[axis]).collect::<Vec<f32>>())
    };
    let (wi, wo) =
        (direction([0.819_172_513, 0.671_043_607]), direction([0.856_674_884, 0.733_891_856]));
    let mut f = [(); 3].map(|()| vec![0.0; POINTS]);

    let mut least = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        let begun = Instant::now();
        for k in 0..POINTS {
            let [wi, wo] = [&wi, &wo].map(|w| Vec3::new(w[0][k], w[1][k], w[2][k]));
            f[0][k] = shader.eval(DVec2::new(u[k], v[k]), wi, wo).x;
        }
        std::hint::black_box(&f);
        least[0] = least[0].min(begun.elapsed().as_secs_f64());

        let begun = Instant::now();
        let points = Batch {
            uv: [&u, &v],
            wi: wi.each_ref().map(Vec::as_slice),
            wo: wo.each_ref().map(Vec::as_slice),
            active: None,
        };
        shader
            .eval_batch(&points, f.each_mut().map(Vec::as_mut_slice))
            .expect("all slices have as many points");
        std::hint::black_box(&f);
        least[1] = least[1].min(begun.elapsed().as_secs_f64());
    }
    least.map(|seconds| seconds / POINTS as f64 * 1e9)
}
