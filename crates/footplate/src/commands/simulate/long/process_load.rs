//! What this process takes of the machine, where the system tells: Linux.

use std::fs;

/// Memory, descriptors and processor time at a moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProcessLoad {
    /// Resident memory.
    pub(super) memory_kb: Option<f64>,
    /// Open descriptors.
    pub(super) descriptors: Option<f64>,
    /// Processor time of all threads so far.
    cpu_s: Option<f64>,
}

impl ProcessLoad {
    pub(super) fn now() -> Self {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let memory_kb = resident.and_then(|size| size.trim().strip_suffix(" kB")?.trim().parse().ok());
        // One of them reads the folder.
        let descriptors = fs::read_dir("/proc/self/fd").ok().map(|open| open.count() as f64 - 1.0);
        Self { memory_kb, descriptors, cpu_s: cpu_s() }
    }

    /// Processor time since an earlier moment, in s.
    pub(super) fn cpu_since(&self, before: &Self) -> Option<f64> {
        Some(self.cpu_s? - before.cpu_s?)
    }
}

#[cfg(unix)]
fn cpu_s() -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

#[cfg(not(unix))]
fn cpu_s() -> Option<f64> {
    None
}
