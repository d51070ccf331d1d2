//! Vectors on lanes, in the operations of those of one pair.

use crate::lanes::Lane;

/// A vector or point in each lane.
pub(super) type V<L> = [L; 3];

/// Points of nodes, a row each of which the last entry is nothing.
///
/// # Safety
/// As [`Lane::rows`].
#[inline(always)]
pub(super) unsafe fn points<L: Lane>(rows: &[[f64; 4]], indices: &[u32], at: usize) -> V<L> {
    // SAFETY: the caller's.
    let [x, y, z, _] = unsafe { L::rows(rows, indices, at) };
    [x, y, z]
}

/// Corners of faces: [`points`] of four lists.
///
/// # Safety
/// As [`Lane::rows`] of each list.
#[inline(always)]
pub(super) unsafe fn corners<L: Lane>(rows: &[[f64; 4]], of: &[Vec<u32>; 4], at: usize) -> [V<L>; 4] {
    // SAFETY: the caller's.
    unsafe {
        [
            points(rows, &of[0], at),
            points(rows, &of[1], at),
            points(rows, &of[2], at),
            points(rows, &of[3], at),
        ]
    }
}

/// From each corner to a point.
#[inline(always)]
pub(super) fn from_each<L: Lane>(x: &[V<L>; 4], p: V<L>) -> [V<L>; 4] {
    [sub(p, x[0]), sub(p, x[1]), sub(p, x[2]), sub(p, x[3])]
}

#[inline(always)]
pub(super) fn sub<L: Lane>(a: V<L>, b: V<L>) -> V<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn dot<L: Lane>(a: V<L>, b: V<L>) -> L {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(super) fn cross<L: Lane>(a: V<L>, b: V<L>) -> V<L> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// `a - s b`.
#[inline(always)]
pub(super) fn before<L: Lane>(a: V<L>, s: L, b: V<L>) -> V<L> {
    [s.neg_mul_add(b[0], a[0]), s.neg_mul_add(b[1], a[1]), s.neg_mul_add(b[2], a[2])]
}

/// `a + s b`.
#[inline(always)]
pub(super) fn along<L: Lane>(a: V<L>, s: L, b: V<L>) -> V<L> {
    [s.mul_add(b[0], a[0]), s.mul_add(b[1], a[1]), s.mul_add(b[2], a[2])]
}

#[inline(always)]
pub(super) fn choose<L: Lane>(mask: L::Mask, yes: V<L>, no: V<L>) -> V<L> {
    [L::select(mask, yes[0], no[0]), L::select(mask, yes[1], no[1]), L::select(mask, yes[2], no[2])]
}

/// `1 / l`, zero for zero.
#[inline(always)]
pub(super) fn inverse<L: Lane>(l: L) -> L {
    let zero = L::splat(0.0);
    L::select(zero.less(l), L::splat(1.0) / l, zero)
}

/// Mean of four.
#[inline(always)]
pub(super) fn middle<L: Lane>(x: &[V<L>; 4]) -> V<L> {
    let quarter = L::splat(0.25);
    [
        quarter * ((x[0][0] + x[1][0]) + (x[2][0] + x[3][0])),
        quarter * ((x[0][1] + x[1][1]) + (x[2][1] + x[3][1])),
        quarter * ((x[0][2] + x[1][2]) + (x[2][2] + x[3][2])),
    ]
}
