//! Four elements at a time, with AVX2 and FMA.
//!
//! Private to the crate: a value may exist only on a machine that has the instructions, and every function
//! here becomes instructions only when it is inlined into a wrapper that enables them.

use std::{
    arch::x86_64::*,
    ops::{Add, Div, Mul, Neg, Sub},
};

use super::{Lane, apart::Apart};

/// Four f64 in a register.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(__m256d);

/// Four entries, by four loads and their joining: the gather of one instruction takes as long or, on some machines, twice
/// as long.
///
/// # Safety
/// As [`Lane::gather`] of four lanes, in a wrapper that has AVX2.
#[inline(always)]
pub(super) unsafe fn four(from: &[f64], indices: &[u32], at: usize) -> __m256d {
    // SAFETY: the caller's.
    unsafe {
        let (first, entries) = (indices.as_ptr().add(at), from.as_ptr());
        let low = _mm_load_sd(entries.add(*first as usize));
        let low = _mm_loadh_pd(low, entries.add(*first.add(1) as usize));
        let high = _mm_load_sd(entries.add(*first.add(2) as usize));
        let high = _mm_loadh_pd(high, entries.add(*first.add(3) as usize));
        _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(low), high)
    }
}

/// Evaluates intrinsics on register values.
macro_rules! avx2 {
    ($e:expr) => {
        // SAFETY: the kernels that hold an Avx2 run inside a wrapper chosen by Width::available.
        unsafe { $e }
    };
}

macro_rules! operator {
    ($name:ident, $method:ident, $intrinsic:ident) => {
        impl $name for Avx2 {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(avx2!($intrinsic(self.0, other.0)))
            }
        }
    };
}
operator!(Add, add, _mm256_add_pd);
operator!(Sub, sub, _mm256_sub_pd);
operator!(Mul, mul, _mm256_mul_pd);
operator!(Div, div, _mm256_div_pd);

impl Neg for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(avx2!(_mm256_xor_pd(self.0, _mm256_set1_pd(-0.0))))
    }
}

