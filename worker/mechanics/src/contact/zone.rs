//! The contact detection zone of a face: the closest point of the face to a node, with all of the paper's
//! figure 1.
//!
//! The zone of radius `gap` around a face is the set of points nearer than the gap: two slabs where the closest
//! point lies inside the face, half-cylinders where it lies on an edge, sphere segments where it is a corner.
//! So the closest point and the feature it lies on are the whole of the zone. A coplanar convex face is used
//! as it is, with bilinear weights; any other is split into four triangles about its mid-point (the mean of
//! its corners), whose share of a weight goes to the corners a quarter each. Weights reproduce the closest
//! point, `sum w_i x_i = C`, because the moment of the forces depends on it.
//!
//! What all nodes near a face need of it is computed once a cycle ([`Frame`]); what only a node that is pushed
//! needs, weights and pseudonormal, is left to a second step. All is done relative to the node, so that bodies
//! far from the origin lose nothing.

pub(super) mod approach;
pub(super) mod lanes;
mod point;
mod vectors;

/// A face is coplanar if its diagonals pass each other nearer than this fraction of their mean length.
///
/// Between the two treatments the distance jumps by no more than that: far below any gap, and far above the
/// rounding of positions.
pub const COPLANAR: f64 = 1e-10;

/// Closest points nearer to an edge than this fraction of its length, or to the end of an edge than this
/// fraction, are on it: so the faces at a joint agree on where they meet in spite of rounding.
pub const JOINT: f64 = 1e-12;

/// A vector or point.
pub type Vector = [f64; 3];

/// Where on a face a closest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Inside: the slabs.
    Face,
    /// On edge `i`, from corner `i` to corner `i + 1`: a half-cylinder.
    Edge(u8),
    /// Corner `i`: a sphere segment.
    Corner(u8),
}

/// On the outer side of a normal; bits that [`Nearest::sides`] joins.
pub const OUTER: u8 = 1;

/// On the inner side of a normal.
pub const INNER: u8 = 2;

/// The closest point of a face to a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Where on the face.
    pub feature: Feature,
    /// Square of the distance (length squared).
    pub distance2: f64,
    /// From the closest point to the node.
    pub vector: Vector,
    /// On which sides of the normals that meet at the closest point the node lies: [`OUTER`], [`INNER`], both
    /// or, where it lies on all of them, none.
    pub sides: u8,
    /// Triangle the closest point lies on, or [`PLANE`].
    triangle: u8,
    /// Shares of the mid-point and of corners `triangle` and `triangle + 1`.
    shares: [f64; 3],
}

/// In place of a triangle: inside a coplanar face.
const PLANE: u8 = 4;

/// A face in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Corners, outward by the right-hand rule.
    corners: [Vector; 4],
    /// From corner `i` to corner `i + 1`.
    edges: [Vector; 4],
    /// One over the square of each edge's length; zero for an edge of none.
    inverse_length2: [f64; 4],
    /// Unit normal, outward; zero for a face of no area.
    normal: Vector,
    /// Edge `i` times the normal: in the plane, out of the face.
    outward: [Vector; 4],
    /// Whether the face is coplanar and convex.
    flat: bool,
}

#[inline(always)]
pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// `a + s b`.
#[inline(always)]
fn along(a: Vector, s: f64, b: Vector) -> Vector {
    [s.mul_add(b[0], a[0]), s.mul_add(b[1], a[1]), s.mul_add(b[2], a[2])]
}

#[inline(always)]
pub(super) fn scale(s: f64, a: Vector) -> Vector {
    [s * a[0], s * a[1], s * a[2]]
}

/// `a` over its length; zero stays zero.
#[inline(always)]
pub(super) fn unit(a: Vector) -> Vector {
    let l = dot(a, a).sqrt();
    if l > 0.0 { [a[0] / l, a[1] / l, a[2] / l] } else { [0.0; 3] }
}

// Fours are written out: a closure in `map` may become a function of its own, without the caller's
// fused multiply-add.

/// `a_i . b_i`.
#[inline(always)]
fn dot_each(a: &[Vector; 4], b: &[Vector; 4]) -> [f64; 4] {
    [dot(a[0], b[0]), dot(a[1], b[1]), dot(a[2], b[2]), dot(a[3], b[3])]
}

