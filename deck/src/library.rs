//! The material library, and how a material is read: `[[material]]` of a deck and an entry of the library
//! have the same keys.

pub mod card;
pub(crate) mod constants;

use std::sync::OnceLock;

use mechanics::{
    law::{Bound, Constant},
    material::{
        CowperSymonds, Eos, Failure, Hardening, Heat, MAX_HARDENING, MAX_POINTS, Material, Points, Strength,
        Tabulated,
    },
};
use toml::de::DeTable;

use crate::{
    fault::Faults,
    table::{Range, Table, Value},
};

/// The library as it stands in the repository, SI.
const TEXT: &str = include_str!("../materials.toml");

struct Entry {
    material: Material,
    /// Failure that a part has to ask for.
    fracture: Option<Failure>,
    source: String,
}

/// Names of the library, in its order.
pub fn names() -> Vec<&'static str> {
    entries().iter().map(|entry| entry.material.name.as_str()).collect()
}

/// The material of that name, SI.
pub fn find(name: &str) -> Option<&'static Material> {
    entries().iter().find(|entry| entry.material.name == name).map(|entry| &entry.material)
}

/// The fracture constants of a library material, which apply to the parts that ask for them.
pub fn fracture(name: &str) -> Option<Failure> {
    entries().iter().find(|entry| entry.material.name == name).and_then(|entry| entry.fracture)
}

/// Where the constants of a library material come from.
pub fn source(name: &str) -> Option<&'static str> {
    entries().iter().find(|entry| entry.material.name == name).map(|entry| entry.source.as_str())
}

/// The embedded library, read once.
fn entries() -> &'static [Entry] {
    static ENTRIES: OnceLock<Vec<Entry>> = OnceLock::new();
    ENTRIES.get_or_init(|| {
        let faults = Faults::new("materials.toml", TEXT);
        let mut entries = Vec::new();
        match DeTable::parse(TEXT) {
            Ok(document) => {
                for (name, value) in document.get_ref() {
                    let Some(table) = value.get_ref().as_table() else { continue };
                    let name = name.get_ref().to_string();
                    let table = Table::new(table, value.span().start, format!("[{name}]"), &faults);
                    let source =
                        table.require("source", "the origin of the constants").and_then(|v| v.text());
                    let fracture = table
                        .get("fracture")
                        .and_then(|v| read_failure(v, v.table(format!("fracture of \"{name}\""))?, None));
                    if let (Some(material), Some(source)) = (read_material(table, name), source) {
                        entries.push(Entry { material, fracture, source: source.to_string() });
                    }
                }
            }
            Err(error) => faults.add(0, error.message(), "a library", "mend materials.toml"),
        }
        let list = faults.into_list();
        assert!(list.is_empty(), "the embedded library has faults: {list:?}");
        entries
    })
}

/// Reads the constants of a material; `None` after reporting what is wrong.
pub(crate) fn read_material(table: Table<'_>, name: String) -> Option<Material> {
    let density = table.number("density", Range::Positive);
    let eos_value = table.require("eos", "an equation of state { type = ..., ... }");
    let eos = eos_value.and_then(|v| v.table(format!("eos of \"{name}\""))).and_then(read_eos);
    let strength_value = table.get("strength");
    let strength = match strength_value {
        None => Some(Strength::Hydro),
        Some(v) => v.table(format!("strength of \"{name}\"")).and_then(read_strength),
    };
    let failure_value = table.get("failure");
    let failure = match failure_value {
        None => Some(Failure::None),
        Some(v) => {
            v.table(format!("failure of \"{name}\"")).and_then(|t| read_failure(v, t, strength.as_ref()))
        }
    };
    table.finish();
    let material = Material { name, density: density?, eos: eos?, strength: strength?, failure: failure? };
    if let (Some(value), Some(expected)) = (eos_value, material.eos.fault(material.density)) {
        value.fault(expected, "correct the constants");
        return None;
    }
    if let Some(bulk) = material.strength.bulk().filter(|_| !material.is_gas())
        && !matches!(material.eos, Eos::Linear { bulk: given } if (given / bulk - 1.0).abs() < 1e-3)
    {
        let expected =
            format!("{{ type = \"linear\", bulk = {bulk} }}: this strength makes the pressure itself");
        eos_value
            .into_iter()
            .for_each(|eos| eos.fault(&expected, "write it so: the time step follows from it"));
    }
    for clash in clashes(&material) {
        let (value, expected) = match clash {
            Clash::Strength => (strength_value, "no strength in a gas or an explosive"),
            Clash::Failure => (failure_value, "no failure in a gas or an explosive"),
            Clash::Damage if material.strength.damages() => {
                (failure_value, "no failure beside a strength that has damage of its own")
            }
            Clash::Damage if material.history().is_empty() => {
                (failure_value, "no failure beside a strength that follows pressure and energy")
            }
            Clash::Damage => (failure_value, "no failure beside a law with history variables"),
            Clash::Porous => (
                strength_value,
                "a strength without history variables, heated by plastic work, in a porous material",
            ),
            Clash::Vapour => (strength_value, "a strength heated by plastic work beside tillotson"),
        };
        if let Some(value) = value {
            value.fault(expected, "remove it");
        }
    }
    Some(material)
}

