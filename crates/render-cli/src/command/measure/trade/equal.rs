//! Errors in equal time, and times to equal error.

use crate::{
    measure::trade::{
        Point, Run, Way,
        statistics::{Estimate, at_time, time_of},
    },
    report::Table,
};

/// Samples per pixel of the usual way that others are held against.
const USUAL_SPP: f64 = 8.0;

/// The ratios of each way to the usual one, the first, in FLIP and relMSE; empty where a way comes to no
/// such time or error.
pub(super) fn table(name: &str, ways: &[Way], runs: &[Vec<Run>]) -> Table {
    let columns = [
        "way",
        "FLIP in equal time, ratio",
        "±",
        "time to equal FLIP, ratio",
        "±",
        "relMSE in equal time, ratio",
        "±",
        "time to equal relMSE, ratio",
        "±",
    ];
    let mut table = Table::new(name, columns);
    let metrics: [fn(&Point) -> f64; 2] = [|point| point.flip, |point| point.relmse];
    for (way, of_way) in ways.iter().zip(runs) {
        let is_adaptive = way.limits.noise.is_some();
        let estimates = metrics.into_iter().flat_map(|of| {
            let both = of_way.iter().zip(&runs[0]);
            let both: Vec<_> =
                both.map(|(run, usual)| ratios(run, usual, is_adaptive, of)).collect();
            [0, 1].map(|which| {
                let values: Option<Vec<f64>> = both.iter().map(|ratios| ratios[which]).collect();
                values.map(|values| Estimate::of(&values))
            })
        });
        let cells = estimates.flat_map(|estimate| {
            [estimate.map(|estimate| estimate.mean), estimate.map(|estimate| estimate.half)]
        });
        table.row([way.name.as_str().into()].into_iter().chain(cells.map(Into::into)));
    }
    table
}

/// The error in equal time and the time to equal error of `run`, over those of `usual`.
///
/// An adaptive run has one point: the usual one is then read at its time and its error.
fn ratios(run: &Run, usual: &Run, is_adaptive: bool, of: fn(&Point) -> f64) -> [Option<f64>; 2] {
    if is_adaptive {
        let ratio = |other: Option<f64>, own: f64| other.map(|other| own / other);
        let Some(own) = run.points.last() else { return [None; 2] };
        return [
            ratio(at_time(&usual.points, own.seconds, of), of(own)),
            ratio(time_of(&usual.points, of(own), of), own.seconds),
        ];
    }
    let at = usual.points.iter().find(|point| point.spp >= USUAL_SPP).or(usual.points.last());
    let Some(at) = at else { return [None; 2] };
    [
        at_time(&run.points, at.seconds, of).map(|error| error / of(at)),
        time_of(&run.points, of(at), of).map(|seconds| seconds / at.seconds),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(speed: f64) -> Run {
        let points = [1.0f64, 2.0, 4.0, 8.0, 16.0, 32.0].map(|spp| Point {
            spp,
            seconds: spp / speed,
            relmse: 1.0 / spp,
            flip: spp.powf(-0.5),
            max: 1.0,
        });
        Run { points: points.into(), samples: 32, peak_bytes: None }
    }

    #[test]
    fn twice_the_speed_is_half_the_time_and_half_the_squared_error() {
        let (usual, fast) = (run(1.0), run(2.0));
        for is_adaptive in [false, true] {
            // Of an adaptive run, all that counts is where it ends.
            let mut fast = fast.clone();
            if is_adaptive {
                fast.points = vec![fast.points[4]];
            }
            let [error, time] = ratios(&fast, &usual, is_adaptive, |point| point.relmse);
            for found in [error, time] {
                assert!((found.unwrap() - 0.5).abs() < 1e-12, "{is_adaptive}: {found:?}");
            }
        }
        assert_eq!(ratios(&usual, &usual, false, |point| point.flip), [Some(1.0); 2]);
        // Too slow to come to the time or the error.
        let mut slow = run(0.1);
        slow.points.truncate(3);
        assert_eq!(ratios(&slow, &usual, false, |point| point.flip), [None; 2]);
    }
}
