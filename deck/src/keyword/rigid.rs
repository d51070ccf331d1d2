//! Rigid bodies by keyword: which parts become rigid or belong together, how bodies begin and how they are moved.

use std::collections::BTreeMap;

use super::{
    cards::Block,
    condition::{AXES_OF_CODE, Target},
    fields::{Context, Fields, TENS},
    inertia::Inertia,
    prescribed::{Driven, Way, motions},
};
use crate::{place::Place, table::Range};

/// Parts by number, or by the number of their set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Members {
    Part(u32),
    Set(u32),
}

/// Parts that are rigid from the start, or that join a rigid one.
pub(super) struct Joined {
    pub(super) at: Place,
    pub(super) members: Members,
    /// The part whose body they join; 0 is none.
    pub(super) lead: u32,
    /// Whether their materials are those of bodies that deform.
    pub(super) switched: bool,
}

/// Parts that become rigid at a time, and parts that deform from then on.
pub(super) struct SwitchCard {
    pub(super) time: f64,
    /// Each with the part whose body it joins; 0 is none.
    pub(super) to_rigid: Vec<(Place, Members, u32)>,
    pub(super) to_deformable: Vec<(Place, Members)>,
}

/// A motion of a body by curve.
pub(super) struct BodyMotion {
    pub(super) at: Place,
    pub(super) part: u32,
    pub(super) way: Way,
    pub(super) how: Driven,
}

/// The nodes of a rigid body without parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum BodyNodes {
    Set(u32),
    /// Those of a spot weld.
    Pair([u32; 2]),
}

/// A rigid body of nodes.
pub(super) struct NodalBody {
    pub(super) at: Place,
    /// 0 of a spot weld, which nothing moves.
    pub(super) id: u32,
    pub(super) nodes: BodyNodes,
    /// Translations, then rotations that are held, by axis.
    pub(super) held: [[bool; 3]; 2],
}

/// Nodes that go with a rigid part.
pub(super) struct ExtraNodes {
    pub(super) at: Place,
    pub(super) part: u32,
    pub(super) target: Target,
}

/// How a body begins.
pub(super) struct BodyStart {
    pub(super) at: Place,
    pub(super) part: u32,
    pub(super) velocity: [f64; 3],
    pub(super) spin: [f64; 3],
    /// Coordinate system of both; 0 is the global one.
    pub(super) system: u32,
}

/// All that a deck says of rigid bodies beside their materials, in its order.
#[derive(Default)]
pub(super) struct RigidCards {
    pub(super) joined: Vec<Joined>,
    pub(super) switches: Vec<SwitchCard>,
    pub(super) motions: Vec<BodyMotion>,
    pub(super) starts: Vec<BodyStart>,
    pub(super) of_nodes: Vec<NodalBody>,
    pub(super) extra: Vec<ExtraNodes>,
    /// Of parts by number.
    pub(super) inertias: BTreeMap<u32, Inertia>,
}

impl RigidCards {
    /// Whether a keyword is read here.
    pub(super) fn knows(word: &str) -> bool {
        matches!(
            word,
            "DEFORMABLE_TO_RIGID"
                | "DEFORMABLE_TO_RIGID_AUTOMATIC"
                | "DEFORMABLE_TO_RIGID_INERTIA"
                | "CONSTRAINED_RIGID_BODIES"
                | "CONSTRAINED_RIGID_BODIES_SET"
                | "BOUNDARY_PRESCRIBED_MOTION_RIGID"
                | "BOUNDARY_PRESCRIBED_MOTION_RIGID_ID"
                | "INITIAL_VELOCITY_RIGID_BODY"
                | "CONSTRAINED_NODAL_RIGID_BODY"
                | "CONSTRAINED_NODAL_RIGID_BODY_SPC"
                | "CONSTRAINED_NODAL_RIGID_BODY_INERTIA"
                | "CONSTRAINED_SPOTWELD"
                | "CONSTRAINED_SPOTWELD_ID"
                | "CONSTRAINED_EXTRA_NODES_NODE"
                | "CONSTRAINED_EXTRA_NODES_SET"
        )
    }

