//! Rubber after Mooney (1940) and Rivlin (1948), in the form for nearly incompressible materials.
//!
//! `W = a (I1 - 3) + b (I2 - 3)` of the invariants of the left Cauchy-Green tensor at unit volume, beside the equation of state:
//! `s = 2/J dev(a b' + b (I1 b' - b'^2))`, b' that tensor and J the relative volume. The shear modulus is `2 (a + b)`.
//!
//! R. S. Rivlin, Large elastic deformations of isotropic materials IV, Phil. Trans. R. Soc. A 241 (1948) 379.

use super::{
    Around, Deviator, History, Memory, StrengthLaw,
    finite_strain::{COLUMNS, Symmetric},
};
use crate::{
    lanes::Lane,
    law::{Variable, declared},
};

declared! {
    /// Constants of the law.
    pub struct MooneyRivlin = "mooney-rivlin" {
        /// Of the first invariant (stress).
        a: STRESS, Positive;
        /// Of the second (stress).
        b: STRESS, NotNegative = 0.0;
    }
}

impl MooneyRivlin {
    /// The left Cauchy-Green tensor.
    pub const HISTORY: &'static [Variable] = &COLUMNS;
}

impl StrengthLaw for MooneyRivlin {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn plastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        2.0 * (self.a + self.b)
    }

    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        _history: &mut History<L>,
        memory: &mut Memory<L>,
        _active: L::Mask,
    ) -> Deviator<L> {
        memory.least_pressure = L::splat(-f64::MAX);
        let b = Symmetric::of(&memory.variables).stretched(&around.gradient, around.dt);
        b.keep(&mut memory.variables);
        let (first, second) = (b.trace(), b.second());
        let (of_first, of_second) = (L::splat(2.0 * self.a), L::splat(2.0 * self.b));
        // The tangent along a stretch grows with its square: by the invariants, which are 3 at the start.
        let grown = of_first.mul_add(first - L::splat(3.0), of_second * (second - L::splat(3.0)));
        memory.added_stiffness = L::splat(4.0 / 3.0) * grown.max(L::splat(0.0));
        let linear = of_second.mul_add(first, of_first);
        let xx = b.zx.mul_add(b.zx, b.xy.mul_add(b.xy, b.xx * b.xx));
        let yy = b.yz.mul_add(b.yz, b.xy.mul_add(b.xy, b.yy * b.yy));
        let zz = b.zx.mul_add(b.zx, b.yz.mul_add(b.yz, b.zz * b.zz));
        let xy = b.zx.mul_add(b.yz, b.xy * (b.xx + b.yy));
        let yz = b.xy.mul_add(b.zx, b.yz * (b.yy + b.zz));
        let zx = b.xy.mul_add(b.yz, b.zx * (b.zz + b.xx));
        let xx = of_second.neg_mul_add(xx, linear * b.xx);
        let yy = of_second.neg_mul_add(yy, linear * b.yy);
        let zz = of_second.neg_mul_add(zz, linear * b.zz);
        let mean = (xx + yy + zz) * L::splat(1.0 / 3.0);
        let whole = Deviator {
            xx: xx - mean,
            yy: yy - mean,
            zz: zz - mean,
            xy: of_second.neg_mul_add(xy, linear * b.xy),
            yz: of_second.neg_mul_add(yz, linear * b.yz),
            zx: of_second.neg_mul_add(zx, linear * b.zx),
        };
        // A pass that prepares a run leaves the stress to the bit.
        let whole = whole.scaled(L::splat(1.0) / around.relative_volume);
        whole.or(L::splat(0.0).less(around.dt), &trial)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::finite_strain::tests::{biaxial, led, sheared, uniaxial},
        *,
    };
    use crate::material::Strength;

    const LAW: MooneyRivlin = MooneyRivlin { a: 0.4e6, b: 0.1e6 };

    #[test]
    fn stretches_and_shears_have_the_stresses_of_the_closed_forms() {
        let MooneyRivlin { a, b } = LAW;
        let law = Strength::MooneyRivlin(LAW);
        for l in [0.4, 1.2, 2.0, 4.0] {
            // Differences of principal stresses: along less across, in the plane less out of it.
            let s = led(law, 1e9, 50, |t| uniaxial(1.0 + t * (l - 1.0))).deviator();
            let wanted = 2.0 * (l * l - 1.0 / l) * (a + b / l);
            assert!(((s[0] - s[1]) / wanted - 1.0).abs() < 1e-11, "{l}: {s:?} {wanted}");
            let s = led(law, 1e9, 50, |t| biaxial(1.0 + t * (l - 1.0))).deviator();
            let wanted = 2.0 * (l * l - l.powi(-4)) * (a + b * l * l);
            assert!(((s[0] - s[2]) / wanted - 1.0).abs() < 1e-11, "{l}: {s:?} {wanted}");
            assert!((s[0] - s[1]).abs() < 1e-11 * wanted.abs());
        }
        for shear in [0.1, 1.0, 3.0] {
            let s = led(law, 1e9, 50, |t| sheared(shear * t, 0.0)).deviator();
            let wanted = [2.0 * (a + b) * shear, 2.0 * a * shear * shear, -2.0 * b * shear * shear];
            let found = [s[3], s[0] - s[2], s[1] - s[2]];
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-11 * 1e6, "{shear}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn a_body_that_turns_while_it_is_sheared_has_the_turned_stress() {
        let law = Strength::MooneyRivlin(LAW);
        let still = led(law, 1e9, 40, |t| sheared(2.0 * t, 0.0)).deviator();
        let turned = led(law, 1e9, 40, |t| sheared(2.0 * t, 1.5 * std::f64::consts::PI * t)).deviator();
        // By three quarters of a turn x goes to -y and y to x.
        let wanted = [still[1], still[0], still[2], -still[3]];
        for (found, wanted) in turned.into_iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-11 * 1e6, "{turned:?} {still:?}");
        }
    }
}
