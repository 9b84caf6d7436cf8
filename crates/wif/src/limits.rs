//! Bounds on what a file may ask for, so that no file takes more than it brings.

/// Most ends, picks, shafts or treadles that are read, unless
/// [`Options::with_max_threads`](crate::Options::with_max_threads) says otherwise.
pub const THREADS: u32 = 100_000;

/// Most private and unknown sections that a [`Draft`](crate::Draft) carries along; the
/// [`Document`](crate::Document) has all of them.
pub const FOREIGN_SECTIONS: usize = 10_000;

/// Most diagnostics of one code; what comes beyond is counted in one more.
pub const DIAGNOSTICS_PER_CODE: usize = 20;

/// Most bytes the grid of a drawdown takes, unless
/// [`DrawdownOptions::max_bytes`](crate::DrawdownOptions::max_bytes) says otherwise: 256 MiB,
/// enough for 46,000 by 46,000 threads.
pub const DRAWDOWN_BYTES: u64 = 256 << 20;
