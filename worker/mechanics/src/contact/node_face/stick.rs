//! Friction that sticks, of the hits of a node.
//!
//! A node has one spring across its push: that of its deepest hit. Where several faces hold it, in a concave corner, the others have
//! friction of their own without history: a spring that begins anew in each cycle, which resists sliding and lets creep.

use super::NodeFace;
use crate::{
    contact::{
        force::{
            self, Push, Reaction,
            damper::Damper,
            stick::{Coefficient, Sticking},
        },
        history::History,
    },
    exact::Quantum,
};

/// Where the pushes of a node that begin at `first` of `n` end, and the deepest of them, the first of equals.
#[inline(always)]
pub(super) fn deepest(nodes: &[u32], depths: &[f64], first: usize, n: usize) -> (usize, usize) {
    let (mut end, mut deepest) = (first, first);
    while end < n && nodes[end] == nodes[first] {
        if depths[end] > depths[deepest] {
            deepest = end;
        }
        end += 1;
    }
    (end, deepest)
}

impl NodeFace {
    /// A node that may stick where the coefficients are those of entry `between` of the matrices; its spring is not stretched.
    #[inline(always)]
    pub(super) fn sticking(
        &self,
        between: usize,
        velocity: [f64; 3],
        inverse_mass: f64,
        dt: f64,
    ) -> Sticking {
        let at_rest = self.settings.friction[between];
        let kinetic = self.settings.friction_kinetic.get(between).copied().unwrap_or(at_rest);
        let coefficient = Coefficient { at_rest, kinetic, decay: self.settings.friction_decay };
        Sticking { coefficient, elongation: [0.0; 3], velocity, inverse_mass, dt }
    }

    /// The reaction of a hit of a node. The deepest one has the node's spring, and leaves it in its history.
    #[inline(always)]
    pub(super) fn hold(
        &self,
        push: &Push,
        mut sticking: Sticking,
        (node, is_deepest): (usize, bool),
        quanta: (Quantum, Quantum),
        history: &mut History,
    ) -> Reaction {
        let first = self.settings.first_of_stick();
        let keeps = is_deepest && !history.is_empty();
        if keeps {
            sticking.elongation.copy_from_slice(&history.before(node)[first..first + 3]);
        }
        let Sticking { inverse_mass, velocity, dt, .. } = sticking;
        let damper = Damper { stiffness: push.stiffness, inverse_mass, gap: self.settings.gap, velocity, dt };
        let damped = damper.of(push.spring.force, push.direction);
        let held = sticking.hold(push.stiffness, damped.normal, push.direction);
        if keeps {
            history.after_mut(node)[first..first + 3].copy_from_slice(&held.elongation);
        }
        force::react_held(push, &damped, &held, quanta, history.cycle)
    }
}
