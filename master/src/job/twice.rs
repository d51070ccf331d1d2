//! Intervals that are computed twice: silent errors of elements, contact and integration, on workers and the master.
//!
//! An interval leads from the newest checkpoint to the next. Its end depends on its beginning alone, on whichever workers it is
//! computed, so a part of the intervals (`--verify`) is taken again by workers that have exchanged their sub-domains: neighbours in
//! the order of speeds, so that nobody is given much more than it was. Two computations that agree, each sub-domain by another
//! worker, make the end a checkpoint; until then nothing goes on from it, and a run that its user stops ends there. They agree if the
//! state is the same, all that was written on the way, and all that the next cycle begins with. If they differ, further ones decide, and the worker of
//! the first sub-domain whose votes were others, or else its elements and nodes at the end, is suspected by name; the third time it is dismissed. Results are written again each time, so that those of
//! the last computation stay, which is one of the two that agree.
//!
//! A fault that the workers' numbers lead to, such as a force that exact sums cannot hold, ends an interval as well. It is compared like
//! any other end: where others do not come to it, the run goes on.

use std::{collections::BTreeMap, sync::Arc};

use mechanics::{digest::digest, piece::Piece, state::GlobalState, vote::Vote};
use protocol::codec;

use super::{Job, checkpoints::Continuation, error::Error, samples::Stopped};
use crate::{event::Action, incident::Difference, results::history::HistoryRow};

/// Computations of an interval before the job gives up.
const MOST: usize = 4;
/// Wrong computations that name a worker before it is dismissed. One or two may be a stray bit.
const WRONG_LIMIT: u32 = 3;

/// One computation of an interval.
#[derive(Clone, Debug)]
struct Trial {
    /// Workers by position: who computed which sub-domain.
    at_work: Vec<usize>,
    speeds: Vec<f64>,
    /// The cycle at whose start it ended; none if a fault ended it.
    cycle: Option<u64>,
    /// Hash of all that it came to.
    sum: [u8; 32],
    /// By cycle and position: hash of the sub-domain's vote.
    votes: BTreeMap<u64, Vec<[u8; 32]>>,
    /// By position: hash of the sub-domain's elements and nodes at the end.
    ends: Vec<[u8; 32]>,
}

/// What follows from a computation of an interval.
enum Judgement {
    /// It is to be taken again.
    Again,
    /// Two agree; so many did not.
    Agreed(Vec<Trial>, Box<Trial>),
    Never,
}

/// The interval under way.
pub(super) struct Twice {
    fraction: f64,
    /// Intervals that are to be computed twice so far, less those that were.
    owed: f64,
    chosen: bool,
    trials: Vec<Trial>,
    votes: BTreeMap<u64, Vec<[u8; 32]>>,
    ends: Vec<[u8; 32]>,
    /// Hash of the states that were written on the way.
    states: blake3::Hasher,
    /// By index of the worker: wrong computations that name it, of all intervals.
    named: BTreeMap<usize, u32>,
    /// A planted bug: rows of the history are all that is compared.
    narrow: bool,
}

impl Twice {
    /// Of a run of which this part is computed twice; `sum`, of the problem, says where in a row of intervals the first one is.
    pub(super) fn new(fraction: f64, sum: &[u8; 32]) -> Self {
        let phase = f64::from(u16::from_le_bytes([sum[0], sum[1]])) / 65536.0;
        let mut twice = Self {
            fraction,
            owed: phase,
            chosen: false,
            trials: Vec::new(),
            votes: BTreeMap::new(),
            ends: Vec::new(),
            states: blake3::Hasher::new(),
            named: BTreeMap::new(),
            narrow: false,
        };
        twice.begin_interval();
        twice
    }

    /// Another checkpoint is the newest.
    pub(super) fn begin_interval(&mut self) {
        self.trials.clear();
        self.begin_epoch();
        self.owed += self.fraction;
        self.chosen = self.fraction > 0.0 && self.owed >= 1.0;
        if self.chosen {
            self.owed -= 1.0;
        }
    }