/// What does not go with a gas, an explosive or another law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Clash {
    Strength,
    Failure,
    /// A failure law beside a strength law with history variables, its own damage mostly.
    Damage,
    /// A strength that sees the energy or keeps something, beside an equation of state that does.
    Porous,
    /// A temperature by internal energy above a cold curve, of which the equation of state is no line.
    Vapour,
}

/// What of a material does not go together.
pub(crate) fn clashes(material: &Material) -> impl Iterator<Item = Clash> + use<> {
    let gas = material.is_gas();
    let damaged = !gas && material.remembers() && material.failure != Failure::None;
    let strength = (gas && material.strength != Strength::Hydro).then_some(Clash::Strength);
    let failure = (gas && material.failure != Failure::None).then_some(Clash::Failure);
    let porous = matches!(material.eos, Eos::Porous(_)) && material.has_strength_with_energy();
    let by_energy = matches!(material.strength, Strength::JohnsonCook { heat: Heat::InternalEnergy, .. });
    let vapour = matches!(material.eos, Eos::Tillotson(_)) && by_energy;
    let both =
        [damaged.then_some(Clash::Damage), porous.then_some(Clash::Porous), vapour.then_some(Clash::Vapour)];
    strength.into_iter().chain(failure).chain(both.into_iter().flatten())
}

/// The equations of state that are read by hand, by the word a deck writes.
const EQUATIONS: [&str; 6] = ["linear", "polynomial", "shock", "ideal-gas", "tabulated", "jwl"];

fn read_eos(table: Table<'_>) -> Option<Eos> {
    let declared = Eos::DECLARED.iter().map(|law| law.name);
    let all: Vec<&str> = EQUATIONS.iter().copied().chain(declared).collect();
    let words = all.join(", ");
    let kind = table.require("type", &format!("one of {words}"))?.one_of(&all)?;
    if let Some(declared) = kind.checked_sub(EQUATIONS.len()) {
        let law = &Eos::DECLARED[declared];
        let eos = read_constants(&table, law.constants).map(|values| (law.of)(&values));
        table.finish();
        return eos;
    }
    let positive = |key| table.number(key, Range::Positive);
    let eos = match EQUATIONS[kind] {
        "linear" => positive("bulk").map(|bulk| Eos::Linear { bulk }),
        "polynomial" => {
            let a1 = positive("a1");
            let (a2, a3) = (table.number_or("a2", 0.0, Range::Any), table.number_or("a3", 0.0, Range::Any));
            let b0 = table.number_or("b0", 0.0, Range::NotNegative);
            let b1 = table.number_or("b1", 0.0, Range::NotNegative);
            let t1 = table.number_or("t1", a1.unwrap_or_default(), Range::Positive);
            let t2 = table.number_or("t2", 0.0, Range::Any);
            a1.map(|a1| Eos::Polynomial { a1, a2, a3, b0, b1, t1, t2 })
        }
        "shock" => {
            let c0 = positive("c0");
            let s = table.number("s", Range::NotNegative);
            let gamma = table.number("gamma", Range::NotNegative);
            c0.zip(s).zip(gamma).map(|((c0, s), gamma)| Eos::Shock { c0, s, gamma })
        }
        "tabulated" => read_tabulated(&table),
        "ideal-gas" => {
            let gamma = table.number("gamma", Range::Within(1.0, 10.0, "a number above 1 and at most 10"));
            let energy = positive("energy");
            gamma.zip(energy).map(|(gamma, energy)| Eos::IdealGas { gamma, energy })
        }
        _ => read_jwl(&table),
    };
    table.finish();
    eos
}

