//! Small tetrahedra, their gradients, and the field that is linear in the element.
//!
//! Volumes and their derivatives are six times as large throughout, as products of edges give them.

use super::NODES;
use crate::{
    element::{
        vector::{Tensor, Vector},
        viscosity::Spread,
    },
    lanes::Lane,
};

/// Number of small tetrahedra.
pub(super) const SMALL: usize = 12;

/// The mean of the edge nodes, behind the nodes.
const CENTRE: usize = NODES;

/// The face of each small tetrahedron that looks away from its apex. Those at the corners have the corner as apex; the others the mean of the edge
/// nodes, four with a face towards each corner and four with one on the face of the element opposite to each.
pub(super) const TRIANGLES: [[usize; 3]; SMALL] = [
    [4, 6, 7],
    [5, 4, 8],
    [6, 5, 9],
    [8, 7, 9],
    [6, 4, 7],
    [4, 5, 8],
    [5, 6, 9],
    [7, 8, 9],
    [5, 9, 8],
    [6, 7, 9],
    [4, 8, 7],
    [5, 4, 6],
];

const ROOT_5: f64 = 2.236_067_977_499_79;

/// Greatest frequency of twelve small tetrahedra whose gradients are projected, squared, in units of the square of the wave speed times the
/// largest eigenvalue of the natural metric, for nodes of [`super::SHARES`]: exact for an element with straight edges.
const STIFFEST: f64 = 10.0;

#[inline(always)]
fn apex(k: usize) -> usize {
    if k < 4 { k } else { CENTRE }
}

#[inline(always)]
fn minus<L: Lane>(a: &Vector<L>, b: &Vector<L>) -> Vector<L> {
    Vector { x: a.x - b.x, y: a.y - b.y, z: a.z - b.z }
}

#[inline(always)]
fn plus<L: Lane>(a: &Vector<L>, b: &Vector<L>) -> Vector<L> {
    Vector { x: a.x + b.x, y: a.y + b.y, z: a.z + b.z }
}

#[inline(always)]
fn none<L: Lane>() -> Vector<L> {
    let zero = L::splat(0.0);
    Vector { x: zero, y: zero, z: zero }
}

#[inline(always)]
pub(super) fn no_tensor<L: Lane>() -> Tensor<L> {
    Tensor { x: none(), y: none(), z: none() }
}

/// `a factor + b`.
#[inline(always)]
pub(super) fn mul_add<L: Lane>(a: &Tensor<L>, factor: L, b: &Tensor<L>) -> Tensor<L> {
    Tensor { x: a.x.mul_add(factor, &b.x), y: a.y.mul_add(factor, &b.y), z: a.z.mul_add(factor, &b.z) }
}

/// The nodes and their mean on the edges.
#[inline(always)]
fn with_centre<L: Lane>(of: &[Vector<L>; NODES]) -> [Vector<L>; NODES + 1] {
    let sum = plus(&plus(&plus(&of[4], &of[5]), &plus(&of[6], &of[7])), &plus(&of[8], &of[9]));
    let mut all = [none(); NODES + 1];
    all[..NODES].copy_from_slice(of);
    all[CENTRE] = sum.scaled(L::splat(1.0 / 6.0));
    all
}

/// An element with its nodes at some places.
pub(super) struct Shape<L> {
    /// Derivatives of the volume of each small tetrahedron by the nodes of [`TRIANGLES`]; that by its apex is minus their sum.
    gradients: [[Vector<L>; 3]; SMALL],
    volumes: [L; SMALL],
}

/// A field's gradients times volumes: at the points and of the whole element.
pub(super) struct Gradients<L> {
    pub points: [Tensor<L>; 4],
    pub whole: Tensor<L>,
}

impl<L: Lane> Shape<L> {
    #[inline(always)]
    pub fn of(x: &[Vector<L>; NODES]) -> Self {
        let x = with_centre(x);
        let mut shape = Self { gradients: [[none(); 3]; SMALL], volumes: [L::splat(0.0); SMALL] };
        let mut k = 0;
        while k < SMALL {
            let [p, q, r] = TRIANGLES[k];
            let from = &x[apex(k)];
            let (p, q, r) = (minus(&x[p], from), minus(&x[q], from), minus(&x[r], from));
            let along_p = q.cross(&r);
            shape.volumes[k] = p.dot(&along_p);
            shape.gradients[k] = [along_p, r.cross(&p), p.cross(&q)];
            k += 1;
        }
        shape
    }

    /// Volume of the element, not six times as large.
    #[inline(always)]
    pub fn volume(&self) -> L {
        self.six_volumes() * L::splat(1.0 / 6.0)
    }

