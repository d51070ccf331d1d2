//! How a run ends before its end: a user stops it, this process leaves, a worker fails by itself.

use std::sync::Arc;

use mechanics::{state::GlobalState, vote::Vote};

use super::{Job, epoch::Base};
use crate::event::Action;

/// Cycles that two workers' failures may lie apart and still be the same: one computes ahead of what the other has said.
const SAME_FAULT: u64 = 2;

impl Job {
    /// All have stopped at the start of a cycle, the last one of this session; `due` says that the user is to have the
    /// state in any case.
    pub(super) fn stopped(
        &mut self,
        state: GlobalState,
        vote: Vote,
        due: bool,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let control = self.model.setup.control;
        let at_end = state.time >= control.end_time || state.cycle >= control.end_cycle;
        let goes_on = (self.leaves || self.stop_asked) && !at_end && self.failure.is_none();
        if !goes_on || state.cycle == 0 {
            if self.leaves && goes_on {
                self.finish(None, actions);
                return Ok(());
            }
            return self.end_with(state, actions);
        }
        let rest = self.rest_at(state.cycle, vote)?;
        self.base = Arc::new(Base { state: Arc::new(state), rest });
        if self.leaves {
            if due {
                // The next session begins behind it.
                actions.push(Action::State(Box::new(GlobalState::clone(&self.base.state))));
            }
            self.suspend_at_base(actions);
            return Ok(());
        }
        self.give_last_base(actions);
        let state = GlobalState::clone(&self.base.state);
        self.end_with(state, actions)
    }

    /// Ends this session of the run; another one begins at the base.
    pub(super) fn suspend_at_base(&mut self, actions: &mut Vec<Action>) {
        self.give_last_base(actions);
        self.finish(None, actions);
    }

    fn give_last_base(&self, actions: &mut Vec<Action>) {
        if self.options.store
            && let Some(snapshot) = self.base_as_snapshot()
        {
            actions.push(Action::Base { snapshot, last: true });
        }
    }

    /// A worker cannot go on, or its numbers are none. Others may: it is dismissed by name, and the run goes back. If the
    /// same happens to a second one at the same cycle, or nobody else is left, it is the problem's fault.
    ///
    /// # Errors
    /// Then the reason, which ends the job.
    pub(super) fn blame(
        &mut self,
        worker: usize,
        cycle: u64,
        reason: String,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let member = self.epoch.crew[worker];
        let others = self.members.iter().enumerate().any(|(m, other)| m != member && other.alive);
        let name = &self.members[member].hand.name;
        if let Some((first, at, _)) = self.blamed.iter().find(|(_, at, _)| at.abs_diff(cycle) <= SAME_FAULT) {
            let first = &self.members[*first].hand.name;
            return Err(format!(
                "worker {name}, cycle {cycle}: {reason}; worker {first} failed at cycle {at} as well, so it is not the worker's fault"
            ));
        }
        if !others {
            return Err(format!("worker {name}, cycle {cycle}: {reason}"));
        }
        let why = format!("cycle {cycle}: {reason}");
        self.blamed.push((member, cycle, reason));
        actions.push(Action::Dismiss(member, why.clone()));
        self.lost(member, why, actions)
    }
}

/// What of a worker's frame is no number. A run that has blown up says so by the forces of its vote.
pub(super) fn not_a_number(vote: Option<&Vote>, partials: &[f64]) -> Option<String> {
    if let Some(vote) = vote {
        if !vote.force_bound.is_finite() && !vote.force_bound.is_nan() {
            return None;
        }
        if vote.bodies.iter().any(|body| !body.is_finite()) {
            return Some("the state of a rigid body in its vote is no number".to_owned());
        }
        let energies = vote.parts.iter().flat_map(|p| [p.kinetic, p.internal, p.hourglass, p.viscosity]);
        let numbers =
            energies.chain(vote.momentum).chain([vote.contact, vote.friction, vote.external.whole()]);
        let released = vote.released.iter().flat_map(|released| released.pairs()).map(|pair| pair.contact);
        let numbers = numbers.chain(released);
        let seen = vote.contacts.iter().flat_map(|(_, contact)| contact.force);
        let mut numbers = numbers
            .chain(seen.chain(vote.element_gauges.iter().flat_map(|(_, state)| *state)))
            .chain([vote.force_bound, vote.contact_speed_squared]);
        let bad = numbers.find(|v| !v.is_finite());
        if let Some(value) = bad.or(Some(vote.courant).filter(|courant| courant.is_nan())) {
            return Some(format!(
                "an energy, momentum, force or limit of its vote is {value}, must be finite"
            ));
        }
    }
    let bad = partials.iter().find(|value| !value.is_finite());
    bad.map(|value| format!("a partial force of its frame is {value}, must be finite"))
}
