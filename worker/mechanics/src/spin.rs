//! Rotation of nodes, where a kind of elements turns them: `w_{n+1/2} = w_{n-1/2} + m/I (dt_{n-1} + dt_n)/2`.
//!
//! As for the rest of a node, every block that has a copy does this with the same total moment and inertia and gets the
//! same bits; the booked copy alone counts. Nodes are few beside the work of their elements, so this is plain code.

use crate::{
    lanes::SET,
    nodes::{Advance, NodeSet},
    work::Work,
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

/// Advances the rotation rates of the nodes of a block and clears the moments; gives the kinetic energy of rotation
/// `sum 1/2 I w_{n-1/2} . w_{n+1/2}` of the booked nodes, and the work that relaxation does on them. What clamps a
/// node does no work: it does not turn.
pub(crate) fn advance(
    advance: &Advance<'_>,
    turning: &mut Turning,
    constraint: &[u16],
    sets: &[NodeSet],
) -> (f64, Work) {
    let half_steps = 0.5 * (advance.dt_previous + advance.dt);
    let middle = 0.5f64.mul_add(advance.dt, advance.time);
    let relaxation = advance.loads.relaxation.filter(|r| advance.time < r.until);
    let loss = relaxation.map_or(0.0, |r| 1.0 - r.factor);
    let energy = advance.quanta.energy;
    let (mut kinetic, mut external) = (0.0, Work::default());
    for (i, &held) in constraint.iter().enumerate() {
        let clamped = advance.constraints[held as usize].clamped_at(middle);
        let inertia = turning.inertia[i];
        let scale = half_steps / inertia;
        let (mut product, mut work) = (0.0, Work::default());
        for axis in 0..3 {
            let old = turning.w[axis][i];
            let mut new = turning.m[axis][i].mul_add(scale, old);
            if loss > 0.0 {
                let change = -loss * old;
                new += change;
                work.merge(Work { before: 0.5 * change * old, after: 0.5 * change * new });
            }
            if clamped >> axis & 1 == 1 {
                new = 0.0;
            }
            turning.w[axis][i] = new;
            turning.m[axis][i] = 0.0;
            product = old.mul_add(if advance.dt_previous == 0.0 { old } else { new }, product);
        }
        if sets[i / SET].booked >> (i % SET) & 1 == 1 {
            kinetic += energy.round(0.5 * inertia * product);
            let [before, after] = [work.before, work.after].map(|half| energy.round(inertia * half));
            external.merge(Work { before, after });
        }
    }
    (kinetic, external)
}
