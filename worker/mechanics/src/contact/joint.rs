//! A joint counts once, and every hit has a side.
//!
//! The zones of adjacent faces overlap, so a node near a joint lies in several. Its *near* faces are reduced to
//! distinct closest features. All faces that share a feature are among the near ones: the feature is a part of
//! each, so none of them is farther from the node than the feature, and the candidate list is complete up to
//! the zone of warning.
//!
//! Going through the near faces by distance, then id, a face is dropped if an earlier one shares its feature
//! (its own closest point lies on the earlier face too, which is at least as near: either at the same point,
//! then the joint is already counted, or at another, then the joint is not closest for all who share it), or
//! if its face holds the feature of an earlier one (the same point but for rounding).
//!
//! What is left is distinct: one hit over a flat or convex surface; several in a concave corner, or between
//! bodies.

pub(super) mod lanes;

use super::zone::{Feature, Frame, INNER, Nearest, OUTER, Vector, dot, unit};

/// A face near a node.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    /// The caller's index of the face.
    pub face: u32,
    /// Face id: the order of equals.
    pub id: u32,
    /// Nodes of the face's corners, in one numbering for all faces.
    pub corners: [u32; 4],
    /// Closest point of the face.
    pub nearest: Nearest,
}

/// One distinct feature near a node: a push if `depth` is positive.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Index into the near faces.
    pub near: u32,
    /// Depth of the node in the zone: gap minus signed distance, up to twice the gap (length).
    pub depth: f64,
    /// Unit vector along the line of node and closest point, out of the solid.
    pub direction: Vector,
    /// Share of the push this hit has, in (0, 1]: below 1 where several hits push the same way.
    pub share: f64,
    /// Whether the node is on the outer side.
    outer: bool,
}

/// Whether the feature of `near`, an edge or a corner, belongs to the face with these corners.
#[inline(always)]
fn belongs(near: &Near, corners: &[u32; 4]) -> bool {
    shares(near.nearest.feature, &near.corners, corners)
}

/// Whether a feature, an edge or a corner of the face with corners `of`, belongs to the face with these corners.
#[inline(always)]
pub(super) fn shares(feature: Feature, of: &[u32; 4], corners: &[u32; 4]) -> bool {
    match feature {
        Feature::Face => false,
        Feature::Corner(i) => {
            let c = of[i as usize & 3];
            (corners[0] == c) | (corners[1] == c) | (corners[2] == c) | (corners[3] == c)
        }
        Feature::Edge(i) => {
            let (a, b) = (of[i as usize & 3], of[(i as usize + 1) & 3]);
            let at = |c: u32| [corners[0] == c, corners[1] == c, corners[2] == c, corners[3] == c];
            let (a, b) = (at(a), at(b));
            ((a[0] | a[2]) & (b[1] | b[3])) | ((a[1] | a[3]) & (b[0] | b[2]))
        }
    }
}

/// The one hit of a node of whose near faces all but the nearest are dropped, and that lies on one side of all
/// that share the feature: what [`reduce`] would find. `distance` is positive and below the gap.
#[inline(always)]
pub(super) fn lone(gap: f64, distance: f64, outer: bool, vector: Vector) -> (f64, Vector) {
    let (s, depth) = if outer { (1.0 / distance, gap - distance) } else { (-1.0 / distance, gap + distance) };
    (depth, [s * vector[0], s * vector[1], s * vector[2]])
}

/// Whether a node is so near its closest point that the line has no direction.
#[inline(always)]
pub(super) fn is_on_feature(distance: f64, gap: f64) -> bool {
    distance <= 1e-9 * gap
}

/// Reduces the near faces of one node to distinct features within the gap, into `hits`, and to indices of
/// those beyond it, into `beyond`; both are cleared first. Sorts `near` by distance, then id, so the result
/// does not depend on its order. `frame` gives the frame of a face by the caller's index.
#[inline(always)]
pub fn reduce(
    near: &mut [Near],
    gap: f64,
    frame: impl Fn(u32) -> Frame,
    hits: &mut Vec<Hit>,
    beyond: &mut Vec<u32>,
) {
    hits.clear();
    beyond.clear();
    sort_by_distance(near);
    for (i, face) in near.iter().enumerate() {
        if near[..i].iter().any(|earlier| belongs(face, &earlier.corners) || belongs(earlier, &face.corners))
        {
            continue;
        }
        let distance = face.nearest.distance2.sqrt();
        if distance >= gap {
            beyond.push(i as u32);
        } else if let Some(hit) = hit(near, i, gap, distance, &frame) {
            hits.push(hit);
        }
    }
    if hits.len() > 1 {
        agree(near, hits);
        share(hits);
    }
}

