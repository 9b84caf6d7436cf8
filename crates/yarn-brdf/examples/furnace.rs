//! The white furnace over many yarns: the greatest share of light that a segment and a point reflect or
//! let through, in either combination, and how much white cloth reflects at any share of the highlight.
//!
//! Run with `cargo run --release -p selvedge-yarn-brdf --example furnace -- [yarns]`, 2000 by default.

use rayon::prelude::*;
use selvedge_yarn_brdf::{Combination, Mode};

#[path = "../tests/support/furnace.rs"]
mod furnace;
#[path = "../tests/support/yarns.rs"]
mod yarns;
use furnace::{greatest, reflected_by_white};

/// Prints how many of the numbers lie above each limit, and the five greatest.
fn report(title: &str, limits: &[f64], mut found: Vec<(f64, String)>) {
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!("{title}: greatest of {} is {:.5}", found.len(), found.first().map_or(0.0, |f| f.0));
    for limit in limits {
        println!("  above {limit}: {}", found.iter().filter(|(value, _)| value > limit).count());
    }
    for (_, what) in found.iter().take(5) {
        println!("  {what}");
    }
}

fn main() {
    let yarns = std::env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(2000);
    let all = |mode, combination| {
        (0..yarns).into_par_iter().map(move |i| greatest(i, mode, combination)).collect()
    };
    let limits = [1.0, 1.0005, 1.001];
    for combination in [Combination::Layered, Combination::Lerp] {
        let title = format!("reflected or let through, segments, {combination:?}");
        report(&title, &limits, all(Mode::Segment, combination));
    }
    let title = "reflected or let through, points";
    report(title, &limits, all(Mode::Pointwise, Combination::Lerp));

    let white: Vec<_> = (0..yarns).into_par_iter().map(|i| reflected_by_white(i, 6)).collect();
    let greatest = white.iter().map(|[_, greatest]| greatest.clone()).collect();
    report("reflected by white cloth, at most", &[1.0, 1.001, 1.01], greatest);
    let missing = white.into_iter().map(|[(least, what), _]| (1.0 - least, what)).collect();
    report("not reflected by white cloth, at most", &[0.005, 0.01, 0.02], missing);
}
