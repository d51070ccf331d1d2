//! What spans entries of a deck: inverted elements, parts without mass, contact zones that overlap.

use mechanics::{
    contact::Settings,
    element::{beam2, tet10, truss2},
    material::{Failure, Material, Strength},
    mesh::{self, Topology},
};
use rayon::prelude::*;

use super::{assembly::Assembly, part::PartDraft, surface::Face, zones};
use crate::{
    fault::short,
    geometry::{cross, longest_edge, norm, sub, worst_corner},
    log::Log,
    typed::mesh::Numbers,
};

/// Most elements named per part; the rest are counted.
const MAX_NAMED: usize = 10;

/// Volume over the cube of the largest edge below which an element is flat: far under any aspect ratio that
/// runs, and above the rounding of a volume that is zero.
const FLAT: f64 = 1e-12;

/// What to do about a turned or folded element.
const CORNER_ORDER: &str = "order the corners 0(000) 1(100) 2(110) 3(010) 4(001) 5(101) 6(111) 7(011)";

/// Every check that needs the whole mesh.
pub(super) fn check(
    parts: &[PartDraft],
    assembly: &Assembly,
    contact: Option<(&Settings, &[Face])>,
    materials: &[Material],
    log: &Log<'_>,
) {
    sections(parts, assembly, materials, log);
    springs(parts, assembly, log);
    // Elements that a join folds together were reported with the join.
    let volumes_fit = !assembly.collapsed && volumes(parts, assembly, log);
    // Inside and outside mean nothing for inverted elements.
    if volumes_fit && let Some((settings, faces)) = contact.filter(|(s, _)| !s.ignores_initial) {
        zones::overlaps(parts, assembly, settings, faces, log);
    }
}

/// Reports shells, trusses and beams of a section or a material that cannot be computed.
fn sections(parts: &[PartDraft], assembly: &Assembly, materials: &[Material], log: &Log<'_>) {
    for (part, draft) in assembly.mesh.parts.iter().zip(parts) {
        let material = draft.material.and_then(|index| materials.get(index as usize));
        let Some(material) = material else { continue };
        if matches!(material.strength, Strength::ChangChang(_))
            && part.section().is_none()
            && part.n_elements() > 0
        {
            log.fault(
                draft.at,
                format!("part \"{}\" of \"{}\", whose strength is chang-chang", part.name, material.name),
                "shells: it is the law of their layers",
                log.say(
                    "take orthotropic, or give the part a shell",
                    "take *MAT_COMPOSITE_DAMAGE, or shells",
                ),
            );
            continue;
        }
        if let Some(e) = draft.axes.and_then(|axes| axes.first_without(part, &assembly.mesh.positions)) {
            log.fault(
                draft.at,
                format!("part \"{}\": its axes give element {} none", part.name, part.element_ids[e]),
                "a vector that is not normal to an element, or a line on which none is centred",
                log.say("take other axes", "take another AOPT or vector"),
            );
            continue;
        }
        let (kind, checked) = match &part.topology {
            Topology::Structured { .. } | Topology::Explicit { .. } | Topology::EightPoint { .. } => continue,
            Topology::Tetrahedra { .. } => {
                if let Err(unfit) = tet10::check(material) {
                    log.fault(
                        draft.at,
                        format!(
                            "part \"{}\" of tetrahedra of ten nodes, of \"{}\"",
                            part.name, material.name
                        ),
                        unfit.to_string(),
                        "choose another material, or mesh the part with elements of first order",
                    );
                }
                continue;
            }
            Topology::Shells { section, .. } => {
                let checked = section.check(material);
                let unlaid = || mesh::first_without_direction(part, material, &assembly.mesh.positions);
                match checked {
                    Err(error) if !error.is_of_law() => {
                        let expected = "a section that can be laid up";
                        let advice = log.say("correct its shell", "correct its section");
                        log.fault(draft.at, format!("part \"{}\": {error}", part.name), expected, advice);
                        continue;
                    }
                    Ok(()) if let Some(e) = unlaid() => {
                        log.fault(
                            draft.at,
                            format!(
                                "part \"{}\": the direction of angle 0 of its plies is normal to element {}",
                                part.name, part.element_ids[e]
                            ),
                            "a direction with a part in the plane of each element",
                            log.say(
                                "take another axis, or across = [x, y, z]",
                                "take another AOPT or vector",
                            ),
                        );
                        continue;
                    }
                    _ => {}
                }
                ("shells", checked.map_err(|e| e.to_string()))
            }
            Topology::Beams { bars, section, across } => {
                let e = (0..bars.len()).find(|&e| is_unturned(part, e, across[e], section, assembly));
                if let Some(e) = e {
                    log.fault(
                        draft.numbers.as_ref().map_or(draft.at, |own| own.element_places.of(e)),
                        format!(
                            "beam {} of part \"{}\" without a direction across it",
                            part.element_ids[e], part.name
                        ),
                        "one, as its section is not alike about both axes",
                        log.say(
                            "give across = [x, y, z] in beam = { ... }",
                            "give the third node of *ELEMENT_BEAM, off the line of the beam",
                        ),
                    );
                }
                ("beams", beam2::check(section, material).map_err(|e| e.to_string()))
            }
            Topology::Springs { .. } => continue,
            Topology::Trusses { area, .. } => {
                ("trusses", truss2::check(*area, material).map_err(|e| e.to_string()))
            }
        };
        match checked {
            Err(error) => log.fault(
                draft.at,
                format!("part \"{}\": {error}", part.name),
                "a material whose law has a plane-stress form",
                "choose another material, or model the part with solids",
            ),
            Ok(()) if material.failure != Failure::None => {
                log.fault(
                    draft.at,
                    format!("part \"{}\" of {kind}, whose material \"{}\" fails", part.name, material.name),
                    "a material without failure",
                    "remove the failure of the material, or model the part with solids",
                );
            }
            Ok(()) => {}
        }
    }
}

