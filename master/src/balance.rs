//! Balance: work units to workers by speed and ownership, at each sort (paper section 4).
//!
//! A unit weighs the pairs that a cycle will look at ([`mechanics::contact::cull`]). Contact is shared out so that workers end their
//! sub-domains and units at one time. A unit stays with the worker that owns most of its nodes' elements unless that
//! worker has more than its share; then its lightest-bound units go to the workers with the most room. Deterministic.

use std::collections::BTreeSet;

use mechanics::contact::{Surface, WorkUnit};

use crate::decompose::Fleet;

/// What work costs in a cycle, in element-cycles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// Integrating a node.
    pub node: f64,
    /// A node-face pair.
    pub pair: f64,
    /// A message, at each of its ends.
    pub message: f64,
    /// Its way between two hosts.
    pub travel: f64,
    /// A byte on the wire of a host, whatever the host's speed.
    pub byte: f64,
    /// A byte of a message, at each of its ends.
    pub copy: f64,
}

impl Costs {
    /// Only elements cost anything.
    pub const NONE: Self = Self { node: 0.0, pair: 0.0, message: 0.0, travel: 0.0, byte: 0.0, copy: 0.0 };
}

impl Default for Costs {
    /// Of this code with the widest lanes (`bolide simulate --measure-costs`): 48 ns an element, 3.1 us a message and 0.11 ns a byte of it; 15 us of a switch and
    /// 1 Gb/s are what labs have.
    fn default() -> Self {
        Self { node: 0.09, pair: 1.2, message: 65.0, travel: 310.0, byte: 0.17, copy: 0.0023 }
    }
}

/// What a worker has to do in a cycle beside contact, in element-cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Base {
    /// What its processor takes: elements, nodes and messages.
    pub busy: f64,
    /// When it ends, with what it waits for wires.
    pub end: f64,
}

impl Base {
    /// Of a worker that waits for nothing.
    pub fn of(busy: f64) -> Self {
        Self { busy, end: busy }
    }
}

/// Interactions that cost as much as one element-cycle: of the plates of 64,000 elements 4.6 make a pair, and a pair costs
/// 1.2 elements (`bolide simulate --decomposition --json`, `--measure-costs`).
pub const INTERACTIONS_PER_ELEMENT: f64 = 3.8;

/// How many times as long a byte takes between two regions as on the wire of a host: all workers of a region share that way.
pub const FAR_BYTE: f64 = 10.0;

/// Bytes that a node of a unit takes between the owner of its elements and another worker in a cycle: its position, and its force back.
const NODE_BYTES: f64 = 48.0;

/// How units are dealt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dealing {
    /// To the owner of their nodes while its load allows.
    #[default]
    Owners,
    /// By weight alone, the heaviest first: what a cluster pays for leaving ownership out, in `simulate`.
    Weights,
}

/// A surface node in a sort for sixteen workers, in element-cycles of this code (`bolide simulate --measure-costs`).
pub const SORT_ELEMENTS: f64 = 3.9;

/// Least share of its speed that a worker keeps beside sorts.
const LEAST_BESIDE_SORTS: f64 = 0.1;

/// Speeds to deal out work by where some workers share the master's host, on which sorts run at the lowest priority: a
/// sort must be done within its lag, less half a cycle for the way of positions and plans, or all workers wait for it.
/// So the workers on that host leave idle in each cycle what that takes. `elements` is the work of a cycle and `sort`
/// that of a sort, in the same unit. Where all workers share the host, or none does, speeds stay.
pub fn beside_sorts(speeds: &[f64], beside: &[bool], elements: f64, sort: f64, lag: u32) -> Vec<f64> {
    let n = beside.iter().filter(|b| **b).count();
    if n == 0 || n == speeds.len() || elements <= 0.0 {
        return speeds.to_vec();
    }
    let idle = sort / (f64::from(lag.max(1)) - 0.5) / elements * speeds.iter().sum::<f64>() / n as f64;
    let left = |(&speed, &beside): (&f64, &bool)| {
        if beside { (speed - idle).max(LEAST_BESIDE_SORTS * speed) } else { speed }
    };
    speeds.iter().zip(beside).map(left).collect()
}

