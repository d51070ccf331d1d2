//! Measured balance: what workers take for their share, and when it pays to deal it out anew.
//!
//! Each frame of a cycle says how long its worker has worked so far. The medians of a few cycles give its true speed:
//! its elements over the time that they took; contact is taken to go at the same speed. Speeds that users gave, or that
//! were measured before, stand as long as measurement agrees with them; corrected are those that are off by more than
//! [`AGREES`]. Work is dealt out anew when the slowest worker takes more than [`THRESHOLD`] longer than the slowest would
//! with the new cut, also where speeds stand but elements have eroded; and after a change that brought nothing the next has to wait, each time twice as long. So noise
//! does not make elements wander.

use std::collections::VecDeque;

use mechanics::mesh::Mesh;
use protocol::message::Work;

use crate::{
    balance::{Costs, level},
    decompose::{Fleet, Living, Subdomain, Traits, decompose, work},
    incident::Rebalance,
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
    pub(super) fn medians(&self) -> Option<Vec<[f64; 2]>> {
        let median = |cycles: &VecDeque<[f64; 2]>, which: usize| {
            let mut values: Vec<f64> = cycles.iter().map(|cycle| cycle[which]).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        let full = self.workers.iter().all(|(_, cycles)| cycles.len() == WINDOW);
        full.then(|| self.workers.iter().map(|(_, c)| [median(c, 0), median(c, 1)]).collect())
    }
}

/// What the workers of an epoch were dealt, by position.
#[derive(Default)]
pub(super) struct Shares {
    /// What work was dealt out by.
    pub(super) speeds: Vec<f64>,
    /// Which of them are near each other, by number.
    pub(super) regions: Vec<u32>,
    /// Elements, eroded ones aside.
    pub(super) elements: Vec<f64>,
    /// Which worker has which elements.
    pub(super) layout: Vec<Subdomain>,
    /// How many elements each holds, eroded ones too.
    pub(super) held: Vec<u64>,
}

/// What work is dealt out over.
pub(super) struct Ground<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) costs: Costs,
    pub(super) traits: Traits<'a>,
}

/// Speeds that would be better, by position.
struct Proposal {
    speeds: Vec<f64>,
    imbalance: [f64; 2],
    /// What the slowest took (ns).
    slowest: f64,
}

/// Decides whether work is dealt out by other speeds, over all epochs of a job.
#[derive(Default)]
pub(super) struct Balancing {
    /// Speeds that the next epoch is to begin with.
    proposal: Option<Proposal>,
    /// What the slowest took before the last change (ns); none once that was compared.
    slowest_before: Option<f64>,
    /// Cycles to wait after a change that brought nothing.
    wait: u64,
    /// No change before this cycle.
    until: u64,
}

impl Balancing {
    /// Looks, at a plan boundary, whether other speeds would be better than those by which `shares` were dealt; true if the
    /// epoch is to end for that. `interval` is the longest between two boundaries.
    pub(super) fn look(
        &mut self,
        (cycle, interval): (u64, u64),
        medians: &[[f64; 2]],
        shares: &Shares,
        ground: &Ground<'_>,
    ) -> bool {
        let slowest = medians.iter().map(|[all, _]| *all).fold(0.0, f64::max);
        if let Some(before) = self.slowest_before.take() {
            let brought = slowest < BROUGHT * before;
            self.wait = if brought { 0 } else { (2 * self.wait).max(interval) };
            self.until = cycle + self.wait;
        }
        if cycle < self.until {
            return false;
        }
        self.proposal = propose(medians, slowest, shares, ground);
        self.proposal.is_some()
    }

    /// The run goes back: what was proposed after that is forgotten.
    pub(super) fn go_back(&mut self) {
        self.proposal = None;
    }

    /// An epoch of these workers ends at a cycle. Gives what is to be told where that was for other speeds; `shares` are
    /// those it was dealt.
    pub(super) fn adopt(&mut self, cycle: u64, workers: Vec<String>, shares: &Shares) -> Option<Rebalance> {
        let Proposal { speeds, imbalance, slowest } = self.proposal.take()?;
        self.slowest_before = Some(slowest);
        Some(Rebalance {
            cycle,
            workers,
            speeds_before: shares.speeds.clone(),
            speeds_after: speeds,
            imbalance_before: imbalance[0],
            imbalance_after: imbalance[1],
        })
    }
}

