//! What acts on bodies from outside beside walls: curves of time, nodal forces, gravity, loads on faces, relaxation.
//!
//! Velocities are prescribed for a step, forces act at its start, as central differences have them; both are means over the time for
//! which they stand, so that a pulse gives its impulse and a motion its way however long the steps are. Pressures on faces and blasts, which
//! have to be known before the step is, take the last step for the next. Forces on nodes, gravity and relaxation are put in where nodes
//! are integrated (`nodes.rs`), alike on every holder of a node; loads on faces are nodal forces of the block that has the element
//! (`load/face.rs`), rounded like its corner forces.

pub mod blast;
pub(crate) mod face;
pub mod moving;

use serde::{Deserialize, Serialize};

/// A tabulated function of time: straight lines between its points, constant before the first and after the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Time and value, at least one; times ascend.
    pub points: Vec<[f64; 2]>,
}

impl Curve {
    pub fn at(&self, time: f64) -> f64 {
        let after = self.points.partition_point(|p| p[0] <= time);
        match (after.checked_sub(1).map(|i| self.points[i]), self.points.get(after)) {
            (None, None) => 0.0,
            (Some(point), None) => point[1],
            (None, Some(point)) => point[1],
            (Some([t0, y0]), Some([t1, y1])) => (time - t0).mul_add((y1 - y0) / (t1 - t0), y0),
        }
    }

    /// The integral from zero to a time, exact for the straight lines.
    pub fn integral(&self, time: f64) -> f64 {
        self.since_first(time) - self.since_first(0.0)
    }

    /// The integral from the first point to a time.
    fn since_first(&self, time: f64) -> f64 {
        let Some(first) = self.points.first() else { return 0.0 };
        if time <= first[0] {
            return (time - first[0]) * first[1];
        }
        let mut sum = 0.0;
        let mut from = *first;
        for &point in &self.points[1..] {
            if point[0] >= time {
                break;
            }
            sum = ((point[0] - from[0]) * 0.5).mul_add(from[1] + point[1], sum);
            from = point;
        }
        ((time - from[0]) * 0.5).mul_add(from[1] + self.at(time), sum)
    }

    /// The mean from a time on until a later one, exact for the straight lines.
    pub fn mean(&self, from: f64, until: f64) -> f64 {
        let first = self.points.partition_point(|p| p[0] <= from);
        if self.points.get(first).is_none_or(|p| p[0] >= until) {
            return self.at(0.5 * (from + until));
        }
        let (mut sum, mut last) = (0.0, [from, self.at(from)]);
        let mut add = |[time, value]: [f64; 2]| {
            sum += 0.5 * (time - last[0]) * (last[1] + value);
            last = [time, value];
        };
        self.points[first..].iter().take_while(|p| p[0] < until).for_each(|&point| add(point));
        add([until, self.at(until)]);
        sum / (until - from)
    }

    /// The least and the greatest value from a time on until another.
    pub fn range(&self, from: f64, until: f64) -> [f64; 2] {
        let ends = [self.at(from), self.at(until)];
        let inside = self.points.iter().filter(|p| from < p[0] && p[0] < until).map(|p| p[1]);
        inside.fold([ends[0].min(ends[1]), ends[0].max(ends[1])], |[low, high], y| [low.min(y), high.max(y)])
    }

    /// The greatest magnitude.
    pub fn greatest(&self) -> f64 {
        self.points.iter().map(|p| p[1].abs()).fold(0.0, f64::max)
    }
}

/// A stretch of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// It begins at this time, 0 or later (time).
    pub from: f64,
    /// It is over at this time (time).
    pub until: f64,
}

impl Span {
    /// From the start of a run to its end.
    pub const ALWAYS: Self = Self { from: 0.0, until: f64::MAX };

    /// Whether a time is in it.
    pub fn holds(&self, time: f64) -> bool {
        self.from <= time && time < self.until
    }

    /// Whether no time is in both.
    pub fn is_apart_from(&self, other: &Self) -> bool {
        self.until <= other.from || other.until <= self.from
    }
}

/// A number that may follow a curve, and when it acts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// The number, or what the curve is multiplied by.
    pub factor: f64,
    /// Index into [`Loads::curves`]; none for a constant.
    pub curve: Option<u32>,
    /// When it acts: a load is zero at other times, and a prescribed velocity then leaves its node free.
    pub span: Span,
}

