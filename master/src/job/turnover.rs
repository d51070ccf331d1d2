//! From one epoch to the next, and to the end: workers come, go, fail and are lost; a user stops the run; this process leaves.

use std::sync::Arc;

use mechanics::{rigid::switch, state::GlobalState, vote::Vote};
use protocol::{message::ToWorker, options::Balance};

use super::{Job, balancing::Ground, checkpoints::Checkpoint, error::Error, samples::Stopped, workers::Goes};
use crate::{
    decompose::Traits,
    event::{Action, WorkerSpec},
    incident::Loss,
};

impl Job {
    /// A worker is gone.
    pub(super) fn lost(&mut self, index: usize, why: String, actions: &mut Vec<Action>) -> Result<(), Error> {
        let was_there = self.workers.lose(index)?;
        if !was_there || !self.epoch.at_work.contains(&index) {
            return Ok(());
        }
        let worker = self.workers.spec(index).name.clone();
        if !self.workers.is_any_alive() && !self.options.waits {
            return Err(Error::LastLost { worker, why });
        }
        let (cycle, back_to) = (self.epoch.schedule.completed(), self.checkpoints.newest().cycle());
        self.tally.losses.push(Loss { worker, cycle, back_to, why });
        self.go_back(actions);
        self.next_epoch(actions)
    }

    /// A worker has come: it is taken in at the next plan boundary, or at once by a job that waits.
    pub(super) fn joined(&mut self, spec: WorkerSpec, actions: &mut Vec<Action>) -> Result<(), Error> {
        self.workers.join(spec);
        if self.epoch.at_work.is_empty() { self.next_epoch(actions) } else { Ok(()) }
    }

    /// Another job needs a worker: it goes at the next plan boundary, or at once if it was not dealt work yet.
    pub(super) fn yield_worker(&mut self, index: usize, actions: &mut Vec<Action>) {
        if self.workers.release_idle(index, &self.epoch.at_work) {
            actions.push(Action::Freed(index));
        } else {
            self.workers.leave(index, Goes::Needed);
        }
    }

    /// A worker cannot go on, or its numbers are none. Others may: it is dismissed by name, and the run goes back.
    ///
    /// # Errors
    /// If it is the problem's fault, which ends the job.
    pub(super) fn blame(
        &mut self,
        worker: usize,
        cycle: u64,
        reason: &str,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        let index = self.epoch.at_work[worker];
        self.workers.fail(index, cycle, reason)?;
        let why = format!("cycle {cycle}: {reason}");
        actions.push(Action::Dismiss(index, why.clone()));
        self.lost(index, why, actions)
    }

    /// Workers (by position) whose numbers cannot be trusted leave the job, which goes back to what is proved.
    pub(super) fn expel(
        &mut self,
        wrong: Vec<(usize, String)>,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        let (cycle, back_to) = (self.epoch.schedule.completed(), self.checkpoints.newest().cycle());
        for (position, why) in wrong {
            let index = self.epoch.at_work[position];
            self.workers.lose(index)?;
            let worker = self.workers.spec(index).name.clone();
            actions.push(Action::Dismiss(index, why.clone()));
            self.tally.losses.push(Loss { worker, cycle, back_to, why });
        }
        if !self.options.waits && !self.workers.is_any_alive() {
            let (worker, why) = self
                .tally
                .losses
                .last()
                .map(|loss| (loss.worker.clone(), loss.why.clone()))
                .unwrap_or_default();
            return Err(Error::LastDropped { worker, why });
        }
        self.go_back(actions);
        self.next_epoch(actions)
    }

    /// A worker that wrong computations have named again and again leaves the job at this cycle, where all have stopped, if others are
    /// there.
    fn dismiss_worst(&mut self, cycle: u64, actions: &mut Vec<Action>) -> Result<(), Error> {
        let Some((index, times)) = self.twice.worst() else { return Ok(()) };
        let alive = self.workers.alive();
        if alive == [index] {
            return Ok(());
        }
        self.twice.forget(index);
        if !alive.contains(&index) {
            return Ok(());
        }
        self.workers.lose(index)?;
        let why = format!(
            "{times} computations of intervals that others computed otherwise name it; test its memory, or keep it out"
        );
        actions.push(Action::Dismiss(index, why.clone()));
        let worker = self.workers.spec(index).name.clone();
        self.tally.losses.push(Loss { worker, cycle, back_to: cycle, why });
        Ok(())
    }