    pub(super) fn read(
        &mut self,
        block: &mut Block<'_>,
        vectors: &BTreeMap<u32, [f64; 3]>,
        context: &Context<'_>,
    ) {
        let named = block.take("_ID");
        match block.keyword.as_str() {
            "DEFORMABLE_TO_RIGID_AUTOMATIC" => self.switches.extend(switch(block, context)),
            "DEFORMABLE_TO_RIGID_INERTIA" => context.log.fault(
                block.at,
                "*DEFORMABLE_TO_RIGID_INERTIA",
                "mass and inertia of the elements",
                "take it out, or convert the deck and give mass, centre and inertia in [[rigid]]",
            ),
            "CONSTRAINED_NODAL_RIGID_BODY_INERTIA" => context.log.fault(
                block.at,
                "*CONSTRAINED_NODAL_RIGID_BODY_INERTIA",
                "mass and inertia of the nodes",
                "take _INERTIA and its cards out, and put mass at the nodes by *ELEMENT_MASS",
            ),
            "BOUNDARY_PRESCRIBED_MOTION_RIGID" => motions(block, named, vectors, context, |f, way, how| {
                self.motions.push(BodyMotion { at: f.at, part: f.id(0), way, how });
            }),
            word => {
                let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
                while let Some(mut card) = cards.next() {
                    if named && word == "CONSTRAINED_SPOTWELD" {
                        // The number of the weld.
                        card.mark();
                        card = cards.next().unwrap_or(card);
                    }
                    let f = context.fields(card, block.width, &TENS);
                    self.line(word, &f);
                    if word.ends_with("_BODY_SPC") {
                        let held = cards.next().map(|card| {
                            let g = context.fields(card, block.width, &TENS);
                            if g.real(0, 0.0) != 1.0 && g.real(0, 0.0) != 0.0 {
                                g.fault(0, "CMO 1: directions of the axes", "give CON1 and CON2 along them");
                            }
                            [1, 2].map(|i| code_of(&g, i))
                        });
                        self.of_nodes
                            .iter_mut()
                            .rev()
                            .take(1)
                            .for_each(|body| body.held = held.unwrap_or_default());
                    }
                }
            }
        }
    }

    fn line(&mut self, word: &str, f: &Fields<'_>) {
        let at = f.at;
        match word {
            "DEFORMABLE_TO_RIGID" => {
                let Some(members) = members_of(f, 2) else { return };
                self.joined.push(Joined { at, members, lead: f.id(1), switched: true });
            }
            "CONSTRAINED_RIGID_BODIES" | "CONSTRAINED_RIGID_BODIES_SET" => {
                let members =
                    if word.ends_with("_SET") { Members::Set(f.id(1)) } else { Members::Part(f.id(1)) };
                if f.id(0) == 0 {
                    f.fault(0, "the part that leads", "give its number");
                }
                self.joined.push(Joined { at, members, lead: f.id(0), switched: false });
            }
            "INITIAL_VELOCITY_RIGID_BODY" => self.starts.push(BodyStart {
                at,
                part: f.id(0),
                velocity: f.vector(1),
                spin: f.vector(4),
                system: f.id(7),
            }),
            "CONSTRAINED_SPOTWELD" => {
                let fails = [(2, "SN"), (3, "SS"), (6, "TF"), (7, "EP")];
                for (i, name) in fails.into_iter().filter(|(i, _)| (1e-30..1e19).contains(&f.real(*i, 0.0))) {
                    f.fault(i, format!("{name} blank: spot welds do not fail here"), "leave it blank");
                }
                let nodes = BodyNodes::Pair([f.id(0), f.id(1)]);
                self.of_nodes.push(NodalBody { at, id: 0, nodes, held: Default::default() });
            }
            "CONSTRAINED_EXTRA_NODES_NODE" | "CONSTRAINED_EXTRA_NODES_SET" => {
                let target =
                    if word.ends_with("_SET") { Target::NodeSet(f.id(1)) } else { Target::Node(f.id(1)) };
                self.extra.push(ExtraNodes { at, part: f.id(0), target });
            }
            _ => {
                for i in [5, 6].into_iter().filter(|i| f.integer(*i) != 0) {
                    f.fault(
                        i,
                        "a body that holds all of its nodes in every direction",
                        "leave DRFLAG and RRFLAG blank",
                    );
                }
                let nodes = BodyNodes::Set(f.id(2));
                self.of_nodes.push(NodalBody { at, id: f.id(0), nodes, held: Default::default() });
            }
        }
    }
}

