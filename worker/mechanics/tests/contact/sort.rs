//! Verification book 4.7: the sort finds what brute force finds.

use std::collections::BTreeSet;

use mechanics::{
    contact::{Census, Exclusions, Settings, Surface, initial_pairs, sort},
    mesh::Mesh,
};

use crate::{
    clouds::{agree, cloud},
    world::{add_block, block, deform, materials, on_surface, settings, without_self},
};

#[test]
fn the_sort_of_a_cloud_equals_brute_force_for_any_slack() {
    let mesh = cloud(8, 250, 1);
    for (gap, slack) in [(0.0, 0.0), (0.02, 0.0), (0.02, 0.1), (0.1, 0.5), (0.3, 3.0)] {
        let all = agree(&mesh, &settings(250, gap, slack));
        let foreign = agree(&mesh, &without_self(settings(250, gap, slack)));
        assert!(all >= foreign && foreign > 100, "{all} {foreign}");
        assert!(slack < 1.0 || all > foreign, "long boxes meet themselves");
    }
    let mut some = settings(250, 0.1, 0.2);
    for a in 0..250 {
        for b in 0..250 {
            some.interacts[a * 250 + b] = (a + b) % 7 == 3;
        }
    }
    assert!(agree(&mesh, &some) > 100);
    let none = Settings { interacts: vec![false; 250 * 250], ..some };
    assert_eq!(agree(&mesh, &none), 0);
}

#[test]
fn the_sort_of_bent_plates_equals_brute_force() {
    let mut mesh = block([12, 12, 2], 1.0);
    add_block(&mut mesh, [3, 3, 1], [1.0, 1.0, 2.4], 3.0);
    deform(&mut mesh, |p| {
        [
            p[0] + 0.3 * p[1].sin(),
            p[1] * (1.0 + 0.02 * p[0]),
            p[2] + 0.8 * (0.7 * p[0]).sin() * (0.5 * p[1]).cos(),
        ]
    });
    for slack in [0.0, 0.1, 0.4, 2.0] {
        agree(&mesh, &settings(2, 0.1, slack));
        agree(&mesh, &without_self(settings(2, 0.1, slack)));
    }
}

#[test]
fn a_face_much_larger_than_a_cube_reaches_nodes_in_its_middle() {
    let mut mesh = block([1, 1, 1], 100.0);
    add_block(&mut mesh, [3, 3, 3], [50.0, 50.0, 100.05], 0.1);
    let found = agree(&mesh, &without_self(settings(2, 0.03, 0.01)));
    assert!(found >= 16, "{found}");
}

#[test]
fn translation_by_a_thousand_lengths_changes_nothing() {
    let mesh = cloud(8, 120, 3);
    let settings = settings(120, 0.0625, 0.125);
    let units = |offset: [f64; 3]| {
        let mut moved = mesh.clone();
        deform(&mut moved, |p| [p[0] + offset[0], p[1] + offset[1], p[2] + offset[2]]);
        let surface = Surface::new(&moved, &materials(), &|_| true);
        let x = on_surface(&surface, &moved.positions);
        sort(&surface, &x, &settings, &Exclusions::default())
    };
    let still = units([0.0; 3]);
    assert!(still.len() > 50);
    assert_eq!(still, units([8192.0, -8192.0, 16384.0]));
    assert_eq!(still, units([-0.5, 12345.0, 1.0]));
}

#[test]
fn the_order_of_parts_does_not_change_the_units() {
    let mesh = cloud(6, 60, 7);
    let settings = settings(60, 0.1, 0.1);
    let named = |reverse: bool| {
        let mut mesh = mesh.clone();
        if reverse {
            // Parts and nodes in the opposite order; `node_ids` keeps the first number.
            mesh.parts.reverse();
            let last = mesh.positions.len() as u32 - 1;
            mesh.positions.reverse();
            mesh.parts.iter_mut().for_each(|p| p.nodes.iter_mut().for_each(|n| *n = last - *n));
        }
        let last = mesh.positions.len() as u32 - 1;
        let surface = Surface::new(&mesh, &materials(), &|_| true);
        let x = on_surface(&surface, &mesh.positions);
        let name =
            |n: u32| if reverse { last - surface.nodes[n as usize] } else { surface.nodes[n as usize] };
        sort(&surface, &x, &settings, &Exclusions::default())
            .into_iter()
            .map(|unit| {
                let nodes: BTreeSet<u32> = unit.nodes.iter().map(|&n| name(n)).collect();
                let faces: BTreeSet<[u32; 4]> =
                    unit.faces.iter().map(|&f| surface.faces[f as usize].nodes.map(name)).collect();
                (unit.cube, nodes, faces, unit.interactions)
            })
            .collect::<BTreeSet<_>>()
    };
    assert_eq!(named(false), named(true));
}

#[test]
fn one_crushed_face_does_not_shrink_the_cubes_below_twice_the_reach() {
    let mut mesh = block([10, 10, 1], 1.0);
    mesh.positions[1][0] = 1e-9;
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    let units = sort(&surface, &x, &settings(1, 0.1, 0.05), &Exclusions::default());
    // Cubes of side .5: 21 x 21 x 3 of them at most.
    assert!(units.iter().all(|u| u.cube[0] <= 20 && u.cube[1] <= 20 && u.cube[2] <= 2));
    agree(&mesh, &settings(1, 0.1, 0.05));
}

#[test]
fn excluded_pairs_do_not_count() {
    let mut mesh = block([2, 2, 1], 1.0);
    add_block(&mut mesh, [2, 2, 1], [0.25, 0.25, 1.05], 1.0);
    let settings = without_self(settings(2, 0.1, 0.1));
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    let pairs = initial_pairs(&surface, &x, &settings);
    assert!(pairs.iter().all(|&(_, _, d)| d < 0.1) && pairs.len() >= 8, "{pairs:?}");
    let count = |exclusions| Census::of(&sort(&surface, &x, &settings, &exclusions)).interactions;
    let (all, rest) = (count(Exclusions::default()), count(Exclusions::new(&surface, &pairs)));
    assert_eq!(all - rest, pairs.len() as u64);
}

/// The paper's larger benchmark: plates of 1 cm elements, one gap apart.
pub fn plates(gap: f64) -> (Mesh, Surface, Vec<[f64; 3]>) {
    let mut mesh = block([40, 40, 30], 1.0);
    add_block(&mut mesh, [40, 40, 10], [0.0, 0.0, 30.0 + gap], 1.0);
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    (mesh, surface, x)
}

#[test]
fn the_benchmark_of_64000_elements_has_its_census() {
    let (mesh, surface, x) = plates(0.1);
    assert_eq!(mesh.n_elements(), 64_000);
    assert_eq!((surface.n_elements(), surface.faces.len(), surface.nodes.len()), (12_016, 12_800, 12_804));
    for slack in [0.05, 0.1, 0.2] {
        let settings = settings(2, 0.1, slack);
        let census = Census::of(&sort(&surface, &x, &settings, &Exclusions::default()));
        println!("slack {slack}: {census:?}");
        assert!((2_500..3_500).contains(&census.units), "{census:?}");
        assert!(census.nodes.0 >= 1 && census.nodes.2 <= 12, "{census:?}");
    }
    assert!(initial_pairs(&surface, &x, &settings(2, 0.1, 0.1)).is_empty(), "one gap apart is apart");
}
