//! Elements: the words between a cycle and its element kernels.
//!
//! [`Step`] is what a cycle tells the elements, [`ElementVote`] what they answer; `group` is the seam that each kind fills. The eight-node hexahedron stands
//! in `hex8`, its geometry in `modes`, with rotation, hourglass control, viscosity and time-step limit beside it;
//! `layout` says which nodes a lane set has and `place` brings their values to the kernel and forces back;
//! `vector` is the small algebra they are written in.

use serde::{Deserialize, Serialize};

use crate::exact::Quantum;

pub mod beam2;
pub(crate) mod group;
pub mod hex8;
pub mod hourglass;
pub(crate) mod kinds;
pub(crate) mod layout;
pub(crate) mod modes;
pub(crate) mod place;
pub(crate) mod rotation;
pub mod shell4;
pub mod spring2;
pub mod tet10;
pub mod truss2;
pub mod uniform;
pub(crate) mod vector;
pub(crate) mod viscosity;

/// What one cycle tells the elements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The step that led from `x_{n-1}` to `x_n` (time). Zero for a preparing pass: forces and votes are
    /// computed, the state stays as it is.
    pub dt: f64,
    /// Linear artificial viscosity coefficient `C_L`.
    pub linear_viscosity: f64,
    /// Quadratic artificial viscosity coefficient `C_Q`; enters squared.
    pub quadratic_viscosity: f64,
    /// Corner forces are rounded to it (force).
    pub force_quantum: Quantum,
    /// Energies are rounded to it (energy).
    pub energy_quantum: Quantum,
    /// Quantum of moments over that of forces, a power of two (length).
    pub arm: f64,
}

/// What the elements answer: sums that are exact, minima and maxima, so that the order of elements cannot show.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ElementVote {
    /// Least Courant limit, artificial viscosity included, safety factor not (time); infinite for no element.
    pub courant: f64,
    /// Global index of the element that has it, the lowest of several; `u32::MAX` for no element.
    pub courant_element: u32,
    /// Least `0.1 / |tr D|` (time): the step in which some volume changes by a tenth.
    pub volume_limit: f64,
    pub internal: f64,
    /// Energy that hourglass control took in this step, less what it gave back, at the velocity `v_{n-1/2}`. In a mesh, where the forces of
    /// neighbours mostly balance, that is close; for a single free element it is too much by the part
    /// `4 c dt / mass` (c the resistance of its modes), since its own force slows it within the step.
    pub hourglass: f64,
    /// Work of artificial viscosity in this step; part of the internal energy.
    pub viscosity: f64,
    /// Largest component of any corner force, before rounding (force).
    pub force_bound: f64,
    /// The lowest element that cannot be computed. It gave no force and kept its state.
    pub fault: Option<Fault>,
}

/// An element whose volume is not positive or whose state is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// Global element index.
    pub element: u32,
    /// Its volume at the middle or the end of the step, whichever is smaller.
    pub volume: f64,
}

impl Default for ElementVote {
    fn default() -> Self {
        Self {
            courant: f64::INFINITY,
            courant_element: u32::MAX,
            volume_limit: f64::INFINITY,
            internal: 0.0,
            hourglass: 0.0,
            viscosity: 0.0,
            force_bound: 0.0,
            fault: None,
        }
    }
}

impl ElementVote {
    /// Its numbers, for tests that flip bits in them.
    pub(crate) fn numbers_mut(&mut self) -> [&mut f64; 6] {
        let Self { courant, volume_limit, internal, hourglass, viscosity, force_bound, .. } = self;
        [courant, volume_limit, internal, hourglass, viscosity, force_bound]
    }

    /// Joins the vote of other elements. Votes may be joined in any order.
    pub fn merge(&mut self, other: &ElementVote) {
        self.offer_courant(other.courant, other.courant_element);
        self.volume_limit = self.volume_limit.min(other.volume_limit);
        self.internal += other.internal;
        self.hourglass += other.hourglass;
        self.viscosity += other.viscosity;
        self.force_bound = self.force_bound.max(other.force_bound);
        if let Some(fault) = other.fault {
            self.offer_fault(fault);
        }
    }

    /// Takes a limit if it is smaller than the one known, or equal and of a lower element.
    pub(crate) fn offer_courant(&mut self, courant: f64, element: u32) {
        if courant < self.courant || (courant == self.courant && element < self.courant_element) {
            self.courant = courant;
            self.courant_element = element;
        }
    }

    /// Takes a fault if it is of a lower element than the one known.
    pub(crate) fn offer_fault(&mut self, fault: Fault) {
        if self.fault.is_none_or(|known| fault.element < known.element) {
            self.fault = Some(fault);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn votes_join_to_the_same_in_any_order() {
        let one = ElementVote {
            courant: 1e-7,
            courant_element: 8,
            volume_limit: 3e-7,
            internal: 5.0,
            fault: Some(Fault { element: 9, volume: -1.0 }),
            ..ElementVote::default()
        };
        let two = ElementVote {
            courant: 1e-7,
            courant_element: 3,
            force_bound: 4.0,
            fault: Some(Fault { element: 2, volume: -3.0 }),
            ..ElementVote::default()
        };
        let (mut forward, mut backward) = (one, two);
        forward.merge(&two);
        backward.merge(&one);
        assert_eq!(forward, backward);
        assert_eq!((forward.courant_element, forward.fault.map(|f| f.element)), (3, Some(2)));
    }
}
