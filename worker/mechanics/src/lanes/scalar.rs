//! One element at a time: the reference whose bits the wide lanes have.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Lane, apart::Apart};

/// One f64.
#[derive(Clone, Copy, Debug)]
pub struct Scalar(pub f64);

const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
const ONE: u64 = 0x3ff0_0000_0000_0000;
/// `2^52 + 1023`.
const BIASED: f64 = 4_503_599_627_370_496.0 + 1023.0;

macro_rules! operator {
    ($name:ident, $method:ident) => {
        impl $name for Scalar {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($name::$method(self.0, other.0))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl Neg for Scalar {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Lane for Scalar {
    const N: usize = 1;
    type Mask = bool;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(x)
    }

    #[inline(always)]
    unsafe fn load(from: &[f64], at: usize) -> Self {
        debug_assert!(at < from.len(), "load {at} of {}", from.len());
        // SAFETY: the caller keeps `at` inside.
        Self(unsafe { *from.get_unchecked(at) })
    }

    #[inline(always)]
    unsafe fn store(self, to: &mut [f64], at: usize) {
        debug_assert!(at < to.len(), "store {at} of {}", to.len());
        // SAFETY: the caller keeps `at` inside.
        unsafe { *to.get_unchecked_mut(at) = self.0 };
    }

    #[inline(always)]
    unsafe fn gather(from: &[f64], indices: &[u32], at: usize) -> Self {
        debug_assert!(at < indices.len(), "gather {at} of {}", indices.len());
        // SAFETY: the caller keeps `at` and the index inside.
        Self(unsafe { *from.get_unchecked(*indices.get_unchecked(at) as usize) })
    }

    #[inline(always)]
    unsafe fn rows(from: &[[f64; 4]], indices: &[u32], at: usize) -> [Self; 4] {
        debug_assert!(at < indices.len(), "rows {at} of {}", indices.len());
        // SAFETY: the caller keeps `at` and the index inside.
        unsafe { from.get_unchecked(*indices.get_unchecked(at) as usize) }.map(Self)
    }

    #[inline(always)]
    unsafe fn whole(from: &[u32], at: usize) -> Self {
        debug_assert!(at < from.len(), "whole {at} of {}", from.len());
        // SAFETY: the caller keeps `at` inside.
        Self(f64::from(unsafe { *from.get_unchecked(at) }))
    }

    #[inline(always)]
    unsafe fn store_whole(self, to: &mut [u32], at: usize) {
        debug_assert!(at < to.len(), "store whole {at} of {}", to.len());
        // SAFETY: the caller keeps `at` inside.
        unsafe { *to.get_unchecked_mut(at) = self.0 as u32 };
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(self.0.mul_add(b.0, c.0))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self((-self.0).mul_add(b.0, c.0))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self.0 < other.0 { self } else { other }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.0 > other.0 { self } else { other }
    }

    #[inline(always)]
    fn max_magnitude(self, other: Self) -> Self {
        self.abs().max(other.abs())
    }

    #[inline(always)]
    fn less(self, other: Self) -> bool {
        self.0 < other.0
    }

    #[inline(always)]
    fn less_equal(self, other: Self) -> bool {
        self.0 <= other.0
    }

    #[inline(always)]
    fn equal(self, other: Self) -> bool {
        self.0 == other.0
    }

    #[inline(always)]
    fn mask(bits: u32) -> bool {
        bits & 1 == 1
    }

    #[inline(always)]
    fn both(one: bool, other: bool) -> bool {
        one & other
    }

    #[inline(always)]
    fn either(one: bool, other: bool) -> bool {
        one | other
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn bits(mask: bool) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let bits = self.0.to_bits();
        let biased = bits.wrapping_add(ONE - SQRT_HALF) >> 52;
        let mantissa = bits.wrapping_sub(biased << 52).wrapping_add(ONE);
        (Self(f64::from_bits(biased | 0x433 << 52) - BIASED), Self(f64::from_bits(mantissa)))
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(f64::from_bits((self.0 + BIASED).to_bits() << 52))
    }

    #[inline(always)]
    fn shifted_up(self) -> (Self, f64) {
        (Self(0.0), self.0)
    }

    #[inline(always)]
    fn apart<T: Apart>(task: T) {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("fma") {
            // SAFETY: the machine has FMA.
            return unsafe { task.run_on_fma() };
        }
        task.run_plain();
    }
}
