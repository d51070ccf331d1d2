//! Bodies that the tests compute: pieces from corners or index spaces, of the materials beside.

use mechanics::{
    block::Block,
    element::{
        ElementVote, Step, hex8,
        hourglass::{Hourglass, N_FORCES},
    },
    exact::Quantum,
    lanes::Width,
    material::{Failure, Material, Strength},
    mesh::{Part, Topology},
    piece::Piece,
    state::{N_FIELDS, field},
};

// The verification book has this file, too, and finds the other beside it.
#[path = "materials.rs"]
mod materials;

pub use materials::*;

pub const UNIT_CUBE: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

pub const SKEWED: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.2, 1.1, 0.1],
    [0.0, 1.0, 0.2],
    [0.1, 0.0, 1.0],
    [1.0, 0.2, 1.3],
    [1.1, 1.0, 1.0],
    [-0.1, 1.0, 0.9],
];

/// Reproducible draws between -0.5 and 0.5.
pub struct Draws(pub u64);

impl Draws {
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// A piece at rest, unstressed, without hourglass control, with the mass of each element spread as its kind does.
pub fn piece(material: &Material, x: Vec<[f64; 3]>, topology: Topology) -> Piece {
    let nodes: Vec<u32> = (0..x.len() as u32).collect();
    let part = Part {
        name: "body".into(),
        material: 0,
        topology: topology.clone(),
        nodes: nodes.clone(),
        element_ids: Vec::new(),
        hourglass: Hourglass::VISCOUS,
    };
    let n_elements = part.n_elements();
    let mut mass = vec![0.0; x.len()];
    let mut initial_volume = Vec::new();
    for element in 0..n_elements {
        let corners = part.corners(element);
        let volume = hex8::volume(&corners.map(|node| x[node as usize]));
        for (node, share) in corners.into_iter().zip(part.shares(element)) {
            mass[node as usize] += material.density * volume * share;
        }
        initial_volume.push(volume);
    }
    let mut fields: [Vec<f64>; N_FIELDS] = std::array::from_fn(|_| vec![0.0; n_elements]);
    fields[field::RELATIVE_VOLUME].fill(1.0);
    fields[field::TEMPERATURE].fill(material.initial_temperature());
    fields[field::ENERGY].fill(material.initial_energy());
    fields[field::PRESSURE].fill(material.initial_pressure());
    Piece {
        part: 0,
        material: 0,
        topology,
        v: vec![[0.0; 3]; x.len()],
        constraint: vec![0; x.len()],
        elements: (0..n_elements as u32).collect(),
        nodes,
        x,
        mass,
        initial_volume,
        fields,
        erosion: None,
        history: material.history().iter().map(|v| vec![v.initial; n_elements]).collect(),
        contact: Vec::new(),
        shells: mechanics::state::ShellState::default(),
        own: Vec::new(),
        hourglass: Hourglass::NONE,
    }
}

/// A piece with this hourglass control, whose forces are zero.
pub fn controlled(piece: Piece, hourglass: Hourglass) -> Piece {
    let n_own = if hourglass.is_elastic() { N_FORCES } else { 0 };
    Piece { own: vec![vec![0.0; piece.elements.len()]; n_own], hourglass, ..piece }
}

/// One element.
pub fn one(material: &Material, corners: &[[f64; 3]; 8]) -> Piece {
    let hexahedra = vec![[0, 1, 2, 3, 4, 5, 6, 7]];
    piece(material, corners.to_vec(), Topology::Explicit { hexahedra })
}

/// An index space of elements of side `h`, its nodes shifted by up to `distortion * h`.
pub fn grid(material: &Material, cells: [u32; 3], h: f64, distortion: f64, seed: u64) -> Piece {
    let mut draws = Draws(seed);
    let mut x = Vec::new();
    for k in 0..=cells[2] {
        for j in 0..=cells[1] {
            for i in 0..=cells[0] {
                let at = [f64::from(i), f64::from(j), f64::from(k)];
                x.push(at.map(|c| h * (c + 2.0 * distortion * draws.next())));
            }
        }
    }
    piece(material, x, Topology::Structured { cells })
}

/// A grid in a state that a run could reach: random velocities, stresses, strains and temperatures.
pub fn stirred(material: &Material, cells: [u32; 3], seed: u64) -> Piece {
    let h = 0.01;
    let mut piece = grid(material, cells, h, 0.12, seed);
    piece.hourglass = Hourglass::viscous(0.1);
    let mut draws = Draws(seed.wrapping_mul(31) | 1);
    for v in &mut piece.v {
        *v = std::array::from_fn(|_| 40.0 * draws.next());
    }
    for element in 0..piece.elements.len() {
        let mut set = |field: usize, value: f64| piece.fields[field][element] = value;
        if material.shear() > 0.0 {
            for component in [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX] {
                set(component, 4e8 * draws.next());
            }
        }
        set(field::ENERGY, material.initial_energy() + 1e7 * (draws.next() + 0.5));
        set(field::RELATIVE_VOLUME, 1.0 + 0.01 * draws.next());
        if !material.history().is_empty() {
            set(field::DAMAGE, (3.0 * draws.next()).clamp(0.0, 1.0));
        }
        if material.failure != Failure::None {
            // Some are whole, some failed.
            set(field::DAMAGE, (3.0 * draws.next()).clamp(0.0, 1.0));
        }
        if material.detonation_speed().is_some() {
            // Some are not lit yet, some burn, some have burnt.
            set(field::TIME_TO_LIGHT, 1e-5 * draws.next());
        }
        use Strength::{Elastic, Hydro};
        if !matches!(material.strength, Hydro | Elastic { .. }) && !material.is_gas() {
            // Some are virgin and cold.
            let strain = draws.next().max(0.0);
            set(field::PLASTIC_STRAIN, strain);
            if material.initial_temperature() > 0.0 {
                set(field::TEMPERATURE, 300.0 + 800.0 * strain);
            }
        }
    }
    for (column, variable) in piece.history.iter_mut().zip(material.history()) {
        // Plain numbers are near those of the start, as stretches are.
        let plain = variable.unit == mechanics::law::Unit::NONE;
        let mut draw = || if plain { 0.05 * draws.next() } else { 1e8 * draws.next().max(0.0) };
        column.iter_mut().for_each(|value| *value = variable.initial + draw());
    }
    piece
}

/// A step without viscosity, with quanta far below `force` and `energy`.
pub fn bare_step(dt: f64, force: f64, energy: f64) -> Step {
    Step {
        dt,
        linear_viscosity: 0.0,
        quadratic_viscosity: 0.0,
        force_quantum: Quantum::for_reference(force, 49),
        energy_quantum: Quantum::for_reference(energy, 49),
        arm: 1.0,
    }
}

/// A step as runs have it, for bodies of [`stirred`].
pub fn full_step(dt: f64) -> Step {
    Step {
        dt,
        linear_viscosity: 0.2,
        quadratic_viscosity: 1.0,
        force_quantum: Quantum::for_reference(3e7, 42),
        energy_quantum: Quantum::for_reference(1e6, 42),
        arm: 1.0,
    }
}

/// Moves the nodes by their velocity.
pub fn advance(block: &mut Block, dt: f64) {
    for axis in 0..3 {
        for node in 0..block.nodes.len() {
            block.x[axis][node] += dt * block.v[axis][node];
        }
    }
}

/// Velocities from forces, and their kinetic energy at the time of the forces (mean of before and after).
pub fn kick(block: &mut Block, dt: f64) -> f64 {
    let mut twice = 0.0;
    for axis in 0..3 {
        for node in 0..block.nodes.len() {
            let before = block.v[axis][node];
            let after = before + dt * block.f[axis][node] / block.mass[node];
            block.v[axis][node] = after;
            twice += block.mass[node] * before * after;
        }
    }
    0.5 * twice
}

/// Forces and votes of all sets.
pub fn compute(block: &mut Block, material: &Material, step: &Step, width: Width) -> ElementVote {
    block.clear_forces();
    let mut vote = ElementVote::default();
    let all = 0..block.n_sets();
    block.compute(material, std::slice::from_ref(&all), step, width, &mut vote);
    vote
}

/// Gives the velocity `field(x)` to every node, moves the nodes by it for `step.dt`, and computes.
pub fn carry(
    block: &mut Block,
    material: &Material,
    step: &Step,
    field: impl Fn([f64; 3]) -> [f64; 3],
) -> ElementVote {
    for node in 0..block.nodes.len() {
        let v = field(std::array::from_fn(|axis| block.x[axis][node]));
        for (array, v) in block.v.iter_mut().zip(v) {
            array[node] = v;
        }
    }
    advance(block, step.dt);
    compute(block, material, step, Width::best())
}

/// Swells a cube evenly to `v` in 1000 steps without viscosity; calls `see` with volume and pressure after each.
pub fn swell(material: &Material, piece: &Piece, v: f64, mut see: impl FnMut(f64, f64)) {
    let mut block = Block::new(piece);
    let before = block.field(0, field::RELATIVE_VOLUME);
    let side = (v / before).powf(1.0 / 3e3);
    // v = g x with the end positions x (1 + g dt): the sides grow by the same ratio in every step.
    let step = bare_step(1e-6, 1e12, 1e12);
    for _ in 0..1000 {
        let g = (side - 1.0) / step.dt;
        carry(&mut block, material, &step, |x| x.map(|c| g * c));
        see(block.field(0, field::RELATIVE_VOLUME), block.field(0, field::PRESSURE));
    }
}

/// Cauchy stress of an element, by rows.
pub fn stress(block: &Block, element: usize) -> [[f64; 3]; 3] {
    let s = |field: usize| block.field(element, field);
    let (xx, yy, p) = (s(field::SXX), s(field::SYY), s(field::PRESSURE));
    let (xy, yz, zx) = (s(field::SXY), s(field::SYZ), s(field::SZX));
    [[xx - p, xy, zx], [xy, yy - p, yz], [zx, yz, -(xx + yy) - p]]
}

pub fn force(block: &Block, node: usize) -> [f64; 3] {
    std::array::from_fn(|axis| block.f[axis][node])
}

/// Largest magnitude of a force component over the nodes.
pub fn largest_force(block: &Block) -> f64 {
    block.f.iter().flatten().fold(0.0, |largest: f64, f| largest.max(f.abs()))
}
