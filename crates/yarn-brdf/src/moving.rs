//! Threads whose diameter and place change along them.

use fearless_simd::{Simd, u32x16};

use crate::lanes::Wide;
use crate::noise::{Line, Lines, Use};
use crate::threads::Threads;
use crate::weave::{
    LaneLocals, LanePoints, LaneSizes, Local, Sizes, ThreadPoint, split, split_lanes,
};
use crate::yarn::{Noise, Yarn};

/// How the diameter and place of one type of yarn change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Varying {
    size: f64,
    noise: Noise,
    /// Wavelengths, and half lengths of a thick place, per cell along a pick and along an end.
    waves_per_cell: [f64; 2],
    slubs_per_cell: [f64; 2],
    /// Chance of a thick place in half the length of one.
    chance: f64,
}

/// All types of yarn of a cloth.
#[derive(Clone, Debug)]
pub(crate) struct Types {
    seed: u64,
    all: Vec<Varying>,
    mean_sizes: Vec<f64>,
    /// Whether all of them are the same.
    are_alike: bool,
    are_long: bool,
}

/// Steps of noise per cell up to which those at the farthest cells are told from each other.
const MOST_STEPS: f64 = (1_u64 << 18) as f64;

/// The threads of a cloth that change.
pub(crate) struct Moving<'a> {
    pub(crate) threads: &'a Threads,
    pub(crate) types: &'a Types,
}

impl Sizes for Moving<'_> {
    fn at(&self, point: ThreadPoint) -> Local {
        let yarn = self.threads.yarn_of(point.is_warp, point.thread);
        let line = Line { seed: self.types.seed, is_warp: point.is_warp, index: point.line };
        self.types.all[usize::from(yarn)].at(line, point)
    }
}

impl LaneSizes for Moving<'_> {
    const ARE_SHIFTED: bool = true;

    #[inline(always)]
    fn at<S: Simd>(&self, points: &LanePoints<S>) -> LaneLocals<S> {
        if self.types.are_alike {
            return self.types.at(points, &Alike(&self.types.all[0]));
        }
        let yarns = self.threads.yarns_of(points.is_warp.narrow(), points.thread.to_u32());
        self.types.at(points, &Unlike(&self.types.all, yarns))
    }
}

/// What the numbers of sixteen threads are.
trait Numbers<S: Simd> {
    /// The number that `number` reads of the type of each thread.
    fn of(&self, like: Wide<S>, number: impl Fn(&Varying) -> f64) -> Wide<S>;

    /// Whether `is` holds for any type that there may be.
    fn any(&self, is: impl Fn(&Varying) -> bool) -> bool;
}

/// Those of a single type.
struct Alike<'a>(&'a Varying);

/// Those of types by their indices.
struct Unlike<'a, S: Simd>(&'a [Varying], u32x16<S>);

impl<S: Simd> Numbers<S> for Alike<'_> {
    #[inline(always)]
    fn of(&self, like: Wide<S>, number: impl Fn(&Varying) -> f64) -> Wide<S> {
        like.of(number(self.0))
    }

    #[inline(always)]
    fn any(&self, is: impl Fn(&Varying) -> bool) -> bool {
        is(self.0)
    }
}

impl<S: Simd> Numbers<S> for Unlike<'_, S> {
    #[inline(always)]
    fn of(&self, like: Wide<S>, number: impl Fn(&Varying) -> f64) -> Wide<S> {
        Wide::from_fn(like.token(), |lane| number(&self.0[self.1[lane] as usize]))
    }

    #[inline(always)]
    fn any(&self, is: impl Fn(&Varying) -> bool) -> bool {
        self.0.iter().any(is)
    }
}

impl Types {
    pub(crate) fn new(seed: u64, all: Vec<Varying>) -> Self {
        let are_alike = all.windows(2).all(|two| two[0] == two[1]);
        let steps = all.iter().flat_map(|of| [of.waves_per_cell, of.slubs_per_cell]).flatten();
        let are_long = steps.fold(0.0, f64::max) < MOST_STEPS;
        let mut mean_sizes = Vec::<f64>::new();
        for (index, varying) in all.iter().enumerate() {
            let known = all[..index].iter().position(|other| other == varying);
            mean_sizes.push(known.map_or_else(|| varying.mean_size(seed), |k| mean_sizes[k]));
        }
        Self { seed, all, mean_sizes, are_alike, are_long }
    }

    /// Whether sixteen points at a time are as exact as one.
    pub(crate) fn are_long(&self) -> bool {
        self.are_long
    }

