//! Proof that this machine's kernels give the bits of all others: a small fixed problem and its hash.
//!
//! Every law of materials on a block of elements in a state that a run could reach, three cycles with integration; the
//! forces of a batch of contact, with and without friction; the functions. All of it takes a few milliseconds. A
//! processor, a compiler or a build that rounds one operation otherwise has another hash.

use crate::{
    block::Block,
    constraint::Constraint,
    contact::{Batch, BatchFace, BatchNode, BatchUnit, Contact, Settings},
    cycle::{self, Domain, Interval, Unmeasured},
    element::{ElementVote, hex8},
    erosion::Erosion,
    exact::{Quanta, Quantum},
    lanes::{Width, functions, scalar::Scalar},
    load::Loads,
    material::{CowperSymonds, Eos, Failure, Hardening, Heat, MAX_HARDENING, Material, Strength},
    mesh::{MAX_NODES, Part, Topology},
    piece::Piece,
    sample::Sample,
    setup::{Control, Setup},
    state::{N_FIELDS, ShellState, field},
};

/// What the fixed problem comes to on the lanes of one width: 32 hexadecimal digits, the same on every machine.
///
/// # Panics
/// If the machine lacks the width.
pub fn digest(width: Width) -> String {
    let mut hasher = blake3::Hasher::new();
    of_functions(&mut hasher);
    for (seed, material) in (1..).zip(materials()) {
        of_elements(material, seed, width, &mut hasher);
    }
    for friction in [0.0, 0.3] {
        of_contact(friction, width, &mut hasher);
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// [`digest`] of this machine: of the first width whose digest is not that of one lane, or of one lane where all agree.
pub fn of_this_machine() -> String {
    let one = digest(Width::Scalar);
    let others = Width::ALL.into_iter().filter(|&width| width != Width::Scalar && width.available());
    others.map(digest).find(|other| *other != one).unwrap_or(one)
}

/// Hash of what the elements of a block made of its state: forces and moments by node, fields by element, the vote.
pub(crate) fn of_block(block: &Block, vote: &ElementVote) -> [u8; 16] {
    let mut hasher = blake3::Hasher::new();
    let n = block.nodes.len();
    for f in &block.f {
        put(&mut hasher, f[..n].iter().copied());
    }
    for m in block.turning.iter().flat_map(|turning| &turning.m) {
        put(&mut hasher, m[..n].iter().copied());
    }
    block.visit(&mut |value| put(&mut hasher, std::iter::once(value)));
    let ElementVote {
        courant,
        courant_element,
        volume_limit,
        internal,
        hourglass,
        viscosity,
        force_bound,
        ..
    } = *vote;
    let element = f64::from(courant_element);
    put(
        &mut hasher,
        [courant, element, volume_limit, internal, hourglass, viscosity, force_bound].into_iter(),
    );
    let mut hash = [0; 16];
    hash.copy_from_slice(&hasher.finalize().as_bytes()[..16]);
    hash
}

fn put(hasher: &mut blake3::Hasher, numbers: impl Iterator<Item = f64>) {
    for number in numbers {
        // A zero of either sign acts the same, and an empty sum of forces may have either.
        hasher.update(&(number + 0.0).to_le_bytes());
    }
}

/// Reproducible draws between 0 and 1.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// About zero, at most half of `width` away.
    fn about(&mut self, width: f64) -> f64 {
        width * (self.next() - 0.5)
    }
}

fn of_functions(hasher: &mut blake3::Hasher) {
    let mut draws = Draws(17);
    for _ in 0..64 {
        let (x, y) = (Scalar(1e-3 + 30.0 * draws.next()), Scalar(4.0 * draws.next() - 1.0));
        let values = [functions::ln(x), functions::exp(y), functions::pow(x, y), functions::cbrt(x)];
        put(hasher, values.into_iter().map(|value| value.0));
    }
}

/// Every equation of state, strength law and failure law at least once; SI, like steel, air and TNT.
fn materials() -> Vec<Material> {
    let shear = 81.8e9;
    let rate = Some(CowperSymonds { reference: 40.4, exponent: 5.0 });
    let von_mises = |rate| Strength::VonMises { shear, yield_stress: 4e8, hardening: 1e9, rate };
    let (t_melt, t_room, specific_heat) = (1811.0, 300.0, 452.0);
    let johnson_cook = Strength::JohnsonCook {
        shear,
        a: 350e6,
        b: 275e6,
        n: 0.36,
        c: 0.022,
        m: 1.03,
        t_melt,
        t_room,
        specific_heat,
        rate0: 1.0,
        heat: Heat::PlasticWork,
    };
    let mut hardening = Hardening { n_points: 3, strain: [0.0; MAX_HARDENING], stress: [0.0; MAX_HARDENING] };
    hardening.strain[..3].copy_from_slice(&[0.0, 0.05, 0.3]);
    hardening.stress[..3].copy_from_slice(&[2e8, 3e8, 3.5e8]);
    let tabulated = Strength::Tabulated { shear, hardening, rate };
    let (linear, shock) = (Eos::Linear { bulk: 164e9 }, Eos::Shock { c0: 4569.0, s: 1.49, gamma: 2.17 });
    let polynomial =
        Eos::Polynomial { a1: 164e9, a2: 294e9, a3: 500e9, b0: 2.0, b1: 1.5, t1: 164e9, t2: 50e9 };
    let gas = Eos::IdealGas { gamma: 1.4, energy: 2.068e5 };
    let (r1, r2, omega, detonation) = (4.15, 0.95, 0.30, 6930.0);
    let tnt = Eos::Jwl { a: 371.2e9, b: 3.231e9, r1, r2, omega, energy: 7e9, detonation, cj_pressure: 21e9 };
    let d = [0.05, 0.3, -2.12, 0.002, 0.61];
    [
        (7896.0, linear, Strength::Elastic { shear }, Failure::None),
        (7896.0, shock, von_mises(None), Failure::Hydrostatic { tension: 2e8, heals: false }),
        (7896.0, shock, johnson_cook, Failure::JohnsonCook { d }),
        (7896.0, polynomial, von_mises(rate), Failure::PlasticStrain { limit: 0.4 }),
        (7896.0, polynomial, Strength::Hydro, Failure::Hydrostatic { tension: 2e8, heals: true }),
        (7896.0, linear, tabulated, Failure::PrincipalStress { tension: 3e8 }),
        (1.225, gas, Strength::Hydro, Failure::None),
        (1630.0, tnt, Strength::Hydro, Failure::None),
    ]
    .into_iter()
    .map(|(density, eos, strength, failure)| Material {
        name: "proof".into(),
        density,
        eos,
        strength,
        failure,
    })
    .collect()
}

/// A distorted grid in a state that a run could reach: random velocities, stresses, strains and temperatures.
fn stirred(material: &Material, seed: u64) -> Piece {
    const CELLS: [u32; 3] = [7, 3, 2];
    const SIDE: f64 = 0.01;
    let mut draws = Draws(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut x = Vec::new();
    for k in 0..=CELLS[2] {
        for j in 0..=CELLS[1] {
            for i in 0..=CELLS[0] {
                x.push([i, j, k].map(|c| SIDE * (f64::from(c) + draws.about(0.24))));
            }
        }
    }
    let topology = Topology::Structured { cells: CELLS };
    let nodes: Vec<u32> = (0..x.len() as u32).collect();
    let part = Part {
        name: String::new(),
        material: 0,
        topology: topology.clone(),
        nodes: nodes.clone(),
        element_ids: Vec::new(),
        hourglass: crate::element::hourglass::Hourglass::VISCOUS,
    };
    let n = part.n_elements();
    let mut mass = vec![0.0; x.len()];
    let mut initial_volume = Vec::with_capacity(n);
    for element in 0..n {
        let corners = part.corners(element);
        let volume = hex8::volume(&corners.map(|node| x[node as usize]));
        corners.iter().for_each(|&node| mass[node as usize] += 0.125 * material.density * volume);
        initial_volume.push(volume);
    }
    let mut fields: [Vec<f64>; N_FIELDS] = std::array::from_fn(|_| vec![0.0; n]);
    let flows = !matches!(material.strength, Strength::Hydro | Strength::Elastic { .. });
    for element in 0..n {
        if material.shear() > 0.0 {
            for component in [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX] {
                fields[component][element] = draws.about(4e8);
            }
        }
        fields[field::ENERGY][element] = material.initial_energy() + 1e7 * draws.next();
        fields[field::RELATIVE_VOLUME][element] = 1.0 + draws.about(0.01);
        fields[field::PRESSURE][element] = material.initial_pressure();
        fields[field::TEMPERATURE][element] = material.initial_temperature();
        if material.failure != Failure::None {
            fields[field::DAMAGE][element] = (3.0 * draws.about(1.0)).clamp(0.0, 1.0);
        }
        if material.detonation_speed().is_some() {
            fields[field::TIME_TO_LIGHT][element] = draws.about(1e-5);
        }
        if flows {
            let strain = draws.about(1.0).max(0.0);
            fields[field::PLASTIC_STRAIN][element] = strain;
            if material.initial_temperature() > 0.0 {
                fields[field::TEMPERATURE][element] += 800.0 * strain;
            }
        }
    }
    Piece {
        part: 0,
        material: 0,
        topology,
        v: x.iter().map(|_| [0; 3].map(|_| draws.about(40.0))).collect(),
        constraint: vec![0; x.len()],
        elements: (0..n as u32).collect(),
        nodes,
        x,
        mass,
        initial_volume,
        fields,
        erosion: None,
        history: Vec::new(),
        contact: Vec::new(),
        shells: ShellState::default(),
        own: Vec::new(),
        hourglass: crate::element::hourglass::Hourglass::VISCOUS,
    }
}

/// Time step of the problem.
const DT: f64 = 2e-7;

/// The first block of the problem, for tests of what passes samples on.
#[doc(hidden)]
pub fn sample() -> Sample {
    start(materials().remove(0), 1)
}

/// A block whose nodes are free, at the start of the first cycle.
fn start(material: Material, seed: u64) -> Sample {
    let piece = stirred(&material, seed);
    let control = Control {
        end_time: 1.0,
        end_cycle: 3,
        safety_factor: 0.6666,
        growth: 1.05,
        linear_viscosity: 0.2,
        quadratic_viscosity: 1.0,
        sort_lag: 2,
        plan_interval: 50,
        energy_error: 0.5,
        time_step_floor: 0.0,
    };
    let setup = Setup {
        materials: vec![material],
        control,
        contact: None,
        constraints: vec![Constraint::default()],
        walls: Vec::new(),
        detonations: Vec::new(),
        loads: Loads::default(),
        erosion: Erosion::default(),
        bodies: Vec::new(),
        switches: Vec::new(),
        joints: Vec::new(),
    };
    let (force, energy) = (Quantum::for_reference(3e7, 42), Quantum::for_reference(1e6, 42));
    let quanta = Quanta { force, energy, momentum: energy, arm: 1.0 };
    Sample { setup, n_parts: 1, quanta, piece, cycle: 0, time: 0.0, dt_previous: DT }
}

/// Three cycles of a block.
fn of_elements(material: Material, seed: u64, width: Width, hasher: &mut blake3::Hasher) {
    let sample = start(material, seed);
    let quanta = sample.quanta;
    let mut domain = sample.into_domain(width);
    for n in 0..3 {
        let now = Interval { time: DT * f64::from(n), dt_previous: DT, dt: DT, quanta };
        let hashed = |domain: &Domain, partials| {
            hasher.update(&domain.sample(0).expect("there is one block"));
            partials
        };
        let vote = cycle::step(&mut domain, &now, &[], hashed, &Unmeasured);
        let vote = vote.expect("no node is exchanged");
        put(hasher, [vote.external.whole(), vote.courant].into_iter().chain(vote.momentum));
    }
    for piece in domain.pieces() {
        put(hasher, piece.x.iter().chain(&piece.v).flatten().copied());
    }
}

/// Forces of a bumpy patch of faces on nodes about it.
fn of_contact(friction: f64, width: Width, hasher: &mut blake3::Hasher) {
    let mut draws = Draws(41);
    let (mut batch, mut x) = (Batch::default(), [const { Vec::new() }; 3]);
    let mut put_node = |p: [f64; 3], part: u32, draws: &mut Draws| {
        let (mass, stiffness) = (1.0 + draws.next(), 1.0 + draws.next());
        let global = batch.nodes.len() as u32;
        batch.nodes.push(BatchNode { global, part, mass, stiffness, share: 0.25 + 0.75 * draws.next() });
        (0..3).for_each(|a| x[a].push(p[a]));
    };
    for i in 0..49 {
        let height = if i % 7 < 3 { 0.0 } else { 0.4 * draws.next() };
        put_node([f64::from(i % 7), f64::from(i / 7), height], 0, &mut draws);
    }
    for i in 0..200 {
        let p = [7.0 * draws.next() - 0.5, 7.0 * draws.next() - 0.5, 2.0 * draws.next() - 0.5];
        let p = if i % 4 == 0 { [p[0].round(), p[1].round(), 0.1] } else { p };
        put_node(p, 1, &mut draws);
    }
    for i in 0..36_u32 {
        let first = i / 6 * 7 + i % 6;
        let nodes = [first, first + 1, first + 8, first + 7];
        let stiffness = 1.0 + draws.next();
        batch.faces.push(BatchFace { nodes, id: i, part: 0, stiffness, corners: [u32::MAX; MAX_NODES] });
    }
    batch.units.push(BatchUnit { nodes: (49..249).collect(), faces: (0..36).collect() });
    let settings = Settings {
        gap: 0.3,
        slack: 0.1,
        friction: vec![friction; 4],
        interacts: vec![false, true, true, false],
        stiffness: 0.5,
        friction_velocity: 1e-3,
        ..Settings::default()
    };
    let mut contact = Contact::new(&batch, &settings, &x, width);
    let v = [x[1].clone(), x[2].clone(), x[0].clone()];
    let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
    let quantum = Quantum::for_reference(1.0, 42);
    let vote = contact.forces(&x, &v, 0.1, quantum, quantum, &mut f);
    put(hasher, f.into_iter().flatten().chain([vote.dt, vote.hits as f64]));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Changes with the physics; then every host of a lab needs the same release anyway.
    const KNOWN: &str = "dbf91a5ad26895f3a1400bf0fe5290da";

    #[test]
    fn every_width_proves_the_same_and_the_hash_stands_for_all_machines() {
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            assert_eq!(digest(width), KNOWN, "{width}");
        }
        assert_eq!(of_this_machine(), KNOWN);
    }

    #[test]
    fn one_unit_in_the_last_place_of_one_number_shows() {
        let mut block = Block::new(&stirred(&materials()[0], 3));
        let vote = ElementVote::default();
        let before = of_block(&block, &vote);
        assert_eq!(of_block(&block, &vote), before);
        block.plant_fault();
        assert_ne!(of_block(&block, &vote), before);
    }

    #[test]
    fn a_sample_is_computed_again_from_the_state_at_the_start_of_the_cycle() {
        let material = materials().remove(2);
        let piece = stirred(&material, 7);
        let mut block = Block::new(&piece);
        let step = crate::element::Step {
            dt: 2e-7,
            linear_viscosity: 0.2,
            quadratic_viscosity: 1.0,
            force_quantum: Quantum::for_reference(3e7, 42),
            energy_quantum: Quantum::for_reference(1e6, 42),
            arm: 1.0,
        };
        let of = |block: &mut Block, cuts: &[u32]| {
            let mut vote = ElementVote::default();
            for ends in cuts.windows(2) {
                block.compute(
                    &material,
                    std::slice::from_ref(&(ends[0]..ends[1])),
                    &step,
                    Width::best(),
                    &mut vote,
                );
            }
            of_block(block, &vote)
        };
        let n = block.n_sets();
        assert_eq!(of(&mut block, &[0, n]), of(&mut Block::new(&piece), &[0, 1, n]), "any cut into calls");
    }
}
