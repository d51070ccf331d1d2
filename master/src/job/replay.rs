//! Samples computed again: a worker whose numbers are wrong is found and dropped by name.
//!
//! In the first cycle of an epoch, in the cycle at whose start a base is collected, and where all stop, each worker sends
//! a hash of what the elements of one of its blocks came to. It depends on the state of that block at the start of the cycle alone,
//! which the base has, so the block is computed here once more: one block, once for each worker and base, which takes no
//! longer than a worker's own cycle. A base from which a sample differs is not taken, and the run goes back to the
//! newest one from which all agreed: between the two the worker's numbers were right at least where they were sampled.
//!
//! A sample sees arithmetic that is wrong again and again, not one flipped bit elsewhere; integration and contact are
//! proved at the greeting only.

use std::sync::Arc;

use mechanics::{
    block::Piece,
    cycle::{Domain, Sets, Subdomain},
    exact::Quantum,
    lanes::Width,
    piece,
    state::GlobalState,
    vote::Quanta,
};
use protocol::{message::sampled_block, token::hex};
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
        let (n, epoch) = (self.epoch.n(), &mut self.epoch);
        let stop = epoch.stop_sampled && epoch.stop_at == Some(cycle);
        let base = epoch.halves.contains_key(&cycle);
        if !self.options.replay || !(stop || base || cycle == epoch.first_cycle) {
            return Err(format!("worker {worker} sends a sample of cycle {cycle}, which nobody asked for"));
        }
        let samples = epoch.samples.entry(cycle).or_insert_with(|| vec![None; n]);
        if samples[worker].replace(hash).is_some() {
            return Err(format!("worker {worker} sends its sample of cycle {cycle} twice"));
        }
        if stop {
            return self.prove_stop(cycle, actions);
        }
        if base {
            return self.complete_base(cycle, actions);
        }
        if self.has_samples(cycle) {
            let base = Arc::clone(&self.base);
            self.prove(&base, actions)?;
        }
        Ok(())
    }

    /// Whether every worker's sample of a cycle is here.
    pub(super) fn has_samples(&self, cycle: u64) -> bool {
        self.epoch.samples.get(&cycle).is_some_and(|samples| samples.iter().all(Option::is_some))
    }

    /// Computes the samples of the base's cycle again. Gives whether all agree; else workers are dropped, and the run has
    /// gone back.
    pub(super) fn prove(&mut self, base: &Arc<Base>, actions: &mut Vec<Action>) -> Result<bool, String> {
        let Base { state, rest } = &**base;
        let wrong = self.differing(state, rest.dt_previous, rest.quanta[0], state.time)?;
        let agree = wrong.is_empty();
        if !agree {
            self.expel(wrong, actions)?;
        }
        Ok(agree)
    }

    /// Goes on with a stop once its samples and images are here and agree.
    pub(super) fn prove_stop(&mut self, cycle: u64, actions: &mut Vec<Action>) -> Result<(), String> {
        if !self.has_samples(cycle) {
            return Ok(());
        }
        let Some((state, vote, due)) = self.epoch.stopped.take() else { return Ok(()) };
        let step = |cycle: u64| self.epoch.steps.get(&cycle).copied();
        let now = step(cycle).ok_or_else(|| format!("cycle {cycle} was not ordered"))?;
        // What the worker's clock says, to the bit.
        let (dt_previous, time) = match cycle.checked_sub(1).and_then(step) {
            Some(before) => (before.dt, before.time + before.dt),
            None => (self.base.rest.dt_previous, now.time),
        };
        let wrong = self.differing(&state, dt_previous, now.quantum, time)?;
        if wrong.is_empty() {
            self.all_stopped(state, vote, due, actions)
        } else {
            self.expel(wrong, actions)
        }
    }

    /// The workers (by position) whose samples of the state's cycle are others than here, and how.
    fn differing(
        &mut self,
        state: &GlobalState,
        dt_previous: f64,
        quantum: Quantum,
        time: f64,
    ) -> Result<Vec<(usize, String)>, String> {
        let cycle = state.cycle;
        let samples = self.epoch.samples.remove(&cycle).unwrap_or_default();
        let mut wrong = Vec::new();
        for (worker, theirs) in samples.into_iter().enumerate() {
            let blocks = &self.epoch.blocks[worker];
            let block = sampled_block(cycle, blocks.len());
            let Some((part, region)) = blocks.get(block) else { continue };
            let pieces = vec![piece::cut(&self.model.mesh, state, *part, region)];
            let ours = self.replay((pieces, cycle), dt_previous, quantum, time)?;
            let theirs = theirs.unwrap_or_default();
            if ours != theirs {
                let why = format!(
                    "block {block} of {} (part `{}`) came to {} in cycle {cycle}, computed again to {}; its processor does \
                     not compute the fleet's bits, keep it out",
                    blocks.len(),
                    self.model.mesh.parts[*part].name,
                    hex(&theirs),
                    hex(&ours)
                );
                wrong.push((worker, why));
            }
        }
        let n = self.epoch.n();
        match wrong.first() {
            Some((_, first)) if n > 1 && wrong.len() == n => Err(format!(
                "the samples of all {n} workers differ from this master's: look at its host. {first}"
            )),
            _ => Ok(wrong),
        }
    }

    /// Hash of what the elements of a block come to in a cycle.
    fn replay(
        &self,
        (pieces, cycle): (Vec<Piece>, u64),
        dt_previous: f64,
        quantum: Quantum,
        time: f64,
    ) -> Result<[u8; 16], String> {
        let subdomain = Subdomain { id: 0, pieces, unowned: Vec::new(), surface: Vec::new() };
        let quanta = Quanta { force: quantum, ..self.quanta };
        let (setup, n_parts) = (self.model.setup.clone(), self.model.mesh.parts.len());
        let mut domain = Domain::new(setup, n_parts, quanta, (vec![subdomain], cycle), &[], Width::best());
        let clock = ThreadClock::default();
        domain.begin(quantum, time);
        domain.contact(dt_previous, &clock);
        domain.elements(Sets::All, dt_previous, &clock);
        domain.sample(0)
    }

    /// Workers (by position) whose numbers cannot be trusted leave the job, which goes back to what is proven.
    fn expel(&mut self, wrong: Vec<(usize, String)>, actions: &mut Vec<Action>) -> Result<(), String> {
        let (cycle, back_to) = (self.epoch.completed, self.base.state.cycle);
        for (position, why) in wrong {
            let index = self.epoch.crew[position];
            let member = &mut self.members[index];
            member.alive = false;
            let worker = member.hand.name.clone();
            actions.push(Action::Dismiss(index, why.clone()));
            self.losses.push(Loss { worker, cycle, back_to, why });
        }
        if !self.options.waits && !self.members.iter().any(|member| member.alive) {
            let last = self.losses.last().map(|loss| format!("worker {}: {}", loss.worker, loss.why));
            return Err(format!("{}; no other is left", last.unwrap_or_default()));
        }
        self.go_back(actions);
        self.next_epoch(actions)
    }
}
