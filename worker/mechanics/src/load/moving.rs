//! Pressure that moves over faces: that of a jet or a rolling load, by the distance from an axis which moves.
//!
//! The axis keeps its direction and goes through a centre whose place is known at any time. Each face is integrated by points of Gauss in its plane, so that
//! a patch may be of the size of a face. Nothing casts a shadow: every face of the load within the radius is pressed.

use serde::{Deserialize, Serialize};

use super::{Curve, Drive};
use crate::{
    element::shell4::Rule,
    vectors::{cross, dot, minus},
};

/// A pressure about an axis that moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MovingPressure {
    /// The pressure (stress); where there is a profile, that is multiplied by it.
    pub pressure: Drive,
    /// Pressure, or its share, over the distance from the axis: index into [`Loads::curves`](super::Loads::curves); none where it is the same all over.
    pub profile: Option<u32>,
    /// Distance from the axis beyond which nothing acts (length).
    pub radius: f64,
    /// Direction of the axis, of length 1.
    pub axis: [f64; 3],
    /// The way of a point of the axis.
    pub path: Path,
    /// Points of integration along each side of a face, 1 to 5.
    pub points: u32,
}

/// Where a point is at any time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Path {
    /// From a place at time zero (length) by velocities along x, y, z.
    Velocity { start: [f64; 3], velocity: [Option<Drive>; 3] },
    /// Time, x, y, z, at least one; times ascend. It goes straight from one to the next, and rests before the first and after the last.
    Places(Vec<[f64; 4]>),
}

impl Path {
    fn at(&self, curves: &[Curve], time: f64) -> [f64; 3] {
        match self {
            Self::Velocity { start, velocity } => std::array::from_fn(|a| {
                start[a] + velocity[a].map_or(0.0, |velocity| velocity.integral(curves, time))
            }),
            Self::Places(places) => {
                let after = places.partition_point(|place| place[0] <= time);
                let place = |[_, x, y, z]: [f64; 4]| [x, y, z];
                match (after.checked_sub(1).map(|i| places[i]), places.get(after)) {
                    (None, None) => [0.0; 3],
                    (Some(last), None) => place(last),
                    (None, Some(first)) => place(*first),
                    (Some(from), Some(to)) => {
                        let share = (time - from[0]) / (to[0] - from[0]);
                        std::array::from_fn(|a| share.mul_add(to[a + 1] - from[a + 1], from[a + 1]))
                    }
                }
            }
        }
    }
}

impl MovingPressure {
    /// The greatest magnitude.
    pub(crate) fn greatest(&self, curves: &[Curve]) -> f64 {
        self.pressure.greatest(curves) * self.profile.map_or(1.0, |c| curves[c as usize].greatest())
    }

    /// What it is at a time, with this [pressure](Self::pressure).
    pub(super) fn at<'l>(&'l self, curves: &'l [Curve], pressure: f64, time: f64) -> Moment<'l> {
        Moment {
            load: self,
            pressure,
            profile: self.profile.map(|c| &curves[c as usize]),
            centre: self.path.at(curves, time),
            points: Rule::Gauss(self.points).points().unwrap_or_default(),
        }
    }
}

/// A pressure that moves, at one time.
pub(super) struct Moment<'l> {
    load: &'l MovingPressure,
    pressure: f64,
    profile: Option<&'l Curve>,
    /// A point of the axis.
    centre: [f64; 3],
    /// Place from -1 to 1 and weight of each point along a side.
    points: Vec<(f64, f64)>,
}

