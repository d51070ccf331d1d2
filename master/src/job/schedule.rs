//! The schedule of a run: which time step each cycle has, when states are due, and the cycle at whose start all stop.
//!
//! Time steps come from the votes of whole cycles: [`allowed`] is the largest one that a vote permits.

use std::collections::BTreeMap;

use mechanics::{
    exact::{ENERGY_BITS, FORCE_BITS, MOMENTUM_BITS, Quanta, Quantum},
    rigid::{State, shape::courant},
    setup::{Control, Setup},
    vote::Vote,
    wall::{Motion, Pose},
};

use super::{checkpoints::Checkpoint, error::Error, foresight::Window, problem::Problem};
use crate::event::Limit;

/// Share of the gap that contact votes for per cycle; the lag may not take it past 20 %.
const TRAVEL_VOTE: f64 = 0.16;
/// Share of the gap that prescribed motions may travel in a cycle: the step that they have it in is ordered now, so no lag adds to it.
const TRAVEL_PRESCRIBED: f64 = 0.19;
/// What squeezes an element as it strikes a wall shortens and stiffens it before a vote can tell: the limit to come is divided by 1 and
/// this many times the speed over that of sound. Concrete at 0.15 needs 4.2.
const SQUEEZE: f64 = 5.0;
/// Share of its volume that an element which strikes a wall may lose in a step, as votes on the rate of volume have it.
const STRIKE_VOLUME: f64 = 0.1;
/// Angle by which a rigid body may turn in a step: bodies of nodes alone have no element that would limit it.
const TURN: f64 = 0.1;
/// A step grows where its limits are longer than it by this factor. Limits follow the strains of elements, so a step that followed every
/// rise of theirs would breathe with a body's vibration, two cycles late, and pump what nothing damps: shells.
const ROOM_TO_GROW: f64 = 1.01;
/// Share of the allowed time step that a run begins with where bodies hold energy or are tied. Where a gas meets a thinner one, the
/// first steps raise velocities from nothing, and viscosity with them, before a vote can tell.
const START: f64 = 0.2;
/// Whole numbers below it have a next one (`2^53`).
const WHOLE: f64 = 9_007_199_254_740_992.0;
/// Cycles whose steps are remembered.
const REMEMBERED: usize = 4;

/// One cycle's step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// Time step (time).
    pub(super) dt: f64,
    /// Time at its start.
    pub(super) time: f64,
    /// Quanta of its sums.
    pub(super) quanta: Quanta,
}

/// The step after one that is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Next {
    pub(super) dt: f64,
    pub(super) limit: Limit,
    /// When it begins (time).
    pub(super) time: f64,
    /// When it ends (time).
    pub(super) time_after: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stop {
    /// At the start of this cycle.
    at: u64,
    /// For the next epoch, not for the end.
    pauses: bool,
    /// Samples come with it.
    sampled: bool,
}

/// The schedule of one epoch.
pub(super) struct Schedule {
    first_cycle: u64,
    /// The last complete cycle plus one.
    completed: u64,
    /// By cycle; a few cycles around the present.
    steps: BTreeMap<u64, Step>,
    /// Quanta of the sums from the cycle after the last ordered one on.
    quanta: Quanta,
    /// Between two states for the user (time); none without.
    period: Option<f64>,
    /// When the next one is due (time).
    next_state: Option<f64>,
    stop: Option<Stop>,
}

impl Schedule {
    /// Of an epoch that begins at a checkpoint, with states for the user every `period`.
    pub(super) fn new(checkpoint: &Checkpoint, period: Option<f64>) -> Self {
        let Checkpoint { state, continuation } = checkpoint;
        let (first, time) = (state.cycle, state.time);
        let mut steps = BTreeMap::new();
        if let Some(dt) = continuation.dt {
            let [now, _] = continuation.quanta;
            if let Some(before) = first.checked_sub(1) {
                let dt = continuation.dt_previous;
                steps.insert(before, Step { dt, time: time - dt, quanta: now });
            }
            steps.insert(first, Step { dt, time, quanta: now });
        }
        Self {
            first_cycle: first,
            completed: first,
            steps,
            quanta: continuation.quanta[1],
            period,
            next_state: period.map(|period| output_after(time, period)),
            stop: None,
        }
    }

