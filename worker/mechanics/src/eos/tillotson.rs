//! Tillotson: a solid or liquid that shocks heat, and the vapour that it expands to.
//!
//! J. H. Tillotson, Metallic equations of state for hypervelocity impact, General Atomic GA-3216 (1962). With `mu = 1/v - 1`, E per initial volume
//! and `w = 1 + E v^2 / E0`:
//!
//! - compressed, or stretched and below the energy of incipient vaporisation: `p1 = (a + b/w) E/v + A mu + B mu^2`;
//! - stretched and above that of complete vaporisation:
//!   `p2 = a E/v + (b E/(v w) + A mu exp(-beta (v - 1))) exp(-alpha (v - 1)^2)`;
//! - stretched, between both: a line in E from p1 to p2, with E the energy itself and not those of the ends.
//!
//! The parabola of p1 turns at `mu = -A/(2 B)`. What is stretched beyond that keeps its least pressure: on the other branch cold water, whose B is six
//! times its A, would be pushed apart from v = 1.2 on.
//!
//! The pressure is no line in the energy, so the kernel gets the tangent at the energy with which the step begins, less the work of its pressure: what it
//! leaves out is of the second order in the heat of one step, and does not add up, as the next tangent begins on the surface.

use super::{EquationOfState, Line};
use crate::{
    lanes::{Lane, apart::Apart, functions::exp},
    law::declared,
};

declared! {
    /// Constants of the law. Energies are per mass.
    pub struct Tillotson = "tillotson" {
        /// a: what of the energy is pressure in a vapour.
        a: NONE, NotNegative;
        /// b: what is besides in what is cold.
        b: NONE, NotNegative;
        /// A (stress): the bulk modulus.
        bulk: STRESS, Positive;
        /// B (stress).
        quadratic: STRESS, NotNegative;
        /// E0 (energy per mass), from which on b matters less.
        energy0: SPECIFIC_ENERGY, Positive;
        /// Energy of incipient vaporisation (energy per mass).
        incipient_energy: SPECIFIC_ENERGY, Positive;
        /// Energy of complete vaporisation (energy per mass).
        complete_energy: SPECIFIC_ENERGY, Positive;
        alpha: NONE, NotNegative;
        beta: NONE, NotNegative;
    }
}

impl Tillotson {
    /// What constants must be beside their bounds.
    pub fn fault(&self) -> Option<&'static str> {
        (self.complete_energy <= self.incipient_energy).then_some("a complete_energy above incipient_energy")
    }
}

/// The law made ready for kernels: energies per initial volume.
#[derive(Clone, Copy)]
pub(crate) struct Vapour {
    law: Tillotson,
    inverse_energy0: f64,
    incipient: f64,
    inverse_range: f64,
    /// Where the parabola of mu has its least pressure.
    turn: f64,
}

/// A pressure and its slopes by energy and by relative volume.
#[derive(Clone, Copy)]
struct Surface<L> {
    p: L,
    by_energy: L,
    by_volume: L,
}

impl<L: Lane> Surface<L> {
    /// From this at `share` 0 to the other at 1.
    #[inline(always)]
    fn towards(&self, other: &Self, share: L) -> Self {
        let between = |from: L, to: L| share.mul_add(to - from, from);
        Self {
            p: between(self.p, other.p),
            by_energy: between(self.by_energy, other.by_energy),
            by_volume: between(self.by_volume, other.by_volume),
        }
    }
}

impl Vapour {
    pub fn new(law: &Tillotson, density: f64) -> Self {
        Self {
            law: *law,
            inverse_energy0: 1.0 / (law.energy0 * density),
            incipient: law.incipient_energy * density,
            inverse_range: 1.0 / ((law.complete_energy - law.incipient_energy) * density),
            turn: if law.quadratic > 0.0 { -0.5 * law.bulk / law.quadratic } else { f64::MIN },
        }
    }

