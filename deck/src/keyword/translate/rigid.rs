//! Which parts are one rigid body each, and what holds, moves and starts them.

use std::collections::{BTreeMap, BTreeSet};

use mechanics::load::Span;

use super::{
    condition::driven,
    reference,
    state::{Bodies, Translation},
    switch,
};
use crate::{
    geometry::{cross, sub},
    keyword::{
        condition::Target,
        material::Law,
        prescribed::Way,
        rigid::{BodyNodes, Members, NodalBody},
        velocity::{Over, Velocity},
    },
    place::Place,
    typed::condition::{Circle, Components, Drive, Parts, Region, Rigid, made},
};

const AXES: [&str; 3] = ["x", "y", "z"];
const FREE: Components = [const { None }; 3];

/// Finds the rigid bodies: parts of rigid material, parts that become rigid, and what belongs together.
pub(super) fn find_bodies(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    t.switched = switch::Switched::of(t);
    let mut bodies = Bodies::default();
    for (&id, part) in problem.parts.iter().filter(|(id, _)| t.names.contains_key(id)) {
        if matches!(problem.materials.get(&part.material.value).map(|m| &m.law), Some(Law::Rigid { .. })) {
            bodies.lead.insert(id, id);
        }
    }
    let mut pairs = Vec::new();
    for card in &problem.rigid.joined {
        let members = match card.members {
            Members::Part(id) => vec![id],
            Members::Set(id) => problem.part_set(id, card.at, log),
        };
        for id in members {
            if card.switched && t.switched.is_timed(id) {
                continue;
            }
            if !problem.parts.contains_key(&id) {
                log.fault(card.at, format!("part {id}"), "a part of the deck", "correct the number");
            } else if card.switched && t.names.contains_key(&id) {
                bodies.lead.entry(id).or_insert(id);
            }
            if card.lead != 0 {
                pairs.push((card.lead, id, card.at));
            }
        }
    }
    // After all cards, so that their order does not matter.
    for (lead, part, at) in pairs {
        match [lead, part].into_iter().find(|id| bodies.of(*id).is_none()) {
            Some(id) => log.fault(
                at,
                format!("part {id}, which deforms or has no elements"),
                "parts of rigid material or of *DEFORMABLE_TO_RIGID",
                "make it rigid, or join its nodes to those of the other part",
            ),
            None => bodies.join(lead, part),
        }
    }
    join_neighbours(t, &mut bodies);
    problem.check_inertias(|id| bodies.of(id).is_some(), log);
    t.bodies = bodies;
    t.bodies.starts = starts(t);
}

/// Bodies that share nodes move as one.
fn join_neighbours(t: &Translation<'_>, bodies: &mut Bodies) {
    let mut first: BTreeMap<u32, u32> = BTreeMap::new();
    let mut joined: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for ((&id, _), body) in t.names.iter().zip(&t.mesh.bodies) {
        if bodies.of(id).is_none() {
            continue;
        }
        for node in body.corners().collect::<BTreeSet<u32>>() {
            let other = *first.entry(node).or_insert(id);
            if !bodies.same(other, id) {
                bodies.join(other, id);
                joined.insert((other, id), node);
            }
        }
    }
    for ((a, b), node) in joined {
        t.log.warn(
            t.problem.parts[&b].at,
            format!("rigid parts {a} and {b} share nodes, such as {node}: they are one body"),
        );
    }
}

/// What bodies begin with by `*INITIAL_VELOCITY_RIGID_BODY`.
fn starts(t: &Translation<'_>) -> BTreeMap<u32, [[f64; 3]; 2]> {
    let mut starts = BTreeMap::new();
    // Those of the part go before velocities of nodes, and *INITIAL_VELOCITY_RIGID_BODY before both.
    for (part, given) in &t.problem.rigid.inertias {
        starts.extend(t.bodies.of(*part).map(|lead| (lead, given.start)));
    }
    for given in &t.problem.conditions.velocities {
        start_over(t, given, &mut starts);
    }
    for start in &t.problem.rigid.starts {
        let turned = |v| t.turned(v, start.system, start.at);
        if let Some(lead) = body_at(t, start.part, start.at) {
            starts.insert(lead, [turned(start.velocity), turned(start.spin)]);
        }
    }
    starts
}

