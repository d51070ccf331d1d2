//! Two registers as one: the chains of the one fill what the other waits for.
//!
//! Where a set of eight takes two registers, an element kernel waits for its long chain of roots and quotients twice over
//! when it does one after the other; both together are faster in spite of twice the values to keep.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Lane, apart::Apart};

/// The lanes of one register and, behind them, those of another.
#[derive(Clone, Copy)]
pub(crate) struct Twice<L>(L, L);

macro_rules! operator {
    ($name:ident, $method:ident) => {
        impl<L: Lane> $name for Twice<L> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<L: Lane> Neg for Twice<L> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<L: Lane> Lane for Twice<L> {
    const N: usize = 2 * L::N;
    type Mask = (L::Mask, L::Mask);

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(L::splat(x), L::splat(x))
    }

    #[inline(always)]
    unsafe fn load(from: &[f64], at: usize) -> Self {
        // SAFETY: the caller keeps the lanes of both inside.
        unsafe { Self(L::load(from, at), L::load(from, at + L::N)) }
    }

    #[inline(always)]
    unsafe fn store(self, to: &mut [f64], at: usize) {
        // SAFETY: the caller keeps the lanes of both inside.
        unsafe {
            self.0.store(to, at);
            self.1.store(to, at + L::N);
        }
    }

    #[inline(always)]
    unsafe fn gather(from: &[f64], indices: &[u32], at: usize) -> Self {
        // SAFETY: the caller keeps lanes and indices of both inside.
        unsafe { Self(L::gather(from, indices, at), L::gather(from, indices, at + L::N)) }
    }

    #[inline(always)]
    unsafe fn rows(from: &[[f64; 4]], indices: &[u32], at: usize) -> [Self; 4] {
        // SAFETY: the caller keeps lanes and indices of both inside.
        let ([a, b, c, d], [e, f, g, h]) =
            unsafe { (L::rows(from, indices, at), L::rows(from, indices, at + L::N)) };
        [Self(a, e), Self(b, f), Self(c, g), Self(d, h)]
    }

    #[inline(always)]
    unsafe fn whole(from: &[u32], at: usize) -> Self {
        // SAFETY: the caller keeps the lanes of both inside.
        unsafe { Self(L::whole(from, at), L::whole(from, at + L::N)) }
    }

    #[inline(always)]
    unsafe fn store_whole(self, to: &mut [u32], at: usize) {
        // SAFETY: the caller keeps the lanes of both inside.
        unsafe {
            self.0.store_whole(to, at);
            self.1.store_whole(to, at + L::N);
        }
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(self.0.mul_add(b.0, c.0), self.1.mul_add(b.1, c.1))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(self.0.neg_mul_add(b.0, c.0), self.1.neg_mul_add(b.1, c.1))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }

    #[inline(always)]
    fn max_magnitude(self, other: Self) -> Self {
        Self(self.0.max_magnitude(other.0), self.1.max_magnitude(other.1))
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        (self.0.less(other.0), self.1.less(other.1))
    }

    #[inline(always)]
    fn less_equal(self, other: Self) -> Self::Mask {
        (self.0.less_equal(other.0), self.1.less_equal(other.1))
    }

    #[inline(always)]
    fn equal(self, other: Self) -> Self::Mask {
        (self.0.equal(other.0), self.1.equal(other.1))
    }

    #[inline(always)]
    fn mask(bits: u32) -> Self::Mask {
        (L::mask(bits), L::mask(bits >> L::N))
    }

    #[inline(always)]
    fn both(one: Self::Mask, other: Self::Mask) -> Self::Mask {
        (L::both(one.0, other.0), L::both(one.1, other.1))
    }

    #[inline(always)]
    fn either(one: Self::Mask, other: Self::Mask) -> Self::Mask {
        (L::either(one.0, other.0), L::either(one.1, other.1))
    }

    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(L::select(mask.0, yes.0, no.0), L::select(mask.1, yes.1, no.1))
    }

    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        L::bits(mask.0) | L::bits(mask.1) << L::N
    }

    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let ((k0, m0), (k1, m1)) = (self.0.split(), self.1.split());
        (Self(k0, k1), Self(m0, m1))
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(self.0.power_of_two(), self.1.power_of_two())
    }

    #[inline(always)]
    fn shifted_up(self) -> (Self, f64) {
        // What falls out of the one goes into the first lane of the other.
        let ((low, carry), (high, last)) = (self.0.shifted_up(), self.1.shifted_up());
        (Self(low, L::select(L::mask(1), L::splat(carry), high)), last)
    }

    #[inline(always)]
    fn apart<T: Apart>(task: T) {
        L::apart(task);
    }
}
