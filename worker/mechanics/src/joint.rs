//! Joints: hinges, balls and sliders that hold rigid bodies together.
//!
//! A joint takes away some of the freedom that two bodies have against each other. Each thing that it takes is a [`Row`]: a distance along
//! an axis of the first body, or the cosine between an axis of each, that stays zero. Every worker knows the states of all bodies and what
//! pushes them, so each finds the same impulses and nothing travels.
//!
//! The impulses act along the rows as they stand at `t_n`, and are such that every row is zero at `t_{n+1}`: SHAKE (Ryckaert, Ciccotti and
//! Berendsen, J. Comput. Phys. 23, 327-341, 1977) for rigid bodies. The step stays symmetric in time, so energy does not drift; what one
//! body gets the other gives at the same point, so momentum and its moment are kept.

use serde::{Deserialize, Serialize};

use crate::{
    rigid::{Body, Free, Impulse, State},
    time_step::TimeStep,
    vectors::{cross, dot, turned},
};

/// What a joint leaves free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// All turns about a point.
    Spherical,
    /// Turns about two axes, one of each body, which stay perpendicular.
    Universal,
    /// Turns about an axis.
    Revolute,
    /// Turns about an axis and slides along it.
    Cylindrical,
    /// Slides along an axis.
    Translational,
    /// Slides in a plane and turns about its normal.
    Planar,
    /// Nothing.
    Fixed,
}

/// Axes of the first body along which the points stay together, and pairs of axes, one of each body, that stay perpendicular.
type Rows = (&'static [usize], &'static [[usize; 2]]);

impl Kind {
    const fn rows(self) -> Rows {
        match self {
            Self::Spherical => (&[0, 1, 2], &[]),
            Self::Universal => (&[0, 1, 2], &[[0, 1]]),
            Self::Revolute => (&[0, 1, 2], &[[1, 0], [2, 0]]),
            Self::Cylindrical => (&[1, 2], &[[1, 0], [2, 0]]),
            Self::Translational => (&[1, 2], &[[1, 0], [2, 0], [1, 2]]),
            Self::Planar => (&[0], &[[1, 0], [2, 0]]),
            Self::Fixed => (&[0, 1, 2], &[[1, 0], [2, 0], [1, 2]]),
        }
    }
}

/// One of the two things that a joint holds together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// A body by its index; none is space.
    pub body: Option<u32>,
    /// Where the joint is in the frame of the body, or in space (length).
    pub place: [f64; 3],
    /// Three axes at right angles in that frame: the first is that of the joint.
    pub axes: [[f64; 3]; 3],
}

/// A joint. At the start its ends have the same place and axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    pub kind: Kind,
    /// Both have a body, or the first alone.
    pub ends: [End; 2],
}

/// What a joint says of a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointVote {
    /// Force on the second end, which the first gives it.
    pub force: [f64; 3],
    /// Moment about the joint likewise.
    pub moment: [f64; 3],
    /// How far the ends are apart: over the reach of the bodies, or in radians.
    pub apart: f64,
}

/// An end as it stands.
struct Standing {
    centre: [f64; 3],
    at: [f64; 3],
    axes: [[f64; 3]; 3],
}

impl Standing {
    fn of(end: &End, states: &[State]) -> Self {
        let Some(body) = end.body else {
            return Self { centre: end.place, at: end.place, axes: end.axes };
        };
        let state = &states[body as usize];
        let axes = end.axes.map(|axis| turned(&state.attitude, axis));
        Self { centre: state.centre, at: state.at(end.place), axes }
    }
}

/// One thing that a joint takes.
struct Row {
    joint: u32,
    take: Take,
    /// Impulse on each end by a unit of the row's own.
    on: [Impulse; 2],
}

#[derive(Clone, Copy)]
enum Take {
    /// The distance of the points along an axis of the first end.
    Along(usize),
    /// The cosine between an axis of the first end and one of the second.
    Between([usize; 2]),
}