    /// The cycle that the epoch begins with.
    pub(super) fn first_cycle(&self) -> u64 {
        self.first_cycle
    }

    /// The last complete cycle plus one.
    pub(super) fn completed(&self) -> u64 {
        self.completed
    }

    /// No frame of `cycle` or before will come any more.
    pub(super) fn complete(&mut self, cycle: u64) {
        self.completed = cycle + 1;
    }

    /// The step of a cycle that was ordered, of late.
    pub(super) fn step(&self, cycle: u64) -> Option<Step> {
        self.steps.get(&cycle).copied()
    }

    /// The same.
    ///
    /// # Errors
    /// If the cycle was not ordered.
    pub(super) fn ordered(&self, cycle: u64) -> Result<Step, Error> {
        self.step(cycle).ok_or(Error::NotOrdered(cycle))
    }

    /// Quanta of the sums from the cycle after the last ordered one on.
    pub(super) fn quanta(&self) -> Quanta {
        self.quanta
    }

    /// The step of the first cycle: the checkpoint's; at the start of a run a part of `allowed`, up to the end of the run.
    pub(super) fn first_step(
        &mut self,
        time: f64,
        control: &Control,
        allowed: impl FnOnce() -> Result<f64, Error>,
    ) -> Result<Step, Error> {
        if let Some(step) = self.step(self.first_cycle) {
            return Ok(step);
        }
        let dt = allowed()?.min(control.end_time - time).max(0.0);
        let step = Step { dt, time, quanta: self.quanta };
        self.steps.insert(self.first_cycle, step);
        Ok(step)
    }

    /// Orders the step after `now`, at most as long as a limit allows, and to the end of the run where that is near.
    pub(super) fn order_after(
        &mut self,
        cycle: u64,
        now: Step,
        (dt, limit): (f64, Limit),
        control: &Control,
    ) -> Next {
        let time = now.time + now.dt;
        let remaining = (control.end_time - time).max(0.0);
        let (dt, limit) = if remaining < dt * 1.000_000_1 { (remaining, Limit::End) } else { (dt, limit) };
        let time_after = if limit == Limit::End { control.end_time } else { time + dt };
        self.steps.insert(cycle + 1, Step { dt, time, quanta: self.quanta });
        while self.steps.len() > REMEMBERED {
            self.steps.pop_first();
        }
        Next { dt, limit, time, time_after }
    }

    /// Forces, energies and momenta nearing the bound of exact sums ask for coarser quanta, of a run whose nodes have this `mass` together.
    ///
    /// # Errors
    /// If forces are past it.
    pub(super) fn rescale(&mut self, vote: &Vote, mass: f64) -> Result<(), Error> {
        let quantum = self.quanta.force;
        if vote.force_bound > quantum.term_bound() || !vote.force_bound.is_finite() {
            return Err(Error::Force { bound: vote.force_bound, quantum });
        }
        if vote.force_bound > quantum.rescale_bound() {
            self.quanta.force = Quantum::for_reference(vote.force_bound, FORCE_BITS);
        }
        let energy = vote.energies();
        // By Cauchy and Schwarz no sum of `m |v|` is more.
        let momentum = (2.0 * mass * energy).sqrt();
        for (quantum, sum, bits) in [
            (&mut self.quanta.energy, energy, ENERGY_BITS),
            (&mut self.quanta.momentum, momentum, MOMENTUM_BITS),
        ] {
            // What no quantum holds is wrong, and found so where it is judged.
            if sum > quantum.sum_bound()
                && let Some(coarser) = Quantum::if_normal(sum, bits)
            {
                *quantum = coarser;
            }
        }
        Ok(())
    }

    /// Whether a state is due for the user by a time; it counts as written then.
    pub(super) fn state_due(&mut self, time: f64) -> bool {
        let (Some(due), Some(period)) = (self.next_state, self.period) else { return false };
        if time < due {
            return false;
        }
        self.next_state = Some(output_after(time, period));
        true
    }

    /// All stop at the start of a cycle, unless that was said before: for the next epoch (`pauses`), or for the end.
    pub(super) fn stop_at(&mut self, cycle: u64, pauses: bool) {
        self.stop.get_or_insert(Stop { at: cycle, pauses, sampled: false });
    }

    /// Samples come with the stop.
    pub(super) fn sample_stop(&mut self) {
        if let Some(stop) = &mut self.stop {
            stop.sampled = true;
        }
    }

