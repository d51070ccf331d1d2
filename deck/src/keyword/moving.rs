//! `*LOAD_MOVING_PRESSURE`: the pressure of a jet that a nozzle throws on segments, by the distance from its axis.

use super::{
    cards::Block,
    condition::Pressed,
    fields::{Context, TENS},
};
use crate::place::{Place, Placed};

/// A nozzle and what it presses.
pub(super) struct Nozzle {
    pub(super) at: Place,
    /// The nodes at its origin and at its head.
    pub(super) nodes: [Placed<u32>; 2],
    /// Curve of pressure over the distance from the axis.
    pub(super) profile: u32,
    /// Curve of its share over time; 0 is 1 all along.
    pub(super) curve: u32,
    pub(super) radius: f64,
    pub(super) pressed: Pressed,
    /// Points of integration along each side of a segment; none where the card says none.
    pub(super) points: Option<u32>,
}

/// Reads the cards: the number of the load, the nozzle, and what is pressed.
pub(super) fn read(nozzles: &mut Vec<Nozzle>, block: &Block<'_>, context: &Context<'_>) {
    // The number of the load stands on the first.
    block.leave(1);
    let cards = [1, 2].map(|i| block.card(i));
    let [f, g] = [0, 1].map(|i| context.fields(cards[i], block.width, &TENS));
    if let Some(more) = block.cards.iter().skip(3).find(|card| !card.text.trim().is_empty()) {
        let expected = "one nozzle and what it presses, on three cards";
        context.fields(more, block.width, &TENS).fault(0, expected, "write the keyword once for each nozzle");
    }
    if f.integer(5) != 0 {
        f.fault(5, "no share by the distance from the nozzle", "leave LCIDD blank");
    }
    if f.integer(6) != 0 {
        f.fault(6, "IDIR 0: the pressure acts along the normals of the segments", "leave it blank");
    }
    if f.integer(7) != 0 {
        f.fault(7, "LSFLG 0: segments cast no shadow", "leave it blank, and name the segments in sight");
    }
    let pressed = match (g.integer(1), g.id(0)) {
        (0, id) => Pressed::Segments(id),
        (1, id) => Pressed::Shells(id),
        (2, id) => Pressed::PartSet(id),
        (3, id) => Pressed::Part(id),
        _ => {
            g.fault(1, "IDT 0, 1, 2 or 3: segments, shells, parts or a part", "choose one of them");
            return;
        }
    };
    let points = match g.integer(2) {
        0 => None,
        n @ (1 | 4 | 9 | 16 | 25) => (1..=5).find(|side: &u32| i64::from(side * side) == n),
        _ => {
            g.fault(2, "NIP 1, 4, 9, 16 or 25: points by rows", "choose one of them");
            None
        }
    };
    let Some(radius) = f.positive(3, "an outer radius of the jet") else { return };
    nozzles.push(Nozzle {
        at: f.at,
        nodes: [f.reference(0, "NODE1"), f.reference(1, "NODE2")],
        profile: f.id(2),
        curve: f.id(4),
        radius,
        pressed,
        points,
    });
}
