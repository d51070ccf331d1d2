//! Watches the energy of fragments: pieces of solid parts that erosion has cut off.
//!
//! The ledger of a body ([`crate::run_totals`]) sums whole parts, so a small fragment whose time step were wrong could gain energy there
//! unseen. A fragment whose momentum has not changed was pushed by nothing, and what is left of its energy, apart from its flight,
//! may not rise. [`Watch`] compares each state that is written with the one before; a fragment whose energy has more than doubled
//! is named in the summary. Fragments are told apart by their elements: elements leave and never come, so the lowest element and the number
//! of elements are enough.

use std::{collections::HashMap, fmt};

use mechanics::{
    mesh::Mesh,
    rigid::Body,
    state::{GlobalState, field},
};

/// Change of momentum, over the sum of its magnitudes, below which nothing has pushed a fragment: inner forces add up to zero exactly, so
/// only the rounding of velocities is left.
const UNPUSHED: f64 = 1e-10;
/// How many times its energy a fragment may have. Kinetic energy is that of half a step before, so the sum of a fragment that vibrates
/// wavers, by a third where the wave is as short as the mesh.
const GAIN: f64 = 2.0;
/// Most fragments that are named.
const NAMED: usize = 10;

/// A fragment that gained energy though nothing pushed it.
#[derive(Clone, Debug, PartialEq)]
pub struct Runaway {
    /// Name of the part of its lowest element.
    pub part: String,
    /// That element, by its number in the part, from 1.
    pub element: usize,
    /// Number of elements.
    pub n_elements: usize,
    /// Energy without that of its flight, when it was first seen so, and now.
    pub energies: [f64; 2],
    /// The two times.
    pub times: [f64; 2],
}

impl fmt::Display for Runaway {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { part, element, n_elements, energies: [before, now], times: [from, to] } = self;
        write!(
            f,
            "a fragment of {n_elements} elements of part \"{part}\" (element {element} and others) gained energy from {before:.3e} to \
             {now:.3e} between {from:.4e} and {to:.4e} though nothing pushed it; do not trust it, and lower control.safety_factor"
        )
    }
}

/// A fragment in one state.
#[derive(Clone, Copy, Debug, Default)]
struct Fragment {
    /// Lowest element.
    first: usize,
    n_elements: usize,
    mass: f64,
    momentum: [f64; 3],
    /// Sum of mass times speed over its nodes.
    speed: f64,
    kinetic: f64,
    internal: f64,
    /// Energy and time when it was first seen with this momentum.
    since: (f64, f64),
}

impl Fragment {
    /// Energy without that of its flight.
    fn energy(&self) -> f64 {
        let flight = 0.5 * self.momentum.iter().map(|p| p * p).sum::<f64>() / self.mass;
        self.kinetic - flight + self.internal
    }

    /// Whether it is the same fragment and nothing pushed it since.
    fn is_unpushed_since(&self, before: &Self) -> bool {
        let moved = (0..3).map(|a| (self.momentum[a] - before.momentum[a]).abs()).fold(0.0, f64::max);
        self.n_elements == before.n_elements && moved <= UNPUSHED * self.speed.max(before.speed)
    }
}

/// The fragments of the newest state that was written, and those that gained energy so far.
#[derive(Default)]
pub struct Watch {
    /// Cycle of that state.
    cycle: Option<u64>,
    /// By lowest element.
    fragments: HashMap<usize, Fragment>,
    /// By lowest element and number of elements, as it was seen last.
    runaways: HashMap<(usize, usize), Runaway>,
}