/// Puts an initial velocity over those starts of `*PART_INERTIA` that IRIGID says.
fn start_over(t: &Translation<'_>, given: &Velocity, starts: &mut BTreeMap<u32, [[f64; 3]; 2]>) {
    let (problem, log) = (t.problem, t.log);
    let parts = match given.over {
        Over::None => return,
        Over::All | Over::InBox => None,
        Over::Parts(set) => Some(problem.part_set(set, given.at, log)),
        Over::Named => match given.target {
            Target::All => None,
            Target::Part(id) => Some(vec![id]),
            Target::PartSet(set) => Some(problem.part_set(set, given.at, log)),
            target => {
                let nodes: BTreeSet<u32> = t.nodes(target, given.at).into_iter().collect();
                let inertias = problem.rigid.inertias.keys().copied();
                let has = |id: &u32| problem.nodes_of_part(*id).iter().any(|node| nodes.contains(node));
                Some(inertias.filter(has).collect())
            }
        },
    };
    let in_box = matches!(given.over, Over::InBox | Over::Parts(_)) && given.inside != 0;
    let inside = in_box.then(|| problem.within(given.inside, given.at, log));
    let turned = |v| t.turned(v, given.system, given.at);
    let (velocity, spin, own) = (turned(given.velocity), turned(given.spin), turned(given.own_turn));
    for (part, inertia) in &problem.rigid.inertias {
        let Some(lead) = t.bodies.of(*part) else { continue };
        let Some(centre) = problem.centre_of(inertia) else { continue };
        let is_named = parts.as_ref().is_none_or(|parts| parts.contains(part));
        if is_named && inside.as_ref().is_none_or(|inside| inside(centre)) {
            let round = cross(spin, sub(centre, given.point));
            let moves = [0, 1, 2].map(|a| velocity[a] + round[a]);
            let turns = [0, 1, 2].map(|a| spin[a] + own[a]);
            starts.insert(lead, [moves, turns]);
        }
    }
}

/// The nodes of the bodies that have parts of a target: of all of their parts, and those that go with these.
pub(super) fn nodes_of_bodies(t: &Translation<'_>, target: Target, at: Place) -> Vec<u32> {
    let problem = t.problem;
    let named = match target {
        Target::Part(id) => vec![id],
        Target::PartSet(set) => problem.part_set(set, at, t.log),
        _ => return Vec::new(),
    };
    let leads: BTreeSet<u32> = named.into_iter().filter_map(|id| t.bodies.of(id)).collect();
    let parts = t.bodies.lead.iter().filter(|(_, lead)| leads.contains(lead));
    let mut nodes: Vec<u32> = parts.flat_map(|(part, _)| problem.nodes_of_part(*part)).collect();
    for extra in &problem.rigid.extra {
        if t.bodies.of(extra.part).is_some_and(|lead| leads.contains(&lead)) {
            nodes.extend(t.nodes(extra.target, extra.at));
        }
    }
    nodes
}

/// The body of a part that a card names; a part that is none is a fault at the card.
fn body_at(t: &Translation<'_>, part: u32, at: Place) -> Option<u32> {
    let lead = t.bodies.of(part);
    if lead.is_none() {
        t.log.fault(
            at,
            format!("part {part}"),
            "a part of a rigid body, with elements",
            "give it *MAT_RIGID, or move its nodes",
        );
    }
    lead
}

/// Puts the velocities of bodies over those of their nodes.
pub(super) fn start_bodies(
    t: &Translation<'_>,
    velocities: &mut BTreeMap<u32, [f64; 3]>,
    spins: &mut BTreeMap<u32, [f64; 3]>,
) {
    for ((id, _), body) in t.names.iter().zip(&t.mesh.bodies) {
        let Some(lead) = t.bodies.of(*id) else { continue };
        // The others begin as their nodes say.
        let Some([velocity, _]) = t.bodies.starts.get(&lead) else { continue };
        for node in body.corners() {
            velocities.insert(node, *velocity);
            spins.remove(&node);
        }
    }
}

