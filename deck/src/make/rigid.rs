//! Parts whose nodes move as one.

use mechanics::{
    constraint::Constraint,
    load::{Drive, Span},
    material::Material,
    rigid::{Body, shape},
};

use super::{
    assembly::Assembly,
    boundary::Conditions,
    names::{Curves, Names},
    region,
};
use crate::{log::Log, typed::condition::Rigid};
use held::Held;

mod held;
mod switch;

pub(super) use switch::make_switches;

/// A rigid body and what it is given.
pub(super) struct RigidDraft<'d> {
    rigid: &'d Rigid,
    given: shape::Given,
}

impl<'d> RigidDraft<'d> {
    /// Its own name.
    pub(super) fn name(&self) -> Option<&'d str> {
        self.rigid.name.as_ref().map(|name| name.value.as_str())
    }

    /// Its parts, by index.
    pub(super) fn parts(&self) -> &[u32] {
        &self.given.parts
    }

    /// Whether some part is of both.
    fn shares_parts_with(&self, other: &Self) -> bool {
        self.given.parts.iter().any(|part| other.given.parts.contains(part))
    }

    /// Whether it has this name, or this part.
    pub(super) fn is(&self, name: &str, part: Option<usize>) -> bool {
        self.name() == Some(name) || part.is_some_and(|part| self.given.parts.contains(&(part as u32)))
    }
}

/// Resolves what the bodies are given, those that last and those that are rigid for a time; a part of two bodies at one time is a fault.
pub(super) fn drafts<'d>(
    list: &'d [Rigid],
    names: &Names<'_>,
    curves: &Curves<'_>,
    assembly: &Assembly,
    log: &Log<'_>,
) -> (Vec<RigidDraft<'d>>, Vec<RigidDraft<'d>>) {
    let mut drafts: Vec<RigidDraft<'d>> = Vec::new();
    for rigid in list {
        let parts: Vec<u32> =
            names.several(&rigid.parts).unwrap_or_default().into_iter().map(|p| p as u32).collect();
        if let Some(name) = &rigid.name
            && drafts.iter().any(|other| other.name() == Some(&name.value))
        {
            log.fault_of(name.origin, "a name that no other [[rigid]] has", "choose another name");
        }
        if let Some(name) = &rigid.name {
            let part = assembly.mesh.parts.iter().position(|part| part.name == name.value);
            if part.is_some_and(|part| !parts.contains(&(part as u32))) {
                log.fault_of(name.origin, "a name that no part outside this body has", "choose another name");
            }
        }
        let of_both = |other: &&RigidDraft<'d>| {
            let at_once = !rigid.span.is_apart_from(&other.rigid.span);
            at_once && parts.iter().any(|p| other.given.parts.contains(p))
        };
        for other in drafts.iter().filter(of_both) {
            let line = log.line(other.rigid.at, rigid.at);
            let a_body = log.say("the [[rigid]]", "the rigid body");
            log.fault(
                rigid.at,
                format!("{} with a part of {a_body} at {line}", rigid.title),
                "every part in one rigid body",
                "take it out of one of the two",
            );
        }
        let [velocity, spin] =
            [&rigid.velocity, &rigid.spin].map(|c| curves.components(c).unwrap_or_default());
        let nodes = rigid.nodes.as_ref().and_then(|nodes| region::nodes(nodes, &[], assembly, log));
        let circle = rigid.circle.as_ref().and_then(|circle| curves.circle(circle));
        let given = shape::Given {
            parts,
            nodes: nodes.unwrap_or_default(),
            circle,
            mass: rigid.mass,
            inertia: rigid.inertia,
            start_spin: rigid.start_spin,
            velocity,
            spin,
        };
        drafts.push(RigidDraft { rigid, given });
    }
    drafts.into_iter().partition(|draft| draft.rigid.span == Span::ALWAYS)
}

