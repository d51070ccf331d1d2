//! Closest points of many pairs at a time, to the bits of [`Frame::nearest`](super::Frame::nearest).
//!
//! Operation by operation what the frame does for one face and one node; where that branches, lanes compute
//! what any of them needs and select. A pair measures its face anew: its twelve coordinates are fewer than
//! the forty numbers of a frame. Small whole numbers (features, triangles) travel as f64.

use std::ops::Range;

use super::{
    Feature, INNER, Nearest, OUTER,
    point::{Point, inside, on_rim},
    vectors::{V, corners, from_each, points},
};
use crate::{
    contact::{near_pairs::NearPairs, slots::Slots},
    lanes::{Lane, SET, Width, dispatch::Task},
};

/// Closest points, by lane of each slot of some sets.
#[derive(Clone, Debug, Default)]
pub(in crate::contact) struct Closest {
    /// Square of the distance (length squared); infinite for what is no pair or not near.
    pub(in crate::contact) distance2: Vec<f64>,
    /// From the closest point to the node (length).
    pub(in crate::contact) vector: [Vec<f64>; 3],
    /// Where on the face: [`FACE`], [`EDGE`] and [`CORNER`] with their numbers added.
    pub(in crate::contact) feature: Vec<f64>,
    /// The triangle that the point lies on, or [`PLANE`].
    pub(in crate::contact) triangle: Vec<f64>,
    /// Greatest and least product of the vector with the normals that meet at the point, of any length.
    pub(in crate::contact) highest: Vec<f64>,
    pub(in crate::contact) lowest: Vec<f64>,
    /// Shares of the mid-point and of corners `triangle` and `triangle + 1`.
    pub(in crate::contact) shares: [Vec<f64>; 3],
}

/// The pairs of which the closest point is not plainly on the rim, gathered so that every lane has one.
#[derive(Clone, Debug, Default)]
pub(in crate::contact) struct Rest {
    pairs: NearPairs,
    /// Where among all closest points each belongs.
    at: Vec<u32>,
    points: Closest,
}

impl Rest {
    /// Room for so many pairs, whole sets, lest a cycle that finds more of them than those before takes memory.
    fn reserve(&mut self, n: usize) {
        self.pairs.reserve(n);
        self.at.reserve(n.saturating_sub(self.at.len()));
        if self.points.distance2.len() < n {
            self.points.resize(n);
        }
    }
}

/// The inside of a face.
pub(in crate::contact) const FACE: f64 = 0.0;
/// Edge 0; the others follow.
pub(in crate::contact) const EDGE: f64 = 1.0;
/// Corner 0; the others follow.
pub(in crate::contact) const CORNER: f64 = 5.0;

impl Closest {
    /// Puts closest points of another list to their places.
    ///
    /// # Panics
    /// If a place or a point does not exist.
    fn put(&mut self, places: &[u32], points: &Self) {
        put(&mut self.distance2, places, &points.distance2);
        put(&mut self.feature, places, &points.feature);
        put(&mut self.triangle, places, &points.triangle);
        put(&mut self.highest, places, &points.highest);
        put(&mut self.lowest, places, &points.lowest);
        for a in 0..3 {
            put(&mut self.vector[a], places, &points.vector[a]);
            put(&mut self.shares[a], places, &points.shares[a]);
        }
    }

    fn resize(&mut self, n: usize) {
        let numbers =
            [&mut self.distance2, &mut self.feature, &mut self.triangle, &mut self.highest, &mut self.lowest];
        let vectors = self.vector.iter_mut().chain(&mut self.shares);
        numbers.into_iter().chain(vectors).for_each(|values| values.resize(n, 0.0));
    }

    /// Where on its face the closest point of a pair lies.
    #[inline(always)]
    pub(in crate::contact) fn feature(&self, i: usize) -> Feature {
        match self.feature[i] as u32 {
            0 => Feature::Face,
            edge @ 1..5 => Feature::Edge(edge as u8 - 1),
            corner => Feature::Corner((corner as u8).wrapping_sub(5) & 3),
        }
    }

    /// [`Nearest::sides`] of a pair.
    #[inline(always)]
    pub(in crate::contact) fn sides(&self, i: usize) -> u8 {
        let outer = if self.highest[i] > 0.0 { OUTER } else { 0 };
        let inner = if self.lowest[i] < 0.0 { INNER } else { 0 };
        outer | inner
    }

    /// The closest point of one pair.
    pub(in crate::contact) fn nearest(&self, i: usize) -> Nearest {
        Nearest {
            feature: self.feature(i),
            distance2: self.distance2[i],
            vector: [self.vector[0][i], self.vector[1][i], self.vector[2][i]],
            sides: self.sides(i),
            triangle: self.triangle[i] as u8,
            shares: [self.shares[0][i], self.shares[1][i], self.shares[2][i]],
        }
    }
}

#[inline(always)]
fn put(list: &mut [f64], places: &[u32], values: &[f64]) {
    for (&place, &value) in places.iter().zip(values) {
        list[place as usize] = value;
    }
}

