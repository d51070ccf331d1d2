//! Measured balance: what workers take for their share, and when it pays to deal it out anew.
//!
//! Each frame of a cycle says how long its worker has worked so far. The medians of a few cycles give its true speed:
//! its elements over the time that they took; contact is taken to go at the same speed. Speeds that users gave, or that
//! were measured before, stand as long as measurement agrees with them; corrected are those that are off by more than
//! [`AGREES`]. Work is dealt out anew when the slowest worker takes more than [`THRESHOLD`] longer than the slowest would
//! with the new cut, also where speeds stand but elements have eroded; and after a change that brought nothing the next has to wait, each time twice as long. So noise
//! does not make elements wander.

use std::collections::VecDeque;

use protocol::{message::Work, options::Balance};

use super::Job;
use crate::{
    decompose::{Living, decompose, work},
    event::Rebalance,
};

/// Cycles whose median counts.
const WINDOW: usize = 8;
/// How far a measured speed may be from the one that stands, relative to the others.
const AGREES: f64 = 0.04;
/// How much longer the slowest may take than with a better cut.
const THRESHOLD: f64 = 0.04;
/// A change has brought something if the slowest takes less than this part of what it took before.
const BROUGHT: f64 = 0.98;

/// What each worker of an epoch took for its last cycles.
pub(super) struct Meter {
    /// By position: what its last frame said, and what the cycles before it took: all, contact (ns).
    workers: Vec<(Option<Work>, VecDeque<[f64; 2]>)>,
}

impl Meter {
    pub(super) fn new(n: usize) -> Self {
        Self { workers: (0..n).map(|_| (None, VecDeque::new())).collect() }
    }

    /// Takes what a frame says.
    pub(super) fn note(&mut self, position: usize, busy: Work) {
        let (before, cycles) = &mut self.workers[position];
        if let Some(before) = before.replace(busy) {
            let took = |now: u64, before: u64| now.saturating_sub(before) as f64;
            if cycles.len() == WINDOW {
                cycles.pop_front();
            }
            cycles.push_back([
                took(busy.compute_ns, before.compute_ns),
                took(busy.contact_ns, before.contact_ns),
            ]);
        }
    }

    /// Medians of a full window by position: all, contact (ns).
    fn medians(&self) -> Option<Vec<[f64; 2]>> {
        let median = |cycles: &VecDeque<[f64; 2]>, which: usize| {
            let mut values: Vec<f64> = cycles.iter().map(|cycle| cycle[which]).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        let full = self.workers.iter().all(|(_, cycles)| cycles.len() == WINDOW);
        full.then(|| self.workers.iter().map(|(_, c)| [median(c, 0), median(c, 1)]).collect())
    }
}

/// Speeds that would be better, by position.
pub(super) struct Proposal {
    speeds: Vec<f64>,
    imbalance: [f64; 2],
    /// What the slowest took (ns).
    slowest: f64,
}

/// What came of the last change.
#[derive(Clone, Copy, Default)]
pub(super) struct Patience {
    /// What the slowest took before it (ns); none once that was compared.
    slowest_before: Option<f64>,
    /// Cycles to wait after a change that brought nothing.
    wait: u64,
    /// No change before this cycle.
    until: u64,
}

impl Job {
    /// Looks, at a plan boundary, whether other speeds would be better; true if the epoch is to end for that.
    pub(super) fn wants_other_speeds(&mut self, cycle: u64) -> bool {
        if self.options.asked.balance == Balance::Given || self.epoch.n() < 2 {
            return false;
        }
        let Some(medians) = self.epoch.meter.medians() else { return false };
        let slowest = medians.iter().map(|[all, _]| *all).fold(0.0, f64::max);
        if let Some(before) = self.patience.slowest_before.take() {
            let interval = u64::from(self.model.setup.control.plan_interval);
            let brought = slowest < BROUGHT * before;
            self.patience.wait = if brought { 0 } else { (2 * self.patience.wait).max(interval) };
            self.patience.until = cycle + self.patience.wait;
        }
        if cycle < self.patience.until {
            return false;
        }
        self.proposal = self.propose(&medians, slowest);
        self.proposal.is_some()
    }

    fn propose(&self, medians: &[[f64; 2]], slowest: f64) -> Option<Proposal> {
        let epoch = &self.epoch;
        let n = epoch.n();
        // Those that have eroded since work was dealt out take no time.
        let alive = self.alive();
        let living = Living::new(&self.model.mesh, alive.as_deref());
        let held = work(&epoch.layout, n, 0.0, &living);
        // Elements over time, by position; none for workers without any.
        let measured: Vec<Option<f64>> = medians
            .iter()
            .zip(&held)
            .map(|([all, contact], &elements)| {
                (elements > 0.0 && all > contact).then(|| elements / (all - contact))
            })
            .collect();
        let mut ratios: Vec<f64> =
            measured.iter().zip(&epoch.speeds).filter_map(|(m, speed)| m.map(|m| m / speed)).collect();
        ratios.sort_by(f64::total_cmp);
        let usual = *ratios.get(ratios.len() / 2)?;
        let speeds: Vec<f64> = measured
            .iter()
            .zip(&epoch.speeds)
            .map(|(measured, &speed)| match measured {
                Some(m) if (m / (usual * speed) - 1.0).abs() > AGREES => m / usual,
                _ => speed,
            })
            .collect();
        if speeds == epoch.speeds && held == epoch.elements {
            return None;
        }
        let layout = decompose(&self.model.mesh, &speeds, self.options.costs.node, alive.as_deref());
        let elements = work(&layout, n, 0.0, &living);
        // Contact in elements, dealt out by speed.
        let truly: Vec<f64> = (0..n).map(|w| measured[w].unwrap_or(speeds[w] * usual)).collect();
        let contact: f64 = medians.iter().zip(&truly).map(|([_, contact], speed)| contact * speed).sum();
        let dealt: f64 = speeds.iter().sum();
        let foreseen =
            (0..n).map(|w| (elements[w] + contact * speeds[w] / dealt) / truly[w]).fold(0.0, f64::max);
        let bound = (elements.iter().sum::<f64>() + contact) / truly.iter().sum::<f64>();
        (slowest > (1.0 + THRESHOLD) * foreseen).then(|| Proposal {
            speeds,
            imbalance: [slowest / bound, foreseen / bound],
            slowest,
        })
    }

    /// The epoch that ends did so for other speeds.
    pub(super) fn adopt_proposal(&mut self, cycle: u64) {
        let Some(Proposal { speeds, imbalance, slowest }) = self.proposal.take() else { return };
        let name = |&member: &usize| self.members[member].hand.name.clone();
        self.rebalances.push(Rebalance {
            cycle,
            workers: self.epoch.crew.iter().map(name).collect(),
            speeds_before: self.epoch.speeds.clone(),
            speeds_after: speeds.clone(),
            imbalance_before: imbalance[0],
            imbalance_after: imbalance[1],
        });
        self.patience.slowest_before = Some(slowest);
        for (&member, speed) in self.epoch.crew.iter().zip(speeds) {
            self.members[member].hand.speed = speed;
        }
    }
}
