//! `[output]` and `[[gauge]]`.

use super::{MAX_ENTRIES, Names};
use crate::{
    assembly::Assembly,
    fault::{nearest, short},
    geometry::{norm, sub},
    model::{ElementGauge, FIELD_NAMES, Gauge, Output},
    table::{Range, Table, Value},
};

/// Most pairs of parts whose contact force is written: each has four columns.
pub(crate) const MAX_CONTACT_FORCES: usize = 64;

/// Reads `[output]` and every `[[gauge]]`.
pub(crate) fn read(deck: &Table<'_>, names: &Names, assembly: &Assembly) -> Output {
    let mut output = Output::default();
    if let Some(table) = deck.get("output").and_then(|v| v.table("[output]".to_string())) {
        output.period = table.get("period").and_then(|v| v.number(Range::Positive));
        output.history_cycles = table.integer_or("history_cycles", 10, 1, 1_000_000_000) as u32;
        output.snapshot_seconds = table.get("snapshot_seconds").and_then(|v| v.number(Range::Positive));
        output.snapshot_cycles = table.get("snapshot_cycles").and_then(|v| v.integer(1, 1_000_000_000));
        output.fields = read_fields(&table);
        let flag = |key: &'static str| table.get(key).and_then(|v| v.boolean());
        output.compress = flag("compress").unwrap_or(true);
        output.workers = flag("workers").unwrap_or(false);
        output.contact_surface = flag("contact_surface").unwrap_or(false);
        if let Some(value) = table.get("contact_surface").filter(|_| output.contact_surface) {
            needs_contact(deck, value);
        }
        output.contact_forces = read_contact_forces(deck, &table, names);
        table.finish();
    }
    for table in deck.tables("gauge", MAX_ENTRIES) {
        read_gauge(table, names, assembly, &mut output);
    }
    output
}

/// Reports what only a deck with contact can ask for.
fn needs_contact(deck: &Table<'_>, value: Value<'_>) {
    if !deck.has("contact") {
        value.fault("it in a deck with [contact] only", "add [contact], or remove it");
    }
}

/// Pairs of parts whose contact force is wanted.
fn read_contact_forces(deck: &Table<'_>, table: &Table<'_>, names: &Names) -> Vec<[u32; 2]> {
    let Some(value) = table.get("contact_forces") else { return Vec::new() };
    needs_contact(deck, value);
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    for item in value.items().unwrap_or_default() {
        let Some(both) = item.fixed::<2>("two part names") else { continue };
        let [Some(a), Some(b)] = both.map(|name| names.one(name)) else { continue };
        let pair = [a, b].map(|part| part as u32);
        if a == b {
            item.fault(
                "two different parts: the forces of a part on itself add to zero",
                "name another part, or remove the pair",
            );
        } else if pairs.iter().any(|&[c, d]| [c, d] == pair || [d, c] == pair) {
            item.fault("a pair that is not in the list before", "remove one of the two");
        } else {
            pairs.push(pair);
        }
    }
    if pairs.len() > MAX_CONTACT_FORCES {
        value.fault(&format!("at most {MAX_CONTACT_FORCES} pairs"), "remove the others");
    }
    pairs
}

fn read_fields(table: &Table<'_>) -> Vec<String> {
    let mut fields = Vec::new();
    let known = || FIELD_NAMES.into_iter();
    for item in table.get("fields").and_then(|v| v.items()).unwrap_or_default() {
        let Some(name) = item.text() else { continue };
        if known().any(|field| field == name) {
            if !fields.iter().any(|f| f == name) {
                fields.push(name.to_string());
            }
            continue;
        }
        let words: Vec<&str> = known().collect();
        let advice = match nearest(name, known()) {
            Some(near) => format!("write \"{near}\""),
            None => "choose one of them".to_string(),
        };
        item.fault(&format!("one of {}", words.join(", ")), &advice);
    }
    fields
}

