//! What nodes start with, what holds, moves, pushes and stops them, in the words of a TOML deck.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::{
    super::{
        condition::{AXES_OF_CODE, Meaning, Target},
        draft::vector,
        log::Place,
        problem::{cross, minus, unit},
    },
    AXES, MAX_FORCES, Translation,
    motion::{integrals, rates},
};

impl Translation<'_> {
    /// Initial velocities by node, and rotation rates that are not zero; later ones replace earlier ones.
    pub(super) fn velocities(&self) -> (BTreeMap<u32, [f64; 3]>, BTreeMap<u32, [f64; 3]>) {
        let (problem, log) = (self.problem, self.log);
        let (mut list, mut spins) = (BTreeMap::new(), BTreeMap::new());
        for given in &problem.conditions.velocities {
            let turned = |v| self.turned(v, given.system, given.at);
            let (v, spin) = (turned(given.velocity), turned(given.spin));
            let own = turned(given.own_turn);
            let inside = (given.inside != 0).then(|| problem.within(given.inside, given.at, log));
            let except =
                if given.except != 0 { problem.node_set(given.except, given.at, log) } else { Vec::new() };
            for node in self.nodes(given.target, given.at) {
                let Some(x) = problem.position(node) else { continue };
                if except.binary_search(&node).is_ok() || inside.as_ref().is_some_and(|inside| !inside(x)) {
                    continue;
                }
                let round = cross(spin, minus(x, given.point));
                list.insert(node, [0, 1, 2].map(|a| v[a] + round[a]));
                let turn = [0, 1, 2].map(|a| spin[a] + own[a]);
                if turn == [0.0; 3] {
                    spins.remove(&node);
                } else {
                    spins.insert(node, turn);
                }
            }
        }
        (list, spins)
    }

    /// A vector of a coordinate system in global components.
    pub(super) fn turned(&self, v: [f64; 3], system: u32, at: Place) -> [f64; 3] {
        match self.directions(system, at) {
            Some(axes) => [0, 1, 2].map(|a| (0..3).map(|i| v[i] * axes[i][a]).sum()),
            None => v,
        }
    }

    /// Directions of a system; none for the global one.
    fn directions(&self, system: u32, at: Place) -> Option<[[f64; 3]; 3]> {
        let found = self.problem.systems.get(&system).copied();
        if system != 0 && found.is_none() {
            let words = format!("coordinate system {system}");
            self.log.fault(at, words, "a *DEFINE_COORDINATE of the deck", "define it");
        }
        found
    }

    /// Nodes with elements that something speaks of, ascending.
    fn nodes(&self, target: Target, at: Place) -> Vec<u32> {
        let (problem, log) = (self.problem, self.log);
        let mut nodes = match target {
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
        };
        nodes.retain(|node| self.used.contains(node));
        nodes
    }

    /// Keeps a set of nodes in the mesh file under a name.
    fn set(&mut self, name: &str, nodes: Vec<u32>) -> String {
        self.mesh.sets.insert(name.to_string(), nodes);
        name.to_string()
    }

    /// What is held at rest, by the axes that are.
    pub(super) fn held(&mut self) {
        let (problem, log) = (self.problem, self.log);
        // By node: translations, then rotations.
        let mut of_node: BTreeMap<u32, ([[bool; 3]; 2], Place)> = BTreeMap::new();
        let mut hold = |node: u32, axes: [[bool; 3]; 2], at: Place| {
            let entry = of_node.entry(node).or_insert(([[false; 3]; 2], at));
            for (all, new) in entry.0.iter_mut().flatten().zip(axes.iter().flatten()) {
                *all |= new;
            }
        };
        for node in problem.nodes.iter().filter(|node| node.held != [0; 2] && self.used.contains(&node.id)) {
            hold(node.id, node.held.map(|code| AXES_OF_CODE[usize::from(code)]), node.at);
        }
        for given in &problem.conditions.held {
            let [x, y, z, turn_x, turn_y, turn_z] = given.axes;
            let directions = self.directions(given.system, given.at);
            let axes = [[x, y, z], [turn_x, turn_y, turn_z]].map(|local| {
                let Some(directions) = directions.filter(|_| local != [true; 3]) else { return local };
                let mut axes = [false; 3];
                for (direction, _) in directions.iter().zip(local).filter(|(_, held)| *held) {
                    match (0..3).find(|a| direction[*a].abs() > 1.0 - 1e-9) {
                        Some(axis) => axes[axis] = true,
                        None => log.fault(
                            given.at,
                            format!("nodes held along {direction:?}"),
                            "a direction along x, y or z",
                            "turn the mesh so that symmetry planes are those of the axes",
                        ),
                    }
                }
                axes
            });
            for node in self.nodes(given.target, given.at) {
                hold(node, axes, given.at);
            }
        }
        let mut groups: BTreeMap<[[bool; 3]; 2], (Place, Vec<u32>)> = BTreeMap::new();
        for (node, (axes, at)) in of_node {
            // Only nodes of shells turn.
            let axes = [axes[0], if self.turns.contains(&node) { axes[1] } else { [false; 3] }];
            if axes == [[false; 3]; 2] {
                continue;
            }
            let group = groups.entry(axes).or_insert((at, Vec::new()));
            group.0 = group.0.min(at);
            group.1.push(node);
        }
        for (axes, (at, nodes)) in groups {
            let [letters, turns] =
                axes.map(|axes| (0..3).filter(|a| axes[*a]).map(|a| AXES[a]).collect::<String>());
            let name = match (letters.as_str(), turns.as_str()) {
                (letters, "") => format!("held {letters}"),
                (letters, turns) => format!("held {letters} turned {turns}"),
            };
            let set = self.set(&name, nodes);
            self.draft.heading(at, "[[boundary]]");
            self.draft.line(at, "type = \"fixed\"");
            self.draft.line(at, format!("axes = \"{letters}\""));
            if !turns.is_empty() {
                self.draft.line(at, format!("rotations = \"{turns}\""));
            }
            self.draft.line(at, format!("nodes = \"{set}\""));
        }
    }

    /// Motions by curve.
    pub(super) fn motions(&mut self) {
        let problem = self.problem;
        for (n, given) in problem.conditions.motions.iter().enumerate() {
            let nodes = self.nodes(given.target, given.at);
            let Some(curve) = self.curve(given.curve, given.meaning, given.at) else { continue };
            if nodes.is_empty() {
                self.log.warn(given.at, "a motion of no node that has an element");
                continue;
            }
            let set = self.set(&format!("motion {}", n + 1), nodes);
            self.draft.heading(given.at, "[[boundary]]");
            self.draft.line(given.at, "type = \"velocity\"");
            self.draft.line(given.at, format!("nodes = \"{set}\""));
            let drive = format!("{{ curve = \"{curve}\", factor = {:?} }}", given.factor);
            self.draft.line(given.at, format!("velocity = {{ {} = {drive} }}", AXES[given.axis]));
        }
    }

    /// The name of a curve of the deck, which is then written; as a velocity where it means something else.
    pub(super) fn curve(&mut self, id: u32, meaning: Meaning, at: Place) -> Option<String> {
        let Some(curve) = self.problem.curves.get(&id) else {
            self.log.fault(at, format!("curve {id}"), "a *DEFINE_CURVE of the deck", "define it");
            return None;
        };
        let (name, points) = match meaning {
            Meaning::Velocity => (format!("curve {id}"), curve.points.clone()),
            Meaning::Displacement => (format!("rate of curve {id}"), rates(&curve.points)),
            Meaning::Acceleration => (format!("integral of curve {id}"), integrals(&curve.points)),
        };
        self.curves.insert(name.clone(), (at, points));
        Some(name)
    }

    pub(super) fn write_curves(&mut self) {
        for (name, (at, points)) in std::mem::take(&mut self.curves) {
            self.draft.heading(at, "[[curve]]");
            self.draft.line(at, format!("name = \"{name}\""));
            let list: Vec<String> = points.iter().map(|[t, y]| format!("[{t:?}, {y:?}]")).collect();
            self.draft.line(at, format!("points = [{}]", list.join(", ")));
        }
    }

    /// Forces, alike ones together.
    pub(super) fn forces(&mut self) {
        let problem = self.problem;
        // By curve, axis and factor: how often each node is named.
        type Group = (Place, BTreeMap<u32, u32>);
        let mut groups: BTreeMap<(u32, usize, u64), Group> = BTreeMap::new();
        for given in &problem.conditions.forces {
            let key = (given.curve, given.axis, given.factor.to_bits());
            let nodes = self.nodes(given.target, given.at);
            let group = groups.entry(key).or_insert((given.at, BTreeMap::new()));
            for node in nodes {
                *group.1.entry(node).or_default() += 1;
            }
        }
        let mut n = 0;
        for ((curve, axis, bits), (at, nodes)) in groups {
            let Some(curve) = self.curve(curve, Meaning::Velocity, at) else { continue };
            // A node that is named several times is pushed as often.
            let most = nodes.values().copied().max().unwrap_or(0);
            for times in 1..=most {
                let list: Vec<u32> =
                    nodes.iter().filter(|(_, t)| **t == times).map(|(node, _)| *node).collect();
                if list.is_empty() {
                    continue;
                }
                n += 1;
                if n == MAX_FORCES + 1 {
                    let expected =
                        format!("at most {MAX_FORCES} forces that differ in curve, direction or factor");
                    self.log.fault(at, "more forces", expected, "give more nodes the same force");
                }
                if n > MAX_FORCES {
                    return;
                }
                let set = self.set(&format!("force {n}"), list);
                let mut force = [0.0; 3];
                force[axis] = f64::from_bits(bits) * f64::from(times);
                self.draft.heading(at, "[[load]]");
                self.draft.line(at, "type = \"force\"");
                self.draft.line(at, format!("nodes = \"{set}\""));
                self.draft.line(at, format!("force = {}", vector(force)));
                self.draft.line(at, format!("curve = \"{curve}\""));
            }
        }
    }

    /// Pressures, by whether segments are listed outward.
    pub(super) fn pressures(&mut self) {
        let (problem, log) = (self.problem, self.log);
        if problem.conditions.pressures.is_empty() {
            return;
        }
        let mut outward: HashMap<[u32; 4], [u32; 4]> = HashMap::new();
        for solid in &problem.solids {
            for face in mechanics::mesh::FACES.map(|face| face.map(|c| solid.nodes[c])) {
                let mut key = face;
                key.sort_unstable();
                // A face of two elements is inside, and no pressure acts there.
                if outward.insert(key, face).is_some() {
                    outward.remove(&key);
                }
            }
        }
        // Faces by curve, factor and side.
        type Group = (Place, Vec<[u32; 4]>);
        let mut groups: BTreeMap<(u32, u64), Group> = BTreeMap::new();
        for given in &problem.conditions.pressures {
            let faces = if given.set == 0 {
                given.faces.clone()
            } else {
                problem.segment_set(given.set, given.at, log)
            };
            for face in faces {
                let mut key = face;
                key.sort_unstable();
                let Some(out) = outward.get(&key) else {
                    log.fault(
                        given.at,
                        format!("segment {face:?}"),
                        "an outer face of a solid",
                        "name its four nodes",
                    );
                    continue;
                };
                let start = out.iter().position(|n| *n == face[0]).unwrap_or(0);
                let same = out[(start + 1) % 4] == face[1];
                let factor = if same { given.factor } else { -given.factor };
                let group = groups.entry((given.curve, factor.to_bits())).or_insert((given.at, Vec::new()));
                group.1.push(face);
            }
        }
        for (n, ((curve, bits), (at, faces))) in groups.into_iter().enumerate() {
            let Some(curve) = self.curve(curve, Meaning::Velocity, at) else { continue };
            let name = format!("pressure {}", n + 1);
            self.mesh.segments.insert(name.clone(), faces);
            self.draft.heading(at, "[[load]]");
            self.draft.line(at, "type = \"pressure\"");
            self.draft.line(at, format!("segments = \"{name}\""));
            let factor = f64::from_bits(bits);
            self.draft.line(at, format!("pressure = {{ curve = \"{curve}\", factor = {factor:?} }}"));
        }
    }

    /// One gravity: its axes must follow one curve.
    pub(super) fn gravity(&mut self) {
        let problem = self.problem;
        let bodies = &problem.conditions.bodies;
        let Some(first) = bodies.first() else { return };
        let mut acceleration = [0.0; 3];
        for body in bodies {
            if body.curve != first.curve {
                self.log.fault(
                    body.at,
                    format!("curve {}", body.curve),
                    format!("curve {}, which line {} has", first.curve, first.at.line),
                    "let all axes follow one curve, each with its own SF",
                );
            }
            // The load acts against the axis, as of a base that is accelerated along it.
            acceleration[body.axis] -= body.factor;
        }
        let Some(curve) = self.curve(first.curve, Meaning::Velocity, first.at) else { return };
        self.draft.heading(first.at, "[gravity]");
        self.draft.line(first.at, format!("acceleration = {}", vector(acceleration)));
        self.draft.line(first.at, format!("curve = \"{curve}\""));
    }

    pub(super) fn walls(&mut self) {
        let (problem, log) = (self.problem, self.log);
        for (n, wall) in problem.conditions.walls.iter().enumerate() {
            let at = wall.at;
            let some =
                wall.target != Target::All || wall.except != 0 || wall.inside != 0 || wall.offset != 0.0;
            let normal = unit(wall.normal).unwrap_or_default();
            let mut set = None;
            if some {
                let mut nodes = self.nodes(wall.target, at);
                let inside = (wall.inside != 0).then(|| problem.within(wall.inside, at, log));
                let except =
                    if wall.except != 0 { problem.node_set(wall.except, at, log) } else { Vec::new() };
                nodes.retain(|node| {
                    let x = problem.position(*node).unwrap_or_default();
                    let height = crate::geometry::dot(minus(x, wall.point), normal);
                    except.binary_search(node).is_err()
                        && inside.as_ref().is_none_or(|inside| inside(x))
                        && (wall.offset <= 0.0 || height <= wall.offset)
                });
                if nodes.is_empty() {
                    log.warn(at, "a wall that no node with an element feels");
                    continue;
                }
                set = Some(self.set(&format!("wall {}", n + 1), nodes));
            }
            self.draft.heading(at, "[[wall]]");
            self.draft.line(at, format!("point = {}", vector(wall.point)));
            self.draft.line(at, format!("normal = {}", vector(normal)));
            if wall.friction != 0.0 {
                self.draft.line(at, format!("friction = {:?}", wall.friction));
            }
            if let Some([mass, speed]) = wall.moving {
                let [x, y, z] = normal.map(|c| speed * c);
                self.draft.line(at, format!("mass = {mass:?}"));
                self.draft.line(at, format!("velocity = {{ x = {x:?}, y = {y:?}, z = {z:?} }}"));
            }
            if let Some(set) = set {
                self.draft.line(at, format!("nodes = \"{set}\""));
            }
        }
    }
}
