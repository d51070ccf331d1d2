//! What is known while a problem becomes a typed deck, and what most of its stages ask for.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    motion::{integrals, rates},
    reference::References,
    switch::Switched,
};
use crate::{
    fault::short,
    keyword::{condition::Target, prescribed::Meaning, problem::Problem},
    limits::MAX_CURVE_POINTS,
    log::Log,
    mesh_file::MeshFile,
    place::{Place, Placed},
    table::holds,
    typed::{
        Deck,
        condition::{Curve, made},
        mesh::Mesh,
    },
    units::SETS,
};

/// A deck on the way.
pub(super) struct Translation<'p> {
    pub(super) problem: &'p Problem,
    pub(super) log: &'p Log<'p>,
    pub(super) mesh_name: &'p str,
    pub(super) deck: Deck,
    pub(super) mesh: MeshFile,
    /// Places of the elements of each body.
    pub(super) places: Vec<Vec<Place>>,
    /// Nodes that elements have.
    pub(super) used: BTreeSet<u32>,
    /// Nodes that shells have.
    pub(super) turns: BTreeSet<u32>,
    /// Names of the parts that have elements, by number.
    pub(super) names: BTreeMap<u32, String>,
    /// Thickness of the shells of each part that has any.
    pub(super) thicknesses: BTreeMap<u32, f64>,
    /// Parts whose section does not go with their elements or is not there, which was reported.
    pub(super) without_section: BTreeSet<u32>,
    /// Curves that were referred to: name and points.
    curves: BTreeMap<String, (Place, Vec<[f64; 2]>)>,
    /// Parts that are rigid.
    pub(super) bodies: Bodies,
    /// Parts that are rigid for a time.
    pub(super) switched: Switched,
    /// Nodes without elements that go with rigid bodies.
    pub(super) references: References,
    /// Pairs of parts that meet, lower number first.
    pub(super) met: BTreeSet<(u32, u32)>,
}

impl<'p> Translation<'p> {
    pub(super) fn new(problem: &'p Problem, mesh_name: &'p str, log: &'p Log<'p>) -> Self {
        Self {
            problem,
            log,
            mesh_name,
            deck: Deck::new(String::new(), SETS[0]),
            mesh: MeshFile::default(),
            places: Vec::new(),
            used: BTreeSet::new(),
            turns: BTreeSet::new(),
            names: BTreeMap::new(),
            thicknesses: BTreeMap::new(),
            without_section: BTreeSet::new(),
            curves: BTreeMap::new(),
            bodies: Bodies::default(),
            switched: Switched::default(),
            references: References::default(),
            met: BTreeSet::new(),
        }
    }

    /// The deck with the curves that it refers to, and its mesh.
    pub(super) fn into_deck(mut self) -> (Deck, Mesh) {
        for (name, (at, points)) in self.curves {
            self.deck.curves.push(Curve { name: Some(made(name, at)), points });
        }
        (self.deck, Mesh { file: self.mesh, elements: self.places })
    }

    /// A number that was reckoned from those of the deck; one that a deck may not give is a fault.
    pub(super) fn number(&self, at: Place, what: &str, x: f64) -> f64 {
        if !holds(x) {
            let expected = "a magnitude from 1e-60 to 1e60, or 0";
            self.log.fault(at, format!("{what} {x:e}"), expected, "choose other units");
        }
        // Minus zero is zero.
        x + 0.0
    }

    pub(super) fn vector(&self, at: Place, what: &str, v: [f64; 3]) -> [f64; 3] {
        v.map(|x| self.number(at, what, x))
    }

    /// A vector of a coordinate system in global components.
    pub(super) fn turned(&self, v: [f64; 3], system: u32, at: Place) -> [f64; 3] {
        match self.directions(system, at) {
            Some(axes) => [0, 1, 2].map(|a| (0..3).map(|i| v[i] * axes[i][a]).sum()),
            None => v,
        }
    }

    /// Directions of a system; none for the global one.
    pub(super) fn directions(&self, system: u32, at: Place) -> Option<[[f64; 3]; 3]> {
        let found = self.problem.systems.get(&system).copied();
        if system != 0 && found.is_none() {
            let words = format!("coordinate system {system}");
            self.log.fault(at, words, "a *DEFINE_COORDINATE of the deck", "define it");
        }
        found
    }

    /// Nodes with elements that something speaks of, ascending.
    pub(super) fn nodes(&self, target: Target, at: Place) -> Vec<u32> {
        let mut nodes = self.named(target, at);
        nodes.retain(|node| self.used.contains(node));
        nodes
    }

    /// Nodes that something speaks of, ascending, with elements or without.
    pub(super) fn named(&self, target: Target, at: Place) -> Vec<u32> {
        let (problem, log) = (self.problem, self.log);
        match target {
            Target::All => self.used.iter().copied().collect(),
            Target::Node(id) => {
                if problem.position(id).is_none() {
                    log.fault(at, format!("node {id}"), "a node of the deck", "correct the number");
                }
                vec![id]
            }
            Target::NodeSet(id) => problem.node_set(id, at, log),
            Target::Part(id) => {
                if !problem.parts.contains_key(&id) {
                    log.fault(at, format!("part {id}"), "a part of the deck", "correct the number");
                }
                problem.nodes_of_part(id)
            }
            Target::PartSet(id) => {
                let parts = problem.part_set(id, at, log);
                let all: BTreeSet<u32> = parts.iter().flat_map(|p| problem.nodes_of_part(*p)).collect();
                all.into_iter().collect()
            }
        }
    }

