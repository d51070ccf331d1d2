//! MATERIALS: `bolide materials`, the library as a list, and one of its materials with constants, source and a block to paste.

use std::process::ExitCode;

use deck::{
    library::card::{Card, Constant, Law, card, near},
    units::Units,
};

use crate::{command::MaterialsArgs, shell::print};

/// Prints the library, or one material of it.
///
/// # Errors
/// A name that the library does not have.
pub fn run(args: &MaterialsArgs) -> Result<ExitCode, String> {
    let units = Units::named(&args.units).ok_or_else(|| format!("{}: no set of units", args.units))?;
    let of = |name: &str| card(name, &units);
    let text = match &args.name {
        Some(name) => {
            let card = of(name).ok_or_else(|| unknown(name))?;
            if args.json { json(&card)? } else { words(&card) }
        }
        None => {
            let cards: Vec<Card> = deck::materials().into_iter().filter_map(of).collect();
            if args.json { json(&cards)? } else { list(&cards) }
        }
    };
    print(&text).map(|()| ExitCode::SUCCESS)
}

fn json(of: &impl serde::Serialize) -> Result<String, String> {
    serde_json::to_string_pretty(of).map_err(|e| e.to_string())
}

/// The error of a name that the library does not have.
fn unknown(name: &str) -> String {
    let advice = match &near(name)[..] {
        [] => "`bolide materials` lists the library; a deck may have a [[material]] of its own".to_owned(),
        near => format!("near names: {}", near.join(", ")),
    };
    format!("read the material \"{name}\"; expected a name of the library; {advice}")
}

/// A line for each material, at most 80 columns wide.
fn list(cards: &[Card]) -> String {
    let density = cards.first().map_or("", |card| &card.density.unit);
    let mut text = format!(
        "{:23} {:>9}  {:10} {:22} {}\n",
        "material",
        format!("rho {density}"),
        "eos",
        "strength",
        "failure"
    );
    for Card { name, density, eos, strength, failure, fracture, .. } in cards {
        let failure = match (failure, fracture) {
            (Some(law), _) => law.kind.clone(),
            (None, Some(_)) => "(fracture)".to_owned(),
            (None, None) => String::new(),
        };
        let line = format!(
            "{name:23} {:>9}  {:10} {:22} {failure}",
            deck::fault::short(density.value),
            eos.kind,
            strength.kind
        );
        text += line.trim_end();
        text.push('\n');
    }
    text + "\n(fracture): a failure law for parts with fracture = true.\n`bolide materials NAME` prints constants, source and a block for a deck."
}

/// A material as a table, and as a block of a deck.
fn words(card: &Card) -> String {
    let mut rows = vec![("", card.density.clone())];
    let mut text = format!("{}, in {}\n\n", card.name, card.units);
    let laws = [
        ("equation of state", Some(&card.eos)),
        ("strength", Some(&card.strength)),
        ("failure", card.failure.as_ref()),
        ("failure with fracture = true", card.fracture.as_ref()),
    ];
    for (what, law) in laws.iter().filter_map(|(what, law)| law.map(|law| (*what, law))) {
        text += &format!("{what}: {}\n  {}\n", law.kind, law.formula);
    }
    for (name, law) in [
        ("eos", Some(&card.eos)),
        ("strength", Some(&card.strength)),
        ("failure", card.failure.as_ref()),
        ("fracture", card.fracture.as_ref()),
    ] {
        let constants = law.into_iter().flat_map(|law: &Law| law.constants.iter().cloned());
        rows.extend(constants.map(|constant| (name, constant)));
    }
    let width = |of: &dyn Fn(&(&str, Constant)) -> usize| rows.iter().map(of).max().unwrap_or(0);
    let (keys, units) = (width(&|(law, c)| law.len() + 1 + c.key.len()), width(&|(_, c)| c.unit.len()));
    text.push('\n');
    for (law, Constant { key, value, unit, meaning }) in &rows {
        let key = if law.is_empty() { key.clone() } else { format!("{law}.{key}") };
        text += &format!("  {key:keys$}  {:>11}  {unit:units$}  {meaning}\n", deck::fault::short(*value));
    }
    format!("{text}\nsource: {}\n\n{}", card.source, card.toml.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_material_is_printed_with_laws_units_meanings_source_and_block() {
        let si = Units::named("SI").expect("a set of units");
        let text = words(&card("STEEL_4340", &si).expect("a name of the library"));
        for line in [
            "equation of state: shock",
            "  strength.a              7.92e8  Pa      yield stress at the start, at rate0 and t_room",
            "  density                   7830  kg/m3   density at the start",
            "  strength.specific_heat     477  J/kg/K  energy that warms a unit of mass by 1 K",
            "failure with fracture = true: johnson-cook",
            "[[material]]",
            "name = \"my STEEL_4340\"",
        ] {
            let squeezed = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(text.lines().any(|found| squeezed(found) == squeezed(line)), "{line}\n{text}");
        }
        assert!(text.contains("source: Johnson and Cook, 7th Int. Symp."), "{text}");
    }

    #[test]
    fn the_list_has_every_material_and_fits_a_terminal() {
        let si = Units::named("SI").expect("a set of units");
        let cards: Vec<Card> = deck::materials().into_iter().filter_map(|name| card(name, &si)).collect();
        let text = list(&cards);
        for name in deck::materials() {
            assert_eq!(text.lines().filter(|line| line.split(' ').next() == Some(name)).count(), 1, "{name}");
        }
        let widest = text.lines().map(str::len).max();
        assert!(widest <= Some(80), "{widest:?}\n{text}");
    }

    #[test]
    fn an_unknown_material_is_told_with_those_that_are_near() {
        let told = unknown("steel");
        assert!(told.contains("\"steel\"") && told.contains("STEEL_1006, STEEL_4340"), "{told}");
        assert!(unknown("banana").contains("bolide materials"), "{}", unknown("banana"));
    }
}
