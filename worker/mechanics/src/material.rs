//! Laws: a material is an equation of state, a strength law and a failure law.
//!
//! The enums hold constants only; the lane code that evaluates them stands in `eos/`, `strength/` and `failure/`, one
//! file per law. To add a strength law: a file beside the others (copy `strength/voce.rs`: constants with units and bounds, the
//! update in three dimensions and in plane stress, tests of points and slopes), its lines in the lists of `strength.rs`, and an
//! entry in the list of laws that the tests of bits run; the deck reads and converts what the law declares. An equation of state
//! or a failure law also needs a variant here, a reader in the deck's `library.rs` and the powers of its units in `units.rs`.

use serde::{Deserialize, Serialize};

use crate::law::{Declaration, Unit};

pub use crate::eos::{MAX_POINTS, Points, Porous, Tabulated, Tillotson};
pub use crate::strength::{CowperSymonds, Hardening, Heat, MAX_HARDENING, Strength};

/// One material: constants in the deck's consistent units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the library or the deck.
    pub name: String,
    /// Initial density (mass per volume).
    pub density: f64,
    /// Pressure from compression and energy.
    pub eos: Eos,
    /// Deviatoric stress. Gases and products of detonation have none, whatever stands here.
    pub strength: Strength,
    /// When and how an element breaks.
    pub failure: Failure,
}

/// Equation of state: pressure from `mu = rho/rho0 - 1` and internal energy.
#[expect(clippy::large_enum_variant, reason = "one for a material; its points stand in place")]
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
    /// With `mu = rho/rho0 - 1`: `a1 mu + a2 mu^2 + a3 mu^3 + (b0 + b1 mu) E` in compression,
    /// `t1 mu + t2 mu^2 + b0 E` in tension, E per initial volume.
    Polynomial {
        /// A1 (stress): the bulk modulus.
        a1: f64,
        /// A2 (stress).
        a2: f64,
        /// A3 (stress).
        a3: f64,
        /// B0.
        b0: f64,
        /// B1.
        b1: f64,
        /// T1 (stress).
        t1: f64,
        /// T2 (stress).
        t2: f64,
    },
    /// By points.
    Tabulated(Tabulated),
    /// A porous solid that is compacted.
    Porous(Porous),
    /// A solid and the vapour that it expands to.
    Tillotson(Tillotson),
    /// `p = (gamma - 1) rho e`.
    IdealGas {
        /// Ratio of specific heats.
        gamma: f64,
        /// Internal energy at the start (energy per mass).
        energy: f64,
    },
    /// Products of detonation after Jones, Wilkins and Lee, lit by a programmed burn.
    Jwl {
        /// A (stress).
        a: f64,
        /// B (stress).
        b: f64,
        /// R1.
        r1: f64,
        /// R2.
        r2: f64,
        omega: f64,
        /// Energy of detonation (energy per initial volume).
        energy: f64,
        /// Speed of detonation D (velocity).
        detonation: f64,
        /// Pressure of detonation (stress), that of the Chapman-Jouguet state.
        cj_pressure: f64,
    },
}

/// Failure law. A failed element bears neither tension nor shear, keeps its mass and its place in the mesh, and still
/// resists compression. The stress falls in the cycle after the one in which the damage came to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Failure {
    /// Never.
    None,
    /// At an effective plastic strain.
    PlasticStrain {
        /// The strain.
        limit: f64,
    },
    /// When the largest principal stress comes to a limit.
    PrincipalStress {
        /// The limit (stress, positive in tension).
        tension: f64,
    },
    /// When the mean stress comes to a limit, which it does not pass.
    Hydrostatic {
        /// The limit (stress, positive in tension).
        tension: f64,
        /// Whether compression makes the element whole again, as in a fluid.
        heals: bool,
    },
    /// When the plastic work of the greatest principal stress, where it is a tension, comes to a limit (Cockcroft and Latham 1968).
    CockcroftLatham {
        /// The limit (energy per volume).
        work: f64,
    },
    /// Damage `sum of (plastic strain increment / e_f)`,
    /// `e_f = (d1 + d2 exp(d3 eta))(1 + d4 ln max(rate/rate0, 1))(1 + d5 T*)`, `eta = -p / von Mises stress`
    /// (Johnson and Cook 1985). `rate0` and the temperatures of T* are those of the Johnson-Cook strength; with another
    /// strength both factors are 1.
    JohnsonCook {
        /// d1 to d5.
        d: [f64; 5],
    },
}