    /// The interval is computed twice.
    pub(super) fn is_chosen(&self) -> bool {
        self.chosen
    }

    /// Where it ends, if it is being taken again.
    pub(super) fn until(&self) -> Option<u64> {
        self.trials.iter().find_map(|trial| trial.cycle)
    }

    /// A worker's vote of the cycle before this one has come; `n` are at work.
    pub(super) fn note(&mut self, (position, n): (usize, usize), cycle: u64, vote: Option<&Vote>) {
        if let (true, Some(vote)) = (self.chosen, vote) {
            self.votes.entry(cycle).or_insert_with(|| vec![[0; 32]; n])[position] = hash_of(vote);
        }
    }

    /// Some of a worker's pieces have come, where all stop; `n` are at work.
    ///
    /// # Errors
    /// If they cannot be encoded.
    pub(super) fn note_end(
        &mut self,
        (position, n): (usize, usize),
        pieces: &[Piece],
    ) -> protocol::Result<()> {
        if self.chosen {
            self.ends.resize(n, [0; 32]);
            let end = &mut self.ends[position];
            for piece in pieces {
                let mut hasher = blake3::Hasher::new();
                hasher.update(&*end);
                codec::encode_into(piece, &mut hasher)?;
                *end = *hasher.finalize().as_bytes();
            }
        }
        Ok(())
    }

    /// A state is written for the user.
    pub(super) fn note_state(&mut self, state: &GlobalState) {
        if self.chosen {
            put_state(state, &mut self.states);
        }
    }

    /// An epoch begins: votes and states of the one before are forgotten.
    pub(super) fn begin_epoch(&mut self) {
        self.votes.clear();
        self.ends.clear();
        self.states.reset();
    }

    /// A wrong computation names these workers, by index.
    fn name(&mut self, workers: &[usize]) {
        workers.iter().for_each(|&index| *self.named.entry(index).or_default() += 1);
    }

    /// The worker that was wrong again and again, by index, and how often; none while another was named as often.
    pub(super) fn worst(&self) -> Option<(usize, u32)> {
        let (&index, &times) = self.named.iter().max_by_key(|(_, times)| **times)?;
        let alone = self.named.values().filter(|&&other| other == times).count() == 1;
        (alone && times >= WRONG_LIMIT).then_some((index, times))
    }

    /// Nothing is held against a worker any more, by index: it is gone.
    pub(super) fn forget(&mut self, index: usize) {
        self.named.remove(&index);
    }

    /// Who takes which position, of the workers that there are: where an interval is taken again, others than before. Where workers have come
    /// or gone since, it is begun anew, for of sub-domains that were cut otherwise nobody can say that each is another worker's.
    pub(super) fn exchange(&mut self, alive: Vec<usize>) -> Vec<usize> {
        let Some(first) = self.trials.first() else { return alive };
        let mut before = first.at_work.clone();
        before.sort_unstable();
        if before != alive {
            self.trials.clear();
            return alive;
        }
        let n = alive.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| first.speeds[a].total_cmp(&first.speeds[b]).then(a.cmp(&b)));
        let mut exchanged = first.at_work.clone();
        for (rank, &position) in order.iter().enumerate() {
            exchanged[position] = first.at_work[order[partner(rank, n, self.trials.len())]];
        }
        exchanged
    }

    /// Speeds that sub-domains are cut by, where they are to be those of the first computation.
    pub(super) fn speeds(&self, at_work: &[usize]) -> Option<Vec<f64>> {
        let first = self.trials.first().filter(|first| first.at_work.len() == at_work.len())?;
        at_work.iter().all(|index| first.at_work.contains(index)).then(|| first.speeds.clone())
    }

    fn judge(&mut self, trial: Trial) -> Judgement {
        let elsewhere = |other: &Trial| {
            trial.at_work.len() < 2 || other.at_work.iter().zip(&trial.at_work).all(|(a, b)| a != b)
        };
        if self.trials.iter().any(|other| other.sum == trial.sum && elsewhere(other)) {
            let wrong = self.trials.drain(..).filter(|other| other.sum != trial.sum).collect();
            return Judgement::Agreed(wrong, Box::new(trial));
        }
        self.trials.push(trial);
        if self.trials.len() < MOST { Judgement::Again } else { Judgement::Never }
    }
}

