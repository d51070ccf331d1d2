//! Rotation of the deviatoric stress with the material, after Hughes and Winget (1980).
//!
//! `R = (I - w/2)^-1 (I + w/2)` with `w = W dt` the spin of the step. On the mid-step geometry a rigid rotation by
//! theta gives `|w| = 2 tan(theta/2)`, for which R is the rotation by theta exactly.

use super::vector::{Tensor, Vector};
use crate::{lanes::Lane, strength::Deviator};

/// R for the axial vector `w` of the spin of the step (`W r = w x r`). Closed form
/// `R = I + k (W + W^2 / 2)`, `k = 1 / (1 + |w|^2 / 4)`.
#[inline(always)]
pub(crate) fn rotation<L: Lane>(w: &Vector<L>) -> Tensor<L> {
    let (one, half, quarter) = (L::splat(1.0), L::splat(0.5), L::splat(0.25));
    let k = one / w.dot(w).mul_add(quarter, one);
    let h = k * half;
    let (hx, hy, hz) = (h * w.x, h * w.y, h * w.z);
    let (kx, ky, kz) = (k * w.x, k * w.y, k * w.z);
    let (xx, yy, zz) = (hx * w.x, hy * w.y, hz * w.z);
    let (xy, yz, zx) = (hx * w.y, hy * w.z, hz * w.x);
    Tensor {
        x: Vector { x: one - (yy + zz), y: xy - kz, z: zx + ky },
        y: Vector { x: xy + kz, y: one - (zz + xx), z: yz - kx },
        z: Vector { x: zx - ky, y: yz + kx, z: one - (xx + yy) },
    }
}

/// `R s R^T` for R of the axial vector `w`; a zero spin leaves the stress as it is.
#[inline(always)]
pub(crate) fn rotated<L: Lane>(s: &Deviator<L>, w: &Vector<L>) -> Deviator<L> {
    let Tensor { x: row_x, y: row_y, z: row_z } = rotation(w);
    // Columns of the symmetric s are its rows.
    let s_x = Vector { x: s.xx, y: s.xy, z: s.zx };
    let s_y = Vector { x: s.xy, y: s.yy, z: s.yz };
    let s_z = Vector { x: s.zx, y: s.yz, z: s.zz };
    let m_x = Vector { x: row_x.dot(&s_x), y: row_x.dot(&s_y), z: row_x.dot(&s_z) };
    let m_y = Vector { x: row_y.dot(&s_x), y: row_y.dot(&s_y), z: row_y.dot(&s_z) };
    let (xx, yy) = (m_x.dot(&row_x), m_y.dot(&row_y));
    Deviator { xx, yy, zz: -(xx + yy), xy: m_x.dot(&row_y), yz: m_y.dot(&row_z), zx: m_x.dot(&row_z) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    #[test]
    fn a_stress_turned_by_thirty_degrees_has_the_reference_components() {
        // Deviator of (100, 0, 0; xy 50); the mean 100/3 does not turn.
        let mean = 100.0 / 3.0;
        let s = [100.0 - mean, -mean, -mean, 50.0, 0.0, 0.0].map(Scalar);
        let s = Deviator { xx: s[0], yy: s[1], zz: s[2], xy: s[3], yz: s[4], zx: s[5] };
        let spin = 2.0 * (15f64.to_radians()).tan();
        let turned = rotated(&s, &Vector { x: Scalar(0.0), y: Scalar(0.0), z: Scalar(spin) });
        let found = [turned.xx.0 + mean, turned.yy.0 + mean, turned.zz.0 + mean, turned.xy.0];
        let expected = [31.69872981077808, 68.30127018922194, 0.0, 68.30127018922192];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn no_spin_leaves_the_stress_to_the_bit() {
        let s = [0.1, 0.7, -(0.1 + 0.7), -0.3, 1e-9, 4.0].map(Scalar);
        let s = Deviator { xx: s[0], yy: s[1], zz: s[2], xy: s[3], yz: s[4], zx: s[5] };
        let zero = Scalar(0.0);
        let same = rotated(&s, &Vector { x: zero, y: zero, z: zero });
        let pairs = [(s.xx, same.xx), (s.yy, same.yy), (s.xy, same.xy), (s.yz, same.yz), (s.zx, same.zx)];
        for (before, after) in pairs {
            assert_eq!(before.0.to_bits(), after.0.to_bits());
        }
    }
}
