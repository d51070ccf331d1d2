//! The kind of the elements of a part: `shell`, `beam`, `truss`, `cable` or `spring`; solids without any of them.

use mechanics::element::spring2::{Damper, Elastic, Line, Spring};

use super::{beam, shell};
use crate::{
    limits::MAX_CURVE_POINTS,
    table::{Range, Table, Value},
    typed::part::Kind,
};

/// The key that says the kind.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Word {
    Shell,
    Beam,
    Truss,
    Cable,
    Spring,
}

impl Word {
    const ALL: [Self; 5] = [Self::Shell, Self::Beam, Self::Truss, Self::Cable, Self::Spring];

    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Shell => "shell",
            Self::Beam => "beam",
            Self::Truss => "truss",
            Self::Cable => "cable",
            Self::Spring => "spring",
        }
    }

    fn read(self, value: Value<'_>, name: &str) -> Option<Kind> {
        match self {
            Self::Shell => shell::read(value, name).map(Kind::Shells),
            Self::Beam => beam::read(value, name),
            Self::Truss => read_truss(value, name),
            Self::Cable => read_cable(value, name),
            Self::Spring => read_spring(value, name).map(Kind::Springs),
        }
    }
}

/// The first of these keys that a part has, and the kind, none after a fault.
pub(super) fn read<'a>(table: &Table<'a>, name: &str) -> (Option<(Word, Value<'a>)>, Option<Kind>) {
    let given = Word::ALL.into_iter().filter_map(|word| table.get(word.key()).map(|value| (word, value)));
    let given: Vec<(Word, Value<'a>)> = given.collect();
    let kind = match given[..] {
        [] => Some(Kind::Solids),
        [(word, value)] => word.read(value, name),
        [.., (_, last)] => {
            let expected = format!("one of {}", Word::ALL.map(Word::key).join(", "));
            last.fault(&expected, "remove the others; a part has elements of one kind");
            None
        }
    };
    (given.first().copied(), kind)
}

/// `truss = { area }`.
fn read_truss(value: Value<'_>, name: &str) -> Option<Kind> {
    let table = value.table(format!("truss of \"{name}\""))?;
    let area = table.number("area", Range::Positive);
    table.finish();
    area.map(|area| Kind::Trusses { area })
}

/// `cable = { area, tension }`.
fn read_cable(value: Value<'_>, name: &str) -> Option<Kind> {
    let table = value.table(format!("cable of \"{name}\""))?;
    let area = table.number("area", Range::Positive);
    let tension = table.number_or("tension", 0.0, Range::NotNegative);
    table.finish();
    area.map(|area| Kind::Cables { area, tension })
}

/// `spring = { stiffness, tangent, yield_force or points; damping or damper_points; offset }`.
fn read_spring(value: Value<'_>, name: &str) -> Option<Spring> {
    let table = value.table(format!("spring of \"{name}\""))?;
    let elastic = read_elastic(&table);
    let damper = read_damper(&table);
    let offset = table.get("offset").map_or(Some(0.0), |value| value.number(Range::Any));
    table.finish();
    let spring = Spring { elastic: elastic?, damper: damper?, offset: offset? };
    if (&spring.elastic, &spring.damper) == (&Elastic::None, &Damper::None) {
        value.fault("a stiffness, points, a damping or damper_points", "give the law of the spring");
        return None;
    }
    if let Some(expected) = spring.fault() {
        value.fault(expected, "correct the law of the spring");
        return None;
    }
    Some(spring)
}

fn read_elastic(table: &Table<'_>) -> Option<Elastic> {
    let stiffness = table.get("stiffness");
    let [tangent, yields] = ["tangent", "yield_force"].map(|key| table.get(key));
    if let Some(points) = table.get("points") {
        if let Some(other) = stiffness.or(tangent).or(yields) {
            other.fault("points or a stiffness", "remove one of them");
            return None;
        }
        return read_line(points, "elongation").map(Elastic::Curve);
    }
    let Some(stiffness) = stiffness else {
        if let Some(other) = tangent.or(yields) {
            other.fault("a stiffness beside it", "give the stiffness up to the yield force");
            return None;
        }
        return Some(Elastic::None);
    };
    let stiffness = stiffness.number(Range::Positive);
    match (tangent, yields) {
        (None, None) => stiffness.map(|stiffness| Elastic::Linear { stiffness }),
        (Some(tangent), None) => {
            tangent.fault("a yield_force beside it", "give the force at which the spring yields");
            None
        }
        (tangent, Some(yields)) => {
            let tangent = tangent.map_or(Some(0.0), |value| value.number(Range::NotNegative));
            let yields = yields.number(Range::Positive);
            Some(Elastic::Plastic { stiffness: stiffness?, tangent: tangent?, yields: yields? })
        }
    }
}

fn read_damper(table: &Table<'_>) -> Option<Damper> {
    match (table.get("damping"), table.get("damper_points")) {
        (None, None) => Some(Damper::None),
        (Some(damping), None) => damping.number(Range::Positive).map(|damping| Damper::Linear { damping }),
        (None, Some(points)) => read_line(points, "rate").map(Damper::Curve),
        (Some(damping), Some(_)) => {
            damping.fault("damping or damper_points", "remove one of them");
            None
        }
    }
}

/// A list of `[x, force]`.
fn read_line(value: Value<'_>, x: &str) -> Option<Line> {
    let items = value.items()?;
    if items.len() > MAX_CURVE_POINTS {
        value.fault(&format!("at most {MAX_CURVE_POINTS} points"), "leave out those that lie on a line");
        return None;
    }
    let expected = format!("[{x}, force]");
    let points = items.iter().map(|item| item.numbers::<2>(&expected, Range::Any));
    Some(Line { points: points.collect::<Option<_>>()? })
}