/// The rank, of `n` in the order of speeds, whose worker has the sub-domain of `rank` in a computation: first its own, then the
/// neighbour's, then another one's.
fn partner(rank: usize, n: usize, computation: usize) -> usize {
    match computation {
        _ if n < 2 => rank,
        1 | 3 if n == 2 => 1 - rank,
        1 if n % 2 == 1 && rank >= n - 3 => n - 3 + (rank - (n - 3) + 1) % 3,
        1 => rank ^ 1,
        2 if n > 2 => (rank + 2) % n,
        _ => rank,
    }
}

/// Of what depends on the elements and nodes of a sub-domain alone, not on how contact was dealt.
fn hash_of(vote: &Vote) -> [u8; 32] {
    let parts = vote
        .parts
        .iter()
        .flat_map(|part| [part.kinetic, part.internal, part.hourglass, part.viscosity, part.gone]);
    let numbers = parts.chain(vote.momentum).chain([vote.courant, f64::from(vote.courant_element)]);
    let mut hasher = blake3::Hasher::new();
    for number in numbers {
        // Zeros of both signs are one number.
        hasher.update(&(number + 0.0).to_le_bytes());
    }
    *hasher.finalize().as_bytes()
}

/// The first cycle in which votes differ, and the positions whose do. Where none do, no cycle, and the positions whose elements and nodes
/// differ at the end, unless all do: then the difference has spread, or the sub-domains are others.
fn first_difference(wrong: &Trial, right: &Trial) -> (Option<u64>, Vec<usize>) {
    let differing = |ours: &[[u8; 32]], theirs: &[[u8; 32]]| -> Vec<usize> {
        let n = if ours.len() == theirs.len() { ours.len() } else { 0 };
        (0..n).filter(|&p| ours[p] != theirs[p]).collect()
    };
    let of_votes = wrong.votes.iter().find_map(|(&cycle, votes)| {
        let positions = differing(votes, right.votes.get(&cycle)?);
        // The vote that comes with a cycle is of the one before.
        (!positions.is_empty()).then(|| (cycle.saturating_sub(1), positions))
    });
    if let Some((cycle, positions)) = of_votes {
        return (Some(cycle), positions);
    }
    let at_end = differing(&wrong.ends, &right.ends);
    (None, if at_end.len() < wrong.ends.len() { at_end } else { Vec::new() })
}

impl Job {
    /// All have stopped at the end of an interval. Gives whether it stands; else it is being taken again.
    ///
    /// # Errors
    /// If no two computations of it agree.
    pub(super) fn interval_stands(
        &mut self,
        stopped: &Stopped,
        actions: &mut Vec<Action>,
    ) -> Result<bool, Error> {
        let sum = self.sum_of_interval(stopped)?;
        self.computation_stands(Some(stopped.state.cycle), sum, actions)
    }

