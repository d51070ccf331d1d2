//! The named consistent sets of units, and conversion of library values from SI.
//!
//! Each unit of a set that the library is converted to is a power of ten of its SI unit, so that a conversion is one correctly rounded
//! multiplication or division by an exact power of ten.

use mechanics::{
    law::Unit,
    material::{CowperSymonds, Eos, Failure, Material, Strength},
};

/// What a constant measures: powers of length, mass and time, and whether it is per kelvin or in kelvin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Measure {
    pub(crate) unit: Unit,
    pub(crate) kelvin: i32,
}

impl Measure {
    pub(crate) const fn of(unit: Unit) -> Self {
        Self { unit, kelvin: 0 }
    }
}

/// A consistent set: one deck unit is ten to this power of the SI unit, where the library is converted to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Units {
    /// The name a deck writes.
    pub name: &'static str,
    length: i32,
    mass: i32,
    time: i32,
    /// Names of the units of length, mass, time, velocity and stress, for readers of results.
    pub symbols: [&'static str; 5],
    /// Whether a deck in these units may name materials of the library.
    pub takes_materials: bool,
}

/// The set that the library is not converted to.
const INCHES: &str = "in-s-lbf";

/// Every set a deck may name.
pub const SETS: [Units; 5] = [
    Units {
        name: "SI",
        length: 0,
        mass: 0,
        time: 0,
        symbols: ["m", "kg", "s", "m/s", "Pa"],
        takes_materials: true,
    },
    Units {
        name: "cm-g-us",
        length: -2,
        mass: -3,
        time: -6,
        symbols: ["cm", "g", "us", "cm/us", "Mbar"],
        takes_materials: true,
    },
    Units {
        name: "mm-ms-kg",
        length: -3,
        mass: 0,
        time: -3,
        symbols: ["mm", "kg", "ms", "m/s", "GPa"],
        takes_materials: true,
    },
    Units {
        name: "mm-s-t",
        length: -3,
        mass: 3,
        time: 0,
        symbols: ["mm", "t", "s", "mm/s", "MPa"],
        takes_materials: true,
    },
    Units {
        name: INCHES,
        length: 0,
        mass: 0,
        time: 0,
        symbols: ["in", "lbf*s2/in", "s", "in/s", "psi"],
        takes_materials: false,
    },
];

impl Units {
    /// The set of this name.
    pub fn named(name: &str) -> Option<Self> {
        SETS.into_iter().find(|set| set.name == name)
    }

    /// Units of length, mass and time in m, kg and s.
    pub fn in_si(&self) -> [f64; 3] {
        if self.name == INCHES {
            // An inch, and the mass that a pound-force accelerates by an inch per square second.
            return [0.0254, 175.126_835_246_476_7, 1.0];
        }
        // The powers of `scale` are those of a unit in SI, the other way round.
        [self.length, self.mass, self.time].map(|power| scale(1.0, -power))
    }

    /// What a constant is counted in; empty for a plain number.
    pub(crate) fn word(&self, measure: Measure) -> String {
        let [length, mass, time, velocity, stress] = self.symbols;
        let power = |unit: &str, n: i32| if n == 1 { unit.to_string() } else { format!("{unit}{n}") };
        let Measure { unit: Unit { length: l, mass: m, time: t }, kelvin } = measure;
        // Joules per kilogram where they are what the powers come to.
        let joules = ["SI", "mm-ms-kg"].contains(&self.name);
        let word = match [l, m, t] {
            [0, 0, 0] if kelvin > 0 => return power("K", kelvin),
            [0, 0, 0] if kelvin < 0 => "1".to_string(),
            [0, 0, 0] => String::new(),
            [1, 0, -1] => velocity.to_string(),
            [-1, 1, -2] => stress.to_string(),
            [1, -1, 2] => format!("1/{stress}"),
            [2, 0, -2] if joules => "J/kg".to_string(),
            [2, 0, -2] => format!("({velocity})2"),
            _ => {
                let powers = [(mass, m), (length, l), (time, t)];
                let above: Vec<String> =
                    powers.iter().filter(|(_, n)| *n > 0).map(|(unit, n)| power(unit, *n)).collect();
                let below = powers.iter().filter(|(_, n)| *n < 0).map(|(unit, n)| power(unit, -n));
                let above = if above.is_empty() { "1".to_string() } else { above.join("*") };
                below.fold(above, |word, unit| format!("{word}/{unit}"))
            }
        };
        if kelvin < 0 { format!("{word}/{}", power("K", -kelvin)) } else { word }
    }

