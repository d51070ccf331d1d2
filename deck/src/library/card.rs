//! What a person wants to know of a material of the library: its laws with formulas, each constant with its unit and meaning, the
//! source, and a `[[material]]` to paste into a deck.

use mechanics::{
    law::Unit,
    material::{Failure, Material},
};
use serde::Serialize;

use super::{
    constants::{Written, of_eos, of_failure, of_strength},
    entries, find,
};
use crate::{
    fault::nearest,
    units::{Measure, Units},
    write,
};

/// A material of the library in a set of units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Card {
    pub name: String,
    /// Name of the set of units of every value.
    pub units: String,
    pub density: Constant,
    pub eos: Law,
    pub strength: Law,
    /// None of a material whose elements do not fail by themselves.
    pub failure: Option<Law>,
    /// The failure law of the parts that say `fracture = true`, where the library has one.
    pub fracture: Option<Law>,
    /// Where the constants come from.
    pub source: String,
    /// The material as a `[[material]]` of a deck in these units, under a name of its own.
    pub toml: String,
}

/// An equation of state, a strength or a failure law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Law {
    /// The word after `type` in a deck.
    #[serde(rename = "type")]
    pub kind: String,
    /// What follows from the constants.
    pub formula: &'static str,
    pub constants: Vec<Constant>,
}

/// A constant of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Constant {
    /// The key that a deck writes.
    pub key: String,
    pub value: f64,
    /// Empty for a plain number.
    pub unit: String,
    pub meaning: &'static str,
}

/// The material of that name in this set of units; none where the library has none of that name.
pub fn card(name: &str, units: &Units) -> Option<Card> {
    let entry = entries().iter().find(|entry| entry.material.name == name)?;
    let material = units.from_si(&entry.material);
    let law = |role: Role, written: Written| law(role, written, units);
    let fracture = entry.fracture.map(|failure| units.failure_from_si(failure));
    Some(Card {
        name: material.name.clone(),
        units: units.name.to_string(),
        density: Constant {
            key: "density".to_string(),
            value: material.density,
            unit: units.word(Measure::of(DENSITY)),
            meaning: "density at the start",
        },
        eos: law(Role::Eos, of_eos(material.eos)),
        strength: law(Role::Strength, of_strength(&material.strength)),
        failure: of_failure(material.failure).map(|written| law(Role::Failure, written)),
        fracture: fracture.and_then(of_failure).map(|written| law(Role::Failure, written)),
        source: entry.source.clone(),
        toml: block(&material, fracture, units, &entry.source),
    })
}

/// Names of the library that somebody who wrote `name` may have meant: those that hold each piece of it, else the one that is spelt
/// most alike, else none.
pub fn near(name: &str) -> Vec<&'static str> {
    let lower = name.to_lowercase();
    let pieces: Vec<&str> =
        lower.split(|c: char| !c.is_alphanumeric()).filter(|piece| !piece.is_empty()).collect();
    let names = || entries().iter().map(|entry| entry.material.name.as_str());
    let holds = |known: &&str| pieces.iter().all(|piece| known.to_lowercase().contains(piece));
    let found: Vec<&str> = names().filter(|known| !pieces.is_empty() && holds(known)).collect();
    if found.is_empty() { nearest(name, names()).into_iter().collect() } else { found }
}

/// A `[[material]]`, with a comment that says where it is from.
fn block(material: &Material, fracture: Option<Failure>, units: &Units, source: &str) -> String {
    debug_assert!(find(&material.name).is_some(), "{} is not of the library", material.name);
    let own = Material { name: format!("my {}", material.name), ..material.clone() };
    let mut text = format!("# {} of the library, in {}. {source}\n", material.name, units.name);
    text += write::material(&own).trim_start();
    if let Some(fracture) = fracture {
        let broken = write::material(&Material { failure: fracture, ..own });
        let line = broken.lines().find(|line| line.starts_with("failure"));
        text += &line.map_or_else(String::new, |line| format!("# {line}   # as fracture = true has it\n"));
    }
    text
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Eos,
    Strength,
    Failure,
}

