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
    Body, State, full,
    shape::{Moments, forces_on, is_positive, starting, widen},
    solve,
};
use crate::{
    exact::Quantum,
    load::{Drive, Span},
    mesh::Mesh,
    setup::Setup,
    state::GlobalState,
    vectors::{cross, dot, minus},
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
    /// The longest distance of a node from the middle of the nodes, as the deck has them (length).
    pub fn reach(&self, mesh: &Mesh) -> f64 {
        let places = || {
            let nodes = self.parts.iter().flat_map(|&p| &mesh.parts[p as usize].nodes);
            nodes.map(|&n| mesh.positions[n as usize])
        };
        let n = places().count().max(1) as f64;
        let middle: [f64; 3] = std::array::from_fn(|a| places().map(|x| x[a]).sum::<f64>() / n);
        places().map(|x| minus(x, middle)).map(|arm| dot(arm, arm)).fold(0.0, f64::max).sqrt()
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

/// Kinetic energy that a part lost as a body formed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    pub part: u32,
    pub kinetic: f64,
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
/// of all bodies. Gives what was lost.
///
/// # Errors
/// If the nodes of a part have no inertia, or a part is to deform again where a wall is, which stands as `walls` say.
pub fn switch(
    setup: &Setup,
    mesh: &Mesh,
    (state, walls): (&mut GlobalState, &[Pose]),
    formed: &mut Vec<Formed>,
    bodies: &mut Vec<State>,
) -> Result<Vec<Loss>, String> {
    let mut losses = Vec::new();
    if !is_due(&setup.switches, formed, state.time) {
        return Ok(losses);
    }
    let moving = bodies.split_off(setup.bodies.len());
    let before: Vec<(Formed, State)> = std::mem::take(formed).into_iter().zip(moving).collect();
    // Constraints come back first: nodes may go from one body to another.
    let stays = |formed: &Formed| setup.switches[formed.switch as usize].span.holds(state.time);
    let (stay, end): (Vec<_>, Vec<_>) = before.into_iter().partition(|(formed, _)| stays(formed));
    for (formed, _) in &end {
        release(setup, mesh, (state, walls), formed)?;
    }
    let mut before = stay.into_iter().peekable();
    for (index, switch) in (0..).zip(&setup.switches) {
        let (body, motion) = match before.next_if(|(formed, _)| formed.switch == index) {
            Some(stays) => stays,
            None if switch.span.holds(state.time) => {
                let (body, kinetic) = form(setup, mesh, state, (index, switch))?;
                losses.push(Loss { part: switch.parts[0], kinetic });
                let motion = body.body.start;
                (body, motion)
            }
            None => continue,
        };
        formed.push(body);
        bodies.push(motion);
    }
    Ok(losses)
}

/// Lets nodes move each for itself again, under what holds them.
fn release(
    setup: &Setup,
    mesh: &Mesh,
    (state, walls): (&mut GlobalState, &[Pose]),
    formed: &Formed,
) -> Result<(), String> {
    let mut poses = Vec::new();
    wall::poses(&setup.walls, &setup.loads.curves, state.time, 0.0, walls, &mut poses);
    let reach = formed.body.places.iter().flatten().fold(0.0_f64, |reach, c| reach.max(c.abs()));
    for (&node, &constraint) in formed.body.nodes.iter().zip(&formed.constraint) {
        state.constraint[node as usize] = constraint;
        let felt = setup.constraints[usize::from(constraint)].walls;
        for w in (0..setup.walls.len()).filter(|w| felt >> w & 1 == 1) {
            let x = minus(state.x[node as usize], poses[w][0]);
            let (height, _) = setup.walls[w].shape.height(x);
            if height < -INSIDE * reach {
                return Err(format!(
                    "part `{}` is to deform again from {:e} on; its node {} is then {:e} inside [[wall]] {}, which does not stop it while it is rigid: let it deform earlier",
                    mesh.parts[formed.body.account as usize].name,
                    state.time,
                    mesh.node_ids[node as usize],
                    -height,
                    w + 1
                ));
            }
        }
    }
    Ok(())
}

/// Makes one body of nodes as they are; gives it, and the kinetic energy that its nodes lose.
fn form(
    setup: &Setup,
    mesh: &Mesh,
    state: &mut GlobalState,
    (index, switch): (u32, &Switch),
) -> Result<(Formed, f64), String> {
    let nodes = living_nodes(mesh, state, &switch.parts);
    let name = || mesh.parts[switch.parts[0] as usize].name.clone();
    let Some(&first) = nodes.first() else {
        return Err(format!(
            "part `{}` is to be rigid from {:e} on; no element of it is left",
            name(),
            state.time
        ));
    };
    let first = state.x[first as usize];
    let from_first = |n: u32| minus(state.x[n as usize], first);
    let turning = |n: u32| {
        let inertia = state.shells.inertia.get(n as usize).copied().unwrap_or_default();
        (inertia, if inertia > 0.0 { state.shells.spin[n as usize] } else { [0.0; 3] })
    };
    let mut all = Moments::default();
    nodes.iter().for_each(|&n| all.add(state.mass[n as usize], from_first(n)));
    let (centre, mut inertia) = all.central();
    let places: Vec<[f64; 3]> = nodes.iter().map(|&n| minus(from_first(n), centre)).collect();
    let (mut momentum, mut angular, mut kinetic) = ([0.0; 3], [0.0; 3], 0.0);
    for (&n, &place) in nodes.iter().zip(&places) {
        let (mass, v) = (state.mass[n as usize], state.v[n as usize]);
        let (own, spin) = turning(n);
        let moment = cross(place, v);
        for a in 0..3 {
            momentum[a] += mass * v[a];
            angular[a] += mass.mul_add(moment[a], own * spin[a]);
            inertia[a] += own;
        }
        kinetic += 0.5 * mass.mul_add(dot(v, v), own * dot(spin, spin));
    }
    widen(&mut inertia);
    if !is_positive(&inertia) {
        return Err(format!(
            "part `{}` is to be rigid from {:e} on; the inertia of its nodes is {inertia:?}, it must be positive",
            name(),
            state.time
        ));
    }
    let speed = momentum.map(|p| p / all.mass);
    let spin = solve(full(&inertia), angular);
    let centre: [f64; 3] = std::array::from_fn(|a| first[a] + centre[a]);
    let start = starting(&inertia, centre, speed, spin);
    let constraint: Vec<u16> = nodes.iter().map(|&n| state.constraint[n as usize]).collect();
    let mass_of = |i: usize| state.mass[nodes[i] as usize];
    let constraints = (setup.constraints.as_slice(), constraint.as_slice());
    let (forces, pulls) = forces_on(constraints, &setup.loads, &places, &mass_of, [all.mass; 2]);
    for (&n, &place) in nodes.iter().zip(&places) {
        let turned = cross(spin, place);
        state.v[n as usize] = std::array::from_fn(|a| speed[a] + turned[a]);
        if state.shells.inertia.get(n as usize).is_some_and(|inertia| *inertia > 0.0) {
            state.shells.spin[n as usize] = spin;
        }
        state.constraint[n as usize] = 0;
    }
    let radius = places.iter().flatten().fold(0.0_f64, |r, c| r.max(c.abs()));
    let body = Body {
        parts: Vec::new(),
        account: switch.parts[0],
        mass: all.mass,
        inertia,
        velocity: switch.velocity,
        spin: switch.spin,
        circle: None,
        start,
        nodes,
        places,
        nodal_scale: 1.0,
        length: Quantum::for_reference(2.0 * radius, 50),
        courant: None,
        forces,
        pulls,
    };
    let kept = 0.5 * all.mass.mul_add(dot(speed, speed), dot(spin, start.momentum));
    Ok((Formed { switch: index, body, constraint }, kinetic - kept))
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