/// Reports nodes of springs that have no mass.
fn springs(parts: &[PartDraft], assembly: &Assembly, log: &Log<'_>) {
    let mesh = &assembly.mesh;
    let is_spring = |part: &mesh::Part| matches!(part.topology, Topology::Springs { .. });
    if !mesh.parts.iter().any(is_spring) {
        return;
    }
    let mut has_mass = vec![false; mesh.n_nodes()];
    let of_elements = mesh.parts.iter().filter(|part| !is_spring(part)).flat_map(|part| &part.nodes);
    for &node in of_elements.chain(mesh.lumped.iter().map(|(node, _)| node)) {
        has_mass[node as usize] = true;
    }
    for (part, draft) in mesh.parts.iter().zip(parts).filter(|(part, _)| is_spring(part)) {
        let bare: Vec<usize> = (0..part.nodes.len()).filter(|&n| !has_mass[part.nodes[n] as usize]).collect();
        for &n in bare.iter().take(MAX_NAMED) {
            log.fault(
                draft.numbers.as_ref().map_or(draft.at, |own| own.node_places.of(n)),
                format!(
                    "node {} of part \"{}\", of springs alone, without mass",
                    mesh.node_ids[part.nodes[n] as usize], part.name
                ),
                "a mass, also of a node that is held: springs have none",
                log.say(
                    "give it one by [[mass]], or join it to a body",
                    "give it one by *ELEMENT_MASS, or take a node of a body",
                ),
            );
        }
        if bare.len() > MAX_NAMED {
            log.fault(
                draft.at,
                format!("{} more such nodes in part \"{}\"", bare.len() - MAX_NAMED, part.name),
                "masses",
                "mend those named first",
            );
        }
    }
}

/// Whether a beam whose section has a wide and a narrow side is not told how it stands.
fn is_unturned(
    part: &mesh::Part,
    e: usize,
    across: [f64; 3],
    section: &beam2::BeamSection,
    assembly: &Assembly,
) -> bool {
    let [a, b, ..] = part.corners_at(e, &assembly.mesh.positions);
    let along = sub(b, a);
    let is_across = norm(cross(along, across)) > 1e-6 * norm(along) * norm(across);
    let alike = |[one, other]: [f64; 2]| (one - other).abs() <= 1e-9 * one.abs();
    !(is_across || alike(section.inertia) && alike(section.shear))
}

