//! Models of hexahedra as models of composite tetrahedra: the same bodies with the same nodes at corners, and nodes on the edges.

use std::collections::BTreeMap;

use deck::Model;
use mechanics::{
    element::{hourglass::Hourglass, tet10},
    mesh::{FACES, Topology},
};

/// Cuts the solids of the chosen parts into six tetrahedra each. Every face is cut from its node of lowest index, so neighbours fit. A
/// node on an edge has the mean of the velocities at its ends and the constraint of the end that is held less.
///
/// # Panics
/// If a gauge or a load stands on an element of these parts.
pub fn cut(mut model: Model, chosen: impl Fn(&str) -> bool) -> Model {
    let Model { mesh, velocity, constraint, setup, output, .. } = &mut model;
    assert!(setup.loads.surfaces.is_empty() && output.element_gauges.is_empty(), "elements are cut");
    let held = |n: u16| {
        let of_node = &setup.constraints[usize::from(n)];
        of_node.velocity.iter().filter(|component| component.is_some()).count()
    };
    let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut next_id = mesh.node_ids.iter().copied().max().unwrap_or(0) + 1;
    let mut next_element = 1;
    for p in 0..mesh.parts.len() {
        let part = &mesh.parts[p];
        let hexahedra: Vec<[u32; 8]> = (0..part.n_elements()).map(|e| part.corners(e)).collect();
        if !chosen(&part.name) {
            continue;
        }
        let mut global: Vec<[u32; tet10::NODES]> = Vec::new();
        for corners in hexahedra {
            let lowest = *corners.iter().min().expect("eight");
            for face in FACES.map(|face| face.map(|corner| corners[corner])) {
                if face.contains(&lowest) {
                    continue;
                }
                let first = (0..4).min_by_key(|&i| face[i]).expect("four");
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| face[(first + i) % 4]);
                // Seen from outside a face turns left, so from the opposite node right.
                for [b, c] in [[b, c], [c, d]] {
                    let ends = [lowest, a, b, c];
                    let mut nodes = [lowest, a, b, c, 0, 0, 0, 0, 0, 0];
                    for (edge, [p, q]) in tet10::EDGES.into_iter().enumerate() {
                        let (p, q) = (ends[p], ends[q]);
                        nodes[4 + edge] = *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                            let (p, q) = (p as usize, q as usize);
                            let mean =
                                |x: [f64; 3], y: [f64; 3]| std::array::from_fn(|a| 0.5 * (x[a] + y[a]));
                            mesh.positions.push(mean(mesh.positions[p], mesh.positions[q]));
                            velocity.push(mean(velocity[p], velocity[q]));
                            let (one, other) = (constraint[p], constraint[q]);
                            constraint.push(if held(one) <= held(other) { one } else { other });
                            mesh.node_ids.push(next_id);
                            next_id += 1;
                            mesh.positions.len() as u32 - 1
                        });
                    }
                    global.push(nodes);
                }
            }
        }
        let part = &mut mesh.parts[p];
        let mut local: BTreeMap<u32, u32> = BTreeMap::new();
        let mut nodes: Vec<u32> = global.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        local.extend(nodes.iter().copied().zip(0..));
        part.nodes = nodes;
        part.element_ids = (next_element..next_element + global.len() as u32).collect();
        next_element += global.len() as u32;
        part.hourglass = Hourglass::NONE;
        let tetrahedra = global.iter().map(|nodes| nodes.map(|n| local[&n])).collect();
        part.topology = Topology::Tetrahedra { tetrahedra };
    }
    model
}
