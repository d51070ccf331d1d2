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
    let list: Vec<&MaterialCard> = materials.collect();
    // Rigid bodies are often given the density that makes up their mass.
    let is_rigid = |material: &&MaterialCard| matches!(material.law, Law::Rigid { .. });
    let list: Vec<&MaterialCard> = match list.iter().all(is_rigid) {
        true => list,
        false => list.into_iter().filter(|material| !is_rigid(material)).collect(),
    };
    let plausible = |set: &Set, material: &MaterialCard| {
        let density = material.density * set.density;
        let speed = material.elastic.map(|(young, _)| (young * set.stress / density).sqrt());
        DENSITIES.contains(&density) && speed.is_none_or(|speed| SPEEDS.contains(&speed))
    };
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
        doubt(set, "--units", &list, &plausible, log);
        return set.name;
    }
    if let Some(given) = given {
        let named = |set: &&Set| (0..3).all(|i| set.words[i].contains(&given.words[i].as_str()));
        match SETS.iter().find(named) {
            Some(set) => {
                doubt(set, "*CONTROL_UNITS", &list, &plausible, log);
                return set.name;
            }
            None => log.warn(
                given.at,
                format!("*CONTROL_UNITS of {}: results know {NAMES}; give --units", given.words.join(", ")),
            ),
        }
    }
    // Foam in metric units could be steel in inches: those count only where no metric set fits.
    let fit = |metric: bool| -> Vec<&Set> {
        let kind = SETS.iter().filter(|set| (set.name != INCHES) == metric);
        kind.filter(|set| list.iter().all(|material| plausible(set, material))).collect()
    };
    let mut fits = fit(true);
    if fits.is_empty() {
        fits = fit(false);
    }
    match fits[..] {
        [set] if !list.is_empty() => set.name,
        [set, ..] => {
            log.warn(
                start,
                format!("the units cannot be told from the densities, {} is assumed; give --units", set.name),
            );
            set.name
        }
        [] => {
            log.warn(
                start,
                format!(
                    "densities and moduli fit no set of units, {} is assumed; give --units",
                    SETS[0].name
                ),
            );
            SETS[0].name
        }
    }
}

/// Warns of densities and moduli that nothing has in these units, which `by` named.
fn doubt(
    set: &Set,
    by: &str,
    materials: &[&MaterialCard],
    plausible: &impl Fn(&Set, &MaterialCard) -> bool,
    log: &Log<'_>,
) {
    for material in materials.iter().filter(|material| !plausible(set, material)) {
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

    fn chosen(asked: Option<&str>, density: f64, young: f64) -> (&'static str, usize) {
        let log = Log::keyword(&[("a.k", "")]);
        let steel = MaterialCard {
            at: Place::card(0, 1),
            density,
            elastic: Some((young, 0.3)),
            law: Law::Elastic,
            erosion: Limits::default(),
            fibres: None,
        };
        let name = choose(asked, None, std::iter::once(&steel), &log);
        let (faults, warnings) = log.into_lists();
        (name, faults.len() + warnings.len())
    }

    #[test]
    fn units_are_told_by_steel_and_doubted_where_steel_would_be_foam() {
        assert_eq!(chosen(None, 7.85e-9, 210e3), ("mm-s-t", 0));
        assert_eq!(chosen(None, 7.85e-6, 210.0), ("mm-ms-kg", 0));
        assert_eq!(chosen(None, 7.85, 2.1), ("cm-g-us", 0));
        assert_eq!(chosen(None, 7850.0, 210e9), ("SI", 0));
        assert_eq!(chosen(None, 7.34e-4, 30e6), ("in-s-lbf", 0));
        assert_eq!(chosen(Some("mm-s-tonne"), 7.85e-9, 210e3), ("mm-s-t", 0));
        assert_eq!(chosen(Some("m-s-kg"), 7.85e-9, 210e3), ("SI", 1));
        assert_eq!(chosen(Some("furlong"), 7.85e-9, 210e3).1, 1);
        assert_eq!(chosen(None, 1.0, 1e30).1, 1);
    }
}
