//! Samples computed again: a worker whose numbers are wrong is found and dropped by name.
//!
//! In the first cycle of an epoch, and in the cycle at whose start a base is collected, each worker sends a hash of what
//! the elements of one of its blocks came to. It depends on the state of that block at the start of the cycle alone,
//! which the base has, so the block is computed here once more: one block, once for each worker and base, which takes no
//! longer than a worker's own cycle. A base from which a sample differs is not taken, and the run goes back to the
//! newest one from which all agreed: between the two the worker's numbers were right at least where they were sampled.
//!
//! A sample sees arithmetic that is wrong again and again, not one flipped bit elsewhere; integration and contact are
//! proved at the greeting only.

use mechanics::{
    cycle::{Domain, Sets, Subdomain},
    lanes::Width,
    piece,
    vote::{Quanta, Vote},
};
use protocol::message::sampled_block;
use worker::compute::ThreadClock;

use super::{Job, epoch::Base};
use crate::event::{Action, Loss};

impl Job {
    /// A worker's sample of a cycle has come.
    pub(super) fn sampled(
        &mut self,
        worker: usize,
        cycle: u64,
        hash: [u8; 16],
        actions: &mut Vec<Action>,
    ) -> Result<(), String> {
        let n = self.epoch.n();
        let first = cycle == self.epoch.first_cycle;
        if !self.options.replay || !(first || self.epoch.halves.contains_key(&cycle)) {
            return Err(format!("worker {worker} sends a sample of cycle {cycle}, which nobody asked for"));
        }
        let samples = self.epoch.samples.entry(cycle).or_insert_with(|| vec![None; n]);
        if samples[worker].replace(hash).is_some() {
            return Err(format!("worker {worker} sends its sample of cycle {cycle} twice"));
        }
        if !self.has_samples(cycle) {
            return Ok(());
        }
        if self.epoch.halves.contains_key(&cycle) {
            return self.complete_base(cycle, actions);
        }
        let base = self.base.clone();
        self.prove(&base, actions).map(|_| ())
    }

    /// Whether every worker's sample of a cycle is here.
    pub(super) fn has_samples(&self, cycle: u64) -> bool {
        self.epoch.samples.get(&cycle).is_some_and(|samples| samples.iter().all(Option::is_some))
    }

    /// Computes the samples of the base's cycle again. Where all agree the base is proven; else workers are dropped, and
    /// the run has gone back.
    pub(super) fn prove(
        &mut self,
        base: &std::sync::Arc<Base>,
        actions: &mut Vec<Action>,
    ) -> Result<bool, String> {
        let cycle = base.state.cycle;
        let samples = self.epoch.samples.remove(&cycle).unwrap_or_default();
        let mut wrong = Vec::new();
        for (worker, theirs) in samples.into_iter().enumerate() {
            let (block, ours) = self.replay(base, worker)?;
            let theirs = theirs.unwrap_or_default();
            if ours != theirs {
                let part = self.epoch.blocks[worker].get(block).map_or(0, |(part, _)| *part);
                wrong.push((
                    worker,
                    format!(
                        "block {block} of {} (part `{}`) came to {} in cycle {cycle}, computed again to {}; its processor \
                         does not compute the fleet's bits, keep it out",
                        self.epoch.blocks[worker].len(),
                        self.model.mesh.parts[part].name,
                        hex(theirs),
                        hex(ours)
                    ),
                ));
            }
        }
        if wrong.is_empty() {
            self.proven = Some(base.clone());
            return Ok(true);
        }
        let n = self.epoch.n();
        if n > 1 && wrong.len() == n {
            let (_, first) = &wrong[0];
            return Err(format!(
                "the samples of all {n} workers differ from this master's: look at its host. {first}"
            ));
        }
        self.expel(wrong, actions)?;
        Ok(false)
    }

    /// The sampled block of a worker and its hash, from the base of its cycle.
    fn replay(&self, base: &Base, worker: usize) -> Result<(usize, [u8; 16]), String> {
        let (state, rest) = (&base.state, &base.rest);
        let blocks = &self.epoch.blocks[worker];
        let block = sampled_block(state.cycle, blocks.len());
        let Some((part, region)) = blocks.get(block) else { return Ok((block, [0; 16])) };
        let pieces = vec![piece::cut(&self.model.mesh, state, *part, region)];
        let subdomain = Subdomain { id: 0, pieces, unowned: Vec::new(), surface: Vec::new() };
        let quanta = Quanta { force: rest.quanta[0], ..self.quanta };
        let (setup, n_parts) = (self.model.setup.clone(), self.model.mesh.parts.len());
        let mut domain = Domain::new(setup, n_parts, quanta, &[subdomain], &[], Width::best());
        let clock = ThreadClock::default();
        domain.begin(quanta.force, state.time);
        domain.contact(rest.dt_previous, &clock);
        domain.elements(Sets::All, rest.dt_previous, &clock);
        Ok((block, domain.sample(0)?))
    }

    /// Drops a worker whose frame holds numbers that are not finite, and says so. If the cycle comes to the same on
    /// others it is not the worker, and the frame is taken: its vote then ends the run with the reason.
    pub(super) fn refuses_numbers(
        &mut self,
        worker: usize,
        cycle: u64,
        vote: Option<&Vote>,
        partials: &[f64],
        actions: &mut Vec<Action>,
    ) -> Result<bool, String> {
        let sums =
            vote.map_or(0.0, |vote| vote.force_bound + vote.external + vote.momentum.iter().sum::<f64>());
        let kinetic: f64 = vote.map_or(0.0, |vote| vote.parts.iter().map(|p| p.kinetic + p.internal).sum());
        let nan = vote.is_some_and(|vote| vote.courant.is_nan());
        let finite = (sums + kinetic).is_finite() && !nan && partials.iter().all(|p| p.is_finite());
        if finite || self.not_finite_at == Some(cycle) || self.epoch.n() < 2 {
            return Ok(false);
        }
        self.not_finite_at = Some(cycle);
        let why =
            format!("its frame of cycle {cycle} holds numbers that are not finite; keep its processor out");
        self.expel(vec![(worker, why)], actions)?;
        Ok(true)
    }

    /// Workers (by position) whose numbers cannot be trusted leave the job, which goes back to what is proven.
    fn expel(&mut self, wrong: Vec<(usize, String)>, actions: &mut Vec<Action>) -> Result<(), String> {
        let back = self.proven.clone().unwrap_or_else(|| self.base.clone());
        let (cycle, back_to) = (self.epoch.completed, back.state.cycle);
        for (position, why) in wrong {
            let index = self.epoch.crew[position];
            let member = &mut self.members[index];
            member.alive = false;
            let worker = member.hand.name.clone();
            actions.push(Action::Drop(index, format!("worker {worker}: {why}")));
            self.losses.push(Loss { worker, cycle, back_to, why });
        }
        if !self.options.waits && !self.members.iter().any(|member| member.alive) {
            let last = self.losses.last().map(|loss| format!("worker {}: {}", loss.worker, loss.why));
            return Err(format!("{}; no other is left", last.unwrap_or_default()));
        }
        self.base = back;
        self.go_back(actions);
        self.next_epoch(actions)
    }
}

fn hex(hash: [u8; 16]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}