    /// Whether a stop is ordered.
    pub(super) fn is_stopping(&self) -> bool {
        self.stop.is_some()
    }

    /// Whether all stop at the start of a cycle.
    pub(super) fn stops_at(&self, cycle: u64) -> bool {
        self.stop.is_some_and(|stop| stop.at == cycle)
    }

    /// Whether the stop is for the next epoch.
    pub(super) fn pauses(&self) -> bool {
        self.stop.is_some_and(|stop| stop.pauses)
    }

    /// Whether samples come with the stop.
    pub(super) fn stop_is_sampled(&self) -> bool {
        self.stop.is_some_and(|stop| stop.sampled)
    }
}

/// The first multiple of `period` after `time`, to the bit: at whatever time it is asked between two of them, it is the
/// same one. Of a period below the last digit of `time` it is the next number after it: each cycle has a state.
pub(super) fn output_after(time: f64, period: f64) -> f64 {
    let mut count = (time / period).floor();
    if count >= WHOLE {
        return time.next_up();
    }
    while count * period > time {
        count -= 1.0;
    }
    while count * period <= time {
        count += 1.0;
    }
    count * period
}

/// Share of the time step that `vote`, of the time before the first cycle, allows. It knows nothing of ties, whose springs bear less.
pub(super) fn first_share(problem: &Problem, vote: &Vote) -> f64 {
    let tied = problem.model.setup.contact.as_ref().is_some_and(|contact| !contact.ties.is_empty());
    if tied || vote.parts.iter().any(|part| part.internal > 0.0) { START } else { 1.0 }
}

/// The longest step of the first cycle that rigid bodies bear which may begin in contact: that of their elements. Whatever deforms asks for
/// about as much by itself; the limit of contact comes with the vote of that cycle.
pub(super) fn rigid_limit(problem: &Problem) -> f64 {
    let (mesh, setup) = (&problem.model.mesh, &problem.model.setup);
    if setup.contact.is_none() {
        return f64::INFINITY;
    }
    let mut parts: Vec<u32> = setup.bodies.iter().flat_map(|body| &body.parts).copied().collect();
    parts.sort_unstable();
    courant(mesh, &setup.materials, &parts)
        .map_or(f64::INFINITY, |(limit, _)| setup.control.safety_factor * limit)
}

/// The step after `before`, what limits it, and the element if one does; `known` is the length of the step of the vote, the one before
/// that. Its middle is counted from the end of it, a time that a checkpoint has to the bit.
pub(super) fn step_after(
    problem: &Problem,
    walls: &[Pose],
    vote: &Vote,
    (known, before): (Option<f64>, Step),
) -> (f64, Limit, Option<u32>) {
    let grown = problem.model.setup.control.growth * before.dt;
    let window = Window {
        known: known.map(|dt| [before.time - dt, dt]),
        from: before.time + before.dt,
        longest: grown,
    };
    let (allowed, limit, element) = allowed(problem, walls, vote, window);
    let before = before.dt;
    if before < allowed && allowed < ROOM_TO_GROW * before {
        (before, limit, element)
    } else if grown < allowed {
        (grown, Limit::Growth, None)
    } else {
        (allowed, limit, element)
    }
}

/// The step that a vote allows, what limits it, and the element if one does.
pub(super) fn allowed(
    problem: &Problem,
    walls: &[Pose],
    vote: &Vote,
    window: Window,
) -> (f64, Limit, Option<u32>) {
    let setup = &problem.model.setup;
    let mut best = (f64::INFINITY, Limit::Growth, None);
    let mut offer = |dt: f64, limit: Limit, element: Option<u32>| {
        if dt < best.0 {
            best = (dt, limit, element);
        }
        best.0
    };
    offer(setup.control.safety_factor * vote.courant, Limit::Courant, Some(vote.courant_element));
    offer(vote.volume_limit, Limit::Volume, None);
    offer(strike_limit(&setup.control, vote), Limit::Strike, None);
    offer(turn_limit(&vote.bodies), Limit::Turn, None);
    let mut longest = offer(vote.contact_limit, Limit::Contact, None);
    if let (Some(contact), Some(touching)) = (&setup.contact, &problem.touching) {
        // A wall may bring a node to its own speed within a cycle.
        let speed = vote.contact_speed_ahead.max(wall_speed(setup, walls));
        if speed > 0.0 {
            longest = offer(TRAVEL_VOTE * contact.gap / speed, Limit::Travel, None);
        }
        let window = Window { longest: longest.min(window.longest), ..window };
        let ahead = vote.contact_speed_ahead;
        match touching.foresight.speed(&setup.loads.curves, window, ahead) {
            Some(speed) if speed > 0.0 => {
                offer(TRAVEL_PRESCRIBED * contact.gap / speed, Limit::Travel, None);
            }
            _ => {}
        }
    }
    best
}

