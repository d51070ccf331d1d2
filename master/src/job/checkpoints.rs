//! Checkpoints: the whole state at the start of a cycle, which a run can go back to or be gone on with from disk.
//!
//! A checkpoint is all that the cycles after it depend on, so no bit of the run depends on how often, when and on whom it is
//! begun anew. It is collected in two parts that come in any order: the state from the states of all workers, the rest from
//! the frames of its cycle.

use std::{collections::BTreeMap, sync::Arc};

use mechanics::{
    exact::Quanta,
    rigid::{
        State,
        switch::{self, Formed, Surroundings},
    },
    state::GlobalState,
    vote::Vote,
    wall::Pose,
};

use super::{error::Error, problem::Problem};
use crate::{
    options::CheckpointEvery, results::history::HistoryRow, run_totals::RunTotals, snapshot::Snapshot,
};

/// A checkpoint that the timer asks for waits for so many times the cycles that the last one was on its way: on slow wires, or of large
/// problems, one is on its way in at most one cycle of 21.
const PAUSE: u64 = 20;
/// Those that cycles ask for are asked for whatever they take, but not while so many are on their way, each of which takes memory.
const AT_ONCE: usize = 4;

/// Where an epoch can begin.
#[derive(Clone)]
pub(super) struct Checkpoint {
    pub(super) state: Arc<GlobalState>,
    pub(super) continuation: Continuation,
}

/// What a checkpoint holds beside the state.
#[derive(Clone)]
pub(super) struct Continuation {
    /// `dt` of the cycle before (time).
    pub(super) dt_previous: f64,
    /// `dt` of the cycle to come; none at the start of a run, where the first vote gives it.
    pub(super) dt: Option<f64>,
    /// Quanta of the sums of the cycle to come, and from the one after it on.
    pub(super) quanta: [Quanta; 2],
    /// The whole vote of the cycle before; none at the start of a run.
    pub(super) vote: Option<Vote>,
    /// Poses of the walls of finite mass in the cycle to come.
    pub(super) walls: Vec<Pose>,
    /// Parts that are rigid for a time, and are now.
    pub(super) formed: Vec<Formed>,
    /// With the cycle before in it.
    pub(super) run_totals: RunTotals,
    /// Rows of history up to there.
    pub(super) n_rows: usize,
    /// The rate at which bodies move against each other, as it was known then (length per cycle).
    pub(super) spread_rate: f64,
}

impl Checkpoint {
    /// Of the start of a run.
    pub(super) fn first(problem: &Problem, start: GlobalState) -> Self {
        let model = &problem.model;
        let continuation = Continuation {
            dt_previous: 0.0,
            dt: None,
            quanta: [problem.quanta; 2],
            vote: None,
            walls: mechanics::wall::first_poses(&model.setup.walls),
            formed: Vec::new(),
            run_totals: RunTotals::at_start(model, &start),
            n_rows: 0,
            spread_rate: 0.0,
        };
        Self { state: Arc::new(start), continuation }
    }

    /// The same once the parts are rigid that are at its time, and the others deform; none where that is so already. It is as results
    /// and the disk never have it: those have what the cycle before has left.
    ///
    /// # Errors
    /// If a part cannot become rigid, or cannot deform again.
    pub(super) fn switched(&self, problem: &Problem) -> Result<Option<Self>, String> {
        let (setup, mesh) = (&problem.model.setup, &problem.model.mesh);
        if !switch::is_due(&setup.switches, &self.continuation.formed, self.state.time) {
            return Ok(None);
        }
        let mut state = GlobalState::clone(&self.state);
        let mut continuation = self.continuation.clone();
        let mut bodies = self.bodies(problem);
        let about = Surroundings { setup, mesh, walls: &continuation.walls, dt: continuation.dt };
        let outcome = switch::switch(&about, &mut state, &mut continuation.formed, &mut bodies)?;
        outcome.formations.iter().for_each(|formation| continuation.run_totals.book_formation(formation));
        if let Some(vote) = &mut continuation.vote {
            vote.bodies = bodies;
            vote.strike = vote.strike.max(outcome.strike);
            vote.contact_speed_squared = vote.contact_speed_squared.max(outcome.speed * outcome.speed);
            vote.contact_speed_ahead = vote.contact_speed_ahead.max(outcome.speed);
        }
        Ok(Some(Self { state: Arc::new(state), continuation }))
    }

