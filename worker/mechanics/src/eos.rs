//! Equations of state on lanes: pressure as a line in the internal energy.
//!
//! Every law here has the form `p = a(v) + b(v) E`, with v the volume and E the internal energy, both per
//! initial volume; one that is no line in the energy gives its tangent. The energy equation of a cycle is then solved in closed form, and one formula gives the
//! isentropic stiffness of all of them. A law that burns is given the fraction that has burnt; the others leave it
//! unread. A new law is a file like its neighbours here: constants, [`EquationOfState`], tests of points and slopes.

use crate::{
    lanes::Lane,
    material::{Eos, Material},
};

pub(crate) mod ideal_gas;
pub(crate) mod jwl;
pub(crate) mod linear;
pub(crate) mod polynomial;
pub(crate) mod porous;
pub(crate) mod shock;
pub(crate) mod tabulated;
pub(crate) mod tillotson;

pub use porous::Porous;
pub use tabulated::{MAX_POINTS, Points, Tabulated};
pub use tillotson::Tillotson;
pub(crate) use {
    ideal_gas::IdealGas, jwl::Jwl, linear::Linear, polynomial::Polynomial, shock::Shock, tabulated::ByPoints,
    tillotson::Vapour,
};

/// A law of pressure.
pub(crate) trait EquationOfState: Copy {
    /// Whether which law it is shows only at run time.
    const IS_CHOSEN: bool = false;

    /// Whether the law burns, hence reads the time until it is lit.
    #[inline(always)]
    fn burns(&self) -> bool {
        false
    }

    /// The line and its slope at relative volumes `v > 0`, with the burnt fraction `burnt`.
    fn line<L: Lane>(&self, v: L, burnt: L) -> Line<L>;

    /// The same about an energy per initial volume: of a law that is no line in the energy, its tangent there.
    #[inline(always)]
    fn line_about<L: Lane>(&self, v: L, burnt: L, _energy: L) -> Line<L> {
        self.line(v, burnt)
    }

    /// Least bulk stiffness used for the sound speed (stress), where tension has softened the law.
    fn least_stiffness<L: Lane>(&self, burnt: L) -> L;

    /// How far an element of this initial volume has burnt, from the time until lighting (negative after it).
    #[inline(always)]
    fn burn<L: Lane>(&self, time_to_light: L, _v: L, _initial_volume: L) -> Burn<L> {
        Burn { time_to_light, burnt: L::splat(1.0), pace_square: L::splat(0.0) }
    }
}

/// Any of the laws, chosen by the material: the choice is one branch for a lane set, the same for the whole block.
#[expect(clippy::large_enum_variant, reason = "one for a block; its points stand in place")]
#[derive(Clone, Copy)]
pub(crate) enum AnyEos {
    Linear(Linear),
    Shock(Shock),
    Polynomial(Polynomial),
    IdealGas(IdealGas),
    Jwl(Jwl),
    Tabulated(ByPoints),
    Tillotson(Vapour),
}

impl AnyEos {
    /// That of a material, made ready.
    pub fn of(material: &Material) -> Self {
        match material.eos {
            Eos::Linear { bulk } => Self::Linear(Linear { bulk }),
            Eos::Shock { c0, s, gamma } => Self::Shock(Shock { bulk: material.density * c0 * c0, s, gamma }),
            Eos::Polynomial { a1, a2, a3, b0, b1, t1, t2 } => {
                Self::Polynomial(Polynomial { a: [a1, a2, a3], b: [b0, b1], t: [t1, t2] })
            }
            Eos::Tabulated(law) => Self::Tabulated(ByPoints::new(&law)),
            Eos::Tillotson(law) => Self::Tillotson(Vapour::new(&law, material.density)),
            // The solid: its elements have a kernel that brings its line to their distension, see `strength/porous.rs`.
            Eos::Porous(law) => Self::Shock(law.solid()),
            Eos::IdealGas { gamma, .. } => Self::IdealGas(IdealGas { gamma }),
            Eos::Jwl { a, b, r1, r2, omega, energy: _, detonation, cj_pressure } => {
                let unburnt_stiffness = material.density * detonation * detonation;
                Self::Jwl(Jwl {
                    amplitude: [a, b],
                    decay: [r1, r2],
                    omega,
                    detonation,
                    unburnt_stiffness,
                    inverse_compression: unburnt_stiffness / cj_pressure,
                })
            }
        }
    }
}

impl EquationOfState for AnyEos {
    const IS_CHOSEN: bool = true;

    #[inline(always)]
    fn burns(&self) -> bool {
        matches!(self, Self::Jwl(_))
    }

