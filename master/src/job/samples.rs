//! Samples computed again: a worker whose numbers are wrong is found and dropped by name.
//!
//! In the first cycle of an epoch, in the cycle at whose start a checkpoint is collected, and where all stop, each worker sends
//! a hash of what the elements of one of its blocks came to. It depends on the state of that block at the start of the cycle alone,
//! which the checkpoint has, so the block is computed here once more: one block, once for each worker and checkpoint, which takes no
//! longer than a worker's own cycle. A checkpoint from which a sample differs is not taken, and the run goes back to the
//! newest one from which all agreed: between the two the worker's numbers were right at least where they were sampled.
//!
//! A sample sees arithmetic that is wrong again and again, not one flipped bit elsewhere; integration and contact are
//! proved at the greeting only.

use std::collections::BTreeMap;

use mechanics::{
    exact::Quanta,
    lanes::Width,
    piece::{self, Piece, Region},
    sample::Sample,
    state::GlobalState,
    vote::Vote,
};
use protocol::{message::sampled_block, token::hex};

use super::{
    error::{Breach, Error, Sent},
    problem::Problem,
};

/// The cycle that samples are of, as workers computed it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// `dt` of the cycle before (time).
    pub(super) dt_previous: f64,
    pub(super) quanta: Quanta,
    /// What the workers' clock says at the start of the cycle, to the bit (time).
    pub(super) time: f64,
}

/// All have stopped, and their states are here.
pub(super) struct Stopped {
    pub(super) state: GlobalState,
    /// The last vote.
    pub(super) vote: Vote,
    /// The state is for the user.
    pub(super) due: bool,
}

/// The samples of one epoch.
#[derive(Default)]
pub(super) struct Samples {
    /// By worker: part and elements of each block; empty where no samples are computed again.
    blocks: Vec<Vec<(usize, Region)>>,
    /// By cycle, then by worker.
    arrived: BTreeMap<u64, Vec<Option<[u8; 16]>>>,
    /// What waits for the samples of the stop.
    stopped: Option<Stopped>,
    /// One of those that agreed last: its worker, its hash.
    proved: Option<(usize, [u8; 16], Sample)>,
}

impl Samples {
    /// Of workers with these blocks.
    pub(super) fn new(blocks: Vec<Vec<(usize, Region)>>) -> Self {
        Self { blocks, ..Self::default() }
    }

    /// Adds the sample of one of `n` workers.
    ///
    /// # Errors
    /// If it came before.
    pub(super) fn add(
        &mut self,
        (worker, n): (usize, usize),
        cycle: u64,
        hash: [u8; 16],
    ) -> Result<(), Error> {
        let samples = self.arrived.entry(cycle).or_insert_with(|| vec![None; n]);
        match samples[worker].replace(hash) {
            Some(_) => Err(Error::Worker(worker, Breach::Twice(Sent::Sample, cycle))),
            None => Ok(()),
        }
    }

    /// Whether every worker's sample of a cycle is here.
    pub(super) fn are_all_here(&self, cycle: u64) -> bool {
        self.arrived.get(&cycle).is_some_and(|samples| samples.iter().all(Option::is_some))
    }

    /// Keeps what all stopped with until its samples are here.
    pub(super) fn hold(&mut self, stopped: Stopped) {
        self.stopped = Some(stopped);
    }

    /// What all stopped with, once its samples are here.
    pub(super) fn take_stopped(&mut self, cycle: u64) -> Option<Stopped> {
        if self.are_all_here(cycle) { self.stopped.take() } else { None }
    }

    /// One of the samples that agreed last, if it was not taken yet: its worker, its hash.
    pub(super) fn take_proved(&mut self) -> Option<(usize, [u8; 16], Sample)> {
        self.proved.take()
    }

