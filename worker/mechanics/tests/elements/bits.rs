//! Equality to the bit: lane widths, topologies, cuts, the order of sets, states.

use mechanics::{
    block::Block,
    element::{
        ElementVote, Fault,
        hourglass::{Hourglass, Kind},
    },
    lanes::Width,
    material::{Failure, Material},
    mesh::{Part, Topology},
    piece::Piece,
    state::{N_FIELDS, field},
};

use crate::bodies::*;

/// Everything a block says, as bits: forces of its nodes, its image, and a vote.
fn bits(block: &Block, vote: &ElementVote) -> Vec<u64> {
    let piece = block.piece();
    let n = block.nodes.len();
    let forces = block.f.iter().flat_map(|f| &f[..n]).copied();
    let nodes = piece.x.iter().chain(&piece.v).flatten().copied();
    let votes = [
        vote.courant,
        f64::from(vote.courant_element),
        vote.volume_limit,
        vote.internal,
        vote.hourglass,
        vote.viscosity,
        vote.force_bound,
    ];
    let fields = piece.fields.iter().chain(&piece.own).chain(&piece.history).flatten().copied();
    let all = forces.chain(nodes).chain(fields).chain(votes);
    all.map(f64::to_bits).collect()
}

/// Three cycles, the nodes free.
fn three_cycles(piece: &Piece, material: &Material, width: Width) -> Vec<u64> {
    let mut block = Block::new(piece);
    let step = full_step(2e-7);
    let mut all = Vec::new();
    for _ in 0..3 {
        advance(&mut block, step.dt);
        let vote = compute(&mut block, material, &step, width);
        assert!(vote.fault.is_none(), "{:?}", vote.fault);
        assert!(vote.courant.is_finite() && vote.courant > 1e-7, "{}", vote.courant);
        all.extend(bits(&block, &vote));
        kick(&mut block, step.dt);
    }
    all
}

/// The same elements and nodes with their corners written out.
fn written_out(piece: &Piece) -> Piece {
    let part = Part {
        name: "written out".into(),
        material: 0,
        topology: piece.topology.clone(),
        nodes: (0..piece.nodes.len() as u32).collect(),
        element_ids: Vec::new(),
        hourglass: Hourglass::VISCOUS,
    };
    let hexahedra = (0..part.n_elements()).map(|element| part.corners(element)).collect();
    Piece { topology: Topology::Explicit { hexahedra }, ..piece.clone() }
}

/// Every law there is.
fn with_gases() -> Vec<Material> {
    all_laws().into_iter().chain(gases()).collect()
}

/// Every kind of hourglass control.
fn controls() -> [Hourglass; 3] {
    Kind::ALL.map(|kind| Hourglass { kind, coefficient: kind.usual() })
}

/// Every law under every kind that it can have, with a seed for each law.
fn by_control(first: u64) -> impl Iterator<Item = (u64, (Material, Hourglass))> {
    let laws = (first..).zip(with_gases());
    laws.flat_map(|(seed, material)| {
        controls().map(|control| (seed, (material.clone(), control.on(&material))))
    })
}

/// A stirred body whose hourglass forces, if it keeps such, are stirred too.
fn with_forces(piece: Piece, hourglass: Hourglass, seed: u64) -> Piece {
    let mut piece = controlled(piece, hourglass);
    let mut draws = Draws(seed.wrapping_mul(77) | 1);
    piece.own.iter_mut().flatten().for_each(|force| *force = 1e4 * draws.next());
    piece
}

const SHAPES: [[u32; 3]; 6] = [[7, 5, 3], [1, 1, 3], [8, 2, 2], [3, 1, 1], [2, 9, 1], [19, 2, 2]];

#[test]
fn every_width_and_both_topologies_give_the_same_bits_for_every_law_and_hourglass_control() {
    for (seed, (material, control)) in by_control(1) {
        for shape in SHAPES {
            let piece = with_forces(stirred(&material, shape, seed), control, seed);
            let reference = three_cycles(&piece, &material, Width::Scalar);
            for width in Width::ALL {
                if let Err(error) = width.require() {
                    println!("not compared: {error}");
                    continue;
                }
                let name = format!("{width}, {shape:?}, {control:?}, {material:?}");
                assert!(three_cycles(&piece, &material, width) == reference, "{name}");
                let explicit = written_out(&piece);
                assert!(three_cycles(&explicit, &material, width) == reference, "explicit, {name}");
            }
        }
    }
}

