//! Verification book 4.1b: a joint counts once, and the side is right.

use mechanics::mesh::Mesh;

use crate::world::{Random, World, add_block, block, deform, with_probe};

/// Half the harmonic mean of `K A^2/V = 1` on both sides.
const K: f64 = 0.5;

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|a| a * a).sum::<f64>().sqrt()
}

fn rotated(p: [f64; 3]) -> [f64; 3] {
    // A rotation by rows of whole numbers over 7, and an offset.
    let r = [[2., 3., 6.], [3., -6., 2.], [6., 2., -3.]];
    [0, 1, 2].map(|a| (r[a][0] * p[0] + r[a][1] * p[1] + r[a][2] * p[2]) / 7.0 + 3.0)
}

#[test]
fn a_node_swept_across_a_flat_patch_feels_a_constant_normal_force() {
    let up = [0.0, 0.0, 1.0];
    for turned in [false, true] {
        let mut mesh = block([5, 5, 1], 1.0);
        if turned {
            deform(&mut mesh, rotated);
        }
        let (mut world, probe) = with_probe(mesh, 0.1, &|_| true);
        let (origin, tip) = (rotated([0.0; 3]), rotated(up));
        let normal = if turned { [0, 1, 2].map(|a| tip[a] - origin[a]) } else { up };
        // Along a mesh line, across it, along the diagonal through the joints, and askew.
        for (from, step) in [
            ([0.5, 2.0], [1e-3, 0.0]),
            ([2.0, 0.5], [0.0, 1e-3]),
            ([0.5, 0.5], [1e-3, 1e-3]),
            ([0.5, 0.7], [1e-3, 0.61e-3]),
            ([0.5, 2.5], [1e-3, 0.0]),
        ] {
            for i in 0..=4000 {
                let t = f64::from(i);
                let p = [from[0] + t * step[0], from[1] + t * step[1], 1.05];
                world.place(probe, if turned { rotated(p) } else { p });
                let vote = world.forces(1.0);
                let f = world.force_on(probe);
                let along = f[0] * normal[0] + f[1] * normal[1] + f[2] * normal[2];
                let across = norm([0, 1, 2].map(|a| f[a] - along * normal[a]));
                assert_eq!(vote.hits, 1, "{p:?}");
                assert!((along - K * 0.05).abs() < 1e-12 * K, "{p:?}: {f:?}");
                assert!(across < 1e-12 * K, "{p:?}: {f:?}");
                assert!((vote.energy - 0.5 * K * 0.05 * 0.05).abs() < 1e-12, "{}", vote.energy);
            }
        }
    }
}

#[test]
fn a_right_angled_concave_corner_pushes_with_two_and_three_whole_forces() {
    // 2 x 2 x 2 elements without the one at (1,1,1): a notch with three faces.
    let (mut world, probe) = with_probe(block([2, 2, 2], 1.0), 0.1, &|e| e != 7);
    world.place(probe, [1.06, 1.5, 1.03]);
    let vote = world.forces(1.0);
    assert_eq!(vote.hits, 2);
    let f = world.force_on(probe);
    for (a, expected) in [(0, K * 0.04), (1, 0.0), (2, K * 0.07)] {
        assert!((f[a] - expected).abs() < 1e-13, "{f:?}");
    }
    world.place(probe, [1.06, 1.02, 1.03]);
    assert_eq!(world.forces(1.0).hits, 3);
    let f = world.force_on(probe);
    for (a, expected) in [(0, K * 0.04), (1, K * 0.08), (2, K * 0.07)] {
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
fn the_force_is_continuous_around_convex_edges_and_corners() {
    let mut mesh = block([2, 2, 2], 1.0);
    deform(&mut mesh, |p| [p[0] + 0.1 * p[1], p[1] - 0.07 * p[2], p[2] + 0.05 * p[0]]);
    let (mut world, probe) = with_probe(mesh, 0.1, &|_| true);
    // Rings about an edge and a corner of the upper right.
    for (centre, along) in [([2.1, 0.9, 2.1], [0.1, 0.95, 0.0]), ([2.2, 1.86, 2.1], [0.0, 0.0, 0.0])] {
        let mut last = None;
        for i in 0..=3000 {
            let t = f64::from(i) / 3000.0;
            let (sin, cos) = (2.6 * t - 0.6).sin_cos();
            let p = [0, 1, 2].map(|a| centre[a] + 0.3 * t * along[a]);
            world.place(probe, [p[0] + 0.05 * cos, p[1] + 0.01 * cos, p[2] + 0.05 * sin]);
            let vote = world.forces(1.0);
            assert!(vote.hits <= 1);
            let f = world.force_on(probe);
            if let Some(last) = last.replace(f) {
                let jump = norm([0, 1, 2].map(|a: usize| f[a] - last[a]));
                assert!(jump < 0.01 * K * 0.1, "{i}: {last:?} to {f:?}");
            }
        }
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
    assert!(f[0].abs() + f[1].abs() < 1e-15 && (f[2] - K * 0.15).abs() < 1e-13, "{f:?}");
    assert_eq!(vote.worst_pair, (world.batch.nodes[probe].global, 1), "side 1 is the upper one");
    // On the face itself the line has no direction and the pseudonormal takes over.
    for p in [[0.5, 0.5, 1.0], [1.0, 0.5, 1.0], [1.0, 1.0, 1.0]] {
        world.place(probe, p);
        let vote = world.forces(1.0);
        assert_eq!((vote.hits, vote.worst_depth), (1, 1.0));
        let f = world.force_on(probe);
        assert!((norm(f) - K * 0.1).abs() < 1e-13, "{f:?}");
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
            world.contact = mechanics::contact::Contact::new(&world.batch, &world.settings, &world.x);
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

/// A world's total force and moment about the origin, over all batch nodes.
pub fn totals(world: &World) -> ([f64; 3], [f64; 3]) {
    let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
    for n in 0..world.batch.nodes.len() {
        for a in 0..3 {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            force[a] += world.f[a][n];
            moment[a] += world.x[b][n] * world.f[c][n] - world.x[c][n] * world.f[b][n];
        }
    }
    (force, moment)
}
