//! The name of this machine.

/// As the system has it; empty if it does not say.
pub fn name() -> String {
    std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default()
}
