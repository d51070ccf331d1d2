//! How fast prescribed motions will be: what the time step knows of jumps before a vote can tell.
//!
//! Votes foresee speeds by the forces of their cycle. A node or rigid body whose velocity is prescribed needs no force to become fast,
//! so the master looks ahead in the curves: it knows when the step that it orders begins, and that it ends within the longest one
//! that other limits allow. A motion that keeps its speed, or gains less than contact has room for, changes no step.

use mechanics::{
    constraint::Circle,
    contact::Surface,
    load::{Curve, Drive},
    mesh::Mesh,
    setup::Setup,
    state::GlobalState,
};

/// What moves as prescribed: the surface nodes of one constraint, or a rigid body.
#[derive(Clone, Debug, PartialEq)]
struct Mover {
    /// Velocity by axis (length per time).
    velocity: Vec<(usize, Drive)>,
    /// Turns (radians per time), each with the longest arm from its axis (length).
    turns: Vec<(Drive, f64)>,
    /// It may have begun after the vote was taken, though its motion was prescribed then.
    begins_later: bool,
}

/// The prescribed motions of a problem with contact.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Foresight {
    movers: Vec<Mover>,
}

/// The step whose speeds are wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    /// The step of the newest vote, its start and its length (time); none before the first step.
    pub(super) known: Option<[f64; 2]>,
    /// Start of the step (time).
    pub(super) from: f64,
    /// The longest that the step can be (time).
    pub(super) longest: f64,
}

impl Foresight {
    /// Of a problem whose walls are bound, as it starts: `surface` has the nodes that contact watches. Where elements erode any node may
    /// come to the surface.
    pub(super) fn of(mesh: &Mesh, setup: &Setup, start: &GlobalState, surface: &Surface) -> Self {
        // Of the constraints of watched nodes the longest arm.
        let mut circle_arm: Vec<Option<f64>> = vec![None; setup.constraints.len()];
        let mut watch = |node: usize| {
            let constraint = usize::from(start.constraint[node]);
            let arm =
                setup.constraints[constraint].circle.map_or(0.0, |circle| radius(&circle, start.x[node]));
            let longest = &mut circle_arm[constraint];
            *longest = Some(longest.map_or(arm, |other| other.max(arm)));
        };
        if setup.erosion.is_on() {
            (0..start.x.len()).for_each(&mut watch);
        } else {
            surface.nodes.iter().for_each(|&node| watch(node as usize));
        }
        let of_nodes = setup.constraints.iter().zip(circle_arm).filter_map(|(held, arm)| {
            let arm = arm?;
            Some(Mover::of(&held.velocity, held.circle.map(|circle| (circle.rate, arm)).into_iter()))
        });
        let of_bodies = setup.bodies.iter().map(|body| {
            let reach = body.places.iter().map(|place| length(*place)).fold(0.0, f64::max);
            let circle = body.circle.map(|circle| (circle.rate, radius(&circle, body.start.centre) + reach));
            Mover::of(&body.velocity, body.spin.iter().flatten().map(|&rate| (rate, reach)).chain(circle))
        });
        let mut movers: Vec<Mover> = Vec::new();
        let of_switches = setup.switches.iter().map(|switch| {
            let reach = switch.reach(mesh);
            let turns = switch.spin.iter().flatten().map(|&rate| (rate, reach));
            Mover { begins_later: true, ..Mover::of(&switch.velocity, turns) }
        });
        for mover in of_nodes.chain(of_bodies).chain(of_switches) {
            if mover.moves() && !movers.contains(&mover) {
                movers.push(mover);
            }
        }
        Self { movers }
    }

    /// The greatest speed that a prescribed motion can have in a step, where none of the nodes that the newest vote knows will be faster
    /// than `ahead`; none where no motion is prescribed.
    pub(super) fn speed(&self, curves: &[Curve], window: Window, ahead: f64) -> Option<f64> {
        self.movers.iter().map(|mover| mover.speed(curves, window, ahead)).reduce(f64::max)
    }
}

impl Mover {
    /// Motions that are none at any time are left out.
    fn of(velocity: &[Option<Drive>; 3], turns: impl Iterator<Item = (Drive, f64)>) -> Self {
        let velocity = velocity.iter().enumerate().filter_map(|(axis, drive)| Some((axis, (*drive)?)));
        Self {
            velocity: velocity.filter(|(_, drive)| drive.factor != 0.0).collect(),
            turns: turns.filter(|(rate, arm)| rate.factor * arm != 0.0).collect(),
            begins_later: false,
        }
    }

    fn moves(&self) -> bool {
        !self.velocity.is_empty() || !self.turns.is_empty()
    }

