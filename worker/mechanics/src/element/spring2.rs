//! The discrete spring and damper: a force between two nodes along the line that joins them.
//!
//! The force follows the elongation, which is the length less that of the mesh plus an offset, and the rate of the length; it is positive
//! in tension. A spring has no mass, no volume and no material: its nodes have masses from elements or from the deck, and what stands
//! for its volume is its length. The force of a damper at `x_n` is that of a rate at `n`, the parabola through those at `n - 1/2`, `n - 3/2`
//! and `n - 5/2`, so with `w^2` and `g` the sums of stiffness and of damping over mass at its nodes the leapfrog scheme is stable up to
//! `w^2 dt^2 + 7 g dt = 4`. The sums are over all springs at a node: no set of springs is then faster than the fastest of them says.
//!
//! A third of that step is allowed. In a mesh of elements the fastest modes are those that no mesh resolves, but a mass on a spring is a
//! swing that a deck asks for: near the limit the scheme swings it a tenth too fast.

use serde::{Deserialize, Serialize};

use crate::{
    mesh::{Mesh, Part, Topology},
    state::{GlobalState, field},
};

pub(crate) mod group;

/// What a spring has beside the fields of all elements.
pub const N_OWN: usize = 7;
/// Index of the force along the spring, positive in tension (force).
pub const FORCE: usize = 0;
/// Index of the plastic part of the elongation (length).
pub(crate) const PLASTIC: usize = 1;
/// Index of the sum of its plastic changes of length (length).
pub(crate) const SLIP: usize = 2;
/// Indices of the rates of the length in the last step and in that before it (velocity).
pub(crate) const RATES: [usize; 2] = [3, 4];
/// Index of `w^2`, the sum over both ends of the stiffness of all springs there over the mass (1/time squared). It stays.
pub(crate) const STIFF: usize = 5;
/// Index of `g`, the same of damping (1/time). It stays.
pub(crate) const DAMPED: usize = 6;

/// Longest step over the [stable](stable_step) one. With a safety factor of 2/3 a lone spring swings 0.8 % too fast.
const RESOLVED: f64 = 1.0 / 3.0;

/// The law of springs and dampers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spring {
    pub elastic: Elastic,
    pub damper: Damper,
    /// Elongation at the start (length): a positive one pulls.
    pub offset: f64,
}

/// Force by elongation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Elastic {
    None,
    Linear {
        /// Force over length.
        stiffness: f64,
    },
    /// Isotropic hardening in both directions.
    Plastic {
        /// Force over length.
        stiffness: f64,
        /// The same where it yields; below the stiffness.
        tangent: f64,
        /// Force at which it yields at first.
        yields: f64,
    },
    Curve(Line),
}

/// Force by the rate of the length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Damper {
    None,
    Linear {
        /// Force over velocity.
        damping: f64,
    },
    Curve(Line),
}

/// Straight lines between points, which go on beyond the first and the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Abscissa and force, at least two; abscissas ascend.
    pub points: Vec<[f64; 2]>,
}

impl Line {
    /// What the points would have to be.
    fn fault(&self) -> Option<&'static str> {
        let ascends = self.points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        if self.points.len() < 2 || !ascends {
            return Some("at least two points whose first numbers ascend");
        }
        (self.greatest() == 0.0).then_some("a point whose force is not 0")
    }

    /// The greatest magnitude of the force at a point.
    fn greatest(&self) -> f64 {
        self.points.iter().map(|point| point[1].abs()).fold(0.0, f64::max)
    }

    fn at(&self, x: f64) -> f64 {
        let after = self.points.partition_point(|point| point[0] <= x).clamp(1, self.points.len() - 1);
        let ([x0, y0], [x1, y1]) = (self.points[after - 1], self.points[after]);
        (x - x0).mul_add((y1 - y0) / (x1 - x0), y0)
    }

    /// The greatest slope, 0 where it descends everywhere.
    fn steepest(&self) -> f64 {
        let slope = |pair: &[[f64; 2]]| (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0]);
        self.points.windows(2).map(slope).fold(0.0, f64::max)
    }

    /// The integral from 0 to `x`.
    fn integral(&self, x: f64) -> f64 {
        let (low, high) = (x.min(0.0), x.max(0.0));
        let inside = self.points.iter().map(|point| point[0]).filter(|at| low < *at && *at < high);
        let (mut sum, mut from) = (0.0, low);
        for to in inside.chain([high]) {
            sum = (0.5 * (to - from)).mul_add(self.at(from) + self.at(to), sum);
            from = to;
        }
        if x < 0.0 { -sum } else { sum }
    }
}