fn read_tabulated(table: &Table<'_>) -> Option<Eos> {
    let gamma = table.number_or("gamma", 0.0, Range::NotNegative);
    let pressure = table
        .require("points", "[[ln(rho/rho0), pressure], ...]")
        .and_then(|points| read_points(points, "[ln(rho/rho0), pressure]"));
    let factor = match table.get("factors") {
        Some(points) => read_points(points, "[ln(rho/rho0), factor]"),
        None => Some(Points::through(&[[0.0, 1.0]])),
    };
    Some(Eos::Tabulated(Tabulated { gamma, pressure: pressure?, factor: factor? }))
}

/// Points of a curve by the logarithm of the density, of either sign.
fn read_points(value: Value<'_>, what: &str) -> Option<Points> {
    let items = value.items()?;
    if items.is_empty() || items.len() > MAX_POINTS {
        value.fault(&format!("1 to {MAX_POINTS} points"), "leave out those that lie on a line");
        return None;
    }
    let mut points: Vec<[f64; 2]> = Vec::new();
    for item in &items {
        let point = item.numbers::<2>(what, Range::Any)?;
        if points.last().is_some_and(|last| point[0] <= last[0]) {
            item.fault("ln(rho/rho0) that ascends", "order the points");
            return None;
        }
        points.push(point);
    }
    Some(Points::through(&points))
}

fn read_jwl(table: &Table<'_>) -> Option<Eos> {
    let positive = |key| table.number(key, Range::Positive);
    let (a, b) = (positive("a"), table.number("b", Range::NotNegative));
    let (r1, r2, omega) = (positive("r1"), positive("r2"), positive("omega"));
    let (energy, detonation) = (positive("energy"), positive("detonation"));
    let cj_pressure = positive("cj_pressure");
    Some(Eos::Jwl {
        a: a?,
        b: b?,
        r1: r1?,
        r2: r2?,
        omega: omega?,
        energy: energy?,
        detonation: detonation?,
        cj_pressure: cj_pressure?,
    })
}

/// The strength laws that are read by hand, by the word a deck writes.
const STRENGTHS: [&str; 5] = ["hydro", "elastic", "von-mises", "tabulated", "johnson-cook"];

fn read_strength(table: Table<'_>) -> Option<Strength> {
    let declared = Strength::DECLARED.iter().map(|law| law.name);
    let curved = Strength::CURVED.iter().map(|law| law.name);
    let all: Vec<&str> = STRENGTHS.iter().copied().chain(declared).chain(curved).collect();
    let words = all.join(", ");
    let kind = table.require("type", &format!("one of {words}"))?.one_of(&all)?;
    if let Some(declared) = kind.checked_sub(STRENGTHS.len()) {
        let strength = match declared.checked_sub(Strength::DECLARED.len()) {
            None => {
                let law = &Strength::DECLARED[declared];
                read_constants(&table, law.constants).map(|values| (law.of)(&values))
            }
            Some(curved) => {
                let law = &Strength::CURVED[curved];
                let points = table.require("points", &format!("[{}, ...]", law.points));
                let curve = points.and_then(|points| read_curve(points, law.points, true));
                read_constants(&table, law.constants)
                    .zip(curve)
                    .map(|(values, curve)| (law.of)(&values, curve))
            }
        };
        let fault = strength.as_ref().and_then(Strength::fault);
        if let Some(expected) = fault {
            table.faults.add(table.at, table.title.clone(), expected, "correct the constants");
        }
        table.finish();
        return strength.filter(|_| fault.is_none());
    }
    let strength = match STRENGTHS[kind] {
        "hydro" => Some(Strength::Hydro),
        "elastic" => table.number("shear", Range::Positive).map(|shear| Strength::Elastic { shear }),
        "von-mises" => {
            let shear = table.number("shear", Range::Positive);
            let yield_stress = table.number("yield_stress", Range::Positive);
            let hardening = table.number_or("hardening", 0.0, Range::NotNegative);
            let rate = read_cowper_symonds(&table);
            shear.zip(yield_stress).zip(rate).map(|((shear, yield_stress), rate)| Strength::VonMises {
                shear,
                yield_stress,
                hardening,
                rate,
            })
        }
        "tabulated" => {
            let shear = table.number("shear", Range::Positive);
            let hardening = table.require("points", "[[plastic strain, yield stress], ...]");
            let hardening =
                hardening.and_then(|points| read_curve(points, "[plastic strain, yield stress]", false));
            let rate = read_cowper_symonds(&table);
            shear.zip(hardening).zip(rate).map(|((shear, hardening), rate)| Strength::Tabulated {
                shear,
                hardening,
                rate,
            })
        }
        _ => read_johnson_cook(&table),
    };
    table.finish();
    strength
}