    /// States of the rigid bodies, those that last first.
    pub(super) fn bodies(&self, problem: &Problem) -> Vec<State> {
        match &self.continuation.vote {
            Some(vote) => vote.bodies.clone(),
            None => {
                let formed = self.continuation.formed.iter().map(|formed| &formed.body);
                problem.model.setup.bodies.iter().chain(formed).map(|body| body.start).collect()
            }
        }
    }

    /// From disk, with the rows of history up to there. `start` is the state that the deck gives.
    ///
    /// # Errors
    /// If the snapshot is of another problem.
    pub(super) fn restored(
        snapshot: Snapshot,
        problem: &Problem,
        start: &GlobalState,
    ) -> Result<(Self, Vec<Arc<HistoryRow>>), Error> {
        let setup = &problem.model.setup;
        if snapshot.problem != problem.sum
            || shape(&snapshot.state) != shape(start)
            || snapshot.state.initial_volume != start.initial_volume
            || snapshot.walls.len() != mechanics::wall::first_poses(&setup.walls).len()
            || snapshot.vote.bodies.len() != setup.bodies.len() + snapshot.formed.len()
            || !snapshot.formed.iter().all(|formed| fits(formed, problem))
            || snapshot.vote.joints.len() != setup.joints.len()
        {
            return Err(Error::AnotherProblem);
        }
        let continuation = Continuation {
            dt_previous: snapshot.dt_previous,
            dt: Some(snapshot.dt),
            quanta: snapshot.quanta,
            vote: Some(snapshot.vote),
            walls: snapshot.walls,
            formed: snapshot.formed,
            run_totals: snapshot.run_totals,
            n_rows: snapshot.rows.len(),
            spread_rate: snapshot.spread_rate,
        };
        Ok((Self { state: snapshot.state, continuation }, snapshot.rows))
    }

    /// The cycle at whose start it is.
    pub(super) fn cycle(&self) -> u64 {
        self.state.cycle
    }

    /// As it is stored; none at the start of a run, which the deck gives as well.
    pub(super) fn as_snapshot(&self, problem: &Problem, rows: &[Arc<HistoryRow>]) -> Option<Box<Snapshot>> {
        let Self { state, continuation } = self;
        Some(Box::new(Snapshot {
            problem: problem.sum,
            state: Arc::clone(state),
            dt_previous: continuation.dt_previous,
            dt: continuation.dt?,
            quanta: continuation.quanta,
            spread_rate: continuation.spread_rate,
            vote: continuation.vote.clone()?,
            walls: continuation.walls.clone(),
            formed: continuation.formed.clone(),
            run_totals: continuation.run_totals.clone(),
            rows: rows[..continuation.n_rows].to_vec(),
            states: Vec::new(),
            sums: Vec::new(),
        }))
    }
}

/// Whether a body that has formed is one of the problem, of nodes that it has.
fn fits(formed: &Formed, problem: &Problem) -> bool {
    let Formed { switch, body, constraint } = formed;
    let n = body.nodes.len();
    let setup = &problem.model.setup;
    let loads = body.forces.iter().map(|(_, load)| *load).chain(body.pulls.iter().map(|pull| pull.load));
    setup.switches.get(*switch as usize).is_some_and(|switch| switch.parts.first() == Some(&body.account))
        && body.forces.iter().all(|(place, _)| (*place as usize) < n)
        && loads.into_iter().all(|load| (load as usize) < setup.loads.forces.len())
        && (body.places.len(), constraint.len()) == (n, n)
        && body.nodes.iter().all(|&node| (node as usize) < problem.model.mesh.n_nodes())
        && constraint.iter().all(|&constraint| usize::from(constraint) < setup.constraints.len())
}

/// How long the arrays of a state are: what its mesh and its laws ask for.
fn shape(state: &GlobalState) -> (Vec<usize>, Vec<usize>) {
    let GlobalState {
        x,
        v,
        mass,
        constraint,
        initial_volume,
        elements,
        eroded,
        strain,
        contact,
        shells,
        own,
        history,
        ..
    } = state;
    let fixed =
        [x.len(), v.len(), mass.len(), constraint.len(), initial_volume.len(), eroded.len(), strain.len()];
    let of_shells = [shells.spin.len(), shells.inertia.len()].into_iter().chain(own.iter().map(Vec::len));
    let of_history = history.iter().flat_map(|part| {
        [part.part as usize, part.first as usize].into_iter().chain(part.columns.iter().map(Vec::len))
    });
    (
        fixed.into_iter().chain(elements.iter().chain(contact).map(Vec::len)).collect(),
        of_shells.chain(of_history).collect(),
    )
}