/// `1 / l`, zero for zero.
#[inline(always)]
fn inverse(l: f64) -> f64 {
    if l > 0.0 { 1.0 / l } else { 0.0 }
}

/// Angle between two vectors to 7e-5 (Abramowitz and Stegun 4.4.45): only a weight among normals, and the
/// platform's `acos` has other bits on other platforms.
#[inline(always)]
fn angle(a: Vector, b: Vector) -> f64 {
    let c = dot(unit(a), unit(b)).clamp(-1.0, 1.0);
    let m = c.abs();
    let p = (-0.018_729_3_f64).mul_add(m, 0.074_261_0).mul_add(m, -0.212_114_4).mul_add(m, 1.570_728_8);
    let acute = (1.0 - m).sqrt() * p;
    if c < 0.0 { std::f64::consts::PI - acute } else { acute }
}

/// Side of a point on a normal as a bit; neither on the plane.
#[inline(always)]
fn side(along_normal: f64) -> u8 {
    if along_normal > 0.0 {
        OUTER
    } else if along_normal < 0.0 {
        INNER
    } else {
        0
    }
}

impl Frame {
    /// Measures a face whose corners are `x`, outward by the right-hand rule.
    #[inline(always)]
    pub fn new(x: &[Vector; 4]) -> Self {
        let edges = [sub(x[1], x[0]), sub(x[2], x[1]), sub(x[3], x[2]), sub(x[0], x[3])];
        let (d0, d1) = (sub(x[2], x[0]), sub(x[3], x[1]));
        let area = cross(d0, d1);
        let size2 = dot(area, area);
        let inverse_size = inverse(size2.sqrt());
        let normal = scale(inverse_size, area);
        let outward = [
            cross(edges[0], normal),
            cross(edges[1], normal),
            cross(edges[2], normal),
            cross(edges[3], normal),
        ];
        let l = dot_each(&edges, &edges);
        let inverse_length2 = [inverse(l[0]), inverse(l[1]), inverse(l[2]), inverse(l[3])];
        // How far the diagonals pass each other.
        let offset = dot(normal, edges[0]);
        let span2 = 0.5 * (dot(d0, d0) + dot(d1, d1));
        // A corner of 180 degrees or more, or an edge of no length, is left to the triangles.
        let least = 1e-8 * (size2 * inverse_size);
        // Minus the sine of each corner's turn, times its edges' lengths.
        let turns = dot_each(&outward, &[edges[1], edges[2], edges[3], edges[0]]);
        let convex = (turns[0] < -least) & (turns[1] < -least) & (turns[2] < -least) & (turns[3] < -least);
        let flat = convex & (offset * offset <= COPLANAR * COPLANAR * span2);
        Self { corners: *x, edges, inverse_length2, normal, outward, flat }
    }

    /// Closest point to `p`.
    #[inline(always)]
    pub fn nearest(&self, p: Vector) -> Nearest {
        let [a, b, c, d] = self.corners;
        let w = [sub(p, a), sub(p, b), sub(p, c), sub(p, d)];
        match on_rim(&w) {
            Some(nearest) => nearest,
            None if self.flat => self.on_plane(&w),
            None => on_triangles(&w),
        }
    }

    /// Closest point inside of a coplanar convex face, or on its rim but for rounding.
    #[inline(always)]
    fn on_plane(&self, w: &[Vector; 4]) -> Nearest {
        // Distance beyond each edge, times its length.
        let beyond = dot_each(&self.outward, w);
        let inverse = &self.inverse_length2;
        let near = [
            beyond[0] * inverse[0] >= -JOINT,
            beyond[1] * inverse[1] >= -JOINT,
            beyond[2] * inverse[2] >= -JOINT,
            beyond[3] * inverse[3] >= -JOINT,
        ];
        let feature = match near {
            [false, false, false, false] => Feature::Face,
            [true, _, _, true] => Feature::Corner(0),
            [true, true, _, _] => Feature::Corner(1),
            [_, true, true, _] => Feature::Corner(2),
            [_, _, true, true] => Feature::Corner(3),
            [true, _, _, _] => Feature::Edge(0),
            [_, true, _, _] => Feature::Edge(1),
            [_, _, true, _] => Feature::Edge(2),
            [_, _, _, true] => Feature::Edge(3),
        };
        let height = dot(self.normal, w[0]);
        Nearest {
            feature,
            distance2: height * height,
            vector: scale(height, self.normal),
            sides: side(height),
            triangle: PLANE,
            shares: [0.0; 3],
        }
    }