/// Adds the rigid bodies to the deck.
pub(super) fn write(t: &mut Translation<'_>) {
    let (problem, log) = (t.problem, t.log);
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (part, lead) in &t.bodies.lead {
        members.entry(*lead).or_default().push(*part);
    }
    let mut motions = motions(t);
    let mut extra = extra_nodes(t);
    for (lead, parts) in members {
        // What holds a body is said by the part that leads, or else by the first that says anything.
        let law = |id: &u32| match problem.materials.get(&problem.parts[id].material.value).map(|m| &m.law) {
            Some(Law::Rigid { held }) => Some((*id, *held)),
            _ => None,
        };
        let ruling = law(&lead).or_else(|| parts.iter().find_map(law));
        let (ruler, held) = ruling.unwrap_or((lead, [[false; 3]; 2]));
        if let Some((other, _)) = parts.iter().filter_map(law).find(|(_, other)| *other != held) {
            log.warn(
                problem.parts[&other].at,
                format!(
                    "part {other} is of the body that part {ruler} leads: CON1 and CON2 of the latter hold it"
                ),
            );
        }
        let at = problem.parts[&lead].at;
        let held = led_by_references(t, &mut motions, lead, held);
        let ([velocity, spin], circle) = led(t, (&mut motions, lead), held, &format!("part {ruler}"));
        let nodes = extra
            .remove(&lead)
            .map(|(place, nodes)| Region::Set(t.set(&format!("extra nodes of part {lead}"), nodes, place)));
        let inertia = problem.inertia_of(&parts, log);
        let spun = t.bodies.starts.get(&lead).map(|[_, spin]| *spin);
        let start_spin = spun.map(|spin| t.vector(at, "an angular velocity of", spin));
        t.deck.rigid.push(Rigid {
            at,
            title: format!("the rigid body of part {lead}"),
            name: None,
            parts: Parts::Named(parts.iter().map(|id| made(t.names[id].clone(), at)).collect()),
            nodes,
            mass: inertia.map(|(mass, _)| mass),
            inertia: inertia.map(|(_, inertia)| inertia),
            start_spin,
            velocity,
            spin,
            circle,
            span: Span::ALWAYS,
        });
    }
    for given in &problem.rigid.of_nodes {
        let set = match given.nodes {
            BodyNodes::Set(set) => problem.node_set(set, given.at, log),
            BodyNodes::Pair(pair) => pair.to_vec(),
        };
        let nodes: Vec<u32> = set.iter().copied().filter(|node| t.used.contains(node)).collect();
        if nodes.len() < 2 {
            log.fault(
                given.at,
                format!("a nodal rigid body of {} nodes that elements have", nodes.len()),
                "two nodes at least",
                "correct the set, or take the body out",
            );
            continue;
        }
        if nodes.len() < set.len() {
            let words =
                format!("{} nodes of the body have no element: they are left out", set.len() - nodes.len());
            log.warn(given.at, words);
        }
        let title = title_of(given);
        let held = led_by_references(t, &mut motions, given.id, given.held);
        let ([velocity, spin], circle) = led(t, (&mut motions, given.id), held, &title);
        let nodes = Some(Region::Set(t.set(&title, nodes, given.at)));
        t.deck.rigid.push(Rigid {
            at: given.at,
            name: Some(made(title.clone(), given.at)),
            title,
            parts: Parts::Named(Vec::new()),
            nodes,
            mass: None,
            inertia: None,
            start_spin: None,
            velocity,
            spin,
            circle,
            span: Span::ALWAYS,
        });
    }
}

/// What a body of nodes is called.
pub(super) fn title_of(given: &NodalBody) -> String {
    match given.nodes {
        BodyNodes::Set(_) => format!("the nodal rigid body {}", given.id),
        BodyNodes::Pair([a, b]) => format!("the spot weld of nodes {a} and {b}"),
    }
}

/// By the part that leads: nodes that go with a rigid part, and where the first of its cards stands.
fn extra_nodes(t: &Translation<'_>) -> BTreeMap<u32, (Place, Vec<u32>)> {
    let mut extra: BTreeMap<u32, (Place, Vec<u32>)> = BTreeMap::new();
    for given in &t.problem.rigid.extra {
        let nodes = t.nodes(given.target, given.at);
        let Some(lead) = body_at(t, given.part, given.at) else { continue };
        extra.entry(lead).or_insert((given.at, Vec::new())).1.extend(nodes);
    }
    extra.retain(|_, (_, nodes)| !nodes.is_empty());
    for (_, nodes) in extra.values_mut() {
        nodes.sort_unstable();
        nodes.dedup();
    }
    extra
}