/// The constants of a law that says itself which it has; `None` after reporting what is wrong.
fn read_constants(table: &Table<'_>, constants: &[Constant]) -> Option<Vec<f64>> {
    let number = |constant: &Constant| {
        let range = match constant.bound {
            Bound::Positive => Range::Positive,
            Bound::NotNegative => Range::NotNegative,
            Bound::Fraction => Range::Within(-f64::MIN_POSITIVE, 1.0, "a number from 0 to 1"),
            Bound::Any => Range::Any,
        };
        match constant.default {
            Some(default) => Some(table.number_or(constant.key, default, range)),
            None => table.number(constant.key, range),
        }
    };
    // All are read before the first that is missing ends it, so that every fault is reported.
    let values: Vec<Option<f64>> = constants.iter().map(number).collect();
    values.into_iter().collect()
}

/// The rate factor of a yield stress, if it has one; `None` after reporting what is wrong.
fn read_cowper_symonds(table: &Table<'_>) -> Option<Option<CowperSymonds>> {
    let Some(value) = table.get("cowper_symonds") else { return Some(None) };
    let inner = value.table(format!("cowper_symonds in {}", table.title))?;
    let reference = inner.number("reference", Range::Positive);
    let exponent = inner.number("exponent", Range::Positive);
    inner.finish();
    Some(Some(CowperSymonds { reference: reference?, exponent: exponent? }))
}

/// Points of a curve, which may begin without stress.
fn read_curve(value: Value<'_>, what: &str, from_zero: bool) -> Option<Hardening> {
    let items = value.items()?;
    if items.is_empty() || items.len() > MAX_HARDENING {
        value.fault(&format!("1 to {MAX_HARDENING} points"), "leave out those that lie on a line");
        return None;
    }
    let mut hardening = Hardening {
        n_points: items.len() as u32,
        strain: [0.0; MAX_HARDENING],
        stress: [0.0; MAX_HARDENING],
    };
    for (i, item) in items.iter().enumerate() {
        let [strain, stress] = item.numbers::<2>(what, Range::NotNegative)?;
        let fits = match i.checked_sub(1) {
            None => strain == 0.0 && (stress > 0.0 || (from_zero && items.len() > 1)),
            Some(last) => {
                let zero = i + 1 == items.len() && stress == 0.0;
                strain > hardening.strain[last] && stress >= hardening.stress[last] && !zero
            }
        };
        if !fits {
            let expected =
                "plastic strains from 0 upwards, each with a yield stress above 0 not below the one before";
            let from_nothing =
                "strains from 0 upwards, each with a stress not below the one before, the last above 0";
            let expected = if from_zero { from_nothing } else { expected };
            item.fault(expected, "order the points, or flatten what softens");
            return None;
        }
        (hardening.strain[i], hardening.stress[i]) = (strain, stress);
    }
    Some(hardening)
}

/// The failure laws by the word a deck writes.
const FAILURES: [&str; 5] =
    ["plastic-strain", "principal-stress", "hydrostatic", "cockcroft-latham", "johnson-cook"];

/// Reads a failure law under `value`, which is to fit `strength` where that is known.
fn read_failure(value: Value<'_>, table: Table<'_>, strength: Option<&Strength>) -> Option<Failure> {
    let words = FAILURES.join(", ");
    let kind = table.require("type", &format!("one of {words}"))?.one_of(&FAILURES)?;
    let by_slip = ["plastic-strain", "cockcroft-latham", "johnson-cook"].contains(&FAILURES[kind]);
    if by_slip && matches!(strength, Some(Strength::Hydro | Strength::Elastic { .. })) {
        value.fault("a strength that yields beside it", "choose another failure or strength");
    }
    let failure = match FAILURES[kind] {
        "plastic-strain" => {
            table.number("limit", Range::Positive).map(|limit| Failure::PlasticStrain { limit })
        }
        "principal-stress" => {
            table.number("tension", Range::Positive).map(|tension| Failure::PrincipalStress { tension })
        }
        "cockcroft-latham" => {
            table.number("work", Range::Positive).map(|work| Failure::CockcroftLatham { work })
        }
        "hydrostatic" => {
            let heals = table.get("heals").map_or(Some(false), |v| v.boolean());
            table
                .number("tension", Range::Positive)
                .zip(heals)
                .map(|(tension, heals)| Failure::Hydrostatic { tension, heals })
        }
        _ => {
            let d1 = table.number("d1", Range::Any);
            let [d2, d3, d4, d5] = ["d2", "d3", "d4", "d5"].map(|key| table.number_or(key, 0.0, Range::Any));
            if (d4 != 0.0 || d5 != 0.0)
                && strength.is_some_and(|s| !matches!(s, Strength::JohnsonCook { .. }))
            {
                value.fault(
                    "a johnson-cook strength beside d4 and d5, whose rate0, t_room and t_melt they share",
                    "leave d4 and d5 out, or choose another strength",
                );
            }
            d1.map(|d1| Failure::JohnsonCook { d: [d1, d2, d3, d4, d5] })
        }
    };
    table.finish();
    failure
}