    /// Calls `visit` with every normal of this face that meets at a closest point, a unit vector if the face is flat, and with how much of
    /// the way round it takes: on a corner or the mid-point of a split face two vectors that span its angle.
    #[inline(always)]
    fn for_each_normal(&self, nearest: &Nearest, mut visit: impl FnMut(Vector, Option<(Vector, Vector)>)) {
        if self.flat {
            match nearest.feature {
                Feature::Corner(c) => {
                    let (after, before) = (c as usize, (c as usize + 3) & 3);
                    visit(self.normal, Some((self.edges[after], scale(-1.0, self.edges[before]))));
                }
                _ => visit(self.normal, None),
            }
            return;
        }
        let mid = middle(&self.corners);
        let spoke = |i: usize| sub(self.corners[i & 3], mid);
        let normal = |i: usize| cross(spoke(i), self.edges[i & 3]);
        let i = nearest.triangle as usize;
        match nearest.feature {
            Feature::Corner(c) => {
                // A triangle has two corners in one: beyond both are the edges that meet there.
                let (c, previous) = (c as usize, (c as usize + 3) & 3);
                let after = if has_length(self.edges[c]) { c } else { (c + 1) & 3 };
                let before = if has_length(self.edges[previous]) { previous } else { (c + 2) & 3 };
                let to_mid = scale(-1.0, spoke(c));
                visit(normal(after), Some((self.edges[after], to_mid)));
                visit(normal(before), Some((scale(-1.0, self.edges[before]), to_mid)));
            }
            Feature::Edge(e) => visit(normal(e as usize), None),
            Feature::Face if nearest.shares[0] == 1.0 => {
                (0..4).for_each(|t| visit(normal(t), Some((spoke(t), spoke(t + 1)))));
            }
            Feature::Face => {
                visit(normal(i), None);
                if nearest.shares[2] == 0.0 {
                    visit(normal(i + 3), None);
                } else if nearest.shares[1] == 0.0 {
                    visit(normal(i + 1), None);
                }
            }
        }
    }

    /// Outward direction at a closest point as far as this face alone knows it, of any length: the sum of the
    /// unit normals that meet there, at corners times their angles. Summed over the faces that share the
    /// feature it is the angle-weighted pseudonormal, whose product with the vector to the node has the sign of
    /// the side (Baerentzen and Aanaes 2005).
    pub fn pseudonormal(&self, nearest: &Nearest) -> Vector {
        let mut sum = [0.0; 3];
        self.for_each_normal(nearest, |normal, span| {
            let normal = if self.flat { normal } else { unit(normal) };
            sum = along(sum, span.map_or(1.0, |(a, b)| angle(a, b)), normal);
        });
        sum
    }

    /// Shape functions of the four corners at the closest point to `p`.
    #[inline(always)]
    pub fn weights(&self, nearest: &Nearest, p: Vector) -> [f64; 4] {
        if nearest.triangle == PLANE {
            return self.bilinear(sub(sub(p, nearest.vector), self.corners[0]));
        }
        let i = nearest.triangle as usize;
        let [of_mid, of_i, of_next] = nearest.shares;
        let mut weights = [0.25 * of_mid; 4];
        weights[i] += of_i;
        weights[(i + 1) & 3] += of_next;
        weights
    }

