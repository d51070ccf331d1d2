//! What holds, moves, pushes and stops nodes.

use std::collections::{BTreeMap, HashMap};

use mechanics::load::{MAX_FORCES, Span};

use super::{element::corners_of, moving::is_of_nozzle, reference, state::Translation};
use crate::{
    geometry::{dot, key_of_face, sub, unit},
    keyword::{
        condition::{AXES_OF_CODE, Held, Pressed, Target},
        prescribed::{Driven, Meaning, Way},
        problem::Problem,
    },
    log::Log,
    place::Place,
    typed::condition::{
        Boundary, BoundaryKind, Circle, Components, Drive, Faces, Gravity, Load, LoadKind, Lumped, Parts,
        Region, Relaxation, Wall, WallMotion, WallShape, made,
    },
};

const AXES: [&str; 3] = ["x", "y", "z"];
const FREE: Components = [const { None }; 3];

/// What is held at rest, by the axes that are.
pub(super) fn write_held(t: &mut Translation<'_>) {
    let problem = t.problem;
    // By node and span: translations, then rotations.
    type Holding = ([[bool; 3]; 2], Place);
    let mut of_node: BTreeMap<(u32, [u64; 2]), Holding> = BTreeMap::new();
    let mut hold = |node: u32, axes: [[bool; 3]; 2], span: Span, at: Place| {
        let key = (node, [span.from.to_bits(), span.until.to_bits()]);
        let entry = of_node.entry(key).or_insert(([[false; 3]; 2], at));
        for (all, new) in entry.0.iter_mut().flatten().zip(axes.iter().flatten()) {
            *all |= new;
        }
    };
    for node in problem.nodes.iter().filter(|node| node.held != [0; 2] && t.used.contains(&node.id)) {
        hold(node.id, node.held.map(|code| AXES_OF_CODE[usize::from(code)]), Span::ALWAYS, node.at);
    }
    for given in &problem.conditions.held {
        let axes = axes_of(t, given);
        for node in t.nodes(given.target, given.at) {
            hold(node, axes, given.span, given.at);
        }
    }
    type Group = (Place, Vec<u32>);
    let mut groups: BTreeMap<([u64; 2], [[bool; 3]; 2]), Group> = BTreeMap::new();
    for ((node, span), (axes, at)) in of_node {
        // Only nodes of shells turn.
        let axes = [axes[0], if t.turns.contains(&node) { axes[1] } else { [false; 3] }];
        if axes == [[false; 3]; 2] {
            continue;
        }
        let group = groups.entry((span, axes)).or_insert((at, Vec::new()));
        group.0 = group.0.min(at);
        group.1.push(node);
    }
    for (n, ((span, axes), (at, nodes))) in (1..).zip(groups) {
        let [from, until] = span.map(f64::from_bits);
        let clamp_span = Span { from, until };
        let [letters, turns] =
            axes.map(|axes| (0..3).filter(|a| axes[*a]).map(|a| AXES[a]).collect::<String>());
        let name = match (letters.as_str(), turns.as_str()) {
            (letters, "") => format!("held {letters}"),
            (letters, turns) => format!("held {letters} turned {turns}"),
        };
        // By number: two times may have more digits than a name has room for.
        let name = if clamp_span == Span::ALWAYS { name } else { format!("{name} in span {n}") };
        let still = Drive { span: clamp_span, ..Drive::constant(0.0) };
        let velocity = axes[0].map(|held| held.then(|| still.clone()));
        let clamped = (0..3).filter(|a| axes[1][*a]).fold(0, |bits, a| bits | 1 << a);
        let nodes = Some(Region::Set(t.set(&name, nodes, at)));
        push_boundary(
            t,
            at,
            "nodes that are held",
            BoundaryKind::Held { velocity, clamped, clamp_span, nodes },
        );
    }
}

/// The axes along and about which a support holds.
pub(super) fn axes_of(t: &Translation<'_>, given: &Held) -> [[bool; 3]; 2] {
    let [x, y, z, turn_x, turn_y, turn_z] = given.axes;
    let directions = t.directions(given.system, given.at);
    [[x, y, z], [turn_x, turn_y, turn_z]].map(|local| {
        let Some(directions) = directions.filter(|_| local != [true; 3]) else { return local };
        let mut axes = [false; 3];
        for (direction, _) in directions.iter().zip(local).filter(|(_, held)| *held) {
            match (0..3).find(|a| direction[*a].abs() > 1.0 - 1e-9) {
                Some(axis) => axes[axis] = true,
                None => t.log.fault(
                    given.at,
                    format!("nodes held along {direction:?}"),
                    "a direction along x, y or z",
                    "turn the mesh so that symmetry planes are those of the axes",
                ),
            }
        }
        axes
    })
}

