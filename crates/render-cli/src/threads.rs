//! Threads to work on.

use anyhow::Context;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// So many threads, or one per processor.
///
/// # Errors
///
/// When the system gives none.
pub(crate) fn pool(threads: Option<u16>) -> anyhow::Result<ThreadPool> {
    let builder = ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    builder.build().context("threads: cannot be started")
}
