//! Intervals that are computed twice: silent errors of elements, contact and integration, on workers and the master.
//!
//! An interval leads from the newest checkpoint to the next. Its end depends on its beginning alone, on whichever workers it is
//! computed, so a part of the intervals (`--verify`) is taken again by workers that have exchanged their sub-domains: neighbours in
//! the order of speeds, so that nobody is given much more than it was. Two computations that agree, each sub-domain by another
//! worker, make the end a checkpoint; until then nothing goes on from it. If they differ, further ones decide, and the worker of
//! the first sub-domain whose votes were others is suspected by name. Results are written again each time, so that those of
//! the last computation stay, which is one of the two that agree.

use std::collections::BTreeMap;

use mechanics::vote::Vote;

use super::{Job, error::Error, samples::Stopped};
use crate::{event::Action, incident::Difference};

/// Computations of an interval before the job gives up.
const MOST: usize = 4;

/// One computation of an interval.
#[derive(Clone, Debug)]
struct Trial {
    /// Workers by position: who computed which sub-domain.
    at_work: Vec<usize>,
    speeds: Vec<f64>,
    /// The cycle at whose start it ended.
    cycle: u64,
    /// Hash of all that it came to.
    sum: [u8; 32],
    /// By cycle and position: hash of the sub-domain's vote.
    votes: BTreeMap<u64, Vec<[u8; 32]>>,
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
}

impl Twice {
    /// Of a run of which this part is computed twice; `sum`, of the problem, says where in a row of intervals the first one is.
    pub(super) fn new(fraction: f64, sum: &[u8; 32]) -> Self {
        let phase = f64::from(u16::from_le_bytes([sum[0], sum[1]])) / 65536.0;
        let mut twice =
            Self { fraction, owed: phase, chosen: false, trials: Vec::new(), votes: BTreeMap::new() };
        twice.begin_interval();
        twice
    }

    /// Another checkpoint is the newest.
    pub(super) fn begin_interval(&mut self) {
        self.trials.clear();
        self.votes.clear();
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
        self.trials.first().map(|trial| trial.cycle)
    }

    /// A worker's vote of the cycle before this one has come; `n` are at work.
    pub(super) fn note(&mut self, (position, n): (usize, usize), cycle: u64, vote: Option<&Vote>) {
        if let (true, Some(vote)) = (self.chosen, vote) {
            self.votes.entry(cycle).or_insert_with(|| vec![[0; 32]; n])[position] = hash_of(vote);
        }
    }

    /// An epoch begins: votes of the one before are forgotten.
    pub(super) fn begin_epoch(&mut self) {
        self.votes.clear();
    }

    /// Who takes which position, of the workers that there are: where an interval is taken again, others than before.
    pub(super) fn exchange(&self, alive: Vec<usize>) -> Vec<usize> {
        let Some(first) = self.trials.first() else { return alive };
        let mut before = first.at_work.clone();
        before.sort_unstable();
        if before != alive {
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

/// The first cycle in which votes differ, and the positions whose do.
fn first_difference(wrong: &Trial, right: &Trial) -> Option<(u64, Vec<usize>)> {
    wrong.votes.iter().find_map(|(&cycle, votes)| {
        let others = right.votes.get(&cycle).filter(|others| others.len() == votes.len())?;
        let positions: Vec<usize> = (0..votes.len()).filter(|&p| votes[p] != others[p]).collect();
        // The vote that comes with a cycle is of the one before.
        (!positions.is_empty()).then(|| (cycle.saturating_sub(1), positions))
    })
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
        let begins = self.checkpoints.newest().cycle();
        let ends = stopped.state.cycle;
        let trial = Trial {
            at_work: self.epoch.at_work.clone(),
            speeds: self.epoch.shares.speeds.clone(),
            cycle: ends,
            sum: self.sum_of_interval(stopped)?,
            votes: std::mem::take(&mut self.twice.votes),
        };
        match self.twice.judge(trial) {
            Judgement::Agreed(wrong, right) => {
                for wrong in wrong {
                    let found = first_difference(&wrong, &right);
                    let names = |p: &usize| self.workers.spec(wrong.at_work[*p]).name.clone();
                    let (cycle, workers) = match &found {
                        Some((cycle, positions)) => (Some(*cycle), positions.iter().map(names).collect()),
                        None => (None, Vec::new()),
                    };
                    self.tally.differences.push(Difference { begins, ends, cycle, workers });
                }
                Ok(true)
            }
            Judgement::Again => {
                self.go_back(actions);
                self.next_epoch(actions)?;
                Ok(false)
            }
            Judgement::Never => Err(Error::NoTwoAgree { begins, ends, computations: MOST }),
        }
    }

    /// Hash of the state that an interval came to, of the rows on its way, and of what the next cycle begins with.
    fn sum_of_interval(&self, stopped: &Stopped) -> Result<[u8; 32], Error> {
        let Stopped { state, vote, .. } = stopped;
        let rest = self.rest_at(state.cycle, vote.clone())?;
        let first = self.checkpoints.newest().continuation.n_rows.min(self.account.rows.len());
        let rows: Vec<_> = self.account.rows[first..].iter().map(|row| &**row).collect();
        let mut hasher = blake3::Hasher::new();
        hasher.update(mechanics::digest::digest(state).as_bytes());
        for number in state.contact.iter().flatten() {
            hasher.update(&(number + 0.0).to_le_bytes());
        }
        let whole = (&self.account.failure, rows, rest.dt_previous, rest.dt);
        protocol::codec::encode_into(&whole, &mut hasher).map_err(|e| Error::Unencoded(e.to_string()))?;
        Ok(*hasher.finalize().as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(at_work: &[usize], sum: u8) -> Trial {
        let speeds = vec![1.0; at_work.len()];
        Trial { at_work: at_work.to_vec(), speeds, cycle: 9, sum: [sum; 32], votes: BTreeMap::new() }
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
