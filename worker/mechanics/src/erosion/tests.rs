//! The pass that finds what erodes: the same on all lanes and layouts, booked once.

use super::*;
use crate::{
    element::{
        ElementVote,
        hourglass::{Hourglass, Kind, N_FORCES},
    },
    exact::Quantum,
    material::{Eos, Failure, Strength},
    mesh::Topology,
    piece::Piece,
    state::{N_FIELDS, ShellState},
};

const CELLS: [u32; 3] = [7, 3, 3];

fn steel() -> Material {
    Material {
        name: "steel".into(),
        density: 7800.0,
        eos: Eos::Linear { bulk: 160e9 },
        strength: Strength::VonMises { shear: 80e9, yield_stress: 4e8, hardening: 1e9, rate: None },
        failure: Failure::PlasticStrain { limit: 0.3 },
    }
}

fn draws(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// A block of cubes that have been bent, stressed and strained at random, and the state that it carries.
fn bent(structured: bool) -> (Piece, PieceErosion) {
    let mut draw = draws(0x9e37_79b9_7f4a_7c15);
    let mut initial = Vec::new();
    for k in 0..=CELLS[2] {
        for j in 0..=CELLS[1] {
            for i in 0..=CELLS[0] {
                initial.push([i, j, k].map(|n| 0.01 * f64::from(n)));
            }
        }
    }
    let topology = Topology::Structured { cells: CELLS };
    let n = (CELLS[0] * CELLS[1] * CELLS[2]) as usize;
    let part = crate::mesh::Part {
        name: "bent".into(),
        material: 0,
        topology: topology.clone(),
        nodes: (0..initial.len() as u32).collect(),
        element_ids: Vec::new(),
        hourglass: Hourglass::VISCOUS,
    };
    let hexahedra = (0..n).map(|e| part.corners(e)).collect();
    let topology = if structured { topology } else { Topology::Explicit { hexahedra } };
    let mut fields: [Vec<f64>; N_FIELDS] = std::array::from_fn(|_| vec![0.0; n]);
    for e in 0..n {
        for f in [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX, field::PRESSURE] {
            fields[f][e] = 8e8 * draw();
        }
        fields[field::ENERGY][e] = 1e7 * (1.0 + draw());
        fields[field::PLASTIC_STRAIN][e] = 0.5 + draw();
        fields[field::TEMPERATURE][e] = 1000.0 + 800.0 * draw();
        fields[field::DAMAGE][e] = (3.0 * draw()).clamp(0.0, 1.0);
        fields[field::RELATIVE_VOLUME][e] = 1.0 + 0.1 * draw();
    }
    let x = initial.iter().map(|p: &[f64; 3]| p.map(|c| c + 0.006 * draw())).collect();
    let v = initial.iter().map(|_| [0; 3].map(|_| 400.0 * draw())).collect();
    let piece = Piece {
        part: 0,
        material: 0,
        topology,
        x,
        v,
        mass: vec![1e-3; initial.len()],
        constraint: vec![0; initial.len()],
        elements: (100..100 + n as u32).collect(),
        nodes: part.nodes,
        initial_volume: vec![1e-6; n],
        fields,
        erosion: None,
        history: Vec::new(),
        contact: Vec::new(),
        shells: ShellState::default(),
        own: Vec::new(),
        hourglass: Hourglass::VISCOUS,
    };
    // One has gone before.
    let mut eroded = vec![ALIVE; n];
    eroded[5] = 3;
    let strain = (0..n).map(|_| 0.3 * (draw() + 0.5)).collect();
    (piece, PieceErosion { eroded, strain, initial })
}

fn criteria() -> Vec<Criteria> {
    let none = Criteria::default();
    vec![
        Criteria { geometric_strain: Some(0.25), ..none },
        Criteria { incremental_strain: Some(0.3), ..none },
        Criteria { plastic_strain: Some(0.6), ..none },
        Criteria { failure: true, ..none },
        Criteria { temperature: Some(1200.0), ..none },
        Criteria { shear_strain: Some(0.2), ..none },
        Criteria { principal_strain: Some(0.2), ..none },
        Criteria { compressive_strain: Some(0.2), ..none },
        Criteria { expansion: Some(0.02), ..none },
        Criteria { compaction: Some(0.02), ..none },
        Criteria { pressure: Some(2e8), ..none },
        Criteria { tension: Some(2e8), ..none },
        Criteria { principal_stress: Some(5e8), ..none },
        Criteria { von_mises: Some(9e8), ..none },
        Criteria { time_step: Some(0.85e-6), ..none },
        Criteria { pressure: Some(3e8), shear_strain: Some(0.3), expansion: Some(0.04), ..none },
    ]
}

fn step() -> Step {
    Step {
        dt: 1e-6,
        linear_viscosity: 0.0,
        quadratic_viscosity: 0.0,
        force_quantum: Quantum::for_reference(1e7, 42),
        energy_quantum: Quantum::for_reference(1e4, 42),
        arm: 1.0,
    }
}

/// What leaves a block, in one pass over its sets.
fn watched(criteria: &Criteria, structured: bool, width: Width) -> (Casualties, PieceErosion) {
    let (piece, state) = bent(structured);
    let materials = [steel()];
    let mut block = Block::of(piece, &materials);
    let mut eroding = Eroding::new(criteria, Some(&state), &mut block, &materials[0], 0.6666);
    let all = 0..block.n_sets();
    eroding.watch(&mut block, &materials[0], std::slice::from_ref(&all), (&step(), 17), width);
    let mut eroded_now = eroding.take_casualties();
    eroded_now.elements.sort_unstable();
    (eroded_now, eroding.state(&block))
}

#[test]
fn by_every_criterion_the_same_elements_leave_on_all_lane_widths_and_layouts() {
    for criteria in criteria() {
        let (one, state) = watched(&criteria, true, Width::Scalar);
        let n = state.eroded.len();
        assert!((1..n - 1).contains(&one.elements.len()), "{criteria:?}: {} of {n}", one.elements.len());
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            for structured in [true, false] {
                let (other, image) = watched(&criteria, structured, width);
                assert_eq!(one.elements, other.elements, "{criteria:?}: {width}, structured {structured}");
                assert_eq!(one.internal.to_bits(), other.internal.to_bits(), "{criteria:?}: {width}");
                let bits = |s: &PieceErosion| s.strain.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert_eq!(
                    (&state.eroded, bits(&state)),
                    (&image.eroded, bits(&image)),
                    "{criteria:?}: {width}"
                );
            }
        }
    }
}

