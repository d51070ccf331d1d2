//! What is collected from all workers at the start of a cycle: states and samples. They become a state for the user, a
//! checkpoint that is proved, or the end of the epoch.

use std::sync::Arc;

use mechanics::{state::GlobalState, vote::Vote};

use super::{
    Job,
    checkpoints::{Checkpoint, Continuation},
    error::{Breach, Error, Sent},
    samples::{Moment, Stopped},
    worker_states::Collected,
};
use crate::event::{Action, Proved};

impl Job {
    /// All states of a cycle are here.
    pub(super) fn collected(
        &mut self,
        worker_state: Collected,
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        let Collected { mut state, vote, due } = worker_state;
        let cycle = state.cycle;
        if let Some(vote) = vote {
            let stopped = Stopped { state, vote, due };
            if !self.epoch.schedule.stop_is_sampled() {
                return self.all_stopped(stopped, actions);
            }
            self.epoch.samples.hold(stopped);
            return self.prove_stop(cycle, actions);
        }
        let is_checkpoint = self.checkpoints.is_expected(cycle);
        if due {
            self.twice.note_state(&state);
            self.note_fragments(&state);
            let given = if is_checkpoint { state.clone() } else { std::mem::take(&mut state) };
            actions.push(Action::State(Box::new(given)));
        }
        if is_checkpoint {
            self.checkpoints.take_state(cycle, state);
            return self.complete_checkpoint(cycle, actions);
        }
        Ok(())
    }

    /// Compares the fragments of a state that is written with those before.
    pub(super) fn note_fragments(&mut self, state: &GlobalState) {
        let model = &self.problem.model;
        self.tally.fragments.see(&model.mesh, &model.setup.bodies, state);
    }

    /// A worker's sample of a cycle has come.
    pub(super) fn sampled(
        &mut self,
        worker: usize,
        cycle: u64,
        hash: [u8; 16],
        actions: &mut Vec<Action>,
    ) -> Result<(), Error> {
        let (n, schedule) = (self.epoch.n(), &self.epoch.schedule);
        let stop = schedule.stop_is_sampled() && schedule.stops_at(cycle);
        let checkpoint = self.checkpoints.is_expected(cycle);
        if !self.options.replay || !(stop || checkpoint || cycle == schedule.first_cycle()) {
            return Err(Error::Worker(worker, Breach::Unasked(Sent::Sample, cycle)));
        }
        self.epoch.samples.add((worker, n), cycle, hash)?;
        if stop {
            return self.prove_stop(cycle, actions);
        }
        if checkpoint {
            return self.complete_checkpoint(cycle, actions);
        }
        if self.epoch.samples.are_all_here(cycle) {
            let checkpoint = Arc::clone(self.checkpoints.newest());
            self.prove(&checkpoint, actions)?;
        }
        Ok(())
    }

    /// The newest checkpoint, once both parts of it are here, and samples from it that agree where those are asked for; and
    /// to the disk where that is asked for.
    pub(super) fn complete_checkpoint(&mut self, cycle: u64, actions: &mut Vec<Action>) -> Result<(), Error> {
        // The last sample comes after the last frame of its cycle, so what follows such a frame is not cut short.
        if self.options.replay && !self.epoch.samples.are_all_here(cycle) {
            return Ok(());
        }
        let now = self.epoch.schedule.completed();
        let Some(checkpoint) = self.checkpoints.take(cycle, now) else { return Ok(()) };
        let checkpoint = Arc::new(checkpoint);
        if self.options.replay && !self.prove(&checkpoint, actions)? {
            return Ok(());
        }
        self.checkpoints.adopt(checkpoint);
        self.twice.begin_interval();
        self.store(cycle, actions);
        Ok(())
    }

    /// Computes the samples of the checkpoint's cycle again. Gives whether all agree; else workers are dropped, and the run
    /// has gone back.
    fn prove(&mut self, checkpoint: &Checkpoint, actions: &mut Vec<Action>) -> Result<bool, Error> {
        let Checkpoint { state, continuation } = checkpoint;
        let moment = Moment {
            dt_previous: continuation.dt_previous,
            quanta: continuation.quanta[0],
            time: state.time,
        };
        let wrong = self.epoch.samples.differing(&self.problem, state, moment)?;
        let agree = wrong.is_empty();
        if agree {
            self.tell_proved(actions)
        } else {
            self.expel(wrong, actions)?
        }
        Ok(agree)
    }

    /// Goes on with a stop once its samples and states are here and agree.
    fn prove_stop(&mut self, cycle: u64, actions: &mut Vec<Action>) -> Result<(), Error> {
        let Some(stopped) = self.epoch.samples.take_stopped(cycle) else { return Ok(()) };
        let schedule = &self.epoch.schedule;
        let now = schedule.ordered(cycle)?;
        let (dt_previous, time) = match cycle.checked_sub(1).and_then(|cycle| schedule.step(cycle)) {
            Some(before) => (before.dt, before.time + before.dt),
            None => (self.checkpoints.newest().continuation.dt_previous, now.time),
        };
        let moment = Moment { dt_previous, quanta: now.quanta, time };
        let wrong = self.epoch.samples.differing(&self.problem, &stopped.state, moment)?;
        if !wrong.is_empty() {
            return self.expel(wrong, actions);
        }
        self.tell_proved(actions);
        self.all_stopped(stopped, actions)
    }

    /// Gives one of the samples that agreed to whoever wants to compute it as well.
    fn tell_proved(&mut self, actions: &mut Vec<Action>) {
        let Some((position, hash, sample)) = self.epoch.samples.take_proved() else { return };
        let worker = self.workers.spec(self.epoch.at_work[position]).name.clone();
        let part = self.problem.model.mesh.parts[sample.piece.part as usize].name.clone();
        actions.push(Action::Proved(Arc::new(Proved { worker, part, hash, sample })));
    }

    /// What a checkpoint at the start of a cycle holds beside the state, once the cycle before is booked with this vote.
    pub(super) fn rest_at(&self, cycle: u64, vote: Vote) -> Result<Continuation, Error> {
        let schedule = &self.epoch.schedule;
        let step = schedule.ordered(cycle)?;
        let before = cycle.checked_sub(1).and_then(|cycle| schedule.step(cycle));
        Ok(Continuation {
            dt_previous: before.map_or(0.0, |step| step.dt),
            dt: Some(step.dt),
            quanta: [step.quanta, schedule.quanta()],
            vote: Some(vote),
            walls: self.account.walls.clone(),
            formed: self.checkpoints.newest().continuation.formed.clone(),
            run_totals: self.account.run_totals.clone(),
            n_rows: self.account.rows.len(),
            spread_rate: self.epoch.sorts.spread_rate(),
        })
    }

    /// Gives the newest checkpoint to the sink, where that is asked for.
    pub(super) fn store(&self, cycle: u64, actions: &mut Vec<Action>) {
        let snapshot = || self.checkpoints.newest().as_snapshot(&self.problem, &self.account.rows);
        if self.options.asked.snapshot_at == Some(cycle) {
            actions.extend(snapshot().map(Action::Snapshot));
        }
        if self.options.store {
            actions.extend(snapshot().map(|snapshot| Action::Checkpoint { snapshot, last: false }));
        }
    }
}