    /// Whether the epoch is to end at a cycle: at once for processes that are to end, at a boundary for all others.
    pub(super) fn wants_next_epoch(&mut self, cycle: u64) -> bool {
        let at_work = &self.epoch.at_work;
        cycle > self.epoch.schedule.first_cycle()
            && (self.workers.has_leavers(at_work, Goes::Ends)
                || (self.is_boundary(cycle)
                    && (self.workers.has_newcomers(at_work)
                        || self.workers.has_leavers(at_work, Goes::Needed)
                        || self.wants_other_speeds(cycle))))
    }

    /// Whether parts are to become rigid, or to deform again, before the cycle that begins at a time.
    pub(super) fn switches_at(&self, time: f64) -> bool {
        let formed = &self.checkpoints.newest().continuation.formed;
        switch::is_due(&self.model().setup.switches, formed, time)
    }

    /// Whether the epoch is to end for other speeds.
    fn wants_other_speeds(&mut self, boundary: u64) -> bool {
        if self.options.asked.balance == Balance::Given || self.epoch.n() < 2 {
            return false;
        }
        let Some(medians) = self.epoch.meter.medians() else { return false };
        let alive = self.epoch.sorts.eroded().map(crate::erosion::Eroded::alive);
        let (model, costs) = (&self.problem.model, self.options.costs());
        let ground = Ground {
            mesh: &model.mesh,
            costs,
            traits: Traits::of(&model.mesh, &model.setup, alive.as_deref()),
        };
        let interval = u64::from(model.setup.control.plan_interval);
        self.balancing.look((boundary, interval), &medians, &self.epoch.shares, &ground)
    }

    /// Everything that was booked after the checkpoint is forgotten, here and in the results.
    pub(super) fn go_back(&mut self, actions: &mut Vec<Action>) {
        let checkpoint = self.checkpoints.newest();
        self.account.go_back(checkpoint);
        self.balancing.go_back();
        actions.push(Action::Rewind { rows: checkpoint.continuation.n_rows, cycle: checkpoint.cycle() });
    }

    /// Deals the checkpoint out to all that are alive; with nobody, the job waits.
    pub(super) fn next_epoch(&mut self, actions: &mut Vec<Action>) -> Result<(), Error> {
        let number = self.epoch.number.checked_add(1).ok_or(Error::Epochs)?;
        let at_work = self.twice.exchange(self.workers.alive());
        self.twice.begin_epoch();
        let nobody = at_work.is_empty();
        self.epoch = self.deal(number, at_work, actions)?;
        self.checkpoints.begin_epoch();
        if self.lean {
            self.forget_state();
        }
        if nobody && self.ending.leaves {
            self.suspend_at_checkpoint(actions);
        } else if nobody && self.ending.stop_asked {
            self.finish_at_checkpoint(actions);
        }
        Ok(())
    }

    /// All have stopped: the epoch is over, or the run.
    pub(super) fn all_stopped(&mut self, stopped: Stopped, actions: &mut Vec<Action>) -> Result<(), Error> {
        let cycle = stopped.state.cycle;
        if cycle > self.epoch.schedule.first_cycle() {
            self.book(cycle - 1, &stopped.vote, actions);
        }
        if self.twice.is_chosen() && cycle > self.epoch.schedule.first_cycle() {
            if self.ending.leaves {
                // Whoever goes on with the run computes the interval again.
                self.go_back(actions);
                self.suspend_at_checkpoint(actions);
                return Ok(());
            }
            if !self.interval_stands(&stopped, actions)? {
                return Ok(());
            }
        }
        if !self.epoch.schedule.pauses() {
            return self.stopped(stopped, actions);
        }
        if self.account.failure.is_some() {
            self.end_with(stopped.state, actions);
            return Ok(());
        }
        if stopped.due {
            actions.push(Action::State(Box::new(stopped.state.clone())));
        }
        self.paused(stopped, actions)
    }

