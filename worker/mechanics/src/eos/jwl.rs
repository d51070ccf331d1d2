//! Products of detonation (Jones, Wilkins and Lee; Lee, Hornig and Kury, UCRL-50422, 1968) with programmed burn.
//!
//! `p = A (1 - omega/(R1 v)) e^(-R1 v) + B (1 - omega/(R2 v)) e^(-R2 v) + omega E / v`, E per initial volume, which
//! starts at the energy of detonation. All of it is multiplied by the burnt fraction, which grows from 0 when the
//! element is lit to 1 when the front has run on by [`BURN_CELLS`] times the cube root of its initial volume. An element that is
//! squeezed has burnt at least by the share of that in the compression of the Chapman-Jouguet state, so that a driven front may outrun
//! the lighting; what is squeezed less than that state expands again as it was (Wilkins, Computer Simulation of Dynamic Phenomena,
//! 1999, section 5.3: the larger of the two fractions).

use super::{Burn, EquationOfState, Line};
use crate::lanes::{
    Lane,
    functions::{cbrt, exp},
};

/// Width of the burn front in elements: with fewer the front rings, with more the pressure peak is cut.
pub(crate) const BURN_CELLS: f64 = 2.5;

/// The limit of the step where something burns is that of a wave of so many times the speed of detonation: at the default safety factor at most
/// 0.3 of the time in which the front crosses an element, and 0.2 with the viscosity in the front. With 0.67 a one-dimensional model of this
/// scheme leaves the peak of a detonation that starts at a wall 4 % low.
const PACE: f64 = 2.222;
/// Elements ahead of the front from which on it is near: as many as it crosses while a step takes effect and comes down.
const NEAR_CELLS: f64 = 3.0;
/// Burnt share from which on a squeezed element that is not lit counts as burning.
const BURNING: f64 = 0.1;

/// Constants of the products.
#[derive(Clone, Copy)]
pub(crate) struct Jwl {
    /// A and B (stress).
    pub amplitude: [f64; 2],
    /// R1 and R2.
    pub decay: [f64; 2],
    pub omega: f64,
    /// Speed of detonation (velocity).
    pub detonation: f64,
    /// `rho0 D^2` (stress).
    pub unburnt_stiffness: f64,
    /// `rho0 D^2 / p_CJ`.
    pub inverse_compression: f64,
}

impl EquationOfState for Jwl {
    #[inline(always)]
    fn burns(&self) -> bool {
        true
    }

    #[inline(always)]
    fn line<L: Lane>(&self, v: L, burnt: L) -> Line<L> {
        let one = L::splat(1.0);
        let b = L::splat(self.omega) / v;
        let (mut a, mut slope_a) = (L::splat(0.0), L::splat(0.0));
        let mut term = 0;
        while term < 2 {
            let decay = L::splat(self.decay[term]);
            let decayed = L::splat(self.amplitude[term]) * exp(-(decay * v));
            // 1 - omega/(R v), and its derivative omega/(R v^2).
            let share = L::splat(1.0 / self.decay[term]) * b;
            let factor = one - share;
            a = factor.mul_add(decayed, a);
            slope_a = decay.neg_mul_add(factor, share / v).mul_add(decayed, slope_a);
            term += 1;
        }
        Line { a: burnt * a, b: burnt * b, slope_a: burnt * slope_a, slope_b: -(burnt * b / v) }
    }

