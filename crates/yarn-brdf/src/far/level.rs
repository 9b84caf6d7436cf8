//! From which footprint on a cloth is seen as one.

use glam::DVec2;

use crate::shader::Shader;
use crate::weave::{Position, Side, Touching};

/// Standard deviations of footprints, in cells, between which the far field takes over.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Transition {
    from: f64,
    to: f64,
}

/// What is left of the pattern, as a share of its mean, where the far field begins to take over and where
/// it has.
const CONTRASTS: [f64; 2] = [0.08, 0.02];

/// The least standard deviations, in cells, at which it may: below, a crossing is seen.
const LEAST: [f64; 2] = [0.6, 1.2];

/// The most crossings whose pattern is looked at; that of more has to be within the footprint.
const MOST: usize = 1 << 20;

impl Shader {
    /// How far a beam is to be shaded by the far field, in [0, 1], if its footprint has these standard
    /// deviations along u and v, m: 0 where the pattern is seen, 1 where it blurs, and smooth between.
    ///
    /// With this weight w, `(1 − w) eval + w far_eval` has the same mean over the cloth for any w, as have
    /// the opacities mixed likewise.
    #[must_use]
    pub fn far_weight(&self, deviation: DVec2) -> f32 {
        // What blurs in both directions blurs in all.
        let cells = self.cells(deviation).min_element();
        let Transition { from, to } = self.far.transition;
        let t = ((cells - from) / (to - from)).clamp(0.0, 1.0);
        if t.is_nan() { 0.0 } else { (t * t * (3.0 - 2.0 * t)) as f32 }
    }

    /// Standard deviations along u and v, m, of a footprint in cells: along the weft and along the warp.
    #[must_use]
    pub fn cells(&self, deviation: DVec2) -> DVec2 {
        let along = match self.frame.turn {
            None => deviation,
            Some((sin, cos)) => {
                let DVec2 { x, y } = deviation;
                DVec2::new((x * cos).hypot(y * sin), (x * sin).hypot(y * cos))
            }
        };
        along * self.frame.cells_per_m
    }

    /// Where the pattern of the face blurs: which thread is on top, and in what colour, under ever wider
    /// kernels.
    pub(super) fn transition(&self) -> Transition {
        let size = [self.weave.ends(), self.weave.picks()].map(|count| count as usize);
        let count = size[0] * size[1];
        if count > MOST {
            // A wave as long as the repeat is left with 3 % of its contrast.
            let repeat = size[0].max(size[1]) as f64;
            return Transition { from: 0.25 * repeat, to: 0.42 * repeat };
        }
        let mut pattern: Vec<[f32; 4]> = (0..count)
            .map(|k| {
                let cell = [k % size[0], k / size[0]].map(|thread| thread as i64);
                let middle = Position { cell, fraction: [0.5; 2] };
                let top = self.weave.segment_at(Side::Face, middle, &Touching);
                top.map_or([0.0; 4], |segment| {
                    let yarn = usize::from(self.threads.yarn(&segment));
                    let [r, g, b] = self.materials.single[yarn].look.color;
                    [r, g, b, f32::from(u8::from(segment.is_warp))]
                })
            })
            .collect();
        // What is seen are colours relative to their mean, and which thread is on top.
        let mut inverse = mean(&pattern).map(|value| 1.0 / value.max(1e-3));
        inverse[3] = 1.0;
        let mut limits = [None; 2];
        let (mut variance, mut stride) = (0.0, 1);
        let mut last = (LEAST[0], contrast(&pattern, inverse));
        while limits[1].is_none() && stride <= size[0].max(size[1]) {
            for axis in [0, 1] {
                pattern = blurred(&pattern, size, axis, stride % size[axis]);
            }
            variance += 0.5 * (stride * stride) as f64;
            let next = (f64::sqrt(variance), contrast(&pattern, inverse));
            for (limit, &contrast) in limits.iter_mut().zip(&CONTRASTS) {
                if limit.is_none() && next.1 <= contrast {
                    // Even in the logarithms.
                    let part = (last.1.max(contrast) / contrast).ln()
                        / (last.1.max(contrast) / next.1.max(1e-6)).ln().max(1e-9);
                    *limit = Some(last.0 * (next.0 / last.0).powf(part.min(1.0)));
                }
            }
            last = next;
            stride *= 2;
        }
        let [from, to] = limits.map(|limit| limit.unwrap_or(last.0));
        let from = from.max(LEAST[0]);
        Transition { from, to: to.max(LEAST[1]).max(2.0 * from) }
    }
}

fn mean(pattern: &[[f32; 4]]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for values in pattern {
        for (sum, &value) in sum.iter_mut().zip(values) {
            *sum += f64::from(value);
        }
    }
    sum.map(|sum| sum / pattern.len() as f64)
}

/// The greatest standard deviation of any of the four numbers, in units of 1/`inverse`.
fn contrast(pattern: &[[f32; 4]], inverse: [f64; 4]) -> f64 {
    let mean = mean(pattern);
    let mut sum = [0.0; 4];
    for values in pattern {
        for k in 0..4 {
            sum[k] += (f64::from(values[k]) - mean[k]).powi(2);
        }
    }
    let deviation = |k: usize| (sum[k] / pattern.len() as f64).sqrt() * inverse[k];
    (0..4).map(deviation).fold(0.0, f64::max)
}

/// Quarter, half and quarter of what is `stride` before, at, and `stride` after each crossing along `axis`.
fn blurred(pattern: &[[f32; 4]], size: [usize; 2], axis: usize, stride: usize) -> Vec<[f32; 4]> {
    let at = |k: usize| {
        let mut cell = [k % size[0], k / size[0]];
        let here = cell[axis];
        let [before, after] = [here + size[axis] - stride, here + stride].map(|thread| {
            cell[axis] = thread % size[axis];
            pattern[cell[1] * size[0] + cell[0]]
        });
        core::array::from_fn(|c| 0.25 * (before[c] + after[c]) + 0.5 * pattern[k][c])
    };
    (0..pattern.len()).map(at).collect()
}
