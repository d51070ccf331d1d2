//! Principal values and axes of a symmetric tensor by Jacobi's rotations: the same steps for every lane, no function but roots.

use super::{Deviator, finite_strain::Symmetric};
use crate::{element::vector::Vector, lanes::Lane};

/// Sweeps of Jacobi's rotations: each squares what is left beside the diagonal.
const SWEEPS: usize = 6;

/// Turns the plane of two axes so that the entry `across` vanishes: tangent, cosine and sine of the angle.
#[inline(always)]
fn angle<L: Lane>(first: L, second: L, across: L) -> [L; 3] {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let flat = across.abs().less(L::splat(1e-150));
    let theta = (second - first) / (L::splat(2.0) * L::select(flat, one, across));
    let size = one / (theta.abs() + theta.mul_add(theta, one).sqrt());
    let tangent = L::select(flat, zero, L::select(theta.less(zero), -size, size));
    let cosine = one / tangent.mul_add(tangent, one).sqrt();
    [tangent, cosine, tangent * cosine]
}

/// Turns two axes by an angle.
#[inline(always)]
fn turn<L: Lane>(first: &mut Vector<L>, second: &mut Vector<L>, cosine: L, sine: L) {
    let before = *first;
    *first = second.neg_mul_add(sine, &before.scaled(cosine));
    *second = before.mul_add(sine, &second.scaled(cosine));
}

/// Principal values and axes of a symmetric tensor.
#[inline(always)]
pub(super) fn principal<L: Lane>(b: &Symmetric<L>) -> ([L; 3], [Vector<L>; 3]) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let mut b = *b;
    let mut x = Vector { x: one, y: zero, z: zero };
    let mut y = Vector { x: zero, y: one, z: zero };
    let mut z = Vector { x: zero, y: zero, z: one };
    let mut sweep = 0;
    while sweep < SWEEPS {
        let [tangent, cosine, sine] = angle(b.xx, b.yy, b.xy);
        (b.xx, b.yy) = (tangent.neg_mul_add(b.xy, b.xx), tangent.mul_add(b.xy, b.yy));
        (b.zx, b.yz) = (sine.neg_mul_add(b.yz, cosine * b.zx), sine.mul_add(b.zx, cosine * b.yz));
        b.xy = zero;
        turn(&mut x, &mut y, cosine, sine);
        let [tangent, cosine, sine] = angle(b.yy, b.zz, b.yz);
        (b.yy, b.zz) = (tangent.neg_mul_add(b.yz, b.yy), tangent.mul_add(b.yz, b.zz));
        (b.xy, b.zx) = (sine.neg_mul_add(b.zx, cosine * b.xy), sine.mul_add(b.xy, cosine * b.zx));
        b.yz = zero;
        turn(&mut y, &mut z, cosine, sine);
        let [tangent, cosine, sine] = angle(b.xx, b.zz, b.zx);
        (b.xx, b.zz) = (tangent.neg_mul_add(b.zx, b.xx), tangent.mul_add(b.zx, b.zz));
        (b.xy, b.yz) = (sine.neg_mul_add(b.yz, cosine * b.xy), sine.mul_add(b.xy, cosine * b.yz));
        b.zx = zero;
        turn(&mut x, &mut z, cosine, sine);
        sweep += 1;
    }
    ([b.xx, b.yy, b.zz], [x, y, z])
}

/// The greatest principal value of a deviator.
#[inline(always)]
pub(crate) fn greatest_principal<L: Lane>(s: &Deviator<L>) -> L {
    let Deviator { xx, yy, zz, xy, yz, zx } = *s;
    let ([x, y, z], _) = principal(&Symmetric { xx, yy, zz, xy, yz, zx });
    x.max(y).max(z)
}

/// The tensor with these values along these axes.
#[inline(always)]
pub(super) fn along<L: Lane>(values: &[L; 3], axes: &[Vector<L>; 3]) -> Deviator<L> {
    let mut whole = Deviator::zero();
    let mut axis = 0;
    while axis < 3 {
        let (n, s) = (&axes[axis], values[axis]);
        let (x, y, z) = (s * n.x, s * n.y, s * n.z);
        whole.xx = x.mul_add(n.x, whole.xx);
        whole.yy = y.mul_add(n.y, whole.yy);
        whole.zz = z.mul_add(n.z, whole.zz);
        whole.xy = x.mul_add(n.y, whole.xy);
        whole.yz = y.mul_add(n.z, whole.yz);
        whole.zx = z.mul_add(n.x, whole.zx);
        axis += 1;
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    #[test]
    fn principal_values_and_axes_make_the_tensor_again() {
        let tensors = [
            [2.0, 0.5, 1.0, 0.3, -0.2, 0.7],
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1e-9, 0.0, -1e-9],
            [5.0, 5.0, 0.04, 0.0, 1e-3, 0.1],
        ];
        for tensor in tensors {
            let (values, axes) = principal(&Symmetric::of(&tensor.map(Scalar)));
            let part = |a: &dyn Fn(&Vector<Scalar>) -> [Scalar; 2]| -> f64 {
                (0..3).map(|i| a(&axes[i]).iter().map(|c| c.0).product::<f64>() * values[i].0).sum()
            };
            let again = [
                part(&|n| [n.x, n.x]),
                part(&|n| [n.y, n.y]),
                part(&|n| [n.z, n.z]),
                part(&|n| [n.x, n.y]),
                part(&|n| [n.y, n.z]),
                part(&|n| [n.z, n.x]),
            ];
            for (found, wanted) in again.into_iter().zip(tensor) {
                assert!((found - wanted).abs() < 1e-14 * 5.0, "{again:?} {tensor:?}");
            }
        }
    }
}
