//! Parts that are rigid for a time: they deform before and after it.
//!
//! While a part is rigid its nodes are a [`Body`], formed from what they are when its time begins: their masses and places, and the
//! rigid motion of the same momentum and angular momentum. The energy of whatever other motion they have is lost, and booked. What holds
//! single nodes does nothing in that time. Elements go on as they are: without strain they turn their stress with the body, so that they
//! deform again from there when the time is over.
//!
//! Bodies form and end between two cycles, at the first of which the time is in the span. Whoever computes begins anew there, so the
//! bodies of a setup never change while a domain stands.

use serde::{Deserialize, Serialize};

use super::{
    Body, State,
    shape::{Node, Whole, forces_on, is_positive, starting, widen},
};
use crate::{
    exact::Quantum,
    load::{Drive, Span},
    mesh::Mesh,
    setup::Setup,
    state::GlobalState,
    vectors::{dot, minus},
    wall::{self, Pose},
};

/// How far nodes of a part that deforms again may be inside a wall, over the reach of the part.
const INSIDE: f64 = 1e-6;

/// Parts that are one rigid body for a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Switch {
    /// Its parts, by index, ascending.
    pub parts: Vec<u32>,
    /// When it is one.
    pub span: Span,
    /// Prescribed velocity of the centre by axis (length per time).
    pub velocity: [Option<Drive>; 3],
    /// Prescribed angular velocity about axes through the centre that do not turn (radians per time).
    pub spin: [Option<Drive>; 3],
}

impl Switch {
    /// No node of it is farther from its centre: the diagonal of the box around it, as the deck has it (length).
    pub fn reach(&self, mesh: &Mesh) -> f64 {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &n in self.parts.iter().flat_map(|&p| &mesh.parts[p as usize].nodes) {
            for (a, x) in mesh.positions[n as usize].into_iter().enumerate() {
                (low[a], high[a]) = (low[a].min(x), high[a].max(x));
            }
        }
        let diagonal = minus(high, low);
        dot(diagonal, diagonal).sqrt()
    }
}

/// A body that has formed and has not ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Formed {
    /// Index into [`Setup::switches`].
    pub switch: u32,
    /// Its motion is that with which it formed.
    pub body: Body,
    /// Constraints of its nodes, which they have again when it ends.
    pub constraint: Vec<u16>,
}

/// A body has formed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Formation {
    /// The part that books it.
    pub part: u32,
    /// Kinetic energy that its nodes lost.
    pub lost: f64,
}

/// What bodies form and end in.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    pub setup: &'a Setup,
    pub mesh: &'a Mesh,
    /// Poses of the walls of finite mass.
    pub walls: &'a [Pose],
    /// The time step to come (time); none at the start of a run.
    pub dt: Option<f64>,
}

/// What a switch did, as far as the last vote does not know it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    pub formations: Vec<Formation>,
    /// Of nodes that are no body's any more, see [`Vote::strike`](crate::vote::Vote::strike).
    pub strike: f64,
    /// Greatest speed of a node of a body that formed.
    pub speed: f64,
}

/// Whether bodies are to form or to end before the cycle that starts at a time.
pub fn is_due(switches: &[Switch], formed: &[Formed], time: f64) -> bool {
    let has_formed = |index: u32| formed.iter().any(|formed| formed.switch == index);
    (0..).zip(switches).any(|(index, switch)| switch.span.holds(time) != has_formed(index))
}

/// The setup of a domain while these bodies are formed: they stand behind those that last.
pub fn with_formed(setup: &Setup, formed: &[Formed]) -> Setup {
    let mut setup = setup.clone();
    setup.bodies.extend(formed.iter().map(|formed| formed.body.clone()));
    setup
}

