//! Work that is done from outside on nodes.

use serde::{Deserialize, Serialize};

/// Work done from outside by the impulses of one cycle, which act at `t_n`; exact sums.
///
/// An impulse `J` takes a node from `v_{n-1/2}` to `v_{n+1/2}`, so its work is `J . (v_{n-1/2} + v_{n+1/2}) / 2`. Only the
/// first half of it is done at `t_n`, where the kinetic energy `1/2 m v_{n-1/2} . v_{n+1/2}` and the internal energy stand;
/// the second half follows with the motion from `x_n` to `x_{n+1}`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// `J . v_{n-1/2} / 2`: part of the work up to `t_n`.
    pub before: f64,
    /// `J . v_{n+1/2} / 2`: part of the work up to `t_{n+1}`.
    pub after: f64,
}

impl Work {
    /// Adds the work of other impulses of the cycle.
    pub fn merge(&mut self, other: Self) {
        self.before += other.before;
        self.after += other.after;
    }

    /// Puts off what the impulses at the start of a run do: no time has passed before them.
    pub fn put_off(&mut self) {
        *self = Self { before: 0.0, after: self.whole() };
    }

    /// Both halves.
    pub fn whole(self) -> f64 {
        self.before + self.after
    }
}