    fn velocity(&self) -> i32 {
        self.length - self.time
    }

    fn density(&self) -> i32 {
        self.mass - 3 * self.length
    }

    fn stress(&self) -> i32 {
        self.mass - self.length - 2 * self.time
    }

    /// One unit of the set is ten to this power of the SI unit.
    fn power(&self, unit: Unit) -> i32 {
        unit.length * self.length + unit.mass * self.mass + unit.time * self.time
    }

    /// Metres, milliseconds and kPa in a unit of length, time and stress, and kilograms in one of mass.
    pub(crate) fn in_air(&self) -> ([f64; 3], f64) {
        if !self.takes_materials {
            // Inches, pounds of force and seconds.
            let (inch, pound) = (0.0254, 4.448_221_615_260_5);
            return ([inch, 1e3, pound / (inch * inch) * 1e-3], pound / inch);
        }
        let factor = |power: i32| 1.0 / scale(1.0, power);
        ([factor(self.length), factor(self.time) * 1e3, factor(self.stress()) * 1e-3], factor(self.mass))
    }

    fn specific_energy(&self) -> i32 {
        2 * self.velocity()
    }

    /// A material with SI constants, in this set. Temperatures stay in K.
    pub fn from_si(&self, material: &Material) -> Material {
        let stress = |x| scale(x, self.stress());
        Material {
            name: material.name.clone(),
            density: scale(material.density, self.density()),
            eos: match material.eos {
                Eos::Linear { bulk } => Eos::Linear { bulk: stress(bulk) },
                Eos::Shock { c0, s, gamma } => Eos::Shock { c0: scale(c0, self.velocity()), s, gamma },
                Eos::Polynomial { a1, a2, a3, b0, b1, t1, t2 } => Eos::Polynomial {
                    a1: stress(a1),
                    a2: stress(a2),
                    a3: stress(a3),
                    b0,
                    b1,
                    t1: stress(t1),
                    t2: stress(t2),
                },
                Eos::Porous(_) | Eos::Tabulated(_) | Eos::Tillotson(_) => {
                    material.eos.converted(&|unit, x| scale(x, self.power(unit)))
                }
                Eos::IdealGas { gamma, energy } => {
                    Eos::IdealGas { gamma, energy: scale(energy, self.specific_energy()) }
                }
                // Energy per volume is a stress.
                Eos::Jwl { a, b, r1, r2, omega, energy, detonation, cj_pressure } => Eos::Jwl {
                    a: stress(a),
                    b: stress(b),
                    r1,
                    r2,
                    omega,
                    energy: stress(energy),
                    detonation: scale(detonation, self.velocity()),
                    cj_pressure: stress(cj_pressure),
                },
            },
            strength: match material.strength {
                Strength::Hydro => Strength::Hydro,
                Strength::Elastic { shear } => Strength::Elastic { shear: stress(shear) },
                Strength::VonMises { shear, yield_stress, hardening, rate } => Strength::VonMises {
                    shear: stress(shear),
                    yield_stress: stress(yield_stress),
                    hardening: stress(hardening),
                    rate: rate.map(|rate| self.cowper_symonds(rate)),
                },
                Strength::Tabulated { shear, mut hardening, rate } => {
                    hardening.stress = hardening.stress.map(stress);
                    let rate = rate.map(|rate| self.cowper_symonds(rate));
                    Strength::Tabulated { shear: stress(shear), hardening, rate }
                }
                Strength::JohnsonCook {
                    shear,
                    a,
                    b,
                    n,
                    c,
                    m,
                    t_melt,
                    t_room,
                    specific_heat,
                    rate0,
                    heat,
                } => Strength::JohnsonCook {
                    shear: stress(shear),
                    a: stress(a),
                    b: stress(b),
                    n,
                    c,
                    m,
                    t_melt,
                    t_room,
                    specific_heat: scale(specific_heat, self.specific_energy()),
                    rate0: scale(rate0, -self.time),
                    heat,
                },
                declared => declared.converted(&|unit, x| scale(x, self.power(unit))),
            },
            failure: self.failure_from_si(material.failure),
        }
    }

