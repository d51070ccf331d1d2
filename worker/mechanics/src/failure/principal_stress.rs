//! Failure when the largest principal stress comes to a limit in tension.
//!
//! `limit I - sigma` is positive definite as long as every principal stress is below the limit, which its leading
//! minors tell (Sylvester's criterion) without a root of the cubic. Damage before failure is that of [`super::scatter`] alone.

use super::{FailureLaw, Loading};
use crate::{lanes::Lane, strength::Deviator};

/// Lanes in which every principal stress of the deviator `s` and the pressure is below `limit`.
#[inline(always)]
pub(crate) fn below<L: Lane>(s: &Deviator<L>, pressure: L, limit: L) -> L::Mask {
    let zero = L::splat(0.0);
    let left = limit + pressure;
    let (xx, yy, zz) = (left - s.xx, left - s.yy, left - s.zz);
    let minor = s.xy.neg_mul_add(s.xy, xx * yy);
    // Along the last row; the off-diagonal entries are -xy, -yz and -zx.
    let by_zx = s.yz.mul_add(s.xy, yy * s.zx);
    let by_yz = s.xy.mul_add(s.zx, xx * s.yz);
    let determinant = by_yz.neg_mul_add(s.yz, by_zx.neg_mul_add(s.zx, minor * zz));
    L::both(zero.less(xx), L::both(zero.less(minor), zero.less(determinant)))
}

/// The limit.
#[derive(Clone, Copy)]
pub(crate) struct PrincipalStress {
    /// Tension that breaks (stress).
    pub tension: f64,
}

impl FailureLaw for PrincipalStress {
    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L {
        // Where strength scatters, what an element starts with as damage is how much weaker it is.
        let limit = L::splat(self.tension) * (L::splat(1.0) - damage);
        let whole = below(&loading.stress, loading.pressure, limit);
        L::select(whole, damage, L::splat(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{failure::uniaxial, lanes::scalar::Scalar};
    use nalgebra::{Matrix3, Rotation3, Vector3};

    #[test]
    fn the_largest_principal_stress_decides_in_any_direction() {
        let limit = 5e8;
        let law = PrincipalStress { tension: limit };
        for round in 0..200 {
            let turn = Rotation3::from_euler_angles(0.7 * f64::from(round), 1.3 * f64::from(round), 0.4);
            let near = if round % 2 == 0 { 1.0 - 1e-6 } else { 1.0 + 1e-6 };
            let others = f64::from(round % 7) * 1.6e8 - 7e8;
            let principal = Vector3::new(others, limit * near, others.min(0.0) - 1e8);
            let sigma = turn * Matrix3::from_diagonal(&principal) * turn.transpose();
            let p = -sigma.trace() / 3.0;
            let mut loading = uniaxial(0.0, p);
            loading.stress = Deviator {
                xx: Scalar(sigma.m11 + p),
                yy: Scalar(sigma.m22 + p),
                zz: Scalar(sigma.m33 + p),
                xy: Scalar(sigma.m12),
                yz: Scalar(sigma.m23),
                zx: Scalar(sigma.m31),
            };
            let expected = if near < 1.0 { 0.0 } else { 1.0 };
            assert_eq!(law.damage(Scalar(0.0), &loading).0, expected, "{round}: {principal}");
        }
    }

    #[test]
    fn compression_does_not_break_and_nothing_heals() {
        let law = PrincipalStress { tension: 5e8 };
        assert_eq!(law.damage(Scalar(0.0), &uniaxial(1e9, 2e9)).0, 0.0);
        assert_eq!(law.damage(Scalar(1.0), &uniaxial(0.0, 2e9)).0, 1.0);
        // All three above the limit: an even number of negative minors.
        assert_eq!(law.damage(Scalar(0.0), &uniaxial(0.0, -6e8)).0, 1.0);
    }
}