/// Worker of each unit by weight alone: each, the heaviest first, to the worker that would end it first.
pub fn assign_by_weight(units: &[WorkUnit], speeds: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..units.len()).collect();
    order.sort_by_key(|&u| (std::cmp::Reverse(units[u].interactions), u));
    let mut load = vec![0_u64; speeds.len()];
    let mut chosen = vec![0; units.len()];
    for u in order {
        let end = |w: usize| (load[w] + units[u].interactions) as f64 / speeds[w];
        let best = (0..speeds.len()).fold(0, |best, w| if end(w) < end(best) { w } else { best });
        load[best] += units[u].interactions;
        chosen[u] = best;
    }
    chosen
}

/// How far above its share a worker may be before units move, relative to its whole cycle; moving one costs shared
/// nodes in every cycle.
const TOLERANCE: f64 = 0.001;

/// When all workers have ended if pairs fill up those that end their sub-domains first (element-cycles at speed 1).
/// Contact so levels what index planes left uneven.
pub fn level(speeds: &[f64], work: &[f64], contact: f64) -> f64 {
    let mut order: Vec<usize> = (0..speeds.len()).collect();
    let finish = |w: usize| work[w] / speeds[w];
    order.sort_by(|&a, &b| finish(a).total_cmp(&finish(b)).then(a.cmp(&b)));
    let (mut speed, mut load, mut level) = (0.0, contact, 0.0);
    for &w in &order {
        if speed > 0.0 && finish(w) >= level {
            break;
        }
        speed += speeds[w];
        load += work[w];
        level = load / speed;
    }
    level
}

/// Worker of each unit that owns most of its nodes, and how many.
fn owners(units: &[WorkUnit], n: usize, owner: &dyn Fn(u32) -> usize) -> Vec<(usize, usize)> {
    let mut count = vec![0_usize; n];
    let owner_of = |unit: &WorkUnit| {
        let mut best = usize::MAX;
        for &node in &unit.nodes {
            let w = owner(node);
            count[w] += 1;
            if best == usize::MAX || (count[w], std::cmp::Reverse(w)) > (count[best], std::cmp::Reverse(best))
            {
                best = w;
            }
        }
        let found = if best == usize::MAX { (0, 0) } else { (best, count[best]) };
        for &node in &unit.nodes {
            count[owner(node)] = 0;
        }
        found
    };
    units.iter().map(owner_of).collect()
}

/// Worker of each unit by ownership alone: what slabs without a balance of contact come to, in `simulate`.
pub fn assign_to_owners(units: &[WorkUnit], n: usize, owner: &dyn Fn(u32) -> usize) -> Vec<usize> {
    owners(units, n, owner).into_iter().map(|(worker, _)| worker).collect()
}

/// Surface nodes that a unit needs, ascending.
type Nodes<'a> = dyn Fn(&WorkUnit) -> Vec<u32> + 'a;

