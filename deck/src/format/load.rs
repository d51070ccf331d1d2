//! `[[load]]`, `[gravity]`, `[relaxation]`: what pushes bodies from outside.

use std::collections::BTreeMap;

use mechanics::load::{Gravity, Loads, MAX_FORCES, NodalForce, Relaxation, SurfaceKind, SurfaceLoad};

use super::{
    MAX_ENTRIES, Names, PartDraft,
    boundary::{read_faces, read_nodes},
    curve::Curves,
};
use crate::{
    assembly::Assembly,
    table::{Range, Table},
};

const TYPES: [&str; 2] = ["pressure", "force"];

/// The loads of a deck, without its curves.
pub(crate) struct LoadDraft {
    pub(crate) list: Loads,
    /// By node: the forces that act on it, one bit each.
    pub(crate) forces: BTreeMap<u32, u32>,
}

/// Reads them.
pub(crate) fn read(
    deck: &Table<'_>,
    names: &Names,
    parts: &[PartDraft],
    assembly: &Assembly,
    curves: &Curves,
) -> LoadDraft {
    let mut draft = LoadDraft { list: Loads::default(), forces: BTreeMap::new() };
    for table in deck.tables("load", MAX_ENTRIES) {
        let kind = table.require("type", "one of pressure, force").and_then(|v| v.one_of(&TYPES));
        // Which keys belong depends on the type, so without one none is called unknown.
        let Some(kind) = kind else { continue };
        match TYPES[kind] {
            "pressure" => read_pressure(&table, names, parts, assembly, curves, &mut draft),
            _ => read_force(&table, names, parts, assembly, curves, &mut draft),
        }
        table.finish();
    }
    draft.list.gravity = read_gravity(deck, curves);
    draft.list.relaxation = read_relaxation(deck);
    draft
}

fn read_pressure(
    table: &Table<'_>,
    names: &Names,
    parts: &[PartDraft],
    assembly: &Assembly,
    curves: &Curves,
    draft: &mut LoadDraft,
) {
    let pressure = table.require("pressure", "a number or a curve").and_then(|v| curves.drive(v));
    let faces = read_faces(table, names, parts, assembly);
    if let Some(pressure) = pressure {
        draft.list.surfaces.push(SurfaceLoad { kind: SurfaceKind::Pressure(pressure), faces });
    }
}

fn read_force(
    table: &Table<'_>,
    names: &Names,
    parts: &[PartDraft],
    assembly: &Assembly,
    curves: &Curves,
    draft: &mut LoadDraft,
) {
    let force = table.vector("force");
    let drive = curves.of_table(table, 1.0);
    let selected = names.of_table(table);
    let broken = selected.is_empty() || selected.iter().any(|&p| parts[p].block.is_none());
    let nodes = read_nodes(table, &selected, assembly);
    let (Some(force), Some(nodes)) = (force, nodes) else { return };
    if nodes.is_empty() && !broken {
        table.faults.add(
            table.at,
            format!("{} that holds no node", table.title),
            "at least one node",
            "check parts, face, box, plane or nodes against the mesh",
        );
    }
    let index = draft.list.forces.len();
    if index == MAX_FORCES {
        table.faults.add(
            table.at,
            format!("more than {MAX_FORCES} loads of type force"),
            format!("at most {MAX_FORCES}"),
            "give more nodes the same force",
        );
    }
    if index >= MAX_FORCES {
        return;
    }
    draft.list.forces.push(NodalForce { force, drive });
    for node in nodes {
        *draft.forces.entry(node).or_default() |= 1 << index;
    }
}

fn read_gravity(deck: &Table<'_>, curves: &Curves) -> Option<Gravity> {
    let table = deck.get("gravity")?.table("[gravity]".to_string())?;
    let acceleration = table.vector("acceleration");
    let drive = curves.of_table(&table, 1.0);
    table.finish();
    Some(Gravity { acceleration: acceleration?, drive })
}

fn read_relaxation(deck: &Table<'_>) -> Option<Relaxation> {
    let table = deck.get("relaxation")?.table("[relaxation]".to_string())?;
    let range = Range::Within(0.0, 1.0, "a number above 0 and at most 1");
    let factor = table.number("factor", range);
    let until = table.number_or("until", f64::MAX, Range::Positive);
    table.finish();
    Some(Relaxation { factor: factor?, until })
}
