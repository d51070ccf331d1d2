//! The forces of a batch against one pair at a time, over all candidates.

use super::*;
use crate::{
    contact::{
        BatchEdge, BatchFace, BatchNode, BatchUnit, Contact, ContactVote, Cut, History, PairEnergies, Share,
    },
    exact::Quantum,
};

/// A random number from 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A bumpy patch of 6 x 6 faces of part 0, flat here and there, and 400 nodes of part 1 about it, some of
/// them on it.
fn patch(random: &mut Random, bump: f64) -> (Batch, [Vec<f64>; 3]) {
    let (mut batch, mut x) = (Batch::default(), [vec![], vec![], vec![]]);
    let mut put = |p: [f64; 3], part: u32, random: &mut Random| {
        batch.nodes.push(BatchNode {
            global: batch.nodes.len() as u32,
            part,
            mass: 1.0 + random.next(),
            stiffness: 1.0 + random.next(),
            share: 0.25 + 0.75 * random.next(),
        });
        (0..3).for_each(|a| x[a].push(p[a]));
    };
    for i in 0..49 {
        let (column, row) = (f64::from(i % 7), f64::from(i / 7));
        let height = if i % 7 < 3 { 0.0 } else { bump * random.next() };
        put([column, row, height], 0, random);
    }
    for i in 0..400 {
        let p = [7.0 * random.next() - 0.5, 7.0 * random.next() - 0.5, 2.0 * random.next() - 0.5];
        let p = match i % 8 {
            0 => [p[0].round(), p[1], p[2]],
            1 => [p[0].round(), p[1].round(), 0.1],
            2 => [p[0], p[1], 0.0],
            _ => p,
        };
        put(p, 1, random);
    }
    for i in 0..36_u32 {
        let first = i / 6 * 7 + i % 6;
        batch.faces.push(BatchFace {
            nodes: [first, first + 1, first + 8, first + 7],
            id: i,
            part: 0,
            stiffness: 1.0 + random.next(),
            corners: [u32::MAX; crate::mesh::MAX_NODES],
        });
    }
    batch.units.push(BatchUnit { nodes: (49..449).collect(), faces: (0..36).collect() });
    (batch, x)
}

fn settings(friction: f64) -> Settings {
    Settings {
        gap: 0.3,
        slack: 0.1,
        friction: vec![friction; 4],
        interacts: vec![false, true, true, false],
        stiffness: 0.5,
        friction_velocity: 1e-3,
        // Some springs are as stiff as masses allow, some as moduli ask for.
        steps: vec![0.5, 0.3],
        ..Settings::default()
    }
}

/// The same one pair at a time: a frame for each face, the whole reduction for each node.
fn slowly(contact: &NodeFace, cycle: Cycle<'_>) -> ContactVote {
    let warning = WARNING * contact.settings.gap;
    let at = |n: u32| cycle.x.each_ref().map(|x| x[n as usize]);
    let frame = |f: u32| Frame::new(&contact.faces[f as usize].map(at));
    let mut vote = ContactVote { pairs: contact.candidates.faces.len() as u64, ..ContactVote::default() };
    let (mut hits, mut beyond, mut frequency2) = (vec![], vec![], 0.0_f64);
    for (i, &node) in contact.candidates.nodes.iter().enumerate() {
        let (n, p) = (node as usize, at(node));
        let mut near = Vec::new();
        let range = contact.candidates.starts[i] as usize..contact.candidates.starts[i + 1] as usize;
        for &face in &contact.candidates.faces[range] {
            let nearest = frame(face).nearest(p);
            let bounds = search::Bounds::of(&contact.faces[face as usize].map(at), warning);
            if bounds.holds(p) && nearest.distance2 < warning * warning {
                let (id, corners) = (contact.ids[face as usize], contact.faces[face as usize]);
                near.push(Near { face, id, corners, nearest });
            }
        }
        joint::reduce(&mut near, contact.settings.gap, frame, &mut hits, &mut beyond);
        let stacking = if hits.len() > 1 { joint::stacking(&hits) } else { 1.0 };
        let of_hits = hits.iter().map(|hit| (hit.near, Some(hit)));
        for (of, hit) in of_hits.chain(beyond.iter().map(|&i| (i, None))) {
            let near = &near[of as usize];
            let (face, nodes) = (near.face as usize, contact.faces[near.face as usize]);
            let statics = &contact.statics;
            let k = statics.stiffness(n, face);
            let weights = frame(near.face).weights(&near.nearest, p);
            let of_corners = nodes.map(|n| statics.inverse_mass[n as usize]);
            let inverse_mass = force::inverse_mass(statics.inverse_mass[n], of_corners, &weights);
            let tangent = hit.map_or(1.0, |hit| contact.hardening.tangent_of_one(hit.depth));
            frequency2 = frequency2.max(force::frequency2(k * tangent, stacking, inverse_mass));
            let Some(hit) = hit else { continue };
            vote.hits += 1;
            vote.deepest(hit.depth / contact.settings.gap, (contact.global[n], near.id));
            let stiffness = k * hit.share;
            let spring = contact.hardening.spring_of_one(stiffness, hit.depth);
            let push = force::Push { stiffness, spring, direction: hit.direction, weights };
            let sliding = force::Sliding {
                coefficient: contact.settings.friction[0],
                regular: contact.settings.friction_velocity,
                velocity: against(cycle.v, n, &nodes, &weights),
                inverse_mass,
                dt: cycle.dt,
            };
            let sliding = (sliding.coefficient > 0.0).then_some(&sliding);
            let reaction = force::react(&push, sliding, (cycle.force_quantum, cycle.energy_quantum), 0);
            vote.count(&reaction);
            for a in 0..3 {
                cycle.f[a][n] += reaction.node[a];
                (0..4).for_each(|c| cycle.f[a][nodes[c] as usize] += reaction.corners[c][a]);
            }
        }
    }
    vote.dt = force::time_step(frequency2);
    vote
}

