//! States of all sub-domains at the start of a cycle become a whole state.

use std::collections::BTreeMap;

use mechanics::{
    piece::{self, Piece},
    state::GlobalState,
    vote::Vote,
};

use super::{
    error::{Breach, Error, Sent},
    frames::merge,
};

/// A state on its way.
struct Collecting {
    pieces: Vec<Piece>,
    arrived: Vec<bool>,
    vote: Option<Vote>,
}

/// All states of a cycle.
pub(super) struct Collected {
    pub(super) state: GlobalState,
    /// The last vote, where all have stopped.
    pub(super) vote: Option<Vote>,
    /// The state is for the user.
    pub(super) due: bool,
}

/// The states of one epoch.
#[derive(Default)]
pub(super) struct WorkerStates {
    collecting: BTreeMap<u64, Collecting>,
    /// Time of each state that was ordered and is not complete, and whether it is for the user.
    ordered: BTreeMap<u64, (f64, bool)>,
}

impl WorkerStates {
    /// States are sent at the start of a cycle, which begins at this time; `due` says that they are for the user.
    pub(super) fn order(&mut self, cycle: u64, time: f64, due: bool) {
        self.ordered.insert(cycle, (time, due));
    }

    /// Adds the state of one of `n` workers; gives the whole state once all are here. What no cycle changes is taken from
    /// `before`, the state that work was dealt out from.
    ///
    /// # Errors
    /// If nobody asked for it, or it came before, or its pieces are none of the problem's.
    pub(super) fn add(
        &mut self,
        (worker, n): (usize, usize),
        cycle: u64,
        (pieces, last): (Vec<Piece>, Option<Box<Vote>>),
        before: &GlobalState,
    ) -> Result<Option<Collected>, Error> {
        let collecting = self.collecting.entry(cycle).or_insert_with(|| Collecting {
            pieces: Vec::new(),
            arrived: vec![false; n],
            vote: None,
        });
        if std::mem::replace(&mut collecting.arrived[worker], true) {
            return Err(Error::Worker(worker, Breach::Twice(Sent::WorkerState, cycle)));
        }
        collecting.pieces.extend(pieces);
        merge(&mut collecting.vote, last);
        if !collecting.arrived.iter().all(|a| *a) {
            return Ok(None);
        }
        let Some(collected) = self.collecting.remove(&cycle) else { return Ok(None) };
        let mut state = before.to_fill();
        for mut piece in collected.pieces {
            if before.is_outline() {
                piece::put_back_statics(&mut piece, &mut state).map_err(Error::Problem)?;
            }
            piece::put_back(piece, &mut state).map_err(Error::Problem)?;
        }
        let ordered = self.ordered.remove(&cycle);
        let (time, due) = ordered.ok_or(Error::Worker(worker, Breach::Unasked(Sent::WorkerState, cycle)))?;
        (state.cycle, state.time) = (cycle, time);
        Ok(Some(Collected { state, vote: collected.vote, due }))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::job, *};

    #[test]
    fn images_become_a_state_when_the_last_is_here_and_none_that_nobody_asked_for() {
        let (job, _) = job(2);
        let mut worker_states = WorkerStates::default();
        worker_states.order(8, 0.25, true);
        let add = |worker_states: &mut WorkerStates, worker, cycle| {
            worker_states.add((worker, 2), cycle, (Vec::new(), None), job.start_state())
        };
        assert!(add(&mut worker_states, 1, 8).expect("ordered").is_none());
        let twice = add(&mut worker_states, 1, 8).err();
        assert_eq!(twice, Some(Error::Worker(1, Breach::Twice(Sent::WorkerState, 8))));
        let whole = add(&mut worker_states, 0, 8).expect("ordered").expect("both are here");
        assert_eq!((whole.state.cycle, whole.state.time, whole.due), (8, 0.25, true));
        assert!(whole.vote.is_none());
        assert!(add(&mut worker_states, 0, 9).expect("the first").is_none());
        let unasked = add(&mut worker_states, 1, 9).err();
        assert_eq!(unasked, Some(Error::Worker(1, Breach::Unasked(Sent::WorkerState, 9))));
    }
}
