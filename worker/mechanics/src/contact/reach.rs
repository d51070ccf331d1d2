//! When a sort is due.
//!
//! The lists of a sort hold every pair that can come within the zone of warning while, for each pair of parts
//! that may meet, nodes have moved against each other by no more than the slack along any axis. Parts that
//! translate together keep their lists for ever, and a part that flies away makes no others sort.

use serde::{Deserialize, Serialize};

use super::Settings;

/// Fraction of the gap that a node may travel in one cycle (the paper's 20 %).
pub const TRAVEL: f64 = 0.2;

/// Smallest and largest displacement, per axis, of the nodes of one part since the positions that were sorted.
///
/// Minima and maxima do not depend on the order of merging. A part without nodes has no extent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Smallest displacement per axis (length).
    pub min: [f64; 3],
    /// Largest displacement per axis (length).
    pub max: [f64; 3],
}

impl Extent {
    /// The extent of no node.
    pub const NONE: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// Takes in the displacement of one node.
    #[inline(always)]
    pub fn add(&mut self, displacement: [f64; 3]) {
        for (a, d) in displacement.into_iter().enumerate() {
            self.min[a] = if d < self.min[a] { d } else { self.min[a] };
            self.max[a] = if d > self.max[a] { d } else { self.max[a] };
        }
    }

    /// Takes in another extent of the same part.
    pub fn merge(&mut self, other: &Self) {
        for a in 0..3 {
            self.min[a] = self.min[a].min(other.min[a]);
            self.max[a] = self.max[a].max(other.max[a]);
        }
    }
}

impl Default for Extent {
    fn default() -> Self {
        Self::NONE
    }
}

/// How far a node of one part and a node of the other can have moved against each other along any axis
/// (length); negative infinity if either part has no nodes.
pub fn spread(a: &Extent, b: &Extent) -> f64 {
    (0..3).map(|i| (a.max[i] - b.min[i]).max(b.max[i] - a.min[i])).fold(f64::NEG_INFINITY, f64::max)
}

/// What the cycles between trigger and sort can add to a spread (length): both nodes travel up to a fifth of
/// the gap in each.
pub fn lag_travel(settings: &Settings, lag: u32) -> f64 {
    2.0 * TRAVEL * settings.gap * f64::from(lag)
}

/// Largest spread of all pairs of parts that may meet (length), and that pair; negative infinity without any.
pub fn worst_spread(extents: &[Extent], settings: &Settings) -> (f64, [u32; 2]) {
    let mut worst = (f64::NEG_INFINITY, [0, 0]);
    for (a, extent) in extents.iter().enumerate() {
        for (b, other) in extents.iter().enumerate().skip(a) {
            let spread = spread(extent, other);
            if spread > worst.0 && settings.meets(a as u32, b as u32) {
                worst = (spread, [a as u32, b as u32]);
            }
        }
    }
    worst
}

/// Whether a sort is due: some pair of parts that may meet has spread so far that, with what the `lag` cycles
/// until the sort acts can add, it would leave the slack. `extents` by part.
///
/// With a slack below [`lag_travel`] every cycle would trigger a sort; `check` refuses such a deck.
pub fn due(extents: &[Extent], settings: &Settings, lag: u32) -> bool {
    worst_spread(extents, settings).0 + lag_travel(settings, lag) > settings.slack
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(interacts: [bool; 4]) -> Settings {
        Settings {
            gap: 0.1,
            slack: 0.25,
            friction: vec![0.0; 4],
            interacts: interacts.to_vec(),
            stiffness: 0.5,
            friction_velocity: 1.0,
            ..Settings::default()
        }
    }

    fn extent(points: &[[f64; 3]]) -> Extent {
        let mut extent = Extent::NONE;
        points.iter().for_each(|&p| extent.add(p));
        extent
    }

    #[test]
    fn bodies_that_translate_together_are_never_due() {
        let both = settings([true; 4]);
        let a = extent(&[[1e3, 2e3, -5.0], [1e3, 2e3, -5.0]]);
        assert!(!due(&[a, a], &both, 2));
        assert_eq!(spread(&a, &a), 0.0);
    }

    #[test]
    fn only_permitted_pairs_trigger_and_the_lag_counts() {
        let still = extent(&[[0.0; 3]]);
        let moved = extent(&[[0.0, -0.18, 0.0]]);
        let apart = settings([true, false, false, true]);
        assert!(!due(&[still, moved], &apart, 2));
        let both = settings([false, true, true, false]);
        assert!(!due(&[still, moved], &both, 1), "0.18 + 0.04 is inside 0.25");
        assert!(due(&[still, moved], &both, 2), "0.18 + 0.08 is outside 0.25");
    }

    #[test]
    fn a_part_without_nodes_is_never_due_and_merging_is_order_free() {
        let both = settings([true; 4]);
        let far = extent(&[[9.0; 3]]);
        assert!(!due(&[Extent::NONE, far], &both, 2));
        let (mut ab, mut ba) = (extent(&[[1.0, -2.0, 3.0]]), extent(&[[-4.0, 5.0, 0.5]]));
        let (a, b) = (ab, ba);
        ab.merge(&b);
        ba.merge(&a);
        assert_eq!(ab, ba);
        assert_eq!(ab, Extent { min: [-4.0, -2.0, 0.5], max: [1.0, 5.0, 3.0] });
    }
}
