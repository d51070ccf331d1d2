//! A damper along the push, where friction sticks: what lies on something comes to rest.
//!
//! A penalty spring alone gives back all that it takes. So a body that has landed shakes for ever, and in every cycle in which it is pressed less,
//! what holds it against sliding slips a little. A damper acts beside the spring,
//!
//! `F = f(d) - D`, `D = c v` within `-L .. L`, `c = 2 DAMPING sqrt(k / (1/m + sum w_i^2/m_i))`, `L = SHARE min(f(d), SHALLOW k gap)`,
//!
//! with `v` the velocity at which node and closest point part, `f` the force of the spring at depth `d` and `k` its stiffness. In a step it takes
//! `D (v - D dt/(2M)) dt` with `1/M = 1/m + sum w_i^2/m_i`, which counts as friction. `SHARE` is below 1, so that the contact never pulls and
//! the damper begins and ends with the spring.
//!
//! The limit by `SHALLOW` tells rest from impact. What weight presses lies some millionths of the gap deep, and all of its shaking
//! is damped; what strikes goes hundreds of times as deep as the limit, and loses next to nothing. A damper of a few per cent of critical without limits
//! takes more from an impact, and does not stop a stack: its swings are slow, and the springs stiff.

/// Share of critical damping.
const DAMPING: f64 = 0.3;
/// Share of the spring's force that the damper is at most.
const SHARE: f64 = 0.2;
/// Depth (gaps) beyond which its limit grows no further: with usual gaps a pressure of 1e-5 bulk moduli, 1.6 MPa of steel.
const SHALLOW: f64 = 2e-4;

/// The time step that springs vote for is short enough for the damper, too: with a force by the velocity of half a step ago
/// `(omega dt)^2 + 4 DAMPING omega dt` may be 4 at most, and is a sixth of that.
const _: () = assert!(super::OMEGA_DT * super::OMEGA_DT + 4.0 * DAMPING * super::OMEGA_DT < 4.0 / 6.0);

/// A push with its damper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damped {
    /// Force along the push.
    pub normal: f64,
    /// Energy that the damper takes out in this step.
    pub taken: f64,
}

/// The damper of a pair.
#[derive(Clone, Copy, Debug)]
pub struct Damper {
    /// Penalty stiffness (force per length).
    pub stiffness: f64,
    /// Inverse of the mass that the pair moves: `1/m + sum w_i^2/m_i`.
    pub inverse_mass: f64,
    /// Gap (length).
    pub gap: f64,
    /// Velocity of the node against the closest point, half a step ago.
    pub velocity: [f64; 3],
    /// Time step that led to the positions of now.
    pub dt: f64,
}

impl Damper {
    /// A push along the unit vector `n` by a spring of force `spring`, not negative.
    #[inline(always)]
    pub fn of(&self, spring: f64, n: [f64; 3]) -> Damped {
        let v = self.velocity;
        let parting = v[2].mul_add(n[2], v[1].mul_add(n[1], v[0] * n[0]));
        let shallow = self.stiffness * (SHALLOW * self.gap);
        let limit = SHARE * if spring < shallow { spring } else { shallow };
        let rate = 2.0 * DAMPING * (self.stiffness / self.inverse_mass).sqrt();
        let drag = (rate * parting).max(-limit).min(limit);
        // Its own impulse slows the pair, so on the way it does the work of the mean.
        let mean = (-0.5 * self.dt * self.inverse_mass).mul_add(drag, parting);
        Damped { normal: spring - drag, taken: drag * mean * self.dt }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: [f64; 3] = [0.0, 0.0, 1.0];
    const PAIR: Damper =
        Damper { stiffness: 4.0, inverse_mass: 0.25, gap: 1.0, velocity: [0.0; 3], dt: 0.01 };

    fn moving(velocity: f64) -> Damper {
        Damper { velocity: [9.0, -9.0, velocity], ..PAIR }
    }

    #[test]
    fn it_acts_against_what_closes_and_parts_and_takes_the_work_of_both() {
        let spring = 4.0 * 1e-4;
        assert_eq!(PAIR.of(spring, UP), Damped { normal: spring, taken: 0.0 });
        let rate = 2.0 * DAMPING * 4.0;
        for parting in [-1e-5, 1e-5] {
            let damped = moving(parting).of(spring, UP);
            assert!((damped.normal - (spring - rate * parting)).abs() < 1e-18, "{damped:?}");
            let slowed = 1.0 - 0.5 * 0.01 * 0.25 * rate;
            assert!((damped.taken - rate * slowed * 1e-10 * 0.01).abs() < 1e-24, "{damped:?}");
        }
    }

    #[test]
    fn it_never_pulls_and_what_is_deep_it_hardly_damps() {
        for (spring, limit) in [(4e-4, SHARE * 4e-4), (1.0, SHARE * SHALLOW * 4.0)] {
            for (parting, normal) in [(1e3, spring - limit), (-1e3, spring + limit)] {
                let damped = moving(parting).of(spring, UP);
                assert_eq!(damped.normal, normal);
                let mean = 1e3 - 0.5 * 0.01 * 0.25 * limit;
                assert!((damped.taken - limit * mean * 0.01).abs() < 1e-15, "{damped:?}");
            }
        }
        assert_eq!(moving(1e3).of(0.0, UP), Damped::default());
    }
}
