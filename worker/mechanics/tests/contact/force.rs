//! What a cycle of contact books and votes; conservation is a case of the verification book.

use mechanics::{
    contact::{Batch, Contact, ContactVote, Exclusions, WorkUnit, sort},
    lanes::Width,
};

use crate::world::{World, add_block, block, deform, on_surface, settings, totals, with_probe, without_self};

#[test]
fn the_vote_of_a_pair_is_its_spring_between_both_masses() {
    let (mut world, probe) = with_probe(block([1, 1, 1], 1.0), 0.1, &|_| true);
    // k = .5, all masses 1, weights .25 each: omega^2 = 2 k (1 + .25).
    let expected = 0.4 / (2.0_f64 * 0.5 * 1.25).sqrt();
    for height in [1.05, 1.15] {
        world.place(probe, [0.5, 0.5, height]);
        let vote = world.forces(1.0);
        assert!((vote.dt - expected).abs() < 1e-14, "{height}: {} for {expected}", vote.dt);
        assert_eq!(vote.hits, u64::from(height < 1.1));
    }
    world.place(probe, [0.5, 0.5, 1.201]);
    let vote = world.forces(1.0);
    assert_eq!(vote.dt, f64::INFINITY);
    assert_eq!((vote.hits, vote.worst_depth, vote.energy), (0, 0.0, 0.0));
    world.place(probe, [0.5, 0.5, 1.04]);
    let vote = world.forces(1.0);
    assert!((vote.worst_depth - 0.6).abs() < 1e-12);
    // A hundredth beyond half a gap: the spring hardens by 160 times its square.
    let (force, energy) = (0.06 + 160.0 * 1e-4, 0.5 * 0.06 * 0.06 + 160.0 * 1e-6 / 3.0);
    assert!((vote.energy - 0.5 * energy).abs() < 1e-15, "{}", vote.energy);
    assert!((vote.force_bound - 0.5 * force).abs() < 1e-14, "{}", vote.force_bound);
    let expected = expected / (1.0_f64 + 320.0 * 0.01).sqrt();
    assert!((vote.dt - expected).abs() < 1e-14, "{} for {expected}", vote.dt);
}

#[test]
fn friction_is_coulombs_and_creeps_below_its_velocity() {
    let (mut world, probe) = with_probe(block([1, 1, 1], 1.0), 0.1, &|_| true);
    world.place(probe, [0.5, 0.5, 1.05]);
    world.settings.friction.fill(0.3);
    world.contact = Contact::new(&world.batch, &world.settings, &world.x, Width::best());
    let (normal, dt) = (0.5 * 0.05, 1e-4);
    // Sliding and approaching: only sliding matters.
    (world.v[0][probe], world.v[1][probe], world.v[2][probe]) = (3.0, 4.0, -2.0);
    let vote = world.forces(dt);
    let f = world.force_on(probe);
    for (a, expected) in [(0, -0.3 * normal * 0.6), (1, -0.3 * normal * 0.8), (2, normal)] {
        assert!((f[a] - expected).abs() < 1e-14, "{f:?}");
    }
    assert!((vote.friction - 0.3 * normal * 5.0 * dt).abs() < 1e-14, "{}", vote.friction);
    let (force, _) = totals(&world);
    assert_eq!(force, [0.0; 3]);
    // A tenth of the regularising velocity 1e-3: a tenth of the force.
    (world.v[0][probe], world.v[1][probe], world.v[2][probe]) = (1e-4, 0.0, 0.0);
    world.forces(dt);
    assert!((world.force_on(probe)[0] + 0.1 * 0.3 * normal).abs() < 1e-14);
    // With the body moving along there is no friction, and with a long step it never turns the sliding round.
    world.v[0].fill(7.0);
    world.forces(dt);
    assert!(world.force_on(probe)[0].abs() < 1e-14);
    world.v[0].fill(0.0);
    world.v[0][probe] = 1e-4;
    let dt = 10.0;
    world.forces(dt);
    assert!(world.v[0][probe] + dt * world.force_on(probe)[0] > 0.0);
}