    #[inline(always)]
    fn at<L: Lane>(&self, v: L, energy: L) -> Surface<L> {
        let (zero, one, two) = (L::splat(0.0), L::splat(1.0), L::splat(2.0));
        let law = &self.law;
        let (a, b, bulk) = (L::splat(law.a), L::splat(law.b), L::splat(law.bulk));
        let (inverse, drawn) = (one / v, v - one);
        let mu = inverse - one;
        let square = inverse * inverse;
        // Below no energy w stays 1.
        let w = (energy.max(zero) * L::splat(self.inverse_energy0)).mul_add(v * v, one);
        let share = one / w;
        let (vapour, cold) = (a * inverse, b * inverse);
        // E/v times the slope of b/w by v is -2 b E (w - 1)/(v w)^2.
        let bent = two * b * (w - one) * share * share;

        let gamma = b.mul_add(share, a);
        let (quadratic, least) = (L::splat(law.quadratic), mu.max(L::splat(self.turn)));
        let dense = Surface {
            p: (gamma * inverse).mul_add(energy, quadratic.mul_add(least, bulk) * least),
            by_energy: (cold * share).mul_add(share, vapour),
            by_volume: -(square * (gamma + bent).mul_add(energy, (two * quadratic).mul_add(least, bulk))),
        };
        let share_of_vapour =
            ((energy - L::splat(self.incipient)) * L::splat(self.inverse_range)).max(zero).min(one);
        let boils = L::both(zero.less(drawn), zero.less(share_of_vapour));
        if !L::any(boils) {
            return dense;
        }
        let beta = L::splat(law.beta);
        let thin = exp(-(beta * drawn.max(zero)));
        let thinner = exp(-(L::splat(law.alpha) * drawn * drawn.max(zero)));
        let left = (cold * share).mul_add(energy, bulk * mu * thin);
        // The slope of 1/(v w) by v is (2 - 3 w)/(v w)^2.
        let left_slope = square
            * (b * energy * share * share)
                .mul_add(L::splat(-3.0).mul_add(w, two), -(bulk * thin * (beta * mu * v).mul_add(v, one)));
        let thinned = L::splat(-2.0 * law.alpha) * drawn;
        let vaporised = Surface {
            p: vapour.mul_add(energy, left * thinner),
            by_energy: (cold * share * share).mul_add(thinner, vapour),
            by_volume: thinner.mul_add(left.mul_add(thinned, left_slope), -(a * square * energy)),
        };
        let mut mixed = dense.towards(&vaporised, share_of_vapour);
        let turns = (vaporised.p - dense.p) * L::splat(self.inverse_range);
        mixed.by_energy = mixed.by_energy + L::select(share_of_vapour.less(one), turns, zero);
        Surface {
            p: L::select(boils, mixed.p, dense.p),
            by_energy: L::select(boils, mixed.by_energy, dense.by_energy),
            by_volume: L::select(boils, mixed.by_volume, dense.by_volume),
        }
    }
}

struct Tangent<'a, L> {
    law: &'a Vapour,
    v: L,
    energy: L,
    line: &'a mut Line<L>,
}

impl<L: Lane> Apart for Tangent<'_, L> {
    #[inline(always)]
    fn run(self) {
        let Surface { p, by_energy, by_volume } = self.law.at(self.v, self.energy);
        let a = by_energy.neg_mul_add(self.energy, p);
        *self.line = Line { a, b: by_energy, slope_a: by_volume, slope_b: L::splat(0.0) };
    }
}

impl EquationOfState for Vapour {
    /// The tangent at no energy.
    #[inline(always)]
    fn line<L: Lane>(&self, v: L, burnt: L) -> Line<L> {
        self.line_about(v, burnt, L::splat(0.0))
    }