#[test]
fn lanes_of_every_width_have_the_bits_of_one_pair_at_a_time() {
    let mut random = Random(3);
    let mut long_way = 0;
    for (bump, friction) in [(0.0, 0.0), (0.2, 0.0), (0.9, 0.0), (0.0, 0.3), (0.9, 0.3)] {
        let (batch, x) = patch(&mut random, bump);
        let mut contact = Contact::new(&batch, &settings(friction), &x, Width::best());
        let v = [x[1].clone(), x[2].clone(), x[0].clone()];
        let quantum = Quantum::for_reference(1.0, 42);
        let mut run = |width: Option<Width>| {
            let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
            let cycle = Cycle {
                x: &x,
                v: &v,
                dt: 0.1,
                force_quantum: quantum,
                energy_quantum: quantum,
                f: &mut f,
                history: &mut History::default(),
            };
            let vote = match width {
                Some(width) => {
                    contact.kinds.faces.width = width;
                    contact.forces(&x, &v, 0.1, quantum, quantum, cycle.f)
                }
                None => slowly(&contact.kinds.faces, cycle),
            };
            (vote, f.iter().flatten().map(|f| f.to_bits()).collect::<Vec<u64>>())
        };
        let slow = run(None);
        assert!(slow.0.hits > 80, "{:?}", slow.0);
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            assert_eq!(run(Some(width)), slow, "{width}, bump {bump}, friction {friction}");
        }
        long_way += usize::from(!contact.kinds.faces.work.hits.is_empty());
    }
    assert!(long_way > 0, "no node went the long way");
}

