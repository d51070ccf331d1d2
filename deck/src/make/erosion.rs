//! What erodes, and what becomes of nodes without elements.

use mechanics::{erosion::Erosion, rigid::Body};

use super::{
    assembly::Assembly,
    names::Names,
    part::PartDraft,
    rigid::{self, RigidDraft},
};
use crate::{
    log::Log,
    typed::{Deck, condition::Parts},
};

/// Gathers the criteria of all parts. Of rigid bodies no part erodes.
pub(super) fn make(
    deck: &Deck,
    (parts, assembly): (&[PartDraft], &Assembly),
    (rigid, bodies): (&[RigidDraft<'_>], &[Body]),
    log: &Log<'_>,
) -> Erosion {
    let mut erosion = Erosion::default();
    for part in rigid::parts_of(rigid).flatten().map(|&p| &parts[p as usize]) {
        if part.erosion.is_some() {
            log.fault(
                part.at,
                format!("erosion of part \"{}\", which is rigid", part.name),
                "parts that deform: elements of a rigid body do not leave",
                log.say(
                    "remove erosion, or take the part out of [[rigid]]",
                    "take the limits out of its *MAT, or do not make the part rigid",
                ),
            );
        }
    }
    if parts.iter().any(|part| part.erosion.is_some()) {
        erosion.parts = parts.iter().map(|part| part.erosion).collect();
    }
    let Some(freed) = &deck.erosion else { return erosion };
    if let Some(retain) = &freed.retain_inertia {
        erosion.retain_inertia = retain.value;
        if !retain.value && !deck.has_contact {
            log.fault_of(
                retain.origin,
                "a [contact], of which freed nodes are dropped",
                "add [contact], or leave the inertia of freed nodes in the run",
            );
        }
    }
    let erodes = |node: &u32| {
        let holds = |p: &usize| assembly.mesh.parts[*p].nodes.contains(node);
        (0..parts.len()).filter(|&p| parts[p].erosion.is_some()).any(|p| holds(&p))
    };
    let mut of_nodes = bodies.iter().filter(|body| body.parts.is_empty()).flat_map(|body| &body.nodes);
    if !erosion.retain_inertia
        && let Some(node) = of_nodes.find(|&node| erodes(node))
    {
        log.fault(
            freed.at,
            format!(
                "freed nodes that leave the run, node {} of a rigid body among them",
                assembly.mesh.node_ids[*node as usize]
            ),
            "rigid bodies whose nodes stay",
            log.say("write retain_inertia = true", "give ENMASS 2 in *CONTROL_CONTACT"),
        );
    }
    if erosion.parts.is_empty() {
        log.fault(
            freed.at,
            "[erosion] in a deck whose parts do not erode",
            "a [[part]] with erosion = { ... }",
            "add erosion to a part, or remove the table",
        );
    }
    erosion
}

/// By part whether its freed nodes press on each other; empty where none do.
pub(super) fn particles(
    deck: &Deck,
    names: &Names<'_>,
    parts: &[PartDraft],
    erosion: &Erosion,
    log: &Log<'_>,
) -> Vec<bool> {
    let asked = deck.erosion.as_ref().and_then(|freed| freed.particles.as_ref());
    let Some(asked) = asked else { return Vec::new() };
    if !deck.has_contact {
        log.fault_of(
            asked.origin,
            "a [contact], in which freed nodes press on each other",
            "add [contact], or remove particles",
        );
    } else if !erosion.retain_inertia {
        log.fault_of(
            asked.origin,
            "freed nodes that stay in the run",
            "write retain_inertia = true, or remove particles",
        );
    }
    let mut press = vec![false; parts.len()];
    for p in names.several(&asked.value).unwrap_or_default() {
        press[p] = parts[p].erosion.is_some();
        if let Parts::Named(_) = asked.value
            && parts[p].erosion.is_none()
            && !erosion.parts.is_empty()
        {
            log.fault_of(
                asked.origin,
                format!("parts with erosion, and part \"{}\" has none", parts[p].name),
                "give it erosion, or leave it out",
            );
        }
    }
    if press.contains(&true) { press } else { Vec::new() }
}
