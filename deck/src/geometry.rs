//! Exact volume of a hexahedron, its edges and faces, and a few vector operations.

/// The twelve edges of a hexahedron as pairs of corners.
pub(crate) const EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The six faces of a hexahedron, corners in the order that turns the normal outward.
pub(crate) const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [0, 4, 7, 3]];

/// What two elements at a face have in common: its nodes, each once, ascending, and `u32::MAX` behind them. None where an element that repeats
/// corners has drawn the face to an edge.
pub(crate) fn key_of_face(mut nodes: [u32; 4]) -> Option<[u32; 4]> {
    nodes.sort_unstable();
    for i in 1..4 {
        if nodes[i] == nodes[i - 1] {
            nodes[i - 1] = u32::MAX;
        }
    }
    nodes.sort_unstable();
    (nodes[2] != u32::MAX).then_some(nodes)
}

pub(crate) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn scaled(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|x| x * s)
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

pub(crate) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Square of a distance. Its products are not fused: where the processor may lack the instruction each fused one is a call, and what asks
/// for edges asks for those of all elements and needs no last place.
pub(crate) fn distance_square(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = sub(b, a);
    x * x + y * y + z * z
}

/// Length of the longest edge of a hexahedron.
pub(crate) fn longest_edge(x: &[[f64; 3]; 8]) -> f64 {
    let squares = EDGES.iter().map(|&[a, b]| distance_square(x[a], x[b]));
    squares.fold(0.0, f64::max).sqrt()
}

/// The direction of a vector; none where it has no length.
pub(crate) fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let long = norm(v);
    (long > 0.0 && long.is_finite()).then(|| v.map(|c| c / long))
}

pub(crate) use mechanics::element::hex8::volume;

/// Which end of each axis a corner has.
const ENDS: [[bool; 3]; 8] = [
    [false, false, false],
    [true, false, false],
    [true, true, false],
    [false, true, false],
    [false, false, true],
    [true, false, true],
    [true, true, true],
    [false, true, true],
];

/// The corner with the least Jacobian, and that Jacobian: negative where the element is folded there.
pub(crate) fn worst_corner(corners: &[[f64; 3]; 8]) -> (usize, f64) {
    let mut worst = (0, f64::INFINITY);
    for (corner, ends) in ENDS.iter().enumerate() {
        let value = jacobian(corners, ends.map(|end| if end { 1.0 } else { 0.0 }));
        if value < worst.1 {
            worst = (corner, value);
        }
    }
    worst
}

/// Determinant of the Jacobian at `(u, v, w)` of the unit cube.
fn jacobian(x: &[[f64; 3]; 8], at: [f64; 3]) -> f64 {
    let mut columns = [[0.0; 3]; 3];
    for (corner, ends) in x.iter().zip(ENDS) {
        for (axis, column) in columns.iter_mut().enumerate() {
            let mut weight = if ends[axis] { 1.0 } else { -1.0 };
            for other in 0..3 {
                if other != axis {
                    weight *= if ends[other] { at[other] } else { 1.0 - at[other] };
                }
            }
            *column = add(*column, scaled(*corner, weight));
        }
    }
    dot(columns[0], cross(columns[1], columns[2]))
}

/// Distance of `p` from the triangle `a b c`.
pub(crate) fn triangle_distance(p: [f64; 3], a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    let normal = cross(sub(b, a), sub(c, a));
    let area2 = norm(normal);
    if area2 > 0.0 {
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(from, to)| dot(cross(sub(to, from), sub(p, from)), normal) >= 0.0);
        if inside {
            return (dot(sub(p, a), normal) / area2).abs();
        }
    }
    segment_distance(p, a, b).min(segment_distance(p, b, c)).min(segment_distance(p, c, a))
}

/// Distance of `p` from the segment `a b`.
fn segment_distance(p: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let along = sub(b, a);
    let length2 = dot(along, along);
    let t = if length2 > 0.0 { (dot(sub(p, a), along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    norm(sub(p, add(a, scaled(along, t))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volume_of_the_skewed_hexahedron_is_1_014() {
        let corners = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.2, 1.1, 0.1],
            [0.0, 1.0, 0.2],
            [0.1, 0.0, 1.0],
            [1.0, 0.2, 1.3],
            [1.1, 1.0, 1.0],
            [-0.1, 1.0, 0.9],
        ];
        assert!((volume(&corners) - 1.014).abs() < 1e-14);
    }

    #[test]
    fn a_brick_with_two_corners_exchanged_is_folded_there() {
        let mut corners = ENDS.map(|ends| ends.map(|end| if end { 2.0 } else { 0.0 }));
        let (_, plain) = worst_corner(&corners);
        assert!((plain - 8.0).abs() < 1e-14);
        corners.swap(2, 3);
        assert!(worst_corner(&corners).1 < 0.0);
    }

    #[test]
    fn faces_of_the_unit_cube_look_outward() {
        let corner = |i: usize| {
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]][i]
                .map(f64::from)
        };
        for face in FACES {
            let [a, b, c, d] = face.map(corner);
            let normal = cross(sub(c, a), sub(d, b));
            let middle = scaled(add(a, c), 0.5);
            assert!(dot(normal, sub(middle, [0.5; 3])) > 0.0, "{face:?}");
        }
    }

    #[test]
    fn distance_from_a_triangle_has_face_edge_and_corner_regions() {
        let (a, b, c) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert!((triangle_distance([0.2, 0.2, -0.5], a, b, c) - 0.5).abs() < 1e-15);
        assert!((triangle_distance([0.5, -0.3, 0.4], a, b, c) - 0.5).abs() < 1e-15);
        assert!((triangle_distance([-3.0, -4.0, 0.0], a, b, c) - 5.0).abs() < 1e-15);
    }
}
