//! How much memory this process takes.

use std::fs;

/// Most bytes that this process has held since it began, or since [`reset_peak`]; `None` where the system
/// does not tell.
pub(crate) fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

/// Begins to look for the greatest memory anew, where the system can; elsewhere the old one stays, an upper
/// bound.
pub(crate) fn reset_peak() {
    let _ = fs::write("/proc/self/clear_refs", "5");
}
