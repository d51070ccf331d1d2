//! Forces of many hits at a time without friction, to the bits of [`react`](super::react).

use super::{BOTH_SIDES, spring::Hardening};
use crate::{
    contact::near_pairs::NearPairs,
    exact::{Quantum, rounded},
    lanes::{Lane, SET, Width, dispatch::Task},
};

/// Static data of nodes and faces.
#[derive(Clone, Debug, Default)]
pub(in crate::contact) struct Statics {
    /// By batch node: the deck's factor times the node's share.
    pub(in crate::contact) factor: Vec<f64>,
    /// By batch node: `K A^2 / V` (force per length).
    pub(in crate::contact) stiffness: Vec<f64>,
    /// By batch node: one over its mass.
    pub(in crate::contact) inverse_mass: Vec<f64>,
    /// By face: `K A^2 / V` (force per length).
    pub(in crate::contact) face_stiffness: Vec<f64>,
    /// By batch node: stiffness by its mass ([`least`](super::least)).
    pub(in crate::contact) least: Vec<f64>,
    /// By face: that of the lightest of its corners.
    pub(in crate::contact) face_least: Vec<f64>,
}

impl Statics {
    /// Stiffness of a node at a face.
    #[inline(always)]
    pub(in crate::contact) fn stiffness(&self, node: usize, face: usize) -> f64 {
        let moduli = [self.stiffness[node], self.face_stiffness[face]];
        super::between(self.factor[node], moduli, [self.least[node], self.face_least[face]])
    }
}

/// Features near nodes, by pair of a [`NearPairs`]; those beyond the gap have depth zero.
#[derive(Clone, Copy)]
pub(in crate::contact) struct Pushes<'a> {
    /// Index of the face among the static data.
    pub(in crate::contact) face: &'a [u32],
    /// Depth in the zone (length).
    pub(in crate::contact) depth: &'a [f64],
    /// Unit vector of the force on the node.
    pub(in crate::contact) direction: &'a [Vec<f64>; 3],
    pub(in crate::contact) share: &'a [f64],
    /// How many springs act on the node along one direction.
    pub(in crate::contact) stacking: &'a [f64],
    /// Shape functions of the corners.
    pub(in crate::contact) weights: &'a [Vec<f64>; 4],
    pub(in crate::contact) hardening: Hardening,
}

/// Forces by pair: three of the node, then three of each corner; multiples of the force quantum.
pub(in crate::contact) type Terms = [Vec<f64>; 15];

/// What all pairs together say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::contact) struct Sums {
    /// Energy in the springs, an exact sum.
    pub(in crate::contact) energy: f64,
    /// Greatest component of a force.
    pub(in crate::contact) force_bound: f64,
    /// Greatest squared frequency.
    pub(in crate::contact) frequency2: f64,
    /// Greatest depth (length).
    pub(in crate::contact) deepest: f64,
}

/// Forces of all pairs. The result does not depend on the width.
///
/// # Panics
/// If a list is shorter than the pairs, an index is out of range or the machine lacks the width.
pub(in crate::contact) fn push(
    width: Width,
    statics: &Statics,
    pairs: &NearPairs,
    pushes: Pushes,
    (force_quantum, energy_quantum): (Quantum, Quantum),
    terms: &mut Terms,
) -> Sums {
    let n = pairs.node().len();
    let highest = pushes.face.iter().fold(0, |highest, &i| if i > highest { i } else { highest });
    assert!(pushes.face.len() == n && (n == 0 || (highest as usize) < statics.face_stiffness.len()));
    let n_nodes = statics.factor.len();
    let by_node = [&statics.stiffness, &statics.inverse_mass, &statics.least];
    assert!(by_node.iter().all(|list| list.len() == n_nodes));
    assert!(statics.face_least.len() == statics.face_stiffness.len());
    let lists = pushes.direction.iter().chain(pushes.weights).map(Vec::len);
    let lengths = lists.chain([pushes.depth.len(), pushes.share.len(), pushes.stacking.len()]);
    lengths.for_each(|length| assert!(length == n, "{length} values of {n} pairs"));
    pairs.check(width, n_nodes);
    terms.iter_mut().for_each(|values| values.resize(n, 0.0));
    let magic = [force_quantum.magic(), energy_quantum.magic()];
    width.run(Push { statics, pairs, pushes, magic, terms })
}