impl Watch {
    /// Compares the fragments of a state with those of the state before. A state that was seen already, since the run went back, says
    /// nothing new.
    pub fn see(&mut self, mesh: &Mesh, bodies: &[Body], state: &GlobalState) {
        if self.cycle.is_some_and(|cycle| state.cycle <= cycle) || state.n_eroded() == 0 {
            return;
        }
        self.cycle = Some(state.cycle);
        let mut now = fragments(mesh, bodies, state);
        for (first, fragment) in &mut now {
            fragment.since = (fragment.energy(), state.time);
            let Some(before) = self.fragments.get(first) else { continue };
            if !fragment.is_unpushed_since(before) {
                continue;
            }
            fragment.since = before.since;
            let (energy, (at_first, since)) = (fragment.energy(), fragment.since);
            if energy > GAIN * at_first.max(0.0) && energy > 0.0 {
                let (part, element) = place(mesh, *first);
                let runaway = Runaway {
                    part,
                    element: element + 1,
                    n_elements: fragment.n_elements,
                    energies: [at_first, energy],
                    times: [since, state.time],
                };
                self.runaways.insert((*first, fragment.n_elements), runaway);
            }
        }
        self.fragments = now;
    }

    /// The fragments that gained most, by what they gained; the lower element first where two gained the same.
    pub fn take_runaways(&mut self) -> Vec<Runaway> {
        let mut all: Vec<_> = std::mem::take(&mut self.runaways).into_iter().collect();
        let gain = |runaway: &Runaway| runaway.energies[1] - runaway.energies[0];
        all.sort_by(|(a, of_a), (b, of_b)| gain(of_b).total_cmp(&gain(of_a)).then(a.cmp(b)));
        all.truncate(NAMED);
        all.into_iter().map(|(_, runaway)| runaway).collect()
    }
}

/// Name of the part of an element, and its number there.
fn place(mesh: &Mesh, element: usize) -> (String, usize) {
    let offsets = mesh.element_offsets();
    let part = offsets.partition_point(|&offset| offset <= element) - 1;
    (mesh.parts[part].name.clone(), element - offsets[part])
}

/// The fragments of a state, by their lowest element: elements that share nodes, directly or by others. Those that hold a shell, a truss or
/// a node that something holds or a rigid body moves are left out: their energy is not all in solids, or others push them.
fn fragments(mesh: &Mesh, bodies: &[Body], state: &GlobalState) -> HashMap<usize, Fragment> {
    let offsets = mesh.element_offsets();
    let living = || {
        mesh.parts.iter().zip(&offsets).flat_map(|(part, &offset)| {
            (0..part.n_elements())
                .filter(move |local| !state.is_eroded(offset + local))
                .map(move |local| (part, offset + local, part.nodes_of(local)))
        })
    };
    let mut roots: Vec<u32> = (0..mesh.n_nodes() as u32).collect();
    let mut bound: Vec<bool> = state.constraint.iter().map(|&constraint| constraint != 0).collect();
    for &node in bodies.iter().flat_map(|body| &body.nodes) {
        bound[node as usize] = true;
    }
    for (part, _, nodes) in living() {
        for &node in &nodes[1..] {
            join(&mut roots, nodes[0], node);
        }
        bound[nodes[0] as usize] |= part.n_corners() < 8;
    }
    let mut found: HashMap<u32, Fragment> = HashMap::new();
    for (_, element, nodes) in living() {
        let fragment = found
            .entry(root(&mut roots, nodes[0]))
            .or_insert_with(|| Fragment { first: element, ..Fragment::default() });
        fragment.n_elements += 1;
        fragment.internal += state.initial_volume[element] * state.elements[field::ENERGY][element];
    }
    for (node, &bound) in (0..).zip(&bound) {
        let root = root(&mut roots, node);
        if bound {
            found.remove(&root);
        }
        let Some(fragment) = found.get_mut(&root) else { continue };
        let (mass, v) = (state.mass[node as usize], state.v[node as usize]);
        let squared: f64 = v.iter().map(|v| v * v).sum();
        fragment.mass += mass;
        fragment.speed += mass * squared.sqrt();
        fragment.kinetic += 0.5 * mass * squared;
        for axis in 0..3 {
            fragment.momentum[axis] += mass * v[axis];
        }
    }
    found.into_values().map(|fragment| (fragment.first, fragment)).collect()
}

