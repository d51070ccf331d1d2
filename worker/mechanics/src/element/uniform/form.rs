//! What tells the forms apart: nodes, patterns of the modes, and the elastic forces of assumed strains on them.

use super::{MODES, MOST, pyramid, tetrahedron, wedge};
use crate::{
    element::{hourglass::Resistance, vector::Vector},
    lanes::Lane,
};

/// One vector for each node.
pub(super) type ByNode<L> = [Vector<L>; MOST];

/// One vector for each mode: amplitudes of the velocity or forces.
pub(super) type ByMode<L> = [Vector<L>; MODES];

/// A form, as a value: one kernel serves all, because such elements are few in a mesh of hexahedra. Entries behind its nodes and
/// modes are zeros.
pub(super) struct Form {
    pub n_nodes: usize,
    /// The node at each corner of the hexahedron that the element is written as ([`crate::mesh::Form::turned`]).
    pub node_of: [usize; 8],
    /// A corner of each node.
    pub corner: [usize; MOST],
    /// The share of the mass that each node carries.
    pub shares: [f64; MOST],
    /// Motions that hourglass control resists, in each direction.
    pub n_modes: usize,
    /// Their patterns over the nodes, of length 1, normal to each other and to a constant field.
    pub patterns: [[f64; MOST]; MODES],
}

impl Form {
    /// That of elements of a mesh. A hexahedron is none of these.
    pub const fn of(form: crate::mesh::Form) -> Option<&'static Self> {
        match form {
            crate::mesh::Form::Hexahedron => None,
            crate::mesh::Form::Wedge => Some(&wedge::FORM),
            crate::mesh::Form::Pyramid => Some(&pyramid::FORM),
            crate::mesh::Form::Tetrahedron => Some(&tetrahedron::FORM),
        }
    }

    /// The forces by which the stresses of assumed strains answer amplitudes, with nodes at `x`: those of a rate of the amplitudes are a
    /// rate of the forces.
    #[inline(always)]
    pub fn assumed<L: Lane>(
        &self,
        resistance: &Resistance,
        x: &ByNode<L>,
        volume: L,
        amplitudes: &ByMode<L>,
    ) -> ByMode<L> {
        if self.n_modes == wedge::FORM.n_modes {
            wedge::assumed(resistance, x, volume, amplitudes)
        } else {
            pyramid::assumed(resistance, x, volume, amplitudes)
        }
    }

    /// Squared stress at the surface that these forces make.
    #[inline(always)]
    pub fn stress_square<L: Lane>(&self, x: &ByNode<L>, volume: L, forces: &ByMode<L>) -> L {
        if self.n_modes == wedge::FORM.n_modes {
            wedge::stress_square(x, volume, forces)
        } else {
            pyramid::stress_square(x, volume, forces)
        }
    }

    /// `sum_n h_mn u_n` of each mode.
    #[inline(always)]
    pub fn along<L: Lane>(&self, u: &ByNode<L>) -> ByMode<L> {
        let mut sums = [none(); MODES];
        let mut mode = 0;
        while mode < MODES {
            let mut node = 0;
            while node < MOST {
                sums[mode] = u[node].mul_add(L::splat(self.patterns[mode][node]), &sums[mode]);
                node += 1;
            }
            mode += 1;
        }
        sums
    }
}

/// A vector of zeros.
#[inline(always)]
pub(super) fn none<L: Lane>() -> Vector<L> {
    let zero = L::splat(0.0);
    Vector { x: zero, y: zero, z: zero }
}

/// `sum_m a_m . b_m`.
#[inline(always)]
pub(super) fn dot<L: Lane>(a: &ByMode<L>, b: &ByMode<L>) -> L {
    a[0].dot(&b[0]) + a[1].dot(&b[1])
}