#[test]
fn bent_elements_that_heat_has_softened_yield_alike_on_every_width() {
    let material = all_laws().swap_remove(7);
    assert!(matches!(material.strength, mechanics::material::Strength::JohnsonCook { .. }));
    for control in controls().into_iter().filter(Hourglass::is_elastic) {
        for seed in 1..20 {
            let mut piece = with_forces(stirred(&material, [7, 5, 3], seed), control, seed);
            let mut draws = Draws(seed);
            for element in 0..piece.elements.len() {
                piece.fields[field::PLASTIC_STRAIN][element] = 0.0;
                piece.fields[field::TEMPERATURE][element] = 1000.0 + 1600.0 * draws.next();
                // Few pass the yield stress when cold.
                let share = (draws.next() + 0.5).powi(6);
                piece.own.iter_mut().for_each(|forces| forces[element] *= share);
            }
            let reference = three_cycles(&piece, &material, Width::Scalar);
            for width in Width::ALL.into_iter().filter(|width| width.available()) {
                assert!(three_cycles(&piece, &material, width) == reference, "{width}, {control:?}");
            }
        }
    }
}

/// An explicit piece with its nodes numbered from the end: no corner of a slot is the next node of the last.
fn numbered_backwards(piece: &Piece) -> Piece {
    let last = piece.nodes.len() as u32 - 1;
    let Topology::Explicit { hexahedra } = &piece.topology else { panic!("explicit pieces only") };
    Piece {
        topology: Topology::Explicit {
            hexahedra: hexahedra.iter().map(|corners| corners.map(|node| last - node)).collect(),
        },
        nodes: piece.nodes.iter().rev().copied().collect(),
        x: piece.x.iter().rev().copied().collect(),
        v: piece.v.iter().rev().copied().collect(),
        mass: piece.mass.iter().rev().copied().collect(),
        constraint: piece.constraint.iter().rev().copied().collect(),
        ..piece.clone()
    }
}

#[test]
fn runs_of_nodes_in_any_direction_of_the_elements_have_the_bits_of_lists() {
    // Names of corners turned about the diagonal from 0 to 6: nodes then run along J and K of the elements.
    const TURNED: [usize; 8] = [0, 4, 5, 1, 3, 7, 6, 2];
    let material = &all_laws()[7];
    let mut piece = written_out(&stirred(material, [21, 3, 2], 79));
    for _ in 0..3 {
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            let step = full_step(2e-7);
            let (mut runs, mut lists) = (Block::new(&piece), Block::new(&numbered_backwards(&piece)));
            let votes = [&mut runs, &mut lists].map(|block| compute(block, material, &step, width));
            assert_eq!(votes[0], votes[1], "{width}");
            assert!(votes[0].fault.is_none(), "{:?}", votes[0].fault);
            let n = piece.nodes.len();
            for node in 0..n {
                let pair = [force(&runs, node), force(&lists, n - 1 - node)];
                assert_eq!(pair[0].map(f64::to_bits), pair[1].map(f64::to_bits), "{width}, node {node}");
            }
            assert!(runs.piece().fields == lists.piece().fields, "{width}");
        }
        let Topology::Explicit { hexahedra } = &mut piece.topology else { panic!("written out") };
        hexahedra.iter_mut().for_each(|corners| *corners = TURNED.map(|corner| corners[corner]));
    }
}

#[test]
fn stirred_bodies_yield_in_part() {
    for material in all_laws().iter().filter(|m| m.initial_temperature() > 0.0) {
        let piece = stirred(material, [7, 5, 3], 5);
        let mut block = Block::new(&piece);
        compute(&mut block, material, &full_step(2e-7), Width::best());
        let flowed =
            |e: usize| block.field(e, field::PLASTIC_STRAIN) > piece.fields[field::PLASTIC_STRAIN][e];
        let n = (0..105).filter(|&e| flowed(e)).count();
        assert!((10..95).contains(&n), "{n} of 105 flow");
    }
}