/// Closest points of the pairs of some sets, whose first lane of the first slot is number 0. `rows` by batch node: the
/// position, and a number that is not read. Where the face's box, grown by `grow`, does not hold the node
/// ([`Bounds::holds`](crate::contact::search::Bounds::holds)) the distance is infinite and the rest means nothing.
/// The result does not depend on the width.
///
/// # Panics
/// If a set or an index is out of range or the machine lacks the width.
pub(in crate::contact) fn nearest(
    width: Width,
    rows: &[[f64; 4]],
    grow: f64,
    slots: &Slots,
    sets: Range<usize>,
    found: &mut Closest,
    rest: &mut Rest,
) {
    slots.check(width, rows.len());
    assert!(sets.start <= sets.end && sets.end <= slots.n_sets(), "sets {sets:?} of {}", slots.n_sets());
    let n = SET * slots.of_sets(&sets).len();
    found.resize(n);
    rest.reserve(n);
    width.run(ClosestPoints { rows, grow, slots, sets, found, rest });
}

/// The closest points of sets, with indices, width and room that [`nearest`] has checked.
struct ClosestPoints<'a> {
    rows: &'a [[f64; 4]],
    grow: f64,
    slots: &'a Slots,
    sets: Range<usize>,
    found: &'a mut Closest,
    rest: &'a mut Rest,
}

impl Task for ClosestPoints<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        let Self { rows, grow, slots, sets, found, rest } = self;
        // SAFETY: `nearest`, which alone makes one, has checked.
        unsafe { kernel::<L>(rows, grow, slots, sets, found, rest) }
    }
}

/// # Safety
/// Sets in range, their nodes below the rows; `found` with room for their slots.
#[inline(always)]
unsafe fn kernel<L: Lane>(
    rows: &[[f64; 4]],
    grow: f64,
    slots: &Slots,
    sets: Range<usize>,
    found: &mut Closest,
    rest: &mut Rest,
) {
    let (far, grow) = (L::splat(f64::INFINITY), L::splat(grow));
    let base = slots.of_sets(&sets).start;
    rest.pairs.clear();
    rest.at.clear();
    for set in sets {
        let of_set = slots.of_sets(&(set..set + 1));
        let mut lane = 0;
        while lane < SET {
            // SAFETY: the caller's; `lane + N` is within the set because N divides SET.
            let (p, count): (V<L>, L) = unsafe {
                (points(rows, slots.node(), SET * set + lane), L::whole(slots.count(), SET * set + lane))
            };
            for slot in of_set.clone() {
                let (from, at) = (SET * slot + lane, SET * (slot - base) + lane);
                let own = L::splat((slot - of_set.start) as f64).less(count);
                // SAFETY: as above; `found` has room for the slots of the sets.
                unsafe {
                    let x = corners::<L>(rows, slots.corners(), from);
                    let w = from_each(&x, p);
                    let held = L::both(own, holds(&w, grow));
                    if !L::any(held) {
                        far.store(&mut found.distance2, at);
                        continue;
                    }
                    let (rim, point) = on_rim(&w);
                    point.store(found, at);
                    L::select(held, point.distance2, far).store(&mut found.distance2, at);
                    let mut others = L::bits(held) & !L::bits(rim);
                    while others != 0 {
                        let i = others.trailing_zeros() as usize;
                        others &= others - 1;
                        rest.pairs.push(slots, SET * set + lane + i, from + i);
                        rest.at.push((at + i) as u32);
                    }
                }
            }
            lane += L::N;
        }
    }
    rest.pairs.fill_up();
    let mut at = 0;
    while at < rest.pairs.node().len() {
        // SAFETY: nodes are those of the slots; the points have room for all pairs, whole sets.
        unsafe {
            let p: V<L> = points(rows, rest.pairs.node(), at);
            let x = corners::<L>(rows, rest.pairs.corners(), at);
            let w = from_each(&x, p);
            inside(&x, &w).store(&mut rest.points, at);
        }
        at += L::N;
    }
    found.put(&rest.at, &rest.points);
}

/// Whether the box of four corners, grown on all sides, holds a node that is at `w` from the corners.
#[inline(always)]
fn holds<L: Lane>(w: &[V<L>; 4], grow: L) -> L::Mask {
    L::both(
        spans([w[0][0], w[1][0], w[2][0], w[3][0]], grow),
        L::both(
            spans([w[0][1], w[1][1], w[2][1], w[3][1]], grow),
            spans([w[0][2], w[1][2], w[2][2], w[3][2]], grow),
        ),
    )
}

/// [`holds`] along one axis.
#[inline(always)]
fn spans<L: Lane>([a, b, c, d]: [L; 4], grow: L) -> L::Mask {
    let least = a.min(b).min(c.min(d));
    let greatest = a.max(b).max(c.max(d));
    L::both(least.less_equal(grow), (-grow).less_equal(greatest))
}

