//! Failure by the plastic work of the greatest principal stress: `W = integral of max(s1, 0) de` comes to a critical W.
//!
//! M. G. Cockcroft, D. J. Latham, Ductility and the workability of metals, J. Inst. Metals 96 (1968) 33. The damage is W over its critical
//! value; compression in all directions does none.

use super::{FailureLaw, Loading};
use crate::{
    lanes::{Lane, apart::Apart},
    strength::greatest_principal,
};

/// The limit.
#[derive(Clone, Copy)]
pub(crate) struct CockcroftLatham {
    /// `1 / W`, W per volume.
    pub inverse_work: f64,
}

struct Damage<'a, L> {
    law: CockcroftLatham,
    loading: Loading<L>,
    damage: &'a mut L,
}

impl<L: Lane> Apart for Damage<'_, L> {
    #[inline(always)]
    fn run(self) {
        let Loading { stress, pressure, plastic_strain: [before, after], .. } = self.loading;
        let tension = (greatest_principal(&stress) - pressure).max(L::splat(0.0));
        let work = tension * (after - before);
        *self.damage = work.mul_add(L::splat(self.law.inverse_work), *self.damage).min(L::splat(1.0));
    }
}

impl FailureLaw for CockcroftLatham {
    #[inline(always)]
    fn damage<L: Lane>(&self, damage: L, loading: &Loading<L>) -> L {
        let [before, after] = loading.plastic_strain;
        // Without slip no lane changes: what is left out would add exactly zero.
        if !L::any(before.less(after)) {
            return damage;
        }
        let mut grown = damage;
        L::apart(Damage { law: *self, loading: *loading, damage: &mut grown });
        grown
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{failure::uniaxial, lanes::scalar::Scalar, strength::Deviator};
    use nalgebra::{Matrix3, Rotation3, Vector3};

    #[test]
    fn damage_is_the_work_of_the_greatest_principal_stress_in_any_direction() {
        let law = CockcroftLatham { inverse_work: 1.0 / 1.5e9 };
        for round in 0..50 {
            let turn = Rotation3::from_euler_angles(0.7 * f64::from(round), 1.3 * f64::from(round), 0.4);
            let principal =
                Vector3::new(f64::from(round) * 3e7 - 2e8, 1e8 - f64::from(round % 9) * 1e8, -4e8);
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
            loading.plastic_strain = [Scalar(0.3), Scalar(0.35)];
            let wanted = (0.1 + principal.max().max(0.0) * 0.05 / 1.5e9).min(1.0);
            let found = law.damage(Scalar(0.1), &loading).0;
            assert!((found - wanted).abs() < 1e-12, "{round}: {found} {wanted}");
        }
    }

    #[test]
    fn damage_needs_slip_and_ends_at_1() {
        let law = CockcroftLatham { inverse_work: 1.0 / 1e6 };
        let mut loading = uniaxial(3e8, 0.0);
        assert_eq!(law.damage(Scalar(0.25), &loading).0, 0.25);
        loading.plastic_strain = [Scalar(0.0), Scalar(1.0)];
        assert_eq!(law.damage(Scalar(0.25), &loading).0, 1.0);
        // Squeezed from all sides, whatever slips.
        loading.pressure = Scalar(1e9);
        assert_eq!(law.damage(Scalar(0.25), &loading).0, 0.25);
    }
}