    /// The workers whose samples of the state's cycle are others than here, and how.
    ///
    /// # Errors
    /// If all differ, of two or more: the master is the one to suspect.
    pub(super) fn differing(
        &mut self,
        problem: &Problem,
        state: &GlobalState,
        moment: Moment,
    ) -> Result<Vec<(usize, String)>, Error> {
        let cycle = state.cycle;
        let samples = self.arrived.remove(&cycle).unwrap_or_default();
        let mesh = &problem.model.mesh;
        let mut wrong = Vec::new();
        // Workers take turns.
        let workers = self.blocks.len();
        let shown = sampled_block(cycle, workers.max(1));
        for (worker, theirs) in samples.into_iter().enumerate() {
            let blocks = &self.blocks[worker];
            let block = sampled_block(cycle, blocks.len());
            let Some((part, region)) = blocks.get(block) else { continue };
            let piece = piece::cut(mesh, state, *part, region);
            let theirs = theirs.unwrap_or_default();
            let sample = sample(problem, piece, cycle, moment);
            if worker == shown {
                self.proved = Some((worker, theirs, sample.clone()));
            }
            let ours = sample.hash(Width::best()).map_err(Error::Problem)?;
            if ours != theirs {
                let why = format!(
                    "block {block} of {} (part `{}`) came to {} in cycle {cycle}, computed again to {}; its processor does \
                     not compute the fleet's bits, keep it out",
                    blocks.len(),
                    mesh.parts[*part].name,
                    hex(&theirs),
                    hex(&ours)
                );
                wrong.push((worker, why));
            }
        }
        if !wrong.is_empty() {
            self.proved = None;
        }
        match wrong.first() {
            Some((_, first)) if workers > 1 && wrong.len() == workers => {
                Err(Error::AllDiffer { workers, first: first.clone() })
            }
            _ => Ok(wrong),
        }
    }
}

/// A block at the start of a cycle, with all that its elements depend on.
fn sample(problem: &Problem, piece: Piece, cycle: u64, moment: Moment) -> Sample {
    let Moment { dt_previous, quanta, time } = moment;
    let (setup, n_parts) = (problem.model.setup.clone(), problem.model.mesh.parts.len());
    Sample { setup, n_parts, quanta, piece, cycle, time, dt_previous }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::job, *};

    /// Samples of two workers that have one block each: a cube.
    fn samples() -> Samples {
        let low = |part| (part, Region::Cells { low: [0; 3], high: [2; 3] });
        Samples::new(vec![vec![low(0)], vec![low(1)]])
    }

    #[test]
    fn the_worker_whose_sample_is_another_than_here_is_named_and_if_all_are_the_master_suspects_itself() {
        let (job, _) = job(2);
        let state = job.start_state();
        let moment = Moment { dt_previous: 0.0, quanta: job.problem.quanta, time: 0.0 };
        let of_part = |part| {
            let region = Region::Cells { low: [0; 3], high: [2; 3] };
            let piece = piece::cut(&job.problem.model.mesh, state, part, &region);
            sample(&job.problem, piece, 0, moment).hash(Width::Scalar).expect("it computes")
        };
        let right = [of_part(0), of_part(1)];
        let differing = |hashes: [[u8; 16]; 2]| {
            let mut samples = samples();
            for (worker, hash) in hashes.into_iter().enumerate() {
                assert!(!samples.are_all_here(0));
                samples.add((worker, 2), 0, hash).expect("once");
            }
            assert!(samples.are_all_here(0));
            samples.differing(&job.problem, state, moment)
        };
        assert_eq!(differing(right), Ok(Vec::new()));
        let wrong = differing([right[0], [7; 16]]).expect("one is right");
        assert!(wrong.len() == 1 && wrong[0].0 == 1 && wrong[0].1.contains("part `high`"), "{wrong:?}");
        assert!(matches!(differing([[1; 16], [7; 16]]), Err(Error::AllDiffer { workers: 2, .. })));
    }

    #[test]
    fn a_sample_comes_once() {
        let mut samples = samples();
        samples.add((1, 2), 5, [0; 16]).expect("the first");
        let twice = samples.add((1, 2), 5, [0; 16]);
        assert_eq!(twice, Err(Error::Worker(1, Breach::Twice(Sent::Sample, 5))));
    }
}
