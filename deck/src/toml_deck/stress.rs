//! `[[initial_stress]]`: what elements have at the start.

use mechanics::initial::{PointStress, Points};

use super::entry::parts_of;
use crate::{
    limits::{MAX_ID, MAX_STRESSES},
    place::Placed,
    table::{Range, Table, Value},
    typed::stress::Stress,
};

/// Reads every `[[initial_stress]]`.
pub(super) fn read(deck: &Table<'_>) -> Vec<Stress> {
    let entry = |table: Table<'_>| {
        let parts = parts_of(&table);
        let elements = table.get("elements").map(|value| elements(value).unwrap_or_default());
        let points = match (table.get("layers"), table.get("points")) {
            (Some(_), Some(value)) => {
                value.fault("layers of shells or points of solids", "remove one of them");
                None
            }
            (Some(value), None) => layers(value),
            (None, Some(value)) => list(value, "a point of points", &point).map(Points::Each),
            (None, None) => point(&table).map(Points::Same),
        };
        let (at, title) = (table.place(), table.title.clone());
        table.finish();
        Stress { at, title, parts, elements, points }
    };
    deck.tables("initial_stress", MAX_STRESSES).into_iter().map(entry).collect()
}

/// Numbers of elements.
fn elements(value: Value<'_>) -> Option<Vec<Placed<u32>>> {
    let items = value.items()?;
    if items.is_empty() {
        value.fault("at least one element", "name an element or remove the key");
    }
    let number = |item: Value<'_>| item.integer(1, u64::from(MAX_ID)).map(|id| item.placed(id as u32));
    items.into_iter().map(number).collect()
}

/// `stress` and `plastic_strain` of a table, of which one at least is given.
fn point(table: &Table<'_>) -> Option<PointStress> {
    let expected = "[xx, yy, zz, xy, yz, zx]";
    let plastic_strain = table.get("plastic_strain").map_or(Some(0.0), |v| v.number(Range::NotNegative));
    let given = match table.has("plastic_strain") {
        true => table.get("stress"),
        false => Some(table.require("stress", expected)?),
    };
    let stress = given.map_or(Some([0.0; 6]), |value| value.numbers::<6>(expected, Range::Any));
    Some(PointStress { stress: stress?, plastic_strain: plastic_strain? })
}

/// A list of tables, one at least.
fn list<T>(value: Value<'_>, what: &str, read: &impl Fn(&Table<'_>) -> Option<T>) -> Option<Vec<T>> {
    let items = value.items()?;
    if items.is_empty() {
        value.fault("at least one table { stress = [...] }", "add one or remove the key");
        return None;
    }
    let of = |item: Value<'_>| {
        let table = item.table(what.to_string())?;
        let read = read(&table);
        table.finish();
        read
    };
    let read: Vec<Option<T>> = items.into_iter().map(of).collect();
    read.into_iter().collect()
}

/// Layers of a shell by ascending height.
fn layers(value: Value<'_>) -> Option<Points> {
    let layer = |table: &Table<'_>| {
        let height = table.require("height", "a number from -1 to 1").and_then(|given| {
            let height = given.number(Range::Any)?;
            if !(-1.0..=1.0).contains(&height) {
                given.fault("a number from -1, below, to 1, above", "give it over half the thickness");
                return None;
            }
            Some(height)
        });
        let point = point(table);
        Some((height?, point?))
    };
    let layers = list(value, "a layer of layers", &layer)?;
    if layers.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
        value.fault("layers by ascending height", "put them in order, each once");
        return None;
    }
    Some(Points::Layers(layers))
}