/// Reports elements whose volume is not positive; true where there is none.
fn volumes(parts: &[PartDraft], assembly: &Assembly, log: &Log<'_>) -> bool {
    let offsets = assembly.mesh.element_offsets();
    let mut fit = true;
    for (p, (part, draft)) in assembly.mesh.parts.iter().zip(parts).enumerate() {
        if log.is_given_up() {
            return false;
        }
        let volumes = &assembly.volumes[offsets[p]..offsets[p + 1]];
        let is_spring = matches!(part.topology, Topology::Springs { .. });
        let bad: Vec<usize> = (0..volumes.len())
            .into_par_iter()
            .filter(|&e| {
                let corners = part.corners_at(e, &assembly.mesh.positions);
                let edge = longest_edge(&corners);
                let least = if is_spring { 0.0 } else { FLAT * edge * edge * edge };
                !(volumes[e] > least && volumes[e].is_finite())
            })
            .collect();
        fit &= bad.is_empty();
        if let Some(own) = &draft.numbers
            && bad.is_empty()
        {
            fit &= folded(assembly, p, offsets[p], own, log);
        }
        let size = if is_spring { "length" } else { "volume" };
        for &e in bad.iter().take(MAX_NAMED) {
            let at = draft.numbers.as_ref().map_or(draft.at, |own| own.element_places.of(e));
            let advice = match part.topology {
                Topology::Shells { .. } => "order the corners around the element",
                Topology::Springs { .. } => "give it two nodes at different places",
                Topology::Explicit { .. } if draft.numbers.is_some() => CORNER_ORDER,
                _ => "use a size that the numbers can hold, or a smaller join tolerance",
            };
            log.fault(
                at,
                format!(
                    "element {} of part \"{}\" with {size} {}",
                    part.element_ids[e],
                    part.name,
                    short(volumes[e])
                ),
                match volumes[e] > 0.0 && volumes[e].is_finite() {
                    // One that is only rounding, for the edges of the element.
                    true => format!("a {size} above {FLAT:e} times the cube of the longest edge"),
                    false => format!("a {size} above 0"),
                },
                advice,
            );
        }
        if bad.len() > MAX_NAMED {
            log.fault(
                draft.at,
                format!("{} more such elements in part \"{}\"", bad.len() - MAX_NAMED, part.name),
                format!("{size}s above 0"),
                "mend those named first",
            );
        }
    }
    fit
}

/// Reports elements of an explicit mesh that are folded at a corner though their volume is positive, as
/// corners in a wrong order leave them; true where there is none. `offset` is the global index of the part's first
/// element.
fn folded(assembly: &Assembly, p: usize, offset: usize, own: &Numbers, log: &Log<'_>) -> bool {
    let part = &assembly.mesh.parts[p];
    if part.section().is_some() {
        return true;
    }
    let mut n_folded = 0;
    for e in 0..part.n_elements() {
        if let Topology::Tetrahedra { .. } = part.topology {
            let nodes = part.nodes_of(e);
            let x = std::array::from_fn(|i| assembly.mesh.positions[nodes[i] as usize]);
            if !tet10::is_upright(&x) {
                n_folded += 1;
                if n_folded <= MAX_NAMED {
                    log.fault(
                        own.element_places.of(e),
                        format!(
                            "element {} of part \"{}\", of ten nodes, with a corner without volume",
                            part.element_ids[e], part.name
                        ),
                        "nodes on edges between their corners and near the middle of these",
                        "correct the order of the nodes, or straighten the edges",
                    );
                }
            }
            continue;
        }
        let nodes = part.corners(e);
        let corners = nodes.map(|node| assembly.mesh.positions[node as usize]);
        let (corner, jacobian) = worst_corner(&corners);
        // A corner of 180 degrees is flat, not folded.
        if jacobian >= -FLAT * assembly.volumes[offset + e] {
            continue;
        }
        n_folded += 1;
        if n_folded <= MAX_NAMED {
            log.fault(
                own.element_places.of(e),
                format!(
                    "element {} of part \"{}\" folded at its corner {corner} (node {})",
                    part.element_ids[e], part.name, assembly.mesh.node_ids[nodes[corner] as usize]
                ),
                "eight corners that each open outward",
                CORNER_ORDER,
            );
        }
    }
    if n_folded > MAX_NAMED {
        log.fault(
            own.element_places.of(0),
            format!("{} more folded elements in part \"{}\"", n_folded - MAX_NAMED, part.name),
            "none",
            "mend those named first",
        );
    }
    n_folded == 0
}
