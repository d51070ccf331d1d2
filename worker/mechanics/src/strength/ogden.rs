//! Rubber after Ogden (1972), in the form for nearly incompressible materials.
//!
//! `W = sum of mu_i / alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3)` of the principal stretches at unit volume, beside the
//! equation of state: along a principal axis `s = 1/J sum of mu_i (l^alpha_i - mean over the axes)`. The shear modulus is
//! `1/2 sum of mu_i alpha_i`.
//!
//! R. W. Ogden, Large deformation isotropic elasticity: on the correlation of theory and experiment for incompressible rubberlike
//! solids, Proc. R. Soc. Lond. A 326 (1972) 565.

use super::{
    Around, Deviator, History, Memory, StrengthLaw,
    finite_strain::{COLUMNS, Symmetric},
    principal::{along, principal},
};
use crate::{
    lanes::{
        Lane,
        functions::{exp, ln},
    },
    law::{Variable, declared},
};

declared! {
    /// Constants of the law: up to three pairs, of which the shear modulus must be positive.
    pub struct Ogden = "ogden" {
        mu1: STRESS, Any;
        alpha1: NONE, Any;
        mu2: STRESS, Any = 0.0;
        alpha2: NONE, Any = 1.0;
        mu3: STRESS, Any = 0.0;
        alpha3: NONE, Any = 1.0;
    }
}

impl Ogden {
    /// The left Cauchy-Green tensor.
    pub const HISTORY: &'static [Variable] = &COLUMNS;

    fn pairs(&self) -> [[f64; 2]; 3] {
        [[self.mu1, self.alpha1], [self.mu2, self.alpha2], [self.mu3, self.alpha3]]
    }

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        let stiff = self.shear() > 0.0 && self.pairs().iter().all(|[_, alpha]| *alpha != 0.0);
        (!stiff).then_some("a sum of mu1 alpha1, mu2 alpha2 and mu3 alpha3 above 0, and no exponent of 0")
    }
}

impl StrengthLaw for Ogden {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn plastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn shear(&self) -> f64 {
        0.5 * (self.mu1 * self.alpha1 + self.mu2 * self.alpha2 + self.mu3 * self.alpha3)
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
        let zero = L::splat(0.0);
        memory.least_pressure = L::splat(-f64::MAX);
        let b = Symmetric::of(&memory.variables).stretched(&around.gradient, around.dt);
        b.keep(&mut memory.variables);
        let (squares, axes) = principal(&b);
        let logs = [ln(squares[0]), ln(squares[1]), ln(squares[2])];
        let mut stress = [zero; 3];
        let mut stiffest = zero;
        let mut pair = 0;
        while pair < 3 {
            let [mu, alpha] = self.pairs()[pair];
            if mu != 0.0 {
                let half = L::splat(0.5 * alpha);
                let powers = [exp(half * logs[0]), exp(half * logs[1]), exp(half * logs[2])];
                let mean = (powers[0] + powers[1] + powers[2]) * L::splat(1.0 / 3.0);
                let mu_lanes = L::splat(mu);
                stress[0] = mu_lanes.mul_add(powers[0] - mean, stress[0]);
                stress[1] = mu_lanes.mul_add(powers[1] - mean, stress[1]);
                stress[2] = mu_lanes.mul_add(powers[2] - mean, stress[2]);
                let most = powers[0].max(powers[1]).max(powers[2]) - L::splat(1.0);
                stiffest = L::splat((0.5 * mu * alpha).max(0.0)).mul_add(most.max(zero), stiffest);
            }
            pair += 1;
        }
        memory.added_stiffness = L::splat(4.0 / 3.0) * stiffest;
        let whole = along(&stress, &axes);
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

    /// Ogden's fit of Treloar's rubber.
    const LAW: Ogden =
        Ogden { mu1: 0.618e6, alpha1: 1.3, mu2: 1.177e3, alpha2: 5.0, mu3: -9.81e3, alpha3: -2.0 };

    fn of(f: impl Fn(f64) -> f64) -> f64 {
        LAW.pairs().iter().map(|[mu, alpha]| mu * f(*alpha)).sum()
    }

    #[test]
    fn stretches_and_shears_have_the_stresses_of_the_closed_forms() {
        let law = Strength::Ogden(LAW);
        for l in [0.5f64, 1.3, 3.0, 6.0] {
            let s = led(law, 1e9, 50, |t| uniaxial(1.0 + t * (l - 1.0))).deviator();
            let wanted = of(|a| l.powf(a) - l.powf(-0.5 * a));
            assert!(((s[0] - s[1]) / wanted - 1.0).abs() < 1e-11, "{l}: {s:?} {wanted}");
            let s = led(law, 1e9, 50, |t| biaxial(1.0 + t * (l - 1.0))).deviator();
            let wanted = of(|a| l.powf(a) - l.powf(-2.0 * a));
            assert!(((s[0] - s[2]) / wanted - 1.0).abs() < 1e-11, "{l}: {s:?} {wanted}");
        }
        for shear in [0.2f64, 2.0] {
            // Principal stretches l and 1/l with l - 1/l the shear; the axes turn with it, and with the body.
            let l = 0.5 * shear + (1.0 + 0.25 * shear * shear).sqrt();
            let wanted = of(|a| (l.powf(a) - l.powf(-a)) / (l + 1.0 / l));
            let s = led(law, 1e9, 50, |t| sheared(shear * t, 0.0)).deviator();
            assert!((s[3] / wanted - 1.0).abs() < 1e-11, "{shear}: {s:?} {wanted}");
            let s = led(law, 1e9, 50, |t| sheared(shear * t, std::f64::consts::PI * t)).deviator();
            assert!((s[3] / wanted - 1.0).abs() < 1e-11, "turned {shear}: {s:?} {wanted}");
        }
    }

    #[test]
    fn constants_without_stiffness_are_refused() {
        assert_eq!(LAW.fault(), None);
        assert!(Ogden { alpha1: -1.3, ..LAW }.fault().is_some());
        assert!(Ogden { alpha2: 0.0, ..LAW }.fault().is_some());
    }
}