impl Lane for Avx2 {
    const N: usize = 4;
    type Mask = __m256d;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(avx2!(_mm256_set1_pd(x)))
    }

    #[inline(always)]
    unsafe fn load(from: &[f64], at: usize) -> Self {
        debug_assert!(at + 4 <= from.len(), "load {at} of {}", from.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX2.
        Self(unsafe { _mm256_loadu_pd(from.as_ptr().add(at)) })
    }

    #[inline(always)]
    unsafe fn store(self, to: &mut [f64], at: usize) {
        debug_assert!(at + 4 <= to.len(), "store {at} of {}", to.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX2.
        unsafe { _mm256_storeu_pd(to.as_mut_ptr().add(at), self.0) };
    }

    #[inline(always)]
    unsafe fn gather(from: &[f64], indices: &[u32], at: usize) -> Self {
        debug_assert!(at + 4 <= indices.len(), "gather {at} of {}", indices.len());
        // SAFETY: the caller keeps the lanes and the indices inside; the wrapper has AVX2.
        Self(unsafe { four(from, indices, at) })
    }

    #[inline(always)]
    unsafe fn rows(from: &[[f64; 4]], indices: &[u32], at: usize) -> [Self; 4] {
        debug_assert!(at + 4 <= indices.len(), "rows {at} of {}", indices.len());
        // SAFETY: the caller keeps the lanes and the indices inside; the wrapper has AVX2.
        unsafe {
            let (first, rows) = (indices.as_ptr().add(at), from.as_ptr());
            let a = _mm256_loadu_pd(rows.add(*first as usize).cast());
            let b = _mm256_loadu_pd(rows.add(*first.add(1) as usize).cast());
            let c = _mm256_loadu_pd(rows.add(*first.add(2) as usize).cast());
            let d = _mm256_loadu_pd(rows.add(*first.add(3) as usize).cast());
            let (low, high) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            let (next_low, next_high) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
            [
                Self(_mm256_permute2f128_pd::<0x20>(low, next_low)),
                Self(_mm256_permute2f128_pd::<0x20>(high, next_high)),
                Self(_mm256_permute2f128_pd::<0x31>(low, next_low)),
                Self(_mm256_permute2f128_pd::<0x31>(high, next_high)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn whole(from: &[u32], at: usize) -> Self {
        debug_assert!(at + 4 <= from.len(), "whole {at} of {}", from.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX2.
        Self(unsafe { _mm256_cvtepi32_pd(_mm_loadu_si128(from.as_ptr().add(at).cast())) })
    }

    #[inline(always)]
    unsafe fn store_whole(self, to: &mut [u32], at: usize) {
        debug_assert!(at + 4 <= to.len(), "store whole {at} of {}", to.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX2.
        unsafe { _mm_storeu_si128(to.as_mut_ptr().add(at).cast(), _mm256_cvttpd_epi32(self.0)) };
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(avx2!(_mm256_fmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(avx2!(_mm256_fnmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(avx2!(_mm256_sqrt_pd(self.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx2!(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(avx2!(_mm256_min_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(avx2!(_mm256_max_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn max_magnitude(self, other: Self) -> Self {
        self.abs().max(other.abs())
    }

    #[inline(always)]
    fn less(self, other: Self) -> __m256d {
        avx2!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn less_equal(self, other: Self) -> __m256d {
        avx2!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn equal(self, other: Self) -> __m256d {
        avx2!(_mm256_cmp_pd::<_CMP_EQ_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn mask(bits: u32) -> __m256d {
        avx2!({
            let one_each = _mm256_set_epi64x(8, 4, 2, 1);
            let chosen = _mm256_and_si256(_mm256_set1_epi64x(i64::from(bits)), one_each);
            _mm256_castsi256_pd(_mm256_cmpeq_epi64(chosen, one_each))
        })
    }

    #[inline(always)]
    fn both(one: __m256d, other: __m256d) -> __m256d {
        avx2!(_mm256_and_pd(one, other))
    }

    #[inline(always)]
    fn either(one: __m256d, other: __m256d) -> __m256d {
        avx2!(_mm256_or_pd(one, other))
    }

    #[inline(always)]
    fn select(mask: __m256d, yes: Self, no: Self) -> Self {
        Self(avx2!(_mm256_blendv_pd(no.0, yes.0, mask)))
    }

    #[inline(always)]
    fn bits(mask: __m256d) -> u32 {
        avx2!(_mm256_movemask_pd(mask)) as u32
    }

    #[inline(always)]
    fn split(self) -> (Self, Self) {
        avx2!({
            let bits = _mm256_castpd_si256(self.0);
            let one = _mm256_set1_epi64x(0x3ff0_0000_0000_0000);
            let from_sqrt_half = _mm256_set1_epi64x(0x3ff0_0000_0000_0000 - 0x3fe6_a09e_667f_3bcd);
            let biased = _mm256_srli_epi64::<52>(_mm256_add_epi64(bits, from_sqrt_half));
            let mantissa = _mm256_add_epi64(_mm256_sub_epi64(bits, _mm256_slli_epi64::<52>(biased)), one);
            let whole = _mm256_castsi256_pd(_mm256_or_si256(biased, _mm256_set1_epi64x(0x433 << 52)));
            let k = _mm256_sub_pd(whole, _mm256_set1_pd(4_503_599_627_370_496.0 + 1023.0));
            (Self(k), Self(_mm256_castsi256_pd(mantissa)))
        })
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(avx2!({
            let biased = _mm256_add_pd(self.0, _mm256_set1_pd(4_503_599_627_370_496.0 + 1023.0));
            _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(biased)))
        }))
    }

    #[inline(always)]
    fn shifted_up(self) -> (Self, f64) {
        avx2!({
            let turned = _mm256_permute4x64_pd::<0b10_01_00_11>(self.0);
            let shifted = _mm256_blend_pd::<0b0001>(turned, _mm256_setzero_pd());
            (Self(shifted), _mm256_cvtsd_f64(turned))
        })
    }

    #[inline(always)]
    fn apart<T: Apart>(task: T) {
        // SAFETY: the machine has the instructions, see the head of the file.
        unsafe { task.run_on_avx2() }
    }
}
