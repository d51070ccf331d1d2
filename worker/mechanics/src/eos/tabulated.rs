//! A pressure by points: `p = C(x) + gamma T(x) E` with `x = ln(rho/rho0)`, positive in compression, and E per initial volume.
//!
//! C and T are straight lines from point to point, which go on beyond the ends. Nothing stays of a compression: what is left of crushed pores has
//! laws of its own ([`super::porous`], `strength/soil_foam.rs`). The form is that of LS-DYNA's tabulated equation of state (09).

use serde::{Deserialize, Serialize};

use super::{EquationOfState, Line};
use crate::lanes::{Lane, apart::Apart, functions::ln};

/// Most points of a [`Points`].
pub const MAX_POINTS: usize = 10;

/// A curve of straight lines by `ln(rho/rho0)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Points {
    /// Points in use, 1 to [`MAX_POINTS`].
    pub n_points: u32,
    /// `ln(rho/rho0)`, ascending.
    pub at: [f64; MAX_POINTS],
    pub value: [f64; MAX_POINTS],
}

impl Points {
    /// Through these points.
    ///
    /// # Panics
    /// If there are none, or more than [`MAX_POINTS`].
    pub fn through(points: &[[f64; 2]]) -> Self {
        assert!((1..=MAX_POINTS).contains(&points.len()), "{} points", points.len());
        let mut curve =
            Self { n_points: points.len() as u32, at: [0.0; MAX_POINTS], value: [0.0; MAX_POINTS] };
        for (i, [at, value]) in points.iter().enumerate() {
            (curve.at[i], curve.value[i]) = (*at, *value);
        }
        curve
    }

    /// The points in use.
    pub fn points(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        (0..(self.n_points as usize).clamp(1, MAX_POINTS)).map(|i| [self.at[i], self.value[i]])
    }

    /// Each line's end points.
    fn lines(&self) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        self.points().zip(self.points().skip(1)).map(|(a, b)| [a, b])
    }
}

/// Constants of the law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tabulated {
    /// Pressure for each unit of energy per initial volume, times T.
    pub gamma: f64,
    /// C: pressure without energy, 0 at rest and ascending.
    pub pressure: Points,
    /// T, 0 or above.
    pub factor: Points,
}

impl Tabulated {
    /// The word after `type` in a deck.
    pub const NAME: &'static str = "tabulated";

    /// What the points must be beside ascending in `ln(rho/rho0)`.
    pub fn fault(&self) -> Option<&'static str> {
        if self.pressure.n_points < 2 || self.pressure.lines().any(|[a, b]| b[1] <= a[1]) {
            return Some("2 or more points with pressures that ascend");
        }
        let slope = self.bulk();
        let ready = Table::new(&self.pressure);
        if ready.at_zero().abs() > 1e-9 * slope {
            return Some("points of a pressure that is 0 at rest, where ln(rho/rho0) is 0");
        }
        self.factor.points().any(|[_, factor]| factor < 0.0).then_some("factors of 0 or above")
    }

    /// Bulk modulus at rest (stress): the steeper of the lines that meet there.
    pub(crate) fn bulk(&self) -> f64 {
        let n = self.pressure.n_points as usize;
        let touches =
            |i: usize, [a, b]: [[f64; 2]; 2]| (a[0] <= 0.0 || i == 0) && (b[0] >= 0.0 || i + 2 >= n);
        let lines = self.pressure.lines().enumerate().filter(|(i, line)| touches(*i, *line));
        lines.map(|(_, [a, b])| (b[1] - a[1]) / (b[0] - a[0])).fold(0.0, f64::max)
    }
}

/// A curve made ready for lanes: a point and the slope behind it, by line.
#[derive(Clone, Copy)]
struct Table {
    n_lines: usize,
    lines: [[f64; 3]; MAX_POINTS],
}

impl Table {
    fn new(points: &Points) -> Self {
        let mut lines = [[0.0; 3]; MAX_POINTS];
        let n_points = (points.n_points as usize).clamp(1, MAX_POINTS);
        lines[0] = [points.at[0], points.value[0], 0.0];
        for (i, [a, b]) in points.lines().enumerate() {
            lines[i] = [a[0], a[1], (b[1] - a[1]) / (b[0] - a[0])];
        }
        Self { n_lines: (n_points - 1).max(1), lines }
    }

    fn at_zero(&self) -> f64 {
        let [at, value, slope] = self.lines[..self.n_lines]
            .iter()
            .rev()
            .find(|line| line[0] <= 0.0)
            .copied()
            .unwrap_or(self.lines[0]);
        slope.mul_add(-at, value)
    }

    /// Value and slope.
    #[inline(always)]
    fn at<L: Lane>(&self, x: L) -> (L, L) {
        let [at, value, slope] = self.lines[0].map(L::splat);
        let (mut found, mut steep) = (slope.mul_add(x - at, value), slope);
        let mut line = 1;
        while line < self.n_lines {
            let [at, value, slope] = self.lines[line].map(L::splat);
            let beyond = at.less_equal(x);
            found = L::select(beyond, slope.mul_add(x - at, value), found);
            steep = L::select(beyond, slope, steep);
            line += 1;
        }
        (found, steep)
    }
}