impl<L: Lane> Point<L> {
    /// # Safety
    /// `at + N` points have room.
    #[inline(always)]
    unsafe fn store(&self, to: &mut Closest, at: usize) {
        // SAFETY: the caller's.
        unsafe {
            self.distance2.store(&mut to.distance2, at);
            self.feature.store(&mut to.feature, at);
            self.triangle.store(&mut to.triangle, at);
            self.highest.store(&mut to.highest, at);
            self.lowest.store(&mut to.lowest, at);
            self.vector[0].store(&mut to.vector[0], at);
            self.vector[1].store(&mut to.vector[1], at);
            self.vector[2].store(&mut to.vector[2], at);
            self.shares[0].store(&mut to.shares[0], at);
            self.shares[1].store(&mut to.shares[1], at);
            self.shares[2].store(&mut to.shares[2], at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{
        search::{Bounds, Candidates},
        zone::{
            Frame,
            approach::{Approach, approach},
        },
    };

    /// Bits, but for the sign of zeros.
    fn bits(nearest: &Nearest) -> (Feature, u8, u8, [u64; 7]) {
        let (v, s) = (nearest.vector, nearest.shares);
        let values = [nearest.distance2, v[0], v[1], v[2], s[0], s[1], s[2]];
        (nearest.feature, nearest.sides, nearest.triangle, values.map(|value| (value + 0.0).to_bits()))
    }

    #[test]
    fn lanes_of_every_width_have_the_bits_of_a_frame() {
        let mut seed = 5_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut rows: Vec<[f64; 4]> = Vec::new();
        let (mut frames, mut nodes, mut faces, mut quads) = (vec![], vec![], vec![], vec![]);
        for round in 0..20_000_u32 {
            let mut quad = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
            // Coplanar, warped, hardly warped, or with two corners in one.
            for corner in &mut quad {
                (0..2).for_each(|a| corner[a] += 0.6 * random() * f64::from(round % 3));
                corner[2] += [0.0, 0.4, 1e-9, 0.0, 0.4][round as usize % 5] * random();
            }
            if round % 11 == 0 {
                quad[3] = quad[2];
            }
            let mut p = [0.5 + 1.8 * random(), 0.5 + 1.8 * random(), 0.8 * random()];
            // On a corner, on an edge, over the mid-point, over a spoke.
            let mean = |a: usize, of: &[usize]| of.iter().map(|&i| quad[i][a]).sum::<f64>() / of.len() as f64;
            match round % 7 {
                0 => p = quad[1],
                1 => (0..2).for_each(|a| p[a] = mean(a, &[1, 2])),
                2 => (0..2).for_each(|a| p[a] = mean(a, &[0, 1, 2, 3])),
                3 => (0..2).for_each(|a| p[a] = 0.5 * (quad[2][a] + mean(a, &[0, 1, 2, 3]))),
                _ => {}
            }
            let first = rows.len() as u32;
            for [x, y, z] in [p, quad[0], quad[1], quad[2], quad[3]] {
                rows.push([x, y, z, f64::NAN]);
            }
            faces.push([1, 2, 3, 4].map(|i| first + i));
            nodes.push(first);
            frames.push((Frame::new(&quad), p));
            quads.push(quad);
        }
        let held: Vec<u32> = (0..nodes.len() as u32).collect();
        let starts: Vec<u32> = (0..=nodes.len() as u32).collect();
        let (mut slots, mut pairs) = (Slots::default(), NearPairs::default());
        slots.take(&Candidates { nodes, starts, faces: held.clone() }, &faces);
        // One face each: slots and lanes are numbered as the pairs are.
        pairs.choose(&slots, &held, 0, &held);
        let all = 0..slots.n_sets();
        let mut counts = [0; 11];
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            let (mut found, mut rest) = (Closest::default(), Rest::default());
            nearest(width, &rows, 0.3, &slots, all.clone(), &mut found, &mut rest);
            let within = found.distance2.clone();
            nearest(width, &rows, f64::INFINITY, &slots, all.clone(), &mut found, &mut rest);
            let mut near =
                Approach { index: held.clone(), sign: vec![1.0; held.len()], ..Approach::default() };
            near.fill_up();
            approach(width, &rows, 0.3, &pairs, &found, &mut near);
            let weighed = &near.weights;
            for (i, (frame, p)) in frames.iter().enumerate() {
                let wanted = frame.nearest(*p);
                let holds = Bounds::of(&quads[i], 0.3).holds(*p);
                assert_eq!(within[i], if holds { wanted.distance2 } else { f64::INFINITY }, "{width}");
                counts[9 + usize::from(holds)] += 1;
                assert_eq!(bits(&found.nearest(i)), bits(&wanted), "{width}: {frame:?} {p:?}");
                let of = frame.weights(&wanted, *p).map(|w| (w + 0.0).to_bits());
                assert_eq!(
                    [0, 1, 2, 3].map(|k| (weighed[k][i] + 0.0).to_bits()),
                    of,
                    "{width}: {frame:?} {p:?}"
                );
                counts[found.feature[i] as usize] += 1;
            }
        }
        assert!(counts.iter().all(|&count| count > 100), "every feature was met: {counts:?}");
    }
}
