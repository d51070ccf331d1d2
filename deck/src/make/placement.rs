//! Parts that stand beside others: each is moved along one axis until its outermost node is a gap from the outermost node of the
//! other. Parts may stand beside parts that are placed themselves, in any order.

use mechanics::material::Material;

use super::{
    assembly, contact,
    names::{Curves, Names},
    part::PartDraft,
    rigid,
};
use crate::{
    log::Log,
    typed::{Deck, mesh::Meshes, part::Placement},
};

/// Moves every part that stands beside another.
pub(super) fn resolve(
    deck: &Deck,
    parts: &mut [PartDraft],
    names: &Names<'_>,
    materials: &[Material],
    meshes: &Meshes,
    log: &Log<'_>,
) {
    let placements: Vec<Option<&Placement>> = deck.parts.iter().map(|part| part.place.as_ref()).collect();
    if placements.iter().all(Option::is_none) {
        return;
    }
    let beside: Vec<Option<usize>> =
        placements.iter().map(|placement| names.one(&placement.as_ref()?.beside)).collect();
    let default = if placements.iter().flatten().all(|placement| placement.gap.is_some()) {
        None
    } else {
        default_gap(deck, parts, materials, meshes, log)
    };
    for p in order(&placements, &beside, parts, log) {
        let (Some(placement), Some(other)) = (placements[p], beside[p]) else { continue };
        let Some(gap) = placement.gap.or(default) else { continue };
        let (axis, above) = placement.side.axis();
        let [Some(own), Some(there)] = [p, other].map(|p| extent(&parts[p], axis)) else { continue };
        let way = if above { there[1] + gap - own[0] } else { there[0] - gap - own[1] };
        let mut by = [0.0; 3];
        by[axis] = way;
        if let Some(block) = &mut parts[p].block {
            block.translate(by);
        }
    }
}

/// The least and the greatest coordinate of a part along an axis; none of a part that could not be read.
fn extent(part: &PartDraft, axis: usize) -> Option<[f64; 2]> {
    let along = part.block.as_ref()?.positions.iter().map(|x| x[axis]);
    let [low, high] =
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    (low <= high).then_some([low, high])
}

/// The parts in an order in which each comes after the one that it stands beside. A part that stands beside itself, by way of others or
/// not, is a fault, and is left out with those that stand beside it.
fn order(
    placements: &[Option<&Placement>],
    beside: &[Option<usize>],
    parts: &[PartDraft],
    log: &Log<'_>,
) -> Vec<usize> {
    #[derive(Clone, Copy, PartialEq)]
    enum Seen {
        No,
        OnTheWay,
        Done,
    }
    let mut seen = vec![Seen::No; beside.len()];
    let mut order = Vec::new();
    for start in 0..beside.len() {
        let mut way = Vec::new();
        let mut at = Some(start);
        while let Some(p) = at.filter(|p| seen[*p] == Seen::No) {
            seen[p] = Seen::OnTheWay;
            way.push(p);
            at = beside[p];
        }
        if let Some(p) = at.filter(|p| seen[*p] == Seen::OnTheWay) {
            let circle: Vec<usize> = way.iter().copied().skip_while(|q| *q != p).chain([p]).collect();
            let words: Vec<String> = circle
                .windows(2)
                .filter_map(|pair| {
                    let side = placements[pair[0]]?.side.key();
                    Some(format!("\"{}\" {side} \"{}\"", parts[pair[0]].name, parts[pair[1]].name))
                })
                .collect();
            if let Some(placement) = placements[p] {
                log.fault(
                    placement.origin.at,
                    format!("parts that stand beside each other in a circle: {}", words.join(", ")),
                    "one of them where its mesh is",
                    "remove place from one of them",
                );
            }
        } else {
            order.extend(way.iter().rev());
        }
        way.iter().for_each(|p| seen[*p] = Seen::Done);
    }
    order
}

/// The contact gap, or none at all between parts that do not meet; none after a fault, which is reported where contact is made.
fn default_gap(
    deck: &Deck,
    parts: &[PartDraft],
    materials: &[Material],
    meshes: &Meshes,
    log: &Log<'_>,
) -> Option<f64> {
    let Some(given) = &deck.contact else {
        return (!deck.has_contact).then_some(0.0);
    };
    // Everything is looked at once more when the parts stand where they should.
    let quiet = log.quiet();
    let names = Names::of(&deck.parts, &quiet);
    let joins = assembly::joins(&deck.joins, &names, &quiet);
    let assembly = assembly::assemble(parts, &joins, materials, meshes, &quiet)?;
    let curves = Curves::of(&deck.curves, &quiet);
    let (rigid, _) = rigid::drafts(&deck.rigid, &names, &curves, &assembly, &quiet);
    contact::gap_to_come(given, &names, &assembly, &rigid, &quiet)
}
