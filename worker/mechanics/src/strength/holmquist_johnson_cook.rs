//! Concrete after Holmquist, Johnson and Cook: strength that grows with pressure and rate and falls with damage, and a pressure that crushes
//! the pores.
//!
//! T. J. Holmquist, G. R. Johnson, W. H. Cook, A computational constitutive model for concrete subjected to large strains, high strain
//! rates, and high pressures, 14th Int. Symp. on Ballistics (1993) 591. With f the compressive strength, `P* = p/f`, `T* = tension/f`:
//!
//! - strength `f min((a (1 - D) + b P*^n) (1 + c ln max(rate/rate0, 1)), limit)`; under tension `f a (1 - D) (1 + p/tension)` times the same
//!   factor, of which the paper has a drawing only (the form is that of the manual of IMPETUS);
//! - pressure by `mu = rho/rho0 - 1`: elastic up to the crush point, a straight line from there to the lock point while pores collapse, and
//!   beyond it `k1 m + k2 m^2 + k3 m^3` with `m = (mu - l)/(1 + l)`, l the volumetric strain `lock_compression` that is left of it without
//!   pressure. The lock point is where this curve has `lock_pressure`;
//! - between the points it unloads by a line whose slope goes from the elastic one to that of the locked material with the share of the way. The
//!   slope of the locked material is that of its chord from l to the lock point, so that both join;
//! - damage grows by the increments of plastic strain and of the volumetric strain that unloading leaves, over
//!   `max(d1 (P* + T*)^d2, least_strain)`, up to 1; tension goes no further than `(1 - D) tension`.

use super::{Around, Deviator, History, Memory, StrengthLaw};
use crate::{
    lanes::{
        Lane,
        functions::{ln, pow},
    },
    law::{Unit, Variable, declared},
};

declared! {
    /// Constants of the law, which makes the whole pressure.
    pub struct HolmquistJohnsonCook = "holmquist-johnson-cook" {
        /// G (stress).
        shear: STRESS, Positive;
        /// A: cohesion, over the compressive strength.
        a: NONE, NotNegative;
        /// B, of the pressure.
        b: NONE, NotNegative;
        /// N, exponent of the pressure.
        n: NONE, Positive;
        /// C, of the rate.
        c: NONE, NotNegative;
        /// The rate up to which the strength does not depend on it (1/time).
        rate0: RATE, Positive;
        /// f (stress): uniaxial compressive strength at rest.
        compressive_strength: STRESS, Positive;
        /// Most of the normalised strength.
        strength_limit: NONE, Positive;
        /// T (stress): the mean tension that it bears.
        tension: STRESS, Positive;
        /// Pressure at which pores begin to collapse.
        crush_pressure: STRESS, Positive;
        /// `rho/rho0 - 1` there.
        crush_compression: NONE, Positive;
        /// Pressure at which all have collapsed.
        lock_pressure: STRESS, Positive;
        /// `rho/rho0 - 1` of the material without pores and without pressure.
        lock_compression: NONE, Positive;
        /// K1 (stress) of the material without pores.
        k1: STRESS, Positive;
        /// K2 (stress).
        k2: STRESS, Any = 0.0;
        /// K3 (stress).
        k3: STRESS, Any = 0.0;
        /// D1: strain to fracture where `P* + T*` is 1.
        d1: NONE, NotNegative;
        /// D2, its exponent.
        d2: NONE, Positive;
        /// The least strain to fracture.
        least_strain: NONE, Positive;
    }
}

/// Index of the greatest compression among the history variables.
const GREATEST: usize = 0;
/// Index of the volumetric strain that unloading leaves.
const CRUSHED: usize = 1;

