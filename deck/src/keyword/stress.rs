//! `*INITIAL_STRESS_SOLID` and `*INITIAL_STRESS_SHELL`: stress and plastic strain of elements at the start.

use mechanics::initial::{PointStress, Points};

use super::{
    cards::{Block, Card},
    fields::{Context, Fields, TENS},
    problem::Problem,
};
use crate::place::Place;

/// Five fields of sixteen columns, as cards with LARGE 1 have.
const LARGE: [usize; 5] = [16; 5];
/// Most points of an element.
const MAX_POINTS: i64 = 1_000;
/// Most history variables of a point.
const MAX_HISTORY: i64 = 1_000;

/// The stress of an element or of a set of elements.
pub(super) struct StressCard {
    pub(super) at: Place,
    /// 0 solids, 1 shells.
    pub(super) kind: usize,
    pub(super) is_of_set: bool,
    /// The number of the element or of the set.
    pub(super) id: u32,
    pub(super) points: Points,
}

/// How the cards of a block are laid out.
#[derive(Clone, Copy)]
struct Layout {
    kind: usize,
    is_of_set: bool,
}

/// The layout of a keyword; none of others.
fn layout(keyword: &str) -> Option<Layout> {
    let (word, is_of_set) = match keyword.strip_suffix("_SET") {
        Some(word) => (word, true),
        None => (keyword, false),
    };
    let kind = ["INITIAL_STRESS_SOLID", "INITIAL_STRESS_SHELL"].iter().position(|of| *of == word)?;
    Some(Layout { kind, is_of_set })
}

pub(super) fn knows(keyword: &str) -> bool {
    layout(keyword).is_some()
}

/// Whether a keyword gives strains that another program reports and computes nothing from.
pub(super) fn is_of_strain(keyword: &str) -> bool {
    let word = keyword.strip_suffix("_SET").unwrap_or(keyword);
    ["INITIAL_STRAIN_SHELL", "INITIAL_STRAIN_SOLID"].contains(&word)
}

/// Reads the elements of a block, up to one whose cards cannot be told apart.
pub(super) fn read<'b>(problem: &mut Problem, block: &'b Block<'b>, context: &'b Context<'b>) {
    let Some(layout) = layout(&block.keyword) else { return };
    let mut cards = Cards { block, context, next: 0 };
    while cards.next < block.cards.len() {
        let Some(card) = cards.element(layout) else { return };
        problem.stresses.push(card);
    }
}

/// Cards of a block, one after the other.
struct Cards<'b> {
    block: &'b Block<'b>,
    context: &'b Context<'b>,
    next: usize,
}

impl<'b> Cards<'b> {
    /// The next card; one that is not there is a fault.
    fn card(&mut self) -> Option<&'b Card<'b>> {
        let card = self.block.card(self.next);
        if self.next >= self.block.cards.len() {
            let expected = "a card of stress for each point, and cards of its history variables";
            self.context.log.fault(card.at, "the end of the keyword", expected, "add the missing cards");
            return None;
        }
        self.next += 1;
        Some(card)
    }

    /// The stress of an element; none where its cards cannot be told apart.
    fn element(&mut self, layout: Layout) -> Option<StressCard> {
        let head = self.card()?;
        let f = self.context.fields(head, self.block.width, &TENS);
        let id = f.id(0);
        // Numbers of points, of history variables, the format, and fields that must be blank.
        let (points, history, large, blank): ([i64; 2], _, _, &[usize]) = match layout.kind {
            0 => ([count(&f, 1)?, 1], 2, 3, &[4, 5, 6, 7]),
            _ => ([count(&f, 1)?, count(&f, 2)?], 3, 5, &[4, 6, 7]),
        };
        let n_history = f.integer(history);
        if !(0..=MAX_HISTORY).contains(&n_history) {
            f.fault(history, format!("0 to {MAX_HISTORY} history variables"), "correct it");
            return None;
        }
        if let Some(&i) = blank.iter().find(|&&i| f.integer(i) != 0) {
            f.fault(i, "0: stress and plastic strain of plain elements alone", "leave it blank");
            return None;
        }
        let is_large = match f.integer(large) {
            0 => false,
            1 => true,
            _ => {
                f.fault(large, "LARGE 0 or 1", "correct it");
                return None;
            }
        };
        let mut all = Vec::new();
        for _ in 0..points[0] * points[1] {
            all.push(self.point(layout, is_large, n_history as usize)?);
        }
        let points = match layout.kind {
            0 if all.len() == 1 => Points::Same(all[0].1),
            0 => Points::Each(all.into_iter().map(|(_, point)| point).collect()),
            _ => through(all, points, &f)?,
        };
        Some(StressCard { at: head.at, kind: layout.kind, is_of_set: layout.is_of_set, id, points })
    }

