//! Memory of large arrays goes back to the machine as soon as they are freed.
//!
//! Glibc maps large arrays one by one, but by default raises the size that counts as large whenever one is freed, up to
//! 32 MiB; arrays of a run of a million elements then lie in one heap, whose holes stay with the process: 614 instead of
//! 419 bytes per element at the peak. What is smaller lies in heaps, by default one for each thread, where what one thread frees is of no
//! use to another, and which give back their ends so eagerly that the next array has to ask for each page anew.

/// From which size on an array is mapped by itself (bytes).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: std::ffi::c_int = 1 << 20;

/// How many heaps there are. Cycles take little from them, so threads hardly wait for each other: runs of 64,000 elements took what they took
/// before (medians of 14 turns).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const HEAPS: std::ffi::c_int = 1;

/// What may be free at the end of a heap before it is given back (bytes).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const SPARE: std::ffi::c_int = 32 << 20;

/// Has large arrays mapped one by one, and all others in one heap. To be called before threads are started; other allocators need no such
/// care.
pub fn return_large_arrays() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    for (parameter, value) in
        [(libc::M_MMAP_THRESHOLD, LARGE), (libc::M_ARENA_MAX, HEAPS), (libc::M_TRIM_THRESHOLD, SPARE)]
    {
        // SAFETY: `mallopt` takes two numbers and changes nothing but glibc's own parameters; no other thread runs yet.
        unsafe {
            libc::mallopt(parameter, value);
        }
    }
}

/// Gives pages that nothing lies on any more back to the machine, also those between others: after much that was short-lived.
pub fn return_free_pages() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: `malloc_trim` locks the heap as any allocation does, and moves nothing.
    unsafe {
        libc::malloc_trim(0);
    }
}