/// The law made ready for kernels.
#[derive(Clone, Copy)]
pub(crate) struct ByPoints {
    gamma: f64,
    pressure: Table,
    factor: Table,
    least_stiffness: f64,
}

impl ByPoints {
    pub fn new(law: &Tabulated) -> Self {
        let (pressure, factor) = (Table::new(&law.pressure), Table::new(&law.factor));
        Self { gamma: law.gamma, pressure, factor, least_stiffness: 0.1 * law.bulk() }
    }
}

struct LineAt<'a, L> {
    law: &'a ByPoints,
    v: L,
    line: &'a mut Line<L>,
}

impl<L: Lane> Apart for LineAt<'_, L> {
    #[inline(always)]
    fn run(self) {
        let x = -ln(self.v);
        let by_volume = L::splat(-1.0) / self.v;
        let gamma = L::splat(self.law.gamma);
        let (a, slope_a) = self.law.pressure.at(x);
        let (factor, slope_factor) = self.law.factor.at(x);
        *self.line = Line {
            a,
            b: gamma * factor,
            slope_a: slope_a * by_volume,
            slope_b: gamma * slope_factor * by_volume,
        };
    }
}

impl EquationOfState for ByPoints {
    #[inline(always)]
    fn line<L: Lane>(&self, v: L, _burnt: L) -> Line<L> {
        let mut line = Line { a: v, b: v, slope_a: v, slope_b: v };
        L::apart(LineAt { law: self, v, line: &mut line });
        line
    }

    #[inline(always)]
    fn least_stiffness<L: Lane>(&self, _burnt: L) -> L {
        L::splat(self.least_stiffness)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{eos::difference_stiffness, lanes::scalar::Scalar};

    fn law() -> Tabulated {
        Tabulated {
            gamma: 1.5,
            pressure: Points::through(&[[-0.1, -2e9], [0.0, 0.0], [0.05, 2e9], [0.2, 20e9]]),
            factor: Points::through(&[[0.0, 1.0], [0.2, 0.5]]),
        }
    }

    #[test]
    fn pressure_lies_on_the_lines_and_goes_on_beyond_their_ends() {
        let ready = ByPoints::new(&law());
        let energy = 3e8;
        for (x, cold, factor) in [
            (-0.2f64, -4e9, 1.5),
            (-0.05, -1e9, 1.125),
            (0.0, 0.0, 1.0),
            (0.025, 1e9, 0.9375),
            (0.125, 11e9, 0.6875),
            (0.3, 32e9, 0.25),
        ] {
            let p = ready.line(Scalar((-x).exp()), Scalar(1.0)).pressure(Scalar(energy)).0;
            let wanted = cold + 1.5 * factor * energy;
            assert!((p - wanted).abs() < 1e-12 * 32e9, "{x}: {p} {wanted}");
        }
        let constant = Tabulated { factor: Points::through(&[[0.0, 1.0]]), ..law() };
        let line = ByPoints::new(&constant).line(Scalar(0.9), Scalar(1.0));
        assert_eq!((line.b.0, line.slope_b.0), (1.5, 0.0));
    }

    #[test]
    fn stiffness_is_the_slope_of_the_isentrope() {
        let ready = ByPoints::new(&law());
        for (v, energy) in [(0.85, 3e9), (0.97, 1e8), (1.05, 2e7)] {
            let line = ready.line(Scalar(v), Scalar(1.0));
            let p = line.pressure(Scalar(energy));
            let found = line.stiffness(Scalar(v), p, Scalar(energy)).0;
            let expected = difference_stiffness(&ready, v, energy, 1.0);
            assert!((found / expected - 1.0).abs() < 1e-5, "{v}: {found} {expected}");
        }
    }

    #[test]
    fn the_bulk_modulus_is_the_steeper_line_at_rest() {
        assert_eq!(law().bulk(), 40e9);
        let of = |points: &[[f64; 2]]| Tabulated { pressure: Points::through(points), ..law() };
        // Rest lies beyond the first point, and on one line alone.
        assert_eq!(of(&[[0.1, 1e9], [0.2, 2e9], [0.3, 4e9]]).bulk(), 1e10);
        assert_eq!(of(&[[-0.2, -1e9], [0.2, 1e9], [0.3, 4e9]]).bulk(), 5e9);
        assert_eq!(law().fault(), None);
        assert!(of(&[[0.0, 0.0]]).fault().is_some());
        assert!(of(&[[0.0, 1e9], [0.1, 2e9]]).fault().is_some());
        assert!(of(&[[0.0, 0.0], [0.1, 2e9], [0.2, 1e9]]).fault().is_some());
        assert!(Tabulated { factor: Points::through(&[[0.0, -1.0]]), ..law() }.fault().is_some());
    }
}