impl Moment<'_> {
    /// Forces on the corners of a bilinear face at `x`: `-integral of N_I p n dA`.
    pub(super) fn forces(&self, x: &[[f64; 3]; 4]) -> [[f64; 3]; 4] {
        let mut forces = [[0.0; 3]; 4];
        let middle = std::array::from_fn(|a| 0.25 * ((x[0][a] + x[1][a]) + (x[2][a] + x[3][a])));
        let to_corner = |corner: &[f64; 3]| {
            let way = minus(*corner, middle);
            dot(way, way)
        };
        let reach = x.iter().map(to_corner).fold(0.0, f64::max).sqrt();
        if self.pressure == 0.0 || self.distance(middle) > self.load.radius + reach {
            return forces;
        }
        let [along_i, across_i] = [minus(x[1], x[0]), minus(x[2], x[3])];
        let [along_j, across_j] = [minus(x[3], x[0]), minus(x[2], x[1])];
        for &(t, of_row) in &self.points {
            for &(s, of_point) in &self.points {
                let shapes = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                    .map(|(a, b)| 0.25 * (1.0 + a * s) * (1.0 + b * t));
                let place = std::array::from_fn(|a| {
                    (shapes[0] * x[0][a] + shapes[1] * x[1][a]) + (shapes[2] * x[2][a] + shapes[3] * x[3][a])
                });
                let distance = self.distance(place);
                if distance > self.load.radius {
                    continue;
                }
                let pressure = self.pressure * self.profile.map_or(1.0, |profile| profile.at(distance));
                let mean = |share: f64, near: [f64; 3], far: [f64; 3]| {
                    std::array::from_fn(|a| 0.5 * ((1.0 - share) * near[a] + (1.0 + share) * far[a]))
                };
                // Weights sum to 1, so this is the area that belongs to the point.
                let area = cross(mean(t, along_i, across_i), mean(s, along_j, across_j));
                for (force, shape) in forces.iter_mut().zip(shapes) {
                    let share = shape * (of_row * of_point) * pressure;
                    (0..3).for_each(|a| force[a] -= share * area[a]);
                }
            }
        }
        forces
    }

    /// Distance of a point from the axis.
    fn distance(&self, point: [f64; 3]) -> f64 {
        let way = minus(point, self.centre);
        let along = dot(way, self.load.axis);
        let off: [f64; 3] = std::array::from_fn(|a| way[a] - along * self.load.axis[a]);
        dot(off, off).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A load whose pressure is that of a time.
    fn moment<'l>(load: &'l MovingPressure, curves: &'l [Curve], time: f64) -> Moment<'l> {
        load.at(curves, load.pressure.at(curves, time), time)
    }

    fn jet(path: Path) -> MovingPressure {
        MovingPressure {
            pressure: Drive::constant(3.0),
            profile: None,
            radius: 1e3,
            axis: [0.0, 0.0, 1.0],
            path,
            points: 3,
        }
    }

    /// Along y at 2 after a wait, then along x.
    fn way() -> Path {
        Path::Places(vec![[1.0, 0.0, 0.0, 5.0], [2.0, 0.0, 2.0, 5.0], [4.0, 6.0, 2.0, 5.0]])
    }

    #[test]
    fn a_path_goes_straight_between_its_places_and_by_its_velocities() {
        let at = |path: &Path, time| path.at(&[Curve { points: vec![[0.0, 0.0], [2.0, 4.0]] }], time);
        let found = [0.0, 1.5, 3.0, 9.0].map(|time| at(&way(), time));
        assert_eq!(found, [[0.0, 0.0, 5.0], [0.0, 1.0, 5.0], [3.0, 2.0, 5.0], [6.0, 2.0, 5.0]]);
        let velocity = [Some(Drive::along(0, 2.0)), None, Some(Drive::constant(-1.0))];
        let driven = Path::Velocity { start: [1.0, 2.0, 3.0], velocity };
        assert_eq!(
            [0.0, 1.0, 3.0].map(|time| at(&driven, time)),
            [[1.0, 2.0, 3.0], [3.0, 2.0, 2.0], [17.0, 2.0, 0.0]]
        );
    }

    #[test]
    fn a_pressure_that_covers_a_face_is_a_plain_one_on_it() {
        let x = [[0.0, 0.0, 0.1], [1.0, 0.1, 0.0], [1.3, 1.2, 0.2], [-0.1, 0.9, 0.0]];
        for points in 2..=5 {
            let load = MovingPressure { points, ..jet(way()) };
            let forces = moment(&load, &[], 0.5).forces(&x);
            for (force, area) in forces.iter().zip(super::super::face::corner_areas(x)) {
                assert!((0..3).all(|a| (force[a] + 3.0 * area[a]).abs() < 1e-15), "{points}: {forces:?}");
            }
        }
    }

    #[test]
    fn a_cone_of_pressure_has_the_force_of_its_volume_wherever_it_is() {
        // Many faces under a cone of height 3 over a radius of 1: pi R^2 h / 3.
        let curves = [Curve { points: vec![[0.0, 1.0], [1.0, 0.0]] }];
        let load = MovingPressure { profile: Some(0), radius: 1.0, ..jet(way()) };
        for time in [1.0, 2.7, 3.3] {
            let moment = moment(&load, &curves, time);
            let mut sum = [0.0; 3];
            let side = 0.05;
            for i in -40..180 {
                for j in -40..80 {
                    let [a, b] = [i, j].map(|n| side * f64::from(n));
                    let x = [[a, b, 0.0], [a + side, b, 0.0], [a + side, b + side, 0.0], [a, b + side, 0.0]];
                    let forces = moment.forces(&x);
                    forces.iter().for_each(|force| (0..3).for_each(|a| sum[a] += force[a]));
                }
            }
            assert!((sum[2] + std::f64::consts::PI).abs() < 1e-3, "{sum:?} at {time}");
            assert!(sum[0].abs() < 1e-12 && sum[1].abs() < 1e-12, "{sum:?}");
        }
    }

    #[test]
    fn beyond_the_radius_and_before_it_acts_nothing_is_pressed() {
        let x = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let near = MovingPressure { radius: 0.1, ..jet(way()) };
        assert_eq!(moment(&near, &[], 4.0).forces(&x), [[0.0; 3]; 4]);
        let wide = MovingPressure { radius: 1.0, ..jet(way()) };
        assert!(moment(&wide, &[], 1.0).forces(&x)[0][2] < 0.0);
        let mut late = wide;
        late.pressure.span.from = 2.0;
        assert_eq!(moment(&late, &[], 1.0).forces(&x), [[0.0; 3]; 4]);
    }
}
