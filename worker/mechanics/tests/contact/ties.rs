//! Nodes tied to faces: what a tie is, what it does, and that no cut changes a bit of it.

use mechanics::{
    contact::{
        Batch, Contact, ContactVote, Exclusions, Kind, Limit, Settings, Surface, Tie, WorkUnit, on_faces,
        sort, strengthen, tie,
    },
    exact::Quantum,
    lanes::Width,
    mesh::Mesh,
};

use crate::world::{Random, World, add_block, materials, on_surface, settings, totals};

/// A block of small cubes on one of large ones that do not match: the nodes of its lower side lie on the upper faces of the other.
fn stacked() -> Mesh {
    let mut mesh = Mesh::default();
    add_block(&mut mesh, [3, 3, 2], [0.0; 3], 1.0);
    add_block(&mut mesh, [4, 4, 2], [0.3, 0.2, 2.0], 0.6);
    mesh
}

fn tied(mesh: &Mesh) -> Vec<Tie> {
    let surface = Surface::new(mesh, &materials(), &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    let mut near = Settings { gap: 1e-3, ..Settings::default() };
    near.interacts = vec![false, true, true, false];
    tie(&surface, &on_faces(&surface, &x, &near, [1, 0]))
}

/// Nothing meets; the blocks are tied.
fn only_ties(mesh: &Mesh) -> Settings {
    let mut settings = Settings { ties: tied(mesh), ..settings(2, 0.1, 1.0) };
    settings.interacts.fill(false);
    settings
}

/// The same, of ties that break at these.
fn bonded(mesh: &Mesh, limits: [Option<Limit>; 2]) -> Settings {
    let surface = Surface::new(mesh, &materials(), &|_| true);
    let x = on_surface(&surface, &mesh.positions);
    let mut near = Settings { gap: 1e-3, ..Settings::default() };
    near.interacts = vec![false, true, true, false];
    let found = on_faces(&surface, &x, &near, [1, 0]);
    let mut ties = tie(&surface, &found);
    strengthen(&mut ties, &surface, &x, &found, &|_| limits);
    let mut settings = Settings { ties, ties_break: true, ..settings(2, 0.1, 1.0) };
    settings.interacts.fill(false);
    settings
}

#[test]
fn what_a_tie_bears_is_its_strength_on_the_area_behind_its_node() {
    let mesh = stacked();
    let ties = bonded(&mesh, [Some(Limit::Stress(2.0)), Some(Limit::Force(5.0))]).ties;
    let mut areas: Vec<f64> = ties.iter().map(|tie| tie.bond.expect("it breaks").pull / 2.0).collect();
    areas.sort_by(f64::total_cmp);
    // Four corners, twelve nodes on edges, nine inside, of faces of 0.36.
    for (area, expected) in areas.iter().zip([[0.09; 4].as_slice(), &[0.18; 12], &[0.36; 9]].concat()) {
        assert!((area - expected).abs() < 1e-12, "{areas:?}");
    }
    assert!(ties.iter().all(|tie| tie.bond.is_some_and(|bond| bond.shear == 5.0 && bond.side == 1.0)));
    let pulled = bonded(&mesh, [Some(Limit::Force(5.0)), None]).ties;
    assert!(pulled.iter().all(|tie| tie.bond.is_some_and(|bond| bond.shear == f64::INFINITY)));
    assert!(bonded(&mesh, [None, None]).ties.iter().all(|tie| tie.bond.is_none()));
}

#[test]
fn a_tie_breaks_above_its_strength_and_never_holds_again() {
    let mesh = stacked();
    let settings = bonded(&mesh, [Some(Limit::Force(0.01)), Some(Limit::Force(0.02))]);
    let mut world = World::new(&mesh, settings, &|_| true);
    let Tie { node, stiffness, .. } = world.settings.ties[12];
    let n = world.index(node);
    let start = [0, 1, 2].map(|a| world.x[a][n]);
    // Before anything is known of it a node is free.
    assert_eq!(world.forces(0.0).energy, 0.0);
    let all: Vec<usize> = world.settings.ties.iter().map(|tie| world.index(tie.node)).collect();
    let hold = |world: &mut World| {
        all.iter().for_each(|&n| world.contact.history.before_mut(n)[0] = 1.0);
    };
    hold(&mut world);
    for (way, strength) in [([0.0, 0.0, 1.0], 0.01), ([0.6, -0.8, 0.0], 0.02)] {
        for (share, holds) in [(0.999, true), (1.001, false)] {
            hold(&mut world);
            let by = share * strength / stiffness;
            world.place(n, [0, 1, 2].map(|a| by.mul_add(way[a], start[a])));
            // It came half of the way in the last step.
            let dt = 0.1;
            (0..3).for_each(|a| world.v[a][n] = 0.5 * by * way[a] / dt);
            let vote = world.forces(dt);
            let held = 0.5 * stiffness * by * by;
            let (energy, friction) = if holds { (held, 0.0) } else { (0.0, 0.5 * held) };
            assert!(
                (vote.energy - energy).abs() < 1e-12 && (vote.friction - friction).abs() < 1e-12,
                "{vote:?}"
            );
            assert_eq!(world.contact.history.after(n)[0], f64::from(u8::from(holds)));
            let force = world.force_on(n);
            for a in 0..3 {
                let expected = if holds { -share * strength * way[a] } else { 0.0 };
                assert!((force[a] - expected).abs() < 1e-9, "{force:?}");
            }
        }
    }
    // Pressed it holds, whatever the force; broken it stays.
    hold(&mut world);
    world.place(n, [start[0], start[1], start[2] - 100.0 * 0.01 / stiffness]);
    assert!(world.forces(0.0).energy > 0.0);
    world.contact.history.before_mut(n)[0] = 0.0;
    world.place(n, [start[0], start[1], start[2] + 0.5 * 0.01 / stiffness]);
    let vote = world.forces(0.0);
    assert!(vote.energy < 1e-20 && vote.friction == 0.0 && world.force_on(n) == [0.0; 3], "{vote:?}");
}

#[test]
fn every_node_on_a_face_is_tied_where_it_lies() {
    let mesh = stacked();
    let ties = tied(&mesh);
    assert_eq!(ties.len(), 25);
    let surface = Surface::new(&mesh, &materials(), &|_| true);
    for tie in &ties {
        let face = &surface.faces[surface.face_index(tie.face).expect("it is outside") as usize];
        for a in 0..3 {
            let corner = |i: usize| mesh.positions[surface.nodes[face.nodes[i] as usize] as usize][a];
            let at: f64 = (0..4).map(|i| tie.weights[i] * corner(i)).sum();
            assert!((at - mesh.positions[tie.node as usize][a]).abs() < 1e-14);
        }
        assert_eq!((tie.parts, tie.load[0]), ([1, 0], tie.stiffness));
        assert!(tie.load[1..].iter().zip(tie.weights).all(|(load, w)| *load >= tie.stiffness * w));
    }
}

#[test]
fn a_tie_pulls_in_any_direction_and_keeps_momentum_angular_momentum_and_energy() {
    let mesh = stacked();
    let mut world = World::new(&mesh, only_ties(&mesh), &|_| true);
    assert_eq!(world.contact.n_pairs(), 25);
    let at_start = world.forces(0.0);
    // Rounding of weights is all that is left.
    assert!(at_start.energy < 1e-25 && world.f.iter().flatten().all(|f| f.abs() < 1e-13), "{at_start:?}");
    let mut random = Random(7);
    let start = world.x.clone();
    for _ in 0..20 {
        for n in 0..world.batch.nodes.len() {
            let p = [0, 1, 2].map(|a| start[a][n] + 0.2 * (random.next() - 0.5));
            world.place(n, p);
        }
        let vote = world.forces(0.0);
        let (force, moment) = totals(&world);
        assert_eq!(force, [0.0; 3], "to the bit");
        assert!(moment.iter().all(|m| m.abs() < 1e-12), "{moment:?}");
        assert!(vote.energy > 1e-3);
        // Forces are the slope of the energy.
        let f = world.f.clone();
        let (n, a) = ((random.next() * world.batch.nodes.len() as f64) as usize, 2);
        let (by, x) = (1e-5, world.x[a][n]);
        let mut energy = |moved: f64| {
            world.x[a][n] = x + moved;
            world.forces(0.0).energy
        };
        let slope = (energy(by) - energy(-by)) / (2.0 * by);
        assert!((f[a][n] + slope).abs() < 1e-8, "{} for {slope}", f[a][n]);
    }
}

#[test]
fn the_vote_is_the_bound_by_row_sums_and_the_step_is_stable_without_elements() {
    let mesh = stacked();
    let mut world = World::new(&mesh, only_ties(&mesh), &|_| true);
    let dt = world.forces(0.0).dt;
    // All masses are 1: omega dt = 1 of the greatest 2 sum k w.
    let greatest = world.settings.ties.iter().flat_map(|tie| tie.load).fold(0.0, f64::max);
    assert!((dt - 1.0 / (2.0 * greatest).sqrt()).abs() < 1e-14 * dt, "{dt}");
    // Twice the step is the limit of the bound; at 1.9 the energy of a shake stays what it is.
    let mut random = Random(3);
    let n = world.batch.nodes.len();
    (0..3).for_each(|a| (0..n).for_each(|i| world.v[a][i] = 1e-3 * (random.next() - 0.5)));
    let step = 1.9 * dt;
    let mut most = 0.0_f64;
    for _ in 0..20_000 {
        let energy = world.forces(0.0).energy;
        most = most.max(energy);
        for a in 0..3 {
            for i in 0..n {
                world.v[a][i] += step * world.f[a][i];
                world.x[a][i] += step * world.v[a][i];
            }
        }
    }
    assert!(most < 1e-4, "{most}");
}

#[test]
fn any_split_into_batches_gives_the_same_bits_and_a_lost_face_lets_go() {
    let mesh = stacked();
    let settings = only_ties(&mesh);
    let run = |n: usize, alive: &dyn Fn(u32) -> bool| {
        let surface = Surface::new(&mesh, &materials(), alive);
        let x = on_surface(&surface, &mesh.positions);
        let units = sort(&surface, &x, &settings, &Exclusions::default());
        assert!(units.iter().all(|unit| unit.kind == Kind::Tied));
        let quantum = Quantum::for_reference(1.0, 42);
        let mut total = vec![[0.0; 3]; mesh.n_nodes()];
        let mut merged = ContactVote::default();
        for worker in 0..n {
            let mine: Vec<&WorkUnit> = units.iter().skip(worker).step_by(n).collect();
            let batch = Batch::gather(&surface, &mine, &|n| 1.0 + f64::from(n % 3), &Exclusions::default());
            assert!(batch.is_sound(2));
            let shaken = |node: u32, a: usize| {
                mesh.positions[node as usize][a] + 0.01 * f64::from((node * 7 + a as u32) % 5)
            };
            let x = [0, 1, 2].map(|a| batch.nodes.iter().map(|n| shaken(n.global, a)).collect::<Vec<f64>>());
            let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
            let mut contact = Contact::new(&batch, &settings, &x, Width::best());
            merged.merge(&contact.forces(&x, &x, 0.01, quantum, quantum, &mut f));
            for (i, node) in batch.nodes.iter().enumerate() {
                (0..3).for_each(|a| total[node.global as usize][a] += f[a][i]);
            }
        }
        (total.iter().flatten().map(|f| f.to_bits()).collect::<Vec<u64>>(), merged)
    };
    let one = run(1, &|_| true);
    assert_eq!(one.1.pairs, 25);
    assert_eq!(run(2, &|_| true), one);
    assert_eq!(run(5, &|_| true), one);
    // The element below the first tied nodes goes.
    let less = run(2, &|element| element != 9);
    assert!((10..25).contains(&less.1.pairs), "{:?}", less.1);
    assert_eq!(run(1, &|element| element != 9), less);
}
