//! Rigid bodies by keyword: which parts become rigid or belong together, how bodies begin and how they are moved.

use super::{
    cards::Block,
    condition::{Meaning, all_along, goes_on, scale},
    fields::{Context, Fields, TENS},
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

/// A motion of a body by curve: along an axis, or about it.
pub(super) struct BodyMotion {
    pub(super) at: Place,
    pub(super) part: u32,
    pub(super) axis: usize,
    pub(super) turns: bool,
    pub(super) meaning: Meaning,
    pub(super) curve: u32,
    pub(super) factor: f64,
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
        )
    }

    pub(super) fn read(&mut self, block: &mut Block<'_>, context: &Context<'_>) {
        if block.take("_ID") {
            // A card with a number and a heading stands before each.
            let mut n = 0;
            block.cards.retain(|_| {
                n += 1;
                n % 2 == 0
            });
        }
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
            word => {
                let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
                while let Some(card) = cards.next() {
                    let f = context.fields(card, block.width, &TENS);
                    self.line(word, &f);
                    if word.starts_with("BOUNDARY_PRESCRIBED") && goes_on(&f) {
                        cards.next();
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
            _ => {
                let (axis, turns) = match f.integer(1) {
                    dof @ 1..=3 => (dof as usize - 1, false),
                    dof @ 5..=7 => (dof as usize - 5, true),
                    _ => {
                        let advice = "give components along or about the global axes";
                        return f.fault(1, "DOF 1 to 3 along, or 5 to 7 about x, y or z", advice);
                    }
                };
                let Some(meaning) = Meaning::read(f, 2) else { return };
                all_along(f, 7, 6);
                let (part, curve, factor) = (f.id(0), f.id(3), scale(f, 4));
                self.motions.push(BodyMotion { at, part, axis, turns, meaning, curve, factor });
            }
        }
    }
}
