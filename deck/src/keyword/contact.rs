//! `*CONTACT_`: which parts meet.

use mechanics::contact::Limit;

use super::{
    cards::Block,
    condition::all_along,
    fields::{Context, Fields, TENS},
};
use crate::{place::Place, table::Range};

/// Most cards of a contact: its number and those of `_MPP`, three that each has, one of its kind, seven that are optional.
const MOST_CARDS: usize = 3 + 3 + 1 + 7;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Side {
    /// Every part.
    All,
    Part(u32),
    PartSet(u32),
    /// All parts but those of the set.
    NotPartSet(u32),
    NodeSet(u32),
    SegmentSet(u32),
}

impl Side {
    /// The side whose number stands in field `i` and its kind two fields behind; the first may be every part, where
    /// `all` says so by a blank number.
    fn read(f: &Fields<'_>, i: usize, all: bool) -> Option<Self> {
        let id = f.id(i);
        match f.integer(i + 2) {
            _ if id == 0 && i == 0 && all => Some(Self::All),
            5 if i == 0 => Some(Self::All),
            0 => Some(Self::SegmentSet(id)),
            2 => Some(Self::PartSet(id)),
            3 => Some(Self::Part(id)),
            4 => Some(Self::NodeSet(id)),
            6 => Some(Self::NotPartSet(id)),
            _ => {
                f.fault(i + 2, "a kind of surface from 0 to 6 without 1", "name parts");
                None
            }
        }
    }
}

/// A contact that is honoured, or a force transducer.
pub(super) struct ContactCard {
    pub(super) at: Place,
    pub(super) first: Side,
    /// None where the first meets itself.
    pub(super) second: Option<Side>,
    pub(super) friction: f64,
    /// Coefficient of fast sliding and how fast it is reached (time per length), where friction depends on the velocity.
    pub(super) decay: Option<(f64, f64)>,
    /// Whether it follows the surface that erosion leaves.
    pub(super) erodes: bool,
    /// Whether it looks for edges that meet edges.
    pub(super) edges: bool,
    /// Where nodes of the first are tied to faces of the second.
    pub(super) tied: Option<Tied>,
    /// IGNORE 1 or 2, and where it stands: nodes may start inside.
    pub(super) ignores_initial: Option<(Place, i64)>,
}

/// What becomes of tied nodes.
#[derive(Clone, Copy, Default)]
pub(super) struct Tied {
    /// Of pull and shear, where the tie breaks by them.
    pub(super) limits: [Option<Limit>; 2],
    /// Whether its parts meet once it has broken.
    pub(super) then_meets: bool,
}