fn push_boundary(t: &mut Translation<'_>, at: Place, title: &str, kind: BoundaryKind) {
    t.deck.boundaries.push(Boundary { at, title: title.to_string(), parts: Parts::All, kind });
}

/// Motions by curve.
pub(super) fn write_motions(t: &mut Translation<'_>) {
    let problem = t.problem;
    for (n, given) in problem.conditions.motions.iter().enumerate() {
        let nodes = t.nodes(given.target, given.at);
        let Some(drive) = driven(t, &given.how, given.at) else { continue };
        if nodes.is_empty() {
            // What moves the body of such a node was said there.
            let is_of_body = t.named(given.target, given.at).into_iter().any(|node| t.references.has(node));
            if !is_of_nozzle(t, given) && !is_of_body {
                t.log.warn(given.at, "a motion of no node that has an element");
            }
            continue;
        }
        let nodes = Some(Region::Set(t.set(&format!("motion {}", n + 1), nodes, given.at)));
        let kind = match given.way {
            Way::About(axis, point) => {
                let point = t.vector(given.at, "an axis through", point);
                BoundaryKind::Circle { circle: Some(Circle { axis, point, rate: drive }), nodes }
            }
            Way::Along(axis) | Way::Turn(axis) => {
                let mut velocity = FREE;
                velocity[axis] = Some(drive);
                BoundaryKind::Held { velocity, clamped: 0, clamp_span: Span::ALWAYS, nodes }
            }
        };
        push_boundary(t, given.at, "a motion", kind);
    }
}

/// The drive of a motion; none after a fault.
pub(super) fn driven(t: &mut Translation<'_>, how: &Driven, at: Place) -> Option<Drive> {
    let curve = t.curve(how.curve, how.meaning, at)?;
    Some(Drive { span: how.span, ..Drive::along(curve, how.factor + 0.0) })
}

/// Masses at nodes, those of equal mass together.
pub(super) fn write_masses(t: &mut Translation<'_>) {
    let problem = t.problem;
    // By node the masses of all cards, then the nodes by mass.
    let mut of_node: BTreeMap<u32, (f64, Place)> = BTreeMap::new();
    for given in &problem.conditions.masses {
        let nodes = t.nodes(given.target, given.at);
        let named = match given.target {
            Target::NodeSet(id) => problem.node_set(id, given.at, t.log).len(),
            _ => 1,
        };
        if nodes.len() < named || nodes.is_empty() {
            t.log.fault(
                given.at,
                "mass at a node that no element has",
                "nodes of elements",
                "put it at nodes of the body that carries it",
            );
            continue;
        }
        let each = given.mass / nodes.len() as f64;
        for node in nodes {
            of_node.entry(node).or_insert((0.0, given.at)).0 += each;
        }
    }
    let mut groups: BTreeMap<u64, (Place, Vec<u32>)> = BTreeMap::new();
    for (node, (mass, at)) in of_node {
        groups.entry(mass.to_bits()).or_insert((at, Vec::new())).1.push(node);
    }
    for (n, (mass, (at, nodes))) in groups.into_iter().enumerate() {
        let mass = Some(t.number(at, "a mass of", f64::from_bits(mass)));
        let nodes = Some(Region::Set(t.set(&format!("mass {}", n + 1), nodes, at)));
        t.deck.masses.push(Lumped {
            at,
            title: "a *ELEMENT_MASS".to_string(),
            mass,
            parts: Parts::All,
            nodes,
        });
    }
}