/// The plastic state of a spring (length).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Plastic {
    /// Part of the elongation.
    elongation: f64,
    /// Sum of its changes.
    slip: f64,
}

impl Elastic {
    /// Greatest slope of the force (force over length).
    fn stiffness(&self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear { stiffness } | Self::Plastic { stiffness, .. } => *stiffness,
            Self::Curve(line) => line.steepest(),
        }
    }

    /// The force at an elongation, to which the plastic state follows.
    fn force(&self, elongation: f64, plastic: &mut Plastic) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear { stiffness } => stiffness * elongation,
            Self::Curve(line) => line.at(elongation),
            Self::Plastic { stiffness, tangent, yields } => {
                let trial = stiffness * (elongation - plastic.elongation);
                let hardening = stiffness * tangent / (stiffness - tangent);
                let excess = trial.abs() - hardening.mul_add(plastic.slip, *yields);
                if excess <= 0.0 {
                    return trial;
                }
                let slip = excess / (stiffness + hardening);
                plastic.slip += slip;
                plastic.elongation += slip.copysign(trial);
                (-stiffness).mul_add(slip.copysign(trial), trial)
            }
        }
    }

    /// Energy at an elongation up to which it does not yield.
    fn stored(&self, elongation: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear { stiffness } | Self::Plastic { stiffness, .. } => {
                0.5 * stiffness * elongation * elongation
            }
            Self::Curve(line) => line.integral(elongation),
        }
    }
}

impl Damper {
    /// Greatest slope of the force (force over velocity).
    fn damping(&self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear { damping } => *damping,
            Self::Curve(line) => line.steepest(),
        }
    }

    fn force(&self, rate: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Linear { damping } => damping * rate,
            Self::Curve(line) => line.at(rate),
        }
    }
}

impl Spring {
    /// What the law would have to be, where each of its numbers is finite and none of those that have no sign is negative.
    pub fn fault(&self) -> Option<&'static str> {
        if let Some(fault) = self.lines().find_map(Line::fault) {
            return Some(fault);
        }
        if let Damper::Curve(line) = &self.damper
            && (line.points.windows(2).any(|pair| pair[1][1] < pair[0][1]) || line.at(0.0) != 0.0)
        {
            return Some("a force of the damper that does not fall and is 0 at rate 0");
        }
        match self.elastic {
            Elastic::Plastic { stiffness, tangent, .. } if tangent >= stiffness => {
                Some("a tangent below the stiffness")
            }
            Elastic::Plastic { stiffness, yields, .. } if stiffness * self.offset.abs() > yields => {
                Some("an offset at which it does not yield yet")
            }
            _ => None,
        }
    }

    /// The same law with every force `factor` times as large.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        let line =
            |line: Line| Line { points: line.points.into_iter().map(|[x, y]| [x, factor * y]).collect() };
        let elastic = match self.elastic {
            Elastic::None => Elastic::None,
            Elastic::Linear { stiffness } => Elastic::Linear { stiffness: factor * stiffness },
            Elastic::Plastic { stiffness, tangent, yields } => Elastic::Plastic {
                stiffness: factor * stiffness,
                tangent: factor * tangent,
                yields: factor * yields,
            },
            Elastic::Curve(curve) => Elastic::Curve(line(curve)),
        };
        let damper = match self.damper {
            Damper::None => Damper::None,
            Damper::Linear { damping } => Damper::Linear { damping: factor * damping },
            Damper::Curve(curve) => Damper::Curve(line(curve)),
        };
        Self { elastic, damper, offset: self.offset }
    }

    /// What the force of such a spring may come to, above 0 for a law without [fault](Spring::fault): where it is drawn by its length, at
    /// the start, at the points of curves, and where its nodes part at a speed.
    pub(crate) fn reference(&self, length: f64, speed: f64) -> f64 {
        let at_start = self.elastic.force(self.offset, &mut Plastic::default()).abs();
        let drawn = self.elastic.stiffness() * length;
        let rubbed = self.damper.damping() * speed;
        [drawn, rubbed, self.lines().map(Line::greatest).fold(0.0, f64::max)]
            .into_iter()
            .fold(at_start, f64::max)
    }

    /// Its curves.
    fn lines(&self) -> impl Iterator<Item = &Line> {
        let elastic = if let Elastic::Curve(line) = &self.elastic { Some(line) } else { None };
        let damper = if let Damper::Curve(line) = &self.damper { Some(line) } else { None };
        elastic.into_iter().chain(damper)
    }
}