/// Forms and ends the bodies that are due in a state: `formed` are those so far, in the order of the switches, and `bodies` the states
/// of all bodies.
///
/// # Errors
/// If the nodes of a part have no inertia, a part is to deform again where a wall is, or there are states of other bodies than these.
pub fn switch(
    about: &Surroundings<'_>,
    state: &mut GlobalState,
    formed: &mut Vec<Formed>,
    bodies: &mut Vec<State>,
) -> Result<Outcome, String> {
    let setup = about.setup;
    let lasting = setup.bodies.len();
    if bodies.len() != lasting + formed.len() {
        let expected = lasting + formed.len();
        return Err(format!("a vote with the states of {} rigid bodies, expected {expected}", bodies.len()));
    }
    let moving = bodies.split_off(lasting);
    let before = std::mem::take(formed).into_iter().zip(moving);
    let stays = |formed: &Formed| setup.switches[formed.switch as usize].span.holds(state.time);
    let (stay, end): (Vec<(Formed, State)>, Vec<_>) = before.partition(|(formed, _)| stays(formed));
    // Constraints come back first: nodes may go from one body to another.
    for (Formed { body, constraint, .. }, _) in &end {
        for (&node, &constraint) in body.nodes.iter().zip(constraint) {
            state.constraint[node as usize] = constraint;
        }
    }
    let mut outcome = Outcome::default();
    let mut stay = stay.into_iter().peekable();
    for (index, switch) in (0..).zip(&setup.switches) {
        let (body, motion) = match stay.next_if(|(formed, _)| formed.switch == index) {
            Some(stays) => stays,
            None if switch.span.holds(state.time) => {
                let (body, lost) = form(about, state, (index, switch))?;
                outcome.formations.push(Formation { part: switch.parts[0], lost });
                let speeds = body.body.nodes.iter().map(|&n| state.v[n as usize]).map(|v| dot(v, v));
                outcome.speed = outcome.speed.max(speeds.fold(0.0, f64::max).sqrt());
                let motion = body.body.start;
                (body, motion)
            }
            None => continue,
        };
        formed.push(body);
        bodies.push(motion);
    }
    for (ended, _) in &end {
        let is_free = |node: &u32| formed.iter().all(|now| now.body.nodes.binary_search(node).is_err());
        let free: Vec<u32> = ended.body.nodes.iter().copied().filter(is_free).collect();
        outcome.strike = outcome.strike.max(release(about, state, ended.switch, &free)?);
    }
    Ok(outcome)
}

/// Looks at nodes that move each for itself again, where walls are that they feel: gives the share of the speed of sound at which one of
/// them will strike.
fn release(about: &Surroundings<'_>, state: &GlobalState, switch: u32, nodes: &[u32]) -> Result<f64, String> {
    let Surroundings { setup, mesh, walls, dt } = *about;
    let parts = || setup.switches[switch as usize].parts.iter().map(|&p| &mesh.parts[p as usize]);
    let slowest = parts().map(|part| setup.materials[part.material as usize].sound_speed());
    let slowest = slowest.fold(f64::INFINITY, f64::min);
    let extent = nodes.iter().map(|&n| minus(state.x[n as usize], state.x[nodes[0] as usize]));
    let extent = extent.flatten().fold(0.0_f64, |extent, c| extent.max(c.abs()));
    let mut poses = Vec::new();
    wall::poses(&setup.walls, &setup.loads.curves, state.time, 0.0, walls, &mut poses);
    let mut closing = 0.0_f64;
    for &node in nodes {
        let (x, v) = (state.x[node as usize], state.v[node as usize]);
        let felt = setup.constraints[usize::from(state.constraint[node as usize])].walls;
        closing = closing.max(wall::closing(
            &setup.walls,
            &poses,
            felt,
            x,
            v,
            wall::FORESEEN * dt.unwrap_or_default(),
        ));
        for w in (0..setup.walls.len()).filter(|w| felt >> w & 1 == 1) {
            let (height, _) = setup.walls[w].shape.height(minus(x, poses[w][0]));
            if height < -INSIDE * extent {
                return Err(format!(
                    "part `{}` is to deform again from {:e} on; its node {} is then {:e} inside [[wall]] {}, which does not stop it while it is rigid: let it deform earlier",
                    parts().next().map_or("", |part| part.name.as_str()),
                    state.time,
                    mesh.node_ids[node as usize],
                    -height,
                    w + 1
                ));
            }
        }
    }
    Ok(closing / slowest)
}