impl HolmquistJohnsonCook {
    /// What the law keeps of an element beside damage and plastic strain.
    pub const HISTORY: &'static [Variable] = &[
        Variable { name: "greatest_excess_compression", unit: Unit::NONE, initial: 0.0 },
        Variable { name: "crushed_strain", unit: Unit::NONE, initial: 0.0 },
    ];

    /// The bulk modulus before pores collapse.
    pub(crate) fn bulk(&self) -> f64 {
        self.crush_pressure / self.crush_compression
    }

    /// `m` of the lock point; none where the curve of the locked material does not come to the lock pressure.
    fn locked(&self) -> Option<f64> {
        let pressure = |m: f64| m * (self.k1 + m * (self.k2 + m * self.k3));
        let mut above = self.lock_pressure / self.k1;
        while above <= 1.0 && pressure(above) < self.lock_pressure {
            above *= 1.25;
        }
        if above > 1.0 {
            return None;
        }
        let mut below = 0.0;
        // Halves of the interval to the last bit.
        for _ in 0..128 {
            let middle = 0.5 * (below + above);
            if pressure(middle) < self.lock_pressure { below = middle } else { above = middle }
        }
        Some(above)
    }

    /// What constants must be beside their bounds.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        let Some(m) = self.locked() else {
            return Some("k1, k2 and k3 that come to lock_pressure");
        };
        // Where the slope k1 + 2 k2 m + 3 k3 m^2 has a root above 0 the curve would turn back.
        let has_roots = self.k2 * self.k2 >= 3.0 * self.k1 * self.k3;
        if self.k3 < 0.0 || (self.k2 < 0.0 && has_roots) {
            return Some("k1, k2 and k3 of a pressure that ascends");
        }
        let lock = m * (1.0 + self.lock_compression) + self.lock_compression;
        let crushing = (self.lock_pressure - self.crush_pressure) / (lock - self.crush_compression);
        if self.lock_compression <= self.crush_compression || crushing <= 0.0 || crushing >= self.bulk() {
            return Some(
                "a lock point beyond the crush point, by a line less steep than crush_pressure / crush_compression",
            );
        }
        (self.lock_pressure / (lock - self.lock_compression) < crushing)
            .then_some("a locked material that is stiffer than the line from the crush to the lock point")
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Concrete {
    law: HolmquistJohnsonCook,
    bulk: f64,
    inverse_strength: f64,
    inverse_rate0: f64,
    /// `rho/rho0 - 1` of the lock point.
    lock: f64,
    /// Slope of the line from the crush to the lock point (stress).
    crushing: f64,
    /// Slope of the chord of the locked curve (stress).
    locked: f64,
}

/// A pressure and what stiffness it follows.
struct Crushed<L> {
    pressure: L,
    /// `rho dp/drho`.
    stiffness: L,
    /// Volumetric strain that unloading would leave.
    strain: L,
}

impl Concrete {
    /// # Panics
    /// If the law has a [`HolmquistJohnsonCook::fault`].
    pub fn new(law: &HolmquistJohnsonCook) -> Self {
        let m = law.locked().expect("a law without fault");
        let lock = m * (1.0 + law.lock_compression) + law.lock_compression;
        Self {
            law: *law,
            bulk: law.bulk(),
            inverse_strength: 1.0 / law.compressive_strength,
            inverse_rate0: 1.0 / law.rate0,
            lock,
            crushing: (law.lock_pressure - law.crush_pressure) / (lock - law.crush_compression),
            locked: law.lock_pressure / (lock - law.lock_compression),
        }
    }

    /// The pressure at a compression, of which the greatest so far is `most`.
    #[inline(always)]
    fn pressure<L: Lane>(&self, mu: L, most: L) -> Crushed<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let (crush, bulk) = (L::splat(law.crush_compression), L::splat(self.bulk));
        let beyond = most - crush;
        let share = (beyond * L::splat(1.0 / (self.lock - law.crush_compression))).max(zero).min(one);
        let slope = share.mul_add(L::splat(self.locked - self.bulk), bulk);
        let top = L::splat(self.crushing).mul_add(beyond.max(zero), L::splat(law.crush_pressure));
        // Before the crush point the way back is the way there.
        let whole = beyond.less_equal(zero);
        let unloaded = slope.neg_mul_add(most - mu, top);
        let pressure = L::select(whole, bulk * mu, unloaded);
        let strain = L::select(whole, zero, most - top / slope);

        let is_locked = L::splat(self.lock).less_equal(most);
        let (k1, k2, k3) = (L::splat(law.k1), L::splat(law.k2), L::splat(law.k3));
        let m = (mu - L::splat(law.lock_compression)) * L::splat(1.0 / (1.0 + law.lock_compression));
        let curved = m.max(zero);
        let dense = m * curved.mul_add(curved.mul_add(k3, k2), k1);
        let dense_slope = curved.mul_add(curved.mul_add(L::splat(3.0) * k3, L::splat(2.0) * k2), k1);
        let dense_slope = dense_slope * L::splat(1.0 / (1.0 + law.lock_compression));
        let slope = L::select(whole, bulk, slope);
        Crushed {
            pressure: L::select(is_locked, dense, pressure),
            stiffness: L::select(is_locked, dense_slope, slope) * (one + mu),
            strain: L::select(is_locked, L::splat(law.lock_compression), strain),
        }
    }

    /// Strength at a pressure, rate and damage.
    #[inline(always)]
    fn strength<L: Lane>(&self, pressure: L, rate: L, damage: L) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let log = ln((rate * L::splat(self.inverse_rate0)).max(one));
        let factor = L::splat(law.c).mul_add(log, one);
        let cohesion = L::splat(law.a) * (one - damage);
        let normal = (pressure * L::splat(self.inverse_strength)).max(zero);
        let pressed = L::splat(law.b).mul_add(pow(normal, L::splat(law.n)), cohesion);
        let pulled = cohesion * pressure.mul_add(L::splat(1.0 / law.tension), one).max(zero);
        let normalised = L::select(pressure.less(zero), pulled, pressed) * factor;
        L::splat(law.compressive_strength) * normalised.min(L::splat(law.strength_limit))
    }
}

