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

/// States on their way at which the cycles wait: one that travels, and one that follows without a gap.
const ON_THEIR_WAY: usize = 2;

/// A state on its way.
struct Collecting {
    /// With the pieces that have come.
    state: GlobalState,
    /// Elements that have come, by worker.
    elements: Vec<u64>,
    /// The workers whose pieces have all come.
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

    /// Whether so many states of `cycle` and before are on their way that the cycles wait for one of them: where wires are slower than
    /// states are asked for, those would else pile up in the memory of workers.
    pub(super) fn are_behind(&self, cycle: u64) -> bool {
        self.ordered.range(..=cycle).count() >= ON_THEIR_WAY
    }

    /// Adds pieces of one of `n` workers. What no cycle changes is taken from `before`, the state that work was dealt out from.
    ///
    /// # Errors
    /// If nobody asked for them, or all of this worker's have come before, or they are none of the problem's.
    pub(super) fn add(
        &mut self,
        (worker, n): (usize, usize),
        cycle: u64,
        pieces: Vec<Piece>,
        before: &GlobalState,
    ) -> Result<(), Error> {
        let collecting = self.collecting((worker, n), cycle, before)?;
        for mut piece in pieces {
            collecting.elements[worker] += piece.elements.len() as u64;
            if before.is_outline() {
                piece::put_back_statics(&mut piece, &mut collecting.state).map_err(Error::Problem)?;
            }
            piece::put_back(piece, &mut collecting.state).map_err(Error::Problem)?;
        }
        Ok(())
    }

    /// All pieces of one of `n` workers, which holds so many elements if that is known, have come; gives the whole state once those of all have.
    ///
    /// # Errors
    /// If nobody asked for them, or this was said before, or they are more or fewer than the worker holds.
    pub(super) fn end(
        &mut self,
        (worker, n, held): (usize, usize, Option<u64>),
        cycle: u64,
        last: Option<Box<Vote>>,
        before: &GlobalState,
    ) -> Result<Option<Collected>, Error> {
        let collecting = self.collecting((worker, n), cycle, before)?;
        let elements = collecting.elements[worker];
        if let Some(held) = held.filter(|held| *held != elements) {
            return Err(Error::Worker(worker, Breach::Elements { cycle, elements, held }));
        }
        collecting.arrived[worker] = true;
        merge(&mut collecting.vote, last);
        if !collecting.arrived.iter().all(|a| *a) {
            return Ok(None);
        }
        let (Some(collected), Some((time, due))) =
            (self.collecting.remove(&cycle), self.ordered.remove(&cycle))
        else {
            return Ok(None);
        };
        let Collecting { mut state, vote, .. } = collected;
        (state.cycle, state.time) = (cycle, time);
        Ok(Some(Collected { state, vote, due }))
    }

    /// The state of a cycle to which a worker may still add.
    fn collecting(
        &mut self,
        (worker, n): (usize, usize),
        cycle: u64,
        before: &GlobalState,
    ) -> Result<&mut Collecting, Error> {
        if !self.ordered.contains_key(&cycle) {
            return Err(Error::Worker(worker, Breach::Unasked(Sent::WorkerState, cycle)));
        }
        let collecting = self.collecting.entry(cycle).or_insert_with(|| Collecting {
            state: before.to_fill(),
            elements: vec![0; n],
            arrived: vec![false; n],
            vote: None,
        });
        if collecting.arrived[worker] {
            return Err(Error::Worker(worker, Breach::Twice(Sent::WorkerState, cycle)));
        }
        Ok(collecting)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::job, *};

    #[test]
    fn pieces_become_a_state_when_the_last_is_here_and_none_that_nobody_asked_for() {
        let (job, _) = job(2);
        let mut worker_states = WorkerStates::default();
        worker_states.order(8, 0.25, true);
        let end = |worker_states: &mut WorkerStates, worker, cycle| {
            worker_states.end((worker, 2, Some(0)), cycle, None, job.start_state())
        };
        assert!(end(&mut worker_states, 1, 8).expect("ordered").is_none());
        let twice = Some(Error::Worker(1, Breach::Twice(Sent::WorkerState, 8)));
        assert_eq!(end(&mut worker_states, 1, 8).err(), twice);
        assert_eq!(worker_states.add((1, 2), 8, Vec::new(), job.start_state()).err(), twice);
        let whole = end(&mut worker_states, 0, 8).expect("ordered").expect("both are here");
        assert_eq!((whole.state.cycle, whole.state.time, whole.due), (8, 0.25, true));
        assert!(whole.vote.is_none());
        let unasked = Some(Error::Worker(1, Breach::Unasked(Sent::WorkerState, 9)));
        assert_eq!(end(&mut worker_states, 1, 9).err(), unasked);
        assert_eq!(worker_states.add((1, 2), 9, Vec::new(), job.start_state()).err(), unasked);
    }

    #[test]
    fn cycles_wait_once_two_states_are_on_their_way_that_need_no_more_orders() {
        let (job, _) = job(1);
        let mut worker_states = WorkerStates::default();
        for cycle in [8, 9, 11] {
            worker_states.order(cycle, 0.25, true);
        }
        assert!(!worker_states.are_behind(8), "the one of cycle 9 cannot come before cycle 8 is complete");
        assert!(worker_states.are_behind(9) && worker_states.are_behind(10));
        worker_states.end((0, 1, Some(0)), 8, None, job.start_state()).expect("ordered").expect("whole");
        assert!(!worker_states.are_behind(10) && worker_states.are_behind(11));
    }

    #[test]
    fn pieces_make_a_state_one_after_another_and_one_that_lacks_some_is_none() {
        let (job, _) = job(2);
        let (mesh, before) = (&job.problem.model.mesh, job.start_state());
        let mut worker_states = WorkerStates::default();
        worker_states.order(8, 0.25, false);
        let part = |part| {
            let region = piece::Region::Cells { low: [0; 3], high: [2; 3] };
            let mut piece = piece::cut(mesh, before, part, &region);
            piece.v.iter_mut().for_each(|v| *v = [part as f64; 3]);
            piece
        };
        let end = |worker_states: &mut WorkerStates, worker: usize| {
            worker_states.end((worker, 2, Some([16, 0][worker])), 8, None, before)
        };
        assert!(end(&mut worker_states, 1).expect("it holds nothing").is_none());
        worker_states.add((0, 2), 8, vec![part(0)], before).expect("the first");
        let lacks = Breach::Elements { cycle: 8, elements: 8, held: 16 };
        assert_eq!(end(&mut worker_states, 0).err(), Some(Error::Worker(0, lacks)));
        worker_states.add((0, 2), 8, vec![part(1)], before).expect("the second");
        let whole = end(&mut worker_states, 0).expect("all are here").expect("and of both workers");
        let of_part = |part: usize| mesh.parts[part].nodes.iter().map(|&node| whole.state.v[node as usize]);
        assert!((0..2).all(|part| of_part(part).all(|v| v == [part as f64; 3])));
    }
}