/// Makes one body of nodes as they are; gives it, and the kinetic energy that its nodes lose. Where no element is left it has no nodes.
fn form(
    about: &Surroundings<'_>,
    state: &mut GlobalState,
    (index, switch): (u32, &Switch),
) -> Result<(Formed, f64), String> {
    let Surroundings { setup, mesh, .. } = *about;
    let nodes = living_nodes(mesh, state, &switch.parts);
    let body = Body {
        parts: Vec::new(),
        account: switch.parts[0],
        mass: 1.0,
        inertia: [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
        velocity: switch.velocity,
        spin: switch.spin,
        circle: None,
        start: starting(&[0.0; 6], [0.0; 3], [0.0; 3], [0.0; 3]),
        nodes: Vec::new(),
        places: Vec::new(),
        nodal_scale: 1.0,
        length: Quantum::for_reference(1.0, 50),
        courant: None,
        forces: Vec::new(),
        pulls: Vec::new(),
    };
    let Some(&first) = nodes.first() else {
        return Ok((Formed { switch: index, body, constraint: Vec::new() }, 0.0));
    };
    let first = state.x[first as usize];
    let shells = &state.shells;
    let alone = |&n: &u32| {
        let n = n as usize;
        // Nodes of shells and beams turn by themselves.
        let inertia = shells.inertia.get(n).copied().unwrap_or_default();
        let spin = if inertia > 0.0 { shells.spin[n] } else { [0.0; 3] };
        Node { mass: state.mass[n], inertia, x: minus(state.x[n], first), v: state.v[n], spin }
    };
    let alone: Vec<Node> = nodes.iter().map(alone).collect();
    let whole = Whole::of(&alone);
    let mut inertia = whole.inertia;
    widen(&mut inertia);
    if !is_positive(&inertia) {
        return Err(format!(
            "part `{}` is to be rigid from {:e} on; the inertia of its nodes is {inertia:?}, it must be positive",
            mesh.parts[switch.parts[0] as usize].name, state.time
        ));
    }
    let places: Vec<[f64; 3]> = alone.iter().map(|node| minus(node.x, whole.centre)).collect();
    let centre: [f64; 3] = std::array::from_fn(|a| first[a] + whole.centre[a]);
    let start = starting(&inertia, centre, whole.velocity, whole.spin);
    let constraint: Vec<u16> = nodes.iter().map(|&n| state.constraint[n as usize]).collect();
    let mass_of = |i: usize| alone[i].mass;
    let constraints = (setup.constraints.as_slice(), constraint.as_slice());
    let (forces, pulls) = forces_on(constraints, &setup.loads, &places, &mass_of, [whole.mass; 2]);
    for ((&n, &place), node) in nodes.iter().zip(&places).zip(&alone) {
        let n = n as usize;
        state.v[n] = start.velocity_at(place);
        if node.inertia > 0.0 {
            state.shells.spin[n] = start.spin;
        }
        state.constraint[n] = 0;
    }
    let length = whole.length(&places);
    let kept = 0.5 * whole.mass.mul_add(dot(start.velocity, start.velocity), dot(start.spin, start.momentum));
    let body = Body { mass: whole.mass, inertia, start, nodes, places, length, forces, pulls, ..body };
    Ok((Formed { switch: index, body, constraint }, whole.kinetic - kept))
}

/// Nodes of the elements of these parts that have not eroded, ascending.
fn living_nodes(mesh: &Mesh, state: &GlobalState, parts: &[u32]) -> Vec<u32> {
    let offsets = mesh.element_offsets();
    let mut nodes: Vec<u32> = Vec::new();
    for &p in parts {
        let part = &mesh.parts[p as usize];
        if state.eroded.is_empty() {
            nodes.extend(&part.nodes);
            continue;
        }
        let alive = |&e: &usize| !state.is_eroded(offsets[p as usize] + e);
        for e in (0..part.n_elements()).filter(alive) {
            nodes.extend(part.nodes_of(e).iter());
        }
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
