//! A porous solid that is compacted: the shock line of the solid, and its distension `alpha`, the volume over that of the solid in it, by the
//! pressure (P-alpha).
//!
//! W. Herrmann, Constitutive equation for the dynamic compaction of ductile porous materials, J. Appl. Phys. 40 (1969) 2490; the pressure is
//! that of the solid over alpha, `p = P_solid(v_solid, E) / alpha`, after M. M. Carroll, A. C. Holt, J. Appl. Phys. 43 (1972) 759.
//!
//! - crushing: `alpha = 1 + (alpha_e - 1) ((p_s - p) / (p_s - p_e))^n` between the crush pressure `p_e` and the compaction pressure `p_s`, from
//!   which on there are no pores; what has been crushed stays so;
//! - elastic, below the pressure at which crushing stopped: `d alpha/dp = alpha^2/K (1 - 1/h^2)`, `h = 1 + (alpha - 1) (c_e - c0) / (c0
//!   (alpha_e - 1))`, taken at the alpha where crushing stopped; K and c0 are bulk modulus and speed of sound of the solid, `c_e` is that of the
//!   porous material. The line through `alpha_e` at `p_e` comes to the distension of the start at no pressure.
//!
//! [`Pores`] keeps how far pores have been crushed; the strength of the material stands beside it (`strength/porous.rs`).

use super::{EquationOfState, Line, Shock};
use crate::{
    lanes::{Lane, functions::pow},
    law::declared,
};

declared! {
    /// Constants of the law.
    pub struct Porous = "porous" {
        /// Density of the solid (mass per volume), above that of the material.
        solid_density: DENSITY, Positive;
        /// c0 of the solid (velocity).
        c0: VELOCITY, Positive;
        /// Slope s of its shock line.
        s: NONE, NotNegative;
        /// Its Grueneisen coefficient Gamma0.
        gamma: NONE, NotNegative;
        /// Bulk speed of sound of the porous material (velocity), at most c0.
        porous_speed: VELOCITY, Positive;
        /// Pressure at which pores begin to be crushed.
        crush_pressure: STRESS, Positive;
        /// Pressure at which none is left.
        compaction_pressure: STRESS, Positive;
        /// Exponent of the curve between them.
        n: NONE, Positive = 2.0;
        /// The mean tension that it bears (stress).
        tension: STRESS, Positive = 1e30;
    }
}

