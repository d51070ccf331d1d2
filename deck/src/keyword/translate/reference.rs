//! Nodes without elements that go with a rigid body, such as the hub of a spider: what is said of them goes to the body where that comes
//! to the same, and is a fault where it does not.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::load::Span;

use super::{condition::axes_of, rigid::title_of, state::Translation};
use crate::{
    geometry::{dot, norm, sub},
    keyword::{
        condition::{AXES_OF_CODE, Target},
        prescribed::Way,
        rigid::BodyNodes,
    },
    place::Place,
};

const AXES: [&str; 3] = ["x", "y", "z"];
/// A place is one of a line or plane, over the size of the body, up to the digits of decks.
const NEAR: f64 = 1e-6;
/// The largest share of a force at a node of the body.
const MOST_SHARE: f64 = 1e4;

/// A body that has such nodes.
#[derive(Clone, Debug)]
struct Carrier {
    /// The part that leads, or the nodal body.
    key: u32,
    title: String,
    /// Its nodes with elements.
    members: Vec<u32>,
    /// What holds its nodes without elements, along and about axes.
    held: Vec<(u32, [[bool; 3]; 2], Place)>,
    /// What moves these, by its index among the motions of the deck.
    moved: Vec<(u32, usize)>,
}

/// The nodes without elements of all bodies.
#[derive(Default)]
pub(super) struct References {
    carriers: Vec<Carrier>,
    /// The body of each.
    of_node: BTreeMap<u32, usize>,
}

impl References {
    /// Whether a node is one.
    pub(super) fn has(&self, node: u32) -> bool {
        self.of_node.contains_key(&node)
    }

    fn of_key(&self, key: u32) -> Option<&Carrier> {
        self.carriers.iter().find(|carrier| carrier.key == key)
    }
}

/// Finds them.
pub(super) fn find(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let mut found = References::default();
    let mut of_lead: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for given in &problem.rigid.extra {
        let Some(lead) = t.bodies.of(given.part) else { continue };
        of_lead.entry(lead).or_default().extend(t.named(given.target, given.at));
    }
    let of_parts = of_lead.into_iter().map(|(lead, nodes)| (lead, format!("the body of part {lead}"), nodes));
    // A spot weld of a node without element is refused.
    let of_nodes = problem.rigid.of_nodes.iter().filter_map(|given| match given.nodes {
        BodyNodes::Set(set) => {
            Some((given.id, title_of(given), problem.node_set(set, given.at, log).into_iter().collect()))
        }
        BodyNodes::Pair(_) => None,
    });
    let n_of_parts = problem.rigid.extra.len();
    let all: Vec<(u32, String, BTreeSet<u32>)> = of_parts.chain(of_nodes).collect();
    for (key, title, nodes) in all {
        let free: Vec<u32> = nodes.iter().copied().filter(|node| !t.used.contains(node)).collect();
        if free.is_empty() {
            continue;
        }
        let mut members: BTreeSet<u32> = nodes.into_iter().filter(|node| t.used.contains(node)).collect();
        if n_of_parts > 0 {
            let parts = t.bodies.lead.iter().filter(|(_, lead)| **lead == key).map(|(part, _)| *part);
            members.extend(parts.flat_map(|part| problem.nodes_of_part(part)));
        }
        let index = found.carriers.len();
        found.carriers.push(Carrier {
            key,
            title,
            members: members.into_iter().collect(),
            held: Vec::new(),
            moved: Vec::new(),
        });
        for node in free {
            found.of_node.entry(node).or_insert(index);
        }
    }
    if !found.of_node.is_empty() {
        find_conditions(t, &mut found);
    }
    t.references = found;
}

