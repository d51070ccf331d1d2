//! Memory of large arrays goes back to the machine as soon as they are freed.
//!
//! Glibc maps large arrays one by one, but by default raises the size that counts as large whenever one is freed, up to
//! 32 MiB; arrays of a run of a million elements then lie in one heap, whose holes stay with the process: 614 instead of
//! 419 bytes per element at the peak.

/// From which size on an array is mapped by itself (bytes).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: std::ffi::c_int = 4 << 20;

/// Has large arrays mapped one by one. To be called before threads are started; other allocators need no such care.
pub fn return_large_arrays() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: `mallopt` takes two numbers and changes nothing but glibc's own parameter; no other thread runs yet.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
    }
}
