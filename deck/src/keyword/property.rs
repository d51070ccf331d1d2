//! `*PART`, `*SECTION_` of solids and shells, and `*HOURGLASS`.

use mechanics::{
    element::shell4::InPlane,
    mesh::{MAX_LAYERS, Ply},
};

use super::{
    cards::{Block, Card},
    fields::{Context, Fields, TENS},
    problem::{Hourglass, PartCard, Problem, Section, ShellSection},
};

/// Factor of transverse shear of shells.
const SHEAR_FACTOR: f64 = 5.0 / 6.0;

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
            cards.iter().for_each(Card::mark);
            context.log.warn(
                card.at,
                "*PART_CONTACT: its third card is not used; contact takes its friction from *CONTACT",
            );
        }
    }
}

/// The heading and the card with the numbers of a part.
pub(super) fn read_part(problem: &mut Problem, heading: &Card<'_>, f: &Fields<'_>, context: &Context<'_>) {
    heading.mark();
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

/// `*PART_COMPOSITE`: a heading, a card of the shells, and plies from the lower side up, two on a card. Each has one point.
pub(super) fn read_composite(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let [heading, card, plies @ ..] = block.cards.as_slice() else {
        context.log.fault(
            block.at,
            "*PART_COMPOSITE",
            "a heading and a card of the shells",
            "complete the part",
        );
        return;
    };
    heading.mark();
    let f = context.fields(card, block.width, &TENS);
    if shell_form(&f, true, context).is_some_and(|(_, is_membrane)| is_membrane) {
        f.fault(1, "shells that bend: a membrane has no plies", "take ELFORM 2");
    }
    for (i, expected) in [
        (3, "no NLOC: nodes in the middle of the thickness"),
        (4, "no MAREA: mass that is not structural"),
        (6, "no adaptive mesh"),
        (7, "no THSHEL"),
    ] {
        if f.real(i, 0.0) != 0.0 {
            f.fault(i, expected, "leave it blank");
        }
    }
    let mut layers = Vec::new();
    let mut material = None;
    for card in plies {
        let g = context.fields(card, block.width, &TENS);
        for first in [0, 4].into_iter().filter(|first| g.integer(*first) != 0) {
            let own = g.reference(first, "MID");
            let number = own.value;
            let common = material.get_or_insert(own).value;
            if number != common {
                let expected = format!("material {common} in all plies");
                g.fault(first, expected, "make parts of the other materials");
            }
            if g.integer(first + 3) != 0 {
                g.fault(first + 3, "no thermal material of a ply", "leave TMID blank");
            }
            match g.positive(first + 1, "a thickness") {
                Some(share) => layers.push(Ply { angle: g.real(first + 2, 0.0), share }),
                None => return,
            }
        }
    }
    let Some(material) = material else {
        f.fault(0, "plies by MID, THICK and B", "give the plies from the lower side up");
        return;
    };
    let id = f.id(0);
    // A section of its own, by a number that no card can give.
    let section = u32::MAX - id;
    let thickness = layers.iter().map(|ply: &Ply| ply.share).sum();
    let shell = ShellSection {
        thickness,
        is_by_theory: f.integer(1) == 0,
        points: 1,
        lobatto: false,
        is_by_deck: false,
        in_plane: InPlane::One,
        is_membrane: false,
        angles: Vec::new(),
        plies: layers,
    };
    problem.sections.insert(section, (card.at, Section::Shell(shell)));
    let part = PartCard {
        at: card.at,
        title: heading.text.trim().to_string(),
        section: f.placed(0, "PID", section),
        material,
        eos: f.placed(0, "PID", 0),
        hourglass: f.id(5),
    };
    if let Some(first) = problem.parts.insert(id, part) {
        let other = context.log.line(first.at, f.at);
        f.fault(0, format!("a part number other than {id}, which {other} has"), "renumber one");
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
        let id = problem.number("section", &f, context);
        problem.sections.insert(id, (card.at, Section::Solid { eight_points }));
    }
}

/// What shells of the ELFORM of a card have in their plane, and whether they are membranes; none of a form that is refused.
fn shell_form(f: &Fields<'_>, is_composite: bool, context: &Context<'_>) -> Option<(InPlane, bool)> {
    let form = f.integer(1);
    let warn = |what: &str| context.log.warn(f.at, format!("ELFORM {form}: {what}"));
    let full = if is_composite { InPlane::One } else { InPlane::Four };
    match form {
        0 | 2 => Some((InPlane::One, false)),
        5 => Some((InPlane::One, true)),
        9 => Some((full, true)),
        -16 | 16 if !is_composite => Some((full, false)),
        6 | 7 | 18 | 20 | 21 | 26 if !is_composite => {
            warn("shells are computed with four points in the plane, as ELFORM 16");
            Some((full, false))
        }
        -16 | 1 | 3 | 4 | 6..=8 | 10 | 11 | 16..=18 | 20 | 21 | 25..=27 => {
            warn("shells are computed with one point and hourglass control, as ELFORM 2 with warping");
            Some((InPlane::One, false))
        }
        _ => {
            f.fault(
                1,
                "ELFORM 2, 16, 5 or 9",
                "take the shell of Belytschko, Lin and Tsay, of full integration, or a membrane",
            );
            None
        }
    }
}

pub(super) fn read_shell_sections(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let mut cards = block.cards.iter();
    while let Some(mut card) = cards.next() {
        if block.is_headed {
            card.mark();
            let Some(first) = cards.next() else { return };
            card = first;
        }
        let f = context.fields(card, block.width, &TENS);
        let is_composite = f.integer(6) == 1;
        let (in_plane, is_membrane) = shell_form(&f, is_composite, context).unwrap_or_default();
        if is_membrane && is_composite {
            f.fault(1, "shells that bend: a membrane has no plies", "take ELFORM 2, or ICOMP 0");
        }
        let factor = f.real(2, 0.0);
        if ![0.0, 1.0].contains(&factor) && (factor - SHEAR_FACTOR).abs() > 0.01 {
            context.log.warn(card.at, format!("SHRF {factor}: the factor of transverse shear is 5/6"));
        }
        let (points, rule) = (f.integer(3), f.real(5, 0.0));
        if rule < 0.0 {
            f.fault(5, "QR 0, 1 or 2", "take a rule of points that is built in");
        }
        let lobatto = rule == 1.0;
        if lobatto {
            context.log.warn(
                card.at,
                "QR 1, a trapezoidal rule: points through the thickness are those of Lobatto, which has some on both sides, too",
            );
        }
        if rule > 1.0 {
            context.log.warn(card.at, "QR: points through the thickness are those of Gauss");
        }
        let asked = if points == 0 { 2 } else { points };
        let points = asked.clamp(if lobatto { 3 } else { 1 }, 5);
        if points != asked && f.integer(6) != 1 {
            context.log.warn(card.at, format!("NIP {asked}: {points} points through the thickness"));
        }
        if !matches!(f.integer(6), 0 | 1) {
            f.fault(6, "ICOMP 0 or 1", "give 1 of a composite with the angles of its layers");
        }
        let second = cards.next();
        let thickness = second.map_or(0.0, |second| {
            let g = context.fields(second, block.width, &TENS);
            if g.real(4, 0.0) != 0.0 {
                g.fault(4, "nodes in the middle of the thickness", "leave NLOC blank");
            }
            if g.real(5, 0.0) != 0.0 {
                g.fault(
                    5,
                    "no MAREA: mass that is not structural",
                    "leave it blank, and put it at nodes by *ELEMENT_MASS",
                );
            }
            let corners = [0, 1, 2, 3].map(|i| g.real(i, 0.0));
            // T1 is the default of the others.
            let or_first = |t: &f64| if *t > 0.0 { *t } else { corners[0] };
            corners.iter().map(or_first).sum::<f64>() / 4.0
        });
        let mut angles = Vec::new();
        let mut left = if is_composite { asked.clamp(0, MAX_LAYERS as i64) as usize } else { 0 };
        while let Some(card) = Some(()).filter(|()| left > 0).and_then(|()| cards.next()) {
            let g = context.fields(card, block.width, &TENS);
            angles.extend((0..left.min(8)).map(|i| g.real(i, 0.0)));
            left -= left.min(8);
        }
        if is_composite && (left > 0 || asked as usize > MAX_LAYERS) {
            let expected =
                format!("an angle for each of the NIP points, of which there are 1 to {MAX_LAYERS}");
            f.fault(3, expected, "give the angles B1 and so on behind the thickness");
        }
        let mut plies = Vec::new();
        if is_composite && points != asked {
            context.log.warn(
                card.at,
                format!("NIP {asked} of a composite: the layers are plies of equal thickness, with a point in each"),
            );
            plies = angles.drain(..).map(|angle| Ply { angle, share: 1.0 }).collect();
        }
        let (points, lobatto) = if plies.is_empty() { (points as u32, lobatto) } else { (1, false) };
        let (points, lobatto) = if is_membrane { (1, false) } else { (points, lobatto) };
        let section = ShellSection {
            thickness,
            is_by_theory: f.integer(1) == 0,
            points,
            lobatto,
            is_by_deck: rule == 0.0,
            in_plane,
            is_membrane,
            angles,
            plies,
        };
        let id = problem.number("section", &f, context);
        problem.sections.insert(id, (card.at, Section::Shell(section)));
    }
}

pub(super) fn read_hourglass(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
        let f = context.fields(card, block.width, &TENS);
        let viscosity = [4, 5].map(|i| f.real(i, 0.0));
        let read = Hourglass { at: card.at, kind: f.integer(1), coefficient: f.real(2, 0.0), viscosity };
        let id = problem.number("*HOURGLASS", &f, context);
        problem.hourglasses.insert(id, read);
    }
}
