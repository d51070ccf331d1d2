//! Whether what a worker says are numbers, and of parts that there are.

use super::Vote;

/// What of a vote is no number, or of a part beyond `n_parts`; a sentence's end. A run that has blown up says so by the forces of its
/// vote.
pub fn not_a_number(vote: &Vote, n_parts: usize) -> Option<String> {
    let pairs = vote
        .contact_energies
        .pairs()
        .iter()
        .chain(vote.released.iter().flat_map(|released| released.pairs()));
    if let Some(pair) =
        pairs.map(|pair| pair.parts).find(|parts| parts.iter().any(|&part| part as usize >= n_parts))
    {
        return Some(format!("parts {pair:?} in contact in its vote, of {n_parts} parts"));
    }
    if !vote.force_bound.is_finite() && !vote.force_bound.is_nan() {
        return None;
    }
    if vote.bodies.iter().any(|body| !body.is_finite()) {
        return Some("the state of a rigid body in its vote is no number".to_owned());
    }
    let held =
        vote.joints.iter().flat_map(|joint| joint.force.into_iter().chain(joint.moment).chain([joint.apart]));
    if !held.into_iter().all(f64::is_finite) {
        return Some("the force of a joint in its vote is no number".to_owned());
    }
    let energies = vote.parts.iter().flat_map(|p| [p.kinetic, p.internal, p.hourglass, p.viscosity]);
    let momentum = vote.parts.iter().flat_map(|p| p.momentum);
    let numbers = energies.chain(momentum).chain(vote.momentum).chain([
        vote.contact,
        vote.friction,
        vote.external.whole(),
    ]);
    let released = vote.released.iter().flat_map(|released| released.pairs()).map(|pair| pair.contact);
    let held = vote.walls.iter().flat_map(|wall| [wall.work.whole(), wall.loss.whole()]);
    let numbers = numbers.chain(released).chain(held);
    let seen = vote.contacts.iter().flat_map(|(_, contact)| contact.force);
    let passed = vote.sections.iter().flat_map(|(_, s)| s.force.into_iter().chain(s.moment).chain(s.places));
    let mut numbers = numbers
        .chain(passed)
        .chain(seen.chain(vote.element_gauges.iter().flat_map(|(_, state)| state.iter().copied())))
        .chain([vote.force_bound, vote.contact_speed_squared, vote.strike]);
    let bad = numbers.find(|v| !v.is_finite());
    if let Some(value) = bad.or(Some(vote.courant).filter(|courant| courant.is_nan())) {
        return Some(format!("an energy, momentum, force or limit of its vote is {value}, must be finite"));
    }
    None
}