    /// Something went wrong. A fault that the numbers of an interval led to is compared first, where it is computed twice: if nobody else
    /// has come to it yet, the interval is being taken again.
    ///
    /// # Errors
    /// The fault if it stands, or if no two computations agree.
    pub(super) fn judge_fault(&mut self, fault: Error, actions: &mut Vec<Action>) -> Result<(), Error> {
        if !self.twice.is_chosen() || !fault.follows_from_numbers() {
            return Err(fault);
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(fault.to_string().as_bytes());
        hasher.update(&self.epoch.schedule.completed().to_le_bytes());
        let sum = *hasher.finalize().as_bytes();
        if self.computation_stands(None, sum, actions)? { Err(fault) } else { Ok(()) }
    }

    /// A computation of the interval has ended, with this sum. Gives whether it stands; else the interval is being taken again.
    ///
    /// # Errors
    /// If no two computations of it agree.
    fn computation_stands(
        &mut self,
        cycle: Option<u64>,
        sum: [u8; 32],
        actions: &mut Vec<Action>,
    ) -> Result<bool, Error> {
        let begins = self.checkpoints.newest().cycle();
        let reached = cycle.unwrap_or_else(|| self.epoch.schedule.completed());
        let trial = Trial {
            at_work: self.epoch.at_work.clone(),
            speeds: self.epoch.shares.speeds.clone(),
            cycle,
            sum,
            votes: std::mem::take(&mut self.twice.votes),
            ends: std::mem::take(&mut self.twice.ends),
        };
        match self.twice.judge(trial) {
            Judgement::Agreed(wrong, right) => {
                for wrong in wrong {
                    let ends = right.cycle.or(wrong.cycle).unwrap_or(reached);
                    let (cycle, positions) = first_difference(&wrong, &right);
                    let indices: Vec<usize> = positions.into_iter().map(|p| wrong.at_work[p]).collect();
                    self.twice.name(&indices);
                    let workers = self.workers.names(&indices);
                    self.tally.differences.push(Difference { begins, ends, cycle, workers });
                }
                Ok(true)
            }
            Judgement::Again => {
                self.go_back(actions);
                self.next_epoch(actions)?;
                Ok(false)
            }
            Judgement::Never => Err(Error::NoTwoAgree { begins, ends: reached, computations: MOST }),
        }
    }

    /// Plants a bug: of two computations of an interval the rows of the history are all that is compared. For tests of who finds it.
    #[doc(hidden)]
    pub fn plant_narrow_sum(&mut self) {
        self.twice.narrow = true;
    }

    /// Hash of all that an interval came to.
    fn sum_of_interval(&self, stopped: &Stopped) -> Result<[u8; 32], Error> {
        let Stopped { state, vote, .. } = stopped;
        let rest = self.rest_at(state.cycle, vote.clone())?;
        let first = self.checkpoints.newest().continuation.n_rows.min(self.account.rows.len());
        let way = Way {
            states: &self.twice.states,
            rows: &self.account.rows[first..],
            failure: self.account.failure.as_deref(),
        };
        if self.twice.narrow {
            let rows: Vec<&HistoryRow> = way.rows.iter().map(|row| &**row).collect();
            let bytes = codec::encode(&rows).map_err(|e| Error::Unencoded(e.to_string()))?;
            return Ok(*blake3::hash(&bytes).as_bytes());
        }
        sum_of(&way, state, &rest).map_err(|e| Error::Unencoded(e.to_string()))
    }
}

/// What an interval wrote and said on its way.
struct Way<'a> {
    /// Of the states that were written.
    states: &'a blake3::Hasher,
    rows: &'a [Arc<HistoryRow>],
    failure: Option<&'a str>,
}

/// Hash of the state that an interval came to, of what it wrote on its way, and of all that the next cycle begins with.
///
/// # Errors
/// If something cannot be encoded.
fn sum_of(way: &Way<'_>, state: &GlobalState, rest: &Continuation) -> protocol::Result<[u8; 32]> {
    let mut hasher = blake3::Hasher::new();
    put_state(state, &mut hasher);
    hasher.update(way.states.finalize().as_bytes());
    let rows: Vec<&HistoryRow> = way.rows.iter().map(|row| &**row).collect();
    // How fast bodies move against each other says when to sort, which no bit depends on, and follows from when that was done before.
    let Continuation { dt_previous, dt, quanta, vote, walls, formed, run_totals, n_rows, spread_rate: _ } =
        rest;
    codec::encode_into(&(way.failure, rows, dt_previous, dt, quanta, walls), &mut hasher)?;
    codec::encode_into(&(formed, run_totals, n_rows), &mut hasher)?;
    // The same goes for displacements since that sort, and for the pairs that it listed.
    let vote = vote.clone().map(|vote| Vote { pairs: 0, extents: Vec::new(), ..vote });
    codec::encode_into(&vote, &mut hasher)?;
    Ok(*hasher.finalize().as_bytes())
}