/// The longest stable step of a pair of nodes with these sums, infinite where both are zero.
fn stable_step(stiff: f64, damped: f64) -> f64 {
    let damped = 7.0 * damped;
    8.0 / (damped + damped.mul_add(damped, 16.0 * stiff).sqrt())
}

/// The rate half a step after the last of three, by the parabola through them.
fn drawn_on(last: f64, [before, first]: [f64; 2]) -> f64 {
    0.125 * 3.0f64.mul_add(first, 15.0f64.mul_add(last, -10.0 * before))
}

/// The longest step in which they are resolved.
fn longest_step(stiff: f64, damped: f64) -> f64 {
    RESOLVED * stable_step(stiff, damped)
}

/// Gives the springs of a mesh their state at time zero, in a state whose nodes have their masses.
///
/// # Errors
/// Names the first node of a spring that has no mass.
pub(crate) fn start(mesh: &Mesh, state: &mut GlobalState) -> Result<(), String> {
    let of_springs: Vec<(&Part, usize, &Spring)> = mesh
        .parts
        .iter()
        .zip(mesh.element_offsets())
        .filter_map(|(part, first)| match &part.topology {
            Topology::Springs { spring, .. } => Some((part, first, spring)),
            _ => None,
        })
        .collect();
    if of_springs.is_empty() {
        return Ok(());
    }
    let ends = |part: &Part, e: usize| [0, 1].map(|end| part.corners(e)[end] as usize);
    let mut sums = vec![[0.0; 2]; mesh.n_nodes()];
    for &(part, _, spring) in &of_springs {
        let own = [spring.elastic.stiffness(), spring.damper.damping()];
        for node in (0..part.n_elements()).flat_map(|e| ends(part, e)) {
            if state.mass[node] <= 0.0 {
                return Err(format!(
                    "node {} of the springs of part `{}` has no mass; give it one, or join it to an element",
                    mesh.node_ids[node], part.name
                ));
            }
            (0..2).for_each(|i| sums[node][i] += own[i]);
        }
    }
    for (part, first, spring) in of_springs {
        for e in 0..part.n_elements() {
            let [a, b] = ends(part, e);
            let apart = |values: &[[f64; 3]]| -> [f64; 3] {
                std::array::from_fn(|axis| values[b][axis] - values[a][axis])
            };
            let rate = rate(apart(&state.x), apart(&state.v));
            let force = spring.elastic.force(spring.offset, &mut Plastic::default());
            let of_ends = |i: usize| sums[a][i] / state.mass[a] + sums[b][i] / state.mass[b];
            let at = first + e;
            state.own[FORCE][at] = force + spring.damper.force(rate);
            state.own[STIFF][at] = of_ends(0);
            state.own[DAMPED][at] = of_ends(1);
            RATES.iter().for_each(|&before| state.own[before][at] = rate);
            state.elements[field::ENERGY][at] =
                spring.elastic.stored(spring.offset) / state.initial_volume[at];
        }
    }
    Ok(())
}

/// Rate at which a spring of a mesh swings or comes to rest at time zero (1/time).
pub(crate) fn fastest(state: &GlobalState, element: usize) -> f64 {
    state.own[STIFF][element].sqrt().max(state.own[DAMPED][element])
}