    /// Bilinear weights of the point of a coplanar convex face at `q` from corner 0.
    ///
    /// With `q = s b + t c + s t d`, eliminating `s` leaves `k2 t^2 + k1 t + k0 = 0` in cross products; the
    /// root inside the face is the one where the Jacobian `2 k2 t + k1` is positive. One Newton step on both
    /// takes off what rounding left.
    #[inline(always)]
    fn bilinear(&self, q: Vector) -> [f64; 4] {
        let (b, c) = (self.edges[0], scale(-1.0, self.edges[3]));
        let d = sub(scale(-1.0, self.edges[2]), b);
        let turn = |a: Vector, b: Vector| dot(self.normal, cross(a, b));
        let (k0, k1, k2) = (turn(q, b), turn(q, d) + turn(b, c), -turn(c, d));
        let root = k1.mul_add(k1, -(4.0 * k2 * k0)).max(0.0).sqrt();
        let mut t = if k1 >= 0.0 {
            if k1 + root > 0.0 { -2.0 * k0 / (k1 + root) } else { 0.5 }
        } else {
            (root - k1) / (2.0 * k2)
        };
        let xs = along(b, t, d);
        let mut s = dot(along(q, -t, c), xs) / dot(xs, xs);
        let xt = along(c, s, d);
        let rest = sub(along(along(q, -s, b), -t, c), scale(s * t, d));
        let jacobian = turn(xs, xt);
        if jacobian > 0.0 {
            s += turn(rest, xt) / jacobian;
            t += turn(xs, rest) / jacobian;
        }
        let (s, t) = (s.clamp(0.0, 1.0), t.clamp(0.0, 1.0));
        let (s1, t1) = (1.0 - s, 1.0 - t);
        [s1 * t1, s * t1, s * t, s1 * t]
    }
}

/// Closest point of a face to a node that is at `w` from its corners, if it is plainly on the rim: a point of an edge such
/// that no corner lies before the plane through it that stands across the line to the node, or, where that is as near a
/// corner as a joint is wide, the corner. The face is within the hull of its corners, so nothing of it is nearer. All signs
/// follow from the products `w_i . e_i` and those of edges.
#[inline(always)]
fn on_rim(w: &[Vector; 4]) -> Option<Nearest> {
    let e = [sub(w[0], w[1]), sub(w[1], w[2]), sub(w[2], w[3]), sub(w[3], w[0])];
    let length2 = dot_each(&e, &e);
    let turn = dot_each(&e, &[e[1], e[2], e[3], e[0]]);
    let t = dot_each(w, &e);
    let past = [t[0] - length2[0], t[1] - length2[1], t[2] - length2[2], t[3] - length2[3]];
    let joint = [JOINT * length2[0], JOINT * length2[1], JOINT * length2[2], JOINT * length2[3]];
    for i in 0..4 {
        let (j, l) = ((i + 1) & 3, (i + 3) & 3);
        let next = t[j] + turn[i];
        let corner = t[i] <= joint[i] && past[l] >= -joint[l] && t[i] + next <= 0.0;
        let ahead = length2[i] * next <= t[i] * turn[i];
        let behind = t[i] * turn[l] <= length2[i] * past[l];
        if corner || (joint[i] < t[i] && past[i] < -joint[i] && ahead && behind) {
            let u = if corner { 0.0 } else { t[i] / length2[i] };
            let vector = along(w[i], -u, e[i]);
            // The triangle of the edge; at a corner also that of the edge before.
            let spoke = sub(middle(w), w[i]);
            let of_edge = side(dot(cross(spoke, e[i]), vector));
            return Some(Nearest {
                feature: if corner { Feature::Corner(i as u8) } else { Feature::Edge(i as u8) },
                distance2: dot(vector, vector),
                vector,
                sides: if corner { of_edge | side(dot(cross(spoke, e[l]), vector)) } else { of_edge },
                triangle: i as u8,
                shares: [0.0, 1.0 - u, u],
            });
        }
    }
    None
}

