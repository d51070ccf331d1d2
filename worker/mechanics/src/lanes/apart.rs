//! Parts of a task that are compiled once for each width.

/// A part of a calculation on lanes that is a function of its own, called by [`super::Lane::apart`]: a law that is long and stands in many
/// kernels is then compiled once for each width. Arguments and answers go through memory, so it does the work of a whole set. [`Apart::run`]
/// is to be `#[inline(always)]`, as that of a [`super::dispatch::Task`].
pub trait Apart: Sized {
    /// Does the work; the task holds references to what it changes.
    fn run(self);

    /// [`Apart::run`] of lanes that need no instructions of their own.
    #[doc(hidden)]
    #[inline(never)]
    fn run_plain(self) {
        self.run();
    }

    /// # Safety
    /// The machine has FMA.
    #[cfg(target_arch = "x86_64")]
    #[doc(hidden)]
    #[target_feature(enable = "fma")]
    #[inline(never)]
    unsafe fn run_on_fma(self) {
        self.run();
    }

    /// # Safety
    /// The machine has [`super::Width::Avx2`].
    #[cfg(target_arch = "x86_64")]
    #[doc(hidden)]
    #[target_feature(enable = "avx2,fma")]
    #[inline(never)]
    unsafe fn run_on_avx2(self) {
        super::dispatch::align_stack();
        self.run();
    }

    /// # Safety
    /// The machine has [`super::Width::Avx512`].
    #[cfg(target_arch = "x86_64")]
    #[doc(hidden)]
    #[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
    #[inline(never)]
    unsafe fn run_on_avx512(self) {
        self.run();
    }
}
