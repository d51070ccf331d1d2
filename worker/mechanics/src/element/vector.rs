//! Vectors and tensors of three dimensions on lanes.

use crate::lanes::Lane;

#[derive(Clone, Copy)]
pub(crate) struct Vector<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

impl<L: Lane> Vector<L> {
    /// `self . other`.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> L {
        self.x.mul_add(other.x, self.y.mul_add(other.y, self.z * other.z))
    }

    /// `self x other`.
    #[inline(always)]
    pub fn cross(&self, other: &Self) -> Self {
        Self {
            x: self.z.neg_mul_add(other.y, self.y * other.z),
            y: self.x.neg_mul_add(other.z, self.z * other.x),
            z: self.y.neg_mul_add(other.x, self.x * other.y),
        }
    }

    /// `self x other + addend`.
    #[inline(always)]
    pub fn cross_add(&self, other: &Self, addend: &Self) -> Self {
        Self {
            x: self.z.neg_mul_add(other.y, self.y.mul_add(other.z, addend.x)),
            y: self.x.neg_mul_add(other.z, self.z.mul_add(other.x, addend.y)),
            z: self.y.neg_mul_add(other.x, self.x.mul_add(other.y, addend.z)),
        }
    }

    /// `self * factor`.
    #[inline(always)]
    pub fn scaled(&self, factor: L) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    /// `self * factor + other`.
    #[inline(always)]
    pub fn mul_add(&self, factor: L, other: &Self) -> Self {
        Self {
            x: self.x.mul_add(factor, other.x),
            y: self.y.mul_add(factor, other.y),
            z: self.z.mul_add(factor, other.z),
        }
    }

    /// `other - self * factor`.
    #[inline(always)]
    pub fn neg_mul_add(&self, factor: L, other: &Self) -> Self {
        Self {
            x: self.x.neg_mul_add(factor, other.x),
            y: self.y.neg_mul_add(factor, other.y),
            z: self.z.neg_mul_add(factor, other.z),
        }
    }
}

/// A tensor, by rows.
#[derive(Clone, Copy)]
pub(crate) struct Tensor<L> {
    pub x: Vector<L>,
    pub y: Vector<L>,
    pub z: Vector<L>,
}

impl<L: Lane> Tensor<L> {
    /// The dyad `a b^T`.
    #[inline(always)]
    pub fn outer(a: &Vector<L>, b: &Vector<L>) -> Self {
        Self { x: b.scaled(a.x), y: b.scaled(a.y), z: b.scaled(a.z) }
    }

    /// `self + a b^T`.
    #[inline(always)]
    pub fn outer_add(&self, a: &Vector<L>, b: &Vector<L>) -> Self {
        Self { x: b.mul_add(a.x, &self.x), y: b.mul_add(a.y, &self.y), z: b.mul_add(a.z, &self.z) }
    }

    /// `self * factor`.
    #[inline(always)]
    pub fn scaled(&self, factor: L) -> Self {
        Self { x: self.x.scaled(factor), y: self.y.scaled(factor), z: self.z.scaled(factor) }
    }

    /// `self b`.
    #[inline(always)]
    pub fn apply(&self, b: &Vector<L>) -> Vector<L> {
        Vector { x: self.x.dot(b), y: self.y.dot(b), z: self.z.dot(b) }
    }
}