/// Closest point of a split face to a node that is at `w` from its corners: the nearest of those of its four triangles,
/// the first of equals.
#[inline(always)]
fn on_triangles(w: &[Vector; 4]) -> Nearest {
    let mid = middle(w);
    let spoke = [sub(mid, w[0]), sub(mid, w[1]), sub(mid, w[2]), sub(mid, w[3])];
    let mut best = (f64::INFINITY, 0, Region::Inside, [1.0, 0.0, 0.0], mid);
    for i in 0..4 {
        let j = (i + 1) & 3;
        let (region, shares, vector) = on_triangle([mid, w[i], w[j]], spoke[i], spoke[j]);
        let d2 = dot(vector, vector);
        if d2 < best.0 && has_length(sub(w[i], w[j])) {
            best = (d2, i, region, shares, vector);
        }
    }
    let (distance2, i, region, shares, vector) = best;
    let feature = match region {
        Region::Border => edge_feature(i, shares[2]),
        Region::Inside if shares[1] >= 1.0 - JOINT => Feature::Corner(i as u8),
        Region::Inside if shares[2] >= 1.0 - JOINT => Feature::Corner((i as u8 + 1) & 3),
        Region::Inside if shares[0] <= JOINT => Feature::Edge(i as u8),
        Region::Inside => Feature::Face,
    };
    // The length of a normal has no say in its side; between two corners in one it is exactly zero.
    let of = |i: usize| side(dot(cross(spoke[i & 3], sub(w[i & 3], w[(i + 1) & 3])), vector));
    let sides = match feature {
        Feature::Corner(c) => of(c as usize) | of(c as usize + 3),
        Feature::Edge(e) => of(e as usize),
        Feature::Face if shares[0] == 1.0 => of(0) | of(1) | of(2) | of(3),
        Feature::Face if shares[2] == 0.0 => of(i) | of(i + 3),
        Feature::Face if shares[1] == 0.0 => of(i) | of(i + 1),
        Feature::Face => of(i),
    };
    Nearest { feature, distance2, vector, sides, triangle: i as u8, shares }
}

/// Whether an edge is one; between two corners in one there is none, and rounding alone would give its triangle a side.
#[inline(always)]
fn has_length(edge: Vector) -> bool {
    dot(edge, edge) > 0.0
}

/// Mean of four corners.
#[inline(always)]
fn middle(x: &[Vector; 4]) -> Vector {
    let mean = |a: usize| 0.25 * ((x[0][a] + x[1][a]) + (x[2][a] + x[3][a]));
    [mean(0), mean(1), mean(2)]
}

/// Feature at fraction `u` of edge `i`.
#[inline(always)]
fn edge_feature(i: usize, u: f64) -> Feature {
    if u <= JOINT {
        Feature::Corner(i as u8)
    } else if u >= 1.0 - JOINT {
        Feature::Corner(((i + 1) & 3) as u8)
    } else {
        Feature::Edge(i as u8)
    }
}

/// Whether the closest point of a triangle of a split face lies on the face's edge, corners included.
#[derive(Clone, Copy, PartialEq)]
enum Region {
    Inside,
    Border,
}

/// Closest point of a triangle to a node that is at `a`, `b`, `c` from its corners, by its Voronoi regions (Ericson 2005,
/// section 5.1.5): region, barycentric shares, vector from the point to the node. `ab` and `ac` are its edges from `a`.
#[inline(always)]
fn on_triangle([a, b, c]: [Vector; 3], ab: Vector, ac: Vector) -> (Region, [f64; 3], Vector) {
    let (d1, d2) = (dot(ab, a), dot(ac, a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (Region::Inside, [1.0, 0.0, 0.0], a);
    }
    let (d3, d4) = (dot(ab, b), dot(ac, b));
    if d3 >= 0.0 && d4 <= d3 {
        return (Region::Border, [0.0, 1.0, 0.0], b);
    }
    let vc = d1.mul_add(d4, -(d3 * d2));
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 * (1.0 / (d1 - d3));
        return (Region::Inside, [1.0 - v, v, 0.0], along(a, -v, ab));
    }
    let (d5, d6) = (dot(ab, c), dot(ac, c));
    if d6 >= 0.0 && d5 <= d6 {
        return (Region::Border, [0.0, 0.0, 1.0], c);
    }
    let vb = d5.mul_add(d2, -(d1 * d6));
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 * (1.0 / (d2 - d6));
        return (Region::Inside, [1.0 - w, 0.0, w], along(a, -w, ac));
    }
    let va = d3.mul_add(d6, -(d5 * d4));
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) * (1.0 / ((d4 - d3) + (d5 - d6)));
        return (Region::Border, [0.0, 1.0 - w, w], along(b, -w, sub(b, c)));
    }
    let sum = va + vb + vc;
    if sum > 0.0 {
        let inverse = 1.0 / sum;
        let (v, w) = (vb * inverse, vc * inverse);
        return (Region::Inside, [(1.0 - v) - w, v, w], along(along(a, -v, ab), -w, ac));
    }
    // A triangle of no area whose regions rounding has mixed up.
    (Region::Inside, [1.0, 0.0, 0.0], a)
}
