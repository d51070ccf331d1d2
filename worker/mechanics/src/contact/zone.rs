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
//! All is done relative to the node, so that bodies far from the origin lose nothing.

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

/// The closest point of a face to a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Where on the face.
    pub feature: Feature,
    /// Distance, never negative (length).
    pub distance: f64,
    /// From the closest point to the node.
    pub vector: Vector,
    /// Shape functions of the four corners at the closest point.
    pub weights: [f64; 4],
    /// Outward direction at the closest point as far as this face alone knows it, of any length.
    ///
    /// In the face and on its edges the unit normal (the sum of two or four of a split face, on its spokes and
    /// mid-point), at corners the unit normal times the angle there: summed over the faces that share the
    /// feature it is the angle-weighted pseudonormal (Baerentzen and Aanaes 2005), whose product with `vector`
    /// has the sign of the side.
    pub normal: Vector,
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
fn cross(a: Vector, b: Vector) -> Vector {
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
fn scale(s: f64, a: Vector) -> Vector {
    [s * a[0], s * a[1], s * a[2]]
}

/// `a` over its length; zero stays zero.
#[inline(always)]
pub(super) fn unit(a: Vector) -> Vector {
    let l = dot(a, a).sqrt();
    if l > 0.0 { [a[0] / l, a[1] / l, a[2] / l] } else { [0.0; 3] }
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

/// Closest point of the face `x` (outward by the right-hand rule) to the point `p`.
#[inline(always)]
pub fn closest(x: &[Vector; 4], p: Vector) -> Closest {
    // From the node: the node is the origin from here on.
    let r = [sub(x[0], p), sub(x[1], p), sub(x[2], p), sub(x[3], p)];
    let (d0, d1) = (sub(r[2], r[0]), sub(r[3], r[1]));
    let area = cross(d0, d1);
    let size2 = dot(area, area);
    let offset = dot(area, sub(r[1], r[0]));
    // offset / |area| is how far the diagonals pass each other.
    let span2 = 0.5 * (dot(d0, d0) + dot(d1, d1));
    let coplanar = offset * offset <= COPLANAR * COPLANAR * span2 * size2;
    if coplanar && size2 > 0.0 {
        let edges = [sub(r[1], r[0]), sub(r[2], r[1]), sub(r[3], r[2]), sub(r[0], r[3])];
        let turn = [
            dot(area, cross(edges[3], edges[0])),
            dot(area, cross(edges[0], edges[1])),
            dot(area, cross(edges[1], edges[2])),
            dot(area, cross(edges[2], edges[3])),
        ];
        // A corner of 180 degrees or more, or an edge of no length, is left to the triangles.
        let least = 1e-8 * size2;
        if turn[0] > least && turn[1] > least && turn[2] > least && turn[3] > least {
            return on_plane(&r, &edges, area, size2);
        }
    }
    on_triangles(&r)
}

/// Closest point of a coplanar convex face to the origin. `area` is the cross product of the diagonals.
#[inline(always)]
fn on_plane(r: &[Vector; 4], edges: &[Vector; 4], area: Vector, size2: f64) -> Closest {
    let size = size2.sqrt();
    let normal = [area[0] / size, area[1] / size, area[2] / size];
    // In-plane distance to each edge times its length, positive inside, and the edge's length squared.
    let mut inside = [0.0; 4];
    let mut length2 = [0.0; 4];
    let mut outside = false;
    for i in 0..4 {
        inside[i] = dot(normal, cross(r[i], edges[i]));
        length2[i] = dot(edges[i], edges[i]);
        outside |= inside[i] < 0.0;
    }
    if outside {
        return on_border(r, edges, &inside, &length2, normal);
    }
    // The origin's height over the plane of corner 0, along the normal.
    let height = -dot(normal, r[0]);
    let foot = scale(-height, normal);
    let weights = bilinear(r, foot, normal);
    let near = |i: usize| inside[i] <= JOINT * length2[i];
    let mut feature = Feature::Face;
    for i in 0..4 {
        if near(i) {
            feature = if near((i + 1) & 3) {
                Feature::Corner(((i + 1) & 3) as u8)
            } else if i == 0 && near(3) {
                Feature::Corner(0)
            } else {
                Feature::Edge(i as u8)
            };
            break;
        }
    }
    let mut closest =
        Closest { feature, distance: height.abs(), vector: scale(height, normal), weights, normal };
    if let Feature::Corner(i) = feature {
        closest.normal = scale(corner_angle(edges, i as usize), normal);
    }
    closest
}

/// Interior angle at corner `i`.
#[inline(always)]
fn corner_angle(edges: &[Vector; 4], i: usize) -> f64 {
    angle(edges[i], scale(-1.0, edges[(i + 3) & 3]))
}

/// Closest point on the border of a coplanar convex face that the origin lies beside. Only edges that have the
/// origin on their outer side can be closest.
#[inline(always)]
fn on_border(
    r: &[Vector; 4],
    edges: &[Vector; 4],
    inside: &[f64; 4],
    length2: &[f64; 4],
    normal: Vector,
) -> Closest {
    let (mut best, mut edge, mut at, mut point) = (f64::INFINITY, 0, 0.0, r[0]);
    for i in 0..4 {
        if inside[i] < 0.0 {
            let u = (-dot(r[i], edges[i]) / length2[i]).clamp(0.0, 1.0);
            let c = if u < 1.0 { along(r[i], u, edges[i]) } else { r[(i + 1) & 3] };
            let d2 = dot(c, c);
            if d2 < best {
                (best, edge, at, point) = (d2, i, u, c);
            }
        }
    }
    let feature = edge_feature(edge, at);
    let normal = match feature {
        Feature::Corner(i) => scale(corner_angle(edges, i as usize), normal),
        _ => normal,
    };
    let mut weights = [0.0; 4];
    weights[edge] = 1.0 - at;
    weights[(edge + 1) & 3] = at;
    Closest { feature, distance: dot(point, point).sqrt(), vector: scale(-1.0, point), weights, normal }
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

/// Bilinear weights of the point `foot` of a coplanar convex face with this unit normal.
///
/// With `x = x0 + s b + t c + s t d`, eliminating `s` leaves `k2 t^2 + k1 t + k0 = 0` in cross products; the
/// root inside the face is the one where the Jacobian `2 k2 t + k1` is positive. One Newton step on both takes
/// off what rounding left.
#[inline(always)]
fn bilinear(r: &[Vector; 4], foot: Vector, normal: Vector) -> [f64; 4] {
    let (b, c, q) = (sub(r[1], r[0]), sub(r[3], r[0]), sub(foot, r[0]));
    let d = sub(sub(r[2], r[3]), b);
    let turn = |a: Vector, b: Vector| dot(normal, cross(a, b));
    let (k0, k1, k2) = (turn(q, b), turn(q, d) + turn(b, c), -turn(c, d));
    let root = k1.mul_add(k1, -(4.0 * k2 * k0)).max(0.0).sqrt();
    let mut t = if k1 >= 0.0 {
        if k1 + root > 0.0 { -2.0 * k0 / (k1 + root) } else { 0.5 }
    } else {
        (root - k1) / (2.0 * k2)
    };
    let side = along(b, t, d);
    let mut s = dot(along(q, -t, c), side) / dot(side, side);
    let rest = sub(along(along(q, -s, b), -t, c), scale(s * t, d));
    let (xs, xt) = (along(b, t, d), along(c, s, d));
    let jacobian = turn(xs, xt);
    if jacobian > 0.0 {
        s += turn(rest, xt) / jacobian;
        t += turn(xs, rest) / jacobian;
    }
    let (s, t) = (s.clamp(0.0, 1.0), t.clamp(0.0, 1.0));
    let (s1, t1) = (1.0 - s, 1.0 - t);
    [s1 * t1, s * t1, s * t, s1 * t]
}

/// Where on a triangle (mid-point, corner `i`, corner `i + 1`) its closest point lies.
#[derive(Clone, Copy, PartialEq)]
enum Region {
    Inside,
    Mid,
    /// Between mid-point and corner `i`, and `i + 1`.
    Spoke,
    NextSpoke,
    /// On the face's edge, corners included, at this fraction.
    Border(f64),
}

/// Closest point of a split face to the origin: the nearest of those of its four triangles, the first of
/// equals.
#[inline(never)]
fn on_triangles(r: &[Vector; 4]) -> Closest {
    let mid = [0, 1, 2].map(|a| 0.25 * ((r[0][a] + r[1][a]) + (r[2][a] + r[3][a])));
    let mut best = (f64::INFINITY, 0, Region::Mid, [1.0, 0.0, 0.0], mid);
    for i in 0..4 {
        let (region, weights, point) = on_triangle(mid, r[i], r[(i + 1) & 3]);
        let d2 = dot(point, point);
        if d2 < best.0 {
            best = (d2, i, region, weights, point);
        }
    }
    let (d2, i, region, [of_mid, of_i, of_next], point) = best;
    let next = (i + 1) & 3;
    let normal_of = |i: usize| unit(cross(sub(r[i], mid), sub(r[(i + 1) & 3], mid)));
    let feature = match region {
        Region::Border(u) => edge_feature(i, u),
        _ if of_i >= 1.0 - JOINT => Feature::Corner(i as u8),
        _ if of_next >= 1.0 - JOINT => Feature::Corner(next as u8),
        Region::Inside if of_mid <= JOINT => Feature::Edge(i as u8),
        _ => Feature::Face,
    };
    let normal = match (feature, region) {
        (Feature::Corner(c), _) => {
            let c = c as usize;
            let (before, after) = ((c + 3) & 3, (c + 1) & 3);
            let to_mid = sub(mid, r[c]);
            let one = scale(angle(sub(r[after], r[c]), to_mid), normal_of(c));
            along(one, angle(sub(r[before], r[c]), to_mid), normal_of(before))
        }
        (Feature::Edge(e), _) => normal_of(e as usize),
        (Feature::Face, Region::Spoke) => along(normal_of((i + 3) & 3), 1.0, normal_of(i)),
        (Feature::Face, Region::NextSpoke) => along(normal_of(i), 1.0, normal_of(next)),
        (Feature::Face, Region::Mid) => (0..4).fold([0.0; 3], |sum, t| {
            let corner = angle(sub(r[t], mid), sub(r[(t + 1) & 3], mid));
            along(sum, corner, normal_of(t))
        }),
        (Feature::Face, _) => normal_of(i),
    };
    let mut weights = [0.25 * of_mid; 4];
    weights[i] += of_i;
    weights[next] += of_next;
    Closest { feature, distance: d2.sqrt(), vector: scale(-1.0, point), weights, normal }
}

/// Closest point of the triangle `a b c` to the origin by its Voronoi regions (Ericson 2005, section 5.1.5):
/// region, barycentric weights, point.
#[inline(always)]
fn on_triangle(a: Vector, b: Vector, c: Vector) -> (Region, [f64; 3], Vector) {
    let (ab, ac) = (sub(b, a), sub(c, a));
    let (d1, d2) = (-dot(ab, a), -dot(ac, a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (Region::Mid, [1.0, 0.0, 0.0], a);
    }
    let (d3, d4) = (-dot(ab, b), -dot(ac, b));
    if d3 >= 0.0 && d4 <= d3 {
        return (Region::Border(0.0), [0.0, 1.0, 0.0], b);
    }
    let vc = d1.mul_add(d4, -(d3 * d2));
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return (Region::Spoke, [1.0 - v, v, 0.0], along(a, v, ab));
    }
    let (d5, d6) = (-dot(ab, c), -dot(ac, c));
    if d6 >= 0.0 && d5 <= d6 {
        return (Region::Border(1.0), [0.0, 0.0, 1.0], c);
    }
    let vb = d5.mul_add(d2, -(d1 * d6));
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return (Region::NextSpoke, [1.0 - w, 0.0, w], along(a, w, ac));
    }
    let va = d3.mul_add(d6, -(d5 * d4));
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (Region::Border(w), [0.0, 1.0 - w, w], along(b, w, sub(c, b)));
    }
    let sum = va + vb + vc;
    if sum > 0.0 {
        let (v, w) = (vb / sum, vc / sum);
        return (Region::Inside, [(1.0 - v) - w, v, w], along(along(a, v, ab), w, ac));
    }
    // A triangle of no area whose regions rounding has mixed up.
    (Region::Mid, [1.0, 0.0, 0.0], a)
}
