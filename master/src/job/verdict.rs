//! The verdict on a cycle: its vote is booked, and a run whose physics went wrong is stopped with its reason.

use std::sync::Arc;

use mechanics::{
    contact::{edges::EDGE, reach},
    vote::Vote,
};

use super::{Job, epoch::Step};
use crate::event::{Action, Limit};

/// Deepest contact (gaps) before the run is stopped. Where elements erode, a face that they leave bare may have a node at any
/// depth, and one that comes through is pushed on from the other side: there it is only reported.
const DEEPEST: f64 = 0.9;
/// Cycles before energies are judged, from the first in which anything stirs. The heat of viscosity and of hourglass control is booked by
/// the velocities of half a step before: too much where a body is struck, and in the first cycles that is much of what there is.
const SETTLED: u64 = 20;
/// Share of the first time step below which a run is stopped where the deck gives no floor.
const FLOOR: f64 = 1e-4;

impl Job {
    /// Books the whole vote of a cycle, and stops the run where the physics went wrong.
    pub(super) fn book(&mut self, cycle: u64, vote: &Vote, actions: &mut Vec<Action>) {
        let Some(&Step { dt, time, .. }) = self.epoch.steps.get(&cycle) else { return };
        let gap = self.model.setup.contact.as_ref().map(|c| c.gap);
        self.ledger.book(vote, cycle, time, dt, gap);
        self.ledger.book_eroded(vote, &self.model);
        let written = cycle.is_multiple_of(u64::from(self.model.output.history_cycles.max(1)));
        if written {
            self.row(actions);
        }
        if self.failure.is_some() {
            return;
        }
        self.failure = if let Some((element, volume)) = vote.fault {
            Some(self.element_fault(element, volume, cycle))
        } else if vote.worst_depth >= DEEPEST && !self.model.setup.erosion.is_on() {
            Some(self.contact_fault(vote, cycle))
        } else if self.ledger.worst_courant > 1.0 {
            Some(format!(
                "cycle {cycle}: time step {dt:e} above the Courant limit {:e} of element {}; lower control.safety_factor",
                vote.courant,
                self.element_name(vote.courant_element)
            ))
        } else if self.ledger.worst_gap_travel > 0.2 {
            Some(format!(
                "cycle {cycle}: a contact node travelled {:.3} gaps in one cycle, at most 0.2; lower control.safety_factor or control.growth",
                self.ledger.worst_gap_travel
            ))
        } else {
            self.stale(vote, cycle).or_else(|| self.run_away(cycle))
        };
        if self.failure.is_some() && !written {
            self.row(actions);
        }
    }

    /// What a contact that is too deep says.
    fn contact_fault(&self, vote: &Vote, cycle: u64) -> String {
        let (node, other) = vote.worst_pair;
        let id = |node: u32| self.model.mesh.node_ids.get(node as usize).copied().unwrap_or(node);
        let (what, whose) = if other & EDGE == 0 {
            ("node", format!("surface face {other}"))
        } else {
            ("an edge at node", format!("an edge at node {}", id(other & !EDGE)))
        };
        format!(
            "{what} {} is {:.2} gaps into the contact zone of {whose} at cycle {cycle}, at most {DEEPEST}; raise contact.stiffness or the gap",
            id(node),
            vote.worst_depth
        )
    }

    /// Whether more energy appeared or vanished than the deck allows.
    fn run_away(&self, cycle: u64) -> Option<String> {
        let (error, limit) = (self.ledger.last.error, self.model.setup.control.energy_error);
        // Energies are sums of whole quanta, one rounding for each element and cycle: what lies below cannot be judged.
        let rounding =
            0.5 * self.quanta.energy.value() * self.model.mesh.n_elements() as f64 * (cycle + 1) as f64;
        let settled = self.ledger.first_stirred.is_some_and(|first| cycle >= first + SETTLED);
        if !settled || error.abs() <= limit || self.ledger.unexplained().abs() <= rounding {
            return None;
        }
        let last = &self.ledger.last;
        let part = self.ledger.greediest_part().map(|(p, gain)| {
            let name = self.model.mesh.parts.get(p).map_or("", |part| part.name.as_str());
            format!("; part `{name}` gained most, {gain:e}")
        });
        Some(format!(
            "energy error {:e} at cycle {cycle}, at most {:e}: total {:e}, external work {:e}, at first {:e}{}; lower control.safety_factor, refine the mesh, or raise control.energy_error",
            error,
            limit,
            last.total,
            last.external,
            self.ledger.initial_total.unwrap_or_default(),
            part.unwrap_or_default()
        ))
    }

    /// Stops the run if the next time step is under its floor. `limit` is what holds it down.
    pub(super) fn check_floor(&mut self, cycle: u64, dt: f64, limit: Limit, element: Option<u32>) {
        let given = self.model.setup.control.time_step_floor;
        let floor = if given > 0.0 { given } else { FLOOR * self.ledger.first_step.unwrap_or_default() };
        if self.failure.is_some() || limit == Limit::End || dt >= floor {
            return;
        }
        let why = match (limit, element) {
            (Limit::Courant, Some(element)) => {
                format!("the Courant limit of element {}", self.element_name(element))
            }
            (Limit::Courant, None) => "the Courant limit".to_owned(),
            (Limit::Volume, _) => "the rate of volume of an element".to_owned(),
            (Limit::Contact, _) => "the stiffness of contacts or transmitting faces".to_owned(),
            (Limit::Travel, _) => "the travel of contact nodes, a share of the gap".to_owned(),
            (Limit::Growth, _) => "the growth from the step before".to_owned(),
            (Limit::End, _) => return,
        };
        self.failure = Some(format!(
            "time step {dt:e} at cycle {cycle}, at least {floor:e}; {why} holds it down; coarsen or repair the mesh there, add an erosion strain, or lower control.time_step_floor"
        ));
    }

    pub(super) fn stale(&self, vote: &Vote, cycle: u64) -> Option<String> {
        let settings = self.model.setup.contact.as_ref()?;
        let (spread, [a, b]) = reach::worst_spread(&vote.extents, settings);
        (spread > settings.slack).then(|| {
            let name = |p: u32| self.model.mesh.parts[p as usize].name.as_str();
            format!(
                "cycle {cycle}: parts `{}` and `{}` moved {spread:e} against each other since the last sort, the slack is {:e}; raise contact.slack",
                name(a),
                name(b),
                settings.slack
            )
        })
    }

    pub(super) fn row(&mut self, actions: &mut Vec<Action>) {
        self.rows.push(Arc::new(self.ledger.last.clone()));
        actions.push(Action::Row(Box::new(self.ledger.last.clone())));
    }

    pub(super) fn element_name(&self, element: u32) -> String {
        let mut left = element as usize;
        for part in &self.model.mesh.parts {
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

    pub(super) fn element_fault(&self, element: u32, volume: f64, cycle: u64) -> String {
        let was = self.base.state.initial_volume.get(element as usize).copied().unwrap_or(f64::NAN);
        format!(
            "element {}: volume {volume:e} at cycle {cycle}, at first {was:e}; refine the mesh, soften the load or add an erosion strain",
            self.element_name(element)
        )
    }
}
