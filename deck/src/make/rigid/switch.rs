//! Parts that are rigid for a time.

use mechanics::{
    constraint::Constraint,
    load::{Drive, Span},
    material::Material,
    rigid::{Body, shape, switch::Switch},
};

use super::{RigidDraft, given_with_supports};
use crate::{
    log::Log,
    make::{assembly::Assembly, boundary::Conditions},
};

/// Makes them; supports of their nodes hold the bodies, walls do not.
pub(in crate::make) fn make_switches(
    drafts: &[RigidDraft<'_>],
    lasting: &[Body],
    materials: &[Material],
    assembly: &Assembly,
    conditions: &Conditions,
    log: &Log<'_>,
) -> Vec<Switch> {
    let mut switches = Vec::new();
    let all_nodes: Vec<Vec<u32>> = drafts.iter().map(|draft| draft.given.all_nodes(&assembly.mesh)).collect();
    for (index, draft @ RigidDraft { rigid, given }) in drafts.iter().enumerate() {
        let (at, title) = (rigid.at, &rigid.title);
        let whole = [
            ("name", rigid.name.is_some()),
            ("nodes", rigid.nodes.is_some()),
            ("mass", rigid.mass.is_some()),
            ("inertia", rigid.inertia.is_some()),
            ("start_spin", rigid.start_spin.is_some()),
            ("rotation", rigid.circle.is_some()),
        ];
        if let Some((key, _)) = whole.iter().find(|(_, given)| *given) {
            log.fault(
                at,
                format!("{title} with {key} and a time"),
                "parts alone: they are rigid as their nodes are when the time begins",
                format!("remove {key}, or from and until"),
            );
            continue;
        }
        if given.parts.is_empty() {
            continue;
        }
        let nodes = &all_nodes[index];
        let id_of = |node: u32| assembly.mesh.node_ids[node as usize];
        let of_lasting = lasting.iter().flat_map(|body| &body.nodes);
        if let Some(&shared) = of_lasting.into_iter().find(|node| nodes.binary_search(node).is_ok()) {
            log.fault(
                at,
                format!("{title} with node {}, which another rigid body has", id_of(shared)),
                "bodies that share no nodes",
                log.say(
                    "take the part out of one of the two, or do not join them",
                    "switch one of the two only",
                ),
            );
            continue;
        }
        let others = drafts[..index].iter().zip(&all_nodes);
        let mut at_once = others.filter(|(other, _)| !rigid.span.is_apart_from(&other.rigid.span));
        let shared = at_once.find_map(|(other, theirs)| {
            let shared = theirs.iter().find(|node| nodes.binary_search(node).is_ok())?;
            (!draft.shares_parts_with(other)).then_some((other, *shared))
        });
        if let Some((other, shared)) = shared {
            log.fault(
                at,
                format!(
                    "{title} with node {}, which {} has too at that time",
                    id_of(shared),
                    other.rigid.title
                ),
                "bodies that share no nodes at one time",
                log.say(
                    "make them one [[rigid]], or do not join them",
                    "switch them by the same cards, which joins them where they share nodes",
                ),
            );
            continue;
        }
        let alone = shape::Given { parts: Vec::new(), nodes: nodes.clone(), ..given.clone() };
        let motion = (assembly.velocity.as_slice(), assembly.spin.as_slice());
        let held_by = (conditions.constraints.as_slice(), conditions.constraint.as_slice());
        let made = shape::body(&assembly.mesh, materials, held_by, &conditions.loads, alone.clone(), motion);
        let body = match made {
            Ok(body) => body,
            Err(words) => {
                log.fault(
                    at,
                    format!("{title} with {words}"),
                    "mass and inertia of a body",
                    "correct the mesh",
                );
                continue;
            }
        };
        let without_walls = |by: &Constraint| Constraint { walls: 0, ..*by };
        let Some(held) = given_with_supports(&alone, &body, conditions, &without_walls) else {
            log.fault(
                at,
                format!("{title} with nodes that a boundary moves, holds for a time, or holds beside the centre alone"),
                "nodes that move freely, or supports that hold the body along or about axes all along",
                "take them out of the boundary; velocity and spin of [[rigid]] move the body",
            );
            continue;
        };
        // What leads the body acts while it is one, and begins with it as a jump.
        let within = |drives: [Option<Drive>; 3]| {
            let begin = |span: Span| Span { from: span.from.max(rigid.span.from), ..span };
            drives.map(|drive| drive.map(|drive| Drive { span: begin(drive.span), ..drive }))
        };
        switches.push(Switch {
            parts: given.parts.clone(),
            span: rigid.span,
            velocity: within(held.velocity),
            spin: within(held.spin),
        });
    }
    switches
}