impl Take {
    /// What of it is violated (length, or radians).
    fn violation(self, [first, second]: &[Standing; 2]) -> f64 {
        match self {
            Self::Along(axis) => dot(first.axes[axis], std::array::from_fn(|a| second.at[a] - first.at[a])),
            Self::Between([a, b]) => dot(first.axes[a], second.axes[b]),
        }
    }

    /// Impulses on both ends that change it: those along it act where the second end is.
    fn impulses(self, [first, second]: &[Standing; 2]) -> [Impulse; 2] {
        match self {
            Self::Along(axis) => {
                let along = first.axes[axis];
                let about = |from: &Standing| {
                    let arm = std::array::from_fn(|a| second.at[a] - from.centre[a]);
                    Impulse { linear: along, angular: cross(arm, along) }
                };
                [negative(about(first)), about(second)]
            }
            Self::Between([a, b]) => {
                let turn = Impulse { linear: [0.0; 3], angular: cross(second.axes[b], first.axes[a]) };
                [negative(turn), turn]
            }
        }
    }
}

fn negative(impulse: Impulse) -> Impulse {
    Impulse { linear: impulse.linear.map(|c| -c), angular: impulse.angular.map(|c| -c) }
}

/// Joints that hold each other through bodies, and those bodies.
#[derive(Debug)]
struct Island {
    joints: Vec<u32>,
    bodies: Vec<u32>,
}

/// The joints of a problem, in groups that do not touch each other.
#[derive(Debug, Default)]
pub struct Mechanism {
    islands: Vec<Island>,
}

/// Bodies that are to be moved from `t_n` to `t_{n+1}`.
pub struct Moving<'a> {
    pub step: &'a TimeStep<'a>,
    pub bodies: &'a [Body],
    pub states: &'a [State],
    pub free: &'a [Free],
}

/// A row's own diagonal gets so much more: rows that say the same as others, as the hinges of a closed frame do, then do no harm.
const EASE: f64 = 1e-10;
/// Most rounds of the search for impulses; each gains as many digits as the bodies turn little in a step.
const ROUNDS: usize = 20;

impl Mechanism {
    /// Groups joints by the bodies that they share.
    pub fn of(joints: &[Joint], n_bodies: usize) -> Self {
        let mut root: Vec<usize> = (0..n_bodies).collect();
        let find = |root: &[usize], mut body: usize| {
            while root[body] != body {
                body = root[body];
            }
            body
        };
        let bodies_of = |joint: &Joint| joint.ends.map(|end| end.body.map(|body| body as usize));
        for joint in joints {
            if let [Some(a), Some(b)] = bodies_of(joint) {
                let (a, b) = (find(&root, a), find(&root, b));
                root[a.max(b)] = a.min(b);
            }
        }
        let mut islands: std::collections::BTreeMap<usize, Island> = std::collections::BTreeMap::new();
        for (j, joint) in (0..).zip(joints) {
            let Some(any) = bodies_of(joint).into_iter().flatten().next() else { continue };
            let island = islands
                .entry(find(&root, any))
                .or_insert_with(|| Island { joints: Vec::new(), bodies: Vec::new() });
            island.joints.push(j);
            island.bodies.extend(joint.ends.iter().filter_map(|end| end.body));
        }
        let mut islands: Vec<Island> = islands.into_values().collect();
        for island in &mut islands {
            island.bodies.sort_unstable();
            island.bodies.dedup();
        }
        Self { islands }
    }

    /// The impulse that joints give each body in a step, and what each joint says.
    pub fn hold(&self, joints: &[Joint], moving: &Moving<'_>) -> (Vec<Impulse>, Vec<JointVote>) {
        let mut impulses = vec![Impulse::default(); moving.bodies.len()];
        let mut votes = vec![JointVote::default(); joints.len()];
        if self.islands.is_empty() {
            return (impulses, votes);
        }
        let mut states = moving.states.to_vec();
        for island in &self.islands {
            island.hold(joints, moving, &mut impulses, &mut votes, &mut states);
        }
        (impulses, votes)
    }
}

