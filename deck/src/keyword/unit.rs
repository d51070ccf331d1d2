//! Units of a keyword deck, which does not say them: chosen by `--units`, else guessed from its densities.

use super::{
    log::{Log, Place},
    material::MaterialCard,
};

/// A set by its names, with the size of its density and stress in SI.
struct Set {
    /// The name in a TOML deck.
    name: &'static str,
    /// Other names, as users of keyword decks write them.
    others: [&'static str; 2],
    density: f64,
    stress: f64,
}

const INCHES: &str = "in-s-lbf";

const SETS: [Set; 5] = [
    Set { name: "mm-s-t", others: ["mm-s-tonne", "t-mm-s"], density: 1e12, stress: 1e6 },
    Set { name: "mm-ms-kg", others: ["kg-mm-ms", "mm-kg-ms"], density: 1e9, stress: 1e9 },
    Set { name: "cm-g-us", others: ["cm-us-g", "g-cm-us"], density: 1e3, stress: 1e11 },
    // The pound of force and the inch: 175.127 kg, 0.0254 m.
    Set { name: INCHES, others: ["lbf-in-s", "in-lbf-s"], density: 1.068_688e7, stress: 6894.757 },
    Set { name: "SI", others: ["m-s-kg", "kg-m-s"], density: 1.0, stress: 1.0 },
];

/// Names that `--units` takes.
pub const NAMES: &str = "mm-s-t (mm-s-tonne), mm-ms-kg, cm-g-us (cm-us-g), in-s-lbf, SI (m-s-kg)";

/// Densities (kg/m3) and wave speeds (m/s) that solids and liquids have.
const DENSITIES: std::ops::RangeInclusive<f64> = 20.0..=25_000.0;
const SPEEDS: std::ops::RangeInclusive<f64> = 10.0..=20_000.0;

/// The name of the units in a TOML deck; the first set where nothing tells.
pub(super) fn choose<'m>(
    asked: Option<&str>,
    materials: impl Iterator<Item = &'m MaterialCard>,
    log: &Log,
) -> &'static str {
    let start = Place { file: 0, line: 1 };
    let list: Vec<&MaterialCard> = materials.collect();
    let plausible = |set: &Set, material: &MaterialCard| {
        let density = material.density * set.density;
        let speed = material.elastic.map(|(young, _)| (young * set.stress / density).sqrt());
        DENSITIES.contains(&density) && speed.is_none_or(|speed| SPEEDS.contains(&speed))
    };
    if let Some(asked) = asked {
        let asked = asked.to_ascii_lowercase();
        let named =
            |set: &&Set| set.name.eq_ignore_ascii_case(&asked) || set.others.contains(&asked.as_str());
        let Some(set) = SETS.iter().find(named) else {
            log.fault(
                start,
                format!("--units {}", log.quote(&asked)),
                format!("one of {NAMES}"),
                "choose one of them",
            );
            return SETS[0].name;
        };
        for material in list.iter().filter(|material| !plausible(set, material)) {
            let modulus =
                material.elastic.map_or(String::new(), |(young, _)| format!(" and Young's modulus {young}"));
            log.warn(
                material.at,
                format!(
                    "density {}{modulus} are those of no solid or liquid in {}; check --units",
                    material.density, set.name
                ),
            );
        }
        return set.name;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keyword::{erosion::Limits, material::Law};

    fn chosen(asked: Option<&str>, density: f64, young: f64) -> (&'static str, usize) {
        let log = Log::new(vec!["a.k".to_string()]);
        let steel = MaterialCard {
            at: Place::default(),
            density,
            elastic: Some((young, 0.3)),
            law: Law::Elastic,
            erosion: Limits::default(),
        };
        let name = choose(asked, std::iter::once(&steel), &log);
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
