//! `*ELEMENT_DISCRETE`, `*SECTION_DISCRETE`, and the materials of springs and dampers.

use super::{
    cards::Block,
    fields::{Context, Fields, TENS},
    problem::{Problem, Section},
};
use crate::{
    place::{Place, Placed},
    table::Range,
};

/// A spring or damper.
pub(super) struct Discrete {
    pub(super) id: u32,
    pub(super) part: u32,
    pub(super) nodes: [u32; 2],
    /// Factor on its forces.
    pub(super) scale: Placed<f64>,
    /// Elongation at the start.
    pub(super) offset: Placed<f64>,
    pub(super) at: Place,
}

/// `*MAT_SPRING_` or `*MAT_DAMPER_`.
pub(super) struct SpringCard {
    pub(super) at: Place,
    pub(super) law: SpringLaw,
}

pub(super) enum SpringLaw {
    Elastic {
        stiffness: f64,
    },
    Damper {
        damping: f64,
    },
    Plastic {
        stiffness: f64,
        tangent: Placed<f64>,
        yields: f64,
    },
    /// The curve of force by elongation.
    Curve(Placed<u32>),
    /// The curve of force by its rate.
    DamperCurve(Placed<u32>),
}

/// The names of its materials by their numbers.
const NAMES: [(&str, &str); 5] = [
    ("MAT_S01", "MAT_SPRING_ELASTIC"),
    ("MAT_S02", "MAT_DAMPER_VISCOUS"),
    ("MAT_S03", "MAT_SPRING_ELASTOPLASTIC"),
    ("MAT_S04", "MAT_SPRING_NONLINEAR_ELASTIC"),
    ("MAT_S05", "MAT_DAMPER_NONLINEAR_VISCOUS"),
];

/// Columns of `*ELEMENT_DISCRETE`.
const WIDTHS: [usize; 8] = [8, 8, 8, 8, 8, 16, 8, 16];

/// `*ELEMENT_DISCRETE`.
pub(super) fn read_elements(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
        let f = context.fields(card, block.width, &WIDTHS);
        let nodes = [f.id(2), f.id(3)];
        if let Some(end) = nodes.iter().position(|node| *node == 0) {
            f.fault(
                2 + end,
                "two nodes: no end of a spring is grounded without one",
                "give a node that *BOUNDARY_SPC holds, with a mass",
            );
            continue;
        }
        if f.id(4) != 0 {
            let expected = "VID 0: springs act along the line between their nodes";
            f.fault(4, expected, "leave VID blank");
        }
        let scale = match f.within(5, 1.0, Range::NotNegative) {
            0.0 => 1.0,
            scale => scale,
        };
        problem.discretes.push(Discrete {
            id: f.id(0),
            part: f.id(1),
            nodes,
            scale: f.placed(5, "S", scale),
            offset: f.placed(7, "OFFSET", f.real(7, 0.0)),
            at: card.at,
        });
    }
}

/// `*SECTION_DISCRETE`.
pub(super) fn read_sections(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let mut cards = block.cards.iter();
    while let Some(card) = cards.next() {
        let f = context.fields(card, block.width, &TENS);
        refuse(&f, 1, "DRO 0: springs and dampers of rotations are not computed", "leave DRO blank");
        for (i, name) in [(2, "KD"), (4, "CL"), (5, "FD")] {
            refuse(&f, i, &format!("{name} 0: the force has no such factor or limit"), "leave it blank");
        }
        if let Some(second) = cards.next() {
            let g = context.fields(second, block.width, &TENS);
            for (i, name) in [(0, "CDL"), (1, "TDL")] {
                refuse(&g, i, &format!("{name} 0: elongations have no limit"), "leave it blank");
            }
        }
        let id = problem.number("section", &f, context);
        problem.sections.insert(id, (card.at, Section::Discrete));
    }
}

fn refuse(f: &Fields<'_>, i: usize, expected: &str, advice: &str) {
    if f.real(i, 0.0) != 0.0 {
        f.fault(i, expected, advice);
    }
}

/// Whether a `*MAT_` is one of springs or dampers that is known.
pub(super) fn knows_material(word: &str) -> bool {
    NAMES.iter().any(|(number, name)| word == *number || word == *name)
}

/// The law of such a `*MAT_`; none after a fault.
pub(super) fn read_material(block: &Block<'_>, context: &Context<'_>) -> Option<SpringCard> {
    let word = NAMES.iter().find(|(number, _)| *number == block.keyword);
    let word = word.map_or(block.keyword.as_str(), |(_, name)| name);
    let card = block.card(0);
    let f = context.fields(card, block.width, &TENS);
    let curve = |i: usize, name: &'static str| {
        let curve = f.reference(i, name);
        if curve.value == 0 {
            f.fault(i, "the number of a curve of force", "give it");
            return None;
        }
        Some(curve)
    };
    let law = match word {
        "MAT_SPRING_ELASTIC" => {
            f.positive(1, "a stiffness").map(|stiffness| SpringLaw::Elastic { stiffness })
        }
        "MAT_DAMPER_VISCOUS" => {
            f.positive(1, "a damping constant").map(|damping| SpringLaw::Damper { damping })
        }
        "MAT_SPRING_ELASTOPLASTIC" => {
            let (stiffness, yields) = (f.positive(1, "a stiffness"), f.positive(3, "a yield force"));
            let tangent = f.placed(2, "KT", f.within(2, 0.0, Range::NotNegative));
            Some(SpringLaw::Plastic { stiffness: stiffness?, tangent, yields: yields? })
        }
        "MAT_SPRING_NONLINEAR_ELASTIC" => {
            let expected = "LCR 0: the force of a spring does not depend on its rate";
            refuse(&f, 2, expected, "leave it blank, and give a damper beside it");
            curve(1, "LCD").map(SpringLaw::Curve)
        }
        _ => curve(1, "LCDR").map(SpringLaw::DamperCurve),
    };
    law.map(|law| SpringCard { at: card.at, law })
}
