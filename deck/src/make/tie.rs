//! Nodes of one part that are tied to faces of another.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::{
    contact::{Limit, OnFace, Settings, Surface, Tie, on_faces, strengthen, tie},
    material::Material,
};

use super::{assembly::Assembly, names::Names};
use crate::{fault::short, log::Log, place::Place, typed::contact};

/// Two parts that are tied.
pub(super) struct Tied {
    /// The part whose nodes are tied, and the part to whose faces.
    pub(super) parts: [usize; 2],
    tolerance: f64,
    /// Of pull and shear, where it breaks.
    pub(super) limits: [Option<Limit>; 2],
    /// The entry that ties them, by its index.
    entry: usize,
}

/// The pairs of parts of every tie; `rigid` says which parts are of rigid bodies.
pub(super) fn tied(
    ties: &[contact::Tie],
    names: &Names<'_>,
    rigid: &dyn Fn(usize) -> bool,
    log: &Log<'_>,
) -> Vec<Tied> {
    let mut list: Vec<Tied> = Vec::new();
    for (entry, given) in ties.iter().enumerate() {
        for of_nodes in &given.nodes {
            for of_faces in &given.faces {
                let (Some(a), Some(b)) = (names.one(of_nodes), names.one(of_faces)) else { continue };
                if a == b {
                    let advice = "name the part to whose faces they are tied";
                    log.fault_of(of_faces.origin, "another part than that of the nodes", advice);
                } else if rigid(a) {
                    let advice = "tie the nodes of the other part to its faces";
                    log.fault_of(of_nodes.origin, "a part that is not of a rigid body", advice);
                } else if let Some(first) = list.iter().find(|tied| tied.is_of(a, b)) {
                    let line = log.line(ties[first.entry].at, given.at);
                    let expected = format!("a pair of parts that {line} does not tie");
                    log.fault_of(of_faces.origin, expected, "remove one of the two");
                } else {
                    list.push(Tied {
                        parts: [a, b],
                        tolerance: given.tolerance,
                        limits: given.limits,
                        entry,
                    });
                }
            }
        }
    }
    list
}

impl Tied {
    fn is_of(&self, a: usize, b: usize) -> bool {
        self.parts == [a, b] || self.parts == [b, a]
    }
}

/// Finds the nodes that lie on faces, puts each exactly on its own, and ties it there.
pub(super) fn make(
    ties: &[contact::Tie],
    tied: &[Tied],
    assembly: &mut Assembly,
    materials: &[Material],
    log: &Log<'_>,
) -> Vec<Tie> {
    if tied.is_empty() || assembly.collapsed {
        return Vec::new();
    }
    let whole = Surface::new(&assembly.mesh, materials, &|_| true);
    let mut all: Vec<OnFace> = Vec::new();
    let mut limits: BTreeMap<u32, [Option<Limit>; 2]> = BTreeMap::new();
    for (entry, given) in ties.iter().enumerate() {
        let mut found = Vec::new();
        let mut farthest = 0.0_f64;
        for tied in tied.iter().filter(|tied| tied.entry == entry) {
            let distance = distance(tied, assembly);
            farthest = farthest.max(distance);
            found.extend(of_pair(tied, distance, &whole, assembly));
        }
        if found.is_empty() && tied.iter().any(|tied| tied.entry == entry) {
            let named = |parts: &[crate::place::Placed<String>]| {
                parts.iter().map(|part| format!("\"{}\"", part.value)).collect::<Vec<_>>().join(", ")
            };
            let (nodes, faces) = (named(&given.nodes), named(&given.faces));
            log.fault(
                given.at,
                format!("nodes of {nodes} tied to {faces}, none of which lies on a face"),
                format!("nodes within {} of the faces", short(farthest)),
                log.say("move the parts together, or raise tolerance", "move the parts together"),
            );
        }
        limits.extend(found.iter().map(|on| (on.node, given.limits)));
        all.extend(found);
    }
    all.sort_by_key(|on| on.node);
    if !each_once(&all, &whole, ties[0].at, assembly, log) {
        return Vec::new();
    }
    for on in &all {
        assembly.mesh.positions[whole.nodes[on.node as usize] as usize] = on.at;
    }
    assembly.measure_volumes();
    let mut ties = tie(&whole, &all);
    let x = on_surface(&whole, assembly);
    strengthen(&mut ties, &whole, &x, &all, &|on| limits.get(&on.node).copied().unwrap_or([None; 2]));
    ties
}

/// Positions by surface node.
fn on_surface(whole: &Surface, assembly: &Assembly) -> Vec<[f64; 3]> {
    whole.nodes.iter().map(|&n| assembly.mesh.positions[n as usize]).collect()
}

/// How far a tied node may be from its face.
fn distance(tied: &Tied, assembly: &Assembly) -> f64 {
    let [a, b] = tied.parts;
    tied.tolerance * assembly.smallest_edge[a].min(assembly.smallest_edge[b])
}

/// The nodes of one part on faces of the other.
fn of_pair(tied: &Tied, distance: f64, whole: &Surface, assembly: &Assembly) -> Vec<OnFace> {
    let ([a, b], n_parts) = (tied.parts, assembly.mesh.parts.len());
    let mut surface = whole.clone();
    // A node that joined parts share counts as one of that which is tied.
    for &n in &assembly.mesh.parts[a].nodes {
        if let Some(n) = surface.node_index(n) {
            surface.node_part[n as usize] = a as u32;
        }
    }
    let mut settings = Settings { gap: distance, ..Settings::default() };
    settings.interacts = vec![false; n_parts * n_parts];
    (settings.interacts[a * n_parts + b], settings.interacts[b * n_parts + a]) = (true, true);
    on_faces(&surface, &on_surface(whole, assembly), &settings, [a as u32, b as u32])
}

/// Whether each node is tied once, and none is a corner of a face to which others are tied; reports the first that is not.
fn each_once(all: &[OnFace], whole: &Surface, at: Place, assembly: &Assembly, log: &Log<'_>) -> bool {
    let corners: BTreeSet<u32> = all.iter().flat_map(|on| whole.faces[on.face as usize].nodes).collect();
    let id = |n: u32| assembly.mesh.node_ids[whole.nodes[n as usize] as usize];
    if let Some(twice) = all.windows(2).find(|pair| pair[0].node == pair[1].node) {
        log.fault(
            at,
            format!("node {} tied to faces of two parts", id(twice[0].node)),
            "a node that is tied once",
            "join the parts there, or tie one of them to the other only",
        );
        return false;
    }
    if let Some(both) = all.iter().find(|on| corners.contains(&on.node)) {
        log.fault(
            at,
            format!("node {} tied to a face, and a corner of a face to which others are tied", id(both.node)),
            "tied nodes and the corners of faces apart",
            "swap nodes and faces of one tie",
        );
        return false;
    }
    true
}
