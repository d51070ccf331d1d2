//! `*DEFINE_`: curves, boxes, coordinate systems.

use super::{
    cards::Block,
    fields::{Context, TENS},
    problem::{CurveCard, Problem},
};
use crate::geometry::{cross, sub as minus, unit};

/// `*DEFINE_CURVE`.
pub(super) fn read_curve(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let head = block.card(0);
    let f = context.fields(&head, block.width, &TENS);
    // Of those that nothing in the run itself takes it does no harm.
    let relaxation = (f.integer(1) == 1).then(|| f.origin(1, "SIDR"));
    let or_one = |x: f64| if x == 0.0 { 1.0 } else { x };
    let (sa, so) = (or_one(f.real(2, 0.0)), or_one(f.real(3, 0.0)));
    let (oa, oo) = (f.real(4, 0.0), f.real(5, 0.0));
    let mut points: Vec<[f64; 2]> = Vec::new();
    for card in block.cards.iter().skip(1).filter(|card| !card.text.trim().is_empty()) {
        let p = context.fields(card, block.width, &[20, 20]);
        let point = [sa * (p.real(0, 0.0) + oa), so * (p.real(1, 0.0) + oo)];
        if points.last().is_some_and(|last| last[0] >= point[0]) {
            p.fault(0, "an abscissa above that of the point before", "put the points in order");
            continue;
        }
        points.push(point);
    }
    if points.is_empty() {
        f.fault(0, "a curve with points", "give it at least one");
        points.push([0.0; 2]);
    }
    problem.curves.insert(f.id(0), CurveCard { points, relaxation });
}

/// The three directions of a system: x from the origin, the xy plane through a third point.
pub(super) fn read_system(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let head = block.card(0);
    let f = context.fields(&head, block.width, &TENS);
    let (x, plane) = match block.keyword.as_str() {
        "DEFINE_COORDINATE_SYSTEM" => {
            let second = block.card(1);
            let g = context.fields(&second, block.width, &TENS);
            if f.integer(7) != 0 {
                f.fault(7, "no system inside a system", "give points in global coordinates");
            }
            let origin = f.vector(1);
            (minus(f.vector(4), origin), minus(g.vector(0), origin))
        }
        "DEFINE_COORDINATE_VECTOR" => (f.vector(1), f.vector(4)),
        _ => {
            let nodes = [1, 2, 3].map(|i| {
                let node = problem.node_index.get(&f.id(i)).map(|n| problem.nodes[*n as usize].x);
                if node.is_none() {
                    f.fault(i, "a node of the deck", "name one");
                }
                node.unwrap_or_default()
            });
            if f.integer(4) != 0 {
                f.fault(4, "a system that stands", "leave FLAG at 0");
            }
            (minus(nodes[1], nodes[0]), minus(nodes[2], nodes[0]))
        }
    };
    let z = cross(x, plane);
    let directions = [x, cross(z, x), z].map(unit);
    match directions {
        [Some(x), Some(y), Some(z)] => {
            problem.systems.insert(f.id(0), [x, y, z]);
        }
        _ => f.fault(0, "three points that are not on a line", "move one"),
    }
}

/// `*DEFINE_VECTOR`, with headings or without.
pub(super) fn read_vectors(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let titled = block.keyword.ends_with("_TITLE");
    let cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
    for card in cards.skip(usize::from(titled)).step_by(1 + usize::from(titled)) {
        let f = context.fields(card, block.width, &TENS);
        if f.integer(7) != 0 {
            f.fault(7, "a vector of the global axes", "leave CID blank");
        }
        match unit(minus(f.vector(4), f.vector(1))) {
            Some(direction) => {
                problem.vectors.insert(f.id(0), direction);
            }
            None => f.fault(4, "a head apart from the tail", "give XH, YH, ZH"),
        }
    }
}

/// `*DEFINE_BOX`.
pub(super) fn read_box(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    for card in &block.cards {
        let f = context.fields(card, block.width, &TENS);
        let bounds = [0, 1].map(|end| [1, 3, 5].map(|i| f.real(i + end, 0.0)));
        problem.boxes.insert(f.id(0), bounds);
    }
}

/// Definitions that do nothing unless another keyword names them; those that name them are refused or do without.
const NAMED: [&str; 12] = [
    "DEFINE_BOX_",
    "DEFINE_COORDINATE_",
    "DEFINE_CURVE_",
    "DEFINE_FRICTION",
    "DEFINE_FUNCTION",
    "DEFINE_HEX_SPOTWELD",
    "DEFINE_PLANE",
    "DEFINE_REGION",
    "DEFINE_SD_ORIENTATION",
    "DEFINE_TABLE",
    "DEFINE_TRACER_PARTICLES",
    "DEFINE_TRANSFORMATION",
];

/// Every other `*DEFINE_`.
pub(super) fn read_other(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let word = block.keyword.as_str();
    if !NAMED.iter().any(|known| word.starts_with(known)) {
        context.log.fault(
            block.at,
            format!("*{}", context.log.quote(word)),
            "a *DEFINE_ of the table in deck/README.md",
            "take it out; leaving it out may change what is computed",
        );
        return;
    }
    if ["DEFINE_CURVE", "DEFINE_TABLE", "DEFINE_FUNCTION"].iter().any(|kind| word.starts_with(kind)) {
        let head = block.card(0);
        // Only to tell what a number is that was taken for a curve's.
        if let Ok(id) = context.fields(&head, block.width, &TENS).words(0).parse() {
            problem.other_curves.insert(id, (head.at, word.to_string()));
        }
    }
    context.log.ignore(block.at, word);
}
