//! How much memory there is.

use windows_sys::Win32::System::SystemInformation::{GlobalMemoryStatusEx, MEMORYSTATUSEX};

/// What this process may ever have (bytes).
pub fn whole() -> Option<u64> {
    status().map(|status| status.ullTotalPhys.min(status.ullTotalVirtual))
}

/// What it may still take (bytes).
pub fn available() -> Option<u64> {
    status().map(|status| status.ullAvailPhys.min(status.ullAvailPageFile).min(status.ullAvailVirtual))
}

fn status() -> Option<MEMORYSTATUSEX> {
    let mut status = MEMORYSTATUSEX { dwLength: size_of::<MEMORYSTATUSEX>() as u32, ..Default::default() };
    // SAFETY: the structure says how long it is.
    let done = unsafe { GlobalMemoryStatusEx(&raw mut status) };
    (done != 0).then_some(status)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_says_what_there_is() {
        let (whole, available) = (whole().expect("Windows"), available().expect("Windows"));
        assert!(available <= whole && available > 0, "{available} of {whole}");
    }
}
