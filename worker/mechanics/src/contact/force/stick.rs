//! Friction that sticks: a spring across the line of the push, with a slip limit.
//!
//! The spring is as long as the node has moved over the face since it stuck, at most so long that its force is Coulomb's
//! (Mindlin's spring and slider; Cundall and Strack 1979). A node that slips drags a spring at the limit behind it. Its elongation is the
//! node's, a part of its history; where the face turns it turns with it, as far as it lies across the push.

use crate::lanes::{functions, scalar::Scalar};

/// Share of critical damping of a spring that sticks, so that what it holds comes to rest.
const DAMPING: f64 = 0.2;

/// Coulomb's coefficient, which falls from rest to fast sliding: `kinetic + (at rest - kinetic) exp(-decay v)`.
#[derive(Clone, Copy, Debug)]
pub struct Coefficient {
    pub at_rest: f64,
    pub kinetic: f64,
    /// One over a velocity (time per length); 0 for the coefficient at rest whatever the velocity.
    pub decay: f64,
}

impl Coefficient {
    /// The coefficient at a sliding velocity.
    #[inline(always)]
    fn at(&self, speed: f64) -> f64 {
        if self.kinetic == self.at_rest || self.decay == 0.0 {
            return self.at_rest;
        }
        let Scalar(falls) = functions::exp(Scalar(-(self.decay * speed)));
        (self.at_rest - self.kinetic).mul_add(falls, self.kinetic)
    }
}

/// A node that may stick to a face.
#[derive(Clone, Copy, Debug)]
pub struct Sticking {
    pub coefficient: Coefficient,
    /// Elongation of the spring at the positions before (length).
    pub elongation: [f64; 3],
    /// Velocity of the node against the closest point, half a step ago.
    pub velocity: [f64; 3],
    /// Inverse of the mass that the pair moves: `1/m + sum w_i^2/m_i`.
    pub inverse_mass: f64,
    /// Time step that led to the positions of now.
    pub dt: f64,
}

/// What friction does in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Force on the node.
    pub force: [f64; 3],
    /// Elongation of the spring now (length).
    pub elongation: [f64; 3],
    /// Energy in the spring.
    pub stored: f64,
    /// Energy that friction takes out in this step.
    pub taken: f64,
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// `a` across the unit vector `n`.
#[inline(always)]
fn across(a: [f64; 3], n: [f64; 3]) -> [f64; 3] {
    let along = dot(a, n);
    [(-along).mul_add(n[0], a[0]), (-along).mul_add(n[1], a[1]), (-along).mul_add(n[2], a[2])]
}

impl Sticking {
    /// What friction does where the node is pushed with `normal` along `n` by a spring of `stiffness`, which is that across it too.
    #[inline(always)]
    pub fn hold(&self, stiffness: f64, normal: f64, n: [f64; 3]) -> Held {
        let velocity = across(self.velocity, n);
        let before = across(self.elongation, n);
        let mut elongation = [0.0; 3];
        for a in 0..3 {
            elongation[a] = self.dt.mul_add(velocity[a], before[a]);
        }
        let speed2 = dot(velocity, velocity);
        let length = dot(elongation, elongation).sqrt();
        let limit = self.coefficient.at(speed2.sqrt()) * normal;
        let pull = stiffness * length;
        if pull > limit {
            let shorter = limit / pull;
            let elongation = elongation.map(|e| shorter * e);
            return Held {
                force: elongation.map(|e| -(stiffness * e)),
                elongation,
                stored: 0.5 * stiffness * dot(elongation, elongation),
                taken: limit * (length - shorter * length),
            };
        }
        // What of the limit is left is there for the damper.
        let damper = 2.0 * DAMPING * (stiffness / self.inverse_mass).sqrt();
        let mut force = [0.0; 3];
        for a in 0..3 {
            force[a] = -damper.mul_add(velocity[a], stiffness * elongation[a]);
        }
        let size = dot(force, force).sqrt();
        let damped = if size > limit { [0, 1, 2].map(|a| -(stiffness * elongation[a])) } else { force };
        let taken = if size > limit { 0.0 } else { damper * speed2 * self.dt };
        Held { force: damped, elongation, stored: 0.5 * stiffness * length * length, taken }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONSTANT: Coefficient = Coefficient { at_rest: 0.3, kinetic: 0.3, decay: 0.0 };

    fn sticking(elongation: f64, velocity: [f64; 3]) -> Sticking {
        let elongation = [elongation, 0.0, 0.0];
        Sticking { coefficient: CONSTANT, elongation, velocity, inverse_mass: 1.0, dt: 0.01 }
    }

    #[test]
    fn below_the_limit_the_spring_holds_and_above_it_it_slips_at_coulombs_force() {
        let n = [0.0, 0.0, 1.0];
        let still = sticking(0.02, [0.0; 3]).hold(5.0, 1.0, n);
        assert_eq!((still.force, still.taken), ([-0.1, 0.0, 0.0], 0.0));
        assert!((still.stored - 0.5 * 5.0 * 4e-4).abs() < 1e-18);
        let slips = sticking(0.06, [3.0, 0.0, 9.0]).hold(5.0, 1.0, n);
        assert!((slips.force[0] + 0.3).abs() < 1e-15 && slips.force[1..] == [0.0, 0.0], "{slips:?}");
        assert!((slips.elongation[0] - 0.06).abs() < 1e-15);
        assert!((slips.taken - 0.3 * 0.03).abs() < 1e-15, "work of the limit over what slipped");
    }

    #[test]
    fn what_lies_along_the_push_neither_stretches_nor_slips() {
        let held = sticking(0.0, [0.0, 0.0, -7.0]).hold(5.0, 1.0, [0.0, 0.0, 1.0]);
        assert_eq!(held, Held::default());
        let turned = sticking(0.02, [0.0; 3]).hold(5.0, 1.0, [1.0, 0.0, 0.0]);
        assert_eq!(turned.elongation, [0.0; 3]);
    }

    #[test]
    fn the_coefficient_falls_from_rest_to_fast_sliding() {
        let falls = Coefficient { at_rest: 0.5, kinetic: 0.2, decay: 2.0 };
        assert_eq!(falls.at(0.0), 0.5);
        assert!((falls.at(1.0) - (0.2 + 0.3 * (-2.0_f64).exp())).abs() < 1e-15);
        assert!((falls.at(1e3) - 0.2).abs() < 1e-15);
        assert_eq!(Coefficient { decay: 0.0, ..falls }.at(9.0), 0.5);
    }
}