    #[inline(always)]
    fn line_about<L: Lane>(&self, v: L, _burnt: L, energy: L) -> Line<L> {
        let mut line = Line { a: v, b: v, slope_a: v, slope_b: v };
        L::apart(Tangent { law: self, v, energy, line: &mut line });
        line
    }

    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, _burnt: L) -> L {
        L::splat(0.1 * self.law.bulk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    /// Aluminium of the report.
    const LAW: Tillotson = Tillotson {
        a: 0.5,
        b: 1.63,
        bulk: 75.2e9,
        quadratic: 65e9,
        energy0: 5e6,
        incipient_energy: 3e6,
        complete_energy: 13.9e6,
        alpha: 5.0,
        beta: 5.0,
    };
    const DENSITY: f64 = 2700.0;

    /// The published formulas by density and energy per mass.
    fn published(v: f64, energy: f64) -> f64 {
        let (rho, e) = (DENSITY / v, energy / DENSITY);
        let eta = rho / DENSITY;
        let mu = eta - 1.0;
        let whole = 1.63 / (e / (5e6 * eta * eta) + 1.0);
        let cold = (0.5 + whole) * rho * e + 75.2e9 * mu + 65e9 * mu * mu;
        let far = 1.0 / eta - 1.0;
        let hot =
            0.5 * rho * e + (whole * rho * e + 75.2e9 * mu * (-5.0 * far).exp()) * (-5.0 * far * far).exp();
        if mu >= 0.0 || e <= 3e6 {
            cold
        } else if e >= 13.9e6 {
            hot
        } else {
            (hot * (e - 3e6) + cold * (13.9e6 - e)) / (13.9e6 - 3e6)
        }
    }

    const STATES: [(f64, f64); 10] = [
        (0.6, 20e9),
        (0.75, 5e9),
        (0.98, 0.1e9),
        (1.02, 0.0),
        (1.1, 6e9),
        (1.3, 15e9),
        (1.7, 30e9),
        (1.2, 60e9),
        (3.0, 45e9),
        (20.0, 50e9),
    ];

    #[test]
    fn pressure_is_that_of_the_published_formulas_in_each_region() {
        let law = Vapour::new(&LAW, DENSITY);
        for (v, energy) in STATES {
            let line = law.line_about(Scalar(v), Scalar(1.0), Scalar(energy));
            let (found, wanted) = (line.pressure(Scalar(energy)).0, published(v, energy));
            assert!((found - wanted).abs() < 1e-12 * (wanted.abs() + 1e9), "{v} {energy}: {found} {wanted}");
        }
    }

    /// Water has a B of six times A.
    #[test]
    fn what_is_cold_and_stretched_pulls_however_far() {
        let (bulk, quadratic) = (2.18e9, 13.25e9);
        let law = Vapour::new(&Tillotson { bulk, quadratic, ..LAW }, 1000.0);
        for v in [1.01, 1.05, 1.08, 1.2, 1.5, 3.0, 30.0] {
            let mu = 1.0 / v - 1.0;
            let wanted =
                if v < 1.089 { bulk * mu + quadratic * mu * mu } else { -0.25 * bulk * bulk / quadratic };
            let line = law.line_about(Scalar(v), Scalar(1.0), Scalar(0.0));
            let found = line.pressure(Scalar(0.0)).0;
            assert!((found - wanted).abs() < 1e-12 * bulk, "{v}: {found} {wanted}");
            assert!(line.slope_a.0 <= 1e-6 * bulk, "{v}: {}", line.slope_a.0);
        }
    }

    #[test]
    fn slopes_by_energy_and_on_the_isentrope_are_those_of_the_surface() {
        let law = Vapour::new(&LAW, DENSITY);
        for (v, energy) in STATES {
            let line = law.line_about(Scalar(v), Scalar(1.0), Scalar(energy));
            let (p, h) = (published(v, energy), 1e-5 * (energy + 1e9));
            if energy > 0.0 {
                let by_energy = (published(v, energy + h) - published(v, energy - h)) / (2.0 * h);
                assert!((line.b.0 / by_energy - 1.0).abs() < 1e-6, "{v}: {} {by_energy}", line.b.0);
            }
            let h = 1e-6 * v;
            let expected =
                -v * (published(v + h, energy - p * h) - published(v - h, energy + p * h)) / (2.0 * h);
            let found = line.stiffness(Scalar(v), Scalar(p), Scalar(energy)).0;
            assert!(
                (found - expected).abs() < 1e-5 * (expected.abs() + 1e9),
                "{v} {energy}: {found} {expected}"
            );
        }
    }

    /// Energy and pressure of a Hugoniot state, brought there in steps as the kernel takes them, without viscosity.
    #[test]
    fn steps_along_an_isentrope_close_with_the_fourth_of_their_error_when_they_are_halved() {
        let law = Vapour::new(&LAW, DENSITY);
        let reach = |n: u32| {
            let (mut energy, mut p) = (20e9, published(0.7, 20e9));
            let dv = (2.0 - 0.7) / f64::from(n);
            for i in 0..n {
                let v = 0.7 + f64::from(i + 1) * dv;
                let about = energy - p * dv;
                let line = law.line_about(Scalar(v), Scalar(1.0), Scalar(about));
                energy = line.energy_after(Scalar(energy), Scalar(p), Scalar(0.0), Scalar(dv)).0;
                p = line.pressure(Scalar(energy)).0;
                let exact = published(v, energy);
                assert!(
                    (p - exact).abs() < 2e-3 * (exact.abs() + 1e9) * f64::from(200 / n.min(200)).max(1.0),
                    "{v}: {p} {exact}"
                );
            }
            energy
        };
        let (coarse, fine, exact) = (reach(200), reach(400), reach(12_800));
        let ratio = (coarse - exact).abs() / (fine - exact).abs();
        assert!(ratio > 3.0 && ratio < 5.5, "{ratio}: {coarse} {fine} {exact}");
        assert!((coarse / exact - 1.0).abs() < 1e-3, "{coarse} {exact}");
    }

    #[test]
    fn vaporisation_that_is_complete_before_it_begins_is_refused() {
        assert_eq!(LAW.fault(), None);
        assert!(Tillotson { complete_energy: 3e6, ..LAW }.fault().is_some());
    }
}