impl Porous {
    /// What constants must be beside their bounds, in a material of this density.
    pub fn fault(&self, density: f64) -> Option<&'static str> {
        if self.solid_density <= density {
            return Some("a solid_density above the density of the material");
        }
        if self.porous_speed > self.c0 {
            return Some("a porous_speed of c0 or less");
        }
        if self.crush_pressure >= self.compaction_pressure {
            return Some("a compaction_pressure above crush_pressure");
        }
        if self.n < 1.0 {
            return Some("an exponent n of 1 or more");
        }
        let has_pores = Pores::new(self, density).crushed > 1.0;
        (!has_pores)
            .then_some("pores that a crush_pressure on an elastic material of porous_speed leaves open")
    }

    /// The shock line of the solid.
    pub(crate) fn solid(&self) -> Shock {
        Shock { bulk: self.solid_density * self.c0 * self.c0, s: self.s, gamma: self.gamma }
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct Pores {
    solid: Shock,
    /// alpha0.
    start: f64,
    /// alpha_e, where crushing begins.
    crushed: f64,
    /// `(c_e - c0) / (c0 (alpha_e - 1))`.
    softness: f64,
    crush_pressure: f64,
    compaction_pressure: f64,
    n: f64,
}

/// A state of the pores.
#[derive(Debug)]
pub(crate) struct Compacted<L> {
    /// `alpha`.
    pub distension: L,
    /// Share of the pores that has been crushed for good, 0 to 1.
    pub share: L,
}

/// Most steps to the pressure; halves of the interval alone would take as many to the last bits.
const STEPS: usize = 100;
/// A lane stops after a step of this part of its pressure, or of the crush pressure.
const SMALL: f64 = 1e-13;

impl Pores {
    pub fn new(law: &Porous, density: f64) -> Self {
        let (start, solid) = (law.solid_density / density, law.solid());
        let ratio = law.porous_speed / law.c0;
        // The elastic line with its slope at alpha_e, a multiple of the square of that, goes from there to alpha0.
        let slope = (1.0 / (ratio * ratio) - 1.0) * law.crush_pressure / solid.bulk;
        let crushed = 2.0 * start / (1.0 + (4.0 * slope).mul_add(start, 1.0).sqrt());
        Self {
            solid,
            start,
            crushed,
            softness: (ratio - 1.0) / (crushed - 1.0),
            crush_pressure: law.crush_pressure,
            compaction_pressure: law.compaction_pressure,
            n: law.n,
        }
    }

    /// alpha0 over a distension: the volume of the solid over its initial one, for each relative volume.
    #[inline(always)]
    pub fn stretch<L: Lane>(&self, distension: L) -> L {
        L::splat(self.start) / distension
    }

    /// Pressure and its slope by alpha, at a relative volume and an energy per initial volume.
    #[inline(always)]
    fn pressure<L: Lane>(&self, alpha: L, v: L, energy: L) -> (L, L) {
        let one = L::splat(1.0);
        let inverse = one / alpha;
        let solid_volume = v * L::splat(self.start) * inverse;
        let Line { a, b, slope_a, .. } = self.solid.line(solid_volume, one);
        let pressure = b.mul_add(energy * L::splat(self.start), a) * inverse;
        (pressure, -(slope_a * solid_volume).mul_add(inverse, pressure) * inverse)
    }

    /// Alpha and its slope at a pressure, where a share of the pores is crushed.
    #[inline(always)]
    fn distension<L: Lane>(&self, pressure: L, stopped: &Stopped<L>) -> (L, L) {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let open = L::splat(self.crushed - 1.0);
        let left = self.left(pressure);
        let power = pow(left, L::splat(self.n));
        let crushes = stopped.pressure.less(pressure);
        let range = self.compaction_pressure - self.crush_pressure;
        let slope = L::splat(-self.n / range) * open * power / left.max(L::splat(f64::MIN_POSITIVE));
        let alpha = power.mul_add(open, one);
        let elastic = stopped.slope.neg_mul_add(pressure - stopped.pressure, stopped.alpha);
        let slope = L::select(zero.less(left), slope, zero);
        (L::select(crushes, alpha, elastic), L::select(crushes, slope, -stopped.slope))
    }

    /// `(p_s - p) / (p_s - p_e)`, between 0 and 1.
    #[inline(always)]
    fn left<L: Lane>(&self, pressure: L) -> L {
        let range = self.compaction_pressure - self.crush_pressure;
        let left = (L::splat(self.compaction_pressure) - pressure) * L::splat(1.0 / range);
        left.max(L::splat(0.0)).min(L::splat(1.0))
    }

    /// Where crushing has stopped, with a share of the pores crushed.
    #[inline(always)]
    fn stopped<L: Lane>(&self, share: L) -> Stopped<L> {
        let one = L::splat(1.0);
        let open = (one - share).max(L::splat(0.0));
        let alpha = L::splat(self.crushed - 1.0).mul_add(open, one);
        let range = self.compaction_pressure - self.crush_pressure;
        let left = pow(open, L::splat(1.0 / self.n));
        let pressure = L::splat(range).neg_mul_add(left, L::splat(self.compaction_pressure));
        let h = L::splat(self.softness).mul_add(alpha - one, one);
        let slope = alpha * alpha * L::splat(1.0 / self.solid.bulk) * (one / (h * h) - one);
        Stopped { alpha, pressure, slope }
    }

    /// The distension at a relative volume and an energy, from a share of pores crushed so far; `near` is a pressure to begin with. Pressure falls
    /// with alpha on the curve of the pores and rises with it on that of the solid, so there is one root. It lies between nothing and the pressure with
    /// the pores that are open under no pressure; it is no lower than the pressure of the solid without pores, and no higher than `p_s` unless that is.
    /// Farther off, the line of the solid is beyond its pole and means nothing.
    #[inline(always)]
    pub fn compacted<L: Lane>(&self, v: L, energy: L, share: L, near: L) -> Compacted<L> {
        let (zero, one, half) = (L::splat(0.0), L::splat(1.0), L::splat(0.5));
        let stopped = self.stopped(share);
        let (solid, _) = self.pressure(one, v, energy);
        let (at_rest, _) = self.pressure(self.distension(zero, &stopped).0, v, energy);
        let mut low = at_rest.min(zero).max(solid);
        let mut high = at_rest.max(zero).min(L::splat(self.compaction_pressure)).max(solid);
        let mut p = near.max(low).min(high);
        let mut open = low.less(high);
        let mut last = high - low;
        let mut step = 0;
        while step < STEPS && L::any(open) {
            let (alpha, by_pressure) = self.distension(p, &stopped);
            let (found, by_alpha) = self.pressure(alpha, v, energy);
            let excess = p - found;
            let is_high = L::splat(0.0).less(excess);
            high = L::select(is_high, p, high);
            low = L::select(is_high, low, p);
            let newton = p - excess / by_alpha.neg_mul_add(by_pressure, one);
            // About the kink where crushing begins Newton's steps would go back and forth: each is to be half of the last at most.
            let inside = L::both(low.less_equal(newton), newton.less_equal(high));
            let shorter = ((newton - p).abs() + (newton - p).abs()).less_equal(last);
            let next = L::select(L::both(inside, shorter), newton, half * (low + high));
            let scale = p.abs().max(L::splat(self.crush_pressure));
            last = (next - p).abs();
            let far = (L::splat(SMALL) * scale).less(last);
            p = L::select(open, next, p);
            open = L::both(open, far);
            step += 1;
        }
        let (distension, _) = self.distension(p, &stopped);
        let crushes = stopped.pressure.less(p);
        let crushed = one - pow(self.left(p), L::splat(self.n));
        Compacted { distension, share: L::select(crushes, crushed.max(share), share) }
    }
}

/// Where crushing has stopped: alpha, pressure, and minus the slope of alpha from there down.
struct Stopped<L> {
    alpha: L,
    pressure: L,
    slope: L,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lanes::scalar::Scalar;

    /// Aluminium of the shock tables, a third of it pores.
    pub const LAW: Porous = Porous {
        solid_density: 2785.0,
        c0: 5328.0,
        s: 1.338,
        gamma: 2.0,
        porous_speed: 2500.0,
        crush_pressure: 0.1e9,
        compaction_pressure: 1.0e9,
        n: 2.0,
        tension: 1e30,
    };
    pub const DENSITY: f64 = 2785.0 / 1.5;

    fn at(v: f64, energy: f64, share: f64) -> (f64, f64, f64) {
        let pores = Pores::new(&LAW, DENSITY);
        let found = pores.compacted(Scalar(v), Scalar(energy), Scalar(share), Scalar(0.0));
        let (p, _) = pores.pressure(found.distension, Scalar(v), Scalar(energy));
        (p.0, found.distension.0, found.share.0)
    }

    /// The published curve of crushing in plain numbers; alpha_e by halves from the elastic line, whose h is 2500/5328 there.
    fn published(p: f64) -> f64 {
        let line = |alpha: f64| {
            let by_pressure =
                alpha * alpha / (2785.0 * 5328.0 * 5328.0) * ((5328.0f64 / 2500.0).powi(2) - 1.0);
            alpha + by_pressure * 0.1e9
        };
        let (mut low, mut high) = (1.0, 1.5);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if line(middle) < 1.5 { low = middle } else { high = middle }
        }
        1.0 + (low - 1.0) * ((1.0e9 - p) / 0.9e9).powi(2)
    }

    #[test]
    fn distension_follows_the_published_curve_and_what_is_crushed_stays_so() {
        let (mut share, mut compared) = (0.0, 0);
        for n in 0..=700 {
            let v = 1.0 - 0.0005 * f64::from(n);
            let (p, alpha, now) = at(v, 0.0, share);
            share = now;
            if (0.1e9..1e9).contains(&p) {
                assert!((alpha - published(p)).abs() < 1e-10, "{v}: {alpha} {}", published(p));
                compared += 1;
                // Unloaded, the pores stay shut but for the elastic line.
                let (less, back, same) = at(v + 1e-4, 0.0, share);
                assert!(less < p && back > alpha && back - alpha < 1e-3, "{less} {back}");
                assert_eq!(same, share);
            }
            if p >= 1e9 {
                // The solid alone: the cold line of Mie and Grueneisen.
                let eta = 1.0 - 1.5 * v;
                let bulk = 2785.0 * 5328.0 * 5328.0;
                let wanted = bulk * eta / (1.0 - 1.338 * eta).powi(2) * (1.0 - eta);
                assert!(
                    alpha == 1.0 && share == 1.0 && (p / wanted - 1.0).abs() < 1e-12,
                    "{v}: {p} {wanted}"
                );
            }
        }
        assert!(compared > 300, "{compared}");
        // What has been compacted goes back along the line of the solid, into tension.
        let (p, alpha, _) = at(0.67, 0.0, 1.0);
        assert!(p < 0.0 && alpha == 1.0, "{p} {alpha}");
    }

    #[test]
    fn the_pressure_is_the_root_of_both_curves_whatever_gamma() {
        for (density, speed, gamma) in
            [(5500.0, 800.0, 2.17), (3000.0, 1500.0, 2.17), (2000.0, 1000.0, 2.17), (7000.0, 1200.0, 2.77)]
        {
            let law = Porous {
                solid_density: 7850.0,
                c0: 4569.0,
                s: 1.49,
                gamma,
                porous_speed: speed,
                crush_pressure: 0.05e9,
                ..LAW
            };
            assert_eq!(law.fault(density), None);
            let pores = Pores::new(&law, density);
            let mut share = 0.0;
            for n in -40..=500 {
                let v = 1.0 - 0.001 * f64::from(n);
                let found = pores.compacted(Scalar(v), Scalar(0.0), Scalar(share), Scalar(0.0));
                let (p, _) = pores.pressure(found.distension, Scalar(v), Scalar(0.0));
                let (wanted, _) = pores.distension(p, &pores.stopped(Scalar(share)));
                assert!(
                    (found.distension.0 / wanted.0 - 1.0).abs() < 1e-9,
                    "{density}, {v}: {found:?}, {p:?}"
                );
                assert!(n != 0 || p.0.abs() < 1.0, "{density}: {p:?} at rest");
                share = found.share.0;
            }
        }
    }

    #[test]
    fn sound_goes_through_the_porous_material_at_its_speed() {
        let h = 1e-6;
        let stiffness = -(at(1.0 + h, 0.0, 0.0).0 - at(1.0 - h, 0.0, 0.0).0) / (2.0 * h);
        let speed = (stiffness / DENSITY).sqrt();
        assert!((speed / 2500.0 - 1.0).abs() < 0.01, "{speed}");
        assert!(at(1.0, 0.0, 0.0).0.abs() < 1.0 && (at(1.0, 0.0, 0.0).1 - 1.5).abs() < 1e-9);
    }

    /// Behind a strong shock no pores are left, so the state has a closed form: `p = a(1.5 v) / (1 - 1.5 gamma (1 - v) / 2)`.
    #[test]
    fn states_behind_strong_shocks_are_those_of_the_conservation_laws() {
        for v in [0.55, 0.6, 0.64_f64] {
            let eta = 1.0 - 1.5 * v;
            let bulk = 2785.0 * 5328.0 * 5328.0;
            let cold = bulk * eta / (1.0 - 1.338 * eta).powi(2) * (1.0 - eta);
            let p = cold / (1.0 - 1.5 * (1.0 - v));
            let (found, alpha, _) = at(v, 0.5 * p * (1.0 - v), 0.0);
            assert!(alpha == 1.0 && (found / p - 1.0).abs() < 1e-12, "{v}: {found} {p}");
        }
    }

    #[test]
    fn constants_without_pores_are_refused() {
        assert_eq!(LAW.fault(DENSITY), None);
        for law in [
            Porous { solid_density: DENSITY, ..LAW },
            Porous { porous_speed: 6000.0, ..LAW },
            Porous { compaction_pressure: 0.1e9, ..LAW },
            Porous { n: 0.5, ..LAW },
            Porous { crush_pressure: 9e9, compaction_pressure: 10e9, porous_speed: 900.0, ..LAW },
        ] {
            assert!(law.fault(DENSITY).is_some(), "{law:?}");
        }
    }
}
