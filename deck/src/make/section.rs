//! Cross-sections: the elements that a plane cuts, and their corners ahead of it.

use mechanics::{cross_section::CrossSection, exact::Quantum, mesh::Part, rigid::Body};

use super::{
    assembly::Assembly,
    names::Names,
    region::{ON_PLANE, unit},
};
use crate::{
    geometry::{dot, norm, sub},
    log::Log,
    model::Section,
    typed::{self, Deck},
};

/// The sections of a deck. Elements of rigid bodies have no forces and are never cut.
pub(super) fn make(
    deck: &Deck,
    names: &Names<'_>,
    assembly: &Assembly,
    bodies: &[Body],
    log: &Log<'_>,
) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    for given in &deck.sections {
        if let Some(name) = &given.name
            && sections.iter().any(|section| section.name == name.value)
        {
            log.fault_of(name.origin, "a name that no other section has", "choose another name");
        }
        let selected = names.several(&given.parts);
        let (Some(name), Some(mut selected)) = (&given.name, selected) else { continue };
        selected.retain(|&p| !bodies.iter().any(|body| body.parts.contains(&(p as u32))));
        let Some(cut) = cut(given, &selected, assembly) else { continue };
        // A part without elements has a fault of its own.
        let is_whole = selected.iter().all(|&p| assembly.mesh.parts[p].n_elements() > 0);
        if cut.elements.is_empty() && is_whole {
            log.fault(
                given.at,
                format!("{} that cuts nothing", given.title),
                "a plane with nodes of an element that deforms on both sides",
                "check point, normal, radius and parts against the mesh",
            );
        }
        sections.push(Section { name: name.value.clone(), cut });
    }
    sections
}

/// What a section cuts of the selected parts; none where its plane could not be read. A node on the plane is ahead of it.
fn cut(given: &typed::Section, selected: &[usize], assembly: &Assembly) -> Option<CrossSection> {
    let [point, normal] = given.plane?;
    let normal = unit(normal);
    let mesh = &assembly.mesh;
    let offsets = mesh.element_offsets();
    let (mut elements, mut sum, mut n_corners) = (Vec::new(), [0.0; 3], 0.0);
    for &p in selected {
        let part: &Part = &mesh.parts[p];
        let near = ON_PLANE * assembly.smallest_edge[p];
        for e in 0..part.n_elements() {
            let corners = part.corners(e).map(|n| mesh.positions[n as usize]);
            let n = part.n_corners();
            let is_ahead = |x: &[f64; 3]| dot(sub(*x, point), normal) >= -near;
            let ahead: u8 = (0..n).map(|i| u8::from(is_ahead(&corners[i])) << i).sum();
            let all = (0..n).map(|i| 1 << i).sum::<u8>();
            let centre = [0, 1, 2].map(|a| 0.125 * corners.iter().map(|x| x[a]).sum::<f64>());
            let is_far = given.radius.is_some_and(|radius| norm(sub(centre, point)) > radius);
            if ahead == 0 || ahead == all || is_far {
                continue;
            }
            elements.push(((offsets[p] + e) as u32, ahead));
            for x in (0..n).filter(|i| ahead >> i & 1 == 1).map(|i| corners[i]) {
                for (sum, x) in sum.iter_mut().zip(x) {
                    *sum += x;
                }
                n_corners += 1.0;
            }
        }
    }
    let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max].map(|of_two| {
        let positions = mesh.positions.iter().copied();
        positions.reduce(|a, b| std::array::from_fn(|i| of_two(a[i], b[i]))).unwrap_or_default()
    });
    let length = norm(sub(high, low));
    Some(CrossSection {
        origin: if n_corners > 0.0 { sum.map(|sum| sum / n_corners) } else { point },
        arm: if length > 0.0 && length.is_finite() { Quantum::for_reference(length, 0).value() } else { 1.0 },
        elements,
    })
}
