//! Clamps of parts: boundaries that hold faces of theirs, by name or as the edges of a plate.

use mechanics::load::Span;

use super::part::PartDraft;
use crate::{
    blocks::Shape,
    log::Log,
    place::{Origin, Placed},
    typed::{
        condition::{Boundary, BoundaryKind, Drive, Parts, Region},
        mesh::Source,
        part::{Clamp, Part},
    },
};

/// A body is a plate where its other sides are so many times as long as the shortest.
const FLAT: f64 = 2.0;

/// The boundaries that clamps stand for, one by part.
pub(super) fn boundaries(parts: &[Part], drafts: &[PartDraft], log: &Log<'_>) -> Vec<Boundary> {
    let clamped = |(part, draft): (&Part, &PartDraft)| {
        let clamp = part.clamp.as_ref()?;
        let (faces, origin) = match clamp {
            Clamp::Faces(faces) => (faces.clone(), faces[0].origin),
            Clamp::Edges(origin) => (edges(part, draft, *origin, log)?, *origin),
        };
        let held = || Some(Drive::constant(0.0));
        Some(Boundary {
            at: origin.at,
            title: format!("clamp of \"{}\"", part.name),
            parts: Parts::Named(vec![Placed::new(part.name.clone(), origin)]),
            kind: BoundaryKind::Held {
                velocity: [held(), held(), held()],
                clamped: 0b111,
                clamp_span: Span::ALWAYS,
                nodes: Some(Region::Faces(faces)),
            },
        })
    };
    parts.iter().zip(drafts).filter_map(clamped).collect()
}

/// The edges of a part, without those that a plane of symmetry cut away; none of a part that has none or could not be read.
fn edges(part: &Part, draft: &PartDraft, origin: Origin, log: &Log<'_>) -> Option<Vec<Placed<String>>> {
    let block = draft.block.as_ref()?;
    let names = match &part.mesh.as_ref()?.source {
        Source::Shape(shape) => edges_of(shape),
        Source::Explicit(_) | Source::Body { .. } => None,
    };
    let Some(names) = names else {
        let faces: Vec<&str> = block.faces.iter().map(|(name, _)| *name).collect();
        let advice = if faces.is_empty() {
            "hold its nodes by a [[boundary]] with box or plane".to_string()
        } else {
            format!("list faces: some of {}", faces.join(", "))
        };
        log.fault_of(origin, "a part with edges: a flat box, a disc, a plate, a tube or a prism", advice);
        return None;
    };
    let left = names.iter().filter(|name| block.faces.iter().any(|(face, _)| face == *name));
    let left: Vec<Placed<String>> = left.map(|name| Placed::new((*name).to_string(), origin)).collect();
    if left.is_empty() {
        log.fault_of(origin, "edges that no plane of symmetry has cut away", "clamp other faces");
        return None;
    }
    Some(left)
}

/// The faces that are the edges of a shape: the sides of a flat box or a plate, the rim of a disc, the ends of a tube.
fn edges_of(shape: &Shape) -> Option<Vec<&'static str>> {
    const SIDES: [[&str; 2]; 3] = [["i-min", "i-max"], ["j-min", "j-max"], ["k-min", "k-max"]];
    match shape {
        Shape::Brick { coordinates } => {
            let long: Vec<f64> = coordinates.iter().map(|x| x[x.len() - 1] - x[0]).collect();
            let thin = (0..3).find(|&a| (0..3).all(|b| a == b || long[b] >= FLAT * long[a]))?;
            Some((0..3).filter(|a| *a != thin).flat_map(|a| SIDES[a]).collect())
        }
        Shape::Cylinder { radius, length, .. } => (2.0 * radius >= FLAT * length).then(|| vec!["i-max"]),
        Shape::Sphere { .. } => None,
        Shape::Tube { .. } => Some(SIDES[2].to_vec()),
        Shape::Plate { .. } => Some([SIDES[0], SIDES[1]].concat()),
        Shape::Prism { .. } => Some(SIDES[1].to_vec()),
    }
}
