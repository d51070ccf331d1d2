//! `[[joint]]`.

use mechanics::joint::Kind;

use super::entry::{direction, text};
use crate::{
    limits::MAX_ENTRIES,
    place::Placed,
    table::{Table, Value},
    typed::condition::Joint,
};

/// Kinds by the names that decks give them.
pub(crate) const KINDS: [(&str, Kind); 7] = [
    ("spherical", Kind::Spherical),
    ("universal", Kind::Universal),
    ("revolute", Kind::Revolute),
    ("cylindrical", Kind::Cylindrical),
    ("translational", Kind::Translational),
    ("planar", Kind::Planar),
    ("fixed", Kind::Fixed),
];

/// Reads every `[[joint]]`.
pub(super) fn read(deck: &Table<'_>) -> Vec<Joint> {
    deck.tables("joint", MAX_ENTRIES).into_iter().filter_map(read_joint).collect()
}

fn read_joint(table: Table<'_>) -> Option<Joint> {
    let names = KINDS.map(|(name, _)| name);
    let kind = table
        .require("type", "one of spherical, universal, revolute, cylindrical, translational, planar, fixed")
        .and_then(|v| v.one_of(&names));
    // Which keys belong depends on the type, so without one none is called unknown.
    let kind = KINDS[kind?].1;
    let name = table.get("name").and_then(|v| v.name().map(|name| v.placed(name)));
    let bodies =
        table.require("bodies", "one or two names of rigid bodies or of their parts").and_then(bodies);
    let point = table.vector("point");
    let axis = match kind {
        Kind::Spherical | Kind::Fixed => None,
        _ => direction(&table, "axis"),
    };
    let second_axis = match kind {
        Kind::Universal => direction(&table, "second_axis"),
        _ => None,
    };
    let (at, title) = (table.place(), table.title.clone());
    table.finish();
    Some(Joint { at, title, name, kind, bodies, point, axis, second_axis })
}

fn bodies(value: Value<'_>) -> Option<Vec<Placed<String>>> {
    let items = value.items()?;
    if !matches!(items.len(), 1 | 2) {
        value.fault(
            "two rigid bodies, or one that is held to space",
            "write [\"arm\", \"frame\"] or [\"arm\"]",
        );
        return None;
    }
    items.into_iter().map(text).collect()
}