/// Insertion sort: a node has few near faces.
#[inline(always)]
fn sort_by_distance(near: &mut [Near]) {
    for i in 1..near.len() {
        let mut j = i;
        while j > 0 {
            let (a, b) = (&near[j - 1], &near[j]);
            let ordered = a.nearest.distance2 < b.nearest.distance2
                || (a.nearest.distance2 == b.nearest.distance2 && a.id < b.id);
            if ordered {
                break;
            }
            near.swap(j - 1, j);
            j -= 1;
        }
    }
}

/// The hit of near face `i`. None for a face of no area with the node on it.
///
/// Its side is that of the pseudonormal of its feature, a sum with positive factors of the normals of the near
/// faces that share it: where the node is on the same side of all of them the sum need not be made.
#[inline(always)]
fn hit(near: &[Near], i: usize, gap: f64, distance: f64, frame: &impl Fn(u32) -> Frame) -> Option<Hit> {
    let nearest = &near[i].nearest;
    let mut sides = nearest.sides;
    if nearest.feature != Feature::Face {
        for (j, other) in near.iter().enumerate() {
            if j != i && belongs(&near[i], &other.corners) {
                sides |= other.nearest.sides;
            }
        }
    }
    let on_feature = is_on_feature(distance, gap);
    let mut outer = sides == OUTER;
    let mut normal = [0.0; 3];
    if on_feature || (sides != OUTER && sides != INNER) {
        normal = pseudonormal(near, i, frame);
        outer = dot(nearest.vector, normal) >= 0.0;
    }
    let (direction, depth) = if on_feature {
        (unit(normal), gap)
    } else {
        let (depth, direction) = lone(gap, distance, outer, nearest.vector);
        (direction, depth)
    };
    (direction != [0.0; 3]).then_some(Hit { near: i as u32, depth, direction, share: 1.0, outer })
}

/// Pseudonormal of the feature of near face `i`: over all near faces that share it, in order of distance.
#[inline(never)]
fn pseudonormal(near: &[Near], i: usize, frame: &impl Fn(u32) -> Frame) -> Vector {
    let mut normal = frame(near[i].face).pseudonormal(&near[i].nearest);
    if near[i].nearest.feature != Feature::Face {
        for (j, other) in near.iter().enumerate() {
            if j != i && belongs(&near[i], &other.corners) {
                let n = frame(other.face).pseudonormal(&other.nearest);
                normal = [normal[0] + n[0], normal[1] + n[1], normal[2] + n[2]];
            }
        }
    }
    normal
}

/// Drops hits on the wrong side of a patch: beside an acute edge the node lies outside by the nearer face and
/// behind the other's plane, and where a patch folds over itself, behind what it covers. Of hits of one patch
/// the nearest one knows the side.
fn agree(near: &[Near], hits: &mut Vec<Hit>) {
    if hits.iter().all(|hit| hit.outer == hits[0].outer) {
        return;
    }
    let patch = patches(near);
    let of = |hit: &Hit| patch[hit.near as usize];
    for j in 1..hits.len() {
        let nearest = hits[..j].iter().find(|hit| of(hit) == of(&hits[j]));
        if nearest.is_some_and(|nearest| nearest.outer != hits[j].outer) {
            hits[j].share = 0.0;
        }
    }
    hits.retain(|h| h.share > 0.0);
}

/// The patch of each near face, by the number of one of its faces: faces that share a node are of one patch.
fn patches(near: &[Near]) -> Vec<usize> {
    let mut patch: Vec<usize> = (0..near.len()).collect();
    for (i, face) in near.iter().enumerate() {
        for j in 0..i {
            if patch[i] != patch[j] && near[j].corners.iter().any(|n| face.corners.contains(n)) {
                let [from, to] = [patch[i], patch[j]];
                patch.iter_mut().filter(|of| **of == from).for_each(|of| *of = to);
            }
        }
    }
    patch
}

/// Shares the push among hits that push the same way.
///
/// `share_i = 1 / sum_j max(0, n_i . n_j) min(1, depth_j / depth_i)`: two faces of a right-angled corner push
/// in full, and so do two bodies from both sides; over a joint that is concave by a small angle two slabs
/// overlap in a strip, and their pushes count as one, as on the flat patch that the angle tends to. A hit that
/// begins takes nothing from the others at once. The stiffness in any direction stays below that of one hit
/// from each side.
fn share(hits: &mut [Hit]) {
    for i in 0..hits.len() {
        let mut sum = 1.0;
        for j in (0..hits.len()).filter(|&j| j != i) {
            let cosine = dot(hits[i].direction, hits[j].direction);
            if cosine > 0.0 {
                let ratio = hits[j].depth / hits[i].depth;
                sum += cosine.min(1.0) * ratio.min(1.0);
            }
        }
        hits[i].share = 1.0 / sum;
    }
}

