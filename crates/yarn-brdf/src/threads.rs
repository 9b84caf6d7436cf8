//! The threads of a cloth: the type of each, and how much of its pitch it fills where.

use fearless_simd::{Simd, prelude::*};

use crate::cloth::Cloth;
use crate::lanes::{Wide, WideMask};
use crate::material::Shapes;
use crate::noise::{Line, Use};
use crate::weave::{
    LaneSizes, Local, Position, Segment, Side, Sizes, ThreadPoint, Touching, split,
};
use crate::yarn::Noise;

/// The threads of one repeat.
#[derive(Clone, Debug)]
pub(crate) struct Threads {
    /// Index of the type of yarn, by end and then by pick.
    pub(crate) yarns: Vec<u16>,
    ends: u32,
    pub(crate) fill: Fill,
    /// The sizes of ends and of picks if all of them have one and keep it.
    common_sizes: Option<[f64; 2]>,
}

/// How much of its pitch a thread fills.
#[derive(Clone, Debug)]
pub(crate) enum Fill {
    /// All of it.
    Touching,
    /// A constant share, by type of yarn.
    Constant(Vec<f64>),
    /// A share that changes along the thread.
    Varying { seed: u64, types: Vec<Varying> },
}

/// How the diameter and place of one type of yarn change.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Varying {
    size: f64,
    noise: Noise,
    /// Wavelengths, and half lengths of a thick place, per cell along a pick and along an end.
    waves_per_cell: [f64; 2],
    slubs_per_cell: [f64; 2],
    /// Chance of a thick place in half the length of one.
    chance: f64,
}

impl Threads {
    pub(crate) fn new(cloth: &Cloth) -> Self {
        let yarns = &cloth.yarns;
        let fill = if yarns.iter().any(|yarn| yarn.noise.moves_threads()) {
            // Along a pick a cell is as long as the pitch of the ends.
            let lengths = [cloth.pitch.x, cloth.pitch.y].map(|pitch| pitch / cloth.scale);
            let types = yarns.iter().map(|yarn| {
                let noise = yarn.noise;
                let half_slub = 0.5 * noise.slub_length;
                Varying {
                    size: yarn.size,
                    noise,
                    waves_per_cell: lengths.map(|length| length / noise.wavelength),
                    slubs_per_cell: lengths.map(|length| length / half_slub),
                    chance: (noise.slub_rate * half_slub).min(1.0),
                }
            });
            Fill::Varying { seed: cloth.seed, types: types.collect() }
        } else if yarns.iter().all(|yarn| yarn.size == 1.0) {
            Fill::Touching
        } else {
            Fill::Constant(yarns.iter().map(|yarn| yarn.size).collect())
        };
        let common = |threads: &[u16]| {
            let mut sizes = threads.iter().map(|&yarn| yarns[usize::from(yarn)].size);
            let first = sizes.next()?;
            sizes.all(|size| size == first).then_some(first)
        };
        let common_sizes = common(&cloth.end_yarns).zip(common(&cloth.pick_yarns));
        Self {
            yarns: [cloth.end_yarns.as_slice(), &cloth.pick_yarns].concat(),
            ends: cloth.weave.ends(),
            fill,
            common_sizes: common_sizes.map(|(of_ends, of_picks)| [of_ends, of_picks]),
        }
    }

