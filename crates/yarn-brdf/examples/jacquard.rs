//! Memory and time of a cloth of 10⁸ crossings that do not repeat.
//!
//! ```text
//! cargo run --release -p selvedge-yarn-brdf --example jacquard [THREADS]
//! ```

use std::time::Instant;

use selvedge_yarn_brdf::{Batch, Cloth, Thread, Weave, Yarn};

#[path = "../tests/support/mod.rs"]
pub(crate) mod support;

use support::{PITCH, Random, direction};

/// Points of a batch.
const POINTS: usize = 1024;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let threads = std::env::args().nth(1).map_or(Ok(10_000), |count| count.parse::<u32>())?;
    let start = Instant::now();
    let is_warp_up = |end: u32, pick: u32| {
        let block = (end / 97).wrapping_mul(0x9e37_79b1) ^ (pick / 61).wrapping_mul(0x85eb_ca6b);
        (end + (block >> 27) % 3 * pick) % (4 + block % 5) < 2
    };
    let weave = Weave::new(threads, threads, is_warp_up)?;
    let counted = start.elapsed().as_secs_f64();
    let thread = Thread { color: [0.4; 3], pitch: Some(PITCH), ..Thread::default() };
    let all = vec![thread; threads as usize];
    let shader = Cloth::from_threads(weave, &all, &all, &Yarn::default())?.prepare()?;
    let prepared = start.elapsed().as_secs_f64();
    let mut random = Random(1);
    let extent = f64::from(threads) * PITCH;
    let mut times = Vec::new();
    let mut sum = 0.0;
    for _ in 0..300 {
        let mut position = || [(); POINTS].map(|()| extent * random.number());
        let uv = [position(), position()];
        let w = [(); POINTS].map(|()| direction(random.number(), 7.0 * random.number()).as_vec3());
        let [x, y, z] = [0, 1, 2].map(|axis| w.map(|w| w[axis]));
        let directions = [x.as_slice(), &y, &z];
        let points = Batch { uv: [&uv[0], &uv[1]], wi: directions, wo: directions, active: None };
        let [mut r, mut g, mut b] = [[0.0; POINTS]; 3];
        let start = Instant::now();
        shader.eval_batch(&points, [&mut r, &mut g, &mut b])?;
        times.push(start.elapsed().as_secs_f64() * 1e9 / POINTS as f64);
        sum += r[0];
    }
    times.sort_by(f64::total_cmp);
    println!(
        "{threads} by {threads}: crossings {counted:.2} s, prepared {prepared:.2} s, {} MB; \
         random places {:.1} ns (median of {}, least {:.1} ns; sum {sum})",
        shader.bytes() / 1_000_000,
        times[times.len() / 2],
        times.len(),
        times[0],
    );
    Ok(())
}