    /// A failure law with SI constants, in this set.
    pub fn failure_from_si(&self, failure: Failure) -> Failure {
        let stress = |x| scale(x, self.stress());
        match failure {
            Failure::PrincipalStress { tension } => Failure::PrincipalStress { tension: stress(tension) },
            Failure::Hydrostatic { tension, heals } => {
                Failure::Hydrostatic { tension: stress(tension), heals }
            }
            // Work per volume is a stress.
            Failure::CockcroftLatham { work } => Failure::CockcroftLatham { work: stress(work) },
            // Strains alone.
            Failure::None | Failure::PlasticStrain { .. } | Failure::JohnsonCook { .. } => failure,
        }
    }

    fn cowper_symonds(&self, law: CowperSymonds) -> CowperSymonds {
        CowperSymonds { reference: scale(law.reference, -self.time), ..law }
    }
}

/// `x` SI units in units of ten to the `exponent` SI units.
fn scale(x: f64, exponent: i32) -> f64 {
    let mut power = 1.0;
    for _ in 0..exponent.abs() {
        power *= 10.0;
    }
    if exponent > 0 { x / power } else { x * power }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(name: &str) -> Units {
        *SETS.iter().find(|s| s.name == name).expect("a set of the list")
    }

    #[test]
    fn cm_g_us_measures_stress_in_megabar() {
        let units = set("cm-g-us");
        assert_eq!(scale(1e11, units.stress()).to_bits(), 1.0f64.to_bits());
        assert_eq!(scale(7896.0, units.density()).to_bits(), 7.896f64.to_bits());
        assert_eq!(scale(4569.0, units.velocity()).to_bits(), 0.4569f64.to_bits());
    }

    #[test]
    fn mm_ms_kg_measures_stress_in_gigapascal_and_mm_s_t_in_megapascal() {
        assert_eq!(scale(1e9, set("mm-ms-kg").stress()).to_bits(), 1.0f64.to_bits());
        assert_eq!(scale(1e6, set("mm-s-t").stress()).to_bits(), 1.0f64.to_bits());
        assert_eq!(scale(8000.0, set("mm-s-t").density()).to_bits(), 8e-9f64.to_bits());
    }

    #[test]
    fn steel_weighs_the_same_in_every_set() {
        for (name, density) in [
            ("SI", 7850.0),
            ("cm-g-us", 7.85),
            ("mm-ms-kg", 7.85e-6),
            ("mm-s-t", 7.85e-9),
            ("in-s-lbf", 7.3454e-4),
        ] {
            let [length, mass, _] = set(name).in_si();
            let si = density * mass / (length * length * length);
            assert!((si / 7850.0 - 1.0).abs() < 1e-4, "{name}: {si}");
        }
    }

    #[test]
    fn every_set_is_consistent() {
        // Stress is density times velocity squared, whatever the units.
        for units in SETS {
            assert_eq!(units.stress(), units.density() + 2 * units.velocity(), "{}", units.name);
            assert_eq!(units.power(Unit::STRESS), units.stress(), "{}", units.name);
            assert_eq!(units.power(Unit::NONE), 0, "{}", units.name);
        }
    }
}
