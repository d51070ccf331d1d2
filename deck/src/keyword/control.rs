//! `*CONTROL_` and `*DATABASE_`: how long and how finely, and what is written.

use std::collections::BTreeMap;

use super::{
    cards::Block,
    contact::ignoring,
    fields::{Context, TENS},
};
use crate::{
    geometry,
    log::Log,
    place::{Place, Placed},
};

/// Keywords that say how a computation is carried out or written, not what is computed here.
const HARMLESS: [&str; 15] = [
    "CONTROL_ACCURACY",
    "CONTROL_CPU",
    "CONTROL_DEBUG",
    "CONTROL_FORMATTED_OUTPUT",
    "CONTROL_LSDA",
    "CONTROL_MEMORY",
    "CONTROL_OUTPUT",
    "CONTROL_PARALLEL",
    "CONTROL_REQUIRE_REVISION",
    "CONTROL_RIGID",
    "CONTROL_SOLID",
    "CONTROL_SPOTWELD_BEAM",
    "CONTROL_STRUCTURED",
    "CONTROL_STRUCTURED_TERM",
    "CONTROL_SUBCYCLE",
];

/// `*DATABASE_CROSS_SECTION_PLANE` or `_SET`.
pub(super) struct SectionCard {
    pub(super) at: Place,
    /// Number and heading of `_ID`.
    pub(super) id: u32,
    pub(super) heading: String,
    pub(super) cut: CutCard,
}

/// What it cuts.
pub(super) enum CutCard {
    Plane {
        /// Set of parts; 0 is all.
        parts: u32,
        /// Tail and head of the normal.
        tail: [f64; 3],
        head: [f64; 3],
        /// 0 is none.
        radius: f64,
    },
    Sets {
        nodes: u32,
        /// Sets of solids, shells and beams; 0 is none.
        elements: [u32; 3],
    },
}

impl SectionCard {
    /// Reads the set of cards that begins with card `first`.
    fn read(block: &Block<'_>, first: usize, context: &Context<'_>) -> Option<Self> {
        let named = usize::from(block.keyword.ends_with("_ID"));
        let name = block.card(first);
        let title = context.fields(name, block.width, &[10, 70]);
        let (id, heading) =
            if named == 1 { (title.id(0), title.words(1).to_string()) } else { (0, String::new()) };
        let cards = [block.card(first + named), block.card(first + named + 1)];
        let [f, g] = cards.map(|card| context.fields(card, block.width, &TENS));
        if block.keyword.starts_with("DATABASE_CROSS_SECTION_SET") {
            for (field, what) in [(4, "thick shells"), (5, "discrete elements")] {
                if f.id(field) != 0 {
                    context.log.warn(f.at, format!("the force of {what} is not in this section"));
                }
            }
            if f.integer(7) != 0 {
                f.fault(7, "ITYPE 0, the global system", "leave ID and ITYPE blank");
            }
            let cut = CutCard::Sets { nodes: f.id(0), elements: [f.id(1), f.id(3), f.id(2)] };
            return Some(Self { at: f.at, id, heading, cut });
        }
        let (tail, head) = (f.vector(1), f.vector(4));
        if geometry::unit(geometry::sub(head, tail)).is_none() {
            f.fault(4, "a head of the normal apart from its tail", "give XCH, YCH, ZCH");
            return None;
        }
        if g.real(3, 0.0) != 0.0 || g.real(4, 0.0) != 0.0 {
            g.fault(
                3,
                "no LENL and LENM: a plane without end",
                "leave them blank, or bound it by RADIUS and PSID",
            );
        }
        if g.integer(6) != 0 {
            g.fault(6, "ITYPE 0, the global system", "leave ID and ITYPE blank");
        }
        let radius = f.real(7, 0.0);
        if radius < 0.0 {
            f.fault(7, "a RADIUS of 0 or above", "give one, or leave it blank");
            return None;
        }
        let cut = CutCard::Plane { parts: f.id(0), tail, head, radius };
        Some(Self { at: f.at, id, heading, cut })
    }
}

