//! `*DEFINE_`: curves, boxes, coordinate systems.

use super::{
    cards::Block,
    fields::{Context, TENS},
    problem::{CurveCard, Problem},
};
use crate::{
    fault::short,
    geometry::{cross, sub as minus, unit},
};

/// `*DEFINE_CURVE`.
pub(super) fn read_curve(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let head = block.card(0);
    let f = context.fields(head, block.width, &TENS);
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
    let id = problem.number("curve", &f, context);
    problem.curves.insert(id, CurveCard { points, relaxation, offset: sa * oa });
}

/// `*DEFINE_COORDINATE_`: a set of cards for each system.
pub(super) fn read_systems(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let each = if block.keyword == "DEFINE_COORDINATE_SYSTEM" { 2 } else { 1 };
    for first in (0..block.cards.len().max(1)).step_by(each) {
        read_system(problem, block, first, context);
    }
}

/// The three directions of the system whose cards begin with `first`: x from the origin, the xy plane through a third point.
fn read_system(problem: &mut Problem, block: &Block<'_>, first: usize, context: &Context<'_>) {
    let f = context.fields(block.card(first), block.width, &TENS);
    let (x, plane) = match block.keyword.as_str() {
        "DEFINE_COORDINATE_SYSTEM" => {
            let g = context.fields(block.card(first + 1), block.width, &TENS);
            if f.integer(7) != 0 {
                f.fault(7, "no system inside a system", "give points in global coordinates");
            }
            let origin = f.vector(1);
            (minus(f.vector(4), origin), minus(g.vector(0), origin))
        }
        "DEFINE_COORDINATE_VECTOR" => {
            if f.integer(7) != 0 {
                f.fault(7, "a system that stands: it does not turn with a node", "leave NID blank");
            }
            (f.vector(1), f.vector(4))
        }
        _ => {
            let nodes = [1, 2, 3].map(|i| {
                let node = problem.node_index.get(&f.id(i)).map(|n| problem.nodes[*n as usize].x);
                if node.is_none() {
                    f.fault(i, "a node of the deck", "name one");
                }
                node.unwrap_or_default()
            });
            if !matches!(f.words(5).to_ascii_uppercase().as_str(), "" | "0" | "X") {
                let expected = "DIR X: the second node lies on the axis x, the third in the plane of x and y";
                f.fault(5, expected, "leave it blank, and name the nodes in that order");
            }
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
            let id = problem.number("coordinate system", &f, context);
            problem.systems.insert(id, [x, y, z]);
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
                let id = problem.number("vector", &f, context);
                problem.vectors.insert(id, direction);
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
        if let Some(a) = (0..3).find(|a| bounds[0][*a] > bounds[1][*a]) {
            let expected = format!("a maximum not below the minimum, {}", short(bounds[0][a]));
            f.fault(2 * a + 2, expected, "exchange the two: nothing is inside this box");
        }
        let id = problem.number("box", &f, context);
        problem.boxes.insert(id, bounds);
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
        if let Ok(id) = context.fields(head, block.width, &TENS).words(0).parse() {
            problem.other_curves.insert(id, (head.at, word.to_string()));
        }
    }
    block.ignore(context.log);
}
