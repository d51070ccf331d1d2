//! Which parts are one rigid body each, and what holds, moves and starts them, in the words of a TOML deck.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    super::{
        draft::{quoted, vector},
        log::Place,
        material::Law,
        rigid::Members,
    },
    AXES, Translation,
};

/// The rigid bodies of a deck.
#[derive(Default)]
pub(super) struct Bodies {
    /// The part that leads the body of each rigid part that has elements.
    lead: BTreeMap<u32, u32>,
    /// Velocity and angular velocity at the start by the part that leads, of those that have a card of their own.
    starts: BTreeMap<u32, [[f64; 3]; 2]>,
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
    fn join(&mut self, lead: u32, part: u32) {
        let (lead, old) = (self.of(lead), self.of(part));
        for body in self.lead.values_mut() {
            if let Some(lead) = lead.filter(|_| Some(*body) == old) {
                *body = lead;
            }
        }
    }
}

impl Translation<'_> {
    /// Finds the rigid bodies: parts of rigid material, parts that become rigid, and what belongs together.
    pub(super) fn find_bodies(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let mut bodies = Bodies::default();
        for (&id, part) in problem.parts.iter().filter(|(id, _)| self.names.contains_key(id)) {
            if matches!(problem.materials.get(&part.material).map(|m| &m.law), Some(Law::Rigid { .. })) {
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
                if !problem.parts.contains_key(&id) {
                    log.fault(card.at, format!("part {id}"), "a part of the deck", "correct the number");
                } else if card.switched && self.names.contains_key(&id) {
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
        self.join_neighbours(&mut bodies);
        self.bodies = bodies;
        self.bodies.starts = self.starts();
    }

    /// Bodies that share nodes move as one.
    fn join_neighbours(&self, bodies: &mut Bodies) {
        let mut first: BTreeMap<u32, u32> = BTreeMap::new();
        let mut joined: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for ((&id, _), body) in self.names.iter().zip(&self.mesh.bodies) {
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
            self.log.warn(
                self.problem.parts[&b].at,
                format!("rigid parts {a} and {b} share nodes, such as {node}: they are one body"),
            );
        }
    }

    /// What bodies begin with by `*INITIAL_VELOCITY_RIGID_BODY`.
    fn starts(&self) -> BTreeMap<u32, [[f64; 3]; 2]> {
        let mut starts = BTreeMap::new();
        for start in &self.problem.rigid.starts {
            let turned = |v| self.turned(v, start.system, start.at);
            if let Some(lead) = self.body_at(start.part, start.at) {
                starts.insert(lead, [turned(start.velocity), turned(start.spin)]);
            }
        }
        starts
    }

    /// The body of a part that a card names; a part that is none is a fault at the card.
    fn body_at(&self, part: u32, at: Place) -> Option<u32> {
        let lead = self.bodies.of(part);
        if lead.is_none() {
            self.log.fault(
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
        &self,
        velocities: &mut BTreeMap<u32, [f64; 3]>,
        spins: &mut BTreeMap<u32, [f64; 3]>,
    ) {
        for ((id, _), body) in self.names.iter().zip(&self.mesh.bodies) {
            let Some(lead) = self.bodies.of(*id) else { continue };
            for node in body.corners() {
                // Nodes of a body turn as it does.
                spins.remove(&node);
                if let Some([velocity, _]) = self.bodies.starts.get(&lead) {
                    velocities.insert(node, *velocity);
                }
            }
        }
    }

    /// `[[rigid]]` for each body.
    pub(super) fn rigid(&mut self) {
        let (problem, log) = (self.problem, self.log);
        let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (part, lead) in &self.bodies.lead {
            members.entry(*lead).or_default().push(*part);
        }
        let mut drives = self.drives();
        for (lead, parts) in members {
            // What holds a body is said by the part that leads, or else by the first that says anything.
            let law = |id: &u32| match problem.materials.get(&problem.parts[id].material).map(|m| &m.law) {
                Some(Law::Rigid { held }) => Some((*id, *held)),
                _ => None,
            };
            let ruling = law(&lead).or_else(|| parts.iter().find_map(law));
            let (ruler, held) = ruling.unwrap_or((lead, [[false; 3]; 2]));
            if let Some((other, _)) = parts.iter().filter_map(law).find(|(_, other)| *other != held) {
                log.warn(
                    problem.parts[&other].at,
                    format!("part {other} is of the body that part {ruler} leads: CON1 and CON2 of the latter hold it"),
                );
            }
            let at = problem.parts[&lead].at;
            let names: Vec<String> = parts.iter().map(|id| quoted(&self.names[id])).collect();
            self.draft.heading(at, "[[rigid]]");
            self.draft.line(at, format!("parts = [{}]", names.join(", ")));
            if let Some([_, spin]) = self.bodies.starts.get(&lead) {
                self.draft.line(at, format!("start_spin = {}", vector(*spin)));
            }
            for (turns, key) in ["velocity", "spin"].into_iter().enumerate() {
                let mut words = Vec::new();
                let mut from = at;
                for (axis, name) in AXES.into_iter().enumerate() {
                    let drive = drives.remove(&(lead, turns == 1, axis));
                    match drive {
                        Some((place, _)) if held[turns][axis] => log.fault(
                            place,
                            format!("a motion of part {ruler} along or about {name}"),
                            "an axis that CON1 or CON2 of its *MAT_RIGID leaves free",
                            "take one of the two out",
                        ),
                        Some((place, drive)) => {
                            from = place;
                            words.push(format!("{name} = {drive}"));
                        }
                        None if held[turns][axis] => words.push(format!("{name} = 0")),
                        None => {}
                    }
                }
                if !words.is_empty() {
                    self.draft.line(from, format!("{key} = {{ {} }}", words.join(", ")));
                }
            }
        }
    }

    /// Motions by curve: by the part that leads, whether it turns, and axis, the place and words of each.
    fn drives(&mut self) -> BTreeMap<(u32, bool, usize), (Place, String)> {
        let (problem, log) = (self.problem, self.log);
        let mut drives: BTreeMap<(u32, bool, usize), (Place, String)> = BTreeMap::new();
        for motion in &problem.rigid.motions {
            let Some(lead) = self.body_at(motion.part, motion.at) else { continue };
            let Some(curve) = self.curve(motion.curve, motion.meaning, motion.at) else { continue };
            let words = format!("{{ curve = \"{curve}\", factor = {:?} }}", motion.factor);
            let key = (lead, motion.turns, motion.axis);
            if let Some((first, _)) = drives.insert(key, (motion.at, words)) {
                log.fault(
                    motion.at,
                    format!("a second motion of the body of part {lead}"),
                    format!("one by axis, which line {} gives", first.line),
                    "take one of the two out, or add up their curves",
                );
            }
        }
        drives
    }
}
