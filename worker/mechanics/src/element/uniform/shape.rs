//! Volume of an element and its gradient by the nodes.

use super::{
    MOST,
    form::{ByNode, Form, none},
};
use crate::{
    element::{
        modes::{Gradient, Modes, corner_values, modes_of},
        vector::{Tensor, Vector},
        viscosity::Spread,
    },
    lanes::Lane,
};

pub(super) struct Shape<L> {
    pub volume: L,
    /// `dV/dx_n`.
    pub gradient: ByNode<L>,
}

impl<L: Lane> Shape<L> {
    #[inline(always)]
    pub fn of(form: &Form, x: &ByNode<L>) -> Self {
        let zero = L::splat(0.0);
        let mut corners = [[zero; 8]; 3];
        let mut corner = 0;
        while corner < 8 {
            let node = &x[form.node_of[corner]];
            (corners[0][corner], corners[1][corner], corners[2][corner]) = (node.x, node.y, node.z);
            corner += 1;
        }
        let modes = Modes::of(modes_of(corners[0]), modes_of(corners[1]), modes_of(corners[2]));
        let g = Gradient::of(&modes);
        let by_x = corner_values([g.a.x, g.b.x, g.c.x, g.d.x, g.e.x, g.f.x, zero]);
        let by_y = corner_values([g.a.y, g.b.y, g.c.y, g.d.y, g.e.y, g.f.y, zero]);
        let by_z = corner_values([g.a.z, g.b.z, g.c.z, g.d.z, g.e.z, g.f.z, zero]);
        let mut gradient = [none(); MOST];
        let mut corner = 0;
        while corner < 8 {
            let of_corner = Vector { x: by_x[corner], y: by_y[corner], z: by_z[corner] };
            let node = form.node_of[corner];
            gradient[node] = of_corner.mul_add(L::splat(1.0 / 64.0), &gradient[node]);
            corner += 1;
        }
        Self { volume: g.volume(), gradient }
    }

    /// `sum_n v_n B_n^T`: by the volume it is the mean velocity gradient.
    #[inline(always)]
    pub fn against(&self, v: &ByNode<L>) -> Tensor<L> {
        let mut sum = Tensor::outer(&v[0], &self.gradient[0]);
        let mut node = 1;
        while node < MOST {
            sum = sum.outer_add(&v[node], &self.gradient[node]);
            node += 1;
        }
        sum
    }

    /// `sum_n B_n B_n^T / (8 s_n)` with the shares of the mass s: what the tensor S of the hexahedron is to the time step, in which each
    /// node has an eighth.
    #[inline(always)]
    pub fn spread(&self, form: &Form) -> Spread<L> {
        let mut by_mass = self.gradient;
        let mut node = 0;
        while node < form.n_nodes {
            by_mass[node] = by_mass[node].scaled(L::splat((0.125 / form.shares[node]).sqrt()));
            node += 1;
        }
        let mut spread = Spread::gram([&by_mass[0], &by_mass[1], &by_mass[2]]);
        let mut node = 3;
        while node < form.n_nodes {
            spread.add(&by_mass[node]);
            node += 1;
        }
        spread
    }
}