    /// That of the front as long as something is left to burn: it is to run through an element in one step at most.
    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, burnt: L) -> L {
        L::splat(self.unburnt_stiffness) * (L::splat(1.0) - burnt)
    }

    #[inline(always)]
    fn burn<L: Lane>(&self, time_to_light: L, v: L, initial_volume: L) -> Burn<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let duration = L::splat(BURN_CELLS / self.detonation) * cbrt(initial_volume);
        let squeezed = ((one - v) * L::splat(self.inverse_compression)).min(one);
        let time_to_light = L::select(squeezed.less(one), time_to_light, time_to_light.min(-duration));
        let burnt = (-time_to_light / duration).min(one).max(squeezed).max(zero);
        let ahead = L::splat(NEAR_CELLS / BURN_CELLS).neg_mul_add(duration, time_to_light);
        let is_near = ahead.min(L::splat(BURNING) - burnt).less(zero);
        let pace = L::splat((PACE * self.detonation) * (PACE * self.detonation));
        let pace_square = L::select(L::both(is_near, burnt.less(one)), pace, zero);
        Burn { time_to_light, burnt, pace_square }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{eos::difference_stiffness, lanes::scalar::Scalar};

    /// Constants as the handbooks give them, and what follows from them: relative volume, pressure, speed and energy at
    /// the Chapman-Jouguet point, the constant of the isentrope through it, and pressures on it at [`VOLUMES`].
    struct Explosive {
        name: &'static str,
        density: f64,
        /// A, B, R1, R2, omega, energy, D as quoted.
        constants: [f64; 7],
        /// v, p, D, E, C.
        cj: [f64; 5],
        isentrope: [f64; 4],
    }

    const VOLUMES: [f64; 4] = [1.5, 3.0, 7.0, 20.0];

    const EXPLOSIVES: [Explosive; 6] = [
        Explosive {
            name: "TNT",
            density: 1630.0,
            constants: [371200000000.0, 3231000000.0, 4.15, 0.95, 0.3, 7000000000.0, 6930.0],
            cj: [
                0.7316876577311959,
                20999718749.02989,
                6929.351813255421,
                9817241862.269165,
                1045230567.1129391,
            ],
            isentrope: [2128819638.3368506, 438933913.34290814, 87469410.5742245, 21275191.459866606],
        },
        Explosive {
            name: "TNT_AUTODYN",
            density: 1630.0,
            constants: [373770000000.0, 3747100000.0, 4.15, 0.9, 0.35, 6000000000.0, 6930.0],
            cj: [
                0.7316899816488611,
                21000051267.81753,
                6929.436683064212,
                8817262070.52149,
                733826513.5133903,
            ],
            isentrope: [2135703716.9051638, 419815204.78389895, 59933951.83629325, 12858930.002422804],
        },
        Explosive {
            name: "COMP_B",
            density: 1717.0,
            constants: [524200000000.0, 7678000000.0, 4.2, 1.1, 0.34, 8500000000.0, 7980.0],
            cj: [
                0.7301987418960578,
                29498757571.71638,
                7979.850031386164,
                12479400952.676136,
                1081867146.178504,
            ],
            isentrope: [3065514668.4653387, 533173528.9996385, 83228986.40220122, 19534117.05793293],
        },
        Explosive {
            name: "C4",
            density: 1601.0,
            constants: [609770000000.0, 12950000000.0, 4.5, 1.4, 0.25, 9000000000.0, 8193.0],
            cj: [
                0.7394565690557782,
                27999639019.942078,
                8192.953430397309,
                12647561007.727709,
                1043348068.1792209,
            ],
            isentrope: [2928292282.158754, 459286387.8000318, 92352102.75697464, 24668442.027708437],
        },
        Explosive {
            name: "PETN_1p77",
            density: 1770.0,
            constants: [617050000000.0, 16926000000.0, 4.4, 1.2, 0.25, 10100000000.0, 8300.0],
            cj: [
                0.7252495084274608,
                33510186959.328625,
                8301.04089061568,
                14703470169.881615,
                698669280.465359,
            ],
            isentrope: [4058143387.400266, 640581190.2005422, 65168046.70657983, 16519015.875689264],
        },
        Explosive {
            name: "PENTOLITE_50_50",
            density: 1700.0,
            constants: [540940000000.0, 9372600000.0, 4.5, 1.1, 0.35, 8100000000.0, 7530.0],
            cj: [
                0.7354540943787478,
                25500082940.983986,
                7530.014520037057,
                11472971267.519827,
                1033200741.247881,
            ],
            isentrope: [3031052667.6518025, 580893998.5495869, 78941029.63250497, 18104822.76272736],
        },
    ];

    fn law(explosive: &Explosive) -> Jwl {
        let [a, b, r1, r2, omega, _, detonation] = explosive.constants;
        Jwl {
            amplitude: [a, b],
            decay: [r1, r2],
            omega,
            detonation,
            unburnt_stiffness: explosive.density * detonation * detonation,
            inverse_compression: explosive.density * detonation * detonation / explosive.cj[1],
        }
    }

    fn close(found: f64, expected: f64, tolerance: f64) -> bool {
        (found / expected - 1.0).abs() < tolerance
    }

    /// Pressure on the Hugoniot of the products, whose energy is `energy + p (1 - v) / 2`.
    fn hugoniot(law: &Jwl, energy: f64, v: f64) -> f64 {
        let line = law.line(Scalar(v), Scalar(1.0));
        (line.a.0 + line.b.0 * energy) / (1.0 - 0.5 * line.b.0 * (1.0 - v))
    }

    #[test]
    fn the_chapman_jouguet_state_follows_from_the_constants_and_agrees_with_the_quoted_speed() {
        for explosive in &EXPLOSIVES {
            let (law, energy) = (law(explosive), explosive.constants[5]);
            let slope = |v: f64| hugoniot(&law, energy, v) / (1.0 - v);
            // The line from the unburnt state that touches the Hugoniot is the least steep: golden section.
            let (mut low, mut high) = (0.55, 0.9);
            for _ in 0..100 {
                let third = 0.381_966_011_250_105 * (high - low);
                if slope(low + third) < slope(high - third) { high -= third } else { low += third }
            }
            let v = 0.5 * (low + high);
            let p = hugoniot(&law, energy, v);
            let speed = (p / (explosive.density * (1.0 - v))).sqrt();
            let [v_cj, p_cj, d_cj, e_cj, _] = explosive.cj;
            assert!(close(v, v_cj, 1e-6) && close(p, p_cj, 1e-6), "{}: {v} {p}", explosive.name);
            assert!(close(speed, d_cj, 1e-9) && close(speed, law.detonation, 3e-4), "{speed}");
            assert!(close(energy + 0.5 * p * (1.0 - v), e_cj, 1e-6));
            // There the isentrope touches that line too.
            let line = law.line(Scalar(v_cj), Scalar(1.0));
            let stiffness = line.stiffness(Scalar(v_cj), Scalar(p_cj), Scalar(e_cj)).0;
            assert!(close(stiffness / v_cj, p_cj / (1.0 - v_cj), 1e-8), "{}", explosive.name);
        }
    }

    #[test]
    fn energy_on_the_isentrope_is_that_of_the_detonation() {
        for explosive in &EXPLOSIVES {
            let [a, b, r1, r2, omega, energy, _] = explosive.constants;
            let [v, p, _, _, c] = explosive.cj;
            let on_isentrope =
                a / r1 * (-r1 * v).exp() + b / r2 * (-r2 * v).exp() + c / omega * v.powf(-omega);
            assert!(close(on_isentrope, energy + 0.5 * p * (1.0 - v), 1e-9), "{}", explosive.name);
        }
    }

    #[test]
    fn adiabatic_steps_from_the_detonation_follow_the_isentrope() {
        for explosive in &EXPLOSIVES {
            let law = law(explosive);
            let [mut v, mut p, _, mut energy, _] = explosive.cj;
            let ratio = (20.0 / v).powf(1e-3);
            let mut next = 0;
            for step in 1..=1000 {
                let (before, p_before) = (v, p);
                v = explosive.cj[0] * ratio.powi(step);
                let line = law.line(Scalar(v), Scalar(1.0));
                energy =
                    line.energy_after(Scalar(energy), Scalar(p_before), Scalar(0.0), Scalar(v - before)).0;
                p = line.pressure(Scalar(energy)).0;
                if next < VOLUMES.len() && v >= VOLUMES[next] * (1.0 - 1e-12) {
                    // Back to the volume of the table along the isentrope.
                    let k = line.stiffness(Scalar(v), Scalar(p), Scalar(energy)).0 / p;
                    let there = p * (v / VOLUMES[next]).powf(k);
                    let expected = explosive.isentrope[next];
                    assert!(close(there, expected, 1e-3), "{} at {v}: {there} {expected}", explosive.name);
                    next += 1;
                }
            }
            assert_eq!(next, VOLUMES.len());
        }
    }

    #[test]
    fn stiffness_is_the_slope_of_the_isentrope_whatever_has_burnt() {
        let law = law(&EXPLOSIVES[0]);
        for (v, energy, burnt) in [(0.73, 9.8e9, 1.0), (0.9, 7e9, 0.3), (2.5, 3e9, 1.0), (15.0, 1e9, 1.0)] {
            let line = law.line(Scalar(v), Scalar(burnt));
            let p = line.pressure(Scalar(energy));
            let found = line.stiffness(Scalar(v), p, Scalar(energy)).0;
            assert!(close(found, difference_stiffness(&law, v, energy, burnt), 1e-6), "{v}");
        }
    }

    #[test]
    fn an_element_burns_while_the_front_runs_through_its_neighbourhood() {
        let explosive = &EXPLOSIVES[0];
        let law = law(explosive);
        let (h, d) = (1e-3, 6930.0);
        let burn = |cells: f64, v: f64| {
            let now = law.burn(Scalar(-cells * h / d), Scalar(v), Scalar(h * h * h));
            (-now.time_to_light.0 * d / h, now.burnt.0, now.pace_square.0.sqrt() / d)
        };
        assert_eq!((burn(-1.0, 1.0).1, burn(BURN_CELLS + 0.01, 0.9).1), (0.0, 1.0));
        assert!(close(burn(1.0, 1.2).1, 1.0 / BURN_CELLS, 1e-12));
        assert_eq!(law.burn(Scalar(f64::INFINITY), Scalar(1.0), Scalar(1.0)).burnt.0, 0.0);
        // Squeezed by 0.2 of 0.268: three quarters have burnt, as long as it is squeezed.
        let share = 0.2 / (1.0 - explosive.cj[0]);
        let (cells, burnt, _) = burn(-30.0, 0.8);
        assert!(close(burnt, share, 1e-3) && close(cells, -30.0, 1e-12), "{cells} {burnt}");
        // Squeezed beyond the state of the detonation: burnt for good.
        let (cells, burnt, _) = burn(-30.0, 0.7);
        assert!(close(cells, BURN_CELLS, 1e-12) && burnt == 1.0, "{cells} {burnt}");
        // The step is held down near the front and where something burns, and nowhere else.
        for (cells, v, is_held) in [
            (-4.0, 1.0, false),
            (-2.0, 1.0, true),
            (2.0, 0.8, true),
            (2.6, 0.8, false),
            (-30.0, 0.99, false),
            (-30.0, 0.9, true),
        ] {
            assert!(
                close(1.0 + burn(cells, v).2, if is_held { 1.0 + PACE } else { 1.0 }, 1e-12),
                "{cells} {v}"
            );
        }
        let unburnt = law.line(Scalar(0.9), Scalar(0.0));
        assert_eq!(unburnt.pressure(Scalar(7e9)).0, 0.0);
    }
}
