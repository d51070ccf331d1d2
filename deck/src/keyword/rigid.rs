//! Rigid bodies by keyword: which parts become rigid or belong together, how bodies begin and how they are moved.

use std::collections::BTreeMap;

use super::{
    cards::Block,
    condition::{AXES_OF_CODE, Driven, Target, Way, motions},
    fields::{Context, Fields, TENS},
    inertia::Inertia,
};
use crate::place::Place;

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
            "DEFORMABLE_TO_RIGID_AUTOMATIC" => context.log.fault(
                block.at,
                "*DEFORMABLE_TO_RIGID_AUTOMATIC",
                "parts that are rigid all along or never",
                "take it out, or make them rigid from the start by *DEFORMABLE_TO_RIGID",
            ),
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
                if named && word == "CONSTRAINED_SPOTWELD" {
                    // The number of the weld.
                    cards.next();
                }
                while let Some(card) = cards.next() {
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
                let members = match f.words(2).to_ascii_uppercase().as_str() {
                    "" | "PART" => Members::Part(f.id(0)),
                    "PSET" => Members::Set(f.id(0)),
                    _ => return f.fault(2, "PTYPE PART or PSET", "name a part or a set of parts"),
                };
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

/// Axes that a code from 0 to 7 holds.
fn code_of(f: &Fields<'_>, i: usize) -> [bool; 3] {
    let code = usize::try_from(f.integer(i)).ok().and_then(|code| AXES_OF_CODE.get(code).copied());
    code.unwrap_or_else(|| {
        f.fault(i, "a code from 0 to 7 of what is held", "correct it");
        [false; 3]
    })
}
