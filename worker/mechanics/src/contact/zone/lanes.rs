//! Closest points of many pairs at a time, to the bits of [`Frame::nearest`](super::Frame::nearest).
//!
//! Operation by operation what the frame does for one face and one node; where that branches, lanes compute
//! what any of them needs and select. A pair measures its face anew: its twelve coordinates are fewer than
//! the forty numbers of a frame. Small whole numbers (features, triangles) travel as f64.

use std::ops::Range;

use super::{
    COPLANAR, Feature, INNER, JOINT, Nearest, OUTER, PLANE,
    vectors::{V, before, choose, cross, dot, inverse, middle, points, sub},
};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{avx2::Avx2, avx512::Avx512};
use crate::{
    contact::{pairs::Pairs, slots::Slots},
    lanes::{Lane, SET, Width, scalar::Scalar},
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
    pairs: Pairs,
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
    match width {
        // SAFETY: sets, indices and width have been checked; `found` has room for the slots of the sets.
        Width::Scalar => unsafe { kernel::<Scalar>(rows, grow, slots, sets, found, rest) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Width::Avx2 => unsafe { on_avx2(rows, grow, slots, sets, found, rest) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Width::Avx512 => unsafe { on_avx512(rows, grow, slots, sets, found, rest) },
        #[cfg(not(target_arch = "x86_64"))]
        Width::Avx2 | Width::Avx512 => unreachable!("not available"),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn on_avx2(
    rows: &[[f64; 4]],
    grow: f64,
    slots: &Slots,
    sets: Range<usize>,
    found: &mut Closest,
    rest: &mut Rest,
) {
    // SAFETY: the caller's.
    unsafe { kernel::<Avx2>(rows, grow, slots, sets, found, rest) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
unsafe fn on_avx512(
    rows: &[[f64; 4]],
    grow: f64,
    slots: &Slots,
    sets: Range<usize>,
    found: &mut Closest,
    rest: &mut Rest,
) {
    // SAFETY: the caller's.
    unsafe { kernel::<Avx512>(rows, grow, slots, sets, found, rest) }
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
                    let w = [sub(p, x[0]), sub(p, x[1]), sub(p, x[2]), sub(p, x[3])];
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
            let w = [sub(p, x[0]), sub(p, x[1]), sub(p, x[2]), sub(p, x[3])];
            inside(&x, &w).store(&mut rest.points, at);
        }
        at += L::N;
    }
    found.put(&rest.at, &rest.points);
}

/// # Safety
/// As [`Lane::rows`] of each list.
#[inline(always)]
unsafe fn corners<L: Lane>(rows: &[[f64; 4]], of: &[Vec<u32>; 4], at: usize) -> [V<L>; 4] {
    // SAFETY: the caller's.
    unsafe {
        [
            points(rows, &of[0], at),
            points(rows, &of[1], at),
            points(rows, &of[2], at),
            points(rows, &of[3], at),
        ]
    }
}

/// From each corner to the next.
#[inline(always)]
fn edges<L: Lane>(x: &[V<L>; 4]) -> [V<L>; 4] {
    [sub(x[1], x[0]), sub(x[2], x[1]), sub(x[3], x[2]), sub(x[0], x[3])]
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

/// Closest points in lanes.
#[derive(Clone, Copy)]
struct Point<L> {
    distance2: L,
    vector: V<L>,
    feature: L,
    triangle: L,
    highest: L,
    lowest: L,
    shares: V<L>,
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

/// `yes` where the mask is set, else `no`.
#[inline(always)]
fn choose_point<L: Lane>(mask: L::Mask, yes: &Point<L>, no: &Point<L>) -> Point<L> {
    Point {
        distance2: L::select(mask, yes.distance2, no.distance2),
        vector: choose(mask, yes.vector, no.vector),
        feature: L::select(mask, yes.feature, no.feature),
        triangle: L::select(mask, yes.triangle, no.triangle),
        highest: L::select(mask, yes.highest, no.highest),
        lowest: L::select(mask, yes.lowest, no.lowest),
        shares: choose(mask, yes.shares, no.shares),
    }
}

/// Closest points of faces with corners `x` to nodes at `w` from them, where those are not plainly on the rim.
#[inline(always)]
fn inside<L: Lane>(x: &[V<L>; 4], w: &[V<L>; 4]) -> Point<L> {
    let edges = edges(x);
    let (d0, d1) = (sub(x[2], x[0]), sub(x[3], x[1]));
    let area = cross(d0, d1);
    let size2 = dot(area, area);
    let span2 = L::splat(0.5) * (dot(d0, d0) + dot(d1, d1));
    // Twice as far from coplanar as the limit: no rounding makes such faces flat, and no root is needed to see it.
    let volume = dot(area, edges[0]);
    let nearly = (volume * volume).less_equal(L::splat(4.0 * COPLANAR * COPLANAR) * span2 * size2);
    if !L::any(nearly) {
        return on_triangles(w);
    }
    let inverse_size = inverse(size2.sqrt());
    let normal = [inverse_size * area[0], inverse_size * area[1], inverse_size * area[2]];
    let offset = dot(normal, edges[0]);
    let coplanar = (offset * offset).less_equal(L::splat(COPLANAR * COPLANAR) * span2);
    if !L::any(coplanar) {
        return on_triangles(w);
    }
    let outward =
        [cross(edges[0], normal), cross(edges[1], normal), cross(edges[2], normal), cross(edges[3], normal)];
    let least = -(L::splat(1e-8) * (size2 * inverse_size));
    let convex = L::both(
        L::both(dot(outward[0], edges[1]).less(least), dot(outward[1], edges[2]).less(least)),
        L::both(dot(outward[2], edges[3]).less(least), dot(outward[3], edges[0]).less(least)),
    );
    let flat = L::both(convex, coplanar);
    let plane = on_plane(w, &edges, normal, &outward);
    if L::bits(flat) == (1 << L::N) - 1 {
        return plane;
    }
    choose_point(flat, &plane, &on_triangles(w))
}

/// Feature at fraction `u` of an edge.
#[inline(always)]
fn edge_feature<L: Lane>(u: L, from: L, to: L, edge: L) -> L {
    let feature = L::select(L::splat(1.0 - JOINT).less_equal(u), to, edge);
    L::select(u.less_equal(L::splat(JOINT)), from, feature)
}

/// An edge of a face, from one corner to the next, and the corner before them.
#[derive(Clone, Copy)]
struct Along<L> {
    number: L,
    /// From the corners to the node: the one before, start and end.
    before: V<L>,
    start: V<L>,
    end: V<L>,
    /// Product of the edge with the vector from its start to the node.
    at: L,
    length2: L,
}

impl<L: Lane> Along<L> {
    #[inline(always)]
    fn chosen(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            number: L::select(mask, yes.number, no.number),
            before: choose(mask, yes.before, no.before),
            start: choose(mask, yes.start, no.start),
            end: choose(mask, yes.end, no.end),
            at: L::select(mask, yes.at, no.at),
            length2: L::select(mask, yes.length2, no.length2),
        }
    }
}

/// Where the closest point is plainly on the rim, and that point; `w` from the corners to the node.
#[inline(always)]
fn on_rim<L: Lane>(w: &[V<L>; 4]) -> (L::Mask, Point<L>) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let edges = [sub(w[0], w[1]), sub(w[1], w[2]), sub(w[2], w[3]), sub(w[3], w[0])];
    let length2 =
        [dot(edges[0], edges[0]), dot(edges[1], edges[1]), dot(edges[2], edges[2]), dot(edges[3], edges[3])];
    let turn =
        [dot(edges[0], edges[1]), dot(edges[1], edges[2]), dot(edges[2], edges[3]), dot(edges[3], edges[0])];
    let t = [dot(w[0], edges[0]), dot(w[1], edges[1]), dot(w[2], edges[2]), dot(w[3], edges[3])];
    let past = [t[0] - length2[0], t[1] - length2[1], t[2] - length2[2], t[3] - length2[3]];
    let joint = L::splat(JOINT);
    let joint = [joint * length2[0], joint * length2[1], joint * length2[2], joint * length2[3]];
    let mut rim = one.less(zero);
    let mut best =
        Along { number: L::splat(3.0), before: w[2], start: w[3], end: w[0], at: t[3], length2: length2[3] };
    // From the last to the first, which overrides those behind it.
    let mut i = 4;
    while i > 0 {
        i -= 1;
        let (j, l) = ((i + 1) & 3, (i + 3) & 3);
        let next = t[j] + turn[i];
        let corner = L::both(
            t[i].less_equal(joint[i]),
            L::both((-joint[l]).less_equal(past[l]), (t[i] + next).less_equal(zero)),
        );
        let ahead = (length2[i] * next).less_equal(t[i] * turn[i]);
        let behind = (t[i] * turn[l]).less_equal(length2[i] * past[l]);
        let between = L::both(joint[i].less(t[i]), past[i].less(-joint[i]));
        let here = L::either(corner, L::both(between, L::both(ahead, behind)));
        rim = L::either(rim, here);
        if i < 3 {
            let (before, start, end) = (w[l], w[i], w[j]);
            let number = L::splat(i as f64);
            let along = Along { number, before, start, end, at: t[i], length2: length2[i] };
            best = Along::chosen(here, &along, &best);
        }
    }
    let is_edge = (L::splat(JOINT) * best.length2).less(best.at);
    let u = L::select(is_edge, best.at / best.length2, zero);
    let edge = sub(best.start, best.end);
    let vector = before(best.start, u, edge);
    // The triangle of the edge; at a corner also that of the edge before.
    let spoke = sub(middle(w), best.start);
    let side = dot(cross(spoke, edge), vector);
    let other = L::select(is_edge, side, dot(cross(spoke, sub(best.before, best.start)), vector));
    let feature = best.number + L::select(is_edge, L::splat(EDGE), L::splat(CORNER));
    let point = Point {
        distance2: dot(vector, vector),
        vector,
        feature,
        triangle: best.number,
        highest: other.max(side),
        lowest: other.min(side),
        shares: [zero, one - u, u],
    };
    (rim, point)
}

/// Closest points inside of coplanar convex faces, or on the rim but for rounding.
#[inline(always)]
fn on_plane<L: Lane>(w: &[V<L>; 4], edges: &[V<L>; 4], normal: V<L>, outward: &[V<L>; 4]) -> Point<L> {
    let zero = L::splat(0.0);
    // Distance beyond each edge, times its length.
    let beyond = [dot(outward[0], w[0]), dot(outward[1], w[1]), dot(outward[2], w[2]), dot(outward[3], w[3])];
    let joint = L::splat(-JOINT);
    let near = [
        joint.less_equal(beyond[0] * inverse(dot(edges[0], edges[0]))),
        joint.less_equal(beyond[1] * inverse(dot(edges[1], edges[1]))),
        joint.less_equal(beyond[2] * inverse(dot(edges[2], edges[2]))),
        joint.less_equal(beyond[3] * inverse(dot(edges[3], edges[3]))),
    ];
    let mut feature = L::select(near[3], L::splat(EDGE + 3.0), L::splat(FACE));
    feature = L::select(near[2], L::splat(EDGE + 2.0), feature);
    feature = L::select(near[1], L::splat(EDGE + 1.0), feature);
    feature = L::select(near[0], L::splat(EDGE), feature);
    feature = L::select(L::both(near[2], near[3]), L::splat(CORNER + 3.0), feature);
    feature = L::select(L::both(near[1], near[2]), L::splat(CORNER + 2.0), feature);
    feature = L::select(L::both(near[0], near[1]), L::splat(CORNER + 1.0), feature);
    feature = L::select(L::both(near[0], near[3]), L::splat(CORNER), feature);
    let height = dot(normal, w[0]);
    Point {
        distance2: height * height,
        vector: [height * normal[0], height * normal[1], height * normal[2]],
        feature,
        triangle: L::splat(PLANE as f64),
        highest: height,
        lowest: height,
        shares: [zero; 3],
    }
}

/// The `index`-th of four.
#[inline(always)]
fn pick<L: Lane>(index: L, of: &[L; 4]) -> L {
    let upper = L::select(index.less(L::splat(2.5)), of[2], of[3]);
    let rest = L::select(index.less(L::splat(1.5)), of[1], upper);
    L::select(index.less(L::splat(0.5)), of[0], rest)
}

/// Closest points of faces split into four triangles; `w` from the corners to the node.
#[inline(always)]
fn on_triangles<L: Lane>(w: &[V<L>; 4]) -> Point<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let mid = middle(w);
    let spoke = [sub(mid, w[0]), sub(mid, w[1]), sub(mid, w[2]), sub(mid, w[3])];
    let at_mid = [dot(spoke[0], mid), dot(spoke[1], mid), dot(spoke[2], mid), dot(spoke[3], mid)];
    let at_end = [dot(spoke[0], w[0]), dot(spoke[1], w[1]), dot(spoke[2], w[2]), dot(spoke[3], w[3])];
    let (mut distance2, mut triangle, mut next) = (L::splat(f64::INFINITY), zero, one);
    let (mut border, mut shares, mut vector) = (zero, [one, zero, zero], mid);
    let mut i = 0;
    while i < 4 {
        let j = (i + 1) & 3;
        let (ab, ac, b, c) = (spoke[i], spoke[j], w[i], w[j]);
        let (d1, d2, d3, d6) = (at_mid[i], at_mid[j], at_end[i], at_end[j]);
        let (d4, d5) = (dot(ac, b), dot(ab, c));
        let vc = d1.mul_add(d4, -(d3 * d2));
        let vb = d5.mul_add(d2, -(d1 * d6));
        let va = d3.mul_add(d6, -(d5 * d4));
        let sum = va + vb + vc;
        let (d43, d56) = (d4 - d3, d5 - d6);
        // Regions from the last in the order of tests to the first; each overrides those before it.
        let inside = zero.less(sum);
        let on_bc = L::both(va.less_equal(zero), L::both(zero.less_equal(d43), zero.less_equal(d56)));
        let on_ac = L::both(vb.less_equal(zero), L::both(zero.less_equal(d2), d6.less_equal(zero)));
        let at_c = L::both(zero.less_equal(d6), d5.less_equal(d6));
        let on_ab = L::both(vc.less_equal(zero), L::both(zero.less_equal(d1), d3.less_equal(zero)));
        let at_b = L::both(zero.less_equal(d3), d4.less_equal(d3));
        let at_a = L::both(d1.less_equal(zero), d2.less_equal(zero));
        let mut v = L::select(inside, vb, zero);
        let mut x = L::select(inside, vc, zero);
        let mut divisor = L::select(inside, sum, one);
        v = L::select(on_bc, zero, v);
        x = L::select(on_bc, d43, x);
        divisor = L::select(on_bc, d43 + d56, divisor);
        let mut outer = L::select(on_bc, one, zero);
        v = L::select(on_ac, zero, v);
        x = L::select(on_ac, d2, x);
        divisor = L::select(on_ac, d2 - d6, divisor);
        outer = L::select(on_ac, zero, outer);
        v = L::select(at_c, zero, v);
        x = L::select(at_c, one, x);
        divisor = L::select(at_c, one, divisor);
        outer = L::select(at_c, L::splat(2.0), outer);
        v = L::select(on_ab, d1, v);
        x = L::select(on_ab, zero, x);
        divisor = L::select(on_ab, d1 - d3, divisor);
        outer = L::select(on_ab, zero, outer);
        v = L::select(at_b, zero, v);
        x = L::select(at_b, zero, x);
        divisor = L::select(at_b, one, divisor);
        outer = L::select(at_b, one, outer);
        let inverse = one / divisor;
        v = L::select(at_a, zero, v * inverse);
        x = L::select(at_a, zero, x * inverse);
        outer = L::select(at_a, zero, outer);
        let is_outer = zero.less(outer);
        let base = choose::<L>(is_outer, b, mid);
        let last = choose::<L>(is_outer, sub(b, c), ac);
        let mut q = before(before(base, v, ab), x, last);
        // The corner itself, not what rounding makes of the way to it.
        q = choose::<L>(L::splat(1.5).less(outer), c, q);
        let q2 = dot(q, q);
        let nearer = q2.less(distance2);
        distance2 = L::select(nearer, q2, distance2);
        triangle = L::select(nearer, L::splat(i as f64), triangle);
        next = L::select(nearer, L::splat(j as f64), next);
        border = L::select(nearer, outer, border);
        shares[0] = L::select(nearer, L::select(is_outer, zero, (one - v) - x), shares[0]);
        shares[1] = L::select(nearer, L::select(is_outer, one - x, v), shares[1]);
        shares[2] = L::select(nearer, x, shares[2]);
        vector = choose::<L>(nearer, q, vector);
        i += 1;
    }
    let (from, to) = (L::splat(CORNER) + triangle, L::splat(CORNER) + next);
    let edge = L::splat(EDGE) + triangle;
    let almost = L::splat(1.0 - JOINT);
    let mut inner = L::select(shares[0].less_equal(L::splat(JOINT)), edge, zero);
    inner = L::select(almost.less_equal(shares[2]), to, inner);
    inner = L::select(almost.less_equal(shares[1]), from, inner);
    let feature = L::select(zero.less(border), edge_feature(shares[2], from, to, edge), inner);
    let (highest, lowest) = sides(&spoke, vector, feature, triangle, next, shares);
    Point { distance2, vector, feature, triangle, highest, lowest, shares }
}

/// Greatest and least product of the vector with the normals of the triangles that meet at a closest point.
#[inline(always)]
fn sides<L: Lane>(spoke: &[V<L>; 4], vector: V<L>, feature: L, triangle: L, next: L, shares: V<L>) -> (L, L) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let of = [
        dot(cross(spoke[0], spoke[1]), vector),
        dot(cross(spoke[1], spoke[2]), vector),
        dot(cross(spoke[2], spoke[3]), vector),
        dot(cross(spoke[3], spoke[0]), vector),
    ];
    // The face: its own triangle and, on a spoke, the one beyond.
    let before = triangle - one;
    let before = L::select(before.less(zero), L::splat(3.0), before);
    let beyond = L::select(shares[1].equal(zero), next, triangle);
    let beyond = L::select(shares[2].equal(zero), before, beyond);
    // An edge has one, a corner two.
    let on_edge = L::splat(EDGE - 0.5).less(feature);
    let on_corner = L::splat(CORNER - 0.5).less(feature);
    let edge = feature - L::splat(EDGE);
    let corner = feature - L::splat(CORNER);
    let behind = corner - one;
    let behind = L::select(behind.less(zero), L::splat(3.0), behind);
    let first = L::select(on_corner, corner, L::select(on_edge, edge, triangle));
    let second = L::select(on_corner, behind, L::select(on_edge, edge, beyond));
    let (one_side, other) = (pick(first, &of), pick(second, &of));
    let (mut highest, mut lowest) = (one_side.max(other), one_side.min(other));
    // On the mid-point all four meet.
    let on_mid = L::both(shares[0].equal(one), feature.less(L::splat(0.5)));
    highest = L::select(on_mid, of[0].max(of[1]).max(of[2].max(of[3])), highest);
    lowest = L::select(on_mid, of[0].min(of[1]).min(of[2].min(of[3])), lowest);
    (highest, lowest)
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
        let (mut slots, mut pairs) = (Slots::default(), Pairs::default());
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