const DENSITY: Unit = Unit { length: -3, mass: 1, time: 0 };
const VELOCITY: Unit = Unit { length: 1, mass: 0, time: -1 };
const SPECIFIC: Unit = Unit { length: 2, mass: 0, time: -2 };
const NONE: Measure = Measure::of(Unit::NONE);
const STRESS: Measure = Measure::of(Unit::STRESS);
const RATE: Measure = Measure::of(Unit::RATE);
const COMPLIANCE: Measure = Measure::of(Unit::COMPLIANCE);
const SPEED: Measure = Measure::of(VELOCITY);
const KELVIN: Measure = Measure { unit: Unit::NONE, kelvin: 1 };
const PER_KELVIN: Measure = Measure { unit: Unit::NONE, kelvin: -1 };
const HEAT: Measure = Measure { unit: SPECIFIC, kelvin: -1 };
const ENERGY: Measure = Measure::of(SPECIFIC);

/// The law with what it says of itself.
fn law(role: Role, written: Written, units: &Units) -> Law {
    let about = LAWS.iter().find(|law| law.role == role && law.kind == written.kind);
    let about = about.expect("every law is described, as a test makes sure");
    let described = |key: &str, value: f64| {
        let (_, measure, meaning) = about.constants.iter().find(|(known, ..)| *known == key).copied()?;
        Some(Constant { key: key.to_string(), value, unit: units.word(measure), meaning })
    };
    let mut constants: Vec<Constant> =
        written.constants.iter().filter_map(|(key, value)| described(key, *value)).collect();
    if let Some(rate) = written.rate {
        let of = |key: &str, value, measure, meaning| Constant {
            key: format!("cowper_symonds.{key}"),
            value,
            unit: units.word(measure),
            meaning,
        };
        constants.push(of("reference", rate.reference, RATE, "strain rate that doubles the yield stress"));
        constants.push(of("exponent", rate.exponent, NONE, "exponent of the rate"));
    }
    Law { kind: written.kind.to_string(), formula: about.formula, constants }
}

/// What a law is, and what its constants are.
struct About {
    role: Role,
    kind: &'static str,
    formula: &'static str,
    constants: &'static [(&'static str, Measure, &'static str)],
}

const SHEAR: (&str, Measure, &str) = ("shear", STRESS, "shear modulus");