    /// The epoch ends for another one, which begins with this state.
    fn paused(&mut self, stopped: Stopped, actions: &mut Vec<Action>) -> Result<(), Error> {
        let Stopped { state, vote, .. } = stopped;
        let cycle = state.cycle;
        self.adopt(state, vote)?;
        self.twice.begin_interval();
        self.store(cycle, actions);
        self.dismiss_worst(cycle, actions)?;
        let (at_work, shares) = (&self.epoch.at_work, &self.epoch.shares);
        if let Some(rebalance) = self.balancing.adopt(cycle, self.workers.names(at_work), shares) {
            self.workers.set_speeds(at_work, &rebalance.speeds_after);
            self.tally.rebalances.push(rebalance);
        }
        for (index, why) in self.workers.release(at_work) {
            actions.push(Action::Send(index, ToWorker::Release));
            if why == Goes::Needed {
                actions.push(Action::Freed(index));
            }
        }
        if let Err(why) = self.switch_parts() {
            self.account.failure = Some(why);
            let state = GlobalState::clone(&self.checkpoints.newest().state);
            self.end_with(state, actions);
            return Ok(());
        }
        self.next_epoch(actions)
    }

    /// The session ends with this state.
    fn stopped(&mut self, stopped: Stopped, actions: &mut Vec<Action>) -> Result<(), Error> {
        let Stopped { state, vote, due } = stopped;
        let control = self.problem.model.setup.control;
        let at_end = state.time >= control.end_time || state.cycle >= control.end_cycle;
        let goes_on =
            (self.ending.leaves || self.ending.stop_asked) && !at_end && self.account.failure.is_none();
        if !goes_on || state.cycle == 0 {
            if self.ending.leaves && goes_on {
                self.finish(None, actions);
            } else {
                self.end_with(state, actions);
            }
            return Ok(());
        }
        self.adopt(state, vote)?;
        if due {
            // The next session begins behind it, so the checkpoint counts on its file.
            let state = GlobalState::clone(&self.checkpoints.newest().state);
            actions.push(Action::State(Box::new(state)));
        }
        if self.ending.leaves {
            self.suspend_at_checkpoint(actions);
            return Ok(());
        }
        self.give_last_checkpoint(actions);
        self.finish_at_checkpoint(actions);
        Ok(())
    }

    /// Where all have stopped is the newest checkpoint.
    fn adopt(&mut self, state: GlobalState, vote: Vote) -> Result<(), Error> {
        let continuation = self.rest_at(state.cycle, vote)?;
        self.checkpoints.adopt(Arc::new(Checkpoint { state: Arc::new(state), continuation }));
        Ok(())
    }

    /// Parts become rigid, or deform again, where the newest checkpoint is at their time: the next epoch begins with that.
    ///
    /// # Errors
    /// If one cannot.
    pub(super) fn switch_parts(&mut self) -> Result<(), String> {
        if let Some(switched) = self.checkpoints.newest().switched(&self.problem)? {
            self.account.run_totals = switched.continuation.run_totals.clone();
            self.checkpoints.adopt(Arc::new(switched));
        }
        Ok(())
    }

    /// The run ends with this state; its last cycle has a row in any case.
    fn end_with(&mut self, state: GlobalState, actions: &mut Vec<Action>) {
        let last = self.account.rows.last().map(|row| row.cycle);
        if state.cycle > self.first_cycle && last != Some(state.cycle - 1) {
            self.account.row(actions);
        }
        if !self.options.asked.no_output {
            actions.push(Action::State(Box::new(state.clone())));
        }
        self.finish(Some(state), actions);
    }

    /// Ends the run with the state of the checkpoint: the user does not want to wait any longer.
    pub(super) fn finish_at_checkpoint(&mut self, actions: &mut Vec<Action>) {
        let state = GlobalState::clone(&self.checkpoints.newest().state);
        self.end_with(state, actions);
    }

    /// Ends this session of the run; another one begins at the checkpoint.
    pub(super) fn suspend_at_checkpoint(&mut self, actions: &mut Vec<Action>) {
        self.give_last_checkpoint(actions);
        self.finish(None, actions);
    }

    fn give_last_checkpoint(&self, actions: &mut Vec<Action>) {
        if self.options.store
            && let Some(snapshot) = self.checkpoints.newest().as_snapshot(&self.problem, &self.account.rows)
        {
            actions.push(Action::Checkpoint { snapshot, last: true });
        }
    }
}
