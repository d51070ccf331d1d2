//! Rubber after Ogden (1972), in the form for nearly incompressible materials.
//!
//! `W = sum of mu_i / alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3)` of the principal stretches at unit volume, beside the
//! equation of state: along a principal axis `s = 1/J sum of mu_i (l^alpha_i - mean over the axes)`. The shear modulus is
//! `1/2 sum of mu_i alpha_i`.
//!
//! R. W. Ogden, Large deformation isotropic elasticity: on the correlation of theory and experiment for incompressible rubberlike
//! solids, Proc. R. Soc. Lond. A 326 (1972) 565.

use super::{
    Around, Deviator, History, Memory, Strain, StrengthLaw,
    finite_strain::{COLUMNS, Symmetric},
};
use crate::{
    element::vector::Vector,
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
fn principal<L: Lane>(b: &Symmetric<L>) -> ([L; 3], [Vector<L>; 3]) {
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

    /// The trial: the stress is found by [`StrengthLaw::remember`].
    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        _: Strain<L>,
        _: &mut History<L>,
        _: L::Mask,
    ) -> Deviator<L> {
        trial
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
        let mut whole = Deviator::zero();
        let mut axis = 0;
        while axis < 3 {
            let (n, s) = (&axes[axis], stress[axis]);
            let (x, y, z) = (s * n.x, s * n.y, s * n.z);
            whole.xx = x.mul_add(n.x, whole.xx);
            whole.yy = y.mul_add(n.y, whole.yy);
            whole.zz = z.mul_add(n.z, whole.zz);
            whole.xy = x.mul_add(n.y, whole.xy);
            whole.yz = y.mul_add(n.z, whole.yz);
            whole.zx = z.mul_add(n.x, whole.zx);
            axis += 1;
        }
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
    use crate::{lanes::scalar::Scalar, material::Strength};

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

    #[test]
    fn constants_without_stiffness_are_refused() {
        assert_eq!(LAW.fault(), None);
        assert!(Ogden { alpha1: -1.3, ..LAW }.fault().is_some());
        assert!(Ogden { alpha2: 0.0, ..LAW }.fault().is_some());
    }
}
