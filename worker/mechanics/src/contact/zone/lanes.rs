//! Closest points of many pairs at a time, to the bits of [`Frame::nearest`](super::Frame::nearest).
//!
//! Operation by operation what the frame does for one face and one node; where that branches, lanes compute
//! what any of them needs and select. A pair measures its face anew: its twelve coordinates are fewer than
//! the forty numbers of a frame. Small whole numbers (features, triangles) travel as f64.

use std::ops::Range;

use super::{COPLANAR, Feature, INNER, JOINT, Nearest, OUTER, PLANE};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{avx2::Avx2, avx512::Avx512};
use crate::{
    contact::pairs::Pairs,
    lanes::{Lane, SET, Width, scalar::Scalar},
};

type V<L> = [L; 3];

/// Closest points, by pair.
#[derive(Clone, Debug, Default)]
pub(in crate::contact) struct Closest {
    /// Square of the distance (length squared).
    pub(in crate::contact) distance2: Vec<f64>,
    /// From the closest point to the node (length).
    pub(in crate::contact) vector: [Vec<f64>; 3],
    /// Feature + 16 sides + 64 triangle: whole numbers.
    code: Vec<f64>,
    shares: [Vec<f64>; 3],
}

/// How nodes approach closest points, by near feature.
#[derive(Clone, Debug, Default)]
pub(in crate::contact) struct Approach {
    /// Index of the closest point among all.
    pub(in crate::contact) index: Vec<u32>,
    /// 1 for a node on the outer side, -1 on the inner.
    pub(in crate::contact) sign: Vec<f64>,
    /// Depth in the zone: gap minus signed distance; zero beyond the gap (length).
    pub(in crate::contact) depth: Vec<f64>,
    /// Unit vector along the line of node and closest point, out of the solid.
    pub(in crate::contact) direction: [Vec<f64>; 3],
    /// Shape functions of the corners.
    pub(in crate::contact) weights: [Vec<f64>; 4],
}

impl Approach {
    pub(in crate::contact) fn clear(&mut self) {
        self.index.clear();
        self.sign.clear();
    }

    /// Repeats the last feature until lane sets are full.
    pub(in crate::contact) fn fill_up(&mut self) {
        let n = self.index.len().next_multiple_of(SET);
        self.index.resize(n, self.index.last().copied().unwrap_or(0));
        self.sign.resize(n, 1.0);
    }

    fn resize(&mut self, n: usize) {
        self.depth.resize(n, 0.0);
        self.direction.iter_mut().chain(&mut self.weights).for_each(|values| values.resize(n, 0.0));
    }
}

/// Code of edge 0; the face is 0.
const EDGE: f64 = 1.0;
/// Code of corner 0.
const CORNER: f64 = 5.0;
const OF_SIDES: f64 = 16.0;
const OF_TRIANGLE: f64 = 64.0;

impl Closest {
    fn resize(&mut self, n: usize) {
        self.distance2.resize(n, 0.0);
        self.code.resize(n, 0.0);
        self.vector.iter_mut().chain(&mut self.shares).for_each(|values| values.resize(n, 0.0));
    }

    /// Where on its face the closest point of a pair lies.
    #[inline(always)]
    pub(in crate::contact) fn feature(&self, i: usize) -> Feature {
        match self.code[i] as u32 & 15 {
            0 => Feature::Face,
            edge @ 1..5 => Feature::Edge(edge as u8 - 1),
            corner => Feature::Corner((corner as u8).wrapping_sub(5) & 3),
        }
    }

    /// [`Nearest::sides`] of a pair.
    #[inline(always)]
    pub(in crate::contact) fn sides(&self, i: usize) -> u8 {
        (self.code[i] as u32 >> 4 & 3) as u8
    }

    /// The closest point of one pair.
    pub(in crate::contact) fn nearest(&self, i: usize) -> Nearest {
        Nearest {
            feature: self.feature(i),
            distance2: self.distance2[i],
            vector: [self.vector[0][i], self.vector[1][i], self.vector[2][i]],
            sides: self.sides(i),
            triangle: (self.code[i] as u32 >> 6) as u8,
            shares: [self.shares[0][i], self.shares[1][i], self.shares[2][i]],
        }
    }
}

