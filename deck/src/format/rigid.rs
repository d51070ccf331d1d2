//! `[[rigid]]`: parts whose nodes move as one.

use mechanics::{
    material::Material,
    rigid::{Body, shape},
};

use super::{
    MAX_ENTRIES, Names,
    boundary::{Conditions, read_components},
    curve::Curves,
};
use crate::{
    assembly::Assembly,
    fault::Faults,
    table::{Range, Table},
};

/// One `[[rigid]]` and its place.
pub(crate) struct RigidDraft {
    at: usize,
    title: String,
    given: shape::Given,
}

/// Reads every `[[rigid]]`.
pub(crate) fn read(deck: &Table<'_>, names: &Names, curves: &Curves) -> Vec<RigidDraft> {
    let mut drafts: Vec<RigidDraft> = Vec::new();
    for table in deck.tables("rigid", MAX_ENTRIES) {
        let (at, title) = (table.at, table.title.clone());
        let value = table.require("parts", "\"all\" or a list of part names");
        let parts = value.and_then(|v| names.several(v)).unwrap_or_default();
        let mass = table.get("mass").and_then(|v| v.number(Range::Positive));
        let centre = table.get("centre").map(|v| v.vector());
        let inertia = table.get("inertia").map(|v| {
            let table = v.table(format!("inertia of {title}"))?;
            let [xx, yy, zz] = ["xx", "yy", "zz"].map(|key| table.number(key, Range::Positive));
            let [xy, yz, zx] = ["xy", "yz", "zx"].map(|key| table.number_or(key, 0.0, Range::Any));
            table.finish();
            Some([xx?, yy?, zz?, xy, yz, zx])
        });
        if centre.is_some() != inertia.is_some() {
            table.faults.add(
                at,
                format!("{title} with {} alone", if centre.is_some() { "centre" } else { "inertia" }),
                "centre and inertia, or neither",
                "give both, or remove it: they follow from the elements",
            );
        }
        let start_spin = table.get("start_spin").and_then(|v| v.vector());
        let components =
            |key| if table.has(key) { read_components(&table, key, curves) } else { Some([None; 3]) };
        let (velocity, spin) = (components("velocity"), components("spin"));
        for other in
            drafts.iter().filter(|other| parts.iter().any(|&p| other.given.parts.contains(&(p as u32))))
        {
            let (line, _) = deck.faults.place(other.at);
            table.faults.add(
                at,
                format!("{title} with a part of the [[rigid]] at line {line}"),
                "every part in one rigid body",
                "take it out of one of the two",
            );
        }
        table.finish();
        drafts.push(RigidDraft {
            at,
            title,
            given: shape::Given {
                parts: parts.into_iter().map(|p| p as u32).collect(),
                mass,
                inertia: centre.flatten().zip(inertia.flatten()),
                start_spin,
                velocity: velocity.unwrap_or_default(),
                spin: spin.unwrap_or_default(),
            },
        });
    }
    drafts
}

/// Makes the bodies; what was to hold or push their nodes goes to them or is a fault. None after any fault.
pub(crate) fn make(
    drafts: Vec<RigidDraft>,
    materials: &[Material],
    assembly: &mut Assembly,
    conditions: &mut Conditions,
    faults: &Faults<'_>,
) -> Vec<Body> {
    if drafts.is_empty() || faults.count() > 0 {
        return Vec::new();
    }
    let mut body_of: Vec<Option<usize>> = vec![None; assembly.mesh.n_nodes()];
    let mut bodies = Vec::new();
    for (b, RigidDraft { at, title, given }) in drafts.iter().enumerate() {
        let names = |p: usize| format!("\"{}\"", assembly.mesh.parts[p].name);
        let walls = &conditions.walls;
        if let Some((w, p)) = (0..walls.len())
            .find_map(|w| given.parts.iter().find(|&&p| walls[w].parts[p as usize]).map(|&p| (w, p as usize)))
        {
            faults.add(
                *at,
                format!("{title} with part {}, which [[wall]] {} stops", names(p), w + 1),
                "parts that no wall stops: walls act on single nodes",
                "name the other parts in the wall; to stop the body, give it contact with a rigid part that is held",
            );
        }
        for &n in given.parts.iter().flat_map(|&p| &assembly.mesh.parts[p as usize].nodes) {
            let id = assembly.mesh.node_ids[n as usize];
            let held = conditions.constraints[conditions.constraint[n as usize] as usize];
            if held.velocity.iter().any(Option::is_some) || held.clamped != 0 || held.walls != 0 {
                faults.add(
                    *at,
                    format!("{title} with node {id}, which a boundary or a wall holds"),
                    "nodes that move as the body does",
                    "take them out of the boundary or wall; velocity and spin of [[rigid]] hold the body",
                );
                break;
            }
            if let Some(other) = body_of[n as usize].replace(b).filter(|&other| other != b) {
                faults.add(
                    *at,
                    format!("{title} with node {id}, which {} has too", drafts[other].title),
                    "bodies that share no nodes",
                    "make them one [[rigid]] of all their parts, or do not join them",
                );
                break;
            }
        }
        if faults.count() > 0 {
            continue;
        }
        let made = shape::body(
            &assembly.mesh,
            materials,
            (&conditions.constraints, &conditions.constraint),
            &conditions.loads.curves,
            given.clone(),
            &mut assembly.velocity,
        );
        match made {
            Ok(body) => {
                turn(assembly, &body);
                bodies.push(body);
            }
            Err(words) => faults.add(
                *at,
                format!("{title} with {words}"),
                "mass and inertia of a body",
                "correct the mesh, or mass and inertia of [[rigid]]",
            ),
        }
    }
    let n_rigid: usize = bodies.iter().map(|body| body.parts.len()).sum();
    for body in &mut bodies {
        body.nodes.iter().for_each(|&n| conditions.constraint[n as usize] = 0);
        if n_rigid == assembly.mesh.parts.len() {
            body.courant = shape::courant(&assembly.mesh, materials, &body.parts);
        }
    }
    bodies
}

/// Lets the nodes of a body turn at the start as it does; only those of shells ever use it.
fn turn(assembly: &mut Assembly, body: &Body) {
    let has_shells = assembly.mesh.parts.iter().any(|part| part.section().is_some());
    if has_shells && (body.start.spin != [0.0; 3] || !assembly.spin.is_empty()) {
        assembly.spin.resize(assembly.velocity.len(), [0.0; 3]);
        body.nodes.iter().for_each(|&n| assembly.spin[n as usize] = body.start.spin);
    }
}