/// Rate of the length of a line along `x` whose ends part with the velocity `v`.
fn rate(x: [f64; 3], v: [f64; 3]) -> f64 {
    x[0].mul_add(v[0], x[1].mul_add(v[1], x[2] * v[2])) / norm(x)
}

fn norm(x: [f64; 3]) -> f64 {
    x[0].mul_add(x[0], x[1].mul_add(x[1], x[2] * x[2])).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 2]]) -> Line {
        Line { points: points.to_vec() }
    }

    #[test]
    fn a_curve_goes_on_with_its_outer_slopes_and_its_energy_is_its_integral() {
        let line = line(&[[-1.0, -4.0], [0.0, 0.0], [1.0, 1.0], [2.0, 5.0]]);
        for (x, force) in [(-2.0, -8.0), (-0.5, -2.0), (0.0, 0.0), (1.5, 3.0), (3.0, 9.0)] {
            assert_eq!(line.at(x), force, "at {x}");
        }
        assert_eq!(line.steepest(), 4.0);
        assert_eq!(
            [line.integral(3.0), line.integral(-2.0), line.integral(0.0)],
            [0.5 + 3.0 + 7.0, 8.0, 0.0]
        );
    }

    #[test]
    fn a_plastic_spring_hardens_by_its_tangent_in_both_directions() {
        let elastic = Elastic::Plastic { stiffness: 100.0, tangent: 20.0, yields: 10.0 };
        let mut plastic = Plastic::default();
        let mut force = |elongation: f64| elastic.force(elongation, &mut plastic);
        assert_eq!(force(0.05), 5.0);
        // Beyond 0.1 with the tangent.
        assert!((force(0.6) - 20.0).abs() < 1e-12);
        assert!((force(0.5) - 10.0).abs() < 1e-12);
        // It yields at minus 20 then: at 0.6 - 0.4, and from there with the tangent.
        assert!((force(0.2) + 20.0).abs() < 1e-12);
        assert!((force(0.1) + 22.0).abs() < 1e-12);
    }

    #[test]
    fn the_stable_step_is_that_of_the_leapfrog_scheme_with_rates_drawn_on() {
        for (stiff, damped) in [(4.0, 0.0), (4.0, 1.5), (0.0, 2.0)] {
            let step = stable_step(stiff, damped);
            let grows = |step: f64| {
                let (mut x, mut v, mut before) = (1.0_f64, 0.3_f64, [0.3_f64; 2]);
                for _ in 0..4000 {
                    let drawn = drawn_on(v, before);
                    before = [v, before[0]];
                    v -= step * (stiff * x + damped * drawn);
                    x += step * v;
                }
                !(x.abs() < 1e3 && v.abs() < 1e3)
            };
            assert!(!grows(0.999 * step) && grows(1.01 * step), "{stiff} {damped}: {step}");
        }
        assert_eq!(stable_step(0.0, 0.0), f64::INFINITY);
    }

    #[test]
    fn a_law_that_cannot_be_is_told() {
        let elastic = Elastic::Plastic { stiffness: 100.0, tangent: 20.0, yields: 10.0 };
        let whole = Spring { elastic, damper: Damper::None, offset: 0.1 };
        assert_eq!(whole.fault(), None);
        assert!(Spring { offset: -0.11, ..whole.clone() }.fault().is_some());
        for points in [
            &[[0.0, 0.0]][..],
            &[[0.0, 0.0], [0.0, 1.0]],
            &[[0.0, 0.0], [1.0, 0.0]],
            &[[0.0, 1.0], [1.0, 2.0]],
            &[[0.0, 0.0], [1.0, -1.0]],
        ] {
            let damper = Damper::Curve(line(points));
            assert!(Spring { damper, ..whole.clone() }.fault().is_some(), "{points:?}");
        }
        let doubled = whole.scaled(2.0);
        assert_eq!(doubled.elastic, Elastic::Plastic { stiffness: 200.0, tangent: 40.0, yields: 20.0 });
    }
}