impl StrengthLaw for Concrete {
    const REMEMBERS: bool = true;

    #[inline(always)]
    fn shear(&self) -> f64 {
        self.law.shear
    }

    #[inline(always)]
    fn remember<L: Lane>(
        &self,
        trial: Deviator<L>,
        around: &Around<L>,
        history: &mut History<L>,
        memory: &mut Memory<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let law = &self.law;
        let damage = memory.damage;
        let mu = one / around.relative_volume - one;
        let most = memory.variables[GREATEST].max(mu);
        let crushed = self.pressure(mu, most);
        let left = (crushed.strain - memory.variables[CRUSHED]).max(zero);
        memory.variables[GREATEST] = most;
        memory.variables[CRUSHED] = memory.variables[CRUSHED] + left;
        memory.least_pressure = -((one - damage) * L::splat(law.tension));
        let pressure = crushed.pressure.max(memory.least_pressure);
        memory.added_pressure = pressure - around.pressure;
        memory.added_stiffness = (crushed.stiffness - L::splat(self.bulk)).max(zero);

        let strength = self.strength(pressure, around.strain.rate, damage);
        let sigma = trial.mises_square().sqrt();
        let yields = strength.less(sigma);
        if !L::any(L::both(L::either(yields, zero.less(left)), active)) {
            return trial;
        }
        let slip = L::select(yields, (sigma - strength) * L::splat(1.0 / (3.0 * law.shear)), zero);
        history.plastic_strain = history.plastic_strain + slip;
        let raised = ((pressure + L::splat(law.tension)) * L::splat(self.inverse_strength)).max(zero);
        let to_fracture = (L::splat(law.d1) * pow(raised, L::splat(law.d2))).max(L::splat(law.least_strain));
        memory.damage = (damage + (slip + left) / to_fracture).min(one);
        trial.scaled(L::select(yields, strength / sigma, one))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::finite_strain::tests::Cube, *};
    use crate::{lanes::scalar::Scalar, material::Strength, state::field};

    /// Concrete of 48 MPa, as in the paper.
    const LAW: HolmquistJohnsonCook = HolmquistJohnsonCook {
        shear: 14.86e9,
        a: 0.79,
        b: 1.60,
        n: 0.61,
        c: 0.007,
        rate0: 1.0,
        compressive_strength: 48e6,
        strength_limit: 7.0,
        tension: 4e6,
        crush_pressure: 16e6,
        crush_compression: 0.001,
        lock_pressure: 0.8e9,
        lock_compression: 0.10,
        k1: 85e9,
        k2: -171e9,
        k3: 208e9,
        d1: 0.04,
        d2: 1.0,
        least_strain: 0.01,
    };
    const DT: f64 = 1e-7;

    /// The published equations, written out in plain numbers for a motion that keeps its axes.
    #[derive(Default, Debug)]
    struct Published {
        deviator: [f64; 3],
        pressure: f64,
        strain: f64,
        damage: f64,
        most: f64,
        crushed: f64,
    }

    /// `mu` and slope of the chord at the lock point, from the root of the cubic by Newton.
    fn lock_point() -> (f64, f64) {
        let mut m = 0.01;
        for _ in 0..50 {
            let p = m * (85e9 + m * (-171e9 + m * 208e9)) - 0.8e9;
            m -= p / (85e9 + m * (-342e9 + m * 624e9));
        }
        (0.1 + 1.1 * m, 0.8e9 / (1.1 * m))
    }