/// A gauge at a node or element number, or at the node or element nearest to a point.
fn read_gauge(table: Table<'_>, names: &Names, assembly: &Assembly, output: &mut Output) {
    let value = table.require("name", "a name in quotes");
    let name = value.and_then(|v| v.name());
    if let (Some(name), Some(value)) = (&name, value)
        && (output.gauges.iter().any(|g| g.name == *name)
            || output.element_gauges.iter().any(|g| g.name == *name))
    {
        value.fault("a name that no other gauge has", "choose another name");
    }
    let of_element = table.get("of").and_then(|v| v.one_of(&["node", "element"])) == Some(1);
    let part = table.get("part");
    if of_element || table.has("element") {
        let element = element_of(&table, names, assembly, part);
        if let (Some(name), Some(element)) = (name, element) {
            output.element_gauges.push(ElementGauge { name, element });
        }
        return table.finish();
    }
    let node = match (table.get("node"), table.get("point")) {
        (Some(value), None) => value.integer(1, u64::from(u32::MAX)).and_then(|id| {
            let node = assembly.node_of_id.get(&(id as u32)).copied();
            if node.is_none() {
                value.fault("the number of a node", "choose a node of the mesh, or write point = [x, y, z]");
            }
            node
        }),
        (None, Some(value)) => {
            let selected = match part {
                None => (0..names.len()).collect(),
                Some(part) => names.one(part).into_iter().collect::<Vec<usize>>(),
            };
            let point = value.vector();
            let found = point.and_then(|point| closest(assembly, &selected, point));
            if let Some((node, part, distance)) = found
                && distance > assembly.largest_edge[part]
            {
                value.fault(
                    &format!(
                        "a point within one cell ({}) of a node; the nearest, {}, is {} away",
                        short(assembly.largest_edge[part]),
                        assembly.mesh.node_ids[node as usize],
                        short(distance)
                    ),
                    "move the point into a part",
                );
            }
            found.map(|(node, _, _)| node)
        }
        _ => {
            table.faults.add(
                table.at,
                format!("{} with neither or both of node and point", table.title),
                "one of them",
                "write node = number or point = [x, y, z]",
            );
            None
        }
    };
    table.finish();
    if let (Some(name), Some(node)) = (name, node) {
        output.gauges.push(Gauge { name, node });
    }
}

/// The element of a gauge: by its number, or the one whose centre is nearest to a point.
fn element_of(table: &Table<'_>, names: &Names, assembly: &Assembly, part: Option<Value<'_>>) -> Option<u32> {
    let parts = &assembly.mesh.parts;
    match (table.get("element"), table.get("point")) {
        (Some(value), None) => {
            let id = value.integer(1, u64::from(u32::MAX))? as u32;
            let ids = parts.iter().flat_map(|part| &part.element_ids);
            let found = ids.clone().position(|&other| other == id).map(|index| index as u32);
            if found.is_none() {
                value.fault(
                    "the number of an element",
                    "choose an element of the mesh, or write point = [x, y, z]",
                );
            }
            found
        }
        (None, Some(value)) => {
            let selected: Vec<usize> = match part {
                None => (0..names.len()).collect(),
                Some(part) => names.one(part).into_iter().collect(),
            };
            let point = value.vector()?;
            let offsets = assembly.mesh.element_offsets();
            let mut best: Option<(u32, usize, f64)> = None;
            for p in selected {
                for e in 0..parts[p].n_elements() {
                    let corners = parts[p].corners(e).map(|n| assembly.mesh.positions[n as usize]);
                    let centre = [0, 1, 2].map(|a| 0.125 * corners.iter().map(|x| x[a]).sum::<f64>());
                    let distance = norm(sub(centre, point));
                    if best.is_none_or(|(_, _, least)| distance < least) {
                        best = Some(((offsets[p] + e) as u32, p, distance));
                    }
                }
            }
            let (element, p, distance) = best?;
            if distance > assembly.largest_edge[p] {
                value.fault(
                    &format!(
                        "a point within one cell ({}) of the centre of an element; the nearest is {} away",
                        short(assembly.largest_edge[p]),
                        short(distance)
                    ),
                    "move the point into a part",
                );
            }
            Some(element)
        }
        _ => {
            table.faults.add(
                table.at,
                format!("{} with neither or both of element and point", table.title),
                "one of them",
                "write element = number or point = [x, y, z]",
            );
            None
        }
    }
}

/// The node of the selected parts nearest to a point, the lowest of several; its part and distance.
fn closest(assembly: &Assembly, selected: &[usize], point: [f64; 3]) -> Option<(u32, usize, f64)> {
    let mut best: Option<(u32, usize, f64)> = None;
    for &p in selected {
        for &node in &assembly.mesh.parts[p].nodes {
            let distance = norm(sub(assembly.mesh.positions[node as usize], point));
            if best.is_none_or(|(_, _, d)| distance < d) {
                best = Some((node, p, distance));
            }
        }
    }
    best
}
