//! `*PART_INERTIA`: mass, centre, inertia and start of a rigid part, which its elements would give otherwise.

use super::{
    cards::Block,
    fields::{Context, TENS},
    problem::{PartCard, Problem},
    property,
};
use crate::place::Place;

/// Cards of a part.
const CARDS: usize = 5;

/// What the cards say of a rigid part.
pub(super) struct Inertia {
    pub(super) at: Place,
    pub(super) mass: f64,
    /// Centre of mass, or the node there.
    pub(super) centre: Centre,
    /// About the centre: xx, yy, zz, xy, yz, zx, products negative as in a tensor.
    pub(super) inertia: [f64; 6],
    /// Velocity of the centre and angular velocity.
    pub(super) start: [[f64; 3]; 2],
}

/// Mass of a body; its centre, and its inertia about it.
type MassAndInertia = (f64, ([f64; 3], [f64; 6]));

/// Where the centre of mass is.
#[derive(Clone, Copy)]
pub(super) enum Centre {
    Point([f64; 3]),
    Node(u32),
}

/// Reads `*PART_INERTIA`: a heading and five cards each.
pub(super) fn read(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for first in (0..block.cards.len()).step_by(CARDS) {
        let cards: [_; CARDS] = std::array::from_fn(|i| block.card(first + i));
        if block.cards.len() < first + 2 {
            let (at, log) = (cards[0].at, context.log);
            return log.fault(
                at,
                log.quote(&cards[0].text),
                "a card with the part's numbers",
                "complete the part",
            );
        }
        let f = context.fields(cards[1], block.width, &TENS);
        let g = context.fields(cards[2], block.width, &TENS);
        let tensor = context.fields(cards[3], block.width, &TENS);
        let moves = context.fields(cards[4], block.width, &TENS);
        property::read_part(problem, cards[0], &f, context);
        if g.integer(4) != 0 {
            g.fault(4, "IRCS 0: an inertia along the global axes", "turn the inertia into them");
        }
        let components: [f64; 6] = std::array::from_fn(|i| tensor.real(i, 0.0));
        let [xx, xy, xz, yy, yz, zz] = components;
        for (i, value) in [(0, xx), (3, yy), (5, zz)] {
            if value <= 0.0 {
                tensor.fault(i, "a moment of inertia above 0", "give one");
            }
        }
        let centre = match g.id(5) {
            0 => Centre::Point(g.vector(0)),
            node => Centre::Node(node),
        };
        let Some(mass) = g.positive(3, "a mass") else { continue };
        problem.rigid.inertias.insert(
            f.id(0),
            Inertia {
                at: f.at,
                mass,
                centre,
                inertia: [xx, yy, zz, xy, yz, xz],
                start: [moves.vector(0), moves.vector(3)],
            },
        );
    }
}

impl Problem {
    /// The centre of mass that a card gives; none where it names a node that the deck does not have.
    pub(super) fn centre_of(&self, given: &Inertia) -> Option<[f64; 3]> {
        match given.centre {
            Centre::Point(point) => Some(point),
            Centre::Node(id) => self.position(id),
        }
    }

    /// Mass, centre and inertia of the body of these parts, where cards give it; a fault is reported.
    pub(super) fn inertia_of(&self, parts: &[u32], log: &crate::log::Log<'_>) -> Option<MassAndInertia> {
        let given = parts.iter().find_map(|part| self.rigid.inertias.get(part))?;
        if parts.len() > 1 {
            let read = format!("*PART_INERTIA of one of {} parts of a body", parts.len());
            log.fault(
                given.at,
                read,
                "a body of this part alone",
                "write *PART, or convert the deck and give mass, centre and inertia of the whole body in [[rigid]]",
            );
            return None;
        }
        let centre = self.centre_of(given);
        if centre.is_none() {
            log.fault(
                given.at,
                "NODEID of *PART_INERTIA",
                "a node of the deck",
                "correct it, or give XC, YC, ZC",
            );
        }
        Some((given.mass, (centre?, given.inertia)))
    }

    /// Reports inertias of parts that are not rigid: theirs are those of their elements.
    pub(super) fn check_inertias(&self, is_rigid: impl Fn(u32) -> bool, log: &crate::log::Log<'_>) {
        for (id, given) in self.rigid.inertias.iter().filter(|(id, _)| !is_rigid(**id)) {
            let card: &PartCard = &self.parts[id];
            log.fault(
                given.at,
                format!("*PART_INERTIA of part {id} {:?}, which deforms or has no elements", card.title),
                "a part of *MAT_RIGID with elements",
                "write *PART: mass and inertia of other parts are those of their elements",
            );
        }
    }
}
