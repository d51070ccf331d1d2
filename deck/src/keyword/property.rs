//! `*PART`, `*SECTION_` of solids and shells, and `*HOURGLASS`.

use super::{
    cards::{Block, Card},
    fields::{Context, Fields, TENS},
    problem::{Hourglass, PartCard, Problem, Section, ShellSection},
};

/// `*PART`: a heading and a card each.
pub(super) fn read_parts(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>, contact: bool) {
    let step = if contact { 3 } else { 2 };
    for cards in block.cards.chunks(step) {
        let Some(card) = cards.get(1) else {
            let (at, log) = (cards[0].at, context.log);
            log.fault(at, log.quote(&cards[0].text), "a card with the part's numbers", "complete the part");
            return;
        };
        let f = context.fields(card, block.width, &TENS);
        read_part(problem, &cards[0], &f, context);
        if contact {
            context.log.warn(
                card.at,
                "*PART_CONTACT: its third card is not used; contact takes its friction from *CONTACT",
            );
        }
    }
}

/// The heading and the card with the numbers of a part.
pub(super) fn read_part(problem: &mut Problem, heading: &Card<'_>, f: &Fields<'_>, context: &Context<'_>) {
    let part = PartCard {
        at: f.at,
        title: heading.text.trim().to_string(),
        section: f.reference(1, "SECID"),
        material: f.reference(2, "MID"),
        eos: f.reference(3, "EOSID"),
        hourglass: f.id(4),
    };
    if f.integer(6) != 0 {
        f.fault(6, "no adaptive mesh", "leave ADPOPT blank");
    }
    if f.integer(5) != 0 {
        f.fault(5, "no part of its own for gravity", "leave GRAV blank");
    }
    let id = f.id(0);
    if let Some(first) = problem.parts.insert(id, part) {
        f.fault(
            0,
            format!("a part number other than {id}, which {} has", context.log.line(first.at, f.at)),
            "renumber one",
        );
    }
}

pub(super) fn read_solid_sections(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
        let f = context.fields(card, block.width, &TENS);
        let form = f.integer(1);
        let eight_points = matches!(form, -2..=-1 | 2..=3);
        match form {
            // Those of tetrahedra with nodes on their edges, which are known by these.
            0..=2 | 16 | 17 => {}
            -2 | -1 | 3 => context
                .log
                .warn(card.at, format!("ELFORM {form}: solids are computed with eight points, as ELFORM 2")),
            10 | 13 | 15 => context.log.warn(
                card.at,
                format!(
                    "ELFORM {form}: solids are computed with one point and hourglass control, as ELFORM 1"
                ),
            ),
            _ => f.fault(1, "ELFORM 1 or 2", "take the Lagrangian solid of one or of eight points"),
        }
        problem.sections.insert(f.id(0), (card.at, Section::Solid { eight_points }));
    }
}

pub(super) fn read_shell_sections(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let mut cards = block.cards.iter();
    while let Some(card) = cards.next() {
        let f = context.fields(card, block.width, &TENS);
        match f.integer(1) {
            0 | 2 => {}
            form @ (-16 | 1 | 3 | 4 | 6..=8 | 10 | 11 | 16..=18 | 20 | 21 | 25..=27) => context.log.warn(
                card.at,
                format!(
                    "ELFORM {form}: shells are computed with one point and hourglass control, as ELFORM 2 with \
                     warping"
                ),
            ),
            _ => f.fault(1, "ELFORM 2", "take the shell of Belytschko, Lin and Tsay"),
        }
        let (points, rule) = (f.integer(3), f.real(5, 0.0));
        if rule < 0.0 {
            f.fault(5, "QR 0, 1 or 2", "take a rule of points that is built in");
        }
        let lobatto = rule == 1.0;
        if rule > 1.0 {
            context.log.warn(card.at, "QR: points through the thickness are those of Gauss");
        }
        let asked = if points == 0 { 2 } else { points };
        let points = asked.clamp(if lobatto { 3 } else { 1 }, 5);
        if points != asked {
            context.log.warn(card.at, format!("NIP {asked}: {points} points through the thickness"));
        }
        if f.integer(6) != 0 {
            f.fault(6, "one material through the thickness", "leave ICOMP blank");
        }
        let second = cards.next();
        let thickness = second.map_or(0.0, |second| {
            let g = context.fields(second, block.width, &TENS);
            if g.real(4, 0.0) != 0.0 {
                g.fault(4, "nodes in the middle of the thickness", "leave NLOC blank");
            }
            let corners = [0, 1, 2, 3].map(|i| g.real(i, 0.0));
            let all = corners[1..].iter().all(|t| *t > 0.0);
            if all { corners.iter().sum::<f64>() / 4.0 } else { corners[0] }
        });
        let section = ShellSection { thickness, points: points as u32, lobatto };
        problem.sections.insert(f.id(0), (card.at, Section::Shell(section)));
    }
}

pub(super) fn read_hourglass(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
        let f = context.fields(card, block.width, &TENS);
        let read = Hourglass { at: card.at, kind: f.integer(1), coefficient: f.real(2, 0.0) };
        problem.hourglasses.insert(f.id(0), read);
    }
}
