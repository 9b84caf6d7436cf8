//! The greatest albedo of a yarn after scaling, by a grid over directions and refinement, from a finer
//! quadrature than that of the tables.

use core::f64::consts::PI;

use selvedge_yarn_brdf::glam::DVec3;
use selvedge_yarn_brdf::{Cloth, Shader, Thread, Weave, Yarn};

/// m.
const PITCH: f64 = 1e-3;

/// Steps of the grid in √z and in the angle over half a turn, under which a yarn is its own image.
const ROWS: usize = 14;
const COLUMNS: usize = 16;

/// A cloth of floats of `float` cells whose highlight alone reflects.
pub(crate) fn shader(yarn: &Yarn, float: usize) -> Shader {
    let count = float as u32 + 1;
    let weave = Weave::new(count, count, |end, pick| (pick + end) % count != 0);
    let thread = Thread { color: [0.0; 3], pitch: Some(PITCH), ..Thread::default() };
    let threads = vec![thread; count as usize];
    let white = Yarn { specular: [1.0; 3], ..yarn.clone() };
    weave
        .map_err(Into::into)
        .and_then(|weave| Cloth::from_threads(weave, &threads, &threads, &white))
        .and_then(|cloth| cloth.prepare())
        .expect("every parameter is in range")
}

/// The greatest directional albedo over directions of a float of `float` cells of a white `yarn`: 1
/// for the exact factor.
pub(crate) fn greatest_albedo(yarn: &Yarn, float: usize) -> f64 {
    let shader = shader(yarn, float);
    // End 0 is on top from pick 1 on.
    let uv = PITCH * selvedge_yarn_brdf::glam::DVec2::new(0.5, 1.5);
    let albedo = |[row, column]: [f64; 2]| {
        let z = row.clamp(1e-3, 1.0).powi(2);
        let (sin, cos) = (PI * column).sin_cos();
        let radius = ((1.0 - z) * (1.0 + z)).sqrt();
        shader.albedo_of_segment(uv, DVec3::new(radius * cos, radius * sin, z)).x
    };
    let mut places: Vec<([f64; 2], f64)> = (0..ROWS * COLUMNS)
        .map(|k| {
            let place =
                [((k / COLUMNS) as f64 + 0.4) / ROWS as f64, (k % COLUMNS) as f64 / COLUMNS as f64];
            (place, albedo(place))
        })
        .collect();
    places.sort_by(|a, b| b.1.total_cmp(&a.1));
    // From the best, by steps that halve where none of them leads up.
    places[..4].iter().map(|&(place, value)| climb(&albedo, place, value)).fold(0.0, f64::max)
}

fn climb(albedo: &impl Fn([f64; 2]) -> f64, mut at: [f64; 2], mut best: f64) -> f64 {
    let mut step = 0.5 / COLUMNS as f64;
    while step > 2e-3 {
        let neighbours = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]];
        let tried = neighbours.map(|[a, b]| {
            let place = [at[0] + a, at[1] + b];
            (place, albedo(place))
        });
        let up = tried.into_iter().filter(|&(_, value)| value > best);
        match up.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((place, value)) => (at, best) = (place, value),
            None => step *= 0.5,
        }
    }
    best
}