#[test]
fn watching_few_pairs_for_several_cycles_loses_no_bit_of_bodies_that_move() {
    let mut random = Random(11);
    let (batch, mut x) = patch(&mut random, 0.4);
    let mut settings = settings(0.0);
    settings.slack = 3.0;
    let mut contact = Contact::new(&batch, &settings, &x, Width::best());
    let quantum = Quantum::for_reference(1.0, 42);
    // A common motion, a slide of the nodes over the patch, and noise, in all about an eighth of the spread.
    // The first list is taken with the candidates.
    let (mut taken, mut fewest, mut hits) = (1, usize::MAX, Vec::new());
    for cycle in 0..40 {
        let before = contact.kinds.faces.watch.taken_at(0);
        let mut run = |fast: bool| {
            let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
            let quanta = (quantum, quantum);
            let vote = if fast {
                contact.forces(&x, &x, 0.1, quanta.0, quanta.1, &mut f)
            } else {
                let (force_quantum, energy_quantum) = quanta;
                let history = &mut History::default();
                slowly(
                    &contact.kinds.faces,
                    Cycle { x: &x, v: &x, dt: 0.1, force_quantum, energy_quantum, f: &mut f, history },
                )
            };
            (vote, f.iter().flatten().map(|f| f.to_bits()).collect::<Vec<u64>>())
        };
        let (fast, slow) = (run(true), run(false));
        assert_eq!(fast, slow, "cycle {cycle}");
        hits.push(slow.0.hits);
        taken += u32::from(contact.kinds.faces.watch.taken_at(0) != before);
        fewest = fewest.min(contact.kinds.faces.watch.candidates.faces.len());
        for (i, node) in batch.nodes.iter().enumerate() {
            let slide = f64::from(node.part);
            x[0][i] += 0.3 + 0.06 * slide + 0.01 * random.next();
            x[1][i] += 0.01 * random.next();
            x[2][i] -= 0.02 * slide + 0.01 * random.next();
        }
    }
    assert!((4..20).contains(&taken), "{taken} lists in 40 cycles");
    let all = contact.kinds.faces.candidates.faces.len();
    assert!(4 * fewest < 3 * all, "{fewest} of {all} pairs");
    assert!(hits.iter().any(|&n| n != hits[0]), "nothing changed: {hits:?}");
}

/// A patch whose nodes are in units of fifty, with edges on it that others cross.
fn patch_in_units(random: &mut Random) -> (Batch, [Vec<f64>; 3]) {
    let (mut batch, x) = patch(random, 0.4);
    let faces = batch.units[0].faces.clone();
    batch.units = (49..449)
        .step_by(50)
        .map(|n| BatchUnit { nodes: (n..n + 50).collect(), faces: faces.clone() })
        .collect();
    let edge = |nodes: [u32; 2], part: u32| BatchEdge { nodes, part, stiffness: 1.0, share: 0.5 };
    let edges = &mut batch.listed.edges;
    edges.edges.extend((0..40).map(|i| edge([i, i + 7], 0)));
    edges.edges.extend((0..199).map(|i| edge([49 + 2 * i, 50 + 2 * i], 1)));
    edges.pairs.extend((0..40).flat_map(|a| (40..239).map(move |b| [a, b])));
    (batch, x)
}

#[test]
fn a_batch_in_any_number_of_shares_has_the_forces_and_votes_of_the_whole() {
    let (batch, x) = patch_in_units(&mut Random(5));
    let v = [x[1].clone(), x[2].clone(), x[0].clone()];
    let quantum = Quantum::for_reference(1.0, 42);
    for friction in [0.0, 0.3] {
        let run = |n: usize| {
            let cut = Cut::into(&batch, n);
            let (mut vote, mut energies) = (ContactVote::default(), PairEnergies::default());
            let mut sum = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
            let mut n_nodes = 0;
            for i in 0..cut.len() {
                let Share { batch, nodes } = cut.share(&batch, i);
                assert!(batch.is_sound(2));
                let own = |all: &[Vec<f64>; 3]| {
                    all.each_ref().map(|all| nodes.iter().map(|&node| all[node as usize]).collect::<Vec<_>>())
                };
                let (x, v, mut f) = (own(&x), own(&v), [0; 3].map(|_| vec![0.0; nodes.len()]));
                let mut contact = Contact::new(&batch, &settings(friction), &x, Width::best());
                vote.merge(&contact.forces(&x, &v, 0.1, quantum, quantum, &mut f));
                energies.merge(contact.energies());
                for (sum, f) in sum.iter_mut().zip(&f) {
                    nodes.iter().zip(f).for_each(|(&node, f)| sum[node as usize] += f);
                }
                n_nodes += nodes.len();
            }
            let bits: Vec<u64> = sum.iter().flatten().map(|f| f.to_bits()).collect();
            ((vote, energies, bits), n_nodes)
        };
        let (whole, n_nodes) = run(1);
        assert!(whole.0.hits > 100 && n_nodes == batch.nodes.len(), "{:?}", whole.0);
        for n in [2, 3, 8, 11] {
            let (shares, with_copies) = run(n);
            assert!(shares == whole, "{n} shares, friction {friction}: {:?} {:?}", shares.0, whole.0);
            assert!(with_copies > n_nodes, "no node is in two of {n} shares");
        }
    }
}