#[test]
fn stirred_bodies_are_whole_failed_unlit_burning_and_burnt_in_part() {
    for material in with_gases() {
        let failing = material.failure != Failure::None || !material.history().is_empty();
        let burning = material.detonation_speed().is_some();
        let piece = stirred(&material, [7, 5, 3], 5);
        let count = |field: usize, low: f64, high: f64| {
            piece.fields[field].iter().filter(|&&x| (low..high).contains(&x)).count()
        };
        if failing {
            let (whole, failed) = (count(field::DAMAGE, 0.0, 0.001), count(field::DAMAGE, 1.0, 2.0));
            assert!(whole > 10 && failed > 10 && whole + failed < 95, "{whole} {failed}");
        }
        if burning {
            let (unlit, burnt) =
                (count(field::TIME_TO_LIGHT, 3e-7, 1.0), count(field::TIME_TO_LIGHT, -1.0, -3.7e-6));
            assert!(unlit > 10 && burnt > 5 && unlit + burnt < 95, "{unlit} {burnt}");
        }
        let mut block = Block::new(&piece);
        compute(&mut block, &material, &full_step(2e-7), Width::best());
        let changed = |field: usize| (0..105).any(|e| block.field(e, field) != piece.fields[field][e]);
        assert_eq!(changed(field::TIME_TO_LIGHT), burning);
        assert!(failing || !changed(field::DAMAGE));
    }
}

/// The elements of a structured piece with I index below or not below `cut`, as a piece of its own.
fn half(piece: &Piece, cut: u32, low: bool) -> Piece {
    let Topology::Structured { cells: [ni, nj, nk] } = piece.topology else {
        panic!("structured pieces only")
    };
    let (from, to) = if low { (0, cut) } else { (cut, ni) };
    let grid = |n: [u32; 3], from: u32, to: u32| -> Vec<usize> {
        let rows = 0..n[1] * n[2];
        rows.flat_map(|row| (from..to).map(move |i| (i + row * n[0]) as usize)).collect()
    };
    let nodes = grid([ni + 1, nj + 1, nk + 1], from, to + 1);
    let elements = grid([ni, nj, nk], from, to);
    let by_element = |values: &[f64]| elements.iter().map(|&e| values[e]).collect::<Vec<f64>>();
    Piece {
        topology: Topology::Structured { cells: [to - from, nj, nk] },
        nodes: nodes.iter().map(|&n| piece.nodes[n]).collect(),
        elements: elements.iter().map(|&e| piece.elements[e]).collect(),
        x: nodes.iter().map(|&n| piece.x[n]).collect(),
        v: nodes.iter().map(|&n| piece.v[n]).collect(),
        mass: nodes.iter().map(|&n| piece.mass[n]).collect(),
        constraint: nodes.iter().map(|&n| piece.constraint[n]).collect(),
        initial_volume: by_element(&piece.initial_volume),
        fields: std::array::from_fn(|field| by_element(&piece.fields[field])),
        own: piece.own.iter().map(|values| by_element(values)).collect(),
        erosion: None,
        history: piece.history.iter().map(|column| by_element(column)).collect(),
        contact: Vec::new(),
        shells: piece.shells.clone(),
        ..*piece
    }
}

#[test]
fn two_halves_add_to_the_whole() {
    for (seed, (material, control)) in by_control(11) {
        let piece = with_forces(stirred(&material, [9, 4, 3], seed), control, seed);
        let step = full_step(2e-7);
        let mut whole = Block::new(&piece);
        let vote = compute(&mut whole, &material, &step, Width::best());
        let mut halves = [true, false].map(|low| Block::new(&half(&piece, 4, low)));
        let mut joined = ElementVote::default();
        let mut forces = vec![[0.0; 3]; piece.nodes.len()];
        let image = whole.piece();
        for block in &mut halves {
            joined.merge(&compute(block, &material, &step, Width::best()));
            for (local, &node) in block.nodes.iter().enumerate() {
                for (sum, f) in forces[node as usize].iter_mut().zip(force(block, local)) {
                    *sum += f;
                }
            }
            let part = block.piece();
            for field in 0..N_FIELDS {
                for (value, &element) in part.fields[field].iter().zip(&part.elements) {
                    assert_eq!(value.to_bits(), image.fields[field][element as usize].to_bits());
                }
            }
            for (values, whole) in part.own.iter().zip(&image.own) {
                for (value, &element) in values.iter().zip(&part.elements) {
                    assert_eq!(value.to_bits(), whole[element as usize].to_bits());
                }
            }
        }
        assert_eq!(joined, vote);
        for (node, sum) in forces.iter().enumerate() {
            assert_eq!(sum.map(f64::to_bits), force(&whole, node).map(f64::to_bits), "node {node}");
        }
    }
}