/// The forces of pairs, indices, lengths and width of which [`push`] has checked.
struct Push<'a> {
    statics: &'a Statics,
    pairs: &'a NearPairs,
    pushes: Pushes<'a>,
    magic: [f64; 2],
    terms: &'a mut Terms,
}

impl Task for Push<'_> {
    type Output = Sums;

    #[inline(always)]
    fn run<L: Lane>(self) -> Sums {
        let Self { statics, pairs, pushes, magic, terms } = self;
        // SAFETY: `push`, which alone makes one, has checked.
        unsafe { kernel::<L>(statics, pairs, pushes, magic, terms) }
    }
}

/// # Safety
/// All lists as long as the pairs, whole sets; indices in range.
#[inline(always)]
unsafe fn kernel<L: Lane>(
    statics: &Statics,
    pairs: &NearPairs,
    pushes: Pushes,
    magic: [f64; 2],
    terms: &mut Terms,
) -> Sums {
    let zero = L::splat(0.0);
    let (force_magic, energy_magic) = (L::splat(magic[0]), L::splat(magic[1]));
    let (mut energy, mut bound, mut frequency2, mut deepest) = (zero, zero, zero, zero);
    let mut at = 0;
    while at < pairs.node().len() {
        // SAFETY: the caller's; `at + N` is within the lists because N divides SET.
        unsafe {
            let factor = L::gather(&statics.factor, pairs.node(), at);
            let of_node = L::gather(&statics.stiffness, pairs.node(), at);
            let of_face = L::gather(&statics.face_stiffness, pushes.face, at);
            let sum = of_node + of_face;
            let mean = L::splat(2.0) * of_node * of_face / sum;
            let k = L::select(zero.less(sum), factor * mean, zero);
            let of_node = L::gather(&statics.least, pairs.node(), at);
            let of_face = L::gather(&statics.face_least, pushes.face, at);
            let sum = of_node + of_face;
            let mean = L::splat(2.0) * of_node * of_face / sum;
            let k = L::select(zero.less(sum), L::splat(0.5) * mean, zero).max(k);
            let weights = [
                L::load(&pushes.weights[0], at),
                L::load(&pushes.weights[1], at),
                L::load(&pushes.weights[2], at),
                L::load(&pushes.weights[3], at),
            ];
            let mut inverse_mass = L::gather(&statics.inverse_mass, pairs.node(), at);
            let mut i = 0;
            while i < 4 {
                let of_corner = L::gather(&statics.inverse_mass, &pairs.corners()[i], at);
                inverse_mass = (weights[i] * weights[i]).mul_add(of_corner, inverse_mass);
                i += 1;
            }
            let stacking = L::load(pushes.stacking, at);
            let depth = L::load(pushes.depth, at);
            deepest = depth.max(deepest);
            let tangent = pushes.hardening.tangent(depth);
            frequency2 = (L::splat(BOTH_SIDES) * stacking * (k * tangent) * inverse_mass).max(frequency2);
            let spring = pushes.hardening.spring(k * L::load(pushes.share, at), depth);
            let mut a = 0;
            while a < 3 {
                let force = spring.force * L::load(&pushes.direction[a], at);
                let corners = [
                    rounded(-(weights[0] * force), force_magic),
                    rounded(-(weights[1] * force), force_magic),
                    rounded(-(weights[2] * force), force_magic),
                    rounded(-(weights[3] * force), force_magic),
                ];
                let node = -((corners[0] + corners[1]) + (corners[2] + corners[3]));
                bound = node.abs().max(bound);
                node.store(&mut terms[a], at);
                corners[0].store(&mut terms[3 + a], at);
                corners[1].store(&mut terms[6 + a], at);
                corners[2].store(&mut terms[9 + a], at);
                corners[3].store(&mut terms[12 + a], at);
                a += 1;
            }
            energy = energy + rounded(spring.energy, energy_magic);
        }
        at += L::N;
    }
    let mut sums = Sums::default();
    let (energy, bound) = (energy.to_array(), bound.to_array());
    let (frequency2, deepest) = (frequency2.to_array(), deepest.to_array());
    for i in 0..SET {
        sums.energy += energy[i];
        sums.force_bound = if bound[i] > sums.force_bound { bound[i] } else { sums.force_bound };
        sums.deepest = if deepest[i] > sums.deepest { deepest[i] } else { sums.deepest };
        sums.frequency2 = if frequency2[i] > sums.frequency2 { frequency2[i] } else { sums.frequency2 };
    }
    sums
}
