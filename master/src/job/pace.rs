//! The pace of a run: time steps, sorts, images and the end, from the votes of whole cycles.

use mechanics::{contact::reach, exact::Quantum, vote::Vote, wall::Motion};
use protocol::message::Orders;

use super::{Job, start::output_after};
use crate::event::{Action, Limit};
/// Part of the slack kept free for a rate of spread that rises between the trigger of a sort and the cycle it acts at:
/// surfaces that shake change it threefold in a few cycles.
const SPREAD_MARGIN: f64 = 0.25;
/// Share of the gap that contact votes for per cycle; the lag may not take it past 20 %.
const TRAVEL_VOTE: f64 = 0.16;

impl Job {
    /// The orders that give `dt` of cycle `next`, from `time` to `time_after`, and what happens then. Walls of finite mass
    /// are where they are in that cycle. `vote` is of the
    /// cycle two before the sort that it may trigger could gather.
    pub(super) fn orders_for(
        &mut self,
        next: u64,
        dt: f64,
        [time, time_after]: [f64; 2],
        vote: Option<&Vote>,
        actions: &mut Vec<Action>,
    ) -> Orders {
        let control = self.model.setup.control;
        let after = next + 1;
        if self.epoch.stop_at.is_none() {
            let ends = self.stop_asked
                || self.leaves
                || self.failure.is_some()
                || time_after >= control.end_time
                || after >= control.end_cycle;
            let pauses = !ends && self.is_boundary(after) && self.wants_next_epoch(after);
            if ends || pauses {
                self.epoch.stop_at = Some(after);
                self.epoch.pauses = pauses;
            }
        }
        let stop = self.epoch.stop_at == Some(after);
        let due = match (self.epoch.next_state_time, self.model.output.period) {
            (Some(due), Some(period)) if !self.options.asked.no_output && time_after >= due => {
                self.epoch.next_state_time = Some(output_after(time_after, period));
                true
            }
            _ => false,
        };
        let keep = self.epoch.stop_at.is_none() && self.base_due(after, actions);
        if keep {
            self.epoch.halves.entry(after).or_default();
        }
        let collect = stop || due || keep;
        if collect {
            self.epoch.image_times.insert(after, (time_after, due));
        }
        let blocking = !stop && self.surface_changes_at(after);
        let gather = blocking || (!stop && self.sort_due(after, vote));
        if gather {
            self.gather_at(after, blocking);
        }
        let (walls, force_quantum) = (self.walls.clone(), self.epoch.quantum);
        let sample = (keep || stop) && self.options.replay;
        self.epoch.stop_sampled |= stop && sample;
        Orders { next, dt, time, walls, force_quantum, gather, blocking, collect, stop, sample }
    }

    /// Plan boundaries are the cycles at which plans begin to act, and at latest every so many.
    fn is_boundary(&self, cycle: u64) -> bool {
        let control = self.model.setup.control;
        let epoch = &self.epoch;
        cycle.is_multiple_of(u64::from(control.plan_interval.max(1)))
            || epoch.sorts_under_way.iter().any(|sort| sort.acts_at == cycle)
            || epoch.exchanges.iter().any(|acting| acting.at == cycle)
    }

    /// Whether the epoch is to end at a boundary.
    fn wants_next_epoch(&mut self, boundary: u64) -> bool {
        boundary > self.epoch.first_cycle
            && (self.has_newcomers() || self.has_leavers() || self.wants_other_speeds(boundary))
    }

    /// Whether the state at the start of a cycle is to be kept, to go back to.
    fn base_due(&mut self, cycle: u64, actions: &mut Vec<Action>) -> bool {
        let keep = self.options.keep;
        let in_time = self.keep_due;
        let in_cycles = keep.cycles().is_some_and(|n| cycle >= self.epoch.last_base.saturating_add(n));
        let due = (in_time || in_cycles) && self.is_boundary(cycle);
        if due
            && in_time
            && let Some(seconds) = keep.seconds()
        {
            self.keep_due = false;
            actions.push(Action::Timer(seconds));
        }
        if due {
            self.epoch.last_base = cycle;
        }
        due || self.options.asked.snapshot_at == Some(cycle)
    }