impl ContactCard {
    /// Reads a `*CONTACT_` keyword other than force transducers; none after a fault.
    pub(super) fn read(block: &mut Block<'_>, context: &Context<'_>) -> Option<Self> {
        let log = context.log;
        let whole = block.keyword.clone();
        // Numbers, the three cards, one of its kind, and those that are optional.
        block.leave(MOST_CARDS);
        if whole == "CONTACT_INTERIOR" || whole.starts_with("CONTACT_INTERIOR_") {
            log.warn(
                block.at,
                "*CONTACT_INTERIOR: nothing keeps the elements of these parts from being crushed flat; a run in which one turns \
                 inside out stops with an error that names it",
            );
            return None;
        }
        let mut extra = usize::from(block.take("_ID") || block.take("_TITLE"));
        let is_mpp = block.take("_MPP");
        extra += usize::from(is_mpp);
        extra += usize::from(extra == 0 && (block.take("_ID") || block.take("_TITLE")));
        let mut ignores_initial = if is_mpp { ignoring(block, extra - 1, 0, context) } else { None };
        // The second card of _MPP is there where it begins with a sign that is no parameter.
        extra += usize::from(is_mpp && begins_second_mpp(&block.card(extra).text));
        if block.take("_MORTAR") {
            log.warn(block.at, format!("*{}: our own penalty, on nodes and faces", log.quote(&whole)));
        }
        let word = block.keyword["CONTACT_".len()..].to_string();
        let single = match word.as_str() {
            "AUTOMATIC_SINGLE_SURFACE"
            | "AUTOMATIC_GENERAL"
            | "ERODING_SINGLE_SURFACE"
            | "SINGLE_SURFACE" => true,
            "AUTOMATIC_SURFACE_TO_SURFACE"
            | "AUTOMATIC_NODES_TO_SURFACE"
            | "AUTOMATIC_ONE_WAY_SURFACE_TO_SURFACE"
            | "SURFACE_TO_SURFACE"
            | "NODES_TO_SURFACE"
            | "ONE_WAY_SURFACE_TO_SURFACE"
            | "ERODING_SURFACE_TO_SURFACE"
            | "ERODING_NODES_TO_SURFACE"
            | "TIED_NODES_TO_SURFACE"
            | "TIED_SURFACE_TO_SURFACE"
            | "TIEBREAK_NODES_ONLY"
            | "TIEBREAK_NODES_TO_SURFACE"
            | "TIEBREAK_SURFACE_TO_SURFACE"
            | "AUTOMATIC_SURFACE_TO_SURFACE_TIEBREAK"
            | "AUTOMATIC_ONE_WAY_SURFACE_TO_SURFACE_TIEBREAK" => false,
            _ => {
                log.fault(
                    block.at,
                    format!("*{}", log.quote(&whole)),
                    "a contact of the table in deck/README.md",
                    "use one without other words, or an AUTOMATIC, ERODING or TIED one",
                );
                return None;
            }
        };
        if !["AUTOMATIC", "ERODING", "TIE"].iter().any(|kind| word.starts_with(kind)) {
            let words = format!("*CONTACT_{word} as *CONTACT_AUTOMATIC_{word}: faces meet from both sides");
            log.warn(block.at, words);
        }
        let mut erodes = word.starts_with("ERODING");
        if erodes {
            // The card of an eroding contact is its fourth.
            let card = block.card(extra + 3);
            erodes = context.fields(card, block.width, &TENS).integer(1) != 0;
        }
        let [f, g, h] = [0, 1, 2].map(|i| context.fields(block.card(extra + i), block.width, &TENS));
        for i in [4, 5].into_iter().filter(|i| f.integer(*i) != 0) {
            f.fault(i, "contact wherever its parts are", "leave the boxes blank");
        }
        all_along(&g, 6, 7);
        let side = |i: usize| Side::read(&f, i, single);
        // The first optional card, behind that of the kind. With SOFT 2 a DEPTH that ends in 5 looks for edges, too.
        let kind_card = word.starts_with("ERODING") || word.contains("TIEBREAK");
        let first = extra + 3 + usize::from(kind_card);
        let optional = context.fields(block.card(first), block.width, &TENS);
        ignores_initial = ignoring(block, first + 2, 1, context).or(ignores_initial);
        let by_depth = optional.integer(0) == 2 && optional.integer(5).rem_euclid(10) == 5;
        let edges = word == "AUTOMATIC_GENERAL" || by_depth;
        // FSF scales friction.
        let factor = match h.within(6, 1.0, Range::NotNegative) {
            0.0 => 1.0,
            factor => factor,
        };
        if g.real(0, 0.0) == 2.0 {
            let expected = "a coefficient of friction other than 2: with FS 2 the field FD is the number of a *DEFINE_TABLE";
            g.fault(0, expected, "give FS, FD and DC; a coefficient that is meant so may be 2.001");
            return None;
        }
        let (fixed, moving, decay) = (factor * g.real(0, 0.0), factor * g.real(1, 0.0), g.real(2, 0.0));
        if fixed < 0.0 || (decay != 0.0 && moving < 0.0) {
            g.fault(
                if fixed < 0.0 { 0 } else { 1 },
                "a coefficient of friction of 0 or above",
                "give the contact its own",
            );
            return None;
        }
        if g.real(3, 0.0) != 0.0 {
            log.warn(g.at, "VC: friction is not bounded by a stress");
        }
        warn_of_damping(&g, context);
        warn_of_thickness(&h, word.contains("TIE"), context);
        let second = if single { None } else { Some(side(1)?) };
        let decay = (decay != 0.0 && fixed != moving).then_some((moving, decay));
        let tied = if word.contains("TIEBREAK") {
            // The card of a tiebreak is its fourth.
            let card = block.card(extra + 3);
            Some(Tied::read(&context.fields(card, block.width, &TENS), &word)?)
        } else {
            word.starts_with("TIED").then(Tied::default)
        };
        Some(Self {
            at: f.at,
            first: side(0)?,
            second,
            friction: fixed,
            decay,
            erodes,
            edges,
            tied,
            ignores_initial,
        })
    }

