//! `*NODE` and `*ELEMENT_`.

use super::{
    cards::Block,
    fields::{Context, EIGHTS, TENS},
    problem::{Beam, Node, Problem, Shell, Solid},
};
use crate::table::Range;

/// `*NODE`.
pub(super) fn read_nodes(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    problem.nodes.reserve(block.cards.len());
    for card in &block.cards {
        let f = context.fields(card, block.width, &[8, 16, 16, 16, 8, 8]);
        if f.all_blank() {
            continue;
        }
        let id = f.id(0);
        if id == 0 {
            f.fault(0, "a node number above 0", "give the node a number");
            continue;
        }
        let held = [4, 5].map(|i| match f.integer(i) {
            code @ 0..=7 => code as u8,
            _ => {
                f.fault(i, "a code from 0 to 7 of what is held", "correct it, or use *BOUNDARY_SPC_NODE");
                0
            }
        });
        let next = problem.nodes.len() as u32;
        if let Some(first) = problem.node_index.insert(id, next) {
            let node = &problem.nodes[first as usize];
            if node.x != f.vector(1) {
                let line = context.log.line(node.at, card.at);
                let expected = format!("a number other than {id}, which {line} has with another place");
                f.fault(0, expected, "renumber one");
            }
            problem.node_index.insert(id, first);
            continue;
        }
        problem.nodes.push(Node { id, x: f.vector(1), held, at: card.at });
    }
}

/// `*ELEMENT_SOLID`, on one line or on two; with ten nodes on the second a tetrahedron with nodes on its edges.
pub(super) fn read_solids(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
    problem.solids.reserve(block.cards.len());
    while let Some(card) = cards.next() {
        let f = context.fields(card, block.width, &EIGHTS);
        let (id, part) = (f.id(0), f.id(1));
        // Of the form of two cards the first may have zeros behind the part.
        let (nodes, first) = if (2..10).all(|i| f.blank(i) || f.words(i) == "0") {
            let Some(second) = cards.next() else {
                f.fault(0, "a second card with eight nodes", "complete the element");
                return;
            };
            (context.fields(second, block.width, &EIGHTS), 0)
        } else {
            (f, 2)
        };
        if first == 0 && (nodes.integer(8) != 0 || nodes.integer(9) != 0) {
            let all: [u32; 10] = std::array::from_fn(|i| nodes.id(i));
            if all.contains(&0) {
                nodes.fault(8, "eight nodes, or ten of a tetrahedron", "complete the element");
                continue;
            }
            let [a, b, c, d, edges @ ..] = all;
            problem.solids.push(Solid {
                id,
                part,
                nodes: [a, b, c, d, d, d, d, d],
                edges: Some(edges),
                at: card.at,
            });
            continue;
        }
        let mut corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| nodes.id(first + i));
        if corners[5] != 0 && corners[6..] == [0, 0] {
            let expected = "the fifth and the sixth node of a wedge twice each";
            nodes.fault(first + 6, expected, "write N1, N2, N3, N4, N5, N5, N6, N6");
            continue;
        }
        // Tetrahedra and pyramids may leave the last fields blank.
        for i in 1..8 {
            if corners[i] == 0 {
                corners[i] = corners[i - 1];
            }
        }
        problem.solids.push(Solid { id, part, nodes: corners, edges: None, at: card.at });
    }
}

/// `*ELEMENT_SHELL`, with a card of thicknesses where the keyword says so.
pub(super) fn read_shells(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>, thick: bool) {
    let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
    while let Some(card) = cards.next() {
        let f = context.fields(card, block.width, &EIGHTS);
        let mut nodes = [2, 3, 4, 5].map(|i| f.id(i));
        if nodes[3] == 0 {
            nodes[3] = nodes[2];
        }
        if (6..10).any(|i| f.integer(i) != 0) {
            f.fault(6, "at most four nodes", "mesh with four-node shells");
            continue;
        }
        let mut corners = [0.0; 4];
        if thick {
            let Some(second) = cards.next() else {
                f.fault(0, "a second card with the thicknesses", "complete the element");
                return;
            };
            let g = context.fields(second, block.width, &[16; 5]);
            corners = [0, 1, 2, 3].map(|i| g.within(i, 0.0, Range::NotNegative));
            if g.real(4, 0.0) != 0.0 {
                g.fault(4, "BETA 0: the angle of the material is that of its section", "leave it blank");
            }
        }
        problem.shells.push(Shell { id: f.id(0), part: f.id(1), nodes, corners, at: card.at });
    }
}

/// `*ELEMENT_BEAM`, with a card of a direction where the keyword says so; third node and releases mean nothing to a truss.
pub(super) fn read_beams(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>, oriented: bool) {
    let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
    while let Some(card) = cards.next() {
        let f = context.fields(card, block.width, &EIGHTS);
        let released = (5..9).find(|&i| f.integer(i) != 0).map(|i| f.reference(i, "release").origin);
        let mut across = None;
        if oriented {
            let Some(second) = cards.next() else {
                f.fault(0, "a second card with the direction", "complete the element");
                return;
            };
            across = Some(context.fields(second, block.width, &TENS).vector(0));
        }
        problem.beams.push(Beam {
            id: f.id(0),
            part: f.id(1),
            nodes: [f.id(2), f.id(3)],
            third: f.id(4),
            across,
            released,
            at: card.at,
        });
    }
}
