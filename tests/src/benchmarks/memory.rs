//! The most memory that a process held.

use std::fs;

/// Forgets earlier peaks, where the system can.
pub(super) fn forget_peak() {
    // Linux: "5" resets the peak of the resident set. Elsewhere there is no figure.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

/// Largest resident set since, in bytes; `None` where the system does not tell.
pub(super) fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
