//! Kinetic energy of nodes, and work that is done on them from outside.
//!
//! Velocities are those of half steps, and energies are booked at `t_n`. Of the time from `t_{n-1/2}` to `t_{n+1/2}` the share
//! `s = dt_{n-1} / (dt_{n-1} + dt_n)` lies before `t_n`, so the forces at `t_n` have done `s J . v_{n-1/2}` until then, with the impulse
//! `J = m (v_{n+1/2} - v_{n-1/2})`. The kinetic energy at `t_n` is therefore that of `v_{n-1/2}` and this work:
//!
//! `1/2 m v_{n-1/2} . (v_{n-1/2} + 2 s (v_{n+1/2} - v_{n-1/2}))`, which is `1/2 m v_{n-1/2} . v_{n+1/2}` where steps are equal.
//!
//! From `t_{n-1}` to `t_n` it changes by the work of the mean force on the way between them, but for
//! `1/4 F_{n-1} . (v_{n-1/2} - v_{n-3/2}) (dt_{n-2} - dt_{n-1})`, of second order in the step.

use serde::{Deserialize, Serialize};

use crate::{
    exact::Dithered,
    lanes::{Lane, scalar::Scalar},
};

/// Parts of the work of an impulse before and after `t_n`, from its products with the velocities before and after it.
#[inline(always)]
pub(crate) fn halves<L: Lane>([with_old, with_new]: [L; 2], share_before: f64) -> [L; 2] {
    let before = L::splat(share_before) * with_old;
    [before, L::splat(0.5) * (with_old + with_new) - before]
}

/// Work done from outside by the impulses of one cycle, which act at `t_n`; exact sums.
///
/// An impulse `J` takes a node from `v_{n-1/2}` to `v_{n+1/2}`, so its work is `J . (v_{n-1/2} + v_{n+1/2}) / 2`. Only the share that
/// belongs to the kinetic energy at `t_n` is done by then; the rest follows with the motion from `x_n` to `x_{n+1}`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// `s J . v_{n-1/2}`: part of the work up to `t_n`, nothing at the start of a run.
    pub before: f64,
    /// The rest: part of the work up to `t_{n+1}`.
    pub after: f64,
}

impl Work {
    /// Work of an impulse, from its products with the velocities before and after it.
    pub(crate) fn of(products: [f64; 2], share_before: f64, quantum: Dithered) -> Self {
        let [before, after] = halves(products.map(Scalar), share_before).map(|part| quantum.round(part.0));
        Self { before, after }
    }

    /// Adds the work of other impulses of the cycle.
    pub fn merge(&mut self, other: Self) {
        self.before += other.before;
        self.after += other.after;
    }

    /// Both parts.
    pub fn whole(self) -> f64 {
        self.before + self.after
    }
}