impl Drive {
    /// The same number all along.
    pub const fn constant(factor: f64) -> Self {
        Self { factor, curve: None, span: Span::ALWAYS }
    }

    /// A curve times a factor, all along.
    pub const fn along(curve: u32, factor: f64) -> Self {
        Self { factor, curve: Some(curve), span: Span::ALWAYS }
    }

    /// Whether it acts at a time.
    pub fn acts(&self, time: f64) -> bool {
        self.span.holds(time)
    }

    /// The value at a time; zero where it does not act.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn at(&self, curves: &[Curve], time: f64) -> f64 {
        if !self.acts(time) {
            return 0.0;
        }
        self.curve.map_or(self.factor, |c| self.factor * curves[c as usize].at(time))
    }

    /// The mean from a time on until another, with zeros for the times at which it does not act.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn mean(&self, curves: &[Curve], from: f64, until: f64) -> f64 {
        if until <= from {
            return self.at(curves, from);
        }
        let (begins, ends) = (from.max(self.span.from), until.min(self.span.until));
        if ends <= begins {
            return 0.0;
        }
        let mean = self.factor * self.curve.map_or(1.0, |c| curves[c as usize].mean(begins, ends));
        if (begins, ends) == (from, until) { mean } else { mean * ((ends - begins) / (until - from)) }
    }

    /// The mean of a force that acts at a time, from the middle of the step before it to the middle of that after it.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn mean_around(&self, curves: &[Curve], time: f64, [before, after]: [f64; 2]) -> f64 {
        self.mean(curves, (-0.5f64).mul_add(before, time), 0.5f64.mul_add(after, time))
    }

    /// The value at a time at which it acts; none at others.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn prescribed(&self, curves: &[Curve], time: f64) -> Option<f64> {
        self.acts(time).then(|| self.at(curves, time))
    }

    /// The value for a step `dt` from a time on: where it acts in the middle, its mean over what the step has of its span. A span that is
    /// shorter than the step acts in the step that has its middle: whoever is free afterwards goes on as fast.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn prescribed_for(&self, curves: &[Curve], time: f64, dt: f64) -> Option<f64> {
        let Span { from, until } = self.span;
        let end = time + dt;
        let (acts, begins, ends) = if from < until && until - from < dt {
            ((time..end).contains(&(0.5 * (from + until))), from, until)
        } else {
            (self.acts(0.5f64.mul_add(dt, time)), time.max(from), end.min(until))
        };
        acts.then(|| self.factor * self.curve.map_or(1.0, |c| curves[c as usize].mean(begins, ends)))
    }

    /// The least and the greatest value from a time on until another, of the times at which it acts; none if it acts at none.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn range(&self, curves: &[Curve], from: f64, until: f64) -> Option<[f64; 2]> {
        let (from, until) = (from.max(self.span.from), until.min(self.span.until));
        let [low, high] = match self.curve {
            _ if from > until => return None,
            Some(c) => curves[c as usize].range(from, until).map(|y| self.factor * y),
            None => [self.factor; 2],
        };
        Some([low.min(high), low.max(high)])
    }

    /// The integral from zero to a time, over the times at which it acts.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn integral(&self, curves: &[Curve], time: f64) -> f64 {
        let to = |time: f64| self.curve.map_or(time, |c| curves[c as usize].integral(time));
        let within = |time: f64| time.min(self.span.until).max(self.span.from);
        self.factor * (to(within(time)) - to(within(0.0)))
    }

    /// The greatest magnitude.
    ///
    /// # Panics
    /// If there is no such curve.
    pub fn greatest(&self, curves: &[Curve]) -> f64 {
        self.factor.abs() * self.curve.map_or(1.0, |c| curves[c as usize].greatest())
    }
}

/// All of them; none by default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Loads {
    /// Curves that the others name.
    pub curves: Vec<Curve>,
    /// Forces on single nodes; a node's constraint says which it feels.
    pub forces: Vec<NodalForce>,
    /// Gravity, on every node.
    pub gravity: Option<Gravity>,
    /// Loads on faces.
    pub surfaces: Vec<SurfaceLoad>,
    /// Charges that explode in air, which loads on faces name.
    pub charges: Vec<blast::Charge>,
    /// Pressures that move, which loads on faces name.
    pub moving: Vec<moving::MovingPressure>,
    /// Dynamic relaxation.
    pub relaxation: Option<Relaxation>,
}