/// What a Johnson-Cook material takes its temperature from.
pub(crate) const HEATS: [(&str, Heat); 2] =
    [("plastic-work", Heat::PlasticWork), ("internal-energy", Heat::InternalEnergy)];

fn read_johnson_cook(table: &Table<'_>) -> Option<Strength> {
    let shear = table.number("shear", Range::Positive);
    let a = table.number("a", Range::Positive);
    let b = table.number("b", Range::NotNegative);
    let n = table.number("n", Range::Positive);
    let c = table.number("c", Range::NotNegative);
    let m = table.number("m", Range::Positive);
    let t_melt = table.number("t_melt", Range::Positive);
    let t_room = table.number("t_room", Range::Positive);
    let specific_heat = table.number("specific_heat", Range::Positive);
    let rate0 = table.number("rate0", Range::Positive);
    let heat = match table.get("temperature") {
        Some(value) => HEATS[value.one_of(&HEATS.map(|(word, _)| word))?].1,
        None => Heat::PlasticWork,
    };
    let (t_melt, t_room) = (t_melt?, t_room?);
    if t_melt <= t_room {
        table.faults.add(
            table.at,
            format!("t_melt = {t_melt} K and t_room = {t_room} K"),
            "a melting temperature above room temperature",
            "change t_melt or t_room",
        );
        return None;
    }
    Some(Strength::JohnsonCook {
        shear: shear?,
        a: a?,
        b: b?,
        n: n?,
        c: c?,
        m: m?,
        t_melt,
        t_room,
        specific_heat: specific_heat?,
        rate0: rate0?,
        heat,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_holds_forty_three_sets_each_with_a_source() {
        assert_eq!(names().len(), 43);
        for name in names() {
            assert!(source(name).is_some_and(|s| s.len() > 20), "{name}");
        }
    }

    #[test]
    fn shear_and_bulk_of_every_isotropic_solid_give_a_poisson_ratio_between_0_14_and_0_5() {
        let isotropic = |m: &Material| m.shear() > 0.0 && m.strength.layers().is_none();
        let solids = names().into_iter().filter(|n| find(n).is_some_and(isotropic));
        assert_eq!(solids.clone().count(), 33);
        for name in solids {
            let material = find(name).expect("a name of the list");
            let (k, g) = (material.bulk(), material.shear());
            let poisson = (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g));
            assert!((0.14..0.5).contains(&poisson), "{name}: {poisson}");
        }
    }

    #[test]
    fn fluids_of_the_library_have_the_pressures_they_are_known_for() {
        let of = |name: &str| find(name).expect("a name of the list");
        assert!((of("AIR").initial_pressure() / 101.33e3 - 1.0).abs() < 1e-3);
        assert!((of("WATER").bulk() / 2.195e9 - 1.0).abs() < 1e-3);
        assert_eq!(of("WATER").failure, Failure::Hydrostatic { tension: 1e5, heals: true });
        let explosives = names().into_iter().filter_map(|name| find(name)?.detonation_speed());
        assert_eq!(explosives.collect::<Vec<_>>(), [8193.0, 7980.0, 7530.0, 8300.0, 6930.0, 6930.0]);
        assert_eq!(names().into_iter().filter(|name| fracture(name).is_some()).count(), 10);
        let steel = Failure::JohnsonCook { d: [0.05, 3.44, -2.12, 0.002, 0.61] };
        assert_eq!(fracture("STEEL_4340"), Some(steel));
    }
}