/// Adds the numbers of cards of eight to a list.
fn listed(block: &Block<'_>, context: &Context<'_>, list: &mut Vec<(Place, u32)>) {
    for card in &block.cards {
        let f = context.fields(card, block.width, &TENS);
        list.extend((0..8).map(|i| (card.at, f.id(i))).filter(|(_, id)| *id != 0));
    }
}

/// Adds the numbers at the head of cards to a list.
fn headed(block: &Block<'_>, context: &Context<'_>, list: &mut Vec<(Place, u32)>) {
    for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
        list.push((card.at, context.fields(card, block.width, &[10, 70]).id(0)));
    }
}

/// What the control cards say; none is what no card said.
#[derive(Default)]
pub(super) struct ControlCards {
    pub(super) end_time: Option<(Place, f64)>,
    pub(super) end_cycle: Option<u64>,
    /// LS-DYNA's factor on the time step.
    pub(super) step_factor: Option<(Place, f64)>,
    /// Quadratic and linear coefficient of bulk viscosity.
    pub(super) viscosity: Option<(Place, [f64; 2])>,
    /// Kind and coefficient of hourglass control.
    pub(super) hourglass: Option<(Place, i64, f64)>,
    /// IGNORE of contacts that leave theirs blank, and where it stands.
    pub(super) ignores_initial: Option<(Place, i64)>,
    /// Whether nodes without elements stay in the run.
    pub(super) freed_nodes: Option<(Place, bool)>,
    /// Whether the thickness of shells follows their strains.
    pub(super) shells_thin: bool,
    /// A set of parts, whose shells alone do, or with a minus do not; 0 is none.
    pub(super) thinning_set: Option<(Place, i64)>,
    /// Whether points through the thickness of shells are Lobatto's where QR says nothing, from three points on.
    pub(super) lobatto: bool,
    /// THEORY of `*CONTROL_SHELL`: ELFORM of sections that leave it blank.
    pub(super) theory: Option<Placed<i64>>,
    pub(super) period: Option<(Place, f64)>,
    /// How many states the run is to write, at even times; 0 where the period says when.
    pub(super) states: u32,
    pub(super) sections: Vec<SectionCard>,
    /// Nodes and sets of nodes whose motion is to be written.
    pub(super) gauges: Vec<(Place, u32)>,
    pub(super) gauge_sets: Vec<(Place, u32)>,
    /// The same of solids (0) and shells (1).
    pub(super) element_gauges: [Vec<(Place, u32)>; 2],
    pub(super) element_gauge_sets: [Vec<(Place, u32)>; 2],
    /// Place and cards of the last of each keyword.
    seen: BTreeMap<String, (Place, Vec<String>)>,
}