impl Eos {
    /// The laws that declare their constants.
    pub const DECLARED: &'static [Declaration<Eos>] = &[
        Declaration {
            name: Porous::NAME,
            constants: Porous::CONSTANTS,
            of: |values| Eos::Porous(Porous::of(values)),
        },
        Declaration {
            name: Tillotson::NAME,
            constants: Tillotson::CONSTANTS,
            of: |values| Eos::Tillotson(Tillotson::of(values)),
        },
    ];

    /// The name and the constants by key of a law that declares them.
    pub fn declared(&self) -> Option<(&'static str, Vec<(&'static str, f64)>)> {
        match self {
            Eos::Porous(law) => Some((Porous::NAME, law.constants())),
            Eos::Tillotson(law) => Some((Tillotson::NAME, law.constants())),
            _ => None,
        }
    }

    /// A law that declares its constants with each as `convert` makes it of its unit and value; any other law as it is.
    pub fn converted(self, convert: &dyn Fn(Unit, f64) -> f64) -> Self {
        match self {
            Eos::Porous(law) => Eos::Porous(law.converted(convert)),
            Eos::Tillotson(law) => Eos::Tillotson(law.converted(convert)),
            Eos::Tabulated(mut law) => {
                law.pressure.value = law.pressure.value.map(|stress| convert(Unit::STRESS, stress));
                Eos::Tabulated(law)
            }
            other => other,
        }
    }

    /// What the constants would have to be, where each is within its bounds and in a material of this density they make no law.
    pub fn fault(&self, density: f64) -> Option<&'static str> {
        match self {
            Eos::Porous(law) => law.fault(density),
            Eos::Tillotson(law) => law.fault(),
            Eos::Tabulated(law) => law.fault(),
            _ => None,
        }
    }
}

impl Material {
    /// That of elements without mass, which have none of a deck: springs and dampers.
    pub fn massless() -> Self {
        Self {
            name: "no material".to_owned(),
            density: 0.0,
            eos: Eos::Linear { bulk: 0.0 },
            strength: Strength::Hydro,
            failure: Failure::None,
        }
    }

    /// Whether it has no mass ([`Material::massless`]).
    pub fn is_massless(&self) -> bool {
        self.density == 0.0
    }

    /// Whether the equation of state is that of a gas, which has no strength.
    pub fn is_gas(&self) -> bool {
        matches!(self.eos, Eos::IdealGas { .. } | Eos::Jwl { .. })
    }

    /// Bulk modulus of the undeformed material (stress): K, `gamma p` of a gas at the start, `rho D^2` of an
    /// explosive, which bounds the stiffness and the pressure of its products.
    pub fn bulk(&self) -> f64 {
        match self.eos {
            Eos::Linear { bulk } => bulk,
            Eos::Shock { c0, .. } => self.density * c0 * c0,
            Eos::Polynomial { a1, .. } => a1,
            Eos::Tabulated(law) => law.bulk(),
            Eos::Tillotson(law) => law.bulk,
            Eos::Porous(law) => self.density * law.porous_speed * law.porous_speed,
            Eos::IdealGas { gamma, .. } => gamma * self.initial_pressure(),
            Eos::Jwl { detonation, .. } => self.density * detonation * detonation,
        }
    }

    /// Modulus of waves of one strain at rest: that of the bulk and four thirds of that of shear (stress).
    pub fn wave_modulus(&self) -> f64 {
        self.bulk() + 4.0 / 3.0 * self.shear()
    }

    /// Speed of sound of such waves (velocity); 0 without mass.
    pub fn sound_speed(&self) -> f64 {
        if self.is_massless() {
            return 0.0;
        }
        (self.wave_modulus() / self.density).sqrt()
    }

    /// Internal energy at the start (energy per initial volume).
    pub fn initial_energy(&self) -> f64 {
        match self.eos {
            Eos::IdealGas { energy, .. } => self.density * energy,
            Eos::Jwl { energy, .. } => energy,
            Eos::Linear { .. } | Eos::Shock { .. } | Eos::Polynomial { .. } => 0.0,
            Eos::Tabulated(_) | Eos::Porous(_) | Eos::Tillotson(_) => 0.0,
        }
    }

    /// Pressure at the start (stress); an explosive has none before it is lit.
    pub fn initial_pressure(&self) -> f64 {
        match self.eos {
            Eos::IdealGas { gamma, .. } => (gamma - 1.0) * self.initial_energy(),
            _ => 0.0,
        }
    }

    /// Speed of detonation of an explosive (velocity).
    pub fn detonation_speed(&self) -> Option<f64> {
        match self.eos {
            Eos::Jwl { detonation, .. } => Some(detonation),
            _ => None,
        }
    }

    /// Initial temperature (K); zero for laws without one.
    pub fn initial_temperature(&self) -> f64 {
        match self.strength {
            Strength::JohnsonCook { t_room, .. } => t_room,
            Strength::ModifiedJohnsonCook(law) => law.t_room,
            Strength::ZerilliArmstrong(law) => law.t_room,
            Strength::SteinbergGuinan(law) => law.t_room,
            _ => 0.0,
        }
    }
}
