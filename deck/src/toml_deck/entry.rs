//! What several tables have: parts by name, numbers that may follow a curve, nodes and faces.

use mechanics::load::Span;

use crate::{
    geometry::norm,
    place::Placed,
    table::{Range, Table, Value},
    typed::condition::{Circle, Components, Drive, Faces, Parts, Region},
};

pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

pub(super) fn text(value: Value<'_>) -> Option<Placed<String>> {
    value.text().map(|text| value.placed(text.to_string()))
}

/// The parts of `"all"` or of a list of names.
pub(super) fn parts(value: Value<'_>) -> Parts {
    if value.is_text() {
        if value.text() == Some("all") {
            return Parts::All;
        }
        value.fault("\"all\" or a list of part names", "write [\"name\", ...]");
        return Parts::Broken;
    }
    let Some(items) = value.items() else { return Parts::Broken };
    if items.is_empty() {
        value.fault("at least one part", "name a part or remove the key");
        return Parts::Broken;
    }
    let names: Option<Vec<Placed<String>>> = items.into_iter().map(text).collect();
    names.map_or(Parts::Broken, Parts::Named)
}

/// The parts under `parts` of a table; all where it is absent.
pub(super) fn parts_of(table: &Table<'_>) -> Parts {
    table.get("parts").map_or(Parts::All, parts)
}

/// When something acts: `from` and `until` of its table.
pub(super) fn span(table: &Table<'_>) -> Span {
    let from = table.number_or("from", 0.0, Range::NotNegative);
    let Some(value) = table.get("until") else { return Span { from, ..Span::ALWAYS } };
    let until = value.number(Range::Positive).unwrap_or(Span::ALWAYS.until);
    if until <= from {
        value.fault(&format!("a time after {from}, from which it acts"), "end it later, or remove the entry");
        return Span::ALWAYS;
    }
    Span { from, until }
}

/// A number, `{ curve = "name", factor = 2.0 }` or `{ value = 3.0 }`; of the last two `from` and `until` say when they act.
pub(super) fn drive(value: Value<'_>) -> Option<Drive> {
    if !value.is_table() {
        return value.number(Range::Any).map(Drive::constant);
    }
    let table = value.table("a value by curve".to_string())?.shared("drive");
    let constant = table.get("value").map(|v| v.number(Range::Any));
    let (factor, curve) = match constant {
        Some(value) => (value, None),
        None => {
            let curve = table.require("curve", "the name of a [[curve]]").and_then(text);
            (Some(table.number_or("factor", 1.0, Range::Any)), Some(curve))
        }
    };
    let span = span(&table);
    table.finish();
    let curve = match curve {
        Some(name) => Some(name?),
        None => None,
    };
    Some(Drive { factor: factor?, curve, span })
}

/// `velocity = { x = 1.0, z = { curve = "name" } }` or the like of another key: the axes not named stay free.
pub(super) fn components(table: &Table<'_>, key: &'static str) -> Option<Components> {
    let value = table.require(key, "a table of components such as { x = 1.0 }")?;
    let given = value.table(format!("{key} of {}", table.title))?;
    let mut list = [const { None }; 3];
    let mut faulty = false;
    for (component, name) in list.iter_mut().zip(AXES) {
        if let Some(value) = given.get(name) {
            *component = drive(value);
            faulty |= component.is_none();
        }
    }
    given.finish();
    if !faulty && list.iter().all(Option::is_none) {
        value.fault("at least one of x, y, z", "name the component that is prescribed");
        return None;
    }
    (!faulty).then_some(list)
}

/// `axis`, `point` and `rate` of a turn.
pub(super) fn circle(table: &Table<'_>) -> Option<Circle> {
    let axis = table.require("axis", "one of x, y, z").and_then(|v| v.one_of(&AXES));
    let point = table.vector("point");
    let rate = table.require("rate", "radians per time, a number or by curve").and_then(drive);
    Some(Circle { axis: axis?, point: point?, rate: rate? })
}

/// A direction of any length above 0.
pub(super) fn direction(table: &Table<'_>, key: &'static str) -> Option<[f64; 3]> {
    let value = table.require(key, "[x, y, z]")?;
    let normal = value.vector()?;
    let long = norm(normal);
    if long > 0.0 && long.is_finite() {
        return Some(normal);
    }
    value.fault(
        &format!("{} {key} of some length", if key == "axis" { "an" } else { "a" }),
        "give a direction such as [0, 0, 1]",
    );
    None
}

/// The name of a face, or a list of such names.
pub(super) fn face_names(value: Value<'_>) -> Option<Vec<Placed<String>>> {
    if value.is_text() {
        return text(value).map(|name| vec![name]);
    }
    let names: Option<Vec<Placed<String>>> = value.items()?.into_iter().map(text).collect();
    let names = names?;
    if names.is_empty() {
        value.fault("at least one face", "name a face or remove the key");
        return None;
    }
    Some(names)
}

/// The name of a set of nodes, or a list of numbers.
pub(super) fn nodes(value: Value<'_>) -> Option<Region> {
    if value.is_text() {
        return text(value).map(Region::Set);
    }
    let number = |item: Value<'_>| item.integer(1, u64::from(u32::MAX)).map(|id| item.placed(id as u32));
    Some(Region::Numbers(value.items()?.into_iter().filter_map(number).collect()))
}

/// The nodes of an entry: all of its parts, or those of one face, box, plane or list.
pub(super) fn region(table: &Table<'_>) -> Option<Region> {
    const WAYS: [&str; 4] = ["face", "box", "plane", "nodes"];
    let given: Vec<(&str, Value<'_>)> = WAYS.iter().filter_map(|w| table.get(w).map(|v| (*w, v))).collect();
    match given[..] {
        [] => Some(Region::All),
        [("face", value)] => face_names(value).map(Region::Faces),
        [("box", value)] => {
            let corners = value.table(format!("box of {}", table.title))?;
            let (low, high) = (corners.vector("min"), corners.vector("max"));
            corners.finish();
            Some(Region::Box { low: low?, high: high? })
        }
        [("plane", value)] => {
            let plane = value.table(format!("plane of {}", table.title))?;
            let (point, normal) = (plane.vector("point"), direction(&plane, "normal"));
            plane.finish();
            Some(Region::Plane { point: point?, normal: normal? })
        }
        [("nodes", value)] => nodes(value),
        _ => {
            let words: Vec<&str> = given.iter().map(|(way, _)| *way).collect();
            given[1].1.faults.add(
                given[1].1.at,
                words.join(" and "),
                "one of face, box, plane, nodes",
                "write one [[boundary]] for each",
            );
            None
        }
    }
}

/// The faces of an entry: segments of a mesh, or outer faces by their nodes.
pub(super) fn faces(table: &Table<'_>) -> Option<Faces> {
    match table.get("segments") {
        Some(value) => text(value).map(Faces::Segments),
        None => region(table).map(Faces::Of),
    }
}