impl Loads {
    /// Whether anything pushes: forces, gravity, pressure or blast.
    pub(crate) fn are_any(&self) -> bool {
        let pushes = |surface: &SurfaceLoad| !matches!(surface.kind, SurfaceKind::Transmit);
        !self.forces.is_empty() || self.gravity.is_some() || self.surfaces.iter().any(pushes)
    }
}

/// Most nodal forces in a run: one bit each in [`crate::constraint::Constraint::forces`].
pub const MAX_FORCES: usize = 32;

/// A force on each of some nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodalForce {
    /// Force on one node (force); of a force by mass, the acceleration (length per time squared).
    pub force: [f64; 3],
    /// Whether it is multiplied by the mass of the node.
    pub by_mass: bool,
    /// What it is multiplied by.
    pub drive: Drive,
}

/// An acceleration of everything.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gravity {
    /// Acceleration (length per time squared).
    pub acceleration: [f64; 3],
    /// What it is multiplied by.
    pub drive: Drive,
}

/// A load on faces of elements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceLoad {
    /// What acts.
    pub kind: SurfaceKind,
    /// Global element index and [side](crate::mesh::Part::side) of the element.
    pub faces: Vec<(u32, u8)>,
}

/// What acts on a face.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SurfaceKind {
    /// A pressure against the face as it is turned now (stress, positive pushes).
    Pressure(Drive),
    /// The pressure of a charge that explodes in air, by its index in [`Loads::charges`].
    Blast(u32),
    /// A pressure that moves over the faces, by its index in [`Loads::moving`].
    Moving(u32),
    /// Dampers that take up plane waves which leave through the face (Lysmer and Kuhlemeyer 1969): traction
    /// `-rho (c_l v_n n + c_s v_t)` with the wave speeds of the material at rest.
    Transmit,
}

/// Velocities die away, so that a structure comes to rest under its loads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Relaxation {
    /// What velocities are multiplied by in each cycle, from 0 to 1.
    pub factor: f64,
    /// Damping by mass, `-rate m v` (1/time).
    pub rate: f64,
    /// Acts before this time (time).
    pub until: f64,
}

