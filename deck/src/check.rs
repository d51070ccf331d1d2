//! What spans entries of a deck: inverted elements, parts without mass, contact zones that overlap.

mod surface;
mod zones;

use mechanics::mesh::Topology;

pub(crate) use surface::{Face, outer_faces, smallest_face_dimension};

use crate::{
    assembly::Assembly,
    fault::{Faults, short},
    format::{ContactDraft, PartDraft},
    geometry::{EDGES, norm, sub},
};

/// Most elements named per part; the rest are counted.
const MAX_NAMED: usize = 10;

/// Volume over the cube of the largest edge below which an element is flat: far under any aspect ratio that
/// runs, and above the rounding of a volume that is zero.
const FLAT: f64 = 1e-12;

/// Every check that needs the whole mesh.
pub(crate) fn spans(
    parts: &[PartDraft],
    assembly: &Assembly,
    contact: Option<&ContactDraft>,
    faults: &Faults<'_>,
) {
    // Elements that a join folds together were reported with the join.
    let volumes_fit = !assembly.collapsed && volumes(parts, assembly, faults);
    // Inside and outside mean nothing for inverted elements.
    if volumes_fit && let Some(contact) = contact {
        zones::overlaps(parts, assembly, contact, faults);
    }
}

/// Reports elements whose volume is not positive; true where there is none.
fn volumes(parts: &[PartDraft], assembly: &Assembly, faults: &Faults<'_>) -> bool {
    let offsets = assembly.mesh.element_offsets();
    let mut fit = true;
    for (p, (part, draft)) in assembly.mesh.parts.iter().zip(parts).enumerate() {
        let volumes = &assembly.volumes[offsets[p]..offsets[p + 1]];
        let bad: Vec<usize> = (0..volumes.len())
            .filter(|&e| {
                let corners = part.corners(e).map(|node| assembly.mesh.positions[node as usize]);
                let edge = EDGES.iter().map(|[a, b]| norm(sub(corners[*a], corners[*b]))).fold(0.0, f64::max);
                !(volumes[e] > FLAT * edge * edge * edge && volumes[e].is_finite())
            })
            .collect();
        fit &= bad.is_empty();
        for &e in bad.iter().take(MAX_NAMED) {
            let at = draft.explicit.as_ref().map_or(draft.at, |own| own.element_places[e]);
            let advice = match part.topology {
                Topology::Explicit { .. } if draft.explicit.is_some() => {
                    "order the corners 0(000) 1(100) 2(110) 3(010) 4(001) 5(101) 6(111) 7(011)"
                }
                _ => "use a size that the numbers can hold, or a smaller join tolerance",
            };
            faults.add(
                at,
                format!(
                    "element {} of part \"{}\" with volume {}",
                    part.element_ids[e],
                    part.name,
                    short(volumes[e])
                ),
                "a volume above 0",
                advice,
            );
        }
        if bad.len() > MAX_NAMED {
            faults.add(
                draft.at,
                format!("{} more such elements in part \"{}\"", bad.len() - MAX_NAMED, part.name),
                "volumes above 0",
                "mend those named first",
            );
        }
    }
    fit
}
