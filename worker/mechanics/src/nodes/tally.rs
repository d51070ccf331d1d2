//! What the nodes of a step say, lane by lane.

use super::{Booked, arrays, splat};
use crate::{element::vector::Vector, lanes::Lane, work::Work};

/// [`Booked`] by lane; lanes join in any way.
pub(super) struct Tally<L> {
    pub kinetic: L,
    pub momentum: Vector<L>,
    pub low: Vector<L>,
    pub high: Vector<L>,
    pub speed_squared: L,
    pub speed_ahead: L,
    /// Work of gravity and relaxation, before `t_n` and after it.
    pub body_work: [L; 2],
    pub external: Work,
    pub closing: f64,
}

impl<L: Lane> Tally<L> {
    #[inline(always)]
    pub fn new() -> Self {
        let zero = L::splat(0.0);
        Self {
            kinetic: zero,
            momentum: splat(0.0),
            low: splat(f64::INFINITY),
            high: splat(f64::NEG_INFINITY),
            speed_squared: zero,
            speed_ahead: zero,
            body_work: [zero; 2],
            external: Work::default(),
            closing: 0.0,
        }
    }

    #[inline(always)]
    pub fn join(&self) -> Booked {
        let mut booked = Booked { external: self.external, closing: self.closing, ..Booked::default() };
        let (kinetic, momentum) = (self.kinetic.to_array(), arrays(&self.momentum));
        let (low, high) = (arrays(&self.low), arrays(&self.high));
        let (squared, ahead) = (self.speed_squared.to_array(), self.speed_ahead.to_array());
        let [before, after] = [self.body_work[0].to_array(), self.body_work[1].to_array()];
        for lane in 0..L::N {
            booked.kinetic += kinetic[lane];
            booked.external.merge(Work { before: before[lane], after: after[lane] });
            for a in 0..3 {
                booked.momentum[a] += momentum[a][lane];
                booked.extent.min[a] = booked.extent.min[a].min(low[a][lane]);
                booked.extent.max[a] = booked.extent.max[a].max(high[a][lane]);
            }
            booked.speed_squared = booked.speed_squared.max(squared[lane]);
            booked.speed_ahead = booked.speed_ahead.max(ahead[lane]);
        }
        booked
    }
}
