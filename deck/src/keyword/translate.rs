//! A deck by its numbers, put into the words of a TOML deck and a mesh file.

mod conditions;
mod eroded;
mod motion;
mod rigid;
mod transducer;

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::{
    draft::{Draft, quoted, vector},
    log::{Log, Place},
    material,
    problem::{Problem, Section, Shell},
    unit,
};
use crate::{
    fault::short,
    geometry::{cross, norm, sub, volume},
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
        turns: BTreeSet::new(),
        names: BTreeMap::new(),
        thicknesses: BTreeMap::new(),
        curves: BTreeMap::new(),
        bodies: rigid::Bodies::default(),
        met: BTreeSet::new(),
    };
    t.elements();
    t.find_bodies();
    t.control(units);
    t.materials();
    t.parts();
    t.rigid();
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
    /// Nodes that shells have.
    turns: BTreeSet<u32>,
    /// Names of the parts that have elements, by number.
    names: BTreeMap<u32, String>,
    /// Thickness of the shells of each part that has any.
    thicknesses: BTreeMap<u32, f64>,
    /// Curves that were referred to: name and points.
    curves: BTreeMap<String, (Place, Vec<[f64; 2]>)>,
    /// Parts that are rigid.
    bodies: rigid::Bodies,
    /// Pairs of parts that meet, lower number first.
    met: BTreeSet<(u32, u32)>,
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
                .or_insert_with(|| Body { name: format!("part {}", solid.part), ..Body::default() });
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
        let shells = self.shells(&mut bodies);
        for (id, part) in &problem.parts {
            let Some(body) = bodies.remove(id) else {
                if !shells.contains(id) {
                    log.warn(part.at, format!("part {id} has no elements and is left out"));
                }
                continue;
            };
            match problem.sections.get(&part.section) {
                Some((_, Section::Solid)) if body.shells.is_empty() => {}
                Some((_, Section::Shell(_))) if body.solids.is_empty() => {}
                Some((at, section)) => {
                    let (expected, other) = match section {
                        Section::Solid => ("a *SECTION_SHELL", "shells"),
                        Section::Shell(_) => ("a *SECTION_SOLID", "solids"),
                    };
                    let read = format!("part {id} with {other} and the section at line {}", at.line);
                    log.fault(part.at, read, expected, "correct SECID; a part has elements of one kind");
                }
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
            let expected = "*ELEMENT_SOLID or *ELEMENT_SHELL";
            log.fault(Place { file: 0, line: 1 }, "a deck without elements", expected, "add a mesh");
        }
    }

    /// Shells by part, and the parts that have any.
    fn shells(&mut self, bodies: &mut BTreeMap<u32, Body>) -> BTreeSet<u32> {
        let (problem, log) = (self.problem, self.log);
        let mut parts = BTreeSet::new();
        let mut seen: HashMap<u32, Place> = HashMap::with_capacity(problem.shells.len());
        let mut triangles: Option<(Place, usize)> = None;
        for shell in &problem.shells {
            let Shell { id, part, nodes, thickness, at } = *shell;
            parts.insert(part);
            if let Some(first) = seen.insert(id, at) {
                let expected = format!("a number other than {id}, which line {} has", first.line);
                log.fault(at, format!("shell {id}"), expected, "renumber one");
                continue;
            }
            if let Some(node) = nodes.iter().find(|node| problem.position(**node).is_none()) {
                log.fault(at, format!("shell {id} with node {node}"), "nodes of the deck", "add the node");
                continue;
            }
            let Some(card) = problem.parts.get(&part) else {
                log.fault(at, format!("shell {id} of part {part}"), "a part of the deck", "add the *PART");
                continue;
            };
            let distinct = nodes.iter().collect::<BTreeSet<_>>().len();
            if distinct < 3 || (distinct == 3 && nodes[3] != nodes[2]) {
                let read = format!("shell {id} with nodes {nodes:?}");
                log.fault(
                    at,
                    read,
                    "four different ones, or a triangle that repeats the third",
                    "correct them",
                );
                continue;
            }
            if distinct == 3 {
                triangles.get_or_insert((at, 0)).1 += 1;
            }
            let [a, b, c, d] = nodes.map(|node| problem.position(node).unwrap_or_default());
            let area = 0.5 * norm(cross(sub(c, a), sub(d, b)));
            if !(area > 0.0 && area.is_finite()) {
                let read = format!("shell {id} with area {}", short(area));
                log.fault(at, read, "an area above 0", "order its corners around it");
                continue;
            }
            let Some(thickness) = thickness.or(self.section_thickness(card.section)) else {
                let read = format!("shell {id} without a thickness");
                log.fault(at, read, "T1 of its *SECTION_SHELL, or its own", "give one");
                continue;
            };
            // Elements of a part differ by no more than rounding, or the part says so.
            let common = *self.thicknesses.entry(part).or_insert(thickness);
            if (thickness - common).abs() > 1e-6 * common {
                log.fault(
                    at,
                    format!("shell {id} of thickness {}", short(thickness)),
                    format!("{}, that of the elements before it in part {part}", short(common)),
                    "make one part of the shells of each thickness",
                );
                continue;
            }
            self.used.extend(nodes);
            self.turns.extend(nodes);
            let body = bodies
                .entry(part)
                .or_insert_with(|| Body { name: format!("part {part}"), ..Body::default() });
            body.shells.push((id, nodes));
        }
        if let Some((at, count)) = triangles {
            log.warn(
                at,
                format!("{count} triangles: computed as quadrilaterals with two corners in one node"),
            );
        }
        parts
    }

    /// The thickness that a section gives.
    fn section_thickness(&self, section: u32) -> Option<f64> {
        match self.problem.sections.get(&section) {
            Some((_, Section::Shell(shell))) => Some(shell.thickness).filter(|thickness| *thickness > 0.0),
            _ => None,
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
        let (mut velocity, mut spin) = self.velocities();
        self.start_bodies(&mut velocity, &mut spin);
        let problem = self.problem;
        let mut turning: BTreeSet<u32> = BTreeSet::new();
        let of = |node: &u32| velocity.get(node).copied().unwrap_or_default();
        let mut apart: BTreeSet<u32> = BTreeSet::new();
        for body in 0..self.mesh.bodies.len() {
            let nodes: BTreeSet<u32> = self.mesh.bodies[body].corners().collect();
            let Some((id, name)) = self.names.iter().nth(body).map(|(id, name)| (*id, name.clone())) else {
                continue;
            };
            if !self.mesh.bodies[body].shells.is_empty() {
                turning.extend(nodes.iter().filter(|node| spin.contains_key(node)));
            }
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
            if let (Some(thickness), Some((_, Section::Shell(shell)))) =
                (self.thicknesses.get(&id), problem.sections.get(&part.section))
            {
                let (points, rule) = (shell.points, if shell.lobatto { "lobatto" } else { "gauss" });
                let words =
                    format!("shell = {{ thickness = {thickness:?}, points = {points}, rule = \"{rule}\" }}");
                self.draft.line(at, words);
            }
            if let Some((at, words)) = self.erosion_of(part.material) {
                self.draft.line(at, format!("erosion = {words}"));
            }
            let (file, body) = (quoted(self.mesh_name), format!("part {id}"));
            self.draft.line(at, format!("mesh = {{ file = {file}, body = \"{body}\" }}"));
        }
        // Nodes of several parts get theirs from the mesh wherever one part would give them another.
        self.mesh.velocities = apart.iter().map(|node| (*node, of(node))).collect();
        self.mesh.spins = turning.iter().map(|node| (*node, spin[node])).collect();
    }

    fn contact(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let mut pairs: BTreeMap<(u32, u32), (Place, f64)> = BTreeMap::new();
        for contact in &problem.contacts {
            for (a, b) in contact.pairs(problem, log) {
                let known = self.names.contains_key(&a) && self.names.contains_key(&b);
                if known && !self.bodies.same(a, b) {
                    pairs.entry((a, b)).or_insert((contact.at, contact.friction));
                }
            }
        }
        let Some(at) = problem.contacts.first().map(|contact| contact.at).filter(|_| !pairs.is_empty())
        else {
            return;
        };
        self.freed_nodes();
        self.met = pairs.keys().copied().collect();
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
        let forces = self.watched();
        if let Some(at) = control.period.map(|(at, _)| at).or(forces.as_ref().map(|(at, _)| *at)) {
            self.draft.heading(at, "[output]");
        }
        if let Some((at, period)) = control.period {
            self.draft.line(at, format!("period = {period:?}"));
        }
        if let Some((at, pairs)) = forces {
            self.draft.line(at, format!("contact_forces = [{pairs}]"));
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
