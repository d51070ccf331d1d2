//! Eight elements at a time, with AVX-512 F and DQ.
//!
//! Private to the crate: a value may exist only on a machine that has the instructions, and every function
//! here becomes instructions only when it is inlined into a wrapper that enables them.

use std::{
    arch::x86_64::*,
    ops::{Add, Div, Mul, Neg, Sub},
};

use super::{Lane, apart::Apart, avx2::four};

/// Eight f64 in a register.
#[derive(Clone, Copy)]
pub(crate) struct Avx512(__m512d);

/// The rows at `indices[at]` and, `apart` further on in the list, behind it.
///
/// # Safety
/// Both places of the list and the rows exist; in a wrapper that has AVX-512.
#[inline(always)]
unsafe fn two_rows(from: &[[f64; 4]], indices: &[u32], at: usize, apart: usize) -> __m512d {
    // SAFETY: the caller's.
    unsafe {
        let (first, rows) = (indices.as_ptr().add(at), from.as_ptr());
        let low = _mm256_loadu_pd(rows.add(*first as usize).cast());
        let high = _mm256_loadu_pd(rows.add(*first.add(apart) as usize).cast());
        _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high)
    }
}

/// Evaluates intrinsics on register values.
macro_rules! avx512 {
    ($e:expr) => {
        // SAFETY: the kernels that hold an Avx512 run inside a wrapper chosen by Width::available.
        unsafe { $e }
    };
}

macro_rules! operator {
    ($name:ident, $method:ident, $intrinsic:ident) => {
        impl $name for Avx512 {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(avx512!($intrinsic(self.0, other.0)))
            }
        }
    };
}
operator!(Add, add, _mm512_add_pd);
operator!(Sub, sub, _mm512_sub_pd);
operator!(Mul, mul, _mm512_mul_pd);
operator!(Div, div, _mm512_div_pd);

impl Neg for Avx512 {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(avx512!(_mm512_xor_pd(self.0, _mm512_set1_pd(-0.0))))
    }
}