/// Two bent plates pressed into each other's zones, all units in `n` batches.
fn pressed(n: usize, chunk_order: bool) -> (Vec<u64>, ContactVote) {
    let mut mesh = block([6, 6, 1], 1.0);
    add_block(&mut mesh, [8, 8, 1], [-0.17, 0.21, 1.05], 0.75);
    deform(&mut mesh, |p| [p[0], p[1], p[2] + 0.02 * (3.0 * p[0]).sin() * (2.0 * p[1]).cos()]);
    let mut settings = without_self(settings(2, 0.1, 0.05));
    settings.friction.fill(0.2);
    let world = World::new(&mesh, settings.clone(), &|_| true);
    let x = on_surface(&world.surface, &mesh.positions);
    let units = sort(&world.surface, &x, &settings, &Exclusions::default());
    let mut total = [0; 3].map(|_| vec![0.0; mesh.n_nodes()]);
    let mut vote = ContactVote::default();
    let mut order: Vec<usize> = (0..n).collect();
    if chunk_order {
        order.reverse();
    }
    for part in order {
        let mine: Vec<&WorkUnit> = units.iter().skip(part).step_by(n).collect();
        let batch = Batch::gather(&world.surface, &mine, &|_| 0.25, &Exclusions::default());
        let x = [0, 1, 2].map(|a| {
            batch.nodes.iter().map(|node| mesh.positions[node.global as usize][a]).collect::<Vec<f64>>()
        });
        let v = [x[1].clone(), x[2].clone(), x[0].clone()];
        let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
        let mut contact = Contact::new(&batch, &settings, &x, Width::best());
        vote.merge(&contact.forces(&x, &v, 0.01, world.force_quantum, world.energy_quantum, &mut f));
        for a in 0..3 {
            for (node, f) in batch.nodes.iter().zip(&f[a]) {
                total[a][node.global as usize] += f;
            }
        }
    }
    (total.iter().flatten().map(|f| f.to_bits()).collect(), vote)
}

#[test]
fn any_split_into_batches_gives_the_same_bits() {
    let (bits, vote) = pressed(1, false);
    assert!(vote.hits > 50 && vote.friction > 0.0, "{vote:?}");
    for n in [2, 3, 16] {
        for reverse in [false, true] {
            let (other, other_vote) = pressed(n, reverse);
            assert_eq!(bits, other);
            assert_eq!(vote, other_vote);
        }
    }
}

#[test]
fn what_a_sort_leaves_out_never_changes_a_bit() {
    // The same positions with lists of different slack: longer lists, same forces and votes.
    let result = |slack: f64| {
        let mut mesh = block([4, 4, 1], 1.0);
        add_block(&mut mesh, [5, 5, 1], [0.1, -0.2, 1.06], 0.8);
        let mut world = World::new(&mesh, without_self(settings(2, 0.1, slack)), &|_| true);
        let vote = world.forces(1.0);
        let mut bits: Vec<(u32, [u64; 3])> = (0..world.batch.nodes.len())
            .map(|i| (world.batch.nodes[i].global, world.force_on(i).map(|f| (f + 0.0).to_bits())))
            .filter(|(_, f)| *f != [0; 3])
            .collect();
        bits.sort_unstable();
        (bits, vote.pairs, ContactVote { pairs: 0, ..vote })
    };
    let (short, long) = (result(0.0), result(3.0));
    assert!(long.1 > 2 * short.1, "{} and {} pairs", short.1, long.1);
    assert_eq!((short.0, short.2), (long.0, long.2));
}

#[test]
fn pairs_inside_the_zone_at_time_zero_are_left_alone() {
    // A slit half a gap wide inside one part: three elements, the middle one gone, its sides moved in.
    let mut mesh = block([3, 1, 1], 1.0);
    deform(&mut mesh, |p| {
        [
            if p[0] == 1.0 {
                1.475
            } else if p[0] == 2.0 {
                1.525
            } else {
                p[0]
            },
            p[1],
            p[2],
        ]
    });
    let alive = |e| e != 1;
    let surface = mechanics::contact::Surface::new(&mesh, &crate::world::materials(), &alive);
    let x = on_surface(&surface, &mesh.positions);
    let pairs = mechanics::contact::initial_pairs(&surface, &x, &settings(1, 0.1, 0.1));
    // Eight corners of the slit, each over the corner of three faces.
    assert_eq!(pairs.len(), 8 * 3, "{pairs:?}");
    assert!(pairs.iter().all(|&(_, _, d)| (d - 0.05).abs() < 1e-14));
    let mut world = World::new(&mesh, settings(1, 0.1, 0.1), &alive);
    let vote = world.forces(1.0);
    assert_eq!((vote.hits, vote.dt), (0, f64::INFINITY));
}