    /// The memory of the threads, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let types = match &self.fill {
            Fill::Touching => 0,
            Fill::Constant(sizes) => size_of_val(sizes.as_slice()),
            Fill::Varying { types, .. } => size_of_val(types.as_slice()),
        };
        types + size_of_val(self.yarns.as_slice())
    }

    /// Whether anything shows between the threads.
    pub(crate) fn have_gaps(&self) -> bool {
        !matches!(self.fill, Fill::Touching)
    }

    /// The type of yarn of a segment.
    #[inline]
    pub(crate) fn yarn(&self, segment: &Segment) -> u16 {
        self.yarn_of(segment.is_warp, segment.thread)
    }

    /// The type of yarn of a thread of the repeat.
    #[inline(always)]
    pub(crate) fn yarn_of(&self, is_warp: bool, thread: u32) -> u16 {
        let first = if is_warp { 0 } else { self.ends };
        self.yarns[(first + thread) as usize]
    }

    /// The mean size of each of so many types of yarn.
    pub(crate) fn mean_sizes(&self, types: usize) -> Vec<f64> {
        match &self.fill {
            Fill::Touching => vec![1.0; types],
            Fill::Constant(sizes) => sizes.clone(),
            Fill::Varying { seed, types } => {
                types.iter().map(|varying| varying.mean_size(*seed)).collect()
            }
        }
    }

    /// The greatest w/l, in metres, of the bent segments of each type of yarn, at most.
    pub(crate) fn shapes(&self, cloth: &Cloth) -> Vec<Shapes> {
        let aspect = cloth.pitch.x / cloth.pitch.y;
        // A segment is at least one crossing long.
        let most = |index: usize, aspect: f64| self.greatest_size(index, cloth) * aspect;
        let mut shapes: Vec<Shapes> =
            (0..cloth.yarns.len()).map(|i| [most(i, aspect), most(i, 1.0 / aspect)]).collect();
        if shapes.iter().flatten().all(|&ratio| ratio <= 1.0) {
            return shapes;
        }
        // Only where that may be too steep is it worth looking for the shortest runs.
        let mut runs = vec![[u32::MAX; 2]; cloth.yarns.len()];
        for side in [Side::Face, Side::Back] {
            for pick in 0..i64::from(cloth.weave.picks()) {
                for end in 0..i64::from(cloth.weave.ends()) {
                    let middle = Position { cell: [end, pick], fraction: [0.5; 2] };
                    let top = cloth.weave.segment_at(side, middle, &Touching);
                    if let Some(segment) = top.filter(|segment| !segment.is_straight()) {
                        let yarn = usize::from(self.yarn(&segment));
                        let run = &mut runs[yarn][usize::from(!segment.is_warp)];
                        *run = segment.crossings.min(*run);
                    }
                }
            }
        }
        for (shapes, runs) in shapes.iter_mut().zip(runs) {
            for (shape, run) in shapes.iter_mut().zip(runs) {
                *shape = if run == u32::MAX { 0.0 } else { *shape / f64::from(run) };
            }
        }
        shapes
    }

    fn greatest_size(&self, index: usize, cloth: &Cloth) -> f64 {
        match &self.fill {
            Fill::Varying { types, .. } => types[index].greatest_size(),
            Fill::Touching | Fill::Constant(_) => cloth.yarns[index].size,
        }
    }
}

/// [`Fill::Constant`].
pub(crate) struct Constant<'a> {
    pub(crate) threads: &'a Threads,
    pub(crate) sizes: &'a [f64],
}

impl Sizes for Constant<'_> {
    #[inline(always)]
    fn at(&self, point: ThreadPoint) -> Local {
        let yarn = self.threads.yarn_of(point.is_warp, point.thread);
        Local { size: self.sizes[usize::from(yarn)], offset: 0.0 }
    }
}

impl LaneSizes for Constant<'_> {
    #[inline(always)]
    fn of<S: Simd>(&self, is_end: WideMask<S>, thread: Wide<S>) -> Wide<S> {
        if let Some([of_ends, of_picks]) = self.threads.common_sizes {
            return thread.of(of_ends).or(is_end, thread.of(of_picks));
        }
        let (is_end, thread) = (is_end.narrow(), thread.to_u32());
        let index = is_end.select(thread, thread + self.threads.ends);
        let size = |lane: usize| {
            let yarn = self.threads.yarns[index[lane] as usize];
            self.sizes[usize::from(yarn)]
        };
        Wide::from_fn(index.token(), size)
    }
}

/// [`Fill::Varying`].
pub(crate) struct Moving<'a> {
    pub(crate) threads: &'a Threads,
    pub(crate) seed: u64,
    pub(crate) types: &'a [Varying],
}

impl Sizes for Moving<'_> {
    fn at(&self, point: ThreadPoint) -> Local {
        let yarn = self.threads.yarn_of(point.is_warp, point.thread);
        let line = Line { seed: self.seed, is_warp: point.is_warp, index: point.line };
        self.types[usize::from(yarn)].at(line, point)
    }
}

/// 1 less than the golden ratio: its multiples, modulo 1, are as even as any.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

impl Varying {
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
        if self.chance > 0.0 && noise.slub_height > 0.0 {
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
