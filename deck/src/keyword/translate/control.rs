//! Title, units, ends, time step and damping.

use super::state::Translation;
use crate::{keyword::unit, limits::MAX_TITLE, place::Place, typed::Control, units::SETS};

/// Safety factor that stands for LS-DYNA's default factor on the time step.
const SAFETY: f64 = 0.6666;
/// That default.
const STEP_FACTOR: f64 = 0.9;
/// Bulk viscosity of LS-DYNA, quadratic and linear.
pub(super) const VISCOSITY: [f64; 2] = [1.5, 0.06];

/// Adds them to the deck.
pub(super) fn write(t: &mut Translation<'_>, units: Option<&str>) {
    let (problem, log) = (t.problem, t.log);
    let start = Place::card(0, 1);
    let title = problem.title.clone().unwrap_or_else(|| "keyword deck".to_string());
    let plain = |c: char| if matches!(c, '"' | '\\') || c.is_control() { ' ' } else { c };
    let title: String = title.chars().take(MAX_TITLE).map(plain).collect();
    t.deck.title = title.trim().to_string();
    let used = |id: &u32| t.names.keys().any(|part| problem.parts[part].material.value == *id);
    let materials = problem.materials.iter().filter(|(id, _)| used(id)).map(|(_, material)| material);
    let name = unit::choose(units, problem.units.as_ref(), materials, log);
    t.deck.units = SETS.into_iter().find(|set| set.name == name).unwrap_or(SETS[0]);
    let given = &problem.control;
    let Some((at, end)) = given.end_time else {
        log.fault(start, "a deck without an end time", "*CONTROL_TERMINATION with ENDTIM", "add it");
        return;
    };
    let [quadratic, linear] = given.viscosity.map_or(VISCOSITY, |(_, viscosity)| viscosity);
    t.deck.control = Some(Control {
        end_time: Some(end),
        end_cycle: given.end_cycle,
        safety_factor: given.step_factor.map(|(_, factor)| (SAFETY * factor / STEP_FACTOR).min(1.0)),
        // Theirs enters as it is, ours squared.
        quadratic_viscosity: Some(quadratic.sqrt()),
        linear_viscosity: Some(linear),
        hourglass: Some(super::hourglass::of_deck(t)),
        ..Control::new(at)
    });
}
