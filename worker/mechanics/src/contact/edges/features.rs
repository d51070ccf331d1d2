//! Which edges there are and which stick out: a rule on the initial geometry and on which elements are alive, so that it is static data like
//! stiffness, and the same whenever the surface is collected.
//!
//! A sheet folds along any line of its mesh by any angle, and two folds cross far from all nodes, on either side of both: so
//! every edge between shells sticks out, however flat the sheet was.

use super::{
    super::surface::{Face, Surface},
    Edge,
};
use crate::mesh::Mesh;

/// Cosine of the least angle between the normals of two faces at an edge that sticks out: 15 degrees. A body that crosses a
/// flatter one unseen is `L tan(7.5 degrees) / 2` deep at most, 7 % of an element, when the zones of nodes see it.
const SHARP: f64 = 0.965_925_826_289_068_3;

/// How the faces at an edge meet.
#[derive(PartialEq)]
enum Shape {
    /// At a convex angle; shells at any, none included; more or fewer than two faces.
    Sharp,
    /// In a plane, or nearly.
    Flat,
    /// At a hollow angle: nothing gets there before it meets the faces.
    Hollow,
}

/// The edges of a surface that can meet others, by their nodes: all but hollow ones. Angles are those of the initial
/// geometry.
pub(in super::super) fn features(surface: &Surface, mesh: &Mesh) -> Vec<Edge> {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(4 * surface.faces.len());
    for (f, face) in (0..).zip(&surface.faces) {
        for i in 0..4 {
            let (a, b) = (face.nodes[i], face.nodes[(i + 1) & 3]);
            if a != b {
                sides.push(([a.min(b), a.max(b)], f));
            }
        }
    }
    sides.sort_unstable();
    let at = |n: u32| mesh.positions[surface.nodes[n as usize] as usize];
    let mut found = Vec::new();
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        let faces = [same[0].1, same.get(1).map_or(u32::MAX, |side| side.1)];
        let shape = match same {
            [(nodes, a), (_, b)] => {
                let [a, b] = [a, b].map(|&f| &surface.faces[f as usize]);
                match [a, b].map(|face| Face::is_shell(&face.corners)) {
                    [false, false] if !is_sharp(a, b, &at) => Shape::Flat,
                    [false, false] if !is_convex(a, b, nodes[0], &at) => Shape::Hollow,
                    _ => Shape::Sharp,
                }
            }
            _ => Shape::Sharp,
        };
        if shape != Shape::Hollow {
            let part = same.iter().map(|side| surface.faces[side.1 as usize].part).min().unwrap_or(0);
            found.push(Edge { nodes: same[0].0, part, faces, sharp: shape == Shape::Sharp });
        }
    }
    found
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// Cross product of the diagonals: along the outward normal.
fn normal(face: &Face, at: &impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
    let x = face.nodes.map(at);
    let (p, q) = (sub(x[2], x[0]), sub(x[3], x[1]));
    [
        p[1].mul_add(q[2], -(p[2] * q[1])),
        p[2].mul_add(q[0], -(p[0] * q[2])),
        p[0].mul_add(q[1], -(p[1] * q[0])),
    ]
}

/// Whether the normals of two faces of solids are more than the least angle apart.
fn is_sharp(a: &Face, b: &Face, at: &impl Fn(u32) -> [f64; 3]) -> bool {
    let (m, n) = (normal(a, at), normal(b, at));
    let size = (dot(m, m) * dot(n, n)).sqrt();
    dot(m, n) < SHARP * size || size == 0.0
}

/// Whether the second face lies behind the plane of the first, which passes through `node`.
fn is_convex(a: &Face, b: &Face, node: u32, at: &impl Fn(u32) -> [f64; 3]) -> bool {
    let x = b.nodes.map(at);
    let middle = [0, 1, 2].map(|i| 0.25 * ((x[0][i] + x[1][i]) + (x[2][i] + x[3][i])));
    dot(normal(a, at), sub(middle, at(node))) < 0.0
}
