//! How much of its pitch each thread fills.

/// The diameters of the threads, which may vary along them.
pub trait Sizes {
    /// Whether every thread fills its pitch everywhere: then there are no gaps to look for.
    const ARE_TOUCHING: bool = false;

    /// The size of a thread at a point of it. The same point must always give the same size.
    fn at(&self, point: ThreadPoint) -> Local;
}

/// A point along a thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThreadPoint {
    /// Whether the thread is an end (warp); else it is a pick (weft).
    pub is_warp: bool,
    /// The thread's index within the repeat, from 0.
    pub thread: u32,
    /// The thread's index over all repeats.
    pub line: i64,
    /// Index over all repeats of the thread that it crosses.
    pub cell: i64,
    /// Distance along the thread from the edge of that cell, in cells, in [0, 1).
    pub fraction: f64,
}

/// The extent of a thread across its cell: |`offset`| + `size`/2 ≤ 1/2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Diameter over pitch, in (0, 1].
    pub size: f64,
    /// From the middle of the cell to the middle of the thread, along u for an end and along v for
    /// a pick, in cells.
    pub offset: f64,
}

/// Every thread touches its neighbours.
#[derive(Clone, Copy, Debug)]
pub struct Touching;

impl Sizes for Touching {
    const ARE_TOUCHING: bool = true;

    fn at(&self, _point: ThreadPoint) -> Local {
        Local { size: 1.0, offset: 0.0 }
    }
}

/// One size for each thread.
#[derive(Clone, Debug)]
pub struct ThreadSizes {
    /// Of the picks, then of the ends.
    sizes: [Vec<f64>; 2],
}

impl ThreadSizes {
    /// Diameter over pitch, in (0, 1], of each end and each pick of the repeat. A thread beyond
    /// these touches its neighbours.
    #[must_use]
    pub fn new(ends: Vec<f64>, picks: Vec<f64>) -> Self {
        Self { sizes: [picks, ends] }
    }
}

impl Sizes for ThreadSizes {
    fn at(&self, point: ThreadPoint) -> Local {
        let sizes = &self.sizes[usize::from(point.is_warp)];
        Local { size: sizes.get(point.thread as usize).copied().unwrap_or(1.0), offset: 0.0 }
    }
}
