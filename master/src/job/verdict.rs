//! The account of a run: each cycle's vote is booked, and a run whose physics went wrong fails with its reason.

use std::sync::Arc;

use mechanics::{
    contact::{edges::EDGE, reach},
    exact::Quantum,
    rigid,
    vote::Vote,
    wall::{self, Pose},
};

use super::{checkpoints::Checkpoint, error::Error, problem::Problem, schedule::Step};
use crate::{
    event::{Action, Limit},
    results::history::HistoryRow,
    run_totals::RunTotals,
};

/// Deepest contact (gaps) before the run is stopped. Of a node that came out inside a zone the depth counts from where it was.
const DEEPEST: f64 = 0.9;
/// A run is stopped where a step was so many times the Courant limit at its end. The step was below that at its beginning, and the next one is:
/// where foam comes to a corner of its curve it is tens of times as stiff within one, and a single motion beyond the limit grows nothing.
const STIFFENED: f64 = 10.0;
/// Cycles before energies are judged, from the first in which anything stirs. The energy of viscous hourglass control is booked by the
/// velocities of half a step before: too much where a body is struck, and in the first cycles that is much of what there is.
const SETTLED: u64 = 20;
/// Share of the first time step below which a run is stopped where the deck gives no floor.
const FLOOR: f64 = 1e-4;

/// What has been booked so far, and the verdict on it.
pub(super) struct Account {
    pub(super) run_totals: RunTotals,
    /// Poses of the walls of finite mass in the newest cycle that was ordered.
    pub(super) walls: Vec<Pose>,
    pub(super) rows: Vec<Arc<HistoryRow>>,
    /// What went wrong first, in the physics.
    pub(super) failure: Option<String>,
}

impl Account {
    /// Up to a checkpoint, with the rows up to there.
    pub(super) fn new(checkpoint: &Checkpoint, rows: Vec<Arc<HistoryRow>>) -> Self {
        let continuation = &checkpoint.continuation;
        Self {
            run_totals: continuation.run_totals.clone(),
            walls: continuation.walls.clone(),
            rows,
            failure: None,
        }
    }

    /// Everything that was booked after a checkpoint is forgotten.
    pub(super) fn go_back(&mut self, checkpoint: &Checkpoint) {
        let continuation = &checkpoint.continuation;
        self.run_totals = continuation.run_totals.clone();
        self.walls.clone_from(&continuation.walls);
        self.rows.truncate(continuation.n_rows);
        self.failure = None;
    }

    /// Moves the walls of finite mass on by a step, from what its vote says of them.
    ///
    /// # Errors
    /// If the vote says something impossible of a wall.
    pub(super) fn move_walls(&mut self, problem: &Problem, vote: &Vote, dt: f64) -> Result<(), Error> {
        let walls = &problem.model.setup.walls;
        wall::advance(walls, &vote.walls, dt, &mut self.walls).map_err(Error::Problem)
    }

    /// Books the whole vote of a cycle, and stops the run where the physics went wrong.
    pub(super) fn book(
        &mut self,
        problem: &Problem,
        (cycle, step): (u64, Step),
        vote: &Vote,
        actions: &mut Vec<Action>,
    ) {
        let Step { dt, time, quanta } = step;
        let gap = problem.model.setup.contact.as_ref().map(|c| c.gap);
        self.run_totals.book(vote, cycle, time, dt, gap);
        self.run_totals.book_eroded(vote, &problem.model);
        let written = cycle.is_multiple_of(u64::from(problem.model.output.history_cycles.max(1)));
        if written {
            self.row(actions);
        }
        if self.failure.is_some() {
            return;
        }
        self.failure = if let Some((element, volume)) = vote.fault {
            Some(element_fault(problem, (element, volume), cycle))
        } else if vote.worst_depth >= DEEPEST {
            Some(contact_fault(problem, vote, cycle))
        } else if dt > STIFFENED * vote.courant {
            Some(format!(
                "cycle {cycle}: time step {dt:e} above the Courant limit {:e} of element {}; lower control.safety_factor",
                vote.courant,
                element_name(problem, vote.courant_element)
            ))
        } else if self.run_totals.worst_gap_travel > 0.2 {
            Some(format!(
                "cycle {cycle}: a contact node travelled {:.3} gaps in one cycle, at most 0.2; lower control.safety_factor or control.growth",
                self.run_totals.worst_gap_travel
            ))
        } else {
            stale(problem, vote, cycle)
                .or_else(|| self.run_away(problem, (cycle, quanta.energy)))
                .or_else(|| self.body_runs_away(problem, (cycle, quanta.energy)))
                .or_else(|| came_apart(problem, vote, cycle))
        };
        if self.failure.is_some() && !written {
            self.row(actions);
        }
    }