    /// Two bounds hold. What is not prescribed stays below `ahead`, so no node is faster than both together. And a motion that was
    /// prescribed when the vote was taken adds to `ahead` no more than it changes by.
    fn speed(&self, curves: &[Curve], window: Window, ahead: f64) -> f64 {
        let until = window.from + window.longest;
        let (mut own, mut change) = ([0.0; 3], [0.0; 3]);
        let (mut own_turn, mut turn_change) = (0.0, 0.0);
        let of = |drive: &Drive| {
            let [low, high] = drive.range(curves, window.from, until).unwrap_or_default();
            let known = window.known.filter(|_| !self.begins_later);
            let known = known.and_then(|[start, dt]| drive.prescribed_for(curves, start, dt));
            let change = known.map_or(f64::INFINITY, |known| (high - known).abs().max((low - known).abs()));
            (low.abs().max(high.abs()), change)
        };
        for (axis, drive) in &self.velocity {
            (own[*axis], change[*axis]) = of(drive);
        }
        for (rate, arm) in &self.turns {
            let (speed, change) = of(rate);
            own_turn += speed * arm;
            turn_change += change * arm;
        }
        let own = length(own) + own_turn;
        match window.known {
            None => ahead.max(own),
            Some(_) => (ahead + length(change) + turn_change).min(length([ahead, own, 0.0])),
        }
    }
}

/// From the axis of a circle to a place (length).
fn radius(circle: &Circle, x: [f64; 3]) -> f64 {
    let mut arm: [f64; 3] = std::array::from_fn(|a| x[a] - circle.point[a]);
    arm[usize::from(circle.axis)] = 0.0;
    length(arm)
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use mechanics::load::Span;

    use super::*;

    fn along(drive: Drive) -> Foresight {
        Foresight { movers: vec![Mover::of(&[None, Some(drive), None], std::iter::empty())] }
    }

    #[test]
    fn a_jump_is_foreseen_by_the_step_that_reaches_it_and_by_none_before() {
        // Rests until 1, then moves at 5 for a while.
        let curves = [Curve { points: vec![[1.0, 0.0], [1.000_001, 5.0], [2.0, 5.0], [2.000_001, 0.0]] }];
        let foresight = along(Drive::along(0, 1.0));
        // The step of the vote is a short one around a time.
        let speed = |known: f64, from: f64, ahead: f64| {
            foresight
                .speed(&curves, Window { known: Some([known - 0.01, 0.02]), from, longest: 0.1 }, ahead)
                .expect("a motion")
        };
        assert_eq!(speed(0.7, 0.8, 0.3), 0.3, "nothing changes by 0.9");
        assert_eq!(speed(0.85, 0.95, 0.0), 5.0);
        assert_eq!(speed(0.85, 0.95, 12.0), 13.0, "across a motion that is not prescribed");
        assert_eq!(speed(1.4, 1.5, 5.0), 5.0, "a steady speed is that of the vote");
        assert_eq!(speed(2.05, 2.1, 0.25), 0.25);
        assert_eq!(
            Foresight::default().speed(&[], Window { known: None, from: 0.0, longest: 1.0 }, 1.0),
            None
        );
    }

    #[test]
    fn a_motion_that_begins_in_a_span_is_foreseen_though_nobody_knows_how_fast_its_node_is_before() {
        let drive = Drive { span: Span { from: 1.0, until: 2.0 }, ..Drive::constant(3.0) };
        let speed = |known: Option<f64>, from| {
            let known = known.map(|known| [known - 0.01, 0.02]);
            along(drive).speed(&[], Window { known, from, longest: 0.1 }, 4.0).expect("a motion")
        };
        assert_eq!(speed(Some(0.8), 0.85), 4.0, "not yet");
        assert_eq!(speed(Some(0.8), 0.95), 5.0, "3 along and up to 4 across");
        assert_eq!(speed(Some(1.2), 1.3), 4.0);
        let at_once = along(Drive::constant(6.0));
        assert_eq!(at_once.speed(&[], Window { known: None, from: 0.0, longest: 1.0 }, 0.0), Some(6.0));
    }

    #[test]
    fn turns_count_with_their_arms() {
        let curves = [Curve { points: vec![[0.0, 0.0], [1.0, 2.0]] }];
        let turn = Mover::of(&[None; 3], [(Drive::along(0, 1.0), 3.0)].into_iter());
        let foresight = Foresight { movers: vec![turn] };
        let window = Window { known: Some([0.375, 0.25]), from: 0.5, longest: 0.25 };
        assert_eq!(foresight.speed(&curves, window, 3.0), Some(4.5), "1.5 more than 3");
        assert_eq!(foresight.speed(&curves, window, 0.0), Some(1.5), "a vote may know less than the curve");
    }
}