/// A checkpoint of which parts have come.
#[derive(Default)]
struct Parts {
    state: Option<GlobalState>,
    continuation: Option<Continuation>,
}

/// The newest checkpoint, and those on their way.
pub(super) struct Checkpoints {
    /// Where the next epoch begins if a worker is lost or wrong: where samples are computed again, all that led here
    /// agreed.
    newest: Arc<Checkpoint>,
    keep: CheckpointEvery,
    /// The time for a new one has come.
    is_time: bool,
    /// The cycle of the last one that was asked for because it was due, or of the epoch's beginning.
    last: u64,
    /// No timer asks for one before this cycle.
    rested: u64,
    /// By cycle.
    on_their_way: BTreeMap<u64, Parts>,
}

impl Checkpoints {
    /// Of a session that begins at `first`.
    pub(super) fn new(first: Checkpoint, keep: CheckpointEvery) -> Self {
        let last = first.cycle();
        Self { newest: Arc::new(first), keep, is_time: false, last, rested: 0, on_their_way: BTreeMap::new() }
    }

    /// The newest one that is whole, and proved where samples are computed again.
    pub(super) fn newest(&self) -> &Arc<Checkpoint> {
        &self.newest
    }

    /// Takes one as the newest.
    pub(super) fn adopt(&mut self, checkpoint: Arc<Checkpoint>) {
        self.newest = checkpoint;
    }

    /// An epoch begins at the newest one: those on their way never come.
    pub(super) fn begin_epoch(&mut self) {
        self.on_their_way.clear();
        self.last = self.newest.cycle();
        self.rested = 0;
    }

    /// Keeps of the newest one only what never changes, and of that, without `sorts`, only lengths; gives it. For workers of which none
    /// can be lost.
    pub(super) fn forget_state(&mut self, sorts: bool) -> Arc<GlobalState> {
        let state = &self.newest.state;
        let state = Arc::new(if sorts { state.statics() } else { state.outline() });
        let continuation = self.newest.continuation.clone();
        self.newest = Arc::new(Checkpoint { state: Arc::clone(&state), continuation });
        state
    }

    /// The timer has run out.
    pub(super) fn time_has_come(&mut self) {
        self.is_time = true;
    }

    /// Whether the state at the start of a cycle is to be kept, and for how long (s) the timer is to be set then.
    pub(super) fn due(&mut self, cycle: u64, at_boundary: bool) -> (bool, Option<f64>) {
        let n = self.on_their_way.len();
        let in_cycles =
            self.keep.cycles().is_some_and(|n| cycle >= self.last.saturating_add(n)) && n < AT_ONCE;
        let in_time = self.is_time && n == 0 && cycle >= self.rested;
        if !((in_time || in_cycles) && at_boundary) {
            return (false, None);
        }
        self.last = cycle;
        match self.keep.seconds() {
            Some(seconds) if self.is_time => {
                self.is_time = false;
                (true, Some(seconds))
            }
            _ => (true, None),
        }
    }

    /// One is collected at the start of a cycle.
    pub(super) fn expect(&mut self, cycle: u64) {
        self.on_their_way.entry(cycle).or_default();
    }

    /// Whether one is collected at the start of a cycle.
    pub(super) fn is_expected(&self, cycle: u64) -> bool {
        self.on_their_way.contains_key(&cycle)
    }

    /// The state of one that is expected has come.
    pub(super) fn take_state(&mut self, cycle: u64, state: GlobalState) {
        self.on_their_way.entry(cycle).or_default().state = Some(state);
    }

    /// The rest of one that is expected has come.
    pub(super) fn take_rest(&mut self, cycle: u64, continuation: Continuation) {
        self.on_their_way.entry(cycle).or_default().continuation = Some(continuation);
    }

    pub(super) fn is_whole(&self, cycle: u64) -> bool {
        matches!(self.on_their_way.get(&cycle), Some(Parts { state: Some(_), continuation: Some(_) }))
    }

