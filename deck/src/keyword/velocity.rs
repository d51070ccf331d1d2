//! `*INITIAL_VELOCITY`, `_NODE`, `_GENERATION`: with what nodes start.

use super::{
    cards::Block,
    condition::Target,
    fields::{Context, Fields, TENS},
};
use crate::{geometry, place::Place};

/// An initial velocity: a translation and a rotation about an axis.
pub(super) struct Velocity {
    pub(super) at: Place,
    pub(super) target: Target,
    /// Set of nodes that are left out, and the box that bounds the others; 0 is none.
    pub(super) except: u32,
    pub(super) inside: u32,
    pub(super) velocity: [f64; 3],
    /// Angular velocity, and a point of its axis.
    pub(super) spin: [f64; 3],
    pub(super) point: [f64; 3],
    /// Coordinate system of both vectors; 0 is the global one.
    pub(super) system: u32,
    /// Rotations about itself of each node, as shells can.
    pub(super) own_turn: [f64; 3],
    /// Which starts of `*PART_INERTIA` it goes over.
    pub(super) over: Over,
    /// Whether parts that are one body with those it names, and nodes that go with them, have it too.
    pub(super) of_body: bool,
}

/// Bodies whose start on `*PART_INERTIA` an initial velocity goes over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Over {
    None,
    All,
    /// All with their centres in the box of the card, where it has one.
    InBox,
    /// Those of a set of parts, with their centres in the box.
    Parts(u32),
    /// Those that the card names.
    Named,
}

/// What IRIGID in field `i` of `*INITIAL_VELOCITY` goes over.
fn over(f: &Fields<'_>, i: usize) -> Over {
    match f.integer(i) {
        0 => Over::None,
        -1 => Over::InBox,
        -2 => Over::All,
        1.. => Over::Parts(f.id(i)),
        _ => {
            f.fault(i, "IRIGID 0, -1, -2 or the number of a set of parts", "correct it");
            Over::None
        }
    }
}

impl Velocity {
    /// `*INITIAL_VELOCITY_NODE`.
    pub(super) fn of_node(f: &Fields<'_>) -> Self {
        Self {
            at: f.at,
            target: Target::Node(f.id(0)),
            except: 0,
            inside: 0,
            velocity: f.vector(1),
            spin: [0.0; 3],
            point: [0.0; 3],
            system: f.id(7),
            own_turn: f.vector(4),
            over: Over::None,
            of_body: false,
        }
    }
}

/// `*INITIAL_VELOCITY`: a set, and perhaps another for those it leaves out.
pub(super) fn read(list: &mut Vec<Velocity>, block: &Block<'_>, context: &Context<'_>) {
    let cards = [block.card(0), block.card(1), block.card(2)];
    let [f, g, h] = [0, 1, 2].map(|i| context.fields(cards[i], block.width, &TENS));
    let base = |target, except, inside, velocity, own_turn| Velocity {
        at: f.at,
        target,
        except,
        inside,
        velocity,
        spin: [0.0; 3],
        point: [0.0; 3],
        system: f.id(4),
        own_turn,
        over: Over::None,
        of_body: false,
    };
    let target = if f.id(0) == 0 { Target::All } else { Target::NodeSet(f.id(0)) };
    let first = base(target, f.id(1), f.id(2), g.vector(0), g.vector(3));
    list.push(Velocity { over: over(&f, 3), ..first });
    if f.id(1) != 0 && !h.all_blank() {
        list.push(base(Target::NodeSet(f.id(1)), 0, 0, h.vector(0), h.vector(3)));
    }
}

/// `*INITIAL_VELOCITY_GENERATION`: two cards each.
pub(super) fn read_generation(list: &mut Vec<Velocity>, block: &Block<'_>, context: &Context<'_>) {
    let n = block.cards.len().div_ceil(2);
    for i in 0..n {
        let cards = [block.card(2 * i), block.card(2 * i + 1)];
        let [f, g] = [0, 1].map(|i| context.fields(cards[i], block.width, &TENS));
        let id = f.id(0);
        let target = match f.integer(1) {
            _ if id == 0 => Target::All,
            1 => Target::PartSet(id),
            2 => Target::Part(id),
            3 => Target::NodeSet(id),
            _ => {
                f.fault(1, "STYP 1, 2 or 3", "name a set of parts, a part, or a set of nodes");
                continue;
            }
        };
        if g.integer(6) != 0 {
            g.fault(6, "PHASE 0", "start with the velocity");
        }
        let omega = f.real(2, 0.0);
        let axis = g.vector(3);
        let mut spin = [0.0; 3];
        if omega != 0.0 {
            if axis[0] == -999.0 {
                g.fault(3, "an axis by its direction", "give NX, NY, NZ instead of nodes");
            }
            match geometry::unit(axis) {
                Some(axis) => spin = axis.map(|c| omega * c),
                None => g.fault(3, "an axis of some length", "give NX, NY, NZ"),
            }
        }
        list.push(Velocity {
            at: f.at,
            target,
            except: 0,
            inside: 0,
            velocity: f.vector(3),
            spin,
            point: g.vector(0),
            system: f.id(7),
            own_turn: [0.0; 3],
            over: if g.integer(7) == 0 { Over::None } else { Over::Named },
            of_body: f.integer(6) != 0,
        });
    }
}