/// How many hits' stiffness can add up along one direction: the greatest row sum of shares times cosines, an
/// upper bound of the norm of `sum share_i n_i n_i^T`; at least 1.
pub fn stacking(hits: &[Hit]) -> f64 {
    let mut most = 1.0_f64;
    for a in hits {
        let mut row = 0.0;
        for b in hits {
            row += b.share * dot(a.direction, b.direction).abs();
        }
        most = most.max(row);
    }
    most
}

#[cfg(test)]
mod tests {
    use super::{
        super::zone::{cross, sub},
        *,
    };

    /// A random number from -1 to 1.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        fn point(&mut self) -> Vector {
            [self.next(), self.next(), self.next()]
        }
    }

    /// The rim of a sphere of tetrahedra that flattens on a plate: two of its faces have folded under, with a corner above the node,
    /// whose nearest face is another of the rim.
    #[test]
    fn what_a_patch_folds_over_is_not_inside() {
        let x = [
            [4.9454, 0.0432, -0.4601],
            [4.9646, 0.0024, 0.0897],
            [3.7283, -1.1531, -0.5548],
            [3.2054, -0.0343, -0.6589],
            [4.7088, 0.8717, -0.1258],
            [4.5024, 0.8732, -0.3156],
            [4.4883, -0.7762, -0.3097],
            [4.7692, -0.7445, -0.1338],
            [4.8459, -0.0011, -0.4635],
        ];
        let faces = [
            [2, 3, 0, 0],
            [1, 8, 4, 4],
            [8, 0, 5, 5],
            [8, 5, 4, 4],
            [0, 8, 6, 6],
            [8, 1, 7, 7],
            [8, 7, 6, 6],
        ];
        let p = [4.8457, -0.0006, -0.5131];
        let frames = faces.map(|face| Frame::new(&face.map(|n: u32| x[n as usize])));
        for turned in 0..faces.len() {
            // Of equals the first by its number is the feature's.
            let id = |i: usize| ((i + turned) % faces.len()) as u32;
            let mut near: Vec<Near> = (0..faces.len())
                .map(|i| Near { face: i as u32, id: id(i), corners: faces[i], nearest: frames[i].nearest(p) })
                .collect();
            let (mut hits, mut beyond) = (vec![], vec![]);
            reduce(&mut near, 0.0506, |i| frames[i as usize], &mut hits, &mut beyond);
            assert_eq!(hits.len(), 1, "{hits:?}");
            assert!(hits[0].outer && near[hits[0].near as usize].face == 0);
        }
    }

    /// Any of four corners may stand for two, wherever a face begins.
    #[test]
    fn a_node_near_a_spike_of_triangles_is_on_its_side() {
        let mut random = Random(3);
        let (mut counts, mut acute) = ([0; 2], 0);
        for round in 0..100_000 {
            let mut x = [random.point(), random.point(), random.point(), random.point()];
            // Every other one is a spike.
            if round % 2 == 0 {
                x[0] = [8.0 * x[0][0], 8.0 * x[0][1], 8.0 * x[0][2]];
            }
            let away = |a: usize, b: usize| sub(x[a], x[b]);
            let volume = dot(away(1, 0), cross(away(2, 0), away(3, 0)));
            if volume.abs() < 0.05 {
                continue;
            }
            if volume < 0.0 {
                x.swap(1, 2);
            }
            let outward = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
            let faces = outward.map(|face| {
                let at = (3.0 * random.next().abs()) as usize;
                let [a, b, c] = [0, 1, 2].map(|i| face[(i + at) % 3]);
                if random.next() > 0.0 { [a, b, c, c] } else { [a, a, b, c] }
            });
            let frames = faces.map(|face| Frame::new(&face.map(|n: u32| x[n as usize])));
            let of = x[(random.next().abs() * 4.0) as usize];
            let p = [0, 1, 2].map(|a| 0.3_f64.mul_add(random.next(), of[a]));
            let height = |f: usize| {
                let [a, b, c] = outward[f].map(|n| x[n as usize]);
                dot(sub(p, a), cross(sub(b, a), sub(c, a)))
            };
            let heights = [0, 1, 2, 3].map(height);
            let is_outside = heights.iter().any(|&h| h > 0.0);
            let mut near = [0, 1, 2, 3].map(|f| Near {
                face: f,
                id: f,
                corners: faces[f as usize],
                nearest: frames[f as usize].nearest(p),
            });
            let (mut hits, mut beyond) = (vec![], vec![]);
            reduce(&mut near, 100.0, |f| frames[f as usize], &mut hits, &mut beyond);
            assert_eq!(hits[0].outer, is_outside, "round {round}: {x:?} {faces:?} {p:?}");
            counts[usize::from(is_outside)] += 1;
            acute += usize::from(near[0].nearest.sides == INNER && is_outside);
        }
        assert!(counts.iter().all(|&n| n > 1000) && acute > 100, "{counts:?} {acute}");
    }
}
