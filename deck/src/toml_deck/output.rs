//! `[output]`, `[[section]]` and `[[gauge]]`.

use super::entry::{direction, nodes, parts_of, text};
use crate::{
    limits::{MAX_ENTRIES, MAX_ID, MAX_SECTIONS},
    model::{FIELD_NAMES, FORMAT_NAMES},
    place::Placed,
    table::{Range, Table, Value},
    typed::{Cut, Gauge, Kind, Output, PartPairs, Section, Spot, condition::Region},
};

/// Reads `[output]`.
pub(super) fn read(deck: &Table<'_>) -> Output {
    let mut output = Output::default();
    let Some(table) = deck.get("output").and_then(|v| v.table("[output]".to_string())) else { return output };
    output.period = table.get("period").and_then(|v| v.number(Range::Positive));
    output.history_cycles = table.integer_or("history_cycles", 10, 1, 1_000_000_000) as u32;
    output.snapshot_seconds = table.get("snapshot_seconds").and_then(|v| v.number(Range::Positive));
    output.snapshot_cycles = table.get("snapshot_cycles").and_then(|v| v.integer(1, 1_000_000_000));
    output.fields = read_names(&table, "fields", &FIELD_NAMES);
    output.formats = read_names(&table, "formats", &FORMAT_NAMES);
    let flag = |key: &'static str| table.get(key).and_then(|v| v.boolean());
    output.compress = flag("compress").unwrap_or(true);
    output.workers = flag("workers").unwrap_or(false);
    output.contact_surface = table.get("contact_surface").and_then(|v| v.boolean().map(|on| v.placed(on)));
    output.contact_forces = read_contact_forces(&table);
    table.finish();
    output
}

/// Pairs of parts whose contact force is wanted.
fn read_contact_forces(table: &Table<'_>) -> Option<Placed<PartPairs>> {
    let value = table.get("contact_forces")?;
    let mut pairs = Vec::new();
    for item in value.items().unwrap_or_default() {
        let Some(both) = item.fixed::<2>("two part names") else { continue };
        let [Some(a), Some(b)] = both.map(text) else { continue };
        pairs.push(item.placed([a, b]));
    }
    Some(value.placed(pairs))
}

/// A list of names that are known, each once.
fn read_names(table: &Table<'_>, key: &'static str, known: &[&'static str]) -> Vec<String> {
    let mut names = Vec::new();
    for item in table.get(key).and_then(|v| v.items()).unwrap_or_default() {
        let Some(name) = item.one_of(known).map(|index| known[index]) else { continue };
        if !names.iter().any(|n| n == name) {
            names.push(name.to_string());
        }
    }
    names
}

/// Keys of the elements that a section lists.
const LISTED: [&str; 3] = ["solids", "shells", "trusses"];

/// Reads every `[[section]]`: a plane through parts, or nodes with elements.
pub(super) fn read_sections(deck: &Table<'_>) -> Vec<Section> {
    let section = |table: Table<'_>| {
        let name = table.require("name", "a name in quotes");
        let name = name.and_then(|v| v.name().map(|name| v.placed(name)));
        let cut = if let Some(given) = table.get("nodes") {
            let nodes = nodes(given).unwrap_or(Region::Numbers(Vec::new()));
            let number =
                |item: Value<'_>| item.integer(1, u64::from(MAX_ID)).map(|id| item.placed(id as u32));
            let elements = LISTED.map(|key| {
                let items = table.get(key).and_then(|v| v.items()).unwrap_or_default();
                items.into_iter().filter_map(number).collect()
            });
            Cut::Listed { nodes, elements }
        } else {
            let parts = parts_of(&table);
            let plane = table.require("plane", "{ point = [x, y, z], normal = [x, y, z] }, or nodes");
            let plane = plane.and_then(|v| v.table(format!("plane of {}", table.title))).and_then(|plane| {
                let (point, normal) = (plane.vector("point"), direction(&plane, "normal"));
                plane.finish();
                Some([point?, normal?])
            });
            Cut::Plane { plane, parts, radius: table.get("radius").and_then(|v| v.number(Range::Positive)) }
        };
        let (at, title) = (table.place(), table.title.clone());
        table.finish();
        Section { at, title, name, cut }
    };
    deck.tables("section", MAX_SECTIONS).into_iter().map(section).collect()
}

/// Reads every `[[gauge]]`: at a node or element number, or at the node or element nearest to a point or to the centre of a part.
pub(super) fn read_gauges(deck: &Table<'_>) -> Vec<Gauge> {
    let gauge = |table: Table<'_>| {
        let value = table.require("name", "a name in quotes");
        let name = value.and_then(|v| v.name().map(|name| v.placed(name)));
        let of_element = table.get("of").and_then(|v| v.one_of(&["node", "element"])) == Some(1);
        let part = table.get("part").and_then(text);
        let of = if of_element || table.has("element") { Kind::Element } else { Kind::Node };
        let key = if of == Kind::Element { "element" } else { "node" };
        let spot = match (table.get(key), table.get("point")) {
            (Some(value), None) => {
                let number = value.integer(1, u64::from(u32::MAX));
                number.map(|id| Spot::Number(value.placed(id as u32)))
            }
            (None, Some(value)) => value.vector().map(|point| Spot::Point(value.placed(point))),
            (None, None) if table.has("part") => Some(Spot::Centre),
            _ => {
                table.faults.add(
                    table.at,
                    format!("{} with neither or both of {key} and point", table.title),
                    "one of them",
                    format!(
                        "write {key} = number or point = [x, y, z], or part = \"name\" alone for its centre"
                    ),
                );
                None
            }
        };
        table.finish();
        Gauge { name, of, spot, part }
    };
    deck.tables("gauge", MAX_ENTRIES).into_iter().map(gauge).collect()
}
