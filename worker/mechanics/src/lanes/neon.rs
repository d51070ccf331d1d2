//! Two elements at a time, with NEON, which every 64-bit ARM has.

use std::{
    arch::aarch64::*,
    ops::{Add, Div, Mul, Neg, Sub},
};

use super::{Lane, apart::Apart};

/// Two f64 in a register.
#[derive(Clone, Copy)]
pub(crate) struct Neon(float64x2_t);

/// Evaluates intrinsics on register values.
macro_rules! neon {
    ($e:expr) => {
        // SAFETY: every 64-bit ARM has NEON.
        unsafe { $e }
    };
}

macro_rules! operator {
    ($name:ident, $method:ident, $intrinsic:ident) => {
        impl $name for Neon {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(neon!($intrinsic(self.0, other.0)))
            }
        }
    };
}
operator!(Add, add, vaddq_f64);
operator!(Sub, sub, vsubq_f64);
operator!(Mul, mul, vmulq_f64);
operator!(Div, div, vdivq_f64);

impl Neg for Neon {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(neon!(vnegq_f64(self.0)))
    }
}

impl Lane for Neon {
    const N: usize = 2;
    type Mask = uint64x2_t;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(neon!(vdupq_n_f64(x)))
    }

    #[inline(always)]
    unsafe fn load(from: &[f64], at: usize) -> Self {
        debug_assert!(at + 2 <= from.len(), "load {at} of {}", from.len());
        // SAFETY: the caller keeps the lanes inside.
        Self(unsafe { vld1q_f64(from.as_ptr().add(at)) })
    }

    #[inline(always)]
    unsafe fn store(self, to: &mut [f64], at: usize) {
        debug_assert!(at + 2 <= to.len(), "store {at} of {}", to.len());
        // SAFETY: the caller keeps the lanes inside.
        unsafe { vst1q_f64(to.as_mut_ptr().add(at), self.0) };
    }

    #[inline(always)]
    unsafe fn gather(from: &[f64], indices: &[u32], at: usize) -> Self {
        debug_assert!(at + 2 <= indices.len(), "gather {at} of {}", indices.len());
        // SAFETY: the caller keeps the lanes and the indices inside.
        unsafe {
            let (first, entries) = (indices.as_ptr().add(at), from.as_ptr());
            let low = vld1_f64(entries.add(*first as usize));
            Self(vcombine_f64(low, vld1_f64(entries.add(*first.add(1) as usize))))
        }
    }

    #[inline(always)]
    unsafe fn rows(from: &[[f64; 4]], indices: &[u32], at: usize) -> [Self; 4] {
        debug_assert!(at + 2 <= indices.len(), "rows {at} of {}", indices.len());
        // SAFETY: the caller keeps the lanes and the indices inside.
        unsafe {
            let first = indices.as_ptr().add(at);
            let a: *const f64 = from.as_ptr().add(*first as usize).cast();
            let b: *const f64 = from.as_ptr().add(*first.add(1) as usize).cast();
            let (low_a, high_a) = (vld1q_f64(a), vld1q_f64(a.add(2)));
            let (low_b, high_b) = (vld1q_f64(b), vld1q_f64(b.add(2)));
            [
                Self(vtrn1q_f64(low_a, low_b)),
                Self(vtrn2q_f64(low_a, low_b)),
                Self(vtrn1q_f64(high_a, high_b)),
                Self(vtrn2q_f64(high_a, high_b)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn whole(from: &[u32], at: usize) -> Self {
        debug_assert!(at + 2 <= from.len(), "whole {at} of {}", from.len());
        // SAFETY: the caller keeps the lanes inside.
        Self(unsafe { vcvtq_f64_u64(vmovl_u32(vld1_u32(from.as_ptr().add(at)))) })
    }

    #[inline(always)]
    unsafe fn store_whole(self, to: &mut [u32], at: usize) {
        debug_assert!(at + 2 <= to.len(), "store whole {at} of {}", to.len());
        // SAFETY: the caller keeps the lanes inside.
        unsafe { vst1_u32(to.as_mut_ptr().add(at), vmovn_u64(vcvtq_u64_f64(self.0))) };
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(neon!(vfmaq_f64(c.0, self.0, b.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(neon!(vfmsq_f64(c.0, self.0, b.0)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(neon!(vsqrtq_f64(self.0)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(neon!(vabsq_f64(self.0)))
    }

    // NEON's own least and greatest have another rule for NaN and signed zeros.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.less(other), self, other)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.less(self), self, other)
    }

    #[inline(always)]
    fn max_magnitude(self, other: Self) -> Self {
        self.abs().max(other.abs())
    }

    #[inline(always)]
    fn less(self, other: Self) -> uint64x2_t {
        neon!(vcltq_f64(self.0, other.0))
    }

    #[inline(always)]
    fn less_equal(self, other: Self) -> uint64x2_t {
        neon!(vcleq_f64(self.0, other.0))
    }

    #[inline(always)]
    fn equal(self, other: Self) -> uint64x2_t {
        neon!(vceqq_f64(self.0, other.0))
    }

    #[inline(always)]
    fn mask(bits: u32) -> uint64x2_t {
        neon!({
            let one_each = vcombine_u64(vcreate_u64(1), vcreate_u64(2));
            vtstq_u64(vdupq_n_u64(u64::from(bits)), one_each)
        })
    }

    #[inline(always)]
    fn both(one: uint64x2_t, other: uint64x2_t) -> uint64x2_t {
        neon!(vandq_u64(one, other))
    }

    #[inline(always)]
    fn either(one: uint64x2_t, other: uint64x2_t) -> uint64x2_t {
        neon!(vorrq_u64(one, other))
    }

    #[inline(always)]
    fn select(mask: uint64x2_t, yes: Self, no: Self) -> Self {
        Self(neon!(vbslq_f64(mask, yes.0, no.0)))
    }

    #[inline(always)]
    fn bits(mask: uint64x2_t) -> u32 {
        neon!(vgetq_lane_u64::<0>(mask) & 1 | vgetq_lane_u64::<1>(mask) & 2) as u32
    }

    #[inline(always)]
    fn split(self) -> (Self, Self) {
        neon!({
            let bits = vreinterpretq_u64_f64(self.0);
            let one = vdupq_n_u64(0x3ff0_0000_0000_0000);
            let from_sqrt_half = vdupq_n_u64(0x3ff0_0000_0000_0000 - 0x3fe6_a09e_667f_3bcd);
            let biased = vshrq_n_u64::<52>(vaddq_u64(bits, from_sqrt_half));
            let mantissa = vaddq_u64(vsubq_u64(bits, vshlq_n_u64::<52>(biased)), one);
            let k = vsubq_f64(vcvtq_f64_u64(biased), vdupq_n_f64(1023.0));
            (Self(k), Self(vreinterpretq_f64_u64(mantissa)))
        })
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(neon!({
            let biased = vaddq_f64(self.0, vdupq_n_f64(4_503_599_627_370_496.0 + 1023.0));
            vreinterpretq_f64_u64(vshlq_n_u64::<52>(vreinterpretq_u64_f64(biased)))
        }))
    }

    #[inline(always)]
    fn shifted_up(self) -> (Self, f64) {
        neon!((Self(vextq_f64::<1>(vdupq_n_f64(0.0), self.0)), vgetq_lane_f64::<1>(self.0)))
    }

    #[inline(always)]
    fn apart<T: Apart>(task: T) {
        task.run_plain();
    }
}