/// The step that elements bear which strike a rigid wall: their outer corners stop at once, and the quadratic viscosity comes as a jump
/// before a vote can tell. The element of the Courant limit is taken to strike, with only its linear viscosity so far.
fn strike_limit(control: &Control, vote: &Vote) -> f64 {
    if vote.strike == 0.0 {
        return f64::INFINITY;
    }
    // What viscosity makes of the time that sound takes through the element, see `element::viscosity`.
    let slower = |q: f64| q + q.mul_add(q, 1.0).sqrt();
    let linear = control.linear_viscosity;
    let crossing = vote.courant * slower(linear);
    let quadratic = control.quadratic_viscosity * control.quadratic_viscosity * vote.strike;
    let squeezed = SQUEEZE.mul_add(vote.strike, 1.0);
    (crossing / slower(linear + quadratic) / squeezed).min(STRIKE_VOLUME * crossing / vote.strike)
}

/// The step in which the fastest of some rigid bodies turns by [`TURN`]; infinite where none turns.
fn turn_limit(bodies: &[State]) -> f64 {
    let squared = |body: &State| body.spin.iter().map(|w| w * w).sum::<f64>();
    TURN / bodies.iter().map(squared).fold(0.0, f64::max).sqrt()
}

/// The greatest speed of a wall: that prescribed at any time, or that of now.
fn wall_speed(setup: &Setup, walls: &[Pose]) -> f64 {
    let driven = setup.walls.iter().filter_map(|wall| match wall.motion {
        Motion::Driven(velocity) => Some(velocity.map(|v| v.greatest(&setup.loads.curves))),
        _ => None,
    });
    let free = walls.iter().map(|[_, velocity]| *velocity);
    driven.chain(free).map(|v| v.iter().map(|c| c * c).sum::<f64>().sqrt()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::{super::tests::job, *};

    /// Of a run that has not begun.
    fn schedule(period: Option<f64>) -> Schedule {
        let (job, _) = job(1);
        Schedule::new(job.checkpoints.newest(), period)
    }

    fn control() -> Control {
        job(1).0.problem.model.setup.control
    }

    #[test]
    fn a_strike_below_seven_hundredths_of_the_speed_of_sound_limits_no_step_at_default_settings() {
        let control = control();
        let limit_of = |control: &Control, strike| {
            strike_limit(control, &Vote { courant: 1.0, strike, ..Vote::empty(1) })
        };
        let limit = |strike| limit_of(&control, strike);
        assert!(limit(0.07) > control.safety_factor && limit(0.1) < control.safety_factor);
        assert!(limit(0.0) == f64::INFINITY, "nothing strikes");
        // Sound takes 1.2198039 of the limit through the element; the viscosity at ten times its speed is 10.2.
        assert!((limit(10.0) - 1.219_803_9 / 20.448_902 / 51.0).abs() < 1e-8, "{}", limit(10.0));
        // Without viscosity the volume limits it.
        let plain = Control { linear_viscosity: 0.0, quadratic_viscosity: 0.0, ..control };
        assert!((limit_of(&plain, 10.0) - 0.01).abs() < 1e-15);
    }

    #[test]
    fn an_output_time_is_the_same_multiple_whenever_it_is_asked_for() {
        for time in [0.0, 0.05, 0.09999999999999999] {
            assert_eq!(output_after(time, 0.1).to_bits(), 0.1_f64.to_bits(), "{time}");
        }
        assert_eq!(output_after(0.1, 0.1).to_bits(), 0.2_f64.to_bits(), "after, not at");
        for period in [1e-20, 1e-30, f64::MIN_POSITIVE] {
            assert_eq!(output_after(0.1, period), 0.1_f64.next_up(), "{period}");
        }
    }

    #[test]
    fn states_are_due_once_for_each_period_that_a_step_crosses() {
        let mut schedule = schedule(Some(1.0));
        assert!(!schedule.state_due(0.5));
        assert!(schedule.state_due(1.0) && !schedule.state_due(1.9));
        assert!(schedule.state_due(3.5) && !schedule.state_due(3.9), "one for several periods in one step");
    }

    #[test]
    fn steps_follow_each_other_without_a_gap_and_the_last_one_ends_at_the_end() {
        let (mut schedule, control) = (schedule(None), Control { end_time: 1.0, ..control() });
        let mut now = schedule.first_step(0.0, &control, || Ok(0.4)).expect("an allowed step");
        let mut times = vec![now.time];
        for cycle in 0..3 {
            let next = schedule.order_after(cycle, now, (0.4, Limit::Courant), &control);
            now = schedule.ordered(cycle + 1).expect("just ordered");
            assert_eq!((now.time, now.dt), (next.time, next.dt));
            times.push(now.time);
        }
        assert_eq!(times, [0.0, 0.4, 0.8, 1.0]);
        assert_eq!(now.dt, 0.0, "nothing is left");
        assert!(schedule.step(0).is_some() && schedule.ordered(9) == Err(Error::NotOrdered(9)));
        schedule.order_after(3, now, (0.4, Limit::Courant), &control);
        assert!(schedule.step(0).is_none() && schedule.step(1).is_some(), "four are remembered");
    }

    #[test]
    fn the_first_stop_that_was_ordered_stands() {
        let mut schedule = schedule(None);
        schedule.sample_stop();
        assert!(!schedule.is_stopping() && !schedule.stop_is_sampled());
        schedule.stop_at(20, true);
        schedule.stop_at(21, false);
        assert!(schedule.stops_at(20) && !schedule.stops_at(21) && schedule.pauses());
        schedule.sample_stop();
        assert!(schedule.stop_is_sampled());
    }

    #[test]
    fn forces_near_the_bound_of_exact_sums_coarsen_the_quantum_and_those_past_it_end_the_run() {
        let mut schedule = schedule(None);
        let before = schedule.quanta().force;
        let vote = |force_bound| Vote { force_bound, ..Vote::empty(1) };
        schedule.rescale(&vote(before.rescale_bound()), 1.0).expect("not above");
        assert_eq!(schedule.quanta().force, before);
        schedule.rescale(&vote(1.01 * before.rescale_bound()), 1.0).expect("below the bound");
        assert!(schedule.quanta().force.value() > before.value());
        let past = vote(2.0 * schedule.quanta().force.term_bound());
        assert!(matches!(schedule.rescale(&past, 1.0), Err(Error::Force { .. })));
    }

    #[test]
    fn energies_and_momenta_near_the_bound_of_exact_sums_coarsen_their_quanta() {
        let mut schedule = schedule(None);
        let before = schedule.quanta();
        let vote = |kinetic: f64| {
            let mut vote = Vote::empty(2);
            (vote.parts[0].kinetic, vote.parts[1].kinetic) = (0.5 * kinetic, 0.5 * kinetic);
            vote
        };
        // Of so little mass that momenta stay far below.
        let most = before.energy.sum_bound();
        schedule.rescale(&vote(most), f64::MIN_POSITIVE).expect("not above");
        assert_eq!(schedule.quanta(), before);
        schedule.rescale(&vote(1.01 * most), f64::MIN_POSITIVE).expect("below the bound");
        let coarser = Quantum::for_reference(1.01 * most, ENERGY_BITS);
        assert_eq!(schedule.quanta(), Quanta { energy: coarser, ..before });
        // `m |v|` is at most the root of twice mass and energy.
        let (energy, most) = (0.5 * most, before.momentum.sum_bound());
        let mass = 1.01 * most * most / (2.0 * energy);
        schedule.rescale(&vote(energy), mass).expect("below the bound");
        assert!(schedule.quanta().momentum.value() > before.momentum.value());
        // A flipped bit may say anything.
        let before = schedule.quanta();
        for absurd in [1e300, f64::INFINITY, f64::NAN] {
            schedule.rescale(&vote(absurd), f64::MIN_POSITIVE).expect("no force");
            assert_eq!(schedule.quanta().energy, before.energy, "{absurd}");
        }
    }
}
