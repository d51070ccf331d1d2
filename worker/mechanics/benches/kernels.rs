//! Grind time of the element kernels: nanoseconds of thread CPU time per element per cycle, by lane width, laws and
//! topology, on two strained plates of 27,000 elements in all.
//!
//! `cargo bench -p mechanics --bench kernels`

use mechanics::{
    block::{Block, Piece},
    element::{ElementVote, Step, hex8},
    exact::Quantum,
    lanes::Width,
    material::{Eos, Material, Strength},
    mesh::{Mesh, Part, Topology},
    state::{N_FIELDS, field},
};
use rustix::time::{ClockId, clock_gettime};

/// Elements along each index.
const CELLS: [u32; 3] = [30, 30, 30];

fn plate(material: &Material, explicit: bool) -> Piece {
    let [ni, nj, nk] = CELLS;
    let mut positions = Vec::new();
    for k in 0..=nk {
        for j in 0..=nj {
            for i in 0..=ni {
                let (x, y, z) = (f64::from(i), f64::from(j), f64::from(k));
                let bend = [(0.7 * y + z).sin(), (0.9 * z + x).sin(), (0.8 * x + y).sin()];
                positions
                    .push([x + 0.05 * bend[0], y + 0.05 * bend[1], z + 0.05 * bend[2]].map(|c| c * 0.01));
            }
        }
    }
    let n_elements = (ni * nj * nk) as usize;
    let part = Part {
        name: "plate".into(),
        material: 0,
        topology: Topology::Structured { cells: CELLS },
        nodes: (0..positions.len() as u32).collect(),
        element_ids: (0..n_elements as u32).collect(),
    };
    let mesh = Mesh { positions, node_ids: part.nodes.clone(), parts: vec![part] };
    let hexahedra: Vec<[u32; 8]> = (0..n_elements).map(|e| mesh.parts[0].corners(e)).collect();
    let initial_volume: Vec<f64> = hexahedra
        .iter()
        .map(|corners| hex8::volume(&corners.map(|node| mesh.positions[node as usize])))
        .collect();
    let mut fields: [Vec<f64>; N_FIELDS] = std::array::from_fn(|_| vec![0.0; n_elements]);
    fields[field::RELATIVE_VOLUME].fill(1.0);
    fields[field::TEMPERATURE].fill(material.initial_temperature());
    let n_nodes = mesh.n_nodes();
    Piece {
        part: 0,
        material: 0,
        topology: if explicit {
            Topology::Explicit { hexahedra }
        } else {
            Topology::Structured { cells: CELLS }
        },
        nodes: (0..n_nodes as u32).collect(),
        elements: (0..n_elements as u32).collect(),
        // Enough to yield everywhere within the first steps.
        v: mesh
            .positions
            .iter()
            .map(|x| [2000.0 * x[1] - 500.0 * x[0], 1000.0 * x[2], 400.0 * x[2]])
            .collect(),
        x: mesh.positions,
        mass: vec![material.density * 1e-6; n_nodes],
        constraint: vec![0; n_nodes],
        initial_volume,
        fields,
    }
}

/// Thread CPU time in seconds.
fn now() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Median and least over cycles of the nanoseconds per element, forces cleared, nodes moved at constant velocity.
/// On a machine that others use too, the least is the steadier of the two.
fn grind(material: &Material, explicit: bool, width: Width) -> [f64; 2] {
    let mut block = Block::new(&plate(material, explicit));
    let dt = 2e-7;
    let step = Step {
        dt,
        linear_viscosity: 0.2,
        quadratic_viscosity: 1.0,
        hourglass: 0.1,
        force_quantum: Quantum::for_reference(2e8, 42),
        energy_quantum: Quantum::for_reference(1e9, 40),
    };
    let sets = 0..block.n_sets();
    let mut times: Vec<f64> = (0..60)
        .map(|_| {
            for (x, v) in block.x.iter_mut().zip(&block.v) {
                for (x, v) in x.iter_mut().zip(v) {
                    *x += dt * v;
                }
            }
            block.clear_forces();
            let start = now();
            let mut vote = ElementVote::default();
            block.compute(material, std::slice::from_ref(&sets), &step, width, &mut vote);
            let spent = now() - start;
            assert!(vote.fault.is_none(), "fault {:?}", vote.fault);
            spent
        })
        .collect();
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]].map(|time| time * 1e9 / f64::from(CELLS.iter().product::<u32>()))
}

fn main() {
    let shock = Eos::Shock { c0: 4569.0, s: 1.49, gamma: 2.17 };
    let shear = 81.8e9;
    let johnson_cook = |m: f64| Strength::JohnsonCook {
        shear,
        a: 350e6,
        b: 275e6,
        n: 0.36,
        c: 0.022,
        m,
        t_melt: 1811.0,
        t_room: 300.0,
        specific_heat: 452.0,
        rate0: 1.0,
    };
    let laws = [
        ("hydro + linear", Eos::Linear { bulk: 164e9 }, Strength::Hydro),
        ("elastic + linear", Eos::Linear { bulk: 164e9 }, Strength::Elastic { shear }),
        ("von Mises + shock", shock, Strength::VonMises { shear, yield_stress: 350e6, hardening: 1e8 }),
        ("Johnson-Cook (m = 1) + shock", shock, johnson_cook(1.0)),
        ("Johnson-Cook (m = 1.03) + shock", shock, johnson_cook(1.03)),
    ];
    println!("ns per element and cycle, median and (least)");
    println!("{:<34}{:<9}{:>16}{:>16}", "laws", "width", "structured", "explicit");
    for (name, eos, strength) in laws {
        let material = Material { name: name.into(), density: 7896.0, eos, strength };
        for width in Width::ALL {
            match width.require() {
                Ok(width) => {
                    let [structured, explicit] = [false, true].map(|explicit| {
                        let [median, least] = grind(&material, explicit, width);
                        format!("{median:.1} ({least:.1})")
                    });
                    println!("{name:<34}{:<9}{structured:>16}{explicit:>16}", width.to_string());
                }
                Err(error) => println!("{name:<34}{error}"),
            }
        }
    }
}
