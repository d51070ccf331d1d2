use super::*;
use crate::{library::names, units::SETS};

#[test]
fn every_constant_of_the_library_has_a_meaning_and_a_unit_that_converts_it() {
    let si = Units::named("SI").expect("a set of units");
    let own = Units::named("mm-ms-kg").expect("a set of units");
    let mut seen = 0;
    for name in names() {
        let material = find(name).expect("a name of the list");
        let [in_si, here] = [si, own].map(|units| card(name, &units).expect("a name of the list"));
        let written = [
            of_eos(material.eos).constants.len(),
            of_strength(&material.strength).constants.len(),
            of_failure(material.failure).map_or(0, |law| law.constants.len()),
        ];
        let laws = |card: &Card| {
            let fracture = card.fracture.iter().flat_map(|law| law.constants.clone());
            let failure = card.failure.iter().flat_map(|law| law.constants.clone());
            let all = [&card.eos, &card.strength].into_iter().flat_map(|law| law.constants.clone());
            all.chain(failure).chain(fracture).chain([card.density.clone()]).collect::<Vec<_>>()
        };
        let of_fracture = in_si.fracture.as_ref().map_or(0, |law| law.constants.len());
        let (in_si, here) = (laws(&in_si), laws(&here));
        assert_eq!(in_si.len(), written.iter().sum::<usize>() + of_fracture + 1, "{name}");
        for (si, own) in in_si.iter().zip(&here) {
            // The unit that is printed is the one that the value was converted to.
            let factor = match (si.unit.as_str(), own.unit.as_str()) {
                ("Pa", "GPa") => 1e-9,
                ("kg/m3", "kg/mm3") => 1e-9,
                ("1/s", "1/ms") => 1e-3,
                ("1/Pa", "1/GPa") => 1e9,
                ("m/s", "m/s")
                | ("K", "K")
                | ("1/K", "1/K")
                | ("J/kg/K", "J/kg/K")
                | ("J/kg", "J/kg")
                | ("", "") => 1.0,
                other => panic!("{name}: {} in {other:?}", si.key),
            };
            assert!((own.value - si.value * factor).abs() <= 1e-12 * own.value.abs(), "{name}: {}", si.key);
            seen += 1;
        }
    }
    assert!(seen > 400, "{seen} constants");
}

#[test]
fn a_block_that_is_pasted_into_a_deck_makes_the_same_material() {
    for units in SETS.iter().filter(|set| set.takes_materials) {
        for name in names() {
            let card = card(name, units).expect("a name of the list");
            let solids = "box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }";
            let shells = "shell = { thickness = 1 }\nplate = { origin = [0, 0, 0], side_i = [1, 0, 0], side_j = [0, 1, 0], cells = [1, 1] }";
            let shape = if card.strength.kind == "chang-chang" { shells } else { solids };
            let detonation = if card.eos.kind == "jwl" { "[[detonation]]\npoint = [0, 0, 0]" } else { "" };
            let deck = |blocks: &str, name: &str| {
                let text = format!(
                    "title = \"a\"\nunits = \"{}\"\n[control]\nend_cycle = 1\n{blocks}\n[[part]]\nname = \"a\"\n{shape}\nmaterial = \"{name}\"\n{detonation}\n",
                    units.name
                );
                crate::read(&text, "pasted.toml").unwrap_or_else(|faults| panic!("{faults:?}\n{text}"))
            };
            let own = format!("my {name}");
            let (pasted, of_library) = (deck(&card.toml, &own), deck("", name));
            let [pasted, of_library] = [pasted, of_library].map(|model| model.setup.materials);
            let renamed = Material { name: own, ..of_library[0].clone() };
            assert_eq!(pasted, [renamed], "{} in {}", name, units.name);
        }
    }
}

#[test]
fn near_names_hold_the_pieces_or_are_spelt_alike() {
    assert_eq!(near("4340"), ["STEEL_4340"]);
    assert_eq!(near("steel"), ["MILD_STEEL", "STEEL_1006", "STEEL_4340", "STEEL_S7_TOOL"]);
    assert_eq!(near("6061-t6"), ["AL_6061_T6", "AL_6061_T6_SG"]);
    assert_eq!(near("TUNGSTEN_ALLOI"), ["TUNGSTEN_ALLOY"]);
    assert!(near("banana").is_empty());
    assert!(near("--").is_empty());
}