    /// Keeps a set of nodes in the mesh under a name.
    pub(super) fn set(&mut self, name: &str, nodes: Vec<u32>, at: Place) -> Placed<String> {
        self.mesh.sets.insert(name.to_string(), nodes);
        made(name.to_string(), at)
    }

    /// The points of a curve that something at `at` refers to; none after a fault.
    pub(super) fn points(&self, id: u32, at: Place) -> Option<&'p [[f64; 2]]> {
        let (problem, log) = (self.problem, self.log);
        let Some(curve) = problem.curves.get(&id) else {
            match problem.other_curves.get(&id) {
                Some((other, word)) => log.fault(
                    at,
                    format!("curve {id}, which the *{word} at {} makes", log.line(*other, at)),
                    "a *DEFINE_CURVE of the deck",
                    "give it points, abscissa and ordinate",
                ),
                None => log.fault(at, format!("curve {id}"), "a *DEFINE_CURVE of the deck", "define it"),
            }
            return None;
        };
        if let Some(origin) = curve.relaxation {
            let expected = "SIDR 0 or 2 of a curve that acts in the run itself";
            log.fault_of(
                origin,
                expected,
                format!("correct it; {} takes this curve", log.line(at, origin.at)),
            );
        }
        Some(&curve.points)
    }

    /// The name of a curve of the deck, which is then written; as a velocity where it means something else.
    pub(super) fn curve(&mut self, id: u32, meaning: Meaning, at: Place) -> Option<Placed<String>> {
        let given = self.points(id, at)?;
        let offset = self.problem.curves.get(&id).map_or(0.0, |curve| curve.offset);
        let points = &shifted(given, offset);
        let (name, points) = match meaning {
            Meaning::Velocity => (format!("curve {id}"), points.clone()),
            Meaning::Displacement => (format!("rate of curve {id}"), rates(points)),
            Meaning::Acceleration => (format!("integral of curve {id}"), integrals(points)),
            Meaning::Profile if points.len() > given.len() => (format!("profile {id}"), given.to_vec()),
            Meaning::Profile => (format!("curve {id}"), given.to_vec()),
        };
        if !self.curves.contains_key(&name) {
            let start = value_at_start(&shifted(given, offset));
            if meaning == Meaning::Displacement && start != 0.0 {
                let words = format!(
                    "curve {id} of a displacement is {} at time 0: nodes move on from there, without that step",
                    short(start)
                );
                self.log.warn(at, words);
            }
            if points.len() > MAX_CURVE_POINTS {
                let read = format!("{name} with {} points", points.len());
                self.log.fault(at, read, format!("at most {MAX_CURVE_POINTS}"), "leave out some");
            }
            let wrong = points.iter().flatten().copied().find(|x| !holds(*x));
            wrong.inspect(|x| {
                self.number(at, &format!("{name} with"), *x);
            });
            let points = points.into_iter().map(|p| p.map(|x| x + 0.0)).collect();
            self.curves.insert(name.clone(), (at, points));
        }
        Some(made(name, at))
    }
}

/// Points of a curve of time that was shifted to later times: before that LS-DYNA has 0.
fn shifted(points: &[[f64; 2]], offset: f64) -> Vec<[f64; 2]> {
    let mut list = points.to_vec();
    let end = 0.999 * offset;
    if offset > 0.0 && points[0][0] > end && points[0][1] != 0.0 {
        list.splice(0..0, [[0.0, 0.0], [end, 0.0]]);
    }
    list
}

/// The value of a curve at time 0.
fn value_at_start(points: &[[f64; 2]]) -> f64 {
    let next = points.iter().position(|point| point[0] >= 0.0);
    match next {
        Some(0) => points[0][1],
        Some(next) => {
            let ([t, a], [end, b]) = (points[next - 1], points[next]);
            a - t / (end - t) * (b - a)
        }
        None => points.last().map_or(0.0, |point| point[1]),
    }
}

/// The rigid bodies of a deck.
#[derive(Default)]
pub(super) struct Bodies {
    /// The part that leads the body of each rigid part that has elements.
    pub(super) lead: BTreeMap<u32, u32>,
    /// Velocity and angular velocity at the start by the part that leads, of those that have a card of their own.
    pub(super) starts: BTreeMap<u32, [[f64; 3]; 2]>,
}

impl Bodies {
    /// The part that leads the body of a part; none of parts that deform.
    pub(super) fn of(&self, part: u32) -> Option<u32> {
        self.lead.get(&part).copied()
    }

    /// Whether two parts are one body.
    pub(super) fn same(&self, a: u32, b: u32) -> bool {
        self.of(a).is_some() && self.of(a) == self.of(b)
    }

    /// Makes one body of those of two parts; that of `lead` leads.
    pub(super) fn join(&mut self, lead: u32, part: u32) {
        let (lead, old) = (self.of(lead), self.of(part));
        for body in self.lead.values_mut() {
            if let Some(lead) = lead.filter(|_| Some(*body) == old) {
                *body = lead;
            }
        }
    }
}
