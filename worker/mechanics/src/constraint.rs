//! What a mesh asks of single nodes: supports, walls, forces.

use serde::{Deserialize, Serialize};

use crate::{
    load::{Curve, Drive, Span},
    vectors::{cross, dot, minus, turn, turned},
};

/// What acts on a node alone: prescribed velocities, walls, forces. A node's constraint is the same on every holder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Constraint {
    /// Prescribed velocity by axis x, y, z (length per time); `None` is free, a constant 0 is fixed, and one
    /// fixed axis is a symmetry plane.
    pub velocity: [Option<Drive>; 3],
    /// Walls that the node feels, one bit per entry of [`crate::setup::Setup::walls`]. Decks give it for walls that name nodes; the
    /// start of a run adds the walls that name parts ([`crate::initial::bind_walls`]).
    pub walls: u32,
    /// Forces on the node, one bit per entry of [`crate::load::Loads::forces`].
    pub forces: u32,
    /// Axes about which a node of shells does not turn: bit 0 is x.
    pub clamped: u8,
    /// When it does not.
    pub clamp_span: Span,
    /// A circle that the node follows, which leaves it free along the axis. A node of shells or beams turns with it.
    pub circle: Option<Circle>,
    /// By axis the number of the support that prescribes the velocity, from 1; 0 is none whose force is wanted.
    pub supports: [u8; 3],
}

impl Default for Constraint {
    /// A node that nothing acts on.
    fn default() -> Self {
        Self {
            velocity: [None; 3],
            walls: 0,
            forces: 0,
            clamped: 0,
            clamp_span: Span::ALWAYS,
            circle: None,
            supports: [0; 3],
        }
    }
}

impl Constraint {
    /// Whether walls are all that may act on the node's velocity.
    pub(crate) fn is_of_walls(&self) -> bool {
        self.forces == 0 && self.velocity.iter().all(Option::is_none) && self.circle.is_none()
    }

    /// The rotation rate that is prescribed to a node of shells or beams in the step `dt` from `time` on, by axis: zero about those that are
    /// clamped in its middle, and about the axis of a circle that of the circle.
    ///
    /// # Panics
    /// If a curve is not there.
    pub fn spin(&self, curves: &[Curve], time: f64, dt: f64) -> [Option<f64>; 3] {
        let mut spin = [None; 3];
        if let Some(circle) = self.circle {
            let rate = circle.rate.prescribed_for(curves, time, dt);
            spin[usize::from(circle.axis)] = rate.map(|rate| circle.chord_rate(rate, dt));
        }
        if self.clamp_span.holds(0.5f64.mul_add(dt, time)) {
            for axis in (0..3).filter(|axis| self.clamped >> axis & 1 == 1) {
                spin[axis] = Some(0.0);
            }
        }
        spin
    }

    /// The velocity that is prescribed in the step `dt` from `time` on to a node at `x`, by axis.
    ///
    /// # Panics
    /// If a curve is not there.
    pub fn prescribed(&self, curves: &[Curve], x: [f64; 3], time: f64, dt: f64) -> [Option<f64>; 3] {
        let of = |drive: Drive| drive.prescribed_for(curves, time, dt);
        let mut velocity = self.velocity.map(|drive| of(drive?));
        let turned = self.circle.and_then(|circle| Some((circle, of(circle.rate)?)));
        if let Some((circle, rate)) = turned {
            let along = circle.velocity(rate, x, dt);
            for axis in (0..3).filter(|&axis| axis != usize::from(circle.axis)) {
                velocity[axis] = Some(along[axis]);
            }
        }
        velocity
    }
}

/// A turn about an axis of the deck through a point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Circle {
    /// 0 to 2: along x, y or z.
    pub axis: u8,
    /// A point of the axis (length).
    pub point: [f64; 3],
    /// Angular velocity (radians per time).
    pub rate: Drive,
}

impl Circle {
    /// How fast its chords turn over a step `dt` (radians per time), `2 tan(rate dt/2)/dt`: the spin that an element sees in the middle of the step
    /// whose nodes all go along theirs.
    pub fn chord_rate(&self, rate: f64, dt: f64) -> f64 {
        if dt == 0.0 {
            return rate;
        }
        let axis = usize::from(self.axis);
        let (mut spin, mut before) = ([0.0; 3], [0.0; 3]);
        spin[axis] = rate;
        before[(axis + 1) % 3] = 1.0;
        let after = turned(&turn(&[1.0, 0.0, 0.0, 0.0], spin, dt), before);
        let twice_middle: [f64; 3] = std::array::from_fn(|a| after[a] + before[a]);
        2.0 * cross(twice_middle, minus(after, before))[axis] / (dot(twice_middle, twice_middle) * dt)
    }

    /// The velocity that takes a point at `x` along its circle in a step `dt`: the chord over the step.
    pub fn velocity(&self, rate: f64, x: [f64; 3], dt: f64) -> [f64; 3] {
        let axis = usize::from(self.axis);
        let mut spin = [0.0; 3];
        spin[axis] = rate;
        let mut arm: [f64; 3] = std::array::from_fn(|a| x[a] - self.point[a]);
        arm[axis] = 0.0;
        if dt == 0.0 {
            return cross(spin, arm);
        }
        let after = turned(&turn(&[1.0, 0.0, 0.0, 0.0], spin, dt), arm);
        std::array::from_fn(|a| (after[a] - arm[a]) / dt)
    }
}

/// Highest number of a support whose force is booked.
pub const MAX_SUPPORTS: u8 = 64;

/// Most walls in a run: one bit each in [`Constraint::walls`].
pub const MAX_WALLS: usize = 32;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chords_turn_by_twice_the_tangent_of_half_the_angle() {
        for (axis, rate, dt) in [(0, 3.0, 0.1), (1, -2.0, 0.7), (2, 1e4, 1e-6)] {
            let circle = Circle { axis, point: [1e3, 0.0, 0.0], rate: Drive::constant(rate) };
            let wanted = 2.0 * (0.5 * rate * dt).tan() / dt;
            assert!((circle.chord_rate(rate, dt) / wanted - 1.0).abs() < 1e-12, "{rate} {dt}");
            assert_eq!(circle.chord_rate(rate, 0.0), rate);
        }
    }

    #[test]
    fn a_node_on_a_circle_stays_on_it_whatever_the_step() {
        let circle = Circle { axis: 2, point: [1.0, -2.0, 7.0], rate: Drive::constant(3.0) };
        let held = Constraint { circle: Some(circle), ..Constraint::default() };
        let mut x = [5.0, 1.0, 0.0];
        for dt in [0.1, 0.7, 1e-3] {
            let [vx, vy, vz] = held.prescribed(&[], x, 0.0, dt);
            assert_eq!(vz, None);
            x = [x[0] + dt * vx.expect("prescribed"), x[1] + dt * vy.expect("prescribed"), 0.0];
        }
        let angle = 3.0f64.atan2(4.0) + 3.0 * 0.801;
        let wanted = [1.0 + 5.0 * angle.cos(), -2.0 + 5.0 * angle.sin()];
        assert!((x[0] - wanted[0]).abs() < 1e-13 && (x[1] - wanted[1]).abs() < 1e-13, "{x:?} {wanted:?}");
        assert_eq!(circle.velocity(3.0, [5.0, 1.0, 0.0], 0.0), [-9.0, 12.0, 0.0]);
    }
}