    /// One that is whole, while the cycles have got to `now`.
    pub(super) fn take(&mut self, cycle: u64, now: u64) -> Option<Checkpoint> {
        if !self.is_whole(cycle) {
            return None;
        }
        self.rested = now.saturating_add(PAUSE.saturating_mul(now.saturating_sub(cycle)));
        let Parts { state, continuation } = self.on_their_way.remove(&cycle)?;
        Some(Checkpoint { state: Arc::new(state?), continuation: continuation? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkpoint() -> Checkpoint {
        let model = deck::read(super::super::tests::DECK, "two cubes").expect("a good deck");
        let (problem, start) = Problem::new(Arc::new(model)).expect("a good problem");
        Checkpoint::first(&problem, start)
    }

    #[test]
    fn one_is_whole_once_both_parts_are_here_in_any_order() {
        let first = checkpoint();
        for state_first in [true, false] {
            let mut checkpoints = Checkpoints::new(first.clone(), CheckpointEvery::Never);
            checkpoints.expect(7);
            let state = GlobalState { cycle: 7, ..GlobalState::clone(&first.state) };
            let continuation = first.continuation.clone();
            if state_first {
                checkpoints.take_state(7, state.clone());
            } else {
                checkpoints.take_rest(7, continuation.clone());
            }
            assert!(
                checkpoints.is_expected(7) && !checkpoints.is_whole(7) && checkpoints.take(7, 7).is_none()
            );
            if state_first {
                checkpoints.take_rest(7, continuation);
            } else {
                checkpoints.take_state(7, state);
            }
            assert_eq!(checkpoints.take(7, 8).map(|whole| whole.cycle()), Some(7));
            assert!(!checkpoints.is_expected(7), "it has been taken");
        }
    }

    #[test]
    fn states_are_kept_at_boundaries_alone_and_the_timer_is_set_when_it_was_time() {
        let mut checkpoints = Checkpoints::new(checkpoint(), CheckpointEvery::Either(10.0, 50));
        assert_eq!(checkpoints.due(20, true), (false, None), "neither cycles nor time");
        checkpoints.time_has_come();
        assert_eq!(checkpoints.due(23, false), (false, None), "no boundary");
        assert_eq!(checkpoints.due(25, true), (true, Some(10.0)));
        assert_eq!(checkpoints.due(74, true), (false, None), "49 cycles after the last");
        assert_eq!(checkpoints.due(75, true), (true, None), "50 cycles; the timer still runs");
    }

    #[test]
    fn one_that_took_long_is_followed_by_a_long_pause_and_cycles_ask_for_few_at_once() {
        let first = checkpoint();
        let give = |checkpoints: &mut Checkpoints, cycle, now| {
            checkpoints.take_state(cycle, GlobalState { cycle, ..GlobalState::clone(&first.state) });
            checkpoints.take_rest(cycle, first.continuation.clone());
            assert!(checkpoints.take(cycle, now).is_some());
        };
        let mut checkpoints = Checkpoints::new(first.clone(), CheckpointEvery::Seconds(10.0));
        checkpoints.time_has_come();
        assert!(checkpoints.due(25, true).0);
        checkpoints.expect(25);
        checkpoints.time_has_come();
        assert!(!checkpoints.due(50, true).0, "the last is on its way");
        give(&mut checkpoints, 25, 60);
        let later = 60 + 20 * 35;
        assert!(!checkpoints.due(later - 10, true).0, "it was on its way for 35 cycles");
        assert_eq!(checkpoints.due(later, true), (true, Some(10.0)));

        let mut checkpoints = Checkpoints::new(first.clone(), CheckpointEvery::Cycles(1));
        for cycle in 1..=4 {
            assert!(checkpoints.due(cycle, true).0);
            checkpoints.expect(cycle);
        }
        assert!(!checkpoints.due(5, true).0, "four are on their way");
        give(&mut checkpoints, 1, 5);
        assert!(checkpoints.due(6, true).0);
    }

    #[test]
    fn an_epoch_begins_without_those_that_were_on_their_way() {
        let mut checkpoints = Checkpoints::new(checkpoint(), CheckpointEvery::Cycles(10));
        checkpoints.expect(30);
        checkpoints.begin_epoch();
        assert!(!checkpoints.is_expected(30));
        assert_eq!(checkpoints.due(10, true), (true, None), "counted from the epoch's beginning");
    }
}