    /// Height and stress of a point.
    fn point(&mut self, layout: Layout, is_large: bool, n_history: usize) -> Option<(f64, PointStress)> {
        let widths: &[usize] = if is_large { &LARGE } else { &TENS };
        let per_card = widths.len();
        // What comes before the history variables: the height of shells, six stresses, the plastic strain.
        let n_own = 7 + layout.kind;
        // With wide fields those of solids begin on the card of the last stress; else on a card of their own.
        let shared = if is_large && layout.kind == 0 { 3.min(n_history) } else { 0 };
        let mut own = [0.0; 8];
        let mut n = 0;
        while n < n_own {
            let card = self.card()?;
            let f = self.context.fields(card, self.block.width, widths);
            let here = per_card.min(n_own - n);
            for i in 0..here {
                own[n + i] = f.real(i, 0.0);
            }
            n += here;
            if n == n_own {
                if own[n_own - 1] < 0.0 {
                    f.fault(here - 1, "a plastic strain of 0 or more", "correct it");
                }
                must_vanish(&f, here..here + shared);
            }
        }
        let mut left = n_history - shared;
        while left > 0 {
            let card = self.card()?;
            let f = self.context.fields(card, self.block.width, widths);
            let here = per_card.min(left);
            must_vanish(&f, 0..here);
            left -= here;
        }
        let (height, numbers) = if layout.kind == 0 { (0.0, &own[..7]) } else { (own[0], &own[1..]) };
        let point = PointStress {
            stress: std::array::from_fn(|i| numbers[i] + 0.0),
            plastic_strain: numbers[6].max(0.0),
        };
        Some((height + 0.0, point))
    }
}

/// A number of points.
fn count(f: &Fields<'_>, i: usize) -> Option<i64> {
    let n = f.integer(i);
    if (1..=MAX_POINTS).contains(&n) {
        return Some(n);
    }
    f.fault(i, format!("1 to {MAX_POINTS} points"), "correct it");
    None
}

/// Reports the first history variable that is not 0.
fn must_vanish(f: &Fields<'_>, mut fields: std::ops::Range<usize>) {
    if let Some(i) = fields.find(|&i| f.real(i, 0.0) != 0.0) {
        f.fault(i, "a history variable of 0: laws here have others", "set NHISV to 0 and leave them out");
    }
}

/// Points through the thickness by height: those in the plane at one height become their mean.
fn through(all: Vec<(f64, PointStress)>, [_, n_thick]: [i64; 2], f: &Fields<'_>) -> Option<Points> {
    let mut levels: Vec<(f64, Vec<PointStress>)> = Vec::new();
    for (height, point) in all {
        match levels.iter_mut().find(|(at, _)| *at == height) {
            Some((_, level)) => level.push(point),
            None => levels.push((height, vec![point])),
        }
    }
    levels.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let is_inside = levels.iter().all(|(height, _)| (-1.0..=1.0).contains(height));
    if levels.len() as i64 != n_thick || !is_inside {
        f.fault(2, "so many different heights T from -1 to 1", "correct T, or the number of points");
        return None;
    }
    let layers: Vec<(f64, PointStress)> =
        levels.into_iter().map(|(height, level)| (height, PointStress::mean(&level))).collect();
    Some(match layers[..] {
        [(_, only)] => Points::Same(only),
        _ => Points::Layers(layers),
    })
}
