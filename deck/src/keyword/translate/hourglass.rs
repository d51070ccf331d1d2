//! `*HOURGLASS` and `*CONTROL_HOURGLASS`: IHQ becomes a kind of hourglass control, QM its coefficient.

use mechanics::element::{
    hourglass::{Hourglass, Kind},
    shell4::InPlane,
};

use super::{control::VISCOSITY, state::Translation};
use crate::{
    keyword::{material::Law, problem::Section},
    place::{Origin, Place, Placed},
};

/// LS-DYNA's coefficient where QM is blank.
const USUAL: f64 = 0.1;

/// Hourglass control of the parts that have none of their own: that of LS-DYNA, viscous, where the deck says nothing.
pub(super) fn of_deck(t: &Translation<'_>) -> Hourglass {
    let given = t.problem.control.hourglass;
    let parts = &t.problem.parts;
    if let Some((at, kind, coefficient)) = given
        && (kind > 3 || ![0.0, USUAL].contains(&coefficient))
        && t.names.keys().any(|part| parts[part].hourglass == 0 && is_of_thin_shells(t, *part))
    {
        t.log.warn(at, "shells have a hourglass control of their own, whatever IHQ and QH");
    }
    given.map_or(Hourglass::viscous(USUAL), |(at, kind, coefficient)| control(t, at, kind, coefficient))
}

/// Hourglass control of a part of solids that names one. Shells have their own.
pub(super) fn of_part(t: &Translation<'_>, part: u32) -> Option<Placed<Hourglass>> {
    let card = &t.problem.parts[&part];
    if card.hourglass != 0 && is_of_thin_shells(t, part) {
        let words = format!(
            "HGID {}: shells have a hourglass control of their own, whatever IHQ and QM",
            card.hourglass
        );
        t.log.warn(card.at, words);
    }
    let of_solids = matches!(t.problem.sections.get(&card.section.value), Some((_, Section::Solid { .. })));
    if card.hourglass == 0 || !of_solids {
        return None;
    }
    let Some(given) = t.problem.hourglasses.get(&card.hourglass) else {
        let id = card.hourglass;
        t.log.warn(card.at, format!("HGID {id}: no *HOURGLASS has this number, that of the deck serves"));
        return None;
    };
    let of_deck = t.problem.control.viscosity.map_or(VISCOSITY, |(_, viscosity)| viscosity);
    if given.viscosity.iter().zip(of_deck).any(|(own, of_deck)| *own != 0.0 && *own != of_deck) {
        let [[q1, q2], [quadratic, linear]] = [given.viscosity, of_deck];
        let words = format!("Q1 {q1}, Q2 {q2}: bulk viscosity is that of the deck, {quadratic} and {linear}");
        t.log.warn(given.at, words);
    }
    let mut control = control(t, given.at, given.kind, given.coefficient);
    let material = t.problem.materials.get(&card.material.value);
    if control.is_elastic() && material.is_some_and(|material| matches!(material.law, Law::Null { .. })) {
        control = Hourglass::viscous(USUAL);
        let mid = card.material.value;
        let words = format!(
            "IHQ {}: material {mid} has no shear stiffness, control is viscous with {USUAL}",
            given.kind
        );
        t.log.warn(given.at, words);
    }
    Some(Placed::new(control, Origin::card(given.at)))
}

/// Whether a part is of shells with one point in the plane, which alone need control.
fn is_of_thin_shells(t: &Translation<'_>, part: u32) -> bool {
    let section = t.problem.sections.get(&t.problem.parts[&part].section.value);
    matches!(section, Some((_, Section::Shell(shell))) if shell.in_plane == InPlane::One)
}

fn control(t: &Translation<'_>, at: Place, ihq: i64, coefficient: f64) -> Hourglass {
    let kind = match ihq {
        0..=3 => Kind::Viscous,
        4 | 5 => Kind::Stiffness,
        6 => Kind::AssumedStrain,
        7 | 9 | 10 => {
            t.log.warn(at, format!("IHQ {ihq}: hourglass control is that of IHQ 6, by assumed strains"));
            Kind::AssumedStrain
        }
        _ => {
            t.log.warn(at, format!("IHQ {ihq}: hourglass control is viscous, as with IHQ 1"));
            Kind::Viscous
        }
    };
    let asked = if coefficient == 0.0 { USUAL } else { coefficient };
    let most = if kind == Kind::Viscous { f64::MAX } else { 1.0 };
    let taken = if asked > 0.0 { asked.min(most) } else { USUAL };
    if taken != asked {
        t.log.warn(at, format!("QM {asked}: the coefficient of hourglass control is {taken}"));
    }
    Hourglass { kind, coefficient: taken }
}
