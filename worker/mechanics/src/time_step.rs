//! One step of time, as whatever moves in it sees it.

use crate::{
    exact::{Dithered, Quanta},
    load::{Drive, Loads},
};

/// The step from `t_n` to `t_{n+1}`.
#[derive(Clone, Copy)]
pub struct TimeStep<'a> {
    /// `dt_{n-1}` (time).
    pub dt_previous: f64,
    /// `dt_n` (time).
    pub dt: f64,
    /// `t_n` (time).
    pub time: f64,
    /// `n`.
    pub cycle: u64,
    /// Curves, forces on nodes, gravity, relaxation.
    pub loads: &'a Loads,
    /// Quanta of the sums.
    pub quanta: Quanta,
}

impl TimeStep<'_> {
    /// From `t_{n-1/2}` to `t_{n+1/2}` (time).
    pub fn half_steps(&self) -> f64 {
        0.5 * (self.dt_previous + self.dt)
    }

    /// Share of that time which lies before `t_n`: `v_n = v_{n-1/2} + share (v_{n+1/2} - v_{n-1/2})`.
    pub(crate) fn share_before(&self) -> f64 {
        if self.dt_previous == 0.0 { 0.0 } else { self.dt_previous / (self.dt_previous + self.dt) }
    }

    /// The mean of a load over that time.
    pub(crate) fn mean(&self, drive: &Drive) -> f64 {
        drive.mean_around(&self.loads.curves, self.time, [self.dt_previous, self.dt])
    }

    /// Share of the velocity that relaxation takes.
    pub(crate) fn loss(&self) -> f64 {
        self.loads.loss(self.time, self.half_steps())
    }

    /// The quantum of energy, so that what is booked in each cycle alike is booked whole.
    pub(crate) fn dithered(&self) -> Dithered {
        self.quanta.energy.dithered(self.cycle)
    }
}
