//! The mesh files that a deck names: read, scaled, and numbered apart from each other.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    Format, MeshFile,
    composite::{self, Unfit},
    read,
};
use crate::{
    bundle::Bundle,
    fault::Fault,
    include::beside,
    limits::{MAX_ID, MAX_NODES},
    log::{Log, Warning},
    place::{Origin, Placed},
    table::holds,
    typed::{
        Deck,
        mesh::{Mesh, Meshes, Source},
        part::Part,
    },
};

/// The meshes of a deck, and what was found in their files.
#[derive(Default)]
pub(crate) struct OfDeck {
    /// By the name that the deck has for them; none of a file with a fault, and none of a file that is not there.
    pub(crate) by_name: Meshes,
    pub(crate) faults: Vec<Fault>,
    pub(crate) warnings: Vec<Warning>,
}

/// Reads every mesh file that a deck names; faults of the deck itself go to its log.
pub(crate) fn read_all(bundle: &Bundle<'_>, deck: Option<&Deck>, log: &Log<'_>) -> OfDeck {
    let mut all = OfDeck::default();
    let mut scales: BTreeMap<&str, Option<&Placed<f64>>> = BTreeMap::new();
    let parts = deck.map_or(&[][..], |deck| &deck.parts);
    let file_of = |part: &Part| match part.mesh.as_ref().map(|mesh| &mesh.source) {
        Some(Source::Body { mesh, .. }) => Some(mesh.value.clone()),
        _ => None,
    };
    let several = parts.iter().filter_map(file_of).collect::<BTreeSet<_>>().len() > 1;
    // Numbers that other files have: of nodes and of elements.
    let mut taken: [BTreeSet<u32>; 2] = Default::default();
    for part in parts {
        let Some(Source::Body { mesh: file, scale, .. }) = part.mesh.as_ref().map(|mesh| &mesh.source) else {
            continue;
        };
        if let Some(first) = scales.get(file.value.as_str()) {
            let factor = |scale: Option<&Placed<f64>>| scale.map_or(1.0, |scale| scale.value);
            let given = scale.as_ref();
            if factor(*first) != factor(given) {
                let expected =
                    format!("one scale for all parts of \"{}\", as {} before", file.value, factor(*first));
                let origin = given.map_or(file.origin, |given| given.origin);
                log.fault_of(origin, expected, "give all its parts the same scale, for they share nodes");
            }
            continue;
        }
        scales.insert(&file.value, scale.as_ref());
        let asks = |part: &&Part| file_of(part).as_ref() == Some(&file.value);
        let composite = parts.iter().filter(asks).find_map(|part| match part.mesh.as_ref()?.source {
            Source::Body { composite, .. } => composite,
            _ => None,
        });
        if log.is_given_up() {
            break;
        }
        let Some(index) = bundle.file(&beside(bundle.files[0].0, &file.value)) else { continue };
        let mut mesh = match read(bundle, index) {
            Ok(found) => {
                all.warnings.extend(found.warnings);
                Some(Mesh { file: found.mesh, elements: found.places })
            }
            Err(faults) => {
                all.faults.extend(faults);
                None
            }
        };
        if let Some(Mesh { file: mesh, .. }) = &mut mesh {
            if let Some(scale) = scale {
                scaled(mesh, scale, log);
            }
            if let Some(origin) = composite {
                raised(mesh, origin, log);
            }
            if several && Format::of(&file.value, bundle.files[index].1) != Format::Own {
                all.warnings.extend(number_apart(mesh, &taken, bundle.files[index].0));
            }
            if several {
                taken[0].extend(mesh.nodes.iter().map(|(id, _)| *id));
                taken[1].extend(mesh.bodies.iter().flat_map(|body| body.elements().map(|(id, _)| id)));
            }
        }
        all.by_name.insert(file.value.clone(), mesh);
    }
    all
}

