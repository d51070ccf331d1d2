//! Closest points of faces on lanes, a face and a node in each.

use super::{
    COPLANAR, JOINT, PLANE,
    lanes::{CORNER, EDGE, FACE},
    vectors::{V, before, choose, cross, dot, inverse, middle, sub},
};
use crate::lanes::Lane;

/// Closest points in lanes; the entries are those of [`Closest`](super::lanes::Closest).
#[derive(Clone, Copy)]
pub(super) struct Point<L> {
    pub(super) distance2: L,
    pub(super) vector: V<L>,
    pub(super) feature: L,
    pub(super) triangle: L,
    pub(super) highest: L,
    pub(super) lowest: L,
    pub(super) shares: V<L>,
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

/// From each corner to the next.
#[inline(always)]
fn edges<L: Lane>(x: &[V<L>; 4]) -> [V<L>; 4] {
    [sub(x[1], x[0]), sub(x[2], x[1]), sub(x[3], x[2]), sub(x[0], x[3])]
}

/// Closest points of faces with corners `x` to nodes at `w` from them, where those are not plainly on the rim.
#[inline(always)]
pub(super) fn inside<L: Lane>(x: &[V<L>; 4], w: &[V<L>; 4]) -> Point<L> {
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
struct Rim<L> {
    number: L,
    /// From the corners to the node: the one before, start and end.
    before: V<L>,
    start: V<L>,
    end: V<L>,
    /// Product of the edge with the vector from its start to the node.
    at: L,
    length2: L,
}

impl<L: Lane> Rim<L> {
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
pub(super) fn on_rim<L: Lane>(w: &[V<L>; 4]) -> (L::Mask, Point<L>) {
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
        Rim { number: L::splat(3.0), before: w[2], start: w[3], end: w[0], at: t[3], length2: length2[3] };
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
            let edge = Rim { number, before, start, end, at: t[i], length2: length2[i] };
            best = Rim::chosen(here, &edge, &best);
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
        let edge = sub(b, c);
        let last = choose::<L>(is_outer, edge, ac);
        let mut q = before(before(base, v, ab), x, last);
        // The corner itself, not what rounding makes of the way to it.
        q = choose::<L>(L::splat(1.5).less(outer), c, q);
        let q2 = dot(q, q);
        let nearer = L::both(q2.less(distance2), zero.less(dot(edge, edge)));
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
    let (highest, lowest) = sides(w, &spoke, vector, feature, triangle, next, shares);
    Point { distance2, vector, feature, triangle, highest, lowest, shares }
}

/// Greatest and least product of the vector with the normals of the triangles that meet at a closest point.
#[inline(always)]
fn sides<L: Lane>(
    w: &[V<L>; 4],
    spoke: &[V<L>; 4],
    vector: V<L>,
    feature: L,
    triangle: L,
    next: L,
    shares: V<L>,
) -> (L, L) {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let of = [
        dot(cross(spoke[0], sub(w[0], w[1])), vector),
        dot(cross(spoke[1], sub(w[1], w[2])), vector),
        dot(cross(spoke[2], sub(w[2], w[3])), vector),
        dot(cross(spoke[3], sub(w[3], w[0])), vector),
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
