//! Planes of symmetry through the origin: blocks that lie across one are cut there, and the nodes on it keep to it.

use super::part::PartDraft;
use crate::{
    blocks::Straddles,
    fault::short,
    log::Log,
    typed::{
        Deck,
        condition::{Boundary, BoundaryKind, Parts},
    },
};

const AXES: [&str; 3] = ["x", "y", "z"];

/// Leaves of every part what lies above the planes. A body that cannot be cut is a fault, and so is one that lies below.
pub(super) fn cut(deck: &Deck, parts: &mut [PartDraft], log: &Log<'_>) {
    let Some(symmetry) = &deck.symmetry else { return };
    for axis in (0..3).filter(|axis| symmetry.planes[*axis]) {
        let plane = AXES[axis];
        for part in parts.iter_mut() {
            let Some(block) = &mut part.block else { continue };
            let read =
                |what: String| format!("part \"{}\" {what} the plane {plane} = 0 of [symmetry]", part.name);
            let is_own = part.numbers.is_none();
            let refusal = match block.side_of(axis) {
                Some((true, true)) if !is_own => Some((
                    read("of an explicit mesh across".to_string()),
                    format!("nodes at {plane} of 0 or more"),
                    "leave out what the plane mirrors from the mesh, or remove the plane",
                )),
                Some((true, true)) => block.cut(axis).err().map(|Straddles { low, high }| {
                    (
                        read(format!("with cells from {plane} = {} to {} across", short(low), short(high))),
                        format!("cells that end at {plane} = 0"),
                        "give it an even number of cells there, or place it so that a plane of nodes lies on it",
                    )
                }),
                Some((true, false)) => Some((
                    read("below".to_string()),
                    format!("parts at {plane} of 0 or more: the plane mirrors them"),
                    "remove it if it is the mirror image of another part, else move it",
                )),
                _ => None,
            };
            if let Some((read, expected, advice)) = refusal {
                log.fault(part.at, read, expected, advice);
                // That it has no nodes on the plane is no second fault.
                part.block = None;
            }
        }
    }
}

/// The boundaries that hold the nodes on the planes.
pub(super) fn boundaries(deck: &Deck) -> impl Iterator<Item = Boundary> + '_ {
    let planes = deck
        .symmetry
        .iter()
        .flat_map(|symmetry| (0..3).filter(|axis| symmetry.planes[*axis]).map(|axis| (symmetry.at, axis)));
    planes.map(|(at, axis)| Boundary {
        at,
        title: format!("the plane {} = 0 of [symmetry]", AXES[axis]),
        parts: Parts::All,
        kind: BoundaryKind::Symmetry { axis, place: 0.0 },
    })
}