    /// Whether positions travel at the start of cycle `cycle`, so that a sort acts a lag later.
    pub(super) fn sort_due(&mut self, cycle: u64, vote: Option<&Vote>) -> bool {
        let (Some(_), Some(settings)) = (&self.epoch.bench, &self.model.setup.contact) else { return false };
        let lag = u64::from(self.model.setup.control.sort_lag);
        let waiting = self.epoch.exchanges.iter().filter(|acting| acting.at > self.epoch.completed).count();
        let in_flight = self.epoch.sorts_under_way.len() + waiting;
        if in_flight as u64 > 2 * lag + 2 {
            return false;
        }
        if self.options.asked.forces_sort(cycle) {
            return true;
        }
        let Some(vote) = vote else { return false };
        // Positions were those of two cycles before `cycle`; the sort acts `lag` cycles after it.
        let added = (lag + 3) as f64 * self.epoch.spread_rate;
        let measured = self.epoch.references[0].0 < self.epoch.completed && in_flight == 0;
        let (spread, margin) = if measured {
            let (spread, _) = reach::worst_spread(&vote.extents, settings);
            (spread, (0.5 * added).max(SPREAD_MARGIN * settings.slack))
        } else {
            // Until votes are against the newest sorted positions, the rate says how far bodies are from those: bodies
            // that close in at the travel limit from both sides need the next sort before this one acts.
            (self.epoch.spread_rate * cycle.saturating_sub(self.epoch.last_gather) as f64, 0.0)
        };
        spread + added + margin > settings.slack
    }

    /// The step that a vote allows, what limits it, and the element if one does.
    pub(super) fn limit(&self, vote: &Vote, grown: f64) -> (f64, Limit, Option<u32>) {
        let control = &self.model.setup.control;
        let mut best = (grown, Limit::Growth, None);
        let mut offer = |dt: f64, limit: Limit, element: Option<u32>| {
            if dt < best.0 {
                best = (dt, limit, element);
            }
        };
        offer(control.safety_factor * vote.courant, Limit::Courant, Some(vote.courant_element));
        offer(vote.volume_limit, Limit::Volume, None);
        offer(vote.contact_limit, Limit::Contact, None);
        if let Some(contact) = &self.model.setup.contact {
            // A wall may bring a node to its own speed within a cycle.
            let speed = vote.contact_speed_ahead.max(self.wall_speed());
            if speed > 0.0 {
                offer(TRAVEL_VOTE * contact.gap / speed, Limit::Travel, None);
            }
        }
        best
    }

    /// The greatest speed of a wall: that prescribed at any time, or that of now.
    fn wall_speed(&self) -> f64 {
        let setup = &self.model.setup;
        let driven = setup.walls.iter().filter_map(|wall| match wall.motion {
            Motion::Driven(velocity) => Some(velocity.map(|v| v.greatest(&setup.loads.curves))),
            _ => None,
        });
        let free = self.walls.iter().map(|[_, velocity]| *velocity);
        driven.chain(free).map(|v| v.iter().map(|c| c * c).sum::<f64>().sqrt()).fold(0.0, f64::max)
    }

    /// Forces nearing the bound of exact sums ask for a coarser quantum.
    pub(super) fn rescaled(&self, vote: &Vote) -> Result<Option<Quantum>, String> {
        let quantum = self.epoch.quantum;
        if vote.force_bound > quantum.term_bound() || !vote.force_bound.is_finite() {
            return Err(format!(
                "a force of up to {:e}, exact sums hold {:e}; the run has blown up or needs a smaller time step",
                vote.force_bound,
                quantum.term_bound()
            ));
        }
        Ok((vote.force_bound > quantum.rescale_bound()).then(|| Quantum::for_reference(vote.force_bound, 42)))
    }

    /// Keeps the rate at which bodies move against each other (length per cycle), from the vote of `cycle`: that of the
    /// last cycle, or of all since the sorted positions if it is greater. Surfaces that shake stand still at times.
    pub(super) fn follow_spread(&mut self, cycle: u64, vote: &Vote) {
        let Some(settings) = &self.model.setup.contact else { return };
        let (spread, _) = reach::worst_spread(&vote.extents, settings);
        if !spread.is_finite() {
            return;
        }
        let [newest, before] = self.epoch.references;
        let (acts_at, gathered_at) = if newest.0 <= cycle { newest } else { before };
        let age = (cycle + 1).saturating_sub(gathered_at).max(1);
        let step = if acts_at < cycle { spread - self.epoch.last_spread } else { 0.0 };
        self.epoch.spread_rate = step.max(spread / age as f64);
        self.epoch.last_spread = spread;
    }
}