    fn crush(mu: f64, most: f64) -> (f64, f64) {
        let (lock, chord) = lock_point();
        if most <= 0.001 {
            (16e9 * mu, 0.0)
        } else if most < lock {
            let share = (most - 0.001) / (lock - 0.001);
            let top = 16e6 + (0.8e9 - 16e6) * share;
            let slope = (1.0 - share) * 16e9 + share * chord;
            (top - slope * (most - mu), most - top / slope)
        } else {
            let m = (mu - 0.1) / 1.1;
            (if m > 0.0 { m * (85e9 + m * (-171e9 + m * 208e9)) } else { 85e9 * m }, 0.1)
        }
    }

    impl Published {
        /// From one length of each axis to the next.
        fn step(&mut self, before: [f64; 3], after: [f64; 3]) {
            let rate = [0, 1, 2].map(|i| (after[i] - before[i]) / DT / (0.5 * (after[i] + before[i])));
            let third = rate.iter().sum::<f64>() / 3.0;
            let effective = (2.0 / 3.0 * rate.iter().map(|r| (r - third) * (r - third)).sum::<f64>()).sqrt();
            let mu = 1.0 / after.iter().product::<f64>() - 1.0;
            self.most = self.most.max(mu);
            let (whole, strain) = crush(mu, self.most);
            let left = (strain - self.crushed).max(0.0);
            self.crushed += left;
            self.pressure = whole.max(-(1.0 - self.damage) * 4e6);
            let cohesion = 0.79 * (1.0 - self.damage);
            let static_strength = if self.pressure < 0.0 {
                cohesion * (1.0 + self.pressure / 4e6)
            } else {
                cohesion + 1.6 * (self.pressure / 48e6).powf(0.61)
            };
            let strength = 48e6 * (static_strength * (1.0 + 0.007 * effective.max(1.0).ln())).min(7.0);
            for i in 0..3 {
                self.deviator[i] += 2.0 * LAW.shear * (rate[i] - third) * DT;
            }
            let sigma = (1.5 * self.deviator.iter().map(|s| s * s).sum::<f64>()).sqrt();
            let mut slip = 0.0;
            if sigma > strength {
                slip = (sigma - strength) / (3.0 * LAW.shear);
                self.deviator = self.deviator.map(|s| s * strength / sigma);
            }
            self.strain += slip;
            let to_fracture = (0.04 * ((self.pressure + 4e6) / 48e6).max(0.0)).max(0.01);
            self.damage = (self.damage + (slip + left) / to_fracture).min(1.0);
        }
    }

