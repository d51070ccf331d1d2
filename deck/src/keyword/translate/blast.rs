//! Charges that explode in air, each with the segments that feel it.

use std::collections::BTreeMap;

use super::state::Translation;
use crate::{
    keyword::blast::Blasted,
    place::Place,
    typed::condition::{Charge, Faces, Load, LoadKind, Parts, Side, made},
};

/// Adds a load for each charge that segments feel.
pub(super) fn write(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let segments = || problem.blasts.segments.iter().chain(&problem.conditions.blasted);
    let mut felt: BTreeMap<u32, Vec<&Blasted>> = BTreeMap::new();
    segments().for_each(|segment| felt.entry(segment.charge).or_default().push(segment));
    for charge in &problem.blasts.charges {
        let Some(segments) = felt.remove(&charge.id) else {
            log.warn(charge.at, "a charge that no segment feels");
            continue;
        };
        if charge.units != t.deck.units.name {
            log.fault(
                charge.at,
                format!("units {} of a charge", charge.units),
                format!("those of the deck, {}", t.deck.units.name),
                format!("give --units {}, or correct UNIT", charge.units),
            );
        }
        let mut faces: Vec<[u32; 4]> = Vec::new();
        for segment in &segments {
            faces.extend(&segment.faces);
            if segment.set != 0 {
                faces.extend(problem.segment_set(segment.set, segment.at, log));
            }
        }
        let name = format!("blast {}", charge.id);
        t.mesh.segments.insert(name.clone(), faces);
        let given = Charge {
            mass: charge.mass,
            point: charge.point.map(|x| x + 0.0),
            span: charge.span,
            burst: charge.burst,
            negative: charge.negative,
            side: Side::Facing,
        };
        let at: Place = charge.at;
        let faces = Some(Faces::Segments(made(name, at)));
        let kind = LoadKind::Blast { charge: Some(given), faces };
        t.deck.loads.push(Load { at, title: "a *LOAD_BLAST".to_string(), parts: Parts::All, kind });
    }
    for (id, segments) in felt {
        let expected = "a *LOAD_BLAST, or a *LOAD_BLAST_ENHANCED of that number";
        log.fault(segments[0].at, format!("charge {id}"), expected, "define it");
    }
}