/// Gravity of parts: that of all parts together where they have the same, else by part.
pub(super) fn write_part_gravities(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let Some(first) = problem.conditions.gravities.first() else { return };
    let mut groups: BTreeMap<(usize, u32, u64), (Place, Vec<u32>)> = BTreeMap::new();
    for given in &problem.conditions.gravities {
        let parts = match given.target {
            Target::PartSet(id) => problem.part_set(id, given.at, log),
            Target::Part(id) => vec![id],
            _ => Vec::new(),
        };
        if let Some(id) = parts.iter().find(|id| !problem.parts.contains_key(id)) {
            log.fault(given.at, format!("part {id}"), "a part of the deck", "correct the number");
        }
        let key = (given.axis, given.curve, given.acceleration.to_bits());
        let parts = parts.into_iter().filter(|id| t.names.contains_key(id));
        groups.entry(key).or_insert((given.at, Vec::new())).1.extend(parts);
    }
    let mut shared: BTreeMap<u32, u32> = BTreeMap::new();
    let all = t.names.len();
    let mut gravity: Option<Gravity> = None;
    for ((axis, curve, bits), (at, mut parts)) in groups {
        parts.sort_unstable();
        parts.dedup();
        let drive = match curve {
            0 => Drive::constant(1.0),
            id => match t.curve(id, Meaning::Velocity, at) {
                Some(curve) => Drive::along(curve, 1.0),
                None => continue,
            },
        };
        // As *LOAD_BODY, against the axis.
        let mut acceleration = [0.0; 3];
        acceleration[axis] = -f64::from_bits(bits);
        let acceleration = t.vector(at, "an acceleration of", acceleration);
        if parts.len() == all && gravity.is_none() && problem.conditions.bodies.is_empty() {
            gravity = Some(Gravity { acceleration, drive });
            continue;
        }
        for &part in &parts {
            for node in problem.nodes_of_part(part) {
                let other = *shared.entry(node).or_insert(part);
                if other != part {
                    log.warn(
                        at,
                        format!("parts {other} and {part} share nodes: those feel the gravity of both"),
                    );
                    break;
                }
            }
        }
        let named = parts.iter().map(|id| made(t.names[id].clone(), at)).collect();
        let force = Some(acceleration);
        let kind = LoadKind::Force { force, by_mass: true, drive, nodes: Some(Region::All) };
        t.deck.loads.push(Load {
            at,
            title: "a *LOAD_GRAVITY_PART".to_string(),
            parts: Parts::Named(named),
            kind,
        });
    }
    if gravity.is_some() {
        t.deck.gravity = gravity;
    }
    if t.deck.loads.iter().filter(|load| matches!(load.kind, LoadKind::Force { .. })).count() > MAX_FORCES {
        log.fault(
            first.at,
            "more forces",
            format!("at most {MAX_FORCES}"),
            "give more parts the same gravity",
        );
    }
}

/// Forces, alike ones together.
pub(super) fn write_forces(t: &mut Translation<'_>) {
    let problem = t.problem;
    // By curve, axis, factor and system: how often each node is named, or its shares of forces at nodes without elements.
    type Group = (Place, BTreeMap<u32, f64>);
    let mut groups: BTreeMap<(u32, usize, u64, u32), Group> = BTreeMap::new();
    for given in &problem.conditions.forces {
        let key = (given.curve, given.axis, given.factor.to_bits(), given.system);
        reference::warn_of_idle(t, given.target, "a force", given.at);
        let group = groups.entry(key).or_insert((given.at, BTreeMap::new()));
        for node in t.named(given.target, given.at) {
            let shares = match t.used.contains(&node) {
                true => vec![(node, 1.0)],
                false => reference::shares(t, node, given.at).unwrap_or_default(),
            };
            for (node, share) in shares {
                *group.1.entry(node).or_default() += share;
            }
        }
    }
    let mut n = 0;
    for ((curve, axis, bits, system), (at, nodes)) in groups {
        let Some(curve) = t.curve(curve, Meaning::Velocity, at) else { continue };
        // A node that is named several times is pushed as often.
        let mut lists: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
        for (node, times) in nodes {
            lists.entry(times.to_bits()).or_default().push(node);
        }
        for (times, list) in lists {
            let times = f64::from_bits(times);
            n += 1;
            if n == MAX_FORCES + 1 {
                let expected =
                    format!("at most {MAX_FORCES} forces that differ in curve, direction or factor");
                t.log.fault(at, "more forces", expected, "give more nodes the same force");
            }
            if n > MAX_FORCES {
                return;
            }
            let nodes = Some(Region::Set(t.set(&format!("force {n}"), list, at)));
            let mut force = [0.0; 3];
            force[axis] = f64::from_bits(bits) * times;
            let force = if system == 0 { force } else { t.turned(force, system, at) };
            let force = Some(t.vector(at, "a force of", force));
            let drive = Drive::along(curve.clone(), 1.0);
            push_load(t, at, "a force", LoadKind::Force { force, by_mass: false, drive, nodes });
        }
    }
}