#[test]
fn the_energy_of_those_that_leave_is_booked_once_and_their_cycle_is_kept() {
    for criteria in criteria() {
        let (gone, state) = watched(&criteria, true, Width::Scalar);
        let (piece, before) = bent(true);
        let block = Block::of(piece.clone(), &[steel()]);
        let mut expected = 0.0;
        for e in gone.elements.iter().map(|&e| e as usize - 100) {
            let internal = piece.fields[field::ENERGY][e] * piece.initial_volume[e];
            let since = block.half_work(block.slot(e), step().dt, &steel());
            expected += step().energy_quantum.round(internal + since);
        }
        assert_eq!(gone.internal.to_bits(), expected.to_bits(), "{criteria:?}");
        assert!(!gone.elements.contains(&105), "one that had gone before goes no second time");
        for (e, (&was, &is)) in before.eroded.iter().zip(&state.eroded).enumerate() {
            let left = gone.elements.contains(&(e as u32 + 100));
            assert_eq!(is, if left { 17 } else { was }, "{criteria:?}: element {e}");
        }
    }
}

#[test]
fn the_last_forces_of_elements_do_half_of_their_work_after_them() {
    for kind in [None, Some(Kind::Stiffness), Some(Kind::AssumedStrain)] {
        for structured in [true, false] {
            let (mut piece, _) = bent(structured);
            piece.hourglass = kind.map_or(Hourglass::NONE, |kind| Hourglass { kind, coefficient: 0.5 });
            if kind.is_some() {
                let mut draw = draws(7);
                let n = piece.elements.len();
                piece.own = (0..N_FORCES).map(|_| (0..n).map(|_| 1e4 * draw()).collect()).collect();
                piece.fields[field::DAMAGE].fill(0.0);
            }
            let mut block = Block::of(piece, &[steel()]);
            let all = 0..block.n_sets();
            let mut vote = ElementVote::default();
            let step = Step { quadratic_viscosity: 1.5, linear_viscosity: 0.06, ..step() };
            block.compute(&steel(), std::slice::from_ref(&all), &step, Width::Scalar, &mut vote);
            assert_eq!(vote.fault, None);
            let dt = 0.7 * step.dt;
            let (mut work, mut size) = (0.0, 0.0);
            for axis in 0..3 {
                for ((x, v), f) in block.x[axis].iter_mut().zip(&block.v[axis]).zip(&block.f[axis]) {
                    *x += dt * v;
                    work -= 0.5 * dt * f * v;
                    size += 0.5 * dt * (f * v).abs();
                }
            }
            let elements = 0..block.n_elements();
            let half: f64 = elements.map(|e| block.half_work(block.slot(e), dt, &steel())).sum();
            assert!(work.abs() > 1e-3 * size, "{work} of {size}");
            // The damping beside elastic control is reckoned with the sound speed at rest.
            let allowed = if kind.is_some() { 1e-5 } else { 1e-9 };
            assert!((half - work).abs() < allowed * size, "{kind:?}: {half}, forces did {work}, of {size}");
        }
    }
}

#[test]
fn an_element_that_has_left_gives_no_force_and_no_vote() {
    let (piece, mut state) = bent(true);
    state.eroded.fill(3);
    let materials = [steel()];
    let mut block = Block::of(piece, &materials);
    let criteria = Criteria { plastic_strain: Some(0.6), ..Criteria::default() };
    let mut eroding = Eroding::new(&criteria, Some(&state), &mut block, &materials[0], 0.6666);
    assert!(block.alive().iter().all(|&bits| bits == 0));
    let all = 0..block.n_sets();
    eroding.watch(&mut block, &materials[0], std::slice::from_ref(&all), (&step(), 17), Width::Scalar);
    assert_eq!(eroding.take_casualties(), Casualties::default());
    assert!(!eroding.take_change());
}
