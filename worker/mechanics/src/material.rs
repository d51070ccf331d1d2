//! Laws: a material is an equation of state and a strength law.
//!
//! The enums hold constants only; the lane code that evaluates them stands in `eos/` and `strength/`, one
//! file per law.

use serde::{Deserialize, Serialize};

/// One material: constants in the deck's consistent units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the library or the deck.
    pub name: String,
    /// Initial density (mass per volume).
    pub density: f64,
    /// Pressure from compression and energy.
    pub eos: Eos,
    /// Deviatoric stress.
    pub strength: Strength,
}

/// Equation of state: pressure from `mu = rho/rho0 - 1` and internal energy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Eos {
    /// `p = K ln(rho/rho0)`: linear in the logarithmic volume strain, no energy term.
    Linear {
        /// Bulk modulus K (stress).
        bulk: f64,
    },
    /// Mie-Grueneisen about the straight `Us = c0 + s up`, with `rho Gamma = rho0 Gamma0`.
    Shock {
        /// Bulk sound speed c0 (velocity).
        c0: f64,
        /// Slope s of the Hugoniot line.
        s: f64,
        /// Grueneisen coefficient Gamma0.
        gamma: f64,
    },
}

/// Strength law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Strength {
    /// No shear strength.
    Hydro,
    /// Hypoelastic.
    Elastic {
        /// Shear modulus G (stress).
        shear: f64,
    },
    /// Von Mises yield with linear isotropic hardening: `Y = yield_stress + hardening * plastic strain`.
    VonMises {
        /// Shear modulus G (stress).
        shear: f64,
        /// Initial yield stress.
        yield_stress: f64,
        /// `d Y / d plastic strain`.
        hardening: f64,
    },
    /// `Y = (A + B e^n)(1 + C ln max(rate/rate0, 1))(1 - T*^m)`, `T* = (T - t_room)/(t_melt - t_room)` clamped
    /// to 0..1; T rises by plastic work over `density * specific_heat` (Johnson and Cook 1983).
    JohnsonCook {
        /// Shear modulus G (stress).
        shear: f64,
        /// A (stress).
        a: f64,
        /// B (stress).
        b: f64,
        /// Hardening exponent n.
        n: f64,
        /// Rate coefficient C.
        c: f64,
        /// Thermal exponent m.
        m: f64,
        /// Melting temperature (K).
        t_melt: f64,
        /// Room temperature (K), also the initial one.
        t_room: f64,
        /// Specific heat (energy per mass per K).
        specific_heat: f64,
        /// Reference strain rate (1/time).
        rate0: f64,
    },
}

impl Material {
    /// Shear modulus G (stress); zero without strength.
    pub fn shear(&self) -> f64 {
        match self.strength {
            Strength::Hydro => 0.0,
            Strength::Elastic { shear }
            | Strength::VonMises { shear, .. }
            | Strength::JohnsonCook { shear, .. } => shear,
        }
    }

    /// Bulk modulus K of the undeformed material (stress).
    pub fn bulk(&self) -> f64 {
        match self.eos {
            Eos::Linear { bulk } => bulk,
            Eos::Shock { c0, .. } => self.density * c0 * c0,
        }
    }

    /// Initial temperature (K); zero for laws without one.
    pub fn initial_temperature(&self) -> f64 {
        match self.strength {
            Strength::JohnsonCook { t_room, .. } => t_room,
            _ => 0.0,
        }
    }
}