impl Island {
    fn hold(
        &self,
        joints: &[Joint],
        moving: &Moving<'_>,
        impulses: &mut [Impulse],
        votes: &mut [JointVote],
        states: &mut [State],
    ) {
        let rows = self.rows(joints, states);
        let system = System::of(&rows, joints, moving);
        let mut held = vec![0.0; rows.len()];
        let mut before = f64::INFINITY;
        let mut violations = vec![0.0; rows.len()];
        for _ in 0..ROUNDS {
            for &body in &self.bodies {
                let b = body as usize;
                let (body, free) = (&moving.bodies[b], &moving.free[b]);
                states[b] = moving.step.moved(body, free, &impulses[b], &moving.states[b]);
            }
            for (violation, row) in violations.iter_mut().zip(&rows) {
                let ends = &joints[row.joint as usize].ends;
                *violation = row.take.violation(&[0, 1].map(|e| Standing::of(&ends[e], states)));
            }
            let worst = system.size(&violations);
            // What does not fall any more is rounding.
            if worst >= 0.5 * before || worst == 0.0 {
                break;
            }
            before = worst;
            let mut change: Vec<f64> = violations.iter().map(|g| -g / moving.step.dt).collect();
            system.solve(&mut change);
            for ((held, row), change) in held.iter_mut().zip(&rows).zip(change) {
                *held += change;
                let ends = &joints[row.joint as usize].ends;
                for (end, on) in ends.iter().zip(&row.on) {
                    if let Some(body) = end.body {
                        impulses[body as usize].add(change, on);
                    }
                }
            }
        }
        let per_time = 1.0 / moving.step.half_steps();
        for ((row, held), violation) in rows.iter().zip(held).zip(violations) {
            let joint = &joints[row.joint as usize];
            let vote = &mut votes[row.joint as usize];
            let along = row.on[1].linear.map(|c| held * per_time * c);
            (0..3).for_each(|a| vote.force[a] += along[a]);
            if let Take::Between(_) = row.take {
                (0..3).for_each(|a| vote.moment[a] += held * per_time * row.on[1].angular[a]);
            }
            let size = match row.take {
                Take::Along(_) => joint.reach(moving.bodies),
                Take::Between(_) => 1.0,
            };
            vote.apart = vote.apart.max(violation.abs() / size);
        }
    }

    /// What the joints take, as they stand at `t_n`.
    fn rows(&self, joints: &[Joint], states: &[State]) -> Vec<Row> {
        let mut rows = Vec::new();
        for &j in &self.joints {
            let joint = &joints[j as usize];
            let ends = [0, 1].map(|e| Standing::of(&joint.ends[e], states));
            let (along, between) = joint.kind.rows();
            let takes = along.iter().map(|&axis| Take::Along(axis));
            for take in takes.chain(between.iter().map(|&pair| Take::Between(pair))) {
                rows.push(Row { joint: j, take, on: take.impulses(&ends) });
            }
        }
        rows
    }
}

impl Joint {
    /// How fast its ends part at the start, in what it takes away (length per time); turns count at the reach of the bodies.
    pub fn parting(&self, bodies: &[Body]) -> f64 {
        let states: Vec<State> = bodies.iter().map(|body| body.start).collect();
        let ends = [0, 1].map(|e| Standing::of(&self.ends[e], &states));
        let motion = self.ends.map(|end| match end.body {
            Some(b) => {
                let State { velocity, spin, .. } = states[b as usize];
                Impulse { linear: velocity, angular: spin }
            }
            None => Impulse::default(),
        });
        let rate = |take: Take| {
            let on = take.impulses(&ends);
            (on[0].dot(&motion[0]) + on[1].dot(&motion[1])).abs()
        };
        let (along, between) = self.kind.rows();
        let slides = along.iter().map(|&axis| rate(Take::Along(axis)));
        let turns = between.iter().map(|&pair| rate(Take::Between(pair)) * self.reach(bodies));
        slides.chain(turns).fold(0.0, f64::max)
    }