fn propose(medians: &[[f64; 2]], slowest: f64, shares: &Shares, ground: &Ground<'_>) -> Option<Proposal> {
    let n = shares.speeds.len();
    // Those that have eroded since work was dealt out take no time.
    let living = Living::new(ground.mesh, ground.traits.alive);
    let held = work(&shares.layout, n, 0.0, &living);
    // Elements over time, by position; none for workers without any.
    let measured: Vec<Option<f64>> = medians
        .iter()
        .zip(&held)
        .map(|([all, contact], &elements)| {
            (elements > 0.0 && all > contact).then(|| elements / (all - contact))
        })
        .collect();
    let mut ratios: Vec<f64> =
        measured.iter().zip(&shares.speeds).filter_map(|(m, speed)| m.map(|m| m / speed)).collect();
    ratios.sort_by(f64::total_cmp);
    let usual = *ratios.get(ratios.len() / 2)?;
    let speeds: Vec<f64> = measured
        .iter()
        .zip(&shares.speeds)
        .map(|(measured, &speed)| match measured {
            Some(m) if (m / (usual * speed) - 1.0).abs() > AGREES => m / usual,
            _ => speed,
        })
        .collect();
    if speeds == shares.speeds && held == shares.elements {
        return None;
    }
    let layout = decompose(
        ground.mesh,
        Fleet { speeds: &speeds, regions: &shares.regions },
        ground.costs,
        ground.traits,
    );
    let elements = work(&layout, n, 0.0, &living);
    // Contact in elements, dealt to those that end theirs first.
    let truly: Vec<f64> = (0..n).map(|w| measured[w].unwrap_or(speeds[w] * usual)).collect();
    let contact: f64 = medians.iter().zip(&truly).map(|([_, contact], speed)| contact * speed).sum();
    let last = elements.iter().zip(&truly).map(|(elements, speed)| elements / speed).fold(0.0, f64::max);
    let foreseen = level(&truly, &elements, contact).max(last);
    let bound = (elements.iter().sum::<f64>() + contact) / truly.iter().sum::<f64>();
    (slowest > (1.0 + THRESHOLD) * foreseen).then(|| Proposal {
        speeds,
        imbalance: [slowest / bound, foreseen / bound],
        slowest,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar() -> Mesh {
        let text = "title = \"bar\"\nunits = \"SI\"\n[control]\nend_cycle = 1\n[[part]]\nname = \"bar\"\nmaterial = \"LEAD\"\nbox = { origin = [0, 0, 0], size = [4, 1, 1], cells = [40, 10, 10] }\n";
        deck::read(text, "bar").expect("a good deck").mesh
    }

    /// Two workers that were dealt `mesh` by equal speeds.
    fn shares(mesh: &Mesh) -> Shares {
        let speeds = vec![1.0, 1.0];
        let layout = decompose(mesh, Fleet::near(&speeds), Costs::NONE, Traits::default());
        let elements = work(&layout, 2, 0.0, &Living::new(mesh, None));
        Shares { speeds, elements, layout, held: Vec::new(), regions: Vec::new() }
    }

    #[test]
    fn a_worker_at_half_speed_is_given_half_of_the_work_of_the_other_and_told_so() {
        let mesh = bar();
        let shares = shares(&mesh);
        let ground = Ground { mesh: &mesh, costs: Costs::NONE, traits: Traits::default() };
        let mut balancing = Balancing::default();
        assert!(!balancing.look((20, 20), &[[100.0, 0.0], [103.0, 0.0]], &shares, &ground), "they agree");
        assert!(balancing.look((40, 20), &[[100.0, 0.0], [200.0, 0.0]], &shares, &ground));
        let told = balancing.adopt(40, vec!["a".into(), "b".into()], &shares).expect("a proposal");
        assert_eq!(told.speeds_before, [1.0, 1.0]);
        assert_eq!(told.speeds_after[0], 2.0 * told.speeds_after[1]);
        assert!(told.imbalance_after < 1.02 && told.imbalance_before > 1.3, "{told:?}");
        assert!(balancing.adopt(41, Vec::new(), &shares).is_none(), "once");
    }

    #[test]
    fn after_a_change_that_brought_nothing_the_next_waits_twice_as_long_each_time() {
        let mesh = bar();
        let shares = shares(&mesh);
        let ground = Ground { mesh: &mesh, costs: Costs::NONE, traits: Traits::default() };
        let mut balancing = Balancing::default();
        let slow = [[100.0, 0.0], [200.0, 0.0]];
        let mut changes = Vec::new();
        for cycle in (20..400).step_by(20) {
            if balancing.look((cycle, 20), &slow, &shares, &ground) {
                balancing.adopt(cycle, Vec::new(), &shares).expect("a proposal");
                changes.push(cycle);
            }
        }
        assert_eq!(changes, [20, 60, 120, 220]);
    }
}
