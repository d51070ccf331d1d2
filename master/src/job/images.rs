//! Images of all sub-domains become a state, a snapshot or the end of the run.

use mechanics::{block::Piece, exact::Quantum, piece, vote::Vote, wall::Pose};

use super::Job;
use crate::{event::Action, ledger::Ledger, results::history::HistoryRow, snapshot::Snapshot};
/// What a snapshot holds beside the state, as it was when its cycle was complete.
pub(super) struct SnapshotRest {
    pub(super) dt_previous: f64,
    pub(super) dt: f64,
    pub(super) force_quantum: Quantum,
    pub(super) vote: Vote,
    pub(super) walls: Vec<Pose>,
    pub(super) ledger: Ledger,
    pub(super) rows: Vec<HistoryRow>,
}

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
        let n = self.n_workers;
        let collecting = self.collecting.entry(cycle).or_insert_with(|| Collecting {
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
        let Some(collected) = self.collecting.remove(&cycle) else { return Ok(()) };
        let mut state = self.state.clone();
        for piece in &collected.pieces {
            piece::put_back(piece, &mut state)?;
        }
        state.cycle = cycle;
        state.time = self.image_times.remove(&cycle).ok_or_else(|| {
            format!("worker {worker} sends an image of cycle {cycle}, which nobody asked for")
        })?;
        if let Some(vote) = collected.vote {
            if cycle > self.first_cycle {
                self.book(cycle - 1, &vote, actions);
                if !(cycle - 1).is_multiple_of(u64::from(self.model.output.history_cycles.max(1))) {
                    self.row(actions);
                }
            }
            actions.push(Action::State(Box::new(state.clone())));
            self.finish(Some(state), actions);
            return Ok(());
        }
        if self.options.snapshot_at == Some(cycle) {
            self.snapshot_state = Some(state.clone());
            self.snapshot(actions);
        }
        if self.options.states {
            actions.push(Action::State(Box::new(state)));
        }
        Ok(())
    }

    /// Stores the snapshot once both halves of it are here.
    pub(super) fn snapshot(&mut self, actions: &mut Vec<Action>) {
        if let (Some(_), Some(_)) = (&self.snapshot_state, &self.snapshot_rest)
            && let (Some(state), Some(rest)) = (self.snapshot_state.take(), self.snapshot_rest.take())
        {
            let SnapshotRest { dt_previous, dt, force_quantum, vote, walls, ledger, rows } = rest;
            let snapshot = Snapshot { state, dt_previous, dt, force_quantum, vote, walls, ledger, rows };
            actions.push(Action::Snapshot(Box::new(snapshot)));
        }
    }
}
