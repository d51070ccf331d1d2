//! The material library, and how a material is read: `[[material]]` of a deck and an entry of the library
//! have the same keys.

use std::sync::OnceLock;

use mechanics::material::{Eos, Material, Strength};
use toml::de::DeTable;

use crate::{
    fault::Faults,
    table::{Range, Table},
};

/// The library as it stands in the repository, SI.
const TEXT: &str = include_str!("../materials.toml");

/// A library entry.
struct Entry {
    material: Material,
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
                    if let (Some(material), Some(source)) = (read_material(table, name), source) {
                        entries.push(Entry { material, source: source.to_string() });
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
    let eos = table
        .require("eos", "an equation of state { type = \"linear\" | \"shock\", ... }")
        .and_then(|v| v.table(format!("eos of \"{name}\"")))
        .and_then(read_eos);
    let strength = match table.get("strength") {
        None => Some(Strength::Hydro),
        Some(v) => v.table(format!("strength of \"{name}\"")).and_then(read_strength),
    };
    table.finish();
    Some(Material { name, density: density?, eos: eos?, strength: strength? })
}

fn read_eos(table: Table<'_>) -> Option<Eos> {
    let kind = table.require("type", "one of linear, shock")?.one_of(&["linear", "shock"])?;
    let eos = if kind == 0 {
        table.number("bulk", Range::Positive).map(|bulk| Eos::Linear { bulk })
    } else {
        let c0 = table.number("c0", Range::Positive);
        let s = table.number("s", Range::NotNegative);
        let gamma = table.number("gamma", Range::NotNegative);
        c0.zip(s).zip(gamma).map(|((c0, s), gamma)| Eos::Shock { c0, s, gamma })
    };
    table.finish();
    eos
}

/// The strength laws by the word a deck writes.
const STRENGTHS: [&str; 4] = ["hydro", "elastic", "von-mises", "johnson-cook"];

fn read_strength(table: Table<'_>) -> Option<Strength> {
    let kind = table.require("type", "one of hydro, elastic, von-mises, johnson-cook")?.one_of(&STRENGTHS)?;
    let strength = match STRENGTHS[kind] {
        "hydro" => Some(Strength::Hydro),
        "elastic" => table.number("shear", Range::Positive).map(|shear| Strength::Elastic { shear }),
        "von-mises" => {
            let shear = table.number("shear", Range::Positive);
            let yield_stress = table.number("yield_stress", Range::Positive);
            let hardening = table.number_or("hardening", 0.0, Range::NotNegative);
            shear.zip(yield_stress).map(|(shear, yield_stress)| Strength::VonMises {
                shear,
                yield_stress,
                hardening,
            })
        }
        _ => read_johnson_cook(&table),
    };
    table.finish();
    strength
}

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
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_holds_nineteen_sets_each_with_a_source() {
        assert_eq!(names().len(), 19);
        for name in names() {
            assert!(source(name).is_some_and(|s| s.len() > 20), "{name}");
        }
    }

    #[test]
    fn shear_and_bulk_of_every_set_give_a_poisson_ratio_between_0_2_and_0_5() {
        for name in names() {
            let material = find(name).expect("a name of the list");
            let (k, g) = (material.bulk(), material.shear());
            let poisson = (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g));
            assert!((0.2..0.5).contains(&poisson), "{name}: {poisson}");
        }
    }
}
