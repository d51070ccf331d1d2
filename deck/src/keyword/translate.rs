//! A deck by its numbers, put into the words of a TOML deck and a mesh file.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::{
    condition::{Meaning, Target},
    draft::{Draft, quoted, vector},
    log::{Log, Place},
    material::{self, Law},
    problem::{Problem, Section, cross, minus},
    unit,
};
use crate::{
    fault::short,
    geometry::volume,
    mesh_file::{Body, MeshFile},
    table::MAX_NAME,
};

/// Safety factor that stands for LS-DYNA's default factor on the time step.
const SAFETY: f64 = 0.6666;
/// That default.
const STEP_FACTOR: f64 = 0.9;
/// Bulk viscosity of LS-DYNA, quadratic and linear.
const VISCOSITY: [f64; 2] = [1.5, 0.06];
/// Most gauges.
const MAX_GAUGES: usize = 100;
/// Most forces of a run.
const MAX_FORCES: usize = mechanics::load::MAX_FORCES;
const AXES: [&str; 3] = ["x", "y", "z"];

/// Puts a problem into our words. After a fault the result is not to be used.
pub(super) fn translate(
    problem: &Problem,
    units: Option<&str>,
    mesh_name: &str,
    log: &Log,
) -> (Draft, MeshFile) {
    let mut t = Translation {
        problem,
        log,
        mesh_name,
        draft: Draft::default(),
        mesh: MeshFile::default(),
        used: BTreeSet::new(),
        names: BTreeMap::new(),
        curves: BTreeMap::new(),
    };
    t.elements();
    t.control(units);
    t.materials();
    t.parts();
    t.held();
    t.motions();
    t.forces();
    t.pressures();
    t.gravity();
    t.walls();
    t.contact();
    t.output();
    t.write_curves();
    (t.draft, t.mesh)
}

struct Translation<'p> {
    problem: &'p Problem,
    log: &'p Log,
    mesh_name: &'p str,
    draft: Draft,
    mesh: MeshFile,
    /// Nodes that elements have.
    used: BTreeSet<u32>,
    /// Names of the parts that have elements, by number.
    names: BTreeMap<u32, String>,
    /// Curves that were referred to: name and points.
    curves: BTreeMap<String, (Place, Vec<[f64; 2]>)>,
}