    /// The longest arm of its bodies (length).
    pub fn reach(&self, bodies: &[Body]) -> f64 {
        self.ends.iter().filter_map(|end| end.body).map(|b| bodies[b as usize].reach()).fold(0.0, f64::max)
    }
}

/// The linear equations between the impulses of rows and the rates of their violations: symmetric, scaled to a diagonal of 1, as a
/// triangle of Cholesky's.
struct System {
    n: usize,
    /// By row: one over the root of its diagonal; 0 where nothing can move.
    scale: Vec<f64>,
    /// Rows of the lower triangle, one after another.
    lower: Vec<f64>,
}

impl System {
    fn of(rows: &[Row], joints: &[Joint], moving: &Moving<'_>) -> Self {
        let n = rows.len();
        let bodies_of = |row: &Row| joints[row.joint as usize].ends.map(|end| end.body);
        // What each row's own impulse makes of the bodies.
        let answers: Vec<[Impulse; 2]> = rows
            .iter()
            .map(|row| {
                let ends = bodies_of(row);
                [0, 1].map(|e| match ends[e] {
                    Some(b) => {
                        let b = b as usize;
                        moving.step.answer(&moving.bodies[b], &moving.states[b], &row.on[e])
                    }
                    None => Impulse::default(),
                })
            })
            .collect();
        let between = |r: usize, s: usize| -> f64 {
            let (of_r, of_s) = (bodies_of(&rows[r]), bodies_of(&rows[s]));
            let pairs = [[0, 0], [0, 1], [1, 0], [1, 1]];
            let shared = pairs.into_iter().filter(|&[e, f]| of_r[e].is_some() && of_r[e] == of_s[f]);
            shared.map(|[e, f]| rows[r].on[e].dot(&answers[s][f])).sum()
        };
        let scale: Vec<f64> = (0..n)
            .map(|r| {
                let diagonal = between(r, r);
                if diagonal > 0.0 { 1.0 / diagonal.sqrt() } else { 0.0 }
            })
            .collect();
        let mut lower = vec![0.0; n * n];
        for r in 0..n {
            for s in 0..=r {
                let mut value = scale[r] * between(r, s) * scale[s];
                if r == s {
                    value = 1.0 + EASE;
                }
                for k in 0..s {
                    value -= lower[r * n + k] * lower[s * n + k];
                }
                // No pivot is smaller than what eases it, but for rounding.
                lower[r * n + s] =
                    if r == s { value.max(0.5 * EASE).sqrt() } else { value / lower[s * n + s] };
            }
        }
        Self { n, scale, lower }
    }

    /// A measure of violations.
    fn size(&self, violations: &[f64]) -> f64 {
        violations.iter().zip(&self.scale).map(|(g, scale)| (g * scale).abs()).fold(0.0, f64::max)
    }

    /// Puts impulses in place of the rates that they must add.
    fn solve(&self, right: &mut [f64]) {
        let n = self.n;
        right.iter_mut().zip(&self.scale).for_each(|(value, scale)| *value *= scale);
        for r in 0..n {
            let known: f64 = (0..r).map(|k| self.lower[r * n + k] * right[k]).sum();
            right[r] = (right[r] - known) / self.lower[r * n + r];
        }
        for r in (0..n).rev() {
            let known: f64 = (r + 1..n).map(|k| self.lower[k * n + r] * right[k]).sum();
            right[r] = (right[r] - known) / self.lower[r * n + r];
        }
        right.iter_mut().zip(&self.scale).for_each(|(value, scale)| *value *= scale);
    }
}

#[cfg(test)]
mod tests;