    /// Whether more energy appeared or vanished than the deck allows.
    fn run_away(&self, problem: &Problem, (cycle, quantum): (u64, Quantum)) -> Option<String> {
        let (error, limit) = (self.run_totals.last.error, problem.model.setup.control.energy_error);
        // Energies are sums of whole quanta, one rounding for each element and cycle: what lies below cannot be judged.
        let rounding = 0.5 * quantum.value() * problem.model.mesh.n_elements() as f64 * (cycle + 1) as f64;
        let settled = self.run_totals.first_stirred.is_some_and(|first| cycle >= first + SETTLED);
        if !settled || error.abs() <= limit || self.run_totals.unexplained().abs() <= rounding {
            return None;
        }
        let last = &self.run_totals.last;
        let part = self.run_totals.greediest_part().map(|(p, gain)| {
            let name = problem.model.mesh.parts.get(p).map_or("", |part| part.name.as_str());
            format!("; part `{name}` gained most, {gain:e}")
        });
        Some(format!(
            "energy error {:e} at cycle {cycle}, at most {:e}: total {:e}, external work {:e}, at first {:e}{}; lower control.safety_factor, refine the mesh, or raise control.energy_error",
            error,
            limit,
            last.total,
            last.external,
            self.run_totals.initial_total.unwrap_or_default(),
            part.unwrap_or_default()
        ))
    }

    /// Whether a body, of parts that nothing else has touched, gained more energy than the deck allows: in the totals of a large run it
    /// would not show.
    fn body_runs_away(&self, problem: &Problem, (cycle, quantum): (u64, Quantum)) -> Option<String> {
        let limit = problem.model.setup.control.energy_error;
        let parts = &problem.model.mesh.parts;
        let rounding = 0.5 * quantum.value() * (cycle + 1) as f64;
        let bodies = self.run_totals.bodies();
        if bodies.len() < 2 {
            return None;
        }
        let ran_away = bodies.into_iter().find(|body| {
            let n_elements: usize = body.parts.iter().map(|&p| parts[p].n_elements()).sum();
            let settled = body.first_stirred.is_some_and(|first| cycle >= first + SETTLED);
            settled && body.error > limit && body.gain > rounding * n_elements as f64
        })?;
        let names: Vec<&str> = ran_away.parts.iter().map(|&p| parts[p].name.as_str()).collect();
        Some(format!(
            "part `{}` gained {:e} by itself up to cycle {cycle}: energy error {:e}, at most {limit:e}; lower control.safety_factor, refine the mesh, or raise control.energy_error",
            names.join("`, `"),
            ran_away.gain,
            ran_away.error
        ))
    }

    /// Stops the run if the next time step is under its floor. `limit` is what holds it down.
    pub(super) fn check_floor(
        &mut self,
        problem: &Problem,
        (cycle, dt): (u64, f64),
        limit: Limit,
        element: Option<u32>,
    ) {
        let given = problem.model.setup.control.time_step_floor;
        let floor = if given > 0.0 { given } else { FLOOR * self.run_totals.first_step.unwrap_or_default() };
        if self.failure.is_some() || limit == Limit::End || dt >= floor {
            return;
        }
        let why = match (limit, element) {
            (Limit::Courant, Some(element)) => {
                format!("the Courant limit of element {}", element_name(problem, element))
            }
            (Limit::Courant, None) => "the Courant limit".to_owned(),
            (Limit::Volume, _) => "the rate of volume of an element".to_owned(),
            (Limit::Contact, _) => "the stiffness of contacts or transmitting faces".to_owned(),
            (Limit::Strike, _) => "the speed at which solids will strike a rigid wall".to_owned(),
            (Limit::Turn, _) => format!("the angular velocity of {}", self.fastest_body(problem)),
            (Limit::Travel, _) => "the travel of contact nodes, a share of the gap".to_owned(),
            (Limit::Growth, _) => "the growth from the step before".to_owned(),
            (Limit::End, _) => return,
        };
        let advice = match limit {
            Limit::Turn => "give it more nodes, or mass at them, or less spin",
            _ => "coarsen or repair the mesh there, add an erosion strain",
        };
        self.failure = Some(format!(
            "time step {dt:e} at cycle {cycle}, at least {floor:e}; {why} holds it down; {advice}, or lower control.time_step_floor"
        ));
    }