#[test]
fn the_order_and_grouping_of_sets_do_not_show() {
    let material = &all_laws()[7];
    let assumed = Hourglass { kind: Kind::AssumedStrain, coefficient: 1.0 };
    let piece = with_forces(stirred(material, [7, 5, 3], 77), assumed, 77);
    let step = full_step(2e-7);
    let mut forward = Block::new(&piece);
    let vote = compute(&mut forward, material, &step, Width::best());
    let mut backward = Block::new(&piece);
    let mut joined = ElementVote::default();
    for set in (0..backward.n_sets()).rev() {
        let alone = set..set + 1;
        backward.compute(material, std::slice::from_ref(&alone), &step, Width::best(), &mut joined);
    }
    assert!(bits(&forward, &vote) == bits(&backward, &joined));
}

#[test]
fn border_sets_first_and_then_the_rest_make_the_whole() {
    let material = &all_laws()[5];
    let piece = stirred(material, [7, 5, 3], 78);
    let step = full_step(2e-7);
    let mut whole = Block::new(&piece);
    let vote = compute(&mut whole, material, &step, Width::best());

    let mut block = Block::new(&piece);
    let marked: Vec<bool> = (0..piece.nodes.len()).map(|node| node % 8 == 7).collect();
    let border = block.sets_touching(&marked);
    for set in 0..block.n_sets() {
        let peer_workers = (0..piece.elements.len()).filter(|&e| block.set_of_element(e) == set);
        let mut nodes = peer_workers.flat_map(|e| block.corners(e));
        assert_eq!(border[set as usize], nodes.any(|node| marked[node as usize]), "set {set}");
    }
    let mut joined = ElementVote::default();
    let ranges = |wanted: bool| -> Vec<std::ops::Range<u32>> {
        (0..border.len()).filter(|&s| border[s] == wanted).map(|s| s as u32..s as u32 + 1).collect()
    };
    block.compute(material, &ranges(true), &step, Width::best(), &mut joined);
    // The forces of the marked nodes are complete.
    for node in (0..marked.len()).filter(|&node| marked[node]) {
        assert_eq!(force(&block, node).map(f64::to_bits), force(&whole, node).map(f64::to_bits));
    }
    block.compute(material, &ranges(false), &step, Width::best(), &mut joined);
    assert!(bits(&whole, &vote) == bits(&block, &joined));
}

#[test]
fn an_image_returns_to_the_bit() {
    let piece = stirred(&all_laws()[6], [7, 5, 3], 3);
    assert_eq!(Block::new(&piece).piece(), piece);
    let explicit = written_out(&piece);
    assert_eq!(Block::new(&explicit).piece(), explicit);
    for piece in [piece, explicit] {
        assert_eq!(Block::of(piece.clone(), &[]).into_piece(), piece);
    }
}

#[test]
fn phantoms_and_padding_touch_nothing() {
    for material in with_gases() {
        for shape in SHAPES {
            let piece = stirred(&material, shape, 21);
            let step = full_step(2e-7);
            let mut clean = Block::new(&piece);
            let vote = compute(&mut clean, &material, &step, Width::best());
            let n = piece.nodes.len();
            let mut dirty = Block::new(&piece);
            for array in dirty.x.iter_mut().chain(&mut dirty.v) {
                array[n..].fill(f64::NAN);
            }
            let dirty_vote = compute(&mut dirty, &material, &step, Width::best());
            assert!(bits(&clean, &vote) == bits(&dirty, &dirty_vote), "{shape:?}");
            for f in &dirty.f {
                assert!(f[n..].iter().all(|f| f.to_bits() == 0), "{shape:?}");
            }
        }
    }
}