fn push_load(t: &mut Translation<'_>, at: Place, title: &str, kind: LoadKind) {
    t.deck.loads.push(Load { at, title: title.to_string(), parts: Parts::All, kind });
}

/// The nodes of each outer face as they stand around its outward normal: of solids, and of shells, whose upper side is the outer one.
pub(super) struct Outward {
    faces: HashMap<[u32; 4], [u32; 4]>,
    /// Nodes of shells by their numbers.
    shells: HashMap<u32, [u32; 4]>,
}

impl Outward {
    pub(super) fn of(problem: &Problem) -> Self {
        let mut faces: HashMap<[u32; 4], [u32; 4]> = HashMap::new();
        for solid in &problem.solids {
            let corners = corners_of(solid.nodes);
            for face in mechanics::mesh::FACES.map(|face| face.map(|c| corners[c])) {
                // An element that repeats corners has drawn some of its faces to an edge.
                let Some(key) = key_of_face(face) else { continue };
                // A face of two elements is inside, and no pressure acts there.
                if faces.insert(key, face).is_some() {
                    faces.remove(&key);
                }
            }
        }
        for shell in &problem.shells {
            if let Some(key) = key_of_face(shell.nodes) {
                faces.entry(key).or_insert(shell.nodes);
            }
        }
        Self { faces, shells: problem.shells.iter().map(|shell| (shell.id, shell.nodes)).collect() }
    }

    /// Whether the nodes of a segment stand around the outward normal of its face; none, and a fault, where it is no outer face.
    pub(super) fn is_outward(&self, segment: [u32; 4], at: Place, log: &Log<'_>) -> Option<bool> {
        let outward = self.find(segment);
        if outward.is_none() {
            log.fault(
                at,
                format!("segment {segment:?}"),
                "an outer face of a solid, or a shell",
                "name its four nodes, or the three of a triangle",
            );
        }
        outward
    }

    /// The segments that a load presses.
    pub(super) fn pressed(
        &self,
        problem: &Problem,
        pressed: Pressed,
        at: Place,
        log: &Log<'_>,
    ) -> Vec<[u32; 4]> {
        let shell = |id: u32| {
            let found = self.shells.get(&id).copied();
            if found.is_none() {
                log.fault(at, format!("shell {id}"), "a shell of the deck", "correct the number");
            }
            found
        };
        let of_parts = |parts: &[u32]| {
            if let Some(part) = parts.iter().find(|id| !problem.shells.iter().any(|shell| shell.part == **id))
            {
                let read = format!("part {part} without shells under a *LOAD_MOVING_PRESSURE");
                log.fault(at, read, "parts of shells", "name a set of segments of solids");
            }
            let of = problem.shells.iter().filter(|shell| parts.contains(&shell.part));
            of.map(|shell| shell.nodes).collect()
        };
        match pressed {
            Pressed::Segment(face) => vec![face],
            Pressed::Segments(set) => problem.segment_set(set, at, log),
            Pressed::Shell(id) => shell(id).into_iter().collect(),
            Pressed::Shells(set) => {
                problem.element_set(1, set, at, log).into_iter().filter_map(shell).collect()
            }
            Pressed::PartSet(set) => of_parts(&problem.part_set(set, at, log)),
            Pressed::Part(part) => of_parts(&[part]),
        }
    }

    fn find(&self, segment: [u32; 4]) -> Option<bool> {
        let face = self.faces.get(&key_of_face(segment)?)?;
        let start = face.iter().position(|node| *node == segment[0])?;
        let next = (1..4).map(|i| face[(start + i) % 4]).find(|node| *node != segment[0]);
        let second = segment.into_iter().find(|node| *node != segment[0]);
        Some(next == second)
    }
}

/// Pressures, by whether segments are listed outward.
pub(super) fn write_pressures(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    if problem.conditions.pressures.is_empty() {
        return;
    }
    let outward = Outward::of(problem);
    // Faces by curve, factor and side.
    type Group = (Place, Vec<[u32; 4]>);
    let mut groups: BTreeMap<(u32, u64), Group> = BTreeMap::new();
    for given in &problem.conditions.pressures {
        for face in outward.pressed(problem, given.pressed, given.at, log) {
            let Some(same) = outward.is_outward(face, given.at, log) else { continue };
            let factor = if same { given.factor } else { -given.factor };
            let group = groups.entry((given.curve, factor.to_bits())).or_insert((given.at, Vec::new()));
            group.1.push(face);
        }
    }
    for (n, ((curve, bits), (at, faces))) in groups.into_iter().enumerate() {
        let Some(curve) = t.curve(curve, Meaning::Velocity, at) else { continue };
        let name = format!("pressure {}", n + 1);
        t.mesh.segments.insert(name.clone(), faces);
        let pressure = Some(Drive::along(curve, f64::from_bits(bits) + 0.0));
        let faces = Some(Faces::Segments(made(name, at)));
        push_load(t, at, "a pressure", LoadKind::Pressure { pressure, faces });
    }
}

