//! `*LOAD_BLAST` and `*LOAD_BLAST_ENHANCED`: charges that explode in air, and the segments that feel them.

use mechanics::load::{Span, blast::Burst};

use super::{
    cards::Block,
    condition::span_of,
    fields::{Context, Fields, TENS},
};
use crate::{place::Place, table::Range};

/// A charge.
pub(super) struct ChargeCard {
    pub(super) at: Place,
    pub(super) id: u32,
    pub(super) mass: f64,
    pub(super) point: [f64; 3],
    pub(super) span: Span,
    pub(super) burst: Burst,
    pub(super) negative: bool,
    /// Our name of the units that the card names.
    pub(super) units: &'static str,
}

/// Segments that feel a charge.
pub(super) struct Blasted {
    pub(super) at: Place,
    /// The charge; of `*LOAD_BLAST`, which has no number, 0.
    pub(super) charge: u32,
    pub(super) faces: Vec<[u32; 4]>,
    pub(super) set: u32,
}

/// All of a deck.
#[derive(Default)]
pub(super) struct Blasts {
    pub(super) charges: Vec<ChargeCard>,
    pub(super) segments: Vec<Blasted>,
}

/// UNIT and the set that it names.
const UNITS: [(i64, &str); 4] = [(2, "SI"), (4, "cm-g-us"), (6, "mm-ms-kg"), (7, "mm-s-t")];

impl Blasts {
    /// Whether a keyword is read here.
    pub(super) fn knows(word: &str) -> bool {
        matches!(word, "LOAD_BLAST" | "LOAD_BLAST_ENHANCED" | "LOAD_BLAST_SEGMENT" | "LOAD_BLAST_SEGMENT_SET")
    }

    pub(super) fn read(&mut self, block: &Block<'_>, context: &Context<'_>) {
        match block.keyword.as_str() {
            "LOAD_BLAST_SEGMENT" | "LOAD_BLAST_SEGMENT_SET" => {
                for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
                    self.segment(block.keyword.ends_with("_SET"), &context.fields(card, block.width, &TENS));
                }
            }
            word => {
                let cards = [block.card(0), block.card(1)];
                let [f, g] = [0, 1].map(|i| context.fields(cards[i], block.width, &TENS));
                self.charge(word == "LOAD_BLAST_ENHANCED", &f, &g);
            }
        }
    }

    fn charge(&mut self, enhanced: bool, f: &Fields<'_>, g: &Fields<'_>) {
        // The enhanced form has the number of the charge first.
        let first = usize::from(enhanced);
        let unit = match f.integer(first + 5) {
            0 => 2,
            unit => unit,
        };
        let units = UNITS.iter().find(|(code, _)| *code == unit && (enhanced || unit < 5));
        if units.is_none() {
            let (expected, advice) = match enhanced {
                true => ("UNIT 2 (SI), 4 (cm, g, us), 6 (mm, ms, kg) or 7 (mm, s, t)", "convert the deck"),
                false if unit == 6 || unit == 7 => {
                    ("UNIT 2 (SI) or 4 (cm, g, us)", "use *LOAD_BLAST_ENHANCED, which has UNIT 6 and 7")
                }
                false => ("UNIT 2 (SI) or 4 (cm, g, us)", "convert the deck, or use *LOAD_BLAST_ENHANCED"),
            };
            f.fault(first + 5, expected, advice);
        }
        let burst = match f.integer(first + 6) {
            1 => Some(Burst::Surface),
            2 => Some(Burst::Air),
            0 if !enhanced => Some(Burst::Air),
            _ => {
                f.fault(
                    first + 6,
                    "1, a hemisphere on the ground, or 2, a sphere in free air",
                    "choose one of them",
                );
                None
            }
        };
        if g.integer(4) != 0 {
            g.fault(4, "a charge at a point", "give XBO, YBO, ZBO");
        }
        let mass = f.positive(first, "a mass of TNT");
        let death = g.within(5, 0.0, Range::NotNegative);
        let mut span = Span { from: f.within(first + 4, 0.0, Range::NotNegative), ..Span::ALWAYS };
        if death > 0.0 {
            span = span_of(g, 16, 5);
            span.from = f.within(first + 4, 0.0, Range::NotNegative);
        }
        let (Some((_, units)), Some(burst), Some(mass)) = (units, burst, mass) else { return };
        self.charges.push(ChargeCard {
            at: f.at,
            id: if enhanced { f.id(0) } else { 0 },
            mass,
            point: f.vector(first + 1),
            span,
            burst,
            negative: g.integer(6) == 0,
            units,
        });
    }

    fn segment(&mut self, of_set: bool, f: &Fields<'_>) {
        let (mut faces, mut set) = (Vec::new(), 0);
        if of_set {
            set = f.id(1);
        } else {
            let mut face = [1, 2, 3, 4].map(|i| f.id(i));
            if face[3] == 0 {
                face[3] = face[2];
            }
            faces.push(face);
        }
        self.segments.push(Blasted { at: f.at, charge: f.id(0), faces, set });
    }
}
