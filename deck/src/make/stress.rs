//! Stress and plastic strain at the start: which elements have them, and whether their laws can.

use std::collections::{HashMap, HashSet};

use mechanics::{
    initial::{InitialStress, stress_fault},
    material::Material,
    mesh::Mesh,
};

use super::{names::Names, rigid::RigidDraft};
use crate::{log::Log, typed::Deck};

pub(super) fn make(
    deck: &Deck,
    names: &Names<'_>,
    mesh: &Mesh,
    (materials, rigid): (&[Material], &[RigidDraft<'_>]),
    log: &Log<'_>,
) -> Vec<InitialStress> {
    // Elements of the parts that entries list elements of, by number.
    let mut numbers: HashMap<usize, HashMap<u32, u32>> = HashMap::new();
    let mut taken = HashSet::new();
    let mut list = Vec::new();
    for entry in &deck.stresses {
        let (Some(selected), Some(points)) = (names.several(&entry.parts), &entry.points) else { continue };
        let mut missing: Vec<_> = entry.elements.iter().flatten().collect();
        for p in selected {
            let part = &mesh.parts[p];
            let elements: Option<Vec<u32>> = entry.elements.as_ref().map(|listed| {
                let of_part =
                    numbers.entry(p).or_insert_with(|| part.element_ids.iter().copied().zip(0..).collect());
                let mut found: Vec<u32> =
                    listed.iter().filter_map(|id| of_part.get(&id.value).copied()).collect();
                missing.retain(|id| !of_part.contains_key(&id.value));
                found.sort_unstable();
                found.dedup();
                found
            });
            if elements.as_ref().is_some_and(Vec::is_empty) {
                continue;
            }
            let title = format!("{} on part {:?}", entry.title, part.name);
            if rigid.iter().any(|body| body.parts().contains(&(p as u32))) {
                log.fault(entry.at, format!("{title}, which is rigid"), "parts that deform", "leave it out");
                continue;
            }
            // A part without a material has a fault of its own.
            let Some(material) = materials.get(part.material as usize) else { continue };
            if let Some((found, expected)) = stress_fault(part, material, points) {
                log.fault(entry.at, format!("{title}: {found}"), expected, "leave it out, or change it");
                continue;
            }
            let all = 0..part.n_elements() as u32;
            let mut take = |e: u32| !taken.insert((p, e));
            let twice = match &elements {
                Some(elements) => elements.iter().copied().find(|&e| take(e)),
                None => all.into_iter().find(|&e| take(e)),
            };
            if let Some(twice) = twice {
                let id = part.element_ids[twice as usize];
                let read = format!("{title}, whose element {id} has an initial stress already");
                log.fault(entry.at, read, "one for each element", "remove one of the two");
                continue;
            }
            list.push(InitialStress { part: p as u32, elements, points: points.clone() });
        }
        for id in missing {
            log.fault_of(id.origin, "the number of an element of these parts", "list elements of the mesh");
        }
    }
    list
}
