//! Balance: work units to workers by speed and ownership, at each sort (paper section 4).
//!
//! A unit weighs its interaction count. It stays with the worker that owns most of its nodes' elements unless that
//! worker has more than its share; then its lightest-bound units go to the workers with the most room. Deterministic.

use mechanics::contact::WorkUnit;

/// How units are dealt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dealing {
    /// To the owner of their nodes while its load allows.
    #[default]
    Owners,
    /// By weight alone, the heaviest first: what a cluster pays for leaving ownership out, in `simulate`.
    Weights,
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

/// How far above its share a worker may be before units move; moving one costs shared nodes in every cycle.
const TOLERANCE: f64 = 0.10;

/// Worker of each unit. `owner` gives the worker that owns a surface node's elements.
pub fn assign(units: &[WorkUnit], speeds: &[f64], owner: &dyn Fn(u32) -> usize) -> Vec<usize> {
    let n = speeds.len();
    if n == 1 {
        return vec![0; units.len()];
    }
    let mut load = vec![0_u64; n];
    let mut chosen = Vec::with_capacity(units.len());
    let mut bound = Vec::with_capacity(units.len());
    let mut count = vec![0_usize; n];
    for unit in units {
        let mut best = usize::MAX;
        for &node in &unit.nodes {
            let w = owner(node);
            count[w] += 1;
            if best == usize::MAX || (count[w], std::cmp::Reverse(w)) > (count[best], std::cmp::Reverse(best))
            {
                best = w;
            }
        }
        let worker = if best == usize::MAX { 0 } else { best };
        bound.push(if best == usize::MAX { 0 } else { count[best] });
        for &node in &unit.nodes {
            count[owner(node)] = 0;
        }
        load[worker] += unit.interactions;
        chosen.push(worker);
    }
    let all: u64 = load.iter().sum();
    let speed: f64 = speeds.iter().sum();
    let share = |w: usize| all as f64 * speeds[w] / speed;
    let mut giving: Vec<usize> =
        (0..units.len()).filter(|&u| load[chosen[u]] as f64 > share(chosen[u]) * (1.0 + TOLERANCE)).collect();
    // Loosely bound units first, the heavier of equals first: fewer moves.
    giving.sort_by_key(|&u| (bound[u], std::cmp::Reverse(units[u].interactions), u));
    for u in giving {
        let from = chosen[u];
        let weight = units[u].interactions;
        if load[from] as f64 <= share(from) * (1.0 + TOLERANCE) {
            continue;
        }
        let room = |w: usize| share(w) - load[w] as f64;
        let to = (0..n).fold(0, |best, w| if room(w) > room(best) { w } else { best });
        if room(to) >= weight as f64 * 0.5 {
            load[from] -= weight;
            load[to] += weight;
            chosen[u] = to;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(i: i32, nodes: Vec<u32>, interactions: u64) -> WorkUnit {
        WorkUnit { cube: [i, 0, 0], nodes, faces: vec![0], interactions }
    }

    #[test]
    fn units_stay_with_the_owner_of_their_nodes_when_loads_fit() {
        let units: Vec<_> = (0..8).map(|i| unit(i, vec![i as u32], 10)).collect();
        let owner = |n: u32| (n % 2) as usize;
        assert_eq!(assign(&units, &[1.0, 1.0], &owner), [0, 1, 0, 1, 0, 1, 0, 1]);
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
        let chosen = assign(&units, &speeds, &|_| 0);
        for (w, s) in speeds.iter().enumerate() {
            let load = chosen.iter().filter(|&&c| c == w).count() as f64;
            let share = 100.0 * s;
            assert!((load - share).abs() <= share * 0.11 + 1.0, "worker {w}: {load} against {share}");
        }
    }
}