impl ControlCards {
    /// Reads a `*CONTROL_` keyword.
    pub(super) fn read(&mut self, block: &Block<'_>, context: &Context<'_>) {
        let log = context.log;
        // One set each; further cards say how a computation is carried out.
        block.leave_all();
        self.compare(block, log);
        let card = block.card(0);
        let f = context.fields(card, block.width, &TENS);
        match block.keyword.as_str() {
            "CONTROL_TERMINATION" => {
                let end = f.real(0, 0.0);
                if end > 0.0 {
                    self.end_time = Some((card.at, end));
                }
                self.end_cycle = u64::try_from(f.integer(1)).ok().filter(|n| *n > 0);
                if f.real(3, 0.0) != 0.0 {
                    log.warn(
                        card.at,
                        "ENDENG: the run does not stop by its energy; the summary has the error",
                    );
                }
                if f.real(2, 0.0) != 0.0 {
                    log.warn(card.at, "DTMIN: the run does not end where the time step has fallen by it");
                }
                if f.integer(5) != 0 {
                    f.fault(5, "NOSOL 0", "check the deck with bolide check");
                }
            }
            "CONTROL_TIMESTEP" => {
                let factor = f.real(1, 0.9);
                if !(0.0..=1.0).contains(&factor) {
                    f.fault(1, "a factor above 0 and at most 1", "leave TSSFAC blank for 0.9");
                } else if factor > 0.0 {
                    self.step_factor = Some((card.at, factor));
                }
                if f.real(0, 0.0) != 0.0 {
                    log.warn(card.at, "DTINIT: the first step is that of the elements");
                }
                if f.real(4, 0.0) != 0.0 {
                    log.warn(card.at, "DT2MS: no mass is added; small elements rule the time step");
                }
                if f.integer(6) != 0 {
                    log.warn(
                        card.at,
                        "ERODE: elements leave by the criteria of their materials, not by DTMIN",
                    );
                }
                if f.integer(5) != 0 {
                    log.warn(card.at, "LCTM: the time step is not bounded by a curve");
                }
                if f.real(3, 0.0) != 0.0 {
                    log.warn(card.at, "TSLIMT: stiffness is not reduced for the time step");
                }
            }
            "CONTROL_BULK_VISCOSITY" => {
                // LS-DYNA takes its own where a field is 0, as where it is blank.
                let or_usual = |i: usize, usual: f64| match f.real(i, usual) {
                    0.0 => usual,
                    given => given,
                };
                let [quadratic, linear] = [or_usual(0, 1.5), or_usual(1, 0.06)];
                let kind = f.integer(2);
                if !matches!(kind, 0 | 1) {
                    let words = format!("TYPE {kind}: bulk viscosity is that of solids, as with TYPE 1");
                    log.warn(card.at, words);
                }
                if quadratic < 0.0 || linear < 0.0 {
                    f.fault(0, "coefficients of 0 or above", "correct Q1 and Q2");
                } else {
                    self.viscosity = Some((card.at, [quadratic, linear]));
                }
            }
            "CONTROL_HOURGLASS" => self.hourglass = Some((card.at, f.integer(0), f.real(1, 0.0))),
            "CONTROL_CONTACT" => {
                match f.integer(7) {
                    0 => self.freed_nodes = Some((card.at, false)),
                    1 | 2 => self.freed_nodes = Some((card.at, true)),
                    _ => f.fault(
                        7,
                        "ENMASS 0, 1 or 2",
                        "leave it blank, or say 1 to keep the mass of freed nodes",
                    ),
                }
                self.ignores_initial = ignoring(block, 3, 0, context);
                block.ignore(log);
            }
            // The energies that it switches on are always reckoned.
            "CONTROL_ENERGY" => {}
            "CONTROL_DYNAMIC_RELAXATION" => {
                log.warn(
                    block.at,
                    "no dynamic relaxation before the run; [relaxation] of a TOML deck brings bodies to rest",
                );
            }
            word if word.starts_with("CONTROL_IMPLICIT") => log.fault(
                block.at,
                format!("*{word}"),
                "explicit dynamics; implicit ones are not computed here",
                "take the keyword out if the problem is one of impact, else use another program",
            ),
            word if word.starts_with("CONTROL_THERMAL") || word.starts_with("CONTROL_ALE") => log.fault(
                block.at,
                format!("*{word}"),
                "Lagrangian mechanics",
                "take the keyword out if the problem does without it",
            ),
            "CONTROL_SHELL" => {
                let cards = [block.card(2), block.card(3)];
                let [third, fourth] = [0, 1].map(|i| context.fields(cards[i], block.width, &TENS));
                self.thinning_set = Some((third.at, third.integer(0))).filter(|(_, set)| *set != 0);
                if [0, 1].iter().any(|i| fourth.integer(*i) != 0) {
                    log.warn(
                        fourth.at,
                        "NFAIL1, NFAIL4: shells that are distorted do not leave; they do by the erosion of their part",
                    );
                }
                let second = block.card(1);
                self.lobatto = context.fields(second, block.width, &TENS).integer(1) == 1;
                self.theory = Some(f.placed(4, "THEORY", f.integer(4)));
                let update = f.integer(3);
                // 2 is of thick shells alone.
                self.shells_thin = !matches!(update, 0 | 2);
                if update == 4 {
                    log.warn(
                        card.at,
                        "ISTUPD 4: elastic strains change the thickness of shells too, as with 1",
                    );
                }
            }
            "CONTROL_SOLUTION" => {
                if f.integer(0) != 0 {
                    f.fault(0, "SOLN 0, mechanics alone", "take it out if the problem does without heat");
                }
            }
            word if HARMLESS.contains(&word)
                || word.starts_with("CONTROL_MPP_")
                || word.starts_with("CONTROL_CHECK") =>
            {
                block.ignore(log);
            }
            word => log.fault(
                block.at,
                format!("*{}", log.quote(word)),
                "a *CONTROL_ of the table in deck/README.md",
                "take it out; leaving it out may change what is computed",
            ),
        }
    }