    /// The rigid body that turns fastest, by a part and a node of it: it may have no name.
    fn fastest_body(&self, problem: &Problem) -> String {
        let model = &problem.model;
        let speed = |state: &rigid::State| state.spin.iter().map(|w| w * w).sum::<f64>();
        let states = self.run_totals.bodies.iter().zip(&model.setup.bodies);
        let fastest = states.max_by(|(a, _), (b, _)| speed(a).total_cmp(&speed(b)));
        let of = fastest.and_then(|(_, body)| {
            let node = model.mesh.node_ids.get(*body.nodes.first()? as usize)?;
            let part = model.mesh.parts.get(body.account as usize)?;
            Some(format!("the rigid body with node {node}, of part `{}`", part.name))
        });
        of.unwrap_or_else(|| "a rigid body".to_owned())
    }

    pub(super) fn row(&mut self, actions: &mut Vec<Action>) {
        self.rows.push(Arc::new(self.run_totals.last.clone()));
        actions.push(Action::Row(Box::new(self.run_totals.last.clone())));
    }
}

/// The most by which the ends of a joint may be apart, over the reach of its bodies or in radians.
const APART: f64 = 1e-3;

/// Whether a joint did not hold.
fn came_apart(problem: &Problem, vote: &Vote, cycle: u64) -> Option<String> {
    let (joint, vote) = vote.joints.iter().enumerate().find(|(_, vote)| vote.apart > APART)?;
    let name = problem.model.output.joints.get(joint).map_or("", String::as_str);
    Some(format!(
        "joint `{name}` is apart by {:e} of the reach of its bodies at cycle {cycle}, at most {APART:e}; what is prescribed of its bodies contradicts it, or they turn too far in a time step: correct their motion, or lower control.safety_factor",
        vote.apart
    ))
}

/// What a contact that is too deep says.
fn contact_fault(problem: &Problem, vote: &Vote, cycle: u64) -> String {
    let (node, other) = vote.worst_pair;
    let id = |node: u32| problem.model.mesh.node_ids.get(node as usize).copied().unwrap_or(node);
    let (what, whose) = if other & EDGE == 0 {
        ("node", format!("surface face {other}"))
    } else {
        ("an edge at node", format!("an edge at node {}", id(other & !EDGE)))
    };
    let edges_meet = problem.model.setup.contact.as_ref().is_some_and(|contact| contact.edges);
    let or_edges = if edges_meet { "" } else { ", or set contact.edges = true if edges cross there" };
    // Deeper than its face lies, a node has not been pressed there: the face came over it with elements that collapsed or turned over.
    let behind = if other & EDGE == 0 && vote.worst_depth > 1.0 {
        behind_a_face(problem, other)
    } else {
        String::new()
    };
    format!(
        "{what} {} is {:.2} gaps into the contact zone of {whose} at cycle {cycle}, at most {DEEPEST}; {behind}raise contact.stiffness or the gap{or_edges}",
        id(node),
        vote.worst_depth
    )
}

/// What helps where a node is behind a face: above all what keeps the elements of the face's part in shape, or takes them out.
fn behind_a_face(problem: &Problem, face: u32) -> String {
    let erodes = problem.model.setup.erosion.is_on();
    // Faces are numbered anew whenever elements erode.
    let surface = problem.touching.as_ref().map(|touching| &touching.surface).filter(|_| !erodes);
    let face = surface.and_then(|surface| surface.faces.get(face as usize));
    let part = match face.and_then(|face| problem.model.mesh.parts.get(face.part as usize)) {
        Some(part) => format!("part `{}`", part.name),
        None => "the part of that face".into(),
    };
    format!(
        "it is behind the face, so elements of {part} have probably collapsed or turned over: let them erode (`erosion = {{ geometric_strain = 1.5 }}`) or give the part `hourglass = 0.1`; if not, "
    )
}