/// Closest points of the pairs of a range. `x` by batch node. Where the face's box, grown by `grow`, does not hold the
/// node ([`Bounds::holds`](crate::contact::search::Bounds::holds)) the distance is infinite and the rest means nothing.
/// The result does not depend on the width.
///
/// # Panics
/// If the range is not whole lane sets of the pairs, an index is out of range or the machine lacks the width.
pub(in crate::contact) fn nearest(
    width: Width,
    x: &[Vec<f64>; 3],
    grow: f64,
    pairs: &Pairs,
    range: Range<usize>,
    found: &mut Closest,
) {
    pairs.check(width, x);
    let whole = range.start.is_multiple_of(SET) && range.end.is_multiple_of(SET);
    assert!(whole && range.start <= range.end && range.end <= pairs.node().len(), "pairs {range:?}");
    found.resize(range.len());
    match width {
        // SAFETY: the pairs have been checked, the width too; `found` is as long as the range.
        Width::Scalar => unsafe { kernel::<Scalar>(x, grow, pairs, range, found) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Width::Avx2 => unsafe { on_avx2(x, grow, pairs, range, found) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Width::Avx512 => unsafe { on_avx512(x, grow, pairs, range, found) },
        #[cfg(not(target_arch = "x86_64"))]
        Width::Avx2 | Width::Avx512 => unreachable!("not available"),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn on_avx2(x: &[Vec<f64>; 3], grow: f64, pairs: &Pairs, range: Range<usize>, found: &mut Closest) {
    // SAFETY: the caller's.
    unsafe { kernel::<Avx2>(x, grow, pairs, range, found) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
unsafe fn on_avx512(x: &[Vec<f64>; 3], grow: f64, pairs: &Pairs, range: Range<usize>, found: &mut Closest) {
    // SAFETY: the caller's.
    unsafe { kernel::<Avx512>(x, grow, pairs, range, found) }
}

/// # Safety
/// Lists equally long, the range whole sets of them, indices in range; `found` as long as the range.
#[inline(always)]
unsafe fn kernel<L: Lane>(
    x: &[Vec<f64>; 3],
    grow: f64,
    pairs: &Pairs,
    range: Range<usize>,
    found: &mut Closest,
) {
    let (far, grow) = (L::splat(f64::INFINITY), L::splat(grow));
    let (node, of) = (pairs.node(), pairs.corners());
    let mut at = 0;
    while at < range.len() {
        let from = range.start + at;
        // SAFETY: the caller's; `at + N` is within the lists because N divides SET.
        unsafe {
            let p = gather::<L>(x, node, from);
            let corners = [
                gather::<L>(x, &of[0], from),
                gather::<L>(x, &of[1], from),
                gather::<L>(x, &of[2], from),
                gather::<L>(x, &of[3], from),
            ];
            let held = holds(p, &corners, grow);
            if !L::any(held) {
                far.store(&mut found.distance2, at);
                at += L::N;
                continue;
            }
            let point = closest(p, &corners);
            L::select(held, point.distance2, far).store(&mut found.distance2, at);
            point.code.store(&mut found.code, at);
            point.vector[0].store(&mut found.vector[0], at);
            point.vector[1].store(&mut found.vector[1], at);
            point.vector[2].store(&mut found.vector[2], at);
            point.shares[0].store(&mut found.shares[0], at);
            point.shares[1].store(&mut found.shares[1], at);
            point.shares[2].store(&mut found.shares[2], at);
        }
        at += L::N;
    }
}

/// Whether the box of four corners, grown on all sides, holds a point.
#[inline(always)]
fn holds<L: Lane>(p: V<L>, x: &[V<L>; 4], grow: L) -> L::Mask {
    L::both(
        spans(p[0], [x[0][0], x[1][0], x[2][0], x[3][0]], grow),
        L::both(
            spans(p[1], [x[0][1], x[1][1], x[2][1], x[3][1]], grow),
            spans(p[2], [x[0][2], x[1][2], x[2][2], x[3][2]], grow),
        ),
    )
}

/// [`holds`] along one axis.
#[inline(always)]
fn spans<L: Lane>(p: L, [a, b, c, d]: [L; 4], grow: L) -> L::Mask {
    let low = a.min(b).min(c.min(d)) - grow;
    let high = a.max(b).max(c.max(d)) + grow;
    L::both(low.less_equal(p), p.less_equal(high))
}

/// # Safety
/// As [`Lane::gather`].
#[inline(always)]
unsafe fn gather<L: Lane>(x: &[Vec<f64>; 3], indices: &[u32], at: usize) -> V<L> {
    // SAFETY: the caller's.
    unsafe { [L::gather(&x[0], indices, at), L::gather(&x[1], indices, at), L::gather(&x[2], indices, at)] }
}

#[inline(always)]
fn sub<L: Lane>(a: V<L>, b: V<L>) -> V<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot<L: Lane>(a: V<L>, b: V<L>) -> L {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
fn cross<L: Lane>(a: V<L>, b: V<L>) -> V<L> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

#[inline(always)]
fn along<L: Lane>(a: V<L>, s: L, b: V<L>) -> V<L> {
    [s.mul_add(b[0], a[0]), s.mul_add(b[1], a[1]), s.mul_add(b[2], a[2])]
}

#[inline(always)]
fn choose<L: Lane>(mask: L::Mask, yes: V<L>, no: V<L>) -> V<L> {
    [L::select(mask, yes[0], no[0]), L::select(mask, yes[1], no[1]), L::select(mask, yes[2], no[2])]
}

/// `1 / l`, zero for zero.
#[inline(always)]
fn inverse<L: Lane>(l: L) -> L {
    let zero = L::splat(0.0);
    L::select(zero.less(l), L::splat(1.0) / l, zero)
}

#[inline(always)]
fn equal<L: Lane>(a: L, b: L) -> L::Mask {
    L::both(a.less_equal(b), b.less_equal(a))
}

/// Mean of four.
#[inline(always)]
fn middle<L: Lane>(x: &[V<L>; 4]) -> V<L> {
    let quarter = L::splat(0.25);
    [
        quarter * ((x[0][0] + x[1][0]) + (x[2][0] + x[3][0])),
        quarter * ((x[0][1] + x[1][1]) + (x[2][1] + x[3][1])),
        quarter * ((x[0][2] + x[1][2]) + (x[2][2] + x[3][2])),
    ]
}

/// Depths, directions and weights of near features, whose `index` and `sign` are given: depth and direction to
/// the bits of the reduction, weights to those of [`Frame::weights`](super::Frame::weights). `pairs` are those of
/// the features, `closest` the points of all pairs.
///
/// # Panics
/// As [`nearest`], and if an index is out of range or there are not as many as pairs.
pub(in crate::contact) fn approach(
    width: Width,
    x: &[Vec<f64>; 3],
    gap: f64,
    pairs: &Pairs,
    closest: &Closest,
    found: &mut Approach,
) {
    pairs.check(width, x);
    let n = pairs.node().len();
    assert!(found.index.len() == n && found.sign.len() == n, "{} features of {n} pairs", found.index.len());
    let highest = found.index.iter().fold(0, |highest, &i| if i > highest { i } else { highest });
    let lists = closest.vector.iter().chain(&closest.shares).chain([&closest.code, &closest.distance2]);
    lists.for_each(|list| assert!(n == 0 || (highest as usize) < list.len(), "point {highest}"));
    found.resize(n);
    match width {
        // SAFETY: pairs, width, indices and lengths have been checked.
        Width::Scalar => unsafe { near::<Scalar>(x, gap, pairs, closest, found) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Width::Avx2 => unsafe { near_on_avx2(x, gap, pairs, closest, found) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Width::Avx512 => unsafe { near_on_avx512(x, gap, pairs, closest, found) },
        #[cfg(not(target_arch = "x86_64"))]
        Width::Avx2 | Width::Avx512 => unreachable!("not available"),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn near_on_avx2(x: &[Vec<f64>; 3], gap: f64, pairs: &Pairs, closest: &Closest, found: &mut Approach) {
    // SAFETY: the caller's.
    unsafe { near::<Avx2>(x, gap, pairs, closest, found) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
unsafe fn near_on_avx512(
    x: &[Vec<f64>; 3],
    gap: f64,
    pairs: &Pairs,
    closest: &Closest,
    found: &mut Approach,
) {
    // SAFETY: the caller's.
    unsafe { near::<Avx512>(x, gap, pairs, closest, found) }
}

/// # Safety
/// Pairs and indices checked, all lists of `found` as long as the pairs.
#[inline(always)]
unsafe fn near<L: Lane>(x: &[Vec<f64>; 3], gap: f64, pairs: &Pairs, closest: &Closest, found: &mut Approach) {
    let (zero, gap) = (L::splat(0.0), L::splat(gap));
    let mut at = 0;
    while at < pairs.node().len() {
        // SAFETY: the caller's; `at + N` is within the lists because N divides SET.
        unsafe {
            let index = &found.index[..];
            let code = L::gather(&closest.code, index, at);
            let vector = gather::<L>(&closest.vector, index, at);
            let shares = gather::<L>(&closest.shares, index, at);
            let sign = L::load(&found.sign, at);
            let distance = L::gather(&closest.distance2, index, at).sqrt();
            let depth = L::select(distance.less(gap), gap - sign * distance, zero);
            let scale = sign / distance;
            depth.store(&mut found.depth, at);
            (scale * vector[0]).store(&mut found.direction[0], at);
            (scale * vector[1]).store(&mut found.direction[1], at);
            (scale * vector[2]).store(&mut found.direction[2], at);
            let mut weights = of_shares(code, shares);
            let plane = L::splat(OF_TRIANGLE * PLANE as f64).less_equal(code);
            if L::any(plane) {
                let p = gather::<L>(x, pairs.node(), at);
                let corners = [
                    gather::<L>(x, &pairs.corners()[0], at),
                    gather::<L>(x, &pairs.corners()[1], at),
                    gather::<L>(x, &pairs.corners()[2], at),
                    gather::<L>(x, &pairs.corners()[3], at),
                ];
                let inside = bilinear(sub(sub(p, vector), corners[0]), &corners);
                weights = [
                    L::select(plane, inside[0], weights[0]),
                    L::select(plane, inside[1], weights[1]),
                    L::select(plane, inside[2], weights[2]),
                    L::select(plane, inside[3], weights[3]),
                ];
            }
            weights[0].store(&mut found.weights[0], at);
            weights[1].store(&mut found.weights[1], at);
            weights[2].store(&mut found.weights[2], at);
            weights[3].store(&mut found.weights[3], at);
        }
        at += L::N;
    }
}

/// Weights of a closest point on a triangle or on the border.
#[inline(always)]
fn of_shares<L: Lane>(code: L, shares: V<L>) -> [L; 4] {
    let quarter = L::splat(0.25) * shares[0];
    let (here, next) = (quarter + shares[1], quarter + shares[2]);
    let is = [
        L::splat(OF_TRIANGLE).less_equal(code),
        L::splat(2.0 * OF_TRIANGLE).less_equal(code),
        L::splat(3.0 * OF_TRIANGLE).less_equal(code),
    ];
    // Triangle 0, then 1, 2, 3 from there on.
    [
        L::select(is[2], next, L::select(is[0], quarter, here)),
        L::select(is[1], quarter, L::select(is[0], here, next)),
        L::select(is[2], quarter, L::select(is[1], here, L::select(is[0], next, quarter))),
        L::select(is[2], here, L::select(is[1], next, quarter)),
    ]
}

/// As [`Frame::weights`](super::Frame::weights) inside a coplanar face.
#[inline(always)]
fn bilinear<L: Lane>(q: V<L>, x: &[V<L>; 4]) -> [L; 4] {
    let (zero, one, two) = (L::splat(0.0), L::splat(1.0), L::splat(2.0));
    let area = cross(sub(x[2], x[0]), sub(x[3], x[1]));
    let inverse_size = inverse(dot(area, area).sqrt());
    let normal = [inverse_size * area[0], inverse_size * area[1], inverse_size * area[2]];
    let b = sub(x[1], x[0]);
    let (e2, e3) = (sub(x[3], x[2]), sub(x[0], x[3]));
    let c = [-e3[0], -e3[1], -e3[2]];
    let d = sub([-e2[0], -e2[1], -e2[2]], b);
    let k0 = turn(normal, q, b);
    let k1 = turn(normal, q, d) + turn(normal, b, c);
    let k2 = -turn(normal, c, d);
    let root = k1.mul_add(k1, -(L::splat(4.0) * k2 * k0)).max(zero).sqrt();
    let forward = zero.less_equal(k1);
    let sum = k1 + root;
    let divided = L::select(forward, L::splat(-2.0) * k0, root - k1) / L::select(forward, sum, two * k2);
    let t = L::select(forward, L::select(zero.less(sum), divided, L::splat(0.5)), divided);
    let xs = along(b, t, d);
    let s = dot(along(q, -t, c), xs) / dot(xs, xs);
    let xt = along(c, s, d);
    let st = s * t;
    let rest = sub(along(along(q, -s, b), -t, c), [st * d[0], st * d[1], st * d[2]]);
    let jacobian = turn(normal, xs, xt);
    let regular = zero.less(jacobian);
    let s = clamped(L::select(regular, s + turn(normal, rest, xt) / jacobian, s));
    let t = clamped(L::select(regular, t + turn(normal, xs, rest) / jacobian, t));
    let (s1, t1) = (one - s, one - t);
    [s1 * t1, s * t1, s * t, s1 * t]
}

#[inline(always)]
fn turn<L: Lane>(normal: V<L>, a: V<L>, b: V<L>) -> L {
    dot(normal, cross(a, b))
}

/// Between zero and one.
#[inline(always)]
fn clamped<L: Lane>(x: L) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let x = L::select(x.less(zero), zero, x);
    L::select(one.less(x), one, x)
}

/// Closest points in lanes.
#[derive(Clone, Copy)]
struct Point<L> {
    distance2: L,
    vector: V<L>,
    code: L,
    shares: V<L>,
}

#[inline(always)]
fn closest<L: Lane>(p: V<L>, x: &[V<L>; 4]) -> Point<L> {
    let edges = [sub(x[1], x[0]), sub(x[2], x[1]), sub(x[3], x[2]), sub(x[0], x[3])];
    let (d0, d1) = (sub(x[2], x[0]), sub(x[3], x[1]));
    let area = cross(d0, d1);
    let size2 = dot(area, area);
    let span2 = L::splat(0.5) * (dot(d0, d0) + dot(d1, d1));
    // Twice as far from coplanar as the limit: no rounding makes such faces flat, and no root is needed to see it.
    let volume = dot(area, edges[0]);
    if !L::any((volume * volume).less_equal(L::splat(4.0 * COPLANAR * COPLANAR) * span2 * size2)) {
        return on_triangles(p, x);
    }
    let inverse_size = inverse(size2.sqrt());
    let normal = [inverse_size * area[0], inverse_size * area[1], inverse_size * area[2]];
    let offset = dot(normal, edges[0]);
    let coplanar = (offset * offset).less_equal(L::splat(COPLANAR * COPLANAR) * span2);
    if !L::any(coplanar) {
        return on_triangles(p, x);
    }
    let outward =
        [cross(edges[0], normal), cross(edges[1], normal), cross(edges[2], normal), cross(edges[3], normal)];
    let least = -(L::splat(1e-8) * (size2 * inverse_size));
    let convex = L::both(
        L::both(dot(outward[0], edges[1]).less(least), dot(outward[1], edges[2]).less(least)),
        L::both(dot(outward[2], edges[3]).less(least), dot(outward[3], edges[0]).less(least)),
    );
    let flat = L::both(convex, coplanar);
    let all = (1_u32 << L::N) - 1;
    let plane = on_plane(p, x, &edges, normal, &outward);
    if L::bits(flat) == all {
        return plane;
    }
    let split = on_triangles(p, x);
    Point {
        distance2: L::select(flat, plane.distance2, split.distance2),
        vector: choose(flat, plane.vector, split.vector),
        code: L::select(flat, plane.code, split.code),
        shares: choose(flat, plane.shares, split.shares),
    }
}

/// Code of the sides: outer above zero, inner below.
#[inline(always)]
fn sides<L: Lane>(highest: L, lowest: L) -> L {
    let zero = L::splat(0.0);
    let outer = L::select(zero.less(highest), L::splat(OF_SIDES * OUTER as f64), zero);
    let inner = L::select(lowest.less(zero), L::splat(OF_SIDES * INNER as f64), zero);
    outer + inner
}

/// Code of the feature at fraction `u` of an edge.
#[inline(always)]
fn edge_feature<L: Lane>(u: L, from: L, to: L, edge: L) -> L {
    let feature = L::select(L::splat(1.0 - JOINT).less_equal(u), to, edge);
    L::select(u.less_equal(L::splat(JOINT)), from, feature)
}

#[inline(always)]
fn on_plane<L: Lane>(
    p: V<L>,
    x: &[V<L>; 4],
    edges: &[V<L>; 4],
    normal: V<L>,
    outward: &[V<L>; 4],
) -> Point<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let from = [sub(p, x[0]), sub(p, x[1]), sub(p, x[2]), sub(p, x[3])];
    let beyond = [
        dot(outward[0], from[0]),
        dot(outward[1], from[1]),
        dot(outward[2], from[2]),
        dot(outward[3], from[3]),
    ];
    let inverse_length2 = [
        inverse(dot(edges[0], edges[0])),
        inverse(dot(edges[1], edges[1])),
        inverse(dot(edges[2], edges[2])),
        inverse(dot(edges[3], edges[3])),
    ];
    let height = dot(normal, from[0]);
    let joint = L::splat(-JOINT);
    let near = [
        joint.less_equal(beyond[0] * inverse_length2[0]),
        joint.less_equal(beyond[1] * inverse_length2[1]),
        joint.less_equal(beyond[2] * inverse_length2[2]),
        joint.less_equal(beyond[3] * inverse_length2[3]),
    ];
    let mut feature = L::select(near[3], L::splat(EDGE + 3.0), zero);
    feature = L::select(near[2], L::splat(EDGE + 2.0), feature);
    feature = L::select(near[1], L::splat(EDGE + 1.0), feature);
    feature = L::select(near[0], L::splat(EDGE), feature);
    feature = L::select(L::both(near[2], near[3]), L::splat(CORNER + 3.0), feature);
    feature = L::select(L::both(near[1], near[2]), L::splat(CORNER + 2.0), feature);
    feature = L::select(L::both(near[0], near[1]), L::splat(CORNER + 1.0), feature);
    feature = L::select(L::both(near[0], near[3]), L::splat(CORNER), feature);
    let inside = Point {
        distance2: height * height,
        vector: [height * normal[0], height * normal[1], height * normal[2]],
        code: feature + sides(height, height) + L::splat(OF_TRIANGLE * PLANE as f64),
        shares: [zero; 3],
    };
    let beside = zero.less(beyond[0].max(beyond[1]).max(beyond[2].max(beyond[3])));
    if !L::any(beside) {
        return inside;
    }
    let (mut distance2, mut at, mut vector) = (L::splat(f64::INFINITY), zero, from[0]);
    let (mut edge, mut next) = (zero, one);
    let mut i = 0;
    while i < 4 {
        let u = dot(from[i], edges[i]) * inverse_length2[i];
        let before = u.less_equal(zero);
        let after = one.less_equal(u);
        let mut v = along(from[i], -u, edges[i]);
        v = choose::<L>(after, from[(i + 1) & 3], v);
        v = choose::<L>(before, from[i], v);
        let u = L::select(before, zero, L::select(after, one, u));
        let d2 = dot(v, v);
        let nearer = L::both(zero.less(beyond[i]), d2.less(distance2));
        distance2 = L::select(nearer, d2, distance2);
        at = L::select(nearer, u, at);
        vector = choose::<L>(nearer, v, vector);
        edge = L::select(nearer, L::splat(i as f64), edge);
        next = L::select(nearer, L::splat(((i + 1) & 3) as f64), next);
        i += 1;
    }
    let corner = L::splat(CORNER);
    let feature = edge_feature(at, corner + edge, corner + next, L::splat(EDGE) + edge);
    let along_normal = dot(normal, vector);
    let code = feature + sides(along_normal, along_normal) + L::splat(OF_TRIANGLE) * edge;
    Point {
        distance2: L::select(beside, distance2, inside.distance2),
        vector: choose::<L>(beside, vector, inside.vector),
        code: L::select(beside, code, inside.code),
        shares: choose::<L>(beside, [zero, one - at, at], inside.shares),
    }
}

/// The `index`-th of four.
#[inline(always)]
fn pick<L: Lane>(index: L, of: &[L; 4]) -> L {
    let upper = L::select(index.less(L::splat(2.5)), of[2], of[3]);
    let rest = L::select(index.less(L::splat(1.5)), of[1], upper);
    L::select(index.less(L::splat(0.5)), of[0], rest)
}

#[inline(always)]
fn on_triangles<L: Lane>(p: V<L>, x: &[V<L>; 4]) -> Point<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let r = [sub(x[0], p), sub(x[1], p), sub(x[2], p), sub(x[3], p)];
    let mid = middle(&r);
    let spoke = [sub(r[0], mid), sub(r[1], mid), sub(r[2], mid), sub(r[3], mid)];
    let at_mid = [-dot(spoke[0], mid), -dot(spoke[1], mid), -dot(spoke[2], mid), -dot(spoke[3], mid)];
    let at_end = [-dot(spoke[0], r[0]), -dot(spoke[1], r[1]), -dot(spoke[2], r[2]), -dot(spoke[3], r[3])];
    let (mut distance2, mut triangle, mut next) = (L::splat(f64::INFINITY), zero, one);
    let (mut border, mut shares, mut point) = (zero, [one, zero, zero], mid);
    let mut i = 0;
    while i < 4 {
        let j = (i + 1) & 3;
        let (ab, ac, b, c) = (spoke[i], spoke[j], r[i], r[j]);
        let (d1, d2, d3, d6) = (at_mid[i], at_mid[j], at_end[i], at_end[j]);
        let (d4, d5) = (-dot(ac, b), -dot(ab, c));
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
        let mut w = L::select(inside, vc, zero);
        let mut divisor = L::select(inside, sum, one);
        v = L::select(on_bc, zero, v);
        w = L::select(on_bc, d43, w);
        divisor = L::select(on_bc, d43 + d56, divisor);
        let mut outer = L::select(on_bc, one, zero);
        v = L::select(on_ac, zero, v);
        w = L::select(on_ac, d2, w);
        divisor = L::select(on_ac, d2 - d6, divisor);
        outer = L::select(on_ac, zero, outer);
        v = L::select(at_c, zero, v);
        w = L::select(at_c, one, w);
        divisor = L::select(at_c, one, divisor);
        outer = L::select(at_c, L::splat(2.0), outer);
        v = L::select(on_ab, d1, v);
        w = L::select(on_ab, zero, w);
        divisor = L::select(on_ab, d1 - d3, divisor);
        outer = L::select(on_ab, zero, outer);
        v = L::select(at_b, zero, v);
        w = L::select(at_b, zero, w);
        divisor = L::select(at_b, one, divisor);
        outer = L::select(at_b, one, outer);
        v = L::select(at_a, zero, v / divisor);
        w = L::select(at_a, zero, w / divisor);
        outer = L::select(at_a, zero, outer);
        let is_outer = zero.less(outer);
        let base = choose::<L>(is_outer, b, mid);
        let last = choose::<L>(is_outer, sub(c, b), ac);
        let mut q = along(along(base, v, ab), w, last);
        // The corner itself, not what rounding makes of b + (c - b).
        q = choose::<L>(L::splat(1.5).less(outer), c, q);
        let q2 = dot(q, q);
        let nearer = q2.less(distance2);
        distance2 = L::select(nearer, q2, distance2);
        triangle = L::select(nearer, L::splat(i as f64), triangle);
        next = L::select(nearer, L::splat(j as f64), next);
        border = L::select(nearer, outer, border);
        shares[0] = L::select(nearer, L::select(is_outer, zero, (one - v) - w), shares[0]);
        shares[1] = L::select(nearer, L::select(is_outer, one - w, v), shares[1]);
        shares[2] = L::select(nearer, w, shares[2]);
        point = choose::<L>(nearer, q, point);
        i += 1;
    }
    let vector = [-point[0], -point[1], -point[2]];
    let (from, to) = (L::splat(CORNER) + triangle, L::splat(CORNER) + next);
    let edge = L::splat(EDGE) + triangle;
    let almost = L::splat(1.0 - JOINT);
    let mut inner = L::select(shares[0].less_equal(L::splat(JOINT)), edge, zero);
    inner = L::select(almost.less_equal(shares[2]), to, inner);
    inner = L::select(almost.less_equal(shares[1]), from, inner);
    let feature = L::select(zero.less(border), edge_feature(shares[2], from, to, edge), inner);
    let code =
        feature + split_sides(x, vector, feature, triangle, next, shares) + L::splat(OF_TRIANGLE) * triangle;
    Point { distance2, vector, code, shares }
}

/// Code of the sides of the triangles' normals that meet at the closest point of a split face.
#[inline(always)]
fn split_sides<L: Lane>(x: &[V<L>; 4], vector: V<L>, feature: L, triangle: L, next: L, shares: V<L>) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let mid = middle(x);
    let spoke = [sub(x[0], mid), sub(x[1], mid), sub(x[2], mid), sub(x[3], mid)];
    let of = [
        dot(cross(spoke[0], spoke[1]), vector),
        dot(cross(spoke[1], spoke[2]), vector),
        dot(cross(spoke[2], spoke[3]), vector),
        dot(cross(spoke[3], spoke[0]), vector),
    ];
    // The face: its own triangle and, on a spoke, the one beyond.
    let before = triangle - one;
    let before = L::select(before.less(zero), L::splat(3.0), before);
    let beyond = L::select(equal(shares[1], zero), next, triangle);
    let beyond = L::select(equal(shares[2], zero), before, beyond);
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
    let on_mid = L::both(equal(shares[0], one), feature.less(L::splat(0.5)));
    highest = L::select(on_mid, of[0].max(of[1]).max(of[2].max(of[3])), highest);
    lowest = L::select(on_mid, of[0].min(of[1]).min(of[2].min(of[3])), lowest);
    sides(highest, lowest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{search::Bounds, zone::Frame};

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
        let (mut x, mut pairs) = ([vec![], vec![], vec![]], Pairs::default());
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
            let first = x[0].len() as u32;
            for point in [p, quad[0], quad[1], quad[2], quad[3]] {
                (0..3).for_each(|a| x[a].push(point[a]));
            }
            faces.push([1, 2, 3, 4].map(|i| first + i));
            nodes.push(first);
            frames.push((Frame::new(&quad), p));
            quads.push(quad);
        }
        let held: Vec<u32> = (0..nodes.len() as u32).collect();
        let starts: Vec<u32> = (0..=nodes.len() as u32).collect();
        pairs.extend(&nodes, &starts, &held, &faces);
        let all = 0..pairs.node().len();
        let mut counts = [0; 11];
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            let mut found = Closest::default();
            nearest(width, &x, 0.3, &pairs, all.clone(), &mut found);
            let within = found.distance2.clone();
            nearest(width, &x, f64::INFINITY, &pairs, all.clone(), &mut found);
            let mut near =
                Approach { index: held.clone(), sign: vec![1.0; held.len()], ..Approach::default() };
            near.fill_up();
            approach(width, &x, 0.3, &pairs, &found, &mut near);
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
                counts[found.code[i] as usize & 15] += 1;
            }
        }
        assert!(counts.iter().all(|&count| count > 100), "every feature was met: {counts:?}");
    }
}
