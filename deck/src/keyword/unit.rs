//! Units of a keyword deck, which does not say them: chosen by `--units`, else guessed from its densities.

use super::{
    material::{Law, MaterialCard},
    problem::UnitsCard,
};
use crate::{log::Log, place::Place};

/// A set by its names, with the size of its density and stress in SI.
struct Set {
    /// The name in a TOML deck.
    name: &'static str,
    /// Other names, as users of keyword decks write them.
    others: [&'static str; 2],
    density: f64,
    stress: f64,
    /// Length, time and mass as `*CONTROL_UNITS` names them.
    words: [&'static [&'static str]; 3],
}

const MILLIMETRE: &[&str] = &["mm"];
const SECOND: &[&str] = &["s", "sec"];

const INCHES: &str = "in-s-lbf";

const SETS: [Set; 5] = [
    Set {
        name: "mm-s-t",
        others: ["mm-s-tonne", "t-mm-s"],
        density: 1e12,
        stress: 1e6,
        words: [MILLIMETRE, SECOND, &["mtrc_ton", "ton", "tonne", "t"]],
    },
    Set {
        name: "mm-ms-kg",
        others: ["kg-mm-ms", "mm-kg-ms"],
        density: 1e9,
        stress: 1e9,
        words: [MILLIMETRE, &["ms"], &["kg"]],
    },
    Set {
        name: "cm-g-us",
        others: ["cm-us-g", "g-cm-us"],
        density: 1e3,
        stress: 1e11,
        words: [&["cm"], &["micro_s", "us"], &["g", "gm"]],
    },
    // The pound of force and the inch: 175.127 kg, 0.0254 m.
    Set {
        name: INCHES,
        others: ["lbf-in-s", "in-lbf-s"],
        density: 1.068_688e7,
        stress: 6894.757,
        words: [&["in"], SECOND, &["slinch"]],
    },
    Set {
        name: "SI",
        others: ["m-s-kg", "kg-m-s"],
        density: 1.0,
        stress: 1.0,
        words: [&["m"], SECOND, &["kg"]],
    },
];

/// Names that `--units` takes.
pub const NAMES: &str = "mm-s-t (mm-s-tonne), mm-ms-kg, cm-g-us (cm-us-g), in-s-lbf, SI (m-s-kg)";

/// Densities (kg/m3) and wave speeds (m/s) that solids and liquids have.
const DENSITIES: std::ops::RangeInclusive<f64> = 20.0..=25_000.0;
const SPEEDS: std::ops::RangeInclusive<f64> = 10.0..=20_000.0;

/// The same of metals.
const METAL_DENSITIES: std::ops::RangeInclusive<f64> = 1_500.0..=20_000.0;
const METAL_SPEEDS: std::ops::RangeInclusive<f64> = 3_000.0..=7_000.0;

impl Set {
    /// Density (kg/m3) and wave speed (m/s) of a material in this set; no speed of a law without a Young's modulus.
    fn in_si(&self, material: &MaterialCard) -> (f64, Option<f64>) {
        let density = material.density * self.density;
        (density, material.elastic.map(|(young, _)| (young * self.stress / density).sqrt()))
    }

    /// Whether there is such a solid or liquid.
    fn has(&self, material: &MaterialCard) -> bool {
        let (density, speed) = self.in_si(material);
        DENSITIES.contains(&density) && speed.is_none_or(|speed| SPEEDS.contains(&speed))
    }

    /// Whether there is such a metal.
    fn has_metal(&self, material: &MaterialCard) -> bool {
        let (density, speed) = self.in_si(material);
        METAL_DENSITIES.contains(&density) && speed.is_some_and(|speed| METAL_SPEEDS.contains(&speed))
    }
}

/// The set of one of its names, in whatever case.
fn set_of(asked: &str) -> Option<&'static Set> {
    let asked = asked.to_ascii_lowercase();
    SETS.iter().find(|set| set.name.eq_ignore_ascii_case(&asked) || set.others.contains(&asked.as_str()))
}

/// The name in a TOML deck of units that `--units` names; the first set where it names none.
pub(crate) fn name_of(asked: Option<&str>) -> Option<&'static str> {
    asked.map_or(Some(SETS[0].name), |asked| set_of(asked).map(|set| set.name))
}

/// The name of the units in a TOML deck; the first set where nothing tells.
pub(super) fn choose<'m>(
    asked: Option<&str>,
    given: Option<&UnitsCard>,
    materials: impl Iterator<Item = &'m MaterialCard>,
    log: &Log<'_>,
) -> &'static str {
    let start = Place::card(0, 1);
    // Rigid bodies are often given the density that makes up their mass, so they count only where no other material tells.
    let is_rigid = |material: &&MaterialCard| matches!(material.law, Law::Rigid { .. });
    let (rigid, list): (Vec<&MaterialCard>, Vec<&MaterialCard>) = materials.partition(is_rigid);
    let (rigid, list) = if list.is_empty() { (list, rigid) } else { (rigid, list) };
    if let Some(asked) = asked {
        let Some(set) = set_of(asked) else {
            log.fault(
                start,
                format!("--units {}", log.quote(asked)),
                format!("one of {NAMES}"),
                "choose one of them",
            );
            return SETS[0].name;
        };
        doubt(set, "--units", &list, log);
        return set.name;
    }
    if let Some(given) = given {
        let named = |set: &&Set| (0..3).all(|i| set.words[i].contains(&given.words[i].as_str()));
        match SETS.iter().find(named) {
            Some(set) => {
                doubt(set, "*CONTROL_UNITS", &list, log);
                return set.name;
            }
            None => log.warn(
                given.at,
                format!("*CONTROL_UNITS of {}: results know {NAMES}; give --units", given.words.join(", ")),
            ),
        }
    }
    // Foam in inches could be steel in metric units, and the other way round, so a metal weighs more than a foam; metric units
    // come first where nothing else tells.
    let rank = |set: &Set| {
        let metals = list.iter().chain(&rigid).filter(|material| set.has_metal(material)).count();
        let [own, others] = [&list, &rigid].map(|list| list.iter().filter(|m| set.has(m)).count());
        (own, metals, others, set.name != INCHES)
    };
    let best = SETS.iter().map(rank).max().unwrap_or_default();
    let mut fits = SETS.iter().filter(|set| rank(set) == best);
    let set = fits.next().unwrap_or(&SETS[0]);
    if best.0 == 0 && !list.is_empty() {
        log.warn(
            start,
            format!("densities and moduli fit no set of units, {} is assumed; give --units", SETS[0].name),
        );
        return SETS[0].name;
    }
    if list.is_empty() || fits.next().is_some() {
        log.warn(
            start,
            format!("the units cannot be told from the densities, {} is assumed; give --units", set.name),
        );
    } else {
        doubt(set, "the density, or give --units", &list, log);
    }
    set.name
}