/// Parts by number, or a set of them where field `kind` says so.
fn members_of(f: &Fields<'_>, kind: usize) -> Option<Members> {
    match f.words(kind).to_ascii_uppercase().as_str() {
        "" | "PART" => Some(Members::Part(f.id(0))),
        "PSET" => Some(Members::Set(f.id(0))),
        _ => {
            f.fault(kind, "PTYPE PART or PSET", "name a part or a set of parts");
            None
        }
    }
}

/// A set of automatic switches.
fn switch(block: &Block<'_>, context: &Context<'_>) -> Option<SwitchCard> {
    let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
    let (Some(first), Some(second)) = (cards.next(), cards.next()) else {
        context.log.fault(
            block.at,
            "*DEFORMABLE_TO_RIGID_AUTOMATIC with less than two cards",
            "when parts switch, and how many",
            "complete it",
        );
        return None;
    };
    let f = context.fields(first, block.width, &TENS);
    if f.integer(1) != 0 {
        f.fault(1, "CODE 0: a switch at TIME1", "give CODE 0 and the time");
    }
    for i in [6, 7].into_iter().filter(|i| f.integer(*i) != 0) {
        f.fault(i, "no related switch set", "leave RELSW and PAIRED blank, and give each switch its time");
    }
    let time = f.within(2, 0.0, Range::NotNegative);
    let g = context.fields(second, block.width, &TENS);
    for i in (0..3).filter(|i| g.integer(*i) != 0) {
        g.fault(i, "0: nodal rigid bodies, constraints and walls stay", "leave NRBF, NCSF and RWF blank");
    }
    if g.real(3, 0.0) != 0.0 {
        context
            .log
            .warn(g.place(3), "DTMAX is not used: elements limit the time step after a switch as before");
    }
    let counts = [4, 5].map(|i| usize::try_from(g.integer(i)).unwrap_or_default());
    let cards: Vec<_> = cards.collect();
    if cards.len() != counts[0] + counts[1] {
        g.fault(
            4,
            format!("the number of cards behind this one, {}, as the sum of D2R and R2D", cards.len()),
            "correct D2R, R2D or the cards",
        );
        return None;
    }
    let (rigid, deformable) = cards.split_at(counts[0]);
    let to_rigid = rigid.iter().filter_map(|card| {
        let f = context.fields(card, block.width, &TENS);
        Some((f.at, members_of(&f, 2)?, f.id(1)))
    });
    let to_deformable = deformable.iter().filter_map(|card| {
        let f = context.fields(card, block.width, &TENS);
        Some((f.at, members_of(&f, 1)?))
    });
    Some(SwitchCard { time, to_rigid: to_rigid.collect(), to_deformable: to_deformable.collect() })
}

/// Axes that a code from 0 to 7 holds.
fn code_of(f: &Fields<'_>, i: usize) -> [bool; 3] {
    let code = usize::try_from(f.integer(i)).ok().and_then(|code| AXES_OF_CODE.get(code).copied());
    code.unwrap_or_else(|| {
        f.fault(i, "a code from 0 to 7 of what is held", "correct it");
        [false; 3]
    })
}
