//! What a cloth does not have costs nothing: where a feature is there but switched off, exactly as many
//! instructions are executed as where it is not there at all, and more where it is on.
//!
//! Without a harness, so that `valgrind --tool=callgrind` counts this program's own calls. Where there is no
//! valgrind, or one that does not know the instructions, the test is skipped and says so.

use std::hint::black_box;

use selvedge_normalize::halton::Halton;
use selvedge_normalize::warp::square_to_cosine_hemisphere;
use selvedge_yarn_brdf::glam::{DVec2, Vec3};
use selvedge_yarn_brdf::{
    Batch, Cloth, Diffuse, Highlight, Mode, Noise, Shader, Thread, Weave, Yarn,
};

#[path = "../benches/support/count.rs"]
mod count;

/// Calls that are counted: enough to come to every branch.
const CALLS: usize = 512;

/// Clears the cloth of some feature, or sets it to what has no effect.
type Change = fn(&mut Cloth);

/// A feature: its name, a cloth that has it but switched off, and one where it is on.
struct Feature {
    name: &'static str,
    off: Change,
    on: Change,
}

fn yarns(cloth: &mut Cloth, change: impl Fn(&mut Yarn)) {
    cloth.yarns.iter_mut().for_each(change);
}

fn noise(cloth: &mut Cloth, noise: Noise) {
    yarns(cloth, |yarn| yarn.noise = noise);
}

const FEATURES: [Feature; 9] = [
    Feature {
        name: "grains",
        off: |cloth| noise(cloth, Noise { fineness: 7.0, ..Noise::default() }),
        on: |cloth| noise(cloth, Noise { intensity: 0.5, ..Noise::default() }),
    },
    Feature {
        name: "moving threads",
        off: |cloth| noise(cloth, Noise { wavelength: 0.003, ..Noise::default() }),
        on: |cloth| noise(cloth, Noise { width: 0.2, ..Noise::default() }),
    },
    Feature {
        name: "slubs",
        off: |cloth| {
            noise(cloth, Noise { slub_length: 0.02, slub_height: 0.5, ..Noise::default() });
        },
        on: |cloth| {
            let slub = Noise { slub_rate: 40.0, slub_height: 0.5, ..Noise::default() };
            noise(cloth, Noise { slub_length: 0.02, ..slub });
        },
    },
    Feature {
        name: "rotation",
        off: |cloth| cloth.rotation = 0.0,
        on: |cloth| cloth.rotation = 0.3,
    },
    Feature {
        name: "gaps",
        off: |cloth| yarns(cloth, |yarn| yarn.size = 1.0),
        on: |cloth| yarns(cloth, |yarn| yarn.size = 0.8),
    },
    Feature {
        name: "bent spine",
        off: |cloth| yarns(cloth, |yarn| yarn.kappa = 0.0),
        on: |cloth| yarns(cloth, |yarn| yarn.kappa = 2.0),
    },
    Feature {
        name: "twist, below what is told from none",
        off: |cloth| yarns(cloth, |yarn| yarn.psi = 0.01),
        on: |cloth| yarns(cloth, |yarn| yarn.psi = 0.4),
    },
    Feature {
        name: "rough fibres",
        off: |cloth| yarns(cloth, |yarn| yarn.highlight = Highlight::default()),
        on: |cloth| yarns(cloth, |yarn| yarn.highlight = Highlight::Rough { sigma: 0.2 }),
    },
    Feature {
        name: "diffuse by the yarn's normal",
        off: |cloth| yarns(cloth, |yarn| yarn.diffuse = Diffuse::Flat),
        on: |cloth| yarns(cloth, |yarn| yarn.diffuse = Diffuse::YarnNormal),
    },
];

/// A cloth of filaments with no feature, changed by that of this name or not at all.
fn shader(feature: &str, is_on: bool) -> Shader {
    let weave = Weave::new(12, 12, |end, pick| (3 * pick + end) % 8 != 0).expect("12 by 12");
    let thread = Thread { color: [0.4; 3], pitch: Some(5e-4), ..Thread::default() };
    let yarn = Yarn { psi: 0.0, ..Yarn::default() };
    let cloth = Cloth::from_threads(weave, &[thread; 12], &[thread; 12], &yarn);
    let mut cloth = Cloth { normalization: Mode::None, ..cloth.expect("as many threads") };
    if let Some(feature) = FEATURES.iter().find(|known| known.name == feature) {
        (if is_on { feature.on } else { feature.off })(&mut cloth);
    }
    cloth.prepare().expect("valid")
}

/// Places and two directions each.
fn queries() -> Vec<(DVec2, [Vec3; 2])> {
    let points = Halton::<6>::new().points_from(std::num::NonZeroU32::MIN).take(CALLS);
    points
        .map(|[a, b, c, d, e, f]| {
            let direction = |x, y| square_to_cosine_hemisphere(DVec2::new(x, y)).as_vec3();
            (0.03 * DVec2::new(a, b), [direction(c, d), direction(e, f)])
        })
        .collect()
}

/// What is counted. It asks for no memory, which takes now more and now less.
#[inline(never)]
fn counted_calls(
    shader: &Shader,
    queries: &[(DVec2, [Vec3; 2])],
    batch: &Batch<'_>,
    f: [&mut [f32]; 3],
) {
    for &(uv, [wi, wo]) in queries {
        black_box(shader.eval(uv, wi, wo));
        black_box(shader.pdf(uv, wi, wo));
    }
    shader.eval_batch(batch, f).expect("all are equally long");
}

fn run(task: &str) {
    let (state, feature) = task.split_once(' ').expect("a state and a feature");
    let shader = shader(feature, state == "on");
    let queries = queries();
    let uv = [0, 1].map(|k| queries.iter().map(|(uv, _)| uv[k]).collect::<Vec<_>>());
    let part = |w: usize, k: usize| queries.iter().map(|(_, of)| of[w][k]).collect::<Vec<_>>();
    let [wi, wo] = [0, 1].map(|w| [0, 1, 2].map(|k| part(w, k)));
    let batch = Batch {
        uv: uv.each_ref().map(Vec::as_slice),
        wi: wi.each_ref().map(Vec::as_slice),
        wo: wo.each_ref().map(Vec::as_slice),
        active: None,
    };
    let mut f = [(); 3].map(|()| vec![0.0; CALLS]);
    // The first batch of a thread asks for the memory that all of them work in.
    shader.eval_batch(&batch, f.each_mut().map(Vec::as_mut_slice)).expect("all are equally long");
    counted_calls(&shader, &queries, &batch, f.each_mut().map(Vec::as_mut_slice));
    black_box(f);
}

fn main() {
    if let Some(task) = count::task() {
        return run(&task);
    }
    let count = |state: &str, feature: &str| {
        count::instructions(&format!("{state} {feature}"), Some("*counted_calls*"))
    };
    let Some(without) = count("off", "nothing") else {
        return println!("skipped: no valgrind that counts these instructions");
    };
    // To copy memory takes a few more or less by where it lies, far below one in a call.
    let tolerance = CALLS as u64 / 10;
    assert!(without > CALLS as u64, "{without} instructions were counted");
    for Feature { name, .. } in FEATURES {
        let [off, on] = ["off", "on"].map(|state| count(state, name).expect("valgrind ran before"));
        println!("{name}: {off} instructions off, {on} on, {without} without");
        assert!(
            off.abs_diff(without) <= tolerance,
            "{name} off: {off} instructions, expected {without} as without it"
        );
        assert!(on > without + 10 * tolerance, "{name}: {on} on, expected more than {without}");
    }
}