    /// Warns of a keyword that another of its name contradicts.
    fn compare(&mut self, block: &Block<'_>, log: &Log<'_>) {
        let words: Vec<String> = block.cards.iter().map(|card| card.text.trim().to_string()).collect();
        let Some((first, other)) = self.seen.insert(block.keyword.clone(), (block.at, words)) else { return };
        let changes = !HARMLESS.contains(&block.keyword.as_str());
        if changes && self.seen.get(&block.keyword).is_some_and(|(_, words)| *words != other) {
            let word = log.quote(&block.keyword);
            let line = log.line(first, block.at);
            log.warn(
                block.at,
                format!("a second *{word}, other than that of {line}: what both say is as here"),
            );
        }
    }

    /// Reads a `*DATABASE_` keyword.
    pub(super) fn read_database(&mut self, block: &Block<'_>, context: &Context<'_>) {
        match block.keyword.as_str() {
            "DATABASE_BINARY_D3PLOT" => {
                block.leave_all();
                let card = block.card(0);
                let f = context.fields(card, block.width, &TENS);
                let period = f.real(0, 0.0);
                if period > 0.0 {
                    self.period = Some((card.at, period));
                }
                self.states = f.id(3);
                if f.id(1) != 0 {
                    context
                        .log
                        .warn(f.place(1), "LCDT: no curve says when states are written; DT or NPLTC does");
                }
            }
            "DATABASE_HISTORY_NODE" => listed(block, context, &mut self.gauges),
            "DATABASE_HISTORY_NODE_SET" => listed(block, context, &mut self.gauge_sets),
            "DATABASE_HISTORY_SOLID" => listed(block, context, &mut self.element_gauges[0]),
            "DATABASE_HISTORY_SOLID_SET" => listed(block, context, &mut self.element_gauge_sets[0]),
            "DATABASE_HISTORY_SHELL" => listed(block, context, &mut self.element_gauges[1]),
            "DATABASE_HISTORY_SHELL_SET" => listed(block, context, &mut self.element_gauge_sets[1]),
            // One of a card, with a heading behind it.
            "DATABASE_HISTORY_NODE_ID" => headed(block, context, &mut self.gauges),
            "DATABASE_HISTORY_SOLID_ID" => headed(block, context, &mut self.element_gauges[0]),
            "DATABASE_HISTORY_SHELL_ID" => headed(block, context, &mut self.element_gauges[1]),
            "DATABASE_CROSS_SECTION_PLANE"
            | "DATABASE_CROSS_SECTION_PLANE_ID"
            | "DATABASE_CROSS_SECTION_SET"
            | "DATABASE_CROSS_SECTION_SET_ID" => {
                let named = usize::from(block.keyword.ends_with("_ID"));
                let each = named + if block.keyword.contains("_PLANE") { 2 } else { 1 };
                for first in (0..block.cards.len()).step_by(each) {
                    self.sections.extend(SectionCard::read(block, first, context));
                }
            }
            word if word.starts_with("DATABASE_CROSS_SECTION") => {
                block.leave_all();
                context.log.warn(
                    block.at,
                    format!("*{word}: the force of this section is not written; that of _PLANE or _SET is"),
                );
            }
            _ => block.ignore(context.log),
        }
    }
}