impl Lane for Avx512 {
    const N: usize = 8;
    type Mask = __mmask8;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(avx512!(_mm512_set1_pd(x)))
    }

    #[inline(always)]
    unsafe fn load(from: &[f64], at: usize) -> Self {
        debug_assert!(at + 8 <= from.len(), "load {at} of {}", from.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX-512.
        Self(unsafe { _mm512_loadu_pd(from.as_ptr().add(at)) })
    }

    #[inline(always)]
    unsafe fn store(self, to: &mut [f64], at: usize) {
        debug_assert!(at + 8 <= to.len(), "store {at} of {}", to.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX-512.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr().add(at), self.0) };
    }

    #[inline(always)]
    unsafe fn gather(from: &[f64], indices: &[u32], at: usize) -> Self {
        debug_assert!(at + 8 <= indices.len(), "gather {at} of {}", indices.len());
        // Eight loads and their joining: the gather of one instruction takes as long or, on some machines, twice as long.
        // SAFETY: the caller keeps the lanes and the indices inside; the wrapper has AVX-512.
        Self(unsafe {
            let (low, high) = (four(from, indices, at), four(from, indices, at + 4));
            _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high)
        })
    }

    #[inline(always)]
    unsafe fn rows(from: &[[f64; 4]], indices: &[u32], at: usize) -> [Self; 4] {
        debug_assert!(at + 8 <= indices.len(), "rows {at} of {}", indices.len());
        // SAFETY: the caller keeps the lanes and the indices inside; the wrapper has AVX-512.
        unsafe {
            // Rows 0 and 2, 1 and 3, 4 and 6, 5 and 7 share a register: then two steps put all in order.
            let (a, b) = (two_rows(from, indices, at, 2), two_rows(from, indices, at + 1, 2));
            let (c, d) = (two_rows(from, indices, at + 4, 2), two_rows(from, indices, at + 5, 2));
            let (low, high) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
            let (next_low, next_high) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
            [
                Self(_mm512_shuffle_f64x2::<0b10_00_10_00>(low, next_low)),
                Self(_mm512_shuffle_f64x2::<0b10_00_10_00>(high, next_high)),
                Self(_mm512_shuffle_f64x2::<0b11_01_11_01>(low, next_low)),
                Self(_mm512_shuffle_f64x2::<0b11_01_11_01>(high, next_high)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn whole(from: &[u32], at: usize) -> Self {
        debug_assert!(at + 8 <= from.len(), "whole {at} of {}", from.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX-512.
        Self(unsafe { _mm512_cvtepi32_pd(_mm256_loadu_si256(from.as_ptr().add(at).cast())) })
    }

    #[inline(always)]
    unsafe fn store_whole(self, to: &mut [u32], at: usize) {
        debug_assert!(at + 8 <= to.len(), "store whole {at} of {}", to.len());
        // SAFETY: the caller keeps the lanes inside; the wrapper has AVX-512.
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().add(at).cast(), _mm512_cvttpd_epi32(self.0)) };
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(avx512!(_mm512_fmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(avx512!(_mm512_fnmadd_pd(self.0, b.0, c.0)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(avx512!(_mm512_sqrt_pd(self.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx512!(_mm512_andnot_pd(_mm512_set1_pd(-0.0), self.0)))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(avx512!(_mm512_min_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(avx512!(_mm512_max_pd(self.0, other.0)))
    }

    #[inline(always)]
    fn max_magnitude(self, other: Self) -> Self {
        // Larger absolute value, sign cleared.
        Self(avx512!(_mm512_range_pd::<0b1011>(self.0, other.0)))
    }

    #[inline(always)]
    fn less(self, other: Self) -> __mmask8 {
        avx512!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn less_equal(self, other: Self) -> __mmask8 {
        avx512!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn equal(self, other: Self) -> __mmask8 {
        avx512!(_mm512_cmp_pd_mask::<_CMP_EQ_OQ>(self.0, other.0))
    }

    #[inline(always)]
    fn mask(bits: u32) -> __mmask8 {
        bits as u8
    }

    #[inline(always)]
    fn both(one: __mmask8, other: __mmask8) -> __mmask8 {
        one & other
    }

    #[inline(always)]
    fn either(one: __mmask8, other: __mmask8) -> __mmask8 {
        one | other
    }

    #[inline(always)]
    fn select(mask: __mmask8, yes: Self, no: Self) -> Self {
        Self(avx512!(_mm512_mask_blend_pd(mask, no.0, yes.0)))
    }

    #[inline(always)]
    fn bits(mask: __mmask8) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn split(self) -> (Self, Self) {
        avx512!({
            let bits = _mm512_castpd_si512(self.0);
            let one = _mm512_set1_epi64(0x3ff0_0000_0000_0000);
            let from_sqrt_half = _mm512_set1_epi64(0x3ff0_0000_0000_0000 - 0x3fe6_a09e_667f_3bcd);
            let biased = _mm512_srli_epi64::<52>(_mm512_add_epi64(bits, from_sqrt_half));
            let mantissa = _mm512_add_epi64(_mm512_sub_epi64(bits, _mm512_slli_epi64::<52>(biased)), one);
            let whole = _mm512_castsi512_pd(_mm512_or_si512(biased, _mm512_set1_epi64(0x433 << 52)));
            let k = _mm512_sub_pd(whole, _mm512_set1_pd(4_503_599_627_370_496.0 + 1023.0));
            (Self(k), Self(_mm512_castsi512_pd(mantissa)))
        })
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(avx512!({
            let biased = _mm512_add_pd(self.0, _mm512_set1_pd(4_503_599_627_370_496.0 + 1023.0));
            _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(biased)))
        }))
    }

    #[inline(always)]
    fn shifted_up(self) -> (Self, f64) {
        avx512!({
            let bits = _mm512_castpd_si512(self.0);
            let turned = _mm512_castsi512_pd(_mm512_alignr_epi64::<7>(bits, bits));
            let shifted = _mm512_maskz_mov_pd(0b1111_1110, turned);
            (Self(shifted), _mm512_cvtsd_f64(turned))
        })
    }

    #[inline(always)]
    fn apart<T: Apart>(task: T) {
        // SAFETY: the machine has the instructions, see the head of the file.
        unsafe { task.run_on_avx512() }
    }
}
