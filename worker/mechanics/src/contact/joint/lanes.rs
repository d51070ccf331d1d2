//! The first step of the reduction, many nodes at a time: the nearest face of each, whether all others are dropped by it,
//! and on which sides of it the node lies. Mostly that is all.

use std::ops::Range;

use super::super::{
    slots::Slots,
    zone::lanes::{CORNER, Closest, EDGE},
};
use crate::lanes::{Lane, SET, Width, dispatch::Task};

/// Square of the distance, in gaps, up to which the long way has to find out whether a node touches its feature: somewhat
/// more than [`is_on_feature`](super::is_on_feature) squared.
const TOUCHING: f64 = 1e-17;

/// The number of each lane in its set.
const LANES: [u32; SET] = [0, 1, 2, 3, 4, 5, 6, 7];

/// What is found of the nodes of some sets: by set, a bit for each lane.
#[derive(Clone, Debug, Default)]
pub(in crate::contact) struct Firsts {
    /// Nodes with a near face.
    pub(in crate::contact) near: Vec<u8>,
    /// Those of which the nearest drops all others, and that do not touch it.
    pub(in crate::contact) alone: Vec<u8>,
    /// On the outer side of a normal that meets at the closest point or on the inner side of one, not both.
    pub(in crate::contact) one_sided: Vec<u8>,
    /// By lane: which of the closest points is that of the nearest face; of equals the first.
    pub(in crate::contact) index: Vec<u32>,
    /// By lane: 1 on the outer side of a normal, else -1.
    pub(in crate::contact) sign: Vec<f64>,
}

impl Firsts {
    fn resize(&mut self, n_sets: usize) {
        let bits = [&mut self.near, &mut self.alone, &mut self.one_sided];
        for list in bits {
            list.clear();
            list.resize(n_sets, 0);
        }
        self.index.resize(SET * n_sets, 0);
        self.sign.resize(SET * n_sets, 0.0);
    }
}

/// The first step for the nodes of some sets, whose closest points are given. Nearer than `warning` is near.
///
/// # Panics
/// If a set is out of range, a slot has no closest points or the machine lacks the width.
pub(in crate::contact) fn firsts(
    width: Width,
    (gap, warning): (f64, f64),
    slots: &Slots,
    sets: Range<usize>,
    closest: &Closest,
    found: &mut Firsts,
) {
    slots.check(width, usize::MAX);
    assert!(sets.start <= sets.end && sets.end <= slots.n_sets(), "sets {sets:?} of {}", slots.n_sets());
    let n = SET * slots.of_sets(&sets).len();
    for list in [&closest.distance2, &closest.feature, &closest.highest, &closest.lowest] {
        assert!(list.len() >= n, "{} closest points of {n}", list.len());
    }
    found.resize(sets.len());
    let limits = [warning * warning, TOUCHING * gap * gap];
    width.run(FirstFaces { limits, slots, sets, closest, found });
}

/// The first faces of the nodes of sets, with lengths, width and room that have been checked.
struct FirstFaces<'a> {
    limits: [f64; 2],
    slots: &'a Slots,
    sets: Range<usize>,
    closest: &'a Closest,
    found: &'a mut Firsts,
}

impl Task for FirstFaces<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        let Self { limits, slots, sets, closest, found } = self;
        // SAFETY: the function above, which alone makes one, has checked.
        unsafe { kernel::<L>(limits, slots, sets, closest, found) }
    }
}