    #[inline(always)]
    pub fn six_volumes(&self) -> L {
        let v = &self.volumes;
        ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7])) + ((v[8] + v[9]) + (v[10] + v[11]))
    }

    pub fn volumes(&self) -> &[L; SMALL] {
        &self.volumes
    }

    /// Volumes of the points.
    #[inline(always)]
    pub fn of_points(&self) -> [L; 4] {
        let quarter = L::splat(0.25);
        let mut own = [L::splat(0.0); 4];
        let mut a = 0;
        while a < 4 {
            let [corner, inner, outer] = [a, 4 + a, 8 + a].map(|k| self.volumes[k]);
            own[a] = corner.mul_add(L::splat(0.5), quarter * (inner - outer));
            a += 1;
        }
        let mean = quarter * ((own[0] + own[1]) + (own[2] + own[3]));
        let share = quarter * self.six_volumes();
        let mut a = 0;
        while a < 4 {
            own[a] = (own[a] - mean).mul_add(L::splat(ROOT_5), share);
            a += 1;
        }
        own
    }

    /// Gradients of a field with these values at the nodes.
    #[inline(always)]
    pub fn against(&self, field: &[Vector<L>; NODES]) -> Gradients<L> {
        let field = with_centre(field);
        let quarter = L::splat(0.25);
        let (mut points, mut mean, mut whole) = ([no_tensor(); 4], no_tensor(), no_tensor());
        let mut a = 0;
        while a < 4 {
            let corner = self.small(a, &field);
            let inner = self.small(4 + a, &field);
            let outer = self.small(8 + a, &field);
            let one = L::splat(1.0);
            whole = mul_add(&outer, one, &mul_add(&inner, one, &mul_add(&corner, one, &whole)));
            let own = mul_add(&inner, quarter, &corner.scaled(L::splat(0.5)));
            points[a] = mul_add(&outer, -quarter, &own);
            mean = mul_add(&points[a], quarter, &mean);
            a += 1;
        }
        let share = whole.scaled(quarter);
        let root = L::splat(ROOT_5);
        let mut a = 0;
        while a < 4 {
            points[a] = mul_add(&points[a], root, &mul_add(&mean, -root, &share));
            a += 1;
        }
        Gradients { points, whole }
    }

    /// Gradient times volume of a small tetrahedron.
    #[inline(always)]
    fn small(&self, k: usize, field: &[Vector<L>; NODES + 1]) -> Tensor<L> {
        let [p, q, r] = TRIANGLES[k];
        let from = &field[apex(k)];
        let [along_p, along_q, along_r] = &self.gradients[k];
        Tensor::outer(&minus(&field[p], from), along_p)
            .outer_add(&minus(&field[q], from), along_q)
            .outer_add(&minus(&field[r], from), along_r)
    }

    /// `sum_g t_g V_g dH_g/dv` by node (six times as large): what stresses `t` at the points do on the nodes. The weights of a small
    /// tetrahedron make of them the value of the linear field at its middle.
    #[inline(always)]
    pub fn forces(&self, stress: &[Tensor<L>; 4]) -> [Vector<L>; NODES] {
        let (one, quarter) = (L::splat(1.0), L::splat(0.25));
        let sum = mul_add(&stress[0], one, &mul_add(&stress[1], one, &mul_add(&stress[2], one, &stress[3])));
        let mean = sum.scaled(quarter);
        let mut forces = [none(); NODES + 1];
        let mut a = 0;
        while a < 4 {
            let own = mul_add(&mean, -one, &stress[a]);
            self.add_forces(a, &mul_add(&own, L::splat(0.5 * ROOT_5), &mean), &mut forces);
            self.add_forces(4 + a, &mul_add(&own, L::splat(0.25 * ROOT_5), &mean), &mut forces);
            self.add_forces(8 + a, &mul_add(&own, L::splat(-0.25 * ROOT_5), &mean), &mut forces);
            a += 1;
        }
        let share = forces[CENTRE].scaled(L::splat(1.0 / 6.0));
        let mut of_nodes = [none(); NODES];
        let mut node = 0;
        while node < NODES {
            of_nodes[node] = if node < 4 { forces[node] } else { plus(&forces[node], &share) };
            node += 1;
        }
        of_nodes
    }

    #[inline(always)]
    fn add_forces(&self, k: usize, stress: &Tensor<L>, forces: &mut [Vector<L>; NODES + 1]) {
        let [p, q, r] = TRIANGLES[k];
        let [of_p, of_q, of_r] = &self.gradients[k];
        let (of_p, of_q, of_r) = (stress.apply(of_p), stress.apply(of_q), stress.apply(of_r));
        forces[p] = plus(&forces[p], &of_p);
        forces[q] = plus(&forces[q], &of_q);
        forces[r] = plus(&forces[r], &of_r);
        let from = apex(k);
        forces[from] = minus(&forces[from], &plus(&of_p, &plus(&of_q, &of_r)));
    }

    /// Derivatives of the volume of the element by its nodes (six times as large).
    #[inline(always)]
    pub fn volume_gradient(&self) -> [Vector<L>; NODES] {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let unit = Tensor {
            x: Vector { x: one, y: zero, z: zero },
            y: Vector { x: zero, y: one, z: zero },
            z: Vector { x: zero, y: zero, z: one },
        };
        self.forces(&[unit; 4])
    }

    /// Greatest inverse length of the points, squared, as it bounds frequencies: the natural metric of a point, weighted with the volume
    /// that it has of the element. `inverse` is one over six volumes.
    #[inline(always)]
    pub fn narrowest(&self, of_points: &[L; 4], inverse: L) -> L {
        // Natural coordinates of the first three corners; the fourth is what they leave of 1.
        let at = |node: usize, corner: usize| {
            if node < 4 {
                return if node == corner { 1.0 } else { 0.0 };
            }
            if super::EDGES[node - 4][0] == corner || super::EDGES[node - 4][1] == corner { 0.5 } else { 0.0 }
        };
        let mut natural = [none(); NODES];
        let mut node = 0;
        while node < NODES {
            natural[node] =
                Vector { x: L::splat(at(node, 0)), y: L::splat(at(node, 1)), z: L::splat(at(node, 2)) };
            node += 1;
        }
        let gradients = self.against(&natural);
        let mut most = L::splat(0.0);
        let mut point = 0;
        while point < 4 {
            let Tensor { x, y, z } = &gradients.points[point];
            let fourth = Vector { x: -(x.x + y.x + z.x), y: -(x.y + y.y + z.y), z: -(x.z + y.z + z.z) };
            let mut metric = Spread::gram([x, y, z]);
            metric.add(&fourth);
            // By the volume of the point once only: its energy is that volume times the square of the gradient.
            most = most.max(metric.largest_eigenvalue() * inverse / of_points[point]);
            point += 1;
        }
        L::splat(4.0 * STIFFEST) * most
    }
}
