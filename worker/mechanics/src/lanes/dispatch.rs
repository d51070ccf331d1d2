//! The one place where a lane width becomes machine instructions.
//!
//! A [`Task`] is a calculation that is generic over its lanes, together with what it works on. [`Width::run`] calls it from a
//! function that has the target features of the width, and the task is inlined there: only so do its lanes become single
//! instructions. A call costs one branch and hands over one pointer, so a task covers many lane sets.

#[cfg(target_arch = "x86_64")]
use std::{hint::black_box, mem::MaybeUninit};

use super::{Lane, Width, scalar::Scalar};
#[cfg(target_arch = "x86_64")]
use super::{avx2::Avx2, avx512::Avx512, twice::Twice};
#[cfg(target_arch = "aarch64")]
use super::{neon::Neon, twice::Twice};

/// A calculation on lanes. [`Task::run`] is to be `#[inline(always)]`, and so is every function that it calls with lanes.
pub(crate) trait Task {
    /// The answer.
    type Output;

    /// Whether a set of eight is done in two registers at once where one holds four, see [`super::twice`].
    #[cfg_attr(not(target_arch = "x86_64"), expect(dead_code, reason = "no register of four"))]
    const PAIRED: bool = false;

    /// Does the work.
    fn run<L: Lane>(self) -> Self::Output;
}

impl Width {
    /// Does a task on this width. The answer does not depend on it.
    ///
    /// # Panics
    /// If the machine lacks the width, see [`Width::require`].
    pub(crate) fn run<T: Task>(self, task: T) -> T::Output {
        assert!(self.available(), "lane width {self} is not on this machine");
        match self {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the machine has the width.
            Width::Avx2 => unsafe { task.on_avx2() },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            Width::Avx512 => unsafe { task.on_avx512() },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the machine has FMA.
            Width::Scalar if is_x86_feature_detected!("fma") => unsafe { task.on_scalar_with_fma() },
            #[cfg(target_arch = "aarch64")]
            Width::Neon => task.run::<Twice<Neon>>(),
            _ => task.on_scalar(),
        }
    }

    /// [`Width::run`] of a task that is compiled for wide lanes alone.
    ///
    /// # Panics
    /// If this is [`Width::Scalar`] or the machine lacks it.
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64")),
        expect(unused_variables, reason = "one lane alone")
    )]
    pub(crate) fn run_wide<T: Task>(self, task: T) -> T::Output {
        assert!(self.available(), "lane width {self} is not on this machine");
        match self {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the machine has the width.
            Width::Avx2 => unsafe { task.on_avx2() },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            Width::Avx512 => unsafe { task.on_avx512() },
            #[cfg(target_arch = "aarch64")]
            Width::Neon => task.run::<Twice<Neon>>(),
            _ => panic!("a task for wide lanes alone"),
        }
    }
}

/// Has the function that it is inlined into put its spilled registers on places aligned to them. By itself the compiler aligns the stack only where a
/// variable asks for it; else half of the callers leave every second spilled register of 32 bytes across two cache lines, by luck. With the registers of
/// AVX-512, of which there are twice as many, it costs 3 % instead (a Taylor bar, a sphere at 6 km/s).
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(super) fn align_stack() {
    #[repr(align(64))]
    struct Line {
        _bytes: [u8; 64],
    }
    black_box(&MaybeUninit::<Line>::uninit());
}

/// The functions that have the target features of a width. They are methods of the task, not free, because the compiler puts a method into
/// the code unit of the module of its type: all kernels in one unit would be compiled one after the other and in twice the memory.
trait Entry: Task + Sized {
    /// Without the feature a fused product is a call into the library, with the same bits.
    ///
    /// # Safety
    /// The machine has FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "fma")]
    unsafe fn on_scalar_with_fma(self) -> Self::Output {
        self.run::<Scalar>()
    }

    /// Whatever the machine has.
    #[inline(never)]
    fn on_scalar(self) -> Self::Output {
        self.run::<Scalar>()
    }

    /// # Safety
    /// The machine has [`Width::Avx2`].
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn on_avx2(self) -> Self::Output {
        align_stack();
        if Self::PAIRED { self.run::<Twice<Avx2>>() } else { self.run::<Avx2>() }
    }

    /// # Safety
    /// The machine has [`Width::Avx512`].
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
    unsafe fn on_avx512(self) -> Self::Output {
        self.run::<Avx512>()
    }
}

impl<T: Task> Entry for T {}