impl Translation<'_> {
    /// Elements by part, nodes that they use.
    fn elements(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let mut bodies: BTreeMap<u32, Body> = BTreeMap::new();
        let mut seen: HashMap<u32, Place> = HashMap::with_capacity(problem.solids.len());
        // The first element whose corners coincide, and how many there are.
        let mut collapsed: Option<(Place, usize)> = None;
        for solid in &problem.solids {
            let (id, at) = (solid.id, solid.at);
            if let Some(first) = seen.insert(id, at) {
                let expected = format!("a number other than {id}, which line {} has", first.line);
                log.fault(at, format!("element {id}"), expected, "renumber one");
                continue;
            }
            if let Some(node) = solid.nodes.iter().find(|node| problem.position(**node).is_none()) {
                log.fault(at, format!("element {id} with node {node}"), "nodes of the deck", "add the node");
                continue;
            }
            let nodes = corners_of(solid.nodes);
            let corners = nodes.map(|node| problem.position(node).unwrap_or_default());
            if !problem.parts.contains_key(&solid.part) {
                log.fault(
                    at,
                    format!("element {id} of part {}", solid.part),
                    "a part of the deck",
                    "add the *PART",
                );
                continue;
            }
            let distinct = solid.nodes.iter().collect::<BTreeSet<_>>().len();
            if !matches!(distinct, 4 | 5 | 6 | 8) {
                log.fault(
                    at,
                    format!("element {id} with {distinct} different corners"),
                    "eight, or six, five or four of a wedge, a pyramid or a tetrahedron",
                    "correct the element",
                );
                continue;
            }
            if distinct < 8 {
                collapsed.get_or_insert((at, 0)).1 += 1;
            }
            let v = volume(&corners);
            if !(v > 0.0 && v.is_finite()) {
                log.fault(
                    at,
                    format!("element {id} with volume {}", short(v)),
                    "a volume above 0",
                    "number the first four corners so that their normal points to the other four",
                );
                continue;
            }
            self.used.extend(solid.nodes);
            let body = bodies
                .entry(solid.part)
                .or_insert_with(|| Body { name: format!("part {}", solid.part), solids: Vec::new() });
            body.solids.push((id, nodes));
        }
        if let Some((at, count)) = collapsed {
            log.warn(
                at,
                format!(
                    "{count} wedges, pyramids or tetrahedra: computed as hexahedra whose corners coincide"
                ),
            );
        }
        if let Some(shell) = problem.shells.first() {
            log.fault(
                shell.at,
                format!("shell element {} and {} more", shell.id, problem.shells.len() - 1),
                "solids: shells are not computed",
                "mesh the part with solids",
            );
        }
        for (id, part) in &problem.parts {
            let Some(body) = bodies.remove(id) else {
                if !problem.shells.iter().any(|shell| shell.part == *id) {
                    log.warn(part.at, format!("part {id} has no elements and is left out"));
                }
                continue;
            };
            match problem.sections.get(&part.section) {
                Some((_, Section::Solid)) => {}
                Some((at, Section::Shell)) => log.fault(
                    part.at,
                    format!("part {id} of solids with the section at line {}", at.line),
                    "a *SECTION_SOLID",
                    "correct SECID",
                ),
                None => {
                    log.fault(part.at, format!("section {}", part.section), "a section of the deck", "add it")
                }
            }
            self.mesh.bodies.push(body);
            let name = self.part_name(*id, &part.title);
            self.names.insert(*id, name);
        }
        for node in problem.nodes.iter().filter(|node| self.used.contains(&node.id)) {
            self.mesh.nodes.push((node.id, node.x));
        }
        if self.mesh.bodies.is_empty() && log.count() == 0 {
            log.fault(Place { file: 0, line: 1 }, "a deck without elements", "*ELEMENT_SOLID", "add a mesh");
        }
    }

    /// A name for results: the heading where it serves, else the number.
    fn part_name(&self, id: u32, title: &str) -> String {
        let plain: String = title
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || "-_ ".contains(c) { c } else { ' ' })
            .collect();
        let words: Vec<&str> = plain.split_whitespace().collect();
        let mut name = words.join(" ");
        name.truncate(MAX_NAME - 12);
        let name = name.trim().to_string();
        let taken = self.names.values().any(|other| *other == name);
        match name.as_str() {
            "" | "None" | "all" => format!("part {id}"),
            _ if taken => format!("{name} {id}"),
            _ => name,
        }
    }

    fn control(&mut self, units: Option<&str>) {
        let (problem, log) = (self.problem, self.log);
        let start = Place { file: 0, line: 1 };
        let control = &problem.control;
        let title = problem.title.clone().unwrap_or_else(|| "keyword deck".to_string());
        let title: String = title.chars().take(crate::MAX_TITLE).collect();
        let used = |id: &u32| {
            problem.parts.iter().any(|(p, part)| part.material == *id && self.names.contains_key(p))
        };
        let units =
            unit::choose(units, problem.materials.iter().filter(|(id, _)| used(id)).map(|(_, m)| m), log);
        let draft = &mut self.draft;
        draft.line(start, format!("title = {}", quoted(&title)));
        draft.line(start, format!("units = \"{units}\""));
        let Some((at, end)) = control.end_time else {
            log.fault(start, "a deck without an end time", "*CONTROL_TERMINATION with ENDTIM", "add it");
            return;
        };
        draft.heading(at, "[control]");
        draft.line(at, format!("end_time = {end:?}"));
        if let Some(cycles) = control.end_cycle {
            draft.line(at, format!("end_cycle = {cycles}"));
        }
        if let Some((at, factor)) = control.step_factor {
            let safety = (SAFETY * factor / STEP_FACTOR).min(1.0);
            draft.line(at, format!("safety_factor = {safety:?}"));
        }
        let (at, [quadratic, linear]) = control.viscosity.unwrap_or((at, VISCOSITY));
        // Theirs enters as it is, ours squared.
        draft.line(at, format!("quadratic_viscosity = {:?}", quadratic.sqrt()));
        draft.line(at, format!("linear_viscosity = {linear:?}"));
        self.hourglass();
    }

    /// One coefficient for all parts.
    fn hourglass(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let of_parts =
            self.names.keys().filter_map(|id| problem.hourglasses.get(&problem.parts[id].hourglass));
        let mut given: Vec<(Place, i64, f64)> = of_parts.map(|h| (h.at, h.kind, h.coefficient)).collect();
        given.extend(problem.control.hourglass);
        let Some((at, kind, coefficient)) = given.first().copied() else { return };
        if kind > 3 {
            log.warn(at, format!("IHQ {kind}: hourglass control is viscous, with the coefficient 0.1"));
            return;
        }
        if given.iter().any(|(_, k, c)| (*k, *c) != (kind, coefficient)) {
            log.warn(at, "one hourglass coefficient serves all parts: that of this line");
        }
        if coefficient > 0.0 {
            self.draft.line(at, format!("hourglass = {coefficient:?}"));
        }
    }

    /// Materials in use, each with the equation of state of its part.
    fn materials(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let mut done = BTreeSet::new();
        for id in self.names.keys() {
            let part = &problem.parts[id];
            let Some(material) = problem.materials.get(&part.material) else {
                log.fault(
                    part.at,
                    format!("material {}", part.material),
                    "a material of the deck",
                    "add the *MAT",
                );
                continue;
            };
            let eos = problem.equations.get(&part.eos);
            if part.eos != 0 && eos.is_none() {
                log.fault(
                    part.at,
                    format!("equation of state {}", part.eos),
                    "an *EOS of the deck",
                    "add it",
                );
                continue;
            }
            if !done.insert((part.material, part.eos)) {
                continue;
            }
            let at = material.at;
            if let Law::Rigid = material.law {
                log.fault(
                    at,
                    "a rigid part",
                    "parts that deform: rigid bodies are not computed",
                    "give it an elastic material",
                );
                continue;
            }
            if let Some(strain) = material.failure_strain {
                log.fault(
                    at,
                    format!("a failure strain of {strain}"),
                    "no erosion, which is not computed",
                    "leave it blank",
                );
            }
            if let Some(erosion) = problem.erosions.get(&part.material) {
                log.fault(*erosion, "*MAT_ADD_EROSION", "no erosion, which is not computed", "take it out");
            }
            let curve_of = |id: u32| {
                let curve = problem.curves.get(&id);
                if curve.is_none() {
                    log.fault(at, format!("curve {id}"), "a *DEFINE_CURVE of the deck", "define it");
                }
                curve.map(material::points_of)
            };
            let eos = material::eos_words(material, eos, part.at, log);
            let strength = material::strength_words(material, curve_of, log);
            let (Some(eos), Some(strength)) = (eos, strength) else { continue };
            self.draft.heading(at, "[[material]]");
            self.draft.line(at, format!("name = \"{}\"", material_name(part.material, part.eos)));
            self.draft.line(at, format!("density = {:?}", material.density));
            self.draft.line(at, format!("eos = {eos}"));
            self.draft.line(at, format!("strength = {strength}"));
            if let Some(failure) = material::failure_words(material) {
                self.draft.line(at, format!("failure = {failure}"));
            }
        }
    }

    /// Parts with their velocities; those of single nodes go into the mesh.
    fn parts(&mut self) {
        let velocity = self.velocities();
        let problem = self.problem;
        let of = |node: &u32| velocity.get(node).copied().unwrap_or_default();
        let mut apart: BTreeSet<u32> = BTreeSet::new();
        for body in 0..self.mesh.bodies.len() {
            let nodes: BTreeSet<u32> =
                self.mesh.bodies[body].solids.iter().flat_map(|(_, nodes)| *nodes).collect();
            let Some((id, name)) = self.names.iter().nth(body).map(|(id, name)| (*id, name.clone())) else {
                continue;
            };
            let part = &problem.parts[&id];
            let common = nodes.first().map(of).unwrap_or_default();
            let common = if nodes.iter().all(|node| of(node) == common) { common } else { [0.0; 3] };
            apart.extend(nodes.iter().filter(|node| of(node) != common));
            let at = part.at;
            self.draft.heading(at, "[[part]]");
            self.draft.line(at, format!("name = {}", quoted(&name)));
            self.draft.line(at, format!("material = \"{}\"", material_name(part.material, part.eos)));
            if common != [0.0; 3] {
                self.draft.line(at, format!("velocity = {}", vector(common)));
            }
            let (file, body) = (quoted(self.mesh_name), format!("part {id}"));
            self.draft.line(at, format!("mesh = {{ file = {file}, body = \"{body}\" }}"));
        }
        // Nodes of several parts get theirs from the mesh wherever one part would give them another.
        self.mesh.velocities = apart.iter().map(|node| (*node, of(node))).collect();
    }

    /// Initial velocities by node; later ones replace earlier ones.
    fn velocities(&self) -> BTreeMap<u32, [f64; 3]> {
        let (problem, log) = (self.problem, self.log);
        let mut list = BTreeMap::new();
        for given in &problem.conditions.velocities {
            let turned = |v| self.turned(v, given.system, given.at);
            let (v, spin) = (turned(given.velocity), turned(given.spin));
            let inside = (given.inside != 0).then(|| problem.within(given.inside, given.at, log));
            let except =
                if given.except != 0 { problem.node_set(given.except, given.at, log) } else { Vec::new() };
            if given.own_turn != [0.0; 3] {
                log.warn(given.at, "VXR, VYR, VZR: nodes of solids do not turn");
            }
            for node in self.nodes(given.target, given.at) {
                let Some(x) = problem.position(node) else { continue };
                if except.binary_search(&node).is_ok() || inside.as_ref().is_some_and(|inside| !inside(x)) {
                    continue;
                }
                let round = cross(spin, minus(x, given.point));
                list.insert(node, [0, 1, 2].map(|a| v[a] + round[a]));
            }
        }
        list
    }

    /// A vector of a coordinate system in global components.
    fn turned(&self, v: [f64; 3], system: u32, at: Place) -> [f64; 3] {
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
    fn held(&mut self) {
        let (problem, log) = (self.problem, self.log);
        const CODES: [[bool; 3]; 8] = [
            [false, false, false],
            [true, false, false],
            [false, true, false],
            [false, false, true],
            [true, true, false],
            [false, true, true],
            [true, false, true],
            [true, true, true],
        ];
        let mut of_node: BTreeMap<u32, ([bool; 3], Place)> = BTreeMap::new();
        let mut hold = |node: u32, axes: [bool; 3], at: Place| {
            let entry = of_node.entry(node).or_insert(([false; 3], at));
            (0..3).for_each(|a| entry.0[a] |= axes[a]);
        };
        for node in problem.nodes.iter().filter(|node| node.held > 0 && self.used.contains(&node.id)) {
            hold(node.id, CODES[usize::from(node.held)], node.at);
        }
        for given in &problem.conditions.held {
            let local = [given.axes[0], given.axes[1], given.axes[2]];
            let mut axes = local;
            if let Some(directions) = self.directions(given.system, given.at)
                && local != [true; 3]
            {
                axes = [false; 3];
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
            }
            for node in self.nodes(given.target, given.at) {
                hold(node, axes, given.at);
            }
        }
        let mut groups: BTreeMap<[bool; 3], (Place, Vec<u32>)> = BTreeMap::new();
        for (node, (axes, at)) in of_node.into_iter().filter(|(_, (axes, _))| *axes != [false; 3]) {
            let group = groups.entry(axes).or_insert((at, Vec::new()));
            group.0 = group.0.min(at);
            group.1.push(node);
        }
        for (axes, (at, nodes)) in groups {
            let letters: String = (0..3).filter(|a| axes[*a]).map(|a| AXES[a]).collect();
            let set = self.set(&format!("held {letters}"), nodes);
            self.draft.heading(at, "[[boundary]]");
            self.draft.line(at, "type = \"fixed\"");
            self.draft.line(at, format!("axes = \"{letters}\""));
            self.draft.line(at, format!("nodes = \"{set}\""));
        }
    }

    /// Motions by curve.
    fn motions(&mut self) {
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
    fn curve(&mut self, id: u32, meaning: Meaning, at: Place) -> Option<String> {
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

    fn write_curves(&mut self) {
        for (name, (at, points)) in std::mem::take(&mut self.curves) {
            self.draft.heading(at, "[[curve]]");
            self.draft.line(at, format!("name = \"{name}\""));
            let list: Vec<String> = points.iter().map(|[t, y]| format!("[{t:?}, {y:?}]")).collect();
            self.draft.line(at, format!("points = [{}]", list.join(", ")));
        }
    }

    /// Forces, alike ones together.
    fn forces(&mut self) {
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
    fn pressures(&mut self) {
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
    fn gravity(&mut self) {
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

    fn walls(&mut self) {
        let (problem, log) = (self.problem, self.log);
        for (n, wall) in problem.conditions.walls.iter().enumerate() {
            let at = wall.at;
            let some =
                wall.target != Target::All || wall.except != 0 || wall.inside != 0 || wall.offset != 0.0;
            let unit = super::problem::unit(wall.normal).unwrap_or_default();
            let mut set = None;
            if some {
                let mut nodes = self.nodes(wall.target, at);
                let inside = (wall.inside != 0).then(|| problem.within(wall.inside, at, log));
                let except =
                    if wall.except != 0 { problem.node_set(wall.except, at, log) } else { Vec::new() };
                nodes.retain(|node| {
                    let x = problem.position(*node).unwrap_or_default();
                    let height = crate::geometry::dot(minus(x, wall.point), unit);
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
            self.draft.line(at, format!("normal = {}", vector(unit)));
            if wall.friction != 0.0 {
                self.draft.line(at, format!("friction = {:?}", wall.friction));
            }
            if let Some([mass, speed]) = wall.moving {
                let [x, y, z] = unit.map(|c| speed * c);
                self.draft.line(at, format!("mass = {mass:?}"));
                self.draft.line(at, format!("velocity = {{ x = {x:?}, y = {y:?}, z = {z:?} }}"));
            }
            if let Some(set) = set {
                self.draft.line(at, format!("nodes = \"{set}\""));
            }
        }
    }

    fn contact(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let mut pairs: BTreeMap<(u32, u32), (Place, f64)> = BTreeMap::new();
        for contact in &problem.contacts {
            for (a, b) in contact.pairs(problem, log) {
                if self.names.contains_key(&a) && self.names.contains_key(&b) {
                    pairs.entry((a, b)).or_insert((contact.at, contact.friction));
                }
            }
        }
        let Some(at) = problem.contacts.first().map(|contact| contact.at).filter(|_| !pairs.is_empty())
        else {
            return;
        };
        self.draft.heading(at, "[contact]");
        self.draft.line(at, "gap_fraction = \"fit\"");
        self.draft.line(at, "default_interacts = false");
        for ((a, b), (at, friction)) in pairs {
            let names = [a, b].map(|id| quoted(&self.names[&id]));
            self.draft.heading(at, "[[contact.pair]]");
            self.draft.line(at, format!("parts = [{}, {}]", names[0], names[1]));
            if friction != 0.0 {
                self.draft.line(at, format!("friction = {friction:?}"));
            }
        }
    }

    fn output(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let control = &problem.control;
        if let Some((at, period)) = control.period {
            self.draft.heading(at, "[output]");
            self.draft.line(at, format!("period = {period:?}"));
        }
        let mut gauges: BTreeMap<u32, Place> = control.gauges.iter().map(|(at, id)| (*id, *at)).collect();
        for (at, set) in &control.gauge_sets {
            gauges.extend(problem.node_set(*set, *at, log).into_iter().map(|id| (id, *at)));
        }
        gauges.retain(|id, _| self.used.contains(id));
        if let Some((_, at)) = gauges.iter().nth(MAX_GAUGES) {
            log.warn(
                *at,
                format!("histories of {} nodes: those of the first {MAX_GAUGES} are written", gauges.len()),
            );
        }
        for (id, at) in gauges.into_iter().take(MAX_GAUGES) {
            self.draft.heading(at, "[[gauge]]");
            self.draft.line(at, format!("name = \"node {id}\""));
            self.draft.line(at, format!("node = {id}"));
        }
    }
}

/// Corners such that those which coincide are neighbours: a tetrahedron repeats its last node, which would leave a face
/// of all four.
fn corners_of(nodes: [u32; 8]) -> [u32; 8] {
    let [a, b, c, d, rest @ ..] = nodes;
    let tetrahedron = rest.iter().all(|node| *node == d) && a != b && b != c && c != d && a != c;
    if tetrahedron { [a, b, c, c, d, d, d, d] } else { nodes }
}

fn material_name(material: u32, eos: u32) -> String {
    match eos {
        0 => format!("material {material}"),
        _ => format!("material {material} eos {eos}"),
    }
}

/// The velocity of a displacement that is straight between its points: steps, over a millionth of the shorter line
/// beside them.
fn rates(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let slope = |w: &[[f64; 2]]| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0]);
    let slopes: Vec<f64> = points.windows(2).map(slope).collect();
    let Some((first, last)) = slopes.first().zip(slopes.last()) else { return vec![[0.0, 0.0]] };
    let mut list = vec![[points[0][0], *first]];
    for i in 1..points.len() - 1 {
        let ramp = 0.5e-6 * (points[i][0] - points[i - 1][0]).min(points[i + 1][0] - points[i][0]);
        list.push([points[i][0] - ramp, slopes[i - 1]]);
        list.push([points[i][0] + ramp, slopes[i]]);
    }
    // Past its last point a displacement stays.
    let end = points[points.len() - 1][0];
    let ramp = 0.5e-6 * (end - points[points.len() - 2][0]);
    list.push([end - ramp, *last]);
    list.push([end + ramp, 0.0]);
    list.dedup_by(|b, a| b[0] <= a[0]);
    list
}

/// The velocity of an acceleration that is straight between its points, at sixteen times of each line.
fn integrals(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    const PIECES: usize = 16;
    let mut v = 0.0;
    let mut list = vec![[points[0][0], 0.0]];
    for w in points.windows(2) {
        let ([t, a], [end, b]) = (w[0], w[1]);
        let long = end - t;
        for n in 1..=PIECES {
            let s = n as f64 / PIECES as f64;
            let at = if n == PIECES { end } else { s.mul_add(long, t) };
            list.push([at, v + long * s * (0.5 * s).mul_add(b - a, a)]);
        }
        v += 0.5 * (a + b) * long;
    }
    list.dedup_by(|b, a| b[0] <= a[0]);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f64; 2]]) -> f64 {
        points.windows(2).map(|w| 0.5 * (w[0][1] + w[1][1]) * (w[1][0] - w[0][0])).sum()
    }

    #[test]
    fn the_rate_of_a_displacement_leads_back_to_it_and_then_rests() {
        let rate = rates(&[[0.0, 0.0], [1.0, 2.0], [3.0, -1.0]]);
        assert!((area(&rate) + 1.0).abs() < 1e-5, "{rate:?}");
        assert_eq!(rate[rate.len() - 1][1], 0.0);
        assert!(rate.windows(2).all(|w| w[0][0] < w[1][0]));
        assert_eq!(rates(&[[0.0, 5.0]]), [[0.0, 0.0]]);
    }

    #[test]
    fn the_integral_of_an_acceleration_ends_at_its_area() {
        let points = [[0.0, 0.0], [2.0, 3.0], [4.0, -1.0]];
        let v = integrals(&points);
        assert!((v[v.len() - 1][1] - area(&points)).abs() < 1e-12);
        assert_eq!(integrals(&points[..1]), [[0.0, 0.0]]);
    }
}