/// Worker of each unit. `weights` are the units' pairs; `bases` is what the workers do beside them; `owner` gives the
/// worker that owns a surface node's elements, and `nodes` those that a unit needs ([`nodes_of`]). A worker keeps its units if its processor is
/// late by less than the messages of two new neighbours: what it waits for wires would not be less without them. Messages of workers that
/// exchanged no node before count on both sides. A unit leaves the region of its owner only if that gains more than the bytes of all units that
/// do take between two regions.
pub fn assign(
    units: &[WorkUnit],
    (weights, costs): (&[u64], Costs),
    fleet: Fleet<'_>,
    bases: &[Base],
    (owner, nodes): (&dyn Fn(u32) -> usize, &Nodes<'_>),
) -> Vec<usize> {
    let speeds = fleet.speeds;
    let n = speeds.len();
    if n == 1 {
        return vec![0; units.len()];
    }
    let (chosen, bound): (Vec<usize>, Vec<usize>) = owners(units, n, owner).into_iter().unzip();
    let mut load = vec![0_u64; n];
    for (weight, &worker) in weights.iter().zip(&chosen) {
        load[worker] += weight;
    }
    let ends: Vec<f64> = bases.iter().map(|base| base.end).collect();
    let level = level(speeds, &ends, costs.pair * load.iter().sum::<u64>() as f64);
    let (bases, known, holders) = (bases.to_vec(), Vec::new(), Vec::new());
    let mut dealer = Dealer { costs, fleet, bases, load, chosen, known, holders, level, between: 0.0 };
    let is_late = |u: &usize| weights[*u] > 0 && dealer.is_late(dealer.chosen[*u]);
    let mut giving: Vec<usize> = (0..units.len()).filter(is_late).collect();
    if giving.is_empty() {
        return dealer.chosen;
    }
    // Loosely bound units first, the heavier of equals first: fewer moves.
    giving.sort_by_key(|&u| (bound[u], std::cmp::Reverse(weights[u]), u));
    if costs.message > 0.0 {
        dealer.meet(units, owner, nodes);
    }
    let mut give = |u: usize, may_meet: bool| {
        if dealer.is_late(dealer.chosen[u]) {
            dealer.give(u, weights[u], &nodes(&units[u]), may_meet);
        }
    };
    giving.iter().for_each(|&u| give(u, false));
    // Then to workers that the giver has not met, each of which takes many: those first that few hold.
    if costs.message > 0.0 {
        giving.iter().rev().for_each(|&u| give(u, true));
    }
    dealer.chosen
}

/// Surface nodes whose positions a unit needs and on which it puts forces, ascending: its own and those of its faces.
pub fn nodes_of(unit: &WorkUnit, surface: &Surface) -> Vec<u32> {
    let of_faces = unit.faces.iter().flat_map(|&face| surface.faces[face as usize].nodes);
    let mut nodes: Vec<u32> = unit.nodes.iter().copied().chain(of_faces).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Units on their way to workers that have room.
struct Dealer<'a> {
    costs: Costs,
    fleet: Fleet<'a>,
    /// By worker: what it does beside contact, with messages to those that it has met.
    bases: Vec<Base>,
    /// By worker: pairs of its units.
    load: Vec<u64>,
    /// Worker of each unit.
    chosen: Vec<usize>,
    /// By worker: those with which it exchanges nodes of units. None where messages cost nothing, as below.
    known: Vec<BTreeSet<usize>>,
    /// By surface node: its owner and workers that have units with it. Each sends all others what it adds to the force on the node.
    holders: Vec<Vec<usize>>,
    /// When all would have ended at best.
    level: f64,
    /// Element-cycles that units which have left their region take between two.
    between: f64,
}

impl Dealer<'_> {
    /// When a worker with so many pairs ends, after what it has to do `before`.
    fn finish(&self, worker: usize, load: u64, before: f64) -> f64 {
        self.costs.pair.mul_add(load as f64, before) / self.fleet.speeds[worker]
    }

    /// When the processor of a worker is done with what it has now.
    fn done(&self, worker: usize) -> f64 {
        self.finish(worker, self.load[worker], self.bases[worker].busy)
    }

    /// What a neighbour more costs a worker.
    fn meeting(&self, worker: usize) -> f64 {
        NEIGHBOUR * self.costs.message / self.fleet.speeds[worker]
    }

    /// Whether a worker ends later than the others by more than it costs to give units away.
    fn is_late(&self, worker: usize) -> bool {
        let limit = self.level.mul_add(1.0 + TOLERANCE, 2.0 * self.meeting(worker));
        self.done(worker) > limit
    }

    /// Workers that hold nodes of units meet.
    fn meet(&mut self, units: &[WorkUnit], owner: &dyn Fn(u32) -> usize, nodes: &Nodes<'_>) {
        self.known = vec![BTreeSet::new(); self.load.len()];
        for (unit, &worker) in units.iter().zip(&self.chosen).filter(|(unit, _)| !unit.is_empty()) {
            let nodes = nodes(unit);
            let n = nodes.last().map_or(0, |&last| last as usize + 1);
            self.holders.resize(self.holders.len().max(n), Vec::new());
            for node in nodes {
                let holders = &mut self.holders[node as usize];
                for holder in [owner(node), worker] {
                    if !holders.contains(&holder) {
                        for &other in &*holders {
                            self.known[holder].insert(other);
                            self.known[other].insert(holder);
                        }
                        holders.push(holder);
                    }
                }
            }
        }
    }

    /// Workers that hold any of these nodes, ascending.
    fn holders_of(&self, nodes: &[u32]) -> Vec<usize> {
        let holders = |&node: &u32| self.holders.get(node as usize).into_iter().flatten().copied();
        let mut all: Vec<usize> = nodes.iter().flat_map(holders).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn has_met(&self, one: usize, other: usize) -> bool {
        one == other || self.known[one].contains(&other)
    }

    /// Gives a unit of so many pairs, and with these nodes, from a worker that is late to the one that ends it first; where messages cost,
    /// if that one is late by half as much at most. Workers meet only if they `may`, and if the giver is late by more than that costs on both
    /// sides.
    fn give(&mut self, u: usize, weight: u64, nodes: &[u32], may_meet: bool) {
        let from = self.chosen[u];
        let before = self.done(from);
        let late = before - self.level;
        let far = FAR_BYTE * self.costs.byte * NODE_BYTES * nodes.len() as f64;
        let holders = self.holders_of(nodes);
        // What costs messages has to gain as much again.
        let enough = if self.costs.message > 0.0 { self.level + 0.5 * late } else { before };
        let (mut best, mut to) = (enough, from);
        for other in (0..self.load.len()).filter(|&other| other != from) {
            let way = if self.fleet.are_near(from, other) { 0.0 } else { self.between + far };
            let computed = self.finish(other, self.load[other] + weight, self.bases[other].end) + way;
            if computed < best {
                let new = holders.iter().filter(|&&holder| !self.has_met(other, holder)).count() as f64;
                let after = new.mul_add(self.meeting(other), computed);
                let pays = new == 0.0 || may_meet && late > new * (self.meeting(from) + self.meeting(other));
                (best, to) = if pays && after < best { (after, other) } else { (best, to) };
            }
        }
        if to == from {
            return;
        }
        self.load[from] -= weight;
        self.load[to] += weight;
        self.chosen[u] = to;
        self.between += if self.fleet.are_near(from, to) { 0.0 } else { far };
        for holder in holders {
            if !self.has_met(to, holder) {
                for (one, other) in [(to, holder), (holder, to)] {
                    self.bases[one].busy += NEIGHBOUR * self.costs.message;
                    self.bases[one].end += NEIGHBOUR * self.costs.message;
                    self.known[one].insert(other);
                }
            }
        }
        for &node in nodes {
            if let Some(holders) = self.holders.get_mut(node as usize)
                && !holders.contains(&to)
            {
                holders.push(to);
            }
        }
    }
}

/// Messages that a worker sends and receives in a cycle for a neighbour more.
const NEIGHBOUR: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn own(unit: &WorkUnit) -> Vec<u32> {
        unit.nodes.clone()
    }

    fn bases(busy: &[f64]) -> Vec<Base> {
        busy.iter().copied().map(Base::of).collect()
    }

    const PAIRS: Costs = Costs { pair: 1.2, ..Costs::NONE };

    fn unit(i: i32, nodes: Vec<u32>, interactions: u64) -> WorkUnit {
        WorkUnit { cube: [i, 0, 0], nodes, faces: vec![0], interactions, ..WorkUnit::default() }
    }

    #[test]
    fn units_stay_with_the_owner_of_their_nodes_when_loads_fit() {
        let units: Vec<_> = (0..8).map(|i| unit(i, vec![i as u32], 10)).collect();
        let owner = |n: u32| (n % 2) as usize;
        assert_eq!(
            assign(&units, (&[10; 8], PAIRS), Fleet::near(&[1.0, 1.0]), &bases(&[1e4; 2]), (&owner, &own)),
            [0, 1, 0, 1, 0, 1, 0, 1]
        );
    }

    #[test]
    fn dealing_by_weight_follows_speeds_and_not_owners() {
        let units: Vec<_> = (0..60).map(|i| unit(i, vec![i as u32], 10)).collect();
        let chosen = assign_by_weight(&units, &[1.0, 2.0]);
        assert_eq!(chosen.iter().filter(|&&w| w == 1).count(), 40);
    }

    #[test]
    fn an_overloaded_worker_gives_units_until_shares_follow_speeds() {
        let units: Vec<_> = (0..400).map(|i| unit(i, vec![i as u32], 10)).collect();
        let speeds = [1.0, 2.0, 1.0];
        let chosen = assign(
            &units,
            (&[10; 400], PAIRS),
            Fleet::near(&speeds),
            &bases(&[500.0, 1000.0, 500.0]),
            (&|_| 0, &own),
        );
        for (w, s) in speeds.iter().enumerate() {
            let load = chosen.iter().filter(|&&c| c == w).count() as f64;
            let share = 100.0 * s;
            assert!((load - share).abs() <= share * 0.11 + 1.0, "worker {w}: {load} against {share}");
        }
    }

    #[test]
    fn contact_levels_what_index_planes_left_uneven() {
        assert!((level(&[1.0, 1.0, 2.0], &[100.0, 110.0, 220.0], 40.0) - 117.5).abs() < 1e-9);
        let units: Vec<_> = (0..100).map(|i| unit(i, vec![i as u32], 1)).collect();
        let chosen = assign(
            &units,
            (&[1; 100], PAIRS),
            Fleet::near(&[1.0, 1.0]),
            &bases(&[1000.0, 1060.0]),
            (&|_| 1, &own),
        );
        let first = chosen.iter().filter(|&&w| w == 0).count();
        // 120 elements' worth of pairs: 90 to the first, 30 to the other.
        assert!((70..=76).contains(&first), "{first}");
    }

    #[test]
    fn a_worker_that_ends_its_elements_last_gets_no_contact() {
        assert_eq!(level(&[1.0, 1.0], &[100.0, 110.0], 8.0), 108.0);
        let units: Vec<_> = (0..6).map(|i| unit(i, vec![i as u32], 1)).collect();
        assert_eq!(
            assign(
                &units,
                (&[1; 6], PAIRS),
                Fleet::near(&[1.0, 1.0]),
                &bases(&[100.0, 110.0]),
                (&|_| 1, &own)
            ),
            [0; 6]
        );
    }

    #[test]
    fn a_worker_beside_the_master_leaves_idle_what_a_sort_takes_within_its_lag() {
        // A sort of 350 elements' time in 3.5 cycles of 1,000 elements by speeds of 4: 0.4 of a speed.
        let left = beside_sorts(&[1.0; 4], &[true, false, false, false], 1000.0, 350.0, 4);
        assert!((left[0] - 0.6).abs() < 1e-12 && left[1..] == [1.0; 3], "{left:?}");
        assert_eq!(beside_sorts(&[1.0; 2], &[true; 2], 1000.0, 350.0, 4), [1.0; 2], "all share it");
        assert_eq!(beside_sorts(&[2.0, 1.0], &[true, false], 1.0, 350.0, 4), [0.2, 1.0], "never less");
    }

    #[test]
    fn units_move_to_few_workers_and_not_for_less_than_their_messages_cost() {
        let units: Vec<_> = (0..400).map(|i| unit(i, vec![i as u32, 1000 + i as u32 % 2], 10)).collect();
        let owner = |node: u32| if node >= 1000 { (node - 1000) as usize } else { 0 };
        let receivers = |message: f64, first: f64| {
            let costs = Costs { message, ..PAIRS };
            let work: Vec<f64> = (0..20).map(|w| if w == 0 { first } else { 5000.0 }).collect();
            let chosen =
                assign(&units, (&[10; 400], costs), Fleet::near(&[1.0; 20]), &bases(&work), (&owner, &own));
            chosen.into_iter().filter(|&w| w != 0).collect::<BTreeSet<_>>().len()
        };
        assert_eq!(receivers(0.0, 5000.0), 19, "all share what costs no message");
        let few = receivers(65.0, 5000.0);
        assert!((2..=19).contains(&few), "{few}");
        assert_eq!(receivers(2000.0, 5000.0), 0, "4800 elements of pairs, 8000 of messages");
    }

    #[test]
    fn units_leave_their_region_where_that_gains_more_than_their_bytes_take() {
        let units: Vec<_> = (0..100).map(|i| unit(i, vec![i as u32], 10)).collect();
        // Contact is all in the first of two regions, and one of its two workers owns it.
        let chosen = |byte: f64| {
            let costs = Costs { byte, ..PAIRS };
            let fleet = Fleet { speeds: &[1.0; 4], regions: &[0, 0, 1, 1] };
            let chosen = assign(&units, (&[10; 100], costs), fleet, &bases(&[1e3; 4]), (&|_| 0, &own));
            [0, 1, 2, 3].map(|worker| chosen.iter().filter(|&&w| w == worker).count())
        };
        assert_eq!(chosen(0.0), [25; 4]);
        assert_eq!(chosen(2.0), [50, 50, 0, 0], "960 for the bytes of a unit, and half of all pairs are 600");
        let [one, other, two, three] = chosen(0.01);
        assert!(
            one.abs_diff(other) <= 1 && two > 5 && two < 25 && two.abs_diff(three) <= 1,
            "{:?}",
            [one, other, two, three]
        );
    }

    #[test]
    fn what_a_worker_waits_for_wires_is_no_reason_to_give_units_away_but_one_to_take_none() {
        let units: Vec<_> = (0..100).map(|i| unit(i, vec![i as u32], 10)).collect();
        let taken = |bases: [Base; 2]| {
            let near = Fleet::near(&[1.0; 2]);
            let chosen = assign(&units, (&[10; 100], PAIRS), near, &bases, (&|_| 0, &own));
            chosen.into_iter().filter(|&worker| worker == 1).count()
        };
        let waits = Base { busy: 1000.0, end: 3000.0 };
        assert_eq!(taken([Base::of(1000.0); 2]), 50);
        assert_eq!(taken([waits, Base::of(1000.0)]), 0, "of 2200 until 3000");
        assert_eq!(taken([Base::of(2000.0), waits]), 8, "of 3200 until 3103");
    }

    #[test]
    fn a_unit_stays_where_it_is_if_many_hold_the_nodes_of_its_faces() {
        let owner = |node: u32| node as usize / 100;
        let units: Vec<_> = (0..50).map(|i| unit(i, vec![i as u32], 10)).collect();
        let costs = Costs { message: 65.0, ..PAIRS };
        let given = |nodes: &Nodes<'_>| {
            let work = [1000.0, 400.0, 1600.0, 1600.0, 1600.0, 1600.0];
            let chosen =
                assign(&units, (&[10; 50], costs), Fleet::near(&[1.0; 6]), &bases(&work), (&owner, nodes));
            chosen.into_iter().filter(|&worker| worker == 1).count()
        };
        assert!(given(&own) > 10, "{}", given(&own));
        // Each of four others owns a node of a face.
        let of_faces = |unit: &WorkUnit| vec![unit.nodes[0], 200, 300, 400, 500];
        assert_eq!(given(&of_faces), 0);
    }
}
