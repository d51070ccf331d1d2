//! Small worlds: meshes of blocks, and a whole contact on one worker.

use mechanics::{
    contact::{
        Batch, Contact, ContactVote, Exclusions, Settings, Surface, WorkUnit, initial_edges, initial_pairs,
        sort,
    },
    exact::Quantum,
    lanes::Width,
    material::{Eos, Failure, Material, Strength},
    mesh::{Mesh, Part, Topology},
};

/// Bulk modulus of all test materials.
pub const BULK: f64 = 1.0;

/// A seeded generator of numbers in 0..1.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn point(&mut self, low: f64, high: f64) -> [f64; 3] {
        [0; 3].map(|_| self.within(low, high))
    }
}

pub fn materials() -> Vec<Material> {
    vec![Material {
        name: "test".into(),
        density: 1.0,
        eos: Eos::Linear { bulk: BULK },
        strength: Strength::Hydro,
        failure: Failure::None,
    }]
}

/// Adds a block of `cells` elements of size `h` whose lowest corner is `origin`.
pub fn add_block(mesh: &mut Mesh, cells: [u32; 3], origin: [f64; 3], h: f64) {
    let first = mesh.positions.len() as u32;
    for k in 0..=cells[2] {
        for j in 0..=cells[1] {
            for i in 0..=cells[0] {
                let n = [i, j, k];
                mesh.positions.push([0, 1, 2].map(|a| origin[a] + h * f64::from(n[a])));
            }
        }
    }
    let last = mesh.positions.len() as u32;
    mesh.node_ids.extend(first + 1..=last);
    let n_elements: u32 = cells.iter().product();
    mesh.parts.push(Part {
        name: format!("block {}", mesh.parts.len()),
        material: 0,
        topology: Topology::Structured { cells },
        nodes: (first..last).collect(),
        element_ids: (1..=n_elements).collect(),
        hourglass: mechanics::element::hourglass::Hourglass::VISCOUS,
    });
}

/// Moves every node.
pub fn deform(mesh: &mut Mesh, mut map: impl FnMut([f64; 3]) -> [f64; 3]) {
    mesh.positions.iter_mut().for_each(|x| *x = map(*x));
}

/// Settings with one friction coefficient and one matrix entry for all pairs of parts.
pub fn settings(n_parts: usize, gap: f64, slack: f64) -> Settings {
    Settings {
        gap,
        slack,
        friction: vec![0.0; n_parts * n_parts],
        interacts: vec![true; n_parts * n_parts],
        stiffness: 0.5,
        friction_velocity: 1e-3,
        ..Settings::default()
    }
}

/// Only different parts interact.
pub fn without_self(mut settings: Settings) -> Settings {
    let n = settings.n_parts();
    (0..n).for_each(|p| settings.interacts[p * n + p] = false);
    settings
}

pub fn on_surface(surface: &Surface, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    surface.nodes.iter().map(|&n| positions[n as usize]).collect()
}

/// Contact of a whole mesh in one batch, with its arrays.
pub struct World {
    pub surface: Surface,
    pub settings: Settings,
    pub batch: Batch,
    pub contact: Contact,
    pub x: [Vec<f64>; 3],
    pub v: [Vec<f64>; 3],
    pub f: [Vec<f64>; 3],
    pub force_quantum: Quantum,
    pub energy_quantum: Quantum,
}

impl World {
    /// Every node has mass 1. `alive` says which elements there are.
    pub fn new(mesh: &Mesh, settings: Settings, alive: &dyn Fn(u32) -> bool) -> Self {
        // Springs at full stiffness wherever a node sits, so that forces are known in closed form; the share of rims and
        // corners has a test of its own.
        let mut surface = Surface::new(mesh, &materials(), alive);
        surface.node_share.fill(1.0);
        if settings.edges {
            surface.find_edges(mesh);
        }
        let x = on_surface(&surface, &mesh.positions);
        let pairs = initial_pairs(&surface, &x, &settings);
        let crossing = initial_edges(&surface, &x, &settings);
        let exclusions = Exclusions::new(&surface, &pairs).with_edges(&surface, &crossing);
        let units = sort(&surface, &x, &settings, &exclusions);
        let all: Vec<&WorkUnit> = units.iter().collect();
        let batch = Batch::gather(&surface, &all, &|_| 1.0, &exclusions);
        let x = [0, 1, 2]
            .map(|a| batch.nodes.iter().map(|n| mesh.positions[n.global as usize][a]).collect::<Vec<f64>>());
        let contact = Contact::new(&batch, &settings, &x, Width::best());
        let zero = vec![0.0; batch.nodes.len()];
        Self {
            surface,
            settings,
            contact,
            x,
            v: [0; 3].map(|_| zero.clone()),
            f: [0; 3].map(|_| zero.clone()),
            batch,
            // Finer than in a run, so that the tests see geometry and not the quantum.
            force_quantum: Quantum::for_reference(1.0, 50),
            energy_quantum: Quantum::for_reference(1.0, 50),
        }
    }

    /// Batch index of a global node.
    pub fn index(&self, global: u32) -> usize {
        self.batch.nodes.binary_search_by_key(&global, |n| n.global).expect("the node is on the surface")
    }

    pub fn place(&mut self, index: usize, p: [f64; 3]) {
        (0..3).for_each(|a| self.x[a][index] = p[a]);
    }

    /// Forces from zero.
    pub fn forces(&mut self, dt: f64) -> ContactVote {
        self.f.iter_mut().for_each(|f| f.fill(0.0));
        self.contact.forces(&self.x, &self.v, dt, self.force_quantum, self.energy_quantum, &mut self.f)
    }

    pub fn force_on(&self, index: usize) -> [f64; 3] {
        [0, 1, 2].map(|a| self.f[a][index])
    }
}

/// A body of which `alive` elements exist, and a free node: the first of a far cube, whose faces take no part.
/// Every pair is on the candidate list, so the node may be placed anywhere.
pub fn with_probe(mut mesh: Mesh, gap: f64, alive: &dyn Fn(u32) -> bool) -> (World, usize) {
    let probe = mesh.parts.len();
    let first = mesh.positions.len() as u32;
    let first_element = mesh.n_elements() as u32;
    add_block(&mut mesh, [1, 1, 1], [-500.0; 3], 1.0);
    let mut settings = settings(probe + 1, gap, 1e4);
    for a in 0..=probe {
        for b in 0..=probe {
            settings.interacts[a * (probe + 1) + b] = (a == probe) != (b == probe);
        }
    }
    let mut world = World::new(&mesh, settings, &|e| e >= first_element || alive(e));
    let faces = &world.batch.faces;
    for unit in &mut world.batch.units {
        unit.faces.retain(|&f| faces[f as usize].part != probe as u32);
    }
    world.contact = Contact::new(&world.batch, &world.settings, &world.x, Width::best());
    let index = world.index(first);
    (world, index)
}

pub fn block(cells: [u32; 3], h: f64) -> Mesh {
    let mut mesh = Mesh::default();
    add_block(&mut mesh, cells, [0.0; 3], h);
    mesh
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
