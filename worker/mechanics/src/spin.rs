//! Rotation of nodes, where a kind of elements turns them: `w_{n+1/2} = w_{n-1/2} + m/I (dt_{n-1} + dt_n)/2`.
//!
//! As for the rest of a node, every block that has a copy does this with the same total moment and inertia and gets the
//! same bits; the booked copy alone counts. Nodes go in sets of eight on lanes.

use crate::{
    exact::rounded,
    lanes::{Lane, SET, Width, dispatch::Task},
    nodes::{Advance, NodeSet},
    time_step::TimeStep,
    work::{self, Work},
};

/// Rotations of the nodes of a block, by local node and padded as its other arrays are.
pub struct Turning {
    /// Rotation rate by axis (1/time), the same in space for all elements of a node.
    pub w: [Vec<f64>; 3],
    /// Moment by axis (force times length).
    pub m: [Vec<f64>; 3],
    /// Rotational inertia, see [`crate::state::ShellState::inertia`]; positive in the padding.
    pub inertia: Vec<f64>,
}

impl Turning {
    /// These rates and inertias; no moments.
    ///
    /// # Panics
    /// If there are not as many of the one as of the other.
    pub fn new(spin: &[[f64; 3]], mut inertia: Vec<f64>) -> Self {
        let n_nodes = spin.len();
        assert!(inertia.len() == n_nodes, "{} inertias, {n_nodes} nodes", inertia.len());
        let n_padded = n_nodes.next_multiple_of(SET);
        inertia.resize(n_padded, 1.0);
        Self {
            w: std::array::from_fn(|axis| {
                let mut w: Vec<f64> = spin.iter().map(|w| w[axis]).collect();
                w.resize(n_padded, 0.0);
                w
            }),
            m: std::array::from_fn(|_| vec![0.0; n_padded]),
            inertia,
        }
    }
}

/// Advances the rotation rates of the nodes of a block and clears the moments; gives the kinetic energy of rotation of the booked nodes
/// at `t_n`, as [`crate::work`] has it, and the work that relaxation and what prescribes their rates do on them. What clamps a node that does not
/// turn does none. The result does not depend on `width`.
///
/// # Panics
/// If an array is shorter than the sets or the machine lacks the width.
pub(crate) fn advance(
    advance: &Advance<'_>,
    turning: &mut Turning,
    constraint: &[u16],
    sets: &[NodeSet],
    width: Width,
) -> (f64, Work) {
    let n = sets.len() * SET;
    let lengths = turning.w.iter().chain(&turning.m).map(Vec::len);
    let shortest = lengths.min().unwrap_or(0).min(turning.inertia.len());
    assert!(shortest >= n, "rotations of {shortest} nodes, {n} in sets");
    width.run(Turn { advance, turning, constraint, sets })
}

/// The step of the rotation rates of nodes whose arrays have been checked.
struct Turn<'a, 'n> {
    advance: &'a Advance<'a>,
    turning: &'n mut Turning,
    constraint: &'a [u16],
    sets: &'a [NodeSet],
}

/// Nodes of a set whose rates are prescribed: by axis a bit for each, and how fast they turn.
#[derive(Clone, Copy)]
struct Held {
    nodes: [u8; 3],
    rates: [[f64; SET]; 3],
}

/// Sums over the booked nodes of each lane.
#[derive(Clone, Copy)]
struct Sums<L> {
    kinetic: L,
    /// Work from outside before and after `t_n`.
    work: [L; 2],
}

impl Task for Turn<'_, '_> {
    type Output = (f64, Work);

    #[inline(always)]
    fn run<L: Lane>(mut self) -> (f64, Work) {
        let loss = self.advance.step.loss();
        let zero = L::splat(0.0);
        let mut sums = Sums { kinetic: zero, work: [zero; 2] };
        for index in 0..self.sets.len() {
            let set = self.sets[index];
            let held = if set.held == 0 { None } else { self.held(index, set.held) };
            let mut lane = 0;
            while lane < SET {
                // SAFETY: the arrays hold all sets, as [`advance`] has found.
                unsafe { self.lanes(index * SET, lane, set.booked, held.as_ref(), loss, &mut sums) };
                lane += L::N;
            }
        }
        let (kinetic, work) = (sums.kinetic.to_array(), [sums.work[0].to_array(), sums.work[1].to_array()]);
        let [before, after] = [work[0].iter().sum(), work[1].iter().sum()];
        (kinetic.iter().sum(), Work { before, after })
    }
}

impl Turn<'_, '_> {
    /// What is prescribed to nodes of a set with constraints, if anything is.
    fn held(&self, index: usize, constrained: u8) -> Option<Held> {
        let TimeStep { time, dt, loads, .. } = self.advance.step;
        let mut held = Held { nodes: [0; 3], rates: [[0.0; SET]; 3] };
        for lane in (0..SET).filter(|lane| constrained >> lane & 1 == 1) {
            let constraint = &self.advance.constraints[usize::from(self.constraint[index * SET + lane])];
            for (axis, rate) in constraint.spin(&loads.curves, time, dt).into_iter().enumerate() {
                held.nodes[axis] |= u8::from(rate.is_some()) << lane;
                held.rates[axis][lane] = rate.unwrap_or(0.0);
            }
        }
        (held.nodes != [0; 3]).then_some(held)
    }

