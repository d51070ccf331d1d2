//! A domain of two blocks that touch, by lane width; gauges on shells.

use super::*;
use crate::{
    constraint::Constraint,
    contact::{Batch, Exclusions, Settings, Surface, WorkUnit, sort},
    element::shell4::Rule,
    erosion::Erosion,
    exact::Quantum,
    load::Loads,
    material::{Eos, Failure, Material, Strength},
    mesh::{Mesh, Part, Section, Topology},
    piece::{Region, cut},
    setup::Control,
    state::field,
    vote::Watched,
};

/// No clock.
struct Silent;

impl Meter for Silent {
    fn start(&self) -> u64 {
        0
    }

    fn stop(&self, _: u64, _: bool) {}
}

const CELLS: [u32; 3] = [3, 3, 2];
const GAP: f64 = 0.2;

/// Two blocks of unit cubes, the second beside the corners of the first by a third of a cube and half a gap above it.
fn two_blocks() -> Mesh {
    let mut mesh = Mesh::default();
    for (name, origin) in [("below", [0.0; 3]), ("above", [0.3, 0.4, 2.0 + 0.5 * GAP])] {
        let first = mesh.positions.len() as u32;
        for k in 0..=CELLS[2] {
            for j in 0..=CELLS[1] {
                for i in 0..=CELLS[0] {
                    let n = [i, j, k];
                    mesh.positions.push([0, 1, 2].map(|a| origin[a] + f64::from(n[a])));
                }
            }
        }
        let nodes: Vec<u32> = (first..mesh.positions.len() as u32).collect();
        mesh.node_ids.extend(&nodes);
        mesh.parts.push(Part {
            name: name.into(),
            material: 0,
            topology: Topology::Structured { cells: CELLS },
            nodes,
            element_ids: (0..CELLS.iter().product()).collect(),
            hourglass: crate::element::hourglass::Hourglass::VISCOUS,
        });
    }
    mesh
}

fn setup(friction: f64) -> Setup {
    let shear = 0.5;
    Setup {
        materials: vec![Material {
            name: "test".into(),
            density: 1.0,
            eos: Eos::Linear { bulk: 1.0 },
            strength: Strength::Elastic { shear },
            failure: Failure::None,
        }],
        control: Control {
            end_time: 1.0,
            end_cycle: 100,
            safety_factor: 0.6666,
            growth: 1.05,
            energy_error: 0.5,
            time_step_floor: 0.0,
            linear_viscosity: 0.2,
            quadratic_viscosity: 1.0,
            sort_lag: 2,
            plan_interval: 100,
        },
        contact: Some(Settings {
            gap: GAP,
            slack: GAP,
            friction: vec![friction; 4],
            interacts: vec![false, true, true, false],
            stiffness: 0.5,
            friction_velocity: 1e-3,
            ignores_initial: true,
            edges: true,
            ..Settings::default()
        }),
        constraints: vec![Constraint::default()],
        walls: Vec::new(),
        detonations: Vec::new(),
        loads: Loads::default(),
        erosion: Erosion::default(),
        bodies: Vec::new(),
        switches: Vec::new(),
        joints: Vec::new(),
    }
}

/// The blocks on one worker, about to run into each other, with a plan that has all of their contact.
fn touching(friction: f64, width: Width) -> Domain {
    let (mesh, setup) = (two_blocks(), setup(friction));
    let n = mesh.n_nodes();
    let velocity: Vec<[f64; 3]> =
        (0..n).map(|node| if 2 * node < n { [0.0; 3] } else { [0.02, 0.01, -0.05] }).collect();
    let state = crate::initial::state(&mesh, &setup, &velocity, &vec![0; n]).expect("sound cubes");
    let quantum = Quantum::for_reference(1.0, 42);
    let quanta = Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 };
    let mut surface = Surface::new(&mesh, &setup.materials, &|_| true);
    surface.find_edges(&mesh);
    let x: Vec<[f64; 3]> = surface.nodes.iter().map(|&n| mesh.positions[n as usize]).collect();
    let settings = setup.contact.as_ref().expect("just set");
    let units = sort(&surface, &x, settings, &Exclusions::default());
    let all: Vec<&WorkUnit> = units.iter().collect();
    let batch = Batch::gather(&surface, &all, &|node| state.mass[node as usize], &Exclusions::default());
    let whole = Region::Cells { low: [0; 3], high: CELLS };
    let pieces = (0..2).map(|part| cut(&mesh, &state, part, &whole)).collect();
    let subdomain = Subdomain { id: 0, pieces, unowned: Vec::new(), surface: surface.nodes.clone() };
    let mut domain = Domain::new(setup, 2, quanta, (vec![subdomain], 0), &[], width);
    domain
        .install(&Plan { batch: Some(batch), ..Plan::default() }, &[], &Silent)
        .expect("all nodes are held");
    domain
}

