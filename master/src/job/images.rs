//! Images of all sub-domains become a state, a snapshot or the end of the run.

use std::sync::Arc;

use mechanics::{block::Piece, piece, state::GlobalState, vote::Vote};

use super::{
    Job,
    epoch::{Base, Halves},
};
use crate::{event::Action, snapshot::Snapshot};

/// An image on its way.
pub(super) struct Collecting {
    pub(super) pieces: Vec<Piece>,
    pub(super) arrived: Vec<bool>,
    pub(super) vote: Option<Vote>,
}

impl Job {
    pub(super) fn image(
        &mut self,
        worker: usize,
        cycle: u64,
        pieces: Vec<Piece>,
        last: Option<Box<Vote>>,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let n = self.epoch.n();
        let collecting = self.epoch.collecting.entry(cycle).or_insert_with(|| Collecting {
            pieces: Vec::new(),
            arrived: vec![false; n],
            vote: None,
        });
        if std::mem::replace(&mut collecting.arrived[worker], true) {
            return Err(format!("worker {worker} sends its image of cycle {cycle} twice"));
        }
        collecting.pieces.extend(pieces);
        if let Some(vote) = last {
            match &mut collecting.vote {
                Some(merged) => merged.merge(&vote),
                None => collecting.vote = Some(*vote),
            }
        }
        if !collecting.arrived.iter().all(|a| *a) {
            return Ok(());
        }
        let Some(collected) = self.epoch.collecting.remove(&cycle) else { return Ok(()) };
        let before = &self.base.state;
        let mut state = if before.is_static() { before.to_fill() } else { GlobalState::clone(before) };
        for piece in collected.pieces {
            piece::put_back(piece, &mut state)?;
        }
        state.cycle = cycle;
        let (time, due) = self.epoch.image_times.remove(&cycle).ok_or_else(|| {
            format!("worker {worker} sends an image of cycle {cycle}, which nobody asked for")
        })?;
        state.time = time;
        match collected.vote {
            Some(vote) if self.epoch.stop_sampled => {
                self.epoch.stopped = Some((state, vote, due));
                self.prove_stop(cycle, actions)
            }
            Some(vote) => self.all_stopped(state, vote, due, actions),
            None => {
                if due {
                    actions.push(Action::State(Box::new(state.clone())));
                }
                if let Some(halves) = self.epoch.halves.get_mut(&cycle) {
                    halves.state = Some(state);
                    return self.complete_base(cycle, actions);
                }
                Ok(())
            }
        }
    }

    /// All have stopped: the epoch is over, or the run.
    pub(super) fn all_stopped(
        &mut self,
        state: GlobalState,
        vote: Vote,
        due: bool,
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        self.book_last(state.cycle, &vote, actions);
        if !self.epoch.pauses {
            return self.stopped(state, vote, due, actions);
        }
        if self.failure.is_some() {
            return self.end_with(state, actions);
        }
        if due {
            actions.push(Action::State(Box::new(state.clone())));
        }
        self.paused(state, vote, actions)
    }

    /// Books the vote of the cycle before a stop.
    fn book_last(&mut self, cycle: u64, vote: &Vote, actions: &mut Vec<Action>) {
        if cycle > self.epoch.first_cycle {
            self.book(cycle - 1, vote, actions);
        }
    }

    /// The run ends with this state; its last cycle has a row in any case.
    pub(super) fn end_with(&mut self, state: GlobalState, actions: &mut Vec<Action>) -> Result<(), String> {
        let last = self.rows.last().map(|row| row.cycle);
        if state.cycle > self.first_cycle && last != Some(state.cycle - 1) {
            self.row(actions);
        }
        if !self.options.asked.no_output {
            actions.push(Action::State(Box::new(state.clone())));
        }
        self.finish(Some(state), actions);
        Ok(())
    }

    /// The newest base, once both halves of it are here, and samples from it that agree where those are asked for; and
    /// to the disk where that is asked for.
    pub(super) fn complete_base(&mut self, cycle: u64, actions: &mut Vec<Action>) -> Result<(), String> {
        let Some(Halves { state: Some(_), rest: Some(_) }) = self.epoch.halves.get(&cycle) else {
            return Ok(());
        };
        // The last sample comes after the last frame of its cycle, so what follows such a frame is not cut short.
        if self.options.replay && !self.has_samples(cycle) {
            return Ok(());
        }
        let Some(Halves { state: Some(state), rest: Some(rest) }) = self.epoch.halves.remove(&cycle) else {
            return Ok(());
        };
        let base = Arc::new(Base { state: Arc::new(state), rest });
        if self.options.replay && !self.prove(&base, actions)? {
            return Ok(());
        }
        self.base = base;
        self.store(cycle, actions);
        Ok(())
    }

    /// Gives the base to the sink, where that is asked for.
    pub(super) fn store(&self, cycle: u64, actions: &mut Vec<Action>) {
        if self.options.asked.snapshot_at == Some(cycle)
            && let Some(snapshot) = self.base_as_snapshot()
        {
            actions.push(Action::Snapshot(snapshot));
        }
        if self.options.store
            && let Some(snapshot) = self.base_as_snapshot()
        {
            actions.push(Action::Base { snapshot, last: false });
        }
    }

    /// The base as it is stored; none at the start of a run, which the deck gives as well.
    pub(super) fn base_as_snapshot(&self) -> Option<Box<Snapshot>> {
        let Base { state, rest } = &*self.base;
        Some(Box::new(Snapshot {
            state: Arc::clone(state),
            dt_previous: rest.dt_previous,
            dt: rest.dt?,
            force_quanta: rest.quanta,
            spread_rate: rest.spread_rate,
            vote: rest.vote.clone()?,
            walls: rest.walls.clone(),
            ledger: rest.ledger.clone(),
            rows: self.rows[..rest.n_rows].to_vec(),
            states: Vec::new(),
        }))
    }
}
