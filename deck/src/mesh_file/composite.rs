//! Tetrahedra of four nodes become such of ten: a node in the middle of each edge, one for all elements that meet there.

use std::collections::BTreeMap;

use super::{Body, MeshFile};
use crate::limits::{MAX_ID, MAX_NODES};

/// Why the tetrahedra of a mesh cannot have nodes on their edges.
#[derive(Debug, PartialEq)]
pub(super) enum Unfit {
    /// A body has other solids, whose edges would not follow: its name, and the number of one of them.
    Others(String, u32),
    /// No body has tetrahedra of four nodes.
    NoneThere,
    /// There would be more nodes than a deck may have, or numbers beyond the greatest.
    TooMany(u64),
}

/// Nodes between two corners, by these in ascending order.
type Middles = BTreeMap<[u32; 2], u32>;

/// Puts nodes on the edges of all tetrahedra. Their numbers follow the greatest of the file, in the order of bodies and elements. A set
/// that has both ends of an edge has its node as well, a segment on three corners becomes four, and the velocity of a node is the mean
/// of the ends'.
///
/// # Errors
/// [`Unfit`]; the mesh is then as it was.
pub(super) fn raise(mesh: &mut MeshFile) -> Result<(), Unfit> {
    let greatest = mesh.nodes.iter().map(|(id, _)| *id).max().unwrap_or(0);
    let places: BTreeMap<u32, [f64; 3]> = mesh.nodes.iter().copied().collect();
    let mut middles = Middles::new();
    let mut new: Vec<(u32, [f64; 3])> = Vec::new();
    let mut raised: Vec<Vec<(u32, [u32; 10])>> = Vec::with_capacity(mesh.bodies.len());
    for body in &mesh.bodies {
        let mut tetrahedra = Vec::with_capacity(body.solids.len());
        for (id, corners) in &body.solids {
            let [a, b, c, c_again, d, rest @ ..] = *corners;
            if c_again != c || rest != [d; 3] {
                return Err(Unfit::Others(body.title(), *id));
            }
            let mut nodes = [a, b, c, d, 0, 0, 0, 0, 0, 0];
            for (edge, ends) in mechanics::element::tet10::EDGES.into_iter().enumerate() {
                let [p, q] = ends.map(|end| nodes[end]);
                let next = u64::from(greatest) + middles.len() as u64 + 1;
                let node = *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                    let [x, y] = [p, q].map(|end| places.get(&end).copied().unwrap_or_default());
                    // A number that would not do is found below, before anything is changed.
                    let number = u32::try_from(next).unwrap_or(u32::MAX);
                    new.push((number, std::array::from_fn(|axis| 0.5 * (x[axis] + y[axis]))));
                    number
                });
                nodes[4 + edge] = node;
            }
            tetrahedra.push((*id, nodes));
        }
        raised.push(tetrahedra);
    }
    let n_nodes = (mesh.nodes.len() + new.len()) as u64;
    if middles.is_empty() {
        return Err(Unfit::NoneThere);
    }
    if n_nodes > MAX_NODES || u64::from(greatest) + middles.len() as u64 > u64::from(MAX_ID) {
        return Err(Unfit::TooMany(n_nodes));
    }
    mesh.nodes.extend(new);
    for (body, tetrahedra) in mesh.bodies.iter_mut().zip(raised).filter(|(_, new)| !new.is_empty()) {
        let Body { solids, .. } = body;
        solids.clear();
        body.tetrahedra = tetrahedra;
    }
    for nodes in mesh.sets.values_mut() {
        nodes.sort_unstable();
        let both = |ends: &[u32; 2]| ends.iter().all(|end| nodes.binary_search(end).is_ok());
        let more: Vec<u32> = middles.iter().filter(|(ends, _)| both(ends)).map(|(_, node)| *node).collect();
        nodes.extend(more);
        nodes.sort_unstable();
    }
    for faces in mesh.segments.values_mut() {
        *faces = faces.iter().flat_map(|face| cut(face, &middles)).collect();
    }
    velocities(&mut mesh.velocities, &middles);
    Ok(())
}

/// The four triangles of a segment on three corners with nodes between them; others as they are.
fn cut(face: &[u32; 4], middles: &Middles) -> Vec<[u32; 4]> {
    let mut corners = face.to_vec();
    corners.dedup();
    let [a, b, c] = corners[..] else { return vec![*face] };
    let between = |p: u32, q: u32| middles.get(&[p.min(q), p.max(q)]).copied();
    match (between(a, b), between(b, c), between(c, a)) {
        (Some(ab), Some(bc), Some(ca)) => {
            vec![[a, ab, ca, ca], [ab, b, bc, bc], [ca, bc, c, c], [ab, bc, ca, ca]]
        }
        _ => vec![*face],
    }
}

/// Velocities of nodes between nodes that have them.
fn velocities(of_nodes: &mut Vec<(u32, [f64; 3])>, middles: &Middles) {
    let given: BTreeMap<u32, [f64; 3]> = of_nodes.iter().copied().collect();
    if given.is_empty() {
        return;
    }
    for ([p, q], node) in middles {
        if let (Some(v), Some(w)) = (given.get(p), given.get(q)) {
            of_nodes.push((*node, std::array::from_fn(|axis| 0.5 * (v[axis] + w[axis]))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_tetrahedra() -> MeshFile {
        let solids = vec![(7, [1, 2, 3, 3, 4, 4, 4, 4]), (9, [2, 3, 4, 4, 5, 5, 5, 5])];
        let places = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [2.0, 2.0, 2.0]];
        MeshFile {
            nodes: (1..).zip(places).collect(),
            bodies: vec![Body { name: "solid".to_string(), solids, ..Body::default() }],
            sets: [("side".to_string(), vec![2, 3, 4])].into(),
            segments: [("faces".to_string(), vec![[2, 3, 4, 4]])].into(),
            ..MeshFile::default()
        }
    }

    #[test]
    fn elements_that_meet_share_the_nodes_on_their_edges() {
        let mut mesh = two_tetrahedra();
        raise(&mut mesh).expect("tetrahedra");
        // Nine edges, three of them of both.
        assert_eq!(mesh.nodes.len(), 5 + 9);
        let [(7, first), (9, second)] = mesh.bodies[0].tetrahedra[..] else { panic!("two elements") };
        assert!(mesh.bodies[0].solids.is_empty());
        assert_eq!(first[..4], [1, 2, 3, 4]);
        // The edges 1-2, 2-0 and 0-3 of one are 0-1, 1-2 and 2-0 of the other in some order.
        let shared = first.iter().filter(|node| second.contains(node)).count();
        assert_eq!(shared, 6);
        assert_eq!(mesh.nodes.iter().find(|(id, _)| *id == first[5]), Some(&(first[5], [1.0, 1.0, 0.0])));
        assert_eq!(mesh.sets["side"].len(), 6);
        assert_eq!(mesh.segments["faces"].len(), 4);
    }

    #[test]
    fn other_solids_are_named() {
        let mut mesh = two_tetrahedra();
        mesh.bodies[0].solids.push((11, [1, 2, 3, 4, 5, 5, 5, 5]));
        let before = mesh.clone();
        assert_eq!(raise(&mut mesh), Err(Unfit::Others("solid".to_string(), 11)));
        assert!(mesh == before);
        mesh.bodies.clear();
        assert_eq!(raise(&mut mesh), Err(Unfit::NoneThere));
    }
}