    /// The nodes `first + lane..first + lane + N` of the set that begins at `first`.
    ///
    /// # Safety
    /// The arrays hold them.
    #[inline(always)]
    unsafe fn lanes<L: Lane>(
        &mut self,
        first: usize,
        lane: usize,
        booked: u8,
        held: Option<&Held>,
        loss: f64,
        sums: &mut Sums<L>,
    ) {
        let at = first + lane;
        let (zero, half, energy) =
            (L::splat(0.0), L::splat(0.5), L::splat(self.advance.step.quanta.energy.magic()));
        let half_steps = L::splat(self.advance.step.half_steps());
        let share = self.advance.step.share_before();
        // SAFETY: the caller's promise.
        let inertia = unsafe { L::load(&self.turning.inertia, at) };
        let scale = half_steps / inertia;
        let (mut product, mut before, mut after) = (zero, zero, zero);
        let mut axis = 0;
        while axis < 3 {
            let (w, m) = (&mut self.turning.w[axis], &mut self.turning.m[axis]);
            // SAFETY: the caller's promise.
            let (old, moment) = unsafe { (L::load(w, at), L::load(m, at)) };
            let mut new = moment.mul_add(scale, old);
            let mut change = zero;
            if loss > 0.0 {
                change = L::splat(-loss) * old;
                new = new + change;
            }
            if let Some(held) = held {
                let free = new;
                // SAFETY: a set has these lanes.
                let rates = unsafe { L::load(&held.rates[axis], lane) };
                new = L::select(L::mask(u32::from(held.nodes[axis] >> lane)), rates, free);
                change = change + (new - free);
            }
            if loss > 0.0 || held.is_some() {
                before = before + change * old;
                after = after + change * new;
            }
            // SAFETY: as above.
            unsafe {
                new.store(w, at);
                zero.store(m, at);
            }
            product = old.mul_add((new - old).mul_add(L::splat(2.0 * share), old), product);
            axis += 1;
        }
        let booked = L::mask(u32::from(booked >> lane));
        let kinetic = rounded(half * inertia * product, energy);
        sums.kinetic = sums.kinetic + L::select(booked, kinetic, zero);
        if loss > 0.0 || held.is_some() {
            let quantum = self.advance.step.dithered();
            for (sum, half) in
                sums.work.iter_mut().zip(work::halves([inertia * before, inertia * after], share))
            {
                *sum = *sum + L::select(booked, quantum.round_lanes(half), zero);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        constraint::{Circle, Constraint},
        exact::{Quanta, Quantum},
        load::{Drive, Loads, Relaxation},
    };

    #[test]
    fn every_width_turns_nodes_by_the_equation_and_books_the_same() {
        let n = 21;
        let spin: Vec<[f64; 3]> = (0..n).map(|i| [0.3, -1.7, 2.9].map(|a| a * f64::from(i + 1))).collect();
        let moment = |axis: usize, node: usize| (1.0 + axis as f64) * (7.0 - node as f64);
        let inertia: Vec<f64> = (1..=n).map(|i| 0.01 * f64::from(i)).collect();
        let constraint: Vec<u16> = (0..n).map(|i| [0, 0, 1, 0, 2][i as usize % 5]).collect();
        let mut sets = NodeSet::all(&constraint);
        sets.iter_mut().for_each(|set| set.booked = 0b0101_1011);
        let circle = Circle { axis: 1, point: [0.0; 3], rate: Drive::constant(-4.5) };
        let constraints = [
            Constraint::default(),
            Constraint { clamped: 0b101, ..Constraint::default() },
            Constraint { clamped: 0b001, circle: Some(circle), ..Constraint::default() },
        ];
        let turns = Some(circle.chord_rate(-4.5, 3e-4));
        let held = [[None; 3], [Some(0.0), None, Some(0.0)], [Some(0.0), turns, None]];
        let quantum = Quantum::for_reference(1e3, 42);
        for factor in [None, Some(0.9)] {
            let relaxation = factor.map(|factor| Relaxation { factor, rate: 0.0, until: 1.0 });
            let advance = Advance {
                step: TimeStep {
                    dt_previous: 1e-4,
                    dt: 3e-4,
                    time: 0.0,
                    cycle: 7,
                    loads: &Loads { relaxation, ..Loads::default() },
                    quanta: Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 },
                },
                constraints: &constraints,
                walls: &[],
                poses: &[],
            };
            let run = |width: Width| {
                let mut turning = Turning::new(&spin, inertia.clone());
                for (axis, m) in turning.m.iter_mut().enumerate() {
                    (0..n as usize).for_each(|node| m[node] = moment(axis, node));
                }
                let said = super::advance(&advance, &mut turning, &constraint, &sets, width);
                assert!(turning.m.iter().flatten().all(|&m| m == 0.0));
                (turning.w, said)
            };
            let (w, (kinetic, work)) = run(Width::Scalar);
            let (mut energy, mut done) = (0.0, 0.0);
            for node in 0..n as usize {
                let kept = factor.unwrap_or(1.0);
                let booked = 0b0101_1011 >> (node % SET) & 1 == 1;
                for axis in 0..3 {
                    let old = spin[node][axis];
                    let pushed = moment(axis, node) / inertia[node] * 2e-4;
                    let new = held[usize::from(constraint[node])][axis].unwrap_or(kept * old + pushed);
                    assert!((w[axis][node] - new).abs() < 1e-12 * (1.0 + new.abs()), "{node} {axis}");
                    if booked {
                        // A quarter of the time between the velocities lies before `t_n`.
                        energy += 0.5 * inertia[node] * old * (0.5 * old + 0.5 * new);
                        done += 0.5 * inertia[node] * (new - old - pushed) * (old + new);
                    }
                }
            }
            assert!((kinetic / energy - 1.0).abs() < 1e-9, "{kinetic}, not {energy}");
            assert!((work.whole() - done).abs() <= 1e-9 * done.abs(), "{work:?}, not {done}");
            for width in Width::ALL.into_iter().filter(|width| width.available()) {
                assert_eq!(run(width), (w.clone(), (kinetic, work)), "{width}");
            }
        }
    }
}