    #[inline(always)]
    fn line<L: Lane>(&self, v: L, burnt: L) -> Line<L> {
        match self {
            Self::Linear(law) => law.line(v, burnt),
            Self::Shock(law) => law.line(v, burnt),
            Self::Polynomial(law) => law.line(v, burnt),
            Self::IdealGas(law) => law.line(v, burnt),
            Self::Jwl(law) => law.line(v, burnt),
            Self::Tabulated(law) => law.line(v, burnt),
            Self::Tillotson(law) => law.line(v, burnt),
        }
    }

    #[inline(always)]
    fn line_about<L: Lane>(&self, v: L, burnt: L, energy: L) -> Line<L> {
        match self {
            Self::Tillotson(law) => law.line_about(v, burnt, energy),
            _ => self.line(v, burnt),
        }
    }

    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, burnt: L) -> L {
        match self {
            Self::Linear(law) => law.least_stiffness(burnt),
            Self::Shock(law) => law.least_stiffness(burnt),
            Self::Polynomial(law) => law.least_stiffness(burnt),
            Self::IdealGas(law) => law.least_stiffness(burnt),
            Self::Jwl(law) => law.least_stiffness(burnt),
            Self::Tabulated(law) => law.least_stiffness(burnt),
            Self::Tillotson(law) => law.least_stiffness(burnt),
        }
    }

    #[inline(always)]
    fn burn<L: Lane>(&self, time_to_light: L, v: L, initial_volume: L) -> Burn<L> {
        match self {
            Self::Jwl(law) => law.burn(time_to_light, v, initial_volume),
            _ => Burn { time_to_light, burnt: L::splat(1.0), pace_square: L::splat(0.0) },
        }
    }
}

/// How far an element has burnt.
#[derive(Clone, Copy)]
pub(crate) struct Burn<L> {
    /// Time until lighting, which a compression to the end of the burn has brought to the end of it.
    pub time_to_light: L,
    /// From 0 to 1.
    pub burnt: L,
    /// Square of the speed at which the burn crosses elements, for the limit of the step; 0 where none is near.
    pub pace_square: L,
}

/// Slope of the isentrope by differences, for the tests of the laws: `-v dp/dv` with `dE = -p dv`.
#[cfg(test)]
pub(crate) fn difference_stiffness<E: EquationOfState>(law: &E, v: f64, energy: f64, burnt: f64) -> f64 {
    use crate::lanes::scalar::Scalar;
    let at = |v: f64, energy: f64| law.line(Scalar(v), Scalar(burnt)).pressure(Scalar(energy)).0;
    let (p, h) = (at(v, energy), 1e-6 * v);
    -v * (at(v + h, energy - p * h) - at(v - h, energy + p * h)) / (2.0 * h)
}

/// `p = a + b E` at one relative volume, and the derivatives of a and b with respect to it.
#[derive(Clone, Copy)]
pub(crate) struct Line<L> {
    /// Pressure at zero energy.
    pub a: L,
    /// Pressure per energy per initial volume.
    pub b: L,
    /// `d a / d v`.
    pub slope_a: L,
    /// `d b / d v`.
    pub slope_b: L,
}

impl<L: Lane> Line<L> {
    /// That of a porous solid, from this one of the solid at its own volume: its pressure over the distension, its volume the `stretch` of the
    /// relative one and its energy per volume that of fewer solid. Without pores, 1 and 1, it is the same to the bit.
    #[inline(always)]
    pub fn of_porous(&self, distension: L, stretch: L) -> Self {
        let share = L::splat(1.0) / distension;
        let by_volume = share * stretch;
        Self {
            a: self.a * share,
            b: self.b * stretch,
            slope_a: self.slope_a * by_volume,
            slope_b: self.slope_b * (stretch * stretch),
        }
    }

    /// Pressure at energy E per initial volume.
    #[inline(always)]
    pub fn pressure(&self, energy: L) -> L {
        self.b.mul_add(energy, self.a)
    }

    /// Isentropic bulk stiffness `rho c^2 = -v dp/dv = v (b p - a' - b' E)`, since `dE = -p dv` on the isentrope.
    #[inline(always)]
    pub fn stiffness(&self, v: L, pressure: L, energy: L) -> L {
        v * self.b.mul_add(pressure, -self.slope_b.mul_add(energy, self.slope_a))
    }

    /// Energy at the end of a step in which the volume changed by `dv` against the mean of the pressures at its
    /// ends and against `viscosity`: solves `E = before - ((p_before + a + b E) / 2 + viscosity) dv`.
    #[inline(always)]
    pub fn energy_after(&self, before: L, pressure_before: L, viscosity: L, dv: L) -> L {
        let half = L::splat(0.5);
        let resistance = half.mul_add(pressure_before + self.a, viscosity);
        resistance.neg_mul_add(dv, before) / (half * self.b).mul_add(dv, L::splat(1.0))
    }
}