/// The laws that materials of the library have.
const LAWS: [About; 22] = [
    About {
        role: Role::Eos,
        kind: "linear",
        formula: "p = bulk ln(rho/rho0)",
        constants: &[("bulk", STRESS, "bulk modulus")],
    },
    About {
        role: Role::Eos,
        kind: "polynomial",
        formula: "p = a1 mu + a2 mu^2 + a3 mu^3 + (b0 + b1 mu) E in compression, t1 mu + t2 mu^2 + b0 E in tension; mu = rho/rho0 - 1",
        constants: &[
            ("a1", STRESS, "bulk modulus"),
            ("a2", STRESS, "factor of mu^2"),
            ("a3", STRESS, "factor of mu^3"),
            ("b0", NONE, "pressure for each unit of energy per volume"),
            ("b1", NONE, "the same, times mu"),
            ("t1", STRESS, "bulk modulus in tension"),
            ("t2", STRESS, "factor of mu^2 in tension"),
        ],
    },
    About {
        role: Role::Eos,
        kind: "shock",
        formula: "Mie-Grueneisen about the shock line Us = c0 + s up, rho gamma constant",
        constants: &[
            ("c0", SPEED, "bulk speed of sound"),
            ("s", NONE, "slope of shock speed over particle speed"),
            ("gamma", NONE, "Grueneisen's coefficient"),
        ],
    },
    About {
        role: Role::Eos,
        kind: "ideal-gas",
        formula: "p = (gamma - 1) rho e",
        constants: &[
            ("gamma", NONE, "ratio of the specific heats"),
            ("energy", Measure::of(SPECIFIC), "internal energy per mass at the start"),
        ],
    },
    About {
        role: Role::Eos,
        kind: "jwl",
        formula: "p = a (1 - omega/(r1 v)) exp(-r1 v) + b (1 - omega/(r2 v)) exp(-r2 v) + omega E/v, v = rho0/rho",
        constants: &[
            ("a", STRESS, "factor of the first exponential"),
            ("b", STRESS, "factor of the second exponential"),
            ("r1", NONE, "decay of the first exponential"),
            ("r2", NONE, "decay of the second exponential"),
            ("omega", NONE, "Grueneisen's coefficient of the products"),
            ("energy", STRESS, "energy per volume that detonation releases"),
            ("detonation", SPEED, "speed of the detonation"),
            ("cj_pressure", STRESS, "pressure of the detonation (Chapman-Jouguet)"),
        ],
    },
    About {
        role: Role::Eos,
        kind: "tillotson",
        formula: "p = (a + b/w) E/v + A mu + B mu^2, w = 1 + E v^2/E0; stretched and above complete_energy a E/v + (b E/(v w) + A mu exp(-beta (v - 1))) exp(-alpha (v - 1)^2), between both energies a line",
        constants: &[
            ("a", NONE, "share of the energy that is pressure in a vapour"),
            ("b", NONE, "what is besides where it is cold"),
            ("bulk", STRESS, "A: bulk modulus"),
            ("quadratic", STRESS, "B: factor of mu^2"),
            ("energy0", ENERGY, "E0 over the density, from which on b matters less"),
            ("incipient_energy", ENERGY, "energy of incipient vaporisation"),
            ("complete_energy", ENERGY, "energy of complete vaporisation"),
            ("alpha", NONE, "how fast what is cold thins out by volume"),
            ("beta", NONE, "how fast the cold pressure does besides"),
        ],
    },
    About { role: Role::Strength, kind: "hydro", formula: "no strength", constants: &[] },
    About {
        role: Role::Strength,
        kind: "von-mises",
        formula: "yield stress = yield_stress + hardening e, e the plastic strain",
        constants: &[
            SHEAR,
            ("yield_stress", STRESS, "yield stress at the start"),
            ("hardening", STRESS, "slope of the yield stress over the plastic strain"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "johnson-cook",
        formula: "yield stress = (a + b e^n)(1 + c ln(rate/rate0))(1 - T*^m), T* = (T - t_room)/(t_melt - t_room)",
        constants: &[
            SHEAR,
            ("a", STRESS, "yield stress at the start, at rate0 and t_room"),
            ("b", STRESS, "factor of hardening"),
            ("n", NONE, "exponent of hardening"),
            ("c", NONE, "factor of the logarithm of the rate"),
            ("m", NONE, "exponent of thermal softening"),
            ("t_melt", KELVIN, "melting temperature: no strength above"),
            ("t_room", KELVIN, "temperature at the start"),
            ("specific_heat", HEAT, "energy that warms a unit of mass by 1 K"),
            ("rate0", RATE, "strain rate at which a, b and n were measured"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "modified-johnson-cook",
        formula: "yield stress = (a + b e^n + q1 (1 - exp(-c1 e)) + q2 (1 - exp(-c2 e)))(1 + rate/rate0)^c (1 - T*^m), T* = (T - t_room)/(t_melt - t_room)",
        constants: &[
            SHEAR,
            ("a", STRESS, "yield stress at the start, at rest and t_room"),
            ("b", STRESS, "factor of hardening by a power"),
            ("n", NONE, "exponent of hardening"),
            ("q1", STRESS, "hardening that the first term comes to"),
            ("c1", NONE, "how fast, by the plastic strain"),
            ("q2", STRESS, "hardening that the second term comes to"),
            ("c2", NONE, "how fast, by the plastic strain"),
            ("c", NONE, "exponent of the rate"),
            ("m", NONE, "exponent of thermal softening"),
            ("t_melt", KELVIN, "melting temperature: no strength above"),
            ("t_room", KELVIN, "temperature at the start"),
            ("specific_heat", HEAT, "energy that warms a unit of mass by 1 K"),
            ("rate0", RATE, "reference strain rate"),
            ("taylor_quinney", NONE, "share of the plastic work that becomes heat"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "zerilli-armstrong",
        formula: "yield stress = c0 + (c1 + c2 sqrt(e)) exp(-c3 T + c4 T ln(rate/rate0)) + c5 e^n",
        constants: &[
            SHEAR,
            ("c0", STRESS, "part that rate and temperature do not change"),
            ("c1", STRESS, "thermal part of body-centred metals"),
            ("c2", STRESS, "factor of the hardening of face-centred metals"),
            ("c3", PER_KELVIN, "softening by temperature"),
            ("c4", PER_KELVIN, "hardening by the logarithm of the rate"),
            ("c5", STRESS, "factor of the hardening of body-centred metals"),
            ("n", NONE, "exponent of that hardening"),
            ("t_room", KELVIN, "temperature at the start"),
            ("specific_heat", HEAT, "energy that warms a unit of mass by 1 K"),
            ("rate0", RATE, "unit of the rate under the logarithm"),
            ("taylor_quinney", NONE, "share of the plastic work that becomes heat"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "steinberg-guinan",
        formula: "G = shear f(pressure_factor), yield stress = min(yield_stress (1 + beta (e + initial_strain))^n, yield_limit) f(yield_pressure_factor), f(A) = 1 + A p/eta^(1/3) - temperature_factor (T - t_room), eta = rho/rho0; both 0 above the melting curve",
        constants: &[
            ("shear", STRESS, "shear modulus at rest and t_room"),
            ("yield_stress", STRESS, "yield stress at the start, at rest and t_room"),
            ("yield_limit", STRESS, "the most that hardening comes to"),
            ("beta", NONE, "factor of hardening"),
            ("n", NONE, "exponent of hardening"),
            ("initial_strain", NONE, "plastic strain before the start"),
            ("pressure_factor", COMPLIANCE, "stiffening by pressure"),
            ("yield_pressure_factor", COMPLIANCE, "strengthening by pressure"),
            ("temperature_factor", PER_KELVIN, "softening by temperature"),
            ("t_melt", KELVIN, "melting temperature at rest"),
            ("melt_gamma", NONE, "Grueneisen's coefficient of the melting curve"),
            ("melt_a", NONE, "its change by volume"),
            ("t_room", KELVIN, "temperature at the start"),
            ("specific_heat", HEAT, "energy that warms a unit of mass by 1 K"),
            ("tension", STRESS, "mean tension that it bears"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "riedel-hiermaier-thoma",
        formula: "strength = compressive_strength (1 - D) s(P*) R + D residual_a P*^residual_n, s through uniaxial compression, shear and tension; the pressure collapses pores from crush_pressure to compaction_pressure",
        constants: &[
            SHEAR,
            ("compressive_strength", STRESS, "uniaxial compressive strength at rest"),
            ("tension", NONE, "tensile strength, over compressive_strength"),
            ("shear_strength", NONE, "strength in shear, over compressive_strength"),
            ("a", NONE, "factor of the failure surface"),
            ("n", NONE, "exponent of the failure surface"),
            ("q0", NONE, "tensile over compressive meridian"),
            ("b", NONE, "how that grows with P*"),
            ("rate0", RATE, "rate in compression up to which the strength stays"),
            ("tension_rate0", RATE, "the same in tension"),
            ("beta", NONE, "exponent of the rate in compression"),
            ("tension_beta", NONE, "exponent of the rate in tension"),
            ("elastic_compression", NONE, "elastic limit over the strength in compression"),
            ("elastic_tension", NONE, "the same in tension"),
            ("hardening", NONE, "hardening shear modulus over shear"),
            ("d1", NONE, "strain to fracture where P* above that of tearing is 1"),
            ("d2", NONE, "its exponent"),
            ("least_strain", NONE, "least strain to fracture"),
            ("residual_a", NONE, "factor of the residual surface"),
            ("residual_n", NONE, "its exponent"),
            ("distension", NONE, "density without pores over density"),
            ("crush_pressure", STRESS, "pressure at which pores begin to collapse"),
            ("compaction_pressure", STRESS, "pressure at which all have collapsed"),
            ("pore_exponent", NONE, "exponent of the distension"),
            ("a1", STRESS, "bulk modulus without pores"),
            ("a2", STRESS, "factor of the square"),
            ("a3", STRESS, "factor of the cube"),
            ("b0", NONE, "factor of the energy"),
            ("b1", NONE, "that times the compression"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "orthotropic",
        formula: "elastic along axes that turn with the element, until fibres (a), matrix (b) or layers (c) come to their strengths",
        constants: &[
            ("young_a", STRESS, "Young's modulus along the fibres"),
            ("young_b", STRESS, "Young's modulus along b"),
            ("young_c", STRESS, "Young's modulus along c, across the layers"),
            ("poisson_ba", NONE, "minus the strain along a of a stress along b, over that along b"),
            ("poisson_ca", NONE, "the same along a of a stress along c"),
            ("poisson_cb", NONE, "the same along b of a stress along c"),
            ("modulus_ab", STRESS, "shear modulus of the plane ab"),
            ("modulus_bc", STRESS, "shear modulus of the plane bc"),
            ("modulus_ca", STRESS, "shear modulus of the plane ca"),
            ("ax", NONE, "axis a at the start, x"),
            ("ay", NONE, "axis a at the start, y"),
            ("az", NONE, "axis a at the start, z"),
            ("dx", NONE, "vector in the plane ab, x"),
            ("dy", NONE, "vector in the plane ab, y"),
            ("dz", NONE, "vector in the plane ab, z"),
            ("tension_a", STRESS, "strength of fibres in tension"),
            ("compression_a", STRESS, "strength of fibres in compression"),
            ("tension_b", STRESS, "strength of the matrix in tension"),
            ("compression_b", STRESS, "strength of the matrix in compression"),
            ("shear_ab", STRESS, "strength of the matrix in shear"),
            ("tension_c", STRESS, "strength between layers in tension"),
            ("shear_bc", STRESS, "strength between layers in shear across the fibres"),
            ("shear_ca", STRESS, "strength between layers in shear along the fibres"),
            ("failed_bulk", STRESS, "bulk modulus of what has failed"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "chang-chang",
        formula: "layers of shells: elastic along axes that turn with the element, until fibres (a) or matrix (b) fail in tension or compression",
        constants: &[
            ("young_a", STRESS, "Young's modulus along the fibres"),
            ("young_b", STRESS, "Young's modulus across them"),
            ("poisson_ba", NONE, "minus the strain along a of a stress along b, over that along b"),
            ("modulus_ab", STRESS, "shear modulus of the plane ab"),
            ("modulus_bc", STRESS, "shear modulus of the plane bc"),
            ("modulus_ca", STRESS, "shear modulus of the plane ca"),
            ("ax", NONE, "direction of angle 0 at the start, x"),
            ("ay", NONE, "direction of angle 0 at the start, y"),
            ("az", NONE, "direction of angle 0 at the start, z"),
            ("tension_a", STRESS, "strength of fibres in tension"),
            ("compression_a", STRESS, "strength of fibres in compression"),
            ("tension_b", STRESS, "strength of the matrix in tension"),
            ("compression_b", STRESS, "strength of the matrix in compression"),
            ("shear_ab", STRESS, "strength of the matrix in shear"),
            ("shear_share", NONE, "share of the shear term in fibre tension"),
            ("crushed_tension", NONE, "share of tension_a where the matrix is crushed"),
            ("crushed_compression", NONE, "share of compression_a where the matrix is crushed"),
            ("strain_tension_a", NONE, "strain at failure along a in tension"),
            ("strain_compression_a", NONE, "strain at failure along a in compression"),
            ("strain_b", NONE, "strain at failure along b"),
            ("strain_ab", NONE, "shear strain at failure, of the tensor"),
            ("strain_effective", NONE, "effective strain at failure"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "johnson-holmquist",
        formula: "strength = hel_stress (s_i - D (s_i - s_f)), s_i = a (P* + T*)^n (1 + c ln(rate/rate0)), s_f = b P*^m (1 + c ln(rate/rate0))",
        constants: &[
            SHEAR,
            ("a", NONE, "strength of the intact material, over hel_stress"),
            ("b", NONE, "strength of the fractured material, over hel_stress"),
            ("c", NONE, "factor of the logarithm of the rate"),
            ("m", NONE, "exponent of pressure, fractured"),
            ("n", NONE, "exponent of pressure, intact"),
            ("rate0", RATE, "strain rate up to which the strength stays"),
            ("tension", STRESS, "mean tension that the intact material bears"),
            ("fractured_limit", NONE, "greatest strength fractured, over hel_stress"),
            ("hel_stress", STRESS, "equivalent stress at the Hugoniot elastic limit"),
            ("hel_pressure", STRESS, "pressure at the Hugoniot elastic limit"),
            ("beta", NONE, "share of released elastic energy that swells it"),
            ("d1", NONE, "plastic strain to fracture where P* + T* is 1"),
            ("d2", NONE, "exponent of that strain"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "johnson-holmquist-1",
        formula: "strength by lines from 0 at -tension to strength1 at pressure1 and strength2 at pressure2, times 1 + c ln(rate/rate0), until the damage is 1; then alpha p, at most failed_limit",
        constants: &[
            SHEAR,
            ("strength1", STRESS, "strength at pressure1"),
            ("pressure1", STRESS, "pressure of the first point"),
            ("strength2", STRESS, "strength at pressure2 and above"),
            ("pressure2", STRESS, "pressure of the second point"),
            ("c", NONE, "factor of the logarithm of the rate"),
            ("rate0", RATE, "strain rate up to which the strength stays"),
            ("tension", STRESS, "mean tension that the intact material bears"),
            ("alpha", NONE, "strength of failed material for each unit of pressure"),
            ("failed_limit", STRESS, "greatest strength of failed material"),
            ("fracture_strain", NONE, "greatest plastic strain to fracture"),
            ("fracture_pressure", STRESS, "pressure from which on it is that"),
            ("beta", NONE, "share of released elastic energy that swells it"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "holmquist-johnson-cook",
        formula: "strength = compressive_strength (a (1 - D) + b P*^n)(1 + c ln(rate/rate0)), at most strength_limit; the pressure crushes pores from the crush to the lock point",
        constants: &[
            SHEAR,
            ("a", NONE, "cohesion, over compressive_strength"),
            ("b", NONE, "factor of the pressure"),
            ("n", NONE, "exponent of the pressure"),
            ("c", NONE, "factor of the logarithm of the rate"),
            ("rate0", RATE, "strain rate up to which the strength stays"),
            ("compressive_strength", STRESS, "uniaxial compressive strength at rest"),
            ("strength_limit", NONE, "greatest strength, over compressive_strength"),
            ("tension", STRESS, "mean tension that it bears"),
            ("crush_pressure", STRESS, "pressure at which pores begin to collapse"),
            ("crush_compression", NONE, "rho/rho0 - 1 there"),
            ("lock_pressure", STRESS, "pressure at which all have collapsed"),
            ("lock_compression", NONE, "rho/rho0 - 1 without pores and pressure"),
            ("k1", STRESS, "bulk modulus without pores"),
            ("k2", STRESS, "factor of the square"),
            ("k3", STRESS, "factor of the cube"),
            ("d1", NONE, "strain to fracture where P* + T* is 1"),
            ("d2", NONE, "exponent of that strain"),
            ("least_strain", NONE, "least strain to fracture"),
        ],
    },
    About {
        role: Role::Strength,
        kind: "ogden",
        formula: "Cauchy stress = 1/J sum of mu_i (l^alpha_i - mean) along the principal stretches l at unit volume",
        constants: &[
            ("mu1", STRESS, "factor of the first term"),
            ("alpha1", NONE, "exponent of the first term"),
            ("mu2", STRESS, "factor of the second term"),
            ("alpha2", NONE, "exponent of the second term"),
            ("mu3", STRESS, "factor of the third term"),
            ("alpha3", NONE, "exponent of the third term"),
        ],
    },
    About {
        role: Role::Failure,
        kind: "hydrostatic",
        formula: "fails where the pressure falls to -tension",
        constants: &[("tension", STRESS, "mean tension that it bears")],
    },
    About {
        role: Role::Failure,
        kind: "cockcroft-latham",
        formula: "fails where the integral of the greatest principal stress, in tension, over the plastic strain comes to work",
        constants: &[("work", STRESS, "critical plastic work per volume")],
    },
    About {
        role: Role::Failure,
        kind: "johnson-cook",
        formula: "fails where the sum of de/e_f comes to 1, e_f = (d1 + d2 exp(d3 eta))(1 + d4 ln(rate/rate0))(1 + d5 T*), eta the triaxiality",
        constants: &[
            ("d1", NONE, "strain to fracture under great tension"),
            ("d2", NONE, "factor of triaxiality"),
            ("d3", NONE, "exponent of triaxiality"),
            ("d4", NONE, "factor of the logarithm of the rate"),
            ("d5", NONE, "factor of the temperature"),
        ],
    },
];

#[cfg(test)]
mod tests;