/// Finds what holds and moves them.
fn find_conditions(t: &Translation<'_>, found: &mut References) {
    let problem = t.problem;
    for node in problem.nodes.iter().filter(|node| node.held != [0; 2]) {
        if let Some(index) = found.of_node.get(&node.id) {
            let axes = node.held.map(|code| AXES_OF_CODE[usize::from(code)]);
            found.carriers[*index].held.push((node.id, axes, node.at));
        }
    }
    for given in &problem.conditions.held {
        for node in t.named(given.target, given.at) {
            let Some(index) = found.of_node.get(&node) else { continue };
            let carrier = &mut found.carriers[*index];
            if given.span == Span::ALWAYS {
                carrier.held.push((node, axes_of(t, given), given.at));
                continue;
            }
            t.log.fault(
                given.at,
                format!("node {node} of {}, which has no element, held for a time", carrier.title),
                "a node with an element, or supports of the whole run",
                "hold a node of the body that has an element, or move the body by *BOUNDARY_PRESCRIBED_MOTION_RIGID with BIRTH and DEATH",
            );
        }
    }
    for (index, given) in problem.conditions.motions.iter().enumerate() {
        let mut seen = BTreeSet::new();
        for node in t.named(given.target, given.at) {
            // The first of each body tells for all of it.
            if let Some(carrier) = found.of_node.get(&node).filter(|carrier| seen.insert(**carrier)) {
                found.carriers[*carrier].moved.push((node, index));
            }
        }
    }
}

/// What a body is held by at its nodes without elements, beside what `held` says: along and about axes. `key` is the part that leads or
/// the nodal body.
pub(super) fn holds(t: &Translation<'_>, key: u32, held: [[bool; 3]; 2]) -> [[bool; 3]; 2] {
    let Some(carrier) = t.references.of_key(key) else { return held };
    let mut sum = held;
    for (_, axes, _) in &carrier.held {
        (0..3).for_each(|a| sum[1][a] |= axes[1][a]);
    }
    for &(node, axes, at) in &carrier.held {
        for axis in (0..3).filter(|a| axes[0][*a]) {
            if is_along(axis, sum[1]) {
                sum[0][axis] = true;
                continue;
            }
            t.log.fault(
                at,
                format!(
                    "node {node} of {}, which has no element, held along {} while the body may turn",
                    carrier.title, AXES[axis]
                ),
                "a node with an element, or one that is held about both axes across, so that the body moves as it does",
                "hold the rotations of this node, too, or hold nodes of the body that have elements",
            );
            break;
        }
    }
    sum
}

/// Whether a body moves along an axis as each of its nodes does: it does not turn about the others.
fn is_along(axis: usize, turns: [bool; 3]) -> bool {
    (0..3).all(|a| a == axis || turns[a])
}

/// Motions of such nodes of a body that are motions of the body: the place, axis, and the index of each among those of the deck. `turns`
/// are the axes about which it is held.
pub(super) fn motions(t: &Translation<'_>, key: u32, turns: [bool; 3]) -> Vec<(Place, usize, usize)> {
    let mut list = Vec::new();
    let Some(carrier) = t.references.of_key(key) else { return list };
    for &(node, index) in &carrier.moved {
        let given = &t.problem.conditions.motions[index];
        match given.way {
            Way::Along(axis) if is_along(axis, turns) => list.push((given.at, axis, index)),
            _ => t.log.fault(
                given.at,
                format!(
                    "a motion of node {node} of {}, which has no element, while the body may turn",
                    carrier.title
                ),
                "a node with an element, or a motion along an axis of a node that *BOUNDARY_SPC holds about both axes across",
                "move the body by *BOUNDARY_PRESCRIBED_MOTION_RIGID, or nodes of it that have elements",
            ),
        }
    }
    list
}

/// Shares of a force at a node without element: at nodes of its body, with the same sum and the same moment however the body turns. None
/// after a fault.
pub(super) fn shares(t: &Translation<'_>, node: u32, at: Place) -> Option<Vec<(u32, f64)>> {
    let carrier = &t.references.carriers[*t.references.of_node.get(&node)?];
    let position = |id: &u32| t.problem.position(*id);
    let place = position(&node)?;
    let places: Vec<[f64; 3]> = carrier.members.iter().filter_map(position).collect();
    let shares = shares_of(place, &places);
    if shares.is_none() {
        t.log.fault(
            at,
            format!(
                "a force at node {node} of {}, which has no element and lies apart from the line or plane of those that have",
                carrier.title
            ),
            "a node with an element, or nodes of the body around it, on which the force acts alike",
            "put the force at nodes of the body that have elements",
        );
    }
    Some(shares?.into_iter().map(|(index, share)| (carrier.members[index], share)).collect())
}

