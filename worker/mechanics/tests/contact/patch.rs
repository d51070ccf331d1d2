//! A joint counts once, and the side is right; sweeps over joints are cases of the verification book.

use mechanics::{contact::Contact, lanes::Width, mesh::Mesh};

use crate::world::{Random, add_block, block, deform, with_probe};

/// Half the harmonic mean of `K A^2/V = 1` on both sides.
const K: f64 = 0.5;

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|a| a * a).sum::<f64>().sqrt()
}

/// Force of a spring with a gap of 0.1, which hardens beyond half of it.
fn pushed(k: f64, depth: f64) -> f64 {
    k * (depth + 160.0 * (depth - 0.05).powi(2))
}

#[test]
fn a_right_angled_concave_corner_pushes_with_two_and_three_whole_forces() {
    // 2 x 2 x 2 elements without the one at (1,1,1): a notch with three faces.
    let (mut world, probe) = with_probe(block([2, 2, 2], 1.0), 0.1, &|e| e != 7);
    world.place(probe, [1.06, 1.5, 1.03]);
    let vote = world.forces(1.0);
    assert_eq!(vote.hits, 2);
    let f = world.force_on(probe);
    for (a, expected) in [(0, K * 0.04), (1, 0.0), (2, pushed(K, 0.07))] {
        assert!((f[a] - expected).abs() < 1e-13, "{f:?}");
    }
    world.place(probe, [1.06, 1.02, 1.03]);
    assert_eq!(world.forces(1.0).hits, 3);
    let f = world.force_on(probe);
    for (a, expected) in [(0, K * 0.04), (1, pushed(K, 0.08)), (2, pushed(K, 0.07))] {
        assert!((f[a] - expected).abs() < 1e-13, "{f:?}");
    }
}

#[test]
fn a_joint_that_is_slightly_concave_pushes_as_a_flat_one() {
    for bend in [1e-6, 1e-4, 1e-2] {
        let mut mesh = block([4, 4, 1], 1.0);
        deform(&mut mesh, |p| [p[0], p[1], p[2] + bend * ((p[0] - 2.0).abs() + (p[1] - 2.0).abs())]);
        let (mut world, probe) = with_probe(mesh, 0.1, &|_| true);
        let mut strip = false;
        for i in -200..=200 {
            let s = 0.01 * bend * f64::from(i);
            for p in [[2.0 + s, 2.3], [2.0 + s, 2.0 + 0.7 * s], [2.0, 2.0 + s]] {
                let height = bend * ((p[0] - 2.0).abs() + (p[1] - 2.0).abs());
                world.place(probe, [p[0], p[1], 1.05 + height]);
                strip |= world.forces(1.0).hits > 1;
                let f = norm(world.force_on(probe));
                assert!((f / (K * 0.05) - 1.0).abs() < 3.0 * bend, "{bend} {p:?}: {f}");
            }
        }
        assert!(strip, "the strip where slabs overlap was not met");
    }
}

#[test]
fn a_node_behind_the_face_of_a_solid_is_pushed_out() {
    // The row (.5,.5,-.05) of the table, for a solid: depth .15, push +z.
    let (mut world, probe) = with_probe(block([1, 1, 1], 1.0), 0.1, &|_| true);
    world.place(probe, [0.5, 0.5, 0.95]);
    let vote = world.forces(1.0);
    assert!((vote.worst_depth - 1.5).abs() < 1e-12, "{}", vote.worst_depth);
    let f = world.force_on(probe);
    assert!(f[0].abs() + f[1].abs() < 1e-15 && (f[2] - pushed(K, 0.15)).abs() < 1e-13, "{f:?}");
    assert_eq!(vote.worst_pair, (world.batch.nodes[probe].global, 1), "side 1 is the upper one");
    // On the face itself the line has no direction and the pseudonormal takes over.
    for p in [[0.5, 0.5, 1.0], [1.0, 0.5, 1.0], [1.0, 1.0, 1.0]] {
        world.place(probe, p);
        let vote = world.forces(1.0);
        assert_eq!((vote.hits, vote.worst_depth), (1, 1.0));
        let f = world.force_on(probe);
        assert!((norm(f) - pushed(K, 0.1)).abs() < 1e-13, "{f:?}");
        assert!(f.iter().zip(p).all(|(f, p)| (*f > 0.01) == (p == 1.0)), "{p:?} {f:?}");
    }
}

#[test]
fn beside_an_acute_edge_the_other_face_does_not_pull_the_node_through() {
    // The right side leans back under the upper face by 45 degrees.
    let mut mesh = block([2, 2, 1], 1.0);
    deform(&mut mesh, |p| [p[0] - (1.0 - p[2]) * p[0] * 0.5, p[1], p[2]]);
    let (mut world, probe) = with_probe(mesh, 0.1, &|_| true);
    for i in 1..100 {
        let p = [2.0 - 1e-3 * f64::from(i), 0.7, 1.02];
        world.place(probe, p);
        let vote = world.forces(1.0);
        let f = world.force_on(probe);
        assert_eq!(vote.hits, 1, "{p:?}: {f:?}");
        assert!(
            vote.worst_depth < 0.81 && f[2] > 0.0 && f[0].abs() < 1e-12,
            "{p:?}: {f:?} {}",
            vote.worst_depth
        );
    }
}

#[test]
fn flush_bodies_that_share_no_node_push_as_one() {
    let mut mesh = Mesh::default();
    add_block(&mut mesh, [2, 2, 1], [0.0; 3], 1.0);
    add_block(&mut mesh, [2, 2, 1], [2.0, 0.0, 0.0], 1.0);
    let (mut world, probe) = with_probe(mesh, 0.1, &|_| true);
    world.place(probe, [2.0, 0.5, 1.05]);
    assert_eq!(world.forces(1.0).hits, 2, "edges of two bodies are two features");
    let f = world.force_on(probe);
    assert!((norm(f) - K * 0.05).abs() < 1e-13, "{f:?}");
}

#[test]
fn hits_do_not_depend_on_the_order_of_candidates() {
    let mut mesh = block([3, 3, 2], 1.0);
    let mut random = Random(5);
    deform(&mut mesh, |p| [0, 1, 2].map(|a| p[a] + random.within(-0.2, 0.2)));
    let forces = |reverse: bool| -> Vec<u64> {
        let (mut world, probe) = with_probe(mesh.clone(), 0.3, &|_| true);
        if reverse {
            world.batch.units.iter_mut().for_each(|u| u.faces.reverse());
            world.contact = Contact::new(&world.batch, &world.settings, &world.x, Width::best());
        }
        let mut random = Random(9);
        let mut bits = vec![];
        for _ in 0..2000 {
            world.place(probe, random.point(-0.3, 3.3));
            world.forces(1.0);
            bits.extend(world.f.iter().flatten().map(|f| f.to_bits()));
        }
        bits
    };
    assert_eq!(forces(false), forces(true));
}
