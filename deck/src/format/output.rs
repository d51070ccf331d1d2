//! `[output]` and `[[gauge]]`.

use super::{MAX_ENTRIES, Names};
use crate::{
    assembly::Assembly,
    fault::{nearest, short},
    geometry::{norm, sub},
    model::{FIELD_NAMES, Gauge, Output},
    table::{Range, Table},
};

/// Reads `[output]` and every `[[gauge]]`.
pub(crate) fn read(deck: &Table<'_>, names: &Names, assembly: &Assembly) -> Output {
    let mut output = Output {
        period: None,
        history_cycles: 10,
        snapshot_seconds: None,
        snapshot_cycles: None,
        fields: Vec::new(),
        gauges: Vec::new(),
    };
    if let Some(table) = deck.get("output").and_then(|v| v.table("[output]".to_string())) {
        output.period = table.get("period").and_then(|v| v.number(Range::Positive));
        output.history_cycles = table.integer_or("history_cycles", 10, 1, 1_000_000_000) as u32;
        output.snapshot_seconds = table.get("snapshot_seconds").and_then(|v| v.number(Range::Positive));
        output.snapshot_cycles = table.get("snapshot_cycles").and_then(|v| v.integer(1, 1_000_000_000));
        output.fields = read_fields(&table);
        table.finish();
    }
    for table in deck.tables("gauge", MAX_ENTRIES) {
        if let Some(gauge) = read_gauge(table, names, assembly, &output.gauges) {
            output.gauges.push(gauge);
        }
    }
    output
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

/// A gauge at a node number, or at the node nearest to a point.
fn read_gauge(table: Table<'_>, names: &Names, assembly: &Assembly, others: &[Gauge]) -> Option<Gauge> {
    let value = table.require("name", "a name in quotes");
    let name = value.and_then(|v| v.name());
    if let (Some(name), Some(value)) = (&name, value)
        && others.iter().any(|g| g.name == *name)
    {
        value.fault("a name that no other gauge has", "choose another name");
    }
    let part = table.get("part");
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
    Some(Gauge { name: name?, node: node? })
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