/// Motions by body and way.
type Motions = BTreeMap<(u32, u8, usize), (Place, Drive, [f64; 3])>;

/// What holds and moves a body at its nodes without elements: the axes along and about which it is held with these, and its motions.
fn led_by_references(
    t: &mut Translation<'_>,
    motions: &mut Motions,
    key: u32,
    held: [[bool; 3]; 2],
) -> [[bool; 3]; 2] {
    let held = reference::holds(t, key, held);
    let problem = t.problem;
    for (at, axis, index) in reference::motions(t, key, held[1]) {
        if let Some(drive) = driven(t, &problem.conditions.motions[index].how, at) {
            put(t, motions, (key, 0, axis), (at, drive, [0.0; 3]));
        }
    }
    held
}

/// What leads a body that is held along and about some axes: velocity and spin by axis, and a circle.
fn led(
    t: &Translation<'_>,
    (motions, lead): (&mut Motions, u32),
    held: [[bool; 3]; 2],
    title: &str,
) -> ([Components; 2], Option<Circle>) {
    let log = t.log;
    let mut components = [FREE; 2];
    for (turns, list) in components.iter_mut().enumerate() {
        for (axis, name) in AXES.into_iter().enumerate() {
            match motions.remove(&(lead, turns as u8, axis)) {
                Some((place, ..)) if held[turns][axis] => log.fault(
                    place,
                    format!("a motion of {title} along or about {name}"),
                    "an axis that CON1 or CON2 and *BOUNDARY_SPC of its nodes leave free",
                    "take one of the two out",
                ),
                Some((_, drive, _)) => list[axis] = Some(drive),
                None if held[turns][axis] => list[axis] = Some(Drive::constant(0.0)),
                None => {}
            }
        }
    }
    let mut circle = None;
    for (axis, name) in AXES.into_iter().enumerate() {
        let Some((place, rate, point)) = motions.remove(&(lead, 2, axis)) else { continue };
        let taken = (0..3).any(|a| a != axis && components[0][a].is_some()) || components[1][axis].is_some();
        if taken || circle.is_some() {
            let read = format!("a rotation of {title} about {name}");
            let expected = "an axis about which and across which nothing else moves or holds the body";
            log.fault(place, read, expected, "take one of the two out");
        }
        circle = Some(Circle { axis, point: t.vector(place, "an axis through", point), rate });
    }
    (components, circle)
}

/// Motions by curve: by the part that leads or the nodal body, whether it is along, about the centre or on a circle, and axis, the
/// place, drive and point of each.
fn motions(t: &mut Translation<'_>) -> Motions {
    let problem = t.problem;
    let mut motions = Motions::new();
    for motion in &problem.rigid.motions {
        let nodal = problem.rigid.of_nodes.iter().find(|body| body.id != 0 && body.id == motion.part);
        let lead = match nodal {
            Some(body) => Some(body.id),
            None => body_at(t, motion.part, motion.at),
        };
        let Some(lead) = lead else { continue };
        let Some(drive) = driven(t, &motion.how, motion.at) else { continue };
        let (key, point) = match motion.way {
            Way::Along(axis) => ((lead, 0, axis), [0.0; 3]),
            Way::Turn(axis) => ((lead, 1, axis), [0.0; 3]),
            Way::About(axis, point) => ((lead, 2, axis), point),
        };
        put(t, &mut motions, key, (motion.at, drive, point));
    }
    motions
}

/// Adds a motion of a body; a second one of its kind is a fault.
fn put(t: &Translation<'_>, motions: &mut Motions, key: (u32, u8, usize), motion: (Place, Drive, [f64; 3])) {
    let at = motion.0;
    if let Some((first, ..)) = motions.insert(key, motion) {
        t.log.fault(
            at,
            format!("a second motion of the body of part {}", key.0),
            format!("one by axis, which {} gives", t.log.line(first, at)),
            "take one of the two out, or add up their curves",
        );
    }
}