    /// Their memory, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.all.as_slice()) + size_of_val(self.mean_sizes.as_slice())
    }

    /// The mean diameter over pitch of each.
    pub(crate) fn mean_sizes(&self) -> &[f64] {
        &self.mean_sizes
    }

    /// The greatest diameter over pitch of the type of this index, at most.
    pub(crate) fn greatest_size(&self, index: usize) -> f64 {
        self.all[index].greatest_size()
    }

    /// [`Varying::at`] of threads with these `numbers`.
    #[inline(always)]
    fn at<S: Simd>(&self, points: &LanePoints<S>, numbers: &impl Numbers<S>) -> LaneLocals<S> {
        let &LanePoints { is_warp, line, cell, fraction, .. } = points;
        let lines = Lines { seed: self.seed, is_warp, index: line };
        let start = line * GOLDEN;
        let position = cell + fraction;
        let waves = numbers.of(line, |of| of.waves_per_cell[1]);
        let waves = waves.or(is_warp, numbers.of(line, |of| of.waves_per_cell[0]));
        let from = numbers.of(line, |of| of.size);
        let mut size = from;
        if numbers.any(|of| of.noise.width > 0.0) {
            let (cell, fraction) = split_lanes(position * waves + start);
            let change = lines.gradient(Use::Width, cell, fraction);
            size = size * (numbers.of(line, |of| of.noise.width) * change + 1.0);
        }
        if numbers.any(Varying::has_slubs) {
            let slubs = numbers.of(line, |of| of.slubs_per_cell[1]);
            let slubs = slubs.or(is_warp, numbers.of(line, |of| of.slubs_per_cell[0]));
            let (cell, fraction) = split_lanes(position * slubs + start);
            let slub = lines.slub(numbers.of(line, |of| of.chance), cell, fraction);
            size = size * (numbers.of(line, |of| of.noise.slub_height) * slub + 1.0);
        }
        let size = size.max(size.of(0.01)).min(size.of(1.0));
        let mut offset = size.of(0.0);
        if numbers.any(|of| of.noise.offset > 0.0) {
            let (cell, fraction) = split_lanes(position * waves + (start + 0.5));
            let room = (-size + 1.0) * 0.5;
            let most = numbers.of(line, |of| of.noise.offset) * from;
            offset = (most * lines.gradient(Use::Offset, cell, fraction)).max(-room).min(room);
        }
        LaneLocals { size, offset }
    }
}

/// 1 less than the golden ratio: its multiples, modulo 1, are as even as any.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

impl Varying {
    /// That of `yarn`, where the cells along a pick and along an end have these `lengths`, m.
    pub(crate) fn new(yarn: &Yarn, lengths: [f64; 2]) -> Self {
        let noise = yarn.noise;
        let half_slub = 0.5 * noise.slub_length;
        Self {
            size: yarn.size,
            noise,
            waves_per_cell: lengths.map(|length| length / noise.wavelength),
            slubs_per_cell: lengths.map(|length| length / half_slub),
            chance: (noise.slub_rate * half_slub).min(1.0),
        }
    }

    fn has_slubs(&self) -> bool {
        self.chance > 0.0 && self.noise.slub_height > 0.0
    }

    /// The greatest diameter over pitch, at most.
    fn greatest_size(&self) -> f64 {
        let noise = &self.noise;
        let slub = if self.chance > 0.0 { noise.slub_height } else { 0.0 };
        (self.size * (1.0 + noise.width) * (1.0 + slub)).min(1.0)
    }

    /// The mean diameter over pitch, to about 10⁻³ of it.
    fn mean_size(&self, seed: u64) -> f64 {
        let noise = &self.noise;
        if noise.width == 0.0 && (self.chance == 0.0 || noise.slub_height == 0.0) {
            return self.size;
        }
        const LINES: i64 = 128;
        const POINTS: i64 = 256;
        let size = |index: i64| {
            let line = Line { seed, is_warp: true, index: index % LINES };
            // In steps of half a wave or more, so that there are as many numbers as points.
            let waves = self.waves_per_cell[1].min(self.slubs_per_cell[1]);
            let (cell, fraction) = split((index / LINES) as f64 * (0.5 + GOLDEN) / waves);
            self.at(
                line,
                ThreadPoint { is_warp: true, thread: 0, line: line.index, cell, fraction },
            )
            .size
        };
        (0..LINES * POINTS).map(size).sum::<f64>() / (LINES * POINTS) as f64
    }

    /// Diameter and shift of the thread `line` at `point`.
    fn at(&self, line: Line, point: ThreadPoint) -> Local {
        let axis = usize::from(point.is_warp);
        // In whole steps of noise and a rest, so that nothing is lost far from the origin: the
        // product of the whole part is exact enough in f64 up to 10⁹ repeats.
        let split = |per_cell: f64, start: f64| {
            split((point.cell as f64 + point.fraction) * per_cell + start)
        };
        // Every thread starts elsewhere: the zeros of gradient noise would line up across the cloth.
        let start = line.index as f64 * GOLDEN;
        let noise = &self.noise;
        let mut size = self.size;
        if noise.width > 0.0 {
            let (cell, fraction) = split(self.waves_per_cell[axis], start);
            size *= 1.0 + noise.width * line.gradient(Use::Width, cell, fraction);
        }
        if self.has_slubs() {
            let (cell, fraction) = split(self.slubs_per_cell[axis], start);
            size *= 1.0 + noise.slub_height * line.slub(self.chance, cell, fraction);
        }
        let size = size.clamp(0.01, 1.0);
        let mut offset = 0.0;
        if noise.offset > 0.0 {
            let (cell, fraction) = split(self.waves_per_cell[axis], start + 0.5);
            let room = 0.5 * (1.0 - size);
            let shift = noise.offset * self.size * line.gradient(Use::Offset, cell, fraction);
            offset = shift.clamp(-room, room);
        }
        Local { size, offset }
    }
}
