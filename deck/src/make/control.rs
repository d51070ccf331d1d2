//! Ends, time step, damping and sorts of a run.

use mechanics::{contact::Settings, setup::Control};

use crate::{fault::short, log::Log, typed};

/// Sort lag of a deck that gives none, in cycles; less where the plan interval is
/// shorter or the slack does not hold what nodes travel in so many. A long lag
/// spreads a sort over many cycles of the master's host.
const SORT_LAG: u32 = 8;
/// Plan interval of a deck that gives none (cycles).
const PLAN_INTERVAL: u32 = 50;

/// The control of a run, whose sort lag is looked at once contact is known.
pub(super) fn make(given: &typed::Control, log: &Log<'_>) -> Control {
    let plan_interval = given.plan_interval.unwrap_or(PLAN_INTERVAL);
    let sort_lag = given.sort_lag.unwrap_or(SORT_LAG.min(plan_interval - 1));
    if plan_interval <= sort_lag {
        log.fault(
            given.at,
            format!("plan_interval = {plan_interval} and sort_lag = {sort_lag}"),
            "a plan interval longer than the sort lag",
            "raise plan_interval or lower sort_lag",
        );
    }
    Control {
        end_time: given.end_time.unwrap_or(f64::MAX),
        end_cycle: given.end_cycle.unwrap_or(u64::MAX),
        safety_factor: given.safety_factor.unwrap_or(0.6666),
        growth: given.growth.unwrap_or(1.05),
        energy_error: given.energy_error.unwrap_or(0.5),
        time_step_floor: given.time_step_floor.unwrap_or(0.0),
        linear_viscosity: given.linear_viscosity.unwrap_or(0.2),
        quadratic_viscosity: given.quadratic_viscosity.unwrap_or(1.0),
        sort_lag,
        plan_interval,
    }
}

pub(super) fn sort_lag(given: &typed::Control, lag: u32, contact: Option<&Settings>, log: &Log<'_>) -> u32 {
    let Some(contact) = contact else { return lag };
    let longest = contact.longest_lag();
    if given.sort_lag.is_none() {
        return lag.min(longest.max(1));
    }
    if lag > longest.max(1) {
        log.fault(
            given.at,
            format!("sort_lag = {lag} and a slack of {} gaps", short(contact.slack / contact.gap)),
            format!(
                "at most {} cycles: nodes may travel a fifth of the gap in each, towards each other",
                longest.max(1)
            ),
            "lower sort_lag or raise slack_gaps",
        );
    }
    lag
}