    /// Reads `*CONTACT_FORCE_TRANSDUCER_`; none where its surfaces are of a kind that is not known.
    pub(super) fn read_transducer(block: &mut Block<'_>, context: &Context<'_>) -> Option<Self> {
        let extra = usize::from(block.take("_ID") || block.take("_TITLE"));
        block.leave(MOST_CARDS);
        let card = block.card(extra);
        let f = context.fields(card, block.width, &TENS);
        if [4, 5].iter().any(|i| f.integer(*i) != 0) {
            context.log.warn(f.at, "a force transducer with boxes: the forces are those of its whole parts");
        }
        let kinds = [2, 3].map(|i| f.integer(i));
        if kinds.iter().any(|kind| !matches!(kind, 0 | 2..=6)) {
            context.log.warn(f.at, format!("a force transducer of surfaces of kinds {kinds:?} is left out"));
            return None;
        }
        let second = if f.id(1) == 0 { None } else { Some(Side::read(&f, 1, false)?) };
        let first = Side::read(&f, 0, true)?;
        Some(Self {
            at: f.at,
            first,
            second,
            friction: 0.0,
            decay: None,
            erodes: false,
            edges: false,
            tied: None,
            ignores_initial: None,
        })
    }
}

/// Whether a card is the second of `_MPP`.
fn begins_second_mpp(card: &str) -> bool {
    card.strip_prefix('&').is_some_and(|rest| rest.is_empty() || rest.starts_with([' ', ',']))
}

/// IGNORE in a field of a card, where it lets nodes start inside.
pub(super) fn ignoring(
    block: &Block<'_>,
    card: usize,
    i: usize,
    context: &Context<'_>,
) -> Option<(Place, i64)> {
    let f = context.fields(block.card(card), block.width, &TENS);
    let ignore = f.integer(i);
    matches!(ignore, 1 | 2).then(|| (f.place(i), ignore))
}

/// Warns of the damping on the second card.
fn warn_of_damping(g: &Fields<'_>, context: &Context<'_>) {
    let damping = g.real(4, 0.0);
    if damping > 0.0 {
        let words = format!(
            "VDC {damping} (field 5 of card 2): contact is not damped by it; only where friction sticks are pushes damped, by as much as they need to come to rest"
        );
        context.log.warn(g.place(4), words);
    }
}

/// Warns of thicknesses and their factors on the third card.
fn warn_of_thickness(h: &Fields<'_>, ties: bool, context: &Context<'_>) {
    let fields = [(2, "SST", 0.0), (3, "MST", 0.0), (4, "SFST", 1.0), (5, "SFMT", 1.0)];
    let given: Vec<_> = fields
        .into_iter()
        .map(|(i, name, usual)| (i, name, usual, h.real(i, 0.0)))
        .filter(|(_, _, usual, value)| *value != 0.0 && value != usual)
        .collect();
    let Some((first, ..)) = given.first() else { return };
    let named: Vec<String> = given
        .iter()
        .map(|(i, name, _, value)| format!("{name} {value} (field {} of card 3)", i + 1))
        .collect();
    let instead = if ties {
        "ties hold nodes within 5 % of the smallest edge"
    } else {
        "contact is as thick as its gap: half the thinnest shells, without shells a tenth of the smallest edge, and less where bodies start nearer"
    };
    context
        .log
        .warn(h.place(*first), format!("{}: {instead}, whatever thickness is given", named.join(", ")));
}

impl Tied {
    /// Reads at what ties of a tiebreak contact break; none after a fault.
    fn read(f: &Fields<'_>, word: &str) -> Option<Self> {
        let of_nodes = word.starts_with("TIEBREAK_NODES");
        let first = usize::from(word.starts_with("AUTOMATIC"));
        if first == 1 && f.integer(0) != 2 {
            f.fault(0, "OPTION 2: nodes that start in contact are tied until they break", "use OPTION 2");
            return None;
        }
        if of_nodes {
            // Exponents of both forces, 2 where they are blank.
            if let Some(i) = [2, 3].into_iter().find(|&i| ![0.0, 2.0].contains(&f.real(i, 0.0))) {
                f.fault(i, "an exponent of 2", "leave it blank, and give forces that fit it");
                return None;
            }
        } else if first == 0 && f.id(2) != 0 {
            f.fault(2, "no curve by which the tie weakens", "leave TBLCID blank");
            return None;
        }
        let limit = |i: usize| {
            let value = f.within(i, 0.0, Range::NotNegative);
            let limit = if of_nodes { Limit::Force(value) } else { Limit::Stress(value) };
            (value > 0.0).then_some(limit)
        };
        let limits = [limit(first), limit(first + 1)];
        if limits == [None, None] {
            f.fault(
                first,
                "a strength of the tie above 0",
                "give one, or use a TIED contact, which does not break",
            );
            return None;
        }
        Some(Self { limits, then_meets: word != "TIEBREAK_NODES_ONLY" })
    }
}