impl Loads {
    /// Share of the velocity that relaxation takes at a time, where velocities before and after are `half_steps` apart (time). The
    /// force of the rate is that of the mean of both, so no rate turns a velocity around.
    pub fn loss(&self, time: f64, half_steps: f64) -> f64 {
        let Some(Relaxation { factor, rate, .. }) = self.relaxation.filter(|r| time < r.until) else {
            return 0.0;
        };
        let half = 0.5 * rate * half_steps;
        1.0 - factor * ((1.0 - half).max(0.0) / (1.0 + half))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_straight_between_its_points_and_constant_outside() {
        let curve = Curve { points: vec![[1.0, 2.0], [3.0, 6.0], [4.0, -1.0]] };
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0, 3.5, 4.0, 9.0].map(|t| curve.at(t)),
            [2.0, 2.0, 4.0, 6.0, 2.5, -1.0, -1.0]
        );
        assert_eq!(curve.greatest(), 6.0);
    }

    #[test]
    fn the_integral_of_a_curve_is_that_of_its_lines() {
        let curve = Curve { points: vec![[1.0, 2.0], [3.0, 6.0], [4.0, -1.0]] };
        let exact = [
            (0.0, 0.0),
            (0.5, 1.0),
            (1.0, 2.0),
            (2.0, 5.0),
            (3.0, 10.0),
            (4.0, 12.5),
            (6.0, 10.5),
            (-1.0, -2.0),
        ];
        for (time, expected) in exact {
            assert!((curve.integral(time) - expected).abs() < 1e-14, "{time}: {}", curve.integral(time));
        }
        let curves = [curve];
        let drive = Drive::along(0, -2.0);
        assert_eq!(
            (drive.at(&curves, 2.0), drive.integral(&curves, 3.0), drive.greatest(&curves)),
            (-8.0, -20.0, 12.0)
        );
        let constant = Drive::constant(3.0);
        assert_eq!(
            (constant.at(&[], 9.0), constant.integral(&[], 2.0), constant.greatest(&[])),
            (3.0, 6.0, 3.0)
        );
    }

    #[test]
    fn a_mean_is_the_integral_over_the_time_however_many_points_lie_between() {
        let curves = [Curve { points: vec![[1.0, 2.0], [3.0, 6.0], [4.0, -1.0]] }];
        let drive = Drive { span: Span { from: 0.5, until: 3.5 }, ..Drive::along(0, 2.0) };
        for (from, until) in
            [(0.0, 0.4), (0.0, 1.0), (1.5, 2.0), (0.7, 3.2), (2.0, 9.0), (0.0, 9.0), (3.5, 4.0)]
        {
            let expected = (drive.integral(&curves, until) - drive.integral(&curves, from)) / (until - from);
            let found = drive.mean(&curves, from, until);
            assert!((found - expected).abs() < 1e-14, "{from} to {until}: {found}, expected {expected}");
        }
        assert_eq!(drive.mean(&curves, 2.0, 2.0), 8.0);
        assert_eq!(Drive::constant(0.1).mean(&[], 0.3, 0.7), 0.1, "to the bit");
    }

    #[test]
    fn what_is_prescribed_for_a_step_is_the_mean_of_what_the_step_has_of_its_span() {
        let curves = [Curve { points: vec![[0.0, 0.0], [1.0, 4.0], [2.0, 0.0]] }];
        let whole = Drive::along(0, 1.0);
        // A triangle within a step, and one of which a step sees the half.
        assert_eq!(whole.prescribed_for(&curves, 0.0, 4.0), Some(1.0));
        assert_eq!(whole.prescribed_for(&curves, 1.0, 2.0), Some(1.0));
        let spanned = Drive { span: Span { from: 1.0, until: 2.0 }, ..whole };
        assert_eq!(
            [(0.0, 1.5), (0.0, 2.0), (1.5, 2.0)].map(|(t, dt)| spanned.prescribed_for(&curves, t, dt)),
            [None, Some(2.0), Some(2.0)],
            "a short span acts in the step of its middle"
        );
        assert_eq!(spanned.prescribed_for(&curves, 0.5, 2.0), Some(2.0), "within the step");
        let thirds = [0.0, 0.4, 0.8, 1.2, 1.6, 2.0].map(|t| spanned.prescribed_for(&curves, t, 0.4));
        assert_eq!(thirds.map(|value| value.is_some()), [false, false, true, true, true, false]);
    }

    #[test]
    fn a_drive_acts_from_the_start_of_its_span_until_the_end_of_it() {
        let curves = [Curve { points: vec![[1.0, 2.0], [3.0, 6.0], [4.0, -1.0]] }];
        let drive = Drive { span: Span { from: 1.0, until: 3.0 }, ..Drive::along(0, 2.0) };
        assert_eq!([0.5, 1.0, 2.0, 3.0].map(|t| drive.at(&curves, t)), [0.0, 4.0, 8.0, 0.0]);
        assert_eq!([0.5, 2.0, 3.0].map(|t| drive.prescribed(&curves, t)), [None, Some(8.0), None]);
        // Twice the area from 1 on, and none after 3.
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0, 9.0].map(|t| drive.integral(&curves, t)),
            [0.0, 0.0, 6.0, 16.0, 16.0]
        );
        let other = Span { from: 3.0, until: 4.0 };
        assert!(drive.span.is_apart_from(&other) && other.is_apart_from(&drive.span));
        assert!(!drive.span.is_apart_from(&Span::ALWAYS));
        let falling = Drive { factor: -2.0, ..drive };
        let ranges = [(0.0, 0.5), (0.0, 2.0), (2.0, 9.0), (3.5, 9.0)];
        assert_eq!(
            ranges.map(|(from, until)| falling.range(&curves, from, until)),
            [None, Some([-8.0, -4.0]), Some([-12.0, -8.0]), None]
        );
        assert_eq!(curves[0].range(2.0, 3.5), [2.5, 6.0], "a peak between");
    }
}
