//! The threads of a cloth: the type of each, and how much of its pitch it fills where.

use fearless_simd::{Simd, mask32x16, prelude::*, u32x16};

use crate::cloth::Cloth;
use crate::lanes::Wide;
use crate::material::Shapes;
use crate::moving::{Types, Varying};
use crate::weave::{
    LaneLocals, LanePoints, LaneSizes, Local, Position, Segment, Side, Sizes, ThreadPoint, Touching,
};

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
    Varying(Types),
}

impl Threads {
    pub(crate) fn new(cloth: &Cloth) -> Self {
        let yarns = &cloth.yarns;
        let fill = if yarns.iter().any(|yarn| yarn.noise.moves_threads()) {
            // Along a pick a cell is as long as the pitch of the ends.
            let lengths = [cloth.pitch.x, cloth.pitch.y].map(|pitch| pitch / cloth.scale);
            let types = yarns.iter().map(|yarn| Varying::new(yarn, lengths)).collect();
            Fill::Varying(Types::new(cloth.seed, types))
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
            Fill::Varying(types) => types.bytes(),
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

    /// The same of sixteen threads.
    #[inline(always)]
    pub(crate) fn yarns_of<S: Simd>(&self, is_warp: mask32x16<S>, thread: u32x16<S>) -> u32x16<S> {
        // Ends come first.
        let index = is_warp.select(thread, thread + self.ends);
        u32x16::from_fn(index.token(), |lane| self.yarns[index[lane] as usize].into())
    }

    /// The mean size of each of so many types of yarn.
    pub(crate) fn mean_sizes(&self, types: usize) -> Vec<f64> {
        match &self.fill {
            Fill::Touching => vec![1.0; types],
            Fill::Constant(sizes) => sizes.clone(),
            Fill::Varying(types) => types.mean_sizes().to_vec(),
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
            Fill::Varying(types) => types.greatest_size(index),
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
    fn at<S: Simd>(&self, points: &LanePoints<S>) -> LaneLocals<S> {
        let &LanePoints { is_warp, thread, .. } = points;
        let offset = thread.of(0.0);
        if let Some([of_ends, of_picks]) = self.threads.common_sizes {
            let size = thread.of(of_ends).or(is_warp, thread.of(of_picks));
            return LaneLocals { size, offset };
        }
        let yarns = self.threads.yarns_of(is_warp.narrow(), thread.to_u32());
        let size = Wide::from_fn(thread.token(), |lane| self.sizes[yarns[lane] as usize]);
        LaneLocals { size, offset }
    }
}