    fn stretched([x, y, z]: [f64; 3]) -> [[f64; 3]; 3] {
        [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
    }

    /// Through points of three lengths, in steps of the same number each: every step against the equations.
    fn follow(points: &[[f64; 3]], steps: u32) -> (Cube, Published) {
        let (mut cube, mut published) =
            (Cube::of(Strength::HolmquistJohnsonCook(LAW), 16e9), Published::default());
        let mut last = [1.0; 3];
        for (leg, point) in points.iter().enumerate() {
            let start = last;
            for n in 1..=steps {
                let share = f64::from(n) / f64::from(steps);
                let next = [0, 1, 2].map(|i| start[i] + (point[i] - start[i]) * share);
                cube.step_to(&stretched(next), DT);
                published.step(last, next);
                last = next;
                let s = cube.block.reading(0);
                let history = cube.history();
                for (found, wanted, scale) in [
                    (s[field::PRESSURE], published.pressure, 1e9),
                    (s[field::SXX], published.deviator[0], 1e8),
                    (s[field::SYY], published.deviator[1], 1e8),
                    (s[field::PLASTIC_STRAIN], published.strain, 0.01),
                    (s[field::DAMAGE], published.damage, 1.0),
                    (history[GREATEST], published.most, 0.1),
                    (history[CRUSHED], published.crushed, 0.1),
                ] {
                    assert!(
                        (found - wanted).abs() <= 1e-9 * scale,
                        "leg {leg}, step {n}: {found} for {wanted}, {published:?}"
                    );
                }
            }
        }
        (cube, published)
    }

    #[test]
    fn uniaxial_strain_follows_the_published_equations_there_and_back() {
        // Elastic, crushed halfway, unloaded into tension, crushed on and locked, unloaded until it is torn.
        let lengths = [0.9995, 0.95, 0.97, 0.86, 0.93];
        let (_, published) = follow(&lengths.map(|x| [x, 1.0, 1.0]), 4000);
        assert_eq!(published.damage, 1.0);
        assert_eq!(published.pressure, 0.0);
        assert_eq!(published.crushed, 0.1);
    }

    #[test]
    fn shear_under_pressure_and_tension_follow_the_published_equations() {
        // Pressed evenly, then squeezed along x at nearly constant volume until it has failed.
        let (cube, published) = follow(&[[0.995; 3], [0.90, 1.046, 1.046]], 4000);
        assert!(published.damage == 1.0 && published.strain > 0.05, "{published:?}");
        let s = cube.block.reading(0);
        let mises = 1.5 * s[field::SXX].abs();
        // Closed form of the fractured material, at its rate.
        let rate = (0.90f64 - 0.995).abs() / (4000.0 * DT) / 0.90;
        let factor = 1.0 + 0.007 * rate.ln();
        let wanted = 48e6 * 1.6 * (s[field::PRESSURE] / 48e6).powf(0.61) * factor;
        assert!((mises / wanted - 1.0).abs() < 1e-3, "{mises} {wanted}");
        let (_, pulled) = follow(&[[1.0002, 1.0, 1.0], [1.02, 1.0, 1.0]], 2000);
        assert!(pulled.damage > 0.9 && pulled.most == 0.0, "{pulled:?}");
    }

    /// The curve of the paper's figure: crush and lock points, the line between, and what unloading leaves.
    #[test]
    fn pressure_has_the_points_of_the_curve() {
        let law = Concrete::new(&LAW);
        let at = |mu: f64, most: f64| {
            let crushed = law.pressure(Scalar(mu), Scalar(most));
            (crushed.pressure.0, crushed.strain.0, crushed.stiffness.0)
        };
        let near = |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-9, "{found} {wanted}");
        near(at(0.001, 0.001).0, 16e6);
        near(at(0.0005, 0.001).0, 8e6);
        let (lock, _) = lock_point();
        near(law.lock, lock);
        near(at(lock, lock).0, 0.8e9);
        near(at(lock * (1.0 - 1e-12), lock * (1.0 - 1e-12)).0, 0.8e9);
        near(at(0.5 * (0.001 + lock), 0.5 * (0.001 + lock)).0, 0.5 * (16e6 + 0.8e9));
        // Unloaded from anywhere the pressure vanishes at the strain that is left, 0.1 of the locked material.
        for most in [0.02, 0.06, 0.1, lock, 0.3] {
            let left = at(most, most).1;
            assert!(at(left, most).0.abs() < 1e-3, "{most}");
        }
        near(at(lock, lock).1, 0.1);
        // 85 0.1 - 171 0.01 + 208 0.001 GPa where m is 0.1.
        near(at(0.21, 0.21).0, 6.998e9);
        // Stiffness is that of small steps.
        for (mu, most) in [(0.0004, 0.0004), (0.03, 0.05), (0.15, 0.15), (0.12, 0.2), (0.05, 0.2)] {
            let h = 1e-7;
            let slope = (at(mu + h, most).0 - at(mu - h, most).0) / (2.0 * h);
            near(at(mu, most).2 * 1e-3, slope * (1.0 + mu) * 1e-3);
        }
    }

    #[test]
    fn strength_has_its_limit_and_vanishes_with_tension() {
        let law = Concrete::new(&LAW);
        let at = |p: f64, rate: f64, damage: f64| law.strength(Scalar(p), Scalar(rate), Scalar(damage)).0;
        let near =
            |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
        near(at(48e6, 0.1, 0.0), 48e6 * (0.79 + 1.6));
        near(at(48e6, 0.1, 0.25), 48e6 * (0.79 * 0.75 + 1.6));
        near(at(48e6, 100.0, 1.0), 48e6 * 1.6 * (1.0 + 0.007 * 100f64.ln()));
        near(at(5e9, 1.0, 0.0), 48e6 * 7.0);
        near(at(-2e6, 1.0, 0.5), 48e6 * 0.79 * 0.5 * 0.5);
        assert!(at(-4e6, 1.0, 0.0).abs() < 1e-6 && at(-1e6, 1.0, 1.0) == 0.0);
    }

    #[test]
    fn constants_without_a_pressure_curve_are_refused() {
        assert_eq!(LAW.fault(), None);
        for law in [
            HolmquistJohnsonCook { k1: 1e7, k2: 0.0, k3: 0.0, ..LAW },
            HolmquistJohnsonCook { k3: 50e9, ..LAW },
            HolmquistJohnsonCook { lock_compression: 0.0005, ..LAW },
            HolmquistJohnsonCook { lock_pressure: 10e6, ..LAW },
            HolmquistJohnsonCook { crush_compression: 0.05, ..LAW },
        ] {
            assert!(law.fault().is_some(), "{law:?}");
        }
    }
}