/// The lowest node of the fragment of a node; paths are halved on the way.
fn root(roots: &mut [u32], mut node: u32) -> u32 {
    while roots[node as usize] != node {
        roots[node as usize] = roots[roots[node as usize] as usize];
        node = roots[node as usize];
    }
    node
}

fn join(roots: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(roots, a), root(roots, b));
    roots[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use mechanics::{initial, state::ALIVE};

    use super::*;

    /// A row of five cubes of which the middle one has gone: two fragments of two cubes, which fly at 100 m/s and breathe.
    fn broken() -> (deck::Model, GlobalState) {
        let model = deck::read(
            r#"
            title = "a row of cubes"
            units = "mm-ms-kg"
            [control]
            end_time = 1.0
            [[part]]
            name = "row"
            material = "STEEL_4340"
            velocity = [100, 0, 0]
            box = { origin = [0, 0, 0], size = [5, 1, 1], cells = [5, 1, 1] }
            erosion = { plastic_strain = 1.0 }
            "#,
            "row.toml",
        )
        .unwrap_or_else(|faults| panic!("{faults:?}"));
        let mut state = initial::state(&model.mesh, &model.setup, &model.velocity, &model.constraint)
            .expect("a good deck");
        state.cycle = 10;
        state.eroded = vec![ALIVE, ALIVE, 7, ALIVE, ALIVE];
        for (v, x) in state.v.iter_mut().zip(&state.x) {
            v[1] = if x[1] == 0.0 { 1.0 } else { -1.0 };
        }
        (model, state)
    }

    /// Makes what moves across the flight of the nodes beyond `x` faster, and keeps the momentum.
    fn shake(state: &mut GlobalState, beyond: f64, factor: f64) {
        let far: Vec<usize> = (0..state.x.len()).filter(|&node| state.x[node][0] > beyond).collect();
        for node in far {
            state.v[node][1] *= factor;
        }
    }

    fn see(watch: &mut Watch, (model, state): &(deck::Model, GlobalState)) {
        watch.see(&model.mesh, &model.setup.bodies, state);
    }

    #[test]
    fn a_fragment_that_gains_energy_in_flight_is_named_and_its_twin_is_not() {
        let (mut watch, mut run) = (Watch::default(), broken());
        see(&mut watch, &run);
        for _ in 0..3 {
            run.1.cycle += 10;
            run.1.time += 0.1;
            shake(&mut run.1, 2.5, 1.3);
            see(&mut watch, &run);
        }
        let named = watch.take_runaways();
        assert_eq!(named.len(), 1, "{named:?}");
        let Runaway { part, element, n_elements, energies, times } = &named[0];
        assert_eq!((part.as_str(), *element, *n_elements), ("row", 4, 2));
        assert!((energies[1] / energies[0] - 1.3_f64.powi(6)).abs() < 1e-9, "{energies:?}");
        assert_eq!(times[0], 0.0);
        assert!((times[1] - 0.3).abs() < 1e-12);
        assert!(named[0].to_string().contains("2 elements of part \"row\" (element 4"), "{}", named[0]);
    }

    #[test]
    fn a_fragment_that_was_pushed_or_lost_elements_or_is_held_is_not_judged() {
        let calm = |change: &dyn Fn(&mut GlobalState)| {
            let (mut watch, mut run) = (Watch::default(), broken());
            see(&mut watch, &run);
            run.1.cycle += 10;
            shake(&mut run.1, 2.5, 3.0);
            change(&mut run.1);
            see(&mut watch, &run);
            watch.take_runaways().is_empty()
        };
        assert!(!calm(&|_| ()));
        assert!(calm(&|state| state.v.iter_mut().for_each(|v| v[0] += 1.0)));
        assert!(calm(&|state| state.eroded[4] = 15));
        assert!(calm(&|state| state.constraint.iter_mut().for_each(|constraint| *constraint = 1)));
        // A state that was seen before the run went back.
        assert!(calm(&|state| state.cycle = 10));
    }
}
