//! Verification book 4.8: which faces lie outside, and their static data.

use mechanics::{
    contact::Surface,
    mesh::{Mesh, Part, Topology},
};

use std::collections::BTreeMap;

use crate::world::{Random, add_block, block, deform, materials, on_surface};

fn faces_without(gone: u32) -> usize {
    Surface::new(&block([4, 4, 4], 1.0), &materials(), &|e| e != gone).faces.len()
}

#[test]
fn removing_an_element_of_a_block_exposes_its_neighbours() {
    assert_eq!(faces_without(u32::MAX), 96);
    assert_eq!(faces_without(0), 96, "corner: three lost, three gained");
    assert_eq!(faces_without(1), 98, "edge: two lost, four gained");
    assert_eq!(faces_without(5), 100, "face: one lost, five gained");
    assert_eq!(faces_without(21), 102, "inside: six gained");
}

/// Faces that one living element has and no other, by their nodes: the slow way, over all elements.
fn lone_faces(mesh: &Mesh, alive: &dyn Fn(u32) -> bool) -> Vec<[u32; 4]> {
    let sides: [[usize; 4]; 6] =
        [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let mut count: BTreeMap<[u32; 4], usize> = BTreeMap::new();
    let mut element = 0;
    for part in &mesh.parts {
        for e in 0..part.n_elements() {
            let corners = part.corners(e);
            for side in sides.iter().filter(|_| alive(element)) {
                let mut nodes = side.map(|c| corners[c]);
                nodes.sort_unstable();
                *count.entry(nodes).or_default() += 1;
            }
            element += 1;
        }
    }
    count.into_iter().filter(|(_, n)| *n == 1).map(|(nodes, _)| nodes).collect()
}

#[test]
fn whatever_elements_erode_the_surface_is_the_faces_that_one_living_element_has() {
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let structured = block([5, 4, 3], 1.0);
    let mut joined = block([3, 3, 2], 1.0);
    add_block(&mut joined, [3, 3, 2], [0.0, 0.0, 2.0], 1.0);
    for i in 0..16 {
        joined.parts[1].nodes[i] = 32 + i as u32;
    }
    // An index space that closes to a ring, and one with another that stands on nodes inside it: sides of three elements.
    let mut ring = block([4, 3, 2], 1.0);
    for row in ring.parts[0].nodes.chunks_exact_mut(5) {
        row[4] = row[0];
    }
    let mut within = block([3, 3, 2], 1.0);
    add_block(&mut within, [3, 3, 1], [0.0, 0.0, 1.0], 1.0);
    for i in 0..16 {
        within.parts[1].nodes[i] = 16 + i as u32;
    }
    let mut explicit = structured.clone();
    let hexahedra: Vec<[u32; 8]> =
        (0..explicit.parts[0].n_elements()).map(|e| explicit.parts[0].corners(e)).collect();
    explicit.parts[0].topology = Topology::Explicit { hexahedra };
    for mesh in [structured, joined, ring, within, explicit] {
        let n: usize = mesh.parts.iter().map(Part::n_elements).sum();
        for round in 0..60 {
            let share = f64::from(round) / 59.0;
            let living: Vec<bool> = (0..n).map(|_| random.next() >= share).collect();
            let alive = |e: u32| living[e as usize];
            for retain_inertia in [true, false] {
                let erodes = vec![true; mesh.parts.len()];
                let surface = Surface::eroded(&mesh, &materials(), &alive, &erodes, retain_inertia);
                let mut found: Vec<[u32; 4]> =
                    surface.faces.iter().map(|face| face.nodes.map(|n| surface.nodes[n as usize])).collect();
                found.iter_mut().for_each(|nodes| nodes.sort_unstable());
                found.sort_unstable();
                assert_eq!(found, lone_faces(&mesh, &alive), "round {round}");
                assert!(surface.faces.iter().all(|face| alive(face.element)), "round {round}");
            }
        }
    }
}

#[test]
fn faces_look_outward_and_close_the_volume() {
    let mut mesh = block([3, 2, 2], 0.5);
    deform(&mut mesh, |p| [p[0] + 0.1 * p[1], p[1], p[2] + 0.2 * p[0] * p[1]]);
    let surface = Surface::new(&mesh, &materials(), &|e| e != 3);
    let x = on_surface(&surface, &mesh.positions);
    // The volume from the faces, each as four triangles about its mid-point: shear and a lift of the top by
    // the same function as the bottom keep it.
    let mut volume = 0.0;
    for face in &surface.faces {
        let c = face.nodes.map(|n| x[n as usize]);
        let mid = [0, 1, 2].map(|a| 0.25 * (c[0][a] + c[1][a] + c[2][a] + c[3][a]));
        for i in 0..4 {
            let (p, q) = (c[i], c[(i + 1) & 3]);
            volume += (mid[0] * (p[1] * q[2] - p[2] * q[1])
                + mid[1] * (p[2] * q[0] - p[0] * q[2])
                + mid[2] * (p[0] * q[1] - p[1] * q[0]))
                / 6.0;
        }
    }
    assert!((volume - 11.0 * 0.125).abs() < 1e-12, "{volume}");
}

#[test]
fn faces_between_joined_parts_are_inside() {
    let mut mesh = block([2, 2, 1], 1.0);
    add_block(&mut mesh, [2, 2, 1], [0.0, 0.0, 1.0], 1.0);
    // Joined: the lower nodes of the second part are the upper ones of the first.
    for i in 0..9 {
        mesh.parts[1].nodes[i] = 9 + i as u32;
    }
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    assert_eq!(surface.faces.len(), 4 + 4 + 16);
    assert_eq!(surface.nodes.len(), 9 + 8 + 9, "the node in the middle of the joint is inside");
    let on_joint = surface.node_index(9).expect("a joint's rim is on the surface");
    assert_eq!(surface.node_part[on_joint as usize], 0);
    assert_eq!(surface.n_elements(), 8);
}

#[test]
fn a_node_has_the_share_of_the_material_around_it() {
    let mesh = block([4, 4, 4], 1.0);
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    for (&node, &share) in surface.nodes.iter().zip(&surface.node_share) {
        let faces = mesh.positions[node as usize].iter().filter(|&&c| c == 0.0 || c == 4.0).count();
        let expected = [f64::NAN, 1.0, 0.5, 0.25][faces];
        assert!((share - expected).abs() < 1e-14, "{faces} faces: {share}");
    }
}

#[test]
fn stiffness_is_bulk_times_area_squared_over_volume() {
    let mut mesh = block([1, 1, 1], 1.0);
    deform(&mut mesh, |p| [2.0 * p[0], 3.0 * p[1], 5.0 * p[2]]);
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    let expected = [6.0 * 6.0 / 30.0, 6.0 * 6.0 / 30.0, 10.0 * 10.0 / 30.0, 7.5, 10.0 * 10.0 / 30.0, 7.5];
    for (face, expected) in surface.faces.iter().zip(expected) {
        assert!((face.stiffness - expected).abs() < 1e-13, "side {}: {}", face.side, face.stiffness);
    }
    let mean = (1.2 + 10.0 / 3.0 + 7.5) / 3.0;
    assert!(surface.node_stiffness.iter().all(|s| (s - mean).abs() < 1e-13));
    let x = on_surface(&surface, &mesh.positions);
    assert_eq!(surface.smallest_dimension(&x), 2.0);
}

#[test]
fn a_wedge_has_five_faces() {
    let mut mesh = Mesh { positions: vec![], node_ids: vec![], parts: vec![], lumped: Vec::new() };
    add_block(&mut mesh, [1, 1, 1], [0.0; 3], 1.0);
    mesh.parts[0] = Part {
        topology: Topology::Explicit { hexahedra: vec![[0, 1, 2, 2, 4, 5, 6, 6]] },
        nodes: vec![0, 1, 3, 2, 4, 5, 7, 6],
        ..mesh.parts[0].clone()
    };
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    assert_eq!((surface.faces.len(), surface.nodes.len()), (5, 6));
}
