//! `[contact]` and `[[join]]`.

use mechanics::contact::Limit;

use super::entry::{parts, text};
use crate::{
    limits::MAX_ENTRIES,
    place::{Place, Placed},
    table::{Range, Table, Value},
    typed::{
        condition::Parts,
        contact::{Contact, Gap, Join, Pair, Slack, Tie},
    },
};

/// Reads every `[[join]]`.
pub(super) fn read_joins(deck: &Table<'_>) -> Vec<Join> {
    let join = |table: Table<'_>| {
        let value = table.require("parts", "\"all\" or a list of at least two part names");
        let tolerance =
            table.number_or("tolerance", 1e-3, Range::Within(0.0, 0.5, "a number above 0 and at most 0.5"));
        let at = value.map_or(table.place(), |v| Place::text(v.at));
        table.finish();
        Join { at, parts: value.map_or(Parts::Broken, parts), tolerance }
    };
    deck.tables("join", MAX_ENTRIES).into_iter().map(join).collect()
}

/// Reads `[contact]`.
pub(super) fn read(deck: &Table<'_>) -> Option<Contact> {
    let table = deck.get("contact")?.table("[contact]".to_string())?;
    let friction = table.number_or("friction", 0.0, Range::NotNegative);
    let friction_kinetic = table.get("friction_kinetic").and_then(|v| v.number(Range::NotNegative));
    let friction_decay = table.number_or("friction_decay", 0.0, Range::NotNegative);
    let flag = |key| table.get(key).and_then(|v| v.boolean());
    let default_interacts = flag("default_interacts").unwrap_or(true);
    let self_interaction = table.get("self_interaction").map(parts);
    let pairs = read_pairs(&table);
    let ties = read_ties(&table);
    let gap = read_gap(&table);
    let slack = match (table.get("slack_gaps"), table.get("slack_length")) {
        (Some(_), Some(second)) => {
            second.fault("one of slack_gaps and slack_length", "remove one of the two");
            Slack::Broken
        }
        (None, Some(length)) => length.number(Range::Positive).map_or(Slack::Broken, Slack::Length),
        (Some(gaps), None) => gaps.number(Range::Positive).map_or(Slack::Broken, Slack::Gaps),
        (None, None) => Slack::Default,
    };
    let stiffness = Range::Within(0.0, 1.0, "a number above 0 and at most 1");
    let stiffness = table.get("stiffness").and_then(|v| v.number(stiffness));
    let friction_velocity = table.get("friction_velocity").and_then(|v| v.number(Range::Positive));
    let edges = flag("edges").unwrap_or(false);
    let initial = table.get("initial_penetration").and_then(|v| v.one_of(&["refuse", "ignore"]));
    let at = table.place();
    table.finish();
    Some(Contact {
        at,
        friction,
        friction_kinetic,
        friction_decay,
        default_interacts,
        self_interaction,
        pairs,
        ties,
        gap,
        slack,
        stiffness,
        friction_velocity,
        edges,
        ignores_initial: initial == Some(1),
    })
}

/// `[[contact.pair]]`: whether two parts interact, and their friction.
fn read_pairs(table: &Table<'_>) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for pair in table.tables("pair", MAX_ENTRIES) {
        let parts = pair.require("parts", "two part names");
        let both = parts.and_then(|v| v.fixed::<2>("two part names").map(|both| (v, both)));
        let interacts = pair.get("interacts").and_then(|v| v.boolean()).unwrap_or(true);
        let friction = pair.get("friction").and_then(|v| v.number(Range::NotNegative));
        let friction_kinetic = pair.get("friction_kinetic").and_then(|v| v.number(Range::NotNegative));
        pair.finish();
        let Some((value, both)) = both else { continue };
        let [Some(a), Some(b)] = both.map(text) else { continue };
        pairs.push(Pair { origin: value.origin(), parts: [a, b], interacts, friction, friction_kinetic });
    }
    pairs
}

/// Default distance of a tied node from its face over the smallest edge of both parts: that of nodes which a join merges.
const TOLERANCE: f64 = 1e-3;

/// `[[contact.tie]]`: nodes of one part tied to faces of another.
fn read_ties(table: &Table<'_>) -> Vec<Tie> {
    let mut ties = Vec::new();
    for tie in table.tables("tie", MAX_ENTRIES) {
        let at = tie.place();
        let [nodes, faces] = ["nodes", "faces"].map(|key| {
            let value = tie.require(key, "the name of a [[part]], or a list of them");
            value.and_then(one_or_several)
        });
        let range = Range::Within(0.0, 0.1, "a number above 0 and at most 0.1");
        let tolerance = tie.number_or("tolerance", TOLERANCE, range);
        let limits = [("tensile_strength", "tensile_force"), ("shear_strength", "shear_force")]
            .map(|keys| limit(&tie, keys));
        tie.finish();
        if let (Some(nodes), Some(faces)) = (nodes, faces) {
            ties.push(Tie { at, nodes, faces, tolerance, limits });
        }
    }
    ties
}

/// At what a tie breaks, by stress or by force of a node.
fn limit(tie: &Table<'_>, (stress, force): (&'static str, &'static str)) -> Option<Limit> {
    match (tie.get(stress), tie.get(force)) {
        (Some(_), Some(second)) => {
            second.fault(&format!("one of {stress} and {force}"), "remove one of the two");
            None
        }
        (Some(value), None) => value.number(Range::Positive).map(Limit::Stress),
        (None, Some(value)) => value.number(Range::Positive).map(Limit::Force),
        (None, None) => None,
    }
}

/// A name, or a list of names.
fn one_or_several(value: Value<'_>) -> Option<Vec<Placed<String>>> {
    if value.is_text() {
        return text(value).map(|name| vec![name]);
    }
    match parts(value) {
        Parts::Named(names) => Some(names),
        Parts::All | Parts::Broken => None,
    }
}

fn read_gap(table: &Table<'_>) -> Gap {
    match (table.get("gap_fraction"), table.get("gap_length")) {
        (Some(_), Some(second)) => {
            second.fault("one of gap_fraction and gap_length", "remove one of the two");
            Gap::Broken
        }
        (None, None) => Gap::Default,
        (Some(value), None) if value.is_text() => value.one_of(&["fit"]).map_or(Gap::Broken, |_| Gap::Fit),
        (Some(value), None) => {
            value.number(Range::Positive).map_or(Gap::Broken, |x| Gap::Fraction(x, value.origin()))
        }
        (None, Some(value)) => {
            value.number(Range::Positive).map_or(Gap::Broken, |x| Gap::Length(x, value.origin()))
        }
    }
}