#[test]
fn edges_that_cross_without_a_node_in_a_zone_are_not_seen() {
    // Two bars on edge, along x and along y, that overlap where their edges cross: documented behaviour.
    let half = 0.5_f64.sqrt();
    let mut mesh = block([1, 1, 1], 1.0);
    deform(&mut mesh, |p| [2.0 * p[0] - 1.0, half * (p[1] - p[2]), half * (p[1] + p[2] - 2.0)]);
    let mut other = block([1, 1, 1], 1.0);
    deform(&mut other, |p| [half * (p[0] - p[2]), 2.0 * p[1] - 1.0, half * (p[0] + p[2]) - 0.05]);
    let first = mesh.positions.len() as u32;
    other.parts[0].nodes.iter_mut().for_each(|n| *n += first);
    mesh.positions.extend(other.positions);
    mesh.node_ids.extend(other.node_ids);
    mesh.parts.extend(other.parts);
    let mut world = World::new(&mesh, without_self(settings(2, 0.1, 0.1)), &|_| true);
    assert_eq!(world.forces(1.0).hits, 0);
    assert!(world.batch.is_sound(2) && !world.batch.is_sound(1));
}

/// A probe over a face of a block of one element, where friction sticks; the node's spring at a depth of half a gap pushes with 0.025.
fn with_sticking_probe() -> (World, usize) {
    let (mut world, probe) = with_probe(block([1, 1, 1], 1.0), 0.1, &|_| true);
    world.place(probe, [0.4, 0.55, 1.05]);
    world.settings.friction.fill(0.3);
    world.settings.sticks = true;
    world.contact = Contact::new(&world.batch, &world.settings, &world.x, Width::best());
    (world, probe)
}

#[test]
fn where_friction_sticks_a_push_is_damped_and_never_pulls() {
    let (mut world, probe) = with_sticking_probe();
    let (dt, k, gap) = (1e-3, 0.5, 0.1);
    for depth in [1e-5, 0.05] {
        world.place(probe, [0.4, 0.55, 1.1 - depth]);
        let spring = k * depth;
        let mut normal = |velocity: f64| {
            world.v[2][probe] = velocity;
            let vote = world.forces(dt);
            assert_eq!(totals(&world).0, [0.0; 3], "node and corners add to nothing, to the bit");
            (world.force_on(probe)[2], vote.friction)
        };
        let (at_rest, none) = normal(0.0);
        assert!((at_rest - spring).abs() < 1e-14 && none == 0.0, "{at_rest} {none}");
        // Slowly, against what closes and what parts; the masses are 1, the weights a little off a quarter.
        let ([closing, taken], [parting, as_much]) = (normal(-1e-6).into(), normal(1e-6).into());
        let drag: f64 = closing - spring;
        assert!((drag / (0.6 * (k / 1.27_f64).sqrt() * 1e-6) - 1.0).abs() < 0.02, "{drag:e}");
        assert!((drag - (spring - parting)).abs() < 1e-14, "{drag:e} {parting}");
        assert!((taken - drag * 1e-6 * dt).abs() < 1e-14 && (as_much - taken).abs() < 1e-14, "{taken:e}");
        // As fast as may be: a fifth of the spring's force, and of that of a five thousandth of the gap where it is deeper.
        let limit = 0.2 * k * depth.min(2e-4 * gap);
        for velocity in [-1.0_f64, 1.0] {
            let (limited, taken) = normal(velocity);
            assert!((limited - (spring - limit.copysign(velocity))).abs() < 1e-14, "{velocity}: {limited}");
            assert!((taken - limit * dt).abs() < 1e-14, "{velocity}: {taken}");
        }
    }
}

#[test]
fn friction_that_creeps_and_contact_without_friction_have_no_damper() {
    for friction in [0.0, 0.3] {
        let (mut world, probe) = with_sticking_probe();
        world.settings.friction.fill(friction);
        world.settings.sticks = friction == 0.0;
        world.contact = Contact::new(&world.batch, &world.settings, &world.x, Width::best());
        let still = world.forces(1e-3);
        let force = world.force_on(probe);
        world.v[2][probe] = -5.0;
        assert_eq!((world.forces(1e-3), world.force_on(probe)), (still, force));
    }
}