/// Of all numbers of a state that a cycle changes.
fn put_state(state: &GlobalState, hasher: &mut blake3::Hasher) {
    hasher.update(digest(state).as_bytes());
    for number in state.contact.iter().flatten() {
        // Zeros of both signs are one number.
        hasher.update(&(number + 0.0).to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use mechanics::{exact::Quantum, wall::Pose};

    use super::{super::tests::job, *};

    fn trial(at_work: &[usize], sum: u8) -> Trial {
        let speeds = vec![1.0; at_work.len()];
        Trial {
            at_work: at_work.to_vec(),
            speeds,
            cycle: Some(9),
            sum: [sum; 32],
            votes: BTreeMap::new(),
            ends: Vec::new(),
        }
    }

    #[test]
    fn in_the_first_three_computations_each_sub_domain_has_another_worker_each_time() {
        for n in 3..9 {
            let of = |computation| (0..n).map(move |rank| partner(rank, n, computation));
            for (a, b) in [(0, 1), (1, 2), (0, 2)] {
                assert!(of(a).zip(of(b)).all(|(a, b)| a != b), "{n} workers, computations {a} and {b}");
            }
            let mut all: Vec<usize> = of(1).collect();
            all.sort_unstable();
            assert_eq!(all, (0..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn two_workers_that_only_repeat_themselves_agree_with_nobody() {
        let mut twice = Twice::new(1.0, &[0; 32]);
        for (at_work, sum) in [([0, 1], 1), ([1, 0], 2), ([0, 1], 1)] {
            assert!(matches!(twice.judge(trial(&at_work, sum)), Judgement::Again));
        }
        assert!(matches!(twice.judge(trial(&[1, 0], 2)), Judgement::Never));
    }

    #[test]
    fn the_first_votes_that_differ_name_a_worker_and_else_the_end_does_unless_all_differ() {
        let with = |votes: &[(u64, [u8; 2])], ends: [u8; 2]| Trial {
            votes: votes.iter().map(|&(cycle, both)| (cycle, both.map(|byte| [byte; 32]).to_vec())).collect(),
            ends: ends.map(|byte| [byte; 32]).to_vec(),
            ..trial(&[0, 1], 1)
        };
        let right = with(&[(5, [1, 2]), (6, [3, 4])], [8, 9]);
        let named = |votes, ends| first_difference(&with(votes, ends), &right);
        assert_eq!(named(&[(5, [1, 2]), (6, [3, 7])], [7, 7]), (Some(5), vec![1]));
        assert_eq!(named(&[(5, [1, 2]), (6, [3, 4])], [7, 9]), (None, vec![0]));
        assert_eq!(named(&[(5, [1, 2]), (6, [3, 4])], [7, 7]), (None, vec![]));
    }

    #[test]
    fn whoever_three_wrong_computations_name_is_the_worst_unless_another_was_named_as_often() {
        let mut twice = Twice::new(1.0, &[0; 32]);
        twice.name(&[4, 2]);
        twice.name(&[2]);
        assert_eq!(twice.worst(), None, "twice may be chance");
        twice.name(&[2, 4]);
        assert_eq!(twice.worst(), Some((2, 3)));
        twice.name(&[4]);
        assert_eq!(twice.worst(), None, "it is one of two");
        twice.forget(2);
        assert_eq!(twice.worst(), Some((4, 3)));
    }

    #[test]
    fn computations_by_workers_of_whom_one_is_gone_are_forgotten() {
        let mut twice = Twice::new(1.0, &[0; 32]);
        assert!(matches!(twice.judge(trial(&[0, 1, 2], 7)), Judgement::Again));
        assert_eq!(twice.exchange(vec![0, 1, 2]), [1, 2, 0]);
        assert_eq!((twice.exchange(vec![0, 2]), twice.until()), (vec![0, 2], None));
        assert!(
            matches!(twice.judge(trial(&[0, 2], 7)), Judgement::Again),
            "the first computed sub-domains of others"
        );
        assert_eq!(twice.exchange(vec![0, 2]), [2, 0]);
        assert!(matches!(twice.judge(trial(&[2, 0], 7)), Judgement::Agreed(wrong, _) if wrong.is_empty()));
    }

    #[test]
    fn of_three_computations_the_one_that_differs_is_wrong() {
        let mut twice = Twice::new(1.0, &[0; 32]);
        assert!(matches!(twice.judge(trial(&[0, 1, 2], 7)), Judgement::Again));
        assert!(matches!(twice.judge(trial(&[1, 2, 0], 1)), Judgement::Again));
        match twice.judge(trial(&[2, 0, 1], 1)) {
            Judgement::Agreed(wrong, right) => {
                assert_eq!((wrong.len(), wrong[0].sum, right.sum), (1, [7; 32], [1; 32]));
            }
            _ => panic!("two agree"),
        }
    }

    /// What a sum is made of.
    struct Parts {
        state: GlobalState,
        rest: Continuation,
        vote: Vote,
        twice: Twice,
    }

    #[test]
    fn all_that_is_written_or_gone_on_with_is_in_the_sum_and_when_to_sort_is_not() {
        let (job, _) = job(2);
        let checkpoint = job.checkpoints.newest();
        let sum_with = |change: &dyn Fn(&mut Parts)| {
            let mut parts = Parts {
                state: GlobalState::clone(&checkpoint.state),
                rest: checkpoint.continuation.clone(),
                vote: Vote::empty(2),
                twice: Twice::new(1.0, &[0; 32]),
            };
            change(&mut parts);
            let Parts { state, rest, vote, twice } = parts;
            let way = Way { states: &twice.states, rows: &[], failure: None };
            sum_of(&way, &state, &Continuation { vote: Some(vote), ..rest }).expect("numbers")
        };
        let plain = sum_with(&|_| {});
        let others = [
            sum_with(&|parts| parts.state.v[3][1] = f64::MIN_POSITIVE),
            sum_with(&|parts| parts.rest.dt = Some(1.0)),
            sum_with(&|parts| parts.rest.quanta[1].energy = Quantum::for_reference(1e9, 42)),
            sum_with(&|parts| parts.rest.run_totals.friction = f64::MIN_POSITIVE),
            sum_with(&|parts| parts.rest.run_totals.worst_penetration = 0.5),
            sum_with(&|parts| parts.rest.walls.push(Pose::default())),
            sum_with(&|parts| parts.vote.courant = 1.0),
            sum_with(&|parts| parts.vote.bodies.push(mechanics::rigid::State::default())),
            sum_with(&|parts| parts.vote.gauges.push((0, [0.0; 6]))),
            sum_with(&|parts| parts.twice.note_state(&parts.state)),
        ];
        for (at, other) in others.iter().enumerate() {
            assert_ne!(*other, plain, "change {at}");
            assert!(others[..at].iter().all(|before| before != other), "change {at} is as one before");
        }
        let same = [
            sum_with(&|parts| parts.rest.spread_rate = 1.0),
            sum_with(&|parts| (parts.vote.pairs, parts.vote.extents) = (9, Vec::new())),
            sum_with(&|parts| {
                parts.twice.note_state(&parts.state);
                parts.twice.begin_epoch();
            }),
        ];
        assert_eq!(same, [plain; 3]);
    }

    #[test]
    fn the_part_of_the_intervals_is_the_fraction() {
        for (fraction, expected) in [(0.0, 0), (0.05, 50), (0.5, 500), (1.0, 1000)] {
            let mut twice = Twice::new(fraction, &[77; 32]);
            let mut chosen = usize::from(twice.is_chosen());
            for _ in 1..1000 {
                twice.begin_interval();
                chosen += usize::from(twice.is_chosen());
            }
            assert!(chosen.abs_diff(expected) <= 1, "{fraction}: {chosen} of 1000");
        }
    }
}