/// The parts of each body.
pub(super) fn parts_of<'a>(drafts: &'a [RigidDraft<'_>]) -> impl Iterator<Item = &'a [u32]> {
    drafts.iter().map(|draft| draft.given.parts.as_slice())
}

/// Makes the bodies; what was to hold or push their nodes goes to them or is a fault. None after any fault.
pub(super) fn make(
    drafts: &[RigidDraft<'_>],
    materials: &[Material],
    assembly: &mut Assembly,
    conditions: &mut Conditions,
    log: &Log<'_>,
) -> Vec<Body> {
    if drafts.is_empty() {
        return Vec::new();
    }
    let mut body_of: Vec<Option<usize>> = vec![None; assembly.mesh.n_nodes()];
    let mut bodies = Vec::new();
    for (b, RigidDraft { rigid, given }) in drafts.iter().enumerate() {
        let (at, title) = (rigid.at, &rigid.title);
        let names = |p: usize| format!("\"{}\"", assembly.mesh.parts[p].name);
        let walls = &conditions.walls;
        if let Some((w, p)) = (0..walls.len())
            .find_map(|w| given.parts.iter().find(|&&p| walls[w].parts[p as usize]).map(|&p| (w, p as usize)))
        {
            log.fault(
                at,
                format!("{title} with part {}, which {} stops", names(p), conditions.wall_titles[w]),
                "parts that no wall stops: walls act on single nodes",
                log.say(
                    "name the other parts in the wall; to stop the body, give it contact with a rigid part that is held",
                    "leave its nodes out of the wall by NSIDEX; to stop the body, give it a *CONTACT with a rigid part that \
                     is held",
                ),
            );
        }
        let mut first_held = None;
        for &n in &given.all_nodes(&assembly.mesh) {
            let id = assembly.mesh.node_ids[n as usize];
            let held = conditions.constraints[conditions.constraint[n as usize] as usize];
            if !is_free(&held) && first_held.is_none() {
                first_held = Some(id);
            }
            // Of bodies with a common part that was reported.
            let apart = |other: &usize| !drafts[*other].given.parts.iter().any(|p| given.parts.contains(p));
            if let Some(other) = body_of[n as usize].replace(b).filter(|other| *other != b && apart(other)) {
                log.fault(
                    at,
                    format!("{title} with node {id}, which {} has too", drafts[other].rigid.title),
                    "bodies that share no nodes",
                    log.say(
                        "make them one [[rigid]], or do not join them",
                        "make them one body, or take the node out of one",
                    ),
                );
                break;
            }
        }
        if log.count() > 0 {
            continue;
        }
        let make = |given: shape::Given| {
            shape::body(
                &assembly.mesh,
                materials,
                (&conditions.constraints, &conditions.constraint),
                &conditions.loads,
                given,
                (&assembly.velocity, &assembly.spin),
            )
        };
        let mut made = make(given.clone());
        if let (Some(id), Ok(body)) = (first_held, &made) {
            let Some(held) = given_with_supports(given, body, conditions, &Constraint::clone) else {
                log.fault(
                    at,
                    format!("{title} with node {id}, which a boundary or a wall holds"),
                    "nodes that move as the body does, or supports that hold it along or about axes",
                    log.say(
                        "take them out of the boundary or wall; velocity and spin of [[rigid]] hold the body",
                        "take them out of the boundary or wall; CON1 and CON2 of *MAT_RIGID hold the body",
                    ),
                );
                continue;
            };
            let kept = |drives: &[Option<Drive>; 3]| {
                let axes = drives.iter().zip(["x", "y", "z"]);
                axes.filter(|(drive, _)| **drive == HOLD).map(|(_, axis)| axis).collect::<Vec<_>>().join(", ")
            };
            log.warn(
                at,
                format!(
                    "{title}: what holds nodes of it holds the body, along [{}] and about [{}] of its centre",
                    kept(&held.velocity),
                    kept(&held.spin)
                ),
            );
            made = make(held);
        }
        match made {
            Ok(body) => {
                start(assembly, &body);
                bodies.push(body);
            }
            Err(words) => log.fault(
                at,
                format!("{title} with {words}"),
                "mass and inertia of a body",
                log.say(
                    "correct the mesh, or mass and inertia of [[rigid]]",
                    "correct the mesh, or convert the deck and give mass and inertia in [[rigid]]",
                ),
            ),
        }
    }
    let n_rigid: usize = bodies.iter().map(|body| body.parts.len()).sum();
    for body in &mut bodies {
        body.nodes.iter().for_each(|&n| conditions.constraint[n as usize] = 0);
        if n_rigid == assembly.mesh.parts.len() {
            body.courant = shape::courant(&assembly.mesh, materials, &body.parts);
        }
    }
    bodies
}

/// The velocity of what is held.
const HOLD: Option<Drive> = Some(Drive::constant(0.0));

/// Whether nothing holds or moves a node.
fn is_free(by: &Constraint) -> bool {
    by.velocity == [None; 3] && by.circle.is_none() && by.clamped == 0 && by.walls == 0
}

/// What a body is given, and what supports of its nodes hold of it; none where they do more than hold, or another motion is given there.
/// `acting` is what of a constraint acts on nodes of the body.
fn given_with_supports(
    given: &shape::Given,
    body: &Body,
    conditions: &Conditions,
    acting: &dyn Fn(&Constraint) -> Constraint,
) -> Option<shape::Given> {
    let reach = body.reach();
    let mut held = Held::default();
    for (&n, place) in body.nodes.iter().zip(&body.places) {
        let by = &acting(&conditions.constraints[conditions.constraint[n as usize] as usize]);
        if !is_free(by) && !held.take(by, place.map(|c| c / reach)) {
            return None;
        }
    }
    let axes = held.axes()?;
    let mut given = given.clone();
    for (drive, _) in given.velocity.iter_mut().chain(&mut given.spin).zip(axes).filter(|(_, held)| *held) {
        if drive.is_some_and(|other| Some(other) != HOLD) || given.circle.is_some() {
            return None;
        }
        *drive = HOLD;
    }
    Some(given)
}

/// Lets the nodes of a body move and turn at the start as it does; only those of shells and beams ever use how they turn.
fn start(assembly: &mut Assembly, body: &Body) {
    for (&n, &place) in body.nodes.iter().zip(&body.places) {
        assembly.velocity[n as usize] = body.start.velocity_at(place);
    }
    let turns = assembly.mesh.parts.iter().any(|part| part.turns_nodes());
    if turns && (body.start.spin != [0.0; 3] || !assembly.spin.is_empty()) {
        assembly.spin.resize(assembly.velocity.len(), [0.0; 3]);
        body.nodes.iter().for_each(|&n| assembly.spin[n as usize] = body.start.spin);
    }
}