/// # Safety
/// Sets in range, closest points of all their slots, `found` with room for them.
#[inline(always)]
unsafe fn kernel<L: Lane>(
    [warning2, touching2]: [f64; 2],
    slots: &Slots,
    sets: Range<usize>,
    closest: &Closest,
    found: &mut Firsts,
) {
    let zero = L::splat(0.0);
    let warning2 = L::splat(warning2);
    let (first_set, base) = (sets.start, slots.of_sets(&sets).start);
    for set in sets {
        let of_set = slots.of_sets(&(set..set + 1));
        let mut lane = 0;
        while lane < SET {
            let (mut least, mut nearest) = (warning2, zero);
            let mut face = Face::<L> { feature: zero, corners: [zero; 4] };
            let (mut highest, mut lowest) = (zero, zero);
            for slot in of_set.clone() {
                let (from, at) = (SET * slot + lane, SET * (slot - base) + lane);
                // SAFETY: the caller's; N divides SET.
                unsafe {
                    let distance2 = L::load(&closest.distance2, at);
                    let nearer = distance2.less(least);
                    least = L::select(nearer, distance2, least);
                    nearest = L::select(nearer, L::splat((slot - of_set.start) as f64), nearest);
                    face = Face::chosen(nearer, &Face::load(slots, closest, from, at), &face);
                    highest = L::select(nearer, L::load(&closest.highest, at), highest);
                    lowest = L::select(nearer, L::load(&closest.lowest, at), lowest);
                }
            }
            let near = L::bits(least.less(warning2));
            let mut kept = 0;
            let ends = face.ends();
            for slot in of_set.clone() {
                let (from, at) = (SET * slot + lane, SET * (slot - base) + lane);
                let number = L::splat((slot - of_set.start) as f64);
                let another = L::either(number.less(nearest), nearest.less(number));
                // SAFETY: as above.
                unsafe {
                    let other = L::both(another, L::load(&closest.distance2, at).less(warning2));
                    if !L::any(other) {
                        continue;
                    }
                    let of_other = Face::load(slots, closest, from, at);
                    let shared = ends.belong(&of_other.corners);
                    let dropped = L::either(shared, of_other.ends().belong(&face.corners));
                    kept |= L::bits(other) & !L::bits(dropped);
                    let joined = L::both(other, shared);
                    highest = L::select(joined, L::load(&closest.highest, at).max(highest), highest);
                    lowest = L::select(joined, L::load(&closest.lowest, at).min(lowest), lowest);
                }
            }
            let touching = L::bits(least.less_equal(L::splat(touching2)));
            let at = set - first_set;
            found.near[at] |= (near << lane) as u8;
            found.alone[at] |= ((near & !kept & !touching) << lane) as u8;
            let outer = zero.less(highest);
            found.one_sided[at] |= ((L::bits(outer) ^ L::bits(lowest.less(zero))) << lane) as u8;
            let first = L::splat((SET * (of_set.start - base)) as f64);
            // SAFETY: as above.
            unsafe {
                let index = L::splat(SET as f64).mul_add(nearest, first + L::whole(&LANES, lane));
                index.store_whole(&mut found.index, SET * at + lane);
                L::select(outer, L::splat(1.0), L::splat(-1.0)).store(&mut found.sign, SET * at + lane);
            }
            lane += L::N;
        }
    }
}

/// A face and where on it the closest point lies.
#[derive(Clone, Copy)]
struct Face<L> {
    feature: L,
    /// Nodes of its corners.
    corners: [L; 4],
}

/// The nodes of a feature: a corner has one twice, the inside none.
#[derive(Clone, Copy)]
struct Ends<L: Lane> {
    first: L,
    second: L,
    is_edge: L::Mask,
    is_corner: L::Mask,
}

impl<L: Lane> Face<L> {
    /// # Safety
    /// Lane `from` of the slots and `at` of the closest points, and N behind them, exist.
    #[inline(always)]
    unsafe fn load(slots: &Slots, closest: &Closest, from: usize, at: usize) -> Self {
        let of = slots.corners();
        // SAFETY: the caller's.
        unsafe {
            Self {
                feature: L::load(&closest.feature, at),
                corners: [
                    L::whole(&of[0], from),
                    L::whole(&of[1], from),
                    L::whole(&of[2], from),
                    L::whole(&of[3], from),
                ],
            }
        }
    }

    #[inline(always)]
    fn chosen(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            feature: L::select(mask, yes.feature, no.feature),
            corners: [
                L::select(mask, yes.corners[0], no.corners[0]),
                L::select(mask, yes.corners[1], no.corners[1]),
                L::select(mask, yes.corners[2], no.corners[2]),
                L::select(mask, yes.corners[3], no.corners[3]),
            ],
        }
    }

    /// The nodes of the feature.
    #[inline(always)]
    fn ends(&self) -> Ends<L> {
        let is_corner = L::splat(CORNER - 0.5).less(self.feature);
        let is_edge =
            L::both(L::splat(EDGE - 0.5).less(self.feature), self.feature.less(L::splat(CORNER - 0.5)));
        let number = self.feature - L::select(is_corner, L::splat(CORNER), L::splat(EDGE));
        let [a, b, c, d] = self.corners;
        let past = [number.less(L::splat(0.5)), number.less(L::splat(1.5)), number.less(L::splat(2.5))];
        let first = L::select(past[0], a, L::select(past[1], b, L::select(past[2], c, d)));
        let second = L::select(past[0], b, L::select(past[1], c, L::select(past[2], d, a)));
        Ends { first, second, is_edge, is_corner }
    }
}

impl<L: Lane> Ends<L> {
    /// [`shares`](super::shares) with a face that has these corners.
    #[inline(always)]
    fn belong(&self, corners: &[L; 4]) -> L::Mask {
        let [a, b, c, d] = *corners;
        let first_even = L::either(self.first.equal(a), self.first.equal(c));
        let first_odd = L::either(self.first.equal(b), self.first.equal(d));
        let second_even = L::either(self.second.equal(a), self.second.equal(c));
        let second_odd = L::either(self.second.equal(b), self.second.equal(d));
        let edge = L::either(L::both(first_even, second_odd), L::both(first_odd, second_even));
        let corner = L::either(first_even, first_odd);
        L::either(L::both(self.is_edge, edge), L::both(self.is_corner, corner))
    }
}