/// Forces of contact and positions after some cycles, in bits, and the greatest number of hits.
fn run(friction: f64, width: Width) -> (Vec<u64>, u64) {
    const DT: f64 = 0.05;
    let mut domain = touching(friction, width);
    let (mut bits, mut hits, mut dt_previous) = (Vec::new(), 0, 0.0);
    for cycle in 0..20 {
        domain.begin(domain.quanta, DT * f64::from(cycle));
        domain.contact(dt_previous, &Silent);
        let held = domain.contact.first().expect("the plan has a batch");
        assert_eq!(held.contact.width(), width, "contact on other lanes than those of the elements");
        bits.extend(held.f.iter().flatten().map(|f| f.to_bits()));
        domain.elements(Sets::All, dt_previous, &Silent);
        let vote = domain.integrate(&[], dt_previous, DT, &[], &Silent).expect("no node is exchanged");
        hits = hits.max(vote.hits);
        dt_previous = DT;
    }
    bits.extend(domain.pieces().iter().flat_map(|piece| &piece.x).flatten().map(|x| x.to_bits()));
    (bits, hits)
}

#[test]
fn contact_computes_on_the_lanes_of_its_domain_and_no_width_changes_a_bit() {
    for friction in [0.0, 0.3] {
        let (one, hits) = run(friction, Width::Scalar);
        assert!(hits > 10, "{hits} hits");
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            assert!(run(friction, width).0 == one, "{width}, friction {friction}");
        }
    }
}

/// A plate of 4 x 3 shells that is stretched and folded until it yields.
fn folding_plate() -> Domain {
    let (columns, rows) = (4, 3);
    let mut mesh = Mesh::default();
    let mut velocity = Vec::new();
    for j in 0..=rows {
        for i in 0..=columns {
            let (x, y) = (f64::from(i), f64::from(j));
            mesh.positions.push([x, y, 0.0]);
            velocity.push([0.04 * x, -0.01 * y * x, 0.02 * x * x]);
        }
    }
    let row = columns + 1;
    let quads: Vec<[u32; 4]> = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| [0, 1, row + 1, row].map(|d| j * row + i + d)))
        .collect();
    let nodes: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    mesh.node_ids.clone_from(&nodes);
    let element_ids: Vec<u32> = (0..quads.len() as u32).collect();
    let section = Section::of(0.2, Rule::Gauss(3));
    let topology = Topology::Shells { quads, section, thicknesses: Vec::new() };
    mesh.parts.push(Part {
        name: "plate".into(),
        material: 0,
        topology,
        nodes,
        element_ids,
        hourglass: crate::element::hourglass::Hourglass::VISCOUS,
    });
    let mut setup = Setup { contact: None, ..setup(0.0) };
    setup.materials[0].strength =
        Strength::VonMises { shear: 0.5, yield_stress: 1e-3, hardening: 1e-2, rate: None };
    let state =
        crate::initial::state(&mesh, &setup, &velocity, &vec![0; velocity.len()]).expect("a sound plate");
    let quantum = Quantum::for_reference(1.0, 42);
    let quanta = Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 };
    let all = Region::List((0..mesh.n_elements() as u32).collect());
    let pieces = vec![cut(&mesh, &state, 0, &all)];
    let subdomain = Subdomain { id: 0, pieces, unowned: Vec::new(), surface: Vec::new() };
    let mut domain = Domain::new(setup, 1, quanta, (vec![subdomain], 0), &[], Width::best());
    domain.watch(&Watched { elements: vec![7, 0], ..Watched::default() });
    domain.install(&Plan { moments: true, ..Plan::default() }, &[], &Silent).expect("all nodes are held");
    domain
}

#[test]
fn element_gauges_on_shells_read_what_the_state_has_of_them() {
    const DT: f64 = 0.02;
    let mut domain = folding_plate();
    for cycle in 0..30 {
        domain.begin(domain.quanta, DT * f64::from(cycle));
        domain.elements(Sets::All, DT, &Silent);
        let vote = domain.integrate(&[], DT, DT, &[], &Silent).expect("no node is exchanged");
        let piece = domain.pieces().remove(0);
        assert_eq!(vote.element_gauges.len(), 2);
        for (gauge, found) in vote.element_gauges {
            let element = [7, 0][gauge as usize];
            let stored: Vec<f64> = piece.fields.iter().map(|field| field[element]).collect();
            let bits = |state: &[f64]| state.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&found), bits(&stored), "{found:?} for {stored:?}");
            for (index, value) in found.iter().copied().enumerate() {
                assert_eq!(domain.held_blocks[0].block.field(element, index).to_bits(), value.to_bits());
            }
            if cycle == 29 {
                assert!(found[field::SXX] > 1e-4 && found[field::PLASTIC_STRAIN] > 1e-3, "{found:?}");
            }
        }
    }
}