/// Puts nodes on the edges of the tetrahedra, as a part asks at `origin`.
fn raised(mesh: &mut MeshFile, origin: Origin, log: &Log<'_>) {
    let (expected, advice) = match composite::raise(mesh) {
        Ok(()) => return,
        Err(Unfit::Others(body, id)) => (
            format!(
                "no other solids than tetrahedra of four nodes in the file; body {body} has element {id}"
            ),
            "put bodies of other solids into a file of their own, or take it out",
        ),
        Err(Unfit::NoneThere) => ("tetrahedra of four nodes in the file".to_string(), "take it out"),
        Err(Unfit::TooMany(n)) => (
            format!(
                "at most {MAX_NODES} nodes and numbers of at most {MAX_ID}; with those on edges there are {n}"
            ),
            "make a coarser mesh, or renumber its nodes",
        ),
    };
    log.fault_of(origin, expected, advice);
}

/// Scales the positions of the nodes and the thicknesses of shells.
fn scaled(mesh: &mut MeshFile, scale: &Placed<f64>, log: &Log<'_>) {
    for (id, x) in &mut mesh.nodes {
        *x = x.map(|c| c * scale.value);
        if !x.iter().all(|c| holds(*c)) {
            let expected =
                format!("a scale that leaves magnitudes from 1e-60 to 1e60; node {id} comes to {x:?}");
            log.fault_of(scale.origin, expected, "choose another scale");
            return;
        }
    }
    for thickness in mesh.bodies.iter_mut().flat_map(|body| &mut body.thicknesses) {
        *thickness *= scale.value;
        if !holds(*thickness) {
            let expected = format!(
                "a scale that leaves magnitudes from 1e-60 to 1e60; a shell comes to a thickness of {thickness:?}"
            );
            log.fault_of(scale.origin, expected, "choose another scale");
            return;
        }
    }
}

/// Numbers nodes and elements on above those of other files where they meet them.
fn number_apart(mesh: &mut MeshFile, taken: &[BTreeSet<u32>; 2], name: &str) -> Option<Warning> {
    let nodes = || mesh.nodes.iter().map(|(id, _)| *id);
    let elements = || mesh.bodies.iter().flat_map(|body| body.elements().map(|(id, _)| id));
    let meet = [nodes().any(|id| taken[0].contains(&id)), elements().any(|id| taken[1].contains(&id))];
    let greatest = [nodes().max().unwrap_or(0), elements().max().unwrap_or(0)];
    let shift = [0, 1].map(|i| if meet[i] { taken[i].last().copied().unwrap_or(0) } else { 0 });
    // What would pass the greatest number stays, and is a fault of the parts.
    if shift == [0; 2] || (0..2).any(|i| u64::from(greatest[i]) + u64::from(shift[i]) > u64::from(MAX_ID)) {
        return None;
    }
    let [of_nodes, of_elements] = shift;
    mesh.nodes.iter_mut().for_each(|(id, _)| *id += of_nodes);
    for body in &mut mesh.bodies {
        body.solids
            .iter_mut()
            .for_each(|(id, corners)| (*id, *corners) = (*id + of_elements, corners.map(|n| n + of_nodes)));
        body.tetrahedra
            .iter_mut()
            .for_each(|(id, nodes)| (*id, *nodes) = (*id + of_elements, nodes.map(|n| n + of_nodes)));
        body.shells
            .iter_mut()
            .for_each(|(id, corners)| (*id, *corners) = (*id + of_elements, corners.map(|n| n + of_nodes)));
        body.trusses
            .iter_mut()
            .for_each(|(id, ends)| (*id, *ends) = (*id + of_elements, ends.map(|n| n + of_nodes)));
    }
    mesh.sets.values_mut().flatten().for_each(|id| *id += of_nodes);
    mesh.segments.values_mut().flatten().flatten().for_each(|id| *id += of_nodes);
    let words = [("nodes", of_nodes), ("elements", of_elements)]
        .into_iter()
        .filter(|(_, shift)| *shift > 0)
        .map(|(what, shift)| format!("{what} have their numbers plus {shift}"))
        .collect::<Vec<_>>()
        .join(", ");
    let words = format!("{words}, for another mesh file of the deck has the same");
    Some(Warning { file: name.to_string(), line: 1, words })
}
