//! What erodes, and what becomes of nodes without elements.

use mechanics::erosion::Erosion;

use super::{
    part::PartDraft,
    rigid::{self, RigidDraft},
};
use crate::{log::Log, typed::Deck};

/// Gathers the criteria of all parts. Of rigid bodies no part erodes.
pub(super) fn make(deck: &Deck, parts: &[PartDraft], rigid: &[RigidDraft<'_>], log: &Log<'_>) -> Erosion {
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