#[test]
fn a_preparing_pass_leaves_the_state_and_gives_the_forces_of_it() {
    for material in with_gases() {
        let mut piece = stirred(&material, [3, 2, 2], 9);
        piece.v.fill([0.0; 3]);
        piece.x.iter_mut().flatten().for_each(|x| *x *= 0.99);
        let mut block = Block::new(&piece);
        let vote = compute(&mut block, &material, &full_step(0.0), Width::best());
        assert_eq!(block.piece(), piece);
        assert!(vote.courant.is_finite() && vote.force_bound > 0.0);
        assert_eq!((vote.hourglass, vote.viscosity), (0.0, 0.0));
        let booked: f64 =
            piece.fields[field::ENERGY].iter().zip(&piece.initial_volume).map(|(e, v)| e * v).sum();
        assert!((vote.internal / booked - 1.0).abs() < 1e-6, "{} {booked}", vote.internal);
    }
}

#[test]
fn an_inverted_element_is_named_gives_no_force_and_keeps_its_state() {
    let material = &all_laws()[3];
    let mut piece = grid(material, [4, 3, 2], 0.01, 0.0, 1);
    piece.elements.iter_mut().for_each(|element| *element += 100);
    // Node (4, 0, 0) is a corner of the fourth element only.
    piece.x[4] = [-0.05, 0.0, 0.0];
    for width in Width::ALL.into_iter().filter(|width| width.available()) {
        let mut block = Block::new(&piece);
        let vote = compute(&mut block, material, &full_step(1e-7), width);
        let Some(Fault { element, volume }) = vote.fault else { panic!("no fault at {width}") };
        assert_eq!(element, 103);
        assert!(volume < 0.0, "{volume}");
        assert!(block.f.iter().flatten().all(|f| *f == 0.0));
        assert_eq!(block.piece().fields, piece.fields);
    }
    piece.x[4] = [0.04, f64::NAN, 0.0];
    let vote = compute(&mut Block::new(&piece), material, &full_step(1e-7), Width::best());
    assert_eq!(vote.fault.map(|fault| fault.element), Some(103));
}

#[test]
fn the_vote_is_the_least_of_the_elements_alone() {
    for material in with_gases() {
        let mut piece = stirred(&material, [7, 5, 3], 41);
        piece.elements.iter_mut().for_each(|element| *element += 1000);
        let step = full_step(2e-7);
        let vote = compute(&mut Block::new(&piece), &material, &step, Width::best());
        let part = written_out(&piece);
        let Topology::Explicit { hexahedra } = part.topology else { panic!("written out") };
        let mut joined = ElementVote::default();
        for (element, corners) in hexahedra.iter().enumerate().rev() {
            let mut alone = one(&material, &corners.map(|node| piece.x[node as usize]));
            alone.hourglass = piece.hourglass;
            alone.v = corners.map(|node| piece.v[node as usize]).to_vec();
            alone.elements = vec![piece.elements[element]];
            alone.initial_volume = vec![piece.initial_volume[element]];
            alone.fields = std::array::from_fn(|field| vec![piece.fields[field][element]]);
            alone.history = piece.history.iter().map(|column| vec![column[element]]).collect();
            joined.merge(&compute(&mut Block::new(&alone), &material, &step, Width::Scalar));
        }
        assert_eq!(joined, vote);
    }
}

#[test]
fn equal_limits_go_to_the_lowest_element() {
    let material = &all_laws()[1];
    let mut piece = grid(material, [9, 3, 2], 0.125, 0.0, 1);
    let n = piece.elements.len() as u32;
    piece.elements = (0..n).map(|element| 100 + (element + 20) % n).collect();
    for width in Width::ALL.into_iter().filter(|width| width.available()) {
        let vote = compute(&mut Block::new(&piece), material, &full_step(0.0), width);
        assert_eq!(vote.courant_element, 100);
    }
}

#[test]
fn a_distorted_body_at_rest_is_without_force_to_the_bit() {
    for material in all_laws() {
        let piece = grid(&material, [5, 4, 3], 0.01, 0.15, 8);
        let vote = compute(&mut Block::new(&piece), &material, &full_step(1e-7), Width::best());
        assert_eq!((vote.force_bound, vote.internal), (0.0, 0.0));
    }
}