/// Whether bodies moved further against each other than the slack allows.
fn stale(problem: &Problem, vote: &Vote, cycle: u64) -> Option<String> {
    let settings = problem.model.setup.contact.as_ref()?;
    let (spread, [a, b]) = reach::worst_spread(&vote.extents, settings);
    (spread > settings.slack).then(|| {
        let name = |p: u32| problem.model.mesh.parts[p as usize].name.as_str();
        format!(
            "cycle {cycle}: parts `{}` and `{}` moved {spread:e} against each other since the last sort, the slack is {:e}; raise contact.slack",
            name(a),
            name(b),
            settings.slack
        )
    })
}

/// An element as users name it.
fn element_name(problem: &Problem, element: u32) -> String {
    let mut left = element as usize;
    for part in &problem.model.mesh.parts {
        let n = part.n_elements();
        if left < n {
            return format!(
                "{} of part `{}`",
                part.element_ids.get(left).copied().unwrap_or(left as u32),
                part.name
            );
        }
        left -= n;
    }
    element.to_string()
}

/// The volume that an element begins with.
fn first_volume(problem: &Problem, element: u32) -> f64 {
    let mesh = &problem.model.mesh;
    let mut left = element as usize;
    for part in &mesh.parts {
        if left < part.n_elements() {
            return part.volume_of(left, &mesh.positions);
        }
        left -= part.n_elements();
    }
    f64::NAN
}

/// What an element without volume says.
pub(super) fn element_fault(problem: &Problem, (element, volume): (u32, f64), cycle: u64) -> String {
    let was = first_volume(problem, element);
    format!(
        "element {}: volume {volume:e} at cycle {cycle}, at first {was:e}; refine the mesh, soften the load or add an erosion strain",
        element_name(problem, element)
    )
}

#[cfg(test)]
mod tests {
    use super::{super::tests::job, *};
    use crate::run_totals::PairSums;

    #[test]
    fn a_small_body_that_gains_energy_ends_the_run_by_name() {
        let (job, _) = job(2);
        let problem = &job.problem;
        let run_totals = RunTotals::new(&problem.model, &job.start_state().mass);
        let mut account = Account { run_totals, walls: Vec::new(), rows: Vec::new(), failure: None };
        let mut book = |cycle: u64, small: f64| {
            let mut vote = Vote::empty(2);
            (vote.parts[0].kinetic, vote.parts[1].kinetic) = (1e15, small);
            account.run_totals.book(&vote, cycle, cycle as f64, 1.0, None);
        };
        (0..30).for_each(|cycle| book(cycle, 1e6));
        book(30, 1e7);
        assert_eq!(account.run_away(problem, (30, problem.quanta.energy)), None, "the sum hides it");
        let bodies = account.run_totals.bodies();
        assert_eq!(
            bodies.iter().map(|body| (&body.parts[..], body.gain)).collect::<Vec<_>>(),
            [(&[0][..], 0.0), (&[1][..], 9e6)]
        );
        let told =
            account.body_runs_away(problem, (30, problem.quanta.energy)).expect("nine tenths of its energy");
        let name = &problem.model.mesh.parts[1].name;
        assert!(
            told.starts_with(&format!(
                "part `{name}` gained 9e6 by itself up to cycle 30: energy error 9e-1"
            )),
            "{told}"
        );
        // Once they have touched, what one gains may be the other's.
        let touched = PairSums { parts: [0, 1], ..PairSums::default() };
        account.run_totals.contacts.push(touched);
        assert_eq!(account.run_totals.bodies().len(), 1);
        assert_eq!(account.body_runs_away(problem, (30, problem.quanta.energy)), None);
    }

    #[test]
    fn a_node_behind_a_face_asks_for_what_keeps_elements_of_its_part_from_collapse() {
        let (job, _) = job(1);
        let surface = &job.problem.touching.as_ref().expect("the cubes may meet").surface;
        let face = surface.faces.iter().position(|face| face.part == 1).expect("a face of the second cube");
        let told = |worst_depth| {
            let vote = Vote { worst_depth, worst_pair: (3, face as u32), ..Vote::empty(2) };
            contact_fault(&job.problem, &vote, 7)
        };
        let name = &job.problem.model.mesh.parts[1].name;
        let advice = format!(
            "at most 0.9; it is behind the face, so elements of part `{name}` have probably collapsed or turned over: let them erode"
        );
        assert!(told(1.99).contains(&advice) && told(1.99).contains("`hourglass = 0.1`"), "{}", told(1.99));
        assert!(told(0.95).contains("at most 0.9; raise contact.stiffness"), "{}", told(0.95));
    }
}