/// Numbers with the sum 1 by which the places of a body make a place, as few of them as it takes; all of them where it is their mean.
fn shares_of(place: [f64; 3], places: &[[f64; 3]]) -> Option<Vec<(usize, f64)>> {
    let n = places.len();
    let mean = [0, 1, 2].map(|a| places.iter().map(|x| x[a]).sum::<f64>() / n.max(1) as f64);
    let size = places.iter().map(|x| norm(sub(*x, mean))).fold(0.0, f64::max).max(norm(sub(place, mean)));
    let is_near = |x: [f64; 3]| norm(x) <= NEAR * size;
    if n > 0 && is_near(sub(place, mean)) {
        return Some((0..n).map(|i| (i, 1.0 / n as f64)).collect());
    }
    // The nearest, then each that is farthest from the line or plane of those before it.
    let first = (0..n).min_by(|a, b| {
        let [a, b] = [*a, *b].map(|i| norm(sub(place, places[i])));
        a.total_cmp(&b)
    })?;
    let mut rest = sub(place, places[first]);
    let mut taken: Vec<(usize, [f64; 3])> = Vec::new();
    let mut across: Vec<[f64; 3]> = places.iter().map(|x| sub(*x, places[first])).collect();
    let without = |x: [f64; 3], e: [f64; 3]| {
        let along = dot(x, e);
        [0, 1, 2].map(|a| x[a] - along * e[a])
    };
    while !is_near(rest) {
        let next = (0..n).max_by(|a, b| norm(across[*a]).total_cmp(&norm(across[*b])))?;
        let long = norm(across[next]);
        if taken.len() == 3 || long <= NEAR * size {
            return None;
        }
        let e = across[next].map(|c| c / long);
        taken.push((next, e));
        rest = without(rest, e);
        across.iter_mut().for_each(|x| *x = without(*x, e));
    }
    // Each line across holds only what the later ones leave.
    let mut rest = sub(place, places[first]);
    let mut shares = Vec::new();
    for (index, e) in taken.iter().rev() {
        let way = sub(places[*index], places[first]);
        let share = dot(rest, *e) / dot(way, *e);
        rest = [0, 1, 2].map(|a| share.mul_add(-way[a], rest[a]));
        shares.push((*index, share));
    }
    let left = 1.0 - shares.iter().map(|(_, share)| share).sum::<f64>();
    shares.push((first, left));
    shares.retain(|(_, share)| share.abs() > NEAR);
    shares.iter().all(|(_, share)| share.abs() <= MOST_SHARE).then_some(shares)
}

/// Says which of the nodes that something names have no element and no body: nothing acts there.
pub(super) fn warn_of_idle(t: &Translation<'_>, target: Target, what: &str, at: Place) {
    let idle =
        t.named(target, at).into_iter().find(|node| !t.used.contains(node) && !t.references.has(*node));
    if let Some(node) = idle {
        t.log.warn(at, format!("{what} at node {node}, which no element has: it acts on nothing"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_make_the_place_where_they_can() {
        let square = [[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]];
        let all = shares_of([0.0; 3], &square).expect("their mean");
        assert!(all.len() == 4 && all.iter().all(|(_, share)| *share == 0.25), "{all:?}");
        let check = |place: [f64; 3], places: &[[f64; 3]]| {
            let shares = shares_of(place, places).expect("shares");
            assert!((shares.iter().map(|(_, s)| s).sum::<f64>() - 1.0).abs() < 1e-12);
            for a in 0..3 {
                let x: f64 = shares.iter().map(|(i, s)| s * places[*i][a]).sum();
                assert!((x - place[a]).abs() < 1e-9, "{place:?} {shares:?}");
            }
            shares.len()
        };
        assert_eq!(check([1.0, 1.0, 0.0], &square), 1);
        assert_eq!(check([3.0, 1.0, 0.0], &square), 3);
        assert!(check([0.3, -5.0, 0.0], &square) <= 3);
        assert!(shares_of([0.0, 0.0, 1.0], &square).is_none());
        let solid = [square.as_slice(), &[[0.0, 0.0, 1.0]]].concat();
        assert!(check([0.3, 0.1, 7.0], &solid) <= 4);
        assert!(shares_of([0.0; 3], &[]).is_none() && shares_of([1.0; 3], &[[0.0; 3]]).is_none());
    }
}