/// Warns of densities and moduli that nothing has in these units, which `by` named.
fn doubt(set: &Set, by: &str, materials: &[&MaterialCard], log: &Log<'_>) {
    for material in materials.iter().filter(|material| !set.has(material)) {
        let modulus =
            material.elastic.map_or(String::new(), |(young, _)| format!(" and Young's modulus {young}"));
        log.warn(
            material.at,
            format!(
                "density {}{modulus} are those of no solid or liquid in {}; check {by}",
                material.density, set.name
            ),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keyword::erosion::Limits;

    fn material(density: f64, young: f64, law: Law) -> MaterialCard {
        let (at, elastic, erosion) = (Place::card(0, 1), Some((young, 0.3)), Limits::default());
        MaterialCard { at, density, elastic, law, erosion, fibres: None }
    }

    fn rigid(density: f64, young: f64) -> MaterialCard {
        material(density, young, Law::Rigid { held: [[false; 3]; 2] })
    }

    /// The units of some materials, and how many messages there are.
    fn of_several(asked: Option<&str>, materials: &[MaterialCard]) -> (&'static str, usize) {
        let log = Log::keyword(&[("a.k", "")]);
        let name = choose(asked, None, materials.iter(), &log);
        let (faults, warnings) = log.into_lists();
        (name, faults.len() + warnings.len())
    }

    fn chosen(asked: Option<&str>, density: f64, young: f64) -> (&'static str, usize) {
        of_several(asked, &[material(density, young, Law::Elastic)])
    }

    /// Density and Young's modulus in SI of a material in a set.
    fn in_set(set: &Set, density: f64, young: f64) -> (f64, f64) {
        (density / set.density, young / set.stress)
    }

    #[test]
    fn every_set_is_told_by_a_metal_beside_whatever_else_a_deck_has() {
        let metals = [(7850.0, 210e9), (2700.0, 70e9), (4430.0, 114e9), (8960.0, 120e9), (17_000.0, 340e9)];
        let others = [(1200.0, 3e6), (60.0, 5e6), (2400.0, 30e9), (1000.0, 2.2e9), (300.0, 1e8)];
        for set in &SETS {
            for (density, young) in metals {
                let (density, young) = in_set(set, density, young);
                assert_eq!(chosen(None, density, young), (set.name, 0), "{density} {young}");
                for other in others {
                    let (rho, e) = in_set(set, other.0, other.1);
                    let of_metal = |law| material(density, young, law);
                    let both = [of_metal(Law::Elastic), material(rho, e, Law::Elastic)];
                    assert_eq!(of_several(None, &both), (set.name, 0), "{density} {young}, {rho} {e}");
                    // A punch, and what it crushes.
                    let punch = [rigid(density, young), material(rho, e, Law::Elastic)];
                    assert_eq!(of_several(None, &punch), (set.name, 0), "rigid {density} {young}, {rho} {e}");
                }
                // Densities of rigid bodies make up their mass.
                for wrong in [0.01, 20.0, 300.0] {
                    let punch = [material(density, young, Law::Elastic), rigid(wrong * density, young)];
                    assert_eq!(of_several(None, &punch), (set.name, 0), "{density} {young}, {wrong} times");
                }
            }
        }
        let odd = [
            material(7.33e-4, 30e6, Law::Elastic),
            material(7.33e-4, 29e6, Law::Elastic),
            material(50.0, 30e6, Law::Elastic),
        ];
        assert_eq!(of_several(None, &odd), (INCHES, 1), "one of three fits nothing");
    }

    #[test]
    fn units_are_told_by_steel_and_doubted_where_steel_would_be_foam() {
        assert_eq!(chosen(None, 7.85e-9, 210e3), ("mm-s-t", 0));
        assert_eq!(chosen(None, 7.85e-6, 210.0), ("mm-ms-kg", 0));
        assert_eq!(chosen(None, 7.85, 2.1), ("cm-g-us", 0));
        assert_eq!(chosen(None, 7850.0, 210e9), ("SI", 0));
        assert_eq!(chosen(None, 7.33e-4, 30e6), ("in-s-lbf", 0));
        assert_eq!(chosen(Some("mm-s-tonne"), 7.85e-9, 210e3), ("mm-s-t", 0));
        assert_eq!(chosen(Some("m-s-kg"), 7.85e-9, 210e3), ("SI", 1));
        assert_eq!(chosen(Some("furlong"), 7.85e-9, 210e3).1, 1);
        assert_eq!(chosen(None, 1.0, 1e30).1, 1);
    }
}
