//! `*SECTION_BEAM` of trusses, cables and beams.

use mechanics::element::beam2::{BeamSection, Shape, USUAL_POINTS};

use super::{
    cards::{Block, Card},
    fields::{Context, Fields, TENS},
    problem::{Problem, Section},
};

/// `*SECTION_BEAM`.
pub(super) fn read_sections(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let mut cards = block.cards.iter();
    while let Some(card) = cards.next() {
        let f = context.fields(card, block.width, &TENS);
        let Some(second) = cards.next() else {
            f.fault(0, "a second card with the cross-section", "complete the section");
            return;
        };
        let g = context.fields(second, block.width, &TENS);
        let form = f.integer(1);
        if f.real(6, 0.0) != 0.0 {
            f.fault(
                6,
                "no NSM: mass that is not structural",
                "leave it blank, and put it at nodes by *ELEMENT_MASS",
            );
        }
        let section = match form {
            form @ (0 | 1 | 4 | 5 | 9) => of_shape(&f, &g, (form, context), card),
            2 => of_moments(&g).map(Section::Beam),
            3 => truss(&g),
            6 => cable(&g),
            _ => {
                f.fault(
                    1,
                    "ELFORM 1, 2, 3, 4, 5, 6 or 9",
                    "take the beam of Hughes and Liu or of Belytschko, the spot weld, the truss, or the cable",
                );
                None
            }
        };
        // One that could not be read is known, so that its parts say nothing of it.
        let unread = || match form {
            3 => Section::Truss(1.0),
            6 => Section::Cable(1.0),
            _ => Section::Beam(Shape::Rectangle([1.0; 2]).section(USUAL_POINTS)),
        };
        let id = problem.number("section", &f, context);
        problem.sections.insert(id, (card.at, section.unwrap_or_else(unread)));
    }
}

/// An area above 0.
fn area(g: &Fields<'_>) -> Option<f64> {
    let area = g.real(0, 0.0);
    let fits = area.is_finite() && area > 0.0;
    if !fits {
        g.fault(0, "an area above 0", "give A");
    }
    fits.then_some(area)
}

fn truss(g: &Fields<'_>) -> Option<Section> {
    let area = area(g);
    for (i, what) in [(1, "RAMPT"), (2, "STRESS")] {
        if g.real(i, 0.0) != 0.0 {
            g.fault(i, "0: trusses start without stress", format!("leave {what} blank"));
        }
    }
    area.map(Section::Truss)
}

/// VOL, INER, CID, CA, OFFSET, RRCON, SRCON, TRCON of a discrete beam that is a cable. INER is the inertia of rotations, which cables
/// do not have.
fn cable(g: &Fields<'_>) -> Option<Section> {
    let refused = [
        (0, "VOL 0: a cable has the mass RO times CA times its length"),
        (2, "CID 0: a cable pulls along the line between its nodes"),
        (4, "OFFSET 0: a cable is as long without stress as in the mesh, or shorter by F0"),
        (5, "RRCON 0: a cable has no rotations"),
        (6, "SRCON 0: a cable has no rotations"),
        (7, "TRCON 0: a cable has no rotations"),
    ];
    for (i, expected) in refused {
        if g.real(i, 0.0) != 0.0 {
            g.fault(i, expected, "leave it blank");
        }
    }
    g.positive(3, "an area CA").map(Section::Cable)
}

/// A, ISS, ITT, J, SA.
fn of_moments(g: &Fields<'_>) -> Option<BeamSection> {
    let area = area(g);
    let moments = [1, 2].map(|i| {
        let moment = g.real(i, 0.0);
        let fits = moment.is_finite() && moment > 0.0;
        if !fits {
            g.fault(i, "a second moment of area above 0", "give ISS and ITT");
        }
        fits.then_some(moment)
    });
    if g.real(5, 0.0) != 0.0 {
        g.fault(5, "principal axes: IST 0", "turn the third nodes to the principal axes");
    }
    let inertia = [moments[0]?, moments[1]?];
    let torsion = match g.real(3, 0.0) {
        0.0 => inertia[0] + inertia[1],
        given => given,
    };
    let shear = g.real(4, 0.0).max(0.0);
    Some(BeamSection { area: area?, inertia, torsion, shear: [shear; 2], fibres: None, breaks: None })
}

/// TS1, TS2, TT1, TT2 of a rectangle (CST 0) or a round section (CST 1, or of ELFORM 5 and of 9, the spot weld).
fn of_shape(
    f: &Fields<'_>,
    g: &Fields<'_>,
    (form, context): (i64, &Context<'_>),
    card: &Card<'_>,
) -> Option<Section> {
    let sizes = [0, 1, 2, 3].map(|i| g.real(i, 0.0));
    for (one, other, name) in [(0, 1, "TS2"), (2, 3, "TT2")] {
        if sizes[other] != 0.0 && (sizes[other] - sizes[one]).abs() > 1e-6 * sizes[one].abs() {
            g.fault(other, "the same size at both ends", format!("give {name} as the one before it"));
        }
    }
    let is_weld = form == 9;
    if is_weld && g.real(6, 0.0) != 0.0 {
        g.fault(6, "a spot weld that resists torsion", "leave ITOFF blank");
    }
    // In their place a spot weld says whether its forces are printed.
    for (i, what) in [(4, "NSLOC"), (5, "NTLOC")].into_iter().filter(|_| !is_weld) {
        if g.real(i, 0.0) != 0.0 {
            g.fault(i, "nodes in the middle of the section", format!("leave {what} blank"));
        }
    }
    let shape = match (f.integer(4), matches!(form, 5 | 9)) {
        (1, _) | (0, true) => {
            let [outer, inner] = [sizes[0], sizes[2]];
            if !(outer > inner && inner >= 0.0) {
                g.fault(0, "an outer diameter above the inner one", "give TS1 and TT1");
                return None;
            }
            Shape::Round([outer, inner])
        }
        (0, _) => {
            if !(sizes[0] > 0.0 && sizes[2] > 0.0) {
                g.fault(0, "two sides above 0", "give TS1 and TT1");
                return None;
            }
            Shape::Rectangle([sizes[0], sizes[2]])
        }
        _ => {
            f.fault(
                4,
                "CST 0 or 1: a rectangle or a tube",
                "choose one of them, or ELFORM 2 with its moments",
            );
            return None;
        }
    };
    let rule = f.real(3, 0.0);
    if rule < 0.0 {
        f.fault(3, "a rule of points that is built in", "leave QR blank");
        return None;
    }
    let mut section = shape.section(USUAL_POINTS);
    let factor = f.real(2, 1.0);
    section.shear = [factor.max(0.0) * section.area; 2];
    context.log.warn(
        card.at,
        format!("beams whose material yields have {USUAL_POINTS} points across the section, at both ends and in the middle"),
    );
    Some(Section::Beam(section))
}