/// Adds the faces through which waves leave.
pub(super) fn write_transmitting(t: &mut Translation<'_>) {
    let problem = t.problem;
    for (n, &(at, set)) in (1..).zip(&problem.transmitting) {
        let faces = problem.segment_set(set, at, t.log);
        if faces.is_empty() {
            continue;
        }
        let name = format!("transmitting faces {n}");
        t.mesh.segments.insert(name.clone(), faces);
        let of_solids = |id: &&u32| problem.solids.iter().any(|solid| solid.part == **id);
        let parts = t.names.keys().filter(of_solids).map(|id| made(t.names[id].clone(), at)).collect();
        t.deck.boundaries.push(Boundary {
            at,
            title: "*BOUNDARY_NON_REFLECTING".to_string(),
            parts: Parts::Named(parts),
            kind: BoundaryKind::Transmit(Some(Faces::Segments(made(name, at)))),
        });
    }
}

/// One gravity: its axes must follow one curve.
pub(super) fn write_gravity(t: &mut Translation<'_>) {
    let problem = t.problem;
    let bodies = &problem.conditions.bodies;
    let Some(first) = bodies.first() else { return };
    let mut acceleration = [0.0; 3];
    for body in bodies {
        if body.curve != first.curve {
            t.log.fault(
                body.at,
                format!("curve {}", body.curve),
                format!("curve {}, which {} has", first.curve, t.log.line(first.at, body.at)),
                "let all axes follow one curve, each with its own SF",
            );
        }
        // The load acts against the axis, as of a base that is accelerated along it.
        acceleration[body.axis] -= body.factor;
    }
    let Some(curve) = t.curve(first.curve, Meaning::Velocity, first.at) else { return };
    let acceleration = t.vector(first.at, "an acceleration of", acceleration);
    t.deck.gravity = Some(Gravity { acceleration, drive: Drive::along(curve, 1.0) });
}

/// Mass damping of everything.
pub(super) fn write_damping(t: &mut Translation<'_>) {
    let rate = t.problem.damping;
    t.deck.relaxation = (rate != 0.0).then_some(Relaxation { factor: 1.0, rate, until: None });
}

/// Rigid walls.
pub(super) fn write_walls(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    for (n, wall) in problem.conditions.walls.iter().enumerate() {
        let at = wall.at;
        let some = wall.target != Target::All || wall.except != 0 || wall.inside != 0 || wall.offset != 0.0;
        let normal = unit(wall.normal).unwrap_or_default();
        let mut set = None;
        if some {
            let mut nodes = t.nodes(wall.target, at);
            let inside = (wall.inside != 0).then(|| problem.within(wall.inside, at, log));
            let except = if wall.except != 0 { problem.node_set(wall.except, at, log) } else { Vec::new() };
            nodes.retain(|node| {
                let x = problem.position(*node).unwrap_or_default();
                let height = dot(sub(x, wall.point), normal);
                except.binary_search(node).is_err()
                    && inside.as_ref().is_none_or(|inside| inside(x))
                    && (wall.offset <= 0.0 || height <= wall.offset)
            });
            if nodes.is_empty() {
                log.warn(at, "a wall that no node with an element feels");
                continue;
            }
            set = Some(Region::Set(t.set(&format!("wall {}", n + 1), nodes, at)));
        }
        let motion = match wall.moving {
            None => WallMotion::Fixed,
            Some([mass, speed]) => {
                WallMotion::Free { mass, velocity: t.vector(at, "a velocity of", normal.map(|c| speed * c)) }
            }
        };
        let shape = WallShape::Plane {
            point: wall.point.map(|x| x + 0.0),
            normal: t.vector(at, "a normal with", normal),
        };
        t.deck.walls.push(Wall {
            at,
            title: "a *RIGIDWALL".to_string(),
            shape: Some(shape),
            friction: wall.friction,
            motion: Some(motion),
            parts: Parts::All,
            nodes: set,
        });
    }
}
