//! `*BOUNDARY_PRESCRIBED_MOTION_` of nodes and rigid bodies: what moves by a curve.

use std::collections::BTreeMap;

use mechanics::load::Span;

use super::{
    cards::Block,
    condition::{Target, next_card, scale, span_of},
    fields::{Context, Fields, TENS},
};
use crate::place::Place;

/// How a curve is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    Velocity,
    Acceleration,
    Displacement,
    /// Of something that is no time.
    Profile,
}

impl Meaning {
    /// VAD, in field `i`; another is reported.
    pub(super) fn read(f: &Fields<'_>, i: usize) -> Option<Self> {
        match f.integer(i) {
            0 => Some(Self::Velocity),
            1 => Some(Self::Acceleration),
            2 => Some(Self::Displacement),
            _ => {
                f.fault(i, "VAD 0, 1 or 2", "give a velocity, an acceleration or a displacement by time");
                None
            }
        }
    }
}

/// What a motion goes along or about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    Along(usize),
    /// Of a body, about its centre; of a node of shells, about itself.
    Turn(usize),
    /// A circle about an axis through a point.
    About(usize, [f64; 3]),
}

/// A motion by curve.
pub(super) struct Motion {
    pub(super) at: Place,
    pub(super) target: Target,
    pub(super) way: Way,
    pub(super) how: Driven,
}

/// How a motion follows its curve, and when.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Driven {
    pub(super) meaning: Meaning,
    pub(super) curve: u32,
    pub(super) factor: f64,
    pub(super) span: Span,
}

/// Whether a second card belongs to a motion, with offsets or nodes.
fn goes_on(f: &Fields<'_>) -> bool {
    (9..=11).contains(&f.integer(1).unsigned_abs()) || f.integer(2) == 4
}

/// The motions of a `*BOUNDARY_PRESCRIBED_MOTION_`: the first card of each, and what it says.
pub(super) fn motions<'c>(
    block: &'c Block<'_>,
    named: bool,
    vectors: &BTreeMap<u32, [f64; 3]>,
    context: &'c Context<'_>,
    mut take: impl FnMut(&Fields<'_>, Way, Driven),
) {
    let mut cards = block.cards.iter();
    while let Some(card) = next_card(&mut cards, named) {
        let f = context.fields(card, block.width, &TENS);
        let second = if goes_on(&f) { cards.next() } else { None };
        let offsets = second.map_or([0.0; 2], |card| {
            let g = context.fields(card, block.width, &TENS);
            [g.real(0, 0.0), g.real(1, 0.0)]
        });
        let way = way_of(&f, offsets, vectors);
        let meaning = Meaning::read(&f, 2);
        let span = span_of(&f, 7, 6);
        if span.from > 0.0 {
            context.log.warn(f.at, "BIRTH: the curve is read at the time of the run, not from BIRTH on");
        }
        let (Some((way, sign)), Some(meaning)) = (way, meaning) else { continue };
        take(&f, way, Driven { meaning, curve: f.id(3), factor: sign * scale(&f, 4), span });
    }
}

/// What DOF says, and the sign of the motion; none after a fault.
fn way_of(
    f: &Fields<'_>,
    [first, second]: [f64; 2],
    vectors: &BTreeMap<u32, [f64; 3]>,
) -> Option<(Way, f64)> {
    match f.integer(1) {
        dof @ 1..=3 => Some((Way::Along(dof as usize - 1), 1.0)),
        dof @ 5..=7 => Some((Way::Turn(dof as usize - 5), 1.0)),
        dof @ (4 | 8) => {
            let Some(vector) = vectors.get(&f.id(5)).copied() else {
                f.fault(5, "the number of a *DEFINE_VECTOR", "define it, or give DOF 1 to 3 or 5 to 7");
                return None;
            };
            let Some(axis) = (0..3).find(|a| vector[*a].abs() > 1.0 - 1e-9) else {
                f.fault(5, "a vector along x, y or z", "turn the mesh so that motions are along the axes");
                return None;
            };
            Some((if dof == 4 { Way::Along(axis) } else { Way::Turn(axis) }, vector[axis].signum()))
        }
        9 => Some((Way::About(0, [0.0, first, second]), 1.0)),
        10 => Some((Way::About(1, [second, 0.0, first]), 1.0)),
        11 => Some((Way::About(2, [first, second, 0.0]), 1.0)),
        _ => {
            let expected = "DOF 1 to 3 along x, y or z, 5 to 7 about them, 4 or 8 along or about a vector, 9 to 11 on circles";
            f.fault(1, expected, "give components along or about the global axes");
            None
        }
    }
}
